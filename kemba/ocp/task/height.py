"""How high a task asks the body to be: by itself, or by how high the feet are to be."""

from __future__ import annotations

import math

import numpy as np

from kemba.events import feet
from kemba.mechanism.knee import flexion
from kemba.mechanism.links import Robot
from kemba.model import Model
from kemba.ocp.task.task import Task
from kemba.trajectory import Trajectory


def longest_leg(robot: Robot) -> float:
    """Distance [m] from hip to foot with the piston out."""
    femur, tibia = robot.leg.femur.length, robot.leg.tibia.length
    bend = math.cos(flexion(robot.leg, robot.stroke))
    return math.sqrt(femur**2 + tibia**2 + 2 * femur * tibia * bend)


def rise_of_feet(plan: Trajectory) -> float | None:
    """How far [m] all feet are off the ground at most; None where the columns do not say."""
    heights = [*feet(plan).values()]
    return float(np.min(heights, axis=0).max()) if heights else None


def with_height(task: Task, model: Model) -> Task:
    """The task with the height [m] of the body's centre at which the stretched legs of a level body
    leave its feet as high as `feet` asks; the task itself where it does not ask for that."""
    if task.feet is None:
        return task
    ground = float(task.scene.ground.height(0.0))
    height = task.feet + longest_leg(model.mechanism.need_robot()) + ground
    return task.model_copy(update={"height": height})
