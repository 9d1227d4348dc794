#include "hao_view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../sss_dipole.h"
#include "backdrop.h"
#include "label.h"

enum
{
    PANELS = 5,                 // three views, two differences
    MAGNIFIED = 10,             // differences
    NORMALS = HAO_VIEWS,        // buffers: radiosities come first,
    POSITIONS, TRIANGLES, BUFFERS,
    WORDS = 0, REFERENCES,      // textures: of sss_hao_glsl
    TEXTURES,
    PATH = 40                   // dots of the light's way round
};

static const double PI = 3.14159265358979323846;
static const double CAPTION = 0.30; // of a panel: height of what is below it
static const double LINE = 0.075;   // of a panel, from line to line of a caption,
static const double LETTER = 0.036; // and its capitals
static const double BACKGROUND[2][3] = {{0.05, 0.05, 0.055}, {0.11, 0.115, 0.13}};

static const float PAPER[3] = {0.055f, 0.053f, 0.050f};
static const float INK[3] = {0.91f, 0.886f, 0.847f}, FAINT[3] = {0.56f, 0.533f, 0.50f}, SUN[3] = {1.0f, 0.86f, 0.5f};

struct hao_view
{
    const gl_context *context;
    const gl_functions *gl;
    backdrop behind;
    label text;
    sss_profile profile;
    GLuint programs[2]; // radiosity from a buffer, or from sss_hao_glsl (0 until it is needed)
    GLuint vertex_arrays[HAO_VIEWS], buffers[BUFFERS], textures[TEXTURES];
    GLsizei index_count;
    size_t vertex_count;
    float *references; // [rows][SSS_HAO_TEXTURE_WIDTH][4], for the shader
    GLsizei reference_rows;
    int by_shader; // the view with reference points
};

// ---- shaders ----

static const char vertex_shader[] =
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec3 normal;\n"
    "layout(location = 2) in vec3 radiosity;\n"
    "layout(location = 3) in vec3 uncompressed;\n"
    "uniform mat4 view_projection;\n"
    "out vec3 at, n, B, B_exact;\n"
    "void main()\n"
    "{\n"
    "    at = position;\n"
    "    n = normal;\n"
    "    B_exact = uncompressed;\n"
    "#ifdef BY_SHADER\n"
    "    B = sss_hao_radiosity(gl_VertexID);\n"
    "#else\n"
    "    B = radiosity;\n"
    "#endif\n"
    "    gl_Position = view_projection * vec4(position, 1.0);\n"
    "}\n";

// A difference is one of pictures: of what the screen shows, in [0,1]. Reflections are the same in both.
static const char fragment_shader[] =
    "in vec3 at, n, B, B_exact;\n"
    "uniform vec3 eye;\n"
    "uniform float magnified;\n" // 0: shows B itself
    "out vec4 color;\n"
    "const float PI = 3.14159265;\n"
    "float lamp(vec3 d, vec3 to_lamp, float cos_edge)\n"
    "{\n"
    "    return smoothstep(cos_edge, mix(cos_edge, 1.0, 0.3), dot(d, normalize(to_lamp)));\n"
    "}\n"
    "float studio(vec3 d)\n" // a dark room, lighter above, with two soft boxes
    "{\n"
    "    float up = 0.5 + 0.5*d.y;\n"
    "    return 0.02 + 0.1*up*up + 0.7*lamp(d, vec3(-0.8, 0.7, 0.6), 0.86) + 0.3*lamp(d, vec3(1.0, 0.35, 0.1), 0.93);\n"
    "}\n"
    "vec3 shown(vec3 radiosity, float n_v, float reflected)\n"
    "{\n"
    "    return sss_tone_map(sss_exit_factor(n_v)/PI * max(radiosity, 0.0) + reflected/sss_exposure);\n"
    "}\n"
    "void main()\n"
    "{\n"
    "    vec3 V = normalize(eye - at), N = normalize(gl_FrontFacing ? n : -n);\n"
    // Interpolated normals may face away at the outline; there the surface is seen at a grazing angle.
    "    float n_v = clamp(dot(N, V), 0.02, 1.0), mirror = sss_fresnel(n_v, sss_eta)*studio(reflect(-V, N));\n"
    "    color = vec4(magnified > 0.0 ? magnified*abs(shown(B, n_v, mirror) - shown(B_exact, n_v, mirror))\n"
    "                                 : shown(B, n_v, mirror), 1.0);\n"
    "}\n";

