"""A jump without hold, clearance or a bound on impacts: quick to plan, whatever is shipped."""

from pathlib import Path

TASK = """\
name: plain
model: planning
height: 0.35 m
supply: 0.7 MPa
payload: 0 kg
duration: 0.6 s
nodes: 100
step_variation: 20 %

start:
  rest: true
  body/x: 0 m
  body/pitch: 0 deg
  "*/foot/z": 0 m
  "*/piston/x": 0 m
  settled: true
end:
  rest: true
  body/x: 0 m
  body/pitch: 0 deg
  "*/foot/z": 0 m
  "*/piston/x": 0 m
  "*/valve/*": 0
bounds:
  body/z: {at_most: height}
  "*/knee/z": {at_least: 3 cm}
  "*/hip/z": {at_least: 3 cm}
goals:
  apex: {quantity: body/z, at: middle, equals: height}
cost:
  torque_squared: 1
method: relaxation
"""


def plain_task(folder: Path) -> Path:
    """The task as a file in `folder`."""
    file = folder / "plain.yaml"
    file.write_text(TASK, encoding="utf-8")
    return file
