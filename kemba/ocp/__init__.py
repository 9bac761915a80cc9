"""Planning: a task on a model, transcribed, solved, certified."""

from kemba.ocp.controller import controller_table
from kemba.ocp.planned import Plan
from kemba.ocp.planning import plan
from kemba.ocp.reading import load_task, task_model
from kemba.ocp.task.task import Task

__all__ = ["Plan", "Task", "controller_table", "load_task", "plan", "task_model"]
