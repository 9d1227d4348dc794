#define _POSIX_C_SOURCE 200809L // getpid

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../../sss_hao.h"
#include "methods.h"
#include "services.h"
#include "shadow.h"
#include "threads.h"

enum
{
    LONG_VERTICES = 20000,                     // meshes beyond this show progress
    MOST_LIGHTS = LIGHTS_MAX * LIGHTS_SAMPLES,
    REPEATS = 5,                               // relighting is timed so often for a report
    PATH_SIZE = 4096
};

static const double PI = 3.14159265358979323846;
static const double COARSEST = 0.1, TIGHTEST = 1e-5; // tolerance, see sss_hao_options

static const struct
{
    const char *name;
    sss_hao_storage storage;
} storages[] = {{"references", SSS_HAO_REFERENCES}, {"harmonics", SSS_HAO_HARMONICS}, {"table", SSS_HAO_TABLE},
                {"float", SSS_HAO_FLOAT}, {"vectors", SSS_HAO_VECTORS}};

// One run.
typedef struct run
{
    const method_job *job;
    services services;
    sss_hooks hooks;
    sss_hao_options options;
    shadow *shadow;        // rays for what vertices see; NULL without shadows
    sss_hao *hao;
    sss_hao_light *lights; // [light_count]
    size_t light_count;
    int cached, vectors;   // cached: read from the file
    float *lighting, *references, *radiosity;
    char *error_text;
    size_t error_size;
} run;

static int check(const run *r, const char *what, sss_result result)
{
    snprintf(r->error_text, r->error_size, "hao: %s: %s", what, sss_result_string(result));
    return result == SSS_OK ? 0 : -1;
}

const char *method_hao_storage_name(int storage)
{
    const char *name = "";
    for (size_t i = 0; i < sizeof storages / sizeof storages[0]; ++i)
    {
        name = storage == (int)storages[i].storage ? storages[i].name : name;
    }
    return name;
}

int method_hao_storage(const char *name)
{
    for (size_t i = 0; i < sizeof storages / sizeof storages[0]; ++i)
    {
        if (strcmp(name, storages[i].name) == 0)
        {
            return 1;
        }
    }
    return 0;
}

// ---- what is asked for ----

// The shadows that the other methods have, by casting rays, so that only the method differs.
static int see(void *user, const double light[3], double distance, float *visible)
{
    (void)distance; // all lights are far away
    shadow_visibility(user, light, visible);
    return 0;
}

static int take_options(run *r)
{
    const method_job *const job = r->job;
    const char *const storage = job->hao.storage ? job->hao.storage : "references";
    for (size_t i = 0; i < sizeof storages / sizeof storages[0]; ++i)
    {
        r->options.storage = strcmp(storage, storages[i].name) == 0 ? storages[i].storage : r->options.storage;
    }
    r->options.tolerance = job->tolerance;
    r->options.directions = job->hao.directions;
    r->options.reference_count = job->hao.references;
    r->options.order = job->hao.order;
    r->options.no_shadows = job->lights && job->lights->no_shadows;
    r->vectors = r->options.storage == SSS_HAO_VECTORS;
    const double *const ambient = job->lights ? job->lights->ambient : NULL;
    if (!job->lights)
    {
        snprintf(r->error_text, r->error_size, "hao: a file of irradiance does not say where its light comes from; "
                 "give --light or --ambient, or take --method direct");
        return -1;
    }
    if (job->tolerance > 0.0 && (job->tolerance < TIGHTEST || job->tolerance > COARSEST))
    {
        snprintf(r->error_text, r->error_size, "hao: a tolerance of %g is not between %g and %g", job->tolerance,
                 TIGHTEST, COARSEST);
        return -1;
    }
    if (r->vectors && (ambient[0] > 0.0 || ambient[1] > 0.0 || ambient[2] > 0.0))
    {
        snprintf(r->error_text, r->error_size, "hao: vectors are interpolated for one light after the other, so there "
                 "can be no --ambient; take another --storage");
        return -1;
    }
    return 0;
}

static int take_lights(run *r)
{
    double (*const direction)[3] = malloc(2 * MOST_LIGHTS * sizeof *direction);
    r->lights = calloc(MOST_LIGHTS, sizeof *r->lights);
    if (!direction || !r->lights)
    {
        free(direction);
        return check(r, "lights", SSS_ERROR_OUT_OF_MEMORY);
    }
    double (*const color)[3] = direction + MOST_LIGHTS;
    r->light_count = lights_directions(r->job->lights, direction, color);
    for (size_t i = 0; i < r->light_count; ++i)
    {
        memcpy(r->lights[i].direction, direction[i], sizeof direction[i]);
        memcpy(r->lights[i].color, color[i], sizeof color[i]);
    }
    free(direction);
    return 0;
}

