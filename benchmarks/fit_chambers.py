"""Fit physical chambers to the paper's Tables I and II: where the defaults of orifice_chamber and
supply_line come from, and what chambers like these can meet (docs/physics.md).

    python benchmarks/fit_chambers.py

Locked chambers give the rise times of Table I, constant rates the force-velocity lines of Table
II; both are read off the bench rig of the model itself. Prints the fitted figures and, entry by
entry, what the tables say and what the model gives.
"""

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from kemba.effects.mechanics.piston import PistonDamping, SealFriction
from kemba.effects.pneumatics.flow import ATMOSPHERE
from kemba.effects.pneumatics.hose import HoseLag
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.effects.pneumatics.supply import SupplyLine
from kemba.effects.pneumatics.valve import Valve
from kemba.mechanism import load_cylinder, rig_mechanism
from kemba.model import Model

STROKE = 0.07
OPENING = 1e-3  # s; the valves' opening time, part of what Table I calls rise time
NAMES = ("a_fill", "a_vent", "V_e", "V_r", "gauge", "F_c", "c", "n", "a_line")
START = np.array([4.6e-6, 4.0e-6, 15e-6, 15e-6, 0.634e6, 6.8, 17.6, 1.32, 3.5e-6])
SIZE = np.array([1e-6, 1e-6, 3e-6, 3e-6, 2e4, 5.0, 10.0, 0.1, 5e-6])
LOWER = np.array([1e-6, 1e-6, 5e-6, 5e-6, 0.5e6, 0.0, 0.0, 1.0, 2e-6])
UPPER = np.array([1e-5, 1e-5, 4e-5, 4e-5, 0.75e6, 20.0, 40.0, 1.4, 1e-4])

RISE = {
    ("fill", 0.0): 0.008,
    ("fill", STROKE): 0.025,
    ("vent", 0.0): 0.013,
    ("vent", STROKE): 0.037,
}
# mode: valves, rates [m.s-1] over which the line is fitted, F_static [N], c_d [N.s.m-1]
LINES = {
    "extend": ((1, 0), np.linspace(0.05, 1.5, 12), 324.0, 97.0),
    "retract": ((0, 1), np.linspace(-1.5, -0.05, 12), -260.0, 84.0),
    "both": ((1, 1), np.linspace(0.05, 0.8, 12), 50.0, 59.0),
    "none": ((0, 0), np.linspace(-1.0, 1.0, 12), 0.0, 25.0),
}


def rig(values: np.ndarray) -> Model:
    """The bench rig with these figures, in the order of NAMES."""
    p = dict(zip(NAMES, values, strict=True))
    chamber = OrificeChamber(
        **{key: p[key] for key in ("a_fill", "a_vent", "V_e", "V_r", "n")},
        pressures=(0.7e6,),
        gauge=(p["gauge"],),
    )
    losses = [SealFriction(F_c=p["F_c"]), PistonDamping(c=p["c"]), SupplyLine(a=p["a_line"])]
    return Model(
        rig_mechanism(load_cylinder("dsnu-25-70")), [Valve(), HoseLag(T=OPENING), chamber, *losses]
    )


def functions(model: Model) -> tuple[ca.Function, ca.Function]:
    """(x, v, P, u) -> dP/dt and the force on the rod."""
    node = model.node
    zero = [ca.SX.zeros(n) for n in (1, 6, 0, 0)]
    arguments = [node.q, node.v, zero[0], node.s, zero[1], zero[2], node.u, zero[3]]
    rate = -node.residual(*arguments)[1]
    columns = [o.name for o in node.output_quantities]
    force = node.measure(*arguments)[columns.index("piston/F")]
    inputs = [node.q, node.v, node.s, node.u]
    return ca.Function("rate", inputs, [rate]), ca.Function("force", inputs, [force])


def at_rest(model: Model) -> dict[str, float]:
    """Effect states at rest by name, in the order of the model."""
    return {quantity.name: quantity.value for quantity in model.states.values()}


