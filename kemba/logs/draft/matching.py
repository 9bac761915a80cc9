"""Which foreign column is which of ours: the assignment that agrees best with all names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kemba.logs.draft.words import ANGLES, Meaning, Names, unknown, without_sensors, words
from kemba.quantity import convert
from kemba.trajectory import Array

Meant = dict[str, str]


@dataclass(frozen=True)
class Target:
    """One of our columns.

    `means`: what a foreign name must say, group by group; only that a position is one may go
    unsaid. `may`: what it may say as well, one of several words; anything else in the
    same group speaks against it.
    """

    header: str
    means: Meant
    may: Meant = field(default_factory=dict)
    needed: bool = False

    @property
    def unit(self) -> str:
        """Our unit."""
        return self.header[self.header.index("[") + 1 : -1]

    @property
    def is_valve(self) -> bool:
        """Whether it is a command of 0 and 1."""
        return "valve/" in self.header

    @property
    def is_command(self) -> bool:
        """Whether what was asked for is what it holds."""
        return self.is_valve or self.header.endswith("hip/tau [N.m]")


def robot_targets(legs: Sequence[str]) -> list[Target]:
    """The columns of a robot's log."""
    body = {"part": "body"}
    place = {**body, "kind": "position"}
    found = [
        Target("body/x [m]", {"direction": "x"}, place, needed=True),
        Target("body/z [m]", {"direction": "z"}, place, needed=True),
        Target("body/pitch [rad]", {"direction": "pitch"}, place, needed=True),
        Target("body/vx [m.s-1]", {"direction": "x", "kind": "speed"}, body),
        Target("body/vz [m.s-1]", {"direction": "z", "kind": "speed"}, body),
        Target("body/ax [m.s-2]", {"direction": "x", "kind": "acceleration"}, body),
        Target("body/az [m.s-2]", {"direction": "z", "kind": "acceleration"}, body),
    ]
    for leg in legs:
        own, force = {"leg": leg} if len(legs) > 1 else {}, {"kind": "force"}
        found += [
            Target(f"{leg}/hip/q [rad]", {**own, "part": "hip", "kind": "position"}, needed=True),
            Target(f"{leg}/hip/tau [N.m]", {**own, "kind": "torque"}, {"part": "hip"}, needed=True),
            *_piston(f"{leg}/", own, {"part": "piston"}),
            Target(f"{leg}/foot/Fx [N]", {**own, "part": "foot", "direction": "x"}, force),
            Target(f"{leg}/foot/Fz [N]", {**own, "part": "foot", "direction": "z"}, force),
        ]
    return [*found, _supply()]


def bench_targets() -> list[Target]:
    """The columns of one piston on a rig."""
    speed = Target("piston/v [m.s-1]", {"kind": "speed"}, {"part": "piston", "direction": "x"})
    return [*_piston("", {}, {}, bench=True), speed, _supply()]


def rig_targets(logged: Mapping[str, str]) -> list[Target]:
    """The columns of a rig of the user's own: those that its model's logs must have, by unit."""
    if "axis/q" in logged:
        return drive_targets(logged["axis/q"] == "rad")
    if "piston/x" in logged:
        return [
            Target(t.header, t.means, t.may, True)
            for t in bench_targets()
            if t.header.split(" [")[0] in logged
        ]
    means = {"vessel/P": "pressure", "vessel/T": "temperature"}
    return [Target(f"{n} [{u}]", {"kind": means[n]}, needed=True) for n, u in logged.items()]


def drive_targets(rotary: bool) -> list[Target]:
    """The columns of a drive: one axis, a force or a torque."""
    may = {"part": "axis hip"}  # `motor` is a word for both
    if rotary:
        turning = {**may, "direction": "pitch"}
        return [
            Target("axis/q [rad]", {"kind": "position"}, turning, needed=True),
            Target("axis/tau [N.m]", {"kind": "torque"}, may, needed=True),
        ]
    return [
        Target("axis/q [m]", {"kind": "position"}, {**may, "direction": "x"}, needed=True),
        Target("axis/tau [N]", {"kind": "force"}, may, needed=True),
    ]


