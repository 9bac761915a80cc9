"""The state a simulation starts from, given by column names."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from kemba.errors import KembaError, suggest
from kemba.model import Model
from kemba.plant.stepping.arrays import Array
from kemba.settings import CHOSEN, Settings, setting


class KneeSearch(Settings):
    """Newton's method for the knee angle that belongs to a piston's place."""

    place: float = setting(
        1e-12, "m", "error of the piston at which it ends", "derived: far below any sensor"
    )
    turn: float = setting(0.3, "rad", "largest change of the angle at once", CHOSEN)
    rounds: int = setting(50, "1", "changes at most", CHOSEN)


def initial_values(model: Model, values: Mapping[str, float]) -> tuple[Array, Array, Array]:
    """Coordinates (n,), velocities (n,) and effect states (ns,) with the `values` by column name.

    What is missing stands as in the standing pose, at rest, effect states at their nominal value;
    without `body/z` the lower foot is put on the ground. `LEG/piston/x` may stand for
    `LEG/knee/q`. Raises KembaError on unknown names.
    """
    mechanism = model.mechanism
    coordinates = [c.name for c in mechanism.coordinates]
    velocities = [c.name for c in mechanism.velocities]
    states = [quantity.name for quantity in model.states.values()]
    pistons = {f"{leg}/piston/x": f"{leg}/knee/q" for leg in mechanism.legs}
    known = {*coordinates, *velocities, *states, *pistons}
    for name in values:
        if name not in known:
            raise KembaError("initial", f"no state '{name}'", hint=suggest(name, known))
    start = dict(mechanism.standing)
    for piston, knee in pistons.items():
        if piston in values and knee not in values:
            start[knee] = _knee(model, piston, knee, values[piston])
    start.update(values)
    q = np.array([start.get(name, 0.0) for name in coordinates])
    if "body/z" in coordinates and "body/z" not in values:
        q[coordinates.index("body/z")] -= _lowest_foot(model, q)
    v = np.array([values.get(name, 0.0) for name in velocities])
    s = np.array([values.get(x.name, x.value) for x in model.states.values()], dtype=float)
    return q, v, s


def lowest_foot(model: Model, values: Mapping[str, float]) -> float:
    """Height [m] of the lowest foot above its ground in the pose of `initial_values`.

    Raises KembaError likewise.
    """
    return _lowest_foot(model, initial_values(model, values)[0])


def _lowest_foot(model: Model, q: Array) -> float:
    """Height [m] of the lowest foot above its ground at coordinates q (nq,)."""
    mechanism = model.mechanism
    ground, port = mechanism.scene.ground, mechanism.port
    places = [[port(f"{leg}/foot/{axis}").phi for axis in "xz"] for leg in mechanism.legs]
    feet = [z - ground.height(x) for x, z in places]
    height = ca.Function("feet", [mechanism.q], [ca.mmin(ca.vertcat(*feet))])
    return float(height(q))


def _knee(model: Model, piston: str, knee: str, x: float) -> float:
    """The knee angle [rad] at a piston extension x [m], by Newton from the retracted pose."""
    mechanism = model.mechanism
    index = [c.name for c in mechanism.coordinates].index(knee)
    symbol, phi = mechanism.q[index], mechanism.port(piston).phi
    extension = ca.Function("extension", [symbol], [phi, ca.jacobian(phi, symbol)])
    angle = mechanism.standing[knee]
    settings = KneeSearch.current()
    for _ in range(settings.rounds):
        now, slope = (float(value) for value in extension(angle))
        angle -= float(np.clip((now - x) / slope, -settings.turn, settings.turn))
        if abs(now - x) < settings.place:
            return angle
    raise KembaError("initial", f"{piston} = {x:g} m cannot be reached")
