// Hierarchical boundary elements. Sources are placed at the receiver and guarded, and so are the reference's.
//   bem              everything from scratch for every light; the hierarchy is the precomputation
//   bem-render       links are stored as well: a new light is one sweep over them
//   bem-solid-angle  from scratch, with the paper's oracle instead of the default one; only on small meshes: a frame
//                    of the bunny takes it half a minute (tests/chart/mertens compares the two oracles)

#include "../../sss_bem.h"
#include "chart.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct bem
{
    sss_bem *object;
    float *irradiance; // [V][3]
    float *radiosity;  // [V][3]
} bem;

static const double tolerances[] = {1e-3, 3e-3, 1e-2, 3e-2, 1e-1};
static const double paper_tolerances[] = {1e-2, 1e-1};
enum
{
    TOLERANCE_COUNT = sizeof tolerances / sizeof tolerances[0],
    PAPER_TOLERANCE_COUNT = sizeof paper_tolerances / sizeof paper_tolerances[0],
    PAPER_TRIANGLES_MAX = 20000
};

static void bem_release(chart_run *run)
{
    bem *const b = (bem *)run->state;
    if (b)
    {
        sss_bem_free(b->object);
        free(b->irradiance);
        free(b->radiosity);
        free(b);
    }
    run->state = NULL;
}

static int report(const bem *b, chart_run *run)
{
    sss_bem_stats stats;
    if (sss_bem_get_stats(b->object, &stats) != SSS_OK)
    {
        return 1;
    }
    run->bytes = stats.bytes;
    snprintf(run->parameters, sizeof run->parameters,
             "emitters=%zu;tolerance=%.0e;guard=%.3g;path=%d;clusters=%zu;groups=%zu;links=%zu;near=%zu",
             stats.triangle_count, stats.tolerance, stats.guard, (int)stats.path, stats.cluster_count,
             stats.row_count, stats.link_count, stats.near_count);
    return 0;
}

static int prepare_with(const chart_case *c, const sss_bem_options *options, int stored, chart_run *run)
{
    bem *const b = (bem *)calloc(1, sizeof *b);
    run->state = b;
    if (!b)
    {
        return 1;
    }
    b->irradiance = (float *)malloc(3 * c->mesh.vertex_count * sizeof(float));
    b->radiosity = (float *)malloc(3 * c->mesh.vertex_count * sizeof(float));
    return !b->irradiance || !b->radiosity ||
           sss_bem_create(&c->view, &c->profile, options, run->hooks, &b->object) != SSS_OK ||
           (stored && sss_bem_update(b->object, 0, NULL) != SSS_OK) || report(b, run) != 0;
}

static int bem_prepare(const chart_case *c, size_t variant, chart_run *run)
{
    sss_bem_options options;
    memset(&options, 0, sizeof options);
    options.tolerance = tolerances[variant];
    return prepare_with(c, &options, 0, run);
}

static int render_prepare(const chart_case *c, size_t variant, chart_run *run)
{
    sss_bem_options options;
    memset(&options, 0, sizeof options);
    options.tolerance = tolerances[variant];
    return prepare_with(c, &options, 1, run);
}

static int paper_prepare(const chart_case *c, size_t variant, chart_run *run)
{
    sss_bem_options options;
    if (c->mesh.triangle_count > PAPER_TRIANGLES_MAX)
    {
        return CHART_LEFT_OUT;
    }
    memset(&options, 0, sizeof options);
    options.tolerance = paper_tolerances[variant];
    options.oracle = SSS_BEM_ORACLE_SOLID_ANGLE;
    return prepare_with(c, &options, 0, run);
}

// Every vertex is shaded at once, however few are asked for: all of it counts here.
static int bem_relight_with(const chart_case *c, chart_run *run, sss_result (*shade)(const sss_bem *, float *))
{
    bem *const b = (bem *)run->state;
    return chart_irradiance(c, &c->view, b->irradiance) != 0 ||
           sss_bem_set_irradiance(b->object, SSS_BEM_VERTICES, b->irradiance) != SSS_OK ||
           shade(b->object, b->radiosity) != SSS_OK;
}

static int bem_relight(const chart_case *c, chart_run *run)
{
    return bem_relight_with(c, run, sss_bem_shade);
}

static int render_relight(const chart_case *c, chart_run *run)
{
    return bem_relight_with(c, run, sss_bem_render);
}

static int bem_radiosity(const chart_case *c, chart_run *run, const chart_rows *rows, float *radiosity)
{
    const bem *const b = (const bem *)run->state;
    (void)c;
    for (size_t i = 0; i < rows->count; ++i)
    {
        memcpy(radiosity + 3 * i, b->radiosity + 3 * rows->indices[i], 3 * sizeof(float));
    }
    return 0;
}

static int bem_predict(chart_run *run)
{
    sss_bem_stats stats;
    bem *const b = (bem *)run->state;
    if (sss_bem_predict_error(b->object, 0, NULL) != SSS_OK || sss_bem_get_stats(b->object, &stats) != SSS_OK)
    {
        return 1;
    }
    run->error_bound = stats.predicted_error;
    return 0;
}

static int bem_rebuild(const chart_case *c, chart_run *run, const mesh_data *moved)
{
    const bem *const b = (const bem *)run->state;
    (void)c;
    return sss_bem_set_vertices(b->object, moved->positions, moved->normals) != SSS_OK;
}

static int render_rebuild(const chart_case *c, chart_run *run, const mesh_data *moved)
{
    const bem *const b = (const bem *)run->state;
    return bem_rebuild(c, run, moved) != 0 || sss_bem_update(b->object, 0, NULL) != SSS_OK;
}

const chart_method chart_bem = {"bem", TOLERANCE_COUNT, bem_prepare, bem_relight, bem_radiosity, bem_release,
                                CHART_GUARDED, bem_predict, bem_rebuild, NULL};
const chart_method chart_bem_render = {"bem-render", TOLERANCE_COUNT, render_prepare, render_relight, bem_radiosity,
                                       bem_release, CHART_GUARDED, bem_predict, render_rebuild, NULL};
const chart_method chart_bem_solid_angle = {"bem-solid-angle", PAPER_TOLERANCE_COUNT, paper_prepare, bem_relight,
                                            bem_radiosity, bem_release, CHART_GUARDED, NULL, bem_rebuild, NULL};
