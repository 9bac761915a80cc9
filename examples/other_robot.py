"""Another robot.

`hound` is shipped: longer legs, more mass, legs called left and right, a 32 mm bore.
"""

import kemba
from pictures import save

jump = kemba.plan("jump.yaml", model="hound", height="0.55 m")
print(jump.sentence)
save(jump.figure())
