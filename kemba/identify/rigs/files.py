"""From files to the fitted figures of a rig."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from kemba.identify.logs.excerpt import excerpts
from kemba.identify.logs.gate import check_logs
from kemba.identify.logs.reading import read_logs, taken_on
from kemba.identify.rigs.characterise import RigFit, fit_rig
from kemba.logs import load_map, log_files
from kemba.model import load_model


def characterise_logs(
    logs: Sequence[str | Path], model: str, column_map: str | Path | None = None
) -> RigFit:
    """The figures of the rig of `model`, and of its effects, from logs (or folders of them).

    Raises KembaError; BadData where the logs cannot be right.
    """
    read = read_logs(log_files(logs), load_map(column_map) if column_map else None)
    built = load_model(model)
    taken_on(read, built.mechanism)
    check_logs(read)
    return fit_rig(excerpts(read)[0], built)
