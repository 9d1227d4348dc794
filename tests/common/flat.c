// The plane geometry of flat.h.

#include "flat.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int64_t flat_orient(const int64_t a[2], const int64_t b[2], const int64_t c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// The magnitude of a product, in two halves.
static void product(int64_t a, int64_t b, uint64_t *high, uint64_t *low)
{
    const uint64_t x = a < 0 ? 0 - (uint64_t)a : (uint64_t)a, y = b < 0 ? 0 - (uint64_t)b : (uint64_t)b;
    const uint64_t x0 = x & UINT32_MAX, x1 = x >> 32, y0 = y & UINT32_MAX, y1 = y >> 32;
    const uint64_t middle = x1 * y0 + (x0 * y0 >> 32), other = x0 * y1 + (middle & UINT32_MAX);
    *high = x1 * y1 + (middle >> 32) + (other >> 32);
    *low = (other << 32) | (x0 * y0 & UINT32_MAX);
}

static int sign_of(int64_t x)
{
    return (x > 0) - (x < 0);
}

// The sign of a b - c d.
static int compare_products(int64_t a, int64_t b, int64_t c, int64_t d)
{
    const int left = sign_of(a) * sign_of(b), right = sign_of(c) * sign_of(d);
    uint64_t high[2], low[2];
    if (left != right)
        return left > right ? 1 : -1;
    product(a, b, &high[0], &low[0]);
    product(c, d, &high[1], &low[1]);
    if (high[0] == high[1] && low[0] == low[1])
        return 0;
    return high[0] > high[1] || (high[0] == high[1] && low[0] > low[1]) ? left : -left;
}

int flat_turn(const int64_t a[2], const int64_t b[2], const int64_t c[2])
{
    return compare_products(b[0] - a[0], c[1] - a[1], b[1] - a[1], c[0] - a[0]);
}

int flat_inside(const int64_t p[2], const int64_t a[2], const int64_t b[2], const int64_t c[2])
{
    const int whole = flat_turn(a, b, c), sides[3] = {flat_turn(p, a, b), flat_turn(p, b, c), flat_turn(p, c, a)};
    int on_border = 0;
    if (whole == 0)
        return -1;
    for (int k = 0; k < 3; ++k)
    {
        if (whole * sides[k] < 0)
            return -1;
        on_border |= sides[k] == 0;
    }
    return on_border ? 0 : 1;
}

// Whether an edge of a has all of b on its other side. The interiors of two convex polygons are apart if and only if a
// line through an edge of one of them keeps them apart.
static int edge_separates(const int64_t (*a)[2], const int64_t (*b)[2])
{
    const int64_t whole = flat_orient(a[0], a[1], a[2]);
    for (int k = 0; k < 3; ++k)
    {
        int beyond = 0;
        for (int i = 0; i < 3; ++i)
        {
            const int64_t side = flat_orient(a[k], a[(k + 1) % 3], b[i]);
            beyond += whole > 0 ? side <= 0 : side >= 0;
        }
        if (beyond == 3)
            return 1;
    }
    return 0;
}

int flat_interiors_meet(const int64_t (*a)[2], const int64_t (*b)[2])
{
    if (flat_orient(a[0], a[1], a[2]) == 0 || flat_orient(b[0], b[1], b[2]) == 0)
        return 0;
    return !edge_separates(a, b) && !edge_separates(b, a);
}

// ---- Pairs by a grid of cells ----

typedef struct cells
{
    int64_t side; // of a cell
    size_t count; // along an axis
    size_t *begin;
    uint32_t *triangle;
} cells;

static void corners_of(const int64_t (*xy)[2], const uint32_t *triangles, size_t t, int64_t out[3][2])
{
    for (size_t k = 0; k < 3; ++k)
        memcpy(out[k], xy[triangles[3 * t + k]], sizeof out[k]);
}

// The box around a triangle, in cells.
static void box_of(const int64_t corners[3][2], int64_t side, size_t low[2], size_t high[2])
{
    for (int axis = 0; axis < 2; ++axis)
    {
        int64_t least = corners[0][axis], most = least;
        for (int k = 1; k < 3; ++k)
        {
            least = corners[k][axis] < least ? corners[k][axis] : least;
            most = corners[k][axis] > most ? corners[k][axis] : most;
        }
        low[axis] = (size_t)(least / side);
        high[axis] = (size_t)(most / side);
    }
}

// Whether a triangle may have interior in a cell: no line through one of its edges has the whole cell beyond it.
static int touches_cell(const int64_t c[3][2], int64_t side, size_t x, size_t y)
{
    const int64_t whole = flat_orient(c[0], c[1], c[2]);
    const int64_t low[2] = {(int64_t)x * side, (int64_t)y * side}, high[2] = {low[0] + side, low[1] + side};
    for (int k = 0; k < 3; ++k)
    {
        const int64_t *a = c[k], *b = c[(k + 1) % 3];
        const int64_t sign = whole > 0 ? 1 : -1, dx = sign * (b[0] - a[0]), dy = sign * (b[1] - a[1]);
        const int64_t inmost[2] = {dy < 0 ? high[0] : low[0], dx > 0 ? high[1] : low[1]}; // farthest to the left
        if (dx * (inmost[1] - a[1]) - dy * (inmost[0] - a[0]) < 0)
            return 0;
    }
    return whole != 0;
}

