// Scenes that model_load must read exactly, scenes that it must refuse, and valid ones with bytes changed at random,
// which it may read or refuse but must survive.
//     hostile_glb [DIR]      DIR keeps the refused files as NAME.glb, for the command line's tests
// Ends with 'N passed, N failed'. Built with sanitizers by test_hostile_glb.sh.
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SSS_DIPOLE_IMPLEMENTATION
#include "../../sss_dipole.h"

#include "../../examples/common/model.h"
#include "../common/volume.h"

enum
{
    BINARY_SIZE = 400,
    FILE_SIZE = 1 << 16,
    RANDOM_RUNS = 3000
};

static int passed, failed;
static const char *folder; // for the refused files, may be NULL
static unsigned char file[FILE_SIZE];

static void check(int condition, const char *name, const char *detail)
{
    printf("%s  %-28s %s\n", condition ? "ok  " : "FAIL", name, detail);
    passed += condition != 0;
    failed += condition == 0;
}

// ---- the buffer that all scenes share: a tetrahedron of volume 1/6 in many encodings ----

static unsigned char binary[BINARY_SIZE];

static void put_floats(size_t at, const float *values, size_t count)
{
    memcpy(binary + at, values, count * sizeof *values);
}

static void fill_binary(void)
{
    static const float corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const unsigned char faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    static const unsigned char strip[6] = {1, 2, 3, 0, 1, 2}, fan[4] = {1, 2, 3, 0};
    float not_finite[12], moved[3] = {0, 0, 2};
    put_floats(0, corners, 12);
    for (size_t i = 0; i < 12; ++i)
    {
        const uint16_t small = faces[i];
        const uint32_t large = faces[i];
        const int16_t quantized = (int16_t)(32767.0f * corners[i]);
        const double real = (double)corners[i];
        binary[48 + i] = faces[i];
        memcpy(binary + 60 + 2 * i, &small, 2);
        memcpy(binary + 84 + 4 * i, &large, 4);
        memcpy(binary + 144 + 8 * (i / 3) + 2 * (i % 3), &quantized, 2); // four to a vertex, for alignment
        memcpy(binary + 176 + 8 * i, &real, 8);
        binary[336 + i] = faces[i];
        not_finite[i] = i == 7 ? NAN : corners[i];
    }
    memcpy(binary + 132, strip, sizeof strip);
    memcpy(binary + 138, fan, sizeof fan);
    binary[272] = 3;                // sparse: vertex 3 ...
    put_floats(276, moved, 3);      // ... moves up: volume 1/3
    put_floats(288, not_finite, 12);
    binary[340] = 200;              // an index that is out of range
}

// ---- files ----

static void put_32(size_t at, uint32_t value)
{
    for (size_t i = 0; i < 4; ++i)
    {
        file[at + i] = (unsigned char)(value >> 8 * i);
    }
}

static size_t make_glb(const char *json)
{
    const size_t length = (strlen(json) + 3) / 4 * 4, total = 20 + length + 8 + BINARY_SIZE;
    memcpy(file, "glTF", 4);
    put_32(4, 2);
    put_32(8, (uint32_t)total);
    put_32(12, (uint32_t)length);
    memcpy(file + 16, "JSON", 4);
    memset(file + 20, ' ', length);
    memcpy(file + 20, json, strlen(json));
    put_32(20 + length, BINARY_SIZE);
    memcpy(file + 24 + length, "BIN\0", 4);
    memcpy(file + 28 + length, binary, BINARY_SIZE);
    return total;
}

static const char *write_file(const char *name, size_t size)
{
    static char path[1024];
    snprintf(path, sizeof path, "%s/%s.glb", folder, name);
    FILE *const out = fopen(path, "wb");
    if (!out || fwrite(file, 1, size, out) != size || fclose(out) != 0)
    {
        printf("cannot write %s\n", path);
        exit(1);
    }
    return path;
}

