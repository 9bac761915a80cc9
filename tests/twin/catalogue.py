"""The effects that can be hidden in a log: names, parameters, sizes, and their place in the tables.

The kernels read two plain tables: `leg[2, :]` (per-leg effects) and `body[:]` (the rest).  Off = 0,
or 1 for scales.  Sensor effects never come here: see `measure`.
"""

from dataclasses import dataclass

import numpy as np

from .figures import STANCE_HIP, STANCE_Z

# Columns of the per-leg table.
(
    L_SUPPLY, L_RISE, L_HOSE, L_LEAK, L_BOTH,
    L_SEAL, L_STRIBECK, L_STRIBECK_V, L_PRESSURE, L_DAMP, L_QUAD, L_CUSHION, L_CUSHION_L, L_GAS,
    L_HIP_COULOMB, L_HIP_DAMP, L_TORQUE, L_MOTOR_LAG, L_HIP_SPRING, L_HIP_Q0, L_ROTOR,
    L_MAGNET, L_MAGNET_D, L_NEGATIVE, L_DAHL, L_DAHL_X, L_COGGING, L_COGGING_N, L_GEAR,
    L_CHECK, L_COUNT,
) = range(31)  # fmt: skip

# Columns of the body table.
(
    B_DROOP, B_DROOP_T, B_PAYLOAD, B_COM, B_FORCE, B_INERTIA, B_COULOMB, B_DAMP,
    B_SPRING, B_SPRING_Z, B_PITCH, B_GROUND_K, B_GROUND_D, B_MU,
    B_CABLE, B_CABLE_Z, B_DRAG, B_COUNT,
) = range(18)  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """One effect: where it lives and, per parameter, (table column, size that matters)."""

    room: str  # valve | leg | body
    parameters: dict[str, tuple[int, float]]
    unit: dict[str, str]
    signed: bool = False  # may the leading parameter go below its neutral value
    bench: bool = False  # can it show on the one-piston rig
    neutral: float = 0.0  # value of the leading parameter that means "nothing" (1 for scales)
    known: bool = True  # False: outside the catalogue that a discovery is told about

    @property
    def leading(self) -> str:
        return next(iter(self.parameters))

    def sized(self, size: float) -> dict[str, float]:
        """Parameters of an effect `size` times as large as what would matter in practice."""
        values = {name: typical for name, (_, typical) in self.parameters.items()}
        values[self.leading] = self.neutral + size * values[self.leading]
        return values


def _entry(room, *parameters, **options):
    return Entry(
        room,
        {name: (column, size) for name, column, size, _ in parameters},
        {name: unit for name, _, _, unit in parameters},
        **options,
    )


def _leg(*parameters, **options):
    return _entry("leg", *parameters, **options)


def _body(*parameters, **options):
    return _entry("body", *parameters, **options)


_PISTON = {"bench": True}
CATALOGUE: dict[str, Entry] = {
    # air and valves
    "valve_delay": _entry("valve", ("dt", -1, 0.002, "s"), signed=True, bench=True),
    "valve_close_delay": _entry("valve", ("dt", -2, 0.002, "s"), signed=True, bench=True),
    "supply_scale": _leg(("k", L_SUPPLY, 0.1, "1"), signed=True, bench=True, neutral=1.0),
    "supply_droop": _body(("D", B_DROOP, 0.05, "1"), ("T", B_DROOP_T, 0.3, "s"), bench=True),
    "rise_time_scale": _leg(("k", L_RISE, 0.25, "1"), signed=True, bench=True, neutral=1.0),
    "hose_lag": _leg(("T", L_HOSE, 0.004, "s"), **_PISTON),
    "cross_leak": _leg(("k", L_LEAK, 3.0, "s-1"), **_PISTON),
    "both_mode_loss": _leg(("F", L_BOTH, 15.0, "N"), signed=True, bench=True),
    # piston
    "seal_friction": _leg(("F_c", L_SEAL, 10.0, "N"), **_PISTON),
    "stribeck_friction": _leg(
        ("F_s", L_STRIBECK, 10.0, "N"), ("v_b", L_STRIBECK_V, 0.05, "m.s-1"), **_PISTON
    ),
    "pressure_friction": _leg(("mu", L_PRESSURE, 0.04, "1"), **_PISTON),
    "piston_damping": _leg(("c", L_DAMP, 15.0, "N.s.m-1"), signed=True, bench=True),
    "quadratic_damping": _leg(("c", L_QUAD, 40.0, "N.s2.m-2"), signed=True, bench=True),
    "end_cushion": _leg(
        ("c", L_CUSHION, 300.0, "N.s.m-1"), ("L", L_CUSHION_L, 0.010, "m"), **_PISTON
    ),
    "gas_spring": _leg(("k", L_GAS, 400.0, "N.m-1"), **_PISTON),
    # hip
    "hip_friction": _leg(("T_c", L_HIP_COULOMB, 0.6, "N.m")),
    "hip_damping": _leg(("b", L_HIP_DAMP, 0.1, "N.m.s.rad-1"), signed=True),
    "torque_scale": _leg(("k", L_TORQUE, 0.1, "1"), signed=True, neutral=1.0),
    "motor_lag": _leg(("T", L_MOTOR_LAG, 0.005, "s")),
    "hip_spring": _leg(("k", L_HIP_SPRING, 1.5, "N.m.rad-1")),
    "rotor_inertia": _leg(("J", L_ROTOR, 0.01, "kg.m2")),
    # body and boom
    "payload": _body(("m", B_PAYLOAD, 0.3, "kg")),
    "com_offset": _body(("d", B_COM, 0.02, "m"), signed=True),
    "boom_force": _body(("F", B_FORCE, 4.0, "N"), signed=True),
    "boom_inertia": _body(("m", B_INERTIA, 0.2, "kg")),
    "boom_friction": _body(("F", B_COULOMB, 2.0, "N")),
    "boom_damping": _body(("b", B_DAMP, 2.0, "N.s.m-1"), signed=True),
    "boom_spring": _body(("k", B_SPRING, 15.0, "N.m-1")),
    "pitch_friction": _body(("T", B_PITCH, 0.3, "N.m")),
    # ground
    "ground_compliance": _body(("k", B_GROUND_K, 2.0e4, "N.m-1")),
    "ground_friction": _body(("mu", B_MU, 0.4, "1"), signed=True, neutral=1.0),
    # not in the catalogue a discovery knows: it must say "unknown", or find the formula
    "magnet": _leg(
        ("F0", L_MAGNET, 15.0, "N"), ("d", L_MAGNET_D, 0.005, "m"), bench=True, known=False
    ),
    "negative_stiffness": _leg(("k", L_NEGATIVE, 500.0, "N.m-1"), bench=True, known=False),
    "hysteresis": _leg(
        ("F_h", L_DAHL, 15.0, "N"), ("x_h", L_DAHL_X, 0.006, "m"), bench=True, known=False
    ),
    "check_valve": _leg(("c", L_CHECK, 40.0, "N.s.m-1"), bench=True, known=False),
    "cogging": _leg(("T", L_COGGING, 0.8, "N.m"), ("n", L_COGGING_N, 14.0, "1"), known=False),
    "gear_loss": _leg(("mu", L_GEAR, 0.12, "1"), known=False),
    "cable_pull": _body(("k", B_CABLE, 80.0, "N.m-1"), ("z", B_CABLE_Z, 0.3, "m"), known=False),
    "boom_drag": _body(("c", B_DRAG, 2.5, "N.s2.m-2"), known=False),
    # the value drifts from run to run (warming air, a draining tank): see `cases`
    "temperature_drift": _leg(("c", L_DAMP, 40.0, "N.s.m-1"), bench=True, signed=True, known=False),
}

