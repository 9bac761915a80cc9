"""`kemba-opt discover`: which effect is missing, how large, how sure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kemba_cli.common import Force, Foreign, HeldOut, Logs, put_json, say
from kemba_cli.failures import BAD_ANSWER

if TYPE_CHECKING:
    from kemba.identify.answer import Answer


# what an answer consists of, also what adopt and experiment add
WRITTEN = ("answer.json", "model.yaml", "model_*.yaml", "experiment.yaml", "*.png")


def discover(
    logs: Logs,
    holdout: HeldOut = None,
    model: Annotated[str, typer.Option(help="Model YAML that may lack an effect.")] = "planning",
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for answer.json, model.yaml, figures (answer, answer-2, ...)."),
    ] = None,
    column_map: Foreign = None,
    time_limit: Annotated[float, typer.Option(min=5.0, help="Seconds at most.")] = 300.0,
    figure: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    force: Force = False,
) -> None:
    """Find the physical effect that a model lacks, from logs of a robot or of a bench rig.

    Example: kemba-opt discover bench_1.csv bench_2.csv --holdout bench_3.csv
    """
    from kemba.folders import claimed
    from kemba.identify.workflow import discover_logs, write_answer
    from kemba.logs import log_files
    from kemba_cli.next_steps import after_discover, say_next
    from kemba_cli.progress import DISCOVER, Progress

    logs, holdout = log_files(logs), log_files(holdout or [])
    with claimed(out, "answer", "answer.json", force) as folder:
        with Progress(DISCOVER, time_limit) as progress:
            answer, found = discover_logs(
                logs, holdout, model, column_map, time_limit, progress.tell
            )
        try:
            for old in (file for name in WRITTEN for file in folder.glob(name)):
                old.unlink()
            write_answer(answer, folder, model)
            if figure and found is not None:
                from kemba.plotting.studies import draw_discovery

                draw_discovery(found, folder)
        finally:  # also when the disk is full: it took minutes
            _tell(answer, folder)
            say_next(after_discover(logs, column_map, model, folder))
    if answer.verdict == "bad-data":
        raise typer.Exit(BAD_ANSWER)


def _tell(answer: Answer, out: Path) -> None:
    if put_json(answer.json()):
        return
    typer.echo(answer.sentence)
    if answer.ranking:
        typer.echo("  How likely each effect is among the missing ones (need not add up to 100 %):")
    for ranked in answer.ranking[:5]:
        values = ", ".join(f"{name} = {value}" for name, value in ranked.parameters.items())
        typer.echo(f"  {100 * ranked.probability:5.1f} %  {ranked.effect:28s} {values}")
    for remark in answer.remarks:
        say(remark)
    say(f"{out}")
