#include "scenes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "shadow.h"
#include "shapes.h"
#include "threads.h"

enum
{
    LAMPS = 2,
    SAMPLES = 16 // rays from a vertex to a soft lamp
};

typedef struct lamp
{
    sss_dipole_light light;
    double radius; // of the disc that throws its soft shadow, mesh units; 0: it throws none
} lamp;

// ---- the candle ----

// Wrung and released every ten seconds.
static void move_candle(const model *rest, double t, float *positions)
{
    const double wrung = 0.5 - 0.5 * cos(0.6 * t);
    shape_twist(rest->positions, rest->vertex_count, 1.0, 0.5 * wrung, 0.42 * wrung, positions);
}

// A flame that flickers and wanders inside, which sees only what it lights; a cool lamp outside. Colours in W/sr.
static void light_candle(double t, lamp out[LAMPS])
{
    const double flicker = 1.0 + 0.10 * sin(9.0 * t) + 0.06 * sin(23.0 * t + 1.0);
    const sss_dipole_light inside = {.kind = SSS_DIPOLE_LIGHT_POINT,
                                     .color = {1.7e3 * flicker, 1.05e3 * flicker, 0.5e3 * flicker},
                                     .position = {0.05 * cos(1.3 * t), SHAPES_WICK + 0.06 * sin(0.9 * t),
                                                  0.05 * sin(1.3 * t)}};
    const sss_dipole_light outside = {.kind = SSS_DIPOLE_LIGHT_POINT, .color = {1.3e4, 1.7e4, 2.3e4},
                                      .position = {-1.6, 1.5, 0.9}};
    out[0] = (lamp){inside, 0.0};
    out[1] = (lamp){outside, 0.2};
}

// ---- the cube, or a mesh ----

static void move_cube(const model *rest, double t, float *positions)
{
    const double offset[3] = {0.31 * t, 0.17 * t, 0.5};
    shape_noise(rest->positions, rest->normals, rest->vertex_count, 0.32, 0.65, offset, positions);
}

static void move_mesh(const model *rest, double t, float *positions) // gently: it may have thin parts
{
    const double offset[3] = {0.31 * t, 0.17 * t, 0.5};
    shape_noise(rest->positions, rest->normals, rest->vertex_count, 0.12, 0.5, offset, positions);
}

// A spot light that goes round, and a lamp behind.
static void light_cube(double t, lamp out[LAMPS])
{
    const double x = 2.4 * sin(0.4 * t - 0.9), z = 2.4 * cos(0.4 * t - 0.9);
    const sss_dipole_light spot = {.kind = SSS_DIPOLE_LIGHT_SPOT, .color = {3.2e4, 3.2e4, 3.2e4},
                                   .position = {x, 3.4, z}, .direction = {-x, -3.4, -z}, .cos_inner = 0.985,
                                   .cos_outer = 0.96};
    const sss_dipole_light behind = {.kind = SSS_DIPOLE_LIGHT_POINT, .color = {4.5e4, 4.5e4, 4.5e4},
                                     .position = {0.6, 0.4, -3.4}};
    out[0] = (lamp){spot, 0.15};
    out[1] = (lamp){behind, 0.3};
}

// A mesh of the user's takes the cube's place and size.
static int load_mesh(const char *path, model *out, char *error_text, size_t error_size)
{
    double low[3], high[3];
    const int status = model_load(path, out, error_text, error_size);
    const double extent = status == 0 ? model_bounds(out, low, high) : 0.0;
    for (size_t i = 0; i < 3 * out->vertex_count && extent > 0.0; ++i)
    {
        const double middle = 0.5 * (low[i % 3] + high[i % 3]);
        out->positions[i] = (float)(2.0 * ((double)out->positions[i] - middle) / extent);
    }
    return status;
}

// ---- both ----

static int copy_model(const model *from, model *to)
{
    const size_t n = 3 * from->vertex_count * sizeof *to->positions;
    const size_t t = 3 * from->triangle_count * sizeof *to->triangles;
    *to = *from;
    to->positions = malloc(n);
    to->normals = malloc(n);
    to->triangles = malloc(t);
    if (!to->positions || !to->normals || !to->triangles)
    {
        return -1;
    }
    memcpy(to->positions, from->positions, n);
    memcpy(to->normals, from->normals, n);
    memcpy(to->triangles, from->triangles, t);
    return 0;
}

int scene_open(int index, const char *mesh, scene *out, char *error_text, size_t error_size)
{
    static const scene kinds[SCENES] = {
        {.name = "candle", .extent = 1.0, .size_mm = 100.0, .step = 1.3, .elevation = 24.0, .zoom = 0.95},
        {.name = "cube", .extent = 2.0, .size_mm = 40.0, .step = 0.8, .elevation = 24.0, .zoom = 0.88}};
    *out = kinds[index];
    out->index = index;
    int status;
    snprintf(error_text, error_size, "out of memory");
    if (index == 0)
    {
        status = shape_candle(52, 48, &out->rest);
    }
    else
    {
        status = mesh ? load_mesh(mesh, &out->rest, error_text, error_size) : shape_cube(37, &out->rest);
        out->name = mesh ? mesh : out->name;
        out->own_mesh = mesh != NULL;
    }
    if (status == 0)
    {
        status = copy_model(&out->rest, &out->now);
        out->visible = malloc(LAMPS * out->rest.vertex_count * sizeof *out->visible);
    }
    if (status != 0 || !out->visible)
    {
        scene_close(out);
        return -1;
    }
    return 0;
}

void scene_close(scene *s)
{
    model_free(&s->rest);
    model_free(&s->now);
    free(s->visible);
    memset(s, 0, sizeof *s);
}

int scene_move(scene *s, double t)
{
    (s->index == 0 ? move_candle : s->own_mesh ? move_mesh : move_cube)(&s->rest, t, s->now.positions);
    return shape_normals(&s->now);
}

int scene_light(const scene *s, double t, int lit, double eta, float *irradiance, char *error_text, size_t error_size)
{
    lamp lamps[LAMPS];
    sss_dipole_light lights[LAMPS];
    size_t count = 0;
    const sss_mesh mesh = model_mesh(&s->now, s->size_mm / s->extent);
    const sss_dipole_irradiance_options options = {.eta = eta};
    shadow *const occluders = shadow_create(&s->now, threads_available(), error_text, error_size);
    if (!occluders)
    {
        return -1;
    }
    (s->index == 0 ? light_candle : light_cube)(t, lamps);
    for (size_t i = 0; i < LAMPS; ++i)
    {
        if (lit >> i & 1)
        {
            float *const visible = s->visible + i * s->now.vertex_count;
            lights[count] = lamps[i].light;
            if (lamps[i].radius > 0.0)
            {
                shadow_visibility_disc(occluders, lamps[i].light.position, lamps[i].radius, SAMPLES, visible);
                lights[count].visibility = visible;
            }
            ++count;
        }
    }
    shadow_free(occluders);
    const sss_result result = sss_dipole_irradiance(&mesh, lights, count, &options, irradiance);
    if (result != SSS_OK)
    {
        snprintf(error_text, error_size, "irradiance: %s", sss_result_string(result));
    }
    return result == SSS_OK ? 0 : -1;
}
