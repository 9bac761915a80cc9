"""`kemba-opt adopt`: a model with another effect of a ranking than the winner."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, Json, OwnEffects, Quiet, print_json


def adopt(
    answer: Annotated[Path, typer.Argument(help="Folder written by discover.")],
    effect: Annotated[str, typer.Argument(help="Effect of its ranking, such as seal_friction.")],
    out: Annotated[
        Path | None, typer.Option(help="Model YAML to write (model_EFFECT.yaml in the answer).")
    ] = None,
    force: Force = False,
    own_effects: OwnEffects = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a model YAML with the chosen effect of an answer added.

    Example: kemba-opt adopt answer pressure_friction --out model.yaml
    """
    from kemba.folders import fresh
    from kemba.identify.adopt import adopt_effect
    from kemba.model import load_model
    from kemba_cli.next_steps import after_model, say_next

    path = out or answer / f"model_{effect.replace(':', '_').replace('/', '_')}.yaml"
    fresh(path, force)
    adopt_effect(answer, effect, path)
    print_json({"model": str(path), "added": effect}) if json else typer.echo(path)
    rig = bool(load_model(path, rig=True).mechanism.rig)
    say_next(after_model(path, rig), quiet or json)
