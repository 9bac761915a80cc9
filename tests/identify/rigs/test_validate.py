"""Mistakes in the columns of a drive's log and a cylinder's: signs, ends, zeros."""

import re
from pathlib import Path

import numpy as np
import pytest

from kemba.config import dump_yaml
from kemba.identify.logs.gate import BadData
from kemba.identify.rigs.problem import rig_problem
from kemba.identify.workflow import check_all, check_log, discover_logs
from kemba.model.model import Model
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

TIME = np.arange(0.0, 4.0, 2e-3)
Q = 0.8 * np.sin(2.1 * TIME) + 0.3 * np.sin(5.3 * TIME)
V, A = np.gradient(Q, TIME), np.gradient(np.gradient(Q, TIME), TIME)
FORCE = (0.02 + 1.5 * 0.25**2) * A + 1.5 * 0.25 * 9.81 * np.sin(Q) + 0.4 * np.tanh(V / 0.01)


def pendulum(q: np.ndarray, tau: np.ndarray) -> Trajectory:
    noise = np.random.default_rng(0).standard_normal((2, len(TIME)))
    columns = {"axis/q [rad]": q + 1e-4 * noise[0], "axis/tau [N.m]": tau + 0.05 * noise[1]}
    return Trajectory(TIME, columns, {"kind": "drive", "name": "run"})


@pytest.mark.parametrize(
    ("sign", "turned", "zero", "words"),
    [
        (1, -1, 0.0, "run: axis/tau has the reversed sign; or axis/q has the reversed sign; the"),
        (-1, 1, 0.0, "run: axis/tau has the reversed sign; or axis/q has the reversed sign; the"),
        (1, 1, 1.2, r"run: axis/q counts from another zero \(`offset: -68\.\d deg`\); the"),
        (-1, 1, 0.6, r"axis/q has the reversed sign and axis/q counts .*`offset: \+34\.\d deg`"),
    ],
)
def test_a_mistake_is_named_and_once_followed_nothing_is_left(
    sign: int, turned: int, zero: float, words: str
) -> None:
    """A pendulum seen from its other side is the same: both signs are named."""
    model, log = load_model("pendulum_rig"), pendulum(sign * Q + zero, turned * FORCE)
    with pytest.raises(BadData) as raised:
        rig_problem([log], model).validate()
    assert re.search(words, str(raised.value)), str(raised.value)
    first = str(raised.value).split("; or ")[-1 if sign < 0 else 0]
    offset = re.search(r"offset: (\S+) deg", first)
    q = (-1 if "axis/q has the reversed" in first else 1) * log["axis/q"]
    q = q + (np.radians(float(offset[1])) if offset else 0.0)
    tau = (-1 if "axis/tau has the reversed" in first else 1) * log["axis/tau"]
    right = rig_problem([pendulum(q, tau)], model)
    assert right.validate() == []
    assert np.sqrt(np.mean(right.residual({}) ** 2)) < 2.0  # of the noise


@pytest.mark.parametrize(
    ("column", "factor", "words"),
    [
        (
            "axis/q [rad]",
            0.1,
            r"run: axis/q is about (10|9\.\d) times too small \(its unit is wrong\)",
        ),
        (
            "axis/q [rad]",
            np.degrees(1.0),
            r"run: axis/q is about 5\d times too large .its unit is wrong",
        ),
        (
            "axis/tau [N.m]",
            4.448,
            r"run: axis/tau is about 4.\d times too large .its unit is wrong",
        ),
        (
            "axis/tau [N.m]",
            -0.001,
            r"reversed sign and axis/tau is about 1\d00 times too small .its unit",
        ),
    ],
)
def test_another_unit_of_a_drive_is_named_and_a_heavier_axis_is_none(
    column: str, factor: float, words: str
) -> None:
    right, model = pendulum(Q, FORCE + A * 0.02), load_model("pendulum_rig")
    columns = dict(zip(right.headers, (right[name] for name in right.names), strict=True))
    assert rig_problem([right], model).validate() == []
    columns[column] = factor * columns[column]
    with pytest.raises(BadData) as raised:
        rig_problem([Trajectory(TIME, columns, right.meta)], model).validate()
    assert re.search(words, str(raised.value)), str(raised.value)


