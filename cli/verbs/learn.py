"""`kemba-opt learn`: one round from executed runs to the next run."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, Foreign, HeldOut, NewRun, Set, newest, put, say


def learn(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(help="Runs that were executed; their logs may follow (the newest run)."),
    ] = None,
    logs: Annotated[
        list[Path] | None,
        typer.Option(help="A log, or a folder of logs; may be repeated (the run's newest)."),
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="Task YAML to plan next; else that of the last run.")
    ] = None,
    out: NewRun = None,
    overrides: Set = None,
    holdout: HeldOut = None,
    column_map: Foreign = None,
    time_limit: Annotated[
        float, typer.Option(min=5.0, help="Seconds at most; half of them for discovery.")
    ] = 600.0,
    correct: Annotated[
        bool,
        typer.Option(
            help="Correct what the model does not explain by shifting when valves switch."
        ),
    ] = True,
    force: Force = False,
) -> None:
    """Learn from executed runs and plan the next one: compare, discover, adopt, plan, correct.

    The new run folder holds the model (answer/), the plan, a controller table with the correction
    (correction.yaml), and the page learn.html. Exit code 1 when the new plan is not confirmed.

    With nothing given it takes the newest run and its newest logs.

    Example: kemba-opt learn runs/jump-1 --logs runs/jump-1/logs --target jump.yaml
    """
    from kemba.rounds.page import write_learning
    from kemba.rounds.round import Asked, learn_into
    from kemba.runs import load_run
    from kemba.solve import Listener
    from kemba_cli.next_steps import after_solve, say_next
    from kemba_cli.progress import LEARN, Progress

    folders, listed = _told_apart(runs or [], logs or [])
    folders = folders or [newest("controller.csv")]
    listed = listed or _logs_of(folders[-1])
    task = target or str(load_run(folders[-1]).task)
    asked = Asked(
        folders, listed, task, overrides or [], holdout or [], column_map, time_limit, correct
    )
    with Progress(LEARN, time_limit) as progress:
        listener = Listener(progress.tell, progress.watch)
        found, folder = learn_into(asked, out, listener, force)
    page = write_learning(found, folder.path)
    put(found.json(), folder.path)
    say(found.sentence, always=not found.good)
    say(f"{page}")
    say_next(after_solve(str(folder.path), found.good))
    if not found.good:
        raise typer.Exit(1)


def _told_apart(runs: list[Path], logs: list[Path]) -> tuple[list[Path], list[Path]]:
    """The runs and the logs among the arguments; a folder of logs stands for what it holds. Raises
    KembaError where a log does not exist."""
    from kemba.errors import KembaError
    from kemba.logs import is_log_file, log_files

    folders = [path for path in runs if not is_log_file(path)]
    listed: list[Path] = []
    for path in [*logs, *(path for path in runs if path not in folders)]:
        if not path.exists():
            raise KembaError(str(path), "no such file or folder", "logs of the run were expected")
        listed += log_files([path])
    return folders, listed


def _logs_of(run: Path) -> list[Path]:
    """The newest logs of a run; says which. Raises KembaError where it has none."""
    from kemba.errors import KembaError
    from kemba.runs import newest_logs

    found = newest_logs(run)
    if not found:
        hint = f"execute it: kemba-opt simulate {run} --repeat 3 --noise"
        raise KembaError(str(run), "has no logs", "its logs, or --logs, were expected", hint)
    say(f"with its newest logs: {len(found)} in {found[0].parent}")
    return found
