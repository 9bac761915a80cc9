"""What a failing verb says, and its exit code."""

from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

from kemba.errors import KembaError
from kemba_cli.failures import guarded


def fail(error: BaseException) -> Result:
    """The outcome of a verb that raises `error`."""

    def verb() -> None:
        raise error

    app = typer.Typer(pretty_exceptions_enable=False)
    app.command()(guarded(verb))
    return CliRunner().invoke(app)


def test_bad_input() -> None:
    done = fail(KembaError("a.yaml:1:1", "z [m]: unknown key"))
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr == "a.yaml:1:1: z [m]: unknown key\n"


def test_interruption() -> None:
    done = fail(KeyboardInterrupt())
    assert (done.exit_code, done.stderr) == (130, "interrupted\n")


def test_a_bad_answer_keeps_its_exit_code() -> None:
    assert fail(typer.Exit(1)).exit_code == 1


def test_a_fault_of_ours_asks_for_a_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.delenv("KEMBA_DEBUG", raising=False)
    done = fail(ZeroDivisionError("by zero"))
    assert done.exit_code == 1
    assert "ZeroDivisionError at test_failures.py" in done.stderr
    assert "please report it" in done.stderr and "Traceback" not in done.stderr
    (log,) = tmp_path.glob("kemba-crash-*.log")
    assert "Traceback" in log.read_text()


def test_debugging_shows_the_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEMBA_DEBUG", "1")
    assert "Traceback" in fail(ZeroDivisionError()).stderr
