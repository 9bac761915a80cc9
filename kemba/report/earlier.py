"""The plan of an earlier run as the origin of another one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kemba.ocp import Task, load_task, task_model
from kemba.ocp.continuation.between import Origin
from kemba.ocp.continuation.kept import read_stages
from kemba.ocp.shipped.kind import figures_of
from kemba.ocp.task.requirement import resolve
from kemba.runs import STAGES, load_run


def origin_of(run: str | Path) -> Origin:
    """Plan, model and requirements of a run folder.

    Raises KembaError where the folder is no run, has no plan, or its model is gone.
    """
    found = load_run(run)
    plan = found.trajectory
    task, document = load_task(found.task)
    model = task_model(task)
    certified = found.path / "certificate.json"
    return Origin(
        plan,
        model,
        tuple(resolve(task, model, document)),
        stages=read_stages(found.path / STAGES),
        figures=figures_of(task, model),
        fitted_air=found.certificate.get("fitted_air") if certified.is_file() else None,
    )


def fit_of(task: Task, origin: Origin | None) -> Mapping[str, Any] | None:
    """The fit of an earlier plan's air, where the task has these figures among its effects."""
    fit = origin.fitted_air if origin is not None else None
    pairs = [name.split(".") for name in fit["factors"]] if fit else []
    kept = all(figure in task.effects.get(effect, {}) for effect, figure in pairs)
    return fit if kept else None


def without_fit(task: Task, fit: Mapping[str, Any] | None) -> Task:
    """A task without the fitted figures among its effects."""
    fitted = fit["factors"] if fit else ()
    kept = {
        name: {key: value for key, value in own.items() if f"{name}.{key}" not in fitted}
        for name, own in task.effects.items()
    }
    return task.model_copy(update={"effects": {name: own for name, own in kept.items() if own}})
