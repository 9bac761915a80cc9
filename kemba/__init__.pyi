from kemba.api.learning import adopt as adopt
from kemba.api.learning import compare as compare
from kemba.api.learning import discover as discover
from kemba.api.learning import learn as learn
from kemba.api.planning import load_log as load_log
from kemba.api.planning import load_model as load_model
from kemba.api.planning import load_task as load_task
from kemba.api.planning import plan as plan
from kemba.api.planning import simulate as simulate
from kemba.ocp.mpcc.solve import solve_mpcc as solve_mpcc

__version__: str
