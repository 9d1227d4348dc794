// Tests of the random walk (tests/common/walk.h), the oracle of the dipole model's error, and of its files
// (tests/common/truth.h). Oracles: exact half spaces, adding-doubling and van de Hulst's slabs, MCML's rings
// (shared/TRUTH.md, 1.1 to 1.5); closed forms in closed bodies: the white furnace, the mean length of paths (4 n^2 V/S,
// whatever scatters), a ball that only absorbs. The same walk runs in all of them. `build/tests/chart/truth --verify`
// does the layers with more photons.

#define _POSIX_C_SOURCE 200809L // truncate, getpid
#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"

#include "../examples/common/threads.h"
#include "common/meshes.h"
#include "common/numbers.h"
#include "common/test.h"
#include "common/truth.h"
#include "common/walk_bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PI 3.14159265358979323846

static const sss_hooks *all_threads(void)
{
    static sss_hooks hooks;
    hooks.parallel_for = threads_hook;
    return &hooks;
}

// As many photons as make about so many steps: few where a photon scatters often.
static uint64_t photons_for(const bench_layer *l, double steps)
{
    const double left = l->R + fmax(0.0, l->T), each = l->albedo < 1.0 ? (1.0 - left) / (1.0 - l->albedo) : 30.0;
    return (uint64_t)fmin(40000.0, steps / fmax(each, 1.0));
}

// ---- Layers ----

typedef struct agreement
{
    int count, within, worst_within; // numbers; those within 2 and 4 standard errors + 0.1 %
    double squares, sum;             // of the differences in standard errors
} agreement;

static void agree(agreement *a, walk_total got, double want, double digits)
{
    const double away = fabs(got.value - want) - digits, z = (got.value - want) / fmax(got.error, 1e-12);
    a->count += 1;
    a->within += away <= 2.0 * got.error + 1e-3 * want;
    a->worst_within += away <= 4.0 * got.error + 1e-3 * want;
    a->squares += z * z;
    a->sum += z;
}

// Layers first, first + step, ...; changed: of the medium, a mutation.
static agreement run_layers(size_t first, size_t step, double steps, void (*changed)(bench_layer *layer))
{
    agreement a = {0, 0, 0, 0.0, 0.0};
    for (size_t i = first; i < bench_layer_count; i += step)
    {
        bench_layer layer = bench_layers[i];
        bench_result r;
        if (changed != NULL)
            changed(&layer);
        CHECK_EQUAL(bench_run(&layer, photons_for(&bench_layers[i], steps), 7, all_threads(), &r), 0);
        agree(&a, r.R, layer.R, layer.digits);
        if (layer.T >= 0.0)
            agree(&a, r.T, layer.T, layer.digits);
        if (changed == NULL)
        {
            CHECK_BELOW(r.sides, 1e-6);
            CHECK_EQUAL(r.walk.lost[0].value > 0.0, 0);
        }
    }
    return a;
}

static void layers_agree_with_known_values(void)
{   // Oracle: shared/TRUTH.md, 1.1 to 1.4. With right standard errors, 95 of 100 lie within two; the differences' mean
    // square is 1 and their mean 0, each with its own spread.
    const agreement a = run_layers(0, 1, 2e5, NULL);
    const double n = a.count;
    test_note("%d of %d within two standard errors + 0.1 %%, %d within four", a.within, a.count, a.worst_within);
    CHECK_EQUAL(a.worst_within, a.count);
    CHECK_BETWEEN(n - a.within, 0.0, 0.045 * n + 3.0 * sqrt(0.045 * n));
    CHECK_BETWEEN(a.squares / n, 1.0 - 4.0 * sqrt(2.0 / n), 1.0 + 4.0 * sqrt(2.2 / n)); // a little more: Student's t
    CHECK_ABS(a.sum / n, 0.0, 3.5 / sqrt(n));
}

static void inverted_eta(bench_layer *layer)
{
    layer->eta = 1.0 / layer->eta;
}

static void backward(bench_layer *layer)
{
    layer->g = -layer->g;
}

static void no_reflection(bench_layer *layer)
{
    layer->eta = 1.0;
}

static void mutated_layers_disagree(void)
{   // The check above must see an inverted eta, g of the wrong sign and a boundary that does not reflect.
    agreement a = run_layers(12, 9, 3e4, inverted_eta);
    test_note("inverted eta: mean square %.0f", a.squares / a.count);
    CHECK(a.worst_within < a.count && a.squares / a.count > 10.0);
    a = run_layers(12, 9, 3e4, no_reflection);
    test_note("no boundary: mean square %.0f", a.squares / a.count);
    CHECK(a.worst_within < a.count && a.squares / a.count > 10.0);
    agreement wrong = {0, 0, 0, 0.0, 0.0};
    for (size_t i = 0; i < bench_layer_count; ++i)
    {
        bench_layer layer = bench_layers[i];
        bench_result r;
        if (layer.g == 0.0)
            continue;
        backward(&layer);
        CHECK_EQUAL(bench_run(&layer, photons_for(&layer, 3e4), 7, all_threads(), &r), 0);
        agree(&wrong, r.R, layer.R, layer.digits);
    }
    CHECK(wrong.count >= 8);
    CHECK_EQUAL(wrong.worst_within, 0);
}

