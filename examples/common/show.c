#include "show.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image.h"
#include "offscreen.h"
#include "services.h"

enum
{
    SIDE = 900,               // of the window, pixels
    TILES = 5,                // pictures in a row of the strip,
    TILE = 216,               // their width,
    TILE_HIGH = 4 * TILE / 3, // and their height for scenes that stand upright
    SUPERSAMPLE = 3
};

enum
{
    MOVE,
    LIGHT,
    SCATTER,
    DRAW
};

static const char *const stage_names[SHOW_STAGES] = {"move", "irradiance", "scatter", "draw"};
static const double REPORT_MS = 1000.0; // how often a window's times are printed

// ---- one frame ----

static void lap(show *s, int stage, double *since)
{
    const double now = services_seconds();
    s->ms[stage] += 1e3 * (now - *since);
    *since = now;
}

// From the time to the radiosity at the vertices, on the graphics card.
static int step(show *s)
{
    double since = services_seconds();
    int status = s->held ? 0 : scene_move(&s->scene, s->shape_time);
    if (status != 0)
    {
        snprintf(s->reason, sizeof s->reason, "%s: deformed, it is no mesh any more", s->scene.name);
    }
    lap(s, MOVE, &since);
    status = status ? status : scene_light(&s->scene, s->time, s->lit, s->eta, s->E, s->reason, sizeof s->reason);
    lap(s, LIGHT, &since);
    status = status ? status : s->calls->scatter(s->calls->user, s, s->reason);
    lap(s, SCATTER, &since);
    glossy_set_vertices(s->drawn, &s->scene.now, s->B);
    ++s->frames;
    return status;
}

static void forget(show *s)
{
    memset(s->ms, 0, sizeof s->ms);
    s->frames = 0;
}

// What the frames since the last report took, once that was long enough.
static void report(show *s, double least_ms)
{
    static const char *const lit_names[] = {"first lamp", "second lamp", "both lamps"};
    double sum = 0.0;
    for (int i = 0; i < SHOW_STAGES; ++i)
    {
        sum += s->ms[i];
    }
    if (s->frames == 0 || sum < least_ms)
    {
        return;
    }
    printf("%s, %zu triangles, %.3g mm, %s, %s:", s->scene.name, s->scene.now.triangle_count, s->scene.size_mm,
           lit_names[s->lit - 1], s->calls->describe(s->calls->user, s));
    for (int i = 0; i < SHOW_STAGES; ++i)
    {
        printf(" %s %.1f,", stage_names[i], s->ms[i] / s->frames);
    }
    printf(" in all %.1f ms a frame\n", sum / s->frames);
    fflush(stdout);
    forget(s);
}

// ---- scenes and keys ----

static void close_scene(show *s)
{
    glossy_free(s->drawn);
    scene_close(&s->scene);
    free(s->E);
    s->drawn = NULL;
    s->E = NULL;
}

static int open_scene(show *s, int index)
{
    close_scene(s);
    if (scene_open(index, s->mesh, &s->scene, s->reason, sizeof s->reason) != 0)
    {
        return -1;
    }
    const size_t n = s->scene.now.vertex_count;
    const glossy_view view = {.eye = {.azimuth = 25.0, .elevation = s->scene.elevation, .zoom = s->scene.zoom},
                              .exposure = 1.0, .studio = 1.5, .background = {{0.05, 0.05, 0.06}, {0.10, 0.11, 0.13}}};
    s->view = view;
    s->time = s->shape_time = 0.0;
    s->held = 0;
    s->lit = 3;
    s->E = calloc(6 * n, sizeof *s->E);
    if (!s->E)
    {
        snprintf(s->reason, sizeof s->reason, "out of memory");
        return -1;
    }
    s->B = s->E + 3 * n;
    camera_fit(&s->view.eye, s->scene.rest.positions, n, 1.0);
    s->drawn = glossy_create(s->context, &s->scene.rest, s->reason, sizeof s->reason);
    return s->drawn ? s->calls->start(s->calls->user, s, s->reason) : -1;
}

