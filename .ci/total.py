"""One closing line, as pytest writes it, over several runs: python total.py REPORT.xml ..."""

from __future__ import annotations

import sys
from collections import Counter
from datetime import timedelta
from xml.etree import ElementTree

KINDS = ("failed", "passed", "skipped", "xfailed", "error")


def outcome(case: ElementTree.Element) -> str:
    """How one test of a report ended."""
    if case.find("error") is not None:
        return "error"
    if case.find("failure") is not None:
        return "failed"
    skipped = case.find("skipped")
    if skipped is None:
        return "passed"
    return "xfailed" if skipped.get("type") == "pytest.xfail" else "skipped"


def total(paths: list[str]) -> str:
    """The closing line over all reports."""
    counts: Counter[str] = Counter()
    seconds = 0.0
    for path in paths:
        for suite in ElementTree.parse(path).getroot().iter("testsuite"):
            seconds += float(suite.get("time", 0.0))
            counts.update(outcome(case) for case in suite.iter("testcase"))
    told = ", ".join(f"{counts[kind]} {kind}" for kind in KINDS if counts[kind])
    clock = timedelta(seconds=int(seconds))
    edge = "=" * 15
    return f"{edge} {told or 'no tests ran'} in {seconds:.2f}s ({clock}) {edge}"


if __name__ == "__main__":
    print(total(sys.argv[1:]))