// A scene from its parts; NULL takes the plain tetrahedron's.
typedef struct parts
{
    const char *head, *nodes, *primitives, *accessors, *views, *buffers;
} parts;

#define VIEW(offset, length) "{\"buffer\":0,\"byteOffset\":" #offset ",\"byteLength\":" #length "}"
#define FLOATS(view, count) \
    "{\"bufferView\":" #view ",\"componentType\":5126,\"count\":" #count ",\"type\":\"VEC3\"}"
#define INDICES(view, type, count) \
    "{\"bufferView\":" #view ",\"componentType\":" #type ",\"count\":" #count ",\"type\":\"SCALAR\"}"
#define ACCESSORS(position, index) position "," index
#define PRIMITIVE(more) "{\"attributes\":{\"POSITION\":0},\"indices\":1" more "}"

static const char *scene(const parts *p)
{
    static char json[FILE_SIZE / 2];
    snprintf(json, sizeof json,
             "{\"asset\":{\"version\":\"2.0\"}%s,%s,\"meshes\":[{\"primitives\":[%s]}],\"accessors\":[%s],"
             "\"bufferViews\":[%s],\"buffers\":[%s]}",
             p->head ? p->head : "",
             p->nodes ? p->nodes : "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}]",
             p->primitives ? p->primitives : PRIMITIVE(""),
             p->accessors ? p->accessors : ACCESSORS(FLOATS(0, 4), INDICES(1, 5121, 12)),
             p->views ? p->views
                      : VIEW(0, 48) "," VIEW(48, 12) "," VIEW(60, 24) "," VIEW(84, 48) "," VIEW(132, 6) "," VIEW(138, 4)
                        "," "{\"buffer\":0,\"byteOffset\":144,\"byteLength\":32,\"byteStride\":8}"
                        "," VIEW(176, 96) "," VIEW(272, 1) "," VIEW(276, 12) "," VIEW(288, 48) "," VIEW(336, 12),
             p->buffers ? p->buffers : "{\"byteLength\":400}");
    return json;
}

// ---- scenes that must be read ----

// The normals of a vertex of a convex closed solid point away from its middle.
static int normals_point_outward(const model *m)
{
    double low[3], high[3];
    model_bounds(m, low, high);
    for (size_t i = 0; i < m->vertex_count; ++i)
    {
        double along = 0.0, length = 0.0;
        for (size_t k = 0; k < 3; ++k)
        {
            const double n = (double)m->normals[3 * i + k];
            along += n * ((double)m->positions[3 * i + k] - (0.5 * low[k] + 0.5 * high[k]));
            length += n * n;
        }
        if (fabs(length - 1.0) > 1e-5 || along <= 0.0)
        {
            return 0;
        }
    }
    return 1;
}

static void must_read(const char *name, const parts *p, size_t vertices, size_t triangles, double want_volume)
{
    char detail[512] = "", error[512] = "";
    char unique[64];
    snprintf(unique, sizeof unique, "read_%s", name);
    const char *const path = write_file(unique, make_glb(scene(p)));
    model m;
    if (model_load(path, &m, error, sizeof error) != 0)
    {
        check(0, name, error);
        remove(path);
        return;
    }
    const double got = volume(&m);
    snprintf(detail, sizeof detail, "%zu of %zu vertices, %zu of %zu triangles, volume %.6g of %.6g", m.vertex_count,
             vertices, m.triangle_count, triangles, got, want_volume);
    // 16-bit coordinates are good to 2^-16
    check(m.vertex_count == vertices && m.triangle_count == triangles &&
              fabs(got - want_volume) <= 1e-4 * fabs(want_volume),
          name, detail);
    if (vertices == 4 && triangles % 4 == 0) // one closed convex solid
    {
        check(normals_point_outward(&m), name, "normals are of unit length and point outward");
    }
    model_free(&m);
    remove(path);
}

#define ROOT(node) "\"scenes\":[{\"nodes\":[0]}],\"nodes\":[" node "]"

