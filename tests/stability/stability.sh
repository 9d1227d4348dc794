#!/bin/sh
# All steps of the sweeps, the figures, and what follows from them.
#   tests/stability/stability.sh [--out FOLDER] [METHOD ...]      methods: direct bem hao, all of them by default
# Writes METHOD/stability_METHOD.csv and .png beside this script, then the table of README.md and the lines of the
# headers' LIMITS that are made from them (limits.sh); with --out only FOLDER/stability_METHOD.csv and .png.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=
if [ "${1:-}" = --out ]; then out=$2; shift 2; fi
[ $# -gt 0 ] || set -- direct bem hao
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

status=0
for method in "$@"; do
    to=${out:-$here/$method}
    mkdir -p "$to"
    "$here/../../build/tests/stability/$method" --write "$work" || status=$? # what failed shows in the figure as well
    gnuplot -e "method='$method'; here='$here'; csv='$work/stability_$method.csv'; png='$work/stability_$method.png'" \
        "$here/figure.gp"
    [ -s "$work/stability_$method.png" ] || { echo "stability.sh: gnuplot drew nothing" >&2; exit 1; }
    cp "$work/stability_$method.csv" "$work/stability_$method.png" "$to/"
done
[ -n "$out" ] || sh "$here/limits.sh" --write
exit $status
