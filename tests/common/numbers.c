// The numbers of numbers.h.

#include "numbers.h"

#include <math.h>

static uint64_t g_random_state = 1;

void random_seed(uint64_t seed)
{
    g_random_state = seed * 0x9E3779B97F4A7C15u + 1u;
}

double random_unit(void)
{
    g_random_state ^= g_random_state >> 12;
    g_random_state ^= g_random_state << 25;
    g_random_state ^= g_random_state >> 27;
    return (double)((g_random_state * 2685821657736338717u) >> 11) / 9007199254740992.0;
}

double random_between(double low, double high)
{
    return low + (high - low) * random_unit();
}

double relative_error(double got, double want)
{
    return got == want ? 0.0 : fabs(got - want) / fabs(want);
}

void keep_worst(double *worst, double error)
{
    if (!(error <= *worst))
        *worst = error == error ? error : HUGE_VAL;
}
