// The pipelines that the examples can run, by name: one function and one line of a table each.
#ifndef EXAMPLES_METHODS_H
#define EXAMPLES_METHODS_H

#include <stddef.h>

#include "../../sss_dipole.h"
#include "lights.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

// What only hao heeds; zero is the header's default.
typedef struct method_hao_options
{
    const char *storage;  // references, harmonics, table, float or vectors
    const char *cache;    // a file that keeps the integrals from run to run
    size_t directions, references, order;
} method_hao_options;

typedef struct method_job
{
    sss_mesh mesh;                // with normals
    const sss_profile *profile;
    const float *irradiance;      // [vertex_count][3]
    const lights *lights;         // what it comes from; NULL: not known
    const model *model;           // what lies behind mesh
    method_hao_options hao;
    sss_dipole_geometry geometry; // for methods that leave the choice
    double tolerance;             // relative L2 error; 0: the method's default
    double guard;                 // of placed sources, as sss_bem_options has it; 0: bem's default, negative: none
    int threads;
    int announce;                 // says on stderr how long a long run will take, and how far it is on a terminal
    int report;                   // also measures what only a report shows, where that is cheap
    sss_dipole_advice advice;     // what sss_dipole_needs says of this scene
    sss_dipole_receivers points;  // where radiosity is wanted besides the vertices, with normals; count 0: nowhere
    float *point_radiosity;       // [points.count][3]
    int keep_links;               // bem: links are kept for further lights, which are then one sweep over them
} method_job;

typedef struct method_result
{
    const char *method;       // that ran, where the job left the choice
    double precompute_s;      // once per mesh and material
    double frame_ms;          // again for every light
    double predicted_error;   // relative L2, against the converged integral
    double guard;             // of the sources, as in sss_bem_options; 0: none
    size_t bytes;             // held between frames
    int has_points;           // point_radiosity is filled: not by lambert, which is linear between vertices anyway,
                              // and not by hao, which knows vertices alone
    double points_ms;         // that took
    char parameters[1024];    // what the method resolved: key=value lines
    sss_dipole_geometry geometry; // of the dipole, as it was taken
} method_result;

// Fills radiosity [vertex_count][3]. Returns 0, or -1 with the reason in error_text.
typedef int (*method_function)(const method_job *job, float *radiosity, method_result *result, char *error_text,
                               size_t error_size);

// Integrals for all lights, kept, and the job's lights from them: sss_hao.h.
int method_hao(const method_job *job, float *radiosity, method_result *result, char *error_text, size_t error_size);

// What job->advice ranks first, if that keeps to the tolerance by its own prediction; else the next one.
int method_auto(const method_job *job, float *radiosity, method_result *result, char *error_text, size_t error_size);

// NULL for an unknown name.
method_function method_by_name(const char *name);

// "placed" or "distance", where that is all a method can do; NULL where the job chooses, or for an unknown name.
const char *method_geometry(const char *name);

// Whether method_hao knows this storage.
int method_hao_storage(const char *name);

// The name of a sss_hao_storage; "" for others.
const char *method_hao_storage_name(int storage);

#define METHOD_BEM_TIGHTEST 1e-4 // tolerance of bem, see sss_bem_options

// "direct, lambert, ...": one line of help a method, the index-th of them; NULL behind the last.
const char *method_help(size_t index);

#ifdef __cplusplus
}
#endif

#endif