// Clockwise from outside, against the standard: turned round where the surface is closed, else left alone.
static void inside_out(void)
{
    unsigned char *const faces = binary + 48;
    for (size_t i = 0; i < 12; i += 3)
    {
        const unsigned char swapped = faces[i + 1];
        faces[i + 1] = faces[i + 2];
        faces[i + 2] = swapped;
    }
    must_read("inside out", &(parts){0}, 4, 4, 1.0 / 6.0);
    must_read("inside out with a hole",
              &(parts){.accessors = ACCESSORS(FLOATS(0, 4), INDICES(1, 5121, 9))}, 4, 3, 0.0);
    fill_binary();
}

static void scenes_that_must_be_read(void)
{
    const double V = 1.0 / 6.0;
    must_read("plain", &(parts){0}, 4, 4, V);
    must_read("indices of 16 bits", &(parts){.accessors = ACCESSORS(FLOATS(0, 4), INDICES(2, 5123, 12))}, 4, 4, V);
    must_read("indices of 32 bits", &(parts){.accessors = ACCESSORS(FLOATS(0, 4), INDICES(3, 5125, 12))}, 4, 4, V);
    must_read("strip", &(parts){.primitives = PRIMITIVE(",\"mode\":5"),
                                .accessors = ACCESSORS(FLOATS(0, 4), INDICES(4, 5121, 6))}, 4, 4, V);
    must_read("fan", &(parts){.primitives = PRIMITIVE(",\"mode\":6"),
                              .accessors = ACCESSORS(FLOATS(0, 4), INDICES(5, 5121, 4))}, 4, 2, V);
    must_read("no indices", &(parts){.primitives = "{\"attributes\":{\"POSITION\":0},\"mode\":5}"}, 4, 2, -V);
    must_read("normalized 16 bits", &(parts){.accessors = ACCESSORS(
        "{\"bufferView\":6,\"componentType\":5122,\"normalized\":true,\"count\":4,\"type\":\"VEC3\"}",
        INDICES(1, 5121, 12))}, 4, 4, V);
    must_read("doubles", &(parts){.accessors = ACCESSORS(
        "{\"bufferView\":7,\"componentType\":5130,\"count\":4,\"type\":\"VEC3\"}", INDICES(1, 5121, 12))}, 4, 4, V);
    must_read("sparse", &(parts){.accessors = ACCESSORS(
        "{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\",\"sparse\":{\"count\":1,"
        "\"indices\":{\"bufferView\":8,\"componentType\":5121},\"values\":{\"bufferView\":9}}}",
        INDICES(1, 5121, 12))}, 4, 4, 2 * V);
    must_read("two primitives that share", &(parts){.primitives = PRIMITIVE("") "," PRIMITIVE("")}, 4, 8, 2 * V);
    must_read("lines beside triangles", &(parts){.primitives = PRIMITIVE(",\"mode\":1") "," PRIMITIVE("")}, 4, 4, V);
    must_read("scaled", &(parts){.nodes = ROOT("{\"mesh\":0,\"scale\":[2,3,4]}")}, 4, 4, 24 * V);
    must_read("mirrored", &(parts){.nodes = ROOT("{\"mesh\":0,\"scale\":[-2,3,4]}")}, 4, 4, 24 * V);
    must_read("turned and moved", &(parts){.nodes = ROOT(
        "{\"mesh\":0,\"rotation\":[0.5,0.5,0.5,0.5],\"translation\":[5,-6,7]}")}, 4, 4, V);
    must_read("matrix", &(parts){.nodes = ROOT("{\"mesh\":0,\"matrix\":[0,2,0,0,0,0,2,0,2,0,0,0,9,9,9,1]}")}, 4, 4,
              8 * V);
    must_read("nested", &(parts){.nodes = ROOT("{\"children\":[1,2],\"scale\":[1,-1,1]},{\"mesh\":0,\"scale\":[3,1,1]},"
                                               "{\"children\":[3],\"translation\":[0,0,9]},{\"mesh\":0}")}, 8, 8,
              4 * V);
    must_read("no scene", &(parts){.nodes = "\"nodes\":[{\"children\":[1]},{\"mesh\":0}]"}, 4, 4, V);
}

