"""CasADi expressions as machine code, made by LLVM within this process: no compiler is needed.

LLVM comes with numba. CasADi has shared what is common, and LLVM only keeps values in registers
(without that the code takes twice as long): a model takes a tenth of a second to translate, and
its code is twenty times quicker than CasADi's own virtual machine.

Every function also comes as a loop over rows. Where the output of one row is an input of the next,
as with steps in time, it is written there.
"""

import ctypes
import struct
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from kemba.errors import KembaError
from kemba.instructions import replay

Array = NDArray[Any]
BINARY = {ca.OP_ADD: "fadd", ca.OP_SUB: "fsub", ca.OP_MUL: "fmul", ca.OP_DIV: "fdiv"}
COMPARE = {ca.OP_LT: "olt", ca.OP_LE: "ole", ca.OP_EQ: "oeq", ca.OP_NE: "une"}
INTRINSIC = {
    ca.OP_SQRT: "sqrt", ca.OP_FABS: "fabs", ca.OP_FLOOR: "floor", ca.OP_CEIL: "ceil",
    ca.OP_FMIN: "minnum", ca.OP_FMAX: "maxnum", ca.OP_COPYSIGN: "copysign",
}  # fmt: skip
LIBRARY = {
    ca.OP_SIN: "sin", ca.OP_COS: "cos", ca.OP_TAN: "tan", ca.OP_ASIN: "asin", ca.OP_ACOS: "acos",
    ca.OP_ATAN: "atan", ca.OP_ATAN2: "atan2", ca.OP_SINH: "sinh", ca.OP_COSH: "cosh",
    ca.OP_TANH: "tanh", ca.OP_ASINH: "asinh", ca.OP_ACOSH: "acosh", ca.OP_ATANH: "atanh",
    ca.OP_EXP: "exp", ca.OP_EXPM1: "expm1", ca.OP_LOG: "log", ca.OP_LOG1P: "log1p",
    ca.OP_POW: "pow", ca.OP_CONSTPOW: "pow", ca.OP_FMOD: "fmod", ca.OP_REMAINDER: "remainder",
    ca.OP_HYPOT: "hypot", ca.OP_ERF: "erf",
}  # fmt: skip


