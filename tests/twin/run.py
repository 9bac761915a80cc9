"""Execute a script on the robot: prepares the kernel's tables, returns what truly happened."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import catalogue, layout, loads, machine, valves
from .air import N_AIR
from .bodies import NQ
from .figures import ATMOSPHERE, Robot
from .scripts import Script

STEP = 40e-6  # largest integration step (s); half of it near the ground


@dataclass(frozen=True)
class Truth:
    """What truly happened, `split` records per control tick."""

    ticks: np.ndarray
    split: int
    times: np.ndarray
    q: np.ndarray  # body coordinates (n, 27)
    v: np.ndarray
    y: np.ndarray  # x, z, pitch, hips, pistons (n, 7)
    w: np.ndarray  # their rates
    air: np.ndarray  # (n, 2, N_AIR)
    supply: np.ndarray
    rod: np.ndarray  # (n, 2) force of air and friction
    foot: np.ndarray  # (n, 2, 2) ground force x, z
    command: np.ndarray  # (ticks, 2) torque sent to the motors
    sent: np.ndarray  # (ticks, 4) valves as sent
    acted: np.ndarray  # (n, 4) valves as they acted
    physical: bool

    @property
    def finite(self) -> bool:
        return len(self.times) == (len(self.ticks) - 1) * self.split + 1 and bool(
            np.isfinite(self.y).all()
        )

    def until(self, tick: int) -> Truth:
        """The same run, ended at control tick number `tick`."""
        cut = {f: getattr(self, f)[: tick + 1] for f in ("ticks", "command", "sent")}
        records = tick * self.split + 1
        for name in ("times", "q", "v", "y", "w", "air", "supply", "rod", "foot", "acted"):
            cut[name] = getattr(self, name)[:records]
        return replace(self, **cut)


def initial_state(start, physical: bool) -> np.ndarray:
    """State of the kernel at the start: a pose, vented chambers, a full supply."""
    y = np.zeros(machine.NY)
    y[:NQ], y[NQ : 2 * NQ] = layout.push(
        start.x, start.z, start.pitch, start.hips, start.pistons, start.rates
    )
    if physical:
        for n in range(2):
            y[loads.AIR + N_AIR * n : loads.AIR + N_AIR * n + 2] = ATMOSPHERE
    y[loads.SUPPLY] = 1.0
    return y


def scalars(robot: Robot, physical: bool, ground: bool) -> np.ndarray:
    return np.array([
        robot.rotor, robot.boom_mx, robot.boom_mz, robot.boom_weight, robot.friction,
        float(physical), float(ground),
    ])  # fmt: skip


def _settle(y, script, step, robot, figures, leg, body) -> None:
    """Let a standing robot find its rest on the springs of the ground before time zero.

    Kinetic relaxation: whenever the kinetic energy has passed a peak, the motion is stopped.
    """
    if np.any(script.start.rates) or layout.feet(y[:NQ])[:, 1].max() > 1e-3:
        return
    ticks, row = np.array([0.0, 0.002]), np.stack([script.refs[0]] * 2)
    anchor = np.ascontiguousarray(layout.feet(y[:NQ])[:, 0])
    before = 0.0
    for _ in range(60):
        machine.integrate(
            y, np.zeros(4), anchor, ticks, 1, step, row, np.zeros((2, 7)), np.zeros((0, 3)),
            robot.mass, robot.inertia, figures, robot.air, leg, body,
        )  # fmt: skip
        speed = float(np.sum(y[NQ : 2 * NQ] ** 2))
        if speed < before:
            y[NQ : 2 * NQ] = 0.0
            speed = 0.0
        before = speed
    y[NQ : 2 * NQ] = 0.0


def simulate(
    script: Script,
    effects: list[dict] = (),
    robot: Robot | None = None,
    chambers: str = "first_order",
    step: float = STEP,
    split: int = 2,
    pushes: np.ndarray | None = None,
    ground: bool = True,
    settle: bool = True,
) -> Truth:
    """Run `script`.  `pushes[tick, 7]`: disturbance on x, z, pitch, hips, rods, held per tick."""
    robot = robot or Robot()
    physical = {"first_order": False, "orifice": True}[chambers]
    leg, body, late = catalogue.tables(list(effects))
    figures = scalars(robot, physical, ground)
    y = initial_state(script.start, physical)
    if ground and settle:
        _settle(y, script, step, robot, figures, leg, body)
    if pushes is None:
        pushes = np.zeros((script.ticks.size, 7))
    times, states, outputs, command, acted = machine.integrate(
        y, np.zeros(4), np.ascontiguousarray(layout.feet(y[:NQ])[:, 0]),
        script.ticks, split, step, script.refs, pushes,
        valves.events(script.ticks, script.sent, late),
        robot.mass, robot.inertia, figures, robot.air, leg, body,
    )  # fmt: skip
    q, v = states[:, :NQ], states[:, NQ : 2 * NQ]
    measured, speeds = layout.measured(q, v)
    return Truth(
        ticks=script.ticks,
        split=split,
        times=times,
        q=q,
        v=v,
        y=measured,
        w=speeds,
        air=states[:, loads.AIR : loads.SUPPLY].reshape(-1, 2, N_AIR),
        supply=states[:, loads.SUPPLY],
        rod=outputs[:, 0:2],
        foot=np.stack([outputs[:, 2:4], outputs[:, 4:6]], axis=-1),
        command=command,
        sent=script.sent,
        acted=acted,
        physical=physical,
    )