static void rings_agree_with_mcml(void)
{   // Oracle: MCML's rings, shared/TRUTH.md, 1.5, and the tolerance that it gives: two standard errors + 0.3 % (0.5 %).
    static const uint64_t photons[] = {60000, 16000, 12000, 0, 0, 4000}; // A, B, D, H
    int count = 0, within = 0;
    for (size_t i = 0; i < bench_profile_count; ++i)
    {
        const bench_profile *const p = &bench_profiles[i];
        walk_total rings[BENCH_RINGS];
        if (photons[i] == 0)
            continue;
        test_about("case %s", p->name);
        CHECK_EQUAL(bench_run_profile(p, photons[i], 3, all_threads(), rings), 0);
        double worst = 0.0, ours = 0.0, theirs = 0.0; // the sums: all that leaves
        for (size_t k = 0; k < BENCH_RINGS; ++k)
        {
            // A ring that few photons reach has no standard error of its own: Poisson's, of the flux that is known.
            const double poisson = sqrt(p->flux[k] / (double)photons[i]);
            const double error = hypot(fmax(rings[k].error, poisson), p->error[k]);
            const double away = fmax(0.0, fabs(rings[k].value - p->flux[k]) - p->allowance * p->flux[k] - 5e-7);
            worst = fmax(worst, away / error);
            within += away <= 2.0 * error;
            ++count;
            ours += rings[k].value;
            theirs += p->flux[k];
        }
        CHECK_BELOW(worst, 4.0);
        CHECK_ABS(ours, theirs, 3.5 * sqrt(ours * (1.0 - ours) / (double)photons[i]) + p->allowance * theirs);
    }
    test_note("%d of %d rings within two standard errors", within, count);
    CHECK_BETWEEN(count - within, 0.0, 0.045 * count + 3.0 * sqrt(0.045 * count));
}

// ---- Closed bodies ----

typedef struct body
{
    mesh_data mesh;
    sss_mesh view;
    walk_scene *scene;
    double volume, area; // mm^3, mm^2
} body;

static double mesh_volume(const mesh_data *m)
{
    double sum = 0.0; // divergence theorem
    for (size_t t = 0; t < m->triangle_count; ++t)
    {
        double p[9];
        for (size_t i = 0; i < 9; ++i)
            p[i] = (double)m->positions[3 * (size_t)m->triangles[3 * t + i / 3] + i % 3];
        sum += p[0] * (p[4] * p[8] - p[5] * p[7]) + p[1] * (p[5] * p[6] - p[3] * p[8]) +
               p[2] * (p[3] * p[7] - p[4] * p[6]);
    }
    return sum / 6.0;
}

// Takes the mesh over. size_mm: its largest extent. 0 on success.
static int make_body(mesh_data *mesh, double size_mm, body *b)
{
    const double scale = size_mm / mesh_extent(mesh);
    b->mesh = *mesh;
    b->view = mesh_view(&b->mesh, scale);
    b->volume = mesh_volume(&b->mesh) * scale * scale * scale;
    b->area = mesh_area(&b->mesh) * scale * scale;
    b->scene = walk_scene_create(&b->view);
    CHECK(b->scene != NULL);
    CHECK(b->volume > 0.0);
    return b->scene == NULL;
}

static void free_body(body *b)
{
    walk_scene_free(b->scene);
    mesh_free(&b->mesh);
}

static int sphere_body(int levels, double size_mm, body *b)
{
    mesh_data mesh;
    return mesh_sphere(levels, 1.0, &mesh) != 0 || make_body(&mesh, size_mm, b) != 0;
}

static walk_light uniform_light(void)
{
    walk_light light;
    memset(&light, 0, sizeof light);
    light.kind = WALK_DIFFUSE;
    light.color[0] = light.color[1] = light.color[2] = 1.0;
    return light;
}

static void fill_medium(walk_medium *m, const double sigma_s[3], const double sigma_a[3], double g, double eta)
{
    memcpy(m->sigma_s, sigma_s, sizeof m->sigma_s);
    memcpy(m->sigma_a, sigma_a, sizeof m->sigma_a);
    m->g = g;
    m->eta = eta;
}

static walk_options options_for(uint64_t photons)
{
    walk_options o;
    memset(&o, 0, sizeof o);
    o.photons = photons;
    o.seed = 5;
    o.hooks = all_threads();
    return o;
}

static double balance(const walk_result *r, int k)
{
    return r->left[k].value + r->absorbed[k].value + r->lost[k].value + r->cut[k].value + r->roulette[k].value;
}

static void energy_is_conserved(void)
{   // Oracle: bookkeeping. Without absorption all that entered leaves; with it, what leaves, is absorbed and what
    // roulette takes less what it gives is what entered; roulette is fair.
    static const double sigma_s[3] = {1.0, 3.0, 0.5}, sigma_a[3] = {0.0, 0.5, 5.0};
    const walk_light light = uniform_light();
    walk_options o = options_for(20000);
    walk_medium medium;
    walk_result r;
    body b;
    fill_medium(&medium, sigma_s, sigma_a, 0.3, 1.4);
    if (sphere_body(4, 6.0, &b) != 0)
        return;
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 0);
    for (int k = 0; k < 3; ++k)
    {
        CHECK_REL(balance(&r, k), r.entered[k], 1e-11);
        CHECK_BELOW(fabs(r.roulette[k].value), 4.0 * r.roulette[k].error + 1e-12);
        CHECK_EQUAL(r.lost[k].value > 0.0 || r.cut[k].value > 0.0, 0);
        CHECK_REL(r.entered[k] + r.specular[k], b.area, 1e-5); // all that fell on it: irradiance 1
    }
    CHECK_REL(r.left[0].value, r.entered[0], 1e-11);
    CHECK_EQUAL(r.absorbed[0].value > 0.0, 0);
    CHECK_BETWEEN(r.absorbed[2].value / r.entered[2], 0.5, 1.0);
    o.scatterings_max = 3;
    walk_result_free(&r);
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 0);
    CHECK(r.cut[0].value > 0.01 * r.entered[0]); // what the limit takes is said
    CHECK_REL(balance(&r, 0), r.entered[0], 1e-11);
    walk_result_free(&r);
    free_body(&b);
}

