"""`kemba-opt characterise`: chambers, damping and valves of a cylinder from bench logs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kemba_cli.common import Force, Foreign, put_json, results, say

if TYPE_CHECKING:
    from kemba.plant.characterise import Characteristics
    from kemba.trajectory import Trajectory


def characterise(
    logs: Annotated[
        list[Path] | None, typer.Argument(help="Bench logs, or folders of them.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Model YAML to write (else none).")] = None,
    figure: Annotated[
        bool | None,
        typer.Option(
            "--figure/--no-figure",
            help="Draw the paper's figure of each rig.",
            show_default="no-figure",
        ),
    ] = None,
    figures: Annotated[
        Path | None,
        typer.Option(help="Folder for these figures (a new folder figures beside the model)."),
    ] = None,
    model: Annotated[
        str, typer.Option(help="Model YAML whose robot has the cylinder that was tested.")
    ] = "planning",
    column_map: Foreign = None,
    supply: Annotated[
        list[str] | None,
        typer.Option(
            help="Supply of logs that do not tell it, such as '0.6 MPa'; may be repeated."
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Fit air and friction of a cylinder to bench logs, and write them as a model.

    It fits eq. 4 to 7 of the paper, and prints Tables I and II beside the paper's own.

    Example: kemba-opt characterise bench/locked bench/dynamometer --out cylinder.yaml
    """
    if not logs:
        raise typer.BadParameter("logs are missing: give CSV files", param_hint="LOGS")
    from kemba.folders import YAML, fresh
    from kemba.model import load_model

    if load_model(model, rig=True).mechanism.rig:
        if figure or figures or supply:
            what = "figures are drawn, and supplies told, of the paper's rigs only"
            raise typer.BadParameter(what, param_hint="--supply" if supply else "--figure")
        _own_rig(logs, model, out, force, column_map)
        return
    from kemba.identify.logs.gate import BadData, sentence
    from kemba.identify.logs.reading import read_logs
    from kemba.identify.workflow import admitted, check_all, model_of
    from kemba.logs import log_files
    from kemba.plant.characterise import characterise as fit
    from kemba.plant.published import as_json
    from kemba.quantity import to_si
    from kemba_cli.next_steps import after_model, say_next

    if out:
        fresh(out, force, endings=YAML)
    folder = _folder(figure, figures, out)
    every = read_logs(log_files(logs), column_map)
    built, doubts = model_of(every, model), ()
    check_all(every, built)
    try:
        admitted(every, built)
    except BadData as error:  # of a cylinder that need not be as the model has it
        doubts = (f"if this is the cylinder of {model}: {sentence(error.errors)}",)
    read = {str(log.meta["path"]): log for log in every}
    try:
        supplies = [to_si(value, "Pa") for value in supply or []]
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--supply") from None
    found = fit(read, built.mechanism.need_cylinder(), supplies)
    found = replace(found, remarks=(*doubts, *found.remarks))
    if out:
        found.write_model(out, out.stem)
    drawn = _draw(found, read, folder, model) if folder else []
    facts = {"logs": len(read), **as_json(found), "model": out and str(out), "figures": drawn}
    if put_json(facts):
        return
    _print(found)
    for remark in found.remarks:
        say(remark, always=True)
    for path in drawn:
        say(f"wrote {path}")
    say(f"wrote {out}" if out else "write a model with --out MODEL.yaml")
    say_next(after_model(out) if out else "")


def _folder(figure: bool | None, figures: Path | None, model: Path | None) -> Path | None:
    """Where the figures go; None for none. Raises BadParameter for a place that is not used."""
    from kemba.folders import next_free

    if figure is False and figures is not None:
        raise typer.BadParameter("--figures names their folder", param_hint="--no-figure")
    if not figure and figures is None:
        return None
    return figures or next_free((model.parent if model else Path()) / "figures")


