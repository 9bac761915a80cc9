"""Usual mistakes in the columns of a robot log, tried as whole hypotheses before any fit.

While the ground carries the robot, its lowest foot is on the ground and stands still, and each
foot does so for a part of the time. Where the measured motion says otherwise, each usual mistake,
and each pair of them, is put right in turn: a sign, a unit, a swap, a zero that is then fitted. The
simplest after which the feet stand within millimetres is named, with all that leave as little. What
moves the feet by millimetres only is an effect, and no mistake; other lengths of the legs are one
more hypothesis, which never counts where a mistake explains as much.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, islice
from typing import Any

import numpy as np
from scipy.ndimage import minimum_filter1d
from scipy.optimize import minimize_scalar

from kemba.effects.pneumatics.switching import inverted
from kemba.effects.sensors import SensorBias, SensorScale
from kemba.errors import KembaError
from kemba.identify.logs.local_fit import local_fit
from kemba.identify.problem.problem import Array, Theta
from kemba.identify.robot.batch import ResampledLog
from kemba.identify.robot.physics import Physics

Columns = Mapping[str, Any]  # readings (n,), or the pulses of a valve
Change = Callable[[Columns], dict[str, Any]]
Left = Callable[..., Array]  # of logs: what the model leaves of each (logs,), in its noise
HINT = "correct it with `sign`, `scale`, `offset` or `source` in a column map (--map)"
CARRIED = 5.0  # the body falls slower than this: the ground carries it [m.s-2]: g / 2
WINDOW = 0.1  # time in which a standing foot does not move [s]
SMOOTH = 0.02  # time over which readings are smoothed [s]
ROW = 0.005  # distance of the rows that are looked at [s]
FEWEST = 3  # rows on the ground from which feet can be judged
STILL = 2.5e-3  # error of a standing foot that sensors make which are right [m]
# error of a standing foot that sensors make, and distance by which a mistake must move a foot, or
# it is an effect [m]: a late encoder moves one by 9 mm
SMALL = 0.012
BETTER = 2.5  # factor by which a mix-up must make the feet stand better
ZERO = 0.05  # the latter where other lengths of the legs make feet stand, too [m]
ALIKE = 1.5  # factor within which hypotheses of as many mistakes cannot be told by feet
# sizes of a sensor's bias or gain from which these are mistakes, and no effects: the zero of an
# angle is set by eye, a piston has its stops
LARGE, BY_EYE = 3.0, 10.0
GRID, FINE = 9, 2e-3  # zeros that are tried first; share of its reach to which one is found
SAME = 1.02  # the same by what the model leaves: thousands of rows tell so much
QUARTER = np.pi / 2  # turns by which hips are mounted wrongly [rad]
REACH = {"hip/q": QUARTER / 2, "body/pitch": 0.4}  # of a zero, from its start [rad]


@dataclass(frozen=True)
class MixUp:
    """One mistake in words, what it is a mistake `about`, and the columns put right.

    `at`: where it is that of a zero, the same for a zero that is so much more, up to `reach`; it is
    where the lowest foot is on the ground if that is infinite. `small`: it is an effect, which a
    sensor may have. `plain`: the mistake that is left where the zero beside it is one.
    """

    text: str
    about: frozenset[str]
    change: Change
    at: Callable[[float], MixUp] | None = None
    reach: float = 0.0
    small: bool = False
    plain: str = ""


Some = Sequence[MixUp]


def mixed_up(
    physics: Physics,
    log: ResampledLog,
    lengths: Theta | None = None,
    left: Left = lambda *logs: np.ones(len(logs)),
) -> Iterator[KembaError]:
    """The mistake in the columns of a log, or two of them, if its feet stand much better without.

    `lengths` of the legs at which feet stand as well; then one mistake must do, for two say no more
    than a length does, and it must leave as little. `left`: what the model leaves of a log; it
    tells what feet cannot.
    """
    feet = _Feet(physics, log)
    error = feet.restless([])
    if error is None or error < STILL:
        return
    known = list(mix_ups(physics.legs, physics.mechanism.stroke))
    goal = min(2.0 * STILL, error / BETTER)
    if lengths:
        goal = min(goal, ALIKE * (feet.restless([], lengths) or goal))
    fitted = list(map(feet.fitted, known))
    for count in range(1, 2 if lengths or error < SMALL else 3):
        pool = ([m] for m in fitted) if count == 1 else feet.pairs(known, fitted)
        trials = [(feet.restless(some) or np.inf, some) for some in map(feet.with_height, pool)]
        best = min(after for after, _ in trials)
        if best < goal:
            close = [some for after, some in trials if after < min(goal, ALIKE * best)]
            least = ZERO if lengths else SMALL
            if not all(feet.is_effect(some, least) for some in close):
                rest = [left(corrected(log, physics, some))[0] for some in close]
                close = [s for s, e in zip(close, rest, strict=True) if e <= SAME * min(rest)]
            texts = {m.text for some in close for m in some}
            close = [some for some in close if not any(m.plain in texts for m in some)]
            if not any(feet.is_effect(some, least) for some in close):
                yield _said(log.name, error, best, close)
            return


def _said(name: str, error: float, best: float, close: Sequence[Some]) -> KembaError:
    texts = [" and ".join(m.text for m in some) for some in close]
    several = " (feet cannot tell these apart)" if len(texts) > 1 else ""
    what = f"a foot is {1e3 * error:.0f} mm from where it should stand: {'; or '.join(texts)}"
    return KembaError(name, what + several, f"corrected, it is {1e3 * best:.0f} mm", HINT)


def corrected(log: ResampledLog, physics: Physics, some: Some) -> ResampledLog:
    """A log with mistakes put right, and the noise of what its columns then are."""
    legs, channels = physics.legs, physics.channels
    hips = [f"{leg}/hip/tau" for leg in legs]
    valves = [f"{leg}/valve/{side}" for leg in legs for side in ("extend", "retract")]
    commands = [*zip(hips, log.torque.T, strict=True), *zip(valves, log.sent, strict=True)]
    y, noisy = (
        _changed({**dict(zip(channels, z.T, strict=True)), **dict(commands)}, some)
        for z in (log.y, log.y + log.sigma)
    )
    read, above, torque = (
        np.stack([x[name] for name in names], axis=1)
        for x, names in ((y, channels), (noisy, channels), (y, hips))
    )
    sigma, sent = np.nanmedian(np.abs(above - read), axis=0), tuple(y[name] for name in valves)
    return replace(log, y=read, torque=torque, sent=sent, sigma=sigma)


def _changed(y: Columns, some: Some) -> dict[str, Any]:
    y = dict(y)
    for mistake in some:
        y |= mistake.change(y)
    return y


def _number(value: float, unit: str) -> str:
    """A zero [rad or m] in words."""
    if unit == "m":
        return f"{1e3 * value:+.{0 if abs(value) >= 0.01 else 1}f} mm"
    return f"{round(np.degrees(value), 1):+g} degrees"


TURNED = "body/pitch has the reversed sign (nose up is positive)"


def mix_ups(legs: Sequence[str], stroke: float) -> Iterator[MixUp]:
    """Mistakes of one kind each, effects that may look alike, and how to put each right."""
    yield from islice(slight(legs), 2 + (len(legs) == 2))  # each of them alone
    yield _each("body/pitch is in degrees", ["body/pitch"], np.radians)
    yield _unit("body/pitch", ["body/pitch"])
    yield _unit("body/x", ["body/x"])
    yield _unit("body/z", ["body/z"])
    yield _zero("body/pitch counts from another zero", ["body/pitch"])
    text = "body/pitch has the reversed sign and another zero"
    yield _zero(text, ["body/pitch"], -1.0, plain=TURNED)
    yield _zero("body/z counts from another zero", ["body/z"])
    yield _zero("body/z counts downwards from a zero", ["body/z"], -1.0)
    for name in (
        "body/z",
        "body/pitch",
        *(f"{g}/{x}" for g in legs for x in ("hip/q", "piston/x")),
    ):
        yield _scale(name)
    yield _swap("body/x and body/z are swapped", ("body/x", "body/z"))
    for whose, some in _groups(legs):
        hips, torques, pistons = (
            [f"{leg}/{x}" for leg in some] for x in ("hip/q", "hip/tau", "piston/x")
        )
        yield _unit(f"hip/q of {whose}", hips)
        yield _unit(f"piston/x of {whose}", pistons)
        for start in (0.0, QUARTER, -QUARTER, 2 * QUARTER):
            yield _zero(f"hip/q of {whose} counts from another zero", hips, 1.0, start)
        for also, said in (([], "hip/q of {} has"), (torques, "hip/q and hip/tau of {} have")):
            text = f"{said.format(whose)} the reversed sign"
            yield _each(text, [*hips, *also], np.negative)
            for start in (0.0, QUARTER, -QUARTER, 2 * QUARTER):
                plain = text if start == 0.0 else ""
                zero = f"{text} and {'hip/q ' if also else ''}another zero"
                yield _zero(zero, hips, -1.0, -start, plain=plain, also=also)
        yield _zero(f"piston/x of {whose} counts from another zero", pistons, reach=stroke / 4)
        text = f"piston/x of {whose} counts from the extended end"
        yield _each(text, pistons, lambda x: stroke - x)
        zero = f"{text} and another zero"
        yield _zero(zero, pistons, -1.0, -stroke, stroke / 4, plain=text)
    if len(legs) == 2:
        columns = ("hip/q", "hip/tau", "piston/x", "valve/extend", "valve/retract")
        pairs = [(f"{legs[0]}/{x}", f"{legs[1]}/{x}") for x in columns]
        yield _swap("hip/q of the legs is swapped", pairs[0])
        yield _swap("hip/q and hip/tau of the legs are swapped", *pairs[:2])
        yield _swap("the legs are swapped", *pairs)
        text = (
            "body/x and body/pitch have the reversed sign and the legs are swapped (the robot is "
            "seen from its other side)"
        )
        turned = _each(text, ["body/x", "body/pitch"], np.negative)
        yield _together(text, turned, _swap(text, *pairs))


def slight(legs: Sequence[str]) -> Iterator[MixUp]:
    """Those of them that move feet by millimetres only in a motion that is even and upright; a
    turned pitch and swapped pistons together leave feet nearly where they are."""
    pitch = _each(TURNED, ["body/pitch"], np.negative)
    yield pitch
    yield _each("body/x has the reversed sign (forward is positive)", ["body/x"], np.negative)
    if len(legs) == 2:
        pistons = _swap(
            "piston/x of the legs is swapped", (f"{legs[0]}/piston/x", f"{legs[1]}/piston/x")
        )
        yield pistons
        yield _together(f"{TURNED} and {pistons.text}", pitch, pistons)
    whose, some = _groups(legs)[0]
    yield _unit(f"piston/x of {whose}", [f"{leg}/piston/x" for leg in some])


def command_mix_ups(legs: Sequence[str]) -> Iterator[MixUp]:
    """The same about commands; those of valves are pulses."""
    sides = ("extend", "retract")
    for whose, some in _groups(legs):
        hips = [f"{leg}/hip/tau" for leg in some]
        pairs = [(f"{leg}/valve/extend", f"{leg}/valve/retract") for leg in some]
        valves = [name for pair in pairs for name in pair]
        yield _each(f"hip/tau of {whose} has the reversed sign", hips, np.negative)
        both = "valve/extend and valve/retract are"
        yield _swap(f"{both} swapped at {whose}", *pairs)
        yield _each(f"{both} inverted (1 is on) at {whose}", valves, inverted)
        for side in sides:
            one = [f"{leg}/valve/{side}" for leg in some]
            yield _each(f"valve/{side} is inverted (1 is on) at {whose}", one, inverted)
    if len(legs) == 2:
        crossed = {x: (f"{legs[0]}/{x}", f"{legs[1]}/{x}") for x in
                   ("hip/tau", *(f"valve/{side}" for side in sides))}  # fmt: skip
        for x, pair in crossed.items():
            yield _swap(f"{x} of the legs is swapped", pair)
        yield _swap("the valves of the legs are swapped", *list(crossed.values())[1:])
        yield _swap("the commands of the legs are swapped", *crossed.values())


def without_zeros(legs: Sequence[str], stroke: float) -> list[MixUp]:
    """Mistakes in the columns of a log whose feet tell nothing, but for those of a zero."""
    return [mistake for mistake in mix_ups(legs, stroke) if mistake.at is None]


def in_flight(physics: Physics, log: ResampledLog) -> bool:
    """Whether no foot stands for long enough to tell anything."""
    return _Feet(physics, log).restless([]) is None


def _groups(legs: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Every leg, and each."""
    every = [("every leg", list(legs))] if len(legs) > 1 else []
    return [*every, *((f"the {leg} leg", [leg]) for leg in legs)]


