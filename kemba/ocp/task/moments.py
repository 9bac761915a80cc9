"""Moments of a motion as shares of its nodes: by name, number, or an event of its contacts."""

import re
from collections.abc import Sequence

from kemba.errors import suggest
from kemba.ocp.task.task import Moment, Stance, Task
from kemba.quantity import to_si

NAMED = {"start": 0.0, "middle": 0.5, "end": 1.0}  # shares of the nodes
EVENT = re.compile(r"(touchdown|liftoff)(?: (\w+))?(?: (\d+))?")


def share_of(moment: Moment, task: Task) -> float:
    """The share of the nodes at which a moment is. Raises ValueError where there is no such one."""
    if not isinstance(moment, str):
        return float(moment)
    if moment in NAMED:
        return NAMED[moment]
    event = EVENT.fullmatch(moment)
    if event is None:
        try:
            share = to_si(moment, "1")
        except ValueError:
            known = (*NAMED, *events_of(task.contacts))
            raise ValueError(f"no moment '{moment}'; {suggest(moment, known)}") from None
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"'{moment}' is no share of the motion; 0 % to 100 % was expected")
        return share
    if not task.contacts:
        raise ValueError(f"'{moment}' is an event of `contacts`, which the task does not give")
    found = events_of(task.contacts)
    if moment in found:
        return found[moment]
    raise ValueError(f"`contacts` have no '{moment}'; {suggest(moment, found)}")


def spans(contacts: Sequence[Stance]) -> list[tuple[float, float]]:
    """The share of the nodes at which each part of the contacts begins and ends. Raises ValueError
    where the shares add up to more than the motion, or to less."""
    if not contacts:
        return []
    given = sum(part.share or 0.0 for part in contacts)
    free = sum(part.share is None for part in contacts)
    if given > 1.0 + 1e-9 or (free and given >= 1.0) or (not free and given < 1.0 - 1e-9):
        raise ValueError(f"the shares add up to {100 * given:.3g} %; 100 % was expected")
    rest = (1.0 - given) / max(free, 1)
    found, end = [], 0.0
    for part in contacts:
        begin, end = end, end + (rest if part.share is None else part.share)
        found.append((begin, min(end, 1.0)))
    return found


def events_of(contacts: Sequence[Stance]) -> dict[str, float]:
    """`touchdown front`, `liftoff rear 2` (the second): the share of the nodes at which each is.

    `touchdown` and `liftoff` alone are the first of any foot.
    """
    found: dict[str, float] = {}
    counts: dict[str, int] = {}
    for before, after, (begin, _) in zip(contacts, contacts[1:], spans(contacts)[1:], strict=False):
        ways = [("liftoff", leg) for leg in before.on if leg not in after.on]
        ways += [("touchdown", leg) for leg in after.on if leg not in before.on]
        for kind, leg in ways:
            name = f"{kind} {leg}"
            counts[name] = counts.get(name, 0) + 1
            found[name if counts[name] == 1 else f"{name} {counts[name]}"] = begin
            found.setdefault(kind, begin)
    return found
