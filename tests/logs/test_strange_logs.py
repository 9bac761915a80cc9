"""Logs in the ways of other programs are read right, or a person is asked; none is read wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from strange_logs import judged, way, written


@pytest.mark.parametrize("first", range(0, 40, 10))
def test_no_log_is_read_wrong(first: int, tmp_path: Path) -> None:
    """Ten at a time; benchmarks/strange_logs.py takes any number of them."""
    read = 0
    for seed in range(first, first + 10):
        path, log = written(way(seed), tmp_path)
        verdict = judged(path, log)
        assert verdict.what not in ("wrong", "crash"), (way(seed), verdict.why)
        read += verdict.what == "read"
    assert read >= 8


@pytest.mark.nightly
def test_no_log_of_hundreds_is_read_wrong(tmp_path: Path) -> None:
    verdicts = [judged(*written(way(seed), tmp_path)).what for seed in range(1000, 1400)]
    assert not {"wrong", "crash"} & set(verdicts)
    assert verdicts.count("read") >= 0.8 * len(verdicts)
