"""Modes read off a plan: what opens for a moment stays closed, the last switch before a stop."""

from dataclasses import replace

import numpy as np

from kemba.ocp.phases.modes import HELD, OPEN, Phase, _fill_hops, _settling
from kemba.ocp.phases.settings import Reading
from kemba.ocp.reading import asked_of, load_task
from kemba.ocp.refinement.refine import stands

FALLS = Phase(84, 97, (HELD, OPEN), (1.0, 0.0))
HITS = Phase(97, 98, (HELD, HELD), (1.0, 0.0))
RESTS = Phase(98, 100, (HELD, HELD), (0.0, 0.0))


def test_air_is_off_before_the_stop_on_which_a_motion_ends() -> None:
    hit, last = _settling([FALLS, HITS, RESTS])
    assert hit == Phase(97, 98, FALLS.modes, RESTS.valves)
    assert last == RESTS


def test_a_stop_that_closes_well_before_the_last_switch_keeps_its_order() -> None:
    early = replace(HITS, first=95)
    assert _settling([replace(FALLS, last=95), early, RESTS]) == [early, RESTS]


def test_a_contact_that_opens_before_the_last_switch_keeps_its_order() -> None:
    leaves = replace(HITS, modes=(OPEN, OPEN))
    flies = replace(RESTS, modes=(OPEN, OPEN))
    assert _settling([FALLS, leaves, flies]) == [leaves, flies]


def test_only_brief_and_small_hops_are_filled() -> None:
    touches = [OPEN, HELD, HELD, OPEN, OPEN, HELD, OPEN, OPEN, OPEN, HELD, OPEN]
    reading = Reading
    gap = np.array([0.0, 0.0, 0.0, 1.0, 2.0, 0.0, 1.0, 1.0, 1.0, 0.0, 1.0]) * reading.shudder
    for hop, filled in ((reading.shudder, []), (reading.hop, [3, 4])):
        modes = np.array(touches)
        _fill_hops(modes, gap, hop)
        assert np.flatnonzero(modes != np.array(touches)).tolist() == filled


def test_where_the_task_says_which_feet_stand_that_is_read() -> None:
    task, document = load_task("brake")  # air, rear, air, front, both; the rest of its nodes
    _, asked = asked_of(task, document)
    standing = stands(asked, 101)
    borders = {name: np.flatnonzero(np.diff(on.astype(int))).tolist()
               for name, on in standing.items()}  # fmt: skip
    assert borders == {"front/contact:gap": [35], "rear/contact:gap": [10, 25, 55]}
    assert not any(on[0] for on in standing.values())
    assert stands([r for r in asked if r.location[0] != "contacts"], 101) == {}
