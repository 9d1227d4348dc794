// What vertices see of a direction or of a point, by ray casting with Embree.
#ifndef EXAMPLES_SHADOW_H
#define EXAMPLES_SHADOW_H

#include <stddef.h>

#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct shadow shadow; // an acceleration structure over a copy of the mesh

// NULL on failure, with the reason in error_text.
shadow *shadow_create(const model *m, int threads, char *error_text, size_t error_size);
void shadow_free(shadow *s);

// visibility [vertex_count]: 1 where a vertex sees the direction, 0 where the mesh is in the way or the vertex
// normal faces away.
void shadow_visibility(const shadow *s, const double direction[3], float *visibility);

// The share that a vertex sees of a lamp, a level disc of this radius in the mesh's units: by rays to `samples` points
// on it, at most SHADOW_SAMPLES.
enum
{
    SHADOW_SAMPLES = 64
};
void shadow_visibility_disc(const shadow *s, const double middle[3], double radius, int samples, float *visibility);

#ifdef __cplusplus
}
#endif

#endif
