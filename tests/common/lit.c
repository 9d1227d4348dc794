// The oracles of lit.h.

#define _POSIX_C_SOURCE 200809L // pthreads

#include "lit.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

// ---- Irradiance ----

double lit_transmittance(double cosine, double eta)
{
    const double sine2 = (1.0 - cosine * cosine) / (eta * eta); // of the refracted ray: Snell
    if (!(cosine > 0.0) || sine2 >= 1.0)
        return 0.0;
    const double inside = sqrt(1.0 - sine2);
    const double s = (cosine - eta * inside) / (cosine + eta * inside);
    const double p = (eta * cosine - inside) / (eta * cosine + inside);
    return 1.0 - 0.5 * (s * s + p * p);
}

void lit_irradiance(const sss_mesh *mesh, const float *normals, double eta, const double light[3], double distance,
                    const float *visible, double *E)
{
    for (size_t v = 0; v < mesh->vertex_count; ++v)
    {
        double w[3], length2 = 0.0, normal2 = 0.0, cosine = 0.0;
        for (size_t k = 0; k < 3; ++k)
        {
            w[k] = isfinite(distance) ? light[k] - (double)mesh->positions[3 * v + k] : light[k];
            length2 += w[k] * w[k];
            normal2 += (double)normals[3 * v + k] * (double)normals[3 * v + k];
            cosine += w[k] * (double)normals[3 * v + k];
        }
        cosine /= sqrt(length2 * normal2);
        E[v] = cosine > 0.0 ? cosine * lit_transmittance(fmin(cosine, 1.0), eta) : 0.0;
        if (isfinite(distance))
            E[v] /= length2 * mesh->mm_per_unit * mesh->mm_per_unit;
        if (visible != NULL)
            E[v] *= (double)visible[v];
    }
}

// ---- Rays ----

struct lit_rays
{
    RTCDevice device;
    RTCScene scene;
    const sss_mesh *mesh;
    sss_mesh view;
    double middle[3], scale; // into the box [-1, 1]^3
};

lit_rays *lit_rays_create(const sss_mesh *mesh)
{
    lit_rays *r = (lit_rays *)calloc(1, sizeof *r);
    double low[3], high[3];
    if (r == NULL)
        return NULL;
    r->view = *mesh;
    r->mesh = &r->view;
    for (size_t k = 0; k < 3; ++k)
    {
        low[k] = HUGE_VAL;
        high[k] = -HUGE_VAL;
        for (size_t v = 0; v < mesh->vertex_count; ++v)
        {
            low[k] = fmin(low[k], (double)mesh->positions[3 * v + k]);
            high[k] = fmax(high[k], (double)mesh->positions[3 * v + k]);
        }
        r->middle[k] = 0.5 * (low[k] + high[k]);
        r->scale = fmax(r->scale, 0.5 * (high[k] - low[k]));
    }
    r->scale = r->scale > 0.0 ? 1.0 / r->scale : 1.0;
    r->device = rtcNewDevice("threads=1");
    r->scene = r->device != NULL ? rtcNewScene(r->device) : NULL;
    if (r->scene == NULL)
    {
        lit_rays_free(r);
        return NULL;
    }
    RTCGeometry geometry = rtcNewGeometry(r->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *points = (float *)rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                     3 * sizeof(float), mesh->vertex_count);
    unsigned *corners = (unsigned *)rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                            3 * sizeof(unsigned), mesh->triangle_count);
    for (size_t i = 0; points != NULL && i < 3 * mesh->vertex_count; ++i)
        points[i] = (float)(r->scale * ((double)mesh->positions[i] - r->middle[i % 3]));
    if (corners != NULL)
        memcpy(corners, mesh->triangles, 3 * mesh->triangle_count * sizeof *corners);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(r->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(r->scene, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(r->scene);
    return r;
}

void lit_rays_free(lit_rays *rays)
{
    if (rays == NULL)
        return;
    if (rays->scene != NULL)
        rtcReleaseScene(rays->scene);
    if (rays->device != NULL)
        rtcReleaseDevice(rays->device);
    free(rays);
}

static int one_visible(const lit_rays *r, struct RTCIntersectContext *context, size_t vertex, const double light[3],
                       double distance)
{
    double o[3], d[3], length = 0.0;
    struct RTCRayHit ray;
    for (size_t k = 0; k < 3; ++k)
    {
        o[k] = r->scale * ((double)r->mesh->positions[3 * vertex + k] - r->middle[k]);
        d[k] = isfinite(distance) ? r->scale * (light[k] - r->middle[k]) - o[k] : light[k];
        length += d[k] * d[k];
    }
    length = sqrt(length);
    memset(&ray, 0, sizeof ray);
    ray.ray.org_x = (float)o[0];
    ray.ray.org_y = (float)o[1];
    ray.ray.org_z = (float)o[2];
    ray.ray.dir_x = (float)(d[0] / length);
    ray.ray.dir_y = (float)(d[1] / length);
    ray.ray.dir_z = (float)(d[2] / length);
    ray.ray.tnear = 1e-6f; // of half the mesh's extent
    for (int hits = 0; hits < 100; ++hits)
    {
        ray.ray.tfar = isfinite(distance) ? (float)length : HUGE_VALF;
        ray.ray.mask = 0xffffffffu;
        ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(r->scene, context, &ray);
        if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID)
            return 1;
        const uint32_t *corner = &r->mesh->triangles[3 * (size_t)ray.hit.primID];
        if (corner[0] != vertex && corner[1] != vertex && corner[2] != vertex)
            return 0;
        ray.ray.tnear = ray.ray.tfar + 1e-6f;
    }
    return 0;
}

