#!/bin/sh
# README.md of a folder of hao.sh's CSV files, on standard output.      tests/chart/hao/tables.sh FOLDER
set -eu
cd "$1"
column='NR == 1 { for (i = 1; i <= NF; ++i) c[$i] = i; next }'
cat <<'END_OF_TEXT'
# The measurements of Hao and Varshney 2004, repeated

Written by tests/chart/hao.sh; what is measured stands in table.c and figures.c. Marble; lights at random between the
directions of the set. Pictures are drawn from views at random in floating point, tone-mapped into [0, 1] (filmic curve,
sRGB), or linear; exposed so that a hundredth of the pixels reaches white. Of lights and views the worst counts, as in
the paper, which says nothing of exposure. Times are of the machine at hand, the paper's of a Pentium 4 at 2 GHz in
2004.

## Table I

50 mm, default options. A frame adds a light and relights every vertex, on one thread. Bytes count everything that is
stored: weights, residuals, indices, reference points, tables. The ratio is the paper's: to a byte for each direction.
Of the bandwidth: the share of the time that reading what is stored once takes, at the speed of memory in the same run.

| model | vertices | channels | references | bytes a vertex | ratio | frames a second | bandwidth | precomputed, s |
|---|--:|--:|--:|--:|--:|--:|--:|--:|
END_OF_TEXT
awk -F, "$column"'
    { printf "| %s | %d | %d | %d | %.1f | %.1f | %.0f | %.0f %% | %.1f |\n",
             $c["model"], $c["vertices"], $c["channels"], $c["references"], $c["bytes_per_vertex"],
             $c["compression"], $c["frames_per_second"],
             100 * $c["of_bandwidth"], $c["precompute_s"] }' table1.csv
cat <<'END_OF_TEXT'
| the paper: horse | 14521 | 1 | 1034 | 27 | 7.4 | 79.1 | | |
| Venus | 42656 | 1 | 2827 | 26 | 7.7 | 27.3 | | |
| Santa | 75781 | 1 | 3458 | 22 | 9.1 | 14.6 | | |
| teapot | 150510 | 1 | 5176 | 20 | 10.0 | 8.6 | | |
| dragon | 437645 | 1 | 10285 | 18 | 11.1 | 2.7 | | |
| Buddha | 543652 | 1 | 12330 | 18 | 11.1 | 2.4 | | |

The paper's frames are drawn as well; its RGB is said to need about 46 bytes a vertex.

## Single numbers

| | model | vertices | here | the paper | on |
|---|---|--:|--:|--:|---|
END_OF_TEXT
awk -F, "$column"'
    { printf "| %s | %s | %d | %s | %s | %s |\n", $c["what"], $c["model"], $c["vertices"], $c["value"], $c["paper"],
             $c["paper_model"] }' numbers.csv
cat <<'END_OF_TEXT'

## The bars

Default options (198 directions, with the header's own shadows), and beside them without shadows and with more
directions. rel_l2 is against the reference of DESIGN.md: rows of the integral at 96 vertices drawn by area, 8 lights at
random, shadows by rays (bar: 2e-2). Image RMSE is against what is neither interpolated nor compressed (bar: 3e-3).

| model | vertices | mm | lights | shadows | rel_l2 | image RMSE | linear | sums | interpolation | storage | predicted |
|---|--:|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|
END_OF_TEXT
awk -F, "$column"'
    { printf "| %s | %d | %g | %d | %s | %.2g | %.2g | %.2g | %.1g | %.2g | %.2g | %.2g |\n",
             $c["model"], $c["vertices"], $c["size_mm"], $c["directions"], $c["shadows"],
             $c["rel_l2"], $c["image_rmse"], $c["image_rmse_linear"],
             $c["sum_error"], $c["interpolation_error"], $c["storage_error"], $c["predicted"] }' bars.csv
cat <<'END_OF_TEXT'

## Figures 5, 9 and 6

The paper says of figure 5: 3e-3 with about 200 directions, for all four of its models.

![figure 5](figure5.png)

Of figure 9, on the teapot with 150,510 vertices: 1,200 reference points (0.8 %) with n = 3 err less than order 7
alone; with 5,176 (3.4 %) the picture is almost indistinguishable.

![figure 9](figure9.png)
END_OF_TEXT
