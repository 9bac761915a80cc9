"""Energy, time and friction that a task needs, against what the robot can give."""

from collections.abc import Iterator, Sequence

from kemba.config import Document
from kemba.model import Model
from kemba.ocp.infeasibility.diagnostic import Diagnostic, key, number, place, relax
from kemba.ocp.infeasibility.flight import AskedFlight, air_work, hip_power, leg_swing
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task

HEAVY = 0.2  # payload of all that is lifted, from which it is named as a cause
FORWARD = 0.01  # m, way forward that needs friction of the ground: less is within the legs' swing


STROKES = 3  # pushes in one motion, as none has more; a task that needs more energy is refused


def budget_diagnostics(
    task: Task,
    model: Model,
    requirements: Sequence[Requirement],
    flight: AskedFlight | None,
    document: Document,
) -> Iterator[Diagnostic]:
    """Time, energy, valves and friction of a task."""
    if flight is not None:
        yield from _time(task, flight, document)
        yield from _energy(task, model, flight, document)
    yield from _grip(model, requirements, document)


def _time(task: Task, flight: AskedFlight, document: Document) -> Iterator[Diagnostic]:
    """Rise to the apex and fall from it within the longest steps allowed."""
    longest = task.duration * (1 + task.step_variation)
    before = longest * (flight.requirement.at or 0.0)
    spans = []
    if flight.stays_below and before < longest:
        spans.append(("rise", flight.z0, before))
        if flight.z1 is not None:
            spans.append(("fall", flight.z1, longest - before))
    for what, other, span in spans:
        needed = flight.least_time(other, generous=False)
        if needed <= span:
            continue
        certain = flight.least_time(other, generous=True) > span * (1 + 1 / task.nodes)
        most = relax(document, flight.requirement, flight.height, flight.most(other, span))
        way = number(flight.height - other, "m")
        reason = (
            f"{key('duration', document)}: a {what} of {way} takes {needed:.2f} s, "
            f"{task.duration:g} s in all leave at most {span:.2f} s for it"
        )
        if certain:
            yield Diagnostic(f"{most.placed()}; {reason}", True, (most,), cause=True)
        else:
            yield Diagnostic(reason, False, cause=True)
        return


def _energy(
    task: Task, model: Model, flight: AskedFlight, document: Document
) -> Iterator[Diagnostic]:
    """Work of the air over the stroke against the lift, hips counted generously."""
    air, lift = air_work(model), flight.mass * flight.fall * (flight.height - flight.z0)
    asked = f"`{flight.requirement.text}` ({place(document, flight.requirement.location)})"
    off = _pistons_off(task, document)
    air = 0.0 if off else air
    if lift <= air:
        return
    longest = task.duration * (1 + task.step_variation) * (flight.requirement.at or 1.0)
    causes = [f"{off} keeps the pistons without air"] if off else []
    if task.payload > HEAVY * flight.mass:
        causes.append(f"{key('payload', document)} adds {number(task.payload, 'kg')}")
    lifted = f"{asked}: lifting {flight.mass:.1f} kg to {number(flight.height, 'm')}"
    most = flight.z0 + air / (flight.mass * flight.fall)
    yield Diagnostic(
        "; ".join([*causes, f"{lifted} takes {lift:.0f} J, one stroke of the pistons {air:.0f} J"]),
        lift > STROKES * air + hip_power(model) * longest,
        (relax(document, flight.requirement, flight.height, most),),
        cause=bool(causes),
    )


def _pistons_off(task: Task, document: Document) -> str:
    """The requirement that keeps every extend valve shut all the time, if there is one."""
    for pattern, bound in task.bounds.items():
        closed = bound.equals in (0, 0.0) or bound.at_most in (0, 0.0)
        if closed and "valve" in pattern and "retract" not in pattern and pattern.startswith("*"):
            return f"`bounds.{pattern}` ({place(document, ('bounds', pattern))})"
    return ""


def _grip(
    model: Model, requirements: Sequence[Requirement], document: Document
) -> Iterator[Diagnostic]:
    """A jump to another place from rest needs friction."""
    first = [w for w in requirements if w.at == 0.0 and w.quantity.name == "body/x"]
    last = [w for w in requirements if w.at == 1.0 and w.quantity.name == "body/x"]
    resting = any(w.at == 0.0 and w.location[-1] == "rest" for w in requirements)
    if not (first and last and resting):
        return
    way = max(last[0].lower - first[0].upper, first[0].lower - last[0].upper)
    floors = [e for e in model.effects if e.family == "ground" and "mu" in e.parameters()]
    if not floors or all(float(e.value("mu")) > 0 for e in floors):
        return
    if way < FORWARD:
        return
    where = place(document, last[0].location)
    yield Diagnostic(
        f"`{last[0].text}` ({where}): {number(way, 'm')} forward asked, but the ground "
        f"gives no grip: friction coefficient mu is 0 in the model `{model.name}` "
        f"({floors[0].name}), and without it the centre of mass stays where it starts",
        way > leg_swing(model) / model.mechanism.mass,
        cause=True,
    )
