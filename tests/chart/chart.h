// Measuring speed against accuracy. A case is mesh x size x material x light; a run is a method with its parameters on
// a case; chart_measure times runs, compares them with the converged reference and writes a line of chart.csv for each.
//
// A new method is one file beside this one that defines a chart_method, and one line in measure.c's table. This folder
// is a library (build/libchart.a) without the implementations of the headers: who links it defines them once.

#ifndef SSS_TESTS_CHART_H
#define SSS_TESTS_CHART_H

#include "cases.h"

#include <stddef.h>
#include <stdio.h>

// Receivers: vertices of the case's mesh. A method that stores radiosity at vertices takes the indices, one that
// gathers anywhere the positions.
typedef struct chart_rows
{
    size_t *indices;  // [count]
    float *positions; // [3 count]
    float *normals;   // [3 count]
    size_t count;
} chart_rows;

// A method at work on a case.
typedef struct chart_run
{
    void *state;          // the method's own
    char parameters[256]; // key=value, separated by ';', for people and for the drawing
    size_t bytes;         // that the precomputation keeps
    double error_bound;   // relative L2 error that the method predicts; 0: none
    double shared_s;      // seconds of precomputation that another run of this case has already spent for this one
    void **shared;        // a place for what the method's runs of one case share; method->forget frees it
    int threads;
    const sss_hooks *hooks;
} chart_run;

// What a method's results are compared with: the same integral, with the same placing of the sources.
typedef enum chart_reference
{
    CHART_DISTANCE = 0, // R_d of the distance only
    CHART_PLACED,       // sources placed at the receiver
    CHART_GUARDED,      // the same with sss_bem.h's default guard against sources close to the surface
    CHART_REFERENCE_COUNT
} chart_reference;

typedef struct chart_method
{
    const char *name;
    size_t variant_count; // points of its curve
    // All return 0, or nonzero on failure. prepare: all that does not depend on the light; CHART_LEFT_OUT where the
    // method is not for this case.
    int (*prepare)(const chart_case *c, size_t variant, chart_run *run);
    // What must be done again when the light changes, save for what grows with the number of receivers ...
    int (*relight)(const chart_case *c, chart_run *run);
    // ... and the rest: B of these receivers.   radiosity [count][3]
    int (*radiosity)(const chart_case *c, chart_run *run, const chart_rows *rows, float *radiosity);
    void (*release)(chart_run *run);
    chart_reference reference;
    int (*predict)(chart_run *run); // measures run->error_bound for the present light, outside all times; may be NULL
    // What must be done before the next frame when vertices have moved; the last that is asked of a run. NULL: all of
    // prepare.
    int (*rebuild)(const chart_case *c, chart_run *run, const mesh_data *moved);
    void (*forget)(void *shared); // may be NULL
} chart_method;

extern const chart_method chart_lambert;
extern const chart_method chart_direct;
extern const chart_method chart_direct_points;
extern const chart_method chart_direct_scalar;
extern const chart_method chart_direct_placed;
extern const chart_method chart_bem;
extern const chart_method chart_bem_render;
extern const chart_method chart_bem_solid_angle;
extern const chart_method chart_hao;

// The table of methods; NULL behind its end.
const chart_method *chart_method_at(size_t index);

// ---- the converged reference of a case ----

typedef struct chart_truth
{
    chart_rows rows;
    double *B;             // [count][3]
    double *weights;       // [count] area, mesh units
    double error;          // relative L2 error of the reference's own estimate
    struct picture *best;  // what pictures are compared with; NULL where there is none
    double model_l2;       // of this dipole against the volumetric random walk; negative: not known
    double model_noise;    // its standard error, from the noise of the walk
} chart_truth;

// Every step-th vertex. Returns 0, or nonzero; free in any case.
int chart_rows_create(const chart_case *c, size_t step, chart_rows *rows);
void chart_rows_free(chart_rows *rows);

// "", "placed ", "guarded placed ".
const char *chart_reference_name(chart_reference kind);

// At about so many vertices spread over the mesh, on all processors. Returns 0, or nonzero; free in any case.
int chart_truth_create(const chart_case *c, chart_reference kind, size_t receivers, chart_truth *t);
void chart_truth_free(chart_truth *t);

// DESIGN.md: area-weighted L2 norm of B - B_ref over that of B_ref; largest difference over the largest B_ref.
//   B  [rows.count][3]
void chart_compare(const chart_truth *t, const float *B, double *rel_l2, double *rel_max);

// Sets t->model_l2 and model_noise from a case's radiosity at all vertices, where tests/chart/truth, seen from the
// current folder, has a walk of it.
//   B  [V][3] converged, of the dipole that t stands for
void chart_model_error(const chart_case *c, const float *B, chart_truth *t);

// ---- measuring ----

typedef struct chart_settings
{
    size_t receivers;     // of the reference
    int threads, runs;    // of each time the median of so many frames, at least 5
    int rounds;           // how often runs of the front are made
    double seconds;       // a frame's limit: beyond it every k-th vertex is computed
    size_t variants_max;  // of a method, for a quick look
    const char *method;   // only methods whose names match this pattern of fnmatch(); NULL: all
    FILE *log;            // a line for each run; NULL: none
} chart_settings;

chart_settings chart_defaults(void);

// The first line of chart.csv, without its end.
extern const char chart_columns[];

// Runs the methods on a case and writes a line for each run; none where all are left out. What fails is said on stderr,
// and the rest goes on. Returns 0; 1 where something failed.
int chart_measure(const chart_case *c, const chart_settings *s, FILE *csv);

// The chart of one object: chart.csv, chart.svg and chart.md in a folder, which is made where it is not there, and the
// tables on stdout. The drawing is done by the scripts of this folder.
//   program  argv[0] of a program in build/, from where the scripts are found
//   folder   NULL: only the tables
// Returns 0; 1 with a message on stderr.
int chart_write(const chart_case *c, const chart_settings *s, const char *program, const char *folder);

#endif
