"""The missing force as a function of one quantity: speed, position, load, time since a command.

The force is taken as constant within bins of the quantity. Its values follow by least squares from
the whitened residuals. So their intervals are those of the noise, and no smoothing shrinks them.
"""

from dataclasses import dataclass

import numpy as np

from kemba.identify.problem.problem import Array, ForceChannel, Problem, Rows
from kemba.units import short

# How a missing force is looked for, and when it is said to be there.
BINS = 8  # most bins of a quantity
FEWEST = 30  # samples in a bin
NARROW = 0.02  # smallest width of a bin over the middle 90 % of a quantity
WIDE = 20.0  # prior sigma of a bin's force over a channel's usual force
FIRST_LAG = 0.0015  # shortest time from a command's change to an error [s]: over one row
LAST_LAG = 0.042  # longest time [s]: beyond the slowest rise time of Table I, 37 ms
LAG_STEP = 0.004  # step of these times [s]
SAME = 0.1  # share of a force's power by which bins may differ and still be one force
DOUBT = 20.0  # gain beyond which a force is there without doubt [nats]
NEGLIGIBLE = 0.1  # negligible force over a channel's usual force
SURE = 3.0  # sigmas beyond which a bin's force is not zero: three sigmas
PLAIN = 60.0  # gain that nominal figures at the edge of their tolerance do not reach [nats]


@dataclass(frozen=True)
class ForceProfile:
    """Missing `force` [unit] and its 1 sigma per bin (b,) around `centre` of a quantity; `gain`:
    what it explains beyond its number of bins [nats]; `usual` as of its channel."""

    channel: str
    unit: str
    quantity: str
    centre: Array
    force: Array
    sigma: Array
    gain: float
    usual: float

    @property
    def matters(self) -> bool:
        """Whether a force is certainly there, and is not negligible."""
        return self.gain > DOUBT and self.largest > NEGLIGIBLE * self.usual

    @property
    def largest(self) -> float:
        """The largest force [unit] that differs from zero by more than its error."""
        plain = np.abs(self.force) > SURE * self.sigma
        return float(np.max(np.abs(self.force[plain]), initial=0.0))

    @property
    def constant(self) -> float | None:
        """The one force that explains as much as a force per bin, if there is one."""
        weight = 1.0 / self.sigma**2
        mean = float(np.sum(weight * self.force) / np.sum(weight))
        varies = float(np.sum(weight * (self.force - mean) ** 2))
        return mean if varies < SAME * float(np.sum(weight)) * mean**2 else None

    def __str__(self) -> str:
        what = self.quantity.partition(" [")[0]
        if self.constant is not None:
            force = f"{self.constant:+.2g} {self.unit}"
            return f"a constant force on the {self.channel} is missing ({force})"
        going = "comes" if what.startswith("after ") else "goes with"
        size = f"up to {short(self.largest)} {self.unit}"
        return f"a force on the {self.channel} is missing that {going} {what} ({size})"


def force_profiles(problem: Problem, residual: Array) -> list[ForceProfile]:
    """Every force channel against each of its quantities, the channel that explains most first.

    `residual` (n,): whitened.
    """
    found = []
    for channel in problem.force_channels():
        by_value = (_force_profile(channel, label, residual) for label in channel.quantities)
        own = [profile for profile in by_value if profile is not None]
        for name, rise in channel.after.items():
            late = 1e3 * middle(lags())
            own.append(_solved(channel, f"after {name} [ms]", late, rise, residual))
        found.append(own)
    found = [group for group in found if group]
    found.sort(key=lambda group: -max(p.gain for p in group))
    return [p for group in found for p in group]


def _force_profile(channel: ForceChannel, label: str, residual: Array) -> ForceProfile | None:
    """The missing force by bins of the quantity `label`; None where that hardly varies."""
    values = channel.quantities[label]
    edges = bins(values)
    if edges is None:
        return None
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    place = np.where(np.isfinite(values), place, -1)
    flags = np.asarray(place[..., None] == np.arange(len(edges) - 1))
    sides = flags.reshape(-1, flags.shape[-1])
    centre = np.array([float(np.median(values.ravel()[own])) for own in sides.T])
    return _solved(channel, label, centre, flags.astype(float), residual)


def _solved(
    channel: ForceChannel, label: str, centre: Array, shapes: Array, residual: Array
) -> ForceProfile:
    columns = channel.columns(shapes)
    prior = np.eye(shapes.shape[-1]) / (WIDE * channel.usual) ** 2
    gram, slope = columns.T @ columns + prior, columns.T @ residual
    force = -np.linalg.solve(gram, slope)
    sigma = np.sqrt(np.diag(np.linalg.inv(gram)))
    gain = 0.5 * float(force @ gram @ force) - len(force)
    return ForceProfile(
        channel.name, channel.unit, label, centre, force, sigma, gain, channel.usual
    )


def lags() -> Array:
    """Edges (k,) [s] of the times between a command's change and an error."""
    return np.arange(FIRST_LAG, LAST_LAG, LAG_STEP)


def middle(edges: Array) -> Array:
    """Centres (k - 1,) of bins with these edges (k,)."""
    return np.asarray(0.5 * (edges[1:] + edges[:-1]))


def risen(times: Array, sizes: Array, at: Array) -> Array:
    """How much a command rose within each of the `lags` before the moments `at` (n,) [s]: (n, l).

    The command changes by `sizes` (c,) at `times` (c,) [s].
    """
    total = np.concatenate([[0.0], np.cumsum(sizes)])
    level = total[np.searchsorted(times, at[:, None] - lags(), side="right")]
    return np.asarray(level[:, :-1] - level[:, 1:])


def rises(problem: Problem, rows: Rows, command: str) -> Array:
    """The same before every row (n, l) of a problem's logs; zero in runs without the command."""
    found = np.zeros((len(rows), len(lags()) - 1))
    for i, sent in enumerate(problem.commands()):
        if command in sent:
            own = rows.run == i
            found[own] = risen(*sent[command], rows.time[own])
    return found


def bins(values: Array) -> Array | None:
    """Edges (b + 1,) of bins with the same number of samples each; None with too few samples."""
    seen = values[np.isfinite(values)]
    if len(seen) < 2 * FEWEST:
        return None
    count = min(BINS, len(seen) // FEWEST)
    edges = np.quantile(seen, np.linspace(0.0, 1.0, count + 1))
    narrowest = NARROW * float(np.diff(np.quantile(seen, (0.05, 0.95)))[0])
    kept = [float(edges[0])]
    for edge in edges[1:-1]:
        if min(edge - kept[-1], edges[-1] - edge) > narrowest:
            kept.append(float(edge))
    kept.append(float(edges[-1]))
    return np.array(kept) if len(kept) > 2 and narrowest > 0 else None
