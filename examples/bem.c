// The tiny example of sss_bem.h: translucent objects that deform, every frame from scratch. A candle twists round its
// flame; a cube, or your own mesh, ripples under a spot light (Mertens et al. 2003, figures 6.6 and 6.7).
//     build/bem [MESH.glb]                       a window: space other scene, L lights, M material, + - size, H hold
//                                                the shape, I incremental, drag to turn, Escape to leave
//     build/bem [MESH.glb] --headless OUT.png    a strip of pictures, and what every stage takes in three modes
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../sss_bem.h"

#include "common/glossy.h"
#include "common/image.h"
#include "common/methods.h"
#include "common/offscreen.h"
#include "common/scenes.h"
#include "common/threads.h"

enum { SIDE = 900, TILES = 5, TILE = 216, TILE_HIGH = 4 * TILE / 3 }; // of the window, and of pictures in the strip
enum { MOVE, LIGHT, SCATTER, DRAW, STAGES };
static const char *const stage_names[STAGES] = {"move", "irradiance", "scatter", "draw"};
static const char *const materials[] = {"candle wax", "skimmilk", "marble", "wholemilk", "skin1", "ketchup"};
enum { MATERIALS = sizeof materials / sizeof materials[0] };
static const double REPORT_MS = 1000.0; // how often a window's times are printed

typedef struct app
{
    gl_context *context;
    const char *mesh, *png;           // of the command line
    scene s;
    double time, shape_time;          // s; the shape may be held while the lights go on
    int material, lit, incremental, held;
    sss_profile profile;
    sss_bem *bem;
    float *E, *B;                     // [V][3] irradiance and radiosity
    glossy *drawn;
    glossy_view view;
    double ms[STAGES];                // since the last report,
    int frames;                       // in so many frames
    char reason[1024];                // of the last failure
} app;

static int fail(app *a, const char *what, sss_result result)
{
    snprintf(a->reason, sizeof a->reason, "%s: %s", what, sss_result_string(result));
    return -1;
}

// ---- the library at work ----

// A new material keeps the hierarchy.
static int take_material(app *a)
{
    static const double albedo[3] = {0.92, 0.80, 0.58}, mean_free_path[3] = {2.2, 1.9, 1.5}; // wax, by eye; mm
    const char *const name = materials[a->material];
    sss_dipole_material medium;
    sss_result result = a->material == 0 ? sss_dipole_material_from_albedo(albedo, mean_free_path, 1.43, &medium)
                                         : sss_dipole_material_by_name(name, &medium);
    result = result == SSS_OK ? sss_dipole_profile(&medium, SSS_DIPOLE_FRESNEL_EXACT, &a->profile) : result;
    result = result == SSS_OK && a->bem ? sss_bem_set_profile(a->bem, &a->profile) : result;
    return result == SSS_OK && glossy_set_profile(a->drawn, &a->profile) == 0 ? 0 : fail(a, name, result);
}

// A new size needs a new one.
static int make_hierarchy(app *a)
{
    const sss_mesh mesh = model_mesh(&a->s.now, a->s.size_mm / a->s.extent);
    const sss_hooks hooks = {.parallel_for = threads_hook};
    sss_bem_free(a->bem);
    a->bem = NULL;
    const sss_result result = sss_bem_create(&mesh, &a->profile, NULL, &hooks, &a->bem);
    return result == SSS_OK ? 0 : fail(a, "hierarchy", result);
}

// From the shape and its irradiance to radiosity: on the fly, or by links that are kept and brought up to date.
static int scatter(app *a)
{
    sss_result result = sss_bem_set_irradiance(a->bem, SSS_BEM_VERTICES, a->E);
    result = result == SSS_OK && !a->held ? sss_bem_set_vertices(a->bem, a->s.now.positions, a->s.now.normals) : result;
    if (a->incremental)
    {
        result = result == SSS_OK ? sss_bem_update(a->bem, 0, NULL) : result;
        result = result == SSS_OK ? sss_bem_render(a->bem, a->B) : result;
    }
    else
    {
        result = result == SSS_OK ? sss_bem_shade(a->bem, a->B) : result;
    }
    return result == SSS_OK ? 0 : fail(a, "scattering", result);
}

