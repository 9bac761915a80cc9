"""Logs of the full plant, whose air differs from the planning model's in everything."""

from pathlib import Path

import pytest

pytest.importorskip("numba")

from full_plant import answered, plant_log, written

from kemba.identify.infer.search import Search
from kemba.identify.infer.structure import fitted_figures
from kemba.identify.infer.windows import error_ratio
from kemba.identify.problem.candidates import LINE, ORIFICE
from kemba.identify.robot.problem import robot_problem
from kemba.identify.workflow import compare_logs
from kemba.model import load_model

LIKELY = (LINE, "seal_friction", "supply_droop", "both_mode_loss", "payload")


@pytest.mark.slow
def test_orifices_a_line_and_friction_explain_the_full_plant() -> None:
    fitted, kept = (
        robot_problem([plant_log(name) for name in names], load_model("planning"))
        for names in (("hop", "jump height=0.74 m"), ("jump height=0.64 m",))
    )
    usual = error_ratio(kept.rebuilt({}))
    learnt_from = error_ratio(fitted.rebuilt({}))
    built, figures = fitted_figures(fitted.rebuilt({}))
    judge = kept.rebuilt({}).relinearise(figures)
    alone = error_ratio(judge, figures)  # the line's share of it differs from plan to plan
    assert error_ratio(built, figures) < 0.8 * learnt_from and usual > 2.4
    for name in built.own_figures:
        low, high = built.limits(name)
        assert low <= figures[name] <= high
    built.candidates = {name: built.candidates[name] for name in LIKELY}
    search = Search(built, begin=figures)
    best = search.run()
    assert LINE in best
    assert error_ratio(judge, search.points[best].fit.theta) < min(1.1, 0.8 * alone)


@pytest.mark.nightly
def test_discover_names_the_full_plant(tmp_path: Path) -> None:
    """All candidates, from the planning model on; the model written is as good on other logs."""
    fitted, kept = written(tmp_path, 0)
    answer = answered(fitted, kept, None, lambda text: None, tmp_path / "answer")
    assert {ORIFICE, LINE} <= set(answer.added), answer.sentence
    assert answer.error_after < 1.5 < answer.error_before
    assert answer.verdict in ("missing", "partly") and answer.model
    before, after = (compare_logs(kept, name)[0] for name in ("planning", answer.model))
    assert after.noise_ratio < 1.25 < 2.5 < before.noise_ratio
