// Tests of sss_bem.h. Oracles, named at each test: brute force over the area in long double (tests/common/area.h), closed
// forms, the series of Mertens et al. 2003 as the paper has it, the converged reference of tests/common/reference.h,
// laws of scaling and symmetry, sums over all triangles written out here. None comes from the code under test.
//
// In the order of the header: form factor, hierarchy, shading in three modes, the paper's own oracle; then conduct under
// bad input, failing allocation and cancelling; then speed.

#define _POSIX_C_SOURCE 200809L // pthreads

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../sss_bem.h"

#include "common/area.h"
#include "common/meshes.h"
#include "common/polygon.h"
#include "common/reference.h"
#include "common/test.h"

#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define PI_L 3.14159265358979323846264338327950288L

#define COUNT(array) (sizeof(array) / sizeof *(array))

// ============================================== Common helpers ==============================================

static uint64_t g_random_state;

static void random_seed(uint64_t seed)
{
    g_random_state = seed * 0x9E3779B97F4A7C15u + 1u;
}

// In [0, 1): xorshift64*, Vigna 2016.
static double random_unit(void)
{
    g_random_state ^= g_random_state >> 12;
    g_random_state ^= g_random_state << 25;
    g_random_state ^= g_random_state >> 27;
    return (double)((g_random_state * 2685821657736338717u) >> 11) / 9007199254740992.0;
}

static double random_between(double low, double high)
{
    return low + (high - low) * random_unit();
}

static double relative_error(double got, double want)
{
    return got == want ? 0.0 : fabs(got - want) / fabs(want);
}

// Keeps the largest; NaN counts as infinity, so that it cannot hide.
static void keep_worst(double *worst, double error)
{
    if (!(error <= *worst))
        *worst = error == error ? error : HUGE_VAL;
}

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross3(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; ++k)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static double length3(const double a[3])
{
    return sqrt(dot3(a, a));
}

// ================================================= 1. Form factor =================================================

// One source and one polygon.
typedef struct form_case
{
    double corners[3 * 1024];
    size_t count;
    double source[3];
    double z, sigma;
} form_case;

// An orthogonal frame in which polygons are laid out: corners and source are origin + x u + y v + h w.
typedef struct frame
{
    double origin[3], u[3], v[3], w[3];
} frame;

// Axes; and the orthogonal integers (1,2,2), (2,1,-2), (2,-2,1), which leave numbers of few bits exact.
static const frame straight = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
static const frame tilted = {{0.0, 0.0, 0.0}, {1.0, 2.0, 2.0}, {2.0, 1.0, -2.0}, {-2.0, 2.0, -1.0}};

static void place(const frame *f, double x, double y, double h, double out[3])
{
    for (int k = 0; k < 3; ++k)
        out[k] = f->origin[k] + x * f->u[k] + y * f->v[k] + h * f->w[k];
}

static frame random_frame(double far)
{
    frame f;
    double length;
    do
    {
        for (int k = 0; k < 3; ++k)
        {
            f.u[k] = random_between(-1.0, 1.0);
            f.v[k] = random_between(-1.0, 1.0);
            f.origin[k] = far * random_between(-1.0, 1.0);
        }
        cross3(f.u, f.v, f.w);
    } while (length3(f.w) < 0.1 || length3(f.u) < 0.1);
    length = length3(f.w);
    for (int k = 0; k < 3; ++k)
        f.w[k] /= length;
    length = length3(f.u);
    for (int k = 0; k < 3; ++k)
        f.u[k] /= length;
    cross3(f.w, f.u, f.v);
    return f;
}

// A polygon xy [n][2] in a frame, the source over (x, y) at height h.
static void form_place(form_case *c, const frame *f, const double *xy, size_t n, const double source[3])
{
    c->count = n;
    for (size_t i = 0; i < n; ++i)
        place(f, xy[2 * i], xy[2 * i + 1], 0.0, &c->corners[3 * i]);
    place(f, source[0], source[1], source[2], c->source);
}

static long double form_want(const form_case *c)
{
    return area_source_term(c->corners, c->count, c->source, c->z, c->sigma);
}

static double form_got(const form_case *c)
{
    return sss_bem_form_factor(c->corners, c->count, c->source, c->z, c->sigma);
}

static double form_error(const form_case *c)
{
    const long double want = form_want(c);
    return (double)(fabsl((long double)form_got(c) - want) / fabsl(want));
}

static void the_oracles_agree(void)
{   // Oracles against each other: area integral, border integral, solid angle, values of TRUTH.md, section 3.
    static const double square[4][3] = {{-0.5, -0.5, 0.0}, {0.5, -0.5, 0.0}, {0.5, 0.5, 0.0}, {-0.5, 0.5, 0.0}};
    static const double aside[4][3] = {{0.2, 0.1, 0.0}, {1.0, 0.1, 0.0}, {1.0, 0.7, 0.0}, {0.2, 0.7, 0.0}};
    static const double over[3] = {0.0, 0.0, 0.5};
    CHECK_REL((double)area_source_term(square[0], 4, over, 0.5, 1.0), 1.83044584140217, 1e-14);
    CHECK_REL((double)area_source_term(aside[0], 4, over, 0.5, 1.0), 0.325826762174628, 1e-14);
    static const double inside[3][2] = {{-0.3, -0.2}, {1.0, -0.1}, {0.2, 0.9}};
    static const double outside[3][2] = {{0.1, -0.2}, {1.0, -0.1}, {0.2, 0.9}};
    double worst = 0.0;
    for (int side = 0; side < 2; ++side)
        for (int height = 0; height < 9; ++height)
            for (int decay = 0; decay < 4; ++decay)
            {
                static const double sigmas[4] = {0.0, 0.3, 3.0, 30.0};
                const double H = pow(10.0, -height), source[3] = {0.0, 0.0, H};
                form_case c;
                form_place(&c, &straight, side == 0 ? inside[0] : outside[0], 3, source);
                const long double border =
                    polygon_source_term(side == 0 ? inside : outside, 3, H, 1.7, sigmas[decay]);
                const long double area = area_source_term(c.corners, 3, c.source, 1.7, sigmas[decay]);
                keep_worst(&worst, (double)fabsl(area / border - 1.0L));
            }
    CHECK_BELOW(worst, 1e-16);
}