// Oracle: thermal equilibrium. Under the same radiance from everywhere and without absorption, as much leaves as
// enters, everywhere: B = E on every patch, whatever the shape, phase function and eta.
static void check_furnace(const body *b, double mfp, double g, double eta, uint64_t photons, double lost)
{
    const double sigma_s[3] = {1.0 / mfp, 0.5 / mfp, 2.0 / mfp}, none[3] = {0.0, 0.0, 0.0};
    const walk_light light = uniform_light();
    uint32_t *const patches = (uint32_t *)malloc(b->view.triangle_count * sizeof *patches);
    walk_options o = options_for(photons);
    walk_medium medium;
    walk_result r;
    double squares = 0.0, sum = 0.0, worst = 0.0;
    fill_medium(&medium, sigma_s, none, g, eta);
    o.patches = patches;
    o.patch_count = walk_patches(&b->view, 60, patches);
    CHECK_EQUAL(walk_run(b->scene, &medium, &light, 1, &o, &r), 0);
    for (size_t i = 0; i < 3 * r.patch_count; ++i)
    {
        const double z = (r.B[i] - r.E[i]) / r.B_error[i];
        squares += z * z;
        sum += (r.B[i] / r.E[i] - 1.0) / (double)(3 * r.patch_count);
        worst = fmax(worst, fabs(z));
    }
    const double n = 3.0 * (double)r.patch_count;
    test_note("B/E - 1: mean %.2e; in standard errors: mean square %.3f, worst %.2f; lost %.1e", sum, squares / n,
              worst, r.lost[0].value / r.entered[0]);
    CHECK_BETWEEN(squares / n, 1.0 - 4.5 * sqrt(2.0 / n), 1.0 + 4.5 * sqrt(2.5 / n));
    CHECK_BELOW(worst, 5.0);
    CHECK_BELOW((r.lost[0].value + r.lost[1].value + r.lost[2].value) / (3.0 * r.entered[0]), lost);
    walk_result_free(&r);
    free(patches);
}

// Oracle: the mean length of the paths of light in a body without absorption is 4 n^2 V/(S (1 - F_external)),
// whatever the shape and the scattering (Blanco and Fournier 2003, with the boundary: equilibrium fills the body with
// n^2 times the radiance outside).
static void check_paths(const body *b, double mfp, double g, double eta, uint64_t photons)
{
    const double sigma_s[3] = {1.0 / mfp, 0.2 / mfp, 0.0}, none[3] = {0.0, 0.0, 0.0};
    const walk_light light = uniform_light();
    walk_options o = options_for(photons);
    walk_medium medium;
    walk_result r;
    fill_medium(&medium, sigma_s, none, g, eta);
    o.channel_count = eta == 1.0 ? 3 : 2; // without scattering, total reflection keeps nothing inside only for eta = 1
    CHECK_EQUAL(walk_run(b->scene, &medium, &light, 1, &o, &r), 0);
    for (int k = 0; k < o.channel_count; ++k)
    {
        const double want = 4.0 * eta * eta * b->volume / r.entered[k]; // entered = S (1 - F_external)
        test_note("mean path %.4f mm, closed form %.4f, %.1f standard errors; %.1f scatterings", r.path[k].value, want,
                  (r.path[k].value - want) / r.path[k].error, (double)r.scatterings[k] / (double)r.photons[k]);
        CHECK_ABS(r.path[k].value, want, 3.5 * r.path[k].error + 1e-4 * want);
        CHECK_BELOW(r.path[k].error, 0.05 * want); // else the check above says nothing
        CHECK(fabs(r.path[k].value * eta * eta - want) > 3.5 * r.path[k].error || eta == 1.0); // eta^2 is needed
    }
    walk_result_free(&r);
}

static void furnace_and_paths_in_a_ball_and_a_box(void)
{
    mesh_data mesh;
    body b;
    if (sphere_body(3, 10.0, &b) != 0)
        return;
    test_about("ball, isotropic, eta 1.3");
    check_furnace(&b, 1.0, 0.0, 1.3, 20000, 0.0);
    check_paths(&b, 1.0, 0.0, 1.3, 20000);
    test_about("ball, g = 0.8, eta 1");
    check_paths(&b, 0.5, 0.8, 1.0, 20000);
    free_body(&b);
    static const float corners[24] = {0, 0, 0, 1, 0, 0, 0, 3, 0, 1, 3, 0, 0, 0, 7, 1, 0, 7, 0, 3, 7, 1, 3, 7};
    static const uint32_t faces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    CHECK_EQUAL(mesh_make(corners, 8, faces, 12, &mesh), 0);
    if (make_body(&mesh, 14.0, &b) != 0)
        return;
    test_about("box, eta 1.5");
    CHECK_REL(b.volume, 2.0 * 6.0 * 14.0, 1e-6);
    check_paths(&b, 1.0, 0.0, 1.5, 20000);
    free_body(&b);
}

