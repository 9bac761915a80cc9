"""The next test of a rig: a course of the rod and the valves that tells rivals apart, or a
standard test where that is better.

Tests are judged by the logs that they would give if the model were nearly right, without the rig.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution
from scipy.signal import lfilter
from scipy.stats import qmc

from kemba.config import dump_yaml
from kemba.errors import KembaError
from kemba.identify.answer import read_answer
from kemba.identify.bench.bench_log import BenchLog, prepare
from kemba.identify.bench.problem import BenchProblem
from kemba.identify.design.separation import (
    DesignSearchSettings,
    ExperimentSettings,
    JudgedTest,
    Proposal,
    Rivals,
    Separation,
    best_fit,
    contenders,
    misfit,
    separation,
    strength,
)
from kemba.identify.problem.noise import Colour, learn
from kemba.identify.problem.problem import Array
from kemba.model.model import Model
from kemba.model.spec import load_model
from kemba.plant.rigs import CourseRig, DynamometerRig, LockedRig, RandomRig, Rig, Test
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory


class VirtualBench:
    """Problems that the logs of tests would pose, if this model were nearly right.

    `rows`: rows of the logs per second.
    """

    def __init__(self, model: Model, rows: float) -> None:
        self.model, self.stroke, self.rows = model, model.mechanism.stroke, rows
        self.colour = _colour(rows)
        self._first: BenchProblem | None = None

    def tests(self, rig: Rig) -> list[Test]:
        """The tests of a rig that are judged: the first few of them."""
        every = rig.tests(np.random.default_rng(0), self.stroke)
        return list(islice(every, ExperimentSettings.tests))

    def judged(self, rig: Rig, evidence: Separation) -> JudgedTest:
        """A rig with this evidence, and the seconds of log of its tests."""
        log_s = sum(float(np.ptp(test.times)) for test in self.tests(rig))
        return JudgedTest(evidence.first, evidence.nats, rig, log_s)

    def problem(self, rig: Rig) -> BenchProblem:
        """The problem of these tests."""
        logs = [
            prepare(test.name, _virtual_log(test, self.rows, i), on_rows=True)
            for i, test in enumerate(self.tests(rig))
        ]
        if len(logs) > 1:
            return self._coloured(BenchProblem(logs, self.model))
        if self._first is None:
            self._first = BenchProblem(logs, self.model)
        return self._coloured(_with_logs(self._first, logs))  # compiled functions are used again

    def _coloured(self, problem: BenchProblem) -> BenchProblem:
        problem.colour = {(i, 0): self.colour for i in range(len(problem.logs))}
        return problem


def _with_logs(problem: BenchProblem, logs: Sequence[BenchLog]) -> BenchProblem:
    """The same problem on as many other logs."""
    found = copy(problem)
    found.logs = tuple(logs)
    found.runs = tuple(log.name for log in logs)
    return found


def _virtual_log(test: Test, rows: float, seed: int) -> Trajectory:
    """A test as a log with so many rows per second. Its force is the noise of the sensor alone."""
    settings, rng = ExperimentSettings, np.random.default_rng(seed)
    step = float(test.times[1] - test.times[0])
    times = test.times[:: max(1, round(1.0 / (step * rows)))]
    x, _ = test.motion(times)
    columns = {
        "piston/x [m]": x + settings.position_noise * rng.standard_normal(len(times)),
        "piston/F [N]": settings.force_noise * rng.standard_normal(len(times)),
    }
    for valve in ("extend", "retract"):
        profile = test.valves.get(f"valve/{valve}")
        on = np.zeros(len(times)) if profile is None else profile.at(times)
        columns[f"valve/{valve} [1]"] = on
    return Trajectory(times, columns, {"name": test.name})


def _colour(rows: float) -> Colour:
    """Colour of the sensor's white noise with what no model explains, in units of the former."""
    settings, rng = ExperimentSettings, np.random.default_rng(0)
    keep = float(np.exp(-1.0 / (rows * settings.memory)))
    slow = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.standard_normal(settings.sample))
    share = settings.unexplained / settings.force_noise
    return learn(rng.standard_normal(settings.sample) + share * slow)


def _menu(stroke: float) -> list[Rig]:
    """Standard tests of one piston of this stroke [m]."""
    modes, ends = ("extend", "retract", "both", "none"), [0.0, stroke / 2, stroke]

    def locked(chamber: str) -> Rig:
        asked = {"name": f"locked_{chamber}", "chamber": chamber, "positions": ends}
        return LockedRig.model_validate(asked)

    def strokes(name: str, *speeds: float) -> Rig:
        asked = {"name": name, "speeds": {mode: list(speeds) for mode in modes}}
        return DynamometerRig.model_validate(asked)

    return [
        locked("extend"),
        locked("retract"),
        strokes("slow_stroke", 0.02, 0.05),
        strokes("dynamometer", 0.1, 0.3, 0.6, 1.0),
        RandomRig.model_validate({"name": "random", "duration": 4.0}),
        RandomRig.model_validate({"name": "random_fast", "duration": 4.0, "speed": 1.2}),
    ]


