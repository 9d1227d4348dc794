// The sweeps that every method goes through. A method computes the radiosity of a scene in one way or several (series);
// each is compared with the converged integral of its own geometry.

#ifndef SSS_TESTS_STABILITY_SWEEPS_H
#define SSS_TESTS_STABILITY_SWEEPS_H

#include "record.h"
#include "scene.h"

#include <stddef.h>

enum
{
    MOST_SERIES = 3
};

// What a method's stats say, before anybody has compared anything.
typedef struct claim
{
    double predicted;                    // relative L2 error of B
    double edge_paths, border_mm, normals_against;
    int inside_out;
} claim;

typedef struct series
{
    const char *name;
    sss_dipole_geometry geometry;
    double guard;                        // of the reference, 0: none
    double tolerance;                    // relative L2 error that was asked for; 0: none, stats.predicted_error holds
    double regression;                   // the worst error over what was asked for or predicted that has been measured
    double left_out;                     // the largest share of values that cannot be compared, as measured
} series;

typedef struct method
{
    size_t series_count;
    series series[MOST_SERIES];
    // Radiosity under each of the lights, directions of unit length, in place of the scene's own.
    //   B  [series_count][light_count][V][3].   0 on success
    int (*shade)(const scene *s, const double (*lights)[3], size_t light_count, float *const *B,
                 claim *claims);
} method;

// One scene, solved: B and the reference of every series.
typedef struct solution
{
    double *truth[MOST_SERIES];          // [count][3]; series of one geometry and guard share it
    float *B[MOST_SERIES];               // [V][3]
    claim claims[MOST_SERIES];
    outcome outcomes[MOST_SERIES];
    double left_out[MOST_SERIES];        // share of values that are not compared: see sweeps.c
} solution;

int solve(const method *m, const scene *s, solution *out);
void solution_free(solution *s);

// Rows with what solve found.
void rows_of(const method *m, const solution *s, const char *sweep, double x, row rows[MOST_SERIES]);

// Checks what every step has to hold, and records the rows. What was found is kept for close_sweep.
void keep_rows(const method *m, const solution *s, const row rows[MOST_SERIES]);

// Of the sweep since the last call: whether errors stayed within what was asked for and predicted.
void close_sweep(const method *m, const char *sweep);

void sweep_slab(const method *m);
void sweep_sphere(const method *m);
void sweep_albedo(const method *m);
void sweep_half_space(const method *m);
void sweep_slivers(const method *m);
void sweep_fan(const method *m);
void sweep_coarse(const method *m);
void sweep_scale(const method *m);
void sweep_size(const method *m);
void sweep_grazing(const method *m);
void sweep_turning(const method *m);
void sweep_fingers(const method *m);
void sweep_noise(const method *m);
void sweep_normals(const method *m);
void sweep_windings(const method *m);
void sweep_holes(const method *m);

// Closed form of a slab of thickness d, all images of the dipole: shared TRUTH.md 1.4, from Contini et al. 1997.
void slab_of_images(const sss_profile *p, int channel, double d, double *R, double *T);

// Ellipsoids four times as long as wide, `gap` apart along x. The left one comes first. 0 on success.
int make_fingers(int levels, double radius, double gap, mesh_data *out);

#endif
