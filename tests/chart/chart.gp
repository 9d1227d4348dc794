# Called by draw.sh with `work`, the folder of the points, `picture` and its `kind`, svg or png.
load work."/lists.gp"
columns = panel_count < 4 ? panel_count + 1 : 4
rows = (panel_count + columns) / columns # one more cell for the legend
if (kind eq "svg") {
    set terminal svg noenhanced size 420*columns, 330*rows font "sans,12" background "#ffffff"
} else {
    set terminal pngcairo noenhanced size 420*columns, 330*rows font "sans,10" background "#ffffff"
}
set output picture
heading = "Speed against accuracy: a frame's time and the error of the method; dashed: the error of the dipole itself"
set multiplot layout rows, columns title heading font "sans,14"
set logscale xy
set format y "1e%T"
set format x "1e%T"
set xlabel "relative L2 error of radiosity"
set ylabel "frame, ms"
set grid xtics ytics lt 1 lw 1 lc rgb "#e4e4e4"
set tics nomirror
unset mxtics
unset mytics
set lmargin 11
set rmargin 2.5
array colors[12] = ["#777777", "#1b6ca8", "#6fb1e0", "#a9a9a9", "#e07b00", "#b3202c", "#e86a74", "#3a8a3a", "#8fc98f", \
                    "#7b4fa3", "#00929c", "#8a5a2b"]
array kinds[3] = ["the model's error: distance only", "the model's error: placed", "the model's error: guarded placed"]
array shades[3] = ["#444444", "#e07b00", "#b3202c"]
color(k) = colors[1 + (k - 1) % 12]
present(file) = int(system("test -s '".file."' && echo 1 || echo 0"))
unset key
do for [p = 1:panel_count] {
    set title panels[p] offset 0, -0.6
    unset arrow
    unset object
    do for [kind_at = 1:3] {
        m = model[3*(p - 1) + kind_at] + 0.0
        n = noise[3*(p - 1) + kind_at] + 0.0
        if (m > 0 && m < x_high) {
            set object rectangle from (m > 2*n ? m - n : m/2), graph 0 to m + n, graph 1 behind fillstyle solid 0.15 \
                noborder fillcolor rgb shades[kind_at]
            set arrow from m, graph 0 to m, graph 1 nohead lw 1.5 dt 2 lc rgb shades[kind_at]
        }
    }
    pareto = sprintf("%s/%d-pareto.points", work, p)
    command = sprintf("plot '%s' using 1:2 with steps lw 6 lc rgb '#d9d9d9'", pareto)
    do for [k = 1:curve_count] {
        file = sprintf("%s/%d-%d.points", work, p, k)
        if (present(file)) {
            look = sprintf("lc rgb '%s'", color(k))
            spread = "using 1:3:(0):($4 - $3) with vectors nohead lw 1" # from the quickest frame to the slowest
            command = command.sprintf(", '%s' %s %s", file, spread, look)
            command = command.sprintf(", '%s' using 1:2 with linespoints lw 1.5 pt 7 ps 0.5 %s", file, look)
        }
    }
    eval command
}
unset arrow
unset object
unset title
unset xlabel
unset ylabel
unset tics
unset border
unset grid
set key center center samplen 3 spacing 1.2
plot for [k = 1:curve_count] NaN with linespoints lw 2 pt 7 ps 0.7 lc rgb color(k) title curves[k], \
     NaN with lines lw 6 lc rgb "#d9d9d9" title "the Pareto front", \
     for [k = 1:3] NaN with lines lw 1.5 dt 2 lc rgb shades[k] title kinds[k]
unset multiplot
