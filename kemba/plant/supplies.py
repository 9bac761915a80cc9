"""At which supply pressure each bench log was taken."""

from collections.abc import Mapping, Sequence

import numpy as np

from kemba.errors import KembaError
from kemba.model.model import NOMINAL_SUPPLY
from kemba.quantity import to_si
from kemba.trajectory import Trajectory

APART = 0.02  # share by which the pressures of two supplies differ at least
SETTLED = 0.9  # quantile of an open chamber's pressure: it fills, and falls while the rod is fast
VALVES = ("extend", "retract")


def tell_supplies(logs: Mapping[str, Trajectory], supplies: Sequence[float]) -> tuple[str, ...]:
    """Note in each log its supply [Pa]: what its sidecar says, else one of `supplies`, which go in
    ascending order with the levels at which chambers settle, else the nominal one. Returns what is
    to be said about it. Raises KembaError where levels and supplies differ in number."""
    untold = []
    for name, log in logs.items():
        if "supply" not in log.meta and any(np.any(log[f"valve/{v}"] > 0.5) for v in VALVES):
            untold.append((_level(log), name))
        try:
            log.meta["supply"] = to_si(log.meta.get("supply", NOMINAL_SUPPLY), "Pa")
        except ValueError as error:
            raise KembaError(f"{name}: supply", str(error)) from None
    untold.sort()
    groups: list[list[tuple[float, str]]] = []
    for level, name in untold:
        if not groups or level > (1.0 + APART) * groups[-1][-1][0]:
            groups.append([])
        groups[-1].append((level, name))
    at = ", ".join(f"{np.median([level for level, _ in g]) / 1e6:.3g}" for g in groups)
    seen = f"their chambers settle at {at} MPa (absolute)" if any(lv for lv, _ in untold) else ""
    if len(supplies or groups[:1]) != len(groups):
        what = f"{len(untold)} logs do not tell their supply" + (f"; {seen}" if seen else "")
        hint = f"--supply for each of {len(groups)}, or `supply: 0.6 MPa` in NAME.meta.yaml"
        raise KembaError(groups[0][0][1] if groups else "supply", what, hint=hint)
    for supply, group in zip(sorted(supplies) or [NOMINAL_SUPPLY], groups, strict=False):
        for _, name in group:
            logs[name].meta["supply"] = supply
    if supplies or not groups:
        return ()
    taken = f"{NOMINAL_SUPPLY / 1e6:g} MPa"
    said = f"no sidecar tells the supply of {len(untold)} logs: taken as {taken}"
    return (f"{said}, {seen or 'no pressure is logged'}; --supply tells it",)


def _level(log: Trajectory) -> float:
    """The pressure [Pa] of the supply if it is logged, else that at which open chambers settle, the
    lower one of two, since a rod that moves presses on the other; 0 where none is logged."""
    if "supply/P" in log:
        return float(np.nanmedian(log["supply/P"]))
    found = []
    for valve in VALVES:
        name, on = f"chamber/{valve}/P", log[f"valve/{valve}"] > 0.5
        if name in log and np.isfinite(log[name][on]).any():
            found.append(float(np.nanquantile(log[name][on], SETTLED)))
    return min(found, default=0.0)
