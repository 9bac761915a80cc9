"""A round of learning as one HTML page: error before and after, executed and expected."""

import shlex
from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import Any

from kemba.ocp import load_task, task_model
from kemba.plotting.studies import plot_executions, plot_rounds
from kemba.plotting.style import svg_text
from kemba.report.charts import pairs, table
from kemba.report.verdict import ReviewVerdict
from kemba.report.view import write_page
from kemba.rounds.outcome import ExpectedApex
from kemba.rounds.round import Round, executed_on


def write_learning(found: Round, folder: Path) -> Path:
    """Write learn.html to the folder of the new run; it needs no other file."""
    parts = [
        verdict_of(found, folder).html(),
        f'<div class="facts">{"".join(_tables(found))}</div>',
        "<h2>Executed and expected</h2>",
        "<p>The run that was learnt from: what the robot did, and what the models before and "
        "after this round say that its controller table does.</p>",
        f"<figure>{svg_text(_executions(found))}</figure>",
        "<h2>Rounds</h2>",
        f"<figure>{svg_text(_rounds(found))}</figure>",
        _growth(found),
        f"<p>{escape(_correction(found))}</p>",
    ]
    title = f"Round {found.past.round} of learning: {folder.resolve().name}"
    return write_page(folder / "learn.html", title, "\n".join(parts))


def verdict_of(found: Round, folder: Path) -> ReviewVerdict:
    """The round in words, and what to do with its plan."""
    run = shlex.quote(str(folder))
    if not found.good:
        aim = "do not send it to the robot; see why:"
        return ReviewVerdict("bad", found.sentence, aim, f"kemba-opt report {run}")
    sure = found.answer.verdict in ("missing", "nothing")
    aim = "send controller.csv to the robot, or execute it on the simulated one:"
    command = f"kemba-opt simulate {run} --repeat 3 --noise"
    return ReviewVerdict("good" if sure else "fair", found.sentence, aim, command)


def _tables(found: Round) -> Iterable[str]:
    yield pairs("what was learnt", [
        ("verdict", found.answer.verdict),
        ("added", ", ".join(found.answer.added) or "nothing"),
        ("model error before", f"{found.compare_before:.2f} times the noise"),
        ("model error after", f"{found.compare_after:.2f} times the noise"),
        ("logs", len(found.past.logs)),
    ])  # fmt: skip
    yield pairs("apex of the run that was executed", [
        ("planned", f"{found.planned.apex:.4f} m"),
        ("executed, mean", f"{found.executed_apex:.4f} m"),
        ("model before", f"{found.before.apex:.4f} m"),
        ("model after", f"{found.simulated.apex:.4f} m"),
    ])  # fmt: skip
    yield pairs("touchdown of that run", [
        ("planned", _seconds(found.planned.touchdown)),
        ("executed, mean", _seconds(found.executed_touchdown)),
        ("model before", _seconds(found.before.touchdown)),
        ("model after", _seconds(found.simulated.touchdown)),
    ])  # fmt: skip
    if found.aimed is not None and found.target is not None:
        landing = 1e3 * (found.aimed.expected.touchdown - found.target.touchdown)
        yield pairs("the next run", [
            ("planned apex", f"{found.target.apex:.4f} m"),
            ("expected apex", f"{found.aimed.expected.apex:.4f} m"),
            ("its 95 % band", str(found.next_expected or "not known")),
            ("expected touchdown", f"{landing:+.1f} ms from the plan's"),
        ])  # fmt: skip


def _growth(found: Round) -> str:
    """The model of every round: what was added, its error before and after, and where the run that
    was learnt from came down beside what was expected of it."""
    rows = []
    for told in (*found.past.history, {"round": found.past.round, **found.facts}):
        band = ExpectedApex.of(told.get("was_expected"))
        apex = told.get("executed_apex_m")
        inside = "" if band is None or apex is None else "yes" if band.holds(apex) else "no"
        added = [f"<b>{escape(n)}</b> {escape(v)}" for n, v in (told.get("effects") or {}).items()]
        rows.append((
            str(told["round"]),
            "<br>".join(added) or "nothing",
            f"{told['compare_before']:.2f} to {told['compare_after']:.2f}",
            "" if apex is None else f"{apex:.4f} m",
            "" if band is None else str(band),
            inside,
        ))  # fmt: skip
    heads = ("round", "added to the model", "error / noise", "executed apex", "expected", "inside")
    return table("The model, round by round", heads, rows)


def _seconds(value: float) -> str:
    return f"{value:.3f} s" if value == value else "none"


def _executions(found: Round) -> Any:
    run = found.past.runs[found.past.last]
    task = load_task(run.task)[0]
    plan, commands = run.trajectory, run.controller
    expected = {}
    for what, model in (("model before", task.model), ("model after", found.model)):
        built = task_model(task.model_copy(update={"model": model}))
        expected[what] = executed_on(built, plan, commands)
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
    limited = f" ({', '.join(c.limited)}: the most that is corrected)" if c.limited else ""
    return (
        f"What the learnt model does not explain of {c.logs} logs: {1e3 * c.apex:+.1f} mm at the "
        f"apex and {1e3 * c.touchdown:+.1f} ms at touchdown{limited}. It is not added to the "
        f"model: {edges} valve edges of controller.csv were moved for it (correction.yaml)."
    )
