"""How well a plan executes: its inputs and its table on the same model, its table on the plant."""

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from kemba.errors import KembaError
from kemba.events import ends_standing
from kemba.mechanism.knee import felt
from kemba.model import Model, load_model
from kemba.plant.controller import execute
from kemba.plant.record import Impact
from kemba.plant.replay import Replay, replay
from kemba.stopwatch import Stage, Tell, silent
from kemba.trajectory import Array, Trajectory


def played(machine: Model, plan: Trajectory, table: Trajectory, rest: float) -> Replay:
    """A plan's table on a machine; the last commands stay for `rest` [s]."""
    return execute(table, machine, extra=rest).against(machine, plan)


SLOW = 0.01  # m/s; slower ones are no news
OBSTACLES = {
    "contact:gap": "foot on the ground",
    "end_stop:retracted": "piston at its retracted stop",
    "end_stop:extended": "piston at its extended stop",
}


def told(model: Model, impacts: Iterable[Impact]) -> list[dict[str, Any]]:
    """Every impact faster than 1 cm/s: when, of what, how fast, and the energy lost.

    What hits at the same instant is one impact, with the speed of the fastest. Pistons at a stop
    count by how fast the distance from hip to foot changes.
    """
    found = []
    for impact in impacts:
        each = zip(impact.labels, impact.speeds, strict=True)
        speed = max((felt(model.mechanism, label) * rate for label, rate in each), default=0.0)
        if speed >= SLOW:
            what = " and ".join(_name(label) for label in impact.labels)
            facts = {"time_s": impact.time, "what": what, "speed_m_s": speed}
            found.append({**facts, "energy_J": impact.lost})
    return found


def _name(label: str) -> str:
    """A pair in words: `front/contact:gap` is the front foot on the ground."""
    leg, _, pair = label.rpartition("/")
    return f"{leg} {OBSTACLES.get(pair, pair)}".strip()


PLANT = "plant"
POINTS = re.compile(r".*/(hip|knee)/(x|z|vx|vz)")
DIGITS = 7
SETTLE = 0.3  # s; the last commands are held so long before a landing is judged


def executions(
    model: Model,
    plan: Trajectory,
    controller: Trajectory,
    plant: str | Model | None = PLANT,
    tell: Tell = silent,
) -> dict[str, Replay | None]:
    """The executions `replay`, `table_replay` and `plant_replay` of the certificate.

    `replay` plays the inputs of the plan on its own model, `table_replay` the controller's table
    through eq. 10 and the dead time on the same model, `plant_replay` that table on the plant, None
    without one. With the table a plan that ends standing, with its valves closed, has a moment to
    come to rest before its landing is judged. Any is None where a plan that was not solved cannot
    even be started. `tell` gets the name of each execution.
    """
    full = load_model(plant) if isinstance(plant, str) else plant
    rest = rest_after(model, plan, controller)

    def on(machine: Model) -> Replay | None:
        return _tried(lambda: played(machine, plan, controller, rest))

    tell(Stage("replay: the plan's inputs", 1, 3))
    own = _tried(lambda: replay(model, plan))
    tell(Stage("replay: controller.csv", 2, 3))
    table = on(model)
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
    columns = {header: _digits(values) for header, values in kept.columns.items()}
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
    # an open valve would keep it moving
    still_open = any(controller[n][-1] for n in controller.names if "/valve/" in n)
    rests = ends_standing(plan, model.mechanism.legs) and not still_open
    return SETTLE if rests else 0.0


def _tried(attempt: Callable[[], Replay]) -> Replay | None:
    try:
        return attempt()
    except KembaError:
        return None
