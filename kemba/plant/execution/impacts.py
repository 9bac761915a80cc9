"""The impacts of an executed plan, for its certificate."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from kemba.model import Model
from kemba.model.impact import felt
from kemba.plant.simulation.record import Impact

SLOW = 0.01  # m/s; slower ones are no news
OBSTACLES = {
    "contact:gap": "foot on the ground",
    "end_stop:retracted": "piston at its retracted stop",
    "end_stop:extended": "piston at its extended stop",
}


def told(model: Model, impacts: Iterable[Impact]) -> list[dict[str, Any]]:
    """Every impact faster than 1 cm/s: when, of what, how fast, and the energy lost.

    What hits at the same instant is one impact, with the speed of the fastest. Pistons at a stop
    count by how fast the distance from hip to foot changes.
    """
    found = []
    for impact in impacts:
        each = zip(impact.labels, impact.speeds, strict=True)
        speed = max((felt(model.mechanism, label) * rate for label, rate in each), default=0.0)
        if speed >= SLOW:
            what = " and ".join(_name(label) for label in impact.labels)
            facts = {"time_s": impact.time, "what": what, "speed_m_s": speed}
            found.append({**facts, "energy_J": impact.lost})
    return found


def _name(label: str) -> str:
    """A pair in words: `front/contact:gap` is the front foot on the ground."""
    leg, _, pair = label.rpartition("/")
    return f"{leg} {OBSTACLES.get(pair, pair)}".strip()
