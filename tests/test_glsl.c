// The GLSL snippets executed on OSMesa and compared with the C functions, in every version they are written for.
//
// What may differ: a shader computes in float, so an input or an intermediate result is off by a few parts in 2^24.
// The bounds follow from that: the change of the exact result when the inputs move by that much, plus a few roundings
// of the result. Where the formula is ill-conditioned (Fresnel at the critical angle) the bound is wide by itself.

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../sss_bem.h"
#define SSS_ATLAS_IMPLEMENTATION
#include "../sss_atlas.h"
#define SSS_HAO_IMPLEMENTATION
#include "../sss_hao.h"

#include "../examples/common/gl_context.h"
#include "common/flat.h"
#include "common/meshes.h"
#include "common/numbers.h"
#include "common/test.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum
{
    WIDTH = 64,
    HEIGHT = 64,
    COUNT = WIDTH * HEIGHT, // samples of one run: one a pixel
    INPUTS = 3,             // vec4 inputs of a sample
    CUBE_SIDE = 64          // texels along a face of the environment
};

static const char *const versions[] = {"330 core", "450 core", "300 es"};
enum
{
    VERSION_COUNT = sizeof versions / sizeof versions[0]
};

typedef struct samples
{
    float in[INPUTS][COUNT][4];
    float out[COUNT][4];
} samples;

static gl_context *g_context; // one for all tests: Mesa takes long to start
static samples g_samples;
static sss_dipole_glsl_uniforms g_uniforms;
static float g_exposure = 1.0f;
static GLuint g_environment; // a cube map whose texels hold their own directions, see make_environment

// ---- running an expression over all samples ----

static GLuint make_texture(const gl_functions *gl, const float (*texels)[4])
{
    GLuint texture = 0;
    gl->GenTextures(1, &texture);
    gl->BindTexture(GL_TEXTURE_2D, texture);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, WIDTH, HEIGHT, 0, GL_RGBA, GL_FLOAT, texels);
    return texture;
}

// The direction of a point (s, t) in [-1, 1]^2 on a face, the largest component being 1: the table of section 8.13 of
// the OpenGL 4.5 specification, solved for the direction.
static void face_direction(size_t face, double s, double t, double out[3])
{
    const double sign = face % 2 ? -1.0 : 1.0;
    const double directions[3][3] = {{sign, -t, -sign * s}, {s, sign, sign * t}, {sign * s, -t, sign}};
    memcpy(out, directions[face / 2], 3 * sizeof *out);
}

// Linear on every face, so that filtering between texels is exact but at the edges of the cube.
static void make_environment(const gl_functions *gl)
{
    static float texels[CUBE_SIDE][CUBE_SIDE][3];
    gl->GenTextures(1, &g_environment);
    gl->ActiveTexture(GL_TEXTURE0 + INPUTS + 1);
    gl->BindTexture(GL_TEXTURE_CUBE_MAP, g_environment);
    gl->TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl->TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    for (size_t face = 0; face < 6; ++face)
    {
        for (size_t i = 0; i < CUBE_SIDE * CUBE_SIDE; ++i)
        {
            double d[3];
            face_direction(face, 2.0 * ((double)(i % CUBE_SIDE) + 0.5) / CUBE_SIDE - 1.0,
                           2.0 * ((double)(i / CUBE_SIDE) + 0.5) / CUBE_SIDE - 1.0, d);
            for (int k = 0; k < 3; ++k)
            {
                texels[i / CUBE_SIDE][i % CUBE_SIDE][k] = (float)d[k];
            }
        }
        gl->TexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)face, 0, GL_RGB32F, CUBE_SIDE, CUBE_SIDE, 0, GL_RGB,
                       GL_FLOAT, texels);
    }
}

static void set_uniforms(const gl_functions *gl, GLuint program)
{
    static const char *const names[INPUTS] = {"input_a", "input_b", "input_c"};
    for (GLint i = 0; i < INPUTS; ++i)
    {
        gl->Uniform1i(gl->GetUniformLocation(program, names[i]), i);
    }
    gl->Uniform1i(gl->GetUniformLocation(program, "sss_environment"), INPUTS + 1);
    gl->Uniform3fv(gl->GetUniformLocation(program, "sss_alpha_p"), 1, g_uniforms.alpha_p);
    gl->Uniform3fv(gl->GetUniformLocation(program, "sss_sigma_tr"), 1, g_uniforms.sigma_tr);
    gl->Uniform3fv(gl->GetUniformLocation(program, "sss_z_r"), 1, g_uniforms.z_r);
    gl->Uniform3fv(gl->GetUniformLocation(program, "sss_z_v"), 1, g_uniforms.z_v);
    gl->Uniform1f(gl->GetUniformLocation(program, "sss_eta"), g_uniforms.eta);
    gl->Uniform1f(gl->GetUniformLocation(program, "sss_exit_scale"), g_uniforms.exit_scale);
    gl->Uniform1f(gl->GetUniformLocation(program, "sss_exposure"), g_exposure);
}

static GLuint build(const char *version, const char *expression)
{
    static const char *const vertex[] = {
        "void main()\n"
        "{\n"
        "    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);\n"
        "}\n"};
    const int es = strstr(version, "es") != NULL;
    const char *const fragment[] = {es ? "precision highp sampler2D;\n" : "\n",
                                    sss_dipole_glsl(SSS_DIPOLE_GLSL_FRESNEL),
                                    sss_dipole_glsl(SSS_DIPOLE_GLSL_PROFILE),
                                    sss_dipole_glsl(SSS_DIPOLE_GLSL_TONE_MAPPING),
                                    sss_bem_glsl(SSS_BEM_GLSL_SHADE),
                                    "uniform sampler2D input_a; uniform sampler2D input_b; uniform sampler2D input_c;\n"
                                    "out vec4 result;\n"
                                    "void main()\n"
                                    "{\n"
                                    "    ivec2 p = ivec2(gl_FragCoord.xy);\n"
                                    "    vec4 a = texelFetch(input_a, p, 0);\n"
                                    "    vec4 b = texelFetch(input_b, p, 0);\n"
                                    "    vec4 c = texelFetch(input_c, p, 0);\n"
                                    "    result = vec4(", expression, ", a.x + b.x + c.x);\n}\n"};
    char version_line[32], error[4096] = "";
    snprintf(version_line, sizeof version_line, "#version %s", version);
    const GLuint program = gl_context_program(g_context, version_line, vertex, 1, fragment,
                                              sizeof fragment / sizeof fragment[0], error, sizeof error);
    if (!program)
    {
        test_note("%s: %s", version, error);
    }
    return program;
}

