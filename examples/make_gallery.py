"""Run all examples and write the gallery: `python examples/make_gallery.py [NAME ...]`."""

import ast
import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
IMAGES = ROOT / "docs/images/gallery"
ORDER = (
    "jump", "max_jump", "max_jump_land", "hop", "forward", "drop", "bound", "popup", "accelerate",
    "hurdle", "supply_pressure", "payload", "other_robot",
    "repeats", "where_it_fails", "what_is_missing", "bench", "own_effect", "foreign_log",
)  # fmt: skip


def run(name: str, folder: str, pictures: Path) -> str:
    """What an example prints; its picture goes to `pictures`. Raises CalledProcessError."""
    bin_folder = str(Path(sys.executable).parent)
    own = {
        "KEMBA_PICTURES": str(pictures),
        "PATH": os.pathsep.join([bin_folder, os.environ.get("PATH", "")]),
        "PYTHONPATH": os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")]),
    }
    command = [sys.executable, str(HERE / f"{name}.py")]
    done = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, **own},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return done.stdout


def entry(name: str) -> str:
    """The gallery's section on an example: title, text, picture, code."""
    source = (HERE / f"{name}.py").read_text(encoding="utf-8")
    title, _, text = (ast.get_docstring(ast.parse(source)) or name).partition("\n")
    code = source.split('"""', 2)[2].strip()
    title, text = title.rstrip("."), " ".join(text.split())
    files = [f"{name}{ending}" for ending in (".png", ".gif")]
    shown = "\n\n".join(
        f"![{title}](images/gallery/{file})" for file in files if (IMAGES / file).is_file()
    )
    return (
        f"## {title}\n\n{text}\n\n{shown}\n\n"
        f"<details><summary>examples/{name}.py</summary>\n\n```python\n{code}\n```\n\n</details>\n"
    )


def page() -> str:
    """The gallery, of the examples' own texts."""
    head = (
        "# Gallery\n\nEach picture is made by a script of at most 40 lines in `examples/`; "
        "`python examples/make_gallery.py` runs them all and writes this page.\n\n"
    )
    tail = "\nNext: [plan a jump](plan.md), or [all of it from Python](library.md).\n"
    return head + "\n".join(entry(name) for name in ORDER) + tail


def main() -> None:
    """Run the named examples, or all, then write the page."""
    for name in sys.argv[1:] or ORDER:
        with tempfile.TemporaryDirectory() as folder:
            print(f"{name}: {run(name, folder, IMAGES).strip()}")
    (ROOT / "docs/gallery.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
