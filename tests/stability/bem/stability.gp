# Called by stability.sh with `csv` and `png`. Upper six panels: the computation against the converged reference. Lower
# six: the dipole model against what is true.
set terminal pngcairo noenhanced size 1560,1560 font "sans,11" background "#ffffff"
set output png
set datafile separator ","
heading = "sss_bem.h where it is hard, tolerance 1e-2: errors of the computation, then of the model"
set multiplot layout 4, 3 title heading font "sans,14"
set style line 1 lw 2 pt 7 ps 0.7 lc rgb "#1b6ca8"
set style line 2 lw 2 pt 6 ps 0.7 lc rgb "#e07b00"
set style line 3 lw 2 lc rgb "#777777"
set style line 4 lw 1 pt 5 ps 0.7 lc rgb "#3a8a3a"
set pointsize 0.7
set grid lt 1 lw 1 lc rgb "#e4e4e4"
set key bottom left opaque box lc rgb "#cccccc"
set logscale xy
set format y "%.0e"
set format x "%g"
albedos = "0.9 0.95 0.99"
rows(name) = sprintf("< awk -F, '$1 == \"%s\"' '%s'", name, csv)
set yrange [1e-5:1]
set ylabel "relative error"

set title "slab, lit from above"
set xlabel "thickness, mean free paths"
plot rows("slab front 0.9") using 2:3 with linespoints ls 1 title "L2", \
     rows("slab front 0.9") using 2:4 with linespoints ls 2 title "largest", \
     rows("slab front 0.9") using 2:5 with lines ls 3 title "predicted L2", \
     rows("slab back 0.9") using 2:3 with linespoints ls 4 title "L2, the dark face alone"
set title "sphere, lit from one side"
set xlabel "radius, mean free paths"
plot rows("sphere") using 2:3 with linespoints ls 1 title "L2", \
     rows("sphere") using 2:4 with linespoints ls 2 title "largest", \
     rows("sphere") using 2:5 with lines ls 3 title "predicted L2"
set title "two fingers, radius 3"
set xlabel "gap, mean free paths"
plot rows("fingers") using 2:3 with linespoints ls 1 title "L2", \
     rows("fingers") using 2:4 with linespoints ls 2 title "largest", \
     rows("fingers") using 2:5 with lines ls 3 title "predicted L2"
set title "fan of triangles beside cells of 0.5"
set xlabel "length of the fan, mean free paths"
plot rows("fan") using 2:3 with linespoints ls 1 title "L2", \
     rows("fan") using 2:4 with linespoints ls 2 title "largest", \
     rows("fan") using 2:5 with lines ls 3 title "predicted L2"
set title "sphere of radius 4, squashed"
set xlabel "height over diameter"
plot rows("squash kept") using 2:3 with linespoints ls 1 title "L2, kept and updated", \
     rows("squash kept") using 2:4 with linespoints ls 2 title "largest", \
     rows("squash fresh") using 2:3 with linespoints ls 4 title "L2, built anew", \
     rows("squash fresh") using 2:5 with lines ls 3 title "predicted L2"
set title "a source that approaches a lit square: B"
set xlabel "H/z"
set ylabel "radiosity over irradiance"
set yrange [*:*]
plot rows("approach unguarded") using 2:7 with lines lw 6 lc rgb "#d9d9d9" title "exact, without guard", \
     rows("approach unguarded") using 2:6 with points pt 7 ps 0.7 lc rgb "#b3202c" title "without guard", \
     rows("approach guarded") using 2:6 with linespoints ls 1 title "with the default guard"

set title "model: lit face of a slab"
set xlabel "thickness, mean free paths"
set key top left
unset logscale y
set format y "%g"
set yrange [0:1.2]
plot for [a in albedos] rows("slab front ".a) using 2:6 with linespoints lw 2 pt 7 title "dipole, alpha' ".a, \
     for [a in albedos] rows("slab front ".a) using 2:7 with lines lw 2 dt 2 title "slab, alpha' ".a
set title "model: dark face of a slab"
set key top right
set yrange [0:1.6]
plot for [a in albedos] rows("slab back ".a) using 2:6 with linespoints lw 2 pt 7 title "dipole, alpha' ".a, \
     for [a in albedos] rows("slab back ".a) using 2:7 with lines lw 2 dt 2 title "slab, alpha' ".a
set title "model: slab, dipole over truth"
set logscale y
set yrange [0.1:100]
plot for [a in albedos] rows("slab front ".a) using 2:($6/$7) with linespoints lw 2 pt 7 title "lit face, ".a, \
     for [a in albedos] rows("slab back ".a) using 2:($6/$7) with linespoints lw 2 pt 6 title "dark face, ".a
unset logscale y
set yrange [0:1.2]
set title "model: sphere without absorption, even light"
set xlabel "radius, mean free paths"
plot rows("sphere") using 2:6 with linespoints ls 1 title "B/E", \
     rows("sphere") using 2:7 with lines ls 3 dt 2 title "truth"
set title "model: light across the gap of two fingers"
set xlabel "gap, mean free paths"
plot rows("fingers") using 2:6 with linespoints ls 1 title "brightest of the dark finger over the lit one's", \
     rows("fingers") using 2:7 with lines ls 3 dt 2 title "truth"
set title "bunny: share of values that the guard changes"
set xlabel "size, mm"
set ylabel "share changed by more than 5 %"
set yrange [0:0.5]
set xrange [5:400]
plot for [m in "Marble Skimmilk"] rows("guard on the bunny ".m) using 2:6 with linespoints lw 2 pt 7 title m
unset multiplot
