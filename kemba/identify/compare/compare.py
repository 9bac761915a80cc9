"""Where a model fails: noise ratios by channel and condition, what the error goes with, how much
force is missing, and one plain sentence."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from kemba.identify.compare.bins import BinSettings, ConditionBin, condition_bins
from kemba.identify.compare.force_profiles import ForceProfile, force_profiles
from kemba.identify.compare.hints import (
    Hint,
    after_commands,
    conflicts,
    lacking,
    slopes,
    within_tolerance,
)
from kemba.identify.compare.words import place_of
from kemba.identify.infer.windows import Windows, aggregation_windows, free_starts, rms
from kemba.identify.problem.missing_force import Peak, peaks
from kemba.identify.problem.problem import Array, MissingForce, Problem, Rows, Theta
from kemba.units import short

FAIR = 1.5  # error ratio below which it nearly explains them


@dataclass(frozen=True)
class ChannelError:
    """One channel: error over windows in its unit, its noise, and whitened error by noise."""

    name: str
    rmse: float
    max: float
    noise_sigma: float
    ratio: float


@dataclass(frozen=True)
class Comparison:
    """What `compare` says; `good` where the error is within the noise.

    `noise_ratio`: error in units of the noise (see `error_ratio`). `tolerant_ratio`: the same if
    the model's nominal figures were at their best, off by what is usual at most; `tolerable`: that
    would be within the noise everywhere.
    """

    logs: tuple[str, ...]
    model: str
    noise_ratio: float
    channels: tuple[ChannelError, ...]
    bins: tuple[ConditionBin, ...]
    tolerant_ratio: float = float("nan")
    tolerable: bool = False
    hints: tuple[Hint, ...] = ()
    force_profiles: tuple[ForceProfile, ...] = ()
    missing: tuple[MissingForce, ...] = ()
    plan: Mapping[str, float] = field(default_factory=dict)
    sentence: str = ""

    @property
    def good(self) -> bool:
        good = BinSettings.tolerated
        return self.noise_ratio <= good and not any(c.significant for c in self.bins)

    @property
    def worst(self) -> ConditionBin | None:
        """The condition that stands out most, None where none does."""
        clear = (c for c in self.bins if c.significant)
        return max(clear, key=lambda c: c.ratio, default=None)

    @property
    def grade(self) -> str:
        """How far the model goes, where it is not good."""
        return "nearly explains" if self.noise_ratio < FAIR else "does not explain"

    @property
    def peaks(self) -> list[Peak]:
        """Per channel the moment at which the missing force stands out most."""
        return peaks(list(self.missing)) if self.missing else []

    def json(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        return {
            "logs": list(self.logs),
            "model": self.model,
            "noise_ratio": self.noise_ratio,
            "tolerant_ratio": self.tolerant_ratio,
            "channels": [asdict(c) for c in self.channels],
            "cells": [asdict(c) for c in self.bins],
            "hints": [asdict(h) for h in self.hints],
            "missing_force": [asdict(p) for p in self.peaks],
            "sentence": self.sentence,
        }


def compare(
    problem: Problem, model: str, logs: Sequence[str] = (), figures: Theta | None = None
) -> Comparison:
    """Compare the logs of `problem` with its model as it stands; only how each log begins is
    fitted. `figures`: those of the machine that its evidence knows (nuisance parameters)."""
    start = free_starts(problem, figures)
    rows, r = problem.rows(), problem.residual(start)
    region = problem.operating_point().regions()
    window = aggregation_windows(problem, rows, region)
    sums = window.sums(r)
    known = slopes(problem, start)
    sent = after_commands(problem, rows, r / np.sqrt(problem.expected_power()))
    forces = tuple(force_profiles(problem, r))
    left, q_value = within_tolerance(r, known)
    at_best = window.sums(left)
    ratio, bins = rms(at_best), condition_bins(rows, region, window.first, at_best)
    clean = q_value >= BinSettings.false_discoveries and ratio <= BinSettings.tolerated
    clean = clean and not any(c.significant and c.ratio > FAIR for c in bins)
    found = Comparison(
        tuple(logs) or problem.runs,
        model,
        rms(sums),
        tuple(_channels(problem, rows, r, window, start)),
        tuple(condition_bins(rows, region, window.first, sums)),
        ratio,
        clean and not any(profile.matters for profile in force_profiles(problem, left)),
        (*sent, *conflicts(rows, r, known)),
        forces,
        tuple(problem.missing_force(start)),
    )
    if not found.good and not found.tolerable:
        found = replace(found, hints=(*lacking(forces), *found.hints))
    return replace(found, sentence=phrase(found))


def conditions(problem: Problem, theta: Theta | None = None) -> list[ConditionBin]:
    """Error by condition of the model with `theta` added; regions of the stroke are not told
    apart."""
    rows, r = problem.rows(), problem.residual(free_starts(problem, theta))
    region = np.full(len(rows), "", dtype=object)
    window = aggregation_windows(problem, rows, region)
    return list(condition_bins(rows, region, window.first, window.sums(r)))


UNITS = {"x": "m", "z": "m", "q": "rad", "pitch": "rad", "F": "N", "P": "Pa"}  # by a name's end


def _channels(
    problem: Problem, rows: Rows, r: Array, window: Windows, start: Theta
) -> Iterable[ChannelError]:
    """Errors of every measured channel: those with a place in a log."""
    errors, sums = problem.window_errors(start), window.sums(r)
    for k, channel in enumerate(rows.channels):
        own, unit = rows.channel == k, rows.units.get(channel)
        if unit is None and "/foot/" not in channel:
            unit = UNITS.get(channel.rsplit("/", 1)[-1])
        if unit is None or not own.any():
            continue
        error = errors.get(channel, r[own] * rows.sigma[own])
        yield ChannelError(
            f"{channel} [{unit}]",
            float(np.sqrt(np.mean(error**2))),
            float(np.max(np.abs(error))),
            float(np.median(rows.sigma[own])),
            rms(sums[own[window.first]]),
        )


def phrase(found: Comparison) -> str:
    """The answer in plain words."""
    ratio = f"{short(found.noise_ratio)} times the noise"
    if found.good:
        return f"The model explains the logs to within the noise: its error is {ratio}."
    bad = found.worst
    if bad is None:
        return f"The model's error is {ratio}; no single condition stands out."
    worst = f"most clearly seen in {place_of(bad)}"
    if bad.ratio >= found.noise_ratio:  # two figures that contradict each other explain nothing
        worst = f"worst: {place_of(bad)} ({short(bad.ratio)} times)"
    if found.tolerable:
        return (
            f"The model's error is {ratio}; {worst}; but its nominal figures may be off by as much "
            f"as is usual, and then it would be {short(found.tolerant_ratio)} times."
        )
    first = {hint.kind: hint.text for hint in reversed(found.hints)}
    hints = [first[kind] for kind in ("law", "command", "conflict") if kind in first]
    told = f"The model {found.grade} the logs: its error is {ratio}"
    return "; ".join([told, worst, *hints]) + "."
