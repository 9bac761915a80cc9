"""`kemba-opt check`: validate YAML files and logs."""

from pathlib import Path
from typing import Annotated, Any

import typer

from kemba_cli.common import Foreign, put_json
from kemba_cli.failures import BAD_INPUT


def check(
    files: Annotated[list[Path], typer.Argument(help="YAML files and logs.")],
    column_map: Foreign = None,
    model: Annotated[
        str, typer.Option(help="Model YAML of the machine that the logs are from.")
    ] = "planning",
) -> None:
    """Validate any YAML or log, with all mistakes at once.

    A log must pass the checks of compare and discover. CSVs that are no logs (plans in run
    folders, tables of other quantities) are checked as tables.

    Example: kemba-opt check planning.yaml
    """
    from kemba.errors import KembaError
    from kemba.logs import is_log_file
    from kemba_cli.next_steps import after_check, say_next

    answers = []
    for file in files:
        try:
            answer = _log(file, column_map, model) if is_log_file(file) else _yaml(file)
            answers.append({"file": str(file), "good": True, **answer})
        except KembaError as error:
            answers.append({"file": str(file), "good": False, "sentence": str(error)})
    _tell(answers)
    if not all(answer["good"] for answer in answers):
        raise typer.Exit(BAD_INPUT)
    say_next(after_check(answers, column_map, model))


def _tell(answers: list[dict[str, Any]]) -> None:
    json = put_json({"files": answers})
    for answer in answers:
        if not answer["good"]:
            typer.echo(answer["sentence"], err=True)
        elif not json:
            typer.echo(f"{answer['file']}: {answer['sentence']}")


def _log(file: Path, column_map: str | None, model: str) -> dict[str, Any]:
    """A log is put through the gate of compare and discover; any other file is a table."""
    from kemba.identify.workflow import check_log
    from kemba.logs import open_log

    kind, remarks = "table", list[str]()
    if column_map or _is_measured(file):
        log, remarks = check_log(file, model, column_map)
        kind = f"log of a {log.meta['kind']}"
    else:
        log = open_log(file)
    size = f"{len(log)} rows, {len(log.names)} columns, {log.time[-1] - log.time[0]:.3g} s"
    sentence = "; ".join([f"valid {kind}: {size}", *remarks])
    facts = {"rows": len(log), "columns": log.headers, "remarks": remarks}
    return {"kind": kind.split()[0], **facts, "sentence": sentence}


def _is_measured(file: Path) -> bool:
    """Whether a table is a log: it has a log's columns or says so, and is no run's plan."""
    from kemba.identify.logs.reading import is_log
    from kemba.logs import open_log
    from kemba.runs import MANIFEST

    planned = (file.parent / MANIFEST).is_file()
    return not planned and is_log(open_log(file, strict=False))


def _yaml(file: Path) -> dict[str, Any]:
    from kemba.config import find_config, load_yaml, parse
    from kemba.errors import ConfigErrors, KembaError, listed_errors
    from kemba.ocp.reading import read_task
    from kemba_cli.schemas import SCHEMAS, called, kind_of, schema_of, strays

    document = load_yaml(find_config(file, *SCHEMAS))
    kind = kind_of(document)
    try:
        parsed = read_task(document) if kind == "tasks" else parse(document, schema_of(kind))
    except KembaError as error:
        raise ConfigErrors([*listed_errors(error), *strays(document, kind)]) from None
    remarks = _whole(kind, parsed, document)
    sentence = "; ".join([f"valid {called(kind)}", *remarks])
    return {"kind": kind, "sentence": sentence, "remarks": remarks}


def _whole(kind: str, parsed: Any, document: Any) -> list[str]:
    """What a file names must exist too: robots, cylinders, legs, quantities, costs, options."""
    from kemba.logs.columns import check_map
    from kemba.mechanism import load_cylinder, load_robot
    from kemba.model import load_model
    from kemba.ocp.planning import check_feasible

    if kind == "tasks":
        model, _ = check_feasible(parsed, document)
        return [*parsed.remarks, *model.remarks]
    if kind == "models":
        return load_model(document.source).remarks
    if kind == "robots":
        load_robot(document.source)
    if kind == "maps":
        check_map(parsed, document.source)
    if kind == "cylinders":
        load_cylinder(document.source)
    return []
