#include "image.h"

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>

typedef struct png_file
{
    FILE *file;
    int failed;
} png_file;

static void append(void *context, void *data, int size)
{
    png_file *const png = context;
    png->failed = png->failed || fwrite(data, 1, (size_t)size, png->file) != (size_t)size;
}

int image_write_png(const char *path, int width, int height, const unsigned char *rgb, char *error_text,
                    size_t error_size)
{
    png_file png = {fopen(path, "wb"), 0};
    if (!png.file)
    {
        snprintf(error_text, error_size, "cannot write %s: %s", path, strerror(errno));
        return -1;
    }
    const int written = stbi_write_png_to_func(append, &png, width, height, 3, rgb, 3 * width);
    if (fclose(png.file) != 0 || png.failed || !written)
    {
        snprintf(error_text, error_size, "cannot write %s: disk full or out of memory", path);
        return -1;
    }
    return 0;
}

typedef struct png_memory
{
    unsigned char *bytes;
    size_t size;
} png_memory;

static void keep(void *context, void *data, int size)
{
    png_memory *const png = context;
    png->bytes = malloc((size_t)size);
    if (png->bytes)
    {
        memcpy(png->bytes, data, (size_t)size);
        png->size = (size_t)size;
    }
}

unsigned char *image_encode_png(int width, int height, const unsigned char *rgb, size_t *size)
{
    png_memory png = {NULL, 0};
    stbi_write_png_to_func(keep, &png, width, height, 3, rgb, 3 * width); // calls back once
    *size = png.size;
    return png.bytes;
}

// IEC 61966-2-1
static double to_linear(double s)
{
    return s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
}

static double to_srgb(double l)
{
    return l <= 0.0031308 ? 12.92 * l : 1.055 * pow(l, 1.0 / 2.4) - 0.055;
}

// A number in [0, 1) from a pixel's place: the same picture every time.
static double noise(uint32_t x, uint32_t y, uint32_t channel)
{
    uint32_t h = x * 0x8da6b343u ^ y * 0xd8163841u ^ channel * 0xcb1ab31fu;
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return (double)(h ^ h >> 16) / 4294967296.0;
}

void image_reduce(const unsigned char *in, int factor, int width, int height, unsigned char *out)
{
    double linear[256];
    for (int i = 0; i < 256; ++i)
    {
        linear[i] = to_linear(i / 255.0);
    }
    const size_t f = (size_t)factor, w = (size_t)width, h = (size_t)height;
    for (size_t y = 0; y < h; ++y)
    {
        for (size_t x = 0; x < w; ++x)
        {
            for (size_t c = 0; c < 3; ++c)
            {
                double sum = 0.0;
                for (size_t i = 0; i < f * f; ++i)
                {
                    sum += linear[in[3 * ((f * y + i / f) * f * w + f * x + i % f) + c]];
                }
                const double steps = 255.0 * to_srgb(sum / (double)(f * f));
                const double dithered = floor(steps + noise((uint32_t)x, (uint32_t)y, (uint32_t)c));
                out[3 * (y * w + x) + c] = (unsigned char)(dithered > 255.0 ? 255.0 : dithered);
            }
        }
    }
}
