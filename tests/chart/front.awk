# What the scripts of this folder share: lines of chart.csv by name of column, the case, the knob, the front.
# Included with awk -f before the rest. read_line() after NR > 1 keeps a line in arrays by its number.

function column_names(   i)
{
    for (i = 1; i <= NF; ++i) column[$i] = i
}

function field(name) { return name in column ? $column[name] : "" }

# A value of the parameters, which are key=value with semicolons between them.
function parameter(text, key,   list, n, i, pair)
{
    n = split(text, list, ";")
    for (i = 1; i <= n; ++i) { split(list[i], pair, "="); if (pair[1] == key) return pair[2] }
    return ""
}

# mesh-material-size-light, as tests/chart/cases.h has it.
function case_name() { return tolower(field("mesh") "-" field("material") "-" field("size_mm") "-" field("light")) }

# What distinguishes the runs of a method.
function knob_of(method, text,   emitters, tolerance)
{
    emitters = parameter(text, "emitters")
    tolerance = parameter(text, "tolerance")
    if (method == "lambert") return "-"
    if (method == "hao") return parameter(text, "storage") ", " parameter(text, "directions") " directions"
    if (method ~ /points|scalar/) return emitters " triangles"
    if (method ~ /^direct/) return tolerance ", " emitters " triangles"
    return tolerance
}

# A curve of the drawing.
function curve_of(method, text) { return method == "hao" ? "hao " parameter(text, "storage") : method }

function keep_line(   name)
{
    name = case_name()
    if (!(name in case_index)) { case_index[name] = ++case_count; case_at[case_count] = name }
    ++lines
    of_case[lines] = name
    method[lines] = field("method")
    parameters[lines] = field("parameters")
    knob[lines] = knob_of(method[lines], parameters[lines])
    error[lines] = field("rel_l2") + 0
    time[lines] = field("frame_ms") + 0
    low[lines] = field("frame_low_ms") == "" ? time[lines] : field("frame_low_ms") + 0
    high[lines] = field("frame_high_ms") == "" ? time[lines] : field("frame_high_ms") + 0
    count[name]++
    line_of[name, count[name]] = lines
}

# Whether no run of its case is both nearer to the reference and quicker.
function on_front(l,   name, i, other)
{
    name = of_case[l]
    for (i = 1; i <= count[name]; ++i)
    {
        other = line_of[name, i]
        if (error[other] <= error[l] && time[other] <= time[l] && (error[other] < error[l] || time[other] < time[l]))
            return 0
    }
    return 1
}

# The quickest run of a case within a tolerance; 0: none is.
function quickest(name, tolerance,   i, l, found)
{
    found = 0
    for (i = 1; i <= count[name]; ++i)
    {
        l = line_of[name, i]
        if (error[l] <= tolerance && (!found || time[l] < time[found])) found = l
    }
    return found
}
