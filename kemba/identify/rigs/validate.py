"""Mistakes in the columns of a rig's log, tried as whole hypotheses before anything is fitted."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from itertools import product, starmap

import numpy as np
from scipy.optimize import minimize_scalar, nnls

from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.errors import KembaError
from kemba.identify.bench.validate import ALIKE, BETTER, END, REVERSED, SMALL, Texts, simplest
from kemba.identify.problem.problem import Array
from kemba.identify.rigs.rig_log import ANSWER, PLACE, RigLog
from kemba.model.model import Model
from kemba.units import short

Gap = Callable[[RigLog], Array]  # the force of the model less that of the log, along a log
Units = tuple[str, ...]  # channels in another unit
LEAST = 0.15  # zero [rad] from which it is a mistake, and no fault of a sensor
ZEROS = np.linspace(-np.pi, np.pi, 25)  # those that are tried first [rad]
# factor from which a gain is another unit, and no other inertia: the closest usual units, feet and
# metres, have 3.28
UNIT = 3.0
TIME = "the time"
ONE = "(the unit of one of them, or of several, is wrong)"
SIZES = np.linspace(-9.0, 9.0, 25)  # logarithms of those that are tried first
# within which speeds friction turns over, as shares of the model's: it tells no unit
SHARP = np.geomspace(0.01, 30.0, 8)
CLOSELY = 3e-3  # share of their distance to which it is found
# work that no drive does for each kilogram that moves [W/kg]: the best motors alone do 1e4
POWER = 2e4
STEEL = 7800.0  # density of a rotor [kg.m-3]
LARGEST = 95.0  # percentile of the rows that counts as the largest [%]


def contradictions(log: RigLog, model: Model, sigma: Array, gap: Gap) -> list[KembaError]:
    """What must be wrong with a log's columns, if anything; `sigma` (k,) of the gap."""
    force, drive = _Force(model, sigma, gap), not model.mechanism.bore
    small = SMALL * np.sqrt(len(sigma)) / force.size(log)
    hint = "correct it in a column map (--map), or the rig's figures in the model"
    # a drive's force may have a zero, but a weight that is lifted tells up from down without one
    for zero in (False, True) if drive and force.lifts(log) else (drive,):
        force.zero = zero
        if force.left(log) < small:
            continue
        trials = {texts: force.left(trial, units) for texts, trial, units in mix_ups(log, force)}
        most = force.unmoved(log) / BETTER  # what the motion does not tell, no column can mend
        trials = {texts: left for texts, left in trials.items() if left < most or not texts}
        if simple := simplest(trials, small):
            said = "; or ".join(map(" and ".join, simple))
            what = "the force answers the motion so much better then"
            return [KembaError(log.name, said, what, hint)]
    if (work := force.work(log)) > POWER:
        what = f"{force.answer} does {work:.2g} W for each kilogram that moves"
        units = f"are {force.place}, {force.answer} or the time in other units? "
        return [KembaError(log.name, what, f"no drive does more than {POWER:.0g}", units + hint)]
    return []