// Evaluates a vec3 expression of a, b, c over g_samples.in into g_samples.out; false when OpenGL refuses.
static int evaluate(const char *version, const char *expression)
{
    const gl_functions *const gl = gl_context_functions(g_context);
    const GLuint program = build(version, expression);
    if (!CHECK(program != 0))
    {
        return 0;
    }
    GLuint inputs[INPUTS], target, framebuffer, vertex_array;
    for (GLuint i = 0; i < INPUTS; ++i)
    {
        gl->ActiveTexture(GL_TEXTURE0 + i);
        inputs[i] = make_texture(gl, (const float(*)[4])g_samples.in[i]);
    }
    gl->ActiveTexture(GL_TEXTURE0 + INPUTS);
    target = make_texture(gl, NULL);
    gl->GenFramebuffers(1, &framebuffer);
    gl->BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target, 0);
    const int complete = gl->CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;

    gl->GenVertexArrays(1, &vertex_array);
    gl->BindVertexArray(vertex_array);
    gl->Viewport(0, 0, WIDTH, HEIGHT);
    gl->UseProgram(program);
    set_uniforms(gl, program);
    memset(g_samples.out, 0xff, sizeof g_samples.out); // NaN, should nothing be drawn
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
    gl->ReadPixels(0, 0, WIDTH, HEIGHT, GL_RGBA, GL_FLOAT, g_samples.out);

    gl->DeleteTextures(INPUTS, inputs);
    gl->DeleteTextures(1, &target);
    gl->DeleteFramebuffers(1, &framebuffer);
    gl->DeleteVertexArrays(1, &vertex_array);
    gl->DeleteProgram(program);
    return CHECK(complete && gl->GetError() == GL_NO_ERROR);
}

// ---- comparing ----

// Largest ratio of error to bound over the samples, and the largest error itself. A value that is not finite counts
// as infinitely wrong.
typedef struct worst
{
    double ratio, error;
    size_t sample;
} worst;

static void compare(worst *w, size_t sample, double got, double want, double bound)
{
    const double error = isfinite(got) ? fabs(got - want) : HUGE_VAL;
    if (error / bound > w->ratio || w->ratio < 0.0)
    {
        w->ratio = error / bound;
        w->sample = sample;
    }
    w->error = fmax(w->error, error);
}

static double between(double low, double high, double t)
{
    return low + (high - low) * t;
}

static double log_between(double low, double high, double t)
{
    return exp(between(log(low), log(high), t));
}

static double column(size_t sample)
{
    return (double)(sample % WIDTH) / (WIDTH - 1);
}

static double row(size_t sample)
{
    return (double)(sample / WIDTH) / (HEIGHT - 1);
}

static const double roundings = 8.0 * FLT_EPSILON; // inputs may move by that much, relatively

typedef double (*function_of_two)(double x, double y);

// Bound of f at (x, y): how far the exact result moves when both inputs are off by some roundings, plus as many
// roundings of the result.
static double conditioned_bound(function_of_two f, double x, double y, double x_high)
{
    const double middle = f(x, y);
    double bound = roundings * fmax(fabs(middle), 0.01);
    for (int i = 0; i < 9; ++i)
    {
        const double x_moved = fmin(x * (1.0 + roundings * (i % 3 - 1)), x_high);
        const double y_moved = y * (1.0 + roundings * (i / 3 - 1));
        bound = fmax(bound, roundings * fmax(fabs(middle), 0.01) + fabs(f(x_moved, y_moved) - middle));
    }
    return bound;
}

// ---- Fresnel ----

static double fresnel(double cos_i, double eta)
{
    return sss_dipole_fresnel(cos_i, eta);
}

static double schlick(double cos_i, double eta)
{
    return sss_dipole_fresnel_schlick(cos_i, eta);
}

static void fill_cosines_and_indices(void)
{
    for (size_t i = 0; i < COUNT; ++i)
    {
        g_samples.in[0][i][0] = (float)column(i);                        // cos_i, 0 and 1 included
        g_samples.in[0][i][1] = (float)log_between(1.0 / 3.0, 3.0, row(i)); // eta
    }
}

static void compare_fresnel(const char *expression, function_of_two f)
{
    fill_cosines_and_indices();
    for (size_t v = 0; v < VERSION_COUNT; ++v)
    {
        worst w = {-1.0, 0.0, 0};
        test_about("%s", versions[v]);
        if (!evaluate(versions[v], expression))
        {
            continue;
        }
        for (size_t i = 0; i < COUNT; ++i)
        {
            const double cos_i = (double)g_samples.in[0][i][0], eta = (double)g_samples.in[0][i][1];
            compare(&w, i, (double)g_samples.out[i][0], f(cos_i, eta), conditioned_bound(f, cos_i, eta, 1.0));
        }
        test_note("largest error %.1e; worst against its bound at cos_i %g, eta %g", w.error,
                  (double)g_samples.in[0][w.sample][0], (double)g_samples.in[0][w.sample][1]);
        CHECK_BELOW(w.ratio, 1.0);
    }
}

static void fresnel_is_that_of_c(void)
{
    compare_fresnel("vec3(sss_fresnel(a.x, a.y))", fresnel);
}

static void schlick_is_that_of_c(void)
{
    compare_fresnel("vec3(sss_fresnel_schlick(a.x, a.y))", schlick);
}

static double fresnel_of_inverted_eta(double cos_i, double eta)
{
    return sss_dipole_fresnel(cos_i, 1.0 / eta);
}

static void an_inverted_eta_is_caught(void)
{
    worst w = {-1.0, 0.0, 0};
    fill_cosines_and_indices();
    if (evaluate(versions[0], "vec3(sss_fresnel(a.x, a.y))"))
    {
        for (size_t i = 0; i < COUNT; ++i)
        {
            const double cos_i = (double)g_samples.in[0][i][0], eta = (double)g_samples.in[0][i][1];
            compare(&w, i, (double)g_samples.out[i][0], fresnel_of_inverted_eta(cos_i, eta),
                    conditioned_bound(fresnel_of_inverted_eta, cos_i, eta, 1.0));
        }
        CHECK(w.ratio > 1e3);
    }
}

// ---- profile ----

static int use_material(const char *name, sss_dipole_exit exit_convention, sss_profile *profile)
{
    sss_dipole_material material;
    return CHECK_EQUAL(sss_dipole_material_by_name(name, &material), SSS_OK) &&
           CHECK_EQUAL(sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, profile), SSS_OK) &&
           CHECK_EQUAL(sss_dipole_get_glsl_uniforms(profile, exit_convention, &g_uniforms), SSS_OK);
}

// R_d falls as exp(-sigma_tr d): roundings of sigma_tr d, times itself, are relative errors of R_d. What underflows in
// float may be flushed to zero.
static double Rd_bound(const sss_profile *profile, int k, double d, double want)
{
    return 2.0 * roundings * (1.0 + profile->sigma_tr[k] * d) * want + 4.0 * (double)FLT_MIN;
}

static const char *const materials[] = {"Marble", "Skimmilk", "Ketchup", "Skin1"};
enum
{
    MATERIAL_COUNT = sizeof materials / sizeof materials[0]
};

static void compare_Rd(const sss_profile *profile, const char *version, double flip)
{
    worst w = {-1.0, 0.0, 0};
    for (size_t i = 0; i < COUNT; ++i)
    {
        const double r = (double)g_samples.in[0][i][0];
        for (int k = 0; k < 3; ++k)
        {
            const double want = sss_dipole_Rd(profile, k, r);
            compare(&w, i, (double)g_samples.out[i][k], flip * want,
                    Rd_bound(profile, k, r + profile->z_v[k], want));
        }
    }
    if (flip > 0.0)
    {
        test_note("%s: worst at r = %g mm", version, (double)g_samples.in[0][w.sample][0]);
        CHECK_BELOW(w.ratio, 1.0);
    }
    else
    {
        CHECK(w.ratio > 1e3); // the mutation
    }
}

