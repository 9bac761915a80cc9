"""Who is told how a plan is made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from kemba.ocp.nlp.watcher import Watch
from kemba.stopwatch import Tell, silent


@dataclass(frozen=True)
class Listener:
    """What is called at each stage and iteration, and what may ask to stop."""

    tell: Tell = silent
    watch: Watch | None = None
    stop: Callable[[], bool] | None = None
