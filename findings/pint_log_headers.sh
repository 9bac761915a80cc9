#!/usr/bin/env bash
# Units as rigs and robots write them into headers, read by Pint: torque in Nm is a yarn count.
#
# Guess, written before the run: spellings that are common on test benches (Nm, cfm, slpm, pct, PS,
# mil, U/min) are either what an engineer means by them, or unknown and refused.
#
# Seen (pint 0.25.3, its own registry): seven of them are known, as something else.
#   Nm     number_meter, the fineness of a yarn: 1000 m/kg; kNm and mNm are multiples of that
#   cfm    centifermi: 1e-17 m           (cubic feet a minute)
#   pct    picocarat: 2e-16 kg           (percent)
#   PS     petasiemens                   (metric horsepower)
#   mil    an angle: 98 microradians, a tenth of the 1/6400 of a turn (a thousandth of an inch)
#   U/min  enzyme units a minute         (turns a minute, in German)
#   slpm   a power: 1.69 W               (a flow of standard litres a minute)
# Nmm, lpm, barg and psig are refused, as guessed. And what is known with its right dimension may
# still have another value: 60 rpm are 6.28 Hz, since a turn is 2 pi and a hertz is one a second.
#
# Why it matters: parsing a header raises nothing; the first conversion of a torque does, or, where
# magnitudes are stripped by `to_base_units()`, none does, and torques come out a thousand times
# too large. A reader of logs needs its own list of spellings.
#
# Read: Pint's default registry and its documentation of parsing strings.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet pint==0.25.3
"$work/venv/bin/python" - <<'EOF'
import sys

import pint

units = pint.UnitRegistry()
print("pint", pint.__version__)
MEANT = {
    "Nm": ("N*m", "number_meter"),
    "kNm": ("kN*m", "kilonumber_meter"),
    "cfm": ("ft**3/min", "centifermi"),
    "pct": ("percent", "picocarat"),
    "PS": ("metric_horsepower", "petasiemens"),
    "mil": ("thou", "mil"),
    "U/min": ("turn/min", "enzyme_unit / minute"),
    "slpm": ("liter/min", "standard_liter_per_minute"),
}
for spelling, (meant, known) in MEANT.items():
    unit = units.Unit(spelling)
    base = units.Quantity(1.0, spelling).to_base_units()
    asked = units.Quantity(1.0, meant).to_base_units()
    print(f"1 {spelling:6s} is {unit!s:26s} = {base:.4g~}, not {asked:.4g~}")
    if str(unit) != known or unit.dimensionality == units.Unit(meant).dimensionality:
        sys.exit(f"changed: {spelling} is now {unit}, {unit.dimensionality}")
for spelling in ("Nmm", "lpm", "barg", "psig"):
    try:
        units.Unit(spelling)
    except pint.UndefinedUnitError:
        print(f"1 {spelling:6s} is refused")
    else:
        sys.exit(f"changed: {spelling} is known")
hertz = units.Quantity(60.0, "rpm").to("Hz").magnitude
print(f"60 rpm are {hertz:.4f} Hz")
if abs(hertz - 6.2832) > 1e-4:
    sys.exit("changed: 60 rpm in Hz")
EOF
