"""Optional speed: the same functions as C code, compiled once and kept by content.

Never needed and never waited for: the compiler works beside the first solve, which goes on with
the functions as they are; later ones find the library.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

import casadi as ca

from kemba.ocp.nlp.settings import Functions

FLAGS = ("-O1", "-fPIC", "-shared", "-ffp-contract=off")  # contraction would change the last bits


def cache_folder() -> Path:
    """Where compiled functions are kept: KEMBA_CACHE, or the user's cache folder."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(os.environ.get("KEMBA_CACHE") or Path(base) / "kemba")


def compiled(functions: Sequence[ca.Function], wait: bool = False) -> list[ca.Function]:
    """The functions as compiled code where there is some, the same numbers either way.

    Starts a compiler for the next time where there is none, or waits for it. KEMBA_COMPILE=0 does
    without.
    """
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None or os.name != "posix" or os.environ.get("KEMBA_COMPILE") == "0":
        return list(functions)
    text = "".join(f.serialize() for f in functions) + ca.CasadiMeta.version() + " ".join(FLAGS)
    key = hashlib.sha256(text.encode()).hexdigest()[:24]
    library = cache_folder() / f"{key}.so"
    try:
        if not library.exists():
            _compile(functions, compiler, library, wait)
        if not library.exists():
            return list(functions)
        return [ca.external(f.name(), str(library)) for f in functions]
    except (OSError, RuntimeError):
        return list(functions)


def _compile(functions: Sequence[ca.Function], compiler: str, library: Path, wait: bool) -> None:
    """Set a compiler to work, unless one is already, in a process that outlives ours."""
    library.parent.mkdir(parents=True, exist_ok=True)
    folder = library.with_suffix(".making")
    if folder.exists() and time.time() - folder.stat().st_mtime > Functions.current().stale:
        shutil.rmtree(folder, ignore_errors=True)
    try:
        folder.mkdir()
    except FileExistsError:
        return
    generator = ca.CodeGenerator("functions.c")
    for function in functions:
        generator.add(function)
    generator.generate(f"{folder}/")
    source, product = str(folder / "functions.c"), str(folder / "functions.so")
    build = shlex.join(["nice", compiler, *FLAGS, source, "-o", product, "-lm"])
    keep = shlex.join(["mv", product, str(library)])  # whole, so that nobody loads half of it
    script = f"{build} && {keep}; {shlex.join(['rm', '-rf', str(folder)])}"
    quiet = subprocess.DEVNULL
    subprocess.run(
        ["sh", "-c", script if wait else f"({script}) &"],
        stdin=quiet,
        stdout=quiet,
        stderr=quiet,
        start_new_session=True,
        check=False,
    )
