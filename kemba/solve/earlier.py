"""The plan of an earlier run as the origin of another one."""

from pathlib import Path

from kemba.ocp import load_task, task_model
from kemba.ocp.continuation.origin import Origin, read_stages
from kemba.ocp.task.resolve import resolve
from kemba.runs import STAGES, load_run


def origin_of(run: str | Path) -> Origin:
    """Plan, model and requirements of a run folder. Raises KembaError where the folder is no run,
    has no plan, or its model is gone."""
    found = load_run(run)
    plan = found.trajectory
    task, document = load_task(found.task)
    model = task_model(task)
    asked, stages = tuple(resolve(task, model, document)), read_stages(found.path / STAGES)
    return Origin(plan, model, asked, stages=stages, run=str(run))
