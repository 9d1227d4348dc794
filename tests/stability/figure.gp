# Called by stability.sh with `method`, `csv`, `png` and `here`. One small panel for each sweep: first the method
# against the converged integral of its own geometry, then the dipole model against what is true, then what bad input
# costs, then what is the method's own (METHOD/panels.gp).
load here."/".method."/series.gp" # all_series, header, own_rows
columns = 5
rows_in_all = 5 + own_rows
set terminal pngcairo noenhanced size 420 * columns, 330 * rows_in_all font "sans,9" background "#ffffff"
set output png
set datafile separator ","
set multiplot layout rows_in_all, columns title header." where it is hard" font "sans,14"
array colors[3] = ["#1b6ca8", "#e07b00", "#3a8a3a"]
set style line 3 lw 1 dt 2 lc rgb "#777777"
set pointsize 0.5
set grid lt 1 lw 1 lc rgb "#e4e4e4"
set key bottom left opaque box lc rgb "#cccccc" samplen 2
set format x "%g"
set format y "%.0e"
rows(name, series) = sprintf("< awk -F, '$1 == \"%s\" && $2 == \"%s\"' '%s' | sort -t, -k3,3g", name, series, csv)
last(i) = word(all_series, i)

# Columns of the csv: 4 rel_l2, 6 predicted, 8 model, 9 input, 10 said, 11 value, 12 ideal.
set logscale xy
set yrange [1e-6:10]
set ylabel "method: relative L2 error"
names = "slab sphere albedo fingers slivers fan coarse noise grazing size holes normals windings turning scale"
do for [name in names] {
    set title name eq "slab" ? "slab under a light from above" : name eq "sphere" ? "sphere lit from one side" : \
              name eq "albedo" ? "sphere of radius 5, less and less albedo" : \
              name eq "fingers" ? "two fingers, one of them lit" : name eq "slivers" ? "slivers between cells" : \
              name eq "fan" ? "a fan of triangles beside cells" : name eq "coarse" ? "sphere of radius 15, coarser" : \
              name eq "noise" ? "sphere of radius 5, vertices displaced" : \
              name eq "grazing" ? "sheet with bumps, light lower and lower" : \
              name eq "size" ? "sphere of any size" : name eq "holes" ? "triangles missing" : \
              name eq "normals" ? "vertex normals turned over" : name eq "windings" ? "triangles turned over" : \
              name eq "turning" ? "a light turns in steps of half a degree" : "units of 1e-6 to 1e6 mm"
    set xlabel name eq "slab" ? "thickness, mean free paths" : name eq "sphere" || name eq "size" ? \
              "radius, mean free paths" : name eq "albedo" ? "alpha'" : name eq "fingers" ? "gap, mean free paths" : \
              name eq "slivers" ? "aspect" : name eq "fan" ? "length, mean free paths" : \
              name eq "coarse" ? "mean edge, mean free paths" : name eq "noise" ? "amplitude, mean edges" : \
              name eq "grazing" ? "elevation of the light, degrees" : name eq "turning" ? "degrees" : \
              name eq "scale" ? "mm per unit" : "share"
    if (name eq "holes" || name eq "normals" || name eq "windings" || name eq "turning") { unset logscale x } \
    else { set logscale x }
    plot for [i=1:words(all_series)] rows(name, last(i)) using 2+1:4 with linespoints lw 1.5 pt 7 lc rgb colors[i] \
             title last(i), \
         for [i=1:words(all_series)] rows(name, last(i)) using 3:6 with lines lw 1 dt 2 lc rgb colors[i] \
             title i == 1 ? "as stats predict" : ""
}

set ylabel "largest step over mean B"
set title "flicker: half-degree steps of a light"
set xlabel "degrees"
set yrange [*:*]
unset logscale xy
set format y "%g"
plot for [i=1:words(all_series)] rows("turning", last(i)) using 3:11 with lines lw 1.5 lc rgb colors[i] title last(i), \
     rows("turning", last(1)) using 3:12 with lines ls 3 title "converged"
set logscale xy
set yrange [1e-3:100]
set ylabel "model: relative error"
set format y "%.0e"
do for [face in "front back"] {
    set title "model: slab, ".(face eq "front" ? "lit face" : "dark face")
    set xlabel "thickness, mean free paths"
    plot for [g in geometries] for [a in "0.9 0.99"] rows("slab ".face." ".a, g) using 3:8 with linespoints lw 1.5 \
             pt 7 title g.", alpha' ".a
}
set title "model: sphere without absorption, light from everywhere"
set xlabel "radius, mean free paths"
plot for [g in geometries] rows("sphere", g) using 3:8 with linespoints lw 1.5 pt 7 title g
set title "model: light across the gap of two fingers"
set xlabel "gap, mean free paths"
set ylabel "dark finger over lit one"
plot for [g in geometries] rows("fingers", g) using 3:8 with linespoints lw 1.5 pt 7 title g
set ylabel "input: relative L2 change"
set title "input: coarser sphere of radius 15"
set xlabel "mean edge, mean free paths"
plot for [g in geometries] rows("coarse", g) using 3:9 with linespoints lw 1.5 pt 7 title g
set title "input: displaced vertices"
set xlabel "amplitude, mean edges"
plot for [g in geometries] rows("noise", g) using 3:9 with linespoints lw 1.5 pt 7 title g
set title "input: share of what is wrong"
set xlabel "share of triangles or vertices"
plot for [g in geometries] rows("holes", g) using 3:9 with linespoints lw 1.5 pt 7 title "missing, ".g, \
     for [g in geometries] rows("windings", g) using 3:9 with linespoints lw 1.5 pt 5 title "turned over, ".g, \
     for [g in geometries] rows("normals", g) using 3:9 with linespoints lw 1.5 pt 9 title "normals turned, ".g
set title "what stats say of missing triangles"
set xlabel "share of triangles"
set ylabel "border_mm"
set yrange [*:*]
plot rows("holes", last(1)) using 3:10 with linespoints lw 1.5 pt 7 title "missing", \
     rows("windings", last(1)) using ($3 < 1 ? $3 : 1/0):10 with linespoints lw 1.5 pt 5 title "turned over"
set title "what stats say of turned normals"
set xlabel "share of vertices"
set ylabel "normals_against"
unset logscale xy
set format y "%g"
plot rows("normals", last(1)) using 3:10 with linespoints lw 1.5 pt 7 notitle
load here."/".method."/panels.gp"
unset multiplot
