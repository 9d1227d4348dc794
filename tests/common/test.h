// The test harness of the family, on top of cmocka: checks that print what they measured beside their bound,
// count, and go on after a failure; a table of named tests; one plain line at the end.
//
//     static void one_and_one(void)
//     {   // Oracle: counting.
//         CHECK_REL(1.0 + 1.0, 2.0, 1e-15);
//     }
//
//     int main(int argc, char **argv)
//     {
//         static const test_case tests[] = {TEST(one_and_one)};
//         return test_main(argc, argv, "arithmetic", tests, sizeof tests / sizeof *tests);
//     }
//
// argv[1], if given, runs only the tests whose name contains it, "--timed" those marked TEST_TIMED, "--untimed" the
// others; "--list" and "--list-timed" list them. The last line is
// "N passed, N failed", in checks; before it, where bars were missed, "N bars missed". Exit status 1 if a check failed,
// a test crashed, or nothing was checked. Checks are for the main thread only.

#ifndef SSS_TESTS_TEST_H
#define SSS_TESTS_TEST_H

#include <stddef.h>

typedef struct test_case
{
    const char *name;
    void (*run)(void);
    int timed; // compares clock times: nothing may run beside it
} test_case;

#define TEST(function) {#function, function, 0}
#define TEST_TIMED(function) {#function, function, 1}

// True, else a failure.
#define CHECK(condition) test_check((condition) ? 1 : 0, #condition, __FILE__, __LINE__)

// |got - want| <= bound |want|; for want = 0 only 0 will do. NaN and infinity fail, unless both are the same infinity.
#define CHECK_REL(got, want, bound) test_check_rel((got), (want), (bound), #got, __FILE__, __LINE__)

// |got - want| <= bound.
#define CHECK_ABS(got, want, bound) test_check_abs((got), (want), (bound), #got, __FILE__, __LINE__)

// value <= bound; NaN fails.
#define CHECK_BELOW(value, bound) test_check_below((value), (bound), #value, __FILE__, __LINE__)

// low <= value <= high, where too good is also wrong; NaN fails.
#define CHECK_BETWEEN(value, low, high) test_check_between((value), (low), (high), #value, __FILE__, __LINE__)

// A bar that the project has set itself: an error is at most `bar`, a ratio of speeds at least. What misses it is
// printed as a line that begins with "MISSED", counted apart, and listed again when all tests are through
// (tests/run.sh): nobody may overlook it. It fails only beyond `regression`, the bound that this code has been measured
// to hold, with room for the clock where the clock is the oracle. `what` is a phrase, since the line must be understood
// on its own.
#define CHECK_BAR_BELOW(value, bar, regression, what)                                                                  \
    test_check_bar((value), (bar), (regression), 0, (what), __FILE__, __LINE__)
#define CHECK_BAR_ABOVE(value, bar, regression, what)                                                                  \
    test_check_bar((value), (bar), (regression), 1, (what), __FILE__, __LINE__)

// Two integers (results, counts) are equal.
#define CHECK_EQUAL(got, want) test_check_equal((long long)(got), (long long)(want), #got, __FILE__, __LINE__)

// Leaves the test: what it needs is not there.
#define SKIP(reason)                                                                                                   \
    do                                                                                                                 \
    {                                                                                                                  \
        test_skip((reason), __FILE__, __LINE__);                                                                       \
        return;                                                                                                        \
    } while (0)

// Names what the checks that follow are about (a material, a mesh); NULL or "" clears it; cleared at each test's
// start. printf format; at most 127 characters are kept.
void test_about(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;

// A number worth reading that is no check: "  note: ...".
void test_note(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ;

// Wall-clock seconds from some fixed moment.
double test_seconds(void);

int test_check(int passed, const char *what, const char *file, int line);
int test_check_rel(double got, double want, double bound, const char *what, const char *file, int line);
int test_check_abs(double got, double want, double bound, const char *what, const char *file, int line);
int test_check_below(double value, double bound, const char *what, const char *file, int line);
int test_check_between(double value, double low, double high, const char *what, const char *file, int line);
int test_check_equal(long long got, long long want, const char *what, const char *file, int line);
int test_check_bar(double value, double bar, double regression, int above, const char *what, const char *file,
                   int line);
void test_skip(const char *reason, const char *file, int line);

// Runs the table; returns the exit status for main.
int test_main(int argc, char **argv, const char *program, const test_case *tests, size_t test_count);

#endif
