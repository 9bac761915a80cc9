"""Robot logs that contradict themselves or any model: columns mixed up, signs turned, clocks apart.

Usual mistakes in the columns are tried as whole hypotheses before any fit. While the ground carries
the robot, its lowest foot is on the ground and stands still, and each foot does so for a part of
the time. Where the measured motion says otherwise, each usual mistake, and each pair of them, is
put right in turn; the simplest after which the feet stand within millimetres is named, with what is
the same to the feet of a robot that is its own mirror image. Only the geometry of the robot as it
is drawn is used, no forces and no fitted lengths.

Torques enter the model's motion linearly, so that the residual of the other sign is known without
another fit. Valves act through the air: each hypothesis about them is a log of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np
from scipy.optimize import lsq_linear

from kemba.errors import KembaError
from kemba.identify.logs.local_fit import local_fit
from kemba.identify.problem.types import Array, Flags, Rows
from kemba.identify.robot.batch import ResampledLog
from kemba.identify.robot.physics import Physics
from kemba.identify.robot.state import LinearisedState
from kemba.trajectory import Trajectory

Columns = Mapping[str, Array]
Change = Callable[[Columns], dict[str, Array]]
OTHER_ZERO = "body/z counts from another zero"
HINT = "correct it with `sign`, `scale`, `offset` or `source` in a column map (--map)"
CARRIED = 5.0  # the body falls slower than this: the ground carries it [m.s-2]: g / 2
WINDOW = 0.05  # time in which a standing foot does not move [s]
ROW = 0.005  # distance of the rows that are looked at [s]
FEWEST = 10  # rows on the ground from which feet can be judged
# typical error of a standing foot that no mix-up would leave [m]: a late encoder moves a foot
# by 9 mm
SMALL = 0.012
BETTER = 4.0  # factor by which a mix-up must make the feet stand better
# height by which the zero of body/z must be off where other lengths make feet stand, too [m]
ZERO = 0.05
ALIKE = 1.5  # factor within which hypotheses of as many mistakes cannot be told


@dataclass(frozen=True)
class MixUp:
    """One mistake in words, what it is a mistake `about`, and the columns put right."""

    text: str
    about: frozenset[str]
    change: Change


def mixed_up(physics: Physics, log: ResampledLog, lengths: bool = False) -> Iterator[KembaError]:
    """The mistake in the columns of a log, or two of them, if its feet stand much better without.

    `lengths`: other lengths of the legs make feet stand as well; then one mistake must do, for two
    say no more than a length does.
    """
    feet = _Feet(physics, log)
    feet.least = ZERO if lengths else 0.0
    most = 1 if lengths else 2
    error = feet.restless([])
    if error is None or error < SMALL:
        return
    known = list(mix_ups(physics.legs, physics.mechanism.stroke))
    goal = min(SMALL, error / BETTER)
    for count in range(1, most + 1):
        trials = []
        for some in combinations(known, count):
            if count == 2 and some[0].about & some[1].about:
                continue
            left = feet.restless(some)
            if left is not None:
                trials.append((left, some))
        fitting = [(e, some) for e, some in trials if e < goal]
        if fitting:
            yield _said(log.name, error, feet, fitting)
            return


def _said(
    name: str, error: float, feet: _Feet, fitting: Sequence[tuple[float, Sequence[MixUp]]]
) -> KembaError:
    """The best hypothesis, and others that the feet cannot tell from it."""
    best = min(e for e, _ in fitting)
    close = [some for e, some in fitting if e <= ALIKE * best]
    texts = [" and ".join(m.text for m in some) for some in close]
    offset = next(
        (f for some in close[:1] for m in some if (f := feet.offset(some, m)) is not None), None
    )
    if offset is not None:
        texts[0] += f" ({1e3 * offset:+.0f} mm too much)"
    several = f"{'; or '.join(texts)}" + (
        " (feet cannot tell these apart)" if len(texts) > 1 else ""
    )
    what = f"a foot is {1e3 * error:.0f} mm from where it should stand: {several}"
    return KembaError(name, what, f"corrected, it is {1e3 * best:.0f} mm", HINT)


def mix_ups(legs: Sequence[str], stroke: float) -> Iterator[MixUp]:
    """Mistakes of one kind each, and how to put each right."""
    yield _each(
        "body/pitch has the reversed sign (nose up is positive)", ["body/pitch"], np.negative
    )
    yield _each("body/pitch is in degrees", ["body/pitch"], np.radians)
    yield _each("body/x has the reversed sign (forward is positive)", ["body/x"], np.negative)
    yield MixUp(OTHER_ZERO, frozenset({"body/z"}), _nothing)
    yield _each("body/z counts downwards", ["body/z"], np.negative)
    yield MixUp(
        "body/x and body/z are swapped",
        frozenset({"body/x", "body/z"}),
        _exchange(("body/x", "body/z")),
    )
    groups = [("every leg", list(legs)), *((f"the {leg} leg", [leg]) for leg in legs)]
    for whose, some in groups if len(legs) > 1 else groups[1:]:
        hips, pistons = ([f"{leg}/{x}" for leg in some] for x in ("hip/q", "piston/x"))
        yield _each(f"hip/q of {whose} has the reversed sign", hips, np.negative)
        for degrees in (90, -90, 180):
            yield _each(
                f"hip/q of {whose} counts from another zero ({degrees:+d} degrees too much)",
                hips,
                partial(np.add, -np.radians(degrees)),
            )
            yield _each(
                f"hip/q of {whose} has the reversed sign and another zero ({degrees:+d} degrees)",
                hips,
                partial(np.subtract, np.radians(degrees)),
            )
        yield _each(
            f"piston/x of {whose} counts from the extended end",
            pistons,
            partial(np.subtract, stroke),
        )
    if len(legs) == 2:
        pairs = [(f"{legs[0]}/{x}", f"{legs[1]}/{x}") for x in ("hip/q", "piston/x")]
        both = frozenset(name for pair in pairs for name in pair)
        yield MixUp("the legs are swapped", both, _exchange(*pairs))
        yield MixUp(
            "body/x and body/pitch have the reversed sign and the legs are swapped (the robot is "
            "seen from its other side)",
            both | {"body/x", "body/pitch"},
            _mirrored(pairs),
        )


def _each(text: str, names: Sequence[str], change: Callable[[Array], Array]) -> MixUp:
    return MixUp(text, frozenset(names), lambda y: {name: change(y[name]) for name in names})


def _nothing(y: Columns) -> dict[str, Array]:
    """The zero of the height is found by where the lowest foot is."""
    return {}


def _exchange(*pairs: tuple[str, str]) -> Change:
    return lambda y: {a: y[b] for pair in pairs for a, b in (pair, pair[::-1])}


def _mirrored(pairs: Sequence[tuple[str, str]]) -> Change:
    turned = ("body/x", "body/pitch")
    return lambda y: {**_exchange(*pairs)(y), **{name: np.negative(y[name]) for name in turned}}


def _rezeroed(some: Sequence[MixUp]) -> bool:
    """Whether the zero of the height is to be found: where the lowest foot is."""
    return any(m.text.startswith("body/z counts") for m in some)


class _Feet:
    """Feet of a log as its columns say, with mistakes put right."""

    def __init__(self, physics: Physics, log: ResampledLog) -> None:
        self.physics, self.log = physics, log
        self.least = 0.0  # zero of body/z that is a mistake, at least [m]
        self.step = float(np.median(np.diff(log.time)))
        self.half = max(1, round(0.5 * WINDOW / self.step))
        good = np.isfinite(log.y)
        self.enough = bool(np.all(good.sum(axis=0) > FEWEST))
        self.enough &= len(log.time) > 4 * self.half
        self.y = {
            name: np.interp(log.time, log.time[good[:, i]], log.y[good[:, i], i])
            for i, name in enumerate(physics.channels)
            if good[:, i].any()
        }

    def restless(self, some: Sequence[MixUp]) -> float | None:
        """How far [m] feet are from the ground and from their place one window before.

        The lowest foot stands in most of the rows on the ground, and each foot in a quarter of them
        at least: the largest of these quantiles. None where too few rows tell it, or where a zero
        of the height is no mistake.
        """
        if not self.enough:
            return None
        places, rows = self._places(some)
        if len(rows) < FEWEST:
            return None
        before, now, after = (places[rows + k] for k in (-self.half, 0, self.half))
        lowest = np.argmin(now[:, :, 1], axis=1)[:, None]
        height = now[:, :, 1]
        if some and np.median(self._changed(some)["body/z"]) < 0.0 and not _rezeroed(some):
            return None  # the body is under the ground
        if _rezeroed(some):
            zero = float(np.median(np.take_along_axis(height, lowest, axis=1)))
            if abs(zero) < self.least and any(m.text == OTHER_ZERO for m in some):
                return None
            height = height - zero
        far = np.hypot(height, np.linalg.norm(after - before, axis=2))
        nearest = np.take_along_axis(far, lowest, axis=1)
        return float(max(np.median(nearest), np.quantile(far, 0.25, axis=0).max()))

    def offset(self, some: Sequence[MixUp], mistake: MixUp) -> float | None:
        """By how much [m] the height reads too much, where its zero is the mistake."""
        if mistake.text != OTHER_ZERO:
            return None
        places, rows = self._places(some)
        return float(np.median(places[rows, :, 1].min(axis=1)))

    def _changed(self, some: Sequence[MixUp]) -> dict[str, Array]:
        y = dict(self.y)
        for mistake in some:
            y |= mistake.change(y)
        return y

    def _places(self, some: Sequence[MixUp]) -> tuple[Array, np.ndarray]:
        """Places (n, legs, 2) of the feet [m], and the rows at which the ground carries the robot,
        half a window from the ends at least."""
        half, y = self.half, self._changed(some)
        columns = np.stack([y[name] for name in self.physics.channels], axis=1)
        fall = local_fit(columns[:, 1], half, self.step, 2, 2)
        rows = np.arange(half, len(columns) - half, max(1, round(ROW / self.step)))
        rows = rows[fall[rows] > -CARRIED]
        count, p = len(self.physics.legs), self.physics.nominal
        wanted = np.unique(np.concatenate([rows - half, rows, rows + half]))
        known = columns[wanted]
        q = np.hstack([known[:, : 3 + count], self.physics.knees(known[:, 3 + count :], p)])
        found = np.full((len(columns), count, 2), np.nan)
        found[wanted] = self.physics.call("feet", q, 0 * q, p=p)[0].reshape(-1, count, 2)
        return found, rows


BY_MAP = "correct it in a column map (--map)"
LESS = 1.5  # factor by which the other sign of torques must leave less


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
        if before and left[best] * LESS < before:
            whose = "every leg" if len(best) == len(legs) else f"the {legs[best[0]]} leg"
            yield KembaError(
                log.name,
                f"hip/tau of {whose} has the reversed sign",
                f"the hips err by {before:.1f} times their noise from row to row, and by "
                f"{left[best]:.1f} times with the other sign",
                BY_MAP,
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
