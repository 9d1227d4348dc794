// Tests of sss_bem.h. Oracles, named at each test: brute force over the area in long double (tests/common/area.h),
// closed forms, the series of Mertens et al. 2003 as the paper has it, the converged reference of
// tests/common/reference.h, laws of scaling and symmetry, sums over all triangles written out here. None comes from the
// code under test.
//
// In the order of the header: form factor, hierarchy, shading in three modes, the paper's own oracle; then conduct
// under bad input, failing allocation and cancelling; then speed.

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../sss_bem.h"

#include "common/area.h"
#include "common/hooks.h"
#include "common/meshes.h"
#include "common/numbers.h"
#include "common/polygon.h"
#include "common/profiles.h"
#include "common/reference.h"
#include "common/test.h"
#include "common/version.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define PI_L 3.14159265358979323846264338327950288L

#define DEFAULT_GUARD 1.0 // of sss_bem_options

#define COUNT(array) (sizeof(array) / sizeof *(array))

// ============================================== Common helpers ==============================================

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

// The i-th case of a kind, in order from 0, and its integral, which takes most of the time and is kept for other tests.
static double next_extreme(int kind, int i, form_case *c)
{
    static double wants[EXTREMES][30];
    if (i == 0)
        random_seed(100 + (uint64_t)kind);
    make_extreme((extreme)kind, i, c);
    if (wants[kind][i] == 0.0)
        wants[kind][i] = (double)form_want(c);
    return wants[kind][i];
}

