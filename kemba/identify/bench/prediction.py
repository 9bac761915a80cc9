"""What a bench log should read under a model, with effects on its list and sensors as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kemba.effects.base import Effect
from kemba.identify.bench.bench_log import PRESSURES, BenchLog
from kemba.identify.bench.motion import SmoothedMotion
from kemba.identify.bench.pressure import absolute_pressure
from kemba.identify.bench.rig_model import Prediction, RigModel, share
from kemba.identify.bench.switching import delayed
from kemba.identify.evidence.candidates import by_default
from kemba.identify.evidence.problem import Array, Candidate, Theta
from kemba.model.model import Model


class Predictor:
    """Rigs of one model, each compiled once with the effects that theta switches on.

    `figures`: nominal numbers of the model that theta may change, by name.
    """

    def __init__(self, model: Model, candidates: Mapping[str, Candidate]) -> None:
        self.model, self.candidates = model, candidates
        self.figures = _figures(model)
        self._rigs: dict[tuple[str, ...], RigModel] = {}

    def rig(self, theta: Theta) -> RigModel:
        """The rig with the effects on its list that theta switches on."""
        active = tuple(
            name
            for name, c in sorted(self.candidates.items())
            if not c.sensor and theta.get(c.key, c.lead.off) != c.lead.off
        )
        if active not in self._rigs:
            extra = [by_default(self.candidates[name].effect) for name in active]
            model = self.model.with_effects(_unlike(self.model, extra))
            keys = (key for name in active for key in tuple(self.candidates[name].keys()))
            free = tuple(key for key in keys if key in model.parameters)
            self._rigs[active] = RigModel(model, free, self.figures)
        return self._rigs[active]

    def predict(
        self, run: BenchLog, theta: Theta, start: Mapping[str, float] | None = None
    ) -> Prediction:
        """What happens on the rig, before any sensor; `start`: states beyond their usual."""
        rig = self.rig(theta)
        nominal = dict.fromkeys(self.figures, 1.0)
        values = {name: theta.get(name, nominal.get(name, 0.0)) for name in rig.names}
        return rig.predict(true_motion(run.motion, theta), run.commands, values, start or {})

    def readings(
        self, run: BenchLog, theta: Theta, start: Mapping[str, float]
    ) -> dict[str, tuple[Array, Array]]:
        """Per channel (n,): what should have been measured, and its variance."""
        p = self.predict(run, theta, start)
        out = {"piston/F": _force(p, run, theta)}
        cylinder = self.model.mechanism.need_cylinder()
        for channel in PRESSURES:
            if channel in run.measured:
                value = absolute_pressure(channel, p.states, cylinder)
                out[channel] = _pressure(channel, value, run, theta)
        return out

    def acting(self, run: BenchLog, theta: Theta) -> Array:
        """Share of each sample's neighbourhood in which the valves act (n, 2)."""
        delays = self.rig(theta).timing(theta)
        times = run.motion.time
        return np.stack([share(delayed(c, *delays), times) for c in run.commands], axis=1)


def true_motion(motion: SmoothedMotion, theta: Theta) -> SmoothedMotion:
    """The motion that made the position sensor say what it said."""
    k = theta.get("sensor_scale:piston/x.k", 0.0)
    b = theta.get("sensor_bias:piston/x.b", 0.0)
    dt = theta.get("sensor_delay:piston/x.dt", 0.0)
    if k == b == dt == 0.0:
        return motion
    later = motion.time + dt
    x, v, a = (np.interp(later, motion.time, c) for c in (motion.x, motion.v, motion.a))
    return replace(motion, x=(x - b) / (1 + k), v=v / (1 + k), a=a / (1 + k))


def _force(p: Prediction, run: BenchLog, theta: Theta) -> tuple[Array, Array]:
    """The transducer's reading and its variance: sensor, velocity error, switching instants."""
    force, valve = p.force, p.valve
    dt = theta.get("sensor_delay:piston/F.dt", 0.0)
    if dt:
        earlier = run.motion.time - dt
        force = np.interp(earlier, run.motion.time, force)
        valve = np.stack([np.interp(earlier, run.motion.time, c) for c in valve.T], axis=1)
    force = (1 + theta.get("sensor_scale:piston/F.k", 0.0)) * force
    force = force + theta.get("sensor_bias:piston/F.b", 0.0)
    variance = run.sigma["piston/F"] ** 2 + run.blunt**2
    variance = variance + np.sum(p.by_valve**2 * valve * (1 - valve), axis=1)
    return force, variance


def _pressure(channel: str, value: Array, run: BenchLog, theta: Theta) -> tuple[Array, Array]:
    gain, offset = theta.get(f"gain:{channel}", 1.0), theta.get(f"offset:{channel}", 0.0)
    return gain * value + offset, np.full(len(value), run.sigma[channel] ** 2)


def _figures(model: Model) -> tuple[str, ...]:
    """Nominal numbers that a rig of the same make may have a little different."""
    known = {
        "chamber": ("F_extend", "F_retract", "fill[0]", "fill[1]", "vent[0]", "vent[1]"),
        "mode_damping": ("c_extend", "c_retract", "c_both", "c_none"),
        "orifice_chamber": ("gauge", "a_fill", "a_vent", "V_e", "V_r"),
    }
    names = []
    for effect in model.effects:
        if effect.kind in known:
            names += [f"{effect.name}.{f}" for f in known[effect.kind]]
        elif effect.off and all(p.unit != "s" for p in effect.parameters().values()):
            names += [f"{effect.name}.{f}" for f in effect.off]
    return tuple(names)


def _unlike(model: Model, extra: list[Effect]) -> list[Effect]:
    """Effects not on the model's list already; those that are stay as they are."""
    names = {e.name for e in model.effects}
    return [e for e in extra if e.name not in names]
