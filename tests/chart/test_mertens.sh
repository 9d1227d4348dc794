#!/bin/sh
# A quick run of the paper's experiments: figures and tables come out with their columns and make sense; and what is
# committed was written from the numbers beside it.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh
out=build/mertens-quick
rm -rf $out
SSS_MODELS=none sh tests/chart/mertens/mertens.sh $out --quick >"$work/log" 2>&1 ||
    { cat "$work/log"; job "mertens.sh --quick succeeds" false; }

# Lines of a CSV, and the numbers of a column by name, for awk.
column='NR == 1 { for (i = 1; i <= NF; ++i) c[$i] = i; next }'
for folder in $out tests/chart/mertens; do
    job "$folder: figure 3: the series within 15 %, 10,000 samples within 5 % of the form factor, 12 samples far off" "
        awk -F, '$column
            function off(name, d) { d = \$c[name] / \$c[\"exact\"] - 1; return d < 0 ? -d : d }
            \$c[\"distance_cm\"] >= 0.1 {
                if (off(\"taylor\") > t) t = off(\"taylor\")
                if (off(\"samples_10000\") > m) m = off(\"samples_10000\")
                if (off(\"samples_12\") > f) f = off(\"samples_12\")
            }
            END { print \"note: series \" t \", 10,000 samples \" m \", 12 samples \" f
                  exit !(NR > 50 && t > 0.01 && t < 0.15 && m > 1e-4 && m < 0.05 && f > 0.2) }' $folder/figure3.csv"
    job "$folder: figure 4: more segments than points for a small triangle, twenty times fewer for a large one" "
        awk -F, '$column
            NR == 2 { small = \$c[\"segments\"] > \$c[\"jensen_buhler\"] }
            { large = \$c[\"jensen_buhler\"] / \$c[\"segments\"] }
            END { print \"note: \" large; exit !(NR > 100 && small && large > 20) }' $folder/figure4.csv"
    for table in 3 4 5; do
        job "$folder: table $table: every line has its columns, numbers are positive, errors small" "
            awk -F, '$column
                NF != length(c) { bad = 1 }
                { for (name in c) if (name ~ /ms\$/ && \$c[name] != \"\" && !(\$c[name] > 0)) { print name; bad = 1 } }
                { for (name in c) if (name == \"rel_l2\" && !(\$c[name] > 1e-7 && \$c[name] < 0.3)) { print; bad = 1 } }
                (\"oracle\" in c) && \$c[\"oracle\"] == \"contribution\" && \$c[\"rel_l2\"] > 0.01 { print; bad = 1 }
                END { exit bad || NR < 3 }' $folder/table$table.csv"
    done
done
job "the committed table 3 goes on to two million triangles" \
    "grep -q '^contribution,2064384,' tests/chart/mertens/table3.csv"
job "the committed README.md was written from the CSV files beside it" \
    "sh tests/chart/mertens/tables.sh tests/chart/mertens | diff - tests/chart/mertens/README.md"
jobs_end
