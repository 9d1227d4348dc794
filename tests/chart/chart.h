// Measuring speed against accuracy. A case is mesh x size x material x light; a run is a method with its parameters
// on a case; measure.c times runs, compares them with the converged reference and appends a line of chart.csv for each.
//
// A new method is one file beside this one that defines a chart_method, and one line in measure.c's table.

#ifndef SSS_TESTS_CHART_H
#define SSS_TESTS_CHART_H

#include "cases.h"

#include <stddef.h>

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
    size_t variant_count; // points of its curve, from the most accurate to the cheapest
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
} chart_method;

extern const chart_method chart_lambert;
extern const chart_method chart_direct;
extern const chart_method chart_direct_points;
extern const chart_method chart_direct_scalar;
extern const chart_method chart_direct_placed;
extern const chart_method chart_bem;
extern const chart_method chart_bem_render;
extern const chart_method chart_bem_solid_angle;

#endif
