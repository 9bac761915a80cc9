"""What each residual row of robot logs is, and forces that a robot model may lack: their channels,
simple terms, and d(t) with its 95 % band.

Every channel's unknown force is a first-order lag of white noise, and a state of the filter. Its
strength is learnt from the data; a channel that needs no force ends with almost none. In stance
the contact forces are unknown too, so only the force that they cannot explain is found.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.effects.pneumatics.switching import changes as switchings
from kemba.identify.compare.force_profiles import lags, risen
from kemba.identify.problem.missing_force import rod_terms, spans
from kemba.identify.problem.problem import (
    Array,
    Changes,
    Flags,
    ForceChannel,
    MissingForce,
    OperatingPoint,
    Problem,
    Rows,
    Texts,
    Theta,
)
from kemba.identify.robot.batch import ResampledLog
from kemba.identify.robot.filter import System, gains, smooth
from kemba.identify.robot.linear import GROUND, QUIET, densities, scatter
from kemba.identify.robot.physics import Physics
from kemba.identify.robot.state import LinearisedState

MODES = np.array(["00", "01", "10", "11"], dtype=object)  # extend, retract
SIDES = ("extend", "retract")


def _row_channels(physics: Physics) -> tuple[str, ...]:
    """The measured channels, then the places of feet and stops that stand still."""
    feet = (f"{leg}/foot/{axis}" for leg in physics.legs for axis in "xz")
    return (*physics.channels, *feet, *(f"{leg}/stop" for leg in physics.legs))


def describe(state: LinearisedState) -> Rows:
    """Rows of the logs that are data, run by run, channel by channel."""
    batch, channels, shape = state.batch, _row_channels(state.physics), state.mask.shape
    phase = np.full(shape[:2], "", dtype=object)
    for i, schedule in enumerate(state.schedules):
        phase[: len(schedule.phase), i] = schedule.phase
    sigma = np.full(shape[1:], GROUND)
    sigma[:, : batch.sigma.shape[1]] = batch.sigma
    whole = {
        "run": np.arange(shape[1])[:, None],
        "channel": np.arange(len(channels)),
        "time": batch.time[..., None],
        "phase": phase[..., None],
        "mode": valve_modes(state.physics, state.motion.states[1], channels),
        "sigma": sigma,
    }
    rows = {key: state.pick(np.broadcast_to(values, shape)) for key, values in whole.items()}
    return Rows(channels=channels, **rows)  # type: ignore[arg-type]


def valve_modes(physics: Physics, inputs: Array, channels: Sequence[str]) -> Texts:
    """Mode (n, L, m) of the channel's own leg; of the body: the first leg's."""
    texts = {}
    for leg in physics.legs:
        extend, retract = (
            inputs[..., physics.inputs.index(f"{leg}/valve/{side}")] > 0.5 for side in SIDES
        )
        texts[leg] = MODES[2 * extend.astype(int) + retract]
    first = physics.legs[0]
    return np.stack([texts.get(c.split("/")[0], texts[first]) for c in channels], axis=-1)


def air_forces(state: LinearisedState) -> Array:
    """Push of the model's air [N] on every leg's rod (n, L, legs), by chambers' forces or
    pressures."""
    names = [q.name for q in state.physics.model.states.values()]
    states = dict(zip(names, np.moveaxis(state.motion.states[0], -1, 0), strict=True))
    cylinder = state.physics.mechanism.need_cylinder()

    def push(name: str, area: float) -> Array:
        known = states.get(f"{name}/F")
        pressed = known is None
        return np.asarray((states[f"{name}/P"] - ATMOSPHERE) * area if pressed else known)

    return np.stack(
        [
            push(f"{leg}/chamber/extend", cylinder.area_extend)
            - push(f"{leg}/chamber/retract", cylinder.area_retract)
            for leg in state.physics.legs
        ],
        axis=-1,
    )


def changes(log: ResampledLog, legs: Sequence[str]) -> Changes:
    """Command -> times [s] and sizes of its changes in one run: valves, then hip torques [N.m]."""
    valves = [f"{leg}/valve/{side}" for leg in legs for side in SIDES]
    found = {name: switchings(sent) for name, sent in zip(valves, log.sent, strict=True)}
    steps = np.diff(log.torque, axis=0)
    for i, leg in enumerate(legs):
        found[f"{leg}/hip/tau"] = (log.time[1:], steps[:, i])
    return found


BODY = {"body z": 1, "body x": 0}  # place among the channels

# A force of each channel that is neither small nor large.
USUAL_FORCE_BODY = 3.0  # on the body [N]
HIP = 0.5  # at a hip [N.m]
ROD = 10.0  # on a rod [N]: friction of 6 to 8 N by the paper's tables


def _after(state: LinearisedState, command: str) -> Array:
    """How much each leg's own command rose before every node, (n, L, legs, lags)."""
    batch, legs = state.batch, state.physics.legs
    runs = []
    for log in batch.resampled:
        sent = changes(log, legs)
        own = [risen(*sent[f"{leg}/{command}"], log.time) for leg in legs]
        runs.append(np.stack(own, axis=1).reshape(len(log.time), -1))
    return batch.pad(runs, 0.0).reshape(*batch.valid.shape, -1, len(lags()) - 1)


