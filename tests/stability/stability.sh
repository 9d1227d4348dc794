#!/bin/sh
# All steps of the sweeps, the figures, and what follows from them.
#   tests/stability/stability.sh [--draw] [--out FOLDER] [METHOD ...]      methods: direct bem hao, all by default
# Writes METHOD/stability_METHOD.csv and .png beside this script, then the table of README.md and the lines of the
# headers' LIMITS that are made from them (limits.sh). With --draw nothing is swept: figures, table and lines from the
# csv files that are there. With --out only FOLDER/stability_METHOD.csv and .png.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out= draw=
while :; do
    case ${1:-} in
    --draw) draw=1; shift ;;
    --out) out=${2:?a folder}; shift 2 ;;
    *) break ;;
    esac
done
[ $# -gt 0 ] || set -- direct bem hao
for method in "$@"; do
    case $method in
    direct | bem | hao) ;;
    *) echo "stability.sh: no method $method: direct, bem, hao" >&2; exit 2 ;;
    esac
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

status=0
for method in "$@"; do
    to=${out:-$here/$method}
    mkdir -p "$to"
    csv=$work/stability_$method.csv
    if [ -n "$draw" ]; then cp "$here/$method/stability_$method.csv" "$csv"
    else "$here/../../build/tests/stability/$method" --write "$work" || status=$?; fi # what failed is drawn as well
    gnuplot -e "method='$method'; here='$here'; csv='$csv'; png='$work/stability_$method.png'" "$here/figure.gp"
    [ -s "$work/stability_$method.png" ] || { echo "stability.sh: gnuplot drew nothing" >&2; exit 1; }
    cmp -s "$csv" "$to/stability_$method.csv" || cp "$csv" "$to/"
    cp "$work/stability_$method.png" "$to/"
done
[ -n "$out" ] || sh "$here/limits.sh" --write
exit $status
