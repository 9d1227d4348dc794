#include "backdrop.h"

#include <string.h>

static const char vertex_shader[] =
    "out vec2 screen;\n"
    "void main()\n" // one triangle that covers the picture
    "{\n"
    "    screen = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);\n"
    "    gl_Position = vec4(screen, 0.0, 1.0);\n"
    "}\n";

static const char fragment_shader[] =
    "in vec2 screen;\n"
    "uniform vec3 below, above;\n"
    "out vec4 color;\n"
    "void main()\n"
    "{\n"
    "    vec2 from_glow = screen - vec2(0.12, 0.2);\n"     // a glow behind the object lifts its dark side off
    "    float glow = 0.6 + 0.9*exp(-1.6*dot(from_glow, from_glow));\n"
    "    vec3 c = mix(below, above, smoothstep(-1.1, 0.4, screen.y));\n"
    "    color = vec4(c * glow, 1.0);\n"
    "}\n";

int backdrop_create(const gl_context *context, backdrop *out, char *error_text, size_t error_size)
{
    const char *const vertex[] = {vertex_shader}, *const fragment[] = {fragment_shader};
    memset(out, 0, sizeof *out);
    out->gl = gl_context_functions(context);
    out->program = gl_context_program(context, gl_context_version_line(context), vertex, 1, fragment, 1, error_text,
                                      error_size);
    if (!out->program)
    {
        return -1;
    }
    out->gl->GenVertexArrays(1, &out->vertex_array);
    return 0;
}

void backdrop_free(backdrop *b)
{
    if (b->gl)
    {
        b->gl->DeleteProgram(b->program);
        b->gl->DeleteVertexArrays(1, &b->vertex_array);
    }
}

void backdrop_draw(const backdrop *b, const double colors[2][3])
{
    const gl_functions *const gl = b->gl;
    float c[2][3];
    for (int i = 0; i < 6; ++i)
    {
        c[i / 3][i % 3] = (float)colors[i / 3][i % 3];
    }
    gl->Disable(GL_DEPTH_TEST);
    gl->UseProgram(b->program);
    gl->Uniform3fv(gl->GetUniformLocation(b->program, "below"), 1, c[0]);
    gl->Uniform3fv(gl->GetUniformLocation(b->program, "above"), 1, c[1]);
    gl->BindVertexArray(b->vertex_array);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
    gl->Enable(GL_DEPTH_TEST);
}
