"""Are columns of a bench log mixed up? The nominal prediction is tried on each usual mistake."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from kemba.errors import KembaError
from kemba.identify.bench.bench_log import BenchLog
from kemba.identify.problem.types import Array

Predict = Callable[[BenchLog], Array]  # the nominal force along a run
BETTER = 4.0  # factor by which a mix-up must fit better
SMALL = 4.0  # error, in sigmas, that no mix-up would leave
CLOSE = 0.25  # share of the force's spread that a mix-up may leave
NOTHING = 1.2  # share of the spread left by a model that explains nothing
LATEST = 0.015  # a longer lag is no sensor's delay but another clock [s]
RESOLUTION = 1e-3  # resolution of lags [s]: a usual row
SHORTEST = 400  # steps of resolution that a lag can be read from
FARTHEST = 0.5  # longest lag [s]
ALIKE = 0.3  # correlation that a lag must reach
MORE_ALIKE = 1.5  # factor by which a lag must raise the correlation


def mix_ups(run: BenchLog, stroke: float) -> Iterator[tuple[str, BenchLog]]:
    """What may be wrong with a log, and the log with that put right; `stroke` [m] of the
    cylinder."""
    extend, retract = run.commands
    force = run.measured["piston/F"]
    yield (
        "piston/F has the reversed sign (pushing is positive)",
        replace(run, measured={**run.measured, "piston/F": -force}),
    )
    yield ("valve/extend and valve/retract are swapped", replace(run, commands=(retract, extend)))
    yield (
        "valve/extend and valve/retract are inverted (1 is on)",
        replace(run, commands=(_inverted(extend), _inverted(retract))),
    )
    motion = run.motion
    flipped = replace(motion, x=stroke - motion.x, v=-motion.v, a=-motion.a)
    yield "piston/x counts from the extended end (0 is retracted)", replace(run, motion=flipped)
    for factor, unit in ((1e3, "kN"), (1e-3, "mN"), (4.4482, "lbf"), (9.81, "kgf")):
        yield (
            f"piston/F seems to be in {unit}",
            replace(run, measured={**run.measured, "piston/F": factor * force}),
        )
    for factor, unit in ((10.0, "dm"), (0.0254 * 1e0, "inches")):
        motion = run.motion
        scaled = replace(motion, x=factor * motion.x, v=factor * motion.v, a=factor * motion.a)
        yield f"piston/x seems to be in {unit}", replace(run, motion=scaled)


def contradictions(run: BenchLog, stroke: float, predict: Predict) -> list[KembaError]:
    """What must be wrong with a run's columns, if anything."""
    path = run.name
    error, scale = _misfit(run, predict)
    if error < SMALL * run.sigma["piston/F"]:
        return []
    trials = [(text, _misfit_mixed_up(trial, predict)) for text, trial in mix_ups(run, stroke)]
    text, (best, spread) = min(trials, key=lambda t: t[1][0] / t[1][1])
    if best / spread < CLOSE and best / spread * BETTER < error / scale:
        return [KembaError(path, text, "the force answers the valves so much better then")]
    lagging = _clock(run, predict)
    if lagging:
        return lagging
    if error > NOTHING * scale and scale > 0:
        return [
            KembaError(
                path,
                "piston/F does not follow the valves at all",
                f"the model leaves {error / scale:.1f} of its spread",
                "are columns swapped, or the logs of another test?",
            )
        ]
    return []


def _misfit(run: BenchLog, predict: Predict) -> tuple[float, float]:
    """Median error of the nominal prediction and spread of the measured force."""
    keep = run.keep["piston/F"]
    force = run.measured["piston/F"][keep]
    with np.errstate(over="ignore", invalid="ignore"):  # a mix-up may lead anywhere
        error = float(np.sqrt(np.mean((predict(run)[keep] - force) ** 2)))
    error = error if np.isfinite(error) else np.inf
    return error, max(float(np.std(force)), float(np.sqrt(np.mean(force**2))), 1.0)


def _misfit_mixed_up(trial: BenchLog, predict: Predict) -> tuple[float, float]:
    """The same for a mix-up; infinite where it leads the model to no prediction, as to a negative
    volume."""
    try:
        return _misfit(trial, predict)
    except KembaError:
        return np.inf, 1.0


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
    if abs(lag) <= LATEST or near.max() < ALIKE:
        return []
    if near.max() < MORE_ALIKE * both[middle]:
        return []
    word = "late" if lag > 0 else "early"
    return [
        KembaError(
            run.name,
            f"piston/F comes {abs(lag) * 1e3:.0f} ms {word} against the valves and the motion",
            "one clock for all columns was expected",
            "correct it with `delay` in a column map",
        )
    ]


def _inverted(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    edges = [-np.inf, *(e for pair in intervals for e in pair), np.inf]
    pairs = zip(edges[::2], edges[1::2], strict=True)
    return [(a, b) for a, b in pairs if b > a]
