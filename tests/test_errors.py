"""Errors that teach."""

import pickle

from kemba.errors import ConfigErrors, KembaError, suggest


def test_empty_parts_leave_no_marks() -> None:
    assert str(KembaError("a.yaml:1:1", "x: unknown key")) == "a.yaml:1:1: x: unknown key"
    assert str(KembaError("", "no such column", hint="one of: a")) == "no such column; one of: a"
    assert str(KembaError("a", "b", "c", "d", "    e")) == "a: b; c; d\n    e"


def test_all_errors_are_told() -> None:
    errors = ConfigErrors([KembaError("a", "b"), KembaError("c", "d")])
    assert str(errors) == "a: b\nc: d"
    assert [error.where for error in errors.errors] == ["a", "c"]


def test_errors_cross_process_borders() -> None:
    error = ConfigErrors([KembaError("a", "b", "c", "d", "e")])
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_suggestions() -> None:
    assert suggest("apx", ["apex", "height"]) == "did you mean 'apex'?"
    assert suggest("APEX", ["apex", "height"]) == "did you mean 'apex'?"
    assert suggest("zzz", ["b", "a"]) == "one of: a, b"
    assert suggest("zzz", []) == ""
    assert suggest("zzz", [f"name_{i:02}" for i in range(20)]).endswith("name_11, ... (8 more)")
