"""As high as it can.

The task maximises the height of the body's centre; supply pressure and motors set the limit.
"""

from pictures import save

import kemba

jump = kemba.plan("max_jump.yaml")
print(f"{jump.certificate['apex_m']:.3f} m: {jump.sentence}")
save(jump.figure())
