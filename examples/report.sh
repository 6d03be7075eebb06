#!/usr/bin/env bash
# Fits a case and writes the report to hand in: HTML, and PDF where WeasyPrint is installed.
#
#     report.sh CASE [RESULTS [OPTION ...]]
#
# RESULTS (default: runs/NAME-report) gets the files of the fit, report.html and report.pdf. Every
# OPTION goes to `exfit fit`. A fit that does not match has a report, too, which says why.
# Exit code: that of the fit, 0 or 3; 1 if the case cannot be used.
set -euo pipefail

if [ $# -lt 1 ] || [ ! -f "$1" ]; then
    echo "usage: ${0##*/} CASE [RESULTS [OPTION ...]]" >&2
    exit 2
fi
file=$1
results=${2:-runs/$(basename "$file" .yaml)-report}
shift $(($# < 2 ? 1 : 2))

code=0
result=$(exfit fit "$file" --json -o "$results" "$@") || code=$?
case $code in
    0 | 3) ;;
    *) exit "$code" ;;
esac
exfit report "$results" --pdf || exfit report "$results"
python3 -c '
import json, sys
fit = json.load(sys.stdin)
print("verdict:", fit["verdict"]["verdict"])
for cause in fit["verdict"]["causes"]:
    print("cause: {}; {}".format(cause["cause"], cause["remedy"]))
' <<<"$result"
exit "$code"
