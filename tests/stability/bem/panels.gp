set logscale xy
set yrange [1e-6:10]
set format y "%.0e"
set ylabel "method: relative L2 error"
set title "sphere of radius 4, squashed"
set xlabel "height over diameter"
plot rows("squash kept", "placed") using 3:4 with linespoints lw 1.5 pt 7 title "kept and updated", \
     rows("squash fresh", "placed") using 3:4 with linespoints lw 1.5 pt 7 title "built anew", \
     rows("squash fresh", "placed") using 3:6 with lines ls 3 title "as stats predict"
set title "a source that approaches a lit square: B"
set xlabel "H/z"
set ylabel "radiosity over irradiance"
set yrange [*:*]
plot rows("approach unguarded", "placed") using 3:12 with lines lw 6 lc rgb "#d9d9d9" title "exact, without guard", \
     rows("approach unguarded", "placed") using 3:11 with points pt 7 lc rgb "#b3202c" title "without guard", \
     rows("approach guarded", "placed") using 3:11 with linespoints lw 1.5 pt 7 title "with the default guard"
set title "bunny: share of values that the guard changes"
set xlabel "size, mm"
set ylabel "share changed by more than 5 %"
unset logscale y
set format y "%g"
set yrange [0:0.5]
set xrange [5:400]
plot for [m in "Marble Skimmilk"] rows("guard on the bunny ".m, "placed") using 3:11 with linespoints pt 7 title m
set autoscale x
