from kemba.api import adopt as adopt
from kemba.api import compare as compare
from kemba.api import discover as discover
from kemba.api import learn as learn
from kemba.api import load_log as load_log
from kemba.api import load_model as load_model
from kemba.api import load_task as load_task
from kemba.api import plan as plan
from kemba.api import simulate as simulate
from kemba.api import solve_mpcc as solve_mpcc

__version__: str
