"""What executions do and the learnt model does not say: bounded, and kept apart from physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import dump_yaml
from kemba.learn.flight import FlownJump

QUANTITIES = ("apex", "touchdown")
NOTE = "what executions did beyond the learnt model; it moves valve edges and is no physics"


class CorrectionSettings:
    """Bounds of the correction, and the scatter that is expected of executions."""

    apex = 0.05  # largest apex error that is corrected [m]
    touchdown = 0.02  # largest error of touchdown that is corrected [s]
    # 1 sigma of the apex between executions, where fewer than three are known [m]: valves that
    # scatter by 0.1 ms, on the shipped plant
    apex_scatter = 3e-3
    touchdown_scatter = 2e-3  # the same for touchdown [s]


@dataclass(frozen=True)
class Correction:
    """Executed minus simulated on the learnt model: apex [m], touchdown [s]. The body's pitch is
    left alone.

    `logs`: from how many executions; `limited`: what was larger than its bound.
    """

    apex: float = 0.0
    touchdown: float = 0.0
    logs: int = 0
    limited: tuple[str, ...] = ()


def correction_from(executed: Sequence[FlownJump], simulated: FlownJump) -> Correction:
    """The mean error of the executions, drawn towards zero by how much it may be chance.

    An error e with standard error s counts by e^2 / (e^2 + s^2), so that scatter is not chased.
    """
    settings, found, limited = CorrectionSettings, {}, []
    for name in QUANTITIES:
        errors = np.array([getattr(f, name) - getattr(simulated, name) for f in executed])
        errors = errors[np.isfinite(errors)]
        if not len(errors):
            found[name] = 0.0
            continue
        mean, usual = float(errors.mean()), float(getattr(settings, f"{name}_scatter"))
        scatter = float(errors.std(ddof=1)) if len(errors) > 2 else usual
        chance = scatter**2 / len(errors)
        counted = mean * mean**2 / (mean**2 + chance) if mean else 0.0
        bound = float(getattr(settings, name))
        if abs(counted) > bound:
            limited.append(name)
        found[name] = float(np.clip(counted, -bound, bound))
    return Correction(**found, logs=len(executed), limited=tuple(limited))


def scatter_of(executed: Sequence[FlownJump]) -> float:
    """1 sigma [m] of the apex between executions: what is usual, counted as one of them, and what
    they show."""
    usual = CorrectionSettings.apex_scatter
    apex = np.array([f.apex for f in executed])
    squares = float(np.sum((apex - apex.mean()) ** 2)) if len(apex) > 1 else 0.0
    return float(np.sqrt((usual**2 + squares) / max(len(apex), 1)))


def write_correction(
    path: Path, correction: Correction, moved: dict[str, list[int]], reached: dict[str, Any]
) -> None:
    """The correction's own file; `moved`: ticks [ms] by which valve edges moved, by column."""
    values = {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(correction).items()}
    units = {"apex": "m", "touchdown": "s"}
    dump_yaml(
        {"note": NOTE, "unexplained": values, "units": units, "edges_moved_ms": moved, **reached},
        path,
    )
