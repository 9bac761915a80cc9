"""Do the tests notice bugs that nobody chose? One-line changes at random places of the new code.

    python benchmarks/random_mutants.py --draw 40 --seed 61 --since f2f25f85  # newer lines only
    python benchmarks/random_mutants.py --cover tests/model tests/ocp  # which test runs which line
    python benchmarks/random_mutants.py                  # try those that were not tried yet
    python benchmarks/random_mutants.py --again          # the survivors, with today's tests

The list with its outcomes is benchmarks/random_mutants.jsonl; it is kept after every bug, so that
an interrupted study goes on. What an earlier draw has left untried stays listed as `left`.
Survivors that change no behaviour stand, by hand, in benchmarks/random_mutants.yaml. A bug is run
against the quick tests that run its line, quickest first, all of them or those of --seconds. Needs
the test dependencies and pytest-cov: pip install '.[test]' pytest-cov.
"""

import argparse
import ast
import json
import math
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from itertools import accumulate
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from mutants import ROOT, Copy, Mutant  # beside this script
from mutations import Change, Places

LIST = Path(__file__).with_suffix(".jsonl")
FOLDER = Path(tempfile.gettempdir())
LINES, SECONDS = FOLDER / "kemba-lines-of-tests.db", FOLDER / "kemba-seconds-of-tests.xml"


def kinds() -> dict[str, list[str]]:
    """Types of the arguments of kemba's functions whose name is there once."""
    found: dict[str, list[str]] = {}
    for path in sorted((ROOT / "kemba").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                names = [a for a in node.args.args if a.arg != "self"]
                types = [ast.unparse(a.annotation) if a.annotation else a.arg for a in names]
                found[node.name] = [] if node.name in found else types
    return found


def newer(since: str) -> dict[str, set[int]]:
    """Lines of each file of kemba that were not there in this commit."""
    command = ["git", "diff", "-U0", "--no-color", since, "--", "kemba/*.py"]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    found: dict[str, set[int]] = {}
    for line in told.splitlines():
        if line.startswith("+++ "):
            lines = found.setdefault(line[4:].removeprefix("b/"), set())
        elif part := re.match(r"@@ -\S+ \+(\d+),?(\d*) @@", line):
            lines |= set(range(int(part[1]), int(part[1]) + int(part[2] or 1)))
    return {name: lines for name, lines in found.items() if lines and name != "/dev/null"}


def drawn(number: int, seed: int, since: str) -> list[dict[str, Any]]:
    """So many changes at random, each with enough lines before it to stand once in its file."""
    alike, places = kinds(), list[tuple[str, str, Change]]()
    for name, lines in sorted(newer(since).items()):
        text = (ROOT / name).read_text(encoding="utf-8")
        places += [(name, text, c) for c in Places(text, alike).found if c[0] in lines]
    random.Random(seed).shuffle(places)
    found = [bug for place in places if (bug := record(*place))]
    draw = {"seed": seed, "since": since, "places": len(found)}
    return [{**bug, **draw} for bug in found[:number]]


def record(file: str, text: str, change: Change) -> dict[str, Any] | None:
    """A change in words; None where it is no Python."""
    number, first, last, new, operator = change
    lines = text.splitlines()
    line = lines[number - 1].encode()
    start = number - 1
    while text.count(was := "\n".join(lines[start:number])) > 1:
        start -= 1
    now = "\n".join(
        [*lines[start : number - 1], (line[:first] + new.encode() + line[last:]).decode()]
    )
    try:
        ast.parse(text.replace(was, now))
    except SyntaxError:
        return None
    return {"file": file, "line": number, "operator": operator, "was": was, "now": now}


def cover(tests: list[str]) -> None:
    """Run quick tests once (all where none are named); keep which lines of the code each of them
    runs, and how long."""
    how = ["--cov=kemba", "--cov-context=test", "--cov-report=", "-o", "junit_family=xunit1"]
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "-p", "no:cacheprovider", *tests]
    setting = {**os.environ, "COVERAGE_FILE": str(LINES)}
    subprocess.run([*command, *how, f"--junitxml={SECONDS}"], cwd=ROOT, env=setting)


def function(test: str) -> str:
    """The function of a test, or of a context of coverage's, without parameters and phase."""
    return test.partition("[")[0].partition("|")[0]