// Lists triangles in cells; pass 0 counts, pass 1 fills.
static void list_in_cells(const int64_t (*xy)[2], const uint32_t *triangles, size_t triangle_count, cells *c, int pass)
{
    for (size_t t = 0; t < triangle_count; ++t)
    {
        int64_t corners[3][2];
        size_t low[2], high[2];
        corners_of(xy, triangles, t, corners);
        box_of((const int64_t(*)[2])corners, c->side, low, high);
        for (size_t y = low[1]; y <= high[1]; ++y)
            for (size_t x = low[0]; x <= high[0]; ++x)
            {
                if (!touches_cell((const int64_t(*)[2])corners, c->side, x, y))
                    continue;
                if (pass == 0)
                    ++c->begin[y * c->count + x + 1];
                else
                    c->triangle[c->begin[y * c->count + x]++] = (uint32_t)t;
            }
    }
}

static int make_cells(const int64_t (*xy)[2], const uint32_t *triangles, size_t triangle_count, int64_t extent,
                      cells *c)
{
    c->count = 1 + (size_t)sqrt((double)triangle_count);
    c->side = extent / (int64_t)c->count + 1;
    ++c->count; // for what lies at the far end
    c->begin = (size_t *)calloc(c->count * c->count + 2, sizeof *c->begin);
    c->triangle = NULL;
    if (c->begin == NULL)
        return 1;
    list_in_cells(xy, triangles, triangle_count, c, 0);
    for (size_t i = 0; i < c->count * c->count; ++i)
        c->begin[i + 1] += c->begin[i];
    c->triangle = (uint32_t *)malloc((c->begin[c->count * c->count] + 1) * sizeof *c->triangle);
    if (c->triangle == NULL)
        return 1;
    list_in_cells(xy, triangles, triangle_count, c, 1);
    memmove(c->begin + 1, c->begin, c->count * c->count * sizeof *c->begin);
    c->begin[0] = 0;
    return 0;
}

typedef struct pair
{
    uint32_t a, b;
} pair;

static int by_numbers(const void *x, const void *y)
{
    const pair *p = (const pair *)x, *q = (const pair *)y;
    if (p->a != q->a)
        return p->a < q->a ? -1 : 1;
    return p->b < q->b ? -1 : p->b > q->b;
}

// Boxes apart: the quick way out.
static int boxes_apart(const int64_t a[3][2], const int64_t b[3][2])
{
    for (int axis = 0; axis < 2; ++axis)
    {
        int before = 0, behind = 0;
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k)
            {
                before += a[i][axis] <= b[k][axis];
                behind += a[i][axis] >= b[k][axis];
            }
        if (before == 9 || behind == 9)
            return 1;
    }
    return 0;
}

size_t flat_overlaps(const int64_t (*xy)[2], const uint32_t *triangles, size_t triangle_count, int64_t extent,
                     size_t first[2])
{
    enum
    {
        LISTED = 65536 // pairs kept, to be counted once each; beyond it the count is an upper bound
    };
    cells c;
    pair *found = (pair *)malloc(LISTED * sizeof *found);
    size_t count = 0, unique = 0;
    if (make_cells(xy, triangles, triangle_count, extent, &c) != 0 || found == NULL)
    {
        free(c.begin);
        free(c.triangle);
        free(found);
        return SIZE_MAX;
    }
    for (size_t cell = 0; cell < c.count * c.count; ++cell)
        for (size_t i = c.begin[cell]; i < c.begin[cell + 1]; ++i)
        {
            int64_t a[3][2], b[3][2];
            corners_of(xy, triangles, c.triangle[i], a);
            for (size_t k = i + 1; k < c.begin[cell + 1]; ++k)
            {
                corners_of(xy, triangles, c.triangle[k], b);
                if (boxes_apart((const int64_t(*)[2])a, (const int64_t(*)[2])b) ||
                    !flat_interiors_meet((const int64_t(*)[2])a, (const int64_t(*)[2])b))
                    continue;
                if (count < LISTED)
                {
                    found[count].a = c.triangle[i];
                    found[count].b = c.triangle[k];
                }
                ++count;
            }
        }
    free(c.begin);
    free(c.triangle);
    if (count > 0 && first != NULL)
    {
        first[0] = found[0].a;
        first[1] = found[0].b;
    }
    if (count <= LISTED)
    {
        qsort(found, count, sizeof *found, by_numbers);
        for (size_t i = 0; i < count; ++i)
            unique += i == 0 || by_numbers(&found[i], &found[i - 1]) != 0;
        count = unique;
    }
    free(found);
    return count;
}

// ---- Areas ----

