"""The controller table of a plan made by hand, to the last digit."""

from pathlib import Path

import numpy as np

from kemba.model import load_model
from kemba.ocp import controller_table
from kemba.trajectory import Trajectory

GOLDEN = Path(__file__).parent / "controller.csv"


def by_hand() -> Trajectory:
    """Two steps of 4 and 6 ms: the front extends in the second, the rear retracts in both."""
    time = np.array([0.0, 0.004, 0.01])
    columns = {q.header: 0.0 * time for q in load_model().inputs.values()}
    for leg in ("front", "rear"):
        columns |= {
            f"{leg}/hip/q [rad]": 100 * time,
            f"{leg}/hip/w [rad.s-1]": np.array([0.0, 50.0, 125.0]),
            f"{leg}/piston/x [m]": time,
        }
    columns |= {"body/x [m]": 0 * time, "body/z [m]": 25 * time, "body/pitch [rad]": 0 * time}
    columns["front/hip/tau [N.m]"] = np.array([0.0, 4.0, 14.0])
    columns["front/valve/extend [1]"] = np.array([0.0, 0.0, 1.0])
    columns["rear/valve/retract [1]"] = np.array([0.0, 1.0, 1.0])
    return Trajectory(time, columns)


def test_controller_table(tmp_path: Path) -> None:
    found = controller_table(load_model(), by_hand())
    found.write(tmp_path / "controller.csv")
    written, golden = (
        path.read_text(encoding="utf-8") for path in (tmp_path / "controller.csv", GOLDEN)
    )
    assert written.splitlines()[0] == golden.splitlines()[0]
    expected = Trajectory.read(GOLDEN)
    assert np.allclose(found.time, expected.time, rtol=0, atol=1e-12)
    for name in expected.names:
        assert np.allclose(found[name], expected[name], rtol=0, atol=1e-12), name


def test_a_hold_comes_before_the_plan() -> None:
    """Before plan time 0 the first pose, no torque and closed valves; after it the same table."""
    plain = controller_table(load_model(), by_hand())
    held = controller_table(load_model(), by_hand(), 0.3)
    assert held.time[0] == -0.3 and held.meta["lead"] == 0.3
    early, later = held.time < -0.0065, held.time >= -0.0065
    for name in held.names:
        assert np.array_equal(held[name][later], plain[name]), name
    assert np.all(held["front/hip/q"][early] == 0.0)
    assert not any(held[name][early].any() for name in held.names if "/valve/" in name)
    assert np.allclose(held.time[later], plain.time, rtol=0, atol=1e-12)
