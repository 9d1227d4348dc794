#include "sweeps.h"

#include "../common/half_spaces.h"
#include "../common/numbers.h"
#include "../common/quadrature.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
static const double some_albedo[3] = {0.9, 0.95, 0.99};

// The worst of the sweep so far: error over what was asked for, or predicted where that is more.
static double g_worst[MOST_SERIES];

// The largest share of a step's values that could not be compared.
static double g_left_out[MOST_SERIES];

// ---- One step ----

void solution_free(solution *s)
{
    for (int k = 0; k < MOST_SERIES; ++k)
    {
        int shared = 0;
        for (int i = 0; i < k; ++i) shared |= s->truth[i] == s->truth[k];
        if (!shared) free(s->truth[k]);
        free(s->B[k]);
    }
    memset(s, 0, sizeof *s);
}

// The reference must be an order of magnitude better than what is measured with it.
static double truth_tolerance(const series *s)
{
    return s->tolerance > 0.0 ? s->tolerance / (record_full() ? 30.0 : 10.0) : 3e-4;
}

static double *truth_of(const method *m, const scene *s, const solution *known, size_t k)
{
    const series *const wanted = &m->series[k];
    for (size_t i = 0; i < k; ++i)
    {
        if (m->series[i].geometry == wanted->geometry && m->series[i].guard == wanted->guard) return known->truth[i];
    }
    double *const B = (double *)malloc(3 * s->count * sizeof *B);
    if (B && scene_truth(s, s->irradiance, s->mesh.normals, wanted->geometry, wanted->guard, truth_tolerance(wanted),
                         B) != 0)
    {
        free(B);
        return NULL;
    }
    return B;
}

// How near a placed source of the receiver lies to any triangle, over its z: the smaller of the two.
static double nearest_source(const scene *s, size_t receiver, int channel)
{
    const double z[2] = {-s->profile.z_r[channel], s->profile.z_v[channel]};
    double nearest = HUGE_VAL;
    for (int k = 0; k < 2; ++k)
    {
        double source[3];
        for (size_t i = 0; i < 3; ++i)
        {
            source[i] = (double)s->mesh.positions[3 * receiver + i] +
                        z[k] / s->view.mm_per_unit * (double)s->mesh.normals[3 * receiver + i];
        }
        nearest = fmin(nearest, mesh_distance(&s->mesh, source) * s->view.mm_per_unit / fabs(z[k]));
    }
    return nearest;
}

// Without a guard B grows as 2 pi z/H with a source's height H over another part of the surface, and positions in float
// are worth 6e-8 z/H of it (LIMITS of sss_dipole.h). Where that exceeds the tolerance no number is right: those values
// become NaN and are not compared, like those for which the reference did not converge. The share of both.
static double leave_out(const scene *s, const series *which, double *truth)
{
    const int unbounded = which->geometry == SSS_DIPOLE_PLACED && which->guard == 0.0;
    size_t count = 0;
    for (size_t i = 0; i < 3 * s->count; ++i)
    {
        if (unbounded && nearest_source(s, s->receivers[i / 3], (int)(i % 3)) * which->tolerance < 6e-8)
            truth[i] = (double)NAN;
        count += isnan(truth[i]) ? 1 : 0;
    }
    return (double)count / (3.0 * (double)s->count);
}

int solve(const method *m, const scene *s, solution *out)
{
    int failed = 0;
    memset(out, 0, sizeof *out);
    for (size_t k = 0; k < m->series_count; ++k)
    {
        out->B[k] = (float *)calloc(3 * s->mesh.vertex_count, sizeof(float));
        out->truth[k] = truth_of(m, s, out, k);
        failed |= !out->B[k] || !out->truth[k];
    }
    failed = failed || m->shade(s, &s->light, 1, out->B, out->claims) != 0;
    for (size_t k = 0; k < m->series_count && !failed; ++k)
    {
        out->left_out[k] = leave_out(s, &m->series[k], out->truth[k]);
        out->outcomes[k] = scene_compare(s, out->B[k], out->truth[k], 0, s->count);
    }
    CHECK(!failed);
    if (failed) solution_free(out);
    return failed;
}

void rows_of(const method *m, const solution *s, const char *sweep, double x, row rows[MOST_SERIES])
{
    for (size_t k = 0; k < m->series_count; ++k)
    {
        rows[k] = row_of(sweep, m->series[k].name, x);
        rows[k].rel_l2 = s->outcomes[k].rel_l2;
        rows[k].rel_max = s->outcomes[k].rel_max;
        rows[k].predicted = s->claims[k].predicted;
        rows[k].left_out = s->left_out[k];
    }
}

// A number of a row's may be NaN, an infinite one may not pass for it.
static double against_promise(const series *s, const row *r)
{
    const double promise = fmax(s->tolerance, isnan(r->predicted) ? 0.0 : r->predicted);
    if (r->left_out >= 1.0) return 0.0; // nothing could be compared: missed by its share
    return isfinite(r->rel_l2) ? r->rel_l2 / promise : HUGE_VAL;
}

void keep_rows(const method *m, const solution *s, const row rows[MOST_SERIES])
{
    for (size_t k = 0; k < m->series_count; ++k)
    {
        test_about("%s, %.4g, %s", rows[k].sweep, rows[k].x, rows[k].series);
        if (s) CHECK(s->outcomes[k].finite);
        g_worst[k] = fmax(g_worst[k], against_promise(&m->series[k], &rows[k]));
        g_left_out[k] = fmax(g_left_out[k], rows[k].left_out);
        test_note("error %.2e, predicted %.2e, input %.2e, model %.2e", rows[k].rel_l2, rows[k].predicted,
                  rows[k].input, rows[k].model);
        record(&rows[k]);
    }
}

