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
    """Design the test that best separates the rivals of an answer, and write it as a rig YAML.

    Example: kemba-opt experiment answer --out next.yaml
    """
    from kemba.folders import fresh
    from kemba.identify.experiment import propose
    from kemba_cli.progress import Progress

    path = fresh(out or answer / "experiment.yaml", force)
    with Progress(quiet or json) as progress:
        found = propose(answer, path, progress.tell)
    following = f"kemba-opt simulate {path} --noise"
    if json:
        print_json({"experiment": str(path), **found.json(), "next": following})
        return
    typer.echo(path)
    say(found.sentence, quiet)
    say(f"rehearse it on the simulated plant, then run it on the rig: {following}", quiet)
