// Plane layers with known reflectance and transmittance (shared/TRUTH.md, section 1), and the random walk on them: the
// walk of walk.h in a closed box of twelve triangles, wide enough that nothing leaves through its sides.

#ifndef SSS_TESTS_WALK_BENCH_H
#define SSS_TESTS_WALK_BENCH_H

#include "walk.h"

#include <stddef.h>

typedef struct bench_layer
{
    const char *source;  // where the numbers are from
    double albedo;       // sigma_s/sigma_t; sigma_t = 1/mm
    double depth;        // mm; 0: a half space
    double g, eta;
    double cosine;       // of the angle of incidence, outside; 0: Lambertian incidence
    double R, T;         // of what falls on it, specular reflection included; T < 0: not known
    double digits;       // half a unit in the last digit given
} bench_layer;

extern const bench_layer bench_layers[];
extern const size_t bench_layer_count;

typedef struct bench_result
{
    walk_total R, T;
    double sides; // share that left through the sides: must be next to nothing
    walk_result walk; // W of 1 W that fell on it, only the first channel; its arrays are freed
} bench_result;

// 0 on success.
int bench_run(const bench_layer *layer, uint64_t photons, uint64_t seed, const sss_hooks *hooks, bench_result *out);

// ---- Where light leaves a half space: shares of what entered, in rings about the beam ----

enum
{
    BENCH_RINGS = 14
};

extern const double bench_ring_edges[BENCH_RINGS + 1]; // in units of 1/sigma_t'; the last is infinite

typedef struct bench_profile
{
    const char *name;
    double albedo, g, eta; // albedo: not reduced; sigma_t' = 1/mm
    double flux[BENCH_RINGS], error[BENCH_RINGS]; // MCML's, and their standard errors
    double allowance;      // relative, beyond the errors: what the file of facts says of MCML's own bias
} bench_profile;

extern const bench_profile bench_profiles[];
extern const size_t bench_profile_count;

int bench_run_profile(const bench_profile *profile, uint64_t photons, uint64_t seed, const sss_hooks *hooks,
                      walk_total rings[BENCH_RINGS]);

#endif
