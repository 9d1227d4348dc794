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
    sss_dipole_material medium;
    sss_result result = s->E ? sss_dipole_material_by_name(name, &medium) : SSS_ERROR_OUT_OF_MEMORY;
    if (result != SSS_OK || (result = sss_dipole_profile(&medium, SSS_DIPOLE_FRESNEL_EXACT, &s->profile)) != SSS_OK)
    {
        return fail(s, name, result);
    }
    s->B = s->E + 3 * n;
    s->seen = s->B + 3 * n;
    if (lights_irradiance(&lights_studio, &s->m, medium.eta, threads_available(), s->E, s->seen, s->reason,
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
    shade_view view = shade_studio(&s->m, s->B, 1.0);
    shade *const drawn = shade_create(context, &s->m, &lights_studio, s->reason, sizeof s->reason);
    if (!drawn)
    {
        return -1;
    }
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
    const char *png = NULL, *words[4] = {NULL, "marble", "40", NULL}; // mesh, material, size in mm, and no more
    int count = 0;
    for (int i = 1; i < argc; ++i)
    {
        if (strcmp(argv[i], "--headless") == 0 && i + 1 < argc)
        {
            png = argv[++i];
        }
        else if (count < 4)
        {
            words[count++] = argv[i];
        }
    }
    const double size_mm = strtod(words[2], NULL);
    if (!words[0] || words[3] || !(size_mm > 0.0))
    {
        fprintf(stderr, "usage: dipole MESH.glb [material] [size in mm] [--headless OUT.png]\n");
        return 2;
    }
    gl_context *context = NULL;
    int status = model_load(words[0], &s.m, s.reason, sizeof s.reason);
    status = status ? status : scatter(&s, words[1], size_mm);
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
