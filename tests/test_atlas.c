// Tests of sss_atlas.h. Oracles, named at each test: exact geometry of integers in the plane and clipped polygons in
// double (tests/common/flat.h), topology of the mesh found anew here, closed forms, the definitions of Sander et al.
// 2001 and of Lensch et al. 2002 (sections 5.1 and 5.2), orders of convergence. None comes from the code under test.
// What the GPU rasterises is compared in tests/test_glsl.c.
//
// In the order of the header: charts and the split mesh; laying flat; packing; texels; borders and seams; quality;
// options; keeping; then conduct under bad input, failing allocation and cancelling; then the models, and speed.

#define SSS_ATLAS_IMPLEMENTATION
#include "../sss_atlas.h"

#include "common/bytes.h"
#include "common/flat.h"
#include "common/hooks.h"
#include "common/meshes.h"
#include "common/numbers.h"
#include "common/test.h"
#include "common/version.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define PI 3.14159265358979323846
#define COUNT(array) (sizeof(array) / sizeof *(array))
#define UNITS 16777216 // texture coordinates are multiples of 1/UNITS
#define NONE UINT32_MAX

// ============================================== Common helpers ==============================================

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross3(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; ++k)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static double length3(const double a[3])
{
    return sqrt(dot3(a, a));
}

static double distance3(const double a[3], const double b[3])
{
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return length3(d);
}

// Seconds of the processor, since the machine may be shared; everything timed here runs on one thread.
static double cpu_seconds(void)
{
    return (double)clock() / (double)CLOCKS_PER_SEC;
}

static size_t next_corner(size_t c)
{
    return c % 3 == 2 ? c - 2 : c + 1;
}

// A mesh, its atlas, and everything that the atlas hands out. A copy may have arrays replaced: a mutant.
typedef struct fixture
{
    mesh_data mesh;
    sss_mesh view;
    sss_atlas *atlas;
    sss_atlas_mesh m;
    sss_atlas_texels x;
    sss_atlas_stats s;
    size_t T, V;
    double extent;  // in the mesh's units
    double seconds; // of create
} fixture;

static void fixture_free(fixture *f)
{
    sss_atlas_free(f->atlas);
    mesh_free(&f->mesh);
    memset(f, 0, sizeof *f);
}

// Takes the mesh over. Nonzero where there is no atlas: then there is nothing to be freed.
static int fixture_make(fixture *f, mesh_data *mesh, const sss_atlas_options *options, const sss_hooks *hooks)
{
    sss_result result;
    memset(f, 0, sizeof *f);
    f->mesh = *mesh;
    memset(mesh, 0, sizeof *mesh);
    f->view = mesh_view(&f->mesh, 10.0);
    f->T = f->mesh.triangle_count;
    f->V = f->mesh.vertex_count;
    f->extent = mesh_extent(&f->mesh);
    const double start = cpu_seconds();
    result = sss_atlas_create(&f->view, options, hooks, &f->atlas);
    f->seconds = cpu_seconds() - start;
    if (result == SSS_OK && sss_atlas_get_mesh(f->atlas, &f->m) == SSS_OK &&
        sss_atlas_get_texels(f->atlas, &f->x) == SSS_OK && sss_atlas_get_stats(f->atlas, &f->s) == SSS_OK)
        return 0;
    test_note("no atlas: %s", sss_result_string(result));
    fixture_free(f);
    return 1;
}

static sss_atlas_options options_of(size_t size, sss_atlas_method method)
{
    sss_atlas_options o;
    memset(&o, 0, sizeof o);
    o.size = size;
    o.method = method;
    return o;
}

static const char *const method_names[3] = {"orthographic", "area", "convex"};

// A closed torus, on which no direction sees all of a part.
static void torus_point(double s, double t, double out[3])
{
    const double a = 2.0 * PI * s, b = 2.0 * PI * t, r = 1.0 + 0.4 * cos(b);
    out[0] = s == 1.0 ? 1.0 + 0.4 * (t == 1.0 ? 1.0 : cos(b)) : r * cos(a);
    out[1] = s == 1.0 ? 0.0 : r * sin(a);
    out[2] = t == 1.0 ? 0.0 : 0.4 * sin(b);
    out[0] = t == 1.0 ? (s == 1.0 ? 1.4 : 1.4 * cos(a)) : out[0];
    out[1] = t == 1.0 ? (s == 1.0 ? 0.0 : 1.4 * sin(a)) : out[1];
}

static int closed_torus(int n, int m, mesh_data *out)
{
    mesh_data sheet;
    if (mesh_sheet(n, m, torus_point, &sheet) != 0)
        return 1;
    const int result = mesh_weld(&sheet, out);
    mesh_free(&sheet);
    return result;
}

static int thinned_bunny(double factor, mesh_data *out)
{
    mesh_data bunny;
    if (mesh_load_bunny(&bunny) != 0)
        return 1;
    const int result = mesh_decimate(&bunny, factor, out);
    mesh_free(&bunny);
    return result;
}

// Loaded when first asked for; copies are handed out.
static mesh_data g_bunny;

static int whole_bunny(mesh_data *out)
{
    if (g_bunny.positions == NULL && mesh_load_bunny(&g_bunny) != 0)
        return 1;
    return mesh_copy(&g_bunny, out);
}

// The small closed meshes that most tests look at.
enum
{
    SMALL_MESHES = 3
};
static const char *const small_names[SMALL_MESHES] = {"sphere", "torus", "thinned bunny"};

static int small_mesh(int which, mesh_data *out)
{
    return which == 0   ? mesh_closed_sphere(4, 1.0, out)
           : which == 1 ? closed_torus(48, 24, out)
                        : thinned_bunny(20.0, out);
}

static const size_t small_sizes[3] = {96, 256, 333};

// Atlases of the small meshes in the three methods, made when first asked for; their sizes differ, and every other one
// is made without normals. NULL: not there.
static fixture g_small[SMALL_MESHES][3];

static const fixture *small_atlas(int which, int method)
{
    fixture *f = &g_small[which][method];
    const sss_atlas_options o = options_of(small_sizes[(which + 2 * method) % 3], (sss_atlas_method)method);
    mesh_data mesh;
    test_about("%s, %s, size %zu", small_names[which], method_names[method], o.size);
    if (f->atlas != NULL)
        return f;
    if (small_mesh(which, &mesh) != 0)
    {
        test_note("%s: not installed", small_names[which]);
        return NULL;
    }
    if ((which + method) % 2 == 1)
    {
        free(mesh.normals);
        mesh.normals = NULL;
    }
    return CHECK_EQUAL(fixture_make(f, &mesh, &o, NULL), 0) ? f : NULL;
}

static void corner_position(const fixture *f, size_t corner, double out[3])
{
    const size_t v = f->view.triangles[corner];
    for (size_t k = 0; k < 3; ++k)
        out[k] = (double)f->view.positions[3 * v + k];
}

// Twice the area times the normal, in the mesh's units.
static void triangle_cross(const fixture *f, size_t t, double out[3])
{
    double p[3][3], a[3], b[3];
    for (size_t k = 0; k < 3; ++k)
        corner_position(f, 3 * t + k, p[k]);
    for (int k = 0; k < 3; ++k)
    {
        a[k] = p[1][k] - p[0][k];
        b[k] = p[2][k] - p[0][k];
    }
    cross3(a, b, out);
}

static double triangle_mm2(const fixture *f, size_t t)
{
    double c[3];
    triangle_cross(f, t, c);
    return 0.5 * length3(c) * f->view.mm_per_unit * f->view.mm_per_unit;
}

static double surface_mm2(const fixture *f)
{
    double sum = 0.0;
    for (size_t t = 0; t < f->T; ++t)
        sum += triangle_mm2(f, t);
    return sum;
}

// Corners of a triangle in texels.
static void triangle_uv(const fixture *f, size_t t, double out[3][2])
{
    for (size_t k = 0; k < 3; ++k)
        for (size_t axis = 0; axis < 2; ++axis)
            out[k][axis] = (double)f->m.uv[2 * (size_t)f->m.triangles[3 * t + k] + axis] * (double)f->x.size;
}

static double uv_area(double p[3][2]) // signed
{
    return 0.5 * ((p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]));
}

// Corners of all triangles as integers; NULL where memory ends. To be freed.
static int64_t (*integers(const fixture *f))[2]
{
    int64_t(*xy)[2] = (int64_t(*)[2])malloc((f->m.vertex_count + 1) * sizeof *xy);
    for (size_t i = 0; xy != NULL && i < 2 * f->m.vertex_count; ++i)
        xy[i / 2][i % 2] = (int64_t)llround((double)f->m.uv[i] * UNITS);
    return xy;
}

// ================================================= 1. Charts =================================================

// ---- Topology of the mesh, found anew ----

typedef struct edge
{
    uint32_t low, high, corner;
} edge;

static int by_ends(const void *a, const void *b)
{
    const edge *x = (const edge *)a, *y = (const edge *)b;
    if (x->low != y->low)
        return x->low < y->low ? -1 : 1;
    if (x->high != y->high)
        return x->high < y->high ? -1 : 1;
    return x->corner < y->corner ? -1 : x->corner > y->corner;
}

// [3T] edges sorted so that those with the same ends are neighbours.
static edge *sorted_edges(const fixture *f)
{
    edge *edges = (edge *)malloc((3 * f->T + 1) * sizeof *edges);
    for (size_t c = 0; edges != NULL && c < 3 * f->T; ++c)
    {
        const uint32_t a = f->view.triangles[c], b = f->view.triangles[next_corner(c)];
        edges[c].low = a < b ? a : b;
        edges[c].high = a < b ? b : a;
        edges[c].corner = (uint32_t)c;
    }
    if (edges != NULL)
        qsort(edges, 3 * f->T, sizeof *edges, by_ends);
    return edges;
}

static int same_ends(const edge *a, const edge *b)
{
    return a->low == b->low && a->high == b->high;
}

// [3T] the corner whose edge is the same one from the other side; NONE on borders, where three triangles meet, where
// windings disagree, and where the ends are one vertex.
static uint32_t *twins_of(const fixture *f)
{
    edge *edges = sorted_edges(f);
    uint32_t *twin = (uint32_t *)malloc((3 * f->T + 1) * sizeof *twin);
    if (edges == NULL || twin == NULL)
    {
        free(edges);
        free(twin);
        return NULL;
    }
    memset(twin, 0xff, 3 * f->T * sizeof *twin);
    for (size_t i = 0, end; i < 3 * f->T; i = end)
    {
        for (end = i + 1; end < 3 * f->T && same_ends(&edges[i], &edges[end]);)
            ++end;
        const uint32_t a = edges[i].corner, b = end - i == 2 ? edges[i + 1].corner : 0;
        if (end - i != 2 || edges[i].low == edges[i].high || f->view.triangles[a] == f->view.triangles[b] ||
            a / 3 == b / 3)
            continue;
        twin[a] = b;
        twin[b] = a;
    }
    free(edges);
    return twin;
}

