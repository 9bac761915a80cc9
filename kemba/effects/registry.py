"""The register of effects by kind: the shipped ones, and those from outside the package, which are
in installed packages or in a file of the user's own.

Code from outside is run with all rights of the user. It is only ever named by the user, as an
installed package or by `--effects`; nothing in a YAML or a log can name it.
"""

import re
import sys
import traceback
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from importlib import metadata, util
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, Union

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, TypeAdapter
from pydantic_core import CoreSchema, core_schema

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
    """The effects in a Python file, whose code is run as the module of this name. Raises KembaError
    when the code fails (with the line) and when it defines no effect."""
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


class Registry(Mapping[str, type[Effect]]):
    """Effects by kind. Those of installed packages are added at the first use.

    Looking anything up raises KembaError when such a package cannot be loaded.
    """

    def __init__(self, shipped: Iterable[type[Effect]]) -> None:
        self._kinds = {kind_of(effect): effect for effect in shipped}
        self._shipped = frozenset(self._kinds)
        self._files: dict[str, str] = {}  # path: hash of its content
        self._searched = False
        self._union: TypeAdapter[Any] | None = None

    def __getitem__(self, kind: str) -> type[Effect]:
        return self._all()[kind]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())

    @property
    def outside(self) -> tuple[type[Effect], ...]:
        """The effects that kemba does not ship."""
        return tuple(e for kind, e in self._all().items() if kind not in self._shipped)

    @property
    def files(self) -> dict[str, str]:
        """The effect files that were loaded: absolute path and SHA-256."""
        return dict(self._files)

    def load_file(self, path: str | Path) -> tuple[type[Effect], ...]:
        """Add the effects of a Python file of the user's own; a file known already is kept.

        Runs the file's code. Raises KembaError with the line that fails, when the file has no
        effect, and when one of its kinds exists already.
        """
        path = Path(path)
        source = read_source(path)
        name, digest = str(path.resolve()), sha256(source).hexdigest()
        module = f"kemba_effects_{sha256(name.encode()).hexdigest()[:12]}"
        if self._files.get(name) != digest:
            effects = effects_of_file(path, source, module)
            for kind in [k for k, e in self._all().items() if e.__module__ == module]:
                del self._kinds[kind]  # the file has changed since
            self._add(effects, str(path))
            self._files[name] = digest
        return tuple(e for e in self.outside if e.__module__ == module)

    def _all(self) -> dict[str, type[Effect]]:
        if not self._searched:
            self._searched = True  # before: a package may look at the register while it is loaded
            try:
                for where, effects in effects_of_packages():
                    self._add(effects, where)
            except BaseException:
                self._searched = False
                raise
        return self._kinds

    def _add(self, effects: Iterable[type[Effect]], where: str) -> None:
        new = {kind_of(effect): effect for effect in effects}
        for kind, effect in new.items():
            known = self._kinds.get(kind)
            if known is not None and known is not effect:
                owner = "kemba itself" if kind in self._shipped else known.__module__
                raise KembaError(
                    where, f"the kind '{kind}' exists already in {owner}", hint="choose another"
                )
        self._kinds |= new
        self._union = None

    @property
    def union(self) -> TypeAdapter[Any]:
        """Reads an effect of any kind; its `kind` says which."""
        known = tuple(self._all().values())
        if self._union is None:
            choice: Any = Annotated[Union[known], Field(discriminator="kind")]  # noqa: UP007
            self._union = TypeAdapter(choice)
        return self._union


class Registered:
    """Marks a field that holds an effect of any kind that is registered when it is read."""

    def __init__(self, registry: Registry) -> None:
        self.registry = registry

    def members(self) -> Iterable[type[Effect]]:
        """The classes that are allowed there (to locate errors)."""
        return self.registry.values()

    def _read(self, value: Any) -> Effect:
        if isinstance(value, Effect):
            return value
        effect: Effect = self.registry.union.validate_python(value)
        return effect

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return handler(self.registry.union.core_schema)


def kind_of(effect: type[Effect]) -> str:
    """The `kind` of a class of effects in YAML."""
    return str(effect.model_fields["kind"].default)
