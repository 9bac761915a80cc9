"""The heat map as a table: errors by channel, phase of motion and valve mode."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from kemba.identify.compare.bins import MODES, PHASES, ConditionBin

SCALE = ("#fffbe6", "#fee9a6", "#fdc766", "#f79a3e", "#b34a06", "#7a2f04")  # light to dark
LIGHT = 4  # from this colour on the numbers are white
CEILING = 30.0  # error ratio of the darkest colour


def heat_table(bins: Sequence[ConditionBin]) -> str:
    """Error by noise; where the stroke was divided, its worst part. Bold: significant."""
    if not bins:
        return ""
    cells: dict[tuple[str, str, str], ConditionBin] = {}
    for one in bins:
        key = (one.channel, one.phase, one.mode)
        if key not in cells or one.ratio > cells[key].ratio:
            cells[key] = one
    columns = sorted({(b.phase, b.mode) for b in bins}, key=_place)
    phases = list(dict.fromkeys(phase for phase, _ in columns))
    top = "".join(
        f'<th scope="col" colspan="{sum(p == phase for p, _ in columns)}">'
        f"{escape(PHASES.get(phase, phase))}</th>"
        for phase in phases
    )
    head = "".join(f'<th scope="col">{MODES.get(mode, escape(mode))}</th>' for _, mode in columns)
    rows = []
    for channel in dict.fromkeys(b.channel for b in bins):
        row = "".join(_cell(cells.get((channel, *column))) for column in columns)
        rows.append(f'<tr><th scope="row">{escape(channel)}</th>{row}</tr>')
    caption = (
        "Error / noise by motion and open valves: 1 is as good as the sensors allow; bold is "
        "significant. Of the regions of the stroke the worst is shown."
    )
    return (
        f'<div class="wide"><p class="soft">{caption}</p><table class="heat">'
        f"<tr><th></th>{top}</tr><tr><th>channel</th>{head}</tr>{''.join(rows)}</table></div>"
    )


def _place(column: tuple[str, str]) -> tuple[int, str]:
    phase, mode = column
    return [*PHASES, phase].index(phase), mode


def _cell(one: ConditionBin | None) -> str:
    if one is None or not math.isfinite(one.ratio):
        return "<td></td>"
    share = math.log(max(one.ratio, 1.0)) / math.log(CEILING)
    step = min(int(share * len(SCALE)), len(SCALE) - 1)
    ink = "#fff" if step >= LIGHT else "#222"
    sure = ' class="sure"' if one.significant else ""
    text = f"{one.ratio:.1f}" if one.ratio < 9.95 else f"{one.ratio:.0f}"
    return f'<td{sure} style="background:{SCALE[step]};color:{ink}">{text}</td>'
