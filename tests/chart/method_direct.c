// Direct gather and Lambert: what every other method is compared with.
//   lambert         B = Rd_total E at the vertex
//   direct          every triangle integrated to a tolerance; on thinner and thinner copies of the mesh
//   direct-points   one sample a triangle at its centroid, on the same copies
//   direct-scalar   the same at full density by the plain double-precision loop: the baseline of speed
//   direct-placed   as direct, with sources placed at the receiver, at full density: for methods that place them

#include "chart.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- lambert ----

static int lambert_prepare(const chart_case *c, size_t variant, chart_run *run)
{
    (void)variant;
    run->state = malloc(c->mesh.vertex_count * 6 * sizeof(float)); // irradiance, and the rows asked for
    snprintf(run->parameters, sizeof run->parameters, "none");
    return run->state == NULL;
}

static int lambert_relight(const chart_case *c, chart_run *run)
{
    return chart_irradiance(c, &c->view, (float *)run->state);
}

static int lambert_radiosity(const chart_case *c, chart_run *run, const chart_rows *rows, float *radiosity)
{
    const float *const irradiance = (const float *)run->state;
    float *const wanted = (float *)run->state + 3 * c->mesh.vertex_count;
    for (size_t i = 0; i < rows->count; ++i)
    {
        memcpy(wanted + 3 * i, irradiance + 3 * rows->indices[i], 3 * sizeof(float));
    }
    return sss_dipole_lambert(&c->profile, wanted, rows->count, radiosity) != SSS_OK;
}

static void lambert_release(chart_run *run)
{
    free(run->state);
}

// Nothing is kept.
static int lambert_rebuild(const chart_case *c, chart_run *run, const mesh_data *moved)
{
    (void)c;
    (void)run;
    (void)moved;
    return 0;
}

const chart_method chart_lambert = {"lambert", 1, lambert_prepare, lambert_relight, lambert_radiosity,
                                    lambert_release, CHART_DISTANCE, NULL, lambert_rebuild, NULL};

// ---- direct gather ----

typedef struct direct
{
    mesh_data thinned; // empty at full density
    sss_mesh view;
    float *irradiance; // [V][3] of the view
    sss_dipole_gather *gather;
    sss_dipole_gather_options options;
} direct;

static void direct_release(chart_run *run)
{
    direct *const d = (direct *)run->state;
    if (d)
    {
        sss_dipole_gather_free(d->gather);
        mesh_free(&d->thinned);
        free(d->irradiance);
        free(d);
    }
    run->state = NULL;
}

// density: the emitters' triangles over those of the mesh.
static int direct_prepare_with(const chart_case *c, double density, const sss_dipole_gather_options *options,
                               chart_run *run)
{
    sss_dipole_gather_stats stats;
    direct *const d = (direct *)calloc(1, sizeof *d);
    run->state = d;
    if (!d)
    {
        return 1;
    }
    d->view = c->view;
    d->options = *options;
    if (density < 1.0)
    {
        if (mesh_decimate(&c->mesh, 1.0 / density, &d->thinned) != 0)
        {
            return 1;
        }
        d->view = mesh_view(&d->thinned, c->view.mm_per_unit);
    }
    d->irradiance = (float *)malloc(d->view.vertex_count * 3 * sizeof(float));
    if (!d->irradiance ||
        sss_dipole_gather_create(&d->view, &c->profile, options, run->hooks, &d->gather) != SSS_OK ||
        sss_dipole_gather_get_stats(d->gather, &stats) != SSS_OK)
    {
        return 1;
    }
    run->bytes = stats.bytes;
    run->error_bound = stats.predicted_error;
    snprintf(run->parameters, sizeof run->parameters, "emitters=%zu;spacing_mm=%.3g;tolerance=%.0e;path=%d",
             stats.emitter_count, stats.mean_edge_mm, stats.tolerance, (int)stats.path);
    return 0;
}

static int direct_relight(const chart_case *c, chart_run *run)
{
    direct *const d = (direct *)run->state;
    return chart_irradiance(c, &d->view, d->irradiance) ||
           sss_dipole_gather_set_irradiance(d->gather, SSS_DIPOLE_VERTICES, d->irradiance) != SSS_OK;
}

