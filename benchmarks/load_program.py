"""Load a program of `kemba-opt export --nlp`; needs CasADi only (benchmarks/pages/plan-quality.md).

Usage: python benchmarks/load_program.py nlp/refined.casadi
"""

import json
import sys
from pathlib import Path

import casadi as ca


def load(path):
    """The program for `casadi.nlpsol`, its exact derivatives, and the arguments of a solve."""
    file = ca.FileDeserializer(str(path))
    facts = json.loads(Path(path).with_suffix(".json").read_text(encoding="utf-8"))
    found = {name: file.unpack() for name in facts["functions"]}
    x, p = (ca.MX.sym(name, found["nlp"].numel_in(i)) for i, name in enumerate("xp"))
    f, g = found.pop("nlp")(x, p)
    ends = {"lbx": -ca.inf, "lbg": -ca.inf, "ubx": ca.inf, "ubg": ca.inf}
    at = {k: [end if v is None else v for v in facts[k]] for k, end in ends.items()}
    return {"x": x, "p": p, "f": f, "g": g}, found, {**at, "x0": facts["x0"], "p": facts["p"]}


if __name__ == "__main__":
    nlp, derivatives, arguments = load(sys.argv[1])
    solver = ca.nlpsol("solver", "ipopt", nlp, derivatives)
    print(solver(**arguments)["f"])
