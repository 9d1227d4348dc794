// Draws one object side by side as its radiosity comes from three objects of sss_hao.h: uncompressed, spherical
// harmonics, reference points; then what the last two are off, magnified. Captions say what each costs.
#ifndef EXAMPLES_HAO_VIEW_H
#define EXAMPLES_HAO_VIEW_H

#include <stddef.h>

#include "../../sss_hao.h"
#include "camera.h"
#include "gl_context.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct hao_view hao_view; // a mesh and its radiosities on the graphics card

enum
{
    HAO_VIEW_FLOAT, // uncompressed: what the others are compared with
    HAO_VIEW_HARMONICS,
    HAO_VIEW_REFERENCES,
    HAO_VIEWS,
    HAO_LINES = 5 // of the heading; only the first is drawn where all panels are in a row
};

// One picture.
typedef struct hao_look
{
    camera eye;
    double exposure, to_light[3];
    double bytes[HAO_VIEWS]; // of a vertex
    double ms[HAO_VIEWS];    // of relighting
    double error[HAO_VIEWS]; // of radiosity, relative L2; NaN: not known
    char heading[HAO_LINES][64];
} hao_look;

// The material gives the exit factor. NULL on failure, with the reason in error_text.
hao_view *hao_view_create(gl_context *context, const model *m, const sss_profile *profile, char *error_text,
                          size_t error_size);
void hao_view_free(hao_view *v);

// The radiosity [vertex_count][3] of a view.
void hao_view_set_radiosity(hao_view *v, int view, const float *radiosity);

// The vertex shader computes that of HAO_VIEW_REFERENCES itself (sss_hao_glsl): of an object that is uploaded once, and
// for each light from what its reference points radiate. This lasts until hao_view_set_radiosity of that view.
// Both return 0, or -1 with the reason in error_text.
int hao_view_set_object(hao_view *v, const sss_hao *hao, char *error_text, size_t error_size);
//   lighting  [stats.lighting_count][3] of that object
int hao_view_set_lighting(hao_view *v, const sss_hao *hao, const float *lighting, char *error_text, size_t error_size);

// Draws into the framebuffer that is bound: five panels in a row, or three above two where the picture is not wide.
void hao_view_draw(const hao_view *v, const hao_look *look, int width, int height);

// The height of a picture of this width that has its panels in a row.
int hao_view_height(int width);

// The L2 norm of a - b over that of b.   a, b  [count]
double hao_view_difference(const float *a, const float *b, size_t count);

#ifdef __cplusplus
}
#endif

#endif
