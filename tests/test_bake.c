// build/bake from its command line: what it writes is what the library computes, in the promised order and size; every
// wrong argument and hostile file ends in a message, exit status 2 and no output file.

#define _POSIX_C_SOURCE 200809L // mkdir, stat, wait

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"

#include "../examples/common/model.h"
#include "../examples/common/shapes.h"
#include "common/meshes.h"
#include "common/test.h"
#include "common/textured.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#define FOLDER "build/tests/bake/"
#define MESH FOLDER "mesh.glb"
#define CUBE FOLDER "cube.glb"

static const char scene[] = "--material marble --size-mm 10 --light 0.577,0.577,0.577 --no-shadows";

// ---- running it ----

static char g_said[16384]; // what the last run wrote to standard output
static char g_complained[4096]; // and to standard error

static size_t read_file(const char *path, char *out, size_t size)
{
    FILE *const file = fopen(path, "rb");
    const size_t got = file ? fread(out, 1, size, file) : 0;
    if (file)
    {
        fclose(file);
    }
    return got;
}

// Runs build/bake with these arguments; its exit status, or -1 where it crashed.
static int bake(const char *format, ...)
{
    char command[4096];
    int length = snprintf(command, sizeof command, "timeout 120 build/bake ");
    va_list arguments;
    va_start(arguments, format);
    length += vsnprintf(command + length, sizeof command - (size_t)length, format, arguments);
    va_end(arguments);
    snprintf(command + length, sizeof command - (size_t)length, " >" FOLDER "said 2>" FOLDER "complained </dev/null");
    const int status = system(command);
    g_said[read_file(FOLDER "said", g_said, sizeof g_said - 1)] = '\0';
    g_complained[read_file(FOLDER "complained", g_complained, sizeof g_complained - 1)] = '\0';
    // A shell turns death by signal s into 128 + s; timeout turns its own into 124.
    return WIFEXITED(status) && WEXITSTATUS(status) < 124 ? WEXITSTATUS(status) : -1;
}

static long long file_size(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 ? (long long)status.st_size : -1;
}

static int exists(const char *path)
{
    return file_size(path) >= 0;
}

// The number behind "key=" at the start of a line of the report; NaN where there is none.
static double reported(const char *key)
{
    const size_t length = strlen(key);
    for (const char *line = g_said; line != NULL && *line != '\0'; line = strchr(line, '\n'))
    {
        line += *line == '\n';
        if (strncmp(line, key, length) == 0 && line[length] == '=')
        {
            return strtod(line + length + 1, NULL);
        }
    }
    return (double)NAN;
}

static int has_key(const char *key)
{
    char text[64];
    snprintf(text, sizeof text, "\n%s=", key);
    return strstr(g_said, text) != NULL || strncmp(g_said, text + 1, strlen(text) - 1) == 0;
}

// Largest |a - b| over the largest |b|.
static double difference(const float *a, const float *b, size_t count)
{
    double largest = 0.0, scale = 0.0;
    for (size_t i = 0; i < count; ++i)
    {
        largest = fmax(largest, fabs((double)a[i] - (double)b[i]));
        scale = fmax(scale, fabs((double)b[i]));
    }
    return scale > 0.0 ? largest / scale : HUGE_VAL;
}

static float *load_floats(const char *path, size_t count)
{
    float *const values = (float *)calloc(count, sizeof *values);
    if (values == NULL || !CHECK_EQUAL(file_size(path), count * sizeof *values) ||
        !CHECK(read_file(path, (char *)values, count * sizeof *values) == count * sizeof *values))
    {
        free(values);
        return NULL;
    }
    return values;
}

// ---- results ----

typedef struct expected
{
    model mesh;
    sss_mesh view;
    sss_profile profile;
    float *E, *B; // [V][3]
} expected;

// What the library itself says of MESH in the scene above.
static int compute_expected(expected *e)
{
    char error[256] = "";
    double low[3], high[3];
    sss_dipole_material material;
    sss_dipole_light light;
    sss_dipole_irradiance_options options;
    memset(e, 0, sizeof *e);
    memset(&light, 0, sizeof light);
    memset(&options, 0, sizeof options);
    if (!CHECK(model_load(MESH, &e->mesh, error, sizeof error) == 0))
    {
        return 0;
    }
    e->view.positions = e->mesh.positions;
    e->view.normals = e->mesh.normals;
    e->view.triangles = e->mesh.triangles;
    e->view.vertex_count = e->mesh.vertex_count;
    e->view.triangle_count = e->mesh.triangle_count;
    e->view.mm_per_unit = 10.0 / model_bounds(&e->mesh, low, high);
    e->E = (float *)calloc(3 * e->mesh.vertex_count, sizeof *e->E);
    e->B = (float *)calloc(3 * e->mesh.vertex_count, sizeof *e->B);
    for (int k = 0; k < 3; ++k)
    {
        light.direction[k] = 0.577;
        light.color[k] = 1.0;
    }
    return CHECK(e->E && e->B) && CHECK_EQUAL(sss_dipole_material_by_name("marble", &material), SSS_OK) &&
           CHECK_EQUAL(sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &e->profile), SSS_OK) &&
           (options.eta = material.eta, 1) &&
           CHECK_EQUAL(sss_dipole_irradiance(&e->view, &light, 1, &options, e->E), SSS_OK) &&
           CHECK_EQUAL(sss_dipole_shade(&e->view, &e->profile, e->E, NULL, NULL, e->B), SSS_OK);
}

static void free_expected(expected *e)
{
    model_free(&e->mesh);
    free(e->E);
    free(e->B);
}

static void dumps_are_what_the_library_computes(void)
{
    expected e;
    if (compute_expected(&e) &&
        CHECK_EQUAL(bake(MESH " %s --tolerance 0.001 --dump " FOLDER "B.f32 --dump-irradiance " FOLDER "E.f32", scene),
                    0))
    {
        const size_t count = 3 * e.mesh.vertex_count;
        float *const B = load_floats(FOLDER "B.f32", count), *const E = load_floats(FOLDER "E.f32", count);
        if (CHECK(B != NULL && E != NULL))
        {
            CHECK_BELOW(difference(E, e.E, count), 1e-6); // float32 all the way
            CHECK_BELOW(difference(B, e.B, count), 1e-6);
            CHECK(difference(B, E, count) > 0.1); // and they are not one another
        }
        free(B);
        free(E);
    }
    free_expected(&e);
}

static void irradiance_may_come_from_a_file(void)
{
    expected e;
    if (compute_expected(&e) &&
        CHECK_EQUAL(bake(MESH " %s --dump-irradiance " FOLDER "E.f32 --dump " FOLDER "B1.f32", scene), 0) &&
        CHECK_EQUAL(bake(MESH " --material marble --size-mm 10 --irradiance " FOLDER "E.f32 --dump " FOLDER "B2.f32"),
                    0))
    {
        const size_t count = 3 * e.mesh.vertex_count;
        float *const one = load_floats(FOLDER "B1.f32", count), *const two = load_floats(FOLDER "B2.f32", count);
        if (CHECK(one != NULL && two != NULL))
        {
            CHECK(memcmp(one, two, count * sizeof *one) == 0);
        }
        free(one);
        free(two);
    }
    free_expected(&e);
}

