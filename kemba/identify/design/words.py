"""Evidence in words."""

from __future__ import annotations


def strength(nats: float) -> str:
    """Evidence in words after Kass and Raftery 1995: 1, 3 and 5 nats are their steps."""
    steps = {5.0: "decisive", 3.0: "strong", 1.0: "weak"}
    return next((word for least, word in steps.items() if nats >= least), "almost no")
