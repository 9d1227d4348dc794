#include "methods.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../sss_bem.h"
#include "services.h"

static int fail(sss_result why, const char *what, char *error_text, size_t error_size)
{
    snprintf(error_text, error_size, "%s: %s", what, sss_result_string(why));
    return -1;
}

// ---- direct: every receiver from every triangle ----

enum
{
    SAMPLE_ROWS = 64 // receivers per thread that are timed before a run
};

static const double LONG_S = 2.0; // runs that will take longer are announced

static const char *path_name(sss_dipole_path path)
{
    switch (path)
    {
    case SSS_DIPOLE_PATH_AUTO:   return "auto";
    case SSS_DIPOLE_PATH_SCALAR: return "scalar";
    case SSS_DIPOLE_PATH_TABLE:  return "table";
    case SSS_DIPOLE_PATH_AVX2:   return "avx2";
    case SSS_DIPOLE_PATH_AVX512: return "avx512";
    }
    return "unknown";
}

// Times a few receivers, spread over the mesh, and extrapolates to all. Returns seconds, 0 where nothing can be said.
static double estimate(const sss_dipole_gather *gather, const method_job *job)
{
    const size_t count = (size_t)job->threads * SAMPLE_ROWS;
    if (job->mesh.vertex_count < 4 * count)
    {
        return 0.0;
    }
    float *const positions = malloc(9 * count * sizeof *positions);
    if (!positions)
    {
        return 0.0;
    }
    float *const normals = positions + 3 * count, *const radiosity = normals + 3 * count;
    const size_t stride = job->mesh.vertex_count / count;
    for (size_t i = 0; i < count; ++i)
    {
        memcpy(positions + 3 * i, job->mesh.positions + 3 * i * stride, 3 * sizeof *positions);
        memcpy(normals + 3 * i, job->mesh.normals + 3 * i * stride, 3 * sizeof *normals);
    }
    const sss_dipole_receivers receivers = {.positions = positions, .normals = normals, .count = count};
    const double start = services_seconds();
    const sss_result result = sss_dipole_gather_run(gather, &receivers, radiosity);
    const double taken = services_seconds() - start;
    free(positions);
    return result == SSS_OK ? taken * (double)job->mesh.vertex_count / (double)count : 0.0;
}

static void announce(double seconds, const method_job *job, size_t receivers)
{
    char text[32];
    snprintf(text, sizeof text, seconds < 120.0 ? "%.0f s" : seconds < 7200.0 ? "%.0f min" : "%.1f h",
             seconds < 120.0 ? seconds : seconds < 7200.0 ? seconds / 60.0 : seconds / 3600.0);
    fprintf(stderr, "gathering %zu receivers from %zu triangles: about %s on %d thread%s\n"
            "(--method bem, with sources placed at the receivers, takes a small part of that)\n",
            receivers, job->mesh.triangle_count, text, job->threads, job->threads == 1 ? "" : "s");
}

static void report_direct(const sss_dipole_gather_stats *s, method_result *result)
{
    result->predicted_error = s->predicted_error;
    result->bytes = s->bytes;
    snprintf(result->parameters, sizeof result->parameters,
             "geometry=%s\npath=%s\ntolerance=%g\npath_tolerance=%g\none_point_mm=%g\nmean_edge_mm=%g\n"
             "emitters=%zu\ntable_entries=%zu\n",
             s->geometry == SSS_DIPOLE_PLACED ? "placed" : "distance", path_name(s->path), s->tolerance,
             s->path_tolerance, s->one_point_mm, s->mean_edge_mm, s->emitter_count, s->table_entries);
}

static int gather(sss_dipole_gather *g, services *s, const method_job *job, float *radiosity, method_result *result,
                  char *error_text, size_t error_size)
{
    const sss_dipole_receivers receivers = {.positions = job->mesh.positions, .normals = job->mesh.normals,
                                            .count = job->mesh.vertex_count};
    double start = services_seconds();
    sss_result status = sss_dipole_gather_set_irradiance(g, SSS_DIPOLE_VERTICES, job->irradiance);
    const double setting = services_seconds() - start;
    if (status != SSS_OK)
    {
        return fail(status, "irradiance", error_text, error_size);
    }
    if (job->announce)
    {
        const double expected = estimate(g, job);
        if (expected > LONG_S)
        {
            announce(expected, job, job->mesh.vertex_count);
            s->what = "gathering";
        }
    }
    start = services_seconds();
    status = sss_dipole_gather_run(g, &receivers, radiosity);
    result->frame_ms = 1e3 * (setting + services_seconds() - start);
    services_end_progress(s);
    return status == SSS_OK ? 0 : fail(status, "gather", error_text, error_size);
}

