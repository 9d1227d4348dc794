#include "atlas_view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "atlas_report.h"
#include "label.h"

enum
{
    SQUARES = 32,    // of the checker along the atlas,
    RINGS = 64,      // by which textures are filled beyond their texels: mipmaps stay clean
    SEAM_FLOATS = 8, // of a corner of a seam's quad: both ends, which of them, which side
    TICKS = 5        // of the legend
};

static const double CAPTION = 0.12;    // of a panel: height of what is below the panels,
static const double MARGIN = 0.03;     // and what stays free around an atlas
static const double SEAM_WIDTH = 0.0034; // of a panel
static const double MOST_STRETCH = 2.0; // where the colours end, both ways

static const float PAPER[3] = {0.055f, 0.053f, 0.050f}, PANEL[3] = {0.115f, 0.113f, 0.110f};
static const float INK[3] = {0.91f, 0.886f, 0.847f}, FAINT[3] = {0.56f, 0.533f, 0.50f};

struct atlas_view
{
    const gl_context *context;
    const gl_functions *gl;
    label text;
    GLuint surface, seams;              // programs
    GLuint vertex_array, buffers[4];    // positions, normals, texture coordinates, triangles
    GLuint seam_array, seam_buffer, textures[ATLAS_VIEW_TEXTURES];
    GLsizei index_count, seam_count;
    char caption[256];
};

// ---- shaders ----

static const char surface_vertex_shader[] =
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec3 normal;\n"
    "layout(location = 2) in vec2 uv;\n"
    "uniform mat4 view_projection;\n"
    "uniform float flat_view, margin;\n" // flat_view: 1 draws the atlas itself
    "out vec3 at, n;\n"
    "out vec2 place;\n"
    "void main()\n"
    "{\n"
    "    at = position;\n"
    "    n = normal;\n"
    "    place = uv;\n"
    "    vec4 laid = sss_atlas_place(uv);\n"
    "    laid.xy *= 1.0 - 2.0*margin;\n"
    "    gl_Position = flat_view > 0.5 ? laid : view_projection * vec4(position, 1.0);\n"
    "}\n";

static const char surface_fragment_shader[] =
    "in vec3 at, n;\n"
    "in vec2 place;\n"
    "uniform sampler2D image;\n"
    "uniform vec3 eye;\n"
    "uniform float flat_view;\n"
    "out vec4 color;\n"
    "void main()\n"
    "{\n"
    // Light from beside the eye, soft, so that colours stay comparable and the shape is seen.
    "    vec3 V = normalize(eye - at), L = normalize(V + vec3(-0.25, 0.45, 0.0));\n"
    "    vec3 N = normalize(gl_FrontFacing ? n : -n);\n"
    "    float lit = mix(0.42, 1.0, smoothstep(-0.2, 1.0, dot(N, L)));\n"
    "    color = vec4(texture(image, place).rgb * mix(lit, 1.0, flat_view), 1.0);\n"
    "}\n";

// Lines of one width however near they are: OpenGL's own have one pixel.
static const char seam_vertex_shader[] =
    "layout(location = 0) in vec3 from;\n"
    "layout(location = 1) in vec3 to;\n"
    "layout(location = 2) in vec2 corner;\n" // 0 or 1 along the seam, -1 or 1 across it
    "uniform mat4 view_projection;\n"
    "uniform float width;\n" // of the panel's
    "void main()\n"
    "{\n"
    "    vec4 a = view_projection * vec4(from, 1.0), b = view_projection * vec4(to, 1.0);\n"
    "    vec2 way = b.xy/b.w - a.xy/a.w;\n"
    "    vec2 along = width * way / max(length(way), 1e-9);\n"
    "    vec4 p = mix(a, b, corner.x);\n"
    "    p.xy += ((corner.x - 0.5)*along + corner.y*vec2(-along.y, along.x)) * p.w;\n"
    "    p.z -= 1e-3 * p.w;\n" // before the surface that it lies in
    "    gl_Position = p;\n"
    "}\n";

static const char seam_fragment_shader[] =
    "out vec4 color;\n"
    "void main()\n"
    "{\n"
    "    color = vec4(0.05, 0.05, 0.05, 1.0);\n"
    "}\n";

