"""A Kalman filter over several runs at once: gains once, then any number of columns through it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from kemba.identify.problem.problem import Array

# variance of a row that was not measured, over the largest variance: such a row tells nothing
MISSING = 1e12
# columns that pass at once: with all, the memory of `compare` is a quarter more: time of
# compare on five logs of 1 s; the same at 32, 7 % longer at 8
COLUMNS = 16


@dataclass(frozen=True)
class System:
    """Deviations from a reference, x' = F x + G (g + w), y = H x + n, over n steps of L runs.

    F (n, L, d, d), G (n, L, d, k), W (n, L, k, k) the covariance of w per step, H (n, L, m, d),
    R (n, L, m) variances of the rows (infinite: not measured), P0 (L, d, d). `lags`: so many of the
    last states are coloured noise of sensors.
    """

    F: Array
    G: Array
    W: Array
    H: Array
    R: Array
    P0: Array
    lags: int = 0

    def with_lags(self, keep: Array, size: Array) -> System:
        """The system with k lags of white noise as more states, which no row reads as yet.

        `keep` (n, L, k) or (n, L, 1): the share of a lag that a step keeps; `size` (L, k) or (k,):
        its 1 sigma.
        """
        k, d, j = size.shape[-1], self.F.shape[-1], self.G.shape[-1]
        F, G, W, P0 = (
            np.pad(a, [(0, 0)] * (a.ndim - 2) + [(0, k)] * 2)
            for a in (self.F, self.G, self.W, self.P0)
        )
        i = np.arange(k)
        F[..., d + i, d + i], G[..., d + i, j + i] = keep, 1.0
        W[..., j + i, j + i] = (1.0 - keep**2) * size**2
        P0[:, d + i, d + i] = size**2
        H = np.pad(self.H, [(0, 0)] * 3 + [(0, k)])
        return replace(self, F=F, G=G, W=W, H=H, P0=P0, lags=self.lags + k)


@dataclass(frozen=True)
class FilterGains:
    """What the filter makes of a System: whiteners of the innovations, predicted P, and what
    becomes of a predicted state and of a measurement in a step that corrects the state."""

    whitener: Array
    P: Array
    turn: Array
    carry: Array


def gains(system: System) -> FilterGains:
    """Run the covariance recursion."""
    s = system
    n, runs, m, d = s.H.shape
    known = np.isfinite(s.R)
    R = np.where(known, s.R, MISSING * np.nanmax(np.where(known, s.R, 0.0)))
    turn, P_all = np.empty_like(s.F), np.empty_like(s.F)
    carry, whitener = np.empty((n, runs, d, m)), np.empty((n, runs, m, m))
    P, diagonal = s.P0.copy(), np.arange(m)
    for k in range(n):
        P_all[k] = P
        PHt = P @ s.H[k].swapaxes(-1, -2)
        S = s.H[k] @ PHt
        S[:, diagonal, diagonal] += R[k]
        white = whitener[k] = np.linalg.inv(np.linalg.cholesky(S))
        c = carry[k] = s.F[k] @ (PHt @ white.swapaxes(-1, -2) @ white)
        t = turn[k] = s.F[k] - c @ s.H[k]
        # Joseph's form keeps P positive where a row is a thousand times sharper than the state
        P = t @ P @ t.swapaxes(-1, -2) + (c * R[k][:, None, :]) @ c.swapaxes(-1, -2)
        P += s.G[k] @ s.W[k] @ s.G[k].swapaxes(-1, -2)
        P = 0.5 * (P + P.swapaxes(-1, -2))
    return FilterGains(whitener, P_all, turn, carry)


def innovations(system: System, gain: FilterGains, y: Array | None, g: Array | None) -> Array:
    """Whitened innovations (n, L, m, c) of measurements y (n, L, m, c) and accelerations g
    (n, L, j, c) of the first j channels of G; None is zero."""
    count = max(a.shape[-1] for a in (y, g) if a is not None)
    whole = np.empty((*system.H.shape[:3], count))
    for part in at_once(count):
        own = (None if a is None else a[..., part] for a in (y, g))
        whole[..., part] = gain.whitener @ predicted(system, gain, *own)[1]
    return whole


def at_once(count: int) -> Iterator[slice]:
    """The parts of so many columns that pass the filter at once."""
    return (slice(i, i + COLUMNS) for i in range(0, count, COLUMNS))


def predicted(
    system: System, gain: FilterGains, y: Array | None, g: Array | None
) -> tuple[Array, Array]:
    """(predicted x (n, L, d, c), what is measured beyond it (n, L, m, c)) of the same columns."""
    s = system
    n, runs, _, d = s.H.shape
    given = [a.shape[-1] for a in (y, g) if a is not None]
    states = np.zeros((n, runs, d, given[0]))
    # one step at a time only what must be: x' = F (1 - K H) x + (F K y + G g)
    if y is not None:
        y = np.where(np.isfinite(y) & np.isfinite(s.R)[..., None], y, 0.0)
        y = np.ascontiguousarray(y)  # NumPy hands only such arrays to BLAS
        np.matmul(gain.carry[:-1], y[:-1], out=states[1:])
    if g is not None:
        states[1:] += s.G[:-1, ..., : g.shape[2]] @ np.ascontiguousarray(g[:-1])
    turned = np.empty(states.shape[1:])
    for turn, now, following in zip(gain.turn[:-1], states[:-1], states[1:], strict=True):
        np.matmul(turn, now, out=turned)
        following += turned
    seen = s.H @ states
    return states, (-seen if y is None else y - seen)


def smooth(system: System, gain: FilterGains, y: Array, g: Array) -> tuple[Array, Array]:
    """(smoothed x (n, L, d), smoothed w (n, L, k)) of one column (Bryson and Frazier)."""
    s = system
    states, errors = predicted(s, gain, y[..., None], g[..., None])
    n, runs, _, d = s.H.shape
    solved = gain.whitener.swapaxes(-1, -2) @ (gain.whitener @ errors)
    pushed = s.H.swapaxes(-1, -2) @ solved
    x, w = np.empty((n, runs, d)), np.empty((n, runs, s.G.shape[-1]))
    pull = np.zeros((runs, d, 1))
    for k in reversed(range(n)):
        w[k] = (s.W[k] @ (s.G[k].swapaxes(-1, -2) @ pull))[..., 0]
        pull = pushed[k] + gain.turn[k].swapaxes(-1, -2) @ pull
        x[k] = (states[k] + gain.P[k] @ pull)[..., 0]
    return x, w


def smooth_with_band(system: System, gain: FilterGains, y: Array, g: Array) -> tuple[Array, Array]:
    """(smoothed x, its variances), both (n, L, d), of one column; `g` (n, L, j) pushes the first
    j channels of G."""
    s = system
    n, runs, _, d = s.H.shape
    states, errors = predicted(s, gain, y[..., None], g[..., None])
    errors = gain.whitener @ errors
    seen = np.where(np.isfinite(s.R)[..., None], s.H, 0.0)
    whitened = (gain.whitener @ seen).swapaxes(-1, -2)
    x, variance = np.empty((n, runs, d)), np.empty((n, runs, d))
    pull, certainty = np.zeros((runs, d, 1)), np.zeros((runs, d, d))
    for k in reversed(range(n)):
        back, P = gain.turn[k].swapaxes(-1, -2), gain.P[k]
        pull = whitened[k] @ errors[k] + back @ pull
        certainty = whitened[k] @ whitened[k].swapaxes(-1, -2) + back @ certainty @ gain.turn[k]
        x[k] = (states[k] + P @ pull)[..., 0]
        variance[k] = np.diagonal(P, axis1=1, axis2=2) - ((P @ certainty) * P).sum(axis=2)
    return x, np.maximum(variance, 0.0)
