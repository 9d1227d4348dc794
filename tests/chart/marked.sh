#!/bin/sh
# A table that stands between two markers of a text.      tests/chart/marked.sh FILE NAME --write|--check <TABLE
# The markers are the lines  <!-- NAME: begin -->  and  <!-- NAME: end -->; --write replaces what lies between them,
# --check fails, with the difference, if it is not the table.
set -eu
file=$1 begin="<!-- $2: begin -->" end="<!-- $2: end -->" work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat >"$work/table"
[ -s "$work/table" ] || { echo "marked.sh: no table of $2" >&2; exit 1; }
[ "$(grep -c -x -F -e "$begin" -e "$end" "$file")" = 2 ] || { echo "marked.sh: $file lacks $begin, $end" >&2; exit 1; }
case $3 in
    --write)
        awk -v begin="$begin" -v end="$end" -v table="$work/table" '
            $0 == begin { print; while ((getline line < table) > 0) print line; inside = 1; next }
            $0 == end { inside = 0 }
            !inside' "$file" >"$work/text"
        cat "$work/text" >"$file" ;;
    --check)
        awk -v begin="$begin" -v end="$end" '$0 == end { inside = 0 } inside { print } $0 == begin { inside = 1 }' \
            "$file" >"$work/there"
        diff "$work/there" "$work/table" ;;
    *) echo "marked.sh: --write or --check" >&2; exit 2 ;;
esac
