"""Sensor effects: in what is measured, never in the motion."""

import itertools

import numpy as np
import pytest

from kemba.config import parse
from kemba.effects.sensors import (
    SensorBias,
    SensorDelay,
    SensorEffect,
    SensorScale,
    as_measured,
    as_true,
)
from kemba.effects.series import Series
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


def shown(*faults: SensorEffect) -> np.ndarray:
    return as_measured(faults, "body/z", Series(TIME, TRUE)).value


def test_measured_is_its_equation() -> None:
    assert shown(SensorBias(channel="body/z", b=0.01)) == pytest.approx(TRUE + 0.01)
    assert shown(SensorScale(channel="body/z", k=0.02)) == pytest.approx(1.02 * TRUE)
    late = shown(SensorDelay(channel="body/z", dt=0.003))
    np.testing.assert_allclose(late[10:], 0.3 + 0.1 * np.sin(8 * (TIME[10:] - 0.003)), atol=1e-5)


def test_faults_act_late_then_scaled_then_offset_in_any_order_of_the_list() -> None:
    late = SensorDelay(channel="body/z", dt=0.1)
    scale, bias = SensorScale(channel="body/z", k=0.1), SensorBias(channel="body/z", b=0.5)
    expected = 1.1 * (0.3 + 0.1 * np.sin(8 * (TIME - 0.1))) + 0.5
    for order in itertools.permutations([late, scale, bias]):
        np.testing.assert_allclose(shown(*order)[110:], expected[110:], atol=1e-5)


def test_faults_of_other_channels_do_not_matter() -> None:
    assert shown(SensorBias(channel="body/x", b=9.0)) == pytest.approx(TRUE)


def test_what_sensors_did_can_be_undone_with_its_rates() -> None:
    faults = [
        SensorBias(channel="body/z", b=0.01),
        SensorDelay(channel="body/z", dt=0.004),
        SensorScale(channel="body/z", k=0.1),
    ]
    seen = as_measured(faults, "body/z", Series(TIME, TRUE, (RATE,)))
    true = as_true(faults, "body/z", seen)
    np.testing.assert_allclose(true.value[5:-5], TRUE[5:-5], atol=2e-5)
    np.testing.assert_allclose(true.rates[0][5:-5], RATE[5:-5], atol=2e-4)


@pytest.mark.parametrize("dt", [0.003, -0.003])
def test_beyond_its_ends_a_series_goes_on_at_its_rate(dt: float) -> None:
    moved = Series(TIME, TRUE, (RATE,)).late(dt).value
    np.testing.assert_allclose(moved, 0.3 + 0.1 * np.sin(8 * (TIME - dt)), atol=5e-5)


def test_the_motion_ignores_them_and_says_so() -> None:
    model = load_model(extra=[SensorBias(channel="body/z", b=0.01)])
    assert model.ignored == ["sensor_bias:body/z"]
    assert load_model().ignored == []
    assert model.node.dynamics.numel() == load_model().node.dynamics.numel()


def test_a_sensor_stands_on_a_channel_not_on_a_leg() -> None:
    with pytest.raises(ValueError, match="chosen by `channel`"):
        SensorBias(channel="front/hip/q", on="front")
