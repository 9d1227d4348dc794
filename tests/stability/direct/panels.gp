set logscale y
set yrange [1e-4:2]
set format y "%.0e"
set ylabel "model: relative error"
set title "model: total of a half space"
set xlabel "alpha'"
plot for [n in "1 1.3 1.5"] rows("half space n ".n, "distance") using 3:8 with linespoints lw 1.5 pt 7 title "eta ".n
set title "model: phase function, patches of a sphere"
set xlabel "g at equal reduced coefficients"
plot for [r in "1 5"] rows("similarity ".r, "walk") using 3:8 with linespoints lw 1.5 pt 7 title "radius ".r
