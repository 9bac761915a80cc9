"""One script on one machine: the controller at its ticks, air and MuJoCo between them."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from twin.control import hip_command
from twin.layout import feet, place
from twin.scripts import Script
from twin.valves import events

from kemba.mechanism.links import Leg

from .air import Chambers, Supply
from .hidden import LEGS, Machine
from .mjcf import engine

STEP = 5e-5  # s
SETTLING = 0.3  # s, in which a robot that starts on its feet finds its rest
CHANNELS = (
    *("body/x", "body/z", "body/pitch", "front/hip/q", "rear/hip/q"),
    *("front/piston/x", "rear/piston/x"),
)


@dataclass(frozen=True)
class Run:
    """What happened, one row per control tick.

    `y` (n, 7): `CHANNELS` as they truly are, of the boom's end; `seen`: behind the sensors'
    filters; `command` (n, 2) torques; `feet` (n, 2) heights [m]; `rod` (n, 2) forces [N];
    `energy` (n,) of all bodies [J].
    """

    ticks: np.ndarray
    y: np.ndarray
    seen: np.ndarray
    command: np.ndarray
    sent: np.ndarray
    feet: np.ndarray
    rod: np.ndarray
    energy: np.ndarray

    def until(self, rows: int) -> Run:
        """Its first rows only."""
        return Run(**{name: value[:rows] for name, value in vars(self).items()})

    @property
    def sane(self) -> np.ndarray:
        """Rows (n,) worth logging: not tipped over, knees and belly off the floor."""
        low = np.abs(self.y[:, 3:5]).max(axis=1) < 2.2
        return (
            np.isfinite(self.y).all(axis=1)
            & (np.abs(self.y[:, 2]) < 0.6)
            & low
            & (self.y[:, 1] > 0.12)
        )


class Simulator:
    """MuJoCo with the machine's air, drives and boom around it."""

    def __init__(self, made: Machine, filters: np.ndarray) -> None:
        self.made = made
        self.model = engine(made.robot, made.build(STEP))
        self.data = mujoco.MjData(self.model)
        self.air = [Chambers(made.air[i], made.flaws[i]) for i in range(2)]
        self.supply = Supply(*made.droop)
        self.torque = [0.0, 0.0]  # at the joints
        self.rods = [0.0, 0.0]
        self.keep = np.exp(-STEP / np.maximum(filters, 1e-9))
        names = ["x", "z", "pitch", *(f"{g}/hip" for g in LEGS), *(f"{g}/rod" for g in LEGS)]
        self.at = np.array([self.model.joint(name).id for name in names])
        self.feet = [self.model.site(f"{leg}/foot").id for leg in LEGS]
        self.seen = np.zeros(7)

    def place(self, script: Script) -> None:
        """The script's pose; the robot stands on its own feet where the script's did."""
        start, robot = script.start, self.made.robot
        if np.any(start.rates):
            raise ValueError("a start at rest was expected")
        q = self.data.qpos
        q[self.at] = (start.x, start.z, start.pitch, *start.hips, *start.pistons)
        for leg, x in zip(LEGS, start.pistons, strict=True):
            knee, cylinder = closed(robot.leg, x)
            fold = robot.legs[leg].fold
            q[self.model.joint(f"{leg}/knee").id] = fold * knee
            q[self.model.joint(f"{leg}/cylinder").id] = fold * cylinder
        mujoco.mj_forward(self.model, self.data)
        low = min(self.data.site_xpos[i][2] for i in self.feet)
        if max(foot_height(script)) < 1e-3:
            q[self.at[1]] -= low
            for _ in range(round(SETTLING / STEP)):
                if round(self.data.time / STEP) % 20 == 0:
                    command = self.commands(script.refs[0])
                self.step((0.0,) * 4, command, np.zeros(7))
            self.data.time = 0.0
            self.data.qpos[self.at[0]] = start.x
        self.seen = self.data.qpos[self.at].copy()

    def commands(self, row: np.ndarray) -> list[float]:
        """Hip torques [N m] of the controller (eq. 10)."""
        q, v = self.data.qpos[self.at], self.data.qvel[self.at]
        return [hip_command(i, q[3 + i], v[3 + i], q[5 + i], v[5 + i], row) for i in range(2)]

    def step(self, valves: tuple[float, ...], command: list[float], push: np.ndarray) -> None:
        """One step of air, drives and bodies."""
        made, data, demand = self.made, self.data, 0.0
        q, v = data.qpos[self.at], data.qvel[self.at]
        force = push.copy()
        force[1] += made.lift
        for i in range(2):
            drive = made.drives[i]
            share = -np.expm1(-STEP / drive.lag) if drive.lag else 1.0
            self.torque[i] += share * (drive.gain * command[i] - self.torque[i])
            x, rate = float(q[5 + i]), float(v[5 + i])
            sent = (valves[2 * i], valves[2 * i + 1])
            demand += self.air[i].step(STEP, x, rate, sent, self.supply.level)
            self.rods[i] = self.air[i].force(x, rate)
            force[3 + i] += self.torque[i]
            force[5 + i] += self.rods[i]
        self.supply.step(STEP, demand)
        data.qfrc_applied[self.at] = force
        mujoco.mj_step(self.model, data)
        self.seen += (1.0 - self.keep) * (data.qpos[self.at] - self.seen)


