"""What every reader sees of a mechanism: coordinates, ports, and its inverse dynamics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import casadi as ca

from kemba.errors import KembaError, suggest
from kemba.mechanism.cylinder import Bore, Cylinder
from kemba.mechanism.links import Robot
from kemba.quantity import Quantity
from kemba.scene import FLAT, POINTS, Scene


@dataclass(frozen=True)
class Port:
    """One scalar phi(q) of a mechanism at which effects push.

    Its velocity J v and acceleration J a + Jdot v come from AD, and an effort e at the port
    enters the generalised forces as J'e.
    """

    quantity: Quantity
    rate: Quantity
    phi: ca.SX


@dataclass(frozen=True)
class Mechanism:
    """A mechanism in reduced coordinates.

    `q, v, a` are SX symbols (n,); `inverse_dynamics` (n,) is the generalised force that the
    motion (q, v, a) needs, gravity included, no effect included. `legs` are the prefixes under
    which leg ports are found ("" for a rig). `cylinder`: the one of every leg. `robot`: the link
    table, None for a rig; it differs by `offsets` [m] from the table `drawn`. `bore`: the
    cylinder's dimensions where nothing else of it is known. `sign_speed`: rate [m.s-1] of a piston
    within which the sign of its friction is smoothed. `rig`: the kind of a rig of the user's own,
    `logged` the columns that its logs must have and their units. `imposed`: the motion is given,
    forces are answers.
    `mirror` maps a coordinate to its mirror image ("-" prefixed where the sign turns).
    `standing`: coordinates with retracted pistons and each foot on the ground under its hip.
    `tolerances`: 1 sigma of figures of its links that may be off, as shares of them, by name.
    `points`: (x, z) of places that pictures need, such as `front/pin`; nothing pushes there.
    `scene`: the ground it moves on, and obstacles; see `on`.
    """

    name: str
    q: ca.SX
    v: ca.SX
    a: ca.SX
    coordinates: tuple[Quantity, ...]
    velocities: tuple[Quantity, ...]
    inverse_dynamics: ca.SX
    ports: dict[str, Port]
    legs: tuple[str, ...]
    gravity: float
    weight: float = 1.0
    mass: float = 1.0
    body_mass: float = 0.0
    robot: Robot | None = None
    drawn: Robot | None = None
    offsets: Mapping[str, float] = field(default_factory=dict)
    cylinder: Cylinder | None = None
    bore: Bore | None = None
    sign_speed: float = 0.01
    rig: str = ""
    logged: dict[str, str] = field(default_factory=dict)
    imposed: bool = False
    mirror: dict[str, str] = field(default_factory=dict)
    standing: dict[str, float] = field(default_factory=dict)
    points: dict[str, ca.SX] = field(default_factory=dict)
    tolerances: dict[str, float] = field(default_factory=dict)
    scene: Scene = FLAT

    def on(self, scene: Scene, at: float = 0.0) -> Mechanism:
        """The same mechanism in a scene, standing at a place x [m] of it: from there its
        coordinates are counted by whoever scales them, and about there it has its mirror.

        Unless that is level at 0 and free, it has ports for the height of feet, knees and hips
        above the ground under them (`front/foot/gap`), for their distance from its obstacles
        (`front/foot/room`), and from each part of ground with walls (`front/foot/distance`).
        It has a mirror where every place of the scene is like every other. Raises ValueError where
        it stands in a scene already.
        """
        if (scene, at) == (self.scene, self.coordinates[0].value) or self.robot is None:
            return self
        if self.scene != FLAT:
            raise ValueError("stands in a scene already")
        lowest, highest = scene.ground.extent
        ground = float(scene.ground.height(at))
        x, z, *others = self.coordinates
        x = replace(x, lower=x.lower + at, upper=x.upper + at, value=at)
        z = replace(z, lower=z.lower + lowest, upper=z.upper + highest, value=ground)
        pose = {"body/x": at, "body/z": self.standing["body/z"] + ground}
        return replace(
            self,
            scene=scene,
            coordinates=(x, z, *others),
            ports={**self.ports, **_scene_ports(self, scene)},
            mirror=self.mirror if scene.even else {},
            standing={**self.standing, **pose},
        )

    @property
    def origin(self) -> tuple[float, ...]:
        """Coordinates (n,) from which programs count."""
        return tuple(c.value for c in self.coordinates)

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.coordinates)

    @property
    def stroke(self) -> float:
        """Way of every piston [m]. Raises KembaError for a mechanism without pistons."""
        return self.need_bore().stroke

    def need_bore(self) -> Bore:
        """The dimensions of the cylinder. Raises KembaError for a mechanism without pistons."""
        return self.bore or self.need_cylinder()

    def need_cylinder(self) -> Cylinder:
        """The cylinder of every leg. Raises KembaError for a mechanism without pistons."""
        if self.cylinder is None:
            raise KembaError(self.name, "has no cylinder", "a robot or a rig was expected")
        return self.cylinder

    def need_robot(self) -> Robot:
        """The link table. Raises KembaError for a mechanism that is no robot."""
        if self.robot is None:
            raise KembaError(self.name, "is not a robot", "a model of a whole robot was expected")
        return self.robot

    def port(self, name: str) -> Port:
        """The port called `name`, e.g. `front/piston/x`. Raises KembaError."""
        if name not in self.ports:
            raise KembaError(self.name, f"no port '{name}'", hint=suggest(name, self.ports))
        return self.ports[name]

    @cached_property
    def _motions(self) -> dict[str, tuple[ca.SX, ca.SX, ca.SX]]:
        phi = ca.vertcat(*(p.phi for p in self.ports.values()))
        rate = ca.jtimes(phi, self.q, self.v)
        acc = ca.jtimes(rate, self.q, self.v) + ca.jtimes(phi, self.q, self.a)
        return {name: (phi[i], rate[i], acc[i]) for i, name in enumerate(self.ports)}

    def motion(self, name: str) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Position, velocity and acceleration of a port, as expressions of q, v, a."""
        self.port(name)
        return self._motions[name]

    def generalised(self, efforts: dict[str, ca.SX]) -> ca.SX:
        """Generalised force (n,) of efforts given per port: sum of J'e."""
        if not efforts:
            return ca.SX.zeros(self.n)
        phi = ca.vertcat(*(self.port(name).phi for name in efforts))
        return ca.jtimes(phi, self.q, ca.vertcat(*efforts.values()), True)


def _scene_ports(mechanism: Mechanism, scene: Scene) -> dict[str, Port]:
    found: dict[str, Port] = {}

    def add(name: str, length: ca.SX, doc: str) -> None:
        rate = Quantity(f"{name}_rate", "m.s-1")
        found[name] = Port(Quantity(name, "m", doc=doc), rate, length)

    stretches = scene.ground.stretches
    for place in (f"{leg}/{p}" for leg in mechanism.legs if not scene.plain for p in POINTS):
        x, z = (mechanism.ports[f"{place}/{axis}"].phi for axis in "xz")
        add(f"{place}/gap", z - scene.ground.height(x), "height above the ground under it")
        for i, solid in enumerate(stretches if len(stretches) > 1 else ()):
            doc = "distance from the ground between two walls"
            add(f"{place}/distance{i or ''}", solid.distance(x, z), doc)
        for i, box in enumerate(scene.obstacles):
            away = box.solid(scene.ground).distance(x, z)
            add(f"{place}/room{i or ''}", away, "distance from an obstacle")
    return found