static void mesh_keeps_its_order_and_carries_the_radiosity(void)
{
    static char bytes[1 << 22];
    expected e;
    model out;
    char error[256] = "";
    memset(&out, 0, sizeof out);
    if (compute_expected(&e) &&
        CHECK_EQUAL(bake(MESH " %s --out " FOLDER "out.glb --dump " FOLDER "B.f32", scene), 0) &&
        CHECK(model_load(FOLDER "out.glb", &out, error, sizeof error) == 0) &&
        CHECK_EQUAL(out.vertex_count, e.mesh.vertex_count) && CHECK_EQUAL(out.triangle_count, e.mesh.triangle_count))
    {
        const size_t count = 3 * out.vertex_count, size = read_file(FOLDER "out.glb", bytes, sizeof bytes);
        float *const B = load_floats(FOLDER "B.f32", count);
        int found = 0;
        CHECK(memcmp(out.positions, e.mesh.positions, count * sizeof(float)) == 0);
        CHECK(memcmp(out.triangles, e.mesh.triangles, 3 * out.triangle_count * sizeof(uint32_t)) == 0);
        // COLOR_0, float and linear: the dump's bytes lie in the file's binary chunk.
        for (size_t i = 0; B && i + count * sizeof *B <= size && !found; i += 4)
        {
            found = memcmp(bytes + i, B, count * sizeof *B) == 0;
        }
        CHECK(found);
        bytes[size < sizeof bytes ? size : sizeof bytes - 1] = '\0';
        CHECK(strncmp(bytes, "glTF", 4) == 0 && strstr(bytes + 20, "\"COLOR_0\"") != NULL);
        free(B);
    }
    model_free(&out);
    free_expected(&e);
}

static void methods_and_geometries_differ_as_they_should(void)
{
    expected e;
    if (compute_expected(&e) &&
        CHECK_EQUAL(bake(MESH " %s --method lambert --dump " FOLDER "lambert.f32", scene), 0) &&
        CHECK_EQUAL(bake(MESH " %s --method direct --geometry placed --dump " FOLDER "placed.f32", scene), 0))
    {
        const size_t count = 3 * e.mesh.vertex_count;
        float *const lambert = load_floats(FOLDER "lambert.f32", count);
        float *const placed = load_floats(FOLDER "placed.f32", count);
        if (CHECK(lambert && placed))
        {
            double worst = 0.0, scale = 0.0;
            size_t moved = 0, far = 0;
            for (size_t i = 0; i < count; ++i)
            {
                const double want = sss_dipole_total(&e.profile, (int)(i % 3)) * (double)e.E[i];
                worst = fmax(worst, fabs((double)lambert[i] - want));
                scale = fmax(scale, (double)e.B[i]);
            }
            CHECK_BELOW(worst, 1e-6);
            // Most values move a little; a few move far, where a placed source meets another part of the surface.
            for (size_t i = 0; i < count; ++i)
            {
                moved += fabs((double)placed[i] - (double)e.B[i]) > 1e-3 * scale;
                far += fabs((double)placed[i] - (double)e.B[i]) > 0.5 * scale;
            }
            CHECK_BETWEEN((double)moved / (double)count, 0.5, 1.0);
            CHECK_BETWEEN((double)far / (double)count, 0.0, 0.1);
        }
        free(lambert);
        free(placed);
    }
    free_expected(&e);
}

static void threads_change_nothing(void)
{   // Oracle: one thread against three, bit for bit.
    static const char *const methods[] = {"direct", "bem", "hao"};
    char one[1 << 16], three[1 << 16];
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; ++i)
    {
        test_about("%s", methods[i]);
        if (CHECK_EQUAL(bake(MESH " %s --method %s --threads 1 --dump " FOLDER "B1.f32", scene, methods[i]), 0) &&
            CHECK_EQUAL(bake(MESH " %s --method %s --threads 3 --dump " FOLDER "B3.f32", scene, methods[i]), 0))
        {
            const size_t size = read_file(FOLDER "B1.f32", one, sizeof one);
            CHECK(size > 100 && size == read_file(FOLDER "B3.f32", three, sizeof three));
            CHECK(memcmp(one, three, size) == 0);
        }
    }
}

static void materials_may_be_given_in_three_ways(void)
{   // Marble in Jensen et al. 2001, by name and by its coefficients; and the same through albedo and mean free path.
    static const char rest[] = "--size-mm 10 --light 0.577,0.577,0.577 --no-shadows --report";
    static const char *const keys[] = {"sigma_s", "sigma_a", "eta"};
    double named[3], albedo = 0.0, mfp = 0.0;
    if (CHECK_EQUAL(bake(MESH " --material Marble %s", rest), 0))
    {
        for (int i = 0; i < 3; ++i)
        {
            named[i] = reported(keys[i]);
        }
        albedo = reported("albedo");
        mfp = reported("mfp_mm");
        CHECK_REL(named[0], 2.19, 1e-9);
        CHECK_REL(named[1], 0.0021, 1e-9);
    }
    if (CHECK_EQUAL(bake(MESH " --sigma-s 2.19,2.62,3.00 --sigma-a .0021,.0041,.0071 --eta 1.5 %s", rest), 0))
    {
        CHECK_REL(reported("albedo"), albedo, 1e-7);
        CHECK_REL(reported("mfp_mm"), mfp, 1e-7);
    }
    if (CHECK_EQUAL(bake(MESH " --albedo %.9g --mfp %.9g --eta 1.5 %s", albedo, mfp, rest), 0))
    {
        CHECK_REL(reported("sigma_s"), 2.19, 1e-6); // nine digits went in
        CHECK_REL(reported("sigma_a"), 0.0021, 1e-5);
    }
}

static void report_names_everything(void)
{
    static const char *const keys[] = {"vertices", "triangles", "mm_per_unit", "method", "precompute_s", "frame_ms",
                                       "bytes", "predicted_error", "sigma_s", "sigma_a", "eta", "threads", "tolerance",
                                       "reference_receivers", "rel_l2", "rel_max", "reference_error"};
    char error[256] = "";
    model m;
    if (!CHECK_EQUAL(bake(MESH " %s --report --reference 12", scene), 0) ||
        !CHECK(model_load(MESH, &m, error, sizeof error) == 0))
    {
        return;
    }
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; ++i)
    {
        test_about("%s", keys[i]);
        CHECK(has_key(keys[i]));
    }
    test_about(NULL);
    CHECK_EQUAL(reported("vertices"), m.vertex_count);
    CHECK_EQUAL(reported("triangles"), m.triangle_count);
    CHECK_EQUAL(reported("reference_receivers"), 12);
    CHECK_BETWEEN(reported("frame_ms"), 1e-3, 1e5);
    CHECK_BELOW(reported("rel_l2"), 1e-3); // the default tolerance
    CHECK_BELOW(reported("reference_error"), 1e-5);
    for (const char *line = g_said; *line != '\0';)
    {
        const char *const end = strchr(line, '\n');
        if (!CHECK(end != NULL && memchr(line, '=', (size_t)(end - line)) != NULL))
        {
            break;
        }
        line = end + 1;
    }
    model_free(&m);
}

static void picture_is_a_png_of_the_asked_size(void)
{
    unsigned char head[24];
    static const unsigned char signature[8] = {137, 'P', 'N', 'G', 13, 10, 26, 10};
    if (CHECK_EQUAL(bake(MESH " %s --png " FOLDER "picture.png --resolution 200x120", scene), 0))
    {
        CHECK_EQUAL(read_file(FOLDER "picture.png", (char *)head, sizeof head), sizeof head);
        CHECK(memcmp(head, signature, sizeof signature) == 0);
        CHECK_EQUAL(256 * head[18] + head[19], 200);
        CHECK_EQUAL(256 * head[22] + head[23], 120);
        CHECK_BETWEEN((double)file_size(FOLDER "picture.png"), 4000.0, 100000.0); // a single colour takes far less
    }
}

static void help_names_every_option(void)
{
    static const char *const wanted[] = {"--method", "--material", "--size-mm", "--light", "--out", "--png", "--dump",
                                         "--sigma-s", "--sigma-a", "--eta", "--albedo", "--mfp", "--no-shadows",
                                         "--irradiance", "--dump-irradiance", "--tolerance", "--threads", "--camera",
                                         "--report", "--reference", "--guard", "direct", "bem",
                                         "lambert", "hao", "--directions", "--storage", "--references", "--order",
                                         "--cache", "--atlas", "--atlas-png", "--atlas-size", "--atlas-method",
                                         "--atlas-values", "orthographic", "convex"};
    CHECK_EQUAL(bake("--help"), 0);
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; ++i)
    {
        test_about("%s", wanted[i]);
        CHECK(strstr(g_said, wanted[i]) != NULL);
    }
}

