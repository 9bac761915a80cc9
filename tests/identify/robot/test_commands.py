"""Commands that are swapped or turned are named; without torques hips are left unknown."""

import numpy as np
import pytest
from robot_logs import hops

from kemba.identify.logs.gate import BadData
from kemba.identify.logs.reading import read_log
from kemba.identify.robot.problem import RobotProblem, robot_problem
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

LEGS = ("front", "rear")


@pytest.fixture(scope="module")
def logs() -> list[Trajectory]:
    return hops(runs=1)[0]


def problem(log: Trajectory) -> RobotProblem:
    return robot_problem([log], load_model("planning"))


def taken(log: Trajectory, change: dict[str, np.ndarray]) -> Trajectory:
    return log.with_columns({f"{name} [{log.unit(name)}]": y for name, y in change.items()})


def test_what_is_right_is_left_alone(logs: list[Trajectory]) -> None:
    problem(logs[0]).validate()


@pytest.mark.parametrize("legs", [LEGS, ("rear",)])
def test_the_sign_of_torques(legs: tuple[str, ...], logs: list[Trajectory]) -> None:
    log = logs[0]
    turned = taken(log, {f"{leg}/hip/tau": -log[f"{leg}/hip/tau"] for leg in legs})
    whose = "every leg" if len(legs) == 2 else "the rear leg"
    with pytest.raises(BadData, match=f"hip/tau of {whose} has the reversed sign"):
        problem(turned).validate()


@pytest.mark.parametrize("mistake", ["swapped", r"inverted \(1 is on\)"])
def test_valves(mistake: str, logs: list[Trajectory]) -> None:
    log, sides = logs[0], ("extend", "retract")
    change = {}
    for name in (f"{leg}/valve/" for leg in LEGS):
        for a, b in (sides, sides[::-1]):
            swapped = mistake == "swapped"
            change[name + a] = log[name + b] if swapped else 1.0 - log[name + a]
    with pytest.raises(BadData, match=f"valve/extend and valve/retract are {mistake}"):
        problem(taken(log, change)).validate()


def test_a_log_without_torques(logs: list[Trajectory], tmp_path) -> None:  # type: ignore[no-untyped-def]
    """The authors' logs have none: hips are unknown, and the rest is explained as well."""
    log = logs[0]
    names = [name for name in log.names if "hip/tau" not in name]
    bare = log.select(names)
    bare.write(tmp_path / "log.csv")
    read = read_log(tmp_path / "log.csv")
    assert not np.any(read["front/hip/tau"]) and "no hip torques are logged" in read.meta["read"][0]
    found = problem(read)
    found.validate()
    both = [p.residual(p.lengths) for p in (found, problem(log))]
    power = [float(np.sqrt(np.mean(r**2))) for r in both]
    assert power[0] < 1.3 * power[1]
