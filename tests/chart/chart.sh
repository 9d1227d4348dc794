#!/bin/sh
# Measures the chart, then draws it.      tests/chart/chart.sh [OUT-FOLDER [measure's options...]]
# CASE and METHOD in the environment are patterns of the shell: only what they match is measured, and takes the place
# of its lines; the rest of chart.csv stays. Writes chart.csv, chart.svg, chart.png and chart.md. The default folder is
# this one; README.md's tables are then written too. A case that fails is reported, the others go on; the status is 1
# then. chart.csv is written after each case, so that a run that is interrupted loses none but the one at work. A run
# of all of it leaves its time in chart.time, for chart.md.
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
failed='' count=0

# Lines of the part take the place of old ones. What is there stays only if it has the same columns.
merge()
{
    head -n 1 "$work/part.csv" >"$work/old.csv"
    if [ -f "$out/chart.csv" ]; then
        if [ "$(head -n 1 "$out/chart.csv")" = "$(head -n 1 "$work/part.csv")" ]; then
            cp "$out/chart.csv" "$work/old.csv"
        else
            echo "chart.sh: $out/chart.csv has other columns: its lines are dropped" >&2
        fi
    fi
    awk -F, -v cases="$("$measure" --cases | tr '\n' ' ')" -v methods="$("$measure" --methods | tr '\n' ' ')" \
        -v selected="$(echo "$selected" | tr '\n' ' ')" -f "$here/front.awk" -f "$here/merge.awk" \
        "$work/part.csv" "$work/old.csv" >"$work/chart.csv"
    cp "$work/chart.csv" "$out/chart.csv"
}

out=$(mkdir -p "$out" && cd "$out" && pwd)
cd "$top" # build/models
selected=$("$measure" --methods "$methods")
[ -n "$selected" ] || { echo "chart.sh: there is no method $methods" >&2; exit 1; }
[ -n "$("$measure" --cases "$cases")" ] || { echo "chart.sh: there is no case $cases" >&2; exit 1; }
for name in $("$measure" --cases "$cases"); do
    rm -f "$work/part.csv"
    "$measure" "$work/part.csv" --case "$name" --method "$methods" "$@" || failed="$failed $name"
    if [ -f "$work/part.csv" ] && [ "$(wc -l <"$work/part.csv")" -gt 1 ]; then
        merge
        count=$((count + 1))
    fi
done
if [ $count = 0 ]; then
    echo "chart.sh: nothing was measured: ${failed:-all is left out}" >&2
    [ -z "$failed" ]
    exit
fi
seconds=$(($(date +%s) - started))
[ "$cases$methods" != '**' ] || echo "$count cases with all methods in $((seconds / 60)) min" >"$out/chart.time"
sh "$here/draw.sh" "$out/chart.csv" "$out/chart.svg" "$out/chart.png"
sh "$here/markdown.sh" "$out/chart.csv" >"$work/chart.md"
cp "$work/chart.md" "$out/chart.md"
if [ "$out" = "$here" ]; then
    sh "$here/table.sh" --write
    # What sss_dipole_needs predicts stands on all of the chart.
    [ "$cases$methods$failed" != '**' ] || [ ! -f "$here/choice/fit.sh" ] || sh "$here/choice/fit.sh" --write
fi
echo "chart.sh: $count cases in $seconds s$([ -z "$failed" ] || echo "; FAILED:$failed")"
[ -z "$failed" ]
