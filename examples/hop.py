"""A hop.

Small and quick: the feet leave the ground and come back to the same place.
"""

from pictures import save

import kemba

hop = kemba.plan("hop.yaml")
print(hop.sentence)
save(hop.figure())
