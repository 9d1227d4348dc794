#!/bin/sh
# Runs test programs and scripts one after the other and adds up their closing lines 'N passed, N failed' (', N skipped'
# may follow). A test that prints no such line, or that fails without counting a failure, counts as one failure.
# Bars that a test missed without failing (CHECK_BAR of tests/common/test.h) are listed again at the end.
#   tests/run.sh TEST...      SSS_TEST_SECONDS: limit for each, default 900
cd "$(dirname "$0")/.." || exit 1
logs=build/tests/logs
mkdir -p "$logs" || exit 1

passed=0 failed=0 skipped=0 summary=
missed=$logs/missed
: >"$missed"
for test in "$@"; do
    name=$(basename "$test" .sh)
    log=$logs/$name.log
    printf '==== %s\n' "$name"
    case $test in
        *.sh) set -- sh "$test" ;;
        *)    set -- "./$test" ;;
    esac
    start=$(date +%s)
    # The status survives the pipe in a file.
    { timeout "${SSS_TEST_SECONDS:-900}" "$@" </dev/null 2>&1; echo $? >"$log.status"; } | tee "$log"
    status=$(cat "$log.status")
    took=$(( $(date +%s) - start ))

    counts=$(grep -E '^[0-9]+ passed, [0-9]+ failed(, [0-9]+ skipped)?$' "$log" | tail -n 1 | tr -cs 0-9 ' ')
    set -- $counts
    p=${1:-0} f=${2:-0} s=${3:-0} remark=
    if [ $# -lt 2 ] || [ $((p + f)) = 0 ]; then f=$((f + 1)) remark=" (no check ran)"
    elif [ "$status" != 0 ] && [ "$f" = 0 ]; then f=1 remark=" (exit status $status)"
    elif [ "$status" = 0 ] && [ "$f" != 0 ]; then remark=" (exit status 0 in spite of failures)"
    fi
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
    sed -n "s/^MISSED  /  $name: /p" "$log" >>"$missed"
    summary="$summary$(printf '%-24s %7d passed %5d failed %4d s%s' "$name" "$p" "$f" "$took" "$remark")
"
done

printf '\n==== summary\n%s' "$summary"
if [ -s "$missed" ]; then
    printf '==== MISSED BARS, held only to bounds against regressions: %d\n' "$(wc -l <"$missed")"
    cat "$missed"
fi
[ "$skipped" = 0 ] || echo "skipped in all: $skipped"
printf '%d passed, %d failed\n' "$passed" "$failed"
[ "$failed" = 0 ] && [ "$passed" != 0 ]
