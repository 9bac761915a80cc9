"""Plans that the user has made: a list in the user's data folder, and the nearest as a start.

Never needed: where the list, an entry or a run folder is gone or damaged, plans begin from guesses.
"""

import json
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from kemba.errors import KembaError
from kemba.files import WriteError, atomic_text
from kemba.model import Model
from kemba.ocp import Plan, Task
from kemba.ocp.continuation.origin import Origin
from kemba.ocp.task.templates import longest_leg, with_height
from kemba.solve.earlier import origin_of
from kemba.stopwatch import Tell

MOST = 1000  # entries; the oldest go first
NAME = "plans.jsonl"


@dataclass(frozen=True)
class Remembered:
    """A good plan of the user: fingerprint and figures of its task, what its task counts, and its
    run folder."""

    kind: str
    figures: dict[str, float]
    cost: float
    run: str


def list_file() -> Path | None:
    """Where the plans are listed: in KEMBA_MEMORY, or the user's data folder.

    None for an empty KEMBA_MEMORY, and for a user without a home.
    """
    own = os.environ.get("KEMBA_MEMORY")
    if own is not None:
        return Path(own) / NAME if own else None
    if base := os.environ.get("XDG_DATA_HOME"):
        return Path(base) / "kemba" / NAME
    try:
        return Path.home() / ".local" / "share" / "kemba" / NAME
    except RuntimeError:  # neither HOME nor an entry in the list of users
        return None


def recalled(task: Task, model: Model, tell: Tell) -> Origin | None:
    """The user's nearest plan of the same kind of task; None where none is near, or where the task
    asks for a start or method of its own."""
    plain = task.method == "relaxation" and task.refine == "radau" and task.guess == "automatic"
    if not plain or task.guess_noise or task.seed:
        return None
    asked = figures_of(task, model)
    near = [(distance(model, asked, one.figures), one) for one in _alike(task, model, tell)]
    for apart, one in sorted(near, key=lambda pair: pair[0]):
        if apart > NEAR:
            break
        try:
            origin = origin_of(one.run)
        except (KembaError, OSError, ValueError):  # moved, changed or removed since, or no name
            continue
        name, hint = f"the earlier plan {one.run}", "one from a guess (--no-memory) may take less"
        return replace(origin, name=name, dear=hint, once=True, given=False)
    return None


def best_known(task: Task, model: Model, tell: Tell) -> dict[str, Any] | None:
    """The cheapest of the user's plans of the same task, `of` so many; None where there is none."""
    asked = figures_of(task, model)
    same = [r.cost for r in _alike(task, model, tell) if distance(model, asked, r.figures) < 1e-6]
    return {"cost": min(same), "of": len(same)} if same else None


def remember(found: Plan, run: Path) -> None:
    """Add a good plan to the list; nothing happens where that cannot be written."""
    file = list_file()
    if file is None:
        return
    kind, figures = kind_of(found.task, found.model), figures_of(found.task, found.model)
    own = Remembered(kind, figures, found.objective, str(run.resolve()))
    kept = [one for one in _listed(file, lambda text: None) if one.run != own.run]
    try:
        with atomic_text(file) as stream:
            for one in [*kept, own][-MOST:]:
                stream.write(json.dumps(asdict(one)) + "\n")
    except WriteError:
        return


def _alike(task: Task, model: Model, tell: Tell) -> list[Remembered]:
    file = list_file()
    listed = [] if file is None else list(_listed(file, tell))
    kind = kind_of(task, model) if listed else ""
    return [one for one in listed if one.kind == kind]


def _listed(file: Path, tell: Tell) -> Iterator[Remembered]:
    """The entries of the list; what cannot be read is left out, and said."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        tell(f"{file} cannot be read and is left out: {error}")
        return
    entries = [_entry(line) for line in lines]
    yield from (one for one in entries if one is not None)
    if damaged := entries.count(None):
        tell(f"{damaged} entries of {file} cannot be read and are left out")


def _entry(line: str) -> Remembered | None:
    """A line of the list; None where it is damaged."""
    try:
        entry = json.loads(line)
        figures = {str(key): float(value) for key, value in entry["figures"].items()}
        one = Remembered(str(entry["kind"]), figures, float(entry["cost"]), str(entry["run"]))
    except (ValueError, ArithmeticError, LookupError, TypeError, AttributeError, RecursionError):
        return None
    return one if all(map(math.isfinite, (one.cost, *figures.values()))) else None


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