@pytest.mark.parametrize(
    ("q", "tau", "time", "words"),
    [
        (0.1, 1.0, 1.0, r"10 times"),
        (1.0, 10.0, 1.0, r"10 times"),
        (39.37, 1.0, 1e3, r"25000 times"),  # inches and milliseconds
        (1e3, 1e-3, 1.0, r"1e-06 times"),  # millimetres and kilonewtons
    ],
)
@pytest.mark.parametrize("load", [None, {"mass": "3 kg"}])
def test_where_no_weight_hangs_on_the_position_no_unit_is_blamed_alone(
    q: float, tau: float, time: float, words: str, load: dict[str, str] | None, tmp_path: Path
) -> None:
    """Inertia and friction look alike in many pairs of units: advice on one would be false."""
    rig = {"kind": "drive", "inertia": "2 kg"} | ({"load": load} if load else {})
    dump_yaml({"rig": rig}, tmp_path / "model.yaml")
    force = 2.0 * A + (3.0 * (A + 9.81) if load else 0.0) + 3.0 * np.tanh(V / 0.01)
    model = load_model(tmp_path / "model.yaml")
    for factors in ((1.0, 1.0, 1.0), (q, tau, time)):
        columns = {"axis/q [m]": factors[0] * Q, "axis/tau [N]": factors[1] * force}
        log = Trajectory(factors[2] * TIME, columns, RUN | {"kind": "drive"})
        if factors == (1.0, 1.0, 1.0):
            assert rig_problem([log], model).validate() == []
    said = rf"^log: axis/tau is about {words} what suits axis/q and the time \(the unit of one"
    with pytest.raises(BadData, match=said) as raised:
        rig_problem([log], model).validate()
    assert "; or " not in str(raised.value)


@pytest.mark.parametrize(
    ("sign", "turned", "zero", "words"),
    [
        (1, 1, 0.0, ""),
        (1, 1, 20.0, ""),
        (-1, -1, 0.0, "axis/q has the reversed sign and axis/tau has the reversed sign"),
        (-1, 1, 0.0, "axis/q has the reversed sign"),
        (1, -1, 0.0, "axis/tau has the reversed sign"),
    ],
)
def test_a_weight_tells_up_from_down(
    sign: int, turned: int, zero: float, words: str, tmp_path: Path
) -> None:
    """A zero of twice the weight would put an axis right that counts downwards; others stay."""
    rig = {"kind": "drive", "inertia": "2 kg", "load": {"mass": "3 kg"}}
    dump_yaml({"rig": rig}, tmp_path / "model.yaml")
    force = 2.0 * A + 3.0 * (A + 9.81) + 3.0 * np.tanh(V / 0.01)
    columns = {"axis/q [m]": sign * Q, "axis/tau [N]": turned * force + zero}
    problem = rig_problem(
        [Trajectory(TIME, columns, RUN | {"kind": "drive"})], load_model(tmp_path / "model.yaml")
    )
    if not words:
        assert problem.validate() == []
    else:
        with pytest.raises(BadData, match=f"^log: {words}; the force answers"):
            problem.validate()


def test_a_pendulum_that_hardly_turns_tells_position_and_torque_together() -> None:
    """Degrees and pound-inches of a motion whose sine is straight: any two sizes in their ratio."""
    right = pendulum(0.1 * Q, 0.0 * Q)
    weight = (0.02 + 1.5 * 0.25**2) * 0.1 * A + 1.5 * 0.25 * 9.81 * np.sin(0.1 * Q)
    torque = weight + 0.04 * np.tanh(0.1 * V / 0.01) + 0.1 * right["axis/tau"]
    log = pendulum(np.degrees(right["axis/q"]), 8.85 * torque)
    said = r"run: axis/tau is about 0\.15 times what suits axis/q \(the unit of one of them, or of"
    with pytest.raises(BadData, match=said):
        rig_problem([log], load_model("pendulum_rig")).validate()


