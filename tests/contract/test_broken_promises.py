"""Each check finds the effect that breaks its promise."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import casadi as ca
import pytest

from kemba.contract import CHECKS, examine
from kemba.effects import BY_KIND, At, Contribution, Effect
from kemba.quantity import Param


class Drag(Effect):
    """A good effect: a drag on the piston."""

    kind: Literal["drag"] = "drag"
    c: Annotated[float, Param("N.s.m-1", 5.0, lower=0.0, doc="damping")] = 0.0

    family: ClassVar[str] = "piston"
    equation: ClassVar[str] = "-c v"
    source: ClassVar[str] = "this test"
    ports: ClassVar[tuple[str, ...]] = ("piston",)
    off: ClassVar[dict[str, float]] = {"c": 0.0}
    dissipative: ClassVar[bool] = True

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.c * at.piston.v})


class Undocumented(Drag):
    """No source."""

    source: ClassVar[str] = ""


class WrongOff(Drag):
    """Off where its bounds do not allow it."""

    off: ClassVar[dict[str, float]] = {"c": -1.0}


class NoTrip(Drag):
    """Leaves its parameter out of YAML."""

    def listed(self) -> dict[str, str]:
        return {"kind": self.kind}


class NoUnits(Drag):
    """A schema without units."""

    @classmethod
    def model_json_schema(cls) -> dict[str, str]:  # type: ignore[override]
        return {}


class Infinite(Drag):
    """A slope without end at standstill."""

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.c * ca.sqrt(ca.fabs(at.piston.v))})


class Idle(Drag):
    """A parameter that does nothing."""

    idle: Annotated[float, Param("1", 1.0, doc="nothing")] = 1.0


class AlwaysThere(Drag):
    """Pushes when off."""

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": -self.c * at.piston.v - 1.0})


class Driving(Drag):
    """Calls itself dissipative and drives."""

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"piston": self.c * at.piston.v})


class Counting(Drag):
    """Differs from one evaluation to the next."""

    count: ClassVar[list[int]] = []

    def evaluate(self, at: At) -> Contribution:
        self.count.append(1)
        return Contribution(effort={"piston": -self.c * at.piston.v * len(self.count)})


class OneSided(Drag):
    """Pushes the hips by their sign of rotation, which turns in the mirror."""

    ports: ClassVar[tuple[str, ...]] = ("hip",)
    dissipative: ClassVar[bool] = False

    def evaluate(self, at: At) -> Contribution:
        return Contribution(effort={"hip": self.c * at.hip.v**2})


class Everywhere(Drag):
    """Ignores `on`."""

    @property
    def leg(self) -> str | None:
        return None


BREAKS = {
    "documented": Undocumented,
    "off is admissible": WrongOff,
    "yaml round trip": NoTrip,
    "schema names units": NoUnits,
    "finite": Infinite,
    "every parameter matters": Idle,
    "off is absent": AlwaysThere,
    "dissipates": Driving,
    "order does not matter": Counting,
    "keeps the mirror": OneSided,
    "one leg only": Everywhere,
}


@pytest.fixture
def _drag_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """`drag` can be read from YAML during the test."""
    monkeypatch.setattr(BY_KIND, "_kinds", {**BY_KIND, "drag": Drag})
    monkeypatch.setattr(BY_KIND, "_union", None)


def test_there_is_an_example_for_every_check() -> None:
    assert set(BREAKS) == {check.name for check in CHECKS}


@pytest.mark.usefixtures("_drag_is_known")
def test_a_good_effect_passes_all() -> None:
    found = list(examine(Drag))
    assert [result.sentence for result in found if not result.good] == []
    assert len(found) == len(CHECKS)


@pytest.mark.parametrize("name", BREAKS)
@pytest.mark.usefixtures("_drag_is_known")
def test_a_broken_promise_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BY_KIND._kinds, "drag", BREAKS[name])
    bad = {
        result.check.name: result.sentence for result in examine(BREAKS[name]) if not result.good
    }
    assert bad.get(name)
