"""Settings for Newton steps, warm starts and functions."""

from __future__ import annotations

from kemba.settings import Settings, setting

VARIANTS = "tuned: benchmarks/variants.py"


class Newton(Settings):
    """Newton steps, starts and the stagnation test."""

    regularisation: float = setting(
        2e-3, "1", "multiple of the identity in the Hessian of whole robots, per scaled variable; "
        "IPOPT's own additions are 1e-4 to 1", VARIANTS, decides=True,
    )  # fmt: skip
    progress: float = setting(
        0.8, "1", "part of the violation that may be left for a solve to count as progressing",
        "convention: a fall by a fifth", decides=True,
    )  # fmt: skip


class Functions(Settings):
    """How the functions for IPOPT are made."""

    kept: int = setting(
        400, "1", "blocks whose functions are kept for the next program of the process",
        "convention: twice the blocks of all programs of a jump",
    )  # fmt: skip
