// Tests of the converged reference (tests/common/reference.h): an oracle that others rely on has to be right itself.
// Oracles here: closed forms on the plane (TRUTH.md, section 3), border integrals, symmetry, order of convergence,
// and brute force on a curved mesh.

#include "common/meshes.h"
#include "common/numbers.h"
#include "common/polygon.h"
#include "common/quadrature.h"
#include "common/reference.h"
#include "common/test.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

// ---- Small helpers ----

// Both sources at the same depth and alpha' = 2 pi make B the bare source term int z (1+sigma s) exp(-sigma s)/s^3 dA.
static sss_profile one_source(double z, double sigma)
{
    sss_profile p;
    memset(&p, 0, sizeof p);
    for (int c = 0; c < 3; ++c)
    {
        p.alpha_p[c] = 2.0 * PI;
        p.sigma_tr[c] = sigma;
        p.z_r[c] = z;
        p.z_v[c] = z;
    }
    p.eta = 1.3;
    return p;
}

// Marble, green: TRUTH.md 2.2; red and blue stretched so that the channels differ.
static sss_profile marble_like(void)
{
    static const double stretch[3] = {1.3, 1.0, 0.6};
    sss_profile p;
    memset(&p, 0, sizeof p);
    for (int c = 0; c < 3; ++c)
    {
        p.alpha_p[c] = 2.62 / 2.6241;
        p.sigma_tr[c] = 0.179656422095065 / stretch[c];
        p.z_r[c] = 0.381083037993979 * stretch[c];
        p.z_v[c] = 2.39052653715543 * stretch[c];
    }
    p.eta = 1.5;
    return p;
}

// White irradiance of 1 at every element.
static float *ones(size_t count)
{
    float *E = (float *)malloc(3 * count * sizeof *E);
    for (size_t i = 0; E != NULL && i < 3 * count; ++i)
        E[i] = 1.0f;
    return E;
}

// Green radiosity of a mesh under E = 1.
static double gather_ones(const mesh_data *mesh, const sss_profile *profile, sss_dipole_geometry geometry,
                          double tolerance, const float position[3], double *error)
{
    static const float up[3] = {0.0f, 0.0f, 2.0f};
    const reference_options options = {geometry, SSS_DIPOLE_VERTICES, tolerance, 0.0};
    const sss_mesh view = mesh_view(mesh, 1.0);
    double B[3] = {0.0, 0.0, 0.0}, e[3] = {0.0, 0.0, 0.0};
    float *E = ones(mesh->vertex_count);
    const int result = reference_radiosity(&view, profile, E, &options, position, up, B, e);
    free(E);
    *error = e[1];
    return result == 0 ? B[1] : (double)NAN;
}

// ---- Closed forms on the plane ----

static void rectangle_matches_published_values(void)
{   // Oracle: TRUTH.md section 3, two rectangles, 15 digits.
    static const double corners[2][4] = {{-0.5, 0.5, -0.5, 0.5}, {0.2, 1.0, 0.1, 0.7}};
    static const double want[2] = {1.83044584140217, 0.325826762174628};
    static const float origin[3] = {0.0f, 0.0f, 0.0f};
    const sss_profile profile = one_source(0.5, 1.0);
    for (int i = 0; i < 2; ++i)
        for (int g = 0; g < 2; ++g)
        {
            mesh_data mesh;
            double error;
            if (mesh_rectangle(corners[i][0], corners[i][1], corners[i][2], corners[i][3], &mesh) != 0)
                SKIP("out of memory");
            const double got = gather_ones(&mesh, &profile, (sss_dipole_geometry)g, 1e-9, origin, &error);
            test_about("rectangle %d, %s", i, g == 0 ? "distance" : "placed");
            // The corners 0.2, 0.1, 0.7 are rounded to float: 3e-8 of a side, so up to 2e-7 of the integral.
            CHECK_REL(got, want[i], i == 0 ? 1e-9 : 3e-7);
            CHECK_BELOW(error, 1e-9 * want[i]);
            mesh_free(&mesh);
        }
}

static int fan(int n, double radius, mesh_data *out)
{
    memset(out, 0, sizeof *out);
    out->positions = (float *)calloc(3 * (size_t)(n + 1), sizeof(float));
    out->normals = (float *)calloc(3 * (size_t)(n + 1), sizeof(float));
    out->triangles = (uint32_t *)calloc(3 * (size_t)n, sizeof(uint32_t));
    if (out->positions == NULL || out->normals == NULL || out->triangles == NULL)
        return 1;
    out->vertex_count = (size_t)(n + 1);
    out->triangle_count = (size_t)n;
    for (int i = 0; i < n; ++i)
    {
        out->positions[3 * (i + 1)] = (float)(radius * cos(2.0 * PI * i / n));
        out->positions[3 * (i + 1) + 1] = (float)(radius * sin(2.0 * PI * i / n));
        out->triangles[3 * i] = 0;
        out->triangles[3 * i + 1] = (uint32_t)(i + 1);
        out->triangles[3 * i + 2] = (uint32_t)((i + 1) % n + 1);
    }
    mesh_compute_normals(out);
    return 0;
}

