#include "offscreen.h"

#include <stdio.h>
#include <stdlib.h>

#include "image.h"

static int draw_large(const gl_context *context, int width, int height,
                      void (*draw)(void *user, int width, int height), void *user, unsigned char *rgb)
{
    const gl_functions *const gl = gl_context_functions(context);
    GLuint frame, stores[2];
    gl->GenFramebuffers(1, &frame);
    gl->GenRenderbuffers(2, stores);
    gl->BindFramebuffer(GL_FRAMEBUFFER, frame);
    gl->BindRenderbuffer(GL_RENDERBUFFER, stores[0]);
    gl->RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
    gl->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, stores[0]);
    gl->BindRenderbuffer(GL_RENDERBUFFER, stores[1]);
    gl->RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, width, height);
    gl->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, stores[1]);
    int status = -1;
    if (gl->CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE)
    {
        draw(user, width, height);
        status = gl_context_read_rgb(context, width, height, rgb);
    }
    gl->BindFramebuffer(GL_FRAMEBUFFER, 0);
    gl->DeleteFramebuffers(1, &frame);
    gl->DeleteRenderbuffers(2, stores);
    return status;
}

int offscreen_draw(const gl_context *context, const offscreen_size *size,
                   void (*draw)(void *user, int width, int height), void *user, unsigned char *rgb, char *error_text,
                   size_t error_size)
{
    const int w = size->width * size->supersample, h = size->height * size->supersample;
    unsigned char *const large = malloc(3 * (size_t)w * (size_t)h);
    if (!large || draw_large(context, w, h, draw, user, large) != 0)
    {
        snprintf(error_text, error_size, "a picture of %d x %d pixels, %d samples each, is too large to draw",
                 size->width, size->height, size->supersample * size->supersample);
        free(large);
        return -1;
    }
    image_reduce(large, size->supersample, size->width, size->height, rgb);
    free(large);
    return 0;
}

int offscreen_write_png(const gl_context *context, const offscreen_size *size,
                        void (*draw)(void *user, int width, int height), void *user, const char *path,
                        char *error_text, size_t error_size)
{
    unsigned char *const rgb = malloc(3 * (size_t)size->width * (size_t)size->height);
    int status = -1;
    if (!rgb)
    {
        snprintf(error_text, error_size, "out of memory");
    }
    else if (offscreen_draw(context, size, draw, user, rgb, error_text, error_size) == 0)
    {
        status = image_write_png(path, size->width, size->height, rgb, error_text, error_size);
    }
    free(rgb);
    return status;
}
