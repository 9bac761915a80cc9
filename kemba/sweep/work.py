"""What a worker does with a case."""

from kemba.sweep.cases import Record, Work


def solve_case(work: Work) -> Record:
    """Plan a task as `kemba-opt solve` does, and execute it; the figures of its certificate.

    `replays`: the plan's inputs and its table come out as planned on the plan's own model.
    """
    from kemba.config import Document, parse
    from kemba.ocp import Task
    from kemba.solve import Approach, Listener, best_plan

    approach = Approach(replay=work["replay"])
    task, document = parse(work["task"], Task), Document(work["task"])
    best = best_plan(task, document, approach, Listener())
    kept = (
        "status", "sentence", "apex_m", "duration_s", "cost", "solve_s", "solve_cpu_s", "build_s",
        "iterations", "variables", "constraints", "residuals", "attempts", "good", "start",
        "plant_replay",
    )  # fmt: skip
    done = best.judged
    return {
        **{key: best.result[key] for key in kept},
        "refined": best.plan.refined,
        "replays": done is not None and done.replays,
    }


def execute_case(work: Work) -> Record:
    """Execute a controller table on a plant: whether it lands, and how far it is from its plan."""
    from kemba.sweep.execution import run_on_plant

    replay = run_on_plant(work)
    apex = float(max(replay.trajectory["body/z"]))
    status = ("flew" if replay.end else "landed") if replay.landed else "fell"
    sentence = f"{status}: apex {apex:.3f} m, {1e3 * replay.apex_error_m:+.0f} mm against the plan"
    if replay.fault:
        sentence += f", {replay.fault}"
    facts = {"status": status, "good": replay.landed, "sentence": sentence, "apex_m": apex}
    pitch = float(replay.trajectory["body/pitch"][-1])
    return {**facts, **replay.summary(), "pitch_rad": pitch}
