"""The plant: fine simulation of a model with hard contact, controller, rigs and sensors."""

from kemba.plant.execution.certificate import replays
from kemba.plant.execution.controller import Execution, Gains, execute
from kemba.plant.execution.replay import Replay, replay
from kemba.plant.simulation.commands import Commands, Profile
from kemba.plant.simulation.record import Impact
from kemba.plant.simulation.simulate import Simulated, run, simulate

__all__ = [
    "Commands",
    "Execution",
    "Gains",
    "Impact",
    "Profile",
    "Replay",
    "Simulated",
    "execute",
    "replay",
    "replays",
    "run",
    "simulate",
]
