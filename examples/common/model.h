// Triangle meshes from and to glTF 2.0 (.glb, .gltf), through tinygltf.
#ifndef EXAMPLES_MODEL_H
#define EXAMPLES_MODEL_H

#include <stddef.h>
#include <stdint.h>

#include "../../sss_dipole.h"

#ifdef __cplusplus
extern "C" {
#endif

// One mesh in the scene's frame: every triangle primitive of every node, in the order in which the scene visits
// them. A primitive's vertices keep their order, referenced or not; primitives of one mesh that name the same
// attributes share them.
typedef struct model
{
    float *positions;    // [3 vertex_count], finite
    float *normals;      // [3 vertex_count], unit length; computed where the file has none
    uint32_t *triangles; // [3 triangle_count], counter-clockwise from outside, also in mirrored nodes
    size_t vertex_count;
    size_t triangle_count;
    int turned;          // 1: the file's surface is closed and inside out, so windings and normals were turned round
} model;

// Reads a file. Every offset, count and index in it is checked against the bytes that are there, so that a
// hostile file gives an error and nothing else. Animations, skins and morph targets are left at rest.
// Returns 0, or -1 with the reason in error_text [error_size], *out then being empty.
int model_load(const char *path, model *out, char *error_text, size_t error_size);

// Frees the arrays; an empty model is allowed.
void model_free(model *m);

// Writes a binary glTF with POSITION, NORMAL, COLOR_0 (float, linear) and indices, unlit, so that viewers show
// the colours as they are.   colors [3 vertex_count]
// Returns 0, or -1 with the reason in error_text.
int model_save_glb(const char *path, const model *m, const float *colors, char *error_text, size_t error_size);

// A mesh with a texture.
typedef struct model_textured
{
    const float *positions, *normals; // [3 vertex_count]
    const float *uv;                  // [2 vertex_count] as in glTF: v runs downwards, from 0 at the picture's top
    const uint32_t *triangles;        // [3 triangle_count]
    size_t vertex_count, triangle_count;
    const unsigned char *png;         // sRGB, goes into the file
    size_t png_bytes;
    double white;                     // what 1 in the picture stands for: the material's extras.white
} model_textured;

// Writes a binary glTF with POSITION, NORMAL, TEXCOORD_0, indices and the base colour texture, unlit.
// Returns 0, or -1 with the reason in error_text.
int model_save_textured_glb(const char *path, const model_textured *m, char *error_text, size_t error_size);

// The model as the library takes it: a view that lives as long as the model.
sss_mesh model_mesh(const model *m, double mm_per_unit);

// The corners of the box around the vertices, and its largest extent.
double model_bounds(const model *m, double low[3], double high[3]);

#ifdef __cplusplus
}
#endif

#endif
