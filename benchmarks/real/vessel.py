"""A vessel that blows down: is the heat of the wall named?"""

from pathlib import Path

import numpy as np

from benchmarks.real import data
from benchmarks.real.say import answered, fitted, listed
from kemba.identify.logs.reading import read_logs, taken_on
from kemba.identify.rigs.vessel import vessel_problem
from kemba.model import load_model


def section(scratch: Path, download: bool) -> list[str]:
    """Lines of the page about the vessel."""
    log = data.vessel()
    model = load_model("vessel_rig")
    read = read_logs([log])
    taken_on(read, model.mechanism)
    coldest = vessel_problem(read, model).expected({}, 0)["vessel/T"].min()
    measured = np.nanmin(read[0]["vessel/T"])
    lines = ["## Blow-down of a vessel of air", ""]
    lines += [
        "16.2 L at 790 kPa through a hole of 2.71 mm; 15 pressures and 14 temperatures, digitised.",
        "Model: `configs/models/vessel_rig.yaml`, no heat from the wall. Its gas cools to "
        f"{coldest:.0f} K; {measured:.0f} K were measured.",
        "",
    ]
    lines += answered([log], "vessel_rig", scratch)
    lines += fitted([log], "vessel_rig", ["wall_heat"], scratch)
    return [*lines, *listed(NOTES), ""]


NOTES = (
    "McAdams' rule for free convection gives h = 2.7 W.m-2.K-1 at 1 atm and 10 K.",
    "Sensor faults that are named beside `wall_heat` are not to be believed: with the nominal "
    "orifice and h = 3 the pressure fits within 7 kPa everywhere, but the temperature is 15 K too "
    "low at first and 8 K too high at the end. One temperature for all gas and a thermometer "
    "without a lag are too simple for 29 readings that are this exact.",
)
