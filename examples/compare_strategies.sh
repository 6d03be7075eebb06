#!/usr/bin/env bash
# Compares Gauss-Newton (gn), damped Gauss-Newton (dgn), Levenberg-Marquardt (lm), and lm then dgn.
#
#     compare_strategies.sh [RESULTS [CASE ...]]
#
# The comparison is that of the thesis behind exfit: each strategy alone, from the start of each
# case. The cases are by default those of the thesis: AC1A from four starts, two units with AC8B.
# RESULTS (default: runs/strategies) gets a folder for each fit, fits.csv and fits.png.
# Exit code: 0 if the table was made, 1 if a case cannot be used.
set -euo pipefail

cases=$(cd "$(dirname "$0")/../configs" && pwd)
results=${1:-runs/strategies}
if [ $# -lt 2 ]; then
    set -- "$results" "$cases"/ac1a_{typical,good,low,high}.yaml "$cases"/ac8b_unit{1,2}.yaml
fi
shift

code=0
fits=$(exfit fit "$@" --strategy gn --strategy dgn --strategy lm --strategy lm-then-dgn \
    --json --no-plots -o "$results") || code=$?
case $code in
    0 | 3) ;; # 3: some strategies do not reach a match, which is what the table shows
    *) exit "$code" ;;
esac
python3 -c '
import json, sys
line = "{:<14} {:<12} {:>5} {:>10} {:>12}  {}".format
print(line("case", "strategy", "iter.", "cost f", "simulations", "verdict"))
for run in json.load(sys.stdin)["runs"]:
    fit = run["result"]
    cost = "{:.3e}".format(fit["cost"])
    cells = (fit["strategy"], fit["nit"], cost, fit["simulations"], run["outcome"])
    print(line(run["case_name"], *cells))
' <<<"$fits"
