// The converged reference of the direct gather: B(x_o) = int E(x_i) R_d(x_i, x_o) dA over a triangle mesh, in double
// precision, adaptive, with an estimate of its own error. Works from the formulas of Jensen et al. 2001 and Mertens et
// al. 2003 (shared: TRUTH.md, section 2); it uses only the types of sss_dipole.h, none of its code.
//
// The method: a degree-5 rule with seven points on each triangle. Where the distance h from the triangle's centroid to
// its farthest corner is small beside the distance s of the source and beside 1/sigma_tr, the remainder of the Taylor
// series of the kernel bounds the rule's error; where it is not, the error is taken to be the largest possible
// contribution, area x max E x max R_d. The worst triangle is halved across its longest edge until the sum of the
// errors is small enough. A peak that falls between the sample points is therefore never missed: its triangle is split
// because it could hold one, not because a sample saw it.

#ifndef SSS_TESTS_REFERENCE_H
#define SSS_TESTS_REFERENCE_H

#include "../../sss_dipole.h"

#include <stddef.h>

typedef struct reference_options
{
    sss_dipole_geometry geometry;
    sss_dipole_elements elements; // irradiance at vertices, linear over a triangle; or constant over each triangle
    double tolerance;             // relative error allowed for each channel of B; 0: 1e-6
    double guard;                 // within guard z of a source its term is what it is there, as in sss_bem.h; 0: none
} reference_options;

// One receiver.
//   irradiance        [V][3] or [T][3], W/mm^2
//   position, normal  [3] in mesh units; normal of any length > 0, NULL allowed for SSS_DIPOLE_DISTANCE
//   B, error          [3] W/mm^2; error is absolute, an upper estimate
// Returns 0; 1 where memory ran out or an argument is unusable (B, error untouched); 2 where the tolerance was not
// reached (B, error hold what was), as with a placed source on the surface itself, where the integral diverges.
// Allocates; reentrant.
int reference_radiosity(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                        const reference_options *options, const float position[3], const float normal[3], double B[3],
                        double error[3]);

// Many receivers on POSIX threads. indices may be NULL: receivers 0 .. index_count-1.
//   positions, normals  [n][3];   indices  [index_count] into them;   B, error  [index_count][3]
// Returns the worst of reference_radiosity's results.
int reference_radiosity_many(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                             const reference_options *options, const float *positions, const float *normals,
                             const size_t *indices, size_t index_count, int threads, double *B, double *error);

// One flat triangle and one channel, for tests of the rule and its error estimate: no splitting at all.
//   corners  [3][3] mm, relative to x_o;   E  [3] at the corners;   normal  unit length, for SSS_DIPOLE_PLACED
void reference_one_rule(const double corners[3][3], const double E[3], const sss_profile *profile, int channel,
                        sss_dipole_geometry geometry, const double normal[3], double *integral, double *error);

#endif
