# Called by draw.sh with `work`, the folder of the points, and `png`.
load work."/lists.gp"
columns = panel_count < 3 ? panel_count : 2
rows = (panel_count + columns - 1) / columns
set terminal pngcairo noenhanced size 760*columns, 520*rows font "sans,12" background "#ffffff"
set output png
heading = "Speed against accuracy: a frame's time and its error; the grey step is the Pareto front"
set multiplot layout rows, columns title heading font "sans,14"
set logscale xy
set format y "%g"
set xlabel "relative L2 error of radiosity against the converged reference"
set ylabel "frame, ms (one thread unless chart.csv says otherwise)"
set grid xtics ytics lt 1 lw 1 lc rgb "#e4e4e4"
set key bottom left opaque box lc rgb "#cccccc"
set format x "%.0e"
array colors[8] = ["#777777", "#1b6ca8", "#e07b00", "#b3202c", "#3a8a3a", "#7b4fa3", "#00929c", "#8a5a2b"]
present(file) = int(system("test -s '".file."' && echo 1 || echo 0"))
do for [p = 1:panel_count] {
    set title panels[p]
    pareto = sprintf("%s/%d-pareto.points", work, p)
    plot pareto using 1:2 with steps lw 6 lc rgb "#d9d9d9" title "Pareto front", \
         for [m = 1:method_count] file = sprintf("%s/%d-%d.points", work, p, m) \
             (present(file) ? file : "/dev/null") using 1:2 with linespoints lw 2 pt 7 ps 1.2 \
             lc rgb colors[1 + (m - 1) % 8] title methods[m]
}
unset multiplot
