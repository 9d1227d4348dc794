# Called by hao.sh with `work`, the folder of the CSV files.
set terminal pngcairo noenhanced size 1240,560 font "sans,12" background "#ffffff"
set output work."/figure5.png"
set datafile separator ","
file = work."/figure5.csv"
models = system("awk -F, 'NR > 1 && !seen[$1]++ { print $1 }' ".file)
rows(name, how) = sprintf("< awk -F, '$1 == \"%s\" && $3 == %d' %s", name, how, file)
set multiplot layout 1, 2 title "Figure 5: error of interpolating between directions, marble, 50 mm" font "sans,14"
set grid lt 1 lw 1 lc rgb "#e4e4e4"
set key top right opaque box lc rgb "#cccccc"
set logscale xy
set xtics ("6" 6, "18" 18, "38" 38, "66" 66, "102" 102, "198" 198, "402" 402)
set xlabel "directions"
set format y "%.0e"
set xrange [5:700]
set pointsize 0.7
paper = "< echo 200,3e-3"
set title "image RMSE, the worst of views and lights"
plot for [m in models] rows(m, 3) using 4:5 with linespoints lw 2 pt 7 title m, \
     rows(word(models, 1), 4) using 4:5 with linespoints lw 1 dt 2 pt 6 title word(models, 1)." by four nearest", \
     paper using 1:2 with points pt 2 ps 2 lw 3 lc rgb "#b3202c" title "the paper, four models"
set title "rel_l2 of B"
plot for [m in models] rows(m, 3) using 4:7 with linespoints lw 2 pt 7 title m, \
     rows(word(models, 1), 4) using 4:7 with linespoints lw 1 dt 2 pt 6 title word(models, 1)." by four nearest", \
     rows(word(models, 1), 3) using 4:8 with lines lw 1 lc rgb "#777777" title word(models, 1).", as stats say"
unset multiplot
