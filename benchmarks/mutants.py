"""Do the tests notice? One-line bugs, put into a copy of the tree one by one, and tests run on it.

    python benchmarks/mutants.py                     # all of them, about three seconds of CPU each
    python benchmarks/mutants.py --part 2/4          # the second quarter
    python benchmarks/mutants.py --only certificate  # those whose file or words contain this
    python benchmarks/mutants.py --list              # only whether each still applies

The bugs stand in benchmarks/mutants.yaml, by file and exact text. A bug is killed when one of the
tests named there fails on it. Prints what survives, what no longer applies because its text has
changed, and the score with its 95 % Wilson interval. Exit code 1 when a bug survives or does not
apply. Needs the test dependencies: pip install '.[test]'.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from kemba.config import load_yaml
from kemba.scenarios.share import wilson

ROOT = Path(__file__).parents[1]
LIST = Path(__file__).with_suffix(".yaml")
COPIED = ("kemba", "cli", "configs", "tests", "docs", "benchmarks", "pyproject.toml", "README.md")
PACKAGES = {"kemba": "kemba", "kemba_cli": "cli", "kemba_configs": "configs"}
LONGEST = 900.0  # s; a bug that makes the tests hang for so long is noticed
HANGS = -1  # exit code of such a run
NONE = 5  # exit code of pytest where no test is quick
UNFOUND = 4  # where a test is not found, as its file cannot be loaded


@dataclass(frozen=True)
class Mutant:
    """One bug: `was` stands exactly once in `file` and is replaced by `now`."""

    file: str
    bug: str
    was: str
    now: str
    tests: tuple[str, ...]

    def mutated(self, root: Path) -> str | None:
        """The file's text with the bug in it; None where `was` does not stand there once."""
        path = root / self.file
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        return text.replace(self.was, self.now) if text.count(self.was) == 1 else None

    def __str__(self) -> str:
        return f"{self.file}: {self.bug}"


def listed(path: Path = LIST) -> list[Mutant]:
    """All bugs of a list."""
    return [
        Mutant(group["file"], bug["bug"], bug["was"], bug["now"], tuple(group["tests"]))
        for group in load_yaml(path).data
        for bug in group["bugs"]
    ]


