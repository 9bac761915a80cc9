"""Tuning numbers of the contract tests."""

from __future__ import annotations

from kemba.settings import CHOSEN, Settings, setting


class ContractSettings(Settings):
    """What an effect must change at least to count, and what is rounding."""

    seen: float = setting(
        1e-3, "1", "of a channel of size 1: a sensor fault that changes less is none", CHOSEN
    )
    undone: float = setting(
        1e-3,
        "1",
        "of a channel of size 1: error that undoing a fault may leave",
        "derived: a shift in time reads between rows 0.5 ms apart",
    )
    widest: float = setting(
        0.1, "1", "a figure less certain than this is a parameter to fit, no tolerance", CHOSEN
    )
    nothing: float = setting(
        1e-9,
        "1",
        "slope of the residual below which a figure has no influence",
        "derived: far above rounding errors, far below what matters",
    )
    power: float = setting(1e-6, "W", "rounding of a dissipated power", CHOSEN)