void close_sweep(const method *m, const char *sweep)
{
    for (size_t k = 0; k < m->series_count; ++k)
    {
        char what[128];
        snprintf(what, sizeof what, "%s, %s: worst error over what was asked for or predicted", sweep,
                 m->series[k].name);
        test_about(NULL);
        CHECK_BAR_BELOW(g_worst[k], 1.0, m->series[k].regression, what);
        snprintf(what, sizeof what, "%s, %s: largest share of values that cannot be compared", sweep,
                 m->series[k].name);
        CHECK_BAR_BELOW(g_left_out[k], 0.0, m->series[k].left_out, what);
        g_worst[k] = g_left_out[k] = 0.0;
    }
}

// Most sweeps: a scene, solved, and nothing else to tell. Frees the scene.
static void plain_step(const method *m, const char *sweep, double x, scene *s)
{
    solution r;
    row rows[MOST_SERIES];
    if (solve(m, s, &r) == 0)
    {
        rows_of(m, &r, sweep, x, rows);
        keep_rows(m, &r, rows);
        solution_free(&r);
    }
    scene_free(s);
}

// About `count` receivers spread over the vertices.
static int spread_receivers(scene *s, size_t count)
{
    const size_t V = s->mesh.vertex_count;
    return scene_add_receivers(s, 0, V, V > count ? V / count : 1);
}

static size_t receivers_wanted(void)
{
    return record_full() ? 32 : 8;
}

// A sphere under a slanting light, with receivers.
static int lit_sphere(int levels, double radius, const double albedo[3], scene *s)
{
    mesh_data mesh;
    if (mesh_closed_sphere(levels, radius, &mesh) != 0 || scene_create(&mesh, albedo, 1.3, s) != 0)
    {
        return 1;
    }
    return scene_light(s, 1.0, 2.0, 3.0) != 0 || spread_receivers(s, receivers_wanted()) != 0;
}

// ---- Thickness: a slab ----

static const double SLAB_SIDE = 64.0; // mean free paths; sigma_tr is 0.17 and more

// Two squares, the lower one turned over.
static int make_slab(int cells, double thickness, mesh_data *out)
{
    mesh_data lower;
    const double up[3] = {0.0, 0.0, thickness};
    if (mesh_grid(cells, SLAB_SIDE, out) != 0)
    {
        return 1;
    }
    if (mesh_grid(cells, SLAB_SIDE, &lower) != 0)
    {
        mesh_free(out);
        return 1;
    }
    mesh_transform(out, 1.0, up);
    for (size_t t = 0; t < lower.triangle_count; ++t)
    {
        const uint32_t swapped = lower.triangles[3 * t + 1];
        lower.triangles[3 * t + 1] = lower.triangles[3 * t + 2];
        lower.triangles[3 * t + 2] = swapped;
    }
    mesh_compute_normals(&lower);
    const int failed = mesh_append(out, &lower);
    mesh_free(&lower);
    if (failed) mesh_free(out);
    return failed;
}

void slab_of_images(const sss_profile *p, int channel, double d, double *R, double *T)
{
    const double s = p->sigma_tr[channel], z_r = p->z_r[channel], z_b = 0.5 * (p->z_v[channel] - z_r);
    const double front = p->alpha_p[channel] * cosh(s * z_b) / sinh(s * (d + 2.0 * z_b));
    *R = front * sinh(s * (d + z_b - z_r));
    *T = front * sinh(s * (z_r + z_b));
}

// What the dipole makes of the middle of either face, by the converged integral. front, back: receivers.
static void record_slab(const method *m, const scene *s, const solution *r, double d, size_t front, size_t back)
{
    static const char *const names[2][3] = {{"slab front 0.9", "slab front 0.95", "slab front 0.99"},
                                            {"slab back 0.9", "slab back 0.95", "slab back 0.99"}};
    const double E = (double)s->irradiance[3 * s->receivers[front]];
    for (size_t k = 0; k < m->series_count; ++k)
    {
        if (k > 0 && r->truth[k] == r->truth[k - 1])
        {
            continue;
        }
        for (int c = 0; c < 3; ++c)
        {
            double ideal[2];
            slab_of_images(&s->profile, c, d, &ideal[0], &ideal[1]);
            for (int face = 0; face < 2; ++face)
            {
                row model = row_of(names[face][c], m->series[k].name, d);
                model.value = r->truth[k][3 * (face ? back : front) + (size_t)c] / E;
                model.ideal = ideal[face];
                model.model = fabs(model.value / model.ideal - 1.0);
                record(&model);
            }
        }
    }
}

void sweep_slab(const method *m)
{   // Oracles: the converged reference; for the model the closed form of a slab, with all images.
    const int count = steps_of(11), cells = record_full() ? 32 : 16;
    for (int i = 0; i < count; ++i)
    {
        const double d = step_at(i, count, 0.25, 8.0);
        const size_t face = (size_t)((cells + 1) * (cells + 1)), middle = face / 2;
        mesh_data mesh;
        scene s;
        solution r;
        row rows[MOST_SERIES];
        if (make_slab(cells, d, &mesh) != 0 || scene_create(&mesh, some_albedo, 1.3, &s) != 0) SKIP("out of memory");
        CHECK_EQUAL(scene_light(&s, 0.0, 0.0, 1.0), 0);
        CHECK_EQUAL(scene_add_receivers(&s, 0, 2 * face, record_full() ? 37 : 101), 0);
        CHECK_EQUAL(scene_add_receivers(&s, middle, middle + 1, 1), 0);
        CHECK_EQUAL(scene_add_receivers(&s, face + middle, face + middle + 1, 1), 0);
        if (solve(m, &s, &r) == 0)
        {
            rows_of(m, &r, "slab", d, rows);
            keep_rows(m, &r, rows);
            record_slab(m, &s, &r, d, s.count - 2, s.count - 1);
            solution_free(&r);
        }
        scene_free(&s);
    }
    close_sweep(m, "slab");
}

