// The harness of test.h.

#define _POSIX_C_SOURCE 200809L // clock_gettime

#include "test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

static size_t g_passed;
static size_t g_failed;
static size_t g_failed_tests;
static size_t g_skipped;    // tests left through SKIP
static int g_left_by_skip;  // the running test was
static size_t g_missed;     // bars that were not reached, whether or not the check failed
static const char *g_test_name = "";
static char g_about[128];

double test_seconds(void)
{
    struct timespec now;
    if (clock_gettime(CLOCK_MONOTONIC, &now) != 0)
        return 0.0;
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void test_about(const char *format, ...)
{
    va_list arguments;
    g_about[0] = '\0';
    if (format == NULL)
        return;
    va_start(arguments, format);
    (void)vsnprintf(g_about, sizeof g_about, format, arguments);
    va_end(arguments);
}

void test_note(const char *format, ...)
{
    va_list arguments;
    printf("  note  ");
    va_start(arguments, format);
    (void)vprintf(format, arguments);
    va_end(arguments);
    printf("\n");
}

// Counts a check and starts its line; the caller prints the numbers.
static void begin_line(int passed, const char *what, const char *file, int line)
{
    if (passed)
        g_passed++;
    else
        g_failed++;
    if (!passed)
        printf("%s:%d: ", file, line);
    printf("  %s  ", passed ? "ok  " : "FAIL");
    if (g_about[0] != '\0')
        printf("[%s] ", g_about);
    printf("%s", what);
}

int test_check(int passed, const char *what, const char *file, int line)
{
    begin_line(passed, what, file, line);
    printf("\n");
    return passed;
}

int test_check_rel(double got, double want, double bound, const char *what, const char *file, int line)
{
    const double difference = fabs(got - want);
    const int same_infinity = isinf(got) && isinf(want) && got == want;
    const double error = (difference == 0.0 || same_infinity) ? 0.0 : difference / fabs(want);
    const int passed = same_infinity || (isfinite(got) && isfinite(want) && error <= bound);
    begin_line(passed, what, file, line);
    printf(": relative error %.2e, bound %.2e (got %.12g, want %.12g)\n", error, bound, got, want);
    return passed;
}

int test_check_abs(double got, double want, double bound, const char *what, const char *file, int line)
{
    const double error = fabs(got - want);
    const int passed = error <= bound;
    begin_line(passed, what, file, line);
    printf(": error %.2e, bound %.2e (got %.12g, want %.12g)\n", error, bound, got, want);
    return passed;
}

int test_check_below(double value, double bound, const char *what, const char *file, int line)
{
    const int passed = value <= bound;
    begin_line(passed, what, file, line);
    printf(": %.4g, bound %.4g\n", value, bound);
    return passed;
}

int test_check_between(double value, double low, double high, const char *what, const char *file, int line)
{
    const int passed = value >= low && value <= high;
    begin_line(passed, what, file, line);
    printf(": %.6g, bounds %.6g to %.6g\n", value, low, high);
    return passed;
}

int test_check_equal(long long got, long long want, const char *what, const char *file, int line)
{
    const int passed = got == want;
    begin_line(passed, what, file, line);
    printf(": %lld, want %lld\n", got, want);
    return passed;
}

int test_check_bar(double value, double bar, double regression, int above, const char *what, const char *file, int line)
{
    const int reached = above ? value >= bar : value <= bar; // false for NaN
    const int held = reached || (above ? value >= regression : value <= regression);
    begin_line(held, what, file, line);
    printf(": %.4g, bar %.4g", value, bar);
    if (!reached)
        printf(", bound against regressions %.4g", regression);
    printf("\n");
    if (!reached)
    {
        g_missed++;
        printf("MISSED  %s: %s%s%s: bar %.4g, got %.4g\n", g_test_name, g_about, g_about[0] != '\0' ? ": " : "", what,
               bar, value);
    }
    return held;
}

void test_skip(const char *reason, const char *file, int line)
{
    g_left_by_skip = 1;
    g_skipped++;
    printf("  SKIPPED (%s:%d): %s\n", file, line, reason);
}

// One row of the table under cmocka: a test fails if any of its checks did, or if it checked nothing.
static void run_one(void **state)
{
    const test_case *test = (const test_case *)*state;
    const size_t failed_before = g_failed;
    const size_t count_before = g_passed + g_failed;
    const double start = test_seconds();
    g_about[0] = '\0';
    g_test_name = test->name;
    g_left_by_skip = 0;
    printf("%s\n", test->name);
    test->run();
    printf("  time  %.2f s\n", test_seconds() - start);
    fflush(stdout);
    if (g_failed == failed_before && g_passed + g_failed == count_before && !g_left_by_skip)
    {
        g_failed++;
        printf("  FAIL  %s checked nothing\n", test->name);
    }
    if (g_failed != failed_before)
    {
        g_failed_tests++;
        fail_msg("%zu checks failed in %s", g_failed - failed_before, test->name);
    }
    if (g_left_by_skip)
        skip();
}

// Whether a test is among those that argv[1] asks for.
static int wanted(const test_case *test, const char *filter)
{
    if (filter == NULL)
        return 1;
    if (strcmp(filter, "--timed") == 0 || strcmp(filter, "--untimed") == 0)
        return test->timed == (strcmp(filter, "--timed") == 0);
    return strstr(test->name, filter) != NULL;
}

// cmocka's table for the tests that the filter asks for; the number of them.
static size_t choose(const test_case *tests, size_t test_count, const char *filter, struct CMUnitTest *chosen)
{
    size_t count = 0;
    for (size_t i = 0; i < test_count; ++i)
    {
        if (!wanted(&tests[i], filter))
            continue;
        memset(&chosen[count], 0, sizeof chosen[count]);
        chosen[count].name = tests[i].name;
        chosen[count].test_func = run_one;
        chosen[count].initial_state = (void *)(uintptr_t)&tests[i]; // cmocka's field is not const; nobody writes to it
        ++count;
    }
    return count;
}

int test_main(int argc, char **argv, const char *program, const test_case *tests, size_t test_count)
{
    const char *filter = argc > 1 ? argv[1] : NULL;
    struct CMUnitTest *chosen = (struct CMUnitTest *)calloc(test_count + 1, sizeof *chosen);
    int crashed;
    if (chosen == NULL)
        return 1;
    (void)setvbuf(stdout, NULL, _IOLBF, BUFSIZ);
    if (filter != NULL && (strcmp(filter, "--list") == 0 || strcmp(filter, "--list-timed") == 0))
    {
        for (size_t i = 0; i < test_count; ++i)
            if (tests[i].timed || strcmp(filter, "--list") == 0)
                printf("%s\n", tests[i].name);
        free(chosen);
        return 0;
    }
    const size_t chosen_count = choose(tests, test_count, filter, chosen);
    crashed = chosen_count == 0 ? 0 : _cmocka_run_group_tests(program, chosen, chosen_count, NULL, NULL);
    free(chosen);
    fflush(stderr);
    if (crashed > 0 && (size_t)crashed > g_failed_tests)
        g_failed += (size_t)crashed - g_failed_tests; // signals, which cmocka alone saw
    if (g_skipped > 0)
        printf("%zu tests skipped\n", g_skipped);
    if (g_missed > 0)
        printf("%zu bars missed\n", g_missed);
    printf("%zu passed, %zu failed\n", g_passed, g_failed);
    return (g_failed > 0 || g_passed == 0) ? 1 : 0;
}
