"""Every effect at once, in any order, with either kind of chamber."""

import numpy as np
import pytest

from kemba.contract.cases import example, points, slopes, values_of
from kemba.effects.catalogue import DRIVE, MISSING, SENSORS
from kemba.effects.expression import Expression
from kemba.effects.pneumatics.gas import GasTemperature
from kemba.model import Model, load_spec
from kemba.model.spec import build_model

ELSEWHERE = (*SENSORS, *DRIVE)
EVERY = [example(effect) for effect in (*MISSING, Expression) if effect not in ELSEWHERE]
CHAMBERS = pytest.mark.parametrize("chambers", ["first_order", "orifice"])


def model_with_all(chambers: str, rig: bool = False) -> Model:
    spec = load_spec("planning").model_copy(update={"chambers": chambers})
    every = [e for e in EVERY if not rig or set(e.ports) <= {"piston"}]
    if chambers == "orifice":
        every = [*every, GasTemperature()]
    else:
        every = [e for e in every if not e.needs]
    return build_model(spec, extra=every, rig=rig)


@CHAMBERS
@pytest.mark.parametrize("rig", [False, True], ids=["robot", "rig"])
def test_residual_and_gradient_are_finite(chambers: str, rig: bool) -> None:
    model = model_with_all(chambers, rig)
    free = list(model.parameters)
    p = [value for _, value in model.parameters.values()]
    both = slopes(model, free)
    for point in points(model):
        for name, value in both(**point, p=p).items():
            assert np.isfinite(np.asarray(value)).all(), name


@CHAMBERS
def test_order_does_not_matter(chambers: str) -> None:
    model = model_with_all(chambers)
    rng = np.random.default_rng(5)
    shuffled = [model.effects[i] for i in rng.permutation(len(model.effects))]
    other = Model(model.mechanism, shuffled, model.supply)
    assert [q.name for q in other.states.values()] == [q.name for q in model.states.values()]
    for point in points(model, 3):
        for part, value in values_of(model, point).items():
            np.testing.assert_allclose(values_of(other, point)[part], value, rtol=1e-12, atol=1e-9)