static void furnace_and_paths_in_the_bunny(void)
{
    mesh_data mesh;
    body b;
    if (mesh_load_bunny(&mesh) != 0)
        SKIP("no bunny: install glmark2-data");
    if (make_body(&mesh, 50.0, &b) != 0)
        return;
    test_about("bunny");
    check_furnace(&b, 4.0, 0.0, 1.3, 16000, 2e-4); // three triangles of its filled hole are folded over: 1e-5 a ray
    check_paths(&b, 4.0, 0.5, 1.3, 8000);
    free_body(&b);
}

static void ball_that_only_absorbs(void)
{   // Oracle: chords of a ball under the same radiance from everywhere have the density l/(2 R^2): what gets through is
    // 2 (1 - (1 + tau) e^-tau)/tau^2, tau = 2 R sigma_a. Facets are 0.1 % of it.
    static const double none[3] = {0.0, 0.0, 0.0}, sigma_a[3] = {0.1, 0.5, 2.0};
    const walk_light light = uniform_light();
    walk_options o = options_for(40000);
    walk_medium medium;
    walk_result r;
    body b;
    fill_medium(&medium, none, sigma_a, 0.0, 1.0);
    if (sphere_body(5, 2.0, &b) != 0)
        return;
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 0);
    for (int k = 0; k < 3; ++k)
    {
        const double tau = 2.0 * sigma_a[k], want = 2.0 * (1.0 - (1.0 + tau) * exp(-tau)) / (tau * tau);
        CHECK_ABS(r.left[k].value / r.entered[k], want, 3.5 * r.left[k].error / r.entered[k] + 2e-3 * want);
    }
    walk_result_free(&r);
    free_body(&b);
}

// ---- The run ----

static int same_results(const walk_result *a, const walk_result *b)
{
    return memcmp(a->B, b->B, 3 * a->patch_count * sizeof *a->B) == 0 &&
           memcmp(a->B_error, b->B_error, 3 * a->patch_count * sizeof *a->B) == 0 &&
           memcmp(a->left, b->left, sizeof a->left) == 0 && memcmp(a->absorbed, b->absorbed, sizeof a->left) == 0 &&
           memcmp(a->path, b->path, sizeof a->path) == 0;
}

static void threads_and_shortcuts_change_nothing(void)
{   // Oracle: the serial run, a ray for every flight.
    static const double sigma_s[3] = {2.0, 8.0, 1.0}, sigma_a[3] = {0.01, 0.001, 0.5};
    static const int counts[] = {1, 2, 7};
    const walk_light light = {WALK_DIRECTIONAL, {1.0, 2.0, 0.5}, {1.0, 0.5, 2.0}, NULL, 0};
    uint32_t patches[2048];
    walk_medium medium;
    walk_result want, got;
    body b;
    fill_medium(&medium, sigma_s, sigma_a, 0.0, 1.3);
    if (sphere_body(4, 10.0, &b) != 0)
        return;
    CHECK_EQUAL(b.view.triangle_count, 2048);
    walk_options o = options_for(1600);
    o.patches = patches;
    o.patch_count = walk_patches(&b.view, 20, patches);
    o.hooks = NULL;
    o.every_ray = 1;
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &want), 0);
    o.every_ray = 0;
    for (size_t i = 0; i < sizeof counts / sizeof *counts; ++i)
    {
        int threads = counts[i];
        sss_hooks hooks;
        memset(&hooks, 0, sizeof hooks);
        hooks.user = &threads;
        hooks.parallel_for = threads_hook;
        o.hooks = &hooks;
        CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &got), 0);
        CHECK(same_results(&got, &want));
        CHECK_BELOW((double)got.rays[1], 0.7 * (double)want.rays[1]); // the shortcut is taken
        walk_result_free(&got);
    }
    o.seed += 1;
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &got), 0);
    CHECK(!same_results(&got, &want));
    walk_result_free(&got);
    walk_result_free(&want);
    free_body(&b);
}

