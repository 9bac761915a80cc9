"""Data of others, read from the folder KEMBA_DATA; without it a test is skipped and says so."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "real" / "data.py"


def reader() -> ModuleType:
    """The module that knows the sources (`benchmarks/real/data.py`)."""
    name = "kemba_real_data"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, SCRIPT)
        assert spec is not None and spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


def real(name: str) -> Path:
    """A file of the registry; the test is skipped where it is absent."""
    data = reader()
    try:
        found: Path = data.find(name)
    except data.Absent as missing:
        pytest.skip(str(missing))
    return found
