#!/bin/sh
# The tables as Markdown, the paper's numbers beside ours.      tests/chart/mertens/tables.sh FOLDER-OF-CSV
set -eu
work=$1

# Reads a CSV by the names of its columns; p(name) is the present line's value. Shared by the tables below.
names='function p(name) { return $column[name] }
    function num(x, form) { return x == "" ? "-" : sprintf(form, x) }
    NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }'

cat <<'END'
# The experiments of Mertens et al. 2003, repeated

Written by `make mertens`; models and definitions are in tables.c and figures.c. Times are milliseconds of one thread of
the machine at hand, the paper's of a dual Xeon at 2.4 GHz in 2003: compare growth and ratios. A frame sets the
irradiance and shades every vertex; *incremental* follows a change of material, so that every link is computed anew.
*Solid angle* is the paper's oracle, *contribution* the default one; both at tolerance 1e-2. L counts links between
clusters, or between a group of vertices and a cluster, and form factors between a vertex and a triangle. The last
column is the relative L2 error against the converged integral with the same guard.

## Table 3: growth

Marble, 2.5 cm; subdivision. Paper: a butterfly model. Here: a sphere with lobes, continued to two million triangles.

| oracle | T | L/T | paper | on the fly | paper | incremental | paper | render | paper | bytes/T | of links | error |
|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|
END
awk -F, "$names"'
    BEGIN {
        split("44.1 47.5 53.3 52.7", links, " "); split("20 47 188 722", fly, " ")
        split("8 23 68 351", step, " "); split("5 13 43 199", sweep, " ")
    }
    {
        T = p("triangles"); i = int(log(T / 2016) / log(4) + 1.5)
        printf "| %s | %d | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n", p("oracle"), T,
               num(p("link_ms") == "" ? "" : (p("links") + p("near")) / T, "%.1f"), (i > 4 ? "-" : links[i]),
               num(p("on_the_fly_ms"), "%.4g"), (i > 4 ? "-" : fly[i]), num(p("incremental_ms"), "%.4g"),
               (i > 4 ? "-" : step[i]), num(p("render_ms"), "%.4g"), (i > 4 ? "-" : sweep[i]),
               num(p("bytes_per_triangle"), "%.0f"), num(p("link_bytes_per_triangle"), "%.0f"), p("rel_l2")
    }' "$work/table3.csv"
echo
awk -F, "$names"'
    {   # least squares through (log T, log time)
        o = p("oracle"); x = log(p("triangles")); y = log(p("on_the_fly_ms"))
        if (!(o in n)) order[++orders] = o
        n[o]++; sx[o] += x; sy[o] += y; sxx[o] += x * x; sxy[o] += x * y
    }
    END {
        printf "Time on the fly grows as T to the power of"
        for (i = 1; i <= orders; ++i)
        {
            o = order[i]
            printf "%s %.2f (%s)", (i > 1 ? "," : ""), (n[o] * sxy[o] - sx[o] * sy[o]) / (n[o] * sxx[o] - sx[o] ^ 2), o
        }
        m = 4; tx = ty = txx = txy = 0
        split("2016 8160 32736 131736", T, " "); split("20 47 188 722", t, " ")
        for (i = 1; i <= m; ++i) { x = log(T[i]); y = log(t[i]); tx += x; ty += y; txx += x * x; txy += x * y }
        printf "; the paper'"'"'s four times as %.2f.\n", (m * txy - tx * ty) / (m * txx - tx ^ 2)
    }' "$work/table3.csv"

cat <<'END'

## Table 4: models

Marble, 10 cm. FC: face clusters, S: subdivision. The paper's bust and elk are not at hand; its thresholds were "very
conservative".

| model | type | T | paper | oracle | L | paper | on the fly | paper | incremental | render | error |
|---|---|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|
END
awk -F, "$names"'
    BEGIN {
        T["horse"] = 8764; L["horse"] = "992K"; ms["horse"] = 97
        T["candle"] = 4474; L["candle"] = "435K"; ms["candle"] = 41
        T["cube"] = 16380; L["cube"] = "1572K"; ms["cube"] = 154
    }
    {
        m = p("model")
        printf "| %s | %s | %d | %d | %s | %.0fK | %s | %s | %s | %s | %s | %s |\n", m, p("type"), p("triangles"), T[m],
               p("oracle"), (p("links") + p("near")) / 1000, L[m], num(p("on_the_fly_ms"), "%.4g"), ms[m],
               num(p("incremental_ms"), "%.4g"), num(p("render_ms"), "%.4g"), p("rel_l2")
    }' "$work/table4.csv"

cat <<'END'

## Table 5: form factors against point samples

Marble, the bounding box scaled; milliseconds on the fly with the solid angle oracle. The paper does not name the model:
its 160 ms lie between the cube's and the elk's of table 4, so the cube is taken, with 1,024 triangles, for the point
samples of 16,384 take minutes; where even these would, nothing stands. The last columns are the default oracle.

| scale, m | form factor | paper | error | point sampling | paper | error | contribution | error |
|--:|--:|--:|--:|--:|--:|--:|--:|--:|
END
awk -F, "$names"'
    BEGIN { split("160 160 161 169 340", factor, " "); split("162 168 222 501 1778", point, " ") }
    {
        i = NR - 1
        printf "| %s | %s | %s | %s | %s | %s | %s | %s | %s |\n", p("scale_m"), p("form_factor_ms"), factor[i],
               p("form_factor_rel_l2"), num(p("point_ms"), "%s"), point[i], num(p("point_rel_l2"), "%s"),
               p("contribution_ms"),
               p("contribution_rel_l2")
    }' "$work/table5.csv"

cat <<'END'

## Figure 3: F(A, x) of the standard triangle

END
awk -F, "$names"'
    function worst(name,   d) { d = p(name) / p("exact") - 1; d = d < 0 ? -d : d; if (d > w[name]) w[name] = d }
    p("distance_cm") >= 0.1 {
        worst("taylor"); worst("samples_12"); worst("samples_100"); worst("samples_10000")
    }
    END {
        print "Skim milk, green. Largest deviation from the exact form factor from 0.1 to 1 cm: the series of the paper"
        printf "%.1f %%, Monte Carlo with 12 samples %.0f %%, 100 samples %.0f %%, 10,000 samples %.1f %%.\n",
               100 * w["taylor"], 100 * w["samples_12"], 100 * w["samples_100"], 100 * w["samples_10000"]
    }' "$work/figure3.csv"
cat <<'END'

![F(A, x) against distance, and the deviation from the exact form factor](figure3.png)

## Figure 4: samples

Marble, green: edge segments of the paper's series for a triangle with its tip at the receiver, with all its conditions
and without the one on sigma L, against one point sample for each pi mfp^2 (Jensen and Buhler 2002).

![Number of samples against the distance of the base edge](figure4.png)
END
