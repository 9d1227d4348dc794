#define _DEFAULT_SOURCE // cglm wants M_PI

#include "camera.h"

#include <math.h>
#include <string.h>

#include <cglm/cglm.h>

static const double PI = 3.14159265358979323846;
static const double FIELD_OF_VIEW = 24.0; // degrees, vertical: a portrait lens, little perspective
static const double MARGIN = 1.06;        // free space around the object at zoom 1

static void view_basis(const camera *c, double right[3], double up[3], double back[3])
{
    const double a = c->azimuth * PI / 180.0, e = c->elevation * PI / 180.0;
    back[0] = cos(e) * sin(a);
    back[1] = sin(e);
    back[2] = cos(e) * cos(a);
    right[0] = cos(a);
    right[1] = 0.0;
    right[2] = -sin(a);
    up[0] = -sin(e) * sin(a);
    up[1] = cos(e);
    up[2] = -sin(e) * cos(a);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void camera_fit(camera *c, const float *positions, size_t count, double aspect)
{
    double axis[3][3], low[3], high[3];
    view_basis(c, axis[0], axis[1], axis[2]);
    for (size_t k = 0; k < 3; ++k)
    {
        low[k] = INFINITY;
        high[k] = -INFINITY;
    }
    for (size_t i = 0; i < count; ++i)
    {
        const double p[3] = {(double)positions[3 * i], (double)positions[3 * i + 1], (double)positions[3 * i + 2]};
        for (size_t k = 0; k < 3; ++k)
        {
            low[k] = fmin(low[k], dot(axis[k], p));
            high[k] = fmax(high[k], dot(axis[k], p));
        }
    }
    double middle[3];
    for (size_t k = 0; k < 3; ++k)
    {
        middle[k] = 0.5 * (low[k] + high[k]);
    }
    for (size_t k = 0; k < 3; ++k)
    {
        c->target[k] = middle[0] * axis[0][k] + middle[1] * axis[1][k] + middle[2] * axis[2][k];
    }
    const double tan_y = tan(0.5 * FIELD_OF_VIEW * PI / 180.0), tan_x = tan_y * aspect;
    c->distance = c->radius = 0.0;
    for (size_t i = 0; i < count; ++i)
    {
        double p[3];
        for (size_t k = 0; k < 3; ++k)
        {
            p[k] = (double)positions[3 * i + k] - c->target[k];
        }
        const double x = fabs(dot(axis[0], p)) * MARGIN, y = fabs(dot(axis[1], p)) * MARGIN, z = dot(axis[2], p);
        c->distance = fmax(c->distance, z + fmax(x / tan_x, y / tan_y));
        c->radius = fmax(c->radius, sqrt(dot(p, p)));
    }
}

void camera_orbit(camera *c, double drag_x, double drag_y, double scroll)
{
    c->azimuth -= 0.4 * drag_x;
    c->elevation = fmin(89.0, fmax(-89.0, c->elevation + 0.4 * drag_y));
    c->zoom = fmin(20.0, fmax(0.1, c->zoom * pow(1.1, scroll)));
}

void camera_matrix(const camera *c, double aspect, float view_projection[16], float eye[3])
{
    double right[3], up[3], back[3];
    view_basis(c, right, up, back);
    const double zoom = c->zoom > 0.0 ? c->zoom : 1.0;
    // The lens zooms, the eye stays: so the eye never enters the object.
    const double field = 2.0 * atan(tan(0.5 * FIELD_OF_VIEW * PI / 180.0) / zoom);
    const double radius = c->radius > 0.0 ? c->radius : 1.0;
    const double distance = fmax(c->distance, 1.01 * radius);
    vec3 at, from, head;
    for (int k = 0; k < 3; ++k)
    {
        at[k] = (float)c->target[k];
        from[k] = (float)(c->target[k] + distance * back[k]);
        head[k] = (float)up[k];
        eye[k] = from[k];
    }
    const double near_plane = fmax(distance - 1.01 * radius, 1e-3 * distance); // 24 bits of depth cope with 1:1000
    mat4 view, projection, both;
    glm_lookat(from, at, head, view);
    glm_perspective((float)field, (float)aspect, (float)near_plane, (float)(distance + 4.0 * radius), projection);
    glm_mat4_mul(projection, view, both);
    memcpy(view_projection, both, 16 * sizeof(float));
}
