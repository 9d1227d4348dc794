// What breaks the method: sweeps of one parameter each, from harmless to extreme. Of every step are checked: nothing
// infinite or NaN, no spike, the error against the converged reference of the same dipole within what was asked and
// what was predicted. Where the dipole model itself fails the sweep says by how much.
//   build/tests/stability/stability [--write FOLDER] [TEST]
// Without --write a few steps of every sweep. With it all of them, and FOLDER/stability_bem.csv:
//   sweep,x,rel_l2,rel_max,predicted,value,ideal      value and ideal: what is measured of the model, or empty

#define SSS_DIPOLE_IMPLEMENTATION
#include "../../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../../sss_bem.h"

#include "../common/default_guard.h"
#include "../common/test.h"
#include "objects.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
static const double TOLERANCE = 1e-2;
static const double TRUTH_TOLERANCE = 1e-4;
static double g_guard; // the default one

static FILE *g_csv; // NULL: the short version
static const double no_value = -1.0;

static void record(const char *sweep, double x, const outcome *o, double value, double ideal)
{
    if (!g_csv)
    {
        return;
    }
    fprintf(g_csv, "%s,%.6g,%.3e,%.3e,%.3e", sweep, x, o->rel_l2, o->rel_max, o->predicted);
    if (value >= 0.0) fprintf(g_csv, ",%.6g", value);
    else fprintf(g_csv, ",");
    if (ideal >= 0.0) fprintf(g_csv, ",%.6g\n", ideal);
    else fprintf(g_csv, ",\n");
}

// The largest B that light of E = 1 can make: a plane gives alpha'/2 (exp(-sigma z_r) + exp(-sigma z_v)) <= 1; each of
// the two sources gives at most 3 pi/guard alpha'/(4 pi) more where it lies close to a surface (sss_bem_options.guard).
static double brightest(double E)
{
    return E * (1.0 + 2.0 * 3.0 / (4.0 * g_guard));
}

// What every step has to hold. `whole`: the outcome is of all receivers.
static void check_step(const char *sweep, double x, const outcome *o, double E)
{
    test_about("%s, %.4g", sweep, x);
    CHECK(o->finite);
    CHECK_BELOW(o->largest, brightest(E));
    CHECK_BELOW(o->rel_l2, TOLERANCE);
    CHECK_BELOW(o->rel_max, 3.0 * TOLERANCE);
    CHECK_BELOW(o->rel_l2, o->predicted);
}

static int shade_and_compare(object *o, outcome *result)
{
    double predicted;
    if (object_find_truth(o, g_guard, TRUTH_TOLERANCE) != 0 || object_shade(o, TOLERANCE, 0.0, &predicted) != 0)
    {
        return 1;
    }
    *result = object_compare(o, 0, o->count);
    result->predicted = predicted;
    return 0;
}

// Steps of a sweep from `first` to `last` by equal factors; the short version takes the ends and the middle.
static int steps_of(int full)
{
    return g_csv ? full : 3;
}

static double step_at(int i, int count, double first, double last)
{
    return first * pow(last / first, (double)i / (double)(count - 1));
}

static int append(mesh_data *to, const mesh_data *from)
{
    mesh_data sum;
    const size_t V = to->vertex_count + from->vertex_count, T = to->triangle_count + from->triangle_count;
    memset(&sum, 0, sizeof sum);
    sum.positions = (float *)malloc(3 * V * sizeof(float));
    sum.normals = (float *)malloc(3 * V * sizeof(float));
    sum.triangles = (uint32_t *)malloc(3 * T * sizeof(uint32_t));
    if (!sum.positions || !sum.normals || !sum.triangles)
    {
        mesh_free(&sum);
        return 1;
    }
    sum.vertex_count = V;
    sum.triangle_count = T;
    memcpy(sum.positions, to->positions, 3 * to->vertex_count * sizeof(float));
    memcpy(sum.normals, to->normals, 3 * to->vertex_count * sizeof(float));
    memcpy(sum.triangles, to->triangles, 3 * to->triangle_count * sizeof(uint32_t));
    memcpy(sum.positions + 3 * to->vertex_count, from->positions, 3 * from->vertex_count * sizeof(float));
    memcpy(sum.normals + 3 * to->vertex_count, from->normals, 3 * from->vertex_count * sizeof(float));
    for (size_t i = 0; i < 3 * from->triangle_count; ++i)
    {
        sum.triangles[3 * to->triangle_count + i] = from->triangles[i] + (uint32_t)to->vertex_count;
    }
    mesh_free(to);
    *to = sum;
    return 0;
}