static int obey(show *s, int key)
{
    switch (key)
    {
    case ' ':
        return open_scene(s, (s->scene.index + 1) % SCENES);
    case 'L':
        s->lit = s->lit % 3 + 1;
        return 0;
    case 'H':
        s->held = !s->held;
        return 0;
    case '=': // where + is
    case '-':
        s->scene.size_mm *= key == '-' ? 0.8 : 1.25;
        return s->calls->start(s->calls->user, s, s->reason);
    default:
        return s->calls->key(s->calls->user, s, key, s->reason);
    }
}

// ---- window ----

int show_window(show *s, const char *title)
{
    s->context = gl_context_create_window(SIDE, SIDE, title, s->reason, sizeof s->reason);
    double since = services_seconds();
    int status = s->context ? open_scene(s, 0) : -1;
    for (gl_input input = {.width = SIDE, .height = SIDE}; status == 0 && !input.close;)
    {
        const double now = services_seconds();
        s->time += now - since;
        s->shape_time += s->held ? 0.0 : now - since;
        since = now;
        status = step(s);
        double drawing = services_seconds();
        glossy_draw(s->drawn, &s->view, input.width, input.height);
        gl_context_present(s->context, &input);
        lap(s, DRAW, &drawing);
        camera_orbit(&s->view.eye, input.drag_x, input.drag_y, input.scroll);
        report(s, REPORT_MS);
        if (input.key && status == 0)
        {
            forget(s); // times of before
            status = obey(s, input.key);
        }
    }
    return status;
}

// ---- strip ----

static void draw_tile(void *user, int width, int height)
{
    const show *const s = user;
    glossy_draw(s->drawn, &s->view, width, height);
}

// The frames of a row, after one that is not counted: it may have to prepare.   rgb  [height][TILES TILE][3] or NULL
static int run_row(show *s, int height, unsigned char *rgb)
{
    static unsigned char tile[3 * TILE * TILE_HIGH];
    const offscreen_size size = {TILE, height, SUPERSAMPLE};
    int status = step(s);
    forget(s);
    for (int i = 0; i < TILES && status == 0; ++i)
    {
        s->time = s->scene.step * i;
        s->shape_time = s->held ? s->shape_time : s->time;
        status = step(s);
        double since = services_seconds();
        if (rgb && status == 0)
        {
            status = offscreen_draw(s->context, &size, draw_tile, s, tile, s->reason, sizeof s->reason);
        }
        lap(s, DRAW, &since);
        for (int y = 0; y < height && rgb; ++y)
        {
            memcpy(rgb + 3 * ((size_t)y * TILES + (size_t)i) * TILE, tile + 3 * (size_t)y * TILE, 3 * TILE);
        }
    }
    report(s, 0.0);
    return status;
}

int show_strip(show *s, const char *png)
{
    static unsigned char rgb[3 * TILES * TILE * SCENES * TILE_HIGH];
    s->context = gl_context_create_headless(16, 16, s->reason, sizeof s->reason);
    int status = s->context ? 0 : -1, rows = 0;
    for (int i = 0; i < SCENES && status == 0; ++i)
    {
        const int height = i == 0 ? TILE_HIGH : TILE;
        status = open_scene(s, i);
        status = status ? status : run_row(s, height, rgb + 3 * TILES * TILE * rows);
        rows += height;
        status = status ? status : obey(s, 'I');
        status = status ? status : run_row(s, height, NULL);
        s->held = 1;
        status = status ? status : run_row(s, height, NULL);
        s->held = 0;
        status = status ? status : obey(s, 'I');
        status = status ? status : run_row(s, height, NULL);
        status = status ? status : obey(s, 'I');
    }
    return status ? status : image_write_png(png, TILES * TILE, rows, rgb, s->reason, sizeof s->reason);
}

void show_close(show *s)
{
    if (s->context)
    {
        close_scene(s);
        gl_context_free(s->context);
        s->context = NULL;
    }
}
