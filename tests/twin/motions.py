"""Parametric motions.  Each takes a random generator, so different seeds move differently."""

import numpy as np

from .figures import STANCE_Z
from .layout import knees
from .plan import Demand, Sight, fold_of, length_of, record, slope_of
from .run import Truth
from .scripts import (
    FRONT_E,
    FRONT_R,
    REAR_E,
    REAR_R,
    Script,
    Start,
    clock,
    in_air,
    on_feet,
    script,
)
from .sliding import slide

FALL = 10.7  # m/s2, robot and boom in flight
_X = np.linspace(0.0, 0.07, 141)
_L = np.array([length_of(x) for x in _X])


def piston_of(length: float) -> float:
    return float(np.interp(length, _L, _X))


class Leaper:
    """Goal of the planner for pushing off, flying and landing, as often as there are pushes."""

    def __init__(self, rng, pushes, lean=0.0, airborne=False, land_at=None):
        self.rng, self.pushes, self.lean = rng, list(pushes), lean
        self.phase = "air" if airborne else "wait"
        self.since, self.wait = 0.0, rng.uniform(0.02, 0.06)
        self.land = land_at or tuple(rng.uniform(0.055, 0.063) + rng.uniform(-0.002, 0.002, 2))
        self.tuck = rng.uniform(0.02, 0.045) if rng.random() < 0.5 else None
        self.skew = rng.normal(0.0, 0.0015, 2).clip(-0.003, 0.003)
        self.from_hips = None
        self.both = bool(rng.random() < 0.4)
        self.sink = (0.3, 0.0, 0.0, 15.0)
        self.done = None

    def _enter(self, phase: str, see: Sight) -> None:
        self.phase, self.since = phase, see.t
        if phase == "air":
            self.from_hips = tuple(see.y[3:5])
        if phase == "land":
            skew = 0.5 * (see.y[5] - see.y[6])
            self.sink = (see.y[1], see.w[1], skew, self.rng.uniform(13.0, 18.0))
        if phase == "rest":
            self.wait = self.rng.uniform(0.08, 0.16)
            if not self.pushes:
                self.done = see.t + 0.1

    def __call__(self, see: Sight) -> Demand:
        t = see.t - self.since
        if self.phase in ("wait", "rest"):
            if self.pushes and t >= self.wait:
                self._enter("push", see)
            return Demand(valves=(0, 0, 0, 0))
        if self.phase == "push":
            return self._push(see, t)
        if self.phase == "air":
            return self._air(see, t)
        return self._land(see, t)

    def _push(self, see: Sight, t: float) -> Demand:
        length = self.pushes[0]
        on = [int(self.skew[n] <= t < length + self.skew[n]) for n in range(2)]
        if t > length and see.airborne:
            self.pushes.pop(0)
            self._enter("air", see)
        elif t > length + 0.35:  # never left the ground
            self.pushes.pop(0)
            self._enter("land", see)
        lean = -self.lean * min(1.0, t / 0.15)
        return Demand(valves=(on[0], 0, on[1], 0), hip_offset=(lean, lean))

    def _air(self, see: Sight, t: float) -> Demand:
        if t > 0.03 and see.feet[:, 1].min() < 3e-4 and see.w[1] < 0.0:
            self._enter("land", see)
        drop = max(see.y[1] - length_of(min(self.land)), 0.0)
        left = (see.w[1] + np.sqrt(see.w[1] ** 2 + 2.0 * FALL * drop)) / FALL
        target = (-fold_of(self.land[0]) + self.lean, fold_of(self.land[1]) + self.lean)
        hips, rates = target, (0.0, 0.0)
        if self.from_hips is not None:
            s = min(t / 0.12, 1.0)
            blend, slope = s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / 0.12
            hips = tuple(a + blend * (b - a) for a, b in zip(self.from_hips, target, strict=True))
            rates = tuple(slope * (b - a) for a, b in zip(self.from_hips, target, strict=True))
        if left < 0.05:
            return Demand(valves=(1, 0, 1, 0), hips=hips, hip_rates=rates, airborne=True)
        wanted = self.land
        if self.tuck is not None and left > 0.16:
            wanted = (self.tuck, self.tuck)
        return Demand(x=wanted, hips=hips, hip_rates=rates, airborne=True, stiff=25.0)

    def _land(self, see: Sight, t: float) -> Demand:
        z, speed, skew, brake = self.sink
        stop = max(-speed, 0.0) / brake
        height = z + speed * min(t, stop) + 0.5 * brake * min(t, stop) ** 2
        rate = speed + brake * t if t < stop else 0.0
        height = max(height, 0.2)
        slow = max(t - stop, 0.0) / 0.3
        height += (STANCE_Z + 0.004 - height) * min(slow, 1.0)
        if slow > 1.3:
            self._enter("rest", see)
            return Demand(valves=(0, 0, 0, 0))
        x = piston_of(height)
        v = rate / slope_of(x)
        back = self.lean * max(0.0, 1.0 - 2.0 * slow)
        return Demand(
            x=(x + skew, x - skew), v=(v, v), hip_offset=(back, back), stiff=20.0, both=self.both
        )

    def finished(self, see: Sight) -> bool:
        return self.done is not None and see.t > self.done


