#include "models.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

static int allocate(size_t vertices, size_t triangles, mesh_data *out)
{
    memset(out, 0, sizeof *out);
    out->positions = (float *)malloc(3 * vertices * sizeof(float));
    out->normals = (float *)calloc(3 * vertices, sizeof(float));
    out->triangles = (uint32_t *)malloc(3 * triangles * sizeof(uint32_t));
    out->triangle_count = triangles;
    if (!out->positions || !out->normals || !out->triangles)
    {
        mesh_free(out);
        return 1;
    }
    return 0;
}

// ---- the base: on the unit sphere, or for the cube on the cube over [-1,1]^3 ----

static void add_vertex(mesh_data *m, double x, double y, double z)
{
    float *const p = m->positions + 3 * m->vertex_count++;
    p[0] = (float)x;
    p[1] = (float)y;
    p[2] = (float)z;
}

static void set_triangle(mesh_data *m, size_t triangle, size_t a, size_t b, size_t c)
{
    m->triangles[3 * triangle] = (uint32_t)a;
    m->triangles[3 * triangle + 1] = (uint32_t)b;
    m->triangles[3 * triangle + 2] = (uint32_t)c;
}

static void add_ring(mesh_data *m, model_shape shape, size_t sectors, double share)
{
    const double theta = PI * share; // from the north pole
    for (size_t s = 0; s < sectors; ++s)
    {
        const double phi = 2.0 * PI * ((double)s + 0.5) / (double)sectors;
        const double r = shape == MODEL_CUBE ? sqrt(2.0) : sin(theta);
        const double y = shape == MODEL_CUBE ? (share < 0.5 ? 1.0 : -1.0) : cos(theta);
        add_vertex(m, r * sin(phi), y, r * cos(phi));
    }
}

static int make_base(model_shape shape, size_t sectors, size_t rings, mesh_data *out)
{
    if (allocate(2 + sectors * (rings - 1), 2 * sectors * (rings - 1), out) != 0)
    {
        return 1;
    }
    for (size_t ring = 1; ring < rings; ++ring)
    {
        add_ring(out, shape, sectors, (double)ring / (double)rings);
    }
    const size_t north = out->vertex_count, south = north + 1, last = (rings - 2) * sectors;
    add_vertex(out, 0.0, 1.0, 0.0);
    add_vertex(out, 0.0, -1.0, 0.0);
    size_t t = 0;
    for (size_t s = 0; s < sectors; ++s)
    {
        const size_t next = (s + 1) % sectors;
        set_triangle(out, t++, north, s, next);
        for (size_t ring = 0; ring + 2 < rings; ++ring)
        {
            const size_t a = ring * sectors, b = a + sectors;
            set_triangle(out, t++, a + s, b + s, a + next);
            set_triangle(out, t++, b + s, b + next, a + next);
        }
        set_triangle(out, t++, south, last + next, last + s);
    }
    return 0;
}

// ---- 4-to-1 splits ----

typedef struct edge_map
{
    uint32_t *ends; // [size][2], UINT32_MAX where free
    uint32_t *middle;
    size_t size;    // a power of two
} edge_map;

static int edge_map_create(size_t triangles, edge_map *map)
{
    for (map->size = 64; map->size < 3 * triangles; map->size *= 2) // half as many edges as corners
    {
    }
    map->ends = (uint32_t *)malloc(2 * map->size * sizeof(uint32_t));
    map->middle = (uint32_t *)malloc(map->size * sizeof(uint32_t));
    if (!map->ends || !map->middle)
    {
        return 1;
    }
    memset(map->ends, 0xff, 2 * map->size * sizeof(uint32_t));
    return 0;
}

static void edge_map_free(edge_map *map)
{
    free(map->ends);
    free(map->middle);
}

