"""A sweep's YAML: its document, its blocks, and the files that they name."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kemba.config import (
    Document,
    apply_overrides,
    find_config,
    is_file,
    load_yaml,
    parse,
    shipped_configs,
)
from kemba.config.document import Location
from kemba.effects import BY_KIND
from kemba.errors import KembaError
from kemba.files import sha256
from kemba.model.spec import load_spec, model_files
from kemba.sweep.cases.case import content_hash
from kemba.sweep.cases.schema import Sweep


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
    if name in shipped_configs("models") or f"{name}.yaml" in shipped_configs("models"):
        return name
    return str(expansion.found(name, "models").absolute())


def model_hash(name: str) -> str:
    """The content of a model's YAML and its robot's, and the files of effects from outside."""
    spec = load_spec(name).model_dump(mode="json", exclude={"robot"})  # its path does not matter
    files = [sha256(path) for path in model_files(name)]
    return content_hash([spec, *files, *BY_KIND.files.values()])