static void Rd_is_that_of_c(void)
{
    for (size_t i = 0; i < COUNT; ++i)
    {   // from a thousandth of a millimetre to a metre, and 0
        g_samples.in[0][i][0] = i == 0 ? 0.0f : (float)log_between(1e-3, 1e3, (double)i / COUNT);
    }
    for (size_t m = 0; m < MATERIAL_COUNT; ++m)
    {
        sss_profile profile;
        if (!use_material(materials[m], SSS_DIPOLE_EXIT_PAPER, &profile))
        {
            continue;
        }
        for (size_t v = 0; v < VERSION_COUNT; ++v)
        {
            test_about("%s, %s", materials[m], versions[v]);
            if (evaluate(versions[v], "sss_Rd(a.x)"))
            {
                compare_Rd(&profile, versions[v], 1.0);
            }
        }
        compare_Rd(&profile, "", -1.0);
    }
}

// Emitters in a box around the receiver, normals in all directions. On this scale positions are exact to a few parts
// in 2^24 of the distance, so that no cancellation is added.
static void fill_placements(void)
{
    for (size_t i = 0; i < COUNT; ++i)
    {
        const double phi = 6.2831853 * column(i), z = between(-1.0, 1.0, row(i)), s = sqrt(1.0 - z * z);
        const double r = log_between(0.05, 50.0, (double)((i * 2654435761u) % COUNT) / COUNT);
        const float n[3] = {(float)(s * cos(phi)), (float)(s * sin(phi)), (float)z};
        const float x_i[3] = {(float)(r * 0.36), (float)(r * -0.48), (float)(r * 0.8)};
        memcpy(g_samples.in[0][i], x_i, sizeof x_i);
        g_samples.in[1][i][0] = g_samples.in[1][i][1] = g_samples.in[1][i][2] = 0.0f;
        memcpy(g_samples.in[2][i], n, sizeof n);
    }
}

static void to_double(const float *in, double out[3])
{
    for (int k = 0; k < 3; ++k)
    {
        out[k] = (double)in[k];
    }
}

// With placed sources the distances d = |x_i - x_o + z n| may cancel; then a rounding of z or x weighs (z + r)/d.
static double placed_bound(const sss_profile *profile, int k, const double x_i[3], const double n[3], double want)
{
    double d_r = 0.0, d_v = 0.0, r = 0.0;
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int j = 0; j < 3; ++j)
    {
        const double a = x_i[j] + profile->z_r[k] * n[j] / length, b = x_i[j] - profile->z_v[k] * n[j] / length;
        d_r += a * a;
        d_v += b * b;
        r += x_i[j] * x_i[j];
    }
    const double d = sqrt(fmin(d_r, d_v));
    const double cancellation = (sqrt(r) + profile->z_v[k]) / d;
    return 3.0 * cancellation * Rd_bound(profile, k, sqrt(fmax(d_r, d_v)), want);
}

static void Rd_placed_is_that_of_c(void)
{
    fill_placements();
    for (size_t m = 0; m < MATERIAL_COUNT; ++m)
    {
        sss_profile profile;
        if (!use_material(materials[m], SSS_DIPOLE_EXIT_PAPER, &profile))
        {
            continue;
        }
        for (size_t v = 0; v < VERSION_COUNT; ++v)
        {
            worst w = {-1.0, 0.0, 0};
            test_about("%s, %s", materials[m], versions[v]);
            if (!evaluate(versions[v], "sss_Rd_placed(a.xyz, b.xyz, c.xyz)"))
            {
                continue;
            }
            for (size_t i = 0; i < COUNT; ++i)
            {
                double x_i[3], x_o[3], n_o[3];
                to_double(g_samples.in[0][i], x_i);
                to_double(g_samples.in[1][i], x_o);
                to_double(g_samples.in[2][i], n_o);
                for (int k = 0; k < 3; ++k)
                {
                    const double want = sss_dipole_Rd_placed(&profile, k, x_i, x_o, n_o);
                    compare(&w, i, (double)g_samples.out[i][k], want, placed_bound(&profile, k, x_i, n_o, want));
                }
            }
            CHECK_BELOW(w.ratio, 1.0);
        }
    }
}

// ---- exit factor ----

static sss_dipole_exit g_exit; // of the two functions below

static double exit_factor(double cos_o, double eta)
{
    return sss_dipole_exit_factor(cos_o, eta, g_exit);
}

static void exit_factor_is_that_of_c(void)
{
    static const sss_dipole_exit conventions[] = {SSS_DIPOLE_EXIT_PAPER, SSS_DIPOLE_EXIT_CONSERVING};
    double seen[2] = {0.0, 0.0};
    fill_cosines_and_indices();
    for (size_t e = 0; e < 2; ++e)
    {
        sss_profile profile;
        g_exit = conventions[e];
        if (!use_material("Marble", g_exit, &profile))
        {
            continue;
        }
        for (size_t v = 0; v < VERSION_COUNT; ++v)
        {
            worst w = {-1.0, 0.0, 0};
            test_about("%s, %s", e ? "conserving" : "paper", versions[v]);
            if (!evaluate(versions[v], "vec3(sss_exit_factor(a.x))"))
            {
                continue;
            }
            for (size_t i = 0; i < COUNT; ++i)
            {
                const double cos_o = (double)g_samples.in[0][i][0];
                compare(&w, i, (double)g_samples.out[i][0], exit_factor(cos_o, profile.eta),
                        conditioned_bound(exit_factor, cos_o, profile.eta, 1.0));
            }
            CHECK_BELOW(w.ratio, 1.0);
        }
        seen[e] = (double)g_samples.out[WIDTH - 1][0]; // cos_o = 1
    }
    CHECK(seen[1] > 1.05 * seen[0]); // the two conventions are not one
}

// ---- tone mapping ----

