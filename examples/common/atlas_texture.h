// Radiosity as a texture over the atlas of a mesh, and the mesh that goes with it as binary glTF.
#ifndef EXAMPLES_ATLAS_TEXTURE_H
#define EXAMPLES_ATLAS_TEXTURE_H

#include <stddef.h>

#include "../../sss_atlas.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct atlas_texture
{
    sss_atlas *atlas;
    sss_atlas_mesh mesh;
    sss_atlas_texels texels;
    float *values;      // [texels.count][3] radiosity, W/mm^2
    // The same points in an order in which neighbours are near one another, as a gather by groups wants them.
    uint32_t *order;    // [texels.count] the texel of a point
    float *positions;   // [texels.count][3]
    float *normals;     // [texels.count][3], unit length everywhere
    float *gathered;    // [texels.count][3] for its results
    unsigned char *png; // the picture, sRGB, top row first
    size_t png_bytes;
    double white;       // radiosity of a texel that is 1, W/mm^2
    double seconds;     // that the atlas took
} atlas_texture;

// All return 0, or -1 with the reason in error_text.

// Cuts and packs; values are zero. *out is empty on failure.
int atlas_texture_create(const sss_mesh *mesh, const sss_atlas_options *options, int threads, atlas_texture *out,
                         char *error_text, size_t error_size);
void atlas_texture_free(atlas_texture *t);

// Values between those at the vertices of the mesh, [V][3], linear over each triangle.
void atlas_texture_interpolate(atlas_texture *t, const sss_mesh *mesh, const float *radiosity);

// Values from those gathered at the points.
void atlas_texture_take_gathered(atlas_texture *t);

// From values to png. White is the brightest value, so that nothing is cut off.
int atlas_texture_paint(atlas_texture *t, char *error_text, size_t error_size);

int atlas_texture_write_png(const atlas_texture *t, const char *path, char *error_text, size_t error_size);
int atlas_texture_write_glb(const atlas_texture *t, const model *m, const char *path, char *error_text,
                            size_t error_size);

#ifdef __cplusplus
}
#endif

#endif