static uint32_t root_of(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

static void join(uint32_t *parent, uint32_t a, uint32_t b)
{
    parent[root_of(parent, a)] = root_of(parent, b);
}

static uint32_t *singles(size_t count)
{
    uint32_t *parent = (uint32_t *)malloc((count + 1) * sizeof *parent);
    for (size_t i = 0; parent != NULL && i < count; ++i)
        parent[i] = (uint32_t)i;
    return parent;
}

typedef struct mesh_errors
{
    size_t bad_numbers;   // charts, corners or vertices out of range, or another vertex of the mesh at a corner
    size_t empty_charts;  // without a triangle
    size_t parts;         // connected parts of charts beyond one for each
    size_t shared;        // atlas vertices in two charts, or for two fans of triangles
    size_t needless;      // atlas vertices beyond one for each fan, unused ones included
    double normal;        // largest error of chart_normal
    double deviation;     // largest angle between a triangle and the mean normal of its chart, degrees
    double beyond;        // share of the surface where it is above the limit
    double seam_mm;       // where two charts meet, each edge once
    size_t tiny_charts;   // with fewer than five triangles
} mesh_errors;

// Means of normals by area, found anew.
static void measure_normals(const fixture *f, double limit, mesh_errors *e)
{
    double whole = 0.0;
    double(*mean)[3] = (double(*)[3])calloc(f->m.chart_count + 1, sizeof *mean);
    for (size_t t = 0; t < f->T; ++t)
    {
        double c[3];
        triangle_cross(f, t, c);
        for (int k = 0; k < 3; ++k)
            mean[f->m.chart[t]][k] += c[k];
    }
    for (size_t i = 0; i < f->m.chart_count; ++i)
    {
        const double length = length3(mean[i]);
        double error = 0.0;
        for (size_t k = 0; k < 3; ++k)
        {
            mean[i][k] = length > 0.0 ? mean[i][k] / length : 0.0;
            error += pow(mean[i][k] - (double)f->m.chart_normal[3 * i + k], 2.0);
        }
        keep_worst(&e->normal, sqrt(error));
    }
    for (size_t t = 0; t < f->T; ++t)
    {
        double c[3];
        triangle_cross(f, t, c);
        const double length = length3(c);
        if (!(length > 0.0))
            continue;
        const double angle = 180.0 / PI * acos(fmin(1.0, dot3(c, mean[f->m.chart[t]]) / length));
        keep_worst(&e->deviation, angle);
        whole += length;
        e->beyond += angle > limit ? length : 0.0;
    }
    e->beyond /= whole > 0.0 ? whole : 1.0;
    free(mean);
}

// Atlas vertices against fans: corners of one chart joined across inner edges.
static void measure_splits(const fixture *f, const uint32_t *twin, mesh_errors *e)
{
    uint32_t *fan = singles(3 * f->T), *of_vertex = (uint32_t *)malloc((f->m.vertex_count + 1) * sizeof *of_vertex);
    unsigned char *used = (unsigned char *)calloc(f->m.vertex_count + 1, 1);
    size_t fans = 0;
    for (size_t c = 0; c < 3 * f->T; ++c)
        if (twin[c] != NONE && f->m.chart[c / 3] == f->m.chart[twin[c] / 3])
        {
            join(fan, (uint32_t)c, (uint32_t)next_corner(twin[c]));
            join(fan, (uint32_t)next_corner(c), twin[c]);
        }
    memset(of_vertex, 0xff, (f->m.vertex_count + 1) * sizeof *of_vertex);
    for (size_t c = 0; c < 3 * f->T; ++c)
    {
        const uint32_t root = root_of(fan, (uint32_t)c), a = f->m.triangles[c];
        fans += root == c;
        used[a] = 1;
        if (!(triangle_mm2(f, c / 3) > 0.0))
            continue; // goes with any neighbour
        if (of_vertex[a] == NONE)
            of_vertex[a] = root;
        e->shared += of_vertex[a] != root;
    }
    e->needless = f->m.vertex_count > fans ? f->m.vertex_count - fans : 0;
    for (size_t a = 0; a < f->m.vertex_count; ++a)
        e->needless += !used[a];
    free(used);
    free(fan);
    free(of_vertex);
}

// Charts are connected across edges, of whatever kind.
static void measure_parts(const fixture *f, mesh_errors *e)
{
    edge *edges = sorted_edges(f);
    uint32_t *part = singles(f->T), *triangles = (uint32_t *)calloc(f->m.chart_count + 1, sizeof *triangles);
    size_t parts = 0;
    for (size_t i = 0; i + 1 < 3 * f->T; ++i)
        for (size_t k = i + 1; k < 3 * f->T && same_ends(&edges[i], &edges[k]) && k < i + 64; ++k)
            if (f->m.chart[edges[i].corner / 3] == f->m.chart[edges[k].corner / 3])
                join(part, edges[i].corner / 3, edges[k].corner / 3);
    for (size_t t = 0; t < f->T; ++t)
    {
        parts += root_of(part, (uint32_t)t) == t;
        ++triangles[f->m.chart[t]];
    }
    for (size_t c = 0; c < f->m.chart_count; ++c)
    {
        e->empty_charts += triangles[c] == 0;
        e->tiny_charts += triangles[c] < 5;
    }
    e->parts = parts > f->m.chart_count ? parts - f->m.chart_count : 0;
    free(edges);
    free(part);
    free(triangles);
}

static mesh_errors measure_mesh(const fixture *f, double limit)
{
    mesh_errors e;
    memset(&e, 0, sizeof e);
    for (size_t c = 0; c < 3 * f->T; ++c)
        e.bad_numbers += f->m.chart[c / 3] >= f->m.chart_count || f->m.triangles[c] >= f->m.vertex_count ||
                         f->m.vertex[f->m.triangles[c]] != f->view.triangles[c];
    e.bad_numbers += f->m.triangle_count != f->T;
    if (e.bad_numbers > 0)
        return e;
    uint32_t *twin = twins_of(f);
    measure_normals(f, limit, &e);
    measure_splits(f, twin, &e);
    measure_parts(f, &e);
    for (size_t c = 0; c < 3 * f->T; ++c)
        if (twin[c] != NONE && twin[c] > c && f->m.chart[c / 3] != f->m.chart[twin[c] / 3])
        {
            double a[3], b[3];
            corner_position(f, c, a);
            corner_position(f, next_corner(c), b);
            e.seam_mm += distance3(a, b) * f->view.mm_per_unit;
        }
    free(twin);
    return e;
}

static void check_mesh(const fixture *f)
{
    const mesh_errors e = measure_mesh(f, f->s.normal_deviation);
    CHECK_EQUAL(e.bad_numbers, 0);
    CHECK_EQUAL(e.empty_charts, 0);
    CHECK_EQUAL(e.parts, 0);
    CHECK_EQUAL(e.shared, 0);
    CHECK_EQUAL(e.needless, 0);
    CHECK_BELOW(e.normal, 1e-5);
    CHECK_EQUAL(f->s.chart_count, f->m.chart_count);
    CHECK_EQUAL(f->s.atlas_vertex_count, f->m.vertex_count);
    CHECK_EQUAL(f->s.triangle_count, f->T);
    CHECK_EQUAL(f->s.vertex_count, f->V);
}

static void charts_are_a_partition(void)
{   // Oracle: the mesh's topology, found anew: every triangle in one chart, every chart connected, a vertex for each
    // fan of triangles and no more; mean normals by area. Three meshes, three methods.
    for (int which = 0; which < SMALL_MESHES; ++which)
        for (int method = 0; method < 3; ++method)
        {
            const fixture *f = small_atlas(which, method);
            if (f == NULL)
                continue;
            check_mesh(f);
            test_note("%zu charts of %zu triangles", f->m.chart_count, f->T);
        }
}

static void normals_stay_near_the_mean(void)
{   // Oracle: angles between triangles and the mean normal of their chart. On smooth surfaces all keep to the limit; on
    // a rough one some of the surface may not.
    static const double limits[3] = {15.0, 0.0, 60.0}; // 0: 30 degrees
    for (int which = 0; which < SMALL_MESHES; ++which)
    {
        size_t charts[3] = {0, 0, 0};
        for (int i = 0; i < 3; ++i)
        {
            mesh_data mesh;
            fixture f;
            sss_atlas_options o = options_of(128, SSS_ATLAS_ORTHOGRAPHIC);
            const double limit = limits[i] > 0.0 ? limits[i] : 30.0;
            if ((which == 2 && i != 1) || small_mesh(which, &mesh) != 0)
                continue;
            o.normal_deviation = limits[i];
            test_about("%s, deviation %g", small_names[which], limit);
            if (!CHECK_EQUAL(fixture_make(&f, &mesh, &o, NULL), 0))
                continue;
            const mesh_errors e = measure_mesh(&f, limit + 1e-3);
            if (which < 2)
                CHECK_BAR_BELOW(e.deviation, limit + 1e-3, 1.1 * limit, "largest deviation from the mean, degrees");
            CHECK_BELOW(e.beyond, which < 2 ? 0.01 : 0.15);
            CHECK_REL(f.s.normal_deviation, limit, 1e-12);
            CHECK_REL(f.s.seam_mm, e.seam_mm, 1e-5);
            charts[i] = f.m.chart_count;
            fixture_free(&f);
        }
        CHECK(which == 2 || (charts[0] > charts[1] && charts[1] > charts[2] && charts[2] > 1));
    }
}

static void a_wrong_partition_is_caught(void)
{   // The measures themselves: a triangle given to a chart far away, a vertex split and one shared, another corner.
    mesh_data mesh;
    fixture f;
    const sss_atlas_options o = options_of(128, SSS_ATLAS_ORTHOGRAPHIC);
    if (mesh_closed_sphere(4, 1.0, &mesh) != 0 || fixture_make(&f, &mesh, &o, NULL) != 0)
    {
        test_note("no atlas of the sphere");
        CHECK(0);
        return;
    }
    uint32_t *chart = (uint32_t *)malloc(f.T * sizeof *chart);
    uint32_t *corner = (uint32_t *)malloc(3 * f.T * sizeof *corner);
    uint32_t *vertex = (uint32_t *)malloc((f.m.vertex_count + 1) * sizeof *vertex);
    fixture mutant = f;
    size_t t = 0, same = 1;
    memcpy(chart, f.m.chart, f.T * sizeof *chart);
    memcpy(corner, f.m.triangles, 3 * f.T * sizeof *corner);
    memcpy(vertex, f.m.vertex, f.m.vertex_count * sizeof *vertex);
    vertex[f.m.vertex_count] = f.view.triangles[0];
    mutant.m.chart = chart;
    while (t < f.T && dot3((const double[3]){f.mesh.positions[3 * (size_t)f.view.triangles[3 * t]],
                                            f.mesh.positions[3 * (size_t)f.view.triangles[3 * t] + 1],
                                            f.mesh.positions[3 * (size_t)f.view.triangles[3 * t] + 2]},
                           (const double[3]){f.m.chart_normal[0], f.m.chart_normal[1], f.m.chart_normal[2]}) > -0.9)
        ++t;
    chart[t < f.T ? t : 0] = 0;
    mesh_errors e = measure_mesh(&mutant, 30.0);
    CHECK(e.parts > 0 && e.deviation > 90.0 && e.shared > 0);
    mutant = f;
    mutant.m.triangles = corner;
    mutant.m.vertex = vertex;
    mutant.m.vertex_count = f.m.vertex_count + 1;
    corner[0] = (uint32_t)f.m.vertex_count;
    e = measure_mesh(&mutant, 30.0);
    CHECK(e.bad_numbers == 0 && e.needless > 0);
    while (same < f.m.vertex_count && (f.m.vertex[same] != f.m.vertex[f.m.triangles[0]] ||
                                       same == f.m.triangles[0]))
        ++same; // another atlas vertex of the same place, where there is one
    mutant = f;
    mutant.m.triangles = corner;
    corner[0] = f.m.triangles[1];
    CHECK(measure_mesh(&mutant, 30.0).bad_numbers > 0);
    free(chart);
    free(corner);
    free(vertex);
    fixture_free(&f);
}

// ============================================ 2. Flat and packed ============================================

typedef struct flat_errors
{
    size_t bad_numbers; // not multiples of 1/UNITS in [0, 1]
    size_t turned;      // clockwise triangles
    size_t vanished;    // with area on the surface, without in the texture
    size_t overlaps;    // pairs whose interiors meet
    double utilisation; // area of the triangles over the texture's
} flat_errors;

static flat_errors measure_flat(const fixture *f)
{
    flat_errors e;
    int64_t(*xy)[2] = integers(f);
    size_t first[2] = {0, 0};
    memset(&e, 0, sizeof e);
    for (size_t i = 0; i < 2 * f->m.vertex_count; ++i)
        e.bad_numbers += !(f->m.uv[i] >= 0.0f && f->m.uv[i] <= 1.0f) ||
                         (double)xy[i / 2][i % 2] != (double)f->m.uv[i] * UNITS;
    if (e.bad_numbers == 0)
        for (size_t t = 0; t < f->T; ++t)
        {
            const uint32_t *v = &f->m.triangles[3 * t];
            const int64_t area = flat_orient(xy[v[0]], xy[v[1]], xy[v[2]]);
            e.turned += area < 0;
            e.vanished += area == 0 && triangle_mm2(f, t) > 0.0;
            e.utilisation += 0.5 * fabs((double)area) / UNITS / UNITS;
        }
    e.overlaps = e.bad_numbers > 0 ? SIZE_MAX
                                   : flat_overlaps((const int64_t(*)[2])xy, f->m.triangles, f->T, UNITS, first);
    if (e.overlaps > 0)
        test_note("triangles %zu and %zu overlap", first[0], first[1]);
    free(xy);
    return e;
}

static flat_errors check_flat(const fixture *f)
{
    const flat_errors e = measure_flat(f);
    CHECK_EQUAL(e.bad_numbers, 0);
    CHECK_EQUAL(e.turned, 0);
    CHECK_EQUAL(e.vanished, 0);
    CHECK_EQUAL(e.overlaps, 0);
    CHECK_EQUAL(f->s.overlaps, 0);
    CHECK_REL(f->s.utilisation, e.utilisation, 1e-6);
    return e;
}

static void the_plane_is_exact(void)
{   // Oracles of flat.h themselves: pairs of triangles whose answer is known; a sum of clipped areas; a square's hull.
    static const int64_t a[3][2] = {{0, 0}, {10, 0}, {0, 10}}, touching[3][2] = {{10, 0}, {10, 10}, {0, 10}};
    static const int64_t inside[3][2] = {{1, 1}, {3, 1}, {1, 3}}, sharp[3][2] = {{9, 2}, {20, 9}, {20, 8}};
    static const int64_t apart[3][2] = {{9, 2}, {20, 2}, {20, 8}}, corner[3][2] = {{10, 0}, {12, 5}, {12, -5}};
    static const int64_t on[2] = {5, 5}, in[2] = {1, 1}, out[2] = {6, 5};
    CHECK(!flat_interiors_meet(a, touching) && flat_interiors_meet(a, inside) && flat_interiors_meet(a, a));
    CHECK(!flat_interiors_meet(a, apart) && !flat_interiors_meet(a, corner) && !flat_interiors_meet(a, sharp));
    static const int64_t deeper[3][2] = {{8, 1}, {20, 2}, {20, 8}};
    CHECK(flat_interiors_meet(a, deeper) && flat_interiors_meet(deeper, a));
    static const int64_t big[3][2] = {{0, 0}, {(int64_t)1 << 60, 1}, {(int64_t)1 << 60, 0}};
    static const int64_t thin[3][2] = {{0, 0}, {((int64_t)1 << 60) - 1, 1}, {((int64_t)1 << 61) - 2, 2}};
    CHECK(flat_turn(big[0], big[1], big[2]) == -1 && flat_turn(big[0], big[2], big[1]) == 1);
    CHECK(flat_turn(thin[0], thin[1], thin[2]) == 0 && flat_turn(thin[0], big[1], thin[1]) == 1);
    CHECK(flat_inside(on, a[0], a[1], a[2]) == 0 && flat_inside(in, a[0], a[2], a[1]) == 1 &&
          flat_inside(out, a[0], a[1], a[2]) == -1);
    static const double triangle[3][2] = {{0.3, 0.2}, {7.9, 3.1}, {2.2, 6.6}};
    double sum = 0.0, weights[3];
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y)
            sum += flat_area_in_square(triangle, x, y);
    CHECK_REL(sum, 0.5 * ((7.9 - 0.3) * (6.6 - 0.2) - (3.1 - 0.2) * (2.2 - 0.3)), 1e-14);
    flat_nearest(triangle, triangle[1], weights);
    CHECK_ABS(weights[1], 1.0, 1e-12);
    double square[9][2];
    for (int i = 0; i < 9; ++i)
    {
        square[i][0] = i % 3;
        square[i][1] = 3 * (i / 3);
    }
    const flat_hull hull = flat_convex_hull(square, 9, 0.02);
    CHECK_EQUAL(hull.corners, 4);
    CHECK_REL(hull.area, 12.0, 1e-14);
    CHECK_REL(hull.length, 16.0, 1e-14);
    // Random triangles: the grid finds what all pairs find.
    int64_t xy[300][2];
    uint32_t triangles[300];
    size_t pairs = 0;
    random_seed(3);
    for (uint32_t i = 0; i < 300; ++i)
    {
        triangles[i] = i;
        for (size_t axis = 0; axis < 2; ++axis)
            xy[i][axis] = (int64_t)(i % 3 == 0 ? 900.0 * random_unit()
                                               : fmin(1000.0, (double)xy[i - i % 3][axis] + 100.0 * random_unit()));
    }
    for (size_t i = 0; i < 100; ++i)
        for (size_t k = i + 1; k < 100; ++k)
            pairs += flat_interiors_meet((const int64_t(*)[2])xy + 3 * i, (const int64_t(*)[2])xy + 3 * k) != 0;
    CHECK_EQUAL(flat_overlaps((const int64_t(*)[2])xy, triangles, 100, 1000, NULL), pairs);
    CHECK_BETWEEN((double)pairs, 10.0, 1000.0);
}

static void nothing_overlaps(void)
{   // Oracle: integers. Three meshes, three methods, three sizes. And one vertex moved must be found.
    for (int which = 0; which < SMALL_MESHES; ++which)
        for (int method = 0; method < 3; ++method)
        {
            const fixture *f = small_atlas(which, method);
            if (f == NULL)
                continue;
            const flat_errors e = check_flat(f);
            test_note("utilisation %.1f %%", 100.0 * e.utilisation);
            // A vertex onto the centre of a triangle of another chart.
            fixture mutant = *f;
            float *uv = (float *)malloc(2 * f->m.vertex_count * sizeof *uv);
            size_t other = f->T - 1;
            while (f->m.chart[other] == f->m.chart[0])
                --other;
            const uint32_t *last = &f->m.triangles[3 * other];
            memcpy(uv, f->m.uv, 2 * f->m.vertex_count * sizeof *uv);
            for (size_t axis = 0; axis < 2; ++axis)
            {
                const double sum = (double)uv[2 * last[0] + axis] + (double)uv[2 * last[1] + axis] +
                                   (double)uv[2 * last[2] + axis];
                uv[2 * f->m.triangles[0] + axis] = (float)(floor(sum / 3.0 * UNITS) / UNITS);
            }
            mutant.m.uv = uv;
            CHECK(measure_flat(&mutant).overlaps > 0);
            free(uv);
        }
}

// ---- The three methods ----

// An orthogonal frame whose third axis is n.
static void frame_of(const double n[3], double u[3], double v[3])
{
    double axis[3] = {0.0, 0.0, 0.0};
    int least = 0;
    for (int k = 1; k < 3; ++k)
        least = fabs(n[k]) < fabs(n[least]) ? k : least;
    axis[least] = 1.0;
    cross3(axis, n, u);
    const double length = length3(u);
    for (int k = 0; k < 3; ++k)
        u[k] /= length;
    cross3(n, u, v);
}

// A triangle of a chart as it is seen along the chart's normal, in texels.
static void seen_triangle(const fixture *f, size_t t, double out[3][2])
{
    double n[3], u[3], v[3];
    for (size_t i = 0; i < 3; ++i)
        n[i] = (double)f->m.chart_normal[3 * (size_t)f->m.chart[t] + i];
    frame_of(n, u, v);
    for (size_t k = 0; k < 3; ++k)
    {
        double p[3];
        corner_position(f, 3 * t + k, p);
        out[k][0] = dot3(p, u) * f->view.mm_per_unit * f->s.texels_per_mm;
        out[k][1] = dot3(p, v) * f->view.mm_per_unit * f->s.texels_per_mm;
    }
}

static int has_no_normal(const fixture *f, size_t chart)
{
    const float *n = &f->m.chart_normal[3 * chart];
    return n[0] == 0.0f && n[1] == 0.0f && n[2] == 0.0f;
}

// Whether a chart folds, seen along its normal: a triangle is turned over, or two overlap.
static int folds(const fixture *f, size_t chart)
{
    int64_t(*xy)[2] = (int64_t(*)[2])malloc(3 * f->T * sizeof *xy);
    uint32_t *corners = (uint32_t *)malloc(3 * f->T * sizeof *corners);
    size_t count = 0;
    int found = 0;
    for (size_t t = 0; t < f->T; ++t)
    {
        double p[3][2];
        if (f->m.chart[t] != chart || has_no_normal(f, chart))
            continue;
        seen_triangle(f, t, p);
        found |= uv_area(p) <= 1e-6 * triangle_mm2(f, t);
        for (size_t k = 0; k < 6; ++k)
            xy[3 * count + k / 2][k % 2] = (int64_t)llround((p[k / 2][k % 2] + 4.0 * (double)f->x.size) * 4096.0);
        for (size_t k = 0; k < 3; ++k)
            corners[3 * count + k] = (uint32_t)(3 * count + k);
        ++count;
    }
    found |= flat_overlaps((const int64_t(*)[2])xy, corners, count, (int64_t)f->x.size * 8 * 4096, NULL) > 0;
    free(xy);
    free(corners);
    return found;
}

static void orthographic_charts_are_projections(void)
{   // Oracle: lengths of edges seen along the chart's normal (Lensch 5.1), which texture coordinates must reproduce at
    // the one scale that the stats name; so that no triangle has more area in the texture than on the surface. Charts
    // that fold over, seen so, are laid flat otherwise.
    for (int which = 0; which < SMALL_MESHES; ++which)
    {
        const fixture *f = small_atlas(which, SSS_ATLAS_ORTHOGRAPHIC);
        double worst = 0.0, growth = 0.0;
        size_t folded = 0;
        if (f == NULL)
            continue;
        double *error = (double *)calloc(2 * f->m.chart_count, sizeof *error), *more = error + f->m.chart_count;
        for (size_t t = 0; t < f->T; ++t)
        {
            const size_t c = f->m.chart[t];
            const double most = triangle_mm2(f, t) * f->s.texels_per_mm * f->s.texels_per_mm;
            double seen[3][2], uv[3][2];
            if (has_no_normal(f, c))
                continue;
            seen_triangle(f, t, seen);
            triangle_uv(f, t, uv);
            for (int k = 0, l = 1; k < 3; ++k, l = (k + 1) % 3)
                keep_worst(&error[c], fabs(hypot(uv[l][0] - uv[k][0], uv[l][1] - uv[k][1]) -
                                           hypot(seen[l][0] - seen[k][0], seen[l][1] - seen[k][1])));
            keep_worst(&more[c], (uv_area(uv) - most) / (most + 0.01));
        }
        for (size_t c = 0; c < f->m.chart_count; ++c)
        {
            if (has_no_normal(f, c) || (error[c] > 1e-3 && folds(f, c)))
            {
                ++folded;
                continue;
            }
            keep_worst(&worst, error[c]);
            keep_worst(&growth, more[c]);
        }
        free(error);
        CHECK_BELOW(worst, 1e-3); // texels; coordinates are rounded to 2^-15 of one, chart normals to float
        CHECK_BELOW(growth, 1e-3);
        CHECK(folded == 0 || which == 2);
        test_note("%zu of %zu charts fold", folded, f->m.chart_count);
    }
}

// Whether a chart ends at the edge of a corner.
static int is_boundary(const fixture *f, const uint32_t *twin, size_t c)
{
    return twin[c] == NONE || f->m.chart[twin[c] / 3] != f->m.chart[c / 3];
}

// The area inside a boundary loop, which begins with the edge of a corner; its edges are marked.
static double loop_area(const fixture *f, const uint32_t *twin, size_t begin, unsigned char *marked)
{
    double twice = 0.0;
    size_t c = begin;
    do
    {
        double uv[3][2];
        triangle_uv(f, c / 3, uv);
        const double *p = uv[c % 3], *q = uv[(c + 1) % 3];
        twice += p[0] * q[1] - p[1] * q[0];
        marked[c] = 1;
        for (c = next_corner(c); !is_boundary(f, twin, c);)
            c = next_corner(twin[c]);
    } while (!marked[c]);
    return 0.5 * twice;
}

// The outer boundary of every chart against its convex hull; charts may have holes.
static void measure_convexity(const fixture *f, double *least_filled, size_t *most_corners)
{
    uint32_t *twin = twins_of(f);
    unsigned char *marked = (unsigned char *)calloc(3 * f->T + 1, 1);
    double(*points)[2] = (double(*)[2])malloc(3 * f->T * sizeof *points);
    double *area = (double *)calloc(f->m.chart_count + 1, sizeof *area);
    *least_filled = 1.0;
    *most_corners = 0;
    for (size_t c = 0; c < 3 * f->T; ++c)
        if (is_boundary(f, twin, c) && !marked[c])
            area[f->m.chart[c / 3]] = fmax(area[f->m.chart[c / 3]], loop_area(f, twin, c, marked));
    for (size_t c = 0; c < f->m.chart_count; ++c)
    {
        size_t count = 0;
        for (size_t t = 0; t < f->T; ++t)
        {
            double uv[3][2];
            if (f->m.chart[t] != c)
                continue;
            triangle_uv(f, t, uv);
            for (size_t k = 0; k < 3; ++k)
                memcpy(points[count++], uv[k], sizeof *points);
        }
        const flat_hull hull = flat_convex_hull(points, count, 0.05);
        *least_filled = fmin(*least_filled, area[c] / hull.area);
        *most_corners = hull.corners > *most_corners ? hull.corners : *most_corners;
    }
    free(twin);
    free(marked);
    free(points);
    free(area);
}

static void convex_charts_are_convex(void)
{   // Oracle: the convex hull of a chart (Andrew 1979), which a convex chart fills; its corners. Orthographic charts
    // must not pass.
    for (int which = 0; which < SMALL_MESHES + 2; ++which)
    {
        fixture made;
        const fixture *f = NULL;
        double filled;
        size_t most;
        memset(&made, 0, sizeof made);
        if (which < SMALL_MESHES)
            f = small_atlas(which, SSS_ATLAS_CONVEX);
        else
        {
            mesh_data mesh;
            sss_atlas_options o = options_of(256, SSS_ATLAS_CONVEX);
            o.corners = which == SMALL_MESHES ? 4 : 20;
            test_about("sphere, %d corners", o.corners);
            if (small_mesh(0, &mesh) == 0 && CHECK_EQUAL(fixture_make(&made, &mesh, &o, NULL), 0))
                f = &made;
        }
        if (f == NULL)
            continue;
        measure_convexity(f, &filled, &most);
        CHECK_BETWEEN(filled, 1.0 - 1e-3, 1.0 + 1e-6);
        CHECK(most >= 3 && (which != SMALL_MESHES || most <= 10)); // some more than asked for, where they must be
        CHECK_EQUAL(f->s.corners, which == SMALL_MESHES ? 4 : which > SMALL_MESHES ? 20 : 8);
        test_note("%zu charts, stretch %.3f, at most %zu corners", f->m.chart_count, f->s.stretch_l2, most);
        fixture_free(&made);
    }
    const fixture *f = small_atlas(1, SSS_ATLAS_ORTHOGRAPHIC);
    double filled = 1.0;
    size_t most = 0;
    if (f != NULL)
    {
        measure_convexity(f, &filled, &most);
        CHECK_BELOW(filled, 0.99);
    }
}