// ---- integrals, computed or from a file ----

static int write_bytes(void *user, const void *bytes, size_t count)
{
    return fwrite(bytes, 1, count, user) != count;
}

static int read_bytes(void *user, void *bytes, size_t count)
{
    return fread(bytes, 1, count, user) != count;
}

// Returns 0 with r->hao NULL where there is nothing to be read; -1 where the file is something else, which is kept.
static int read_cache(run *r, uint64_t hash)
{
    const char *const path = r->job->hao.cache;
    FILE *const file = path ? fopen(path, "rb") : NULL;
    if (!file)
    {
        return 0;
    }
    const sss_result result = sss_hao_load(hash, read_bytes, file, &r->hooks, &r->hao);
    fclose(file);
    r->cached = result == SSS_OK;
    if (result == SSS_ERROR_BAD_DATA)
    {
        snprintf(r->error_text, r->error_size, "%s is no cache of sss_hao.h, or a damaged one: remove it, or give "
                 "another name", path);
        return -1;
    }
    if (result == SSS_ERROR_MISMATCH || result == SSS_ERROR_BAD_VERSION)
    {
        fprintf(stderr, "%s is of another mesh, size, material, option or version: it is made anew\n", path);
        return 0;
    }
    return check(r, path, result);
}

// To another name first, so that a run that is interrupted leaves no half of it.
static int write_cache(const run *r)
{
    const char *const path = r->job->hao.cache;
    char temporary[PATH_SIZE];
    if (!path || r->cached)
    {
        return 0;
    }
    snprintf(temporary, sizeof temporary, "%s.part%ld", path, (long)getpid());
    FILE *const file = strlen(path) < sizeof temporary - 32 ? fopen(temporary, "wb") : NULL;
    const sss_result result = file ? sss_hao_save(r->hao, write_bytes, file) : SSS_OK;
    const int closed = file ? fclose(file) : -1;
    if (!file || result != SSS_OK || closed != 0 || rename(temporary, path) != 0)
    {
        snprintf(r->error_text, r->error_size, "cannot write the cache %s: %s", path, strerror(errno));
        remove(temporary);
        return -1;
    }
    return 0;
}

static int compute(run *r)
{
    const method_job *const job = r->job;
    if (!r->options.no_shadows)
    {
        r->shadow = shadow_create(job->model, job->threads, r->error_text, r->error_size);
        if (!r->shadow)
        {
            return -1;
        }
    }
    r->options.visibility_user = r->shadow;
    const int large = job->mesh.vertex_count > LONG_VERTICES;
    r->services.what = job->announce && large ? "precomputing" : NULL;
    const sss_result result = sss_hao_create(&job->mesh, job->profile, &r->options, &r->hooks, &r->hao);
    services_end_progress(&r->services);
    r->services.what = NULL;
    return check(r, "precomputing", result);
}

static int prepare(run *r, method_result *result)
{
    uint64_t hash = 0;
    r->options.visibility = r->options.no_shadows ? NULL : see; // part of what the hash names
    const double start = services_seconds();
    int status = 0;
    if (r->job->hao.cache)
    {
        status = check(r, "options", sss_hao_hash(&r->job->mesh, r->job->profile, &r->options, &hash));
        status = status ? status : read_cache(r, hash);
    }
    if (status == 0 && !r->hao)
    {
        status = compute(r);
    }
    result->precompute_s = services_seconds() - start;
    return status ? status : write_cache(r);
}

// ---- light ----

static void relight_rows(void *context, size_t begin, size_t end)
{
    const run *const r = context;
    sss_hao_relight_rows(r->hao, r->lighting, r->references, begin, end, r->radiosity);
}

