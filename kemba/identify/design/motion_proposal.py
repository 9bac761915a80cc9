"""The next motion of a robot: a sway that is designed for the rivals of an answer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kemba.config import dump_yaml
from kemba.errors import KembaError
from kemba.identify.answer import read_answer
from kemba.identify.design.motions import task
from kemba.identify.design.rivals import Rivals, contenders
from kemba.identify.design.robot import RobotDesign, Tried, design_motion, expected_of_run
from kemba.identify.design.settings import ExperimentSettings
from kemba.identify.design.words import strength
from kemba.model.model import Model
from kemba.model.spec import load_model


@dataclass(frozen=True)
class MotionProposal:
    """Safe motions, the best one first, and the evidence that is expected of each."""

    model: Model
    base: str
    rivals: Rivals
    design: RobotDesign

    @property
    def best(self) -> Tried:
        """The motion with the most expected evidence."""
        return self.design.best[0]

    @property
    def nats(self) -> float:
        """Expected evidence [nats] of one run of it, between the effects hardest to separate."""
        return self.best.evidence.least

    @property
    def pair(self) -> tuple[str, str]:
        """These two effects."""
        return self.best.evidence.first, self.best.evidence.nearest

    @property
    def repeats(self) -> int | None:
        """Runs until the evidence is decisive; None where that would be too many."""
        count = math.ceil(ExperimentSettings.clear / max(self.nats, 1e-9))
        return count if count <= ExperimentSettings.repeats else None

    @property
    def sentence(self) -> str:
        """What the motion gains, in words."""
        first, second = self.pair
        best, standard = self.best, self.design.standard
        what = f"A sway of {best.sway.duration:.2g} s with {best.sway.leans} leans"
        gives = f"{strength(self.nats)} evidence between {first} and {second}"
        if self.repeats is None:
            return (
                f"{what} is the best of {self.design.tried} safe motions, and is expected to give "
                f"{gives}: feet that stand and pistons at rest do not tell these two apart. Try "
                "the rig (--on rig), or a jump."
            )
        again = "" if self.repeats == 1 else f" in one run, and decisive in {self.repeats}"
        text = f"{what} is expected to give {gives}{again}"
        if best is standard:
            return f"{text}; no other motion that was tried gives more."
        ratio = best.pace / max(standard.pace, 1e-9)
        return f"{text}, {ratio:.2g} times as much per second as a slow lean to both sides."

    def json(self) -> dict[str, Any]:
        """The figures behind the sentence; `designed` and `standard` have the same keys."""
        standard = self.design.standard
        return {
            "motion": "sway",
            "nats": self.nats,
            "rivals": self.pair,
            "sentence": self.sentence,
            "strength": strength(self.nats),
            "log_s": self.best.log_s,
            "repeats": self.repeats,
            "designed": self.best.evidence.json(self.best.log_s),
            "standard": standard.evidence.json(standard.log_s),
            "tried": self.design.tried,
        }

    def write(self, out: Path, tried: Tried) -> None:
        """One of the motions as a task YAML. Raises KembaError."""
        notes = self.sentence if tried is self.best else "the next best motion"
        dump_yaml(task(self.model, self.base, tried.sway, tried.done, notes), out)

    def nats_of(self, run: str | Path) -> float:
        """Expected evidence [nats] of the plan in a run folder."""
        return expected_of_run(run, self.model, self.rivals).least


def propose_motion(
    folder: str | Path,
    out: Path,
    say: Callable[[str], None] = lambda text: None,
    bounded: bool = True,
) -> MotionProposal:
    """The safe motion that best tells the possible effects of an answer apart, a task in `out`.

    `bounded`: in about a minute. Raises KembaError where no motion shows a difference, or a file
    cannot be read or written.
    """
    answer = read_answer(folder)
    rivals, base = contenders(answer), str(answer.get("base") or "planning")
    model = load_model(base)
    if model.mechanism.rig or not model.mechanism.robot:
        raise KembaError(str(folder), f"its model {model.name} is no robot")
    design = design_motion(model, rivals, say, bounded)
    if design is None:
        names = ", ".join(rivals.names)
        raise KembaError(str(folder), f"no log of the robot shows a difference between {names}")
    found = MotionProposal(model, base, rivals, design)
    found.write(out, found.best)
    return found
