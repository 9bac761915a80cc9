"""What a learnt model rests on: the logs it was fitted to, its error, how sure its figures are.

`discover`, `adopt` and `learn` write it into the model's file; `solve` reads it.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from kemba.config import Document, FileName, Section
from kemba.errors import KembaError, enumerated
from kemba.files import atomic_path, sha256
from kemba.quantity import Param
from kemba.units import short

Array = np.ndarray[Any, np.dtype[np.float64]]
Span = tuple[float, float]

ROUNDING = 1e-6  # share of a variance by which a matrix that was written may miss its properties
WIDER = 0.02  # share of the measured span by which a motion may leave it: noise of its ends


class EvidenceLog(Section):
    """A log: its path from the model's folder, its SHA-256, and whether it was `learnt` from or
    `quoted`: kept for the error that is told."""

    file: str
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    use: Literal["learnt", "quoted"] = "learnt"

    @classmethod
    def of(cls, path: str | Path, folder: Path, use: Literal["learnt", "quoted"]) -> EvidenceLog:
        """A log as a model in `folder` lists it."""
        file = Path(os.path.relpath(Path(path).resolve(), folder.resolve())).as_posix()
        return cls(file=file, sha256=sha256(path), use=use)

    def fault(self, folder: Path) -> str:
        """What became of the file since, in words, for a model in `folder`; empty where it is as it
        was."""
        try:
            same = sha256(folder / self.file) == self.sha256
        except OSError:
            return f"{self.file} is gone"
        return "" if same else f"{self.file} has changed"


class Measured(Section):
    """What the logs span: `apex` of the body's centre [m], `speed` [m/s], the largest of the body
    in each log, `supply` [Pa]; valve `modes` that occur; the `robot`'s file; `payload` [kg]."""

    apex: tuple[Annotated[float, Param("m")], Annotated[float, Param("m")]] | None = None
    speed: tuple[Annotated[float, Param("m.s-1")], Annotated[float, Param("m.s-1")]] | None = None
    supply: tuple[Annotated[float, Param("Pa")], Annotated[float, Param("Pa")]] | None = None
    modes: tuple[str, ...] = ()
    robot: str | None = None
    payload: Annotated[float, Param("kg", lower=0.0)] | None = None


class Evidence(Section):
    """What a learnt model rests on.

    `error_before`, `error_held_out`: `noise_ratio` of `compare` on the quoted logs, of the model as
    it was and of this one; `error_plant`: of the shipped simulated robot with physical chambers on
    these logs, where it can be had, with the noise learnt beside this one. `covariance`: a CSV file
    beside the model, see `read_covariance`. `figures`: nominal figures of single legs and links of
    this machine, as its logs tell them: factors of what the model states (`chamber:rear.fill[0]`),
    shares by which a link is off (`tolerance.front/knee.mass`). Predictions of its logs use them,
    plans do not.
    """

    logs: tuple[EvidenceLog, ...] = ()
    error_before: Annotated[float, Field(ge=0.0)] | None = None
    error_held_out: Annotated[float, Field(ge=0.0)] | None = None
    error_plant: Annotated[float, Field(ge=0.0)] | None = None
    covariance: FileName | None = None
    figures: dict[str, float] = Field(default_factory=dict)
    measured: Measured = Measured()

    def faults(self, folder: Path) -> list[str]:
        """A sentence for the logs that are gone or that changed since, for a model in `folder`;
        empty where none did."""
        found = [text for text in (log.fault(folder) for log in self.logs) if text]
        if not found:
            return []
        return [f"the model's evidence cannot be checked: {enumerated(found)}; its figures stay"]

    def beyond(
        self,
        apex: float | None = None,
        speed: float | None = None,
        supply: float | None = None,
        modes: Iterable[str] = (),
    ) -> list[str]:
        """What of a motion lies outside what was measured, a sentence each: apex [m] and largest
        speed [m/s] of the body, supply [Pa], valve modes. What is not given is not asked."""
        span = self.measured
        found = [
            # a log has all that is lower and slower, too
            _outside(apex, span.apex, "apex", "m", low=False),
            _outside(speed, span.speed, "speed", "m/s", low=False),
            _outside(supply, span.supply, "supply", "Pa", low=True),
        ]
        fresh = sorted(set(modes) - set(span.modes)) if span.modes else []
        if fresh:
            found.append(f"beyond what was measured: no log has valve mode {enumerated(fresh)}")
        return [text for text in found if text]


