# ruff: noqa: E402  (the twin is found first)
"""Blind test of `discover` on bench logs made by the independent twin in tests/twin.

    python benchmarks/blind/bench.py --out bench.jsonl --part 1/2

Every effect of the catalogue that a rig can show, every sensor fault, pairs, effects outside the
catalogue, and logs in which nothing is missing; sizes and noise in turn, jitter of the nominal
figures, coloured disturbances and seeds drawn; first-order and orifice chambers, with and without
chamber pressures. The cases come in an order of which any beginning is a fair sample; those in
the file are not run again, so an interrupted study goes on where it stopped.
"""

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

import numpy as np
from twin.cases import bench_case
from twin.catalogue import CATALOGUE
from twin.measure import Sensors

from blind import study
from kemba.identify.bench.problem import BenchProblem, bench_problem
from kemba.identify.logs.gate import check_logs
from kemba.identify.logs.reading import read_logs
from kemba.model.spec import load_model

EFFECTS = [name for name, entry in CATALOGUE.items() if entry.bench and entry.known]
UNKNOWN = [name for name, entry in CATALOGUE.items() if entry.bench and not entry.known]
SENSORS = [
    f"{kind}:{channel}"
    for kind in ("sensor_bias", "sensor_scale", "sensor_delay")
    for channel in ("piston/F", "piston/x")
]
PAIRS = [
    ["seal_friction", "valve_delay"],
    ["supply_droop", "piston_damping"],
    ["gas_spring", "hose_lag"],
    ["end_cushion", "supply_scale"],
    ["cross_leak", "stribeck_friction"],
    ["sensor_delay:piston/F", "seal_friction"],
]
SEED = 15000  # cases of other seeds were looked at while the method was built
REPEATS = ((EFFECTS, 6), (SENSORS, 4), (UNKNOWN, 4), (PAIRS, 3), ([None], 30))
SIZES, NOISES = (1.0, 0.7, 1.5), (1.0, 2.0, 0.5)
RIGS = (  # chambers of the rig and of the model, and whether their pressures are measured
    ("first_order", False),
    ("orifice", False),
    ("first_order", True),
    ("first_order", False),
    ("orifice", True),
    ("first_order", False),
)
MODELS = {"first_order": "planning", "orifice": str(Path(__file__).parent / "orifice_rig.yaml")}
NULLS = 70  # further machines in which nothing is missing, at the end: a hundred in all


def cases(seed: int = SEED) -> list[dict[str, Any]]:
    """Settings of all cases; each kind is spread evenly over the order, before further nulls."""
    rng = np.random.default_rng(seed)
    turns = study.spread(REPEATS, rng)
    turns += [(None, turn) for turn in range(NULLS)]
    found = [_setting(effect, turn, seed + i, rng) for i, (effect, turn) in enumerate(turns)]
    return [{**setting, "colour": study.colour(i)} for i, setting in enumerate(found)]


def _setting(effect: Any, turn: int, seed: int, rng: np.random.Generator) -> dict[str, Any]:
    chambers, pressures = RIGS[turn % len(RIGS)]
    # what drifts from run to run is seen only where two runs can show it
    runs = (4, 5) if effect == "temperature_drift" else (3, 4, 5)
    return {
        "effect": effect,
        "seed": seed,
        "size": SIZES[turn % 3],
        "noise": NOISES[(turn + turn // 3) % 3],
        "chambers": chambers,
        "pressures": pressures,
        "figures_off": float(rng.choice([0.01, 0.02, 0.03])),
        "floor": float(rng.choice([0.0, 0.03])),
        "runs": int(rng.choice(runs)),
        "duration": 4.0,
    }


def logs_of(setting: dict[str, Any], folder: Path) -> tuple[list[Path], dict[str, Any]]:
    """Logs of one case, written to `folder`, and the truth about them."""
    other = ("effect", "noise", "pressures", "colour")
    options = {k: v for k, v in setting.items() if k not in other}
    colour = setting["colour"]
    sensors = Sensors(noise=setting["noise"], pressures=setting["pressures"], **colour)
    return bench_case(folder, setting["effect"], sensors=sensors, **options)


def prepared(setting: dict[str, Any]) -> study.Prepared:
    """The truth about a case, and how its problem is made from logs that are made here."""
    with tempfile.TemporaryDirectory() as folder:
        paths, truth = logs_of(setting, Path(folder))
        logs = read_logs(paths)

    def problem() -> BenchProblem:
        check_logs(logs)
        found = bench_problem(logs, load_model(MODELS[setting["chambers"]], rig=True))
        found.validate()
        return found

    return truth["effects"], problem


if __name__ == "__main__":
    study.main("bench", __doc__, cases, prepared)
