"""The dimensions of a cylinder that decide how hard air pushes its rod."""

from __future__ import annotations

import math
from typing import Annotated

from kemba.config import Section
from kemba.quantity import Param

# A cylinder of a tenth of a millimetre or of ten metres is a mistake in the unit.
Diameter = Annotated[float, Param("m", lower=1e-4, upper=1.0, doc="diameter")]
Stroke = Annotated[float, Param("m", lower=1e-4, upper=10.0, doc="way of the rod")]


class Bore(Section):
    """Bore, rod and stroke [m]; the rod passes through the retract chamber."""

    bore: Diameter
    rod: float
    stroke: Stroke

    @property
    def area_extend(self) -> float:
        """Area [m2] on which the extend chamber pushes."""
        return math.pi / 4 * self.bore**2

    @property
    def area_retract(self) -> float:
        """Area [m2] on which the retract chamber pushes: of the bore less the rod."""
        return math.pi / 4 * (self.bore**2 - self.rod**2)
