"""`kemba-opt schema`: JSON Schemas for editors."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, print_json, put


def schema(
    kind: Annotated[str, typer.Argument(help="models, robots, ...; all when omitted.")] = "",
    out: Annotated[
        Path | None, typer.Option(help="Write KIND.schema.json files into this folder.")
    ] = None,
    force: Force = False,
) -> None:
    """JSON Schema of the YAML files, so that editors complete and check them.

    Example: kemba-opt schema models
    """
    from kemba.files import write_json
    from kemba.folders import fresh
    from kemba_cli.schemas import SCHEMAS, schema_of

    kinds = [kind] if kind else list(SCHEMAS)
    found = {name: schema_of(name).model_json_schema() for name in kinds}
    if out is None:
        print_json(found[kind] if kind else found)
        return
    paths = {name: fresh(out / f"{name}.schema.json", force) for name in found}
    for name, content in found.items():
        write_json(paths[name], content)
    put(paths, "\n".join(map(str, paths.values())))
