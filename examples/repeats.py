"""Three repeats on the plant: Fig. 10 of the paper.

The same table is executed three times with noisy sensors and scattering valves, and drawn over the
plan. The paper saw a spread of 3 cm between repeats on its robot.
"""

from pictures import save

import kemba

jump = kemba.plan("jump.yaml")
done = kemba.simulate(jump, repeat=3, noise=True, seed=1)
print(done.sentence)
save(done.figure())
