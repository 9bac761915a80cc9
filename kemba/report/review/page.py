"""The whole page: verdict, motions, limits, energy, where the model fails, what it lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kemba.config import load_yaml
from kemba.errors import KembaError
from kemba.folders import place_for, typed
from kemba.identify.answer import read_answer
from kemba.identify.logs.gate import BadData
from kemba.identify.logs.reading import read_logs
from kemba.logs import load_map
from kemba.model import build_model, load_spec
from kemba.plotting import Machine, load_machine
from kemba.quantity import to_si
from kemba.report.review.belonging import Stranger, doubt, own_run, strangers
from kemba.report.review.charts import Book
from kemba.report.review.details import certificate_tables, origin
from kemba.report.review.events import Events, events_of, marks_of
from kemba.report.review.html import folded, section
from kemba.report.review.lacking.found import Facts, answer_parts
from kemba.report.review.lacking.model_error import (
    ModelError,
    error_tables,
    missing_charts,
    model_error,
)
from kemba.report.review.limits.summary import energy_parts, event_table, limit_parts
from kemba.report.review.motion import (
    FORCES,
    JOINTS,
    body_charts,
    leg_charts,
    rig_charts,
)
from kemba.report.review.tracks import Track, gather, grid_of, plan_of
from kemba.report.review.verdict import ReviewVerdict, of_answer, of_bad_data, of_logs, of_plan
from kemba.report.stage import page_text, stage, write_page
from kemba.runs import Run, load_run
from kemba.scene import FLAT, Scene, scene_in
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory

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

    `run`, `answer`: folders of solve and discover. `model`: what the logs are compared with, by
    default that of the run's task. The page needs no other file. Raises KembaError where a file
    cannot be read or written, or nothing is given.
    """
    given = gather_material(logs, run, answer, model, column_map, tell)
    tell("drawing")
    path = place_for(out, default_path(logs, run, answer), force)
    try:
        title, body, verdict = page_of(given)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        what = f"its certificate or manifest is not as solve writes it ({error!r})"
        raise KembaError(str(run or answer), what, hint="solve the task again") from None
    return write_page(path, title, body), verdict


def report_run(
    run: str | Path, out: str | Path | None = None, force: bool = False
) -> tuple[Path, ReviewVerdict]:
    """The page of a run alone, by default a new `report.html` in it. Raises KembaError."""
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
    """Read everything; the comparison of the logs included."""
    if not logs and run is None and answer is None:
        raise KembaError("", "nothing to review", "logs, --run or --answer was expected")
    found = load_run(run) if run is not None else None
    task: Any = load_yaml(found.task).data if found else {}
    asked = task if isinstance(task, dict) else {}
    judged = str(model or asked.get("model") or PLANNING)
    supply = to_si(asked["supply"], "Pa") if asked.get("supply") is not None else None
    columns = load_map(column_map) if column_map else None
    tell("reading")
    read = read_logs(logs, columns) if logs else []
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
        motion = _robot_parts(given, book, machine) if machine else _rig_parts(book)
        parts += [section("Events", event_table(tracks, events)), *motion]
        parts.append(_errors(given, book))
    parts.append(_found(given))
    if given.run:
        facts = "".join(certificate_tables(given.run.certificate))
        parts.append(folded("Plan in numbers", f'<div class="facts">{facts}</div>', not given.logs))
        parts += list(origin(given.run))
    if tracks:
        parts.append(_scripts(book))
    return _title(given), "\n".join(part for part in parts if part), verdict


def _robot_parts(given: Material, book: Book, machine: Machine) -> list[str]:
    model = build_model(load_spec(given.model), supply=given.supply, scene=given.scene)
    certificate = given.run.certificate if given.run else {}
    plan = plan_of(book.tracks)
    below = (
        "Below each figure: the difference from the plan. " if plan and len(book.tracks) > 1 else ""
    )
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


def _rig_parts(book: Book) -> list[str]:
    return [section("Tests", book.key(), rig_charts(book))]


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
    words = {
        "logs": typed([log.meta["path"] for log in given.logs], given.column_map, own),
        "answer": str(given.answer_folder),
        "task": str(given.run.task) if given.run else "jump.yaml",
    }
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


def _scripts(book: Book) -> str:
    """The library with its licence notice, our script and the numbers."""
    return (
        f"<style>{page_text('uplot.min.css')}</style>\n"
        f"<script>/*!\n{page_text('uplot.LICENSE')}\n*/\n{page_text('uplot.min.js')}</script>\n"
        f"<script>{page_text('charts.js')}charts({book.data()});</script>"
    )
