"""Each check finds the effect that breaks its promise."""

from typing import Annotated, ClassVar, Literal

import casadi as ca
import pytest

from kemba.contract import CHECKS, examine
from kemba.effects import BY_KIND, At, Contribution, Effect
from kemba.effects.sensors import SensorEffect
from kemba.effects.series import Series
from kemba.quantity import Param, Tolerance


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


class Gain(SensorEffect):
    """A good sensor fault: the gain is off."""

    kind: Literal["drag"] = "drag"
    k: Annotated[float, Param("1", 0.02, doc="relative error of the gain")] = 0.0

    equation: ClassVar[str] = "measured = (1 + k) true"
    source: ClassVar[str] = "this test"
    off: ClassVar[dict[str, float]] = {"k": 0.0}
    stage: ClassVar[Literal["clock", "gain", "zero"]] = "gain"

    def measured(self, true: Series) -> Series:
        return true.times(1 + self.k)

    def undone(self, measured: Series) -> Series:
        return measured.times(1 / (1 + self.k))


class NotUndone(Gain):
    """Undoes half of what it does."""

    def undone(self, measured: Series) -> Series:
        return measured.times(1 / (1 + 0.5 * self.k))


class BranchingOnSupply(Drag):
    """Decides by the number of a supply that may be a symbol."""

    def evaluate(self, at: At) -> Contribution:
        gain = 1.0 if float(at.supply) > 0.5e6 else 2.0
        return Contribution(effort={"piston": -gain * self.c * at.piston.v})


class NoSuchFigure(Drag):
    """Has a tolerance for a figure that is not there."""

    nominal: ClassVar[dict[str, Tolerance]] = {"d": Tolerance(0.02, source="this test")}


class IdleFigure(Idle):
    """Has a tolerance for a figure that does nothing."""

    nominal: ClassVar[dict[str, Tolerance]] = {"idle": Tolerance(0.02, source="this test")}


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
    "supply can be left open": BranchingOnSupply,
    "keeps the mirror": OneSided,
    "one leg only": Everywhere,
    "sensor fault can be undone": NotUndone,
    "nominal figures matter": NoSuchFigure,
}


@pytest.fixture
def _drag_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """`drag` can be read from YAML during the test."""
    monkeypatch.setattr(BY_KIND, "_kinds", {**BY_KIND, "drag": Drag})
    monkeypatch.setattr(BY_KIND, "_union", None)


def test_there_is_an_example_for_every_check() -> None:
    assert set(BREAKS) == {check.name for check in CHECKS}


@pytest.mark.parametrize("good", [Drag, Gain])
@pytest.mark.usefixtures("_drag_is_known")
def test_a_good_effect_passes_all(good: type[Effect], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BY_KIND._kinds, "drag", good)
    found = list(examine(good))
    assert [result.sentence for result in found if not result.good] == []
    assert len(found) == sum(check.applies(good) for check in CHECKS)


def test_every_check_applies_to_some_good_effect() -> None:
    assert all(check.applies(Drag) or check.applies(Gain) for check in CHECKS)


@pytest.mark.usefixtures("_drag_is_known")
def test_a_tolerance_of_what_does_nothing_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BY_KIND._kinds, "drag", IdleFigure)
    bad = {result.check.name: result.sentence for result in examine(IdleFigure) if not result.good}
    assert "idle has a tolerance" in bad["nominal figures matter"]


class OnByDefault(Drag):
    """Is there where nothing is said of it."""

    c: Annotated[float, Param("N.s.m-1", 5.0, lower=0.0, doc="damping")] = 1.0


@pytest.mark.usefixtures("_drag_is_known")
def test_a_default_that_is_not_off_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BY_KIND._kinds, "drag", OnByDefault)
    bad = {result.check.name: result.sentence for result in examine(OnByDefault) if not result.good}
    assert "its default must be its off value 0" in bad["off is admissible"]


@pytest.mark.parametrize("name", BREAKS)
@pytest.mark.usefixtures("_drag_is_known")
def test_a_broken_promise_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BY_KIND._kinds, "drag", BREAKS[name])
    bad = {
        result.check.name: result.sentence for result in examine(BREAKS[name]) if not result.good
    }
    assert bad.get(name)
