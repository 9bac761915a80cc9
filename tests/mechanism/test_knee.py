"""The knee's closed loop: there and back, its slope, its reach."""

import casadi as ca
import numpy as np
import pytest

from kemba.mechanism import knee, load_robot

ROBOT = load_robot("kemba")
LEG = ROBOT.leg
STROKE = np.linspace(0.0, ROBOT.stroke, 15)


@pytest.mark.parametrize("x", STROKE)
def test_extension_inverts_flexion(x: float) -> None:
    assert float(knee.extension(LEG, knee.flexion(LEG, x))) == pytest.approx(x, abs=1e-14)


def test_extending_the_piston_straightens_the_knee() -> None:
    assert np.all(np.diff([knee.flexion(LEG, x) for x in STROKE]) < 0)


def test_slope_and_curvature_agree_with_finite_differences() -> None:
    k, w = ca.SX.sym("k"), ca.SX.sym("w")
    x = knee.extension(LEG, k)
    slope = ca.jacobian(x, k)
    maps = ca.Function("maps", [k, w], [x, slope, ca.jtimes(slope, k, w)])
    step = 1e-6
    for bend in np.linspace(0.8, 2.4, 9):
        before, after = maps(bend - step, 1.0), maps(bend + step, 1.0)
        _, slope_here, turning = maps(bend, 1.0)
        assert float(slope_here) == pytest.approx(
            float(after[0] - before[0]) / (2 * step), rel=1e-6
        )
        assert float(turning) == pytest.approx(float(after[1] - before[1]) / (2 * step), rel=1e-6)


def test_pivot_to_pin_is_the_cylinder_with_its_rod() -> None:
    for x in STROKE:
        along, aside = knee.pivot_to_pin(LEG, knee.flexion(LEG, x))
        assert np.hypot(float(along), float(aside)) == pytest.approx(0.2057 + x)


def test_out_of_reach() -> None:
    with pytest.raises(
        ValueError, match=r"extension of 200\.0 mm; it reaches -\d+\.\d to \d+\.\d mm"
    ):
        knee.flexion(LEG, 0.2)
    for x in knee.extensions(LEG):
        inside = x + np.copysign(1e-6, 0.05 - x)
        assert np.isfinite(knee.flexion(LEG, inside))
        with pytest.raises(ValueError, match="it reaches"):
            knee.flexion(LEG, 2 * x - inside)
