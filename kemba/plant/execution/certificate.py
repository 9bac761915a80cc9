"""How well a plan executes: its inputs and its table on the same model, its table on the plant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.plant.execution.controller import execute
from kemba.plant.execution.impacts import told
from kemba.plant.execution.replay import LandingSettings, Replay, ends_standing, replay
from kemba.trajectory import Trajectory

PLANT = "plant"


def replays(
    model: Model, plan: Trajectory, controller: Trajectory, plant: str | Model | None = PLANT
) -> dict[str, Any]:
    """The entries `replay`, `table_replay`, `plant_replay` and `impacts` of the certificate.

    `replay` plays the inputs of the plan on its own model, `table_replay` the controller's table
    through eq. 10 and the dead time on the same model, `plant_replay` that table on the plant.

    With the table a plan that ends standing, with its valves closed, has a moment to come to rest
    before its landing is judged. `impacts` are those of `replay`. `plant_replay` is None without a plant; any is None where a
    plan that was not solved cannot even be started.
    """
    full = load_model(plant) if isinstance(plant, str) else plant
    rest = rest_after(model, plan, controller)
    own = _tried(lambda: replay(model, plan))
    table = _tried(lambda: execute(controller, model, extra=rest).against(model, plan))
    real = full and _tried(lambda: execute(controller, full, extra=rest).against(full, plan))
    return {
        "replay": own and own.summary(),
        "table_replay": table and table.summary(),
        "plant_replay": real and real.summary(),
        "impacts": own and told(model, own.impacts),
    }


def rest_after(model: Model, plan: Trajectory, controller: Trajectory) -> float:
    """For how long [s] the last commands are held: a plan that ends standing may come to rest."""
    rests = ends_standing(model, plan) and _closed(controller)
    return LandingSettings.current().settle if rests else 0.0


def _closed(controller: Trajectory) -> bool:
    """Whether the last command leaves every valve closed: an open one would keep it moving."""
    return not any(controller[name][-1] for name in controller.names if "/valve/" in name)


def _tried(attempt: Callable[[], Replay]) -> Replay | None:
    try:
        return attempt()
    except KembaError:
        return None
