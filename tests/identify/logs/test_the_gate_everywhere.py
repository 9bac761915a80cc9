"""`check` of a log says what `compare` and `discover` would say."""

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from kemba_cli.main import app

Damage = Callable[[str], str]
MAP = """\
kind: bench
columns:
  time [s]: {source: t}
  piston/x [m]: {source: pos}
  piston/F [N]: {source: force}
  valve/extend [1]: {source: out}
  valve/retract [1]: {source: back}
"""
DAMAGES: dict[str, Damage] = {
    "none": lambda text: text,
    "no force": lambda text: "\n".join(line.rsplit(",", 1)[0] for line in text.splitlines()) + "\n",
    "volts": lambda text: text.replace(",1,0,", ",5,0,").replace(",0,1,", ",0,5,"),
    "other end": lambda text: _column(text, 1, lambda x: 0.07 - x),
    "backwards": lambda text: _column(text, 4, lambda f: -f),
    "in millimetres": lambda text: _column(text, 1, lambda x: 1e3 * x),
}


def _column(text: str, number: int, change: Callable[[float], float]) -> str:
    head, *rows = text.splitlines()
    cells = [row.split(",") for row in rows]
    for row in cells:
        row[number] = repr(change(float(row[number])))
    return "\n".join([head, *map(",".join, cells)]) + "\n"


@pytest.mark.parametrize("damage", DAMAGES)
def test_check_is_the_gate_of_compare_and_discover(damage: str, log_file: Path) -> None:
    log_file.write_text(DAMAGES[damage](log_file.read_text()))
    checked = CliRunner().invoke(app, ["check", str(log_file)])
    compared = CliRunner().invoke(app, ["compare", str(log_file), "-q"])
    assert (checked.exit_code == 0) == (compared.exit_code == 0) == (damage == "none")
    said, _, following = checked.stderr.partition("next: ")
    assert said == compared.stderr
    assert bool(following) == (damage == "none"), "a good log has a next step"


def test_a_mapped_log_passes_the_same_gate(log_file: Path, tmp_path: Path) -> None:
    """Columns of text that are not mapped are left alone."""
    head, *rows = log_file.read_text().splitlines()
    assert head == "time [s],piston/x [m],valve/extend [1],valve/retract [1],piston/F [N]"
    texts = ["ok", '"late, again"', "", "1e999"]
    rows = [f"{row},{texts[i % 4]}" for i, row in enumerate(rows)]
    columns = tmp_path / "columns.yaml"
    columns.write_text(MAP)
    log_file.write_text("\n".join(["t,pos,out,back,force,remark", *rows]) + "\n")
    words = ["check", str(log_file), "--map", str(columns)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0 and "valid log of a bench: 2500 rows" in done.stdout, done.stderr
    columns.write_text(MAP.replace("{source: pos}", "{source: pos, offset: 0.07, sign: -1}"))
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2 and "counts from the extended end" in done.stderr
    twice = [f"{row.rsplit(',', 1)[0]},1" for row in rows if '"' not in row]
    log_file.write_text("\n".join(["t,pos,out,back,force,force", *twice]) + "\n")
    assert "has the column 'force' more than once" in CliRunner().invoke(app, words).stderr
