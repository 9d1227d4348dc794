// The random walk of walk.h. A photon's way, in the order of this file: it starts on the surface in proportion to E,
// is refracted, flies, scatters, is reflected inside or leaves.

#define _POSIX_C_SOURCE 200809L // clock_gettime

#include "walk.h"

#include "lit.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum
{
    BATCHES = 32,
    BATCHES_MIN = 16,
    GRID_MAX = 128,  // cells along the longest side of the grid of distances
    GRID_MIN = 16,
    TALLIES = 6,     // left, absorbed, lost, cut, roulette, path
    RAY_TRIES = 64   // faces seen from outside, at the very start of a ray, that it may pass
};

// Below this weight a photon plays Russian roulette for KEPT_WEIGHT.
static const double ROULETTE_WEIGHT = 0.05, KEPT_WEIGHT = 0.2;

struct walk_scene
{
    RTCDevice device;
    RTCScene scene;
    size_t V, T;
    uint32_t *triangles; // [3 T]
    double *corners;     // [T][3][3] mm, from the middle of the bounding box
    double *plane;       // [T][3] unit normal, outward; 0 for a triangle without area
    double *area;        // [T] mm^2
    float *normals;      // [V][3] unit length
    double middle[3];    // mm
    double step;         // mm: a few units in the last place of Embree's coordinates
    // How far from the surface: rings of free cells around each, so that short flights need no ray.
    unsigned char *rings;
    size_t cells[3];
    double low[3], cell; // mm
};

// ---- Vectors ----

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double normalize(double a[3])
{
    const double length = sqrt(dot(a, a));
    for (int i = 0; i < 3 && length > 0.0; ++i)
        a[i] /= length;
    return length;
}

static void along(const double o[3], const double d[3], double t, double out[3])
{
    for (int i = 0; i < 3; ++i)
        out[i] = o[i] + t * d[i];
}

// ---- Random numbers: SplitMix64 (Steele, Lea and Flood 2014) from a start that is a hash of who asks, so that any
// thread can walk any photon ----

static uint64_t mix(uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static uint64_t random_start(uint64_t seed, uint64_t channel, uint64_t photon)
{
    return mix(mix(mix(seed + 0x9E3779B97F4A7C15u) + channel) + photon);
}

static double uniform(uint64_t *state) // in (0, 1): the middles of 2^52 intervals
{
    *state += 0x9E3779B97F4A7C15u;
    return ((double)(mix(*state) >> 12) + 0.5) / 4503599627370496.0;
}

// A point on the unit circle without sines: von Neumann 1951.
static void circle(uint64_t *state, double *c, double *s)
{
    double x, y, r2;
    do
    {
        x = 2.0 * uniform(state) - 1.0;
        y = 2.0 * uniform(state) - 1.0;
        r2 = x * x + y * y;
    } while (r2 > 1.0 || r2 == 0.0);
    *c = (x * x - y * y) / r2;
    *s = 2.0 * x * y / r2;
}

// Turns d by an angle of the given cosine to any side.
static void turn(uint64_t *state, double cosine, double d[3])
{
    const double sine = sqrt(fmax(0.0, 1.0 - cosine * cosine)), sign = d[2] < 0.0 ? -1.0 : 1.0;
    const double a = -1.0 / (sign + d[2]), b = d[0] * d[1] * a; // a frame about d: Duff et al. 2017
    const double u[3] = {1.0 + sign * d[0] * d[0] * a, sign * b, -sign * d[0]};
    const double v[3] = {b, sign + d[1] * d[1] * a, -d[1]};
    double c, s;
    circle(state, &c, &s);
    for (int i = 0; i < 3; ++i)
        d[i] = cosine * d[i] + sine * (c * u[i] + s * v[i]);
    normalize(d);
}

// Henyey and Greenstein 1941: the inverse of the cumulative distribution of the cosine.
static double scattering_cosine(uint64_t *state, double g)
{
    const double xi = 2.0 * uniform(state) - 1.0;
    if (fabs(g) < 1e-6)
        return xi;
    const double f = (1.0 - g * g) / (1.0 + g * xi);
    return (1.0 + g * g - f * f) / (2.0 * g);
}

void walk_medium_of(const sss_profile *profile, double g, walk_medium *out)
{
    for (int k = 0; k < 3; ++k)
    {
        const double sigma_t = profile->z_r[k] > 0.0 ? 1.0 / profile->z_r[k] : 0.0; // reduced
        out->sigma_s[k] = profile->alpha_p[k] * sigma_t / (1.0 - g);
        out->sigma_a[k] = (1.0 - profile->alpha_p[k]) * sigma_t;
    }
    out->g = g;
    out->eta = profile->eta;
}

// ---- The scene ----

static int copy_mesh(walk_scene *s, const sss_mesh *mesh)
{
    s->V = mesh->vertex_count;
    s->T = mesh->triangle_count;
    s->triangles = (uint32_t *)malloc(3 * s->T * sizeof *s->triangles);
    s->corners = (double *)malloc(9 * s->T * sizeof *s->corners);
    s->plane = (double *)malloc(3 * s->T * sizeof *s->plane);
    s->area = (double *)malloc(s->T * sizeof *s->area);
    s->normals = (float *)malloc(3 * s->V * sizeof *s->normals);
    if (s->triangles == NULL || s->corners == NULL || s->plane == NULL || s->area == NULL || s->normals == NULL)
        return 1;
    memcpy(s->triangles, mesh->triangles, 3 * s->T * sizeof *s->triangles);
    for (size_t v = 0; v < s->V; ++v)
    {
        double n[3];
        for (size_t i = 0; i < 3; ++i)
            n[i] = (double)mesh->normals[3 * v + i];
        normalize(n);
        for (size_t i = 0; i < 3; ++i)
            s->normals[3 * v + i] = (float)n[i];
    }
    return 0;
}

static void bounds(const sss_mesh *mesh, double low[3], double high[3])
{
    for (size_t i = 0; i < 3; ++i)
    {
        low[i] = HUGE_VAL;
        high[i] = -HUGE_VAL;
    }
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) // of what triangles use
    {
        for (size_t k = 0; k < 3; ++k)
        {
            const double x = mesh->mm_per_unit * (double)mesh->positions[3 * mesh->triangles[i] + k];
            low[k] = fmin(low[k], x);
            high[k] = fmax(high[k], x);
        }
    }
}