// ---- slab ----

enum
{
    SLAB_CELLS = 32
};
static const double SLAB_SIDE = 64.0; // mean free paths; sigma_tr is 0.17 and more

// Two squares, the lower one turned over.
static int make_slab(double thickness, mesh_data *out)
{
    mesh_data lower;
    const double up[3] = {0.0, 0.0, thickness};
    if (mesh_grid(SLAB_CELLS, SLAB_SIDE, out) != 0)
    {
        return 1;
    }
    if (mesh_grid(SLAB_CELLS, SLAB_SIDE, &lower) != 0)
    {
        mesh_free(out);
        return 1;
    }
    mesh_transform(out, 1.0, up);
    for (size_t t = 0; t < lower.triangle_count; ++t)
    {
        const uint32_t swapped = lower.triangles[3 * t + 1];
        lower.triangles[3 * t + 1] = lower.triangles[3 * t + 2];
        lower.triangles[3 * t + 2] = swapped;
    }
    mesh_compute_normals(&lower);
    const int failed = append(out, &lower);
    mesh_free(&lower);
    if (failed) mesh_free(out);
    return failed;
}

// All images of the dipole in a slab of thickness d: shared TRUTH 1.4, from Contini et al. 1997.
static void multipole(const sss_profile *p, int channel, double d, double *R, double *T)
{
    const double s = p->sigma_tr[channel], z_r = p->z_r[channel], z_b = 0.5 * (p->z_v[channel] - z_r);
    const double front = p->alpha_p[channel] * cosh(s * z_b) / sinh(s * (d + 2.0 * z_b));
    *R = front * sinh(s * (d + z_b - z_r));
    *T = front * sinh(s * (z_r + z_b));
}

// The upper face is lit by E = 1; the model's numbers are of the middle of either face, channel by channel.
static void slab(void)
{   // Oracles: the converged reference; for the model the closed form of a slab, with all images.
    static const double albedo[3] = {0.9, 0.95, 0.99};
    static const char *const names[2][3] = {{"slab front 0.9", "slab front 0.95", "slab front 0.99"},
                                            {"slab back 0.9", "slab back 0.95", "slab back 0.99"}};
    const int count = steps_of(11);
    for (int i = 0; i < count; ++i)
    {
        const double d = step_at(i, count, 0.25, 8.0);
        const size_t face = (SLAB_CELLS + 1) * (SLAB_CELLS + 1), middle = face / 2;
        mesh_data mesh;
        object o;
        outcome all, back;
        if (make_slab(d, &mesh) != 0 || object_create(&mesh, albedo, 1.3, &o) != 0) SKIP("out of memory");
        for (size_t v = 0; v < 3 * face; ++v)
        {
            o.irradiance[v] = 1.0f;
        }
        CHECK_EQUAL(object_add_receivers(&o, 0, face, g_csv ? 37 : 151), 0);
        CHECK_EQUAL(object_add_receivers(&o, middle, middle + 1, 1), 0);
        const size_t front_count = o.count;
        CHECK_EQUAL(object_add_receivers(&o, face, 2 * face, g_csv ? 37 : 151), 0);
        CHECK_EQUAL(object_add_receivers(&o, face + middle, face + middle + 1, 1), 0);
        CHECK_EQUAL(shade_and_compare(&o, &all), 0);
        check_step("slab", d, &all, 1.0);
        back = object_compare(&o, front_count, o.count);
        back.predicted = all.predicted;
        for (int k = 0; k < 3; ++k)
        {
            double R, T;
            multipole(&o.profile, k, d, &R, &T);
            record(names[0][k], d, &all, (double)o.radiosity[3 * middle + (size_t)k], R);
            record(names[1][k], d, &back, (double)o.radiosity[3 * (face + middle) + (size_t)k], T);
        }
        if (i == count - 1)
        {   // Thick enough for the model: 8 mean free paths, alpha' = 0.9.
            double R, T;
            multipole(&o.profile, 0, d, &R, &T);
            CHECK_REL((double)o.radiosity[3 * middle], R, 0.02);
        }
        object_free(&o);
    }
}

