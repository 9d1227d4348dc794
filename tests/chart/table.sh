#!/bin/sh
# The tables of README.md from chart.csv: every run on the bunny at 50 mm in marble, lit from the front; and, where
# README.md has a place for it, the quickest frame within a tolerance in every case.
#   tests/chart/table.sh           prints them
#   tests/chart/table.sh --write   puts them into README.md between their markers
#   tests/chart/table.sh --check   fails if README.md has others
# The markers are <!-- tests/chart/table.sh: begin -->, end, and <!-- tests/chart/table.sh quickest: begin -->, end.
set -eu
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

one_case()
{
    awk -F, -f tests/chart/front.awk -f tests/chart/table.awk tests/chart/chart.csv
}

quickest()
{
    sh tests/chart/markdown.sh tests/chart/chart.csv | sed -n '/^## The quickest/,/^## [a-z]*-/{/^|/p}'
}

marker() { echo "<!-- tests/chart/table.sh$1: $2 -->"; }

write() # table's file, suffix of its markers
{
    awk -v begin="$(marker "$2" begin)" -v end="$(marker "$2" end)" -v table="$1" '
        $0 == begin { print; while ((getline line < table) > 0) print line; inside = 1; next }
        $0 == end { inside = 0 }
        !inside' README.md >"$work/readme"
    cat "$work/readme" >README.md
}

check() # as write
{
    awk -v begin="$(marker "$2" begin)" -v end="$(marker "$2" end)" \
        '$0 == end { inside = 0 } inside { print } $0 == begin { inside = 1 }' README.md >"$work/there"
    [ -s "$work/there" ] && diff "$work/there" "$1"
}

one_case >"$work/table"
quickest >"$work/quickest"
has_quickest=$(grep -c -F "$(marker ' quickest' begin)" README.md || true)
case ${1:-} in
    --write)
        write "$work/table" ''
        [ "$has_quickest" = 0 ] || write "$work/quickest" ' quickest' ;;
    --check)
        check "$work/table" ''
        [ "$has_quickest" = 0 ] || check "$work/quickest" ' quickest' ;;
    *)  cat "$work/table" "$work/quickest" ;;
esac
