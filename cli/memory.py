"""Too little memory: told before the work begins, or in words when it runs out."""

from __future__ import annotations

import errno
import os

NEEDED = 1_000_000_000  # B of address space; the largest verb, `solve`, took 0.86e9 with one thread
PER_THREAD = 200_000_000  # B; each further thread of linear algebra took 0.18e9
HINT = "raise the limit (`ulimit -v unlimited`), close other programs, or use a larger machine"


def shortage() -> str:
    """What is wrong with the memory limits of this process; empty where they suffice.

    Linear algebra libraries wait for ever, without a message, for memory that the limit refuses.
    """
    try:
        import resource
    except ImportError:  # not POSIX: there are no such limits
        return ""
    needed = NEEDED + PER_THREAD * (_threads() - 1)
    for name in ("RLIMIT_AS", "RLIMIT_DATA"):
        limit = resource.getrlimit(getattr(resource, name))[0]
        if limit not in (resource.RLIM_INFINITY, -1) and limit < needed:
            option = "-v" if name == "RLIMIT_AS" else "-d"
            return (
                f"the memory limit of this shell is {limit / 1e6:.0f} MB (`ulimit {option}`); "
                f"about {needed / 1e6:.0f} MB were expected; {HINT.replace('-v', option)}"
            )
    return ""


def used_up(error: BaseException) -> str:
    """The message for an error that means "no memory left"; empty for any other error."""
    text = str(error)
    signs = ("failed to map segment", "cannot allocate memory", "bad_alloc", "Unable to allocate")
    full = isinstance(error, MemoryError)
    full |= isinstance(error, OSError) and error.errno == errno.ENOMEM
    full |= isinstance(error, (ImportError, RuntimeError)) and any(s in text for s in signs)
    return f"there is not enough memory ({text or 'no memory left'}); {HINT}" if full else ""


def _threads() -> int:
    """Threads that linear algebra will start here."""
    asked = os.environ.get("OPENBLAS_NUM_THREADS", "")
    return max(1, int(asked) if asked.isdigit() else os.cpu_count() or 1)
