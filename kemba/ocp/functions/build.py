"""A process of its own that compiles one C file into the cache; needs nothing but Python.

Arguments: working folder, library to make, manifest to write, then the compiler's command. The
manifest comes last: a library without one is never loaded.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path


def build(folder: Path, library: Path, manifest: Path, compiler: list[str]) -> None:
    """Compile `functions.c` in `folder`, then move the library and its hash into the cache.

    A library is loaded by a process of its own first: what kills that one is not kept.
    """
    os.umask(0o077)  # no one else may write what we shall load
    if hasattr(os, "nice"):
        os.nice(10)
    product, facts = folder / "functions.so", folder / "manifest.json"
    command = [*compiler, str(folder / "functions.c"), "-o", str(product), "-lm"]
    try:
        subprocess.run(command, check=True, stdin=subprocess.DEVNULL, capture_output=True)
        product.chmod(0o700)
        load = [sys.executable, "-I", "-S", "-c", "import ctypes, sys; ctypes.CDLL(sys.argv[1])"]
        subprocess.run([*load, str(product)], check=True, capture_output=True)
        facts.write_text(json.dumps({"sha256": hashlib.sha256(product.read_bytes()).hexdigest()}))
        manifest.unlink(missing_ok=True)
        product.replace(library)
        facts.replace(manifest)
    except (OSError, subprocess.CalledProcessError):
        pass  # no compiled code, then; nobody needs it
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    build(Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]), sys.argv[4:])
