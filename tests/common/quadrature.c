// The rules of quadrature.h.

#include "quadrature.h"

#include <math.h>

#define PI_L 3.14159265358979323846264338327950288L

#define STEP_HALVINGS 9

// Sum of the double exponential rule's terms at t = (offset + stride k) h for both signs of k.
static long double interval_terms(quadrature_function f, const void *context, long double a, long double b,
                                  long double h, int first, int stride)
{
    long double total = 0.0L;
    for (int k = first;; k += stride)
    {   // u = distance to the near end over the interval's length: 1/(1 + exp(pi sinh t))
        const long double t = h * (long double)k;
        const long double g = expl(-PI_L * sinhl(t));
        const long double u = g / (1.0L + g);
        const long double weight = PI_L * coshl(t) * g / ((1.0L + g) * (1.0L + g)) * (b - a);
        if (weight < 1e-24L * fabsl(b - a) || u < 1e-40L)
            break;
        total += weight * f(context, b - (b - a) * u);
        if (k != 0)
            total += weight * f(context, a + (b - a) * u);
    }
    return total;
}

long double integrate_interval(quadrature_function f, const void *context, long double a, long double b)
{
    long double h = 0.25L;
    long double sum = interval_terms(f, context, a, b, h, 0, 1);
    long double last = h * sum;
    for (int level = 0; level < STEP_HALVINGS; ++level)
    {
        h *= 0.5L;
        sum += interval_terms(f, context, a, b, h, 1, 2);
        const long double now = h * sum;
        if (level > 1 && fabsl(now - last) <= 1e-17L * fabsl(now))
            return now;
        last = now;
    }
    return last;
}

static long double half_line_terms(quadrature_function f, const void *context, long double scale, long double h,
                                   int first, int stride)
{
    long double total = 0.0L;
    for (int sign = -1; sign <= 1; sign += 2)
        for (int k = (first == 0 && sign > 0) ? stride : first; h * (long double)k < 5.0L; k += stride)
        {   // |t| < 5 reaches from scale 1e-50 to scale 1e50
            const long double t = h * (long double)(sign * k);
            const long double x = scale * expl(0.5L * PI_L * sinhl(t));
            const long double value = x * 0.5L * PI_L * coshl(t) * f(context, x);
            if (isfinite(value))
                total += value;
        }
    return total;
}

long double integrate_half_line(quadrature_function f, const void *context, long double scale)
{
    long double h = 0.25L;
    long double sum = half_line_terms(f, context, scale, h, 0, 1);
    long double last = h * sum;
    for (int level = 0; level < STEP_HALVINGS; ++level)
    {
        h *= 0.5L;
        sum += half_line_terms(f, context, scale, h, 1, 2);
        const long double now = h * sum;
        if (level > 1 && fabsl(now - last) <= 1e-16L * fabsl(now))
            return now;
        last = now;
    }
    return last;
}

void gauss_legendre(int n, long double *nodes, long double *weights)
{
    for (int i = 0; i < n; ++i)
    {
        long double x = cosl(PI_L * ((long double)i + 0.75L) / ((long double)n + 0.5L));
        long double derivative = 1.0L;
        for (int iteration = 0; iteration < 100; ++iteration)
        {
            long double p0 = 1.0L, p1 = x;
            for (int l = 2; l <= n; ++l)
            {
                const long double next = ((2.0L * l - 1.0L) * x * p1 - (l - 1.0L) * p0) / (long double)l;
                p0 = p1;
                p1 = next;
            }
            if (n == 1)
                p0 = 1.0L;
            derivative = n == 1 ? 1.0L : (long double)n * (x * p1 - p0) / (x * x - 1.0L);
            const long double step = p1 / derivative;
            x -= step;
            if (fabsl(step) < 1e-18L)
                break;
        }
        nodes[i] = x;
        weights[i] = 2.0L / ((1.0L - x * x) * derivative * derivative);
    }
}

long double integrate_panels(quadrature_function f, const void *context, long double a, long double b, int panels)
{
    long double nodes[16], weights[16], total = 0.0L;
    const long double half = 0.5L * (b - a) / (long double)panels;
    gauss_legendre(16, nodes, weights);
    for (int p = 0; p < panels; ++p)
    {
        const long double middle = a + half * (2.0L * (long double)p + 1.0L);
        for (int i = 0; i < 16; ++i)
            total += weights[i] * half * f(context, middle + half * nodes[i]);
    }
    return total;
}
