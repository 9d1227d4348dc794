#!/bin/sh
# All steps of the sweeps, then the figure.      tests/stability/stability.sh [OUT-FOLDER]
# Writes stability_bem.csv and stability_bem.png; the default folder is this one.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-$here}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

status=0
"$here/../../build/tests/stability/stability" --write "$work" || status=$? # what failed shows in the figure as well
gnuplot -e "csv='$work/stability_bem.csv'; png='$work/stability_bem.png'" "$here/stability.gp"
[ -s "$work/stability_bem.png" ] || { echo "stability.sh: gnuplot drew nothing" >&2; exit 1; }
mkdir -p "$out"
cp "$work/stability_bem.csv" "$work/stability_bem.png" "$out/"
exit $status
