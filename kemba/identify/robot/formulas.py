"""Simple force terms beyond the catalogue on rods, hips and body, as columns of residual."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kemba.effects.mechanics.friction import V_COULOMB
from kemba.identify.doubt.force_terms import dahl, end_terms
from kemba.identify.problem.types import Array
from kemba.identify.robot.force_channels import force_columns
from kemba.identify.robot.state import LinearisedState


class RobotFormulaSettings:
    """Constants of the simple force terms that are tried on robots."""

    speed = 0.1  # speed over which friction at a hip turns round [rad.s-1]
    creeps = (0.003, 0.006, 0.012)  # travel over which a hysteresis turns round [m]
    ripples = (6, 8, 10, 12, 14, 16, 18, 20, 24)  # ripples of a motor per turn of the hip
    ropes = (0.26, 0.28, 0.30, 0.32, 0.35)  # heights from which a cable pulls [m]


def formula_columns(state: LinearisedState) -> dict[str, Array]:
    """Columns (rows,) per unit of the coefficient, by the formula a model's YAML would hold."""
    y, rate = state.motion.y, state.motion.rate
    legs, stroke = len(state.physics.legs), state.physics.mechanism.stroke
    hips, rods = slice(3, 3 + legs), slice(3 + legs, 3 + 2 * legs)
    groups = (
        (range(3 + legs, 3 + 2 * legs), "rods", rod_terms(y[..., rods], rate[..., rods], stroke)),
        (range(3, 3 + legs), "hips", hip_terms(y[..., hips], rate[..., hips], state.batch.torque)),
        ([1], "body z", body_terms("z", y[..., [1]], rate[..., [1]])),
        ([0], "body x", drag_terms("x", rate[..., [0]])),
    )
    found: dict[str, Array] = {}
    for channels, name, terms in groups:
        listed = list(terms)
        columns = force_columns(state, channels)(np.stack([f for _, f in listed], axis=-1))
        found |= {f"{t} [{name}]": c for (t, _), c in zip(listed, columns.T, strict=True)}
    return found


def rod_terms(x: Array, v: Array, stroke: float) -> Iterator[tuple[str, Array]]:
    """(formula, force on the rod (n, L, legs)) of extension and its rate; `stroke` [m]."""
    sign = np.tanh(v / V_COULOMB)
    yield from end_terms(x, stroke)
    yield f"{stroke / 2:g} - x", stroke / 2 - x
    yield f"(x - {stroke / 2:g})**3", (x - stroke / 2) ** 3
    yield "max(v, 0)", np.maximum(v, 0.0)
    yield "min(v, 0)", np.minimum(v, 0.0)
    yield "v**3", v**3
    yield f"max(tanh(v/{V_COULOMB:g}), 0)", np.maximum(sign, 0.0)
    yield f"tanh(v/{V_COULOMB:g})*x", sign * x
    for travel in RobotFormulaSettings.creeps:
        paths = x.reshape(len(x), -1).T
        turned = np.stack([dahl(path, travel) for path in paths], axis=1)
        yield f"dahl(x, {travel:g})", turned.reshape(x.shape)


def hip_terms(q: Array, w: Array, torque: Array) -> Iterator[tuple[str, Array]]:
    """(formula, torque at the hip (n, L, legs)) of angle, rate and the torque commanded."""
    settings = RobotFormulaSettings
    sign = np.tanh(w / settings.speed)
    for n in settings.ripples:
        yield f"sin({n}*q)", np.sin(n * q)
    yield f"abs(tau)*tanh(w/{settings.speed:g})", np.abs(torque) * sign
    yield "w*abs(w)", w * np.abs(w)
    yield "tau**3", torque**3
    yield "max(w, 0)", np.maximum(w, 0.0)


def body_terms(name: str, at: Array, v: Array) -> Iterator[tuple[str, Array]]:
    """(formula, force on the body (n, L, 1)) along one axis."""
    yield from drag_terms(name, v)
    for height in RobotFormulaSettings.ropes:
        yield f"max({name} - {height:g}, 0)", np.maximum(at - height, 0.0)


def drag_terms(name: str, v: Array) -> Iterator[tuple[str, Array]]:
    """(formula, force on the body (n, L, 1)) of its velocity alone."""
    yield f"v{name}*abs(v{name})", v * np.abs(v)
    yield f"v{name}**3", v**3
