"""Logs that contradict themselves or any model: columns mixed up, signs turned, clocks apart."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from kemba.errors import KembaError

if TYPE_CHECKING:
    from kemba.identify.robot.problem import RobotProblem

DEEP, OFTEN = (
    -0.04,
    0.03,
)  # m below the ground, in this share of the rows: no sensor fault is so large
ABSURD = 15.0  # one-step errors in units of noise, rms, that no missing effect makes


def contradictions(problem: RobotProblem) -> Iterator[KembaError]:
    """What cannot be, run by run."""
    legs = problem.physics.legs
    rows, r = problem.rows(), problem.residual({})
    for i, track in enumerate(problem.batch.tracks):
        n = len(track.time)
        sunk = False
        for leg, height in zip(
            legs, problem.point.places[:n, i, 1 : 2 * len(legs) : 2].T, strict=True
        ):
            deep = height < DEEP
            if deep.mean() > OFTEN:
                sunk = True
                at = int(np.argmin(height))
                yield KembaError(
                    track.name,
                    f"the {leg} foot would be {-1e3 * height[at]:.0f} mm below the ground "
                    f"at {track.time[at]:.3f} s",
                    "a foot on or above it was expected",
                    f"is a sign of body/pitch or {leg}/hip/q turned, or are columns swapped?",
                )
        own = rows.run == i
        power = {
            c: float(np.sqrt(np.mean(r[own & (rows.channel == k)] ** 2)))
            for k, c in enumerate(problem.physics.channels)
            if (own & (rows.channel == k)).any()
        }
        worst = max(power, key=power.__getitem__, default="")
        if worst and power[worst] > ABSURD and not sunk:
            yield KembaError(
                track.name,
                f"{worst} moves as no robot would: {power[worst]:.0f} times its noise off per row",
                "motion that follows from the commands was expected",
                "are columns swapped, a sign turned, or clocks apart?",
            )
