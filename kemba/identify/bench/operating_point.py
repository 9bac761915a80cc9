"""What a bench log's rows saw: the piston's motion and load, and the valves' switching."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kemba.effects.pneumatics.switching import changes
from kemba.identify.compare.force_profiles import LAGS, ForceChannel, risen
from kemba.identify.evidence.operating_point import OperatingPoint
from kemba.identify.evidence.problem import Array

if TYPE_CHECKING:
    from kemba.identify.bench.bench_log import BenchLog
    from kemba.identify.bench.problem import BenchProblem

Switchings = dict[str, tuple[Array, Array]]


def bench_operating_point(problem: BenchProblem) -> OperatingPoint:
    """The piston at every row: imposed motion, and the rod force that the model predicts."""
    parts = []
    for i, run in enumerate(problem.logs):
        force, _ = problem.predict({}, i)["piston/F"]
        table = np.stack([run.motion.x, run.motion.v, force])
        parts += [table[:, run.keep[channel]] for channel in run.measured]
    x, v, force = np.concatenate(parts, axis=1)
    return OperatingPoint(x, v, force, problem.model.mechanism.stroke)


def switchings(run: BenchLog) -> Switchings:
    """Valve name -> instants of the commands and +1 or -1 for on and off."""
    sides = zip(("extend", "retract"), run.commands, strict=True)
    return {f"valve/{side}": changes(sent) for side, sent in sides}


def bench_port(problem: BenchProblem) -> ForceChannel:
    """The rod: what is missing shows in its force channel, sample by sample."""
    around, rows = bench_operating_point(problem), problem.rows()
    force = rows.channel == rows.channels.index("piston/F")
    sigma = _sigma(problem)

    def columns(flags: Array) -> Array:
        return np.asarray(flags * (force / sigma)[:, None])

    moving = force & (rows.phase == "moving")
    quantities = {
        "speed [m/s]": np.where(moving, around.v, np.nan),
        "position [mm]": np.where(force, 1e3 * around.x, np.nan),
        "model force [N]": np.where(force, around.force, np.nan),
    }
    after = {}
    for side in ("extend", "retract"):
        after[side] = np.zeros((len(rows), len(LAGS) - 1))
        for i, run in enumerate(problem.logs):
            own = rows.run == i
            after[side][own] = risen(*switchings(run)[f"valve/{side}"], rows.time[own])
    return ForceChannel("rod", "N", 10.0, quantities, columns, after)


def _sigma(problem: BenchProblem) -> Array:
    """1 sigma (n,) that every row was divided by."""
    return np.concatenate(
        [
            np.sqrt(variance)[run.keep[channel]]
            for i, run in enumerate(problem.logs)
            for channel, (_, variance) in problem.predict({}, i).items()
        ]
    )
