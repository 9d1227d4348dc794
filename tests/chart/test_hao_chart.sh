#!/bin/sh
# A quick run of the paper's measurements: figures and tables come out with their columns and make sense; and what is
# committed was written from the numbers beside it.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh
out=build/hao-quick
rm -rf $out
sh tests/chart/hao.sh $out --quick >"$work/log" 2>&1 || { cat "$work/log"; job "hao.sh --quick succeeds" false; }

# Lines of a CSV, and the numbers of a column by name, for awk.
column='NR == 1 { for (i = 1; i <= NF; ++i) c[$i] = i; next }'
for folder in $out tests/chart/hao; do
    [ -f $folder/figure5.csv ] || continue
    job "$folder: every line of every table has its columns" "
        for table in figure5 figure9 numbers table1 bars; do
            awk -F, '$column NF != length(c) { bad = 1 } END { exit bad }' $folder/\$table.csv || exit 1
        done"
    job "$folder: figure 5: more directions err less" "
        awk -F, '$column
            { key = \$c[\"model\"] \$c[\"nearest\"] \$c[\"shadows\"] }
            !(key in first) { first[key] = \$c[\"rel_l2\"] }
            { last[key] = \$c[\"rel_l2\"] }
            END { for (key in first) { n++; if (!(last[key] > 1e-4 && last[key] < 0.5 * first[key])) bad = 1 }
                  exit bad || n < 1 }' $folder/figure5.csv"
    job "$folder: figure 9: more reference points, and more harmonics, err less" "
        awk -F, '$column
            { key = \$c[\"model\"] \$c[\"storage\"] (\$c[\"storage\"] == \"harmonics\" ? \"\" : \$c[\"order\"]) }
            !(key in first) { first[key] = \$c[\"rel_l2\"] }
            { last[key] = \$c[\"rel_l2\"] }
            END { for (key in first) { n++; if (!(last[key] > 1e-5 && last[key] < first[key])) bad = 1 }
                  exit bad || n < 3 }' $folder/figure9.csv"
    job "$folder: README.md was written from the CSV files beside it" \
        "sh tests/chart/hao/tables.sh $folder | diff - $folder/README.md"
done
jobs_end
