"""Equations of motion and the integration loop of the whole robot.

State y: 27 positions, 27 velocities, 2 x N_AIR air states, the supply.  Explicit Runge-Kutta with
steps that end on every valve event and control tick; after each tick the pose is projected back on
the constraints.
"""

import numpy as np

from .air import A_TORQUE, N_AIR, air_rates, rod_force
from .bodies import NC, NQ, apply_inverse, constraints, factor, inverse_mass, solve
from .catalogue import (
    B_COM,
    B_DROOP,
    B_DROOP_T,
    B_INERTIA,
    B_PAYLOAD,
    L_MOTOR_LAG,
    L_ROTOR,
    L_TORQUE,
)
from .contact import creep, foot_normal, foot_tangent, stop_force
from .control import hip_command
from .jit import njit
from .loads import (
    AIR,
    S_BOOM_MX,
    S_BOOM_MZ,
    S_GROUND,
    S_MU,
    S_PHYSICAL,
    S_ROTOR,
    SUPPLY,
    body_force,
    foot_state,
    hip_force,
    near_ground,
    piston_state,
)

NY = 2 * NQ + 2 * N_AIR + 1
# One row of what is recorded beside the state: rod force, foot forces x and z, torque (x 2 legs).
NOUT = 8


@njit
def workspace():
    return (
        np.empty((NC, 6), dtype=np.int64),
        np.empty((NC, 6)),
        np.empty(NC),
        np.empty(NC),
        np.empty(NQ),
        np.empty((5, 5)),
        np.empty((NC, NQ)),
        np.empty((NC, NC)),
        np.empty(NQ),
        np.empty(NQ),
    )


@njit
def rates(y, u, command, push, anchor, mass, inertia, s, air, leg, body, ws, dy, out):
    """dy = f(y); `out` gets rod force, Fx, Fz and hip torque of both legs."""
    f, acc = ws[8], ws[9]
    physical = s[S_PHYSICAL] > 0.5
    f[:] = 0.0
    body_force(y, push, body, s, mass, f)
    demand = 0.0
    for n in range(2):
        state = y[AIR + N_AIR * n : AIR + N_AIR * (n + 1)]
        x, v, ax, az = piston_state(y, n)
        row = leg[n]
        rod = rod_force(x, v, u[2 * n], u[2 * n + 1], state, air[n], row, physical) + push[5 + n]
        total = rod + stop_force(x, v)
        b, r = 9 + 12 * n, 12 + 12 * n
        f[r] += total * ax
        f[r + 1] += total * az
        f[b] -= total * ax
        f[b + 1] -= total * az
        torque = hip_force(n, y, command[n], row) + push[3 + n]
        f[5 + 12 * n] += torque
        f[2] -= torque
        fx, fz, vx, vz, lx, lz = foot_state(y, n)
        normal = foot_normal(-fz, -vz, body) if s[S_GROUND] > 0.5 else 0.0
        side = foot_tangent(fx - anchor[n], vx, normal, body, s[S_MU]) if normal > 0.0 else 0.0
        t = 6 + 12 * n
        f[t] += side
        f[t + 1] += normal
        f[t + 2] += side * lx + normal * lz
        out[n], out[2 + n], out[4 + n], out[6 + n] = rod, side, normal, torque
        slot = dy[AIR + N_AIR * n : AIR + N_AIR * (n + 1)]
        demand += air_rates(x, v, u[2 * n], u[2 * n + 1], state, y[SUPPLY], air[n], row, physical,
                            slot)  # fmt: skip
        lag = row[L_MOTOR_LAG]
        slot[A_TORQUE] = (row[L_TORQUE] * command[n] - state[A_TORQUE]) / lag if lag > 0.0 else 0.0
    dy[SUPPLY] = 0.0
    if body[B_DROOP] != 0.0:
        dy[SUPPLY] = (1.0 - y[SUPPLY]) / body[B_DROOP_T] - body[B_DROOP] * demand
    _dynamics(y, s, leg, body, mass, inertia, ws)
    for i in range(NQ):
        dy[i] = y[NQ + i]
        dy[NQ + i] = acc[i]


@njit
def _prepare(y, s, leg, body, mass, inertia, ws):
    index, value, gap, bias, w, block, wg, a, _, _ = ws
    constraints(y[:NQ], y[NQ : 2 * NQ], index, value, gap, bias)
    inverse_mass(
        y[:NQ], mass, inertia,
        s[S_BOOM_MX] + body[B_INERTIA], s[S_BOOM_MZ] + body[B_INERTIA],
        body[B_PAYLOAD], body[B_COM],
        s[S_ROTOR] + leg[0, L_ROTOR], s[S_ROTOR] + leg[1, L_ROTOR], w, block,
    )  # fmt: skip
    factor(index, value, w, block, wg, a)