// ---- sphere ----

static void sphere(void)
{   // Oracles: the converged reference; for the model a white furnace: without absorption all that enters leaves.
    static const double albedo[3] = {0.9, 0.99, 1.0};
    const int count = steps_of(11), levels = g_csv ? 4 : 3;
    for (int i = 0; i < count; ++i)
    {
        const double radius = step_at(i, count, 0.5, 50.0);
        mesh_data mesh;
        object o;
        outcome lit;
        double sum = 0.0, area = 0.0;
        if (mesh_sphere(levels, radius, &mesh) != 0 || object_create(&mesh, albedo, 1.3, &o) != 0)
            SKIP("out of memory");
        CHECK_EQUAL(object_light(&o, 1.0, 2.0, 3.0), 0);
        CHECK_EQUAL(object_add_receivers(&o, 0, o.mesh.vertex_count, o.mesh.vertex_count / (g_csv ? 48 : 16)), 0);
        CHECK_EQUAL(shade_and_compare(&o, &lit), 0);
        check_step("sphere", radius, &lit, 1.0);
        for (size_t v = 0; v < 3 * o.mesh.vertex_count; ++v)
        {
            o.irradiance[v] = 1.0f;
        }
        CHECK_EQUAL(object_shade(&o, TOLERANCE, 0.0, NULL), 0);
        for (size_t v = 0; v < o.mesh.vertex_count; ++v)
        {
            sum += o.areas[v] * (double)o.radiosity[3 * v + 2];
            area += o.areas[v];
        }
        record("sphere", radius, &lit, sum / area, 1.0);
        if (i == count - 1) CHECK_REL(sum / area, 1.0, 0.1);
        object_free(&o);
    }
}

// ---- two fingers ----

// Ellipsoids four times as long as wide, `gap` apart along x. The left one comes first.
static int make_fingers(int levels, double radius, double gap, mesh_data *out)
{
    mesh_data right;
    if (mesh_sphere(levels, radius, out) != 0)
    {
        return 1;
    }
    if (mesh_sphere(levels, radius, &right) != 0)
    {
        mesh_free(out);
        return 1;
    }
    for (size_t v = 0; v < out->vertex_count; ++v)
    {
        out->positions[3 * v + 2] *= 4.0f;
        right.positions[3 * v + 2] *= 4.0f;
        out->positions[3 * v] -= (float)(radius + 0.5 * gap);
        right.positions[3 * v] += (float)(radius + 0.5 * gap);
        out->normals[3 * v + 2] *= 0.25f;
        right.normals[3 * v + 2] *= 0.25f;
    }
    const int failed = append(out, &right);
    mesh_free(&right);
    if (failed) mesh_free(out);
    return failed;
}

