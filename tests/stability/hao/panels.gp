set logscale xy
set yrange [1e-6:1]
set format y "%.0e"
set ylabel "method: relative L2 error"
set title "sphere of 10 mm, lights of the set, against rows"
set xlabel "sigma_tr, 1/mm (leftmost: 0)"
plot for [i=1:2] rows("absorption", last(i)) using 3:4 with linespoints lw 1.5 pt 7 lc rgb colors[i] title last(i), \
     rows("absorption", "floats") using 3:6 with lines ls 3 title "error of sums, as stats say", \
     rows("absorption", "floats") using 3:11 with linespoints lw 1 pt 2 lc rgb "#b3202c" title "truncated energy"
set title "sphere, a light through both poles of the set"
set xlabel "degrees from the pole"
unset logscale x
set xrange [0:360]
plot for [i=1:3] rows("poles", last(i)) using 3:4 with linespoints lw 1.5 pt 7 lc rgb colors[i] title last(i), \
     rows("poles", "floats") using 3:6 with lines ls 3 title "as stats predict"
set autoscale x
set logscale x
array own[4] = ["thin plates", "small parts", "sharp shadows", "rough surfaces"]
array what[4] = ["plate, reference points 2 mm apart", "balls beside a plate, the balls alone", \
                 "a ball's shadow on a plate", "sphere of 15 mm, vertices pushed"]
array over[4] = ["thickness, mm", "radius, mm", "mean free path, mm", "of the radius"]
do for [k=1:4] {
    set title what[k].", against floats"
    set xlabel over[k]
    plot for [i=2:3] rows(own[k], last(i)) using 3:4 with linespoints lw 1.5 pt 7 lc rgb colors[i] title last(i), \
         rows(own[k], "references") using 3:6 with lines ls 3 title "as stats say, of all"
}