def _force_columns(state: LinearisedState, channels: Sequence[int]) -> Callable[[Array], Array]:
    """Function from forces (n, L, ports, b) on these channels to columns (rows, b) of residual."""
    motion = state.motion

    def columns(force: Array) -> Array:
        pushes = motion.inverse @ motion.channels[..., list(channels)]
        return state.pick(state.pushed(np.einsum("nlkp,nlpb->nlkb", pushes, force)))

    return columns


# Constants of the simple force terms that are tried on robots.
SPEED = 0.1  # speed over which friction at a hip turns round [rad.s-1]
CREEPS = (0.003, 0.006, 0.012)  # travel over which a hysteresis turns round [m]
RIPPLES = (6, 8, 10, 12, 14, 16, 18, 20, 24)  # ripples of a motor per turn of the hip
ROPES = (0.26, 0.28, 0.30, 0.32, 0.35)  # heights from which a cable pulls [m]


def _hip_terms(q: Array, w: Array, torque: Array) -> Iterator[tuple[str, Array]]:
    """(formula, torque at the hip (n, L, legs)) of angle, rate and the torque commanded."""
    sign = np.tanh(w / SPEED)
    for n in RIPPLES:
        yield f"sin({n}*q)", np.sin(n * q)
    yield f"abs(tau)*tanh(w/{SPEED:g})", np.abs(torque) * sign
    yield "w*abs(w)", w * np.abs(w)
    yield "tau**3", torque**3
    yield "max(w, 0)", np.maximum(w, 0.0)


def _drag_terms(name: str, v: Array) -> Iterator[tuple[str, Array]]:
    """(formula, force on the body (n, L, 1)) of its velocity along one axis."""
    yield f"v{name}*abs(v{name})", v * np.abs(v)
    yield f"v{name}**3", v**3


# The missing force of robot logs. Its strength (1 sigma) is learnt per channel.
MEMORY = 0.025  # correlation time of the missing force [s]
ROUNDS = 4  # rounds in which its strength is learnt
# of each channel: its unit, the strength with which learning begins, one that is as good as none
STRENGTHS = {
    "body/x": ("N", 5.0, 0.1),
    "body/z": ("N", 5.0, 0.1),
    "body/pitch": ("N.m", 0.5, 0.01),
    "hip/q": ("N.m", 0.5, 0.01),
    "piston/x": ("N", 10.0, 0.1),
}


def _with_forces(state: LinearisedState, density: Array, sigma: Array) -> System:
    """The filter's system with a lagged force per channel, `sigma` (k,), as more states."""
    motion, h, k = state.motion, state.batch.h, state.motion.ref.q.shape[2]
    base = replace(motion.system, W=motion.system.W.copy())
    base.W[..., :k, :k] = scatter(motion.inverse @ motion.channels, density, h)
    keep = np.where(state.batch.valid, np.exp(-h / MEMORY), 1.0)
    found, d = base.with_lags(keep[..., None], sigma), base.F.shape[-1]
    pushes = motion.channels[..., : len(sigma)]  # generalised force per channel force
    found.F[..., :d, d:] = base.G[..., : pushes.shape[2]] @ motion.inverse @ pushes
    return found


