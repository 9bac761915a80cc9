"""Names that a task gives to costs and IPOPT's options, and figures that no solve could meet,
checked before anything is built."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import casadi as ca

from kemba.config import Document
from kemba.errors import KembaError, suggest

if TYPE_CHECKING:
    from kemba.ocp.task.task import Task

# the others need libraries that are not in the wheel: a failed load makes the next solve crash
LINEAR_SOLVERS = ("mumps", "spral")
OURS = ("output_file", "file_print_level", "file_append", "print_options_documentation")
KINDS: dict[str, tuple[Any, str]] = {
    "integer": (int, "an integer"),
    "real": ((int, float), "a number"),
    "string": (str, "a word"),
}
ENTRY = re.compile(r"^\\anchor OPT_(\w+)\n(.*?)</blockquote>", re.MULTILINE | re.DOTALL)
KIND = re.compile(r"for this (?:advanced )?(integer|real|string) option")
RANGE = re.compile(r"The valid range for this \w+ option is (.*?) and its default value")


def option_errors(options: Mapping[str, Any], document: Document) -> list[KembaError]:
    """Every unknown option, and every value that IPOPT refuses."""
    errors = []
    for name, value in options.items():
        fault = _fault(name, value)
        if fault:
            at = ("solver", "options", name)
            errors.append(document.error(at, f"solver.options{fault[0]}", hint=fault[1]))
    return errors


def timing_errors(task: Task, document: Document) -> list[KembaError]:
    """Whether valves could ever open and close within the motion."""
    if task.min_dwell < task.duration:
        return []
    what = (
        f"min_dwell: {task.min_dwell:g} s is not less than the motion's {task.duration:g} s, so "
        "that no valve could open and close again"
    )
    return [document.error(("min_dwell",), what, hint=f"give less than {task.duration:g} s")]


def _fault(name: str, value: Any) -> tuple[str, str] | None:
    known = documented()
    if name not in known or name in OURS:
        return f": unknown option '{name}'", suggest(name, set(known) - set(OURS))
    kind, allowed = known[name]
    accepted, words = KINDS[kind]
    if not isinstance(value, accepted) or isinstance(value, bool):
        return f".{name}: '{value}' is not {words}", allowed
    if name == "linear_solver" and value not in LINEAR_SOLVERS:
        return f".{name}: '{value}' is not in the installed IPOPT", "one of: mumps, spral"
    if not _accepts(value, allowed):
        return f".{name}: IPOPT does not accept '{value}'", allowed
    return None


def _accepts(value: Any, allowed: str) -> bool:
    """Whether a value is one of the words or within the range that IPOPT documents."""
    if isinstance(value, str):
        return not allowed or value in allowed.removeprefix("one of: ").split(", ")
    parts = re.split(r"\s*(<=?)\s*", allowed)
    low = parts[0] if len(parts) > 2 else "-inf"
    high = parts[4] if len(parts) > 4 else "inf"
    above = float(low) < value or (parts[1:2] == ["<="] and float(low) == value)
    return above and (value < float(high) or (parts[3:4] == ["<="] and value == float(high)))


@cache
def documented() -> dict[str, tuple[str, str]]:
    """IPOPT's options, as the installed one documents itself: kind and allowed values of each."""
    x = ca.SX.sym("x")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "options.txt"
        options = {
            "print_level": 0, "sb": "yes", "output_file": str(path), "file_print_level": 5,
            "print_options_documentation": "yes", "print_advanced_options": "yes",
            "print_options_mode": "doxygen",
        }  # fmt: skip
        plugin: dict[str, Any] = {
            "print_time": False,
            **{f"ipopt.{key}": v for key, v in options.items()},
        }
        solver = ca.nlpsol("options", "ipopt", {"x": x, "f": x**2}, plugin)
        solver(x0=0.0)
        del solver  # closes the file
        text = path.read_text(encoding="utf-8")
    return {name: _entry(body) for name, body in ENTRY.findall(text)}


def _entry(body: str) -> tuple[str, str]:
    kind = KIND.search(body)
    words = re.findall(r"^ - ([\w-]+):", body, re.MULTILINE)
    words = words or re.findall(r"(\w+)", "".join(re.findall(r"Possible values: (.*)", body)))
    within = RANGE.search(body)
    allowed = f"one of: {', '.join(words)}" if words else ""
    if within and not words:
        allowed = re.sub(r"\\f\$|\{\\tt |[\\}]", "", within[1].replace("&le;", "<="))
        allowed = re.sub(r"\s+", " ", allowed.replace("&infin;", "inf")).strip()
    return kind[1] if kind else "string", allowed
