"""The feedback policy of a run: those of its parts with which most executions come out.

Gains come from linear maps, which do not hold where a landing is a matter of which foot comes down
first. Of a jump of 0.1 m ahead at twice the usual uncertainty the table alone lands in all of 240
executions, with corrections of hips and edges in 195; 0.4 m ahead both parts keep 16 of 16 upright,
but 10 of them end more than 5 cm from their place, and with edges alone one (by hand).
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_path
from kemba.model import Model
from kemba.ocp import load_task, task_model
from kemba.plant.certificate import rest_after
from kemba.plant.repeat import VALVE_SCATTER, plant_of
from kemba.policy.execute import execute_policy
from kemba.policy.modes import Array
from kemba.policy.player import Policy
from kemba.policy.write import write_policy
from kemba.runs import POLICY, Run, load_run
from kemba.scenarios.draw import Scenario, scenarios, standing
from kemba.stopwatch import Stage, Tell, silent

UNCERTAINTIES = "twice"  # of configs/uncertainties
KEPT = ("tried", "succeeded", "ended", "of")  # arrays of the file
WAYS = {  # which parts act: retimed edges, torques of the hips
    "edges and hips": (True, True),
    "edges": (True, False),
    "hips": (False, True),
    "neither": (False, False),
}


TRIED = 40  # executions with each part: a share that is 10 % smaller shows in four of them


def policy_of(run: str | Path, tell: Tell = silent) -> Path:
    """The policy of a run folder or its table, made where it is missing, older than the table or of
    an earlier form.

    Raises KembaError where the run has no task or no plan, or no policy can be made.
    """
    own = load_run(run)
    file, made = own.path / POLICY, own.table.stat().st_mtime
    if not file.is_file() or file.stat().st_mtime < made or not _of_this_form(file):
        model = task_model(load_task(own.task)[0])
        with atomic_path(file) as path:
            write_policy(model, own.controller, path)
            _choose(own, model, path, tell)
    return file


def _of_this_form(file: Path) -> bool:
    """Whether a policy estimates the state by maps from tick to tick; earlier ones did not."""
    with np.load(file, allow_pickle=False) as data:
        return "A" in data


def words_of(file: Path) -> str:
    """Which parts of a policy act, and what came of each way."""
    with np.load(file, allow_pickle=False) as data:
        if "tried" not in data:
            return "feedback whose parts were not tried"
        ways, succeeded, ended, of = (data[key].tolist() for key in KEPT)
    best = ways[int(np.argmax(np.add(succeeded, ended)))]
    each = zip(ways, succeeded, ended, strict=True)
    counts = ", ".join(f"{way} {n} and {m}" for way, n, m in each)
    return f"feedback by {best} (of {of} executions succeed, and end in place: {counts})"


def acting(arrays: Mapping[str, Array], edges: bool, hips: bool) -> dict[str, Array]:
    """The arrays (n, ...) of a policy of which only these parts act; the others' gains are zero."""
    kept = {"edge_gain": arrays["edge_gain"] * edges, "hip_gains": arrays["hip_gains"] * hips}
    return {**arrays, **kept}


def _choose(run: Run, model: Model, file: Path, tell: Tell) -> None:
    """Try the whole policy, then its parts; the gains of what is not kept are set to zero in the
    file."""
    cases = scenarios(UNCERTAINTIES, plant_of(run.path), TRIED)
    found: dict[str, tuple[int, int]] = {}
    for number, way in enumerate(WAYS, start=1):
        tell(Stage("trying feedback", number, len(WAYS)))
        found[way] = _tried(run, model, file, way, cases)
        if min(found[way]) == len(cases):
            break
    best = max(found, key=lambda way: sum(found[way]))
    succeeded, ended = zip(*found.values(), strict=True)
    with np.load(file, allow_pickle=False) as data:
        arrays = acting(dict(data), *WAYS[best])
    told = zip(KEPT, (list(found), succeeded, ended, len(cases)), strict=True)
    arrays |= {key: np.array(value) for key, value in told}
    with file.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]


def _tried(
    run: Run, model: Model, file: Path, way: str, cases: Sequence[Scenario]
) -> tuple[int, int]:
    """In how many scenarios the plan on `model` succeeds, played with noisy sensors; and in how
    many of these its end is where the task's tolerance has it."""
    plan, table, task = run.trajectory, run.controller, load_task(run.task)[0]
    rest = rest_after(model, plan, table)
    succeeded = ended = 0
    for seed, case in enumerate(cases):
        policy, start = Policy(file, *WAYS[way]), standing(case.model, table, case.start)
        try:
            done = execute_policy(
                table, policy, case.model, rest, start, noise=True, scatter=VALVE_SCATTER, seed=seed
            )
        except KembaError:
            continue  # it cannot be simulated
        replay = done.against(case.model, plan)
        succeeded += replay.landed
        ended += replay.landed and replay.final_error_m <= task.tolerances.plant_final
    return succeeded, ended
