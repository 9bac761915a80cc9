"""With half a kilogram on its back.

Two plans for the same height, without and with a payload, drawn over each other.
"""

from pictures import save

import kemba
from kemba import plotting

plans = [kemba.plan("jump.yaml", payload=f"{m} kg") for m in (0.0, 0.5)]
for plan in plans:
    print(plan.path, plan.certificate["cost"]["torque_squared_integral"])
save(plotting.draw(plotting.load_sources([plan.path for plan in plans])))
