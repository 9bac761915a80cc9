"""How well a plan executes: its inputs and its table on the same model, its table on the plant."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.events import ends_standing
from kemba.model import Model, load_model
from kemba.plant.execution.controller import execute
from kemba.plant.execution.impacts import told
from kemba.plant.execution.replay import Replay, replay
from kemba.plant.execution.start import begins_moving, moving_start
from kemba.stopwatch import Stage, Tell, silent
from kemba.trajectory import Array, Trajectory

PLANT = "plant"
POINTS = re.compile(r".*/(hip|knee)/(x|z|vx|vz)")
DIGITS = 7
SETTLE = 0.3  # s; the last commands are held so long before a landing is judged


def replays(
    model: Model, plan: Trajectory, controller: Trajectory, plant: str | Model | None = PLANT
) -> dict[str, Any]:
    """The entries `replay`, `table_replay`, `plant_replay` and `impacts` of the certificate.

    `replay` plays the inputs of the plan on its own model, `table_replay` the controller's table
    through eq. 10 and the dead time on the same model, `plant_replay` that table on the plant.

    With the table a plan that ends standing, with its valves closed, has a moment to come to rest
    before its landing is judged. `impacts` are those of `replay`. `plant_replay` is None without
    a plant; any is None where a plan that was not solved cannot even be started.
    """
    return summaries(model, executions(model, plan, controller, plant))


def executions(
    model: Model,
    plan: Trajectory,
    controller: Trajectory,
    plant: str | Model | None = PLANT,
    tell: Tell = silent,
    table: Replay | None = None,
) -> dict[str, Replay | None]:
    """What `replays` sums up, with the motions. `tell` gets the name of each execution; `table` is
    that of the controller's table on `model`, where it was executed before."""
    full = load_model(plant) if isinstance(plant, str) else plant
    rest = rest_after(model, plan, controller)

    moving = begins_moving(model, plan)

    def on(machine: Model) -> Replay | None:
        def executed() -> Replay:
            start = moving_start(machine, plan) if moving else None
            return execute(controller, machine, extra=rest, start=start).against(machine, plan)

        return _tried(executed)

    tell(Stage("replay: the plan's inputs", 1, 3))
    own = _tried(lambda: replay(model, plan))
    tell(Stage("replay: controller.csv", 2, 3))
    table = table or on(model)
    tell(Stage("replay: controller.csv on the simulated robot", 3, 3))
    return {"replay": own, "table_replay": table, "plant_replay": on(full) if full else None}


def summaries(model: Model, done: Mapping[str, Replay | None]) -> dict[str, Any]:
    """Executions as the certificate has them, with the impacts of the first."""
    own = done["replay"]
    figures = {name: found.summary() if found else None for name, found in done.items()}
    return {**figures, "impacts": told(model, own.impacts) if own else None}


def plant_run(done: Replay) -> Trajectory:
    """The motion of the plant for the run folder, in the plan's clock.

    The places of hips and knees follow from the joints and are left out; seven digits are kept.
    `meta` has all impacts: when [s], at which contacts and stops, the energy lost [J].
    """
    t = done.trajectory
    kept = t.select(name for name in t.names if not POINTS.fullmatch(name))
    columns = {h: _digits(kept[n]) for h, n in zip(kept.headers, kept.names, strict=True)}
    impacts = [
        {"time_s": round(i.time, 6), "what": list(i.labels), "energy_J": round(i.lost, 6)}
        for i in done.impacts
    ]
    meta = {"kind": "simulation", "impacts": impacts}
    return Trajectory(np.round(kept.time, 9), columns, meta)


def _digits(values: Array) -> Array:
    """Values (n,) with seven digits, which halves the file."""
    size = np.floor(np.log10(np.maximum(np.abs(values), np.finfo(float).tiny)))
    shift = 10.0 ** np.minimum(np.abs(DIGITS - 1 - size), 300.0)
    fine = size < DIGITS  # powers of ten are exact in a double as factors only, not as fractions
    whole = np.rint(np.where(fine, values * shift, values / shift))
    return np.asarray(np.where(fine, whole / shift, whole * shift))


def rest_after(model: Model, plan: Trajectory, controller: Trajectory) -> float:
    """For how long [s] the last commands are held: a plan that ends standing may come to rest."""
    rests = ends_standing(plan, model.mechanism.legs) and _closed(controller)
    return SETTLE if rests else 0.0


def _closed(controller: Trajectory) -> bool:
    """Whether the last command leaves every valve closed: an open one would keep it moving."""
    return not any(controller[name][-1] for name in controller.names if "/valve/" in name)


def _tried(attempt: Callable[[], Replay]) -> Replay | None:
    try:
        return attempt()
    except KembaError:
        return None
