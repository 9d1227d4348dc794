#!/bin/sh
# The table of README.md for sss_atlas.h: charts, utilisation, distortion and time of every method.
#   tests/chart/atlas.sh MESH.glb...   measures these meshes (build/models/bunny.glb if none is named) at 1024 texels
#                                      into tests/chart/atlas.csv and puts the table into README.md between its markers
#   tests/chart/atlas.sh --print       the table of atlas.csv;  --write  puts it into README.md;  --check  fails if
#                                      README.md has another
set -eu
cd "$(dirname "$0")/../.."
csv=tests/chart/atlas.csv
keys="method triangles size border gutter charts utilisation stretch_l2 area_share_within area_least area_largest
      angle_distortion overlaps texel_area_error core_s"
runs=3 # the quickest counts: the machine may be busy with something else
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

measure() # mesh...
{
    echo mesh $keys | tr ' ' ','
    for mesh in "$@"; do
        for method in orthographic area convex; do
            for run in $(seq $runs); do
                build/atlas "$mesh" --method $method --size 1024 --headless "$work/picture.png" >"$work/said-$run"
            done
            best=$(grep -H '^atlas_core_s=' "$work"/said-* | sort -t= -k2 -g | head -n 1 | cut -d: -f1)
            printf '%s' "$(basename "$mesh" .glb)"
            for key in $keys; do printf ',%s' "$(sed -n "s/^atlas_$key=//p" "$best")"; done
            echo
        done
    done
}

table()
{
    awk -F, '
        NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
        NF > 1 {
            if (!headed++)
            {
                printf "| 1024 x 1024, border 1, gutter 2 | triangles | method | charts | used | L2 stretch |"
                printf " area within a factor of 1.5 | smallest, largest texel | angles | seconds of one core |\n"
                printf "|---|--:|---|--:|--:|--:|--:|--:|--:|--:|\n"
            }
            printf "| %s | %d | %s | %d | %.1f %% | %.3f | %.2f %% | %.2g, %.3g | %.3f | %.2f |\n", $column["mesh"],
                   $column["triangles"], $column["method"], $column["charts"], 100 * $column["utilisation"],
                   $column["stretch_l2"], 100 * $column["area_share_within"], $column["area_least"],
                   $column["area_largest"], $column["angle_distortion"], $column["core_s"]
        }' $csv
}

marked() { table | sh tests/chart/marked.sh README.md tests/chart/atlas.sh "$1"; }

case ${1:-} in
    --print) table ;;
    --write | --check) marked "$1" ;;
    *)
        [ $# -gt 0 ] || set -- build/models/bunny.glb
        measure "$@" >"$work/csv"
        mv "$work/csv" $csv
        marked --write
        table ;;
esac
