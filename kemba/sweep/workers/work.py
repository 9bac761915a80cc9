"""What a worker does with a case."""

from __future__ import annotations

from kemba.sweep.cases.case import Record, Work


def solve_case(work: Work) -> Record:
    """Plan a task: the figures of `kemba-opt solve`."""
    from kemba.config import parse
    from kemba.ocp import Task, plan
    from kemba.ocp.report import answer

    figures = answer(plan(parse(work["task"], Task)), "")
    kept = (
        "status", "sentence", "apex_m", "duration_s", "cost", "solve_s", "solve_cpu_s", "build_s",
        "iterations", "variables", "constraints", "residuals", "attempts", "good",
    )  # fmt: skip
    return {key: figures[key] for key in kept}


def execute_case(work: Work) -> Record:
    """Execute a controller table on a plant: whether it lands, and how far it is from its plan."""
    from kemba.sweep.cases.execution import run_on_plant

    replay = run_on_plant(work)
    apex = float(max(replay.trajectory["body/z"]))
    status = "landed" if replay.landed else "fell"
    sentence = f"{status}: apex {apex:.3f} m, {1e3 * replay.apex_error_m:+.0f} mm against the plan"
    if replay.fault:
        sentence += f", {replay.fault}"
    return {
        "status": status,
        "good": replay.landed,
        "sentence": sentence,
        "apex_m": apex,
        **replay.summary(),
        "pitch_rad": float(replay.trajectory["body/pitch"][-1]),
    }
