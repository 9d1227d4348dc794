// What breaks sss_hao.h: see ../record.h. Three ways of keeping the integrals: floats under lights of the set, which is
// what the sums are worth; reference points, the default, and harmonics alone, both with a lattice of directions
// between which lights are interpolated.
//   build/tests/stability/hao [--write FOLDER] [TEST]

#define SSS_DIPOLE_IMPLEMENTATION
#include "../../../sss_dipole.h"
#define SSS_HAO_IMPLEMENTATION
#include "../../../sss_hao.h"

#include "../../common/hooks.h"
#include "../../common/lit.h"
#include "../../common/numbers.h"
#include "../../common/profiles.h"
#include "../sweeps.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

// ---- The method ----

// For sss_hao_options.visibility: the scene's, whatever the light.
static int scene_answers(void *user, const double light[3], double distance, float *visible)
{
    const scene *const s = (const scene *)user;
    (void)light;
    (void)distance;
    memcpy(visible, s->visible, s->mesh.vertex_count * sizeof *visible);
    return 0;
}

static sss_hao_options scene_options(scene *s)
{
    sss_hao_options options;
    memset(&options, 0, sizeof options);
    options.storage = SSS_HAO_FLOAT;
    options.visibility = scene_answers;
    options.visibility_user = s;
    return options;
}

static int relight_all(sss_hao *hao, const double (*lights)[3], size_t light_count, size_t V, float *B)
{
    int failed = 0;
    for (size_t i = 0; i < light_count && !failed; ++i)
    {
        sss_hao_light light;
        memset(&light, 0, sizeof light);
        for (int k = 0; k < 3; ++k)
        {
            light.color[k] = 1.0;
            light.direction[k] = lights[i][k];
        }
        failed = sss_hao_relight(hao, &light, 1, B + 3 * V * i) != SSS_OK;
    }
    return failed;
}

// all  0: what the sums are worth; 1: with storage and interpolation, for lights between those of the set
static void claim_of(const sss_hao *hao, int all, claim *said)
{
    sss_hao_stats stats;
    memset(&stats, 0, sizeof stats);
    CHECK_EQUAL(sss_hao_get_stats(hao, &stats), SSS_OK);
    said->predicted = all ? stats.predicted_error : stats.sum_error;
    said->edge_paths = stats.edge_paths;
    said->border_mm = stats.border_mm;
    said->normals_against = stats.normals_against;
    said->inside_out = stats.inside_out;
}

// A set of one's own: the light, and three more that span space with it.
static void set_around(const double light[3], float set[12])
{
    const double x = fabs(light[0]), y = fabs(light[1]), z = fabs(light[2]);
    const double axis[3] = {x <= y && x <= z, y < x && y <= z, z < x && z < y}; // of the smallest
    double u[3], v[3], length = 0.0;
    for (size_t k = 0; k < 3; ++k)
    {
        u[k] = axis[(k + 1) % 3] * light[(k + 2) % 3] - axis[(k + 2) % 3] * light[(k + 1) % 3];
        length += u[k] * u[k];
    }
    for (size_t k = 0; k < 3; ++k) u[k] /= sqrt(length);
    for (size_t k = 0; k < 3; ++k) v[k] = light[(k + 1) % 3] * u[(k + 2) % 3] - light[(k + 2) % 3] * u[(k + 1) % 3];
    for (size_t k = 0; k < 3; ++k)
    {
        set[k] = (float)light[k];
        set[3 + k] = (float)(u[k] - 0.5 * light[k]);
        set[6 + k] = (float)(v[k] - 0.5 * light[k]);
        set[9 + k] = (float)(-u[k] - v[k] - 0.5 * light[k]);
    }
}

static int shade_own_light(scene *s, const double (*light)[3], const sss_hooks *hooks, float *B, claim *said)
{
    float set[12];
    sss_hao_options options = scene_options(s);
    sss_hao *hao = NULL;
    set_around(*light, set);
    options.directions = 4;
    options.direction_set = set;
    const int failed = sss_hao_create(&s->view, &s->profile, &options, hooks, &hao) != SSS_OK ||
                       relight_all(hao, light, 1, s->mesh.vertex_count, B) != 0;
    if (!failed) claim_of(hao, 0, said);
    sss_hao_free(hao);
    return failed;
}

