"""`kemba-opt adopt`: the model of what an answer found, or of another effect of its ranking."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, put
from kemba_cli.failures import BAD_ANSWER


def adopt(
    answer: Annotated[Path, typer.Argument(help="Folder written by discover.")],
    effect: Annotated[
        str | None,
        typer.Argument(help="Effect of its ranking, such as seal_friction (all that was found)."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Model YAML to write (model_EFFECT.yaml in the answer).")
    ] = None,
    only_sure: Annotated[
        bool, typer.Option("--only-sure", help="Without effects that are only likely.")
    ] = False,
    force: Force = False,
) -> None:
    """Write a model YAML with what an answer found, or with a chosen effect of its ranking.

    Without an effect: all that was found, at its joint estimate, as answer/model.yaml has it. Exit
    code 1 where nothing was found, or with --only-sure where nothing is sure.

    Example: kemba-opt adopt answer --out model.yaml
    """
    from kemba.folders import YAML, fresh
    from kemba.identify.adopt import adopt_answer, adopt_effect, adopted
    from kemba.model import load_model
    from kemba_cli.next_steps import after_model, say_next

    if effect and only_sure:
        raise typer.BadParameter("an effect is adopted whatever is sure", param_hint="--only-sure")
    word = effect or ("sure" if only_sure else "all")
    path = out or answer / f"model_{word.replace(':', '_').replace('/', '_')}.yaml"
    if effect is None and (nothing := adopted(answer, only_sure)):
        typer.echo(nothing, err=True)
        raise typer.Exit(BAD_ANSWER)
    fresh(path, force, endings=YAML)
    added = adopt_answer(answer, path, only_sure) if effect is None else effect
    if effect is not None:
        adopt_effect(answer, effect, path)
    put({"model": str(path), "added": added}, path)
    rig = bool(load_model(path, rig=True).mechanism.rig)
    say_next(after_model(path, rig))
