#!/bin/sh
# The harness itself: a bar that is missed is printed, listed again by tests/run.sh, and fails only beyond the bound
# against regressions; a bar that is reached is not mentioned.
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
jobs_end
