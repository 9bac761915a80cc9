"""Robot logs as a problem of identification: measured motion, read contacts, filtered defects."""

from kemba.identify.robot.problem import RobotProblem, robot_problem

__all__ = ["RobotProblem", "robot_problem"]
