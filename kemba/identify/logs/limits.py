"""What the way in which logs were taken costs: slow or uneven rows, unused columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from kemba.settings import BY_HAND, Settings, setting
from kemba.trajectory import Trajectory


class LimitSettings(Settings):
    """When the way in which logs were taken is worth a remark."""

    row: float = setting(
        1.25e-3, "s", "step between rows from which it is said", "convention: logs have 1 ms"
    )
    uneven: float = setting(
        0.1, "1", "spread of the steps, as a share of the usual one, from which it is said", BY_HAND
    )


def limits_of(logs: Sequence[Trajectory]) -> list[str]:
    """Remarks on what these logs cannot show, or show worse than others would."""
    return [*_slow(logs), *_uneven(logs), *_unused(logs)]


def _slow(logs: Sequence[Trajectory]) -> Iterable[str]:
    step = max(float(np.median(np.diff(log.time))) for log in logs)
    if step > LimitSettings.current().row:
        yield (
            f"{1 / step:.0f} Hz blurs valve edges to {1e3 * step:.2g} ms: valve delays are known "
            f"worse than from 1 kHz, and time constants below {1e3 * step:.2g} ms do not show"
        )


def _uneven(logs: Sequence[Trajectory]) -> Iterable[str]:
    worst, usual = 0.0, 1e-3
    for log in logs:
        steps = np.diff(log.time)
        low, middle, high = np.quantile(steps, (0.16, 0.5, 0.84))
        if high - low > 2.0 * worst:
            worst, usual = 0.5 * float(high - low), float(middle)
    if worst > LimitSettings.current().uneven * usual:
        yield (
            f"rows come unevenly, {1e3 * usual:.2g} ms +- {1e3 * worst:.2g} ms apart: commands are "
            "known to act at the written times only as well as that"
        )


def _unused(logs: Sequence[Trajectory]) -> Iterable[str]:
    if logs[0].meta.get("kind") == "robot" and any("/chamber/" in n for g in logs for n in g.names):
        yield (
            "chamber pressures are in these logs and are not used: of a robot the motion alone is "
            "explained. Take a bench log of this cylinder to use its pressures"
        )
