"""Formulas of the user's own: parsed without eval, checked for their dimension."""

import ast
import time
from typing import Any

import numpy as np
import pytest

from kemba.config import parse
from kemba.effects import Effect
from kemba.effects.formula import FUNCTIONS, evaluate, parse_formula
from kemba.errors import KembaError
from kemba.model import load_model
from kemba.model.spec import ModelSpec

F0 = {"F0": "8 N"}
MAGNET = {"on": "piston", "force": "-F0*exp(-(x/d)**2)", "parameters": {**F0, "d": "5 mm"}}


def expression(**fields: Any) -> Effect:
    """The effect of a YAML item."""
    item = {"kind": "expression", "name": "magnet", **fields}
    return parse({"effects": [item]}, ModelSpec).effects[0]


def rig_force(effect: Effect, x: float, v: float) -> float:
    """What an expression adds to a rig's rod."""
    total = []
    for extra in ([effect], []):
        node = load_model(extra=extra, rig=True).node
        names = [o.name for o in node.output_quantities]
        s = np.zeros(node.s.numel())
        y = node.measure(q=x, v=v, a=0, s=s, sd=s, lam=[], u=[0, 0], p=[])["y"]
        total.append(float(y[names.index("piston/F")]))
    return total[0] - total[1]


def test_a_formula_is_its_force() -> None:
    magnet = expression(**MAGNET)
    assert magnet.name == "magnet"
    for x in (0.0, 0.003, 0.05):
        assert rig_force(magnet, x, 0.2) == pytest.approx(-8 * np.exp(-((x / 0.005) ** 2)))


def test_parameters_can_be_freed() -> None:
    magnet = expression(**MAGNET)
    assert {n: p.unit for n, p in magnet.parameters().items()} == {"F0": "N", "d": "m"}
    model = load_model(extra=[magnet], rig=True)
    assert model.parameters["magnet.F0"][1] == 8.0
    node = model.build(["magnet.F0"])
    s = np.zeros(2)
    y = node.measure(q=0, v=0, a=0, s=s, sd=s, lam=[], u=[0, 0], p=[3.0])["y"]
    assert float(y[[o.name for o in node.output_quantities].index("piston/F")]) == -3.0
    assert magnet.bind({"F0": 3.0}).listed()["parameters"] == {"F0": "3.0 N", "d": "0.005 m"}


def test_one_leg_is_named_with_the_port() -> None:
    one = expression(**{**MAGNET, "on": "front/piston"})
    assert one.name == "magnet:front"
    labels = [i.label for i in load_model(extra=[one]).instances]
    assert "front/magnet:front" in labels and "rear/magnet:front" not in labels


@pytest.mark.parametrize(
    "on, force, parameters",
    [
        ("hip", "-T*tanh(w/w0)", {"T": "1 N.m", "w0": "3 rad.s-1"}),
        ("hip", "-k*(q - q0)", {"k": "1 N.m.rad-1", "q0": "10 deg"}),
        ("body_z", "-k*max(0, z - z0)", {"k": "80 N/m", "z0": "30 cm"}),
        ("pitch", "-b*v", {"b": "1 N.m.s.rad-1"}),
        ("piston", "-mu*(F_e + F_r)*tanh(v/v0)", {"mu": 0.1, "v0": "1 cm/s"}),
        ("piston", "-c*max(v, 0)*u_e", {"c": "4 N.s/cm"}),
        ("piston", "-c*sqrt(abs(v))**4", {"c": "4 N.s2.m-2"}),
    ],
)
def test_physics_of_every_port_is_accepted(on: str, force: str, parameters: dict[str, Any]) -> None:
    effect = expression(on=on, force=force, parameters=parameters)
    assert load_model(extra=[effect]).node.dynamics.numel() == 7


