"""Executing a plan under conditions that differ."""

import numpy as np
import pytest

from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.scenarios.draw import Conditions, changed_effects, standing, start_offsets
from kemba.trajectory import Trajectory


@pytest.fixture(scope="module")
def plant() -> Model:
    return load_model("plant")


def test_an_effect_keeps_what_is_not_changed(plant: Model) -> None:
    asked = {"seal_friction": {"F_c": "12 N"}, "hip_friction": {"T_c": 0.1}}
    conditions = Conditions.model_validate({"effects": asked, "payload": "300 g"})
    payload, seal, hip = changed_effects(plant, conditions)
    assert (payload.value("m"), seal.value("F_c"), hip.kind) == (0.3, 12.0, "hip_friction")
    (chamber,) = changed_effects(plant, Conditions(effects={"orifice_chamber": {"n": 1.3}}))
    assert chamber.value("V_e") == plant.effect("orifice_chamber").value("V_e")


def test_wrong_names_are_told(plant: Model) -> None:
    with pytest.raises(KembaError, match=r"effects.seal_friction: F_d: unknown key"):
        changed_effects(plant, Conditions(effects={"seal_friction": {"F_d": 1.0}}))
    with pytest.raises(KembaError, match="is a mass"):
        start_offsets(plant, Conditions(start={"body/x": "3 kg"}))


def test_the_lower_foot_stands_on_the_ground(plant: Model) -> None:
    first = plant.mechanism.standing
    columns = {f"{name} [1]": np.zeros(2) + first[name] for name in first if "knee" not in name}
    columns |= {f"{leg}/piston/x [m]": np.zeros(2) for leg in plant.mechanism.legs}
    table = Trajectory(np.array([0.0, 1e-3]), columns)
    assert standing(plant, table, {}) == {}
    longer = standing(plant, table, {"front/piston/x": 0.02})
    assert longer["front/piston/x"] == 0.02 and longer["body/z"] > first["body/z"] + 0.01
    tilted = standing(plant, table, {"body/pitch": 0.05})
    assert tilted["body/z"] > first["body/z"]
