"""`kemba-opt map`: draft a column map for a log of another program."""

from pathlib import Path
from typing import Annotated

import typer

from kemba_cli.common import Force, put, say, warn
from kemba_cli.failures import BAD_ANSWER


def draft_map(
    log: Annotated[Path, typer.Argument(help="Log of another program, any text table or format.")],
    out: Annotated[Path | None, typer.Option(help="Map to write (LOG_map.yaml here).")] = None,
    model: Annotated[str, typer.Option(help="Model YAML: its robot names the legs.")] = "planning",
    force: Force = False,
) -> None:
    """Draft a column map by guessing from names, units and ranges; say what is still missing.

    Example: kemba-opt map their_log.csv --out their_map.yaml
    """
    from kemba.files import atomic_text
    from kemba.folders import YAML, fresh
    from kemba.logs.draft.draft import draft_map as draft
    from kemba.model import load_model
    from kemba_cli.next_steps import after_map, say_next

    out = out or Path(f"{log.stem}_map.yaml")
    fresh(out, force, endings=YAML)
    machine = load_model(model).mechanism
    stroke = None if machine.rig else machine.stroke
    found = draft(log, machine.legs, stroke, machine.rig, machine.logged)
    with atomic_text(out) as stream:
        stream.write(found.text(log.name))
    told = ("kind", "columns", "missing", "ignored", "questions", "notes")
    put({"map": str(out), **{name: getattr(found, name) for name in told}}, out)
    for note in found.notes:
        warn(note)
    for question in found.questions:
        warn(f"open: {question}")
    if found.missing:
        listed = ", ".join(f"'{header}'" for header in found.missing)
        warn(f"not found: {listed}. Add them to {out}; without them the log says too little.")
        left = ", ".join(f"'{name}'" for name in found.ignored[:12])
        warn(f"not used: {left or 'no column is left'}")
    if found.missing or found.questions:
        if found.questions:
            warn(f"answer what is open in {out}: correct its lines, then use it")
        raise typer.Exit(BAD_ANSWER)
    say(f"look through {out}: signs and zeros of angles cannot be guessed")
    say_next(after_map(log, out, model))
