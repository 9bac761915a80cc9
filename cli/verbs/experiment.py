"""`kemba-opt experiment`: the next test that tells the possible effects of an answer apart."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kemba_cli.common import Force, put, say
from kemba_cli.failures import BAD_ANSWER

if TYPE_CHECKING:
    from kemba.identify.design.robot import MotionProposal, Tried
    from kemba_cli.progress import Progress


PLANS = 2  # motions of which plans are tried before the verb gives up


class Place(str, Enum):
    """Where the test is done."""

    rig = "rig"
    robot = "robot"


def experiment(
    answer: Annotated[Path, typer.Argument(help="Folder written by discover.")],
    out: Annotated[
        Path | None, typer.Option(help="Rig or task YAML to write (experiment.yaml in the answer).")
    ] = None,
    on: Annotated[Place, typer.Option(help="A piston on a rig, or the robot.")] = Place.rig,
    certify: Annotated[
        bool, typer.Option(help="On the robot: plan the motion at once, until it is certified.")
    ] = True,
    force: Force = False,
) -> None:
    """Design the test that best tells the possible effects of an answer apart: a rig or task YAML.

    Exit code 1 when no plan of the robot's motion is certified.

    Example: kemba-opt experiment answer --out next.yaml
    """
    from kemba.folders import YAML, fresh
    from kemba.identify.answer import read_answer
    from kemba_cli.next_steps import say_next
    from kemba_cli.progress import EXPERIMENT, Progress

    read_answer(answer)  # before a folder is made for the test
    path = fresh(out or answer / "experiment.yaml", force, endings=YAML)
    with Progress(EXPERIMENT) as progress:
        if on is Place.robot:
            facts = _on_robot(answer, path, certify, progress)
        else:
            facts = _on_rig(answer, path, progress)
    put({"experiment": str(path), "on": on.value, **facts}, path)
    say(facts["sentence"])
    say_next(facts["next"].removeprefix("kemba-opt "))
    if not facts["next"]:
        say(facts["why"])
        raise typer.Exit(BAD_ANSWER)


def _on_rig(answer: Path, path: Path, progress: Progress) -> dict[str, Any]:
    from kemba.identify.design.rig import propose
    from kemba_cli.next_steps import after_experiment

    found = propose(answer, path, progress.tell)
    return {**found.json(), "next": f"kemba-opt {after_experiment(path, False)}"}


def _on_robot(answer: Path, path: Path, certify: bool, progress: Progress) -> dict[str, Any]:
    """The motion as a task; with `certify` also a plan of it that is good, and what that gives."""
    from kemba.identify.design.robot import propose_motion
    from kemba_cli.next_steps import after_experiment, after_plan

    found = propose_motion(answer, path, progress.tell)
    facts = {**found.json(), "next": f"kemba-opt {after_experiment(path, True)}"}
    if not certify:
        return facts
    for tried in found.motions[:PLANS]:
        plan = _planned(found, tried, path, progress)
        if plan["good"]:
            run = plan["run"]
            planned = {"run": run, "plan": plan["sentence"], "nats_of_plan": found.nats_of(run)}
            return {**facts, **planned, "next": f"kemba-opt {after_plan(run)}"}
    why = f"no plan of these motions is certified: {plan['sentence']}"
    return {**facts, "run": None, "why": why, "next": ""}


def _planned(found: MotionProposal, tried: Tried, path: Path, progress: Progress) -> dict[str, Any]:
    """A plan of one of the motions, in a run folder of its own, with its certificate."""
    from kemba.ocp import load_task
    from kemba.report.solving import solve_into
    from kemba.runs import RunFolder
    from kemba.solve import Listener

    found.write(path, tried)
    task, document = load_task(str(path))
    folder = RunFolder.create(None, task.name, [path])
    listener = Listener(lambda text: progress.tell(f"planning: {text}"), progress.watch)
    return solve_into(folder, task, document, listener, figure=False)
