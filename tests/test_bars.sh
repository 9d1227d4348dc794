#!/bin/sh
# The harness itself: a bar that is missed is printed, listed again by tests/run.sh, and fails only beyond the bound
# against regressions; a bar that is reached is not mentioned. And tests/run.sh with many tests: nothing is lost,
# whatever they die of, and what measures time is alone.
cd "$(dirname "$0")/.." || exit 1
. tests/compile/jobs.sh

# A program that compares value with bar and bound.
program() # name, macro, value, bar, regression
{
    cat >"$work/$1.c" <<END
#include "tests/common/test.h"
static void the_test(void)
{
    test_about("%s", "$1");
    $2($3, $4, $5, "a number");
}
int main(int argc, char **argv)
{
    static const test_case tests[] = {TEST(the_test)};
    return test_main(argc, argv, "$1", tests, 1);
}
END
    ${CC:-cc} -std=c99 -I. "$work/$1.c" build/libtests.a -lcmocka -lpthread -lm -o "$work/test_$1" &&
        (cd "$work" && mkdir -p tests && cp "$OLDPWD/tests/run.sh" tests/ && sh tests/run.sh "test_$1") \
            >"$work/$1.log" 2>&1
    echo "status $?" >>"$work/$1.log"
}
program reached CHECK_BAR_ABOVE 120.0 100.0 50.0
program missed CHECK_BAR_ABOVE 57.0 100.0 50.0
program fallen CHECK_BAR_ABOVE 40.0 100.0 50.0
program reached_below CHECK_BAR_BELOW 0.5 1.0 2.0
program missed_below CHECK_BAR_BELOW 1.5 1.0 2.0
program fallen_below CHECK_BAR_BELOW 3.0 1.0 2.0
program no_number CHECK_BAR_BELOW "0.0 / 0.0" 1.0 2.0

for name in reached reached_below; do
    job "$name: passes and says nothing of a miss" \
        "! grep -i missed '$work/$name.log' && grep -x '1 passed, 0 failed' '$work/$name.log' &&
         grep -x 'status 0' '$work/$name.log'"
done
for name in missed missed_below; do
    job "$name: passes, and the miss is listed behind the summary" \
        "sed '1,/==== summary/d' '$work/$name.log' | grep \"test_$name: the_test: $name: a number: bar .*, got\" &&
         grep -x '1 bars missed' '$work/$name.log' && grep -x '1 passed, 0 failed' '$work/$name.log' &&
         grep -x 'status 0' '$work/$name.log'"
done
for name in fallen fallen_below no_number; do
    job "$name: fails, and is listed as well" \
        "sed '1,/==== summary/d' '$work/$name.log' | grep \"test_$name: the_test: $name: a number: bar .*, got\" &&
         grep -x '0 passed, 1 failed' '$work/$name.log' && grep -x 'status 1' '$work/$name.log'"
done

# ---- many tests at a time ----

# Two programs, of which one has a timed test; scripts that pass, fail, stop without a word, are killed, hang, and kill
# what runs them. Each leaves the moments of its beginning and end.
many=$work/many
mkdir -p "$many/tests"
cp tests/run.sh "$many/tests/"
cat >"$work/moments.c" <<'END'
#define _POSIX_C_SOURCE 200809L
#include "tests/common/test.h"
#include <stdio.h>
#include <time.h>
static void moments(const char *name)
{
    const struct timespec pause = {0, 300000000};
    FILE *file = fopen(name, "w");
    if (!CHECK(file != NULL))
        return;
    fprintf(file, "%.3f ", test_seconds());
    nanosleep(&pause, NULL);
    fprintf(file, "%.3f\n", test_seconds());
    fclose(file);
}
static void a_timed_test(void) { moments("timed.moments"); }
static void another(void) { moments("another.moments"); }
int main(int argc, char **argv)
{
    static const test_case tests[] = {TEST(another), TEST_TIMED(a_timed_test)};
    return test_main(argc, argv, "moments", tests, sizeof tests / sizeof *tests);
}
END
${CC:-cc} -std=c99 -I. "$work/moments.c" build/libtests.a -lcmocka -lpthread -lm -o "$many/test_moments"
cp "$work/test_missed" "$many/"
script() { printf '%s\n' "$2" >"$many/tests/test_$1.sh"; }
script passing 'echo "3 passed, 0 failed"'
script failing 'echo "2 passed, 1 failed"; exit 1'
script silent 'echo nothing'
script killed 'echo "1 passed, 0 failed"; kill -9 $$'
script hanging 'echo "1 passed, 0 failed"; sleep 60'
script alone '# Measures time.
echo "1 passed, 0 failed"'
(cd "$many" && SSS_TEST_SECONDS=5 sh tests/run.sh test_moments test_missed tests/test_*.sh) >"$work/many.log" 2>&1
echo "status $?" >>"$work/many.log"
(cd "$many" && sh tests/run.sh test_moments tests/test_passing.sh) >"$work/good.log" 2>&1
echo "status $?" >>"$work/good.log"
script murderous 'echo "1 passed, 0 failed"; kill -9 $(ps -o ppid= -p $(ps -o ppid= -p $PPID))'
(cd "$many" && sh tests/run.sh tests/test_murderous.sh tests/test_passing.sh) >"$work/murder.log" 2>&1
echo "status $?" >>"$work/murder.log"

said() { job "run.sh: $1" "grep -q -x -e '$3' '$work/$2.log' || { cat '$work/$2.log'; false; }"; }
said "all counts, and a failure for each that was killed, hung or said nothing" many '11 passed, 4 failed'
said "its status tells" many 'status 1'
said "the killed one is named" many 'test_killed .*(exit status 137)'
said "the hanging one is named" many 'test_hanging .*(exit status 124)'
said "the silent one is named" many 'test_silent .*(no check ran)'
said "a missed bar is listed" many '  test_missed: the_test: missed: a number: bar 100, got 57'
said "a program's timed tests run apart" many 'test_moments.timed .* 1 passed .*'
said "what passes passes" good '5 passed, 0 failed'
said "and its status tells" good 'status 0'
said "a test whose runner is killed has failed" murder 'test_murderous .*(never ended)'
said "and so has the whole" murder 'status 1'
job "run.sh: every log is printed whole, once" "
    [ \$(grep -c '^==== test_' '$work/many.log') = 9 ] &&
    [ \"\$(grep -A1 -x '==== test_failing' '$work/many.log' | tail -n 1)\" = '2 passed, 1 failed' ]"
job "run.sh: the timed test had ended when the next began" "
    cat '$many/timed.moments' '$many/another.moments' | awk 'NR == 1 { end = \$2 } NR == 2 { exit !(\$1 >= end) }'"
jobs_end
