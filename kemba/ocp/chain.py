"""Motions one after the other: plans that meet become one plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kemba.ocp.certificate.certify import Certificate
from kemba.ocp.certificate.objective import costs
from kemba.ocp.certificate.status import Status
from kemba.ocp.planned import Plan
from kemba.ocp.task.requirement import Requirement
from kemba.ocp.task.task import Task
from kemba.trajectory import Trajectory

AHEAD = ("body/x", "foot/x", "hip/x", "knee/x")  # what a motion before has moved on


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Trajectories in a row, each from where the one before ends: in time and in place.

    Their first and last states agree; of both the earlier is kept. Columns are those of the first.
    """
    first = parts[0]
    time, columns = [first.time], {name: [first[name]] for name in first.names}
    phases = list(first.meta.get("phases", ()))
    end, x, nodes = float(first.time[-1]), float(first["body/x"][-1]), len(first) - 1
    for part in parts[1:]:
        time.append(part.time[1:] - part.time[0] + end)
        on = x - float(part["body/x"][0])
        for name, values in columns.items():
            values.append(part[name][1:] + on * name.endswith(AHEAD))
        phases += [_later(str(text), nodes) for text in part.meta.get("phases", ())]
        end, x = float(time[-1][-1]), float(columns["body/x"][-1][-1])
        nodes += len(part) - 1
    whole = {h: np.concatenate(columns[n]) for h, n in zip(first.headers, first.names, strict=True)}
    meta = {**first.meta, **({"phases": phases} if phases else {})}
    return Trajectory(np.concatenate(time), whole, meta)


def _later(phase: str, nodes: int) -> str:
    """A phase of the sidecar, `12-18 ho 10`, some nodes later."""
    span, rest = phase.split(" ", 1)
    first, last = span.split("-")
    return f"{int(first) + nodes}-{int(last) + nodes} {rest}"


def chained(task: Task, plans: Sequence[Plan]) -> Plan:
    """Plans that meet as one plan of `task`; every requirement keeps its own time."""
    whole = joined([plan.trajectory for plan in plans])
    total, begin, time = len(whole) - 1, 0, 0.0
    requirements: list[Requirement] = []
    asked, worst = [], []
    for plan in plans:
        count = len(plan.trajectory) - 1
        moved = (_moved(r, begin, count, total) for r in plan.requirements)
        requirements += moved
        own = plan.certificate
        asked += [replace(m, node=m.node + begin, time_s=m.time_s + time) for m in own.asked]
        worst += [replace(v, node=v.node + begin, time_s=v.time_s + time) for v in own.worst]
        begin, time = begin + count, time + float(np.ptp(plan.trajectory.time))
    each = [plan.certificate for plan in plans]
    certificate = Certificate(
        complementarity=max(c.complementarity for c in each),
        binary=max(c.binary for c in each),
        dynamics=max(c.dynamics for c in each),
        bounds=max(c.bounds for c in each),
        worst=tuple(sorted(worst, key=lambda v: -v.size)[:8]),
        asked=tuple(asked),
    )
    first, model = plans[0], plans[0].model
    apex, lasts = f"apex {whole['body/z'].max():.3f} m", f"{np.ptp(whole.time):.3f} s"
    return replace(
        first,
        task=task,
        requirements=tuple(requirements),
        trajectory=whole,
        certificate=certificate,
        status=Status.SOLVED,
        sentence=f"{Status.SOLVED}: {len(plans)} motions in a row, {apex}, {lasts}",
        cost=costs(model, whole),
        attempts=tuple(a for plan in plans for a in plan.attempts),
        solve_s=sum(plan.solve_s for plan in plans),
        solve_cpu_s=sum(plan.solve_cpu_s for plan in plans),
        build_s=sum(plan.build_s for plan in plans),
        variables=sum(plan.variables for plan in plans),
        constraints=sum(plan.constraints for plan in plans),
        refined=all(plan.refined for plan in plans),
        stages=None,
    )


def _moved(requirement: Requirement, begin: int, count: int, total: int) -> Requirement:
    """A requirement of a part by the nodes of the whole."""

    def at(share: float) -> float:
        return (begin + share * count) / total

    during = at(requirement.during[0]), at(requirement.during[1])
    moment = None if requirement.at is None else at(requirement.at)
    minus = requirement.minus and replace(requirement.minus, at=at(requirement.minus.at))
    return replace(requirement, at=moment, during=during, minus=minus)