def judged_menu(bench: VirtualBench, rivals: Rivals) -> Iterator[JudgedTest]:
    """Every standard test; none where a rig cannot show two of the rivals."""
    for rig in _menu(bench.stroke):
        found = separation(bench.problem(rig), rivals)
        if found is None:
            return
        yield bench.judged(rig, found)


# What a designed test of a rig may do.
LONGEST = 2.0  # longest log of a designed test [s]: short
# shortest log of a designed test [s]: chambers fill and vent three times, at the slowest rise
# time of Table I
SHORTEST = 0.3
SHARE = 0.5  # its log time as a share of that of the best standard test: half
PLACES = 9  # places that the rod goes through
MOST_LAPS = 3  # most times that it goes through them
PULSES = 3  # pulses of each valve
# shortest time between two switchings of a valve [s]: twice the dead time of the paper's valves
DWELL = 0.02
FASTEST = 1.2  # highest speed of the rod [m.s-1]: that of the fastest standard test
STEEPEST = 1.5  # highest speed of a monotone cubic piece that begins and ends at rest, by its mean


def course(point: Array, duration: float, stroke: float) -> CourseRig:
    """The course of a point (k,) of the unit cube, which lasts `duration` [s]."""
    laps = 1 + min(int(point[-1] * MOST_LAPS), MOST_LAPS - 1)
    every = duration / (laps * (PLACES - 1))
    first, second = np.split(point[PLACES:-1], 2)
    way = np.append(np.tile(point[: PLACES - 1], laps), point[PLACES - 1]) * stroke
    reach, places = FASTEST * every / STEEPEST, [float(way[0])]
    for x in way[1:]:
        places.append(float(np.clip(x, places[-1] - reach, places[-1] + reach)))
    return CourseRig(
        name="designed",
        places=tuple(round(x, 5) for x in places),
        every=every,
        extend=_spans(first, duration),
        retract=_spans(second, duration),
    )


