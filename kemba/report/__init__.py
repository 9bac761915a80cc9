"""What verbs write: run folders filled with results, certificates and figures."""

from kemba.report.solving import Listener, solve_into

__all__ = ["Listener", "solve_into"]
