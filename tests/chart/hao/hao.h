// The paper's measurements again: figures 4, 5, 6 and 9, the quantiser's signal to noise, table I of Hao and Varshney
// 2004, and the bars of this project. Each writes one CSV file.

#ifndef SSS_TESTS_CHART_HAO_H
#define SSS_TESTS_CHART_HAO_H

#include "../../../sss_dipole.h"
#include "../../../sss_hao.h"
#include "../../common/experiments.h"
#include "../../common/meshes.h"
#include "../../common/views.h"

#include <stddef.h>

typedef struct hao_settings
{
    const char *folder;    // of the files that are written
    int threads;
    int quick;             // small meshes, small pictures, few steps: to see that it runs
    int dragon;            // table I goes on to the dragon with 437,645 vertices
    size_t views, side;    // pictures of a light, and their size
    size_t lights;         // of the figures
} hao_settings;

// A mesh with marble, as large as is said.
typedef struct hao_model
{
    const char *name;
    mesh_data mesh;
    sss_mesh view;
    sss_profile profile;
    views *pictures;
} hao_model;

// Returns 0; 1, with a note on stderr, where there is no such mesh. quick: thinned.
int hao_load(const hao_settings *s, const char *name, double size_mm, hao_model *out);
void hao_unload(hao_model *m);

// Hooks with as many threads as the settings say; the settings must outlive what is made with them.
sss_hooks hao_hooks(const hao_settings *s);

// Lights at random, the same for every figure: w [3 * count].
void hao_lights(size_t count, double *w);

// The exact result under these lights, neither interpolated nor compressed: B [count][V][3], to be freed; NULL on
// failure.
float *hao_truth(const hao_settings *s, const hao_model *m, int no_shadows, const double *w, size_t count);

// An object's B under each light against another's: the largest and the mean difference of tone-mapped pictures over
// all lights and views, the largest of linear ones, and rel_l2 of B.
typedef struct hao_errors
{
    double rmse, rmse_mean, rmse_linear, rel_l2;
} hao_errors;

hao_errors hao_compare(const hao_model *m, sss_hao *hao, const double *w, size_t count, const float *truth);

// B of an object under each light: [count][V][3], to be freed.
float *hao_radiosities(sss_hao *hao, const double *w, size_t count, size_t V);

// All return 0, or nonzero on failure with a message.
int hao_figure5(const hao_settings *s); // error against the number of directions
int hao_figure9(const hao_settings *s); // error against the number of reference points, and of harmonics alone
int hao_numbers(const hao_settings *s); // the quantiser, Q against q
int hao_table1(const hao_settings *s);
int hao_bars(const hao_settings *s);    // rel_l2 against the reference, image RMSE, with the default options

#endif
