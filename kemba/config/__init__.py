"""Configuration files: from YAML to checked data, every mistake at its line."""

from kemba.config.document import (
    Document,
    FileName,
    Location,
    Section,
    dump_yaml,
    load_text,
    load_yaml,
    written,
)
from kemba.config.parsing import (
    apply_overrides,
    beside,
    find_config,
    is_file,
    parse,
    refused,
    shipped_configs,
    shipped_folder,
    with_added,
)

__all__ = [
    "Document",
    "FileName",
    "Location",
    "Section",
    "apply_overrides",
    "beside",
    "dump_yaml",
    "find_config",
    "is_file",
    "load_text",
    "load_yaml",
    "parse",
    "refused",
    "shipped_configs",
    "shipped_folder",
    "with_added",
    "written",
]
