"""`kemba-opt plot`: figures and animations of plans, simulations and logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Json, Quiet, print_json


def plot(
    runs: Annotated[
        list[Path], typer.Argument(help="Run folders and CSVs; several are drawn over each other.")
    ],
    save: Annotated[
        Path | None, typer.Option(help="PNG, PDF or SVG; beside the first run when omitted.")
    ] = None,
    animate: Annotated[
        Path | None, typer.Option(help="Also write a GIF, or an MP4, of the first run.")
    ] = None,
    show: Annotated[bool, typer.Option("--show", help="Open a window.")] = False,
    model: Annotated[
        str | None, typer.Option(help="Model YAML with the robot and limits, not the run's own.")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Draw body, joints, efforts, valves and contact, and a strip of stick figures.

    Example: kemba-opt plot runs/jump-1
    """
    from kemba import plotting
    from kemba.plotting.window import open_window, show_windows

    sources = plotting.load_sources(runs)
    figure = plotting.draw(sources, model, open_window() if show else None)
    written = {"figure": plotting.save_figure(figure, save or plotting.default_path(sources))}
    if animate:
        machine = plotting.machine_of(sources[0], model)
        written["animation"] = plotting.save_animation(sources[0], machine, animate)
    paths = {kind: str(path) for kind, path in written.items()}
    if json:
        print_json({**paths, "runs": [source.name for source in sources]})
    elif not quiet:
        for path in paths.values():
            typer.echo(path)
    if show:
        show_windows()
