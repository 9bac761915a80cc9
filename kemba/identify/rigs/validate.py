"""Mistakes in the columns of a rig's log, tried as whole hypotheses before anything is fitted."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.optimize import minimize_scalar, nnls

from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.errors import KembaError
from kemba.identify.bench.validate import END, REVERSED, SMALL, Texts, simplest
from kemba.identify.problem.types import Array
from kemba.identify.rigs.rig_log import ANSWER, PLACE, RigLog
from kemba.model.model import Model

Gap = Callable[[RigLog], Array]  # the force of the model less that of the log, along a log
LEAST = 0.15  # zero [rad] from which it is a mistake, and no fault of a sensor
ZEROS = np.linspace(-np.pi, np.pi, 25)  # those that are tried first [rad]


def contradictions(log: RigLog, model: Model, sigma: Array, gap: Gap) -> list[KembaError]:
    """What must be wrong with a log's columns, if anything; `sigma` (k,) of the gap."""
    force = log.channels.others[ANSWER[model.mechanism.rig]][log.channels.rows]
    side, still = 1.0 if model.mechanism.bore else -1.0, model.mechanism.sign_speed
    size = float(np.linalg.norm(force / sigma))

    def left(trial: RigLog) -> float:
        """What a friction of any size, which every rig may have, leaves."""
        friction = side * np.tanh(trial.speed / still)
        return float(nnls((friction / sigma)[:, None], gap(trial) / sigma)[1]) / size

    small = SMALL * np.sqrt(len(sigma)) / size
    if left(log) < small:
        return []
    trials = {texts: left(trial) for texts, trial in mix_ups(log, model, left)}
    said = "; or ".join(map(" and ".join, simplest(trials, small)))
    what = "the force answers the motion so much better then"
    return [KembaError(log.name, said, what, "correct it in a column map (--map)")] if said else []


def mix_ups(
    log: RigLog, model: Model, left: Callable[[RigLog], float]
) -> Iterator[tuple[Texts, RigLog]]:
    """What may be wrong with a log, and the log with that put right; `left` of one."""
    rig, bore, logged = model.mechanism.rig, model.mechanism.bore, model.mechanism.logged
    place, answer = PLACE[rig], ANSWER[rig]
    end = END if bore else f"{place} has the reversed sign"
    other = REVERSED if bore else f"{answer} has the reversed sign"
    pressures = list(_pressures({n: log.channels.others[n] for n in logged if n.endswith("/P")}))
    for sign, turned, (said, read) in product((1.0, -1.0), (1.0, -1.0), pressures):
        texts = (end,) * (sign < 0.0) + (other,) * (turned < 0.0) + said
        others = {**log.channels.others, answer: turned * log.channels.others[answer], **read}
        trial = _moved(log, sign, bore.stroke if bore and sign < 0.0 else 0.0, others)
        yield texts, trial
        if logged[place] == "rad":  # where it hangs straight down
            zero = _zero(trial, others, left)
            moved = f"{place} counts from another zero (`offset: {np.degrees(zero):+.1f} deg`)"
            if abs(zero) > LEAST:
                yield (*texts, moved), _moved(trial, 1.0, zero, others)


def _pressures(read: dict[str, Array]) -> Iterator[tuple[Texts, dict[str, Array]]]:
    """What may be wrong with pressures, and these without that."""
    swapped = dict(zip(read, reversed(read.values()), strict=True))
    swaps = {(): read, (" and ".join(read) + " are swapped",) * (len(read) > 1): swapped}
    groups = {tuple(read), *((name,) for name in read)} - {()}
    for said, columns in swaps.items():
        yield said, columns
        for names, zero in product(sorted(groups), (ATMOSPHERE, -ATMOSPHERE)):
            which = f"{' and '.join(names)} count{'s' * (len(names) == 1)} from another zero"
            moved = f"{which} (`offset: {zero:+.0f} Pa`, unless piston/F has a zero so far off)"
            yield (*said, moved), columns | {name: columns[name] + zero for name in names}


def _moved(log: RigLog, sign: float, zero: float, others: dict[str, Array]) -> RigLog:
    """A log whose position is sign * q + zero, with its other channels."""
    c, turned = log.channels, {n: sign * getattr(log.channels, n) for n in ("v", "a", "quick")}
    moved = {n: sign * getattr(c, n) + zero for n in ("q", "read")}
    return replace(log, channels=replace(c, others=others, **moved, **turned))


def _zero(log: RigLog, others: dict[str, Array], left: Callable[[RigLog], float]) -> float:
    """The zero [rad] after which least is left."""

    def error(zero: float) -> float:
        return left(_moved(log, 1.0, zero, others))

    near, step = min(ZEROS, key=error), ZEROS[1] - ZEROS[0]
    return float(minimize_scalar(error, bounds=(near - step, near + step), method="bounded").x)
