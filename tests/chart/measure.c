// Measures the runs of a case. Columns of chart.csv, as DESIGN.md says, and five more at the end:
//   method,mesh,vertices,triangles,size_mm,material,light,parameters,threads,precompute_s,frame_ms,bytes,rel_l2,
//   rel_max,image_rmse,reference,rebuild_ms,frame_low_ms,frame_high_ms,model_l2,model_noise
// rel_l2, rel_max: the method's error, against the converged reference of its own kind (`reference` says which) at N
// vertices spread over the mesh, weighted by their areas.
// frame_ms: what must be done again when the light changes; median of at least five frames. Where a frame would take
// longer than S seconds, a frame computes every k-th vertex and the part that grows with the receivers counts k times:
// `rows` in parameters says how many were computed. frame_low_ms, frame_high_ms: the quickest and the slowest of them;
// what is on the Pareto front is prepared and timed again after all others, and all its frames count.
// rebuild_ms: what must be done besides when the vertices have moved.
// image_rmse: of the picture against the one from the best method of that kind, in [0,1]; empty where a frame takes
// longer than twenty times S. `predicted` in parameters is the relative L2 error that a method which measures itself
// predicts for this light.
// model_l2: the error of this kind of dipole itself, converged, against a volumetric random walk, relative L2 over
// patches of the surface with the variance of the walk taken out; model_noise: its standard error. Empty where no walk
// was made (tests/chart/truth). The same for all methods of a kind, and never mixed with rel_l2.

#define _POSIX_C_SOURCE 200809L

#include "chart.h"
#include "picture.h"

#include "../../examples/common/threads.h"
#include "../common/test.h"

#include <fnmatch.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

const char chart_columns[] =
    "method,mesh,vertices,triangles,size_mm,material,light,parameters,threads,precompute_s,frame_ms,bytes,rel_l2,"
    "rel_max,image_rmse,reference,rebuild_ms,frame_low_ms,frame_high_ms,model_l2,model_noise";

static const chart_method *const methods[] = {&chart_lambert,       &chart_direct,        &chart_direct_points,
                                              &chart_direct_scalar, &chart_direct_placed, &chart_bem,
                                              &chart_bem_render,    &chart_bem_solid_angle, &chart_hao};

// What draws the picture that others are compared with, and stands for the converged dipole at all vertices.
static const struct
{
    const chart_method *method;
    size_t variant;
} best[CHART_REFERENCE_COUNT] = {{&chart_direct, 1}, {&chart_direct_placed, 0}, {&chart_bem, 0}};

enum
{
    METHOD_COUNT = sizeof methods / sizeof methods[0],
    FRAMES_MAX = 256,
    PLACED_MAX = 50000, // vertices beyond which a direct gather at all of them takes too long with placed sources
    LINES_MAX = 128
};

const chart_method *chart_method_at(size_t index)
{
    return index < METHOD_COUNT ? methods[index] : NULL;
}

chart_settings chart_defaults(void)
{
    const chart_settings s = {100, 1, 5, 2, 0.1, SIZE_MAX, NULL, NULL};
    return s;
}

// One line of the file.
typedef struct line
{
    const chart_method *method;
    size_t variant, bytes, frame_count;
    char parameters[sizeof((chart_run *)0)->parameters];
    double frames[FRAMES_MAX]; // seconds
    double precompute_s, rebuild_s, rel_l2, rel_max, predicted;
    double image_rmse;         // negative: no picture was compared
} line;

// All that is at hand while a case is measured.
typedef struct bench
{
    const chart_case *c;
    const chart_settings *s;
    sss_hooks hooks;
    int threads;                // of the hooks
    mesh_data moved;            // the case's mesh, bent a little
    chart_truth truths[CHART_REFERENCE_COUNT];
    int wanted[CHART_REFERENCE_COUNT];
    void *shared[METHOD_COUNT];
    line *lines;
    size_t line_count;
} bench;

// ---- frames ----

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

