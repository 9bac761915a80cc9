"""Logs that contradict themselves or any model: columns mixed up, signs turned, clocks apart."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import lsq_linear

from kemba.errors import KembaError
from kemba.identify.evidence.problem import Array, Flags, Rows

if TYPE_CHECKING:
    from kemba.identify.robot.problem import RobotProblem

DEEP, OFTEN = (
    -0.04,
    0.03,
)  # m below the ground, in this share of the rows: no sensor fault is so large
ABSURD = 15.0  # one-step errors in units of noise, rms, that no missing effect makes
FAULTY = 4.0  # sizes that a sensor's fault may have and still be one


def contradictions(problem: RobotProblem) -> Iterator[KembaError]:
    """What cannot be, run by run."""
    legs = problem.physics.legs
    rows, r = problem.rows(), problem.residual({})
    forgiven: Array | None = None
    for i, track in enumerate(problem.batch.resampled):
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
        power = _power(problem, r, rows, own)
        if max(power.values(), default=0.0) > ABSURD:
            forgiven = _forgiven(problem, r) if forgiven is None else forgiven
            power = _power(problem, forgiven, rows, own)
        worst = max(power, key=power.__getitem__, default="")
        if worst and power[worst] > ABSURD and not sunk:
            yield KembaError(
                track.name,
                f"{worst} moves as no robot would: {power[worst]:.0f} times its noise off per row",
                "motion that follows from the commands was expected",
                "are columns swapped, a sign turned, or clocks apart?",
            )


def _power(problem: RobotProblem, r: Array, rows: Rows, own: Flags) -> dict[str, float]:
    """Root mean square of the residual by channel."""
    found = {}
    for k, channel in enumerate(problem.physics.channels):
        at = own & (rows.channel == k)
        if at.any():
            found[channel] = float(np.sqrt(np.mean(r[at] ** 2)))
    return found


def _forgiven(problem: RobotProblem, r: Array) -> Array:
    """The residual less what faults of sensors can explain: these are to be found, not refused."""
    faults = [c for c in problem.candidates.values() if c.sensor]
    jacobian = problem.jacobian({}, [c.key for c in faults])
    jacobian *= [c.lead.size for c in faults]
    gram = jacobian.T @ jacobian + 1e-9 * np.eye(len(faults))
    lower = np.linalg.cholesky(gram)
    wanted = np.linalg.solve(lower, -jacobian.T @ r)
    found = lsq_linear(lower.T, wanted, bounds=(-FAULTY, FAULTY))
    return np.asarray(r + jacobian @ found.x)
