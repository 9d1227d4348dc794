// The generated meshes and deformations of examples/common/shapes.h: closed, turned outward, of the size and the volume
// that they should have, and noise that is smooth and 0 on the lattice.

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"

#include "../examples/common/shapes.h"
#include "common/test.h"
#include "common/volume.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int by_value(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

// How many edges lack a partner that runs the other way, or have more than one.
static size_t open_edges(const model *m)
{
    const size_t count = 3 * m->triangle_count;
    uint64_t *const there = (uint64_t *)calloc(2 * count, sizeof *there), *const back = there + count;
    size_t open = 0;
    for (size_t i = 0; i < count; ++i)
    {
        const uint64_t a = m->triangles[i], b = m->triangles[i % 3 == 2 ? i - 2 : i + 1];
        there[i] = a << 32 | b;
        back[i] = b << 32 | a;
    }
    qsort(there, count, sizeof *there, by_value);
    qsort(back, count, sizeof *back, by_value);
    for (size_t i = 0; i < count; ++i)
    {
        open += there[i] != back[i] || (i > 0 && there[i] == there[i - 1]);
    }
    free(there);
    return open;
}

static void normals_are_outward(const model *m)
{
    size_t wrong = 0;
    for (size_t i = 0; i < m->triangle_count; ++i)
    {
        const uint32_t *const t = m->triangles + 3 * i;
        double e[2][3];
        for (size_t k = 0; k < 6; ++k)
        {
            e[k / 3][k % 3] = (double)m->positions[3 * t[1 + k / 3] + k % 3] - (double)m->positions[3 * t[0] + k % 3];
        }
        const double n[3] = {e[0][1] * e[1][2] - e[0][2] * e[1][1], e[0][2] * e[1][0] - e[0][0] * e[1][2],
                             e[0][0] * e[1][1] - e[0][1] * e[1][0]};
        for (size_t c = 0; c < 3; ++c)
        {
            const float *const v = m->normals + 3 * t[c];
            wrong += n[0] * (double)v[0] + n[1] * (double)v[1] + n[2] * (double)v[2] <= 0.0;
        }
    }
    CHECK_EQUAL(wrong, 0);
}

static void candle_is_closed_and_hollow(void)
{
    model m;
    if (CHECK_EQUAL(shape_candle(52, 48, &m), 0))
    {
        CHECK_EQUAL(m.vertex_count, 52 * 48 + 2);
        CHECK_EQUAL(m.triangle_count, 2 * 52 * 48);
        CHECK_EQUAL(open_edges(&m), 0);
        normals_are_outward(&m);
        // Oracle: the outline's straight pieces, cylinders and cones, 0.12663. The rounding takes and the ridges, whose
        // square has a mean of 1 + ridge^2/2, give less than 2 %; 48 sectors instead of a circle take 0.3 %.
        CHECK_REL(volume(&m), 0.12663, 0.02);
    }
    model_free(&m);
}

static void cube_is_closed_and_rounded(void)
{   // Oracle: Steiner's formula for a cube of edge 2 (1 - r) with a ball of radius r about every point.
    static const double r = 0.22, a = 2.0 - 2.0 * 0.22, pi = 3.14159265358979323846;
    const double exact = a * a * a + 6.0 * a * a * r + 3.0 * pi * a * r * r + 4.0 / 3.0 * pi * r * r * r;
    static const size_t divisions[] = {2, 9, 37};
    double before = 1.0;
    for (size_t i = 0; i < 3; ++i)
    {
        model m;
        test_about("%zu divisions", divisions[i]);
        if (CHECK_EQUAL(shape_cube(divisions[i], &m), 0))
        {
            CHECK_EQUAL(m.vertex_count, 6 * divisions[i] * divisions[i] + 2);
            CHECK_EQUAL(m.triangle_count, 12 * divisions[i] * divisions[i]);
            CHECK_EQUAL(open_edges(&m), 0);
            normals_are_outward(&m);
            const double error = fabs(volume(&m) - exact) / exact;
            CHECK_BELOW(error, before);
            before = error;
        }
        model_free(&m);
    }
    CHECK_BELOW(before, 2e-3);
}

static void twisting_alone_keeps_the_volume(void)
{   // Every slice only turns; a waist makes it smaller.
    model m, out;
    if (CHECK_EQUAL(shape_candle(200, 96, &m), 0) && CHECK_EQUAL(shape_candle(200, 96, &out), 0))
    {
        shape_twist(m.positions, m.vertex_count, 1.0, 0.25, 0.0, out.positions);
        CHECK_REL(volume(&out), volume(&m), 5e-3);
        CHECK(memcmp(out.positions, m.positions, 3 * m.vertex_count * sizeof(float)) != 0);
        shape_twist(m.positions, m.vertex_count, 1.0, 0.25, 0.4, out.positions);
        CHECK_BETWEEN(volume(&out), 0.4 * volume(&m), 0.8 * volume(&m));
        shape_twist(m.positions, m.vertex_count, 1.0, 0.0, 0.0, out.positions);
        CHECK(memcmp(out.positions, m.positions, 3 * m.vertex_count * sizeof(float)) == 0);
    }
    model_free(&m);
    model_free(&out);
}

static void noise_is_smooth_and_zero_on_the_lattice(void)
{
    double low = 0.0, high = 0.0, jump = 0.0, lattice = 0.0, sum = 0.0;
    for (int i = 0; i < 20000; ++i)
    {
        const double p[3] = {0.0137 * i - 90.0, 40.0 - 0.0091 * i, 0.0203 * i - 200.0};
        const double q[3] = {p[0] + 1e-6, p[1] + 1e-6, p[2] - 1e-6}, whole[3] = {floor(p[0]), floor(p[1]), floor(p[2])};
        const double n = shape_perlin(p);
        low = fmin(low, n);
        high = fmax(high, n);
        sum += n / 20000.0;
        jump = fmax(jump, fabs(shape_perlin(q) - n));
        lattice = fmax(lattice, fabs(shape_perlin(whole)));
    }
    CHECK_BETWEEN(low, -1.1, -0.6);
    CHECK_BETWEEN(high, 0.6, 1.1);
    CHECK_ABS(sum, 0.0, 0.03);
    CHECK_BELOW(jump, 1e-5); // a gradient of a few
    CHECK_BELOW(lattice, 0.0);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {TEST(candle_is_closed_and_hollow), TEST(cube_is_closed_and_rounded),
                                      TEST(twisting_alone_keeps_the_volume),
                                      TEST(noise_is_smooth_and_zero_on_the_lattice)};
    return test_main(argc, argv, "shapes", tests, sizeof tests / sizeof *tests);
}
