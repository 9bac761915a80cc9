"""Up into a bound.

From rest the nose comes up, as a bound begins.
"""

from pictures import animate, save

import kemba

motion = kemba.plan("popup.yaml")
print(motion.sentence)
assert motion.good
save(motion.figure())
animate(motion.path)