// ---- Curvature: a sphere ----

// Mean of the reference's B under E = 1, channel 2; 1 where all that enters leaves.
static double furnace(const scene *s, const series *which)
{
    double sum = 0.0, area = 0.0;
    double *const B = (double *)malloc(3 * s->count * sizeof *B);
    float *const E = (float *)malloc(3 * s->mesh.vertex_count * sizeof *E);
    for (size_t i = 0; E && i < 3 * s->mesh.vertex_count; ++i)
    {
        E[i] = 1.0f;
    }
    if (B && E && scene_truth(s, E, s->mesh.normals, which->geometry, which->guard, 1e-3, B) == 0)
    {
        leave_out(s, which, B);
        for (size_t i = 0; i < s->count; ++i)
        {
            if (isnan(B[3 * i + 2])) continue;
            sum += s->areas[s->receivers[i]] * B[3 * i + 2];
            area += s->areas[s->receivers[i]];
        }
    }
    free(B);
    free(E);
    return area > 0.0 ? sum / area : (double)NAN;
}

void sweep_sphere(const method *m)
{   // Oracles: the converged reference; for the model a white furnace: without absorption all that enters leaves.
    static const double albedo[3] = {0.9, 0.99, 1.0};
    const int count = steps_of(11);
    for (int i = 0; i < count; ++i)
    {
        const double radius = step_at(i, count, 0.5, 50.0);
        scene s;
        solution r;
        row rows[MOST_SERIES];
        if (lit_sphere(record_full() ? 4 : 3, radius, albedo, &s) != 0) SKIP("out of memory");
        if (solve(m, &s, &r) == 0)
        {
            rows_of(m, &r, "sphere", radius, rows);
            for (size_t k = 0; k < m->series_count; ++k)
            {
                rows[k].value = k > 0 && r.truth[k] == r.truth[k - 1] ? rows[k - 1].value : furnace(&s, &m->series[k]);
                rows[k].ideal = 1.0;
                rows[k].model = fabs(rows[k].value - 1.0);
            }
            keep_rows(m, &r, rows);
            solution_free(&r);
        }
        scene_free(&s);
    }
    close_sweep(m, "sphere");
}

// ---- Albedo ----

void sweep_albedo(const method *m)
{   // Oracle: the converged reference. Little scattering: a short range, in paths of which most absorb.
    const int count = steps_of(9);
    for (int i = 0; i < count; ++i)
    {
        const double a = i == count - 1 ? 0.9999 : step_at(i, count, 0.05, 1.0);
        const double albedo[3] = {0.5 * a, 0.75 * a, a};
        scene s;
        if (lit_sphere(record_full() ? 4 : 3, 5.0, albedo, &s) != 0) SKIP("out of memory");
        plain_step(m, "albedo", a, &s);
    }
    close_sweep(m, "albedo");
}

// ln H(1) = -1/pi int_0^(pi/2) ln(1 - a phi/tan phi) dphi: the closed integral of Chandrasekhar's H, t = tan phi.
static long double log_H_integrand(const void *context, long double phi)
{
    const long double a = *(const long double *)context;
    return -logl(1.0L - a * (phi > 0.0L ? phi / tanl(phi) : 1.0L)) / 3.14159265358979323846L;
}

// Of a half space without a boundary under light along the normal: 1 - sqrt(1 - a) H(1).
static double exact_half_space_matched(double albedo)
{
    const long double a = albedo;
    const long double H = expl(integrate_interval(log_H_integrand, &a, 0.0L, 1.57079632679489661923L));
    return (double)(1.0L - sqrtl(1.0L - a) * H);
}

static void record_total(const method *m, const char *name, double albedo, double n, double exact)
{
    const double sigma_s[3] = {albedo, albedo, albedo}, sigma_a[3] = {1.0 - albedo, 1.0 - albedo, 1.0 - albedo};
    sss_dipole_material material;
    sss_profile profile;
    CHECK_EQUAL(sss_dipole_material_from_coefficients(sigma_s, sigma_a, n, &material), SSS_OK);
    CHECK_EQUAL(sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &profile), SSS_OK);
    row r = row_of(name, m->series[0].name, albedo);
    r.value = sss_dipole_total(&profile, 0);
    r.ideal = exact;
    r.model = fabs(r.value / r.ideal - 1.0);
    record(&r);
}

void sweep_half_space(const method *m)
{   // Oracles: Chandrasekhar's closed integral where there is no boundary, which must agree with the table; for others
    // the table. Both geometries are the same on a plane, and every method converges to the total there.
    for (size_t i = 0; i < COUNT_OF_HALF_SPACES; ++i)
    {
        const exact_half_space *const t = &half_spaces[i];
        test_about("alpha' %.3f, n %.1f", t->alpha, t->n);
        if (t->n == 1.0) CHECK_REL(exact_half_space_matched(t->alpha), t->exact, 1e-6 + 0.6e-6 / t->exact);
        if (t->n == 1.0) record_total(m, "half space n 1", t->alpha, 1.0, exact_half_space_matched(t->alpha));
        else record_total(m, t->n < 1.4 ? "half space n 1.3" : "half space n 1.5", t->alpha, t->n, t->exact);
    }
    record_total(m, "half space n 1", 0.05, 1.0, exact_half_space_matched(0.05));
    record_total(m, "half space n 1", 0.85, 1.0, exact_half_space_matched(0.85));
}

// ---- Triangles ----

// A square of 12 whose columns of cells are wide and narrow in turn.
static int make_slivers(double aspect, mesh_data *out)
{
    const int n = 24;
    if (mesh_grid(n, 12.0, out) != 0)
    {
        return 1;
    }
    for (size_t v = 0; v < out->vertex_count; ++v)
    {
        const int column = (int)floor(((double)out->positions[3 * v] / 12.0 + 0.5) * n + 0.5);
        out->positions[3 * v] = (float)(column / 2 - 6 + (column % 2 ? 0.5 / aspect : 0.0));
    }
    mesh_compute_normals(out);
    return 0;
}

