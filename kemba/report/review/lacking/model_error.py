"""Where the model fails on the logs: heat map, channels, missing force with its band."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from kemba.identify.compare.compare import Comparison
from kemba.identify.problem.types import MissingForce
from kemba.identify.workflow import check_all, compare_read, model_of
from kemba.report.review.charts import Book, Chart, Curve
from kemba.report.review.html import meter, table
from kemba.report.review.lacking.heat import heat_table
from kemba.report.review.tracks import COMPARED
from kemba.stopwatch import Tell, silent
from kemba.trajectory import Array, Trajectory

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
    rows = [
        (
            escape(_readable(c.name)[0]),
            *(f"{_readable(c.name)[1] * value:.2g}" for value in (c.rmse, c.max, c.noise_sigma)),
            meter(c.ratio / largest, f"{c.ratio:.1f}"),
        )
        for c in found.channels
    ]
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


def _readable(header: str) -> tuple[str, float]:
    """A channel's header in millimetres, degrees and bar, and the factor from SI."""
    usual = (("[m]", "[mm]", 1e3), ("[rad]", "[deg]", 180.0 / np.pi), ("[Pa]", "[bar]", 1e-5))
    for unit, better, factor in usual:
        if header.endswith(unit):
            return header.replace(unit, better), factor
    return header, 1.0


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
    low, high = missing.band()

    def at(values: Array) -> Array:
        time = missing.time + clock
        found = np.interp(book.grid, time, values)
        outside = (book.grid < time[0]) | (book.grid > time[-1])
        return np.asarray(np.where(outside, np.nan, found))

    channel = missing.channels[k].replace("piston/x", "rod").replace("hip/q", "hip")
    stands = [(a + clock, b + clock) for a, b in missing.stance]
    return book.add(
        Chart(
            f"Missing on {channel.replace('/', ' ')}, 95 % band",
            missing.units[k],
            [Curve("missing", at(missing.force[:, k]))],
            (at(low[:, k]), at(high[:, k])),
            levels=(0.0,),
            stands=stands,
        )
    )
