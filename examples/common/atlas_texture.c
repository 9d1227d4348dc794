#include "atlas_texture.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image.h"
#include "services.h"
#include "threads.h"

enum
{
    RINGS = 16 // by which the picture is filled beyond its texels: four mipmaps stay clean
};

static int fail(const char *what, sss_result why, char *error_text, size_t error_size)
{
    snprintf(error_text, error_size, "%s: %s", what, sss_result_string(why));
    return -1;
}

static void parallel_for(void *user, size_t count, void (*task)(void *context, size_t begin, size_t end),
                         void *context)
{
    threads_parallel_for(*(const int *)user, count, task, context);
}

// ---- the texels as receivers ----

// The triangle's own normal; up where it has none either.
static void face_normal(const sss_mesh *mesh, uint32_t triangle, float out[3])
{
    const uint32_t *const v = mesh->triangles + 3 * (size_t)triangle;
    double e[2][3], n[3];
    for (size_t i = 0; i < 6; ++i)
    {
        e[i / 3][i % 3] = (double)mesh->positions[3 * (size_t)v[1 + i / 3] + i % 3] -
                          (double)mesh->positions[3 * (size_t)v[0] + i % 3];
    }
    for (int k = 0; k < 3; ++k)
    {
        n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
    }
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; ++k)
    {
        out[k] = length > 0.0 ? (float)(n[k] / length) : (float)(k == 1);
    }
}

typedef struct item
{
    uint64_t key;
    uint32_t texel;
} item;

static int by_key(const void *a, const void *b)
{
    const item *const x = a, *const y = b;
    return (x->key > y->key) - (x->key < y->key);
}

// Bits of u and v in turn: texels of one number but for its last bits are in one square (Morton order).
static uint64_t interleave(uint64_t u, uint64_t v)
{
    uint64_t out = 0;
    for (int bit = 0; bit < 16; ++bit)
    {
        out |= (u >> bit & 1) << (2 * bit) | (v >> bit & 1) << (2 * bit + 1);
    }
    return out;
}

// Chart by chart, square by square.
static int make_order(const atlas_texture *t)
{
    const size_t count = t->texels.count, size = t->texels.size;
    item *const items = malloc((count + 1) * sizeof *items);
    for (size_t i = 0; i < count && items; ++i)
    {
        items[i].key = (uint64_t)t->mesh.chart[t->texels.triangle[i]] << 32 |
                       interleave(t->texels.texel[i] % size, t->texels.texel[i] / size);
        items[i].texel = (uint32_t)i;
    }
    if (items)
    {
        qsort(items, count, sizeof *items, by_key);
    }
    for (size_t i = 0; i < count && items; ++i)
    {
        t->order[i] = items[i].texel;
    }
    free(items);
    return items ? 0 : -1;
}

static int make_points(atlas_texture *t, const sss_mesh *mesh)
{
    const size_t count = t->texels.count;
    t->order = malloc((count + 1) * sizeof *t->order);
    t->values = calloc(12 * count + 1, sizeof *t->values);
    if (!t->order || !t->values || make_order(t) != 0)
    {
        return -1;
    }
    t->positions = t->values + 3 * count;
    t->normals = t->positions + 3 * count;
    t->gathered = t->normals + 3 * count;
    for (size_t i = 0; i < count; ++i)
    {
        const size_t k = t->order[i];
        const float *const n = t->texels.normal + 3 * k;
        memcpy(t->positions + 3 * i, t->texels.position + 3 * k, 3 * sizeof *n);
        if (n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0.0f)
        {
            memcpy(t->normals + 3 * i, n, 3 * sizeof *n);
        }
        else
        {
            face_normal(mesh, t->texels.triangle[k], t->normals + 3 * i);
        }
    }
    return 0;
}

int atlas_texture_create(const sss_mesh *mesh, const sss_atlas_options *options, int threads, atlas_texture *out,
                         char *error_text, size_t error_size)
{
    const sss_hooks hooks = {.user = &threads, .parallel_for = parallel_for};
    memset(out, 0, sizeof *out);
    const double start = services_seconds();
    sss_result result = sss_atlas_create(mesh, options, &hooks, &out->atlas);
    out->seconds = services_seconds() - start;
    if (result == SSS_ERROR_INVALID_ARGUMENT)
    {
        snprintf(error_text, error_size, "the charts of this mesh do not fit into %zu x %zu texels: take more",
                 options->size, options->size);
        return -1;
    }
    result = result == SSS_OK ? sss_atlas_get_mesh(out->atlas, &out->mesh) : result;
    result = result == SSS_OK ? sss_atlas_get_texels(out->atlas, &out->texels) : result;
    if (result == SSS_OK && make_points(out, mesh) != 0)
    {
        result = SSS_ERROR_OUT_OF_MEMORY;
    }
    if (result != SSS_OK)
    {
        atlas_texture_free(out);
        return fail("atlas", result, error_text, error_size);
    }
    return 0;
}

