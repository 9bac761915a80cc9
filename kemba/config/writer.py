"""Writing YAML that `reader` reads back as the same data."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from kemba.config.scalars import PATTERNS

WIDTH = 100  # characters of a line


def dump_text(data: Any) -> str:
    """Plain data as YAML text; keys keep their order.

    Raises TypeError for what is no plain data.
    """
    import yaml

    try:
        text: str = yaml.dump(
            data, Dumper=_dumper(), width=WIDTH, sort_keys=False, allow_unicode=True,
            default_flow_style=False,
        )  # fmt: skip
    except yaml.representer.RepresenterError as error:
        raise TypeError(f"cannot be written as YAML: {error}") from None
    return text


@lru_cache(maxsize=1)
def _dumper() -> Any:
    """PyYAML's dumper, made to quote what YAML 1.2 would misread and to indent lists."""
    import yaml

    class Dumper(yaml.SafeDumper):  # type: ignore[misc]
        yaml_implicit_resolvers: Any = {}  # noqa: RUF012  PyYAML's way: by first character

        def increase_indent(self, flow: bool = False, indentless: bool = False) -> Any:
            return super().increase_indent(flow, False)

        def ignore_aliases(self, data: Any) -> bool:
            return True

    for kind, pattern in PATTERNS.items():
        Dumper.add_implicit_resolver(f"tag:yaml.org,2002:{kind}", _whole(pattern), None)
    Dumper.add_representer(float, _float)
    Dumper.add_representer(str, _text)
    return Dumper


def _whole(pattern: Any) -> Any:
    """The pattern for PyYAML, which asks `match` only."""
    import re

    return re.compile(rf"(?:{pattern.pattern})\Z")


def _float(dumper: Any, value: float) -> Any:
    """A float as Python writes it, `1e-05`; never as a whole number."""
    named = {"inf": ".inf", "-inf": "-.inf", "nan": ".nan"}
    text = repr(value)
    return dumper.represent_scalar("tag:yaml.org,2002:float", named.get(text, text))


def _text(dumper: Any, value: str) -> Any:
    """A text; with escapes where it holds characters that only YAML reads as line ends, quoted
    where it would merge groups."""
    style = '"' if set(value) & set("\x85\u2028\u2029") or value == "<<" else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=style)
