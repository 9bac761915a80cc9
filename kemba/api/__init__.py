"""The library: what `import kemba` offers, each function as the verb of the same name."""

from kemba.api.learning import Compared, Discovered, Learned, adopt, compare, discover, learn
from kemba.api.planning import Executions, Planned, load_log, load_model, load_task, plan, simulate
from kemba.ocp.mpcc.solve import MpccSolution, solve_mpcc

__all__ = [
    "Compared",
    "Discovered",
    "Executions",
    "Learned",
    "MpccSolution",
    "Planned",
    "adopt",
    "compare",
    "discover",
    "learn",
    "load_log",
    "load_model",
    "load_task",
    "plan",
    "simulate",
    "solve_mpcc",
]
