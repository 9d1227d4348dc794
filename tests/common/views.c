// The pictures of views.h.

#include "views.h"

#include "lit.h"
#include "numbers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

typedef struct pixel
{
    uint32_t triangle; // UINT32_MAX: background
    float weight[3];   // barycentric
    float exit;        // F_t(w_o)/pi
} pixel;

struct views
{
    size_t count, side, triangle_count;
    pixel *pixels;       // [count][side^2]
    uint32_t *triangles; // of the mesh
};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void frame_of(const double w[3], double u[3], double v[3])
{
    const double help[3] = {fabs(w[0]) < 0.6 ? 1.0 : 0.0, fabs(w[0]) < 0.6 ? 0.0 : 1.0, 0.0};
    const double along = dot(help, w);
    double length;
    for (int k = 0; k < 3; ++k)
        u[k] = help[k] - along * w[k];
    length = sqrt(dot(u, u));
    for (int k = 0; k < 3; ++k)
        u[k] /= length;
    for (int k = 0; k < 3; ++k)
        v[k] = w[(k + 1) % 3] * u[(k + 2) % 3] - w[(k + 2) % 3] * u[(k + 1) % 3];
}

// Vertices in the picture's frame: x and y in pixels, z towards the eye.
static void project(const mesh_data *m, const double w[3], size_t side, double (*p)[3])
{
    double axes[3][3], low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
    frame_of(w, axes[0], axes[1]);
    memcpy(axes[2], w, sizeof axes[2]);
    for (size_t i = 0; i < m->vertex_count; ++i)
    {
        const float *q = &m->positions[3 * i];
        const double x[3] = {(double)q[0], (double)q[1], (double)q[2]};
        for (int k = 0; k < 3; ++k)
            p[i][k] = dot(axes[k], x);
        for (int k = 0; k < 2; ++k)
        {
            low[k] = fmin(low[k], p[i][k]);
            high[k] = fmax(high[k], p[i][k]);
        }
    }
    const double scale = 0.98 * (double)side / fmax(high[0] - low[0], high[1] - low[1]);
    for (size_t i = 0; i < m->vertex_count; ++i)
        for (int k = 0; k < 2; ++k)
            p[i][k] = scale * (p[i][k] - 0.5 * (low[k] + high[k])) + 0.5 * (double)side;
}

static void draw_triangle(const uint32_t *corner, uint32_t triangle, double (*p)[3], size_t side, double *depth,
                          pixel *pixels)
{
    const double *a = p[corner[0]], *b = p[corner[1]], *c = p[corner[2]];
    const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    const double x_low = fmin(a[0], fmin(b[0], c[0])), x_high = fmax(a[0], fmax(b[0], c[0]));
    const double y_low = fmin(a[1], fmin(b[1], c[1])), y_high = fmax(a[1], fmax(b[1], c[1]));
    if (!(area > 0.0)) // faces away
        return;
    for (size_t y = (size_t)fmax(0.0, floor(y_low)); y < side && (double)y <= y_high; ++y)
        for (size_t x = (size_t)fmax(0.0, floor(x_low)); x < side && (double)x <= x_high; ++x)
        {
            const double s = (double)x + 0.5, t = (double)y + 0.5;
            const double w_b = ((s - a[0]) * (c[1] - a[1]) - (t - a[1]) * (c[0] - a[0])) / area;
            const double w_c = ((b[0] - a[0]) * (t - a[1]) - (b[1] - a[1]) * (s - a[0])) / area;
            const double z = a[2] + w_b * (b[2] - a[2]) + w_c * (c[2] - a[2]);
            pixel *at = &pixels[y * side + x];
            if (w_b < 0.0 || w_c < 0.0 || w_b + w_c > 1.0 || z <= depth[y * side + x])
                continue;
            depth[y * side + x] = z;
            at->triangle = triangle;
            at->weight[0] = (float)(1.0 - w_b - w_c);
            at->weight[1] = (float)w_b;
            at->weight[2] = (float)w_c;
        }
}

static void find_exit(const mesh_data *m, const double w[3], double eta, pixel *at)
{
    double n[3] = {0.0, 0.0, 0.0};
    for (size_t k = 0; k < 9; ++k)
        n[k % 3] += (double)at->weight[k / 3] *
                    (double)m->normals[3 * (size_t)m->triangles[3 * (size_t)at->triangle + k / 3] + k % 3];
    const double length = sqrt(dot(n, n));
    at->exit = (float)(lit_transmittance(length > 0.0 ? fmin(1.0, fmax(0.0, dot(n, w) / length)) : 1.0, eta) / PI);
}

