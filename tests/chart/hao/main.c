// Repeats the paper's measurements.
//     build/tests/chart/hao FOLDER [--quick] [--dragon] [--threads N] [figure5|figure9|numbers|table1|bars...]

#define SSS_DIPOLE_IMPLEMENTATION
#include "../../../sss_dipole.h"
#define SSS_HAO_IMPLEMENTATION
#include "../../../sss_hao.h"

#include "../../../examples/common/threads.h"
#include "../../common/numbers.h"
#include "../../common/profiles.h"
#include "hao.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int hao_load(const hao_settings *s, const char *name, double size_mm, hao_model *out)
{
    mesh_data thin;
    memset(out, 0, sizeof *out);
    if (mesh_load_model(name, &out->mesh) != 0)
    {
        fprintf(stderr, "hao: %s is not there: left out\n", name);
        return 1;
    }
    if (s->quick && mesh_decimate(&out->mesh, (double)out->mesh.triangle_count / 1500.0, &thin) == 0)
    {
        mesh_free(&out->mesh);
        out->mesh = thin;
    }
    (void)mesh_turn_outward(&out->mesh);
    out->name = name;
    out->view = mesh_view(&out->mesh, size_mm / mesh_extent(&out->mesh));
    out->profile = profile_of("Marble");
    random_seed(1);
    out->pictures = views_create(&out->mesh, s->views, s->side, out->profile.eta);
    if (!out->pictures)
    {
        hao_unload(out);
        return 1;
    }
    return 0;
}

void hao_unload(hao_model *m)
{
    views_free(m->pictures);
    mesh_free(&m->mesh);
    memset(m, 0, sizeof *m);
}

sss_hooks hao_hooks(const hao_settings *s)
{
    sss_hooks hooks;
    memset(&hooks, 0, sizeof hooks);
    hooks.parallel_for = threads_hook;
    hooks.user = (void *)(uintptr_t)&s->threads; // threads_hook only reads it
    return hooks;
}

void hao_lights(size_t count, double *w)
{
    random_seed(2);
    for (size_t i = 0; i < count; ++i)
    {
        const double z = random_between(-1.0, 1.0), phi = random_between(0.0, 6.28318530717958648);
        w[3 * i] = sqrt(1.0 - z * z) * cos(phi);
        w[3 * i + 1] = sqrt(1.0 - z * z) * sin(phi);
        w[3 * i + 2] = z;
    }
}

float *hao_radiosities(sss_hao *hao, const double *w, size_t count, size_t V)
{
    float *const B = (float *)malloc(count * 3 * V * sizeof *B);
    for (size_t i = 0; B && i < count; ++i)
    {
        sss_hao_light light;
        memset(&light, 0, sizeof light);
        for (size_t k = 0; k < 3; ++k)
        {
            light.color[k] = 1.0;
            light.direction[k] = w[3 * i + k];
        }
        if (sss_hao_relight(hao, &light, 1, B + i * 3 * V) != SSS_OK)
        {
            free(B);
            return NULL;
        }
    }
    return B;
}

float *hao_truth(const hao_settings *s, const hao_model *m, int no_shadows, const double *w, size_t count)
{
    const sss_hooks hooks = hao_hooks(s);
    sss_hao_options options;
    sss_hao *hao = NULL;
    float *const set = (float *)malloc(3 * count * sizeof *set);
    double *const rounded = (double *)malloc(3 * count * sizeof *rounded);
    float *B = NULL;
    memset(&options, 0, sizeof options);
    for (size_t i = 0; set && rounded && i < 3 * count; ++i)
    {
        set[i] = (float)w[i];
        rounded[i] = (double)set[i];
    }
    options.storage = SSS_HAO_FLOAT;
    options.direction_set = set;
    options.directions = count;
    options.no_shadows = no_shadows;
    if (set && rounded && sss_hao_create(&m->view, &m->profile, &options, &hooks, &hao) == SSS_OK)
    {
        B = hao_radiosities(hao, rounded, count, m->mesh.vertex_count);
    }
    sss_hao_free(hao);
    free(set);
    free(rounded);
    return B;
}

hao_errors hao_compare(const hao_model *m, sss_hao *hao, const double *w, size_t count, const float *truth)
{
    const size_t values = 3 * m->mesh.vertex_count;
    hao_errors e = {0.0, 0.0, 0.0, 0.0};
    double error = 0.0, norm = 0.0, *const area = (double *)calloc(m->mesh.vertex_count, sizeof *area);
    float *const B = hao_radiosities(hao, w, count, m->mesh.vertex_count);
    if (!B || !area)
    {
        free(B);
        free(area);
        e.rmse = e.rmse_mean = e.rmse_linear = e.rel_l2 = (double)NAN;
        return e;
    }
    mesh_vertex_areas(&m->mesh, area);
    for (size_t i = 0; i < count; ++i)
    {
        const float *const got = B + i * values, *const want = truth + i * values;
        double mean;
        const double exposure = views_exposure(m->pictures, want);
        const double worst = views_rmse(m->pictures, VIEWS_TONE_MAPPED, got, want, exposure, &mean);
        e.rmse = fmax(e.rmse, worst);
        e.rmse_linear = fmax(e.rmse_linear, views_rmse(m->pictures, VIEWS_LINEAR, got, want, exposure, NULL));
        e.rmse_mean += mean / (double)count;
        for (size_t k = 0; k < values; ++k)
        {
            error += area[k / 3] * pow((double)got[k] - (double)want[k], 2.0);
            norm += area[k / 3] * pow((double)want[k], 2.0);
        }
    }
    e.rel_l2 = sqrt(error / norm);
    free(B);
    free(area);
    return e;
}

static const struct
{
    const char *name;
    int (*run)(const hao_settings *s);
} measurements[] = {{"figure5", hao_figure5},
                    {"figure9", hao_figure9},
                    {"numbers", hao_numbers},
                    {"table1", hao_table1},
                    {"bars", hao_bars}};

int main(int argc, char **argv)
{
    hao_settings s = {"", 1, 0, 0, 12, 256, 8};
    if (argc < 2)
    {
        fprintf(stderr, "usage: %s FOLDER [--quick] [--dragon] [--threads N] "
                "[figure5|figure9|numbers|table1|bars...]\n", argv[0]);
        return 2;
    }
    s.folder = argv[1];
    s.threads = threads_available();
    for (int i = 2; i < argc; ++i)
    {
        if (strcmp(argv[i], "--quick") == 0)
        {
            s.quick = 1;
            s.views = 3;
            s.side = 96;
            s.lights = 4; // the least set there is
        }
        if (strcmp(argv[i], "--dragon") == 0) s.dragon = 1;
        if (strcmp(argv[i], "--threads") == 0 && i + 1 < argc) s.threads = atoi(argv[i + 1]);
    }
    for (size_t i = 0; i < sizeof measurements / sizeof measurements[0]; ++i)
    {
        if (experiment_wanted(argc, argv, "--threads", measurements[i].name) && measurements[i].run(&s) != 0)
        {
            fprintf(stderr, "%s failed\n", measurements[i].name);
            return 1;
        }
    }
    return 0;
}
