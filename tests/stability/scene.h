// Lit objects for the sweeps, the converged reference on them, and errors against it.

#ifndef SSS_TESTS_STABILITY_SCENE_H
#define SSS_TESTS_STABILITY_SCENE_H

#include "../../sss_dipole.h"
#include "../common/meshes.h"

#include <stddef.h>

// Lengths are mean free paths: sigma_t' = 1/mm in every channel, and one unit of a mesh is 1 mm, until a sweep says
// otherwise.
typedef struct scene
{
    mesh_data mesh;
    sss_mesh view;
    sss_profile profile;
    double light[3];   // towards the light, unit length: one directional light of 1 W/mm^2
    float *visible;    // [V] the share of it that a vertex sees
    float *irradiance; // [V][3] with the entering Fresnel transmittance, no shadows but `visible`
    double *areas;     // [V] the weight of a vertex
    size_t *receivers; // [count] vertices at which the reference is computed
    size_t count;
} scene;

// Takes the mesh, which is empty afterwards. Everything is visible, irradiance is zero.
//   albedo  alpha' of the three channels
// Returns 0, or nonzero with *out zeroed.
int scene_create(mesh_data *mesh, const double albedo[3], double eta, scene *out);
void scene_free(scene *s);

// Turns the light there; any length > 0. 0 on success.
int scene_light(scene *s, double x, double y, double z);

// Which vertices are receivers: every step-th of [begin, end), added to those that there are. 0 on success.
int scene_add_receivers(scene *s, size_t begin, size_t end, size_t step);

// The converged integral at the receivers: as reference_radiosity_many, B [count][3]. A NaN where it does not converge,
// as with a source on the surface itself.   irradiance  [V][3];  normals  [V][3] of the receivers
int scene_truth(const scene *s, const float *irradiance, const float *normals, sss_dipole_geometry geometry,
                double guard, double tolerance, double *B);

typedef struct outcome
{
    double rel_l2, rel_max; // at receivers [begin, end) over the norm of all of them
    double largest;         // B of any vertex
    double smallest;        // the same, at most 0
    int finite;             // every B of every vertex is, and none is negative but by rounding
} outcome;

// B [V][3] against truth [count][3].
outcome scene_compare(const scene *s, const float *B, const double *truth, size_t begin, size_t end);

#endif
