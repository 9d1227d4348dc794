# Which header a scene wants, from a chart.csv: for what changes and each tolerance, in how many of the chart's cases
# the cheapest run within the tolerance is of which header, and what it costs in the median of those.
# A still picture costs precomputation and a frame; changing light a frame; changing geometry a frame and what must be
# done again besides.
NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
{
    name = $column["mesh"] "-" $column["material"] "-" $column["size_mm"] "-" $column["light"]
    if (!(name in seen)) { seen[name] = ++case_count }
    c = seen[name]
    method = $column["method"]
    sub(/^direct.*/, "dipole", method)
    sub(/^bem.*/, "bem", method)
    header = method == "lambert" ? "`sss_dipole_lambert`" : "`sss_" method ".h`"
    error = $column["rel_l2"] + 0
    ms = $column["frame_ms"] + 0
    cost[1] = ms + 1000 * $column["precompute_s"]
    cost[2] = ms
    cost[3] = ms + $column["rebuild_ms"]
    for (t = 1; t <= 4; ++t)
        for (s = 1; s <= 3; ++s)
            if (error <= tolerance(t) && (!((c, t, s) in least) || cost[s] < least[c, t, s]))
            {
                least[c, t, s] = cost[s]
                winner[c, t, s] = header
            }
}
function tolerance(t) { return t == 1 ? 0.1 : t == 2 ? 0.03 : t == 3 ? 0.01 : 0.003 }
function time(ms)
{
    if (ms < 0.95) return sprintf("%.2f ms", ms)
    if (ms < 9.95) return sprintf("%.1f ms", ms)
    return ms < 9995 ? sprintf("%d ms", ms) : sprintf("%d s", ms / 1000)
}
# The median of one header's costs.
function median(t, s, header,   n, i, j, v, swap)
{
    for (i = 1; i <= case_count; ++i) if (winner[i, t, s] == header) v[++n] = least[i, t, s]
    for (i = 1; i <= n; ++i)
        for (j = i + 1; j <= n; ++j) if (v[j] < v[i]) { swap = v[i]; v[i] = v[j]; v[j] = swap }
    return v[int((n + 1) / 2)]
}
# The headers of a cell, the one that wins most often first.
function cell(t, s,   i, n, header, best, count, text)
{
    for (i = 1; i <= case_count; ++i) if ((i, t, s) in winner) n += ++count[winner[i, t, s]] == 1
    for (; n > 0; --n)
    {
        best = ""
        for (header in count) if (best == "" || count[header] > count[best] ||
                                  (count[header] == count[best] && header < best)) best = header
        text = text (text == "" ? "" : "<br>") best " " count[best] ": " time(median(t, s, best))
        delete count[best]
    }
    return text == "" ? "none" : text
}
END {
    split("nothing: a still picture|light and camera|vertices too", what, "|")
    printf "| what changes, %d cases | 10 %% | 3 %% | 1 %% | 0.3 %% |\n|---|---|---|---|---|\n", case_count
    for (s = 1; s <= 3; ++s)
        printf "| %s | %s | %s | %s | %s |\n", what[s], cell(1, s), cell(2, s), cell(3, s), cell(4, s)
}
