// The border integrals of polygon.h.

#include "polygon.h"

#include "quadrature.h"

#include <math.h>

#define PI_L 3.14159265358979323846264338327950288L

typedef struct edge
{
    long double p;     // distance from the projected source to the edge's line
    long double H;
    long double sigma;
} edge;

// (H/s) exp(-sigma (s - H)) over the angle from the foot of the perpendicular, s^2 = H^2 + p^2/cos^2.
static long double border_term(const void *context, long double theta)
{
    const edge *e = (const edge *)context;
    const long double rho = e->p / cosl(theta);
    const long double s = sqrtl(e->H * e->H + rho * rho);
    const long double excess = rho * rho / (s + e->H); // s - H without cancellation
    return e->H / s * expl(-e->sigma * excess);
}

// Over the same angle, with the constant 1 of the interior angle taken together: 1 - (H/s) exp(-sigma (s - H)).
static long double wedge_term(const void *context, long double theta)
{
    const edge *e = (const edge *)context;
    const long double rho = e->p / cosl(theta);
    const long double s = sqrtl(e->H * e->H + rho * rho);
    const long double excess = rho * rho / (s + e->H);
    return -expm1l(-e->sigma * excess) + excess / s * expl(-e->sigma * excess);
}

// Signed distance of the origin from the line through a and b, and the angles of a and b about the foot.
static int edge_angles(const double a[2], const double b[2], long double *p, long double *from, long double *to)
{
    const long double x = (long double)b[0] - a[0], y = (long double)b[1] - a[1];
    const long double length = sqrtl(x * x + y * y);
    const long double cross = (long double)a[0] * b[1] - (long double)a[1] * b[0];
    *p = cross / length;
    *from = atan2l((a[0] * x + a[1] * y) / length, fabsl(*p));
    *to = atan2l((b[0] * x + b[1] * y) / length, fabsl(*p));
    return *p > 0.0L ? 1 : (*p < 0.0L ? -1 : 0);
}

long double polygon_source_term(const double (*xy)[2], int n, double H, double z, double sigma)
{
    // Each edge with the origin spans a signed wedge; its share is int [exp(-sigma H) - (H/s) exp(-sigma s)] dtheta.
    // Where the origin lies outside, the first terms cancel in sum: then the second alone is summed.
    long double winding = 0.0L, wedges = 0.0L, borders = 0.0L, positive = 0.0L;
    for (int i = 0; i < n; ++i)
    {
        edge e;
        long double p, from, to;
        const int side = edge_angles(xy[i], xy[(i + 1) % n], &p, &from, &to);
        if (side == 0)
            continue;
        e.p = fabsl(p);
        e.H = H;
        e.sigma = sigma;
        winding += side * (to - from);
        positive += fabsl(to - from);
        const long double middle = (from < 0.0L && to > 0.0L) ? 0.0L : 0.5L * (from + to);
        wedges += side * (integrate_interval(wedge_term, &e, from, middle) +
                          integrate_interval(wedge_term, &e, middle, to));
        borders += side * (integrate_interval(border_term, &e, from, middle) +
                           integrate_interval(border_term, &e, middle, to));
    }
    const int outside = fabsl(winding) < 1e-12L * positive;
    return (long double)z / H * expl(-(long double)sigma * H) * (outside ? -borders : wedges);
}

typedef struct column
{
    long double x;
    long double H;
    long double sigma;
} column;

static long double column_term(const void *context, long double y)
{
    const column *c = (const column *)context;
    const long double s = sqrtl(c->x * c->x + y * y + c->H * c->H);
    return expl(-c->sigma * s) / s;
}

long double rectangle_first_moment(double x0, double x1, double y0, double y1, double H, double z, double sigma)
{
    const column left = {x0, H, sigma}, right = {x1, H, sigma};
    const long double middle = (y0 < 0.0 && y1 > 0.0) ? 0.0L : 0.5L * ((long double)y0 + y1);
    const long double low = integrate_interval(column_term, &left, y0, middle) -
                            integrate_interval(column_term, &right, y0, middle);
    const long double high = integrate_interval(column_term, &left, middle, y1) -
                             integrate_interval(column_term, &right, middle, y1);
    return z * (low + high);
}
