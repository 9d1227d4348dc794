# Called by hao.sh with `work`, the folder of the CSV files.
set terminal pngcairo noenhanced size 1240,560 font "sans,12" background "#ffffff"
set output work."/figure9.png"
set datafile separator ","
file = work."/figure9.csv"
models = system("awk -F, 'NR > 1 && !seen[$1]++ { print $1 }' ".file)
rows(name, storage, order) = \
    sprintf("< awk -F, '$1 == \"%s\" && $3 == \"%s\" && (%d == 0 || $5 == %d)' %s", name, storage, order, order, file)
heading = "Figures 9 and 6: error of compression alone, marble, 50 mm, 198 directions"
set multiplot layout 1, 2 title heading font "sans,14"
set grid lt 1 lw 1 lc rgb "#e4e4e4"
set key top right opaque box lc rgb "#cccccc"
set logscale xy
set format y "%.0e"
set ylabel "image RMSE in linear pictures, the worst of views and lights"
set pointsize 0.7
set title "reference points"
set xlabel "reference points, % of vertices"
plot for [m in models] for [n in "3 6"] rows(m, "references", int(n)) using (100*$4/$2):8 \
     with linespoints lw 2 pt 7 title m.", n = ".n
set title "spherical harmonics alone"
set xlabel "order n"
unset logscale x
set xtics 1
plot for [m in models] rows(m, "harmonics", 0) using 5:8 with linespoints lw 2 pt 7 title m
unset multiplot
