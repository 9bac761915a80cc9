"""The answer of `discover` on the page: error before and after, ladder, ranking."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from kemba.report.review.html import meter, picture, table

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