static int build_programs(atlas_view *v, char *error_text, size_t error_size)
{
    const char *const version = gl_context_version_line(v->context);
    const char *const surface_vertex[] = {sss_atlas_glsl(SSS_ATLAS_GLSL_PLACE), surface_vertex_shader};
    const char *const surface_fragment[] = {surface_fragment_shader};
    const char *const seam_vertex[] = {seam_vertex_shader}, *const seam_fragment[] = {seam_fragment_shader};
    v->surface = gl_context_program(v->context, version, surface_vertex, 2, surface_fragment, 1, error_text,
                                    error_size);
    v->seams = v->surface ? gl_context_program(v->context, version, seam_vertex, 1, seam_fragment, 1, error_text,
                                               error_size) : 0;
    return v->seams ? label_create(v->context, &v->text, error_text, error_size) : -1;
}

// ---- colours ----

static void chart_color(uint32_t chart, int light, float out[3])
{
    const double hue = 6.0 * fmod(0.61803398875 * chart, 1.0); // multiples of the golden section lie far apart
    const double depth = 0.30 + 0.06 * (chart % 3);            // and those that do not differ in this
    for (int k = 0; k < 3; ++k)
    {
        const double h = fmod(hue + 4.0 * k, 6.0), ramp = fmin(1.0, fmax(0.0, fabs(h - 3.0) - 1.0));
        out[k] = (float)((light ? 0.97 : 0.66 - 0.4 * depth + 0.12) - (light ? 0.9 : 1.0) * depth * (1.0 - ramp));
    }
}

// From blue, where texels are small on the surface, over white, where they are as large as on the average, to red.
static void stretch_color(double stretch, float out[3])
{
    static const double fine[3] = {0.10, 0.32, 0.68}, even[3] = {0.93, 0.92, 0.88}, coarse[3] = {0.76, 0.12, 0.13};
    const double log_ratio = stretch > 0.0 ? log(stretch) / log(MOST_STRETCH) : -1.0;
    const double t = fmin(1.0, fabs(log_ratio)); // 1 also for no texture at all, whose stretch is infinite
    const double *const end = log_ratio < 0.0 ? fine : coarse;
    for (int k = 0; k < 3; ++k)
    {
        out[k] = (float)(even[k] + (end[k] - even[k]) * pow(t, 0.65));
    }
}

static void color_texels(const sss_atlas_mesh *mesh, const sss_atlas_texels *texels, int texture, float *out)
{
    const size_t square = texels->size > SQUARES ? texels->size / SQUARES : 1;
    for (size_t i = 0; i < texels->count; ++i)
    {
        const uint32_t triangle = texels->triangle[i];
        const size_t u = texels->texel[i] % texels->size, v = texels->texel[i] / texels->size;
        if (texture == ATLAS_VIEW_CHECKER)
        {
            chart_color(mesh->chart[triangle], (u / square + v / square) % 2 == 0, out + 3 * i);
        }
        else
        {
            stretch_color((double)mesh->stretch[triangle], out + 3 * i);
        }
    }
}

// ---- uploading ----

static void upload_texture(const atlas_view *v, int texture, size_t size, const float *image)
{
    const gl_functions *const gl = v->gl;
    gl->BindTexture(GL_TEXTURE_2D, v->textures[texture]);
    gl->TexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, (GLsizei)size, (GLsizei)size, 0, GL_RGB, GL_FLOAT, image);
    gl->GenerateMipmap(GL_TEXTURE_2D);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

static int make_textures(const atlas_view *v, const sss_atlas *atlas, const sss_atlas_mesh *mesh)
{
    sss_atlas_texels texels;
    sss_result result = sss_atlas_get_texels(atlas, &texels);
    float *const values = malloc((3 * texels.count + 1) * sizeof *values);
    float *const image = malloc(3 * texels.size * texels.size * sizeof *image);
    result = values && image ? result : SSS_ERROR_OUT_OF_MEMORY;
    for (int i = 0; i < ATLAS_VIEW_TEXTURES && result == SSS_OK; ++i)
    {
        color_texels(mesh, &texels, i, values);
        result = sss_atlas_fill_image(atlas, values, 3, RINGS, image);
        if (result == SSS_OK)
        {
            upload_texture(v, i, texels.size, image);
        }
    }
    free(values);
    free(image);
    return result == SSS_OK ? 0 : -1;
}

