"""What stands on the pages of the documents: commands, code, and where they are executed."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("docs", "benchmarks/pages")  # the site, and what studies have measured
WRITTEN = [p for folder in FOLDERS for p in sorted(ROOT.glob(f"{folder}/*.md"))]
PAGES = {p.name: p for p in [*WRITTEN, ROOT / "README.md"]}
FENCE = re.compile(r"^( *)```(\w*)[^\n]*\n(.*?)^ *```", re.DOTALL | re.MULTILINE)
SHELL = ("sh", "console")
PLACEHOLDER = re.compile(r"\b(?:[A-Z]{3,}|[A-Z]+_[A-Z]+)\b(?![.=])|\.\.\.")

# Pages whose commands other tests or jobs execute.
ELSEWHERE = {
    "examples.md": "tests/identify/test_examples.py",
    "gallery.md": "tests/test_examples.py",
    "tutorial.md": "tests/documents/test_tutorial.py",
    "experiment.md": "tests/identify/design/test_experiment.py",
}


def text_of(page: str) -> str:
    """A page as it stands in the repository."""
    return PAGES[page].read_text(encoding="utf-8")


def blocks(page: str, language: str) -> list[str]:
    """The code blocks of a page in one language."""
    return [body for _, lang, body in FENCE.findall(text_of(page)) if lang == language]


def commands(page: str) -> list[str]:
    """The lines that a page asks to be typed, in order, without their remarks."""
    found = []
    for _, language, body in FENCE.findall(text_of(page)):
        if language not in SHELL:
            continue
        whole = re.sub(r"\\\n\s*", "", body)  # lines that go on behind a backslash
        lines = [line.strip() for line in whole.splitlines()]
        if language == "console":
            lines = [line[2:] for line in lines if line.startswith("$ ")]
        found += [re.sub(r"\s+# .*$", "", line) for line in lines if line]
    return found


def mentioned(page: str) -> list[str]:
    """Commands within the text that are whole: with arguments and without a placeholder."""
    text = FENCE.sub("", text_of(page))
    spans = re.findall(r"`((?:kemba-opt|python benchmarks/)[^`\n]* [^`\n]+)`", text)
    return [span for span in spans if not PLACEHOLDER.search(span)]


def calls(line: str) -> list[list[str]]:
    """The words of every call of kemba-opt in a line of shell."""
    found = []
    for part in re.split(r"\s+(?:&&|\|)\s+", line.replace("2>&1", "")):
        words = shlex.split(part)
        if words and Path(words[0]).name == "kemba-opt":
            found.append(words[1:])
    return found
