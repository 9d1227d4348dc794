// Patches of walk.h.

#include "walk.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum
{
    ROUNDS = 6 // of Lloyd's iteration
};

#define NONE UINT32_MAX

typedef struct entry
{
    double distance;
    uint32_t triangle;
} entry;

typedef struct grower
{
    size_t T, count;
    double *middle;       // [T][3] mesh units
    double *area;         // [T]
    uint32_t *neighbours; // [T][3], NONE where there is none
    uint32_t *patch;      // [T]
    double *distance;     // [T]
    uint32_t *seeds;      // [count]
    entry *heap;          // [3 T + count]
    size_t heap_count;
} grower;

// ---- Which triangles share an edge ----

typedef struct corner
{
    float x[3];
    uint32_t vertex;
} corner;

static int by_position(const void *a, const void *b)
{
    const corner *const p = (const corner *)a, *const q = (const corner *)b;
    for (int i = 0; i < 3; ++i)
    {
        if (p->x[i] != q->x[i])
            return p->x[i] < q->x[i] ? -1 : 1;
    }
    return 0;
}

// first [V]: one vertex for all that share a position.
static int weld(const sss_mesh *mesh, uint32_t *first)
{
    const size_t V = mesh->vertex_count;
    corner *const order = (corner *)malloc(V * sizeof *order + 1);
    if (order == NULL)
        return 1;
    for (size_t v = 0; v < V; ++v)
    {
        memcpy(order[v].x, mesh->positions + 3 * v, sizeof order[v].x);
        order[v].vertex = (uint32_t)v;
    }
    qsort(order, V, sizeof *order, by_position);
    for (size_t v = 0; v < V; ++v)
    {
        const int same = v > 0 && by_position(&order[v - 1], &order[v]) == 0;
        first[order[v].vertex] = same ? first[order[v - 1].vertex] : order[v].vertex;
    }
    free(order);
    return 0;
}

typedef struct edge
{
    uint32_t low, high, triangle, slot;
} edge;

static int by_ends(const void *a, const void *b)
{
    const edge *const e = (const edge *)a, *const f = (const edge *)b;
    if (e->low != f->low)
        return e->low < f->low ? -1 : 1;
    if (e->high != f->high)
        return e->high < f->high ? -1 : 1;
    return (e->triangle > f->triangle) - (e->triangle < f->triangle);
}

static void list_edges(const sss_mesh *mesh, const uint32_t *first, edge *edges)
{
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i)
    {
        const uint32_t a = first[mesh->triangles[i]], b = first[mesh->triangles[i / 3 * 3 + (i + 1) % 3]];
        edges[i].low = a < b ? a : b;
        edges[i].high = a < b ? b : a;
        edges[i].triangle = (uint32_t)(i / 3);
        edges[i].slot = (uint32_t)(i % 3);
    }
}

static int find_neighbours(const sss_mesh *mesh, grower *g)
{
    const size_t count = 3 * g->T;
    uint32_t *const first = (uint32_t *)malloc(mesh->vertex_count * sizeof *first);
    edge *const edges = (edge *)malloc(count * sizeof *edges);
    const int failed = first == NULL || edges == NULL || weld(mesh, first) != 0;
    if (!failed)
    {
        list_edges(mesh, first, edges);
        qsort(edges, count, sizeof *edges, by_ends);
        memset(g->neighbours, 0xff, count * sizeof *g->neighbours);
        for (size_t i = 0; i + 1 < count; ++i) // pairs of an edge that several share: each with the next
        {
            const edge *const e = &edges[i], *const f = e + 1;
            if (e->low == f->low && e->high == f->high && e->low != e->high)
            {
                g->neighbours[3 * e->triangle + e->slot] = f->triangle;
                if (g->neighbours[3 * f->triangle + f->slot] == NONE)
                    g->neighbours[3 * f->triangle + f->slot] = e->triangle;
            }
        }
    }
    free(first);
    free(edges);
    return failed;
}

// ---- Growing: Dijkstra from all seeds at once ----

static int before(const entry *a, const entry *b)
{
    return a->distance != b->distance ? a->distance < b->distance : a->triangle < b->triangle;
}

static void push(grower *g, double distance, uint32_t triangle)
{
    size_t i = g->heap_count++;
    const entry e = {distance, triangle};
    for (; i > 0 && before(&e, &g->heap[(i - 1) / 2]); i = (i - 1) / 2)
        g->heap[i] = g->heap[(i - 1) / 2];
    g->heap[i] = e;
}

static entry pop(grower *g)
{
    const entry top = g->heap[0], last = g->heap[--g->heap_count];
    size_t i = 0;
    for (size_t child = 1; child < g->heap_count; child = 2 * i + 1)
    {
        if (child + 1 < g->heap_count && before(&g->heap[child + 1], &g->heap[child]))
            ++child;
        if (!before(&g->heap[child], &last))
            break;
        g->heap[i] = g->heap[child];
        i = child;
    }
    g->heap[i] = last;
    return top;
}

