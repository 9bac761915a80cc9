"""The register of effects by kind: the shipped ones, and those from outside the package."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Union

from kemba.effects.base import Effect
from kemba.effects.outside import effects_of_file, effects_of_packages, read_source
from kemba.errors import KembaError

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, TypeAdapter
    from pydantic_core import CoreSchema


class Registry(Mapping[str, type[Effect]]):
    """Effects by kind. Packages with the entry point group `kemba.effects` join at the first look.

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
        """Reads an effect of any kind, told apart by its `kind`."""
        from pydantic import Field, TypeAdapter

        known = tuple(self._all().values())
        if self._union is None:
            choice: Any = Annotated[Union[known], Field(discriminator="kind")]  # noqa: UP007
            self._union = TypeAdapter(choice)
        return self._union


class Registered:
    """Marks a field that holds an effect of any kind in a register, as it is when read."""

    def __init__(self, registry: Registry) -> None:
        self.registry = registry

    def members(self) -> Iterable[type[Effect]]:
        """The classes that may stand there (for the places of errors)."""
        return self.registry.values()

    def _read(self, value: Any) -> Effect:
        if isinstance(value, Effect):
            return value
        effect: Effect = self.registry.union.validate_python(value)
        return effect

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return handler(self.registry.union.core_schema)


def kind_of(effect: type[Effect]) -> str:
    """The name by which YAML knows a class of effects."""
    return str(effect.model_fields["kind"].default)