class _Force:
    """The force of a log, and what the model, and friction and damping of any size, leave of it.

    Every rig may have these, and a drive a zero of its force. Units of the force and of the time
    are factors of what the model predicts at rest and of what accelerates, which are fitted.
    """

    def __init__(self, model: Model, sigma: Array, gap: Gap) -> None:
        self.model, self.sigma, self.gap = model, sigma, gap
        self.zero = False  # whether the force that was read may have one
        self.place, self.answer = PLACE[model.mechanism.rig], ANSWER[model.mechanism.rig]
        self._seen: dict[tuple[RigLog, bool], Array] = {}

    def read(self, log: RigLog) -> Array:
        """The force (k,) that was measured at the judged rows."""
        return np.asarray(log.others[self.answer][log.rows])

    def size(self, log: RigLog) -> float:
        """Its size in its noise."""
        return float(np.linalg.norm(self.read(log) / self.sigma))

    def left(self, log: RigLog, units: Units = (), sign: float = 1.0) -> float:
        """The share of the force, of which `sign` times is read, that is left, with `units` of
        force and time as they fit best."""
        return self._fitted(log, units, sign)[0]

    def factors(self, log: RigLog, units: Units, sign: float) -> dict[str, float]:
        """By what the readings of force and time are too large."""
        rest, moving = self._fitted(log, units, sign)[1]
        found = {self.answer: rest, TIME: float(np.sqrt(moving / rest)) if rest else np.inf}
        return {name: found[name] for name in units}

    def _fitted(self, log: RigLog, units: Units, sign: float) -> tuple[float, tuple[float, float]]:
        """The share that is left, and the factors of rest and motion."""
        known = self._laws(log)
        force, rest = sign * self.read(log), self._predicted(log, TIME in units)
        moving = self._predicted(log) - rest
        free = [rest] * (self.answer in units) + [moving] * (TIME in units)
        told = force - (0.0 if self.answer in units else rest)
        columns = np.stack([*free, *known], axis=1) / self.sigma[:, None]
        factors, left = nnls(columns, told / self.sigma)
        first = float(factors[0]) if self.answer in units else 1.0
        both = first, float(factors[len(free) - 1]) if TIME in units else first
        return float(left) / self.size(log), both

    def unmoved(self, log: RigLog) -> float:
        """The share that is left where the model predicts no force at all."""
        columns = np.stack(self._laws(log), axis=1) / self.sigma[:, None]
        return float(nnls(columns, self.read(log) / self.sigma)[1]) / self.size(log)

    def _laws(self, log: RigLog) -> list[Array]:
        """Friction, damping and a zero, each (k,) of any size."""
        side, still = 1.0 if self.model.mechanism.bore else -1.0, self.model.mechanism.sign_speed
        found = [-side * np.tanh(log.speed / (sharp * still)) for sharp in SHARP]
        one = np.ones(len(self.sigma))
        return [*found, -side * log.speed, *([one, -one] if self.zero else [])]

    def hangs(self, log: RigLog) -> bool:
        """Whether the model at rest needs another force at another position."""
        rest = self._predicted(log, True)
        return bool(np.ptp(rest) > 1e-6 * np.ptp(self._predicted(log)))

    def lifts(self, log: RigLog) -> bool:
        """Whether it needs one, which is the same everywhere."""
        return not self.hangs(log) and bool(np.any(self._predicted(log, True)))

    def _predicted(self, log: RigLog, resting: bool = False) -> Array:
        """What the model predicts (k,); `resting`: of an axis that does not accelerate."""
        if (log, resting) not in self._seen:
            trial = replace(log, a=np.zeros_like(log.a)) if resting else log
            self._seen[log, resting] = self.gap(trial) + self.read(log)
        return self._seen[log, resting]

    def work(self, log: RigLog) -> float:
        """The largest power of a drive for each kilogram that moves [W/kg], that of an axis that
        turns in steel as long as it is wide; 0 of a cylinder."""
        rig = self.model.mechanism
        if rig.bore:
            return 0.0
        axis = {n: self.model.parameters[f"drive_axis.{n}"][1] for n in ("J", "m")}
        mass = axis["J"]
        if rig.logged[self.place] == "rad":
            mass = np.pi * STEEL * (2.0 * axis["J"] / (np.pi * STEEL)) ** 0.6
        power = np.percentile(np.abs(self.read(log) * log.speed), LARGEST)
        return float(power) / max(mass + axis["m"], 1e-9)


def mix_ups(log: RigLog, force: _Force) -> Iterator[tuple[Texts, RigLog, Units]]:
    """What may be wrong with a log, the log with that put right, and its channels whose units are
    to be fitted."""
    place, answer, mechanism = force.place, force.answer, force.model.mechanism
    bore, logged = mechanism.bore, mechanism.logged
    end = END if bore else f"{place} has the reversed sign"
    other = REVERSED if bore else f"{answer} has the reversed sign"
    pressures = list(_pressures({n: log.others[n] for n in logged if n.endswith("/P")}))
    for sign, turned, (said, read) in product((1.0, -1.0), (1.0, -1.0), pressures):
        texts = (end,) * (sign < 0.0) + (other,) * (turned < 0.0) + said
        others = {**log.others, answer: turned * log.others[answer], **read}
        trial = _moved(log, sign, bore.stroke if bore and sign < 0.0 else 0.0, others)
        yield texts, trial, ()
        if logged[place] == "rad":  # where it hangs straight down
            zero = _best(ZEROS, partial(_moved, trial, 1.0, others=others), force.left)
            moved = f"{place} counts from another zero (`offset: {np.degrees(zero):+.1f} deg`)"
            if abs(zero) > LEAST:
                yield (*texts, moved), _moved(trial, 1.0, zero, others), ()
        if not bore and turned > 0.0:
            yield (*texts, f"{place} and {answer} are swapped"), _exchanged(trial, answer), ()
        if not said and turned > 0.0:
            for more, changed, units in _other_units(trial, force, other):
                yield texts + more, changed, units


