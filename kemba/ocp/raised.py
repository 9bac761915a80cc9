"""A plan in a scene from one on level ground: the scene rises step by step.

Walls and obstacles forbid most of what a start guess does. On level ground a plan is soon found,
and it changes little where walls rise by little: continuation in one parameter, the share of the
scene's heights, with steps that double where one is solved and halve where it is not (Allgower and
Georg, Introduction to Numerical Continuation Methods, SIAM 2003). Phases of contacts and valves are
read anew only where the smallest step is not solved on them: a smaller step costs a tenth of that.
"""

from __future__ import annotations

from dataclasses import replace

from kemba.config import Document
from kemba.ocp.finer import continued
from kemba.ocp.planned import Plan
from kemba.ocp.planner import Planner
from kemba.ocp.reading import asked_of
from kemba.ocp.task.task import Task

FIRST = 1 / 8  # of the heights, by the first step
LEAST = 1 / 64  # the smallest step: 2 mm of a wall of 15 cm


def rises(task: Task) -> bool:
    """Whether there is a level ground from which the scene of a task rises."""
    scene = task.scene
    shaped = scene.ground.level is None or scene.obstacles
    if not shaped or task.sequence or task.refine != "radau":
        return False
    return scene.lowered(0.0, task.place_x).ground.level is not None


def raised(found: Plan, planner: Planner, document: Document) -> Plan | None:
    """The refined plan in the planner's scene from the one `found` on level ground; None where a
    step has no solution near, or time is over before the last."""
    session, share, step = planner.session, 0.0, FIRST
    while share < 1.0:
        if session.control.ended():
            return None
        new = min(1.0, share + step)
        session.tell(f"the scene at {new:.0%} of its height")
        name = f"the plan at {share:.0%} of its height" if share else "the plan on level ground"
        last = step <= LEAST
        near, _ = continued(lowered(planner, document, new), found.origin(name, once=not last))
        if near is not None:
            found, share, step = near, new, 2.0 * step
        elif last:
            return None
        else:
            step /= 2.0
    return replace(found, continued=None, start="level ground")


def lowered(planner: Planner, document: Document, share: float) -> Planner:
    """The planner with a `share` of its scene's heights."""
    if share == 1.0:
        return planner
    task = planner.task
    scene = task.scene.lowered(share, task.place_x)
    own = task.model_copy(update={"terrain": scene.terrain, "obstacles": scene.obstacles})
    model, asked = asked_of(own, document)
    lags = planner.lags and asked_of(own, document, lags=True)
    return replace(planner, task=own, model=model, requirements=asked, lags=lags, outcome=None)