# Nominal apex of the body against the length of the extend pulse (s).
_PULSE = np.array([0.10, 0.13, 0.15, 0.17, 0.18, 0.19, 0.20, 0.21, 0.22])
_APEX = np.array([0.266, 0.365, 0.453, 0.558, 0.596, 0.661, 0.713, 0.743, 0.755])


def push_for(height: float) -> float:
    return float(np.interp(height, _APEX, _PULSE))


def jump(rng, height=None, lean=0.0, rate=1000.0, jitter=0.0, name="jump") -> Script:
    """Push, fly, land, sink.  `lean` (rad) tilts the push: a forward jump."""
    height = height or rng.uniform(0.42, 0.7)
    goal = Leaper(rng, [push_for(height)], lean)
    ticks = clock(2.0, rate, jitter, rng)
    return record(name, ticks, Start(), goal, stop=goal.finished)


def forward_jump(rng, rate=1000.0, jitter=0.0) -> Script:
    lean = rng.uniform(0.03, 0.08) * rng.choice([-1.0, 1.0])
    return jump(rng, rng.uniform(0.42, 0.6), lean, rate, jitter, "forward")


def hops(rng, count=2, rate=1000.0, jitter=0.0) -> Script:
    """Small hops, one after the other."""
    goal = Leaper(rng, [push_for(h) for h in rng.uniform(0.36, 0.46, count)])
    goal.tuck = None
    return record("hops", clock(4.0, rate, jitter, rng), Start(), goal, stop=goal.finished)


def drop(rng, height=None, rate=1000.0, jitter=0.0) -> Script:
    """Let go at a small height, land and sink."""
    height = height or rng.uniform(0.52, 0.72)
    pistons = tuple(rng.uniform(0.053, 0.062, 2))
    goal = Leaper(rng, [], airborne=True, land_at=pistons)
    begin = in_air(height, pistons, rng.uniform(-0.03, 0.03))
    return record("drop", clock(2.0, rate, jitter, rng), begin, goal, stop=goal.finished)


class Squats:
    """Goal: one knee bend after another.  Between them the pistons rest on their ends, which ends
    the slow drift apart of front and rear that open-loop valves cannot hold."""

    def __init__(self, rng, fast: bool):
        self.rng, self.fast, self.begin = rng, fast, 0.03
        self._draw()

    def _draw(self):
        rng = self.rng
        self.period = rng.uniform(0.4, 0.55) if self.fast else rng.uniform(0.6, 0.85)
        self.depth = rng.uniform(0.05, 0.1) if self.fast else rng.uniform(0.08, 0.16)
        self.tilt = rng.uniform(-0.008, 0.008)
        self.pause = rng.uniform(0.1, 0.16)
        self.both = bool(rng.random() < 0.5)

    def _length(self, t: float, sign: float) -> float:
        phase = np.clip(t / self.period, 0.0, 1.0)
        wave = 0.5 - 0.5 * np.cos(2 * np.pi * phase)
        return STANCE_Z + wave * (self.depth + sign * self.tilt)

    def __call__(self, see: Sight) -> Demand:
        t = see.t - self.begin
        if t > self.period + self.pause:
            self.begin = see.t
            self._draw()
            t = 0.0
        now = [piston_of(self._length(t, s)) for s in (1.0, -1.0)]
        before = [piston_of(self._length(t - 1e-3, s)) for s in (1.0, -1.0)]
        resting = t < 0.0 or t > self.period - 0.03
        return Demand(
            x=(now[0], now[1]),
            v=((now[0] - before[0]) / 1e-3, (now[1] - before[1]) / 1e-3),
            valves=(0, 0, 0, 0) if resting else None,
            both=self.both,
            stiff=20.0,
        )


