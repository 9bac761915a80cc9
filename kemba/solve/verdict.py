"""The verdict on a plan's executions: whether each of them keeps to what the task allows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from kemba.errors import enumerated
from kemba.events import LASTS, ORDINALS
from kemba.ocp.certificate.asked import MeasuredRequirement
from kemba.ocp.task.task import Tolerances
from kemba.plant.replay import Replay

# the executions of a plan, by their keys in the certificate, in words
EXECUTIONS = {
    "replay": "re-simulation",
    "table_replay": "re-simulation of controller.csv",
    "plant_replay": "simulated robot",
}
SLOWEST = 0.025  # s; touchdown of a plant is allowed to err by no more
ARM = 0.2  # m; half the distance between the hips
SOON = 0.1  # s; a flight between two strides takes about as long


@dataclass(frozen=True)
class Allowed:
    """How far an execution may miss: apexes and end [m], touchdowns [s]. `final` holds for the
    place ahead at each apex too, and tells what an end in the air or moving may miss."""

    apex: float
    touchdown: float
    final: float

    @property
    def together(self) -> float:
        """Events [s] that are planned nearer to each other have no order: each may err by half."""
        return max(LASTS, 2.0 * self.touchdown)

    @property
    def pitch(self) -> float:
        """Pitch [rad] that moves the hips by as much as the place may be off."""
        return self.final / ARM

    @property
    def velocity(self) -> float:
        """Velocity [m/s] that moves the body by as much within `SOON`."""
        return self.final / SOON


@dataclass(frozen=True)
class Verdict:
    """Whether an execution is near enough to its plan, with a sentence.

    `share`: its largest error in units of what is allowed; infinite where it falls.
    """

    good: bool
    sentence: str
    share: float = math.inf


def allowances(tolerances: Tolerances, landing_speed: float) -> dict[str, Allowed]:
    """What each execution may miss, by its key in the certificate.

    `landing_speed` [m/s] of the plan: what the plant's apex may err makes its touchdown early or
    late by that length over this speed.
    """
    t, usual = tolerances, min(SLOWEST, tolerances.plant_apex / max(landing_speed, 1e-9))
    late = usual if t.plant_touchdown is None else t.plant_touchdown
    return {
        "replay": Allowed(t.apex, t.touchdown, t.final),
        "table_replay": Allowed(t.table_apex, t.table_touchdown, t.table_final),
        "plant_replay": Allowed(t.plant_apex, late, t.plant_final),
    }


def judge(
    who: str,
    done: Replay | None,
    allowed: Allowed,
    asked: Sequence[MeasuredRequirement] = (),
    same_model: bool = True,
) -> Verdict:
    """An execution against what is allowed, and the requirements as measured on it.

    The sentence of a good one gives the figure nearest to its limit, if it is not zero in the
    digits shown: `re-simulation matches the plan (apex 0.3 mm lower, 2 mm allowed)`. That of a bad
    one gives each cause: `the simulated robot tips over`. Without an execution nothing could be
    executed, which is no confirmation. Planned events must come in their order; more events than
    planned are a fault on the plan's own model, and told of another, on which feet that hardly
    carry in the plan may leave the ground.
    """
    if done is None:
        return Verdict(False, f"the {who} cannot be started")
    figures = list(_figures(done, allowed))
    causes = [figure.miss for figure in figures if figure.share > 1.0]
    worst = max(figures, key=lambda figure: figure.share)
    missed = max((m for m in asked if not m.met), key=lambda m: m.miss / m.allowed, default=None)
    events = done.compared
    fault = done.fault or (events.missed(allowed.together) or (same_model and events.unplanned))
    if fault:
        causes.insert(0, fault)
    elif missed is not None and not causes:
        causes.append(f"does not keep to what was asked: {missed.sentence}")
    if causes:
        beyond = missed.miss / missed.allowed if missed is not None and missed.allowed else 0.0
        share = math.inf if fault else max(worst.share, beyond)
        return Verdict(False, f"the {who} {enumerated(causes)}", share)
    seen = f" ({worst.match})" if worst.seen else ""
    more = f", but it {events.unplanned}" if events.unplanned else ""
    return Verdict(True, f"{who} matches the plan{seen}{more}", worst.share)


def _figures(done: Replay, allowed: Allowed) -> Iterator[_Figure]:
    """Every error: of the flights' apexes and landings, and of the end."""
    flown, landings = done.compared.apexes, done.compared.landings(allowed.together)
    if not flown:
        yield _apex(done.apex_error_m, allowed.apex)
    for number, apex in enumerate(flown):
        which = f"{ORDINALS[number]} " if 1 < len(flown) <= len(ORDINALS) else ""
        yield _apex(apex.height_error_m or 0.0, allowed.apex, which)
        x, pitch = apex.x_error_m or 0.0, apex.pitch_error_rad or 0.0
        way = "ahead" if x >= 0 else "behind"
        yield _figure(x, allowed.final, "mm", f"{which}apex {{}} {way}",
                      f"is {{}} {way} at the {which}apex")  # fmt: skip
        yield _figure(pitch, allowed.pitch, "rad", f"{which}apex turned by {{}}",
                      f"is turned by {{}} at the {which}apex")  # fmt: skip
    for landing in landings:
        side = "late" if landing.late >= 0 else "early"
        feet = f"{enumerated(landing.legs)} {'foot' if len(landing.legs) == 1 else 'feet'}"
        which = f" with the {feet}" if len(landings) > 1 else ""
        yield _figure(landing.late, allowed.touchdown, "ms", f"touchdown{which} {{}} {side}",
                      f"touches down{which} {{}} {side}")  # fmt: skip
    yield _figure(done.final_error_m, allowed.final, "mm", "end {} away", "ends {} from the plan")
    if (end := done.end) is not None:
        rate = allowed.velocity / ARM
        yield _figure(end.pitch_rad, allowed.pitch, "rad", "end turned by {}", "ends turned by {}")
        yield _figure(end.velocity_m_s, allowed.velocity, "m/s", "velocity at the end off by {}",
                      "ends with a velocity {} off the plan's")  # fmt: skip
        yield _figure(end.rate_rad_s, rate, "rad/s", "pitch rate at the end off by {}",
                      "ends with a pitch rate {} off the plan's")  # fmt: skip


@dataclass(frozen=True)
class _Figure:
    """One error: its `share` of what is allowed [1], and in words when it is within or beyond.

    `seen`: whether it is not zero in the digits of these words.
    """

    share: float
    match: str
    miss: str
    seen: bool


def _apex(error: float, allowed: float, which: str = "") -> _Figure:
    up = error >= 0
    return _figure(
        error, allowed, "mm", f"{which}apex {{}} {'higher' if up else 'lower'}",
        f"reaches {{}} {'above' if up else 'below'} the {which}planned apex",
    )  # fmt: skip


def _figure(error: float, allowed: float, unit: str, match: str, miss: str) -> _Figure:
    """An error in SI, shown in `unit`, which replaces the braces in `match` and `miss`."""
    factor, digits = (1e3, 1) if unit in ("mm", "ms") else (1.0, 2)
    text = f"{abs(factor * error):.{digits}f}"
    limit = f"{factor * allowed:.3g} {unit} allowed"
    match, miss = (words.format(f"{text} {unit}") for words in (match, miss))
    nothing = math.inf if error else 0.0  # as a share where nothing is allowed
    share = abs(error) / allowed if allowed > 0.0 else nothing
    return _Figure(share, f"{match}, {limit}", f"{miss} ({limit})", float(text) != 0.0)
