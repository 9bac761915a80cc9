"""Exit codes and messages of failures, the same for every verb."""

import errno
import functools
import os
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import typer

from kemba.errors import KembaError
from kemba_cli.common import manner

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


OF_THE_DISK = (
    *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO),
)
BAD_ANSWER = 1
BAD_INPUT = 2
INTERRUPTED = 130


def guarded(verb: Callable[..., None]) -> Callable[..., None]:
    """The verb, with exceptions turned into messages on stderr and exit codes.

    It raises typer.Exit with the exit code. A broken output pipe is passed on to click.
    """

    @functools.wraps(verb)
    def run(*args: Any, **options: Any) -> None:
        short = shortage()
        if short:
            typer.echo(short, err=True)
            raise typer.Exit(BAD_ANSWER)
        try:
            verb(*args, **options)
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except (Exception, KeyboardInterrupt) as error:
            if isinstance(error, OSError) and error.errno == errno.EPIPE:
                raise  # the reader of our output has closed it; click exits without a message
            text, code = _told(error)
            typer.echo(text, err=True)
            raise typer.Exit(code) from None

    return run


def _told(error: BaseException) -> tuple[str, int]:
    """The message on an error, and the exit code."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted", INTERRUPTED
    if isinstance(error, KembaError):
        from kemba.files import DiskFull

        # the command was right when only the disk is full
        return str(error), BAD_ANSWER if isinstance(error, DiskFull) else BAD_INPUT
    if isinstance(error, OSError) and error.errno in OF_THE_DISK:
        from kemba.files import write_error

        # without a name it was our own output
        return str(write_error(error.filename or "the output", error)), BAD_ANSWER
    return used_up(error) or _crash(error), BAD_ANSWER


def _crash(error: BaseException) -> str:
    """The message on an unexpected exception: short, or the traceback with KEMBA_DEBUG."""
    whole = "".join(traceback.format_exception(error))
    if os.environ.get("KEMBA_DEBUG") or manner.get().verbose:
        return whole
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="kemba-crash-", suffix=".log", delete=False, encoding="utf-8"
        ) as log:
            log.write(whole)
        attached = f"the file {log.name}"
    except OSError:
        attached = "what KEMBA_DEBUG=1 shows"
    last = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{Path(last.filename).name}:{last.lineno}"
    return (
        f"kemba failed unexpectedly: {type(error).__name__} at {place}: {error}\n"
        f"This is a fault of kemba; please report it with {attached}"
    )
