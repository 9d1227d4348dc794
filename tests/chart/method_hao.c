// Precomputed integrals. R_d is of the distance only; lights see everything, as in all cases. Two knobs: how many
// directions there are, between which a light is interpolated, and how they are kept: compressed with reference points
// (the default), a byte for each direction, or a float, which the other two are made from. That is done once for all
// three; its time counts for each.
// A light behind a screen is not one that these integrals know: `edge` is left out.

#include "../../sss_hao.h"
#include "../common/test.h"
#include "chart.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum
{
    SETS = 3,
    STORAGES = 3,
    FLOATS = 2, // which of these the others are made from
    FLOATS_MAX = 1 << 27 // 512 MiB: what one set of directions may take
};

static const size_t directions[SETS] = {1026, 402, 198};

static const struct
{
    sss_hao_storage storage;
    const char *name;
} storages[STORAGES] = {{SSS_HAO_REFERENCES, "references"}, {SSS_HAO_TABLE, "table"}, {SSS_HAO_FLOAT, "float"}};

// The integrals of a case; NULL where there are none yet. What is measured once more is not made once more, which
// takes longer than all the rest.
typedef struct integrals
{
    sss_hao *of[SETS][STORAGES];
    double seconds[SETS][STORAGES]; // that they took, from nothing
} integrals;

typedef struct hao
{
    sss_hao *object;  // among the integrals
    sss_hao_stats stats;
    float *lighting;  // [lighting_count][3]
    float *radiosity; // [V][3]
} hao;

static void hao_forget(void *shared)
{
    integrals *const all = (integrals *)shared;
    for (int i = 0; i < SETS * STORAGES; ++i)
    {
        sss_hao_free(all->of[i / STORAGES][i % STORAGES]);
    }
    free(all);
}

static void hao_release(chart_run *run)
{
    hao *const h = (hao *)run->state;
    if (h)
    {
        free(h->lighting);
        free(h->radiosity);
        free(h);
    }
    run->state = NULL;
}

// The floats that the other storages are made from, or the others from them.
static sss_result create(const chart_case *c, size_t set, size_t storage, integrals *all, const sss_hooks *hooks)
{
    sss_hao_options options;
    memset(&options, 0, sizeof options);
    options.storage = storages[storage].storage;
    options.directions = directions[set];
    options.no_shadows = 1;
    return storage == FLOATS ? sss_hao_create(&c->view, &c->profile, &options, hooks, &all->of[set][storage])
                             : sss_hao_compress(all->of[set][FLOATS], &c->view, &options, hooks,
                                                &all->of[set][storage]);
}

// One of the case's objects, made where it is not there yet; run->shared_s is what the time of this call lacks of the
// time from nothing. NULL on failure.
static sss_hao *object_of(const chart_case *c, size_t set, size_t storage, chart_run *run)
{
    integrals *const all = *run->shared ? (integrals *)*run->shared : (integrals *)calloc(1, sizeof *all);
    *run->shared = all;
    if (!all || all->of[set][storage])
    {
        run->shared_s = all ? all->seconds[set][storage] : 0.0;
        return all ? all->of[set][storage] : NULL;
    }
    if (storage != FLOATS && !object_of(c, set, FLOATS, run))
    {
        return NULL;
    }
    const double start = test_seconds();
    if (create(c, set, storage, all, run->hooks) != SSS_OK)
    {
        return NULL;
    }
    all->seconds[set][storage] = test_seconds() - start + (storage == FLOATS ? 0.0 : all->seconds[set][FLOATS]);
    return all->of[set][storage];
}

static int hao_prepare(const chart_case *c, size_t variant, chart_run *run)
{
    const size_t set = variant / STORAGES, storage = variant % STORAGES;
    if (c->edge || 3 * directions[set] * c->mesh.vertex_count > FLOATS_MAX)
    {
        return CHART_LEFT_OUT;
    }
    hao *const h = (hao *)calloc(1, sizeof *h);
    run->state = h;
    if (!h)
    {
        return 1;
    }
    h->object = object_of(c, set, storage, run);
    if (!h->object || sss_hao_get_stats(h->object, &h->stats) != SSS_OK)
    {
        return 1;
    }
    h->radiosity = (float *)malloc(3 * c->mesh.vertex_count * sizeof(float));
    h->lighting = (float *)malloc(3 * h->stats.lighting_count * sizeof(float));
    run->bytes = h->stats.bytes;
    snprintf(run->parameters, sizeof run->parameters,
             "emitters=%zu;tolerance=%.0e;storage=%s;directions=%zu;references=%zu;order=%zu;bytes_per_vertex=%.1f",
             h->stats.triangle_count, h->stats.tolerance, storages[storage].name, h->stats.directions,
             h->stats.reference_count, h->stats.order, h->stats.bytes_per_vertex);
    return !h->radiosity || !h->lighting;
}

static int add_light(const hao *h, const sss_dipole_light *light)
{
    sss_hao_light distant;
    if (light->kind == SSS_DIPOLE_LIGHT_ENVIRONMENT)
    {
        return sss_hao_add_environment(h->object, (const double (*)[3])light->sh, h->lighting) != SSS_OK;
    }
    memset(&distant, 0, sizeof distant);
    memcpy(distant.direction, light->direction, sizeof distant.direction);
    memcpy(distant.color, light->color, sizeof distant.color);
    return light->kind != SSS_DIPOLE_LIGHT_DIRECTIONAL ||
           sss_hao_add_lights(h->object, &distant, 1, h->lighting) != SSS_OK;
}

// Every vertex at once, however few are asked for.
static int hao_relight(const chart_case *c, chart_run *run)
{
    hao *const h = (hao *)run->state;
    memset(h->lighting, 0, 3 * h->stats.lighting_count * sizeof *h->lighting);
    for (size_t i = 0; i < c->light_count; ++i)
    {
        if (add_light(h, &c->lights[i]) != 0)
        {
            return 1;
        }
    }
    return sss_hao_relight_lighting(h->object, h->lighting, h->radiosity) != SSS_OK;
}

static int hao_radiosity(const chart_case *c, chart_run *run, const chart_rows *rows, float *radiosity)
{
    const hao *const h = (const hao *)run->state;
    (void)c;
    for (size_t i = 0; i < rows->count; ++i)
    {
        memcpy(radiosity + 3 * i, h->radiosity + 3 * rows->indices[i], 3 * sizeof(float));
    }
    return 0;
}

static int hao_predict(chart_run *run)
{
    const hao *const h = (const hao *)run->state;
    run->error_bound = h->stats.predicted_error;
    return 0;
}

const chart_method chart_hao = {"hao", SETS * STORAGES, hao_prepare, hao_relight, hao_radiosity, hao_release,
                                CHART_DISTANCE, hao_predict, NULL, hao_forget};
