"""What the words in a column's name may mean."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

# Of one group a column has one meaning. English, the usual short forms, and a little German.
WORDS: dict[str, dict[str, str]] = {
    "part": {
        "hip": "hip motor qdd huefte qm tm",
        "piston": "piston cylinder cyl knee rod actuator kolben zylinder zyl xp fp",
        "body": "body base torso trunk com boom imu",
        "foot": "foot toe grf ground",
        "valve": "valve valves sol solenoid ventil u ue ur cmd",
        "supply": "supply tank reservoir feed regulator line",
        "axis": "axis drive slide carriage",
    },
    "kind": {
        "position": "q x pos position angle theta enc encoder stroke travel displacement winkel "
        "weg laser qm xp",
        "torque": "tau torque trq effort moment drehmoment tm",
        "force": "f force load loadcell cell kraft transducer grf fp fx fy fz",
        "pressure": "p pressure press druck",
        "speed": "v vel velocity speed rate dx dy dz dq vx vz xd yd",
        "acceleration": "a acc accel acceleration ax az ddx ddy ddz",
    },
    "direction": {
        "x": "x horizontal forward vorschub vx ax fx dx ddx",
        "z": "z y height vertical hoehe altitude vz az fz fy dy dz ddy ddz",
        "pitch": "pitch tilt theta nick nickwinkel neigung r",
    },
    "side": {
        "extend": "extend ext extension ausfahren aus push out cap head ue 1 a",
        "retract": "retract ret retraction einfahren ein pull in rod ur 2 b",
    },
    "time": {"time": "t time timestamp stamp clock epoch elapsed zeit sec secs"},
    "rest": {"nanoseconds": "nanosec nanosecs nsec nsecs nanoseconds"},
}
LEG_WORDS = {
    "front": "front f fore fr vorn vorne vo",
    "rear": "rear back hind b r h hinten hi",
    "left": "left l links",
    "right": "right r rechts",
}
SPELT = {"degrees": "deg", "degree": "deg", "Grad": "deg", "grad": "deg", "°": "deg"}
UNITS = "ns us µs ms s min mm cm m in deg rad bar mbar kPa MPa Pa psi kN N Nm N.m mN.m mV V".split()
BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")
WORD = re.compile(r"[A-Z]?[a-zµ°]+|[A-Z]+(?![a-z])|\d+")
Meaning = dict[str, set[str]]


@dataclass(frozen=True)
class Names:
    """The names of a log's columns: the machine's legs, what headerless columns are called, units
    in a row below the header, and columns that say `on` and `off`."""

    legs: Sequence[str] = ()
    labels: Mapping[str, str] = field(default_factory=dict)
    below: Mapping[str, str] = field(default_factory=dict)
    switches: Collection[str] = ()

    def unit(self, name: str) -> str | None:
        """The unit that a column's name tells, else the row below the header."""
        return named_unit(self.labels.get(name, name))[1] or self.below.get(name)

    def says(self, name: str) -> Meaning:
        """What a column's name may mean: per group, the candidates of its words."""
        return meaning(named_unit(self.labels.get(name, name))[0], self.legs)


def named_unit(name: str) -> tuple[str, str | None]:
    """A column's name without its unit, and the unit: of `pos [mm]`, `pos (mm)` or `pos_mm`."""
    match = BRACKETED.match(name)
    if match:
        unit = match["unit"].strip()
        return match["name"], SPELT.get(unit, unit) or None
    head, mark, tail = name.rpartition("_")
    known = mark and head and (tail in UNITS or tail in SPELT)
    return (head, SPELT.get(tail, tail)) if known else (name, None)


def meaning(name: str, legs: Sequence[str]) -> Meaning:
    """What a name may mean: per group, the candidates that one of its words stands for."""
    words = [word.lower() for word in WORD.findall(name)]
    groups = {**WORDS, "leg": {leg: LEG_WORDS.get(leg, leg.lower()) for leg in legs}}
    found: Meaning = {}
    for group, entries in groups.items():
        hits = {entry for entry, known in entries.items() if set(words) & {*known.split(), entry}}
        if hits:
            found[group] = hits
    return found