static void lap(app *a, int stage, double *since)
{
    const double now = method_seconds();
    a->ms[stage] += 1e3 * (now - *since);
    *since = now;
}

// One frame, from the time to the radiosity at the vertices.
static int step(app *a)
{
    double since = method_seconds();
    int status = a->held || scene_move(&a->s, a->shape_time) == 0 ? 0 : fail(a, "normals", SSS_ERROR_INVALID_ARGUMENT);
    lap(a, MOVE, &since);
    status = status ? status : scene_light(&a->s, a->time, a->lit, a->profile.eta, a->E, a->reason, sizeof a->reason);
    lap(a, LIGHT, &since);
    status = status ? status : scatter(a);
    lap(a, SCATTER, &since);
    glossy_set_vertices(a->drawn, &a->s.now, a->B);
    ++a->frames;
    return status;
}

// ---- scenes, keys, times ----

static void close_scene(app *a)
{
    sss_bem_free(a->bem);
    glossy_free(a->drawn);
    scene_close(&a->s);
    free(a->E);
    a->bem = NULL;
    a->drawn = NULL;
    a->E = NULL;
}

static int open_scene(app *a, int index)
{
    close_scene(a);
    if (scene_open(index, a->mesh, &a->s, a->reason, sizeof a->reason) != 0)
    {
        return -1;
    }
    const size_t n = a->s.now.vertex_count;
    const glossy_view view = {.eye = {.azimuth = 25.0, .elevation = a->s.elevation, .zoom = a->s.zoom},
                              .exposure = 1.0, .studio = 1.5, .background = {{0.05, 0.05, 0.06}, {0.10, 0.11, 0.13}}};
    a->view = view;
    a->time = a->shape_time = 0.0;
    a->held = 0;
    a->material = index; // the candle is of wax, the cube of skim milk
    a->E = calloc(6 * n, sizeof *a->E);
    if (!a->E)
    {
        return fail(a, a->s.name, SSS_ERROR_OUT_OF_MEMORY);
    }
    a->B = a->E + 3 * n;
    camera_fit(&a->view.eye, a->s.rest.positions, n, 1.0);
    a->drawn = glossy_create(a->context, &a->s.rest, a->reason, sizeof a->reason);
    return a->drawn && take_material(a) == 0 ? make_hierarchy(a) : -1;
}

static int obey(app *a, int key)
{
    switch (key)
    {
    case ' ': return open_scene(a, (a->s.index + 1) % SCENES);
    case 'L': a->lit = a->lit % 3 + 1; break;
    case 'I': a->incremental = !a->incremental; break;
    case 'H': a->held = !a->held; break;
    case 'M': a->material = (a->material + 1) % MATERIALS; return take_material(a);
    case '=': a->s.size_mm *= 1.25; return make_hierarchy(a);
    case '-': a->s.size_mm /= 1.25; return make_hierarchy(a);
    default: break;
    }
    return 0;
}

static void forget(app *a)
{
    memset(a->ms, 0, sizeof a->ms);
    a->frames = 0;
}

// What the frames since the last report took, once that was long enough.
static void report(app *a, double least_ms)
{
    static const char *const lit_names[] = {"first lamp", "second lamp", "both lamps"};
    static const char *const mode_names[] = {"on the fly", "incremental", "render"};
    double sum = 0.0;
    for (int i = 0; i < STAGES; ++i)
    {
        sum += a->ms[i];
    }
    if (a->frames == 0 || sum < least_ms)
    {
        return;
    }
    printf("%s, %zu triangles, %s, %.3g mm, %s, %s:", a->s.name, a->s.now.triangle_count, materials[a->material],
           a->s.size_mm, lit_names[a->lit - 1], mode_names[a->incremental + (a->incremental && a->held)]);
    for (int i = 0; i < STAGES; ++i)
    {
        printf(" %s %.1f,", stage_names[i], a->ms[i] / a->frames);
    }
    printf(" in all %.1f ms a frame\n", sum / a->frames);
    fflush(stdout);
    forget(a);
}

