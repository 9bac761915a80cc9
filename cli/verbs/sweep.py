"""`kemba-opt sweep`: many tasks or executions on Dask, resumable."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from kemba_cli.common import put, say


def sweep(
    file: Annotated[str, typer.Argument(metavar="sweep", help="Sweep YAML, here or shipped.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder to write or to continue (sweeps/NAME).")
    ] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", help="Override a key: --set seed=2.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="<address>", help="A Dask scheduler instead of our own.")
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes of our own (as many as cores).")
    ] = None,
    time_limit: Annotated[
        float | None, typer.Option(min=0.1, help="Seconds after which to stop.")
    ] = None,
    figure: Annotated[bool, typer.Option(help="Draw the executions of every block.")] = True,
) -> None:
    """Run many cases and show how many succeeded; the same command continues what was stopped.

    Exit code 1 when a block succeeded less often than it `expect`s, or cases have no answer.

    Example: kemba-opt sweep reliability.yaml --jobs 2
    """
    due = None if time_limit is None else time.monotonic() + time_limit
    from kemba import sweep as room
    from kemba.folders import held
    from kemba_cli.next_steps import after_sweep, say_next

    if scheduler is not None:
        room.check_scheduler(scheduler)
    asked, document = room.load_sweep(file, list(overrides or []))
    with held(out or Path("sweeps") / asked.name) as folder:
        room.open_folder(folder, asked, document)
        status, good = _run(folder, asked, document, scheduler, jobs, due, figure)
    say_next(after_sweep(file, folder, status == "finished"))
    if not good:
        raise typer.Exit(1)


def _run(
    folder: Path,
    asked: Any,
    document: Any,
    scheduler: str | None,
    jobs: int | None,
    due: float | None,
    figure: bool,
) -> tuple[str, bool]:
    """Do what is missing, write and print the results; the status, and whether all is well."""
    from kemba import sweep as room
    from kemba.stopwatch import Stage
    from kemba_cli.progress import SWEEP, Progress

    say(f"results in {folder}")
    cases = room.expand(asked, document, folder)
    every = {case.key for case in cases}
    missing = {case.key for case in cases if case.record(folder) is None}
    if len(missing) < len(every):
        say(f"{len(every) - len(missing)} of {len(every)} cases are done already")
    waiting = iter(range(1, len(missing) + 1))
    status, records = "interrupted", {}

    def begun() -> None:
        if number := next(waiting, 0):
            progress.tell(Stage("case", number, len(missing)))

    def ended(case: Any, record: dict[str, Any]) -> None:
        if not record["good"]:
            progress.remark(f"{case.block} {case.index}: {record['sentence']}")
        begun()

    try:
        with Progress(SWEEP) as progress:
            begun()
            left = None if due is None else max(0.1, due - time.monotonic())
            records = room.run_cases(cases, folder, scheduler, jobs, left, ended)
        done = all(case.key in records for case in cases)
        status = "finished" if done else "limit"
    finally:
        known = records or {c.key: r for c in cases if (r := c.record(folder)) is not None}
        summary = room.write_results(folder, asked, cases, known, status)
    if figure:
        _figures(folder, cases, known, summary)
    _answer(folder, status, summary)
    return status, status == "finished" and bool(summary["good"])


def _answer(folder: Path, status: str, summary: dict[str, Any]) -> None:
    from kemba.sweep.results import sentence

    told = [f"{name}: {sentence(block)}" for name, block in summary["blocks"].items()]
    put({"folder": folder, "status": status, **summary}, "\n".join([str(folder), *told]))


def _figures(folder: Path, cases: Any, records: Any, summary: dict[str, Any]) -> None:
    """A picture of every block of executions."""
    for name, block in summary["blocks"].items():
        found = [records.get(case.key) or {} for case in cases if case.block == name]
        flown = [record for record in found if "apex_m" in record]
        if block["kind"] != "execute" or not flown:
            continue
        import numpy as np

        from kemba.plotting.studies import plot_robustness
        from kemba.plotting.style import save_figure

        ranks = {
            key: {answer: told and told["correlation"] for answer, told in pair.items()}
            for key, pair in block["ranks"].items()
        }
        apex, landed = (np.array([r[key] for r in flown]) for key in ("apex_m", "good"))
        planned = flown[0]["apex_m"] - flown[0]["apex_error_m"]
        save_figure(plot_robustness(apex, landed, ranks, planned), folder / f"{name}.png")
