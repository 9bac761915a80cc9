"""`kemba-opt view`: a motion in 3-D."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, Foreign, Show, newest, open_page, put


def view(
    motion: Annotated[
        Path | None, typer.Argument(help="Run folder, or the log of a motion (the newest run).")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="HTML to write (a new view.html beside it).")
    ] = None,
    model: Annotated[
        str | None, typer.Option(help="Model YAML with the robot, not the run's own.")
    ] = None,
    run: Annotated[
        Path | None, typer.Option(help="Run folder whose plan is drawn as a ghost.")
    ] = None,
    rerun: Annotated[
        Path | None, typer.Option(help="Recording (.rrd) for the Rerun viewer to write instead.")
    ] = None,
    column_map: Foreign = None,
    show: Show = False,
    force: Force = False,
) -> None:
    """Write a motion in 3-D as a self-contained HTML page, to turn, zoom and play, or for Rerun.

    Example: kemba-opt view runs/jump-1 --show
    """
    from kemba.report.view import record_run, view_run

    shown, how = motion or newest(), (model, force, column_map, run)
    path = view_run(shown, out, *how) if rerun is None else record_run(shown, rerun, *how)
    put({"view": str(path)}, path)
    if show and rerun is None:
        open_page(path)