// ---- Random polygons ----

// n corners around (x, y), at random radii: star-shaped, convex only by chance.
static void random_polygon(double (*xy)[2], size_t n, double x, double y, double size)
{
    const double turn = random_between(0.0, 2.0 * PI);
    for (size_t i = 0; i < n; ++i)
    {
        const double angle = turn + 2.0 * PI * ((double)i + 0.7 * random_unit()) / (double)n;
        const double radius = size * random_between(0.3, 1.0);
        xy[i][0] = x + radius * cos(angle);
        xy[i][1] = y + radius * sin(angle);
    }
}

static void ordinary_triangles(void)
{   // Oracle: the area integral. Triangles in any position, sigma L from 0 to 10, the source from 0.05 to 2 edges away,
    // projecting inside and outside; the weight z is not the height.
    form_case c;
    double worst = 0.0, mutant = HUGE_VAL;
    random_seed(1);
    for (int i = 0; i < 400; ++i)
    {
        double xy[3][2];
        const frame f = random_frame(1.0);
        const double source[3] = {random_between(-1.0, 1.0), random_between(-1.0, 1.0),
                                  pow(10.0, random_between(-1.3, 0.3)) * (i % 2 == 0 ? 1.0 : -1.0)};
        random_polygon(xy, 3, 0.0, 0.0, 1.0);
        form_place(&c, &f, xy[0], 3, source);
        c.z = random_between(0.1, 3.0);
        c.sigma = i % 5 == 0 ? 0.0 : pow(10.0, random_between(-3.0, 1.0));
        keep_worst(&worst, form_error(&c));
        const double z = c.z;
        c.z = fabs(source[2]);
        const double height_for_weight = form_got(&c);
        c.z = z;
        if (fabs(z / fabs(source[2]) - 1.0) > 0.01)
            mutant = fmin(mutant, relative_error(height_for_weight, (double)form_want(&c)));
    }
    CHECK_BELOW(worst, 1e-12);
    CHECK_BETWEEN(mutant, 1e-3, HUGE_VAL); // the height in the weight's place must be caught
}

static void arbitrary_polygons(void)
{   // Oracle: the area integral over triangles cut off one after the other. 3 to 12 corners, most of them concave.
    form_case c;
    double worst = 0.0;
    random_seed(2);
    for (int i = 0; i < 200; ++i)
    {
        double xy[12][2];
        const size_t n = 3 + (size_t)i % 10;
        const frame f = random_frame(1.0);
        const double source[3] = {random_between(-1.5, 1.5), random_between(-1.5, 1.5),
                                  pow(10.0, random_between(-1.3, 0.3))};
        random_polygon(xy, n, 0.0, 0.0, 1.0);
        form_place(&c, &f, xy[0], n, source);
        c.z = random_between(0.1, 3.0);
        c.sigma = pow(10.0, random_between(-3.0, 1.0));
        keep_worst(&worst, form_error(&c));
    }
    CHECK_BELOW(worst, 1e-12);
    // A comb: five teeth, the source over a gap, next to it, and over a tooth.
    static const double comb[12][2] = {{0.0, 0.0}, {5.0, 0.0}, {5.0, 3.0}, {4.0, 3.0}, {4.0, 1.0}, {3.0, 1.0},
                                       {3.0, 3.0}, {2.0, 3.0}, {2.0, 1.0}, {1.0, 1.0}, {1.0, 3.0}, {0.0, 3.0}};
    static const double sources[4][3] = {{1.5, 2.0, 0.1}, {1.999, 2.0, 1e-3}, {2.5, 2.0, 0.01}, {1.5, 2.0, 0.0}};
    worst = 0.0;
    for (size_t i = 0; i < 4; ++i)
    {
        form_place(&c, &straight, comb[0], 12, sources[i]);
        c.z = 0.5;
        c.sigma = 2.0;
        keep_worst(&worst, form_error(&c));
    }
    CHECK_BELOW(worst, 1e-11);
}

// ---- The catalogue of extreme cases ----

// What is extreme about it. Coordinates are numbers of few bits, so that the cases are exact in the tilted frame too,
// heights apart, which are powers of two there.
typedef enum extreme
{
    ON_EDGE,
    ON_VERTEX,
    NEAR_EDGE,
    NEAR_VERTEX,
    LOW,
    COPLANAR,
    OPAQUE,
    NEEDLE,
    SLIVER,
    FAR_AWAY,
    FAR_ORIGIN,
    EXTREMES
} extreme;

static const char *const extreme_names[EXTREMES] = {
    "on an edge", "on a vertex", "1e-6 from an edge", "1e-6 from a vertex", "height 1e-8", "coplanar",
    "sigma L up to 1000", "needle of aspect 1e4", "sliver", "50/sigma away", "coordinates of 4096"};

