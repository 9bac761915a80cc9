"""A jump forwards.

The body travels and lands on both feet; front and rear leg do different work.
"""

from pictures import save

import kemba

jump = kemba.plan("jump_forward.yaml")
print(jump.sentence)
save(jump.figure())