// The curve as documented: exposure, the filmic fit of Narkowicz 2015, the sRGB transfer function of IEC 61966-2-1.
static double tone_map(double radiance, double exposure)
{
    const double x = fmax(radiance * exposure, 0.0);
    const double y = fmin((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 1.0);
    return y <= 0.0031308 ? 12.92 * y : 1.055 * pow(y, 1.0 / 2.4) - 0.055;
}

// A shader's pow(y, p) is exp2(p log2(y)): a rounding of log2(y) weighs as many times as log2(y) is large.
static double tone_map_bound(double radiance, double exposure)
{
    const double value = tone_map(radiance, exposure);
    const double logarithm = 1.0 + fabs(log2(fmax(value, 1e-6))) * 2.4;
    return roundings * (0.01 + value * logarithm) +
           fabs(tone_map(radiance * (1.0 + roundings), exposure) - tone_map(radiance * (1.0 - roundings), exposure));
}

static void tone_map_is_the_documented_curve(void)
{
    static const float exposures[] = {1.0f, 0.125f, 40.0f};
    for (size_t i = 0; i < COUNT; ++i)
    {
        g_samples.in[0][i][0] = (float)log_between(1e-6, 1e5, (double)i / COUNT);
        g_samples.in[0][i][1] = (float)between(0.0, 2.0, (double)i / COUNT);
        g_samples.in[0][i][2] = (float)between(-1.0, 0.1, (double)i / COUNT); // filtered negatives do occur
    }
    for (size_t e = 0; e < sizeof exposures / sizeof exposures[0]; ++e)
    {
        g_exposure = exposures[e];
        for (size_t v = 0; v < VERSION_COUNT; ++v)
        {
            worst w = {-1.0, 0.0, 0};
            test_about("exposure %g, %s", (double)g_exposure, versions[v]);
            if (!evaluate(versions[v], "sss_tone_map(a.xyz)"))
            {
                continue;
            }
            for (size_t i = 0; i < 3 * COUNT; ++i)
            {
                const double radiance = (double)g_samples.in[0][i / 3][i % 3];
                compare(&w, i, (double)g_samples.out[i / 3][i % 3], tone_map(radiance, (double)g_exposure),
                        tone_map_bound(radiance, (double)g_exposure));
            }
            test_note("largest error %.1e; worst against its bound at radiance %g", w.error,
                      (double)g_samples.in[0][w.sample / 3][w.sample % 3]);
            CHECK_BELOW(w.ratio, 1.0);
        }
    }
    g_exposure = 1.0f;
    CHECK_REL((double)g_samples.out[COUNT - 1][0], 1.0, (double)FLT_EPSILON); // radiance 1e5: white is reached ...
    CHECK_ABS((double)g_samples.out[0][2], 0.0, 0.0);                       // ... and -1 is black
}

// ---- radiosity, and what the surface mirrors: sss_bem.h ----

// Normals and views all over the sphere, some below the horizon; radiosity and reflected light apart by channel.
static void fill_surfaces(void)
{
    for (size_t i = 0; i < COUNT; ++i)
    {
        const double z[2] = {between(-1.0, 1.0, row(i)),
                             between(-1.0, 1.0, (double)((i * 2654435761u) % COUNT) / COUNT)};
        for (size_t v = 0; v < 2; ++v) // input 1: the normal, input 2: the view
        {
            const double phi = 6.2831853 * column(i) * (double)(v ? 3 : 1), s = sqrt(1.0 - z[v] * z[v]);
            g_samples.in[v + 1][i][0] = (float)(s * cos(phi));
            g_samples.in[v + 1][i][1] = (float)(s * sin(phi));
            g_samples.in[v + 1][i][2] = (float)z[v];
        }
        for (size_t k = 0; k < 3; ++k)
        {
            g_samples.in[0][i][k] = (float)log_between(1e-3, 1e2, (double)((i * 40503u + 97u * k) % COUNT) / COUNT);
            g_samples.in[k][i][3] = (float)((k + 1) * (i % 7)); // reflected light, some of it none
        }
    }
}

// Eq. 3 of Mertens et al. 2003 and the Fresnel reflection, section 5.4; a surface seen from behind only mirrors.
static double radiance(const sss_profile *profile, double B, double cos_o, double reflected)
{
    const double F = cos_o > 0.0 ? sss_dipole_fresnel(cos_o, profile->eta) : 1.0;
    return sss_dipole_exit_factor(fmax(cos_o, 0.0), profile->eta, SSS_DIPOLE_EXIT_PAPER) / 3.14159265358979323846 * B +
           F * reflected;
}

static void compare_radiance(worst *w, const sss_profile *profile)
{
    for (size_t i = 0; i < COUNT; ++i)
    {
        double n[3], w_o[3], cos_o = 0.0;
        to_double(g_samples.in[1][i], n);
        to_double(g_samples.in[2][i], w_o);
        for (int k = 0; k < 3; ++k)
        {
            cos_o += n[k] * w_o[k];
        }
        cos_o = fmin(cos_o, 1.0);
        for (size_t k = 0; k < 3; ++k)
        {
            const double B = (double)g_samples.in[0][i][k], reflected = (double)g_samples.in[k][i][3];
            const double want = radiance(profile, B, cos_o, reflected);
            // The cosine is a sum of three products of numbers up to 1, and moves by as much.
            const double less = cos_o - 4.0 * FLT_EPSILON, more = fmin(cos_o + 4.0 * FLT_EPSILON, 1.0);
            const double moved = fmax(fabs(radiance(profile, B, less, reflected) - want),
                                      fabs(radiance(profile, B, more, reflected) - want));
            compare(w, i, (double)g_samples.out[i][k], want, moved + roundings * (B + reflected));
        }
    }
}

static void radiance_is_exit_factor_and_fresnel(void)
{
    sss_profile profile;
    worst w = {-1.0, 0.0, 0};
    fill_surfaces();
    if (!use_material("Marble", SSS_DIPOLE_EXIT_PAPER, &profile))
    {
        return;
    }
    for (size_t v = 0; v < VERSION_COUNT; ++v)
    {
        w.ratio = -1.0;
        test_about("%s", versions[v]);
        if (evaluate(versions[v], "sss_bem_radiance(a.xyz, b.xyz, c.xyz, vec3(a.w, b.w, c.w))"))
        {
            compare_radiance(&w, &profile);
            CHECK_BELOW(w.ratio, 1.0);
        }
    }
    test_about("an inverted eta"); // must be caught
    profile.eta = 1.0 / profile.eta;
    w.ratio = -1.0;
    compare_radiance(&w, &profile);
    CHECK(w.ratio > 1e3);
}

static void environment_is_mirrored(void)
{
    static const double texel = 2.0 / CUBE_SIDE; // on a face of [-1, 1]^2
    fill_surfaces();
    for (size_t v = 0; v < VERSION_COUNT; ++v)
    {
        double largest = 0.0, sum = 0.0, unturned = 0.0;
        test_about("%s", versions[v]);
        if (!evaluate(versions[v], "sss_bem_environment(b.xyz, c.xyz)"))
        {
            continue;
        }
        for (size_t i = 0; i < COUNT; ++i)
        {
            double n[3], w_o[3], mirrored[3], dot = 0.0, face = 0.0;
            to_double(g_samples.in[1][i], n);
            to_double(g_samples.in[2][i], w_o);
            for (int k = 0; k < 3; ++k)
            {
                dot += n[k] * w_o[k];
            }
            for (int k = 0; k < 3; ++k)
            {
                mirrored[k] = 2.0 * dot * n[k] - w_o[k];
                face = fmax(face, fabs(mirrored[k]));
            }
            for (int k = 0; k < 3; ++k)
            {
                const double error = fabs((double)g_samples.out[i][k] - mirrored[k] / face);
                largest = fmax(largest, isfinite(error) ? error : HUGE_VAL);
                sum += error;
                unturned = fmax(unturned, fabs((double)g_samples.out[i][k] - w_o[k] / face));
            }
        }
        CHECK_BELOW(largest, 1.01 * texel);        // at an edge of the cube, where texels of two faces are mixed
        CHECK_BELOW(sum / (3 * COUNT), 0.02 * texel); // elsewhere exact
        CHECK(unturned > 1.0);
    }
}

// ---- atlases: what the GPU rasterises, fetches and spreads with the same coordinates: sss_atlas.h ----

typedef struct atlas_case
{
    mesh_data mesh;
    sss_atlas *atlas;
    sss_atlas_mesh m;
    sss_atlas_texels x;
} atlas_case;

static void atlas_case_free(atlas_case *c)
{
    sss_atlas_free(c->atlas);
    mesh_free(&c->mesh);
    memset(c, 0, sizeof *c);
}

// Takes the mesh over.
static int atlas_case_make(atlas_case *c, mesh_data *mesh, size_t size, sss_atlas_method method)
{
    sss_atlas_options o;
    memset(c, 0, sizeof *c);
    memset(&o, 0, sizeof o);
    o.size = size;
    o.method = method;
    c->mesh = *mesh;
    const sss_mesh view = mesh_view(&c->mesh, 10.0);
    return CHECK_EQUAL(sss_atlas_create(&view, &o, NULL, &c->atlas), SSS_OK) &&
           CHECK_EQUAL(sss_atlas_get_mesh(c->atlas, &c->m), SSS_OK) &&
           CHECK_EQUAL(sss_atlas_get_texels(c->atlas, &c->x), SSS_OK);
}

typedef struct canvas
{
    GLuint texture, framebuffer;
} canvas;

static GLuint float_texture(const gl_functions *gl, size_t size, const float *rgba, GLint filter)
{
    GLuint texture = 0;
    gl->GenTextures(1, &texture);
    gl->ActiveTexture(GL_TEXTURE0);
    gl->BindTexture(GL_TEXTURE_2D, texture);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, (GLsizei)size, (GLsizei)size, 0, GL_RGBA, GL_FLOAT, rgba);
    return texture;
}

