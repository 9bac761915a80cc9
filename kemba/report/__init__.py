"""What verbs write: run folders filled with results, certificates and figures.

Imported when first asked for: who only reviews logs needs no optimiser.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kemba.report.best import Approach
    from kemba.report.listener import Listener
    from kemba.report.solving import solve_into

__all__ = ["Approach", "Listener", "solve_into"]

_HOMES = {"Approach": "best", "Listener": "listener", "solve_into": "solving"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'kemba.report' has no attribute '{name}'")
    return getattr(import_module(f"kemba.report.{_HOMES[name]}"), name)