static void extreme_triangles(void)
{   // Oracle: the area integral. 30 triangles of each kind, in the xy-plane and in a tilted one.
    form_case c;
    for (int kind = 0; kind < EXTREMES; ++kind)
    {
        double worst = 0.0;
        test_about("%s", extreme_names[kind]);
        for (int i = 0; i < 30; ++i)
        {
            const double want = next_extreme(kind, i, &c);
            keep_worst(&worst, relative_error(form_got(&c), want));
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
        for (int i = 0; i < 60; ++i)
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
        for (int i = 0; i < 30; ++i)
        {
            const double want = next_extreme(kind, i, &c);
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
        for (int i = 0; i < 8; ++i)
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
        for (int i = 0; i < 30; ++i)
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

// ================================================= 2. Shading =================================================

// The same material where every length is `scale` times as long.
static sss_profile scaled_profile(sss_profile p, double scale)
{
    for (int c = 0; c < 3; ++c)
    {
        p.sigma_tr[c] /= scale;
        p.z_r[c] *= scale;
        p.z_v[c] *= scale;
    }
    return p;
}

// Light from (1,1,1), for each channel another brightness. shadow: nothing where x is above the mesh's middle, a hard
// edge; else a little everywhere, so that no receiver is dark.
static float *sunlight(const mesh_data *mesh, int shadow)
{
    float *E = (float *)malloc(3 * mesh->vertex_count * sizeof *E);
    double middle = 0.0;
    for (size_t v = 0; v < mesh->vertex_count; ++v)
        middle += (double)mesh->positions[3 * v] / (double)mesh->vertex_count;
    for (size_t v = 0; E != NULL && v < mesh->vertex_count; ++v)
        for (size_t c = 0; c < 3; ++c)
        {
            const float *n = &mesh->normals[3 * v];
            const float lit = fmaxf(0.0f, 0.57735f * (n[0] + n[1] + n[2])) * (1.0f + 0.5f * (float)c);
            E[3 * v + c] = !shadow ? lit + 0.02f : ((double)mesh->positions[3 * v] > middle ? 0.0f : lit);
        }
    return E;
}

// An object, its mesh, its light, room for results.
typedef struct scene
{
    mesh_data mesh;
    sss_mesh view;
    sss_profile profile;
    float *E, *B, *other; // [V][3]
    size_t V;
} scene;

// Takes the mesh over.
static int scene_make(scene *s, const mesh_data *mesh, double mm_per_unit, const char *material)
{
    memset(s, 0, sizeof *s);
    s->mesh = *mesh;
    s->view = mesh_view(&s->mesh, mm_per_unit);
    s->profile = profile_of(material);
    s->V = mesh->vertex_count;
    s->E = sunlight(&s->mesh, 0);
    s->B = (float *)calloc(3 * s->V, sizeof(float));
    s->other = (float *)calloc(3 * s->V, sizeof(float));
    return s->E == NULL || s->B == NULL || s->other == NULL;
}

static void scene_free(scene *s)
{
    mesh_free(&s->mesh);
    free(s->E);
    free(s->B);
    free(s->other);
    memset(s, 0, sizeof *s);
}

static int scene_of_sphere(scene *s, int levels, double radius_mm)
{
    mesh_data sphere;
    return mesh_sphere(levels, radius_mm, &sphere) != 0 || scene_make(s, &sphere, 1.0, "Marble") != 0;
}

// The bunny with about 1/factor of its triangles.
static int scene_of_bunny(scene *s, double factor, double size_mm, const char *material)
{
    mesh_data bunny, coarse;
    memset(s, 0, sizeof *s);
    if (mesh_load_bunny(&bunny) != 0)
        return 1;
    if (factor > 1.0)
    {
        const int failed = mesh_decimate(&bunny, factor, &coarse);
        mesh_free(&bunny);
        if (failed)
            return 1;
        bunny = coarse;
    }
    return scene_make(s, &bunny, size_mm / mesh_extent(&bunny), material);
}

// NULL where something failed.
static sss_bem *bem_of(const scene *s, const sss_bem_options *options, const sss_hooks *hooks)
{
    sss_bem *bem = NULL;
    if (sss_bem_create(&s->view, &s->profile, options, hooks, &bem) != SSS_OK)
        return NULL;
    if (sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s->E) == SSS_OK)
        return bem;
    sss_bem_free(bem);
    return NULL;
}

static sss_bem_stats stats_of(const sss_bem *bem)
{
    sss_bem_stats stats;
    memset(&stats, 0, sizeof stats);
    CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
    return stats;
}

static sss_bem_options options_of(double tolerance, double guard)
{
    sss_bem_options options;
    memset(&options, 0, sizeof options);
    options.tolerance = tolerance;
    options.guard = guard;
    return options;
}

static sss_result shade_once(const scene *s, const sss_bem_options *options, float *B)
{
    sss_bem *bem = bem_of(s, options, NULL);
    const sss_result result = bem != NULL ? sss_bem_shade(bem, B) : SSS_ERROR_BAD_DATA;
    sss_bem_free(bem);
    return result;
}

static sss_hooks threaded(void)
{
    sss_hooks hooks;
    memset(&hooks, 0, sizeof hooks);
    hooks.parallel_for = threads_for;
    return hooks;
}

// The same on three threads, bit for bit (splitting_changes_no_bit).
static sss_result shade_threaded(const scene *s, const sss_bem_options *options, float *B)
{
    const sss_hooks hooks = threaded();
    sss_bem *bem = bem_of(s, options, &hooks);
    const sss_result result = bem != NULL ? sss_bem_shade(bem, B) : SSS_ERROR_BAD_DATA;
    sss_bem_free(bem);
    return result;
}

// What the converged reference says of some vertices.
typedef struct truth
{
    size_t *index;
    size_t count;
    double *B; // [count][3]
} truth;

static int truth_make(truth *t, const scene *s, size_t count, double guard, double tolerance)
{
    const reference_options options = {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, tolerance, guard};
    t->index = mesh_vertices_by_area(&s->mesh, count);
    t->count = count;
    t->B = (double *)calloc(6 * count, sizeof *t->B);
    return t->index == NULL || t->B == NULL ||
           reference_radiosity_many(&s->view, &s->profile, s->E, &options, s->mesh.positions, s->mesh.normals, t->index,
                                    count, 2, t->B, t->B + 3 * count) != 0;
}

static void truth_free(truth *t)
{
    free(t->index);
    free(t->B);
}

static double error_at(const truth *t, const float *B)
{
    double error = 0.0, norm = 0.0;
    for (size_t i = 0; i < 3 * t->count; ++i)
    {
        const double d = B[3 * t->index[i / 3] + i % 3] - t->B[i];
        error += d * d;
        norm += t->B[i] * t->B[i];
    }
    return sqrt(error / norm);
}

// Relative L2 distance of two results, weighted by area, over all vertices; and the largest over the largest.
static double distance_of(const scene *s, const float *B, const float *want)
{
    double *area = (double *)calloc(s->V, sizeof *area), error = 0.0, norm = 0.0;
    if (area == NULL)
        return HUGE_VAL;
    mesh_vertex_areas(&s->mesh, area);
    for (size_t i = 0; i < 3 * s->V; ++i)
    {
        error += area[i / 3] * ((double)B[i] - want[i]) * ((double)B[i] - want[i]);
        norm += area[i / 3] * (double)want[i] * want[i];
    }
    free(area);
    return sqrt(error / norm);
}

static double largest_difference(const float *B, const float *want, size_t count)
{
    double error = 0.0, largest = 0.0;
    for (size_t i = 0; i < count; ++i)
    {
        keep_worst(&error, fabs((double)B[i] - want[i]));
        keep_worst(&largest, fabs((double)want[i]));
    }
    return error == 0.0 ? 0.0 : error / largest;
}

// ---- Against the converged reference ----

static const char *const two_materials[2] = {"Marble", "Skimmilk"};
static const double three_sizes[3] = {10.0, 50.0, 200.0};

// The reference is asked for 1e-3. Its own estimate is an upper bound that a mesh of small triangles leaves far behind:
// the_reference_is_as_good_as_is_said_here.
#define REFERENCE 1e-3

enum { FEW = 64, MANY = 300 };

// A case of the bars: the whole bunny in a material at a size. `few` vertices are held against the converged reference,
// `many` against the tightest sums, 1e-4, which bunny_agrees_with_the_reference holds against the reference at the few.
// Made when first asked for, then shared by all tests; freed by main.
typedef struct bunny_case
{
    int made;
    scene s;
    truth few, many;
} bunny_case;

static bunny_case g_bunnies[2][3];

// B of some vertices by sss_bem_gather.
static sss_result gather_at(const scene *s, const sss_bem *bem, const size_t *index, size_t count, double *B)
{
    float *x = (float *)malloc(9 * count * sizeof *x), *n = x + 3 * count, *out = n + 3 * count;
    sss_result result = SSS_ERROR_OUT_OF_MEMORY;
    for (size_t i = 0; x != NULL && i < 3 * count; ++i)
    {
        x[i] = s->mesh.positions[3 * index[i / 3] + i % 3];
        n[i] = s->mesh.normals[3 * index[i / 3] + i % 3];
    }
    if (x != NULL)
        result = sss_bem_gather(bem, x, n, count, out);
    for (size_t i = 0; result == SSS_OK && i < 3 * count; ++i)
        B[i] = out[i];
    free(x);
    return result;
}

// shade for some vertices: only the rows that hold them, which a rough object of the same mesh finds; the rest of B is
// NaN.
static sss_result shade_rows_of(const scene *s, const sss_bem *bem, const size_t *index, size_t count, float *B)
{
    const sss_bem_options rough = options_of(0.5, 0.0);
    sss_bem *finder = bem_of(s, &rough, NULL);
    sss_bem_stats stats;
    sss_result result = finder != NULL ? sss_bem_get_stats(finder, &stats) : SSS_ERROR_BAD_DATA;
    for (size_t i = 0; i < 3 * s->V; ++i)
        B[i] = s->other[i] = (float)NAN;
    for (size_t row = 0; result == SSS_OK && row < stats.row_count; ++row)
    {
        int holds = 0;
        result = sss_bem_shade_rows(finder, row, row + 1, s->other);
        for (size_t i = 0; i < count; ++i)
            if (!isnan(s->other[3 * index[i]]))
            {
                holds = 1;
                s->other[3 * index[i]] = (float)NAN;
            }
        if (holds && result == SSS_OK)
            result = sss_bem_shade_rows(bem, row, row + 1, B);
    }
    sss_bem_free(finder);
    return result;
}

// What the object says of vertices drawn by area.
static int truth_by_gathering(truth *t, const scene *s, const sss_bem *bem, size_t count)
{
    t->index = mesh_vertices_by_area(&s->mesh, count);
    t->count = count;
    t->B = (double *)calloc(3 * count, sizeof *t->B);
    return bem == NULL || t->index == NULL || t->B == NULL || gather_at(s, bem, t->index, count, t->B) != SSS_OK;
}

// NULL where the bunny is not installed.
static bunny_case *bunny_at(int material, int size)
{
    bunny_case *c = &g_bunnies[material][size];
    if (c->made)
        return c;
    if (scene_of_bunny(&c->s, 1.0, three_sizes[size], two_materials[material]) != 0)
        return NULL;
    const sss_bem_options finest = options_of(1e-4, 0.0);
    const sss_hooks hooks = threaded();
    sss_bem *bem = bem_of(&c->s, &finest, &hooks);
    CHECK_EQUAL(truth_make(&c->few, &c->s, FEW, DEFAULT_GUARD, REFERENCE), 0);
    CHECK_EQUAL(truth_by_gathering(&c->many, &c->s, bem, MANY), 0);
    sss_bem_free(bem);
    c->made = 1;
    return c;
}

static void free_bunnies(void)
{
    for (int m = 0; m < 2; ++m)
        for (int size = 0; size < 3; ++size)
        {
            truth_free(&g_bunnies[m][size].few);
            truth_free(&g_bunnies[m][size].many);
            scene_free(&g_bunnies[m][size].s);
        }
    memset(g_bunnies, 0, sizeof g_bunnies);
}

static void the_reference_is_as_good_as_is_said_here(void)
{   // Oracle: the reference at 1e-5. What it is asked for below, 1e-3, is in fact a hundredth of the finest bar, 1e-4.
    for (int size = 0; size < 3; size += 2)
    {
        scene s;
        truth t;
        if (scene_of_bunny(&s, 1.0, three_sizes[size], "Marble") != 0)
            SKIP("glmark2-data with its bunny is not installed");
        CHECK_EQUAL(truth_make(&t, &s, 2, DEFAULT_GUARD, 1e-5), 0);
        for (size_t i = 0; i < 2; ++i)
            for (size_t c = 0; c < 3; ++c)
                s.B[3 * t.index[i] + c] = (float)t.B[3 * i + c];
        truth_free(&t);
        CHECK_EQUAL(truth_make(&t, &s, 2, DEFAULT_GUARD, REFERENCE), 0);
        test_about("%g mm", three_sizes[size]);
        CHECK_BETWEEN(error_at(&t, s.B), 1e-9, 1e-6);
        truth_free(&t);
        scene_free(&s);
    }
}

static void bunny_agrees_with_the_reference(void)
{   // Oracle: the converged reference with the same guard, 64 vertices by area. The whole bunny, in both materials of
    // the bars and at their three sizes, at the tightest tolerance: the rows that hold those vertices, and these
    // vertices gathered. What is coarser follows in errors_are_predicted.
    for (int m = 0; m < 2; ++m)
        for (int size = 0; size < 3; ++size)
        {
            bunny_case *c = bunny_at(m, size);
            if (c == NULL)
                SKIP("glmark2-data with its bunny is not installed");
            scene *s = &c->s;
            const sss_bem_options finest = options_of(1e-4, 0.0);
            const sss_hooks hooks = threaded();
            CHECK_EQUAL(s->mesh.triangle_count, 69666);
            sss_bem *bem = bem_of(s, &finest, &hooks);
            test_about("%s, %g mm, tolerance %g", two_materials[m], three_sizes[size], finest.tolerance);
            CHECK_EQUAL(shade_rows_of(s, bem, c->few.index, FEW, s->B), SSS_OK);
            CHECK_BETWEEN(error_at(&c->few, s->B), 1e-7, finest.tolerance);
            double gathered[3 * FEW];
            CHECK_EQUAL(gather_at(s, bem, c->few.index, FEW, gathered), SSS_OK);
            for (size_t i = 0; i < 3 * FEW; ++i)
                s->B[3 * c->few.index[i / 3] + i % 3] = (float)gathered[i];
            CHECK_BETWEEN(error_at(&c->few, s->B), 1e-7, finest.tolerance);
            sss_bem_free(bem);
            // A mutation: the channels mixed up must be caught.
            for (size_t i = 0; i < 3 * s->V; i += 3)
            {
                const float red = s->B[i];
                s->B[i] = s->B[i + 2];
                s->B[i + 2] = red;
            }
            CHECK_BETWEEN(error_at(&c->few, s->B), 0.02, 2.0);
        }
}

static void shadow_edges_and_no_guard(void)
{   // Oracle: the converged reference, 64 vertices by area. A hard shadow across the bunny, with the guard; and the
    // light of the test before without any guard against the reference without, spikes included.
    for (int k = 0; k < 4; ++k)
    {
        scene s;
        truth t;
        const int m = k % 2, size = k < 2 ? k : 2, shadow = k < 3;
        const double guard = shadow ? DEFAULT_GUARD : 0.0;
        if (scene_of_bunny(&s, 1.0, three_sizes[size], two_materials[m]) != 0)
            SKIP("glmark2-data with its bunny is not installed");
        free(s.E);
        s.E = sunlight(&s.mesh, shadow);
        CHECK_EQUAL(truth_make(&t, &s, FEW, guard, REFERENCE), 0);
        for (int digits = 2; digits <= 3; ++digits)
        {
            const sss_bem_options options = options_of(pow(10.0, -digits), shadow ? 0.0 : -1.0);
            test_about("%s, %g mm, %s, tolerance %g", two_materials[m], three_sizes[size],
                       shadow ? "shadow edge" : "no guard", options.tolerance);
            CHECK_EQUAL(shade_threaded(&s, &options, s.B), SSS_OK);
            CHECK_BETWEEN(error_at(&t, s.B), 1e-7, options.tolerance);
        }
        truth_free(&t);
        scene_free(&s);
    }
}

static void the_guards_cost(void)
{   // Oracle: the converged reference without a guard, on a coarse bunny. Where scattering is short the guard changes
    // nothing; where objects are thinner than its sources are deep, it cuts what is spurious.
    for (int size = 0; size < 3; ++size)
    {
        scene s;
        truth t;
        if (scene_of_bunny(&s, 10.0, three_sizes[size], "Marble") != 0)
            SKIP("glmark2-data with its bunny is not installed");
        CHECK_EQUAL(truth_make(&t, &s, 60, 0.0, 2e-4), 0);
        const sss_bem_options open = options_of(1e-3, -1.0), guarded = options_of(1e-3, 0.0);
        test_about("%g mm", three_sizes[size]);
        CHECK_EQUAL(shade_once(&s, &open, s.B), SSS_OK);
        CHECK_EQUAL(shade_once(&s, &guarded, s.other), SSS_OK);
        CHECK_BELOW(error_at(&t, s.B), 1e-3);
        test_note("relative L2 distance from the unguarded integral: no guard %.2e, default guard %.2e",
                  error_at(&t, s.B), error_at(&t, s.other));
        if (size == 2)
            CHECK_BELOW(error_at(&t, s.other), 2e-2);
        truth_free(&t);
        scene_free(&s);
    }
}

static void errors_are_predicted(void)
{   // Oracles: the converged reference at 64 vertices; and the tightest sums at 300, themselves held against the
    // reference above. Errors are what was asked for; the prediction is never below what is measured, never more than
    // five times above.
    static const double tolerances[5] = {0.1, 0.03, 0.01, 0.003, 0.001};
    for (int m = 0; m < 2; ++m)
        for (int size = 0; size < 3; ++size)
        {
            bunny_case *c = bunny_at(m, size);
            if (c == NULL)
                SKIP("glmark2-data with its bunny is not installed");
            for (size_t k = 0; k < 5; ++k)
            {
                const sss_bem_options options = options_of(tolerances[k], 0.0);
                const sss_hooks hooks = threaded();
                sss_bem_stats stats;
                double error = -1.0;
                sss_bem *bem = bem_of(&c->s, &options, &hooks);
                memset(&stats, 0, sizeof stats);
                CHECK_EQUAL(sss_bem_shade(bem, c->s.B), SSS_OK);
                CHECK_EQUAL(sss_bem_predict_error(bem, 0, &error), SSS_OK);
                CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
                const double measured = error_at(&c->many, c->s.B);
                test_about("%s, %g mm, tolerance %g", two_materials[m], three_sizes[size], tolerances[k]);
                CHECK_BETWEEN(measured, 1e-7, tolerances[k]);
                CHECK_BETWEEN(error_at(&c->few, c->s.B), 1e-7, tolerances[k]);
                CHECK_BETWEEN(stats.predicted_error / measured, 1.0, 5.0);
                CHECK(error > 0.0 && error <= stats.predicted_error);
                sss_bem_free(bem);
            }
        }
}

// ---- Closed forms ----

static void flat_squares(void)
{   // Oracle: the area integral. On a flat square under constant irradiance every receiver sees one polygon: B = E
    // alpha'/(4 pi) (I(z_r) + I(z_v)). In the middle, on the rim and at a corner; E at vertices and at triangles.
    scene s;
    mesh_data grid;
    const sss_bem_options options = options_of(1e-4, 0.0);
    if (mesh_grid(40, 30.0, &grid) != 0 || scene_make(&s, &grid, 1.0, "Marble") != 0)
        SKIP("out of memory");
    static const double square[12] = {-15, -15, 0, 15, -15, 0, 15, 15, 0, -15, 15, 0};
    float *E_triangles = (float *)calloc(3 * s.mesh.triangle_count, sizeof(float));
    for (size_t i = 0; i < 3 * s.V; ++i)
        s.E[i] = 2.0f;
    for (size_t i = 0; i < 3 * s.mesh.triangle_count; ++i)
        E_triangles[i] = 2.0f;
    sss_bem *bem = bem_of(&s, &options, NULL);
    CHECK_EQUAL(sss_bem_shade(bem, s.B), SSS_OK);
    CHECK_EQUAL(sss_bem_set_irradiance(bem, SSS_BEM_TRIANGLES, E_triangles), SSS_OK);
    CHECK_EQUAL(sss_bem_shade(bem, s.other), SSS_OK);
    double worst = 0.0, by_triangles = 0.0, middle = 0.0;
    for (size_t v = 0; v < s.V; v += 131)
        for (size_t c = 0; c < 3; ++c)
        {
            const sss_profile *p = &s.profile;
            const float *x = &s.mesh.positions[3 * v];
            const double real[3] = {x[0], x[1], p->z_r[c]}, virtual_one[3] = {x[0], x[1], p->z_v[c]};
            const double want = 2.0 * p->alpha_p[c] / (4.0 * PI) *
                                (double)(area_source_term(square, 4, real, p->z_r[c], p->sigma_tr[c]) +
                                         area_source_term(square, 4, virtual_one, p->z_v[c], p->sigma_tr[c]));
            keep_worst(&worst, relative_error(s.B[3 * v + c], want));
            keep_worst(&by_triangles, relative_error(s.other[3 * v + c], want));
            middle = fmax(middle, s.B[3 * v + c]);
        }
    CHECK_BELOW(worst, 5e-4);
    CHECK_BELOW(by_triangles, 5e-4);
    CHECK_BELOW(middle, 2.0); // no more light leaves than enters
    sss_bem_free(bem);
    free(E_triangles);
    scene_free(&s);
}

// A sphere of radius a under constant irradiance 1; the source D from its centre. Since s ds = a D sin(theta) dtheta,
// the integral is 2 pi a z/D [exp(-sigma s)/s] between |a - D| and a + D.
static double sphere_radiosity(const sss_profile *p, int c, double a)
{
    double sum = 0.0;
    for (int source = 0; source < 2; ++source)
    {
        const double z = source == 0 ? p->z_r[c] : p->z_v[c], D = fabs(source == 0 ? a - z : a + z);
        const double near_s = fabs(a - D), far_s = a + D, sigma = p->sigma_tr[c];
        sum += 2.0 * PI * a * z / D * (exp(-sigma * near_s) / near_s - exp(-sigma * far_s) / far_s);
    }
    return p->alpha_p[c] / (4.0 * PI) * sum;
}

static void spheres(void)
{   // Oracle: closed form (above); two levels of subdivision extrapolate to the sphere, whose surface they approach
    // with the square of the edge. Radius 5 mm in marble, in the mean over the vertices.
    double value[2][3] = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    const sss_bem_options options = options_of(1e-4, 0.0);
    sss_profile profile = failed_profile();
    for (int k = 0; k < 2; ++k)
    {
        scene s;
        if (scene_of_sphere(&s, 4 + k, 5.0) != 0)
            SKIP("out of memory");
        for (size_t i = 0; i < 3 * s.V; ++i)
            s.E[i] = 1.0f;
        CHECK_EQUAL(shade_once(&s, &options, s.B), SSS_OK);
        for (size_t i = 0; i < 3 * s.V; ++i)
            value[k][i % 3] += s.B[i] / (double)s.V;
        profile = s.profile;
        scene_free(&s);
    }
    for (int c = 0; c < 3; ++c)
        CHECK_REL((4.0 * value[1][c] - value[0][c]) / 3.0, sphere_radiosity(&profile, c, 5.0), 1e-3);
}

// ---- Media and scales ----

// One small scene against the reference; the guard as given.
static void small_case(const scene *s, double tolerance, const char *name)
{
    truth t;
    const sss_bem_options options = options_of(tolerance, 0.0);
    test_about("%s", name);
    CHECK_EQUAL(truth_make(&t, s, 30, DEFAULT_GUARD, 0.1 * tolerance), 0);
    CHECK_EQUAL(shade_once(s, &options, s->B), SSS_OK);
    CHECK_BELOW(error_at(&t, s->B), tolerance);
    truth_free(&t);
}

static void special_media(void)
{   // Oracle: the converged reference. No absorption; absorption far above scattering; a channel without scattering,
    // which is exactly dark, and one without any medium.
    scene s;
    if (scene_of_sphere(&s, 4, 5.0) != 0)
        SKIP("out of memory");
    s.profile = profile_of("Spectralon");
    small_case(&s, 1e-2, "Spectralon");
    small_case(&s, 1e-3, "Spectralon at 1e-3");
    s.profile = profile_of("Ketchup");
    small_case(&s, 1e-2, "Ketchup");
    s.profile = profile_of("Marble");
    s.profile.alpha_p[1] = 0.0;
    s.profile.alpha_p[2] = s.profile.z_r[2] = s.profile.z_v[2] = s.profile.sigma_tr[2] = 0.0;
    small_case(&s, 1e-2, "two dark channels");
    int dark = 1;
    for (size_t v = 0; v < s.V; ++v)
        dark &= s.B[3 * v] > 0.0f && s.B[3 * v + 1] == 0.0f && s.B[3 * v + 2] == 0.0f;
    CHECK(dark);
    scene_free(&s);
}

static void mean_free_paths_of_every_length(void)
{   // Oracle: the converged reference. Marble whose lengths are 1e-6 to 1e6 times those of the sphere, and channels
    // that differ by 1e4. No number is anything but finite.
    char name[64];
    scene s;
    if (scene_of_sphere(&s, 4, 1.0) != 0)
        SKIP("out of memory");
    const sss_profile marble = profile_of("Marble");
    for (int digits = -6; digits <= 6; digits += 2)
    {
        (void)snprintf(name, sizeof name, "mean free path 1e%d", digits);
        s.profile = scaled_profile(marble, pow(10.0, digits));
        small_case(&s, 1e-2, name);
        int finite = 1;
        for (size_t i = 0; i < 3 * s.V; ++i)
            finite &= isfinite(s.B[i]) != 0;
        CHECK(finite);
    }
    const sss_profile thin = scaled_profile(marble, 1e-2), thick = scaled_profile(marble, 1e2);
    s.profile = marble;
    s.profile.sigma_tr[0] = thin.sigma_tr[0];
    s.profile.z_r[0] = thin.z_r[0];
    s.profile.z_v[0] = thin.z_v[0];
    s.profile.sigma_tr[2] = thick.sigma_tr[2];
    s.profile.z_r[2] = thick.z_r[2];
    s.profile.z_v[2] = thick.z_v[2];
    small_case(&s, 1e-2, "channels of unlike paths");
    scene_free(&s);
}

static void units_change_nothing(void)
{   // Oracle: similarity. mm_per_unit over twelve orders, the material with it: the same B.
    scene s;
    if (scene_of_sphere(&s, 4, 5.0) != 0)
        SKIP("out of memory");
    const sss_profile marble = s.profile;
    CHECK_EQUAL(shade_once(&s, NULL, s.other), SSS_OK);
    for (int digits = -6; digits <= 6; digits += 3)
    {
        s.view.mm_per_unit = pow(10.0, digits);
        s.profile = scaled_profile(marble, pow(10.0, digits));
        test_about("1e%d mm per unit", digits);
        CHECK_EQUAL(shade_once(&s, NULL, s.B), SSS_OK);
        CHECK_BELOW(largest_difference(s.B, s.other, 3 * s.V), 1e-5);
    }
    scene_free(&s);
}

static void radiosity_is_linear(void)
{   // Oracle: linearity. Doubled light doubles B; no light gives exactly nothing; light is added within the tolerance.
    scene s;
    if (scene_of_sphere(&s, 4, 5.0) != 0)
        SKIP("out of memory");
    sss_bem *bem = bem_of(&s, NULL, NULL);
    float *sum = (float *)calloc(3 * s.V, sizeof *sum);
    CHECK_EQUAL(sss_bem_shade(bem, s.other), SSS_OK);
    for (size_t i = 0; i < 3 * s.V; ++i)
        s.E[i] *= 2.0f;
    CHECK_EQUAL(sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s.E), SSS_OK);
    CHECK_EQUAL(sss_bem_shade(bem, s.B), SSS_OK);
    for (size_t i = 0; i < 3 * s.V; ++i)
    {
        sum[i] = 2.0f * s.other[i];
        s.E[i] = 0.0f;
    }
    CHECK_BELOW(largest_difference(s.B, sum, 3 * s.V), 1e-6);
    CHECK_EQUAL(sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s.E), SSS_OK);
    CHECK_EQUAL(sss_bem_shade(bem, s.B), SSS_OK);
    int dark = 1;
    for (size_t i = 0; i < 3 * s.V; ++i)
        dark &= s.B[i] == 0.0f;
    CHECK(dark);
    free(sum);
    sss_bem_free(bem);
    scene_free(&s);
}

static void every_path_agrees(void)
{   // Oracle: plain C. Each set of instructions of this processor within its stated tolerance.
    static const sss_bem_path paths[4] = {SSS_BEM_PATH_PORTABLE, SSS_BEM_PATH_AUTO, SSS_BEM_PATH_AVX2,
                                          SSS_BEM_PATH_AVX512};
    scene s;
    if (scene_of_bunny(&s, 10.0, 50.0, "Skimmilk") != 0)
        SKIP("glmark2-data with its bunny is not installed");
    for (size_t k = 0; k < 4; ++k)
    {
        sss_bem_options options = options_of(1e-3, 0.0);
        sss_bem_stats stats;
        sss_bem *bem = NULL;
        options.path = paths[k];
        test_about("path %d", (int)paths[k]);
        const sss_result result = sss_bem_create(&s.view, &s.profile, &options, NULL, &bem);
        if (result == SSS_ERROR_INVALID_ARGUMENT && k >= 2)
        {
            test_note("this processor lacks path %d", (int)paths[k]);
            continue;
        }
        CHECK_EQUAL(result, SSS_OK);
        CHECK_EQUAL(sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s.E), SSS_OK);
        CHECK_EQUAL(sss_bem_shade(bem, k == 0 ? s.other : s.B), SSS_OK);
        CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
        CHECK(k == 1 || stats.path == paths[k]);
        if (k > 0)
            CHECK_BELOW(distance_of(&s, s.B, s.other), stats.path_tolerance);
        CHECK_BELOW(stats.path_tolerance, 0.2 * options.tolerance);
        sss_bem_free(bem);
    }
    scene_free(&s);
}

