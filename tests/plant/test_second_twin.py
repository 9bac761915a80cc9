"""kemba's plant against the second twin on MuJoCo: a whole jump, air and controller included.

Ground, stops, loops and boom of the twin give way a little, so heights agree to a millimetre.
"""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba")

from mujoco_twin.hidden import machine
from mujoco_twin.machine import CHANNELS, Run, run
from twin.scripts import FRONT_E, FRONT_R, REAR_E, REAR_R, clock, on_feet, script
from twin.valves import VALVES

from kemba.mechanism import load_robot
from kemba.model import Model, load_model
from kemba.plant.controller import Gains, execute
from kemba.trajectory import Trajectory

GAINS = Gains(K_p=150.0, K_d=3.0)
# push off, draw the legs in, stretch them
PULSES = [(FRONT_E, 0.02, 0.19), (REAR_E, 0.02, 0.19)]
PULSES += [(FRONT_R, 0.26, 0.32), (REAR_R, 0.26, 0.32)]
DURATION = 0.5  # s, beyond the apex and before the landing
ORIFICE = Path(__file__).parents[2] / "benchmarks" / "blind" / "orifice_robot.yaml"


def jump(air: str) -> tuple[Run, Trajectory]:
    """A jump of the twin whose hips follow a table, and that table."""
    made, ticks = machine(load_robot("kemba"), air=air), clock(DURATION)
    first = run(made, script("jump", ticks, PULSES, on_feet((0.0, 0.0)), kd=GAINS.K_d))
    hips = first.y[:, 3:5]
    rates = np.gradient(hips, ticks, axis=0)
    plain = script("jump", ticks, PULSES, on_feet((0.0, 0.0)), follow=0.0, kd=GAINS.K_d)
    plain.refs[:, 0:2], plain.refs[:, 2:4] = hips, rates
    columns = {f"{VALVES[i]} [1]": plain.sent[:, i] for i in range(4)}
    for i, leg in enumerate(("front", "rear")):
        columns[f"{leg}/hip/q [rad]"], columns[f"{leg}/hip/w [rad.s-1]"] = hips[:, i], rates[:, i]
        columns[f"{leg}/hip/tau [N.m]"] = 0.0 * ticks
        columns[f"{leg}/piston/x [m]"] = 0.0 * ticks
    for i, name in enumerate(("x [m]", "z [m]", "pitch [rad]")):
        columns[f"body/{name}"] = first.y[:, i]
    return run(made, plain), Trajectory(ticks, columns, {})


@pytest.mark.parametrize("air", ["first_order", "orifice"])
def test_a_jump_of_the_plant_is_that_of_the_second_twin(air: str) -> None:
    twin, table = jump(air)
    model: Model = load_model("planning" if air == "first_order" else str(ORIFICE))
    ours = execute(table, model, GAINS).trajectory
    mine = np.stack([np.interp(twin.ticks, ours.time, ours[name]) for name in CHANNELS], axis=1)
    assert twin.y[:, 1].max() > 0.4
    assert mine[:, 1].max() == pytest.approx(twin.y[:, 1].max(), abs=1.5e-3)
    assert np.abs(mine - twin.y)[:, 5:].max() < 2e-3
    rise = [np.gradient(z, twin.ticks).max() for z in (mine[:, 1], twin.y[:, 1])]
    assert rise[0] ** 2 == pytest.approx(rise[1] ** 2, rel=0.01)  # energy of the body's flight
