#include "lights.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../sss_dipole.h"
#include "shadow.h"

static const double PI = 3.14159265358979323846;
static const double GOLDEN_ANGLE = 2.39996322972865332; // pi (3 - sqrt 5): spreads points evenly on discs and spheres

const lights lights_studio = {.direction = {{-0.28, 0.57, -0.77}, {-0.9, 0.35, 0.35}},
                              .color = {{6.0, 5.6, 5.1}, {1.0, 1.07, 1.18}}, .count = 2, .softness = 7.0,
                              .ambient = {0.06, 0.066, 0.078}};

enum
{
    AMBIENT_SAMPLES = 192 // directions over the sphere of the surroundings
};

// One run over the samples.
typedef struct sum
{
    const lights *l;
    const model *m;
    const shadow *s; // NULL without shadows
    double eta;
    float *visibility; // [V] of the sample at hand
    float *sample;     // [V][3] its irradiance
    float *irradiance;
    float *seen;
} sum;

static void normalize(double v[3])
{
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; ++k)
    {
        v[k] /= length;
    }
}

static sss_result add_light(const sum *a, const sss_dipole_light *light)
{
    const sss_mesh mesh = model_mesh(a->m, 1.0); // nothing here depends on the scale
    const sss_dipole_irradiance_options options = {.eta = a->eta};
    const sss_result result = sss_dipole_irradiance(&mesh, light, 1, &options, a->sample);
    for (size_t i = 0; i < 3 * a->m->vertex_count && result == SSS_OK; ++i)
    {
        a->irradiance[i] += a->sample[i];
    }
    return result;
}

static sss_result add_directional(const sum *a, const double direction[3], const double color[3], double share)
{
    sss_dipole_light light = {.kind = SSS_DIPOLE_LIGHT_DIRECTIONAL};
    for (int k = 0; k < 3; ++k)
    {
        light.direction[k] = direction[k];
        light.color[k] = color[k] * share;
    }
    if (a->s)
    {
        shadow_visibility(a->s, direction, a->visibility);
        light.visibility = a->visibility;
    }
    return add_light(a, &light);
}

static void add_seen(const sum *a, size_t channel, const double direction[3], double share)
{
    for (size_t i = 0; i < a->m->vertex_count && a->seen; ++i)
    {
        const float *const n = a->m->normals + 3 * i;
        const double cosine = (double)n[0] * direction[0] + (double)n[1] * direction[1] + (double)n[2] * direction[2];
        const double weight = channel < 3 ? 1.0 : 4.0 * fmax(0.0, cosine); // surroundings count by the cosine
        a->seen[4 * i + channel] += (float)(share * weight * (a->s ? (double)a->visibility[i] : 1.0));
    }
}

static int samples_of(const lights *l)
{
    return l->softness > 0.0 ? LIGHTS_SAMPLES : 1;
}

// A light of finite size is many directions within its disc.   out  [samples_of(l)][3]
static void spread(const lights *l, size_t index, double (*out)[3])
{
    double w[3] = {l->direction[index][0], l->direction[index][1], l->direction[index][2]};
    normalize(w);
    double u[3] = {fabs(w[0]) < 0.5, fabs(w[0]) >= 0.5, 0.0};
    const double along = u[0] * w[0] + u[1] * w[1];
    for (int k = 0; k < 3; ++k)
    {
        u[k] -= along * w[k];
    }
    normalize(u);
    const double v[3] = {w[1] * u[2] - w[2] * u[1], w[2] * u[0] - w[0] * u[2], w[0] * u[1] - w[1] * u[0]};
    const int samples = samples_of(l);
    const double radius = tan(l->softness * PI / 180.0);
    for (int i = 0; i < samples; ++i)
    {
        const double r = radius * sqrt((i + 0.5) / samples), phi = i * GOLDEN_ANGLE;
        for (int k = 0; k < 3; ++k)
        {
            out[i][k] = w[k] + r * (cos(phi) * u[k] + sin(phi) * v[k]);
        }
        normalize(out[i]);
    }
}

