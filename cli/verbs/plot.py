"""`kemba-opt plot`: figures and animations of plans, simulations and logs."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, Foreign, newest, put


def plot(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Run folders and CSVs, several over each other; one folder of bench logs "
            "(the newest run)."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "--save", help="PNG, PDF or SVG to write (a new one beside the first run)."
        ),
    ] = None,
    animate: Annotated[
        Path | None, typer.Option(help="Also write a GIF, or an MP4, of the first run.")
    ] = None,
    show: Annotated[bool, typer.Option("--show", help="Open a window.")] = False,
    model: Annotated[
        str | None, typer.Option(help="Model YAML with the robot and limits, not the run's own.")
    ] = None,
    column_map: Foreign = None,
    force: Force = False,
) -> None:
    """Draw body, joints, efforts, valves and contact, and a strip of stick figures.

    A folder of bench logs is drawn as the paper draws its rig (Fig. 3, 4, 6 and 7).

    Example: kemba-opt plot runs/jump-1
    """
    from kemba.folders import fresh, next_free
    from kemba.plotting import bench_logs, draw, load_sources, plot_rig
    from kemba.plotting.source import MOVIES, default_path, machine_of
    from kemba.plotting.style import FORMATS, open_window, save_figure, show_windows
    from kemba_cli.next_steps import after_plot, say_next

    for path, option, endings in ((out, "--out", FORMATS), (animate, "--animate", MOVIES)):
        if path is not None:
            fresh(path, force, option, endings)
    runs = runs or [newest()]
    window = open_window() if show else None
    logs = bench_logs(runs[0]) if len(runs) == 1 else {}
    if logs and animate:
        raise typer.BadParameter("bench logs have no motion to animate", param_hint="--animate")
    if logs:
        figure = plot_rig(logs, model or "planning", figure=window)
        names, beside = list(logs), runs[0] / "figure.png"
    else:
        sources = load_sources(runs, column_map)
        figure = draw(sources, model, window)
        names, beside = [source.name for source in sources], default_path(sources)
    path = out or (beside if force else next_free(beside))
    written = {"figure": save_figure(figure, path)}
    if animate:
        from kemba.plotting.sticks import save_animation

        machine = machine_of(sources[0], model)
        written["animation"] = save_animation(sources[0], machine, animate)
    paths = {kind: str(path) for kind, path in written.items()}
    put({**paths, "runs": names}, "\n".join(paths.values()))
    say_next(after_plot(runs))
    if show:
        show_windows()
