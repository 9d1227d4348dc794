// Pictures of a case, to tell what an error of radiosity does to the eye: root-mean-square differences of the rendered,
// tone-mapped pictures, in [0,1].

#ifndef SSS_TESTS_CHART_PICTURE_H
#define SSS_TESTS_CHART_PICTURE_H

#include "chart.h"

typedef struct picture picture;

// A case's picture from its best radiosity [V][3], which also sets the exposure of all others. NULL where there is no
// OpenGL or memory is short: pictures are then not compared.
picture *picture_create(const chart_case *c, const float *radiosity);
void picture_free(picture *p);

// How far the picture from another radiosity [V][3] is off; negative on failure. Pictures have 8 bits a channel, so
// that differences below some 1/1000 are seen only where they tip a rounding.
double picture_rmse(picture *p, const float *radiosity);

#endif
