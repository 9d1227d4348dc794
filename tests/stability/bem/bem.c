// What breaks sss_bem.h: see ../record.h. Of every step are checked: nothing infinite or NaN, no spike, the error
// against the converged reference within what was asked or what was predicted.
//   build/tests/stability/bem [--write FOLDER] [TEST]

#define SSS_DIPOLE_IMPLEMENTATION
#include "../../../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../../../sss_bem.h"

#include "../../../examples/common/threads.h"
#include "../../common/default_guard.h"
#include "../sweeps.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
#define TOLERANCE 1e-2
static const double some_albedo[3] = {0.9, 0.95, 0.99};

// ---- The method ----

static void claim_of(sss_bem *bem, claim *said)
{
    sss_bem_stats stats;
    memset(&stats, 0, sizeof stats);
    CHECK_EQUAL(sss_bem_predict_error(bem, 0, NULL), SSS_OK);
    CHECK_EQUAL(sss_bem_get_stats(bem, &stats), SSS_OK);
    said->predicted = stats.predicted_error;
    said->edge_paths = stats.edge_paths;
    said->border_mm = stats.border_mm;
    said->normals_against = stats.normals_against;
    said->inside_out = stats.inside_out;
}

static sss_result bem_of(const scene *s, double tolerance, double guard, sss_bem **out)
{
    sss_bem_options options;
    sss_hooks hooks;
    memset(&options, 0, sizeof options);
    memset(&hooks, 0, sizeof hooks);
    options.tolerance = tolerance;
    options.guard = guard;
    hooks.parallel_for = threads_hook;
    return sss_bem_create(&s->view, &s->profile, &options, &hooks, out);
}

// From scratch, under the scene's irradiance.   guard  as in sss_bem_options;   B [V][3];   said may be NULL
static int shade_once(const scene *s, double tolerance, double guard, float *B, claim *said)
{
    sss_bem *bem = NULL;
    const int failed = bem_of(s, tolerance, guard, &bem) != SSS_OK ||
                       sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, s->irradiance) != SSS_OK ||
                       sss_bem_shade(bem, B) != SSS_OK;
    if (!failed && said) claim_of(bem, said);
    sss_bem_free(bem);
    return failed;
}

// One object under one light after the other; what it predicts is of the last.
static int shade(const scene *s, const double (*lights)[3], size_t light_count, float *const *B, claim *claims)
{
    const size_t V = s->mesh.vertex_count;
    sss_bem *bem = NULL;
    scene lit = *s;
    lit.irradiance = (float *)malloc(3 * V * sizeof(float));
    int failed = !lit.irradiance || bem_of(s, TOLERANCE, 0.0, &bem) != SSS_OK;
    for (size_t i = 0; i < light_count && !failed; ++i)
    {
        failed = scene_light(&lit, lights[i][0], lights[i][1], lights[i][2]) != 0 ||
                 sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, lit.irradiance) != SSS_OK ||
                 sss_bem_shade(bem, B[0] + 3 * V * i) != SSS_OK;
    }
    if (!failed) claim_of(bem, &claims[0]);
    sss_bem_free(bem);
    free(lit.irradiance);
    return failed;
}

// guard: the default one, found by main.
static method placed = {1,
                     {{"placed", SSS_DIPOLE_PLACED, 1.0, TOLERANCE, 1.0, 0.0},
                      {NULL, SSS_DIPOLE_DISTANCE, 0.0, 0.0, 0.0, 0.0},
                      {NULL, SSS_DIPOLE_DISTANCE, 0.0, 0.0, 0.0, 0.0}},
                     shade};

#define SWEPT placed
#include "../run.h"

static double guard_in_use(void)
{
    return placed.series[0].guard;
}

// The largest B that light of E = 1 can make: a plane gives alpha'/2 (exp(-sigma z_r) + exp(-sigma z_v)) <= 1; each of
// the two sources gives at most 3 pi/guard alpha'/(4 pi) more where it lies close to a surface (sss_bem_options.guard).
static double brightest(double E)
{
    return E * (1.0 + 2.0 * 3.0 / (4.0 * guard_in_use()));
}

