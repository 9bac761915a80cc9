"""Lengths of the machine that differ from the drawing."""

from typing import Annotated

from pydantic import field_validator

from kemba.effects.base import Deviation
from kemba.errors import suggest
from kemba.quantity import Param

# what is a large error of a length [m]: links are measured to some millimetres, and pivots that
# are close together to some tenths
SIZES = {"femur/length": 6e-3, "tibia/length": 6e-3, "piston/mount": 1e-3, "piston/pin": 1e-3}


class Geometry(Deviation):
    """A length of every leg differs from the robot's file; masses stay, and stay where they are.

    `part`: `femur/length` (hip to knee), `tibia/length` (knee to foot), `piston/mount` (the
    cylinder's pivot beside the hip) or `piston/pin` (knee to the rod's pin). Bodies, feet and the
    loop at the knee follow. Its size is 6 mm for the links and 1 mm at the piston.
    """

    part: str
    d: Annotated[float, Param("m", 6e-3, doc="true length minus that of the robot's file")] = 0.0

    place = "body"
    family = "geometry"
    equation = "length -> length + d in every kinematic relation"
    source = "kinematics of the link table; tolerances of making and mounting"

    @field_validator("part")
    @classmethod
    def _known(cls, part: str) -> str:
        if part not in SIZES:
            hint = suggest(part, SIZES)
            raise ValueError(f"'{part}' is no length of a leg; one of {', '.join(SIZES)}; {hint}")
        return part

    @property
    def name(self) -> str:
        return f"{self.kind}:{self.part}"

    @property
    def geometry(self) -> dict[str, float]:
        return {self.part: self.d}

    def parameters(self) -> dict[str, Param]:
        usual = self.declared()["d"]
        return {"d": Param(usual.unit, SIZES[self.part], doc=usual.doc)}