// Adds a round of frames to the line. Returns how many vertices a frame computed; 0 on failure.
static size_t time_frames(const bench *b, chart_run *run, line *l)
{
    const chart_case *const c = b->c;
    chart_rows rows = {0};
    float *const B = (float *)malloc(3 * c->mesh.vertex_count * sizeof *B);
    const size_t few = c->mesh.vertex_count / 256 + 1; // first a guess from a few rows
    int failed = !B || chart_rows_create(c, few, &rows) != 0;
    const double guess = failed ? -1.0 : one_frame(l->method, c, run, &rows, B);
    const size_t step = guess > b->s->seconds ? (size_t)ceil(guess / b->s->seconds) : 1;
    chart_rows_free(&rows);
    failed = guess < 0.0 || chart_rows_create(c, step, &rows) != 0;
    for (int i = 0; i < b->s->runs && !failed && l->frame_count < FRAMES_MAX; ++i)
    {
        const double seconds = one_frame(l->method, c, run, &rows, B);
        failed = seconds < 0.0;
        l->frames[l->frame_count++] = seconds;
    }
    const size_t count = failed ? 0 : rows.count;
    free(B);
    chart_rows_free(&rows);
    return count;
}

static double frame_of(const line *l)
{
    double sorted[FRAMES_MAX];
    memcpy(sorted, l->frames, l->frame_count * sizeof *sorted);
    qsort(sorted, l->frame_count, sizeof *sorted, by_value);
    return sorted[l->frame_count / 2];
}

// ---- all vertices, on all processors: for pictures and for the model's error, not for times ----

static float *all_vertices(bench *b, const chart_method *method, chart_run *run)
{
    chart_rows rows = {0};
    float *B = (float *)malloc(3 * b->c->mesh.vertex_count * sizeof *B);
    const int kept = b->threads;
    b->threads = threads_available();
    if (!B || chart_rows_create(b->c, 1, &rows) != 0 || method->relight(b->c, run) != 0 ||
        method->radiosity(b->c, run, &rows, B) != 0)
    {
        free(B);
        B = NULL;
    }
    b->threads = kept;
    chart_rows_free(&rows);
    return B;
}

static int make_best(bench *b, chart_reference kind)
{
    const chart_method *const method = best[kind].method;
    chart_truth *const t = &b->truths[kind];
    chart_run run;
    if (kind == CHART_PLACED && b->c->mesh.vertex_count > PLACED_MAX)
    {
        return 0; // no picture and no error of the model, then
    }
    memset(&run, 0, sizeof run);
    run.hooks = &b->hooks;
    float *const B = method->prepare(b->c, best[kind].variant, &run) == 0 ? all_vertices(b, method, &run) : NULL;
    method->release(&run);
    if (B)
    {
        t->best = picture_create(b->c, B);
        chart_model_error(b->c, B, t);
    }
    free(B);
    return B == NULL;
}

// ---- one run ----

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

static int compare_pictures(bench *b, chart_run *run, line *l)
{
    picture *const p = b->truths[l->method->reference].best;
    const int is_best = l->method == best[l->method->reference].method &&
                        l->variant == best[l->method->reference].variant;
    if (!p || is_best || frame_of(l) > 20.0 * b->s->seconds)
    {
        return 0;
    }
    float *const B = all_vertices(b, l->method, run);
    l->image_rmse = B ? picture_rmse(p, B) : -1.0;
    free(B);
    return B == NULL;
}

static int rebuild(const bench *b, chart_run *run, line *l)
{
    const double start = test_seconds();
    if (!l->method->rebuild)
    {
        l->rebuild_s = l->precompute_s;
        return 0;
    }
    const int failed = l->method->rebuild(b->c, run, &b->moved);
    l->rebuild_s = test_seconds() - start;
    return failed;
}

// Everything about a run that is prepared.
static int measure_run(bench *b, chart_run *run, line *l)
{
    const chart_truth *const t = &b->truths[l->method->reference];
    float *const B = (float *)malloc(3 * t->rows.count * sizeof *B);
    int failed = !B || l->method->relight(b->c, run) != 0 || l->method->radiosity(b->c, run, &t->rows, B) != 0;
    if (!failed)
    {
        chart_compare(t, B, &l->rel_l2, &l->rel_max);
    }
    free(B);
    const size_t rows = failed ? 0 : time_frames(b, run, l);
    if (rows == 0)
    {
        return 1;
    }
    const size_t length = strlen(run->parameters);
    snprintf(run->parameters + length, sizeof run->parameters - length, ";rows=%zu", rows);
    failed = compare_pictures(b, run, l) != 0 || predict(l->method, run) != 0 || rebuild(b, run, l) != 0;
    l->predicted = run->error_bound;
    l->bytes = run->bytes;
    memcpy(l->parameters, run->parameters, sizeof l->parameters);
    return failed;
}

