"""What counts as violated and what is kept: half a plan, the better iterate, rounded valves."""

from functools import cache

import numpy as np
import pytest
from ocp.test_program import guess, program
from ocp.toys import Push, bead, solve

from kemba.model import load_model
from kemba.ocp import load_task
from kemba.ocp.functions.problem import violation
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.nlp.ipopt import Ipopt, Iterate
from kemba.ocp.relaxation.schedule import confirm
from kemba.ocp.relaxation.session import Schedule
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.symmetry import whole
from kemba.ocp.transcription.transcribe import Parameters, Transcription


def test_a_plan_that_falls_short_on_the_whole_robot_is_solved_there() -> None:
    """A start guess is no plan of the whole robot, whatever is said of it on the half one."""
    half, full = program(True), program(False)
    search = Schedule(full, Ipopt(full, {"max_iter": 1}))
    confirm(search, half, Iterate(guess(half), ending=Ending.SOLVED))
    (attempt,) = search.attempts
    assert (attempt.name, attempt.iterations) == ("whole robot", 1)


@cache
def metre() -> tuple[Transcription, np.ndarray]:
    """A bead pushed for a metre from rest to rest: the program, and a point that solves it."""
    ends = {"body/x": 1.0, "body/vx": 0.0}
    start = {"body/x": 0.0, "body/vx": 0.0}
    found, point = solve(bead(), [Push()], start, end=ends, duration=2.2, nodes=6)
    return found, point.Y


def test_bounds_count_where_the_rows_are_met() -> None:
    """A push of 1.5 N obeys the equations of motion, but Push gives 1 N; a point that is off by
    1 cm/s is nearer."""
    found, good = metre()
    layout = found.layout
    h = layout.half(good, "h")[:, 0]
    force = 1.5 * np.ones(len(h))
    force[0] = 0.0
    v = np.cumsum(h * force) * (np.arange(len(h)) > 0)
    x = np.cumsum(h * v)
    groups = {"q": x, "v": v, "u": force, "h": h}
    strong = layout.pack(
        {g: groups[g][:, None] for g in groups} | {g: np.zeros((len(h), 0)) for g in ("s", "lam")}
    )
    near = good.copy()
    near[3, layout.slices["v"]] += 0.01
    search = Schedule(found, Ipopt(found))
    kept = search.better(Iterate(strong), Iterate(near, ending=Ending.INTERRUPTED), Parameters(0.0))
    assert np.array_equal(kept.Y, near)


def test_valves_are_rounded_to_what_the_task_lets_dwell() -> None:
    """A pulse of one step of 0.14 s stays where valves dwell for 0.1 s, and goes at 0.2 s."""
    for least, stays in (("0.1 s", True), ("0.2 s", False)):
        task, document = load_task("jump.yaml", ["nodes=5", f"min_dwell={least}"])
        model = load_model(task.model)
        t = Transcription(model, task, resolve(task, model, document), whole(model.node), 5)
        Y, column = np.zeros(t.shape), t.layout.binary[0]
        Y[:, t.layout.slices["h"]] = guess(t)[:, t.layout.slices["h"]]
        Y[3, column] = 0.9
        rounded = Schedule(t, Ipopt(t)).valves(Iterate(Y))[column]
        assert rounded.tolist() == [0.0, 0.0, 0.0, float(stays), 0.0, 0.0]


@pytest.mark.parametrize("group", ["v", "u"], ids=["rows violated", "bounds violated"])
@pytest.mark.parametrize("solved_last", [True, False])
def test_a_stop_keeps_the_less_violated_iterate(group: str, solved_last: bool) -> None:
    """10 m/s off is within the bounds but breaks the rows; 10 N is beyond what may push."""
    found, good = metre()
    bad = good.copy()
    bad[3, found.layout.slices[group]] += 10.0
    start, point = (bad, good) if solved_last else (good, bad)
    search, stopped = Schedule(found, Ipopt(found)), Iterate(point, ending=Ending.INTERRUPTED)
    kept = search.better(Iterate(start), stopped, Parameters(0.0))
    assert np.array_equal(kept.Y, good)
    assert kept.ending is Ending.INTERRUPTED


def test_relaxing_allows_pairs_as_much_as_it_says_and_nothing_else() -> None:
    """Products of gaps and forces may be up to eps; no other row knows of it."""
    t = program(True)
    Y = guess(t)
    rows = np.array([m.kind == "pair" for m in t.meanings])
    tight, loose = (
        np.array(t.problem.g(Y.ravel(), Parameters(eps).vector(t.nodes))).ravel()
        for eps in (0.0, 1e-3)
    )
    assert rows.any() and np.all(t.g_upper[rows] == 0.0)
    assert loose[rows] - tight[rows] == pytest.approx(-1e-3)
    assert np.array_equal(loose[~rows], tight[~rows])


@pytest.mark.parametrize(
    ("change", "size"), [(0.0, 0.0), (0.25, 0.25), (-0.25, 0.25)], ids=["kept", "above", "below"]
)
def test_a_row_is_violated_on_either_side(change: float, size: float) -> None:
    found, good = metre()
    g = np.array(found.problem.g(good.ravel(), Parameters(0.0).vector(found.nodes))).ravel()
    g[4] += change
    assert violation(found, g) == pytest.approx(size, abs=1e-9)
