// Text and plain boxes over a picture: captions and legends.
#ifndef EXAMPLES_LABEL_H
#define EXAMPLES_LABEL_H

#include "gl_context.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct label
{
    gl_pass pass;
    GLuint buffer;
    float to_clip[2]; // of a pixel
} label;

// Returns 0, or -1 with the reason in error_text, *out then being empty.
int label_create(const gl_context *context, label *out, char *error_text, size_t error_size);
void label_free(label *l);

// Starts drawing over a picture of this size, in the framebuffer that is bound. All places below are in pixels, from
// the picture's lower left corner, and colours sRGB.
void label_begin(label *l, int width, int height);

void label_box(const label *l, const double low[2], const double high[2], const float color[3]);

// One line of ASCII whose capital letters begin at `at` and are `size` high; returns its width. Anchored at its left
// (-1), middle (0) or right (1).
double label_text(const label *l, const double at[2], double size, int anchor, const float color[3], const char *text);

#ifdef __cplusplus
}
#endif

#endif
