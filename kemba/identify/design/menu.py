"""The standard test, of a piston on a rig or of the robot, that tells alike effects apart."""

from collections.abc import Sequence
from dataclasses import dataclass

from kemba.errors import enumerated
from kemba.identify.design.rig import VirtualBench, judged_menu
from kemba.identify.design.robot import STANDARD, try_out
from kemba.identify.design.separation import ExperimentSettings, Rivals, Separation
from kemba.identify.problem.problem import Problem
from kemba.model import load_model


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
    menu: list[tuple[str, float, Separation]] = []
    if not piston.mechanism.rig:  # of one's own rigs none is known
        judged = judged_menu(VirtualBench(piston, ExperimentSettings.coarse), rivals)
        menu = [(f"the rig test '{one.test.name}'", one.log_s, one.evidence) for one in judged]
    if len(robot.mechanism.legs) > 1 and (sway := try_out(robot, STANDARD, rivals)):
        menu.append(("a slow sway of the robot", sway.log_s, sway.evidence))
    found = (
        SplittingTest(effects, test, evidence.least, log_s)
        for test, log_s, evidence in menu
        if len(evidence.nats) == len(effects) - 1
    )
    return max(found, key=lambda test: test.nats, default=SplittingTest(effects))
