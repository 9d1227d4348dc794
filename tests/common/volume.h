// The volume that a closed model encloses, for tests of generated and of loaded models.

#ifndef SSS_TESTS_VOLUME_H
#define SSS_TESTS_VOLUME_H

#include "../../examples/common/model.h"

// By the divergence theorem; positive where triangles are counter-clockwise from outside.
static inline double volume(const model *m)
{
    double sum = 0.0;
    for (size_t t = 0; t < m->triangle_count; ++t)
    {
        double p[3][3];
        for (size_t i = 0; i < 9; ++i)
        {
            p[i / 3][i % 3] = (double)m->positions[3 * m->triangles[3 * t + i / 3] + i % 3];
        }
        sum += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
               p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    }
    return sum / 6.0;
}

#endif
