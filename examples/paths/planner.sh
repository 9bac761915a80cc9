#!/bin/sh
# A planner: from an empty folder to a plan of one's own, looked at and exported.
set -eu
kemba-opt solve jump.yaml --out first
kemba-opt plot                                        # the newest run
cat > mine.yaml <<'TASK'
name: mine
model: planning
height: 0.48 m
supply: 0.72 MPa
TASK
kemba-opt check mine.yaml
kemba-opt solve jump.yaml --set "height=0.48 m" --set "supply=0.72 MPa" --out second
kemba-opt simulate second --repeat 2 --noise --out logs
kemba-opt report second
kemba-opt view second
kemba-opt export second --out second.mcap
kemba-opt plot first second --save both.png
test -s both.png -a -s second.mcap -a -s second/report.html -a -s second/view.html