// ---- bem ----

// A third of the area of the triangles at each vertex.
static double *vertex_areas(const model *m)
{
    double *const area = (double *)calloc(m->vertex_count, sizeof *area);
    for (size_t t = 0; t < m->triangle_count && area; ++t)
    {
        const uint32_t *const v = m->triangles + 3 * t;
        double e[2][3];
        for (size_t i = 0; i < 6; ++i)
        {
            e[i / 3][i % 3] = (double)m->positions[3 * v[1 + i / 3] + i % 3] - (double)m->positions[3 * v[0] + i % 3];
        }
        const double x = e[0][1] * e[1][2] - e[0][2] * e[1][1], y = e[0][2] * e[1][0] - e[0][0] * e[1][2],
                     z = e[0][0] * e[1][1] - e[0][1] * e[1][0];
        for (int c = 0; c < 3; ++c)
        {
            area[v[c]] += sqrt(x * x + y * y + z * z) / 6.0;
        }
    }
    return area;
}

// The area-weighted L2 norm of a - b over that of b; a and b are dumps for m.
static double rel_l2(const model *m, const char *path_a, const char *path_b)
{
    double off = 0.0, all = 0.0;
    double *const area = vertex_areas(m);
    float *const a = load_floats(path_a, 3 * m->vertex_count), *const b = load_floats(path_b, 3 * m->vertex_count);
    for (size_t i = 0; i < 3 * m->vertex_count && area && a && b; ++i)
    {
        const double d = (double)a[i] - (double)b[i];
        off += area[i / 3] * d * d;
        all += area[i / 3] * (double)b[i] * (double)b[i];
    }
    free(area);
    free(a);
    free(b);
    return sqrt(off / all);
}

static const char unsized[] = "--material marble --light 0.577,0.577,0.577 --no-shadows";

// Without the guard bem sums the same integral as direct does.
static void compare_bem_with_direct(const char *path, double size_mm)
{
    static const double direct_tolerance = 1e-4, tolerances[] = {1e-2, 1e-3};
    char error[256] = "";
    model m;
    if (!CHECK(model_load(path, &m, error, sizeof error) == 0))
    {
        return;
    }
    test_about("%s, %g mm", path, size_mm);
    CHECK_EQUAL(bake("%s %s --size-mm %g --method direct --geometry placed --tolerance %g --dump " FOLDER "direct.f32",
                     path, unsized, size_mm, direct_tolerance), 0);
    for (size_t i = 0; i < 2; ++i)
    {
        CHECK_EQUAL(bake("%s %s --size-mm %g --method bem --guard 0 --tolerance %g --dump " FOLDER "bem.f32", path,
                         unsized, size_mm, tolerances[i]), 0);
        CHECK_BELOW(rel_l2(&m, FOLDER "bem.f32", FOLDER "direct.f32"), tolerances[i] + direct_tolerance);
    }
    CHECK_EQUAL(bake("%s %s --size-mm 10 --method bem --dump " FOLDER "bem.f32", path, unsized), 0);
    CHECK_EQUAL(bake("%s %s --size-mm 10 --method direct --dump " FOLDER "direct.f32", path, unsized), 0);
    CHECK(rel_l2(&m, FOLDER "bem.f32", FOLDER "direct.f32") > 0.02); // by distance: another model
    model_free(&m);
}

static void bem_agrees_with_direct_placed(void)
{
    compare_bem_with_direct(CUBE, 40.0);
    compare_bem_with_direct(MESH, 100.0);
    compare_bem_with_direct(MESH, 400.0);
}

static void bem_keeps_its_prediction(void)
{   // Oracle: the converged integral over the bunny with the same guard.
    static const char *const keys[] = {"clusters", "rows", "path", "guard", "links", "relight_ms", "predicted_error"};
    static const double tolerances[] = {0.1, 1e-2, 1e-3};
    for (size_t i = 0; i < sizeof tolerances / sizeof tolerances[0]; ++i)
    {
        test_about("tolerance %g", tolerances[i]);
        if (CHECK_EQUAL(bake(MESH " %s --size-mm 50 --method bem --tolerance %g --report --reference 40", unsized,
                             tolerances[i]), 0))
        {
            CHECK_BELOW(reported("rel_l2"), tolerances[i]);
            // 40 vertices stand for all: what they show scatters by some 20 %.
            CHECK_BELOW(reported("rel_l2") - reported("reference_error"), 1.2 * reported("predicted_error"));
            CHECK_REL(reported("tolerance"), tolerances[i], 1e-5);
        }
    }
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; ++i)
    {
        test_about("%s", keys[i]);
        CHECK(has_key(keys[i]));
    }
    test_about(NULL);
    CHECK_BETWEEN(reported("relight_ms"), 1e-3, 1e5);
}

static void spurious_light_is_warned_of(void)
{   // The bunny's ears at 10 mm are as thin as the real source is deep; a cube of 40 mm is not.
    static const char *const methods[] = {"bem", "direct --geometry placed"};
    CHECK_EQUAL(bake(MESH " %s --size-mm 10 --report --method %s", unsized, methods[1]), 0);
    CHECK(reported("spurious_vertices") > 0.01 * reported("vertices"));
    CHECK(strstr(g_complained, "brighter than any light") != NULL);
    CHECK_EQUAL(bake(MESH " %s --size-mm 10 --report", unsized), 0); // by distance
    CHECK(strstr(g_complained, "brighter") == NULL);
    for (size_t i = 0; i < 2; ++i)
    {
        test_about("%s", methods[i]);
        CHECK_EQUAL(bake(CUBE " %s --size-mm 40 --report --method %s", unsized, methods[i]), 0);
        CHECK(reported("spurious_vertices") <= 0.0 && strstr(g_complained, "brighter") == NULL);
    }
}

// The method of the ranking's line, as the report prints it.
static void ranked(int place, char name[32])
{
    char key[32];
    snprintf(key, sizeof key, "\nranking_%d=", place);
    const char *const at = strstr(g_said, key);
    snprintf(name, 32, "%.*s", at ? (int)strcspn(at + strlen(key), " ") : 0, at ? at + strlen(key) : "");
}