def _own_rig(
    logs: list[Path],
    model: str,
    out: Path | None,
    force: bool,
    column_map: Path | None,
) -> None:
    """The figures of a rig of the user's own, and of the effects that its model lists."""
    from rich.table import Table

    from kemba.folders import YAML, fresh
    from kemba.identify.adopt import reference
    from kemba.identify.rigs.characterise import characterise_logs
    from kemba_cli.next_steps import after_model, say_next

    if out:
        fresh(out, force, endings=YAML)
    found = characterise_logs(logs, model, column_map)
    if out:
        found.write_model(out, reference(model))
    if put_json({"logs": len(logs), **found.json(), "model": out and str(out)}):
        return
    table = Table("figure", "given", "fitted", "95 %", "unit", box=None)
    for f in found.figures:
        interval = f"{f.low:.4g} to {f.high:.4g}"
        table.add_row(f.name, f"{f.given:.4g}", f"{f.value:.4g}", interval, f.unit)
    results().print(table)
    error = f"{found.error_before:.3g} to {found.error_after:.3g} times the noise of the sensors"
    typer.echo(f"The error falls from {error}. Intervals are those of one mounting.")
    for name in found.apart:
        say(f"{name} differs between runs; its interval spans them")
    say(f"wrote {out}" if out else "write a model with --out MODEL.yaml")
    say_next(after_model(out, True, logs, column_map) if out else "")


def _draw(
    found: Characteristics, logs: dict[str, Trajectory], folder: Path, model: str
) -> list[str]:
    """The figure of each rig among the logs; what was fitted predicts random motion."""
    from kemba.plotting import plot_rig
    from kemba.plotting.style import save_figure

    rigs: dict[str, dict[str, Trajectory]] = {}
    for name, log in logs.items():
        rig = str(log.meta.get("rig") or Path(name).resolve().parent.name)
        rigs.setdefault(rig, {})[Path(name).stem] = log
    return [
        str(save_figure(plot_rig(own, model, found.effects()), folder / f"{rig}.png"))
        for rig, own in rigs.items()
    ]


def _print(found: Characteristics) -> None:
    """Tables I and II beside the paper's, with 95 % intervals, and how well eq. 4 to 7 predict."""
    from rich.table import Table

    from kemba.plant.published import as_json

    for title, columns, rows in tables(as_json(found)):
        if rows:
            table = Table(title=title, title_justify="left", box=None)
            for number, column in enumerate(columns):
                table.add_column(column, justify="right" if number else "left")
            for row in rows:
                table.add_row(*row)
            results().print(table)


def tables(told: dict[str, Any]) -> list[tuple[str, list[str], list[list[str]]]]:
    """What was found as text: title, columns and rows of each table."""

    def cell(value: float | None, scale: float = 1.0, digits: int = 0) -> str:
        return "" if value is None else f"{round(scale * value, digits) + 0.0:.{digits}f}"

    def found(one: dict[str, Any], scale: float, digits: int) -> list[str]:
        """A value, half its interval where there are data for one, the paper's value."""
        half = 0.5 * (one["high"] - one["low"]) if one["low"] == one["low"] else None
        values = cell(one["value"], scale, digits), cell(half, scale, max(digits, 1))
        return [*values, cell(one["paper"], scale)]

    dead = told["dead_time"].items()
    rises = [[r["chamber"], cell(r["x_m"], 1e3), *found(r, 1e3, 1)] for r in told["table_1"]]
    rises += [[f"dead time {name}", "", *found(one, 1e3, 2)] for name, one in dead]
    forces = [
        [line["mode"], cell(line["supply_pa"], 1e-6, 1), *found(line["F_static"], 1.0, 0),
         *found(line["c_d"], 1.0, 0), cell(line["r2"], 1.0, 3)]
        for line in told["table_2"]
    ]  # fmt: skip
    checks = [
        [name, cell(one["r2"], 1.0, 4), cell(one["rms_n"], 1.0, 1)]
        for name, one in told["check"].items()
    ]
    of = ["+-95 %", "paper"]
    line = ["mode", "supply MPa", "F_static N", *of, "c_d N s/m", *of, "R2"]
    return [
        ("Chamber force rise time", ["chamber", "x mm", "rise time ms", *of], rises),
        ("Steady state: F = F_static - c_d v", line, forces),
        ("Fitted model against logs", ["log", "R2", "RMS N"], checks),
    ]
