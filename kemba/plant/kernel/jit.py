"""The compiler's switch, and the folder that keeps what it made.

The first simulation on a machine waits for the compiler, later ones and other processes load what
it made. Code is
loaded only from a folder that belongs to the user and that nobody else can write; without one
every process compiles anew.
"""

import gc
import hashlib
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar, cast

import numba
from numba import njit

from kemba.cache import cache_folder, is_own
from kemba.folders import alone

Function = TypeVar("Function", bound=Callable[..., Any])
LEAN = {"error_model": "numpy", "_nrt": False}  # IEEE division; no counting of references
_COMPILING = Lock()


def kernel(function: Function) -> Function:
    """A function that only other functions of the kernel call."""
    return cast(Function, njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **LEAN)(function))


def part(function: Function) -> Function:
    """A function of the kernel that is copied into its caller (inlined): for those with one caller.

    Numba compiles a function together with all functions that it calls. Without copying, deeply
    nested functions would be compiled many times.
    """
    return cast(Function, njit(inline="always", **LEAN)(function))


def entry(function: Function) -> Function:
    """A function of the kernel that Python calls. At its first call it is compiled, or loaded from
    the cache, with all that it calls. While it runs, other threads can run."""
    with _settings():
        try:
            made = njit(cache=FOLDER is not None, nogil=True, **LEAN)(function)
        except RuntimeError:  # the folder cannot be written
            made = njit(nogil=True, **LEAN)(function)

    def call(*arguments: Any) -> Any:
        nonlocal made
        if not made.overloads:
            with _COMPILING, _settings(), alone(FOLDER), _uncollected():
                types = tuple(numba.typeof(value) for value in arguments)
                try:
                    made.compile(types)
                except (OSError, EOFError, pickle.UnpicklingError):  # a damaged cache
                    made = njit(nogil=True, **LEAN)(function)
                    made.compile(types)
        return made(*arguments)

    call.__dict__["dispatcher"] = made
    return cast(Function, call)


def is_kept(function: Callable[..., Any]) -> bool:
    """Whether the folder holds machine code of an `entry` as it stands in this installation: what
    another one has left, or what was there before an update, numba compiles anew."""
    made = function.__dict__["dispatcher"]
    file = getattr(made._cache, "_cache_file", None)
    try:
        return bool(made.overloads) or (file is not None and bool(file._load_index()))
    except (OSError, EOFError, pickle.UnpicklingError):  # a damaged cache
        return False


@contextmanager
def _uncollected() -> Iterator[None]:
    """No search for garbage: the compiler makes millions of small things, an eighth of its time."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


@contextmanager
def _settings() -> Iterator[None]:
    """Our own cache folder, and no vector instructions: our arrays have a dozen entries."""
    level = type(numba.config.OPT)(1)
    wanted = {"CACHE_DIR": FOLDER or "", "OPT": level, "LOOP_VECTORIZE": 0, "SLP_VECTORIZE": 0}
    usual = {name: getattr(numba.config, name) for name in wanted}
    try:
        for name, value in wanted.items():
            setattr(numba.config, name, value)
        yield
    finally:
        for name, value in usual.items():
            setattr(numba.config, name, value)


def find_folder() -> str | None:
    """The cache folder of this version of the kernel; None where it would not be safe.

    Its name depends on all files of the kernel. Numba itself looks only at the file of the function
    that is called, and would not see a change in another file.
    """
    sources = sorted(Path(__file__).parent.rglob("*.py"))
    content = b"".join(path.read_bytes() for path in sources) + numba.__version__.encode()
    above = cache_folder()
    if above is None:
        return None
    folder = above / f"plant-{hashlib.sha256(content).hexdigest()[:16]}"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        return str(folder) if is_own(folder) and is_own(above) else None
    except OSError:
        return None


FOLDER = find_folder()


def load() -> None:
    """Have numba load what it needs for its first call; as much again as its import."""
    entry(_nothing)()


def _nothing() -> int:
    return 0