static void record_error(const char *sweep, double x, const outcome *o, double predicted)
{
    row r = row_of(sweep, placed.series[0].name, x);
    r.rel_l2 = o->rel_l2;
    r.rel_max = o->rel_max;
    r.predicted = predicted;
    record(&r);
}

// What every step has to hold.
static void check_step(const char *sweep, double x, const outcome *o, double predicted, double E)
{
    test_about("%s, %.4g", sweep, x);
    CHECK(o->finite);
    CHECK_BELOW(o->largest, brightest(E));
    CHECK_BELOW(o->rel_l2, TOLERANCE);
    CHECK_BELOW(o->rel_max, 3.0 * TOLERANCE);
    CHECK_BELOW(o->rel_l2, predicted);
}

// ---- a receiver whose source approaches a patch ----

// A square 16 across under E = 1; the receiver hangs below, so that its virtual source lies H under the square.
static double gather_below(const scene *o, double H, double guard)
{
    static const float up[3] = {0.0f, 0.0f, 1.0f};
    const float at[3] = {0.3f, 0.2f, (float)(-o->profile.z_v[1] - H)};
    float B[3] = {0.0f, 0.0f, 0.0f};
    sss_bem_options options;
    sss_bem *bem = NULL;
    memset(&options, 0, sizeof options);
    options.tolerance = TOLERANCE;
    options.guard = guard;
    const int failed = sss_bem_create(&o->view, &o->profile, &options, NULL, &bem) != SSS_OK ||
                       sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, o->irradiance) != SSS_OK ||
                       sss_bem_gather(bem, at, up, 1, B) != SSS_OK;
    sss_bem_free(bem);
    return failed ? (double)NAN : (double)B[1];
}

// The same without a hierarchy: form factors of the whole square, which is one polygon.
static double exact_below(const scene *o, double H)
{
    static const double corners[12] = {-8.0, -8.0, 0.0, 8.0, -8.0, 0.0, 8.0, 8.0, 0.0, -8.0, 8.0, 0.0};
    const double z_r = o->profile.z_r[1], z_v = o->profile.z_v[1], sigma = o->profile.sigma_tr[1];
    const double y = (double)(float)(-z_v - H); // as the receiver's position is rounded
    const double source_r[3] = {(double)0.3f, (double)0.2f, y - z_r};
    const double source_v[3] = {(double)0.3f, (double)0.2f, y + z_v};
    return o->profile.alpha_p[1] / (4.0 * PI) *
           (sss_bem_form_factor(corners, 4, source_r, z_r, sigma) +
            sss_bem_form_factor(corners, 4, source_v, z_v, sigma));
}

static void record_approach(const char *sweep, double share, double B, double exact)
{
    row r = row_of(sweep, placed.series[0].name, share);
    r.rel_l2 = r.rel_max = fabs(B / exact - 1.0);
    r.value = B;
    r.ideal = exact;
    record(&r);
}

static void approach(void)
{   // Oracles: the form factor of the whole square without guard; with it the bound that the guard promises, and
    // nothing changed as long as the source is farther away than the guard reaches.
    const int count = steps_of(25);
    for (int i = 0; i < count; ++i)
    {
        const double share = step_at(i, count, 2.0, 2e-4); // H over z_v
        mesh_data mesh;
        scene o;
        if (mesh_grid(8, 16.0, &mesh) != 0 || scene_create(&mesh, some_albedo, 1.3, &o) != 0) SKIP("out of memory");
        for (size_t v = 0; v < 3 * o.mesh.vertex_count; ++v)
        {
            o.irradiance[v] = 1.0f;
        }
        const double H = share * o.profile.z_v[1], exact = exact_below(&o, H);
        const double without = gather_below(&o, H, -1.0), with = gather_below(&o, H, 0.0);
        test_about("H/z %.3g", share);
        // One receiver, as in check_step. Its position in float moves the source by up to 2^-23 of z, and 2 pi z/H by
        // as much.
        CHECK_REL(without, exact, 3.0 * TOLERANCE + 3e-7 / share);
        CHECK_BELOW(with, o.profile.alpha_p[1] * 2.0 * 3.0 / (4.0 * guard_in_use()));
        if (share >= guard_in_use()) CHECK_REL(with, exact, 3.0 * TOLERANCE);
        else CHECK_BELOW(with, without * (1.0 + 3.0 * TOLERANCE));
        record_approach("approach unguarded", share, without, exact);
        record_approach("approach guarded", share, with, exact); // the error is what the guard changes
        scene_free(&o);
    }
}