class Copy:
    """A copy of the tree in a temporary folder, in which tests are run."""

    def __init__(self, folder: Path, longest: float = LONGEST) -> None:
        self.root, self.longest = folder / "tree", longest
        for name in COPIED:
            source, target = ROOT / name, self.root / name
            if source.is_dir():
                shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                target.parent.mkdir(exist_ok=True)
                shutil.copy(source, target)
        self.links = folder / "packages"
        self.links.mkdir()
        for package, name in PACKAGES.items():
            (self.links / package).symlink_to(self.root / name)
        self.server = self._server()

    def _server(self) -> subprocess.Popen[str]:
        path = os.pathsep.join(filter(None, [str(self.links), os.environ.get("PYTHONPATH")]))
        # files change within a second, which compiled Python does not see; solvers' code is not
        # compiled and the plant's is kept here, for every bug would leave code of its own in the
        # user's cache
        setting = {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
        setting["KEMBA_CACHE"] = str(self.root.parent / "cache")
        return subprocess.Popen(
            [sys.executable, str(LIST.with_name("mutants_server.py"))],
            cwd=self.root,
            env={**os.environ, **setting},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def failing(self, tests: Sequence[str]) -> str | None:
        """The first of the quick `tests` that fails in the copy; None where all pass."""
        assert self.server.stdin and self.server.stdout
        print(json.dumps({"tests": list(tests), "longest": self.longest}), file=self.server.stdin)
        self.server.stdin.flush()
        code, failed = json.loads(self.server.stdout.readline())
        if code not in (HANGS, 0, 1, 2, NONE) and not (code == UNFOUND and failed):
            raise SystemExit(f"pytest ended with {code}: pytest {' '.join(tests)}")
        return None if code in (0, NONE) else failed or "a run without end"

    def noticed_by(self, mutant: Mutant, text: str) -> str | None:
        """The test that fails with the bug in it."""
        path = self.root / mutant.file
        whole = path.read_text(encoding="utf-8")
        path.write_text(text, encoding="utf-8")
        try:
            return self.failing(mutant.tests)
        finally:
            path.write_text(whole, encoding="utf-8")


def outcomes(mutants: list[Mutant], copy: Copy) -> Iterator[tuple[Mutant, str]]:
    """What became of each bug: killed, survived, or does not apply.

    A test that fails with a bug must pass without it; each such test is tried once.
    """
    sound: set[str | tuple[str, ...]] = set()
    for mutant in mutants:
        text = mutant.mutated(copy.root)
        if text is None:
            yield mutant, "does not apply"
            continue
        test = copy.noticed_by(mutant, text)
        if test and "::" in test and test not in sound:
            if copy.failing([test]):
                raise SystemExit(f"fails without any bug: pytest '{test}'")
            sound.add(test)
        elif test and "::" not in test and mutant.tests not in sound:
            if copy.failing(mutant.tests):  # the file could not be loaded, or the run had no end
                raise SystemExit(f"fails without any bug: pytest {' '.join(mutant.tests)}")
            sound.add(mutant.tests)
        yield mutant, "killed" if test else "survived"


def chosen(part: str, only: str) -> list[Mutant]:
    """The bugs of a part, such as 2/4, among those that contain a text."""
    number, parts = (int(n) for n in part.split("/"))
    if not 1 <= number <= parts:
        raise SystemExit(f"--part {part}: such as 2/4 was expected")
    found = [m for m in listed() if only in str(m)]
    size = len(found)
    return found[(number - 1) * size // parts : number * size // parts]


def _kept() -> dict[str, str]:
    """Outcomes in program.json, by bug."""
    from program import load  # beside this script, which tests import as well

    return dict(load().get("mutants", {}).get("all", {}).get("outcomes", {}))


def _record(mutant: Mutant, outcome: str) -> None:
    """Keep an outcome in program.json; those of bugs that are no longer listed are dropped."""
    from program import put

    known = {str(m) for m in listed()}
    both = {**_kept(), str(mutant): outcome}
    outcomes = {name: said for name, said in both.items() if name in known}
    put("mutants", "all", {"listed": len(known), "outcomes": outcomes})


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", default="1/1", help="such as 2/4: the second of four")
    parser.add_argument("--only", default="", help="bugs whose file or words contain this")
    parser.add_argument("--record", action="store_true", help="keep outcomes for the page")
    parser.add_argument("--new", action="store_true", help="only bugs without a kept outcome")
    parser.add_argument("--list", action="store_true", help="run no tests")
    arguments = parser.parse_args()
    mutants = chosen(arguments.part, arguments.only)
    if arguments.new:
        known = _kept()
        mutants = [m for m in mutants if str(m) not in known]
    if arguments.list:
        lost = [m for m in mutants if m.mutated(ROOT) is None]
        print(*(f"does not apply  {m}" for m in lost), sep="\n")
        print(f"{len(mutants) - len(lost)} of {len(mutants)} apply")
        return int(bool(lost))
    count = {"killed": 0, "survived": 0, "does not apply": 0}
    with tempfile.TemporaryDirectory() as folder:
        for mutant, outcome in outcomes(mutants, Copy(Path(folder))):
            count[outcome] += 1
            if arguments.record:
                _record(mutant, outcome)
            print(f"{outcome:14}  {mutant}", flush=True)
    tried = count["killed"] + count["survived"]
    if tried:
        low, high = wilson(count["killed"], tried)
        print(
            f"killed {count['killed']} of {tried}: {100 * count['killed'] / tried:.0f} % "
            f"(95 %: {100 * low:.0f} to {100 * high:.0f} %); "
            f"{count['does not apply']} do not apply"
        )
    return int(count["killed"] < len(mutants))


if __name__ == "__main__":
    sys.exit(main())