static void disc_matches_published_values(void)
{   // Oracle: TRUTH.md section 3: 2 pi [exp(-sigma z) - (z/q) exp(-sigma q)], and its printed values.
    static const double z_sigma_R[4][3] = {{0.5, 1, 1}, {0.5, 1, 0.01}, {0.5, 0, 1}, {0.01, 100, 0.01}};
    static const double want[4] = {2.89231823091365, 0.00114292144165, 3.4732594147633, 1.23131550818329};
    static const float origin[3] = {0.0f, 0.0f, 0.0f};
    const int n = 256;
    // A fan whose radius makes its area the disc's: what is left is of order (2 pi/n)^4 = 4e-7.
    const double equal_area = sqrt(2.0 * PI / n / sin(2.0 * PI / n));
    for (int i = 0; i < 4; ++i)
    {
        const double z = z_sigma_R[i][0], sigma = z_sigma_R[i][1], R = z_sigma_R[i][2], q = sqrt(z * z + R * R);
        const sss_profile profile = one_source(z, sigma);
        mesh_data mesh;
        double error;
        if (fan(n, R * equal_area, &mesh) != 0)
            SKIP("out of memory");
        test_about("disc z %g sigma %g R %g", z, sigma, R);
        CHECK_REL(2.0 * PI * (exp(-sigma * z) - z / q * exp(-sigma * q)), want[i], 1e-11);
        CHECK_REL(gather_ones(&mesh, &profile, SSS_DIPOLE_DISTANCE, 1e-7, origin, &error), want[i], 1e-6);
        CHECK_REL(gather_ones(&mesh, &profile, SSS_DIPOLE_PLACED, 1e-7, origin, &error), want[i], 1e-6);
        mesh_free(&mesh);
    }
}

static void border_integral_matches_published_values(void)
{   // Oracle of the oracle: the same published rectangles, and the wedge that fills the plane.
    static const double a[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
    static const double b[4][2] = {{0.2, 0.1}, {1.0, 0.1}, {1.0, 0.7}, {0.2, 0.7}};
    static const double far_off[3][2] = {{50.0, 0.0}, {51.0, 0.0}, {50.0, 1.0}};
    CHECK_REL((double)polygon_source_term(a, 4, 0.5, 0.5, 1.0), 1.83044584140217, 1e-13);
    CHECK_REL((double)polygon_source_term(b, 4, 0.5, 0.5, 1.0), 0.325826762174628, 1e-13);
    // 50/sigma away: about area x kernel, 0.5 x 0.5 x 51 exp(-50)/50^3 x a factor between exp(-1) and 1.
    const double scale = 0.5 * 0.5 * 51.0 * exp(-50.0) / 125000.0;
    CHECK_BETWEEN((double)polygon_source_term(far_off, 3, 0.5, 0.5, 1.0) / scale, 0.5, 1.0);
}

static void whole_plane_gives_the_total(void)
{   // Oracle: Rd_total = alpha'/2 (exp(-s z_r) + exp(-s z_v)); the square leaves less than exp(-350) of it.
    static const float at[3] = {0.25f, -0.5f, 0.0f};
    const sss_profile profile = marble_like();
    mesh_data mesh;
    double error;
    if (mesh_rectangle(-2000.0, 2000.0, -2000.0, 2000.0, &mesh) != 0)
        SKIP("out of memory");
    const double want = 0.5 * profile.alpha_p[1] * (exp(-profile.sigma_tr[1] * profile.z_r[1]) +
                                                    exp(-profile.sigma_tr[1] * profile.z_v[1]));
    CHECK_REL(want, 0.791101405459815, 1e-13); // TRUTH.md 2.2, marble G
    CHECK_REL(gather_ones(&mesh, &profile, SSS_DIPOLE_DISTANCE, 1e-9, at, &error), want, 1e-9);
    CHECK_REL(gather_ones(&mesh, &profile, SSS_DIPOLE_PLACED, 1e-9, at, &error), want, 1e-9);
    sss_profile mutant = profile;
    mutant.z_v[1] = -profile.z_v[1]; // the mutation that must show: the virtual source subtracted
    CHECK(fabs(gather_ones(&mesh, &mutant, SSS_DIPOLE_DISTANCE, 1e-6, at, &error) - want) > 0.1 * want);
    mesh_free(&mesh);
}

// A unit right triangle pair; where the receiver stands on it and how far above.
typedef struct stand
{
    const char *name;
    float at[3];
} stand;

static void peaks_are_never_missed(void)
{   // Oracle: border integral. Mean free paths from 1e3 to 1e-6 of an edge; receivers on a vertex, on the border, on
    // the inner edge, inside, beside and above the mesh.
    static const stand stands[6] = {{"vertex", {0.0f, 0.0f, 0.0f}},          {"border", {0.375f, 0.0f, 0.0f}},
                                    {"inner edge", {0.625f, 0.625f, 0.0f}},  {"inside", {0.8125f, 0.1875f, 0.0f}},
                                    {"beside", {1.0625f, 0.5f, 0.0f}},       {"above", {0.6875f, 0.25f, 0.03125f}}};
    static const double z_values[5] = {1e3, 1.0, 1e-1, 1e-3, 1e-6};
    mesh_data mesh;
    if (mesh_rectangle(0.0, 1.0, 0.0, 1.0, &mesh) != 0)
        SKIP("out of memory");
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 5; ++j)
        {
            const float *at = stands[i].at;
            const double corners[4][2] = {{-(double)at[0], -(double)at[1]}, {1.0 - at[0], -(double)at[1]},
                                          {1.0 - at[0], 1.0 - at[1]}, {-(double)at[0], 1.0 - at[1]}};
            const double z = z_values[j], H = sqrt(z * z + (double)at[2] * at[2]);
            double error;
            // Absorption as strong as scattering lets; but not where everything underflows.
            const double sigma = fmin(0.5 / z, 300.0);
            const sss_profile profile = one_source(z, sigma);
            const double got = gather_ones(&mesh, &profile, SSS_DIPOLE_DISTANCE, 1e-7, at, &error);
            const double want = (double)polygon_source_term(corners, 4, H, z, sigma);
            test_about("%s, mean free path %g edge", stands[i].name, z);
            CHECK_REL(got, want, 1e-7);
            CHECK(fabs(got - want) <= error + 1e-13 * want);
        }
    mesh_free(&mesh);
}