// ================================================= 3. Texels =================================================

// What each texel should be, found by going over all triangles.
typedef struct truth
{
    double *area;      // [size^2] mm^2
    double *share;     // [size^2] largest area of one triangle in the texel, in texels
    uint32_t *largest; // [size^2] that triangle
    uint32_t *center;  // [size^2] a triangle that has the centre, its border included
    unsigned char *on; // [size^2] the centre lies on an edge
} truth;

static void truth_free(truth *g)
{
    free(g->area);
    free(g->share);
    free(g->largest);
    free(g->center);
    free(g->on);
}

// The factor that makes centres of texels integers: 2 size over what it shares with UNITS.
static int64_t centre_scale(size_t size)
{
    int64_t scale = 2 * (int64_t)size;
    while (scale % 2 == 0 && scale > 1)
        scale /= 2;
    return scale;
}

// Where the centre of column or row i lies, in integers times the scale.
static int64_t centre_at(size_t size, size_t i)
{
    return (int64_t)((2 * (int64_t)i + 1) * ((int64_t)UNITS / (2 * (int64_t)size / centre_scale(size))));
}

static void truth_of_triangle(const fixture *f, const int64_t (*xy)[2], size_t t, truth *g)
{
    const size_t size = f->x.size;
    const int64_t scale = centre_scale(size);
    double uv[3][2];
    int64_t p[3][2];
    triangle_uv(f, t, uv);
    const double in_texture = fabs(uv_area(uv)), ratio = in_texture > 0.0 ? triangle_mm2(f, t) / in_texture : 0.0;
    for (size_t k = 0; k < 6; ++k)
        p[k / 2][k % 2] = scale * xy[f->m.triangles[3 * t + k / 2]][k % 2];
    const double top = (double)size - 1.0;
    const size_t x0 = (size_t)fmin(top, floor(fmin(uv[0][0], fmin(uv[1][0], uv[2][0]))));
    const size_t x1 = (size_t)fmin(top, floor(fmax(uv[0][0], fmax(uv[1][0], uv[2][0]))));
    const size_t y0 = (size_t)fmin(top, floor(fmin(uv[0][1], fmin(uv[1][1], uv[2][1]))));
    const size_t y1 = (size_t)fmin(top, floor(fmax(uv[0][1], fmax(uv[1][1], uv[2][1]))));
    for (size_t y = y0; y <= y1; ++y)
        for (size_t x = x0; x <= x1; ++x)
        {
            const size_t i = y * size + x;
            const int64_t centre[2] = {centre_at(size, x), centre_at(size, y)};
            const double area = flat_area_in_square((const double(*)[2])uv, (double)x, (double)y);
            const int inside = flat_inside(centre, p[0], p[1], p[2]);
            g->area[i] += area * ratio;
            if (area > g->share[i])
            {
                g->share[i] = area;
                g->largest[i] = (uint32_t)t;
            }
            if (inside >= 0 && (g->center[i] == NONE || inside > 0))
            {
                g->center[i] = (uint32_t)t;
                g->on[i] = inside == 0;
            }
        }
}

static truth truth_of(const fixture *f)
{
    truth g;
    const size_t texels = f->x.size * f->x.size;
    int64_t(*xy)[2] = integers(f);
    g.area = (double *)calloc(texels, sizeof *g.area);
    g.share = (double *)calloc(texels, sizeof *g.share);
    g.largest = (uint32_t *)malloc(texels * sizeof *g.largest);
    g.center = (uint32_t *)malloc(texels * sizeof *g.center);
    g.on = (unsigned char *)calloc(texels, 1);
    memset(g.largest, 0xff, texels * sizeof *g.largest);
    memset(g.center, 0xff, texels * sizeof *g.center);
    for (size_t t = 0; t < f->T; ++t)
        truth_of_triangle(f, (const int64_t(*)[2])xy, t, &g);
    free(xy);
    return g;
}

typedef struct texel_errors
{
    size_t order;           // not row by row, out of range, or `entry` says otherwise
    size_t missing, extra;  // texels with surface and without an inner entry; the other way round
    size_t slight;          // inner entries that show next to nothing
    size_t wrong_triangle;  // the centre lies in another triangle
    size_t on_edges;        // centres on an edge: either triangle will do
    size_t outside;         // inner entries whose centre is in no triangle
    double barycentric;     // the point they name against the centre, in texels
    double range;           // below 0, or a sum other than 1
    double position, normal; // over the extent; of unit vectors
    double area;            // of a texel, over it plus a hundredth of a whole one: what rounding leaves of one texel
                            // may be carried to the next
    double ratio;           // relative, where the centre is inside
    size_t wrong_ratio;     // where it is outside, and the ratio is not that of the triangle with the largest share
    size_t border_area;     // borders whose area is not 0
    double sum;             // of all areas against the surface, relative
    size_t unseen;          // triangles that hold no centre
    double unseen_area;     // their share of the surface
} texel_errors;

// Normals at vertices: those of the mesh, else means weighted by angle.
static double (*vertex_normals(const fixture *f))[3]
{
    double(*n)[3] = (double(*)[3])calloc(f->V + 1, sizeof *n);
    for (size_t i = 0; f->view.normals != NULL && i < 3 * f->V; ++i)
        n[i / 3][i % 3] = (double)f->view.normals[i];
    for (size_t t = 0; f->view.normals == NULL && t < f->T; ++t)
    {
        double c[3], p[3][3];
        triangle_cross(f, t, c);
        const double length = length3(c);
        for (size_t k = 0; k < 3; ++k)
            corner_position(f, 3 * t + k, p[k]);
        for (size_t k = 0; k < 3 && length > 0.0; ++k)
        {
            double a[3], b[3];
            for (int i = 0; i < 3; ++i)
            {
                a[i] = p[(k + 1) % 3][i] - p[k][i];
                b[i] = p[(k + 2) % 3][i] - p[k][i];
            }
            const double angle = atan2(length, dot3(a, b));
            for (int i = 0; i < 3; ++i)
                n[f->view.triangles[3 * t + k]][i] += angle * c[i] / length;
        }
    }
    for (size_t v = 0; v < f->V; ++v)
    {
        const double length = length3(n[v]);
        for (int i = 0; i < 3 && length > 0.0; ++i)
            n[v][i] /= length;
    }
    return n;
}

// Position and normal of entry e from its triangle and its weights.
static void measure_point(const fixture *f, const double (*normals)[3], size_t e, texel_errors *out)
{
    const size_t t = f->x.triangle[e];
    double p[3] = {0.0, 0.0, 0.0}, n[3] = {0.0, 0.0, 0.0}, sum = 0.0, least = 1.0, off = 0.0, bent = 0.0;
    for (size_t k = 0; k < 3; ++k)
    {
        const double b = (double)f->x.barycentric[3 * e + k];
        const size_t v = f->view.triangles[3 * t + k];
        sum += b;
        least = fmin(least, b);
        for (size_t i = 0; i < 3; ++i)
        {
            p[i] += b * (double)f->view.positions[3 * v + i];
            n[i] += b * normals[v][i];
        }
    }
    const double length = length3(n);
    for (size_t i = 0; i < 3; ++i)
    {
        const double got = (double)f->x.normal[3 * e + i];
        off = fmax(off, fabs((double)f->x.position[3 * e + i] - p[i]));
        bent = fmax(bent, length > 0.01 ? fabs(got - n[i] / length) : 0.0);
    }
    keep_worst(&out->range, fmax(-least, fabs(sum - 1.0)));
    keep_worst(&out->position, off / f->extent);
    keep_worst(&out->normal, bent);
}

// An inner entry against the truth at its texel.
static void measure_inner(const fixture *f, const truth *g, size_t e, double whole, texel_errors *out)
{
    const size_t size = f->x.size, i = f->x.texel[e], t = f->x.triangle[e];
    const double want = g->area[i], got = (double)f->x.area[e];
    keep_worst(&out->area, fabs(got - want) / (want + 0.01 * whole));
    out->extra += g->share[i] < 1e-12 && got > 1e-6 * whole;
    out->slight += g->share[i] < 1e-12;
    // On the border of a chart the centre may count as outside: then the entry shows the neighbour.
    const int outside = g->center[i] == NONE || (g->on[i] && f->m.chart[t] != f->m.chart[g->center[i]]);
    const size_t shown = outside ? g->largest[i] : t; // whose ratio the entry has
    const double off = shown == NONE ? 0.0 : relative_error((double)f->x.area_ratio[e], (double)f->m.area_ratio[shown]);
    out->outside += outside != 0;
    out->on_edges += g->on[i];
    out->wrong_triangle += !outside && !g->on[i] && t != g->center[i];
    if (!outside)
    {
        double uv[3][2], at[2] = {0.0, 0.0};
        triangle_uv(f, t, uv);
        for (size_t k = 0; k < 6; ++k)
            at[k % 2] += (double)f->x.barycentric[3 * e + k / 2] * uv[k / 2][k % 2];
        keep_worst(&out->barycentric,
                   hypot(at[0] - ((double)(i % size) + 0.5), at[1] - ((double)(i / size) + 0.5)));
    }
    if (!outside)
        keep_worst(&out->ratio, off);
    else
        out->wrong_ratio += off > 1e-5;
}

static void measure_order(const fixture *f, const truth *g, texel_errors *out)
{
    const size_t texels = f->x.size * f->x.size;
    size_t named = 0;
    for (size_t e = 0; e < f->x.count; ++e)
    {
        const uint32_t texel = f->x.texel[e];
        out->order += texel >= texels || f->x.entry[texel] != e || f->x.triangle[e] >= f->T ||
                      (e > 0 && e != f->x.inner_count && f->x.texel[e - 1] >= texel);
    }
    for (size_t i = 0; i < texels; ++i)
    {
        named += f->x.entry[i] != NONE;
        out->missing += g->share[i] > 1e-9 && (f->x.entry[i] == NONE || f->x.entry[i] >= f->x.inner_count);
    }
    out->order += named != f->x.count || f->x.inner_count > f->x.count;
}

static texel_errors measure_texels(const fixture *f)
{
    texel_errors e;
    truth g = truth_of(f);
    double(*normals)[3] = vertex_normals(f), sum = 0.0;
    const double surface = surface_mm2(f);
    const double whole = surface / fmax(1.0, (double)f->x.inner_count);
    unsigned char *seen = (unsigned char *)calloc(f->T + 1, 1);
    memset(&e, 0, sizeof e);
    measure_order(f, &g, &e);
    for (size_t i = 0; i < f->x.count && e.order == 0; ++i)
    {
        measure_point(f, (const double(*)[3])normals, i, &e);
        sum += (double)f->x.area[i];
        if (i < f->x.inner_count)
            measure_inner(f, &g, i, whole, &e);
        else
            e.border_area += f->x.area[i] != 0.0f || g.share[f->x.texel[i]] > 1e-9;
        if (i < f->x.inner_count && g.center[f->x.texel[i]] != NONE)
            seen[f->x.triangle[i]] = 1;
    }
    for (size_t t = 0; t < f->T; ++t)
        if (!seen[t])
        {
            ++e.unseen;
            e.unseen_area += triangle_mm2(f, t) / surface;
        }
    e.sum = relative_error(sum, surface);
    truth_free(&g);
    free(normals);
    free(seen);
    return e;
}

static void check_texels(const fixture *f)
{
    const texel_errors e = measure_texels(f);
    CHECK_EQUAL(e.order, 0);
    CHECK_EQUAL(e.missing, 0);
    CHECK_EQUAL(e.extra, 0);
    CHECK_EQUAL(e.wrong_triangle, 0);
    CHECK_BELOW(e.barycentric, 1e-3);
    CHECK_BELOW(e.range, 1e-6);
    CHECK_BELOW(e.position, 1e-6);
    CHECK_BELOW(e.normal, 1e-4);
    CHECK_BELOW(e.area, 3e-5);
    CHECK_BELOW(e.ratio, 1e-6);
    CHECK_BELOW((double)e.wrong_ratio, 0.01 * (double)e.outside); // two may have as large a share
    CHECK_BELOW((double)e.slight, 1e-3 * (double)f->x.inner_count);
    CHECK_EQUAL(e.border_area, 0);
    CHECK_BELOW(e.sum, 1e-6);
    CHECK_BELOW(f->s.texel_area_error, 1e-6);
    CHECK_EQUAL(f->s.empty_texels, f->x.size * f->x.size - f->x.inner_count);
    CHECK_ABS((double)f->s.unseen_triangles, (double)e.unseen, (double)e.on_edges);
    CHECK_ABS(f->s.unseen_area, e.unseen_area, 1e-6 + (e.on_edges > 0 ? 1e-2 : 0.0));
    test_note("%zu inner texels, %zu with their centre outside, %zu on an edge; %zu of borders", f->x.inner_count,
              e.outside, e.on_edges, f->x.count - f->x.inner_count);
}

static void texels_show_their_surface(void)
{   // Oracles: polygons clipped in double, points in triangles by integers, weights times the mesh's own numbers. Three
    // meshes, three methods, sizes of both kinds, with normals and without.
    for (int which = 0; which < SMALL_MESHES; ++which)
        for (int method = 0; method < 3; ++method)
        {
            const fixture *f = small_atlas(which, method);
            if (f != NULL)
                check_texels(f);
        }
}

// A copy of the texture coordinates to be changed.
static float *copied_uv(const fixture *f)
{
    float *uv = (float *)malloc(2 * f->m.vertex_count * sizeof *uv);
    memcpy(uv, f->m.uv, 2 * f->m.vertex_count * sizeof *uv);
    return uv;
}

static void wrong_texels_are_caught(void)
{   // Mutations that the measures above must catch: v turned over; a chart moved by a texel; areas without A_S/A_T.
    mesh_data mesh;
    fixture f;
    sss_atlas_options o = options_of(256, SSS_ATLAS_ORTHOGRAPHIC);
    o.normal_deviation = 60.0;
    if (closed_torus(48, 24, &mesh) != 0 || fixture_make(&f, &mesh, &o, NULL) != 0)
    {
        test_note("no atlas of the torus");
        CHECK(0);
        return;
    }
    fixture mutant = f;
    float *uv = copied_uv(&f);
    mutant.m.uv = uv;
    for (size_t a = 0; a < f.m.vertex_count; ++a)
        uv[2 * a + 1] = 1.0f - uv[2 * a + 1];
    test_about("v turned over");
    texel_errors e = measure_texels(&mutant);
    CHECK(e.wrong_triangle > f.x.inner_count / 4 && measure_flat(&mutant).turned == f.T);
    memcpy(uv, f.m.uv, 2 * f.m.vertex_count * sizeof *uv);
    double low = 1.0;
    for (size_t c = 0; c < 3 * f.T; ++c)
        low = f.m.chart[c / 3] == 0 ? fmin(low, (double)uv[2 * f.m.triangles[c]]) : low;
    const float step = low * 256.0 > 1.0 ? -1.0f / 256.0f : 1.0f / 256.0f;
    for (size_t a = 0; a < f.m.vertex_count; ++a)
    {
        size_t c = 0;
        while (f.m.triangles[c] != a)
            ++c;
        uv[2 * a] += f.m.chart[c / 3] == 0 ? step : 0.0f;
    }
    test_about("a chart moved by a texel");
    e = measure_texels(&mutant);
    CHECK(e.missing > 0 && e.extra > 0 && e.wrong_triangle > 0);
    float *area = (float *)malloc(f.x.count * sizeof *area);
    const double surface = surface_mm2(&f), mean = surface / (f.s.utilisation * 256.0 * 256.0);
    for (size_t i = 0; i < f.x.count; ++i)
        area[i] = f.x.area_ratio[i] > 0.0f ? (float)((double)f.x.area[i] / (double)f.x.area_ratio[i] * mean) : 0.0f;
    mutant = f;
    mutant.x.area = area;
    test_about("areas without A_S/A_T");
    e = measure_texels(&mutant);
    CHECK_BETWEEN(e.area, 0.05, HUGE_VAL); // the sum itself stays right: only the single texels tell
    free(uv);
    free(area);
    fixture_free(&f);
}

// ---- Maps between vertices and texels ----

static void vertices_find_their_texels(void)
{   // Oracle: distances in the texture to all inner texels around each place of a vertex; the largest weight.
    for (int which = 0; which < SMALL_MESHES; ++which)
    {
        const fixture *made = small_atlas(which, which);
        size_t unnamed = 0, other_chart = 0, wrong_vertex = 0;
        double farther = 0.0;
        if (made == NULL)
            continue;
        const fixture f = *made;
        const size_t size = f.x.size;
        uint32_t *chart = (uint32_t *)malloc(f.m.vertex_count * sizeof *chart);
        truth g = truth_of(&f);
        double *best = (double *)malloc(f.V * sizeof *best); // how much farther the entry is than the nearest
        for (size_t c = 0; c < 3 * f.T; ++c)
            chart[f.m.triangles[c]] = f.m.chart[c / 3];
        for (size_t v = 0; v < f.V; ++v)
            best[v] = HUGE_VAL;
        for (size_t a = 0; a < f.m.vertex_count; ++a)
        {
            const size_t v = f.m.vertex[a], e = f.x.vertex_entry[v];
            if (e == NONE || e >= f.x.inner_count || chart[a] != f.m.chart[g.largest[f.x.texel[e]]])
                continue;
            const double x = (double)f.m.uv[2 * a] * (double)size, y = (double)f.m.uv[2 * a + 1] * (double)size;
            double nearest = HUGE_VAL;
            for (long j = (long)y - 3; j <= (long)y + 3; ++j)
                for (long i = (long)x - 3; i <= (long)x + 3; ++i)
                {
                    if (i < 0 || j < 0 || i >= (long)size || j >= (long)size)
                        continue;
                    const size_t texel = (size_t)j * size + (size_t)i;
                    const uint32_t at = f.x.entry[texel];
                    if (at < f.x.inner_count && g.largest[texel] != NONE && f.m.chart[g.largest[texel]] == chart[a])
                        nearest = fmin(nearest, hypot((double)i + 0.5 - x, (double)j + 0.5 - y));
                }
            const size_t texel = f.x.texel[e];
            best[v] = fmin(best[v], hypot((double)(texel % size) + 0.5 - x, (double)(texel / size) + 0.5 - y) -
                                        nearest);
        }
        for (size_t v = 0; v < f.V; ++v)
        {
            unnamed += f.x.vertex_entry[v] >= f.x.inner_count;
            other_chart += f.x.vertex_entry[v] < f.x.inner_count && best[v] == HUGE_VAL;
            if (best[v] < HUGE_VAL)
                keep_worst(&farther, best[v]);
        }
        for (size_t e = 0; e < f.x.count; ++e)
        {
            const size_t t = f.x.triangle[e];
            const float *b = &f.x.barycentric[3 * e];
            const float most = b[0] > b[1] ? (b[0] > b[2] ? b[0] : b[2]) : (b[1] > b[2] ? b[1] : b[2]);
            int fine = 0;
            for (size_t k = 0; k < 3; ++k)
                fine |= f.x.entry_vertex[e] == f.view.triangles[3 * t + k] && b[k] >= most - 1e-6f;
            wrong_vertex += !fine;
        }
        CHECK_EQUAL(unnamed, 0);
        CHECK_EQUAL(other_chart, 0);
        CHECK_BELOW(farther, 1e-4);
        CHECK_EQUAL(wrong_vertex, 0);
        free(chart);
        free(best);
        truth_free(&g);
    }
}

// ============================================ 4. Borders and seams ============================================