static int shade(const scene *given, const double (*lights)[3], size_t light_count, float *const *B, claim *claims)
{
    const size_t V = given->mesh.vertex_count;
    const sss_hao_storage kept[2] = {SSS_HAO_REFERENCES, SSS_HAO_HARMONICS};
    scene s = *given; // for hooks that take no pointer to const
    sss_hao_options options = scene_options(&s);
    sss_hooks hooks;
    sss_hao *floats = NULL;
    memset(&hooks, 0, sizeof hooks);
    hooks.parallel_for = threads_for;
    int failed = sss_hao_create(&s.view, &s.profile, &options, &hooks, &floats) != SSS_OK;
    for (int k = 0; k < 2 && !failed; ++k)
    {
        sss_hao *hao = NULL;
        memset(&options, 0, sizeof options);
        options.storage = kept[k];
        failed = sss_hao_compress(floats, &s.view, &options, &hooks, &hao) != SSS_OK ||
                 relight_all(hao, lights, light_count, V, B[1 + k]) != 0;
        if (!failed) claim_of(hao, 1, &claims[1 + k]);
        sss_hao_free(hao);
    }
    if (light_count > 1)
    {   // They move: floats between directions as well.
        failed = failed || relight_all(floats, lights, light_count, V, B[0]) != 0;
        if (!failed) claim_of(floats, 1, &claims[0]);
    }
    else failed = failed || shade_own_light(&s, lights, &hooks, B[0], &claims[0]) != 0;
    sss_hao_free(floats);
    return failed;
}

// What stats predict is a mean over lights: under a grazing one B is small and its relative error more (sweep grazing).
static const method precomputed = {3,
                                   {{"floats", SSS_DIPOLE_DISTANCE, 0.0, 5e-3, 1.5, 0.0},
                                    {"references", SSS_DIPOLE_DISTANCE, 0.0, 0.0, 6.0, 0.0},
                                    {"harmonics", SSS_DIPOLE_DISTANCE, 0.0, 0.0, 3.5, 0.0}},
                                   shade};

#define SWEPT precomputed
#include "../run.h"

// ---- objects ----

typedef struct object
{
    mesh_data mesh;
    sss_mesh view;
    sss_profile profile;
    size_t V;
    sss_hao *floats, *references, *harmonics;
    sss_hao_stats stats; // of references
} object;

static void object_free(object *o)
{
    sss_hao_free(o->floats);
    sss_hao_free(o->references);
    sss_hao_free(o->harmonics);
    mesh_free(&o->mesh);
    memset(o, 0, sizeof *o);
}

// Takes the mesh over. Units are mm. 0 on success.
static int object_make(object *o, mesh_data *mesh, const sss_profile *profile, const sss_hao_options *more,
                       size_t references)
{
    sss_hao_options options = *more;
    sss_hooks hooks;
    memset(o, 0, sizeof *o);
    memset(&hooks, 0, sizeof hooks);
    hooks.parallel_for = threads_for;
    o->mesh = *mesh;
    memset(mesh, 0, sizeof *mesh);
    o->view = mesh_view(&o->mesh, 1.0);
    o->profile = *profile;
    o->V = o->mesh.vertex_count;
    options.storage = SSS_HAO_FLOAT;
    CHECK_EQUAL(sss_hao_create(&o->view, profile, &options, &hooks, &o->floats), SSS_OK);
    memset(&options, 0, sizeof options);
    options.reference_count = references;
    CHECK_EQUAL(sss_hao_compress(o->floats, &o->view, &options, &hooks, &o->references), SSS_OK);
    options.storage = SSS_HAO_HARMONICS;
    options.reference_count = 0;
    CHECK_EQUAL(sss_hao_compress(o->floats, &o->view, &options, &hooks, &o->harmonics), SSS_OK);
    memset(&o->stats, 0, sizeof o->stats);
    return o->floats == NULL || o->references == NULL || o->harmonics == NULL ||
           sss_hao_get_stats(o->references, &o->stats) != SSS_OK;
}

// ---- lights and errors ----

static float *lit_by(sss_hao *hao, size_t V, const double w[3])
{
    sss_hao_light light;
    float *const B = (float *)calloc(3 * V, sizeof *B);
    memset(&light, 0, sizeof light);
    for (int k = 0; k < 3; ++k)
    {
        light.color[k] = 1.0;
        light.direction[k] = w[k];
    }
    if (!B || sss_hao_relight(hao, &light, 1, B) != SSS_OK)
    {
        (void)test_check(0, "an object was not relit", __FILE__, __LINE__);
    }
    return B;
}

typedef struct pool
{
    double error, norm, largest;
    int fine;
} pool;

