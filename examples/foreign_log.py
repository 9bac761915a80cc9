"""A log of another program.

Stamps since 1970, degrees, millimetres, semicolons, decimal commas, valves in volts: a drafted map
reads it.
"""

import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
from pictures import save

import kemba
from kemba import plotting

jump = kemba.plan("jump.yaml")
log = kemba.load_log(kemba.simulate(jump, noise=True).logs[0])
table = {"Stamp [ms]": (1_790_000_000_000 + np.round(log.time * 1e3)).astype(np.int64)}
scales = {"rad": ("deg", np.degrees(1)), "m": ("mm", 1e3), "1": ("V", 24), "N.m": ("Nm", 1)}
for name in log.names:
    unit, scale = scales.get(log.unit(name), (log.unit(name), 1))
    table[f"{name.replace('/', ' ')} [{unit}]"] = log[name] * scale
table["Remark"] = "third attempt"
pd.DataFrame(table).to_csv("their_log.csv", sep=";", decimal=",", index=False)

subprocess.run(["kemba-opt", "map", "their_log.csv", "--out", "their_map.yaml"], check=True)
print(Path("their_map.yaml").read_text(encoding="utf-8"))
back = kemba.load_log("their_log.csv", "their_map.yaml")
assert np.allclose(back["body/z"], log["body/z"])
back.write("their_log_as_ours.csv")
save(plotting.draw(plotting.load_sources([jump.path, "their_log_as_ours.csv"])))