// The vertex in the middle of an edge, made when the first of its triangles asks.
static uint32_t middle_of(edge_map *map, model_shape shape, mesh_data *m, uint32_t a, uint32_t b)
{
    const uint32_t low = a < b ? a : b, high = a < b ? b : a;
    size_t slot = ((size_t)low * 2654435761u ^ (size_t)high * 40503u) & (map->size - 1);
    while (map->ends[2 * slot] != UINT32_MAX && (map->ends[2 * slot] != low || map->ends[2 * slot + 1] != high))
    {
        slot = (slot + 1) & (map->size - 1);
    }
    if (map->ends[2 * slot] == UINT32_MAX)
    {
        double p[3], length = 0.0;
        for (size_t k = 0; k < 3; ++k)
        {
            p[k] = 0.5 * ((double)m->positions[3 * a + k] + (double)m->positions[3 * b + k]);
            length += p[k] * p[k];
        }
        length = shape == MODEL_CUBE ? 1.0 : sqrt(length); // the others stay on the sphere
        map->ends[2 * slot] = low;
        map->ends[2 * slot + 1] = high;
        map->middle[slot] = (uint32_t)m->vertex_count;
        add_vertex(m, p[0] / length, p[1] / length, p[2] / length);
    }
    return map->middle[slot];
}

static int split(model_shape shape, mesh_data *m)
{
    mesh_data finer;
    edge_map map;
    memset(&map, 0, sizeof map);
    // A closed surface has 3/2 T edges.
    int failed = allocate(m->vertex_count + m->triangle_count * 3 / 2, 4 * m->triangle_count, &finer) != 0 ||
                 edge_map_create(m->triangle_count, &map) != 0;
    if (!failed)
    {
        memcpy(finer.positions, m->positions, 3 * m->vertex_count * sizeof(float));
        finer.vertex_count = m->vertex_count;
    }
    for (size_t t = 0; t < m->triangle_count && !failed; ++t)
    {
        const uint32_t *const v = m->triangles + 3 * t;
        const uint32_t ab = middle_of(&map, shape, &finer, v[0], v[1]), bc = middle_of(&map, shape, &finer, v[1], v[2]),
                       ca = middle_of(&map, shape, &finer, v[2], v[0]);
        set_triangle(&finer, 4 * t, v[0], ab, ca);
        set_triangle(&finer, 4 * t + 1, ab, v[1], bc);
        set_triangle(&finer, 4 * t + 2, ca, bc, v[2]);
        set_triangle(&finer, 4 * t + 3, ab, bc, ca);
    }
    edge_map_free(&map);
    mesh_free(m);
    *m = finer;
    return failed;
}

// ---- shapes ----

static void to_blob(float p[3])
{
    const double x = (double)p[0], y = (double)p[1], z = (double)p[2];
    const double r = 1.0 + 0.3 * (x * x - y * y) + 0.8 * x * y * z;
    p[0] = (float)(r * x);
    p[1] = (float)(r * y);
    p[2] = (float)(r * z);
}

static void to_candle(float p[3])
{
    const double x = (double)p[0], y = (double)p[1], z = (double)p[2];
    const double r2 = x * x + z * z;
    const double stretch = pow(r2 * r2 * r2 * r2 + pow(y, 8.0), -1.0 / 8.0); // to the rounded cylinder r^8 + y^8 = 1
    const double r = sqrt(r2) * stretch;
    const double hollow = y > 0.0 ? pow(fmax(0.0, 1.0 - r * r), 2.0) : 0.0;
    p[0] = (float)(x * stretch);
    p[1] = (float)(2.0 * y * stretch - 0.8 * hollow);
    p[2] = (float)(z * stretch);
}

int model_subdivided(model_shape shape, size_t sectors, size_t rings, int levels, mesh_data *out)
{
    int failed = make_base(shape, sectors, rings, out);
    for (int level = 0; level < levels && !failed; ++level)
    {
        failed = split(shape, out);
    }
    if (failed)
    {
        return 1;
    }
    for (size_t v = 0; v < out->vertex_count; ++v)
    {
        if (shape == MODEL_BLOB) to_blob(out->positions + 3 * v);
        if (shape == MODEL_CANDLE) to_candle(out->positions + 3 * v);
    }
    mesh_compute_normals(out);
    return 0;
}