def rise_time(model: Model, chamber: int, mode: str, extension: float) -> float:
    """Time [s] to 63 % of the change of the locked chamber's force; its own extension given."""
    chambers = model.effect("orifice_chamber")
    full = float(np.interp(model.supply, chambers.pressures, chambers.gauge))
    x = extension if chamber == 0 else STROKE - extension
    name, fills = ("extend", "retract")[chamber], mode == "fill"
    u = np.zeros(2)
    u[chamber] = fills
    start = at_rest(model)
    start[f"chamber/{name}/P"] += 0.0 if fills else full
    start[f"hose/{name}/u"] = 0.0 if fills else 1.0
    level = ATMOSPHERE + full * ((1 - np.exp(-1)) if fills else np.exp(-1))
    row = list(start).index(f"chamber/{name}/P")
    rate, _ = functions(model)

    def reached(_: float, s: np.ndarray) -> float:
        return float(s[row] - level)

    reached.terminal = True  # type: ignore[attr-defined]
    answer = solve_ivp(
        lambda _, s: np.asarray(rate(x, 0, s, u)).ravel(), (0, 0.2), list(start.values()),
        "LSODA", events=reached, rtol=1e-6, atol=1e-4,
    )  # fmt: skip
    return float(answer.t_events[0][0])


def steady(model: Model, v: float, u: tuple[int, int]) -> float:
    """Force [N] once pressures and supply have settled at a constant rate [m.s-1]."""
    rate, force = functions(model)
    start = list(at_rest(model).values())
    answer = solve_ivp(
        lambda _, s: np.asarray(rate(0.035, v, s, u)).ravel(), (0, 0.3), start,
        "LSODA", rtol=1e-5, atol=1e-3,
    )  # fmt: skip
    return float(force(0.035, v, answer.y[:, -1], u))


def line(model: Model, mode: str) -> tuple[float, float]:
    """F_static and c_d of the straight line through the steady forces."""
    u, rates, *_ = LINES[mode]
    forces = [steady(model, v, u) for v in rates]
    slope, intercept = np.polyfit(rates, forces, 1)
    return float(intercept), float(-slope)


def table(model: Model) -> list[tuple[str, float, float, float]]:
    """(entry, tables' value, model's value, tolerance) in ms, N and N.s.m-1."""
    rows = []
    for (mode, extension), target in RISE.items():
        for chamber, name in enumerate(("extend", "retract")):
            value = 1e3 * rise_time(model, chamber, mode, extension)
            rows.append(
                (
                    f"{mode} {name} at {1e3 * extension:.0f} mm [ms]",
                    1e3 * target,
                    value,
                    50 * target,
                )
            )
    for mode, (_, _, force, damping) in LINES.items():
        found = line(model, mode)
        rows.append((f"{mode} F_static [N]", force, found[0], 5.0))
        if mode in ("extend", "retract"):
            held = steady(model, 0.0, LINES[mode][0])
            rows.append((f"{mode} F_static, rod held [N]", force, held, 8.0))
        rows.append((f"{mode} c_d [N.s.m-1]", damping, found[1], 8.0))
    return rows


def main() -> None:
    def misfit(scaled: np.ndarray) -> np.ndarray:
        rows = table(rig(START + scaled * SIZE))
        return np.array([(value - target) / tolerance for _, target, value, tolerance in rows])

    bounds = ((LOWER - START) / SIZE, (UPPER - START) / SIZE)
    fit = least_squares(misfit, np.zeros(len(START)), bounds=bounds, diff_step=1e-3)
    values = START + fit.x * SIZE
    for name, value in zip(NAMES, values, strict=True):
        print(f"{name:7s} {value:.4g}")
    for entry, target, value, _ in table(rig(values)):
        print(f"{entry:32s} {target:8.1f} {value:8.1f}")


if __name__ == "__main__":
    main()
