"""From rest into a bound.

Pushed off both feet, then front and rear feet in turn, at 1.75 m/s in the end.
"""

from pictures import animate, save

import kemba

motion = kemba.plan("accelerate.yaml")
print(motion.sentence)
assert motion.good
save(motion.figure())
animate(motion.path)