// The chart of each inner texel; NONE elsewhere. Charts do not share texels, since at least one lies between them.
static uint32_t *charts_of_texels(const fixture *f, const truth *g)
{
    const size_t texels = f->x.size * f->x.size;
    uint32_t *chart = (uint32_t *)malloc(texels * sizeof *chart);
    for (size_t i = 0; chart != NULL && i < texels; ++i)
        chart[i] = g->largest[i] == NONE ? NONE : f->m.chart[g->largest[i]];
    return chart;
}

// Pairs of a texel and another chart's within `reach` texels of it.
static size_t too_near(const fixture *f, int reach)
{
    truth g = truth_of(f);
    uint32_t *chart = charts_of_texels(f, &g);
    const long size = (long)f->x.size;
    size_t count = 0;
    for (long y = 0; y < size; ++y)
        for (long x = 0; x < size; ++x)
            for (long j = y - reach; chart[y * size + x] != NONE && j <= y + reach; ++j)
                for (long i = x - reach; i <= x + reach; ++i)
                    count += i >= 0 && j >= 0 && i < size && j < size && chart[j * size + i] != NONE &&
                             chart[j * size + i] != chart[y * size + x];
    free(chart);
    truth_free(&g);
    return count;
}

static void gutters_are_kept(void)
{   // Oracle: distances between texels that show surface, however little, of different charts. At one texel more they
    // would not be kept: the packing wastes nothing that a gutter could have.
    static const int gutters[4] = {0, 1, 5, 2}, borders[4] = {0, -1, 1, 3}, kept[4] = {2, 1, 5, 6};
    for (int which = 0; which < 2; ++which)
        for (int i = 0; i < 4; ++i)
        {
            mesh_data mesh;
            fixture f;
            sss_atlas_options o = options_of(200, (sss_atlas_method)((which + i) % 3));
            if (i % 2 == which || small_mesh(which == 0 ? 1 : 2, &mesh) != 0)
                continue;
            o.gutter = gutters[i];
            o.border = borders[i];
            test_about("%s, gutter %d, border %d", small_names[which + 1], gutters[i], borders[i]);
            if (!CHECK_EQUAL(fixture_make(&f, &mesh, &o, NULL), 0))
                continue;
            CHECK_EQUAL(too_near(&f, kept[i]), 0);
            CHECK(too_near(&f, kept[i] + 3) > 0);
            CHECK(f.x.count > f.x.inner_count || borders[i] < 0);
            CHECK(borders[i] >= 0 || f.x.count == f.x.inner_count);
            CHECK_EQUAL(f.s.border, borders[i] < 0 ? 0 : borders[i] == 0 ? 1 : borders[i]);
            fixture_free(&f);
        }
}

// ---- Borders show the neighbours' surface ----

// Singular values of the map from the texture to the surface, in mm per texel: of the 3 x 2 matrix J with
// J (uv_i - uv_0) = x_i - x_0, through the eigenvalues of its metric (Sander et al. 2001, section 3).
static void singular_values(const fixture *f, size_t t, double *largest, double *smallest)
{
    double uv[3][2], p[3][3], S_s[3], S_t[3];
    triangle_uv(f, t, uv);
    const double twice = 2.0 * uv_area(uv);
    for (size_t k = 0; k < 3; ++k)
        corner_position(f, 3 * t + k, p[k]);
    for (int i = 0; i < 3; ++i)
    {
        S_s[i] = (p[0][i] * (uv[1][1] - uv[2][1]) + p[1][i] * (uv[2][1] - uv[0][1]) +
                  p[2][i] * (uv[0][1] - uv[1][1])) * f->view.mm_per_unit / twice;
        S_t[i] = (p[0][i] * (uv[2][0] - uv[1][0]) + p[1][i] * (uv[0][0] - uv[2][0]) +
                  p[2][i] * (uv[1][0] - uv[0][0])) * f->view.mm_per_unit / twice;
    }
    const double a = dot3(S_s, S_s), b = dot3(S_s, S_t), c = dot3(S_t, S_t);
    const double root = sqrt((a - c) * (a - c) + 4.0 * b * b);
    *largest = sqrt(0.5 * (a + c + root));
    *smallest = sqrt(fmax(0.0, 0.5 * (a + c - root)));
}

// Edges at which charts end, by the texels that their boxes meet.
typedef struct boundary
{
    size_t *begin; // [size^2 + 1]
    uint32_t *corner;
} boundary;

static void list_boundary(const fixture *f, const uint32_t *twin, boundary *b, int pass)
{
    const size_t size = f->x.size;
    for (size_t c = 0; c < 3 * f->T; ++c)
    {
        double uv[3][2];
        if (twin[c] != NONE && f->m.chart[twin[c] / 3] == f->m.chart[c / 3])
            continue;
        triangle_uv(f, c / 3, uv);
        const double *p = uv[c % 3], *q = uv[(c + 1) % 3];
        for (size_t y = (size_t)fmin(p[1], q[1]); y <= (size_t)fmax(p[1], q[1]) && y < size; ++y)
            for (size_t x = (size_t)fmin(p[0], q[0]); x <= (size_t)fmax(p[0], q[0]) && x < size; ++x)
                if (pass == 0)
                    ++b->begin[y * size + x + 1];
                else
                    b->corner[b->begin[y * size + x]++] = (uint32_t)c;
    }
}

static boundary boundary_of(const fixture *f, const uint32_t *twin)
{
    boundary b;
    const size_t texels = f->x.size * f->x.size;
    b.begin = (size_t *)calloc(texels + 2, sizeof *b.begin);
    list_boundary(f, twin, &b, 0);
    for (size_t i = 0; i < texels; ++i)
        b.begin[i + 1] += b.begin[i];
    b.corner = (uint32_t *)malloc((b.begin[texels] + 1) * sizeof *b.corner);
    list_boundary(f, twin, &b, 1);
    memmove(b.begin + 1, b.begin, texels * sizeof *b.begin);
    b.begin[0] = 0;
    return b;
}

// The chart boundary's point nearest to a place in the texture, within reach: its distance in texels, the corner whose
// edge it is on, the point on the surface in mm. HUGE_VAL: none.
static double nearest_boundary(const fixture *f, const boundary *b, const double at[2], long reach, size_t *corner,
                               double point[3])
{
    const long size = (long)f->x.size;
    double best = HUGE_VAL;
    for (long y = (long)at[1] - reach; y <= (long)at[1] + reach; ++y)
        for (long x = (long)at[0] - reach; x <= (long)at[0] + reach; ++x)
        {
            if (x < 0 || y < 0 || x >= size || y >= size)
                continue;
            for (size_t i = b->begin[y * size + x]; i < b->begin[y * size + x + 1]; ++i)
            {
                const size_t c = b->corner[i];
                double uv[3][2], p[3], q[3];
                triangle_uv(f, c / 3, uv);
                const double *s = uv[c % 3], *e = uv[(c + 1) % 3];
                const double d[2] = {e[0] - s[0], e[1] - s[1]}, length = d[0] * d[0] + d[1] * d[1];
                double along = length > 0.0 ? ((at[0] - s[0]) * d[0] + (at[1] - s[1]) * d[1]) / length : 0.0;
                along = fmin(fmax(along, 0.0), 1.0);
                const double away = hypot(s[0] + along * d[0] - at[0], s[1] + along * d[1] - at[1]);
                if (away >= best)
                    continue;
                best = away;
                *corner = c;
                corner_position(f, c, p);
                corner_position(f, next_corner(c), q);
                for (int k = 0; k < 3; ++k)
                    point[k] = (p[k] + along * (q[k] - p[k])) * f->view.mm_per_unit;
            }
        }
    return best;
}

typedef struct border_errors
{
    size_t count;     // texels beyond a boundary: borders, and inner ones whose centre is outside
    size_t far_away;  // farther than 1.5 times what their distance in the texture says
    size_t clamped;   // nearer than a tenth of it
    double mean;      // of distance on the surface over that in the texture
    size_t empty;     // texels within reach of an inner one that have no entry
    size_t windows;   // such texels in all
} border_errors;

static border_errors measure_borders(const fixture *f)
{
    border_errors e;
    truth g = truth_of(f);
    uint32_t *twin = twins_of(f);
    boundary b = boundary_of(f, twin);
    const long size = (long)f->x.size, reach = f->s.border;
    memset(&e, 0, sizeof e);
    for (size_t i = 0; i < f->x.count; ++i)
    {
        const size_t texel = f->x.texel[i];
        const double at[2] = {(double)(texel % f->x.size) + 0.5, (double)(texel / f->x.size) + 0.5};
        double boundary_point[3], position[3], largest, smallest;
        size_t corner = 0;
        if (i < f->x.inner_count && g.center[texel] != NONE)
            continue;
        const double away = nearest_boundary(f, &b, at, reach + 2, &corner, boundary_point);
        ++e.count;
        if (away == HUGE_VAL)
        {
            ++e.far_away;
            continue;
        }
        if (away < 0.05 || twin[corner] == NONE)
            continue;
        singular_values(f, corner / 3, &largest, &smallest);
        for (size_t k = 0; k < 3; ++k)
            position[k] = (double)f->x.position[3 * i + k] * f->view.mm_per_unit;
        const double ratio = distance3(position, boundary_point) / (away * largest);
        e.far_away += !(ratio <= 1.5);
        e.clamped += ratio < 0.1;
        e.mean += ratio;
    }
    e.mean /= fmax(1.0, (double)e.count);
    for (long y = 0; y < size; ++y)
        for (long x = 0; x < size; ++x)
            for (long j = y - reach; g.share[y * size + x] > 1e-9 && j <= y + reach; ++j)
                for (long i = x - reach; i <= x + reach; ++i)
                {
                    ++e.windows;
                    e.empty += i < 0 || j < 0 || i >= size || j >= size || f->x.entry[j * size + i] == NONE;
                }
    free(b.begin);
    free(b.corner);
    free(twin);
    truth_free(&g);
    return e;
}

static void borders_show_the_neighbours(void)
{   // Oracle: distances on the surface and in the texture from the nearest point of the chart's boundary; on closed
    // meshes the surface goes on everywhere, so that a filter of 2 border + 1 texels never meets an empty one (Lensch
    // 5.1). And a table whose borders repeat the boundary must be caught.
    static const int borders[3] = {1, 3, 8};
    for (int which = 0; which < SMALL_MESHES; ++which)
        for (int i = 0; i < 3; ++i)
        {
            mesh_data mesh;
            fixture f;
            sss_atlas_options o = options_of(256, (sss_atlas_method)((which + i) % 3));
            if ((which + 2 * i) % 3 == 2 || small_mesh(which, &mesh) != 0)
                continue;
            o.border = borders[i];
            test_about("%s, %s, border %d", small_names[which], method_names[o.method], borders[i]);
            if (!CHECK_EQUAL(fixture_make(&f, &mesh, &o, NULL), 0))
                continue;
            const border_errors e = measure_borders(&f);
            // The thinned bunny has folds, and convex charts are stretched along their boundary.
            CHECK_BELOW((double)e.far_away / (double)e.count, which == 2 ? 0.01 : 0.005);
            CHECK_BELOW((double)e.clamped / (double)e.count, which == 2 ? 0.3 : 0.005);
            CHECK_BETWEEN(e.mean, which == 2 ? 0.2 : 0.6, 1.1);
            CHECK_BELOW((double)e.empty / (double)e.windows, which == 2 ? 1e-3 : 0.0);
            test_note("%zu beyond a boundary, %zu too far, %zu too near; %zu of %zu texels in windows empty", e.count,
                      e.far_away, e.clamped, e.empty, e.windows);
            if (i == 1)
            {   // the mutant: positions of another border texel
                fixture mutant = f;
                float *position = (float *)malloc(3 * f.x.count * sizeof *position);
                memcpy(position, f.x.position, 3 * f.x.count * sizeof *position);
                for (size_t k = f.x.inner_count; k + 40 < f.x.count; ++k)
                    memcpy(&position[3 * k], &f.x.position[3 * (k + 40)], 3 * sizeof *position);
                mutant.x.position = position;
                const border_errors wrong = measure_borders(&mutant);
                CHECK(wrong.far_away > e.count / 4);
                free(position);
            }
            fixture_free(&f);
        }
}

// ---- A function sampled into the atlas and read back ----

static double smooth(const double p[3], double extent)
{
    const double k = 2.0 * PI / (0.5 * extent);
    return sin(k * p[0] + 0.3) + sin(k * (0.6 * p[1] + 0.8 * p[2])) + cos(k * (0.8 * p[1] - 0.6 * p[2]) - 1.0);
}

typedef struct sampled
{
    double rms, p999; // of the error
    size_t count;
} sampled;

typedef struct seam_errors
{
    sampled inside, near; // points whose four texels have their centres in the point's chart; the others
} seam_errors;

static int by_double(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static sampled sum_up(double *errors, size_t count)
{
    sampled s = {0.0, 0.0, count};
    for (size_t i = 0; i < count; ++i)
        s.rms += errors[i] * errors[i] / (double)count;
    s.rms = sqrt(s.rms);
    qsort(errors, count, sizeof *errors, by_double);
    s.p999 = count > 0 ? errors[(size_t)(0.999 * (double)(count - 1))] : 0.0;
    return s;
}

// Random points, as many on each piece of surface as it has area.
static void random_points(const fixture *f, size_t count, uint32_t *triangle, float *barycentric)
{
    const double each = surface_mm2(f) / (double)count;
    double below = 0.0;
    size_t next = 0;
    for (size_t t = 0; t < f->T; ++t)
        for (below += triangle_mm2(f, t); next < count && ((double)next + 0.5) * each < below; ++next)
        {
            double a = random_unit(), b = random_unit();
            if (a + b > 1.0)
            {
                a = 1.0 - a;
                b = 1.0 - b;
            }
            triangle[next] = (uint32_t)t;
            barycentric[3 * next] = (float)a;
            barycentric[3 * next + 1] = (float)b;
            barycentric[3 * next + 2] = (float)(1.0 - a - b);
        }
    for (; next > 0 && next < count; ++next)
    {
        triangle[next] = triangle[next - 1];
        memcpy(&barycentric[3 * next], &barycentric[3 * next - 3], 3 * sizeof *barycentric);
    }
}

// Whether the four texels around a point of the texture have their centres in its chart.
static int footprint_inside(const fixture *f, const truth *g, const double at[2], uint32_t chart)
{
    const double top = (double)f->x.size - 1.0;
    for (int k = 0; k < 4; ++k)
    {
        const double x = fmin(fmax(floor(at[0] - 0.5) + k % 2, 0.0), top);
        const double y = fmin(fmax(floor(at[1] - 0.5) + k / 2, 0.0), top);
        const uint32_t t = g->center[(size_t)y * f->x.size + (size_t)x];
        if (t == NONE || f->m.chart[t] != chart)
            return 0;
    }
    return 1;
}

static void point_of(const fixture *f, uint32_t t, const float *b, double p[3], double uv[2])
{
    double corners[3][2];
    triangle_uv(f, t, corners);
    memset(p, 0, 3 * sizeof *p);
    memset(uv, 0, 2 * sizeof *uv);
    for (size_t k = 0; k < 3; ++k)
    {
        double corner[3];
        corner_position(f, 3 * (size_t)t + k, corner);
        for (int i = 0; i < 3; ++i)
            p[i] += (double)b[k] * corner[i];
        for (int i = 0; i < 2; ++i)
            uv[i] += (double)b[k] * corners[k][i];
    }
}

static seam_errors measure_seams(const fixture *f, size_t count)
{
    seam_errors e;
    truth g = truth_of(f);
    const size_t texels = f->x.size * f->x.size;
    float *values = (float *)malloc((f->x.count + 1) * sizeof *values);
    float *image = (float *)malloc(texels * sizeof *image);
    uint32_t *triangle = (uint32_t *)malloc(count * sizeof *triangle);
    float *barycentric = (float *)malloc(3 * count * sizeof *barycentric), *got = (float *)malloc(count * sizeof *got);
    double *errors[2] = {(double *)malloc(count * sizeof(double)), (double *)malloc(count * sizeof(double))};
    size_t counts[2] = {0, 0};
    for (size_t i = 0; i < f->x.count; ++i)
    {
        const double p[3] = {(double)f->x.position[3 * i], (double)f->x.position[3 * i + 1],
                             (double)f->x.position[3 * i + 2]};
        values[i] = (float)smooth(p, f->extent);
    }
    random_points(f, count, triangle, barycentric);
    CHECK_EQUAL(sss_atlas_fill_image(f->atlas, values, 1, 4, image), SSS_OK);
    CHECK_EQUAL(sss_atlas_fetch(f->atlas, image, 1, triangle, barycentric, count, got), SSS_OK);
    for (size_t i = 0; i < count; ++i)
    {
        double p[3], uv[2];
        point_of(f, triangle[i], &barycentric[3 * i], p, uv);
        const int near = !footprint_inside(f, &g, uv, f->m.chart[triangle[i]]);
        errors[near][counts[near]++] = fabs((double)got[i] - smooth(p, f->extent));
    }
    e.inside = sum_up(errors[0], counts[0]);
    e.near = sum_up(errors[1], counts[1]);
    free(values);
    free(image);
    free(triangle);
    free(barycentric);
    free(got);
    free(errors[0]);
    free(errors[1]);
    truth_free(&g);
    return e;
}

static void check_seams(const fixture *f, double regression)
{
    random_seed(5);
    const seam_errors e = measure_seams(f, 200000);
    test_note("rms %.2e inside, %.2e near seams; 99.9 %% below %.2e and %.2e; %.1f %% of points are near", e.inside.rms,
              e.near.rms, e.inside.p999, e.near.p999, 100.0 * (double)e.near.count / 200000.0);
    CHECK_BETWEEN((double)e.near.count, 1000.0, 150000.0);
    CHECK_BAR_BELOW(e.near.rms / e.inside.rms, 1.0, regression, "rms error near seams over that inside");
    CHECK_BAR_BELOW(e.near.p999 / e.inside.p999, 1.0, regression, "99.9 percentile near seams over that inside");
}

static void seams_cannot_be_seen(void)
{   // Oracle: the function itself. At points whose texels leave the chart the error is no larger than inside, and both
    // fall with the square of a texel's size. The models are looked at below.
    for (int which = 0; which < 2; ++which)
    {
        static const size_t sizes[3] = {128, 256, 512};
        double inside[3] = {0.0, 0.0, 0.0}, near[3] = {0.0, 0.0, 0.0};
        for (int i = 0; i < 3; ++i)
        {
            mesh_data mesh;
            fixture f;
            const sss_atlas_options o = options_of(sizes[i], (sss_atlas_method)which);
            if ((which == 0 ? mesh_closed_sphere(5, 1.0, &mesh) : closed_torus(120, 60, &mesh)) != 0)
                continue;
            test_about("%s, %s, size %zu", small_names[which], method_names[which], sizes[i]);
            if (!CHECK_EQUAL(fixture_make(&f, &mesh, &o, NULL), 0))
                continue;
            check_seams(&f, 1.5);
            random_seed(5);
            const seam_errors e = measure_seams(&f, 50000);
            inside[i] = e.inside.rms;
            near[i] = e.near.rms;
            fixture_free(&f);
        }
        test_about("%s: order of convergence from 128 to 512", small_names[which]);
        CHECK_BETWEEN(log2(inside[0] / inside[2]) / 2.0, 1.7, 2.4);
        CHECK_BETWEEN(log2(near[0] / near[2]) / 2.0, 1.7, 2.4);
    }
}

static void seams_without_borders_are_seen(void)
{   // The mutation: without borders, values are means of neighbours, and the measure above must tell.
    mesh_data mesh;
    fixture f;
    sss_atlas_options o = options_of(256, SSS_ATLAS_ORTHOGRAPHIC);
    o.border = -1;
    if (mesh_closed_sphere(5, 1.0, &mesh) != 0 || fixture_make(&f, &mesh, &o, NULL) != 0)
    {
        test_note("no atlas of the sphere");
        CHECK(0);
        return;
    }
    random_seed(5);
    const seam_errors e = measure_seams(&f, 50000);
    CHECK_BETWEEN(e.near.rms / e.inside.rms, 2.0, HUGE_VAL);
    fixture_free(&f);
}

// ---- Images ----

// The image by the declaration: texels with entries first, then ring by ring the mean of those of the eight neighbours
// that have a value.
static double *image_by_hand(const fixture *f, const float *values, size_t channels, size_t channel, size_t rings)
{
    const long size = (long)f->x.size;
    const size_t texels = f->x.size * f->x.size;
    double *image = (double *)calloc(texels, sizeof *image);
    unsigned char *has = (unsigned char *)calloc(texels, 1);
    for (size_t i = 0; i < texels; ++i)
        if (f->x.entry[i] != NONE)
        {
            image[i] = (double)values[channels * f->x.entry[i] + channel];
            has[i] = 1;
        }
    for (size_t ring = 0; ring < rings; ++ring)
    {
        for (size_t i = 0; i < texels; ++i)
        {
            const long x = (long)i % size, y = (long)i / size;
            double sum = 0.0, count = 0.0;
            for (long k = 0; k < 9 && has[i] != 1; ++k)
            {
                const long u = x + k % 3 - 1, v = y + k / 3 - 1;
                if (u < 0 || v < 0 || u >= size || v >= size || has[v * size + u] != 1)
                    continue;
                sum += image[v * size + u];
                count += 1.0;
            }
            if (count > 0.0)
            {
                image[i] = sum / count;
                has[i] = 2;
            }
        }
        for (size_t i = 0; i < texels; ++i)
            has[i] = has[i] != 0;
    }
    free(has);
    return image;
}

static void images_are_filled(void)
{   // Oracle: the declaration, done by hand, in three channels.
    static const size_t rings[4] = {0, 1, 3, 1024};
    mesh_data mesh;
    fixture f;
    const sss_atlas_options o = options_of(100, SSS_ATLAS_ORTHOGRAPHIC);
    if (closed_torus(48, 24, &mesh) != 0 || fixture_make(&f, &mesh, &o, NULL) != 0)
    {
        test_note("no atlas of the torus");
        CHECK(0);
        return;
    }
    float *values = (float *)malloc(3 * f.x.count * sizeof *values), *image = (float *)malloc(30000 * sizeof *image);
    random_seed(6);
    for (size_t i = 0; i < 3 * f.x.count; ++i)
        values[i] = (float)random_unit();
    for (size_t r = 0; r < 4; ++r)
    {
        double worst = 0.0;
        test_about("%zu rings", rings[r]);
        CHECK_EQUAL(sss_atlas_fill_image(f.atlas, values, 3, rings[r], image), SSS_OK);
        for (size_t channel = 0; channel < 3; ++channel)
        {
            double *want = image_by_hand(&f, values, 3, channel, rings[r] > 150 ? 150 : rings[r]);
            for (size_t i = 0; i < 10000; ++i)
                keep_worst(&worst, fabs((double)image[3 * i + channel] - want[i]));
            free(want);
        }
        CHECK_BELOW(worst, 1e-5);
    }
    free(values);
    free(image);
    fixture_free(&f);
}

static void fetches_are_bilinear(void)
{   // Oracle: the rule of OpenGL (section 8.14 of the 4.5 specification) for GL_LINEAR and GL_CLAMP_TO_EDGE, in double;
    // an image linear in u and v is reproduced exactly.
    mesh_data mesh;
    fixture f;
    const sss_atlas_options o = options_of(60, SSS_ATLAS_ORTHOGRAPHIC);
    enum
    {
        POINTS = 5000
    };
    static uint32_t triangle[POINTS];
    static float barycentric[3 * POINTS], got[4 * POINTS], image[4 * 3600];
    double worst = 0.0, linear = 0.0;
    if (closed_torus(48, 24, &mesh) != 0 || fixture_make(&f, &mesh, &o, NULL) != 0)
    {
        test_note("no atlas of the torus");
        CHECK(0);
        return;
    }
    random_seed(7);
    for (size_t i = 0; i < 3600; ++i)
    {
        for (size_t c = 0; c < 3; ++c)
            image[4 * i + c] = (float)random_unit();
        image[4 * i + 3] = (float)((double)(i % 60) + 0.5 + 2.0 * ((double)(i / 60) + 0.5));
    }
    random_points(&f, POINTS, triangle, barycentric);
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 4, triangle, barycentric, POINTS, got), SSS_OK);
    for (size_t i = 0; i < POINTS; ++i)
    {
        double p[3], uv[2], want[4] = {0.0, 0.0, 0.0, 0.0};
        point_of(&f, triangle[i], &barycentric[3 * i], p, uv);
        const double x = floor(uv[0] - 0.5), y = floor(uv[1] - 0.5), a = uv[0] - 0.5 - x, b = uv[1] - 0.5 - y;
        for (int k = 0; k < 4; ++k)
        {
            const double u = fmin(fmax(x + k % 2, 0.0), 59.0), v = fmin(fmax(y + k / 2, 0.0), 59.0);
            for (size_t c = 0; c < 4; ++c)
                want[c] += (k % 2 ? a : 1.0 - a) * (k / 2 ? b : 1.0 - b) *
                           (double)image[4 * ((size_t)v * 60 + (size_t)u) + c];
        }
        for (size_t c = 0; c < 4; ++c)
            keep_worst(&worst, fabs((double)got[4 * i + c] - want[c]) / (c == 3 ? 180.0 : 1.0));
        if (uv[0] > 0.5 && uv[0] < 59.5 && uv[1] > 0.5 && uv[1] < 59.5)
            keep_worst(&linear, fabs((double)got[4 * i + 3] - uv[0] - 2.0 * uv[1]) / 180.0);
    }
    CHECK_BELOW(worst, 2e-5);
    CHECK_BELOW(linear, 1e-6);
    fixture_free(&f);
}

