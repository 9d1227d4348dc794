// Oracle: the integral of one dipole source over a flat polygon (Mertens et al. 2003, eq. 8) as it is written, over the
// area: triangles are halved until a Gauss rule of 16 x 16 points is exact to rounding, in long double, in the
// polygon's plane with the source's projection as the origin. All terms are positive, so that nothing cancels. Shares
// no idea with integrals along edges.

#ifndef SSS_TESTS_AREA_H
#define SSS_TESTS_AREA_H

#include <stddef.h>

// int z (1 + sigma s) exp(-sigma s)/s^3 dA over a simple planar polygon, in either order; s the distance to the source,
// which must not lie in the polygon. About 1e-17 relative where the corners lie in one plane exactly.
//   corners  [corner_count][3], 3 to 64 corners
long double area_source_term(const double *corners, size_t corner_count, const double source[3], double z,
                             double sigma);

// The same over a triangle, weighted with each of the three barycentric coordinates.
void area_source_moments(const double *corners, const double source[3], double z, double sigma,
                         long double out[3]);

#endif
