"""Why a task has no plan: violated requirements, by how much, and the limits of the robot that a
plan reaches, in words."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from kemba.config import Document
from kemba.config.document import Location, written
from kemba.model import Model
from kemba.ocp.infeasibility.elastic import Outcome
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.ocp.transcription.solution import to_trajectory
from kemba.trajectory import Trajectory


@dataclass(frozen=True)
class Relax:
    """A requirement that cannot be met: what the task asks, and what could be reached instead."""

    requirement: str
    where: str
    quantity: str
    asked: float
    reachable: float
    unit: str

    def __str__(self) -> str:
        """`goals.apex`: 1.45 m asked, 1.21 m is the most that can be reached."""
        end = "most" if self.asked > self.reachable else "least"
        asked, reachable = apart(self.asked, self.reachable, self.unit)
        name, said = f"`{self.requirement}`", (self.requirement.partition(".")[2], "")
        if self.quantity not in said and "*" not in self.requirement:
            name += f" ({self.quantity})"
        return f"{name}: {asked} asked, {reachable} is the {end} that can be reached"

    def placed(self, more: str = "") -> str:
        """The same with `more` behind it, and its place in the task, if it has one."""
        return f"{self}{more}" + (f" ({self.where})" if self.where else "")


@dataclass(frozen=True)
class Diagnostic:
    """What a check found.

    `certain`: no plan can exist, so that nothing is solved. `cause`: it names the cause, which is
    not the requirement that fails.
    """

    sentence: str
    certain: bool
    relax: tuple[Relax, ...] = ()
    cause: bool = False


def number(value: float, unit: str, digits: int = 3) -> str:
    """A value as people write it: `0.35 m`, `-10 deg`, `0`."""
    if unit == "rad":
        value, unit = math.degrees(value), "deg"
    text = f"{round(value, digits) + 0.0:.{digits + 1}g}"
    return text if unit == "1" else f"{text} {unit}"


def apart(asked: float, reachable: float, unit: str) -> tuple[str, str]:
    """Two values with as many digits as show that they differ."""
    pairs = ((number(asked, unit, d), number(reachable, unit, d)) for d in range(3, 9))
    return next((pair for pair in pairs if pair[0] != pair[1]), (f"{asked:g}", f"{reachable:g}"))


def place(document: Document, location: Location) -> str:
    """`jump.yaml:33:3`, or the `--set` option, where the task says so."""
    return document.error(location, "").where


def key(name: str, document: Document) -> str:
    """A top-level key of the task with its place: `payload` (jump.yaml:6:1)."""
    known = (name,) in document.marks or (name,) in document.overrides
    return f"`{name}` ({place(document, (name,))})" if known else f"`{name}`"


def relax(document: Document, requirement: Requirement, asked: float, reachable: float) -> Relax:
    """How far a requirement must be relaxed."""
    where, quantity = place(document, requirement.location), requirement.quantity
    return Relax(requirement.text, where, quantity.name, asked, reachable, quantity.unit)


def one_per_requirement(relaxed: Iterable[Relax]) -> tuple[Relax, ...]:
    """The farthest of every requirement: `*/foot/z` holds for two feet and is named once."""
    worst: dict[tuple[str, bool], Relax] = {}
    for r in relaxed:
        known = worst.setdefault((r.requirement, r.asked > r.reachable), r)
        if abs(r.asked - r.reachable) > abs(known.asked - known.reachable):
            worst[(r.requirement, r.asked > r.reachable)] = r
    return tuple(worst.values())


def spoken(location: Location) -> str:
    """A location between backticks."""
    return f"`{written(location)}`"


@dataclass(frozen=True)
class Explanation:
    """A sentence and the requirements to relax. `proven`: it does not depend on the
    solver."""

    sentence: str
    relax: tuple[Relax, ...]
    proven: bool


def refusal(diagnostics: Sequence[Diagnostic]) -> Explanation | None:
    """What refuses a task before solving, or None."""
    certain = [f for f in diagnostics if f.certain]
    if not certain:
        return None
    reasons = "; ".join(f.sentence for f in certain)
    relaxed = one_per_requirement(r for f in certain for r in f.relax)
    return Explanation(f"cannot be met: {reasons}", relaxed, True)


def explanation(
    task: Task,
    model: Model,
    outcome: Outcome | None,
    diagnostics: Iterable[Diagnostic],
    document: Document,
) -> Explanation | None:
    """What the elastic solve and the checks say after a failed solve; None when they are silent."""
    hints = [f.sentence for f in diagnostics if f.cause or outcome is None or not outcome.short]
    if outcome is None:
        return Explanation("; ".join(hints), (), False) if hints else None
    transcription, Y = outcome.transcription, outcome.point.Y
    trajectory = to_trajectory(transcription, Y)
    # parts of a sentence: `front and rear extension valves are open throughout the push`
    of_robot = (part(model, trajectory) for part in (_valves, _torques, _strokes, _grip))
    limits = [*chain.from_iterable(of_robot), *_steps(task, trajectory)]
    asked = ((r, by, r.upper if by > 0 else r.lower) for r, by, _ in outcome.given)
    given = one_per_requirement(
        relax(document, r, end, 1.0 - end if r.quantity.binary else end + by)
        for r, by, end in asked
    )
    if given:
        time = f" within {trajectory.time[-1]:.2f} s"
        requirements = [r.placed(time * (r is given[0])) for r in given]
        requirements[0] = f"cannot be met: {requirements[0]}"
        if transcription.task.landing != task.landing:
            requirements.append("`landing` is not counted in this and may ask for still less")
        parts = [*requirements, *limits, *hints]
        return Explanation("; ".join(parts), given, True)
    if not (limits or hints):
        return None
    return Explanation("; ".join(["close to a limit", *limits, *hints]), (), False)


FULL = 0.99  # part of the stroke that counts as all of it
OFTEN = 0.3  # part of the steps for which a limit must hold to be named
GRIP = 0.02  # of body weight: a foot with less normal force does not stand
SLIDES = 0.02  # m.s-1, slip speed of a sliding foot
THROUGHOUT = 0.95  # part of the push that counts as all of it
MOSTLY = 0.6  # part of the push for which open valves are told
PEAK = 0.95  # part of the peak torque that counts
STEP = 0.02  # relative distance to a step's bound
STEPS = 0.8  # part of the steps at a bound that is named


def _stance(model: Model, trajectory: Trajectory) -> np.ndarray:
    """Steps (n,) in which some foot bears load, up to the highest point."""
    names = [f"{leg}/foot/Fz" for leg in model.mechanism.legs]
    load = np.array([trajectory[name] for name in names if name in trajectory]).sum(axis=0)
    bears = np.broadcast_to(load > GRIP * model.mechanism.weight, len(trajectory)).copy()
    bears[0] = False
    bears[int(np.argmax(trajectory["body/z"])) + 1 :] = False
    return np.asarray(bears)


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
        open_ = _legs(model, {leg: x > THROUGHOUT for leg, x in share.items()})
        most = _legs(model, {leg: MOSTLY < x <= THROUGHOUT for leg, x in share.items()})
        if open_:
            yield f"{open_} {word} valves are open throughout the push"
        elif most and chamber == "extend":
            yield f"{most} {word} valves are open for {max(share.values()):.0%} of the push"


def _torques(model: Model, trajectory: Trajectory) -> Iterator[str]:
    share: dict[str, float] = {}
    peak = 0.0
    for (leg, _), quantity in model.inputs.items():
        if quantity.unit == "N.m" and leg is not None:
            peak = max(peak, quantity.upper)
            at_peak = np.abs(trajectory[quantity.name][1:]) > PEAK * quantity.upper
            share[leg] = float(np.mean(at_peak))
    legs = _legs(model, {leg: x >= OFTEN for leg, x in share.items()})
    if legs:
        most = f"{max(share.values()):.0%} of the steps"
        yield f"{legs} hip torque is at its peak of {peak:g} N.m (tau_peak) in {most}"


def _strokes(model: Model, trajectory: Trajectory) -> Iterator[str]:
    stance = np.flatnonzero(_stance(model, trajectory))
    if not len(stance):
        return
    pushing, least = slice(stance[-1] + 2), FULL * model.mechanism.stroke
    legs = model.mechanism.legs
    full = {leg: bool(trajectory[f"{leg}/piston/x"][pushing].max() > least) for leg in legs}
    if any(full.values()):
        yield f"{_legs(model, full)} pistons use their whole stroke"


def _grip(model: Model, trajectory: Trajectory) -> Iterator[str]:
    slides = {}
    for leg in model.mechanism.legs:
        names = [f"{leg}/foot/{part}" for part in ("Fz", "slip")]
        if not all(name in trajectory for name in names):
            continue
        normal, slip = (trajectory[name][1:] for name in names)
        bears = normal > GRIP * model.mechanism.weight
        slides[leg] = bool(bears.any() and np.mean(slip[bears] > SLIDES) > OFTEN)
    if any(slides.values()):
        yield f"{_legs(model, slides)} feet slip at the edge of the friction cone"


def _steps(task: Task, trajectory: Trajectory) -> Iterator[str]:
    h = np.diff(trajectory.time)
    nominal = task.duration / len(h)
    for side, word in ((1 + task.step_variation, "longest"), (1 - task.step_variation, "shortest")):
        at = np.abs(h / nominal - side) < STEP * side
        if task.step_variation > 0 and np.mean(at) > STEPS:
            yield f"the steps are at their {word} (`duration`, `step_variation`)"
