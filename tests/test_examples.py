"""The examples run, and the gallery shows them as they are."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "examples"))
import make_gallery  # noqa: E402

NOTEBOOKS = sorted((ROOT / "examples/notebooks").glob("*.ipynb"))


def test_the_gallery_shows_the_examples_as_they_are() -> None:
    assert (ROOT / "docs/gallery.md").read_text(encoding="utf-8") == make_gallery.page()
    scripts = {path.stem for path in (ROOT / "examples").glob("*.py")}
    assert scripts - {"make_gallery", "pictures", "readme_picture"} == set(make_gallery.ORDER)
    assert len(make_gallery.ORDER) >= 12
    for name in make_gallery.ORDER:
        assert (ROOT / f"docs/images/gallery/{name}.png").stat().st_size > 5000


@pytest.mark.nightly
@pytest.mark.parametrize("name", make_gallery.ORDER)
def test_an_example_runs(name: str, tmp_path: Path) -> None:
    make_gallery.run(name, str(tmp_path), tmp_path)
    assert (tmp_path / f"{name}.png").stat().st_size > 5000


def test_the_readme_has_one_small_animated_picture() -> None:
    shown = re.findall(r"!\[.+\]\((.+\.gif)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert shown == ["docs/images/jump.gif"]
    assert (ROOT / shown[0]).stat().st_size < 1_000_000
    with Image.open(ROOT / shown[0]) as picture:
        assert picture.n_frames > 20


@pytest.mark.nightly
def test_the_picture_of_the_readme_is_made(tmp_path: Path) -> None:
    make_gallery.run("readme_picture", str(tmp_path), tmp_path)
    assert 20_000 < (tmp_path / "jump.gif").stat().st_size < 1_000_000


def test_there_are_three_notebooks_without_outputs() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["discover", "own_robot", "plan"]
    for path in NOTEBOOKS:
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert not any(cell.get("outputs") for cell in cells), path


@pytest.mark.nightly
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, tmp_path: Path) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any(
        "image/png" in json.dumps(output) or "<img" in json.dumps(output) for output in shown
    )


@pytest.mark.nightly
@pytest.mark.parametrize("path", ["planner", "identifier", "extender"])
def test_a_strangers_path(path: str, tmp_path: Path) -> None:
    """Each from an empty folder, command by command, as a stranger would type it."""
    own = {"PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])}
    script = ROOT / f"examples/paths/{path}.sh"
    done = subprocess.run(
        ["sh", str(script)],
        cwd=tmp_path,
        env={**os.environ, **own},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
