"""Finding effects outside the package: in installed packages, and in a file of the user's own.

Such code is run with all rights of the user. It is only ever named by the user, as an installed
package or by `--effects`; nothing in a YAML or a log can name it.
"""

import re
import sys
import traceback
from collections.abc import Iterator
from importlib import metadata, util
from pathlib import Path
from types import ModuleType
from typing import Any

from kemba.effects.base import Effect
from kemba.errors import KembaError

GROUP = "kemba.effects"  # entry points
NAME = re.compile(r"[a-z][a-z0-9_]*")


def effects_of_packages() -> Iterator[tuple[str, tuple[type[Effect], ...]]]:
    """Each entry point of the group `kemba.effects`: where it is from, and its effects.

    An entry point names one class or a module, of which all effects are taken. Raises KembaError
    where a package cannot be loaded.
    """
    for point in sorted(metadata.entry_points(group=GROUP), key=lambda p: p.name):
        where = f"entry point {point.name} = {point.value}"
        try:
            found: Any = point.load()
        except Exception as error:
            package = point.dist.name if point.dist else "its package"
            what = f"cannot be loaded: {type(error).__name__}: {error}"
            raise KembaError(where, what, hint=f"mend or uninstall {package}") from None
        effects = _defined_in(found) if isinstance(found, ModuleType) else (found,)
        yield where, tuple(_checked(effect, where) for effect in effects)


def read_source(path: Path) -> bytes:
    """The content of a file given as `--effects`. Raises KembaError when it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        expected = "a Python file with effects was expected"
        raise KembaError(f"--effects {path}", error.strerror or str(error), expected) from None


def effects_of_file(path: Path, source: bytes, module: str) -> tuple[type[Effect], ...]:
    """The effects in a Python file, whose code is run as the module of this name.

    Raises KembaError when the code fails (with the line) and when it defines no effect.
    """
    effects = _defined_in(_run(path, source, module))
    if not effects:
        expected = "a subclass of kemba.effects.Effect was expected"
        raise KembaError(str(path), "defines no effect", expected, "see docs/extending.md")
    return tuple(_checked(effect, str(path)) for effect in effects)


def _run(path: Path, source: bytes, name: str) -> ModuleType:
    """The module of a file. Errors of its code get their line in the file."""
    spec = util.spec_from_loader(name, loader=None, origin=str(path))
    assert spec is not None
    module = util.module_from_spec(spec)
    module.__file__ = str(path)
    sys.modules[name] = module  # pydantic resolves annotations there
    try:
        exec(compile(source, str(path), "exec", dont_inherit=True), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise _failed(path, source, error) from None
    return module


def _failed(path: Path, source: bytes, error: BaseException) -> KembaError:
    """An error of a user's code at its line."""
    line: int | None = None
    if isinstance(error, SyntaxError):
        line, text = error.lineno, error.msg
    else:
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame.lineno for frame in frames if frame.filename == str(path)]
        line, text = (own[-1] if own else None), str(error).split("\n    For further")[0]
    where = f"{path}:{line}" if line else str(path)
    lines = source.decode("utf-8", "replace").splitlines()
    excerpt = f"    {lines[line - 1].rstrip()}" if line and line <= len(lines) else ""
    what = f"cannot be loaded: {type(error).__name__}: {text}"
    return KembaError(where, what, excerpt=excerpt)


def _defined_in(module: ModuleType) -> tuple[type[Effect], ...]:
    """The effects that a module defines itself and that have a kind, in its order."""
    return tuple(
        item
        for item in vars(module).values()
        if isinstance(item, type)
        and issubclass(item, Effect)
        and item.__module__ == module.__name__
        and isinstance(item.model_fields["kind"].default, str)
    )


def _checked(effect: Any, where: str) -> type[Effect]:
    """The class, if it is an effect that YAML can name."""
    if not (isinstance(effect, type) and issubclass(effect, Effect)):
        raise KembaError(where, f"'{effect}' is no effect", "a subclass of Effect was expected")
    kind = effect.model_fields["kind"].default
    if not isinstance(kind, str) or not NAME.fullmatch(kind):
        expected = 'such as `kind: Literal["my_effect"] = "my_effect"`'
        raise KembaError(where, f"{effect.__name__} has no kind that YAML can name", expected)
    if str(effect.model_fields["kind"].annotation) != f"typing.Literal['{kind}']":
        expected = f'`kind: Literal["{kind}"] = "{kind}"` was expected'
        raise KembaError(where, f"the kind of {effect.__name__} is not fixed", expected)
    return effect
