// The tiny example of sss_dipole.h: loads a mesh, lets light travel inside it, shows it.
//     build/dipole MESH.glb [material] [size in mm]           a window: drag to turn, wheel to zoom, Escape to leave
//     build/dipole MESH.glb [material] [size in mm] --headless OUT.png
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"

#include "common/image.h"
#include "common/lights.h"
#include "common/model.h"
#include "common/shade.h"
#include "common/threads.h"

enum { SIDE = 960 }; // of the picture and the window, pixels

typedef struct scene
{
    model m;
    sss_profile profile;
    float *E, *B, *seen; // [V][3] irradiance and radiosity, [V][4] the share of the lights that a vertex sees
    char reason[1024];   // of the last failure
} scene;

static const lights sun = {.direction = {{-0.5, 0.6, -0.7}, {0.8, 0.5, 0.5}},
                           .color = {{3.0, 2.8, 2.5}, {0.3, 0.35, 0.4}}, .count = 2, .softness = 6.0,
                           .ambient = {0.12, 0.14, 0.17}};

static int fail(scene *s, const char *what, sss_result result)
{
    snprintf(s->reason, sizeof s->reason, "%s: %s", what, sss_result_string(result));
    return -1;
}

// The library at work: from a mesh, its size and a material to the radiosity at every vertex.
static int scatter(scene *s, const char *name, double size_mm)
{
    const size_t n = s->m.vertex_count;
    s->E = malloc(10 * n * sizeof *s->E);
    if (!s->E)
    {
        return fail(s, "mesh", SSS_ERROR_OUT_OF_MEMORY);
    }
    s->B = s->E + 3 * n;
    s->seen = s->B + 3 * n;
    sss_dipole_material medium;
    sss_result result = sss_dipole_material_by_name(name, &medium);
    if (result != SSS_OK || (result = sss_dipole_profile(&medium, SSS_DIPOLE_FRESNEL_EXACT, &s->profile)) != SSS_OK)
    {
        return fail(s, name, result);
    }
    if (lights_irradiance(&sun, &s->m, medium.eta, threads_available(), s->E, s->seen, s->reason,
                          sizeof s->reason) != 0)
    {
        return -1;
    }
    double low[3], high[3];
    const sss_mesh mesh = model_mesh(&s->m, size_mm / model_bounds(&s->m, low, high));
    const sss_hooks hooks = {.parallel_for = threads_hook};
    result = sss_dipole_shade(&mesh, &s->profile, s->E, NULL, &hooks, s->B);
    return result == SSS_OK ? 0 : fail(s, "scattering", result);
}

// The shaders' exit factor and tone mapping are the header's GLSL.
static int show(scene *s, gl_context *context, const char *png)
{
    static unsigned char rgb[3 * SIDE * SIDE];
    shade_view view = {.eye = {.azimuth = 20.0, .elevation = 8.0, .zoom = 1.0}, .roughness = 0.35,
                       .background = {{0.07, 0.075, 0.085}, {0.16, 0.175, 0.2}}};
    shade *const drawn = shade_create(context, &s->m, &sun, s->reason, sizeof s->reason);
    if (!drawn)
    {
        return -1;
    }
    camera_fit(&view.eye, s->m.positions, s->m.vertex_count, 1.0);
    view.exposure = shade_exposure(&s->m, &view.eye, s->B);
    shade_set_profile(drawn, &s->profile, SSS_DIPOLE_EXIT_PAPER);
    shade_set_radiosity(drawn, s->B, s->seen);
    for (gl_input input = {.width = SIDE, .height = SIDE}; !png && !input.close;)
    {
        shade_draw(drawn, &view, input.width, input.height);
        gl_context_present(context, &input);
        camera_orbit(&view.eye, input.drag_x, input.drag_y, input.scroll);
    }
    const int status = png ? shade_picture(drawn, &view, SIDE, SIDE, 3, rgb, s->reason, sizeof s->reason) : 0;
    shade_free(drawn);
    return png && status == 0 ? image_write_png(png, SIDE, SIDE, rgb, s->reason, sizeof s->reason) : status;
}

int main(int argc, char **argv)
{
    static scene s;
    const char *const png = argc > 3 && strcmp(argv[argc - 2], "--headless") == 0 ? argv[argc - 1] : NULL;
    const int words = png ? argc - 2 : argc;
    const double size_mm = words > 3 ? strtod(argv[3], NULL) : 40.0;
    if (words < 2 || words > 4 || !(size_mm > 0.0))
    {
        fprintf(stderr, "usage: dipole MESH.glb [material] [size in mm] [--headless OUT.png]\n");
        return 2;
    }
    gl_context *context = NULL;
    int status = model_load(argv[1], &s.m, s.reason, sizeof s.reason);
    status = status ? status : scatter(&s, words > 2 ? argv[2] : "marble", size_mm);
    if (status == 0)
    {
        context = png ? gl_context_create_headless(SIDE, SIDE, s.reason, sizeof s.reason)
                      : gl_context_create_window(SIDE, SIDE, "sss_dipole", s.reason, sizeof s.reason);
        status = context ? show(&s, context, png) : -1;
    }
    if (status != 0)
    {
        fprintf(stderr, "dipole: %s\n", s.reason);
    }
    gl_context_free(context);
    free(s.E);
    model_free(&s.m);
    return status ? 2 : 0;
}
