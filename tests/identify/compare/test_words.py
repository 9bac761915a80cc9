"""What `compare` says is said in words, not in column names."""

import pytest

from kemba.identify.compare import words
from kemba.identify.compare.bins import ConditionBin
from kemba.identify.compare.words import command, place_of, quantity


@pytest.mark.parametrize(
    ("channel", "words"),
    [
        ("body/z", "body height"),
        ("front/piston/x", "front piston"),
        ("piston/x", "piston"),
        ("left/hip/q", "left hip angle"),
        ("rear/stop", "rear end stop"),
        ("slider/q", "slider/q"),  # a rig of one's own
    ],
)
def test_channels_are_named(channel: str, words: str) -> None:
    assert quantity(channel) == words


@pytest.mark.parametrize(
    ("phase", "mode", "region", "words"),
    [
        ("stance2", "11", "", "body height while two feet stand and both valves are open"),
        ("flight", "10", "mid",
         "body height in flight while the extend valve is open, the piston in mid-stroke"),
        ("rest", "", "in", "body height at rest, the piston retracted"),
    ],
)  # fmt: skip
def test_conditions_are_sentences(phase: str, mode: str, region: str, words: str) -> None:
    at = ConditionBin("body/z", phase, mode, region, 3.0, 0.001)
    assert place_of(at) == words


def test_valves_are_named() -> None:
    assert command("front/valve/extend") == "the front extend valve"
    assert command("valve/retract") == "the retract valve"
    assert command("front/hip/tau") == "the front hip torque"
    assert command("slider/F") == "slider/F"


def test_sizes_have_usual_units_and_efforts_a_place() -> None:
    assert words.off_by("body/z [m]", 0.0191) == "body height 19 mm"
    assert words.off_by("rear/hip/q [rad]", 0.0437) == "rear hip angle 2.5 deg"
    assert words.effort("front/piston/x", "N") == "force on the front rod"
    assert words.effort("rear/hip/q", "N.m") == "torque on the rear hip"
    assert words.effort("body/z", "N") == "force on the body, z"
    assert words.effort("piston/F", "N") == "force at piston/F"