// ================================================= 5. Quality =================================================

typedef struct quality
{
    double l2, linf;          // Sander et al. 2001, section 3: root of the mean of L2^2 over the surface; the worst
    double least, largest;    // texture area per surface area, over its mean
    double within;            // share of the surface where that is within a factor of 1.5
    double angle;             // mean of (Gamma/gamma + gamma/Gamma)/2
    double stretch, ratio;    // largest relative errors of the triangles' stretch and area ratio
    double scale;             // mm per texel of an even map
} quality;

static quality measure_quality(const fixture *f)
{
    quality q = {0.0, 0.0, HUGE_VAL, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    double surface = 0.0, texture = 0.0;
    for (size_t t = 0; t < f->T; ++t)
    {
        double uv[3][2];
        triangle_uv(f, t, uv);
        surface += triangle_mm2(f, t);
        texture += uv_area(uv);
    }
    q.scale = sqrt(surface / texture);
    for (size_t t = 0; t < f->T; ++t)
    {
        double uv[3][2], largest, smallest;
        const double area = triangle_mm2(f, t);
        triangle_uv(f, t, uv);
        if (!(area > 0.0) || uv_area(uv) == 0.0)
            continue;
        singular_values(f, t, &largest, &smallest);
        const double L2 = sqrt(0.5 * (largest * largest + smallest * smallest)) / q.scale;
        const double distortion = uv_area(uv) / area * q.scale * q.scale;
        q.l2 += L2 * L2 * area / surface;
        q.linf = fmax(q.linf, largest / q.scale);
        q.least = fmin(q.least, distortion);
        q.largest = fmax(q.largest, distortion);
        q.within += distortion <= 1.5 && distortion >= 1.0 / 1.5 ? area / surface : 0.0;
        q.angle += 0.5 * (largest / smallest + smallest / largest) * area / surface;
        keep_worst(&q.stretch, relative_error((double)f->m.stretch[t], L2));
        keep_worst(&q.ratio, relative_error((double)f->m.area_ratio[t], area / uv_area(uv)));
    }
    q.l2 = sqrt(q.l2);
    return q;
}

static void the_stats_are_right(void)
{   // Oracle: the definitions of Sander et al. 2001, section 3, on the texture coordinates that are handed out.
    for (int which = 0; which < SMALL_MESHES; ++which)
        for (int method = 0; method < 3; ++method)
        {
            const fixture *f = small_atlas(which, method);
            if (f == NULL)
                continue;
            const quality q = measure_quality(f);
            CHECK_REL(f->s.stretch_l2, q.l2, 1e-5);
            CHECK_REL(f->s.stretch_linf, q.linf, 1e-3);
            CHECK_REL(f->s.area_distortion[0], q.least, 1e-3);
            CHECK_REL(f->s.area_distortion[2], q.largest, 1e-3);
            CHECK_BETWEEN(f->s.area_distortion[1], q.least, q.largest);
            CHECK_ABS(f->s.area_share_within, q.within, 1e-6);
            CHECK_REL(f->s.angle_distortion, q.angle, 1e-4);
            CHECK_BELOW(q.stretch, 1e-3);
            CHECK_BELOW(q.ratio, 1e-5);
            CHECK_BETWEEN(q.l2, 1.0 - 1e-9, 100.0);
        }
}

static void flat_point(double s, double t, double out[3])
{
    out[0] = 0.36 * s + 0.8 * t;
    out[1] = -0.48 * s + 0.6 * t;
    out[2] = 0.8 * s;
}

static const double half_angle = 0.5; // radians, of the cylinder and of the cap; below 30 degrees

static void cylinder_point(double s, double t, double out[3])
{
    out[0] = sin(half_angle * (2.0 * s - 1.0));
    out[1] = t;
    out[2] = cos(half_angle * (2.0 * s - 1.0));
}

// A square onto a disc (Shirley and Chiu 1997), then equal polar angles.
static void cap_point(double s, double t, double out[3])
{
    const double a = 2.0 * s - 1.0, b = 2.0 * t - 1.0, r = fmax(fabs(a), fabs(b));
    double phi = fabs(a) >= fabs(b) ? (r > 0.0 ? PI / 4.0 * b / a : 0.0) : PI / 2.0 - PI / 4.0 * a / b;
    phi += (fabs(a) >= fabs(b) ? a : b) < 0.0 ? PI : 0.0;
    out[0] = sin(half_angle * r) * cos(phi);
    out[1] = sin(half_angle * r) * sin(phi);
    out[2] = cos(half_angle * r);
}

static int sheet_atlas(void (*point)(double, double, double[3]), int n, sss_atlas_method method, fixture *f)
{
    mesh_data mesh;
    const sss_atlas_options o = options_of(512, method);
    return mesh_sheet(n, n, point, &mesh) == 0 ? fixture_make(f, &mesh, &o, NULL) : 1;
}

static void closed_forms_of_stretch(void)
{   // Oracle: by hand. A plane is laid out as it is. Seen from above, facets of a cylinder tilted by phi are squeezed
    // to cos phi along one axis; on a sphere's cap up to angle h, with the mean over its area 2 pi (1 - cos h): mean of
    // 1/cos^2 = (1/cos h - 1)/(1 - cos h), area seen pi sin^2 h. A cylinder can be unrolled: least stretch is 1.
    fixture f;
    for (int method = 0; method < 3; ++method)
    {
        test_about("plane, %s", method_names[method]);
        if (!CHECK_EQUAL(sheet_atlas(flat_point, 12, (sss_atlas_method)method, &f), 0))
            continue;
        CHECK_EQUAL(f.m.chart_count, 1);
        if (method == 2)
        {   // the square becomes a polygon of eight corners
            CHECK_BETWEEN(f.s.stretch_l2, 1.0, 1.1);
            fixture_free(&f);
            continue;
        }
        CHECK_ABS(f.s.stretch_l2, 1.0, 1e-5);
        CHECK_ABS(f.s.stretch_linf, 1.0, 1e-4);
        CHECK_ABS(f.s.area_distortion[0], 1.0, 1e-4);
        CHECK_ABS(f.s.angle_distortion, 1.0, 1e-5);
        CHECK_ABS(f.s.area_share_within, 1.0, 1e-9);
        fixture_free(&f);
    }
    enum
    {
        FACETS = 40
    };
    double inverse = 0.0, seen = 0.0, steepest = 0.0;
    for (int i = 0; i < FACETS; ++i)
    {
        const double phi = half_angle * (2.0 * (i + 0.5) / FACETS - 1.0);
        inverse += 1.0 / (cos(phi) * cos(phi)) / FACETS;
        seen += cos(phi) / FACETS;
        steepest = fmax(steepest, 1.0 / cos(phi));
    }
    test_about("cylinder");
    if (CHECK_EQUAL(sheet_atlas(cylinder_point, FACETS, SSS_ATLAS_ORTHOGRAPHIC, &f), 0))
    {
        CHECK_EQUAL(f.m.chart_count, 1);
        CHECK_REL(f.s.stretch_l2, sqrt(0.5 * (inverse + 1.0) * seen), 1e-5);
        CHECK_REL(f.s.stretch_linf, steepest * sqrt(seen), 1e-4);
        CHECK_REL(f.s.area_distortion[2], 1.0 / seen, 1e-3);
        fixture_free(&f);
    }
    test_about("cylinder unrolled");
    if (CHECK_EQUAL(sheet_atlas(cylinder_point, FACETS, SSS_ATLAS_AREA, &f), 0))
    {
        CHECK_BETWEEN(f.s.stretch_l2, 1.0 - 1e-9, 1.002);
        fixture_free(&f);
    }
    test_about("cap");
    if (CHECK_EQUAL(sheet_atlas(cap_point, 100, SSS_ATLAS_ORTHOGRAPHIC, &f), 0))
    {
        const double c = cos(half_angle), part = 0.5 * (1.0 + c); // of the surface that is seen
        CHECK_EQUAL(f.m.chart_count, 1);
        CHECK_REL(f.s.stretch_l2, sqrt(0.5 * (1.0 / c + 1.0) * part), 1e-3);
        CHECK_REL(f.s.stretch_linf, sqrt(part) / c, 1e-2);
        CHECK_REL(f.s.area_distortion[0], c / part, 1e-2);
        fixture_free(&f);
    }
}

// ================================================= 6. Options =================================================

static int atlas_of(int which, const sss_atlas_options *o, fixture *f)
{
    mesh_data mesh;
    return small_mesh(which, &mesh) == 0 ? fixture_make(f, &mesh, o, NULL) : 1;
}

static void charts_can_be_limited(void)
{   // Oracle: areas and counts found anew. max_area holds for every chart of more than a triangle; max_charts where
    // nothing had to be divided to lie flat; compactness shortens seams.
    fixture f;
    sss_atlas_options o = options_of(256, SSS_ATLAS_ORTHOGRAPHIC);
    for (int i = 0; i < 2; ++i)
    {
        o.max_area = i == 0 ? 20.0 : 100.0; // of 100 pi mm^2 * 4, the sphere's 1257
        test_about("at most %g mm^2", o.max_area);
        if (!CHECK_EQUAL(atlas_of(0, &o, &f), 0))
            continue;
        double *area = (double *)calloc(f.m.chart_count, sizeof *area), most = 0.0;
        for (size_t t = 0; t < f.T; ++t)
            area[f.m.chart[t]] += triangle_mm2(&f, t);
        for (size_t c = 0; c < f.m.chart_count; ++c)
            most = fmax(most, area[c]);
        CHECK_BETWEEN(most, 0.3 * o.max_area, o.max_area * (1.0 + 1e-9));
        CHECK_BETWEEN((double)f.m.chart_count, surface_mm2(&f) / o.max_area, 6.0 * surface_mm2(&f) / o.max_area);
        free(area);
        fixture_free(&f);
    }
    o.max_area = 0.0;
    for (int method = 0; method < 2; ++method)
    {
        o.method = (sss_atlas_method)method;
        for (o.max_charts = 6; o.max_charts <= 12; o.max_charts += 6)
        {
            test_about("at most %zu charts, %s", o.max_charts, method_names[method]);
            if (!CHECK_EQUAL(atlas_of(0, &o, &f), 0))
                continue;
            CHECK(f.m.chart_count <= o.max_charts + f.s.split_count);
            CHECK(f.s.split_count <= 2);
            check_mesh(&f);
            check_flat(&f);
            fixture_free(&f);
        }
    }
    o = options_of(256, SSS_ATLAS_ORTHOGRAPHIC);
    double seams[3];
    for (int i = 0; i < 3; ++i)
    {
        o.compactness = i == 0 ? -1.0 : i == 1 ? 0.0 : 10.0;
        seams[i] = atlas_of(0, &o, &f) == 0 ? f.s.seam_mm : (double)NAN;
        test_note("compactness %g: %zu charts, seams %.0f mm", o.compactness, f.m.chart_count, seams[i]);
        fixture_free(&f);
    }
    CHECK_BELOW(seams[2], 1.5 * seams[0]);
    test_about("an open sheet in one chart");
    mesh_data mesh;
    o = options_of(128, SSS_ATLAS_ORTHOGRAPHIC);
    if (mesh_sheet(20, 20, cylinder_point, &mesh) == 0 && CHECK_EQUAL(fixture_make(&f, &mesh, &o, NULL), 0))
    {
        CHECK_EQUAL(f.m.chart_count, 1);
        CHECK_EQUAL(f.m.vertex_count, f.V);
        CHECK_ABS(f.s.seam_mm, 0.0, 0.0);
        fixture_free(&f);
    }
}

static void density_sets_the_size(void)
{   // Oracle: areas in the texture. With a density the size follows: four times as many texels for twice the density.
    fixture f;
    for (int method = 0; method < 3; ++method)
    {
        double size[2] = {0.0, 0.0};
        for (int i = 0; i < 2; ++i)
        {
            sss_atlas_options o = options_of(0, (sss_atlas_method)method);
            o.texels_per_mm = i == 0 ? 5.0 : 10.0;
            o.gutter = 1;
            o.border = -1;
            test_about("%g texels/mm, %s", o.texels_per_mm, method_names[method]);
            if (!CHECK_EQUAL(atlas_of(0, &o, &f), 0))
                continue;
            const quality q = measure_quality(&f);
            CHECK_REL(f.s.texels_per_mm, o.texels_per_mm, 0.01);
            if (method != 0) // areas are kept, on the average
                CHECK_BETWEEN(1.0 / q.scale / o.texels_per_mm, 0.8, 1.2);
            else // none is larger than on the surface, and those that face their chart's normal are as large
                CHECK_REL(q.largest / q.scale / q.scale, o.texels_per_mm * o.texels_per_mm, 0.01);
            CHECK_EQUAL(f.s.size, f.x.size);
            CHECK_BETWEEN(f.s.utilisation, 0.35, 1.0);
            check_flat(&f);
            size[i] = (double)f.x.size;
            fixture_free(&f);
        }
        CHECK_BETWEEN(size[1] / size[0], 1.8, 2.2);
    }
}

static void every_size_works(void)
{   // Oracle: overlaps and areas, as above. Where nothing can fit the call says so.
    static const size_t sizes[] = {1, 2, 3, 7, 16, 1023};
    fixture f;
    for (size_t i = 0; i < COUNT(sizes); ++i)
        for (int which = 0; which < 2; ++which)
        {
            mesh_data mesh;
            sss_atlas_options o = options_of(sizes[i], SSS_ATLAS_ORTHOGRAPHIC);
            o.gutter = 1;
            o.border = -1;
            test_about("%s, size %zu", which == 0 ? "one triangle" : "sphere", sizes[i]);
            static const float corners[9] = {0.0f, 0.0f, 0.0f, 3.0f, 0.0f, 0.0f, 0.0f, 2.0f, 1.0f};
            static const uint32_t triangle[3] = {0, 1, 2};
            if ((which == 0 ? mesh_make(corners, 3, triangle, 1, &mesh) : small_mesh(0, &mesh)) != 0)
                continue;
            sss_atlas *atlas = NULL;
            const sss_mesh view = mesh_view(&mesh, 10.0);
            const sss_result result = sss_atlas_create(&view, &o, NULL, &atlas);
            sss_atlas_free(atlas);
            CHECK(result == SSS_OK || (result == SSS_ERROR_INVALID_ARGUMENT && sizes[i] < (which == 0 ? 3 : 32)));
            if (result != SSS_OK)
            {
                mesh_free(&mesh);
                continue;
            }
            if (!CHECK_EQUAL(fixture_make(&f, &mesh, &o, NULL), 0))
                continue;
            check_flat(&f);
            check_texels(&f);
            test_note("utilisation %.1f %%", 100.0 * f.s.utilisation);
            fixture_free(&f);
        }
    test_about("size 4096");
    sss_atlas_options o = options_of(4096, SSS_ATLAS_ORTHOGRAPHIC);
    if (CHECK_EQUAL(atlas_of(0, &o, &f), 0))
    {
        check_flat(&f);
        CHECK_BELOW(f.s.texel_area_error, 1e-6);
        CHECK_BETWEEN(f.s.utilisation, 0.5, 1.0);
        fixture_free(&f);
    }
}

static void rotations_help_and_defaults_are_named(void)
{   // Oracles: the declarations; the share of the texture that is covered.
    fixture f;
    double used[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3; ++i)
    {
        sss_atlas_options o = options_of(256, SSS_ATLAS_ORTHOGRAPHIC);
        o.rotations = i == 0 ? 1 : i == 1 ? 8 : 64;
        if (!CHECK_EQUAL(atlas_of(1, &o, &f), 0))
            continue;
        used[i] = check_flat(&f).utilisation;
        CHECK_EQUAL(f.s.rotations, o.rotations);
        fixture_free(&f);
    }
    test_note("utilisation with 1, 8, 64 rotations: %.1f, %.1f, %.1f %%", 100.0 * used[0], 100.0 * used[1],
              100.0 * used[2]);
    CHECK(used[1] > used[0] - 0.02 && used[2] > used[0] - 0.02);
    mesh_data mesh;
    if (small_mesh(0, &mesh) != 0 || !CHECK_EQUAL(fixture_make(&f, &mesh, NULL, NULL), 0))
        return;
    CHECK(f.s.normal_deviation == 30.0 && f.s.compactness == 1.0 && f.s.size == 1024 && f.x.size == 1024);
    CHECK(f.s.border == 1 && f.s.gutter == 2 && f.s.corners == 8 && f.s.rotations == 8);
    CHECK(f.s.method == SSS_ATLAS_ORTHOGRAPHIC && f.s.texels_per_mm > 0.0);
    fixture_free(&f);
    CHECK(small_atlas(0, SSS_ATLAS_AREA) != NULL && small_atlas(0, SSS_ATLAS_AREA)->s.normal_deviation == 50.0);
}

// ---- Determinism ----

static bytes saved(const sss_atlas *atlas)
{
    bytes b;
    memset(&b, 0, sizeof b);
    b.fail_at = -1;
    CHECK_EQUAL(sss_atlas_save(atlas, write_bytes, &b), SSS_OK);
    return b;
}

static void splitting_changes_no_bit(void)
{   // Oracle: the bytes that are saved, everything among them: on three threads, and item by item in a shuffled order.
    for (int which = 0; which < SMALL_MESHES; ++which)
    {
        const sss_atlas_options o = options_of(200, (sss_atlas_method)which);
        bytes b[3];
        int calls = 0;
        memset(b, 0, sizeof b);
        test_about("%s, %s", small_names[which], method_names[which]);
        for (int i = 0; i < 3; ++i)
        {
            mesh_data mesh;
            fixture f;
            sss_hooks hooks;
            memset(&hooks, 0, sizeof hooks);
            hooks.parallel_for = i == 0 ? NULL : i == 1 ? threads_for : shuffled_for;
            hooks.user = i == 1 ? &calls : NULL;
            if (small_mesh(which, &mesh) != 0 || fixture_make(&f, &mesh, &o, &hooks) != 0)
                continue;
            b[i] = saved(f.atlas);
            fixture_free(&f);
        }
        if (b[0].data != NULL)
        {
            CHECK(calls > 0);
            CHECK(b[0].count == b[1].count && memcmp(b[0].data, b[1].data, b[0].count) == 0);
            CHECK(b[0].count == b[2].count && memcmp(b[0].data, b[2].data, b[0].count) == 0);
        }
        for (int i = 0; i < 3; ++i)
            free(b[i].data);
    }
}

// ================================================= 7. Keeping =================================================

static int same_arrays(const fixture *a, const fixture *b)
{
    const size_t texels = a->x.size * a->x.size;
    return a->m.vertex_count == b->m.vertex_count && a->m.chart_count == b->m.chart_count &&
           a->x.count == b->x.count && a->x.inner_count == b->x.inner_count && a->x.size == b->x.size &&
           memcmp(a->m.uv, b->m.uv, 2 * a->m.vertex_count * sizeof(float)) == 0 &&
           memcmp(a->m.vertex, b->m.vertex, a->m.vertex_count * sizeof(uint32_t)) == 0 &&
           memcmp(a->m.triangles, b->m.triangles, 3 * a->T * sizeof(uint32_t)) == 0 &&
           memcmp(a->m.chart, b->m.chart, a->T * sizeof(uint32_t)) == 0 &&
           memcmp(a->m.stretch, b->m.stretch, a->T * sizeof(float)) == 0 &&
           memcmp(a->m.area_ratio, b->m.area_ratio, a->T * sizeof(float)) == 0 &&
           memcmp(a->m.chart_normal, b->m.chart_normal, 3 * a->m.chart_count * sizeof(float)) == 0 &&
           memcmp(a->x.texel, b->x.texel, a->x.count * sizeof(uint32_t)) == 0 &&
           memcmp(a->x.triangle, b->x.triangle, a->x.count * sizeof(uint32_t)) == 0 &&
           memcmp(a->x.barycentric, b->x.barycentric, 3 * a->x.count * sizeof(float)) == 0 &&
           memcmp(a->x.position, b->x.position, 3 * a->x.count * sizeof(float)) == 0 &&
           memcmp(a->x.normal, b->x.normal, 3 * a->x.count * sizeof(float)) == 0 &&
           memcmp(a->x.area, b->x.area, a->x.count * sizeof(float)) == 0 &&
           memcmp(a->x.area_ratio, b->x.area_ratio, a->x.count * sizeof(float)) == 0 &&
           memcmp(a->x.entry, b->x.entry, texels * sizeof(uint32_t)) == 0 &&
           memcmp(a->x.vertex_entry, b->x.vertex_entry, a->V * sizeof(uint32_t)) == 0 &&
           memcmp(a->x.entry_vertex, b->x.entry_vertex, a->x.count * sizeof(uint32_t)) == 0;
}

static sss_result load_from(bytes *b, const sss_mesh *mesh, const sss_hooks *hooks, sss_atlas **out)
{
    b->read = 0;
    return sss_atlas_load(mesh, read_bytes, b, hooks, out);
}

static void what_is_saved_comes_back(void)
{   // Oracle: the arrays themselves, the stats, and the bytes of saving again. A copy that was loaded works.
    for (int which = 0; which < SMALL_MESHES; ++which)
    {
        fixture f, g;
        const sss_atlas_options o = options_of(128, (sss_atlas_method)which);
        test_about("%s", small_names[which]);
        if (atlas_of(which, &o, &f) != 0)
            continue;
        bytes b = saved(f.atlas);
        g = f;
        g.atlas = NULL;
        CHECK_EQUAL(load_from(&b, &f.view, NULL, &g.atlas), SSS_OK);
        CHECK_EQUAL(b.read, b.count);
        CHECK(sss_atlas_get_mesh(g.atlas, &g.m) == SSS_OK && sss_atlas_get_texels(g.atlas, &g.x) == SSS_OK &&
              sss_atlas_get_stats(g.atlas, &g.s) == SSS_OK);
        CHECK(same_arrays(&f, &g));
        CHECK(f.s.chart_count == g.s.chart_count && f.s.stretch_l2 == g.s.stretch_l2 &&
              f.s.utilisation == g.s.utilisation && f.s.seam_mm == g.s.seam_mm && f.s.size == g.s.size &&
              f.s.texel_area_error == g.s.texel_area_error && f.s.texels_per_mm == g.s.texels_per_mm);
        bytes again = saved(g.atlas);
        CHECK(b.count == again.count && memcmp(b.data, again.data, b.count) == 0);
        test_note("%zu bytes", b.count);
        free(b.data);
        free(again.data);
        sss_atlas_free(g.atlas);
        fixture_free(&f);
    }
}

static sss_atlas *untouched(void)
{
    static char somewhere;
    return (sss_atlas *)(void *)&somewhere;
}

// One triangle on 4 x 4 texels: a small file.
static int small_file(fixture *f, bytes *b)
{
    static const float corners[12] = {0.0f, 0.0f, 0.0f, 3.0f, 0.0f, 0.0f, 0.0f, 2.0f, 1.0f, 3.0f, 2.0f, 1.0f};
    static const uint32_t triangles[6] = {0, 1, 2, 2, 1, 3};
    sss_atlas_options o = options_of(4, SSS_ATLAS_ORTHOGRAPHIC);
    mesh_data mesh;
    o.border = -1;
    o.gutter = 1;
    if (mesh_make(corners, 4, triangles, 2, &mesh) != 0 || fixture_make(f, &mesh, &o, NULL) != 0)
        return 1;
    *b = saved(f->atlas);
    return 0;
}

static void damaged_files_are_refused(void)
{   // Oracle: none of them is what was saved. Cut at every length; every byte turned over and every bit; another mesh,
    // another scale.
    fixture f;
    bytes b;
    int refused = 1, alone = 1, codes = 1;
    if (!CHECK_EQUAL(small_file(&f, &b), 0))
        return;
    test_note("%zu bytes", b.count);
    const size_t whole = b.count;
    for (size_t length = 0; length < whole; ++length)
    {
        sss_atlas *atlas = untouched();
        b.count = length;
        refused &= load_from(&b, &f.view, NULL, &atlas) == SSS_ERROR_BAD_DATA;
        alone &= atlas == untouched();
    }
    b.count = whole;
    CHECK(refused && alone);
    for (size_t i = 0; i < whole; ++i)
        for (int bit = 0; bit < 9; ++bit)
        {
            sss_atlas *atlas = untouched();
            const unsigned char mask = (unsigned char)(bit == 8 ? 0xff : 1 << bit);
            b.data[i] ^= mask;
            const sss_result result = load_from(&b, &f.view, NULL, &atlas);
            codes &= result == SSS_ERROR_BAD_DATA || result == SSS_ERROR_BAD_VERSION || result == SSS_ERROR_MISMATCH ||
                     result == SSS_ERROR_OUT_OF_MEMORY;
            alone &= atlas == untouched();
            b.data[i] ^= mask;
        }
    CHECK(codes && alone);
    sss_atlas *atlas = untouched();
    sss_mesh other = f.view;
    other.mm_per_unit *= 1.5;
    CHECK_EQUAL(load_from(&b, &other, NULL, &atlas), SSS_ERROR_MISMATCH);
    other = f.view;
    f.mesh.positions[4] += 0.125f;
    CHECK_EQUAL(load_from(&b, &other, NULL, &atlas), SSS_ERROR_MISMATCH);
    f.mesh.positions[4] -= 0.125f;
    other.triangle_count = 1;
    CHECK_EQUAL(load_from(&b, &other, NULL, &atlas), SSS_ERROR_MISMATCH);
    other = f.view;
    other.vertex_count = 3;
    CHECK(load_from(&b, &other, NULL, &atlas) != SSS_OK);
    CHECK_EQUAL(load_from(&b, NULL, NULL, &atlas), SSS_ERROR_INVALID_ARGUMENT);
    CHECK_EQUAL(sss_atlas_load(&f.view, NULL, &b, NULL, &atlas), SSS_ERROR_INVALID_ARGUMENT);
    CHECK_EQUAL(load_from(&b, &f.view, NULL, NULL), SSS_ERROR_INVALID_ARGUMENT);
    CHECK(atlas == untouched());
    CHECK_EQUAL(load_from(&b, &f.view, NULL, &atlas), SSS_OK);
    sss_atlas_free(atlas);
    // Writing that fails at any call.
    int stopped = 0, k = 0;
    for (; k < 10000; ++k)
    {
        bytes w;
        memset(&w, 0, sizeof w);
        w.fail_at = k;
        const sss_result result = sss_atlas_save(f.atlas, write_bytes, &w);
        free(w.data);
        if (result == SSS_OK)
            break;
        stopped += result == SSS_ERROR_CANCELLED;
    }
    CHECK(k > 0 && stopped == k);
    CHECK_EQUAL(sss_atlas_save(NULL, write_bytes, &b), SSS_ERROR_INVALID_ARGUMENT);
    CHECK_EQUAL(sss_atlas_save(f.atlas, NULL, &b), SSS_ERROR_INVALID_ARGUMENT);
    free(b.data);
    fixture_free(&f);
}

// An allocator with little to give, that notes the largest wish.
typedef struct miser
{
    size_t limit, largest;
    int live;
} miser;

static void *miser_allocate(void *user, size_t count)
{
    miser *m = (miser *)user;
    void *block;
    m->largest = count > m->largest ? count : m->largest;
    if (count > m->limit || (block = malloc(count)) == NULL)
        return NULL;
    m->live++;
    return block;
}

static void miser_release(void *user, void *pointer)
{
    ((miser *)user)->live--;
    free(pointer);
}

static void hostile_counts_ask_for_no_more(void)
{   // Oracle: an allocator. Every four and every eight bytes of a file in turn hold enormous and odd numbers; loading
    // fails, nothing leaks, and in an instant.
    static const uint64_t numbers[] = {UINT64_MAX, UINT64_MAX / 2, (uint64_t)1 << 62, UINT32_MAX, 0x7fffffffu, 0, 1,
                                       16384, 0xfffffff0u};
    fixture f;
    bytes b;
    miser m = {1 << 20, 0, 0};
    sss_hooks hooks;
    int refused = 1, alone = 1;
    if (!CHECK_EQUAL(small_file(&f, &b), 0))
        return;
    memset(&hooks, 0, sizeof hooks);
    hooks.user = &m;
    hooks.allocate = miser_allocate;
    hooks.release = miser_release;
    const double start = cpu_seconds();
    for (size_t i = 0; i + 8 <= b.count; ++i)
        for (size_t k = 0; k < 2 * COUNT(numbers); ++k)
        {
            unsigned char kept[8];
            sss_atlas *atlas = untouched();
            const size_t width = k % 2 == 0 ? 8 : 4;
            memcpy(kept, b.data + i, 8);
            memcpy(b.data + i, &numbers[k / 2], width);
            if (memcmp(kept, b.data + i, 8) != 0)
            {
                const sss_result result = load_from(&b, &f.view, &hooks, &atlas);
                refused &= result == SSS_ERROR_BAD_DATA || result == SSS_ERROR_BAD_VERSION ||
                           result == SSS_ERROR_MISMATCH || result == SSS_ERROR_OUT_OF_MEMORY;
                alone &= atlas == untouched() && m.live == 0;
            }
            memcpy(b.data + i, kept, 8);
        }
    CHECK(refused && alone);
    CHECK_BELOW(cpu_seconds() - start, 10.0);
    test_note("largest wish %zu bytes", m.largest);
    free(b.data);
    fixture_free(&f);
}

// ================================================= 8. Conduct =================================================

static void version_and_shader_text(void)
{   // Oracles: the header's first line; the declaration of the text. What it computes: tests/test_glsl.c.
    CHECK_EQUAL(version_in_first_line("sss_atlas.h"), SSS_ATLAS_VERSION);
    for (int piece = 0; piece < 2; ++piece)
    {
        const char *text = sss_atlas_glsl((sss_atlas_glsl_piece)piece);
        CHECK(text != NULL && strlen(text) > 40 && strlen(text) < 4095 && strstr(text, "#version") == NULL);
    }
    CHECK(sss_atlas_glsl((sss_atlas_glsl_piece)2) == NULL && sss_atlas_glsl((sss_atlas_glsl_piece)-1) == NULL);
}

// The calls that must be refused, each with its code and without touching the output.
static void refused(const sss_mesh *mesh, const sss_atlas_options *options, const sss_hooks *hooks, sss_result want,
                    const char *name)
{
    sss_atlas *atlas = untouched();
    test_about("%s", name);
    CHECK_EQUAL(sss_atlas_create(mesh, options, hooks, &atlas), want);
    CHECK(atlas == untouched());
    if (atlas != untouched())
        sss_atlas_free(atlas);
}

static void bad_meshes_are_refused(void)
{   // Oracle: the declarations.
    mesh_data mesh;
    const sss_result invalid = SSS_ERROR_INVALID_ARGUMENT;
    if (mesh_closed_sphere(2, 1.0, &mesh) != 0)
        SKIP("out of memory");
    const sss_mesh good = mesh_view(&mesh, 10.0);
    const sss_atlas_options o = options_of(64, SSS_ATLAS_ORTHOGRAPHIC);
    sss_mesh m = good;
    refused(NULL, &o, NULL, invalid, "no mesh");
    CHECK_EQUAL(sss_atlas_create(&good, &o, NULL, NULL), invalid);
    m.positions = NULL;
    refused(&m, &o, NULL, invalid, "no positions");
    m = good;
    m.triangles = NULL;
    refused(&m, &o, NULL, invalid, "no triangles");
    m = good;
    m.triangle_count = 0;
    refused(&m, &o, NULL, SSS_ERROR_EMPTY, "zero triangles");
    m = good;
    m.vertex_count = 0;
    refused(&m, &o, NULL, SSS_ERROR_EMPTY, "zero vertices");
    m = good;
    m.vertex_count = mesh.vertex_count - 1;
    refused(&m, &o, NULL, SSS_ERROR_INDEX, "an index out of range");
    m = good;
    m.vertex_count = SIZE_MAX / 4;
    refused(&m, &o, NULL, SSS_ERROR_OVERFLOW, "too many vertices");
    m = good;
    m.triangle_count = SIZE_MAX / 4;
    refused(&m, &o, NULL, SSS_ERROR_OVERFLOW, "too many triangles");
    static const double units[5] = {0.0, -1.0, (double)NAN, HUGE_VAL, 1e200};
    for (size_t k = 0; k < 5; ++k)
    {
        m = good;
        m.mm_per_unit = units[k];
        refused(&m, &o, NULL, invalid, "mm_per_unit");
    }
    const float kept = mesh.positions[7];
    mesh.positions[7] = NAN;
    refused(&good, &o, NULL, invalid, "a position that is no number");
    mesh.positions[7] = INFINITY;
    refused(&good, &o, NULL, invalid, "an infinite position");
    mesh.positions[7] = kept;
    const float normal = mesh.normals[7];
    mesh.normals[7] = NAN;
    refused(&good, &o, NULL, invalid, "a normal that is no number");
    mesh.normals[7] = normal;
    ledger l;
    sss_hooks hooks = ledger_hooks(&l, 1);
    hooks.release = NULL;
    refused(&good, &o, &hooks, invalid, "allocate without release");
    sss_atlas *atlas = NULL;
    CHECK_EQUAL(sss_atlas_create(&good, &o, NULL, &atlas), SSS_OK);
    sss_atlas_free(atlas);
    mesh_free(&mesh);
}

static void bad_options_are_refused(void)
{   // Oracle: the ranges beside the fields.
    mesh_data mesh;
    const size_t numbers[4] = {offsetof(sss_atlas_options, normal_deviation), offsetof(sss_atlas_options, compactness),
                               offsetof(sss_atlas_options, max_area), offsetof(sss_atlas_options, texels_per_mm)};
    static const double bad[4][3] = {{-1.0, 85.5, HUGE_VAL}, {10.5, 11.0, HUGE_VAL}, {-1.0, -HUGE_VAL, -1e-9},
                                     {-1.0, HUGE_VAL, -1e-9}};
    const size_t counts[4] = {offsetof(sss_atlas_options, border), offsetof(sss_atlas_options, gutter),
                              offsetof(sss_atlas_options, corners), offsetof(sss_atlas_options, rotations)};
    static const int wrong[4][3] = {{65, 1000, 2147483647}, {129, -1, 2147483647}, {65, 2, -1}, {65, -1, 2147483647}};
    if (mesh_closed_sphere(2, 1.0, &mesh) != 0)
        SKIP("out of memory");
    const sss_mesh view = mesh_view(&mesh, 10.0);
    for (size_t field = 0; field < 4; ++field)
        for (size_t k = 0; k < 4; ++k)
        {
            char name[64];
            sss_atlas_options o = options_of(field == 3 ? 0 : 64, SSS_ATLAS_CONVEX);
            const double value = k < 3 ? bad[field][k] : (double)NAN;
            memcpy((char *)&o + numbers[field], &value, sizeof value);
            (void)snprintf(name, sizeof name, "number %zu is %g", field, value);
            refused(&view, &o, NULL, SSS_ERROR_INVALID_ARGUMENT, name);
            if (k == 3)
                continue;
            o = options_of(64, SSS_ATLAS_CONVEX);
            memcpy((char *)&o + counts[field], &wrong[field][k], sizeof(int));
            (void)snprintf(name, sizeof name, "count %zu is %d", field, wrong[field][k]);
            refused(&view, &o, NULL, SSS_ERROR_INVALID_ARGUMENT, name);
        }
    sss_atlas_options o = options_of(16385, SSS_ATLAS_ORTHOGRAPHIC);
    refused(&view, &o, NULL, SSS_ERROR_INVALID_ARGUMENT, "too large a size");
    o = options_of(64, SSS_ATLAS_ORTHOGRAPHIC);
    o.texels_per_mm = 1.0;
    refused(&view, &o, NULL, SSS_ERROR_INVALID_ARGUMENT, "a size and a density");
    o = options_of(64, (sss_atlas_method)9);
    refused(&view, &o, NULL, SSS_ERROR_INVALID_ARGUMENT, "no such method");
    o = options_of(0, SSS_ATLAS_ORTHOGRAPHIC);
    o.texels_per_mm = 1e6;
    refused(&view, &o, NULL, SSS_ERROR_INVALID_ARGUMENT, "a density that needs too large a texture");
    o = options_of(4, SSS_ATLAS_ORTHOGRAPHIC);
    o.max_area = 1.0;
    refused(&view, &o, NULL, SSS_ERROR_INVALID_ARGUMENT, "more charts than texels");
    mesh_free(&mesh);
}

static void bad_calls_are_refused(void)
{   // Oracle: the declarations. Nothing is touched, and the object works as before.
    fixture f;
    const sss_result invalid = SSS_ERROR_INVALID_ARGUMENT;
    const sss_atlas_options o = options_of(64, SSS_ATLAS_ORTHOGRAPHIC);
    if (!CHECK_EQUAL(atlas_of(0, &o, &f), 0))
        return;
    sss_atlas_stats s;
    sss_atlas_mesh m;
    sss_atlas_texels x;
    CHECK_EQUAL(sss_atlas_get_stats(NULL, &s), invalid);
    CHECK_EQUAL(sss_atlas_get_stats(f.atlas, NULL), invalid);
    CHECK_EQUAL(sss_atlas_get_mesh(NULL, &m), invalid);
    CHECK_EQUAL(sss_atlas_get_mesh(f.atlas, NULL), invalid);
    CHECK_EQUAL(sss_atlas_get_texels(NULL, &x), invalid);
    CHECK_EQUAL(sss_atlas_get_texels(f.atlas, NULL), invalid);
    float *values = (float *)calloc(17 * f.x.count, sizeof *values);
    size_t touched = 0;
    float *image = (float *)malloc(17 * 4096 * sizeof *image), out[17], weights[3] = {0.25f, 0.5f, 0.25f};
    uint32_t triangle = 5;
    memset(image, 0x7f, 17 * 4096 * sizeof *image);
    memset(out, 0x7f, sizeof out);
    CHECK_EQUAL(sss_atlas_fill_image(NULL, values, 1, 1, image), invalid);
    CHECK_EQUAL(sss_atlas_fill_image(f.atlas, NULL, 1, 1, image), invalid);
    CHECK_EQUAL(sss_atlas_fill_image(f.atlas, values, 1, 1, NULL), invalid);
    CHECK_EQUAL(sss_atlas_fill_image(f.atlas, values, 0, 1, image), invalid);
    CHECK_EQUAL(sss_atlas_fill_image(f.atlas, values, 17, 1, image), invalid);
    CHECK_EQUAL(sss_atlas_fill_image(f.atlas, values, 1, 1025, image), invalid);
    values[f.x.count - 1] = NAN;
    CHECK_EQUAL(sss_atlas_fill_image(f.atlas, values, 1, 1, image), invalid);
    values[f.x.count - 1] = INFINITY;
    CHECK_EQUAL(sss_atlas_fill_image(f.atlas, values, 1, 1, image), invalid);
    values[f.x.count - 1] = 0.0f;
    CHECK_EQUAL(((unsigned char *)image)[77], 0x7f);
    CHECK_EQUAL(sss_atlas_fetch(NULL, image, 1, &triangle, weights, 1, out), invalid);
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, NULL, 1, &triangle, weights, 1, out), invalid);
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 0, &triangle, weights, 1, out), invalid);
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 17, &triangle, weights, 1, out), invalid);
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 1, NULL, weights, 1, out), invalid);
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 1, &triangle, NULL, 1, out), invalid);
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 1, &triangle, weights, 1, NULL), invalid);
    triangle = (uint32_t)f.T;
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 1, &triangle, weights, 1, out), SSS_ERROR_INDEX);
    triangle = 5;
    weights[1] = NAN;
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 1, &triangle, weights, 1, out), invalid);
    weights[1] = INFINITY;
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 1, &triangle, weights, 1, out), invalid);
    weights[1] = 0.5f;
    for (size_t i = 0; i < sizeof out; ++i)
        touched += ((unsigned char *)out)[i] != 0x7f;
    CHECK_EQUAL(touched, 0);
    for (size_t i = 0; i < 16 * f.x.count; ++i)
        values[i] = 3.0f;
    CHECK_EQUAL(sss_atlas_fill_image(f.atlas, values, 16, 1024, image), SSS_OK);
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 16, &triangle, weights, 1, out), SSS_OK);
    CHECK_REL((double)out[15], 3.0, 1e-6);
    const float far_off[3] = {1e30f, -1e30f, 1.0f}; // clamped to the image's edge
    out[15] = 0.0f;
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 16, &triangle, far_off, 1, out), SSS_OK);
    CHECK_REL((double)out[15], 3.0, 1e-6);
    CHECK_EQUAL(sss_atlas_fetch(f.atlas, image, 16, NULL, NULL, 0, NULL), invalid);
    sss_atlas_free(NULL);
    free(values);
    free(image);
    fixture_free(&f);
}

