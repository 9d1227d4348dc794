#include "label.h"

#include <stdio.h>
#include <string.h>

#include <stb/stb_easy_font.h>

static const char vertex_shader[] =
    "layout(location = 0) in vec2 at;\n" // pixels
    "uniform vec2 to_clip;\n"
    "void main()\n"
    "{\n"
    "    gl_Position = vec4(at * to_clip - 1.0, 0.0, 1.0);\n"
    "}\n";

static const char fragment_shader[] =
    "uniform vec3 ink;\n"
    "out vec4 color;\n"
    "void main()\n"
    "{\n"
    "    color = vec4(ink, 1.0);\n"
    "}\n";

enum
{
    MAX_QUADS = 1200 // of a text: some hundred letters
};

static const double CAPITAL = 7.0; // height of a capital letter in the font's units

int label_create(const gl_context *context, label *out, char *error_text, size_t error_size)
{
    memset(out, 0, sizeof *out);
    if (gl_pass_create(context, vertex_shader, fragment_shader, &out->pass, error_text, error_size) != 0)
    {
        return -1;
    }
    const gl_functions *const gl = out->pass.gl;
    gl->GenBuffers(1, &out->buffer);
    gl->BindVertexArray(out->pass.vertex_array);
    gl->BindBuffer(GL_ARRAY_BUFFER, out->buffer);
    gl->EnableVertexAttribArray(0);
    gl->VertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, NULL);
    return 0;
}

void label_free(label *l)
{
    if (l->pass.gl)
    {
        l->pass.gl->DeleteBuffers(1, &l->buffer);
    }
    gl_pass_free(&l->pass);
}

void label_begin(label *l, int width, int height)
{
    l->to_clip[0] = 2.0f / (float)width;
    l->to_clip[1] = 2.0f / (float)height;
    l->pass.gl->Viewport(0, 0, width, height);
}

static void draw_triangles(const label *l, const float (*corners)[2], int count, const float color[3])
{
    const gl_functions *const gl = l->pass.gl;
    gl->Disable(GL_DEPTH_TEST);
    gl->UseProgram(l->pass.program);
    gl->Uniform2f(gl->GetUniformLocation(l->pass.program, "to_clip"), l->to_clip[0], l->to_clip[1]);
    gl->Uniform3fv(gl->GetUniformLocation(l->pass.program, "ink"), 1, color);
    gl->BindVertexArray(l->pass.vertex_array);
    gl->BindBuffer(GL_ARRAY_BUFFER, l->buffer);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)count * sizeof *corners), corners, GL_STREAM_DRAW);
    gl->DrawArrays(GL_TRIANGLES, 0, count);
    gl->Enable(GL_DEPTH_TEST);
}

void label_box(const label *l, const double low[2], const double high[2], const float color[3])
{
    const float x0 = (float)low[0], y0 = (float)low[1], x1 = (float)high[0], y1 = (float)high[1];
    const float corners[6][2] = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y0}, {x1, y1}, {x0, y1}};
    draw_triangles(l, corners, 6, color);
}

double label_text(const label *l, const double at[2], double size, int anchor, const float color[3], const char *text)
{
    static const int order[6] = {0, 1, 2, 0, 2, 3}; // two triangles of a quad
    static struct
    {
        float x, y, z;
        unsigned char color[4];
    } quads[4 * MAX_QUADS];
    static float corners[6 * MAX_QUADS][2];
    char copy[256];
    snprintf(copy, sizeof copy, "%s", text);
    for (char *c = copy; *c; ++c)
    {
        *c = *c < ' ' || *c > '~' ? '?' : *c; // all that the font has
    }
    const double unit = size / CAPITAL, width = unit * stb_easy_font_width(copy);
    const double left = at[0] - 0.5 * (anchor + 1) * width;
    const int count = stb_easy_font_print(0.0f, 0.0f, copy, NULL, quads, (int)sizeof quads);
    for (int i = 0; i < 6 * count; ++i)
    {
        const int k = 4 * (i / 6) + order[i % 6];
        corners[i][0] = (float)(left + unit * (double)quads[k].x);
        corners[i][1] = (float)(at[1] + unit * (CAPITAL - (double)quads[k].y)); // the font's y runs downwards
    }
    draw_triangles(l, (const float (*)[2])corners, 6 * count, color);
    return width;
}
