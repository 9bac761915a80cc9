"""The same effect in other code makes the same motion: the catalogue against the blind twin."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from kemba.effects import BY_KIND
from kemba.effects.catalogue import SENSORS
from kemba.model import load_model
from kemba.plant import Commands, Profile, simulate

pytest.importorskip("numba")
from twin.catalogue import CATALOGUE, hidden
from twin.run import simulate as twin
from twin.scripts import clock, in_air, script
from twin.valves import VALVES

# in flight and short of the stops, whose softness differs
DURATION = 0.060  # s
PULSES = [(0, 0.004, 0.030), (1, 0.007, 0.036), (2, 0.002, 0.030), (3, 0.005, 0.036)]
TORQUE = (4.0, -3.0)  # N.m
RATES = (0.3, 1.0, 0.8, 1.0, -0.6, 0.15, 0.2)
COLUMNS = ("body/x", "body/z", "body/pitch", "front/hip/q", "rear/hip/q")
COLUMNS += ("front/piston/x", "rear/piston/x")
GROUND = {"ground_compliance", "ground_friction"}
KINDS = sorted(
    kind
    for kind, entry in CATALOGUE.items()
    if entry.known and kind not in GROUND and BY_KIND[kind] not in SENSORS
)


@lru_cache
def twin_end(kind: str | None) -> np.ndarray:
    """Coordinates of the twin after the flight, and those of its start in kemba's terms."""
    ticks = clock(DURATION)
    feed = np.tile(TORQUE, (ticks.size, 1))
    start = in_air(0.8, pistons=(0.03, 0.03), rates=RATES)
    flight = script("flight", ticks, PULSES, start, follow=0.0, kp=0.0, kd=0.0, feed=feed)
    effects = [] if kind is None else [hidden(kind)]
    return twin(flight, effects, ground=False, settle=False).y[-1]


def kemba_end(kind: str | None) -> np.ndarray:
    """The same flight on the planning model."""
    extra = []
    if kind is not None:
        values = CATALOGUE[kind].sized(1.0)
        extra = [BY_KIND[kind].model_validate({"kind": kind, **values})]
    model = load_model("planning", extra=extra)
    profiles = {
        VALVES[v]: Profile.pulses((round(on, 4), round(off, 4))) for v, on, off in PULSES
    }
    for leg, torque in zip(("front", "rear"), TORQUE, strict=True):
        profiles[f"{leg}/hip/tau"] = Profile.constant(torque)
    pose = in_air(0.8, pistons=(0.03, 0.03))
    initial = {"body/z": pose.z, "front/hip/q": pose.hips[0], "rear/hip/q": pose.hips[1]}
    initial |= {"front/piston/x": 0.03, "rear/piston/x": 0.03}
    initial |= dict(zip(("body/vx", "body/vz", "body/pitch_rate"), RATES, strict=False))
    initial |= {"front/hip/w": RATES[3], "rear/hip/w": RATES[4]}
    knee = knee_rate(model)
    initial |= {"front/knee/w": knee * RATES[5], "rear/knee/w": -knee * RATES[6]}
    end = simulate(model, initial, Commands(profiles), DURATION, step=5e-5)
    return np.array([end[name][-1] for name in COLUMNS])


def knee_rate(model) -> float:
    """Knee rate per piston rate at 0.03 m, for the knee that folds counter-clockwise."""
    x, dx = 0.03, 1e-5
    ends = [simulate(model, {"front/piston/x": x + s}, duration=1e-4)["front/knee/q"][0]
            for s in (-dx, dx)]
    return (ends[1] - ends[0]) / (2 * dx)


def test_the_planning_models_agree() -> None:
    np.testing.assert_allclose(kemba_end(None), twin_end(None), atol=2e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_an_effect_moves_both_alike(kind: str) -> None:
    shift = twin_end(kind) - twin_end(None)
    np.testing.assert_allclose(kemba_end(kind), twin_end(kind), atol=5e-6 + 1e-3 * abs(shift).max())
    if kind not in ("boom_spring", "end_cushion"):
        assert np.abs(shift).max() > 5e-5, "the flight shows the effect"
