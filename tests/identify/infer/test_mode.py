"""A little of many effects is no finding: every hypothesis is judged where it fits best."""

import numpy as np
import pytest

from kemba.identify.discover import discover
from kemba.identify.infer.joint import joint_fit
from kemba.identify.infer.linear import NULL, Ranker, linearise, time_blocks
from kemba.identify.infer.null_model import mode_of
from kemba.identify.problem.problem import Array, Candidate, Parameter, Problem, Rows, Theta

ROW, RUNS = 1e-3, 3  # s
EDGES = 0.0505 + 0.04 * np.arange(18)  # s, between two rows; up and down in turn
SMALL = {"late.T": 2e-4, "falls_late.T": 1.5e-4, "drag.F": 0.3}  # about one spike of each


class Late(Problem):
    """A force that jumps at each edge, between two rows: each row shows its mean.

    A delay below one row moves the row after the edges, an advance the row before them. Their
    secants move half of both.
    """

    runs = tuple(f"run {i}" for i in range(RUNS))

    def __init__(self, truth: Theta, seed: int = 0) -> None:
        self.nuisance = {"gain": (1.0, 0.02)}
        self.candidates = {
            "late": Candidate("late", Parameter("T", "s", 0.0, 4e-3)),
            "falls_late": Candidate("falls_late", Parameter("T", "s", 0.0, 4e-3)),
            "drag": Candidate("drag", Parameter("F", "N", 0.0, 10.0, 0.0)),
        }
        self._time = np.arange(800) * ROW
        noise = np.random.default_rng(seed).standard_normal(RUNS * len(self._time))
        self.measured = np.zeros(len(noise))
        self.measured = self.residual({"gain": 1.01, **truth}) + noise

    def residual(self, theta: Theta) -> Array:
        falls = np.arange(len(EDGES)) % 2
        late = theta.get("late.T", 0.0) + falls * theta.get("falls_late.T", 0.0)
        since = self._time[:, None] - EDGES - late
        high = np.clip(since / ROW + 0.5, 0.0, 1.0) @ (1.0 - 2.0 * falls)
        drag = theta.get("drag.F", 0.0) * np.tanh(5.0 * np.sin(7.0 * self._time))
        return np.tile(30.0 * theta.get("gain", 1.0) * high + drag, RUNS) - self.measured

    def rows(self) -> Rows:
        n = RUNS * len(self._time)
        run, label = np.repeat(np.arange(RUNS), len(self._time)), np.full(n, "moving")
        time = np.tile(self._time, RUNS)
        return Rows(run, np.zeros(n, int), time, label, label, ("F",), np.ones(n))


def test_delays_below_a_row_are_no_finding() -> None:
    answers = [discover(Late(SMALL, seed)).answer for seed in range(4)]
    assert {answer.verdict for answer in answers} == {"nothing"}
    p = [answer.p_value_nothing for answer in answers]
    assert min(p) > 0.02
    assert np.median(p) > 0.2


def test_the_same_delay_in_its_size_is_a_finding() -> None:
    answer = discover(Late({**SMALL, "late.T": 3e-3})).answer
    assert answer.added == ("late",)
    found = answer.ranking[0].parameters["T"]
    assert found.low <= 3e-3 <= found.high


@pytest.mark.parametrize("seed", range(3))
def test_the_mode_of_nothing_is_the_machine(seed: int) -> None:
    problem = Late(SMALL, seed)
    linear, jacobian, _ = linearise(problem, {}, time_blocks(problem))
    mode = mode_of(problem, NULL, [{}], linear, jacobian, time_blocks(problem))
    assert mode.theta["late.T"] == pytest.approx(SMALL["late.T"], abs=5e-5)
    assert mode.theta["falls_late.T"] == pytest.approx(SMALL["falls_late.T"], abs=5e-5)
    evidence = [
        Ranker(at, problem.candidates, problem.nuisance).score(NULL).log_evidence
        for at in (linear, mode.linear)
    ]
    assert evidence[1] > evidence[0] + 10.0
    assert mode.cost < 0.5 * len(mode.residual) + 100.0


def test_what_cannot_be_negative_is_absent_at_the_mode() -> None:
    problem = Late({**SMALL, "drag.F": -0.5})
    linear, jacobian, _ = linearise(problem, {}, time_blocks(problem))
    mode = mode_of(problem, NULL, [{}], linear, jacobian, time_blocks(problem))
    assert "drag.F" not in mode.theta


def test_a_step_to_where_nothing_can_be_predicted_is_not_taken() -> None:
    class Explodes(Late):
        """Unstable as soon as it is late, as a stiff law far from its figures."""

        def residual(self, theta: Theta) -> Array:
            grown = 1e200 if theta.get("late.T") else 1.0
            return grown * super().residual(theta)

    late, explodes = Late(SMALL), Explodes({})
    explodes.measured = late.measured
    linear, jacobian, _ = linearise(late, {}, time_blocks(late))
    mode = mode_of(explodes, NULL, [{}], linear, jacobian, time_blocks(late))
    assert mode.theta == {}


@pytest.mark.parametrize("seed", range(3))
def test_intervals_are_taken_where_the_effects_act_together(seed: int) -> None:
    """Edges that fall 3.6 ms late: the slope of `falls_late` is that of edges on time, four rows
    earlier, until it is taken anew."""
    truth = {"late.T": 3.1e-3, "falls_late.T": 5e-4}
    found = joint_fit(Late(truth, seed), ("falls_late", "late"), {"late.T": 3e-3})
    for name, value, low, high in zip(
        found.names[:2], found.value, found.low, found.high, strict=False
    ):
        assert value == pytest.approx(truth[name], abs=1.5e-4)
        assert low <= truth[name] <= high
