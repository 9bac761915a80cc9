"""Optional speed: the same functions as C code, compiled once and kept in a cache.

The compiler runs beside the first solve, which uses the functions as they are and does not wait.
Later solves find the library under the hash of the functions. Code is loaded only from a folder
that belongs to the user and that nobody else can write, and only when the file is what the
compiler made. Anything else is compiled again, or not used.
"""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import casadi as ca

from kemba.cache import cache_folder, is_mine, is_own
from kemba.ocp.functions.settings import Functions

FLAGS = ("-O1", "-fPIC", "-shared", "-ffp-contract=off")  # contraction would change the last bits


def compiled(functions: Sequence[ca.Function], wait: bool = False) -> list[ca.Function]:
    """The functions as compiled code where there is some, the same numbers either way.

    Starts a compiler for the next time where there is none, or waits for it. KEMBA_COMPILE=0 does
    without.
    """
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    folder = cache_folder()
    off = os.environ.get("KEMBA_COMPILE") == "0" or os.name != "posix"
    if compiler is None or folder is None or off:
        return list(functions)
    text = "".join(f.serialize() for f in functions) + ca.CasadiMeta.version() + " ".join(FLAGS)
    key = hashlib.sha256(text.encode()).hexdigest()[:24]
    library = folder / f"{key}.so"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not is_own(folder):
            return list(functions)
        if not is_whole(library):
            _compile(functions, compiler, library, wait)
        if not is_whole(library):
            return list(functions)
        return [ca.external(f.name(), str(library)) for f in functions]
    except (OSError, RuntimeError):
        return list(functions)


def is_whole(library: Path) -> bool:
    """Whether a library in the user's own folder is what the compiler made.

    A file that was cut, overwritten with zeros or exchanged would kill the process that loads it.
    """
    manifest = library.with_suffix(".json")
    try:
        if not (is_mine(library.lstat()) and is_mine(manifest.lstat())):
            return False
        facts = json.loads(manifest.read_text(encoding="utf-8"))
        content = library.read_bytes()
    except (OSError, ValueError):
        return False
    known = facts.get("sha256") if isinstance(facts, dict) else None
    return bool(known == hashlib.sha256(content).hexdigest())


def _compile(functions: Sequence[ca.Function], compiler: str, library: Path, wait: bool) -> None:
    """Start a compiler, unless one is at work already, in a process that may outlive ours."""
    folder = library.with_suffix(".making")
    if folder.exists() and time.time() - folder.stat().st_mtime > Functions.current().stale:
        shutil.rmtree(folder, ignore_errors=True)
    try:
        folder.mkdir(mode=0o700)
    except FileExistsError:
        return
    generator = ca.CodeGenerator("functions.c")
    for function in functions:
        generator.add(function)
    generator.generate(f"{folder}/")
    places = [folder, library, library.with_suffix(".json")]
    script = Path(__file__).with_name("build.py")
    command = [sys.executable, "-I", "-S", script, *places, compiler, *FLAGS]
    build = shlex.join(str(part) for part in command)
    quiet = subprocess.DEVNULL
    subprocess.run(
        ["sh", "-c", build if wait else f"({build}) &"],
        stdin=quiet,
        stdout=quiet,
        stderr=quiet,
        start_new_session=True,
        check=False,
    )