static void auto_takes_the_least_that_does(void)
{   // Oracle: what only one method can do, and otherwise the ranking, whose first entry is run where its own prediction
    // is within the tolerance. The result is held against the converged reference.
    static const struct
    {
        const char *what, *options, *method; // NULL: the ranking's first
    } choices[] = {{"by distance", "--geometry distance", "direct"},
                   {"placed", "--geometry placed", NULL},
                   {"tighter than bem can", "--geometry placed --tolerance 3e-5", "direct"},
                   {"either", "--tolerance 0.02", NULL},
                   {"light changes", "--changes light --tolerance 0.05", NULL},
                   {"all changes", "--changes=light,geometry,material --tolerance 0.05", NULL},
                   {"so large that nothing shows", "--size-mm 1e7 --geometry placed", "lambert"}};
    for (size_t i = 0; i < sizeof choices / sizeof choices[0]; ++i)
    {
        char line[64], first[32];
        test_about("%s", choices[i].what);
        CHECK_EQUAL(bake(MESH " %s --size-mm 50 --method auto --report --reference 30 %s", unsized, choices[i].options),
                    0);
        ranked(1, first);
        if (strcmp(first, "direct-placed") == 0)
        {
            snprintf(first, sizeof first, "direct"); // as bake calls it, with its geometry
        }
        snprintf(line, sizeof line, "\nmethod=%s\n", choices[i].method ? choices[i].method : first);
        CHECK(strstr(g_said, line) != NULL);
        if (choices[i].method == NULL)
        {
            const double allowed = i == 1 ? 0.01 : i == 3 ? 0.02 : 0.05;
            CHECK_BELOW(reported("predicted_error"), allowed);
            CHECK_BELOW(reported("rel_l2"), allowed);
        }
        CHECK(has_key("ranking_reason") && has_key("model_error") && has_key("ranking_extrapolated"));
    }
    test_about("at 10 mm"); // where bem may need a tighter tolerance than asked for
    CHECK_EQUAL(bake(MESH " %s --size-mm 10 --method auto --geometry placed --tolerance 0.002 --report", unsized), 0);
    CHECK_BELOW(reported("predicted_error"), 0.002);
    test_about("a budget that nothing but Lambert keeps"); // bake still meets the tolerance, and says what it costs
    CHECK_EQUAL(bake(MESH " %s --size-mm 20 --method auto --changes light --budget-ms 1e-6 --report", unsized), 0);
    CHECK(strstr(g_said, " misses\n") != NULL && strstr(g_said, " meets\n") == NULL);
    CHECK_BELOW(reported("predicted_error"), 0.01);
    static const char *const bad[] = {"--method auto --changes air", "--method auto --changes light,,geometry",
                                      "--method bem --changes light", "--budget-ms 3", "--method auto --changes \"\"",
                                      "--method auto --budget-ms 0", "--method bem --geometry either"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i)
    {
        test_about("%s", bad[i]);
        CHECK_EQUAL(bake(MESH " %s --size-mm 20 --report %s", unsized, bad[i]), 2);
    }
}

// ---- hao ----

// Lights all over, both at the ends of the header's axis and in between.
static const char *const hao_lights[] = {"0,0,1", "0.577,0.577,0.577", "-0.3,-0.8,0.2", "0.9,0.1,-0.4"};

static void hao_agrees_with_direct(void)
{   // Oracle: the direct gather by distance, whose shadows are cast for the light itself.
    static const double direct_tolerance = 1e-4;
    char error[256] = "";
    model m;
    if (!CHECK(model_load(MESH, &m, error, sizeof error) == 0))
    {
        return;
    }
    for (size_t i = 0; i < sizeof hao_lights / sizeof hao_lights[0]; ++i)
    {
        char all[256];
        snprintf(all, sizeof all, MESH " --material marble --size-mm 40 --light %s%s", hao_lights[i],
                 i == 2 ? " --no-shadows" : "");
        test_about("%s", all);
        CHECK_EQUAL(bake("%s --method direct --tolerance %g --dump " FOLDER "direct.f32", all, direct_tolerance), 0);
        CHECK_EQUAL(bake("%s --method hao --report --dump " FOLDER "hao.f32", all), 0);
        const double predicted = reported("predicted_error");
        CHECK_BETWEEN(predicted, 1e-4, 0.15); // a thousand vertices are a coarse mesh for marble of this size
        // The prediction is a mean over lights and vertices; one light may be off by twice as much.
        CHECK_BELOW(rel_l2(&m, FOLDER "hao.f32", FOLDER "direct.f32"), 2.0 * predicted);
        CHECK_EQUAL(bake("%s --method lambert --dump " FOLDER "lambert.f32", all), 0);
        CHECK(rel_l2(&m, FOLDER "lambert.f32", FOLDER "direct.f32") > 2.0 * predicted); // this is no wide bound
    }
    model_free(&m);
}

static void hao_takes_soft_lights_and_surroundings(void)
{
    static const char *const options[] = {"--light 0,1,1 --soft 8", "--no-shadows --ambient 0.3,0.2,0.1",
                                          "--light -1,0,0 --soft 3 --ambient 1"};
    char error[256] = "";
    model m;
    if (!CHECK(model_load(MESH, &m, error, sizeof error) == 0))
    {
        return;
    }
    for (size_t i = 0; i < sizeof options / sizeof options[0]; ++i)
    {
        test_about("%s", options[i]);
        CHECK_EQUAL(bake(MESH " --material marble --size-mm 40 %s --dump " FOLDER "direct.f32", options[i]), 0);
        CHECK_EQUAL(bake(MESH " --material marble --size-mm 40 %s --method hao --report --dump " FOLDER "hao.f32",
                         options[i]), 0);
        CHECK_BELOW(rel_l2(&m, FOLDER "hao.f32", FOLDER "direct.f32"), 2.0 * reported("predicted_error"));
    }
    model_free(&m);
}

static void hao_keeps_its_prediction(void)
{   // Oracle: the converged integral over the whole bunny, for a light between those of the set.
    CHECK_EQUAL(bake("build/models/bunny.glb --material marble --size-mm 50 --light 0.5,0.6,-0.7 --method hao --report "
                     "--reference 60"), 0);
    CHECK_BETWEEN(reported("predicted_error"), 1e-3, 0.1);
    // 60 vertices and one light stand for all.
    CHECK_BELOW(reported("rel_l2"), 1.5 * reported("predicted_error"));
}

static void hao_reports_what_it_keeps(void)
{
    static const char *const keys[] = {"storage", "range_mm", "directions", "reference_points", "order", "sum_error",
                                       "interpolation_error", "storage_error", "snr_db", "truncated_energy",
                                       "bytes_vertices", "bytes_references", "bytes_tables", "relight_ms", "cache"};
    static const struct
    {
        const char *storage;
        double least, most; // bytes a vertex, RGB, 38 directions: the tables and references of a small mesh weigh
    } kept[] = {{"references --references 200", 40.0, 90.0}, {"table", 114.0, 135.0},
                {"harmonics --order 5", 150.0, 152.0}, {"float", 456.0, 460.0}, {"vectors", 1368.0, 1372.0}};
    double error[5];
    for (size_t i = 0; i < sizeof kept / sizeof kept[0]; ++i)
    {
        test_about("%s", kept[i].storage);
        CHECK_EQUAL(bake(MESH " %s --size-mm 40 --method hao --directions 40 --reference 20 --report --storage %s",
                         unsized, kept[i].storage), 0);
        CHECK_EQUAL(reported("directions"), 38); // the nearest lattice
        CHECK_BETWEEN(reported("bytes_per_vertex"), kept[i].least, kept[i].most);
        CHECK_BETWEEN(reported("frame_ms"), 1e-3, 1e4);
        error[i] = reported("storage_error");
    }
    CHECK(error[0] > 1e-4 && error[1] > 1e-4 && error[2] > 1e-4);
    CHECK_BELOW(error[3], 1e-6); // floats are the integrals themselves
    CHECK_BETWEEN(reported("rel_l2"), 1e-4, 0.2); // vectors, 38 directions
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; ++i)
    {
        test_about("%s", keys[i]);
        CHECK(has_key(keys[i]));
    }
}

