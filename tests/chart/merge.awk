# Lines of an old chart.csv and of new ones into one, in the order of the lists.
#   awk -F, -f front.awk -f merge.awk -v cases="..." -v methods="..." -v selected="..." NEW.csv OLD.csv
# cases, methods: all names in order; selected: the methods that were measured, for which new lines replace old ones in
# the cases that have any. Old lines of cases or methods that are no more go.
BEGIN {
    case_total = split(cases, case_list, " ")
    method_total = split(methods, method_list, " ")
    n = split(selected, list, " ")
    for (i = 1; i <= n; ++i) is_selected[list[i]] = 1
}
FNR == 1 { ++file; delete column; column_names(); if (file == 1) print; next }
{
    name = case_name()
    its = field("method")
    if (file == 1) measured[name] = 1
    else if (name in measured && its in is_selected) next
    text[name, its] = text[name, its] $0 "\n"
}
END {
    for (i = 1; i <= case_total; ++i)
        for (k = 1; k <= method_total; ++k)
            printf "%s", text[case_list[i], method_list[k]]
}
