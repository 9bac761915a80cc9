"""Physical chambers: what eq. 1 to 3 conserve, and the paper's tables through the rig."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kemba.effects.pneumatics.flow import (
    ATMOSPHERE,
    CHOKED,
    GAS,
    KAPPA,
    SUBSONIC,
    TEMPERATURE,
    mass_flow,
    phi,
    psi,
)
from kemba.effects.pneumatics.hose import CrossLeak
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.effects.pneumatics.supply import SupplyLine
from kemba.effects.pneumatics.valve import Valve
from kemba.mechanism import load_cylinder, rig_mechanism
from kemba.model import Model, load_spec
from kemba.model.spec import build_model

CYLINDER = load_cylinder("dsnu-25-70")
AREA_E, AREA_R = CYLINDER.area_extend, CYLINDER.area_retract


def rig(*extra: object, **values: object) -> Model:
    chamber = OrificeChamber().bind(values)
    return Model(rig_mechanism(CYLINDER), [Valve(), chamber, *extra])  # type: ignore[list-item]


def rate(model: Model) -> ca.Function:
    """(x, v, s, u) -> rates of the effect states."""
    node = model.node
    zero = node.residual(
        q=node.q, v=node.v, a=0, s=node.s, sd=ca.SX.zeros(node.s.numel()), lam=[], u=node.u, p=[]
    )
    return ca.Function("rate", [node.q, node.v, node.s, node.u], [-zero["rate"]])


def test_branches_meet_where_the_flow_chokes() -> None:
    """Eq. 3: the choked branch continues the subsonic one, in value and in slope."""
    assert pytest.approx(1.893, abs=1e-3) == 1 / CHOKED
    below, above = (float(psi(CHOKED + d)) for d in (-1e-6, 1e-6))
    assert below == pytest.approx(above, rel=1e-6)
    assert (float(psi(CHOKED + 1e-4)) - above) / 1e-4 == pytest.approx(0.0, abs=1e-3)
    exact = np.sqrt(CHOKED ** (2 / KAPPA) - CHOKED ** ((KAPPA + 1) / KAPPA))
    assert float(psi(0.1)) == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("ratio", [0.3, 0.6, 0.8, 0.95])
def test_flow_is_eq_3_away_from_equal_pressures(ratio: float) -> None:
    r = max(ratio, CHOKED)
    exact = SUBSONIC * 7e5 * np.sqrt(r ** (2 / KAPPA) - r ** ((KAPPA + 1) / KAPPA))
    assert float(phi(7e5, ratio * 7e5)) == pytest.approx(exact, rel=5e-3)


def test_flow_turns_smoothly_with_the_pressure_difference() -> None:
    P_1, P_2 = ca.SX.sym("P_1"), ca.SX.sym("P_2")
    flow = mass_flow(1e-6, P_1, P_2)
    slope = ca.Function("slope", [P_1, P_2], [ca.gradient(flow, P_1), flow])
    assert float(slope(5e5, 5e5)[1]) == 0.0
    for d in (-1e3, -1.0, -1e-6, 0.0, 1e-6, 1.0, 1e3):
        assert 0.0 < float(slope(5e5 + d, 5e5)[0]) < 1e-6
    assert float(slope(4e5, 6e5)[1]) == -float(slope(6e5, 4e5)[1])


def test_a_sealed_chamber_keeps_p_v_to_the_n() -> None:
    model = rig(a_fill=0.0, a_vent=0.0, n=KAPPA)
    f, chamber = rate(model), model.effect("orifice_chamber")
    assert isinstance(chamber, OrificeChamber)

    def moving(t: float, s: np.ndarray) -> np.ndarray:
        x, v = 0.035 - 0.03 * np.cos(20 * t), 0.6 * np.sin(20 * t)
        return np.asarray(f(x, v, s, [0, 0])).ravel()

    answer = solve_ivp(moving, (0, 0.15), [4e5, 2e5], rtol=1e-9, atol=1e-3)
    x = 0.035 - 0.03 * np.cos(20 * answer.t)
    kept = answer.y[0] * (chamber.V_e + AREA_E * x) ** KAPPA
    np.testing.assert_allclose(kept, kept[0], rtol=1e-6)
    assert answer.y[0].max() / answer.y[0].min() > 1.3, "the chamber was really compressed"


def test_mass_is_conserved_between_hose_and_locked_chamber() -> None:
    """What the tank and the hose lose arrives in the chambers."""
    model = rig(SupplyLine(a=1e-5, V=1e-4, V_tank=1e-2), n=KAPPA)
    f, chamber, line = rate(model), model.effect("orifice_chamber"), model.effect("supply_line")
    assert isinstance(chamber, OrificeChamber) and isinstance(line, SupplyLine)
    x, full = 0.02, float(np.interp(0.7e6, chamber.pressures, chamber.gauge))
    start = [q.value for q in model.states.values()]
    answer = solve_ivp(
        lambda _, s: np.asarray(f(x, 0, s, [1, 1])).ravel(), (0, 0.1), start, rtol=1e-9, atol=1e-9
    )
    names = [q.name for q in model.states.values()]
    change = dict(zip(names, answer.y[:, -1] - answer.y[:, 0], strict=True))
    volumes = {
        "chamber/extend/P": chamber.V_e + AREA_E * x,
        "chamber/retract/P": chamber.V_r + AREA_R * (CYLINDER.stroke - x),
        "supply/line/s": line.V * full,
        "supply/tank/s": line.V_tank * full,
    }
    moved = {name: change[name] * V / (KAPPA * GAS * TEMPERATURE) for name, V in volumes.items()}
    assert sum(moved.values()) == pytest.approx(0.0, abs=1e-5 * moved["chamber/extend/P"])
    assert moved["chamber/extend/P"] > 1e-5


def test_air_flows_in_both_directions() -> None:
    """A chamber above the supply gives air back; one below the atmosphere draws it in."""
    f = rate(rig())
    assert float(f(0.035, 0, [1.2e6, ATMOSPHERE], [1, 0])[0]) < 0
    assert float(f(0.035, 0, [0.5e5, ATMOSPHERE], [0, 0])[0]) > 0
    assert np.abs(np.asarray(f(0.035, 0, [ATMOSPHERE] * 2, [0, 0]))).max() < 1e-6


def test_leak_acts_on_pressures() -> None:
    """cross_leak is written for forces; the chain rule carries it to the pressures."""
    P_e, P_r = 5e5, 2e5
    leaking, tight = (rate(rig(*e))(0.03, 0, [P_e, P_r], [0, 0]) for e in ([CrossLeak(k=3)], []))
    change = np.asarray(leaking - tight).ravel()
    np.testing.assert_allclose(change, [-3 * (P_e - P_r), 3 * (P_e - P_r)], rtol=1e-9)


def test_a_model_file_asks_for_them_by_one_word() -> None:
    model = build_model(load_spec("planning").model_copy(update={"chambers": "orifice"}))
    kinds = {i.effect.kind for i in model.instances}
    assert "orifice_chamber" in kinds and not kinds & {"chamber", "mode_damping"}
