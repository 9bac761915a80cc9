"""Compilation switch: cached, keyed by the content of every kernel file.

Numba's own cache looks only at the file of the outermost function, so a changed callee in another
file would be served stale.  Naming the cache folder after the content of all files prevents that
(and after the package name: compiled code remembers under which name it was imported).
"""

from __future__ import annotations

import getpass
import hashlib
import os
import tempfile
from pathlib import Path

import numba
from numba import njit as _njit

_FILES = sorted(Path(__file__).parent.glob("*.py"))
_CONTENT = b"".join(f.read_bytes() for f in _FILES) + __name__.encode()
_KEY = hashlib.sha256(_CONTENT).hexdigest()[:16]

if "NUMBA_CACHE_DIR" not in os.environ:
    try:
        _user = getpass.getuser()
    except (KeyError, OSError):
        _user = "user"
    _root = Path(tempfile.gettempdir()) / f"twin-numba-{_user}"
    numba.config.CACHE_DIR = str(_root / _KEY)


def njit(function):
    """Compile `function` on first use and keep the machine code on disk."""
    return _njit(cache=True, error_model="numpy")(function)
