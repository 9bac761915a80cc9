"""One stride of a bound.

It ends as it begins: rear feet, flight, front feet, flight. Five strides in a row, open loop, tell
how errors grow.
"""

from pictures import animate, save

import kemba

motion = kemba.plan("bound.yaml")
print(motion.sentence)
assert motion.good
save(motion.figure())
animate(motion.path)