static void light_enters_as_the_dipole_counts_it(void)
{   // Oracle: sss_dipole_irradiance at vertices, averaged over patches. A mask that leaves half.
    mesh_data mesh;
    body b;
    static uint32_t patches[8192];
    CHECK_EQUAL(mesh_sphere(5, 1.0, &mesh), 0);
    if (make_body(&mesh, 10.0, &b) != 0)
        return;
    const size_t V = b.view.vertex_count, T = b.view.triangle_count;
    float *const E = (float *)malloc(3 * V * sizeof *E), *const mask = (float *)malloc(V * sizeof *mask);
    CHECK_EQUAL(T, 8192);
    const size_t P = walk_patches(&b.view, 50, patches);
    double *const means = (double *)malloc(3 * P * sizeof *means);
    for (int kind = 0; kind < 3; ++kind)
    {
        sss_dipole_light given;
        sss_dipole_irradiance_options how;
        walk_light light;
        walk_medium medium;
        walk_result r;
        static const double sigma[3] = {5.0, 5.0, 5.0};
        walk_options o = options_for(16);
        memset(&given, 0, sizeof given);
        memset(&how, 0, sizeof how);
        memset(&light, 0, sizeof light);
        how.eta = 1.4;
        light.color[0] = given.color[0] = 1.0;
        light.color[1] = given.color[1] = 0.5;
        light.color[2] = given.color[2] = 3.0;
        light.direction[0] = given.direction[0] = 1.0;
        light.direction[1] = given.direction[1] = -2.0;
        for (size_t v = 0; v < V; ++v)
            mask[v] = b.mesh.positions[3 * v + 2] > 0.1f ? 1.0f : 0.0f;
        if (kind == 1)
            light.mask = given.visibility = mask;
        if (kind == 2) // radiance (1 + 0.6 y)/pi
        {
            light.kind = WALK_DIFFUSE;
            given.kind = SSS_DIPOLE_LIGHT_ENVIRONMENT;
            light.direction[0] = 0.0;
            light.direction[1] = 0.6;
            for (int k = 0; k < 3; ++k)
            {
                light.color[k] = 1.0;
                given.sh[0][k] = 1.0 / (PI * 0.28209479177387814);
                given.sh[1][k] = 0.6 / (PI * 0.48860251190291992);
            }
        }
        CHECK_EQUAL(sss_dipole_irradiance(&b.view, &given, 1, &how, E), SSS_OK);
        walk_patch_means(&b.view, patches, P, E, means, NULL);
        fill_medium(&medium, sigma, sigma, 0.0, 1.4);
        o.patches = patches;
        o.patch_count = P;
        CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 0);
        double away = 0.0, most = 0.0, total = 0.0;
        for (size_t i = 0; i < 3 * P; ++i)
        {
            away = fmax(away, fabs(means[i] - r.E[i]));
            most = fmax(most, means[i]);
            total += i % 3 == 0 ? r.E[i] * r.area[i / 3] : 0.0;
        }
        test_about("light %d", kind);
        CHECK_BELOW(away, (kind == 2 ? 1e-4 : 1e-6) * most); // environments of sss_dipole.h use tabulated lobes
        CHECK_REL(total, r.entered[0], 1e-12);
        walk_result_free(&r);
    }
    free(means);
    free(E);
    free(mask);
    free_body(&b);
}

// A box of six sides that keep their own corners, so that vertex normals are the sides'.
static int flat_box(double width, double depth, mesh_data *out)
{
    float positions[72];
    uint32_t triangles[36];
    for (uint32_t side = 0; side < 6; ++side)
    {
        const size_t axis = side / 2, u = (axis + 1 + side % 2) % 3, v = (axis + 2 - side % 2) % 3;
        static const uint32_t two[6] = {0, 1, 3, 0, 3, 2};
        for (size_t i = 0; i < 4; ++i)
        {
            float *const x = positions + 3 * (4 * side + i);
            x[axis] = side % 2 ? -0.5f : 0.5f;
            x[u] = i % 2 ? 0.5f : -0.5f;
            x[v] = i / 2 ? 0.5f : -0.5f;
            x[0] *= (float)width;
            x[1] *= (float)width;
            x[2] *= (float)depth;
        }
        for (size_t i = 0; i < 6; ++i)
            triangles[6 * side + i] = 4 * side + two[i];
    }
    return mesh_make(positions, 24, triangles, 12, out);
}

static void parallel_light_on_a_slab(void)
{   // Oracle: van de Hulst's and adding-doubling's slabs, of parallel light on a wide plate instead of a beam at a
    // point. What is within a few depths of the rim, 0.4 % of the plate, may differ.
    for (size_t i = 0; i < bench_layer_count; ++i)
    {
        const bench_layer *const l = &bench_layers[i];
        walk_light light = {WALK_DIRECTIONAL, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, NULL, 0};
        const double sigma_s[3] = {l->albedo, 0.0, 0.0}, sigma_a[3] = {1.0 - l->albedo, 0.0, 0.0}, width = 1000.0;
        uint32_t patches[12];
        walk_options o = options_for(30000);
        walk_medium medium;
        walk_result r;
        mesh_data mesh;
        body b;
        if (l->depth != 1.0 || l->cosine == 0.0)
            continue;
        test_about("albedo %g, g %g, eta %g, cosine %.2f", l->albedo, l->g, l->eta, l->cosine);
        CHECK_EQUAL(flat_box(width, l->depth, &mesh), 0);
        if (make_body(&mesh, width, &b) != 0)
            return;
        CHECK_REL(b.volume, width * width * l->depth, 1e-5);
        light.direction[1] = sqrt(1.0 - l->cosine * l->cosine);
        light.direction[2] = l->cosine;
        for (uint32_t t = 0; t < 12; ++t)
            patches[t] = b.mesh.normals[3 * b.mesh.triangles[3 * t] + 2] > 0.5f    ? 0
                         : b.mesh.normals[3 * b.mesh.triangles[3 * t] + 2] < -0.5f ? 1
                                                                                   : 2;
        fill_medium(&medium, sigma_s, sigma_a, l->g, l->eta);
        o.patches = patches;
        o.patch_count = 3;
        CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 0);
        const double fallen = width * width * l->cosine, F = 1.0 - r.E[0] / l->cosine;
        CHECK_ABS(F + r.B[0] * r.area[0] / fallen, l->R, 3.5 * r.B_error[0] * r.area[0] / fallen + 4e-3 * l->R);
        CHECK_ABS(r.B[3] * r.area[1] / fallen, l->T, 3.5 * r.B_error[3] * r.area[1] / fallen + 4e-3 * l->T);
        walk_result_free(&r);
        free_body(&b);
    }
}