// As long for each as the vertices took.
static int gather_points(sss_dipole_gather *g, services *s, const method_job *job, method_result *result,
                         char *error_text, size_t error_size)
{
    const double expected = 1e-3 * result->frame_ms * (double)job->points.count / (double)job->mesh.vertex_count;
    if (job->announce && expected > LONG_S)
    {
        announce(expected, job, job->points.count);
        s->what = "gathering";
    }
    const double start = services_seconds();
    const sss_result status = sss_dipole_gather_run(g, &job->points, job->point_radiosity);
    result->points_ms = 1e3 * (services_seconds() - start);
    result->has_points = status == SSS_OK;
    return status == SSS_OK ? 0 : fail(status, "gather between vertices", error_text, error_size);
}

static int run_direct(const method_job *job, float *radiosity, method_result *result, char *error_text,
                      size_t error_size)
{
    services s = {.threads = job->threads};
    const sss_hooks hooks = services_hooks(&s);
    const sss_dipole_gather_options options = {.geometry = job->geometry, .tolerance = job->tolerance};
    sss_dipole_gather *g = NULL;
    const double start = services_seconds();
    const sss_result created = sss_dipole_gather_create(&job->mesh, job->profile, &options, &hooks, &g);
    result->precompute_s = services_seconds() - start;
    result->method = "direct";
    result->geometry = job->geometry;
    if (created != SSS_OK)
    {
        return fail(created, "gather", error_text, error_size);
    }
    sss_dipole_gather_stats stats;
    int status = gather(g, &s, job, radiosity, result, error_text, error_size);
    status = status == 0 && job->points.count > 0 ? gather_points(g, &s, job, result, error_text, error_size) : status;
    if (status == 0 && sss_dipole_gather_get_stats(g, &stats) == SSS_OK)
    {
        report_direct(&stats, result);
    }
    sss_dipole_gather_free(g);
    return status;
}

// ---- bem: every vertex from a hierarchy of clusters ----

enum
{
    LONG_TRIANGLES = 200000, // meshes beyond this show progress
    BUDGET = 4000000,        // form factors between two looks at the memory that links take
    MOST_LINK_BYTES = 1 << 30 // links beyond this are not made just for a report
};

static void report_bem(const sss_bem_stats *s, double relight_ms, method_result *result)
{
    static const char *const paths[] = {"auto", "portable", "avx2", "avx512"};
    result->predicted_error = s->predicted_error;
    result->guard = s->guard > 0.0 ? s->guard : 0.0;
    result->bytes = s->bytes - s->link_bytes;
    const int length = snprintf(result->parameters, sizeof result->parameters,
                                "geometry=placed\nguard=%g\npath=%s\ntolerance=%g\npath_tolerance=%g\n"
                                "clusters=%zu\ndepth=%zu\nrows=%zu\n",
                                result->guard, paths[s->path], s->tolerance, s->path_tolerance, s->cluster_count,
                                s->depth, s->row_count);
    if (relight_ms > 0.0)
    {
        snprintf(result->parameters + length, sizeof result->parameters - (size_t)length,
                 "links=%zu\nnear_links=%zu\nlink_bytes=%zu\nrelight_ms=%.3f\n", s->link_count, s->near_count,
                 s->link_bytes, relight_ms);
    }
}

// A new light where the links are kept: what render mode costs. 0 ms where they are too many.
static sss_result relight(sss_bem *bem, const method_job *job, float *radiosity, double *ms)
{
    sss_bem_stats stats = {.link_bytes = 0};
    sss_result status = SSS_OK;
    for (size_t pending = 1; pending > 0 && status == SSS_OK;)
    {
        status = sss_bem_update(bem, BUDGET, &pending);
        status = status == SSS_OK ? sss_bem_get_stats(bem, &stats) : status;
        if (stats.link_bytes > MOST_LINK_BYTES)
        {
            sss_bem_unlink(bem);
            return status;
        }
    }
    const double start = services_seconds();
    status = status == SSS_OK ? sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, job->irradiance) : status;
    status = status == SSS_OK ? sss_bem_render(bem, radiosity) : status;
    *ms = 1e3 * (services_seconds() - start);
    return status;
}

