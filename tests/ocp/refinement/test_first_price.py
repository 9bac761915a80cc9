"""Slacks are cheap near the plan: of a robot whose plan on nodes is far off, modes are found."""

from pathlib import Path

import pytest

from kemba.config import shipped_configs
from kemba.ocp import load_task, plan


@pytest.mark.slow  # a minute; at the last price from the first solve on it is not refined
def test_a_bound_of_hound_is_refined(tmp_path: Path) -> None:
    text = shipped_configs("tasks")["bound.yaml"].read_text()
    for own, other in (("front", "fore"), ("rear", "hind"), ("model: planning", "model: hound")):
        text = text.replace(own, other)
    file = tmp_path / "bound.yaml"
    file.write_text(text)
    found = plan(*load_task(str(file)))
    assert found.refined, found.sentence
    assert found.certificate.within(found.task.tolerances)
