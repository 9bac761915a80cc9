"""`kemba-opt experiment`: the next test that separates the rivals of an answer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, Json, OwnEffects, Quiet, print_json, say


def experiment(
    answer: Annotated[Path, typer.Argument(help="Folder written by discover.")],
    out: Annotated[Path | None, typer.Option(help="Rig YAML to write.")] = None,
    force: Force = False,
    own_effects: OwnEffects = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write the rig test that best separates the rivals of an answer.

    Example: kemba-opt experiment answer --out next.yaml
    """
    from kemba.folders import fresh
    from kemba.identify.experiment import propose

    path = fresh(out or answer / "experiment.yaml", force)
    found = propose(answer, path)
    if json:
        facts = {"nats": found.nats, "rivals": found.rivals, "sentence": found.sentence}
        print_json({"experiment": str(path), "rig": found.rig.name, **facts})
        return
    typer.echo(path)
    say(found.sentence, quiet)
