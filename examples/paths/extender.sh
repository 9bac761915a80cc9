#!/bin/sh
# An extender: an effect of one's own, tested, listed, planned with, and found again.
set -eu
cat > my_effects.py <<'CODE'
"""A rubber bumper between the ends of each piston."""

from typing import Annotated, ClassVar, Literal

from kemba.effects import At, Contribution, Effect
from kemba.quantity import Param


class Bumper(Effect):
    """A spring that pushes a piston out of its retracted end."""

    kind: Literal["bumper"] = "bumper"
    k: Annotated[float, Param("N.m-1", 400.0, lower=0.0, doc="stiffness")] = 0.0

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "k (0.07 - x)"
    source: ClassVar[str] = "linear spring"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"k": 0.0}

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": self.k * (0.07 - at.piston.x)})
CODE
kemba-opt effects --test my_effects.py
kemba-opt effects bumper --effects my_effects.py
cat > with_bumper.yaml <<'MODEL'
name: with-bumper
base: planning
effects:
  - {kind: bumper, k: 500 N.m-1}
MODEL
kemba-opt check with_bumper.yaml --effects my_effects.py
kemba-opt solve jump.yaml --model with_bumper.yaml --effects my_effects.py --no-replay --out bumper
test -s bumper/trajectory.csv
