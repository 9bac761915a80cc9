"""`-v`, which every verb takes: each iteration, the time taken, whole tracebacks."""

from __future__ import annotations

import functools
import inspect
import time
from collections.abc import Callable
from typing import Any

from kemba_cli.common import Verbose, loud, say


def with_verbose(verb: Callable[..., None]) -> Callable[..., None]:
    """The verb with `-v` as one option more, for typer to find in its signature."""

    @functools.wraps(verb)
    def run(*args: Any, verbose: bool = False, **options: Any) -> None:
        before = loud.set(verbose)
        began, worked = time.monotonic(), time.process_time()
        try:
            verb(*args, **options)
        finally:
            loud.reset(before)
            if verbose:
                took, cpu = time.monotonic() - began, time.process_time() - worked
                say(f"took {took:.1f} s, {cpu:.1f} s of it computing", options.get("quiet", False))

    signature = inspect.signature(verb, eval_str=True)
    added = inspect.Parameter("verbose", inspect.Parameter.KEYWORD_ONLY, default=False)
    listed = [*signature.parameters.values(), added.replace(annotation=Verbose)]
    run.__signature__ = signature.replace(parameters=listed)  # type: ignore[attr-defined]
    run.__annotations__ = {**verb.__annotations__, "verbose": Verbose}
    return run
