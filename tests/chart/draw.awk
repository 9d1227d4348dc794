# For draw.sh: files of points, and lists.gp.
function floor(value) { return value < int(value) ? int(value) - 1 : int(value) }

function widen(x, y)
{
    x = log(x) / log(10)
    y = log(y) / log(10)
    if (x_low == "" || x < x_low) x_low = x
    if (x_high == "" || x > x_high) x_high = x
    if (y_low == "" || y < y_low) y_low = y
    if (y_high == "" || y > y_high) y_high = y
}

NR == 1 { column_names(); next }
{
    keep_line()
    curve = curve_of(method[lines], parameters[lines])
    if (!(curve in curves)) { curves[curve] = ++curve_count; label[curve_count] = curve }
    points = work "/" case_index[of_case[lines]] "-" curves[curve] ".points"
    print error[lines], time[lines], low[lines], high[lines] > points
    widen(error[lines], time[lines])
    heading[of_case[lines]] = field("mesh") ", " field("material") ", " field("size_mm") " mm, " field("light")
    # One line of the model's error for each kind of dipole.
    kind = field("reference") ~ /^guarded/ ? 3 : field("reference") ~ /^placed/ ? 2 : 1
    if (field("model_l2") != "")
    {
        model[of_case[lines], kind] = field("model_l2")
        noise[of_case[lines], kind] = field("model_noise")
    }
}
END {
    lists = work "/lists.gp"
    printf "panel_count = %d\ncurve_count = %d\n", case_count, curve_count > lists
    printf "x_high = 1e%d\n", -floor(-x_high) > lists
    printf "set xrange [1e%d:1e%d]\nset yrange [1e%d:1e%d]\n", floor(x_low), -floor(-x_high), floor(y_low),
           -floor(-y_high) > lists
    printf "array panels[%d]\narray curves[%d]\narray model[%d]\narray noise[%d]\n", case_count, curve_count,
           3 * case_count, 3 * case_count > lists
    for (p = 1; p <= case_count; ++p)
    {
        printf "panels[%d] = \"%s\"\n", p, heading[case_at[p]] > lists
        for (kind = 1; kind <= 3; ++kind)
        {
            at = case_at[p] SUBSEP kind
            printf "model[%d] = %s\nnoise[%d] = %s\n", 3 * (p - 1) + kind, at in model ? model[at] : 0,
                   3 * (p - 1) + kind, at in noise && noise[at] != "" ? noise[at] : 0 > lists
        }
    }
    for (k = 1; k <= curve_count; ++k) printf "curves[%d] = \"%s\"\n", k, label[k] > lists
    for (l = 1; l <= lines; ++l)
        if (on_front(l)) print error[l], time[l] > (work "/" case_index[of_case[l]] "-pareto.points")
}
