// Generated meshes and deformations: the candle and the cube of Mertens et al. 2003, figures 6.6 and 6.7.
#ifndef EXAMPLES_SHAPES_H
#define EXAMPLES_SHAPES_H

#include <stddef.h>

#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

// A candle that has burnt down into itself: 1 high from y = 0, a wall with four ridges, open at the top. Its axis is y;
// a light at (0, SHAPES_WICK, 0) sees all of the inside and nothing else.
// All return 0, or -1 where memory is short; a new mesh is then empty. Free with model_free.
//   rings    of vertices along the outline, at least 16;   sectors  vertices of a ring, at least 8
int shape_candle(size_t rings, size_t sectors, model *out);
extern const double SHAPES_WICK;

// A cube over [-1,1]^3 with rounded edges.   divisions  along an edge, 2 to 300: 12 divisions^2 triangles
int shape_cube(size_t divisions, model *out);

// The normals of m as its positions are now.
int shape_normals(model *m);

// Wrings a shape that stands on y = 0: every height turns about the y axis by its share of `turns`, and the middle
// becomes as much thinner as turning and a waist of `pinch` (0: none, to 1) make it.
//   rest, out  [count][3], may be one array;   height  where the whole of `turns` is reached
void shape_twist(const float *rest, size_t count, double height, double turns, double pinch, float *out);

// Moves every vertex along its normal by amplitude times Perlin noise at rest/period + offset.
//   rest, normals, out  [count][3]; out may be rest;   offset  [3] in periods
void shape_noise(const float *rest, const float *normals, size_t count, double amplitude, double period,
                 const double offset[3], float *out);

// Gradient noise in about [-1, 1], 0 on the integers, twice differentiable.                         Perlin 2002
double shape_perlin(const double p[3]);

#ifdef __cplusplus
}
#endif

#endif
