"""A touch that cannot be leaves the modes: as a whole, or one element of it at a time."""

from types import SimpleNamespace
from typing import Any

from kemba.ocp.phases.modes import HELD, OPEN, Phase
from kemba.ocp.refinement.repair import Misfit, repaired


def left(*elements: int) -> list[tuple[int, int, int]]:
    """First, last and mode of the phases that are left of a touch from element 2 to 6."""
    ends = ((0, 2, OPEN), (2, 6, HELD), (6, 8, OPEN))
    phases = [Phase(first, last, (mode,), ()) for first, last, mode in ends]
    phase_of = [p for p, phase in enumerate(phases) for _ in range(phase.elements)]
    program: Any = SimpleNamespace(phases=phases, columns=SimpleNamespace(phase_of=phase_of))
    found = repaired(program, [Misfit(e, 0, "touch", 1, 1.0) for e in elements], [])
    return [(p.first, p.last, p.modes[0]) for p in found or ()]


def test_a_touch_that_is_wrong_from_its_beginning_goes_as_a_whole() -> None:
    assert left(2) == [(0, 8, OPEN)]


def test_what_comes_later_in_the_same_touch_is_left() -> None:
    once = [(0, 2, OPEN), (2, 4, HELD), (4, 5, OPEN), (5, 6, HELD), (6, 8, OPEN)]
    assert left(4) == once
    assert left(4, 5) == once
