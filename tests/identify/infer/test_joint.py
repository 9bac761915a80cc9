"""The joint estimate that is written: all effects together, what it says of how sure it is."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from toy_problem import Toy

from kemba.config import load_yaml
from kemba.errors import KembaError
from kemba.files import write_json
from kemba.identify.adopt import adopt_answer, adopted
from kemba.identify.discover import discover
from kemba.identify.infer.cross_validation import HeldOut
from kemba.identify.infer.joint import JointFit, conflicts_between_runs, joint_fit
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import Selection, quoted
from kemba.model import load_spec, read_covariance

BOTH = ("kick", "wave")
TRUTH = {"kick.a": 8.0, "bend.a": -6.0}


def test_effects_are_estimated_together_and_their_intervals_hold() -> None:
    held = []
    for seed in range(20):
        found = joint_fit(Toy(TRUTH, seed), ("bend", "kick"), {})
        for i, name in enumerate(("bend.a", "kick.a")):
            assert found.names[i] == name
            held.append(found.low[i] < TRUTH[name] < found.high[i])
    assert np.mean(held) >= 0.9
    assert np.allclose(found.covariance, found.covariance.T)
    assert np.linalg.eigvalsh(found.covariance).min() > 0.0


def test_intervals_count_what_absent_effects_add() -> None:
    """Small shares of two effects that look alike hide some of a third, and say so."""
    held, rng = [], np.random.default_rng(3)
    for seed in range(40):
        small = {f"{name}.a": 0.5 * rng.standard_normal() for name in ("bend", "kick")}
        found = joint_fit(Toy({"ramp.a": 8.0, "drag.a": 0.5, **small}, seed), ("ramp",), {})
        held.append(found.low[0] < 8.0 < found.high[0])
    assert np.mean(held) >= 0.9


def test_an_interval_spans_what_runs_say_that_disagree() -> None:
    """Half the force in one run of three, twice in another."""
    problem = Toy({"kick.a": 8.0})
    run = problem.rows().run
    problem.measured += np.choose(run, [-4.0, 0.0, 4.0]) * problem._shapes["kick"]
    found = joint_fit(problem, ("kick",), {})
    assert found.low[0] < 4.5 and found.high[0] > 11.5
    assert "kick.a differs between runs" in found.remarks[0]
    alike = joint_fit(Toy({"kick.a": 8.0}), ("kick",), {})
    assert not alike.remarks and alike.high[0] - alike.low[0] < 2.0


def test_runs_that_agree_are_not_called_apart() -> None:
    apart = 0
    for seed in range(20):
        problem = Toy({"kick.a": 8.0}, seed)
        theta = {"kick.a": 8.0, "gain": 1.01}
        j = problem.jacobian(theta, ["kick.a", "gain"])
        apart += len(list(conflicts_between_runs(problem, j, problem.residual(theta))))
    assert apart <= 2


def test_what_is_said_is_the_joint_estimate() -> None:
    found = discover(Toy(TRUTH, seed=1))
    assert found.joint is not None and set(found.answer.added) == {"bend", "kick"}
    said = {row.effect: row.parameters["a"].value for row in found.answer.ranking[:2]}
    joint = dict(zip(found.joint.names, found.joint.value.tolist(), strict=True))
    assert said == {"bend": joint["bend.a"], "kick": joint["kick.a"]}
    told = found.answer.json()["covariance"]
    assert tuple(told["names"]) == found.joint.names
    assert np.allclose(told["matrix"], found.joint.covariance)


def test_an_effect_that_raises_the_quoted_error_does_not_stay() -> None:
    """A wave that is in the logs that were learnt from only."""
    problem = Toy({"kick.a": 8.0})
    problem.measured = problem.measured - 2.0 * problem._shapes["wave"]
    search = Search(problem)
    search.start()
    search.visit(BOTH)
    kept = HeldOut.beside(Toy({"kick.a": 8.0}, seed=9), search.problem)
    selection, whole = quoted(search, Selection(BOTH, 0.0), BOTH, kept)
    assert (selection.best, whole) == (("kick",), ("kick",))
    same = quoted(search, Selection(BOTH, 0.0), BOTH, None)
    assert same == (Selection(BOTH, 0.0), BOTH)


def answer_in(folder: Path, sure: list[str]) -> Path:
    """An answer of two effects whose errors go together."""
    value = {"value": 8.0, "low": 6.0, "high": 10.0, "unit": "N"}
    rows = [
        {"effect": "seal_friction", "parameters": {"F_c": value}},
        {"effect": "boom_force", "parameters": {"F": {**value, "value": -6.0}}},
    ]
    names = ["seal_friction.F_c", "boom_force.F"]
    evidence = {"logs": [], "error_before": 2.0, "error_held_out": 0.9, "measured": {}}
    data = {
        "verdict": "missing",
        "ranking": rows,
        "added": ["seal_friction", "boom_force"],
        "sure": sure,
        "covariance": {"names": names, "matrix": [[4.0, 1.0], [1.0, 1.0]]},
        "evidence": evidence,
        "base": "planning",
    }
    folder.mkdir(exist_ok=True)
    write_json(folder / "answer.json", data)
    return folder


def test_adopt_takes_all_with_its_evidence(tmp_path: Path) -> None:
    folder, out = answer_in(tmp_path, ["seal_friction"]), tmp_path / "mine.yaml"
    assert adopt_answer(folder, out) == ("seal_friction", "boom_force")
    found = {e.name: e for e in load_spec(out).effects}
    assert found["boom_force"].value("F") == -6.0 and found["boom_force"].support == "likely"
    assert found["seal_friction"].support == "sure"
    names, matrix = read_covariance(out)
    assert names == ("seal_friction.F_c", "boom_force.F") and matrix[0, 1] == 1.0
    evidence = load_spec(out).evidence
    assert evidence is not None and evidence.error_held_out == 0.9


def test_adopt_of_what_is_sure_takes_the_absence_of_the_rest_into_account(tmp_path: Path) -> None:
    """With the force of -6 N absent, the friction is larger by as much as they go together."""
    out = tmp_path / "sure.yaml"
    adopt_answer(answer_in(tmp_path, ["seal_friction"]), out, only_sure=True)
    (effect,) = (e for e in load_spec(out).effects if e.support)
    assert effect.value("F_c") == pytest.approx(8.0 + 1.0 * 6.0)
    assert read_covariance(out)[1][0, 0] == pytest.approx(4.0 - 1.0)
    assert "error_held_out" not in load_yaml(out).data["evidence"]


def test_adopt_of_what_is_sure_says_where_nothing_is(tmp_path: Path) -> None:
    folder = answer_in(tmp_path, [])
    assert "is sure of no effect; likely are seal_friction and boom_force" in adopted(folder, True)
    with pytest.raises(KembaError, match="sure of no effect"):
        adopt_answer(folder, tmp_path / "none.yaml", only_sure=True)
    assert not (tmp_path / "none.yaml").exists()


@pytest.mark.parametrize(
    ("low", "high", "holds"),
    [(-1.0, 1.0, True), (0.0, 1.0, True), (-1.0, 0.0, True), (0.1, 1.0, False), (-1, -0.1, False)],
)
def test_an_interval_that_ends_at_the_absence_holds_it(
    low: float, high: float, holds: bool
) -> None:
    """As that of a parameter which cannot be negative, and ends at its bound."""
    ends = (np.array([x]) for x in (low, low, high))
    fit = JointFit({}, ("kick.a",), *ends, np.eye(1))
    candidate: Any = SimpleNamespace(key="kick.a", lead=SimpleNamespace(off=0.0))
    assert fit.holds_absence(candidate) is holds
