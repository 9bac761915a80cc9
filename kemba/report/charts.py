"""Charts of the review: SVG that scripts can zoom, the tracks they draw, by the clock of the plan,
and the HTML around them."""

import base64
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any, Literal

import numpy as np

from kemba.files import plain
from kemba.plotting.source import Source, load_source
from kemba.runs import PLANT_RUN, Run
from kemba.trajectory import Array, Trajectory

Role = Literal["plan", "plant", "log"]


POINTS = 1000  # of every curve, so that the page opens fast
BEFORE, AFTER = 0.1, 0.4  # s; shown of a log before the plan begins and after its end
DRAWN = 5  # logs drawn over each other; more cannot be told apart
COMPARED = 2  # logs that the model is compared with: more take longer than 10 s


@dataclass(frozen=True)
class Track:
    """One motion in the plan's clock, with its name on the page."""

    name: str
    role: Role
    source: Source

    @property
    def t(self) -> Trajectory:
        """Its columns."""
        return self.source.trajectory


def gather(run: Run | None, logs: Sequence[Trajectory]) -> list[Track]:
    """The plan and the simulated robot of a run, as far as it has them, then the logs."""
    tracks, table = list[Track](), None
    if run:
        if (run.path / "trajectory.csv").is_file():
            tracks.append(Track("plan", "plan", load_source(run.path)))
        if (run.path / PLANT_RUN).is_file():
            tracks.append(Track("simulated robot", "plant", load_source(run.path / PLANT_RUN)))
        if (run.path / "controller.csv").is_file():
            table = run.controller
    for log in logs[:DRAWN]:
        shown = log if table is None else in_plans_clock(log, table)
        tracks.append(Track(str(log.meta["name"]), "log", Source(log.meta["name"], shown)))
    return tracks


def plan_of(tracks: Sequence[Track]) -> Track | None:
    """The plan among them."""
    return next((track for track in tracks if track.role == "plan"), None)


def grid_of(tracks: Sequence[Track]) -> Array:
    """Times (n,) [s] that all curves share: of the plan with a little around it, else of all."""
    plan = plan_of(tracks)
    low = min(float(track.t.time[0]) for track in tracks)
    high = max(float(track.t.time[-1]) for track in tracks)
    if plan:
        low = max(low, float(plan.t.time[0]) - BEFORE)
        high = min(high, float(plan.t.time[-1]) + AFTER)
    step = 1e-3 * max(1.0, np.ceil((high - low) / POINTS * 1e3))
    first, last = np.ceil(low / step - 1e-6), np.floor(high / step + 1e-6)
    return np.asarray(np.arange(first, last + 1) * step)


def on_grid(track: Track, name: str, grid: Array, steps: bool = False) -> Array:
    """A column at the times (n,) of the grid; NaN before it begins and after it ends."""
    t = track.t
    if not steps or not np.isfinite(t[name]).any():
        return onto(grid, t.time, t[name])
    if track.source.plan:
        row = np.searchsorted(t.time, grid - 1e-9, side="left")
    else:
        row = np.searchsorted(t.time, grid + 1e-9, side="right") - 1
    found = track.source.held(name)[np.clip(row, 0, len(t) - 1)]
    return np.where(_beyond(grid, t.time), np.nan, found)


def onto(grid: Array, time: Array, values: Array) -> Array:
    """Values (n,) at times (n,), interpolated to those (m,) of a grid; NaN before and after."""
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(grid), np.nan)
    found = np.interp(grid, time[known], values[known])
    return np.where(_beyond(grid, time), np.nan, found)


def _beyond(grid: Array, time: Array) -> Array:
    """Which times (m,) of a grid lie before or after others (n,)."""
    return np.asarray((grid < time[0] - 1e-9) | (grid > time[-1] + 1e-9))


Spans = Sequence[tuple[float, float]]
PLAN, PLANT = "#0072b2", "#d55e00"
LOGS = ("#222222", "#009e73", "#8a4f9e", "#7a5c00", "#56b4e9")


@dataclass(frozen=True)
class Curve:
    """A curve (n,) on the page's grid of times; `track` is the number of its motion, which it is
    hidden with; None: it belongs to none."""

    label: str
    values: Array
    track: int | None = None
    dash: bool = False


