"""One loop that solves: starts x repairs, each trial executed, judged and scored.

Imported when first asked for: who only reviews logs needs no optimiser.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kemba.solve.loop import Approach, Listener, best_plan

__all__ = ["Approach", "Listener", "best_plan"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'kemba.solve' has no attribute '{name}'")
    return getattr(import_module("kemba.solve.loop"), name)
