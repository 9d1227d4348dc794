#include "shadow.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <embree3/rtcore.h>

#include "threads.h"

// Rays start above the surface by this share of the mean length of the edges at the vertex: a shadow finer than the
// mesh is not to be had, and without the lift the facets next to a vertex blotch wherever light grazes them.
static const float LIFT = 0.5f;
static const double GOLDEN_ANGLE = 2.39996322972865332; // pi (3 - sqrt 5): spreads points evenly on a disc

struct shadow
{
    RTCDevice device;
    RTCScene scene;
    float *origins; // [vertex_count][3] lifted, in the box [-1,1]^3, so that no scale upsets single precision
    float *normals; // [vertex_count][3]
    double middle[3], scale; // into that box: scale (position - middle)
    size_t vertex_count;
    int threads;
};

// The mean length of the edges at each vertex, in the units of points; 0 where there is none.
static int mean_edges(const model *m, const float *points, float *out)
{
    float *const counts = calloc(m->vertex_count, sizeof *counts);
    if (!counts)
    {
        return -1;
    }
    memset(out, 0, m->vertex_count * sizeof *out);
    for (size_t i = 0; i < 3 * m->triangle_count; ++i)
    {
        const uint32_t a = m->triangles[i], b = m->triangles[i % 3 == 2 ? i - 2 : i + 1];
        const float x = points[3 * a] - points[3 * b], y = points[3 * a + 1] - points[3 * b + 1],
                    z = points[3 * a + 2] - points[3 * b + 2];
        const float length = sqrtf(x * x + y * y + z * z);
        out[a] += length;
        out[b] += length;
        counts[a] += 1.0f;
        counts[b] += 1.0f;
    }
    for (size_t i = 0; i < m->vertex_count; ++i)
    {
        out[i] = counts[i] > 0.0f ? out[i] / counts[i] : 0.0f;
    }
    free(counts);
    return 0;
}

static void into_unit_box(shadow *s, const model *m, float *points)
{
    double low[3], high[3];
    const double extent = model_bounds(m, low, high);
    s->scale = extent > 0.0 ? 2.0 / extent : 0.0;
    for (size_t k = 0; k < 3; ++k)
    {
        s->middle[k] = 0.5 * (low[k] + high[k]);
    }
    for (size_t i = 0; i < 3 * m->vertex_count; ++i)
    {
        points[i] = (float)(s->scale * ((double)m->positions[i] - s->middle[i % 3]));
    }
}

static int build(shadow *s, const model *m, const float *points)
{
    RTCGeometry geometry = rtcNewGeometry(s->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *const vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                    3 * sizeof(float), m->vertex_count);
    unsigned *const indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                      3 * sizeof(unsigned), m->triangle_count);
    if (vertices && indices)
    {
        memcpy(vertices, points, 3 * m->vertex_count * sizeof *vertices);
        memcpy(indices, m->triangles, 3 * m->triangle_count * sizeof *indices);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(s->scene, geometry);
        rtcSetSceneFlags(s->scene, RTC_SCENE_FLAG_ROBUST);
        rtcCommitScene(s->scene);
    }
    rtcReleaseGeometry(geometry);
    return vertices && indices && rtcGetDeviceError(s->device) == RTC_ERROR_NONE ? 0 : -1;
}

static int fill(shadow *s, const model *m)
{
    float *const edges = malloc(m->vertex_count * sizeof *edges);
    s->origins = malloc(3 * m->vertex_count * sizeof *s->origins);
    s->normals = malloc(3 * m->vertex_count * sizeof *s->normals);
    if (!edges || !s->origins || !s->normals)
    {
        free(edges);
        return -1;
    }
    memcpy(s->normals, m->normals, 3 * m->vertex_count * sizeof *s->normals);
    into_unit_box(s, m, s->origins);
    const int failed = build(s, m, s->origins) != 0 || mean_edges(m, s->origins, edges) != 0;
    for (size_t i = 0; i < 3 * m->vertex_count && !failed; ++i)
    {
        s->origins[i] += LIFT * edges[i / 3] * s->normals[i];
    }
    free(edges);
    return failed ? -1 : 0;
}

