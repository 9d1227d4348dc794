#!/bin/sh
# Draws frame time against error from a chart.csv: a panel per case, a curve per method, the Pareto front as a step, the
# model's own error as a vertical line with its band.      tests/chart/draw.sh IN.csv OUT.svg|OUT.png...
set -eu
here=$(cd "$(dirname "$0")" && pwd)
csv=$1
shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Splits the lines into one file per panel and curve, in the order of the runs, and one per panel with its front. Lists
# of panels, curves and model errors go to gnuplot.
awk -F, -v work="$work" -f "$here/front.awk" -f "$here/draw.awk" "$csv"
for points in "$work"/*-pareto.points; do sort -g "$points" -o "$points"; done
for picture in "$@"; do
    gnuplot -e "work='$work'; picture='$work/picture'; kind='${picture##*.}'" "$here/chart.gp"
    [ -s "$work/picture" ] || { echo "draw.sh: gnuplot drew nothing" >&2; exit 1; }
    mkdir -p "$(dirname "$picture")"
    # Curves are titled after their files: where these lay is nobody's business, and differs from run to run.
    case $picture in *.svg) sed -i "s#$work/##g" "$work/picture" ;; esac
    mv "$work/picture" "$picture"
done
