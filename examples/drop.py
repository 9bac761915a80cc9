"""Landing from a drop.

The robot starts in the air. Only the landing is planned: pistons and hips bring the body to rest.
"""

from pictures import save

import kemba

drop = kemba.plan("drop.yaml")
print(drop.sentence)
save(drop.figure())
