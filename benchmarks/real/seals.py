"""Eight sets of seals that no rule was made with: is the written model the one that predicts best?

KEMBA_DATA=folder python -m benchmarks.real.seals [SET...]

Source as that of the two seals in `cylinder.py`, see registry.yaml.
Of every set one pressure is kept: RMS of the rod's force there, on the rows of a rig's problem in
which it slides for sure, of the model as it is, of `answer/model.yaml`, of `characterise` and of
plain least squares on such rows.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from benchmarks.real.data import ATMOSPHERE, find
from kemba.config import dump_yaml
from kemba.identify.logs.reading import read_logs
from kemba.identify.rigs.characterise import characterise_logs
from kemba.identify.rigs.problem import RigProblem, rig_problem
from kemba.identify.workflow import discover_logs
from kemba.model import load_model, load_spec
from kemba.trajectory import Trajectory

BARS = (1, 3, 5, 7)
SURE = 0.1  # doubt about the direction of the friction, below which a rod slides
LISTED = ("seal_friction", "pressure_friction")


HEAD = (
    "## Eight more seals and shapes",
    "",
    "The same cylinder with seals that no rule was made with. Of each set one pressure is kept (in",
    "brackets): RMS [N] of the rod's force there, on rows in which it slides for sure, of pressure",
    "times area, of `answer/model.yaml`, of `characterise` with both laws of friction",
    "listed, and of plain least squares for gain, F_c and mu on such rows.",
    "",
    "| set (kept) | nominal | discover | characterise | least squares | written | CPU s |",
    "|---|---|---|---|---|---|---|",
)


@dataclass(frozen=True)
class SealSet:
    """Files by the pressure that stands in their names, and which pressures are kept."""

    names: tuple[str, ...]
    bars: tuple[int, ...]
    kept: tuple[int, ...]
    bore: str = "25 mm"


SETS = {
    "NAPN": SealSet(("NAPN",), BARS, (5,)),
    "PK": SealSet(("PK",), BARS, (5,)),
    "NAP310": SealSet(("NAP310",), BARS, (5,)),
    "X-ring": SealSet(("X-ring257",), BARS, (5,)),
    "same seal, runs 1 and 2": SealSet(("rerun1_O-ring257", "rerun2_O-ring257"), BARS, (3,)),
    "re-mounted": SealSet(("reconnected1_O-ring257",), BARS, (3,)),
    "Stadium_lc": SealSet(("Stadium_lc",), (1, 2, 3, 4, 5), (4,)),
    "Kidney_lc": SealSet(("Kidney_lc",), (1, 2, 3, 4, 5, 6, 7), (4, 6)),
}


def log_of(file: Path) -> Trajectory:
    """One record as a log: the first 15 rows dropped as its authors do, x growing outwards."""
    rows = np.loadtxt(file)[15:]
    rows = rows[np.append(True, np.diff(rows[:, 0]) > 0)]
    columns = {
        "piston/x [m]": 0.038 - rows[:, 4] / 1e3,
        "piston/F [N]": rows[:, 6],
        "chamber/extend/P [Pa]": rows[:, 5] * 1e5 + ATMOSPHERE,
    }
    return Trajectory(rows[:, 0] / 1e3, columns, {"kind": "cylinder"})


def logs_of(one: SealSet, scratch: Path, download: bool = False) -> tuple[list[Path], list[Path]]:
    """Logs to learn from and logs that are kept. Raises Absent where a file is not there."""
    learnt, kept = [], []
    for name in one.names:
        for bar in one.bars:
            file = find(f"seals/{name}_{bar}bar.csv", download)
            out = scratch / file.name
            log_of(file).write(out)
            (kept if bar in one.kept else learnt).append(out)
    return learnt, kept


def rms(problem: RigProblem) -> float:
    """RMS [N] of predicted less measured force on the judged rows."""
    gaps = [problem.predictor.gap(log, {})[log.doubt < SURE] for log in problem.logs]
    return float(np.sqrt(np.mean(np.concatenate(gaps) ** 2)))


def predicted(logs: Sequence[Path], model: str | Path) -> float:
    """The same of a model on logs."""
    return rms(rig_problem(read_logs(logs), load_model(model)))


def least_squares(learnt: Sequence[Path], kept: Sequence[Path]) -> float:
    """The same of F = g p A - (F_c + mu |p A|) z, by one call of lstsq."""
    model = load_model("cylinder_rig")

    def columns(paths: Sequence[Path]) -> tuple[np.ndarray, np.ndarray]:
        rows, forces = [], []
        problem = rig_problem(read_logs(paths), model)
        for log in problem.logs:
            sure = log.doubt < SURE
            at = log.rows[sure]
            push = problem.predictor.gap(log, {})[sure] + log.others["piston/F"][at]
            z = np.tanh(log.v[at] / model.mechanism.sign_speed)
            rows.append(np.stack([push, -z, -np.abs(push) * z], axis=1))
            forces.append(log.others["piston/F"][at])
        return np.concatenate(rows), np.concatenate(forces)

    a, y = columns(learnt)
    found = np.linalg.lstsq(a, y, rcond=None)[0]
    a, y = columns(kept)
    return float(np.sqrt(np.mean((y - a @ found) ** 2)))


def row(name: str, scratch: Path, download: bool) -> str:
    """One line of the table."""
    learnt, kept = logs_of(SETS[name], scratch, download)
    started = time.process_time()
    answer, _ = discover_logs(learnt, kept, "cylinder_rig", time_limit=900.0, out=scratch / "a")
    seconds = time.process_time() - started
    listed = scratch / "listed.yaml"
    dump_yaml({"base": "cylinder_rig", "effects": [{"kind": k} for k in LISTED]}, listed)
    characterise_logs(learnt, str(listed)).write_model(scratch / "fitted.yaml", "cylinder_rig")
    errors = [
        predicted(kept, "cylinder_rig"),
        predicted(kept, answer.model or "cylinder_rig"),
        predicted(kept, scratch / "fitted.yaml"),
        least_squares(learnt, kept),
    ]
    effects = load_spec(answer.model).effects if answer.model else ()
    found = ", ".join(e.name for e in effects)
    bars = ", ".join(map(str, SETS[name].kept))
    cells = [f"{name} ({bars} bar)", *(f"{e:.2f}" for e in errors), found, f"{seconds:.0f}"]
    return f"| {' | '.join(cells)} |"


READ = """
Within 5 % of least squares or better are seven of the eight (aimed at: eight). Of the 16 figures
F_c and mu that least squares gives on all records of a set, `discover`'s 95 % intervals hold 10
(aimed at: 14): all ten of NAPN, PK, *same seal*, *re-mounted* and Stadium_lc. Of NAP310 and
X-ring it does not name the constant part (1.0 and 1.9 N), of Kidney_lc not the part that grows
with pressure: its rows count by the learnt colour of the noise, by which that gains too little,
and the part that is named then takes the other's share (7.0 to 11.9 N for Kidney_lc, least
squares 5.7 N). What would be needed is to ask for both laws of one seal together, as one class,
before the search judges each.
"""


def section(scratch: Path, download: bool) -> list[str]:
    """Lines of the page about the seals."""
    return [*HEAD, *(row(name, scratch, download) for name in SETS), READ]


def main() -> None:
    """Print the table, a line as it is known."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sets", nargs="*", choices=[*SETS, []], default=[])
    print("\n".join(HEAD))
    for name in parser.parse_args().sets or SETS:
        with tempfile.TemporaryDirectory() as folder:
            print(row(name, Path(folder), False), flush=True)


if __name__ == "__main__":
    main()
