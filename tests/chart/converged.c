// The converged references of a case, and what is compared with them.

#include "chart.h"
#include "picture.h"

#include "../../examples/common/threads.h"
#include "../common/default_guard.h"
#include "../common/reference.h"
#include "../common/truth.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// How far each reference is driven: its own estimate, an upper one, stays below the errors measured.
static const struct
{
    const char *name;
    reference_options options; // CHART_GUARDED: the guard is sss_bem.h's own
} references[CHART_REFERENCE_COUNT] = {
    {"", {SSS_DIPOLE_DISTANCE, SSS_DIPOLE_VERTICES, 1e-6, 0.0}},
    {"placed ", {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, 1e-5, 0.0}},
    {"guarded placed ", {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, 1e-5, 0.0}},
};

const char *chart_reference_name(chart_reference kind)
{
    return references[kind].name;
}

int chart_rows_create(const chart_case *c, size_t step, chart_rows *rows)
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

void chart_rows_free(chart_rows *rows)
{
    free(rows->indices);
    free(rows->positions);
    free(rows->normals);
    memset(rows, 0, sizeof *rows);
}

// Area-weighted norms of B and of the errors that the reference estimates of itself.
static void weigh(const double *errors, const double *areas, chart_truth *t)
{
    double sum = 0.0, sum_error = 0.0;
    for (size_t i = 0; i < 3 * t->rows.count; ++i)
    {
        const double weight = t->weights[i / 3] = areas[t->rows.indices[i / 3]];
        sum += weight * t->B[i] * t->B[i];
        sum_error += weight * errors[i] * errors[i];
    }
    t->error = sum > 0.0 ? sqrt(sum_error / sum) : HUGE_VAL;
}

int chart_truth_create(const chart_case *c, chart_reference kind, size_t receivers, chart_truth *t)
{
    const size_t step = c->mesh.vertex_count > receivers ? c->mesh.vertex_count / receivers : 1;
    reference_options options = references[kind].options;
    memset(t, 0, sizeof *t);
    t->model_l2 = t->model_noise = -1.0;
    options.guard = kind == CHART_GUARDED ? default_guard() : 0.0;
    if (chart_rows_create(c, step, &t->rows) != 0)
    {
        return 1;
    }
    double *const areas = (double *)malloc(c->mesh.vertex_count * sizeof *areas);
    double *const errors = (double *)malloc(3 * t->rows.count * sizeof *errors);
    t->B = (double *)malloc(3 * t->rows.count * sizeof *t->B);
    t->weights = (double *)malloc(t->rows.count * sizeof *t->weights);
    int status = !areas || !errors || !t->B || !t->weights;
    if (status == 0)
    {
        status = reference_radiosity_many(&c->view, &c->profile, c->irradiance, &options, t->rows.positions,
                                          t->rows.normals, NULL, t->rows.count, threads_available(), t->B, errors);
        status = status == 2 ? 0 : status; // did not converge everywhere: t->error says how far it is
    }
    if (status == 0)
    {
        mesh_vertex_areas(&c->mesh, areas);
        weigh(errors, areas, t);
    }
    free(areas);
    free(errors);
    return status;
}

void chart_truth_free(chart_truth *t)
{
    picture_free(t->best);
    chart_rows_free(&t->rows);
    free(t->B);
    free(t->weights);
    memset(t, 0, sizeof *t);
}

void chart_compare(const chart_truth *t, const float *B, double *rel_l2, double *rel_max)
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

void chart_model_error(const chart_case *c, const float *B, chart_truth *t)
{
    const truth_case of = {c->mesh_name, &c->view, &c->profile, c->irradiance, c->light_name};
    char path[CHART_NAME_SIZE + 32];
    truth walked;
    truth_error e;
    snprintf(path, sizeof path, "tests/chart/truth/%s.csv", c->name);
    const truth_status status = truth_read(path, &of, &walked);
    t->model_l2 = t->model_noise = -1.0;
    if (status == TRUTH_OK)
    {
        truth_model_error(&walked, &of, B, &e);
        truth_free(&walked);
        t->model_l2 = isfinite(e.rel_l2) ? e.rel_l2 : -1.0;
        t->model_noise = isfinite(e.rel_l2_error) ? e.rel_l2_error : -1.0;
    }
    else if (status != TRUTH_NONE)
    {
        fprintf(stderr, "%s: %s\n", path, truth_status_string(status));
    }
}
