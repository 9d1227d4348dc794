#!/bin/sh
# All steps of the sweeps, then the figure.      tests/stability/hao/stability.sh [OUT-FOLDER]
# Writes stability_hao.csv and stability_hao.png; the default folder is this one.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-$here}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

status=0
"$here/../../../build/tests/stability/hao" --write "$work" || status=$? # what failed shows in the figure as well
gnuplot -e "csv='$work/stability_hao.csv'; png='$work/stability_hao.png'" "$here/stability.gp"
[ -s "$work/stability_hao.png" ] || { echo "stability.sh: gnuplot drew nothing" >&2; exit 1; }
mkdir -p "$out"
cp "$work/stability_hao.csv" "$work/stability_hao.png" "$out/"
exit $status
