"""Two chambers behind two 3/2 valves: eq. 1 to 3 of the paper, or 4 to 7, and their flaws.

Plain numbers, one explicit step at a time: a step of 50 us is a hundredth of every time constant.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

ATM, R_GAS, TEMP, KAPPA = 101325.0, 287.0, 293.0, 1.4
STROKE = 0.070
AREA = (math.pi / 4 * 0.025**2, math.pi / 4 * (0.025**2 - 0.010**2))  # extend, retract
CRITICAL = (2.0 / (KAPPA + 1.0)) ** (KAPPA / (KAPPA - 1.0))
ROUNDED = 1e-4  # of the squared flow number: no infinite slope at equal pressures


@dataclass(frozen=True)
class FirstOrder:
    """Figures of eq. 4 to 7 at 0.7 MPa (Tables I and II)."""

    full: tuple[float, float] = (324.0, 260.0)  # N
    damping: tuple[float, ...] = (25.0, 97.0, 84.0, 59.0)  # N s/m: none, extend, retract, both
    fill: tuple[float, float] = (0.008, 0.025)  # s
    vent: tuple[float, float] = (0.013, 0.037)


@dataclass(frozen=True)
class Orifice:
    """Figures of eq. 1 to 3."""

    fill: float = 4.25e-6  # m2
    vent: float = 3.42e-6
    dead: tuple[float, float] = (14.3e-6, 14.3e-6)  # m3
    gauge: float = 0.624e6  # Pa
    n: float = 1.4
    damping: float = 15.0  # N s/m, of the rod


@dataclass(frozen=True)
class Flaws:
    """What is wrong with the air of one leg; the defaults: nothing."""

    supply: float = 1.0
    rise: float = 1.0
    hose: float = 0.0  # s
    leak: float = 0.0  # 1/s
    both: float = 0.0  # N
    spring: float = 0.0  # N/m
    cushion: float = 0.0  # N s/m
    cushion_way: float = 0.010  # m
    quadratic: float = 0.0  # N s2/m2
    check: float = 0.0  # N s/m, only when pushing out against an open extend valve
    magnet: float = 0.0  # N
    magnet_way: float = 0.005  # m
    pressure: float = 0.0  # friction as a share of both chambers' forces


@dataclass
class Supply:
    """The shared supply: `level` of nominal, its drop per filled chamber, and recovery [s]."""

    drop: float = 0.0
    recovery: float = 0.3
    level: float = 1.0

    def step(self, dt: float, demand: float) -> None:
        if self.drop:
            self.level += dt * ((1.0 - self.level) / self.recovery - self.drop * demand)


@dataclass
class Chambers:
    """State of one leg's air: forces [N] with `FirstOrder`, pressures [Pa] with `Orifice`."""

    figures: FirstOrder | Orifice
    flaws: Flaws = Flaws()
    state: list[float] = field(default_factory=list)
    valve: list[float] = field(default_factory=lambda: [0.0, 0.0])

    def __post_init__(self) -> None:
        self.state = [0.0, 0.0] if isinstance(self.figures, FirstOrder) else [ATM, ATM]

    def push(self) -> tuple[float, float]:
        """Force of each chamber [N]."""
        if isinstance(self.figures, FirstOrder):
            return self.state[0], self.state[1]
        return AREA[0] * (self.state[0] - ATM), AREA[1] * (self.state[1] - ATM)

    def step(self, dt: float, x: float, v: float, sent: tuple[float, float], level: float) -> float:
        """One step of the air; returns the demand on the supply."""
        lag = self.flaws.hose
        for i in range(2):
            self.valve[i] += (sent[i] - self.valve[i]) * (-math.expm1(-dt / lag) if lag else 1.0)
        if isinstance(self.figures, FirstOrder):
            return self._lagging(dt, x, level)
        return self._flowing(dt, x, v, level)

    def _lagging(self, dt: float, x: float, level: float) -> float:
        """Eq. 4 and 5, exact for a constant target."""
        f, flaws, demand = self.figures, self.flaws, 0.0
        leak = flaws.leak * (self.state[0] / AREA[0] - self.state[1] / AREA[1])
        for i, share in enumerate((x / STROKE, 1.0 - x / STROKE)):
            u, full = self.valve[i], flaws.supply * f.full[i]
            fill = f.fill[0] + share * (f.fill[1] - f.fill[0])
            vent = f.vent[0] + share * (f.vent[1] - f.vent[0])
            tau = flaws.rise * (u * fill + (1.0 - u) * vent)
            demand += u * max(0.0, level - self.state[i] / full) / tau
            self.state[i] += (level * full * u - self.state[i]) * -math.expm1(-dt / tau)
            self.state[i] += dt * (-leak if i == 0 else leak) * AREA[i]
        return demand

    def _flowing(self, dt: float, x: float, v: float, level: float) -> float:
        """Eq. 1 (compression counted with its true sign) to 3, by the midpoint rule. The demand is
        that of first-order chambers, with the time to 63 % of the choked flow into an empty one."""
        f, flaws, demand = self.figures, self.flaws, 0.0
        full = flaws.supply * f.gauge
        source, most = ATM + level * full, f.fill / flaws.rise * flow(ATM + full, 0.0)

        def rate(p: float, i: int) -> float:
            u, way, speed = self.valve[i], (x, STROKE - x)[i], (v, -v)[i]
            inward = u * f.fill / flaws.rise * flow(source, p)
            outward = (1.0 - u) * f.vent / flaws.rise * flow(p, ATM)
            volume = f.dead[i] + AREA[i] * way
            work = p * AREA[i] * speed
            leak = flaws.leak * (self.state[0] - self.state[1]) * (-1.0, 1.0)[i]
            return f.n * (R_GAS * TEMP * (inward - outward) - work) / volume + leak

        new = [p + dt * rate(p + 0.5 * dt * rate(p, i), i) for i, p in enumerate(self.state)]
        for i, (u, p, way) in enumerate(zip(self.valve, self.state, (x, STROKE - x), strict=True)):
            volume = f.dead[i] + AREA[i] * way
            tau = (1.0 - math.exp(-1.0)) * volume * full / (f.n * R_GAS * TEMP * most)
            demand += u * max(0.0, level - (p - ATM) / full) / tau
        self.state = new
        return demand

    def force(self, x: float, v: float) -> float:
        """Force on the rod [N], pushing positive; dry friction is MuJoCo's."""
        (extend, retract), (a, b), flaws = self.push(), self.valve, self.flaws
        f = extend - retract
        if isinstance(self.figures, FirstOrder):
            none, e, r, both = self.figures.damping
            c = none * (1 - a) * (1 - b) + e * a * (1 - b) + r * b * (1 - a) + both * a * b
        else:
            c = self.figures.damping
        f -= c * v + flaws.quadratic * v * abs(v) + flaws.both * a * b
        f -= flaws.spring * (x - 0.5 * STROKE) + flaws.check * max(v, 0.0) * a
        f -= flaws.pressure * (extend + retract) * math.tanh(v / 0.01)
        f -= flaws.magnet * math.exp(-((x / flaws.magnet_way) ** 2))
        gap = max(STROKE - x if v > 0.0 else x, 0.0)
        if flaws.cushion and gap < flaws.cushion_way:
            f -= flaws.cushion * (1.0 - gap / flaws.cushion_way) * v
        return f


def flow(up: float, down: float) -> float:
    """Mass flow per area through a thin plate (eq. 3), backwards where the pressures are so."""
    if down > up:
        return -flow(down, up)
    ratio = max(down / up, CRITICAL)
    square = ratio ** (2.0 / KAPPA) - ratio ** ((KAPPA + 1.0) / KAPPA)
    number = square / math.sqrt(square + ROUNDED)
    return up * math.sqrt(2.0 * KAPPA / ((KAPPA - 1.0) * R_GAS * TEMP)) * number


def jittered(
    figures: FirstOrder | Orifice, rng: np.random.Generator, off: float
) -> FirstOrder | Orifice:
    """The same kind of air with every figure off by about `off` (1 sigma)."""

    def one(value: float) -> float:
        return value * (1.0 + off * float(np.clip(rng.standard_normal(), -2.5, 2.5)))

    changed = {}
    for name, value in vars(figures).items():
        if name != "n":
            changed[name] = tuple(map(one, value)) if isinstance(value, tuple) else one(value)
    return replace(figures, **changed)
