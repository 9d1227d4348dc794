// Oracle: triangles in the plane, whose corners are integers, so that every decision is exact: which way round, whether
// a point is inside, whether interiors meet; and areas of intersections with squares, in double.

#ifndef SSS_TESTS_FLAT_H
#define SSS_TESTS_FLAT_H

#include <stddef.h>
#include <stdint.h>

// Twice the signed area, positive where a, b, c run counter-clockwise. Exact for coordinates up to 2^30.
int64_t flat_orient(const int64_t a[2], const int64_t b[2], const int64_t c[2]);

// Its sign alone, exact for coordinates up to 2^61.
int flat_turn(const int64_t a[2], const int64_t b[2], const int64_t c[2]);

// 1: strictly inside; 0: on the border; -1: outside, as of any point where the triangle has no area. Either winding;
// coordinates up to 2^61.
int flat_inside(const int64_t p[2], const int64_t a[2], const int64_t b[2], const int64_t c[2]);

// Whether the interiors of two triangles have a point in common; either winding; without area: never.
int flat_interiors_meet(const int64_t (*a)[2], const int64_t (*b)[2]);

// Pairs of triangles whose interiors meet. SIZE_MAX: out of memory. The first pair goes to first[2], which may be NULL.
//   xy  [][2] in [0, extent];   triangles  [triangle_count][3]
size_t flat_overlaps(const int64_t (*xy)[2], const uint32_t *triangles, size_t triangle_count, int64_t extent,
                     size_t first[2]);

// The area that a triangle and the square [x, x + 1] x [y, y + 1] have in common; unsigned.
double flat_area_in_square(const double corners[3][2], double x, double y);

// The point of a triangle nearest to p, as weights of the corners. Any triangle, one without area included.
void flat_nearest(const double corners[3][2], const double p[2], double weights[3]);

// Length of the hull's border and its area; corners: how many of its vertices turn by more than `turn` radians when
// those that turn less are left out. Points are sorted in place.
typedef struct flat_hull
{
    double area, length;
    size_t corners;
} flat_hull;
flat_hull flat_convex_hull(double (*points)[2], size_t count, double turn);

#endif
