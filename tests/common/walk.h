// Light inside a translucent body by volumetric random walk: what the dipole model approximates, computed without it.
// Forward Monte Carlo inside a closed triangle mesh (Embree finds the triangles, distances are in double precision):
// refraction in, free flights, scattering by Henyey and Greenstein's phase function, absorption by weight, Fresnel's
// reflection inside, radiosity where the light leaves. Uses the types of sss_dipole.h and none of its code.
//
// What enters is what the dipole counts as entering (DESIGN.md): E_v = F_t(n_v . w) max(0, n_v . w) at vertices, with
// the mesh's vertex normals and without shadows, linear over triangles; a photon starts in proportion to that E. Its
// direction is refracted at the interpolated normal, and mirrored into the body where that points out of its triangle.
// Everything after that goes by the triangles' own planes. Light that has left does not come back.
//
// The mesh must be closed and face outward. A ray that meets no triangle, or one from outside, ends there and its
// weight counts as lost: walk_total.lost says how much, and a result with much of it is worthless.

#ifndef SSS_TESTS_WALK_H
#define SSS_TESTS_WALK_H

#include "../../sss_dipole.h"

#include <stddef.h>
#include <stdint.h>

// Rises with every change of the results.
#define WALK_VERSION 1

typedef struct walk_medium
{
    double sigma_s[3]; // scattering coefficient, not reduced, 1/mm, >= 0
    double sigma_a[3]; // absorption coefficient, 1/mm, >= 0
    double g;          // mean cosine of the scattering angle, in (-1, 1); 0: isotropic
    double eta;        // index of refraction of the medium over that of the outside, > 0
} walk_medium;

// The medium of a profile: sigma_t' = 1/z_r, sigma_s' = alpha' sigma_t', sigma_s = sigma_s'/(1 - g). g = 0 is
// isotropic scattering with the reduced coefficients.
void walk_medium_of(const sss_profile *profile, double g, walk_medium *out);

typedef enum walk_light_kind
{
    WALK_DIRECTIONAL = 0, // parallel light
    WALK_DIFFUSE,         // radiance color/pi (1 + direction.w) from everywhere: E_v = color (T_0 + T_1 direction.n_v)
                          // with T_k = 2 int F_t mu^(1+k) dmu; enters about the triangles' own normals
    WALK_BEAM             // a pencil of light that meets one point of the surface, for tests of slabs
} walk_light_kind;

typedef struct walk_light
{
    walk_light_kind kind;
    double direction[3]; // directional, beam: towards the light; any length > 0; a beam with 0: from everywhere
                         // diffuse: gradient of the radiance, at most 1 long; 0: uniform
    double color[3];     // directional: W/mm^2 on a plane facing it; diffuse: pi x mean radiance, W/mm^2; beam: W
    const float *mask;   // [V] share of the light at each vertex, linear between, or NULL for 1; not for beams
    size_t triangle;     // beam: where it enters, at the triangle's centroid
} walk_light;

// An exit: `weight` watts leave at position (mm) through a triangle. Called from many threads, for one batch
// from one thread at a time.
typedef void (*walk_exit)(void *context, size_t batch, int channel, const double position[3], size_t triangle,
                          double weight);

typedef struct walk_options
{
    uint64_t photons;         // per channel; rounded up to a multiple of `batches`
    size_t batches;           // 0: 32; independent samples that give the standard errors, at least 16
    uint64_t seed;
    const sss_hooks *hooks;   // parallel_for, or NULL: serial; the result does not depend on it
    uint64_t scatterings_max; // 0: no limit; a photon that reaches it ends, its weight counts as cut (a bias, stated),
                              // as does one that is reflected 10000 times without being scattered
    const uint32_t *patches;  // [T] patch of each triangle, or NULL: no patches
    size_t patch_count;
    walk_exit exit;           // or NULL
    void *exit_context;
    int channel_first, channel_count; // 0, 0: all three
    int every_ray;            // 1: a ray for every flight, short and deep ones too; changes no result, only the time
} walk_options;

// In W for the light given, per channel, each with its standard error over the batches.
typedef struct walk_total
{
    double value, error;
} walk_total;

typedef struct walk_result
{
    size_t patch_count;
    double *area;     // [P] mm^2
    double *E;        // [P][3] mean irradiance that entered, W/mm^2
    double *B;        // [P][3] radiosity: flux that left/area, W/mm^2
    double *B_error;  // [P][3] its standard error
    double entered[3];  // int E dA, W, exact
    double specular[3]; // reflected at entry, W: int (1 - F_t) cos dA, at vertices; never part of B
    walk_total left[3], absorbed[3], lost[3], cut[3];
    walk_total roulette[3]; // what Russian roulette took less what it gave: 0 on average; closes the balance exactly
    walk_total path[3]; // mm, mean length of the paths of what entered: sum of weight x length, over what entered
    uint64_t photons[3], scatterings[3], rays[3];
    double seconds;   // wall clock
} walk_result;

typedef struct walk_scene walk_scene;

// Copies the mesh; normals are required. NULL on failure (an empty mesh, no memory, no Embree).
walk_scene *walk_scene_create(const sss_mesh *mesh);
void walk_scene_free(walk_scene *scene);

// 0 on success; 1 where an argument is unusable, nothing is lit, or memory ran out: *out is then zeroed.
int walk_run(const walk_scene *scene, const walk_medium *medium, const walk_light *lights, size_t light_count,
             const walk_options *options, walk_result *out);
void walk_result_free(walk_result *result);

// ---- Patches ----

// Cuts a mesh into at most `count` connected patches of nearly equal area, the same ones every time: all triangles grow
// from seeds far from each other along shared edges (vertices that agree in position count as one), then centres move
// to the middles and all is repeated, as Lloyd does. A component smaller than a patch is one, or joins none.
//   patches  [T], every value below the number of patches, which is returned; 0 on failure
size_t walk_patches(const sss_mesh *mesh, size_t count, uint32_t *patches);

// Means over patches of values given at vertices and linear between, weighted by area.
//   values [V][3] -> means [P][3];   area  [P] mm^2, or NULL
void walk_patch_means(const sss_mesh *mesh, const uint32_t *patches, size_t patch_count, const float *values,
                      double *means, double *area);

#endif
