"""Small bench logs made by the model itself, to be damaged or to be explained."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from real_data import real

from kemba.effects.pneumatics.switching import pulses
from kemba.identify.bench.bench_log import SmoothedMotion
from kemba.identify.bench.prediction import RigModel
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

BenchLog = Callable[..., Trajectory]


def motion(duration: float, rng: np.random.Generator) -> SmoothedMotion:
    """Smooth random strokes within the piston's travel."""
    time = np.arange(0.0, duration, 1e-3)
    phases = rng.uniform(0, 2 * np.pi, 4)
    rates = 2 * np.pi * np.array([0.7, 1.3, 2.1, 3.7])
    sizes = np.array([0.012, 0.008, 0.005, 0.003])
    angle = rates[:, None] * time + phases[:, None]
    x = 0.035 + sizes @ np.sin(angle)
    v = (sizes * rates) @ np.cos(angle)
    return SmoothedMotion(time, x, v, np.gradient(v, time), np.zeros(len(time)), 0.0)


@pytest.fixture(scope="session")
def bench_log() -> BenchLog:
    """bench_log(effects, duration, seed): a clean log of the planning model with `effects`."""

    def make(effects: tuple = (), duration: float = 2.5, seed: int = 0) -> Trajectory:
        rng = np.random.default_rng(seed)
        path = motion(duration, rng)
        switched = rng.random((int(duration / 0.11) + 1, 2)) < 0.5
        sent = switched[(path.time / 0.11).astype(int)].T.astype(float)
        rig = RigModel(load_model(extra=effects, rig=True), (), ())
        force = rig.predict(
            path, (pulses(path.time, sent[0]), pulses(path.time, sent[1])), {}
        ).force
        noise = rng.standard_normal((2, len(force)))
        columns = {
            "piston/x [m]": path.x + 3e-5 * noise[0],
            "valve/extend [1]": sent[0],
            "valve/retract [1]": sent[1],
            "piston/F [N]": force + noise[1],
        }
        return Trajectory(path.time, columns, {"name": f"run_{seed}", "kind": "bench"})

    return make


@pytest.fixture
def log_file(tmp_path: Path, bench_log: BenchLog) -> Path:
    """A clean bench log on disk."""
    log = bench_log()
    path = tmp_path / "log.csv"
    Trajectory(log.time, {h: log[n] for h, n in zip(log.headers, log.names, strict=True)}).write(
        path
    )
    return path


NOISE = """\
kind: robot
notes: a plan and no measurement; an implicit Euler step of 7 ms is good to half its square times
  the acceleration, which is what stands here as noise
noise:
  body/x [m]: 3.0e-4
  body/z [m]: 3.0e-4
  body/pitch [rad]: 1.0e-3
  front/hip/q [rad]: 5.0e-3
  rear/hip/q [rad]: 5.0e-3
  front/piston/x [m]: 2.0e-3
  rear/piston/x [m]: 2.0e-3
"""


@pytest.fixture
def authors_plan(tmp_path: Path) -> Path:
    """The last 0.77 s of the plan of the paper's authors, every second row, with its sidecar."""
    lines = real("reference/authors_jump_land_0.5m.csv").read_text().splitlines()
    rows = [line for line in lines[1:] if float(line.split(",")[0]) >= 9.95 - 1e-9][::2]
    path = tmp_path / "authors_jump_land.csv"
    path.write_text("\n".join([lines[0], *rows]) + "\n")
    path.with_suffix(".meta.yaml").write_text(NOISE)
    return path
