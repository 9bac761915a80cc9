"""Do the tests notice bugs that nobody chose? One-line changes at random places of the new code.

    python benchmarks/random_mutants.py --draw 120 --seed 57  # a new list, none of it tried
    python benchmarks/random_mutants.py --cover               # which test runs which line, once
    python benchmarks/random_mutants.py                       # try those that were not tried yet
    python benchmarks/random_mutants.py --again               # the survivors, with today's tests

The list with its outcomes is benchmarks/random_mutants.jsonl; it is kept after every bug, so that
an interrupted study goes on. Survivors that change no behaviour stand, by hand, in
benchmarks/random_mutants.yaml. A bug is run against all quick tests that run its line, quickest
first. Needs the test dependencies and pytest-cov: pip install '.[test]' pytest-cov.
"""

import argparse
import ast
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from mutants import ROOT, Copy, Mutant  # beside this script
from mutations import Change, Places

LIST = Path(__file__).with_suffix(".jsonl")
CODE = """kemba/ocp/task kemba/ocp/reading.py kemba/ocp/refinement kemba/scene kemba/solve
kemba/identify/infer kemba/logs""".split()
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


def drawn(number: int, seed: int) -> list[dict[str, Any]]:
    """So many changes at random, each with enough lines before it to stand once in its file."""
    alike, places = kinds(), list[tuple[str, str, Change]]()
    for code in CODE:
        for path in sorted((ROOT / code).rglob("*.py")) or [ROOT / code]:
            text = path.read_text(encoding="utf-8")
            name = path.relative_to(ROOT).as_posix()
            places += [(name, text, change) for change in Places(text, alike).found]
    random.Random(seed).shuffle(places)
    found = [bug for place in places if (bug := record(*place))]
    return [{**bug, "seed": seed, "places": len(found)} for bug in found[:number]]


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


def cover() -> None:
    """Run the quick tests once; keep which lines of the code each of them runs, and how long."""
    measured = [f"--cov={code.removesuffix('.py')}" for code in CODE]
    how = ["--cov-context=test", "--cov-report=", "-o", "junit_family=xunit1"]
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "-p", "no:cacheprovider"]
    setting = {**os.environ, "COVERAGE_FILE": str(LINES)}
    subprocess.run([*command, *measured, *how, f"--junitxml={SECONDS}"], cwd=ROOT, env=setting)


def function(test: str) -> str:
    """The function of a test, or of a context of coverage's, without parameters and phase."""
    return test.partition("[")[0].partition("|")[0]


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
        """Seconds of the tests that run a bug's line, quickest first; where it is run only when
        its module is loaded, of those that run anything of the module."""
        lines = self.data.contexts_by_lineno(str(ROOT / bug["file"]))
        own = {function(context) for context in lines.get(bug["line"], ()) if context}
        every = {function(context) for found in lines.values() for context in found}
        found = {name: self.seconds[name] for name in own or every if name in self.seconds}
        return dict(sorted(found.items(), key=lambda pair: pair[1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draw", type=int, default=0, help="make a new list of so many")
    parser.add_argument("--seed", type=int, default=57)
    parser.add_argument("--cover", action="store_true", help="which test runs which line")
    parser.add_argument("--again", action="store_true", help="try those that survived once more")
    parser.add_argument("--only", default="", help="those whose file contains this")
    arguments = parser.parse_args()
    if arguments.draw:
        keep(drawn(arguments.draw, arguments.seed))
    elif arguments.cover:
        cover()
    else:
        study("again" if arguments.again else "outcome", arguments.only)


def study(key: str, only: str) -> None:
    """Run what was not tried, or what survived, and keep each outcome under the key."""
    bugs, covering = listed(), Covering()
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(Path(folder))
        for bug in (bug for bug in bugs if only in bug["file"]):
            if bug.get("outcome") == (None if key == "outcome" else "survived"):
                begin = time.monotonic()
                by = noticed_by(bug, covering.tests(bug), copy)
                bug |= {key: "killed" if by else "survived", "by": by or ""}
                bug["seconds"] = round(time.monotonic() - begin, 1)
                keep(bugs)
                print(bug[key], bug["seconds"], f"{bug['file']}:{bug['line']}", by, flush=True)


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
