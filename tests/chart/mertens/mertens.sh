#!/bin/sh
# Repeats the paper's experiments, then writes and draws what came out.
#   tests/chart/mertens/mertens.sh [OUT-FOLDER [options of build/tests/chart/mertens...]]
# table3.csv to table5.csv, figure3.csv, figure4.csv, README.md with the tables beside the paper's, figure3.png and
# figure4.png. The default folder is this one. SSS_MODELS: the folder with horse_8764_t.glb, ../shared/models if unset.
# --draw in first place: measures nothing.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
top=$here/../../..
draw=0
if [ "${1:-}" = --draw ]; then draw=1; shift; fi
out=${1:-$here}
[ $# = 0 ] || shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
models=${SSS_MODELS:-$top/../shared/models}
[ -d "$models" ] || models=none

if [ $draw = 1 ]; then cp "$out"/*.csv "$work/"
else "$top/build/tests/chart/mertens" "$work" --models "$models" "$@"
fi
sh "$here/tables.sh" "$work" >"$work/README.md"
for figure in figure3 figure4; do
    gnuplot -e "work='$work'" "$here/$figure.gp"
    [ -s "$work/$figure.png" ] || { echo "mertens.sh: gnuplot drew nothing" >&2; exit 1; }
done
mkdir -p "$out"
cp "$work"/*.csv "$work"/*.png "$work/README.md" "$out/"
