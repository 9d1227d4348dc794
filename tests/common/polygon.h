// Oracle: the dipole's source term over a flat polygon under constant irradiance (TRUTH.md, section 3), by the integral
// around the polygon's border instead of over its area, in long double. Shares no idea with the cubature it checks.

#ifndef SSS_TESTS_POLYGON_H
#define SSS_TESTS_POLYGON_H

// int z (1 + sigma s) exp(-sigma s)/s^3 dA over the polygon, s^2 = |x|^2 + H^2 in the polygon's plane, the projection
// of the source being the origin.
//   xy  [n][2], counter-clockwise;   H > 0 perpendicular distance of the source;   z  weight
long double polygon_source_term(const double (*xy)[2], int n, double H, double z, double sigma);

// int x z (1 + sigma s) exp(-sigma s)/s^3 dA over the rectangle [x0,x1] x [y0,y1], s^2 = x^2 + y^2 + H^2:
// since rho (1 + sigma s) exp(-sigma s)/s^3 = -d/drho [exp(-sigma s)/s], the integral over x is done by hand.
long double rectangle_first_moment(double x0, double x1, double y0, double y1, double H, double z, double sigma);

#endif
