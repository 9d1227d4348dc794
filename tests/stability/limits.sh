#!/bin/sh
# The table "do not use this method when" and the measured lines of the headers' LIMITS, from the csv files.
#   limits.sh --write   into README.md here and into sss_dipole.h, sss_bem.h, sss_hao.h, between their markers
#   limits.sh --check   fails where they hold anything else
# What is told is in limits.txt, how a threshold is found in limits.awk.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
top=$here/../..
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

awk -F';' -v folder="$here" -f "$here/limits.awk" "$here/limits.txt" > "$work/limits"

header_of() { case $1 in direct) echo sss_dipole.h ;; *) echo "sss_$1.h" ;; esac; }

# Each kind of error has a column of its own. First what has a limit, then what was swept without finding one.
table()
{
    echo '| do not use | when | method error | model error | input error | what says so |'
    echo '|---|---|---|---|---|---|'
    for method in direct bem hao; do
        awk -F';' -v header="$(header_of $method)" -v method=$method '
            $1 != method || $4 ~ /no limit/ { next }
            {
                own = $5; model = input = "-"
                what = $4
                if ($3 == "model") model = $6
                else if ($3 == "slab") { what = "slab, " $4; model = $6 " beside diffusion" }
                else if ($3 == "input" || $3 == "facets") input = $6
                else if ($3 == "promise") own = $5 ", " $6 " what is predicted"
                name = header ", " $2
                if ($2 == "walk") name = "any of them"
                printf "| %s | %s | %s | %s | %s | %s |\n", name, what, own, model, input, $7
            }' "$work/limits"
    done
    echo
    echo 'Swept without finding a limit:'
    echo
    awk -F';' '
        $4 ~ /no limit/ {
            worst = $3 == "method" || $3 == "promise" ? $5 : $6
            what = $3 == "slab" ? "slab beside diffusion, " $4 : $4
            printf "- %s, %s: %s; error at most %s\n", $1, $2, what, worst
        }' "$work/limits"
}

lines()
{
    awk -F';' -v method="$1" '
        function put(text)
        {
            lead = "//   * "
            for (; length(text) > 113; lead = "//     ") {
                for (at = 113; substr(text, at, 1) != " "; at--);
                print lead substr(text, 1, at - 1)
                text = substr(text, at + 1)
            }
            print lead text
        }
        $1 != method { next }
        $3 == "model" || $3 == "input" {
            put("10 % " $3 " error: " $2 ", " $4 "; worst " $6 " (" $8 ")"); next }
        $3 == "slab" { put("10 % beside diffusion in a slab: " $4 "; worst " $6 " (" $8 ")"); next }
        $3 == "facets" { put($2 ", " $4 " (" $8 ")"); next }
        $3 == "flicker" { put($2 ", " $4 "; worst +" $6 " (" $8 ")"); next }
        $3 == "promise" { put($2 ", " $4 "; error at most " $5 ", " $6 " what is promised (" $8 ")"); next }
        { put($2 ", " $4 "; error at most " $5 " (" $8 ")") }' "$work/limits"
}

# Between the markers of $1, what stands in $2.
replace()
{
    awk -v begin='BEGIN measured by make stability' -v end='END measured by make stability' -v file="$2" \
        -f "$top/tests/between.awk" "$1"
}

status=0
one()
{
    replace "$1" "$2" > "$work/new" || { echo "limits.sh: no markers in $1" >&2; exit 1; }
    case $mode in
    --write) cmp -s "$work/new" "$1" || cp "$work/new" "$1" ;;
    --check) cmp -s "$work/new" "$1" || { echo "$1 is not what the csv files say: limits.sh --write" >&2; status=1; } ;;
    esac
}

mode=${1:-}
case $mode in --write | --check) ;; *) echo "usage: limits.sh --write|--check" >&2; exit 2 ;; esac
table > "$work/table"
one "$here/README.md" "$work/table"
for method in direct bem hao; do
    lines $method > "$work/lines"
    one "$top/$(header_of $method)" "$work/lines"
done
exit $status