static GLuint build_program(const hao_view *v, int by_shader, char *error_text, size_t error_size)
{
    const char *const vertex[] = {by_shader ? "#define BY_SHADER\n" : "\n",
                                  by_shader ? sss_hao_glsl(SSS_HAO_GLSL_RADIOSITY) : "\n", vertex_shader};
    const char *const fragment[] = {sss_dipole_glsl(SSS_DIPOLE_GLSL_FRESNEL), sss_dipole_glsl(SSS_DIPOLE_GLSL_PROFILE),
                                    sss_dipole_glsl(SSS_DIPOLE_GLSL_TONE_MAPPING), fragment_shader};
    const GLuint program = gl_context_program(v->context, gl_context_version_line(v->context), vertex, 3, fragment, 4,
                                              error_text, error_size);
    sss_dipole_glsl_uniforms u;
    if (program && sss_dipole_get_glsl_uniforms(&v->profile, SSS_DIPOLE_EXIT_PAPER, &u) == SSS_OK)
    {
        v->gl->UseProgram(program);
        v->gl->Uniform1f(v->gl->GetUniformLocation(program, "sss_eta"), u.eta);
        v->gl->Uniform1f(v->gl->GetUniformLocation(program, "sss_exit_scale"), u.exit_scale);
    }
    return program;
}

// ---- the object ----

static void upload(const hao_view *v, int buffer, const float *values)
{
    v->gl->BindBuffer(GL_ARRAY_BUFFER, v->buffers[buffer]);
    v->gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(3 * v->vertex_count * sizeof *values), values, GL_DYNAMIC_DRAW);
}

static void upload_model(hao_view *v, const model *m)
{
    v->vertex_count = m->vertex_count;
    v->index_count = (GLsizei)(3 * m->triangle_count);
    v->gl->GenVertexArrays(HAO_VIEWS, v->vertex_arrays);
    v->gl->GenBuffers(BUFFERS, v->buffers);
    v->gl->GenTextures(TEXTURES, v->textures);
    upload(v, POSITIONS, m->positions);
    upload(v, NORMALS, m->normals);
    for (int view = 0; view < HAO_VIEWS; ++view)
    {
        const int attributes[4] = {POSITIONS, NORMALS, view, HAO_VIEW_FLOAT};
        upload(v, view, NULL);
        v->gl->BindVertexArray(v->vertex_arrays[view]);
        for (GLuint i = 0; i < 4; ++i)
        {
            v->gl->BindBuffer(GL_ARRAY_BUFFER, v->buffers[attributes[i]]);
            v->gl->EnableVertexAttribArray(i);
            v->gl->VertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, 0, NULL);
        }
        v->gl->BindBuffer(GL_ELEMENT_ARRAY_BUFFER, v->buffers[TRIANGLES]);
    }
    v->gl->BufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(3 * m->triangle_count * sizeof *m->triangles),
                      m->triangles, GL_STATIC_DRAW);
}

hao_view *hao_view_create(gl_context *context, const model *m, const sss_profile *profile, char *error_text,
                          size_t error_size)
{
    hao_view *const v = calloc(1, sizeof *v);
    if (!v)
    {
        snprintf(error_text, error_size, "out of memory");
        return NULL;
    }
    v->context = context;
    v->gl = gl_context_functions(context);
    v->profile = *profile;
    v->programs[0] = build_program(v, 0, error_text, error_size);
    if (!v->programs[0] || backdrop_create(context, &v->behind, error_text, error_size) != 0 ||
        label_create(context, &v->text, error_text, error_size) != 0)
    {
        hao_view_free(v);
        return NULL;
    }
    upload_model(v, m);
    if (v->gl->GetError() != GL_NO_ERROR)
    {
        snprintf(error_text, error_size, "OpenGL does not take the mesh: too large?");
        hao_view_free(v);
        return NULL;
    }
    return v;
}

