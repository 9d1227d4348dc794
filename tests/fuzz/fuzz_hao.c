// Feeds arbitrary bytes to sss_hao_load: clang's libFuzzer calls this with inputs that it mutates. The first byte
// chooses: the rest is a file as it is; or it is a list of changes to a file that is good, whose checks are then made
// right again, so that what lies behind them is reached. Good files are there of every storage. Whatever the bytes,
// loading gives an error and leaves its output alone, or a sound object, which can be read from, relit and saved.

#define SSS_HAO_IMPLEMENTATION
#include "../../sss_hao.h"

#include "file.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const float positions[21] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 9, 9, 9};
static const uint32_t triangles[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
static const sss_mesh mesh = {positions, NULL, triangles, 7, 8, 5.0}; // the last vertex is in nothing
static const sss_profile marble = {{.9990, .9984, .9976}, {.11752, .17969, .25322}, {.45620, .38099, .33256},
                                   {2.0352, 1.6997, 1.4836}, 1.5, .59642, .09179};
static const double distances[1] = {40.0};

enum
{
    KINDS = 7, // five storages; references and a table for point lights, too
    CHECKS = 8
};

static const file_hash hashing = {SSS_HAO__HASH_START, sss_hao__mix};

static void options_of(size_t kind, sss_hao_options *options)
{
    memset(options, 0, sizeof *options);
    options->storage = kind < 5 ? (sss_hao_storage)kind : kind == 5 ? SSS_HAO_REFERENCES : SSS_HAO_TABLE;
    options->directions = 6;
    options->channels = kind % 2 == 0 ? 3 : 1;
    options->distances = kind >= 5 ? distances : NULL;
    options->distance_count = kind >= 5 ? 1 : 0;
}

static file good_file(size_t kind, uint64_t *hash)
{
    file f = {NULL, 0, 0};
    sss_hao_options options;
    sss_hao *hao = NULL;
    options_of(kind, &options);
    insist(sss_hao_create(&mesh, &marble, &options, NULL, &hao) == SSS_OK);
    insist(sss_hao_hash(&mesh, &marble, &options, hash) == SSS_OK && sss_hao_save(hao, append, &f) == SSS_OK);
    sss_hao_free(hao);
    return f;
}

static void check_references(const sss_hao *hao, const sss_hao_stats *s)
{
    uint32_t *const list = (uint32_t *)calloc(s->reference_count + 1, sizeof *list);
    uint32_t *const corners = (uint32_t *)calloc(3 * s->reference_triangle_count + 1, sizeof *corners);
    uint32_t *const triangle = (uint32_t *)calloc(s->vertex_count + 1, sizeof *triangle);
    float *const weights = (float *)calloc(3 * s->vertex_count + 1, sizeof *weights);
    size_t height = 0;
    insist(list != NULL && corners != NULL && triangle != NULL && weights != NULL);
    insist(sss_hao_get_references(hao, list, corners, triangle, weights) == SSS_OK);
    for (size_t i = 0; i < s->reference_count; ++i)
    {
        insist(list[i] < s->vertex_count);
    }
    for (size_t i = 0; i < 3 * s->reference_triangle_count; ++i)
    {
        insist(corners[i] < s->reference_count);
    }
    insist(sss_hao_get_texture(hao, NULL, &height) == (s->distance_count > 0 ? SSS_ERROR_INVALID_ARGUMENT : SSS_OK));
    if (height > 0 && height <= 64)
    {
        uint32_t *const words = (uint32_t *)calloc(height * SSS_HAO_TEXTURE_WIDTH + 1, sizeof *words);
        insist(words != NULL && sss_hao_get_texture(hao, words, &height) == SSS_OK);
        free(words);
    }
    free(list);
    free(corners);
    free(triangle);
    free(weights);
}

static void check_sound(sss_hao *hao)
{
    sss_hao_stats s;
    file again = {NULL, 0, 0};
    sss_hao_light light;
    insist(sss_hao_get_stats(hao, &s) == SSS_OK && s.directions > 0 && s.vertex_count > 0);
    float *const set = (float *)calloc(4 * s.directions + 1, sizeof *set);
    float *const B = (float *)calloc(s.vertex_count * s.channels + 1, sizeof *B);
    float *const lighting = (float *)calloc(3 * s.lighting_count + 1, sizeof *lighting);
    double sh[9][3];
    insist(set != NULL && B != NULL && lighting != NULL);
    insist(sss_hao_get_directions(hao, set, set + 3 * s.directions) == SSS_OK);
    memset(&light, 0, sizeof light);
    light.color[0] = light.color[1] = light.color[2] = 1.0;
    light.direction[0] = 0.3;
    light.direction[2] = 1.0;
    insist(sss_hao_relight(hao, &light, 1, B) == SSS_OK);
    for (size_t i = 0; i < s.vertex_count * s.channels; ++i)
    {
        insist(!(B[i] < 0.0f)); // forged scales may be enormous
    }
    light.kind = SSS_HAO_LIGHT_POINT;
    light.position[1] = 30.0;
    (void)sss_hao_relight(hao, &light, 1, B);
    memset(sh, 0, sizeof sh);
    sh[0][1] = 1.0;
    insist(sss_hao_add_environment(hao, (const double(*)[3])sh, lighting) == SSS_OK);
    if (s.storage == SSS_HAO_REFERENCES)
    {
        check_references(hao, &s);
    }
    insist(sss_hao_save(hao, append, &again) == SSS_OK);
    free(again.bytes);
    free(set);
    free(B);
    free(lighting);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static file good[KINDS]; // live as long as the program
    static uint64_t hash[KINDS];
    static size_t checks[KINDS][CHECKS], check_count[KINDS];
    static char nowhere;
    sss_hao *const untouched = (sss_hao *)(void *)&nowhere, *hao = untouched;
    const size_t kind = size > 1 ? data[1] % KINDS : 0;
    file f = {NULL, 0, 0};
    for (size_t i = 0; good[KINDS - 1].bytes == NULL && i < KINDS; ++i)
    {
        good[i] = good_file(i, &hash[i]);
        check_count[i] = find_checks(&good[i], hashing, checks[i], CHECKS);
        insist(check_count[i] >= 1 && checks[i][check_count[i] - 1] + 2 == good[i].count / 4);
    }
    if (size > 2 && data[0] < 64)
    {
        append(&f, data + 2, size - 2);
    }
    else
    {
        append(&f, good[kind].bytes, good[kind].count);
        change(&f, hashing, checks[kind], check_count[kind], size > 0 ? data[0] : 254, data + 2,
               size > 2 ? size - 2 : 0);
    }
    const sss_result result = sss_hao_load(hash[kind], take, &f, NULL, &hao);
    if (result == SSS_OK)
    {
        insist(hao != untouched);
        check_sound(hao);
        sss_hao_free(hao);
    }
    else
    {
        insist(hao == untouched);
    }
    free(f.bytes);
    return 0;
}
