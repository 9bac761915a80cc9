"""`kemba-opt check`: validate YAML files and logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from kemba_cli.common import Json, OwnEffects, Quiet, print_json
from kemba_cli.failures import BAD_INPUT


def check(
    files: Annotated[list[Path], typer.Argument(help="YAML files, and logs as CSV.")],
    column_map: Annotated[
        str | None, typer.Option("--map", help="Column map YAML for foreign logs.")
    ] = None,
    own_effects: OwnEffects = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Validate any YAML or log, with all mistakes at once.

    Example: kemba-opt check planning.yaml
    """
    from kemba.errors import KembaError
    from kemba.logs import ENDINGS

    answers = []
    for file in files:
        try:
            answer = _log(file, column_map) if file.suffix in ENDINGS else _yaml(file)
            answers.append({"file": str(file), "good": True, **answer})
        except KembaError as error:
            answers.append({"file": str(file), "good": False, "sentence": str(error)})
    _tell(answers, json, quiet)
    if not all(answer["good"] for answer in answers):
        raise typer.Exit(BAD_INPUT)


def _tell(answers: list[dict[str, Any]], json: bool, quiet: bool) -> None:
    if json:
        print_json({"files": answers})
    for answer in answers:
        if not answer["good"]:
            typer.echo(answer["sentence"], err=True)
        elif not json and not quiet:
            typer.echo(f"{answer['file']}: {answer['sentence']}")


def _log(file: Path, column_map: str | None) -> dict[str, Any]:
    from kemba.logs import load_map, open_log

    log = open_log(file, load_map(column_map) if column_map else None)
    seconds = f"{log.time[-1] - log.time[0]:.3g} s"
    sentence = f"valid table: {len(log)} rows, {len(log.names)} columns, {seconds}"
    return {"kind": "table", "rows": len(log), "columns": log.headers, "sentence": sentence}


def _yaml(file: Path) -> dict[str, Any]:
    from kemba.config import load_yaml, locate, parse
    from kemba_cli.schemas import SCHEMAS, kind_of, schema_of

    document = load_yaml(locate(file, SCHEMAS))
    kind = kind_of(document)
    parsed = parse(document, schema_of(kind))
    remarks = _whole(kind, parsed, document)
    sentence = "; ".join([f"valid {kind.removesuffix('s')} file", *remarks])
    return {"kind": kind, "sentence": sentence, "remarks": remarks}


def _whole(kind: str, parsed: Any, document: Any) -> list[str]:
    """What a file names must exist too: robots, cylinders, legs, quantities, costs, options."""
    from kemba.logs.columns import check_map
    from kemba.mechanism import load_cylinder, load_robot
    from kemba.model import load_model
    from kemba.ocp.planning import check_feasible
    from kemba.ocp.task.task import parse_task

    if kind == "tasks":
        model, _ = check_feasible(parse_task(document), document)
        return model.remarks
    if kind == "models":
        return load_model(document.source).remarks
    if kind == "robots":
        load_robot(document.source)
    if kind == "maps":
        check_map(parsed, document.source)
    if kind == "cylinders":
        load_cylinder(document.source)
    return []
