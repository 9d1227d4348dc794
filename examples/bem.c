// The tiny example of sss_bem.h: translucent objects that deform, every frame from scratch. A candle twists round its
// flame; a cube, or your own mesh, ripples under a spot light (Mertens et al. 2003, figures 6.6 and 6.7).
//     build/bem [MESH.glb]                       a window: space other scene, L lights, M material, + - size, H hold
//                                                the shape, I other mode, drag to turn, Escape to leave
//     build/bem [MESH.glb] --headless OUT.png    a strip of pictures, and what every stage takes in every mode
#include <stdio.h>
#include <string.h>

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../sss_bem.h"

#include "common/show.h"
#include "common/threads.h"

static const char *const materials[] = {"candle wax", "skimmilk", "marble", "wholemilk", "skin1", "ketchup"};
enum { MATERIALS = sizeof materials / sizeof materials[0], BUDGET = 300000 }; // BUDGET: form factors a frame
enum { FLY, INCREMENTAL, BUDGETED, MODES };

typedef struct app
{
    sss_profile profile;
    sss_bem *bem;
    int scene, material, mode;
} app;

static int check(sss_result result, const char *what, char *reason)
{
    snprintf(reason, 1024, "%s: %s", what, sss_result_string(result));
    return result == SSS_OK ? 0 : -1;
}

// A new material keeps the hierarchy.
static int take_material(app *a, show *s, char *reason)
{
    static const double albedo[3] = {0.92, 0.80, 0.58}, mean_free_path[3] = {2.2, 1.9, 1.5}; // wax, by eye; mm
    const char *const name = materials[a->material];
    sss_dipole_material medium;
    sss_result result = a->material == 0 ? sss_dipole_material_from_albedo(albedo, mean_free_path, 1.43, &medium)
                                         : sss_dipole_material_by_name(name, &medium);
    result = result == SSS_OK ? sss_dipole_profile(&medium, SSS_DIPOLE_FRESNEL_EXACT, &a->profile) : result;
    result = result == SSS_OK && a->bem ? sss_bem_set_profile(a->bem, &a->profile) : result;
    s->eta = a->profile.eta;
    return check(result, name, reason) == 0 ? glossy_set_profile(s->drawn, &a->profile) : -1;
}

static int start(void *user, show *s, char *reason)
{
    app *const a = user;
    const sss_mesh mesh = model_mesh(&s->scene.now, s->scene.size_mm / s->scene.extent);
    const sss_hooks hooks = {.parallel_for = threads_hook};
    sss_bem_free(a->bem);
    a->bem = NULL;
    a->material = a->scene == s->scene.index ? a->material : s->scene.index; // the candle of wax, the cube of skim milk
    a->scene = s->scene.index;
    return take_material(a, s, reason) != 0
               ? -1 : check(sss_bem_create(&mesh, &a->profile, NULL, &hooks, &a->bem), "hierarchy", reason);
}

// On the fly, or by links that are kept and brought up to date.
static int scatter(void *user, show *s, char *reason)
{
    const app *const a = user;
    sss_result result = sss_bem_set_irradiance(a->bem, SSS_BEM_VERTICES, s->E);
    if (result == SSS_OK && !s->held)
    {
        result = sss_bem_set_vertices(a->bem, s->scene.now.positions, s->scene.now.normals);
    }
    if (a->mode != FLY)
    {
        result = result == SSS_OK ? sss_bem_update(a->bem, a->mode == BUDGETED ? BUDGET : 0, NULL) : result;
        result = result == SSS_OK ? sss_bem_render(a->bem, s->B) : result;
    }
    else
    {
        result = result == SSS_OK ? sss_bem_shade(a->bem, s->B) : result;
    }
    return check(result, "scattering", reason);
}

static int press(void *user, show *s, int key, char *reason)
{
    app *const a = user;
    a->mode = (a->mode + (key == 'I')) % MODES;
    a->material = (a->material + (key == 'M')) % MATERIALS;
    return key == 'M' ? take_material(a, s, reason) : 0;
}

static const char *describe(void *user, const show *s)
{
    static const char *const names[MODES] = {"on the fly", "incremental", "incremental within a budget"};
    static char text[64];
    const app *const a = user;
    const char *const mode = a->mode != FLY && s->held ? "render" : names[a->mode];
    snprintf(text, sizeof text, "%s, %s", materials[a->material], mode);
    return text;
}

int main(int argc, char **argv)
{
    static app a = {.scene = -1};
    static const show_calls calls = {start, scatter, press, describe, &a};
    static show s = {.calls = &calls};
    const int headless = argc > 2 && strcmp(argv[argc - 2], "--headless") == 0, words = argc - 1 - 2 * headless;
    s.mesh = words == 1 ? argv[1] : NULL;
    if (words > 1 || (s.mesh && s.mesh[0] == '-'))
    {
        fprintf(stderr, "usage: bem [MESH.glb] [--headless OUT.png]\n");
        return 2;
    }
    const int status = headless ? show_strip(&s, argv[argc - 1]) : show_window(&s, "sss_bem");
    if (status != 0)
    {
        fprintf(stderr, "bem: %s\n", s.reason);
    }
    sss_bem_free(a.bem);
    show_close(&s);
    return status ? 2 : 0;
}