static void bodies_inside_out_are_lost(void)
{   // The mutation that closed meshes need: turned round, nothing is inside.
    static const double sigma_s[3] = {1.0, 1.0, 1.0}, sigma_a[3] = {0.0, 0.1, 1.0};
    const walk_light light = uniform_light();
    const walk_options o = options_for(2000);
    walk_medium medium;
    walk_result r;
    mesh_data mesh;
    body b;
    fill_medium(&medium, sigma_s, sigma_a, 0.0, 1.3);
    CHECK_EQUAL(mesh_sphere(3, 1.0, &mesh), 0);
    for (size_t t = 0; t < mesh.triangle_count; ++t)
    {
        const uint32_t kept = mesh.triangles[3 * t];
        mesh.triangles[3 * t] = mesh.triangles[3 * t + 1];
        mesh.triangles[3 * t + 1] = kept;
    }
    b.mesh = mesh;
    b.view = mesh_view(&mesh, 1.0);
    b.scene = walk_scene_create(&b.view);
    CHECK(b.scene != NULL);
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 0);
    CHECK_BETWEEN(r.lost[0].value / r.entered[0], 0.9, 1.0 + 1e-12);
    walk_result_free(&r);
    free_body(&b);
}

static void unusable_arguments_are_refused(void)
{
    static const double sigma[3] = {1.0, 1.0, 1.0};
    const sss_mesh empty = {NULL, NULL, NULL, 0, 0, 1.0};
    walk_light light = uniform_light();
    walk_options o = options_for(100);
    walk_medium medium;
    walk_result r;
    body b;
    CHECK(walk_scene_create(&empty) == NULL);
    fill_medium(&medium, sigma, sigma, 1.0, 1.3); // g = 1 is no distribution
    if (sphere_body(2, 1.0, &b) != 0)
        return;
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 1);
    CHECK(r.B == NULL && r.photons[0] == 0);
    medium.g = 0.0;
    medium.sigma_a[1] = NAN;
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 1);
    medium.sigma_a[1] = 0.0;
    o.batches = 3; // too few for a standard error
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 1);
    o.batches = 16;
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 0, &o, &r), 1);
    light.direction[0] = 2.0; // a negative radiance
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 1);
    light.direction[0] = 0.0;
    memset(light.color, 0, sizeof light.color); // nothing is lit
    CHECK_EQUAL(walk_run(b.scene, &medium, &light, 1, &o, &r), 1);
    free_body(&b);
}

// ---- Patches ----

static int same_place(const float a[3], const float b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

static int share_an_edge(const mesh_data *mesh, size_t a, size_t b)
{
    int shared = 0;
    for (size_t i = 0; i < 9; ++i)
        shared += same_place(mesh->positions + 3 * (size_t)mesh->triangles[3 * a + i / 3],
                             mesh->positions + 3 * (size_t)mesh->triangles[3 * b + i % 3]);
    return shared >= 2;
}

// Connected parts of the patches, by flooding each from its first triangle, pair by pair.
static size_t components_of(const mesh_data *mesh, const uint32_t *patches)
{
    const size_t T = mesh->triangle_count;
    size_t *const queue = (size_t *)malloc(T * sizeof *queue), components = 0;
    unsigned char *const met = (unsigned char *)calloc(T, 1);
    for (size_t first = 0; first < T; ++first)
    {
        if (met[first])
            continue;
        ++components;
        met[first] = 1;
        queue[0] = first;
        for (size_t head = 0, tail = 1; head < tail; ++head)
        {
            for (size_t t = 0; t < T; ++t)
            {
                if (!met[t] && patches[t] == patches[first] && share_an_edge(mesh, queue[head], t))
                {
                    met[t] = 1;
                    queue[tail++] = t;
                }
            }
        }
    }
    free(queue);
    free(met);
    return components;
}

static void patches_are_even_and_connected(void)
{   // Oracle: a flood over shared edges meets every triangle of a patch; areas.
    mesh_data mesh;
    if (mesh_sphere(4, 1.0, &mesh) != 0)
        return;
    const sss_mesh view = mesh_view(&mesh, 2.0);
    const size_t T = mesh.triangle_count;
    uint32_t *const patches = (uint32_t *)malloc(2 * T * sizeof *patches);
    double area[64] = {0.0}, means[192], mm2[64], least = HUGE_VAL, most = 0.0, sum = 0.0;
    const size_t P = walk_patches(&view, 40, patches);
    CHECK_EQUAL(P, 40);
    CHECK_EQUAL(walk_patches(&view, 40, patches + T), 40);
    CHECK(memcmp(patches, patches + T, T * sizeof *patches) == 0);
    for (size_t t = 0; t < T; ++t)
        area[patches[t] % 64] += 4.0 * mesh_triangle_area(&mesh, t);
    for (size_t p = 0; p < P; ++p)
    {
        least = fmin(least, area[p]);
        most = fmax(most, area[p]);
        sum += area[p];
    }
    test_note("areas: %.2f to %.2f of the mean", least * (double)P / sum, most * (double)P / sum);
    CHECK(least * (double)P / sum > 0.5 && most * (double)P / sum < 1.6);
    CHECK_EQUAL(components_of(&mesh, patches), P);
    walk_patch_means(&view, patches, P, mesh.positions, means, mm2);
    double balance_of = 0.0;
    for (size_t p = 0; p < P; ++p)
    {
        CHECK_REL(mm2[p], area[p], 1e-12);
        balance_of += mm2[p] * means[3 * p]; // x over a whole sphere
    }
    CHECK_ABS(balance_of, 0.0, 1e-5 * sum);
    free(patches);
    mesh_free(&mesh);
}

// ---- Files ----

// A small lit ball of a known material.
typedef struct sample
{
    body b;
    sss_profile profile;
    float *irradiance;
    walk_light light;
    truth_case c;
} sample;

static int make_sample(sample *s)
{
    sss_dipole_material material;
    sss_dipole_irradiance_options how;
    sss_dipole_light light;
    memset(s, 0, sizeof *s);
    memset(&how, 0, sizeof how);
    memset(&light, 0, sizeof light);
    light.direction[2] = light.color[0] = light.color[1] = light.color[2] = 1.0;
    if (sphere_body(3, 5.0, &s->b) != 0)
        return 1;
    CHECK_EQUAL(sss_dipole_material_by_name("skin1", &material), SSS_OK);
    CHECK_EQUAL(sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &s->profile), SSS_OK);
    how.eta = material.eta;
    s->irradiance = (float *)malloc(3 * s->b.view.vertex_count * sizeof *s->irradiance);
    CHECK_EQUAL(sss_dipole_irradiance(&s->b.view, &light, 1, &how, s->irradiance), SSS_OK);
    s->light.direction[2] = s->light.color[0] = s->light.color[1] = s->light.color[2] = 1.0;
    s->c.mesh_name = "ball";
    s->c.mesh = &s->b.view;
    s->c.profile = &s->profile;
    s->c.irradiance = s->irradiance;
    s->c.light_name = "front";
    return 0;
}

