#!/bin/sh
# Every figure, and every table of README.md and of the READMEs under tests/, from the files that make chart, make
# truth, make mertens and make stability left; then the pictures, which the examples draw.      tests/figures.sh
set -eu
cd "$(dirname "$0")/.."
sh tests/chart/draw.sh tests/chart/chart.csv tests/chart/chart.svg tests/chart/chart.png
sh tests/chart/markdown.sh tests/chart/chart.csv >build/chart.md
mv build/chart.md tests/chart/chart.md
sh tests/chart/truth/truth.sh --readme >build/truth.md
mv build/truth.md tests/chart/truth/README.md
for tables in table atlas examples; do sh tests/chart/$tables.sh --write; done
sh tests/chart/hao.sh --draw
sh tests/chart/mertens/mertens.sh --draw
sh tests/stability/stability.sh --draw
sh examples/gallery.sh