def _each(text: str, names: Sequence[str], change: Callable[[Any], Any]) -> MixUp:
    return MixUp(text, frozenset(names), lambda y: {n: change(y[n]) for n in names if n in y})


def _together(text: str, one: MixUp, other: MixUp) -> MixUp:
    """Two mistakes about different columns as one."""
    about = one.about | other.about
    return MixUp(text, about, lambda y: {**one.change(y), **other.change(y)})


def _zero(
    text: str,
    names: Sequence[str],
    sign: float = 1.0,
    start: float = 0.0,
    reach: float | None = None,
    plain: str = "",
    also: Sequence[str] = (),
) -> MixUp:
    """A zero (and a sign, which `also` has alone): true is sign * reading - zero."""
    if reach is None:
        reach = next((far for end, far in REACH.items() if names[0].endswith(end)), np.inf)
    bias = SensorBias(channel=names[0])
    least = (BY_EYE if bias.unit == "rad" else LARGE) * bias.parameters()["b"].size

    def at(more: float) -> MixUp:
        zero = start + more
        number = _number(sign * zero, bias.unit)
        said = f"{number} too much" if sign > 0.0 else f"`sign: -1, offset: {number}`"
        there = _each("", names, lambda x: sign * x - zero)
        turned = _each("", also, np.negative)
        slight = abs(more) < least
        return replace(
            _together(f"{text} ({said})", there, turned),
            small=sign > 0.0 and start == 0.0 and slight,
            plain=plain if slight else "",
        )

    return replace(at(0.0), at=at, reach=reach)


