"""The sensitivities of a run folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from kemba.ocp import load_task, task_model
from kemba.runs import load_run
from kemba.sensitivity import Sensitivity, sensitivity


def sensitivity_of_run(
    run: str | Path, tell: Callable[[str], None] = lambda text: None, only: Sequence[str] = ()
) -> Sensitivity:
    """What small changes do to the plan of a run folder; `only`: the names of wanted figures.

    Raises KembaError where the folder is no run, has no plan, or its model is gone, and where there
    is no such figure.
    """
    found = load_run(run)
    task, document = load_task(found.task)
    model, plan = task_model(task, document=document), found.trajectory
    return sensitivity(task, model, plan, found.controller, tell, only=only)
