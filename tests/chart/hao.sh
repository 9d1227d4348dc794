#!/bin/sh
# Repeats the measurements of Hao and Varshney 2004, then writes and draws what came out.
#   tests/chart/hao.sh [OUT-FOLDER [options of build/tests/chart/hao...]]
# figure5.csv, figure9.csv, numbers.csv, table1.csv, bars.csv, README.md with the tables beside the paper's, figure5.png
# and figure9.png. The default folder is tests/chart/hao. --quick: to see that it runs. --dragon: the paper's dragon,
# too, which takes minutes. SSS_MODELS: the folder with horse_14k_v.glb, ../shared/models if unset. What is named
# (figure5, table1 ...) is measured anew; the rest of the folder stays as it is. --draw in first place measures nothing.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
top=$here/../..
draw=0
if [ "${1:-}" = --draw ]; then draw=1; shift; fi
out=${1:-$here/hao}
[ $# = 0 ] || shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

mkdir -p "$out"
cp "$out"/*.csv "$work/" 2>/dev/null || true
[ $draw = 1 ] || (cd "$top" && build/tests/chart/hao "$work" "$@")
sh "$here/hao/tables.sh" "$work" >"$work/README.md"
for figure in figure5 figure9; do
    gnuplot -e "work='$work'" "$here/hao/$figure.gp"
    [ -s "$work/$figure.png" ] || { echo "hao.sh: gnuplot drew nothing" >&2; exit 1; }
done
cp "$work"/*.csv "$work"/*.png "$work/README.md" "$out/"
