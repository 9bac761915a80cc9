"""What is known of a robot reaches everyone who needs it, whatever its name."""

from pathlib import Path

import numpy as np
import pytest

from kemba.config import shipped_configs
from kemba.effects.pneumatics.chamber import Chamber
from kemba.effects.pneumatics.valve import ValveDelay
from kemba.errors import KembaError
from kemba.mechanism.robot import link_regressors
from kemba.model import Model, load_model
from kemba.model.spec import load_spec
from kemba.ocp.infeasibility.checks import inertia_and_weight, leg_swing
from kemba.plant.repeat import another_robot, counterpart
from kemba.sweep.cases import model_hash

FEMUR = "mass: 0.335 kg"


@pytest.fixture
def heavy(tmp_path: Path) -> Path:
    """A model whose robot keeps the name kemba, with femurs five times as heavy."""
    text = shipped_configs("robots")["kemba.yaml"].read_text(encoding="utf-8")
    (tmp_path / "kemba.yaml").write_text(text.replace(FEMUR, "mass: 1.675 kg"), encoding="utf-8")
    path = tmp_path / "model.yaml"
    path.write_text("name: heavy\nbase: planning\nrobot: kemba\n", encoding="utf-8")
    return path


def regressors(model: Model) -> dict[str, np.ndarray]:
    """Generalised force by share of a figure, standing, all accelerations 1."""
    names, function = model.mechanism.tolerances, link_regressors(model.mechanism)
    q = [model.mechanism.standing[c.name] for c in model.mechanism.coordinates]
    columns = np.array(function(q, np.zeros(len(q)), np.ones(len(q))))
    return dict(zip(names, columns.T, strict=True))


def test_a_heavier_femur_is_seen_by_everyone(heavy: Path) -> None:
    own, shipped = load_model(heavy), load_model("planning")
    assert own.mechanism.name == shipped.mechanism.name == "kemba"
    more = 2 * 4 * 0.335
    assert own.mechanism.mass - shipped.mechanism.mass == pytest.approx(more)
    assert inertia_and_weight(own)[0] - inertia_and_weight(shipped)[0] == pytest.approx(more)
    assert leg_swing(own) - leg_swing(shipped) == pytest.approx(2 * 2 * 4 * 0.335 * 0.095)
    name = "front/hip.mass"  # the femur turns with the hip
    ratio = regressors(own)[name] / np.where(
        regressors(shipped)[name], regressors(shipped)[name], 1
    )
    assert set(np.round(ratio, 9)) <= {0.0, 5.0} and 5.0 in np.round(ratio, 9)
    assert counterpart(str(heavy)).mechanism.mass == pytest.approx(own.mechanism.mass)
    assert model_hash(str(heavy)) != model_hash("planning")


def test_the_plant_of_a_robot_is_on_that_robot(heavy: Path, tmp_path: Path) -> None:
    air = tmp_path / "air.yaml"
    air.write_text("name: air\nbase: plant\neffects: [{kind: cross_leak, k: 2 s-1}]\n")
    assert counterpart(str(heavy), plant=str(air)).mechanism.mass > 6.0
    assert another_robot(str(heavy), str(air)) is None
    other = tmp_path / "other.yaml"
    other.write_text("name: other\nbase: plant\nrobot: hound\n")
    assert counterpart(str(heavy), plant=str(other)).mechanism.name == "hound"
    assert another_robot(str(heavy), str(other)) == "hound"


def test_a_legs_name_is_checked_where_an_effect_is_placed() -> None:
    spec = load_spec("hound")
    assert spec.robot is not None and spec.robot.endswith("hound.yaml")
    model = load_model("hound", [ValveDelay(on="fore", dt=0.001)])
    assert [i.leg for i in model.instances if i.effect.kind == "valve_delay"] == ["fore"]
    with pytest.raises(KembaError) as caught:
        load_model("hound", [ValveDelay(on="for", dt=0.001)])
    assert str(caught.value) == (
        "effects.valve_delay:for: hound has no leg 'for'; did you mean 'fore'?"
    )


def test_chambers_take_their_figures_from_the_robots_cylinder() -> None:
    model = load_model("hound")
    cylinder = model.mechanism.need_cylinder()
    chamber = model.effect("chamber")
    assert chamber.value("F_extend") == cylinder.F_extend
    assert chamber.value("fill") == cylinder.fill
    own = load_model("hound", [Chamber(fill=(0.01, 0.02))]).effect("chamber")
    assert (own.value("fill"), own.value("F_extend")) == ((0.01, 0.02), cylinder.F_extend)
    plant = counterpart("hound")
    assert plant.effect("orifice_chamber").value("V_e") == cylinder.tube


@pytest.mark.parametrize(("supply", "force"), [(0.5e6, 250.0), (1.0e6, 399.0), (0.7e6, 324.0)])
def test_supply_beyond_the_tables_goes_on_linearly(supply: float, force: float) -> None:
    """Table II: 287, 324, 349 N at 0.6, 0.7, 0.8 MPa."""
    model = load_model("planning", supply=supply)
    said = " ".join(model.remarks)
    assert ("outside the measured range (0.6 to 0.8 MPa)" in said) is (supply != 0.7e6)
    node = model.node
    s = [force if symbol == "F_e" else 0.0 for _, symbol in model.states]
    u = [float(symbol == "u_e") for _, symbol in model.inputs]
    q = [model.mechanism.standing[c.name] for c in model.mechanism.coordinates]
    still = [0.0] * len(q)
    rest = [0.0] * node.lam.numel()
    rate = np.array(node.residual(q, still, still, s, [0] * len(s), rest, u, [])[1]).ravel()
    names = [symbol for _, symbol in model.states]
    assert rate[names.index("F_e")] == pytest.approx(0.0, abs=1e-9)


def test_a_supply_that_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(KembaError, match=r"would make F_extend -.*, which cannot be"):
        steep = Chamber(pressures=(0.6e6, 0.7e6), F_extend=(50.0, 300.0), F_retract=(50.0, 60.0))
        load_model("planning", [steep], supply=0.3e6)
    (tmp_path / "m.yaml").write_text("base: planning\nsupply: 0.8 bar\n")
    with pytest.raises(KembaError, match=r"supply: '0.8 bar' is out of range; at least 101325 Pa"):
        load_spec(tmp_path / "m.yaml")