void hao_view_free(hao_view *v)
{
    if (v)
    {
        for (int i = 0; i < 2; ++i)
        {
            v->gl->DeleteProgram(v->programs[i]);
        }
        backdrop_free(&v->behind);
        label_free(&v->text);
        v->gl->DeleteVertexArrays(HAO_VIEWS, v->vertex_arrays);
        v->gl->DeleteBuffers(BUFFERS, v->buffers);
        v->gl->DeleteTextures(TEXTURES, v->textures);
        free(v->references);
        free(v);
    }
}

void hao_view_set_radiosity(hao_view *v, int view, const float *radiosity)
{
    v->by_shader = view == HAO_VIEW_REFERENCES ? 0 : v->by_shader;
    upload(v, view, radiosity);
}

// ---- by the vertex shader ----

static void set_texture(const hao_view *v, int texture, GLint internal, GLsizei height, GLenum format, GLenum type,
                        const void *texels)
{
    v->gl->ActiveTexture(GL_TEXTURE0 + (GLuint)texture);
    v->gl->BindTexture(GL_TEXTURE_2D, v->textures[texture]);
    v->gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    v->gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    v->gl->TexImage2D(GL_TEXTURE_2D, 0, internal, SSS_HAO_TEXTURE_WIDTH, height, 0, format, type, texels);
}

static int fail(const hao_view *v, sss_result result, char *error_text, size_t error_size)
{
    const int refused = v->gl->GetError() != GL_NO_ERROR;
    snprintf(error_text, error_size, "the vertex shader's data: %s",
             refused ? "OpenGL does not take it: too large?" : sss_result_string(result));
    return refused || result != SSS_OK ? -1 : 0;
}

int hao_view_set_object(hao_view *v, const sss_hao *hao, char *error_text, size_t error_size)
{
    size_t height = 0;
    sss_hao_stats stats;
    sss_result result = sss_hao_get_stats(hao, &stats);
    result = result == SSS_OK ? sss_hao_get_texture(hao, NULL, &height) : result;
    if (result != SSS_OK)
    {
        return fail(v, result, error_text, error_size);
    }
    uint32_t *const words = malloc(SSS_HAO_TEXTURE_WIDTH * height * sizeof *words);
    v->reference_rows = (GLsizei)((stats.reference_count + SSS_HAO_TEXTURE_WIDTH - 1) / SSS_HAO_TEXTURE_WIDTH);
    free(v->references);
    v->references = calloc(4 * SSS_HAO_TEXTURE_WIDTH * (size_t)v->reference_rows, sizeof *v->references);
    result = words && v->references ? sss_hao_get_texture(hao, words, &height) : SSS_ERROR_OUT_OF_MEMORY;
    if (result == SSS_OK)
    {
        set_texture(v, WORDS, GL_R32UI, (GLsizei)height, GL_RED_INTEGER, GL_UNSIGNED_INT, words);
    }
    free(words);
    if (fail(v, result, error_text, error_size) != 0)
    {
        return -1;
    }
    v->programs[1] = v->programs[1] ? v->programs[1] : build_program(v, 1, error_text, error_size);
    return v->programs[1] ? 0 : -1;
}