def test_a_cylinder() -> None:
    """The force alone tells its sign; where it does not hang on the position, the end is open."""
    pressure = 3e5 + 1e5 * np.sin(3.0 * TIME)
    force = (pressure - 101325.0) * np.pi / 4 * 0.025**2
    x = 0.02 + 0.01 * np.sin(1.3 * TIME)
    noise = np.random.default_rng(0).standard_normal((3, len(TIME)))
    columns = {"piston/x [m]": x + 1e-6 * noise[0], "chamber/extend/P [Pa]": pressure + noise[1]}
    model = load_model("cylinder_rig")
    for sign in (1, -1):
        columns["piston/F [N]"] = sign * (force + 0.05 * noise[2])
        problem = rig_problem([Trajectory(TIME, dict(columns), {"kind": "cylinder"})], model)
        if sign > 0:
            assert problem.validate() == []
        else:
            with pytest.raises(BadData, match=r"piston/F has the reversed sign .*; the force"):
                problem.validate()


SIDES = "chamber/extend/P [Pa]", "chamber/retract/P [Pa]"
RUN = {"kind": "cylinder", "name": "log"}


def rig_of(folder: Path) -> Model:
    rig = {"kind": "cylinder", "bore": "40 mm", "rod": "16 mm", "stroke": "120 mm"}
    dump_yaml({"rig": rig, "effects": []}, folder / "model.yaml")
    return load_model(folder / "model.yaml")


def cylinder(friction: float) -> dict[str, np.ndarray]:
    """A cylinder of 40 mm with a rod of 16 mm, both pressures measured."""
    extend, retract = (3e5 + 2e5 * np.sin(w * TIME) for w in (3.0, 2.2))
    x, area = 0.06 + 0.03 * np.sin(1.3 * TIME), np.pi / 4 * 0.04**2
    push = area * (extend - 101325.0) - area * (1.0 - 0.4**2) * (retract - 101325.0)
    force = push - friction * np.tanh(np.gradient(x, TIME) / 1e-3)
    noise = np.random.default_rng(0).standard_normal((4, len(TIME)))
    channels = {"piston/x [m]": (x, 1e-6), "piston/F [N]": (force, 0.2)}
    channels |= {side: (p, 100.0) for side, p in zip(SIDES, (extend, retract), strict=True)}
    pairs = zip(channels.items(), noise, strict=True)
    return {name: y + sigma * e for (name, (y, sigma)), e in pairs}


@pytest.mark.parametrize(
    ("gauge", "crossed", "sign", "words"),
    [
        (
            SIDES,
            False,
            1,
            r"log: chamber/extend/P and chamber/retract/P count .*offset: \+101325 Pa",
        ),
        (SIDES[:1], False, 1, r"log: chamber/extend/P counts from .*offset: \+101325 Pa"),
        ((), True, 1, "log: chamber/extend/P and chamber/retract/P are swapped; the force"),
        (SIDES, True, 1, "are swapped and chamber/extend/P and chamber/retract/P count from"),
        (SIDES[1:], False, -1, r"reversed sign \(.*\) and chamber/retract/P counts from another"),
    ],
)
def test_pressures_above_the_air_or_swapped_are_named_before_any_effect(
    gauge: tuple[str, ...], crossed: bool, sign: int, words: str, tmp_path: Path
) -> None:
    """What a seal's friction leaves of the force, too, is no friction of one direction."""
    right, model = cylinder(12.0), rig_of(tmp_path)
    read = {**right, "piston/F [N]": sign * right["piston/F [N]"]}
    read |= {name: right[name] - 101325.0 for name in gauge}
    if crossed:
        read |= {name: read[other] for name, other in zip(SIDES, SIDES[::-1], strict=True)}
    assert rig_problem([Trajectory(TIME, right, RUN)], model).validate() == []
    with pytest.raises(BadData) as raised:
        rig_problem([Trajectory(TIME, read, RUN)], model).validate()
    assert re.search(words, str(raised.value)) and "; or " not in str(raised.value)


