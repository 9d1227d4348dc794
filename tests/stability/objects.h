// Lit objects for the sweeps, a converged reference on them, and the errors of sss_bem.h against it.

#ifndef SSS_TESTS_STABILITY_OBJECTS_H
#define SSS_TESTS_STABILITY_OBJECTS_H

#include "../../sss_bem.h"
#include "../../sss_dipole.h"
#include "../common/meshes.h"

#include <stddef.h>

// Lengths are mean free paths: sigma_t' = 1/mm in every channel, and one unit of a mesh is 1 mm.
typedef struct object
{
    mesh_data mesh;
    sss_mesh view;
    sss_profile profile;
    float *irradiance;  // [V][3]
    float *radiosity;   // [V][3], the last that was computed
    size_t *receivers;  // [count] vertices at which the reference is computed
    size_t count;
    double *areas;      // [V] the weight of a vertex
    double *truth;      // [count][3]
    double truth_error; // relative L2, the reference's own estimate
} object;

// Takes the mesh, which is empty afterwards. Irradiance is zero.  albedo  alpha' of the three channels
// Returns 0, or nonzero with *out zeroed.
int object_create(mesh_data *mesh, const double albedo[3], double eta, object *out);
void object_free(object *o);

// White light from a direction, with the entering Fresnel transmittance, without shadows.
int object_light(object *o, double x, double y, double z);

// Which vertices are receivers: every step-th of [begin, end), added to those that there are.
int object_add_receivers(object *o, size_t begin, size_t end, size_t step);

// Sources placed at the receivers, with the given guard.
int object_find_truth(object *o, double guard, double tolerance);

typedef struct outcome
{
    double rel_l2, rel_max; // at receivers [begin, end) over the norm of all of them
    double predicted;       // what sss_bem_predict_error says of the whole
    double largest;         // B of any vertex
    int finite;             // every B of every vertex is
} outcome;

// From scratch into o->radiosity.   guard  as in sss_bem_options: 0 means the default, negative none
int object_shade(object *o, double tolerance, double guard, double *predicted);

// o->radiosity against the reference.
outcome object_compare(const object *o, size_t begin, size_t end);

#endif
