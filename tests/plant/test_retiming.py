"""Edges of a table are moved where its execution shows that this comes nearer to the plan."""

import numpy as np
from ocp.runs import solved

from kemba.ocp import controller_table, load_task
from kemba.ocp.planning import plan
from kemba.plant.controller import execute
from kemba.plant.retiming import (
    ExecutedTable,
    Roundings,
    edges_of,
    moves,
    retimed,
    shared_edges,
    with_moved,
)
from kemba.trajectory import Trajectory


def test_two_late_edges_of_all_legs_are_found_in_few_executions() -> None:
    """No single move makes them good: errors that are sums of what each edge does."""
    run = solved("jump")
    table = controller_table(run.model, run.plan)
    groups = shared_edges(table)
    spoilt = with_moved(table, groups[:2], (1, 1))
    assert spoilt is not None
    rng, tried, first = np.random.default_rng(0), list[float](), edges_of(table)
    slopes = rng.uniform(1.0, 3.0, (len(groups), 3)) * rng.choice([-1.0, 1.0], (len(groups), 3))

    def executed(other: Trajectory) -> ExecutedTable:
        edges = edges_of(other)
        signed = np.array([edges[v][k] - first[v][k] for (v, k), *_ in groups]) @ slopes
        tried.append(float(np.abs(signed).max()))
        return ExecutedTable(other, signed, tried[-1])

    mended = Roundings(executed, 24).best(spoilt, np.inf)
    assert tried[0] > 1.0 >= mended.error and len(tried) <= 2 + len(groups)
    assert edges_of(mended.table) == edges_of(table)
    assert Roundings(executed, 24).best(table, np.inf).table is table, "it is near enough"


def test_a_table_with_late_edges_comes_nearer_to_its_plan() -> None:
    found = plan(*load_task("jump.yaml", ["height=0.48 m"]))
    table = controller_table(found.model, found.trajectory)
    spoilt = with_moved(table, shared_edges(table)[:2], (1, 1))
    assert spoilt is not None
    mended = retimed(found.model, found.trajectory, spoilt)
    both = (execute(t, found.model) for t in (spoilt, mended))
    errors = [done.against(found.model, found.trajectory) for done in both]
    assert abs(errors[1].apex_error_m) < 0.7 * abs(errors[0].apex_error_m)
    assert all(set(np.unique(mended[c])) <= {0.0, 1.0} for c in edges_of(table))


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


def test_an_execution_with_other_flights_tells_no_slopes() -> None:
    """Two flights where the plan has one: nothing to compare, and no error."""
    run = solved("jump")
    table = controller_table(run.model, run.plan)
    errors = iter([np.full(3, 2.0), *([np.full(6, 1.5)] * 20)])

    def executed(tried: Trajectory) -> ExecutedTable:
        signed = next(errors)
        return ExecutedTable(tried, signed, float(signed.max()))

    search = Roundings(executed, 10)
    best = search.around(search.tried(table), shared_edges(table))
    assert best.error == 1.5
