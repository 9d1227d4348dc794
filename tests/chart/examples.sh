#!/bin/sh
# The tables of README.md for sss_bem.h and sss_hao.h: what the examples and build/bake take on this machine.
#   tests/chart/examples.sh            measures into tests/chart/examples.csv, then as --write; some three minutes
#   tests/chart/examples.sh --print    the tables of examples.csv;  --write  puts them into README.md
#   tests/chart/examples.sh --check    fails if README.md has others
# Times are medians of $runs runs, on all processors.
set -eu
cd "$(dirname "$0")/../.."
csv=tests/chart/examples.csv
runs=5
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

median() { sort -g | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }

# One line of examples.csv for each key of a report that several runs wrote.   group row keys; the files $work/said-*
keep()
{
    for key in $3; do
        value=$(sed -n "s/^$key=//p" "$work"/said-* | median)
        [ -n "$value" ] || { echo "examples.sh: no $key of $1, $2" >&2; exit 1; }
        echo "$1,$2,$key,$value"
    done
    rm -f "$work"/said-*
}

bake() # how often, what build/bake is told
{
    count=$1
    shift
    for run in $(seq "$count"); do
        build/bake build/models/bunny.glb --size-mm 50 --light 0.5,0.6,-0.7 --dump "$work/B.f32" --report "$@" \
            >"$work/said-$run" 2>"$work/log" || { cat "$work/log" >&2; exit 1; }
    done
}

measure()
{
    echo group,row,key,value
    # ---- what deforms: a line of build/bem for each object and mode ----
    for run in $(seq $runs); do build/bem --headless "$work/bem.png"; done >"$work/bem"
    for object in candle cube; do
        for mode in "on the fly" incremental render; do
            for key in move irradiance scatter; do
                value=$(sed -n "s/^$object, .*, $mode: .*$key \([0-9.]*\).*/\1/p" "$work/bem" | median)
                echo "bem,$object,$mode $key,$value"
            done
        done
        echo "bem,$object,triangles,$(sed -n "s/^$object, \([0-9]*\) triangles.*/\1/p" "$work/bem" | head -n 1)"
    done
    bake $runs --method bem --material skimmilk --tolerance 0.01
    keep bem bunny "triangles frame_ms relight_ms irradiance_ms"
    bake 1 --method direct --geometry placed --material skimmilk --tolerance 0.01
    keep bem "bunny direct" frame_ms
    # ---- integrals kept ----
    for storage in references harmonics table float vectors; do
        bake $runs --method hao --material marble --storage $storage --cache "$work/$storage.hao"
        keep hao $storage "bytes_per_vertex relight_ms storage_error predicted_error"
        bake 1 --method hao --material marble --storage $storage --reference 200
        keep hao $storage "precompute_s rel_l2"
    done
    bake 1 --method hao --material marble --no-shadows --reference 200
    keep hao "references no shadows" "predicted_error rel_l2"
    bake 1 --method hao --material marble --directions 402 --reference 200
    keep hao "references 402 directions" "predicted_error rel_l2 precompute_s"
}

value_of='
    function of(row, key) { return (row, key) in values ? values[row, key] : "-" }
    NR > 1 && $1 == group { values[$2, $3] = $4 }'

bem_table()
{
    awk -F, -v group=bem "$value_of"'
        function ms(x) { return x == "-" ? x : x < 100 ? sprintf("%.2g", x) : sprintf("%d", x) }
        function line(name, label, fly, incremental, render, move)
        {
            printf "| %s, %d triangles, %s | %s | %s | %s | %s |\n", name, of(name, "triangles"), label,
                   ms(of(name, fly)), ms(of(name, incremental)), ms(of(name, render)), ms(of(name, move))
        }
        function object(name, label)
        {
            line(name, label, "on the fly scatter", "incremental scatter", "render scatter", "on the fly move")
        }
        END {
            print "| ms a frame, all processors, tolerance 0.01 | on the fly | incremental, all moves |" \
                  " render, light moves | to move the mesh |"
            print "|---|--:|--:|--:|--:|"
            object("candle", "wax, 100 mm")
            object("cube", "skim milk, 40 mm")
            line("bunny", "skim milk, 50 mm", "frame_ms", "", "relight_ms", "")
            printf "| the same by direct gather from placed sources | %s | - | - | - |\n",
                   ms(of("bunny direct", "frame_ms"))
        }' $csv
}

hao_table()
{
    awk -F, -v group=hao "$value_of"'
        function shown(row, key, how, factor)
        {
            if (of(row, key) == "-") return "-"
            return sprintf(factor * of(row, key) < 100 ? how : "%d", factor * of(row, key))
        }
        function line(label, row)
        {
            printf "| %s | %s | %s | %s | %s | %s | %s |\n", label, shown(row, "bytes_per_vertex", "%d", 1),
                   shown(row, "relight_ms", "%.2g", 1), shown(row, "storage_error", "%.1f %%", 100),
                   shown(row, "predicted_error", "%.1f %%", 100), shown(row, "rel_l2", "%.1f %%", 100),
                   shown(row, "precompute_s", "%.2g", 1)
        }
        END {
            print "| bunny, 34,835 vertices, RGB, marble, 50 mm | bytes a vertex | ms to relight | off by storing |" \
                  " predicted error | measured | s to compute |"
            print "|---|--:|--:|--:|--:|--:|--:|"
            line("reference points, order 3 (default)", "references")
            line("harmonics alone, order 7", "harmonics")
            line("8-bit table", "table")
            line("floats, uncompressed", "float")
            line("vectors", "vectors")
            line("reference points, 402 directions", "references 402 directions")
            line("reference points, without shadows", "references no shadows")
        }' $csv
}

marked() # --write or --check
{
    bem_table | sh tests/chart/marked.sh README.md "tests/chart/examples.sh bem" "$1"
    hao_table | sh tests/chart/marked.sh README.md "tests/chart/examples.sh hao" "$1"
}

case ${1:-} in
    --print) bem_table; hao_table ;;
    --write | --check) marked "$1" ;;
    *)
        measure >"$work/csv"
        mv "$work/csv" $csv
        marked --write
        bem_table
        hao_table ;;
esac
