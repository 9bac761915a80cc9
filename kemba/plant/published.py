"""Tables I and II beside the paper's."""

from typing import Any

from kemba.plant.characterise import Characteristics

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
    ends, rises = (0.0, found.cylinder.stroke), found.rises
    forces = [PAPER_FORCE.get((f.mode, round(f.supply, -3)), (None, None)) for f in found.lines]
    return {
        "table_1": [
            {"chamber": name, "x_m": x, **vars(estimate), "unit": "s", "paper": paper}
            for name in (PAPER_RISE if rises else ())
            for x, estimate, paper in zip(ends, getattr(rises, name), PAPER_RISE[name], strict=True)
        ],
        "table_2": [
            {
                "mode": line.mode,
                "supply_pa": line.supply,
                "F_static": {**vars(line.F_static), "unit": "N", "paper": paper[0]},
                "c_d": {**vars(line.c_d), "unit": "N.s.m-1", "paper": paper[1]},
                "r2": line.r2,
            }
            for line, paper in zip(found.lines, forces, strict=True)
        ],
        "dead_time": {
            name: {**vars(estimate), "unit": "s", "paper": PAPER_DEAD_TIME}
            for name, estimate in (rises.dead.items() if rises else ())
        },
        "rise_r2": rises.r2 if rises else None,
        "bilinear_r2": rises.r2_linear if rises else None,
        "check": {name: {"r2": r2, "rms_n": rms} for name, (r2, rms) in found.check.items()},
        "remarks": list(found.remarks),
    }