// ================================================= 3. Three modes =================================================

static void splitting_changes_no_bit(void)
{   // Oracle: the whole in one call. Rows in pieces of 1, 7 and 64, written nowhere else; threads; a second object.
    static const size_t steps[3] = {1, 7, 64};
    scene s;
    if (scene_of_bunny(&s, 20.0, 50.0, "Marble") != 0)
        SKIP("glmark2-data with its bunny is not installed");
    const size_t bytes = 3 * s.V * sizeof(float);
    sss_bem *bem = bem_of(&s, NULL, NULL);
    const sss_bem_stats stats = stats_of(bem);
    CHECK_EQUAL(sss_bem_shade(bem, s.other), SSS_OK);
    CHECK_BETWEEN((double)stats.row_count, 2.0, (double)s.V);
    for (size_t k = 0; k < 3; ++k)
    {
        int fine = 1;
        memset(s.B, 0x7F, bytes);
        for (size_t begin = 0; begin < stats.row_count; begin += steps[k])
        {
            const size_t end = begin + steps[k] < stats.row_count ? begin + steps[k] : stats.row_count;
            fine &= sss_bem_shade_rows(bem, begin, end, s.B) == SSS_OK;
        }
        test_about("pieces of %d", (int)steps[k]);
        CHECK(fine && memcmp(s.B, s.other, bytes) == 0);
    }
    memset(s.B, 0x7F, bytes);
    CHECK_EQUAL(sss_bem_shade_rows(bem, 1, 2, s.B), SSS_OK);
    size_t written = 0;
    int as_whole = 1;
    for (size_t v = 0; v < s.V; ++v)
    {
        unsigned char fill[12];
        memset(fill, 0x7F, sizeof fill);
        const int touched = memcmp(&s.B[3 * v], fill, sizeof fill) != 0;
        written += touched ? 1 : 0;
        as_whole &= !touched || memcmp(&s.B[3 * v], &s.other[3 * v], sizeof fill) == 0;
    }
    test_about("%s", "one row");
    CHECK(as_whole);
    CHECK_BETWEEN((double)written, 1.0, (double)s.V / 2.0);
    sss_bem_free(bem);
    int calls = 0;
    sss_hooks hooks;
    memset(&hooks, 0, sizeof hooks);
    hooks.parallel_for = threads_for;
    hooks.user = &calls;
    bem = bem_of(&s, NULL, &hooks);
    test_about("%s", "threads");
    CHECK_EQUAL(sss_bem_shade(bem, s.B), SSS_OK);
    CHECK(memcmp(s.B, s.other, bytes) == 0);
    CHECK_EQUAL(sss_bem_update(bem, 0, NULL), SSS_OK);
    CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
    sss_bem *serial = bem_of(&s, NULL, NULL);
    CHECK_EQUAL(sss_bem_update(serial, 0, NULL), SSS_OK);
    CHECK_EQUAL(sss_bem_render(serial, s.other), SSS_OK);
    CHECK(memcmp(s.B, s.other, bytes) == 0);
    CHECK(calls > 0);
    sss_bem_free(serial);
    sss_bem_free(bem);
    scene_free(&s);
}

static void three_modes_agree(void)
{   // Oracle: one mode against another, to rounding: on the fly, render after a full update, render after many small
    // ones, render with nothing linked; then at another light. gather at the vertices differs by the tolerance at most.
    static const double tolerances[2] = {1e-2, 1e-3};
    for (int k = 0; k < 4; ++k)
    {
        scene s;
        sss_bem_stats stats;
        const sss_bem_options options = options_of(tolerances[k % 2], 0.0);
        if (scene_of_bunny(&s, 15.0, three_sizes[k % 3], two_materials[k / 2]) != 0)
            SKIP("glmark2-data with its bunny is not installed");
        sss_bem *bem = bem_of(&s, &options, NULL), *slow = bem_of(&s, &options, NULL);
        size_t pending = 1, calls = 0, last = SIZE_MAX;
        int falls = 1;
        test_about("%s, %g mm, tolerance %g", two_materials[k / 2], three_sizes[k % 3], options.tolerance);
        CHECK_EQUAL(sss_bem_shade(bem, s.other), SSS_OK);
        CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
        CHECK_BELOW(largest_difference(s.B, s.other, 3 * s.V), 1e-6);
        CHECK_EQUAL(sss_bem_update(bem, 0, &pending), SSS_OK);
        CHECK_EQUAL(pending, 0);
        CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
        CHECK_BELOW(largest_difference(s.B, s.other, 3 * s.V), 1e-6);
        CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
        CHECK(stats.pending_rows == 0 && stats.link_count > 0);
        CHECK(stats.link_bytes > 0 && stats.link_bytes < stats.bytes);
        test_note("%.1f links and %.1f near factors a vertex, %.0f bytes of links a vertex",
                  (double)stats.link_count / (double)s.V, (double)stats.near_count / (double)s.V,
                  (double)stats.link_bytes / (double)s.V);
        for (pending = 1; pending > 0 && calls < 100000; ++calls)
        {
            if (sss_bem_update(slow, 20000, &pending) != SSS_OK)
                break;
            falls &= pending <= last;
            last = pending;
            if (calls % 37 == 5)
            {   // half linked: the same light
                CHECK_EQUAL(sss_bem_render(slow, s.B), SSS_OK);
                CHECK_BELOW(largest_difference(s.B, s.other, 3 * s.V), 1e-6);
            }
        }
        CHECK(falls);
        CHECK_BETWEEN((double)calls, 2.0, 99999.0);
        CHECK_EQUAL(sss_bem_render(bem, s.other), SSS_OK);
        CHECK_EQUAL(sss_bem_render(slow, s.B), SSS_OK);
        CHECK(memcmp(s.B, s.other, 3 * s.V * sizeof(float)) == 0);
        free(s.E);
        s.E = sunlight(&s.mesh, 1);
        CHECK_EQUAL(sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s.E), SSS_OK);
        CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
        CHECK_EQUAL(sss_bem_shade(bem, s.other), SSS_OK);
        CHECK_BELOW(largest_difference(s.B, s.other, 3 * s.V), 1e-6);
        CHECK_EQUAL(sss_bem_gather(bem, s.mesh.positions, s.mesh.normals, s.V, s.B), SSS_OK);
        CHECK_BELOW(distance_of(&s, s.B, s.other), 2.0 * options.tolerance);
        sss_bem_unlink(bem);
        CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
        CHECK(stats.link_count == 0 && stats.link_bytes == 0);
        CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
        CHECK_BELOW(largest_difference(s.B, s.other, 3 * s.V), 1e-6);
        sss_bem_free(slow);
        sss_bem_free(bem);
        scene_free(&s);
    }
}

