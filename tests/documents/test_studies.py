"""Every study that a page names in its text runs, at its smallest size."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from documents.pages import PAGES, ROOT, mentioned

# What makes a study small. They write into their repository, so they run in a copy.
SMALL = {
    "benchmarks/ablation.py": ["--cases", "1", "--seconds", "1", "--out", "one.jsonl"],
    "benchmarks/faults.py": ["--faults", "1", "--only", "simulate"],
    "benchmarks/fuzz.py": ["--examples", "3"],
    "benchmarks/learning.py": ["--machines", "1", "--ways", "correction", "--record", "one.jsonl"],
    "benchmarks/plant_tables.py": ["plant", "--figures", "figures"],
    "benchmarks/reading_logs.py": ["--minutes", "0.1", "--formats", "csv", "--repeats", "1"],
    "benchmarks/requirements.py": ["--draws", "1", "--each", "1", "--limit", "1"],
    "benchmarks/scaling.py": ["--nodes", "20", "40", "--repeats", "1"],
    "benchmarks/waiting.py": ["--cases", "1", "--times", "1"],
}


def named() -> set[str]:
    """The studies that stand in the text of a page."""
    spans = [span for page in PAGES for span in mentioned(page)]
    return {script for span in spans for script in re.findall(r"python (benchmarks/\w+\.py)", span)}


def test_every_study_in_a_text_is_run() -> None:
    assert named() == set(SMALL)


@pytest.mark.nightly
@pytest.mark.parametrize("script", SMALL)
def test_a_study_runs(script: str, tmp_path: Path) -> None:
    for folder in ("benchmarks", "configs", "docs", "tests"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    command = [sys.executable, script, *SMALL[script]]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
