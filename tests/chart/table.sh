#!/bin/sh
# The table of README.md from chart.csv: every run on the bunny at 50 mm in marble.
#   tests/chart/table.sh           prints it
#   tests/chart/table.sh --write   puts it into README.md between its two markers
#   tests/chart/table.sh --check   fails if README.md has another
set -eu
cd "$(dirname "$0")/../.."
begin='<!-- tests/chart/table.sh: begin -->'
end='<!-- tests/chart/table.sh: end -->'
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

awk -F, '
    function parameter(key,   list, n, i, pair)
    {
        n = split($column["parameters"], list, ";")
        for (i = 1; i <= n; ++i) { split(list[i], pair, "="); if (pair[1] == key) return pair[2] }
        return ""
    }
    NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
    $column["size_mm"] == 50 && $column["material"] == "Marble" {
        n++
        method[n] = $column["method"]; ms[n] = $column["frame_ms"]; error[n] = $column["rel_l2"]
        picture[n] = $column["image_rmse"]; emitters[n] = parameter("emitters"); tolerance[n] = parameter("tolerance")
        threads = $column["threads"]
        if (method[n] == "direct-scalar") loop = ms[n]
    }
    END {
        printf "| method | triangles gathered from | tolerance | frame, ms | times the plain loop |"
        printf " relative L2 error | picture |\n"
        printf "|---|--:|--:|--:|--:|--:|--:|\n"
        for (i = 1; i <= n; ++i)
            printf "| %s | %s | %s | %.4g | %.3g | %.1e | %s |\n", method[i], emitters[i] == "" ? "-" : emitters[i],
                   (method[i] ~ /points|scalar|lambert/ ? "-" : tolerance[i]), ms[i], loop / ms[i], error[i],
                   picture[i] == "" ? "-" : sprintf("%.1e", picture[i])
    }' tests/chart/chart.csv >"$work/table"

case ${1:-} in
    --write)
        awk -v begin="$begin" -v end="$end" -v table="$work/table" '
            $0 == begin { print; while ((getline line < table) > 0) print line; inside = 1; next }
            $0 == end { inside = 0 }
            !inside' README.md >"$work/readme"
        cat "$work/readme" >README.md ;;
    --check)
        awk -v begin="$begin" -v end="$end" '$0 == end { inside = 0 } inside { print } $0 == begin { inside = 1 }' \
            README.md >"$work/there"
        [ -s "$work/there" ] && diff "$work/there" "$work/table" ;;
    *)  cat "$work/table" ;;
esac
