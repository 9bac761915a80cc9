"""The robot's link table as a MuJoCo model: planar joints, loops closed by equality constraints."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco

from kemba.mechanism.links import Link, Robot

HINGE = 'type="hinge" axis="0 -1 0"'  # counter-clockwise, x forward and z up
SLIDES = {"x": 'type="slide" axis="1 0 0"', "z": 'type="slide" axis="0 0 1"'}


@dataclass(frozen=True)
class Contact:
    """How feet, stops and loops give way: time constants [s] and grip."""

    foot: float = 1e-3
    damping: float = 1.0  # of the foot's spring, 1: critical
    stop: float = 3e-4
    loop: float = 2.5e-4
    impedance: float = 0.99
    mu: float = 1.0


@dataclass(frozen=True)
class Flex:
    """Bending of the boom between its end and the body: stiffness [N/m] and damping [N s/m]."""

    k: float
    c: float


@dataclass(frozen=True)
class Build:
    """All that MuJoCo is told beside the link table.

    `joints`: attributes (armature, damping, frictionloss, stiffness, springref) by joint.
    `payload` [kg] at the body's centre, `com` [m]: the body's centre of mass ahead of it.
    """

    step: float = 5e-5
    contact: Contact = Contact()
    flex: Flex | None = None
    joints: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    payload: float = 0.0
    com: float = 0.0


def engine(robot: Robot, build: Build) -> mujoco.MjModel:
    """The robot as MuJoCo simulates it."""
    return mujoco.MjModel.from_xml_string(xml(robot, build))


def xml(robot: Robot, build: Build) -> str:
    """The model in MuJoCo's own format."""
    c = build.contact
    legs = "".join(_leg(robot, name, build) for name in robot.legs)
    loops = "".join(
        f'<connect site1="{n}/rod" site2="{n}/pin" solref="{c.loop} 1" solimp="1 1 0.001"/>'
        for n in robot.legs
    )
    body = f"{_joint('pitch', HINGE, build)} {_torso(robot, build)} {legs}"
    if build.flex is None:
        carried = f"<body>{_slides('', build)} {body}</body>"
    else:
        tip = '<inertial pos="0 0 0" mass="1e-4" diaginertia="1e-7 1e-7 1e-7"/>'
        spring = f'stiffness="{build.flex.k}" damping="{build.flex.c}"'
        bend = "".join(f'<joint name="bend/{a}" {s} {spring}/>' for a, s in SLIDES.items())
        carried = f"<body>{_slides('', build)} {tip}<body>{bend} {body}</body></body>"
    return f"""
    <mujoco>
      <compiler autolimits="true" inertiafromgeom="false"/>
      <option timestep="{build.step}" gravity="0 0 {-robot.gravity}" integrator="implicitfast"
        iterations="100" tolerance="1e-10" cone="elliptic" impratio="10"><flag energy="enable"/>
      </option>
      <default><geom mass="0" condim="3" friction="{c.mu} 0 0" solref="{c.foot} {c.damping}"
        solimp="{c.impedance} {c.impedance} 0.0005"/></default>
      <worldbody>
        <geom type="plane" size="5 5 1" pos="0 0 -0.001"/>
        {carried}
      </worldbody>
      <equality>{loops}</equality>
    </mujoco>"""


def _leg(robot: Robot, name: str, build: Build) -> str:
    leg, place = robot.leg, robot.legs[name]
    foot = f'<geom type="sphere" size="0.001" pos="0 0 {-leg.tibia.length}"/>'
    c = build.contact
    stop = f'range="0 {robot.stroke}" solreflimit="{c.stop} 1"'
    stop += f' solimplimit="{c.impedance} {c.impedance} 0.0005"'
    rod = _joint(f"{name}/rod", f'type="slide" axis="0 0 -1" {stop}', build)
    return f"""
    <body pos="{place.hip} 0 0">
      {_joint(f"{name}/hip", HINGE, build)} {_inertial(leg.femur, leg.femur.com)}
      <body pos="0 0 {-leg.femur.length}">
        {_joint(f"{name}/knee", HINGE, build)} {_inertial(leg.tibia, leg.tibia.com)} {foot}
        <site name="{name}/pin" pos="0 0 {-leg.piston.pin}"/>
        <site name="{name}/foot" pos="0 0 {-leg.tibia.length}"/>
      </body>
      <body pos="{place.fold * leg.piston.mount} 0 0">
        {_joint(f"{name}/cylinder", HINGE, build)} {_inertial(leg.cylinder, leg.cylinder.com)}
        <body pos="0 0 {-leg.piston.retracted}">
          {rod} {_inertial(leg.rod, -leg.rod.com)} <site name="{name}/rod"/>
        </body>
      </body>
    </body>"""


def _slides(prefix: str, build: Build) -> str:
    return "".join(_joint(prefix + axis, kind, build) for axis, kind in SLIDES.items())


def _joint(name: str, kind: str, build: Build) -> str:
    own = "".join(f' {key}="{value}"' for key, value in build.joints.get(name, {}).items())
    return f'<joint name="{name}" {kind}{own}/>'


def _torso(robot: Robot, build: Build) -> str:
    """The body link; a payload sits at its centre, wherever its centre of mass is."""
    m, d, extra = robot.body.mass, build.com, build.payload
    total = m + extra
    centre = m * d / total
    spin = robot.body.inertia + m * (d - centre) ** 2 + extra * centre**2
    return f'<inertial pos="{centre} 0 0" mass="{total}" diaginertia="{spin} {spin} {spin}"/>'


def _inertial(link: Link, down: float) -> str:
    i = link.inertia
    return f'<inertial pos="0 0 {-down}" mass="{link.mass}" diaginertia="{i} {i} {i}"/>'
