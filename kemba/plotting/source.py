"""Motions to draw: where they come from, the robot they are of, its poses."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from kemba.config import load_yaml
from kemba.effects.pneumatics.chamber import STEADY, Chamber, at_supply
from kemba.errors import KembaError
from kemba.events import (
    EXECUTED,
    MEASURED,
    PLANNED,
    STAYS,
    ContactCourse,
    Span,
    bend,
    bridged,
    contacts,
    gap,
    read,
    runs,
)
from kemba.logs import Columns, is_log_file, map_of, open_log
from kemba.mechanism import Mechanism, Robot, knee
from kemba.model import Model, build_model, load_spec
from kemba.quantity import to_si
from kemba.scene import FLAT, Scene, scene_in
from kemba.trajectory import Array, Trajectory

PLAN_FILE, MOVIES = "trajectory.csv", (".gif", ".mp4")
Mask = np.ndarray[Any, np.dtype[np.bool_]]

HIDDEN = ("controller", "simulation")  # file names that need their folder to be clear


@dataclass(frozen=True)
class Source:
    """A trajectory to plot.

    `plan`: row k of a command or contact force acts on the interval before it, as in implicit
    Euler; otherwise (a log, a simulation) it holds from its row until the next.
    """

    name: str
    trajectory: Trajectory
    plan: bool = False
    path: Path | None = None

    @property
    def bench(self) -> bool:
        """Whether it comes from a rig rather than from a robot."""
        kind = self.trajectory.meta.get("kind")
        known = any(name in self.trajectory for name in ("piston/x", "axis/q", "vessel/P"))
        return kind in ("bench", "cylinder", "drive", "vessel") or (kind is None and known)

    def held(self, name: str) -> Array:
        """The column (n,) of a command, in its unit, as it is drawn.

        The first row of a plan acts on no interval; it shows the value of the second.
        """
        values = self.trajectory[name]
        return np.concatenate([values[1:2], values[1:]]) if self.plan else values

    def spans(self, active: Mask) -> list[tuple[float, float]]:
        """Start and end [s] of every time in which the rows `active` (n,) hold without a break."""
        time = self.trajectory.time
        on = active[1:] if self.plan else active[:-1]
        return [(time[a], time[b]) for a, b in runs(on.astype(bool))]


def load_source(path: str | Path, columns: Columns = None) -> Source:
    """The plan in a run folder, or the trajectory in a log file; `columns` maps foreign columns.
    Raises KembaError."""
    path = Path(path)
    file = path / PLAN_FILE if path.is_dir() and not is_log_file(path) else path
    if not file.exists():
        what = f"has no {PLAN_FILE}" if path.is_dir() else "no such file or folder"
        runs = ", ".join(str(found.parent) for found in sorted(Path("runs").glob(f"*/{PLAN_FILE}")))
        expected = "a run folder or a log was expected"
        raise KembaError(str(path), what, expected, f"runs here: {runs}" if runs else "")
    trajectory = open_log(file, map_of(columns), strict=columns is None)
    if len(trajectory) < 2:
        raise KembaError(str(file), "has one row only", "at least two were expected")
    kind = trajectory.meta.get("kind")  # rows are nodes of a plan by it, else by the file's name
    return Source(_name(file), trajectory, kind == "plan" if kind else file.name == PLAN_FILE, file)


def load_sources(paths: Iterable[str | Path], columns: Columns = None) -> list[Source]:
    """The runs and logs at `paths`, with names that differ; `columns`: a map for these logs."""
    columns = map_of(columns)  # once for all
    sources = [load_source(path, columns) for path in paths]
    counts = Counter(source.name for source in sources)
    return [
        replace(source, name=str(path)) if counts[source.name] > 1 else source
        for source, path in zip(sources, paths, strict=True)
    ]


def default_path(sources: Sequence[Source]) -> Path:
    """Where a figure without a name goes: into the first one's run folder, or beside its CSV."""
    file = sources[0].path or Path(PLAN_FILE)
    if len(sources) > 1:
        return file.with_name("overlay.png")
    return file.with_name("figure.png") if file.name == PLAN_FILE else file.with_suffix(".png")


