# Called by mertens.sh with `work`, the folder of the CSV files.
set terminal pngcairo noenhanced size 760,520 font "sans,12" background "#ffffff"
set output work."/figure4.png"
set datafile separator ","
file = work."/figure4.csv"
set title "Figure 4: samples for a triangle that grows from the receiver, marble (green)" font "sans,13"
set grid lt 1 lw 1 lc rgb "#e4e4e4"
set xlabel "distance of the base edge, cm"
set ylabel "samples"
set logscale y
set key top left opaque box lc rgb "#cccccc"
plot file skip 1 using 1:4 with lines lw 2 lc rgb "#e07b00" title "Jensen and Buhler: points", \
     file skip 1 using 1:2 with lines lw 2 lc rgb "#b3202c" title "the paper's series: edge segments", \
     file skip 1 using 1:3 with lines lw 2 lc rgb "#1b6ca8" title "without the condition on sigma L"
