"""Status and sentence of a plan, from what was measured."""

from collections.abc import Sequence
from enum import Enum

import numpy as np

from kemba.ocp.certificate.asked import MeasuredRequirement
from kemba.ocp.certificate.certify import OF_WEIGHT, Certificate
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.task.task import Task
from kemba.ocp.task.templates import rise_of_feet
from kemba.trajectory import Trajectory

# what the rows of a plan are called in the certificate's `worst`, in words
LAWS = {
    "dynamics": "the equation of motion",
    "kinematics": "place and rate",
    "rate": "the rate",
    "bound": "the bound",
}

USABLE = 100.0  # times the tolerances within which a plan is usable: two digits short


class Status(str, Enum):
    """What solving gave; the values are the words of the command line's contract."""

    SOLVED = "solved"  # every residual within the task's tolerances
    ACCEPTABLE = "acceptable"  # a plan, but not all that was asked
    INFEASIBLE = "infeasible"
    STALLED = "stalled"
    LIMIT = "limit"
    INTERRUPTED = "interrupted"

    def __str__(self) -> str:
        return str(self.value)

    @property
    def plan(self) -> bool:
        """Whether there is a plan that is worth executing."""
        return self in (Status.SOLVED, Status.ACCEPTABLE)


def verdict(
    task: Task, certificate: Certificate, trajectory: Trajectory, ending: Ending | None
) -> tuple[Status, str]:
    """Status and sentence of a trajectory; `ending` is that of its last solve."""
    facts = ", ".join(reached(certificate, trajectory))
    if ending is Ending.INTERRUPTED:
        what = f"interrupted: best iterate kept, {facts}; {_worst(certificate)}"
        return Status.INTERRUPTED, what
    if certificate.within(task.tolerances):
        return Status.SOLVED, f"solved: {facts}"
    names = ("complementarity", "dynamics", "bounds")
    loose = {name: USABLE * getattr(task.tolerances, name) for name in names}
    worst, missed = _worst(certificate), certificate.missed
    nearly = all(m.miss <= USABLE * m.allowed for m in missed)
    if nearly and certificate.sound(task.tolerances.model_copy(update=loose)):
        return Status.ACCEPTABLE, f"the plan misses its tolerances: {worst}; {facts}"
    if certificate.sound(task.tolerances) and (ending is None or ending.good):
        return Status.ACCEPTABLE, f"the plan is not what was asked: {missed_of(missed)}; {facts}"
    if ending is None:
        return Status.STALLED, f"no plan was found: {worst}"
    if ending.limit:
        return Status.LIMIT, f"a limit came before a plan was found: {worst}"
    if ending in (Ending.INFEASIBLE, Ending.REFUSED):
        return Status.INFEASIBLE, f"the solver finds no motion that meets the task: {worst}"
    why = "the solver ended at a motion that is not possible" if ending.good else ending.sentence
    return Status.STALLED, f"no plan was found, {why}: {worst}"


MOVES, TURNS, SPEED, RATE = 0.01, 1.5, 0.05, 0.2  # m, rad, m/s, rad/s: less is not told


def reached(certificate: Certificate, plan: Trajectory) -> list[str]:
    """What a plan comes to, in words: as `moved` says it, what is reached of further goals, and how
    long it takes."""
    height, *found = moved(plan)
    others = {
        asked.goal: f"{asked.goal} {asked.value:.3g} {asked.unit}".removesuffix(" 1")
        for asked in certificate.asked
        if asked.goal and not asked.text.endswith((":body/x", ":body/z"))  # told already
    }
    first = f"apex {height}{_feet(plan)}"
    return [first, *found, *others.values(), f"{plan.time[-1]:.3f} s"]


def moved(plan: Trajectory) -> list[str]:
    """How high a body comes, how far it goes and turns, and how fast it ends, in words."""
    found = [f"{max(plan['body/z']):.3f} m"]
    rows = {q: plan[f"body/{q}"] for q in ("x", "pitch", "vx", "pitch_rate") if f"body/{q}" in plan}
    change = {q: float(values[-1] - values[0]) for q, values in rows.items()}
    last = {q: float(values[-1]) for q, values in rows.items()}
    if abs(ahead := change.get("x", 0.0)) >= MOVES:
        found.append(f"{abs(ahead):.2f} m {'ahead' if ahead > 0 else 'back'}")
    if abs(turned := change.get("pitch", 0.0)) >= TURNS:
        found.append(f"turned by {np.degrees(turned):.0f} deg")
    if abs(speed := last.get("vx", 0.0)) >= SPEED:
        found.append(f"{speed:.2f} m/s at the end")
    if abs(rate := last.get("pitch_rate", 0.0)) >= RATE:
        found.append(f"turning at {rate:.2f} rad/s at the end")
    return found


def _feet(trajectory: Trajectory) -> str:
    """How high the feet come, beside the body's centre; empty where they stay down."""
    rise = round(100 * (rise_of_feet(trajectory) or 0.0))
    return f" (feet {rise} cm up)" if rise else ""


def missed_of(missed: Sequence[MeasuredRequirement]) -> str:
    """The largest miss in words, and how many others there are."""
    others = len(missed) - 1
    more = f", and {others} more requirement{'s' * (others > 1)}" if others else ""
    return f"{missed[0].sentence}{more}"


def _worst(certificate: Certificate) -> str:
    if not certificate.worst:
        return "nothing is violated"
    v = certificate.worst[0]
    off = f"off by {v.violation:.3g} {v.unit}"
    if v.unit.endswith(OF_WEIGHT):
        product = f"{v.violation:.3g} {v.unit}"
        off = f"where gap (or slip) and force exclude each other: their product is {product}"
    return f"worst: {law(v.what)}, {off} at node {v.node} ({v.time_s:.3f} s)"


def law(what: str) -> str:
    """What is violated, in words: `the equation of motion of front/hip/q`."""
    kind, _, name = what.partition(":")
    if not name:  # `landing.impact_speed`
        return f"`{kind}`"
    if kind in LAWS:
        return f"{LAWS[kind]} of {name}"
    if kind.endswith("/end_stop"):
        return f"the {name} end stop of {kind.removesuffix('/end_stop')}"
    asked = "." in kind or "/" in name  # `goals.apex:body/z`, unlike `rear/contact:gap`
    return f"`{kind}` on {name}" if asked else f"{name.replace('_', ' ')} of {kind}"
