"""Docstrings: functions of arrays give shapes, those that raise say what."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import kemba

ROOT = Path(kemba.__file__).parent
ARRAY = re.compile(r"\b(Array|ndarray|Flags|Labels)\b")
SHAPE = re.compile(r"\([^()]*,[^()]*\)|\((n|m|k)\)|\[\w")  # (n, 3), (n,), (n) or `values[i]`
FEW = 0.05  # share of functions that may be forgotten


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
        if isinstance(inner, ast.ClassDef):
            yield from publics(inner, where, ast.get_docstring(inner) or "")
        elif isinstance(inner, ast.FunctionDef) and not inner.name.startswith("_"):
            doc = (ast.get_docstring(inner) or "") + above
            yield Public(f"{where}: {inner.name}", inner, doc)


def everything() -> list[Public]:
    """All public functions of the package."""
    return [
        function
        for path in sorted(ROOT.rglob("*.py"))
        for function in publics(
            ast.parse(path.read_text(encoding="utf-8")), path.relative_to(ROOT).as_posix()
        )
    ]


def test_functions_of_arrays_give_shapes() -> None:
    arrays = [f for f in everything() if f.takes_arrays]
    bare = [f.where for f in arrays if not SHAPE.search(f.doc)]
    assert len(arrays) > 200 and len(bare) <= FEW * len(arrays), bare


def test_functions_that_raise_say_what() -> None:
    raisers = [f for f in everything() if f.raises]
    silent = [f.where for f in raisers if "aise" not in f.doc]
    assert len(raisers) > 100 and len(silent) <= FEW * len(raisers), silent
