"""Optional speed: the same functions as C code, compiled once and kept by content.

Never needed: without a compiler, or when compiling fails, the functions come back as they are.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import casadi as ca

FLAGS = ("-O1", "-fPIC", "-shared", "-ffp-contract=off")  # contraction would change the last bits


def cache_folder() -> Path:
    """Where compiled functions are kept: KEMBA_CACHE, or the user's cache folder."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(os.environ.get("KEMBA_CACHE") or Path(base) / "kemba")


def compiled(functions: Sequence[ca.Function]) -> list[ca.Function]:
    """The functions as compiled code where possible, the same numbers either way.

    Set KEMBA_COMPILE=0 to do without.
    """
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None or os.environ.get("KEMBA_COMPILE") == "0":
        return list(functions)
    text = "".join(f.serialize() for f in functions) + ca.CasadiMeta.version() + " ".join(FLAGS)
    key = hashlib.sha256(text.encode()).hexdigest()[:24]
    library = cache_folder() / f"{key}.so"
    try:
        if not library.exists():
            _compile(functions, compiler, library)
        return [ca.external(f.name(), str(library)) for f in functions]
    except (OSError, subprocess.SubprocessError, RuntimeError):
        return list(functions)


def _compile(functions: Sequence[ca.Function], compiler: str, library: Path) -> None:
    library.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        generator = ca.CodeGenerator("functions.c")
        for function in functions:
            generator.add(function)
        generator.generate(f"{folder}/")
        source, product = f"{folder}/functions.c", f"{folder}/functions.so"
        command = [compiler, *FLAGS, source, "-o", product, "-lm"]
        subprocess.run(command, check=True, capture_output=True, timeout=120)
        Path(product).replace(library)  # whole or not at all, whoever else compiles the same
