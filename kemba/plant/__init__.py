"""The plant: fine simulation of a model with hard contact, controller, rigs and sensors."""

from kemba.plant.certificate import replays
from kemba.plant.commands import Commands, Profile
from kemba.plant.controller import Execution, Gains, execute
from kemba.plant.events import Impact
from kemba.plant.replay import Replay, replay
from kemba.plant.simulate import Run, run, simulate

__all__ = [
    "Commands",
    "Execution",
    "Gains",
    "Impact",
    "Profile",
    "Replay",
    "Run",
    "execute",
    "replay",
    "replays",
    "run",
    "simulate",
]