def _piston(path: str, own: Meant, part: Meant, bench: bool = False) -> list[Target]:
    may = {"part": "piston", "direction": "x"}
    found = [
        Target(f"{path}piston/x [m]", {**own, **part, "kind": "position"}, may, needed=True),
        Target(f"{path}piston/F [N]", {**own, **part, "kind": "force"}, {"part": "piston"}, bench),
    ]
    for side in ("extend", "retract"):
        valve = {**own, "part": "valve", "side": side}
        pressure = {**own, "kind": "pressure", "side": side}
        chamber = {"part": "piston"}
        found.append(Target(f"{path}valve/{side} [1]", valve, needed=True))
        found.append(Target(f"{path}chamber/{side}/P [Pa]", pressure, chamber))
    return found


def _supply() -> Target:
    return Target("supply/P [Pa]", {"part": "supply", "kind": "pressure"})


# Unit of a time, and the largest step in it that is usual: 50 Hz to 10 kHz.
STEP = (("s", 0.05), ("ms", 50.0), ("us", 5e4), ("ns", 5e7))
DAYS = ((29_221, 73_051), (723_181, 767_011), (2_444_239, 2_488_070))  # of 1980 to 2100
ABSOLUTE = 0.8e5  # Pa; a pressure that falls below it is counted from the atmosphere
ATMOSPHERE = "1.01325 bar"


def time_unit(values: Array) -> str:
    """The unit of a time column (n,) by the step between its rows; days by their number too."""
    steps = np.diff(values)
    step = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    dated = any(a < values[0] < b for a, b in DAYS)  # of spreadsheets, MATLAB or astronomers
    if dated and 0.0 < values[-1] - values[0] < 1.0:
        return "day"
    return next((unit for unit, largest in STEP if step <= largest), "ns")


def in_ours(values: Array, unit: str | None, ours: str) -> Array:
    """Values (n,) in our unit."""
    return convert(values, unit or ours, ours)


def gauge(values: Array, unit: str | None, air: bool | None = None) -> dict[str, Any]:
    """The offset of a pressure (n,) that is zero at the atmosphere: as its name says (`air`), or
    where it falls below that."""
    if air is not None:
        return {"offset": ATMOSPHERE} if air else {}
    low = float(np.nanmin(in_ours(values, unit, "Pa"), initial=np.inf))
    return {"offset": ATMOSPHERE} if low < ABSOLUTE else {}


def valve_level(values: Array) -> float | None:
    """Half way between the two levels of a valve (n,); None where they are 0 and 1."""
    finite = values[np.isfinite(values)]
    if not len(finite) or set(np.unique(finite)) <= {0.0, 1.0}:
        return None
    return float(f"{(finite.min() + finite.max()) / 2:.3g}")


def two_levels(values: Array) -> bool:
    """Whether nearly all values (n,) lie at the ends of their range, as those of a valve do."""
    finite = values[np.isfinite(values)]
    if len(finite) < 2 or np.ptp(finite) == 0:
        return len(finite) > 0
    share = (finite - finite.min()) / np.ptp(finite)
    return bool(np.mean((share < 0.1) | (share > 0.9)) > 0.98)


# Scores of a name are shares of what it must say; the rest only breaks ties between columns.
NOTHING = -1.0  # of a name that says something else
ENOUGH = 0.6  # two of three words are enough, half not
SAID_TOO = 0.1  # for a name that also says what it may
UNRELATED = 0.3  # doubt by a word about something else, as the `a` of `valve_a`
ASKED_FOR = 0.3  # of what was desired or commanded where a measured column is wanted, or inversely
STRANGER = 0.03  # for each word that says nothing, up to three
SURE = 0.02  # a change of the whole assignment that costs less is as good


@dataclass(frozen=True)
class Assigned:
    """Our header -> foreign column, and headers for which several fit as well."""

    pairs: dict[str, str]
    ties: dict[str, tuple[str, ...]]