static void strong_absorption_on_a_coarse_mesh(void)
{   // Oracle: Rd_total, since 1e6 mean free paths to the border are the whole plane. The second receiver is a centroid,
    // where the first sample of all hits the peak.
    static const float places[2][3] = {{0.3f, 0.2f, 0.0f}, {2.0f / 3.0f, 1.0f / 3.0f, 0.0f}};
    const sss_profile profile = one_source(1e-6, 0.5e6);
    mesh_data mesh;
    double error;
    if (mesh_rectangle(0.0, 1.0, 0.0, 1.0, &mesh) != 0)
        SKIP("out of memory");
    for (int i = 0; i < 2; ++i)
        for (int g = 0; g < 2; ++g)
            CHECK_REL(gather_ones(&mesh, &profile, (sss_dipole_geometry)g, 1e-8, places[i], &error),
                      2.0 * PI * exp(-0.5), 1e-8);
    mesh_free(&mesh);
}

static void linear_irradiance(void)
{   // Oracle: E = 2 + 3x - y over a rectangle: zeroth moment by border integral, first moments by hand in one
    // direction.
    static const float at[3] = {0.25f, 0.375f, 0.0f};
    const double x0 = -0.25, x1 = 0.75, y0 = -0.375, y1 = 0.625; // the unit square seen from the receiver
    const double corners[4][2] = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    const double z_values[3] = {0.5, 0.05, 1e-3};
    const reference_options options = {SSS_DIPOLE_DISTANCE, SSS_DIPOLE_VERTICES, 1e-8, 0.0};
    mesh_data mesh;
    float E[12];
    if (mesh_rectangle(0.0, 1.0, 0.0, 1.0, &mesh) != 0)
        SKIP("out of memory");
    for (size_t v = 0; v < 4; ++v)
        for (size_t c = 0; c < 3; ++c)
            E[3 * v + c] = 2.0f + 3.0f * mesh.positions[3 * v] - mesh.positions[3 * v + 1];
    for (int i = 0; i < 3; ++i)
    {
        const double z = z_values[i], sigma = 0.7 / z;
        const sss_profile profile = one_source(z, sigma);
        const sss_mesh view = mesh_view(&mesh, 1.0);
        double B[3], error[3];
        const double zeroth = (double)polygon_source_term(corners, 4, z, z, sigma);
        const double first_x = (double)rectangle_first_moment(x0, x1, y0, y1, z, z, sigma);
        const double first_y = (double)rectangle_first_moment(y0, y1, x0, x1, z, z, sigma);
        const double want = (2.0 + 3.0 * at[0] - at[1]) * zeroth + 3.0 * first_x - first_y;
        test_about("mean free path %g edge", z);
        CHECK_EQUAL(reference_radiosity(&view, &profile, E, &options, at, NULL, B, error), 0);
        CHECK_REL(B[1], want, 1e-8);
        CHECK(fabs(B[1] - want) <= error[1] + 1e-13 * want);
    }
    mesh_free(&mesh);
}

