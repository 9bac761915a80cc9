"""Reading a task so that all its mistakes are told at once, whatever finds them."""

from pathlib import Path

from kemba.config import Document, apply_overrides, find_config, load_yaml
from kemba.config.parsing import sound
from kemba.effects.mechanics.load import Payload
from kemba.errors import ConfigErrors, KembaError, listed_errors
from kemba.model import Model, load_model
from kemba.model.spec import changed_effects
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.resolve import resolve
from kemba.ocp.task.task import Task, parse_task


def load_task(name: str | Path, overrides: list[str] | None = None) -> tuple[Task, Document]:
    """The task YAML `name` (a path or a shipped task) and its document, for error positions.

    Raises KembaError with every mistake at its line.
    """
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
    task: Task, document: Document, model: str | Path | None = None, partial: bool = False
) -> tuple[Model, list[Requirement]]:
    """The model of a task and its requirements on it.

    `partial`: parts of the task are left out, and nothing is said of what they would have given.
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
            find_config(name, "models")
        except KembaError as error:
            what = f"{key}: {name}: {error.what}"
            raise document.error((key,), what, error.expected, error.hint) from None
