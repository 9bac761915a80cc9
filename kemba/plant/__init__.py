"""The plant: fine simulation of a model with hard contact, controller, rigs and sensors."""

from kemba.plant.certificate import replays
from kemba.plant.commands import Commands, Profile
from kemba.plant.controller import Execution, Gains, execute, execute_many
from kemba.plant.record import Impact
from kemba.plant.replay import Replay, replay
from kemba.plant.simulate import Condition, Simulated, run, run_many, simulate

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