def test_a_seal_rubs_against_the_motion_and_tells_the_end(tmp_path: Path) -> None:
    right, model = cylinder(12.0), rig_of(tmp_path)
    read = {**right, "piston/x [m]": 0.12 - right["piston/x [m]"]}
    with pytest.raises(BadData, match=r"log: piston/x counts from the extended end .*; the force"):
        rig_problem([Trajectory(TIME, read, RUN)], model).validate()


@pytest.mark.parametrize(
    ("column", "factor", "words"),
    [
        ("piston/x [m]", 10.0, r"moves by 599.9 mm; a stroke of 120 mm was expected; is its unit"),
        ("piston/x [m]", 39.37, "moves by .* is its unit wrong"),
        ("piston/F [N]", 1 / 4.448, r"piston/F is about 4.\d times too small .its unit is wrong"),
        ("chamber/retract/P [Pa]", 1.6, "gain of chamber/retract/P would be off"),
    ],
)
def test_another_unit_is_no_effect(column: str, factor: float, words: str, tmp_path: Path) -> None:
    """Decimetres and inches as metres, pounds as newtons, a bar that is none."""
    rig_of(tmp_path)
    log, read = tmp_path / "log.csv", cylinder(12.0)
    Trajectory(TIME, {**read, column: factor * read[column]}, {"kind": "cylinder"}).write(log)
    answer, _ = discover_logs([log], (), str(tmp_path / "model.yaml"))
    assert not answer.writes and re.search(words, answer.sentence), answer.sentence


@pytest.mark.parametrize("place", [0.06, 0.003])
def test_a_small_motion_near_the_end_is_read_and_said(place: float, tmp_path: Path) -> None:
    """A test of presliding looks like a test along the stroke in another unit."""
    rig_of(tmp_path)
    read, log = cylinder(12.0), tmp_path / "log.csv"
    read["piston/x [m]"] = place + (read["piston/x [m]"] - 0.06) / 30.0
    Trajectory(TIME, read, RUN).write(log)
    _, remarks = check_log(log, str(tmp_path / "model.yaml"))
    said = [line for line in remarks if "4 mm of the retracted end, of a stroke of 120 mm" in line]
    assert len(said) == (place < 0.01) and all("its unit is wrong" in line for line in said)


def test_what_hangs_on_a_position_in_doubt_is_not_written(tmp_path: Path) -> None:
    """Tenths of the position: the damping would be ten times and more that of the rig."""
    rig_of(tmp_path)
    read, log = cylinder(12.0), tmp_path / "log.csv"
    read["piston/F [N]"] -= 200.0 * 0.03 * 1.3 * np.cos(1.3 * TIME)
    for share in (1.0, 0.1):
        Trajectory(TIME, {**read, "piston/x [m]": share * read["piston/x [m]"]}, RUN).write(log)
        answer, _ = discover_logs([log], (), str(tmp_path / "model.yaml"))
        assert answer.writes == (share == 1.0)
        assert ("of the retracted end" in answer.sentence) == (share < 1.0)


@pytest.mark.parametrize(
    ("scale", "words"),
    [
        (1000.0, r"log: the time is about (1000|9\d0) times too large \(its unit is wrong\); "),
        (100.0, r"log: the time is about (100|99) times too large \(its unit is wrong\); "),
        (0.1, r"log: the time is about (10|9\.\d) times too small \(its unit is wrong\); the"),
    ],
)
def test_another_unit_of_the_time_is_named(scale: float, words: str) -> None:
    right = pendulum(Q, FORCE)
    log = Trajectory(scale * TIME, right.columns, right.meta | {"name": "log"})
    model = load_model("pendulum_rig")
    with pytest.raises(BadData) as raised:
        check_all([log], model)
        rig_problem([log], model).validate()
    assert re.search(words, str(raised.value)), str(raised.value)


