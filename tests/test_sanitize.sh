#!/bin/sh
# The test programs under the address, undefined-behaviour and leak sanitizers of gcc and clang. Of each program the
# quickest tests run, as many as took SSS_SANITIZE_SECONDS (default 3) together without sanitizers, which make them some
# twenty times slower; what is left out is named, and what is left in must call every public function. One compiler
# does it, clang where there is one; the other's sanitizers look for the same, and see the QUICK STARTs alone.
# Also every QUICK START, whole, and the sanitizers themselves: each must find what it is there for.
cd "$(dirname "$0")/.." || exit 1
. tests/compile/jobs.sh
limit=${SSS_SANITIZE_SECONDS:-3}
# Where memory goes wrong: these run in any case.
always=" every_allocation_may_fail splitting_changes_no_bit edits_end_where_a_fresh_build_ends density_sets_the_size "
out=build/sanitize
mkdir -p $out
# Float divisions by zero are defined (IEC 60559) and give infinities that functions check for; the rest stops a test.
# -O1 makes these programs run five times as fast as -O0 does, and take five times as long to compile: what runs for a
# moment only has -O0.
flags="-g1 -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all"
export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1:detect_stack_use_after_return=1
export UBSAN_OPTIONS=print_stacktrace=1

# Tests of a program and their seconds, from a run without sanitizers: "name seconds".
test_times()
{
    log=build/tests/logs/$1.log timed=build/tests/logs/$1.timed.log # tests/run.sh has run the two parts apart
    mkdir -p build/tests/logs
    if ! [ -s "$log" ] || ! [ "$log" -nt "build/tests/$1" ]; then
        "build/tests/$1" >"$log" 2>&1 </dev/null
        rm -f "$timed"
    fi
    cat "$log" "$timed" 2>/dev/null |
        awk '/^\[ RUN / { name = $NF } /^  time  / && !(name in seen) { seen[name]; print name, $2 }'
}

# OpenGL drivers have leaks of their own, the rest of test_bake is another program, and the examples' shapes go through
# C++ libraries.
sources=$(ls tests/test_*.c | grep -v -E 'test_(glsl|bake|shapes)\.c$')

build() # compiler: all programs, as many at a time as jobs.sh would; what they share is compiled once
{
    export compiler=$1 flags out work
    objects=$out/common-$compiler
    rm -rf "$objects" "$out/libtests-$compiler.a"
    mkdir "$objects"
    printf '%s\n' tests/common/*.c examples/common/threads.c | xargs -P "${SSS_JOBS:-$(nproc)}" -I SOURCE sh -c '
        $compiler -std=c99 -O1 $flags -I. -c SOURCE -o "$1/$(basename SOURCE .c).o"' sh "$objects" \
        >"$work/common-$compiler.log" 2>&1 && ar rcs "$out/libtests-$compiler.a" "$objects"/*.o
    printf '%s\n' $sources | xargs -P "${SSS_JOBS:-$(nproc)}" -I SOURCE sh -c '
        name=$(basename SOURCE .c)
        level=-O1
        [ $name != test_include ] || level=-O0
        cat "$work/common-$compiler.log" >"$work/$name-$compiler.log"
        $compiler -std=c99 $level $flags -I. SOURCE "$out/libtests-$compiler.a" -lcmocka -Wl,--as-needed -lembree3 \
            -lpthread -lm -o "$out/$name-$compiler" >>"$work/$name-$compiler.log" 2>&1 || rm -f "$out/$name-$compiler"'
}
if have clang; then build clang; else build gcc; fi

first=
for compiler in clang gcc; do
    have $compiler || { skip "everything with $compiler" "not installed"; continue; }
    for source in $([ -n "$first" ] || echo "$sources"); do
        name=$(basename "$source" .c)
        program=$out/$name-$compiler
        [ -x "build/tests/$name" ] || { job "$name is built" false; continue; }
        [ -x "$program" ] ||
            { job "$name: builds with $compiler's sanitizers" "cat '$work/$name-$compiler.log'; false"; continue; }
        test_times "$name" | sort -k 2 -g | awk -v limit="$limit" -v always="$always" '
            index(always, " " $1 " ") { print $0, 1; next }
            { sum += $2; print $0, sum <= limit }' >"$work/$name.times"
        slow=$(awk '!$3 { print $1 }' "$work/$name.times" | tr '\n' ' ')
        [ -z "$slow" ] || echo "  left out of $name, $compiler, for time: $slow"
        awk '$3 { print $1 }' "$work/$name.times" >"$work/$name.chosen"
        header=sss_${name#test_}.h
        [ ! -e "$header" ] || job "$name, $compiler: what runs calls every public function of $header" "
            awk -f tests/compile/uncalled.awk $header '$source' '$work/$name.chosen' >'$work/$name-$compiler.uncalled'
            cat '$work/$name-$compiler.uncalled'; [ ! -s '$work/$name-$compiler.uncalled' ]"
        for test in $(cat "$work/$name.chosen"); do
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
        quick_start "$header" >"$work/$x-quick.c"
        job "QUICK START of $header, $compiler" "
            $compiler -std=c99 -O0 $flags -I. '$work/$x-quick.c' -lm -o '$out/$x-quick-$compiler' &&
            timeout 300 '$out/$x-quick-$compiler'"
    done

    # What must be found.
    job_fails "$compiler: a public function that nothing calls is noticed" "
        echo the_oracles_agree >'$work/little'
        awk -f tests/compile/uncalled.awk sss_bem.h tests/test_bem.c '$work/little'; false" sss_bem_predict_error
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
            $compiler -std=c99 -O1 $flags '$work/${case%%:*}.c' -o '$work/${case%%:*}-$compiler' 2>/dev/null &&
            '$work/${case%%:*}-$compiler'" "${case#*:}"
    done
    first=$compiler
done
jobs_end
