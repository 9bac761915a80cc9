"""The compiler's switch, and the folder that keeps what it made."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba import njit
from numba.core.errors import NumbaWarning

from kemba.ocp.nlp.compiled import cache_folder

Function = TypeVar("Function", bound=Callable[..., Any])


def _kept() -> str:
    """The folder of this version of the kernel. Numba itself would look only at the file of the
    outermost function, and would not see that another file has changed."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    content = b"".join(path.read_bytes() for path in sources) + numba.__version__.encode()
    return str(cache_folder() / f"plant-{hashlib.sha256(content).hexdigest()[:16]}")


FOLDER = _kept()


def kernel(function: Function) -> Function:
    """A function of the kernel, which only others of the kernel call.

    It divides as IEEE does. It works in memory that it is given, without counting references:
    that saves half of the time to compile it.
    """
    lean = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": False}
    return cast(Function, njit(error_model="numpy", **lean)(function))


def part(function: Function) -> Function:
    """A function of the kernel that is written into each of its callers: for one or two callers.

    Numba compiles and optimises all that a function calls together with it, so a deep nest of
    functions is compiled many times over.
    """
    return cast(Function, njit(error_model="numpy", inline="always", _nrt=False)(function))


def entry(function: Function) -> Function:
    """A function of the kernel that Python calls: compiled at its first call with all that it
    calls, and kept on disk where that can be written. It lets other threads run."""
    options = {"nogil": True, "error_model": "numpy", "_nrt": False}
    usual = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = os.environ.get("NUMBA_CACHE_DIR") or FOLDER
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NumbaWarning)
            return cast(Function, njit(cache=True, **options)(function))
    except RuntimeError:  # no folder can be written: compiled again by every process
        return cast(Function, njit(**options)(function))
    finally:
        numba.config.CACHE_DIR = usual
