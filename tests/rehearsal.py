"""Tests of a rig done on the independent twin, and what their logs say between two rivals."""

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from twin import bench, logs
from twin.cases import coloured, draw
from twin.catalogue import is_sensor
from twin.figures import Robot
from twin.measure import Sensors
from twin.rigs import Rig as TwinRig

from kemba.identify.bench.problem import BenchProblem, bench_problem
from kemba.identify.design.separation import Rivals, best_fit, misfit
from kemba.identify.infer.refit import Frozen, refit
from kemba.identify.logs.reading import read_logs
from kemba.model.model import Model
from kemba.plant.rigs import CourseRig, Rig, Test

RATE = 1000.0  # Hz
# what `experiment` takes the sensors of a rig to be
SENSORS = Sensors(sigma={"piston/x": 1e-5}, quantise=False)
UNEXPLAINED = 0.5  # N, coloured force that no model has
# one fill and one stroke: a log that leaves much in doubt
FIRST = CourseRig(name="first", places=(0.01, 0.01, 0.06, 0.06), every=0.12, extend=((0.05, 0.3),))


class Machine:
    """A rig of the twin with one hidden effect, its figures 1 % off."""

    def __init__(self, effect: str, seed: int, size: float = 1.0) -> None:
        made = draw(effect, size, seed, SENSORS, 0.0)
        self.seed = seed
        self.faults = [made] if is_sensor(made["kind"]) else []
        self.present = [] if self.faults else [made]
        self.robot = Robot().jittered(np.random.default_rng([seed, 4]), 0.01)

    def done(self, rig: Rig, stroke: float, folder: Path, most: int = 12) -> list[Path]:
        """Logs of the first tests of a rig."""
        tests = islice(rig.tests(np.random.default_rng(0), stroke), most)
        return [self._log(test, folder, run) for run, test in enumerate(tests)]

    def _log(self, test: Test, folder: Path, run: int) -> Path:
        rng = np.random.default_rng([self.seed, 2, run])
        ticks = np.arange(round(float(test.times[-1]) * RATE) + 1) / RATE
        sent = [test.valves.get(f"valve/{valve}") for valve in ("extend", "retract")]
        valves = np.stack([np.zeros(len(ticks)) if s is None else s.at(ticks) for s in sent], 1)
        rig = TwinRig(test.name, ticks, *test.motion(ticks), valves)
        push = coloured(ticks, [UNEXPLAINED], rng)[:, 0]
        truth = bench.simulate(rig, self.present, self.robot, push=push)
        columns = bench.bench_log(truth, SENSORS, self.faults, rng)
        path = logs.write(folder / f"{rig.name}_{run}.csv", columns)
        logs.sidecar(path, "bench", run, rig.name, {})
        return path


def problem_of(paths: Sequence[Path], model: Model) -> BenchProblem:
    """The problem that logs pose."""
    return bench_problem(read_logs(paths), model)


def fitted(problem: BenchProblem, names: Sequence[str]) -> Rivals:
    """Rivals as a first log has them, each fitted to it by itself."""
    typical = Rivals({name: problem.candidates[name].typical() for name in names}, {})
    found = {}
    for name in names:
        theta = best_fit(problem, typical, name)
        found[name] = {key: theta[key] for key in problem.candidates[name].keys()}  # noqa: SIM118
    return Rivals(found, {})


def measured_evidence(problem: BenchProblem, rivals: Rivals, truth: str, other: str) -> float:
    """Evidence [nats] for `truth` against `other` that logs hold. The colour of the noise is that
    of what a model with both effects leaves over."""
    names = tuple(problem.nuisance)
    both: dict[str, Any] = {**rivals.theta(truth), **rivals.theta(other)}
    frozen = Frozen(names, problem.jacobian(both, names))
    flexible = refit(problem, tuple(sorted((truth, other))), both, frozen).theta
    white = problem.recolour(problem.residual(flexible))
    right, wrong = (misfit(white, best_fit(white, rivals, name)) for name in (truth, other))
    return wrong - right
