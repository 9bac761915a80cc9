"""The table of benchmarks/ablation.py: paired differences without each rule."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from kemba.files import atomic_text

Record = dict[str, Any]
BEGIN, END = "<!-- ablation -->", "<!-- end of ablation -->"


def table(records: Sequence[Record]) -> str:
    """One row per rule: cases in which it acted, answers that change, and what is won and lost."""
    told = [r for r in records if r["without"] != "end" and not r.get("failed")]
    whole = {(r["study"], r["index"]): r for r in told if not r["without"]}
    acted: dict[str, int] = defaultdict(int)
    for record in whole.values():
        for name in record["acted"]:
            acted[name] += 1
    pairs: dict[str, list[tuple[Record, Record]]] = defaultdict(list)
    for record in told:
        key = record["study"], record["index"]
        if record["without"] and key in whole:
            pairs[record["without"]].append((whole[key], record))
    count = {s: sum(r["study"] == s for r in whole.values()) for s in {r["study"] for r in told}}
    cases = ", ".join(f"{n} {s}" for s, n in sorted(count.items()))
    lines = [
        f"Cases of the blind studies: {cases}. Bench logs of 2 s, no time limit; "
        "*all that are gone*: the program without these rules, logs as recorded, against recorded "
        "answers. Columns count what answers without the rule gain and lose; *acted*: in so many "
        "cases the rule did something. From `python benchmarks/ablation.py --report --write`.",
        "",
        "| without | acted | asked | answers that change | right first | exactly right "
        "| false alarms | sure and wrong |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in sorted({*acted, *pairs}, key=lambda n: (n.count(","), n)):
        found = pairs[name]
        new = sum((a["verdict"], a["named"]) != (b["verdict"], b["named"]) for a, b in found)
        cells = [_change(found, what) for what in ("first", "exact", "alarm", "sure_wrong")]
        lines.append(f"| {name} | {acted.get(name, '')} | {len(found)} | {new} "
                     f"| {' | '.join(cells)} |")  # fmt: skip
    return "\n".join(lines)


def _change(pairs: Sequence[tuple[Record, Record]], what: str) -> str:
    more = sum(b[what] and not a[what] for a, b in pairs)
    less = sum(a[what] and not b[what] for a, b in pairs)
    return f"+{more} -{less}" if more or less else "0"


def write(page: Path, text: str) -> None:
    """Replace the table of a page."""
    old = page.read_text(encoding="utf-8")
    before, _, rest = old.partition(BEGIN)
    after = rest.partition(END)[2]
    with atomic_text(page) as stream:
        stream.write(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}")
