"""Columns of robot logs with a wrong sign or zero are named, whatever the motion."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from robot_logs import hops

from kemba.errors import KembaError
from kemba.identify.problem.problem import Array
from kemba.identify.robot.batch import ResampledLog
from kemba.identify.robot.mix_ups import mix_ups, mixed_up
from kemba.identify.robot.physics import Physics
from kemba.identify.robot.problem import RobotProblem
from kemba.identify.robot.validate import slightly_mixed_up
from kemba.model.spec import load_model

Change = Callable[[Array], Array]
PITCH, QUARTER = 0.15, np.pi / 2


@pytest.fixture(scope="module")
def physics() -> Physics:
    return Physics(load_model("planning"), ())


@pytest.fixture(scope="module")
def standing(physics: Physics) -> ResampledLog:
    """The body leans, rises and moves ahead over feet that stand still."""
    time = np.arange(0.0, 0.8, 1e-3)
    wave = np.sin(2 * np.pi * time[::20] / 0.8)
    start = [0.0, 0.0, 0.0, 0.5, -0.5, *physics.knees(np.full((1, 2), 0.035), physics.nominal)[0]]
    q = np.tile(start, (len(wave), 1))
    goal = physics.call("feet", q[:1], 0 * q[:1], p=physics.nominal)[0]
    height = -goal[0, 1]
    goal[0, 1::2] = 0.0
    q[:, :3] = np.stack([0.03 * wave, height + 0.01 * wave, PITCH * wave], axis=1)
    for _ in range(40):  # Newton's method on the places of the feet
        feet, _, slope = physics.call("feet", q, 0 * q, p=physics.nominal)
        step = np.linalg.solve(slope[:, :, 3:], (feet - goal)[:, :, None])[:, :, 0]
        q[:, 3:] -= np.clip(step, -0.1, 0.1)
    feet = physics.call("feet", q, 0 * q, p=physics.nominal)[0]
    assert np.abs(feet - goal).max() < 1e-6
    y = physics.call("measured", q, 0 * q, p=physics.nominal)[0]
    fine = np.stack([np.interp(time, time[::20], column) for column in y.T], axis=1)
    unknown = np.full(7, 2e-4), np.full(7, np.nan), np.zeros(7, bool)
    noise = 2e-4 * np.random.default_rng(0).standard_normal(fine.shape)
    return ResampledLog("leans", time, fine + noise, np.zeros((800, 2)), ([],) * 4, *unknown)


def changed(
    log: ResampledLog, physics: Physics, **changes: Callable[[Array], Array]
) -> ResampledLog:
    y = log.y.copy()
    for i, name in enumerate(physics.channels):
        for end, change in changes.items():
            if name.endswith(end.replace("__", "/")):
                y[:, i] = change(y[:, i])
    return replace(log, y=y)


def found(physics: Physics, log: ResampledLog) -> list[KembaError]:
    """The mistakes in a log of a robot with the nominal lengths."""
    return list(mixed_up(physics, log))


MISTAKES: dict[str, tuple[dict[str, Change], str]] = {
    "pitch": ({"pitch": np.negative}, "body/pitch has the reversed sign"),
    "degrees": ({"pitch": np.degrees}, "body/pitch is in degrees"),
    "a unit of the pitch": ({"pitch": np.radians}, "stand: body/pitch is 57 times too small"),
    "a unit of the height": ({"body__z": lambda z: z / 10}, r"stand: body/z is 10 times too small"),
    "a unit of the pistons": (
        {"piston__x": lambda x: x / 10},
        r"stand: piston/x of every leg is 10 times too small \(its unit is wrong\); corrected",
    ),
    "backwards": ({"body__x": np.negative}, "body/x has the reversed sign"),
    "zero": (
        {"hip__q": lambda q: q + QUARTER},
        r"hip/q of every leg counts from another zero \(\+90 degrees",
    ),
    "one zero": (
        {"rear__hip__q": lambda q: q - QUARTER},
        r"hip/q of the rear leg counts from another zero \(-90 degrees",
    ),
    "hips": ({"hip__q": np.negative}, "hip/q of every leg has the reversed sign"),
    "start": (
        {"body__z": lambda z: z - z[0]},
        r"body/z counts from another zero \(-\d+ mm too much\)",
    ),
    "zero of the height": (
        {"body__z": lambda z: z - 0.02},
        r"stand: body/z counts from another zero \(-2\d mm too much\); corrected, it is [0-4] mm",
    ),
    "down": ({"body__z": np.negative}, "body/z counts downwards"),
    "a hip": (
        {"rear__hip__q": lambda q: q - 0.15},
        r"mm from .* stand: hip/q of the rear leg counts from another zero \(-8.\d degrees too",
    ),
    "pitch's zero": (
        {"pitch": lambda p: p + 0.1},
        r"stand: body/pitch counts from another zero \(\+5.\d degrees too much\); corrected",
    ),
    "pistons": (
        {"piston__x": lambda x: x + 5e-3},
        r"stand: piston/x of every leg counts from another zero \(\+[45].\d mm too much\); corr",
    ),
    "two": (
        {"rear__hip__q": np.negative, "front__piston__x": lambda x: 0.07 - x},
        "front leg counts from the extended end and hip/q of the rear leg has the reversed",
    ),
    "end": (
        {"front__piston__x": lambda x: 0.07 - x},
        "piston/x of the front leg counts from the extended end",
    ),
}


# a sign and a zero: their own columns, and words of the advice about each
MOVED: dict[str, tuple[dict[str, Change], str]] = {
    "a hip": ({"rear__hip__q": lambda q: 0.3 - q}, "hip/q of the rear leg has the reversed sign"),
    "both hips": ({"hip__q": lambda q: 0.3 - q}, "hip/q of every leg has the reversed sign"),
    "each hip": (
        {"rear__hip__q": lambda q: 0.3 - q, "front__hip__q": lambda q: -0.25 - q},
        "hip/q of the front leg has .* and hip/q of the rear leg has the reversed sign",
    ),
    "both zeros": (
        {"rear__hip__q": lambda q: 0.3 + q, "front__hip__q": lambda q: -0.25 + q},
        "hip/q of the front leg counts .* and hip/q of the rear leg counts from another zero",
    ),
    "the pitch": ({"pitch": lambda p: 0.1 - p}, "body/pitch has the reversed sign"),
    "a piston": ({"front__piston__x": lambda x: 0.076 - x}, "piston/x of the front leg counts"),
    "pistons": ({"piston__x": lambda x: 0.076 - x}, "piston/x of every leg counts"),
    "a hip, a piston": (
        {"rear__hip__q": lambda q: 0.3 - q, "front__piston__x": lambda x: 0.076 - x},
        "piston/x of the front leg counts .* and hip/q of the rear leg has the reversed sign",
    ),
}


def put_right(log: ResampledLog, physics: Physics, said: str) -> ResampledLog:
    """A log as the first advice says that it is to be read."""
    changes: dict[str, Change] = {}
    advice = (
        r"(\S+?/\S+)(?: of (?:the )?(\w+) leg)? [^`()]*\((?:`sign: (-1), offset: )?(\S+) (mm|deg)"
    )
    for name, leg, turned, number, unit in re.findall(advice, said.split("; or ")[0]):
        zero = float(number) * (1e-3 if unit == "mm" else np.pi / 180)
        sign, offset = (-1, zero) if turned else (1, -zero)  # `too much` is taken away
        key = f"{leg}/{name}" if leg not in ("", "every") else name
        changes[key] = lambda x, sign=sign, offset=offset: sign * x + offset
    assert changes, said
    return changed(log, physics, **changes)


@pytest.mark.parametrize("mistake", MOVED)
def test_a_sign_and_a_zero_are_named_and_the_advice_once_followed_leaves_millimetres(
    mistake: str, physics: Physics, standing: ResampledLog
) -> None:
    changes, words = MOVED[mistake]
    (fault,) = found(physics, changed(standing, physics, **changes))
    assert re.search(rf"stand: (.* and )?{words}", str(fault)), str(fault)
    right = put_right(changed(standing, physics, **changes), physics, str(fault))
    assert not found(physics, right)
    assert np.abs(right.y[:, 2:5] - standing.y[:, 2:5]).max() < 0.02  # rad
    assert np.abs(right.y[:, 5:] - standing.y[:, 5:]).max() < 1.5e-3  # m


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named(mistake: str, physics: Physics, standing: ResampledLog) -> None:
    changes, words = MISTAKES[mistake]
    (fault,) = found(physics, changed(standing, physics, **changes))
    assert re.search(words, str(fault)), str(fault)


def test_what_feet_cannot_tell_apart_is_all_named(physics: Physics, standing: ResampledLog) -> None:
    """A robot that is its own mirror image stands as well seen from its other side."""
    (fault,) = found(physics, changed(standing, physics, hip__q=np.negative))
    for words in ("of every leg has the reversed sign", "seen from its other side", "cannot tell"):
        assert words in str(fault)


def test_pistons_of_the_legs_are_told_from_the_pitch(
    physics: Physics, standing: ResampledLog
) -> None:
    y = standing.y.copy()
    y[:, [5, 6]] = y[:, [6, 5]]
    (fault,) = found(physics, replace(standing, y=y))
    assert "stand: piston/x of the legs is swapped; corrected" in str(fault)


@pytest.mark.parametrize(("truth", "told"), [(-1, 1), (1, 0)])
def test_whether_the_pitch_is_turned_is_told_by_the_motion(
    truth: int, told: int, physics: Physics, standing: ResampledLog
) -> None:
    """Of a late sensor, feet may stand better with the pitch turned: then the model leaves more. It
    is told of each log, and not where much is left even then."""
    log = changed(standing, physics, pitch=lambda p: truth * p)
    left = lambda *logs: np.array([1.0 + np.ptp(x.y - standing.y) for x in logs])  # noqa: E731
    said = [str(fault) for fault in slightly_mixed_up(physics, (standing, log), left)]
    assert len(said) == told
    assert all("body/pitch has the reversed sign (nose up is positive); the" in t for t in said)
    most = lambda *logs: 2.0 + left(*logs)  # noqa: E731
    assert not list(slightly_mixed_up(physics, (standing, log), most))


@pytest.mark.parametrize("late", [False, True])
def test_a_turned_pitch_is_neither_swapped_pistons_nor_a_late_sensor(late: bool) -> None:
    """An even hop, of which feet alone take the one for the other; and one in which the robot tips
    over, its body read 4 ms late."""
    (hop, *_), _ = hops(runs=1, seed=4 if late else 0)
    body = ("body/x [m]", "body/z [m]", "body/pitch [rad]")
    lag = {h: np.interp(hop.time - 4e-3, hop.time, hop.columns[h]) for h in body}
    turned = {body[2]: -hop.columns[body[2]]}
    mixed = RobotProblem([hop.with_columns(lag if late else turned)], load_model("planning")).mixed
    said = "; ".join(map(str, mixed))
    assert not said if late else "body/pitch has the reversed sign" in said
    assert "swapped" not in said


def test_what_feet_cannot_tell_the_model_tells(physics: Physics, standing: ResampledLog) -> None:
    """Torques have their own sign: the model tells hips from the robot seen from behind."""
    torque = np.tile([1.0, -2.0], (len(standing.time), 1))
    turned = replace(changed(standing, physics, hip__q=np.negative), torque=torque)
    for truth, words in (
        (torque, "stand: hip/q of every leg has the reversed sign; corrected"),
        (-torque, "stand: hip/q and hip/tau of every leg have the reversed sign; corrected"),
    ):
        off = lambda log, truth=truth: [1.0 + np.abs(log.torque - truth).max()]  # noqa: E731
        (fault,) = mixed_up(physics, turned, None, off)
        assert words in str(fault)


def test_columns_of_x_and_z_are_told_apart(physics: Physics, standing: ResampledLog) -> None:
    y = standing.y.copy()
    y[:, [0, 1]] = y[:, [1, 0]]
    (fault,) = found(physics, replace(standing, y=y))
    assert "body/x and body/z are swapped" in str(fault)


def test_slow_channels_are_judged_as_well(physics: Physics, standing: ResampledLog) -> None:
    """A body that is read at 100 Hz beside legs at 1 kHz."""
    turned = changed(standing, physics, hip__q=np.negative)
    turned.y[np.arange(len(turned.y)) % 10 != 0, :3] = np.nan
    (fault,) = found(physics, turned)
    assert "hip/q of every leg has the reversed sign" in str(fault)


def test_what_is_right_is_left_alone(physics: Physics, standing: ResampledLog) -> None:
    assert not found(physics, standing)


def test_faults_of_sensors_are_not_taken_for_mistakes(
    physics: Physics, standing: ResampledLog
) -> None:
    """These are for `discover` to find."""
    for changes in (
        {"body__z": lambda z: z - 0.01},
        {"hip__q": lambda q: 1.05 * q},
        {"pitch": lambda p: p + 0.03},
        {"piston__x": lambda x: np.roll(x, 5)},
        {"front__piston__x": lambda x: x + 3e-3},
        {"front__piston__x": lambda x: 1.04 * x},
        {"hip__q": lambda q: q + 5e-3},
    ):
        assert not found(physics, changed(standing, physics, **changes))


def test_lengths_are_no_zero_of_the_height(physics: Physics, standing: ResampledLog) -> None:
    """Where other lengths make the feet stand as well, 20 mm are no zero, 80 mm are one."""
    for off, named in ((0.02, False), (0.08, True)):
        low = changed(standing, physics, body__z=lambda z, off=off: z - off)
        lengths = {"geometry:tibia/length.d": off}
        assert any("another zero" in str(f) for f in mixed_up(physics, low, lengths)) is named


def test_a_flight_tells_nothing(physics: Physics, standing: ResampledLog) -> None:
    turned = changed(standing, physics, pitch=np.negative)
    assert found(physics, turned)
    falling = turned.y.copy()
    falling[:, 1] += -4.905 * (standing.time - 0.4) ** 2
    assert not found(physics, replace(turned, y=falling))


def test_one_leg_is_not_told_twice() -> None:
    texts = [m.text for m in mix_ups(("leg",), 0.07)]
    assert len(texts) == len(set(texts)) and not any("every leg" in text for text in texts)
