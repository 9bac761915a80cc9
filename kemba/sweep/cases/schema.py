"""Sweep YAML (configs/sweeps/*.yaml): blocks of cases, what varies in each and how."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from kemba.config import FileName, Section
from kemba.quantity import Param
from kemba.scenarios.schema import Conditions, Draws


class Block(Draws):
    """Cases of one kind. `set` overrides keys of the task as `--set` does.

    `expect`: the success rate below which the sweep has failed.
    """

    task: str | None = None
    overrides: dict[str, Any] = Field(default_factory=dict, alias="set")
    notes: str = ""


class SolveBlock(Block):
    """Tasks to plan; `grid` and `vary` name keys of the task, `model` replaces its model.

    `replay`: execute the plans; those that miss the tolerances of their task do not succeed.
    """

    kind: Literal["solve"]
    task: str
    model: str | None = None
    replay: bool = True
    expect: Annotated[float, Param("1", lower=0.0, upper=1.0)] = 1.0


class ExecuteBlock(Block):
    """Executions of one plan on a plant; `grid` and `vary` name keys of its `conditions`.

    The plan is that of `task`, made once, or of the run folder `run`.
    """

    kind: Literal["execute"]
    run: str | None = None
    plant: str = "plant"
    conditions: Conditions = Field(default_factory=Conditions)
    expect: Annotated[float, Param("1", lower=0.0, upper=1.0)] = 0.0

    @model_validator(mode="after")
    def _one_plan(self) -> ExecuteBlock:
        if (self.task is None) == (self.run is None):
            raise ValueError("either 'task' or 'run' was expected")
        return self


AnyBlock = Annotated[SolveBlock | ExecuteBlock, Field(discriminator="kind")]


class Sweep(Section):
    """Many cases: blocks by name, and the seed of all draws."""

    name: FileName = "sweep"
    notes: str = ""
    seed: Annotated[int, Field(ge=0)] = 0
    blocks: Annotated[dict[FileName, AnyBlock], Field(min_length=1)] = Field(
        description="what is to be solved or executed, block by block"
    )