static void hao_keeps_integrals_in_a_file(void)
{
    static char one[1 << 16], two[1 << 16];
    static const char light[] = "--light 0,1,0.2 --method hao --directions 66 --cache " FOLDER "cache.bin --report";
    remove(FOLDER "cache.bin");
    CHECK_EQUAL(bake(MESH " --material marble --size-mm 40 %s --dump " FOLDER "B1.f32", light), 0);
    CHECK(strstr(g_said, "\ncache=written\n") != NULL && file_size(FOLDER "cache.bin") > 1000);
    const size_t size = read_file(FOLDER "B1.f32", one, sizeof one);
    CHECK_EQUAL(bake(MESH " --material marble --size-mm 40 %s --dump " FOLDER "B2.f32", light), 0);
    CHECK(strstr(g_said, "\ncache=read\n") != NULL);
    CHECK(size > 100 && size == read_file(FOLDER "B2.f32", two, sizeof two) && memcmp(one, two, size) == 0);
    // Another light is what it is for; another size is another object.
    CHECK_EQUAL(bake(MESH " --material marble --size-mm 40 --ambient 1 %s", light), 0);
    CHECK(strstr(g_said, "\ncache=read\n") != NULL);
    CHECK_EQUAL(bake(MESH " --material marble --size-mm 20 %s", light), 0);
    CHECK(strstr(g_said, "\ncache=written\n") != NULL && strstr(g_complained, "anew") != NULL);
    CHECK_EQUAL(bake(MESH " --material skimmilk --size-mm 20 %s", light), 0);
    CHECK(strstr(g_said, "\ncache=written\n") != NULL);
    CHECK_EQUAL(bake(MESH " --material skimmilk --size-mm 20 --no-shadows %s", light), 0);
    CHECK(strstr(g_said, "\ncache=written\n") != NULL);
    CHECK_EQUAL(bake(MESH " --material skimmilk --size-mm 20 --no-shadows %s", light), 0);
    CHECK(strstr(g_said, "\ncache=read\n") != NULL);
}

static void hao_says_what_it_cannot_do(void)
{
    CHECK_EQUAL(bake(MESH " %s --method hao --geometry placed --report", scene), 2);
    CHECK(strstr(g_complained, "distance") != NULL && strstr(g_complained, "--method direct") != NULL);
    CHECK_EQUAL(bake(MESH " %s --dump-irradiance " FOLDER "E.f32", scene), 0);
    CHECK_EQUAL(bake(MESH " %s --method hao --irradiance " FOLDER "E.f32 --report", scene), 2);
    CHECK(strstr(g_complained, "--light") != NULL && strstr(g_complained, "--method direct") != NULL);
    CHECK_EQUAL(bake(MESH " %s --method hao --atlas-values texels --atlas " FOLDER "no.glb2 --report", scene), 2);
    CHECK(strstr(g_complained, "vertices") != NULL && strstr(g_complained, "--method direct") != NULL);
    CHECK_EQUAL(bake(MESH " %s --method hao --storage vectors --ambient 1 --report", scene), 2);
    CHECK(strstr(g_complained, "--ambient") != NULL);
    // A file that is no cache is left alone.
    const long long before = file_size(MESH);
    CHECK_EQUAL(bake(MESH " %s --method hao --directions 6 --cache " MESH " --report", scene), 2);
    CHECK(strstr(g_complained, "no cache") != NULL && file_size(MESH) == before);
    CHECK_EQUAL(bake(MESH " %s --method hao --directions 6 --cache " FOLDER "absent/cache.bin --report", scene), 2);
    CHECK(strstr(g_complained, "cannot write") != NULL);
}

// ---- atlas ----

// Vertices keep their positions bit by bit, so a texture vertex finds the one it was split from.
typedef struct place
{
    float x[3];
    uint32_t vertex;
} place;

static int by_place(const void *a, const void *b)
{
    return memcmp(((const place *)a)->x, ((const place *)b)->x, sizeof ((const place *)a)->x);
}

static place *sorted_places(const model *m)
{
    place *const places = (place *)calloc(m->vertex_count, sizeof *places);
    for (size_t v = 0; v < m->vertex_count && places; ++v)
    {
        memcpy(places[v].x, m->positions + 3 * v, sizeof places[v].x);
        places[v].vertex = (uint32_t)v;
    }
    if (places)
    {
        qsort(places, m->vertex_count, sizeof *places, by_place);
    }
    return places;
}

// The vertex of the mesh for each of the textured one; NULL where one has none. Few vertices of a mesh share a place;
// where they do, the one with the same normal counts.
static uint32_t *origins(const model *m, const textured *t)
{
    place *const places = sorted_places(m);
    uint32_t *const out = (uint32_t *)calloc(t->vertex_count, sizeof *out);
    int complete = places != NULL && out != NULL;
    for (size_t i = 0; i < t->vertex_count && complete; ++i)
    {
        place wanted;
        memcpy(wanted.x, t->positions + 3 * i, sizeof wanted.x);
        const place *const found = (const place *)bsearch(&wanted, places, m->vertex_count, sizeof wanted, by_place);
        complete = found != NULL && memcmp(m->normals + 3 * (size_t)found->vertex, t->normals + 3 * i,
                                           3 * sizeof(float)) == 0;
        out[i] = complete ? found->vertex : 0;
    }
    free(places);
    if (!complete)
    {
        free(out);
        return NULL;
    }
    return out;
}

typedef struct texture_error
{
    double rms; // over the root mean square of the vertex colours
    double far; // share of the values that are off by more than a twentieth of the largest
} texture_error;

// Of the texture fetched at the vertices, times white, against the radiosity there.   upside_down  fetches at 1 - v
static texture_error texture_errors(const textured *t, const uint32_t *origin, const float *B, int upside_down)
{
    double off = 0.0, all = 0.0, far = 0.0;
    for (size_t i = 0; i < t->vertex_count; ++i)
    {
        double got[3];
        const double v = (double)t->uv[2 * i + 1];
        textured_fetch(t, (double)t->uv[2 * i], upside_down ? 1.0 - v : v, got);
        for (size_t k = 0; k < 3; ++k)
        {
            const double want = (double)B[3 * (size_t)origin[i] + k], d = t->white * got[k] - want;
            off += d * d;
            all += want * want;
            far += fabs(d) > 0.05 * t->white; // white is the largest
        }
    }
    const texture_error e = {sqrt(off / all), far / (3.0 * (double)t->vertex_count)};
    return e;
}

// Same triangles in the same order, split only where needed, texture coordinates inside the picture.
static void check_textured_mesh(const model *m, const textured *t, const uint32_t *origin, int size)
{
    size_t outside = 0, moved = 0;
    CHECK_EQUAL(t->triangle_count, m->triangle_count);
    CHECK(t->vertex_count >= m->vertex_count && t->vertex_count < 3 * m->triangle_count);
    CHECK_EQUAL(t->width, size);
    CHECK_EQUAL(t->height, size);
    CHECK(t->unlit && t->clamped && t->white > 0.0);
    for (size_t i = 0; i < 2 * t->vertex_count; ++i)
    {
        outside += !(t->uv[i] >= 0.0f && t->uv[i] <= 1.0f);
    }
    CHECK_EQUAL(outside, 0);
    for (size_t i = 0; i < 3 * m->triangle_count && t->triangle_count == m->triangle_count; ++i)
    {
        moved += origin[t->triangles[i]] != m->triangles[i];
    }
    CHECK_EQUAL(moved, 0);
}

// Bakes a mesh with an atlas and its vertex colours, and compares the two; returns the relative error.
static double compare_texture(const char *path, const char *options, int size, double rms, double far)
{
    double measured = HUGE_VAL;
    char error[256] = "";
    model m;
    textured t;
    memset(&t, 0, sizeof t);
    test_about("%s %s", path, options);
    CHECK(model_load(path, &m, error, sizeof error) == 0);
    if (CHECK_EQUAL(bake("%s %s --size-mm 50 --atlas " FOLDER "atlas.glb --atlas-size %d --dump " FOLDER
                         "B.f32 --report %s", path, unsized, size, options), 0) &&
        CHECK(textured_load(FOLDER "atlas.glb", &t, error, sizeof error) == 0))
    {
        uint32_t *const origin = origins(&m, &t);
        float *const B = load_floats(FOLDER "B.f32", 3 * m.vertex_count);
        if (CHECK(origin != NULL && B != NULL))
        {
            const texture_error e = texture_errors(&t, origin, B, 0);
            measured = e.rms;
            check_textured_mesh(&m, &t, origin, size);
            CHECK_BELOW(e.rms, rms);
            CHECK_BELOW(e.far, far);
            CHECK(texture_errors(&t, origin, B, 1).rms > 0.2); // the mutation must be caught
            CHECK_REL(t.white, reported("atlas_white"), 1e-8);
            CHECK_EQUAL(reported("atlas_vertices"), t.vertex_count);
            CHECK_EQUAL(reported("atlas_overlaps"), 0);
        }
        free(origin);
        free(B);
    }
    textured_free(&t);
    model_free(&m);
    return measured;
}

