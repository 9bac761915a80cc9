#!/bin/sh
# An identifier: someone else's logs, in their own columns, to a reviewed answer. Four commands;
# each says the next. `their_log_1.csv` to `their_log_3.csv` are made by make_their_logs.py.
set -eu

# Run a command that must end by saying the verb $1 as the next one.
leads_to() {
    verb=$1
    shift
    "$@" 2> said.txt || { cat said.txt; exit 1; }
    grep -q "next:.*kemba-opt $verb" said.txt || { cat said.txt; exit 1; }
}

[ -e their_log_3.csv ] || python "$(dirname "$0")/make_their_logs.py"
leads_to check kemba-opt map their_log_1.csv --out map.yaml
leads_to discover kemba-opt check their_log_1.csv their_log_2.csv their_log_3.csv --map map.yaml
leads_to review kemba-opt discover their_log_1.csv their_log_2.csv their_log_3.csv \
    --map map.yaml --out answer
leads_to solve kemba-opt review their_log_1.csv --map map.yaml --answer answer --out review.html
grep -q seal_friction answer/answer.json
test -s review.html
