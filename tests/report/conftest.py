"""A real browser for pages, and a jump with its logs; skipped where there is no browser."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from kemba_cli.main import app

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


@pytest.fixture(scope="session")
def jump(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A jump with two noisy logs; do not write to it."""
    run = tmp_path_factory.mktemp("runs") / "jump-1"
    words = ["solve", "jump.yaml", "--no-figure", "--out", str(run)]
    assert CliRunner().invoke(app, words).exit_code == 0
    words = ["simulate", str(run), "--repeat", "2", "--noise"]
    assert CliRunner().invoke(app, words).exit_code == 0
    return run


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium without a window: that of the system, else playwright's own."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    with sync_api.sync_playwright() as started:
        try:
            opened = started.chromium.launch(executable_path=found)
        except sync_api.Error as error:
            pytest.skip(f"there is no browser: {str(error).splitlines()[0]}")
        yield opened
        opened.close()