// A texel stands for more than one point, and eight bits for more than one value: the bounds are what these make.
static void texture_is_the_radiosity_of_the_vertices(void)
{
    compare_texture(MESH, "--method direct", 128, 0.10, 0.20);
    compare_texture(MESH, "--method bem", 512, 0.06, 0.05);
    compare_texture(MESH, "--method lambert", 512, 0.06, 0.05);
    compare_texture(MESH, "--method auto --geometry placed --atlas-method orthographic", 256, 0.08, 0.10);
    compare_texture(MESH, "--method bem --atlas-method convex", 256, 0.10, 0.15);
    compare_texture(CUBE, "--method bem", 256, 0.06, 0.05);
    compare_texture(CUBE, "--method hao --directions 38", 256, 0.06, 0.05);
}

// A quarter of the texel, a quarter of the error, but for eight bits and slits in charts narrower than a texel.
static void texture_converges(void)
{
    static const char options[] = "--method direct --atlas-values vertices";
    const double coarse = compare_texture(MESH, options, 128, 0.10, 0.20);
    const double fine = compare_texture(MESH, options, 512, 0.04, 0.02);
    CHECK_BETWEEN(coarse / fine, 1.5, 6.0);
}

static void atlas_alone_is_a_picture_of_its_size(void)
{
    unsigned char head[24];
    CHECK_EQUAL(bake(MESH " %s --method bem --atlas-png " FOLDER "atlas.png --atlas-size 200", scene), 0);
    CHECK_EQUAL(read_file(FOLDER "atlas.png", (char *)head, sizeof head), sizeof head);
    CHECK_EQUAL(256 * head[18] + head[19], 200);
    CHECK_EQUAL(256 * head[22] + head[23], 200);
}

