"""What measured pressures could bring to feedback: python benchmarks/pressures.py RUN [--cases N].

Executes a run under `twice.yaml` in five ways: open loop; the policy; the policy with chamber
pressures among what it measures (their noise is that of the sensors' list); and valves that hold
the pressure of the undisturbed execution by short pulses, within 20 kPa and within 100 kPa, beside
the open-loop table. Prints a table for docs/policy.md; the package itself measures no pressures.
"""

import argparse
import os
import tempfile
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from kemba.model import Model
from kemba.ocp import load_task, task_model
from kemba.plant.certificate import rest_after
from kemba.plant.controller import Execution, execute
from kemba.plant.repeat import plant_of
from kemba.policy.course import course_of
from kemba.policy.execute import execute_policy
from kemba.policy.player import Policy
from kemba.policy.write import policy_arrays
from kemba.runs import Run, load_run
from kemba.scenarios.draw import Scenario, scenarios, standing
from kemba.scenarios.feedback import executions_of
from kemba.scenarios.share import wilson
from kemba.trajectory import Trajectory

DWELL = 8  # ticks between two switchings of a valve, which shuts in about 6 ms
PUSHING = 60e3  # Pa above the surroundings: a chamber that is meant to push
AIR = 101325.0
PERIOD = 1e-3
BANDS = {"pulses, 20 kPa": 20e3, "pulses, 100 kPa": 100e3}
WAYS = ("open loop", "feedback", "feedback with pressures", *BANDS)


class Tracking(Policy):
    """The open-loop table, whose valves also hold the pressures of an undisturbed execution."""

    def __init__(self, file: Path, nominal: Trajectory, first: float, band: float) -> None:
        super().__init__(file, retime=False, hips=False)
        self.nominal, self.first, self.band = nominal, first, band
        self.held, self.since = np.zeros(len(self.valves)), np.full(len(self.valves), DWELL)

    def step(self, measured: np.ndarray, hip_rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        time = self.first + PERIOD * self.tick
        torques, planned = super().step(measured, hip_rates)
        for v, name in enumerate(self.valves):
            column = pressure_of(name)
            wanted = float(np.interp(time, self.nominal.time, self.nominal[column]))
            off, value = measured[self.measured.index(column)] - wanted, planned[v]
            if wanted > AIR + PUSHING and abs(off) > self.band:
                value = float(off < 0.0)
            self.since[v] += 1
            if value != self.held[v] and self.since[v] >= DWELL:
                self.held[v], self.since[v] = value, 0
        return torques, self.held.copy()


def pressure_of(valve: str) -> str:
    return valve.replace("/valve/", "/chamber/") + "/P"


class Study:
    """A run, what is expected of it, and its policy files."""

    def __init__(self, folder: Path, scratch: Path) -> None:
        self.run: Run = load_run(folder)
        self.model: Model = task_model(load_task(self.run.task)[0])
        self.plant = plant_of(folder)
        self.table, self.plan = self.run.controller, self.run.trajectory
        self.rest = rest_after(self.model, self.plan, self.table)
        self.nominal = execute(self.table, self.plant, extra=self.rest).trajectory
        self.pressures = [n for n in self.nominal.names if "/chamber/" in n and n.endswith("/P")]
        course, executions = course_of(self.model, self.table), executions_of(folder)
        self.files = {}
        for way, also in zip(WAYS[1:3], ((), self.pressures), strict=True):
            self.files[way] = scratch / f"{way}.npz"
            np.savez(self.files[way], **policy_arrays(course, executions, also))

    def executed(self, way: str, case: Scenario, seed: int) -> Execution:
        start = standing(case.model, self.table, case.start)
        if way == "open loop":
            return execute(self.table, case.model, extra=self.rest, start=start)
        file, first = self.files.get(way, self.files[WAYS[2]]), float(self.table.time[0])
        policy = Policy(file)
        if way in BANDS:
            policy = Tracking(file, self.nominal, first, BANDS[way])
        return execute_policy(
            self.table, policy, case.model, self.rest, start, noise=True, seed=seed
        )

    def deviation(self, done: Execution) -> float:
        """RMS [Pa] by which the chambers that push are off the undisturbed execution."""
        motion, found = done.trajectory, []
        for name in self.pressures:
            wanted = np.interp(motion.time, self.nominal.time, self.nominal[name])
            found.append((motion[name] - wanted)[wanted > AIR + PUSHING])
        return float(np.sqrt(np.mean(np.concatenate(found) ** 2)))


def row(study: Study, way: str, cases: list[Scenario]) -> str:
    """A line of the table."""
    good, apex, off, pulses = 0, [], [], []
    for seed, case in enumerate(cases):
        done = study.executed(way, case, seed)
        found = done.against(case.model, study.plan)
        good += found.landed
        apex.append(1e3 * found.apex_error_m)
        off.append(1e-3 * study.deviation(done))
        valves = [done.table[n] for n in done.table.names if "/valve/" in n]
        pulses.append(sum(np.abs(np.diff(v)).sum() for v in valves) / 2)
    low, high = (100 * end for end in wilson(good, len(cases)))
    share = f"{good} of {len(cases)} ({low:.0f} to {high:.0f} %)"
    return (
        f"| {way} | {share} | {np.mean(apex):+.0f} ± {np.std(apex):.0f} "
        f"| {np.sqrt(np.mean(np.square(off))):.0f} | {np.mean(pulses):.1f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--cases", type=int, default=60)
    asked: Any = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        study = Study(asked.run, Path(scratch))
        cases = scenarios("twice", study.plant, 240)[-asked.cases :]
        step = round(DWELL * 1e-3 / float(np.median(np.diff(study.nominal.time))))
        jumps = [np.abs(study.nominal[n][step:] - study.nominal[n][:-step]).max()
                 for n in study.pressures if "extend" in n]  # fmt: skip
        print(f"within {DWELL} ms a pressure changes by up to {1e-3 * max(jumps):.0f} kPa\n")
        print("| way | lands | apex [mm] | pressure off [kPa] | pulses |\n|---|---|---|---|---|")
        for way in WAYS:
            print(row(study, way, cases), flush=True)


if __name__ == "__main__":
    main()