void sweep_slivers(const method *m)
{   // Oracle: the converged reference. Half of all triangles are slivers; light fades along the square.
    const int count = steps_of(11);
    for (int i = 0; i < count; ++i)
    {
        const double aspect = step_at(i, count, 1.0, 1e5);
        mesh_data mesh;
        scene s;
        if (make_slivers(aspect, &mesh) != 0 || scene_create(&mesh, some_albedo, 1.3, &s) != 0) SKIP("out of memory");
        for (size_t v = 0; v < s.mesh.vertex_count; ++v)
        {
            s.visible[v] = (float)(0.5 + (double)s.mesh.positions[3 * v] / 12.0);
        }
        CHECK_EQUAL(scene_light(&s, 0.3, 0.2, 1.0), 0);
        CHECK_EQUAL(spread_receivers(&s, receivers_wanted()), 0);
        plain_step(m, "slivers", aspect, &s);
    }
    close_sweep(m, "slivers");
}

enum
{
    FAN_CELLS = 24
};

// The plane z = 0: a dense square over [-12,0] x [-6,6], and one vertex at (length, 0) that fans out to its edge.
static int make_fan(double length, mesh_data *out)
{
    const double side = 12.0, left[3] = {-0.5 * side, 0.0, 0.0};
    const size_t row_length = FAN_CELLS + 1;
    mesh_data fan;
    float corners[3 * (FAN_CELLS + 2)];
    uint32_t triangles[3 * FAN_CELLS];
    if (mesh_grid(FAN_CELLS, side, out) != 0)
    {
        return 1;
    }
    mesh_transform(out, 1.0, left);
    for (size_t j = 0; j < row_length; ++j)
    {
        memcpy(&corners[3 * j], &out->positions[3 * (j * row_length + FAN_CELLS)], 3 * sizeof *corners);
    }
    corners[3 * row_length] = (float)length;
    corners[3 * row_length + 1] = corners[3 * row_length + 2] = 0.0f;
    for (uint32_t j = 0; j < FAN_CELLS; ++j)
    {
        triangles[3 * j] = j;
        triangles[3 * j + 1] = (uint32_t)row_length;
        triangles[3 * j + 2] = j + 1;
    }
    if (mesh_make(corners, row_length + 1, triangles, FAN_CELLS, &fan) != 0)
    {
        mesh_free(out);
        return 1;
    }
    const int failed = mesh_append(out, &fan);
    mesh_free(&fan);
    if (failed) mesh_free(out);
    return failed;
}

// Light fades from the far side of the square to the fan's vertex, which has the most of it.
void sweep_fan(const method *m)
{   // Oracle: the converged reference.
    const int count = steps_of(9);
    for (int i = 0; i < count; ++i)
    {
        const double length = step_at(i, count, 0.05, 500.0);
        mesh_data mesh;
        scene s;
        if (make_fan(length, &mesh) != 0 || scene_create(&mesh, some_albedo, 1.3, &s) != 0) SKIP("out of memory");
        const size_t V = s.mesh.vertex_count, grid = (size_t)(FAN_CELLS + 1) * (FAN_CELLS + 1);
        for (size_t v = 0; v < V; ++v)
        {
            s.visible[v] = (float)(v == V - 1 ? 1.0 : 0.2 - 0.05 * (double)s.mesh.positions[3 * v]);
        }
        CHECK_EQUAL(scene_light(&s, 0.0, 0.0, 1.0), 0);
        // Rows have 25 vertices: every eighth is on the edge.
        CHECK_EQUAL(scene_add_receivers(&s, 0, grid, record_full() ? 8 : 56), 0);
        CHECK_EQUAL(scene_add_receivers(&s, V - 1, V, 1), 0);
        plain_step(m, "fan", length, &s);
    }
    close_sweep(m, "fan");
}

// ---- What a mesh should be like ----

// The relative L2 difference of B at the receivers to that of the right mesh: numbers of the reference, both.
static double difference(const scene *s, const double *B, const double *right)
{
    double sum = 0.0, norm = 0.0;
    for (size_t i = 0; i < 3 * s->count; ++i)
    {
        const double weight = s->areas[s->receivers[i / 3]];
        if (isnan(B[i]) || isnan(right[i])) continue;
        sum += weight * (B[i] - right[i]) * (B[i] - right[i]);
        norm += weight * right[i] * right[i];
    }
    return sqrt(sum / norm);
}

// Whether a vertex's normal looks away from a triangle.
static int faces_away(const mesh_data *mesh, size_t triangle, uint32_t vertex)
{
    double e[2][3];
    for (size_t k = 0; k < 6; ++k)
    {
        e[k / 3][k % 3] = (double)mesh->positions[3 * mesh->triangles[3 * triangle + 1 + k / 3] + k % 3] -
                          (double)mesh->positions[3 * mesh->triangles[3 * triangle] + k % 3];
    }
    const float *const n = &mesh->normals[3 * vertex];
    return (double)n[0] * (e[0][1] * e[1][2] - e[0][2] * e[1][1]) +
               (double)n[1] * (e[0][2] * e[1][0] - e[0][0] * e[1][2]) +
               (double)n[2] * (e[0][0] * e[1][1] - e[0][1] * e[1][0]) <
           0.0;
}