// From the mesh through every function that may allocate; stops at the first error.
static sss_result whole_way(const sss_mesh *mesh, const sss_atlas_options *o, const sss_hooks *hooks, bytes *b)
{
    sss_atlas *atlas = untouched(), *again = untouched();
    sss_atlas_texels x;
    float *values = NULL, *image = NULL;
    sss_result result = sss_atlas_create(mesh, o, hooks, &atlas);
    if (result != SSS_OK)
        return atlas == untouched() ? result : SSS_ERROR_BAD_DATA; // an output was touched
    result = sss_atlas_get_texels(atlas, &x);
    values = (float *)calloc(2 * x.count + 1, sizeof *values);
    image = (float *)calloc(2 * x.size * x.size, sizeof *image);
    if (result == SSS_OK)
        result = sss_atlas_fill_image(atlas, values, 2, 3, image);
    b->count = b->read = 0;
    b->fail_at = -1;
    if (result == SSS_OK)
        result = sss_atlas_save(atlas, write_bytes, b);
    if (result == SSS_OK)
    {
        result = sss_atlas_load(mesh, read_bytes, b, hooks, &again);
        if (result == SSS_OK)
            sss_atlas_free(again);
        else if (again != untouched())
            result = SSS_ERROR_BAD_DATA;
    }
    free(values);
    free(image);
    sss_atlas_free(atlas);
    return result;
}

