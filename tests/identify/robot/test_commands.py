"""Commands that are swapped or turned are named; without torques hips are left unknown."""

from collections.abc import Callable

import numpy as np
import pytest
from robot_logs import hops
from twin.measure import Sensors

from kemba.identify.logs.gate import BadData
from kemba.identify.logs.reading import read_log
from kemba.identify.problem.problem import Array
from kemba.identify.robot.problem import RobotProblem, robot_problem
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

LEGS = ("front", "rear")


@pytest.fixture(scope="module")
def logs() -> list[Trajectory]:
    return hops(runs=1, seed=1)[0]


def problem(log: Trajectory) -> RobotProblem:
    return robot_problem([log], load_model("planning"))


def taken(log: Trajectory, change: dict[str, np.ndarray]) -> Trajectory:
    return log.with_columns({f"{name} [{log.unit(name)}]": y for name, y in change.items()})


def test_what_is_right_is_left_alone(logs: list[Trajectory]) -> None:
    problem(logs[0]).validate()


TORQUES = [f"{leg}/hip/tau" for leg in LEGS]
SIDES = ("extend", "retract")
FRONT, REAR = ([f"{leg}/valve/{side}" for side in SIDES] for leg in LEGS)
# columns, those that each is taken from, whether they are inverted, and the words
MISTAKES: dict[str, tuple[list[str], list[str], str, str]] = {
    "torques": (TORQUES, TORQUES, "-", "hip/tau of every leg has the reversed sign"),
    "a torque": (TORQUES[1:], TORQUES[1:], "-", "hip/tau of the rear leg has the reversed sign"),
    "legs' torques": (TORQUES, TORQUES[::-1], "", "hip/tau of the legs is swapped"),
    "valves": ([*FRONT, *REAR], [*FRONT[::-1], *REAR[::-1]], "", "are swapped at every leg"),
    "a leg's valves": (FRONT, FRONT[::-1], "", "are swapped at the front leg"),
    "legs' valves": ([*FRONT, *REAR], [*REAR, *FRONT], "", "the valves of the legs are swapped"),
    "inverted": ([*FRONT, *REAR], [*FRONT, *REAR], "1", r"are inverted \(1 is on\) at every leg"),
    "a valve": (
        FRONT[:1],
        FRONT[:1],
        "1",
        r"valve/extend is inverted \(1 is on\) at the front leg",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_about_commands(mistake: str, logs: list[Trajectory]) -> None:
    columns, source, turn, words = MISTAKES[mistake]
    turned = {"": lambda y: y, "-": np.negative, "1": lambda y: 1.0 - y}[turn]
    change = {a: turned(logs[0][b]) for a, b in zip(columns, source, strict=True)}
    with pytest.raises(BadData, match=words):
        problem(taken(logs[0], change)).validate()


def test_valves_of_the_other_leg_in_an_even_hop() -> None:
    """They hardly matter, and would be taken for a turned pitch and swapped pistons."""
    (log,), _ = hops(runs=1, seed=8, figures_off=0.01)
    crossed = {a: log[b] for pair in zip(FRONT, REAR, strict=True) for a, b in (pair, pair[::-1])}
    with pytest.raises(BadData, match="hop0: the valves of the legs are swapped; the log errs by"):
        problem(taken(log, crossed)).validate()


def test_pistons_in_another_unit_hardly_move_feet_of_legs_that_stand_drawn_in() -> None:
    """The model leaves much less without; no effect of air or boom is named instead."""
    (log,), _ = hops(runs=1, seed=12, figures_off=0.01)
    read = {f"{leg}/piston/x": log[f"{leg}/piston/x"] / 10.0 for leg in LEGS}
    with pytest.raises(BadData, match="hop0: piston/x of every leg is 10 times too small"):
        problem(taken(log, read)).validate()


@pytest.mark.parametrize(("legs", "whose"), [(LEGS, "every leg"), (LEGS[1:], "the rear leg")])
def test_turned_torques_that_hardly_show_are_told_by_their_gain(
    legs: tuple[str, ...], whose: str
) -> None:
    """As of a jump, whose hips work little; no wrong gain or inertia is named instead."""
    (log,), _ = hops(runs=1, seed=1, sensors=Sensors(noise=40.0))
    problem(log).validate()
    turned = {f"{leg}/hip/tau": -log[f"{leg}/hip/tau"] for leg in legs}
    words = rf"hop0: hip/tau of {whose} has the reversed sign; the log errs by [.0-9]* times"
    with pytest.raises(BadData, match=words):
        problem(taken(log, turned)).validate()


def test_two_mistakes_about_commands(logs: list[Trajectory]) -> None:
    read = {name: -logs[0][name] for name in TORQUES} | {FRONT[0]: 1.0 - logs[0][FRONT[0]]}
    words = (
        r"hip/tau of every leg has the reversed sign and valve/extend is inverted \(1 is on\) at"
    )
    with pytest.raises(BadData, match=words):
        problem(taken(logs[0], read)).validate()


def in_the_air(log: Trajectory) -> Trajectory:
    air = (log.time > 0.24) & (log.time < 0.42)
    read = dict(zip(log.headers, (log[name][air] for name in log.names), strict=True))
    return Trajectory(log.time[air], read, log.meta)


@pytest.mark.parametrize(
    ("column", "zero"),
    [("body/z", 0.3), ("body/z", -0.1), ("hip/q", np.pi / 2), ("rear/hip/q", -0.3),
     ("body/pitch", 0.2), ("piston/x", 0.01)],
)  # fmt: skip
def test_zeros_of_a_flight_are_never_taken_for_another_mistake(
    column: str, zero: float, logs: list[Trajectory]
) -> None:
    """They are doubted where a foot is in the ground, or said to be unknown."""
    flight = in_the_air(logs[0])
    moved = {name: flight[name] + zero for name in flight.names if name.endswith(column)}
    found = problem(taken(flight, moved))
    assert found.lengths == {}
    try:
        (said,) = found.validate()
    except BadData as refused:
        assert "is a sign, a zero or a unit of" in str(refused) or "a sign turned" in str(refused)
    else:
        assert said.startswith("no foot stands: wrong zeros of the height, the pitch, hips and pi")


@pytest.mark.parametrize(
    ("columns", "change", "words"),
    [
        ([f"{leg}/hip/q" for leg in LEGS], np.negative, "hip/q of every leg has the reversed sign"),
        (["rear/hip/q"], np.negative, "hip/q of the rear leg has the reversed sign; the log errs"),
        (["front/piston/x"], lambda x: 0.07 - x, "piston/x of the front leg counts from the ext"),
    ],
)
def test_a_flight_tells_mistakes_by_what_the_model_leaves(
    columns: list[str], change: Callable[[Array], Array], words: str, logs: list[Trajectory]
) -> None:
    """No foot stands for long enough."""
    flight = in_the_air(logs[0])
    problem(flight).validate()
    with pytest.raises(BadData, match=words):
        problem(taken(flight, {name: change(flight[name]) for name in columns})).validate()


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
