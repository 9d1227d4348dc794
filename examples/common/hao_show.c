#include "hao_show.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image.h"
#include "offscreen.h"
#include "services.h"
#include "shade.h"

enum
{
    WINDOW_WIDTH = 1020,
    WINDOW_HEIGHT = 880,
    STRIP_WIDTH = 1280,
    PLACES = 3,  // of the light in the strip
    REPEATS = 5, // relighting is timed so often there
    SUPERSAMPLE = 3
};

static const double PI = 3.14159265358979323846;
static const double AZIMUTH = 20.0, ELEVATION = 8.0; // of the camera, degrees
static const double HEIGHT = 25.0;   // of the light above the horizon, degrees
static const double TURN = 40.0;     // of the light, degrees a second
static const double PLACE[PLACES] = {50.0, 130.0, 215.0}; // degrees from the camera, to its right
static const double ADAPTED = 0.4;   // how far the exposure follows the light, 1: all the way
static const double SMOOTHING = 0.1; // share of the newest frame in the times that a window shows
static const double REPORT_S = 1.0;  // how often they are printed

static void place_light(hao_show *s, double degrees)
{
    const double phi = degrees * PI / 180.0, theta = HEIGHT * PI / 180.0;
    s->look.to_light[0] = cos(theta) * sin(phi);
    s->look.to_light[1] = sin(theta);
    s->look.to_light[2] = cos(theta) * cos(phi);
}

static int relight(hao_show *s)
{
    const int status = s->relight(s->user, s);
    const double own = status == 0 ? shade_exposure(&s->m, &s->look.eye, s->brightness) : 1.0;
    s->first_exposure = s->first_exposure > 0.0 ? s->first_exposure : own;
    s->look.exposure = s->first_exposure * pow(own / s->first_exposure, ADAPTED);
    return status;
}

static int open_view(hao_show *s, gl_context *context)
{
    s->look.eye.azimuth = AZIMUTH;
    s->look.eye.elevation = ELEVATION;
    s->look.eye.zoom = 1.0;
    camera_fit(&s->look.eye, s->m.positions, s->m.vertex_count, 1.0);
    s->view = hao_view_create(context, &s->m, &s->profile, s->reason, sizeof s->reason);
    return s->view ? hao_view_set_object(s->view, s->object, s->reason, sizeof s->reason) : -1;
}

static void draw(void *user, int width, int height)
{
    const hao_show *const s = user;
    hao_view_draw(s->view, &s->look, width, height);
}

static void report(const hao_show *s)
{
    const double *const ms = s->look.ms, *const error = s->look.error;
    printf("relit: uncompressed %.2f, harmonics %.2f (%.2g %% off), reference points %.2f ms%s", ms[0], ms[1],
           100.0 * error[1], ms[2], s->by_shader ? " and the vertex shader\n" : "");
    if (!s->by_shader)
    {
        printf(" (%.2g %% off)\n", 100.0 * error[2]);
    }
    fflush(stdout);
}

// ---- window ----

// One frame; the times shown change slowly, so that they can be read.
static int step(hao_show *s, double degrees, int first)
{
    double before[HAO_VIEWS];
    memcpy(before, s->look.ms, sizeof before);
    place_light(s, degrees);
    const int status = relight(s);
    for (int i = 0; i < HAO_VIEWS && !first; ++i)
    {
        s->look.ms[i] = before[i] + SMOOTHING * (s->look.ms[i] - before[i]);
    }
    return status;
}

static int run_window(hao_show *s, gl_context *context)
{
    int status = open_view(s, context), held = 0, fresh = 1;
    double degrees = AZIMUTH + PLACE[0], since = services_seconds(), said = since;
    for (gl_input input = {.width = WINDOW_WIDTH, .height = WINDOW_HEIGHT}; status == 0 && !input.close;)
    {
        const double now = services_seconds();
        degrees += held ? 0.0 : TURN * (now - since);
        since = now;
        status = step(s, degrees, fresh);
        fresh = 0;
        draw(s, input.width, input.height);
        gl_context_present(context, &input);
        camera_orbit(&s->look.eye, input.drag_x, input.drag_y, input.scroll);
        if (input.key == 'G')
        {
            s->by_shader = !s->by_shader;
            fresh = 1;
        }
        held = held != (input.key == 'H');
        if (now - said > REPORT_S)
        {
            report(s);
            said = now;
        }
    }
    return status;
}

// ---- strip ----

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Medians of relighting, behind a first time that is not counted: caches are cold.
static int relight_timed(hao_show *s)
{
    double ms[HAO_VIEWS][REPEATS];
    int status = relight(s);
    for (int i = 0; i < REPEATS && status == 0; ++i)
    {
        status = relight(s);
        for (int view = 0; view < HAO_VIEWS; ++view)
        {
            ms[view][i] = s->look.ms[view];
        }
    }
    for (int view = 0; view < HAO_VIEWS && status == 0; ++view)
    {
        qsort(ms[view], REPEATS, sizeof ms[view][0], ascending);
        s->look.ms[view] = ms[view][REPEATS / 2];
    }
    return status;
}

