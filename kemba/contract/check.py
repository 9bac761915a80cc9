"""The one list of checks, and running them."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from kemba.contract import measuring, physics, words
from kemba.contract.cases import Broken, Placed
from kemba.effects import Effect
from kemba.effects.catalogue import DRIVE, OWN_RIGS
from kemba.effects.registry import kind_of
from kemba.errors import KembaError

__all__ = ["CHECKS", "Broken", "Check", "CheckResult", "examine"]


def _always(effect: type[Effect]) -> bool:
    return True


def _switched(effect: type[Effect]) -> bool:
    return bool(effect.off)


def _on_one_leg(effect: type[Effect]) -> bool:
    return bool(effect.off) and _on_legs(effect)


def _dissipative(effect: type[Effect]) -> bool:
    return effect.dissipative


def _on_legs(effect: type[Effect]) -> bool:
    return effect.place == "leg" and effect not in (*DRIVE, *OWN_RIGS)


@dataclass(frozen=True)
class Check:
    """A promise: `run` raises Broken when an effect does not keep it."""

    run: Callable[[Placed], None]
    applies: Callable[[type[Effect]], bool] = _always

    @property
    def name(self) -> str:
        """Its name in words: `off is absent`."""
        return self.run.__name__.replace("_", " ")

    @property
    def doc(self) -> str:
        """What is promised, in one sentence."""
        return (self.run.__doc__ or "").split("\n")[0]


CHECKS = (
    Check(words.documented),
    Check(words.off_is_admissible),
    Check(words.yaml_round_trip),
    Check(words.schema_names_units),
    Check(physics.finite),
    Check(physics.every_parameter_matters),
    Check(physics.off_is_absent, _switched),
    Check(physics.dissipates, _dissipative),
    Check(physics.order_does_not_matter),
    Check(physics.supply_can_be_left_open),
    Check(physics.keeps_the_mirror, _on_legs),
    Check(physics.one_leg_only, _on_one_leg),
    Check(measuring.sensor_fault_can_be_undone, measuring.measures),
    Check(measuring.nominal_figures_matter, measuring.moves),
)


@dataclass(frozen=True)
class CheckResult:
    """How a check of an effect ended; `sentence` says what is wrong."""

    effect: str
    check: Check
    good: bool
    sentence: str = ""


def examine(effect: type[Effect]) -> Iterator[CheckResult]:
    """Every check that applies to an effect; its own exceptions are results too."""
    placed = Placed(effect)
    for check in CHECKS:
        if check.applies(effect):
            try:
                check.run(placed)
            except (Broken, KembaError) as error:
                yield CheckResult(kind_of(effect), check, False, str(error))
            except Exception as error:
                yield CheckResult(kind_of(effect), check, False, _raised(error))
            else:
                yield CheckResult(kind_of(effect), check, True)


def _raised(error: Exception) -> str:
    """An exception with the line that raised it."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    own = [f for f in traceback.extract_tb(error.__traceback__) if f.name in ("evaluate", "states")]
    frame = own[-1] if own else frame
    text = str(error).splitlines()[0] if str(error) else ""
    return f"{type(error).__name__} at {Path(frame.filename).name}:{frame.lineno}: {text}"