static void place_triangle(walk_scene *s, const sss_mesh *mesh, size_t t)
{
    double *const p = s->corners + 9 * t, *const n = s->plane + 3 * t;
    for (size_t i = 0; i < 9; ++i)
    {
        const size_t vertex = mesh->triangles[3 * t + i / 3];
        p[i] = mesh->mm_per_unit * (double)mesh->positions[3 * vertex + i % 3] - s->middle[i % 3];
    }
    for (int i = 0; i < 3; ++i)
    {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = (p[3 + j] - p[j]) * (p[6 + k] - p[k]) - (p[3 + k] - p[k]) * (p[6 + j] - p[j]);
    }
    s->area[t] = 0.5 * normalize(n);
}

static int build_rays(walk_scene *s)
{
    s->device = rtcNewDevice("threads=1");
    s->scene = s->device != NULL ? rtcNewScene(s->device) : NULL;
    if (s->scene == NULL)
        return 1;
    RTCGeometry geometry = rtcNewGeometry(s->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *const points = (float *)rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                           3 * sizeof(float), s->V);
    unsigned *const corners = (unsigned *)rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                                  RTC_FORMAT_UINT3, 3 * sizeof(unsigned), s->T);
    if (points == NULL || corners == NULL)
    {
        rtcReleaseGeometry(geometry);
        return 1;
    }
    memset(points, 0, 3 * s->V * sizeof *points);
    for (size_t i = 0; i < 9 * s->T; ++i) // vertices, so that triangles that share one leave no crack
        points[3 * s->triangles[i / 3] + i % 3] = (float)s->corners[i];
    for (size_t i = 0; i < 3 * s->T; ++i)
        corners[i] = s->triangles[i];
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(s->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(s->scene, RTC_SCENE_FLAG_ROBUST); // watertight edges
    rtcCommitScene(s->scene);
    return rtcGetDeviceError(s->device) != RTC_ERROR_NONE;
}

// Marks the cells that a triangle's bounding box touches, widened by what rounding may move.
static void mark_cells(walk_scene *s, size_t t)
{
    size_t first[3], last[3];
    for (size_t k = 0; k < 3; ++k)
    {
        const double *const p = s->corners + 9 * t + k;
        const double low = fmin(p[0], fmin(p[3], p[6])) - s->step, high = fmax(p[0], fmax(p[3], p[6])) + s->step;
        const double end = (double)(s->cells[k] - 1);
        first[k] = (size_t)fmin(end, fmax(0.0, floor((low - s->low[k]) / s->cell)));
        last[k] = (size_t)fmin(end, fmax(0.0, floor((high - s->low[k]) / s->cell)));
    }
    for (size_t z = first[2]; z <= last[2]; ++z)
        for (size_t y = first[1]; y <= last[1]; ++y)
            memset(s->rings + (z * s->cells[1] + y) * s->cells[0] + first[0], 0, last[0] - first[0] + 1);
}