static void upload_vertices(const atlas_view *v, GLuint attribute, GLint width, size_t count, const float *values)
{
    v->gl->BindBuffer(GL_ARRAY_BUFFER, v->buffers[attribute]);
    v->gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(count * (size_t)width * sizeof *values), values, GL_STATIC_DRAW);
    v->gl->EnableVertexAttribArray(attribute);
    v->gl->VertexAttribPointer(attribute, width, GL_FLOAT, GL_FALSE, 0, NULL);
}

// Positions and normals go with the vertices of the atlas.
static int upload_mesh(atlas_view *v, const model *m, const sss_atlas_mesh *mesh)
{
    float *const positions = malloc(6 * mesh->vertex_count * sizeof *positions);
    if (!positions)
    {
        return -1;
    }
    float *const normals = positions + 3 * mesh->vertex_count;
    for (size_t i = 0; i < mesh->vertex_count; ++i)
    {
        memcpy(positions + 3 * i, m->positions + 3 * (size_t)mesh->vertex[i], 3 * sizeof *positions);
        memcpy(normals + 3 * i, m->normals + 3 * (size_t)mesh->vertex[i], 3 * sizeof *normals);
    }
    v->gl->BindVertexArray(v->vertex_array);
    upload_vertices(v, 0, 3, mesh->vertex_count, positions);
    upload_vertices(v, 1, 3, mesh->vertex_count, normals);
    upload_vertices(v, 2, 2, mesh->vertex_count, mesh->uv);
    v->gl->BindBuffer(GL_ELEMENT_ARRAY_BUFFER, v->buffers[3]);
    v->gl->BufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(3 * mesh->triangle_count * sizeof *mesh->triangles),
                      mesh->triangles, GL_STATIC_DRAW);
    v->index_count = (GLsizei)(3 * mesh->triangle_count);
    free(positions);
    return 0;
}

// ---- seams ----

static uint64_t edge_of(const sss_atlas_mesh *mesh, size_t corner, int turned)
{
    const size_t next = corner % 3 == 2 ? corner - 2 : corner + 1;
    const uint64_t from = mesh->triangles[turned ? next : corner], to = mesh->triangles[turned ? corner : next];
    return from << 32 | to;
}

static int ascending(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

// Two triangles of a quad along an edge.
static void write_seam(const model *m, const sss_atlas_mesh *mesh, uint64_t edge, float *out)
{
    static const float corners[6][2] = {{0, -1}, {1, -1}, {1, 1}, {0, -1}, {1, 1}, {0, 1}};
    const float *const from = m->positions + 3 * (size_t)mesh->vertex[edge >> 32];
    const float *const to = m->positions + 3 * (size_t)mesh->vertex[edge & 0xffffffffu];
    for (int i = 0; i < 6; ++i)
    {
        memcpy(out + SEAM_FLOATS * i, from, 3 * sizeof *out);
        memcpy(out + SEAM_FLOATS * i + 3, to, 3 * sizeof *out);
        memcpy(out + SEAM_FLOATS * i + 6, corners[i], 2 * sizeof *out);
    }
}

// A seam is an edge that no other triangle of the atlas runs along the other way.
static int upload_seams(atlas_view *v, const model *m, const sss_atlas_mesh *mesh)
{
    const size_t count = 3 * mesh->triangle_count;
    uint64_t *const edges = malloc(count * sizeof *edges);
    size_t seams = 0;
    for (size_t i = 0; i < count && edges; ++i)
    {
        edges[i] = edge_of(mesh, i, 0);
    }
    if (edges)
    {
        qsort(edges, count, sizeof *edges, ascending);
    }
    float *quads = NULL;
    for (int pass = 0; pass < 2 && edges; ++pass) // counts, then writes
    {
        quads = pass ? malloc((6 * SEAM_FLOATS * seams + 1) * sizeof *quads) : NULL;
        seams = 0;
        for (size_t i = 0; i < count && (quads || pass == 0); ++i)
        {
            const uint64_t other = edge_of(mesh, i, 1);
            if (!bsearch(&other, edges, count, sizeof *edges, ascending))
            {
                if (quads)
                {
                    write_seam(m, mesh, edge_of(mesh, i, 0), quads + 6 * SEAM_FLOATS * seams);
                }
                ++seams;
            }
        }
    }
    free(edges);
    if (!quads)
    {
        return -1;
    }
    const GLsizei stride = SEAM_FLOATS * sizeof *quads;
    v->seam_count = (GLsizei)(6 * seams);
    v->gl->BindVertexArray(v->seam_array);
    v->gl->BindBuffer(GL_ARRAY_BUFFER, v->seam_buffer);
    v->gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(6 * seams * (size_t)stride), quads, GL_STATIC_DRAW);
    for (GLuint i = 0; i < 3; ++i)
    {
        v->gl->EnableVertexAttribArray(i);
        v->gl->VertexAttribPointer(i, i < 2 ? 3 : 2, GL_FLOAT, GL_FALSE, stride,
                                   (const char *)NULL + 3 * i * sizeof *quads);
    }
    free(quads);
    return 0;
}

