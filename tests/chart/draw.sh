#!/bin/sh
# Draws frame time against error from a chart.csv: a panel per case, a curve per method, the Pareto front of each panel
# as a step.      tests/chart/draw.sh IN.csv OUT.png
set -eu
here=$(cd "$(dirname "$0")" && pwd)
csv=$1
png=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Splits the lines into one file per panel and method, in the order of the runs, and one per panel with the points that
# no other point of the panel beats in both error and time. A list of panels and of methods goes to gnuplot.
awk -F, -v work="$work" '
    function floor(value) { return value < int(value) ? int(value) - 1 : int(value) }
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
        # All panels have the same axes, in whole decades.
        x = log(error) / log(10); y = log(time) / log(10)
        if (!x_low || x < x_low) x_low = x
        if (!x_high || x > x_high) x_high = x
        if (!y_low || y < y_low) y_low = y
        if (!y_high || y > y_high) y_high = y
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
        printf "set xrange [1e%d:1e%d]\nset yrange [1e%d:1e%d]\n", floor(x_low), -floor(-x_high), floor(y_low),
               -floor(-y_high) > (work "/lists.gp")
        printf "array panels[%d]\narray methods[%d]\n", panel_count, method_count > (work "/lists.gp")
        for (p = 1; p <= panel_count; ++p) printf "panels[%d] = \"%s\"\n", p, name[p] > (work "/lists.gp")
        for (m = 1; m <= method_count; ++m) printf "methods[%d] = \"%s\"\n", m, label[m] > (work "/lists.gp")
    }' "$csv"
for points in "$work"/*-pareto.points; do sort -g "$points" -o "$points"; done
gnuplot -e "work='$work'; png='$work/chart.png'" "$here/chart.gp"
[ -s "$work/chart.png" ] || { echo "draw.sh: gnuplot drew nothing" >&2; exit 1; }
mkdir -p "$(dirname "$png")"
cp "$work/chart.png" "$png"