// What stats say of the mesh, against what it is: a border's length from below, exact where it is short.
static void check_claim(const scene *s, const claim *c)
{
    const double border = mesh_border(&s->mesh);
    double area = 0.0, against = 0.0;
    for (size_t i = 0; i < 3 * s->mesh.triangle_count; ++i)
    {
        const double third = mesh_triangle_area(&s->mesh, i / 3) / 3.0;
        area += third;
        against += faces_away(&s->mesh, i / 3, s->mesh.triangles[i]) ? third : 0.0;
    }
    CHECK_REL(c->edge_paths, mesh_mean_edge(&s->mesh), 1e-5);
    CHECK_ABS(c->normals_against, against / area, 1e-6);
    CHECK_BETWEEN(c->border_mm, border > 40.0 ? 0.3 * border : 0.8 * border, border * (1.0 + 1e-5));
    CHECK_EQUAL(c->border_mm > 0.0, border > 0.0);
}

// A step whose mesh is not what it should be.   right  the scene that is, with receivers at the same places
static void faulty_step(const method *m, const char *sweep, double x, scene *s, const scene *right,
                        double (*said)(const claim *c))
{
    solution r;
    row rows[MOST_SERIES];
    double *const truth = (double *)malloc(3 * right->count * sizeof *truth);
    if (truth && solve(m, s, &r) == 0)
    {
        rows_of(m, &r, sweep, x, rows);
        for (size_t k = 0; k < m->series_count; ++k)
        {
            if (k == 0 || r.truth[k] != r.truth[k - 1])
            {
                CHECK_EQUAL(scene_truth(right, right->irradiance, right->mesh.normals, m->series[k].geometry,
                                        m->series[k].guard, truth_tolerance(&m->series[k]), truth),
                            0);
            }
            rows[k].input = difference(s, r.truth[k], truth);
            rows[k].said = said(&r.claims[k]);
            test_about("%s, %.4g, %s", sweep, x, rows[k].series);
            check_claim(s, &r.claims[k]);
        }
        keep_rows(m, &r, rows);
        solution_free(&r);
    }
    free(truth);
}

static double said_edge(const claim *c)
{
    return c->edge_paths;
}

static double said_against(const claim *c)
{
    return c->normals_against;
}

static double said_border(const claim *c)
{
    return c->border_mm;
}

static double said_inside_out(const claim *c)
{
    CHECK_EQUAL(c->inside_out, 1);
    return (double)c->inside_out;
}

// Half of a sphere is dark: everything beyond the plane x = 0.1.
static int half_lit_sphere(int levels, double radius, scene *s)
{
    mesh_data mesh;
    if (mesh_closed_sphere(levels, radius, &mesh) != 0 || scene_create(&mesh, some_albedo, 1.3, s) != 0)
    {
        return 1;
    }
    for (size_t v = 0; v < s->mesh.vertex_count; ++v)
    {
        s->visible[v] = s->mesh.positions[3 * v] > 0.1f ? 1.0f : 0.0f;
    }
    return scene_light(s, 1.0, 2.0, 3.0);
}

// Receivers of `fine` where those of `coarse` are. The vertices of a sphere are those of all finer ones too.
static int same_receivers(scene *fine, const scene *coarse)
{
    for (size_t i = 0; i < coarse->count; ++i)
    {
        const float *const wanted = &coarse->mesh.positions[3 * coarse->receivers[i]];
        size_t best = 0;
        double nearest = HUGE_VAL;
        for (size_t v = 0; v < fine->mesh.vertex_count; ++v)
        {
            const float *const p = &fine->mesh.positions[3 * v];
            const double x = (double)(p[0] - wanted[0]), y = (double)(p[1] - wanted[1]), z = (double)(p[2] - wanted[2]);
            if (x * x + y * y + z * z < nearest)
            {
                nearest = x * x + y * y + z * z;
                best = v;
            }
        }
        if (nearest > 1e-8) return 1;
        fine->receivers[fine->count++] = best;
    }
    return 0;
}

void sweep_coarse(const method *m)
{   // Oracles: the converged reference on the coarse mesh; and for what the mesh costs that on a fine one.
    const int finest = record_full() ? 6 : 3, levels = record_full() ? 6 : 3;
    for (int i = 0; i < levels; i += record_full() ? 1 : 2)
    {
        scene s, fine;
        if (half_lit_sphere(i, 15.0, &s) != 0 || half_lit_sphere(finest, 15.0, &fine) != 0) SKIP("out of memory");
        CHECK_EQUAL(spread_receivers(&s, receivers_wanted()), 0);
        CHECK_EQUAL(same_receivers(&fine, &s), 0);
        const double edge = mesh_mean_edge(&s.mesh);
        faulty_step(m, "coarse", edge, &s, &fine, said_edge);
        scene_free(&s);
        scene_free(&fine);
    }
    close_sweep(m, "coarse");
}

void sweep_noise(const method *m)
{   // Oracles: the converged reference; and for what the noise costs that without.
    const int count = steps_of(7);
    for (int i = 0; i < count; ++i)
    {
        const double noise = step_at(i, count, 0.01, 0.64); // of a mean edge
        scene s, smooth;
        if (lit_sphere(record_full() ? 4 : 3, 5.0, some_albedo, &s) != 0 ||
            lit_sphere(record_full() ? 4 : 3, 5.0, some_albedo, &smooth) != 0)
            SKIP("out of memory");
        const double edge = mesh_mean_edge(&s.mesh);
        random_seed(7);
        for (size_t v = 0; v < 3 * s.mesh.vertex_count; ++v)
        {
            s.mesh.positions[v] += (float)(noise * edge * random_between(-1.0, 1.0));
        }
        mesh_compute_normals(&s.mesh);
        CHECK_EQUAL(scene_light(&s, 1.0, 2.0, 3.0), 0);
        faulty_step(m, "noise", noise, &s, &smooth, said_edge);
        scene_free(&s);
        scene_free(&smooth);
    }
    close_sweep(m, "noise");
}

