// The lines of a chart.csv, by case. Columns are found by their names, so that new ones do no harm.

#ifndef SSS_TESTS_CHART_CHOICE_RUNS_H
#define SSS_TESTS_CHART_CHOICE_RUNS_H

#include "../../../sss_dipole.h"

#include <stddef.h>

// One measured run.
typedef struct measured_run
{
    char method[32];
    size_t which;     // case
    double tolerance; // of its parameters; 0: none
    double density;   // emitters over triangles, the nearest power of 4; 1: none
    int directions;   // hao; 0: none
    int storage;      // hao, a sss_hao_storage
    double precompute_s, frame_ms, rebuild_ms, bytes, rel_l2;
} measured_run;

// Mesh x size x material x light.
typedef struct measured_case
{
    char name[160];
    char mesh[32], material[32], light[32];
    sss_profile profile;
    sss_dipole_scene scene; // without tolerance and what changes
    double model_l2;        // of the model against the random walk, the least of all methods; negative: none
} measured_case;

typedef struct measured
{
    measured_run *runs;
    measured_case *cases;
    size_t run_count, case_count;
} measured;

// What sss_dipole_measure says of a mesh whose largest extent is 1 mm.
typedef struct measured_mesh
{
    char name[32];
    double area_mm2, volume_mm3, spacing_mm;
} measured_mesh;

enum
{
    MESHES_MAX = 32
};

// The lines of choice/meshes.csv. Returns how many; 0 with a message on stderr.
size_t meshes_read(const char *path, measured_mesh out[MESHES_MAX]);

// meshes: what the chart does not say of its cases. Returns 0, or 1 with a message on stderr.
int measured_read(const char *path, const measured_mesh *meshes, size_t mesh_count, measured *out);
void measured_free(measured *m);

#endif
