"""How exact and how fast the plant is: step halving, penetration, energy, time per second.

    python benchmarks/plant_accuracy.py

A push with both extend valves, the rear one 4 ms longer, the flight after it and the landing, with
the feet kept under the hips; first on the planning model, then on the full plant. Prints one row
per step size.
"""

import time

import numpy as np

from kemba.events import peak
from kemba.model import Model, load_model
from kemba.plant.commands import Commands, Profile, Sense
from kemba.plant.simulate import Simulated, run
from kemba.trajectory import Trajectory

LEGS = ("front", "rear")
FEMUR, TIBIA = 0.242, 0.234  # m
STEPS = (None, 4e-4, 2e-4, 1e-4, 5e-5, 2.5e-5)  # s; None: as the motion allows


def under_the_hips(time: float, sense: Sense) -> dict[str, float]:
    """Hip torques [N.m] that keep each foot under its hip and the body level."""
    torques = {}
    for leg, fold in (("front", 1.0), ("rear", -1.0)):
        bend = fold * sense[f"{leg}/knee/q"]
        wanted = -fold * np.arctan2(TIBIA * np.sin(bend), FEMUR + TIBIA * np.cos(bend))
        torque = 150.0 * (wanted - sense[f"{leg}/hip/q"]) - 3.0 * sense[f"{leg}/hip/w"]
        torque += 30.0 * sense["body/pitch"] + sense["body/pitch_rate"]
        torques[f"{leg}/hip/tau"] = float(np.clip(torque, -24.8, 24.8))
    return torques


def push(model: Model, step: float | None) -> Simulated:
    valves = {
        "front/valve/extend": Profile.pulses((0.02, 0.20), (0.45, 0.70)),
        "rear/valve/extend": Profile.pulses((0.02, 0.204), (0.45, 0.70)),
    }
    return run(model, {}, Commands(valves, under_the_hips), 0.7, step)


def deepest(t: Trajectory) -> float:
    """The largest penetration of a foot or a piston [m]."""
    past = [-t[f"{leg}/foot/z"].min() for leg in LEGS] + [
        -t[f"{leg}/piston/x"].min() for leg in LEGS
    ]
    return float(max(0.0, *past, *(t[f"{leg}/piston/x"].max() - 0.07 for leg in LEGS)))


def touchdown(done: Simulated) -> float:
    """The time [s] at which the first foot is back on the ground."""
    return min(i.time for i in done.impacts if any("contact" in label for label in i.labels))


def report(name: str) -> None:
    model = load_model(name)
    push(model, STEPS[1])  # compile
    rows = []
    for step in STEPS:
        begin = time.process_time()
        done = push(model, step)
        spent = time.process_time() - begin
        _, apex = peak(done.trajectory.time, done.trajectory["body/z"])
        end = done.trajectory["body/z"][-1]
        rows.append((step, apex, touchdown(done), end, done, spent))
    _, best, time_best, end_best, *_ = rows[-1]
    print(f"\n{name}: apex {best:.6f} m, touchdown {time_best:.6f} s")
    print("| step | apex | touchdown | end | penetration | impacts | energy lost | s/s |")
    for step, apex, down, end, done, spent in rows:
        lost = [impact.lost for impact in done.impacts]
        print(
            f"| {f'{1e6 * step:.0f} us' if step else 'chosen'} | {1e3 * (apex - best):.4f} mm "
            f"| {1e6 * (down - time_best):.2f} us | {1e3 * (end - end_best):.4f} mm "
            f"| {1e6 * deepest(done.trajectory):.4f} um | {len(lost)} "
            f"| {np.sum(lost):.3f} J (least {min(lost, default=0.0):.1e}) | {spent / 0.7:.3f} |"
        )


if __name__ == "__main__":
    for plant in ("planning", "plant"):
        report(plant)
