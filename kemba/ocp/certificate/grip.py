"""How much of the ground's friction a plan needs where its feet stick."""

from __future__ import annotations

import numpy as np

from kemba.effects.mechanics.contact import Contact
from kemba.model import Model
from kemba.settings import Settings, setting
from kemba.trajectory import Trajectory


class GripSettings(Settings):
    """Which feet count."""

    loaded: float = setting(
        1e-3,
        "1",
        "least load, of the weight or its impulse in a second",
        "convention: a thousandth",
    )
    slides: float = setting(
        1e-4, "m.s-1", "speed at which a foot slides and uses all its friction by itself",
        "convention: below what a plan's tolerance lets sticking feet do",
    )  # fmt: skip


def grip_of(model: Model, plan: Trajectory) -> float | None:
    """The largest share of the friction cone, 0 to 1, that sticking feet and impacts need in
    a plan; None on another ground, or where there is no load."""
    ground = next((e for e in model.effects if isinstance(e, Contact)), None)
    if ground is None or not ground.mu:
        return None
    shares, settings = [], GripSettings.current()
    for leg in model.mechanism.legs:
        for along, normal in (("Fx", "Fz"), ("impulse_x", "impulse_z")):
            names = [f"{leg}/foot/{name}" for name in (along, normal)]
            if not all(name in plan for name in names):
                continue
            push, load = (plan[name] for name in names)
            on = load > settings.loaded * model.mechanism.weight
            if f"{leg}/foot/slip" in plan:
                on &= plan[f"{leg}/foot/slip"] < settings.slides
            x = plan.get(f"{leg}/foot/x", np.zeros(len(plan)))
            mu = np.broadcast_to(model.mechanism.scene.ground.friction(x, ground.mu), x.shape)
            shares += [np.abs(push[on]) / (mu[on] * load[on])]
    used = np.concatenate(shares) if shares else np.array([])
    return float(used.max()) if len(used) else None
