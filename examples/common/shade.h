// Draws a model from the radiosity at its vertices: the exit factor and tone mapping of sss_dipole_glsl, and the
// light that the surface itself reflects.
#ifndef EXAMPLES_SHADE_H
#define EXAMPLES_SHADE_H

#include <stddef.h>

#include "../../sss_dipole.h"
#include "camera.h"
#include "gl_context.h"
#include "lights.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shade shade; // a model on the graphics card

typedef struct shade_view
{
    camera eye;
    double exposure;          // radiance times this goes into tone mapping; shade_exposure finds one
    double background[2][3];  // below and above, sRGB in [0,1]
    double roughness;         // of the surface as reflections show it, in (0, 1]; 0: no reflections
    double floor;             // how strongly a polished floor mirrors the object, in [0, 1]; 0: no floor
} shade_view;

// Uploads a model; lights (copied) are for the reflections, may be NULL. NULL on failure, with the reason.
shade *shade_create(gl_context *context, const model *m, const lights *l, char *error_text, size_t error_size);
void shade_free(shade *s);

// The material, by its profile and exit convention. Returns 0, or -1 where the profile is invalid.
int shade_set_profile(shade *s, const sss_profile *profile, sss_dipole_exit exit_convention);

// Per vertex: radiosity [vertex_count][3] W/mm^2; seen [vertex_count][4] from lights_irradiance, NULL for all seen.
void shade_set_radiosity(shade *s, const float *radiosity, const float *seen);

// Draws into the framebuffer that is bound.
void shade_draw(const shade *s, const shade_view *view, int width, int height);

// Draws off screen, anti-aliased with supersample^2 samples a pixel, into rgb [height][width][3], top row first.
// Returns 0, or -1 with the reason in error_text.
int shade_picture(const shade *s, const shade_view *view, int width, int height, int supersample, unsigned char *rgb,
                  char *error_text, size_t error_size);

// A view to begin with: the whole model on a dark ground, slightly glossy, well exposed.
shade_view shade_studio(const model *m, const float *radiosity, double aspect);

// The exposure that puts the brightest parts of what the camera faces just below white.
double shade_exposure(const model *m, const camera *eye, const float *radiosity);

#ifdef __cplusplus
}
#endif

#endif
