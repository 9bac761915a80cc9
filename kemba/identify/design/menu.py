"""The standard tests of a rig, and which of them tells rivals apart best."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from kemba.identify.design.rivals import Rivals
from kemba.identify.design.separation import Separation, separation
from kemba.identify.design.virtual import VirtualBench, log_time
from kemba.plant.rigs import DynamometerRig, LockedRig, RandomRig, Rig


@dataclass(frozen=True)
class JudgedRig:
    """A rig, the evidence that its tests are expected to give, and the seconds of its logs."""

    rig: Rig
    evidence: Separation
    log_s: float

    @property
    def pace(self) -> float:
        """Expected evidence [nats] per second of log."""
        return self.evidence.least / self.log_s


def menu(stroke: float) -> list[Rig]:
    """Standard tests of one piston of this stroke [m]."""
    modes = ("extend", "retract", "both", "none")
    slow = DynamometerRig.model_validate(
        {"name": "slow_stroke", "speeds": {m: [0.02, 0.05] for m in modes}}
    )
    fast = DynamometerRig.model_validate(
        {"name": "dynamometer", "speeds": {m: [0.1, 0.3, 0.6, 1.0] for m in modes}}
    )
    both_ends = {"positions": [0.0, stroke / 2, stroke]}
    return [
        LockedRig.model_validate({"name": "locked_extend", "chamber": "extend", **both_ends}),
        LockedRig.model_validate({"name": "locked_retract", "chamber": "retract", **both_ends}),
        slow,
        fast,
        RandomRig.model_validate({"name": "random", "duration": 4.0}),
        RandomRig.model_validate({"name": "random_fast", "duration": 4.0, "speed": 1.2}),
    ]


def judged_menu(bench: VirtualBench, rivals: Rivals) -> Iterator[JudgedRig]:
    """Every standard test; none where a rig cannot show two of the rivals."""
    for rig in menu(bench.stroke):
        found = separation(bench.problem(rig), rivals)
        if found is None:
            return
        yield JudgedRig(rig, found, log_time(rig, bench.stroke))