static void constant_irradiance_per_triangle(void)
{   // Oracle: border integral of each triangle times its own irradiance; a different one for each channel.
    static const double lower[3][2] = {{-0.25, -0.375}, {0.75, -0.375}, {0.75, 0.625}};
    static const double upper[3][2] = {{-0.25, -0.375}, {0.75, 0.625}, {-0.25, 0.625}};
    static const float at[3] = {0.25f, 0.375f, 0.0f};
    static const float E[6] = {1.0f, 2.0f, 0.0f, 5.0f, 0.5f, 3.0f};
    const reference_options options = {SSS_DIPOLE_DISTANCE, SSS_DIPOLE_TRIANGLES, 1e-8, 0.0};
    const sss_profile profile = one_source(0.1, 4.0);
    const double a = (double)polygon_source_term(lower, 3, 0.1, 0.1, 4.0);
    const double b = (double)polygon_source_term(upper, 3, 0.1, 0.1, 4.0);
    mesh_data mesh;
    double B[3], error[3];
    if (mesh_rectangle(0.0, 1.0, 0.0, 1.0, &mesh) != 0)
        SKIP("out of memory");
    const sss_mesh view = mesh_view(&mesh, 1.0);
    CHECK_EQUAL(reference_radiosity(&view, &profile, E, &options, at, NULL, B, error), 0);
    CHECK_REL(B[0], 1.0 * a + 5.0 * b, 1e-8);
    CHECK_REL(B[1], 2.0 * a + 0.5 * b, 1e-8);
    CHECK_REL(B[2], 0.0 * a + 3.0 * b, 1e-8);
    mesh_free(&mesh);
}

static void a_placed_source_close_to_the_surface(void)
{   // Oracle: border integral for each source. The receiver hangs below a square so that its virtual source comes to
    // lie H beneath it, down to a millionth: the contribution grows like 2 pi z/H and must not be missed.
    static const float up[3] = {0.0f, 0.0f, 1.0f};
    static const double corners[4][2] = {{-0.5, -0.25}, {0.5, -0.25}, {0.5, 0.75}, {-0.5, 0.75}};
    const reference_options options = {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, 1e-8, 0.0};
    const sss_profile profile = one_source(0.5, 1.0);
    mesh_data mesh;
    if (mesh_rectangle(0.0, 1.0, 0.0, 1.0, &mesh) != 0)
        SKIP("out of memory");
    float *E = ones(4);
    const sss_mesh view = mesh_view(&mesh, 1.0);
    for (int i = 0; i < 3; ++i)
    {
        const double H = pow(2.0, -6 - 7 * i);
        const float at[3] = {0.5f, 0.25f, (float)(-0.5 - H)};
        const double virtual_part = 0.5 * (double)polygon_source_term(corners, 4, H, 0.5, 1.0);
        const double real_part = 0.5 * (double)polygon_source_term(corners, 4, 1.0 + H, 0.5, 1.0);
        double B[3], error[3];
        test_about("H 2^%d", -6 - 7 * i);
        CHECK_EQUAL(reference_radiosity(&view, &profile, E, &options, at, up, B, error), 0);
        CHECK_REL(B[1], virtual_part + real_part, 1e-8);
        CHECK_BETWEEN(virtual_part / (PI * 0.5 / H), 0.9, 1.0);
    }
    free(E);
    mesh_free(&mesh);
}

