"""A model with first-order chambers in the place of physical ones: easier to plan with."""

from kemba.effects.catalogue import PHYSICAL
from kemba.effects.pneumatics.chamber import Chamber, ModeDamping
from kemba.effects.pneumatics.orifice import OrificeChamber
from kemba.model.model import Model


def with_lags(model: Model) -> Model | None:
    """The model with first-order chambers of the same steady forces, their times and their damping
    by mode those of the cylinder; None for one without physical chambers."""
    chambers = [e for e in model.effects if isinstance(e, OrificeChamber)]
    if not chambers:
        return None
    first, cylinder = chambers[0], model.mechanism.need_cylinder()
    steady = {
        name: tuple(area * gauge for gauge in first.gauge)
        for name, area in (("F_extend", cylinder.area_extend), ("F_retract", cylinder.area_retract))
    }
    kept = [e for e in model.effects if not isinstance(e, PHYSICAL) and "gas" not in e.needs]
    new = Chamber(pressures=first.pressures, **steady), ModeDamping()
    return Model(model.mechanism, [*kept, *new], model.supply, model.name)
