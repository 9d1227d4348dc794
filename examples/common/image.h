// Pictures to PNG files.
#ifndef EXAMPLES_IMAGE_H
#define EXAMPLES_IMAGE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

// Writes 8-bit sRGB, top row first, 3 width height bytes. Returns 0, or -1 with the reason in error_text.
int image_write_png(const char *path, int width, int height, const unsigned char *rgb, char *error_text,
                    size_t error_size);

// The same into memory, *size bytes to be freed. NULL where memory ends.
unsigned char *image_encode_png(int width, int height, const unsigned char *rgb, size_t *size);

// Makes a picture `factor` times smaller: the mean of each block in linear light, which is what keeps edges smooth,
// with a dither below one step of the 8 bits, which is what keeps dark gradients free of bands.
//   in  [factor height][factor width][3] sRGB;   out  [height][width][3] sRGB
void image_reduce(const unsigned char *in, int factor, int width, int height, unsigned char *out);

#ifdef __cplusplus
}
#endif

#endif
