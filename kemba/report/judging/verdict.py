"""The verdict on a plan: whether its executions match it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kemba.errors import enumerated
from kemba.ocp.task.task import Tolerances

Facts = Mapping[str, Any]

# the executions of a plan, by their keys in the certificate, in words
EXECUTIONS = {
    "replay": "re-simulation",
    "table_replay": "re-simulation of controller.csv",
    "plant_replay": "simulated robot",
}


@dataclass(frozen=True)
class Allowed:
    """How far an execution may miss: apex and end [m], touchdown [s]; None is not judged.

    `lands`: whether the plan ends standing, so that the execution must.
    """

    apex: float
    touchdown: float | None
    final: float | None
    lands: bool


@dataclass(frozen=True)
class Verdict:
    """Whether an execution is near enough to its plan, with a sentence.

    `share`: its largest error in units of what is allowed; infinite where it falls.
    """

    good: bool
    sentence: str
    share: float = math.inf


def verdicts(
    executed: Mapping[str, Facts | None], tolerances: Tolerances, lands: bool
) -> dict[str, Verdict]:
    """The verdict on each execution by its key in the certificate."""
    t = tolerances
    allowed = {
        "replay": Allowed(t.apex, t.touchdown, t.final, lands),
        "table_replay": Allowed(t.table_apex, t.table_touchdown, t.table_final, lands),
        "plant_replay": Allowed(t.plant_apex, t.plant_touchdown, t.plant_final, lands),
    }
    keys = [key for key in EXECUTIONS if key in executed]
    return {key: judge(EXECUTIONS[key], executed[key], allowed[key]) for key in keys}


def judge(who: str, facts: Facts | None, allowed: Allowed) -> Verdict:
    """An execution against what is allowed.

    The sentence of a good one gives the figure nearest to its limit, if it is not zero in the
    digits shown: `re-simulation matches the plan (apex 0.3 mm lower, 2 mm allowed)`. That of a bad
    one gives each cause: `the simulated robot tips over`. Without `facts` nothing could be
    executed, which is no confirmation.
    """
    if facts is None:
        return Verdict(False, f"the {who} cannot be started")
    figures = [_apex(facts["apex_error_m"], allowed.apex)]
    if (late := facts["touchdown_error_s"]) is not None and allowed.touchdown is not None:
        figures.append(_touchdown(late, allowed.touchdown))
    if allowed.final is not None:
        figures.append(_end(facts["final_error_m"], allowed.final))
    causes = [figure.miss for figure in figures if figure.share > 1.0]
    worst = max(figures, key=lambda figure: figure.share)
    falls = allowed.lands and not facts["landed"]
    if falls:
        causes.insert(0, facts["fault"] or "does not land")
    if causes:
        share = math.inf if falls else worst.share
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
    height, limit = f"{abs(1e3 * error):.1f} mm", f"{1e3 * allowed:g} mm allowed"
    return _Figure(
        _share(error, allowed),
        f"apex {height} {'higher' if error >= 0 else 'lower'}, {limit}",
        f"reaches {height} {'above' if error >= 0 else 'below'} the planned apex ({limit})",
        _seen(error),
    )


def _touchdown(late: float, allowed: float) -> _Figure:
    text = f"{abs(1e3 * late):.1f} ms {'late' if late >= 0 else 'early'}"
    limit = f"{1e3 * allowed:g} ms allowed"
    share = _share(late, allowed)
    return _Figure(
        share, f"touchdown {text}, {limit}", f"touches down {text} ({limit})", _seen(late)
    )


def _end(error: float, allowed: float) -> _Figure:
    text, limit = f"{1e3 * error:.1f} mm", f"{1e3 * allowed:g} mm allowed"
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