// ---- the object ----

atlas_view *atlas_view_create(gl_context *context, char *error_text, size_t error_size)
{
    atlas_view *const v = calloc(1, sizeof *v);
    if (!v)
    {
        snprintf(error_text, error_size, "out of memory");
        return NULL;
    }
    v->context = context;
    v->gl = gl_context_functions(context);
    if (build_programs(v, error_text, error_size) != 0)
    {
        atlas_view_free(v);
        return NULL;
    }
    v->gl->GenVertexArrays(1, &v->vertex_array);
    v->gl->GenVertexArrays(1, &v->seam_array);
    v->gl->GenBuffers(4, v->buffers);
    v->gl->GenBuffers(1, &v->seam_buffer);
    v->gl->GenTextures(ATLAS_VIEW_TEXTURES, v->textures);
    return v;
}

void atlas_view_free(atlas_view *v)
{
    if (v)
    {
        label_free(&v->text);
        v->gl->DeleteProgram(v->surface);
        v->gl->DeleteProgram(v->seams);
        v->gl->DeleteVertexArrays(1, &v->vertex_array);
        v->gl->DeleteVertexArrays(1, &v->seam_array);
        v->gl->DeleteBuffers(4, v->buffers);
        v->gl->DeleteBuffers(1, &v->seam_buffer);
        v->gl->DeleteTextures(ATLAS_VIEW_TEXTURES, v->textures);
        free(v);
    }
}

int atlas_view_set(atlas_view *v, const model *m, const sss_atlas *atlas, char *error_text, size_t error_size)
{
    sss_atlas_mesh mesh;
    sss_atlas_stats s;
    if (sss_atlas_get_mesh(atlas, &mesh) != SSS_OK || sss_atlas_get_stats(atlas, &s) != SSS_OK ||
        upload_mesh(v, m, &mesh) != 0 || upload_seams(v, m, &mesh) != 0 || make_textures(v, atlas, &mesh) != 0)
    {
        snprintf(error_text, error_size, "the mesh and its atlas: out of memory");
        return -1;
    }
    if (v->gl->GetError() != GL_NO_ERROR)
    {
        snprintf(error_text, error_size, "OpenGL does not take the atlas: too large?");
        return -1;
    }
    snprintf(v->caption, sizeof v->caption, "%s: %zu charts, %.0f %% used, stretch %.3f", atlas_method_name(s.method),
             s.chart_count, 100.0 * s.utilisation, s.stretch_l2);
    return 0;
}

// ---- drawing ----