static int direct_radiosity(const chart_case *c, chart_run *run, const chart_rows *rows, float *radiosity)
{
    direct *const d = (direct *)run->state;
    sss_dipole_receivers receivers;
    (void)c;
    receivers.positions = rows->positions;
    receivers.normals = rows->normals;
    receivers.count = rows->count;
    return sss_dipole_gather_run(d->gather, &receivers, radiosity) != SSS_OK;
}

// The copy that is thinned stays the same for an object that moves, as thinning does not depend on the moment.
static int direct_rebuild(const chart_case *c, chart_run *run, const mesh_data *moved)
{
    direct *const d = (direct *)run->state;
    const sss_mesh view = d->thinned.positions ? d->view : mesh_view(moved, c->view.mm_per_unit);
    sss_dipole_gather_free(d->gather);
    d->gather = NULL;
    return sss_dipole_gather_create(&view, &c->profile, &d->options, run->hooks, &d->gather) != SSS_OK;
}

static const double densities[] = {1.0, 1.0 / 4.0, 1.0 / 16.0, 1.0 / 64.0};
static const double tolerances[] = {1e-4, 1e-3, 1e-2}; // full density; thinned copies, no better, take the last
enum
{
    DENSITY_COUNT = sizeof densities / sizeof densities[0],
    INTEGRATED_DENSITY_COUNT = DENSITY_COUNT - 1, // fewer triangles than that cost as much, for they need more pieces
    TOLERANCE_COUNT = sizeof tolerances / sizeof tolerances[0]
};

static int direct_prepare(const chart_case *c, size_t variant, chart_run *run)
{
    sss_dipole_gather_options options;
    memset(&options, 0, sizeof options);
    options.tolerance = variant < TOLERANCE_COUNT ? tolerances[variant] : tolerances[TOLERANCE_COUNT - 1];
    return direct_prepare_with(c, variant < TOLERANCE_COUNT ? 1.0 : densities[variant - TOLERANCE_COUNT + 1],
                               &options, run);
}

static int placed_prepare(const chart_case *c, size_t variant, chart_run *run)
{
    sss_dipole_gather_options options;
    memset(&options, 0, sizeof options);
    options.tolerance = tolerances[variant + 1];
    options.geometry = SSS_DIPOLE_PLACED;
    return direct_prepare_with(c, 1.0, &options, run);
}

static int points_prepare(const chart_case *c, size_t variant, chart_run *run)
{
    sss_dipole_gather_options options;
    memset(&options, 0, sizeof options);
    options.point_sampling = 1;
    return direct_prepare_with(c, densities[variant], &options, run);
}

static int scalar_prepare(const chart_case *c, size_t variant, chart_run *run)
{
    sss_dipole_gather_options options;
    memset(&options, 0, sizeof options);
    options.point_sampling = 1;
    options.path = SSS_DIPOLE_PATH_SCALAR;
    (void)variant;
    return direct_prepare_with(c, 1.0, &options, run);
}

const chart_method chart_direct = {"direct", TOLERANCE_COUNT + INTEGRATED_DENSITY_COUNT - 1, direct_prepare,
                                   direct_relight, direct_radiosity, direct_release, CHART_DISTANCE, NULL,
                                   direct_rebuild, NULL};
const chart_method chart_direct_points = {"direct-points", DENSITY_COUNT, points_prepare, direct_relight,
                                          direct_radiosity, direct_release, CHART_DISTANCE, NULL, direct_rebuild,
                                          NULL};
const chart_method chart_direct_scalar = {"direct-scalar", 1, scalar_prepare, direct_relight, direct_radiosity,
                                          direct_release, CHART_DISTANCE, NULL, direct_rebuild, NULL};
const chart_method chart_direct_placed = {"direct-placed", TOLERANCE_COUNT - 1, placed_prepare, direct_relight,
                                          direct_radiosity, direct_release, CHART_PLACED, NULL, direct_rebuild,
                                          NULL};
