// Feeds arbitrary bytes to sss_atlas_load: clang's libFuzzer calls this with inputs that it mutates. The first byte
// chooses: the rest is a file as it is; or it is a list of changes to a file that is good, whose checks are then made
// right again, so that what lies behind them is reached. Whatever the bytes, loading gives an error and leaves its
// output alone, or a sound atlas, which can be read from and saved.

#define SSS_ATLAS_IMPLEMENTATION
#include "../../sss_atlas.h"

#include "file.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const float positions[18] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
static const uint32_t triangles[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
static const sss_mesh mesh = {positions, NULL, triangles, 6, 8, 5.0};

static const file_hash hashing = {SSS_ATLAS__HASH_START, sss_atlas__mix};

static file good_file(void)
{
    file f = {NULL, 0, 0};
    sss_atlas_options options;
    sss_atlas *atlas = NULL;
    memset(&options, 0, sizeof options);
    options.size = 24;
    if (sss_atlas_create(&mesh, &options, NULL, &atlas) != SSS_OK || sss_atlas_save(atlas, append, &f) != SSS_OK)
    {
        abort();
    }
    sss_atlas_free(atlas);
    return f;
}

static void check_sound(const sss_atlas *atlas)
{
    sss_atlas_mesh m;
    sss_atlas_texels x;
    sss_atlas_stats s;
    file again = {NULL, 0, 0};
    insist(sss_atlas_get_mesh(atlas, &m) == SSS_OK && sss_atlas_get_texels(atlas, &x) == SSS_OK &&
           sss_atlas_get_stats(atlas, &s) == SSS_OK);
    insist(m.triangle_count == 8 && x.inner_count <= x.count && x.size > 0 && x.size == s.size);
    for (size_t i = 0; i < 24; ++i)
    {
        insist(m.triangles[i] < m.vertex_count && m.vertex[m.triangles[i]] == triangles[i]);
        insist(m.chart[i / 3] < m.chart_count);
    }
    for (size_t e = 0; e < x.count; ++e)
    {
        insist(x.triangle[e] < 8 && x.entry_vertex[e] < 6 && x.texel[e] < x.size * x.size);
        insist(isfinite(x.position[3 * e]) && isfinite(x.area[e]));
    }
    for (size_t i = 0; i < x.size * x.size; ++i)
    {
        insist(x.entry[i] == UINT32_MAX || x.entry[i] < x.count);
    }
    for (size_t v = 0; v < 6; ++v)
    {
        insist(x.vertex_entry[v] == UINT32_MAX || x.vertex_entry[v] < x.count);
    }
    if (x.size <= 256)
    {
        static const float weights[3] = {0.25f, 0.5f, 0.25f};
        const uint32_t triangle = 3;
        float *const values = (float *)calloc(x.count + 1, sizeof *values);
        float *const image = (float *)calloc(x.size * x.size, sizeof *image);
        float out = 0.0f;
        insist(values != NULL && image != NULL);
        insist(sss_atlas_fill_image(atlas, values, 1, 2, image) == SSS_OK);
        insist(sss_atlas_fetch(atlas, image, 1, &triangle, weights, 1, &out) == SSS_OK && out == 0.0f);
        free(values);
        free(image);
    }
    insist(sss_atlas_save(atlas, append, &again) == SSS_OK);
    free(again.bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static file good; // lives as long as the program
    static size_t checks[8], check_count;
    static char nowhere;
    sss_atlas *const untouched = (sss_atlas *)(void *)&nowhere, *atlas = untouched;
    file f = {NULL, 0, 0};
    if (good.bytes == NULL)
    {
        good = good_file();
        check_count = find_checks(&good, hashing, checks, 8);
        insist(check_count >= 1 && checks[check_count - 1] + 2 == good.count / 4);
    }
    if (size > 0 && data[0] < 64)
    {
        append(&f, data + 1, size - 1);
    }
    else
    {
        append(&f, good.bytes, good.count);
        change(&f, hashing, checks, check_count, size > 0 ? data[0] : 254, data + 1, size > 1 ? size - 1 : 0);
    }
    const sss_result result = sss_atlas_load(&mesh, take, &f, NULL, &atlas);
    if (result == SSS_OK)
    {
        insist(atlas != untouched);
        check_sound(atlas);
        sss_atlas_free(atlas);
    }
    else
    {
        insist(atlas == untouched);
    }
    free(f.bytes);
    return 0;
}