def _other_units(
    log: RigLog, force: _Force, reversed_: str
) -> Iterator[tuple[Texts, RigLog, Units]]:
    """Channels in other units, in words, where every factor is one of units and each of them is
    needed. Where no weight hangs on the position only the force tells a factor: of a cylinder its
    own, of a drive that of all units together. The force may be `reversed_` as well."""
    drive = not force.model.mechanism.bore and force.hangs(log)
    free: list[Units] = [(force.answer,), *([(TIME,), (force.answer, TIME)] if drive else [])]
    left: dict[tuple[float, Texts], float] = {}
    stretched = cache(partial(_stretched, log))
    places: list[Units] = [(), (force.place,)] if drive else [()]
    for sign, place, units in product((1.0, -1.0), places, [(), *free]):
        error = partial(force.left, units=units, sign=sign)
        size = _best(SIZES, stretched, error) if place else 0.0
        trial, names = stretched(size), (*place, *units)
        found = dict.fromkeys(place, float(np.exp(-size))) | force.factors(trial, units, sign)
        if not all(0.0 < f < np.inf for f in found.values()):
            continue
        if TIME in units:
            trial, units = _timed(trial, 1.0 / found[TIME]), tuple(n for n in units if n != TIME)
        left[sign, names] = least = force.left(trial, units, sign)
        fewer = (e for (s, some), e in left.items() if s == sign and some and {*some} < {*names})
        if not names or any(error <= ALIKE * least for error in fewer):
            continue
        if not any(1.0 / UNIT < f < UNIT for f in found.values()):
            answer = {force.answer: sign * trial.others[force.answer]}
            alike = [force.place, TIME] if not (drive or force.model.mechanism.bore) else []
            if place and force.answer in found:  # a weight that hardly turns tells their ratio
                near = min(error(stretched(size + by)) for by in (-np.log(UNIT), np.log(UNIT)))
                alike = [force.place] if near <= ALIKE * least else []
            texts = (reversed_,) * (sign < 0.0)
            if alike:
                times = short(found.pop(force.answer) / found.pop(force.place, 1.0))
                suits = f"what suits {' and '.join(alike)} {ONE}"
                texts += (f"{force.answer} is about {times} times {suits}",)
            texts += tuple(starmap(_wrong, found.items()))
            yield texts, _moved(trial, 1.0, 0.0, trial.others | answer), units


def _wrong(name: str, factor: float) -> str:
    """A channel in another unit in words; by what `factor` it is too large."""
    times = short(max(factor, 1.0 / factor))
    size = "large" if factor > 1.0 else "small"
    return f"{name} is about {times} times too {size} (its unit is wrong)"


def _pressures(read: dict[str, Array]) -> Iterator[tuple[Texts, dict[str, Array]]]:
    """What may be wrong with pressures, and these without that."""
    swapped = dict(zip(read, reversed(read.values()), strict=True))
    swaps = {(): read, (" and ".join(read) + " are swapped",) * (len(read) > 1): swapped}
    groups = {tuple(read), *((name,) for name in read)} - {()}
    for said, columns in swaps.items():
        yield said, columns
        for names, zero in product(sorted(groups), (ATMOSPHERE, -ATMOSPHERE)):
            which = f"{' and '.join(names)} count{'s' * (len(names) == 1)} from another zero"
            moved = f"{which} (`offset: {zero:+.0f} Pa`, unless piston/F has a zero so far off)"
            yield (*said, moved), columns | {name: columns[name] + zero for name in names}


def _moved(log: RigLog, gain: float, zero: float, others: dict[str, Array]) -> RigLog:
    """A log whose position is gain * q + zero, with its other channels."""
    turned = {n: gain * getattr(log, n) for n in ("v", "a", "quick")}
    moved = {n: gain * getattr(log, n) + zero for n in ("q", "read")}
    return replace(log, others=others, **moved, **turned)


def _stretched(log: RigLog, size: float) -> RigLog:
    """A log with exp(size) times the readings of its position."""
    return _moved(log, float(np.exp(size)), 0.0, log.others)


def _timed(log: RigLog, gain: float) -> RigLog:
    """A log that takes so many times as long."""
    v, quick, a, width = log.v / gain, log.quick / gain, log.a / gain**2, gain * log.width
    return replace(log, grid=gain * log.grid, width=width, v=v, quick=quick, a=a)


def _exchanged(log: RigLog, answer: str) -> RigLog:
    """A log with the readings of position and force exchanged."""
    q = log.others[answer]
    v = np.gradient(q, log.grid)
    a, others = np.gradient(v, log.grid), {**log.others, answer: log.q}
    return replace(log, others=others, q=q, read=q, v=v, quick=v, a=a)


def _best(
    tried: Array, change: Callable[[float], RigLog], left: Callable[[RigLog], float]
) -> float:
    """What a log is changed by where least is left of it; `tried` at even distances first."""

    def error(by: float) -> float:
        return left(change(by))

    near, step = min(tried, key=error), tried[1] - tried[0]
    span, close = (near - step, near + step), {"xatol": CLOSELY * step}
    return float(minimize_scalar(error, bounds=span, method="bounded", options=close).x)
