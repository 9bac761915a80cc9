"""What stands behind a plan: certificate, task, and where it came from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

from kemba.report.review.html import Rows, folded, pairs
from kemba.runs import Run
from kemba.solve.verdict import EXECUTIONS

Facts = Mapping[str, Any]


def certificate_tables(answer: Facts) -> Iterable[str]:
    """The certificate as tables. Raises KeyError where it is not as solve writes it."""
    cost = answer["cost"]
    yield pairs("plan", [
        ("status", answer["status"]),
        ("apex of the body's centre", f"{answer['apex_m']:.4f} m"),
        ("duration", f"{answer['duration_s']:.4f} s"),
        ("squared torque", f"{cost['torque_squared_integral']:.4g} N².m².s"),
        ("open valves", f"{cost['valve_open_s']:.3f} s"),
    ])  # fmt: skip
    yield pairs("residuals", [(k, f"{v:.1e}") for k, v in answer["residuals"].items()])
    for key, title in EXECUTIONS.items():
        if answer.get(key):
            yield pairs(f"{title}: difference from the plan", _executed(answer[key]))
    yield pairs("solving", [
        ("time", f"{answer['solve_s']:.2f} s"),
        ("CPU", f"{answer['solve_cpu_s']:.2f} s"),
        ("iterations", answer["iterations"]),
        ("variables", answer["variables"]),
        ("constraints", answer["constraints"]),
    ])  # fmt: skip
    if answer["worst"]:
        yield pairs("worst violations", [
            (w["what"], f"{w['violation']:.3g} {w['unit']} at {w['time_s']:.3f} s")
            for w in answer["worst"]
        ])  # fmt: skip


def _executed(facts: Facts) -> Rows:
    yield "apex", f"{1e3 * facts['apex_error_m']:+.2f} mm"
    if facts["touchdown_error_s"] is not None:
        yield "touchdown", f"{1e3 * facts['touchdown_error_s']:+.2f} ms"
    yield "end", f"{1e3 * facts['final_error_m']:.2f} mm"
    events = [e for e in facts.get("events", ()) if e["kind"] != "apex"]
    if events:
        kept = "as planned" if facts["order_kept"] else "not as planned"
        yield "order of touchdowns and lift-offs", kept
    yield (
        "end" if facts.get("end") else "landing",
        "good" if facts["landed"] else facts.get("fault") or "failed",
    )


def origin(run: Run) -> Iterable[str]:
    """Task and manifest, folded up."""
    task = run.task.read_text(encoding="utf-8")
    yield folded("Task", f"<pre>{escape(task)}</pre>")
    manifest = run.manifest
    facts = [(key, manifest[key]) for key in ("started", "finished") if manifest.get(key)]
    facts += [("command", " ".join(manifest.get("command", [])))]
    facts += list(manifest.get("versions", {}).items())
    facts += [(name, f"SHA-256 {value[:16]}") for name, value in manifest.get("inputs", {}).items()]
    yield folded("Origin", pairs("", facts))
