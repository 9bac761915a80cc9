"""The feedback policy of a run: those of its parts with which most executions succeed.

Gains come from linear maps, which do not hold where a landing is a matter of which foot comes down
first. Of a jump of 0.1 m ahead at twice the usual uncertainty the table alone lands in all of 240
executions, with corrections of hips and edges in 195; so parts are tried before they are used.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kemba.errors import KembaError
from kemba.files import atomic_path
from kemba.model import Model
from kemba.ocp import load_task, task_model
from kemba.plant.execution.certificate import rest_after
from kemba.plant.execution.repeat import VALVE_SCATTER, plant_of
from kemba.plant.execution.replay import ends_standing
from kemba.policy.execute import execute_policy
from kemba.policy.player import Policy
from kemba.policy.write import FILE, write_policy
from kemba.runs import Run, load_run
from kemba.scenarios.conditions import standing
from kemba.scenarios.draw import Scenario, scenarios
from kemba.scenarios.expected import FILE as UNCERTAINTIES
from kemba.scenarios.expected import executions_of
from kemba.scenarios.share import fault_of, share
from kemba.settings import Settings, setting
from kemba.stopwatch import Stage, Tell, silent

NEITHER = "neither"
WAYS = {  # which parts act: retimed edges, torques of the hips
    "edges and hips": (True, True),
    NEITHER: (False, False),
    "hips": (False, True),
    "edges": (True, False),
}


class TrialSettings(Settings):
    """How the parts of a policy are tried."""

    count: int = setting(
        40, "1", "executions with each part",
        "derived: a share that is 10 % smaller shows in four of them",
    )  # fmt: skip


def policy_of(run: str | Path, tell: Tell = silent) -> Path:
    """The policy of a run folder or its table, made where it is missing or older than the table.

    Raises KembaError where the run has no task or no plan, or no policy can be made.
    """
    folder = Path(run) if Path(run).is_dir() else Path(run).parent
    file, table = folder / FILE, folder / "controller.csv"
    if not file.is_file() or file.stat().st_mtime < table.stat().st_mtime:
        own = load_run(folder)
        model = task_model(load_task(own.task)[0])
        with atomic_path(file) as path:
            tell("executing under uncertainty")
            write_policy(model, own.controller, path, executions_of(folder))
            _choose(own, model, path, tell)
    return file


def words_of(file: Path) -> str:
    """Which parts of a policy act, and in how many executions each way succeeded."""
    with np.load(file, allow_pickle=False) as data:
        if "tried" not in data:
            return "feedback whose parts were not tried"
        ways, succeeded, of = list(data["tried"]), list(data["succeeded"]), int(data["of"])
    counts = ", ".join(f"{way} {n}" for way, n in zip(ways, succeeded, strict=True))
    return f"feedback by {ways[int(np.argmax(succeeded))]} (of {of} executions succeed: {counts})"


def _choose(run: Run, model: Model, file: Path, tell: Tell) -> None:
    """Try the whole policy, then its parts where some executions fail; the gains of what is not
    kept are set to zero in the file."""
    cases = scenarios(UNCERTAINTIES, plant_of(run.path), TrialSettings.current().count)
    succeeded: dict[str, int] = {}
    for number, way in enumerate(WAYS, start=1):
        tell(Stage("trying feedback", number, len(WAYS)))
        succeeded[way] = _successes(run, model, file, way, cases)
        if succeeded[way] == len(cases):
            break
    edges, hips = WAYS[max(succeeded, key=lambda way: succeeded[way])]
    with np.load(file, allow_pickle=False) as data:
        arrays = dict(data)
    arrays["edge_gain"] *= edges
    arrays["hip_gains"] *= hips
    arrays["tried"], arrays["of"] = np.array(list(succeeded)), np.array(len(cases))
    arrays["succeeded"] = np.array(list(succeeded.values()))
    with file.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def _successes(run: Run, model: Model, file: Path, way: str, cases: Sequence[Scenario]) -> int:
    """In how many scenarios the plan on `model` succeeds, played with noisy sensors."""
    plan, table = run.trajectory, run.controller
    if way == NEITHER:
        return share(model, plan, table, cases).landed
    rest, lands = rest_after(model, plan, table), bool(ends_standing(model, plan))
    good = 0
    for seed, case in enumerate(cases):
        policy, start = Policy(file, *WAYS[way]), standing(case.model, table, case.start)
        try:
            done = execute_policy(
                table, policy, case.model, rest, start, noise=True, scatter=VALVE_SCATTER, seed=seed
            )
        except KembaError:
            continue  # it cannot be simulated
        good += not fault_of(done.against(case.model, plan), lands)
    return good
