"""One log of a cylinder or a drive, prepared for the balance of forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from kemba.errors import KembaError
from kemba.identify.logs.gate import BadData
from kemba.identify.problem.types import Array
from kemba.identify.rigs.filtering import Filtered, filtered
from kemba.model.model import Model
from kemba.trajectory import Trajectory

ANSWER = {"cylinder": "piston/F", "drive": "axis/tau"}
PLACE = {"cylinder": "piston/x", "drive": "axis/q"}


class RigLogSettings:
    """Which rows of a rig's log a friction is known in."""

    # travel after a turn within which friction is in doubt, over that in which seals stretch: that
    # travel is taken to be known to a factor of two
    doubted = 2.0
    # time around a turn that the filter mixes into a row, over the filter's width: three sigmas of
    # the Gaussian
    blurred = 3.0


@dataclass(frozen=True)
class RigLog:
    """The filtered channels of one log; `doubt` (k,): share of a friction's size by which it is
    uncertain at each judged row, because the sign of the rate is."""

    name: str
    channels: Filtered
    doubt: Array

    @property
    def time(self) -> Array:
        """Times (k,) [s] of the judged rows."""
        return np.asarray(self.channels.time[self.channels.rows])

    @property
    def speed(self) -> Array:
        """Rate (k,) at the judged rows."""
        return np.asarray(self.channels.v[self.channels.rows])


def prepare(log: Trajectory, model: Model) -> RigLog:
    """A log of `model`'s rig. Raises BadData where its stretches without gaps are too short."""
    mechanism = model.mechanism
    place = PLACE[mechanism.rig]
    names = [name for name in mechanism.logged if name != place]
    given = log.meta.get("noise", {})
    known = {("" if name == place else name): sigma for name, sigma in given.items()}
    heavy = _inertia(model)
    turn = 2 * np.pi if mechanism.logged[place] == "rad" else np.inf
    others = {n: log[n] for n in names}
    found = filtered(log.time, log[place], others, mechanism.sign_speed, heavy, known, turn)
    name = str(log.meta.get("name", "log"))
    if not len(found.rows):
        what = "has no stretch without gaps that is long enough for a rate"
        hint = "log faster, or longer without a break"
        raise BadData([KembaError(str(log.meta.get("path", name)), what, hint=hint)])
    v, a = found.v[found.rows], found.a[found.rows]
    blur = 2.0 * np.hypot(found.v_sigma, a * found.width)
    high, low = (np.tanh((v + side * blur) / mechanism.sign_speed) for side in (1.0, -1.0))
    doubt = 0.5 * (high - low)
    if "measured_chambers.travel" in model.parameters:
        travel = model.parameters["measured_chambers.travel"][1]
        settings, step = RigLogSettings, float(np.median(np.diff(found.time)))
        held = 1.0 - np.abs(_stretch(found, settings.doubted * travel))
        reach = 2 * int(np.ceil(settings.blurred * found.width / step)) + 1
        doubt = np.maximum(doubt, maximum_filter1d(held, reach)[found.rows])
    return RigLog(name, found, doubt)


def _stretch(log: Filtered, travel: float) -> Array:
    """Stretch (n,) of contacts that slide after some travel; 0 at the begin of every stretch of the
    log, for what was before is not known."""
    z, found = 0.0, np.zeros(len(log.q))
    begins = set(log.begins.tolist())
    way = np.append(0.0, np.diff(log.q))
    for i, step in enumerate(way.tolist()):
        if i in begins:
            z = 0.0
            continue
        side = 1.0 if step > 0 else -1.0
        z = side + (z - side) * float(np.exp(-abs(step) / travel))
        found[i] = z
    return found


def _inertia(model: Model) -> float:
    """Inertia of a drive, 0 of a cylinder: its rod is taken to have none."""
    if model.mechanism.rig != "drive":
        return 0.0
    return float(model.parameters["drive_axis.J"][1])
