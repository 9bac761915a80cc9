"""Effects that are not named, or not for sure: what left-out data do not need, and what the time
limit kept from being asked."""

from collections.abc import Callable

import numpy as np
import pytest
from toy_problem import Toy

from kemba.effects import BY_KIND
from kemba.identify.answer import ENDED
from kemba.identify.bench.problem import bench_problem
from kemba.identify.discover import discover
from kemba.identify.infer.cross_validation import figures_off, window_gain
from kemba.identify.infer.linear import NULL
from kemba.identify.infer.search import Search
from kemba.identify.infer.selection import Selection, is_unsupported
from kemba.identify.infer.verdict import caveats_of, verdict_on
from kemba.model.spec import load_model
from kemba.trajectory import Trajectory

FRICTION = ("seal_friction",)


@pytest.mark.parametrize("force", [0.0, 8.0])  # N
def test_an_effect_that_is_not_there_gains_nothing_on_left_out_data(
    bench_log: Callable[..., Trajectory], force: float
) -> None:
    hidden = (BY_KIND["seal_friction"](F_c=force),)
    search = Search(bench_problem([bench_log(hidden, duration=1.2)], load_model(rig=True)))
    search.start()
    search.visit(FRICTION)
    assert is_unsupported(search, FRICTION) == (force == 0.0)


@pytest.mark.parametrize("ended", [False, True])
def test_a_search_that_the_limit_ended_is_not_sure_of_a_sensor(
    bench_log: Callable[..., Trajectory], ended: bool
) -> None:
    log, scale = bench_log(duration=1.2), ("sensor_scale:piston/F",)
    log = log.with_columns({"piston/F [N]": 1.1 * log["piston/F"]})
    search = Search(bench_problem([log], load_model(rig=True)))
    search.start()
    search.visit(scale)
    caveats = caveats_of(search, Selection(scale), None, ended)
    said = (verdict_on(scale, None, caveats), caveats.reasons, caveats.unsure)
    assert said == (("partly", (ENDED,), scale) if ended else ("missing", (), ()))


def test_of_several_effects_that_were_not_asked_one_by_one_none_is_sure(
    bench_log: Callable[..., Trajectory],
) -> None:
    both = ("piston_damping", "seal_friction")
    hidden = (BY_KIND["seal_friction"](F_c=8.0), BY_KIND["piston_damping"](c=15.0))
    search = Search(bench_problem([bench_log(hidden, duration=1.2)], load_model(rig=True)), due=0.0)
    search.start()
    for answer in (FRICTION, both):
        search.visit(answer)
    caveats = caveats_of(search, Selection(both), None, ended=search.late)
    assert ENDED in caveats.reasons and caveats.unsure == both
    assert caveats_of(search, Selection(FRICTION), None, ended=search.late).unsure == ()


def test_what_left_out_data_do_not_need_is_not_named() -> None:
    """An effect that is there in the rows alone, whose sign changes from row to row."""
    problem = Toy({})
    problem.window = 20
    problem._shapes["wave"] = np.where(np.arange(len(problem.measured)) % 2, 1.0, -1.0)
    problem.measured = problem.measured + 4.0 * problem._shapes["wave"]
    answer = discover(problem).answer
    assert (answer.verdict, answer.added) == ("nothing", ())
    assert answer.sentence.startswith("What differs may be chance (p = 0.00")
    assert any("wave would fit these readings better" in remark for remark in answer.remarks)


@pytest.mark.parametrize(("force", "sigmas"), [(5.0, 3.0), (0.5, 0.75)])
def test_a_nominal_figure_far_off_speaks_for_an_effect(force: float, sigmas: float) -> None:
    """A force that the nominal gain may imitate, so that left-out data need no effect."""
    problem = Toy({})
    problem.window = 20
    problem._shapes["kick"] = problem._u / 100.0
    problem.measured = problem.measured + force * problem._shapes["kick"]
    search = Search(problem)
    search.start()
    search.visit(("kick",))
    assert abs(window_gain(search, ("kick",), NULL).nats) < 1.0
    assert figures_off(search, NULL) == pytest.approx(0.5 * sigmas**2, rel=0.1)
    assert is_unsupported(search, ("kick",)) == (sigmas < 1.0)