// Only the left finger is lit, on the side of the gap. The other one should stay dark.
static void fingers(void)
{   // Oracles: the converged reference; for the model darkness, for air carries no scattered light of this kind.
    static const double albedo[3] = {0.9, 0.95, 0.99};
    const int count = steps_of(9), levels = g_csv ? 4 : 3;
    const double radius = 3.0;
    for (int i = 0; i < count; ++i)
    {
        const double gap = step_at(i, count, 8.0, 0.03125);
        mesh_data mesh;
        object o;
        outcome all;
        double bright = 0.0, dark = 0.0;
        if (make_fingers(levels, radius, gap, &mesh) != 0 || object_create(&mesh, albedo, 1.3, &o) != 0)
            SKIP("out of memory");
        const size_t V = o.mesh.vertex_count;
        CHECK_EQUAL(object_light(&o, 1.0, 0.0, 0.0), 0);
        memset(o.irradiance + 3 * (V / 2), 0, 3 * (V / 2) * sizeof(float));
        CHECK_EQUAL(object_add_receivers(&o, 0, V, V / (g_csv ? 64 : 24)), 0);
        CHECK_EQUAL(shade_and_compare(&o, &all), 0);
        check_step("fingers", gap, &all, 1.0);
        for (size_t v = 0; v < V; ++v)
        {
            double *const side = v < V / 2 ? &bright : &dark;
            *side = fmax(*side, (double)o.radiosity[3 * v + 2]);
        }
        record("fingers", gap, &all, dark / bright, 0.0);
        object_free(&o);
    }
}

// ---- a fan beside a dense mesh ----

enum
{
    FAN_CELLS = 24
};

// The plane z = 0: a dense square over [-12,0] x [-6,6], and one vertex at (length, 0) that fans out to its edge.
static int make_fan(double length, mesh_data *out)
{
    const double side = 12.0, left[3] = {-0.5 * side, 0.0, 0.0};
    const size_t row = FAN_CELLS + 1;
    if (mesh_grid(FAN_CELLS, side, out) != 0)
    {
        return 1;
    }
    mesh_transform(out, 1.0, left);
    // Room for the fan: its vertex, and as many triangles as the edge has cells.
    const size_t V = out->vertex_count, T = out->triangle_count;
    float *const positions = (float *)realloc(out->positions, 3 * (V + 1) * sizeof(float));
    if (positions) out->positions = positions;
    float *const normals = (float *)realloc(out->normals, 3 * (V + 1) * sizeof(float));
    if (normals) out->normals = normals;
    uint32_t *const triangles = (uint32_t *)realloc(out->triangles, 3 * (T + FAN_CELLS) * sizeof(uint32_t));
    if (triangles) out->triangles = triangles;
    if (!positions || !normals || !triangles)
    {
        mesh_free(out);
        return 1;
    }
    positions[3 * V] = (float)length;
    positions[3 * V + 1] = positions[3 * V + 2] = 0.0f;
    for (size_t j = 0; j < FAN_CELLS; ++j)
    {
        triangles[3 * (T + j)] = (uint32_t)(j * row + FAN_CELLS);
        triangles[3 * (T + j) + 1] = (uint32_t)V;
        triangles[3 * (T + j) + 2] = (uint32_t)((j + 1) * row + FAN_CELLS);
    }
    out->vertex_count = V + 1;
    out->triangle_count = T + FAN_CELLS;
    mesh_compute_normals(out);
    return 0;
}

// Light fades from the far side of the square to the fan's vertex, which has the most of it.
static void fan(void)
{   // Oracle: the converged reference.
    static const double albedo[3] = {0.9, 0.95, 0.99};
    const int count = steps_of(9);
    for (int i = 0; i < count; ++i)
    {
        const double length = step_at(i, count, 0.05, 500.0);
        mesh_data mesh;
        object o;
        outcome all;
        if (make_fan(length, &mesh) != 0 || object_create(&mesh, albedo, 1.3, &o) != 0) SKIP("out of memory");
        const size_t V = o.mesh.vertex_count;
        for (size_t v = 0; v < 3 * V; ++v)
        {
            const double x = (double)o.mesh.positions[3 * (v / 3)];
            o.irradiance[v] = (float)(v / 3 == V - 1 ? 1.0 : 0.2 - 0.05 * x);
        }
        CHECK_EQUAL(object_add_receivers(&o, 0, V - 1, 8), 0); // rows have 25 vertices: every eighth is on the edge
        CHECK_EQUAL(object_add_receivers(&o, V - 1, V, 1), 0);
        CHECK_EQUAL(shade_and_compare(&o, &all), 0);
        check_step("fan", length, &all, 1.0);
        record("fan", length, &all, no_value, no_value);
        object_free(&o);
    }
}

