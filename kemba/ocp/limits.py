"""Which limits of the robot a plan leans on, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kemba.model import Model
from kemba.ocp.task import Task
from kemba.trajectory import Trajectory

NEAR = 0.99  # of a limit counts as at it
OFTEN = 0.3  # of the steps that a limit must hold to be told
GRIP = 0.02  # of body weight; less normal force is no stance


def active_limits(task: Task, model: Model, trajectory: Trajectory) -> list[str]:
    """Sentence parts such as `front and rear extension valves are open throughout the stance`."""
    found = [*_valves(model, trajectory), *_torques(model, trajectory)]
    return [*found, *_strokes(model, trajectory), *_grip(model, trajectory), *_steps(task, trajectory)]


def _stance(model: Model, trajectory: Trajectory) -> np.ndarray:
    """Steps (n,) in which some foot bears load, up to the highest point."""
    loads = [trajectory[f"{leg}/foot/Fz"] for leg in model.mechanism.legs
             if f"{leg}/foot/Fz" in trajectory]
    bears = np.array(sum(loads, np.zeros(len(trajectory)))) > GRIP * model.mechanism.weight
    bears[0] = False
    bears[int(np.argmax(trajectory["body/z"])) + 1 :] = False
    return bears


def _legs(model: Model, holds: dict[str, bool]) -> str:
    return " and ".join(leg for leg in model.mechanism.legs if holds.get(leg))


def _valves(model: Model, trajectory: Trajectory) -> Iterator[str]:
    stance = _stance(model, trajectory)
    if not stance.any():
        return
    for chamber in ("extend", "retract"):
        share = {
            leg: float(np.mean(trajectory[f"{leg}/valve/{chamber}"][stance] > 0.5))
            for leg in model.mechanism.legs
            if f"{leg}/valve/{chamber}" in trajectory
        }
        word = "extension" if chamber == "extend" else "retraction"
        open_ = _legs(model, {leg: x > 0.95 for leg, x in share.items()})
        most = _legs(model, {leg: 0.6 < x <= 0.95 for leg, x in share.items()})
        if open_:
            yield f"{open_} {word} valves are open throughout the push"
        elif most and chamber == "extend":
            yield f"{most} {word} valves are open for {max(share.values()):.0%} of the push"


def _torques(model: Model, trajectory: Trajectory) -> Iterator[str]:
    for quantity in model.inputs.values():
        if quantity.unit != "N.m" or quantity.upper <= 0:
            continue
        share = float(np.mean(np.abs(trajectory[quantity.name][1:]) > 0.95 * quantity.upper))
        if share >= OFTEN:
            leg = quantity.name.partition("/")[0]
            yield (
                f"{leg} hip torque is at its peak of {quantity.upper:g} N.m (tau_peak) in "
                f"{share:.0%} of the steps"
            )


def _strokes(model: Model, trajectory: Trajectory) -> Iterator[str]:
    stance, stroke = _stance(model, trajectory), model.mechanism.stroke
    full = {
        leg: bool(stance.any() and trajectory[f"{leg}/piston/x"][: np.flatnonzero(stance)[-1] + 2].max()
                  > NEAR * stroke)
        for leg in model.mechanism.legs
    }
    if any(full.values()):
        yield f"{_legs(model, full)} pistons use their whole stroke"


def _grip(model: Model, trajectory: Trajectory) -> Iterator[str]:
    slides = {}
    for leg in model.mechanism.legs:
        names = [f"{leg}/foot/{part}" for part in ("Fz", "Fx_forward", "Fx_backward", "slip")]
        if not all(name in trajectory for name in names):
            continue
        normal, forward, backward, slip = (trajectory[name][1:] for name in names)
        bears = normal > GRIP * model.mechanism.weight
        slides[leg] = bool(bears.any() and np.mean(slip[bears] > 0.02) > OFTEN)
    if any(slides.values()):
        yield f"{_legs(model, slides)} feet slip at the edge of the friction cone"


def _steps(task: Task, trajectory: Trajectory) -> Iterator[str]:
    h = np.diff(trajectory.time)
    nominal = task.duration / len(h)
    for side, word in ((1 + task.step_variation, "longest"), (1 - task.step_variation, "shortest")):
        at = np.abs(h / nominal - side) < 0.02 * side
        if task.step_variation > 0 and np.mean(at) > 0.8:
            yield f"the steps are at their {word} (`duration`, `step_variation`)"