// ---- scenes that must be refused ----

static void must_refuse_file(const char *name, size_t size)
{
    char error[512] = "";
    char detail[600];
    const char *const path = write_file(name, size);
    model m;
    const int status = model_load(path, &m, error, sizeof error);
    snprintf(detail, sizeof detail, "%s", status == 0 ? "was read" : error);
    check(status != 0 && error[0] && !m.positions && !m.normals && !m.triangles && m.vertex_count == 0, name, detail);
    model_free(&m);
}

static void must_refuse(const char *name, const parts *p)
{
    must_refuse_file(name, make_glb(scene(p)));
}

static void accessors_that_must_be_refused(void)
{
    must_refuse("index_out_of_range", &(parts){.accessors = ACCESSORS(FLOATS(0, 4), INDICES(11, 5121, 12))});
    must_refuse("position_not_finite", &(parts){.accessors = ACCESSORS(FLOATS(10, 4), INDICES(1, 5121, 12))});
    must_refuse("count_too_large", &(parts){.accessors = ACCESSORS(FLOATS(0, 5), INDICES(1, 5121, 12))});
    must_refuse("count_huge", &(parts){.accessors = ACCESSORS(FLOATS(0, 4294967295), INDICES(1, 5121, 12))});
    must_refuse("count_overflows", &(parts){.accessors = ACCESSORS(FLOATS(0, 1537228672809129302),
                                                                  INDICES(1, 5121, 12))});
    must_refuse("count_negative", &(parts){.accessors = ACCESSORS(FLOATS(0, -1), INDICES(1, 5121, 12))});
    must_refuse("indices_huge", &(parts){.accessors = ACCESSORS(FLOATS(0, 4), INDICES(1, 5121, 4294967295))});
    must_refuse("zeros_huge", &(parts){.primitives = "{\"attributes\":{\"POSITION\":0}}",
                                       .accessors = "{\"componentType\":5126,\"count\":4294967292,\"type\":\"VEC3\"}"});
    must_refuse("offset_past_view", &(parts){.accessors = ACCESSORS(
        "{\"bufferView\":0,\"byteOffset\":4,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}",
        INDICES(1, 5121, 12))});
    must_refuse("offset_overflows", &(parts){.accessors = ACCESSORS(
        "{\"bufferView\":0,\"byteOffset\":18446744073709551612,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}",
        INDICES(1, 5121, 12))});
    must_refuse("view_unknown", &(parts){.accessors = ACCESSORS(FLOATS(99, 4), INDICES(1, 5121, 12))});
    must_refuse("index_view_unknown", &(parts){.accessors = ACCESSORS(FLOATS(0, 4), INDICES(99, 5121, 12))});
    must_refuse("position_of_wrong_type", &(parts){.accessors = ACCESSORS(INDICES(1, 5121, 12), INDICES(1, 5121, 12))});
    must_refuse("component_unknown", &(parts){.accessors = ACCESSORS(
        "{\"bufferView\":0,\"componentType\":5127,\"count\":4,\"type\":\"VEC3\"}", INDICES(1, 5121, 12))});
    must_refuse("sparse_out_of_range", &(parts){.accessors = ACCESSORS(
        "{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\",\"sparse\":{\"count\":1,"
        "\"indices\":{\"bufferView\":11,\"byteOffset\":4,\"componentType\":5121},\"values\":{\"bufferView\":9}}}",
        INDICES(1, 5121, 12))});
    must_refuse("sparse_negative", &(parts){.accessors = ACCESSORS(
        "{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\",\"sparse\":{\"count\":-1,"
        "\"indices\":{\"bufferView\":8,\"componentType\":5121},\"values\":{\"bufferView\":9,\"byteOffset\":-4}}}",
        INDICES(1, 5121, 12))});
    must_refuse("normals_too_few",
                &(parts){.primitives = "{\"attributes\":{\"POSITION\":0,\"NORMAL\":2},\"indices\":1}",
                         .accessors = ACCESSORS(FLOATS(0, 4), INDICES(1, 5121, 12)) "," FLOATS(0, 3)});
    must_refuse("accessor_unknown", &(parts){.primitives = "{\"attributes\":{\"POSITION\":77},\"indices\":1}"});
    must_refuse("accessor_negative", &(parts){.primitives = "{\"attributes\":{\"POSITION\":-7},\"indices\":1}"});
}

