"""Are columns of a bench log mixed up? The nominal prediction is tried on each usual mistake, and
on those of several columns together."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.optimize import minimize_scalar

from kemba.effects.pneumatics.switching import Pulse, inverted
from kemba.errors import KembaError
from kemba.identify.bench.bench_log import PRESSURES, BenchLog, SmoothedMotion
from kemba.identify.infer.windows import rms
from kemba.identify.problem.problem import Array

Predict = Callable[[BenchLog], Array]  # the nominal force along a run
BETTER = 4.0  # factor by which a mix-up must fit better
SMALL = 4.0  # error, in sigmas, that no mix-up would leave
CLOSE = 0.25  # share of the force's spread that a mix-up may leave
ALIKE = 1.5  # factor within which the force does not tell mix-ups apart
NOTHING = 1.2  # share of the spread left by a model that explains nothing
LATEST = 0.015  # a longer lag is no sensor's delay but another clock [s]
RESOLUTION = 1e-3  # resolution of lags [s]: a usual row
SHORTEST = 400  # steps of resolution that a lag can be read from
FARTHEST = 0.5  # longest lag [s]
LIKE = 0.3  # correlation that a lag must reach
HALF = 2.0  # factor by which the model must err less without a lag
MORE_ALIKE = 1.5  # factor by which a lag must raise the correlation

UNITS = {"": 1.0, "kN": 1e3, "mN": 1e-3, "lbf": 4.4482, "kgf": 9.81}  # [N]
END = "piston/x counts from the extended end (0 is retracted)"
SWAPPED = "valve/extend and valve/retract are swapped"
INVERTED = "valve/extend and valve/retract are inverted (1 is on)"
MOVED = "piston/F counts from another zero"
REVERSED = "piston/F has the reversed sign (pushing is positive)"
SUPPLIES = (0.7, 1.4)  # gauge pressure of a log over that of the model, least and largest
FULL = 1.1  # share of the stroke that a position may read
Texts = tuple[str, ...]  # mistakes
Left = dict[Texts, float]  # the share of the force's spread that is left without them


def contradictions(run: BenchLog, stroke: float, predict: Predict) -> list[KembaError]:
    """What must be wrong with a run's columns, if anything; `stroke` [m] of the cylinder."""
    as_read, force = _left(run, predict), run.measured["piston/F"][run.keep["piston/F"]]
    if not as_read or as_read[()] < (small := SMALL * run.sigma["piston/F"] / _spread(force)):
        return []
    trials = {more: (run, more, left) for more, left in as_read.items()}
    trials |= {
        some + more: (trial, more, left)
        for some, trial in mix_ups(run, stroke)
        if some
        for more, left in _left(trial, predict).items()
    }
    simple = simplest({texts: left for texts, (_, _, left) in trials.items()}, small)
    zero_alone = any(len(texts) == 1 and texts[0].startswith(MOVED) for texts in simple)
    if simple and not zero_alone:  # that is an effect, and no mistake
        said = [" and ".join(texts) for texts in simple]
        if END in simple[0]:
            said[0] += _zero(*trials[simple[0]], stroke, predict)
        what = "the force answers the valves so much better then"
        return [KembaError(run.name, "; or ".join(said), what)]
    if lagging := _clock(run, predict):
        return lagging
    if as_read[()] > NOTHING:
        what = "piston/F does not follow the valves at all"
        left = f"the model leaves {as_read[()]:.1f} of its spread"
        hint = "are columns swapped, or the logs of another test?"
        return [KembaError(run.name, what, left, hint)]
    return []


def crossed(run: BenchLog, expected: Mapping[str, tuple[Array, Array]]) -> list[KembaError]:
    """Pressures that follow the valves much better the other way round, whatever their zeros;
    `expected`: reading and variance (n,) of each channel by the model."""
    if not run.measured.keys() >= set(PRESSURES):
        return []
    keep = run.keep[PRESSURES[0]] & run.keep[PRESSURES[1]]

    def left(names: Iterable[str]) -> float:
        pairs = zip(PRESSURES, names, strict=True)
        return sum(float(np.var((expected[a][0] - run.measured[b])[keep])) for a, b in pairs)

    if left(PRESSURES[::-1]) * BETTER**2 > left(PRESSURES):
        return []
    said = f"{' and '.join(PRESSURES)} are swapped"
    return [KembaError(run.name, said, "they follow the valves so much better then")]


def simplest(trials: Left, small: float) -> list[Texts]:
    """The fewest mistakes without which about the least is left, or as little as noise makes
    (`small`); none where the log as it is, (), leaves hardly more."""
    small = min(small, CLOSE / BETTER)  # noise of a force in another unit is none of ours
    least = min(trials.values())
    count = min(len(texts) for texts, left in trials.items() if left <= max(ALIKE * least, small))
    alike = {texts: left for texts, left in trials.items() if len(texts) == count}
    most = max(ALIKE * min(alike.values()), small)
    simple = [texts for texts, left in alike.items() if left <= most]
    return simple if count and least < CLOSE and least * BETTER < trials[()] else []


