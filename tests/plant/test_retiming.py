"""Edges of a table are moved where its execution shows that this comes nearer to the plan."""

from __future__ import annotations

import numpy as np
import pytest
from ocp.runs import solved

from kemba.ocp import controller_table
from kemba.plant import execute
from kemba.plant.execution.retiming import RetimingSettings, retimed
from kemba.settings import changed
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
    with changed(RetimingSettings, executions=80):
        mended = retimed(run.model, run.plan, spoilt)
    errors = [execute(t, run.model).against(run.model, run.plan) for t in (spoilt, mended)]
    assert abs(errors[1].apex_error_m) < 0.7 * abs(errors[0].apex_error_m)
    assert mended.headers == spoilt.headers


def test_a_table_that_is_near_enough_stays() -> None:
    run = solved("jump")
    table = controller_table(run.model, run.plan)
    with changed(RetimingSettings, apex=1.0, touchdown=1.0, final=1.0):
        assert retimed(run.model, run.plan, table) is table


@pytest.mark.parametrize("column", ["front/valve/extend", "rear/valve/retract"])
def test_valves_stay_zero_or_one(column: str) -> None:
    run = solved("jump")
    mended = retimed(run.model, run.plan, late(controller_table(run.model, run.plan), 3))
    assert set(np.unique(mended[column])) <= {0.0, 1.0}
