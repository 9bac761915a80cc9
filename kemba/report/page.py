"""A run as one HTML page: verdict, figures in numbers, pictures, motion, and where it came from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Any

from kemba.errors import KembaError
from kemba.folders import place_for
from kemba.plotting import draw, load_source, svg_text
from kemba.report.stage import stage, write_page
from kemba.report.verdict import EXECUTIONS
from kemba.runs import Run, load_run

Rows = Iterable[tuple[str, Any]]


def report_run(run: str | Path, out: str | Path | None = None, force: bool = False) -> Path:
    """Write the page of a run folder to `out`, by default a new `report.html` in it.

    The page needs no other file. Raises KembaError when the run has no certificate.
    """
    found = load_run(run)
    answer = found.certificate
    try:
        good = answer.get("good", answer["status"] == "solved")
        facts = [
            f'<p class="verdict{"" if good else " bad"}">{escape(answer["sentence"])}</p>',
            f'<div class="facts">{"".join(_tables(answer))}</div>',
        ]
        title = f"{answer['task']}: {found.path.resolve().name}"
        origin = list(_sources(found))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        what = f"its certificate or manifest is not as solve writes it ({error!r})"
        raise KembaError(str(found.path), what, hint="solve the task again") from None
    parts = [*facts, *_pictures(found), *origin]
    return write_page(place_for(out, found.path / "report.html", force), title, "\n".join(parts))


def _tables(answer: Mapping[str, Any]) -> Iterable[str]:
    cost = answer["cost"]
    yield _table("plan", [
        ("status", answer["status"]),
        ("apex", f"{answer['apex_m']:.4f} m"),
        ("duration", f"{answer['duration_s']:.4f} s"),
        ("squared torque", f"{cost['torque_squared_integral']:.4g} N².m².s"),
        ("open valves", f"{cost['valve_open_s']:.3f} s"),
    ])  # fmt: skip
    yield _table("residuals", [(k, f"{v:.1e}") for k, v in answer["residuals"].items()])
    for key, title in EXECUTIONS.items():
        if answer.get(key):
            yield _table(f"{title}: difference from the plan", _executed(answer[key]))
    yield _table("solving", [
        ("time", f"{answer['solve_s']:.2f} s"),
        ("CPU", f"{answer['solve_cpu_s']:.2f} s"),
        ("iterations", answer["iterations"]),
        ("variables", answer["variables"]),
        ("constraints", answer["constraints"]),
    ])  # fmt: skip
    if answer["worst"]:
        yield _table("worst violations", [
            (w["what"], f"{w['violation']:.3g} {w['unit']} at {w['time_s']:.3f} s")
            for w in answer["worst"]
        ])  # fmt: skip


def _executed(facts: Mapping[str, Any]) -> Rows:
    yield "apex", f"{1e3 * facts['apex_error_m']:+.2f} mm"
    if facts["touchdown_error_s"] is not None:
        yield "touchdown", f"{1e3 * facts['touchdown_error_s']:+.2f} ms"
    yield "end", f"{1e3 * facts['final_error_m']:.2f} mm"
    yield "landing", "good" if facts["landed"] else facts.get("fault") or "failed"


def _table(title: str, rows: Rows) -> str:
    lines = (f"<tr><th>{escape(k)}</th><td>{escape(str(v))}</td></tr>" for k, v in rows)
    return f"<table><caption>{escape(title)}</caption>{''.join(lines)}</table>"


def _pictures(run: Run) -> Iterable[str]:
    """Figure and motion, where there is one: a refused task has none."""
    if not (run.path / "trajectory.csv").is_file():
        return
    source = load_source(run.path)
    yield f"<h2>Motion</h2>{stage(source)}"
    yield f"<h2>Plan</h2><figure>{svg_text(draw([source]))}</figure>"


def _sources(run: Run) -> Iterable[str]:
    yield f"<h2>Task</h2><pre>{escape(run.task.read_text(encoding='utf-8'))}</pre>"
    manifest = run.manifest
    facts = [(key, manifest[key]) for key in ("started", "finished") if manifest.get(key)]
    facts += [("command", " ".join(manifest.get("command", [])))]
    facts += list(manifest.get("versions", {}).items())
    facts += [(name, f"SHA-256 {value[:16]}") for name, value in manifest.get("inputs", {}).items()]
    yield f"<h2>Origin</h2>{_table('', facts)}"
