"""Broken inputs by the thousand: every one must be answered in words and in time.

    python benchmarks/fuzz.py                             # 100 inputs of every kind
    python benchmarks/fuzz.py --examples 1000 --seed 7    # more, others
    python benchmarks/fuzz.py --only tasks --only sidecars
    python benchmarks/fuzz.py --formats --examples 300    # each binary format of logs by itself
    python benchmarks/fuzz.py --afresh                    # drop the counts of older code first

The inputs and the rule stand in tests/fuzz. What breaks the rule is printed, the shortest input of
each kind of break, and kept with --keep FOLDER. Counts are added to benchmarks/program.json,
from which benchmarks/program_page.py writes its page. Exit code 1 when an input broke the rule.
Needs the test dependencies: pip install '.[test]'.
"""

import argparse
import contextlib
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

from hypothesis import HealthCheck, given, seed, settings
from program import add, forget

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from fuzz.trial import FORMATS, TRIALS

EVERY = TRIALS | FORMATS

OFTEN = 25  # inputs after which counts are recorded; a run may be interrupted


def tried(
    name: str, examples: int, number: int, folder: Path
) -> tuple[Counter[str], dict[str, str]]:
    """Counts of what happened, and the shortest input of each kind of break."""
    inputs, run = EVERY[name]
    count: Counter[str] = Counter()
    broken: dict[str, str] = {}
    recorded: Counter[str] = Counter()

    def keep() -> None:
        new = {k: n if k.startswith("slowest") else n - recorded[k] for k, n in count.items()}
        recorded.update(new)
        add("fuzz", name, new)

    @seed(number)
    @settings(
        max_examples=examples, deadline=None, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(inputs())
    def once(content: str) -> None:
        found = run(content, folder)
        count["inputs"] += 1
        count[f"exit {found.exit_code}"] += 1
        count["slowest_ms"] = max(count["slowest_ms"], round(1e3 * found.seconds))
        if found.broken:
            kind = found.broken.split(":")[0]
            count[kind] += 1
            key = found.broken[:150]
            if len(content) < len(broken.get(key, content + " ")):
                broken[key] = content
        if count["inputs"] % OFTEN == 0:
            keep()

    with contextlib.suppress(KeyboardInterrupt):
        once()
    keep()
    return count, broken


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--examples", type=int, default=100, help="inputs of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", action="append", choices=list(EVERY), help="of these kinds only")
    parser.add_argument("--formats", action="store_true", help="of each binary format of logs")
    parser.add_argument("--afresh", action="store_true", help="forget earlier counts of a kind")
    parser.add_argument("--keep", type=Path, help="folder for inputs that break the rule")
    arguments = parser.parse_args()
    warnings.simplefilter("error")
    wrong = 0
    for name in arguments.only or (FORMATS if arguments.formats else TRIALS):
        began = time.process_time()
        if arguments.afresh:
            forget("fuzz", name)
        with tempfile.TemporaryDirectory() as folder:
            count, broken = tried(name, arguments.examples, arguments.seed, Path(folder))
        said = ", ".join(f"{key} {n}" for key, n in count.items())
        print(f"{name}: {said}, {time.process_time() - began:.0f} CPU s", flush=True)
        for number, (words, content) in enumerate(broken.items()):
            wrong += 1
            print(f"  BROKEN {words}\n{content[:1000]}\n", flush=True)
            if arguments.keep:
                arguments.keep.mkdir(parents=True, exist_ok=True)
                (arguments.keep / f"{name}-{arguments.seed}-{number}".replace(" ", "-")).write_text(
                    content
                )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