def in_function(file: Path, line: int) -> bool:
    """Whether a line is run when a function is called, not when its module is loaded."""
    nodes = ast.walk(ast.parse(file.read_text(encoding="utf-8")))
    bodies = [n.body for n in nodes if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    return any(body[0].lineno <= line <= (body[-1].end_lineno or 0) for body in bodies)


class Covering:
    """Which tests run a line."""

    def __init__(self) -> None:
        from coverage import CoverageData  # of pytest-cov, which only this study needs

        self.data = CoverageData(str(LINES))
        self.data.read()
        self.seconds: dict[str, float] = {}
        for case in ElementTree.parse(SECONDS).iter("testcase"):
            if case.find("failure") is None:
                name = function(f"{case.get('file')}::{case.get('name')}")
                self.seconds[name] = self.seconds.get(name, 0.0) + float(case.get("time") or 0.0)

    def tests(self, bug: dict[str, Any]) -> dict[str, float]:
        """Seconds of the tests that run a bug's line, quickest first; where it is run when its
        module is loaded, or as machine code, of those that run anything of the module."""
        lines = self.data.contexts_by_lineno(str(ROOT / bug["file"]))
        own = {function(context) for context in lines.get(bug["line"], ()) if context}
        every = {function(context) for found in lines.values() for context in found}
        asked = own if own and in_function(ROOT / bug["file"], bug["line"]) else every
        found = {name: self.seconds[name] for name in asked if name in self.seconds}
        return dict(sorted(found.items(), key=lambda pair: pair[1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draw", type=int, default=0, help="add so many to what was tried")
    parser.add_argument("--seed", type=int, default=57)
    parser.add_argument("--since", default="", help="commit: only lines that it does not have")
    parser.add_argument("--cover", nargs="*", help="which of these tests runs which line")
    parser.add_argument("--again", action="store_true", help="try those that survived once more")
    parser.add_argument("--only", default="", help="those whose file contains this")
    parser.add_argument(
        "--seconds", type=float, default=math.inf, help="of tests a bug, as they took without it"
    )
    arguments = parser.parse_args()
    if arguments.draw:
        before = [bug if "outcome" in bug else {**bug, "left": True} for bug in listed()]
        keep(before + drawn(arguments.draw, arguments.seed, arguments.since))
    elif arguments.cover is not None:
        cover(arguments.cover)
    else:
        study("again" if arguments.again else "outcome", arguments.only, arguments.seconds)


def study(key: str, only: str, seconds: float) -> None:
    """Run what was not tried, or what survived, and keep each outcome under the key."""
    bugs, covering = listed(), Covering()
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(Path(folder))
        for bug in (bug for bug in bugs if only in bug["file"]):
            wanted = None if key == "outcome" else "survived"
            if bug.get("outcome") == wanted and bug.get(key) != "killed" and "left" not in bug:
                begin = time.monotonic()
                by = noticed_by(bug, quickest(covering.tests(bug), seconds), copy)
                bug |= {key: "killed" if by else "survived", "by": by or ""}
                bug["seconds"] = round(time.monotonic() - begin, 1)
                keep(bugs)
                print(bug[key], bug["seconds"], f"{bug['file']}:{bug['line']}", by, flush=True)


def quickest(cost: dict[str, float], seconds: float) -> dict[str, float]:
    """The first tests that together take no longer."""
    ends = accumulate(cost.values())
    return {name: cost[name] for name, end in zip(cost, ends, strict=True) if end <= seconds}


def noticed_by(bug: dict[str, Any], cost: dict[str, float], copy: Copy) -> str | None:
    """The first of the tests that fails on a bug, and only on it; None where all pass."""
    while True:
        mutant = Mutant(bug["file"], bug["operator"], bug["was"], bug["now"], tuple(cost))
        # a run without end is noticed; without the cache, plans of tests are made anew
        copy.longest = 300.0 + 5.0 * sum(cost.values())
        if (text := mutant.mutated(copy.root)) is None:
            raise SystemExit(f"{bug['file']} has changed: draw anew (--draw)")
        by = copy.noticed_by(mutant, text) if cost else None
        if by is None or (own := function(by)) not in cost or not copy.failing([own]):
            return by
        print(f"left out, fails without any bug: {by}", flush=True)
        del cost[own]


def listed() -> list[dict[str, Any]]:
    """The list, with what is known of each bug."""
    return [json.loads(line) for line in LIST.read_text("utf-8").splitlines()]


def keep(bugs: list[dict[str, Any]]) -> None:
    lines = [json.dumps(bug, ensure_ascii=False) + "\n" for bug in bugs]
    LIST.write_text("".join(lines), "utf-8")


if __name__ == "__main__":
    main()
