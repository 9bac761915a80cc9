"""Found plans solved again on their own phases; where that fails, from a second start."""

from __future__ import annotations

from dataclasses import replace

from kemba.ocp.certificate.objective import costs
from kemba.ocp.certificate.status import Status, missed_of, verdict
from kemba.ocp.nlp.ending import Ending
from kemba.ocp.phases.settings import Refining
from kemba.ocp.planned import Plan
from kemba.ocp.planner import Planner, searched
from kemba.ocp.refinement import refine
from kemba.ocp.relaxation.session import Attempt
from kemba.stopwatch import Stopwatch


def refined(planner: Planner, found: Plan) -> Plan:
    """The plan on its own phases; where that fails, one from another start, which often gives a
    similar plan that can be refined."""
    first = on_phases(planner, found)
    if first.refined or first.status is not Status.ACCEPTABLE or planner.start is not None:
        return first
    task, noise = planner.task, Refining.current().second_start
    nudged = {"guess_noise": max(task.guess_noise, noise), "seed": task.seed + 1}
    planner.task = task.model_copy(update=nudged)
    second = searched(planner, False)
    planner.task = task
    if second.status is Status.SOLVED:
        second = on_phases(planner, replace(second, task=task))
    if second.status is Status.INTERRUPTED:
        first = replace(first, status=Status.INTERRUPTED)
    best = second if second.refined else first
    return replace(
        best,
        attempts=tuple(planner.session.attempts),
        solve_s=first.solve_s + second.solve_s,
        solve_cpu_s=first.solve_cpu_s + second.solve_cpu_s,
    )


def _unrefined(found: Plan, reason: str) -> Plan:
    """A plan that refining was asked for and failed on: it fulfils its own equations, but those of
    implicit Euler, whose chambers and impacts are off; so it is not what was asked."""
    facts = found.sentence.removeprefix(f"{Status.SOLVED}: ")
    kept = f"not refined ({reason}), the implicit Euler plan is kept, whose air forces are inexact"
    hint = "try other starts (--starts 4), more nodes, or accept it by --set refine=none"
    sentence = f"{Status.ACCEPTABLE}: {facts}; {kept}; {hint}"
    return replace(found, status=Status.ACCEPTABLE, sentence=sentence)


def on_phases(planner: Planner, found: Plan) -> Plan:
    """The plan solved again on its own phases; where that fails, the same with the reason."""
    refining = Stopwatch()
    task, model = found.task, found.model
    free = task.model_copy(update={"grip": 1.0})  # it comes last, from the plan that is found
    with refining.running():
        control = planner.session.control
        tell = planner.session.tell
        answer = refine(
            model, free, found.requirements, found.trajectory, control=control, tell=tell
        )
    planner.session.attempts.append(Attempt("phases", answer.ending, answer.iterations))
    found = replace(
        found,
        attempts=tuple(planner.session.attempts),
        solve_s=found.solve_s + refining.wall,
        solve_cpu_s=found.solve_cpu_s + refining.cpu,
    )
    new, certificate = answer.trajectory, answer.certificate
    if answer.ending is Ending.INTERRUPTED:
        kept = "interrupted while refining, the implicit Euler plan is kept"
        return replace(found, status=Status.INTERRUPTED, sentence=f"{found.sentence}; {kept}")
    if new is None or certificate is None:
        return _unrefined(found, answer.sentence)
    if certificate.missed:
        return _unrefined(found, missed_of(certificate.missed))
    if not certificate.within(task.tolerances):
        return _unrefined(found, "its result misses the task's tolerances")
    status, sentence = verdict(task, certificate, new, answer.ending)
    return replace(
        found,
        trajectory=new,
        certificate=certificate,
        status=status,
        sentence=f"{sentence}, refined on {len(answer.phases)} phases",
        cost=costs(model, new),
        refined=True,
        stages=answer.stages,
    )
