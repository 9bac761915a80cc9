"""What verbs write: run folders filled with results, certificates and figures.

Imported when first asked for: who only reviews logs needs no optimiser.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kemba.report.solving import solve_into

__all__ = ["solve_into"]


def __getattr__(name: str) -> Any:
    if name != "solve_into":
        raise AttributeError(f"module 'kemba.report' has no attribute '{name}'")
    from kemba.report.solving import solve_into

    return solve_into