static canvas canvas_make(const gl_functions *gl, size_t size)
{
    canvas c;
    c.texture = float_texture(gl, size, NULL, GL_NEAREST);
    gl->GenFramebuffers(1, &c.framebuffer);
    gl->BindFramebuffer(GL_FRAMEBUFFER, c.framebuffer);
    gl->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, c.texture, 0);
    gl->Viewport(0, 0, (GLsizei)size, (GLsizei)size);
    gl->ClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    gl->Clear(GL_COLOR_BUFFER_BIT);
    return c;
}

static void canvas_free(const gl_functions *gl, canvas *c)
{
    gl->DeleteFramebuffers(1, &c->framebuffer);
    gl->DeleteTextures(1, &c->texture);
}

// A program of one piece of the atlas in each stage, NULL for none, and what comes behind it.
static GLuint atlas_program(const char *version, const char *vertex_piece, const char *vertex_main,
                            const char *fragment_piece, const char *fragment_main)
{
    const int es = strstr(version, "es") != NULL;
    const char *const precision = es ? "precision highp float; precision highp int;\n" : "\n";
    const char *const vertex[] = {precision, vertex_piece ? vertex_piece : "\n", vertex_main};
    const char *const fragment[] = {precision, fragment_piece ? fragment_piece : "\n", fragment_main};
    char version_line[32], error[4096] = "";
    snprintf(version_line, sizeof version_line, "#version %s", version);
    const GLuint program = gl_context_program(g_context, version_line, vertex, 3, fragment, 3, error, sizeof error);
    if (!program)
    {
        test_note("%s: %s", version, error);
    }
    return program;
}

// Draws every triangle with its number plus 1 into image [size^2][4].
static int rasterise(const atlas_case *c, const char *version, float *image)
{
    static const char *const vertex = "in vec2 uv;\n"
                                      "flat out int number;\n"
                                      "void main()\n"
                                      "{\n"
                                      "    number = gl_VertexID / 3;\n"
                                      "    gl_Position = sss_atlas_place(uv);\n"
                                      "}\n";
    static const char *const fragment = "flat in int number;\n"
                                        "out vec4 result;\n"
                                        "void main() { result = vec4(float(number + 1)); }\n";
    const gl_functions *const gl = gl_context_functions(g_context);
    const GLuint program = atlas_program(version, sss_atlas_glsl(SSS_ATLAS_GLSL_PLACE), vertex, NULL, fragment);
    const size_t corners = 3 * c->m.triangle_count;
    float *uv = (float *)malloc(2 * corners * sizeof *uv);
    GLuint buffer = 0, vertex_array = 0;
    if (!CHECK(program != 0 && uv != NULL))
    {
        free(uv);
        return 0;
    }
    for (size_t i = 0; i < corners; ++i)
    {
        memcpy(&uv[2 * i], &c->m.uv[2 * (size_t)c->m.triangles[i]], 2 * sizeof *uv);
    }
    canvas target = canvas_make(gl, c->x.size);
    gl->GenVertexArrays(1, &vertex_array);
    gl->BindVertexArray(vertex_array);
    gl->GenBuffers(1, &buffer);
    gl->BindBuffer(GL_ARRAY_BUFFER, buffer);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(2 * corners * sizeof *uv), uv, GL_STATIC_DRAW);
    const GLuint place = (GLuint)gl->GetAttribLocation(program, "uv");
    gl->EnableVertexAttribArray(place);
    gl->VertexAttribPointer(place, 2, GL_FLOAT, GL_FALSE, 0, NULL);
    gl->UseProgram(program);
    gl->Disable(GL_CULL_FACE);
    gl->Disable(GL_DEPTH_TEST);
    gl->DrawArrays(GL_TRIANGLES, 0, (GLsizei)corners);
    gl->ReadPixels(0, 0, (GLsizei)c->x.size, (GLsizei)c->x.size, GL_RGBA, GL_FLOAT, image);
    gl->DeleteBuffers(1, &buffer);
    gl->DeleteVertexArrays(1, &vertex_array);
    gl->DeleteProgram(program);
    canvas_free(gl, &target);
    free(uv);
    return CHECK(gl->GetError() == GL_NO_ERROR);
}

// The centre of a texel in a triangle of the atlas: how far, in texels, from the nearest of its edges.
static double from_edges(const atlas_case *c, size_t triangle, size_t texel)
{
    const double size = (double)c->x.size;
    const double at[2] = {(double)(texel % c->x.size) + 0.5, (double)(texel / c->x.size) + 0.5};
    double p[3][2], least = HUGE_VAL;
    for (size_t k = 0; k < 6; ++k)
    {
        p[k / 2][k % 2] = (double)c->m.uv[2 * (size_t)c->m.triangles[3 * triangle + k / 2] + k % 2] * size;
    }
    for (int k = 0; k < 3; ++k)
    {
        const double *a = p[k], *b = p[(k + 1) % 3];
        const double e[2] = {b[0] - a[0], b[1] - a[1]}, square = e[0] * e[0] + e[1] * e[1];
        const double s = square > 0.0 ? ((at[0] - a[0]) * e[0] + (at[1] - a[1]) * e[1]) / square : 0.0;
        const double t = fmin(fmax(s, 0.0), 1.0);
        least = fmin(least, hypot(a[0] + t * e[0] - at[0], a[1] + t * e[1] - at[1]));
    }
    return least;
}

