"""Another robot.

`hound` is shipped: longer legs, more mass, legs called left and right, a 32 mm bore.
"""

from pictures import save

import kemba

asked = {"height": "0.6 m", "duration": "0.45 s", "nodes": 30, "goals.apex.maximise": False}
jump = kemba.plan("max_jump.yaml", model="hound", **asked)
print(jump.sentence)
save(jump.figure())