@pytest.mark.parametrize(
    "fields, sentence",
    [
        ({"force": "-F0*exp(-(x/d)^2)"}, "'^' is no power here; write '**'"),
        ({"force": "-F0*tanh(v/0.1)"}, "the argument of 'tanh(v / 0.1)' is a speed; divide it by"),
        ({"force": "-F0*x"}, "'-F0 * x' is a torque; a force (N) was expected"),
        ({"force": "F0*x + F0"}, "'F0 * x + F0' mixes a torque with a force"),
        ({"force": "F0*vv"}, "reads the unknown 'vv'; did you mean 'v'?"),
        ({"force": "F0*tanhh(u_e)"}, "unknown function 'tanhh'; did you mean 'tanh'?"),
        ({"force": "F0*sign(v)"}, "'sign' jumps; write a smooth tanh(v/v_s)"),
        ({"force": "F0 if x else 0"}, "cannot stand in a formula"),
        ({"force": "F0.real"}, "'F0.real' cannot stand in a formula"),
        ({"force": "F0*(lambda: 1)()"}, "unknown function 'lambda: 1'"),
        ({"force": "__import__('os').getcwd()"}, "unknown function '__import__('os').getcwd'"),
        ({"force": "F0*[1][0]"}, "cannot stand in a formula"),
        ({"force": "F0*'1'"}, "is not a number"),
        ({"force": "F0*"}, "is not a formula"),
        ({"force": "(" * 300 + "F0" + ")" * 300}, "is longer than 500 characters"),
        ({"force": "F0*max(1, 2, 3)"}, "'max' takes 2 arguments"),
        ({"force": "F0**u_e"}, "to a power that is not a plain number"),
        ({"force": "1"}, "the parameter 'F0' is not in '1'"),
        ({"force": "x*F0", "parameters": {"x": "1 N", **F0}}, "'x' needs another name"),
        ({"force": "F0", "on": "pistn"}, "no port 'pistn'; did you mean 'piston'?"),
        ({"force": "F0", "on": "front/body_z"}, "'body_z' belongs to no leg"),
        ({"force": "F0", "parameters": {"F0": "8 Nx"}}, "unknown unit 'Nx'"),
    ],
)
def test_mistakes_are_explained(fields: dict[str, Any], sentence: str) -> None:
    with pytest.raises(KembaError) as caught:
        expression(**{"on": "piston", "parameters": {**F0}, **fields})
    assert sentence in str(caught.value).replace("\n", " ")


@pytest.mark.parametrize(
    "force, sentence",
    [
        ("F0*9**9**9**9", "'9 ** 9 ** 9' has no finite value"),
        ("F0*log(9**9**9)", "'9 ** 9 ** 9' has no finite value"),
        ("F0*10**400", "'10 ** 400' has no finite value"),
        ("F0*1" + "0" * 400, "has no finite value"),
        ("F0*(1/0)", "'1 / 0' has no finite value"),
        ("F0*(-1)**0.5", "'(-1) ** 0.5' has no finite value"),
        ("F0*0**-1", "'0 ** (-1)' has no finite value"),
        ("F0*2**5000", "'2 ** 5000' has no finite value"),
        ("F0*log(0)", "'log(0)' has no finite value"),
        ("F0*sqrt(-1)", "'sqrt(-1)' has no finite value"),
        ("-" * 490 + "F0", "is nested deeper than 40 operations"),
        ("F0" + "+F0" * 150, "is nested deeper than 40 operations"),
        ("F0*max(u_e, " * 35 + "0" + ")" * 35, "is nested deeper than 40 operations"),
        ("F0/u_e", "'F0 / u_e' has no finite value at F0 = 8, u_e = 0"),
        ("F0*log(u_e)", "has no finite value at F0 = 8, u_e = 0"),
        ("F0*(u_e - 0.5)**0.5", "has no finite value at F0 = 8, u_e = 0"),
        ("F0*exp(1e4*u_e)", "has no finite value at F0 = 8, u_e = 1"),
        ("F0*u_e**1e9*1e300*1e300", "has no finite value"),
    ],
)
def test_what_is_not_finite_is_refused_at_once(force: str, sentence: str) -> None:
    began = time.process_time()
    with pytest.raises(KembaError) as caught:
        expression(on="piston", force=force, parameters=F0)
    assert sentence in str(caught.value).replace("\n", " ")
    assert time.process_time() - began < 1.0


def test_constants_are_computed_once() -> None:
    assert ast.unparse(parse_formula("-(2*9.81)*F + sqrt(16)**(1/2)")) == "-19.62 * F + 2.0"


def test_every_function_can_be_called() -> None:
    for name in FUNCTIONS:
        arguments = "0.5, 0.25" if name in ("min", "max") else "0.5"
        assert np.isfinite(float(evaluate(parse_formula(f"{name}({arguments})"), {})))
