#!/usr/bin/env bash
# Fits a case, then compares the fitted values with a record that the fit has not seen.
#
#     fit_then_validate.sh CASE RECORD [RESULTS [OPTION ...]]
#
# RECORD is a further test of the same unit; its step is found in it. RESULTS (default: runs) gets
# the folders fit and validate. Every OPTION goes to `exfit fit`. Exit code: 0 if the fit matches
# and the record is accepted, 3 if not, 1 if the case or the record cannot be used.
set -euo pipefail

if [ $# -lt 2 ] || [ ! -f "$1" ] || [ ! -f "$2" ]; then
    echo "usage: ${0##*/} CASE RECORD [RESULTS [OPTION ...]]" >&2
    exit 2
fi
file=$1
record=$2
results=${3:-runs}
shift $(($# < 3 ? 2 : 3))

code=0
exfit fit "$file" --no-plots --quiet -o "$results/fit" "$@" || code=$?
case $code in
    0) echo "the fit matches" ;;
    3)
        echo "the fit does not match, so there is nothing to validate:" >&2
        exfit show "$results/fit" >&2
        exit 3
        ;;
    *) exit "$code" ;;
esac

compared=$(exfit validate "$file" --parameters "$results/fit/parameters.yaml" --record "$record" \
    --json --no-plots -o "$results/validate") || code=$?
case $code in
    0 | 3) ;;
    *) exit "$code" ;;
esac
python3 -c '
import json, sys
for match in json.load(sys.stdin)["validation"]:
    errors = ", ".join(
        "{}: rmse {:.3g} pu".format(*pair)
        for pair in ((name, each["rmse"]) for name, each in match["channels"].items())
    )
    print(match["record"], errors, "accepted" if match["accepted"] else match["reason"], sep="; ")
' <<<"$compared"
exit "$code"
