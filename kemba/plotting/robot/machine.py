"""What a figure needs to know of the robot: where its points are, and its limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from kemba.config import load_yaml
from kemba.effects.pneumatics.chamber import STEADY, Chamber
from kemba.effects.pneumatics.tables import at_supply
from kemba.events import STAYS, bridged, gap
from kemba.mechanism import Mechanism, Robot, knee
from kemba.model import Model, build_model, load_spec
from kemba.plotting.source import Mask, Source
from kemba.quantity import to_si
from kemba.scene import FLAT, Scene, scene_in
from kemba.trajectory import Array, Trajectory

OVERTRAVEL = 0.004  # m; a sensor may read this far beyond the stops
ON_GROUND = 0.01  # m; a foot below this height counts as standing when its force is not known
PRESSED = 0.02  # of the weight; more than this on a foot means it stands
CLEAR = 4.0  # times its noise: what a measured force must exceed
MOMENT = 7e-3  # s, over which a measured force is averaged
EXACT = ("plan", "simulation")  # kinds of trajectory without noise


@dataclass(frozen=True)
class Machine:
    """A robot to draw. `limits` by quantity, in SI: levels that a panel shows as lines."""

    robot: Robot
    mechanism: Mechanism
    limits: Mapping[str, tuple[float, ...]]
    places: ca.Function

    def coordinates(self, trajectory: Trajectory) -> Array | None:
        """Coordinates (rows, n) of the mechanism, or None where columns are missing.

        A knee that is not recorded follows from its piston. Body x and pitch may be missing.
        """
        columns = []
        for quantity in self.mechanism.coordinates:
            values = self._column(trajectory, quantity.name)
            if values is None:
                return None
            columns.append(values)
        return np.column_stack(columns)

    def _column(self, trajectory: Trajectory, name: str) -> Array | None:
        if name in trajectory:
            return trajectory[name]
        leg, _, rest = name.partition("/")
        if rest == "knee/q" and f"{leg}/piston/x" in trajectory:
            return self._knee(leg, trajectory[f"{leg}/piston/x"])
        optional = name in ("body/x", "body/pitch")
        return np.zeros(len(trajectory)) if optional else None

    def _knee(self, leg: str, extension: Array) -> Array:
        """Knee angles [rad] of piston extensions [m], from a table with a fine grid."""
        table = np.linspace(-OVERTRAVEL, self.mechanism.stroke + OVERTRAVEL, 2001)
        bend = knee.flexions(self.robot.leg, table)
        return np.asarray(self.robot.legs[leg].fold * np.interp(extension, table, bend))

    def points(self, coordinates: Array) -> dict[str, Array]:
        """Places (rows, 2) such as `front/knee` in x and z [m], from coordinates (rows, n)."""
        values = np.asarray(self.places(coordinates.T)).T
        names = self.mechanism.points
        return {name: values[:, 2 * i : 2 * i + 2] for i, name in enumerate(names)}

    def stance(self, trajectory: Trajectory, leg: str) -> Mask:
        """In which rows (n,) the leg's foot stands: by its force, else by its height.

        A measured force is noisy: its mean over a few milliseconds must stand out. Where it does
        not, between two contacts, the foot's height tells whether it has left the ground.
        """
        if f"{leg}/foot/Fz" in trajectory:
            force, least = trajectory[f"{leg}/foot/Fz"], PRESSED * self.mechanism.weight
            if trajectory.meta.get("kind") in EXACT:
                return np.asarray(force > least)
            from kemba.identify.problem.noise import difference_sigma  # of logs only: SciPy

            calm, rows = _averaged(trajectory.time, np.nan_to_num(force))
            noise = difference_sigma(force) / np.sqrt(rows)
            pressed = np.asarray(calm > max(least, CLEAR * noise))
            height = self.height(trajectory, leg)
            if height is None:
                return pressed
            return bridged(pressed, _averaged(trajectory.time, height)[0] < STAYS)
        height = self.height(trajectory, leg)
        if height is None:
            return np.zeros(len(trajectory), dtype=bool)
        return np.asarray(height < ON_GROUND)

    def feet(self, trajectory: Trajectory) -> Trajectory | None:
        """The motion with the places of its feet and their heights above the ground [m], or None
        where columns are missing."""
        coordinates = self.coordinates(trajectory)
        if coordinates is None:
            return None
        points = self.points(coordinates)
        found: dict[str, Array] = {}
        for leg in self.mechanism.legs:
            x, z = points[f"{leg}/foot"].T
            above = z - self.mechanism.scene.ground.height(x)
            found |= {f"{leg}/foot/x [m]": x, f"{leg}/foot/z [m]": z, f"{leg}/foot/gap [m]": above}
        return trajectory.with_columns(found)

    def height(self, trajectory: Trajectory, leg: str) -> Array | None:
        """How high (n,) [m] a leg's foot is above the ground, or None where columns are missing."""
        feet = self.feet(trajectory) if leg in self.mechanism.legs else None
        return None if feet is None else gap(feet, leg)


def _averaged(time: Array, values: Array) -> tuple[Array, int]:
    """Values (n,) averaged over the moment around each row, and over how many rows."""
    reach = round(0.5 * MOMENT / float(np.median(np.diff(time)))) if len(time) > 1 else 0
    width = 2 * reach + 1
    padded = np.pad(values, reach, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid"), width


@lru_cache(maxsize=4)
def load_machine(
    model: str = "planning", supply: float | None = None, scene: Scene = FLAT
) -> Machine:
    """The robot of a model YAML (a path or a shipped model) in a scene, fed with `supply` [Pa]
    instead of the model's own pressure. Raises KembaError."""
    spec = load_spec(model)
    built = build_model(spec, supply=supply, scene=scene)
    mechanism = built.mechanism
    places = ca.Function("places", [mechanism.q], [ca.vertcat(*mechanism.points.values())])
    return Machine(mechanism.need_robot(), mechanism, _limits(built), places)


def machine_of(source: Source, model: str | None = None) -> Machine:
    """The robot of `model` (a path or a shipped model), else of the run's own task with its
    supply pressure, else the shipped one. Raises KembaError."""
    task = source.path.with_name("task.yaml") if source.path else None
    found = task is not None and task.is_file()
    data = load_yaml(task).data if task is not None and found else None
    asked = data if isinstance(data, dict) else {}
    scene = scene_in(asked or source.trajectory.meta, str(task or source.name))
    if model is not None or not found:
        return load_machine(model or "planning", scene=scene)
    supply = to_si(asked["supply"], "Pa") if "supply" in asked else None
    return load_machine(asked.get("model", "planning"), supply, scene)


def stance_spans(source: Source, machine: Machine, leg: str) -> list[tuple[float, float]]:
    """When the leg's foot is on the ground; any foot for `body`. Start and end in s."""
    legs = machine.mechanism.legs if leg == "body" else (leg,)
    stands = [machine.stance(source.trajectory, name) for name in legs]
    return source.spans(np.any(stands, axis=0))


def _limits(model: Model) -> dict[str, tuple[float, ...]]:
    """Stroke, peak torque and steady chamber forces, as far as the model has them."""
    known: dict[str, tuple[float, ...]] = {"piston/x": (0.0, model.mechanism.stroke)}
    for (_, symbol), quantity in model.inputs.items():
        if symbol == "tau":
            known["hip/tau"] = (quantity.lower, quantity.upper)
    for effect in model.effects:
        if isinstance(effect, Chamber):
            steady = (float(at_supply(effect, name, model.supply)) for name in STEADY)
            known["chamber/F"] = tuple(steady)
    return known
