#!/bin/sh
# A quick run of the chart on a mesh thinned fortyfold: the columns are those that are promised, the numbers make sense,
# the picture is drawn; and the chart that is committed has the same columns.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh
out=build/chart-quick
columns=method,mesh,vertices,triangles,size_mm,material,light,parameters,threads,precompute_s,frame_ms,bytes
columns=$columns,rel_l2,rel_max,image_rmse,reference
rm -rf $out
sh tests/chart/chart.sh $out --quick >"$work/log" 2>&1 || { cat "$work/log"; job "chart.sh --quick succeeds" false; }

for csv in $out/chart.csv tests/chart/chart.csv; do
    job "$csv: the columns of the family" "[ \"\$(head -n 1 $csv)\" = $columns ]"
    job "$csv: every line has them all, with numbers that can be" "awk -F, '
        NR > 1 && (NF != 16 || \$3 < 100 || \$4 < 100 || \$5 <= 0 || \$9 < 1 || \$10 < 0 || \$11 <= 0 || \$12 < 0 ||
                   !(\$13 > 1e-9 && \$13 < 10) || !(\$14 > 1e-9 && \$14 < 100) || \$16 == \"\") { print; bad = 1 }
        END { exit bad || NR < 10 }' $csv"
done
value() # method, line of it, column
{
    awk -F, -v method="$1" -v line="$2" -v column="$3" '$1 == method && ++n == line { print $column }' $out/chart.csv
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
for csv in $out/chart.csv tests/chart/chart.csv; do
    job "$csv: boundary elements are never worse than predicted, nor better than a fifth of it" "awk -F, '
        \$1 == \"bem\" {
            split(\$8, list, \"predicted=\"); n++; ratio = list[2] / \$13
            if (!(ratio >= 1 && ratio <= 5)) { print \$5, \$6, \$8, \$13, ratio; bad = 1 }
        }
        END { exit bad || n < 2 }' $csv"
done
job "chart.png is drawn" "[ \$(wc -c <$out/chart.png) -gt 20000 ]"
job_fails "a chart without its columns is noticed" \
    "sed 1d $out/chart.csv | head -n 1 | grep '^$columns\$' || { echo differs; false; }" differs
jobs_end