// ---- window and strip ----

static int run_window(app *a)
{
    double since = method_seconds();
    int status = open_scene(a, 0);
    for (gl_input input = {.width = SIDE, .height = SIDE}; status == 0 && !input.close;)
    {
        const double now = method_seconds();
        a->time += now - since;
        a->shape_time += a->held ? 0.0 : now - since;
        since = now;
        status = step(a);
        double drawing = method_seconds();
        glossy_draw(a->drawn, &a->view, input.width, input.height);
        gl_context_present(a->context, &input);
        lap(a, DRAW, &drawing);
        camera_orbit(&a->view.eye, input.drag_x, input.drag_y, input.scroll);
        report(a, REPORT_MS);
        if (input.key && status == 0)
        {
            forget(a); // times of before
            status = obey(a, input.key);
        }
    }
    return status;
}

static void draw_tile(void *user, int width, int height)
{
    const app *const a = user;
    glossy_draw(a->drawn, &a->view, width, height);
}

// The frames of a row, after one that is not counted: it may have to make links.   rgb  [height][TILES TILE][3] or NULL
static int run_row(app *a, int height, unsigned char *rgb)
{
    static unsigned char tile[3 * TILE * TILE_HIGH];
    const offscreen_size size = {TILE, height, 3};
    int status = step(a);
    forget(a);
    for (int i = 0; i < TILES && status == 0; ++i)
    {
        a->time = a->s.step * i;
        a->shape_time = a->held ? a->shape_time : a->time;
        status = step(a);
        double since = method_seconds();
        if (rgb && status == 0)
        {
            status = offscreen_draw(a->context, &size, draw_tile, a, tile, a->reason, sizeof a->reason);
        }
        lap(a, DRAW, &since);
        for (int y = 0; y < height && rgb; ++y)
        {
            memcpy(rgb + 3 * ((size_t)y * TILES + (size_t)i) * TILE, tile + 3 * (size_t)y * TILE, 3 * TILE);
        }
    }
    report(a, 0.0);
    return status;
}

// Pictures on the fly; then the same frames in incremental mode, then with the shape held, for what they take.
static int write_strip(app *a)
{
    static unsigned char rgb[3 * TILES * TILE * SCENES * TILE_HIGH];
    int status = 0, rows = 0;
    for (int i = 0; i < SCENES && status == 0; ++i)
    {
        const int height = i == 0 ? TILE_HIGH : TILE;
        status = open_scene(a, i);
        for (int mode = 0; mode < 3 && status == 0; ++mode)
        {
            a->incremental = mode > 0;
            a->held = mode > 1;
            status = run_row(a, height, mode == 0 ? rgb + 3 * TILES * TILE * rows : NULL);
        }
        rows += height;
    }
    return status ? status : image_write_png(a->png, TILES * TILE, rows, rgb, a->reason, sizeof a->reason);
}

int main(int argc, char **argv)
{
    static app a = {.lit = 3}; // bit 0: the first lamp, bit 1: the second
    int wrong = 0;
    for (int i = 1; i < argc; ++i)
    {
        if (strcmp(argv[i], "--headless") == 0 && i + 1 < argc)
        {
            a.png = argv[++i];
        }
        else
        {
            wrong |= a.mesh != NULL || argv[i][0] == '-';
            a.mesh = argv[i];
        }
    }
    if (wrong)
    {
        fprintf(stderr, "usage: bem [MESH.glb] [--headless OUT.png]\n");
        return 2;
    }
    a.context = a.png ? gl_context_create_headless(16, 16, a.reason, sizeof a.reason)
                      : gl_context_create_window(SIDE, SIDE, "sss_bem", a.reason, sizeof a.reason);
    const int status = !a.context ? -1 : a.png ? write_strip(&a) : run_window(&a);
    if (status != 0)
    {
        fprintf(stderr, "bem: %s\n", a.reason);
    }
    close_scene(&a);
    gl_context_free(a.context);
    return status ? 2 : 0;
}
