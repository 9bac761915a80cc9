"""Effects from outside the package: the page's example, packages, processes, and mistakes."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from kemba.effects import BY_KIND, load_effects
from kemba.errors import KembaError
from kemba.identify.problem.candidates import effect_candidates
from kemba.model import load_model
from kemba_cli.main import app

PAGE = (Path(__file__).parent.parent / "docs" / "extending.md").read_text(encoding="utf-8")


def kemba(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def blocks(language: str) -> list[str]:
    """The page's examples in a language."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(autouse=True)
def _known_only_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What a test loads is forgotten after it."""
    monkeypatch.chdir(tmp_path)
    for name in ("_kinds", "_files"):
        monkeypatch.setattr(BY_KIND, name, dict(getattr(BY_KIND, name)))
    yield
    BY_KIND._union = None


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """The page's effect, and its model."""
    (tmp_path / "my_effects.py").write_text(blocks("python")[0])
    (tmp_path / "with-lip.yaml").write_text(blocks("yaml")[1])
    return tmp_path / "my_effects.py"


def test_the_example_of_the_page_passes_every_check(own: Path) -> None:
    done = kemba("effects", "--test", own)
    assert done.exit_code == 0, done.output
    assert "seal_hysteresis: off is absent: good" in done.stdout
    told = json.loads(kemba("effects", "--test", own, "--json").stdout)
    assert told["good"] and len(told["checks"]) == 12


def test_the_rest_of_the_page_runs(own: Path) -> None:
    room: dict[str, Any] = {"__name__": "page"}
    (cls,) = BY_KIND.load_file(own)
    exec(blocks("python")[1], {**room, "SealHysteresis": cls})


def test_yaml_and_catalogue_know_it(own: Path) -> None:
    assert kemba("check", "with-lip.yaml").exit_code == 2
    done = kemba("check", "with-lip.yaml", "--effects", own)
    assert done.exit_code == 0, done.output
    assert "From outside the package" in kemba("effects", "--effects", own).stdout
    schema = kemba("schema", "models", "--effects", own).stdout
    assert "seal_hysteresis" in schema and "stretch" not in json.loads(schema)


def test_discover_looks_for_it(own: Path) -> None:
    assert "seal_hysteresis" not in effect_candidates(load_model("planning", rig=True))
    BY_KIND.load_file(own)
    found = effect_candidates(load_model("planning", rig=True))["seal_hysteresis"]
    assert found.lead.name == "F_h" and [s.name for s in found.shapes] == ["x_h"]


def test_every_verb_takes_it(own: Path) -> None:
    for verb in app.registered_commands:
        assert verb.callback is not None
        shown = kemba(
            verb.name or verb.callback.__name__, "--effects", "nowhere.py", "--json", "x", "y"
        )
        assert (shown.exit_code, "no-such" in shown.stderr) == (2, False)
        assert "nowhere.py" in shown.stderr, verb.callback.__name__


def test_a_file_that_changes_is_read_again(own: Path) -> None:
    (first,) = BY_KIND.load_file(own)
    assert BY_KIND.load_file(own) == (first,)
    own.write_text(own.read_text().replace("SealHysteresis", "SealLip"))
    (second,) = BY_KIND.load_file(own)
    assert second is not first
    assert "seal_lip" in BY_KIND and "seal_hysteresis" not in BY_KIND


@pytest.mark.parametrize(
    "text, sentence",
    [
        ("x = 1\ny = x/0\n", "bad.py:2: cannot be loaded: ZeroDivisionError: division by zero"),
        ("x = (1\n", "bad.py:1: cannot be loaded: SyntaxError: '(' was never closed"),
        ("import nothing_of_this_name\n", "bad.py:1: cannot be loaded: ModuleNotFoundError"),
        ("raise SystemExit(0)\n", "bad.py:1: cannot be loaded: SystemExit"),
        ("x = 1\n", "bad.py: defines no effect; a subclass of kemba.effects.Effect"),
        ("\0", "bad.py: cannot be loaded: SyntaxError|bad.py:1: cannot be loaded"),
        (
            "from typing import Literal\nfrom kemba.effects import Effect\n"
            'class A(Effect):\n    """A."""\n    kind: Literal["payload"] = "payload"\n',
            "the kind 'payload' exists already in kemba itself; choose another",
        ),
        (
            'from kemba.effects import Effect\nclass A(Effect):\n    kind: str = "a"\n',
            "bad.py: the kind of A is not fixed; `kind: Literal",
        ),
    ],
)
def test_a_file_that_cannot_be_loaded(text: str, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text(text)
    done = kemba("effects", "--test", "bad.py")
    assert done.exit_code == 2 and "Traceback" not in done.stderr
    assert any(part in done.stderr for part in sentence.split("|")), done.stderr


def test_no_yaml_can_name_a_file(own: Path) -> None:
    Path("mine.yaml").write_text("base: planning\neffects:\n  - {kind: ./my_effects.py}\n")
    assert kemba("check", "mine.yaml").exit_code == 2
    assert not BY_KIND.files


def test_workers_load_the_same_file_or_none(own: Path) -> None:
    BY_KIND.load_file(own)
    files = BY_KIND.files
    code = (
        "import json, sys; from kemba.effects import BY_KIND, load_effects;"
        "load_effects(json.loads(sys.argv[1])); print('seal_hysteresis' in BY_KIND)"
    )
    run = [sys.executable, "-c", code, json.dumps(files)]
    assert subprocess.run(run, capture_output=True, text=True).stdout == "True\n"
    own.write_text(own.read_text() + "\n# changed\n")
    with pytest.raises(KembaError, match="has another content than where this work was asked for"):
        load_effects(files)


def test_an_installed_package_joins_by_itself(own: Path, tmp_path: Path) -> None:
    facts = tmp_path / "site" / "lips-1.0.dist-info"
    facts.mkdir(parents=True)
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: lips\nVersion: 1.0\n")
    (facts / "entry_points.txt").write_text("[kemba.effects]\nlips = lips\n")
    (tmp_path / "site" / "lips.py").write_text(own.read_text())
    paths = [str(tmp_path / "site"), *filter(None, [os.environ.get("PYTHONPATH")])]
    command = [sys.executable, "-c", "from kemba_cli.main import main; main()", "check"]

    def check() -> subprocess.CompletedProcess[str]:
        known = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
        return subprocess.run(
            [*command, "with-lip.yaml"], capture_output=True, text=True, env=known
        )

    assert check().returncode == 0
    (tmp_path / "site" / "lips.py").write_text("x = 1/0\n")
    broken = check()
    assert broken.returncode == 2 and "Traceback" not in broken.stderr
    assert "entry point lips = lips: cannot be loaded: ZeroDivisionError" in broken.stderr
    assert "mend or uninstall lips" in broken.stderr
