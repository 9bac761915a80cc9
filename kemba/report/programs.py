"""The programs of a task as files for other solvers: CasADi functions, bounds and starts.

`relaxed`: the program of the first stage on the task's grid, from the automatic guess. `refined`:
the multi-phase program of the plan, from the plan.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from kemba.config import Document
from kemba.files import write_error, write_json
from kemba.folders import fresh
from kemba.model import Model
from kemba.ocp import Task, load_task, task_model
from kemba.ocp.functions.problem import Program
from kemba.ocp.planner import Planner
from kemba.ocp.relaxation.settings import Relaxation
from kemba.ocp.task.resolve import resolve
from kemba.ocp.transcription.transcribe import Parameters
from kemba.runs import load_run
from kemba.sensitivity.table import plan_program
from kemba.trajectory import Trajectory

FUNCTIONS = ("nlp", "grad_f", "jac_g", "hess_lag")


@dataclass(frozen=True)
class Named:
    """A program to export: `start` (n,), `parameters` (k,), and what every row means."""

    name: str
    program: Program
    start: np.ndarray
    parameters: Sequence[float]
    rows: Sequence[str]


def programs(task: Task, document: Document, plan: Trajectory | None = None) -> Iterator[Named]:
    """The programs of a task; the refined one only where there is a refined `plan`. Raises
    KembaError for mistakes in the task, and where the plan was not refined."""
    model = task_model(task, document=document)
    yield relaxed(task, model, document)
    if plan is not None:
        yield refined(task, model, plan)


def relaxed(task: Task, model: Model, document: Document) -> Named:
    """The program of the first stage: pairs relaxed, valves anywhere between 0 and 1."""
    planner = Planner(task, model, resolve(task, model, document))
    program = planner.schedule(task.nodes, next(planner.reductions())).transcription
    parameters = Parameters(Relaxation.loose, forces=Relaxation.forces).vector(program.nodes)
    start = np.clip(planner.guess(program).Y, program.lower, program.upper)
    rows = [f"{m.kind} {m.label}" for m in program.meanings]
    return Named("relaxed", program, start.ravel(), parameters, rows)


def refined(task: Task, model: Model, plan: Trajectory) -> Named:
    """The program of a refined plan: modes fixed, phase durations free. Raises KembaError."""
    program, start = plan_program(task, model, plan)
    return Named("refined", program, start, [], [row.label for row in program.rows])


def write_program(named: Named, folder: Path) -> list[Path]:
    """Write NAME.casadi, its functions, and NAME.json, all numbers; the two paths.

    The functions are `nlp` (x, p) -> (f, g), and the exact derivatives `grad_f`, `jac_g` and
    `hess_lag` with the signatures that `casadi.nlpsol` takes. Bounds are null where there is none.
    `casadi`: the version that wrote the functions; an older one does not read them.
    Raises KembaError where a file cannot be written.
    """
    problem = named.program.problem
    nlp = problem.nlp
    values = ca.Function("nlp", [nlp["x"], nlp["p"]], [nlp["f"], nlp["g"]], ["x", "p"], ["f", "g"])
    stem = folder / named.name
    functions, numbers = stem.with_suffix(".casadi"), stem.with_suffix(".json")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = ca.FileSerializer(str(functions))
        for function in (values, problem.grad_f, problem.jac_g, problem.hess_lag):
            file.pack(function)
        del file  # closes it
    except (OSError, RuntimeError) as error:
        reason = error if isinstance(error, OSError) else OSError(0, str(error))
        raise write_error(functions, reason) from None
    bounds = {
        "lbx": named.program.lower, "ubx": named.program.upper,
        "lbg": named.program.g_lower, "ubg": named.program.g_upper,
    }  # fmt: skip
    facts: dict[str, Any] = {
        key: [float(v) if np.isfinite(v) else None for v in value.ravel()]
        for key, value in bounds.items()
    }
    facts |= {"x0": named.start.tolist(), "p": list(named.parameters), "rows": list(named.rows)}
    head = {"program": named.name, "functions": list(FUNCTIONS), "casadi": ca.CasadiMeta.version()}
    write_json(numbers, {**head, **facts})
    return [functions, numbers]


def export_nlp(source: Path, folder: Path, force: bool = False) -> list[Path]:
    """Write the programs of a task, or of a run folder with its plan, into a folder; the paths.

    A task alone gives the relaxed program; the refined one is about a plan. Raises KembaError,
    also where a file is there already and `force` is False.
    """
    run = load_run(source) if source.is_dir() else None
    task, document = load_task(run.task if run else source)
    plan = run.trajectory if run else None
    names = ("relaxed", "refined") if plan is not None else ("relaxed",)
    for name in names:
        for ending in (".casadi", ".json"):
            fresh(folder / f"{name}{ending}", force)
    listed = list(programs(task, document, plan))
    return [path for named in listed for path in write_program(named, folder)]
