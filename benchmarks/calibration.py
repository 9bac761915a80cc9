"""Are p-values and intervals of `discover` what they say, on machines that differ?

    python benchmarks/calibration.py                     # 10 machines
    python benchmarks/calibration.py --cases 200         # the study, about half an hour of CPU
    python benchmarks/calibration.py --cases 10 --from 30 --only clean --length 1

Every case is a machine of its own (figures off by 1 %, its own disturbances and noise) with two
bench logs. Where nothing is missing, the p-value of that must be uniform (Kolmogorov-Smirnov).
Where one effect is missing, the 95 % interval of its size must hold the truth in 93 to 97 %.
Records are added to benchmarks/program.json; benchmarks/program_page.py writes its page from them.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from program import load, put
from scipy.stats import kstest
from twin.cases import bench_case
from twin.measure import Sensors

from kemba.identify.workflow import discover_logs

SEED = 70_000  # no case of it was looked at while the method was built
HIDDEN = ("seal_friction", "valve_delay", "piston_damping", "supply_scale", "gas_spring")
NOISES = (1.0, 0.5, 2.0)
LENGTH, RUNS = 2.0, 2  # s and logs of a case


def clean(number: int, folder: Path, length: float = LENGTH) -> dict[str, Any]:
    """The verdict and p-value where nothing is missing."""
    paths, _ = case(folder, None, number, length)
    answer = discover_logs(paths)[0]
    return {"verdict": answer.verdict, "p": answer.p_value_nothing, "added": list(answer.added)}


def missing(number: int, folder: Path, length: float = LENGTH) -> dict[str, Any]:
    """Whether the effect was named alone, and whether its interval holds the truth."""
    effect = HIDDEN[number % len(HIDDEN)]
    paths, truth = case(folder, effect, number, length)
    answer = discover_logs(paths)[0]
    named = tuple(answer.added) == (effect,)
    name, value = next(iter(truth["effects"][0]["parameters"].items()))
    found = answer.ranking[0].parameters.get(name) if named else None
    inside = None if found is None else found.low <= value <= found.high
    return {"effect": effect, "verdict": answer.verdict, "named": named, "inside": inside}


def case(
    folder: Path, effect: str | None, number: int, length: float
) -> tuple[list[Path], dict[str, Any]]:
    """Logs of one machine, each of `length` [s], and the truth."""
    noise = NOISES[number % len(NOISES)]
    sensors = Sensors(noise=noise)
    seed = SEED + number
    return bench_case(folder, effect, seed=seed, runs=RUNS, duration=length, sensors=sensors)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=10)
    parser.add_argument("--from", type=int, default=0, dest="first")
    parser.add_argument("--only", choices=["clean", "missing"], help="of these cases only")
    parser.add_argument("--length", type=float, default=LENGTH, help="seconds of each log")
    arguments = parser.parse_args()
    for number in range(arguments.first, arguments.first + arguments.cases):
        for name, run in (("clean", clean), ("missing", missing)):
            if arguments.only not in (None, name):
                continue
            with tempfile.TemporaryDirectory() as folder:
                found = run(number, Path(folder), arguments.length)
            found["length"] = arguments.length
            kept = load().get("calibration", {}).get(name, {})
            put("calibration", name, {**kept, str(number): found})
            print(number, name, found, flush=True)
    report()
    return 0


def report() -> None:
    """What all records together say."""
    whole = load().get("calibration", {})
    p = [found["p"] for found in whole.get("clean", {}).values() if found["p"] is not None]
    inside = [f["inside"] for f in whole.get("missing", {}).values() if f["inside"] is not None]
    wrong = sum(f["verdict"] != "nothing" for f in whole.get("clean", {}).values())
    if p:
        print(f"{len(p)} clean: {wrong} false alarms; KS p = {kstest(p, 'uniform').pvalue:.3g}")
    if inside:
        print(f"{sum(inside)} of {len(inside)} intervals hold the truth")


if __name__ == "__main__":
    sys.exit(main())
