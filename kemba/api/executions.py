"""`kemba.simulate`: a run executed on the plant, as on hardware."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from kemba.api.planning import Planned
from kemba.api.result import Result
from kemba.folders import claimed
from kemba.plant.repeat import Repeat, kept, plant_of, repeat_run
from kemba.stopwatch import Tell, silent

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Executions(Result):
    """Executions of one run and the logs that were written."""

    run: Path
    plant: str
    repeats: tuple[Repeat, ...]

    @property
    def logs(self) -> list[Path]:
        """The logs, in the log format."""
        return [repeat.path for repeat in self.repeats]

    @property
    def landed(self) -> int:
        """How many ended standing, or upright where the plan does not land."""
        return sum(repeat.replay is not None and repeat.replay.landed for repeat in self.repeats)

    @property
    def good(self) -> bool:
        """Whether all did."""
        return self.landed == len(self.repeats)

    @property
    def sentence(self) -> str:
        """What was reached, in words."""
        apex = ", ".join(f"{repeat.summary['apex_m']:.3f}" for repeat in self.repeats)
        return f"reached {apex} m on {self.plant}; {kept(self.repeats)}"

    def figure(self) -> Figure:
        """Plan and executions on one sheet."""
        from kemba import plotting

        return plotting.draw(plotting.load_sources([self.run, *self.logs]))


def simulate(
    run: Planned | str | Path,
    out: str | Path | None = None,
    *,
    plant: str | None = None,
    repeat: int = 1,
    noise: bool = False,
    seed: int = 0,
    force: bool = False,
    progress: Tell = silent,
) -> Executions:
    """Execute a run's controller on the plant and write logs, as `kemba-opt simulate` does.

    `out`: folder for the logs, a new one in the run without it. The same `seed` gives the same
    logs. `progress` gets the name of every execution. Raises KembaError where the run has no
    controller table.
    """
    path = run.path if isinstance(run, Planned) else Path(run)
    default = (path if path.is_dir() else path.parent) / "logs"
    model = plant_of(path, plant)
    with claimed(None if out is None else Path(out), default, "*.csv", force) as folder:
        repeats = repeat_run(path, model, folder, repeat, noise, seed, tell=progress)
    return Executions(path, model.name, tuple(repeats))
