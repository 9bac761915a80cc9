"""Contact and end stops: impacts, penetration, friction, step size."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant.scripts import affine, drop, jump, planning

from kemba.effects.mechanics.ground import GroundCompliance, GroundFriction
from kemba.events import peak
from kemba.plant.commands import Commands, Profile
from kemba.plant.kernel.events import CLOSED
from kemba.plant.simulate import run, simulate
from kemba.trajectory import Trajectory

LEGS = ("front", "rear")
WEIGHT = planning().mechanism.weight + 2.699 * 9.81 * 1.149 / 2.493  # N, with the boom's


def penetration(t: Trajectory) -> float:
    """The deepest that a foot or a piston has gone past its border [m]."""
    depths = [-t[f"{leg}/foot/z"].min() for leg in LEGS]
    depths += [-t[f"{leg}/piston/x"].min() for leg in LEGS]
    return float(max(*depths, *(t[f"{leg}/piston/x"].max() - 0.07 for leg in LEGS)))


@settings(max_examples=80, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    feet=st.tuples(st.booleans(), st.booleans()),
    stops=st.tuples(st.sampled_from([0.0, 0.03, 0.07]), st.sampled_from([0.0, 0.05, 0.07])),
)
def test_impacts_are_inelastic_and_never_add_energy(seed, feet, stops) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(seed)
    values = {f"{leg}/piston/x": x for leg, x in zip(LEGS, stops, strict=True)}
    values["body/pitch"] = rng.uniform(-0.3, 0.3)
    for leg, hip in ((leg, f"{leg}/hip/q") for leg in LEGS):
        values[hip] = planning().mechanism.standing[hip] + rng.uniform(-0.3, 0.3)
        values |= {f"{leg}/hip/w": rng.normal(0.0, 2.0), f"{leg}/knee/w": rng.normal(0.0, 2.0)}
    values |= {name: rng.normal(0.0, 2.0) for name in ("body/vx", "body/vz", "body/pitch_rate")}
    if not any(feet):
        values["body/z"] = 1.5  # else the lower foot stands on the ground
    done = run(planning(), values, None, 0.0)
    now = {name: done.trajectory[name][0] for name in done.trajectory.names}
    for leg in LEGS:
        x, v = now[f"{leg}/piston/x"], now[f"{leg}/piston/v"]
        assert now[f"{leg}/foot/z"] > CLOSED or now[f"{leg}/foot/vz"] > -1e-9
        assert x > CLOSED or v > -1e-9
        assert x < 0.07 - CLOSED or v < 1e-9
    for impact in done.impacts:
        assert impact.lost >= -1e-10
        assert impact.labels


@pytest.mark.parametrize("motion", [drop, jump])
def test_little_penetration_and_little_change_with_the_step(motion) -> None:  # type: ignore[no-untyped-def]
    coarse, fine = motion(step=1e-4).trajectory, motion(step=5e-5).trajectory
    assert penetration(coarse) < 1e-5
    assert np.abs(coarse["body/z"] - fine["body/z"]).max() < 2e-4
    assert peak(coarse.time, coarse["body/z"])[1] == pytest.approx(
        peak(fine.time, fine["body/z"])[1], abs=2e-5
    )


def test_no_step_of_a_landing_adds_energy() -> None:
    done = drop(duration=0.5)
    assert done.impacts
    assert all(impact.lost >= 0.0 for impact in done.impacts)
    assert {label.split(":")[0] for i in done.impacts for label in i.labels} >= {"front/contact"}


@pytest.mark.parametrize("mu", [0.0, 0.1, 1.0])
def test_the_energy_an_impact_loses_is_what_the_motion_loses(mu: float) -> None:
    """Kinetic energy before less after, from the mass matrix alone; feet slide on at mu < 1."""
    model = planning().with_effects([GroundFriction(mu=mu)])
    done = run(model, {"body/vx": 1.0, "body/vz": -2.0}, None, 0.0)
    (impact,) = done.impacts
    q, after = (
        np.array([done.trajectory[c.name][0] for c in columns])
        for columns in (model.mechanism.coordinates, model.mechanism.velocities)
    )
    v = np.zeros(len(q))
    v[:2] = 1.0, -2.0  # forward and down
    M = affine(model, q, v, 0.0, 0.0)[0]
    lost = 0.5 * float(v @ M @ v - after @ M @ after)
    assert impact.lost == pytest.approx(lost, rel=1e-9) and lost > 1.0
    slip = [done.trajectory[f"{leg}/foot/vx"][0] for leg in LEGS]
    assert (np.abs(slip).max() > 0.1) == (mu < 1.0)


def test_friction_stays_in_its_cone_and_against_the_slip() -> None:
    slippery = planning().with_effects([GroundFriction(mu=0.1)])
    start = {"body/vx": 1.0}
    t = simulate(slippery, start, duration=0.2)
    for leg in LEGS:
        normal, tangential, slip = (t[f"{leg}/foot/{n}"] for n in ("Fz", "Fx", "vx"))
        assert (np.abs(tangential) <= 0.1 * normal + 1e-9).all()
        sliding = (np.abs(slip) > 1e-3) & (normal > 1.0)
        assert sliding.sum() > 20
        assert np.allclose(tangential[sliding], -0.1 * normal[sliding] * np.sign(slip[sliding]))


def test_a_robot_at_rest_stays_at_rest() -> None:
    t = simulate(planning(), duration=0.2)
    assert np.abs(t["body/z"] - t["body/z"][0]).max() < 1e-9
    force = t["front/foot/Fz"] + t["rear/foot/Fz"]
    assert force == pytest.approx(WEIGHT, rel=1e-6)


def test_the_residual_holds_at_every_sample() -> None:
    """What is written satisfies the model's own residual: same physics as the other readers."""
    model, t = planning(), jump().trajectory
    node = model.node
    for row in (5, 90, 240, 300, 480):
        q = np.array([t[c.name][row] for c in model.mechanism.coordinates])
        v = np.array([t[c.name][row] for c in model.mechanism.velocities])
        s = np.array([t[x.name][row] for x in model.states.values()])
        lam = np.array([t[x.name][row] for x in model.forces.values()])
        u = np.array([t[x.name][row] for x in model.inputs.values()])
        M, F, B, f = affine(model, q, v, s, u)
        a = np.linalg.solve(M, F.ravel() + B @ lam)
        dynamics, *_ = node.residual(q, v, a, s, f, lam, u, [])
        assert np.abs(np.asarray(dynamics)).max() < 1e-8
        assert a[1] == pytest.approx(t["body/az"][row], abs=1e-6)