// All lights and the surroundings in one: what they come to for the lights of the set, then for the vertices.
static sss_result relight(run *r, const sss_hao_stats *stats)
{
    const double *const ambient = r->job->lights->ambient;
    double sh[9][3] = {{0.0}};
    for (int k = 0; k < 3; ++k)
    {
        sh[0][k] = ambient[k] / PI * 2.0 * sqrt(PI); // radiance E/pi everywhere; Y_00 = 1/(2 sqrt(pi))
    }
    if (r->vectors)
    {
        return sss_hao_relight(r->hao, r->lights, r->light_count, r->radiosity);
    }
    memset(r->lighting, 0, 3 * stats->lighting_count * sizeof *r->lighting);
    sss_result result = sss_hao_add_lights(r->hao, r->lights, r->light_count, r->lighting);
    result = result == SSS_OK ? sss_hao_add_environment(r->hao, (const double (*)[3])sh, r->lighting) : result;
    if (result == SSS_OK && r->references)
    {
        result = sss_hao_relight_references(r->hao, r->lighting, r->references);
    }
    if (result == SSS_OK)
    {
        threads_parallel_for(r->job->threads, r->job->mesh.vertex_count, relight_rows, r);
    }
    return result;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void report(const run *r, const sss_hao_stats *s, double relight_ms, method_result *result)
{
    static const char *const quadratures[] = {"triangles", "vertices", "other vertices"};
    static const char *const weights[] = {"fitted", "barycentric"};
    const int length = snprintf(result->parameters, sizeof result->parameters,
             "geometry=distance\nstorage=%s\nweights=%s\nquadrature=%s\ntolerance=%g\nrange_mm=%g\ndirections=%zu\n"
             "reference_points=%zu\nreference_triangles=%zu\norder=%zu\nbytes_per_vertex=%.2f\nbytes_vertices=%zu\n"
             "bytes_references=%zu\nbytes_tables=%zu\npeak_bytes=%zu\n",
             method_hao_storage_name(s->storage), weights[s->weights], quadratures[s->quadrature], s->tolerance,
             s->range, s->directions, s->reference_count, s->reference_triangle_count, s->order, s->bytes_per_vertex,
             s->bytes_vertices, s->bytes_references, s->bytes_tables, s->peak_bytes);
    snprintf(result->parameters + length, sizeof result->parameters - (size_t)length,
             "sum_error=%.3g\ninterpolation_error=%.3g\nstorage_error=%.3g\nsnr_db=%.2f\ntruncated_energy=%.3g\n"
             "truncated_worst=%.3g\ninside_out=%d\ninteractions=%.0f\nlights_summed=%zu\nrelight_ms=%.3f\ncache=%s\n",
             s->sum_error, s->interpolation_error, s->storage_error, s->snr_db, s->truncated_energy,
             s->truncated_worst, s->inside_out, s->mean_interactions, r->light_count, relight_ms,
             !r->job->hao.cache ? "none" : r->cached ? "read" : "written");
    result->predicted_error = s->predicted_error;
    result->bytes = s->bytes;
}

// The first time is the frame's; a report also has the median of some more.
static int shine(run *r, method_result *result)
{
    double ms[REPEATS] = {0.0};
    sss_hao_stats stats;
    int status = check(r, "statistics", sss_hao_get_stats(r->hao, &stats));
    if (status != 0)
    {
        return status;
    }
    r->lighting = malloc(3 * stats.lighting_count * sizeof *r->lighting);
    r->references = stats.reference_count > 0 ? malloc(4 * stats.reference_count * sizeof *r->references) : NULL;
    if (!r->lighting || (stats.reference_count > 0 && !r->references))
    {
        return check(r, "light", SSS_ERROR_OUT_OF_MEMORY);
    }
    for (int i = 0; i <= (r->job->report ? REPEATS : 0) && status == 0; ++i)
    {
        const double start = services_seconds();
        status = check(r, "light", relight(r, &stats));
        const double taken = 1e3 * (services_seconds() - start);
        result->frame_ms = i == 0 ? taken : result->frame_ms;
        ms[i > 0 ? i - 1 : 0] = taken;
    }
    qsort(ms, REPEATS, sizeof ms[0], ascending);
    report(r, &stats, ms[REPEATS / 2], result);
    return status;
}

int method_hao(const method_job *job, float *radiosity, method_result *result, char *error_text, size_t error_size)
{
    run r = {.job = job, .services = {.threads = job->threads}, .radiosity = radiosity, .error_text = error_text,
             .error_size = error_size};
    r.hooks = services_hooks(&r.services);
    result->method = "hao";
    result->geometry = SSS_DIPOLE_DISTANCE;
    int status = take_options(&r);
    status = status ? status : take_lights(&r);
    status = status ? status : prepare(&r, result);
    status = status ? status : shine(&r, result);
    sss_hao_free(r.hao);
    shadow_free(r.shadow);
    free(r.lights);
    free(r.lighting);
    free(r.references);
    return status;
}
