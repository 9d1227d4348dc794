#!/bin/sh
# Measures everything anew, then draws.      tests/chart/chart.sh [OUT-FOLDER [measure's options...]]
# Writes chart.csv, with a first line that names the columns, and chart.png. The default folder is this one; README.md's
# table is then written too.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-$here}
[ $# = 0 ] || shift
top=$here/../..
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

columns=method,mesh,vertices,triangles,size_mm,material,light,parameters,threads,precompute_s,frame_ms,bytes
echo "$columns,rel_l2,rel_max,image_rmse,reference" >"$work/chart.csv"
"$top/build/tests/chart/measure" "$work/chart.csv" "$@"
mkdir -p "$out"
cp "$work/chart.csv" "$out/chart.csv"
sh "$here/draw.sh" "$out/chart.csv" "$out/chart.png"
[ "$out" != "$here" ] || sh "$here/table.sh" --write
