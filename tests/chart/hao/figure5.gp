# Called by hao.sh with `work`, the folder of the CSV files.
set terminal pngcairo noenhanced size 1240,600 font "sans,12" background "#ffffff"
set output work."/figure5.png"
set datafile separator ","
file = work."/figure5.csv"
models = system("awk -F, 'NR > 1 && !seen[$1]++ { print $1 }' ".file)
rows(name, nearest, shadows) = \
    sprintf("< awk -F, '$1 == \"%s\" && $3 == \"%s\" && $4 == \"%s\"' %s", name, nearest, shadows, file)
set multiplot layout 1, 2 title "Figure 5: error of interpolating between directions, marble, 50 mm" font "sans,14"
set grid lt 1 lw 1 lc rgb "#e4e4e4"
set key bottom left opaque box lc rgb "#cccccc" font "sans,9"
set logscale xy
set xtics ("6" 6, "18" 18, "38" 38, "66" 66, "102" 102, "198" 198, "402" 402, "1026" 1026)
set xlabel "directions"
set format y "%.0e"
set xrange [5:1300]
set yrange [1e-4:1]
set pointsize 0.7
paper = "< echo 200,3e-3"
set title "image RMSE in linear pictures, the worst of views and lights"
plot for [i=1:words(models)] rows(word(models, i), "three", "with") using 5:8 with linespoints lw 2 pt 7 lc i \
         title word(models, i), \
     for [i=1:words(models)] rows(word(models, i), "three", "without") using 5:8 with linespoints lw 1 dt 3 pt 6 lc i \
         title word(models, i)." without shadows", \
     rows(word(models, 1), "four", "with") using 5:8 with linespoints lw 1 dt 2 pt 4 lc rgb "#777777" \
         title word(models, 1).", four nearest", \
     paper using 1:2 with points pt 2 ps 2 lw 3 lc rgb "#b3202c" title "the paper, its four models"
set title "rel_l2 of B"
plot for [i=1:words(models)] rows(word(models, i), "three", "with") using 5:9 with linespoints lw 2 pt 7 lc i \
         title word(models, i), \
     for [i=1:words(models)] rows(word(models, i), "three", "without") using 5:9 with linespoints lw 1 dt 3 pt 6 lc i \
         title word(models, i)." without shadows", \
     rows(word(models, 1), "four", "with") using 5:9 with linespoints lw 1 dt 2 pt 4 lc rgb "#777777" \
         title word(models, 1).", four nearest", \
     rows(word(models, 1), "three", "with") using 5:10 with lines lw 1 lc rgb "#b3202c" \
         title word(models, 1).", as stats say"
unset multiplot
