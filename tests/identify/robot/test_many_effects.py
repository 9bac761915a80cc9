"""Several effects at once in a robot: as many are named as the logs carry."""

import pytest

pytest.importorskip("numba")

from robot_logs import hops
from twin import catalogue, measure

from kemba.identify.discover import discover
from kemba.identify.robot.problem import robot_problem
from kemba.model.spec import load_model

HIDDEN = ("seal_friction", "hip_friction", "boom_force", "valve_delay")


@pytest.mark.nightly
@pytest.mark.parametrize("keep", [0.0, 0.9])
def test_four_effects_are_named_together(keep: float) -> None:
    sensors = measure.Sensors(keep=keep)
    logs, _ = hops(*(catalogue.hidden(name) for name in HIDDEN), runs=4, sensors=sensors)
    for log in logs:
        known = [name for name in log.names if measure.base(name) in measure.CHANNELS]
        log.meta["noise"] = {name: sensors.spread(name) for name in known}
    answer = discover(robot_problem(logs, load_model("planning"))).answer
    assert answer.verdict in ("missing", "partly")
    named = set(answer.added)
    assert len(named & set(HIDDEN)) >= 3, answer.sentence
    assert len(named - set(HIDDEN)) <= 1, answer.sentence
    assert answer.excess_after < 0.4 * answer.excess_before
