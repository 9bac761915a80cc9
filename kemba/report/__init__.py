"""What verbs write: run folders filled with results, certificates and figures."""

from kemba.report.best import Approach
from kemba.report.listener import Listener
from kemba.report.solving import solve_into

__all__ = ["Approach", "Listener", "solve_into"]
