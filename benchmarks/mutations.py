"""The usual one-line changes of mutation testing, at every place of a Python file.

A comparison, an arithmetic sign, `and`/`or`, a dropped `not` or sign, a constant, an index, a
dropped branch, min/max and any/all, the order of two arguments of one type, a dropped keyword.
Annotations, decorators, asserts, texts (of errors, too), __repr__ and __str__ are left out.
"""

import ast
import re
from itertools import pairwise
from typing import Any

SIGNS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+"}
SIGNS |= {"*": "/", "/": "*", "//": "/", "and": "or", "or": "and", "in": "not in", "not in": "in"}
SIGNS |= {"is": "is not", "is not": "is", "**": "*"}
NAMES = {"min": "max", "any": "all", "minimum": "maximum", "argmin": "argmax", "nanmin": "nanmax"}
NAMES |= {new: old for old, new in NAMES.items()}
WORDS = ("description", "title", "help")  # keywords with texts
LEFT_OUT = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Import, ast.ImportFrom)
Change = tuple[int, int, int, str, str]  # line, first and last byte in it, new text, operator


class Places:
    """All changes of a file; `alike` has the types of the arguments of functions, by their name."""

    def __init__(self, text: str, alike: dict[str, list[str]]) -> None:
        self.lines, self.alike, self.found = text.splitlines(), alike, list[Change]()
        self.visit(ast.parse(text))

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, LEFT_OUT) or getattr(node, "name", "") in ("__repr__", "__str__"):
            return
        self.change(node)
        for name, value in ast.iter_fields(node):
            if name not in ("annotation", "returns", "decorator_list"):
                for child in value if isinstance(value, list) else [value]:
                    if isinstance(child, ast.AST):
                        self.visit(child)

    def change(self, node: Any) -> None:
        match node:
            case ast.Compare():
                self.signs([node.left, *node.comparators], "comparison")
            case ast.BinOp():
                self.signs([node.left, node.right], "arithmetic")
            case ast.BoolOp():
                self.signs(node.values, "and/or")
            case ast.UnaryOp(op=ast.Not() | ast.USub()):
                self.put(node, f"({self.text(node.operand)})", "sign or not dropped")
            case ast.Constant(value=bool(value)):
                self.put(node, str(not value), "constant")
            case ast.Constant(value=int(value)):
                self.put(node, str(value + 1), "constant")
            case ast.Constant(value=float(value)):
                self.put(node, repr(1.1 * value or 1.0), "constant")
            case ast.Subscript(slice=ast.Constant(value=0)):
                self.put(node.slice, "-1", "index")
            case ast.If() | ast.IfExp():
                self.put(node.test, "False", "branch dropped")
            case ast.Call():
                self.call(node)

    def signs(self, operands: list[Any], operator: str) -> None:
        """The signs between operands; parentheses may stand beside them."""
        for left, right in pairwise(operands):
            line = self.lines[left.end_lineno - 1].encode()
            between = line[left.end_col_offset : right.col_offset].decode()
            sign = re.fullmatch(r"[)\s]*([^()\s]+(?: not| in)?)[(\s]*", between)
            if left.end_lineno == right.lineno and sign and sign[1] in SIGNS:
                first = left.end_col_offset + sign.start(1)
                last = first + len(sign[1])
                self.found.append((right.lineno, first, last, SIGNS[sign[1]], operator))

    def call(self, node: ast.Call) -> None:
        name = getattr(node.func, "id", getattr(node.func, "attr", ""))
        if name in NAMES:
            whole = self.text(node.func)
            self.put(node.func, whole.removesuffix(name) + NAMES[name], "min/max, any/all")
        kinds = pairwise(self.alike.get(name, []))
        for (one, other), (kind, its) in zip(pairwise(node.args), kinds, strict=False):
            if kind == its and one.lineno == other.end_lineno:
                new = f"{self.text(other)}, {self.text(one)}"
                one.end_col_offset = other.end_col_offset
                self.put(one, new, "order of arguments")
        for keyword in node.keywords:
            line = self.lines[keyword.lineno - 1].encode()
            before = len(re.search(rb",?\s*$", line[: keyword.col_offset])[0])
            after = len(re.match(rb",?\s*", line[keyword.end_col_offset :])[0])
            keyword.col_offset -= before
            keyword.end_col_offset += 0 if line[keyword.col_offset :].startswith(b",") else after
            if keyword.arg not in WORDS:
                self.put(keyword, "", "keyword dropped")

    def text(self, node: Any) -> str:
        return self.lines[node.lineno - 1].encode()[node.col_offset : node.end_col_offset].decode()

    def put(self, node: Any, new: str, operator: str) -> None:
        if node.lineno == node.end_lineno:
            change = (node.lineno, node.col_offset, node.end_col_offset, new, operator)
            self.found.append(change)
