"""The library: what `import kemba` offers, each function as the verb of the same name."""

from kemba.api.executions import Executions, simulate
from kemba.api.learning import Compared, Discovered, compare, discover
from kemba.api.loading import load_log, load_model, load_task
from kemba.api.planning import Planned, plan
from kemba.ocp.mpcc.solve import MpccSolution, solve_mpcc

__all__ = [
    "Compared",
    "Discovered",
    "Executions",
    "MpccSolution",
    "Planned",
    "compare",
    "discover",
    "load_log",
    "load_model",
    "load_task",
    "plan",
    "simulate",
    "solve_mpcc",
]
