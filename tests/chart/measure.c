// Measures runs and appends one line each to a CSV file.
//   build/tests/chart/measure OUT.csv [--receivers N] [--threads N] [--runs N] [--seconds S] [--sizes mm,mm] [--quick]
// Columns, as DESIGN.md says:
//   method,mesh,vertices,triangles,size_mm,material,light,parameters,threads,precompute_s,frame_ms,bytes,rel_l2,
//   rel_max,image_rmse,reference
// rel_l2, rel_max: against the converged reference of the method's own kind (chart_reference; `reference` says which)
// at N vertices spread over the mesh, weighted by their areas.
// frame_ms: median of at least five frames. Where a frame would take longer than S seconds, a frame computes every
// k-th vertex and the part that grows with the receivers counts k times: `rows` in parameters says how many were
// computed. image_rmse: of the picture against the one from the best method of that kind, in [0,1]; empty
// where a frame takes longer than twenty times S. `predicted` in parameters is the relative L2 error that a
// method which measures itself predicts for this light.

#define _POSIX_C_SOURCE 200809L

#include "chart.h"
#include "picture.h"

#include "../../examples/common/threads.h"
#include "../common/default_guard.h"
#include "../common/reference.h"
#include "../common/test.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const chart_method *const methods[] = {&chart_lambert,       &chart_direct,        &chart_direct_points,
                                              &chart_direct_scalar, &chart_direct_placed, &chart_bem,
                                              &chart_bem_render,    &chart_bem_solid_angle};

// What each reference is, how far it is driven (its own estimate, an upper one, stays below the errors measured), and
// what draws the picture that others are compared with.
static const struct
{
    const char *name;
    reference_options options; // CHART_GUARDED: the guard is sss_bem.h's own
    const chart_method *best;
    size_t best_variant;
} references[CHART_REFERENCE_COUNT] = {
    {"", {SSS_DIPOLE_DISTANCE, SSS_DIPOLE_VERTICES, 1e-6, 0.0}, &chart_direct, 1},
    {"placed ", {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, 1e-5, 0.0}, &chart_direct_placed, 0},
    {"guarded placed ", {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, 1e-5, 0.0}, &chart_bem, 0},
};

enum
{
    METHOD_COUNT = sizeof methods / sizeof methods[0],
    SIZES_MAX = 8,
    RUNS_MAX = 64
};

typedef struct settings
{
    const char *out;
    size_t receivers;
    int threads, runs;
    double seconds; // a frame's limit
    double sizes[SIZES_MAX];
    size_t size_count, variants_max;
    double thin; // the mesh itself is decimated by this factor: only for a quick look
} settings;

typedef struct truth
{
    chart_rows rows;
    double *B;       // [count][3]
    double *weights; // [count] area, mesh units
    double error;    // relative L2 error of the reference's own estimate
    picture *best;   // NULL where there is none
} truth;

// ---- receivers ----

static int make_rows(const chart_case *c, size_t step, chart_rows *rows)
{
    const size_t count = (c->mesh.vertex_count + step - 1) / step;
    rows->count = count;
    rows->indices = (size_t *)malloc(count * sizeof *rows->indices);
    rows->positions = (float *)malloc(3 * count * sizeof *rows->positions);
    rows->normals = (float *)malloc(3 * count * sizeof *rows->normals);
    if (!rows->indices || !rows->positions || !rows->normals)
    {
        return 1;
    }
    for (size_t i = 0; i < count; ++i)
    {
        rows->indices[i] = i * step;
        memcpy(rows->positions + 3 * i, c->mesh.positions + 3 * i * step, 3 * sizeof(float));
        memcpy(rows->normals + 3 * i, c->mesh.normals + 3 * i * step, 3 * sizeof(float));
    }
    return 0;
}

static void free_rows(chart_rows *rows)
{
    free(rows->indices);
    free(rows->positions);
    free(rows->normals);
    memset(rows, 0, sizeof *rows);
}

// ---- the reference ----