// ---- Incremental ----

// A smooth bump of the given height and radius over a vertex.
static void bump(const scene *s, const float *from, float *to, size_t vertex, double radius, double height)
{
    for (size_t v = 0; v < s->V; ++v)
    {
        double r2 = 0.0;
        for (size_t k = 0; k < 3; ++k)
            r2 += ((double)from[3 * v + k] - from[3 * vertex + k]) * ((double)from[3 * v + k] - from[3 * vertex + k]);
        const double w = fmax(0.0, 1.0 - r2 / (radius * radius));
        for (size_t k = 0; k < 3; ++k)
            to[3 * v + k] = (float)(from[3 * v + k] + height * w * w * s->mesh.normals[3 * vertex + k]);
    }
}

static size_t moved_vertices(const scene *s, const float *a, const float *b)
{
    size_t moved = 0;
    for (size_t v = 0; v < s->V; ++v)
        moved += memcmp(&a[3 * v], &b[3 * v], 3 * sizeof(float)) != 0 ? 1 : 0;
    return moved;
}

// The radius around a vertex that holds a share of the vertices, by halving.
static double radius_for(const scene *s, size_t vertex, double share)
{
    double low = 0.0, high = 2.0 * mesh_extent(&s->mesh);
    for (int i = 0; i < 40; ++i)
    {
        const double middle = 0.5 * (low + high);
        size_t inside = 0;
        for (size_t v = 0; v < s->V; ++v)
        {
            double r2 = 0.0;
            for (size_t k = 0; k < 3; ++k)
            {
                const double d = (double)s->mesh.positions[3 * v + k] - s->mesh.positions[3 * vertex + k];
                r2 += d * d;
            }
            inside += r2 < middle * middle ? 1 : 0;
        }
        *((double)inside > share * (double)s->V ? &high : &low) = middle;
    }
    return high;
}

// Seconds of: a new object with all its links; 5 % moved.
typedef struct edit_times
{
    double build, edit;
} edit_times;

static edit_times time_edit(const scene *s, sss_bem *bem, const float *to)
{
    edit_times t;
    sss_bem *fresh = NULL;
    double start = test_seconds();
    (void)sss_bem_create(&s->view, &s->profile, NULL, NULL, &fresh);
    (void)sss_bem_update(fresh, 0, NULL);
    t.build = test_seconds() - start;
    sss_bem_free(fresh);
    start = test_seconds();
    (void)sss_bem_set_vertices(bem, to, s->mesh.normals);
    (void)sss_bem_update(bem, 0, NULL);
    t.edit = test_seconds() - start;
    return t;
}

static void an_edit_costs_a_fifth(void)
{   // Oracle: the clock. The whole bunny; 5 % of its vertices, a compact region, move by a smooth bump and back: at
    // most a fifth of building and linking anew. Ratios within one attempt; the best of three, for a machine that is
    // shared.
    for (int size = 0; size < 3; ++size)
    {
        scene s;
        if (scene_of_bunny(&s, 1.0, three_sizes[size], "Marble") != 0)
            SKIP("glmark2-data with its bunny is not installed");
        float *bumped = (float *)calloc(3 * s.V, sizeof *bumped);
        sss_bem *bem = bem_of(&s, NULL, NULL);
        const size_t vertex = s.V / 3;
        const double radius = radius_for(&s, vertex, 0.05);
        edit_times best = {HUGE_VAL, HUGE_VAL};
        double ratio = HUGE_VAL;
        bump(&s, s.mesh.positions, bumped, vertex, radius, 0.2 * radius);
        test_about("%g mm", three_sizes[size]);
        CHECK_BETWEEN((double)moved_vertices(&s, s.mesh.positions, bumped) / (double)s.V, 0.04, 0.051);
        CHECK_EQUAL(sss_bem_update(bem, 0, NULL), SSS_OK);
        for (int attempt = 0; attempt < 3 && ratio > 0.2; ++attempt)
        {
            const edit_times t = time_edit(&s, bem, attempt % 2 == 0 ? bumped : s.mesh.positions);
            ratio = fmin(ratio, t.edit / t.build);
            best.build = fmin(best.build, t.build);
            best.edit = fmin(best.edit, t.edit);
        }
        test_note("build and link %.3f s, edit %.3f s", best.build, best.edit);
        CHECK_BAR_BELOW(ratio, 0.2, 0.4, "moving 5 % of the vertices, over building and linking anew");
        sss_bem_free(bem);
        free(bumped);
        scene_free(&s);
    }
}

static void edits_end_where_a_fresh_build_ends(void)
{   // Oracle: unlink and update, bit for bit. A hundred random edits: regions moved, now and then the material, the
    // light, budgets small and large, renders in between; and a new object on the final mesh, within the tolerance of
    // both.
    scene s;
    if (scene_of_bunny(&s, 20.0, 30.0, "Marble") != 0)
        SKIP("glmark2-data with its bunny is not installed");
    sss_bem *bem = bem_of(&s, NULL, NULL);
    float *now = (float *)malloc(3 * s.V * sizeof *now), *next = (float *)malloc(3 * s.V * sizeof *next);
    int fine = 1, finite = 1;
    random_seed(11);
    memcpy(now, s.mesh.positions, 3 * s.V * sizeof *now);
    for (int edit = 0; edit < 100; ++edit)
    {
        const int kind = edit % 10;
        if (kind == 9)
        {
            s.profile = profile_of(two_materials[edit / 10 % 2]);
            fine &= sss_bem_set_profile(bem, &s.profile) == SSS_OK;
        }
        else if (kind == 4)
        {
            free(s.E);
            s.E = sunlight(&s.mesh, edit / 10 % 2);
            fine &= sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s.E) == SSS_OK;
        }
        else
        {
            const size_t vertex = (size_t)(random_unit() * (double)s.V);
            const double radius = mesh_extent(&s.mesh) * random_between(0.02, 0.2);
            bump(&s, now, next, vertex, radius, radius * random_between(-0.2, 0.3));
            memcpy(now, next, 3 * s.V * sizeof *now);
            fine &= sss_bem_set_vertices(bem, now, kind == 2 ? NULL : s.mesh.normals) == SSS_OK;
        }
        fine &= sss_bem_update(bem, kind == 7 ? 0 : (size_t)(1.0 + 200000.0 * random_unit()), NULL) == SSS_OK;
        if (edit % 9 == 0)
        {
            fine &= sss_bem_render(bem, s.B) == SSS_OK;
            for (size_t i = 0; i < 3 * s.V; ++i)
                finite &= isfinite(s.B[i]) != 0;
        }
    }
    CHECK(fine && finite);
    size_t pending = 1;
    CHECK_EQUAL(sss_bem_update(bem, 0, &pending), SSS_OK);
    CHECK_EQUAL(pending, 0);
    CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
    sss_bem_unlink(bem);
    CHECK_EQUAL(sss_bem_update(bem, 0, &pending), SSS_OK);
    CHECK_EQUAL(sss_bem_render(bem, s.other), SSS_OK);
    CHECK(memcmp(s.B, s.other, 3 * s.V * sizeof(float)) == 0);
    CHECK_EQUAL(sss_bem_shade(bem, s.other), SSS_OK);
    CHECK_BELOW(largest_difference(s.B, s.other, 3 * s.V), 1e-6);
    s.view.positions = now;
    CHECK_EQUAL(shade_once(&s, NULL, s.other), SSS_OK);
    CHECK_BELOW(distance_of(&s, s.B, s.other), 2e-2);
    sss_bem_free(bem);
    free(now);
    free(next);
    scene_free(&s);
}

static void pending_rows_keep_their_old_links(void)
{   // Oracle: what came before. After a move and without an update, render gives light of the new irradiance over the
    // old links; after an update that of the new shape. A light set while links pend is taken up at once.
    scene s;
    sss_bem_stats stats;
    if (scene_of_sphere(&s, 4, 5.0) != 0)
        SKIP("out of memory");
    float *moved = (float *)malloc(3 * s.V * sizeof *moved);
    sss_bem *bem = bem_of(&s, NULL, NULL), *still = bem_of(&s, NULL, NULL);
    bump(&s, s.mesh.positions, moved, 3, 3.0, 1.0);
    CHECK_EQUAL(sss_bem_update(bem, 0, NULL), SSS_OK);
    CHECK_EQUAL(sss_bem_update(still, 0, NULL), SSS_OK);
    CHECK_EQUAL(sss_bem_set_vertices(bem, moved, NULL), SSS_OK);
    CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
    CHECK_BETWEEN((double)stats.pending_rows, 1.0, (double)stats.row_count);
    for (size_t i = 0; i < 3 * s.V; ++i)
        s.E[i] = 1.0f + (float)(i % 7);
    CHECK_EQUAL(sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s.E), SSS_OK);
    CHECK_EQUAL(sss_bem_set_irradiance(still, SSS_BEM_VERTICES, s.E), SSS_OK);
    CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
    CHECK_EQUAL(sss_bem_render(still, s.other), SSS_OK);
    // Cluster means are weighted by areas, which have changed: alike, not the same.
    CHECK_BELOW(distance_of(&s, s.B, s.other), 0.3);
    CHECK_EQUAL(sss_bem_update(bem, 0, NULL), SSS_OK);
    CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
    CHECK_EQUAL(sss_bem_shade(bem, s.other), SSS_OK);
    CHECK_BELOW(largest_difference(s.B, s.other, 3 * s.V), 1e-6);
    sss_bem_free(bem);
    sss_bem_free(still);
    free(moved);
    scene_free(&s);
}

// ================================================= 4. Hierarchy =================================================

// What must hold of every node; positions as they are now.
static void check_hierarchy(const scene *s, const sss_bem *bem, const float *positions, const char *name)
{
    sss_bem_stats stats;
    memset(&stats, 0, sizeof stats);
    test_about("%s", name);
    CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
    const size_t n = stats.cluster_count, T = s->mesh.triangle_count;
    sss_bem_cluster *node = (sss_bem_cluster *)calloc(n + 1, sizeof *node);
    unsigned char *seen = (unsigned char *)calloc(T, 1);
    if (!CHECK(n >= T && n <= 2 * T && node != NULL && seen != NULL))
        return;
    int fine = 1, leaves = 1, ranges = 1;
    double outside = 0.0, area = 0.0, flat = 0.0, mean = 0.0;
    for (size_t i = 0; i < n; ++i)
        fine &= sss_bem_get_cluster(bem, i, &node[i]) == SSS_OK;
    const double unit = s->view.mm_per_unit, size = node[0].radius;
    for (size_t i = 0; i < n; ++i)
    {
        const sss_bem_cluster *c = &node[i];
        double sum = 0.0, E[3] = {0.0, 0.0, 0.0};
        ranges &= c->end > i && c->end <= n;
        keep_worst(&flat, c->planarity - 1.0);
        keep_worst(&flat, -c->planarity);
        if (c->end == i + 1)
        {
            leaves &= c->triangle < T && !seen[c->triangle];
            seen[c->triangle < T ? c->triangle : 0] = 1;
            continue;
        }
        leaves &= c->triangle == SIZE_MAX;
        size_t child = i + 1;
        for (; child < c->end && node[child].end > child; child = node[child].end)
        {
            sum += node[child].area;
            for (int k = 0; k < 3; ++k)
                E[k] += node[child].area * node[child].irradiance[k];
        }
        ranges &= child == c->end;
        keep_worst(&area, fabs(sum - c->area) / (c->area + DBL_MIN));
        for (int k = 0; k < 3 && c->area > 0.0; ++k)
            keep_worst(&mean, fabs(E[k] - c->area * c->irradiance[k]) / (c->area * 3.0));
    }
    // Every corner under a node lies in its sphere: nodes are few enough to look at all pairs on every seventh.
    for (size_t i = 0; i < n; i += (i < 50 ? 1 : 7))
        for (size_t j = i; j < node[i].end; ++j)
            for (size_t k = 0; k < 3 && node[j].end == j + 1; ++k)
            {
                const float *p = &positions[3 * s->mesh.triangles[3 * node[j].triangle + k]];
                const double d[3] = {p[0] - node[i].center[0], p[1] - node[i].center[1], p[2] - node[i].center[2]};
                keep_worst(&outside, (length3(d) - node[i].radius) / size);
            }
    mesh_data now = s->mesh;
    now.positions = (float *)malloc(3 * s->V * sizeof(float));
    if (now.positions != NULL)
    {
        memcpy(now.positions, positions, 3 * s->V * sizeof(float));
        CHECK_REL(node[0].area, mesh_area(&now) * unit * unit, 1e-5);
        free(now.positions);
    }
    size_t missing = 0;
    for (size_t t = 0; t < T; ++t)
        missing += seen[t] ? 0 : 1;
    CHECK(fine && ranges && leaves);
    CHECK_EQUAL(missing, 0);
    CHECK_EQUAL(node[0].end, n);
    CHECK_BELOW(outside, 1e-5);
    CHECK_BELOW(area, 1e-5);
    CHECK_BELOW(mean, 1e-5);
    CHECK_BELOW(flat, 1e-6);
    CHECK_BELOW((double)stats.depth, 4.0 * log2((double)T) + 2.0);
    test_note("%d nodes over %d triangles, depth %d, %.0f bytes a triangle", (int)n, (int)T, (int)stats.depth,
              (double)stats.bytes / (double)T);
    free(node);
    free(seen);
}

