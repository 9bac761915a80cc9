"""As high as it can, and landing.

The highest jump from which the robot comes to rest on its feet.
"""

from pictures import animate, save

import kemba

motion = kemba.plan("max_jump_land.yaml")
print(motion.sentence)
assert motion.good
save(motion.figure())
animate(motion.path)