static int make_truth(const chart_case *c, const settings *s, const reference_options *options, truth *t)
{
    const size_t step = c->mesh.vertex_count > s->receivers ? c->mesh.vertex_count / s->receivers : 1;
    double *areas = (double *)malloc(c->mesh.vertex_count * sizeof *areas);
    double sum = 0.0, sum_error = 0.0, *errors;
    if (!areas || make_rows(c, step, &t->rows) != 0)
    {
        free(areas);
        return 1;
    }
    t->B = (double *)malloc(3 * t->rows.count * sizeof *t->B);
    t->weights = (double *)malloc(t->rows.count * sizeof *t->weights);
    errors = (double *)malloc(3 * t->rows.count * sizeof *errors);
    const int failed = !t->B || !t->weights || !errors ||
                       reference_radiosity_many(&c->view, &c->profile, c->irradiance, options, t->rows.positions,
                                                t->rows.normals, NULL, t->rows.count, threads_available(), t->B,
                                                errors) != 0;
    if (!failed)
    {
        mesh_vertex_areas(&c->mesh, areas);
        for (size_t i = 0; i < 3 * t->rows.count; ++i)
        {
            const double weight = t->weights[i / 3] = areas[t->rows.indices[i / 3]];
            sum += weight * t->B[i] * t->B[i];
            sum_error += weight * errors[i] * errors[i];
        }
        t->error = sqrt(sum_error / sum);
    }
    free(areas);
    free(errors);
    return failed;
}

static void free_truth(truth *t)
{
    picture_free(t->best);
    free_rows(&t->rows);
    free(t->B);
    free(t->weights);
}

// DESIGN.md: area-weighted L2 norm of B - B_ref over that of B_ref; largest difference over the largest B_ref.
static void compare(const truth *t, const float *B, double *rel_l2, double *rel_max)
{
    double sum = 0.0, sum_difference = 0.0, largest = 0.0, largest_difference = 0.0;
    for (size_t i = 0; i < 3 * t->rows.count; ++i)
    {
        const double difference = (double)B[i] - t->B[i];
        sum += t->weights[i / 3] * t->B[i] * t->B[i];
        sum_difference += t->weights[i / 3] * difference * difference;
        largest = fmax(largest, fabs(t->B[i]));
        largest_difference = fmax(largest_difference, fabs(difference));
    }
    *rel_l2 = sqrt(sum_difference / sum);
    *rel_max = largest_difference / largest;
}

// ---- one run ----

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// One frame of every step-th vertex, in seconds as if it were all of them; negative on failure.
static double one_frame(const chart_method *method, const chart_case *c, chart_run *run, const chart_rows *rows,
                        float *B)
{
    const double start = test_seconds();
    if (method->relight(c, run) != 0)
    {
        return -1.0;
    }
    const double lit = test_seconds();
    if (method->radiosity(c, run, rows, B) != 0)
    {
        return -1.0;
    }
    const double share = (double)rows->count / (double)c->mesh.vertex_count;
    return lit - start + (test_seconds() - lit) / share;
}

static double median_frame(const chart_method *method, const chart_case *c, const settings *s, chart_run *run)
{
    double seconds[RUNS_MAX], guess;
    chart_rows rows = {0};
    float *const B = (float *)malloc(3 * c->mesh.vertex_count * sizeof *B);
    size_t step = c->mesh.vertex_count / 256 + 1; // first a guess from a few rows
    if (!B || make_rows(c, step, &rows) != 0)
    {
        free(B);
        free_rows(&rows);
        return -1.0;
    }
    guess = one_frame(method, c, run, &rows, B);
    free_rows(&rows);
    step = guess > s->seconds ? (size_t)ceil(guess / s->seconds) : 1;
    int failed = guess < 0.0 || make_rows(c, step, &rows) != 0;
    for (int i = 0; i < s->runs && !failed; ++i)
    {
        seconds[i] = one_frame(method, c, run, &rows, B);
        failed = seconds[i] < 0.0;
    }
    if (!failed)
    {
        const size_t length = strlen(run->parameters);
        snprintf(run->parameters + length, sizeof run->parameters - length, ";rows=%zu", rows.count);
        qsort(seconds, (size_t)s->runs, sizeof *seconds, by_value);
    }
    free(B);
    free_rows(&rows);
    return failed ? -1.0 : seconds[s->runs / 2];
}

// What is measured of a run.
typedef struct numbers
{
    double precompute_s, frame_s, rel_l2, rel_max;
    double image_rmse; // negative: no picture was compared
} numbers;

