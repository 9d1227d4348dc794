// Numerical integration for oracles, in long double: double exponential rules (Takahasi and Mori 1974), which take
// singular derivatives at the ends of an interval in their stride, and composite Gauss-Legendre for oscillation.

#ifndef SSS_TESTS_QUADRATURE_H
#define SSS_TESTS_QUADRATURE_H

typedef long double (*quadrature_function)(const void *context, long double x);

// Integral over [a, b]: x = tanh-sinh, halving the step until two results agree to about 1e-17.
long double integrate_interval(quadrature_function f, const void *context, long double a, long double b);

// Integral over [0, inf): x = scale exp(pi/2 sinh t); scale > 0 is where the integrand has its bulk.
long double integrate_half_line(quadrature_function f, const void *context, long double scale);

// Composite 16-point Gauss-Legendre over [a, b] in equal panels.
long double integrate_panels(quadrature_function f, const void *context, long double a, long double b, int panels);

// Nodes in (-1, 1) and weights of the n-point Gauss-Legendre rule, by Newton's method on the recurrence. n <= 256.
void gauss_legendre(int n, long double *nodes, long double *weights);

#endif
