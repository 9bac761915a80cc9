"""What the keys of a task do to each other."""

import pytest

from kemba.errors import KembaError
from kemba.ocp import load_task


def test_the_last_of_height_and_feet_counts() -> None:
    """An option replaces the other key of the file; two options contradict each other."""
    assert load_task("jump.yaml")[0].height is not None
    task, _ = load_task("jump.yaml", ["feet=0.1 m"])
    assert (task.height, task.feet) == (None, 0.1)
    with pytest.raises(KembaError, match="'feet' does not go with 'height'"):
        load_task("jump.yaml", ["feet=0.1 m", "height=0.5 m"])