void atlas_texture_free(atlas_texture *t)
{
    sss_atlas_free(t->atlas);
    free(t->order);
    free(t->values);
    free(t->png);
    memset(t, 0, sizeof *t);
}

// ---- values ----

void atlas_texture_interpolate(atlas_texture *t, const sss_mesh *mesh, const float *radiosity)
{
    for (size_t i = 0; i < t->texels.count; ++i)
    {
        const uint32_t *const v = mesh->triangles + 3 * (size_t)t->texels.triangle[i];
        const float *const share = t->texels.barycentric + 3 * i;
        for (size_t c = 0; c < 3; ++c)
        {
            double sum = 0.0;
            for (size_t k = 0; k < 3; ++k)
            {
                sum += (double)share[k] * (double)radiosity[3 * (size_t)v[k] + c];
            }
            t->values[3 * i + c] = (float)sum;
        }
    }
}

void atlas_texture_take_gathered(atlas_texture *t)
{
    for (size_t i = 0; i < t->texels.count; ++i)
    {
        memcpy(t->values + 3 * (size_t)t->order[i], t->gathered + 3 * i, 3 * sizeof *t->values);
    }
}

// IEC 61966-2-1, to the nearest of 256 steps.
static unsigned char to_srgb(double linear)
{
    const double l = fmin(1.0, fmax(0.0, linear));
    return (unsigned char)(255.0 * (l <= 0.0031308 ? 12.92 * l : 1.055 * pow(l, 1.0 / 2.4) - 0.055) + 0.5);
}

int atlas_texture_paint(atlas_texture *t, char *error_text, size_t error_size)
{
    const size_t size = t->texels.size, row = 3 * size;
    t->white = 0.0;
    for (size_t i = 0; i < 3 * t->texels.count; ++i)
    {
        t->white = fmax(t->white, (double)t->values[i]);
    }
    t->white = t->white > 0.0 ? t->white : 1.0;
    float *const image = malloc(size * row * sizeof *image);
    unsigned char *const rgb = malloc(size * row);
    sss_result result = image && rgb ? sss_atlas_fill_image(t->atlas, t->values, 3, RINGS, image)
                                     : SSS_ERROR_OUT_OF_MEMORY;
    if (result == SSS_OK)
    {
        for (size_t i = 0; i < size * row; ++i) // the atlas has its first row below, a picture has it on top
        {
            rgb[(size - 1 - i / row) * row + i % row] = to_srgb((double)image[i] / t->white);
        }
        t->png = image_encode_png((int)size, (int)size, rgb, &t->png_bytes);
        result = t->png ? SSS_OK : SSS_ERROR_OUT_OF_MEMORY;
    }
    free(image);
    free(rgb);
    return result == SSS_OK ? 0 : fail("atlas picture", result, error_text, error_size);
}

// ---- files ----

int atlas_texture_write_png(const atlas_texture *t, const char *path, char *error_text, size_t error_size)
{
    FILE *const file = fopen(path, "wb");
    const size_t written = file ? fwrite(t->png, 1, t->png_bytes, file) : 0;
    if (!file || fclose(file) != 0 || written != t->png_bytes)
    {
        snprintf(error_text, error_size, "cannot write %s: %s", path, strerror(errno));
        return -1;
    }
    return 0;
}

int atlas_texture_write_glb(const atlas_texture *t, const model *m, const char *path, char *error_text,
                            size_t error_size)
{
    const size_t count = t->mesh.vertex_count;
    model_textured textured = {.vertex_count = count, .triangle_count = t->mesh.triangle_count,
                               .triangles = t->mesh.triangles, .png = t->png, .png_bytes = t->png_bytes,
                               .white = t->white};
    float *const positions = malloc((8 * count + 1) * sizeof *positions);
    if (!positions)
    {
        return fail("atlas", SSS_ERROR_OUT_OF_MEMORY, error_text, error_size);
    }
    float *const normals = positions + 3 * count, *const uv = normals + 3 * count;
    for (size_t i = 0; i < count; ++i)
    {
        const size_t v = t->mesh.vertex[i];
        memcpy(positions + 3 * i, m->positions + 3 * v, 3 * sizeof *positions);
        memcpy(normals + 3 * i, m->normals + 3 * v, 3 * sizeof *normals);
        uv[2 * i] = t->mesh.uv[2 * i];
        uv[2 * i + 1] = 1.0f - t->mesh.uv[2 * i + 1]; // glTF's v runs downwards
    }
    textured.positions = positions;
    textured.normals = normals;
    textured.uv = uv;
    const int status = model_save_textured_glb(path, &textured, error_text, error_size);
    free(positions);
    return status;
}
