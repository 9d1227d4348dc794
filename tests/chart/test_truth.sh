#!/bin/sh
# The files of truth that are committed: up to date with the chart's cases, remade by the walk within their noise, and
# the walk verified in full (verify.csv). tests/test_walk.c tests the walk itself.
cd "$(dirname "$0")/../.." || exit 1
. tests/compile/jobs.sh
truth=build/tests/chart/truth
here=tests/chart/truth

for threads in 1 3; do
    mkdir "$work/$threads"
    $truth cube-skin1-20-edge --photons 6400 --threads $threads --folder "$work/$threads" >"$work/said" 2>&1 ||
        { cat "$work/said"; job "a case is made on $threads threads" false; }
done
job "the number of threads changes no byte" "cmp $work/1/cube-skin1-20-edge.csv $work/3/cube-skin1-20-edge.csv"
# Two estimates: the squares of their differences add up to what their standard errors say. (Not one by one: a patch
# that no photon left says that its error is 0.)
job "a file of few photons agrees with the committed one" "
    awk -F, '!/^#/ && FNR > 4 { for (k = 6; k <= 8; k++)
                 if (NR == FNR) { B[\$1, k] = \$k; s[\$1, k] = \$(k + 3) }
                 else { away += (B[\$1, k] - \$k)^2; v += s[\$1, k]^2 + \$(k + 3)^2; n++ } }
             END { print \"note: squares of the differences over those of the standard errors \" away/v
                   exit !(n > 300 && away/v > 0.7 && away/v < 1.4) }' \
        $work/1/cube-skin1-20-edge.csv $here/cube-skin1-20-edge.csv"
job_fails "an unknown case is refused" "$truth no-such-case" "no such case"
job_fails "a g that is no mean cosine is refused" "$truth --all --g 1.5" "usage"
# The row of a case whose mesh is not there stays as it is.
job "every case's file was made from the case as it is, README.md from them and from verify.csv" \
    "sh $here/truth.sh --readme >$work/README.md && diff $work/README.md $here/README.md"
job "every layer and ring of verify.csv is within four standard errors, all but a few within two" "
    awk -F'|' '/^\\| (exact half|adding-doubling, van|MCML, rings)/ {
        n++; if (\$3 != \$5 || \$4 < 0.9*\$3 || \$3 < 25) bad = 1 } END { exit bad || n != 3 }' $here/README.md"
jobs_end
