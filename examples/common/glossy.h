// Draws a mesh that changes every frame: radiosity at its vertices, and the studio that its surface mirrors, through
// sss_bem_glsl.
#ifndef EXAMPLES_GLOSSY_H
#define EXAMPLES_GLOSSY_H

#include <stddef.h>

#include "../../sss_dipole.h"
#include "camera.h"
#include "gl_context.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct glossy glossy; // a mesh on the graphics card

typedef struct glossy_view
{
    camera eye;
    double exposure;         // radiance times this goes into tone mapping
    double studio;           // radiance of the studio's brightest lamp; 0: nothing is mirrored
    double background[2][3]; // below and above, sRGB in [0,1]
} glossy_view;

// For meshes with the triangles of this one. NULL on failure, with the reason.
glossy *glossy_create(gl_context *context, const model *m, char *error_text, size_t error_size);
void glossy_free(glossy *g);

// The material, by its profile. Returns 0, or -1 where it is invalid.
int glossy_set_profile(glossy *g, const sss_profile *profile);

// Positions and normals as m has them now; radiosity [vertex_count][3], W/mm^2.
void glossy_set_vertices(glossy *g, const model *m, const float *radiosity);

// Draws into the framebuffer that is bound.
void glossy_draw(const glossy *g, const glossy_view *view, int width, int height);

#ifdef __cplusplus
}
#endif

#endif