def _name(file: Path) -> str:
    folder = file.resolve().parent.name
    if file.name == PLAN_FILE:
        return folder or file.stem
    return f"{folder} {file.stem}" if file.stem in HIDDEN else file.stem


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

    def course(self, motion: Trajectory) -> ContactCourse:
        """Its contacts and flights: of an exact motion as it is judged, else as `measured`."""
        legs, kind = self.mechanism.legs, motion.meta.get("kind")
        if kind in (None, *EXACT) and all(f"{leg}/foot/z" in motion for leg in legs):
            reading = EXECUTED if kind == "simulation" else PLANNED
            return read(motion, reading, self.mechanism.weight)
        return self.measured(motion)

    def measured(self, motion: Trajectory) -> ContactCourse:
        """The contacts and flights of a motion, exact or not, as a log tells them: feet stand by
        force and height, and come down where their height bends."""
        found: dict[str, list[Span]] = {}
        for leg in self.mechanism.legs:
            spans = contacts(motion.time, np.where(self.stance(motion, leg), 0.0, 1.0), PLANNED)
            height = self.height(motion, leg)
            if height is not None:
                begins = [bend(motion.time, height, span.begin) for span in spans]
                spans = [replace(s, begin=b) for s, b in zip(spans, begins, strict=True)]
            found[leg] = spans
        return ContactCourse(motion, motion.time, found, MEASURED)

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


CYLINDER = 0.125  # m, how long a cylinder's body is drawn

Rows = np.ndarray[Any, np.dtype[np.intp]]


@dataclass(frozen=True)
class Pose:
    """The robot at one time: `points` (2,) by name [m], per leg its valves and contact."""

    time: float
    points: dict[str, Array]
    valves: dict[str, tuple[int, int]]
    stands: dict[str, bool]

    @property
    def centre(self) -> Array:
        """Middle of the hips (2,), which is the body's centre."""
        hips = [place for name, place in self.points.items() if name.endswith("/hip")]
        return np.array(np.mean(hips, axis=0))


def poses(source: Source, machine: Machine, times: Array) -> list[Pose]:
    """The robot at `times` (m,), in s; none when the trajectory lacks the columns for it."""
    coordinates = machine.coordinates(source.trajectory)
    if coordinates is None:
        return []
    known = np.isfinite(coordinates).all(axis=1)
    if not known.any():
        return []
    clock = source.trajectory.time[known]
    smooth = np.column_stack([np.interp(times, clock, c) for c in coordinates[known].T])
    points = machine.points(smooth)
    rows = _rows(source, times)
    legs = machine.mechanism.legs
    stands = {leg: machine.stance(source.trajectory, leg)[rows] for leg in legs}
    valves = {leg: _valves(source, leg, rows) for leg in legs}
    return [
        Pose(
            float(time),
            {name: place[i] for name, place in points.items()},
            {leg: (int(valves[leg][i, 0]), int(valves[leg][i, 1])) for leg in legs},
            {leg: bool(stands[leg][i]) for leg in legs},
        )
        for i, time in enumerate(times)
    ]


def _rows(source: Source, times: Array) -> Rows:
    """The rows whose commands and contact forces act at `times`."""
    clock = source.trajectory.time
    if source.plan:
        return np.clip(np.searchsorted(clock, times, side="left"), 1, len(clock) - 1)
    return np.clip(np.searchsorted(clock, times, side="right") - 1, 0, len(clock) - 1)


def _valves(source: Source, leg: str, rows: Rows) -> Mask:
    """Extend and retract valve (rows, 2), 0 or 1; off where it is not recorded."""
    switched = np.zeros((len(rows), 2), dtype=bool)
    for column, side in enumerate(("extend", "retract")):
        name = f"{leg}/valve/{side}"
        if name in source.trajectory:
            switched[:, column] = source.trajectory[name][rows] > 0.5
    return switched
