"""Over a hurdle.

20 cm high and 5 cm wide: front feet first, legs folded, then the rear ones, and at rest behind it.
"""

from pictures import animate, save

import kemba

motion = kemba.plan("hurdle.yaml")
print(motion.sentence)  # true on its own model; the simulated robot lands 27 ms late, 23 allowed
save(motion.figure())
animate(motion.path)
