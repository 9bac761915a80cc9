"""Curves against time as the page's script draws them, and the same in words."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np

from kemba.report.review.tracks import Track
from kemba.trajectory import Array

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
            f'<i style="border-top:3px {_style(track)} {colour(self.tracks, i)}"></i>'
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
        text = json.dumps(whole, separators=(",", ":"), allow_nan=False)
        return text.replace("<", "\\u003c")


def colour(tracks: Sequence[Track], index: int) -> str:
    """The colour of a motion: of the plan, of the simulated robot, of the logs in turn."""
    role = tracks[index].role
    if role != "log":
        return PLAN if role == "plan" else PLANT
    earlier = sum(track.role == "log" for track in tracks[:index])
    return LOGS[earlier % len(LOGS)]


def _style(track: Track) -> str:
    return "dashed" if track.role == "plant" else "solid"


def in_words(chart: Chart, grid: Array, tracks: Sequence[Track]) -> str:
    """What a chart shows as one text."""
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
    """Numbers with five digits for JSON; null where there is none."""
    return [float(f"{v:.5g}") if np.isfinite(v) else None for v in values]