// A number in [low, high] of few bits.
static double coarse(double low, double high)
{
    return ldexp(floor(ldexp(random_between(low, high), 10)), -10);
}

static double coarse_height(int i)
{
    static const double heights[5] = {0.5, 0.125, 0.0078125, 1.220703125e-4, 9.5367431640625e-7}; // 2^-1 .. 2^-20
    return heights[i % 5];
}

#define TINY 9.5367431640625e-7     // 2^-20, about 1e-6
#define LOWEST 7.450580596923828e-9 // 2^-27, about 1e-8

// The i-th case of a kind.
static void make_extreme(extreme kind, int i, form_case *c)
{
    double xy[3][2] = {{-0.25 - coarse(0.0, 1.0), -0.25 - coarse(0.0, 1.0)}, {0.25 + coarse(0.0, 1.0),
                       -0.25 - coarse(0.0, 1.0)}, {coarse(-1.0, 1.0), 0.25 + coarse(0.0, 1.0)}};
    double source[3] = {coarse(-0.2, 0.2), coarse(-0.2, 0.2), coarse_height(i)};
    frame f = i % 2 == 0 ? straight : tilted;
    const int corner = i % 3, next = (corner + 1) % 3;
    const double share = 0.25 * (double)(1 + i % 3), side = i % 4 < 2 ? 1.0 : -1.0;
    c->sigma = i % 7 == 0 ? 0.0 : pow(10.0, random_between(-2.0, 1.0));
    c->z = random_between(0.1, 2.0);
    switch (kind)
    {
    case ON_EDGE:
    case NEAR_EDGE:
        for (int k = 0; k < 2; ++k)
            source[k] = xy[corner][k] + share * (xy[next][k] - xy[corner][k]);
        source[i % 2] += kind == NEAR_EDGE ? side * TINY : 0.0;
        break;
    case ON_VERTEX:
    case NEAR_VERTEX:
        for (int k = 0; k < 2; ++k)
            source[k] = xy[corner][k];
        source[i % 2] += kind == NEAR_VERTEX ? side * TINY : 0.0;
        source[1 - i % 2] += kind == NEAR_VERTEX && i % 3 == 0 ? 0.5 * TINY : 0.0;
        break;
    case LOW:
        source[2] = LOWEST;
        if (i % 6 >= 3) // and near an edge at once
            for (int k = 0; k < 2; ++k)
                source[k] = xy[corner][k] + share * (xy[next][k] - xy[corner][k]) + (k == 0 ? side * TINY : 0.0);
        break;
    case COPLANAR:
        source[0] = side * (1.25 + TINY + coarse(0.0, 1.0)); // beyond every corner
        source[2] = 0.0;
        break;
    case OPAQUE:
        c->sigma = pow(10.0, random_between(1.0, 3.0));
        source[2] = 0.125 * coarse_height(i);
        break;
    case NEEDLE:
    case SLIVER:
        for (int k = 0; k < 3; ++k)
            xy[k][1] *= ldexp(1.0, kind == NEEDLE ? -13 : -23);
        source[1] *= i % 3 == 0 ? 1.0 : ldexp(1.0, -13);
        break;
    case FAR_AWAY:
        c->sigma = pow(10.0, random_between(-1.0, 1.5));
        source[i % 3] = side * floor(50.0 / c->sigma * 64.0) / 64.0 + (i % 3 == 2 ? 0.0 : side * 1.25);
        break;
    case FAR_ORIGIN:
        f.origin[0] = f.origin[2] = 4096.0;
        f.origin[1] = -4096.0;
        break;
    case EXTREMES:
        break;
    }
    form_place(c, &f, xy[0], 3, source);
}

static void extreme_triangles(void)
{   // Oracle: the area integral. 30 triangles of each kind, in the xy-plane and in a tilted one.
    form_case c;
    for (int kind = 0; kind < EXTREMES; ++kind)
    {
        double worst = 0.0;
        random_seed(100 + (uint64_t)kind);
        test_about("%s", extreme_names[kind]);
        for (int i = 0; i < 30; ++i)
        {
            make_extreme((extreme)kind, i, &c);
            keep_worst(&worst, form_error(&c));
        }
        CHECK_BELOW(worst, 1e-9);
    }
}

static void any_plane_any_height(void)
{   // Oracle: the area integral for the very numbers that go in. Here heights are as small as the rounding of the
    // coordinates lets them be: a triangle anywhere in space, the source down to 1e-8 over it, and around 4096.
    form_case c;
    random_seed(3);
    for (int far = 0; far < 2; ++far)
    {
        double worst = 0.0;
        test_about(far ? "around 4096" : "around the origin");
        for (int i = 0; i < 100; ++i)
        {
            double xy[3][2];
            const frame f = random_frame(far ? 4096.0 : 1.0);
            const double source[3] = {random_between(-0.2, 0.2), random_between(-0.2, 0.2),
                                      pow(10.0, random_between(far ? -3.0 : -8.0, 0.0))};
            random_polygon(xy, 3, 0.0, 0.0, 1.0);
            form_place(&c, &f, xy[0], 3, source);
            c.z = 1.0;
            c.sigma = 1.0;
            keep_worst(&worst, form_error(&c));
        }
        CHECK_BELOW(worst, 1e-9);
    }
}

// ---- Laws ----