void lit_rays_visible(const lit_rays *rays, const double light[3], double distance, float *visible)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t v = 0; v < rays->mesh->vertex_count; ++v)
        visible[v] = one_visible(rays, &context, v, light, distance) ? 1.0f : 0.0f;
}

// ---- Rows ----

#define MAX_DEPTH 60     // halvings of a triangle around a receiver
#define FINE_RATIO 0.5   // longest edge over the distance of the nearest source
#define FINE_DECAY 1.5   // sigma_tr times the longest edge
#define NOTHING 45.0     // exponents from which on nothing is left

typedef struct kernels
{
    double scale[3], sigma[3], z[3][2]; // of the channels
    double z_least, sigma_most, sigma_least;
} kernels;

static void make_kernels(const sss_profile *p, kernels *k)
{
    k->z_least = HUGE_VAL;
    k->sigma_most = 0.0;
    k->sigma_least = HUGE_VAL;
    for (int c = 0; c < 3; ++c)
    {
        k->scale[c] = p->alpha_p[c] / (4.0 * PI);
        k->sigma[c] = p->sigma_tr[c];
        k->z[c][0] = p->z_r[c];
        k->z[c][1] = p->z_v[c];
        if (!(p->alpha_p[c] > 0.0) || !(p->z_r[c] > 0.0))
            continue;
        k->z_least = fmin(k->z_least, p->z_r[c]);
        k->sigma_most = fmax(k->sigma_most, p->sigma_tr[c]);
        k->sigma_least = fmin(k->sigma_least, p->sigma_tr[c]);
    }
}

// The paper's R_d (section 2.2) of one channel.
static double R_d(const kernels *k, int c, double r2)
{
    double sum = 0.0;
    for (int source = 0; source < 2; ++source)
    {
        const double z = k->z[c][source], d = sqrt(r2 + z * z), sigma = k->sigma[c];
        sum += z > 0.0 ? z * (sigma + 1.0 / d) * exp(-sigma * d) / (d * d) : 0.0;
    }
    return k->scale[c] * sum;
}

// Radon's rule of seven points, degree 5.
static void integrate_triangle(const kernels *k, const double p[3][3], const double hat[3][3], double area,
                               double sum[3][3])
{
    static const double a[2] = {0.10128650732345634, 0.47014206410511509};
    static const double weight[3] = {0.225, 0.12593918054482715, 0.13239415278850618};
    for (int i = 0; i < 7; ++i)
    {
        const int orbit = (i + 2) / 3; // 0: centroid
        double b[3] = {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0}, r2 = 0.0, h[3];
        if (orbit > 0)
            for (int j = 0; j < 3; ++j)
                b[j] = j == (i - 1) % 3 ? 1.0 - 2.0 * a[orbit - 1] : a[orbit - 1];
        for (int axis = 0; axis < 3; ++axis)
        {
            const double x = b[0] * p[0][axis] + b[1] * p[1][axis] + b[2] * p[2][axis];
            r2 += x * x;
            h[axis] = b[0] * hat[0][axis] + b[1] * hat[1][axis] + b[2] * hat[2][axis];
        }
        for (int c = 0; c < 3; ++c)
        {
            const double f = k->scale[c] > 0.0 ? weight[orbit] * area * R_d(k, c, r2) : 0.0;
            for (int j = 0; j < 3; ++j)
                sum[c][j] += f * h[j];
        }
    }
}

static double squared(const double a[3], const double b[3])
{
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}