// A folded, non-manifold, partly degenerate thing of few triangles in several parts.
static int odd_mesh(mesh_data *out)
{
    static const float p[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5f, 0.5f, 1, 0.5f, 0.5f, -1, 3, 0, 0, 4, 0, 0,
                              3, 1, 0, 3, 0, 0, 9, 9, 9};
    static const uint32_t t[] = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 1, 0, 5, 2, 1, 5, 3, 2, 5, 0, 3, 5, // octahedron
                                 0, 1, 2, 0, 2, 3,              // its middle: edges of three triangles
                                 6, 7, 8, 6, 7, 8, 7, 6, 8,     // one twice, and once the other way round
                                 6, 6, 7, 6, 9, 7, 9, 9, 9};    // without area: a corner twice, a place twice, a point
    return mesh_make(p, COUNT(p) / 3, t, COUNT(t) / 3, out);
}

static void every_allocation_may_fail(void)
{   // Oracle: a ledger under hooks.allocate. Call k gives NULL, for every k: out of memory, nothing leaks, and the same
    // call then works, with the bits it gives without hooks.
    mesh_data mesh;
    if (odd_mesh(&mesh) != 0)
        SKIP("out of memory");
    const sss_mesh view = mesh_view(&mesh, 10.0);
    for (int method = 0; method < 3; ++method)
    {
        const sss_atlas_options o = options_of(48, (sss_atlas_method)method);
        bytes plain, b;
        ledger l;
        int k = 0, said_so = 1, clean = 1;
        memset(&plain, 0, sizeof plain);
        memset(&b, 0, sizeof b);
        test_about("%s", method_names[method]);
        CHECK_EQUAL(whole_way(&view, &o, NULL, &plain), SSS_OK);
        memset(&l, 0, sizeof l);
        for (; k < 20000; ++k)
        {
            sss_hooks hooks = ledger_hooks(&l, 1);
            l.fail_at = k;
            const sss_result result = whole_way(&view, &o, &hooks, &b);
            clean &= l.live == 0;
            if (result == SSS_OK && l.calls <= k)
                break; // no call k any more
            said_so &= result == SSS_ERROR_OUT_OF_MEMORY;
        }
        CHECK_BETWEEN((double)k, 3.0, 19999.0);
        CHECK(said_so && clean);
        CHECK(plain.count == b.count && memcmp(plain.data, b.data, b.count) == 0);
        CHECK(l.fractions_fine && l.progress_calls > 0 && l.fractions_fell <= 1); // created, then loaded
        test_note("%d allocations, %d calls of progress", k, l.progress_calls);
        free(plain.data);
        free(b.data);
    }
    mesh_free(&mesh);
}

static void bytes_are_counted(void)
{   // Oracle: a ledger.
    mesh_data mesh;
    fixture f;
    ledger l;
    const sss_hooks hooks = ledger_hooks(&l, 0);
    const sss_atlas_options o = options_of(256, SSS_ATLAS_ORTHOGRAPHIC);
    if (small_mesh(0, &mesh) != 0 || !CHECK_EQUAL(fixture_make(&f, &mesh, &o, &hooks), 0))
        return;
    CHECK_BETWEEN((double)f.s.bytes / (double)l.bytes, 0.9, 1.1);
    test_note("%zu bytes live, %zu at the peak", l.bytes, l.peak);
    fixture_free(&f);
    CHECK_EQUAL(l.live, 0);
}

static void progress_may_cancel(void)
{   // Oracle: a ledger under hooks.progress. Cancelled at each call: the code says so, the output is untouched, nothing
    // leaks.
    mesh_data mesh;
    ledger l;
    int k = 0, cancelled = 0, alone = 1;
    const sss_atlas_options o = options_of(64, SSS_ATLAS_AREA);
    if (odd_mesh(&mesh) != 0)
        SKIP("out of memory");
    const sss_mesh view = mesh_view(&mesh, 10.0);
    for (; k < 10000; ++k)
    {
        sss_atlas *atlas = untouched();
        sss_hooks hooks = ledger_hooks(&l, 1);
        l.cancel_at = k;
        const sss_result result = sss_atlas_create(&view, &o, &hooks, &atlas);
        if (result == SSS_OK)
        {
            sss_atlas_free(atlas);
            alone &= l.progress_calls <= k;
            break;
        }
        cancelled += result == SSS_ERROR_CANCELLED;
        alone &= atlas == untouched() && l.live == 0;
    }
    CHECK(k > 2 && cancelled == k);
    CHECK(alone);
    CHECK(l.fractions_fine);
    CHECK_BETWEEN(l.last_fraction, 0.5, 1.0);
    CHECK_EQUAL(l.fractions_fell, 0);
    test_note("%d calls of progress", l.progress_calls);
    mesh_free(&mesh);
}

// ---- Meshes that nobody would draw ----

// An atlas that is right, or a refusal; 1 where there was one. The limit is in seconds.
static int survives(mesh_data *mesh, const sss_atlas_options *o, double mm_per_unit, double limit, const char *name)
{
    fixture f;
    sss_atlas *atlas = NULL;
    const sss_mesh view = mesh_view(mesh, mm_per_unit);
    test_about("%s", name);
    const double start = cpu_seconds();
    const sss_result result = sss_atlas_create(&view, o, NULL, &atlas);
    CHECK_BELOW(cpu_seconds() - start, limit);
    if (result != SSS_OK)
    {
        test_note("refused: %s", sss_result_string(result));
        mesh_free(mesh);
        return 0;
    }
    memset(&f, 0, sizeof f);
    f.mesh = *mesh;
    memset(mesh, 0, sizeof *mesh);
    f.view = view;
    f.T = view.triangle_count;
    f.V = view.vertex_count;
    f.atlas = atlas;
    f.extent = fmax(mesh_extent(&f.mesh), (double)FLT_MIN);
    CHECK(sss_atlas_get_mesh(atlas, &f.m) == SSS_OK && sss_atlas_get_texels(atlas, &f.x) == SSS_OK &&
          sss_atlas_get_stats(atlas, &f.s) == SSS_OK);
    const mesh_errors e = measure_mesh(&f, f.s.normal_deviation);
    CHECK_EQUAL(e.bad_numbers, 0);
    CHECK_EQUAL(e.shared, 0);
    CHECK_EQUAL(e.needless, 0);
    CHECK_EQUAL(e.empty_charts, 0);
    const flat_errors flat = measure_flat(&f);
    CHECK_EQUAL(flat.bad_numbers, 0);
    CHECK_EQUAL(flat.turned, 0);
    CHECK_EQUAL(flat.overlaps, 0);
    const texel_errors x = measure_texels(&f);
    CHECK_EQUAL(x.order, 0);
    CHECK_EQUAL(x.missing, 0);
    CHECK_EQUAL(x.wrong_triangle, 0);
    CHECK_BELOW(x.range, 1e-6);
    const double surface = surface_mm2(&f), texels = (double)(f.x.size * f.x.size);
    if (surface < 1e3 * texels * (double)FLT_MIN || surface > 1e-3 * (double)FLT_MAX)
        test_note("areas of %.1e mm^2 do not fit into floats", surface);
    else
    {
        CHECK_BELOW(x.sum, 1e-6);
        CHECK_ABS(f.s.texel_area_error, x.sum, 1e-6);
    }
    double far_away = 0.0; // coordinates are floats
    for (size_t i = 0; i < 3 * f.V; ++i)
        far_away = fmax(far_away, fabs((double)f.view.positions[i]));
    CHECK_BELOW(x.position, 1e-6 + 2.0 * (double)FLT_EPSILON * far_away / f.extent);
    test_note("%zu charts, utilisation %.1f %%, %zu without texture area", f.m.chart_count, 100.0 * f.s.utilisation,
              flat.vanished);
    fixture_free(&f);
    return 1;
}

// A mesh of a million possibilities: corners drawn at random.
static int random_soup(size_t vertices, size_t triangles, mesh_data *out)
{
    float *p = (float *)malloc(3 * vertices * sizeof *p);
    uint32_t *t = (uint32_t *)malloc(3 * triangles * sizeof *t);
    for (size_t i = 0; i < 3 * vertices; ++i)
        p[i] = (float)random_unit();
    for (size_t i = 0; i < 3 * triangles; ++i)
        t[i] = (uint32_t)(random_unit() * (double)vertices);
    const int result = mesh_make(p, vertices, t, triangles, out);
    free(p);
    free(t);
    return result;
}