@dataclass(frozen=True)
class Chart:
    """Curves with one unit. `band`: low and high ends (n,) around the first curve; `levels`:
    limits; `stands`: when a foot stands; `rows`: instead of curves, bars by row and track."""

    title: str
    unit: str
    lines: Sequence[Curve] = ()
    band: tuple[Array, Array] | None = None
    levels: Sequence[float] = ()
    stands: Spans = ()
    rows: Sequence[tuple[str, Sequence[tuple[int, Spans]]]] = ()
    small: bool = False
    least: float = 0.0


@dataclass
class Book:
    """The charts of a page, collected while it is written."""

    grid: Array
    tracks: Sequence[Track]
    marks: Sequence[tuple[float, int]] = ()
    charts: list[dict[str, Any]] = field(default_factory=list)

    def add(self, *charts: Chart) -> str:
        """The charts below each other as one figure; empty where none has anything to show."""
        shown = [chart for chart in charts if _filled(chart)]
        if not shown:
            return ""
        cells = []
        for chart in shown:
            alt = escape(in_words(chart, self.grid, self.tracks))
            size = "small" if chart.small else "rows" if chart.rows else "whole"
            cells.append(
                f'<div class="chart {size}" data-chart="{len(self.charts)}" tabindex="0" role="img"'
                f' aria-label="{alt}"></div>'
            )
            self.charts.append(_plain(chart))
        first = shown[0]
        unit = f" [{first.unit}]" if first.unit else ""
        head = f"<b>{escape(first.title)}</b>{escape(unit)} <output></output>"
        return f"<figure><figcaption>{head}</figcaption>{''.join(cells)}</figure>"

    def key(self) -> str:
        """The names of the motions as buttons that hide and show them."""
        buttons = (
            f'<button type="button" data-track="{i}" aria-pressed="true">'
            f'<i style="border-top:3px {"dashed" if track.role == "plant" else "solid"} '
            f'{colour(self.tracks, i)}"></i>'
            f"{escape(track.name)}</button>"
            for i, track in enumerate(self.tracks)
        )
        inner = f"{''.join(buttons)}<output></output>"
        return f'<div class="key" role="group" aria-label="shown motions">{inner}</div>'

    def data(self) -> str:
        """All numbers as JSON that cannot end a script."""
        looks = [
            {"name": track.name, "colour": colour(self.tracks, i), "dash": track.role == "plant"}
            for i, track in enumerate(self.tracks)
        ]
        time = [round(float(t), 4) for t in self.grid]
        whole = {"time": time, "tracks": looks, "marks": self.marks, "charts": self.charts}
        return script_text(whole)


