"""A sequence of motions: each planned by itself, meeting its neighbours in every state.

periodic motions first, from nothing
then the others, from left to right:
    start = the state in which the motion before ends
    end   = the state in which the motion after begins
all of them in a row are one plan, which is executed and judged as any other
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kemba.config import Document
from kemba.model import Model
from kemba.ocp import Plan, Task
from kemba.ocp.certificate.status import Status
from kemba.ocp.chain import chained
from kemba.ocp.sequence import motions
from kemba.ocp.task.task import Bound
from kemba.trajectory import Trajectory

Planned = Callable[[Task, Document], Plan]


def planned(task: Task, document: Document, one: Planned) -> Plan:
    """The plan of a sequence; `one` plans a motion. Where one fails, its plan, which says so."""
    parts = motions(task, document, (document.source,))
    done: dict[int, Plan] = {}
    same: dict[int, Plan] = {}  # a repeated motion is planned once
    order = sorted(range(len(parts)), key=lambda i: parts[i][0].periodic is None)
    for i in order:
        own, place = parts[i]
        repeats = own.periodic is not None and id(place) in same
        if repeats:
            done[i] = same[id(place)]
            continue
        before, after = done.get(i - 1), done.get(i + 1)
        found = one(_meeting(own, before, after), place)
        if found.status is not Status.SOLVED:
            said = f"motion {i + 1} of the sequence, {own.name}: {found.sentence}"
            return replace(found, sentence=said)
        done[i] = found
        if own.periodic is not None:
            same[id(place)] = found
    return chained(task, [done[i] for i in range(len(parts))])


def _meeting(task: Task, before: Plan | None, after: Plan | None) -> Task:
    """A motion that begins as the one before ends, and ends as the one after begins."""
    changes: dict[str, Any] = {}
    if before is not None:
        changes["start"] = {
            "body/x": Bound(equals=0.0),
            **_state(before.model, before.trajectory, -1),
        }
    if after is not None:
        state, valves = (
            _state(after.model, after.trajectory, 0),
            _valves(after.model, after.trajectory),
        )
        kept = {name: b for name, b in task.end.items() if name == "body/x"}
        changes["end"] = {**kept, **state, **valves}
    return task.model_copy(update=changes)


def _state(model: Model, motion: Trajectory, row: int) -> dict[str, Bound]:
    """Every coordinate but the way, every rate and every state of an effect at a row."""
    mechanism = model.mechanism
    listed = [*mechanism.coordinates, *mechanism.velocities, *model.states.values()]
    return {q.name: Bound(equals=float(motion[q.name][row])) for q in listed if q.name != "body/x"}


def _valves(model: Model, motion: Trajectory) -> dict[str, Bound]:
    """The valves in the first interval."""
    inputs = (q for q in model.inputs.values() if q.binary)
    return {q.name: Bound(equals=float(round(motion[q.name][1]))) for q in inputs}
