#!/bin/sh
# The test programs under the address, undefined-behaviour and leak sanitizers of gcc and clang. Of each program the
# quickest tests run, as many as took SSS_SANITIZE_SECONDS (default 5) together without sanitizers, which make them some
# twenty times slower; what is left out is named.
# Also every QUICK START, whole, and the sanitizers themselves: each must find what it is there for.
cd "$(dirname "$0")/.." || exit 1
. tests/compile/jobs.sh
limit=${SSS_SANITIZE_SECONDS:-5}
out=build/sanitize
mkdir -p $out
# Float divisions by zero are defined (IEC 60559) and give infinities that functions check for; the rest stops a test.
flags="-g -O1 -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all"
export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1:detect_stack_use_after_return=1
export UBSAN_OPTIONS=print_stacktrace=1

# Tests of a program and their seconds, from a run without sanitizers: "name seconds".
test_times()
{
    log=build/tests/logs/$1.log
    mkdir -p build/tests/logs
    [ -s "$log" ] && [ "$log" -nt "build/tests/$1" ] || "build/tests/$1" >"$log" 2>&1 </dev/null
    awk '/^\[ RUN / { name = $NF } /^  time  / { print name, $2 }' "$log"
}

for compiler in gcc clang; do
    have $compiler || { skip "everything with $compiler" "not installed"; continue; }
    for source in tests/test_*.c; do
        name=$(basename "$source" .c)
        # OpenGL drivers have leaks of their own, the rest of test_bake is another program, and the examples' shapes go
        # through C++ libraries.
        case $name in test_glsl|test_bake|test_shapes) continue ;; esac
        [ -x "build/tests/$name" ] || { job "$name is built" false; continue; }
        program=$out/$name-$compiler
        if ! $compiler -std=c99 $flags -I. "$source" tests/common/*.c -lcmocka -lpthread -lm -o "$program" \
            >"$work/$name-$compiler.log" 2>&1; then
            job "$name: builds with $compiler's sanitizers" "cat '$work/$name-$compiler.log'; false"
            continue
        fi
        test_times "$name" | sort -k 2 -g | awk -v limit="$limit" '{ sum += $2; print $0, sum <= limit }' \
            >"$work/$name.times"
        slow=$(awk '!$3 { print $1 }' "$work/$name.times" | tr '\n' ' ')
        [ -z "$slow" ] || echo "  left out of $name, $compiler, for time: $slow"
        for test in $(awk '$3 { print $1 }' "$work/$name.times"); do
            # A name that lies within another's would run that one too, however long it takes.
            [ "$(grep -c "$test" "$work/$name.times")" = 1 ] || continue
            job "$name, $compiler: $test" "
                timeout 300 '$program' $test >'$work/$name-$compiler-$test.out' 2>&1; status=\$?
                if grep -q -E 'Sanitizer|runtime error' '$work/$name-$compiler-$test.out'; then
                    grep -m1 -A20 -E 'Sanitizer|runtime error' '$work/$name-$compiler-$test.out'; exit 1
                fi
                # A bound on speed may well be missed here: only what the sanitizers say counts, and a crash.
                [ \$status -le 1 ] && grep -q ' passed, ' '$work/$name-$compiler-$test.out'"
        done
    done
    for header in $headers; do
        x=$(lower "$header")
        awk '/^\/\/.*QUICK START/ { inside = 1; next }
             inside && /^\/\/ ?==/ { exit }
             inside && /^\/\/     / { sub(/^\/\/     /, ""); print }' "$header" >"$work/$x-quick.c"
        job "QUICK START of $header, $compiler" "
            $compiler -std=c99 $flags -I. '$work/$x-quick.c' -lm -o '$out/$x-quick-$compiler' &&
            timeout 300 '$out/$x-quick-$compiler'"
    done

    # What must be found.
    cat >"$work/heap.c" <<'END'
#include <stdlib.h>
int main(int c, char **v)
{
    volatile char *volatile p = malloc(4);
    (void)v;
    p[c + 3] = 1;
    free((void *)p);
    return 0;
}
END
    cat >"$work/overflow.c" <<'END'
#include <limits.h>
int main(int c, char **v) { (void)v; return (INT_MAX + c) & 1; }
END
    cat >"$work/leak.c" <<'END'
#include <stdlib.h>
void *volatile p;
int main(void) { p = malloc(40); p = 0; return 0; }
END
    for case in heap:heap-buffer-overflow overflow:'signed integer overflow' leak:'detected memory leaks'; do
        job_fails "$compiler finds a ${case#*:}" "
            $compiler -std=c99 $flags '$work/${case%%:*}.c' -o '$work/${case%%:*}-$compiler' 2>/dev/null &&
            '$work/${case%%:*}-$compiler'" "${case#*:}"
    done
done
jobs_end
