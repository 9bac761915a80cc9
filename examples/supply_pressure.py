"""What supply pressure buys.

The same jump at 0.65 and 0.8 MPa: with more pressure the valves open later and shorter.
"""

from pictures import save

import kemba
from kemba import plotting

plans = [kemba.plan("jump.yaml", supply=f"{p} MPa") for p in (0.65, 0.8)]
for plan in plans:
    open_s = plan.certificate["cost"]["valve_open_s"]
    print(f"{plan.path}: valves open for {open_s:.2f} s")
save(plotting.draw(plotting.load_sources([plan.path for plan in plans])))
