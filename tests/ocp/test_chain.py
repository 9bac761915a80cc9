"""Motions in a row: one trajectory, requirements at their own times, the files of a sequence."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from kemba.errors import ConfigErrors, KembaError
from kemba.ocp import load_task
from kemba.ocp.certificate.status import Status
from kemba.ocp.planning import check_feasible, plan
from kemba.ocp.reading import as_one, joined, motions
from kemba.ocp.task.requirement import Requirement, landing_nodes
from kemba.trajectory import Trajectory


def stride(begin: float = 0.0) -> Trajectory:
    time = np.linspace(0.0, 0.4, 5)
    columns = {"body/x [m]": begin + time, "front/foot/x [m]": begin + 2 * time,
               "front/piston/x [m]": time, "body/z [m]": np.cos(time)}  # fmt: skip
    return Trajectory(time, columns, {"phases": ["0-2 o 1", "2-4 h 0"]})


def test_what_lies_ahead_moves_on_and_the_rest_repeats() -> None:
    row = joined([stride(), stride(begin=7.0), stride()])
    assert row.time == pytest.approx(np.linspace(0.0, 1.2, 13))
    assert row["body/x"] == pytest.approx(np.linspace(0.0, 1.2, 13))
    assert row["front/foot/x"][5] == pytest.approx(0.4 + 0.2), "by the body's way, not the foot's"
    assert row["front/piston/x"][4:6] == pytest.approx([0.4, 0.1])
    assert row.meta["phases"] == [
        "0-2 o 1", "2-4 h 0", "4-6 o 1", "6-8 h 0", "8-10 o 1", "10-12 h 0"
    ]  # fmt: skip


def test_a_sequence_reads_its_motions(tmp_path: Path) -> None:
    tmp_path.joinpath("own.yaml").write_text(
        "payload: 0.2 kg\n"
        "sequence: [popup.yaml, {motion: bound.yaml, repeat: 2, set: {nodes: 30}}]\n"
    )
    task, document = load_task(tmp_path / "own.yaml")
    found = [part for part, _ in motions(task, document)]
    assert [part.name for part in found] == ["popup", "bound", "bound"]
    assert [part.nodes for part in found[1:]] == [30, 30]
    assert {part.payload for part in found} == {0.2}
    check_feasible(task, document)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("sequence: [own.yaml]", "own.yaml:1:12: sequence: own.yaml leads back to itself"),
        ("sequence: [houp.yaml]", "did you mean 'hop.yaml'"),
        ("sequence: [{motion: hop.yaml, repeat: 0}]", "repeat"),
        ("sequence: [bound.yaml, hop.yaml]", "`cost` of hop is another than that of bound"),
        ("sequence: [hop.yaml]\nend: {rest: true}", "'end' belongs into the motions"),
    ],
)
def test_a_sequence_that_cannot_be_is_told(tmp_path: Path, text: str, said: str) -> None:
    tmp_path.joinpath("own.yaml").write_text(text)
    with pytest.raises(KembaError) as caught:
        task, document = load_task(tmp_path / "own.yaml")
        check_feasible(task, document)
    assert said in str(caught.value)


def test_mistakes_of_all_motions_are_told_at_their_lines(tmp_path: Path) -> None:
    tmp_path.joinpath("own.yaml").write_text(
        "sequence:\n- {motion: jump_forward.yaml, set: {height: 0.45 kg}}\n"
        "- {motion: houp.yaml}\n- {motion: hop.yaml, set: {hight: 0.4 m}}\n"
    )
    with pytest.raises(ConfigErrors) as caught:
        check_feasible(*load_task(tmp_path / "own.yaml"))
    said = str(caught.value)
    assert "own.yaml:2: height: '0.45 kg' is a mass" in said and "--set" not in said
    assert "own.yaml:3:3: sequence: " in said and "own.yaml:4: hight: unknown key" in said


def test_what_a_motion_asks_is_asked_in_its_own_share_of_the_sequence(tmp_path: Path) -> None:
    tmp_path.joinpath("own.yaml").write_text("sequence: [{motion: bound.yaml, repeat: 2}]\n")
    _, alone = check_feasible(*load_task("bound.yaml"))
    _, _, asked = as_one(*load_task(tmp_path / "own.yaml"))
    halves = [(begin + end / 2) for begin in (0.0, 0.5) for end in sorted({*moments(alone)})]
    assert sorted({*moments(asked)}) == pytest.approx(sorted({*halves}))


def test_motions_that_meet_at_rest_ask_for_it_once_and_for_no_settled_air(tmp_path: Path) -> None:
    """Two equal rows have no unique multipliers, and forces of air only tend to those of rest."""
    tmp_path.joinpath("own.yaml").write_text("sequence: [{motion: jump_forward.yaml, repeat: 2}]\n")
    task, _, asked = as_one(*load_task(tmp_path / "own.yaml"))
    there = [r for r in asked if r.at is not None and r.node(task.nodes) == task.nodes // 2]
    assert [r.quantity.name for r in there].count("body/vx") == 1
    assert {r.location for r in asked if r.at == 0.0} >= {("start", "settled"), ("start", "rest")}
    assert not [r for r in there if r.location == ("start", "settled")]


def test_each_motion_of_a_sequence_has_its_landing(tmp_path: Path) -> None:
    """The push of a second jump is not the landing of the first."""
    tmp_path.joinpath("own.yaml").write_text("sequence: [{motion: jump_forward.yaml, repeat: 2}]\n")
    alone, _ = load_task("jump_forward.yaml")
    own = landing_nodes(check_feasible(*load_task("jump_forward.yaml"))[1], alone.nodes)
    task, _, asked = as_one(*load_task(tmp_path / "own.yaml"))
    assert own[-1] == alone.nodes and own[0] > alone.nodes // 3
    assert landing_nodes(asked, task.nodes) == [*own, *(alone.nodes + k for k in own)]


@pytest.mark.slow  # a minute of CPU
def test_two_jumps_ahead_in_a_row_are_one_refined_plan(tmp_path: Path) -> None:
    tmp_path.joinpath("own.yaml").write_text("sequence: [{motion: jump_forward.yaml, repeat: 2}]\n")
    found = plan(*load_task(tmp_path / "own.yaml"))
    assert found.status is Status.SOLVED and found.refined
    assert found.trajectory["body/x"][-1] == pytest.approx(0.6)


def moments(requirements: Sequence[Requirement]) -> list[float]:
    """All moments that requirements name, as shares of the nodes."""
    during = [share for r in requirements if r.at is None for share in r.during]
    return during + [r.at for r in requirements if r.at is not None]
