"""The next test: designed for the rivals of an answer, or a standard one where that is better."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kemba.config import dump_yaml
from kemba.errors import KembaError
from kemba.identify.answer import read_answer
from kemba.identify.design.menu import JudgedRig
from kemba.identify.design.rig import RigDesign, design_rig_test
from kemba.identify.design.rivals import contenders
from kemba.identify.design.settings import ExperimentSettings
from kemba.identify.design.words import strength
from kemba.model.spec import load_model
from kemba.plant.rigs import Rig


@dataclass(frozen=True)
class Proposal:
    """A test of a rig, and the evidence that is expected of it and of the best standard test."""

    design: RigDesign

    @property
    def chosen(self) -> JudgedRig:
        """The test that was written."""
        return self.design.chosen

    @property
    def rig(self) -> Rig:
        """What the test does."""
        return self.chosen.rig

    @property
    def nats(self) -> float:
        """Expected evidence [nats] between the two effects that are hardest to separate."""
        return self.chosen.evidence.least

    @property
    def rivals(self) -> tuple[str, str]:
        """These two effects."""
        return self.chosen.evidence.first, self.chosen.evidence.nearest

    @property
    def sentence(self) -> str:
        """What the test gains, in words."""
        first, second = self.rivals
        chosen, standard = self.chosen, self.design.standard
        word, length = strength(self.nats), f"{chosen.log_s:.2g} s of log"
        if self.nats < ExperimentSettings.clear:
            return (
                f"No test of a rig that was tried separates {first} from {second}: the best, "
                f"'{chosen.rig.name}' ({length}), is expected to give {word} evidence."
            )
        text = (
            f"The test '{chosen.rig.name}' ({length}) separates {first} from {second}: {word} "
            "evidence is expected"
        )
        if chosen is standard:
            return f"{text}; no shorter test that was tried gives as much."
        other = f"the best standard test, '{standard.rig.name}' ({standard.log_s:.2g} s)"
        if standard.evidence.least < 1.0:
            return f"{text}; {other}, gives almost none."
        return f"{text}, {chosen.pace / standard.pace:.2g} times as much per second as {other}."

    def json(self) -> dict[str, Any]:
        """The figures behind the sentence; `designed` and `standard` have the same keys."""
        design = self.design
        return {
            "rig": self.rig.name,
            "nats": self.nats,
            "rivals": self.rivals,
            "sentence": self.sentence,
            "strength": strength(self.nats),
            "log_s": self.chosen.log_s,
            "designed": _figures(design.designed),
            "standard": _figures(design.standard),
            "tried": design.tried,
        }


def propose(
    folder: str | Path,
    out: Path,
    say: Callable[[str], None] = lambda text: None,
    bounded: bool = True,
) -> Proposal:
    """The test of a rig that best tells the possible effects of an answer apart, a YAML in `out`.

    `bounded`: in about a minute. Raises KembaError where no test shows a difference, or a file
    cannot be read or written.
    """
    answer = read_answer(folder)
    rivals = contenders(answer)
    model = load_model(str(answer.get("base") or "planning"), rig=True)
    if model.mechanism.rig:
        what = f"its model {model.name} is a rig of your own, of kind {model.mechanism.rig}"
        hint = "tests are designed for a piston with valves and for the robot only"
        raise KembaError(str(folder), what, hint=hint)
    design = design_rig_test(model, rivals, say, bounded)
    if design is None:
        names = ", ".join(rivals.names)
        raise KembaError(str(folder), f"no rig test shows a difference between {names}")
    found = Proposal(design)
    rig = {"kind": found.rig.kind, **found.rig.model_dump(mode="json", exclude_defaults=True)}  # type: ignore[attr-defined]
    dump_yaml({"rig": {**rig, "notes": found.sentence}}, out)
    return found


def _figures(judged: JudgedRig) -> dict[str, Any]:
    """Name of a test, and what it is expected to give."""
    return {"rig": judged.rig.name, **judged.evidence.json(judged.log_s)}
