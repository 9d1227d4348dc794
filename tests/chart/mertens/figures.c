// Figures 3 and 4: one triangle, one receiver.
//
// The paper does not say which of a material's three channels it draws. Its twelve samples for the triangle of figure 3
// are what Jensen and Buhler's rule gives for skim milk in green, area/(pi mfp^2) = 11.9, so green it is, here and in
// figure 4.

#include "../../../sss_bem.h"
#include "../../../sss_dipole.h"
#include "mertens.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
enum
{
    GREEN = 1,
    MC_COUNTS = 3
};
static const size_t mc_counts[MC_COUNTS] = {12, 100, 10000};

// The standard triangle: base edge 1 cm, height 0.5 cm, its tip `distance` mm away from the origin along x.
static void standard_triangle(double distance, double scale, double corners[9])
{
    const double base = 10.0 * scale, height = 5.0 * scale;
    const double values[9] = {distance,          0.0,         0.0, distance + height, -0.5 * base,
                              0.0, distance + height, 0.5 * base, 0.0};
    memcpy(corners, values, sizeof values);
}

static int profile_of(const char *name, sss_profile *profile)
{
    sss_dipole_material material;
    return sss_dipole_material_by_name(name, &material) != SSS_OK ||
           sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_POLYNOMIAL, profile) != SSS_OK;
}

// The receiver lies in the origin of the triangle's plane: its sources are z_r below and z_v above.
static void sources_of(const sss_profile *p, double z[2], double source[2][3])
{
    z[0] = p->z_r[GREEN];
    z[1] = p->z_v[GREEN];
    memset(source, 0, 6 * sizeof(double));
    source[0][2] = -z[0];
    source[1][2] = z[1];
}

// ---- figure 3 ----

static double exact(const sss_profile *p, const double corners[9])
{
    double z[2], source[2][3], sum = 0.0;
    sources_of(p, z, source);
    for (int i = 0; i < 2; ++i)
    {
        sum += sss_bem_form_factor(corners, 3, source[i], z[i], p->sigma_tr[GREEN]);
    }
    return p->alpha_p[GREEN] / (4.0 * PI) * sum; // eq. 18
}

static double taylor(const sss_profile *p, const double corners[9])
{
    double z[2], source[2][3], sum = 0.0;
    sources_of(p, z, source);
    for (int i = 0; i < 2; ++i)
    {
        sum += sss_bem_form_factor_taylor(corners, 3, source[i], z[i], p->sigma_tr[GREEN], NULL);
    }
    return p->alpha_p[GREEN] / (4.0 * PI) * sum;
}

// SplitMix64: Steele, Lea, Flood 2014.
static double uniform(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (double)((z ^ z >> 31) >> 11) / 9007199254740992.0;
}

// The mean of R_d at uniform random points, times the area.
static double monte_carlo(const sss_profile *p, const double corners[9], size_t count, uint64_t *state)
{
    const double area = 0.5 * (corners[3] - corners[0]) * (corners[7] - corners[4]);
    double z[2], source[2][3], sum = 0.0;
    sources_of(p, z, source);
    for (size_t i = 0; i < count; ++i)
    {
        const double a = sqrt(uniform(state)), b = uniform(state);
        const double weight[3] = {1.0 - a, a * (1.0 - b), a * b};
        const double x = weight[0] * corners[0] + weight[1] * corners[3] + weight[2] * corners[6];
        const double y = weight[0] * corners[1] + weight[1] * corners[4] + weight[2] * corners[7];
        for (int k = 0; k < 2; ++k)
        {
            const double s = sqrt(x * x + y * y + z[k] * z[k]), u = p->sigma_tr[GREEN] * s;
            sum += z[k] * (1.0 + u) * exp(-u) / (s * s * s);
        }
    }
    return p->alpha_p[GREEN] / (4.0 * PI) * area * sum / (double)count;
}

int mertens_figure3(const mertens_settings *s)
{
    sss_profile p;
    uint64_t state = 3;
    FILE *const file = experiment_open(s->folder, "figure3.csv",
                                       "distance_cm,exact,taylor,samples_12,samples_100,samples_10000");
    if (!file || profile_of("Skimmilk", &p) != 0)
    {
        return 1;
    }
    // Nearer than the 0.1 cm of the caption as well, but not with the tip under the receiver: there the series, which
    // takes the angle of the triangle at the projected source for 0 or 2 pi, is wrong.
    for (int i = 1; i <= 100; ++i)
    {
        const double distance = 0.1 * i; // mm
        double corners[9];
        standard_triangle(distance, 1.0, corners);
        fprintf(file, "%.3f,%.9e,%.9e", 0.1 * distance, exact(&p, corners), taylor(&p, corners));
        for (int k = 0; k < MC_COUNTS; ++k)
        {
            fprintf(file, ",%.9e", monte_carlo(&p, corners, mc_counts[k], &state));
        }
        fprintf(file, "\n");
    }
    return fclose(file) != 0;
}

// ---- figure 4 ----

// Edge segments that the paper's series evaluates for one source; both see the same.
static size_t taylor_samples(const sss_profile *p, const double corners[9], double sigma_length)
{
    double z[2], source[2][3];
    // L/r_0 < 2/5; on this triangle two segments have exactly 2/5, and rounding must not decide which side they take.
    sss_bem_taylor conditions = {0.4 - 1e-9, 0.0, 0};
    sources_of(p, z, source);
    conditions.sigma_length = sigma_length;
    (void)sss_bem_form_factor_taylor(corners, 3, source[0], z[0], p->sigma_tr[GREEN], &conditions);
    return conditions.samples;
}

int mertens_figure4(const mertens_settings *s)
{
    sss_profile p;
    FILE *const file = experiment_open(s->folder, "figure4.csv",
                                       "distance_cm,segments,segments_without_sigma,jensen_buhler");
    if (!file || profile_of("Marble", &p) != 0)
    {
        return 1;
    }
    const double mean_free_path = p.z_r[GREEN];
    for (int i = 1; i <= 200; ++i)
    {
        const double scale = 0.02 * i; // the base edge moves out to 20 mm
        double corners[9];
        standard_triangle(0.0, scale, corners);
        // Jensen and Buhler 2002: one sample for each pi mfp^2 of the surface.
        const double area = 0.5 * 10.0 * scale * 5.0 * scale;
        const double samples = fmax(1.0, ceil(area / (PI * mean_free_path * mean_free_path)));
        fprintf(file, "%.3f,%zu,%zu,%.0f\n", 0.1 * 5.0 * scale, taylor_samples(&p, corners, 0.0),
                taylor_samples(&p, corners, (double)INFINITY), samples);
    }
    return fclose(file) != 0;
}
