"""A sensor that is late by several rows: its delay is found whole."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba")

from twin.cases import robot_case

from kemba.identify.discover import Discovery, discover
from kemba.identify.infer.cross_validation import HeldOut
from kemba.identify.infer.linear import NULL
from kemba.identify.infer.windows import error_ratio
from kemba.identify.logs.reading import read_logs
from kemba.identify.robot.problem import RobotProblem, robot_problem
from kemba.model.spec import load_model

LATE = "sensor_delay:rear/piston/x"
DT = 5.2e-3  # s
AMONG = (LATE, "seal_friction", "valve_close_delay:rear", "end_cushion:rear")


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Four logs of a robot whose rear piston's sensor is late; figures are as drawn."""
    hidden = {"kind": LATE, "parameters": {"dt": DT}}
    return robot_case(tmp_path_factory.mktemp("late"), hidden, seed=6, runs=4, figures_off=0.0)[0]


@pytest.fixture(scope="module")
def found(logs: list[Path]) -> Discovery:
    fitted, kept = (problem(part) for part in (logs[:3], logs[3:]))
    return discover(fitted, kept)


def problem(paths: list[Path]) -> RobotProblem:
    return robot_problem(read_logs(paths), load_model(), AMONG)


@pytest.mark.slow
def test_the_delay_is_found_whole(found: Discovery) -> None:
    """Along the motion that was read from it, it looks two milliseconds shorter."""
    assert found.answer.added == (LATE,)
    value = found.answer.ranking[0].parameters["dt"]
    assert value.low < DT < value.high
    assert value.value == pytest.approx(DT, abs=3e-4)


@pytest.mark.slow
def test_logs_that_are_kept_are_judged_along_the_motion_of_the_answer(
    found: Discovery, logs: list[Path]
) -> None:
    """So a late sensor does not seem to leave an error in a jump that `compare` does not show; the
    log that is kept here is a heave, too slow for a sensor that is late to bend its motion."""
    theta = found.search.points[found.best].fit.theta
    assert found.kept is not None
    along_its_own = error_ratio(found.kept.found, theta)
    assert found.answer.error_after == pytest.approx(along_its_own) and along_its_own < 1.0
    jump = HeldOut.beside(problem(logs[:1]), found.search.problem)
    assert error_ratio(jump.found, theta) < 1.0 < 2.0 < error_ratio(jump.plain, theta)


@pytest.mark.slow
def test_the_model_as_it_is_is_judged_along_its_own_motion(
    found: Discovery, logs: list[Path]
) -> None:
    """Along that of the answer it would look twice as bad as `compare` says."""
    search = found.search
    own = error_ratio(problem(logs[:3]).with_noise_of(search.problem), {})
    assert found.fitted[0] == pytest.approx(own, rel=0.2)
    assert search.points[NULL].fitted_error > 1.5 * own


@pytest.mark.slow
def test_a_late_piston_is_read_as_exactly_as_another(logs: list[Path]) -> None:
    """What a sensor saw some rows ago is held against the motion of that time."""
    known = problem(logs[:1]).relinearise({f"{LATE}.dt": DT})
    left = known.state.residuals([{f"{LATE}.dt": DT}])[..., 0]
    mask, of = known.state.mask, {}
    for i, channel in enumerate(known.state.physics.channels):
        of[channel] = float(np.sqrt(np.mean(left[..., i][mask[..., i]] ** 2)))
    assert of["rear/piston/x"] == pytest.approx(of["front/piston/x"], rel=0.15)
