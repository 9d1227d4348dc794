#!/bin/sh
# Fits the curves of sss_dipole_needs to the chart.      tests/chart/choice/fit.sh [--write | --check] [CHART.csv]
# Prints the lines between the markers "measured curves" of sss_dipole.h; --write puts them there, builds the choice
# anew and writes choice.csv, what is then chosen, summary.csv, and what LIMITS says of it ("measured choices"); --check
# says whether both are there.
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
# The header with FILE between its markers "measured WHAT".
put() # what, file, header
{
    awk -v begin="// ---- BEGIN measured $1" -v end="// ---- END measured $1" -v file="$2" -f "$top/tests/between.awk" \
        "$3" || { echo "$header: no markers of measured $1" >&2; exit 1; }
}

# What LIMITS says of the choices, from summary.csv.
choices()
{
    awk -F, 'NR > 1 { asked[$2] += $3; within[$2] += $4; cheap[$2] += $5 }
        END {
            all = "all cases"
            others = "the other cases"
            printf "//   * Of %d choices on the chart (tests/chart/choice: summary.csv; every choice: choice.csv)\n",
                   asked[all]
            printf "//     %d keep the tolerance, and %d cost at most 1.5 times the cheapest that does. With their\n",
                   within[all], cheap[all]
            printf "//     case left out of the fit %d and %d do.\n", within[others], cheap[others]
        }' tests/chart/choice/summary.csv
}

put curves "$work/curves" "$header" >"$work/header"
if [ $do = --check ]; then
    choices >"$work/choices"
    put choices "$work/choices" "$work/header" >"$work/whole"
    diff "$header" "$work/whole"
else
    cmp -s "$header" "$work/header" || cp "$work/header" "$header"
    make -s build/tests/chart/choice
    build/tests/chart/choice list "$csv" >tests/chart/choice/choice.csv
    build/tests/chart/choice summary "$csv" >tests/chart/choice/summary.csv
    choices >"$work/choices"
    put choices "$work/choices" "$header" >"$work/whole"
    cmp -s "$header" "$work/whole" || cp "$work/whole" "$header"
fi
