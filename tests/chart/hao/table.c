// Table I, and the bars of this project.

#include "../../common/lit.h"
#include "../../common/numbers.h"
#include "../../common/test.h"
#include "hao.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum
{
    FRAMES = 15,
    RECEIVERS = 96,
    LIGHTS = 8
};

// Median seconds of relighting all vertices on one thread: add_lights, the reference points, the vertices.
static int by_double(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double seconds_of_frame(const sss_hao *hao, const sss_hao_stats *stats)
{
    double seconds[FRAMES];
    float *const lighting = (float *)malloc(3 * stats->lighting_count * sizeof *lighting);
    float *const references = (float *)malloc(4 * (stats->reference_count + 1) * sizeof *references);
    float *const B = (float *)malloc(stats->vertex_count * stats->channels * sizeof *B);
    for (int i = 0; lighting && references && B && i < FRAMES; ++i)
    {
        sss_hao_light light;
        memset(&light, 0, sizeof light);
        light.color[0] = light.color[1] = light.color[2] = 1.0;
        light.direction[0] = cos(0.3 * i);
        light.direction[1] = sin(0.3 * i);
        light.direction[2] = 0.4;
        const double start = test_seconds();
        memset(lighting, 0, 3 * stats->lighting_count * sizeof *lighting);
        (void)sss_hao_add_lights(hao, &light, 1, lighting);
        (void)sss_hao_relight_references(hao, lighting, references);
        (void)sss_hao_relight_rows(hao, lighting, references, 0, stats->vertex_count, B);
        seconds[i] = test_seconds() - start;
    }
    qsort(seconds, FRAMES, sizeof *seconds, by_double);
    free(lighting);
    free(references);
    free(B);
    return seconds[FRAMES / 2];
}

// Bytes a second that one core reads from memory: the best of some passes.
static double bandwidth(void)
{
    const size_t count = (size_t)1 << 25; // 256 MiB
    uint64_t *const words = (uint64_t *)malloc(count * sizeof *words);
    volatile uint64_t sink = 0;
    double best = HUGE_VAL;
    for (size_t i = 0; words && i < count; ++i)
    {
        words[i] = i;
    }
    for (int pass = 0; words && pass < 5; ++pass)
    {
        uint64_t sum[8] = {0, 0, 0, 0, 0, 0, 0, 0};
        const double start = test_seconds();
        for (size_t i = 0; i + 8 <= count; i += 8)
        {
            for (size_t k = 0; k < 8; ++k)
            {
                sum[k] ^= words[i + k];
            }
        }
        best = fmin(best, test_seconds() - start);
        sink = sink + (sum[0] ^ sum[1] ^ sum[2] ^ sum[3] ^ sum[4] ^ sum[5] ^ sum[6] ^ sum[7]);
    }
    free(words);
    return 8.0 * (double)count / best;
}

static int table_line(const hao_settings *s, const hao_model *m, size_t channels, double memory, FILE *file)
{
    const sss_hooks hooks = hao_hooks(s);
    sss_hao_options options;
    sss_hao_stats stats;
    sss_hao *hao = NULL;
    memset(&options, 0, sizeof options);
    options.channels = channels;
    const double start = test_seconds();
    const sss_result result = sss_hao_create(&m->view, &m->profile, &options, &hooks, &hao);
    const double seconds = test_seconds() - start;
    if (result != SSS_OK || sss_hao_get_stats(hao, &stats) != SSS_OK)
    {
        fprintf(stderr, "hao: %s: %s\n", m->name, sss_result_string(result));
        return 1;
    }
    const double frame = seconds_of_frame(hao, &stats);
    const double bound = (double)(stats.bytes_vertices + stats.bytes_references) / memory;
    fprintf(file, "%s,%zu,%zu,%zu,%zu,%.2f,%.2f,%.4g,%.3f,%.2f,%.3f,%zu,%.3e,%.3e,%.3e\n", m->name,
            stats.vertex_count, stats.triangle_count, channels, stats.reference_count, stats.bytes_per_vertex,
            (double)(stats.directions * channels) / stats.bytes_per_vertex, 1.0 / frame, 1e3 * frame, seconds,
            bound / frame, stats.peak_bytes, stats.sum_error, stats.interpolation_error, stats.storage_error);
    (void)fflush(file);
    sss_hao_free(hao);
    return 0;
}

int hao_table1(const hao_settings *s)
{
    static const char *const names[] = {"horse_14k_v", "bunny", "dragon_res2", "dragon"};
    const double memory = bandwidth();
    FILE *const file =
        experiment_open(s->folder, "table1.csv",
                        "model,vertices,triangles,channels,references,bytes_per_vertex,compression,"
                        "frames_per_second,frame_ms,precompute_s,of_bandwidth,peak_bytes,sum_error,interpolation_error,"
                        "storage_error");
    int failed = file == NULL;
    if (failed)
    {
        return 1;
    }
    for (size_t i = 0; i < (s->quick ? 2 : s->dragon ? 4 : 3) && !failed; ++i)
    {
        hao_model m;
        if (hao_load(s, names[i], 50.0, &m) != 0)
        {
            continue;
        }
        for (size_t channels = 1; channels <= 3 && !failed; channels += 2)
        {
            failed = table_line(s, &m, channels, memory, file);
        }
        hao_unload(&m);
    }
    return fclose(file) != 0 || failed;
}

// rel_l2 against the reference of DESIGN.md, by rows: at receivers drawn by area, lights at random, shadows by rays.
static double reference_error(const hao_settings *s, const hao_model *m, sss_hao *hao, const double *w, int no_shadows)
{
    lit_rows rows;
    const size_t V = m->mesh.vertex_count;
    double *const E = (double *)malloc(V * sizeof *E), want[3 * RECEIVERS], error = 0.0, norm = 0.0;
    float *const visible = (float *)malloc(V * sizeof *visible);
    float *const B = hao_radiosities(hao, w, LIGHTS, V);
    lit_rays *const rays = lit_rays_create(&m->view);
    const int made = lit_rows_make(&m->view, &m->profile, mesh_vertices_by_area(&m->mesh, RECEIVERS), RECEIVERS,
                                   s->threads, &rows) == 0;
    for (size_t i = 0; made && rays && E && visible && B && i < LIGHTS; ++i)
    {
        lit_rays_visible(rays, &w[3 * i], HUGE_VAL, visible);
        lit_irradiance(&m->view, m->mesh.normals, m->profile.eta, &w[3 * i], HUGE_VAL,
                       no_shadows ? NULL : visible, E);
        lit_rows_apply(&rows, E, want);
        for (size_t k = 0; k < 3 * RECEIVERS; ++k)
        {
            error += pow((double)B[3 * (i * V + rows.index[k / 3]) + k % 3] - want[k], 2.0);
            norm += want[k] * want[k];
        }
    }
    if (made)
    {
        lit_rows_free(&rows);
    }
    lit_rays_free(rays);
    free(E);
    free(visible);
    free(B);
    return sqrt(error / norm);
}

static int bar_line(const hao_settings *s, const hao_model *m, double size_mm, size_t directions, int no_shadows,
                    FILE *file)
{
    const sss_hooks hooks = hao_hooks(s);
    double w[3 * LIGHTS];
    sss_hao_options options;
    sss_hao_stats stats;
    sss_hao *hao = NULL;
    hao_lights(LIGHTS, w);
    memset(&options, 0, sizeof options);
    options.directions = directions;
    options.no_shadows = no_shadows;
    float *const truth = hao_truth(s, m, no_shadows, w, LIGHTS);
    const int failed = !truth || sss_hao_create(&m->view, &m->profile, &options, &hooks, &hao) != SSS_OK ||
                       sss_hao_get_stats(hao, &stats) != SSS_OK;
    if (!failed)
    {
        const hao_errors e = hao_compare(m, hao, w, LIGHTS, truth);
        fprintf(file, "%s,%zu,%g,%zu,%s,%.3e,%.3e,%.3e,%.3e,%.3e,%.3e,%.3e\n", m->name, stats.vertex_count, size_mm,
                stats.directions, no_shadows ? "without" : "with", reference_error(s, m, hao, w, no_shadows), e.rmse,
                e.rmse_linear, stats.sum_error, stats.interpolation_error, stats.storage_error, stats.predicted_error);
        (void)fflush(file);
    }
    free(truth);
    sss_hao_free(hao);
    return failed;
}

int hao_bars(const hao_settings *s)
{
    static const char *const names[] = {"bunny", "horse_14k_v"};
    static const double sizes[] = {20.0, 50.0, 100.0};
    FILE *const file = experiment_open(s->folder, "bars.csv",
                                       "model,vertices,size_mm,directions,shadows,rel_l2,image_rmse,"
                                       "image_rmse_linear,sum_error,interpolation_error,storage_error,predicted");
    int failed = file == NULL;
    if (failed)
    {
        return 1;
    }
    for (size_t i = 0; i < (s->quick ? 1 : 6) && !failed; ++i)
    {
        hao_model m;
        if (hao_load(s, names[i / 3], sizes[i % 3], &m) != 0)
        {
            continue;
        }
        failed = bar_line(s, &m, sizes[i % 3], 0, 0, file) != 0 || bar_line(s, &m, sizes[i % 3], 0, 1, file) != 0 ||
                 bar_line(s, &m, sizes[i % 3], 402, 0, file) != 0 || bar_line(s, &m, sizes[i % 3], 1026, 0, file) != 0;
        hao_unload(&m);
    }
    return fclose(file) != 0 || failed;
}
