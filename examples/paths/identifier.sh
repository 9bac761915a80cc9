#!/bin/sh
# An identifier: someone else's logs, in their own columns, to a reviewed answer. Four commands;
# each names the next. `their_log_1.csv` to `their_log_3.csv` are made by make_their_logs.py.
set -eu
python "$(dirname "$0")/make_their_logs.py"
kemba-opt map their_log_1.csv --out map.yaml
kemba-opt check their_log_1.csv their_log_2.csv their_log_3.csv --map map.yaml
kemba-opt discover their_log_1.csv their_log_2.csv their_log_3.csv --map map.yaml --out answer
kemba-opt review their_log_1.csv --map map.yaml --answer answer --out review.html
grep -q seal_friction answer/answer.json
test -s review.html
