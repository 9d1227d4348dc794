// A textured glTF file as a viewer sees it, read with nothing but tinygltf.

#ifndef SSS_TESTS_TEXTURED_H
#define SSS_TESTS_TEXTURED_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct textured
{
    float *positions, *normals; // [vertex_count][3]
    float *uv;                  // [vertex_count][2] TEXCOORD_0
    uint32_t *triangles;        // [triangle_count][3]
    unsigned char *rgb;         // [height][width][3] base colour, top row first
    size_t vertex_count, triangle_count;
    int width, height;
    int unlit, clamped;         // KHR_materials_unlit; both wraps clamp to the edge
    double white;               // of the material's extras, NaN where it has none
} textured;

// The first primitive of the first mesh. Returns 0, or -1 with the reason in error_text and *out empty.
int textured_load(const char *path, textured *out, char *error_text, size_t error_size);
void textured_free(textured *t);

// A bilinear fetch in linear light, as glTF 2.0 asks for: sRGB, v runs downwards, clamped at the edges.
void textured_fetch(const textured *t, double u, double v, double out[3]);

#ifdef __cplusplus
}
#endif

#endif
