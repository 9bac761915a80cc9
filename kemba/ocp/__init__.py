"""Planning: a task on a model, transcribed, solved, certified."""

from kemba.ocp.controller import controller_table
from kemba.ocp.planned import Plan
from kemba.ocp.planning import plan, task_model
from kemba.ocp.task.task import Task, load_task

__all__ = ["Plan", "Task", "controller_table", "load_task", "plan", "task_model"]
