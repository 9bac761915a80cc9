"""Where chambers, hoses and supply come to rest."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kemba.contract.cases import Placed
from kemba.effects import BY_KIND, EFFECTS
from kemba.errors import KembaError
from kemba.model import Model, load_model
from kemba.model.rest import Rest, at_rest
from kemba.quantity import Quantity

VALVES = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]


def rate(model: Model, q: np.ndarray, u: np.ndarray, s: np.ndarray) -> np.ndarray:
    """ds/dt (ns,) in a held pose."""
    node = model.node
    zero = [np.zeros(x.numel()) for x in (node.v, node.a, node.lam, node.p)]
    v, a, lam, p = zero
    return -np.asarray(node.residual(q, v, a, s, 0.0 * s, lam, u, p)[1]).ravel()


@pytest.mark.parametrize("name", ["planning", "plant"])
@pytest.mark.parametrize("valves", VALVES)
def test_rest_is_what_a_long_wait_leads_to(name: str, valves: tuple[float, float]) -> None:
    model = load_model(name, rig=True)
    q, u = np.array([0.03]), np.array(valves)
    start = np.array([quantity.value for quantity in model.states.values()])
    waited = solve_ivp(lambda _, s: rate(model, q, u, s), (0.0, 5.0), start, "LSODA",
                       rtol=1e-9, atol=1e-7).y[:, -1]  # fmt: skip
    scale = np.array([quantity.scale for quantity in model.states.values()])
    found = at_rest(model, q, u)
    assert found / scale == pytest.approx(waited / scale, abs=2e-3)
    assert np.abs(rate(model, q, u, found) / scale).max() < 1e-3  # a leak goes on for ever


@pytest.mark.parametrize("kind", [k for k, e in BY_KIND.items() if e in EFFECTS and e.moves])
def test_without_commands_every_state_rests_at_its_nominal_value(kind: str) -> None:
    """Unknown initial states and start guesses begin there: it must be where the machine is."""
    model = Placed(BY_KIND[kind]).model
    standing = model.mechanism.standing
    q = np.array([standing.get(c.name, c.value) for c in model.mechanism.coordinates])
    found = at_rest(model, q, np.zeros(len(model.inputs)))
    for value, quantity in zip(found, model.states.values(), strict=True):
        assert value == pytest.approx(quantity.value, abs=1e-4 * quantity.scale), quantity.name


def test_what_grows_without_bound_is_told_once(capfd: pytest.CaptureFixture[str]) -> None:
    """The integrator prints nothing of its own beside it."""
    s = ca.SX.sym("s")
    with pytest.raises(KembaError, match="does an effect feed itself"):
        Rest(s, [], 1.0 + s**2, [Quantity("a/s", "N", 1.0)])()
    assert capfd.readouterr() == ("", "")
