"""The temperature of gas in a chamber: energy balance, and heat from the wall.

An ideal gas of mass m = P V/(R T) and one temperature. What flows out carries its own temperature.
"""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import casadi as ca

from kemba.effects.base import AirEffect, At, Contribution, Effect
from kemba.effects.pneumatics.flow import ATMOSPHERE, GAS, KAPPA, TEMPERATURE, phi
from kemba.quantity import Param, Quantity, Tolerance

ROUND = 0.1  # K; the cube root of a difference of temperatures has an infinite slope at 0


@dataclass(frozen=True)
class Air:
    """The air of one chamber: P [Pa], V [m3], its growth [m3.s-1], flows in and out [kg.s-1],
    both at least 0, area of the wall [m2]."""

    P: Any
    V: Any
    growth: Any
    inflow: Any
    outflow: Any
    wall: Any


@dataclass(frozen=True)
class Gas:
    """Gas that heat can reach: symbols of its states, P, T, V, area and temperature of the wall."""

    pressure: str
    temperature: str
    P: Any
    T: Any
    V: Any
    wall: Any
    ambient: float


def cooling(air: Air, T: Any, T_in: float) -> Any:
    """dT/dt [K.s-1] of air without heat from the wall; what flows in has the temperature T_in."""
    carried = air.inflow * (KAPPA * T_in - T) - air.outflow * (KAPPA - 1) * T
    return carried * GAS * T / (air.P * air.V) - (KAPPA - 1) * T * air.growth / air.V


class GasTemperature(Effect):
    """The air of each orifice chamber has a temperature of its own; use it with `n: 1.4`.

    Without it the air that leaves a chamber is taken to be as warm as the supply.
    """

    family = "air"
    equation = (
        "dT/dt = (mdot_in (kappa T_0 - T) - mdot_out (kappa - 1) T) R T/(P V) - (kappa - 1) T dV/V;"
        " dP/dt + n R (T_0 - T) mdot_out/V"
    )
    source = "P. Beater, Pneumatic Drives, Springer 2007: energy of a chamber"
    ports = ("piston",)
    publishes = ("gas",)

    def states(self) -> dict[str, Quantity]:
        sizes = 120.0, 700.0, 50.0, TEMPERATURE
        return {
            f"T_{side[0]}": Quantity(f"chamber/{side}/T", "K", *sizes, f"air in {side}")
            for side in ("extend", "retract")
        }

    def evaluate(self, at: At) -> Contribution:
        rate, add, gases = {}, {}, []
        for side, air, T in (("e", at.air_e, at.T_e), ("r", at.air_r, at.T_r)):
            rate[f"T_{side}"] = cooling(air, T, TEMPERATURE)
            add[f"P_{side}"] = at.exponent * GAS * (TEMPERATURE - T) * air.outflow / air.V
            gases.append(Gas(f"P_{side}", f"T_{side}", air.P, T, air.V, air.wall, TEMPERATURE))
        return Contribution(rate=rate, add_rate=add, publish={"gas": tuple(gases)})


class WallHeat(AirEffect):
    """Heat that walls give to the air in them by free convection, more to denser air.

    h is its coefficient for air of the atmosphere that is 10 K colder than the wall. Needs air with
    a temperature of its own: `gas_temperature` beside orifice chambers, or the vessel of a rig.
    """

    h: Annotated[float, Param("W.m-2.K-1", 5.0, lower=0.0, doc="coefficient at 1 atm and 10 K")] = (
        0.0
    )

    equation = (
        "Q = h A_w (rho/rho_atm)^(2/3) (abs(dT)/10)^(1/3) dT, dT = T_w - T; "
        "dP/dt + (kappa - 1) Q/V, dT/dt + (kappa - 1) Q T/(P V)"
    )
    source = (
        "W. H. McAdams, Heat Transmission, 1954: Nu = 0.13 (Gr Pr)^(1/3); for blow-downs "
        "M. A. Haque et al., Trans. IChemE 70 B, 1992"
    )
    ports = ()
    needs = ("gas",)

    def evaluate(self, at: At) -> Contribution:
        add = {}
        for gas in at.gas:
            colder = gas.ambient - gas.T
            density = gas.P / ATMOSPHERE * TEMPERATURE / gas.T
            stirred = density ** (2 / 3) * ((colder**2 + ROUND**2) / 100.0) ** (1 / 6)
            warming = (KAPPA - 1) * self.h * stirred * gas.wall * colder / gas.V
            add[gas.pressure] = warming
            add[gas.temperature] = warming * gas.T / gas.P
        return Contribution(add_rate=add)


class VesselChamber(Effect):
    """Air in a vessel of fixed volume that blows down through an orifice; the rig brings it along.

    `a` is the effective area: that of the hole times its discharge coefficient. `wall` [m2]: area
    of the inner wall; `ambient` [K]: its temperature; `outside` [Pa]: pressure behind the hole.
    """

    V: Annotated[float, Param("m3", 1e-3, lower=1e-9, doc="inside")] = 1e-3
    a: Annotated[float, Param("m2", 1e-6, lower=0.0, doc="effective area of the orifice")] = 1e-6
    wall: float = 0.05
    ambient: float = TEMPERATURE
    outside: float = 101325.0

    family = "air"
    equation = (
        "mdot = a phi(P, P_out) sqrt(T_0/T); dP/dt = -kappa R T mdot/V, "
        "dT/dt = -(kappa - 1) R T^2 mdot/(P V)"
    )
    source = "paper eq. 1-3 with a temperature: energy balance of a chamber"
    publishes = ("gas",)
    nominal: ClassVar[dict[str, Tolerance]] = {
        "V": Tolerance(0.01, source="assumed: volumes of vessels are known to 1 %"),
        "a": Tolerance(0.05, source="ISO 5167-2 and data sheets: discharge coefficients, 5 %"),
    }

    def states(self) -> dict[str, Quantity]:
        return {
            "P_g": Quantity("vessel/P", "Pa", 1e3, 1e8, 1e5, self.outside, "pressure, absolute"),
            "T_g": Quantity("vessel/T", "K", 50.0, 2000.0, 10.0, self.ambient, "temperature"),
        }

    def evaluate(self, at: At) -> Contribution:
        P, T = at.P_g, at.T_g
        outflow = self.a * phi(P, self.outside) * ca.sqrt(TEMPERATURE / T)
        air = Air(P, self.V, 0.0, 0.0, outflow, self.wall)
        return Contribution(
            rate={"P_g": -KAPPA * GAS * T * outflow / self.V, "T_g": cooling(air, T, self.ambient)},
            publish={"gas": (Gas("P_g", "T_g", P, T, self.V, self.wall, self.ambient),)},
        )
