# For markdown.sh.
function show(value, format) { return value == "" ? "-" : sprintf(format, value) }

function cell(name, tolerance,   l)
{
    l = quickest(name, tolerance)
    return l ? sprintf("%s (%s): %.3g ms", method[l], knob[l], time[l]) : "-"
}

NR == 1 { column_names(); next }
{
    keep_line()
    name = of_case[lines]
    precompute[lines] = field("precompute_s")
    rebuild[lines] = field("rebuild_ms")
    bytes[lines] = field("bytes")
    largest[lines] = field("rel_max")
    picture[lines] = field("image_rmse")
    split(field("reference"), words, "quadrature to ")
    split(words[2], words, " ")
    near[lines] = error[lines] < 10 * words[1] ? "~" : ""
    predicted[lines] = parameter(parameters[lines], "predicted")
    if (!(name in about))
    {
        about[name] = field("vertices") " vertices, " field("triangles") " triangles, largest extent " \
                      field("size_mm") " mm, " field("threads") \
                      (field("threads") == 1 ? " thread" : " threads")
    }
    kind = "distance only"
    if (field("reference") ~ /^placed/) kind = "placed"
    if (field("reference") ~ /^guarded/) kind = "guarded placed"
    if (field("model_l2") != "" && !((name, kind) in has_model))
    {
        has_model[name, kind] = 1
        models[name] = models[name] (models[name] == "" ? "" : ", ") kind " " sprintf("%.1f", 100 * field("model_l2")) \
                       " +- " sprintf("%.1f", 100 * field("model_noise")) " %"
    }
}
END {
    print "# Speed against accuracy"
    print ""
    print "Written by `make chart` from chart.csv; drawn in chart.svg. A frame is all that must be done again when"
    print "the light changes, for every vertex; *rebuild* what must be done besides when the vertices have moved."
    print "Errors are relative L2 errors of radiosity against the converged integral of the method's own dipole. What"
    print "the dipole itself gets wrong stands above each table: its relative L2 error against a volumetric random"
    print "walk, converged, with one standard error of the walk. On the front (**bold**) is what no other run beats in"
    print "both time and error; what is on it was prepared and timed twice: *lowest to highest* are the frames of both."
    print ""
    print "Methods by distance only and those with guarded placed sources compute two different integrals: each error"
    print "is against its own, and that they stand on one front says nothing about which of the two is nearer to"
    print "nature; the model's errors do. A relative L2 error with a tilde is less than ten times what its reference"
    print "may itself be off. Where placed sources fall on the surface itself, as at the edges of a box, their integral"
    print "diverges without a guard: direct-placed is left out there."
    if (took != "") print "\nMeasured: " took "."
    print ""
    print "## The quickest frame within a tolerance"
    print ""
    print "| case | 10 % | 3 % | 1 % | 0.3 % |"
    print "|---|---|---|---|---|"
    for (c = 1; c <= case_count; ++c)
    {
        name = case_at[c]
        printf "| %s | %s | %s | %s | %s |\n", name, cell(name, 0.1), cell(name, 0.03), cell(name, 0.01),
               cell(name, 0.003)
    }
    for (c = 1; c <= case_count; ++c)
    {
        name = case_at[c]
        printf "\n## %s\n\n%s. The model's error: %s.\n\n", name, about[name],
               name in models ? models[name] : "not measured"
        print "| method | knob | frame, ms | lowest to highest | rel. L2 | rel. max | picture | predicted |" \
              " precompute, s | rebuild, ms | MiB |"
        print "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
        for (i = 1; i <= count[name]; ++i)
        {
            l = line_of[name, i]
            mark = on_front(l) ? "**" : ""
            printf "| %s%s%s | %s | %s%.4g%s | %.4g to %.4g | %s%s%.1e%s | %.1e | ", mark, method[l], mark, knob[l],
                   mark, time[l], mark, low[l], high[l], mark, near[l], error[l], mark, largest[l]
            printf "%s | %s | %.3g | %s | %.3g |\n", show(picture[l], "%.1e"), show(predicted[l], "%s"),
                   precompute[l], show(rebuild[l], "%.3g"),
                   bytes[l] / 1048576
        }
    }
}
