"""What a newcomer types, and the sentences that come back."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

# Sentences that newcomers met and did not understand; no command may print them again.
HARD = (
    r"gives different values",
    r"within their usual tolerance",
    r"refined on \d+ phases",
    r"(retracted|extended) of \S+, off by",
    r"of body weight",
    r"should have at (most|least)",
    r"Input should|validation error",
    r"\w+: missing$",
    r" errs \d+ ms after",
    r"converged to (the|a looser) tolerance",
    r"Traceback|failed unexpectedly",
)
NUMBER = re.compile(r"(?<![\w/])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w-]*\.(?:csv|yaml|mat))")


def typed(line: str, folder: Path, code: int = 0) -> str:
    """What a command says on both streams, without the lines of its progress."""
    own = {"PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])}
    done = subprocess.run(
        shlex.split(line),
        cwd=folder,
        env={**os.environ, **own, "COLUMNS": "200"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == code, f"$ {line}\n{done.stdout}"
    for hard in HARD:
        assert not re.search(hard, done.stdout, re.MULTILINE), f"$ {line}\n{done.stdout}"
    lines = [one for one in done.stdout.splitlines() if not re.match(r" *[\d.]+ s  ", one)]
    return "\n".join(lines)


def plain(text: str) -> str:
    """A text with # for every number, as golden texts have it."""
    return NUMBER.sub("#", text)
