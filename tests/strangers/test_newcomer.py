"""A newcomer's first hour: the README, the logs of another program, a MATLAB file."""

from pathlib import Path

import pytest
from documents.pages import commands
from strangers.walk import plain, typed

pytestmark = pytest.mark.nightly

# the README's loop -> what its answers say; # is a number
LOOP = {
    "kemba-opt solve jump.yaml --out run-1": (
        "solved: apex # m (feet # cm up), # s, in # phases of contacts and valves",
        "next: kemba-opt simulate run-# --repeat # --noise",
    ),
    "kemba-opt simulate run-1 --repeat 3 --noise --out logs-1": (
        " m on plant, off the plan by at most # mm; # of # landed",
    ),
    "kemba-opt review logs-1/*.csv --run run-1": (
        "The robot reaches # m, # mm below the plan, and stays upright; the model does not explain "
        "the logs: its error is # times the noise; worst: body height",
        "next: find what the model lacks: kemba-opt discover",
    ),
    "kemba-opt learn run-1 --logs logs-1 --out run-2": (
        "Round #: the robot jumped # mm lower than planned. The model lacks chambers:orifice",
        "its error goes from # to # times the noise. The next run is expected to reach # m (# to # "
        "m), planned are # m.",
    ),
    "kemba-opt simulate run-2 --repeat 3 --noise --out logs-2": (
        " m on plant, off the plan by at most # mm; # of # landed",
    ),
}


def test_the_first_lines_of_the_readme(tmp_path: Path) -> None:
    """The loop as it stands there, each line after the one before."""
    loop = [line for line in commands("README.md") if line in LOOP]
    assert loop == list(LOOP), "the README has another loop than this walk"
    for line in loop:
        said = plain(typed(f"sh -c '{line}'", tmp_path))
        for sentence in LOOP[line]:
            assert sentence in said, f"$ {line}\n{said}"


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three hops of a machine with friction in its seals, written by other programs."""
    from foreign_files import german, logs_out
    from robot_logs import hops
    from twin import catalogue

    folder = tmp_path_factory.mktemp("theirs")
    found, _ = hops(catalogue.hidden("seal_friction", 1.0), runs=3, figures_off=0.01)
    for number, log in enumerate(found, start=1):
        german(log, folder / f"their_log_{number}.csv")
    pytest.importorskip("matio")
    logs_out(found[0], folder / "logsOut.mat")
    return folder


FOREIGN = {
    "kemba-opt map their_log_1.csv --out map.yaml": (
        "Time: 'Zeitstempel [ms]' is called a time and rises.",
        "look through map.yaml: signs and zeros of angles cannot be guessed",
        "next: kemba-opt check their_log_1.csv --map map.yaml",
    ),
    "kemba-opt check their_log_1.csv their_log_2.csv their_log_3.csv --map map.yaml": (
        "their_log_3.csv: valid log of a robot: # rows, # columns, # s",
        "next: kemba-opt discover their_log_1.csv their_log_2.csv their_log_3.csv --map map.yaml",
    ),
    "kemba-opt compare their_log_1.csv their_log_2.csv --map map.yaml --no-figure": (
        "The model nearly explains the logs: its error is # times the noise; worst: ",
        "a force on the rods is missing that goes with speed (up to # N)",
        "so the model lacks something else.",
        "next: kemba-opt discover their_log_1.csv their_log_2.csv --map map.yaml",
    ),
    "kemba-opt discover their_log_1.csv their_log_2.csv --holdout their_log_3.csv --map map.yaml "
    "--out answer --no-figure": (
        "Missing: seal_friction (F_c = # N (# to #)); the held-out error falls from # to # times "
        "the noise.",
        "next: kemba-opt review their_log_1.csv their_log_2.csv --map map.yaml --answer answer",
    ),
}


def test_logs_of_another_program(theirs: Path) -> None:
    """From their columns to the effect that the machine has and the model lacks."""
    for line, sentences in FOREIGN.items():
        said = plain(typed(line, theirs))
        for sentence in sentences:
            assert sentence in said, f"$ {line}\n{said}"


DRIVE = {
    "kemba-opt map theirs.csv --model press.yaml --out map.yaml": (
        "Time: 't_ms' is called a time and rises.",
        "next: kemba-opt check theirs.csv --map map.yaml --model press.yaml",
    ),
    "kemba-opt check theirs.csv --map map.yaml --model press.yaml": (
        "theirs.csv: valid log of a drive: # rows, # columns, # s",
        "next: kemba-opt discover theirs.csv --map map.yaml --model press.yaml",
    ),
    "kemba-opt discover theirs.csv --map map.yaml --model press.yaml --out axis --no-figure": (
        "Missing: axis_damping (F_v = # N.s.m-# (# to #)) and axis_friction (F_c = # N (# to #)",
        "next: kemba-opt review theirs.csv --map map.yaml --model press.yaml --answer axis",
    ),
    "kemba-opt compare tuesday.csv --model axis/model.yaml --no-figure": (
        "The model explains the logs to within the noise: its error is # times the noise.",
    ),
}


def test_a_drive_of_ones_own(tmp_path: Path) -> None:
    """From a log in milliseconds and millimetres to a model that explains the next day's."""
    import pandas as pd
    from documents.stories import drives

    drives(tmp_path)
    table = pd.read_csv(tmp_path / "monday.csv").to_numpy() * [1e3, 1e3, 1.0]
    theirs = pd.DataFrame(table, columns=["t_ms", "Position_mm", "Motorkraft_N"])
    theirs.to_csv(tmp_path / "theirs.csv", index=False)
    rig = "name: press\nrig: {kind: drive, motion: linear, inertia: 95 kg}\neffects: []\n"
    (tmp_path / "press.yaml").write_text(rig, encoding="utf-8")
    for line, sentences in DRIVE.items():
        said = plain(typed(line, tmp_path))
        for sentence in sentences:
            assert sentence in said, f"$ {line}\n{said}"


def test_a_matlab_file_becomes_a_page_in_two_commands(theirs: Path) -> None:
    said = typed("kemba-opt check logsOut.mat --map logsout", theirs)
    assert "logsOut.mat: valid log of a robot: 801 rows" in said
    assert "no hip torques are logged: they are taken as unknown, so that nothing can be" in said
    said = plain(typed("kemba-opt review logsOut.mat --map logsout", theirs))
    assert "The robot's body reaches # m; the model explains the logs to within the noise" in said
    page = (theirs / "review.html").read_text(encoding="utf-8")
    assert "body/z" in page and len(page) > 50_000