def test_a_drive_whose_columns_are_swapped_or_whose_force_has_a_zero_beside_a_sign() -> None:
    model, right = load_model("pendulum_rig"), pendulum(Q, FORCE)
    q, tau = right["axis/q"], right["axis/tau"]
    assert rig_problem([pendulum(q, tau + 2.0)], model).validate() == []  # that is an effect
    for log, words in (
        (pendulum(tau, q), "run: axis/q and axis/tau are swapped; the"),
        (pendulum(q, 2.0 - tau), "run: axis/tau has the reversed sign; or axis/q has the reversed"),
    ):
        with pytest.raises(BadData, match=words):
            rig_problem([log], model).validate()


def test_a_motor_of_another_unit_beside_a_heavier_axis_is_no_effect(tmp_path: Path) -> None:
    log = pendulum(Q, 4.448 * (FORCE + 0.05 * A))
    log.write(tmp_path / "log.csv")
    answer, _ = discover_logs([tmp_path / "log.csv"], (), "pendulum_rig")
    assert not answer.writes and "off by more than any motor's is; its unit" in answer.sentence


@pytest.mark.parametrize("friction", [0.1, 0.0])
def test_less_friction_than_the_model_has_hides_no_mistake(friction: float) -> None:
    """What the model has too much of, no friction of any size puts right."""
    model, force = load_model("pendulum_rig"), FORCE + (friction - 0.4) * np.tanh(V / 0.01)
    right = pendulum(Q, force)
    assert rig_problem([right], model).validate() == []
    for log, words in (
        (pendulum(Q + 0.6, force), r"axis/q counts from another zero \(`offset: -34\.\d deg`\); "),
        (Trajectory(100.0 * TIME, right.columns, right.meta), r"the time is about (99|100) times"),
    ):
        with pytest.raises(BadData, match=words):
            rig_problem([log], model).validate()


def test_a_force_that_does_not_answer_the_motion_is_no_mistake_of_columns() -> None:
    """A hand moves the axis while the motor holds: a unit that hides the model suits any force."""
    log = pendulum(Q, np.full(len(TIME), 0.9))
    assert rig_problem([log], load_model("pendulum_rig")).validate() == []


def test_what_a_hand_moves_lacks_no_inertia(tmp_path: Path) -> None:
    """A motor that carries the weight and nothing else: the hand does what the inertia needs."""
    pendulum(Q, 1.5 * 0.25 * 9.81 * np.sin(Q)).write(tmp_path / "log.csv")
    answer, _ = discover_logs([tmp_path / "log.csv"], (), "pendulum_rig")
    assert answer.verdict == "unknown" and not answer.writes
    assert "the axis would have no inertia: something else moves it" in answer.sentence


def test_a_zero_that_is_off_by_a_few_degrees_is_named(tmp_path: Path) -> None:
    """However little the encoder errs otherwise: a constant torque would be another effect."""
    pendulum(Q + 0.1, FORCE).write(tmp_path / "log.csv")
    answer, _ = discover_logs([tmp_path / "log.csv"], (), "pendulum_rig")
    assert (answer.verdict, answer.added) == ("missing", ("sensor_bias:axis/q",)), answer.sentence
    assert answer.ranking[0].parameters["b"].value == pytest.approx(0.1, rel=0.05)


def test_friction_and_small_zeros_are_no_mistakes() -> None:
    """These are for `discover` to find."""
    log = pendulum(Q + 0.1, FORCE + 1.5 * np.tanh(V / 0.01))
    assert rig_problem([log], load_model("pendulum_rig")).validate() == []


@pytest.mark.parametrize(
    ("q", "tau", "time", "words"),
    [
        (
            1e3,
            1e3,
            1.0,
            r"axis/q is about 1000 times .* and axis/tau is about 1000 times too large",
        ),
        (
            57.3,
            8.85,
            1.0,
            r"axis/q is about 5[78] times .* and axis/tau is about 8.[789] times too",
        ),
        (
            57.3,
            1e3,
            100.0,
            r"about 57 times .* axis/tau is about (1000|9[89]0) .* the time is about (99|100) ",
        ),
    ],
)
def test_several_units_at_once_are_named(q: float, tau: float, time: float, words: str) -> None:
    right = pendulum(Q, FORCE)
    columns = {"axis/q [rad]": q * right["axis/q"], "axis/tau [N.m]": tau * right["axis/tau"]}
    log = Trajectory(time * TIME, columns, right.meta)
    with pytest.raises(BadData) as raised:
        rig_problem([log], load_model("pendulum_rig")).validate()
    assert re.search(words, str(raised.value)), str(raised.value)


