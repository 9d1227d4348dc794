// The lights of a scene, from the command line to irradiance at the vertices.
#ifndef EXAMPLES_LIGHTS_H
#define EXAMPLES_LIGHTS_H

#include <stddef.h>

#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

enum
{
    LIGHTS_MAX = 8,
    LIGHTS_SAMPLES = 48 // directions in one soft light
};

typedef struct lights
{
    double direction[LIGHTS_MAX][3]; // towards the light, any length > 0
    double color[LIGHTS_MAX][3];     // irradiance on a plane that faces it, W/mm^2
    size_t count;
    double softness;                 // angular radius of every light, degrees; 0: hard shadows
    double ambient[3];               // irradiance on an open plane from an even surrounding, W/mm^2
    int no_shadows;
} lights;

// A warm sun behind the object, a faint cool light from the side, dim surroundings: what shows translucency best.
extern const lights lights_studio;

// Computes the irradiance at the vertices with the entering Fresnel transmittance of a medium of index eta.
//   irradiance  [vertex_count][3]
//   seen        [vertex_count][4] for drawing reflections, may be NULL: the visible share of lights 0 to 2, and of
//               the surroundings
// Returns 0, or -1 with the reason in error_text.
int lights_irradiance(const lights *l, const model *m, double eta, int threads, float *irradiance, float *seen,
                      char *error_text, size_t error_size);

// The lights, without surroundings, as directions: a soft one is many.
//   direction, color  [LIGHTS_MAX LIGHTS_SAMPLES][3] room for them, as in lights; direction of unit length
// Returns how many there are.
size_t lights_directions(const lights *l, double (*direction)[3], double (*color)[3]);

#ifdef __cplusplus
}
#endif

#endif
