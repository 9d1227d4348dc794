#!/bin/sh
# chart.md from a chart.csv: what is cheapest at each tolerance, then a table for each case, its front marked; with how
# long the measuring took, where IN.time says so.
#      tests/chart/markdown.sh IN.csv >OUT.md
set -eu
here=$(cd "$(dirname "$0")" && pwd)
took=$(cat "${1%.csv}.time" 2>/dev/null || true)
awk -F, -v took="$took" -f "$here/front.awk" -f "$here/markdown.awk" "$1"