static sss_result shade_bem(sss_bem *bem, const method_job *job, float *radiosity, method_result *result)
{
    double relight_ms = 0.0;
    const double begun = services_seconds();
    sss_result status = job->keep_links ? sss_bem_update(bem, 0, NULL) : SSS_OK;
    const double start = services_seconds();
    result->precompute_s += start - begun;
    status = status == SSS_OK ? sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, job->irradiance) : status;
    status = status == SSS_OK ? (job->keep_links ? sss_bem_render : sss_bem_shade)(bem, radiosity) : status;
    result->frame_ms = 1e3 * (services_seconds() - start);
    status = status == SSS_OK ? sss_bem_predict_error(bem, 0, NULL) : status;
    if (status == SSS_OK && job->report)
    {
        status = relight(bem, job, radiosity, &relight_ms);
    }
    sss_bem_stats stats;
    status = status == SSS_OK ? sss_bem_get_stats(bem, &stats) : status;
    if (status == SSS_OK)
    {
        report_bem(&stats, relight_ms, result);
    }
    return status;
}

static int run_bem(const method_job *job, float *radiosity, method_result *result, char *error_text,
                   size_t error_size)
{
    services s = {.threads = job->threads};
    const int large = job->mesh.triangle_count > LONG_TRIANGLES;
    s.what = job->announce && large ? "gathering" : NULL;
    const sss_hooks hooks = services_hooks(&s);
    const sss_bem_options options = {.tolerance = job->tolerance, .guard = job->guard};
    sss_bem *bem = NULL;
    if (job->tolerance > 0.0 && job->tolerance < METHOD_BEM_TIGHTEST)
    {
        snprintf(error_text, error_size, "bem: a tolerance of %g is below its least, %g; --method direct has it",
                 job->tolerance, METHOD_BEM_TIGHTEST);
        return -1;
    }
    const double start = services_seconds();
    sss_result status = sss_bem_create(&job->mesh, job->profile, &options, &hooks, &bem);
    result->precompute_s = services_seconds() - start;
    result->method = job->keep_links ? "bem-render" : "bem";
    result->geometry = SSS_DIPOLE_PLACED;
    status = status == SSS_OK ? shade_bem(bem, job, radiosity, result) : status;
    if (status == SSS_OK && job->points.count > 0)
    {
        const double began = services_seconds();
        status = sss_bem_gather(bem, job->points.positions, job->points.normals, job->points.count,
                                job->point_radiosity);
        result->has_points = status == SSS_OK;
        result->points_ms = 1e3 * (services_seconds() - began);
    }
    sss_bem_free(bem);
    return status == SSS_OK ? 0 : fail(status, "bem", error_text, error_size);
}

// ---- lambert: no light travels inside ----

static int run_lambert(const method_job *job, float *radiosity, method_result *result, char *error_text,
                       size_t error_size)
{
    const double start = services_seconds();
    const sss_result status = sss_dipole_lambert(job->profile, job->irradiance, job->mesh.vertex_count, radiosity);
    result->method = "lambert";
    result->geometry = job->geometry;
    result->frame_ms = 1e3 * (services_seconds() - start);
    result->predicted_error = job->advice.lambert_error;
    return status == SSS_OK ? 0 : fail(status, "lambert", error_text, error_size);
}

// ---- the table ----

static const struct
{
    const char *name, *help;
    method_function run;
    const char *geometry; // the only one it can do; NULL: both
} methods[] = {
    {"direct", "direct   every vertex from every triangle: sss_dipole.h", run_direct, NULL},
    {"bem", "bem      every vertex from a hierarchy of clusters, geometry placed: sss_bem.h", run_bem, "placed"},
    {"hao", "hao      every vertex for some 200 lights in advance, then any light at once: sss_hao.h", method_hao,
     "distance"},
    {"lambert", "lambert  diffuse reflection only, nothing travels inside: sss_dipole.h", run_lambert, NULL},
    {"auto", "auto     the cheapest of these that meets the tolerance, as sss_dipole_needs ranks them", method_auto,
     NULL},
};

const char *method_geometry(const char *name)
{
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; ++i)
    {
        if (strcmp(name, methods[i].name) == 0)
        {
            return methods[i].geometry;
        }
    }
    return NULL;
}

method_function method_by_name(const char *name)
{
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; ++i)
    {
        if (strcmp(name, methods[i].name) == 0)
        {
            return methods[i].run;
        }
    }
    return NULL;
}

const char *method_help(size_t index)
{
    return index < sizeof methods / sizeof methods[0] ? methods[index].help : NULL;
}
