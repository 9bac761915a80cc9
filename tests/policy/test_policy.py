"""Feedback: the hybrid map agrees with the plant's differences; a policy plays and corrects."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from kemba.model import Model, load_model
from kemba.plant.commands import Profile
from kemba.plant.controller import execute
from kemba.plant.repeat import Sensors
from kemba.policy import player
from kemba.policy.course import course_of
from kemba.policy.execute import execute_policy
from kemba.policy.modes import Edge, EventCourse, Saltation, plain
from kemba.policy.observer import measured, observer_of
from kemba.policy.player import Policy
from kemba.policy.write import gains_of, policy_arrays, write_policy
from kemba.trajectory import Trajectory
from kemba_cli.main import app

TICKS = 140


@pytest.fixture(scope="module")
def model() -> Model:
    return load_model("planning")


@pytest.fixture(scope="module")
def table(model: Model) -> Trajectory:
    """A tilted robot is dropped, lands on one foot after the other, and pushes up."""
    stance, time = dict(model.mechanism.standing), np.arange(TICKS) / 1000.0
    columns: dict[str, np.ndarray] = {}
    for leg in model.mechanism.legs:
        columns[f"{leg}/hip/q [rad]"] = np.full(TICKS, stance[f"{leg}/hip/q"])
        columns[f"{leg}/hip/w [rad.s-1]"] = np.zeros(TICKS)
        columns[f"{leg}/hip/tau [N.m]"] = np.zeros(TICKS)
        columns[f"{leg}/valve/extend [1]"] = ((time >= 0.01) & (time < 0.1)) * 1.0
        columns[f"{leg}/valve/retract [1]"] = np.zeros(TICKS)
        columns[f"{leg}/piston/x [m]"] = np.full(TICKS, 0.02)
    columns["body/x [m]"] = np.zeros(TICKS)
    columns["body/z [m]"] = np.full(TICKS, stance["body/z"] + 0.12)
    columns["body/pitch [rad]"] = np.full(TICKS, 0.06)
    return Trajectory(time, columns, {"kind": "controller", "lead": 0.0})


@pytest.fixture(scope="module")
def course(model: Model, table: Trajectory) -> EventCourse:
    return course_of(model, table)


def states(model: Model) -> list[str]:
    mechanism = model.mechanism
    names = [q.name for q in (*mechanism.coordinates, *mechanism.velocities)]
    return [*names, *(q.name for q in model.states.values())]


def along(course: EventCourse, begin: float, end: float) -> np.ndarray:
    """The slope (n, n) of the state at `end` [s] by the state at `begin` [s], no policy."""
    n, m = course.hybrid.size, len(course.joints)
    found = np.eye(n + m)
    for event in course.events:
        if begin - 1e-9 <= event.time < end - 1e-9:
            found = plain(event, n, m) @ found
    return found[:n, :n]


@pytest.mark.parametrize("end", [0.02, 0.05, 0.13])
def test_the_map_from_start_to_landing_is_the_plants(
    model: Model, table: Trajectory, course: EventCourse, end: float
) -> None:
    """Through flight, two touchdowns, sticking and sliding: every column within 5 %."""
    names, row = states(model), round(1000 * end)
    start = execute(table, model).trajectory
    base = {name: float(start[name][0]) for name in names}
    found = along(course, 0.0, end)
    for j, name in enumerate(names):
        step = 1e-4 if j < 7 else 1e-3 if j < 14 else 0.05
        ends = []
        for sign in (1.0, -1.0):
            moved = execute(table, model, start={**base, name: base[name] + sign * step}).trajectory
            ends.append(np.array([moved[n][row] for n in names]))
        difference = (ends[0] - ends[1]) / (2 * step)
        error = np.linalg.norm(found[:, j] - difference) / np.linalg.norm(difference)
        assert error < 0.05, f"{name}: {error:.3f}"


def test_impacts_change_the_map(course: EventCourse) -> None:
    """Without their saltation matrices the map would be quite another one."""
    hits = [e for e in course.events if isinstance(e, Saltation)]
    assert len(hits) == 3  # the start, and each foot
    assert all(np.abs(hit.saltation - np.eye(18)).max() > 1.0 for hit in hits[1:])


def test_an_edge_that_comes_late_acts_as_in_the_plant(
    model: Model, table: Trajectory, course: EventCourse
) -> None:
    edge = next(e for e in course.events if isinstance(e, Edge) and e.valve.startswith("front"))
    n = len(states(model))
    predicted = along(course, edge.time, 0.09) @ edge.late
    ends = []
    for shift in (1e-4, -1e-4):
        profile = Profile(np.array([-1.0, 0.01 + shift, 0.1]), np.array([0.0, 1.0, 0.0]))
        done = execute(table, model, valves={"front/valve/extend": profile}).trajectory
        ends.append(np.array([done[name][90] for name in states(model)]))
    difference = (ends[0] - ends[1]) / 2e-4
    assert edge.sent == 10 and n == len(predicted)
    assert np.linalg.norm(predicted - difference) < 0.05 * np.linalg.norm(difference)


def test_gains_bring_the_body_back(model: Model, table: Trajectory, course: EventCourse) -> None:
    """On the linear model the LQR's cost to come is less than without it."""
    gains = gains_of(course, 0.139)
    assert len(gains.hips) >= TICKS - 5
    assert max(np.abs(K).max() for K in gains.hips.values()) > 1.0
    assert {(e.valve, e.index) for e, _ in gains.edges} == {
        (f"{leg}/valve/extend", k) for leg in ("front", "rear") for k in (0, 1)
    }


