"""A plan as the machine-readable answer of `kemba-opt solve`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from kemba.events import feet
from kemba.ocp.certificate.status import Status
from kemba.ocp.planned import Plan
from kemba.ocp.task.height import rise_of_feet

GROUND = 1e-3  # m; lower feet stand


def sentence_of(plan: Plan) -> str:
    """The plan's sentence for the user; that of a plan which is not what was asked says so."""
    asked = plan.status in (Status.SOLVED, Status.INTERRUPTED)
    return plan.sentence if asked else f"FAILED: {plan.sentence}"


def warnings(plan: Plan) -> list[str]:
    """What a task that was met may not have meant."""
    rests = any(r.location == ("end", "rest") for r in plan.requirements)
    heights = [gap[-1] for gap in feet(plan.trajectory).values()]
    if not rests or not heights or min(heights) <= GROUND:
        return []
    hint = 'a robot in the air falls; ask for `"*/foot/gap": 0 m` at the end'
    return [f"the motion ends at rest with no foot on the ground: {hint}"]


def answer(plan: Plan, run: str) -> dict[str, Any]:
    """The JSON of `solve`, also written as certificate.json."""
    trajectory, certificate = plan.trajectory, plan.certificate
    tolerances = plan.task.tolerances
    limit = max(tolerances.complementarity, tolerances.dynamics, tolerances.bounds)
    return {
        "status": plan.status,
        "sentence": sentence_of(plan),
        "run": run,
        "task": plan.task.name,
        "apex_m": float(max(trajectory["body/z"])),
        "feet_m": rise_of_feet(trajectory),
        "duration_s": float(trajectory.time[-1]),
        "cost": plan.cost,
        "solve_s": plan.solve_s,
        "solve_cpu_s": plan.solve_cpu_s,
        "build_s": plan.build_s,
        "iterations": plan.iterations,
        "variables": plan.variables,
        "constraints": plan.constraints,
        "residuals": {
            "complementarity": certificate.complementarity,
            "binary": certificate.binary,
            "dynamics": certificate.dynamics,
            "bounds": certificate.bounds,
        },
        "replay": None,
        "table_replay": None,
        "plant_replay": None,
        "impacts": None,
        "requirements": [measured.json() for measured in certificate.asked],
        "reached": {
            measured.text.removeprefix("goals.").partition(":")[0]: measured.value
            for measured in certificate.asked
            if measured.text.startswith("goals.")
        },
        "verdict_on": None,
        "band": None,
        "robust": None,
        "strides": None,
        "good": plan.status is Status.SOLVED,
        "continued": plan.continued,
        "start": plan.start,
        "best_known": None,
        "ignored": plan.model.ignored,
        "remarks": [*plan.model.remarks, *warnings(plan)],
        "relax": [
            {
                name: getattr(r, name)
                for name in ("requirement", "where", "asked", "reachable", "unit")
            }
            for r in plan.relax
        ],
        "worst": [
            {key: value for key, value in asdict(v).items() if key != "size"}
            for v in certificate.worst
            if v.size > limit
        ],
        "attempts": [asdict(a) for a in plan.attempts],
    }
