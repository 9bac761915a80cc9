"""First-order chambers in the place of physical ones push as hard, and lead to their plans."""

import numpy as np
import pytest

from kemba.effects.pneumatics.gas import GasTemperature, WallHeat
from kemba.model import Model, load_model
from kemba.model.lags import with_lags
from kemba.model.rest import at_rest, told_by
from kemba.ocp.continuation.origin import completed
from kemba.trajectory import Trajectory


def lagged(name: str, *extra: object) -> Model:
    found = with_lags(load_model(name, extra))  # type: ignore[arg-type]
    assert found is not None
    return found


def test_a_model_without_physical_chambers_has_no_such_model() -> None:
    assert with_lags(load_model("planning")) is None
    assert with_lags(load_model("hound")) is None


def test_what_hangs_on_physical_chambers_goes_with_them() -> None:
    kinds = {e.kind for e in lagged("plant", GasTemperature(), WallHeat(h=5.0)).effects}
    assert {"chamber", "mode_damping", "seal_friction", "hose_lag"} <= kinds
    assert not kinds & {"orifice_chamber", "supply_line", "gas_temperature", "wall_heat"}


@pytest.mark.parametrize("supply", [0.6e6, 0.73e6])
def test_at_rest_the_air_pushes_as_hard(supply: float) -> None:
    """To what a leak and a hose take."""
    physical = load_model("plant", supply=supply)
    lags = with_lags(physical)
    assert lags is not None
    there, here = forces(physical), forces(lags)
    assert here[0] == pytest.approx(there[0], rel=0.02)
    assert here[1] == pytest.approx(there[1], abs=3.0)


def forces(model: Model) -> list[float]:
    """Of both chambers of the front leg [N], at rest with extension valves open."""
    node, q = model.node, np.array(model.mechanism.origin)
    u = [float(key[1] == "u_e") for key in model.inputs]
    s = at_rest(model, q, u)
    zero = [np.zeros(x.numel()) for x in (node.v, node.a, node.sd, node.lam, node.p)]
    v, a, sd, lam, p = zero
    outputs = np.array(node.measure(q, v, a, s, sd, lam, u, p)).ravel()
    known = dict(zip(node.outputs, outputs, strict=True))
    known |= dict(zip((state.name for state in model.states.values()), s, strict=True))
    return [float(known[f"front/chamber/{side}/F"]) for side in ("extend", "retract")]


def test_pressures_follow_from_the_forces_of_a_plan() -> None:
    physical = load_model("plant")
    force = np.array([0.0, 150.0, 310.0])
    zeros = {f"{q.name} [{q.unit}]": np.zeros(3) for q in physical.mechanism.coordinates}
    plan = Trajectory(np.arange(3.0), {**zeros, "front/chamber/extend/F [N]": force})
    area = physical.mechanism.need_cylinder().area_extend
    whole = completed(plan, physical)
    assert whole["front/chamber/extend/P"] == pytest.approx(101325.0 + force / area, rel=1e-6)
    assert whole["rear/chamber/extend/P"] == pytest.approx(101325.0, rel=1e-6)
    assert whole["supply/line/s"] == pytest.approx(1.0)
    s = np.array([q.value for q in physical.states.values()])
    assert len(told_by(physical, s, whole)) == 0  # it has these states itself
