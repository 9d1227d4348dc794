#!/bin/sh
# Draws frame time against error from a chart.csv: a panel per case, a curve per method, the Pareto front of each panel
# as a step.      tests/chart/draw.sh IN.csv OUT.png
set -eu
here=$(cd "$(dirname "$0")" && pwd)
csv=$1
png=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Splits the lines into one file per panel and method, sorted by error, and one per panel with the points that no other
# point of the panel beats in both error and time. A list of panels and of methods goes to gnuplot.
awk -F, -v work="$work" '
    NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
    {
        panel = $column["mesh"] ", " $column["size_mm"] " mm, " $column["material"]
        method = $column["method"]
        if (!(panel in panels)) { panels[panel] = ++panel_count; name[panel_count] = panel }
        if (!(method in methods)) { methods[method] = ++method_count; label[method_count] = method }
        p = panels[panel]; m = methods[method]
        error = $column["rel_l2"] + 0; time = $column["frame_ms"] + 0
        print error, time > (work "/" p "-" m ".points")
        n[p]++; e[p, n[p]] = error; t[p, n[p]] = time
    }
    END {
        for (p = 1; p <= panel_count; ++p)
            for (i = 1; i <= n[p]; ++i)
            {
                beaten = 0
                for (j = 1; j <= n[p]; ++j)
                    if (e[p, j] <= e[p, i] && t[p, j] <= t[p, i] && (e[p, j] < e[p, i] || t[p, j] < t[p, i])) beaten = 1
                if (!beaten) print e[p, i], t[p, i] > (work "/" p "-pareto.points")
            }
        printf "panel_count = %d\nmethod_count = %d\n", panel_count, method_count > (work "/lists.gp")
        printf "array panels[%d]\narray methods[%d]\n", panel_count, method_count > (work "/lists.gp")
        for (p = 1; p <= panel_count; ++p) printf "panels[%d] = \"%s\"\n", p, name[p] > (work "/lists.gp")
        for (m = 1; m <= method_count; ++m) printf "methods[%d] = \"%s\"\n", m, label[m] > (work "/lists.gp")
    }' "$csv"
for points in "$work"/*.points; do sort -g "$points" -o "$points"; done
gnuplot -e "work='$work'; png='$work/chart.png'" "$here/chart.gp"
[ -s "$work/chart.png" ] || { echo "draw.sh: gnuplot drew nothing" >&2; exit 1; }
mkdir -p "$(dirname "$png")"
cp "$work/chart.png" "$png"
