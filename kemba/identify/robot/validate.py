"""Robot logs that contradict themselves or any model: commands mixed up, clocks apart.

What a command does shows in the motion only: each mistake about commands is judged by the filter's
residual of the whole log along the same measured motion.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations

import numpy as np
from scipy.optimize import lsq_linear

from kemba.errors import KembaError
from kemba.identify.infer.windows import rms
from kemba.identify.problem.problem import Array, Flags, Rows
from kemba.identify.robot.batch import Batch, ResampledLog
from kemba.identify.robot.mix_ups import (
    SAME,
    Left,
    command_mix_ups,
    corrected,
    in_flight,
    slight,
    without_zeros,
)
from kemba.identify.robot.physics import Physics
from kemba.identify.robot.state import LinearisedState

HINT = "correct it in a column map (--map)"
BETTER = 2.0  # factor by which a log must err less without a mistake about its commands
WHOLE = 1.2  # what the model leaves of a flight whose columns are right: zeros leave more
NOISE = 0.75  # what it leaves of a log of a model that is complete
TURNED, SURE = -0.25, 3.0  # gain of torques that are turned: missing effects leave 0.5; in sigmas
SLIGHT = 0.1  # share of the error with it that tells nothing: the motion was smoothed with it


def mixed_commands(
    state: LinearisedState, rows: Rows, r: Array, errs: Left
) -> Iterator[KembaError]:
    """The mistake about commands, or two of them, without which the model as it is leaves much less
    than the residual r (n,), run by run, with all that leave as little; of a flight, in which feet
    tell nothing, about any column: `errs` tells what the model leaves of another log."""
    physics, logs = state.physics, state.batch.resampled
    before, found = [rms(r[rows.run == i]) for i in range(len(logs))], False
    if max(before) < BETTER * NOISE:
        return
    for some in (1, 2):
        left = {}
        for mistakes in combinations(command_mix_ups(physics.legs), some):
            if some == 1 or not mistakes[0].about & mistakes[1].about:
                right = [corrected(log, physics, mistakes) for log in logs]
                left[" and ".join(m.text for m in mistakes)] = state.commanded(Batch(tuple(right)))
        for i, log in enumerate(logs):
            own = rows.run == i
            after = {text: rms(other[own]) for text, other in left.items()}
            if some == 1:
                known = without_zeros(physics.legs, physics.mechanism.stroke)
                known = known if in_flight(physics, log) else []
                told = {m.text: float(errs(corrected(log, physics, [m]))[0]) for m in known}
                after |= {text: error for text, error in told.items() if error < WHOLE}
            best = min(after, key=after.__getitem__)
            power = _power(physics.channels, left.get(best, 0.0 * r), rows, own)
            if after[best] * BETTER < before[i] and max(power.values()) < ABSURD:
                most, found = np.hypot(after[best], SLIGHT * before[i]), True
                said = "; or ".join(text for text, error in after.items() if error <= most)
                what = f"the log errs by {before[i]:.1f} times its noise, and by {after[best]:.1f}"
                yield KembaError(log.name, said, f"{what} times then", HINT)
        if found:
            return


def turned_torques(state: LinearisedState, rows: Rows, r: Array) -> Iterator[KembaError]:
    """Hip torques from whose opposite the motion follows, run by run: the residual r (n,) is least
    at a negative gain of theirs. That tells what moves a jump by too little for `BETTER`."""
    physics, logs = state.physics, state.batch.resampled
    left = {
        m: state.commanded(Batch(tuple(corrected(log, physics, [m]) for log in logs)))
        for m in command_mix_ups(physics.legs)
        if all(name.endswith("hip/tau") for name in m.about)
    }
    legs = [other for m, other in left.items() if len(m.about) == 1]
    share = 0.5 * (np.stack(legs, axis=1) - r[:, None])
    for i, log in enumerate(logs):
        own = rows.run == i
        d, before = share[own], rms(r[own])
        gain = 1.0 - np.linalg.lstsq(d, -r[own], rcond=None)[0]
        spread = before * np.sqrt(np.diag(np.linalg.pinv(d.T @ d)))
        if np.any(gain + SURE * spread < TURNED):
            after = {m.text: rms(other[own]) for m, other in left.items()}
            least = min(after.values())
            most = np.hypot(least, SLIGHT * before)
            said = "; or ".join(text for text, error in after.items() if error <= most)
            what = f"the log errs by {before:.3g} times its noise, and by {least:.3g} times then"
            yield KembaError(log.name, said, what, HINT)


def slightly_mixed_up(
    physics: Physics, logs: Sequence[ResampledLog], left: Left
) -> Iterator[KembaError]:
    """Mistakes that move feet by millimetres, of each log: those without which the model leaves
    little, and less than with them. A robot that leans or sinks moves in another way."""
    as_read, known = left(*logs), slight(physics.legs)
    after = {m.text: left(*(corrected(log, physics, [m]) for log in logs)) for m in known}
    for i, log in enumerate(logs):
        told = {text: float(error[i]) for text, error in after.items()}
        least = min(told.values())
        if SAME * least < as_read[i] and least < BETTER:
            rivals = command_mix_ups(physics.legs)
            told |= {m.text: float(left(corrected(log, physics, [m]))[0]) for m in rivals}
            least = min(told.values())
            said = "; or ".join(text for text, error in told.items() if error <= SAME * least)
            what = (
                f"the log errs by {as_read[i]:.3g} times its noise, and by {least:.3g} times then"
            )
            yield KembaError(log.name, said, what, HINT)


# When robot logs contradict themselves or any model.
DEEP = 0.04  # depth of a foot below the ground that no sensor's fault makes [m]
OFTEN = 0.03  # share of the rows in which it must be so deep
ABSURD = 15.0  # rms one-step error, in sigmas, that no missing effect makes
FAULTY = 4.0  # largest fault of a sensor, in sizes


def contradictions(
    state: LinearisedState, rows: Rows, r: Array, sensor_columns: Callable[[], Array]
) -> Iterator[KembaError]:
    """What cannot be, run by run.

    `rows` and `r` (n,): the residual of the model as it is. `sensor_columns`: gives the columns
    (n, k) of all sensor faults per size; it is called only where a residual is too large.
    """
    forgiven: Array | None = None
    for i, log in enumerate(state.batch.resampled):
        sunk = list(_sunk(state, i))
        yield from sunk
        own = rows.run == i
        power = _power(state.physics.channels, r, rows, own)
        if max(power.values(), default=0.0) > ABSURD:
            forgiven = _forgiven(r, sensor_columns()) if forgiven is None else forgiven
            power = _power(state.physics.channels, forgiven, rows, own)
        worst = max(power, key=power.__getitem__, default="")
        if worst and power[worst] > ABSURD and not sunk:
            what = f"{worst} is off by {power[worst]:.0f} times its noise from one row to the next"
            hint = "are columns swapped, a sign turned, or clocks apart? or does a part swing that "
            hint += "the model holds rigid, such as the boom?"
            yield KembaError(
                log.name, what, "motion that follows from the commands was expected", hint
            )


def _sunk(state: LinearisedState, run: int) -> Iterator[KembaError]:
    """Feet that would be far below the ground for long."""
    legs, log = state.physics.legs, state.batch.resampled[run]
    ground = state.physics.mechanism.scene.ground
    feet = state.motion.places[: len(log.time), run, : 2 * len(legs)]
    for i, leg in enumerate(legs):
        x, distance = feet[:, 2 * i], feet[:, 2 * i + 1]
        depth = ground.depth(x, ground.height(x) + distance / ground.normal(x)[1])
        if np.mean(depth > DEEP) > OFTEN:
            at = int(np.argmax(depth))
            far = f"{1e3 * depth[at]:.0f} mm below the ground at {log.time[at]:.3f} s"
            what = f"the {leg} foot would be {far}"
            angles = f"body/pitch, {leg}/hip/q or {leg}/piston/x"
            hint = f"is a sign, a zero or a unit of body/z, {angles} wrong, or are columns swapped?"
            yield KembaError(log.name, what, "a foot on or above it was expected", hint)


def _power(channels: Sequence[str], r: Array, rows: Rows, own: Flags) -> dict[str, float]:
    """Root mean square of the residual by channel, over the rows `own` (n,)."""
    found = {}
    for k, channel in enumerate(channels):
        at = own & (rows.channel == k)
        if at.any():
            found[channel] = rms(r[at])
    return found


def _forgiven(r: Array, columns: Array) -> Array:
    """The residual (n,) less what sensors' faults, `columns` (n, k) per size, explain."""
    gram = columns.T @ columns + 1e-9 * np.eye(columns.shape[1])
    lower = np.linalg.cholesky(gram)
    wanted = np.linalg.solve(lower, -columns.T @ r)
    found = lsq_linear(lower.T, wanted, bounds=(-FAULTY, FAULTY))
    return np.asarray(r + columns @ found.x)
