"""A process of its own that reads a MATLAB file; needs NumPy and SciPy only.

SciPy's reader is compiled code that trusts the file: damaged bytes may kill the process it runs in.
Argument: the file. The arrays of numbers and texts go to the standard output as .npz: `names`, then
the arrays as `a0`, `a1` and so on. Exit code 1 with the reason where SciPy cannot read the file.
"""

import contextlib
import io
import sys
from typing import Any

import numpy as np
from scipy.io import loadmat

MEMORY = 6_000_000_000  # bytes: an unpacked log of the size that is allowed, three times


def arrays(path: str) -> dict[str, np.ndarray]:
    """Arrays of numbers or texts by name; others are left out."""
    found = {}
    for name, value in loadmat(path, appendmat=False, squeeze_me=True).items():
        array = np.asarray(value)
        if array.dtype == object and all(isinstance(item, str) for item in array.flat):
            array = array.astype(str)
        if not name.startswith("__") and array.dtype.kind in "fiubU":
            found[name] = array
    return found


def limit_memory() -> None:
    """Let packed zeros end in a MemoryError of this process, where the system can."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


def main() -> int:
    limit_memory()
    try:
        found = arrays(sys.argv[1])
    except Exception as error:  # of damaged bytes SciPy raises anything
        print(f"{type(error).__name__}: {error}"[:200], file=sys.stderr)
        return 1
    stream = io.BytesIO()
    numbered: dict[str, Any] = {f"a{i}": array for i, array in enumerate(found.values())}
    np.savez(stream, names=np.array(list(found), dtype=str), **numbered)
    sys.stdout.buffer.write(stream.getvalue())
    return 0


if __name__ == "__main__":
    sys.exit(main())
