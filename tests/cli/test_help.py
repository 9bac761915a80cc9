"""Help answers at once and always with an example."""

import subprocess
import sys

import pytest
from typer.testing import CliRunner

import kemba
from kemba_cli.main import VERBS, app

HEAVY = "numpy scipy casadi pinocchio yaml pint matplotlib kemba.trajectory".split()


def test_nothing_heavy_is_imported_for_help() -> None:
    script = (
        "import sys; from typer.testing import CliRunner; from kemba_cli.main import VERBS, app\n"
        "for verb in VERBS: CliRunner().invoke(app, [verb.__name__, '--help'])\n"
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.__name__)
def test_each_verb_shows_an_example(verb: object) -> None:
    name = verb.__name__  # type: ignore[attr-defined]
    shown = CliRunner().invoke(app, [name, "--help"])
    assert shown.exit_code == 0
    assert f"Example: kemba-opt {name}" in shown.output


def test_version() -> None:
    assert CliRunner().invoke(app, ["--version"]).output == f"kemba {kemba.__version__}\n"


def test_unknown_verbs_and_options_are_wrong_usage() -> None:
    assert CliRunner().invoke(app, ["chek"]).exit_code == 2
    assert CliRunner().invoke(app, ["check", "--nope"]).exit_code == 2


@pytest.mark.parametrize("verb", ["compare", "discover", "adopt", "map", "export", "check"])
def test_a_missing_argument_is_answered_by_an_example(verb: str) -> None:
    done = CliRunner().invoke(app, [verb])
    assert done.exit_code == 2
    assert f"Example: kemba-opt {verb}" in " ".join(done.stderr.replace("│", " ").split())
