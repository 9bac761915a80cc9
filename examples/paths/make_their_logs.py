"""Three logs of a machine with seal friction, as another program writes them.

Stamps in ms since 1970, degrees, millimetres, semicolons, decimal commas, valves of 24 V, 500 Hz,
texts between the numbers.
"""

import numpy as np
import pandas as pd

import kemba

SCALES = {"rad": ("deg", np.degrees(1)), "m": ("mm", 1e3), "1": ("V", 24), "N.m": ("Nm", 1)}

with open("machine.yaml", "w", encoding="utf-8") as stream:
    stream.write("name: machine\nbase: planning\neffects:\n  - {kind: seal_friction, F_c: 12 N}\n")
for number, height in enumerate(("0.47 m", "0.48 m", "0.5 m"), start=1):
    jump = kemba.plan("jump.yaml", height=height)
    done = kemba.simulate(jump, plant="machine.yaml", noise=True, seed=number)
    log = kemba.load_log(done.logs[0])
    stamps = 1_790_000_000_000 + np.round(log.time * 1e3).astype(np.int64)
    table: dict[str, object] = {"Stamp [ms]": stamps, "State": "jump"}
    for name in log.names:
        unit, scale = SCALES.get(log.unit(name), (log.unit(name), 1))
        table[f"{name.replace('/', ' ')} [{unit}]"] = log[name] * scale
    table["Remark"] = f"attempt {number}; none"
    frame = pd.DataFrame(table).iloc[::2]
    frame.to_csv(f"their_log_{number}.csv", sep=";", decimal=",", index=False)