static void views_and_buffers_that_must_be_refused(void)
{
#define FIRST(view) view "," VIEW(48, 12)
    must_refuse("view_past_buffer", &(parts){.views = FIRST("{\"buffer\":0,\"byteOffset\":384,\"byteLength\":48}")});
    must_refuse("view_overflows", &(parts){
        .views = FIRST("{\"buffer\":0,\"byteOffset\":18446744073709551600,\"byteLength\":48}")});
    must_refuse("view_of_unknown_buffer",
                &(parts){.views = FIRST("{\"buffer\":3,\"byteOffset\":0,\"byteLength\":48}")});
    must_refuse("view_stride_small", &(parts){
        .views = FIRST("{\"buffer\":0,\"byteOffset\":0,\"byteLength\":48,\"byteStride\":4}")});
    must_refuse("buffer_too_long", &(parts){.buffers = "{\"byteLength\":4000}"});
    must_refuse("buffer_huge", &(parts){.buffers = "{\"byteLength\":18446744073709551615}"});
    must_refuse("buffer_missing_file", &(parts){.buffers = "{\"byteLength\":400,\"uri\":\"no such file.bin\"}"});
    must_refuse("buffer_is_a_device", &(parts){.buffers = "{\"byteLength\":400,\"uri\":\"/dev/zero\"}"});
    must_refuse("buffer_bad_base64", &(parts){
        .buffers = "{\"byteLength\":400,\"uri\":\"data:application/octet-stream;base64,!!!!\"}"});
#undef FIRST
}

static void nodes_that_must_be_refused(void)
{
    must_refuse("node_cycle", &(parts){.nodes = ROOT("{\"children\":[1]},{\"children\":[0],\"mesh\":0}")});
    must_refuse("node_is_its_own_child", &(parts){.nodes = ROOT("{\"children\":[0],\"mesh\":0}")});
    must_refuse("node_twice", &(parts){.nodes = ROOT("{\"children\":[1,1]},{\"mesh\":0}")});
    must_refuse("node_unknown", &(parts){.nodes = ROOT("{\"children\":[5],\"mesh\":0}")});
    must_refuse("node_negative", &(parts){.nodes = ROOT("{\"children\":[-5],\"mesh\":0}")});
    must_refuse("mesh_unknown", &(parts){.nodes = ROOT("{\"mesh\":7}")});
    must_refuse("scene_unknown",
                &(parts){.nodes = "\"scene\":4,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}]"});
    must_refuse("no_nodes", &(parts){.nodes = "\"scenes\":[{\"nodes\":[]}],\"nodes\":[]"});
    must_refuse("transform_not_finite", &(parts){.nodes = ROOT("{\"mesh\":0,\"scale\":[1e300,1e300,1e300]}")});
    must_refuse("only_points", &(parts){.primitives = PRIMITIVE(",\"mode\":0")});
    must_refuse("only_lines", &(parts){.primitives = PRIMITIVE(",\"mode\":1")});
    must_refuse("mode_unknown", &(parts){.primitives = PRIMITIVE(",\"mode\":42")});
    must_refuse("two_corners", &(parts){.accessors = ACCESSORS(FLOATS(0, 4), INDICES(1, 5121, 2))});
    must_refuse("needs_draco", &(parts){.head = ",\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]"});
    must_refuse("needs_unknown", &(parts){.head = ",\"extensionsRequired\":[\"ACME_warp\"]"});
}