@pytest.mark.parametrize("rotary", [False, True])
def test_a_motion_that_no_drive_has_strength_for_is_of_other_units(
    rotary: bool, tmp_path: Path
) -> None:
    """Thousandths of both: without a weight the force answers the motion as well as before."""
    q, tau, inertia = ("rad", "N.m", 0.02) if rotary else ("m", "N", 2.0)
    rig = {"kind": "drive", "motion": "rotary" if rotary else "linear"}
    dump_yaml({"rig": rig | {"inertia": f"{inertia} {'kg.m2' if rotary else 'kg'}"}},
              tmp_path / "model.yaml")  # fmt: skip
    model, force = load_model(tmp_path / "model.yaml"), inertia * (A + 1.5 * np.tanh(V / 0.01))
    for factor in (1.0, 1e3):
        columns = {f"axis/q [{q}]": factor * Q, f"axis/tau [{tau}]": factor * force}
        problem = rig_problem([Trajectory(TIME, columns, RUN | {"kind": "drive"})], model)
        if factor == 1.0:
            assert problem.validate() == []
        else:
            with pytest.raises(BadData, match=r"axis/tau does .* W for each kilogram that moves"):
                problem.validate()


def test_an_inertia_far_from_that_of_the_rig_is_not_written(tmp_path: Path) -> None:
    """Friction hides that motion and time are in other units: what is left is no inertia."""
    rig = {"kind": "drive", "inertia": "2 g"}
    dump_yaml({"rig": rig}, tmp_path / "model.yaml")
    force = 0.2 * A + 6.0 * np.tanh(V / 0.01)
    noise = 0.05 * np.random.default_rng(0).standard_normal(len(TIME))
    columns = {"axis/q [m]": Q, "axis/tau [N]": force + noise}
    Trajectory(TIME, columns, {"kind": "drive"}).write(tmp_path / "log.csv")
    answer, _ = discover_logs([tmp_path / "log.csv"], (), str(tmp_path / "model.yaml"))
    assert not answer.writes
    assert re.search("would be .* times what the rig is said to have|its unit", answer.sentence)


def test_a_rig_slower_than_two_rows_a_second_is_read_and_asked_about() -> None:
    """An axis that creeps, a row every two seconds; one that turns between two rows is too fast."""
    model, slow = load_model("drive_rig"), np.arange(0.0, 800.0, 2.0)
    force = 20.0 * np.tanh(np.cos(0.02 * slow) * 0.02 / 1e-3)
    for rate in (0.02, 2.0):
        columns = {"axis/q [m]": np.sin(rate * slow), "axis/tau [N]": force}
        log = Trajectory(slow, columns, RUN | {"kind": "drive"})
        if rate < 1.0:
            assert any(
                "if the time was in milliseconds" in said for said in check_all([log], model)
            )
        else:
            with pytest.raises(BadData, match="has a row every 2 s; at least 2 rows a second"):
                check_all([log], model)


def test_friction_of_an_axis_that_creeps_is_found(tmp_path: Path) -> None:
    """How smoothly it turns over behind a filter of many seconds is no other unit."""
    time, noise = np.arange(0.0, 800.0, 2.0), np.random.default_rng(0).standard_normal(400)
    force = 20.0 * np.tanh(np.cos(0.02 * time) * 0.02 / 1e-3) + 0.3 * noise
    columns = {"axis/q [m]": np.sin(0.02 * time), "axis/tau [N]": force}
    Trajectory(time, columns, {"kind": "drive"}).write(tmp_path / "log.csv")
    answer, _ = discover_logs([tmp_path / "log.csv"], (), "drive_rig")
    assert answer.sure == ("axis_friction",)
    assert answer.ranking[0].parameters["F_c"].value == pytest.approx(20.0, abs=1.0)
