"""Steady force of a moving piston: F_static and c_d by valve mode and supply (eq. 6 and 7)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from kemba.plant.rig.estimate import Estimate, linear
from kemba.settings import CHOSEN, Settings, setting
from kemba.trajectory import Trajectory

MODES = {(1, 0): "extend", (0, 1): "retract", (1, 1): "both", (0, 0): "none"}


class StrokeSettings(Settings):
    """Which samples of a stroke count as steady."""

    travel: float = setting(
        0.01,
        "m",
        "way below which the rod does not move",
        CHOSEN,
    )
    moving: float = setting(
        0.2,
        "1",
        "share of the top speed from which the rod moves",
        CHOSEN,
    )
    begin: float = setting(
        0.5,
        "1",
        "share of the way after which chambers have settled",
        CHOSEN,
    )
    end: float = setting(
        0.85,
        "1",
        "share of the way after which the end is near",
        CHOSEN,
    )
    steady: float = setting(
        0.03,
        "1",
        "deviation from the median speed that counts",
        CHOSEN,
    )
    fewest: int = setting(3, "1", "samples that a steady part needs", CHOSEN)


@dataclass(frozen=True)
class Stroke:
    """One steady stroke: valve mode, supply [Pa], speed [m/s] and force [N]."""

    mode: str
    supply: float
    speed: float
    force: float


@dataclass(frozen=True)
class StrokeLine:
    """One row of Table II: F = F_static - c_d v."""

    mode: str
    supply: float
    F_static: Estimate
    c_d: Estimate
    r2: float


def find_stroke(log: Trajectory) -> Stroke | None:
    """The steady part of a bench log in which the rod moves at one speed in one valve mode.

    None where there is no such part.
    """
    limits = StrokeSettings.current()
    modes = {
        (int(a > 0.5), int(b > 0.5))
        for a, b in zip(log["valve/extend"], log["valve/retract"], strict=True)
    }
    x = log["piston/x"]
    if len(modes) > 1 or np.ptp(x) < limits.travel:
        return None
    v = log["piston/v"] if "piston/v" in log else np.gradient(x, log.time)
    moving = np.abs(v) > limits.moving * np.abs(v).max()
    usual = float(np.median(v[moving]))
    progress = np.abs(x - x[0]) / float(np.abs(x - x[0]).max())
    used = moving & (progress > limits.begin) & (progress < limits.end)
    used &= np.abs(v - usual) < limits.steady * abs(usual)
    if used.sum() < limits.fewest:
        return None
    mode = MODES[modes.pop()]
    supply = 0.0 if mode == "none" else float(log.meta.get("supply", 0.7e6))
    return Stroke(mode, supply, float(v[used].mean()), float(log["piston/F"][used].mean()))


def stroke_table(strokes: Iterable[Stroke]) -> list[StrokeLine]:
    """Table II: one line per mode and supply with at least two speeds."""
    groups: dict[tuple[str, float], list[Stroke]] = {}
    for stroke in strokes:
        groups.setdefault((stroke.mode, stroke.supply), []).append(stroke)
    order = list(MODES.values())
    lines = []
    for (mode, supply), group in sorted(
        groups.items(), key=lambda item: (order.index(item[0][0]), item[0][1])
    ):
        v = np.array([stroke.speed for stroke in group])
        if len(np.unique(np.round(v, 3))) < 2:
            continue
        force = np.array([stroke.force for stroke in group])
        (F_static, c_d), r2 = linear(np.column_stack([np.ones_like(v), -v]), force)
        lines.append(StrokeLine(mode, supply, F_static, c_d, r2))
    return lines