static void containers_that_must_be_refused(void)
{
    const size_t whole = make_glb(scene(&(parts){0}));
    static const size_t cuts[] = {1, 3, 4, 11, 12, 19, 20, 21, 100};
    for (size_t i = 0; i < sizeof cuts / sizeof cuts[0]; ++i)
    {
        char name[32];
        snprintf(name, sizeof name, "cut_after_%zu", cuts[i]);
        must_refuse_file(name, cuts[i]);
    }
    must_refuse_file("cut_by_one", whole - 1);
    put_32(8, 0xffffffffu);
    must_refuse_file("length_huge", whole);
    make_glb(scene(&(parts){0}));
    put_32(12, 0xfffffff0u);
    must_refuse_file("json_length_huge", whole);
    const size_t second = whole - 8 - BINARY_SIZE;
    make_glb(scene(&(parts){0}));
    put_32(second, BINARY_SIZE + 8); // tinygltf 2.7 would read eight bytes past the end
    must_refuse_file("binary_length_past_end", whole);
    make_glb(scene(&(parts){0}));
    put_32(4, 1);
    must_refuse_file("version_1", whole);
    static char deep[20001];
    memset(deep, '[', sizeof deep - 1); // tinygltf would recurse until the stack ends
    must_refuse_file("json_deep", make_glb(deep));
    must_refuse_file("json_none", make_glb("this is no JSON"));
    must_refuse_file("json_null", make_glb("null"));
    must_refuse_file("json_number", make_glb("42"));
    must_refuse_file("json_array", make_glb("[]"));
    must_refuse_file("json_empty_object", make_glb("{}"));
    must_refuse_file("json_types_wrong", make_glb("{\"asset\":{\"version\":\"2.0\"},\"nodes\":7,\"meshes\":\"x\","
                                                  "\"accessors\":{\"a\":1},\"scenes\":[3],\"buffers\":[[]]}"));
    memset(file, 0, 4096);
    must_refuse_file("zeros", 4096);
}

// ---- valid files with bytes changed ----

static uint32_t random_state = 12345;

static uint32_t next_random(void)
{
    random_state = random_state * 1664525u + 1013904223u; // Numerical Recipes' linear congruential generator
    return random_state >> 8;
}

static void random_changes(void)
{
    int read = 0, refused = 0;
    for (int run = 0; run < RANDOM_RUNS; ++run)
    {
        const size_t size = make_glb(scene(&(parts){0}));
        for (uint32_t changes = 1 + next_random() % 4; changes > 0; --changes)
        {
            // Digits turn into digits half of the time: those files get past the JSON parser.
            const size_t at = next_random() % size;
            const int digit = file[at] >= '0' && file[at] <= '9' && next_random() % 2;
            file[at] = (unsigned char)(digit ? '0' + next_random() % 10 : next_random() % 256);
        }
        const char *const path = write_file("random", size);
        char error[512] = "";
        model m;
        const int status = model_load(path, &m, error, sizeof error);
        for (size_t i = 0; status == 0 && i < 3 * m.triangle_count; ++i)
        {
            if (m.triangles[i] >= m.vertex_count)
            {
                check(0, "random changes", "an index out of range was let through");
            }
        }
        read += status == 0;
        refused += status != 0 && error[0];
        model_free(&m);
        remove(path);
    }
    char detail[128];
    snprintf(detail, sizeof detail, "%d files read, %d refused with a reason, of %d", read, refused, RANDOM_RUNS);
    check(read + refused == RANDOM_RUNS && read > 0 && refused > 0, "random changes", detail);
}

int main(int argc, char **argv)
{
    folder = argc > 1 ? argv[1] : ".";
    fill_binary();
    scenes_that_must_be_read();
    inside_out();
    accessors_that_must_be_refused();
    views_and_buffers_that_must_be_refused();
    nodes_that_must_be_refused();
    containers_that_must_be_refused();
    random_changes();
    printf("%d passed, %d failed\n", passed, failed);
    return failed ? 1 : 0;
}