static void the_hierarchy_holds(void)
{   // Oracle: its definition. Face clusters over the bunny, before and after a move; a flat grid, which is all planar.
    scene s;
    if (scene_of_bunny(&s, 10.0, 50.0, "Marble") != 0)
        SKIP("glmark2-data with its bunny is not installed");
    float *moved = (float *)malloc(3 * s.V * sizeof *moved);
    sss_bem *bem = bem_of(&s, NULL, NULL);
    check_hierarchy(&s, bem, s.mesh.positions, "bunny");
    const double radius = 0.5 * mesh_extent(&s.mesh);
    bump(&s, s.mesh.positions, moved, s.V / 2, radius, radius);
    CHECK_EQUAL(sss_bem_set_vertices(bem, moved, NULL), SSS_OK);
    check_hierarchy(&s, bem, moved, "bunny, deformed");
    CHECK_EQUAL(sss_bem_shade(bem, s.B), SSS_OK);
    s.view.positions = moved;
    sss_mesh bare = s.view;
    sss_bem *fresh = NULL;
    bare.normals = NULL; // as set_vertices was told
    CHECK_EQUAL(sss_bem_create(&bare, &s.profile, NULL, NULL, &fresh), SSS_OK);
    CHECK_EQUAL(sss_bem_set_irradiance(fresh, SSS_BEM_VERTICES, s.E), SSS_OK);
    CHECK_EQUAL(sss_bem_shade(fresh, s.other), SSS_OK);
    CHECK_BELOW(distance_of(&s, s.B, s.other), 2e-2);
    sss_bem_free(fresh);
    sss_bem_free(bem);
    free(moved);
    scene_free(&s);
    mesh_data grid;
    if (mesh_grid(30, 10.0, &grid) != 0 || scene_make(&s, &grid, 1.0, "Marble") != 0)
        SKIP("out of memory");
    bem = bem_of(&s, NULL, NULL);
    check_hierarchy(&s, bem, s.mesh.positions, "grid");
    sss_bem_cluster root;
    CHECK_EQUAL(sss_bem_get_cluster(bem, 0, &root), SSS_OK);
    CHECK_REL(root.planarity, 1.0, 1e-6);
    CHECK_REL(root.normal[2], 1.0, 1e-6);
    sss_bem_free(bem);
    scene_free(&s);
}

static void subdivision_is_heeded(void)
{   // Oracle: the numbering. mesh_sphere's triangles are those of an octahedron split in four: under 8 * 4^k of them
    // each node that holds 4^j of one family has the four families of 4^(j-1) for its children.
    scene s;
    sss_bem_options options = options_of(0.0, 0.0);
    if (scene_of_sphere(&s, 4, 5.0) != 0)
        SKIP("out of memory");
    options.base_triangle_count = 8;
    sss_bem *bem = bem_of(&s, &options, NULL);
    if (!CHECK(bem != NULL))
        return;
    check_hierarchy(&s, bem, s.mesh.positions, "subdivided");
    sss_bem_cluster c, child;
    const sss_bem_stats stats = stats_of(bem);
    size_t families = 0, wrong = 0;
    for (size_t i = 0; i < stats.cluster_count; ++i)
    {   // the triangles below, as a range; 4 children each of a quarter
        size_t low = SIZE_MAX, high = 0, leaves = 0, children = 0;
        (void)sss_bem_get_cluster(bem, i, &c);
        for (size_t j = i; j < c.end; ++j)
        {
            (void)sss_bem_get_cluster(bem, j, &child);
            if (child.end != j + 1)
                continue;
            low = child.triangle < low ? child.triangle : low;
            high = child.triangle > high ? child.triangle : high;
            ++leaves;
        }
        if (leaves == 1 || leaves > 256 || (leaves != 4 && leaves != 16 && leaves != 64 && leaves != 256))
            continue;
        for (size_t j = i + 1; j < c.end; ++children)
        {
            (void)sss_bem_get_cluster(bem, j, &child);
            j = child.end;
        }
        ++families;
        wrong += low % leaves != 0 || high != low + leaves - 1 || children != 4 ? 1 : 0;
    }
    CHECK_EQUAL(wrong, 0);
    CHECK_BETWEEN((double)families, 8.0 * 85.0, HUGE_VAL); // 1 + 4 + 16 + 64 a base triangle, at least
    CHECK_EQUAL(sss_bem_shade(bem, s.B), SSS_OK);
    CHECK_EQUAL(shade_once(&s, NULL, s.other), SSS_OK);
    CHECK_BELOW(distance_of(&s, s.B, s.other), 2e-2);
    sss_bem_free(bem);
    options.base_triangle_count = 7; // 2048 is not 7 * 4^k
    bem = NULL;
    CHECK_EQUAL(sss_bem_create(&s.view, &s.profile, &options, NULL, &bem), SSS_ERROR_INVALID_ARGUMENT);
    CHECK(bem == NULL);
    scene_free(&s);
}

static void links_tile_the_surface(void)
{   // Oracle: counting. The clusters from which a vertex gathers hold every triangle exactly once.
    scene s;
    if (scene_of_bunny(&s, 10.0, 50.0, "Marble") != 0)
        SKIP("glmark2-data with its bunny is not installed");
    sss_bem *bem = bem_of(&s, NULL, NULL);
    const sss_bem_stats stats = stats_of(bem);
    size_t *links = (size_t *)calloc(stats.cluster_count, sizeof *links);
    unsigned char *covered = (unsigned char *)calloc(stats.cluster_count, 1);
    int whole = 1, counted = 1;
    double area_error = 0.0, total_links = 0.0, vertices = 0.0;
    sss_bem_cluster root;
    CHECK_EQUAL(sss_bem_get_cluster(bem, 0, &root), SSS_OK);
    for (size_t v = 0; v < s.V && links != NULL && covered != NULL; v += 97)
    {
        size_t count = 0, again = 0;
        double area = 0.0;
        sss_bem_cluster c;
        whole &= sss_bem_get_links(bem, v, NULL, 0, &again) == SSS_OK;
        whole &= sss_bem_get_links(bem, v, links, stats.cluster_count, &count) == SSS_OK;
        counted &= count == again && count > 0;
        memset(covered, 0, stats.cluster_count);
        for (size_t i = 0; i < count; ++i)
        {
            whole &= sss_bem_get_cluster(bem, links[i], &c) == SSS_OK;
            area += c.area;
            for (size_t j = links[i]; j < c.end; ++j)
            {
                sss_bem_cluster leaf;
                (void)sss_bem_get_cluster(bem, j, &leaf);
                whole &= leaf.end != j + 1 || !covered[j];
                covered[j] = 1;
            }
        }
        keep_worst(&area_error, relative_error(area, root.area));
        total_links += (double)count;
        vertices += 1.0;
    }
    CHECK(whole && counted);
    CHECK_BELOW(area_error, 1e-5);
    test_note("%.1f clusters a vertex of %d triangles", total_links / vertices, (int)s.mesh.triangle_count);
    CHECK_BETWEEN(total_links / vertices, 10.0, 0.5 * (double)s.mesh.triangle_count);
    free(links);
    free(covered);
    sss_bem_free(bem);
    scene_free(&s);
}

// ============================================ 5. The paper's own oracle ============================================

// B at the midpoint of every triangle as the paper has it (3.1): sum over all triangles of mean E times the form
// factors of both sources, which stand along the triangle's own normal. The form factors are those tested above.
static void face_sums(const scene *s, double *B)
{
    const size_t T = s->mesh.triangle_count;
    double(*corner)[9] = (double(*)[9])calloc(T, sizeof *corner);
    for (size_t t = 0; t < T && corner != NULL; ++t)
        for (size_t k = 0; k < 9; ++k)
            corner[t][k] = s->mesh.positions[3 * s->mesh.triangles[3 * t + k / 3] + k % 3] * s->view.mm_per_unit;
    for (size_t r = 0; r < T && corner != NULL; ++r)
    {
        double u[3], v[3], n[3], middle[3];
        for (size_t k = 0; k < 3; ++k)
        {
            u[k] = corner[r][3 + k] - corner[r][k];
            v[k] = corner[r][6 + k] - corner[r][k];
            middle[k] = (corner[r][k] + corner[r][3 + k] + corner[r][6 + k]) / 3.0;
        }
        cross3(u, v, n);
        const double length = length3(n);
        for (size_t c = 0; c < 3; ++c)
        {
            const sss_profile *p = &s->profile;
            double real[3], virtual_one[3], sum = 0.0;
            for (size_t k = 0; k < 3; ++k)
            {
                real[k] = middle[k] - p->z_r[c] * n[k] / length;
                virtual_one[k] = middle[k] + p->z_v[c] * n[k] / length;
            }
            for (size_t t = 0; t < T; ++t)
            {
                double E = 0.0;
                for (size_t k = 0; k < 3; ++k)
                    E += s->E[3 * s->mesh.triangles[3 * t + k] + c] / 3.0;
                sum += E * (sss_bem_form_factor_within(corner[t], 3, real, p->z_r[c], p->sigma_tr[c], 1e-6) +
                            sss_bem_form_factor_within(corner[t], 3, virtual_one, p->z_v[c], p->sigma_tr[c], 1e-6));
            }
            B[3 * r + c] = p->alpha_p[c] / (4.0 * PI) * sum;
        }
    }
    free(corner);
}

// Means of the triangles around each vertex, weighted by area or not.
static void to_vertices(const scene *s, const double *faces, int by_area, float *B)
{
    double *sum = (double *)calloc(4 * s->V, sizeof *sum);
    for (size_t t = 0; t < s->mesh.triangle_count && sum != NULL; ++t)
        for (size_t k = 0; k < 3; ++k)
        {
            double *at = &sum[4 * (size_t)s->mesh.triangles[3 * t + k]];
            const double weight = by_area ? mesh_triangle_area(&s->mesh, t) : 1.0;
            at[3] += weight;
            for (size_t c = 0; c < 3; ++c)
                at[c] += weight * faces[3 * t + c];
        }
    for (size_t i = 0; i < 3 * s->V && sum != NULL; ++i)
        B[i] = (float)(sum[4 * (i / 3) + i % 3] / fmax(sum[4 * (i / 3) + 3], DBL_MIN)); // 0 where no triangle is
    free(sum);
}

static void solid_angles_converge(void)
{   // Oracle: the sum over all pairs of triangles (above). As both thresholds fall, so does the distance from it; at
    // the finest it is rounding. Links a triangle are of the paper's order, tens, where the thresholds are ordinary.
    static const double epsilons[5] = {1.0, 0.3, 0.1, 0.03, 1e-7};
    scene s;
    if (scene_of_sphere(&s, 3, 5.0) != 0)
        SKIP("out of memory");
    double *faces = (double *)calloc(3 * s.mesh.triangle_count, sizeof *faces);
    float *plain = (float *)calloc(3 * s.V, sizeof *plain);
    double error[5] = {0.0, 0.0, 0.0, 0.0, 0.0};
    face_sums(&s, faces);
    to_vertices(&s, faces, 1, s.other);
    to_vertices(&s, faces, 0, plain);
    for (size_t k = 0; k < 5; ++k)
    {
        sss_bem_options options = options_of(0.0, -1.0);
        sss_bem_stats stats;
        memset(&stats, 0, sizeof stats);
        options.oracle = SSS_BEM_ORACLE_SOLID_ANGLE;
        options.epsilon_1 = options.epsilon_2 = epsilons[k];
        sss_bem *bem = bem_of(&s, &options, NULL);
        test_about("epsilon %g", epsilons[k]);
        CHECK_EQUAL(sss_bem_shade(bem, s.B), SSS_OK);
        CHECK_EQUAL(sss_bem_update(bem, 0, NULL), SSS_OK);
        CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
        CHECK(stats.oracle == SSS_BEM_ORACLE_SOLID_ANGLE && stats.epsilon_1 == epsilons[k]);
        error[k] = distance_of(&s, s.B, s.other);
        test_note("error %.2e (%.2e against plain means), %.1f links a triangle of %d", error[k],
                  distance_of(&s, s.B, plain), (double)stats.link_count / (double)s.mesh.triangle_count,
                  (int)s.mesh.triangle_count);
        float *again = (float *)calloc(3 * s.V, sizeof *again);
        CHECK_EQUAL(sss_bem_render(bem, again), SSS_OK);
        CHECK_BELOW(largest_difference(again, s.B, 3 * s.V), 1e-6);
        free(again);
        sss_bem_free(bem);
    }
    test_about("%s", "from epsilon 1 to 1e-7");
    CHECK_BELOW(error[4], 1e-4);
    CHECK_BELOW(error[3], 0.5 * error[0]);
    CHECK_BELOW(error[3], 0.05);
    free(plain);
    free(faces);
    scene_free(&s);
}