static int append(const settings *s, const chart_case *c, const chart_method *method, const chart_run *run,
                  const numbers *n, double reference_error)
{
    char image[32] = "";
    FILE *const file = fopen(s->out, "a");
    if (!file)
    {
        perror(s->out);
        return 1;
    }
    if (n->image_rmse >= 0.0)
    {
        snprintf(image, sizeof image, "%.3e", n->image_rmse);
    }
    fprintf(file,
            "%s,%s,%zu,%zu,%g,%s,%s,%s,%d,%.4g,%.5g,%zu,%.3e,%.3e,%s,%squadrature to %.1e at %zu vertices\n",
            method->name, c->mesh_name, c->mesh.vertex_count, c->mesh.triangle_count, c->size_mm, c->material_name,
            c->light_name, run->parameters, run->threads, n->precompute_s, 1e3 * n->frame_s, run->bytes, n->rel_l2,
            n->rel_max, image, references[method->reference].name, reference_error, s->receivers);
    return fclose(file) != 0;
}

// Every vertex, on all processors: for pictures, not for times.
static float *all_vertices(const chart_method *method, const chart_case *c, chart_run *run)
{
    chart_rows rows = {0};
    float *B = (float *)malloc(3 * c->mesh.vertex_count * sizeof *B);
    int *const threads = (int *)run->hooks->user, kept = *threads;
    *threads = threads_available();
    if (!B || make_rows(c, 1, &rows) != 0 || method->relight(c, run) != 0 ||
        method->radiosity(c, run, &rows, B) != 0)
    {
        free(B);
        B = NULL;
    }
    *threads = kept;
    free_rows(&rows);
    return B;
}

static double compare_pictures(const chart_method *method, const chart_case *c, chart_run *run, picture *best)
{
    float *const B = all_vertices(method, c, run);
    const double rmse = B ? picture_rmse(best, B) : -1.0;
    free(B);
    return rmse;
}

static int make_best_picture(const chart_case *c, const sss_hooks *hooks, chart_reference reference, truth *t)
{
    const chart_method *const method = references[reference].best;
    const size_t variant = references[reference].best_variant;
    chart_run run;
    memset(&run, 0, sizeof run);
    run.hooks = hooks;
    float *const B = method->prepare(c, variant, &run) == 0 ? all_vertices(method, c, &run) : NULL;
    t->best = B ? picture_create(c, B) : NULL;
    method->release(&run);
    free(B);
    return t->best == NULL;
}

static int predict(const chart_method *method, chart_run *run)
{
    const size_t length = strlen(run->parameters);
    if (!method->predict)
    {
        return 0;
    }
    if (method->predict(run) != 0)
    {
        return 1;
    }
    snprintf(run->parameters + length, sizeof run->parameters - length, ";predicted=%.1e", run->error_bound);
    return 0;
}

static int measure(const chart_method *method, size_t variant, const chart_case *c, const truth *t, const settings *s,
                   const sss_hooks *hooks)
{
    chart_run run;
    numbers n = {0.0, 0.0, 0.0, 0.0, -1.0};
    float *const B = (float *)malloc(3 * t->rows.count * sizeof *B);
    memset(&run, 0, sizeof run);
    run.threads = s->threads;
    run.hooks = hooks;
    const double start = test_seconds();
    const int prepared = B ? method->prepare(c, variant, &run) : 1;
    n.precompute_s = test_seconds() - start;
    if (prepared == CHART_LEFT_OUT)
    {
        free(B);
        return 0;
    }
    int failed = prepared != 0;
    failed = failed || method->relight(c, &run) != 0 || method->radiosity(c, &run, &t->rows, B) != 0;
    if (!failed)
    {
        compare(t, B, &n.rel_l2, &n.rel_max);
        n.frame_s = median_frame(method, c, s, &run);
        const int best = method == references[method->reference].best &&
                         variant == references[method->reference].best_variant;
        if (n.frame_s <= 20.0 * s->seconds && !best)
        {
            n.image_rmse = compare_pictures(method, c, &run, t->best);
        }
        failed = n.frame_s < 0.0 || predict(method, &run) != 0 || append(s, c, method, &run, &n, t->error) != 0;
    }
    printf("%-15s %-8s %4g mm  %-70s %10.4g ms  rel_l2 %.2e  rel_max %.2e  image %.1e  predicted %.1e%s\n",
           method->name, c->material_name, c->size_mm, run.parameters, 1e3 * n.frame_s, n.rel_l2, n.rel_max,
           n.image_rmse, run.error_bound, failed ? "  FAILED" : "");
    fflush(stdout);
    method->release(&run);
    free(B);
    return failed;
}

// ---- cases ----