// Prepares and measures into *l, or where `again`, adds a round of frames. Returns 0, 1, or CHART_LEFT_OUT.
static int measure_line(bench *b, size_t index, int again, line *l)
{
    chart_run run;
    memset(&run, 0, sizeof run);
    run.threads = b->s->threads;
    run.hooks = &b->hooks;
    run.shared = &b->shared[index];
    const double start = test_seconds();
    int status = l->method->prepare(b->c, l->variant, &run);
    if (!again)
    {
        l->precompute_s = test_seconds() - start + run.shared_s;
    }
    if (status == 0)
    {
        status = again ? time_frames(b, &run, l) == 0 : measure_run(b, &run, l);
    }
    l->method->release(&run);
    return status;
}

static void say(const bench *b, const line *l, int failed)
{
    const double frame = l->frame_count ? 1e3 * frame_of(l) : 0.0;
    if (b->s->log)
    {
        fprintf(b->s->log, "%-13s %-80s %10.4g ms  rel_l2 %.2e  rel_max %.2e  image %.1e  predicted %.1e%s\n",
                l->method->name, l->parameters, frame, l->rel_l2, l->rel_max, l->image_rmse, l->predicted,
                failed ? "  FAILED" : "");
        fflush(b->s->log);
    }
    if (failed)
    {
        fprintf(stderr, "%s: %s, variant %zu failed\n", b->c->name, l->method->name, l->variant);
    }
}

// ---- the case ----

// Placed sources may fall on the surface itself, as at the edges of a box: without a guard their integral diverges, and
// there is nothing to compare with.
static int diverges(const chart_truth *t)
{
    return !(t->error < 0.1);
}

static int selected(const chart_settings *s, const chart_method *method)
{
    return !s->method || fnmatch(s->method, method->name, 0) == 0;
}

static int make_truths(bench *b)
{
    int failed = 0;
    for (size_t m = 0; m < METHOD_COUNT; ++m)
    {
        b->wanted[methods[m]->reference] |= selected(b->s, methods[m]);
    }
    for (int kind = 0; kind < CHART_REFERENCE_COUNT && !failed; ++kind)
    {
        const double start = test_seconds();
        if (!b->wanted[kind])
        {
            continue;
        }
        failed = chart_truth_create(b->c, (chart_reference)kind, b->s->receivers, &b->truths[kind]) != 0 ||
                 (!diverges(&b->truths[kind]) && make_best(b, (chart_reference)kind) != 0);
        if (!failed && diverges(&b->truths[kind]))
        {
            fprintf(stderr, "%s: the %sintegral diverges: its methods are left out\n", b->c->name,
                    chart_reference_name((chart_reference)kind));
        }
        if (b->s->log)
        {
            fprintf(b->s->log, "%s: %squadrature to %.1e, %.1f s%s\n", b->c->name,
                    chart_reference_name((chart_reference)kind), b->truths[kind].error, test_seconds() - start,
                    failed ? "  FAILED" : "");
            fflush(b->s->log);
        }
    }
    return failed;
}

static int measure_all(bench *b)
{
    int failed = 0;
    for (size_t m = 0; m < METHOD_COUNT; ++m)
    {
        for (size_t v = 0; v < methods[m]->variant_count && v < b->s->variants_max && b->line_count < LINES_MAX; ++v)
        {
            line *const l = &b->lines[b->line_count];
            if (!selected(b->s, methods[m]) || diverges(&b->truths[methods[m]->reference]))
            {
                continue;
            }
            memset(l, 0, sizeof *l);
            l->method = methods[m];
            l->variant = v;
            l->image_rmse = -1.0;
            const int status = measure_line(b, m, 0, l);
            if (status != CHART_LEFT_OUT)
            {
                say(b, l, status != 0);
                failed = failed || status != 0;
                b->line_count += status == 0;
            }
        }
    }
    return failed;
}

static int on_front(const bench *b, const line *l)
{
    for (size_t i = 0; i < b->line_count; ++i)
    {
        const line *const other = &b->lines[i];
        if (other->rel_l2 <= l->rel_l2 && frame_of(other) < frame_of(l))
        {
            return 0;
        }
    }
    return 1;
}

