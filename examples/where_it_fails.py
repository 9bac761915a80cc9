"""Where the planning model fails.

The plant has what plans lack: orifices, droop, friction, leakage. Compare finds the conditions in
which that matters.
"""

from pictures import save

import kemba

jump = kemba.plan("jump.yaml")
done = kemba.simulate(jump, repeat=2, noise=True, seed=1)
found = kemba.compare(done.logs, run=jump.path)
print(found.sentence)
save(found.figure())
