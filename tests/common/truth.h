// Files of radiosity by random walk (walk.h), and the error of the dipole model measured with them. A file holds the
// mean radiosity of patches of a mesh with standard errors; it is small, and says how to make it again and a hash of
// what it was made from. The reader refuses a file whose hash differs from the case at hand.
//
//     truth_case c = {"bunny", &mesh, &profile, irradiance, "front"};
//     truth t;
//     truth_error e;
//     if (truth_read("tests/chart/truth/NAME.csv", &c, &t) == TRUTH_OK)
//     {
//         truth_model_error(&t, &c, B, &e); // e.rel_l2, e.noise
//         truth_free(&t);
//     }

#ifndef SSS_TESTS_TRUTH_H
#define SSS_TESTS_TRUTH_H

#include "walk.h"

#include <stddef.h>
#include <stdint.h>

// What a result depends on. Only what is inside is compared, names are for people; the light is compared by the
// irradiance that it gives.
typedef struct truth_case
{
    const char *mesh_name;
    const sss_mesh *mesh;
    const sss_profile *profile;
    const float *irradiance; // [V][3] W/mm^2, entering Fresnel included
    const char *light_name;
} truth_case;

typedef struct truth_settings
{
    double g;         // 0: isotropic with reduced coefficients
    uint64_t photons; // per channel
    uint64_t seed;
    size_t patches;   // asked for
    uint64_t scatterings_max; // 0: no limit
} truth_settings;

typedef struct truth
{
    truth_settings settings;
    size_t patch_count;
    uint32_t *patches; // [T]
    double *area;      // [P] mm^2
    double *E;         // [P][3] mean irradiance
    double *B;         // [P][3] radiosity
    double *B_error;   // [P][3] standard error
    double lost, cut;  // shares of what entered, the worst channel
    uint64_t scatterings; // that it took, all channels; 0 when read from a file
} truth;

typedef enum truth_status
{
    TRUTH_OK = 0,
    TRUTH_NONE,      // there is no such file
    TRUTH_STALE,     // it was made from something else: make it again with the command in its first line
    TRUTH_BROKEN,    // it is no such file, or damaged
    TRUTH_NO_MEMORY
} truth_status;

const char *truth_status_string(truth_status status);

// Free with truth_free, also on failure (*out is then zeroed).
truth_status truth_read(const char *path, const truth_case *c, truth *out);
void truth_free(truth *t);

// command: what makes the file again. 0 on success.
int truth_write(const char *path, const truth_case *c, const char *command, const truth *t);

// FNV-1a over the mesh (positions, normals, triangles, scale), the material, the light's name, the settings and
// WALK_VERSION.
uint64_t truth_hash(const truth_case *c, const truth_settings *settings);

// Runs the walk. 0 on success; 1 also where the lights do not give the case's irradiance (1e-4, relative L2 over
// patches).
int truth_make(const truth_case *c, const walk_light *lights, size_t light_count, const truth_settings *settings,
               const sss_hooks *hooks, truth *out);

// Relative L2 error over patches, all three channels, weighted by area:
//   rel_l2^2 = max(0, sum A (B - B_truth)^2 - sum A s^2)/norm^2,   norm^2 = sum A B_truth^2 - sum A s^2,
// with s the standard error of B_truth.
typedef struct truth_error
{
    double rel_l2;         // the variance of the truth's noise is subtracted; infinite where there is only noise
    double rel_l2_error;   // one standard error of rel_l2, from the truth's noise
    double noise;          // relative L2 norm of the truth's standard errors: what was subtracted
    double rel_l2_rgb[3];  // each channel by itself, over its own norm; 0 where a channel is dark
    double mean_ratio[3];  // flux of B over flux of the truth
} truth_error;

// How far two truths of one case are from each other, e.g. with and without g: relative L2 over `of`, the noise of both
// subtracted; noise: what was. The same patches are required: 0 on success.
int truth_difference(const truth *t, const truth *of, double *rel_l2, double *noise);

// B [V][3] at the vertices of the case's mesh, linear between.
void truth_model_error(const truth *t, const truth_case *c, const float *B, truth_error *out);

#endif