size_t lights_directions(const lights *l, double (*direction)[3], double (*color)[3])
{
    const size_t samples = (size_t)samples_of(l);
    for (size_t index = 0; index < l->count; ++index)
    {
        spread(l, index, direction + index * samples);
        for (size_t i = 0; i < 3 * samples; ++i)
        {
            color[index * samples + i / 3][i % 3] = l->color[index][i % 3] / (double)samples;
        }
    }
    return l->count * samples;
}

static sss_result add_soft_light(const sum *a, size_t index)
{
    double directions[LIGHTS_SAMPLES][3];
    const int samples = samples_of(a->l);
    sss_result result = SSS_OK;
    spread(a->l, index, directions);
    for (int i = 0; i < samples && result == SSS_OK; ++i)
    {
        result = add_directional(a, directions[i], a->l->color[index], 1.0 / samples);
        if (index < 3)
        {
            add_seen(a, index, directions[i], 1.0 / samples);
        }
    }
    return result;
}

// Even surroundings: with shadows many directions over the sphere, without them the header's environment.
static sss_result add_ambient(const sum *a)
{
    const double *const E = a->l->ambient;
    const int wanted = E[0] > 0.0 || E[1] > 0.0 || E[2] > 0.0;
    if (!a->s)
    {
        // Radiance E/pi everywhere; Y_00 = 1/(2 sqrt(pi)).
        sss_dipole_light light = {.kind = SSS_DIPOLE_LIGHT_ENVIRONMENT};
        for (int k = 0; k < 3; ++k)
        {
            light.sh[0][k] = E[k] / PI * 2.0 * sqrt(PI);
        }
        for (size_t i = 0; i < a->m->vertex_count && a->seen; ++i)
        {
            a->seen[4 * i + 3] = 1.0f;
        }
        return wanted ? add_light(a, &light) : SSS_OK;
    }
    sss_result result = SSS_OK;
    for (int i = 0; i < AMBIENT_SAMPLES && result == SSS_OK && wanted; ++i)
    {
        const double y = 1.0 - 2.0 * (i + 0.5) / AMBIENT_SAMPLES, r = sqrt(1.0 - y * y), phi = i * GOLDEN_ANGLE;
        const double direction[3] = {r * cos(phi), y, r * sin(phi)};
        // A plane sees radiance E/pi over solid angles 4 pi / samples each.
        result = add_directional(a, direction, E, 4.0 / AMBIENT_SAMPLES);
        add_seen(a, 3, direction, 1.0 / AMBIENT_SAMPLES);
    }
    return result;
}

static sss_result add_all(const sum *a)
{
    sss_result result = SSS_OK;
    for (size_t i = 0; i < a->l->count && result == SSS_OK; ++i)
    {
        result = add_soft_light(a, i);
    }
    return result == SSS_OK ? add_ambient(a) : result;
}

int lights_irradiance(const lights *l, const model *m, double eta, int threads, float *irradiance, float *seen,
                      char *error_text, size_t error_size)
{
    shadow *s = NULL;
    if (!l->no_shadows)
    {
        s = shadow_create(m, threads, error_text, error_size);
        if (!s)
        {
            return -1;
        }
    }
    const size_t count = m->vertex_count;
    sum a = {.l = l, .m = m, .s = s, .eta = eta, .irradiance = irradiance, .seen = seen};
    a.visibility = malloc(count * sizeof *a.visibility);
    a.sample = malloc(3 * count * sizeof *a.sample);
    memset(irradiance, 0, 3 * count * sizeof *irradiance);
    if (seen)
    {
        memset(seen, 0, 4 * count * sizeof *seen);
    }
    const sss_result result = a.visibility && a.sample ? add_all(&a) : SSS_ERROR_OUT_OF_MEMORY;
    free(a.visibility);
    free(a.sample);
    shadow_free(s);
    if (result != SSS_OK)
    {
        snprintf(error_text, error_size, "irradiance: %s", sss_result_string(result));
        return -1;
    }
    return 0;
}