class RobotForces(Problem):
    """What rows of robot logs are, and forces that may be missing; `state`: linearised logs."""

    state: LinearisedState

    def rows(self) -> Rows:
        """What each row of `residual` is."""
        return describe(self.state)

    def commands(self) -> list[Changes]:
        """Per run: command -> times and sizes of its changes."""
        return [changes(log, self.state.physics.legs) for log in self.state.batch.resampled]

    def operating_point(self) -> OperatingPoint:
        """The piston of each row's leg along the motion; of the body's rows: the first leg's."""
        state, legs, motion = self.state, self.state.physics.legs, self.state.motion
        pistons = slice(motion.y.shape[-1] - len(legs), None)
        place = (motion.y[..., pistons], motion.rate[..., pistons], air_forces(state))
        per_leg = np.moveaxis(np.stack(place, axis=-1), 2, 0)  # (legs, n, L, 3)
        owners = [channel.split("/")[0] for channel in _row_channels(state.physics)]
        own = [per_leg[legs.index(o) if o in legs else 0] for o in owners]
        x, v, force = state.pick(np.stack(own, axis=2)).T
        return OperatingPoint(x, v, force, state.physics.mechanism.need_cylinder().stroke)

    def force_channels(self) -> list[ForceChannel]:
        """Rods and hips (both legs share a force profile), then the body along z and x.

        A force is looked for where it shows: of hips and body in flight, of rods off their stops.
        """
        state, y, rate = self.state, self.state.motion.y, self.state.motion.rate
        batch, legs = state.batch, len(state.physics.legs)
        flying = [(s.phase == "flight").astype(float) for s in state.schedules]
        flight = batch.pad(flying, 0.0)[..., None] > 0.5
        stopped = batch.pad([(s.low | s.high).astype(float) for s in state.schedules], 1.0)
        off_stops = (stopped < 0.5) & batch.valid[..., None]

        def channel(
            name: str, unit: str, usual: float, ports: slice, where: Flags,
            values: dict[str, Array], after: Mapping[str, str] = MappingProxyType({}),
        ) -> ForceChannel:  # fmt: skip
            places = range(*ports.indices(y.shape[-1]))
            seen = {label: np.where(where, value, np.nan) for label, value in values.items()}
            rises = {label: _after(state, command) for label, command in after.items()}
            return ForceChannel(name, unit, usual, seen, _force_columns(state, places), rises)

        rods, hips = slice(3 + legs, 3 + 2 * legs), slice(3, 3 + legs)
        at_rods = {"speed [m/s]": rate[..., rods], "position [mm]": 1e3 * y[..., rods],
                   "air force [N]": air_forces(state)}  # fmt: skip
        at_hips = {"speed [rad/s]": rate[..., hips], "angle [rad]": y[..., hips],
                   "torque [N.m]": batch.torque}  # fmt: skip
        sent = {side: f"valve/{side}" for side in SIDES}
        found = [
            channel("rods", "N", ROD, rods, off_stops, at_rods, sent),
            channel("hips", "N.m", HIP, hips, flight, at_hips, {"hip/tau": "hip/tau"}),
        ]
        for name, k in BODY.items():
            own = slice(k, k + 1)
            at = {"speed [m/s]": rate[..., own], "position [m]": y[..., own]}
            found.append(channel(name, "N", USUAL_FORCE_BODY, own, flight, at))
        return found

    def missing_force(
        self, theta: Theta | None = None, strength: Array | None = None
    ) -> list[MissingForce]:
        """d(t) per run: force on the body and the rods [N], moments at pitch and hips [N.m].

        `strength` (k,): 1 sigma of each channel's force; learnt when not given.
        """
        state, theta, names = self.state, theta or {}, self.state.physics.channels
        usual = (STRENGTHS["/".join(name.split("/")[-2:])] for name in names)
        units, begin, least = zip(*usual, strict=True)
        sigma = np.array(begin) if strength is None else strength
        quiet = densities(state.physics, state.batch, state.schedules, QUIET)
        y, g = state.measurement(theta), state.acceleration(theta)
        valid, k = state.batch.valid, len(names)
        for _ in range(ROUNDS if strength is None else 1):
            system = _with_forces(state, quiet, sigma)
            x, _, variance = smooth(system, gains(system), y, g, band=True)
            power = (x[..., -k:] ** 2 + variance[..., -k:])[valid].mean(axis=0)
            ratio = np.sqrt(power) / sigma
            # towards nothing such rounds creep, so that their steps are doubled
            used, sigma = sigma, np.maximum(sigma * np.where(ratio < 1.0, ratio**2, ratio), least)
        found = []
        for i, log in enumerate(state.batch.resampled):
            n = len(log.time)
            force, spread = x[:n, i, -k:], np.sqrt(variance[:n, i, -k:])
            down = spans(log.time, state.schedules[i].phase != "flight")
            found.append(MissingForce(log.name, log.time, names, units, force, spread, used, down))
        return found

    def formulas(self, theta: Theta) -> dict[str, Array]:
        """Simple terms on rods, hips and body: formula, as a model's YAML would hold it -> column
        (n,), the same at every theta."""
        state, y, rate = self.state, self.state.motion.y, self.state.motion.rate
        legs, stroke = len(state.physics.legs), state.physics.mechanism.stroke
        hips, rods = range(3, 3 + legs), range(3 + legs, 3 + 2 * legs)
        x, v, z = y[..., rods], rate[..., rods], y[..., [1]]
        own = [(f"{stroke / 2:g} - x", stroke / 2 - x), ("min(v, 0)", np.minimum(v, 0.0))]
        ropes = [(f"max(z - {h:g}, 0)", np.maximum(z - h, 0.0)) for h in ROPES]
        groups: tuple[tuple[Sequence[int], str, Iterable[tuple[str, Array]]], ...] = (
            (rods, "rods", rod_terms(x, v, stroke, CREEPS)),
            (rods, "rods", own),
            (hips, "hips", _hip_terms(y[..., hips], rate[..., hips], state.batch.torque)),
            ([1], "body z", _drag_terms("z", rate[..., [1]])),
            ([1], "body z", ropes),
            ([0], "body x", _drag_terms("x", rate[..., [0]])),
        )
        found: dict[str, Array] = {}
        for channels, name, terms in groups:
            listed = list(terms)
            columns = _force_columns(state, channels)(np.stack([f for _, f in listed], axis=-1))
            found |= {f"{t} [{name}]": c for (t, _), c in zip(listed, columns.T, strict=True)}
        return found
