"""From a task's names to requirements on a model's quantities, every mistake at its line.

Names of costs and of IPOPT's options, and figures that no solve could meet, are checked before
anything is built.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import casadi as ca

from kemba.config import Document
from kemba.config.document import Location, written
from kemba.errors import ConfigErrors, KembaError, suggest
from kemba.model import Model
from kemba.ocp.task.costs import COSTS
from kemba.ocp.task.expressions import expressed, is_expression, two_moments
from kemba.ocp.task.moments import share_of
from kemba.ocp.task.requirement import Earlier, Requirement, quantities, quantity_expression
from kemba.ocp.task.task import Bound, CostTerm, Goal, Moment, Task
from kemba.ocp.task.templates import TEMPLATES, with_height
from kemba.ocp.task.terrain import feet_off_walls, off_walls, rooms, scene_errors
from kemba.quantity import Quantity, to_si

# `rest`: every rate is zero; `settled`: every state of an effect is where it comes to rest
SPECIAL = ("rest", "settled")
AIR = 0.2  # of a force's scale, 20 N: what an edge half a step away changes
UNREFINED = "needs the refined plan, and this task says refine: none"
ALONE = ("contacts", "periodic")  # templates that need no goal


class NotGivenError(ValueError):
    """What a requirement needs is not in the task."""


def resolve(
    task: Task, model: Model, document: Document, partial: bool = False
) -> list[Requirement]:
    """All requirements of a task. `partial`: nothing is said of what the task does not give. Raises
    ConfigErrors with every wrong name, unit or range, of its costs and solver options too."""
    known, task = quantities(model), with_height(task, model)
    requirements: list[Requirement] = []
    errors: list[KembaError] = []
    for location, pattern, moment, bound in _asked(task):
        try:
            at = None if moment is None else share_of(moment, task)
        except ValueError as error:
            what = f"{written(location)}: {error}"
            errors.append(document.error((*location, "at"), what))
            at = 0.5  # what else is wrong with it is told as well
        try:
            requirements += _requirements(task, location, pattern, at, bound, known, model)
        except KembaError as error:
            place = (*location, "quantity") if isinstance(bound, Goal) else location
            errors.append(document.error(place, f"{written(place)}: {error.what}", hint=error.hint))
        except ValueError as error:
            if not (partial and isinstance(error, NotGivenError)):
                errors.append(document.error(location, f"{written(location)}: {error}"))
    read = not errors and not partial  # else the goal may be one that was not read
    for key, template in TEMPLATES.items():
        try:
            requirements += template(task, model, requirements)
        except ValueError as error:
            if read or key in ALONE:
                errors.append(document.error((key,), f"{key}: {error}"))
    if task.grip < 1.0 and task.refine == "none":
        errors.append(document.error(("grip",), f"grip: {UNREFINED}"))
    errors += _cost_errors(task, known, document)
    errors += option_errors(task.solver.options, document)
    errors += timing_errors(task, document)
    errors += scene_errors(task, document)
    if errors:
        raise ConfigErrors(errors)
    requirements = [part for r in requirements for part in off_walls(r, known)]
    requirements += feet_off_walls(model, known)
    requirements += [
        Requirement(("obstacles", i), room, None, 0.0, math.inf) for i, room in rooms(model, known)
    ]
    names = {r.quantity.name for r in requirements}
    names |= {r.minus.name for r in requirements if r.minus}
    acting, states = _acting(model, names), {q.name for q in model.states.values()}
    return [
        replace(
            r,
            acts=r.quantity.name in acting,
            minus=r.minus and replace(r.minus, acts=r.minus.name in acting),
            loose=_loose(r, states),
            line=document.place(r.location),
        )
        for r in requirements
    ]


def _loose(requirement: Requirement, states: AbstractSet[str]) -> float:
    """How far a plan on nodes may miss a force of air that is asked for under way: it depends on
    when valves switch, to less than a step."""
    quantity, later = requirement.quantity, requirement.at not in (None, 0.0)
    fixed = later and requirement.lower == requirement.upper
    return AIR * quantity.scale if fixed and quantity.name in states else 0.0


def _cost_errors(
    task: Task, known: Mapping[str, Quantity], document: Document
) -> Iterator[KembaError]:
    """Every cost that there is not, and every expression that cannot be read."""
    for name, term in task.cost.items():
        if not isinstance(term, CostTerm):
            if name not in COSTS:
                what, hint = f"cost: unknown cost '{name}'", suggest(name, COSTS)
                yield document.error(("cost", name), what, hint=hint)
            continue
        at = ("cost", name, "expression")
        try:
            expressed(term.expression, known)
        except KembaError as error:
            yield document.error(at, f"{written(at)}: {error.what}", hint=error.hint)
        except ValueError as error:
            yield document.error(at, f"{written(at)}: {error}")


def _acting(model: Model, names: Iterable[str]) -> set[str]:
    """The quantities that inputs or forces decide."""
    causes = ca.vertcat(model.node.u, model.node.lam)
    return {n for n in names if ca.depends_on(ca.SX(quantity_expression(model, n)), causes)}


Asked = tuple[Location, str, Moment | None, Bound | Goal]


def _asked(task: Task) -> Iterator[Asked]:
    for side, at in (("start", 0.0), ("end", 1.0)):
        for name, bound in getattr(task, side).items():
            yield (side, name), name, at, bound
    for name, bound in task.bounds.items():
        yield ("bounds", name), name, None, bound
    for name, goal in task.goals.items():
        yield ("goals", name), goal.quantity, None if goal.during else goal.at, goal


def _requirements(
    task: Task,
    location: Location,
    text: str,
    at: float | None,
    bound: Bound | Goal,
    known: dict[str, Quantity],
    model: Model,
) -> Iterator[Requirement]:
    """What one line asks: of every quantity that a pattern matches, of an expression, or of the
    difference between two moments."""
    during = (0.0, 1.0)
    if isinstance(bound, Goal) and bound.during:
        begin, end = (share_of(each, task) for each in bound.during)
        if begin > end:
            raise ValueError("'during' goes from an earlier to a later part of the motion")
        during = begin, end
    difference = two_moments(text)
    if difference is not None:
        late, early = (share_of(moment, task) for moment in difference[::2])
        later, earlier = (expressed(part, known) for part in difference[1::2])
        if later.unit != earlier.unit:
            raise ValueError(f"'{text}' takes {earlier.unit} from {later.unit}")
        found = _requirement(task, location, later, late, bound, during)
        yield replace(found, minus=Earlier(earlier.name, early))
        return
    named = [expressed(text, known)] if is_expression(text) else _matching(text, known, model)
    for quantity in named:
        yield _requirement(task, location, quantity, at, bound, during)


def _matching(pattern: str, known: dict[str, Quantity], model: Model) -> list[Quantity]:
    if pattern == "rest":
        return list(model.mechanism.velocities)
    if pattern == "settled":
        return list(model.states.values())
    found = [q for name, q in known.items() if fnmatchcase(name, pattern)]
    if not found:
        hint = suggest(pattern, (*known, *SPECIAL))
        raise KembaError("", f"unknown quantity '{pattern}'", hint=hint)
    return found


def _requirement(
    task: Task,
    location: Location,
    quantity: Quantity,
    at: float | None,
    bound: Bound | Goal,
    during: tuple[float, float],
) -> Requirement:
    if location[-1] in SPECIAL:
        if bound.equals is not True and bound.equals != 1:
            raise ValueError(f"'{location[-1]}' is either true or left out")
        value = 0.0 if location[-1] == "rest" else quantity.value
        return Requirement(location, quantity, at, value, value)
    aim = int(bound.maximise) - int(bound.minimise) if isinstance(bound, Goal) else 0
    if bound.equals is not None:
        if bound.at_least is not None or bound.at_most is not None:
            raise ValueError("'equals' does not go with 'at_least' or 'at_most'")
        value = _number(task, bound.equals, quantity)
        return Requirement(location, quantity, at, value, value, during, aim)
    lower = -math.inf if bound.at_least is None else _number(task, bound.at_least, quantity)
    upper = math.inf if bound.at_most is None else _number(task, bound.at_most, quantity)
    if lower == -math.inf and upper == math.inf and not aim:
        raise ValueError("asks for nothing; 'equals', 'at_least' or 'at_most' was expected")
    if lower > upper:
        raise ValueError(f"at_least {lower:g} is above at_most {upper:g} {quantity.unit}")
    return Requirement(location, quantity, at, lower, upper, during, aim)


def _number(task: Task, value: float | str, quantity: Quantity) -> float:
    if value in ("height", "distance"):
        number = getattr(task, str(value))
        if number is None:
            raise NotGivenError(f"refers to '{value}', which the task does not give")
        return float(number)
    return to_si(value, quantity.unit)


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