def test_the_filter_goes_from_tick_to_tick_along_the_course(course: EventCourse) -> None:
    """Without what a policy adds, and from an edge that comes late on."""
    found = observer_of(course, np.arange(len(course.states)), 0)
    through = np.linalg.multi_dot(found.A[20:70][::-1])
    assert np.allclose(through, along(course, 0.02, 0.07), atol=1e-9 * np.abs(through).max())
    edge = next(e for e in course.events if isinstance(e, Edge))
    row, change = found.late[edge.valve, edge.index]
    assert row / 1000 <= edge.time <= (row + 1) / 1000
    assert np.allclose(change, along(course, edge.time, (row + 1) / 1000) @ edge.late)


def test_the_filter_tells_deviations_from_noise(
    model: Model, table: Trajectory, tmp_path: Path
) -> None:
    """Of a body that is turned by 0.02 rad: its pitch, and no rate, of which a line through the
    last eight readings would tell 0.3 rad/s by noise alone."""
    file = write_policy(model, table, tmp_path / "policy.npz")
    turned = execute(table, model, start={"body/pitch": 0.08}).trajectory
    sigma = np.array([Sensors.usual().noise[n.split("/")[-1]] for n in measured(model)])
    rng, told = np.random.default_rng(4), []
    for _ in range(20):
        policy = Policy(file, retime=False, hips=False)
        for row in range(25):
            seen = np.array([turned[name][row] for name in policy.measured])
            policy.step(seen + sigma * rng.standard_normal(len(seen)), np.zeros(2))
        told.append([policy.x[states(model).index(f"body/{n}")] for n in ("pitch", "pitch_rate")])
    (pitch, rate), scatter = np.mean(told, axis=0), np.std(told, axis=0)
    assert pitch == pytest.approx(0.02, abs=2e-3) and abs(rate) < 0.02
    assert scatter[0] < sigma[2] and scatter[1] < 0.02


def test_the_player_without_corrections_is_the_table(
    model: Model, table: Trajectory, tmp_path: Path
) -> None:
    file = write_policy(model, table, tmp_path / "policy.npz")
    plain = execute(table, model).trajectory
    played = execute_policy(table, Policy(file, retime=False, hips=False), model).trajectory
    assert np.abs(played["body/z"] - plain["body/z"]).max() < 1e-4
    assert np.abs(played["body/pitch"] - plain["body/pitch"]).max() < 1e-3


def test_hips_reduce_the_pitch_at_the_end(model: Model, table: Trajectory, tmp_path: Path) -> None:
    """Before the feet touch, a push on the body is turned into less pitch rate."""
    file = write_policy(model, table, tmp_path / "policy.npz")
    start = {"body/pitch_rate": 0.5}
    nominal = execute(table, model).trajectory
    errors = []
    for hips in (False, True):
        done = execute_policy(table, Policy(file, False, hips), model, start=start).trajectory
        errors.append(abs(done["body/pitch"][-1] - nominal["body/pitch"][-1]))
    assert errors[1] < errors[0]


def test_corrections_are_bounded(course: EventCourse, tmp_path: Path) -> None:
    arrays = policy_arrays(course)
    file = tmp_path / "policy.npz"
    np.savez(file, **arrays)  # type: ignore[arg-type]
    policy = Policy(file)
    plain = Policy(file, hips=False)
    far = arrays["reference"][0] + 1.0
    rates = np.zeros(2)
    most = float(arrays["most_torque"])
    gap = policy.step(far, rates)[0] - plain.step(far, rates)[0]
    assert np.abs(gap).max() <= most + 1e-9
    when = [int(np.argmax([policy.step(far, rates)[1][0] for _ in range(30)]))]
    assert abs(when[0] + 1 - 10) <= int(arrays["most_shift"])


def test_the_reference_player_is_short_and_needs_only_numpy() -> None:
    source = Path(player.__file__).read_text("utf-8")
    assert len(source.splitlines()) < 150
    roots = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            roots |= {alias.name.split(".")[0] for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            roots.add(str(node.module).split(".")[0])
    assert roots <= {"__future__", "os", "typing", "numpy"}


@pytest.mark.slow
def test_simulate_with_a_policy(tmp_path: Path) -> None:
    words = ["solve", "drop.yaml", "--set", "nodes=40", "--no-figure", "-q"]
    CliRunner().invoke(app, [*words, "--out", str(tmp_path / "run")])
    done = CliRunner().invoke(
        app, ["simulate", str(tmp_path / "run"), "--policy", "--noise", "--json"]
    )
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert len(told["logs"]) == 1 and (tmp_path / "run" / "policy.npz").is_file()
    log = Trajectory.read(told["logs"][0])
    assert set(np.unique(log["front/valve/extend"])) <= {0.0, 1.0}
