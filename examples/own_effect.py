"""An effect of one's own.

A magnet holds each retracted piston: one formula in a model's YAML. The plan that knows it opens
its valves for longer.
"""

from pathlib import Path

from pictures import save

import kemba
from kemba import plotting

Path("with_magnet.yaml").write_text(
    """\
name: with-magnet
base: planning
effects:
  - kind: expression
    name: magnet
    on: piston
    force: "-F0*exp(-(x/d)**2)"
    parameters: {F0: 30 N, d: 5 mm}
""",
    encoding="utf-8",
)
plans = [kemba.plan("jump.yaml"), kemba.plan("jump.yaml", model="with_magnet.yaml", replay=False)]
for plan in plans:
    print(plan.sentence)
save(plotting.draw(plotting.load_sources([plan.path for plan in plans])))