static void pool_add(pool *p, double got, double want)
{
    p->error += (got - want) * (got - want);
    p->norm += want * want;
    p->largest = fmax(p->largest, got);
    p->fine &= got >= 0.0 && got <= (double)FLT_MAX;
}

static double pool_l2(const pool *p)
{
    return p->norm > 0.0 ? sqrt(p->error / p->norm) : sqrt(p->error);
}

static const pool empty = {0.0, 0.0, 0.0, 1};

// One row for each store.   value, ideal  of the sweep
static void record_stores(const char *sweep, double x, const pool errors[3], double predicted, double value,
                          double ideal)
{
    test_about("%s, %.4g", sweep, x);
    CHECK(errors[0].fine && errors[1].fine && errors[2].fine);
    test_note("floats %.2e, references %.2e, harmonics %.2e, predicted %.2e", pool_l2(&errors[0]), pool_l2(&errors[1]),
              pool_l2(&errors[2]), predicted);
    for (size_t k = 0; k < 3; ++k)
    {
        row r = row_of(sweep, precomputed.series[k].name, x);
        r.rel_l2 = pool_l2(&errors[k]);
        r.predicted = predicted;
        r.value = value;
        r.ideal = ideal;
        record(&r);
    }
}

// All three stores under lights of the set against rows and rays. Lights [3 * count].
static void against_rows(const object *o, const double *w, size_t count, const lit_rows *rows, pool errors[3])
{
    sss_hao *const stores[3] = {o->floats, o->references, o->harmonics};
    lit_rays *const rays = lit_rays_create(&o->view);
    double *const E = (double *)malloc(o->V * sizeof *E);
    double *const want = (double *)malloc(3 * rows->count * sizeof *want);
    float *const visible = (float *)malloc(o->V * sizeof *visible);
    for (size_t i = 0; i < count; ++i)
    {
        lit_rays_visible(rays, &w[3 * i], HUGE_VAL, visible);
        lit_irradiance(&o->view, o->mesh.normals, o->profile.eta, &w[3 * i], HUGE_VAL, visible, E);
        lit_rows_apply(rows, E, want);
        for (int k = 0; k < 3; ++k)
        {
            float *const B = lit_by(stores[k], o->V, &w[3 * i]);
            for (size_t j = 0; j < 3 * rows->count; ++j)
            {
                pool_add(&errors[k], (double)B[3 * rows->index[j / 3] + j % 3], want[j]);
            }
            free(B);
        }
    }
    lit_rays_free(rays);
    free(E);
    free(want);
    free(visible);
}

// References and harmonics against floats at vertices [begin, end), under lights.
static void against_floats(const object *o, const double *w, size_t count, size_t begin, size_t end, pool errors[3])
{
    sss_hao *const stores[3] = {o->floats, o->references, o->harmonics};
    for (size_t i = 0; i < count; ++i)
    {
        float *const want = lit_by(o->floats, o->V, &w[3 * i]);
        for (int k = 0; k < 3; ++k)
        {
            float *const B = lit_by(stores[k], o->V, &w[3 * i]);
            for (size_t j = 3 * begin; j < 3 * end; ++j)
            {
                pool_add(&errors[k], (double)B[j], (double)want[j]);
            }
            free(B);
        }
        free(want);
    }
}

static const double some_lights[12] = {0.48, 0.6, 0.64, -0.6, 0.0, 0.8, 0.36, -0.48, 0.8, -0.1, 0.2, -0.97};

static sss_hao_options options_of(size_t directions)
{
    sss_hao_options options;
    memset(&options, 0, sizeof options);
    options.directions = directions;
    return options;
}

// ---- less and less absorption ----

