"""What a bench log's rows saw: the piston's motion and load, and the valves' switching."""

from __future__ import annotations

import numpy as np

from kemba.effects.pneumatics.switching import changes
from kemba.identify.bench.bench_log import BenchLog, BenchLogSettings
from kemba.identify.bench.predicted import PredictedLogs
from kemba.identify.compare.force_profiles import lags, risen
from kemba.identify.problem.types import Array, Changes, ForceChannel, OperatingPoint, Rows


def bench_operating_point(predicted: PredictedLogs, stroke: float) -> OperatingPoint:
    """The piston at every row: imposed motion, and the rod force that the model predicts.

    `stroke` [m] of the rig's cylinder.
    """
    parts = []
    for i, log in enumerate(predicted.logs):
        force, _ = predicted.readings({}, i)["piston/F"]
        table = np.stack([log.motion.x, log.motion.v, force])
        parts += [table[:, log.keep[channel]] for channel in log.measured]
    x, v, force = np.concatenate(parts, axis=1)
    return OperatingPoint(x, v, force, stroke)


def switchings(log: BenchLog) -> Changes:
    """Valve name -> instants [s] of the commands, and +1 or -1 for on and off."""
    sides = zip(("extend", "retract"), log.commands, strict=True)
    return {f"valve/{side}": changes(sent) for side, sent in sides}


def bench_force_channel(predicted: PredictedLogs, rows: Rows, at: OperatingPoint) -> ForceChannel:
    """The rod: a missing force shows in the force channel, sample by sample."""
    force = rows.channel == rows.channels.index("piston/F")
    sigma = _sigma(predicted)

    def columns(flags: Array) -> Array:
        return np.asarray(flags * (force / sigma)[:, None])

    moving = force & (rows.phase == "moving")
    quantities = {
        "speed [m/s]": np.where(moving, at.v, np.nan),
        "position [mm]": np.where(force, 1e3 * at.x, np.nan),
        "model force [N]": np.where(force, at.force, np.nan),
    }
    after = {}
    for side in ("extend", "retract"):
        after[side] = np.zeros((len(rows), len(lags()) - 1))
        for i, log in enumerate(predicted.logs):
            own = rows.run == i
            after[side][own] = risen(*switchings(log)[f"valve/{side}"], rows.time[own])
    usual = BenchLogSettings.friction
    return ForceChannel("rod", "N", usual, quantities, columns, after)


def _sigma(predicted: PredictedLogs) -> Array:
    """1 sigma (n,) that every row was divided by, in the row's unit."""
    return np.concatenate(
        [
            np.sqrt(variance)[log.keep[channel]]
            for i, log in enumerate(predicted.logs)
            for channel, (_, variance) in predicted.readings({}, i).items()
        ]
    )
