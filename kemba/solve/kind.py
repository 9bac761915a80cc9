"""What tasks must have in common so that a plan of one can begin the other, and how far apart they
are then."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from typing import Any

from kemba.model import Model
from kemba.ocp.task.height import longest_leg, with_height
from kemba.ocp.task.task import Task

# Numbers by which tasks of one kind differ.
FIGURES = ("height", "distance", "supply", "payload", "duration")
# What says how a plan is made, named or judged, but not what is asked of it.
APART = (
    *("language", "name", "notes", "model", "plant", "effects", "nodes", "hold", "robust"),
    *("uncertainties", "grip", "feet", "guess", "guess_noise", "seed", "solver", "tolerances"),
)
LETTERS = 12  # of a fingerprint
NEAR = 0.2  # of the scale of every figure: a continued plan takes one to three steps so far


def kind_of(task: Task, model: Model) -> str:
    """A fingerprint of everything but the figures: what is asked, of which robot and effects.

    Payload and supply pressure are figures; any other parameter of an effect is part of the kind.
    `grip` is none: a plan with it meets a task that does not ask for it, and one without gets it
    when it is continued.
    """
    apart = dict.fromkeys((*FIGURES, *APART), True)
    dumped = task.model_dump(mode="json", exclude=apart, exclude_none=True, by_alias=True)
    asked = {key: value for key, value in dumped.items() if value != []}
    robot = model.mechanism.robot
    physics = {
        "robot": robot.model_dump(mode="json") if robot is not None else model.mechanism.name,
        "effects": sorted(
            _text({"kind": e.kind, **e.model_dump(mode="json")})
            for e in model.effects
            if e.kind != "payload"
        ),
    }
    return sha256(_text([asked, physics]).encode()).hexdigest()[:LETTERS]


def figures_of(task: Task, model: Model) -> dict[str, float]:
    """The figures of a task; those that it does not have are left out."""
    asked = with_height(task, model)
    values = {**{name: getattr(asked, name) for name in FIGURES}, "supply": model.supply}
    return {name: float(value) for name, value in values.items() if value is not None}


def distance(model: Model, asked: Mapping[str, float], there: Mapping[str, float]) -> float:
    """The largest difference of two tasks' figures: lengths by the stretched leg, payload by the
    robot's mass, others by themselves; infinite where one task lacks a figure of the other."""
    if asked.keys() != there.keys():
        return float("inf")
    robot = model.mechanism.need_robot()
    leg, mass = longest_leg(robot), model.mechanism.weight / robot.gravity
    scales = {**asked, "height": leg, "distance": leg, "payload": mass}
    return max(abs(asked[name] - there[name]) / scales[name] for name in asked)


def _text(data: Any) -> str:
    return json.dumps(data, sort_keys=True, default=str)