static void a_guard_cuts_a_placed_source(void)
{   // Oracle: the border integral, less the disc inside the guard's ball, whose integral is
    // 2 pi z [exp(-sigma H)/H - exp(-sigma g)/g], plus pi (g^2 - H^2) times the kernel at the ball's radius g. The
    // receiver hangs below the square as above; the last H lies outside the ball, where nothing may change.
    static const float up[3] = {0.0f, 0.0f, 1.0f};
    static const double corners[4][2] = {{-0.5, -0.25}, {0.5, -0.25}, {0.5, 0.75}, {-0.5, 0.75}};
    static const double heights[4] = {1.0 / 1048576.0, 1.0 / 64.0, 7.0 / 64.0, 1.0 / 4.0};
    const double z = 0.5, sigma = 1.0, g = 0.25 * z;
    const reference_options options = {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, 1e-6, 0.25};
    const sss_profile profile = one_source(z, sigma);
    mesh_data mesh;
    if (mesh_rectangle(0.0, 1.0, 0.0, 1.0, &mesh) != 0)
        SKIP("out of memory");
    float *E = ones(4);
    const sss_mesh view = mesh_view(&mesh, 1.0);
    for (int i = 0; i < 4; ++i)
    {
        const double H = heights[i];
        const float at[3] = {0.5f, 0.25f, (float)(-0.5 - H)};
        const double disc = 2.0 * PI * z * (exp(-sigma * H) / H - exp(-sigma * g) / g);
        const double cut = PI * (g * g - H * H) * z * (1.0 + sigma * g) * exp(-sigma * g) / (g * g * g);
        const double whole = (double)polygon_source_term(corners, 4, H, z, sigma);
        const double want = whole + (H < g ? cut - disc : 0.0) +
                            (double)polygon_source_term(corners, 4, 1.0 + H, z, sigma);
        double B[3], error[3];
        test_about("H %.3g", H);
        CHECK_EQUAL(reference_radiosity(&view, &profile, E, &options, at, up, B, error), 0);
        CHECK_REL(B[1], 0.5 * want, 1e-6);
        CHECK_BELOW(fabs(B[1] - 0.5 * want), error[1]);
    }
    free(E);
    mesh_free(&mesh);
}

// ---- The rule and its error estimate ----

