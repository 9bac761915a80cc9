"""What executing a plan costs: processor time per second of motion, many at once, first use.

    python benchmarks/plant_speed.py [--save docs/plant.md]

Plans the shipped jump, replays it on its own model and plays its controller table on the full
plant, with steps that the motion chooses and with equal ones. `BEFORE` is what the same took with
CasADi's virtual machine and NumPy at 100 us; the ratio holds on the machine named there only.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from block import put_block

from kemba.effects.mechanics.ground import GroundFriction
from kemba.effects.mechanics.load import Payload
from kemba.events import peak
from kemba.ocp import controller_table, load_task, plan
from kemba.plant.certificate import executions
from kemba.plant.controller import Execution, execute, execute_many
from kemba.plant.repeat import counterpart
from kemba.plant.replay import replay
from kemba.sweep.farm import machine
from kemba.trajectory import Trajectory

MARKS = ("<!-- speed: written by benchmarks/plant_speed.py -->", "<!-- end of speed -->")
BEFORE = {"planning": 1.64, "plant": 1.92}  # s/s, AMD EPYC, 2 cores, the same plan
STEPS = (None, 1e-4, 2e-4, 2.5e-5)
REFERENCE = 1.25e-5  # s
FIRST_USE = """
import time
begin = time.process_time()
import numba, kemba.plant.player
imported = time.process_time()
from kemba.model import load_model
from kemba.plant.simulate import run
model = load_model("plant")
ready = time.process_time()
run(model, {}, None, 0.001)
print(imported - begin, time.process_time() - ready)
"""


def spent(work: Callable[[], object], times: int = 5) -> float:
    """Processor time [s] of a call, the least of several."""
    found = []
    for _ in range(times):
        begin = time.process_time()
        work()
        found.append(time.process_time() - begin)
    return min(found)


def apex(motion: Trajectory) -> float:
    """The highest point [m]."""
    return peak(motion.time, motion["body/z"])[1]


def report() -> Iterator[str]:
    task, document = load_task("jump")
    found = plan(task, document)
    table = controller_table(found.model, found.trajectory)
    plant = counterpart(task.model, task.payload, task.supply, task.plant)

    def replayed(step: float | None) -> Trajectory:
        return replay(found.model, found.trajectory, step).trajectory

    def executed(step: float | None) -> Trajectory:
        return execute(table, plant, step=step, extra=0.3).trajectory

    yield "| steps | replay: s/s | ratio | apex | plant: s/s | ratio | apex |"
    yield "|---|---|---|---|---|---|---|"
    exact = [apex(play(REFERENCE)) for play in (replayed, executed)]
    for step in STEPS:
        cells = [f"{1e6 * step:g} us" if step else "chosen"]
        for play, high, before in zip((replayed, executed), exact, BEFORE.values(), strict=True):
            motion = play(step)
            cost = spent(lambda play=play, step=step: play(step)) / motion.time[-1]  # type: ignore[misc]
            error = 1e3 * (apex(motion) - high)
            cells += [f"{cost:.3f}", f"{before / cost:.0f}", f"{error:+.4f} mm"]
        yield f"| {' | '.join(cells)} |"
    yield ""
    begin = time.process_time()
    fresh = counterpart(task.model, task.payload, task.supply, task.plant)
    executions(found.model, found.trajectory, table, fresh)
    cost = time.process_time() - begin
    yield f"Both replays of `solve`, the plant built and translated: {cost:.2f} s."
    yield ""
    yield from many(table)
    yield ""
    yield from first_use()
    yield ""
    yield f"Machine: {machine()}."


def many(table: Trajectory) -> Iterator[str]:
    """48 executions with payload, friction and start pitch of their own, on every core."""
    plant, rng = counterpart("planning"), np.random.default_rng(1)
    cases = [
        {
            "model": plant.with_effects(
                [Payload(m=rng.uniform(0.0, 0.5)), GroundFriction(mu=rng.uniform(0.5, 1.0))]
            ),
            "start": {"body/pitch": rng.uniform(-0.01, 0.01)},
        }
        for _ in range(48)
    ]
    begin, clock = time.process_time(), time.perf_counter()
    done = execute_many(table, cases)
    cost, waited = time.process_time() - begin, time.perf_counter() - clock
    assert all(isinstance(one, Execution) for one in done)
    yield (
        f"48 executions with payload, friction and start pitch of their own: {cost:.1f} s of "
        f"processor time, models included, in {waited:.1f} s on {os.cpu_count()} cores."
    )


def first_use() -> Iterator[str]:
    """What a process pays once, with an empty cache and with a full one."""
    with tempfile.TemporaryDirectory() as cache:
        words = [sys.executable, "-c", FIRST_USE]
        environment = {**os.environ, "KEMBA_CACHE": str(Path(cache) / "kept")}
        costs = [
            [
                float(x)
                for x in subprocess.run(
                    words, capture_output=True, text=True, check=True, env=environment
                ).stdout.split()
            ]
            for _ in range(2)
        ]
    yield (
        f"Once per process: importing numba {costs[1][0]:.1f} s, loading the kernel and making a "
        f"model's machine code {costs[1][1]:.1f} s. Once per machine and version: compiling the "
        f"kernel {costs[0][1] - costs[1][1]:.0f} s."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--save", type=Path)
    asked = parser.parse_args()
    lines = []
    for line in report():
        print(line, flush=True)
        lines.append(line)
    if asked.save:
        put_block(asked.save, *MARKS, lines)


if __name__ == "__main__":
    main()
