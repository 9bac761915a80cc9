"""How fast an impact is for the robot: feet by their own speed, stops by that of the leg."""

from kemba.mechanism import Mechanism
from kemba.mechanism.knee import leg_per_piston


def felt(mechanism: Mechanism, label: str) -> float:
    """Speed of an impact per speed at which its gap closes [1].

    `label`: of the pair. A foot counts by itself. A piston at its stop counts by how fast the
    distance from hip to foot changes there: with bent knees a slow piston goes with a fast body.
    """
    pair = label.rpartition("/")[2]
    places = {"end_stop:retracted": 0.0, "end_stop:extended": mechanism.stroke}
    if pair not in places:
        return 1.0
    return abs(leg_per_piston(mechanism.need_robot().leg, places[pair]))
