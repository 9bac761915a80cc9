"""Where a model fails: noise ratios by channel, phase and valve mode, and one plain sentence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.stats import chi2, false_discovery_control

from kemba.identify.compare_hints import Hint, hints
from kemba.identify.problem import Array, Problem, Rows

FEWEST = 30  # rows that make a cell
TOLERATED = 1.15  # error ratio that a good model may have: nobody's nominal figures are exact
FALSE_DISCOVERIES = 0.01
GOOD, FAIR = 1.15, 1.5


@dataclass(frozen=True)
class ChannelError:
    """One channel: error over windows in its unit, its noise, and whitened error by noise."""

    name: str
    rmse: float
    max: float
    noise_sigma: float
    ratio: float


@dataclass(frozen=True)
class Cell:
    """One channel in one phase of motion and valve mode; `q_value` controls false discoveries."""

    channel: str
    phase: str
    mode: str
    ratio: float
    q_value: float


@dataclass(frozen=True)
class Comparison:
    """What `compare` says; `good` where the error is within the noise."""

    logs: tuple[str, ...]
    model: str
    noise_ratio: float
    channels: tuple[ChannelError, ...]
    cells: tuple[Cell, ...]
    hints: tuple[Hint, ...] = ()
    plan: Mapping[str, float] = field(default_factory=dict)
    sentence: str = ""

    @property
    def good(self) -> bool:
        return self.noise_ratio <= GOOD and not any(c.q_value < FALSE_DISCOVERIES for c in self.cells)

    def json(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        return {
            "logs": list(self.logs),
            "model": self.model,
            "noise_ratio": self.noise_ratio,
            "channels": [vars(c) for c in self.channels],
            "cells": [vars(c) for c in self.cells],
            "sentence": self.sentence,
        }


def compare(problem: Problem, model: str, logs: Sequence[str] = ()) -> Comparison:
    """Compare the logs of `problem` with its model as it stands."""
    rows, r = problem.rows(), problem.residual({})
    expected = _expected(problem, len(r))
    cells = tuple(_cells(rows, r, expected))
    found = Comparison(
        tuple(logs) or problem.runs,
        model,
        _ratio(r, expected),
        tuple(_channels(problem, rows, r, expected)),
        cells,
        tuple(hints(problem, rows, r, expected)) if len(r) else (),
    )
    return Comparison(**{**vars(found), "sentence": phrase(found)})


def _expected(problem: Problem, count: int) -> Array:
    power = getattr(problem, "expected_power", None)
    return np.asarray(power()) if power else np.ones(count)


def _ratio(r: Array, expected: Array) -> float:
    return float(np.sqrt(np.sum(r**2) / np.sum(expected))) if len(r) else float("nan")


def measured_units(rows: Rows) -> dict[str, str]:
    """Header of every measured channel: those with a place in a log."""
    units = {"x": "m", "z": "m", "q": "rad", "pitch": "rad", "F": "N", "P": "Pa"}
    found = {}
    for name in rows.channels:
        last = name.rsplit("/", 1)[-1]
        if "/foot/" not in name and last in units:
            found[name] = f"{name} [{units[last]}]"
    return found


def _channels(problem: Problem, rows: Rows, r: Array, expected: Array) -> Iterable[ChannelError]:
    windows = getattr(problem, "window_errors", None)
    errors = windows({}) if windows else {}
    headers = measured_units(rows)
    for k, channel in enumerate(rows.channels):
        own = rows.channel == k
        if channel not in headers or not own.any():
            continue
        error = errors.get(channel, r[own] * rows.sigma[own])
        yield ChannelError(
            headers[channel],
            float(np.sqrt(np.mean(error**2))),
            float(np.max(np.abs(error))),
            float(np.median(rows.sigma[own])),
            _ratio(r[own], expected[own]),
        )


def _cells(rows: Rows, r: Array, expected: Array) -> Iterable[Cell]:
    """Every channel, phase and mode with enough rows; q values over all of them."""
    found = []
    for k, channel in enumerate(rows.channels):
        own = rows.channel == k
        for phase in np.unique(rows.phase[own].astype(str)):
            for mode in np.unique(rows.mode[own].astype(str)):
                here = own & (rows.phase == phase) & (rows.mode == mode)
                if here.sum() >= FEWEST:
                    p = excess(r[here], expected[here])
                    found.append((channel, phase, mode, _ratio(r[here], expected[here]), p))
    if not found:
        return
    q = false_discovery_control([p for *_, p in found])
    for (channel, phase, mode, ratio, _), q_value in zip(found, q, strict=True):
        yield Cell(channel, str(phase), str(mode), ratio, float(q_value))


def excess(r: Array, expected: Array) -> float:
    """p value of rows whose power is more than a good model's: correlated rows count for less."""
    power = r**2 / expected
    centred = power - power.mean()
    spread = float(centred @ centred)
    echo = float(centred[1:] @ centred[:-1]) / spread if spread > 0 else 0.0
    count = len(r) * (1.0 - max(echo, 0.0)) / (1.0 + max(echo, 0.0))
    ratio = float(np.sum(r**2) / np.sum(expected)) / TOLERATED**2
    return float(chi2.sf(ratio * count, count))


def phrase(found: Comparison) -> str:
    """The answer in plain words."""
    ratio = f"{found.noise_ratio:.2g} times the noise"
    bad = sorted((c for c in found.cells if c.q_value < FALSE_DISCOVERIES), key=lambda c: -c.ratio)
    if found.good:
        return f"The model explains the logs to within the noise: its error is {ratio}."
    if not bad:
        return f"The model's error is {ratio}; no single condition stands out."
    worst = bad[0]
    grade = "nearly explains" if found.noise_ratio < FAIR else "does not explain"
    valves = {"00": "valves off", "10": "extend valve on", "01": "retract valve on"}
    mode = valves.get(worst.mode, "both valves on")
    parts = [
        f"The model {grade} the logs: its error is {ratio}",
        f"worst is {worst.channel} in {worst.phase} with {mode} ({worst.ratio:.2g} times)",
        *(hint.text for hint in found.hints[:3]),
    ]
    return "; ".join(parts) + "."