void sweep_normals(const method *m)
{   // Oracles: the converged reference; and for what the normals cost that with the right ones.
    static const double shares[5] = {0.0, 0.01, 0.1, 0.5, 1.0};
    for (int i = record_full() ? 0 : 2; i < 5; i += record_full() ? 1 : 2)
    {
        scene s, right;
        if (lit_sphere(3, 5.0, some_albedo, &s) != 0 || lit_sphere(3, 5.0, some_albedo, &right) != 0)
            SKIP("out of memory");
        random_seed(3);
        for (size_t v = 0; v < s.mesh.vertex_count; ++v)
        {
            if (random_unit() >= shares[i]) continue;
            for (size_t k = 0; k < 3; ++k) s.mesh.normals[3 * v + k] = -s.mesh.normals[3 * v + k];
        }
        CHECK_EQUAL(scene_light(&s, 1.0, 2.0, 3.0), 0);
        faulty_step(m, "normals", shares[i], &s, &right, said_against);
        scene_free(&s);
        scene_free(&right);
    }
    close_sweep(m, "normals");
}

void sweep_windings(const method *m)
{   // Oracles: the converged reference; and for what turned triangles cost that of the mesh without. Normals follow.
    static const double shares[5] = {0.0, 0.01, 0.1, 0.5, 1.0};
    for (int i = record_full() ? 0 : 2; i < 5; i += record_full() ? 1 : 2)
    {
        scene s, right;
        if (lit_sphere(3, 5.0, some_albedo, &s) != 0 || lit_sphere(3, 5.0, some_albedo, &right) != 0)
            SKIP("out of memory");
        random_seed(4);
        for (size_t t = 0; t < s.mesh.triangle_count; ++t)
        {
            uint32_t *const v = &s.mesh.triangles[3 * t], swapped = v[1];
            if (random_unit() >= shares[i]) continue;
            v[1] = v[2];
            v[2] = swapped;
        }
        mesh_compute_normals(&s.mesh);
        CHECK_EQUAL(scene_light(&s, 1.0, 2.0, 3.0), 0);
        faulty_step(m, "windings", shares[i], &s, &right, i < 4 ? said_border : said_inside_out);
        scene_free(&s);
        scene_free(&right);
    }
    close_sweep(m, "windings");
}

void sweep_holes(const method *m)
{   // Oracles: the converged reference; and for what the holes cost that of the whole mesh.
    static const double shares[6] = {0.0, 0.01, 0.03, 0.1, 0.3, 0.5};
    for (int i = record_full() ? 0 : 3; i < 6; i += record_full() ? 1 : 2)
    {
        scene s, whole;
        size_t kept = 0;
        if (lit_sphere(record_full() ? 4 : 3, 5.0, some_albedo, &s) != 0 ||
            lit_sphere(record_full() ? 4 : 3, 5.0, some_albedo, &whole) != 0)
            SKIP("out of memory");
        random_seed(5);
        for (size_t t = 0; t < s.mesh.triangle_count; ++t)
        {
            if (random_unit() < shares[i]) continue;
            memmove(&s.mesh.triangles[3 * kept++], &s.mesh.triangles[3 * t], 3 * sizeof *s.mesh.triangles);
        }
        s.mesh.triangle_count = s.view.triangle_count = kept;
        mesh_vertex_areas(&s.mesh, s.areas); // vertices without a triangle do not count
        faulty_step(m, "holes", shares[i], &s, &whole, said_border);
        scene_free(&s);
        scene_free(&whole);
    }
    close_sweep(m, "holes");
}

// ---- Scale ----

static void scale_profile(sss_profile *p, double factor)
{
    for (int c = 0; c < 3; ++c)
    {
        p->sigma_tr[c] /= factor;
        p->z_r[c] *= factor;
        p->z_v[c] *= factor;
    }
}

// How far B is from that of the first step.
static double from_first(const float *B, const float *first, size_t count)
{
    double sum = 0.0, norm = 0.0;
    for (size_t i = 0; i < count; ++i)
    {
        const double d = (double)B[i] - (double)first[i];
        sum += d * d;
        norm += (double)first[i] * (double)first[i];
    }
    return sqrt(sum / norm);
}

void sweep_scale(const method *m)
{   // Oracle: the same object and material in another unit is the same, to rounding. value: how far B is from it.
    float *first[MOST_SERIES] = {NULL, NULL, NULL};
    const int count = record_full() ? 14 : 3;
    for (int i = 0; i < count; ++i)
    {
        const double scale = i == 0 ? 1.0 : step_at(i - 1, count - 1, 1e-6, 1e6);
        scene s;
        solution r;
        row rows[MOST_SERIES];
        if (lit_sphere(3, 5.0, some_albedo, &s) != 0) SKIP("out of memory");
        s.view.mm_per_unit = scale;
        scale_profile(&s.profile, scale);
        if (solve(m, &s, &r) != 0) SKIP("not solved");
        rows_of(m, &r, "scale", scale, rows);
        for (size_t k = 0; k < m->series_count; ++k)
        {
            const size_t n = 3 * s.mesh.vertex_count;
            if (i == 0)
            {
                first[k] = (float *)malloc(n * sizeof(float));
                if (first[k]) memcpy(first[k], r.B[k], n * sizeof(float));
            }
            CHECK(first[k] != NULL);
            rows[k].value = from_first(r.B[k], first[k], n);
            rows[k].ideal = 0.0;
            test_about("scale, %.4g, %s", scale, rows[k].series);
            CHECK_BELOW(rows[k].value, 1e-5); // float, and what rounding decides of tables and links
        }
        keep_rows(m, &r, rows);
        solution_free(&r);
        scene_free(&s);
    }
    for (int k = 0; k < MOST_SERIES; ++k) free(first[k]);
    close_sweep(m, "scale");
}

