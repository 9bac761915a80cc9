"""Plans on many nodes: sought on fewer, where it takes seconds, then solved on all of them.

Contacts and valves of a plan are decided on the coarser grid. Its refined plan starts the finer
program near the solution, so that only a few iterations are made on many nodes.
"""

from __future__ import annotations

from dataclasses import replace

from kemba.ocp.certificate.status import Status
from kemba.ocp.continuation.between import Origin
from kemba.ocp.continued import continued
from kemba.ocp.planned import Plan
from kemba.ocp.planner import Planner, searched
from kemba.ocp.refined import refined
from kemba.settings import Settings, setting


class Sought(Settings):
    """Where plans are sought."""

    nodes: int = setting(
        100, "1", "nodes at most on which a plan is sought from a guess",
        "tuned: benchmarks/scaling.py; on 200 a forward jump takes twice as long, and more often "
        "it fails", decides=True,
    )  # fmt: skip


def found_and_refined(planner: Planner, refused: bool) -> Plan:
    """A plan from the guess, refined where the task asks for it; without air on the legs and grip,
    which come last."""
    if planner.task.refine == "radau" and planner.start is None and not refused:
        found = _from_fewer(planner)
        if found is not None:
            return found
    found = searched(planner, refused)
    if found.status is Status.SOLVED and planner.task.refine == "radau":
        found = refined(planner, found)
    return found


def _from_fewer(planner: Planner) -> Plan | None:
    """The plan on the task's nodes from one on fewer; None where they are few, or where there is
    none or it cannot be solved on all of them."""
    task, fewer = planner.task, Sought.current().nodes
    if task.nodes <= fewer:
        return None
    coarse = replace(planner, task=task.model_copy(update={"nodes": fewer}))
    found = refined(coarse, searched(coarse, False))
    if found.status is Status.INTERRUPTED:
        return found
    if not found.refined:
        return None
    plain = {"grip": 1.0, "landing": task.landing.model_copy(update={"air": None})}
    name = f"the plan on {fewer} nodes"
    origin = Origin(
        found.trajectory, found.model, found.requirements, name, once=True, stages=found.stages
    )
    near, _ = continued(replace(planner, task=task.model_copy(update=plain)), origin)
    if near is None:
        return None
    wall, cpu = found.solve_s + near.solve_s, found.solve_cpu_s + near.solve_cpu_s
    return replace(near, task=task, continued=None, solve_s=wall, solve_cpu_s=cpu)
