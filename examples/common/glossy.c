#include "glossy.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "../../sss_bem.h"
#include "backdrop.h"

enum
{
    ATTRIBUTES = 3, // position, normal, radiosity
    CUBE_SIDE = 64  // texels along a face of the studio
};

struct glossy
{
    const gl_context *context;
    const gl_functions *gl;
    backdrop behind;
    GLuint program, vertex_array, environment, buffers[ATTRIBUTES + 1];
    GLsizei index_count;
    size_t vertex_count;
};

static const char vertex_shader[] =
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec3 normal;\n"
    "layout(location = 2) in vec3 radiosity;\n"
    "uniform mat4 view_projection;\n"
    "out vec3 at, n, B;\n"
    "void main()\n"
    "{\n"
    "    at = position;\n"
    "    n = normal;\n"
    "    B = radiosity;\n"
    "    gl_Position = view_projection * vec4(position, 1.0);\n"
    "}\n";

static const char fragment_shader[] =
    "in vec3 at, n, B;\n"
    "uniform vec3 eye;\n"
    "uniform float studio;\n"
    "out vec4 color;\n"
    "void main()\n"
    "{\n"
    "    vec3 V = normalize(eye - at), N = normalize(gl_FrontFacing ? n : -n);\n"
    // Interpolated normals may face away at the outline; there the surface is seen at a grazing angle.
    "    N = normalize(N + max(0.02 - dot(N, V), 0.0) * V);\n"
    "    vec3 L = sss_bem_radiance(max(B, 0.0), N, V, studio * sss_bem_environment(N, V));\n"
    "    color = vec4(sss_tone_map(L), 1.0);\n"
    "}\n";

// ---- the studio: a dark room, lighter above, with two soft boxes ----

static double lamp(const double d[3], double x, double y, double z, double cos_edge)
{
    const double cosine = (x * d[0] + y * d[1] + z * d[2]) / sqrt((x * x + y * y + z * z) *
                                                                  (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
    const double t = fmin(1.0, fmax(0.0, (cosine - cos_edge) / (1.0 - cos_edge) * 4.0));
    return t * t * (3.0 - 2.0 * t);
}

static void studio_radiance(const double d[3], float out[3])
{
    const double up = 0.5 + 0.5 * d[1] / sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    const double room = 0.01 + 0.06 * up * up;
    const double left = lamp(d, -0.8, 0.7, 0.6, 0.86), right = lamp(d, 1.0, 0.35, 0.1, 0.93);
    out[0] = (float)(room + 0.95 * left + 0.28 * right);
    out[1] = (float)(room + 0.97 * left + 0.32 * right);
    out[2] = (float)(1.2 * room + left + 0.40 * right);
}

// Texel (s, t) of each face and its direction: section 8.13 of the OpenGL 4.5 specification.
static void make_environment(glossy *g)
{
    static float texels[CUBE_SIDE][CUBE_SIDE][3];
    g->gl->GenTextures(1, &g->environment);
    g->gl->BindTexture(GL_TEXTURE_CUBE_MAP, g->environment);
    g->gl->TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    g->gl->TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    for (GLenum face = 0; face < 6; ++face)
    {
        for (int i = 0; i < CUBE_SIDE * CUBE_SIDE; ++i)
        {
            const double s = 2.0 * (i % CUBE_SIDE + 0.5) / CUBE_SIDE - 1.0;
            const double t = 2.0 * (i / CUBE_SIDE + 0.5) / CUBE_SIDE - 1.0, sign = face % 2 ? -1.0 : 1.0;
            const double directions[3][3] = {{sign, -t, -sign * s}, {s, sign, sign * t}, {sign * s, -t, sign}};
            studio_radiance(directions[face / 2], texels[i / CUBE_SIDE][i % CUBE_SIDE]);
        }
        g->gl->TexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + face, 0, GL_RGB16F, CUBE_SIDE, CUBE_SIDE, 0, GL_RGB,
                          GL_FLOAT, texels);
    }
    g->gl->Enable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
}

// ---- the mesh ----

static int build_programs(glossy *g, char *error_text, size_t error_size)
{
    const char *const vertex[] = {vertex_shader};
    const char *const fragment[] = {sss_dipole_glsl(SSS_DIPOLE_GLSL_FRESNEL), sss_dipole_glsl(SSS_DIPOLE_GLSL_PROFILE),
                                    sss_dipole_glsl(SSS_DIPOLE_GLSL_TONE_MAPPING), sss_bem_glsl(SSS_BEM_GLSL_SHADE),
                                    fragment_shader};
    g->program = gl_context_program(g->context, gl_context_version_line(g->context), vertex, 1, fragment, 5, error_text,
                                    error_size);
    return g->program ? backdrop_create(g->context, &g->behind, error_text, error_size) : -1;
}

glossy *glossy_create(gl_context *context, const model *m, char *error_text, size_t error_size)
{
    glossy *const g = calloc(1, sizeof *g);
    if (!g)
    {
        snprintf(error_text, error_size, "out of memory");
        return NULL;
    }
    g->context = context;
    g->gl = gl_context_functions(context);
    if (build_programs(g, error_text, error_size) != 0)
    {
        glossy_free(g);
        return NULL;
    }
    make_environment(g);
    g->vertex_count = m->vertex_count;
    g->index_count = (GLsizei)(3 * m->triangle_count);
    g->gl->GenVertexArrays(1, &g->vertex_array);
    g->gl->GenBuffers(ATTRIBUTES + 1, g->buffers);
    g->gl->BindVertexArray(g->vertex_array);
    g->gl->BindBuffer(GL_ELEMENT_ARRAY_BUFFER, g->buffers[ATTRIBUTES]);
    g->gl->BufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(3 * m->triangle_count * sizeof *m->triangles), m->triangles,
                      GL_STATIC_DRAW);
    return g;
}

