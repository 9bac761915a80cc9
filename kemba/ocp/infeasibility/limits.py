"""Which limits of the robot a plan reaches, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kemba.model import Model
from kemba.ocp.infeasibility.settings import Leaning
from kemba.ocp.task.task import Task
from kemba.trajectory import Trajectory


def active_limits(task: Task, model: Model, trajectory: Trajectory) -> list[str]:
    """Parts of a sentence: `front and rear extension valves are open throughout the push`."""
    return [
        *_valves(model, trajectory),
        *_torques(model, trajectory),
        *_strokes(model, trajectory),
        *_grip(model, trajectory),
        *_steps(task, trajectory),
    ]


def _stance(model: Model, trajectory: Trajectory) -> np.ndarray:
    """Steps (n,) in which some foot bears load, up to the highest point."""
    names = [f"{leg}/foot/Fz" for leg in model.mechanism.legs]
    load = np.array([trajectory[name] for name in names if name in trajectory]).sum(axis=0)
    bears = np.broadcast_to(
        load > Leaning.current().grip * model.mechanism.weight, len(trajectory)
    ).copy()
    bears[0] = False
    bears[int(np.argmax(trajectory["body/z"])) + 1 :] = False
    return np.asarray(bears)


def _legs(model: Model, holds: dict[str, bool]) -> str:
    return " and ".join(leg for leg in model.mechanism.legs if holds.get(leg))


def _valves(model: Model, trajectory: Trajectory) -> Iterator[str]:
    stance, leaning = _stance(model, trajectory), Leaning.current()
    if not stance.any():
        return
    for chamber in ("extend", "retract"):
        share = {
            leg: float(np.mean(trajectory[f"{leg}/valve/{chamber}"][stance] > 0.5))
            for leg in model.mechanism.legs
            if f"{leg}/valve/{chamber}" in trajectory
        }
        word = "extension" if chamber == "extend" else "retraction"
        open_ = _legs(model, {leg: x > leaning.throughout for leg, x in share.items()})
        most = _legs(
            model, {leg: leaning.mostly < x <= leaning.throughout for leg, x in share.items()}
        )
        if open_:
            yield f"{open_} {word} valves are open throughout the push"
        elif most and chamber == "extend":
            yield f"{most} {word} valves are open for {max(share.values()):.0%} of the push"


def _torques(model: Model, trajectory: Trajectory) -> Iterator[str]:
    leaning, share = Leaning.current(), dict[str, float]()
    peak = 0.0
    for (leg, _), quantity in model.inputs.items():
        if quantity.unit == "N.m" and leg is not None:
            peak = max(peak, quantity.upper)
            at_peak = np.abs(trajectory[quantity.name][1:]) > leaning.peak * quantity.upper
            share[leg] = float(np.mean(at_peak))
    legs = _legs(model, {leg: x >= leaning.often for leg, x in share.items()})
    if legs:
        most = f"{max(share.values()):.0%} of the steps"
        yield f"{legs} hip torque is at its peak of {peak:g} N.m (tau_peak) in {most}"


def _strokes(model: Model, trajectory: Trajectory) -> Iterator[str]:
    stance = np.flatnonzero(_stance(model, trajectory))
    if not len(stance):
        return
    full = {
        leg: bool(
            trajectory[f"{leg}/piston/x"][: stance[-1] + 2].max()
            > Leaning.current().near * model.mechanism.stroke
        )
        for leg in model.mechanism.legs
    }
    if any(full.values()):
        yield f"{_legs(model, full)} pistons use their whole stroke"


def _grip(model: Model, trajectory: Trajectory) -> Iterator[str]:
    slides, leaning = {}, Leaning.current()
    for leg in model.mechanism.legs:
        names = [f"{leg}/foot/{part}" for part in ("Fz", "slip")]
        if not all(name in trajectory for name in names):
            continue
        normal, slip = (trajectory[name][1:] for name in names)
        bears = normal > leaning.grip * model.mechanism.weight
        slides[leg] = bool(bears.any() and np.mean(slip[bears] > leaning.slides) > leaning.often)
    if any(slides.values()):
        yield f"{_legs(model, slides)} feet slip at the edge of the friction cone"


def _steps(task: Task, trajectory: Trajectory) -> Iterator[str]:
    h, leaning = np.diff(trajectory.time), Leaning.current()
    nominal = task.duration / len(h)
    for side, word in ((1 + task.step_variation, "longest"), (1 - task.step_variation, "shortest")):
        at = np.abs(h / nominal - side) < leaning.step * side
        if task.step_variation > 0 and np.mean(at) > leaning.steps:
            yield f"the steps are at their {word} (`duration`, `step_variation`)"
