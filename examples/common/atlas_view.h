// Draws a mesh and its texture atlas side by side: with a checker of texels, and with the stretch as colours.
#ifndef EXAMPLES_ATLAS_VIEW_H
#define EXAMPLES_ATLAS_VIEW_H

#include <stddef.h>

#include "../../sss_atlas.h"
#include "camera.h"
#include "gl_context.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct atlas_view atlas_view; // a mesh and the textures of its atlas on the graphics card

enum
{
    ATLAS_VIEW_CHECKER, // squares of texels, every chart in a colour of its own
    ATLAS_VIEW_STRETCH, // how large a texel is on the surface
    ATLAS_VIEW_TEXTURES
};

// NULL on failure, with the reason in error_text.
atlas_view *atlas_view_create(gl_context *context, char *error_text, size_t error_size);
void atlas_view_free(atlas_view *v);

// Another mesh or atlas: uploads it and makes both textures from its texels.
// Returns 0, or -1 with the reason in error_text.
int atlas_view_set(atlas_view *v, const model *m, const sss_atlas *atlas, char *error_text, size_t error_size);

// Draws into the framebuffer that is bound: four panels in a row, or two by two where the picture is not wide, above a
// line of text and the legend of the colours.
void atlas_view_draw(const atlas_view *v, const camera *eye, int width, int height);

// The height of a picture of this width that has its panels in a row.
int atlas_view_height(int width);

#ifdef __cplusplus
}
#endif

#endif