class Native:
    """Functions of one vector x in machine code; `address[name]` is where each begins.

    `functions`: by name the outputs, up to two, each a matrix of expressions of the symbols
    `inputs`, which x holds one after the other. The code is `f(x*, y0*, y1*)`: it writes the
    entries that are not identically zero, by rows; the others must be zero beforehand.
    Raises KembaError on an operation that machine code has no word for.
    """

    def __init__(self, inputs: Sequence[ca.SX], functions: Mapping[str, Sequence[ca.SX]]) -> None:
        program = _Program()
        x = [ca.SX(ca.vertcat(*inputs))]
        bodies = [program.function(name, x, outputs) for name, outputs in functions.items()]
        self._engine = _compiled("\n".join([*program.declarations, *bodies]))  # holds the code
        self.address = {name: self._engine.get_function_address(name) for name in functions}
        self._loops = {
            name: self._engine.get_function_address(f"{name}.rows") for name in functions
        }

    def rows(self, name: str, x: Array, *outputs: Array) -> None:
        """Evaluate one function for every row of x (n, .), into the rows of up to two outputs, in
        place and one after the other.

        Rows may lie anywhere, each of them in one piece: an output that is a part of x, one row
        further, makes steps in time.
        """
        arrays = (x, *outputs, np.empty((1, 0)))[:3]
        if any(a.dtype != np.float64 or a.strides[1] != a.itemsize for a in arrays if a.size):
            raise ValueError("rows of doubles in one piece were expected")
        word = ctypes.c_void_p
        call = ctypes.CFUNCTYPE(None, word, word, word, *[ctypes.c_int64] * 4)
        strides = [a.strides[0] // a.itemsize for a in arrays]
        call(self._loops[name])(*(a.ctypes.data for a in arrays), len(outputs[0]), *strides)

    def __call__(self, name: str, x: Array, *outputs: Array) -> None:
        """Evaluate one function into arrays in place (for looking at; the kernel calls itself)."""
        call = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
        places = [array.ctypes.data for array in (x, *outputs, np.empty(0))[:3]]
        call(self.address[name])(*places)


class SampleMap:
    """Functions of samples, the `outputs` as expressions of the symbols `inputs`; the answers are
    those of CasADi's own machine."""

    def __init__(self, inputs: Sequence[ca.SX], outputs: Sequence[ca.SX]) -> None:
        self._widths = [symbol.numel() for symbol in inputs]
        self._shapes = [output.shape for output in outputs]
        by_rows = [ca.reshape(output.T, output.numel(), 1) for output in outputs]
        self._code = Native(inputs, {"map": [ca.vertcat(*by_rows)]})

    def __call__(self, samples: Sequence[Array], p: Array | None = None) -> list[Array]:
        """Arrays (N, rows[, columns]) from samples (N, .); `p` (k,): last input of all."""
        given = [*samples] if p is None else [*samples, p]
        count = len(samples[0])
        x = np.empty((count, sum(self._widths)))
        edges = np.cumsum([0, *self._widths])
        for values, first, end in zip(given, edges[:-1], edges[1:], strict=True):
            x[:, first:end] = values
        y = np.zeros((count, sum(rows * columns for rows, columns in self._shapes)))
        self._code.rows("map", x, y)
        ends = np.cumsum([rows * columns for rows, columns in self._shapes])
        blocks = np.split(y, ends[:-1], axis=1)
        return [
            block if columns == 1 else block.reshape(count, rows, columns)
            for block, (rows, columns) in zip(blocks, self._shapes, strict=True)
        ]


@lru_cache(maxsize=64)
def _compiled(assembly: str) -> Any:
    """LLVM's engine that holds the code. Models that differ in a figure share most functions."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=llvm.get_host_cpu_features().flatten(), opt=1
    )
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(assembly), machine)
    engine.finalize_object()
    return engine


class _Program:
    """LLVM's assembly of functions, one line an instruction; every value has its own name."""

    def __init__(self) -> None:
        self.declarations: list[str] = []
        self._lines: list[str] = []
        self._count = 0

    def function(self, name: str, x: list[ca.SX], outputs: Sequence[ca.SX]) -> str:
        """The assembly of a function."""
        self._lines, self._count = [], 0
        shared = ca.cse([ca.sparsify(output) for output in outputs])
        f = ca.Function(name, x, shared)
        given = [self._new(f"load double, double* {self._at('x', i)}") for i in range(f.nnz_in(0))]
        found = replay(f, [given], _number, self._apply)
        for k, (values, output) in enumerate(zip(found, shared, strict=True)):
            rows, columns = output.sparsity().get_triplet()
            for value, row, column in zip(values, rows, columns, strict=True):
                place = self._at(f"y{k}", row * output.shape[1] + column)
                self._lines.append(f"store double {value}, double* {place}")
        head = f"define void @{name}(double* %x, double* %y0, double* %y1) {{"
        return "\n".join([head, *self._lines, "ret void", "}", LOOP.format(name=name)])

    def _apply(self, kind: int, *a: str) -> str:
        if kind in BINARY:
            return self._new(f"{BINARY[kind]} double {a[0]}, {a[1]}")
        if kind in LIBRARY or kind in INTRINSIC:
            return self._call(LIBRARY.get(kind) or f"llvm.{INTRINSIC[kind]}.f64", *a)
        if kind in COMPARE:
            return self._truth(self._new(f"fcmp {COMPARE[kind]} double {a[0]}, {a[1]}"))
        if kind == ca.OP_SIGN:
            up = self._apply(ca.OP_LT, "0.0", a[0])
            return self._apply(ca.OP_SUB, up, self._apply(ca.OP_LT, a[0], "0.0"))
        if kind == ca.OP_IF_ELSE_ZERO:
            return self._new(f"select i1 {self._bit(a[0])}, double {a[1]}, double 0.0")
        if kind in (ca.OP_AND, ca.OP_OR):
            word = "and" if kind == ca.OP_AND else "or"
            return self._truth(self._new(f"{word} i1 {self._bit(a[0])}, {self._bit(a[1])}"))
        simple = {
            ca.OP_NEG: "fneg double {0}",
            ca.OP_TWICE: "fadd double {0}, {0}",
            ca.OP_SQ: "fmul double {0}, {0}",
            ca.OP_INV: "fdiv double 1.0, {0}",
            ca.OP_ASSIGN: "fadd double {0}, -0.0",
        }
        if kind in simple:
            return self._new(simple[kind].format(*a))
        if kind == ca.OP_NOT:
            return self._apply(ca.OP_EQ, a[0], "0.0")
        raise KembaError("model", f"has no machine code for CasADi's operation {kind}")

    def _new(self, text: str) -> str:
        self._count += 1
        self._lines.append(f"%v{self._count} = {text}")
        return f"%v{self._count}"

    def _at(self, pointer: str, index: int) -> str:
        return self._new(f"getelementptr double, double* %{pointer}, i64 {index}")

    def _bit(self, value: str) -> str:
        return self._new(f"fcmp une double {value}, 0.0")

    def _truth(self, bit: str) -> str:
        return self._new(f"uitofp i1 {bit} to double")

    def _call(self, name: str, *operands: str) -> str:
        declaration = f"declare double @{name}({', '.join(['double'] * len(operands))})"
        if declaration not in self.declarations:
            self.declarations.append(declaration)
        return self._new(f"call double @{name}({', '.join(f'double {x}' for x in operands)})")


# the assembly of a function over n rows of x, y0 and y1, which begin dx, d0 and d1 numbers after
# each other
LOOP = """
define void @{name}.rows(double* %x, double* %y0, double* %y1,
                         i64 %n, i64 %dx, i64 %d0, i64 %d1) {{
begin:
  br label %test
test:
  %i = phi i64 [0, %begin], [%next, %body]
  %more = icmp slt i64 %i, %n
  br i1 %more, label %body, label %end
body:
  %at.x = mul i64 %i, %dx
  %at.y0 = mul i64 %i, %d0
  %at.y1 = mul i64 %i, %d1
  %row.x = getelementptr double, double* %x, i64 %at.x
  %row.y0 = getelementptr double, double* %y0, i64 %at.y0
  %row.y1 = getelementptr double, double* %y1, i64 %at.y1
  call void @{name}(double* %row.x, double* %row.y0, double* %row.y1)
  %next = add i64 %i, 1
  br label %test
end:
  ret void
}}
"""


def _number(value: float) -> str:
    """A constant by its bits, so that nothing is rounded."""
    bits: Any = struct.unpack("<Q", struct.pack("<d", value))[0]
    return f"0x{bits:016X}"
