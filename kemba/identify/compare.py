"""Where a model fails: noise ratios by channel, phase and valve mode, and one plain sentence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.stats import chi2, false_discovery_control

from kemba.identify.compare_hints import Hint, hints
from kemba.identify.problem import Array, Problem, Rows

Index = np.ndarray[Any, np.dtype[np.int_]]

FEWEST = 5  # grains that make a cell
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
        return self.noise_ratio <= GOOD and not any(
            c.q_value < FALSE_DISCOVERIES for c in self.cells
        )

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
    z, members = grains(rows, r, expected, getattr(problem, "grain", 1))
    found = Comparison(
        tuple(logs) or problem.runs,
        model,
        _rms(z),
        tuple(_channels(problem, rows, r, z, members)),
        tuple(_cells(rows, z, members)),
        tuple(hints(problem, rows, r, expected)),
    )
    return Comparison(**{**vars(found), "sentence": phrase(found)})


def _expected(problem: Problem, count: int) -> Array:
    power = getattr(problem, "expected_power", None)
    return np.asarray(power()) if power else np.ones(count)


def grains(rows: Rows, r: Array, expected: Array, size: int) -> tuple[Array, Index]:
    """Sums of `size` successive rows of one run, channel, phase and mode over what noise would
    make of them (k,), and the first row of each (k,).

    A model that is wrong errs for longer than a sample; noise does not.
    """
    labels = (rows.run, rows.channel, rows.phase.astype(str), rows.mode.astype(str))
    fresh = np.ones(len(r), dtype=bool)
    fresh[1:] = np.any([a[1:] != a[:-1] for a in labels], axis=0)
    begin = np.flatnonzero(fresh)
    place = np.arange(len(r)) - np.repeat(begin, np.diff(np.append(begin, len(r))))
    first = np.flatnonzero(place % size == 0)
    total, power = np.add.reduceat(r, first), np.add.reduceat(expected, first)
    return total / np.sqrt(power), first


def _rms(z: Array) -> float:
    return float(np.sqrt(np.mean(z**2))) if len(z) else float("nan")


def measured_units(rows: Rows) -> dict[str, str]:
    """Header of every measured channel: those with a place in a log."""
    units = {"x": "m", "z": "m", "q": "rad", "pitch": "rad", "F": "N", "P": "Pa"}
    found = {}
    for name in rows.channels:
        last = name.rsplit("/", 1)[-1]
        if "/foot/" not in name and last in units:
            found[name] = f"{name} [{units[last]}]"
    return found


def _channels(
    problem: Problem, rows: Rows, r: Array, z: Array, members: Index
) -> Iterable[ChannelError]:
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
            _rms(z[own[members]]),
        )


def _cells(rows: Rows, z: Array, members: Index) -> Iterable[Cell]:
    """Every channel, phase and mode with enough data; q values over all of them."""
    channel, phase, mode = (a[members] for a in (rows.channel, rows.phase, rows.mode))
    found = []
    for k, name in enumerate(rows.channels):
        for p in np.unique(phase[channel == k].astype(str)):
            for m in np.unique(mode[channel == k].astype(str)):
                here = z[(channel == k) & (phase == p) & (mode == m)]
                if len(here) >= FEWEST:
                    found.append((name, str(p), str(m), _rms(here), excess(here)))
    q = false_discovery_control([p for *_, p in found]) if found else ()
    for (name, p, m, ratio, _), q_value in zip(found, q, strict=True):
        yield Cell(name, p, m, ratio, float(q_value))


def excess(z: Array) -> float:
    """p value of errors (n,) larger than a good model's: correlated ones count for less."""
    power = z**2 - np.mean(z**2)
    spread = float(power @ power)
    echo = max(float(power[1:] @ power[:-1]) / spread, 0.0) if spread > 0 else 0.0
    count = len(z) * (1.0 - echo) / (1.0 + echo)
    return float(chi2.sf(np.mean(z**2) / TOLERATED**2 * count, count))


def _first(hints: Sequence[Hint], kind: str) -> Sequence[Hint]:
    return [hint for hint in hints if hint.kind == kind][:1]


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
        *(h.text for kind in ("command", "conflict") for h in _first(found.hints, kind)),
    ]
    return "; ".join(parts) + "."
