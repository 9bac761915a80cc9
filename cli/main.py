"""`kemba-opt`: the verbs.

Verb modules import typer only; numpy, casadi and the like belong inside their functions, so that
`--help` answers at once.
"""

import gc
import os
import sys
from typing import Annotated

import typer

import kemba
from kemba_cli.common import usual
from kemba_cli.failures import guarded
from kemba_cli.usage import Command, Comparing
from kemba_cli.verbs.adopt import adopt
from kemba_cli.verbs.characterise import characterise
from kemba_cli.verbs.check import check
from kemba_cli.verbs.compare import compare
from kemba_cli.verbs.discover import discover
from kemba_cli.verbs.effects import effects
from kemba_cli.verbs.experiment import experiment
from kemba_cli.verbs.export import export
from kemba_cli.verbs.learn import learn
from kemba_cli.verbs.map import draft_map
from kemba_cli.verbs.plot import plot
from kemba_cli.verbs.report import report
from kemba_cli.verbs.review import review
from kemba_cli.verbs.schema import schema
from kemba_cli.verbs.sensitivity import sensitivity
from kemba_cli.verbs.simulate import simulate
from kemba_cli.verbs.solve import solve
from kemba_cli.verbs.sweep import sweep
from kemba_cli.verbs.view import view

PANELS = {  # as --help groups them
    "Plan": (solve, sensitivity, sweep),
    "Execute and look": (simulate, review, plot, report, view, export),
    "Logs: what is missing, and what next": (
        draft_map,
        check,
        compare,
        discover,
        adopt,
        experiment,
        learn,
        characterise,
    ),
    "Catalogue and files": (effects, schema),
}
VERBS = tuple(verb for verbs in PANELS.values() for verb in verbs if verb is not draft_map)

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for panel, verbs in PANELS.items():
    for verb in verbs:
        name = "map" if verb is draft_map else verb.__name__  # `map` is a word of Python
        shape = Comparing if verb is compare else Command
        app.command(name, cls=shape, rich_help_panel=panel)(usual(guarded(verb)))


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
    """Plan, execute and explain jumps of a legged robot with pneumatic knees.

    Begin with: kemba-opt solve jump.yaml
    """


def main() -> None:
    """Run `kemba-opt`. Exit code 0 good, 1 bad answer, 2 wrong usage or input, 130 interrupted."""
    # kemba multiplies many small matrices: more BLAS threads only wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        app(prog_name="kemba-opt")
    finally:
        _flush()
        gc.freeze()  # or Python would take all objects apart before the process ends


def _flush() -> None:
    """Write out what is left, so that a full disk gives a message, not only an exit code."""
    try:
        sys.stdout.flush()
    except OSError as error:
        typer.echo(f"the output cannot be written: {error.strerror}", err=True)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # no later write fails
        sys.exit(1)
