"""Cases and their keys: the same content is the same case, whatever the order it is written in."""

from pathlib import Path
from typing import Any

import pytest

from kemba.files import read_json, write_json
from kemba.sweep.cases import Case, content_hash, perform

WORK = {"task": {"height": "0.5 m", "nodes": 40}, "model": "planning"}
DONE = {"status": "solved", "good": True, "sentence": "solved"}
TURNED = {"model": "planning", "task": {"nodes": 40, "height": "0.5 m"}}


def case(work: dict[str, Any], function: str = "a:b") -> Case:
    return Case("block", 0, {}, function, work)


def test_the_order_of_keys_is_no_content() -> None:
    assert list(WORK) != list(TURNED)
    assert content_hash(WORK) == content_hash(TURNED)
    assert case(WORK).key == case(TURNED).key


@pytest.mark.parametrize(
    "other",
    [
        {"task": {"height": "0.5 m", "nodes": 41}, "model": "planning"},
        {"task": {"height": "0.5 m", "nodes": "40"}, "model": "planning"},
        {"task": {"height": "0.5 m"}, "nodes": 40, "model": "planning"},
    ],
)
def test_other_content_is_another_case(other: dict[str, Any]) -> None:
    assert case(other).key != case(WORK).key


def test_another_function_is_another_case() -> None:
    assert case(WORK, "a:c").key != case(WORK).key


def test_the_order_of_a_list_is_content() -> None:
    assert content_hash([1, 2]) != content_hash([2, 1])


def test_a_record_is_found_again_in_the_folder(tmp_path: Path) -> None:
    assert case(WORK).record(tmp_path) is None
    case(WORK).path(tmp_path).parent.mkdir()
    write_json(case(WORK).path(tmp_path), DONE)
    assert case(TURNED).record(tmp_path) == DONE


def test_work_that_is_done_is_not_repeated(tmp_path: Path) -> None:
    path = tmp_path / "done.json"
    write_json(path, DONE)
    assert perform("nowhere:none", {}, str(path)) == DONE


def test_what_goes_wrong_is_kept_as_an_outcome(tmp_path: Path) -> None:
    path = tmp_path / "failed.json"
    record = perform("sweep.fakes:crash", {"number": 3}, str(path))
    assert (record["status"], record["good"]) == ("error", False)
    assert record["sentence"] == "ZeroDivisionError: case 3 divides by zero"
    assert record["wall_s"] >= 0.0 and read_json(path) == record