def script_text(data: dict[str, Any]) -> str:
    """Data as JSON that can stand within a script: no name in it can end the script."""
    text = json.dumps(plain(data), separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


def colour(tracks: Sequence[Track], index: int) -> str:
    """The colour of a motion: of the plan, of the simulated robot, of the logs in turn."""
    role = tracks[index].role
    if role != "log":
        return PLAN if role == "plan" else PLANT
    earlier = sum(track.role == "log" for track in tracks[:index])
    return LOGS[earlier % len(LOGS)]


def in_words(chart: Chart, grid: Array, tracks: Sequence[Track]) -> str:
    """What a chart shows of tracks on a `grid` (n,) as one text."""
    parts = []
    for line in chart.lines:
        known = np.isfinite(line.values)
        if known.any():
            v = line.values[known]
            at = grid[known][int(np.argmax(np.abs(v) if chart.small else v))]
            reach = f"{v.min():.3g} to {v.max():.3g}"
            word = "largest" if chart.small else "highest"
            parts.append(f"{line.label} {reach} {chart.unit}, {word} at {at:.3f} s")
    for label, lanes in chart.rows:
        for track, spans in lanes:
            when = ", ".join(f"{a:.3f} to {b:.3f} s" for a, b in spans) or "never"
            parts.append(f"{label}, {tracks[track].name}: {when}")
    return f"{chart.title}: " + "; ".join(parts)


def _filled(chart: Chart) -> bool:
    return bool(chart.rows) or any(np.isfinite(line.values).any() for line in chart.lines)


def _plain(chart: Chart) -> dict[str, Any]:
    """A chart as JSON: numbers with five digits, gaps as null."""
    return {
        "unit": chart.unit,
        "lines": [
            {"label": w.label, "track": w.track, "dash": w.dash, "v": numbers(w.values)}
            for w in chart.lines
        ],
        "band": [numbers(end) for end in chart.band] if chart.band else None,
        "levels": [float(f"{level:.5g}") for level in chart.levels],
        "stands": _rounded(chart.stands),
        "rows": [
            {"label": label, "lanes": [[track, _rounded(spans)] for track, spans in lanes]}
            for label, lanes in chart.rows
        ],
        "small": chart.small,
        "least": chart.least,
    }


def _rounded(spans: Spans) -> list[list[float]]:
    return [[round(float(a), 4), round(float(b), 4)] for a, b in spans]


def numbers(values: Array) -> list[float | None]:
    """Numbers (n,) with five digits for JSON; null where there is none."""
    return [float(f"{v:.5g}") if np.isfinite(v) else None for v in values]


Rows = Iterable[tuple[str, Any]]


def pairs(title: str, rows: Rows) -> str:
    """A table of names and values; empty without rows."""
    lines = [f"<tr><th>{escape(k)}</th><td>{escape(str(v))}</td></tr>" for k, v in rows]
    if not lines:
        return ""
    return f"<table><caption>{escape(title)}</caption>{''.join(lines)}</table>"


def table(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table with a head; the cells are HTML already. Empty without rows."""
    lines = ["<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows]
    if not lines:
        return ""
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in heads)
    caption = f"<caption><span>{escape(title)}</span></caption>"
    return f'<div class="wide"><table>{caption}<tr>{head}</tr>{"".join(lines)}</table></div>'


def meter(share: float, text: str, kind: str = "") -> str:
    """A bar of a length between 0 and 1, with its number in words beside it."""
    wide = 100.0 * min(max(share, 0.0), 1.0)
    name = f"meter {kind}".strip()
    return f'<span class="{name}"><i style="width:{wide:.1f}%"></i></span> {escape(text)}'


def section(title: str, *parts: str, paper: bool = True) -> str:
    """A part of the page; empty when all its parts are. `paper`: whether it is printed."""
    body = "\n".join(part for part in parts if part)
    kind = "" if paper else ' class="screen"'
    return f"<section{kind}><h2>{escape(title)}</h2>\n{body}</section>" if body else ""


def folded(title: str, body: str, unfolded: bool = False) -> str:
    """A part of the page that is folded up and not printed, unless `unfolded`."""
    if unfolded:
        return section(title, body)
    return f"<details><summary>{escape(title)}</summary>{body}</details>"


def picture(path: Path, alt: str) -> str:
    """A PNG within the page; empty where there is none."""
    if not path.is_file():
        return ""
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{escape(alt)}">'
        f"<figcaption>{escape(alt)}</figcaption></figure>"
    )


def in_plans_clock(log: Trajectory, table: Trajectory) -> Trajectory:
    """The log with plan time 0 at 0 s; `table`: the commands that were sent (controller.csv).

    The valve commands of both are laid over each other: the median of the differences of all
    edges, or of the first of each valve where their numbers differ. A log without valve commands
    begins with the table.
    """
    sent = table.time + start_of(table) - table.time[0]
    pairs = [
        pair
        for name in table.names
        if "valve/" in name and name in log
        for pair in _pairs(rises(log.time, log[name]), rises(sent, table[name]))
    ]
    shift = float(np.median([b - a for a, b in pairs])) if pairs else sent[0] - log.time[0]
    return log.at_times(log.time + shift)


def start_of(table: Trajectory) -> float:
    """Plan time [s] at which a controller table begins: valves are sent the dead time early."""
    return -float(table.meta.get("lead", -table.time[0]))


def rises(time: Array, command: Array) -> Array:
    """When [s] a valve is switched on; one that is on in the first row counts."""
    on = np.nan_to_num(command) > 0.5
    return np.asarray(time[np.flatnonzero(np.diff(on.astype(int), prepend=0) > 0)])


def _pairs(found: Array, sent: Array) -> list[tuple[float, float]]:
    """Edges that belong together; only the first where one side has more than the other."""
    count = len(found) if len(found) == len(sent) else min(1, len(found), len(sent))
    return list(zip(found[:count].tolist(), sent[:count].tolist(), strict=True))