static int run_strip(hao_show *s, gl_context *context, const char *png)
{
    const offscreen_size size = {STRIP_WIDTH, hao_view_height(STRIP_WIDTH), SUPERSAMPLE};
    const size_t bytes = 3 * (size_t)size.width * (size_t)size.height;
    unsigned char *const rgb = malloc(PLACES * bytes);
    int status = rgb ? open_view(s, context) : -1;
    for (int i = 0; i < PLACES && status == 0; ++i)
    {
        place_light(s, AZIMUTH + PLACE[i]);
        status = relight_timed(s);
        if (status == 0)
        {
            report(s);
            status = offscreen_draw(context, &size, draw, s, rgb + (size_t)i * bytes, s->reason, sizeof s->reason);
        }
    }
    if (status == 0)
    {
        status = image_write_png(png, size.width, PLACES * size.height, rgb, s->reason, sizeof s->reason);
    }
    free(rgb);
    return status;
}

// ---- the program ----

typedef struct words
{
    const char *mesh, *material, *png; // png: NULL for a window
    double size_mm;
} words;

static int parse(hao_show *s, words *w, int argc, char **argv)
{
    for (int i = 1; i < argc; ++i)
    {
        const char *const word = argv[i], *const value = word[0] == '-' && i + 1 < argc ? argv[++i] : NULL;
        const char **const text = !value && word[0] != '-' ? &w->mesh
                                  : strcmp(word, "--headless") == 0 ? &w->png
                                  : strcmp(word, "--material") == 0 ? &w->material : NULL;
        if (!value && word[0] == '-')
        {
            return -1;
        }
        if (text)
        {
            *text = value ? value : word;
        }
        else if (strcmp(word, "--size-mm") == 0)
        {
            w->size_mm = strtod(value, NULL);
        }
        else if (strcmp(word, "--glsl") == 0 && (strcmp(value, "0") == 0 || strcmp(value, "1") == 0))
        {
            s->by_shader = value[0] == '1';
        }
        else
        {
            return -1;
        }
    }
    return w->size_mm > 0.0 && isfinite(w->size_mm) ? 0 : -1;
}

static int load(hao_show *s, const words *w)
{
    double low[3], high[3];
    sss_dipole_material medium;
    if (model_load(w->mesh, &s->m, s->reason, sizeof s->reason) != 0)
    {
        return -1;
    }
    s->mesh = model_mesh(&s->m, w->size_mm / model_bounds(&s->m, low, high));
    sss_result result = sss_dipole_material_by_name(w->material, &medium);
    result = result == SSS_OK ? sss_dipole_profile(&medium, SSS_DIPOLE_FRESNEL_EXACT, &s->profile) : result;
    snprintf(s->reason, sizeof s->reason, "material %s: %s", w->material, sss_result_string(result));
    snprintf(s->look.heading[0], sizeof s->look.heading[0], "%zu vertices, %s, %g mm", s->m.vertex_count, w->material,
             w->size_mm);
    snprintf(s->look.heading[2], sizeof s->look.heading[2], "G: by the vertex shader");
    snprintf(s->look.heading[3], sizeof s->look.heading[3], "H: the light stays");
    snprintf(s->look.heading[4], sizeof s->look.heading[4], "drag, wheel: turn, zoom");
    return result == SSS_OK ? 0 : -1;
}

int hao_show_run(hao_show *s, const char *name, int argc, char **argv)
{
    words w = {.mesh = "build/models/bunny.glb", .material = "skimmilk", .size_mm = 25.0};
    if (parse(s, &w, argc, argv) != 0)
    {
        fprintf(stderr, "usage: %s [MESH.glb] [--material NAME] [--size-mm S] [--glsl 0|1] [--headless OUT.png]\n",
                name);
        return 2;
    }
    int status = load(s, &w);
    gl_context *context = NULL;
    if (status == 0) // before the work, so that a display that is not there is found at once
    {
        context = w.png ? gl_context_create_headless(16, 16, s->reason, sizeof s->reason)
                        : gl_context_create_window(WINDOW_WIDTH, WINDOW_HEIGHT, name, s->reason, sizeof s->reason);
        status = context ? s->start(s->user, s) : -1;
    }
    if (status == 0)
    {
        status = w.png ? run_strip(s, context, w.png) : run_window(s, context);
    }
    if (status != 0)
    {
        fprintf(stderr, "%s: %s\n", name, s->reason);
    }
    hao_view_free(s->view);
    gl_context_free(context);
    model_free(&s->m);
    return status ? 2 : 0;
}
