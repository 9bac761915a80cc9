"""Air effects against their equations, worked out by hand."""

import numpy as np
import pytest

from kemba.effects import Effect
from kemba.effects.pneumatics.hose import BothModeLoss, CrossLeak, HoseLag
from kemba.effects.pneumatics.supply import RiseTimeScale, SupplyDroop, SupplyScale
from kemba.effects.pneumatics.valve import ValveCloseDelay, ValveDelay
from kemba.errors import KembaError
from kemba.mechanism import load_cylinder
from kemba.model import Model, build_model, load_model, load_spec

CYLINDER = load_cylinder("dsnu-25-70")
AREA_E, AREA_R = CYLINDER.area_extend, CYLINDER.area_retract
X, V = 0.02, 0.3


def rates(model: Model, u: tuple[float, float], v: float = V, **states: float) -> dict[str, float]:
    """Rates of a rig's effect states by column name, and the force `piston/F`."""
    node = model.node
    names = [q.name for q in model.states.values()]
    s = np.array(
        [
            states.get(n.replace("/", "_"), q.value)
            for n, q in zip(names, model.states.values(), strict=True)
        ]
    )
    arguments = {"q": X, "v": v, "a": 0, "s": s, "sd": 0 * s, "lam": [], "u": list(u), "p": []}
    result = dict(zip(names, -np.asarray(node.residual(**arguments)["rate"]).ravel(), strict=True))
    columns = [o.name for o in node.output_quantities]
    force = np.asarray(node.measure(**arguments)["y"]).ravel()[columns.index("piston/F")]
    return {**result, "piston/F": float(force)}


def rig(*effects: Effect) -> Model:
    return load_model("planning", extra=effects, rig=True)


def test_supply_scale_multiplies_both_static_forces() -> None:
    found = rates(rig(SupplyScale(k=0.9)), (1, 1))
    tau_e, tau_r = 0.008 + 0.017 * X / 0.07, 0.008 + 0.017 * (0.07 - X) / 0.07
    assert found["chamber/extend/F"] == pytest.approx(0.9 * 324 / tau_e)
    assert found["chamber/retract/F"] == pytest.approx(0.9 * 260 / tau_r)


def test_rise_time_scale_multiplies_tau() -> None:
    slow, usual = rates(rig(RiseTimeScale(k=1.25)), (1, 0)), rates(rig(), (1, 0))
    assert slow["chamber/extend/F"] == pytest.approx(usual["chamber/extend/F"] / 1.25)


@pytest.mark.parametrize("valve", [1, 0], ids=["filling", "venting"])
@pytest.mark.parametrize("chambers", ["first_order", "orifice"])
def test_rise_time_scale_slows_filling_and_venting_alike(chambers: str, valve: int) -> None:
    """A valve's answer takes 1.25 times as long, in the chambers of eq. 4 and of eq. 1 to 3."""
    state = {"first_order": "chamber/extend/F", "orifice": "chamber/extend/P"}[chambers]
    full = {"first_order": 150.0, "orifice": 4e5}[chambers]
    spec = load_spec("planning").model_copy(update={"chambers": chambers})

    def rate(*extra: Effect) -> float:
        model = build_model(spec, extra, rig=True)
        u = (valve, 0)
        return rates(model, u, v=0.0, **{state.replace("/", "_"): full})[state]

    assert rate() > 0 if valve else rate() < 0
    assert rate(RiseTimeScale(k=1.25)) == pytest.approx(rate() / 1.25, rel=1e-9)


def test_droop_is_drawn_by_filling_chambers_of_every_leg() -> None:
    D, T, s, F = 0.05, 0.3, 0.9, 100.0
    found = rates(
        rig(SupplyDroop(D=D, T=T), SupplyScale(k=0.9)), (1, 0), supply_s=s, chamber_extend_F=F
    )
    tau = 0.008 + 0.017 * X / 0.07
    wanted = (1 - s) / T - D * (s - F / (0.9 * 324)) / tau
    assert found["supply/s"] == pytest.approx(wanted)
    assert found["chamber/extend/F"] == pytest.approx((s * 0.9 * 324 - F) / tau)


def test_one_supply_serves_the_robot() -> None:
    model = load_model("planning", extra=[SupplyDroop(D=0.05)])
    assert [key for key in model.states if key[1] == "s"] == [(None, "s")]
    assert model.node.rate.numel() == 5


def test_hose_lag_filters_every_use_of_u() -> None:
    T = 0.004
    found = rates(rig(HoseLag(T=T), BothModeLoss(F=15)), (1, 1), hose_extend_u=0.5)
    assert found["hose/extend/u"] == pytest.approx(0.5 / T)
    assert found["hose/retract/u"] == pytest.approx(1.0 / T)
    tau = 0.5 * (0.008 + 0.017 * X / 0.07 + 0.013 + 0.024 * X / 0.07)
    assert found["chamber/extend/F"] == pytest.approx(0.5 * 324 / tau)
    both = rates(rig(HoseLag(T=T), BothModeLoss(F=15)), (1, 1), hose_extend_u=1, hose_retract_u=1)
    assert both["piston/F"] == pytest.approx(-15 - 59 * V)


def test_cross_leak_moves_both_chambers() -> None:
    k, F_e, F_r = 3.0, 200.0, 50.0
    there = {"chamber_extend_F": F_e, "chamber_retract_F": F_r}
    leaking, tight = rates(rig(CrossLeak(k=k)), (0, 0), **there), rates(rig(), (0, 0), **there)
    p = F_e / AREA_E - F_r / AREA_R
    change = {n: leaking[n] - tight[n] for n in tight}
    assert change["chamber/extend/F"] == pytest.approx(-k * p * AREA_E)
    assert change["chamber/retract/F"] == pytest.approx(k * p * AREA_R)


def test_delays_add_to_the_dead_time_of_their_leg() -> None:
    extra = [ValveDelay(dt=0.002), ValveCloseDelay(dt=0.001, on="rear")]
    model = load_model("planning", extra=extra)
    assert model.timing("front") == pytest.approx((0.008, 0.008))
    assert model.timing("rear") == pytest.approx((0.008, 0.009))


def test_two_lags_of_one_signal_are_refused() -> None:
    with pytest.raises(KembaError, match=r"declared twice|two effects lag"):
        load_model("planning", extra=[HoseLag(T=0.004), HoseLag(T=0.004, on="front")])
