"""Motions that several tests look at: a drop, a jump-like script, a robot in the air."""

from functools import cache, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from kemba.model import Model, load_model
from kemba.plant.commands import Commands, Profile, Sense
from kemba.plant.equations import equations_of
from kemba.plant.simulate import Simulated, run

FEMUR, TIBIA = 0.242, 0.234  # m
AIRBORNE = {
    "body/z": 0.9,
    "body/pitch_rate": 0.6,
    "body/vx": 0.4,
    "body/vz": 0.5,
    "front/piston/x": 0.03,
    "rear/piston/x": 0.02,
    "front/hip/w": 3.0,
    "rear/hip/w": -2.0,
}


@cache
def planning() -> Model:
    return load_model("planning")


@lru_cache(maxsize=4)
def parts(model: Model) -> ca.Function:
    eq = equations_of(model)
    node = eq.node
    return ca.Function("parts", [node.q, node.v, node.s, node.u, node.p], [*eq.parts])


def affine(model: Model, *state: Any) -> list[np.ndarray]:
    """M (n, n), F (n, 1), B (n, nl) and f (ns, 1) of the plant's model at a state q, v, s, u."""
    found = parts(model)(*state, equations_of(model).values(model))
    return [np.array(part) for part in found]


def under_the_hips(time: float, sense: Sense) -> dict[str, float]:
    """Hip torques [N.m] that keep each foot under its hip and the body level."""
    torques = {}
    for leg, fold in (("front", 1.0), ("rear", -1.0)):
        bend = fold * sense[f"{leg}/knee/q"]
        wanted = -fold * np.arctan2(TIBIA * np.sin(bend), FEMUR + TIBIA * np.cos(bend))
        torque = 150.0 * (wanted - sense[f"{leg}/hip/q"]) - 3.0 * sense[f"{leg}/hip/w"]
        torque += 30.0 * sense["body/pitch"] + sense["body/pitch_rate"]
        torques[f"{leg}/hip/tau"] = float(np.clip(torque, -24.8, 24.8))
    return torques


@cache
def jump(model: Model | None = None, step: float | None = 1e-4, duration: float = 0.5) -> Simulated:
    """A push with both extend valves, the rear one 4 ms longer, and the flight after it."""
    valves = {
        "front/valve/extend": Profile.pulses((0.02, 0.20)),
        "rear/valve/extend": Profile.pulses((0.02, 0.204)),
    }
    return run(model or planning(), {}, Commands(valves, under_the_hips), duration, step)


@cache
def drop(model: Model | None = None, step: float | None = 1e-4, duration: float = 0.3) -> Simulated:
    """Half folded legs, a little tilted, dropped from a hand's breadth."""
    start = {"body/z": 0.42, "body/pitch": 0.03, "front/piston/x": 0.03, "rear/piston/x": 0.03}
    return run(model or planning(), start, None, duration, step)