// ---- squash ----

static void squash_positions(const float *rest, size_t count, double height, float *out)
{
    for (size_t v = 0; v < 3 * count; ++v)
    {
        out[v] = v % 3 == 2 ? (float)((double)rest[v] * height) : rest[v];
    }
}

// One object is kept and updated from frame to frame.
static sss_result next_frame(sss_bem *kept, const scene *s, float *B)
{
    sss_result result = sss_bem_set_vertices(kept, s->mesh.positions, NULL);
    if (result == SSS_OK) result = sss_bem_set_irradiance(kept, SSS_BEM_VERTICES, s->irradiance);
    if (result == SSS_OK) result = sss_bem_update(kept, 0, NULL);
    return result == SSS_OK ? sss_bem_render(kept, B) : result;
}

static double from_other(const float *B, const float *other, size_t count)
{
    double sum = 0.0, sum_difference = 0.0;
    for (size_t i = 0; i < count; ++i)
    {
        const double d = (double)B[i] - (double)other[i];
        sum += (double)other[i] * (double)other[i];
        sum_difference += d * d;
    }
    return sqrt(sum_difference / sum);
}

// One frame of the kept object and of a fresh one.   B [2][V][3], truth [count][3]: to work in
static void squash_step(scene *s, sss_bem *kept, double height, float *B, double *truth)
{
    const size_t n = 3 * s->mesh.vertex_count;
    claim said = {(double)NAN, 0.0, 0.0, 0.0, 0};
    CHECK_EQUAL(sss_dipole_vertex_normals(&s->view, s->mesh.normals), SSS_OK);
    mesh_vertex_areas(&s->mesh, s->areas);
    CHECK_EQUAL(scene_light(s, 0.5, 0.0, 1.0), 0);
    CHECK_EQUAL(next_frame(kept, s, B), SSS_OK);
    CHECK_EQUAL(shade_once(s, TOLERANCE, 0.0, B + n, &said), 0);
    CHECK_EQUAL(scene_truth(s, s->irradiance, s->mesh.normals, SSS_DIPOLE_PLACED, guard_in_use(), 1e-4, truth), 0);
    const outcome moved = scene_compare(s, B, truth, 0, s->count), fresh = scene_compare(s, B + n, truth, 0, s->count);
    check_step("squash, kept", height, &moved, said.predicted, 1.0);
    check_step("squash, fresh", height, &fresh, said.predicted, 1.0);
    CHECK_BELOW(from_other(B + n, B, n), 2.0 * TOLERANCE);
    record_error("squash kept", height, &moved, said.predicted);
    record_error("squash fresh", height, &fresh, said.predicted);
}

