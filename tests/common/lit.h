// Oracles for radiosity under directional and point lights, distance-only dipole: the irradiance at vertices, what
// vertices see by ray casting, and rows of the integral operator, from the formulas of Hao and Varshney 2004, in double
// precision. They use only the types of the headers, none of their code.

#ifndef SSS_TESTS_LIT_H
#define SSS_TESTS_LIT_H

#include "../../sss_dipole.h"

#include <stddef.h>

// F_t of light that enters: unpolarised, eta of the medium over that of the outside; 0 for cosines <= 0.
double lit_transmittance(double cosine, double eta);

// E per unit of light at vertices: F_t(n . w) (n . w), at most 0 where the light is behind, times the visible share.
//   normals   [V][3] any length > 0
//   light     towards the light (distance = INFINITY), or its position in the mesh's units: then also over d^2, mm
//   visible   [V], NULL: all of them
//   E         [V]
void lit_irradiance(const sss_mesh *mesh, const float *normals, double eta, const double light[3], double distance,
                    const float *visible, double *E);

// ---- What vertices see: Embree ----

typedef struct lit_rays lit_rays;

// The mesh's arrays must outlive it. NULL on failure.
lit_rays *lit_rays_create(const sss_mesh *mesh);
void lit_rays_free(lit_rays *rays);

// visible [V]: 1 where nothing lies between a vertex and the light but triangles that end in that vertex, else 0.
// The normal is not heeded. light and distance as above.
void lit_rays_visible(const lit_rays *rays, const double light[3], double distance, float *visible);

// ---- Rows of the operator ----

// B(x_o) = sum over vertices of weight E, where E is linear over triangles:
// weight_v = int R_d(|x - x_o|) hat_v(x) dA, adaptive, about 1e-6 of the sum.
typedef struct lit_rows
{
    size_t *index;  // [count] receivers, vertices
    double *weight; // [count][3][V]
    size_t count, V;
} lit_rows;

// Takes the indices (of malloc) over, also on failure. 0 on success.
int lit_rows_make(const sss_mesh *mesh, const sss_profile *profile, size_t *index, size_t count, int threads,
                  lit_rows *out);
void lit_rows_free(lit_rows *rows);

// B [count][3] under E [V].
void lit_rows_apply(const lit_rows *rows, const double *E, double *B);

#endif
