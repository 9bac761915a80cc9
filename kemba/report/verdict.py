"""The verdict on a plan: whether its executions keep what it promises."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kemba.ocp.task.task import Tolerances

Facts = Mapping[str, Any]


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
    """Whether an execution is near enough to its plan, and how it went in words."""

    good: bool
    sentence: str


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
    who = {"replay": "replay", "table_replay": "table", "plant_replay": "plant"}
    return {key: judge(who[key], facts, allowed[key]) for key, facts in executed.items()}


def judge(who: str, facts: Facts | None, allowed: Allowed) -> Verdict:
    """An execution against what is allowed: `replay reaches 3.2 mm below the plan (2 mm allowed)`.

    Without `facts` nothing could be executed, which is no confirmation.
    """
    if facts is None:
        return Verdict(False, f"but the {who} cannot be started")
    parts = [_apex(facts["apex_error_m"], allowed.apex)]
    if (late := facts["touchdown_error_s"]) is not None:
        parts.append(_touchdown(late, allowed.touchdown))
    if (final := facts["final_error_m"]) > (allowed.final or float("inf")):
        parts.append((False, f"ends {_length(final)} from the plan{_limit(allowed.final, 'm')}"))
    if allowed.lands:
        parts.append((facts["landed"], "lands" if facts["landed"] else "does not land"))
    good = all(within for within, _ in parts)
    *first, last = [text for _, text in parts]
    text = f"{', '.join(first)} and {last}" if first else last
    if allowed.lands and facts["fault"]:
        text += f" ({facts['fault']})"
    return Verdict(good, f"{'' if good else 'but the '}{who} {text}")


def _apex(error: float, allowed: float) -> tuple[bool, str]:
    within = abs(error) <= allowed
    text = f"reaches {_length(error)} {'above' if error >= 0 else 'below'} the plan"
    return within, text if within else text + _limit(allowed, "m")


def _touchdown(late: float, allowed: float | None) -> tuple[bool, str]:
    within = allowed is None or abs(late) <= allowed
    text = f"touches down {abs(1e3 * late):.1f} ms {'late' if late >= 0 else 'early'}"
    return within, text if within else text + _limit(allowed, "s")


def _length(error: float) -> str:
    return f"{abs(1e3 * error):.1f} mm"


def _limit(allowed: float | None, unit: str) -> str:
    return f" ({1e3 * (allowed or 0.0):g} m{unit} allowed)"
