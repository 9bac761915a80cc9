#!/usr/bin/env bash
# Crocoddyl beside the Pinocchio that pip chooses for it: no gravity, no inertia, and "solved".
#
# Guess, written before the run: wheels that do not fit refuse to install or to import, as C++
# libraries miss a symbol; what imports computes.
#
# Seen: `pip install crocoddyl` gives crocoddyl 3.2.1 and pin 4.1.0, whose version its wheel leaves
# open, and both import. Accelerations of the free forward dynamics are then never written: 1e-310,
# or whatever was in memory, for any robot. A robot in free fall stays where it is, and `SolverDDP`
# and `SolverFDDP` both end after one iteration with True, no gaps, no torque, hovering 1 m above
# the ground; a rollout agrees. With pin 4.0.0 the acceleration is -9.81 m/s2, and it falls by
# 1.25 m in half a second.
#
# Why it matters: nothing fails, costs are tiny, and only a look at the motion shows it. Check one
# acceleration against `pinocchio.aba` first, and pin both versions.
#
# Read: the requirements of both wheels; Crocoddyl's documentation of the dynamics and the solvers.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat > "$work/fall.py" <<'EOF'
import crocoddyl
import numpy as np
import pinocchio as pin

model = pin.Model()
base = pin.JointModelComposite(pin.JointModelPX())
base.addJoint(pin.JointModelPZ())
base.addJoint(pin.JointModelRY())
model.addJoint(0, base, pin.SE3.Identity(), "root_joint")
model.appendBodyToJoint(1, pin.Inertia(5.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
hip = model.addJoint(1, pin.JointModelRY(), pin.SE3.Identity(), "hip")
leg = pin.Inertia(0.5, np.array([0.0, 0.0, -0.1]), 0.01 * np.eye(3))
model.appendBodyToJoint(hip, leg, pin.SE3.Identity())

state = crocoddyl.StateMultibody(model)
motors = crocoddyl.ActuationModelFloatingBase(state)
start = state.zero()
start[1] = 1.0  # m above the ground
stay = crocoddyl.CostModelSum(state, motors.nu)
rows = {"x": crocoddyl.ResidualModelState(state, start, motors.nu)}
rows["u"] = crocoddyl.ResidualModelControl(state, motors.nu)
for name, weight in (("x", 1e3), ("u", 1e-6)):
    stay.addCost(name, crocoddyl.CostModelResidual(state, rows[name]), weight)
free = crocoddyl.DifferentialActionModelFreeFwdDynamics(state, motors, stay)
data = free.createData()
free.calc(data, start, np.zeros(motors.nu))
true = pin.aba(model, model.createData(), start[: model.nq], start[model.nq :], np.zeros(model.nv))
print(f"crocoddyl {crocoddyl.__version__}, pin {pin.__version__}")
print(f"  falls with {data.xout[1]:.4g} m/s2; pinocchio.aba says {true[1]:.4g}")
step, end = (crocoddyl.IntegratedActionModelEuler(free, dt) for dt in (0.01, 0.0))
solver = crocoddyl.SolverFDDP(crocoddyl.ShootingProblem(start, [step] * 50, end))
done = solver.solve([start] * 51, [np.zeros(motors.nu)] * 50, 100)
height = float(solver.xs[-1][1])
print(f"  FDDP: {done} after {solver.iter} iteration(s), {height:.2f} m high after 0.5 s")
wrong = abs(data.xout[1] + 9.81) > 1.0 and abs(height - 1.0) < 1e-3
raise SystemExit(0 if wrong else 7 if abs(data.xout[1] + 9.81) < 1e-6 and height < 0.0 else 1)
EOF
code() {
  python3 -m venv --clear "$work/venv"
  "$work/venv/bin/pip" install --quiet crocoddyl==3.2.1 "pin==$1" numpy==2.4.6
  local found=0
  "$work/venv/bin/python" "$work/fall.py" || found=$?
  [ "$found" = "$2" ] || { echo "changed: pin $1 with crocoddyl 3.2.1"; exit 1; }
}
code 4.1.0 0
code 4.0.0 7