// ---- a receiver whose source approaches a patch ----

// A square 16 across under E = 1; the receiver hangs below, so that its virtual source lies H under the square.
static double gather_below(const object *o, double H, double guard)
{
    static const float up[3] = {0.0f, 0.0f, 1.0f};
    const float at[3] = {0.3f, 0.2f, (float)(-o->profile.z_v[1] - H)};
    float B[3] = {0.0f, 0.0f, 0.0f};
    sss_bem_options options;
    sss_bem *bem = NULL;
    memset(&options, 0, sizeof options);
    options.tolerance = TOLERANCE;
    options.guard = guard;
    const int failed = sss_bem_create(&o->view, &o->profile, &options, NULL, &bem) != SSS_OK ||
                       sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, o->irradiance) != SSS_OK ||
                       sss_bem_gather(bem, at, up, 1, B) != SSS_OK;
    sss_bem_free(bem);
    return failed ? (double)NAN : (double)B[1];
}

// The same without a hierarchy: form factors of the whole square, which is one polygon.
static double exact_below(const object *o, double H)
{
    static const double corners[12] = {-8.0, -8.0, 0.0, 8.0, -8.0, 0.0, 8.0, 8.0, 0.0, -8.0, 8.0, 0.0};
    const double z_r = o->profile.z_r[1], z_v = o->profile.z_v[1], sigma = o->profile.sigma_tr[1];
    const double y = (double)(float)(-z_v - H); // as the receiver's position is rounded
    const double source_r[3] = {(double)0.3f, (double)0.2f, y - z_r};
    const double source_v[3] = {(double)0.3f, (double)0.2f, y + z_v};
    return o->profile.alpha_p[1] / (4.0 * PI) *
           (sss_bem_form_factor(corners, 4, source_r, z_r, sigma) +
            sss_bem_form_factor(corners, 4, source_v, z_v, sigma));
}

static void approach(void)
{   // Oracles: the form factor of the whole square without guard; with it the bound that the guard promises, and
    // nothing changed as long as the source is farther away than the guard reaches.
    static const double albedo[3] = {0.9, 0.95, 0.99};
    const int count = steps_of(25);
    for (int i = 0; i < count; ++i)
    {
        const double share = step_at(i, count, 2.0, 2e-4); // H over z_v
        mesh_data mesh;
        object o;
        outcome plain = {0.0, 0.0, 0.0, 0.0, 1}, guarded = {0.0, 0.0, 0.0, 0.0, 1};
        if (mesh_grid(8, 16.0, &mesh) != 0 || object_create(&mesh, albedo, 1.3, &o) != 0) SKIP("out of memory");
        for (size_t v = 0; v < 3 * o.mesh.vertex_count; ++v)
        {
            o.irradiance[v] = 1.0f;
        }
        const double H = share * o.profile.z_v[1], exact = exact_below(&o, H);
        const double without = gather_below(&o, H, -1.0), with = gather_below(&o, H, 0.0);
        plain.rel_l2 = plain.rel_max = fabs(without / exact - 1.0);
        guarded.rel_l2 = guarded.rel_max = fabs(with / exact - 1.0); // what the guard changes
        test_about("H/z %.3g", share);
        // One receiver, as in check_step. Its position in float moves the source by up to 2^-23 of z, and 2 pi z/H by
        // as much.
        CHECK_REL(without, exact, 3.0 * TOLERANCE + 3e-7 / share);
        CHECK_BELOW(with, o.profile.alpha_p[1] * 2.0 * 3.0 / (4.0 * g_guard));
        if (share >= g_guard) CHECK_REL(with, exact, 3.0 * TOLERANCE);
        else CHECK_BELOW(with, without * (1.0 + 3.0 * TOLERANCE));
        record("approach unguarded", share, &plain, without, exact);
        record("approach guarded", share, &guarded, with, exact);
        object_free(&o);
    }
}

