"""Docstrings: functions of arrays give shapes, those that raise say what; of the functions that the
page of the library names, every argument is explained, those in units with their unit."""

import ast
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import kemba
from kemba.effects import EFFECTS
from kemba.errors import KembaError

ROOT = Path(kemba.__file__).parent
ARRAY = re.compile(r"\b(Array|ndarray|Flags|Labels)\b")
SHAPE = re.compile(r"\([^()]*,[^()]*\)|\((n|m|k)\)|\[\w")  # (n, 3), (n,), (n) or `values[i]`
RAISES = re.compile(r"\b[Rr]aises?\b")
UNIT = r"(?:in|of|\[)\s?(?:s|m|Pa|N|N\.m|rad|kg)\b|violations and products"  # behind a name
PAGE = Path(__file__).parents[1] / "docs" / "library.md"


@dataclass(frozen=True)
class Public:
    """A public function or method: where it is, its node, its docstring and that of its class."""

    where: str
    node: ast.FunctionDef
    doc: str

    @property
    def takes_arrays(self) -> bool:
        """Whether an argument or the answer is an array."""
        arguments = [a.annotation for a in (*self.node.args.args, *self.node.args.kwonlyargs)]
        return any(ARRAY.search(ast.unparse(a)) for a in (*arguments, self.node.returns) if a)

    @property
    def raises(self) -> bool:
        """Whether it raises an error by itself."""
        found = [n.exc for n in ast.walk(self.node) if isinstance(n, ast.Raise) and n.exc]
        named = [n.func if isinstance(n, ast.Call) else n for n in found]
        return any(re.fullmatch(r"[A-Z]\w*", ast.unparse(n)) for n in named)


def publics(node: ast.AST, where: str, above: str = "") -> Iterator[Public]:
    """Public functions of a module or class, not those within functions."""
    for inner in getattr(node, "body", []):
        if isinstance(inner, ast.ClassDef) and not inner.name.startswith("_"):
            yield from publics(inner, where, ast.get_docstring(inner) or "")
        elif isinstance(inner, ast.FunctionDef) and not inner.name.startswith("_"):
            doc = (ast.get_docstring(inner) or "") + above
            yield Public(f"{where}: {inner.name}", inner, doc)


@cache
def everything() -> list[Public]:
    """All public functions of the package; what overrides another without words has its words."""
    found = [
        function
        for path in sorted(ROOT.rglob("*.py"))
        for function in publics(
            ast.parse(path.read_text(encoding="utf-8")), path.relative_to(ROOT).as_posix()
        )
    ]
    words = {f.node.name: f.doc for f in found if ast.get_docstring(f.node)}
    bare = [f for f in found if not ast.get_docstring(f.node)]
    return [replace(f, doc=f.doc + words.get(f.node.name, "")) if f in bare else f for f in found]


def surface() -> dict[str, Callable[..., Any]]:
    """The functions and methods that the page of the library names."""
    named = re.findall(
        r"(?:^::: |`)(kemba\.[\w.]+)", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
    found: dict[str, Callable[..., Any]] = {}
    for name in [*named, *(f"kemba.{name}" for name in kemba.__all__)]:
        thing = pkgutil.resolve_name(name)
        if inspect.isclass(thing):  # no methods of pydantic's
            own = {f"{name}.{n}": getattr(thing, n) for n in vars(thing) if not n.startswith("_")}
            found |= {
                n: f for n, f in own.items() if getattr(f, "__module__", "").startswith("kemba")
            }
        elif inspect.isfunction(thing):
            found[name] = thing
    return {function.__qualname__: function for function in found.values()}


def test_everything_is_described() -> None:
    assert not [f.where for f in everything() if not f.doc]


def test_functions_of_arrays_give_shapes() -> None:
    arrays = [f for f in everything() if f.takes_arrays]
    assert len(arrays) > 200 and not [f.where for f in arrays if not SHAPE.search(f.doc)]


def test_functions_that_raise_say_what() -> None:
    raisers = [f for f in everything() if f.raises]
    assert len(raisers) > 100 and not [f.where for f in raisers if not RAISES.search(f.doc)]


def unexplained(name: str, function: Callable[..., Any]) -> Iterator[str]:
    """Arguments that the words do not name, numbers without a unit, errors that are not told."""
    doc = " ".join((inspect.getdoc(function) or "").split())
    for argument, given in inspect.signature(function).parameters.items():
        if argument not in ("self", "cls") and not re.search(rf"`{argument}\b", doc):
            yield f"{name}: `{argument}` is not explained"
        number = re.search(r"\bfloat\b", str(given.annotation))
        if number and not re.search(rf"`{argument}`[^;.]*?(?:{UNIT})", doc):
            yield f"{name}: `{argument}` has no unit"
    code = inspect.unwrap(getattr(function, "__func__", function)).__code__
    fails = name in kemba.__all__ or "KembaError" in code.co_names
    if fails and "Raises KembaError" not in doc:
        yield f"{name}: what it raises is not told"


def test_what_the_library_offers_is_explained() -> None:
    found = surface()
    assert {*kemba.__all__, "Trajectory.read", "characterise", "review"} <= set(found)
    assert not [fault for name, f in found.items() for fault in unexplained(name, f)]


def test_what_is_not_explained_is_found() -> None:
    """Else the test above could not fail."""

    def made(path: str, speed: float) -> None:
        """Something at `speed`."""
        raise KembaError(path, f"{speed}")

    assert list(unexplained("made", made)) == [
        "made: `path` is not explained",
        "made: `speed` has no unit",
        "made: what it raises is not told",
    ]


def test_every_effect_has_its_source() -> None:
    """Of its equations, and of what its figures are believed to be off by."""
    for effect in EFFECTS:
        assert effect.source and all(t.source for t in effect.nominal.values()), effect.kind
