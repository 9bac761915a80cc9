"""A touch that cannot be leaves the modes: as a whole, or one element of it at a time. Of several
orders of modes the best is repaired first, in all that does not fit, then one by one."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from kemba.ocp.phases.modes import HELD, OPEN, Phase
from kemba.ocp.refinement.repair import Misfit, Misfitting, best_first, next_repair, repaired


def program_of(*ends: tuple[int, int, int], asked: bool = False) -> Any:
    """What a program says of its phases, each its first and last element and the mode of a foot.
    `asked`: the task says which feet stand."""
    phases = [Phase(first, last, (mode,), ()) for first, last, mode in ends]
    phase_of = [p for p, phase in enumerate(phases) for _ in range(phase.elements)]
    return SimpleNamespace(
        phases=phases,
        nodes=phases[-1].last,
        columns=SimpleNamespace(phase_of=phase_of),
        task=SimpleNamespace(contacts=("a part",) if asked else ()),
        constraints=[SimpleNamespace(friction="the ground's")],
    )


def left(*elements: int, kind: str = "touch", asked: bool = False) -> list[tuple[int, int, int]]:
    """The phases that are left of a touch from element 2 to 6; nothing where none changes."""
    program = program_of((0, 2, OPEN), (2, 6, HELD), (6, 8, OPEN), asked=asked)
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


def test_the_best_order_is_repaired_first_and_then_its_misfits_one_by_one() -> None:
    program = program_of((0, 2, OPEN), (2, 4, HELD), (4, 6, OPEN), (6, 8, HELD), (8, 9, OPEN))
    touches = [Misfit(2, 0, "touch", 1, 1e-3), Misfit(6, 0, "touch", 1, 8e-4)]
    near, further, worse = (
        Misfitting(step, program, np.zeros(0), [m._replace(size=times * m.size) for m in touches])
        for step, times in ((0, 1.0), (1, 2.0), (1, 3.0))
    )
    assert best_first([near, worse, further]) == [further, worse, near]
    seen: list[list[Phase]] = []
    for stands in ([], [(6, 8)], [(2, 4)]):  # both go, the worst one alone, the other one alone
        found = next_repair([further], seen, lambda nodes: [])
        assert found is not None
        assert [(p.first, p.last) for p in found[0] if p.modes == (HELD,)] == stands
        seen.append(found[0])
    assert next_repair([further], seen, lambda nodes: []) is None