static void solid_angles_on_more_triangles(void)
{   // Oracle: the contribution oracle at 1e-3, which differs by averaging over triangles as well. Links a triangle as
    // in the paper's tables 3 and 4 (44 to 154); point samples (table 5) come near the form factors at this size.
    scene s;
    sss_bem_stats stats;
    memset(&stats, 0, sizeof stats);
    if (scene_of_bunny(&s, 10.0, 100.0, "Marble") != 0)
        SKIP("glmark2-data with its bunny is not installed");
    const sss_bem_options fine = options_of(1e-3, 0.0);
    sss_bem *by_form_factors = NULL;
    CHECK_EQUAL(shade_threaded(&s, &fine, s.other), SSS_OK);
    for (int points = 0; points < 2; ++points)
    {
        sss_bem_options options = options_of(1e-2, 0.0);
        options.oracle = SSS_BEM_ORACLE_SOLID_ANGLE;
        options.point_sampling = points;
        sss_bem *bem = bem_of(&s, &options, NULL);
        test_about("%s", points ? "point samples" : "form factors");
        CHECK_EQUAL(sss_bem_update(bem, 0, NULL), SSS_OK);
        CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
        CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
        const double links = (double)stats.link_count / (double)s.mesh.triangle_count;
        test_note("epsilon %g and %g: %.1f links a triangle, distance %.3f", stats.epsilon_1, stats.epsilon_2, links,
                  distance_of(&s, s.B, s.other));
        CHECK_BETWEEN(links, 5.0, 2000.0);
        CHECK_BELOW(distance_of(&s, s.B, s.other), 0.25);
        if (points)
            sss_bem_free(bem);
        else
            by_form_factors = bem;
    }
    // A mutation: the total must be there. Under constant light nothing is lost on the way up and down the hierarchy.
    for (size_t i = 0; i < 3 * s.V; ++i)
        s.E[i] = 1.0f;
    CHECK_EQUAL(sss_bem_set_irradiance(by_form_factors, SSS_BEM_VERTICES, s.E), SSS_OK);
    CHECK_EQUAL(sss_bem_render(by_form_factors, s.B), SSS_OK);
    sss_bem_free(by_form_factors);
    CHECK_EQUAL(shade_threaded(&s, &fine, s.other), SSS_OK);
    double sum = 0.0, want = 0.0;
    for (size_t i = 0; i < 3 * s.V; ++i)
    {
        sum += s.B[i];
        want += s.other[i];
    }
    test_about("%s", "constant light");
    CHECK_REL(sum, want, 0.05);
    scene_free(&s);
}

// ================================================= 6. Conduct =================================================

static void version_and_shader_text(void)
{   // Oracles: the header's first line; the declaration of the text. What it computes: tests/test_glsl.c.
    const char *text = sss_bem_glsl(SSS_BEM_GLSL_SHADE);
    CHECK_EQUAL(version_in_first_line("sss_bem.h"), SSS_BEM_VERSION);
    CHECK(text != NULL && strlen(text) > 100 && strlen(text) < 4095 && strstr(text, "#version") == NULL);
    CHECK(sss_bem_glsl((sss_bem_glsl_piece)1) == NULL && sss_bem_glsl((sss_bem_glsl_piece)-1) == NULL);
}

// A pointer that is neither NULL nor an object.
static sss_bem *untouched(void)
{
    static char somewhere;
    return (sss_bem *)(void *)&somewhere;
}

// The calls that must be refused, each with its code and without touching the output.
static void refused(const sss_mesh *mesh, const sss_profile *profile, const sss_bem_options *options,
                    const sss_hooks *hooks, sss_result want, const char *name)
{
    sss_bem *bem = untouched();
    test_about("%s", name);
    CHECK_EQUAL(sss_bem_create(mesh, profile, options, hooks, &bem), want);
    CHECK(bem == untouched());
    if (bem != untouched())
        sss_bem_free(bem);
}

static void bad_meshes_and_materials_are_refused(void)
{   // Oracle: the declarations.
    scene s;
    if (scene_of_sphere(&s, 2, 5.0) != 0)
        SKIP("out of memory");
    const sss_result invalid = SSS_ERROR_INVALID_ARGUMENT;
    sss_mesh m = s.view;
    refused(NULL, &s.profile, NULL, NULL, invalid, "no mesh");
    refused(&m, NULL, NULL, NULL, invalid, "no profile");
    CHECK_EQUAL(sss_bem_create(&m, &s.profile, NULL, NULL, NULL), invalid);
    m.positions = NULL;
    refused(&m, &s.profile, NULL, NULL, invalid, "no positions");
    m = s.view;
    m.triangles = NULL;
    refused(&m, &s.profile, NULL, NULL, invalid, "no triangles");
    m = s.view;
    m.triangle_count = 0;
    refused(&m, &s.profile, NULL, NULL, SSS_ERROR_EMPTY, "zero triangles");
    m = s.view;
    m.vertex_count = 0;
    refused(&m, &s.profile, NULL, NULL, SSS_ERROR_EMPTY, "zero vertices");
    m = s.view;
    m.vertex_count = s.V - 1;
    refused(&m, &s.profile, NULL, NULL, SSS_ERROR_INDEX, "an index out of range");
    m = s.view;
    m.vertex_count = SIZE_MAX / 4;
    refused(&m, &s.profile, NULL, NULL, SSS_ERROR_OVERFLOW, "too many vertices");
    m = s.view;
    m.triangle_count = SIZE_MAX / 4;
    refused(&m, &s.profile, NULL, NULL, SSS_ERROR_OVERFLOW, "too many triangles");
    static const double units[5] = {0.0, -1.0, (double)NAN, HUGE_VAL, 1e200};
    for (size_t k = 0; k < 5; ++k)
    {
        m = s.view;
        m.mm_per_unit = units[k];
        refused(&m, &s.profile, NULL, NULL, invalid, "mm_per_unit");
    }
    const float kept = s.mesh.positions[7];
    s.mesh.positions[7] = NAN;
    refused(&s.view, &s.profile, NULL, NULL, invalid, "a position that is no number");
    s.mesh.positions[7] = INFINITY;
    refused(&s.view, &s.profile, NULL, NULL, invalid, "an infinite position");
    s.mesh.positions[7] = kept;
    const float normal = s.mesh.normals[7];
    s.mesh.normals[7] = NAN;
    refused(&s.view, &s.profile, NULL, NULL, invalid, "a normal that is no number");
    s.mesh.normals[7] = normal;
    for (int k = 0; k < 5; ++k)
    {
        sss_profile p = s.profile;
        double *field[5] = {&p.alpha_p[1], &p.sigma_tr[0], &p.z_r[2], &p.z_v[0], &p.alpha_p[0]};
        *field[k] = k == 4 ? 1.5 : (k % 2 == 0 ? (double)NAN : -1.0);
        refused(&s.view, &p, NULL, NULL, invalid, "a bad profile");
    }
    scene_free(&s);
}

static void bad_options_are_refused(void)
{   // Oracle: the ranges beside the fields.
    scene s;
    ptrdiff_t offsets[5] = {offsetof(sss_bem_options, tolerance), offsetof(sss_bem_options, guard),
                            offsetof(sss_bem_options, epsilon_1), offsetof(sss_bem_options, epsilon_2),
                            offsetof(sss_bem_options, planarity)};
    static const double bad[5][3] = {{-1.0, 0.6, 1e-5}, {1.5, 2.0, HUGE_VAL}, {-1.0, -2.0, -HUGE_VAL},
                                     {-1.0, -2.0, -HUGE_VAL}, {-0.5, 1.5, HUGE_VAL}};
    if (scene_of_sphere(&s, 2, 5.0) != 0)
        SKIP("out of memory");
    for (size_t field = 0; field < 5; ++field)
        for (size_t k = 0; k < 4; ++k)
        {
            sss_bem_options options = options_of(0.0, 0.0);
            const double value = k < 3 ? bad[field][k] : (double)NAN;
            memcpy((char *)&options + offsets[field], &value, sizeof value);
            refused(&s.view, &s.profile, &options, NULL, SSS_ERROR_INVALID_ARGUMENT, "an option out of range");
        }
    sss_bem_options options = options_of(0.0, 0.0);
    options.oracle = (sss_bem_oracle)9;
    refused(&s.view, &s.profile, &options, NULL, SSS_ERROR_INVALID_ARGUMENT, "no such oracle");
    options.oracle = SSS_BEM_ORACLE_CONTRIBUTION;
    options.path = (sss_bem_path)9;
    refused(&s.view, &s.profile, &options, NULL, SSS_ERROR_INVALID_ARGUMENT, "no such path");
    scene_free(&s);
}

static void bad_calls_are_refused(void)
{   // Oracle: the declarations. Nothing is touched, and the object works as before.
    scene s;
    if (scene_of_sphere(&s, 3, 5.0) != 0)
        SKIP("out of memory");
    const sss_result invalid = SSS_ERROR_INVALID_ARGUMENT;
    const size_t bytes = 3 * s.V * sizeof(float);
    sss_bem *bem = bem_of(&s, NULL, NULL);
    sss_bem_stats stats = stats_of(bem);
    CHECK_EQUAL(sss_bem_shade(bem, s.other), SSS_OK);
    memset(s.B, 0x7F, bytes);
    float *bad = (float *)malloc(bytes);
    memcpy(bad, s.E, bytes);
    bad[5] = NAN;
    CHECK_EQUAL(sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, bad), invalid);
    CHECK_EQUAL(sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, NULL), invalid);
    CHECK_EQUAL(sss_bem_set_irradiance(bem, (sss_bem_elements)5, s.E), invalid);
    CHECK_EQUAL(sss_bem_set_irradiance(NULL, SSS_BEM_VERTICES, s.E), invalid);
    memcpy(bad, s.mesh.positions, bytes);
    bad[8] = INFINITY;
    CHECK_EQUAL(sss_bem_set_vertices(bem, bad, NULL), invalid);
    CHECK_EQUAL(sss_bem_set_vertices(bem, NULL, NULL), invalid);
    CHECK_EQUAL(sss_bem_set_vertices(bem, s.mesh.positions, bad), invalid);
    CHECK_EQUAL(sss_bem_set_vertices(NULL, s.mesh.positions, NULL), invalid);
    sss_profile p = s.profile;
    p.z_v[1] = (double)NAN;
    CHECK_EQUAL(sss_bem_set_profile(bem, &p), invalid);
    CHECK_EQUAL(sss_bem_set_profile(bem, NULL), invalid);
    CHECK_EQUAL(sss_bem_set_profile(NULL, &s.profile), invalid);
    CHECK_EQUAL(sss_bem_shade(bem, NULL), invalid);
    CHECK_EQUAL(sss_bem_shade(NULL, s.B), invalid);
    CHECK_EQUAL(sss_bem_shade_rows(bem, 2, 1, s.B), invalid);
    CHECK_EQUAL(sss_bem_shade_rows(bem, 0, stats.row_count + 1, s.B), invalid);
    CHECK_EQUAL(sss_bem_shade_rows(bem, 0, 1, NULL), invalid);
    CHECK_EQUAL(sss_bem_shade_rows(bem, 1, 1, s.B), SSS_OK);
    CHECK_EQUAL(sss_bem_gather(bem, NULL, s.mesh.normals, 1, s.B), invalid);
    CHECK_EQUAL(sss_bem_gather(bem, s.mesh.positions, NULL, 1, s.B), invalid);
    CHECK_EQUAL(sss_bem_gather(bem, bad, s.mesh.normals, 3, s.B), invalid);
    CHECK_EQUAL(sss_bem_gather(bem, s.mesh.positions, s.mesh.normals, 1, NULL), invalid);
    CHECK_EQUAL(sss_bem_update(NULL, 0, NULL), invalid);
    CHECK_EQUAL(sss_bem_render(bem, NULL), invalid);
    CHECK_EQUAL(sss_bem_render(NULL, s.B), invalid);
    CHECK_EQUAL(sss_bem_predict_error(NULL, 0, NULL), invalid);
    CHECK_EQUAL(sss_bem_get_stats(bem, NULL), invalid);
    CHECK_EQUAL(sss_bem_get_stats(NULL, &stats), invalid);
    sss_bem_cluster cluster;
    size_t count = 7;
    CHECK_EQUAL(sss_bem_get_cluster(bem, stats.cluster_count, &cluster), invalid);
    CHECK_EQUAL(sss_bem_get_cluster(bem, 0, NULL), invalid);
    CHECK_EQUAL(sss_bem_get_links(bem, s.V, NULL, 0, &count), invalid);
    CHECK_EQUAL(sss_bem_get_links(bem, 0, NULL, 0, NULL), invalid);
    CHECK_EQUAL(count, 7);
    sss_bem_free(NULL);
    sss_bem_unlink(NULL);
    memset(bad, 0x7F, bytes);
    CHECK(memcmp(bad, s.B, bytes) == 0);
    CHECK_EQUAL(sss_bem_shade(bem, s.B), SSS_OK);
    CHECK(memcmp(s.B, s.other, bytes) == 0);
    free(bad);
    sss_bem_free(bem);
    scene_free(&s);
}

