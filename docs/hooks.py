"""Pages that are made when the site is built, and the way onwards from those that scripts write."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

# the last line of pages that a script writes from results
NEXT = {
    "benchmarks.md": "[what makes it converge](solving.md), or [sweeps](sweeps.md) of your own",
    "cli.md": "[plan a jump](plan.md), or [how files are written](files.md)",
    "effects.md": "[an effect of your own](extending.md), or [the physics](physics.md)",
    "real-data.md": "[rigs of your own](rigs.md), or [how discovery works](discovery.md)",
    "reliability.md": "[why not?](why-not.md), or [sweeps](sweeps.md) of your own",
    "reliability-of-the-program.md": "[what is trusted](security.md), or [install](start.md)",
    "robustness.md": "[feedback around a plan](policy.md), or [sweeps](sweeps.md) of your own",
    "security.md": "[how files are written](files.md), or [sweeps on a cluster](sweeps.md)",
    "shipped-plans.md": "[plan a jump](plan.md), or [every key of a task](tasks.md)",
    "sensitivity.md": "[how discovery works](discovery.md), or [how plans are found](solving.md)",
}


def on_files(files: Any, config: Any) -> Any:
    """The reference of the command line, from the command itself."""
    from mkdocs.structure.files import File

    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "cli.md"
        command = [sys.executable, "-m", "typer", "kemba_cli.main", "utils", "docs"]
        options = ["--name", "kemba-opt", "--output", str(page)]
        subprocess.run([*command, *options], check=True, capture_output=True)
        text = page.read_text(encoding="utf-8")
    files.append(File.generated(config, "cli.md", content=text))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """A page that a script wrote, with its last line."""
    onwards = NEXT.get(page.file.src_uri)
    return f"{markdown}\n\nNext: {onwards}.\n" if onwards else markdown
