// Pictures drawn off screen, anti-aliased.
#ifndef EXAMPLES_OFFSCREEN_H
#define EXAMPLES_OFFSCREEN_H

#include <stddef.h>

#include "gl_context.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct offscreen_size
{
    int width, height; // pixels
    int supersample;   // samples along each side of a pixel
} offscreen_size;

// Calls draw(user, width, height), which draws into the framebuffer that is bound, at supersample times the size, and
// reduces the result to rgb [height][width][3], top row first. Returns 0, or -1 with the reason in error_text.
int offscreen_draw(const gl_context *context, const offscreen_size *size,
                   void (*draw)(void *user, int width, int height), void *user, unsigned char *rgb, char *error_text,
                   size_t error_size);

// The same into a PNG file.
int offscreen_write_png(const gl_context *context, const offscreen_size *size,
                        void (*draw)(void *user, int width, int height), void *user, const char *path,
                        char *error_text, size_t error_size);

#ifdef __cplusplus
}
#endif

#endif
