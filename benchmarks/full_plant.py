"""Logs of the full plant against the planning model: what `discover` makes of five model errors
at once.

    python benchmarks/full_plant.py            # all sets, about 5 CPU minutes each
    python benchmarks/full_plant.py --sets 0 1 --out FOLDER

Each set is three random hops of 0.9 s at 1 kHz with the usual noise, and two more that are not
learnt from. The plant (configs/models/plant.yaml) has orifice chambers, a supply line, a lag of the
valves, seal friction, damping, a leak and cushions, none of which the planning model has. Printed
are the ladder of held-out errors in units of the noise, the figures found, the verdict, the CPU
seconds, and what `compare` says of the kept logs under the planning model, the plant's own and the
model that was written.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from kemba.identify.compare_logs import compare_logs
from kemba.identify.workflow import discover_logs
from kemba.model import load_model
from kemba.plant import Commands, Profile, run
from kemba.plant.execution.sensors import Sensors, take_log
from kemba.plant.simulation.commands import Feedback, Sense
from kemba.trajectory import Trajectory

LEGS = ("front", "rear")
FEMUR, TIBIA = 0.242, 0.234  # m
FITTED, KEPT = 3, 2  # logs of a set
Say = Callable[[str], None]


def swaying(rng: np.random.Generator) -> Feedback:
    """Hip torques [N.m] that keep each foot about under its hip, and sway it."""
    sway, rate = 0.06 * rng.normal(size=(2, 2)), 2.0 + 4.0 * rng.random((2, 2))

    def feedback(time: float, sense: Sense) -> dict[str, float]:
        torques = {}
        for i, (leg, fold) in enumerate(zip(LEGS, (1.0, -1.0), strict=True)):
            bend = fold * sense[f"{leg}/knee/q"]
            wanted = -fold * np.arctan2(TIBIA * np.sin(bend), FEMUR + TIBIA * np.cos(bend))
            wanted += min(1.0, time / 0.2) * float(sway[i] @ np.sin(2 * np.pi * rate[i] * time))
            torque = 150.0 * (wanted - sense[f"{leg}/hip/q"]) - 3.0 * sense[f"{leg}/hip/w"]
            torque += 30.0 * sense["body/pitch"] + sense["body/pitch_rate"]
            torques[f"{leg}/hip/tau"] = float(np.clip(torque, -24.8, 24.8))
        return torques

    return feedback


def valves(seed: int, rng: np.random.Generator) -> dict[str, Profile]:
    """Three kinds of hops: legs drawn in, air before touchdown, both chambers in flight."""
    on, width, skew = 0.03 + 0.03 * rng.random(), 0.1 + 0.07 * rng.random(), 0.003 * rng.normal()
    land = 0.02 * rng.random()
    found = {}
    for i, leg in enumerate(LEGS):
        s = skew * i
        extend, retract = [(on, on + width + s)], []
        if seed % 3 == 0:
            retract = [(on + width + 0.10 + s, on + width + 0.14 + s)]
            t = 0.55 + land + s
            extend += [(t, t + 0.04), (t + 0.1, t + 0.25)]
        elif seed % 3 == 1:
            t = on + width + 0.16 + land
            extend += [(t, t + 0.03), (t + 0.06, t + 0.10), (t + 0.2, t + 0.33)]
        else:
            t = on + width + 0.08 + land
            retract = [(t, t + 0.06), (t + 0.25, t + 0.30)]
            extend += [(t + 0.03, t + 0.10), (t + 0.3, t + 0.4)]
        found[f"{leg}/valve/extend"] = Profile.pulses(*extend)
        found[f"{leg}/valve/retract"] = Profile.pulses(*retract)
    return found


def plant_log(seed: int, duration: float = 0.9) -> Trajectory:
    """A log of one random hop of the full plant."""
    rng = np.random.default_rng([77, seed])
    commands, sensors = Commands(valves(seed, rng), swaying(rng)), Sensors.usual()
    times = sensors.times(duration, rng)
    truth = run(load_model("plant"), {}, commands, duration, None, times).trajectory
    log = take_log(truth, sensors, rng)
    log.meta["name"] = f"hop{seed}"
    return log


def written(folder: Path, number: int) -> tuple[list[Path], list[Path]]:
    """Files of a set: logs to learn from, and logs to judge by."""
    count, paths = FITTED + KEPT, []
    for seed in range(number * count, (number + 1) * count):
        paths.append(folder / f"hop{seed}.csv")
        plant_log(seed).write(paths[-1])
    return paths[:FITTED], paths[FITTED:]


def study(number: int, folder: Path, say: Say) -> float:
    """One set; prints its table and returns the error of the answer."""
    fitted, kept = written(folder, number)
    begin = time.process_time()
    answer, _ = discover_logs(fitted, kept, time_limit=3600.0, say=say, out=folder / "answer")
    spent = time.process_time() - begin
    print(f"\nset {number}: {answer.verdict}, {spent:.0f} CPU s\n{answer.sentence}")
    for name, error in answer.ladder:
        print(f"  {error:6.2f}  {name}")
    for row in (r for r in answer.ranking if r.effect in answer.found):
        figures = ", ".join(
            f"{k} {v.value:.3g} ({v.low:.3g} to {v.high:.3g}) {v.unit}"
            for k, v in row.parameters.items()
        )
        print(f"  {row.effect}: {figures}")
    for model in ("planning", "plant", *([answer.model] if answer.model else [])):
        told, _ = compare_logs(kept, model)
        ratios = f"{told.noise_ratio:.2f}, within tolerances {told.tolerant_ratio:.2f}"
        print(f"  compare says of {Path(model).stem}: {ratios} times the noise")
    return answer.error_after


def main() -> None:
    """Read the arguments, and print every set."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, nargs="+", default=[0, 1, 2, 3])
    parser.add_argument("--out", type=Path, help="keep logs and answers here")
    parser.add_argument("--progress", action="store_true")
    given = parser.parse_args()
    load_model("plant")
    with tempfile.TemporaryDirectory() as scratch:
        root = given.out or Path(scratch)
        say: Say = (
            (lambda text: print("  ", text, flush=True)) if given.progress else lambda _: None
        )
        left = []
        for number in given.sets:
            folder = root / f"set{number}"
            folder.mkdir(parents=True, exist_ok=True)
            left.append(study(number, folder, say))
    within = sum(error <= 1.5 for error in left)
    print(f"\n{within} of {len(left)} answers leave 1.5 times the noise or less")


if __name__ == "__main__":
    main()
