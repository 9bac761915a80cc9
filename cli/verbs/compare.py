"""`kemba-opt compare`: where a model fails on logs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kemba_cli.common import Executed, Force, Foreign, Logs, manner, put_json, results, say

if TYPE_CHECKING:
    from kemba.identify.compare.compare import Comparison


SHOWN = 5


def compare(
    logs: Logs,
    model: Annotated[str, typer.Option(help="Model YAML to judge.")] = "planning",
    run: Executed = None,
    figure: Annotated[
        bool | None,
        typer.Option(
            "--figure/--no-figure", help="Draw where the model fails.", show_default="no-figure"
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Figure to write: PNG, PDF or SVG (a new compare.png here).")
    ] = None,
    what_could_be_seen: Annotated[
        bool, typer.Option("--what-could-be-seen", help="Only which effects these logs could show.")
    ] = False,
    column_map: Foreign = None,
    force: Force = False,
) -> None:
    """Say whether a model explains logs to within their noise and, if not, where it fails.

    Example: kemba-opt compare jump_1.csv jump_2.csv --out heat_map.png
    """
    from kemba.folders import place_for
    from kemba.identify.workflow import compare_logs
    from kemba.logs import log_files
    from kemba.model.spec import evidence_faults
    from kemba_cli.next_steps import after_compare, say_next
    from kemba_cli.progress import COMPARE, Progress

    if what_could_be_seen:
        if run or figure or out:
            other = "--run" if run else "--out" if out else "--figure"
            why = f"compares nothing, so that {other} has no use"
            raise typer.BadParameter(why, param_hint="--what-could-be-seen")
        _preview(logs, model, column_map)
        return
    if out is not None and figure is False:
        raise typer.BadParameter("--out names the figure", param_hint="--no-figure")
    path = None
    if figure or out is not None:
        from kemba.plotting.style import FORMATS

        path = place_for(out, Path("compare.png"), force, FORMATS)
    logs = log_files(logs)
    with Progress(COMPARE) as progress:
        found, _ = compare_logs(logs, model, column_map, run, progress.tell)
    if path is not None:
        from kemba.plotting.comparison import plot_comparison
        from kemba.plotting.style import save_figure

        save_figure(plot_comparison(found), path)
        say(f"wrote {path}")
    if put_json({**found.json(), **({"figure": str(path)} if path else {})}):
        return
    typer.echo(found.sentence)
    for text in evidence_faults(model):
        say(text)
    if not manner.get().quiet:
        _print(found)
    say_next(after_compare(logs, column_map, model, run, found.good or found.tolerable))


def _preview(logs: list[Path], model: str, column_map: str | None) -> None:
    """Which effects logs could show, and which standard tests would tell more."""
    from rich.table import Table

    from kemba.identify.preview import preview
    from kemba.logs import log_files
    from kemba_cli.next_steps import discover, say_next
    from kemba_cli.progress import COMPARE, Progress

    logs = log_files(logs)
    with Progress(COMPARE) as progress:
        found = preview(logs, model, column_map, progress.tell)
    if put_json(found.json()):
        return
    typer.echo(found.told.sentence)
    for test in found.tests:
        typer.echo(f"  {test.sentence}")
    if not manner.get().quiet:
        table = Table("effect", "smallest size that shows", "usual size", "unit")
        for effect, size in found.told.sizes.items():
            switch = found.switches[effect]
            shown = "at no size" if size is None else f"{size:.2g}"
            table.add_row(effect, shown, f"{switch.size:.2g}", switch.unit)
        results().print(table)
    say_next(discover(logs, column_map, model))


def _print(found: Comparison) -> None:
    from rich.table import Table

    from kemba.identify.compare.words import effort, off_by, place_of
    from kemba.units import short

    table = Table("channel", "RMS", "largest", "noise", "error / noise")
    for c in found.channels:
        numbers = (f"{x:.3g}" for x in (c.rmse, c.max, c.noise_sigma, c.ratio))
        table.add_row(c.name.replace("[", r"\["), *numbers)
    results().print(table)
    for at in sorted((c for c in found.bins if c.significant), key=lambda c: c.q_value)[:SHOWN]:
        typer.echo(f"  {place_of(at)}: {short(at.ratio)} times the noise")
    for hint in found.hints[:SHOWN]:
        typer.echo(f"  {hint.text}")
    for peak in found.peaks:
        if peak.low * peak.high > 0 and not found.good:
            size = f"{peak.value:+.3g} {peak.unit} ({peak.low:.3g} to {peak.high:.3g})"
            when = f"at {peak.time_s:.3f} s of {peak.run}"
            typer.echo(f"  missing {effort(peak.channel, peak.unit)}: {size} {when}")
    if found.plan:
        parts = (off_by(header, error) for header, error in found.plan.items())
        typer.echo(f"  farthest from the plan: {', '.join(parts)}")
