"""The tables that others read: their columns, in their order, as they have always been."""

from pathlib import Path

import pytest
from ocp.runs import solved

HERE = Path(__file__).parent


@pytest.mark.parametrize("name", ["trajectory", "controller"])
def test_columns(name: str) -> None:
    header = (solved("jump").run.path / f"{name}.csv").read_text().splitlines()[0]
    assert header.split(",") == (HERE / f"{name}_columns.txt").read_text().splitlines()
