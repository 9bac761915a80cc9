"""Reading a task so that all its mistakes are told at once, whatever finds them; and a sequence of
motions as one problem: grids and contacts in a row, each part at its own times."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from kemba.config import Document, apply_overrides, beside, find_config, load_yaml, with_added
from kemba.config.parsing import sound
from kemba.effects.mechanics.load import Payload
from kemba.errors import ConfigErrors, KembaError, listed_errors
from kemba.model import Model, load_model
from kemba.model.lags import with_lags
from kemba.model.spec import changed_effects
from kemba.ocp.task.moments import spans
from kemba.ocp.task.requirement import Earlier, Requirement
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Stance, Task, parse_task
from kemba.trajectory import Trajectory


def load_task(name: str | Path, overrides: list[str] | None = None) -> tuple[Task, Document]:
    """The task YAML `name` (a path or a shipped task) and its document, for error positions. Raises
    KembaError with every mistake at its line."""
    document = apply_overrides(load_yaml(find_config(name, "tasks")), overrides or [])
    return read_task(document), document


def read_task(document: Document) -> Task:
    """The task of a document. Where keys or values are wrong, what the rest names is looked up as
    well, so that the error lists all of it. Raises KembaError."""
    try:
        return parse_task(document)
    except ConfigErrors as error:
        told = {str(each): each for each in (*error.errors, *_further(document))}
        raise ConfigErrors(told.values()) from None


def _further(document: Document) -> list[KembaError]:
    """The mistakes in those parts of a task that its schema accepts."""
    try:
        left = sound(document, Task)
        asked_of(parse_task(left), left, partial=True)
    except KembaError as error:
        return listed_errors(error)
    return []


def asked_of(
    task: Task,
    document: Document,
    model: str | Path | None = None,
    partial: bool = False,
    lags: bool = False,
) -> tuple[Model, list[Requirement]]:
    """The model of a task and its requirements on it.

    `partial`: parts of the task are left out, and nothing is said of what they would have given.
    `lags`: with first-order chambers in the place of physical ones.
    Raises ConfigErrors with every wrong name, unit and range, of changed effects too.
    """
    errors: list[KembaError] = []
    try:
        built = task_model(task, model, document)
    except KembaError as error:
        errors = listed_errors(error)
        try:
            built = load_model(
                model or task.model, (), task.supply, scene=task.scene, at=task.place_x
            )
        except KembaError:
            raise ConfigErrors(errors) from None
    built = (lags and with_lags(built)) or built
    try:
        found = resolve(task, built, document, partial)
    except KembaError as error:
        errors += listed_errors(error)
    if errors:
        raise ConfigErrors(errors)
    return built, found


def task_model(
    task: Task, name: str | Path | None = None, document: Document | None = None
) -> Model:
    """The model of a task: its own unless `name` is given, with the task's supply, payload and
    changed effects. `document` gives the places of mistakes. Raises KembaError."""
    if name is None and document is not None:
        look_up(task, document)
    extra = changed_effects(name or task.model, task.effects, document)
    extra += [Payload(m=task.payload)] if task.payload else []
    return load_model(name or task.model, extra, task.supply, scene=task.scene, at=task.place_x)


def look_up(task: Task, document: Document) -> None:
    """Raise KembaError, at the line of the task, where it names a model that there is not."""
    for key, name in (("model", task.model), ("plant", task.plant)):
        try:
            for part in with_added(name) or (name,):
                find_config(part, "models")
        except KembaError as error:
            what = f"{key}: {name}: {error.what}"
            raise document.error((key,), what, error.expected, error.hint) from None


DEEPEST = 5  # sequences within sequences
# by a sequence to all its motions
GIVEN = ("model", "plant", "supply", "payload", "effects", "terrain", "obstacles")
# what one problem has once, so that all its motions must agree
ALIKE = (*GIVEN, "cost", "landing", "grip", "min_dwell")

Motion = tuple[Task, Document]


def motions(task: Task, document: Document, within: Sequence[str] = ()) -> list[Motion]:
    """The motions of a sequence in order, repeated ones as often as asked, with their documents.
    Raises KembaError, at the line of the sequence, for a file that is missing or names itself."""
    found: list[Motion] = []
    errors: list[KembaError] = []
    for i in range(len(task.sequence)):
        try:
            found += _repeated(task, i, document, within or (document.source,))
        except KembaError as error:
            errors += listed_errors(error)
    if errors:
        raise ConfigErrors(errors)
    return found


def _repeated(task: Task, i: int, document: Document, within: Sequence[str]) -> list[Motion]:
    """The motion `i` of a sequence, or those of a sequence there, as often as it is repeated."""
    part, place = task.sequence[i], ("sequence", i)
    folder = Path(document.source).parent if document.source else Path()
    try:
        file = str(find_config(beside(part.motion, folder), "tasks"))
    except KembaError as error:
        raise document.error(place, f"sequence: {error.what}", hint=error.hint) from None
    if file in within or len(within) > DEEPEST:
        raise document.error(place, f"sequence: {part.motion} leads back to itself")
    settings = [f"{key}={value}" for key, value in part.set.items()]
    own = apply_overrides(load_yaml(file), settings, document.place((*place, "set")))
    read = read_task(own)
    given = {key: getattr(task, key) for key in GIVEN if key in task.model_fields_set}
    read = read.model_copy(update=given)
    inner = motions(read, own, (*within, file)) if read.sequence else [(read, own)]
    return inner * part.repeat


def as_one(
    task: Task, document: Document, lags: bool = False
) -> tuple[Task, Model, list[Requirement]]:
    """A sequence as one task with its model and the requirements of all its motions; `lags` as in
    `asked_of`.

    Each motion begins in the state in which the one before ends. What it asks of places ahead
    counts from where it begins. Raises KembaError for mistakes in any of the motions.
    """
    parts = motions(task, document)
    nodes, duration = sum(p.nodes for p, _ in parts), sum(p.duration for p, _ in parts)
    first = parts[0][0]
    for part, _ in parts[1:]:
        for key in (key for key in ALIKE if getattr(part, key) != getattr(first, key)):
            what = f"sequence: `{key}` of {part.name} is another than that of {first.name}"
            hint = "one problem has one; give it in `set` of the motion, or in both files"
            raise document.error(("sequence",), what, hint=hint)
    contacts: list[Stance] = []
    requirements: list[Requirement] = []
    begin = 0
    for part, own in parts:
        model, asked = asked_of(part, own, lags=lags)
        moved = _moved(asked, begin / nodes, part.nodes / nodes)
        known = {_said(r, nodes) for r in requirements}
        requirements += [r for r in moved if _said(r, nodes) not in known]
        for stance, (a, b) in zip(part.contacts, spans(part.contacts), strict=True):
            share = (b - a) * part.nodes / nodes
            if contacts and contacts[-1].on == stance.on:
                share += contacts.pop().share or 0.0
            contacts.append(Stance(on=stance.on, share=share))
        begin += part.nodes
    whole = {
        "duration": duration,
        "nodes": nodes,
        "step_variation": max(p.step_variation for p, _ in parts),
        "contacts": tuple(contacts) if all(p.contacts for p, _ in parts) else (),
        **{key: getattr(first, key) for key in ALIKE},
    }
    return task.model_copy(update=whole), model, requirements


def _moved(asked: Sequence[Requirement], begin: float, share: float) -> Iterator[Requirement]:
    """Requirements of a motion that takes a `share` of the nodes from `begin` on."""

    def at(moment: float) -> float:
        return begin + share * moment

    for r in asked:
        ahead = begin > 0.0 and r.quantity.name.endswith(AHEAD) and r.minus is None
        if ahead and r.at == 0.0 and r.quantity.name == "body/x":
            continue  # where a motion begins
        if begin > 0.0 and r.location in (("start",), ("start", "settled")):
            continue  # air is what the motion before leaves, and settled after a while of rest only
        minus = r.minus and replace(r.minus, at=at(r.minus.at))
        if ahead and r.at is not None:
            minus = Earlier("body/x", begin)
        moment = None if r.at is None else at(r.at)
        during = at(r.during[0]), at(r.during[1])
        yield replace(r, at=moment, during=during, minus=minus)


def _said(asked: Requirement, nodes: int) -> tuple[object, ...]:
    """What a requirement says, wherever: two motions that meet may say the same of their state."""
    during = None if asked.at is not None else asked.during
    at = None if asked.at is None else asked.node(nodes)
    return at, during, asked.quantity.name, asked.lower, asked.upper, asked.aim, asked.minus


AHEAD = ("body/x", "foot/x", "hip/x", "knee/x")  # what a motion before has moved on


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Trajectories in a row, each from where the one before ends: in time and in place.

    Their first and last states agree; of both the earlier is kept. Columns are those of the first.
    """
    first = parts[0]
    time, columns = [first.time], {name: [first[name]] for name in first.names}
    phases = list(first.meta.get("phases", ()))
    end, x, nodes = float(first.time[-1]), float(first["body/x"][-1]), len(first) - 1
    for part in parts[1:]:
        time.append(part.time[1:] - part.time[0] + end)
        on = x - float(part["body/x"][0])
        for name, values in columns.items():
            values.append(part[name][1:] + on * name.endswith(AHEAD))
        phases += [_later(str(text), nodes) for text in part.meta.get("phases", ())]
        end, x = float(time[-1][-1]), float(columns["body/x"][-1][-1])
        nodes += len(part) - 1
    whole = dict(zip(first.headers, map(np.concatenate, columns.values()), strict=True))
    meta = {**first.meta, **({"phases": phases} if phases else {})}
    return Trajectory(np.concatenate(time), whole, meta)


def _later(phase: str, nodes: int) -> str:
    """A phase of the sidecar, `12-18 ho 10`, some nodes later."""
    span, rest = phase.split(" ", 1)
    first, last = span.split("-")
    return f"{int(first) + nodes}-{int(last) + nodes} {rest}"