static void hostile_meshes(void)
{   // Oracle: an atlas that passes the checks above, or an error, in little time. One triangle; a closed tetrahedron;
    // folds, double and degenerate triangles; nothing but those; one triangle a thousand times; a fan of needles; soups
    // whose triangles share vertices at random; a book of leaves on one edge; a Moebius strip.
    mesh_data m;
    for (int method = 0; method < 3; ++method)
    {
        static const float tetra[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
        static const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
        char name[64];
        sss_atlas_options o = options_of(64, (sss_atlas_method)method);
        (void)snprintf(name, sizeof name, "one triangle, %s", method_names[method]);
        CHECK(mesh_make(tetra, 4, faces, 1, &m) == 0 && survives(&m, &o, 1.0, 1.0, name));
        (void)snprintf(name, sizeof name, "tetrahedron, %s", method_names[method]);
        CHECK(mesh_make(tetra, 4, faces, 4, &m) == 0 && survives(&m, &o, 1.0, 1.0, name));
        o.normal_deviation = 85.0;
        CHECK(mesh_make(tetra, 4, faces, 4, &m) == 0 && survives(&m, &o, 1.0, 1.0, name));
        (void)snprintf(name, sizeof name, "odd mesh, %s", method_names[method]);
        o = options_of(128, (sss_atlas_method)method);
        CHECK(odd_mesh(&m) == 0 && survives(&m, &o, 1.0, 1.0, name));
        random_seed(8);
        (void)snprintf(name, sizeof name, "soup, %s", method_names[method]);
        o = options_of(256, (sss_atlas_method)method);
        CHECK(random_soup(40, 150, &m) == 0 && survives(&m, &o, 1.0, 10.0, name));
    }
    float p[3 * 400];
    uint32_t t[3 * 1000];
    sss_atlas_options o = options_of(256, SSS_ATLAS_ORTHOGRAPHIC);
    memset(p, 0, sizeof p);
    memset(t, 0, sizeof t);
    for (uint32_t i = 0; i < 150; ++i)
        t[i] = i / 6 % 10;
    for (uint32_t i = 0; i < 60; ++i)
        p[i] = (float)(i % 7);
    CHECK(mesh_make(p, 20, t, 50, &m) == 0);
    (void)survives(&m, &o, 1.0, 1.0, "nothing but degenerate triangles");
    memset(p, 0, sizeof p);
    CHECK(mesh_make(p, 20, t, 50, &m) == 0);
    (void)survives(&m, &o, 1.0, 1.0, "everything in one point");
    p[3] = p[7] = 1.0f;
    for (uint32_t i = 0; i < 3000; ++i)
        t[i] = i % 3;
    CHECK(mesh_make(p, 3, t, 1000, &m) == 0);
    CHECK(survives(&m, &o, 1.0, 2.0, "one triangle a thousand times"));
    for (uint32_t i = 0; i < 300; ++i)
    {
        const double angle = 2.0 * PI * i / 300.0;
        p[3 * i] = (float)(100.0 * cos(angle));
        p[3 * i + 1] = (float)(100.0 * sin(angle));
        p[3 * i + 2] = 0.0f;
        t[3 * i] = 300;
        t[3 * i + 1] = i;
        t[3 * i + 2] = (i + 1) % 300;
    }
    memset(&p[900], 0, 3 * sizeof *p);
    CHECK(mesh_make(p, 301, t, 300, &m) == 0 && survives(&m, &o, 1.0, 1.0, "a fan of needles"));
    for (uint32_t i = 0; i < 100; ++i) // leaves on the edge from 300 to 301
        t[3 * i] = 300, t[3 * i + 1] = 301, t[3 * i + 2] = i;
    p[905] = 50.0f;
    CHECK(mesh_make(p, 302, t, 100, &m) == 0 && survives(&m, &o, 1.0, 1.0, "a book"));
    for (uint32_t i = 0; i < 60; ++i)
    {
        const double a = 2.0 * PI * i / 60.0;
        for (uint32_t side = 0; side < 2; ++side)
        {
            const double r = 1.0 + (side ? 0.3 : -0.3) * cos(0.5 * a);
            p[6 * i + 3 * side] = (float)(r * cos(a));
            p[6 * i + 3 * side + 1] = (float)(r * sin(a));
            p[6 * i + 3 * side + 2] = (float)((side ? 0.3 : -0.3) * sin(0.5 * a));
        }
        const uint32_t n[4] = {2 * i, 2 * i + 1, i < 59 ? 2 * i + 2 : 1, i < 59 ? 2 * i + 3 : 0};
        const uint32_t corners[6] = {n[0], n[2], n[1], n[1], n[2], n[3]};
        memcpy(&t[6 * i], corners, sizeof corners);
    }
    for (int method = 0; method < 3; ++method)
    {
        o.method = (sss_atlas_method)method;
        CHECK(mesh_make(p, 120, t, 120, &m) == 0 && survives(&m, &o, 1.0, 2.0, "a Moebius strip"));
    }
}

static void scales_of_every_kind(void)
{   // Oracle: the same checks; an atlas does not care for units: charts and texture coordinates stay the same when
    // positions and unit change together, by a power of two to the bit.
    static const double scales[6] = {1e30, 1e-30, 1e18, 1e-18, 1e30, 1e-30};
    static const double units[6] = {1e-30, 1e30, 1.0, 1.0, 1.0, 1.0};
    for (int i = 0; i < 6; ++i)
    {
        static const double nowhere[3] = {0.0, 0.0, 0.0};
        mesh_data m;
        char name[64];
        const sss_atlas_options o = options_of(128, (sss_atlas_method)(i % 3));
        if (mesh_closed_sphere(3, 1.0, &m) != 0)
            continue;
        mesh_transform(&m, scales[i], nowhere);
        (void)snprintf(name, sizeof name, "scale %g, unit %g", scales[i], units[i]);
        const int made = survives(&m, &o, units[i], 1.0, name);
        CHECK(made || i > 3); // areas of 1e60 mm^2 do not fit into a float
    }
    fixture f, g;
    mesh_data m;
    const sss_atlas_options o = options_of(128, SSS_ATLAS_AREA);
    static const double nowhere[3] = {0.0, 0.0, 0.0}, away[3] = {4096.0, -4096.0, 4096.0};
    test_about("twice the unit, half the positions");
    if (CHECK_EQUAL(atlas_of(0, &o, &f), 0) && small_mesh(0, &m) == 0)
    {
        mesh_transform(&m, 0.0625, nowhere);
        if (CHECK_EQUAL(fixture_make(&g, &m, &o, NULL), 0))
        {
            CHECK(f.m.vertex_count == g.m.vertex_count && f.m.chart_count == g.m.chart_count &&
                  memcmp(f.m.uv, g.m.uv, 2 * f.m.vertex_count * sizeof(float)) == 0);
            fixture_free(&g);
        }
        fixture_free(&f);
    }
    if (mesh_closed_sphere(4, 1.0, &m) == 0)
    {
        mesh_transform(&m, 1.0, away);
        CHECK(survives(&m, &o, 10.0, 2.0, "4096 away"));
    }
}

static void unreferenced_vertices_and_parts(void)
{   // Oracle: the declaration of vertex_entry; a chart for each part at least. Five hundred tetrahedra, and vertices
    // that nothing names between them.
    enum
    {
        PARTS = 500
    };
    float *p = (float *)malloc(15 * PARTS * sizeof *p);
    uint32_t *t = (uint32_t *)malloc(12 * PARTS * sizeof *t);
    static const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    mesh_data m;
    fixture f;
    size_t named = 0;
    memset(p, 0, 15 * PARTS * sizeof *p);
    for (uint32_t i = 0; i < PARTS; ++i)
    {
        for (uint32_t k = 0; k < 5; ++k)
        {
            p[15 * i + 3 * k] = (float)(2 * (i % 50)) + (k == 1 ? 1.0f : 0.0f);
            p[15 * i + 3 * k + 1] = (float)(2 * (i / 50)) + (k == 2 ? 1.0f : 0.0f);
            p[15 * i + 3 * k + 2] = k == 3 ? 1.0f : 0.0f;
        }
        for (uint32_t k = 0; k < 12; ++k)
            t[12 * i + k] = 5 * i + faces[k];
    }
    const sss_atlas_options o = options_of(512, SSS_ATLAS_ORTHOGRAPHIC);
    if (mesh_make(p, 5 * PARTS, t, 4 * PARTS, &m) == 0 && CHECK_EQUAL(fixture_make(&f, &m, &o, NULL), 0))
    {
        for (size_t v = 0; v < f.V; ++v)
            named += (f.x.vertex_entry[v] == NONE) != (v % 5 == 4);
        CHECK_EQUAL(named, 0);
        CHECK(f.m.chart_count >= PARTS);
        check_mesh(&f);
        check_flat(&f);
        check_texels(&f);
        fixture_free(&f);
    }
    free(p);
    free(t);
}

// A strip of 2n needles, an edge of it far longer than the others: flat, or wound round an axis.
static int strip_of_needles(uint32_t n, double width, int wound, mesh_data *out)
{
    float *p = (float *)malloc(6 * ((size_t)n + 1) * sizeof *p);
    uint32_t *t = (uint32_t *)malloc(6 * (size_t)n * sizeof *t);
    for (size_t i = 0; i <= n; ++i)
        for (size_t side = 0; side < 2; ++side)
        {
            float *q = &p[3 * (2 * i + side)];
            const double a = wound ? 0.001 * (double)i : 0.0, along = 50.0 * (double)i / n;
            q[0] = (float)(wound ? (3.0 + (side ? 0.0 : width)) * cos(a) : along);
            q[1] = (float)(wound ? (3.0 + (side ? 0.0 : width)) * sin(a) : width * (double)side);
            q[2] = (float)(wound ? along : 0.0);
        }
    for (uint32_t i = 0; i < n; ++i)
    {
        const uint32_t corners[6] = {2 * i, 2 * i + 2, 2 * i + 1, 2 * i + 1, 2 * i + 2, 2 * i + 3};
        memcpy(&t[6 * (size_t)i], corners, sizeof corners);
    }
    const int result = mesh_make(p, 2 * (size_t)n + 2, t, 2 * (size_t)n, out);
    free(p);
    free(t);
    return result;
}

static void strips_of_needles(void)
{   // Oracle: the checks above where they are quick; the stats and the clock for a million.
    mesh_data m;
    sss_atlas_options o = options_of(512, SSS_ATLAS_ORTHOGRAPHIC);
    for (int method = 0; method < 3; ++method)
    {
        o.method = (sss_atlas_method)method;
        CHECK(strip_of_needles(1000, 1.0, 0, &m) == 0 && survives(&m, &o, 1.0, 5.0, "a flat strip of 2,000"));
    }
    o.method = SSS_ATLAS_ORTHOGRAPHIC;
    CHECK(strip_of_needles(10000, 1.0, 1, &m) == 0);
    (void)survives(&m, &o, 1.0, 10.0, "a wound strip of 20,000");
    sss_atlas *atlas = NULL;
    sss_atlas_stats s;
    memset(&s, 0, sizeof s);
    if (strip_of_needles(500000, 1.0, 0, &m) != 0)
        SKIP("out of memory");
    const sss_mesh view = mesh_view(&m, 1.0);
    test_about("a flat strip of a million");
    o = options_of(1024, SSS_ATLAS_ORTHOGRAPHIC);
    const double start = cpu_seconds();
    const sss_result result = sss_atlas_create(&view, &o, NULL, &atlas);
    CHECK_BAR_BELOW(cpu_seconds() - start, 20.0, 60.0, "seconds for a million needles");
    test_note("%s", sss_result_string(result));
    CHECK(result == SSS_OK || result == SSS_ERROR_INVALID_ARGUMENT);
    if (result == SSS_OK && CHECK_EQUAL(sss_atlas_get_stats(atlas, &s), SSS_OK))
    {
        CHECK_EQUAL(s.overlaps, 0);
        CHECK_BELOW(s.texel_area_error, 1e-6);
    }
    sss_atlas_free(atlas);
    mesh_free(&m);
}

// ================================================= 9. Models =================================================

typedef struct model_run
{
    size_t triangles;
    double seconds;
} model_run;

// The whole atlas of a model at 1024 with a gutter of two, against the bars of the project.
//   used   % of the texture, held against regressions;   seams  ratio of errors, likewise; 0: not looked at
static model_run run_model(const char *name, sss_atlas_method method, double used, double seams)
{
    model_run run = {0, (double)NAN};
    mesh_data mesh;
    fixture f;
    const sss_atlas_options o = options_of(1024, method);
    test_about("%s, %s", name, method_names[method]);
    if ((strcmp(name, "bunny") == 0 ? whole_bunny(&mesh) : mesh_load_model(name, &mesh)) != 0)
    {
        test_note("%s is not there: SSS_MODELS names the folder of horse.glb and igea.glb; tests/dragon.sh fetches the "
                  "dragon", name);
        return run;
    }
    if (!CHECK_EQUAL(fixture_make(&f, &mesh, &o, NULL), 0))
        return run;
    const flat_errors e = measure_flat(&f);
    double sum = 0.0;
    for (size_t i = 0; i < f.x.inner_count; ++i)
        sum += (double)f.x.area[i];
    CHECK_EQUAL(e.bad_numbers, 0);
    CHECK_EQUAL(e.turned, 0);
    CHECK_BAR_BELOW((double)e.overlaps, 0.0, 0.0, "pairs of triangles that overlap");
    CHECK_BAR_BELOW(relative_error(sum, surface_mm2(&f)), 1e-6, 1e-6, "error of the area of all texels");
    CHECK_BAR_ABOVE(100.0 * e.utilisation, 70.0, used, "% of the texture used at 1024, gutter 2");
    const mesh_errors m = measure_mesh(&f, f.s.normal_deviation);
    CHECK_EQUAL(m.bad_numbers + m.empty_charts + m.parts + m.shared + m.needless, 0);
    if (strcmp(name, "bunny") == 0)
        CHECK_BELOW(m.beyond, 0.08); // share of the surface whose normal deviates by more than the limit
    test_note("%zu triangles, %zu charts (%zu of them tiny, %zu divided), %.2f s, L2 %.3f, Linf %.2f, %.0f MB", f.T,
              f.m.chart_count, m.tiny_charts, f.s.split_count, f.seconds, f.s.stretch_l2, f.s.stretch_linf,
              (double)f.s.bytes / 1e6);
    run.triangles = f.T;
    run.seconds = f.seconds;
    if (seams > 0.0)
    {
        check_seams(&f, seams);
        const border_errors b = measure_borders(&f);
        CHECK_BELOW((double)b.far_away / (double)b.count, 0.01);
        CHECK_BELOW((double)b.clamped / (double)b.count, 0.02);
        CHECK_BETWEEN(b.mean, 0.5, 1.1);
        CHECK_BELOW((double)b.empty / (double)b.windows, 1e-3);
        test_note("%zu beyond a boundary, %zu too far, %zu too near; %zu of %zu texels in windows empty", b.count,
                  b.far_away, b.clamped, b.empty, b.windows);
    }
    if (method == SSS_ATLAS_AREA)
    {
        CHECK_BAR_ABOVE(100.0 * measure_quality(&f).within, 95.0, 90.0, "% of the surface within 1.5 of the mean");
        CHECK_BAR_BELOW(f.s.area_distortion[2], 10.0, 10.0, "largest area distortion");
        CHECK_BAR_ABOVE(f.s.area_distortion[0], 0.1, 0.01, "least area distortion");
    }
    fixture_free(&f);
    return run;
}

// How time grows: from one run to one with more triangles, both at 1024.
static void check_growth(const model_run *small, const model_run *large)
{
    if (small->triangles == 0 || large->triangles == 0)
        return;
    test_about("%zu to %zu triangles", small->triangles, large->triangles);
    CHECK_BAR_BELOW(log(large->seconds / small->seconds) / log((double)large->triangles / (double)small->triangles),
                    1.2, 1.6, "exponent of growth");
}

static void the_bars_are_met(void)
{   // Oracles: integers, areas of the mesh, the clock on one thread. What is not installed is left out, and said.
    static const char *const names[4] = {"horse", "igea", "dragon_res3", "dragon_res2"};
    model_run runs[4], little = {0, 0.0};
    mesh_data mesh;
    fixture f;
    const sss_atlas_options o = options_of(1024, SSS_ATLAS_ORTHOGRAPHIC);
    const model_run bunny = run_model("bunny", SSS_ATLAS_ORTHOGRAPHIC, 60.0, 6.0);
    if (bunny.triangles > 0)
    {
        CHECK_BAR_BELOW(bunny.seconds, 2.0, 6.0, "seconds for the bunny at 1024");
        (void)run_model("bunny", SSS_ATLAS_AREA, 55.0, 4.5);
        (void)run_model("bunny", SSS_ATLAS_CONVEX, 60.0, 6.5);
    }
    for (int i = 0; i < 4; ++i)
        runs[i] = run_model(names[i], SSS_ATLAS_ORTHOGRAPHIC, i < 2 ? 58.0 : 48.0, 0.0);
    test_about("bunny of 2,000");
    if (thinned_bunny(35.0, &mesh) == 0 && CHECK_EQUAL(fixture_make(&f, &mesh, &o, NULL), 0))
    {
        little.triangles = f.T;
        little.seconds = f.seconds;
        fixture_free(&f);
    }
    check_growth(&little, &bunny);
    check_growth(&bunny, &runs[1]);
    check_growth(&runs[2], &runs[3]);
    if (getenv("SSS_TEST_LONG") != NULL)
    {
        const model_run whole = run_model("dragon", SSS_ATLAS_ORTHOGRAPHIC, 40.0, 0.0);
        check_growth(&bunny, &whole);
    }
}

// For hooks.progress: when each stage began.
typedef struct stages
{
    double fraction[64], seconds[64];
    size_t count;
} stages;

static int note_stage(void *user, double fraction)
{
    stages *s = (stages *)user;
    if (s->count < 64)
    {
        s->fraction[s->count] = fraction;
        s->seconds[s->count++] = cpu_seconds();
    }
    return 0;
}

static void a_larger_table_costs_little(void)
{   // Oracle: the clock, between the calls of hooks.progress: 0.8 when the charts are packed, 0.9 when each texel has
    // its surface.
    mesh_data mesh;
    fixture f;
    stages s;
    sss_hooks hooks;
    double packed = (double)NAN, made = (double)NAN;
    const sss_atlas_options o = options_of(2048, SSS_ATLAS_ORTHOGRAPHIC);
    memset(&s, 0, sizeof s);
    memset(&hooks, 0, sizeof hooks);
    hooks.user = &s;
    hooks.progress = note_stage;
    if (whole_bunny(&mesh) != 0)
        SKIP("glmark2-data with its bunny is not installed");
    if (!CHECK_EQUAL(fixture_make(&f, &mesh, &o, &hooks), 0))
        return;
    for (size_t i = 0; i < s.count; ++i)
    {
        packed = s.fraction[i] < 0.85 ? s.seconds[i] : packed;
        made = s.fraction[i] < 0.95 ? s.seconds[i] : made;
    }
    test_note("whole atlas %.2f s, %.1f %% of the texture used", f.seconds, 100.0 * f.s.utilisation);
    CHECK(made > packed);
    CHECK_BAR_BELOW(made - packed, 0.3, 1.5, "seconds for the table of 2048 x 2048 texels");
    fixture_free(&f);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {
        TEST(charts_are_a_partition),
        TEST(normals_stay_near_the_mean),
        TEST(a_wrong_partition_is_caught),
        TEST(the_plane_is_exact),
        TEST(nothing_overlaps),
        TEST(orthographic_charts_are_projections),
        TEST(convex_charts_are_convex),
        TEST(texels_show_their_surface),
        TEST(wrong_texels_are_caught),
        TEST(vertices_find_their_texels),
        TEST(gutters_are_kept),
        TEST(borders_show_the_neighbours),
        TEST(seams_cannot_be_seen),
        TEST(seams_without_borders_are_seen),
        TEST(images_are_filled),
        TEST(fetches_are_bilinear),
        TEST(the_stats_are_right),
        TEST(closed_forms_of_stretch),
        TEST(charts_can_be_limited),
        TEST(density_sets_the_size),
        TEST(every_size_works),
        TEST(rotations_help_and_defaults_are_named),
        TEST(splitting_changes_no_bit),
        TEST(what_is_saved_comes_back),
        TEST(damaged_files_are_refused),
        TEST(hostile_counts_ask_for_no_more),
        TEST(version_and_shader_text),
        TEST(bad_meshes_are_refused),
        TEST(bad_options_are_refused),
        TEST(bad_calls_are_refused),
        TEST(every_allocation_may_fail),
        TEST(bytes_are_counted),
        TEST(progress_may_cancel),
        TEST(hostile_meshes),
        TEST(scales_of_every_kind),
        TEST(unreferenced_vertices_and_parts),
        TEST_TIMED(strips_of_needles),
        TEST(the_bars_are_met),
        TEST_TIMED(a_larger_table_costs_little),
    };
    const int status = test_main(argc, argv, "sss_atlas.h", tests, COUNT(tests));
    for (int i = 0; i < 3 * SMALL_MESHES; ++i)
        fixture_free(&g_small[i / 3][i % 3]);
    mesh_free(&g_bunny);
    return status;
}
