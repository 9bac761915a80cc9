"""The second twin's own parts: air, sensors, and where a hidden effect is put."""

import numpy as np
import pytest

pytest.importorskip("numba")

from mujoco_twin.air import AREA, Chambers, FirstOrder, Flaws, Orifice
from mujoco_twin.cases import OWN, draw
from mujoco_twin.hidden import APPLIED, applied, machine
from mujoco_twin.machine import Run
from mujoco_twin.mjcf import engine
from mujoco_twin.sensors import SIGMA, Sensors

from kemba.mechanism import load_robot

STEP = 5e-5


def filled(figures: FirstOrder | Orifice, flaws: Flaws, duration: float) -> Chambers:
    """The chambers after the extend valve was open so long, the rod at mid-stroke."""
    air = Chambers(figures, flaws)
    for _ in range(round(duration / STEP)):
        air.step(STEP, 0.035, 0.0, (1.0, 0.0), 1.0)
    return air


def test_chambers_fill_to_what_the_supply_gives() -> None:
    assert filled(FirstOrder(), Flaws(), 0.5).push()[0] == pytest.approx(324.0, rel=1e-6)
    assert filled(FirstOrder(), Flaws(supply=0.9), 0.5).push()[0] == pytest.approx(291.6, rel=1e-6)
    full = filled(Orifice(), Flaws(), 0.5).push()[0]
    assert full == pytest.approx(AREA[0] * 0.624e6, rel=1e-3)
    tau = 0.5 * (0.008 + 0.025)  # eq. 5 at mid-stroke
    assert filled(FirstOrder(), Flaws(), tau).push()[0] == pytest.approx(
        324.0 * (1 - np.exp(-1)), rel=0.01
    )


def test_every_effect_changes_the_machine() -> None:
    plain = machine(load_robot("kemba"))
    for kind in [*(k for k in APPLIED if k != "geometry"), *OWN]:
        assert applied(plain, [draw(kind, 1.0, 3)]) != plain, kind


def test_mass_only_moves_between_body_and_legs() -> None:
    plain = machine(load_robot("kemba"))
    split = applied(plain, [{"kind": "mass_split", "parameters": {"m": 0.2}}])
    before, after = (engine(m.robot, m.build()) for m in (plain, split))
    assert after.body_mass.sum() == pytest.approx(before.body_mass.sum())
    assert np.abs(after.body_mass - before.body_mass).max() == pytest.approx(0.2)


def test_noise_has_its_size_and_its_colour() -> None:
    n = 20000
    still = np.zeros((n, 7))
    none = np.zeros((n, 2))
    ticks = np.arange(n) * 1e-3
    rest = Run(ticks, still, still, none, np.zeros((n, 4)), none, none, np.zeros(n))
    for colour, kept in ((0.0, (-0.05, 0.05)), (0.95, (0.5, 0.96))):
        z = Sensors(colour=colour).columns(rest, (0.0, 0.0), (), [1, 2])["body/z [m]"]
        assert z.std() == pytest.approx(np.hypot(SIGMA["z"], 1e-4 / 12**0.5), rel=0.15)
        assert kept[0] < np.corrcoef(z[1:], z[:-1])[0, 1] < kept[1]
