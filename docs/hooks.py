"""Pages that are made when the site is built."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any


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
