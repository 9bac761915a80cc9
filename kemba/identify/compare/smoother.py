"""How much force is missing, for robot and bench logs alike."""

from __future__ import annotations

from kemba.identify.bench import BenchProblem
from kemba.identify.bench.missing import bench_missing
from kemba.identify.compare.missing_force import Missing
from kemba.identify.evidence.problem import Array, Problem, Theta
from kemba.identify.robot import RobotProblem
from kemba.identify.robot.missing import robot_missing


def missing_force(
    problem: Problem, theta: Theta | None = None, strength: Array | None = None
) -> list[Missing]:
    """d(t) of every run with its 95 % band: on a robot per body, hip and rod, on a bench the
    force on its rod.

    `strength` (k,): 1 sigma of each channel's force, learnt when not given. With the same strength
    estimates at two thetas differ by what the change of theta explains. Raises TypeError for other
    problems.
    """
    if isinstance(problem, RobotProblem):
        return robot_missing(problem, theta, strength)
    if isinstance(problem, BenchProblem):
        return bench_missing(problem, theta, strength)
    raise TypeError(f"no force is defined for a {type(problem).__name__}")