int hao_view_set_lighting(hao_view *v, const sss_hao *hao, const float *lighting, char *error_text, size_t error_size)
{
    const gl_functions *const gl = v->gl;
    const GLuint program = v->programs[1];
    sss_hao_uniforms u;
    sss_result result = sss_hao_relight_references(hao, lighting, v->references);
    result = result == SSS_OK ? sss_hao_get_uniforms(hao, lighting, &u) : result;
    if (result == SSS_OK)
    {
        set_texture(v, REFERENCES, GL_RGBA32F, v->reference_rows, GL_RGBA, GL_FLOAT, v->references);
        gl->UseProgram(program);
        gl->Uniform1i(gl->GetUniformLocation(program, "sss_hao_texture"), WORDS);
        gl->Uniform1i(gl->GetUniformLocation(program, "sss_hao_references"), REFERENCES);
        gl->Uniform4iv(gl->GetUniformLocation(program, "sss_hao_layout"), 1, u.layout);
        gl->Uniform4fv(gl->GetUniformLocation(program, "sss_hao_harmonics"), 64, u.harmonics[0]);
        gl->Uniform4fv(gl->GetUniformLocation(program, "sss_hao_bias"), 1, u.bias);
    }
    v->by_shader = result == SSS_OK;
    return fail(v, result, error_text, error_size);
}

// ---- what views differ by ----

double hao_view_difference(const float *a, const float *b, size_t count)
{
    double off = 0.0, all = 0.0;
    for (size_t i = 0; i < count; ++i)
    {
        const double d = (double)a[i] - (double)b[i];
        off += d * d;
        all += (double)b[i] * (double)b[i];
    }
    return all > 0.0 ? sqrt(off / all) : 0.0;
}

// ---- drawing ----

static void draw_object(const hao_view *v, const hao_look *look, int view, double magnified)
{
    const gl_functions *const gl = v->gl;
    const GLuint program = v->programs[v->by_shader && view == HAO_VIEW_REFERENCES];
    float view_projection[16], eye[3];
    camera_matrix(&look->eye, 1.0, view_projection, eye);
    gl->UseProgram(program);
    gl->UniformMatrix4fv(gl->GetUniformLocation(program, "view_projection"), 1, GL_FALSE, view_projection);
    gl->Uniform3fv(gl->GetUniformLocation(program, "eye"), 1, eye);
    gl->Uniform1f(gl->GetUniformLocation(program, "sss_exposure"), (float)look->exposure);
    gl->Uniform1f(gl->GetUniformLocation(program, "magnified"), (float)magnified);
    for (GLuint i = 0; i < TEXTURES; ++i)
    {
        gl->ActiveTexture(GL_TEXTURE0 + i);
        gl->BindTexture(GL_TEXTURE_2D, v->textures[i]);
    }
    gl->BindVertexArray(v->vertex_arrays[view]);
    gl->DrawElements(GL_TRIANGLES, v->index_count, GL_UNSIGNED_INT, NULL);
}

// A panel's lower left corner; what it shows, in the order in which panels stand.
typedef struct panel
{
    double x, y, side;
    int view, is_difference;
} panel;

static void draw_panel(const hao_view *v, const hao_look *look, const panel *p)
{
    const double low[2] = {p->x, p->y}, high[2] = {p->x + p->side, p->y + p->side};
    if (p->is_difference)
    {
        label_box(&v->text, low, high, PAPER);
    }
    v->gl->Viewport((int)p->x, (int)p->y, (int)p->side, (int)p->side);
    if (!p->is_difference)
    {
        backdrop_draw(&v->behind, BACKGROUND);
    }
    draw_object(v, look, p->view, p->is_difference ? MAGNIFIED : 0.0);
}

// The light's way round the object as the camera sees it, and where it is on it.
static void draw_path(const label *text, const hao_look *look, const panel *p)
{
    const double a = look->eye.azimuth * PI / 180.0, e = look->eye.elevation * PI / 180.0;
    const double right[3] = {cos(a), 0.0, -sin(a)}, up[3] = {-sin(e) * sin(a), cos(e), -sin(e) * cos(a)};
    const double level = hypot(look->to_light[0], look->to_light[2]), radius = 0.09 * p->side;
    for (int i = 0; i <= PATH; ++i)
    {
        const double phi = 2.0 * PI * i / PATH, size = (i == PATH ? 0.012 : 0.0035) * p->side;
        const double around[3] = {level * sin(phi), look->to_light[1], level * cos(phi)};
        const double *const d = i == PATH ? look->to_light : around;
        const double x = p->x + 0.13 * p->side + radius * (d[0] * right[0] + d[1] * right[1] + d[2] * right[2]);
        const double y = p->y + 0.10 * p->side + radius * (d[0] * up[0] + d[1] * up[1] + d[2] * up[2]);
        const double low[2] = {x - size, y - size}, high[2] = {x + size, y + size};
        label_box(text, low, high, i == PATH ? SUN : FAINT);
    }
}