shadow *shadow_create(const model *m, int threads, char *error_text, size_t error_size)
{
    char configuration[32];
    snprintf(configuration, sizeof configuration, "threads=%d", threads);
    shadow *const s = calloc(1, sizeof *s);
    if (s)
    {
        s->vertex_count = m->vertex_count;
        s->threads = threads;
        s->device = rtcNewDevice(configuration);
        s->scene = s->device ? rtcNewScene(s->device) : NULL;
    }
    if (!s || !s->scene || fill(s, m) != 0)
    {
        snprintf(error_text, error_size, "shadows: %s", s && !s->device ? "Embree does not start" : "out of memory");
        shadow_free(s);
        return NULL;
    }
    return s;
}

void shadow_free(shadow *s)
{
    if (s)
    {
        if (s->scene)
        {
            rtcReleaseScene(s->scene);
        }
        if (s->device)
        {
            rtcReleaseDevice(s->device);
        }
        free(s->origins);
        free(s->normals);
        free(s);
    }
}

typedef struct cast
{
    const shadow *s;
    float targets[SHADOW_SAMPLES][3]; // points in the box, or one direction
    int count, is_direction;
    float *visibility;
} cast;

// Whether a ray from a vertex gets there; 0 where the vertex faces away.
static int sees(const cast *c, struct RTCIntersectContext *rays, size_t vertex, const float target[3])
{
    const float *const o = c->s->origins + 3 * vertex, *const n = c->s->normals + 3 * vertex;
    float d[3];
    for (int k = 0; k < 3; ++k)
    {
        d[k] = c->is_direction ? target[k] : target[k] - o[k];
    }
    if (!(n[0] * d[0] + n[1] * d[1] + n[2] * d[2] > 0.0f))
    {
        return 0;
    }
    struct RTCRay ray = {.org_x = o[0], .org_y = o[1], .org_z = o[2], .dir_x = d[0], .dir_y = d[1], .dir_z = d[2],
                         .tnear = 0.0f, .tfar = c->is_direction ? FLT_MAX : 1.0f, .mask = 0xffffffffu};
    rtcOccluded1(c->s->scene, rays, &ray);
    return !(ray.tfar < 0.0f); // Embree marks a hit by -infinity
}

static void cast_range(void *context, size_t begin, size_t end)
{
    const cast *const c = context;
    struct RTCIntersectContext rays;
    rtcInitIntersectContext(&rays);
    for (size_t v = begin; v < end; ++v)
    {
        int seen = 0;
        for (int i = 0; i < c->count; ++i)
        {
            seen += sees(c, &rays, v, c->targets[i]);
        }
        c->visibility[v] = (float)seen / (float)c->count;
    }
}

void shadow_visibility(const shadow *s, const double direction[3], float *visibility)
{
    const double length = sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    cast c = {.s = s, .count = 1, .is_direction = 1, .visibility = visibility};
    for (int k = 0; k < 3; ++k)
    {
        c.targets[0][k] = (float)(direction[k] / length);
    }
    threads_parallel_for(s->threads, s->vertex_count, cast_range, &c);
}

void shadow_visibility_disc(const shadow *s, const double middle[3], double radius, int samples, float *visibility)
{
    cast c = {.s = s, .count = samples, .visibility = visibility};
    for (int i = 0; i < samples; ++i)
    {
        const double r = radius * sqrt((i + 0.5) / samples), phi = GOLDEN_ANGLE * i;
        const double p[3] = {middle[0] + r * cos(phi), middle[1], middle[2] + r * sin(phi)};
        for (int k = 0; k < 3; ++k)
        {
            c.targets[i][k] = (float)(s->scale * (p[k] - s->middle[k]));
        }
    }
    threads_parallel_for(s->threads, s->vertex_count, cast_range, &c);
}
