"""Logs of one kind of motion: three like jumps of a machine that lacks friction only."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba")

import kemba
from kemba.identify.discover import discover
from kemba.identify.infer.cross_validation import window_gain
from kemba.identify.logs.reading import read_logs
from kemba.identify.robot.contact import steady_while
from kemba.identify.robot.problem import RobotProblem, robot_problem
from kemba.model.spec import load_model

MACHINE = "name: machine\nbase: planning\neffects:\n  - {kind: seal_friction, F_c: 12 N}\n"
FRICTION = ("seal_friction",)
HEIGHTS = ("0.47 m", "0.48 m", "0.5 m")


@pytest.fixture(scope="module")
def jumps(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RobotProblem]:
    """The problem that noisy logs of three jumps pose to the planning model."""
    folder = tmp_path_factory.mktemp("jumps")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        Path("machine.yaml").write_text(MACHINE, encoding="utf-8")
        paths: list[Path] = []
        for number, height in enumerate(HEIGHTS):
            jump = kemba.plan("jump.yaml", height=height)
            done = kemba.simulate(jump, plant="machine.yaml", noise=True, seed=number)
            paths += [Path(path).resolve() for path in done.logs]
        yield robot_problem(read_logs(paths), load_model("planning"))


@pytest.mark.slow
def test_friction_alone_is_named(jumps: RobotProblem) -> None:
    """With a mass and a torque beside it, friction of 8 N fitted better by 27 nats. By evidence
    damping may look as likely (23 nats beside 22 with other noise), but not by left-out data."""
    found = discover(jumps)
    answer, search = found.answer, found.search
    others = [h for h in search.points if len(h) == 1 and h != FRICTION]
    gains = {h: window_gain(search, FRICTION, h).nats for h in others}
    assert min(gains.values()) > 0.0, gains
    assert answer.verdict == "missing" and answer.added[0] == "seal_friction", answer.sentence
    value = answer.ranking[0].parameters["F_c"]
    assert value.low < 12.0 < value.high
    assert answer.sentence.startswith("Missing: seal_friction ("), "what else is likely is no part"


@pytest.mark.slow
def test_noise_in_the_contacts_does_not_make_legs_look_light(jumps: RobotProblem) -> None:
    """About the truth, mass and torque are what they are: within three sigmas of nothing wrong."""
    true = {"seal_friction.F_c": 12.0}
    problem = jumps.relinearise(true)
    names = ["mass_split.m", "torque_scale.k", "seal_friction.F_c"]
    figures = list(problem.nuisance)
    sigmas = [problem.nuisance[name][1] for name in figures]
    slopes = np.hstack([problem.jacobian(true, names), problem.jacobian(true, figures) * sigmas])
    information = slopes.T @ slopes + np.diag([0.0] * len(names) + [1.0] * len(figures))
    covariance = np.linalg.inv(information)
    step = -covariance @ (slopes.T @ problem.residual(true))
    off = np.abs(step) / np.sqrt(np.diag(covariance))
    assert np.all(off[: len(names)] < 3.0), dict(zip(names, step, strict=False))


def test_contact_forces_are_smoothed_only_where_they_act() -> None:
    """A foot that lifts off leaves no force in the air, and none of its own is lost at the edge."""
    rng = np.random.default_rng(0)
    acts = np.zeros((300, 1), dtype=bool)
    acts[:120], acts[200:] = True, True
    force = np.where(acts, 80.0 + 30.0 * rng.standard_normal(acts.shape), 1e6)
    found = steady_while(force, acts, 1e-3)
    assert np.all(found[~acts] == 0.0)
    assert np.all(np.abs(found[acts] - 80.0) < 30.0)
    assert found[acts].std() < 0.35 * force[acts].std()
