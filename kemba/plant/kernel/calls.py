"""Calling machine code by its address."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from kemba.plant.kernel.jit import kernel
from kemba.plant.stepping.arrays import Array


@intrinsic  # type: ignore[untyped-decorator, unused-ignore]
def _call(typing: Any, address: Any, x: Any, first: Any, second: Any) -> Any:
    """`f(x*, y0*, y1*)` at an address; pointers are integers here."""

    def build(context: Any, builder: Any, _: Any, values: Any) -> Any:
        pointer = ir.DoubleType().as_pointer()
        function = ir.FunctionType(ir.VoidType(), [pointer] * 3).as_pointer()
        places = [builder.inttoptr(value, pointer) for value in values[1:]]
        builder.call(builder.inttoptr(values[0], function), places)
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, types.intp, types.intp), build


@kernel
def evaluate(address: int, x: Array, first: Array, second: Array) -> None:
    """Call machine code at `address`: from x (k,) it fills the arrays `first` and `second`."""
    _call(address, x.ctypes.data, first.ctypes.data, second.ctypes.data)
