"""What tasks must have in common so that a plan of one can begin the other."""

from __future__ import annotations

import json
from hashlib import sha256
from typing import Any

from kemba.model import Model
from kemba.ocp.task.height import with_height
from kemba.ocp.task.task import Task

# Numbers by which tasks of one kind differ.
FIGURES = ("height", "distance", "supply", "payload", "duration")
# What says how a plan is made, named or judged, but not what is asked of it.
APART = (
    *(
        "language",
        "name",
        "notes",
        "model",
        "plant",
        "effects",
        "nodes",
        "hold",
        "robust",
        "uncertainties",
    ),
    *("grip", "feet", "guess", "guess_noise", "seed", "solver", "tolerances"),
)
LETTERS = 12  # of a fingerprint


def kind_of(task: Task, model: Model) -> str:
    """A fingerprint of everything but the figures: what is asked, of which robot and effects.

    Payload and supply pressure are figures; any other parameter of an effect is part of the kind.
    `grip` is none: a plan with it meets a task that does not ask for it, and one without gets it
    when it is continued.
    """
    apart = dict.fromkeys((*FIGURES, *APART), True)
    dumped = task.model_dump(mode="json", exclude=apart, exclude_none=True)
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


def as_asked_by(shipped: Task, task: Task) -> Task:
    """What a shipped task asks, with the robot, figures and cost of another."""
    asked = set(Task.model_fields) - {*FIGURES, *APART, "cost"}
    return task.model_copy(update={name: getattr(shipped, name) for name in asked})


def figures_of(task: Task, model: Model) -> dict[str, float]:
    """The figures of a task; those that it does not have are left out."""
    asked = with_height(task, model)
    values = {**{name: getattr(asked, name) for name in FIGURES}, "supply": model.supply}
    return {name: float(value) for name, value in values.items() if value is not None}


def _text(data: Any) -> str:
    return json.dumps(data, sort_keys=True, default=str)