def _unit(what: str, names: Sequence[str]) -> MixUp:
    """An angle that was taken for degrees, a length for another unit."""
    angle = names[0].endswith(("pitch", "hip/q"))
    text = f"{what} is {57 if angle else 10} times too small (its unit is wrong)"
    return _each(text, names, np.degrees if angle else lambda x: 10.0 * x)


def _scale(name: str) -> MixUp:
    """A gain of a sensor that is off by a share."""

    def at(share: float) -> MixUp:
        return replace(_each(name, [name], lambda x: x / (1.0 + share)), small=True)

    reach = LARGE * SensorScale(channel=name).parameters()["k"].size
    return replace(at(0.0), at=at, reach=reach)


def _swap(text: str, *pairs: tuple[str, str]) -> MixUp:
    both = [ends for pair in pairs for ends in (pair, pair[::-1])]
    about = frozenset(name for pair in pairs for name in pair)
    return MixUp(text, about, lambda y: {a: y[b] for a, b in both if b in y})


class _Feet:
    """Feet of a log as its columns say, with mistakes put right."""

    def __init__(self, physics: Physics, log: ResampledLog) -> None:
        self.physics = physics
        self.step = float(np.median(np.diff(log.time)))
        self.half = max(1, round(0.5 * WINDOW / self.step))
        good = np.isfinite(log.y)
        self.enough = bool(np.all(good.sum(axis=0) > FEWEST))
        self.enough &= len(log.time) > 4 * self.half
        smooth = max(1, round(0.5 * SMOOTH / self.step))
        self.y = {
            name: local_fit(
                np.interp(log.time, log.time[good[:, i]], log.y[good[:, i], i]),
                smooth,
                self.step,
                2,
            )
            for i, name in enumerate(physics.channels)
            if self.enough
        }

    def restless(self, some: Some, lengths: Theta | None = None) -> float | None:
        """How far [m] feet that should stand are from the ground and from rest."""
        found = self._restless(some, lengths)
        return None if found is None else float(max(found))

    def _restless(self, some: Some, lengths: Theta | None = None) -> Array | None:
        """The same of the lowest foot, and of each (1 + legs,)."""
        if not self.enough:
            return None
        places, rows = self._places(some, lengths)
        if len(rows) < FEWEST:
            return None
        if some and np.median(_changed(self.y, some)["body/z"]) < 0.0:
            return None  # the body is under the ground
        before, now, after = (places[rows + k] for k in (-self.half, 0, self.half))
        far = np.hypot(now[:, :, 1], np.linalg.norm(after - before, axis=2))
        lowest = np.argmin(now[:, :, 1], axis=1)[:, None]
        nearest = np.quantile(np.take_along_axis(far, lowest, axis=1), 0.75)
        return np.append(nearest, np.quantile(far, 0.25, axis=0))

    def with_height(self, some: Some) -> Some:
        """Mistakes with the zero of the height that puts feet on the ground."""
        if not any(np.isinf(m.reach) for m in some):
            return some
        places, rows = self._places(some)
        lowest = float(np.median(places[rows, :, 1].min(axis=1))) if len(rows) else 0.0
        return [m.at(lowest) if m.at and np.isinf(m.reach) else m for m in some]

    def fitted(self, mistake: MixUp) -> MixUp:
        """A mistake about a zero within reach, with the zero by which its legs stand best."""
        at, reach = mistake.at, mistake.reach
        if at is None or np.isinf(reach):
            return mistake
        own = [1 + i for i in self._legs(mistake)]

        def error(more: float) -> float:
            found = self._restless([at(more)])
            return np.inf if found is None else float(sum(found[own]) if own else max(found))

        grid = np.linspace(-reach, reach, GRID)
        near, step = grid[int(np.argmin([error(more) for more in grid]))], grid[1] - grid[0]
        ends = near - step, near + step
        best = minimize_scalar(
            error, bounds=ends, method="bounded", options={"xatol": FINE * reach}
        )
        return at(float(best.x))

    def pairs(self, known: Some, fitted: Some) -> Iterator[Some]:
        """Two mistakes each about other columns, zeros `fitted` where legs differ."""
        legs = [self._legs(m) for m in known]
        for i, j in combinations(range(len(known)), 2):
            apart = legs[i] and legs[j] and legs[i].isdisjoint(legs[j])
            some = [fitted[i], fitted[j]] if apart else [known[i], known[j]]
            if not known[i].about & known[j].about and not any(m.small or m.plain for m in some):
                yield some

    def _legs(self, mistake: MixUp) -> set[int]:
        """Numbers of the legs that it is about; empty if it is about the body."""
        whose, legs = {name.split("/")[0] for name in mistake.about}, self.physics.legs
        return set() if "body" in whose else {legs.index(leg) for leg in whose}

    def is_effect(self, some: Some, least: float) -> bool:
        """Whether it is no more than effects: a sensor's fault, or feet moved by little."""
        (places, rows), (as_read, _) = self._places(some), self._places([])
        away = np.linalg.norm(places[rows] - as_read[rows], axis=2)
        far = least if any(m.about == {"body/z"} for m in some) else SMALL
        return any(m.small for m in some) or float(np.mean(away, axis=0).max()) < far

    def _places(self, some: Some, lengths: Theta | None = None) -> tuple[Array, np.ndarray]:
        """Places (n, legs, 2) of the feet [m], and rows around which the ground carries."""
        half, y = self.half, _changed(self.y, some)
        columns = np.stack([y[name] for name in self.physics.channels], axis=1)
        fall = local_fit(columns[:, 1], max(1, half // 2), self.step, 2, 2)
        carried = minimum_filter1d((fall > -CARRIED).astype(int), 2 * half + 1)
        rows = np.arange(half, len(columns) - half, max(1, round(ROW / self.step)))
        rows = rows[carried[rows] > 0]
        count, p = len(self.physics.legs), self.physics.at(lengths or {})
        wanted = np.unique(np.concatenate([rows - half, rows, rows + half]))
        known = columns[wanted]
        q = np.hstack([known[:, : 3 + count], self.physics.knees(known[:, 3 + count :], p)])
        found = np.full((len(columns), count, 2), np.nan)
        found[wanted] = self.physics.call("feet", q, 0 * q, p=p)[0].reshape(-1, count, 2)
        return found, rows
