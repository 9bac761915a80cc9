"""`kemba-opt export`: trajectories in other formats, and programs for other solvers."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, put, say


def export(
    run: Annotated[Path, typer.Argument(help="Run folder (its plan), any log; --nlp: or a task.")],
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write: .csv, .parquet, .mcap, .mat, .npz or .json. --nlp: a folder (nlp)."
        ),
    ] = None,
    column_map: Annotated[
        str | None,
        typer.Option("--map", help="Column map YAML of the program that is to read the .csv."),
    ] = None,
    source_map: Annotated[
        str | None,
        typer.Option("--source-map", help="Column map YAML of the program that wrote the log."),
    ] = None,
    nlp: Annotated[
        bool, typer.Option("--nlp", help="Write the optimisation programs as CasADi functions.")
    ] = False,
    force: Force = False,
) -> None:
    """Write a plan or a log in another format: PlotJuggler, Foxglove, MATLAB, pandas, own columns.

    Example: kemba-opt export runs/jump-1 --out jump.mat
    """
    from kemba.folders import fresh

    if nlp:
        import casadi

        from kemba.report.programs import export_nlp

        if column_map is not None or source_map is not None:
            raise typer.BadParameter("a map goes with logs and plans", param_hint="--map")
        paths = export_nlp(run, out or Path("nlp"), force)
        names = [str(path) for path in paths]
        put({"export": names}, "\n".join(names))
        version = casadi.CasadiMeta.version()
        say(f"the functions are of CasADi {version}; older ones do not read them")
        return
    if out is None:
        raise typer.BadParameter("a file was expected, such as jump.mat", param_hint="--out")
    from kemba.plotting.source import load_source
    from kemba.report.export import export as write

    source = load_source(run, source_map)
    fresh(out, force)
    path = write(source.trajectory, out, column_map)
    put({"export": str(path)}, path)
