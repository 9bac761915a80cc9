"""The way from the first guess to the answer: what grows, what starts a refit."""

import pytest
from toy_problem import Toy

from kemba.identify.infer.linear import NULL
from kemba.identify.infer.search import Search


def test_an_answer_that_grows_never_shrinks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a part of it is the best of all that was refitted, it stays for the swaps to judge."""
    search, answer = Search(Toy({})), ("kick", "wave")
    monkeypatch.setattr(search, "_round", lambda given, leaders: NULL)
    assert search._grow(answer) == answer
