"""From a sweep's blocks to its cases, every mistake found before anything runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kemba.config import Document
from kemba.errors import ConfigErrors, KembaError
from kemba.ocp.task.task import parse_task
from kemba.scenarios.sampling import sample
from kemba.sweep.cases.case import Case, content_hash
from kemba.sweep.cases.execution import execute_cases
from kemba.sweep.cases.expand import Expansion, model_hash, model_name
from kemba.sweep.cases.schema import ExecuteBlock, SolveBlock, Sweep

# Keys of a task that say how it is solved, not what is asked.
HOW = {"name", "notes", "guess", "guess_noise", "seed", "method", "solver", "tolerances"}


def expand(sweep: Sweep, document: Document, folder: Path) -> list[Case]:
    """All cases of a sweep. Raises ConfigErrors with the mistakes of all blocks.

    `folder` keeps the plans that are to be executed; they are made here when missing.
    """
    expansion = Expansion(sweep, document)
    cases: list[Case] = []
    errors: list[KembaError] = []
    for name, block in sweep.blocks.items():
        try:
            if isinstance(block, ExecuteBlock):
                cases += execute_cases(expansion, name, block, folder)
            else:
                cases += _solve_cases(expansion, name, block)
        except ConfigErrors as error:
            errors += error.errors
        except KembaError as error:
            errors.append(error)
    if errors:
        raise ConfigErrors({str(error): error for error in errors}.values())
    return cases


def _solve_cases(expansion: Expansion, name: str, block: SolveBlock) -> list[Case]:
    from kemba.ocp import task_model
    from kemba.ocp.task.resolve import resolve

    base = expansion.task_document(name)
    cases = []
    for index, values in enumerate(sample(block, name, expansion.sweep.seed)):
        document = expansion.varied(base, name, values)
        task = parse_task(document)
        task = task.model_copy(update={"model": model_name(expansion, block.model or task.model)})
        if index == 0:  # names of quantities are the same in all
            resolve(task, task_model(task, document=document), document)
        work: dict[str, Any] = {
            "task": task.model_dump(exclude_none=True),
            "model": model_hash(task.model),
            "replay": block.replay,
        }
        aim = {key: value for key, value in work["task"].items() if key not in HOW}
        problem = content_hash([aim, work["model"]])
        cases.append(
            Case(name, index, values, "kemba.sweep.workers.work:solve_case", work, problem)
        )
    return cases
