// What breaks the direct gather of sss_dipole.h, in both geometries: see ../record.h.
//   build/tests/stability/direct [--write FOLDER] [TEST]

#define SSS_DIPOLE_IMPLEMENTATION
#include "../../../sss_dipole.h"

#include "../../../examples/common/threads.h"
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

static const method direct = {2,
                              {{"distance", SSS_DIPOLE_DISTANCE, 0.0, 1e-3, 1.0},
                               {"placed", SSS_DIPOLE_PLACED, 0.0, 1e-3, 1.0},
                               {NULL, SSS_DIPOLE_DISTANCE, 0.0, 0.0, 0.0}},
                              shade};

#define SWEPT direct
#include "../run.h"

SWEEP(half_space)

int main(int argc, char **argv)
{
    static const test_case tests[] = {COMMON_SWEEPS, TEST(half_space)};
    return record_main(argc, argv, "direct", tests, sizeof tests / sizeof *tests);
}