// The share of the plane around a vertex that its triangles cover when they are laid flat: at a distance far below an
// edge R_d sees nothing else of the surface.
static void flat_shares(const mesh_data *mesh, double *shares)
{
    memset(shares, 0, mesh->vertex_count * sizeof *shares);
    for (size_t c = 0; c < 3 * mesh->triangle_count; ++c)
    {
        const uint32_t *const v = &mesh->triangles[c - c % 3];
        const float *const p = &mesh->positions[3 * v[c % 3]], *const q = &mesh->positions[3 * v[(c + 1) % 3]];
        const float *const r = &mesh->positions[3 * v[(c + 2) % 3]];
        double qq = 0.0, rr = 0.0, qr = 0.0;
        for (int k = 0; k < 3; ++k)
        {
            const double a = (double)q[k] - (double)p[k], b = (double)r[k] - (double)p[k];
            qq += a * a;
            rr += b * b;
            qr += a * b;
        }
        shares[v[c % 3]] += acos(qr / sqrt(qq * rr)) / (2.0 * PI);
    }
}

void sweep_size(const method *m)
{   // Oracles: the converged reference; far beyond a mean free path Lambert, B = Rd E: value, of all B, over that. With
    // distance alone vertices have the share of it that their triangles' angles have of a circle: ideal.
    const int count = record_full() ? 13 : 3;
    for (int i = 0; i < count; ++i)
    {
        const double scale = step_at(i, count, 1e-6, 1e6);
        scene s;
        solution r;
        row rows[MOST_SERIES];
        if (lit_sphere(3, 5.0, some_albedo, &s) != 0) SKIP("out of memory");
        double *const shares = (double *)malloc(s.mesh.vertex_count * sizeof *shares);
        if (!shares) SKIP("out of memory");
        flat_shares(&s.mesh, shares);
        s.view.mm_per_unit = scale;
        if (solve(m, &s, &r) != 0) SKIP("not solved");
        rows_of(m, &r, "size", 5.0 * scale, rows);
        for (size_t k = 0; k < m->series_count; ++k)
        {
            double sum = 0.0, lambert = 0.0, flat = 0.0;
            for (size_t v = 0; v < s.mesh.vertex_count; ++v)
            {
                sum += s.areas[v] * (double)r.B[k][3 * v + 2];
                const double B = s.areas[v] * (double)s.irradiance[3 * v + 2] * sss_dipole_total(&s.profile, 2);
                lambert += B;
                flat += B * shares[v];
            }
            rows[k].value = sum / lambert;
            rows[k].ideal = flat / lambert;
            test_about("size, %.4g, %s", 5.0 * scale, rows[k].series);
            if (scale > 9e5 && m->series[k].geometry == SSS_DIPOLE_DISTANCE)
                CHECK_REL(rows[k].value, rows[k].ideal, k == 0 ? 2e-3 : 5e-2); // others interpolate
        }
        free(shares);
        keep_rows(m, &r, rows);
        solution_free(&r);
        scene_free(&s);
    }
    close_sweep(m, "size");
}

// ---- Light ----

static void bumps(double s, double t, double out[3])
{
    out[0] = 16.0 * s - 8.0;
    out[1] = 16.0 * t - 8.0;
    out[2] = 0.4 * sin(1.5 * out[0]) * sin(1.5 * out[1]);
}

void sweep_grazing(const method *m)
{   // Oracle: the converged reference. A sheet with bumps, which throw no shadows here.
    const int count = steps_of(9), cells = record_full() ? 40 : 24;
    for (int i = 0; i < count; ++i)
    {
        const double degrees = step_at(i, count, 90.0, 0.1), slope = degrees * PI / 180.0;
        mesh_data mesh;
        scene s;
        if (mesh_sheet(cells, cells, bumps, &mesh) != 0 || scene_create(&mesh, some_albedo, 1.3, &s) != 0)
            SKIP("out of memory");
        CHECK_EQUAL(scene_light(&s, cos(slope) * 0.8, cos(slope) * 0.6, sin(slope)), 0);
        CHECK_EQUAL(spread_receivers(&s, receivers_wanted()), 0);
        plain_step(m, "grazing", degrees, &s);
    }
    close_sweep(m, "grazing");
}

// The largest change of B at a receiver, over the mean of both.   B, before  [count]
static double largest_step(const double *B, const double *before, size_t count)
{
    double largest = 0.0, mean = 0.0;
    for (size_t i = 0; i < count; ++i)
    {
        largest = fmax(largest, fabs(B[i] - before[i]));
        mean += 0.5 * (B[i] + before[i]) / (double)count;
    }
    return largest / mean;
}

static void pick(const scene *s, const float *B, double *out)
{
    for (size_t i = 0; i < 3 * s->count; ++i)
    {
        out[i] = (double)B[3 * s->receivers[i / 3] + i % 3];
    }
}

enum
{
    TURNS = 61
};

// A series under all the lights.   B [lights][V][3]
static void record_turning(const method *m, size_t k, scene *s, const double (*lights)[3], size_t count, const float *B,
                           const claim *said)
{
    const size_t n = 3 * s->count, V = s->mesh.vertex_count;
    double *const numbers = (double *)malloc(4 * n * sizeof *numbers);
    double *at[4] = {numbers, numbers + n, numbers + 2 * n, numbers + 3 * n}; // truth, its last; B, its last
    CHECK(numbers != NULL);
    for (size_t i = 0; numbers && i < count; ++i)
    {
        row r = row_of("turning", m->series[k].name, 0.5 * (double)i);
        CHECK_EQUAL(scene_light(s, lights[i][0], lights[i][1], lights[i][2]), 0);
        CHECK_EQUAL(scene_truth(s, s->irradiance, s->mesh.normals, m->series[k].geometry, m->series[k].guard,
                                truth_tolerance(&m->series[k]), at[0]),
                    0);
        r.left_out = leave_out(s, &m->series[k], at[0]);
        const outcome o = scene_compare(s, B + 3 * V * i, at[0], 0, s->count);
        pick(s, B + 3 * V * i, at[2]);
        r.rel_l2 = o.rel_l2;
        r.rel_max = o.rel_max;
        r.predicted = said->predicted;
        if (i > 0)
        {
            r.value = largest_step(at[2], at[3], n);
            r.ideal = largest_step(at[0], at[1], n);
        }
        test_about("turning, %g degrees, %s", r.x, r.series);
        CHECK(o.finite);
        g_worst[k] = fmax(g_worst[k], against_promise(&m->series[k], &r));
        g_left_out[k] = fmax(g_left_out[k], r.left_out);
        record(&r);
        for (int j = 0; j < 4; j += 2)
        {
            double *const swapped = at[j];
            at[j] = at[j + 1];
            at[j + 1] = swapped;
        }
    }
    free(numbers);
}

