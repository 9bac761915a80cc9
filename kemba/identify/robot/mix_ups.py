"""Usual mistakes in the columns of a robot log, recognised by its feet.

While the ground carries the robot, its lowest foot is on the ground and stands still, and each
foot does so for a part of the time. Where the measured motion says otherwise, each usual mistake is
put right in turn; the one after which the feet stand is named. Only the geometry of the robot is
used, no forces.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.identify.logs.local_fit import local_fit
from kemba.identify.robot.dynamics.physics import Array, Flags, Physics
from kemba.identify.robot.motion.resampled import ResampledLog
from kemba.settings import BY_HAND, Settings, setting

Indices = np.ndarray[Any, np.dtype[np.int_]]
Change = Callable[[Array], Array]
MixUp = tuple[str, dict[str, Change]]


class MixUpSettings(Settings):
    """When the columns of a robot log are said to be mixed up."""

    carried = 5.0  # the body falls slower than this: the ground carries it [m.s-2]: g / 2
    window = 0.05  # time in which a standing foot does not move [s]
    row = 0.005  # distance of the rows that are looked at [s]
    fewest = 10  # rows on the ground from which feet can be judged
    small: float = setting(
        0.012,
        "m",
        "typical error of a standing foot that no mix-up would leave",
        f"{BY_HAND}; a late encoder moves a foot by 9 mm",
        decides=True,
    )
    better: float = setting(
        4.0, "1", "factor by which a mix-up must make the feet stand better", BY_HAND, decides=True
    )


def mixed_up(physics: Physics, log: ResampledLog, p: Array) -> Iterator[KembaError]:
    """The mistake in the columns of a log, if its feet stand much better without it."""
    limits = MixUpSettings.current()
    rows = _rows(log)
    if len(rows) < limits.fewest:
        return
    error = _restless(physics, log, rows, {}, p)
    if error < limits.small:
        return
    trials = [
        (_restless(physics, log, rows, change, p), text, change)
        for text, change in mix_ups(physics.legs, physics.mechanism.stroke)
    ]
    best, text, _ = min(trials, key=lambda t: t[0])
    if best * limits.better < error:
        what = f"a foot is {1e3 * error:.0f} mm from where it should stand: {text}"
        yield KembaError(
            log.name,
            what,
            f"corrected, it is {1e3 * best:.0f} mm",
            "correct it with `sign`, `scale` or `offset` in a column map (--map)",
        )


def mix_ups(legs: Sequence[str], stroke: float) -> Iterator[MixUp]:
    """Mistakes in words, and how to put each right: the change of each column."""
    yield "body/pitch has the reversed sign (nose up is positive)", {"body/pitch": np.negative}
    yield "body/pitch is in degrees", {"body/pitch": np.radians}
    yield "body/x has the reversed sign (forward is positive)", {"body/x": np.negative}
    groups = [("every leg", list(legs)), *((f"the {leg} leg", [leg]) for leg in legs)]
    for whose, some in groups if len(legs) > 1 else groups[1:]:
        hips, pistons = ([f"{leg}/{x}" for leg in some] for x in ("hip/q", "piston/x"))
        yield f"hip/q of {whose} has the reversed sign", dict.fromkeys(hips, np.negative)
        for degrees in (90, -90, 180):
            zero = _shifted(-np.radians(degrees))
            yield (
                f"hip/q of {whose} counts from another zero ({degrees:+d} degrees too much)",
                dict.fromkeys(hips, zero),
            )
            yield (
                f"hip/q of {whose} has the reversed sign and another zero ({degrees:+d} degrees)",
                dict.fromkeys(hips, _turned(np.radians(degrees))),
            )
        end = _turned(stroke)
        yield f"piston/x of {whose} counts from the extended end", dict.fromkeys(pistons, end)


def _shifted(offset: float) -> Change:
    return lambda y: y + offset


def _turned(offset: float) -> Change:
    return lambda y: offset - y


def _rows(log: ResampledLog) -> Indices:
    """Rows (n,) at which the ground carries the robot, half a window from the ends at least."""
    limits = MixUpSettings.current()
    step = float(np.median(np.diff(log.time)))
    half = max(1, round(0.5 * limits.window / step))
    good: Flags = np.asarray(np.isfinite(log.y).all(axis=1))
    if len(log.time) < 4 * half + 1 or good.sum() < 4 * half + 1:
        return np.empty(0, dtype=int)
    z = np.interp(log.time, log.time[good], log.y[good, 1])
    fall = local_fit(z, half, step, 2, 2)
    rows = np.arange(half, len(z) - half, max(1, round(limits.row / step)))
    known = np.asarray(good[rows] & good[rows - half] & good[rows + half])
    carried = np.asarray(fall[rows] > -limits.carried)
    return np.asarray(rows[known & carried])


def _restless(
    physics: Physics, log: ResampledLog, rows: Indices, change: dict[str, Change], p: Array
) -> float:
    """How far [m] feet are from the ground and from their place one window before.

    The lowest foot stands in most of the `rows`, and each foot in a quarter of them at least: the
    largest of these quantiles."""
    step = float(np.median(np.diff(log.time)))
    half = max(1, round(0.5 * MixUpSettings.current().window / step))
    before, now, after = (_feet(physics, log.y[rows + k], change, p) for k in (-half, 0, half))
    far = np.hypot(now[:, :, 1], np.linalg.norm(after - before, axis=2))
    lowest = np.take_along_axis(far, np.argmin(now[:, :, 1], axis=1)[:, None], axis=1)
    return float(max(np.median(lowest), np.quantile(far, 0.25, axis=0).max()))


def _feet(physics: Physics, y: Array, change: dict[str, Change], p: Array) -> Array:
    """Places (n, legs, 2) of the feet [m] at measured channels y (n, m), changed; `p` (k,) gives
    the lengths of the legs."""
    count, same = len(physics.legs), np.positive
    columns = [change.get(name, same)(y[:, i]) for i, name in enumerate(physics.channels)]
    known = np.stack(columns, axis=1)
    q = np.hstack([known[:, : 3 + count], physics.knees(known[:, 3 + count :], p)])
    return physics.call("feet", q, 0 * q, p=p)[0].reshape(len(y), count, 2)