views *views_create(const mesh_data *mesh, size_t count, size_t side, double eta)
{
    views *v = (views *)calloc(1, sizeof *v);
    double(*p)[3] = (double(*)[3])malloc(mesh->vertex_count * sizeof *p);
    double *depth = (double *)malloc(side * side * sizeof *depth);
    if (v != NULL)
    {
        v->count = count;
        v->side = side;
        v->pixels = (pixel *)malloc(count * side * side * sizeof *v->pixels);
        v->triangles = (uint32_t *)malloc(3 * mesh->triangle_count * sizeof *v->triangles);
    }
    if (v == NULL || p == NULL || depth == NULL || v->pixels == NULL || v->triangles == NULL)
    {
        free(p);
        free(depth);
        views_free(v);
        return NULL;
    }
    memcpy(v->triangles, mesh->triangles, 3 * mesh->triangle_count * sizeof *v->triangles);
    for (size_t i = 0; i < count; ++i)
    {
        pixel *pixels = &v->pixels[i * side * side];
        const double z = random_between(-1.0, 1.0), phi = random_between(0.0, 2.0 * PI), r = sqrt(1.0 - z * z);
        const double w[3] = {r * cos(phi), r * sin(phi), z};
        project(mesh, w, side, p);
        for (size_t k = 0; k < side * side; ++k)
        {
            depth[k] = -HUGE_VAL;
            pixels[k].triangle = UINT32_MAX;
        }
        for (size_t t = 0; t < mesh->triangle_count; ++t)
            draw_triangle(&mesh->triangles[3 * t], (uint32_t)t, p, side, depth, pixels);
        for (size_t k = 0; k < side * side; ++k)
            if (pixels[k].triangle != UINT32_MAX)
                find_exit(mesh, w, eta, &pixels[k]);
    }
    free(p);
    free(depth);
    return v;
}

void views_free(views *v)
{
    if (v == NULL)
        return;
    free(v->pixels);
    free(v->triangles);
    free(v);
}

static double radiance(const views *v, const pixel *at, const float *B, size_t channel)
{
    const uint32_t *c = &v->triangles[3 * (size_t)at->triangle];
    return (double)at->exit * ((double)at->weight[0] * (double)B[3 * (size_t)c[0] + channel] +
                               (double)at->weight[1] * (double)B[3 * (size_t)c[1] + channel] +
                               (double)at->weight[2] * (double)B[3 * (size_t)c[2] + channel]);
}

// The curve and sRGB that sss_dipole.h documents.
static double tone_map(double x)
{
    const double y = fmin((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 1.0);
    return y <= 0.0031308 ? 12.92 * y : 1.055 * pow(y, 1.0 / 2.4) - 0.055;
}

static int by_double(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double views_exposure(const views *v, const float *B)
{
    const size_t count = v->count * v->side * v->side;
    double *values = (double *)malloc((count + 1) * sizeof *values), exposure = 1.0;
    size_t shown = 0;
    for (size_t i = 0; values != NULL && i < count; ++i)
        if (v->pixels[i].triangle != UINT32_MAX)
            values[shown++] = radiance(v, &v->pixels[i], B, 0);
    if (values != NULL && shown > 0)
    {
        qsort(values, shown, sizeof *values, by_double);
        const double bright = values[shown - 1 - shown / 100];
        exposure = bright > 0.0 ? 1.0 / bright : 1.0; // the curve gives .80 at 1, sRGB .91
    }
    free(values);
    return exposure;
}

double views_rmse(const views *v, views_tone tone, const float *B, const float *want, double exposure, double *mean)
{
    double worst = 0.0, sum = 0.0;
    for (size_t i = 0; i < v->count; ++i)
    {
        const pixel *pixels = &v->pixels[i * v->side * v->side];
        double squares = 0.0;
        for (size_t k = 0; k < v->side * v->side; ++k)
            for (size_t c = 0; c < 3 && pixels[k].triangle != UINT32_MAX; ++c)
            {
                const double got = exposure * radiance(v, &pixels[k], B, c);
                const double exact = exposure * radiance(v, &pixels[k], want, c);
                const double difference =
                    tone == VIEWS_LINEAR ? fmin(got, 1.0) - fmin(exact, 1.0) : tone_map(got) - tone_map(exact);
                squares += difference * difference;
            }
        const double rmse = sqrt(squares / (double)(3 * v->side * v->side));
        worst = fmax(worst, rmse);
        sum += rmse / (double)v->count;
    }
    if (mean != NULL)
        *mean = sum;
    return worst;
}