// The triangle that the table shows at a texel, plus 1, where it has the centre; 0 elsewhere. Sizes are powers of two.
static size_t shown_by_table(const atlas_case *c, size_t texel)
{
    const uint32_t e = c->x.entry[texel];
    const int64_t step = 16777216 / (int64_t)c->x.size;
    const int64_t centre[2] = {(int64_t)(texel % c->x.size) * step + step / 2,
                               (int64_t)(texel / c->x.size) * step + step / 2};
    int64_t p[3][2];
    if (e >= c->x.inner_count)
    {
        return 0;
    }
    for (size_t k = 0; k < 6; ++k)
    {
        const size_t corner = 3 * (size_t)c->x.triangle[e] + k / 2;
        p[k / 2][k % 2] = (int64_t)llround((double)c->m.uv[2 * (size_t)c->m.triangles[corner] + k % 2] * 16777216.0);
    }
    return flat_inside(centre, p[0], p[1], p[2]) >= 0 ? c->x.triangle[e] + (size_t)1 : 0;
}

typedef struct raster_errors
{
    size_t shown, near, differ; // texels with a triangle; centres within 1/256 texel of its edges; other triangles
    double farthest;            // of those that differ: from the edges of either triangle
} raster_errors;

static raster_errors compare_raster(const atlas_case *c, const float *image, size_t shift)
{
    raster_errors e = {0, 0, 0, 0.0};
    const size_t texels = c->x.size * c->x.size;
    for (size_t i = 0; i < texels; ++i)
    {
        const size_t want = shown_by_table(c, (i + shift) % texels), got = (size_t)image[4 * i];
        double distance = HUGE_VAL;
        if (want > 0)
        {
            distance = from_edges(c, want - 1, i);
            ++e.shown;
            e.near += distance <= 1.0 / 256.0;
        }
        if (got > 0 && got <= c->m.triangle_count)
        {
            distance = fmin(distance, from_edges(c, got - 1, i));
        }
        if (want != got)
        {
            ++e.differ;
            e.farthest = fmax(e.farthest, distance);
        }
    }
    return e;
}

// Rasterisers place corners on a grid of 1/256 texel: centres that near to an edge may fall to either side.
static void atlas_is_rasterised_as_the_table_says(void)
{
    for (int which = 0; which < 4; ++which)
    {
        mesh_data mesh;
        atlas_case c;
        const size_t size = which == 0 ? 1024 : 256;
        if ((which == 0 ? mesh_load_bunny(&mesh) : mesh_sphere(5, 1.0, &mesh)) != 0)
        {
            test_note("glmark2-data with its bunny is not installed");
            continue;
        }
        const sss_atlas_method method = which < 2 ? SSS_ATLAS_ORTHOGRAPHIC
                                        : which == 2 ? SSS_ATLAS_AREA : SSS_ATLAS_CONVEX;
        float *image = (float *)malloc(4 * size * size * sizeof *image);
        test_about("%s, size %zu", which == 0 ? "bunny" : "sphere", size);
        if (atlas_case_make(&c, &mesh, size, method) && image != NULL)
        {
            for (size_t v = 0; v < VERSION_COUNT; ++v)
            {
                test_about("%s, size %zu, %s", which == 0 ? "bunny" : "sphere", size, versions[v]);
                if ((which == 0 && v > 0) || !rasterise(&c, versions[v], image))
                {
                    continue;
                }
                const raster_errors e = compare_raster(&c, image, 0);
                CHECK(e.shown > size * size / 3);
                CHECK_BELOW(e.farthest, 1.0 / 256.0);
                CHECK(e.differ <= e.near + e.shown / 100);
                test_note("%zu of %zu texels differ (%.3f %%), all within 1/256 texel of an edge; %.2f %% lie so near",
                          e.differ, e.shown, 100.0 * (double)e.differ / (double)e.shown,
                          100.0 * (double)e.near / (double)e.shown);
                // v turned over, and a table moved by one texel, must be caught
                const raster_errors moved = compare_raster(&c, image, 1);
                CHECK(moved.farthest > 0.5 && moved.differ > e.shown / 20);
            }
        }
        free(image);
        atlas_case_free(&c);
    }
}

// The image that fill_image makes with one ring after the other is what sss_atlas_dilate makes.
static void atlas_is_dilated_as_in_c(void)
{
    enum
    {
        SIZE = 128,
        RINGS = 3
    };
    static float image[4 * SIZE * SIZE], want[3 * SIZE * SIZE];
    static const char *const vertex = "void main()\n"
                                      "{\n"
                                      "    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0,\n"
                                      "                       gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);\n"
                                      "}\n";
    static const char *const fragment = "uniform sampler2D image;\n"
                                        "out vec4 result;\n"
                                        "void main() { result = sss_atlas_dilate(image, ivec2(gl_FragCoord.xy)); }\n";
    const gl_functions *const gl = gl_context_functions(g_context);
    mesh_data mesh;
    atlas_case c;
    if (mesh_sphere(4, 1.0, &mesh) != 0 || !atlas_case_make(&c, &mesh, SIZE, SSS_ATLAS_ORTHOGRAPHIC))
    {
        test_note("no atlas of the sphere");
        CHECK(0);
        return;
    }
    float *values = (float *)malloc(3 * c.x.count * sizeof *values);
    random_seed(9);
    for (size_t i = 0; i < 3 * c.x.count; ++i)
    {
        values[i] = (float)random_unit();
    }
    for (size_t v = 0; v < VERSION_COUNT; ++v)
    {
        double worst_error = 0.0;
        size_t alpha = 0;
        test_about("%s", versions[v]);
        const GLuint program = atlas_program(versions[v], NULL, vertex, sss_atlas_glsl(SSS_ATLAS_GLSL_DILATE),
                                             fragment);
        if (!CHECK(program != 0))
        {
            continue;
        }
        memset(image, 0, sizeof image);
        for (size_t i = 0; i < c.x.count; ++i)
        {
            memcpy(&image[4 * (size_t)c.x.texel[i]], &values[3 * i], 3 * sizeof *values);
            image[4 * (size_t)c.x.texel[i] + 3] = 1.0f;
        }
        for (int ring = 0; ring < RINGS; ++ring)
        {
            GLuint vertex_array = 0, source = float_texture(gl, SIZE, image, GL_NEAREST);
            canvas target = canvas_make(gl, SIZE);
            gl->GenVertexArrays(1, &vertex_array);
            gl->BindVertexArray(vertex_array);
            gl->UseProgram(program);
            gl->ActiveTexture(GL_TEXTURE0);
            gl->BindTexture(GL_TEXTURE_2D, source);
            gl->Uniform1i(gl->GetUniformLocation(program, "image"), 0);
            gl->DrawArrays(GL_TRIANGLES, 0, 3);
            gl->ReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_FLOAT, image);
            gl->DeleteVertexArrays(1, &vertex_array);
            gl->DeleteTextures(1, &source);
            canvas_free(gl, &target);
        }
        gl->DeleteProgram(program);
        CHECK_EQUAL(sss_atlas_fill_image(c.atlas, values, 3, RINGS, want), SSS_OK);
        for (size_t i = 0; i < SIZE * SIZE; ++i)
        {
            int shows = 0;
            for (size_t k = 0; k < 3; ++k)
            {
                keep_worst(&worst_error, fabs((double)image[4 * i + k] - (double)want[3 * i + k]));
                shows |= want[3 * i + k] != 0.0f;
            }
            alpha += (image[4 * i + 3] == 1.0f) != shows;
        }
        CHECK_BELOW(worst_error, roundings);
        CHECK_EQUAL(alpha, 0);
        CHECK(gl->GetError() == GL_NO_ERROR);
    }
    free(values);
    atlas_case_free(&c);
}

