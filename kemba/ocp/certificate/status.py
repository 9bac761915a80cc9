"""Status and sentence of a plan, from what was measured."""

from __future__ import annotations

from kemba.ocp.certificate.certify import Certificate
from kemba.ocp.task.task import Task
from kemba.trajectory import Trajectory

LIMITS = (
    "Maximum_Iterations_Exceeded",
    "Maximum_CpuTime_Exceeded",
    "Maximum_WallTime_Exceeded",
)
ACCEPTABLE = 100.0  # times the tolerance: usable, but not what was asked


def verdict(
    task: Task, certificate: Certificate, trajectory: Trajectory, message: str
) -> tuple[str, str]:
    """(status, sentence): solved, acceptable, infeasible, stalled, limit or interrupted."""
    facts = f"apex {max(trajectory['body/z']):.3f} m, {trajectory.time[-1]:.3f} s"
    if message == "User_Requested_Stop":
        return "interrupted", f"interrupted: best iterate kept, {facts}; {_worst(certificate)}"
    if certificate.within(task.tolerances):
        return "solved", f"solved: {facts}"
    loose = task.tolerances.model_copy(
        update={
            name: ACCEPTABLE * getattr(task.tolerances, name)
            for name in ("complementarity", "dynamics", "bounds")
        }
    )
    if certificate.within(loose):
        return "acceptable", f"acceptable, short of tolerance: {facts}; {_worst(certificate)}"
    if message in LIMITS:
        return "limit", f"stopped by a limit before a plan was found: {_worst(certificate)}"
    if message == "Infeasible_Problem_Detected":
        return "infeasible", f"infeasible as far as the solver sees: {_worst(certificate)}"
    return "stalled", f"stalled ({message}): {_worst(certificate)}"


def _worst(certificate: Certificate) -> str:
    if not certificate.worst:
        return "nothing is violated"
    v = certificate.worst[0]
    return f"worst: {v.what} by {v.violation:.3g} {v.unit} at node {v.node} ({v.time_s:.3f} s)"
