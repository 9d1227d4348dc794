// Figures 4 to 6 and 9, and the quantiser.

#include "hao.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double SIZE_MM = 50.0;

enum
{
    LIGHTS_MAX = 64
};

static const char *const models[] = {"horse_14k_v", "bunny", "dragon_res3", "igea_10k_t"}; // the paper has four, too
enum
{
    MODELS = sizeof models / sizeof models[0]
};

static sss_hao *make(const hao_settings *s, const hao_model *m, const sss_hao_options *options)
{
    const sss_hooks hooks = hao_hooks(s);
    sss_hao *hao = NULL;
    const sss_result result = sss_hao_create(&m->view, &m->profile, options, &hooks, &hao);
    if (result != SSS_OK)
    {
        fprintf(stderr, "hao: %s: %s\n", m->name, sss_result_string(result));
        return NULL;
    }
    return hao;
}

static sss_hao *compress(const hao_settings *s, const hao_model *m, const sss_hao *from, sss_hao_storage storage,
                         size_t references, size_t order)
{
    const sss_hooks hooks = hao_hooks(s);
    sss_hao_options options;
    sss_hao *hao = NULL;
    memset(&options, 0, sizeof options);
    options.storage = storage;
    options.reference_count = references;
    options.order = order;
    const sss_result result = sss_hao_compress(from, &m->view, &options, &hooks, &hao);
    if (result != SSS_OK)
    {
        fprintf(stderr, "hao: %s: %s\n", m->name, sss_result_string(result));
        return NULL;
    }
    return hao;
}

// One curve: floats, so that there is nothing but interpolation.
static int figure5_curve(const hao_settings *s, const hao_model *m, sss_hao_interpolation interpolation, int no_shadows,
                         FILE *file)
{
    static const size_t sizes[] = {6, 18, 38, 66, 102, 146, 198, 258, 402, 578, 1026};
    const size_t steps = s->quick ? 4 : sizeof sizes / sizeof sizes[0];
    double w[3 * LIGHTS_MAX];
    int failed = 0;
    hao_lights(s->lights, w);
    float *const truth = hao_truth(s, m, no_shadows, w, s->lights);
    for (size_t k = 0; truth && k < steps && !failed; ++k)
    {
        sss_hao_options options;
        sss_hao_stats stats;
        memset(&options, 0, sizeof options);
        options.storage = SSS_HAO_FLOAT;
        options.directions = sizes[k];
        options.interpolation = interpolation;
        options.no_shadows = no_shadows;
        sss_hao *const hao = make(s, m, &options);
        failed = !hao || sss_hao_get_stats(hao, &stats) != SSS_OK;
        if (!failed)
        {
            const hao_errors e = hao_compare(m, hao, w, s->lights, truth);
            fprintf(file, "%s,%zu,%s,%s,%zu,%.3e,%.3e,%.3e,%.3e,%.3e\n", m->name, m->mesh.vertex_count,
                    interpolation == SSS_HAO_THREE_NEAREST ? "three" : "four", no_shadows ? "without" : "with",
                    stats.directions, e.rmse, e.rmse_mean, e.rmse_linear, e.rel_l2, stats.interpolation_error);
            (void)fflush(file);
        }
        sss_hao_free(hao);
    }
    free(truth);
    return failed || !truth;
}

int hao_figure5(const hao_settings *s)
{
    FILE *const file = experiment_open(s->folder, "figure5.csv",
                                       "model,vertices,nearest,shadows,directions,rmse,rmse_mean,"
                                       "rmse_linear,rel_l2,predicted");
    int failed = file == NULL;
    if (failed)
    {
        return 1;
    }
    for (size_t i = 0; i < (s->quick ? 2 : MODELS) && !failed; ++i)
    {
        hao_model m;
        if (hao_load(s, models[i], SIZE_MM, &m) != 0)
        {
            continue;
        }
        failed = figure5_curve(s, &m, SSS_HAO_THREE_NEAREST, 0, file) != 0 ||
                 figure5_curve(s, &m, SSS_HAO_THREE_NEAREST, 1, file) != 0 ||
                 (i == 0 && figure5_curve(s, &m, SSS_HAO_FOUR_NEAREST, 0, file) != 0); // the paper's four on one model
        hao_unload(&m);
    }
    return fclose(file) != 0 || failed;
}

// Against the uncompressed object, which is interpolated alike: what compression alone does.
static int compressed_line(const hao_settings *s, const hao_model *m, const sss_hao *from, sss_hao_storage storage,
                           size_t references, size_t order, const double *w, const float *truth, FILE *file)
{
    sss_hao_stats stats;
    sss_hao *const hao = compress(s, m, from, storage, references, order);
    if (!hao || sss_hao_get_stats(hao, &stats) != SSS_OK)
    {
        return 1;
    }
    const hao_errors e = hao_compare(m, hao, w, s->lights, truth);
    fprintf(file, "%s,%zu,%s,%zu,%zu,%.3e,%.3e,%.3e,%.3e,%.3e,%.2f\n", m->name, m->mesh.vertex_count,
            storage == SSS_HAO_HARMONICS ? "harmonics" : "references", stats.reference_count, stats.order, e.rmse,
            e.rmse_mean, e.rmse_linear, e.rel_l2, stats.storage_error, stats.bytes_per_vertex);
    (void)fflush(file);
    sss_hao_free(hao);
    return 0;
}