// What of a polygon lies where sign (x[axis] - bound) >= 0 (Sutherland and Hodgman 1974).
static size_t clip(double (*in)[2], size_t n, int axis, double bound, double sign, double (*out)[2])
{
    size_t count = 0;
    for (size_t i = 0; i < n; ++i)
    {
        const double *a = in[i], *b = in[(i + 1) % n];
        const double da = sign * (a[axis] - bound), db = sign * (b[axis] - bound);
        if (da >= 0.0)
        {
            out[count][0] = a[0];
            out[count++][1] = a[1];
        }
        if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0))
        {
            const double s = da / (da - db);
            out[count][axis] = bound;
            out[count][1 - axis] = a[1 - axis] + s * (b[1 - axis] - a[1 - axis]);
            ++count;
        }
    }
    return count;
}

double flat_area_in_square(const double corners[3][2], double x, double y)
{
    double one[16][2], two[16][2], twice = 0.0;
    size_t n = 3;
    for (int k = 0; k < 3; ++k)
    {   // relative to the square, so that small areas keep their digits
        one[k][0] = corners[k][0] - x;
        one[k][1] = corners[k][1] - y;
    }
    n = clip(one, n, 0, 0.0, 1.0, two);
    n = clip(two, n, 0, 1.0, -1.0, one);
    n = clip(one, n, 1, 0.0, 1.0, two);
    n = clip(two, n, 1, 1.0, -1.0, one);
    for (size_t i = 1; i + 1 < n; ++i)
        twice += (one[i][0] - one[0][0]) * (one[i + 1][1] - one[0][1]) -
                 (one[i][1] - one[0][1]) * (one[i + 1][0] - one[0][0]);
    return 0.5 * fabs(twice);
}

void flat_nearest(const double corners[3][2], const double p[2], double weights[3])
{
    double best = HUGE_VAL, area = 0.0, side[3];
    int inside = 1;
    for (int k = 0; k < 3; ++k)
    {
        const double *a = corners[(k + 1) % 3], *b = corners[(k + 2) % 3];
        side[k] = (a[0] - p[0]) * (b[1] - p[1]) - (a[1] - p[1]) * (b[0] - p[0]);
        area += side[k];
    }
    for (int k = 0; k < 3; ++k)
        inside &= area != 0.0 && side[k] / area >= 0.0;
    if (inside)
    {
        for (int k = 0; k < 3; ++k)
            weights[k] = side[k] / area;
        return;
    }
    for (int k = 0; k < 3; ++k)
    {
        const double *a = corners[k], *b = corners[(k + 1) % 3];
        const double e[2] = {b[0] - a[0], b[1] - a[1]}, length = e[0] * e[0] + e[1] * e[1];
        double s = length > 0.0 ? ((p[0] - a[0]) * e[0] + (p[1] - a[1]) * e[1]) / length : 0.0;
        s = fmin(fmax(s, 0.0), 1.0);
        const double d = hypot(a[0] + s * e[0] - p[0], a[1] + s * e[1] - p[1]);
        if (d < best)
        {
            best = d;
            weights[k] = 1.0 - s;
            weights[(k + 1) % 3] = s;
            weights[(k + 2) % 3] = 0.0;
        }
    }
}

// ---- Hulls ----

static int by_x(const void *a, const void *b)
{
    const double *p = (const double *)a, *q = (const double *)b;
    if (p[0] != q[0])
        return p[0] < q[0] ? -1 : 1;
    return p[1] < q[1] ? -1 : p[1] > q[1];
}

static double turn_of(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

flat_hull flat_convex_hull(double (*points)[2], size_t count, double turn)
{
    flat_hull hull = {0.0, 0.0, 0};
    double(*h)[2] = (double(*)[2])malloc((2 * count + 2) * sizeof *h);
    size_t n = 0, lower;
    if (h == NULL || count < 3)
    {
        free(h);
        return hull;
    }
    qsort(points, count, sizeof *points, by_x);
    for (size_t i = 0; i < count; memcpy(h[n++], points[i++], sizeof *h)) // Andrew 1979
        while (n >= 2 && turn_of(h[n - 2], h[n - 1], points[i]) <= 0.0)
            --n;
    lower = n + 1;
    for (size_t i = count - 1; i-- > 0; memcpy(h[n++], points[i], sizeof *h))
        while (n >= lower && turn_of(h[n - 2], h[n - 1], points[i]) <= 0.0)
            --n;
    --n; // the first point again
    for (size_t i = 0; i < n; ++i)
    {
        const double *a = h[i], *b = h[(i + 1) % n];
        hull.area += 0.5 * (a[0] * b[1] - a[1] * b[0]);
        hull.length += hypot(b[0] - a[0], b[1] - a[1]);
    }
    double heading = n > 1 ? atan2(h[1][1] - h[0][1], h[1][0] - h[0][0]) : 0.0, turned = 0.0;
    for (size_t i = 1; i <= n; ++i)
    {   // small turns add up until they make a corner
        const double *a = h[i % n], *b = h[(i + 1) % n], next = atan2(b[1] - a[1], b[0] - a[0]);
        const double by = remainder(next - heading, 2.0 * 3.14159265358979323846);
        heading = next;
        turned += by;
        if (turned > turn)
        {
            hull.corners++;
            turned = 0.0;
        }
    }
    free(h);
    return hull;
}
