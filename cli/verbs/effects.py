"""`kemba-opt effects`: the catalogue of physics."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kemba_cli.common import manner, put, put_json, results
from kemba_cli.failures import BAD_ANSWER

if TYPE_CHECKING:
    from rich.table import Table


def effects(
    name: Annotated[str, typer.Argument(help="One effect; the whole catalogue if omitted.")] = "",
    test: Annotated[
        Path | None,
        typer.Option("--test", help="Python file: run the checks that every effect must pass."),
    ] = None,
    markdown: Annotated[
        bool, typer.Option("--markdown", help="The catalogue as a page of the documentation.")
    ] = False,
) -> None:
    """Show the catalogue: equation, parameters with unit and size, source.

    With --test, run the checks that every effect must pass on a file of your own; exit code 1
    when one fails.

    Example: kemba-opt effects seal_friction
    """
    from kemba.effects.describe import chapters, describe, find_effect, page

    if test is not None:
        _test(test)
        return

    if name:
        found = describe(find_effect(name))
        put(found, _detail(found))
    elif markdown:
        typer.echo(page(), nl=False)
    elif not put_json({"effects": [describe(e) for c in chapters().values() for e in c]}):
        for chapter, group in chapters().items():
            results().print(_table(chapter, [describe(effect) for effect in group]))


def _test(file: Path) -> None:
    """The checks of every effect in a file, one line each."""
    from kemba.contract import examine
    from kemba.effects import BY_KIND

    how, results = manner.get(), []
    for effect in BY_KIND.load_file(file):
        for result in examine(effect):
            results.append(result)
            if not how.json and not (how.quiet and result.good):
                told = "good" if result.good else f"FAILED: {result.sentence}"
                typer.echo(f"{result.effect}: {result.check.name}: {told}")
    failed = [result for result in results if not result.good]
    rows = [
        {"effect": r.effect, "check": r.check.name, "good": r.good, "sentence": r.sentence}
        for r in results
    ]
    if not put_json({"good": not failed, "checks": rows}) and not failed:
        typer.echo(f"{file}: good: {len(results)} checks")
    if failed:
        raise typer.Exit(BAD_ANSWER)


def _table(title: str, rows: list[dict[str, Any]]) -> Table:
    from rich.markup import escape
    from rich.table import Table

    from kemba.effects.describe import in_words

    table = Table(title=title, title_justify="left", expand=False)
    for column in ("name", "equation", "parameters (unit) size", "source"):
        table.add_column(column, no_wrap=column == "name", overflow="fold")
    for row in rows:
        parameters = "\n".join(in_words(p) for p in row["parameters"])
        table.add_row(*map(escape, (row["name"], row["equation"], parameters, row["source"])))
    return table


def _detail(found: dict[str, Any]) -> str:
    from kemba.effects.describe import in_words

    ports = ", ".join(found["ports"]) or found["place"]
    lines = [
        f"{found['name']} ({found['family']}, on {ports})",
        "",
        found["description"],
        "",
        f"equation    {found['equation']}",
        *(f"parameter   {in_words(p)}: {p['doc']}" for p in found["parameters"]),
        *(
            f"table       {t['name']} ({t['unit']}) = {t['default']}: {t['doc']}"
            for t in found["tables"]
        ),
        f"source      {found['source']}",
    ]
    if found["replaces"]:
        lines.append(f"replaces    {', '.join(found['replaces'])}")
    return "\n".join(lines)
