"""Sensors that read in coarse steps: how coarse, and what a reading that stands still is worth."""

from __future__ import annotations

import numpy as np

from kemba.identify.problem.types import Array, Flags, Labels


class QuantisationSettings:
    """How the step of a sensor is found."""

    # readings closer than this share of their range are one reading: conversion of units rounds in
    # the fifteenth digit, files have six or more
    same = 1e-6
    # readings come in steps where most differences of neighbours are whole steps: of what moves
    # without a rest, the smallest difference is its slowest motion
    near = 0.15  # distance from a whole number of steps that rounding in a file makes
    few = 5.5  # differences of more steps tell nothing, since the error of the step adds up
    most = 0.6  # share of differences that are whole steps; by chance 0.3 are
    # steps of so many sigmas of the noise are coarse: below it, noise makes rounding errors
    # independent (Widrow and Kollar 2008)
    coarse = 2.0
    longest = 1000  # rows at rest that count as one reading; of a longer rest more count


def step_of(values: Array) -> float:
    """The step in which a channel (n,) is read, in its unit; 0 where it has none."""
    known = np.unique(values[np.isfinite(values)])
    steps = np.diff(known)
    if not len(steps):
        return 0.0
    steps = steps[steps > QuantisationSettings.same * np.ptp(known)]
    counts = steps / steps.min()
    counts = counts[counts < QuantisationSettings.few]
    whole = np.abs(counts - np.round(counts)) < QuantisationSettings.near
    return float(steps.min()) if np.mean(whole) > QuantisationSettings.most else 0.0


def is_coarse(step: float, sigma: float) -> bool:
    """Whether a sensor's step is so much larger than its noise that rounding errors depend on each
    other."""
    return step > QuantisationSettings.coarse * sigma


def telling(values: Array, sigma: float) -> Flags:
    """Rows (n,) that tell something of their own: of readings that stand still, the middle one.

    Readings stand still where they keep to one step, or change to and fro between two. They have
    one rounding error in common, so that many of them tell no more than one. Where the noise
    `sigma` is as large as the steps, each reading is rounded by itself and all rows count.
    """
    step = step_of(values)
    if not is_coarse(step, sigma):
        return np.ones(len(values), dtype=bool)
    chosen = np.zeros(len(values), dtype=bool)
    known = np.flatnonzero(np.isfinite(values))
    level = np.round(values[known] / step).astype(int)
    first = 0
    while first < len(level):
        last = first + _still(level[first:])
        chosen[known[(first + last - 1) // 2]] = True
        first = last
    return chosen


def _still(level: Labels) -> int:
    """How many of the first readings (n,), counted in steps, keep to one level or to two."""
    level = level[: QuantisationSettings.longest]
    low, high = np.minimum.accumulate(level), np.maximum.accumulate(level)
    moved = high - low > 1
    return int(np.argmax(moved)) if moved.any() else len(moved)
