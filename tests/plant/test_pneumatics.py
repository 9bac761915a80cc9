"""Physical chambers in the plant: a sealed one, and air that is neither made nor lost."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.effects.pneumatics.supply import SupplyLine
from kemba.effects.pneumatics.valve import Valve
from kemba.mechanism import load_cylinder, rig_mechanism
from kemba.model import Model
from kemba.plant.commands import Profile
from kemba.plant.rigs import drive, hermite, locked

CYLINDER = load_cylinder("dsnu-25-70")
AREA_E, AREA_R, STROKE = CYLINDER.area_extend, CYLINDER.area_retract, CYLINDER.stroke


@pytest.mark.parametrize("n", [1.0, 1.32, 1.4])
@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_sealed_chamber_keeps_p_v_to_the_n(n: float, seed: int) -> None:
    chamber = OrificeChamber(a_fill=0.0, a_vent=0.0, n=n)
    rig = Model(rig_mechanism(CYLINDER), [Valve(), chamber])
    knots, rng = np.arange(0.0, 1.01, 0.1), np.random.default_rng(seed)
    motion = hermite(knots, rng.uniform(0.01, 0.06, 11), rng.uniform(-0.3, 0.3, 11))
    pressure = {f"chamber/{name}/P": rng.uniform(1e5, 7e5) for name in ("extend", "retract")}
    t = drive(rig, motion, {}, np.arange(0, 1.0, 1e-3), start=pressure)
    V_e = CYLINDER.tube + AREA_E * t["piston/x"]
    V_r = CYLINDER.tube + AREA_R * (STROKE - t["piston/x"])
    for name, V in (("extend", V_e), ("retract", V_r)):
        kept = t[f"chamber/{name}/P"] * V**n
        assert np.ptp(kept) < 1e-4 * kept[0]


def test_air_goes_from_tank_to_hose_to_chambers_and_nowhere_else() -> None:
    """At fixed volumes the balance is of sum P V, as every kilogram counts kappa R T."""
    chamber, line = OrificeChamber(n=1.4), SupplyLine()
    rig = Model(rig_mechanism(CYLINDER), [Valve(), chamber, line])
    both = {f"valve/{name}": Profile.constant(1.0) for name in ("extend", "retract")}
    start = {"chamber/extend/P": ATMOSPHERE, "chamber/retract/P": 3e5}
    start |= {"supply/line/s": 1.0, "supply/tank/s": 1.0}
    t = drive(rig, locked(0.03), both, np.arange(0, 0.2, 1e-3), start=start, dead_time=False)
    full = float(np.interp(0.7e6, chamber.pressures, chamber.gauge))
    total = t["chamber/extend/P"] * (CYLINDER.tube + AREA_E * 0.03)
    total = total + t["chamber/retract/P"] * (CYLINDER.tube + AREA_R * (STROKE - 0.03))
    total = total + full * (t["supply/line/s"] * line.V + t["supply/tank/s"] * line.V_tank)
    moved = 5e5 * 3e-5  # Pa m3, about what the chambers take
    assert np.ptp(total) < 1e-4 * moved
    assert t["chamber/extend/P"][-1] > 6e5