static void absorption(void)
{   // Oracle: rows, under a set of one's own, whose lights these are. value: what stats say is cut off by the range.
    const int count = steps_of(9);
    for (int i = 0; i < count; ++i)
    {
        const double sigma_tr = i == count - 1 ? 0.0 : step_at(i, count, 3.0, 3e-6);
        float set[12];
        mesh_data mesh;
        object o;
        lit_rows rows;
        pool errors[3] = {empty, empty, empty};
        sss_profile profile = profile_of("Marble");
        sss_hao_options options = options_of(4);
        sss_hao_stats stats;
        double w[12];
        memset(&stats, 0, sizeof stats);
        for (size_t k = 0; k < 12; ++k)
        {
            set[k] = (float)some_lights[k];
            w[k] = (double)set[k];
        }
        for (size_t k = 0; k < 4; ++k)
        {
            const double length = sqrt(w[3 * k] * w[3 * k] + w[3 * k + 1] * w[3 * k + 1] + w[3 * k + 2] * w[3 * k + 2]);
            for (size_t axis = 0; axis < 3; ++axis) w[3 * k + axis] /= length;
        }
        profile.sigma_tr[0] = profile.sigma_tr[1] = profile.sigma_tr[2] = sigma_tr;
        options.direction_set = set;
        options.no_shadows = 1;
        if (mesh_closed_sphere(3, 10.0, &mesh) != 0 || object_make(&o, &mesh, &profile, &options, 0) != 0)
            SKIP("out of memory");
        CHECK_EQUAL(sss_hao_get_stats(o.floats, &stats), SSS_OK);
        CHECK_EQUAL(lit_rows_make(&o.view, &profile, mesh_vertices_by_area(&o.mesh, 32), 32, 2, &rows), 0);
        against_rows(&o, w, 4, &rows, errors);
        record_stores("absorption", sigma_tr > 0.0 ? sigma_tr : 1e-7, errors, stats.sum_error, stats.truncated_energy,
               (double)NAN);
        CHECK_BELOW(pool_l2(&errors[0]), 5e-3);
        CHECK_BELOW(stats.truncated_energy, 5e-3);
        CHECK(sigma_tr > 0.0 || stats.range == HUGE_VAL);
        lit_rows_free(&rows);
        object_free(&o);
    }
}

// ---- a light through the poles ----

static void poles(void)
{   // Oracle: another object, whose set are these very lights. A light that goes from one pole of the set past the
    // other, a degree or so aside of nothing: nodes, cells' borders, antipodes. No step is worse than some others.
    enum
    {
        STEPS = 37
    };
    const int count = record_full() ? STEPS : 10;
    float set[3 * STEPS];
    mesh_data mesh, again;
    object o, truth;
    const sss_profile profile = profile_of("Marble");
    sss_hao_options options = options_of(198);
    options.no_shadows = 1;
    for (int i = 0; i < count; ++i)
    {
        const double angle = 2.0 * PI * i / count, axis[3] = {sin(angle), 0.0, cos(angle)};
        for (int k = 0; k < 3; ++k)
        {
            set[3 * i + k] = (float)axis[k] + (k == 1 ? 1e-5f * (float)(i % 3 - 1) : 0.0f); // not all in one plane
        }
    }
    if (mesh_closed_sphere(4, 10.0, &mesh) != 0 || mesh_closed_sphere(4, 10.0, &again) != 0 ||
        object_make(&o, &mesh, &profile, &options, 0) != 0)
        SKIP("out of memory");
    options.direction_set = set;
    options.directions = (size_t)count;
    set[1] = 0.01f;
    CHECK_EQUAL(object_make(&truth, &again, &profile, &options, 0), 0);
    double worst = 0.0, at_poles = 0.0;
    for (int i = 0; i < count; ++i)
    {
        sss_hao *const stores[3] = {o.floats, o.references, o.harmonics};
        pool errors[3] = {empty, empty, empty};
        double x[3] = {(double)set[3 * i], (double)set[3 * i + 1], (double)set[3 * i + 2]};
        float *const want = lit_by(truth.floats, o.V, x);
        for (int k = 0; k < 3; ++k)
        {
            float *const B = lit_by(stores[k], o.V, x);
            for (size_t j = 0; j < 3 * o.V; ++j)
            {
                pool_add(&errors[k], (double)B[j], (double)want[j]);
            }
            free(B);
        }
        record_stores("poles", 360.0 * i / count, errors, o.stats.predicted_error, (double)NAN, (double)NAN);
        worst = fmax(worst, pool_l2(&errors[0]));
        if (i == 0) at_poles = pool_l2(&errors[0]);
        free(want);
    }
    test_about("poles");
    CHECK_BELOW(worst, 0.03);
    CHECK_BELOW(at_poles, 0.01);
    object_free(&o);
    object_free(&truth);
}

// ---- thinner and thinner plates ----

