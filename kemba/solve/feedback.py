"""A plan that only the simulated robot does not keep to, played with the feedback of its policy."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace
from io import BytesIO

import numpy as np

from kemba.errors import KembaError
from kemba.ocp.certificate.status import Status
from kemba.plant.certificate import plant_run, rest_after
from kemba.plant.controller import read_controller
from kemba.plant.repeat import VALVE_SCATTER
from kemba.plant.replay import Replay
from kemba.policy.course import course_of
from kemba.policy.execute import execute_policy
from kemba.policy.modes import Array
from kemba.policy.player import Policy
from kemba.policy.write import policy_arrays
from kemba.scenarios.feedback import KEPT, WAYS, acting
from kemba.solve.judged import Feedback, Judged, landing_speed, plant_of
from kemba.solve.trial import Trial, TrialOrder, confirmed
from kemba.solve.verdict import EXECUTIONS, Verdict, allowances, judge

PLAYED = 3  # executions with other noise of sensors and valves each; all must keep to the plan


def first_with_feedback(
    trials: Iterable[Trial], execution: TrialOrder, deadline: float
) -> Trial | None:
    """The first of the trials, best ones first, that is good with its policy; None where none is
    before the deadline [s]. The best one is tried in any case, which takes some seconds: where
    planning takes all the time, feedback is what is left."""
    for number, trial in enumerate(sorted(trials, key=lambda trial: trial.score, reverse=True)):
        if number and time.monotonic() > deadline:
            break
        if found := with_feedback(trial, execution):
            return found
    return None


def with_feedback(trial: Trial, execution: TrialOrder) -> Trial | None:
    """The trial with a policy that makes it good; None where there is none, or is none to be asked.

    Its inputs and its table must keep to the plan on its own model: feedback is for what a plant
    does otherwise. A learnt model's verdict asks no plant.
    """
    done, table, found = trial.judged, trial.motions.table, trial.plan
    if done is None or table is None or found.status is not Status.SOLVED:
        return None
    if not done.replays or done.truth.learnt:
        return None
    execution.tell("replay: with feedback of the body's pose")
    try:
        arrays = policy_arrays(course_of(found.model, read_controller(table)))
    except (KembaError, ValueError):  # soft contacts, or a table that cannot be linearised
        return None
    for way, parts in WAYS.items():
        if any(parts) and (played := _played(trial, done, way, acting(arrays, *parts))):
            return confirmed(replace(trial, judged=played), execution.place)
    return None


def _played(trial: Trial, done: Judged, way: str, arrays: Mapping[str, Array]) -> Judged | None:
    """What was judged, with a policy by which each execution keeps to the plan; else None."""
    table, found = trial.motions.table, trial.plan
    assert table is not None
    plan, machine, file = found.trajectory, plant_of(found.task), BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type]
    allowed = allowances(found.task.tolerances, landing_speed(plan))["plant_replay"]
    given = rest_after(found.model, plan, table), None, 1e-3, True, VALVE_SCATTER
    executions: list[tuple[Verdict, Replay]] = []
    for seed in range(PLAYED):
        file.seek(0)
        try:
            run = execute_policy(table, Policy(file), machine, *given, seed).against(machine, plan)
        except KembaError:
            return None
        verdict = judge(EXECUTIONS["plant_replay"], run, allowed, same_model=False)
        if not verdict.good:
            return None
        executions.append((verdict, run))
    verdict, worst = max(executions, key=lambda one: one[0].share)
    alone = done.verdicts["plant_replay"].sentence
    said = f"with feedback by {way} (policy.npz) the {verdict.sentence}"
    said += f"; by controller.csv alone {alone}"
    told = zip(KEPT, ([way], [PLAYED], [PLAYED], PLAYED), strict=True)
    arrays = {**arrays, **{key: np.array(value) for key, value in told}}
    facts = {"by": way, "alone": alone, **worst.summary()}
    feedback = Feedback(arrays, replace(verdict, sentence=said), facts)
    return replace(done, feedback=feedback, motion=plant_run(worst))