static void describe(const hao_view *v, const hao_look *look, const panel *p, char lines[3][64])
{
    static const char *const names[HAO_VIEWS] = {"uncompressed", "harmonics alone", "reference points"};
    const int by_shader = v->by_shader && p->view == HAO_VIEW_REFERENCES;
    memset(lines, 0, 3 * sizeof lines[0]);
    if (p->is_difference)
    {
        snprintf(lines[0], sizeof lines[0], "difference x %d", MAGNIFIED);
        if (isfinite(look->error[p->view]))
        {
            snprintf(lines[1], sizeof lines[1], "radiosity %.2f %% off", 100.0 * look->error[p->view]);
        }
        return;
    }
    snprintf(lines[0], sizeof lines[0], "%s%s", names[p->view], by_shader ? ", GLSL" : "");
    snprintf(lines[1], sizeof lines[1], "%.*f bytes a vertex", look->bytes[p->view] < 100.0 ? 1 : 0,
             look->bytes[p->view]);
    snprintf(lines[2], sizeof lines[2], by_shader ? "%.2f ms + vertex shader" : "%.2f ms to relight",
             look->ms[p->view]);
}

static void draw_caption(const hao_view *v, const label *text, const hao_look *look, const panel *p)
{
    char lines[3][64];
    describe(v, look, p, lines);
    for (int i = 0; i < 3; ++i)
    {
        const double at[2] = {p->x + 0.04 * p->side, p->y - LINE * p->side * (i + 1)};
        label_text(text, at, LETTER * p->side, -1, i == 0 ? INK : FAINT, lines[i]);
    }
}

int hao_view_height(int width)
{
    return (int)(width * (1.0 + CAPTION) / PANELS);
}

// Each difference stands below what it is of, or behind all views.
void hao_view_draw(const hao_view *v, const hao_look *look, int width, int height)
{
    static const int views[PANELS] = {HAO_VIEW_FLOAT, HAO_VIEW_HARMONICS, HAO_VIEW_REFERENCES, HAO_VIEW_HARMONICS,
                                      HAO_VIEW_REFERENCES};
    label text = v->text;
    const int wide = width > 2 * height, columns = wide ? PANELS : HAO_VIEWS, rows = wide ? 1 : 2;
    const double side = floor(fmin((double)width / columns, height / (rows * (1.0 + CAPTION))));
    const double left = floor(0.5 * (width - columns * side)), zero[2] = {0.0, 0.0}, all[2] = {width, height};
    v->gl->Clear(GL_DEPTH_BUFFER_BIT);
    label_begin(&text, width, height);
    label_box(&text, zero, all, PAPER);
    for (int i = 0; i < PANELS; ++i)
    {
        const int is_difference = i >= HAO_VIEWS, row = !wide && is_difference;
        const panel p = {left + side * (wide ? i : views[i]), floor(height - (row + 1) * side - row * CAPTION * side),
                         side, views[i], is_difference};
        label_begin(&text, width, height);
        draw_panel(v, look, &p);
        label_begin(&text, width, height);
        draw_caption(v, &text, look, &p);
        if (i == 0)
        {
            draw_path(&text, look, &p);
        }
    }
    for (int i = 0; i < (wide ? 1 : HAO_LINES); ++i)
    {
        const double at[2] = {left + (wide ? 4.04 : 0.04) * side,
                              wide ? (CAPTION - 3.0 * LINE) * side : (CAPTION + 0.6 - LINE * i) * side};
        label_text(&text, at, LETTER * side, -1, FAINT, look->heading[i]);
    }
}
