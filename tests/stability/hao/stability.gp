# Called by stability.sh with `csv` and `png`.
set terminal pngcairo noenhanced size 1560,860 font "sans,11" background "#ffffff"
set output png
set datafile separator ","
set multiplot layout 2, 3 title "sss_hao.h where it is hard: relative L2 errors" font "sans,14"
set style line 1 lw 2 pt 7 ps 0.7 lc rgb "#1b6ca8"
set style line 2 lw 2 pt 6 ps 0.7 lc rgb "#e07b00"
set style line 3 lw 2 lc rgb "#777777"
set style line 4 lw 1 pt 5 ps 0.7 lc rgb "#3a8a3a"
set style line 5 lw 1 pt 2 ps 0.7 lc rgb "#b3202c"
set grid lt 1 lw 1 lc rgb "#e4e4e4"
set key bottom left opaque box lc rgb "#cccccc"
set format y "%.0e"
set format x "%g"
set logscale xy
set yrange [1e-6:1]
rows(name) = sprintf("< awk -F, '$1 == \"%s\"' '%s'", name, csv)

set key top left
set title "sphere of 10 mm, lights of the set, against rows"
set xlabel "sigma_tr, 1/mm (leftmost: 0)"
plot rows("absorption") using 2:3 with linespoints ls 1 title "floats", \
     rows("absorption") using 2:4 with linespoints ls 2 title "reference points", \
     rows("absorption") using 2:6 with lines ls 3 title "error of sums, as stats say", \
     rows("absorption") using 2:7 with linespoints ls 5 title "truncated energy, as stats say"
set key bottom left
set title "sphere, a light through both poles of the set"
set xlabel "degrees from the pole"
unset logscale x
set xrange [0:360]
set xtics 45
plot rows("poles") using 2:3 with linespoints ls 1 title "floats", \
     rows("poles") using 2:4 with linespoints ls 2 title "reference points", \
     rows("poles") using 2:5 with linespoints ls 4 title "harmonics alone, order 7", \
     rows("poles") using 2:6 with lines ls 3 title "predicted"
set logscale x
set autoscale x
set xtics auto
set title "plate, reference points 2 mm apart, against floats"
set xlabel "thickness, mm"
plot rows("thin plates") using 2:4 with linespoints ls 2 title "reference points", \
     rows("thin plates") using 2:5 with linespoints ls 4 title "harmonics alone", \
     rows("thin plates") using 2:6 with lines ls 3 title "as stats say", \
     rows("thin plates") using 2:7 with linespoints ls 5 title "B of the dark side over the lit one", \
     rows("thin plates") using 2:8 with lines lw 1 dt 2 lc rgb "#b3202c" title "the same by floats"
set title "balls beside a plate, the balls alone, against floats"
set xlabel "radius, mm"
plot rows("small parts") using 2:4 with linespoints ls 2 title "reference points", \
     rows("small parts") using 2:5 with linespoints ls 4 title "harmonics alone", \
     rows("small parts") using 2:6 with lines ls 3 title "as stats say, of all"
set title "a ball's shadow on a plate, against floats"
set xlabel "mean free path, mm"
plot rows("sharp shadows") using 2:4 with linespoints ls 2 title "reference points", \
     rows("sharp shadows") using 2:5 with linespoints ls 4 title "harmonics alone", \
     rows("sharp shadows") using 2:6 with lines ls 3 title "as stats say"
set title "rough sphere, 150 reference points, against floats"
set xlabel "roughness, share of the radius"
unset logscale x
plot rows("rough surfaces") using 2:4 with linespoints ls 2 title "reference points", \
     rows("rough surfaces") using 2:5 with linespoints ls 4 title "harmonics alone", \
     rows("rough surfaces") using 2:6 with lines ls 3 title "as stats say"
unset multiplot
