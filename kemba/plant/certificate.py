"""What a plan is worth: its replay on the same model, and its execution on the full plant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.plant.controller import execute
from kemba.plant.replay import Replay, replay
from kemba.trajectory import Trajectory

PLANT = "plant"


def replays(
    model: Model, plan: Trajectory, controller: Trajectory, plant: str | Model | None = PLANT
) -> dict[str, Any]:
    """The entries `replay` and `plant_replay` of the certificate.

    The latter is None without a plant; either is None where a plan that was not solved cannot
    even be started.
    """
    full = load_model(plant) if isinstance(plant, str) else plant
    return {
        "replay": _tried(lambda: replay(model, plan)),
        "plant_replay": full and _tried(lambda: execute(controller, full).against(full, plan)),
    }


def _tried(attempt: Callable[[], Replay]) -> dict[str, Any] | None:
    try:
        return attempt().summary()
    except KembaError:
        return None


def sentence(found: Replay | dict[str, Any]) -> str:
    """A replay in words: `replay reaches 3.2 mm above the plan and lands 1.5 ms late`."""
    facts: dict[str, Any] = found.summary() if isinstance(found, Replay) else found
    apex, late = 1e3 * facts["apex_error_m"], facts["touchdown_error_s"]
    text = f"replay reaches {abs(apex):.1f} mm {'above' if apex >= 0 else 'below'} the plan"
    if late is not None:
        text += f", touches down {abs(1e3 * late):.1f} ms {'late' if late >= 0 else 'early'}"
        text += " and lands" if facts["landed"] else " and falls"
    return text
