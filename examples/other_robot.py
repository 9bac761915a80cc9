"""Another robot.

`hound` is shipped: longer legs, more mass, legs called left and right, a 32 mm bore.
"""

from pictures import save

import kemba

jump = kemba.plan("jump.yaml", model="hound", height="0.55 m")
print(jump.sentence)
save(jump.figure())
