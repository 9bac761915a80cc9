"""The rigid-body part against an engine nobody here wrote: MuJoCo.

Tolerances: in flight the two integrate the same equations, MuJoCo with its loops closed by stiff
springs; at touchdown MuJoCo's contact is stiff and damped where the plant's is inelastic.
"""

import casadi as ca
import mujoco
import numpy as np

from kemba.effects.mechanics.ground import Contact
from kemba.mechanism import Link, Robot, load_robot, robot_mechanism
from kemba.mechanism.robot import tree_angles
from kemba.model import Model
from kemba.plant.simulate import initial_values, simulate

STEP = 2e-5  # s
HINGE = 'type="hinge" axis="0 -1 0"'


def inertial(link: Link, down: float) -> str:
    i = link.inertia
    return f'<inertial pos="0 0 {-down}" mass="{link.mass}" diaginertia="{i} {i} {i}"/>'


def leg_xml(robot: Robot, name: str) -> str:
    leg, place = robot.leg, robot.legs[name]
    pin = f'<site name="{name}/pin" pos="0 0 {-leg.piston.pin}"/>'
    foot = f'<geom name="{name}/foot" type="sphere" size="0.001" pos="0 0 {-leg.tibia.length}"/>'
    return f"""
    <body pos="{place.hip} 0 0">
      <joint {HINGE} armature="{leg.rotor_inertia}"/> {inertial(leg.femur, leg.femur.com)}
      <body pos="0 0 {-leg.femur.length}">
        <joint {HINGE}/> {inertial(leg.tibia, leg.tibia.com)} {pin} {foot}
      </body>
      <body pos="{place.fold * leg.piston.mount} 0 0">
        <joint {HINGE}/> {inertial(leg.cylinder, leg.cylinder.com)}
        <body pos="0 0 {-leg.piston.retracted}">
          <joint type="slide" axis="0 0 -1"/> {inertial(leg.rod, -leg.rod.com)}
          <site name="{name}/rod"/>
        </body>
      </body>
    </body>"""


def mujoco_model(robot: Robot) -> mujoco.MjModel:
    legs = "".join(leg_xml(robot, name) for name in robot.legs)
    loops = "".join(
        f'<connect site1="{name}/rod" site2="{name}/pin" solref="{5 * STEP} 1" solimp="1 1 0.001"/>'
        for name in robot.legs
    )
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <compiler autolimits="true" inertiafromgeom="false"/>
      <option timestep="{STEP}" gravity="0 0 {-robot.gravity}" integrator="implicit"
        iterations="200" tolerance="1e-12" cone="elliptic"/>
      <default><geom mass="0" condim="3" friction="1 0 0" solref="{5 * STEP} 1"
        solimp="0.99 0.99 0.0001"/></default>
      <worldbody>
        <geom type="plane" size="5 5 1" pos="0 0 -0.001"/>
        <body>
          <joint type="slide" axis="1 0 0"/> <joint type="slide" axis="0 0 1"/> <joint {HINGE}/>
          {inertial(robot.body, 0.0)} {legs}
        </body>
      </worldbody>
      <equality>{loops}</equality>
    </mujoco>""")


def by_mujoco(model: Model, start: dict[str, float], times: np.ndarray) -> np.ndarray:
    """x, z, pitch and the hips at the times (m, 5)."""
    robot = load_robot("kemba")
    engine = mujoco_model(robot)
    data = mujoco.MjData(engine)
    q, v, _ = initial_values(model, start)
    symbol, rate = model.mechanism.q, model.mechanism.v
    tree = tree_angles(robot, symbol)
    place = ca.Function("tree", [symbol, rate], [tree, ca.jtimes(tree, symbol, rate)])
    data.qpos[:], data.qvel[:] = (np.asarray(part).ravel() for part in place(q, v))
    rows = []
    for time in times:
        while data.time < time - STEP / 2:
            mujoco.mj_step(engine, data)
        rows.append(data.qpos[[0, 1, 2, 3, 7]].copy())
    return np.array(rows)


def difference(model: Model, start: dict[str, float], times: np.ndarray) -> np.ndarray:
    """Largest differences in x, z [m], pitch and hips [rad] (5,)."""
    ours = simulate(model, start, duration=float(times[-1]), sample=times)
    names = [c.name for c in model.mechanism.coordinates][:5]
    mine = np.column_stack([ours[name] for name in names])
    return np.abs(mine - by_mujoco(model, start, times)).max(axis=0)


def test_free_fall_with_moving_legs() -> None:
    model = Model(robot_mechanism(load_robot("kemba")), [])
    start = {
        "body/z": 2.0,
        "body/vx": 0.5,
        "body/vz": 1.0,
        "body/pitch_rate": 1.0,
        "front/piston/x": 0.02,
        "rear/piston/x": 0.03,
        "front/hip/w": 4.0,
        "rear/hip/w": -6.0,
        "front/knee/w": 2.0,
        "rear/knee/w": 3.0,
    }
    error = difference(model, start, np.arange(0.0, 0.201, 0.02))
    assert error[:2].max() < 5e-5
    assert error[2:].max() < 5e-5


def test_drop_on_two_feet() -> None:
    """Up to 60 ms after touchdown, legs half folded: feet stick, knees and hips give way."""
    model = Model(robot_mechanism(load_robot("kemba")), [Contact()])
    start = {"front/piston/x": 0.05, "rear/piston/x": 0.05}
    start["body/z"] = initial_values(model, start)[0][1] + 0.05
    error = difference(model, start, np.arange(0.0, 0.161, 0.01))
    assert error[:2].max() < 2e-4
    assert error[2:].max() < 5e-3
