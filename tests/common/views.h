// Pictures of a mesh from many sides without a graphics card, in floating point: what an error of radiosity does to the
// eye, as Hao and Varshney 2004 measure it (section 3.3): the root mean square of the differences of all pixels of the
// rendered, tone-mapped pictures, in [0, 1], and of views the worst.

#ifndef SSS_TESTS_VIEWS_H
#define SSS_TESTS_VIEWS_H

#include "meshes.h"

#include <stddef.h>

typedef struct views views; // which triangle each pixel shows, of each view

// Parallel projections from directions drawn at random (random_unit), each filled by the mesh. NULL on failure.
//   normals  the mesh's, for the exit factor
views *views_create(const mesh_data *mesh, size_t count, size_t side, double eta);
void views_free(views *v);

// The exposure that puts all but the brightest hundredth of the pixels below white.   B  [V][3]
double views_exposure(const views *v, const float *B);

// How radiance times exposure becomes a pixel in [0, 1]: by the filmic curve and sRGB of sss_dipole.h; or as it is, cut
// off at 1, as pictures were shown in 2004.
typedef enum views_tone
{
    VIEWS_TONE_MAPPED = 0,
    VIEWS_LINEAR
} views_tone;

// The largest of the views' differences between two radiosities [V][3]; mean: of the views, may be NULL.
double views_rmse(const views *v, views_tone tone, const float *B, const float *want, double exposure, double *mean);

#endif