static void draw_surface(const atlas_view *v, const camera *eye, int texture, int flat_view)
{
    const gl_functions *const gl = v->gl;
    float view_projection[16], from[3];
    camera_matrix(eye, 1.0, view_projection, from);
    gl->UseProgram(v->surface);
    gl->ActiveTexture(GL_TEXTURE0);
    gl->BindTexture(GL_TEXTURE_2D, v->textures[texture]);
    gl->Uniform1i(gl->GetUniformLocation(v->surface, "image"), 0);
    gl->Uniform1f(gl->GetUniformLocation(v->surface, "flat_view"), (float)flat_view);
    gl->Uniform1f(gl->GetUniformLocation(v->surface, "margin"), (float)MARGIN);
    gl->Uniform3fv(gl->GetUniformLocation(v->surface, "eye"), 1, from);
    gl->UniformMatrix4fv(gl->GetUniformLocation(v->surface, "view_projection"), 1, GL_FALSE, view_projection);
    gl->BindVertexArray(v->vertex_array);
    gl->DrawElements(GL_TRIANGLES, v->index_count, GL_UNSIGNED_INT, NULL);
    if (!flat_view)
    {
        gl->UseProgram(v->seams);
        gl->Uniform1f(gl->GetUniformLocation(v->seams, "width"), (float)SEAM_WIDTH);
        gl->UniformMatrix4fv(gl->GetUniformLocation(v->seams, "view_projection"), 1, GL_FALSE, view_projection);
        gl->BindVertexArray(v->seam_array);
        gl->DrawArrays(GL_TRIANGLES, 0, v->seam_count);
    }
}

// A bar of the colours with its ticks; `low` is its lower left corner, below the ticks' numbers.
static void draw_legend(const label *text, const double low[2], double width, double height)
{
    static const char *const names[TICKS] = {"1/2", "1/1.4", "1", "1.4", "2"};
    const int steps = 120;
    for (int i = 0; i < steps; ++i)
    {
        const double from[2] = {low[0] + width * i / steps, low[1]};
        const double to[2] = {low[0] + width * (i + 1) / steps, low[1] + height};
        float color[3];
        stretch_color(pow(MOST_STRETCH, 2.0 * (i + 0.5) / steps - 1.0), color);
        label_box(text, from, to, color);
    }
    for (int i = 0; i < TICKS; ++i)
    {
        const double at[2] = {low[0] + width * i / (TICKS - 1), low[1] - 1.1 * height};
        label_text(text, at, 0.8 * height, 0, FAINT, names[i]);
    }
}

int atlas_view_height(int width)
{
    return (int)(0.25 * width * (1.0 + CAPTION));
}

void atlas_view_draw(const atlas_view *v, const camera *eye, int width, int height)
{
    const gl_functions *const gl = v->gl;
    label text = v->text;
    const int columns = width > 2 * height ? 4 : 2, rows = 4 / columns;
    const double panel = fmin((double)width / columns, height / (rows + CAPTION)), strip = CAPTION * panel;
    const double left = 0.5 * (width - columns * panel), zero[2] = {0.0, 0.0}, all[2] = {width, height};
    gl->Clear(GL_DEPTH_BUFFER_BIT);
    label_begin(&text, width, height);
    label_box(&text, zero, all, PAPER);
    for (int i = 0; i < 4; ++i)
    {
        const double x = left + panel * (i % columns), y = strip + panel * (rows - 1 - i / columns);
        if (i % 2)
        {
            const double low[2] = {x + MARGIN * panel, y + MARGIN * panel};
            const double high[2] = {x + (1.0 - MARGIN) * panel, y + (1.0 - MARGIN) * panel};
            label_box(&text, low, high, PANEL);
        }
        gl->Viewport((int)x, (int)y, (int)panel, (int)panel);
        draw_surface(v, eye, i / 2, i % 2);
        gl->Viewport(0, 0, width, height);
    }
    const double at[2] = {left + MARGIN * panel, 0.42 * strip};
    const double bar[2] = {left + panel * (columns - 0.62), 0.48 * strip};
    label_text(&text, at, 0.26 * strip, -1, INK, v->caption);
    draw_legend(&text, bar, 0.55 * panel, 0.26 * strip);
    const double name[2] = {bar[0] - 0.1 * panel, bar[1]};
    label_text(&text, name, 0.22 * strip, 1, FAINT, "stretch");
}
