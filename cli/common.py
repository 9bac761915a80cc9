"""Streams and options shared by the verbs: results on stdout, messages on stderr."""

from __future__ import annotations

import functools
import inspect
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True)
class Manner:
    """How a verb speaks: by one JSON object, with nothing but the result, with more than usual;
    `effects`: the files of the user's own effects. Who reads JSON is a program, to which nothing
    else is said unless more is asked for."""

    json: bool = False
    quiet: bool = False
    verbose: bool = False
    effects: Sequence[Path] = ()

    @property
    def silent(self) -> bool:
        """Whether nothing but the result is said."""
        return self.quiet or (self.json and not self.verbose)


USUALLY = Manner()
manner: ContextVar[Manner] = ContextVar("manner", default=USUALLY)


@contextmanager
def speaking(**how: Any) -> Iterator[None]:
    """Within the block verbs speak like this; see `Manner`."""
    before = manner.set(Manner(**how))
    try:
        yield
    finally:
        manner.reset(before)


def _load_effects(files: list[Path] | None) -> list[Path] | None:
    """Add the effects of the user's files, before the verb reads any YAML."""
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


Foreign = Annotated[str | None, typer.Option("--map", help="Column map YAML for foreign logs.")]
Force = Annotated[bool, typer.Option("--force", help="Replace results that are there already.")]
Logs = Annotated[
    list[Path], typer.Argument(help="Logs of one machine, or folders of logs, in any order.")
]
HeldOut = Annotated[
    list[Path] | None, typer.Option(help="A log kept for judging only; may be repeated.")
]
Written = Annotated[
    Path | None, typer.Argument(help="Run folder, as solve writes it (the newest).")
]
Executed = Annotated[Path | None, typer.Option(help="Run folder that was executed.")]
NewRun = Annotated[Path | None, typer.Option(help="Run folder to write (a new runs/TASK-N).")]
Set = Annotated[
    list[str] | None, typer.Option("--set", help="Override a key: --set 'height=0.6 m'.")
]
Show = Annotated[bool, typer.Option("--show", help="Open it in the browser.")]
OwnEffects = Annotated[
    list[Path] | None,
    typer.Option(
        "--effects",
        callback=_load_effects,
        help="Python file with effects of your own (its code is run); may be repeated.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but the result.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Say more: iterations, time taken, tracebacks.")
]
# options of every verb, by the fields of `Manner`
USUAL = {"effects": OwnEffects, "json": Json, "quiet": Quiet, "verbose": Verbose}


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


def say(text: str, always: bool = False) -> None:
    """A remark on stderr, as it is: `[N.m]` is a unit, not markup. `always`: whatever was asked."""
    if always or not manner.get().silent:
        typer.echo(text, err=True)


def warn(text: str) -> None:
    """What a program should hear of, too: on stderr beside JSON, but not with `-q`."""
    say(text, always=not manner.get().quiet)


def newest(holds: str = "trajectory.csv") -> Path:
    """The newest run here that has the file `holds`; says which. Raises KembaError."""
    from kemba.runs import newest_run

    run = newest_run(holds)
    say(f"the newest run: {run}")
    return run


def put_json(data: Any) -> bool:
    """Whether the answer is to be JSON; then it is printed, NaN as null."""
    if not manner.get().json:
        return False
    print_json(data)
    return True


def put(data: Any, text: object) -> None:
    """The answer on stdout: as JSON where that was asked for, else the text."""
    if not put_json(data):
        typer.echo(text)


def print_json(data: Any) -> None:
    """One JSON object on stdout; NaN becomes null."""
    from kemba.files import plain

    sys.stdout.write(json.dumps(plain(data), indent=2, allow_nan=False) + "\n")


def open_page(path: Path) -> None:
    """Open a page that was written in the browser."""
    import webbrowser

    webbrowser.open(path.resolve().as_uri())


def usual(verb: Callable[..., None]) -> Callable[..., None]:
    """The verb with the options of all verbs, for typer to find in its signature."""

    @functools.wraps(verb)
    def run(*args: Any, **options: Any) -> None:
        asked = {
            name: options.pop(name, None) or usually for name, usually in vars(USUALLY).items()
        }
        began, worked = time.monotonic(), time.process_time()
        with speaking(**asked):
            try:
                verb(*args, **options)
            finally:
                if asked["verbose"]:
                    took, cpu = time.monotonic() - began, time.process_time() - worked
                    say(f"took {took:.1f} s, {cpu:.1f} s of it computing")

    signature, kind = inspect.signature(verb, eval_str=True), inspect.Parameter.KEYWORD_ONLY
    added = [
        inspect.Parameter(name, kind, annotation=option, default=getattr(USUALLY, name))
        for name, option in USUAL.items()
    ]
    parameters = [*signature.parameters.values(), *added]
    run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {**verb.__annotations__, **USUAL}
    return run
