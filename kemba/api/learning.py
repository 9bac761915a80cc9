"""`kemba.compare`, `discover`, `adopt`, `learn`: where a model fails on logs, and what it lacks."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kemba.api.planning import Planned, Result, settings
from kemba.errors import KembaError
from kemba.identify.answer import Answer, Ranked
from kemba.identify.compare.compare import Comparison
from kemba.identify.discover import Discovery
from kemba.stopwatch import Tell, watched

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kemba.rounds.round import Round

Logs = str | Path | Sequence[str | Path]


@dataclass(frozen=True, repr=False)
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


@dataclass(frozen=True, repr=False)
class Discovered(Result):
    """Which effect a model lacks, and how sure that is; `folder`: where it is written."""

    answer: Answer
    found: Discovery | None
    folder: Path | None = None

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
    progress: Tell | None = None,
) -> Compared:
    """Where `model` fails on `logs` of one machine, as `kemba-opt compare` says it.

    `columns`: the file of a column map; `run`: the run that was executed. `progress`: as of
    `kemba.plan`. Raises KembaError.
    """
    from kemba.identify.workflow import compare_logs

    return Compared(compare_logs(_listed(logs), str(model), columns, run, progress or watched())[0])


def discover(
    logs: Logs,
    holdout: Logs = (),
    model: str | Path = "planning",
    *,
    columns: str | Path | None = None,
    out: str | Path | None = None,
    force: bool = False,
    time_limit: float = 300.0,
    progress: Tell | None = None,
) -> Discovered:
    """Which physical effect `model` lacks, as `kemba-opt discover` answers it.

    `logs`: of one machine; `holdout`: logs kept for judging. `out`: folder for answer.json and
    model.yaml; nothing is written without it. `time_limit` in s. `columns`, `progress`: as of
    `compare`. Raises KembaError for files that cannot be read, or where `out` holds an answer and
    not `force`.
    """
    from kemba.folders import claimed
    from kemba.identify.workflow import discover_logs

    tell, told = progress or watched(), (_listed(logs), _listed(holdout), str(model), columns)
    with nullcontext() if out is None else claimed(out, out, "answer.json", force):
        found = discover_logs(*told, time_limit, tell, out)
    return Discovered(*found, None if out is None else Path(out))


def adopt(
    answer: Discovered | str | Path,
    effect: str | None = None,
    out: str | Path = "model.yaml",
    *,
    force: bool = False,
) -> Path:
    """Write the model with what an answer found, or with another `effect` of its ranking.

    `answer`: what `discover` gave, or its folder. Raises KembaError where nothing was found or
    written, or `out` exists and not `force`.
    """
    from kemba.folders import YAML, fresh
    from kemba.identify.adopt import adopt_answer, adopt_effect

    folder = answer.folder if isinstance(answer, Discovered) else answer
    if folder is None:
        hint = 'kemba.discover(logs, out="answer")'
        raise KembaError("the answer", "was not written to a folder", hint=hint)
    path = fresh(out, force, endings=YAML)
    if effect is None:
        adopt_answer(folder, path)
    else:
        adopt_effect(folder, effect, path)
    return path


@dataclass(frozen=True, repr=False)
class Learned(Result):
    """One round of learning: what was found, and the next plan."""

    round: Round
    planned: Planned

    @property
    def sentence(self) -> str:
        """The round in words."""
        return self.round.sentence

    @property
    def good(self) -> bool:
        """Whether the next plan is confirmed."""
        return self.round.good

    def figure(self) -> Figure:
        """The next plan."""
        return self.planned.figure()


def learn(
    runs: Planned | str | Path | Sequence[str | Path],
    logs: Logs,
    target: str | Path | None = None,
    out: str | Path | None = None,
    *,
    holdout: Logs = (),
    columns: str | Path | None = None,
    time_limit: float = 600.0,
    correct: bool = True,
    force: bool = False,
    progress: Tell | None = None,
    **changes: Any,
) -> Learned:
    """Learn from executed `runs` and plan the next one, as `kemba-opt learn` does.

    `logs`, `holdout`, `columns`, `progress`: as of `discover`. `target`: the task to plan, that of
    the last run by default; `changes` are those of `--set`; `out`: its run folder, where `force`
    replaces a finished run. `correct`: plan by what executions did beyond the learnt model too.
    `time_limit` in s. Raises KembaError.
    """
    from kemba.rounds.round import Asked, learn_into
    from kemba.runs import load_run
    from kemba.solve import Listener

    folders = [runs.path] if isinstance(runs, Planned) else _several(runs)
    task = target or load_run(folders[-1]).task
    told = settings(changes), _listed(holdout), columns, time_limit, correct
    asked = Asked(folders, _listed(logs), task, *told)
    found, folder = learn_into(asked, out, Listener(progress or watched()), force)
    return Learned(found, Planned.read(folder.path))


def _several(paths: Logs) -> list[str | Path]:
    return [paths] if isinstance(paths, str | Path) else list(paths)


def _listed(logs: Logs) -> list[Path]:
    """Logs; a folder stands for those in it, as at the command line."""
    from kemba.logs import log_files

    return log_files(_several(logs))