static void split_triangles_sum_to_the_whole(void)
{   // Oracle: additivity. A triangle split at a point inside, and at a point on an edge; polygons split by a diagonal.
    double worst = 0.0, polygons = 0.0;
    form_case whole, part;
    random_seed(4);
    for (int kind = 0; kind < EXTREMES; ++kind)
        for (int i = 0; i < 60; ++i)
        {
            double middle[3], sum = 0.0;
            make_extreme((extreme)kind, i, &whole);
            part = whole;
            for (int k = 0; k < 3; ++k)
                middle[k] = i % 2 == 0 ? 0.5 * (whole.corners[k] + whole.corners[3 + k])
                                       : 0.25 * (whole.corners[k] + whole.corners[3 + k]) + 0.5 * whole.corners[6 + k];
            for (int k = 0; k < 3; ++k)
            {
                memcpy(part.corners, whole.corners, 9 * sizeof(double));
                memcpy(&part.corners[3 * k], middle, sizeof middle);
                sum += form_got(&part);
            }
            keep_worst(&worst, relative_error(sum, form_got(&whole)));
        }
    CHECK_BELOW(worst, 1e-9);
    for (int i = 0; i < 50; ++i)
    {
        double xy[12][2];
        const frame f = random_frame(1.0);
        const double source[3] = {random_between(-1.5, 1.5), random_between(-1.5, 1.5), random_between(0.01, 1.0)};
        random_polygon(xy, 12, 0.0, 0.0, 1.0);
        form_place(&whole, &f, xy[0], 12, source);
        whole.z = 1.0;
        whole.sigma = random_between(0.0, 5.0);
        // Star-shaped around the frame's origin: corners 0 .. 5 and that point, 5 .. 11, 0 and that point.
        part = whole;
        part.count = 7;
        memcpy(&part.corners[18], f.origin, sizeof f.origin);
        double sum = form_got(&part);
        memcpy(part.corners, &whole.corners[15], 21 * sizeof(double));
        memcpy(&part.corners[21], whole.corners, 3 * sizeof(double));
        memcpy(&part.corners[24], f.origin, sizeof f.origin);
        part.count = 9;
        sum += form_got(&part);
        keep_worst(&polygons, relative_error(sum, form_got(&whole)));
    }
    CHECK_BELOW(polygons, 1e-12);
}

static void symmetries_of_the_form_factor(void)
{   // Oracle: symmetry. Order of the corners, height +-, the sign and linearity of z, rotation, translation, unit.
    double order = 0.0, even = 0.0, weight = 0.0, moved = 0.0, unit = 0.0;
    form_case c, d;
    random_seed(5);
    for (int i = 0; i < 200; ++i)
    {
        double xy[12][2], source[3] = {random_between(-1.0, 1.0), random_between(-1.0, 1.0),
                                       pow(10.0, random_between(-6.0, 0.3))};
        const size_t n = 3 + (size_t)i % 10;
        random_polygon(xy, n, 0.0, 0.0, 1.0);
        form_place(&c, &straight, xy[0], n, source);
        c.z = random_between(0.1, 2.0);
        c.sigma = i % 4 == 0 ? 0.0 : random_between(0.0, 10.0);
        const double want = form_got(&c);
        d = c;
        for (size_t k = 0; k < n; ++k) // reversed, and begun elsewhere
            memcpy(&d.corners[3 * k], &c.corners[3 * ((2 * n - k + (size_t)i) % n)], 3 * sizeof(double));
        keep_worst(&order, relative_error(form_got(&d), want));
        d = c;
        d.source[2] = -c.source[2];
        keep_worst(&even, relative_error(form_got(&d), want));
        d = c;
        d.z = -4.0 * c.z;
        keep_worst(&weight, relative_error(form_got(&d), -4.0 * want));
        d = c;
        const double scale = ldexp(1.0, i % 2 == 0 ? 100 : -100);
        for (size_t k = 0; k < 3 * n; ++k)
            d.corners[k] *= scale;
        for (int k = 0; k < 3; ++k)
            d.source[k] *= scale;
        d.z *= scale;
        d.sigma /= scale;
        keep_worst(&unit, relative_error(form_got(&d), want));
        source[2] = fmax(source[2], 0.05); // lower down the rounding of a rotation changes the height
        form_place(&c, &straight, xy[0], n, source);
        const frame f = random_frame(1.0);
        form_place(&d, &f, xy[0], n, source);
        d.z = c.z;
        d.sigma = c.sigma;
        keep_worst(&moved, relative_error(form_got(&d), form_got(&c)));
    }
    CHECK_BELOW(order, 1e-12);
    CHECK_BELOW(even, 1e-15);
    CHECK_BELOW(weight, 1e-15);
    CHECK_BELOW(unit, 1e-12);
    CHECK_BELOW(moved, 1e-12);
}

