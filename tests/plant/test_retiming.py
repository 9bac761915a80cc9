"""Edges of a table are moved where its execution shows that this comes nearer to the plan."""

from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from ocp.runs import solved

from kemba.ocp import controller_table, load_task
from kemba.ocp.planning import plan
from kemba.plant.controller import execute
from kemba.plant.retiming import (
    ExecutedTable,
    RetimingSettings,
    Roundings,
    edges_of,
    executed_table,
    moves,
    retimed,
    shared_edges,
    with_moved,
)
from kemba.trajectory import Trajectory


def late(table: Trajectory, ticks: int) -> Trajectory:
    """The table with every valve of the front leg that many ticks late."""
    columns = dict(zip(table.headers, (table[n] for n in table.names), strict=True))
    for header, values in columns.items():
        if header.startswith("front/valve/extend"):
            columns[header] = np.concatenate([np.zeros(ticks), values[:-ticks]])
    return Trajectory(table.time, columns, table.meta)


def test_a_table_with_a_late_valve_comes_nearer_to_its_plan() -> None:
    """Further off than by rounding, so the search may take longer."""
    run = solved("jump")
    spoilt = late(controller_table(run.model, run.plan), 2)
    with patch.object(RetimingSettings, "executions", 80):
        mended = retimed(run.model, run.plan, spoilt).table
    errors = [execute(t, run.model).against(run.model, run.plan) for t in (spoilt, mended)]
    assert abs(errors[1].apex_error_m) < 0.7 * abs(errors[0].apex_error_m)
    assert mended.headers == spoilt.headers


def test_two_late_edges_of_all_legs_are_found_in_few_executions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """No single move makes them good."""
    found = plan(*load_task("jump.yaml", ["height=0.48 m"]))
    table = controller_table(found.model, found.trajectory)
    spoilt = with_moved(table, shared_edges(table)[:2], (1, 1))
    assert spoilt is not None
    errors = []

    def noted(*given: Any, **named: Any) -> ExecutedTable:
        done = executed_table(*given, **named)
        errors.append(done.error)
        return done

    monkeypatch.setattr("kemba.plant.retiming.executed_table", noted)
    mended = retimed(found.model, found.trajectory, spoilt)
    assert errors[0] > 2.0 and errors[-1] <= 1.0
    assert len(errors) <= 2 + len(shared_edges(table))
    assert mended.table is not spoilt and mended.error == errors[-1]


def test_moves_are_all_different_and_move_something() -> None:
    found = moves(6)
    assert len(np.unique(found, axis=0)) == len(found)
    assert np.abs(found).sum(axis=1).min() == 1 and np.abs(found).max() == 2
    assert (found != 0).sum(axis=1).max() == 4
    assert (moves(40) != 0).sum(axis=1).max() == 2, "more at once would be too many"


def test_edges_that_would_meet_do_not_move() -> None:
    table = controller_table(solved("jump").model, solved("jump").plan)
    column, (opens, closes, *_) = next((c, t) for c, t in edges_of(table).items() if len(t) > 1)
    assert with_moved(table, [[(column, 0)]], [closes - opens]) is None
    assert with_moved(table, [[(column, 0)]], [-1 - opens]) is None, "before the table begins"


def test_a_table_that_is_near_enough_stays() -> None:
    run = solved("jump")
    table = controller_table(run.model, run.plan)
    with patch.multiple(RetimingSettings, apex=1.0, touchdown=1.0, final=1.0):
        assert retimed(run.model, run.plan, table).table is table


@pytest.mark.parametrize("column", ["front/valve/extend", "rear/valve/retract"])
def test_valves_stay_zero_or_one(column: str) -> None:
    run = solved("jump")
    mended = retimed(run.model, run.plan, late(controller_table(run.model, run.plan), 3)).table
    assert set(np.unique(mended[column])) <= {0.0, 1.0}


def test_an_execution_with_other_flights_tells_no_slopes() -> None:
    """Two flights where the plan has one: nothing to compare, and no error."""
    run = solved("jump")
    table = controller_table(run.model, run.plan)
    errors = iter([np.full(3, 2.0), *([np.full(6, 1.5)] * 20)])

    def executed(tried: Trajectory) -> ExecutedTable:
        signed = next(errors)
        return ExecutedTable(tried, None, signed, float(signed.max()))

    search = Roundings(executed, 10)
    best = search.around(search.tried(table), shared_edges(table))
    assert best.error == 1.5
