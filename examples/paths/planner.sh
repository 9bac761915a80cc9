#!/bin/sh
# A planner: from an empty folder to a plan of one's own, looked at and exported.
set -eu
kemba-opt solve jump.yaml
kemba-opt plot                                        # the newest run: runs/jump-1
cp "$(python -c "from kemba.config import find_config; print(find_config('jump.yaml', 'tasks'))")" mine.yaml
kemba-opt check mine.yaml
kemba-opt solve mine.yaml --set "height=0.48 m" --set "supply=0.65 MPa" --out second
kemba-opt simulate second --repeat 2 --noise --out logs
kemba-opt report second
kemba-opt view second
kemba-opt export second --out second.mcap
kemba-opt plot runs/jump-1 second --save both.png
test -s both.png -a -s second.mcap -a -s second/report.html -a -s second/view.html
