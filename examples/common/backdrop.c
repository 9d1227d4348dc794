#include "backdrop.h"

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
    return gl_pass_create(context, vertex_shader, fragment_shader, &out->pass, error_text, error_size);
}

void backdrop_free(backdrop *b)
{
    gl_pass_free(&b->pass);
}

void backdrop_draw(const backdrop *b, const double colors[2][3])
{
    const gl_functions *const gl = b->pass.gl;
    float c[2][3];
    for (int i = 0; i < 6; ++i)
    {
        c[i / 3][i % 3] = (float)colors[i / 3][i % 3];
    }
    gl->Disable(GL_DEPTH_TEST);
    gl->UseProgram(b->pass.program);
    gl->Uniform3fv(gl->GetUniformLocation(b->pass.program, "below"), 1, c[0]);
    gl->Uniform3fv(gl->GetUniformLocation(b->pass.program, "above"), 1, c[1]);
    gl->BindVertexArray(b->pass.vertex_array);
    gl->DrawArrays(GL_TRIANGLES, 0, 3);
    gl->Enable(GL_DEPTH_TEST);
}
