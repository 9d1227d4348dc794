// What stands behind an object: a dim wall with a glow in the middle.
#ifndef EXAMPLES_BACKDROP_H
#define EXAMPLES_BACKDROP_H

#include <stddef.h>

#include "gl_context.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct backdrop
{
    gl_pass pass;
} backdrop;

// Returns 0, or -1 with the reason in error_text, *out then being empty.
int backdrop_create(const gl_context *context, backdrop *out, char *error_text, size_t error_size);
void backdrop_free(backdrop *b);

// Fills the framebuffer that is bound.   colors  below and above, sRGB in [0,1]
void backdrop_draw(const backdrop *b, const double colors[2][3]);

#ifdef __cplusplus
}
#endif

#endif