// sss_atlas_fetch against texture() with GL_LINEAR. Filters count in 1/256 of a texel (section 8.14 of the
// specification leaves their precision open).
static void atlas_is_fetched_as_in_c(void)
{
    enum
    {
        SIZE = 64
    };
    static float image[4 * SIZE * SIZE], got[4 * COUNT], uv[4 * COUNT], result[4 * COUNT], weights[3 * COUNT];
    static uint32_t triangle[COUNT];
    static const char *const vertex = "void main()\n"
                                      "{\n"
                                      "    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0,\n"
                                      "                       gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);\n"
                                      "}\n";
    static const char *const fragment = "uniform sampler2D image;\n"
                                        "uniform sampler2D places;\n"
                                        "out vec4 result;\n"
                                        "void main()\n"
                                        "{\n"
                                        "    vec2 uv = texelFetch(places, ivec2(gl_FragCoord.xy), 0).xy;\n"
                                        "    result = textureLod(image, uv, 0.0);\n"
                                        "}\n";
    const gl_functions *const gl = gl_context_functions(g_context);
    double worst_error = 0.0, contrast = 0.0;
    mesh_data mesh;
    atlas_case c;
    if (mesh_sphere(3, 1.0, &mesh) != 0 || !atlas_case_make(&c, &mesh, SIZE, SSS_ATLAS_ORTHOGRAPHIC))
    {
        test_note("no atlas of the sphere");
        CHECK(0);
        return;
    }
    random_seed(10);
    for (size_t i = 0; i < 4 * SIZE * SIZE; ++i)
    {
        image[i] = (float)random_unit();
    }
    for (size_t i = 0; i < COUNT; ++i)
    {
        const double a = random_unit(), b = random_unit() * (1.0 - a);
        const double weight[3] = {a, b, 1.0 - a - b};
        double place[2] = {0.0, 0.0};
        triangle[i] = (uint32_t)(random_unit() * (double)c.m.triangle_count);
        for (size_t k = 0; k < 3; ++k)
        {
            const size_t corner = c.m.triangles[3 * (size_t)triangle[i] + k];
            weights[3 * i + k] = (float)weight[k];
            place[0] += weight[k] * (double)c.m.uv[2 * corner];
            place[1] += weight[k] * (double)c.m.uv[2 * corner + 1];
        }
        uv[4 * i] = (float)place[0];
        uv[4 * i + 1] = (float)place[1];
    }
    const GLuint program = atlas_program(versions[0], NULL, vertex, NULL, fragment);
    GLuint vertex_array = 0, source = float_texture(gl, SIZE, image, GL_LINEAR);
    GLuint places = float_texture(gl, WIDTH, uv, GL_NEAREST);
    canvas target = canvas_make(gl, WIDTH);
    CHECK(program != 0 && WIDTH == HEIGHT);
    gl->GenVertexArrays(1, &vertex_array);
    gl->BindVertexArray(vertex_array);
    gl->UseProgram(program);
    gl->ActiveTexture(GL_TEXTURE0);
    gl->BindTexture(GL_TEXTURE_2D, source);
    gl->ActiveTexture(GL_TEXTURE0 + 1);
    gl->BindTexture(GL_TEXTURE_2D, places);
    gl->Uniform1i(gl->GetUniformLocation(program, "image"), 0);
    gl->Uniform1i(gl->GetUniformLocation(program, "places"), 1);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
    gl->ReadPixels(0, 0, WIDTH, HEIGHT, GL_RGBA, GL_FLOAT, result);
    gl->DeleteVertexArrays(1, &vertex_array);
    gl->DeleteTextures(1, &source);
    gl->DeleteTextures(1, &places);
    gl->DeleteProgram(program);
    canvas_free(gl, &target);
    CHECK_EQUAL(sss_atlas_fetch(c.atlas, image, 4, triangle, weights, COUNT, got), SSS_OK);
    for (size_t i = 0; i < 4 * COUNT; ++i)
    {
        keep_worst(&worst_error, fabs((double)got[i] - (double)result[i]));
        contrast = fmax(contrast, fabs((double)got[i] - (double)result[(i + 4) % (4 * COUNT)]));
    }
    CHECK_BELOW(worst_error, 2.0 / 256.0); // contrasts of 1, two weights
    CHECK(contrast > 0.5);
    CHECK(gl->GetError() == GL_NO_ERROR);
    atlas_case_free(&c);
}

// ---- Reference points and harmonics ----

// An object on the graphics card: its words, and what its reference points radiate under one light.
typedef struct hao_case
{
    sss_hao *hao;
    sss_hao_stats stats;
    sss_hao_uniforms uniforms;
    uint32_t *words;   // [height][SSS_HAO_TEXTURE_WIDTH]
    float *references; // [rows][SSS_HAO_TEXTURE_WIDTH][4]
    float *B;          // [V][channels] by sss_hao_relight_rows
    size_t height, rows;
} hao_case;

static void hao_case_free(hao_case *c)
{
    sss_hao_free(c->hao);
    free(c->words);
    free(c->references);
    free(c->B);
}

// A sphere with a hole, some of whose vertices nothing names.
static int hao_case_make(hao_case *c, size_t channels, size_t order)
{
    static const double middle[3] = {0.1, -0.2, 0.3};
    const sss_hao_light light = {{1.0, 0.7, 0.4}, {0.3, 0.5, 0.8}, {0.0, 0.0, 0.0}, SSS_HAO_LIGHT_DIRECTIONAL};
    sss_dipole_material marble;
    sss_profile profile;
    sss_hao_options options;
    mesh_data sphere;
    memset(c, 0, sizeof *c);
    memset(&options, 0, sizeof options);
    options.channels = channels;
    options.channel = channels == 1 ? 2 : 0;
    options.order = order;
    options.directions = 66;
    options.reference_count = 60;
    if (mesh_sphere(4, 1.0, &sphere) != 0)
    {
        return 0;
    }
    mesh_transform(&sphere, 1.0, middle);
    sphere.triangle_count -= 5;
    const sss_mesh mesh = mesh_view(&sphere, 20.0);
    const int made = sss_dipole_material_by_name("Marble", &marble) == SSS_OK &&
                     sss_dipole_profile(&marble, SSS_DIPOLE_FRESNEL_EXACT, &profile) == SSS_OK &&
                     sss_hao_create(&mesh, &profile, &options, NULL, &c->hao) == SSS_OK &&
                     sss_hao_get_stats(c->hao, &c->stats) == SSS_OK &&
                     sss_hao_get_texture(c->hao, NULL, &c->height) == SSS_OK;
    mesh_free(&sphere);
    if (!CHECK(made))
    {
        return 0;
    }
    float *lighting = (float *)calloc(3 * c->stats.lighting_count, sizeof *lighting);
    c->rows = (c->stats.reference_count + SSS_HAO_TEXTURE_WIDTH - 1) / SSS_HAO_TEXTURE_WIDTH;
    c->words = (uint32_t *)malloc(c->height * SSS_HAO_TEXTURE_WIDTH * sizeof *c->words);
    c->references = (float *)calloc(4 * c->rows * SSS_HAO_TEXTURE_WIDTH, sizeof *c->references);
    c->B = (float *)malloc(c->stats.vertex_count * channels * sizeof *c->B);
    const int lit = sss_hao_get_texture(c->hao, c->words, &c->height) == SSS_OK &&
                    sss_hao_add_lights(c->hao, &light, 1, lighting) == SSS_OK &&
                    sss_hao_relight_references(c->hao, lighting, c->references) == SSS_OK &&
                    sss_hao_relight_rows(c->hao, lighting, c->references, 0, c->stats.vertex_count, c->B) == SSS_OK &&
                    sss_hao_get_uniforms(c->hao, lighting, &c->uniforms) == SSS_OK;
    free(lighting);
    return CHECK(lit);
}

