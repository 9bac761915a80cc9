"""Tuning numbers of planning are settings with unit, meaning and origin; few others stay."""

from __future__ import annotations

import ast
import dataclasses
import pkgutil
from importlib import import_module
from pathlib import Path

import kemba.ocp
from kemba.settings import Settings

FOLDER = Path(kemba.ocp.__file__).parent
PLAIN = {
    "controller.py": {"PERIOD"},  # of the robot's controller
    "functions/constants.py": {"SHAPING"},  # numbers that CasADi simplifies
    "phases/modes.py": {"OPEN", "HELD", "AHEAD", "BACK"},  # names of modes
    "phases/radau.py": {"RADAU3", "RADAU5", "_R"},  # coefficients of the schemes
    "refinement/sample.py": {"WORST"},  # violations that a report lists
    "task/requirement.py": {"MOMENTS", "SCALES"},  # the format; units of requirements
    "transcription/first_node.py": {"SAME"},  # rounding
    "transcription/layout.py": {"STEP"},  # unit of steps, shared by all grids
    "transcription/stage.py": {"ANGLE_ARM", "COST_SCALE"},  # units of moments and costs
}


def numbers(path: Path) -> set[str]:
    """Names of a module to which it assigns an expression with a number in it."""
    found: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        values = [n.value for n in ast.walk(node.value) if isinstance(n, ast.Constant)]
        if any(type(value) in (int, float) for value in values):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found |= {n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)}
    return found


def test_modules_hold_no_other_numbers() -> None:
    found = {
        str(path.relative_to(FOLDER)): numbers(path)
        for path in sorted(FOLDER.rglob("*.py"))
        if numbers(path)
    }
    assert found == PLAIN


def own_settings() -> list[type[Settings]]:
    """Every class of settings of planning."""
    for module in pkgutil.walk_packages(kemba.ocp.__path__, "kemba.ocp."):
        import_module(module.name)
    return [c for c in Settings.classes if c.__module__.startswith("kemba.ocp.")]


def test_every_setting_says_what_it_is() -> None:
    classes = own_settings()
    assert len(classes) >= 15
    for cls in classes:
        assert cls.__doc__, cls
        for field in dataclasses.fields(cls):  # type: ignore[arg-type]
            assert field.metadata["doc"] and field.metadata["unit"], f"{cls.__name__}.{field.name}"


def test_the_schedules_stages_are_in_the_sensitivity_study() -> None:
    deciding = {
        f"{cls.__name__}.{field.name}"
        for cls in own_settings()
        for field in dataclasses.fields(cls)  # type: ignore[arg-type]
        if field.metadata["decides"]
    }
    assert {"Relaxation.loose", "Starts.interior_push", "Ends.tol", "ValveSearch.reach"} <= deciding