static void free_sample(sample *s)
{
    free(s->irradiance);
    free_body(&s->b);
}

static const truth_settings small = {0.0, 3200, 1, 30, 0};

static void media_follow_profiles(void)
{   // Oracle: the material's own coefficients; a g keeps the reduced ones.
    sss_dipole_material material;
    sss_profile profile;
    walk_medium m;
    CHECK_EQUAL(sss_dipole_material_by_name("marble", &material), SSS_OK);
    CHECK_EQUAL(sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &profile), SSS_OK);
    walk_medium_of(&profile, 0.8, &m);
    CHECK_REL(m.sigma_s[0] * (1.0 - 0.8), 2.19, 1e-12);
    CHECK_REL(m.sigma_s[2] * (1.0 - 0.8), 3.00, 1e-12);
    CHECK_REL(m.sigma_a[1], 0.0041, 1e-9);
    CHECK_REL(m.eta, 1.5, 1e-15);
}

static void files_come_back_and_refuse_others(void)
{
    const char *const folder = getenv("TMPDIR") != NULL ? getenv("TMPDIR") : "/tmp";
    char path[256];
    sample s;
    truth made, got;
    snprintf(path, sizeof path, "%s/sss_test_walk_%ld.csv", folder, (long)getpid());
    if (make_sample(&s) != 0)
        return;
    CHECK_EQUAL(truth_make(&s.c, &s.light, 1, &small, all_threads(), &made), 0);
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_NONE);
    CHECK_EQUAL(truth_write(path, &s.c, "a command", &made), 0);
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_OK);
    CHECK_EQUAL(got.patch_count, made.patch_count);
    double worst = 0.0;
    for (size_t i = 0; i < 3 * got.patch_count; ++i)
        keep_worst(&worst, made.B[i] > 0.0 ? relative_error(got.B[i], made.B[i]) : got.B[i]);
    CHECK_BELOW(worst, 1e-5);
    CHECK(got.settings.photons == small.photons && got.settings.seed == small.seed);
    truth_free(&got);
    // Another mesh, scale, material, light (by name, and by irradiance under the same name).
    s.b.mesh.positions[0] += 1e-3f;
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_STALE);
    s.b.mesh.positions[0] -= 1e-3f;
    s.b.view.mm_per_unit *= 1.001;
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_STALE);
    s.b.view.mm_per_unit /= 1.001;
    s.profile.alpha_p[2] *= 0.999;
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_STALE);
    CHECK(got.B == NULL);
    free_sample(&s);
    CHECK_EQUAL(make_sample(&s), 0);
    s.c.light_name = "side";
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_STALE);
    s.c.light_name = "front";
    for (size_t v = 0; v < s.b.view.vertex_count / 10; ++v)
        s.irradiance[3 * v] *= 1.1f;
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_STALE);
    free_sample(&s);
    CHECK_EQUAL(make_sample(&s), 0);
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_OK);
    truth_free(&got);
    // One digit of the numbers, a lost end.
    FILE *file = fopen(path, "r+");
    CHECK(file != NULL);
    char text[8192];
    const size_t length = file != NULL ? fread(text, 1, sizeof text, file) : 0;
    for (size_t at = length / 2; file != NULL && at < length; ++at)
    {
        if (text[at] == '3')
        {
            text[at] = '4';
            break;
        }
    }
    if (file != NULL)
    {
        rewind(file);
        CHECK_EQUAL(fwrite(text, 1, length, file), length);
        fclose(file);
    }
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_BROKEN);
    CHECK_EQUAL(truncate(path, (off_t)(length / 2)), 0);
    CHECK_EQUAL(truth_read(path, &s.c, &got), TRUTH_BROKEN);
    CHECK_EQUAL(remove(path), 0);
    truth_free(&made);
    free_sample(&s);
}