// The vertex shader puts each vertex's radiosity into a pixel of its own, image [WIDTH * HEIGHT][4].
static int hao_in_shader(const hao_case *c, const char *version, float *image)
{
    static const char *const vertex = "flat out vec3 radiosity;\n"
                                      "void main()\n"
                                      "{\n"
                                      "    radiosity = sss_hao_radiosity(gl_VertexID);\n"
                                      "    gl_Position = vec4((vec2(float(gl_VertexID % 64), float(gl_VertexID / 64))\n"
                                      "                        + 0.5) / 32.0 - 1.0, 0.0, 1.0);\n"
                                      "    gl_PointSize = 1.0;\n"
                                      "}\n";
    static const char *const fragment = "flat in vec3 radiosity;\n"
                                        "out vec4 result;\n"
                                        "void main() { result = vec4(radiosity, 1.0); }\n";
    const gl_functions *const gl = gl_context_functions(g_context);
    const GLuint program =
        atlas_program(version, sss_hao_glsl(SSS_HAO_GLSL_RADIOSITY), vertex, NULL, fragment);
    GLuint words = 0, vertex_array = 0;
    if (!CHECK(program != 0))
    {
        return 0;
    }
    canvas target = canvas_make(gl, WIDTH);
    gl->GenVertexArrays(1, &vertex_array);
    gl->BindVertexArray(vertex_array);
    gl->ActiveTexture(GL_TEXTURE0);
    gl->GenTextures(1, &words);
    gl->BindTexture(GL_TEXTURE_2D, words);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_R32UI, SSS_HAO_TEXTURE_WIDTH, (GLsizei)c->height, 0, GL_RED_INTEGER,
                   GL_UNSIGNED_INT, c->words);
    gl->ActiveTexture(GL_TEXTURE0 + 1);
    GLuint references = 0;
    gl->GenTextures(1, &references);
    gl->BindTexture(GL_TEXTURE_2D, references);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, SSS_HAO_TEXTURE_WIDTH, (GLsizei)c->rows, 0, GL_RGBA, GL_FLOAT,
                   c->references);
    gl->UseProgram(program);
    gl->Uniform1i(gl->GetUniformLocation(program, "sss_hao_texture"), 0);
    gl->Uniform1i(gl->GetUniformLocation(program, "sss_hao_references"), 1);
    gl->Uniform4iv(gl->GetUniformLocation(program, "sss_hao_layout"), 1, c->uniforms.layout);
    gl->Uniform4fv(gl->GetUniformLocation(program, "sss_hao_harmonics"), 64, c->uniforms.harmonics[0]);
    gl->Uniform4fv(gl->GetUniformLocation(program, "sss_hao_bias"), 1, c->uniforms.bias);
    memset(image, 0xff, 4 * COUNT * sizeof *image);
    gl->DrawArrays(GL_POINTS, 0, (GLsizei)c->stats.vertex_count);
    gl->ReadPixels(0, 0, WIDTH, HEIGHT, GL_RGBA, GL_FLOAT, image);
    gl->DeleteTextures(1, &words);
    gl->DeleteTextures(1, &references);
    gl->DeleteVertexArrays(1, &vertex_array);
    gl->DeleteProgram(program);
    canvas_free(gl, &target);
    return CHECK(gl->GetError() == GL_NO_ERROR);
}

// sss_hao_radiosity against sss_hao_relight_rows: within 1/512 of full scale, and by far: both are sums of floats.
static void hao_is_relit_as_in_c(void)
{
    static float image[4 * COUNT];
    static const size_t orders[3] = {3, 1, 6};
    for (size_t channels = 1; channels <= 3; channels += 2)
    {
        for (size_t k = 0; k < 3; ++k)
        {
            hao_case c;
            test_about("%zu channels, order %zu", channels, orders[k]);
            if (hao_case_make(&c, channels, orders[k]))
            {
                CHECK(c.stats.vertex_count <= COUNT && c.stats.order == orders[k]);
                for (size_t v = 0; v < VERSION_COUNT; ++v)
                {
                    double worst_error = 0.0, full = 0.0, mutant = 0.0;
                    test_about("%zu channels, order %zu, %s", channels, orders[k], versions[v]);
                    if (!hao_in_shader(&c, versions[v], image))
                    {
                        continue;
                    }
                    for (size_t i = 0; i < c.stats.vertex_count; ++i)
                    {
                        for (size_t channel = 0; channel < 3; ++channel)
                        {
                            const double want = (double)c.B[channels * i + (channels == 3 ? channel : 0)];
                            full = fmax(full, want);
                            keep_worst(&worst_error, fabs((double)image[4 * i + channel] - want));
                            mutant = fmax(mutant, fabs((double)image[4 * ((i + 1) % COUNT) + channel] - want));
                        }
                    }
                    CHECK_BELOW(worst_error / full, 1.0 / 512.0);
                    CHECK_BELOW(worst_error / full, 1e-5);
                    CHECK(mutant / full > 1.0 / 512.0); // one vertex for the other
                    CHECK(full > 0.1);
                }
            }
            hao_case_free(&c);
        }
    }
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {TEST(fresnel_is_that_of_c),   TEST(schlick_is_that_of_c),
                                      TEST(an_inverted_eta_is_caught), TEST(Rd_is_that_of_c),
                                      TEST(Rd_placed_is_that_of_c), TEST(exit_factor_is_that_of_c),
                                      TEST(tone_map_is_the_documented_curve),
                                      TEST(radiance_is_exit_factor_and_fresnel), TEST(environment_is_mirrored),
                                      TEST(atlas_is_rasterised_as_the_table_says),
                                      TEST(atlas_is_dilated_as_in_c), TEST(atlas_is_fetched_as_in_c),
                                      TEST(hao_is_relit_as_in_c)};
    char error[512] = "";
    g_context = gl_context_create_headless(WIDTH, HEIGHT, error, sizeof error);
    if (!g_context)
    {
        fprintf(stderr, "no OpenGL context: %s\n0 passed, 1 failed\n", error);
        return 1;
    }
    fprintf(stderr, "OpenGL %s\n", gl_context_description(g_context));
    make_environment(gl_context_functions(g_context));
    const int status = test_main(argc, argv, "glsl", tests, sizeof tests / sizeof *tests);
    gl_context_free(g_context);
    return status;
}
