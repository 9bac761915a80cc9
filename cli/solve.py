"""`kemba-opt solve`: from a task file to a certified plan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kemba_cli.common import Json, Quiet, print_json, say

if TYPE_CHECKING:
    from kemba.ocp import Plan, Task
    from kemba.trajectory import Trajectory

Set = Annotated[
    list[str] | None, typer.Option("--set", help="Override a key: --set 'height=0.6 m'.")
]


def solve(
    task: Annotated[
        str | None, typer.Argument(help="Task YAML, here or among the shipped ones.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Run folder to write.")] = None,
    overrides: Set = None,
    model: Annotated[str | None, typer.Option(help="Model YAML instead of the task's.")] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Go on from this run; its task unless TASK is given.")
    ] = None,
    time_limit: Annotated[float | None, typer.Option(help="Seconds of solving at most.")] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check the task and say its size; solve nothing.")
    ] = False,
    figure: Annotated[bool, typer.Option(help="Draw the plan.")] = True,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Plan a motion; write trajectory, controller table, certificate and figure to a run folder.

    Example: kemba-opt solve jump.yaml --set "height=0.6 m"
    """
    from kemba.config import find_config
    from kemba.ocp import load_task, task_model
    from kemba.ocp.wishes import resolve

    start = None
    if resume is not None:
        task, out, start = _resumed(resume, task, out)
    if task is None:
        raise typer.BadParameter("a task was expected, such as jump.yaml", param_hint="TASK")
    options = list(overrides or [])
    if time_limit is not None:
        options.append(f"solver.time_limit={time_limit}")
    resolved, document = load_task(task, options)
    if dry_run:
        _dry_run(resolved, document, model, json)
        return
    resolved = resolved.model_copy(update={"model": model or resolved.model})
    resolve(resolved, task_model(resolved), document)
    source = find_config(task, "tasks")
    answer = _solve(resolved, document, source, out, figure, quiet or json, start)
    if json:
        print_json(answer)
    else:
        typer.echo(answer["run"])
        say(answer["sentence"], quiet)
    if answer["status"] == "interrupted":
        raise typer.Exit(130)
    if answer["status"] != "solved":
        raise typer.Exit(1)


def _resumed(
    run: Path, task: str | None, out: Path | None
) -> tuple[str, Path | None, Trajectory | None]:
    """Task, folder and start of a run that goes on: in its own folder when it never finished."""
    from kemba.runs import load_run

    found = load_run(run)
    unfinished = found.manifest.get("status") == "running"
    start = found.trajectory if (found.path / "trajectory.csv").is_file() else None
    return task or str(found.task), out or (found.path if unfinished else None), start


def _solve(
    task: Task,
    document: Any,
    source: Path,
    out: Path | None,
    figure: bool,
    quiet: bool,
    start: Trajectory | None = None,
) -> dict[str, Any]:
    from kemba.config import dump_yaml, find_config
    from kemba.ocp import plan
    from kemba.ocp.interrupt import Interrupt
    from kemba.ocp.report import answer
    from kemba.runs import RunFolder
    from kemba_cli.progress import Progress

    model_file = find_config(task.model, "models")
    folder = RunFolder.create(out, task.name, inputs=[source, model_file])
    dump_yaml(task.model_dump(exclude_none=True), folder / "task.yaml")
    try:
        with Progress(quiet) as progress, Interrupt(lambda text: say(text, quiet)) as stop:
            found = plan(
                task,
                document,
                log=folder / "solver.log",
                tell=progress.tell,
                watch=progress.watch,
                start=start,
                stop=stop,
            )
            result = answer(found, str(folder.path))
            _write(found, result, folder, figure)
    except BaseException:
        folder.finish("failed")
        raise
    folder.finish(found.status, sentence=found.sentence)
    return result


def _write(found: Plan, result: dict[str, Any], folder: Any, figure: bool) -> None:
    from kemba.ocp import controller_table
    from kemba.runs import write_json

    write_json(folder / "certificate.json", result)
    if not found.attempts:
        return  # refused before solving: there is no motion to write
    found.trajectory.write(folder / "trajectory.csv")
    controller_table(found.model, found.trajectory).write(folder / "controller.csv")
    if figure:
        from kemba import plotting

        sources = plotting.load_sources([folder.path])
        plotting.save_figure(plotting.draw(sources), folder / "figure.png")


def _dry_run(task: Task, document: Any, model: str | None, json: bool) -> None:
    from kemba.ocp.plan import program_size

    size = program_size(task, document, model)
    if json:
        print_json({"task": task.name, **size})
    else:
        typer.echo(f"{task.name}: {size['variables']} variables, {size['constraints']} rows")
