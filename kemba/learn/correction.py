"""What executions do and the learnt model does not say: bounded, and kept apart from physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kemba.config import dump_yaml
from kemba.learn.flight import FlownJump
from kemba.settings import CHOSEN, Settings, setting

QUANTITIES = ("apex", "touchdown", "pitch")
SAID = {
    "apex": ("rises to", "rise to", "m"),
    "touchdown": ("lands at", "land at", "s"),
    "pitch": ("touches down with a pitch of", "have", "rad"),
}
NOTE = "what executions did beyond the learnt model; it moves valve edges and is no physics"


class CorrectionSettings(Settings):
    """Bounds of the correction, and the scatter that is expected of executions."""

    apex: float = setting(0.05, "m", "largest apex error that is corrected", CHOSEN)
    touchdown: float = setting(0.02, "s", "largest error of touchdown that is corrected", CHOSEN)
    pitch: float = setting(0.1, "rad", "largest error of pitch that is corrected", CHOSEN)
    apex_scatter: float = setting(
        3e-3, "m", "1 sigma of the apex between executions, where fewer than three are known",
        "derived: valves that scatter by 0.1 ms, on the shipped plant",
    )  # fmt: skip
    touchdown_scatter: float = setting(2e-3, "s", "the same for touchdown", CHOSEN)
    pitch_scatter: float = setting(0.01, "rad", "the same for the pitch there", CHOSEN)


@dataclass(frozen=True)
class Correction:
    """Executed minus simulated on the learnt model: apex [m], touchdown [s], pitch there [rad].

    `logs`: from how many executions; `limited`: what was larger than its bound.
    """

    apex: float = 0.0
    touchdown: float = 0.0
    pitch: float = 0.0
    logs: int = 0
    limited: tuple[str, ...] = ()


def correction_from(executed: Sequence[FlownJump], simulated: FlownJump) -> Correction:
    """The mean error of the executions, drawn towards zero by how much it may be chance.

    An error e with standard error s counts by e^2 / (e^2 + s^2), so that scatter is not chased.
    """
    settings, found, limited = CorrectionSettings.current(), {}, []
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


def contradictions(executed: Sequence[FlownJump], simulated: FlownJump) -> tuple[str, ...]:
    """What a simulation does otherwise than its executions, by more than is corrected, in words."""
    settings, found = CorrectionSettings.current(), []
    for name, (does, do, unit) in SAID.items():
        values = np.array([getattr(f, name) for f in executed])
        values = values[np.isfinite(values)]
        ours, bound = float(getattr(simulated, name)), float(getattr(settings, name))
        if not len(values) or (name == "pitch" and not np.isfinite(ours)):
            continue  # no touchdown is said once
        logs = f"where the logs {do} {values.mean():.3f} {unit}"
        if not np.isfinite(ours):
            found.append(f"does not land {logs}")
        elif abs(ours - values.mean()) > bound:
            found.append(f"{does} {ours:.3f} {unit} {logs}")
    return tuple(found)


def write_correction(
    path: Path, correction: Correction, moved: dict[str, list[int]], reached: dict[str, Any]
) -> None:
    """The correction's own file; `moved`: ticks [ms] by which valve edges moved, by column."""
    values = {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(correction).items()}
    units = {"apex": "m", "touchdown": "s", "pitch": "rad"}
    dump_yaml(
        {"note": NOTE, "unexplained": values, "units": units, "edges_moved_ms": moved, **reached},
        path,
    )