int hao_figure9(const hao_settings *s)
{
    static const double shares[] = {0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32};
    const size_t steps = s->quick ? 3 : sizeof shares / sizeof shares[0];
    double w[3 * LIGHTS_MAX];
    FILE *const file = experiment_open(s->folder, "figure9.csv",
                                       "model,vertices,storage,references,order,rmse,rmse_mean,rmse_linear,"
                                       "rel_l2,storage_error,bytes_per_vertex");
    int failed = file == NULL;
    if (failed)
    {
        return 1;
    }
    hao_lights(s->lights, w);
    for (size_t i = 0; i < 2 && !failed; ++i)
    {
        hao_model m;
        sss_hao_options options;
        if (hao_load(s, models[i], SIZE_MM, &m) != 0)
        {
            continue;
        }
        memset(&options, 0, sizeof options);
        options.storage = SSS_HAO_FLOAT;
        sss_hao *const floats = make(s, &m, &options);
        float *const truth = floats ? hao_radiosities(floats, w, s->lights, m.mesh.vertex_count) : NULL;
        failed = truth == NULL;
        for (size_t k = 0; k < 2 * steps && !failed; ++k)
        {
            const size_t references = (size_t)(shares[k % steps] * (double)m.mesh.vertex_count) + 4;
            failed = compressed_line(s, &m, floats, SSS_HAO_REFERENCES, references, k < steps ? 3 : 6, w, truth, file);
        }
        for (size_t order = 1; order <= 8 && !failed; ++order) // figure 6 has 1 to 7
        {
            failed = compressed_line(s, &m, floats, SSS_HAO_HARMONICS, 0, order, w, truth, file);
        }
        free(truth);
        sss_hao_free(floats);
        hao_unload(&m);
    }
    return fclose(file) != 0 || failed;
}

int hao_numbers(const hao_settings *s)
{
    double w[3 * LIGHTS_MAX];
    FILE *const file = experiment_open(s->folder, "numbers.csv", "what,model,vertices,value,paper_model,paper");
    int failed = file == NULL;
    if (failed)
    {
        return 1;
    }
    hao_lights(s->lights, w);
    for (size_t i = 0; i < 2 && !failed; ++i)
    {
        hao_model m;
        sss_hao_options options;
        sss_hao_stats stats;
        if (hao_load(s, models[i], SIZE_MM, &m) != 0)
        {
            continue;
        }
        memset(&options, 0, sizeof options);
        options.storage = SSS_HAO_FLOAT;
        sss_hao *const floats = make(s, &m, &options);
        options.storage = SSS_HAO_VECTORS;
        sss_hao *const vectors = make(s, &m, &options);
        sss_hao *const table = floats ? compress(s, &m, floats, SSS_HAO_TABLE, 0, 0) : NULL;
        float *const B = floats ? hao_radiosities(floats, w, s->lights, m.mesh.vertex_count) : NULL;
        failed = !vectors || !table || !B || sss_hao_get_stats(table, &stats) != SSS_OK;
        if (!failed)
        {
            const hao_errors quantised = hao_compare(&m, table, w, s->lights, B);
            const hao_errors vector = hao_compare(&m, vectors, w, s->lights, B);
            fprintf(file, "signal to noise of the 8-bit table in dB,%s,%zu,%.2f,teapot,50.99\n", m.name,
                    m.mesh.vertex_count, stats.snr_db);
            fprintf(file, "image RMSE of the 8-bit table,%s,%zu,%.2e,teapot,8.83e-4\n", m.name, m.mesh.vertex_count,
                    quantised.rmse);
            fprintf(file, "the same in linear pictures,%s,%zu,%.2e,teapot,8.83e-4\n", m.name, m.mesh.vertex_count,
                    quantised.rmse_linear);
            fprintf(file, "image RMSE between Q and q (figure 4),%s,%zu,%.2e,horse,5.26e-3\n", m.name,
                    m.mesh.vertex_count, vector.rmse);
            fprintf(file, "the same in linear pictures,%s,%zu,%.2e,horse,5.26e-3\n", m.name, m.mesh.vertex_count,
                    vector.rmse_linear);
        }
        free(B);
        sss_hao_free(floats);
        sss_hao_free(vectors);
        sss_hao_free(table);
        hao_unload(&m);
    }
    return fclose(file) != 0 || failed;
}