// Van Oosterom and Strackee 1983: the solid angle of a triangle.
static long double solid_angle(const double *corners, const double source[3])
{
    long double r[3][3], l[3], c[3];
    for (int i = 0; i < 3; ++i)
    {
        for (int k = 0; k < 3; ++k)
            r[i][k] = (long double)corners[3 * i + k] - source[k];
        l[i] = sqrtl(r[i][0] * r[i][0] + r[i][1] * r[i][1] + r[i][2] * r[i][2]);
    }
    for (int k = 0; k < 3; ++k)
        c[k] = r[1][(k + 1) % 3] * r[2][(k + 2) % 3] - r[1][(k + 2) % 3] * r[2][(k + 1) % 3];
    long double below = l[0] * l[1] * l[2];
    for (int i = 0; i < 3; ++i)
    {
        const long double *a = r[i], *b = r[(i + 1) % 3];
        below += (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * l[(i + 2) % 3];
    }
    return 2.0L * atan2l(fabsl(r[0][0] * c[0] + r[0][1] * c[1] + r[0][2] * c[2]), below);
}

static void without_absorption_it_is_a_solid_angle(void)
{   // Oracle: Van Oosterom and Strackee 1983. At sigma = 0 the integral is z/H times the solid angle.
    double worst = 0.0;
    form_case c;
    random_seed(6);
    for (int i = 0; i < 300; ++i)
    {
        double xy[3][2];
        const double H = pow(10.0, random_between(-7.0, 1.0));
        const double source[3] = {random_between(-1.0, 1.0), random_between(-1.0, 1.0), H};
        random_polygon(xy, 3, 0.0, 0.0, 1.0);
        form_place(&c, &straight, xy[0], 3, source);
        c.z = 0.7;
        c.sigma = 0.0;
        const long double want = 0.7L / (long double)H * solid_angle(c.corners, c.source);
        keep_worst(&worst, relative_error(form_got(&c), (double)want));
    }
    CHECK_BELOW(worst, 1e-12);
}

static void regular_polygon(form_case *c, size_t n, double radius, double H)
{
    c->count = n;
    for (size_t i = 0; i < n; ++i)
    {
        c->corners[3 * i] = radius * cos(2.0 * PI * (double)i / (double)n);
        c->corners[3 * i + 1] = radius * sin(2.0 * PI * (double)i / (double)n);
        c->corners[3 * i + 2] = 0.0;
    }
    c->source[0] = c->source[1] = 0.0;
    c->source[2] = H;
}

static void discs_and_the_plane(void)
{   // Oracle: closed forms. A disc gives 2 pi z [exp(-sigma H)/H - exp(-sigma S)/S], S^2 = H^2 + R^2 (TRUTH.md, section
    // 3); a regular polygon of n corners inside it falls short by the sagitta: to first order its area is less by the
    // share (2 pi^2/3)/n^2, so that two polygons extrapolate to the disc. The plane gives 2 pi (z/H) exp(-sigma H).
    static const double discs[4][4] = {{0.5, 1.0, 1.0, 2.89231823091365}, {0.5, 1.0, 0.01, 0.00114292144165},
                                       {0.5, 0.0, 1.0, 3.4732594147633}, {0.01, 100.0, 0.01, 1.23131550818329}};
    form_case c;
    for (size_t i = 0; i < 4; ++i)
    {
        const double z = discs[i][0], sigma = discs[i][1], R = discs[i][2], S = sqrt(z * z + R * R);
        double value[2];
        test_about("z %g, sigma %g, R %g", z, sigma, R);
        c.z = z;
        c.sigma = sigma;
        for (size_t k = 0; k < 2; ++k)
        {
            regular_polygon(&c, 500 + 500 * k, R, z);
            value[k] = form_got(&c);
        }
        const double closed = 2.0 * PI * z * (exp(-sigma * z) / z - exp(-sigma * S) / S);
        CHECK_REL((4.0 * value[1] - value[0]) / 3.0, discs[i][3], 1e-9);
        CHECK_REL((4.0 * value[1] - value[0]) / 3.0, closed, 1e-9);
        CHECK_BETWEEN(closed - value[1], 0.0, 1e-4 * closed);
    }
    test_about("a plane of radius 60/sigma");
    for (int i = 0; i < 4; ++i)
    {
        const double H = pow(10.0, -2.0 * i), sigma = 0.7;
        c.z = 0.3;
        c.sigma = sigma;
        regular_polygon(&c, 7, 60.0 / sigma, H);
        CHECK_REL(form_got(&c), 2.0 * PI * 0.3 / H * exp(-sigma * H), 1e-13);
    }
}

static void tolerances_are_met(void)
{   // Oracle: the area integral. Each tolerance is met in every extreme case as well.
    static const double tolerances[6] = {0.0, 1e-8, 1e-6, 1e-4, 1e-2, 0.3};
    form_case c;
    for (int kind = 0; kind < EXTREMES; ++kind)
    {
        double worst[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
        random_seed(200 + (uint64_t)kind);
        for (int i = 0; i < 15; ++i)
        {
            make_extreme((extreme)kind, i, &c);
            const double want = (double)form_want(&c);
            for (size_t t = 0; t < 6; ++t)
                keep_worst(&worst[t], relative_error(sss_bem_form_factor_within(c.corners, 3, c.source, c.z, c.sigma,
                                                                                tolerances[t]), want));
        }
        for (size_t t = 0; t < 6; ++t)
        {
            test_about("%s, tolerance %g", extreme_names[kind], tolerances[t]);
            CHECK_BELOW(worst[t], fmax(tolerances[t], 1e-9));
        }
    }
}

// ---- The paper's own series ----

// Equations 10 to 19 as they stand: interior angle in closed form, the constant term of the Taylor series on segments
// halved until the conditions hold. flipped: an edge whose sign is turned around, a mutation; -1: none.
typedef struct paper
{
    double length_ratio, sigma_length;
    size_t samples;
    int flipped;
} paper;

static double paper_edge(paper *p, double R, double H, double sigma, double t_1, double t_2)
{
    const double L = t_2 - t_1, t_0 = 0.5 * (t_1 + t_2), r_0 = sqrt(R * R + t_0 * t_0), s_0 = hypot(r_0, H);
    if (L / r_0 < p->length_ratio && sigma * L < p->sigma_length)
    {
        p->samples++;
        return R * exp(-sigma * s_0) / (r_0 * r_0 * s_0) * L; // eq. 17 over z
    }
    return paper_edge(p, R, H, sigma, t_1, t_0) + paper_edge(p, R, H, sigma, t_0, t_2);
}

static double paper_form_factor(paper *p, const double *xy, size_t n, double H, double z, double sigma)
{
    double I_1 = 0.0, I_2 = 0.0; // the angles of I_1 add up to 2 pi or cancel
    p->samples = 0;
    for (size_t i = 0; i < n; ++i)
    {
        const double *a = &xy[2 * i], *b = &xy[2 * ((i + 1) % n)];
        const double x = b[0] - a[0], y = b[1] - a[1], length = hypot(x, y);
        const double distance = (a[0] * b[1] - a[1] * b[0]) / length;
        double sign = distance > 0.0 ? 1.0 : -1.0;
        if ((int)i == p->flipped)
            sign = -sign;
        const double t_1 = (a[0] * x + a[1] * y) / length, t_2 = (b[0] * x + b[1] * y) / length;
        I_1 += sign * (atan2(t_2, fabs(distance)) - atan2(t_1, fabs(distance)));
        I_2 += sign * paper_edge(p, fabs(distance), H, sigma, t_1, t_2);
    }
    return z * (I_1 * exp(-sigma * H) / H - I_2);
}

static void the_papers_series(void)
{   // Oracle: equations 10 to 19, written out above. The same values and the same number of segments; its error against
    // the area integral falls with the square of the conditions; at the paper's own it is some per cent.
    static const double ratios[4] = {0.4, 0.2, 0.1, 0.05};
    double same = 0.0, error[4] = {0.0, 0.0, 0.0, 0.0}, size = 0.0, at_most = 0.0, flipped = HUGE_VAL;
    int equal_samples = 1;
    form_case c;
    random_seed(7);
    for (int i = 0; i < 100; ++i)
    {
        double xy[3][2];
        const double source[3] = {0.0, 0.0, random_between(0.1, 0.5)};
        random_polygon(xy, 3, random_between(-0.3, 0.3), random_between(-0.3, 0.3), 1.0);
        form_place(&c, &straight, xy[0], 3, source);
        c.z = 1.0;
        c.sigma = random_between(0.0, 4.0);
        const double want = (double)form_want(&c);
        size += want;
        for (size_t k = 0; k < 4; ++k)
        {
            paper p = {ratios[k], ratios[k], 0, -1};
            sss_bem_taylor taylor = {ratios[k], ratios[k], 0};
            const double by_hand = paper_form_factor(&p, xy[0], 3, source[2], c.z, c.sigma);
            const double got = sss_bem_form_factor_taylor(c.corners, 3, c.source, c.z, c.sigma, &taylor);
            keep_worst(&same, fabs(got - by_hand) / want);
            equal_samples &= taylor.samples == p.samples;
            error[k] += fabs(got - want);
            if (k == 0)
                keep_worst(&at_most, fabs(got - want) / want);
            p.flipped = i % 3;
            if (k == 3)
                flipped = fmin(flipped, fabs(paper_form_factor(&p, xy[0], 3, source[2], c.z, c.sigma) - got) / want);
        }
    }
    CHECK_BELOW(same, 1e-11);
    CHECK(equal_samples);
    for (size_t k = 0; k < 3; ++k)
    {
        test_about("conditions %g and %g", ratios[k], ratios[k + 1]);
        CHECK_BETWEEN(error[k] / error[k + 1], 2.5, 6.0);
    }
    test_about("%s", "");
    CHECK_BETWEEN(error[0] / size, 1e-4, 0.05); // too good would mean another method
    CHECK_BELOW(at_most, 0.5);
    CHECK_BETWEEN(flipped, 1e-3, HUGE_VAL);     // an edge of the wrong sign must be caught
}

static void samples_of_figure_4(void)
{   // Oracle: the paper's figure 4 and equation 19. Marble, the tip of the standard triangle under the source; the two
    // edges through the tip give nothing, the base is halved: for small triangles only L/r_0 counts, a constant number;
    // for large ones sigma L, so that doubling the triangle doubles the number. Without the second condition, which the
    // paper found to be of no importance, it stays constant.
    sss_dipole_material marble;
    sss_profile profile;
    size_t last = 0, by_ratio = 0;
    int as_paper = 1, grows = 1;
    CHECK_EQUAL(sss_dipole_material_by_name("marble", &marble), SSS_OK);
    CHECK_EQUAL(sss_dipole_profile(&marble, SSS_DIPOLE_FRESNEL_EXACT, &profile), SSS_OK);
    for (int i = 0; i <= 12; ++i)
    {
        const double scale = ldexp(0.1, i), sigma = profile.sigma_tr[0]; // mm to the base, which is twice as long
        const double triangle[3][3] = {{0.0, 0.0, 0.0}, {scale, -scale, 0.0}, {scale, scale, 0.0}};
        const double source[3] = {0.0, 0.0, profile.z_r[0]};
        sss_bem_taylor plain = {0.0, 0.0, 0}, relaxed = {0.0, HUGE_VAL, 0};
        paper p = {0.4, 0.4, 0, -1};
        (void)paper_edge(&p, scale, source[2], sigma, -scale, scale);
        (void)sss_bem_form_factor_taylor(triangle[0], 3, source, profile.z_r[0], sigma, &plain);
        (void)sss_bem_form_factor_taylor(triangle[0], 3, source, profile.z_r[0], sigma, &relaxed);
        test_note("base at %g mm: %d samples, %d without the second condition", scale, (int)plain.samples,
                  (int)relaxed.samples);
        by_ratio = i == 0 ? relaxed.samples : by_ratio;
        as_paper &= plain.samples == p.samples && relaxed.samples == by_ratio;
        grows &= plain.samples >= last && (i == 0 || plain.samples <= 2 * last);
        last = plain.samples;
    }
    CHECK(as_paper && grows);
    CHECK_BETWEEN((double)last, 100.0, 1e5); // sigma L/0.4 = 0.12 * 819/0.4 = 240, or the next power of two
    CHECK(isfinite(sss_bem_form_factor_taylor((const double[9]){0, 0, 0, 1, 0, 0, 0, 1, 0}, 3,
                                              (const double[3]){0.2, 0.2, 0.5}, 0.5, 1.0, NULL)));
}

// ---- Linear irradiance, float ----

static void linear_irradiance(void)
{   // Oracle: the area integral with barycentric weights. The three sum to the whole.
    form_case c;
    for (int kind = -1; kind < EXTREMES; ++kind)
    {
        double worst = 0.0, sums = 0.0;
        int fine = 1;
        random_seed(300 + (uint64_t)(kind + 1));
        test_about("%s", kind < 0 ? "ordinary" : extreme_names[kind]);
        for (int i = 0; i < 12; ++i)
        {
            double out[3] = {0.0, 0.0, 0.0};
            long double want[3];
            make_extreme(kind < 0 ? EXTREMES : (extreme)kind, kind < 0 ? 5 * (i / 5) + i % 2 : i, &c);
            fine &= sss_bem_form_factor_linear(c.corners, c.source, c.z, c.sigma, 0.0, out) == SSS_OK;
            area_source_moments(c.corners, c.source, c.z, c.sigma, want);
            const double whole = (double)(want[0] + want[1] + want[2]);
            for (int k = 0; k < 3; ++k)
                keep_worst(&worst, (double)fabsl(out[k] - want[k]) / whole);
            keep_worst(&sums, relative_error(out[0] + out[1] + out[2], form_got(&c)));
        }
        CHECK(fine);
        CHECK_BELOW(worst, kind < 0 ? 1e-11 : 1e-9);
        CHECK_BELOW(sums, 1e-12);
    }
    // A loose tolerance is met as well; corner weights in another order must be caught.
    double loose = 0.0, mutant = 0.0;
    random_seed(8);
    for (int i = 0; i < 20; ++i)
    {
        double out[3] = {0.0, 0.0, 0.0};
        long double want[3];
        make_extreme(EXTREMES, i, &c);
        (void)sss_bem_form_factor_linear(c.corners, c.source, c.z, c.sigma, 1e-3, out);
        area_source_moments(c.corners, c.source, c.z, c.sigma, want);
        const double whole = (double)(want[0] + want[1] + want[2]);
        for (int k = 0; k < 3; ++k)
        {
            keep_worst(&loose, (double)fabsl(out[k] - want[k]) / whole);
            keep_worst(&mutant, (double)fabsl(out[k] - want[(k + 1) % 3]) / whole);
        }
    }
    test_about("tolerance 1e-3");
    CHECK_BELOW(loose, 1e-3);
    CHECK_BETWEEN(mutant, 0.1, 1.0);
}

static void the_float_path(void)
{   // Oracle: the area integral of the same numbers. Coordinates of few bits, so that differences are exact.
    form_case c;
    for (int kind = -1; kind < EXTREMES; ++kind)
    {
        double worst = 0.0;
        random_seed(400 + (uint64_t)(kind + 1));
        test_about("%s", kind < 0 ? "ordinary" : extreme_names[kind]);
        for (int i = 0; i < 60; ++i)
        {
            float corners[9], source[3];
            make_extreme(kind < 0 ? EXTREMES : (extreme)kind, kind < 0 ? 5 * (i / 5) + i % 2 : i, &c);
            int exact = 1;
            for (int k = 0; k < 9; ++k)
            {
                corners[k] = (float)c.corners[k];
                source[k % 3] = (float)c.source[k % 3];
                exact &= (double)corners[k] == c.corners[k] && (double)source[k % 3] == c.source[k % 3];
                const float difference = corners[k] - source[k % 3];
                exact &= (double)difference == c.corners[k] - c.source[k % 3];
            }
            c.z = (double)(float)c.z;
            c.sigma = (double)(float)c.sigma;
            const double want = (double)form_want(&c);
            if (!exact || want < exp(-50.0) * 1e-3) // beyond 50/sigma nothing is promised
                continue;
            const float got = sss_bem_form_factor_float(corners, source, (float)c.z, (float)c.sigma);
            keep_worst(&worst, relative_error((double)got, want));
        }
        CHECK_BETWEEN(worst, DBL_MIN, 1e-4); // 0 would mean that nothing was compared
    }
}

static void form_factors_of_bad_input(void)
{   // Oracle: the declarations. NaN for null, non-finite and out of range; 0 without area or weight; infinite in the
    // polygon, on its edge and at its corner.
    static const double good[9] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    static const double source[3] = {0.25, 0.25, 0.5};
    static const double bad[3] = {(double)NAN, HUGE_VAL, -HUGE_VAL};
    double out[3] = {7.0, 8.0, 9.0};
    int all_nan = 1, all_refused = 1;
    CHECK(isnan(sss_bem_form_factor(NULL, 3, source, 1.0, 1.0)));
    CHECK(isnan(sss_bem_form_factor(good, 3, NULL, 1.0, 1.0)));
    CHECK(isnan(sss_bem_form_factor(good, 2, source, 1.0, 1.0)));
    CHECK(isnan(sss_bem_form_factor(good, 0, source, 1.0, 1.0)));
    CHECK(isnan(sss_bem_form_factor(good, 3, source, 1.0, -1.0)));
    CHECK(isnan(sss_bem_form_factor_within(good, 3, source, 1.0, 1.0, -1e-9)));
    CHECK(isnan(sss_bem_form_factor_within(good, 3, source, 1.0, 1.0, 1.5)));
    CHECK(isnan(sss_bem_form_factor_within(good, 3, source, 1.0, 1.0, (double)NAN)));
    CHECK(isnan(sss_bem_form_factor_taylor(NULL, 3, source, 1.0, 1.0, NULL)));
    CHECK(isnan(sss_bem_form_factor_taylor(good, 3, source, 1.0, -1.0, NULL)));
    CHECK(isnan(sss_bem_form_factor_float(NULL, (const float[3]){0, 0, 1}, 1.0f, 1.0f)));
    CHECK_EQUAL(sss_bem_form_factor_linear(NULL, source, 1.0, 1.0, 0.0, out), SSS_ERROR_INVALID_ARGUMENT);
    CHECK_EQUAL(sss_bem_form_factor_linear(good, NULL, 1.0, 1.0, 0.0, out), SSS_ERROR_INVALID_ARGUMENT);
    CHECK_EQUAL(sss_bem_form_factor_linear(good, source, 1.0, 1.0, 0.0, NULL), SSS_ERROR_INVALID_ARGUMENT);
    CHECK_EQUAL(sss_bem_form_factor_linear(good, source, 1.0, -1.0, 0.0, out), SSS_ERROR_INVALID_ARGUMENT);
    CHECK_EQUAL(sss_bem_form_factor_linear(good, source, 1.0, 1.0, 2.0, out), SSS_ERROR_INVALID_ARGUMENT);
    for (size_t b = 0; b < 3; ++b)
        for (size_t k = 0; k < 14; ++k)
        {   // each number in its turn
            double x[14];
            memcpy(x, good, sizeof good);
            memcpy(x + 9, source, sizeof source);
            x[12] = x[13] = 1.0;
            x[k] = bad[b];
            all_nan &= isnan(sss_bem_form_factor(x, 3, x + 9, x[12], x[13])) != 0;
            all_refused &= sss_bem_form_factor_linear(x, x + 9, x[12], x[13], 0.0, out) == SSS_ERROR_INVALID_ARGUMENT;
        }
    CHECK(all_nan && all_refused);
    test_about("%s", "");
    CHECK(out[0] == 7.0 && out[1] == 8.0 && out[2] == 9.0);
    static const double line[9] = {0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0};
    static const double spot[9] = {1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 1.0, 2.0, 3.0};
    CHECK(sss_bem_form_factor(line, 3, source, 1.0, 1.0) == 0.0);
    CHECK(sss_bem_form_factor(spot, 3, source, 1.0, 1.0) == 0.0);
    CHECK(sss_bem_form_factor(spot, 3, spot, 1.0, 1.0) == 0.0);
    CHECK(sss_bem_form_factor(good, 3, source, 0.0, 1.0) == 0.0);
    CHECK(sss_bem_form_factor_taylor(line, 3, source, 1.0, 1.0, NULL) == 0.0);
    CHECK(sss_bem_form_factor_float((const float[9]){0, 0, 0, 1, 1, 1, 2, 2, 2}, (const float[3]){0, 0, 1}, 1.0f,
                                    1.0f) == 0.0f);
    CHECK_EQUAL(sss_bem_form_factor_linear(line, source, 1.0, 1.0, 0.0, out), SSS_OK);
    CHECK(out[0] == 0.0 && out[1] == 0.0 && out[2] == 0.0);
    static const double in_it[3][3] = {{0.25, 0.25, 0.0}, {0.5, 0.0, 0.0}, {0.0, 1.0, 0.0}};
    for (size_t k = 0; k < 3; ++k)
    {
        test_about("source in the polygon, %d", (int)k);
        CHECK(sss_bem_form_factor(good, 3, in_it[k], 1.0, 1.0) == HUGE_VAL);
        CHECK(sss_bem_form_factor(good, 3, in_it[k], -1.0, 1.0) == -HUGE_VAL);
    }
    // A corner given twice, and one on an edge, change nothing.
    static const double doubled[15] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 1.0, 0.0};
    test_about("a corner twice");
    CHECK_REL(sss_bem_form_factor(doubled, 5, source, 1.0, 1.0), sss_bem_form_factor(good, 3, source, 1.0, 1.0), 1e-14);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {
        TEST(the_oracles_agree),
        TEST(ordinary_triangles),
        TEST(arbitrary_polygons),
        TEST(extreme_triangles),
        TEST(any_plane_any_height),
        TEST(split_triangles_sum_to_the_whole),
        TEST(symmetries_of_the_form_factor),
        TEST(without_absorption_it_is_a_solid_angle),
        TEST(discs_and_the_plane),
        TEST(tolerances_are_met),
        TEST(the_papers_series),
        TEST(samples_of_figure_4),
        TEST(linear_irradiance),
        TEST(the_float_path),
        TEST(form_factors_of_bad_input),
    };
    return test_main(argc, argv, "sss_bem.h", tests, COUNT(tests));
}
