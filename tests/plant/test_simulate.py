"""The simulator as a user calls it."""

import numpy as np
import pytest
from plant.scripts import jump, planning

from kemba.errors import KembaError
from kemba.model import load_model
from kemba.plant.commands import Commands, Profile
from kemba.plant.simulate import simulate


def test_the_same_again() -> None:
    first, again = (jump.__wrapped__(duration=0.1).trajectory for _ in range(2))
    assert first.headers == again.headers
    assert all(np.array_equal(first[name], again[name]) for name in first.names)


def test_everything_is_written_down() -> None:
    t = simulate(planning(), duration=0.01)
    for name in (
        *("body/z", "body/az", "front/foot/Fz", "front/foot/Fx", "rear/piston/F"),
        *("front/chamber/extend/F", "front/valve/extend", "rear/hip/tau", "rear/piston/stop_in"),
    ):
        assert name in t
    assert t.time == pytest.approx(np.arange(11) * 1e-3)


def test_samples_where_they_are_wanted() -> None:
    times = np.array([0.0, 0.00123, 0.0031])
    assert simulate(planning(), duration=0.01, sample=times).time == pytest.approx(times)


@pytest.mark.parametrize(("duration", "rows"), [(0.01, 11), (0.0104, 12), (0.0005, 2)])
def test_the_last_sample_is_the_end(duration: float, rows: int) -> None:
    t = simulate(planning(), duration=duration)
    assert (len(t), t.time[-1]) == (rows, duration)


def test_feet_that_start_in_the_ground_come_out_gently() -> None:
    low = planning().mechanism.standing["body/z"] - 2e-3
    t = simulate(planning(), {"body/z": low}, duration=0.06)
    assert t["body/vz"].max() <= 0.05 + 1e-6
    assert t["front/foot/z"][-1] == pytest.approx(0.0, abs=1e-4)


def test_valves_are_logged_as_sent() -> None:
    valve = {"front/valve/extend": Profile.pulses((0.0035, 0.008))}
    t = simulate(planning(), commands=Commands(valve), duration=0.02)
    assert np.array_equal(t["front/valve/extend"], (t.time > 0.0035) & (t.time < 0.008 - 1e-9))
    force = t["front/chamber/extend/F"]
    assert force[t.time < 0.0095].max() == 0.0
    assert force[t.time > 0.0099].min() > 0.0


def test_without_a_height_the_feet_stand_on_the_ground() -> None:
    t = simulate(planning(), {"front/piston/x": 0.05, "rear/piston/x": 0.04}, duration=1e-3)
    assert t["front/foot/z"][0] == pytest.approx(0.0, abs=1e-12)
    assert t["rear/foot/z"][0] > 0.01


def test_a_piston_may_stand_for_its_knee() -> None:
    t = simulate(planning(), {"front/piston/x": 0.042, "body/z": 1.0}, duration=1e-3)
    assert t["front/piston/x"][0] == pytest.approx(0.042, abs=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: simulate(planning(), {"body/zz": 1.0}), "did you mean 'body/z'"),
        (lambda: simulate(planning(), {"front/piston/x": 0.5}), "cannot be reached"),
        (lambda: simulate(planning(), step=1e-2), "out of range"),
        (
            lambda: simulate(planning(), commands=Commands({"x": Profile.constant(1)})),
            "no input 'x'",
        ),
        (lambda: simulate(load_model(rig=True)), "its motion is imposed"),
        (lambda: simulate(planning(), {"body/z": 0.1}), "contact:gap starts 66.3 mm too deep"),
    ],
)
def test_wrong_calls_say_what_is_wrong(call, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(KembaError, match=message):
        call()
