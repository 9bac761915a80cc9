"""Are p-values and intervals of `discover` what they say, on machines that differ?

    python benchmarks/calibration.py                     # 10 machines
    python benchmarks/calibration.py --cases 200         # the study, about half an hour of CPU
    python benchmarks/calibration.py --cases 10 --from 30 --only clean --length 1
    python benchmarks/calibration.py --machines imperfect
    python benchmarks/calibration.py --machines late --only clean --level 0.05

Every case is a machine of its own, with its own disturbances and noise, and two bench logs. Where
nothing is missing, the p-value of that must be uniform (Kolmogorov-Smirnov). Where one effect is
missing, the 95 % interval of its size must hold the truth in 93 to 97 %. Both can only hold on
machines that differ as the discovery believes:

- `declared`: nominal figures are off by the tolerances that the model declares (declared.py);
- `near`: by half as much, by 1 %. p-values are larger, and intervals hold the truth more often;
- `imperfect`: as declared, and every effect and sensor fault is there with about 5 % of its size,
  but no delay and no lag;
- `late`: with these, too: a machine as the discovery believes in every respect. 5 % of a delay is a
  tenth of a row: an edge then falls before or after a reading.

With another `--level` of the p-value, records are kept apart: they tell of all lower levels, too,
since an answer beyond a level is `nothing`.

Records are added to benchmarks/program.json; benchmarks/program_page.py writes its page from them.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Any
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from declared import robot, small_effects
from program import load, put
from scipy.stats import kstest
from twin.cases import bench_case, draw
from twin.measure import Sensors

from kemba.identify.answer import DiscoverSettings
from kemba.identify.workflow import discover_logs

SEED = 70_000  # no case of it was looked at while the method was built
HIDDEN = ("seal_friction", "valve_delay", "piston_damping", "supply_scale", "gas_spring")
NOISES = (1.0, 0.5, 2.0)
LENGTH, RUNS = 2.0, 2  # s and logs of a case
MACHINES = ("declared", "near", "imperfect", "late")
SPREAD = 0.3  # of the logarithm of a hidden effect's size


def clean(number: int, folder: Path, machines: str, length: float = LENGTH) -> dict[str, Any]:
    """The verdict and p-value where nothing is missing."""
    paths, _ = case(folder, None, number, machines, length)
    answer = discover_logs(paths)[0]
    return {"verdict": answer.verdict, "p": answer.p_value_nothing, "added": list(answer.added)}


def missing(number: int, folder: Path, machines: str, length: float = LENGTH) -> dict[str, Any]:
    """Whether the effect was named alone, and whether its interval holds the truth."""
    effect = HIDDEN[number % len(HIDDEN)]
    paths, truth = case(folder, effect, number, machines, length)
    answer = discover_logs(paths)[0]
    named = tuple(answer.added) == (effect,)
    name, value = next(iter(truth["effects"][0]["parameters"].items()))
    found = answer.ranking[0].parameters.get(name) if named else None
    inside = None if found is None else found.low <= value <= found.high
    return {"effect": effect, "verdict": answer.verdict, "named": named, "inside": inside}


def case(
    folder: Path, effect: str | None, number: int, machines: str, length: float
) -> tuple[list[Path], dict[str, Any]]:
    """Logs of one machine, each of `length` [s], and the truth."""
    sensors, seed = Sensors(noise=NOISES[number % len(NOISES)]), SEED + number
    effects = [draw(effect, 1.0, seed, sensors, SPREAD)] if effect else []
    if machines in ("imperfect", "late"):
        effects += small_effects(seed, sensors, machines == "late", except_for=effect)
    own = None if machines == "near" else robot(seed)
    return bench_case(
        folder, effects, seed=seed, runs=RUNS, duration=length, sensors=sensors, robot=own
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=10)
    parser.add_argument("--from", type=int, default=0, dest="first")
    parser.add_argument("--only", choices=["clean", "missing"], help="of these cases only")
    parser.add_argument("--machines", choices=MACHINES, default=MACHINES[0])
    parser.add_argument("--length", type=float, default=LENGTH, help="seconds of each log")
    usual = DiscoverSettings.significant
    parser.add_argument("--level", type=float, default=usual, help="p-value that is significant")
    arguments = parser.parse_args()
    about = arguments.machines
    if arguments.level != usual:
        about = f"{about} level {arguments.level:g}"
    for number in range(arguments.first, arguments.first + arguments.cases):
        for name, run in (("clean", clean), ("missing", missing)):
            if arguments.only not in (None, name):
                continue
            level = patch.multiple(DiscoverSettings, significant=arguments.level)
            with tempfile.TemporaryDirectory() as folder, level:
                found = run(number, Path(folder), arguments.machines, arguments.length)
            found["length"] = arguments.length
            part = f"{name} {about}"
            kept = load().get("calibration", {}).get(part, {})
            put("calibration", part, {**kept, str(number): found})
            print(number, part, found, flush=True)
    report(about)
    return 0


def report(machines: str) -> None:
    """What all records of such machines together say."""
    whole = load().get("calibration", {})
    clean, hidden = (whole.get(f"{name} {machines}", {}) for name in ("clean", "missing"))
    p = [found["p"] for found in clean.values() if found["p"] is not None]
    inside = [f["inside"] for f in hidden.values() if f["inside"] is not None]
    wrong = sum(f["verdict"] != "nothing" for f in clean.values())
    if p:
        print(f"{len(p)} clean: {wrong} false alarms; KS p = {kstest(p, 'uniform').pvalue:.3g}")
    if inside:
        print(f"{sum(inside)} of {len(inside)} intervals hold the truth")


if __name__ == "__main__":
    sys.exit(main())
