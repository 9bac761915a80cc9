"""CSV logs with their sidecars, in the project's table format."""

import json
from pathlib import Path

import numpy as np


def write(path: Path, columns: dict[str, np.ndarray]) -> Path:
    """One header row, an empty cell for what was not measured."""
    path.parent.mkdir(parents=True, exist_ok=True)
    table = np.column_stack(list(columns.values()))
    lines = [",".join(columns)]
    for row in table:
        lines.append(",".join("" if np.isnan(v) else f"{v + 0.0:.9g}" for v in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def sidecar(path: Path, kind: str, run: int, group: str, noise: dict[str, float], notes="") -> None:
    """`NAME.meta.yaml` beside `NAME.csv`; flat enough to be written by hand."""
    lines = [f"kind: {kind}", f"run: {run}", f"repeat_of: {group}", "noise:"]
    lines += [f'  "{name}": {sigma:.4e}' for name, sigma in noise.items()]
    if notes:
        lines.append(f"notes: {json.dumps(notes)}")
    path.with_suffix("").with_suffix(".meta.yaml").write_text("\n".join(lines) + "\n")


def read(path: Path) -> dict[str, np.ndarray]:
    """Read a log back (tests only)."""
    rows = Path(path).read_text(encoding="utf-8").splitlines()
    data = np.array([[float(c) if c else np.nan for c in r.split(",")] for r in rows[1:]])
    return dict(zip(rows[0].split(","), data.T, strict=True))
