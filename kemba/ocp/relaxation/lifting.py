"""From half the robot to the whole one: a plan confirmed there, or grown where legs differ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kemba.ocp.nlp.ipopt import Iterate, Parameters
from kemba.ocp.relaxation.schedule import (
    EXACT,
    LONGEST,
    LOOSE,
    MARGIN,
    ROUNDED,
    Attempt,
    Schedule,
    fix,
    move,
    warm,
)
from kemba.ocp.transcription.transcribe import Transcription

CONFIRMED = 1e-7  # scaled violation


def widen(half: Transcription, whole: Transcription, Y: np.ndarray) -> np.ndarray:
    """Y of the half robot as Y of the whole one."""
    groups = {g: half.layout.full(Y, g) for g in ("q", "v", "s", "u", "lam")}
    groups["h"] = half.layout.half(Y, "h")
    return whole.layout.pack(groups)


def confirm(search: Schedule, half: Transcription, point: Iterate) -> Iterate:
    """A plan of the half robot on the whole one: checked there, and solved on where it falls
    short (its forces and moments vanish by symmetry, so that it rarely does)."""
    whole = search.transcription
    start = replace(point, Y=widen(half, whole, point.Y), lam_x=None, lam_g=None)
    parameters = Parameters(MARGIN * search.final_eps)
    g = np.array(whole.problem.g(start.Y.ravel(), parameters.vector(whole.nodes))).ravel()
    if np.max(np.maximum(whole.g_lower - g, g - whole.g_upper)) <= CONFIRMED:
        search.attempts.append(Attempt("confirmed on the whole robot", point.message, 0))
        return start
    options = warm(1e-7, **EXACT)
    fixed = search.valves(start)
    return search.solve("whole robot", start, parameters, options=options, fixed=fixed)


def grow(search: Schedule, half: Transcription, point: Iterate, guess: Iterate) -> Iterate:
    """A plan of the whole robot, its pairs still a little loose, from one of the half robot for
    what the task asks of both legs alike.

    All switches are released by a few nodes, and rounded again. What the mirror keeps at zero, as
    the way ahead, starts from `guess`.
    """
    whole = search.transcription
    Y = widen(half, whole, point.Y)
    lost = np.flatnonzero(~half.layout.reduction.B["q"].any(axis=1))
    for group in ("q", "v"):
        columns = whole.layout.slices[group].start + lost
        Y[:, columns] = guess.Y[:, columns]
    options = warm(1e-2, ROUNDED, max_iter=search.at_most(LONGEST))
    moved = move(search, Iterate(Y), LOOSE, **options)
    return fix(search, moved) if moved.solved else moved
