# Called by mertens.sh with `work`, the folder of the CSV files.
set terminal pngcairo noenhanced size 1240,520 font "sans,12" background "#ffffff"
set output work."/figure3.png"
set datafile separator ","
set multiplot layout 1, 2 title "Figure 3: form factor of the standard triangle, skim milk (green)" font "sans,14"
file = work."/figure3.csv"
set grid lt 1 lw 1 lc rgb "#e4e4e4"
set xlabel "distance of the tip, cm"
set key top right opaque box lc rgb "#cccccc"
set logscale y
set format y "%.0e"
set ylabel "F(A, x)"
plot file skip 1 using 1:4 with lines lw 1 lc rgb "#e07b00" title "Monte Carlo, 12 samples", \
     file skip 1 using 1:5 with lines lw 1 lc rgb "#3a8a3a" title "100 samples", \
     file skip 1 using 1:6 with lines lw 1.5 lc rgb "#1b6ca8" title "10,000 samples", \
     file skip 1 using 1:3 with lines lw 2 lc rgb "#b3202c" title "the paper's series", \
     file skip 1 using 1:2 with lines lw 1.5 lc rgb "#000000" title "sss_bem_form_factor"
unset logscale y
set format y "%g"
set ylabel "deviation from the exact value, %"
set yrange [-30:30]
plot file skip 1 using 1:(100*($4/$2-1)) with lines lw 1 lc rgb "#e07b00" title "Monte Carlo, 12 samples", \
     file skip 1 using 1:(100*($5/$2-1)) with lines lw 1 lc rgb "#3a8a3a" title "100 samples", \
     file skip 1 using 1:(100*($6/$2-1)) with lines lw 1.5 lc rgb "#1b6ca8" title "10,000 samples", \
     file skip 1 using 1:(100*($3/$2-1)) with lines lw 2 lc rgb "#b3202c" title "the paper's series"
unset multiplot
