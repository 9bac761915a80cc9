"""Compilation switch and the folder where slow results are kept between runs.

Numba's own cache looks only at the file of the outermost function, so a changed callee in another
file would be served stale.  Naming the folder after the content of all kernel files prevents that
(and after the package name: compiled code remembers under which name it was imported).
"""

import getpass
import hashlib
import os
import tempfile
from pathlib import Path

import numba
from numba import njit as _njit

_KERNELS = (
    "air",
    "bench",
    "bodies",
    "catalogue",
    "contact",
    "control",
    "figures",
    "jit",
    "loads",
    "machine",
)
_PLANNERS = ("layout", "motions", "plan", "run", "scripts", "sliding", "valves")


def _fingerprint(*names: str) -> str:
    here = Path(__file__).parent
    content = b"".join((here / f"{n}.py").read_bytes() for n in names)
    return hashlib.sha256(content + __name__.encode()).hexdigest()[:16]


def kept(kind: str) -> Path:
    """Folder for `kind` ("code" or "motions"), named after the sources it depends on."""
    try:
        user = getpass.getuser()
    except (KeyError, OSError):
        user = "user"
    names = _KERNELS if kind == "code" else _KERNELS + _PLANNERS
    return Path(tempfile.gettempdir()) / f"twin-{user}" / f"{kind}-{_fingerprint(*names)}"


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(kept("code"))


def njit(function):
    """Compile `function` on first use and keep the machine code on disk."""
    return _njit(cache=True, error_model="numpy")(function)