// The Chebyshev distance to the nearest marked cell, axis after axis: over each line the minimum of
// max(distance along the line, distance found so far).
static void spread_line(unsigned char *line, size_t stride, size_t count, unsigned char *copy)
{
    for (size_t i = 0; i < count; ++i)
        copy[i] = line[i * stride];
    for (size_t i = 0; i < count; ++i)
    {
        unsigned best = copy[i];
        for (size_t away = 1; away < best && away < count; ++away) // nothing farther than `best` can lower it
        {
            const unsigned below = i >= away ? copy[i - away] : 255u, above = i + away < count ? copy[i + away] : 255u;
            const unsigned least = below < above ? below : above, far = (unsigned)away;
            best = (least > far ? least : far) < best ? (least > far ? least : far) : best;
        }
        line[i * stride] = (unsigned char)best;
    }
}

static int measure_rings(walk_scene *s, const double extent[3])
{
    const double longest = fmax(extent[0], fmax(extent[1], extent[2]));
    // As fine as the triangles deserve: building it must not take longer than the walk.
    const double grid = fmin(GRID_MAX, fmax(GRID_MIN, ceil(3.0 * cbrt((double)s->T))));
    unsigned char copy[GRID_MAX + 1];
    s->cell = longest / grid;
    for (size_t k = 0; k < 3; ++k)
    {
        s->low[k] = -0.5 * extent[k];
        s->cells[k] = (size_t)fmin(grid, floor(extent[k] / s->cell) + 1.0);
    }
    const size_t nx = s->cells[0], ny = s->cells[1], nz = s->cells[2];
    s->rings = (unsigned char *)malloc(nx * ny * nz);
    if (s->rings == NULL)
        return 1;
    memset(s->rings, 255, nx * ny * nz);
    for (size_t t = 0; t < s->T; ++t)
        mark_cells(s, t);
    for (size_t i = 0; i < ny * nz; ++i)
        spread_line(s->rings + i * nx, 1, nx, copy);
    for (size_t i = 0; i < nx * nz; ++i)
        spread_line(s->rings + i / nx * nx * ny + i % nx, nx, ny, copy);
    for (size_t i = 0; i < nx * ny; ++i)
        spread_line(s->rings + i, nx * ny, nz, copy);
    return 0;
}

walk_scene *walk_scene_create(const sss_mesh *mesh)
{
    double low[3], high[3], extent[3], longest = 0.0;
    walk_scene *s;
    if (mesh == NULL || mesh->triangle_count == 0 || mesh->normals == NULL)
        return NULL;
    s = (walk_scene *)calloc(1, sizeof *s);
    if (s == NULL || copy_mesh(s, mesh) != 0)
    {
        walk_scene_free(s);
        return NULL;
    }
    bounds(mesh, low, high);
    for (int i = 0; i < 3; ++i)
    {
        s->middle[i] = 0.5 * (low[i] + high[i]);
        extent[i] = high[i] - low[i];
        longest = fmax(longest, extent[i]);
    }
    s->step = 0x1p-21 * longest; // coordinates reach half of that, and have 24 bits: four units in the last place
    for (size_t t = 0; t < s->T; ++t)
        place_triangle(s, mesh, t);
    if (!(longest > 0.0) || build_rays(s) != 0 || measure_rings(s, extent) != 0)
    {
        walk_scene_free(s);
        return NULL;
    }
    return s;
}

void walk_scene_free(walk_scene *s)
{
    if (s == NULL)
        return;
    if (s->scene != NULL)
        rtcReleaseScene(s->scene);
    if (s->device != NULL)
        rtcReleaseDevice(s->device);
    free(s->triangles);
    free(s->corners);
    free(s->plane);
    free(s->area);
    free(s->normals);
    free(s->rings);
    free(s);
}

// No triangle is nearer than this: the free rings around the point's cell.
static double clearance(const walk_scene *s, const double x[3])
{
    size_t at[3];
    for (size_t k = 0; k < 3; ++k)
    {
        const double i = floor((x[k] - s->low[k]) / s->cell);
        if (!(i >= 0.0) || i >= (double)s->cells[k])
            return 0.0;
        at[k] = (size_t)i;
    }
    const unsigned char rings = s->rings[(at[2] * s->cells[1] + at[1]) * s->cells[0] + at[0]];
    return rings > 1 ? (double)(rings - 1) * s->cell : 0.0;
}

static int outside_box(const walk_scene *s, const double x[3])
{
    return fabs(x[0]) > s->step - s->low[0] || fabs(x[1]) > s->step - s->low[1] || fabs(x[2]) > s->step - s->low[2];
}

typedef enum hit
{
    HIT_NONE, // nothing within the distance
    HIT_FACE, // a triangle, from inside
    HIT_LOST  // a triangle from outside: the photon was not inside
} hit;

