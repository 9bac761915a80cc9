"""Sound logs, to be damaged: a short bench log of the planning model, and a hop of the twin."""

from functools import lru_cache

import numpy as np

from kemba.effects.pneumatics.switching import pulses
from kemba.identify.bench.bench_log import SmoothedMotion
from kemba.identify.bench.prediction import RigModel
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

SECONDS = 0.6


@lru_cache
def bench() -> Trajectory:
    """A bench log in which nothing is missing."""
    rng = np.random.default_rng(0)
    time = np.arange(0.0, SECONDS, 1e-3)
    angle = 2 * np.pi * time / 0.3
    x, v = 0.035 + 0.02 * np.sin(angle), 0.02 * 2 * np.pi / 0.3 * np.cos(angle)
    path = SmoothedMotion(time, x, v, np.gradient(v, time), np.zeros(len(time)), 0.0)
    sent = (rng.random((6, 2)) < 0.5)[(time / 0.1).astype(int)].T.astype(float)
    rig = RigModel(load_model(rig=True), (), ())
    force = rig.predict(path, (pulses(time, sent[0]), pulses(time, sent[1])), {}).force
    noise = rng.standard_normal((2, len(time)))
    columns = {
        "piston/x [m]": x + 3e-5 * noise[0],
        "valve/extend [1]": sent[0],
        "valve/retract [1]": sent[1],
        "piston/F [N]": force + noise[1],
    }
    return Trajectory(time, columns, {"kind": "bench"})


@lru_cache
def robot() -> Trajectory:
    """A hop of the twin in which nothing is missing; it needs numba."""
    from robot_logs import hops

    return hops(runs=1)[0][0]
