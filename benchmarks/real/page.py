"""Write benchmarks/pages/real-data.md: what the tool says of data that nobody here made.

KEMBA_DATA=folder python -m benchmarks.real.page            five minutes of CPU time
python -m benchmarks.real.page --download                   into the cache of the user
"""

import argparse
import os
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from benchmarks.real import cylinder, emps, pendulum, seals, shoulder, vessel
from benchmarks.real.data import Absent

PAGE = Path(__file__).parents[2] / "benchmarks" / "pages" / "real-data.md"
HEAD = """# Real data

Written by `python -m benchmarks.real.page`; do not edit. Nobody here made these data, and the
project does not keep them: `benchmarks/real/registry.yaml` names source, licence and SHA-256 of
each file, `KEMBA_DATA` the folder with them. Sentences and tables are as the tool gives them.

Errors of `discover` are held-out and whitened: 1 is what the most flexible model of the catalogue
leaves. Errors of `characterise` are in units of the noise of the sensors.
"""

CHANGED = """## What was changed after a look at these data

Rules of the program that were changed once these data had been seen. So these data do not judge
them; data that nobody has looked at would.

| rule | before | now | seen in |
|---|---|---|---|"""
RULES = (
    (
        "usual friction of a seal (`SEAL`, at a bore of 25 mm)",
        *("10 N", "5 N", "cylinder"),
    ),
    (
        "friction just after a turn, where a seal stretches or the filter mixes both directions",
        *("judged like all rows", "in doubt", "cylinder"),
    ),
    (
        "delays of sensors as candidates",
        *("on every rig", "not on cylinders that are slow", "cylinder"),
    ),
    ("heat transfer at the wall", "one constant h", "free convection (McAdams)", "vessel"),
    (
        "noise of the vessel's sensors, where the log states none",
        *("0.5 % of the range", "1 %, and at least 0.5 K", "vessel"),
    ),
    (
        "size of a delay of the vessel's sensors",
        *("that of other rigs", "2 % of the log's length", "vessel"),
    ),
    ("laws of one friction in an answer", *("as many as fit", "one", "drive, shoulder")),
    (
        "a unit of a drive's log that is called wrong: how much better the motion then tells the "
        "force",
        *("than as it is read", "and than friction and a zero alone", "pendulum"),
    ),
    (
        "a verdict",
        *("by the noise that the search learns", "and by the quoted error", "pendulum"),
    ),
    (
        "shortest travel until contacts slide",
        *("a tenth of the usual one", "and a step of the encoder", "pendulum"),
    ),
    (
        "blocks from which the intervals of `characterise` come",
        *("12 of time", "12, 24 and 48, of time and of the way", "drive (M)"),
    ),
)
CHECKED = """
The last one was checked on drives that were simulated. With coloured noise alone, 31 of 32
intervals hold the truth, before and after. With cogging that every repeat of the motion repeats, 8
of 32 did with blocks of time alone, and 32 do now.

Next: [own rigs](../../docs/logs.md), or [how `discover` works](../../docs/discovery.md).
"""


def main() -> None:
    """Write the page from what is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--download", action="store_true", help="fetch what has an address")
    download = parser.parse_args().download
    lines = [HEAD]
    for part in (cylinder, seals, emps, pendulum, shoulder, vessel):
        with tempfile.TemporaryDirectory() as folder:
            try:
                lines += part.section(Path(folder), download)
            except Absent as missing:
                raise SystemExit(f"{missing}; the page stays as it is") from None
    lines += [CHANGED, *(f"| {' | '.join(rule)} |" for rule in RULES), CHECKED]
    PAGE.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
