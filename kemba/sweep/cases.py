"""Cases of a sweep: its YAML, every combination, one case and its result."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from kemba.config import (
    Document,
    FileName,
    Section,
    apply_overrides,
    find_config,
    is_file,
    load_yaml,
    parse,
    shipped_configs,
    with_added,
)
from kemba.config.document import Location
from kemba.effects import BY_KIND, load_effects
from kemba.errors import KembaError
from kemba.files import plain, read_json, sha256, write_json
from kemba.model.spec import load_spec, model_files
from kemba.quantity import Param
from kemba.scenarios.draw import Conditions, Draws
from kemba.stopwatch import Stopwatch


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


Record = dict[str, Any]
Work = Mapping[str, Any]


def content_hash(data: Any) -> str:
    """A short hash of plain data, whatever the order of its keys."""
    text = json.dumps(plain(data), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:20]


@dataclass(frozen=True)
class Case:
    """Work for `function` (`module:name`), whose `problem` says what is solved.

    `values` are what varies, as the sweep's table shows it. Cases with equal content have equal
    keys, and their work is done once.
    """

    block: str
    index: int
    values: Mapping[str, Any]
    function: str
    work: Work = field(repr=False)
    problem: str = ""

    @cached_property
    def key(self) -> str:
        """Hash of the function and its work: equal cases have equal keys, and are computed once."""
        return content_hash([self.function, self.work])

    def path(self, folder: Path) -> Path:
        """Where its result is kept."""
        return folder / "cases" / f"{self.key}.json"

    def record(self, folder: Path) -> Record | None:
        """Its result, None while there is none, or none that can be used."""
        return read_record(self.path(folder))


NUMBERS = (
    "apex_m", "apex_error_m", "touchdown_error_s", "final_error_m", "pitch_rad", "duration_s",
    "solve_s", "solve_cpu_s", "build_s", "wall_s", "cpu_s", "iterations", "variables",
)  # fmt: skip


def read_record(path: Path) -> Record | None:
    """The result in a case's file; None when there is none, or it is damaged and must be redone."""
    try:
        record = read_json(path) if path.is_file() else None
    except KembaError:
        return None
    return record if _is_record(record) else None


def _is_record(record: Any) -> bool:
    """Whether it holds what the table and the summary read, each of its type."""
    if not isinstance(record, dict) or not isinstance(record.get("good"), bool):
        return False
    cost = record.get("cost") or {}
    numbers = [record.get(name) for name in NUMBERS]
    numbers.append(cost.get("torque_squared_integral") if isinstance(cost, dict) else cost)
    return (
        all(isinstance(record.get(name), str) for name in ("status", "sentence"))
        and all(n is None or (isinstance(n, (int, float)) and math.isfinite(n)) for n in numbers)
        and not any(isinstance(n, bool) for n in numbers)
    )


def perform(
    function: str, work: Work, path: str, effects: Mapping[str, str] | None = None
) -> Record:
    """Do a case's work and keep its result at `path`, at once and completely. Runs in a worker.

    An error in it is a result too. Where the folder of `path` is not visible, the record is
    only returned. Work that another worker has already done is not repeated. `effects`: files of
    effects from outside, by path, with the hash of their content.
    Raises KembaError when these cannot be loaded.
    """
    load_effects(effects or {})
    if (known := read_record(Path(path))) is not None:
        return known
    working = Stopwatch()
    try:
        with working.running():
            result = resolve(function)(work)
    except Exception as error:
        result = {"status": "error", "good": False, "sentence": f"{type(error).__name__}: {error}"}
    record = {**result, "wall_s": working.wall, "cpu_s": working.cpu, "finished": time.time()}
    if Path(path).parent.is_dir():
        write_json(path, record)
    return record


def resolve(function: str) -> Callable[[Work], Record]:
    """The function called `module:name`."""
    module, name = function.split(":")
    found: Callable[[Work], Record] = getattr(import_module(module), name)
    return found


def load_sweep(name: str | Path, overrides: list[str] | None = None) -> tuple[Sweep, Document]:
    """The sweep YAML `name` (a path or a shipped one) and its document. Raises KembaError."""
    document = apply_overrides(load_yaml(find_config(name, "sweeps")), overrides or [])
    return parse(document, Sweep), document


class Expansion:
    """A sweep's document and blocks, to be expanded to cases; paths are relative to the sweep."""

    def __init__(self, sweep: Sweep, document: Document) -> None:
        self.sweep, self.document = sweep, document
        self.beside = Path(document.source).parent if document.source else Path()

    def found(self, name: str | Path, folder: str) -> Path:
        """The file `name` beside the sweep, as given, or shipped."""
        near = self.beside / name
        return near if is_file(near) else find_config(name, folder)

    def task_document(self, name: str) -> Document:
        """The task of a block with what it sets. Raises KembaError where the task cannot be
        read."""
        block = self.sweep.blocks[name]
        try:
            document = load_yaml(self.found(str(block.task), "tasks"))
        except KembaError as error:
            at = ("blocks", name, "task")
            raise self.document.error(at, f"{error.where}: {error.what}", hint=error.hint) from None
        return self.changed(document, block.overrides, ("blocks", name, "set"))

    def changed(self, base: Document, values: Mapping[str, Any], at: Location) -> Document:
        """`base` with values set; messages about mistakes name their place in the sweep."""
        options = {f"{key}={json.dumps(value)}": key for key, value in values.items()}
        document = apply_overrides(base, options)
        places = {
            f"--set {option}": self.document.error((*at, key), "").where
            for option, key in options.items()
        }
        told = {key: places.get(text, text) for key, text in document.overrides.items()}
        return dataclasses.replace(document, overrides=told)

    def place(self, name: str, key: str) -> Location:
        """Where a block names what varies."""
        kind = "vary" if key in self.sweep.blocks[name].vary else "grid"
        return ("blocks", name, kind)

    def varied(self, base: Document, name: str, values: Mapping[str, Any]) -> Document:
        """`base` with the values of one case."""
        for key, value in values.items():
            base = self.changed(base, {key: value}, self.place(name, key))
        return base


def model_name(expansion: Expansion, name: str) -> str:
    """A model as every worker finds it: shipped ones by name, others by their whole path."""
    if (parts := with_added(name)) is not None:
        return "+".join(model_name(expansion, part) for part in parts)
    if name in shipped_configs("models") or f"{name}.yaml" in shipped_configs("models"):
        return name
    return str(expansion.found(name, "models").absolute())


def model_hash(name: str) -> str:
    """The content of a model's YAML and its robot's, and the files of effects from outside."""
    spec = load_spec(name).model_dump(mode="json", exclude={"robot"})  # its path does not matter
    files = [sha256(path) for path in model_files(name)]
    return content_hash([spec, *files, *BY_KIND.files.values()])