def mix_ups(run: BenchLog, stroke: float) -> Iterator[tuple[Texts, BenchLog]]:
    """What may be wrong with valves and position, and the log with that put right."""
    extend, retract = run.commands
    off, out = inverted(extend), inverted(retract)
    valves: list[tuple[Texts, tuple[list[Pulse], list[Pulse]]]] = [
        ((), run.commands),
        ((SWAPPED,), (retract, extend)),
        ((INVERTED,), (off, out)),
        ((SWAPPED, INVERTED), (out, off)),
        (("valve/extend is inverted (1 is on)",), (off, retract)),
        (("valve/retract is inverted (1 is on)",), (extend, out)),
    ]
    motion = run.motion
    turned = replace(motion, x=stroke - motion.x, v=-motion.v, a=-motion.a)
    places: list[tuple[Texts, SmoothedMotion]] = [((), motion), ((END,), turned)]
    if 10.0 * np.max(motion.x) < FULL * stroke:
        far = replace(motion, x=10.0 * motion.x, v=10.0 * motion.v, a=10.0 * motion.a)
        places.append((("piston/x is 10 times too small (its unit is wrong)",), far))
    for (some, commands), (more, place) in product(valves, places):
        yield some + more, replace(run, commands=commands, motion=place)


def _left(run: BenchLog, predict: Predict) -> Left:
    """What may be wrong with the force, and what is left without; {} where nothing is predicted."""
    force, found = run.measured["piston/F"][run.keep["piston/F"]], {}
    edges = [edge for sent in run.commands for pulse in sent for edge in pulse]
    first, last = run.motion.time[[0, -1]]
    switched = any(first < edge < last for edge in edges)
    supplies = SUPPLIES if switched else (1.0, 1.0)  # a level alone tells none
    with np.errstate(over="ignore", invalid="ignore"):  # a mix-up may lead anywhere
        try:
            predicted = predict(run)[run.keep["piston/F"]]
        except KembaError:
            return {}
        for sign, (unit, factor) in product((1.0, -1.0), UNITS.items()):
            texts = (REVERSED,) * (sign < 0.0) + (f"piston/F seems to be in {unit}",) * bool(unit)
            told, spread = sign * factor * force, _spread(factor * force)
            found[texts] = rms(_gap(predicted, told, supplies)) / spread
            gap = _gap(predicted, told, supplies, 1.0)
            moved = f"`{'sign: -1, ' * (sign < 0.0)}offset: {np.mean(gap):+.3g} N`"
            zero = (*texts, f"{MOVED} ({moved})")
            found[zero] = float(np.std(gap)) / max(factor * float(np.std(force)), 1.0)
    return {texts: left for texts, left in found.items() if np.isfinite(left)}


def _gap(predicted: Array, told: Array, supplies: tuple[float, float], zero: float = 0.0) -> Array:
    """Predicted less told force (n,) at the supply that suits best; `zero` 1 of any zero, or 0."""
    x, y = predicted - zero * predicted.mean(), told - zero * told.mean()
    return np.asarray(np.clip(x @ y / max(x @ x, 1.0), *supplies) * predicted - told)


def _spread(force: Array) -> float:
    """Size [N] of a force (n,), at least 1 N."""
    return max(rms(force), 1.0)


def _zero(run: BenchLog, texts: Texts, left: float, stroke: float, predict: Predict) -> str:
    """The zero beside the extended end without which much less is `left`, in words."""

    def error(zero: float) -> float:
        motion = replace(run.motion, x=run.motion.x + zero)
        return _left(replace(run, motion=motion), predict).get(texts, np.inf)

    best = minimize_scalar(error, bounds=(-stroke / 4, stroke / 4), method="bounded")
    if best.fun * ALIKE > left:
        return ""
    moved = f"`sign: -1, offset: {1e3 * (stroke + best.x):.1f} mm`"
    return f" and piston/x counts from another zero ({moved})"


def _clock(run: BenchLog, predict: Predict) -> list[KembaError]:
    """A force that comes much later or earlier than any sensor's delay has another clock."""
    keep = run.keep["piston/F"]
    grid = np.arange(run.motion.time[0], run.motion.time[-1], RESOLUTION)
    if len(grid) < SHORTEST or not any(run.commands):
        return []
    time = run.motion.time[keep]
    measured = np.gradient(np.interp(grid, time, run.measured["piston/F"][keep]))
    expected = np.gradient(np.interp(grid, time, predict(run)[keep]))
    if not measured.std() or not expected.std():
        return []
    far = min(int(FARTHEST / RESOLUTION), len(grid) // 3)
    from scipy.signal import correlate  # it takes half a second

    both = correlate(measured - measured.mean(), expected - expected.mean(), "same", "fft")
    both /= len(grid) * measured.std() * expected.std()
    middle = len(grid) // 2
    near = both[middle - far : middle + far + 1]
    place = int(np.argmax(near))
    if place in (0, 2 * far):  # the correlation still rises there: this is no lag
        return []
    lag = (place - far) * RESOLUTION
    if abs(lag) <= LATEST or near.max() < max(LIKE, MORE_ALIKE * both[middle]):
        return []
    late = f"{abs(lag) * 1e3:.0f} ms {'late' if lag > 0 else 'early'}"
    what = f"piston/F comes {late} against the valves and the motion"
    force, predicted = run.measured["piston/F"][keep], predict(run)[keep]
    there = np.interp(time + lag, time, force)
    if rms(predicted - there) * HALF > rms(predicted - force):  # no delay explains it
        hint = "is the unit of the time wrong, or is this the log of another cylinder?"
        return [KembaError(run.name, what, "and no clock that is late alone explains it", hint)]
    expected = "one clock for all columns was expected"
    return [KembaError(run.name, what, expected, "correct it with `delay` in a column map")]
