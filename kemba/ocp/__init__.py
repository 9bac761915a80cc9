"""Planning: a task on a model, transcribed, solved, certified."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kemba.ocp.controller import controller_table
    from kemba.ocp.planned import Plan
    from kemba.ocp.planning import plan
    from kemba.ocp.reading import load_task, task_model
    from kemba.ocp.task.task import Task

__all__ = ["Plan", "Task", "controller_table", "load_task", "plan", "task_model"]
_HOMES = {
    "Plan": "planned",
    "Task": "task.task",
    "controller_table": "controller",
    "load_task": "reading",
    "plan": "planning",
    "task_model": "reading",
}


def __getattr__(name: str) -> Any:
    """Imported when first asked for: programs with pairs need no robot."""
    if name in _HOMES:
        return getattr(import_module(f"kemba.ocp.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'kemba.ocp' has no attribute '{name}'")
