#!/bin/sh
# Runs test programs and scripts and adds up their closing lines 'N passed, N failed' (', N skipped' may follow). A test
# that prints no such line, that fails without counting a failure, or that never ended, counts as one failure.
# Bars that a test missed without failing (CHECK_BAR of tests/common/test.h) are listed again at the end.
#   tests/run.sh TEST...      SSS_TEST_SECONDS: limit for each, default 1200
# What measures time has the machine to itself: the tests of a program that are marked TEST_TIMED, and scripts with a
# line that begins '# Measures time'. Behind those the rest of the programs, then the rest of the scripts, two at a
# time; test_sanitize.sh asks the programs' logs what is quick. What a test says is printed when it ends. One TEST by
# itself runs whole and is heard at once.
cd "$(dirname "$0")/.." || exit 1
logs=build/tests/logs
mkdir -p "$logs" || exit 1

# Runs a command as NAME: what it says goes to NAME.log and to descriptor 3; exit status, seconds by the clock and
# seconds of processors to NAME.result.
if [ "${1:-}" = --one ]; then
    name=$2
    shift 2
    start=$(date +%s)
    # The status survives the pipe in a file.
    { timeout "${SSS_TEST_SECONDS:-1200}" "$@" </dev/null 2>&1; echo $? >"$logs/$name.status"; } |
        tee "$logs/$name.log" >&3
    took=$(($(date +%s) - start))
    times >"$logs/$name.times"
    cpu=$(tail -n 1 "$logs/$name.times" | tr ms '  ' | awk '{ printf "%.0f", 60 * ($1 + $3) + $2 + $4 }')
    echo "$(cat "$logs/$name.status") $took $cpu" >"$logs/$name.result"
    rm -f "$logs/$name.status" "$logs/$name.times"
    echo "$name"
    exit 0
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
: >"$work/timed" >"$work/programs" >"$work/scripts"
slots=2
[ "$(nproc)" -ge 2 ] || slots=1

# ---- what is to run: lists of "NAME COMMAND" ----

add() # TEST
{
    name=$(basename "$1" .sh)
    case $1 in
        *.sh)
            list=scripts
            ! grep -q '^# Measures time' "$1" || list=timed
            echo "$name sh $1" >>"$work/$list" ;;
        *)
            all=$("./$1" --list 2>/dev/null) timed=$("./$1" --list-timed 2>/dev/null)
            [ -z "$timed" ] || echo "$name.timed ./$1 --timed" >>"$work/timed"
            [ -n "$timed" ] && [ "$timed" = "$all" ] || echo "$name ./$1 --untimed" >>"$work/programs" ;;
    esac
}

if [ $# = 1 ]; then
    case $1 in *.sh) command="sh $1" ;; *) command=./$1 ;; esac
    echo "$(basename "$1" .sh) $command" >"$work/programs"
else
    for test in "$@"; do add "$test"; done
    # The longest first, lest all wait for it in the end. Only an order: what is not named here follows.
    for name in test_sanitize test_compile test_readme test_fuzz test_hostile_glb; do
        grep "^$name " "$work/scripts"
    done >"$work/order"
    grep -v -x -F -f "$work/order" "$work/scripts" >>"$work/order"
    mv "$work/order" "$work/scripts"
fi
cat "$work/timed" "$work/programs" "$work/scripts" >"$work/all"
while read -r name command; do rm -f "$logs/$name.log" "$logs/$name.result"; done <"$work/all"

# ---- running ----

run_list() # list, how many at a time; each has its share of the processors (SSS_JOBS, see tests/compile/jobs.sh)
{
    SSS_JOBS=$(($(nproc) / $2)) xargs -r -P "$2" -L 1 sh tests/run.sh --one <"$1" 3>/dev/null | while read -r name; do
        printf '==== %s\n' "$name"
        cat "$logs/$name.log"
    done
}

if [ $# = 1 ]; then
    read -r name command <"$work/programs"
    printf '==== %s\n' "$name"
    sh tests/run.sh --one "$name" $command 3>&1 >/dev/null
else
    run_list "$work/timed" 1
    run_list "$work/programs" $slots
    run_list "$work/scripts" $slots
fi

# ---- adding up ----

passed=0 failed=0 skipped=0
missed=$logs/missed
: >"$missed"
printf '\n==== summary\n'
while read -r name command; do
    log=$logs/$name.log
    [ -e "$log" ] || : >"$log"
    set -- $(grep -E '^[0-9]+ passed, [0-9]+ failed(, [0-9]+ skipped)?$' "$log" | tail -n 1 | tr -cs 0-9 ' ')
    numbers=$# p=${1:-0} f=${2:-0} s=${3:-0} remark=
    set -- $(cat "$logs/$name.result" 2>/dev/null)
    status=${1:-none} took=${2:-0} cpu=${3:-0}
    if [ "$status" = none ]; then f=$((f + 1)) remark=" (never ended)"
    elif [ $numbers -lt 2 ] || [ $((p + f)) = 0 ]; then f=$((f + 1)) remark=" (no check ran)"
    elif [ "$status" != 0 ] && [ "$f" = 0 ]; then f=1 remark=" (exit status $status)"
    elif [ "$status" = 0 ] && [ "$f" != 0 ]; then remark=" (exit status 0 in spite of failures)"
    fi
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
    sed -n "s/^MISSED  /  ${name%.timed}: /p" "$log" >>"$missed"
    printf '%-24s %7d passed %5d failed %4d s, %4d s of processors%s\n' "$name" "$p" "$f" "$took" "$cpu" "$remark"
done <"$work/all"

if [ -s "$missed" ]; then
    printf '==== MISSED BARS, held only to bounds against regressions: %d\n' "$(wc -l <"$missed")"
    cat "$missed"
fi
[ "$skipped" = 0 ] || echo "skipped in all: $skipped"
printf '%d passed, %d failed\n' "$passed" "$failed"
[ "$failed" = 0 ] && [ "$passed" != 0 ]