// ---- Allocation that fails, and cancelling ----

// From the mesh through every function that may allocate; stops at the first error. A call that failed is made once
// more, and must then do.
static sss_result whole_way(const scene *s, const sss_bem_options *options, const sss_hooks *hooks, float *B,
                            sss_bem_stats *stats)
{
    sss_mesh bare = s->view;
    sss_bem *bem = NULL;
    double error;
    bare.normals = NULL;
    sss_result result = sss_bem_create(&bare, &s->profile, options, hooks, &bem);
    if (result != SSS_OK)
        return bem == NULL ? result : SSS_ERROR_BAD_DATA; // an output was touched
    result = sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s->E);
    if (result == SSS_OK)
        result = sss_bem_shade(bem, B);
    if (result == SSS_OK)
        result = sss_bem_update(bem, 3000, NULL);
    if (result == SSS_OK)
        result = sss_bem_update(bem, 0, NULL);
    if (result == SSS_OK)
        result = sss_bem_set_vertices(bem, s->mesh.positions, s->mesh.normals);
    if (result == SSS_OK)
        result = sss_bem_update(bem, 0, NULL);
    if (result == SSS_OK && (options == NULL || options->oracle == SSS_BEM_ORACLE_CONTRIBUTION))
        result = sss_bem_predict_error(bem, 20, &error);
    if (result == SSS_OK && (options == NULL || options->oracle == SSS_BEM_ORACLE_CONTRIBUTION))
        result = sss_bem_gather(bem, s->mesh.positions, s->mesh.normals, 5, B);
    if (result == SSS_OK)
        result = sss_bem_get_stats(bem, stats);
    if (result == SSS_OK)
        result = sss_bem_render(bem, B);
    sss_bem_free(bem);
    return result;
}

static void every_allocation_may_fail(void)
{   // Oracle: a ledger under hooks.allocate. Call k gives NULL, for every k: out of memory, nothing leaks, and the same
    // call then works, with the bits it gives without hooks. An update with a budget may do without room for a row that
    // the budget does not reach: the same bits then, and only rarely. Both oracles.
    scene s;
    if (scene_of_sphere(&s, 2, 5.0) != 0)
        SKIP("out of memory");
    const size_t bytes = 3 * s.V * sizeof(float);
    for (int oracle = 0; oracle < 2; ++oracle)
    {
        sss_bem_options options = options_of(0.0, 0.0);
        sss_bem_stats stats;
        ledger l;
        sss_hooks hooks;
        int k = 0, said_so = 1, clean = 1, spared = 0;
        memset(&stats, 0, sizeof stats);
        options.oracle = (sss_bem_oracle)oracle;
        test_about(oracle == 0 ? "contribution" : "solid angle");
        CHECK_EQUAL(whole_way(&s, &options, NULL, s.other, &stats), SSS_OK);
        for (; k < 20000; ++k)
        {
            hooks = ledger_hooks(&l, 1);
            l.fail_at = k;
            const sss_result result = whole_way(&s, &options, &hooks, s.B, &stats);
            clean &= l.live == 0;
            if (result == SSS_OK && l.calls <= k)
                break; // no call k any more
            if (result == SSS_OK)
                ++spared;
            said_so &= result == SSS_ERROR_OUT_OF_MEMORY ||
                       (result == SSS_OK && memcmp(s.B, s.other, bytes) == 0);
        }
        CHECK_BETWEEN((double)k, 3.0, 19999.0);
        CHECK_BELOW((double)spared, 0.2 * (double)k);
        CHECK(said_so && clean);
        CHECK(memcmp(s.B, s.other, bytes) == 0);
        CHECK(l.fractions_fine && l.progress_calls > 0);
        CHECK_BETWEEN((double)stats.bytes / (double)l.peak, 0.2, 1.0);
    }
    ledger l;
    sss_hooks hooks = ledger_hooks(&l, 1);
    hooks.release = NULL;
    refused(&s.view, &s.profile, NULL, &hooks, SSS_ERROR_INVALID_ARGUMENT, "allocate without release");
    scene_free(&s);
}

static void an_update_that_ran_out_of_memory_goes_on(void)
{   // Oracle: the same without failure. Each call of update loses its k-th allocation; what was linked is kept, and in
    // the end render gives the same bits; shade and render leave their output alone when they fail.
    scene s;
    ledger l;
    sss_hooks hooks = ledger_hooks(&l, 1);
    size_t pending = 1;
    int failures = 0, codes = 1;
    if (scene_of_sphere(&s, 3, 5.0) != 0)
        SKIP("out of memory");
    sss_bem *plain = bem_of(&s, NULL, NULL), *bem = bem_of(&s, NULL, &hooks);
    CHECK_EQUAL(sss_bem_update(plain, 0, NULL), SSS_OK);
    CHECK_EQUAL(sss_bem_render(plain, s.other), SSS_OK);
    for (int k = 0; k < 3000 && pending > 0; ++k)
    {
        l.fail_at = l.calls + k % 5;
        const sss_result result = sss_bem_update(bem, 0, &pending);
        failures += result != SSS_OK ? 1 : 0;
        codes &= result == SSS_OK || result == SSS_ERROR_OUT_OF_MEMORY;
    }
    l.fail_at = -1;
    CHECK(codes && failures > 0);
    CHECK_EQUAL(sss_bem_update(bem, 0, &pending), SSS_OK);
    CHECK_EQUAL(pending, 0);
    CHECK_EQUAL(sss_bem_render(bem, s.B), SSS_OK);
    CHECK(memcmp(s.B, s.other, 3 * s.V * sizeof(float)) == 0);
    sss_bem_free(plain);
    sss_bem_free(bem);
    CHECK_EQUAL(l.live, 0);
    scene_free(&s);
}

static void progress_may_cancel(void)
{   // Oracle: a ledger under hooks.progress. Cancelled at any call: the code says so, the output is untouched, and the
    // same call then works.
    scene s;
    if (scene_of_sphere(&s, 4, 5.0) != 0)
        SKIP("out of memory");
    const size_t bytes = 3 * s.V * sizeof(float);
    int cancelled = 0, alone = 1, works = 1;
    ledger l;
    sss_hooks hooks = ledger_hooks(&l, 1);
    sss_bem *bem = bem_of(&s, NULL, &hooks);
    CHECK_EQUAL(sss_bem_shade(bem, s.other), SSS_OK);
    for (int k = 0; k < 12; ++k)
        for (int mode = 0; mode < 2; ++mode)
        {
            l.cancel_at = l.progress_calls + k;
            memset(s.B, 0x7F, bytes);
            const sss_result result = mode == 0 ? sss_bem_shade(bem, s.B) : sss_bem_render(bem, s.B);
            if (result == SSS_ERROR_CANCELLED)
            {
                ++cancelled;
                for (size_t i = 0; i < bytes; ++i)
                    alone &= ((unsigned char *)s.B)[i] == 0x7F;
            }
            l.cancel_at = -1;
            works &= (mode == 0 ? sss_bem_shade(bem, s.B) : sss_bem_render(bem, s.B)) == SSS_OK &&
                     memcmp(s.B, s.other, bytes) == 0;
        }
    CHECK(cancelled > 0);
    CHECK(alone && works);
    CHECK(l.fractions_fine);
    sss_bem_free(bem);
    CHECK_EQUAL(l.live, 0);
    scene_free(&s);
}

// ---- Meshes that nobody would draw ----

// No number but finite ones, and none above what the guard allows: a surface lit by E_max gives at most alpha'/(4 pi)
// times 3 pi/guard for each source and each sheet of surface near it.
static void check_no_spike(const scene *s, double sheets, const char *name)
{
    sss_bem *bem = bem_of(s, NULL, NULL);
    double E_max = 0.0, B_max = 0.0;
    int finite = 1;
    test_about("%s", name);
    if (!CHECK(bem != NULL))
        return;
    for (int mode = 0; mode < 2; ++mode)
    {
        if (mode == 1)
            CHECK_EQUAL(sss_bem_update(bem, 0, NULL), SSS_OK);
        CHECK_EQUAL(mode == 0 ? sss_bem_shade(bem, s->B) : sss_bem_render(bem, s->B), SSS_OK);
        for (size_t i = 0; i < 3 * s->V; ++i)
        {
            finite &= isfinite(s->B[i]) && s->B[i] >= 0.0f;
            E_max = fmax(E_max, s->E[i]);
            B_max = fmax(B_max, s->B[i]);
        }
    }
    CHECK(finite);
    CHECK_BELOW(B_max, sheets * 2.0 * 3.0 * PI / DEFAULT_GUARD / (4.0 * PI) * E_max);
    test_note("largest B %.3g under E %.3g", B_max, E_max);
    sss_bem_free(bem);
}

static int mesh_of(mesh_data *m, size_t vertices, size_t triangles)
{
    m->vertex_count = vertices;
    m->triangle_count = triangles;
    m->positions = (float *)calloc(3 * vertices, sizeof(float));
    m->normals = (float *)calloc(3 * vertices, sizeof(float));
    m->triangles = (uint32_t *)calloc(3 * triangles, sizeof(uint32_t));
    return m->positions == NULL || m->normals == NULL || m->triangles == NULL;
}

static void hostile_meshes(void)
{   // Oracle: finite and bounded. One triangle; nothing but degenerate ones; the same triangle a thousand times; zero
    // normals; a fan of needles around one vertex that 300 triangles share; a strip of 2e5 needles.
    mesh_data m;
    scene s;
    if (mesh_of(&m, 3, 1) != 0)
        SKIP("out of memory");
    m.positions[3] = m.positions[7] = 1.0f;
    m.normals[2] = m.normals[5] = m.normals[8] = 1.0f;
    m.triangles[1] = 1;
    m.triangles[2] = 2;
    CHECK_EQUAL(scene_make(&s, &m, 1.0, "Marble"), 0);
    check_no_spike(&s, 1.0, "one triangle");
    small_case(&s, 1e-2, "one triangle");
    float single[9];
    memcpy(single, s.B, sizeof single);
    scene_free(&s);
    CHECK_EQUAL(mesh_of(&m, 20, 50), 0);
    for (size_t i = 0; i < 150; ++i)
        m.triangles[i] = (uint32_t)(i / 6 % 10);
    for (size_t i = 0; i < 60; ++i)
        m.positions[i] = (float)(i % 7);
    CHECK_EQUAL(scene_make(&s, &m, 1.0, "Marble"), 0); // normals are zero, vertices 10 .. 19 in nothing
    check_no_spike(&s, 1.0, "degenerate triangles, zero normals");
    scene_free(&s);
    CHECK_EQUAL(mesh_of(&m, 3, 1000), 0);
    for (size_t i = 0; i < 3000; ++i)
        m.triangles[i] = (uint32_t)(i % 3);
    m.positions[3] = m.positions[7] = 1.0f;
    m.normals[2] = m.normals[5] = m.normals[8] = 1.0f;
    CHECK_EQUAL(scene_make(&s, &m, 1.0, "Marble"), 0);
    check_no_spike(&s, 1000.0, "one triangle a thousand times");
    CHECK_EQUAL(shade_once(&s, NULL, s.B), SSS_OK);
    for (size_t i = 0; i < 9; ++i)
        CHECK_REL(s.B[i], 1000.0 * (double)single[i], 1e-2);
    scene_free(&s);
    CHECK_EQUAL(mesh_of(&m, 302, 300), 0);
    for (size_t t = 0; t < 300; ++t)
    {
        const double angle = 2.0 * PI * (double)t / 300.0;
        m.positions[3 * t] = (float)(100.0 * cos(angle));
        m.positions[3 * t + 1] = (float)(100.0 * sin(angle));
        m.triangles[3 * t] = 300;
        m.triangles[3 * t + 1] = (uint32_t)t;
        m.triangles[3 * t + 2] = (uint32_t)((t + 1) % 300);
    }
    for (size_t v = 0; v < 302; ++v)
        m.normals[3 * v + 2] = 1.0f;
    CHECK_EQUAL(scene_make(&s, &m, 1.0, "Marble"), 0);
    check_no_spike(&s, 1.0, "fan of needles");
    small_case(&s, 1e-2, "fan of needles");
    scene_free(&s);
}

