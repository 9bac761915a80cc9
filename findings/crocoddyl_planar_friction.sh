#!/usr/bin/env bash
# Crocoddyl's friction cone, used for a robot in a plane: a foot may push with 0.71 mu only.
#
# Guess, written before the run: `FrictionCone(R, mu)` has four facets, two of them across the plane
# of motion, so in that plane it is exact: |F_x| <= mu F_z.
#
# Seen (crocoddyl 3.2.1): the pyramid lies inside the cone unless `inner_appr=False` is given, so
# that each facet is at mu cos(pi/4), and the facets stand across x and y. Along x and y, the ways
# in which a robot in the plane pushes, mu = 0.7 lets 0.495 through; the 0.7 are reached along the
# diagonals, where it never pushes. `cone.mu` says 0.7. Eight facets let 0.647 through in all of
# these ways; with `inner_appr=False` four and eight facets give 0.7 in the plane.
#
# Why it matters: a planar jump that needs mu = 0.6 on ground with 0.7 has no solution, and pushes
# lean 9 degrees less from the vertical than they may. Nothing in the result points to the cone.
#
# Read: Crocoddyl's documentation of FrictionCone and ResidualModelContactFrictionCone.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet crocoddyl==3.2.1 pin==4.0.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import crocoddyl
import numpy as np

MU = 0.7
print("crocoddyl", crocoddyl.__version__)


def most(cone, degrees):
    """The largest horizontal force at 1 N of normal force in a direction."""
    way = np.radians(degrees)
    across = cone.A @ np.array([np.cos(way), np.sin(way), 0.0])
    room = cone.ub - cone.A @ np.array([0.0, 0.0, 1.0])
    return min(r / a for a, r in zip(across, room) if a > 1e-9)


found = {}
for words, cone in {
    "as it is": crocoddyl.FrictionCone(np.eye(3), MU),
    "8 facets": crocoddyl.FrictionCone(np.eye(3), MU, 8),
    "4 facets, outer": crocoddyl.FrictionCone(np.eye(3), MU, 4, False),
    "8 facets, outer": crocoddyl.FrictionCone(np.eye(3), MU, 8, False),
}.items():
    found[words] = [round(float(most(cone, degrees)), 3) for degrees in (0, 45, 90)]
    print(f"{words:16s} mu {cone.mu}: along x, the diagonal, y", found[words])
seen = {
    "as it is": [0.495, 0.7, 0.495],
    "8 facets": [0.647, 0.647, 0.647],
    "4 facets, outer": [0.7, 0.99, 0.7],
    "8 facets, outer": [0.7, 0.7, 0.7],
}
if found != seen:
    sys.exit("changed: what the cones let through")
EOF
