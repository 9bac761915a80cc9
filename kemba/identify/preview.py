"""What logs can tell, before any effect is looked for, and which standard tests would tell more."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kemba.identify.design.menu import SplittingTest, splitting_test
from kemba.identify.discover import what_shows
from kemba.identify.infer.identifiability import Identifiability
from kemba.identify.infer.search import Search
from kemba.identify.infer.significance import null_test
from kemba.identify.logs.reading import read_logs
from kemba.identify.problem.types import Parameter
from kemba.identify.workflow import posed
from kemba.logs import load_map
from kemba.stopwatch import Tell, silent


@dataclass(frozen=True)
class Preview:
    """What logs can tell, the parameter that switches each effect on, and for each group of effects
    that look alike the standard test that tells them apart."""

    told: Identifiability
    switches: Mapping[str, Parameter]
    tests: Sequence[SplittingTest]

    def json(self) -> dict[str, Any]:
        """The object that `--json` prints; sizes by effect and parameter, as in an answer."""
        told, by = self.told, self.switches
        return {
            "smallest_detectable": {e: {by[e].name: size} for e, size in told.sizes.items()},
            "usual": {e: {p.name: p.size} for e, p in by.items()},
            "shown": list(told.shown),
            "alike": [list(group) for group in told.alike],
            "tests": [vars(test) for test in self.tests],
            "sentence": told.sentence,
        }


def preview(
    logs: Sequence[str | Path],
    model: str = "planning",
    column_map: str | Path | None = None,
    tell: Tell = silent,
) -> Preview:
    """What these logs can tell of the effects that `model` may lack.

    Raises KembaError; BadData where the logs cannot be right.
    """
    tell("reading the logs")
    read = read_logs(logs, load_map(column_map) if column_map else None)
    problem, _ = posed(read, model, tell)
    search = Search(problem, say=tell)
    search.prepare()
    told = what_shows(search, null_test(search))
    tell("standard tests for what looks alike")
    tests = [splitting_test(model, problem, group) for group in told.alike]
    return Preview(told, {e: c.lead for e, c in problem.candidates.items()}, tests)