def assigned(names: Names, values: Mapping[str, Array], targets: Sequence[Target]) -> Assigned:
    """The assignment of the largest sum of scores; each column (n,) is used once.

    Columns with a unit of another dimension are no candidates. A target whose best column can be
    exchanged for another, of other values, at no cost is a tie, and is not assigned.
    """
    columns = list(values)
    scores = np.full((len(targets), len(columns)), NOTHING)
    for j, name in enumerate(columns):
        bare, unit = names.bare(name), names.unit(name)
        plain = without_sensors(bare)
        strangers = min(unknown(plain, names.legs) + (plain != bare), 3)
        whole, short = names.says(name), names.says(name, sensors=False)
        for i, target in enumerate(targets):
            if name in names.switches and not target.is_valve:
                continue
            if target.unit == "m" and unit is None and ANGLES & {*words(bare)}:
                continue
            if fits(target, unit, values[name]):
                score = agreement(by_unit(whole, target, unit), target)
                other = agreement(by_unit(short, target, unit), target)
                if NOTHING < score < other + UNRELATED:  # what is left says as much
                    score = other
                scores[i, j] = score - STRANGER * strangers if score > NOTHING else NOTHING
    for i, target in enumerate(targets):
        if not {"leg", "side"} & {*target.means, *target.may}:
            for alike in _siblings(names, columns):  # a letter or number makes none the better one
                scores[i, alike] = scores[i, alike].max()
    scores[scores < ENOUGH] = NOTHING
    total, best = _best(scores)
    pairs: dict[str, str] = {}
    ties: dict[str, tuple[str, ...]] = {}
    for i, j in best.items():
        without = scores.copy()
        without[i, j] = NOTHING
        other, changed = _best(without)
        k = changed.get(i)
        same = k is not None and np.array_equal(
            values[columns[j]], values[columns[k]], equal_nan=True
        )
        if k is not None and total - other < SURE and not same:
            ties[targets[i].header] = (columns[j], columns[k])
        else:
            pairs[targets[i].header] = columns[j]
    return Assigned(pairs, ties)


def _best(scores: np.ndarray[Any, Any]) -> tuple[float, dict[int, int]]:
    """The largest sum of scores, and the column (value) of each row (key) in it."""
    from scipy.optimize import linear_sum_assignment

    rows, chosen = linear_sum_assignment(np.maximum(scores, 0.0), maximize=True)
    pairs = zip(rows.tolist(), chosen.tolist(), strict=True)
    found = {i: j for i, j in pairs if scores[i, j] > 0}
    return float(sum(scores[i, j] for i, j in found.items())), found


def fits(target: Target, unit: str | None, values: Array) -> bool:
    """Whether a column's unit and values (n,) can be those of a target."""
    return two_levels(values) if target.is_valve else converts(unit, target.unit)


def converts(unit: str | None, ours: str) -> bool:
    """Whether what has this unit can be in ours; what has none may be."""
    try:
        convert(1.0, unit or ours, ours)
    except ValueError:
        return False
    return True


def _siblings(names: Names, columns: Sequence[str]) -> list[list[int]]:
    """Columns of one unit that only a last letter or number tells apart: `x_a [m]`, `x_b [m]`."""
    found: dict[tuple[str, ...], list[int]] = {}
    for j, name in enumerate(columns):
        *stem, last = words(names.bare(name)) or [""]
        if len(last) == 1 and last not in "xyz" and stem:
            found.setdefault((*stem, names.unit(name) or ""), []).append(j)
    return [alike for alike in found.values() if len(alike) > 1]


def by_unit(says: Meaning, target: Target, unit: str | None) -> Meaning:
    """What a name says where its `unit` is that of `target`: no other kind of quantity than the
    unit's, as by the `F` of `cyl_F [mm]`; this kind also where the name says of what it is. A
    length is no pitch, as by the `R` of `cyl_R [mm]`."""
    kind = target.means.get("kind") or target.may.get("kind")
    if unit is None or kind is None or target.is_valve or says.get("kind") == {"other"}:
        return says
    left = {group: found for group, found in says.items() if group != "kind"}
    if target.unit != "rad" and left.get("direction") == {"pitch"}:
        del left["direction"]
    part = target.means.get("part")
    turns = part == "hip" and target.unit == "rad" and "leg" in says and "direction" not in says
    if turns and "part" not in says:  # of a leg, the hip alone has an angle
        left["part"] = {"hip"}
    told = kind in says.get("kind", ()) or part is None or part in left.get("part", ())
    return {**left, "kind": {kind}} if told else left


def agreement(says: Meaning, target: Target) -> float:
    """How well a name fits a target: at most about 1, `NOTHING` where it says something else or
    leaves unsaid what it must say."""
    score = 0.0
    for group, wanted in target.means.items():
        if group not in says:
            if group == "kind" and wanted == "position" and len(target.means) > 1:
                continue
            return NOTHING
        if wanted not in says[group]:
            return NOTHING
        score += len(says[group]) ** -0.5
    score /= len(target.means)
    for group, found in says.items():
        if group in target.may:
            if not found & {*target.may[group].split()}:
                return NOTHING
            score += SAID_TOO * (target.may[group] != "position")
        elif group not in target.means:
            score -= UNRELATED * (group in ("kind", "leg", "part"))
    other = "measured" if target.is_command else "desired"
    if other in says.get("role", ()):
        score -= ASKED_FOR
    return score
