// The tiny example of sss_atlas.h: cuts a mesh into charts, lays them into one square, and shows both side by side,
// with a checker of texels and with the stretch as colours.
//     build/atlas [MESH.glb] [--method orthographic|area|convex] [--size TEXELS]     a window: M other method,
//                                                             drag to turn, wheel to zoom, Escape to leave
//     build/atlas [MESH.glb] [...] --headless OUT.png
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define SSS_DIPOLE_IMPLEMENTATION // for normals where a file has none
#include "../sss_dipole.h"
#define SSS_ATLAS_IMPLEMENTATION
#include "../sss_atlas.h"

#include "common/atlas_report.h"
#include "common/atlas_view.h"
#include "common/offscreen.h"
#include "common/threads.h"

enum { LEAST = 64, MOST = 8192, WIDTH = 1600, SIDE = 920, SUPERSAMPLE = 3 }; // LEAST to MOST: texels on a side

typedef struct app
{
    model m;
    sss_atlas_options options;
    const char *mesh, *png; // files; png: NULL for a window
    atlas_view *view;
    camera eye;
    char reason[1024]; // of the last failure
} app;

// The library at work: an atlas of the mesh, reported and shown.
static int make_atlas(app *a)
{
    double low[3], high[3];
    const sss_mesh mesh = model_mesh(&a->m, 40.0 / model_bounds(&a->m, low, high)); // as if 40 mm large
    const sss_hooks hooks = {.parallel_for = threads_hook};
    sss_atlas *atlas = NULL;
    const clock_t start = clock();
    const sss_result result = sss_atlas_create(&mesh, &a->options, &hooks, &atlas);
    const double seconds = (double)(clock() - start) / CLOCKS_PER_SEC; // of all threads together
    if (result != SSS_OK)
    {
        snprintf(a->reason, sizeof a->reason, "%zu texels on a side: %s", a->options.size, sss_result_string(result));
        return -1;
    }
    printf("atlas_core_s=%.3f\n", seconds);
    atlas_report(atlas);
    const int status = atlas_view_set(a->view, &a->m, atlas, a->reason, sizeof a->reason);
    sss_atlas_free(atlas); // the view has made textures of it
    return status;
}

static void draw(void *user, int width, int height)
{
    const app *const a = user;
    atlas_view_draw(a->view, &a->eye, width, height);
}

static int show(app *a, gl_context *context)
{
    static const sss_atlas_method next[] = {SSS_ATLAS_AREA, SSS_ATLAS_CONVEX, SSS_ATLAS_ORTHOGRAPHIC};
    const offscreen_size strip = {WIDTH, atlas_view_height(WIDTH), SUPERSAMPLE};
    camera_fit(&a->eye, a->m.positions, a->m.vertex_count, 1.0);
    a->view = atlas_view_create(context, a->reason, sizeof a->reason);
    int status = a->view ? make_atlas(a) : -1;
    for (gl_input input = {.width = SIDE, .height = SIDE}; !a->png && status == 0 && !input.close;)
    {
        draw(a, input.width, input.height);
        gl_context_present(context, &input);
        camera_orbit(&a->eye, input.drag_x, input.drag_y, input.scroll);
        if (input.key == 'M')
        {
            a->options.method = next[a->options.method];
            status = make_atlas(a);
        }
    }
    return a->png && status == 0 ? offscreen_write_png(context, &strip, draw, a, a->png, a->reason, sizeof a->reason)
                                 : status;
}

// Returns 0, or -1 where the command line is wrong.
static int parse(app *a, int argc, char **argv)
{
    for (int i = 1; i < argc; ++i)
    {
        const char *const word = argv[i], *const value = word[0] == '-' && i + 1 < argc ? argv[++i] : NULL;
        if (!value && word[0] == '-') return -1;
        if (!value) a->mesh = word;
        else if (strcmp(word, "--headless") == 0) a->png = value;
        else if (strcmp(word, "--size") == 0) a->options.size = (size_t)strtoul(value, NULL, 10);
        else if (strcmp(word, "--method") != 0 || atlas_method_by_name(value, &a->options.method) != 0) return -1;
    }
    return a->options.size >= LEAST && a->options.size <= MOST ? 0 : -1;
}

int main(int argc, char **argv)
{
    static app a = {.mesh = "build/models/bunny.glb", .options = {.size = 1024}, .eye = {20.0, 10.0, 1.0}};
    if (parse(&a, argc, argv) != 0)
    {
        fputs("usage: atlas [MESH.glb] [--method orthographic|area|convex] [--size 64..8192] [--headless PNG]\n",
              stderr);
        return 2;
    }
    gl_context *context = NULL;
    int status = model_load(a.mesh, &a.m, a.reason, sizeof a.reason);
    if (status == 0)
    {
        context = a.png ? gl_context_create_headless(16, 16, a.reason, sizeof a.reason)
                        : gl_context_create_window(SIDE, SIDE, "sss_atlas", a.reason, sizeof a.reason);
        status = context ? show(&a, context) : -1;
    }
    if (status != 0) fprintf(stderr, "atlas: %s\n", a.reason);
    atlas_view_free(a.view);
    gl_context_free(context);
    model_free(&a.m);
    return status ? 2 : 0;
}
