#!/bin/sh
# A quick run of the chart on meshes thinned fortyfold: the columns are those that are promised, the numbers make
# sense, figures and tables are drawn, a part can be measured anew, two runs can be compared, a mesh of one's own has
# its chart; and what is committed has the same columns and was written from the numbers beside it.
# Measures time.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh
out=build/chart-quick
own=build/chart-own
columns=method,mesh,vertices,triangles,size_mm,material,light,parameters,threads,precompute_s,frame_ms,bytes
columns=$columns,rel_l2,rel_max,image_rmse,reference,rebuild_ms,frame_low_ms,frame_high_ms,model_l2,model_noise
rm -rf $out $own
quick() # case, method: as make chart CASE=... METHOD=..., but fast
{
    CASE=$1 METHOD=$2 sh tests/chart/chart.sh $out --quick --rounds 2 >"$work/log" 2>&1 ||
        { cat "$work/log"; job "chart.sh --quick $1 $2 succeeds" false; }
}
quick 'bunny-marble-50-front' '*'
cp $out/chart.csv "$work/first.csv"
quick '*-marble-50-edge' '[lh]*'
cp $out/chart.csv "$work/second.csv"
quick 'bunny-*-50-front' lambert

for csv in $out/chart.csv tests/chart/chart.csv; do
    job "$csv: the columns of the family" "[ \"\$(head -n 1 $csv)\" = $columns ]"
    job "$csv: every line has them all, with numbers that can be" "awk -F, '
        NR > 1 && (NF != 21 || \$3 < 100 || \$4 < 100 || \$5 <= 0 || \$9 < 1 || \$10 < 0 || \$11 <= 0 || \$12 < 0 ||
                   !(\$13 > 1e-9 && \$13 < 10) || !(\$14 > 1e-9 && \$14 < 100) || \$16 == \"\" ||
                   (\$18 != \"\" && !(\$17 >= 0 && \$18 > 0 && \$18 <= \$11 && \$11 <= \$19)) ||
                   (\$20 != \"\" && !(\$20 >= 0 && \$21 > 0))) { print; bad = 1 }
        END { exit bad || NR < 10 }' $csv"
done
value() # method, line of it, column
{
    awk -F, -v method="$1" -v line="$2" -v column="$3" '$1 == method && ++n == line { print $column }' "$work/first.csv"
}
expect() # label, a, b, factor: factor a < b
{
    job "$1" "awk -v a='$2' -v b='$3' 'BEGIN { print \"note: \" a \" against \" b
        exit !(a != \"\" && b != \"\" && $4 * a < b) }'"
}
expect "integrated triangles are nearer to the reference than points, tenfold at least" \
    "$(value direct 1 13)" "$(value direct-points 1 13)" 10
expect "they meet their tolerance" "$(value direct 1 13)" 1e-4 1
expect "a coarser copy is farther from it" "$(value direct-points 1 13)" "$(value direct-points 2 13)" 1
expect "Lambert is faster than any gather, fivefold at least" "$(value lambert 1 11)" "$(value direct-points 2 11)" 5
expect "the table is faster than the plain loop, fivefold at least" \
    "$(value direct-points 1 11)" "$(value direct-scalar 1 11)" 5
expect "boundary elements meet their tolerance" "$(value bem 1 13)" 1e-3 1
expect "boundary elements are faster than the direct gather of their kind" \
    "$(value bem 1 11)" "$(value direct-placed 1 11)" 1
expect "stored links are faster still, fivefold at least" "$(value bem-render 1 11)" "$(value bem 1 11)" 5
job "stored links give what is computed on the fly" "[ '$(value bem 1 13)' = '$(value bem-render 1 13)' ]"
expect "boundary elements without links are moved faster than they are made, twice at least" \
    "$(value bem 1 17)" "$(awk "BEGIN { print 1e3 * $(value bem 1 10) }")" 2
expect "precomputed integrals are faster than stored links" "$(value hao 1 11)" "$(value bem-render 1 11)" 1
expect "and within 2 % of the reference, with a thousand directions" "$(value hao 1 13)" 2e-2 1
expect "but not moved for nothing" "$(value bem 1 17)" "$(value hao 1 17)" 1
for csv in $out/chart.csv tests/chart/chart.csv; do
    job "$csv: boundary elements are never worse than predicted, nor better than a fifth of it" "awk -F, '
        \$1 == \"bem\" && \$2 == \"bunny\" {
            split(\$8, list, \"predicted=\"); n++; ratio = list[2] / \$13
            if (!(ratio >= 1 && ratio <= 5)) { print \$5, \$6, \$8, \$13, ratio; bad = 1 }
        }
        END { exit bad || n < 2 }' $csv"
done
# On any mesh the error that sss_bem_predict_error predicts is not below the true one.
ratios() # file
{
    awk -F, -f tests/chart/front.awk -f /dev/stdin "$1" <<'END'
NR == 1 { column_names(); next }
field("method") == "bem" && parameter(field("parameters"), "predicted") != "" {
    printf "%.2f %s at %s\n", parameter(field("parameters"), "predicted") / field("rel_l2"), case_name(),
           parameter(field("parameters"), "tolerance")
}
END
}
ratios tests/chart/chart.csv >"$work/ratios"
job "no error is above what bem predicts, in any case of the committed chart" "
    awk '\$1 < 1 { print; bad = 1 } END { exit bad || NR < 10 }' $work/ratios"
job "sss_dipole.h has the curves fitted to chart.csv, and says what the choices come to" "
    sh tests/chart/choice/fit.sh --check"

# Parts of it.
job "METHOD measures those methods alone, and leaves out what hao cannot light" "
    awk -F, '\$7 == \"edge\" { n++; bad = bad || \$1 != \"lambert\" } END { exit bad || n != 2 }' $work/second.csv"
job "the lines of other cases stay" "
    grep ',front,' $work/first.csv >$work/before; grep ',front,' $work/second.csv | diff $work/before - &&
    [ \$(wc -l <$work/before) -gt 10 ]"
job "a line measured anew takes the place of the old one, at its place" "
    cut -d, -f1,2,5,6,7 $work/second.csv >$work/order
    cut -d, -f1,2,5,6,7 $out/chart.csv | grep -v 'lambert,bunny,50,Skimmilk,front' | diff $work/order - &&
    ! grep ',front,none' $work/second.csv | grep -q -x -F -f - $out/chart.csv"
job "what is all left out is no failure" "
    CASE='cube-*-edge' METHOD=hao sh tests/chart/chart.sh $work/left --quick >$work/left.log 2>&1 &&
    grep 'all is left out' $work/left.log && [ ! -f $work/left/chart.csv ]"
job_fails "a case that is not there is said so" "CASE=teapot sh tests/chart/chart.sh $out --quick" "no case teapot"
job_fails "a method that is not there is said so" "METHOD=magic sh tests/chart/chart.sh $out --quick" "no method magic"

# The list.
build/tests/chart/measure --cases >"$work/names"
job "the cases have each mesh, each material, each light, and sizes from 1 to 200 mm" "
    for word in bunny dragon leaf slab sphere cube marble skimmilk skin1 ketchup wholemilk spectralon front side \
                behind environment edge 1 200; do
        grep -q -E \"(^|-)\$word(-|$)\" $work/names || { echo \"no \$word\"; exit 1; }
    done
    ! sort $work/names | uniq -d | grep ."

# Two runs.
awk -F, -v OFS=, '$1 == "hao" { $13 *= 1.5 } { print }' "$work/first.csv" >"$work/worse.csv"
awk -F, -v OFS=, '$1 == "bem-render" { $11 *= 1e6; $18 *= 1e6; $19 *= 1e6 } { print }' "$work/first.csv" \
    >"$work/slow.csv"
job "a run has the front that it has" "sh tests/chart/compare.sh $work/first.csv $work/first.csv"
job_fails "a run that fell behind is noticed" "sh tests/chart/compare.sh $work/first.csv $work/slow.csv" "beaten in the"
job_fails "errors that changed are noticed" "sh tests/chart/compare.sh $work/first.csv $work/worse.csv" "errors differ"
grep -v ,front, "$work/second.csv" >"$work/edge.csv"
job_fails "files without a case in common are noticed" "sh tests/chart/compare.sh $work/first.csv $work/edge.csv" \
    "no case"

# A mesh of one's own.
if have gltfpack; then
    gltfpack -noq -si 0.005 -sa -i build/models/bunny.glb -o "$work/own.glb" >"$work/log" 2>&1 || cat "$work/log"
    job "bake --chart draws the chart of any mesh" "
        build/bake $work/own.glb --chart $own --size-mm 5 --material ketchup --light 1,0.5,0.2 --ambient 0.1 \
            --reference 5 >$work/said 2>$work/runs || { cat $work/runs; exit 1; }
        [ \"\$(head -n 1 $own/chart.csv)\" = $columns ] && grep -q '^hao,own,.*,5,ketchup,own,' $own/chart.csv &&
        grep -q '<svg' $own/chart.svg && diff $work/said $own/chart.md && grep -q 'The quickest frame' $work/said"
else
    skip "bake --chart" "no gltfpack to make a small mesh with"
fi

for folder in $out tests/chart; do
    job "$folder/chart.svg is drawn, its text is text, with a panel for each case" "
        cut -d, -f2,5,6,7 $folder/chart.csv | sed 1d | sort -u |
        awk -F, '{ print \$1 \", \" \$3 \", \" \$2 \" mm, \" \$4 }' |
        while read -r panel; do grep -q \"\$panel\" $folder/chart.svg || { echo \"no \$panel\"; exit 1; }; done"
    job "$folder/chart.md was written from chart.csv" \
        "sh tests/chart/markdown.sh $folder/chart.csv | diff - $folder/chart.md"
done
job "every case of the list is in the committed chart" "
    awk -F, -f tests/chart/front.awk -f /dev/stdin tests/chart/chart.csv <<'END' | sort -u >$work/there
NR == 1 { column_names(); next } { print case_name() }
END
    sort $work/names | diff - $work/there"
job "chart.png is drawn" "[ \$(wc -c <$out/chart.png) -gt 20000 ]"
job_fails "a chart without its columns is noticed" \
    "sed 1d $out/chart.csv | head -n 1 | grep '^$columns\$' || { echo differs; false; }" differs
jobs_end