// The first triangle that the ray leaves through, within `far` (HUGE_VAL: any distance). Embree says which it is, its
// plane says how far. The ray starts a step back, so that a point on the surface, moved outside by rounding, still
// meets what is before it; triangles seen from outside on that first bit of way, or the one that the photon comes from,
// are passed.
static hit cast(const walk_scene *s, struct RTCIntersectContext *context, const double o[3], const double d[3],
                double far, size_t from, size_t *triangle, double *t)
{
    struct RTCRayHit ray;
    double start[3];
    along(o, d, -s->step, start);
    memset(&ray, 0, sizeof ray);
    ray.ray.org_x = (float)start[0];
    ray.ray.org_y = (float)start[1];
    ray.ray.org_z = (float)start[2];
    ray.ray.dir_x = (float)d[0];
    ray.ray.dir_y = (float)d[1];
    ray.ray.dir_z = (float)d[2];
    ray.ray.mask = 0xffffffffu;
    for (int tries = 0; tries < RAY_TRIES; ++tries)
    {
        ray.ray.tfar = (float)(far * (1.0 + 0x1p-20) + 2.0 * s->step);
        ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(s->scene, context, &ray);
        if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID)
            return HIT_NONE;
        const size_t face = ray.hit.primID;
        const double *const n = s->plane + 3 * face, *const p = s->corners + 9 * face, cosine = dot(n, d);
        const double to[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
        if (cosine > 0.0)
        {
            *triangle = face;
            *t = fmax(0.0, dot(n, to) / cosine);
            return *t < far ? HIT_FACE : HIT_NONE;
        }
        if (face != from && cosine < 0.0 && (double)ray.ray.tfar > 4.0 * s->step)
            return HIT_LOST;
        ray.ray.tnear = nextafterf(ray.ray.tfar, HUGE_VALF);
    }
    return HIT_LOST;
}

// ---- Lights: where photons start ----

typedef struct emitter
{
    const walk_light *light;
    double w[3];     // unit length, towards a light that has a direction; of a diffuse one the gradient
    double *E;       // [V] per unit of colour; NULL for a beam
    double *summed;  // [T] power of the triangles up to and with this one, W per unit of colour
    double power;    // W per unit of colour
    double specular; // W per unit of colour, reflected at the surface
} emitter;

// T_k = 2 int F_t mu^(1+k) dmu, by Simpson's rule in mu = x^2, in which F_t has no kink at grazing incidence. T_0 is
// 1 - F_external.
static double diffuse_transmittance(double eta, int k)
{
    const int n = 2000;
    double sum = 0.0;
    for (int i = 0; i <= n; ++i)
    {
        const double x = (double)i / n, weight = i == 0 || i == n ? 1.0 : i % 2 ? 4.0 : 2.0;
        sum += weight * 2.0 * lit_transmittance(x * x, eta) * pow(x * x, 1 + k) * 2.0 * x;
    }
    return sum / (3.0 * n);
}

// E and what is reflected, per unit of colour.
static void light_vertices(const walk_scene *s, double eta, emitter *e, double *specular)
{
    const double T_0 = diffuse_transmittance(eta, 0), T_1 = diffuse_transmittance(eta, 1);
    for (size_t v = 0; v < s->V; ++v)
    {
        const double share = e->light->mask != NULL ? (double)e->light->mask[v] : 1.0;
        double cosine = 0.0, falling, entering;
        for (size_t i = 0; i < 3; ++i)
            cosine += (double)s->normals[3 * v + i] * e->w[i];
        if (e->light->kind == WALK_DIFFUSE)
        {
            falling = 1.0 + 2.0 / 3.0 * cosine; // the integrals with F_t = 1
            entering = T_0 + T_1 * cosine;
        }
        else
        {
            falling = fmin(1.0, fmax(0.0, cosine));
            entering = falling * lit_transmittance(falling, eta);
        }
        e->E[v] = share * entering;
        specular[v] = share * (falling - entering);
    }
}

static void sum_triangles(const walk_scene *s, emitter *e, const double *specular)
{
    double sum = 0.0;
    for (size_t t = 0; t < s->T; ++t)
    {
        const uint32_t *const c = s->triangles + 3 * t;
        sum += s->area[t] * (e->E[c[0]] + e->E[c[1]] + e->E[c[2]]) / 3.0;
        e->specular += s->area[t] * (specular[c[0]] + specular[c[1]] + specular[c[2]]) / 3.0;
        e->summed[t] = sum;
    }
    e->power = sum;
}

static int make_beam(const walk_scene *s, double eta, int aimed, emitter *e)
{
    if (e->light->triangle >= s->T)
        return 1;
    e->power = diffuse_transmittance(eta, 0);
    if (aimed)
        e->power = lit_transmittance(fmin(1.0, dot(e->w, s->plane + 3 * e->light->triangle)), eta);
    e->specular = 1.0 - e->power;
    return 0;
}