// ---- squash ----

static void squash_positions(const float *rest, size_t count, double height, float *out)
{
    for (size_t v = 0; v < 3 * count; ++v)
    {
        out[v] = v % 3 == 2 ? (float)((double)rest[v] * height) : rest[v];
    }
}

// One object is kept and updated from frame to frame.
static sss_result next_frame(sss_bem *kept, object *o)
{
    sss_result result = sss_bem_set_vertices(kept, o->mesh.positions, NULL);
    if (result == SSS_OK) result = sss_bem_set_irradiance(kept, SSS_BEM_VERTICES, o->irradiance);
    if (result == SSS_OK) result = sss_bem_update(kept, 0, NULL);
    return result == SSS_OK ? sss_bem_render(kept, o->radiosity) : result;
}

static double difference_to(const object *o, const float *other)
{
    double sum = 0.0, sum_difference = 0.0;
    for (size_t i = 0; i < 3 * o->mesh.vertex_count; ++i)
    {
        const double difference = (double)o->radiosity[i] - (double)other[i];
        sum += (double)other[i] * (double)other[i];
        sum_difference += difference * difference;
    }
    return sqrt(sum_difference / sum);
}

static void squash(void)
{   // Oracles: the converged reference; and a fresh object on the same frame. A sphere of 4 mean free paths becomes a
    // sheet of a tenth of one; the kept object's hierarchy was made for the sphere.
    static const double albedo[3] = {0.9, 0.95, 0.99};
    const int count = g_csv ? 13 : 4, levels = g_csv ? 4 : 3;
    mesh_data mesh;
    object o;
    sss_bem_options options;
    sss_hooks hooks;
    sss_bem *kept = NULL;
    memset(&options, 0, sizeof options);
    memset(&hooks, 0, sizeof hooks);
    options.tolerance = TOLERANCE;
    if (mesh_sphere(levels, 4.0, &mesh) != 0 || object_create(&mesh, albedo, 1.3, &o) != 0) SKIP("out of memory");
    const size_t V = o.mesh.vertex_count;
    float *const rest = (float *)malloc(3 * V * sizeof(float)), *const last = (float *)malloc(3 * V * sizeof(float));
    CHECK(rest && last);
    memcpy(rest, o.mesh.positions, 3 * V * sizeof(float));
    CHECK_EQUAL(sss_bem_create(&o.view, &o.profile, &options, &hooks, &kept), SSS_OK);
    CHECK_EQUAL(object_add_receivers(&o, 0, V, V / (g_csv ? 48 : 16)), 0);
    for (int i = 0; i < count; ++i)
    {
        const double height = step_at(i, count, 1.0, 0.0125);
        outcome moved, fresh;
        double predicted;
        squash_positions(rest, V, height, o.mesh.positions);
        CHECK_EQUAL(sss_dipole_vertex_normals(&o.view, o.mesh.normals), SSS_OK);
        mesh_vertex_areas(&o.mesh, o.areas);
        CHECK_EQUAL(object_light(&o, 0.5, 0.0, 1.0), 0);
        CHECK_EQUAL(next_frame(kept, &o), SSS_OK);
        CHECK_EQUAL(object_find_truth(&o, g_guard, TRUTH_TOLERANCE), 0);
        moved = object_compare(&o, 0, o.count);
        memcpy(last, o.radiosity, 3 * V * sizeof(float));
        CHECK_EQUAL(object_shade(&o, TOLERANCE, 0.0, &predicted), 0);
        fresh = object_compare(&o, 0, o.count);
        moved.predicted = fresh.predicted = predicted;
        check_step("squash, fresh", height, &fresh, 1.0);
        check_step("squash, kept", height, &moved, 1.0);
        CHECK_BELOW(difference_to(&o, last), 2.0 * TOLERANCE);
        record("squash kept", height, &moved, no_value, no_value);
        record("squash fresh", height, &fresh, no_value, no_value);
    }
    sss_bem_free(kept);
    free(rest);
    free(last);
    object_free(&o);
}