void glossy_free(glossy *g)
{
    if (g)
    {
        backdrop_free(&g->behind);
        g->gl->DeleteProgram(g->program);
        g->gl->DeleteVertexArrays(1, &g->vertex_array);
        g->gl->DeleteBuffers(ATTRIBUTES + 1, g->buffers);
        g->gl->DeleteTextures(1, &g->environment);
        free(g);
    }
}

int glossy_set_profile(glossy *g, const sss_profile *profile)
{
    sss_dipole_glsl_uniforms u;
    if (sss_dipole_get_glsl_uniforms(profile, SSS_DIPOLE_EXIT_PAPER, &u) != SSS_OK)
    {
        return -1;
    }
    g->gl->UseProgram(g->program); // the shader never asks for the rest of the profile
    g->gl->Uniform1f(g->gl->GetUniformLocation(g->program, "sss_eta"), u.eta);
    g->gl->Uniform1f(g->gl->GetUniformLocation(g->program, "sss_exit_scale"), u.exit_scale);
    return 0;
}

void glossy_set_vertices(glossy *g, const model *m, const float *radiosity)
{
    const float *const values[ATTRIBUTES] = {m->positions, m->normals, radiosity};
    g->gl->BindVertexArray(g->vertex_array);
    for (GLuint i = 0; i < ATTRIBUTES; ++i)
    {
        g->gl->BindBuffer(GL_ARRAY_BUFFER, g->buffers[i]);
        g->gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(3 * g->vertex_count * sizeof(float)), values[i],
                          GL_STREAM_DRAW);
        g->gl->EnableVertexAttribArray(i);
        g->gl->VertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, 0, NULL);
    }
}

void glossy_draw(const glossy *g, const glossy_view *view, int width, int height)
{
    const gl_functions *const gl = g->gl;
    float view_projection[16], eye[3];
    camera_matrix(&view->eye, (double)width / height, view_projection, eye);
    gl->Viewport(0, 0, width, height);
    gl->Clear(GL_DEPTH_BUFFER_BIT);
    backdrop_draw(&g->behind, view->background);
    gl->UseProgram(g->program);
    gl->ActiveTexture(GL_TEXTURE0);
    gl->BindTexture(GL_TEXTURE_CUBE_MAP, g->environment);
    gl->Uniform1i(gl->GetUniformLocation(g->program, "sss_environment"), 0);
    gl->UniformMatrix4fv(gl->GetUniformLocation(g->program, "view_projection"), 1, GL_FALSE, view_projection);
    gl->Uniform3fv(gl->GetUniformLocation(g->program, "eye"), 1, eye);
    gl->Uniform1f(gl->GetUniformLocation(g->program, "studio"), (float)view->studio);
    gl->Uniform1f(gl->GetUniformLocation(g->program, "sss_exposure"), (float)view->exposure);
    gl->BindVertexArray(g->vertex_array);
    gl->DrawElements(GL_TRIANGLES, g->index_count, GL_UNSIGNED_INT, NULL);
}