def test_a_compliant_floor_pushes_only_and_carries_the_weight() -> None:
    model = planning().with_effects([GroundCompliance(k=2e4)])
    landing = drop(model).trajectory
    assert landing["front/foot/Fz"].min() >= 0.0
    pressed = landing["front/foot/Fz"] > 1.0
    assert (landing["front/foot/z"][pressed] < 0.0).all()
    assert np.abs(landing["body/z"] - drop().trajectory["body/z"])[:220].max() < 1e-3
    standing = simulate(model, duration=0.6)
    assert standing["front/foot/z"][-1] == pytest.approx(-0.5 * WEIGHT / 2e4, rel=0.02)


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_tumbling_with_random_valves_and_torques_stays_physical(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start = {"body/z": rng.uniform(0.45, 0.6), "body/pitch": rng.normal(0.0, 0.4)}
    start |= {"body/vx": rng.normal(), "body/vz": rng.normal(-1.0), "body/pitch_rate": rng.normal()}
    for leg in LEGS:
        start |= {f"{leg}/piston/x": rng.uniform(0.0, 0.07), f"{leg}/hip/w": rng.normal(0.0, 8.0)}
    times = np.arange(0.0, 0.15, 0.02)
    inputs = {
        q.name: Profile.of(times, rng.integers(0, 2, 8) if q.binary else rng.normal(0, 8, 8))
        for q in planning().inputs.values()
    }
    done = run(planning(), start, Commands(inputs), 0.15, 2e-4)
    assert penetration(done.trajectory) < 2e-5
    assert all(impact.lost >= -1e-9 for impact in done.impacts)
