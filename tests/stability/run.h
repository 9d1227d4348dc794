// The sweeps of sweeps.h as tests of the method whose name the including program has given to SWEPT.

#ifndef SSS_TESTS_STABILITY_RUN_H
#define SSS_TESTS_STABILITY_RUN_H

#include "sweeps.h"

#define SWEEP(name)                                                                                                    \
    static void name(void)                                                                                             \
    {                                                                                                                  \
        sweep_##name(&(SWEPT));                                                                                        \
    }

SWEEP(slab)
SWEEP(sphere)
SWEEP(albedo)
SWEEP(slivers)
SWEEP(fan)
SWEEP(coarse)
SWEEP(noise)
SWEEP(normals)
SWEEP(windings)
SWEEP(holes)
SWEEP(scale)
SWEEP(size)
SWEEP(grazing)
SWEEP(turning)
SWEEP(fingers)

#define COMMON_SWEEPS                                                                                                  \
    TEST(slab), TEST(sphere), TEST(albedo), TEST(slivers), TEST(fan), TEST(coarse), TEST(noise),                       \
    TEST(normals), TEST(windings), TEST(holes), TEST(scale), TEST(size), TEST(grazing),                                \
    TEST(turning), TEST(fingers)

#endif
