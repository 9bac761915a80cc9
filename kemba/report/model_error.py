"""Where the model fails on the logs, by quantity and phase, and what it lacks."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from kemba.errors import enumerated
from kemba.identify.compare.bins import MODES, PHASES, ConditionBin, order_of
from kemba.identify.compare.compare import Comparison
from kemba.identify.compare.words import owner, usual_unit
from kemba.identify.problem.problem import MissingForce
from kemba.identify.workflow import check_all, compare_read, model_of
from kemba.report.charts import COMPARED, Book, Chart, Curve, meter, onto, picture, table
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Trajectory

Facts = Mapping[str, Any]
PICTURES = {
    "heat_map": "Error / noise by channel, motion and valve mode, before and after",
    "missing_force": "Missing force in time with its 95 % band, and what the answer explains of it",
    "residual": "Error of the worst channel in time, before and after",
}
RANKED = 8  # effects shown


def answer_parts(answer: Facts, folder: Path, pictures: bool) -> list[str]:
    """The answer as HTML; with `pictures` the figures that discover drew."""
    sentence, formula = str(answer.get("sentence", "")), str(answer.get("formula") or "")
    parts = [
        f"<p>{escape(sentence)}</p>",
        f'<div class="facts">{_before_after(answer)}{_ladder(answer)}</div>',
        _ranking(answer),
    ]
    remarks = answer.get("remarks") or []
    if remarks:
        listed = "".join(f"<li>{escape(str(remark))}</li>" for remark in remarks)
        parts.append(f"<ul>{listed}</ul>")
    groups = "; ".join(enumerated(group) for group in answer.get("alike") or ())
    if groups:
        parts.append(f"<p>These logs hold too little to tell apart {escape(groups)}.</p>")
    if formula and formula not in sentence:
        parts.append(f"<p>A formula that fits: <code>{escape(formula)}</code></p>")
    if pictures:
        parts += [picture(folder / f"{name}.png", alt) for name, alt in PICTURES.items()]
    return parts


def _before_after(answer: Facts) -> str:
    before, after = _number(answer.get("error_before")), _number(answer.get("error_after"))
    if before is None or after is None:
        return ""
    size = max(before, after, 1.0)
    rows = [
        ("start model", meter(before / size, f"{before:.2f}", "before")),
        ("with what was found", meter(after / size, f"{after:.2f}")),
        ("sensor noise alone", meter(1.0 / size, "1.00")),
    ]
    excess = _number(answer.get("excess_before")), _number(answer.get("excess_after"))
    if excess[0] is not None and excess[1] is not None:
        rows.append(("beyond the noise", f"{excess[0]:.2f} before, {excess[1]:.2f} after"))
    judged = str(answer.get("split_by") or "")
    title = "Error / noise on data that were not fitted" + (f" ({judged})" if judged else "")
    return table(title, ("model", "error / noise"), [(escape(n), v) for n, v in rows])


def _ladder(answer: Facts) -> str:
    steps = [(str(name), _number(error)) for name, error in answer.get("ladder") or []]
    known = [(name, error) for name, error in steps if error is not None]
    if len(known) < 2:
        return ""
    size = max(error for _, error in known)
    rows = [
        (escape(name if i == 0 else f"+ {name}"), meter(error / size, f"{error:.2f}"))
        for i, (name, error) in enumerate(known)
    ]
    return table("Ladder: the error as effects are added", ("model", "error / noise"), rows)


def _ranking(answer: Facts) -> str:
    heads = ("effect", "probability", "parameters (95 %)", "error after", "cannot be told from")
    listed: Sequence[Facts] = answer.get("ranking") or []
    rows = [_ranked(one, answer.get("added") or ()) for one in listed[:RANKED]]
    return table("Ranking: how likely each effect is among the missing ones", heads, rows)


def _ranked(one: Facts, added: Collection[Any]) -> tuple[str, ...]:
    share = _number(one.get("probability")) or 0.0
    name = escape(str(one.get("effect", "?")))
    after = _number(one.get("error_after"))
    return (
        f"<b>{name}</b> (added)" if one.get("effect") in added else name,
        meter(share, f"{100.0 * share:.1f} %"),
        escape(", ".join(f"{k} = {_value(v)}" for k, v in (one.get("parameters") or {}).items())),
        "" if after is None else f"{after:.2f}",
        escape(", ".join(map(str, one.get("equivalent_to") or ()))),
    )


def _value(given: Any) -> str:
    if not isinstance(given, Mapping):
        return str(given)
    value, low, high = (_number(given.get(key)) for key in ("value", "low", "high"))
    unit = str(given.get("unit", "1"))
    text = "?" if value is None else f"{value:.3g}" + ("" if unit == "1" else f" {unit}")
    return text if low is None or high is None else f"{text} ({low:.3g} to {high:.3g})"


def _number(value: Any) -> float | None:
    known = isinstance(value, int | float) and math.isfinite(value)
    return float(value) if known else None


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
    columns = sorted({(b.phase, b.mode) for b in bins}, key=order_of)
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


def _cell(one: ConditionBin | None) -> str:
    if one is None or not math.isfinite(one.ratio):
        return "<td></td>"
    share = math.log(max(one.ratio, 1.0)) / math.log(CEILING)
    step = min(int(share * len(SCALE)), len(SCALE) - 1)
    ink = "#fff" if step >= LIGHT else "#222"
    sure = ' class="sure"' if one.significant else ""
    text = f"{one.ratio:.1f}" if one.ratio < 9.95 else f"{one.ratio:.0f}"
    return f'<td{sure} style="background:{SCALE[step]};color:{ink}">{text}</td>'


BANDS = 4  # channels of the missing force that are shown


@dataclass(frozen=True)
class ModelError:
    """A comparison, with the names of the logs it used."""

    found: Comparison
    logs: tuple[str, ...]


def model_error(logs: Sequence[Trajectory], model: str, tell: Tell = silent) -> ModelError:
    """Compare the first logs with a model. Raises KembaError; BadData for impossible logs."""
    chosen = list(logs[:COMPARED])
    check_all(logs, model_of(logs, model))
    found, _ = compare_read(chosen, model, tell)
    return ModelError(found, tuple(str(log.meta["name"]) for log in chosen))


def error_tables(error: ModelError, total: int) -> str:
    """The sentence of the comparison, the heat map, and errors by channel."""
    found = error.found
    largest = max((c.ratio for c in found.channels), default=1.0)
    rows = []
    for c in found.channels:
        name, _, unit = c.name.rstrip("]").partition(" [")
        usual, factor = usual_unit(unit)
        sizes = (f"{factor * value:.2g}" for value in (c.rmse, c.max, c.noise_sigma))
        bar = meter(c.ratio / largest, f"{c.ratio:.1f}")
        rows.append((escape(f"{name} [{usual}]"), *sizes, bar))
    heads = ("channel", "RMS error", "largest", "noise", "error / noise")
    who = f"Model: {found.model}. Logs: {', '.join(error.logs)}"
    if total > len(error.logs):
        who += f", the first of {total}; kemba-opt compare uses all"
    return "\n".join(
        [
            f"<p>{escape(found.sentence)}</p>",
            f'<p class="soft">{escape(who)}.</p>',
            '<div class="facts">',
            heat_table(found.bins),
            table("Predicted over short times from the measured motion", heads, rows),
            "</div>",
        ]
    )


def missing_charts(book: Book, error: ModelError, clock: Callable[[str], float]) -> str:
    """The missing force of the log that lacks most, with its 95 % band.

    `clock`: the seconds that are added to the times of a log for the page's clock.
    """
    if not error.found.missing:
        return ""
    worst = max(error.found.missing, key=lambda m: float(np.max(m.evidence())))
    order = np.argsort(-worst.evidence())[:BANDS]
    shift = clock(worst.run)
    shown = "".join(_band(book, worst, k, shift) for k in sorted(order.tolist()))
    note = f"Of {worst.run}. Where the band leaves zero, the model lacks a force there."
    if worst.stance:
        note += " While a foot stands, the ground hides most of a missing force."
    return f'<p class="soft">{escape(note)}</p><div class="grid">{shown}</div>'


def _band(book: Book, missing: MissingForce, k: int, clock: float) -> str:
    ends, time = missing.band(), missing.time + clock
    force, low, high = (onto(book.grid, time, of[:, k]) for of in (missing.force, *ends))
    title, unit = f"Missing on {owner(missing.channels[k])}, 95 % band", missing.units[k]
    stands = [(a + clock, b + clock) for a, b in missing.stance]
    lines = [Curve("missing", force)]
    return book.add(Chart(title, unit, lines, (low, high), levels=(0.0,), stands=stands))
