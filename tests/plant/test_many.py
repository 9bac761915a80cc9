"""Many simulations side by side, and machine code shared by models that differ in numbers."""

import threading

import numpy as np
import pytest
from plant.scripts import planning, under_the_hips

from kemba.effects.mechanics.boom import Boom
from kemba.effects.mechanics.ground import GroundFriction
from kemba.effects.mechanics.load import Payload
from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.plant.commands import Commands, Profile
from kemba.plant.equations import equations_of
from kemba.plant.simulate import Condition, Simulated, run, run_many

PUSH = Commands({f"{leg}/valve/extend": Profile.pulses((0.0, 0.1)) for leg in ("front", "rear")})


def same(one: Simulated, other: Simulated, within: float = 0.0) -> None:
    assert one.trajectory.headers == other.trajectory.headers
    for name in ("body/z", "body/pitch", "front/foot/Fz", "rear/hip/tau", "front/chamber/extend/F"):
        difference = np.abs(one.trajectory[name] - other.trajectory[name]).max()
        assert difference <= within * (1.0 + np.abs(other.trajectory[name]).max()), name


def test_side_by_side_is_as_one_by_one() -> None:
    light = planning()
    heavy = [light.with_effects([Payload(m=m)]) for m in (0.2, 0.4)]
    feedback = Commands(PUSH.profiles, under_the_hips)
    conditions = [
        Condition(light, {}, PUSH, 0.15),
        Condition(heavy[0], {"body/pitch": 0.02}, PUSH, 0.15),
        Condition(heavy[1], {}, feedback, 0.12, 2e-4, 2e-3),
        Condition(light, {"body/z": 0.5}, None, 0.3, dead_time=False),
    ]
    done = run_many(conditions, jobs=2)
    assert len(done) == len(conditions)
    for condition, found in zip(conditions, done, strict=True):
        assert isinstance(found, Simulated)
        same(found, run(**vars(condition)))


def test_models_that_differ_in_numbers_share_their_machine_code() -> None:
    model = planning()
    variants = [
        model.with_effects([GroundFriction(mu=mu), Boom(mass=mass)])
        for mu, mass in ((0.3, 2.7), (0.5, 2.7), (0.3, 3.5), (0.9, 2.0))
    ]
    known = [equations_of(variant) for variant in variants]
    assert known[2] is known[3]
    assert set(known[3].free) == {"ground_friction.mu", "boom.mass"}
    for variant in variants:
        alone = Model(load_model("planning").mechanism, variant.effects, variant.supply)
        assert equations_of(alone).free == ()
        start = {"body/vx": 0.5}
        same(run(variant, start, PUSH, 0.15), run(alone, start, PUSH, 0.15), within=1e-6)


def test_models_that_are_simulated_together_share_it_from_the_beginning() -> None:
    model = planning()
    variants = [model.with_effects([GroundFriction(mu=mu)]) for mu in (0.3, 0.5, 0.9)]
    run_many([Condition(variant, {}, PUSH, 0.05) for variant in variants])
    known = [equations_of(variant) for variant in variants]
    assert known[0] is known[1] is known[2] and "ground_friction.mu" in known[0].free


def test_models_with_other_supplies_share_their_machine_code() -> None:
    """Also beyond the pressures of their tables."""
    model = planning()
    variants = [Model(model.mechanism, model.effects, p) for p in (0.7e6, 0.55e6, 0.66e6, 0.9e6)]
    known = [equations_of(variant) for variant in variants]
    assert known[1] is known[2] is known[3] and known[3].free == ("supply",)
    for variant in variants:
        alone = Model(load_model("planning").mechanism, variant.effects, variant.supply)
        assert equations_of(alone).free == ()
        same(run(variant, {}, PUSH, 0.15), run(alone, {}, PUSH, 0.15), within=1e-6)


def test_models_that_differ_in_tables_share_their_machine_code() -> None:
    """As fits of the air do."""
    model = load_model("planning")
    air = model.effect("chamber")
    weak = air.model_copy(update={"F_extend": tuple(0.9 * F for F in air.F_extend)})
    slow = air.model_copy(update={"fill": tuple(1.3 * tau for tau in air.fill)})
    limp = model.effect("mode_damping").model_copy(update={"c_none": 60.0})
    variants = [model.with_effects(list(e)) for e in ((), (weak,), (slow,), (weak, limp), (slow,))]
    known = [equations_of(variant) for variant in variants]
    assert known[3] is known[4] and known[3].free == ("mode_damping.c_none",)
    scaled = {name.partition("[")[0] for name in known[3].scaled}
    assert scaled == {f"chamber.{name}" for name in ("F_extend", "F_retract", "fill", "vent")}
    for variant in variants:
        alone = Model(load_model("planning").mechanism, variant.effects, variant.supply)
        same(run(variant, {}, PUSH, 0.15), run(alone, {}, PUSH, 0.15), within=1e-6)


def test_machine_code_does_not_depend_on_what_was_simulated_before() -> None:
    first = load_model("planning")
    limp = first.effect("mode_damping").model_copy(update={"c_none": 60.0})
    equations_of(first)
    assert equations_of(first.with_effects([limp])).free == ("mode_damping.c_none",)
    assert equations_of(load_model("planning")).free == ()


def test_equal_models_have_their_machine_code_once() -> None:
    first, again = load_model("planning"), load_model("planning")
    assert first.mechanism is not again.mechanism
    assert equations_of(first) is equations_of(again)
    others = load_model("planning", [Payload(m=0.3)]), load_model("planning", supply=0.6e6)
    assert equations_of(first) not in [equations_of(other) for other in others]
    same(run(again, {}, PUSH, 0.15), run(first, {}, PUSH, 0.15))


def test_other_threads_run_while_one_simulates() -> None:
    """Python's own lock is free meanwhile: else this thread would hardly count."""
    condition = Condition(planning(), {"body/z": 2.0}, None, 1.0, 2e-5, 0.5)
    run(**vars(condition))
    worker = threading.Thread(target=run, kwargs=vars(condition))
    worker.start()
    count = 0
    while worker.is_alive():
        count += 1
    assert count > 10_000


def test_one_that_fails_does_not_stop_the_others() -> None:
    buried = Condition(planning(), {"body/z": 0.1}, None, 0.02)
    fine = Condition(planning(), {}, None, 0.02)
    done = run_many([fine, buried, fine], jobs=2)
    assert isinstance(done[1], KembaError) and "too deep" in str(done[1])
    assert isinstance(done[0], Simulated) and isinstance(done[2], Simulated)


def test_a_condition_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(KembaError, match="no state"):
        run_many([Condition(planning(), {"body/zz": 1.0})])
