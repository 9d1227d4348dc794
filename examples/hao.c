// The tiny example of sss_hao.h: a light circles a mesh. Side by side the same integrals kept in three ways:
// uncompressed, as spherical harmonics, as reference points; then ten times what the last two are off.
//     build/hao [MESH.glb] [--material NAME] [--size-mm S] [--glsl 0|1]     a window: G shades the reference points by
//                                                     the vertex shader (--glsl 1: from the start), H holds the light,
//                                                     drag to turn, wheel to zoom, Escape to leave
//     build/hao [MESH.glb] [...] --headless OUT.png   a row of pictures for each of three places of the light
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SSS_DIPOLE_IMPLEMENTATION // for the material
#include "../sss_dipole.h"
#define SSS_HAO_IMPLEMENTATION
#include "../sss_hao.h"

#include "common/hao_show.h"
#include "common/services.h"
#include "common/threads.h"

enum { LIGHTS = 2 };

typedef struct app
{
    services services;       // the library's threads, for as long as its objects live
    sss_hao *hao[HAO_VIEWS];
    float *B[HAO_VIEWS];     // [V][3] radiosity
    float *lighting;         // [lighting_count][3], of the object with reference points
    size_t lighting_count;
} app;

static int check(hao_show *s, const char *what, sss_result result)
{
    snprintf(s->reason, sizeof s->reason, "%s: %s", what, sss_result_string(result));
    return result == SSS_OK ? 0 : -1;
}

// Once: integrals of every vertex for some two hundred lights; then the same in less space.
static int start(void *user, hao_show *s)
{
    static const sss_hao_storage kept[HAO_VIEWS] = {SSS_HAO_FLOAT, SSS_HAO_HARMONICS, SSS_HAO_REFERENCES};
    app *const a = user;
    const sss_hooks hooks = services_hooks(&a->services);
    for (int i = 0; i < HAO_VIEWS; ++i)
    {
        const sss_hao_options options = {.storage = kept[i]}; // and the defaults of everything else
        const double since = services_seconds();
        sss_hao_stats stats = {.bytes_per_vertex = 0.0};
        sss_result result = i == 0 ? sss_hao_create(&s->mesh, &s->profile, &options, &hooks, &a->hao[i])
                                   : sss_hao_compress(a->hao[0], &s->mesh, &options, &hooks, &a->hao[i]);
        services_end_progress(&a->services);
        result = result == SSS_OK ? sss_hao_get_stats(a->hao[i], &stats) : result;
        if (check(s, "precomputing", result) != 0)
        {
            return -1;
        }
        s->look.bytes[i] = stats.bytes_per_vertex;
        a->lighting_count = stats.lighting_count;
        a->B[i] = malloc(3 * s->m.vertex_count * sizeof *a->B[i]);
        printf("%.1f s for %.1f bytes a vertex\n", services_seconds() - since, stats.bytes_per_vertex);
    }
    s->object = a->hao[HAO_VIEW_REFERENCES];
    s->brightness = a->B[0];
    a->lighting = malloc(3 * a->lighting_count * sizeof *a->lighting);
    return check(s, "precomputing", a->B[0] && a->B[1] && a->B[2] && a->lighting ? SSS_OK : SSS_ERROR_OUT_OF_MEMORY);
}

// Reference points here, all other vertices in the vertex shader.
static int relight_by_shader(app *a, hao_show *s, const sss_hao_light *lights)
{
    memset(a->lighting, 0, 3 * a->lighting_count * sizeof *a->lighting);
    const sss_result result = sss_hao_add_lights(s->object, lights, LIGHTS, a->lighting);
    s->look.error[HAO_VIEW_REFERENCES] = NAN; // it stays on the graphics card
    return check(s, "light", result) ? -1 : hao_view_set_lighting(s->view, s->object, a->lighting, s->reason,
                                                                  sizeof s->reason);
}

// Each frame: a warm light on its way round, and a faint cool one that stays.
static int relight(void *user, hao_show *s)
{
    app *const a = user;
    const double *const w = s->look.to_light;
    const sss_hao_light lights[LIGHTS] = {{.color = {1.0, 0.95, 0.87}, .direction = {w[0], w[1], w[2]}},
                                          {.color = {0.05, 0.06, 0.075}, .direction = {-0.5, 0.8, 0.3}}};
    int status = 0;
    for (int i = 0; i < HAO_VIEWS && status == 0; ++i)
    {
        const int by_shader = s->by_shader && i == HAO_VIEW_REFERENCES;
        const double since = services_seconds();
        status = by_shader ? relight_by_shader(a, s, lights)
                           : check(s, "relighting", sss_hao_relight(a->hao[i], lights, LIGHTS, a->B[i]));
        s->look.ms[i] = 1e3 * (services_seconds() - since);
        if (!by_shader && status == 0)
        {
            s->look.error[i] = hao_view_difference(a->B[i], a->B[0], 3 * s->m.vertex_count);
            hao_view_set_radiosity(s->view, i, a->B[i]);
        }
    }
    return status;
}

int main(int argc, char **argv)
{
    static app a;
    static hao_show show = {.start = start, .relight = relight, .user = &a};
    a.services.threads = threads_available();
    a.services.what = "precomputing";
    const int status = hao_show_run(&show, "hao", argc, argv);
    for (int i = 0; i < HAO_VIEWS; ++i)
    {
        sss_hao_free(a.hao[i]);
        free(a.B[i]);
    }
    free(a.lighting);
    return status;
}
