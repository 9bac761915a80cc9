"""What logs can tell, before any effect is looked for, and which standard tests would tell more."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kemba.errors import enumerated
from kemba.identify.design.rig import VirtualBench, judged_menu
from kemba.identify.design.robot import STANDARD, try_out
from kemba.identify.design.separation import ExperimentSettings, JudgedTest, Rivals
from kemba.identify.discover import what_shows
from kemba.identify.infer.search import Search
from kemba.identify.infer.significance import Identifiability, null_test
from kemba.identify.logs.reading import read_logs
from kemba.identify.problem.problem import Parameter, Problem
from kemba.identify.workflow import posed
from kemba.model import load_model
from kemba.stopwatch import Tell, silent


@dataclass(frozen=True)
class SplittingTest:
    """Effects that look alike, and the standard test with most evidence [nats] between those
    nearest to each other; `test` is empty where none shows two of them."""

    effects: Sequence[str]
    test: str = ""
    nats: float = 0.0
    log_s: float = 0.0

    @property
    def sentence(self) -> str:
        """The test in words."""
        names = enumerated(self.effects)
        if self.nats < ExperimentSettings.clear:
            return f"no standard test tells apart {names}"
        told = f"{self.log_s:.2g} s of log, {self.nats:.3g} nats expected"
        return f"{self.test} would tell apart {names} ({told})"


def splitting_test(model: str, problem: Problem, effects: Sequence[str]) -> SplittingTest:
    """The standard test for effects of a problem of `model`, a YAML or a shipped name."""
    rivals = Rivals({e: problem.candidates[e].typical() for e in effects}, {})
    piston, robot = load_model(model, rig=True), load_model(model)
    menu: list[tuple[str, JudgedTest]] = []
    if not piston.mechanism.rig:  # of one's own rigs none is known
        judged = judged_menu(VirtualBench(piston, ExperimentSettings.coarse), rivals)
        menu = [(f"the rig test '{one.test.name}'", one) for one in judged]
    if len(robot.mechanism.legs) > 1 and (sway := try_out(robot, STANDARD, rivals)):
        menu.append(("a slow sway of the robot", sway))
    found = (
        SplittingTest(effects, name, one.least, one.log_s)
        for name, one in menu
        if len(one.nats) == len(effects) - 1
    )
    return max(found, key=lambda test: test.nats, default=SplittingTest(effects))


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
            "sizes": {e: {by[e].name: size} for e, size in told.sizes.items()},
            "usual": {e: {p.name: p.size} for e, p in by.items()},
            "shown": list(told.shown),
            "classes": [list(group) for group in told.alike],
            "tests": [vars(test) for test in self.tests],
            "advice": told.sentence,
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
    read = read_logs(logs, column_map)
    problem, _ = posed(read, model, tell)
    search = Search(problem, say=tell)
    search.start()
    told = what_shows(search, null_test(search))
    tell("standard tests for what looks alike")
    tests = [splitting_test(model, problem, group) for group in told.alike]
    return Preview(told, {e: c.lead for e, c in problem.candidates.items()}, tests)
