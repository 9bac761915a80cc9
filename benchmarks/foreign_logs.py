"""Logs as other programs might write them, and what a drafted map makes of each.

python benchmarks/foreign_logs.py [COUNT] [FIRST SEED]: a table on the standard output, faults in
full. Exit code 1 where a log was read wrong or crashed.
"""

import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from strange_logs import judged, way, written


def main(count: int = 400, first: int = 0) -> int:
    verdicts: Counter[str] = Counter()
    by_form: dict[str, Counter[str]] = {}
    with tempfile.TemporaryDirectory() as name:
        for seed in range(first, first + count):
            found = way(seed)
            path, log = written(found, Path(name))
            verdict = judged(path, log)
            verdicts[verdict.what] += 1
            by_form.setdefault(found.form, Counter())[verdict.what] += 1
            if verdict.what != "read":
                print(f"{verdict.what}: {found}: {verdict.why[:300]}")
            for file in Path(name).iterdir():
                shutil.rmtree(file) if file.is_dir() else file.unlink()
    kinds = ("read", "asked", "refused", "wrong", "crash")
    print("| written as | " + " | ".join(kinds) + " |\n|---" * 1 + "|---" * len(kinds) + "|")
    for form, counts in {**by_form, "all": verdicts}.items():
        print(f"| {form} | " + " | ".join(str(counts[kind]) for kind in kinds) + " |")
    return int(verdicts["wrong"] + verdicts["crash"] > 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
