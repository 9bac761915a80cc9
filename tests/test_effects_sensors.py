"""Sensor effects: in what is measured, never in the motion."""

from __future__ import annotations

import numpy as np
import pytest

from kemba.config import parse
from kemba.effects.sensors import SensorBias, SensorDelay, SensorScale, as_measured
from kemba.errors import KembaError
from kemba.model import load_model
from kemba.model.spec import ModelSpec

TIME = np.linspace(0.0, 1.0, 1001)
TRUE = 0.3 + 0.1 * np.sin(8 * TIME)
RATE = 0.8 * np.cos(8 * TIME)


def test_names_carry_the_channel() -> None:
    assert SensorBias(channel="body/pitch", b=0.01).name == "sensor_bias:body/pitch"
    assert SensorBias(channel="body/z [m]").channel == "body/z"


def test_bias_takes_the_unit_of_its_channel() -> None:
    bias = parse(
        {"effects": [{"kind": "sensor_bias", "channel": "body/z", "b": "3 mm"}]}, ModelSpec
    ).effects[0]
    assert bias.value("b") == pytest.approx(0.003)
    assert bias.parameters()["b"].unit == "m"
    with pytest.raises(KembaError, match="a length such as"):
        parse({"effects": [{"kind": "sensor_bias", "channel": "body/z", "b": "3 kg"}]}, ModelSpec)


def test_unknown_channels_are_named() -> None:
    with pytest.raises(KembaError, match="'body/colour' is not a measured channel"):
        parse({"effects": [{"kind": "sensor_bias", "channel": "body/colour"}]}, ModelSpec)


def test_measured_is_its_equation() -> None:
    assert SensorBias(channel="body/z", b=0.01).measured(TIME, TRUE) == pytest.approx(TRUE + 0.01)
    assert SensorScale(channel="body/z", k=0.02).measured(TIME, TRUE) == pytest.approx(1.02 * TRUE)
    late = SensorDelay(channel="body/z", dt=0.003).measured(TIME, TRUE)
    np.testing.assert_allclose(late[10:], 0.3 + 0.1 * np.sin(8 * (TIME[10:] - 0.003)), atol=1e-5)


@pytest.mark.parametrize(
    "fault",
    [
        SensorBias(channel="body/z", b=1e-3),
        SensorScale(channel="body/z", k=1e-3),
        SensorDelay(channel="body/z", dt=1e-3),
    ],
    ids=lambda fault: str(fault.kind),
)
def test_expansion_agrees_to_first_order(fault: SensorBias) -> None:
    exact, linear = fault.measured(TIME, TRUE), fault.expanded(TRUE, RATE)
    np.testing.assert_allclose(linear[10:], exact[10:], atol=1e-5)


def test_faults_of_a_channel_combine() -> None:
    faults = [
        SensorBias(channel="body/z", b=0.01),
        SensorScale(channel="body/z", k=0.1),
        SensorBias(channel="body/x", b=9.0),
    ]
    np.testing.assert_allclose(as_measured(faults, "body/z", TIME, TRUE), 1.1 * TRUE + 0.01)


def test_the_motion_ignores_them_and_says_so() -> None:
    model = load_model(extra=[SensorBias(channel="body/z", b=0.01)])
    assert model.ignored == ["sensor_bias:body/z"]
    assert load_model().ignored == []
    assert model.node.dynamics.numel() == load_model().node.dynamics.numel()


def test_a_sensor_stands_on_a_channel_not_on_a_leg() -> None:
    with pytest.raises(ValueError, match="chosen by `channel`"):
        SensorBias(channel="front/hip/q", on="front")
