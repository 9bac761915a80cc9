"""What the paper's Tables I and II already tell: friction, a supply that falls short, tube volume.

    python benchmarks/paper_tables.py

Table II gives the steady force of a cylinder of known area at known pressure; what is missing to
pressure times area is physics that eq. 4 to 7 have no name for. Table I gives how rise times grow
with the volume to be filled; where the line through them meets zero is the volume of the tubes.
"""

from dataclasses import dataclass

import numpy as np

from kemba.identify.problem.problem import Array
from kemba.mechanism import Cylinder, load_cylinder
from kemba.plant.published import PAPER_FORCE, PAPER_RISE

MADE_ON = "dsnu-25-70"  # the cylinder on which the tables were measured


@dataclass(frozen=True)
class Published:
    """Losses [N] by mode at `pressures` [Pa]; what they and the rise times imply."""

    pressures: Array
    losses: dict[str, Array]
    seal_friction: tuple[float, float]  # N, smallest and largest
    shortfall: dict[str, Array]  # share of the supply that is missing while air flows
    dead_volume: dict[str, float]  # m3, by filling and venting
    cylinder: Cylinder

    @property
    def sentence(self) -> str:
        low, high = self.seal_friction
        growing = ", ".join(
            f"{mode} {100 * s[0]:.0f} to {100 * s[-1]:.0f} %" for mode, s in self.shortfall.items()
        )
        volumes = sorted(1e6 * v for v in self.dead_volume.values())
        return (
            f"Tables I and II imply seal friction of {low:.0f} to {high:.0f} N, a supply that "
            f"falls short as it is drawn from ({growing} from 0.6 to 0.8 MPa), and tubes of "
            f"{volumes[0]:.0f} to {volumes[-1]:.0f} cm3 beside the stroke of "
            f"{1e6 * self.cylinder.area_extend * self.cylinder.stroke:.0f} cm3."
        )


def published() -> Published:
    """The findings, computed from Tables I and II."""
    cylinder = load_cylinder(MADE_ON)
    A_e, A_r = cylinder.area_extend, cylinder.area_retract
    areas = {"extend": A_e, "retract": -A_r, "both": A_e - A_r}
    pressures = np.array(sorted({p for mode, p in PAPER_FORCE if mode == "extend"}))
    losses = {
        mode: np.array([abs(p * area) - abs(PAPER_FORCE[mode, p][0]) for p in pressures])
        for mode, area in areas.items()
    }
    # With both valves on the chambers' shortfalls cancel nearly; at 0.6 MPa nothing falls short.
    bare = np.array([*losses["both"], losses["extend"][0], losses["retract"][0]])
    friction = float(np.median(bare))
    shortfall = {
        mode: np.maximum(losses[mode] - friction, 0.0) / (pressures * abs(areas[mode]))
        for mode in ("extend", "retract")
    }
    volume = {
        name: A_e * cylinder.stroke / (full / empty - 1.0)
        for name, (empty, full) in PAPER_RISE.items()
    }
    spread = np.percentile(bare, [25, 75])
    friction_span = (float(spread[0]), float(spread[1]))
    return Published(pressures, losses, friction_span, shortfall, volume, cylinder)


if __name__ == "__main__":
    found = published()
    print(found.sentence)
    print("\nPressure x area - F_static [N] at 0.6, 0.7 and 0.8 MPa:")
    for mode, losses in found.losses.items():
        print(f"{mode:8s}", *(f"{loss:6.1f}" for loss in losses))
