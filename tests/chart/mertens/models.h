// The models of the paper's experiments that can be made: closed shapes by 4-to-1 splits, as in section 5.1.2.

#ifndef SSS_TESTS_CHART_MERTENS_MODELS_H
#define SSS_TESTS_CHART_MERTENS_MODELS_H

#include "../../common/meshes.h"

#include <stddef.h>

typedef enum model_shape
{
    MODEL_BLOB,   // a sphere with lobes, in the place of the paper's butterfly subdivision model
    MODEL_CANDLE, // a stout rounded cylinder with a hollow on top
    MODEL_CUBE    // flat faces, sharp edges
} model_shape;

// The base is a closed band of `sectors` and `rings` with a pole at either end: 2 sectors (rings - 1) triangles; the
// cube's are 4 and 3. Each of `levels` splits every triangle in four; triangle i becomes 4i .. 4i+3, as sss_bem_options
// wants it. Returns 0, or nonzero with *out zeroed. Free with mesh_free.
int model_subdivided(model_shape shape, size_t sectors, size_t rings, int levels, mesh_data *out);

#endif
