"""Tables I and II beside the paper's."""

from typing import Any

from kemba.plant.characterise import Characteristics, Estimate

# Table I, s, at x = 0 and 70 mm
PAPER_RISE = {"fill": (0.008, 0.025), "vent": (0.013, 0.037)}
# Table II, N and N s/m, by supply in Pa
PAPER_FORCE: dict[tuple[str, float], tuple[float, float]] = {
    ("extend", 0.6e6): (287.0, 91.0),
    ("extend", 0.7e6): (324.0, 97.0),
    ("extend", 0.8e6): (349.0, 103.0),
    ("retract", 0.6e6): (-239.0, 78.0),
    ("retract", 0.7e6): (-260.0, 84.0),
    ("retract", 0.8e6): (-291.0, 89.0),
    ("both", 0.6e6): (41.0, 52.0),
    ("both", 0.7e6): (50.0, 59.0),
    ("both", 0.8e6): (55.0, 64.0),
    ("none", 0.0): (0.0, 25.0),
}
PAPER_DEAD_TIME = 0.006  # s


def as_json(found: Characteristics) -> dict[str, Any]:
    """Everything that was found, with the paper's values where it has them."""
    return {
        "table_1": [
            {"chamber": name, "x_m": x, **vars(estimate), "unit": "s", "paper": paper}
            for name, x, estimate, paper in _rises(found)
        ],
        "table_2": [
            {
                "mode": line.mode,
                "supply_pa": line.supply,
                "F_static": {**vars(line.F_static), "unit": "N", "paper": paper[0]},
                "c_d": {**vars(line.c_d), "unit": "N.s.m-1", "paper": paper[1]},
                "r2": line.r2,
            }
            for line, paper in _forces(found)
        ],
        "dead_time": {
            name: {**vars(estimate), "unit": "s", "paper": PAPER_DEAD_TIME}
            for name, estimate in (found.rises.dead.items() if found.rises else ())
        },
        "rise_r2": found.rises.r2 if found.rises else None,
        "bilinear_r2": found.rises.r2_linear if found.rises else None,
        "check": {name: {"r2": r2, "rms_n": rms} for name, (r2, rms) in found.check.items()},
        "remarks": list(found.remarks),
    }


def _rises(found: Characteristics) -> list[tuple[str, float, Estimate, float]]:
    if not found.rises:
        return []
    return [
        (name, x, estimate, paper)
        for name in ("fill", "vent")
        for x, estimate, paper in zip(
            (0.0, found.cylinder.stroke), getattr(found.rises, name), PAPER_RISE[name], strict=True
        )
    ]


def _forces(found: Characteristics) -> list[tuple[Any, tuple[float | None, float | None]]]:
    return [
        (line, PAPER_FORCE.get((line.mode, round(line.supply, -3)), (None, None)))
        for line in found.lines
    ]