def _outside(value: float | None, span: Span | None, name: str, unit: str, low: bool) -> str:
    """A sentence where a value lies above the measured span, or below it where `low`."""
    if value is None or span is None:
        return ""
    margin = WIDER * max(map(abs, span))
    if value <= span[1] + margin and not (low and value < span[0] - margin):
        return ""
    told = next((d for d in (2, 3, 4) if short(value, d) not in [short(x, d) for x in span]), 5)
    measured = " to ".join(dict.fromkeys(short(end, told) for end in span))
    return (
        f"beyond what was measured: {name} {short(value, told)} {unit}, "
        f"the logs have {measured} {unit}"
    )


def write_covariance(path: Path, names: Sequence[str], matrix: Array) -> Path:
    """The file of a covariance (k, k): `effect.parameter` names, then the matrix, in SI units."""
    with atomic_path(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        rows = csv.writer(stream)
        rows.writerow(names)
        rows.writerows([f"{x:.10g}" for x in row] for row in np.asarray(matrix))
    return path


def matrix_in(file: Path, parameters: Iterable[str]) -> tuple[tuple[str, ...], Array]:
    """Names and covariance (k, k) in a file; `parameters`: those that the model has. Raises
    KembaError where the file is missing, malformed, of other parameters, or no covariance."""
    expected = "a header of names effect.parameter, then as many rows of numbers, were expected"
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            names, *rows = [row for row in csv.reader(stream) if row]
        matrix = np.array([[float(x) for x in row] for row in rows])
    except OSError as error:
        what = f"cannot be read: {error.strerror or error}"
        raise KembaError(str(file), what, "the covariance beside its model was expected") from None
    except ValueError as error:
        raise KembaError(str(file), f"is no covariance: {error}", expected) from None
    if len(set(names)) < len(names) or matrix.shape != (len(names), len(names)):
        what = f"{len(names)} names, but numbers of the shape {matrix.shape}"
        raise KembaError(str(file), what, expected)
    if other := sorted(set(names) - set(parameters)):
        what = f"has {enumerated(other)}, which the model's effects do not have"
        raise KembaError(f"{file}:1", what, "the covariance of this model was expected")
    _check(file, names, matrix)
    return tuple(names), matrix


def _check(file: Path, names: Sequence[str], matrix: Array) -> None:
    """Raise KembaError where a matrix is not symmetric, finite and positive semidefinite."""
    if not np.isfinite(matrix).all():
        raise KembaError(str(file), "a number is not finite")
    if (negative := np.diag(matrix) < 0.0).any():
        i = int(np.argmax(negative))
        raise KembaError(f"{file}:{i + 2}", f"the variance of {names[i]} is negative")
    width = np.sqrt(np.diag(matrix))
    width[width == 0.0] = 1.0
    unit = matrix / np.outer(width, width)
    apart = np.abs(unit - unit.T)
    if apart.max(initial=0.0) > ROUNDING:
        i, j = divmod(int(np.argmax(apart)), len(names))
        raise KembaError(f"{file}:{i + 2}", f"is not symmetric: {names[i]} and {names[j]}")
    if np.linalg.eigvalsh(unit).min(initial=0.0) < -ROUNDING * len(names):
        raise KembaError(str(file), "is not positive semidefinite, so no covariance")


def located(error: KembaError, document: Document) -> KembaError:
    """An error about a covariance at the line of the model that names it."""
    at, what = ("evidence", "covariance"), f"evidence.covariance: {error.where}: {error.what}"
    return document.error(at, what, error.expected, "run discover, adopt or learn once more")
