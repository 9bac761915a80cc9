"""Which effect is missing.

A machine with seal friction that the plan knows nothing of: logs of three motions, one answer.
"""

from pathlib import Path

from pictures import save

import kemba

Path("machine.yaml").write_text(
    "name: machine\nbase: planning\neffects:\n  - {kind: seal_friction, F_c: 12 N}\n",
    encoding="utf-8",
)
logs = []
for number, task in enumerate(("jump.yaml", "hop.yaml", "stand.yaml")):
    motion = kemba.plan(task)
    logs += kemba.simulate(motion, plant="machine.yaml", noise=True, seed=number).logs
found = kemba.discover(logs)
print(found.sentence)
assert found.ranking[0].effect == "seal_friction"
save(found.figure())
