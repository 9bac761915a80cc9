"""The air of a model is fitted to another machine's motion, and stays where nothing differs."""

from __future__ import annotations

import pytest
from ocp.runs import solved

from kemba.model import load_model
from kemba.model.changes import changed_effects
from kemba.ocp import controller_table
from kemba.plant import execute
from kemba.plant.execution.fitted_air import fitted_air


def test_figures_of_another_machine_are_found() -> None:
    run = solved("jump")
    table, model = controller_table(run.model, run.plan), run.model
    chamber = model.effect("chamber")
    weak = chamber.model_copy(update={"F_extend": tuple(0.93 * F for F in chamber.F_extend)})
    other = execute(table, model.with_effects([weak])).trajectory
    found = fitted_air(model, table, other)
    assert found is not None and found.after < 0.1 * found.before
    assert found.factors["chamber.F_extend"] == pytest.approx(0.93, abs=0.015)
    assert "F_extend -" in found.sentence
    fitted = model.with_effects(changed_effects("planning", found.changes(model)))
    apex = [execute(table, m).trajectory["body/z"].max() for m in (model, fitted)]
    assert abs(apex[1] - other["body/z"].max()) < 0.2 * abs(apex[0] - other["body/z"].max())


def test_nothing_changes_where_nothing_differs() -> None:
    run = solved("jump")
    table = controller_table(run.model, run.plan)
    found = fitted_air(run.model, table, execute(table, run.model).trajectory)
    assert found is not None
    assert set(found.factors.values()) == {1.0}
    assert "hardly changed" in found.sentence


def test_other_chambers_have_no_such_figures() -> None:
    run = solved("jump")
    table, plant = controller_table(run.model, run.plan), load_model("plant")
    assert fitted_air(plant, table, run.plan) is None