static double between(const double a[3], const double b[3])
{
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

static void relax(grower *g, double distance, uint32_t triangle, uint32_t patch)
{
    if (distance < g->distance[triangle])
    {
        g->distance[triangle] = distance;
        g->patch[triangle] = patch;
        push(g, distance, triangle);
    }
}

static void grow(grower *g)
{
    for (size_t t = 0; t < g->T; ++t)
    {
        g->distance[t] = HUGE_VAL;
        g->patch[t] = NONE;
    }
    g->heap_count = 0;
    for (size_t i = 0; i < g->count; ++i)
        relax(g, 0.0, g->seeds[i], (uint32_t)i);
    while (g->heap_count > 0)
    {
        const entry e = pop(g);
        if (e.distance > g->distance[e.triangle])
            continue;
        for (size_t i = 0; i < 3; ++i)
        {
            const uint32_t next = g->neighbours[3 * e.triangle + i];
            if (next != NONE)
                relax(g, e.distance + between(g->middle + 3 * e.triangle, g->middle + 3 * next), next,
                      g->patch[e.triangle]);
        }
    }
}

// ---- Seeds ----

// Triangles in the order of a curve through space (Morton 1966); every equal share of the area along it gives one seed.
typedef struct place
{
    uint32_t code, triangle;
} place;

static int by_code(const void *a, const void *b)
{
    const place *const p = (const place *)a, *const q = (const place *)b;
    if (p->code != q->code)
        return p->code < q->code ? -1 : 1;
    return (p->triangle > q->triangle) - (p->triangle < q->triangle);
}

static uint32_t morton(const double x[3]) // in [0, 1)
{
    uint32_t code = 0;
    for (int bit = 9; bit >= 0; --bit)
        for (int i = 0; i < 3; ++i)
            code = code << 1 | ((uint32_t)(x[i] * 1024.0) >> bit & 1u);
    return code;
}

static int first_seeds(grower *g)
{
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, side = 0.0, total = 0.0, sum = 0.0;
    place *const places = (place *)malloc(g->T * sizeof *places);
    if (places == NULL)
        return 1;
    for (size_t i = 0; i < 3 * g->T; ++i)
        low[i % 3] = fmin(low[i % 3], g->middle[i]);
    for (size_t i = 0; i < 3 * g->T; ++i)
        side = fmax(side, g->middle[i] - low[i % 3]);
    for (size_t t = 0; t < g->T; ++t)
    {
        double x[3];
        for (size_t i = 0; i < 3; ++i)
            x[i] = side > 0.0 ? 0.999 * (g->middle[3 * t + i] - low[i]) / side : 0.0;
        places[t].code = morton(x);
        places[t].triangle = (uint32_t)t;
        total += g->area[t];
    }
    qsort(places, g->T, sizeof *places, by_code);
    size_t found = 0;
    for (size_t i = 0; i < g->T && found < g->count; ++i)
    {
        sum += g->area[places[i].triangle];
        if (sum >= total * ((double)found + 0.5) / (double)g->count)
            g->seeds[found++] = places[i].triangle;
    }
    g->count = found;
    free(places);
    return 0;
}

// The triangle of each patch that is nearest its centre of area. `sums` [count][4].
static void move_seeds(grower *g, double *sums)
{
    memset(sums, 0, 4 * g->count * sizeof *sums);
    for (size_t t = 0; t < g->T; ++t)
    {
        for (size_t i = 0; i < 3 && g->patch[t] != NONE; ++i)
            sums[4 * g->patch[t] + i] += g->area[t] * g->middle[3 * t + i];
        if (g->patch[t] != NONE)
            sums[4 * g->patch[t] + 3] += g->area[t];
    }
    for (size_t i = 0; i < 4 * g->count; ++i)
        sums[i] = i % 4 < 3 ? sums[i] / fmax(sums[i / 4 * 4 + 3], 1e-300) : HUGE_VAL; // the last: nearest so far
    for (size_t t = 0; t < g->T; ++t)
    {
        if (g->patch[t] == NONE)
            continue;
        double *const centre = sums + 4 * g->patch[t], distance = between(centre, g->middle + 3 * t);
        if (distance < centre[3])
        {
            centre[3] = distance;
            g->seeds[g->patch[t]] = (uint32_t)t;
        }
    }
}

// What no seed reached (a component without one): one patch for each.
static size_t fill_components(grower *g)
{
    size_t count = g->count;
    for (size_t t = 0; t < g->T; ++t)
    {
        if (g->patch[t] != NONE)
            continue;
        g->heap_count = 0;
        g->patch[t] = (uint32_t)count;
        push(g, 0.0, (uint32_t)t);
        while (g->heap_count > 0)
        {
            const uint32_t at = pop(g).triangle;
            for (size_t i = 0; i < 3; ++i)
            {
                const uint32_t next = g->neighbours[3 * at + i];
                if (next != NONE && g->patch[next] == NONE)
                {
                    g->patch[next] = (uint32_t)count;
                    push(g, 0.0, next);
                }
            }
        }
        ++count;
    }
    return count;
}

// ---- The call ----

static void measure_triangles(const sss_mesh *mesh, grower *g)
{
    for (size_t t = 0; t < g->T; ++t)
    {
        double p[9], n[3];
        for (size_t i = 0; i < 9; ++i)
            p[i] = (double)mesh->positions[3 * (size_t)mesh->triangles[3 * t + i / 3] + i % 3];
        for (size_t i = 0; i < 3; ++i)
        {
            const size_t j = (i + 1) % 3, k = (i + 2) % 3;
            g->middle[3 * t + i] = (p[i] + p[3 + i] + p[6 + i]) / 3.0;
            n[i] = (p[3 + j] - p[j]) * (p[6 + k] - p[k]) - (p[3 + k] - p[k]) * (p[6 + j] - p[j]);
        }
        g->area[t] = 0.5 * sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    }
}

size_t walk_patches(const sss_mesh *mesh, size_t count, uint32_t *patches)
{
    grower g;
    size_t found = 0;
    memset(&g, 0, sizeof g);
    g.T = mesh->triangle_count;
    g.count = count < g.T ? count : g.T;
    g.middle = (double *)malloc(3 * g.T * sizeof *g.middle + 1);
    g.area = (double *)malloc(g.T * sizeof *g.area + 1);
    g.neighbours = (uint32_t *)malloc(3 * g.T * sizeof *g.neighbours + 1);
    g.distance = (double *)malloc(g.T * sizeof *g.distance + 1);
    g.seeds = (uint32_t *)malloc(g.count * sizeof *g.seeds + 1);
    g.heap = (entry *)malloc((3 * g.T + g.count) * sizeof *g.heap + 1);
    g.patch = patches;
    double *const sums = (double *)malloc(4 * g.count * sizeof *sums + 1);
    if (g.middle != NULL && g.area != NULL && g.neighbours != NULL && g.distance != NULL && g.seeds != NULL &&
        g.heap != NULL && sums != NULL && g.count > 0 && find_neighbours(mesh, &g) == 0)
    {
        measure_triangles(mesh, &g);
        if (first_seeds(&g) == 0 && g.count > 0)
        {
            grow(&g);
            for (int round = 0; round < ROUNDS; ++round)
            {
                move_seeds(&g, sums);
                grow(&g);
            }
            found = fill_components(&g);
        }
    }
    free(g.middle);
    free(g.area);
    free(g.neighbours);
    free(g.distance);
    free(g.seeds);
    free(g.heap);
    free(sums);
    return found;
}

void walk_patch_means(const sss_mesh *mesh, const uint32_t *patches, size_t patch_count, const float *values,
                      double *means, double *area)
{
    double *const sums = (double *)calloc(patch_count + 1, sizeof *sums);
    const double mm2 = mesh->mm_per_unit * mesh->mm_per_unit;
    memset(means, 0, 3 * patch_count * sizeof *means);
    for (size_t t = 0; t < mesh->triangle_count && sums != NULL; ++t)
    {
        const uint32_t *const c = mesh->triangles + 3 * t;
        double e[2][3], n2 = 0.0;
        for (size_t i = 0; i < 3; ++i)
        {
            const double x = (double)mesh->positions[3 * (size_t)c[0] + i];
            e[0][i] = (double)mesh->positions[3 * (size_t)c[1] + i] - x;
            e[1][i] = (double)mesh->positions[3 * (size_t)c[2] + i] - x;
        }
        for (size_t i = 0; i < 3; ++i)
        {
            const double n = e[0][(i + 1) % 3] * e[1][(i + 2) % 3] - e[0][(i + 2) % 3] * e[1][(i + 1) % 3];
            n2 += n * n;
        }
        const double share = 0.5 * sqrt(n2) * mm2;
        sums[patches[t]] += share;
        for (size_t k = 0; k < 9; ++k)
            means[3 * patches[t] + k % 3] += share * (double)values[3 * (size_t)c[k / 3] + k % 3] / 3.0;
    }
    for (size_t p = 0; p < patch_count && sums != NULL; ++p)
    {
        for (size_t k = 0; k < 3; ++k)
            means[3 * p + k] = sums[p] > 0.0 ? means[3 * p + k] / sums[p] : 0.0;
        if (area != NULL)
            area[p] = sums[p];
    }
    free(sums);
}