static void atlas_values_follow_the_option(void)
{
    static const struct
    {
        const char *options, *said;
    } cases[] = {{"--method bem", "texels"},
                 {"--method bem --atlas-values vertices", "vertices"},
                 {"--method direct", "texels"}, // 10,000 texels and 2,000 triangles: soon done
                 {"--method direct --atlas-values vertices", "vertices"},
                 {"--method lambert --atlas-values texels", "vertices"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i)
    {
        char line[64];
        test_about("%s", cases[i].options);
        snprintf(line, sizeof line, "\natlas_values=%s\n", cases[i].said);
        CHECK_EQUAL(bake(MESH " %s --atlas " FOLDER "atlas.glb --atlas-size 128 --report %s", scene,
                         cases[i].options), 0);
        CHECK(strstr(g_said, line) != NULL);
    }
}

// ---- refusals ----

// Exit status 2, a line on standard error, nothing on standard output, no output file.
static void refuse(const char *what, const char *arguments)
{
    char all[3072];
    test_about("%s", what);
    remove(FOLDER "no.glb");
    remove(FOLDER "no.png");
    remove(FOLDER "no.f32");
    snprintf(all, sizeof all, "%s --out " FOLDER "no.glb --png " FOLDER "no.png --dump " FOLDER "no.f32", arguments);
    CHECK_EQUAL(bake("%s", all), 2);
    CHECK(strlen(g_complained) > 10 && strchr(g_complained, '\n') != NULL && g_said[0] == '\0');
    CHECK(!exists(FOLDER "no.glb") && !exists(FOLDER "no.png") && !exists(FOLDER "no.f32"));
    CHECK(!exists(FOLDER "no.glb2") && !exists(FOLDER "no.png2"));
}

static void wrong_arguments_are_refused(void)
{
    static const char *const wrong[][2] = {
        {"nothing at all", ""},
        {"no such file", FOLDER "absent.glb --material marble --size-mm 10 --light 0,0,1"},
        {"a folder", FOLDER " --material marble --size-mm 10 --light 0,0,1"},
        {"no material", MESH " --size-mm 10 --light 0,0,1"},
        {"unknown material", MESH " --material plywood --size-mm 10 --light 0,0,1"},
        {"two materials", MESH " --material marble --albedo .5,.5,.5 --mfp 1,1,1 --size-mm 10 --light 0,0,1"},
        {"half a material", MESH " --sigma-s 1,1,1 --size-mm 10 --light 0,0,1"},
        {"half a material", MESH " --mfp 1,1,1 --size-mm 10 --light 0,0,1"},
        {"no light", MESH " --material marble --size-mm 10"},
        {"light without direction", MESH " --material marble --size-mm 10 --light 0,0,0"},
        {"light of two numbers", MESH " --material marble --size-mm 10 --light 0,1"},
        {"light that is no number", MESH " --material marble --size-mm 10 --light 0,0,nan"},
        {"size 0", MESH " --material marble --size-mm 0 --light 0,0,1"},
        {"size -1", MESH " --material marble --size-mm -1 --light 0,0,1"},
        {"size with a tail", MESH " --material marble --size-mm 10mm --light 0,0,1"},
        {"size infinite", MESH " --material marble --size-mm inf --light 0,0,1"},
        {"albedo above 1", MESH " --albedo 1.1,.5,.5 --mfp 1,1,1 --size-mm 10 --light 0,0,1"},
        {"mean free path 0", MESH " --albedo .5,.5,.5 --mfp 0,1,1 --size-mm 10 --light 0,0,1"},
        {"negative scattering", MESH " --sigma-s -1,1,1 --sigma-a 0,0,0 --size-mm 10 --light 0,0,1"},
        {"eta 0", MESH " --material marble --eta 0 --size-mm 10 --light 0,0,1"},
        {"unknown method", MESH " --material marble --size-mm 10 --light 0,0,1 --method magic"},
        {"bem by distance", MESH " --material marble --size-mm 10 --light 0,0,1 --method bem --geometry distance"},
        {"bem below its tolerance", MESH " --material marble --size-mm 10 --light 0,0,1 --method bem --tolerance 2e-5"},
        {"guard without bem", MESH " --material marble --size-mm 10 --light 0,0,1 --guard 0.5"},
        {"guard 2", MESH " --material marble --size-mm 10 --light 0,0,1 --method bem --guard 2"},
        {"hao placed", MESH " --material marble --size-mm 10 --light 0,0,1 --method hao --geometry placed"},
        {"hao beyond its tolerance", MESH " --material marble --size-mm 10 --light 0,0,1 --method hao --tolerance .3"},
        {"order 9", MESH " --material marble --size-mm 10 --light 0,0,1 --method hao --order 9"},
        {"three directions", MESH " --material marble --size-mm 10 --light 0,0,1 --method hao --directions 3"},
        {"unknown storage", MESH " --material marble --size-mm 10 --light 0,0,1 --method hao --storage sand"},
        {"cache without hao", MESH " --material marble --size-mm 10 --light 0,0,1 --cache " FOLDER "no.f32"},
        {"unknown geometry", MESH " --material marble --size-mm 10 --light 0,0,1 --geometry round"},
        {"unknown option", MESH " --material marble --size-mm 10 --light 0,0,1 --frobnicate 3"},
        {"option without value", MESH " --material marble --light 0,0,1 --size-mm"},
        {"no threads", MESH " --material marble --size-mm 10 --light 0,0,1 --threads 0"},
        {"threads no number", MESH " --material marble --size-mm 10 --light 0,0,1 --threads two"},
        {"tolerance 0", MESH " --material marble --size-mm 10 --light 0,0,1 --tolerance 0"},
        {"tolerance 2", MESH " --material marble --size-mm 10 --light 0,0,1 --tolerance 2"},
        {"reference of none", MESH " --material marble --size-mm 10 --light 0,0,1 --reference 0"},
        {"two input files", MESH " " MESH " --material marble --size-mm 10 --light 0,0,1"},
        {"irradiance absent", MESH " --material marble --size-mm 10 --irradiance " FOLDER "absent.f32"},
        {"irradiance of another size", MESH " --material marble --size-mm 10 --irradiance " FOLDER "short.f32"},
        {"irradiance not finite", MESH " --material marble --size-mm 10 --irradiance " FOLDER "nan.f32"},
        {"atlas size 0", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas " FOLDER "no.glb2 --atlas-size 0"},
        {"atlas size no number", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas-png " FOLDER
         "no.png2 --atlas-size big"},
        {"atlas too large", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas " FOLDER
         "no.glb2 --atlas-size 16385"},
        {"atlas too small for its charts", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas " FOLDER
         "no.glb2 --atlas-size 2"},
        {"unknown atlas method", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas " FOLDER
         "no.glb2 --atlas-method magic"},
        {"unknown atlas values", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas " FOLDER
         "no.glb2 --atlas-values all"},
        {"atlas size without atlas", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas-size 256"},
        {"atlas method without atlas", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas-method area"},
        {"atlas in no folder", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas " FOLDER "absent/no.glb2"},
        {"atlas over the mesh", MESH " --material marble --size-mm 10 --light 0,0,1 --atlas " FOLDER "no.glb"},
        {"camera of one number", MESH " --material marble --size-mm 10 --light 0,0,1 --camera 3"},
        {"picture of no size", MESH " --material marble --size-mm 10 --light 0,0,1 --resolution 0x0"}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i)
    {
        refuse(wrong[i][0], wrong[i][1]);
    }
}

static void bem_says_what_it_cannot_do(void)
{
    CHECK_EQUAL(bake(MESH " %s --method bem --geometry distance --report", scene), 2);
    CHECK(strstr(g_complained, "placed") != NULL && strstr(g_complained, "--method direct") != NULL);
    CHECK_EQUAL(bake(MESH " %s --method bem --tolerance 2e-5 --report", scene), 2);
    CHECK(strstr(g_complained, "0.0001") != NULL && strstr(g_complained, "--method direct") != NULL);
}

static void an_output_that_cannot_be_written_leaves_none(void)
{
    remove(FOLDER "no.f32");
    CHECK_EQUAL(bake(MESH " %s --dump " FOLDER "no.f32 --out " FOLDER "absent/no.glb", scene), 2);
    CHECK(!exists(FOLDER "no.f32") && strlen(g_complained) > 10);
}

// ---- files ----

static int write_file(const char *path, const void *bytes, size_t size)
{
    FILE *const file = fopen(path, "wb");
    const size_t written = file ? fwrite(bytes, 1, size, file) : 0;
    return file && fclose(file) == 0 && written == size;
}

// A tetrahedron's four corners as floats, then its indices as 8, 16 and 32 bits, in shape.bin.
static int write_shape(void)
{
    static const float corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const unsigned char triangles[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    unsigned char bytes[48 + 12 + 24 + 48];
    memcpy(bytes, corners, 48);
    memcpy(bytes + 48, triangles, 12);
    for (size_t i = 0; i < 12; ++i)
    {
        const uint16_t small = triangles[i];
        const uint32_t large = triangles[i];
        memcpy(bytes + 60 + 2 * i, &small, 2);
        memcpy(bytes + 84 + 4 * i, &large, 4);
    }
    return write_file(FOLDER "shape.bin", bytes, sizeof bytes);
}

// A glTF scene on shape.bin with these parts of its JSON.
static int write_scene(const char *nodes, const char *primitives, const char *accessor)
{
    char text[4096];
    const int length = snprintf(text, sizeof text,
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[%s],"
        "\"meshes\":[{\"primitives\":[%s]}],\"buffers\":[{\"uri\":\"shape.bin\",\"byteLength\":132}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteOffset\":0,\"byteLength\":48},"
        "{\"buffer\":0,\"byteOffset\":48,\"byteLength\":12},{\"buffer\":0,\"byteOffset\":60,\"byteLength\":24},"
        "{\"buffer\":0,\"byteOffset\":84,\"byteLength\":48}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5121,\"count\":12,\"type\":\"SCALAR\"},"
        "{\"bufferView\":2,\"componentType\":5123,\"count\":12,\"type\":\"SCALAR\"},"
        "{\"bufferView\":3,\"componentType\":5125,\"count\":12,\"type\":\"SCALAR\"}%s]}",
        nodes, primitives, accessor);
    return length > 0 && (size_t)length < sizeof text && write_file(FOLDER "scene.gltf", text, (size_t)length);
}

#define PLAIN "{\"mesh\":0}"
#define POSITION "{\"attributes\":{\"POSITION\":0}"

static void every_way_to_write_a_mesh_is_read(void)
{
    static const struct
    {
        const char *what, *nodes, *primitives;
        int vertices, triangles;
        double extent; // of the file's unit
    } forms[] = {
        {"8-bit indices", PLAIN, POSITION ",\"indices\":1}", 4, 4, 1.0},
        {"16-bit indices", PLAIN, POSITION ",\"indices\":2}", 4, 4, 1.0},
        {"32-bit indices", PLAIN, POSITION ",\"indices\":3}", 4, 4, 1.0},
        {"no indices", PLAIN, POSITION "}", 4, 1, 1.0},
        {"a strip", PLAIN, POSITION ",\"mode\":5}", 4, 2, 1.0},
        {"a fan", PLAIN, POSITION ",\"mode\":6}", 4, 2, 1.0},
        {"a scaled node", "{\"mesh\":0,\"scale\":[3,1,1]}", POSITION ",\"indices\":1}", 4, 4, 3.0},
        {"nested nodes", "{\"children\":[1],\"scale\":[2,2,2]},{\"mesh\":0,\"scale\":[3,1,1]}",
         POSITION ",\"indices\":1}", 4, 4, 6.0},
        {"a matrix", "{\"mesh\":0,\"matrix\":[5,0,0,0,0,1,0,0,0,0,1,0,7,0,0,1]}",
         POSITION ",\"indices\":1}", 4, 4, 5.0},
        {"two nodes", "{\"mesh\":0,\"children\":[1]},{\"mesh\":0,\"translation\":[9,0,0]}",
         POSITION ",\"indices\":1}", 8, 8, 10.0}};
    CHECK(write_shape());
    for (size_t i = 0; i < sizeof forms / sizeof forms[0]; ++i)
    {
        test_about("%s", forms[i].what);
        CHECK(write_scene(forms[i].nodes, forms[i].primitives, ""));
        CHECK_EQUAL(bake(FOLDER "scene.gltf --material marble --mm-per-unit 2 --light 0,0,1 --report --dump " FOLDER
                         "B.f32"), 0);
        CHECK_EQUAL(reported("vertices"), forms[i].vertices);
        CHECK_EQUAL(reported("triangles"), forms[i].triangles);
        CHECK_REL(reported("size_mm"), 2.0 * forms[i].extent, 1e-6);
        CHECK_EQUAL(file_size(FOLDER "B.f32"), 12 * forms[i].vertices);
    }
}

static void hostile_scenes_are_refused(void)
{
    static const struct
    {
        const char *what, *nodes, *primitives, *accessor;
    } hostile[] = {
        {"points only", PLAIN, POSITION ",\"mode\":0}", ""},
        {"lines only", PLAIN, POSITION ",\"mode\":1,\"indices\":1}", ""},
        {"no primitive", PLAIN, "", ""},
        {"a node without mesh", "{}", POSITION "}", ""},
        {"a mesh that is not there", "{\"mesh\":7}", POSITION "}", ""},
        {"a node that is its own child", "{\"mesh\":0,\"children\":[0]}", POSITION "}", ""},
        {"a child that is not there", "{\"mesh\":0,\"children\":[99]}", POSITION "}", ""},
        {"an accessor that is not there", PLAIN, "{\"attributes\":{\"POSITION\":44}}", ""},
        {"a negative accessor", PLAIN, "{\"attributes\":{\"POSITION\":-3}}", ""},
        {"no positions", PLAIN, "{\"attributes\":{}}", ""},
        {"indices as positions", PLAIN, "{\"attributes\":{\"POSITION\":3}}", ""},
        {"positions as indices", PLAIN, POSITION ",\"indices\":0}", ""},
        {"an index out of range", PLAIN, POSITION ",\"indices\":4}",
         ",{\"bufferView\":0,\"componentType\":5121,\"count\":48,\"type\":\"SCALAR\"}"},
        {"a count beyond the buffer", PLAIN, "{\"attributes\":{\"POSITION\":4}}",
         ",{\"bufferView\":0,\"componentType\":5126,\"count\":400000000,\"type\":\"VEC3\"}"},
        {"an offset beyond the buffer", PLAIN, "{\"attributes\":{\"POSITION\":4}}",
         ",{\"bufferView\":0,\"byteOffset\":4294967280,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}"},
        {"a misaligned end", PLAIN, "{\"attributes\":{\"POSITION\":4}}",
         ",{\"bufferView\":0,\"byteOffset\":4,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}"},
        {"a buffer view that is not there", PLAIN, "{\"attributes\":{\"POSITION\":4}}",
         ",{\"bufferView\":77,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}"},
        {"a scale of zero", "{\"mesh\":0,\"scale\":[0,0,0]}", POSITION ",\"indices\":1}", ""},
        {"a scale beyond float", "{\"mesh\":0,\"scale\":[1e300,1,1]}", POSITION ",\"indices\":1}", ""}};
    CHECK(write_shape());
    for (size_t i = 0; i < sizeof hostile / sizeof hostile[0]; ++i)
    {
        CHECK(write_scene(hostile[i].nodes, hostile[i].primitives, hostile[i].accessor));
        refuse(hostile[i].what, FOLDER "scene.gltf --material marble --size-mm 10 --light 0,0,1");
    }
    CHECK(write_file(FOLDER "scene.gltf", "", 0));
    refuse("an empty file", FOLDER "scene.gltf --material marble --size-mm 10 --light 0,0,1");
    CHECK(write_file(FOLDER "scene.gltf", "no glTF\n", 8));
    refuse("a text file", FOLDER "scene.gltf --material marble --size-mm 10 --light 0,0,1");
    CHECK(write_file(FOLDER "scene.glb", "glTF\2\0\0\0\377\377\377\377\377\377\377\377JSON", 20));
    refuse("a container with enormous sizes", FOLDER "scene.glb --material marble --size-mm 10 --light 0,0,1");
}

// Cut short anywhere, or with a byte changed anywhere: it bakes or refuses, but does neither crash nor hang.
static void damaged_files_do_no_harm(void)
{
    static char bytes[1 << 20];
    const size_t size = read_file(MESH, bytes, sizeof bytes);
    const size_t json = 20 + (size_t)(unsigned char)bytes[12] + 256 * (size_t)(unsigned char)bytes[13];
    uint32_t random = 2463534242u;
    int harmed = 0, refused = 0, baked = 0;
    if (!CHECK(size > 1000 && size < sizeof bytes && json < size))
    {
        return;
    }
    for (size_t i = 0; i < 240; ++i)
    {
        const int cut = i % 4 == 0;
        random ^= random << 13, random ^= random >> 17, random ^= random << 5; // Marsaglia's xorshift
        const size_t where = i % 2 ? random % json : random % size; // the JSON is the delicate part
        const char kept = bytes[where];
        bytes[where] = (char)(random >> 24);
        CHECK(write_file(FOLDER "damaged.glb", bytes, cut ? where : size));
        bytes[where] = kept;
        const int status = bake(FOLDER "damaged.glb --method lambert --material marble --size-mm 10 --light 0,0,1 "
                                "--no-shadows --dump " FOLDER "B.f32");
        baked += status == 0;
        refused += status == 2;
        if (status != 0 && status != 2)
        {
            ++harmed;
            test_note("status %d with byte %zu of %zu %s", status, where, size, cut ? "the end" : "changed");
        }
    }
    test_note("%d refused, %d baked all the same", refused, baked);
    CHECK_EQUAL(harmed, 0);
    CHECK(refused > 60); // a file cut short at the least
}

// ---- set-up ----

// The bunny thinned to some two thousand triangles, two files that are no irradiance for it, and a rounded cube.
static int write_inputs(void)
{
    mesh_data bunny, small;
    model m;
    char error[256] = "";
    static const float short_irradiance[3] = {1.0f, 1.0f, 1.0f};
    mkdir("build", 0777);
    mkdir("build/tests", 0777);
    mkdir("build/tests/bake", 0777);
    if (mesh_load_bunny(&bunny) != 0 || mesh_decimate(&bunny, 35.0, &small) != 0)
    {
        return 0;
    }
    m.positions = small.positions;
    m.normals = small.normals;
    m.triangles = small.triangles;
    m.vertex_count = small.vertex_count;
    m.triangle_count = small.triangle_count;
    float *const colors = (float *)calloc(3 * m.vertex_count, sizeof *colors);
    int done = colors && model_save_glb(MESH, &m, colors, error, sizeof error) == 0;
    if (done)
    {
        colors[7] = (float)NAN;
        done = write_file(FOLDER "nan.f32", colors, 3 * m.vertex_count * sizeof *colors) &&
               write_file(FOLDER "short.f32", short_irradiance, sizeof short_irradiance);
    }
    free(colors);
    mesh_free(&bunny);
    mesh_free(&small);
    memset(&m, 0, sizeof m);
    done = done && shape_cube(16, &m) == 0 && model_save_glb(CUBE, &m, m.normals, error, sizeof error) == 0;
    model_free(&m);
    return done;
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {TEST(dumps_are_what_the_library_computes),
                                      TEST(irradiance_may_come_from_a_file),
                                      TEST(mesh_keeps_its_order_and_carries_the_radiosity),
                                      TEST(methods_and_geometries_differ_as_they_should),
                                      TEST(threads_change_nothing),
                                      TEST(bem_agrees_with_direct_placed),
                                      TEST(bem_keeps_its_prediction),
                                      TEST(spurious_light_is_warned_of),
                                      TEST(auto_takes_the_least_that_does),
                                      TEST(bem_says_what_it_cannot_do),
                                      TEST(hao_agrees_with_direct),
                                      TEST(hao_takes_soft_lights_and_surroundings),
                                      TEST(hao_keeps_its_prediction),
                                      TEST(hao_reports_what_it_keeps),
                                      TEST(hao_keeps_integrals_in_a_file),
                                      TEST(hao_says_what_it_cannot_do),
                                      TEST(texture_is_the_radiosity_of_the_vertices),
                                      TEST(texture_converges),
                                      TEST(atlas_alone_is_a_picture_of_its_size),
                                      TEST(atlas_values_follow_the_option),
                                      TEST(materials_may_be_given_in_three_ways),
                                      TEST(report_names_everything),
                                      TEST(picture_is_a_png_of_the_asked_size),
                                      TEST(help_names_every_option),
                                      TEST(wrong_arguments_are_refused),
                                      TEST(an_output_that_cannot_be_written_leaves_none),
                                      TEST(every_way_to_write_a_mesh_is_read),
                                      TEST(hostile_scenes_are_refused),
                                      TEST(damaged_files_do_no_harm)};
    if (!write_inputs())
    {
        fprintf(stderr, "cannot write the inputs to " FOLDER "\n0 passed, 1 failed\n");
        return 1;
    }
    return test_main(argc, argv, "bake", tests, sizeof tests / sizeof *tests);
}
