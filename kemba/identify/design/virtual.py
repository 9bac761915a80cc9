"""Logs that tests of a rig would give, without the rig, and the standard tests judged by them."""

from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from scipy.signal import lfilter

from kemba.identify.bench.bench_log import BenchLog, prepare
from kemba.identify.bench.problem import BenchProblem
from kemba.identify.design.separation import ExperimentSettings, Rivals, Separation, separation
from kemba.identify.problem.noise import Colour, learn
from kemba.identify.problem.types import Theta
from kemba.model.model import Model
from kemba.plant.rigs import DynamometerRig, LockedRig, RandomRig, Rig, Test
from kemba.trajectory import Trajectory


class VirtualBench:
    """Problems that the logs of tests would pose, if this model were nearly right.

    `rows`: rows of the logs per second.
    """

    def __init__(self, model: Model, rows: float) -> None:
        self.model, self.stroke, self.rows = model, model.mechanism.stroke, rows
        self.colour = _colour(rows)
        self._first: BenchProblem | None = None

    def problem(self, rig: Rig) -> BenchProblem:
        """The problem of a rig's tests, the first few of them."""
        tests = rig.tests(np.random.default_rng(0), self.stroke)
        logs = [
            prepare(test.name, _virtual_log(test, self.rows, i), on_rows=True)
            for i, test in enumerate(islice(tests, ExperimentSettings.tests))
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
    found.predicted = replace(problem.predicted, logs=tuple(logs))
    found.runs = tuple(log.name for log in logs)
    return found


def as_predicted(problem: BenchProblem, theta: Theta) -> BenchProblem:
    """The problem of logs in which everything is as the model at theta has it."""
    logs = []
    for i, log in enumerate(problem.logs):
        readings = problem.predicted.readings(theta, i)
        logs.append(replace(log, measured={c: y for c, (y, _) in readings.items()}))
    return _with_logs(problem, logs)


def log_time(rig: Rig, stroke: float) -> float:
    """Seconds of log of the tests that are judged."""
    tests: Iterable[Test] = rig.tests(np.random.default_rng(0), stroke)
    tests = islice(tests, ExperimentSettings.tests)
    return sum(float(test.times[-1] - test.times[0]) for test in tests)


def _virtual_log(test: Test, rows: float, seed: int = 0) -> Trajectory:
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
    """Colour of white noise of the force sensor and of what no model explains, in units of the
    former."""
    settings, rng = ExperimentSettings, np.random.default_rng(0)
    keep = float(np.exp(-1.0 / (rows * settings.memory)))
    slow = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.standard_normal(settings.sample))
    share = settings.unexplained / settings.force_noise
    return learn(rng.standard_normal(settings.sample) + share * slow)


@dataclass(frozen=True)
class JudgedRig:
    """A rig, the evidence that its tests are expected to give, and the seconds of its logs."""

    rig: Rig
    evidence: Separation
    log_s: float

    @property
    def pace(self) -> float:
        """Expected evidence [nats] per second of log."""
        return self.evidence.least / self.log_s


def _menu(stroke: float) -> list[Rig]:
    """Standard tests of one piston of this stroke [m]."""
    modes = ("extend", "retract", "both", "none")
    slow = DynamometerRig.model_validate(
        {"name": "slow_stroke", "speeds": {m: [0.02, 0.05] for m in modes}}
    )
    fast = DynamometerRig.model_validate(
        {"name": "dynamometer", "speeds": {m: [0.1, 0.3, 0.6, 1.0] for m in modes}}
    )
    both_ends = {"positions": [0.0, stroke / 2, stroke]}
    return [
        LockedRig.model_validate({"name": "locked_extend", "chamber": "extend", **both_ends}),
        LockedRig.model_validate({"name": "locked_retract", "chamber": "retract", **both_ends}),
        slow,
        fast,
        RandomRig.model_validate({"name": "random", "duration": 4.0}),
        RandomRig.model_validate({"name": "random_fast", "duration": 4.0, "speed": 1.2}),
    ]


def judged_menu(bench: VirtualBench, rivals: Rivals) -> Iterator[JudgedRig]:
    """Every standard test; none where a rig cannot show two of the rivals."""
    for rig in _menu(bench.stroke):
        found = separation(bench.problem(rig), rivals)
        if found is None:
            return
        yield JudgedRig(rig, found, log_time(rig, bench.stroke))
