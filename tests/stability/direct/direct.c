// What breaks the direct gather of sss_dipole.h, in both geometries: see ../record.h.
//   build/tests/stability/direct [--write FOLDER] [TEST]

#define SSS_DIPOLE_IMPLEMENTATION
#include "../../../sss_dipole.h"

#include "../../../examples/common/threads.h"
#include "../../common/walk.h"
#include "../sweeps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static claim claim_of(const sss_dipole_gather *gather)
{
    sss_dipole_gather_stats stats;
    claim c;
    memset(&stats, 0, sizeof stats);
    CHECK_EQUAL(sss_dipole_gather_get_stats(gather, &stats), SSS_OK);
    c.predicted = stats.predicted_error;
    c.edge_paths = stats.edge_paths;
    c.border_mm = stats.border_mm;
    c.normals_against = stats.normals_against;
    c.inside_out = stats.inside_out;
    return c;
}

static int gather(const scene *s, sss_dipole_geometry geometry, const double (*lights)[3], size_t light_count, float *B,
                  claim *said)
{
    const size_t V = s->mesh.vertex_count;
    const sss_dipole_receivers receivers = {s->mesh.positions, s->mesh.normals, V};
    sss_dipole_gather_options options;
    sss_hooks hooks;
    sss_dipole_gather *g = NULL;
    scene lit = *s; // under another light
    memset(&options, 0, sizeof options);
    memset(&hooks, 0, sizeof hooks);
    options.geometry = geometry;
    hooks.parallel_for = threads_hook;
    lit.irradiance = (float *)malloc(3 * V * sizeof(float));
    int failed = !lit.irradiance || sss_dipole_gather_create(&s->view, &s->profile, &options, &hooks, &g) != SSS_OK;
    for (size_t i = 0; i < light_count && !failed; ++i)
    {
        failed = scene_light(&lit, lights[i][0], lights[i][1], lights[i][2]) != 0 ||
                 sss_dipole_gather_set_irradiance(g, SSS_DIPOLE_VERTICES, lit.irradiance) != SSS_OK ||
                 sss_dipole_gather_run(g, &receivers, B + 3 * V * i) != SSS_OK;
    }
    if (!failed) *said = claim_of(g);
    sss_dipole_gather_free(g);
    free(lit.irradiance);
    return failed;
}

static int shade(const scene *s, const double (*lights)[3], size_t light_count, float *const *B, claim *claims)
{
    return gather(s, SSS_DIPOLE_DISTANCE, lights, light_count, B[0], &claims[0]) != 0 ||
           gather(s, SSS_DIPOLE_PLACED, lights, light_count, B[1], &claims[1]) != 0;
}

// Sources that are placed without a guard lie on the other face of a slab one mean free path thick: nothing to compare.
static const method direct = {2,
                              {{"distance", SSS_DIPOLE_DISTANCE, 0.0, 1e-3, 1.0, 0.0},
                               {"placed", SSS_DIPOLE_PLACED, 0.0, 1e-3, 1.0, 1.0},
                               {NULL, SSS_DIPOLE_DISTANCE, 0.0, 0.0, 0.0, 0.0}},
                              shade};

#define SWEPT direct
#include "../run.h"

SWEEP(half_space)

// ---- What reduced coefficients lose: the phase function ----

// Forward scattering in full, as the volumetric walk has it.   patches [T];   0 on success
static int walk_once(const walk_scene *walk, const scene *s, double g, const uint32_t *patches, size_t patch_count,
                     uint64_t seed, walk_result *out)
{
    walk_medium medium;
    walk_light light;
    walk_options options;
    sss_hooks hooks;
    memset(&light, 0, sizeof light);
    memset(&options, 0, sizeof options);
    memset(&hooks, 0, sizeof hooks);
    walk_medium_of(&s->profile, g, &medium);
    memcpy(light.direction, s->light, sizeof light.direction);
    light.color[0] = light.color[1] = light.color[2] = 1.0;
    hooks.parallel_for = threads_hook;
    options.photons = record_full() ? 100000 : 4000;
    options.seed = seed;
    options.hooks = &hooks;
    options.patches = patches;
    options.patch_count = patch_count;
    options.channel_first = 2;
    options.channel_count = 1;
    return walk_run(walk, &medium, &light, 1, &options, out);
}

// Relative L2 over patches, the noise of both taken off.
static double patch_difference(const walk_result *a, const walk_result *b)
{
    double sum = 0.0, norm = 0.0;
    for (size_t i = 0; i < a->patch_count; ++i)
    {
        const double d = a->B[3 * i + 2] - b->B[3 * i + 2];
        const double noise_a = a->B_error[3 * i + 2], noise_b = b->B_error[3 * i + 2];
        sum += a->area[i] * (d * d - noise_a * noise_a - noise_b * noise_b);
        norm += b->area[i] * (b->B[3 * i + 2] * b->B[3 * i + 2] - noise_b * noise_b);
    }
    return sqrt(fmax(sum, 0.0) / norm);
}

// model: what a sphere's patches change by when its phase function is that and not isotropic with the same reduced
// coefficients; value, ideal: what leaves, over what enters, so and isotropic.
static void similar_sphere(const char *name, double radius)
{
    static const double cosines[5] = {0.0, 0.5, 0.8, 0.9, 0.95};
    static const double albedo[3] = {0.99, 0.99, 0.99};
    mesh_data mesh;
    scene s;
    walk_result isotropic, forward;
    if (mesh_closed_sphere(3, radius, &mesh) != 0 || scene_create(&mesh, albedo, 1.3, &s) != 0) SKIP("out of memory");
    CHECK_EQUAL(scene_light(&s, 1.0, 2.0, 3.0), 0);
    uint32_t *const patches = (uint32_t *)malloc(s.mesh.triangle_count * sizeof *patches);
    walk_scene *const walk = walk_scene_create(&s.view);
    const size_t patch_count = patches && walk ? walk_patches(&s.view, 24, patches) : 0;
    if (patch_count == 0 || walk_once(walk, &s, 0.0, patches, patch_count, 1, &isotropic) != 0) SKIP("no walk");
    for (int i = record_full() ? 1 : 2; i < (record_full() ? 5 : 3); ++i)
    {
        // Another seed, so that the two noises are independent.
        CHECK_EQUAL(walk_once(walk, &s, cosines[i], patches, patch_count, (uint64_t)(2 + i), &forward), 0);
        row r = row_of(name, "walk", cosines[i]);
        r.value = forward.left[2].value / forward.entered[2];
        r.ideal = isotropic.left[2].value / isotropic.entered[2];
        r.model = patch_difference(&forward, &isotropic);
        test_about("%s, g %.2f", name, cosines[i]);
        // What enters leaves or is absorbed.
        CHECK_ABS(forward.left[2].value + forward.absorbed[2].value + forward.roulette[2].value, forward.entered[2],
                  1e-9 * forward.entered[2] + forward.lost[2].value);
        test_note("leaves %.4f, isotropic %.4f, patches change by %.3f", r.value, r.ideal, r.model);
        record(&r);
        walk_result_free(&forward);
    }
    walk_result_free(&isotropic);
    walk_scene_free(walk);
    free(patches);
    scene_free(&s);
}

static void similarity(void)
{   // Oracle: the volumetric random walk of tests/common, and its balance of energy.
    similar_sphere("similarity 1", 1.0);
    similar_sphere("similarity 5", 5.0);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {COMMON_SWEEPS, TEST(half_space), TEST(similarity)};
    return record_main(argc, argv, "direct", tests, sizeof tests / sizeof *tests);
}