static double cubature(const double corners[3][3], const double E[3], const sss_profile *profile,
                       sss_dipole_geometry geometry, const double normal[3], int n)
{   // Product Gauss-Legendre on the collapsed square, written from the definition.
    static long double node[96], weight[96];
    static int ready;
    long double total = 0.0L, cross[3], e[2][3];
    if (ready != n)
        gauss_legendre(n, node, weight);
    ready = n;
    for (int k = 0; k < 3; ++k)
    {
        e[0][k] = (long double)corners[1][k] - corners[0][k];
        e[1][k] = (long double)corners[2][k] - corners[0][k];
    }
    for (int k = 0; k < 3; ++k)
        cross[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
    const long double twice_area = sqrtl(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
        {
            const long double u = 0.5L * (1.0L + node[i]), v = 0.5L * (1.0L + node[j]);
            const long double b1 = u * (1.0L - v), b2 = u * v;
            long double x[3], sum = 0.0L;
            for (int k = 0; k < 3; ++k)
                x[k] = corners[0][k] + b1 * e[0][k] + b2 * e[1][k];
            for (int source = 0; source < 2; ++source)
            {
                const long double z = source == 0 ? profile->z_r[1] : profile->z_v[1];
                long double s2 = geometry == SSS_DIPOLE_DISTANCE ? z * z : 0.0L;
                for (int k = 0; k < 3; ++k)
                {
                    const long double center =
                        geometry == SSS_DIPOLE_PLACED ? (source == 0 ? -z : z) * (long double)normal[k] : 0.0L;
                    s2 += (x[k] - center) * (x[k] - center);
                }
                const long double s = sqrtl(s2), sigma = profile->sigma_tr[1];
                sum += z * (1.0L + sigma * s) * expl(-sigma * s) / (s2 * s);
            }
            const long double irradiance = E[0] * (1.0L - b1 - b2) + E[1] * b1 + E[2] * b2;
            total += 0.25L * weight[i] * weight[j] * u * irradiance * sum;
        }
    return (double)(total * twice_area * profile->alpha_p[1] / (4.0L * (long double)PI));
}

// A random triangle of size h at a random place within reach of the sources.
static void random_triangle(double h, double reach, double corners[3][3], double E[3])
{
    double at[3];
    for (int k = 0; k < 3; ++k)
        at[k] = reach * (2.0 * random_unit() - 1.0);
    for (int c = 0; c < 3; ++c)
    {
        E[c] = random_unit() < 0.3 ? 1.0 : random_unit();
        for (int k = 0; k < 3; ++k)
            corners[c][k] = at[k] + h * (2.0 * random_unit() - 1.0);
    }
}

static void the_estimate_is_honest_on_one_triangle(void)
{   // Oracle: 96 x 96 Gauss points. Sizes from 1/300 of a mean free path to 3; both geometries; estimate >= truth
    // always, and where the triangle is resolved at all, within reason: the mean of log10(estimate/truth) is bounded,
    // for an estimate that is always huge would be no use either.
    static const double normal[3] = {0.6, 0.0, 0.8};
    sss_profile profile = marble_like();
    for (int g = 0; g < 2; ++g)
        for (int absorbing = 0; absorbing < 3; ++absorbing)
        {
            double worst = 0.0, log_sum = 0.0;
            int tried = 0, resolved = 0;
            random_seed(1);
            profile.sigma_tr[1] = absorbing == 0 ? 0.0 : (absorbing == 1 ? 0.18 : 4.0);
            for (int i = 0; i < 400; ++i)
            {
                double corners[3][3], E[3], integral, error;
                const double h = 0.38 * pow(10.0, -2.5 + 3.0 * random_unit());
                random_triangle(h, 3.0, corners, E);
                reference_one_rule((const double(*)[3])corners, E, &profile, 1, (sss_dipole_geometry)g, normal,
                                   &integral, &error);
                const double truth = cubature((const double(*)[3])corners, E, &profile, (sss_dipole_geometry)g, normal,
                                              48);
                const double finer = cubature((const double(*)[3])corners, E, &profile, (sss_dipole_geometry)g, normal,
                                              96);
                if (fabs(finer - truth) > 1e-2 * error)
                    continue; // the oracle itself is not sure: a placed source almost on the triangle
                ++tried;
                const double wrong = fabs(integral - finer), noise = 1e-14 * finer;
                if (error > 0.0)
                    worst = fmax(worst, (wrong - noise) / error);
                if (error > 0.0 && wrong > noise && error < 0.1 * finer)
                {
                    log_sum += log10(error / wrong);
                    ++resolved;
                }
            }
            test_about("%s, sigma_tr %g", g == 0 ? "distance" : "placed", profile.sigma_tr[1]);
            CHECK(tried > 350);
            CHECK_BELOW(worst, 1.0);
            // Mean decimal digits by which the estimate is careful: a halving gains 1.8, so this costs two at most.
            CHECK_BETWEEN(log_sum / resolved, 0.0, 4.0);
        }
}

static void the_rule_has_its_order(void)
{   // Oracle: order of convergence. Degree 5: the relative error of one rule falls by 2^6 when the triangle is halved
    // around a fixed centroid (constant irradiance), at least by 2^5.5.
    static const double normal[3] = {0.0, 0.0, 1.0}, E[3] = {1.0, 1.0, 1.0};
    const sss_profile profile = marble_like();
    double last = 0.0;
    for (int level = 0; level < 4; ++level)
    {
        const double h = 0.4 * pow(0.5, level);
        const double corners[3][3] = {{1.0 - h, 0.3 - 0.6 * h, 0.1 * h}, {1.0 + h, 0.3 - 0.2 * h, 0.0},
                                      {1.0, 0.3 + 0.8 * h, -0.1 * h}};
        double integral, error;
        reference_one_rule(corners, E, &profile, 1, SSS_DIPOLE_DISTANCE, normal, &integral, &error);
        const double truth = cubature(corners, E, &profile, SSS_DIPOLE_DISTANCE, normal, 48);
        const double relative = fabs(integral / truth - 1.0);
        if (level > 0)
            CHECK_BETWEEN(log2(last / relative), 5.5, 7.5);
        last = relative;
    }
}

// ---- Curved meshes ----

// A sphere lit from one side, brightness different for each channel.
static float *sunny(const mesh_data *mesh)
{
    float *E = (float *)malloc(3 * mesh->vertex_count * sizeof *E);
    for (size_t v = 0; E != NULL && v < mesh->vertex_count; ++v)
        for (size_t c = 0; c < 3; ++c)
            E[3 * v + c] = fmaxf(0.0f, mesh->normals[3 * v + 2]) * (float)(c + 1);
    return E;
}

// Midpoint rule with n^2 equal triangles on each triangle of the mesh.
static double midpoint_rule(const mesh_data *mesh, const float *E, const sss_profile *profile, int channel,
                            sss_dipole_geometry geometry, const float at[3], const float normal[3], int n)
{
    double total = 0.0;
    for (size_t t = 0; t < mesh->triangle_count; ++t)
    {
        const uint32_t *v = &mesh->triangles[3 * t];
        const double area = mesh_triangle_area(mesh, t) / ((double)n * n);
        for (int i = 0; i < n; ++i)
            for (int j = 0; i + j < n; ++j)
                for (int upper = 0; upper <= (i + j + 1 < n ? 1 : 0); ++upper)
                {
                    const double b1 = (i + (upper ? 2.0 : 1.0) / 3.0) / n, b2 = (j + (upper ? 2.0 : 1.0) / 3.0) / n;
                    const double b[3] = {1.0 - b1 - b2, b1, b2};
                    double x[3] = {0.0, 0.0, 0.0}, irradiance = 0.0;
                    for (int k = 0; k < 3; ++k)
                    {
                        irradiance += b[k] * E[3 * v[k] + (uint32_t)channel];
                        for (int axis = 0; axis < 3; ++axis)
                            x[axis] += b[k] * mesh->positions[3 * v[k] + (uint32_t)axis];
                    }
                    for (int source = 0; source < 2; ++source)
                    {
                        const double z = source == 0 ? profile->z_r[channel] : profile->z_v[channel];
                        double s2 = geometry == SSS_DIPOLE_DISTANCE ? z * z : 0.0;
                        for (int axis = 0; axis < 3; ++axis)
                        {
                            const double lift = geometry == SSS_DIPOLE_PLACED ? (source == 0 ? -z : z) : 0.0;
                            const double d = x[axis] - at[axis] - lift * normal[axis];
                            s2 += d * d;
                        }
                        const double s = sqrt(s2), sigma = profile->sigma_tr[channel];
                        total += area * irradiance * z * (1.0 + sigma * s) * exp(-sigma * s) / (s2 * s);
                    }
                }
    }
    return total * profile->alpha_p[channel] / (4.0 * PI);
}

static void a_curved_mesh_agrees_with_brute_force(void)
{   // Oracle: midpoint rule on n^2 equal parts of every triangle, n = 24 and 48, extrapolated (its error is of order
    // h^2); the difference of extrapolation and n = 48 bounds what the oracle can be trusted to.
    const sss_profile profile = marble_like();
    mesh_data mesh;
    if (mesh_sphere(2, 4.0, &mesh) != 0) // edges of 1.5 mm, mean free paths of 0.23 to 0.5 mm
        SKIP("out of memory");
    float *E = sunny(&mesh);
    for (int g = 0; g < 2; ++g)
        for (size_t receiver = 0; receiver < 3; ++receiver)
        {
            const reference_options options = {(sss_dipole_geometry)g, SSS_DIPOLE_VERTICES, 1e-7, 0.0};
            const sss_mesh view = mesh_view(&mesh, 1.0);
            const float *at = &mesh.positions[3 * (7 + 31 * receiver)];
            const float *normal = &mesh.normals[3 * (7 + 31 * receiver)];
            double B[3], error[3];
            CHECK_EQUAL(reference_radiosity(&view, &profile, E, &options, at, normal, B, error), 0);
            for (int c = 0; c < 3; ++c)
            {
                const double coarse =
                    midpoint_rule(&mesh, E, &profile, c, (sss_dipole_geometry)g, at, normal, 24);
                const double fine = midpoint_rule(&mesh, E, &profile, c, (sss_dipole_geometry)g, at, normal, 48);
                const double want = fine + (fine - coarse) / 3.0;
                test_about("%s, receiver %zu, channel %d", g == 0 ? "distance" : "placed", receiver, c);
                CHECK_BELOW(fabs(fine - want), 2e-3 * want); // else the oracle is not in its range of convergence
                CHECK_REL(B[c], want, 3e-5);
            }
        }
    free(E);
    mesh_free(&mesh);
}

static void the_estimate_is_honest_on_a_mesh(void)
{   // Oracle: the same reference at 1e-9. At loose tolerances the error must lie within the estimate, and the estimate
    // within the tolerance.
    static const double tolerances[3] = {1e-2, 1e-4, 1e-6};
    const sss_profile profile = marble_like();
    mesh_data mesh;
    if (mesh_sphere(3, 10.0, &mesh) != 0)
        SKIP("out of memory");
    float *E = sunny(&mesh);
    const sss_mesh view = mesh_view(&mesh, 1.0);
    for (int g = 0; g < 2; ++g)
        for (int i = 0; i < 3; ++i)
        {
            double worst = 0.0, worst_tolerance = 0.0;
            for (size_t v = 0; v < mesh.vertex_count; v += 97)
            {
                const reference_options tight = {(sss_dipole_geometry)g, SSS_DIPOLE_VERTICES, 1e-9, 0.0};
                const reference_options loose = {(sss_dipole_geometry)g, SSS_DIPOLE_VERTICES, tolerances[i], 0.0};
                double want[3], want_error[3], B[3], error[3];
                const float *at = &mesh.positions[3 * v], *n = &mesh.normals[3 * v];
                (void)reference_radiosity(&view, &profile, E, &tight, at, n, want, want_error);
                (void)reference_radiosity(&view, &profile, E, &loose, at, n, B, error);
                for (int c = 0; c < 3; ++c)
                {
                    worst = fmax(worst, fabs(B[c] - want[c]) / (error[c] + want_error[c]));
                    worst_tolerance = fmax(worst_tolerance, error[c] / B[c] / tolerances[i]);
                }
            }
            test_about("%s, tolerance %g", g == 0 ? "distance" : "placed", tolerances[i]);
            CHECK_BELOW(worst, 1.0);
            CHECK_BELOW(worst_tolerance, 1.0 + 1e-6);
        }
    free(E);
    mesh_free(&mesh);
}

// ---- Conduct ----

static void threads_and_units_change_nothing(void)
{   // Oracle: the serial result, bit for bit; and the scaling law R_d(r; k sigma) = k^2 R_d(k r; sigma), B unchanged.
    const sss_profile profile = marble_like();
    const reference_options options = {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, 1e-6, 0.0};
    mesh_data mesh;
    size_t indices[20];
    double serial[60], parallel[60], scaled[60], error[60];
    if (mesh_sphere(3, 4.0, &mesh) != 0)
        SKIP("out of memory");
    float *E = sunny(&mesh);
    sss_mesh view = mesh_view(&mesh, 1.0);
    for (size_t i = 0; i < 20; ++i)
        indices[i] = (i * 17) % mesh.vertex_count;
    CHECK_EQUAL(reference_radiosity_many(&view, &profile, E, &options, mesh.positions, mesh.normals, indices, 20, 1,
                                         serial, error), 0);
    CHECK_EQUAL(reference_radiosity_many(&view, &profile, E, &options, mesh.positions, mesh.normals, indices, 20, 4,
                                         parallel, error), 0);
    CHECK(memcmp(serial, parallel, sizeof serial) == 0);
    sss_profile tiny = profile;
    for (int c = 0; c < 3; ++c)
    {
        tiny.sigma_tr[c] *= 1e6;
        tiny.z_r[c] *= 1e-6;
        tiny.z_v[c] *= 1e-6;
    }
    view.mm_per_unit = 1e-6;
    CHECK_EQUAL(reference_radiosity_many(&view, &tiny, E, &options, mesh.positions, mesh.normals, indices, 20, 2,
                                         scaled, error), 0);
    double worst = 0.0;
    for (int i = 0; i < 60; ++i)
        worst = fmax(worst, fabs(scaled[i] / serial[i] - 1.0));
    CHECK_BELOW(worst, 2e-6);
    free(E);
    mesh_free(&mesh);
}

static void what_cannot_converge_says_so(void)
{   // Oracle: with a placed source on the surface the integral diverges; nothing to converge to.
    static const float up[3] = {0.0f, 0.0f, 1.0f};
    const float below[3] = {0.5f, 0.25f, -0.5f}; // the virtual source, 0.5 above it, lies in the square
    const sss_profile profile = one_source(0.5, 1.0);
    const reference_options options = {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, 1e-6, 0.0};
    mesh_data mesh;
    double B[3] = {7.0, 7.0, 7.0}, error[3] = {7.0, 7.0, 7.0};
    if (mesh_rectangle(0.0, 1.0, 0.0, 1.0, &mesh) != 0)
        SKIP("out of memory");
    float *E = ones(4);
    const sss_mesh view = mesh_view(&mesh, 1.0);
    CHECK_EQUAL(reference_radiosity(&view, &profile, E, &options, below, NULL, B, error), 1);
    CHECK(B[0] == 7.0 && error[2] == 7.0);
    sss_profile dark = profile;
    dark.alpha_p[0] = dark.alpha_p[1] = dark.alpha_p[2] = 0.0;
    CHECK_EQUAL(reference_radiosity(&view, &dark, E, &options, below, up, B, error), 0);
    CHECK(B[0] == 0.0 && error[0] == 0.0);
    dark.alpha_p[1] = 1.0;
    CHECK_EQUAL(reference_radiosity(&view, &dark, E, &options, below, up, B, error), 2);
    CHECK(error[1] > 1e-6 * B[1]);
    free(E);
    mesh_free(&mesh);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {
        TEST(border_integral_matches_published_values),
        TEST(rectangle_matches_published_values),
        TEST(disc_matches_published_values),
        TEST(whole_plane_gives_the_total),
        TEST(peaks_are_never_missed),
        TEST(strong_absorption_on_a_coarse_mesh),
        TEST(linear_irradiance),
        TEST(constant_irradiance_per_triangle),
        TEST(a_placed_source_close_to_the_surface),
        TEST(a_guard_cuts_a_placed_source),
        TEST(the_estimate_is_honest_on_one_triangle),
        TEST(the_rule_has_its_order),
        TEST(a_curved_mesh_agrees_with_brute_force),
        TEST(the_estimate_is_honest_on_a_mesh),
        TEST(threads_and_units_change_nothing),
        TEST(what_cannot_converge_says_so),
    };
    return test_main(argc, argv, "reference", tests, sizeof tests / sizeof *tests);
}
