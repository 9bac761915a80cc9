"""Run folders: what was asked, with which versions, how it ended, and the results."""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any

import kemba
from kemba.errors import KembaError
from kemba.files import read_json, sha256, write_error, write_json
from kemba.folders import ANOTHER, LOCK, lock_folder, try_writing, unlock
from kemba.trajectory import Trajectory

MANIFEST = "manifest.json"
PLANT_RUN = "plant.csv"  # the motion of the simulated robot, in the plan's clock
POLICY = "policy.npz"  # feedback around the plan
STAGES = "stages.npz"  # the solved program, from which `solve --from` begins
TABLES = ("trajectory", "controller", "plant")
REPLACED = (  # what a run consists of, and pages about it
    *("task.yaml", "certificate.json", "solver.log", "figure.png", "report.html", "view.html"),
    *(STAGES, POLICY),
    *(f"{name}.{kind}" for name in TABLES for kind in ("csv", "meta.yaml")),
)
LIBRARIES = ("casadi", "pin", "numpy")


@dataclass
class RunFolder:
    """A folder being filled by a verb; its manifest says `running` until `finish`.

    No other process can fill it meanwhile.
    """

    path: Path
    manifest: dict[str, Any] = field(default_factory=dict)
    lock: Any = field(default=None, repr=False)

    @classmethod
    def create(
        cls,
        out: str | Path | None,
        task: str,
        inputs: Iterable[str | Path] = (),
        command: Sequence[str] | None = None,
        force: bool = False,
    ) -> RunFolder:
        """Make the folder `out`, or the next free `runs/<task>-<n>`, and note what goes in.

        `inputs` are the task and model files, of which hashes are kept. A folder left by a run
        that never finished is used again. With `force` a finished run is replaced, unless it has
        logs. Raises KembaError when `out` holds a finished run or other files, cannot be made or
        written, or is being filled by another process.
        """
        if out is None:
            path = _next_free(task)
        else:
            path = Path(out)
            _check_usable(path, force)
        try_writing(path)
        folder = cls(path, lock=lock_folder(path))
        _check_usable(path, force)  # another process may have finished since
        if force:
            for old in (path / name for name in REPLACED):
                old.unlink(missing_ok=True)
        folder.manifest = {
            "status": "running",
            "task": task,
            "command": list(sys.argv if command is None else command),
            "started": now(),
            "finished": None,
            "versions": versions(),
            "inputs": {str(name): sha256(name) for name in inputs},
        }
        write_json(path / MANIFEST, folder.manifest)
        return folder

    def finish(self, status: str, **facts: Any) -> None:
        """Replace the manifest by its final form; `facts` are further entries."""
        self.manifest.update(status=status, finished=now(), **facts)
        write_json(self.path / MANIFEST, self.manifest)
        unlock(self.lock, self.path)
        self.lock = None

    def __truediv__(self, name: str) -> Path:
        return self.path / name


@dataclass(frozen=True)
class Run:
    """A run folder to read; results are read when asked for. KembaError when one is missing."""

    path: Path
    manifest: dict[str, Any]

    @cached_property
    def trajectory(self) -> Trajectory:
        """The planned trajectory."""
        return Trajectory.read(self._file("trajectory.csv"))

    @cached_property
    def controller(self) -> Trajectory:
        """The commands for the robot, at the controller's rate."""
        return Trajectory.read(self.table)

    @property
    def table(self) -> Path:
        """The file of these commands."""
        return self._file("controller.csv")

    @cached_property
    def certificate(self) -> dict[str, Any]:
        """The outcome, residuals and replay of the plan. Raises KembaError where the file is
        missing or is no certificate."""
        found = read_json(self._file("certificate.json"))
        if not isinstance(found, dict):
            expected = "a group of keys, as solve writes it, was expected"
            raise KembaError(str(self.path / "certificate.json"), "is no certificate", expected)
        return found

    @property
    def task(self) -> Path:
        """The resolved task's YAML."""
        return self._file("task.yaml")

    def _file(self, name: str) -> Path:
        if (self.path / name).is_file():
            return self.path / name
        status = self.manifest.get("status", "unknown")
        raise KembaError(str(self.path), f"has no {name}", hint=f"the run's status is '{status}'")