SENSOR_KINDS = {"sensor_bias": "b", "sensor_scale": "k", "sensor_delay": "dt"}
SENSOR_SIZES = {"sensor_bias": 5.0, "sensor_scale": 0.02, "sensor_delay": 0.003}  # bias: sigmas


def is_sensor(name: str) -> bool:
    return name.split(":")[0] in SENSOR_KINDS


def neutral_tables() -> tuple[np.ndarray, np.ndarray]:
    """(leg[2, :], body[:]) with every effect off."""
    leg, body = np.zeros((2, L_COUNT)), np.zeros(B_COUNT)
    leg[:, [L_SUPPLY, L_RISE, L_TORQUE]] = 1.0
    leg[:, L_STRIBECK_V], leg[:, L_CUSHION_L] = 0.05, 0.010
    leg[:, L_MAGNET_D], leg[:, L_DAHL_X], leg[:, L_COGGING_N] = 0.005, 0.006, 14.0
    leg[0, L_HIP_Q0], leg[1, L_HIP_Q0] = -STANCE_HIP, STANCE_HIP
    body[B_DROOP_T], body[B_SPRING_Z], body[B_GROUND_D], body[B_MU] = 0.3, STANCE_Z, 1.0, 1.0
    body[B_CABLE_Z] = 0.3
    return leg, body


def hidden(kind: str, size: float = 1.0, on: str = "both", **parameters: float) -> dict:
    """A hidden effect as plain data; `parameters` override the sized ones."""
    if is_sensor(kind):
        raise ValueError(f"{kind}: sensor effects are made by measure.sensor_fault")
    entry = CATALOGUE[kind]
    extra = set(parameters) - set(entry.parameters)
    if extra or on not in ("both", "front", "rear"):
        raise ValueError(f"{kind}: unknown parameter or leg: {sorted(extra)} {on}")
    return {"kind": kind, "on": on, "parameters": entry.sized(size) | parameters}


def tables(effects: list[dict]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Effects -> (leg table, body table, valve[2, 2] = extra on-delay and off-delay per leg)."""
    leg, body = neutral_tables()
    valve = np.zeros((2, 2))
    # the drift adds to the damping that another effect may set
    for effect in sorted(effects, key=lambda e: e["kind"] == "temperature_drift"):
        entry = CATALOGUE[effect["kind"]]
        rows = {"both": [0, 1], "front": [0], "rear": [1]}[effect.get("on", "both")]
        for name, value in effect["parameters"].items():
            column = entry.parameters[name][0]
            if effect["kind"] == "valve_delay":
                valve[rows, :] += value
            elif effect["kind"] == "valve_close_delay":
                valve[rows, 1] += value
            elif entry.room == "body":
                body[column] = value
            elif effect["kind"] == "temperature_drift":
                leg[rows, column] += value
            else:
                leg[rows, column] = value
    return leg, body, valve
