"""`kemba-opt review`: plan, simulated robot and logs on one page, with a verdict."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Executed, Force, Foreign, Show, newest, open_page, put, say
from kemba_cli.failures import BAD_ANSWER


def review(
    logs: Annotated[
        list[Path] | None,
        typer.Argument(help="Logs of one machine, or folders of logs, a run, an answer."),
    ] = None,
    run: Executed = None,
    answer: Annotated[Path | None, typer.Option(help="Folder that discover wrote.")] = None,
    model: Annotated[
        str | None, typer.Option(help="Model YAML to judge, not the run's own.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="HTML to write (a new review.html beside the logs).")
    ] = None,
    column_map: Foreign = None,
    show: Show = False,
    force: Force = False,
) -> None:
    """Write one page about a jump: the verdict, plan and logs over each other, what is missing.

    With nothing given it takes the newest run and its logs. The page needs no other file.

    Example: kemba-opt review log-1.csv log-2.csv --run runs/jump-1
    """
    from kemba.report.review import review as write
    from kemba.runs import newest_logs
    from kemba_cli.next_steps import say_verdict
    from kemba_cli.progress import REVIEW, Progress

    logs, run, answer = _told_apart(logs or [], run, answer)
    if not logs and run is None and answer is None:
        run = newest("certificate.json")
        logs = newest_logs(run)
        which = f"{len(logs)} in {logs[0].parent}" if logs else ""
        say(f"with its newest logs: {which}" if logs else "it has no logs yet")
    with Progress(REVIEW) as progress:
        page, verdict = write(logs, run, answer, model, column_map, out, force, progress.tell)
    put({"review": str(page), **verdict.json()}, page)
    say_verdict(verdict)
    if show:
        open_page(page)
    if verdict.grade == "bad":
        raise typer.Exit(BAD_ANSWER)


def _told_apart(
    paths: list[Path], run: Path | None, answer: Path | None
) -> tuple[list[Path], Path | None, Path | None]:
    """Logs, run and answer: folders among the arguments are taken for what they hold."""
    from kemba.logs import log_files

    logs: list[Path] = []
    for path in paths:
        if (path / "manifest.json").is_file() and run is None:
            run = path
        elif (path / "answer.json").is_file() and answer is None:
            answer = path
        else:
            logs += log_files([path])
    return logs, run, answer
