"""One loop that solves: starts x repairs, each trial executed, judged and scored.

Imported when first asked for: who only reviews logs needs no optimiser.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kemba.solve.listener import Listener
    from kemba.solve.loop import Approach, best_plan

__all__ = ["Approach", "Listener", "best_plan"]

_HOMES = {"Approach": "loop", "best_plan": "loop", "Listener": "listener"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'kemba.solve' has no attribute '{name}'")
    return getattr(import_module(f"kemba.solve.{_HOMES[name]}"), name)
