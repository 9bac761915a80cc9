"""The verdict on a plan's executions: whether each of them keeps to what the task allows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kemba.errors import enumerated
from kemba.ocp.certificate.asked import MeasuredRequirement
from kemba.ocp.task.task import Tolerances

Facts = Mapping[str, Any]

# the executions of a plan, by their keys in the certificate, in words
EXECUTIONS = {
    "replay": "re-simulation",
    "table_replay": "re-simulation of controller.csv",
    "plant_replay": "simulated robot",
}
SLOWEST = 0.025  # s; touchdown of a plant is allowed to err by no more


@dataclass(frozen=True)
class Allowed:
    """How far an execution may miss: apex and end [m], touchdown [s].

    `lands`: whether the plan ends standing, so that the execution must.
    """

    apex: float
    touchdown: float
    final: float
    lands: bool


@dataclass(frozen=True)
class Verdict:
    """Whether an execution is near enough to its plan, with a sentence.

    `share`: its largest error in units of what is allowed; infinite where it falls.
    """

    good: bool
    sentence: str
    share: float = math.inf


def allowances(tolerances: Tolerances, lands: bool, landing_speed: float) -> dict[str, Allowed]:
    """What each execution may miss, by its key in the certificate.

    `landing_speed` [m/s] of the plan: what the plant's apex may err makes its touchdown early or
    late by that length over this speed.
    """
    t = tolerances
    late = t.plant_touchdown
    if late is None:
        late = min(SLOWEST, t.plant_apex / max(landing_speed, 1e-9))
    return {
        "replay": Allowed(t.apex, t.touchdown, t.final, lands),
        "table_replay": Allowed(t.table_apex, t.table_touchdown, t.table_final, lands),
        "plant_replay": Allowed(t.plant_apex, late, t.plant_final, lands),
    }


def judge(
    who: str, facts: Facts | None, allowed: Allowed, asked: Sequence[MeasuredRequirement] = ()
) -> Verdict:
    """An execution against what is allowed, and the requirements as measured on it.

    The sentence of a good one gives the figure nearest to its limit, if it is not zero in the
    digits shown: `re-simulation matches the plan (apex 0.3 mm lower, 2 mm allowed)`. That of a bad
    one gives each cause: `the simulated robot tips over`. Without `facts` nothing could be
    executed, which is no confirmation.
    """
    if facts is None:
        return Verdict(False, f"the {who} cannot be started")
    figures = [_apex(facts["apex_error_m"], allowed.apex)]
    if (late := facts["touchdown_error_s"]) is not None:
        figures.append(_touchdown(late, allowed.touchdown))
    figures.append(_end(facts["final_error_m"], allowed.final))
    causes = [figure.miss for figure in figures if figure.share > 1.0]
    worst = max(figures, key=lambda figure: figure.share)
    falls = allowed.lands and not facts["landed"]
    missed = max((m for m in asked if not m.met), key=lambda m: m.miss / m.allowed, default=None)
    if falls:
        causes.insert(0, facts["fault"] or "does not land")
    elif missed is not None and not causes:
        causes.append(f"does not keep to what was asked: {missed.sentence}")
    if causes:
        beyond = missed.miss / missed.allowed if missed is not None and missed.allowed else 0.0
        share = math.inf if falls else max(worst.share, beyond)
        return Verdict(False, f"the {who} {enumerated(causes)}", share)
    seen = f" ({worst.match})" if worst.seen else ""
    return Verdict(True, f"{who} matches the plan{seen}", worst.share)


@dataclass(frozen=True)
class _Figure:
    """One error: its `share` of what is allowed [1], and in words when it is within or beyond.

    `seen`: whether it is not zero in the digits of these words.
    """

    share: float
    match: str
    miss: str
    seen: bool


def _apex(error: float, allowed: float) -> _Figure:
    height, limit = f"{abs(1e3 * error):.1f} mm", f"{1e3 * allowed:.3g} mm allowed"
    return _Figure(
        _share(error, allowed),
        f"apex {height} {'higher' if error >= 0 else 'lower'}, {limit}",
        f"reaches {height} {'above' if error >= 0 else 'below'} the planned apex ({limit})",
        _seen(error),
    )


def _touchdown(late: float, allowed: float) -> _Figure:
    text = f"{abs(1e3 * late):.1f} ms {'late' if late >= 0 else 'early'}"
    limit = f"{1e3 * allowed:.3g} ms allowed"
    share = _share(late, allowed)
    return _Figure(
        share, f"touchdown {text}, {limit}", f"touches down {text} ({limit})", _seen(late)
    )


def _end(error: float, allowed: float) -> _Figure:
    text, limit = f"{1e3 * error:.1f} mm", f"{1e3 * allowed:.3g} mm allowed"
    share = _share(error, allowed)
    return _Figure(
        share, f"end {text} away, {limit}", f"ends {text} from the plan ({limit})", _seen(error)
    )


def _seen(error: float) -> bool:
    """Whether an error [m] or [s] is shown as more than 0.0 mm or ms."""
    return f"{abs(1e3 * error):.1f}" != "0.0"


def _share(error: float, allowed: float) -> float:
    """The size of an error in units of what is allowed; infinite where nothing is."""
    if allowed > 0.0:
        return abs(error) / allowed
    return float("inf") if error else 0.0