// A closed plate of n x n cells.
static int make_plate(int n, double side, double thickness, mesh_data *out)
{
    mesh_data top, bottom;
    const double up[3] = {0.0, 0.0, 0.5 * thickness}, down[3] = {0.0, 0.0, -0.5 * thickness};
    if (mesh_grid(n, side, &top) != 0)
    {
        return 1;
    }
    if (mesh_grid(n, side, &bottom) != 0)
    {
        mesh_free(&top);
        return 1;
    }
    mesh_transform(&top, 1.0, up);
    mesh_transform(&bottom, 1.0, down);
    const size_t V = top.vertex_count, T = top.triangle_count, line = (size_t)n + 1;
    float *const p = (float *)malloc(6 * V * sizeof *p);
    uint32_t *const t = (uint32_t *)malloc((6 * T + 24 * (size_t)n) * sizeof *t);
    size_t corner = 6 * T;
    int failed = !p || !t;
    for (size_t i = 0; !failed && i < 3 * V; ++i)
    {
        p[i] = top.positions[i];
        p[3 * V + i] = bottom.positions[i];
    }
    for (size_t i = 0; !failed && i < 3 * T; ++i)
    {
        t[i] = top.triangles[i];
        t[3 * T + i] = bottom.triangles[i % 3 == 0 ? i : i % 3 == 1 ? i + 1 : i - 1] + (uint32_t)V;
    }
    for (size_t side_index = 0; !failed && side_index < 4; ++side_index)
    {
        for (size_t i = 0; i < (size_t)n; ++i)
        {
            const size_t first[4] = {i, (line - 1) + i * line, V - 1 - i, (line - 1 - i) * line};
            const size_t second[4] = {i + 1, (line - 1) + (i + 1) * line, V - 2 - i, (line - 2 - i) * line};
            const uint32_t a = (uint32_t)first[side_index], b = (uint32_t)second[side_index];
            const uint32_t quad[6] = {a, (uint32_t)V + a, b, b, (uint32_t)V + a, (uint32_t)V + b};
            memcpy(&t[corner], quad, sizeof quad);
            corner += 6;
        }
    }
    failed = failed || mesh_make(p, 2 * V, t, corner / 3, out) != 0;
    mesh_free(&top);
    mesh_free(&bottom);
    free(p);
    free(t);
    return failed;
}

static void thin_plates(void)
{   // Oracle: floats. References are 2 mm apart, mean free paths 0.1 mm: what is dark below stays dark however thin the
    // plate. value: the brightest below by references over the brightest above; ideal: the same by floats.
    const int count = steps_of(8);
    for (int i = 0; i < count; ++i)
    {
        const double thickness = step_at(i, count, 4.0, 0.02), down[3] = {0.0, 0.0, 1.0};
        mesh_data mesh;
        object o;
        pool errors[3] = {empty, empty, empty};
        double above = 0.0, below[2] = {0.0, 0.0};
        sss_profile profile = profile_of("Marble");
        const sss_hao_options options = options_of(66);
        for (int c = 0; c < 3; ++c)
        {
            profile.sigma_tr[c] = 5.0;
            profile.z_r[c] = 0.1;
            profile.z_v[c] = 0.4;
        }
        if (make_plate(24, 12.0, thickness, &mesh) != 0 || object_make(&o, &mesh, &profile, &options, 72) != 0)
            SKIP("out of memory");
        against_floats(&o, some_lights, 4, 0, o.V, errors);
        float *const B[2] = {lit_by(o.references, o.V, down), lit_by(o.floats, o.V, down)};
        for (size_t v = 0; v < o.V; ++v)
        {
            if (o.mesh.normals[3 * v + 2] > 0.9f) above = fmax(above, (double)B[1][3 * v]);
            for (int k = 0; k < 2 && o.mesh.normals[3 * v + 2] < -0.9f; ++k)
            {
                below[k] = fmax(below[k], (double)B[k][3 * v]);
            }
        }
        record_stores("thin plates", thickness, errors, o.stats.storage_error, below[0] / above, below[1] / above);
        CHECK_ABS(below[0] / above, below[1] / above, 0.05 + 0.1 * below[1] / above);
        free(B[0]);
        free(B[1]);
        object_free(&o);
    }
}

// Takes the ball, which is empty afterwards, into the mesh.
static int add_ball(mesh_data *mesh, mesh_data *ball)
{
    const int failed = mesh_append(mesh, ball);
    mesh_free(ball);
    return failed;
}

// ---- smaller and smaller parts ----

