"""`kemba.compare` and `kemba.discover`: where a model fails on logs, and which effect it lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from kemba.api.planning import Result
from kemba.errors import KembaError
from kemba.identify.answer import Answer, Ranked
from kemba.identify.compare.compare import Comparison
from kemba.identify.discover import Discovery
from kemba.stopwatch import Tell, silent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Logs = str | Path | Sequence[str | Path]


@dataclass(frozen=True)
class Compared(Result):
    """Where a model fails: errors by channel, phase and valve mode."""

    comparison: Comparison

    @property
    def sentence(self) -> str:
        """The finding in words."""
        return self.comparison.sentence

    @property
    def good(self) -> bool:
        """Whether the model explains the logs to within their noise."""
        return self.comparison.good

    @property
    def noise_ratio(self) -> float:
        """Error over noise; 1 is the noise floor."""
        return self.comparison.noise_ratio

    def figure(self) -> Figure:
        """Errors by condition, and the missing forces with their bands."""
        from kemba.plotting.comparison import plot_comparison

        return plot_comparison(self.comparison)


@dataclass(frozen=True)
class Discovered(Result):
    """Which effect a model lacks, and how sure that is."""

    answer: Answer
    found: Discovery | None

    @property
    def sentence(self) -> str:
        """The answer in words."""
        return self.answer.sentence

    @property
    def verdict(self) -> str:
        """missing, partly, nothing, unknown or bad-data."""
        return self.answer.verdict

    @property
    def ranking(self) -> Sequence[Ranked]:
        """Effects by probability, each with values and intervals."""
        return self.answer.ranking

    @property
    def good(self) -> bool:
        """Whether the data could be judged."""
        return self.verdict != "bad-data"

    def figure(self) -> Figure:
        """What is left of the error. Raises KembaError for bad data."""
        from kemba.plotting.studies import plot_residual

        if self.found is None:
            raise KembaError("", "bad data were not fitted", hint="read the remarks of the answer")
        return plot_residual(self.found)


def compare(
    logs: Logs,
    model: str | Path = "planning",
    *,
    columns: str | Path | None = None,
    run: str | Path | None = None,
    progress: Tell = silent,
) -> Compared:
    """Where `model` fails on logs of one machine, as `kemba-opt compare` says it.

    `columns`: the file of a column map; `run`: the run that was executed. `progress` gets the
    name of every stage. Raises KembaError.
    """
    from kemba.identify.workflow import compare_logs

    return Compared(compare_logs(_listed(logs), str(model), columns, run, progress)[0])


def discover(
    logs: Logs,
    holdout: Logs = (),
    model: str | Path = "planning",
    *,
    columns: str | Path | None = None,
    out: str | Path | None = None,
    time_limit: float = 300.0,
    progress: Tell = silent,
) -> Discovered:
    """Which physical effect `model` lacks, as `kemba-opt discover` answers it.

    `out`: folder for answer.json and model.yaml; nothing is written without it. `time_limit` in
    s. Raises KembaError for files that cannot be read.
    """
    from kemba.identify.workflow import discover_logs

    found = discover_logs(
        _listed(logs), _listed(holdout), str(model), columns, time_limit, progress, out
    )
    return Discovered(*found)


def _listed(logs: Logs) -> list[str | Path]:
    return [logs] if isinstance(logs, str | Path) else list(logs)
