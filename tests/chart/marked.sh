#!/bin/sh
# A table that stands between two markers of a text.      tests/chart/marked.sh FILE NAME --write|--check <TABLE
# The markers are the lines  <!-- NAME: begin -->  and  <!-- NAME: end -->; --write replaces what lies between them,
# --check fails, with the difference, if it is not the table.
set -eu
file=$1 begin="<!-- $2: begin -->" end="<!-- $2: end -->" work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat >"$work/table"
[ -s "$work/table" ] || { echo "marked.sh: no table of $2" >&2; exit 1; }
awk -v begin="$begin" -v end="$end" -v file="$work/table" -f "$(dirname "$0")/../between.awk" "$file" >"$work/text" ||
    { echo "marked.sh: $file lacks $begin, $end" >&2; exit 1; }
case $3 in
    --write) cat "$work/text" >"$file" ;;
    --check) diff "$file" "$work/text" ;;
    *) echo "marked.sh: --write or --check" >&2; exit 2 ;;
esac
