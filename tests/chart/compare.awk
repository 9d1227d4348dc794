# For compare.sh. Lines of both files are kept in one table; which[l] is the file.
function beaten(l, file,   name, i, other)
{
    name = of_case[l]
    for (i = 1; i <= count[name]; ++i)
    {
        other = line_of[name, i]
        if (which[other] == file && other != l && error[other] <= error[l] && high[other] < low[l]) return other
    }
    return 0
}

# on_front, of the lines of one file.
function first_in_file(l,   name, i, other)
{
    name = of_case[l]
    for (i = 1; i <= count[name]; ++i)
    {
        other = line_of[name, i]
        if (which[other] == which[l] && error[other] <= error[l] && time[other] < time[l]) return 0
    }
    return 1
}

function complain(text) { print text; ++complaints }

FNR == 1 { ++file; delete column; column_names(); next }
{
    keep_line()
    which[lines] = file
    name = of_case[lines]
    key = name SUBSEP method[lines] SUBSEP knob[lines]
    if ((file, key) in line_at) key = key SUBSEP ++again[file, key]
    line_at[file, key] = lines
    key_of[lines] = key
    in_file[file, name] = 1
}
END {
    for (l = 1; l <= lines; ++l)
    {
        name = of_case[l]
        other_file = 3 - which[l]
        if (!((other_file, name) in in_file)) { if (!said[name]++) print name ": only in one file"; continue }
        ++compared
        if (!first_in_file(l)) continue
        ++on_fronts
        what = name ": " method[l] " (" knob[l] ")"
        if (!((other_file, key_of[l]) in line_at))
        {
            complain(what ": on the front of one file, missing in the other")
            continue
        }
        other = line_at[other_file, key_of[l]]
        if (error[other] > 1.01 * error[l] || error[l] > 1.01 * error[other])
            complain(what ": errors differ: " error[l] " and " error[other])
        winner = beaten(other, other_file)
        if (winner)
            complain(what ": on the front of one file, beaten in the other by " method[winner] " (" knob[winner] "): " \
                     time[other] " [" low[other] ", " high[other] "] ms against " time[winner] " [" low[winner] ", " \
                     high[winner] "] ms")
        if (which[l] == 1) ratio[++ratios] = time[other] / time[l]
        spread[++spreads] = (high[l] - low[l]) / time[l]
    }
    printf "%d runs on fronts compared; ", on_fronts
    if (ratios)
    {
        asort_numbers(ratio, ratios)
        asort_numbers(spread, spreads)
        printf "times of the second over those of the first: median %.2f, from %.2f to %.2f; ",
               ratio[int((ratios + 1) / 2)], ratio[1], ratio[ratios]
        printf "frames of a run spread by %.0f %% in the median\n", 100 * spread[int((spreads + 1) / 2)]
    }
    if (!compared) complain("no case is in both files")
    print complaints ? complaints " differences" : "the same fronts within the noise"
    exit complaints > 0
}

# Insertion sort; asort is not in every awk.
function asort_numbers(list, n,   i, k, value)
{
    for (i = 2; i <= n; ++i)
    {
        value = list[i]
        for (k = i - 1; k >= 1 && list[k] > value; --k) list[k + 1] = list[k]
        list[k + 1] = value
    }
}
