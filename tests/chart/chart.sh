#!/bin/sh
# Measures the chart, then draws it.      tests/chart/chart.sh [OUT-FOLDER [measure's options...]]
# CASE and METHOD in the environment are patterns of the shell: only what they match is measured, and takes the place
# of its lines; the rest of chart.csv stays. Writes chart.csv, chart.svg, chart.png and chart.md. The default folder is
# this one; README.md's tables are then written too. A case that fails is reported, the others go on; the status is 1
# then.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-$here}
[ $# = 0 ] || shift
top=$(cd "$here/../.." && pwd)
measure=$top/build/tests/chart/measure
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cases=${CASE:-*}
methods=${METHOD:-*}
started=$(date +%s)
failed=''

cd "$top" # build/models
selected=$("$measure" --methods "$methods")
[ -n "$selected" ] || { echo "chart.sh: there is no method $methods" >&2; exit 1; }
[ -n "$("$measure" --cases "$cases")" ] || { echo "chart.sh: there is no case $cases" >&2; exit 1; }
for name in $("$measure" --cases "$cases"); do
    "$measure" "$work/part.csv" --case "$name" --method "$methods" "$@" || failed="$failed $name"
    [ -s "$work/new.csv" ] || head -n 1 "$work/part.csv" >"$work/new.csv"
    sed 1d "$work/part.csv" >>"$work/new.csv"
    rm -f "$work/part.csv"
done

# What is there stays only if it has the same columns.
head -n 1 "$work/new.csv" >"$work/old.csv"
if [ -f "$out/chart.csv" ]; then
    if [ "$(head -n 1 "$out/chart.csv")" = "$(head -n 1 "$work/new.csv")" ]; then
        cp "$out/chart.csv" "$work/old.csv"
    else
        echo "chart.sh: $out/chart.csv has other columns: its lines are dropped" >&2
    fi
fi
awk -F, -v cases="$("$measure" --cases | tr '\n' ' ')" -v methods="$("$measure" --methods | tr '\n' ' ')" \
    -v selected="$(echo "$selected" | tr '\n' ' ')" -f "$here/front.awk" -f "$here/merge.awk" \
    "$work/new.csv" "$work/old.csv" >"$work/chart.csv"
mkdir -p "$out"
cp "$work/chart.csv" "$out/chart.csv"
sh "$here/draw.sh" "$out/chart.csv" "$out/chart.svg" "$out/chart.png"
sh "$here/markdown.sh" "$out/chart.csv" >"$work/chart.md"
cp "$work/chart.md" "$out/chart.md"
[ "$out" != "$here" ] || sh "$here/table.sh" --write
echo "chart.sh: $(($(date +%s) - started)) s$([ -z "$failed" ] || echo "; FAILED:$failed")"
[ -z "$failed" ]
