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


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ("solve --hieght 0.5", "--hieght; a key of the task is changed by --set 'hieght=VALUE'"),
        ("solve --statrs 3", "--statrs; did you mean --starts?"),
        ("compare a.csv --modle plant", "--modle; did you mean --model?"),
        ("check --zzz", "No such option: --zzz"),
    ],
)
def test_of_unknown_options_only_a_near_one_is_named(typed: str, told: str) -> None:
    done = CliRunner().invoke(app, typed.split(), env={"COLUMNS": "200"})
    said = " ".join(done.stderr.replace("│", " ").split())
    assert done.exit_code == 2 and told in said
    assert "Possible options" not in said and ("did you mean" in said) == ("mean" in told)


@pytest.mark.parametrize("verb", ["compare", "discover", "adopt", "map", "export", "check"])
def test_a_missing_argument_is_answered_by_an_example(verb: str) -> None:
    done = CliRunner().invoke(app, [verb])
    assert done.exit_code == 2
    assert f"Example: kemba-opt {verb}" in " ".join(done.stderr.replace("│", " ").split())