static void lights_that_differ_are_no_truth(void)
{
    sample s;
    truth t;
    if (make_sample(&s) != 0)
        return;
    s.light.direction[0] = 0.1; // the case's irradiance is of another direction
    CHECK_EQUAL(truth_make(&s.c, &s.light, 1, &small, all_threads(), &t), 1);
    CHECK(t.B == NULL);
    free_sample(&s);
}

static void the_models_error_is_without_the_noise(void)
{   // Oracle: a B that is known against a truth made of it: 7 % too bright, plus noise of known size, as often as makes
    // the mean of the result's square exact.
    enum
    {
        TIMES = 200
    };
    sample s;
    truth t;
    truth_error e;
    double squares = 0.0, noise = 0.0, spread = 0.0;
    if (make_sample(&s) != 0)
        return;
    CHECK_EQUAL(truth_make(&s.c, &s.light, 1, &small, all_threads(), &t), 0);
    double *const clean = (double *)malloc(3 * t.patch_count * sizeof *clean);
    walk_patch_means(&s.b.view, t.patches, t.patch_count, s.irradiance, clean, NULL); // any B will do: E
    random_seed(11);
    for (int i = 0; i < TIMES; ++i)
    {
        for (size_t k = 0; k < 3 * t.patch_count; ++k)
        {
            double gauss = -6.0; // Irwin and Hall's
            for (int j = 0; j < 12; ++j)
                gauss += random_unit();
            t.B_error[k] = 0.05;
            t.B[k] = clean[k] / 1.07 + 0.05 * gauss;
        }
        truth_model_error(&t, &s.c, s.irradiance, &e);
        squares += e.rel_l2 * e.rel_l2 / TIMES;
        spread += e.rel_l2_error / TIMES;
        noise = e.noise;
    }
    test_note("error %.4f (0.07 put in), noise %.4f, its own standard error %.4f", sqrt(squares), noise, spread);
    CHECK_BETWEEN(noise, 0.05, 0.5);
    CHECK_ABS(sqrt(squares), 0.07, 4.0 * spread / sqrt(TIMES));
    CHECK(fabs(hypot(sqrt(squares), noise) - 0.07) > 4.0 * spread / sqrt(TIMES)); // with the noise it would not hold
    memcpy(t.B, clean, 3 * t.patch_count * sizeof *clean);
    memset(t.B_error, 0, 3 * t.patch_count * sizeof *t.B_error);
    for (size_t k = 0; k < 3 * t.patch_count; ++k)
        t.B[k] /= 1.07;
    truth_model_error(&t, &s.c, s.irradiance, &e);
    CHECK_REL(e.rel_l2, 0.07, 1e-6);
    CHECK_REL(e.mean_ratio[1], 1.07, 1e-6);
    CHECK_REL(e.rel_l2_rgb[2], 0.07, 1e-6);
    free(clean);
    truth_free(&t);
    free_sample(&s);
}

static void truths_of_one_case_differ_by_their_noise(void)
{   // Oracle: two seeds give the same but for noise, which is subtracted; a half as bright light differs by a half.
    sample s;
    truth a, b;
    double away, noise;
    truth_settings other = small;
    if (make_sample(&s) != 0)
        return;
    other.seed = 2;
    CHECK_EQUAL(truth_make(&s.c, &s.light, 1, &small, all_threads(), &a), 0);
    CHECK_EQUAL(truth_make(&s.c, &s.light, 1, &other, all_threads(), &b), 0);
    CHECK_EQUAL(truth_difference(&a, &b, &away, &noise), 0);
    test_note("two seeds: %.4f apart, noise %.4f", away, noise);
    CHECK_BETWEEN(noise, 0.01, 0.2);
    CHECK_BELOW(away, 0.5 * noise); // 90 numbers: their squares' mean is known to 15 %
    for (size_t i = 0; i < 3 * a.patch_count; ++i)
    {
        a.B[i] *= 0.5;
        a.B_error[i] *= 0.5;
    }
    CHECK_EQUAL(truth_difference(&a, &b, &away, &noise), 0);
    CHECK_ABS(away, 0.5, 2.0 * noise);
    a.patch_count -= 1;
    CHECK_EQUAL(truth_difference(&a, &b, &away, &noise), 1);
    truth_free(&a);
    truth_free(&b);
    free_sample(&s);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {
        TEST(layers_agree_with_known_values),
        TEST(mutated_layers_disagree),
        TEST(rings_agree_with_mcml),
        TEST(energy_is_conserved),
        TEST(furnace_and_paths_in_a_ball_and_a_box),
        TEST(furnace_and_paths_in_the_bunny),
        TEST(ball_that_only_absorbs),
        TEST(threads_and_shortcuts_change_nothing),
        TEST(light_enters_as_the_dipole_counts_it),
        TEST(parallel_light_on_a_slab),
        TEST(bodies_inside_out_are_lost),
        TEST(unusable_arguments_are_refused),
        TEST(patches_are_even_and_connected),
        TEST(media_follow_profiles),
        TEST(files_come_back_and_refuse_others),
        TEST(lights_that_differ_are_no_truth),
        TEST(the_models_error_is_without_the_noise),
        TEST(truths_of_one_case_differ_by_their_noise),
    };
    return test_main(argc, argv, "the random walk", tests, sizeof tests / sizeof *tests);
}
