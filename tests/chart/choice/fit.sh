#!/bin/sh
# Fits the curves of sss_dipole_needs to the chart.      tests/chart/choice/fit.sh [--write | --check] [CHART.csv]
# Prints the lines between the markers "measured curves" of sss_dipole.h; --write puts them there, builds the choice
# anew and writes choice.csv, what is then chosen, and summary.csv; --check says whether they are there.
# build/tests/chart/choice must be built.
set -eu
top=$(cd "$(dirname "$0")/../../.." && pwd)
do=print
case ${1:-} in --write | --check) do=$1; shift ;; esac
csv=$(realpath "${1:-$top/tests/chart/chart.csv}")
header=$top/sss_dipole.h
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cd "$top" # tests/chart/choice/meshes.csv: build/tests/chart/choice meshes writes it
"$top/build/tests/chart/choice" fit "$csv" >"$work/curves"
if [ $do = print ]; then
    cat "$work/curves"
    exit
fi
awk -v curves="$work/curves" '
    /^\/\/ ---- END measured curves ----/ { inside = 0; ends++ }
    !inside
    /^\/\/ ---- BEGIN measured curves/ { inside = 1; begins++; while ((getline line < curves) > 0) print line }
    END { exit begins != 1 || ends != 1 }' "$header" >"$work/header" || { echo "$header: no markers" >&2; exit 1; }
if [ $do = --check ]; then
    diff "$header" "$work/header"
else
    cmp -s "$header" "$work/header" || cp "$work/header" "$header"
    make -s build/tests/chart/choice
    build/tests/chart/choice list "$csv" >tests/chart/choice/choice.csv
    build/tests/chart/choice summary "$csv" >tests/chart/choice/summary.csv
fi
