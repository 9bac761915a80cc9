"""A bench piston whose motion is imposed: only the force of the air is computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from kemba.errors import KembaError
from kemba.model import Model
from kemba.model.rest import at_rest
from kemba.plant.simulation.commands import Profile
from kemba.plant.simulation.inputs import among, breaks, input_table, merged
from kemba.plant.simulation.valves import delayed
from kemba.plant.stepping.arrays import Array
from kemba.plant.stepping.equations import Equations
from kemba.plant.stepping.family import equations_of
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Trajectory

ImposedMotion = Callable[[Array], tuple[Array, Array]]  # times (m,) -> x [m], v [m/s]


class ImposedSettings(Settings):
    """The simulation of a piston whose motion is imposed."""

    step: float = setting(2e-4, "s", "longest step of the air", CHOSEN)


def drive(
    model: Model,
    motion: ImposedMotion,
    valves: Mapping[str, Profile],
    times: Array,
    start: Mapping[str, float] | None = None,
    step: float | None = None,
    dead_time: bool = True,
) -> Trajectory:
    """The force of a bench piston moved as `motion` says, sampled at `times` (m,) [s].

    `valves` are commands as sent, by column name; effect states begin at `start` or at what they
    come to at rest with the first commands. Raises KembaError when the model's motion is free.
    """
    if not model.mechanism.imposed:
        raise KembaError(
            model.name, "its motion is free", hint="use kemba.plant.simulation.simulate"
        )
    step = ImposedSettings.current().step if step is None else step
    acting = delayed(model, dict(valves)) if dead_time else dict(valves)
    eq, first, last = equations_of(model), float(times[0]), float(times[-1])
    edges = breaks([*acting.values(), *valves.values()], first, last)
    marks = merged(np.asarray(times, dtype=float), edges)
    wanted = among(marks, times)
    u, sent = (np.nan_to_num(input_table(model, p, marks)) for p in (acting, valves))
    s = at_rest(model, motion(times[:1])[0], u[0]) if start is None else _given(model, start)
    rows = []
    for i, time in enumerate(marks):
        if i:
            s = _advance(eq, motion, s, u[i - 1], float(marks[i - 1]), float(time), step)
        if wanted[i]:
            rows.append(_row(eq, motion, s, u[i], sent[i], float(time)))
    return _table(model, eq, np.asarray(times, dtype=float), np.array(rows))


def _advance(
    eq: Equations, motion: ImposedMotion, s: Array, u: Array, begin: float, end: float, step: float
) -> Array:
    count = max(1, int(np.ceil((end - begin) / step - 1e-6)))
    grid = np.linspace(begin, end, count + 1)
    x, v = motion(grid)
    for i in range(count):
        s = eq.driven(q=x[i], v=v[i], s=s, u=u, q1=x[i + 1], v1=v[i + 1], h=(end - begin) / count)[
            "s"
        ].copy()
    return s


def _given(model: Model, start: Mapping[str, float]) -> Array:
    return np.array([start.get(q.name, q.value) for q in model.states.values()], dtype=float)


def _row(
    eq: Equations, motion: ImposedMotion, s: Array, u: Array, sent: Array, time: float
) -> Array:
    x, v = motion(np.array([time]))
    y = eq.measure(q=x[0], v=v[0], a=0.0, s=s, sd=0.0, lam=0.0, u=u)["y"]
    return np.concatenate([s, sent, y])


def _table(model: Model, eq: Equations, times: Array, rows: Array) -> Trajectory:
    quantities = [*model.states.values(), *model.inputs.values(), *eq.node.output_quantities]
    columns: dict[str, Array] = {}
    for i, quantity in enumerate(quantities):
        columns.setdefault(quantity.header, rows[:, i])
    return Trajectory(times, columns)


def locked(x: float) -> ImposedMotion:
    """A rod held at `x` [m]."""
    return lambda t: (np.full(len(t), x), np.zeros(len(t)))


def stroke(begin: float, speed: float, after: float, ramp: float, stop: float) -> ImposedMotion:
    """A stroke: at rest at `begin` [m] until `after` [s], then moved at `speed` [m/s] to `stop`
    [m].

    The speed is reached within `ramp` [s]. Raises KembaError where the way is too short for it.
    """
    acceleration = speed / ramp
    reach = begin + 0.5 * acceleration * ramp**2

    def motion(t: Array) -> tuple[Array, Array]:
        late = np.clip(t - after, 0.0, None)
        up = np.minimum(late, ramp)
        x = begin + 0.5 * acceleration * up**2 + speed * (late - up)
        over = (x - stop) * np.sign(speed) > 0.0
        return np.where(over, stop, x), np.where(over, 0.0, acceleration * up)

    if (stop - reach) * np.sign(speed) <= 0.0:
        raise KembaError("rig", f"the stroke is too short for {speed:g} m/s")
    return motion


def hermite(knots: Array, x: Array, v: Array) -> ImposedMotion:
    """Cubic pieces through positions `x` and speeds `v` (k,) at the times `knots` (k,)."""
    from scipy.interpolate import CubicHermiteSpline

    spline = CubicHermiteSpline(knots, x, v)
    rate = spline.derivative()
    return lambda t: (spline(t), rate(t))


def monotone(knots: Array, x: Array) -> ImposedMotion:
    """A way through the positions `x` (k,) at the times `knots` (k,) that never overshoots them.

    Where it turns round, and at both ends, it rests for a moment.
    """
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

    v = PchipInterpolator(knots, x)(knots, 1)
    v[[0, -1]] = 0.0
    spline = CubicHermiteSpline(knots, x, v)
    rate = spline.derivative()

    def motion(t: Array) -> tuple[Array, Array]:
        inside = np.clip(t, knots[0], knots[-1])
        return spline(inside), rate(inside)

    return motion


def followed(log: Trajectory) -> ImposedMotion:
    """The motion of a bench log; its speed is the log's where it has one."""
    x = log["piston/x"]
    v = log["piston/v"] if "piston/v" in log else np.gradient(x, log.time)
    return hermite(log.time, x, v)
