"""Pieces of HTML that several parts of the page use."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

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