@njit
def _dynamics(y, s, leg, body, mass, inertia, ws):
    """Accelerations from the loads in the workspace: M a = f - G' lam with G a = bias."""
    index, value, _, bias, w, block, wg, a, f, acc = ws
    _prepare(y, s, leg, body, mass, inertia, ws)
    apply_inverse(w, block, f, acc)
    for r in range(NC):
        total = -bias[r]
        for n in range(6):
            total += value[r, n] * acc[index[r, n]]
        bias[r] = total
    solve(a, bias)
    for r in range(NC):
        for j in range(NQ):
            acc[j] -= wg[r, j] * bias[r]


@njit
def project(y, s, leg, body, mass, inertia, ws):
    """One Newton step back on the constraints, in position and in velocity, mass-weighted."""
    index, value, gap, bias, _, _, wg, a, _, _ = ws
    _prepare(y, s, leg, body, mass, inertia, ws)
    for r in range(NC):
        total = 0.0
        for n in range(6):
            total += value[r, n] * y[NQ + index[r, n]]
        bias[r] = total
    solve(a, gap)
    solve(a, bias)
    for r in range(NC):
        for j in range(NQ):
            y[j] -= wg[r, j] * gap[r]
            y[NQ + j] -= wg[r, j] * bias[r]


@njit
def integrate(
    y, u, anchor, ticks, split, h_max, refs, pushes, events, mass, inertia, s, air, leg, body
):
    """Run the robot over the control `ticks`; `split` records per tick.

    y, u (acting valves) and anchor (where the feet last stuck) move on in place.  refs[tick, :] are
    control rows (see `control`); events[:, 3] = time, valve number, value, sorted.
    Returns times, states, outputs, commands, acting valves.
    """
    n = ticks.size - 1
    total = n * split + 1
    times, states = np.empty(total), np.empty((total, NY))
    outputs, commands = np.empty((total, NOUT)), np.empty((n + 1, 2))
    valves = np.empty((total, 4))
    ws = workspace()
    dy, stage = np.empty(NY), np.empty(NY)
    out, command = np.empty(NOUT), np.zeros(2)
    project(y, s, leg, body, mass, inertia, ws)
    t, event, row = ticks[0], 0, 0
    for k in range(n + 1):
        for m in range(2):
            x, v, _, _ = piston_state(y, m)
            f = 3 + 12 * m
            command[m] = hip_command(m, y[f + 2] - y[2], y[NQ + f + 2] - y[NQ + 2], x, v, refs[k])
            commands[k, m] = command[m]
        push = pushes[k]
        for part in range(split if k < n else 1):
            while event < events.shape[0] and events[event, 0] <= t + 1e-12:
                u[int(events[event, 1])] = events[event, 2]
                event += 1
            rates(y, u, command, push, anchor, mass, inertia, s, air, leg, body, ws, dy, out)
            times[row], states[row], outputs[row], valves[row] = t, y, out, u
            row += 1
            if k == n:
                break
            stop = ticks[k] + (ticks[k + 1] - ticks[k]) * (part + 1) / split
            while t < stop - 1e-12:
                until = stop
                if event < events.shape[0] and events[event, 0] < stop:
                    until = events[event, 0]
                # light feet on stiff ground need half the step
                h = 0.5 * h_max if near_ground(y) else h_max
                steps = max(1, int(np.ceil((until - t) / h - 1e-9)))
                h = (until - t) / steps
                for _ in range(steps):
                    _step(y, h, u, command, push, anchor, mass, inertia, s, air, leg, body, ws,
                          dy, stage, out)  # fmt: skip
                t = until
                while event < events.shape[0] and events[event, 0] <= t + 1e-12:
                    u[int(events[event, 1])] = events[event, 2]
                    event += 1
            t = stop
        project(y, s, leg, body, mass, inertia, ws)
        if not np.isfinite(y[1]):
            break
    return times[:row], states[:row], outputs[:row], commands, valves[:row]


@njit
def _step(y, h, u, command, push, anchor, mass, inertia, s, air, leg, body, ws, dy, stage, out):
    """One step of the strong-stability-preserving Runge-Kutta scheme of order 3."""
    rates(y, u, command, push, anchor, mass, inertia, s, air, leg, body, ws, dy, out)
    for i in range(NY):
        stage[i] = y[i] + h * dy[i]
    rates(stage, u, command, push, anchor, mass, inertia, s, air, leg, body, ws, dy, out)
    for i in range(NY):
        stage[i] = 0.75 * y[i] + 0.25 * (stage[i] + h * dy[i])
    rates(stage, u, command, push, anchor, mass, inertia, s, air, leg, body, ws, dy, out)
    for i in range(NY):
        y[i] = (y[i] + 2.0 * (stage[i] + h * dy[i])) / 3.0
    for n in range(2):
        fx, fz, _, vz, _, _ = foot_state(y, n)
        anchor[n] = creep(anchor[n], fx, foot_normal(-fz, -vz, body), body, s[S_MU])
