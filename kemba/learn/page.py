"""A round of learning as one HTML page: error before and after, executed and expected."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import Any

from kemba.learn.round import Round
from kemba.ocp import load_task, task_model
from kemba.plant.execution.certificate import rest_after
from kemba.plant.execution.controller import execute
from kemba.plotting.study.learning import plot_executions, plot_rounds
from kemba.plotting.style import svg_text
from kemba.report.review.html import pairs
from kemba.report.stage import write_page

Rows = Iterable[tuple[str, Any]]


def write_learning(found: Round, folder: Path) -> Path:
    """Write learning.html to the folder of the new run; it needs no other file."""
    tone = "" if found.good else " bad"
    parts = [
        f'<p class="verdict{tone}">{escape(found.sentence)}</p>',
        f'<div class="facts">{"".join(_tables(found))}</div>',
        "<h2>Executed and expected</h2>",
        "<p>The run that was learnt from: what the robot did, and what the models before and "
        "after this round say that its controller table does.</p>",
        f"<figure>{svg_text(_executions(found))}</figure>",
        "<h2>Rounds</h2>",
        f"<figure>{svg_text(_rounds(found))}</figure>",
        f"<p>{escape(_correction(found))}</p>",
    ]
    title = f"Round {found.past.round} of learning: {folder.resolve().name}"
    return write_page(folder / "learning.html", title, "\n".join(parts))


def _tables(found: Round) -> Iterable[str]:
    yield pairs("what was learnt", [
        ("verdict", found.answer.verdict),
        ("added", ", ".join(found.answer.added) or "nothing"),
        ("model error before", f"{found.compare_before:.2f} x noise"),
        ("model error after", f"{found.compare_after:.2f} x noise"),
        ("logs", len(found.past.logs)),
    ])  # fmt: skip
    executed = sum(f.apex for f in found.executed) / len(found.executed)
    rows = [
        ("planned", f"{found.planned.apex:.4f} m"),
        ("executed, mean", f"{executed:.4f} m"),
        ("model before", f"{found.before.apex:.4f} m"),
        ("model after", f"{found.simulated.apex:.4f} m"),
    ]
    yield pairs("apex of the run that was executed", rows)
    if found.aimed is not None and found.target is not None:
        landing = 1e3 * (found.aimed.expected.touchdown - found.target.touchdown)
        yield pairs("the next run", [
            ("planned apex", f"{found.target.apex:.4f} m"),
            ("expected apex", f"{found.aimed.expected.apex:.4f} m"),
            ("expected touchdown", f"{landing:+.1f} ms from the plan's"),
        ])  # fmt: skip


def _executions(found: Round) -> Any:
    run = found.past.runs[found.past.last]
    task = load_task(run.task)[0]
    plan, commands = run.trajectory, run.controller
    expected = {}
    for what, model in (("model before", task.model), ("model after", found.model)):
        built = task_model(task.model_copy(update={"model": model}))
        rest = rest_after(built, plan, commands)
        expected[what] = execute(commands, built, extra=rest).trajectory
    executed = found.past.executed[found.past.last]
    return plot_executions(executed, expected, plan)


def _rounds(found: Round) -> Any:
    past = found.past
    errors = [float(e["executed_apex_error_m"]) for e in past.history]
    errors.append(found.executed_apex_error)
    numbers = [*range(past.round - len(errors), past.round)]
    aim = found.expected_apex_error
    return plot_rounds(numbers, errors, None if aim is None else (past.round, aim))


def _correction(found: Round) -> str:
    c = found.correction
    if found.aimed is None:
        return "No table was corrected."
    edges = sum(bool(k) for moved in found.aimed.moved.values() for k in moved)
    limited = f" ({', '.join(c.limited)} at its bound)" if c.limited else ""
    return (
        f"Beyond the learnt model the executions went {1e3 * c.apex:+.1f} mm at the apex and "
        f"{1e3 * c.touchdown:+.1f} ms at touchdown{limited}, by {c.logs} logs. This is no physics: "
        f"it moved {edges} valve edges of controller.csv, and is in correction.yaml alone."
    )
