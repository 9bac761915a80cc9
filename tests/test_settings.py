"""Settings say what they are, and can be changed for a while."""

import pytest

from kemba.errors import KembaError
from kemba.settings import Settings, changed, setting


class Toy(Settings):
    """Two numbers."""

    gap: float = setting(0.1, "s", "longest pause", "derived: two samples at 20 Hz")
    rounds: int = setting(2, "1", "rounds", "tuned: by hand")
    share: float = setting(0.7, "1", "a share", "convention: most", at_most=1.0)


def test_settings_are_changed_for_a_while_only() -> None:
    with changed(Toy, gap=0.2):
        assert Toy.current() == Toy(gap=0.2)
        with changed(Toy, rounds=3):
            assert (Toy.current().gap, Toy.current().rounds) == (0.2, 3)
    assert Toy.current() == Toy() and Toy.current() is Toy.current()


def test_settings_cannot_be_assigned() -> None:
    with pytest.raises(AttributeError):
        Toy().gap = 1.0  # type: ignore[misc]


def test_a_wrong_name_is_told() -> None:
    with pytest.raises(KembaError, match="no setting 'gep'"), changed(Toy, gep=0.2):
        pass


def test_a_value_without_a_meaning_is_told() -> None:
    with changed(Toy, share=1.0):
        assert Toy.current().share == 1.0
    with pytest.raises(KembaError, match=r"Toy\.share: is 1\.4; at most 1"):  # noqa: SIM117
        with changed(Toy, share=1.4):
            pass


def test_an_origin_must_be_of_a_kind() -> None:
    with pytest.raises(ValueError, match="origin"):
        setting(1.0, "1", "a number", "felt right")
