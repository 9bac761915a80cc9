"""`kemba-opt learn`: one round from executed runs to the next run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, Foreign, Json, OwnEffects, Quiet, print_json, say


def learn(
    runs: Annotated[
        list[Path], typer.Argument(help="Runs that were executed; their logs (CSV) may follow.")
    ],
    logs: Annotated[
        list[Path] | None, typer.Option(help="A log, or a folder of logs; may be repeated.")
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="Task YAML to plan next; else that of the last run.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Run folder to write.")] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", help="Override a key: --set 'height=0.6 m'.")
    ] = None,
    holdout: Annotated[
        list[Path] | None, typer.Option(help="A log kept for judging only; may be repeated.")
    ] = None,
    column_map: Foreign = None,
    time_limit: Annotated[
        float, typer.Option(min=5.0, help="Seconds of discovery at most.")
    ] = 300.0,
    correct: Annotated[
        bool, typer.Option(help="Correct what the model does not explain, by valve edges.")
    ] = True,
    force: Force = False,
    own_effects: OwnEffects = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Learn from executed runs and plan the next one: compare, discover, adopt, plan, correct.

    The new run folder holds the model (answer/), the plan, a controller table with the correction
    (correction.yaml), and the page learning.html. Exit code 1 when the new plan is not confirmed.

    Example: kemba-opt learn runs/jump-1 --logs runs/jump-1/logs --target jump.yaml
    """
    from kemba.config import find_config
    from kemba.learn.page import write_learning
    from kemba.learn.round import Asked
    from kemba.learn.round import learn as learn_once
    from kemba.ocp import load_task
    from kemba.report import Listener
    from kemba.runs import RunFolder, load_run
    from kemba_cli.progress import Progress

    folders = [path for path in runs if path.is_dir() or path.suffix != ".csv"]
    listed = _files([*(logs or []), *(path for path in runs if path not in folders)])
    if not folders:
        raise typer.BadParameter("a run folder was expected", param_hint="RUN")
    if not listed:
        raise typer.BadParameter("logs were expected, such as --logs RUN/logs", param_hint="--logs")
    task = target or str(load_run(folders[-1]).task)
    asked = Asked(
        folders, listed, task, overrides or [], holdout or [], column_map, time_limit, correct
    )
    name = load_task(task, list(overrides or []))[0].name  # mistakes first, before minutes of work
    folder = RunFolder.create(out, name, [find_config(task, "tasks"), *listed], force=force)
    try:
        with Progress(quiet or json) as progress:
            found = learn_once(asked, folder, Listener(progress.tell, progress.watch))
    except BaseException:
        if folder.lock is not None:
            folder.finish("failed")
        raise
    page = write_learning(found, folder.path)
    if json:
        print_json(found.json())
    else:
        typer.echo(str(folder.path))
        say(found.sentence, quiet and found.good)
        say(f"{page}", quiet)
    if not found.good:
        raise typer.Exit(1)


def _files(paths: list[Path]) -> list[Path]:
    """The logs in folders, and the others."""
    found: list[Path] = []
    for path in paths:
        found += sorted(path.glob("*.csv")) if path.is_dir() else [path]
    return found
