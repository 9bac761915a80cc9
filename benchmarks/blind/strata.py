"""Blind bench cases by what is unusual about the sensors, forty of each kind.

    python benchmarks/blind/strata.py --out strata.jsonl --part 1/2

Effects, sizes and seeds are drawn as in bench.py, physics and sensors; only the sensors differ.
Right is the hidden effect first in the ranking; a class that holds it is told beside.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

from bench import cases, prepared

from blind import report, study
from blind.kinds import kind_of
from kemba.scenarios.share import wilson

KNOWN = ("single", "sensor")
COUNT = 40
RATES = (100.0, 200.0, 333.0, 500.0)
STRATA: dict[str, tuple[study.Setting, ...]] = {
    "coarse steps, with rests": ({"noise": 0.3, "colour": {"steps": 5.0}},),
    "100 to 500 rows a second": tuple({"rate": rate, "colour": {}} for rate in RATES),
    "jitter and missing readings": ({"jitter": 2e-4, "colour": {"gaps": 0.03}},),
    "AR(1) noise": ({"colour": {"keep": 0.9}}, {"colour": {"keep": 0.95}}),
    "drift": ({"colour": {"keep": 0.7, "drift": 1.0}}, {"colour": {"drift": 2.0}}),
}
SEED = 41000  # of the first stratum; each has another


def drawn() -> Iterator[study.Setting]:
    """All cases, one of each stratum after the other, so that any beginning is a fair sample."""
    found = {}
    for number, (name, sensors) in enumerate(STRATA.items()):
        turns = [c for c in cases(SEED + 1000 * number) if kind_of(c["effect"]) in KNOWN]
        found[name] = [
            turn | sensors[i % len(sensors)] | {"stratum": name}
            for i, turn in enumerate(turns[:COUNT])
        ]
    for row in zip(*found.values(), strict=True):
        yield from row


def without_name(setting: study.Setting) -> study.Prepared:
    """A case as bench.py prepares it."""
    return prepared({k: v for k, v in setting.items() if k != "stratum"})


def table(records: list[report.Record]) -> str:
    """A line per stratum."""
    lines = ["| sensors | right effect first | in the named class | sure and wrong | of |",
             "|---|---|---|---|---|"]  # fmt: skip
    for name in STRATA:
        own = [r for r in records if r["case"]["stratum"] == name]
        if not own:
            continue
        shares = []
        for holds in (lambda r: report.among_first(r, 1), report.in_class, report.sure_and_wrong):
            count = sum(map(holds, own))
            low, high = wilson(count, len(own))
            shares.append(f"{100 * count / len(own):.0f} % ({100 * low:.0f} to {100 * high:.0f})")
        lines.append(f"| {name} | {' | '.join(shares)} | {len(own)} |")
    return "\n".join(lines)


def main() -> None:
    """Run what is not yet in the file; print the table, or put it into the docs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("strata.jsonl"))
    parser.add_argument("--part", default="1/1", help="i/n: every n-th case, from the i-th on")
    parser.add_argument("--write", action="store_true", help="put the table into the docs")
    asked = parser.parse_args()
    part, parts = map(int, asked.part.split("/"))
    done = {json.dumps(r["case"], sort_keys=True) for r in report.read(asked.out)}
    for setting in () if asked.write else list(drawn())[part - 1 :: parts]:
        if json.dumps(setting, sort_keys=True) not in done:
            record = study.run(setting, without_name)
            report.append(asked.out, record)
            print(setting["stratum"], report.line(record), flush=True)
    found = table(report.read(asked.out))
    print(found)
    if asked.write:
        report.write(study.DOCS, "strata", found)


if __name__ == "__main__":
    main()