// p relative to the receiver, mm; hat [corner][vertex of the mesh's triangle].
static void add_triangle(const kernels *k, const double p[3][3], const double hat[3][3], double area, int depth,
                         double sum[3][3])
{
    double middle2 = 0.0, longest2 = 0.0;
    int edge = 0;
    for (int axis = 0; axis < 3; ++axis)
    {
        const double x = (p[0][axis] + p[1][axis] + p[2][axis]) / 3.0;
        middle2 += x * x;
    }
    for (int e = 0; e < 3; ++e)
    {
        const double l2 = squared(p[e], p[(e + 1) % 3]);
        if (l2 > longest2)
        {
            longest2 = l2;
            edge = e;
        }
    }
    const double longest = sqrt(longest2), nearest = fmax(0.0, sqrt(middle2) - longest);
    if (!(area > 0.0) || k->sigma_least * nearest > NOTHING)
        return;
    const double source = sqrt(nearest * nearest + k->z_least * k->z_least);
    if (depth >= MAX_DEPTH || (longest < FINE_RATIO * source && k->sigma_most * longest < FINE_DECAY))
    {
        integrate_triangle(k, p, hat, area, sum);
        return;
    }
    const int a = edge, b = (edge + 1) % 3;
    for (int half = 0; half < 2; ++half)
    {
        double q[3][3], g[3][3];
        const int moved = half == 0 ? b : a;
        memcpy(q, p, sizeof q);
        memcpy(g, hat, sizeof g);
        for (int axis = 0; axis < 3; ++axis)
        {
            q[moved][axis] = 0.5 * (p[a][axis] + p[b][axis]);
            g[moved][axis] = 0.5 * (hat[a][axis] + hat[b][axis]);
        }
        add_triangle(k, (const double(*)[3])q, (const double(*)[3])g, 0.5 * area, depth + 1, sum);
    }
}

static void one_row(const sss_mesh *mesh, const kernels *k, size_t vertex, double *weight)
{
    static const double hat[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    const size_t V = mesh->vertex_count;
    memset(weight, 0, 3 * V * sizeof *weight);
    for (size_t t = 0; t < mesh->triangle_count && k->z_least < HUGE_VAL; ++t)
    {
        const uint32_t *corner = &mesh->triangles[3 * t];
        double p[3][3], cross[3], sum[3][3];
        memset(sum, 0, sizeof sum);
        for (size_t i = 0; i < 3; ++i)
            for (size_t axis = 0; axis < 3; ++axis)
                p[i][axis] = ((double)mesh->positions[3 * (size_t)corner[i] + axis] -
                              (double)mesh->positions[3 * vertex + axis]) * mesh->mm_per_unit;
        for (int axis = 0; axis < 3; ++axis)
        {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            cross[axis] = (p[1][u] - p[0][u]) * (p[2][v] - p[0][v]) - (p[1][v] - p[0][v]) * (p[2][u] - p[0][u]);
        }
        const double area = 0.5 * sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
        add_triangle(k, (const double(*)[3])p, hat, area, 0, sum);
        for (size_t c = 0; c < 3; ++c)
            for (size_t i = 0; i < 3; ++i)
                weight[c * V + corner[i]] += sum[c][i];
    }
}

typedef struct row_job
{
    const sss_mesh *mesh;
    const kernels *k;
    lit_rows *rows;
    pthread_mutex_t lock;
    size_t next; // under lock
} row_job;

static void *work(void *pointer)
{
    row_job *j = (row_job *)pointer;
    for (;;)
    {
        (void)pthread_mutex_lock(&j->lock);
        const size_t i = j->next++;
        (void)pthread_mutex_unlock(&j->lock);
        if (i >= j->rows->count)
            return NULL;
        one_row(j->mesh, j->k, j->rows->index[i], &j->rows->weight[3 * i * j->rows->V]);
    }
}

int lit_rows_make(const sss_mesh *mesh, const sss_profile *profile, size_t *index, size_t count, int threads,
                  lit_rows *out)
{
    kernels k;
    row_job j;
    pthread_t thread[16];
    int started = 0;
    make_kernels(profile, &k);
    memset(out, 0, sizeof *out);
    out->V = mesh->vertex_count;
    out->count = count;
    out->index = index;
    out->weight = (double *)malloc(3 * count * out->V * sizeof *out->weight);
    memset(&j, 0, sizeof j);
    j.mesh = mesh;
    j.k = &k;
    j.rows = out;
    if (index == NULL || out->weight == NULL || pthread_mutex_init(&j.lock, NULL) != 0)
    {
        lit_rows_free(out);
        return 1;
    }
    while (started < threads - 1 && started < 16 && pthread_create(&thread[started], NULL, work, &j) == 0)
        ++started;
    (void)work(&j);
    for (int i = 0; i < started; ++i)
        (void)pthread_join(thread[i], NULL);
    (void)pthread_mutex_destroy(&j.lock);
    return 0;
}

void lit_rows_free(lit_rows *rows)
{
    free(rows->index);
    free(rows->weight);
    memset(rows, 0, sizeof *rows);
}

void lit_rows_apply(const lit_rows *rows, const double *E, double *B)
{
    for (size_t i = 0; i < 3 * rows->count; ++i)
    {
        const double *w = &rows->weight[i * rows->V];
        double sum = 0.0;
        for (size_t v = 0; v < rows->V; ++v)
            sum += w[v] * E[v];
        B[i] = sum;
    }
}
