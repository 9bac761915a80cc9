"""The shoulder of a double pendulum while its elbow does not move: one log, split in time.

KEMBA_DATA=folder python -m benchmarks.real.shoulder
"""

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.real.data import find
from benchmarks.real.pendulum import least_squares
from benchmarks.real.say import listed, said
from benchmarks.real.seals import predicted
from kemba.identify.workflow import discover_logs
from kemba.trajectory import Trajectory

MODEL = str(Path(__file__).with_name("shoulder.yaml"))
LOG = "double_pendulum/20230629-143906/trajectory.csv"
THIRDS = 3
EXPECTED = """## The shoulder of a double pendulum

DFKI's double pendulum (design C.1, log 143906; BSD-3), 10 s at 500 Hz in which the elbow stays
within a step of its encoder. Model: `benchmarks/real/shoulder.yaml`, both links in one line by
the figures of model 1.0 that are published with the data, without friction. Each third of the
time is kept in turn. Written before `discover` was asked:

- Published Coulomb friction: 0.16 (model 1.0), 0.175 (2.0) and 0.033 N.m (3.0), viscous 0.001,
  0.0037 and 0.049 N.m.s.
- Friction of 0.13 to 0.2 N.m is expected in all splits, with intervals that overlap, and held-out
  torque as good as by least squares with the same effects.

| kept third | drawing | discover | least squares, same effects as far as linear | verdict |
|---|---|---|---|---|"""

NOTES = (
    "Sliding friction and damping are named in all splits, with intervals that overlap; at first, "
    "two laws of one friction shared it in another way in every third, and one was `unknown`. The "
    "friction is less than published, since a second law and a torque that reads wrong take a part "
    "of it: the shoulder swings by 0.3 rad near its own frequency, where weight and inertia nearly "
    "cancel, and least squares keeps 14 to 36 % of the drawing's torque. What would be needed are "
    "runs that are slower and wider (the elbow stays still in this one alone).",
)


def section(scratch: Path, download: bool) -> list[str]:
    """Lines of the page about the shoulder."""
    rows = np.loadtxt(find(LOG, download), delimiter=",", skiprows=1)
    rows = rows[np.append(True, np.diff(rows[:, 0]) > 0)]
    logs = []
    for number, part in enumerate(np.array_split(rows, THIRDS)):
        columns = {"axis/q [rad]": part[:, 1], "axis/tau [N.m]": part[:, 13]}
        logs.append(scratch / f"third_{number + 1}.csv")
        Trajectory(part[:, 0], columns, {"kind": "drive"}).write(logs[-1])
    table, sentences = [EXPECTED], [""]
    for number, kept in enumerate(logs):
        learnt, out = [log for log in logs if log != kept], scratch / f"answer_{number}"
        answer, _ = discover_logs(learnt, [kept], MODEL, time_limit=900.0, out=out)
        errors = (
            predicted([kept], MODEL),
            predicted([kept], answer.model or MODEL),
            least_squares(learnt, [kept], answer.added, MODEL),
        )
        told = " | ".join(f"{e:.3f}" for e in errors)
        table.append(f"| {number + 1} | {told} | `{answer.verdict}` |")
        sentences += [f"Without third {number + 1}:", "", said(answer), ""]
    return [*table, *sentences, *listed(NOTES), ""]


def main() -> None:
    """Print the section."""
    with tempfile.TemporaryDirectory() as folder:
        print("\n".join(section(Path(folder), False)))


if __name__ == "__main__":
    main()