// Seconds of shading a strip of 2n needles of aspect 1e3, a mean free path wide, n/2000 mm long.
static double time_strip_of_needles(uint32_t n)
{
    mesh_data m;
    scene s;
    if (!CHECK_EQUAL(mesh_of(&m, 2 * (size_t)n + 2, 2 * (size_t)n), 0))
        return HUGE_VAL;
    for (size_t i = 0; i <= n; ++i)
        for (size_t side = 0; side < 2; ++side)
        {
            m.positions[3 * (2 * i + side)] = (float)(5e-4 * (double)i);
            m.positions[3 * (2 * i + side) + 1] = 0.5f * (float)side;
            m.normals[3 * (2 * i + side) + 2] = 1.0f;
        }
    for (uint32_t i = 0; i < n; ++i)
    {
        const uint32_t corners[6] = {2 * i, 2 * i + 2, 2 * i + 1, 2 * i + 1, 2 * i + 2, 2 * i + 3};
        memcpy(&m.triangles[6 * (size_t)i], corners, sizeof corners);
    }
    CHECK_EQUAL(scene_make(&s, &m, 1.0, "Marble"), 0);
    sss_bem *bem = bem_of(&s, NULL, NULL);
    const double start = test_seconds();
    CHECK_EQUAL(sss_bem_shade(bem, s.B), SSS_OK);
    const double seconds = test_seconds() - start;
    int finite = 1;
    for (size_t i = 0; i < 3 * s.V; ++i)
        finite &= isfinite(s.B[i]) && s.B[i] >= 0.0f && s.B[i] < 10.0f;
    CHECK(finite);
    sss_bem_free(bem);
    scene_free(&s);
    return seconds;
}

static void a_strip_of_needles(void)
{   // Oracle: finite and bounded; and the clock. A strip four times as long, both far longer than a mean free path,
    // takes about four times as long: sixteen times would mean that everything is near everything.
    const double part = time_strip_of_needles(1500), whole = time_strip_of_needles(6000);
    test_note("3,000 needles %.2f s, 12,000 needles %.2f s", part, whole);
    CHECK_BETWEEN(whole / part, 1.5, 10.0);
}

static void no_spikes_on_thin_and_folded_things(void)
{   // Oracle: the bound that the guard gives, at two sheets of surface. Bunnies smaller than a mean free path and
    // larger, where without the guard single vertices are lit thousands of times too brightly.
    double open = 0.0;
    for (int size = 0; size < 3; ++size)
    {
        scene s;
        char name[64];
        if (scene_of_bunny(&s, 5.0, size == 0 ? 2.0 : 10.0 * (double)size, "Skimmilk") != 0)
            SKIP("glmark2-data with its bunny is not installed");
        (void)snprintf(name, sizeof name, "bunny of %g mm", size == 0 ? 2.0 : 10.0 * (double)size);
        check_no_spike(&s, 2.0, name);
        const sss_bem_options options = options_of(0.0, -1.0);
        CHECK_EQUAL(shade_once(&s, &options, s.B), SSS_OK);
        for (size_t i = 0; i < 3 * s.V; ++i)
            open = fmax(open, s.B[i]);
        scene_free(&s);
    }
    test_about("%s", "without the guard");
    CHECK_BETWEEN(open, 30.0, HUGE_VAL); // the cause is real: the test above is not vacuous
}

static void meshes_as_they_come(void)
{   // Oracle: the converged reference, which knows no special cases. Unreferenced vertices, duplicate triangles, a
    // vertex that three sheets share, triangles on two points; normals from the triangles where none are given.
    scene s;
    mesh_data sphere, m;
    if (mesh_sphere(3, 5.0, &sphere) != 0)
        SKIP("out of memory");
    const size_t V = sphere.vertex_count, T = sphere.triangle_count;
    CHECK_EQUAL(mesh_of(&m, V + 3, T + 6), 0);
    memcpy(m.positions, sphere.positions, 3 * V * sizeof(float));
    memcpy(m.normals, sphere.normals, 3 * V * sizeof(float));
    memcpy(m.triangles, sphere.triangles, 3 * T * sizeof(uint32_t));
    memcpy(&m.triangles[3 * T], sphere.triangles, 6 * sizeof(uint32_t));
    const uint32_t more[12] = {0, (uint32_t)V, 1, 0, 2, (uint32_t)V, 5, 5, 9, 3, 3, 3};
    memcpy(&m.triangles[3 * T + 6], more, sizeof more);
    m.positions[3 * V] = 9.0f;
    m.positions[3 * V + 3] = 1e6f; // in nothing
    for (size_t v = V; v < V + 3; ++v)
        m.normals[3 * v] = 1.0f;
    CHECK_EQUAL(scene_make(&s, &m, 1.0, "Marble"), 0);
    small_case(&s, 1e-2, "untidy");
    small_case(&s, 1e-3, "untidy at 1e-3");
    scene_free(&s);
    CHECK_EQUAL(scene_make(&s, &sphere, 1.0, "Marble"), 0);
    CHECK_EQUAL(shade_once(&s, NULL, s.other), SSS_OK);
    s.view.normals = NULL;
    CHECK_EQUAL(shade_once(&s, NULL, s.B), SSS_OK);
    test_about("%s", "normals from triangles");
    CHECK_BELOW(distance_of(&s, s.B, s.other), 2e-2);
    scene_free(&s);
}

// ================================================= 7. Speed =================================================

enum { SPEED_ROWS = 48 };

// How many times as fast as the direct gather at 1 % and at 0.1 %; how many times a relight is as fast as on the fly.
typedef struct speeds
{
    double percent, per_mille, relight;
} speeds;

static double seconds_of_frame(const scene *s, sss_bem *bem, int render, int with_light)
{
    const double start = test_seconds();
    if (with_light)
        (void)sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s->E);
    (void)(render ? sss_bem_render(bem, s->B) : sss_bem_shade(bem, s->B));
    return test_seconds() - start;
}

// The same on the fly, from every eighth row.
static double seconds_by_rows(const scene *s, const sss_bem *bem)
{
    sss_bem_stats stats;
    size_t done = 0;
    memset(&stats, 0, sizeof stats);
    (void)sss_bem_get_stats(bem, &stats);
    const double start = test_seconds();
    for (size_t row = 0; row < stats.row_count; row += 8, ++done)
        (void)sss_bem_shade_rows(bem, row, row + 1, s->B);
    return (test_seconds() - start) * (double)stats.row_count / (double)done;
}

static speeds measure_speeds(const scene *s, sss_bem *percent, const sss_bem *per_mille,
                             const sss_dipole_gather *direct, const float *receivers)
{
    const sss_dipole_receivers view = {receivers, receivers + 3 * SPEED_ROWS, SPEED_ROWS};
    float B[3 * SPEED_ROWS];
    speeds v;
    const double start = test_seconds();
    (void)sss_dipole_gather_rows(direct, &view, 0, SPEED_ROWS, B);
    const double whole = (test_seconds() - start) / SPEED_ROWS * (double)s->V;
    const double fly = seconds_of_frame(s, percent, 0, 1), render = seconds_of_frame(s, percent, 1, 1);
    v.percent = whole / seconds_of_frame(s, percent, 0, 0);
    v.per_mille = whole / seconds_by_rows(s, per_mille);
    v.relight = fly / render;
    return v;
}

static void speeds_of_a_bunny(int material, int size)
{
    scene s;
    float receivers[6 * SPEED_ROWS];
    sss_dipole_gather *direct = NULL;
    sss_dipole_gather_options placed;
    const sss_bem_options percent = options_of(1e-2, 0.0), per_mille = options_of(1e-3, 0.0);
    if (scene_of_bunny(&s, 1.0, three_sizes[size], two_materials[material]) != 0)
        SKIP("glmark2-data with its bunny is not installed");
    size_t *index = mesh_vertices_by_area(&s.mesh, SPEED_ROWS);
    for (size_t i = 0; i < 3 * SPEED_ROWS; ++i)
    {
        receivers[i] = s.mesh.positions[3 * index[i / 3] + i % 3];
        receivers[3 * SPEED_ROWS + i] = s.mesh.normals[3 * index[i / 3] + i % 3];
    }
    memset(&placed, 0, sizeof placed);
    placed.geometry = SSS_DIPOLE_PLACED;
    CHECK_EQUAL(sss_dipole_gather_create(&s.view, &s.profile, &placed, NULL, &direct), SSS_OK);
    CHECK_EQUAL(sss_dipole_gather_set_irradiance(direct, SSS_DIPOLE_VERTICES, s.E), SSS_OK);
    sss_bem *fast = bem_of(&s, &percent, NULL), *fine = bem_of(&s, &per_mille, NULL);
    CHECK_EQUAL(sss_bem_update(fast, 0, NULL), SSS_OK);
    speeds best = {0.0, 0.0, 0.0};
    for (int attempt = 0; attempt < 3; ++attempt)
    {
        const speeds v = measure_speeds(&s, fast, fine, direct, receivers);
        best.percent = fmax(best.percent, v.percent);
        best.per_mille = fmax(best.per_mille, v.per_mille);
        best.relight = fmax(best.relight, v.relight);
    }
    test_about("%s, %g mm", two_materials[material], three_sizes[size]);
    CHECK_BAR_ABOVE(best.percent, 100.0, 30.0, "times as fast as the direct gather at 1 %");
    CHECK_BAR_ABOVE(best.per_mille, 30.0, 5.0, "times as fast as the direct gather at 0.1 %");
    CHECK_BAR_ABOVE(best.relight, 3.0, 1.2, "times as fast as on the fly, a new light over stored links");
    sss_bem_free(fast);
    sss_bem_free(fine);
    sss_dipole_gather_free(direct);
    free(index);
    scene_free(&s);
}

static void shading_is_fast(void)
{   // Oracle: the clock, on one thread, against sss_dipole_gather_rows (placed sources, default tolerance) on 48 rows,
    // for all vertices of the whole bunny. At 0.1 % every eighth row stands for all. Each ratio is taken within one
    // attempt, one after the other; the best of three, for a machine that is shared.
    for (int m = 0; m < 2; ++m)
        for (int size = 0; size < 3; ++size)
            speeds_of_a_bunny(m, size);
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
        TEST(the_reference_is_as_good_as_is_said_here),
        TEST(bunny_agrees_with_the_reference),
        TEST(shadow_edges_and_no_guard),
        TEST(the_guards_cost),
        TEST(errors_are_predicted),
        TEST(flat_squares),
        TEST(spheres),
        TEST(special_media),
        TEST(mean_free_paths_of_every_length),
        TEST(units_change_nothing),
        TEST(radiosity_is_linear),
        TEST(every_path_agrees),
        TEST(splitting_changes_no_bit),
        TEST(three_modes_agree),
        TEST_TIMED(an_edit_costs_a_fifth),
        TEST(edits_end_where_a_fresh_build_ends),
        TEST(pending_rows_keep_their_old_links),
        TEST(the_hierarchy_holds),
        TEST(subdivision_is_heeded),
        TEST(links_tile_the_surface),
        TEST(solid_angles_converge),
        TEST(solid_angles_on_more_triangles),
        TEST(version_and_shader_text),
        TEST(bad_meshes_and_materials_are_refused),
        TEST(bad_options_are_refused),
        TEST(bad_calls_are_refused),
        TEST(every_allocation_may_fail),
        TEST(an_update_that_ran_out_of_memory_goes_on),
        TEST(progress_may_cancel),
        TEST(hostile_meshes),
        TEST_TIMED(a_strip_of_needles),
        TEST(no_spikes_on_thin_and_folded_things),
        TEST(meshes_as_they_come),
        TEST_TIMED(shading_is_fast),
    };
    const int status = test_main(argc, argv, "sss_bem.h", tests, COUNT(tests));
    free_bunnies();
    return status;
}
