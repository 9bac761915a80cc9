"""Conditions of errors in words: of which quantity, in which phase, with which valves open."""

from math import degrees

from kemba.identify.compare.bins import ConditionBin
from kemba.units import short

BODY = {"body/x": "body position", "body/z": "body height", "body/pitch": "body pitch"}
OF_LEG = {
    "hip/q": "hip angle",
    "piston/x": "piston",
    "piston/F": "force on the rod",
    "chamber/extend/P": "pressure of the extend chamber",
    "chamber/retract/P": "pressure of the retract chamber",
    "foot/x": "foot position",
    "foot/z": "foot height",
    "stop": "end stop",
}
WHEN = {
    "stance2": "while two feet stand",
    "stance1": "while one foot stands",
    "impact": "while a foot hits the ground",
    "rest": "at rest",
    "moving": "while moving",
    "forward": "while moving forward",
    "back": "while moving back",
}
VALVES = {
    "00": "both valves are closed",
    "10": "the extend valve is open",
    "01": "the retract valve is open",
    "11": "both valves are open",
}
PLACES = {
    "in": ", the piston retracted",
    "mid": ", the piston in mid-stroke",
    "out": ", the piston extended",
}


def place_of(at: ConditionBin) -> str:
    """A condition: `body height while two feet stand and both valves are open`."""
    when, stroke = WHEN.get(at.phase, f"in {at.phase}"), PLACES.get(at.region, "")
    if not at.mode:
        return f"{quantity(at.channel)} {when}{stroke}"
    link = "and" if when.startswith("while") else "while"
    return f"{quantity(at.channel)} {when} {link} {VALVES.get(at.mode, VALVES['11'])}{stroke}"


def command(name: str) -> str:
    """A command in words: `front/valve/extend` is the front extend valve; others stay."""
    leg, valve, side = name.rpartition("valve/")
    if valve:
        return f"the {leg.replace('/', ' ')}{side} valve"
    return f"the {name.partition('/')[0]} hip torque" if name.endswith("/hip/tau") else name


def quantity(channel: str) -> str:
    """A channel in words: `front/piston/x` is the front piston; one without words stays."""
    if channel in BODY:
        return BODY[channel]
    leg, _, part = channel.partition("/")
    if channel in OF_LEG:
        return OF_LEG[channel]
    return f"{leg} {OF_LEG[part]}" if part in OF_LEG else channel


def off_by(header: str, error: float) -> str:
    """An error [SI] of a column in words and in a usual unit: `body height 19 mm`."""
    name, _, unit = header.rstrip("]").partition(" [")
    usual, factor = usual_unit(unit)
    return f"{quantity(name)} {short(factor * error)} {usual}"


def usual_unit(unit: str) -> tuple[str, float]:
    """The unit in which errors are told: mm, deg and bar for those of SI; and the factor to it."""
    better = {"m": ("mm", 1e3), "rad": ("deg", degrees(1.0)), "Pa": ("bar", 1e-5)}
    return better.get(unit, (unit, 1.0))


def owner(channel: str) -> str:
    """What a force acts on, as figures name it: `front rod`, `rear hip`, `body z`."""
    own = channel.replace("piston/x", "rod").replace("hip/q", "hip").replace("/", " ")
    return "rod" if channel == "piston/F" else own


def effort(channel: str, unit: str) -> str:
    """A missing effort in words: `force on the front rod`, `torque on the rear hip`."""
    kind = "torque" if unit == "N.m" else "force"
    leg, _, part = channel.partition("/")
    if leg == "body":
        return f"{kind} on the body, {part}"
    place = {"piston/x": "rod", "hip/q": "hip"}.get(part, "")
    return f"{kind} on the {leg} {place}" if place else f"{kind} at {channel}"