// The reference and the best picture of every kind.
static int make_truths(const chart_case *c, const settings *s, const sss_hooks *hooks, truth *truths)
{
    for (int r = 0; r < CHART_REFERENCE_COUNT; ++r)
    {
        reference_options options = references[r].options;
        options.guard = r == CHART_GUARDED ? default_guard() : 0.0;
        if (make_truth(c, s, &options, &truths[r]) != 0 ||
            make_best_picture(c, hooks, (chart_reference)r, &truths[r]) != 0)
        {
            return 1;
        }
    }
    return 0;
}

static int measure_case(const chart_entry *entry, const settings *s, const sss_hooks *hooks)
{
    chart_case c;
    truth truths[CHART_REFERENCE_COUNT];
    const double start = test_seconds();
    memset(truths, 0, sizeof truths);
    int failed = chart_case_create(entry, s->thin, &c) != 0 || make_truths(&c, s, hooks, truths) != 0;
    printf("%s: references to %.1e, placed %.1e, guarded %.1e; %.0f s%s\n", c.name, truths[CHART_DISTANCE].error, truths[CHART_PLACED].error, truths[CHART_GUARDED].error,
           test_seconds() - start, failed ? " FAILED" : "");
    for (size_t m = 0; m < METHOD_COUNT && !failed; ++m)
    {
        for (size_t v = 0; v < methods[m]->variant_count && v < s->variants_max && !failed; ++v)
        {
            failed = measure(methods[m], v, &c, &truths[methods[m]->reference], s, hooks);
        }
    }
    for (int r = 0; r < CHART_REFERENCE_COUNT; ++r)
    {
        free_truth(&truths[r]);
    }
    chart_case_free(&c);
    return failed;
}

// ---- the command ----

static int usage(const char *program)
{
    fprintf(stderr,
            "usage: %s OUT.csv [--receivers N] [--threads N] [--runs N] [--seconds S] [--sizes mm,mm] [--quick]\n",
            program);
    return 2;
}

static int read_sizes(const char *text, settings *s)
{
    char *end;
    for (s->size_count = 0; s->size_count < SIZES_MAX; text = end + 1)
    {
        const double size = strtod(text, &end);
        if (end == text || !(size > 0.0) || !isfinite(size))
        {
            return 1;
        }
        s->sizes[s->size_count++] = size;
        if (*end != ',')
        {
            return *end != '\0';
        }
    }
    return 1;
}

static int read_arguments(int argc, char **argv, settings *s)
{
    if (argc < 2)
    {
        return 1;
    }
    s->out = argv[1];
    for (int i = 2; i < argc; ++i)
    {
        const char *const value = i + 1 < argc ? argv[i + 1] : "";
        if (strcmp(argv[i], "--quick") == 0)
        {
            s->thin = 40.0;
            s->variants_max = 2;
            s->receivers = 40;
            s->size_count = 1;
            s->sizes[0] = 50.0;
            continue;
        }
        if (strcmp(argv[i], "--receivers") == 0) s->receivers = (size_t)strtoul(value, NULL, 10);
        else if (strcmp(argv[i], "--threads") == 0) s->threads = atoi(value);
        else if (strcmp(argv[i], "--runs") == 0) s->runs = atoi(value);
        else if (strcmp(argv[i], "--seconds") == 0) s->seconds = atof(value);
        else if (strcmp(argv[i], "--sizes") != 0 || read_sizes(value, s) != 0) return 1;
        ++i;
    }
    return s->receivers < 1 || s->threads < 1 || s->runs < 5 || s->runs > RUNS_MAX || !(s->seconds > 0.0);
}

static void on_threads(void *user, size_t count, void (*task)(void *context, size_t begin, size_t end), void *context)
{
    threads_parallel_for(*(const int *)user, count, task, context);
}

int main(int argc, char **argv)
{
    settings s = {NULL, 100, 1, 5, 0.1, {10.0, 50.0, 200.0}, 3, SIZE_MAX, 1.0};
    sss_hooks hooks;
    if (read_arguments(argc, argv, &s) != 0)
    {
        return usage(argv[0]);
    }
    memset(&hooks, 0, sizeof hooks);
    hooks.user = &s.threads;
    hooks.parallel_for = on_threads;
    int failed = 0;
    for (size_t i = 0; i < chart_entry_count() && !failed; ++i)
    {
        failed = measure_case(chart_entry_at(i), &s, &hooks);
    }
    return failed;
}