// ---- what the guard changes on the cases of the chart ----

static void guard_on_the_bunny(void)
{   // Oracle: none, these are the numbers of LIMITS: the share of vertices and of light that the guard touches.
    static const double sizes[3] = {10.0, 50.0, 200.0};
    static const char *const materials[2] = {"Marble", "Skimmilk"};
    if (!g_csv) SKIP("only with --write: the whole bunny");
    mesh_data bunny;
    if (mesh_load_bunny(&bunny) != 0) SKIP("no bunny here: install glmark2-data");
    for (int c = 0; c < 6; ++c)
    {
        sss_dipole_material material;
        static const double any[3] = {0.9, 0.9, 0.9};
        mesh_data mesh;
        object o;
        char name[64];
        outcome none = {0.0, 0.0, 0.0, 0.0, 1};
        if (mesh_copy(&bunny, &mesh) != 0 || object_create(&mesh, any, 1.3, &o) != 0) SKIP("out of memory");
        o.view = mesh_view(&o.mesh, sizes[c % 3] / mesh_extent(&o.mesh));
        CHECK_EQUAL(sss_dipole_material_by_name(materials[c / 3], &material), SSS_OK);
        CHECK_EQUAL(sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &o.profile), SSS_OK);
        CHECK_EQUAL(object_light(&o, 1.0, 1.0, 1.0), 0);
        const size_t n = 3 * o.mesh.vertex_count;
        float *const guarded = (float *)malloc(n * sizeof(float));
        CHECK_EQUAL(object_shade(&o, 1e-3, 0.0, NULL), 0);
        if (!guarded) SKIP("out of memory");
        memcpy(guarded, o.radiosity, n * sizeof(float));
        CHECK_EQUAL(object_shade(&o, 1e-3, -1.0, NULL), 0);
        size_t touched = 0;
        double largest = 0.0, largest_guarded = 0.0;
        for (size_t i = 0; i < n; ++i)
        {
            const double with = (double)guarded[i], without = (double)o.radiosity[i];
            touched += without > 1.05 * with;
            largest = fmax(largest, without);
            largest_guarded = fmax(largest_guarded, with);
        }
        test_about("%s, %g mm", materials[c / 3], sizes[c % 3]);
        test_note("values changed by more than 5 %%: %.2f %%; largest B %.4g, with guard %.4g",
                  100.0 * (double)touched / (double)n, largest, largest_guarded);
        CHECK_BELOW(largest_guarded, brightest(1.0));
        snprintf(name, sizeof name, "guard on the bunny %s", materials[c / 3]);
        none.rel_max = largest_guarded;
        record(name, sizes[c % 3], &none, (double)touched / (double)n, largest);
        free(guarded);
        object_free(&o);
    }
    mesh_free(&bunny);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {TEST(slab),     TEST(sphere), TEST(fingers),           TEST(fan),
                                      TEST(approach), TEST(squash), TEST(guard_on_the_bunny)};
    if (argc > 2 && strcmp(argv[1], "--write") == 0)
    {
        char path[512];
        snprintf(path, sizeof path, "%s/stability_bem.csv", argv[2]);
        g_csv = fopen(path, "w");
        if (!g_csv)
        {
            perror(path);
            return 1;
        }
        fprintf(g_csv, "sweep,x,rel_l2,rel_max,predicted,value,ideal\n");
        argv[2] = argv[0];
        argv += 2;
        argc -= 2;
    }
    g_guard = default_guard();
    const int status = test_main(argc, argv, "stability of sss_bem.h", tests, sizeof tests / sizeof *tests);
    if (g_csv && fclose(g_csv) != 0)
    {
        return 1;
    }
    return status;
}
