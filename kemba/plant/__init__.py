"""The plant: fine simulation of a model with hard contact, controller, rigs and sensors."""

from kemba.plant.commands import Commands, Profile
from kemba.plant.controller import Execution, Gains, execute, execute_many
from kemba.plant.replay import Replay, replay, replays
from kemba.plant.simulate import Condition, Impact, Simulated, run, run_many, simulate

__all__ = [
    "Commands",
    "Condition",
    "Execution",
    "Gains",
    "Impact",
    "Profile",
    "Replay",
    "Simulated",
    "execute",
    "execute_many",
    "replay",
    "replays",
    "run",
    "run_many",
    "simulate",
]
