"""Typical mistakes at the command line: what is wrong, and what to do next, in one line."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from kemba_cli.main import app

LOG = "time [s],body/z [m]\n0,0.2\n0.001,0.2\n"
FILES = {
    "tight.yaml": "name: x\nheight:0.5 m\n",
    "map.yaml": "columns:\n  body/z [m]: {source: z}\n",
    "mine.yaml": "name: mine\nbase: planning\n",
    "log.csv": LOG,
    "run/trajectory.csv": LOG,
    "run/trajectory.meta.yaml": "kind: plan\n",
    "run/controller.csv": LOG,
    "run/task.yaml": "name: x\n",
    "run/manifest.json": "{}",
}
TOLD = {
    "check tight.yaml": "a space is missing behind the colon in line 2",
    "check map.yaml": "columns: has 1 entry; at least 2 were expected",
    "discover mine.yaml": "mine.yaml: is a YAML file; a log was expected: .csv",
    "map mine.yaml": "mine.yaml: is a YAML file; a log was expected: .csv",
    "compare run/trajectory.csv": "run/trajectory.csv: is a plan, not a log",
    "discover log.csv --time-limit 2": "'2': at least 5 was expected",
    "discover log.csv --time-limit soon": "'soon': a number was expected",
    "simulate run --repeat 1.5": "'1.5': a whole number was expected",
    "compare log.csv --out heat.doc": "heat.doc: no format '.doc'",
    "compare log.csv --out heat": "heat: has no ending; a name ending in .png, .pdf or .svg",
    "review log.csv --out page": "page: has no ending; a name ending in .html was expected",
    "map log.csv --out other": "other: has no ending; a name ending in .yaml or .yml was",
    "compare log.csv --out a.png --no-figure": "--out names the figure",
    "characterise log.csv --no-figure --figures b": "--figures names their folder",
    "adopt run seal_friction": "run: holds no answer.json; make one with: kemba-opt discover",
    "experiment run": "run: holds no answer.json; make one with: kemba-opt discover",
    "review --answer run": "run: holds no answer.json; make one with: kemba-opt discover",
    "learn run --logs nope": "nope: no such file or folder; logs of the run were expected",
    "effects seal": "did you mean 'seal_friction'?",
    "slove jump.yaml": "Did you mean 'solve'",
}


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(text, encoding="utf-8")


@pytest.mark.parametrize("typed", TOLD)
def test_a_mistake_is_told(typed: str) -> None:
    done = CliRunner().invoke(app, typed.split())
    assert done.exit_code == 2 and done.stdout == "", done.output
    assert TOLD[typed] in " ".join(done.stderr.replace("│", " ").split())
