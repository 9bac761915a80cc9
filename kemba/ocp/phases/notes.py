"""The phases of a plan as texts, which a run keeps so that another plan can start from them."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kemba.ocp.phases.modes import AHEAD, BACK, HELD, OPEN, Phase
from kemba.ocp.transcription.unilateral import Constraint

LETTERS = {OPEN: "o", HELD: "h", AHEAD: "a", BACK: "b"}
MODES = {letter: mode for mode, letter in LETTERS.items()}
PHASE = re.compile(r"(\d+)-(\d+) ([ohab]*) ([01]*)")


def phase_notes(phases: Sequence[Phase], constraints: Sequence[Constraint]) -> dict[str, Any]:
    """Entries of a plan's sidecar.

    A phase is a text such as `12-18 ho 10`: from node 12 to 18 the first of `phase_constraints`
    is held and the second open (`a`, `b`: it slides ahead or back), the first valve is open.
    """
    listed = [
        f"{p.first}-{p.last} {''.join(LETTERS[m] for m in p.modes)} "
        f"{''.join(str(int(u)) for u in p.valves)}"
        for p in phases
    ]
    return {"phase_constraints": [c.label for c in constraints], "phases": listed}


def noted_phases(
    meta: Mapping[str, Any], constraints: Sequence[Constraint], valves: int, nodes: int
) -> list[Phase] | None:
    """The phases that `phase_notes` wrote; None where there are none that fit.

    They fit for the same `constraints`, as many `valves`, and a plan of `nodes` intervals.
    """
    if list(meta.get("phase_constraints") or []) != [c.label for c in constraints]:
        return None
    found = [PHASE.fullmatch(str(text)) for text in meta.get("phases") or []]
    phases = [
        Phase(int(m[1]), int(m[2]), tuple(MODES[x] for x in m[3]), tuple(float(u) for u in m[4]))
        for m in found
        if m is not None
    ]
    borders = [0, *(p.last for p in phases)]
    joined = [p.first for p in phases] == borders[:-1] and bool(np.all(np.diff(borders) > 0))
    sizes = {(len(p.modes), len(p.valves)) for p in phases}
    fits = phases and None not in found and joined and sizes == {(len(constraints), valves)}
    return phases if fits and borders[-1] == nodes else None
