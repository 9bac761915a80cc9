"""The designed test of a rig: valve edges and a motion of the rod that tell rivals apart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kemba.identify.design.confirm import evidence
from kemba.identify.design.courses import beginnings, course
from kemba.identify.design.menu import JudgedRig, judged_menu
from kemba.identify.design.rivals import Rivals
from kemba.identify.design.search import best_point
from kemba.identify.design.separation import Separation, separation
from kemba.identify.design.settings import (
    DesignSearchSettings,
    ExperimentSettings,
    RigCourseSettings,
)
from kemba.identify.design.virtual import VirtualBench, as_predicted, log_time
from kemba.identify.problem.problem import Array
from kemba.model.model import Model
from kemba.plant.rigs import Rig


@dataclass(frozen=True)
class RigDesign:
    """The best standard test and the designed one; `chosen` is the one to be done."""

    standard: JudgedRig
    designed: JudgedRig
    tried: int

    @property
    def chosen(self) -> JudgedRig:
        """The designed test, except where only the standard one settles the question."""
        clear = ExperimentSettings.clear
        least, other = self.designed.evidence.least, self.standard.evidence.least
        return self.standard if least < min(clear, other) else self.designed


def design_rig_test(
    model: Model,
    rivals: Rivals,
    say: Callable[[str], None] = lambda text: None,
    bounded: bool = True,
) -> RigDesign | None:
    """The test of the piston of `model` that tells the rivals apart best; `bounded`: in about a
    minute.

    None where a rig cannot show two of them.
    """
    bench, settings = (
        VirtualBench(model, ExperimentSettings.rows),
        RigCourseSettings,
    )
    coarse = VirtualBench(model, ExperimentSettings.coarse)
    say("judging the standard tests")
    standards = list(judged_menu(coarse, rivals))
    if not standards:
        return None
    standard = max(standards, key=lambda j: j.evidence.least)
    duration = settings.share * standard.log_s
    duration = float(np.clip(duration, settings.shortest, settings.longest))

    def worth(point: Array) -> float:
        found = separation(coarse.problem(course(point, duration, bench.stroke)), rivals)
        return found.worth if found is not None else 0.0

    search = DesignSearchSettings
    say(f"designing a test of {duration:.1f} s")
    best = best_point(worth, beginnings(search.members, search.seed), say, bounded)
    rig = course(best.point, duration, bench.stroke)
    say("fitting the rivals to what the tests would measure")
    before, after = (_confirmed(bench, r, rivals) for r in (standard.rig, rig))
    return RigDesign(before, after, best.tried)


def _confirmed(bench: VirtualBench, rig: Rig, rivals: Rivals) -> JudgedRig:
    """A test, its evidence between the nearest rivals by a fit in place of slopes."""
    problem = bench.problem(rig)
    straight = separation(problem, rivals)
    assert straight is not None
    first, nearest = straight.first, straight.nearest
    logs = as_predicted(problem, rivals.theta(first))
    fitted = evidence(logs, rivals, nearest)
    nats = {**straight.nats, nearest: min(fitted, straight.least)}
    return JudgedRig(rig, Separation(first, nats), log_time(rig, bench.stroke))