// What is on the front after the first round, once more in each further one.
static int measure_front(bench *b)
{
    int failed = 0, front[LINES_MAX];
    for (size_t i = 0; i < b->line_count; ++i)
    {
        front[i] = on_front(b, &b->lines[i]);
    }
    for (int round = 1; round < b->s->rounds; ++round)
    {
        for (size_t i = 0; i < b->line_count; ++i)
        {
            size_t m = 0;
            while (methods[m] != b->lines[i].method)
            {
                ++m;
            }
            if (front[i] && measure_line(b, m, 1, &b->lines[i]) != 0)
            {
                say(b, &b->lines[i], 1);
                failed = 1;
            }
        }
    }
    return failed;
}

static void write_number(FILE *csv, double value, const char *format)
{
    if (value >= 0.0) // negative: there is none
    {
        fprintf(csv, format, value);
    }
}

static void write_line(const bench *b, const line *l, FILE *csv)
{
    const chart_case *const c = b->c;
    const chart_truth *const t = &b->truths[l->method->reference];
    double low = HUGE_VAL, high = 0.0;
    for (size_t i = 0; i < l->frame_count; ++i)
    {
        low = fmin(low, l->frames[i]);
        high = fmax(high, l->frames[i]);
    }
    fprintf(csv, "%s,%s,%zu,%zu,%g,%s,%s,%s,%d,%.4g,%.5g,%zu,%.3e,%.3e,", l->method->name, c->mesh_name,
            c->mesh.vertex_count, c->mesh.triangle_count, c->size_mm, c->material_name, c->light_name, l->parameters,
            b->s->threads, l->precompute_s, 1e3 * frame_of(l), l->bytes, l->rel_l2, l->rel_max);
    write_number(csv, l->image_rmse, "%.3e");
    fprintf(csv, ",%squadrature to %.1e at %zu vertices,%.4g,%.5g,%.5g,", chart_reference_name(l->method->reference),
            t->error, t->rows.count, 1e3 * l->rebuild_s, 1e3 * low, 1e3 * high);
    write_number(csv, t->model_l2, "%.3e");
    fputc(',', csv);
    write_number(csv, t->model_noise, "%.1e");
    fputc('\n', csv);
}

static void on_threads(void *user, size_t count, void (*task)(void *context, size_t begin, size_t end), void *context)
{
    threads_parallel_for(*(const int *)user, count, task, context);
}

// A bend that moves every vertex by up to a fiftieth of the object.
static int bend(const mesh_data *mesh, mesh_data *out)
{
    const double extent = mesh_extent(mesh);
    if (mesh_copy(mesh, out) != 0)
    {
        return 1;
    }
    for (size_t v = 0; v < out->vertex_count; ++v)
    {
        float *const p = out->positions + 3 * v;
        p[0] += (float)(0.02 * extent * sin(3.0 * (double)p[1] / extent));
        p[2] += (float)(0.02 * extent * cos(3.0 * (double)p[0] / extent));
    }
    mesh_compute_normals(out);
    return 0;
}

int chart_measure(const chart_case *c, const chart_settings *s, FILE *csv)
{
    bench *const b = (bench *)calloc(1, sizeof *b);
    int failed = 1;
    if (!b)
    {
        return 1;
    }
    b->c = c;
    b->s = s;
    b->threads = s->threads;
    b->hooks.user = &b->threads;
    b->hooks.parallel_for = on_threads;
    b->lines = (line *)malloc(LINES_MAX * sizeof *b->lines);
    if (b->lines && bend(&c->mesh, &b->moved) == 0 && make_truths(b) == 0)
    {
        failed = measure_all(b);
        failed = measure_front(b) != 0 || failed;
        for (size_t i = 0; i < b->line_count; ++i)
        {
            write_line(b, &b->lines[i], csv);
        }
    }
    failed = failed || fflush(csv) != 0;
    for (size_t m = 0; m < METHOD_COUNT; ++m)
    {
        if (methods[m]->forget && b->shared[m])
        {
            methods[m]->forget(b->shared[m]);
        }
    }
    for (int kind = 0; kind < CHART_REFERENCE_COUNT; ++kind)
    {
        chart_truth_free(&b->truths[kind]);
    }
    mesh_free(&b->moved);
    free(b->lines);
    free(b);
    return failed;
}
