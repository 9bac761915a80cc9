"""The same effect in other code makes the same motion: the catalogue against the blind twin."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pytest

from kemba.effects import BY_KIND, Effect
from kemba.effects.catalogue import SENSORS
from kemba.effects.mechanics.piston import PistonDamping
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.model import Model, load_model
from kemba.plant.commands import Commands, Profile
from kemba.plant.simulate import simulate

pytest.importorskip("numba")
from twin import figures
from twin.catalogue import CATALOGUE, hidden
from twin.figures import STANCE_Z, Robot
from twin.run import simulate as twin
from twin.scripts import clock, in_air, script
from twin.valves import VALVES

# in flight and short of the stops, whose softness differs
DURATION = 0.060  # s
PULSES = ((0, 0.004, 0.030), (1, 0.007, 0.036), (2, 0.002, 0.030), (3, 0.005, 0.036))
TORQUE = (4.0, -3.0)  # N.m
RATES = (0.3, 1.0, 0.8, 1.0, -0.6, 0.15, 0.2)
COLUMNS = ("body/x", "body/z", "body/pitch", "front/hip/q", "rear/hip/q")
COLUMNS += ("front/piston/x", "rear/piston/x")
OTHER = {"stribeck_friction": {"v_b": 0.3}}  # so that it lasts
GROUND = {"ground_compliance", "ground_friction"}
KINDS = sorted(
    kind
    for kind, entry in CATALOGUE.items()
    if entry.known and kind not in GROUND and BY_KIND[kind] not in SENSORS
)


@dataclass(frozen=True)
class Flight:
    """Start, commands and duration of one motion, for either simulator."""

    z: float
    x: float  # m, both pistons
    rates: tuple[float, ...]
    pulses: tuple[tuple[int, float, float], ...] = ()
    torque: tuple[float, float] = (0.0, 0.0)  # N.m
    duration: float = DURATION

    def twin(self, *effects: dict, ground: bool = False, **options: object) -> np.ndarray:
        """Coordinates (n, 7) every ms."""
        ticks = clock(self.duration)
        feed = np.tile(self.torque, (ticks.size, 1))
        start = in_air(self.z, pistons=(self.x, self.x), rates=self.rates)
        motion = script("flight", ticks, self.pulses, start, follow=0.0, kp=0.0, kd=0.0, feed=feed)
        return twin(motion, list(effects), ground=ground, settle=False, **options).y[::2]

    def kemba(self, model: Model) -> np.ndarray:
        """Coordinates (n, 7) every ms."""
        profiles = {VALVES[v]: Profile.pulses((on, off)) for v, on, off in self.pulses}
        pose, knee = in_air(self.z, pistons=(self.x, self.x)), knee_rate(model, self.x)
        initial = {"body/z": self.z}
        initial |= dict(zip(("body/vx", "body/vz", "body/pitch_rate"), self.rates, strict=False))
        for i, (leg, fold) in enumerate((("front", 1), ("rear", -1))):
            profiles[f"{leg}/hip/tau"] = Profile.constant(self.torque[i])
            initial |= {f"{leg}/hip/q": pose.hips[i], f"{leg}/piston/x": self.x}
            initial[f"{leg}/hip/w"] = self.rates[3 + i]
            initial[f"{leg}/knee/w"] = fold * knee * self.rates[5 + i]
        done = simulate(model, initial, Commands(profiles), self.duration, step=5e-5)
        return np.stack([done[name] for name in COLUMNS], axis=1)


FLIGHT = Flight(0.8, 0.03, RATES, PULSES, TORQUE)


@lru_cache
def knee_rate(model: Model, x: float) -> float:
    """Knee rate per piston rate, for the knee that folds counter-clockwise."""
    dx = 1e-5
    ends = [
        simulate(model, {"front/piston/x": x + s}, duration=1e-4)["front/knee/q"][0]
        for s in (0.0, dx)
    ]
    return float(ends[1] - ends[0]) / dx


@lru_cache
def usual() -> np.ndarray:
    return FLIGHT.twin()


def listed(kind: str) -> Effect:
    """The effect at its size, as the twin has it."""
    values = CATALOGUE[kind].sized(1.0) | OTHER.get(kind, {})
    return BY_KIND[kind].model_validate({"kind": kind, **values})


def test_the_planning_models_agree() -> None:
    np.testing.assert_allclose(FLIGHT.kemba(load_model()), usual(), atol=3e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_an_effect_moves_both_alike(kind: str) -> None:
    moved = FLIGHT.twin(hidden(kind, **OTHER.get(kind, {})))
    shift = np.abs(moved - usual()).max()
    assert shift > 2e-5, "the flight shows the effect"
    found = FLIGHT.kemba(load_model(extra=[listed(kind)]))
    np.testing.assert_allclose(found, moved, atol=5e-6 + 1e-3 * shift)


def test_physical_chambers_move_both_alike() -> None:
    """Same orifices; the flow is rounded differently near equal pressures."""
    air = Robot().air[0]
    chamber = OrificeChamber(
        a_fill=air[figures.N_FILL],
        a_vent=air[figures.N_VENT],
        V_e=air[figures.N_DEAD_E],
        V_r=air[figures.N_DEAD_R],
        n=figures.KAPPA,
        pressures=(0.7e6,),
        gauge=(air[figures.N_PS] - figures.ATMOSPHERE,),
    )
    model = load_model(extra=[chamber, PistonDamping(c=air[figures.N_ROD_C])])
    wanted = FLIGHT.twin(chambers="orifice")
    assert np.abs(wanted - usual()).max() > 1e-2
    np.testing.assert_allclose(FLIGHT.kemba(model), wanted, atol=5e-4)


def test_a_compliant_floor_catches_both_alike() -> None:
    """The twin's friction is a spring, kemba's is Coulomb's: hardly any slip here."""
    drop = Flight(STANCE_Z + 0.01, 0.0, (0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0), duration=0.04)
    wanted = drop.twin(hidden("ground_compliance"), ground=True)[:, 1]
    found = drop.kemba(load_model(extra=[listed("ground_compliance")]))[:, 1]
    assert STANCE_Z - wanted.min() > 0.008
    np.testing.assert_allclose(found, wanted, atol=1e-3)


@pytest.mark.parametrize("kind", sorted(k for k, entry in CATALOGUE.items() if entry.known))
def test_names_units_sizes_and_signs_agree(kind: str) -> None:
    entry, effect = CATALOGUE[kind], BY_KIND[kind]
    declared = effect.declared()
    for name, (_, size) in entry.parameters.items():
        assert declared[name].unit == entry.unit[name]
        if name == entry.leading:
            assert declared[name].size == size
        else:
            assert effect.model_fields[name].default == size, "shapes default to a typical value"
    if kind != "ground_compliance":
        assert dict(effect.off) == {entry.leading: pytest.approx(entry.neutral, abs=1e-4)}
        assert (declared[entry.leading].lower < effect.off[entry.leading]) == entry.signed