def load_run(path: str | Path) -> Run:
    """The run in a folder, or in the folder of the file given. Raises KembaError where there is no
    such folder, or it holds no run."""
    folder = Path(path)
    if folder.is_file():
        folder = folder.parent
    if not folder.is_dir():
        runs = ", ".join(str(item.parent) for item in sorted(Path("runs").glob(f"*/{MANIFEST}")))
        hint = f"runs here: {runs}" if runs else "make one with: kemba-opt solve jump.yaml"
        raise KembaError(str(path), "no such run folder", hint=hint)
    if not (folder / MANIFEST).is_file():
        expected = f"a folder with a {MANIFEST}, as solve writes it, was expected"
        raise KembaError(str(folder), "is not a run folder", expected)
    return Run(folder, read_manifest(folder))


def newest_run(holds: str = "trajectory.csv", folder: str | Path = "runs") -> Path:
    """The run in `folder` that was begun last, of those with the file `holds`. Raises KembaError
    where there is none."""
    found = [file.parent for file in Path(folder).glob(f"*/{holds}")]
    if not found:
        what = (
            f"no run in it has a {holds}" if Path(folder).is_dir() else "there is no run here yet"
        )
        raise KembaError(str(folder), what, hint="make one with: kemba-opt solve jump.yaml")
    return max(found, key=lambda run: _begun(run, holds))


def newest_logs(run: Path) -> list[Path]:
    """The logs of a run that were written last: those of its newest folder `logs`, `logs-2`, ..."""
    found = [sorted(folder.glob("*.csv")) for folder in run.glob("logs*")]
    return max(filter(None, found), key=lambda logs: logs[0].stat().st_mtime, default=[])


def _begun(run: Path, holds: str) -> tuple[str, float]:
    """When a run was begun: by its manifest, whose seconds may be those of others, then by age."""
    began = str(read_manifest(run).get("started", "")) if (run / MANIFEST).is_file() else ""
    return began, (run / holds).stat().st_mtime


def versions() -> dict[str, str]:
    """The versions that decide about a result."""
    found = {"kemba": kemba.__version__, "python": platform.python_version()}
    return found | {name: metadata.version(name) for name in LIBRARIES}


def now() -> str:
    """The date and time, as manifests write it."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def _next_free(task: str) -> Path:
    """A new folder `runs/<task>-<n>`; making it claims it against other processes."""
    number = 1
    while True:
        path = Path("runs") / f"{task}-{number}"
        try:
            path.mkdir(parents=True)
        except FileExistsError:
            number += 1
        except OSError as error:
            raise write_error(path, error) from None
        else:
            return path


def _check_usable(path: Path, force: bool = False) -> None:
    """Raise KembaError unless the folder is new, or left over from an unfinished run, or may be
    replaced by `force`."""
    if path.exists() and not path.is_dir():
        raise KembaError(str(path), "is a file", "a new folder was expected")
    if path.is_dir() and any(item.name != LOCK for item in path.iterdir()):
        if not (path / MANIFEST).is_file():
            raise KembaError(str(path), "holds other files", "a new folder was expected")
        status, ended = read_manifest(path).get("status"), (path / "certificate.json").is_file()
        if status == "running" or (status == "failed" and not ended):  # an error ended it
            return
        if not force:
            raise KembaError(str(path), "holds a finished run already", hint=ANOTHER)
        if newest_logs(path):
            hint = "they belong to the run that is there; give another folder"
            raise KembaError(str(path), "holds logs", hint=hint)


def read_manifest(folder: Path) -> dict[str, Any]:
    """The manifest of a run or sweep folder. Raises KembaError when it is no group of keys."""
    found = read_json(folder / MANIFEST)
    if not isinstance(found, dict):
        expected = "a group of keys, as kemba writes it, was expected"
        raise KembaError(str(folder / MANIFEST), "is no manifest", expected)
    return found
