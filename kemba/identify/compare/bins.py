"""Errors by condition: channel, phase of motion, valve mode and region of the piston's stroke."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtrc  # importing scipy.stats takes half a second

from kemba.identify.infer.windows import codes, rms
from kemba.identify.problem.problem import Array, Labels, Rows, Texts


def false_discoveries(chances: Sequence[float] | Array) -> Array:
    """Adjusted chances (n,): the expected share of false ones among those found up to each.

    Source: Benjamini and Hochberg 1995.
    """
    p = np.asarray(chances, dtype=float)
    order = np.argsort(p)
    raised = p[order] * (len(p) / np.arange(1, len(p) + 1))
    least = np.minimum.accumulate(raised[::-1])[::-1]
    found = np.empty(len(p))
    found[order] = np.clip(least, 0.0, 1.0)
    return found


ASSUMED = ("/foot/x", "/foot/z", "/stop")  # channels that no sensor measures
STEADY = ("rest", "stance2")  # phases in which they can be relied on

# phases of motion and open valves (extend, retract) in words, in the order in which they are shown
PHASES = {
    "rest": "at rest",
    "stance2": "two feet stand",
    "stance1": "one foot stands",
    "impact": "touchdown",
    "flight": "in the air",
    "moving": "moving",
}
MODES = {"00": "closed", "10": "extend", "01": "retract", "11": "both"}
REGIONS = ("", "in", "mid", "out")


def order_of(condition: Sequence[str]) -> tuple[int, str, int]:
    """Sort key of a phase, valve mode and, where it is told, region of the stroke."""
    phase, mode, region = (*condition, "")[:3]
    return [*PHASES, phase].index(phase), mode, REGIONS.index(region)


class BinSettings:
    """When the error under one condition is called significant."""

    fewest = 5  # windows that make a bin
    # power of a good model's own error, in units of the noise's: disturbances have a colour; by
    # hand on 17 cases of the twin, benchmarks/pages/tried.md
    own_error = 0.3
    # share of the bins called significant that may be so by chance: Benjamini and Hochberg 1995
    # control it; one in a hundred by convention
    false_discoveries = 0.01
    tolerated = math.sqrt(1.0 + own_error)  # error ratio that a good model may have


@dataclass(frozen=True)
class ConditionBin:
    """One channel in one phase of motion, valve mode and region of the stroke (`in`, `mid`,
    `out`); `q_value` controls false discoveries over all bins of a comparison."""

    channel: str
    phase: str
    mode: str
    region: str
    ratio: float
    q_value: float

    @property
    def significant(self) -> bool:
        return self.q_value < BinSettings.false_discoveries


def condition_bins(rows: Rows, region: Texts, first: Labels, sums: Array) -> Iterable[ConditionBin]:
    """Every condition with enough data.

    The aggregation windows begin at row `first` (k,) and sum to `sums` (k,) in units of noise;
    `region` (n,): region of the stroke of every row. The q values are over all bins returned.
    """
    parts = (rows.phase, rows.mode, region)
    names = [np.unique(a.astype(str)) for a in parts]
    table = np.stack([rows.channel, *(codes(a) for a in parts)], axis=1)[first]
    sound = ~doubtful(rows)[first]
    kinds, own = np.unique(table[sound], axis=0, return_inverse=True)
    groups = [sums[sound][own.ravel() == i] for i in range(len(kinds))]
    fewest = BinSettings.fewest
    known = [i for i, z in enumerate(groups) if len(z) >= fewest]
    q = false_discoveries([excess(groups[i]) for i in known]) if known else ()
    for i, q_value in zip(known, q, strict=True):
        channel, *place = kinds[i]
        labels = [str(n[k]) for n, k in zip(names, place, strict=True)]
        phase, mode, piece = labels
        yield ConditionBin(
            rows.channels[channel], phase, mode, piece, rms(groups[i]), float(q_value)
        )


def doubtful(rows: Rows) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Flags (n,) of rows that assume a foot or a stop to stand still when it may not.

    When feet come and go, a contact may be read a moment early or late: no fault of the model.
    """
    assumed = np.array([name.endswith(ASSUMED) for name in rows.channels])
    return np.asarray(assumed[rows.channel] & ~np.isin(rows.phase.astype(str), STEADY))


def excess(z: Array) -> float:
    """p value of errors z (n,), in units of noise, under a good model.

    Correlated errors count for less. The largest error is left out: a foot that lifts a moment
    early makes one large error, which is no evidence against the model.
    """
    if len(z) > 1:
        z = np.delete(z, np.argmax(np.abs(z)))
    count = len(z) / correlation_length(z**2)
    return float(chdtrc(count, np.mean(z**2) / BinSettings.tolerated**2 * count))


def correlation_length(y: Array) -> float:
    """How many successive values of y (n,) tell as much of its mean as one independent value.

    One plus twice the sum of the autocorrelations up to the first that is not positive (Geyer,
    Statistical Science 7, 1992).
    """
    about = y - np.mean(y)
    power, length = float(about @ about), 1.0
    for lag in range(1, len(y) // 2):
        echo = float(about[lag:] @ about[:-lag])
        if echo <= 0.0:
            break
        length += 2.0 * echo / power
    return length
