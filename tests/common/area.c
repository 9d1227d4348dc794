// The area integrals of area.h.

#include "area.h"

#include "quadrature.h"

#include <math.h>

// With pieces no larger than their distance from the source, a Gauss rule of n points converges at least as
// (2 + sqrt 5)^(-2n), and exp(-sigma s) is tame over a piece of at most 4/sigma: 16 points leave 1e-19.
#define POINTS 16
#define DECAY 4.0L
#define MAX_DEPTH 400     // a piece this small would lie on the source
#define NEGLIGIBLE 1e-22L // of the sum so far: 10^4 such pieces leave 1e-18
#define MAX_CORNERS 64

typedef struct point
{
    long double x, y;
    long double weight; // carried along linearly: 1, or a barycentric coordinate
} point;

typedef struct task
{
    long double H2, sigma;
    long double node[POINTS], gauss[POINTS]; // on [0, 1]
    long double total;                       // of the kernel alone, for pruning
    long double weighted;                    // of the kernel times the weight
} task;

static long double kernel(const task *t, long double r2)
{
    const long double s2 = t->H2 + r2, s = sqrtl(s2);
    return (1.0L + t->sigma * s) * expl(-t->sigma * s) / (s2 * s);
}

static long double cross2(const point *a, const point *b, const point *c)
{
    return (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
}

static long double length2(const point *a, const point *b)
{
    return (a->x - b->x) * (a->x - b->x) + (a->y - b->y) * (a->y - b->y);
}

// Squared distance of the origin from a segment, from a triangle.
static long double segment_distance2(const point *a, const point *b)
{
    const long double x = b->x - a->x, y = b->y - a->y, l2 = x * x + y * y;
    const long double u = l2 > 0.0L ? fminl(1.0L, fmaxl(0.0L, -(a->x * x + a->y * y) / l2)) : 0.0L;
    const long double px = a->x + u * x, py = a->y + u * y;
    return px * px + py * py;
}

static long double triangle_distance2(const point p[3])
{
    const point origin = {0.0L, 0.0L, 0.0L};
    const long double s0 = cross2(&p[0], &p[1], &origin), s1 = cross2(&p[1], &p[2], &origin),
                      s2 = cross2(&p[2], &p[0], &origin);
    if ((s0 >= 0.0L && s1 >= 0.0L && s2 >= 0.0L) || (s0 <= 0.0L && s1 <= 0.0L && s2 <= 0.0L))
        return 0.0L;
    return fminl(segment_distance2(&p[0], &p[1]), fminl(segment_distance2(&p[1], &p[2]),
                                                        segment_distance2(&p[2], &p[0])));
}

// int f over the triangle = 2 A int int f(a + u ((b - a) + v (c - b))) u du dv.
static void integrate_piece(task *t, const point p[3], long double twice_area)
{
    long double total = 0.0L, weighted = 0.0L;
    for (int i = 0; i < POINTS; ++i)
        for (int j = 0; j < POINTS; ++j)
        {
            const long double u = t->node[i], v = t->node[j];
            const long double x = p[0].x + u * ((p[1].x - p[0].x) + v * (p[2].x - p[1].x));
            const long double y = p[0].y + u * ((p[1].y - p[0].y) + v * (p[2].y - p[1].y));
            const long double w = p[0].weight * (1.0L - u) + u * (p[1].weight * (1.0L - v) + v * p[2].weight);
            const long double f = t->gauss[i] * t->gauss[j] * u * kernel(t, x * x + y * y);
            total += f;
            weighted += w * f;
        }
    t->total += twice_area * total;
    t->weighted += twice_area * weighted;
}

static void integrate(task *t, const point p[3], int depth)
{
    const long double twice_area = fabsl(cross2(&p[0], &p[1], &p[2]));
    const long double d2 = triangle_distance2(p);
    if (!(twice_area > 0.0L) || twice_area * kernel(t, d2) < NEGLIGIBLE * t->total)
        return;
    int a = 0;
    for (int k = 1; k < 3; ++k)
        if (length2(&p[k], &p[(k + 1) % 3]) > length2(&p[a], &p[(a + 1) % 3]))
            a = k;
    const int b = (a + 1) % 3;
    const long double h2 = length2(&p[a], &p[b]);
    if (depth >= MAX_DEPTH || (h2 <= d2 + t->H2 && h2 * t->sigma * t->sigma <= DECAY * DECAY))
    {
        integrate_piece(t, p, twice_area);
        return;
    }
    const point middle = {0.5L * (p[a].x + p[b].x), 0.5L * (p[a].y + p[b].y), 0.5L * (p[a].weight + p[b].weight)};
    point half[2][3] = {{p[0], p[1], p[2]}, {p[0], p[1], p[2]}};
    half[0][b] = middle;
    half[1][a] = middle;
    const int near_half = triangle_distance2(half[0]) <= triangle_distance2(half[1]) ? 0 : 1;
    integrate(t, half[near_half], depth + 1); // the near one first, so that what is negligible is known to be
    integrate(t, half[1 - near_half], depth + 1);
}

static void prepare(task *t, long double H, double sigma)
{
    long double nodes[POINTS], weights[POINTS];
    gauss_legendre(POINTS, nodes, weights);
    for (int i = 0; i < POINTS; ++i)
    {
        t->node[i] = 0.5L * (1.0L + nodes[i]);
        t->gauss[i] = 0.5L * weights[i];
    }
    t->H2 = H * H;
    t->sigma = sigma;
    t->total = 0.0L;
    t->weighted = 0.0L;
}

// ---- From space to the plane ----

static void cross3(const long double a[3], const long double b[3], long double out[3])
{
    for (int k = 0; k < 3; ++k)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static long double dot3(const long double a[3], const long double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Corners relative to the source's projection, counter-clockwise, weight 1. Returns the height; negative: no area.
// Differences of nearby doubles are exact, so that corners with few bits give an exact height even near the plane.
static long double to_plane(const double *corners, size_t n, const double source[3], point *out)
{
    long double from[MAX_CORNERS][3], normal[3] = {0.0L, 0.0L, 0.0L}, u[3], v[3], part[3], longest = 0.0L;
    size_t nearest = 0;
    for (size_t i = 0; i < n; ++i)
    {
        for (int k = 0; k < 3; ++k)
            from[i][k] = (long double)corners[3 * i + (size_t)k] - source[k];
        if (dot3(from[i], from[i]) < dot3(from[nearest], from[nearest]))
            nearest = i;
    }
    for (size_t i = 1; i + 1 < n; ++i)
    {   // twice the area's vector
        for (int k = 0; k < 3; ++k)
        {
            u[k] = (long double)corners[3 * i + (size_t)k] - corners[k];
            v[k] = (long double)corners[3 * i + 3 + (size_t)k] - corners[k];
        }
        cross3(u, v, part);
        for (int k = 0; k < 3; ++k)
            normal[k] += part[k];
    }
    const long double size = sqrtl(dot3(normal, normal));
    if (!(size > 0.0L))
        return -1.0L;
    for (size_t i = 0; i < n; ++i)
    {   // the first axis: along the longest edge
        for (int k = 0; k < 3; ++k)
            part[k] = (long double)corners[3 * ((i + 1) % n) + (size_t)k] - corners[3 * i + (size_t)k];
        for (int k = 0; k < 3 && dot3(part, part) > longest; ++k)
            u[k] = part[k];
        longest = fmaxl(longest, dot3(part, part));
    }
    cross3(normal, u, v);
    const long double u_length = sqrtl(dot3(u, u)), v_length = sqrtl(dot3(v, v));
    for (size_t i = 0; i < n; ++i)
    {
        out[i].x = dot3(from[i], u) / u_length;
        out[i].y = dot3(from[i], v) / v_length;
        out[i].weight = 1.0L;
    }
    return fabsl(dot3(from[nearest], normal)) / size;
}

// Whether corner i of a counter-clockwise polygon can be cut off.
static int is_ear(const point *p, size_t n, size_t i)
{
    const point *a = &p[(i + n - 1) % n], *b = &p[i], *c = &p[(i + 1) % n];
    if (cross2(a, b, c) < 0.0L)
        return 0;
    for (size_t k = 0; k < n; ++k)
    {
        const point *q = &p[k];
        if (q == a || q == b || q == c)
            continue;
        if (cross2(a, b, q) > 0.0L && cross2(b, c, q) > 0.0L && cross2(c, a, q) > 0.0L)
            return 0;
    }
    return 1;
}

long double area_source_term(const double *corners, size_t corner_count, const double source[3], double z,
                             double sigma)
{
    point p[MAX_CORNERS];
    task t;
    size_t n = corner_count;
    if (n < 3 || n > MAX_CORNERS)
        return (long double)NAN;
    const long double H = to_plane(corners, n, source, p);
    if (H < 0.0L)
        return 0.0L;
    prepare(&t, H, sigma);
    while (n >= 3)
    {   // one ear after the other
        size_t ear = 0;
        while (ear < n && !is_ear(p, n, ear))
            ++ear;
        if (ear == n)
            return (long double)NAN; // not a simple polygon
        const point triangle[3] = {p[(ear + n - 1) % n], p[ear], p[(ear + 1) % n]};
        integrate(&t, triangle, 0);
        for (size_t i = ear; i + 1 < n; ++i)
            p[i] = p[i + 1];
        --n;
    }
    return z * t.total;
}

void area_source_moments(const double *corners, const double source[3], double z, double sigma,
                         long double out[3])
{
    point p[3];
    const long double H = to_plane(corners, 3, source, p);
    for (int k = 0; k < 3; ++k)
    {
        task t;
        out[k] = 0.0L;
        if (H < 0.0L)
            continue;
        prepare(&t, H, sigma);
        for (int i = 0; i < 3; ++i)
            p[i].weight = i == k ? 1.0L : 0.0L;
        integrate(&t, p, 0);
        out[k] = z * t.weighted;
    }
}
