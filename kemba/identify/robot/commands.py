"""Usual mistakes in the commands of a robot log: valves swapped or inverted, torques turned.

Torques enter the model's motion linearly, so that the residual of the other sign is known without
another fit. Valves act through the air: each hypothesis about them is a log of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kemba.errors import KembaError
from kemba.identify.problem.types import Array, Rows
from kemba.identify.robot.state import LinearisedState
from kemba.trajectory import Trajectory

HINT = "correct it in a column map (--map)"


class CommandSettings:
    """When the commands of a robot log are said to be mixed up."""

    better = 1.5  # factor by which the other sign of torques must leave less


def valve_mix_ups(
    logs: Sequence[Trajectory], legs: Sequence[str]
) -> Iterator[tuple[str, list[Trajectory]]]:
    """Mistakes about valves in words, and the logs with each put right."""
    sides = ("extend", "retract")
    swapped = {
        f"{leg}/valve/{a}": f"{leg}/valve/{b}" for leg in legs for a, b in (sides, sides[::-1])
    }
    yield (
        "valve/extend and valve/retract are swapped",
        [_taken(log, swapped) for log in logs],
    )
    same = {name: name for name in swapped}
    yield (
        "valve/extend and valve/retract are inverted (1 is on)",
        [_taken(log, same, inverted=True) for log in logs],
    )
    if len(legs) == 2:
        crossed = {f"{a}/valve/{side}": f"{b}/valve/{side}" for side in sides
                   for a, b in (legs, legs[::-1])}  # fmt: skip
        yield ("the valves of the legs are swapped", [_taken(log, crossed) for log in logs])


def _taken(log: Trajectory, source: dict[str, str], inverted: bool = False) -> Trajectory:
    """The log with columns taken from others."""
    columns = {f"{name} [1]": log[other] for name, other in source.items()}
    return log.with_columns({h: 1.0 - y if inverted else y for h, y in columns.items()})


def turned_torques(state: LinearisedState, rows: Rows, r: Array) -> Iterator[KembaError]:
    """The sign of the hips' torques, where the other one leaves much less of the residual r (n,) of
    the hips of the model as it is."""
    legs, limits = state.physics.legs, CommandSettings
    hips = [3 + i for i in range(len(legs))]
    groups = [*([(i,) for i in range(len(legs))] if len(legs) > 1 else []), tuple(range(len(legs)))]
    columns = {group: _turned(state, group) for group in groups}
    for run, log in enumerate(state.batch.resampled):
        own = (rows.run == run) & np.isin(rows.channel, hips)
        before = float(np.sqrt(np.mean(r[own] ** 2))) if own.any() else 0.0
        left = {g: float(np.sqrt(np.mean((r + c)[own] ** 2))) for g, c in columns.items()}
        best = min(left, key=left.__getitem__)
        if before and left[best] * limits.better < before:
            whose = "every leg" if len(best) == len(legs) else f"the {legs[best[0]]} leg"
            yield KembaError(
                log.name,
                f"hip/tau of {whose} has the reversed sign",
                f"the hips err by {before:.1f} times their noise from row to row, and by "
                f"{left[best]:.1f} times with the other sign",
                HINT,
            )


def _turned(state: LinearisedState, legs: Sequence[int]) -> Array:
    """What the other sign of these legs' torques adds to the residual (n,)."""
    torque = state.batch.torque
    force = np.zeros((*torque.shape[:2], state.physics.mechanism.n))
    for i in legs:
        force[..., 3 + i] = 2.0 * torque[..., i]
    pushed = state.pushed(state.motion.response(force)[..., None])
    return np.asarray(state.pick(pushed, None)[:, 0])
