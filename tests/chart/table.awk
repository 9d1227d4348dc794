# For table.sh: the runs of one case.
NR == 1 { column_names(); next }
case_name() == "bunny-marble-50-front" {
    keep_line()
    picture[lines] = field("image_rmse")
    precompute[lines] = field("precompute_s")
    if (method[lines] == "direct-scalar") loop = time[lines]
}
END {
    print "| method | knob | precompute, s | frame, ms | times the plain loop | relative L2 error | picture |"
    print "|---|---|--:|--:|--:|--:|--:|"
    for (l = 1; l <= lines; ++l)
    {
        mark = on_front(l) ? "**" : ""
        printf "| %s%s%s | %s | %.2g | %s%.4g%s | %.3g | %s%.1e%s | %s |\n", mark, method[l], mark, knob[l],
               precompute[l], mark, time[l], mark, loop / time[l], mark, error[l], mark,
               picture[l] == "" ? "-" : sprintf("%.1e", picture[l])
    }
}
