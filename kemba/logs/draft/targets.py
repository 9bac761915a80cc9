"""The columns that a log may have, and what the name of each must mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

Meaning = dict[str, str]


@dataclass(frozen=True)
class Target:
    """One of our columns.

    `means`: what a foreign name must say, group by group; only that a position is one may go
    unsaid. `may`: what it may say as well; anything else in the same group speaks against it.
    """

    header: str
    means: Meaning
    may: Meaning = field(default_factory=dict)
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
    may = {"part": "axis"}
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


def _piston(path: str, own: Meaning, part: Meaning, bench: bool = False) -> list[Target]:
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