def _spans(weights: Array, duration: float) -> tuple[tuple[float, float], ...]:
    """Spans in which a valve is on: `weights` (2 pulses,) share the time, each for a while."""
    weights = np.append(weights, 0.5) + 1e-3
    dwell = min(DWELL, 0.5 * duration / len(weights))
    parts = dwell + weights / weights.sum() * (duration - dwell * len(weights))
    edges = np.round(np.cumsum(parts[:-1]), 4)
    return tuple((float(edges[2 * i]), float(edges[2 * i + 1])) for i in range(len(edges) // 2))


def beginnings(count: int, seed: int) -> Array:
    """Points (count, k) from which a search begins: plain courses, then points that fill the
    cube evenly."""
    plain = np.array(list(_plain()))
    more = max(count - len(plain), 1)
    even = qmc.Sobol(plain.shape[1], rng=seed).random_base2(int(np.ceil(np.log2(more))))
    return np.asarray(np.vstack([plain, even])[:count])


def _plain() -> Iterator[Array]:
    """A rod at rest, a slow stroke, strokes to and fro, each with valves in turn and together."""
    ways = [
        np.full(PLACES, 0.5),
        np.linspace(0.05, 0.95, PLACES),
        0.5 - 0.45 * np.cos(np.arange(PLACES) * np.pi / 2),
    ]
    early, late = np.tile([0.2, 0.5], PULSES), np.tile([0.5, 0.2], PULSES)
    for way in ways:
        yield np.concatenate([way, early, late, [0.0]])
        yield np.concatenate([way, early, early, [1.0]])


def _best_point(worth: Callable[[Array], float], begin: Array, say: Tell) -> tuple[Array, int]:
    """The point (k,) of the unit cube worth most in a search from `begin` (m, k); tries."""
    settings, started = DesignSearchSettings, time.monotonic()
    seen: list[tuple[float, Array]] = []

    def cost(point: Array) -> float:
        if seen and time.monotonic() - started > settings.budget:
            return 0.0
        value = worth(np.asarray(point))
        seen.append((value if np.isfinite(value) else 0.0, np.array(point)))
        top = max(value for value, _ in seen)
        say(f"{len(seen)} tests tried; the best is worth {top:.2f}")
        return -seen[-1][0]

    differential_evolution(
        cost,
        [(0.0, 1.0)] * begin.shape[1],
        init=np.clip(begin, 0.0, 1.0),
        maxiter=settings.generations,
        rng=np.random.default_rng(settings.seed),
        polish=False,
        tol=0.0,
    )
    return max(seen, key=lambda item: item[0])[1], len(seen)


@dataclass(frozen=True)
class RigDesign(Proposal):
    """A proposal of rigs; `chosen` is the one to be done."""

    @property
    def chosen(self) -> JudgedTest:
        """The designed test, except where only the standard one settles the question."""
        clear = ExperimentSettings.clear
        least, other = self.designed.least, self.standard.least
        return self.standard if least < min(clear, other) else self.designed

    @property
    def sentence(self) -> str:
        """What the test gains, in words."""
        chosen, standard, (first, second) = self.chosen, self.standard, self.pair
        word, length = strength(self.nats), f"{chosen.log_s:.2g} s of log"
        if self.nats < ExperimentSettings.clear:
            return (
                f"No test of a rig that was tried separates {first} from {second}: the best, "
                f"'{chosen.test.name}' ({length}), is expected to give {word} evidence."
            )
        text = (
            f"The test '{chosen.test.name}' ({length}) separates {first} from {second}: {word} "
            "evidence is expected"
        )
        if chosen is standard:
            return f"{text}; no shorter test that was tried gives as much."
        other = f"the best standard test, '{standard.test.name}' ({standard.log_s:.2g} s)"
        if standard.least < 1.0:
            return f"{text}; {other}, gives almost none."
        return f"{text}, {chosen.pace / standard.pace:.2g} times as much per second as {other}."

    def json(self) -> dict[str, Any]:
        """The same with the names of the rigs."""
        found = {"rig": self.chosen.test.name, **super().json()}
        for side, judged in (("designed", self.designed), ("standard", self.standard)):
            found[side] = {"rig": judged.test.name, **found[side]}
        return found


def design_rig_test(model: Model, rivals: Rivals, say: Tell = silent) -> RigDesign | None:
    """The test of the piston of `model` that tells the rivals apart best, found in about a minute;
    None where a rig cannot show two of them."""
    bench = VirtualBench(model, ExperimentSettings.rows)
    coarse = VirtualBench(model, ExperimentSettings.coarse)
    say("judging the standard tests")
    standards = list(judged_menu(coarse, rivals))
    if not standards:
        return None
    standard = max(standards, key=lambda j: j.least)
    duration = SHARE * standard.log_s
    duration = float(np.clip(duration, SHORTEST, LONGEST))

    def worth(point: Array) -> float:
        found = separation(coarse.problem(course(point, duration, bench.stroke)), rivals)
        return found.worth if found is not None else 0.0

    search = DesignSearchSettings
    say(f"designing a test of {duration:.1f} s")
    point, tried = _best_point(worth, beginnings(search.members, search.seed), say)
    rig = course(point, duration, bench.stroke)
    say("fitting the rivals to what the tests would measure")
    before, after = (_confirmed(bench, r, rivals) for r in (standard.test, rig))
    return RigDesign(before, after, tried)


def _confirmed(bench: VirtualBench, rig: Rig, rivals: Rivals) -> JudgedTest:
    """A test, its evidence between the nearest rivals by a fit in place of slopes."""
    problem = bench.problem(rig)
    straight = separation(problem, rivals)
    assert straight is not None
    first, nearest = straight.first, straight.nearest
    logs = []  # in which everything is as the first rival has it
    for i, log in enumerate(problem.logs):
        readings = problem.readings(rivals.theta(first), i)
        logs.append(replace(log, measured={c: y for c, (y, _) in readings.items()}))
    exact = _with_logs(problem, logs)
    fitted = misfit(exact, best_fit(exact, rivals, nearest))
    nats = {**straight.nats, nearest: min(fitted, straight.least)}
    return bench.judged(rig, Separation(first, nats))


def propose(folder: str | Path, out: Path, say: Tell = silent) -> RigDesign:
    """The test of a rig that best tells the possible effects of an answer in `folder` apart, a YAML
    in `out`, found in about a minute. `say` gets what is being done.

    Raises KembaError where no test shows a difference, or a file cannot be read or written.
    """
    answer = read_answer(folder)
    rivals = contenders(answer)
    model = load_model(str(answer.get("base") or "planning"), rig=True)
    if model.mechanism.rig:
        what = f"its model {model.name} is a rig of your own, of kind {model.mechanism.rig}"
        hint = "tests are designed for a piston with valves and for the robot only"
        raise KembaError(str(folder), what, hint=hint)
    found = design_rig_test(model, rivals, say)
    if found is None:
        names = ", ".join(rivals.names)
        raise KembaError(str(folder), f"no rig test shows a difference between {names}")
    chosen = found.chosen.test
    rig = {"kind": chosen.kind, **chosen.model_dump(mode="json", exclude_defaults=True)}
    dump_yaml({"rig": {**rig, "notes": found.sentence}}, out)
    return found
