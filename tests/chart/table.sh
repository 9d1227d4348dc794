#!/bin/sh
# The tables of README.md from chart.csv: every run on the bunny at 50 mm in marble, lit from the front; and which
# header is the cheapest within a tolerance, by what changes.
#   tests/chart/table.sh           prints them
#   tests/chart/table.sh --write   puts them into README.md between their markers
#   tests/chart/table.sh --check   fails if README.md has others
set -eu
cd "$(dirname "$0")/../.."

one_case() { awk -F, -f tests/chart/front.awk -f tests/chart/table.awk tests/chart/chart.csv; }
which() { awk -F, -f tests/chart/which.awk tests/chart/chart.csv; }

case ${1:-} in
    --write | --check)
        one_case | sh tests/chart/marked.sh README.md tests/chart/table.sh "$1"
        which | sh tests/chart/marked.sh README.md "tests/chart/table.sh which" "$1" ;;
    *)
        one_case
        which ;;
esac
