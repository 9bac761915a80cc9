"""Another robot.

`hound` is shipped: longer legs, more mass, legs called left and right, a 32 mm bore.
"""

from pictures import save

import kemba
from kemba.config import shipped_configs

tasks = [name for name in shipped_configs("tasks") if "hound" in name]
jump = kemba.plan(tasks[0])
print(jump.sentence)
save(jump.figure())