static void small_parts(void)
{   // Oracle: floats, on the balls alone, which float over a plate whose references are 3 mm apart.
    const int count = steps_of(7);
    for (int i = 0; i < count; ++i)
    {
        const double radius = step_at(i, count, 6.0, 0.1);
        mesh_data mesh, ball;
        object o;
        pool errors[3] = {empty, empty, empty};
        const sss_profile profile = profile_of("Marble");
        const sss_hao_options options = options_of(66);
        if (make_plate(16, 30.0, 3.0, &mesh) != 0) SKIP("out of memory");
        const size_t plate = mesh.vertex_count;
        for (int k = 0; k < 4; ++k)
        {
            const double at[3] = {7.0 * (k % 2 * 2 - 1), 7.0 * (k / 2 * 2 - 1), 1.6 + radius};
            if (mesh_closed_sphere(1, radius, &ball) != 0) SKIP("out of memory");
            mesh_transform(&ball, 1.0, at);
            CHECK_EQUAL(add_ball(&mesh, &ball), 0);
        }
        if (object_make(&o, &mesh, &profile, &options, 200) != 0) SKIP("out of memory");
        against_floats(&o, some_lights, 4, plate, o.V, errors);
        record_stores("small parts", radius, errors, o.stats.storage_error, (double)NAN, (double)NAN);
        CHECK_BELOW(pool_l2(&errors[1]), 0.3);
        object_free(&o);
    }
}

// ---- sharper and sharper shadows ----

static void sharp_shadows(void)
{   // Oracle: floats. A ball over a plate; the mean free path falls, so that the shadow's edge gets sharp and harmonics
    // ring. value: the largest B of harmonics over that of floats, which ringing would raise; none is negative.
    const int count = steps_of(8);
    for (int i = 0; i < count; ++i)
    {
        const double path = step_at(i, count, 3.0, 0.01), at[3] = {0.0, 0.0, 5.0};
        mesh_data mesh, ball;
        object o;
        pool errors[3] = {empty, empty, empty};
        sss_profile profile = profile_of("Marble");
        const sss_hao_options options = options_of(102);
        for (int c = 0; c < 3; ++c)
        {
            profile.sigma_tr[c] = 0.3 / path;
            profile.z_r[c] = path;
            profile.z_v[c] = 4.0 * path;
        }
        if (make_plate(16, 16.0, 2.0, &mesh) != 0 || mesh_closed_sphere(2, 2.0, &ball) != 0) SKIP("out of memory");
        mesh_transform(&ball, 1.0, at);
        CHECK_EQUAL(add_ball(&mesh, &ball), 0);
        if (object_make(&o, &mesh, &profile, &options, 0) != 0) SKIP("out of memory");
        against_floats(&o, some_lights, 4, 0, o.V, errors);
        record_stores("sharp shadows", path, errors, o.stats.storage_error, errors[2].largest / errors[0].largest, 1.0);
        CHECK_BELOW(errors[1].largest / errors[0].largest, 1.3);
        CHECK_BELOW(errors[2].largest / errors[0].largest, 1.3);
        object_free(&o);
    }
}

// ---- rougher and rougher surfaces ----

static void rough_surfaces(void)
{   // Oracle: floats. A sphere whose vertices are pushed in and out at random: they lie ever farther outside the
    // triangles of their reference points.
    const int count = steps_of(6);
    for (int i = 0; i < count; ++i)
    {
        const double roughness = i == 0 ? 0.0 : step_at(i, count, 0.01, 0.5);
        mesh_data mesh;
        object o;
        pool errors[3] = {empty, empty, empty};
        const sss_profile profile = profile_of("Marble");
        const sss_hao_options options = options_of(66);
        if (mesh_closed_sphere(4, 15.0, &mesh) != 0) SKIP("out of memory");
        random_seed(20);
        for (size_t v = 0; v < mesh.vertex_count; ++v)
        {
            const double push = 1.0 + roughness * random_between(-1.0, 1.0);
            for (size_t k = 0; k < 3; ++k)
            {
                mesh.positions[3 * v + k] = (float)(push * (double)mesh.positions[3 * v + k]);
            }
        }
        mesh_compute_normals(&mesh);
        if (object_make(&o, &mesh, &profile, &options, 150) != 0) SKIP("out of memory");
        against_floats(&o, some_lights, 4, 0, o.V, errors);
        record_stores("rough surfaces", roughness, errors, o.stats.storage_error, (double)NAN, (double)NAN);
        CHECK_BELOW(pool_l2(&errors[1]), 0.05 + roughness);
        CHECK_BELOW(pool_l2(&errors[1]), 1.5 * pool_l2(&errors[2]) + 0.02); // harmonics of order 7 alone
        object_free(&o);
    }
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {COMMON_SWEEPS,     TEST(absorption),    TEST(poles),         TEST(thin_plates),
                                      TEST(small_parts), TEST(sharp_shadows), TEST(rough_surfaces)};
    return record_main(argc, argv, "hao", tests, sizeof tests / sizeof *tests);
}
