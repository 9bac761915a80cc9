"""`kemba-opt`: the verbs.

Verb modules import typer only; numpy, casadi and the like belong inside their functions, so that
`--help` answers at once.
"""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

import kemba
from kemba_cli.failures import guarded
from kemba_cli.verbs.adopt import adopt
from kemba_cli.verbs.characterise import characterise
from kemba_cli.verbs.check import check
from kemba_cli.verbs.compare import compare
from kemba_cli.verbs.discover import discover
from kemba_cli.verbs.effects import effects
from kemba_cli.verbs.experiment import experiment
from kemba_cli.verbs.export import export
from kemba_cli.verbs.plot import plot
from kemba_cli.verbs.report import report
from kemba_cli.verbs.schema import schema
from kemba_cli.verbs.simulate import simulate
from kemba_cli.verbs.solve import solve
from kemba_cli.verbs.sweep import sweep
from kemba_cli.verbs.view import view

VERBS = (
    solve,
    sweep,
    simulate,
    characterise,
    compare,
    discover,
    adopt,
    experiment,
    check,
    effects,
    plot,
    view,
    report,
    export,
    schema,
)

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for verb in VERBS:
    app.command()(guarded(verb))


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"kemba {kemba.__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Plan, execute and explain jumps of a legged robot with pneumatic knees."""


def main() -> None:
    """Run `kemba-opt`. Exit code 0 good, 1 bad answer, 2 wrong usage or input, 130 interrupted."""
    try:
        app(prog_name="kemba-opt")
    finally:
        _flush()


def _flush() -> None:
    """Write out what is left, so that a full disk is told and not only a strange exit code."""
    try:
        sys.stdout.flush()
    except OSError as error:
        typer.echo(f"the output cannot be written: {error.strerror}", err=True)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nothing more to fail
        sys.exit(1)
