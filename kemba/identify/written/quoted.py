"""The error that is quoted of a model: one figure, by one function, in every verb."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kemba.files import sha256
from kemba.identify.evidence.colour import with_learnt_colour
from kemba.identify.evidence.windows import error_ratio, free_starts
from kemba.identify.problem.problem import Array, Problem
from kemba.mechanism.robot_file import robot_files
from kemba.model import Model, build_model, load_spec
from kemba.model.evidence import Measured
from kemba.scene import Scene
from kemba.trajectory import Trajectory

PLANT = "plant"  # the shipped simulated robot, with physical chambers
AROUND = 0.01  # s before and after a reading from which a speed is told


def heard(problem: Problem) -> Problem:
    """The problem under the noise of its own logs, learnt beside a flexible model."""
    return with_learnt_colour(problem, free_starts(problem))


def noise_ratio(problem: Problem, figures: Mapping[str, float] | None = None) -> float:
    """Error of the model as it is, in units of the noise: `noise_ratio` of `compare`.

    `figures`: of the machine, as `Evidence.figures`; without them all are nominal.
    """
    return error_ratio(heard(problem), known(problem, figures or {}))


def known(problem: Problem, figures: Mapping[str, float]) -> dict[str, float]:
    """Those figures of a machine that these logs can feel."""
    return {name: value for name, value in figures.items() if name in problem.nuisance}


def plant_of(model: str | Path, scene: Scene) -> Model:
    """The shipped plant on the robot of `model` in a scene."""
    robot = load_spec(model).robot
    return build_model(load_spec(PLANT).model_copy(update={"robot": robot}), scene=scene)


def measured_in(logs: Sequence[Trajectory], model: str | Path) -> Measured:
    """What logs span of heights, speeds, supply pressures and valve modes."""
    spec, body = load_spec(model), [log for log in logs if "body/z" in log]
    apex = [float(np.nanmax(log["body/z"])) for log in body]
    speed = [float(np.nanmax(_speed(log))) for log in body]
    supply = (spec.supply, spec.supply) if spec.supply else None
    modes = tuple(sorted({mode for log in logs for mode in _modes(log)}))
    robot = sha256(robot_files(spec.robot)[0]) if spec.robot else None
    spans = [(min(x), max(x)) if x else None for x in (apex, speed)]
    load = sum(e.value("m") for e in spec.effects if e.kind == "payload")
    known: dict[str, Any] = {"modes": modes, "robot": robot, "payload": load}
    return Measured(apex=spans[0], speed=spans[1], supply=supply, **known)


def _speed(log: Trajectory) -> Array:
    """Speed [m/s] of the body (n,), from places some time apart."""
    before, after = log.time - AROUND, log.time + AROUND
    inside = (before >= log.time[0]) & (after <= log.time[-1])
    steps = [
        np.interp(after, log.time, log[n]) - np.interp(before, log.time, log[n])
        for n in ("body/x", "body/z")
    ]
    return np.where(inside, np.hypot(*steps) / (2.0 * AROUND), 0.0)


def _modes(log: Trajectory) -> set[str]:
    """Valve modes of a log's legs: extend valve, then retract valve."""
    legs = {name[: -len("valve/extend")] for name in log.names if name.endswith("valve/extend")}
    found: set[str] = set()
    for leg in (leg for leg in legs if f"{leg}valve/retract" in log):
        pair = np.stack([log[f"{leg}valve/extend"], log[f"{leg}valve/retract"]])
        both = np.unique(pair[:, np.isfinite(pair).all(axis=0)], axis=1)
        found |= {f"{extend:.0f}{retract:.0f}" for extend, retract in both.T}
    return found