static void squash(void)
{   // Oracles: the converged reference; and a fresh object on the same frame. A sphere of 4 mean free paths becomes a
    // sheet of a tenth of one; the kept object's hierarchy was made for the sphere.
    const int count = record_full() ? 13 : 4, levels = record_full() ? 4 : 3;
    mesh_data mesh;
    scene s;
    sss_bem *kept = NULL;
    if (mesh_sphere(levels, 4.0, &mesh) != 0 || scene_create(&mesh, some_albedo, 1.3, &s) != 0) SKIP("out of memory");
    const size_t V = s.mesh.vertex_count;
    float *const rest = (float *)malloc(3 * V * sizeof(float)), *const B = (float *)malloc(6 * V * sizeof(float));
    double *const truth = (double *)malloc(3 * V * sizeof(double));
    CHECK(rest && B && truth);
    memcpy(rest, s.mesh.positions, 3 * V * sizeof(float));
    CHECK_EQUAL(bem_of(&s, TOLERANCE, 0.0, &kept), SSS_OK);
    CHECK_EQUAL(scene_add_receivers(&s, 0, V, V / (record_full() ? 48 : 16)), 0);
    for (int i = 0; i < count; ++i)
    {
        const double height = step_at(i, count, 1.0, 0.0125);
        squash_positions(rest, V, height, s.mesh.positions);
        squash_step(&s, kept, height, B, truth);
    }
    sss_bem_free(kept);
    free(rest);
    free(B);
    free(truth);
    scene_free(&s);
}

// ---- what the guard changes on the cases of the chart ----

// rel_max: the largest B with guard; value: the share of values that it changes by more than 5 %; ideal: the largest B
// without.
static void guard_step(scene *s, const char *material, double size)
{
    const size_t n = 3 * s->mesh.vertex_count;
    float *const with = (float *)malloc(2 * n * sizeof(float)), *const without = with + n;
    size_t touched = 0;
    char name[64];
    snprintf(name, sizeof name, "guard on the bunny %s", material);
    row r = row_of(name, placed.series[0].name, size);
    if (!with) SKIP("out of memory");
    CHECK_EQUAL(shade_once(s, 1e-3, 0.0, with, NULL), 0);
    CHECK_EQUAL(shade_once(s, 1e-3, -1.0, without, NULL), 0);
    r.rel_max = r.ideal = 0.0;
    for (size_t i = 0; i < n; ++i)
    {
        touched += (double)without[i] > 1.05 * (double)with[i];
        r.ideal = fmax(r.ideal, (double)without[i]);
        r.rel_max = fmax(r.rel_max, (double)with[i]);
    }
    r.value = (double)touched / (double)n;
    test_about("%s, %g mm", material, size);
    test_note("values changed by more than 5 %%: %.2f %%; largest B %.4g, with guard %.4g", 100.0 * r.value, r.ideal,
              r.rel_max);
    CHECK_BELOW(r.rel_max, brightest(1.0));
    record(&r);
    free(with);
}

static void guard_on_the_bunny(void)
{   // Oracle: none, these are the numbers of LIMITS: the share of vertices and of light that the guard touches.
    static const double sizes[3] = {10.0, 50.0, 200.0};
    static const char *const materials[2] = {"Marble", "Skimmilk"};
    if (!record_full()) SKIP("only with --write: the whole bunny");
    mesh_data bunny;
    if (mesh_load_bunny(&bunny) != 0) SKIP("no bunny here: install glmark2-data");
    for (int c = 0; c < 6; ++c)
    {
        sss_dipole_material material;
        mesh_data mesh;
        scene s;
        if (mesh_copy(&bunny, &mesh) != 0 || scene_create(&mesh, some_albedo, 1.3, &s) != 0) SKIP("out of memory");
        s.view = mesh_view(&s.mesh, sizes[c % 3] / mesh_extent(&s.mesh));
        CHECK_EQUAL(sss_dipole_material_by_name(materials[c / 3], &material), SSS_OK);
        CHECK_EQUAL(sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &s.profile), SSS_OK);
        CHECK_EQUAL(scene_light(&s, 1.0, 1.0, 1.0), 0);
        guard_step(&s, materials[c / 3], sizes[c % 3]);
        scene_free(&s);
    }
    mesh_free(&bunny);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {COMMON_SWEEPS, TEST(approach), TEST(squash), TEST(guard_on_the_bunny)};
    placed.series[0].guard = default_guard();
    return record_main(argc, argv, "bem", tests, sizeof tests / sizeof *tests);
}
