# limits.txt and the csv files to lines "method;kind;what and threshold;worst method error;worst error;says".
# awk -F';' -v folder=FOLDER -f limits.awk limits.txt
BEGIN { columns = "sweep,series,x,rel_l2,rel_max,predicted,left_out,model,input,said,value,ideal" }

function number(x)
{
    if (x >= 1000) return sprintf("%.1e", x)
    return sprintf("%.2g", x) + 0
}

function percent(x)
{
    if (x >= 100) return sprintf("%.1e %%", 100 * x)
    return sprintf("%.2g", 100 * x) + 0 " %"
}

# Largest of what was asked for or predicted, as close_sweep has it.
function promise(method, predicted, series)
{
    asked = method == "direct" ? 1e-3 : method == "bem" ? 1e-2 : series == "floats" ? 5e-3 : 0
    return predicted > asked ? predicted : asked
}

# Fills x[], e[] (1 .. n) of a series, sorted by x as the file has it; worst_method: of rel_l2.
function read(method, series, sweep, kind,    file, line, f, v)
{
    n = 0
    worst_method = ""
    file = folder "/" method "/stability_" method ".csv"
    if ((getline line < file) <= 0 || line != columns) {
        print "limits.awk: " file " has not the columns " columns > "/dev/stderr"
        failed = 1
    }
    while ((getline line < file) > 0) {
        split(line, f, ",")
        if (sweep ~ /^slab / && f[3] < 2) continue # thinner ones diffusion itself does not describe
        base = sweep
        if (sweep ~ /^slab /) base = "slab"
        if (f[1] == base && f[2] == series && f[4] != "" && f[4] + 0 > worst_method + 0) worst_method = f[4]
        # the model's rows stand under the first series of their geometry
        if (f[1] != sweep || (f[2] != series && !(sweep ~ /^slab / && method == "hao"))) continue
        v = kind == "model" || kind == "slab" ? f[8] : kind == "input" ? f[9] : kind == "method" ? f[4] : ""
        if (kind == "promise" && f[4] != "") v = f[4] / promise(method, f[6], series)
        if (kind == "flicker" && f[11] != "" && f[12] > 0) v = f[11] / f[12] > 1 ? f[11] / f[12] - 1 : 0
        if (kind == "facets" && f[11] != "" && f[3] >= 50) v = f[11] > 1 ? f[11] - 1 : 1 - f[11]
        if (v == "") continue
        x[++n] = f[3] + 0
        e[n] = v + 0
    }
    close(file)
}

# Into ascending x.
function sort(    i, j, t)
{
    for (i = 2; i <= n; i++)
        for (j = i; j > 1 && x[j - 1] > x[j]; j--) {
            t = x[j]; x[j] = x[j - 1]; x[j - 1] = t
            t = e[j]; e[j] = e[j - 1]; e[j - 1] = t
        }
}

# Between two steps the error is taken as a power of x.
function between(i, j, level)
{
    if (x[i] <= 0 || x[j] <= 0 || e[i] <= 0 || e[j] <= 0) return x[j]
    return exp(log(x[i]) + log(level / e[i]) * log(x[j] / x[i]) / log(e[j] / e[i]))
}

/^#/ { next }
{
    read($1, $2, $3, $4)
    if (n == 0) { print "limits.awk: nothing of " $1 ", " $2 ", " $3 > "/dev/stderr"; failed = 1; next }
    sort()
    worst = 0
    for (i = 1; i <= n; i++) if (e[i] > worst) worst = e[i]
    where = ""
    if ($6 == "above") {
        for (i = 1; i <= n && where == ""; i++)
            if (e[i] >= $5) where = i == 1 ? "at any value from " number(x[1]) : \
                "above " number(between(i, i - 1, $5))
    } else {
        for (i = n; i >= 1 && where == ""; i--)
            if (e[i] >= $5) where = i == n ? "at any value to " number(x[n]) : "below " number(between(i, i + 1, $5))
    }
    if (where == "") where = "no limit from " number(x[1]) " to " number(x[n])
    else if ($4 == "flicker") where = "exceed the converged ones by more than " percent($5)
    if ($4 == "facets") where = "up to " percent(worst)
    if ($4 == "flicker" && where ~ /^no/) where = "no limit"
    printf "%s;%s;%s;%s;%s;%s;%s;%s\n", $1, $2, $4, $7 " " where ($8 != "" ? " " $8 : ""), \
        worst_method == "" ? "-" : percent(worst_method), \
        $4 == "promise" ? sprintf("%.2g times", worst) : percent(worst), $9, $3
}
END { exit failed }
