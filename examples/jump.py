"""A jump of half a metre.

The shipped task, planned and certified: hip torques, valve times, contact forces.
"""

from pictures import save

import kemba

jump = kemba.plan("jump.yaml")
print(jump.sentence)
assert jump.good
save(jump.figure())
