"""A touch that cannot be leaves the modes: as a whole, or one element of it at a time."""

from types import SimpleNamespace
from typing import Any

from kemba.ocp.phases.modes import HELD, OPEN, Phase
from kemba.ocp.refinement.repair import Misfit, repaired


def left(*elements: int, kind: str = "touch", asked: bool = False) -> list[tuple[int, int, int]]:
    """First, last and mode of the phases that are left of a touch from element 2 to 6; nothing
    where none changes. `asked`: the task says which feet stand."""
    ends = ((0, 2, OPEN), (2, 6, HELD), (6, 8, OPEN))
    phases = [Phase(first, last, (mode,), ()) for first, last, mode in ends]
    phase_of = [p for p, phase in enumerate(phases) for _ in range(phase.elements)]
    program: Any = SimpleNamespace(
        phases=phases,
        columns=SimpleNamespace(phase_of=phase_of),
        task=SimpleNamespace(contacts=("a part",) if asked else ()),
        constraints=[SimpleNamespace(friction="the ground's")],
    )
    found = repaired(program, [Misfit(e, 0, kind, 1, 1.0) for e in elements], [])
    return [(p.first, p.last, p.modes[0]) for p in found or ()]


def test_a_touch_that_is_wrong_from_its_beginning_goes_as_a_whole() -> None:
    assert left(2) == [(0, 8, OPEN)]


def test_what_comes_later_in_the_same_touch_is_left() -> None:
    once = [(0, 2, OPEN), (2, 4, HELD), (4, 5, OPEN), (5, 6, HELD), (6, 8, OPEN)]
    assert left(4) == once
    assert left(4, 5) == once


def test_a_foot_stands_as_often_as_the_task_says() -> None:
    assert left(2, asked=True) == []  # the only touch would be gone
    assert left(4, asked=True) == []  # there would be two
    assert left(0, kind="gap") == [(0, 1, HELD), (1, 2, OPEN), (2, 6, HELD), (6, 8, OPEN)]
    assert left(0, kind="gap", asked=True) == []
    longer = [(0, 1, OPEN), (1, 6, HELD), (6, 8, OPEN)]
    assert left(1, kind="gap") == left(1, kind="gap", asked=True) == longer
