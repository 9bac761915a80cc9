"""The whole page: verdict, motions, limits, energy, where the model fails, what it lacks."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import load_yaml
from kemba.errors import KembaError, enumerated
from kemba.folders import place_for, typed
from kemba.identify.answer import read_answer
from kemba.identify.logs.gate import BadData
from kemba.identify.logs.reading import OWN_RIGS, read_logs
from kemba.model import build_model, load_spec
from kemba.plotting.source import Machine, load_machine
from kemba.policy.modes import LATEST
from kemba.quantity import to_si
from kemba.report.charts import (
    Book,
    Rows,
    Track,
    folded,
    gather,
    grid_of,
    in_plans_clock,
    pairs,
    plan_of,
    section,
    start_of,
)
from kemba.report.limits import energy_parts, event_table, limit_parts
from kemba.report.model_error import (
    Facts,
    ModelError,
    answer_parts,
    error_tables,
    missing_charts,
    model_error,
)
from kemba.report.motion import (
    FORCES,
    JOINTS,
    Events,
    body_charts,
    events_of,
    leg_charts,
    marks_of,
    rig_charts,
)
from kemba.report.verdict import ReviewVerdict, of_answer, of_bad_data, of_logs, of_plan
from kemba.report.view import page_text, stage, write_page
from kemba.runs import POLICY, Run, load_run
from kemba.scene import FLAT, Scene, scene_in
from kemba.solve.verdict import EXECUTIONS
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory


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


OPEN = "SHARE of the time in which valves are open"


STEP = 5e-4  # s, between the commands that are compared
TICK = 1e-3  # s, period of the controller, by which edges may be off


# of the time in which valves are open: a log with other commands for longer is not one of the run;
# own logs of five simulated runs 0, jumps to 0.50 and 0.51 m 0.05
OTHER = 0.02


@dataclass(frozen=True)
class Stranger:
    """A log that does not belong to the run: why, and of which run it was made by its own words;
    `share`: of the open time of the valves with other commands, 0 where that is not the reason."""

    name: str
    why: str
    made_of: str = ""
    share: float = 0.0


def strangers(run: Run, logs: Sequence[Trajectory]) -> list[Stranger]:
    """The logs that are not executions of a run, as far as legs, commands and sidecars tell.

    Commands decide: the folder of a run may have another name today. Only a log without commands
    is judged by the name that its sidecar gives.
    """
    if not (run.path / "controller.csv").is_file():
        return []
    found = []
    # by how much [s] feedback may move an edge
    late = 1e-3 * LATEST if (run.path / POLICY).is_file() else 0.0
    for log in logs:
        name, made_of = str(log.meta.get("name", "the log")), str(log.meta.get("repeat_of", ""))
        share = other_commands(log, run.controller, late)
        why = _reason(log, run, made_of, share)
        if why:
            found.append(Stranger(name, why, made_of, share or 0.0))
    return found


def _reason(log: Trajectory, run: Run, made_of: str, share: float | None) -> str:
    """Why a log is not one of the run, as part of a sentence; empty where nothing speaks
    against it."""
    theirs, ours = _legs(log), _legs(run.controller)
    if log.meta.get("kind", "robot") != "robot":
        return f"it is of a rig ({log.meta['kind']}), and the run is that of a robot"
    if theirs and theirs != ours:
        return f"its legs are {', '.join(theirs)}, those of the run's robot {', '.join(ours)}"
    other = made_of if made_of not in ("", run.path.resolve().name) else ""
    if share is None:
        return f"it was made of the run {other}" if other else ""
    if share <= OTHER:
        return ""
    made = f"; it was made of the run {other}" if other else ""
    return f"its valve commands are not those of controller.csv for {OPEN}{made}"


def other_commands(log: Trajectory, table: Trajectory, moved: float = 0.0) -> float | None:
    """The share of the time in which valves are open where the log holds another command than the
    table; None without commands. Edges may be off by a sample, a tick and `moved` [s]."""
    shown = in_plans_clock(log, table)
    names = [name for name in table.names if "/valve/" in name and name in shown]
    sent = table.at_times(table.time + start_of(table) - table.time[0])
    begin, end = max(sent.time[0], shown.time[0]), min(sent.time[-1], shown.time[-1])
    if not names or end <= begin:
        return None
    grid = np.arange(begin, end, STEP)
    off = moved + TICK + float(np.median(np.diff(shown.time)))
    wrong, is_open = 0, 0
    for name in names:
        ours, theirs = sent.held(name, grid) > 0.5, shown.held(name, grid) > 0.5
        near = sent.held(name, grid[:, None] + np.linspace(-off, off, 9)) > 0.5
        wrong += int(np.sum(np.where(theirs, ~near.any(axis=1), near.all(axis=1))))
        is_open += int(np.sum(np.logical_or(ours, theirs)))
    return wrong / is_open if is_open else None


def doubt(found: Sequence[Stranger], run: Run) -> str:
    """What speaks against the logs, in sentences; empty without any."""
    groups: dict[str, list[Stranger]] = {}
    for one in found:
        groups.setdefault(one.why, []).append(one)
    return " ".join(_sentence(alike, run) for alike in groups.values())


def own_run(found: Sequence[Stranger], run: Run) -> Path | None:
    """The run beside this one of which all these logs were made, by their own words."""
    named = {one.made_of for one in found} - {""}
    beside = run.path.parent / named.pop() if len(named) == 1 else None
    return beside if beside is not None and (beside / "manifest.json").is_file() else None


def _sentence(alike: Sequence[Stranger], run: Run) -> str:
    """About logs with the same reason; of their shares the largest is given."""
    names = [one.name for one in alike]
    most = f"{100 * max(one.share for one in alike):.0f} %"
    why = alike[0].why.replace("SHARE", most if len(names) == 1 else f"up to {most}")
    if len(names) == 1:
        return f"{names[0]} does not belong to {run.path}: {why}."
    return f"{enumerated(names)} do not belong to {run.path}; of each: {why}."


def _legs(table: Trajectory) -> tuple[str, ...]:
    return tuple(sorted(n.split("/")[0] for n in table.names if n.endswith("/hip/q")))


PLANNING = "planning"


@dataclass(frozen=True)
class Material:
    """What a page is about; each part may be missing."""

    run: Run | None = None
    logs: Sequence[Trajectory] = ()
    answer: Facts = field(default_factory=dict)
    answer_folder: Path = Path()
    model: str = PLANNING
    column_map: str | Path | None = None
    supply: float | None = None
    error: ModelError | None = None
    fault: BadData | None = None
    strangers: Sequence[Stranger] = ()
    scene: Scene = FLAT

    @property
    def rig(self) -> bool:
        """Whether the logs are those of a rig, the paper's or one of the user's own."""
        return bool(self.logs) and self.logs[0].meta["kind"] != "robot"


def review(
    logs: Sequence[str | Path] = (),
    run: str | Path | None = None,
    answer: str | Path | None = None,
    model: str | None = None,
    column_map: str | Path | None = None,
    out: str | Path | None = None,
    force: bool = False,
    tell: Tell = silent,
) -> tuple[Path, ReviewVerdict]:
    """Write the page to `out`, by default beside what it is about; the path and the verdict.

    Without `force` a page that is there already is kept, and a new one is numbered.

    `run`, `answer`: folders of solve and discover. `column_map`: of `logs` of other programs.
    `model`: what the logs are compared with, by default that of the run's task. `tell` gets what is
    being done. The page needs no other file. Raises KembaError where a file cannot be read or
    written, or nothing is given.
    """
    if not logs and run is None and answer is None:
        raise KembaError("", "nothing to review", "logs, --run or --answer was expected")
    path = place_for(out, default_path(logs, run, answer), force)
    given = gather_material(logs, run, answer, model, column_map, tell)
    tell("drawing")
    try:
        title, body, verdict = page_of(given)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        what = f"its certificate or manifest is not as solve writes it ({error!r})"
        raise KembaError(str(run or answer), what, hint="solve the task again") from None
    return write_page(path, title, body), verdict


def report_run(
    run: str | Path, out: str | Path | None = None, force: bool = False
) -> tuple[Path, ReviewVerdict]:
    """The page of `run` alone: `out`, by default a new `report.html` in it, which `force` replaces.
    Raises KembaError."""
    folder = load_run(run).path
    path = place_for(out, folder / "report.html", force)
    return review(run=folder, out=path, force=True)


def default_path(
    logs: Sequence[str | Path], run: str | Path | None, answer: str | Path | None
) -> Path:
    """`review.html` in the answer, else beside the first log, else in the run."""
    if answer is not None:
        return (Path(answer) if Path(answer).is_dir() else Path(answer).parent) / "review.html"
    if logs:
        return Path(logs[0]).parent / "review.html"
    return load_run(run or "").path / "review.html"


def gather_material(
    logs: Sequence[str | Path],
    run: str | Path | None,
    answer: str | Path | None,
    model: str | None,
    column_map: str | Path | None,
    tell: Tell = silent,
) -> Material:
    """Read everything; the comparison of the logs included. Raises KembaError."""
    found = load_run(run) if run is not None else None
    task: Any = load_yaml(found.task).data if found else {}
    asked = task if isinstance(task, dict) else {}
    judged = str(model or asked.get("model") or PLANNING)
    supply = to_si(asked["supply"], "Pa") if asked.get("supply") is not None else None
    tell("reading")
    read = read_logs(logs, column_map) if logs else []
    error, fault = None, None
    if read:
        try:
            error = model_error(read, judged, tell)
        except BadData as bad:
            fault = bad
    facts = read_answer(answer) if answer is not None else {}
    folder = Path(answer) if answer is not None else Path()
    folder = folder if folder.is_dir() else folder.parent
    alien = strangers(found, read) if found else []
    scene = scene_in(asked or (read[0].meta if read else {}), str(found.task) if found else "")
    given = found, read, facts, folder, judged, column_map, supply, error, fault, alien
    return Material(*given, scene)


def page_of(given: Material) -> tuple[str, str, ReviewVerdict]:
    """Title, body and verdict of the page."""
    run = None if given.rig else given.run
    tracks = gather(run, given.logs)
    machine = None if given.rig else load_machine(given.model, given.supply, given.scene)
    planned = plan_of(tracks)
    events = [events_of(t, machine, planned) if machine else None for t in tracks]
    verdict = _verdict(given, tracks, events)
    parts = [verdict.html()]
    if tracks:
        book = Book(grid_of(tracks), tracks, marks_of(events))
        parts.append(section("Events", event_table(tracks, events)))
        if machine:
            parts += _robot_parts(given, book, machine)
        else:
            parts.append(section("Tests", book.key(), rig_charts(book)))
        parts.append(_errors(given, book))
    parts.append(_found(given))
    if given.run:
        facts = "".join(certificate_tables(given.run.certificate))
        parts.append(folded("Plan in numbers", f'<div class="facts">{facts}</div>', not given.logs))
        parts += list(origin(given.run))
    if tracks:
        parts.append(
            f"<style>{page_text('uplot.min.css')}</style>\n"
            f"<script>/*!\n{page_text('uplot.LICENSE')}\n*/\n{page_text('uplot.min.js')}</script>\n"
            f"<script>{page_text('charts.js')}charts({book.data()});</script>"
        )
    return _title(given), "\n".join(part for part in parts if part), verdict


def _robot_parts(given: Material, book: Book, machine: Machine) -> list[str]:
    model = build_model(load_spec(given.model), supply=given.supply, scene=given.scene)
    certificate = given.run.certificate if given.run else {}
    plan = plan_of(book.tracks)
    below = "Below each figure: the difference from the plan. "
    below = below if plan and len(book.tracks) > 1 else ""
    how = (
        '<p class="soft screen">Dotted vertical lines: touchdowns. Grey: a foot stands in the '
        f"first motion. {below}Drag to zoom, double click or Escape to see all again; arrow keys "
        "move the cursor.</p>"
    )
    shown = next((t for t in reversed(book.tracks) if t.role == "plant"), plan)
    shown = next((t for t in book.tracks if t.role == "log"), shown)
    return [
        section("Motion in 3-D", _stage(shown, plan, given.model), paper=False),
        section("Body", book.key(), how, body_charts(book, machine)),
        section("Joints, pistons and valves", leg_charts(book, machine, JOINTS, valves=True)),
        section("Torques, pressures and forces", leg_charts(book, machine, FORCES)),
        section("Limits", *limit_parts(book, model, machine)),
        section("Energy and air", *energy_parts(book, machine, certificate)),
    ]


def _stage(shown: Track | None, plan: Track | None, model: str) -> str:
    """The motion in 3-D with the plan as a ghost; empty where columns are missing."""
    if shown is None:
        return ""
    ghost = plan.source if plan and plan is not shown else None
    try:
        return stage(shown.source, model, ghost, shown.name)
    except KembaError:
        return '<p class="soft">The motion cannot be shown in 3-D: columns are missing.</p>'


def _errors(given: Material, book: Book) -> str:
    if given.error is None:
        return ""
    drawn = (track for track in book.tracks if track.role == "log")
    begins = {
        str(log.meta["name"]): float(track.t.time[0] - log.time[0])
        for log, track in zip(given.logs, drawn, strict=False)
    }
    return section(
        "Where the model fails",
        error_tables(given.error, len(given.logs)),
        missing_charts(book, given.error, lambda name: begins.get(name, 0.0)),
    )


def _found(given: Material) -> str:
    if not given.answer:
        return ""
    parts = answer_parts(given.answer, given.answer_folder, pictures=not given.logs)
    return section("What the model lacks", *parts)


def _verdict(
    given: Material, tracks: Sequence[Track], events: Sequence[Events | None]
) -> ReviewVerdict:
    said = _said(given, tracks, events)
    if not given.strangers or given.run is None:
        return said
    logs = typed([log.meta["path"] for log in given.logs], given.column_map)
    other = own_run(given.strangers, given.run)
    return said.doubted(doubt(given.strangers, given.run), logs, str(other) if other else "RUN")


def _said(
    given: Material, tracks: Sequence[Track], events: Sequence[Events | None]
) -> ReviewVerdict:
    own = None if given.model == PLANNING else given.model
    paths = [log.meta["path"] for log in given.logs]
    words = {
        "logs": typed(paths, given.column_map, own),
        "answer": str(given.answer_folder),
        "task": str(given.run.task) if given.run else "jump.yaml",
    }
    if any(log.meta.get("kind") in OWN_RIGS for log in given.logs):  # with which none jumps
        words["rig"] = typed(paths, given.column_map, f"{given.answer_folder}/model.yaml")
    plan = next((e for t, e in zip(tracks, events, strict=True) if t.role == "plan"), None)
    if given.fault is not None:
        return of_bad_data(str(given.fault.errors[0]), words)
    if given.logs:
        measured = [(t.name, e) for t, e in zip(tracks, events, strict=True) if t.role == "log"]
        found = given.error.found if given.error else None
        return of_logs(measured, plan, found, given.answer or None, words)
    if given.run:
        done = of_plan(given.run.certificate, str(given.run.path), plan)
        if done.grade == "bad" or not given.answer:
            return done
    return of_answer(given.answer, words)


def _title(given: Material) -> str:
    parts = [str(given.run.certificate["task"]), given.run.path.resolve().name] if given.run else []
    if given.logs:
        count = len(given.logs)
        parts.append(given.logs[0].meta["name"] if count == 1 else f"{count} logs")
    if given.answer:
        parts.append(given.answer_folder.resolve().name)
    return " · ".join(parts)
