#!/usr/bin/env bash
# Fits every case (*.yaml) in a folder, and sorts the cases by the exit code of their fit.
#
#     fit_all.sh FOLDER [RESULTS [OPTION ...]]
#
# Each fit has a folder in RESULTS (default: runs). Every OPTION goes to `exfit fit`, for example
# --search local. Exit code: 0 if all cases match, 3 if some do not, 1 if some cannot be used.
set -euo pipefail

if [ $# -lt 1 ] || [ ! -d "$1" ]; then
    echo "usage: ${0##*/} FOLDER [RESULTS [OPTION ...]]" >&2
    exit 2
fi
folder=$1
results=${2:-runs}
shift $(($# < 2 ? 1 : 2))

worst=0
for file in "$folder"/*.yaml; do
    [ -e "$file" ] || { echo "$folder: no case (*.yaml)" >&2; exit 1; }
    name=$(basename "$file" .yaml)
    code=0
    result=$(exfit fit "$file" --json --no-plots -o "$results/$name" "$@") || code=$?
    case $code in
        0 | 3)
            verdict=$(python3 -c '
import json, sys
verdict = json.load(sys.stdin)["verdict"]
print(verdict["verdict"], *filter(None, [verdict["reason"]]), sep=": ")' <<<"$result")
            ;;
        1) verdict="not fitted, for the reason above" ;;
        *) exit "$code" ;; # wrong usage, or Ctrl-C
    esac
    printf '%-20s %s\n' "$name" "$verdict"
    if [ "$code" -eq 1 ] || [ "$worst" -eq 0 ]; then worst=$code; fi
done
exit "$worst"
