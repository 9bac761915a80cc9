"""`kemba-opt sensitivity`: what 10 kPa or 100 g do to a plan."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, Written, newest, put, warn


def sensitivity(
    run: Written = None,
    out: Annotated[
        Path | None, typer.Option(help="CSV to write (a new sensitivity.csv in RUN).")
    ] = None,
    only: Annotated[
        list[str] | None, typer.Option(help="A figure such as supply or contact.mu; else all.")
    ] = None,
    force: Force = False,
) -> None:
    """Write as CSV what small changes of height, supply, payload and every effect's numbers do.

    Columns `commands/...`: the same commands on the changed machine. Columns `replanned/...`: the
    plan made anew, its phases kept.

    Example: kemba-opt sensitivity runs/jump-1
    """
    from kemba.folders import place_for
    from kemba.sensitivity import write_sensitivity
    from kemba.sensitivity.table import sensitivity_of_run
    from kemba_cli.progress import SENSITIVITY, Progress

    run = run or newest("certificate.json")
    path = place_for(out, run / "sensitivity.csv", force)
    with Progress(SENSITIVITY) as progress:
        found = sensitivity_of_run(run, progress.tell, only or ())
    write_sensitivity(found, path)
    if found.unsolved:
        warn(f"no columns replanned/...: {found.unsolved}")
    put({"sensitivity": str(path)}, path)
