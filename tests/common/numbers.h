// Random numbers that are the same everywhere, and the worst of many errors.

#ifndef SSS_TESTS_NUMBERS_H
#define SSS_TESTS_NUMBERS_H

#include <stdint.h>

// One state for the whole program: xorshift64*, Vigna 2016.
void random_seed(uint64_t seed);
double random_unit(void); // in [0, 1)
double random_between(double low, double high);

// |got - want|/|want|; 0 where both are the same, 0 and infinity included.
double relative_error(double got, double want);

// Keeps the largest; NaN counts as infinity, so that it cannot hide.
void keep_worst(double *worst, double error);

#endif