def run(
    made: Machine,
    script: Script,
    pushes: np.ndarray | None = None,
    filters: float | np.ndarray = 0.0,
) -> Run:
    """The script on the machine. `pushes` (ticks, 7): forces that nobody knows; `filters` [s]: time
    constants of the sensors, in the order of `CHANNELS`."""
    sim = Simulator(made, np.broadcast_to(np.asarray(filters, dtype=float), 7))
    sim.place(script)
    ticks, count = script.ticks, script.ticks.size
    pushes = np.zeros((count, 7)) if pushes is None else pushes
    switches = list(events(ticks, script.sent, np.array(made.late)))
    valves, rows = [0.0] * 4, []
    for k in range(count):
        command = sim.commands(script.refs[k])
        feet = [sim.data.site_xpos[i][2] for i in sim.feet]
        q = sim.data.qpos[sim.at].copy()
        rows.append((q, sim.seen.copy(), command, feet, list(sim.rods), sum(sim.data.energy)))
        if not np.isfinite(q).all():
            break
        while k < count - 1 and sim.data.time < ticks[k + 1] - STEP / 2:
            while switches and switches[0][0] <= sim.data.time + STEP / 2:
                _, valve, value = switches.pop(0)
                valves[int(valve)] = value
            sim.step(tuple(valves), command, pushes[k])
    y, seen, command, feet, rod, energy = (np.array(c) for c in zip(*rows, strict=True))
    n = len(rows)
    return Run(ticks[:n], y, seen, command, script.sent[:n], feet, rod, energy)


def closed(leg: Leg, x: float) -> tuple[float, float]:
    """Knee flexion and the cylinder's angle to the femur [rad] at piston extension x [m]."""
    side = float(np.hypot(leg.femur.length, leg.piston.mount))
    length, pin = leg.piston.retracted + x, leg.piston.pin
    inner = np.arccos((side**2 + pin**2 - length**2) / (2.0 * side * pin))
    knee = np.pi - inner - np.arctan2(leg.piston.mount, leg.femur.length)
    ahead = pin * np.sin(knee) - leg.piston.mount
    return float(knee), float(np.arctan2(ahead, leg.femur.length + pin * np.cos(knee)))


def foot_height(script: Script) -> list[float]:
    """Heights [m] of the feet at a script's start, on the robot as it is drawn."""
    s = script.start
    return list(feet(place(s.x, s.z, s.pitch, s.hips, s.pistons))[:, 1])
