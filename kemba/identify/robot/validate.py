"""Robot logs that contradict themselves or any model: signs turned, valves mixed up, clocks apart.

Torques enter the model's motion linearly, so that the residual of the other sign is known without
another fit. Valves act through the air: each hypothesis about them is a log of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.optimize import lsq_linear

from kemba.errors import KembaError
from kemba.identify.problem.types import Array, Flags, Rows
from kemba.identify.robot.state import LinearisedState
from kemba.trajectory import Trajectory

HINT = "correct it in a column map (--map)"
BETTER = 1.5  # factor by which the other sign of torques must leave less


def valve_mix_ups(
    logs: Sequence[Trajectory], legs: Sequence[str]
) -> Iterator[tuple[str, list[Trajectory]]]:
    """Mistakes about valves in words, and the logs with each put right."""
    sides = ("extend", "retract")
    swapped = {
        f"{leg}/valve/{a}": f"{leg}/valve/{b}" for leg in legs for a, b in (sides, sides[::-1])
    }
    yield ("valve/extend and valve/retract are swapped", [_taken(log, swapped) for log in logs])
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
    legs = state.physics.legs
    hips = [3 + i for i in range(len(legs))]
    groups = [*([(i,) for i in range(len(legs))] if len(legs) > 1 else []), tuple(range(len(legs)))]
    columns = {group: _turned_torque_residual(state, group) for group in groups}
    for run, log in enumerate(state.batch.resampled):
        own = (rows.run == run) & np.isin(rows.channel, hips)
        before = float(np.sqrt(np.mean(r[own] ** 2))) if own.any() else 0.0
        left = {g: float(np.sqrt(np.mean((r + c)[own] ** 2))) for g, c in columns.items()}
        best = min(left, key=left.__getitem__)
        if before and left[best] * BETTER < before:
            whose = "every leg" if len(best) == len(legs) else f"the {legs[best[0]]} leg"
            yield KembaError(
                log.name,
                f"hip/tau of {whose} has the reversed sign",
                f"the hips err by {before:.1f} times their noise from row to row, and by "
                f"{left[best]:.1f} times with the other sign",
                HINT,
            )


def _turned_torque_residual(state: LinearisedState, legs: Sequence[int]) -> Array:
    """What the other sign of these legs' torques adds to the residual (n,)."""
    torque = state.batch.torque
    force = np.zeros((*torque.shape[:2], state.physics.mechanism.n))
    for i in legs:
        force[..., 3 + i] = 2.0 * torque[..., i]
    pushed = state.pushed(state.motion.response(force)[..., None])
    return np.asarray(state.pick(pushed)[:, 0])


# When robot logs contradict themselves or any model.
DEEP = 0.04  # depth of a foot below the ground that no sensor's fault makes [m]
OFTEN = 0.03  # share of the rows in which it must be so deep
ABSURD = 15.0  # rms one-step error, in sigmas, that no missing effect makes
FAULTY = 4.0  # largest fault of a sensor, in sizes


def turned_pitch(runs: Sequence[str]) -> KembaError:
    """The sign of the pitch, where feet stand with the other one only."""
    return KembaError(
        ", ".join(runs),
        "body/pitch has the reversed sign (nose up is positive)",
        "corrected, feet stand on level ground; else legs of other lengths would be needed",
        "correct it with `sign` in a column map (--map)",
    )


def is_absurd(channels: Sequence[str], rows: Rows, r: Array) -> bool:
    """Whether a channel of a run errs by more than any missing effect makes it, sensors right or
    wrong."""
    power = [_power(channels, r, rows, rows.run == i).values() for i in np.unique(rows.run)]
    return max(max(own, default=0.0) for own in power) > ABSURD


def contradictions(
    state: LinearisedState, rows: Rows, r: Array, sensor_columns: Callable[[], Array]
) -> Iterator[KembaError]:
    """What cannot be, run by run.

    `rows` and `r` (n,): the residual of the model as it is. `sensor_columns`: gives the columns
    (n, k) of all sensor faults per size; it is called only where a residual is too large.
    """
    forgiven: Array | None = None
    for i, log in enumerate(state.batch.resampled):
        sunk = list(_sunk(state, i))
        yield from sunk
        own = rows.run == i
        power = _power(state.physics.channels, r, rows, own)
        if max(power.values(), default=0.0) > ABSURD:
            forgiven = _forgiven(r, sensor_columns()) if forgiven is None else forgiven
            power = _power(state.physics.channels, forgiven, rows, own)
        worst = max(power, key=power.__getitem__, default="")
        if worst and power[worst] > ABSURD and not sunk:
            yield KembaError(
                log.name,
                f"{worst} is off by {power[worst]:.0f} times its noise from one row to the next",
                "motion that follows from the commands was expected",
                "are columns swapped, a sign turned, or clocks apart? or does a part swing that "
                "the model holds rigid, such as the boom?",
            )


def _sunk(state: LinearisedState, run: int) -> Iterator[KembaError]:
    """Feet that would be far below the ground for long."""
    legs, log = state.physics.legs, state.batch.resampled[run]
    heights = state.motion.places[: len(log.time), run, 1 : 2 * len(legs) : 2]
    for leg, height in zip(legs, heights.T, strict=True):
        if np.mean(height < -DEEP) > OFTEN:
            at = int(np.argmin(height))
            yield KembaError(
                log.name,
                f"the {leg} foot would be {-1e3 * height[at]:.0f} mm below the ground "
                f"at {log.time[at]:.3f} s",
                "a foot on or above it was expected",
                f"is a sign of body/pitch or {leg}/hip/q turned, or are columns swapped?",
            )


def _power(channels: Sequence[str], r: Array, rows: Rows, own: Flags) -> dict[str, float]:
    """Root mean square of the residual by channel, over the rows `own` (n,)."""
    found = {}
    for k, channel in enumerate(channels):
        at = own & (rows.channel == k)
        if at.any():
            found[channel] = float(np.sqrt(np.mean(r[at] ** 2)))
    return found


def _forgiven(r: Array, columns: Array) -> Array:
    """The residual (n,) less what faults of sensors can explain: these are to be found, not
    refused. `columns` (n, k) per size of each fault."""
    gram = columns.T @ columns + 1e-9 * np.eye(columns.shape[1])
    lower = np.linalg.cholesky(gram)
    wanted = np.linalg.solve(lower, -columns.T @ r)
    found = lsq_linear(lower.T, wanted, bounds=(-FAULTY, FAULTY))
    return np.asarray(r + columns @ found.x)
