"""A piston on the bench.

The dynamometer of the paper, simulated: force against speed for each pair of valves (Fig. 6).
"""

import subprocess
from pathlib import Path

from pictures import save

from kemba import plotting

command = ["kemba-opt", "simulate", "dynamometer.yaml", "--noise", "--out", "bench", "--force"]
subprocess.run(command, check=True, capture_output=True)
print(f"{len(list(Path('bench').glob('*.csv')))} logs")
save(plotting.plot_rig(plotting.bench_logs(Path("bench"))))
