"""Streams and options shared by the verbs: results on stdout, messages on stderr."""

from __future__ import annotations

import functools
import inspect
import json
import sys
import time
from collections.abc import Callable
from contextvars import ContextVar
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console


effect_files: ContextVar[tuple[Path, ...]] = ContextVar("effect_files", default=())


def _load_effects(files: list[Path] | None) -> list[Path] | None:
    """Add the effects of the user's files, before the verb reads any YAML."""
    effect_files.set(tuple(files or ()))
    if files:
        from kemba.effects import BY_KIND
        from kemba.errors import KembaError

        try:
            for file in files:
                BY_KIND.load_file(file)
        except KembaError as error:
            typer.echo(str(error), err=True)
            raise typer.Exit(2) from None
    return files


OwnEffects = Annotated[
    list[Path] | None,
    typer.Option(
        "--effects",
        callback=_load_effects,
        help="Python file with effects of your own (its code is run); may be repeated.",
    ),
]
Foreign = Annotated[str | None, typer.Option("--map", help="Column map YAML for foreign logs.")]
Force = Annotated[bool, typer.Option("--force", help="Replace results that are there already.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Say more: iterations, time taken, tracebacks.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but the result.")]
loud: ContextVar[bool] = ContextVar("loud", default=False)  # whether `-v` was given


@lru_cache(maxsize=1)
def results() -> Console:
    """The console for results (stdout)."""
    from rich.console import Console

    return Console(highlight=False)


@lru_cache(maxsize=1)
def talk() -> Console:
    """The console for progress and remarks (stderr)."""
    from rich.console import Console

    return Console(stderr=True, highlight=False)


def say(text: str, quiet: bool = False) -> None:
    """A remark on stderr, as it is: `[N.m]` is a unit, not markup."""
    if not quiet:
        typer.echo(text, err=True)


def newest(quiet: bool, holds: str = "trajectory.csv") -> Path:
    """The newest run here that has the file `holds`; says which. Raises KembaError."""
    from kemba.runs import newest_run

    run = newest_run(holds)
    say(f"the newest run: {run}", quiet)
    return run


def print_json(data: Any) -> None:
    """The one JSON object of `--json` on stdout; NaN becomes null."""
    from kemba.files import plain

    sys.stdout.write(json.dumps(plain(data), indent=2, allow_nan=False) + "\n")


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
