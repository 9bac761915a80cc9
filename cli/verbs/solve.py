"""`kemba-opt solve`: from a task file to a certified plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kemba_cli.common import Force, NewRun, Set, put, say, warn

if TYPE_CHECKING:
    from kemba.ocp import Task
    from kemba.trajectory import Trajectory


def solve(
    task: Annotated[
        str | None, typer.Argument(help="Task YAML, here or among the shipped ones.")
    ] = None,
    out: NewRun = None,
    overrides: Set = None,
    model: Annotated[str | None, typer.Option(help="Model YAML instead of the task's.")] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Continue from this run; its task unless TASK is given.")
    ] = None,
    earlier: Annotated[
        Path | None,
        typer.Option(
            "--from", help="Change the plan of this run (other height, supply, payload, model)."
        ),
    ] = None,
    cold: Annotated[
        bool, typer.Option("--cold", help="Begin from a guess, not from an earlier plan of yours.")
    ] = False,
    memory: Annotated[
        bool, typer.Option(help="Look up earlier plans of yours, and list this one with them.")
    ] = True,
    time_limit: Annotated[float | None, typer.Option(help="Seconds of solving at most.")] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check the task and say its size; solve nothing.")
    ] = False,
    starts: Annotated[
        int, typer.Option(min=1, help="Initial guesses to try; the best plan is kept.")
    ] = 1,
    robust: Annotated[
        int | None,
        typer.Option(
            min=1, help="Executions under drawn conditions; the plan that lands in most is kept."
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Guesses that are solved at the same time.")
    ] = None,
    replay: Annotated[bool, typer.Option(help="Execute the plan in simulation.")] = True,
    figure: Annotated[bool, typer.Option(help="Draw the plan.")] = True,
    force: Force = False,
) -> None:
    """Plan a motion; write trajectory, controller table, certificate and figure to a run folder.

    Exit code 1 when no plan is found, or when its re-simulation or the
    simulated robot leaves it by more than the task's tolerances, the
    latter also with feedback (policy.npz).

    `height` is that of the body's centre: at 0.45 m the feet rise 1 cm.
    `--set "feet=8 cm"` asks for the height of the feet instead.

    Example: kemba-opt solve jump.yaml --set "height=0.48 m"
    """
    from kemba.config import beside, find_config
    from kemba.effects import BY_KIND
    from kemba.model.spec import model_files
    from kemba.ocp import load_task
    from kemba.ocp.nlp.interrupt import Interrupt
    from kemba.ocp.reading import asked_of
    from kemba.plant.simulate import load_meanwhile
    from kemba.report.solving import DRAWING, solve_into
    from kemba.runs import RunFolder
    from kemba.solve import Approach, Listener
    from kemba_cli.next_steps import after_solve, say_next
    from kemba_cli.progress import SOLVE, Progress

    start, origin = None, None
    if resume is not None and earlier is not None:
        raise typer.BadParameter("--resume and --from exclude each other", param_hint="--from")
    if earlier is not None:
        from kemba.solve.earlier import origin_of

        origin = origin_of(earlier)
        task = task or str(earlier / "task.yaml")
    if resume is not None:
        task, out, start = _resumed(resume, task, out)
    if task is None:
        raise typer.BadParameter("a task was expected, such as jump.yaml", param_hint="TASK")
    options = list(overrides or [])
    if time_limit is not None:
        options.append(f"solver.time_limit={time_limit}")
    if robust is not None:
        options.append(f"robust={robust}")
    resolved, document = load_task(task, options)
    if dry_run:
        _dry_run(resolved, document, model)
        return
    resolved = resolved.model_copy(update={"model": beside(model or resolved.model, Path())})
    built, _ = asked_of(resolved, document)
    if built.ignored:
        warn(f"no plan can use {', '.join(built.ignored)}: it changes what is measured only")
    for remark in (*resolved.remarks, *built.remarks):
        warn(remark)
    models = [path for name in (resolved.model, resolved.plant) for path in model_files(name)]
    inputs = [find_config(task, "tasks"), *dict.fromkeys(models), *BY_KIND.files]
    folder = RunFolder.create(out, resolved.name, inputs, force=force)
    if replay:
        load_meanwhile(*([DRAWING] if figure else []))
    with (
        Progress(SOLVE) as progress,
        Interrupt(warn) as stop,
    ):
        listener = Listener(progress.tell, progress.watch, stop)
        approach = Approach(start, starts, jobs, replay, origin, cold, memory)
        answer = solve_into(folder, resolved, document, listener, approach, figure)
    put(answer, answer["run"])
    say(answer["sentence"], always=not answer["good"])  # why it failed is always said
    say_next(after_solve(answer["run"], answer["good"], answer["status"]))
    if answer["status"] == "interrupted":
        raise typer.Exit(130)
    if not answer["good"]:
        raise typer.Exit(1)


def _resumed(
    run: Path, task: str | None, out: Path | None
) -> tuple[str, Path | None, Trajectory | None]:
    """Task, folder and start of a run to continue: in its own folder when it never finished."""
    from kemba.runs import load_run

    found = load_run(run)
    unfinished = found.manifest.get("status") == "running"
    start = found.trajectory if (found.path / "trajectory.csv").is_file() else None
    return task or str(found.task), out or (found.path if unfinished else None), start


def _dry_run(task: Task, document: Any, model: str | None) -> None:
    from kemba.ocp.planning import program_size

    size = program_size(task, document, model)
    text = f"{task.name}: {size['variables']} variables, {size['constraints']} constraints"
    put({"task": task.name, **size}, text)
