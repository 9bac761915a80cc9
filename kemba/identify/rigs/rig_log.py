"""One log of a cylinder or a drive, all its channels through one filter.

A balance of forces holds for filtered channels as it holds for the channels themselves, if each of
them goes through the same filter ("parallel filtering", M. Gautier, 1997). So the filter costs no
accuracy of an inertia, and a rate is the difference of the filtered position. What is no linear
function of the position, such as the weight of a pendulum, is filtered itself: sin(q) behind the
filter is not the sine of what is behind it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from kemba.errors import KembaError
from kemba.identify.logs.gate import BadData
from kemba.identify.problem.missing_force import dahl
from kemba.identify.problem.noise import difference_sigma, step_of
from kemba.identify.problem.problem import Array
from kemba.model.model import Model
from kemba.trajectory import Trajectory

# noise of value, rate, acceleration behind a Gaussian of s samples: c sigma / (step^k s^(k + 1/2))
GAIN = (0.5311, 0.3756, 0.4600)

# How the channels of a rig's log are filtered.
WIDTHS = (3, 4, 6, 8, 12, 16, 24, 32)  # widths (1 sigma) in samples that are tried
QUICK = (1, 2, *WIDTHS)  # the same for a rate of which only the sign is asked
# noise of the rate that is small enough, as a share of `sign_speed`: the sign of a rate is then
# certain
CREEP = 0.2
# noise of the inertia's force that is small enough, as a share of the force's spread
WEIGHT = 0.01
REACH = 4.0  # widths beyond which the Gaussian is cut off: 6e-5 of it is lost
GAP = 5.0  # rows farther apart than so many usual steps are a gap
FINEST = 5e-4  # smallest noise, as a share of a channel's range


@dataclass(frozen=True, eq=False)
class Filtered:
    """Channels on a regular grid, filtered; the grid has jumps where the log has gaps.

    `grid` [s], `q`, `v`, `a` (n,): position and its rates; `others` (n,) by name; `read` (n,): the
    position as it was read; `quick` (n,): its rate behind a filter only as wide as its sign needs,
    1 sigma `quick_width` [s]. `rows` (k,): indices of the rows that are judged, away from gaps.
    `q_sigma`, `a_sigma`: noise of the filtered position and its acceleration; `sigma`: noise of the
    others by name. `width` [s] of the filter. `begins` (m,): first index of every stretch without a
    gap.
    """

    grid: Array
    q: Array
    v: Array
    a: Array
    others: dict[str, Array]
    rows: np.ndarray
    q_sigma: float
    a_sigma: float
    sigma: dict[str, float]
    width: float
    begins: np.ndarray
    read: Array
    quick: Array
    quick_sigma: float
    quick_width: float

    def smoothed(self, values: Array) -> Array:
        """Values (n,) of the grid behind the filter of the channels."""
        width = self.width / float(np.median(np.diff(self.grid)))
        return np.concatenate([_smooth(y, width) for y in np.split(values, self.begins[1:])])


def filtered(
    time: Array,
    position: Array,
    others: Mapping[str, Array],
    creep: float,
    heavy: float = 0.0,
    known: Mapping[str, float] | None = None,
    turn: float = np.inf,
) -> Filtered | None:
    """The channels of one log, all through one filter; None where no stretch without gaps is long
    enough.

    The filter is the narrowest one behind which the rate is known well against `creep` [unit of
    the rate] and the force of the inertia `heavy` well against the other channels. `known`: noise
    (1 sigma) by name, "" for the position, which a sensor reads anew after each `turn`. Rows with a
    missing reading are left out.
    """
    known = known or {}
    good = np.isfinite(position) & np.all([np.isfinite(y) for y in others.values()], axis=0)
    time, position = time[good], position[good]
    others = {name: y[good] for name, y in others.items()}
    step = float(np.median(np.diff(time)))
    finest = FINEST * min(float(np.ptp(position)), turn) / 50
    noise = known.get("", max(difference_sigma(position), finest))
    force = max((float(np.std(y)) for y in others.values()), default=1.0)
    width = next(
        (s for s in WIDTHS
         if _noise_of(1, noise, step, s) <= CREEP * creep
         and heavy * _noise_of(2, noise, step, s) <= WEIGHT * force),
        WIDTHS[-1],
    )  # fmt: skip
    quick = next((s for s in QUICK if _noise_of(1, noise, step, s) <= CREEP * creep), width)
    names = list(others)
    parts, begins, rows, count = [], [], [], 0
    cuts = np.flatnonzero(np.diff(time) > GAP * step)
    for first, last in zip([0, *(cuts + 1)], [*cuts, len(time) - 1], strict=True):
        n = int((time[last] - time[first]) / step) + 1
        if n < 2 * REACH * width + 3:
            continue
        grid = time[first] + step * np.arange(n)
        columns = [np.interp(grid, time, y) for y in (position, *others.values())]
        smooth = [_smooth(y, width) for y in columns]
        v = np.gradient(smooth[0], step)
        sharp = np.gradient(_smooth(columns[0], quick), step)
        parts.append(
            np.stack([grid, smooth[0], v, np.gradient(v, step), columns[0], sharp, *smooth[1:]])
        )
        begins.append(count)
        edge = int(REACH * width) + 2
        rows.append(count + np.arange(edge, n - edge, width))
        count += n
    if not parts:
        return None
    table = np.concatenate(parts, axis=1)
    sigma = {
        name: GAIN[0] / np.sqrt(width)
        * known.get(name, max(difference_sigma(y), FINEST * float(np.ptp(y))))
        for name, y in others.items()
    }  # fmt: skip
    return Filtered(
        table[0],
        table[1],
        table[2],
        table[3],
        dict(zip(names, table[6:], strict=True)),
        np.concatenate(rows),
        _noise_of(0, noise, step, width),
        _noise_of(2, noise, step, width),
        sigma,
        width * step,
        np.array(begins),
        table[4],
        table[5],
        _noise_of(1, noise, step, quick),
        quick * step,
    )


def _smooth(values: Array, width: float) -> Array:
    return np.asarray(gaussian_filter1d(values, width, truncate=REACH, mode="nearest"))


def _noise_of(order: int, sigma: float, step: float, width: int) -> float:
    """Noise of the filtered position (0), its rate (1) or its acceleration (2)."""
    return float(GAIN[order] * sigma / (step**order * width ** (order + 0.5)))


ANSWER = {"cylinder": "piston/F", "drive": "axis/tau"}
PLACE = {"cylinder": "piston/x", "drive": "axis/q"}

# Which rows of a rig's log a friction is known in.
# travel after a turn within which friction is in doubt, over that in which seals stretch: that
# travel is taken to be known to a factor of two
DOUBTED = 2.0
# time around a turn that the filter mixes into a row, over the filter's width: three sigmas of
# the Gaussian
BLURRED = 3.0


@dataclass(frozen=True, eq=False)
class RigLog(Filtered):
    """The filtered channels of one log; `doubt` (k,): share of a friction's size by which it is
    uncertain at each judged row, because the sign of the rate is; `step`: in which its position is
    read, 0 where in none."""

    name: str
    doubt: Array
    step: float

    @property
    def time(self) -> Array:
        """Times (k,) [s] of the judged rows."""
        return np.asarray(self.grid[self.rows])

    @property
    def speed(self) -> Array:
        """Rate (k,) at the judged rows."""
        return np.asarray(self.v[self.rows])


def prepare(log: Trajectory, model: Model) -> RigLog:
    """A log of `model`'s rig. Raises BadData where its stretches without gaps are too short."""
    mechanism = model.mechanism
    place = PLACE[mechanism.rig]
    names = [name for name in mechanism.logged if name != place]
    given = log.meta.get("noise", {})
    known = {("" if name == place else name): sigma for name, sigma in given.items()}
    # the rod of a cylinder is taken to have no inertia
    heavy = float(model.parameters["drive_axis.J"][1]) if mechanism.rig == "drive" else 0.0
    turn = 2 * np.pi if mechanism.logged[place] == "rad" else np.inf
    others = {n: log[n] for n in names}
    found = filtered(log.time, log[place], others, mechanism.sign_speed, heavy, known, turn)
    name = str(log.meta.get("name", "log"))
    if found is None or not len(found.rows):
        what = "has no stretch without gaps that is long enough for a rate"
        hint = "log faster, or longer without a break"
        raise BadData([KembaError(str(log.meta.get("path", name)), what, hint=hint)])
    # where the acceleration jumps, the rate behind a filter is off by that share of its width
    step = float(np.median(np.diff(found.grid)))
    reach = max(round(2.0 * found.width / step), 1)
    jump = np.abs(np.roll(found.a, -reach) - np.roll(found.a, reach))
    blur = 2.0 * np.hypot(found.quick_sigma, jump * found.quick_width / np.sqrt(2.0 * np.pi))
    high, low = (np.tanh((found.quick + s * blur) / mechanism.sign_speed) for s in (1.0, -1.0))
    doubt = found.smoothed(0.5 * (high - low))[found.rows]
    if "measured_chambers.travel" in model.parameters:
        travel = model.parameters["measured_chambers.travel"][1]
        # contacts that slide after some travel; what was before a stretch is not known
        parts = np.split(found.q, found.begins[1:])
        held = 1.0 - np.abs(np.concatenate([dahl(q, DOUBTED * travel) for q in parts]))
        reach = 2 * int(np.ceil(BLURRED * found.width / step)) + 1
        doubt = np.maximum(doubt, maximum_filter1d(held, reach)[found.rows])
    return RigLog(**vars(found), name=name, doubt=doubt, step=step_of(log[place]))