void sweep_turning(const method *m)
{   // Oracle: the converged reference. A light turns in half-degree steps. value: the largest step of B at a receiver
    // over the mean of B; ideal: that of the reference. What is more flickers.
    const size_t count = record_full() ? TURNS : 5;
    double lights[TURNS][3];
    scene s;
    float *B[MOST_SERIES] = {NULL, NULL, NULL};
    claim claims[MOST_SERIES];
    int failed = 0;
    if (lit_sphere(3, 5.0, some_albedo, &s) != 0) SKIP("out of memory");
    for (size_t i = 0; i < count; ++i)
    {
        const double angle = 0.5 * (double)i * PI / 180.0;
        lights[i][0] = sin(angle);
        lights[i][1] = 0.6 * cos(angle);
        lights[i][2] = 0.8 * cos(angle);
    }
    for (size_t k = 0; k < m->series_count; ++k)
    {
        B[k] = (float *)calloc(3 * s.mesh.vertex_count * count, sizeof(float));
        failed |= B[k] == NULL;
    }
    failed = failed || m->shade(&s, (const double(*)[3])lights, count, B, claims) != 0;
    CHECK(!failed);
    for (size_t k = 0; k < m->series_count && !failed; ++k)
    {
        record_turning(m, k, &s, (const double(*)[3])lights, count, B[k], &claims[k]);
    }
    for (int k = 0; k < MOST_SERIES; ++k) free(B[k]);
    scene_free(&s);
    close_sweep(m, "turning");
}

// ---- Air ----

int make_fingers(int levels, double radius, double gap, mesh_data *out)
{
    mesh_data right;
    if (mesh_sphere(levels, radius, out) != 0)
    {
        return 1;
    }
    if (mesh_sphere(levels, radius, &right) != 0)
    {
        mesh_free(out);
        return 1;
    }
    for (size_t v = 0; v < out->vertex_count; ++v)
    {
        out->positions[3 * v + 2] *= 4.0f;
        right.positions[3 * v + 2] *= 4.0f;
        out->positions[3 * v] -= (float)(radius + 0.5 * gap);
        right.positions[3 * v] += (float)(radius + 0.5 * gap);
        out->normals[3 * v + 2] *= 0.25f;
        right.normals[3 * v + 2] *= 0.25f;
    }
    const int failed = mesh_append(out, &right);
    mesh_free(&right);
    if (failed) mesh_free(out);
    return failed;
}

// The brightest receiver of the dark finger over that of the lit one, channel 2.
static double crossing(const scene *s, const double *truth)
{
    double bright = 0.0, dark = 0.0;
    for (size_t i = 0; i < s->count; ++i)
    {
        double *const side = s->receivers[i] < s->mesh.vertex_count / 2 ? &bright : &dark;
        *side = fmax(*side, truth[3 * i + 2]);
    }
    return dark / bright;
}

// Receivers where the fingers are nearest, beside those that are spread.
static int finger_receivers(scene *s)
{
    const size_t V = s->mesh.vertex_count;
    size_t nearest[2] = {0, V / 2};
    for (size_t v = 0; v < V; ++v)
    {
        const size_t side = v < V / 2 ? 0 : 1;
        if (fabs((double)s->mesh.positions[3 * v]) < fabs((double)s->mesh.positions[3 * nearest[side]]))
            nearest[side] = v;
    }
    return spread_receivers(s, receivers_wanted()) != 0 || scene_add_receivers(s, nearest[0], nearest[0] + 1, 1) != 0 ||
           scene_add_receivers(s, nearest[1], nearest[1] + 1, 1) != 0;
}

// Only the left finger is lit, on the side of the gap. The other one should stay dark.
void sweep_fingers(const method *m)
{   // Oracles: the converged reference; for the model darkness, for air carries no scattered light of this kind.
    const int count = steps_of(9);
    for (int i = 0; i < count; ++i)
    {
        const double gap = step_at(i, count, 8.0, 0.03125);
        mesh_data mesh;
        scene s;
        solution r;
        row rows[MOST_SERIES];
        if (make_fingers(record_full() ? 4 : 3, 3.0, gap, &mesh) != 0 ||
            scene_create(&mesh, some_albedo, 1.3, &s) != 0)
            SKIP("out of memory");
        const size_t V = s.mesh.vertex_count;
        for (size_t v = V / 2; v < V; ++v)
        {
            s.visible[v] = 0.0f;
        }
        CHECK_EQUAL(scene_light(&s, 1.0, 0.0, 0.0), 0);
        CHECK_EQUAL(finger_receivers(&s), 0);
        if (solve(m, &s, &r) == 0)
        {
            rows_of(m, &r, "fingers", gap, rows);
            for (size_t k = 0; k < m->series_count; ++k)
            {
                rows[k].model = crossing(&s, r.truth[k]);
            }
            keep_rows(m, &r, rows);
            solution_free(&r);
        }
        scene_free(&s);
    }
    close_sweep(m, "fingers");
}
