"""Do the tests notice bugs that nobody chose? One-line changes at random places of the new code.

    python benchmarks/random_mutants.py --draw 120 --seed 57  # a new list, none of it tried
    python benchmarks/random_mutants.py                       # try those that were not tried yet
    python benchmarks/random_mutants.py --again               # the survivors, with today's tests

The list with its outcomes is benchmarks/random_mutants.jsonl; it is kept after every bug, so that
an interrupted study goes on. Survivors that change no behaviour stand, by hand, in
benchmarks/random_mutants.yaml. A bug is run against the quick tests of the folder that mirrors its
file's, and those that import its module. Needs the test dependencies: pip install '.[test]'.
"""

import argparse
import ast
import json
import random
import re
import tempfile
import time
from pathlib import Path
from typing import Any

from mutants import ROOT, Copy, Mutant  # beside this script
from mutations import Change, Places

LIST = Path(__file__).with_suffix(".jsonl")
CODE = """kemba/ocp/task kemba/ocp/reading.py kemba/ocp/refinement kemba/scene kemba/solve
kemba/identify/infer kemba/logs""".split()
LONGEST = 300.0  # s; see mutants.LONGEST
MIRRORED = 20  # test files at most in the folder that mirrors a file's
SECONDS = Path(tempfile.gettempdir()) / "kemba-seconds-of-tests.json"


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


def tests(file: str) -> list[str]:
    """Test files of the mirrored folder, where it is no larger one's, and importers of the file."""
    module, stem, home = file[:-3].replace("/", "."), Path(file).stem, Path(file).parent
    above = module.rpartition(".")[0]
    named = rf"{re.escape(module)}\b|from {re.escape(above)} import (\([^)]*|[^\n]*)\b{stem}\b"
    while not (near := list((ROOT / "tests" / home.relative_to("kemba")).glob("test_*.py"))):
        home = home.parent
    return [
        path.relative_to(ROOT).as_posix()
        for path in sorted((ROOT / "tests").rglob("test_*.py"))
        if not re.search(r"^pytestmark.*(slow|nightly)", text := path.read_text("utf-8"), re.M)
        and (re.search(named, text) or (path in near and len(near) <= MIRRORED))
    ]


def seconds(copy: Copy, files: list[str]) -> dict[str, float]:
    """How long test files take without a bug, by a file of the computer's; what fails without one,
    as a test of links to files that are not copied, is left out and told."""
    known = json.loads(SECONDS.read_text("utf-8")) if SECONDS.is_file() else {}
    for file in files:
        if file not in known:
            begin = time.monotonic()
            if failed := copy.failing([file]):
                print(f"left out, fails without any bug: {failed}", flush=True)
            known[file] = None if failed else time.monotonic() - begin
            SECONDS.write_text(json.dumps(known), "utf-8")
    return {file: known[file] for file in files if known[file] is not None}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draw", type=int, default=0, help="make a new list of so many")
    parser.add_argument("--seed", type=int, default=57)
    parser.add_argument("--again", action="store_true", help="try those that survived once more")
    parser.add_argument("--only", default="", help="those whose file contains this")
    arguments = parser.parse_args()
    if arguments.draw:
        keep(drawn(arguments.draw, arguments.seed))
    else:
        study("again" if arguments.again else "outcome", arguments.only)


def study(key: str, only: str) -> None:
    """Run what was not tried, or what survived, and keep each outcome under the key."""
    bugs = listed()
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(Path(folder), LONGEST)
        for bug in (bug for bug in bugs if only in bug["file"]):
            if bug.get("outcome") == (None if key == "outcome" else "survived"):
                cost = seconds(copy, tests(bug["file"]))
                order = tuple(sorted(cost, key=cost.__getitem__))
                mutant = Mutant(bug["file"], bug["operator"], bug["was"], bug["now"], order)
                begin, text = time.monotonic(), mutant.mutated(copy.root)
                by = copy.noticed_by(mutant, text) if text else "does not apply"
                bug |= {key: "killed" if by else "survived", "by": by or ""}
                bug["seconds"] = round(time.monotonic() - begin, 1)
                keep(bugs)
                print(bug[key], bug["seconds"], f"{bug['file']}:{bug['line']}", by, flush=True)


def listed() -> list[dict[str, Any]]:
    """The list, with what is known of each bug."""
    return [json.loads(line) for line in LIST.read_text("utf-8").splitlines()]


def keep(bugs: list[dict[str, Any]]) -> None:
    lines = [json.dumps(bug, ensure_ascii=False) + "\n" for bug in bugs]
    LIST.write_text("".join(lines), "utf-8")


if __name__ == "__main__":
    main()