static int make_emitter(const walk_scene *s, double eta, const walk_light *light, emitter *e)
{
    memset(e, 0, sizeof *e);
    e->light = light;
    memcpy(e->w, light->direction, sizeof e->w);
    if (light->kind == WALK_DIFFUSE)
    {
        if (!(dot(e->w, e->w) <= 1.0))
            return 1;
    }
    else
    {
        const int aimed = normalize(e->w) > 0.0;
        if (light->kind == WALK_BEAM)
            return make_beam(s, eta, aimed, e);
        if (!aimed)
            return 1;
    }
    double *const specular = (double *)malloc(s->V * sizeof *specular);
    e->E = (double *)malloc(s->V * sizeof *e->E);
    e->summed = (double *)malloc(s->T * sizeof *e->summed);
    const int failed = specular == NULL || e->E == NULL || e->summed == NULL;
    if (!failed)
    {
        light_vertices(s, eta, e, specular);
        sum_triangles(s, e, specular);
    }
    free(specular);
    return failed;
}

static void free_emitters(emitter *emitters, size_t count)
{
    for (size_t l = 0; l < count && emitters != NULL; ++l)
    {
        free(emitters[l].E);
        free(emitters[l].summed);
    }
    free(emitters);
}

// The triangle whose range of the sums holds `want`.
static size_t pick_triangle(const emitter *e, size_t T, double want)
{
    size_t low = 0, high = T - 1;
    while (low < high)
    {
        const size_t middle = (low + high) / 2;
        if (e->summed[middle] > want)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

// Barycentric coordinates with density proportional to sum b_i E_i: a corner i in proportion to E_i, then density b_i,
// the Dirichlet distribution (2, 1, 1): b_i is the median of three uniform numbers, the rest divides evenly.
static void pick_point(uint64_t *state, const double E[3], double b[3])
{
    const double want = uniform(state) * (E[0] + E[1] + E[2]);
    const int i = want < E[0] ? 0 : want < E[0] + E[1] ? 1 : 2;
    const double u = uniform(state), v = uniform(state), w = uniform(state), share = uniform(state);
    b[i] = fmax(fmin(u, v), fmin(fmax(u, v), w));
    b[(i + 1) % 3] = (1.0 - b[i]) * share;
    b[(i + 2) % 3] = (1.0 - b[i]) * (1.0 - share);
}

typedef struct photon
{
    double x[3], d[3], weight;
    size_t from; // the triangle that it comes from
    uint64_t random;
} photon;

// Snell: the direction of light that arrives from w at a surface with normal n (both unit length).
static void refract(const double w[3], const double n[3], double eta, double d[3])
{
    double cosine = dot(w, n), tangent[3];
    along(w, n, -cosine, tangent);
    if (cosine <= 0.0) // a normal between lit and unlit vertices: light that grazes
        normalize(tangent);
    cosine = fmax(0.0, cosine);
    const double inside = sqrt(fmax(0.0, 1.0 - (1.0 - cosine * cosine) / (eta * eta)));
    for (int i = 0; i < 3; ++i)
        d[i] = -tangent[i] / eta - inside * n[i];
    normalize(d);
}

// A direction from which diffuse light enters: by cosine, kept in proportion to F_t and to the radiance.
static void diffuse_direction(uint64_t *state, const double n[3], const double gradient[3], double eta, double w[3])
{
    const double most = 1.0 + sqrt(dot(gradient, gradient));
    double cosine;
    do
    {
        memcpy(w, n, 3 * sizeof *w);
        cosine = sqrt(uniform(state));
        turn(state, cosine, w);
    } while (uniform(state) * most > lit_transmittance(cosine, eta) * (1.0 + dot(gradient, w)));
}

static void start_on_surface(const walk_scene *s, double eta, const emitter *e, double want, photon *p)
{
    const size_t t = pick_triangle(e, s->T, want);
    const uint32_t *const c = s->triangles + 3 * t;
    const double *const x = s->corners + 9 * t, *const plane = s->plane + 3 * t;
    const double E[3] = {e->E[c[0]], e->E[c[1]], e->E[c[2]]};
    double b[3], n[3] = {0.0, 0.0, 0.0}, w[3];
    pick_point(&p->random, E, b);
    for (size_t i = 0; i < 3; ++i)
    {
        p->x[i] = b[0] * x[i] + b[1] * x[3 + i] + b[2] * x[6 + i];
        for (size_t k = 0; k < 3; ++k)
            n[i] += b[k] * (double)s->normals[3 * c[k] + i];
    }
    p->from = t;
    if (e->light->kind == WALK_DIFFUSE)
    {
        diffuse_direction(&p->random, plane, e->w, eta, w);
        refract(w, plane, eta, p->d);
        return;
    }
    if (!(normalize(n) > 0.0))
        memcpy(n, plane, sizeof n);
    refract(e->w, n, eta, p->d);
    const double out = dot(p->d, plane);
    if (out > 0.0) // the interpolated normal lets it in, the triangle's plane does not: mirrored into the body
        along(p->d, plane, -2.0 * out, p->d);
}

static void start_beam(const walk_scene *s, double eta, const emitter *e, photon *p)
{
    double w[3];
    const double *const x = s->corners + 9 * e->light->triangle;
    for (int i = 0; i < 3; ++i)
        p->x[i] = (x[i] + x[3 + i] + x[6 + i]) / 3.0;
    p->from = e->light->triangle;
    memcpy(w, e->w, sizeof w);
    if (dot(w, w) == 0.0)
        diffuse_direction(&p->random, s->plane + 3 * p->from, e->w, eta, w);
    refract(w, s->plane + 3 * p->from, eta, p->d);
}

// ---- The walk ----

typedef struct job
{
    const walk_scene *s;
    const walk_medium *medium;
    const walk_options *options;
    emitter *emitters;
    size_t emitter_count, batches;
    uint64_t per_batch; // photons
    double power[3];    // W that enter
    double *tally;      // [3][batches][TALLIES], W; the last in W mm
    double *flux;       // [3][batches][P], W
    uint64_t *steps;    // [3][batches][2] scatterings, rays
} job;

enum
{
    LEFT,
    ABSORBED,
    LOST,
    CUT,
    ROULETTE,
    PATH
};

// One photon's share of what a batch counts.
typedef struct counter
{
    const job *j;
    struct RTCIntersectContext *context;
    int channel;
    size_t batch;
    double *tally, *flux;
    uint64_t *steps;
} counter;

// `share` in [0, 1): of all the light of this channel.
static void start_photon(const job *j, int channel, double share, photon *p)
{
    double want = share * j->power[channel];
    size_t l = 0;
    for (; l + 1 < j->emitter_count; ++l)
    {
        const double power = j->emitters[l].power * j->emitters[l].light->color[channel];
        if (want < power)
            break;
        want -= power;
    }
    const emitter *const e = &j->emitters[l];
    p->weight = j->power[channel] / (double)(j->per_batch * j->batches);
    if (e->light->kind == WALK_BEAM)
        start_beam(j->s, j->medium->eta, e, p);
    else
        start_on_surface(j->s, j->medium->eta, e, want / e->light->color[channel], p);
}

// At the boundary, from inside: Fresnel decides by chance whether all of the photon leaves or is reflected, so that
// weights are lost to absorption alone. 1 where it left.
static int meet_boundary(counter *c, photon *p, size_t triangle)
{
    const walk_options *const o = c->j->options;
    const double *const n = c->j->s->plane + 3 * triangle;
    const double cosine = fmin(1.0, dot(p->d, n));
    p->from = triangle;
    if (uniform(&p->random) >= lit_transmittance(cosine, 1.0 / c->j->medium->eta))
    {
        along(p->d, n, -2.0 * cosine, p->d);
        normalize(p->d);
        return 0;
    }
    c->tally[LEFT] += p->weight;
    if (c->flux != NULL)
        c->flux[o->patches[triangle]] += p->weight;
    if (o->exit != NULL)
    {
        double x[3];
        along(p->x, c->j->s->middle, 1.0, x);
        o->exit(o->exit_context, c->batch, c->channel, x, triangle, p->weight);
    }
    return 1;
}

// 1 where it ends. Weights are in units of `full`, a photon's weight at its start.
static int scatter(counter *c, photon *p, double albedo, double full)
{
    c->tally[ABSORBED] += (1.0 - albedo) * p->weight;
    p->weight *= albedo;
    if (p->weight < ROULETTE_WEIGHT * full)
    {
        if (uniform(&p->random) * KEPT_WEIGHT * full >= p->weight)
        {
            c->tally[ROULETTE] += p->weight;
            return 1;
        }
        c->tally[ROULETTE] -= KEPT_WEIGHT * full - p->weight;
        p->weight = KEPT_WEIGHT * full;
    }
    turn(&p->random, scattering_cosine(&p->random, c->j->medium->g), p->d);
    return 0;
}

static void walk_photon(counter *c, photon *p)
{
    const walk_medium *const m = c->j->medium;
    const double sigma_t = m->sigma_s[c->channel] + m->sigma_a[c->channel];
    const double albedo = sigma_t > 0.0 ? m->sigma_s[c->channel] / sigma_t : 0.0, full = p->weight;
    const uint64_t most = c->j->options->scatterings_max;
    for (uint64_t scatterings = 0; most == 0 || scatterings < most;)
    {
        const double flight = sigma_t > 0.0 ? -log(uniform(&p->random)) / sigma_t : HUGE_VAL;
        hit what = HIT_NONE;
        size_t triangle = 0;
        double t = flight;
        if (c->j->options->every_ray || flight >= clearance(c->j->s, p->x))
        {
            what = cast(c->j->s, c->context, p->x, p->d, flight, p->from, &triangle, &t);
            ++c->steps[1];
        }
        t = what == HIT_FACE ? t : flight;
        along(p->x, p->d, t, p->x);
        // Out through a crack, it would scatter outside for ever.
        if (what == HIT_LOST || (what == HIT_NONE && (flight == HUGE_VAL || outside_box(c->j->s, p->x))))
        {
            c->tally[LOST] += p->weight;
            return;
        }
        c->tally[PATH] += p->weight * t;
        if (what == HIT_FACE)
        {
            if (meet_boundary(c, p, triangle))
                return;
            continue;
        }
        p->from = SIZE_MAX;
        ++c->steps[0];
        ++scatterings;
        if (scatter(c, p, albedo, full))
            return;
    }
    c->tally[CUT] += p->weight;
}

static void run_batch(const job *j, int channel, size_t batch)
{
    const size_t at = (size_t)channel * j->batches + batch;
    struct RTCIntersectContext context;
    counter c = {j, &context, channel, batch, j->tally + at * TALLIES, NULL, j->steps + at * 2};
    rtcInitIntersectContext(&context);
    if (j->options->patches != NULL)
        c.flux = j->flux + at * j->options->patch_count;
    for (uint64_t i = 0; i < j->per_batch; ++i)
    {
        photon p;
        memset(&p, 0, sizeof p);
        p.random = random_start(j->options->seed, (uint64_t)channel, (uint64_t)batch * j->per_batch + i);
        // Strata of equal power: each batch spreads its photons evenly over the light.
        start_photon(j, channel, ((double)i + uniform(&p.random)) / (double)j->per_batch, &p);
        walk_photon(&c, &p);
    }
}

static void run_batches(void *context, size_t begin, size_t end)
{
    const job *const j = (const job *)context;
    const size_t first = (size_t)j->options->channel_first;
    for (size_t i = begin; i < end; ++i)
    {
        const int channel = (int)(first + i / j->batches);
        if (j->power[channel] > 0.0)
            run_batch(j, channel, i % j->batches);
    }
}

// ---- Results ----

// The sum of the batches' samples, and its standard error.
static walk_total total(const double *samples, size_t stride, size_t batches)
{
    walk_total out = {0.0, 0.0};
    double squares = 0.0;
    for (size_t b = 0; b < batches; ++b)
        out.value += samples[b * stride];
    for (size_t b = 0; b < batches; ++b)
    {
        const double away = samples[b * stride] - out.value / (double)batches;
        squares += away * away;
    }
    out.error = sqrt(squares * (double)batches / (double)(batches - 1));
    return out;
}

static void patch_results(const job *j, walk_result *out)
{
    const size_t P = out->patch_count;
    for (size_t t = 0; P > 0 && t < j->s->T; ++t)
    {
        const size_t patch = j->options->patches[t];
        out->area[patch] += j->s->area[t];
        for (size_t l = 0; l < j->emitter_count; ++l)
        {
            const emitter *const e = &j->emitters[l];
            const double power = e->summed == NULL ? 0.0 : e->summed[t] - (t > 0 ? e->summed[t - 1] : 0.0);
            for (size_t k = 0; k < 3; ++k)
                out->E[3 * patch + k] += power * e->light->color[k];
        }
    }
    for (size_t i = 0; i < 3 * P; ++i)
    {
        const size_t k = i % 3, patch = i / 3;
        const double area = out->area[patch] > 0.0 ? out->area[patch] : 1.0; // none: nothing leaves there either
        const walk_total flux = total(j->flux + k * j->batches * P + patch, P, j->batches);
        out->E[i] /= area;
        out->B[i] = flux.value / area;
        out->B_error[i] = flux.error / area;
    }
}

static void channel_results(const job *j, int k, walk_result *out)
{
    const double *const tally = j->tally + (size_t)k * j->batches * TALLIES;
    walk_total *const totals[TALLIES] = {&out->left[k], &out->absorbed[k], &out->lost[k],
                                         &out->cut[k],  &out->roulette[k], &out->path[k]};
    for (size_t i = 0; i < TALLIES; ++i)
        *totals[i] = total(tally + i, TALLIES, j->batches);
    out->entered[k] = j->power[k];
    if (j->power[k] > 0.0)
    {
        out->path[k].value /= j->power[k];
        out->path[k].error /= j->power[k];
        out->photons[k] = j->per_batch * j->batches;
    }
    for (size_t l = 0; l < j->emitter_count; ++l)
        out->specular[k] += j->emitters[l].specular * j->emitters[l].light->color[k];
    for (size_t b = 0; b < j->batches; ++b)
    {
        out->scatterings[k] += j->steps[((size_t)k * j->batches + b) * 2];
        out->rays[k] += j->steps[((size_t)k * j->batches + b) * 2 + 1];
    }
}

static int allocate(job *j, walk_result *out)
{
    const size_t P = j->options->patches != NULL ? j->options->patch_count : 0;
    j->tally = (double *)calloc(3 * j->batches * TALLIES, sizeof *j->tally);
    j->steps = (uint64_t *)calloc(3 * j->batches * 2, sizeof *j->steps);
    j->flux = (double *)calloc(3 * j->batches * P + 1, sizeof *j->flux);
    out->patch_count = P;
    out->area = (double *)calloc(P + 1, sizeof *out->area);
    out->E = (double *)calloc(3 * P + 1, sizeof *out->E);
    out->B = (double *)calloc(3 * P + 1, sizeof *out->B);
    out->B_error = (double *)calloc(3 * P + 1, sizeof *out->B_error);
    return j->tally == NULL || j->steps == NULL || j->flux == NULL || out->area == NULL || out->E == NULL ||
           out->B == NULL || out->B_error == NULL;
}

static int make_emitters(job *j, const walk_light *lights, size_t light_count)
{
    j->emitters = (emitter *)calloc(light_count, sizeof *j->emitters);
    j->emitter_count = light_count;
    if (j->emitters == NULL)
        return 1;
    for (size_t l = 0; l < light_count; ++l)
    {
        if (make_emitter(j->s, j->medium->eta, &lights[l], &j->emitters[l]) != 0)
            return 1;
        for (int k = 0; k < 3; ++k)
            j->power[k] += j->emitters[l].power * lights[l].color[k];
    }
    return 0;
}

// Every comparison fails for what is not a number.
static int usable(const walk_scene *s, const walk_medium *m, size_t light_count, const walk_options *o)
{
    int good = s != NULL && m->g > -1.0 && m->g < 1.0 && m->eta > 0.0 && m->eta <= 10.0 && light_count > 0;
    for (int k = 0; k < 3; ++k)
        good = good && m->sigma_s[k] >= 0.0 && m->sigma_a[k] >= 0.0 && m->sigma_s[k] + m->sigma_a[k] < HUGE_VAL;
    good = good && o->photons > 0 && (o->batches == 0 || o->batches >= BATCHES_MIN);
    good = good && o->channel_first >= 0 && o->channel_count >= 0 && o->channel_first + o->channel_count <= 3;
    for (size_t t = 0; good && o->patches != NULL && t < s->T; ++t)
        good = o->patches[t] < o->patch_count;
    return good;
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int walk_run(const walk_scene *scene, const walk_medium *medium, const walk_light *lights, size_t light_count,
             const walk_options *options, walk_result *out)
{
    const double start = seconds();
    job j;
    memset(out, 0, sizeof *out);
    memset(&j, 0, sizeof j);
    if (!usable(scene, medium, light_count, options))
        return 1;
    j.s = scene;
    j.medium = medium;
    j.options = options;
    j.batches = options->batches > 0 ? options->batches : BATCHES;
    j.per_batch = (options->photons + j.batches - 1) / j.batches;
    int failed = allocate(&j, out) || make_emitters(&j, lights, light_count);
    failed = failed || !(j.power[0] + j.power[1] + j.power[2] > 0.0);
    if (!failed)
    {
        const int channels = options->channel_count > 0 ? options->channel_count : 3 - options->channel_first;
        const size_t tasks = (size_t)channels * j.batches;
        if (options->hooks != NULL && options->hooks->parallel_for != NULL)
            options->hooks->parallel_for(options->hooks->user, tasks, run_batches, &j);
        else
            run_batches(&j, 0, tasks);
        for (int k = options->channel_first; k < options->channel_first + channels; ++k)
            channel_results(&j, k, out);
        patch_results(&j, out);
        out->seconds = seconds() - start;
    }
    else
        walk_result_free(out);
    free_emitters(j.emitters, j.emitter_count);
    free(j.tally);
    free(j.steps);
    free(j.flux);
    return failed;
}

void walk_result_free(walk_result *result)
{
    free(result->area);
    free(result->E);
    free(result->B);
    free(result->B_error);
    memset(result, 0, sizeof *result);
}
