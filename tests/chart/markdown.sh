#!/bin/sh
# chart.md from a chart.csv: what is cheapest at each tolerance, then a table for each case, its front marked.
#      tests/chart/markdown.sh IN.csv >OUT.md
set -eu
here=$(cd "$(dirname "$0")" && pwd)
awk -F, -f "$here/front.awk" -f "$here/markdown.awk" "$1"
