"""Tuning numbers of identification are settings that say what they are and where they come from."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import pkgutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import kemba.identify
from kemba.settings import ORIGINS, Settings

ROOM = Path(__file__).parent.parent / "kemba" / "identify"

# Numbers that may stand at a module's top level, and why.
CONSTANTS = {
    "RANGES": "physical limits of channels, by name",
    "V_NODES": "nodes of a Gauss-Hermite formula",
    "GAIN": "noise behind a Gaussian filter and its derivatives: mathematics",
    "BODY": "places of channels among the coordinates",
}


def numbers(node: ast.expr) -> Iterator[float]:
    """Numbers in an expression."""
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and type(part.value) in (int, float):
            yield part.value


def constants() -> Iterator[tuple[str, str]]:
    """File and name of every module-level number."""
    for path in sorted(ROOM.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.Assign | ast.AnnAssign):
                continue
            if node.value is None or isinstance(node.value, ast.Subscript):  # a type
                continue
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            names = [n.id for n in ast.walk(target) if isinstance(n, ast.Name)]
            if list(numbers(node.value)) and names:
                yield path.relative_to(ROOM).as_posix(), names[0]


def classes() -> list[type[Settings]]:
    """Every class of settings of the package."""
    for module in pkgutil.walk_packages(kemba.identify.__path__, "kemba.identify."):
        importlib.import_module(module.name)
    return [c for c in Settings.classes if c.__module__.startswith("kemba.identify.")]


def test_no_tuning_number_hides_at_the_top_of_a_module() -> None:
    found = [f"{file}: {name}" for file, name in constants() if name not in CONSTANTS]
    assert not found, f"make these settings (kemba/settings.py), or explain them here: {found}"


def test_no_explanation_outlives_its_constant() -> None:
    assert CONSTANTS.keys() <= {name for _, name in constants()}


@pytest.mark.parametrize("cls", classes(), ids=lambda cls: cls.__name__)
def test_every_setting_says_what_it_is(cls: type[Settings]) -> None:
    assert cls.__doc__ and not cls.__doc__.startswith(f"{cls.__name__}("), "say what it is for"
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        about = field.metadata
        assert about.get("unit") and about.get("doc"), f"{cls.__name__}.{field.name}"
        kind, _, reason = about["origin"].partition(":")
        assert kind in ORIGINS and reason.strip(), f"{cls.__name__}.{field.name}: {about['origin']}"
        assert about["decides"] in (True, False)


def test_names_of_settings_are_unique() -> None:
    names = [cls.__name__ for cls in classes()]
    assert len(names) == len(set(names))