def squat(rng, duration=2.4, rate=1000.0, jitter=0.0, fast=False) -> Script:
    """Knee squats, front and rear a little unlike."""
    ticks = clock(duration, rate, jitter, rng)
    return record("heave" if fast else "squat", ticks, Start(), Squats(rng, fast))


def heave(rng, duration=2.0, rate=1000.0, jitter=0.0) -> Script:
    """Fast squats that never leave the ground."""
    return squat(rng, duration, rate, jitter, fast=True)


def swing(rng, height=None, rate=1000.0, jitter=0.0) -> Script:
    """Let go in the air: knees swing by random valve pulses, hips follow sines, no touchdown."""
    height = height or rng.uniform(1.0, 1.3)
    duration = np.sqrt(2.0 * (height - 0.47) / FALL)
    ticks = clock(duration, rate, jitter, rng)
    pistons = rng.uniform(0.01, 0.06, 2)
    begin = in_air(height, tuple(pistons), rng.uniform(-0.05, 0.05))
    pulses = []
    for pair in ((FRONT_E, FRONT_R), (REAR_E, REAR_R)):
        t, side = rng.uniform(0.0, 0.02), int(pistons[pair[0] // 2] > 0.035)
        while t < duration:
            on = rng.uniform(0.03, 0.07)
            pulses.append((pair[side], t, t + on))
            if rng.random() < 0.3:
                pulses.append((pair[1 - side], t, t + on))
            t += on + rng.uniform(0.02, 0.07)
            side = 1 - side
    angle = 2 * np.pi * rng.uniform(2.0, 5.0, 2) * ticks[:, None] + rng.uniform(0, 6.28, 2)
    wave = rng.uniform(0.1, 0.35, 2) * (np.sin(angle) - np.sin(angle[0]))
    offsets = np.column_stack([ticks, begin.hips[0] + wave[:, 0], begin.hips[1] + wave[:, 1]])
    return script("swing", ticks, pulses, begin, offsets, follow=0.0, kp=100.0, kd=2.0)


def sway(rng, duration=1.6, rate=1000.0, jitter=0.0) -> Script:
    """Standing: the hips swing the body fore and aft while the pistons stay down."""
    ticks = clock(duration, rate, jitter, rng)
    phase = 2 * np.pi * np.cumsum(np.linspace(1.0, rng.uniform(4.0, 7.0), ticks.size)) / rate
    wave = rng.uniform(0.06, 0.12) * np.sin(phase)
    other = wave * rng.uniform(0.7, 1.0)
    pulses = [(FRONT_R, 0.3, 0.6), (REAR_R, 0.35, 0.6)]
    start = on_feet((0.0, 0.0))
    return script("sway", ticks, pulses, start, np.column_stack([ticks, wave, other]))


def sane(truth: Truth) -> bool:
    """A run worth logging from end to end."""
    return truth.finite and bool(_standing(truth).all())


def _standing(truth: Truth) -> np.ndarray:
    """Per record: no knee or belly on the floor, not tipped over, hips within reason."""
    return (
        (knees(truth.q)[:, :, 1].min(axis=1) > 0.02)
        & (np.abs(truth.y[:, 2]) < 0.6)
        & (np.abs(truth.y[:, 3:5]).max(axis=1) < 2.2)
        & (truth.y[:, 1] > 0.1)
    )


def upright(truth: Truth) -> Truth:
    """The run as far as it is worth logging (the whole of it, mostly)."""
    good = _standing(truth) & np.isfinite(truth.y).all(axis=1)
    if truth.finite and good.all():
        return truth
    records = int(np.argmin(good)) if not good.all() else len(good)
    return truth.until(max(records // truth.split - 20, 1))


MOTIONS = {
    "jump": jump,
    "forward": forward_jump,
    "heave": heave,
    "squat": squat,
    "hops": hops,
    "swing": swing,
    "drop": drop,
    "sway": sway,
    "slide": slide,
}
