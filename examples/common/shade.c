#include "shade.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "backdrop.h"
#include "offscreen.h"

static const double PI = 3.14159265358979323846;

enum
{
    ATTRIBUTES = 4, // position, normal, radiosity, seen
    LIT = 3         // lights whose reflection is drawn
};

struct shade
{
    const gl_context *context;
    const gl_functions *gl;
    backdrop behind;
    GLuint program, vertex_array, buffers[ATTRIBUTES + 1];
    GLsizei index_count;
    size_t vertex_count;
    float floor_y, height; // of the lowest vertex, and of the object above it
    float to_light[3 * LIT], light_color[3 * LIT], ambient[3], light_width;
};

static const char object_vertex_shader[] =
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec3 normal;\n"
    "layout(location = 2) in vec3 radiosity;\n"
    "layout(location = 3) in vec4 seen;\n"
    "uniform mat4 view_projection;\n"
    "uniform float floor_y, mirrored;\n" // mirrored: 1 draws the image in the floor
    "out vec3 at, n, B;\n"
    "out vec4 visible;\n"
    "void main()\n"
    "{\n"
    "    at = position;\n"
    "    n = normal;\n"
    "    B = radiosity;\n"
    "    visible = seen;\n"
    "    float y = mix(position.y, 2.0*floor_y - position.y, mirrored);\n"
    "    gl_Position = view_projection * vec4(position.x, y, position.z, 1.0);\n"
    "}\n";

// The light that leaves the surface: scattered (B) by the header's exit factor, and reflected, which is what the
// exit factor keeps back. Reflections: GGX (Walter et al. 2007) with height-correlated Smith shadowing.
static const char object_fragment_shader[] =
    "in vec3 at, n, B;\n"
    "in vec4 visible;\n"
    "uniform vec3 eye, to_light[3], light_color[3], ambient;\n"
    "uniform float roughness, light_width, floor_y, height, mirrored, floor_strength;\n"
    "out vec4 color;\n"
    "const float PI = 3.14159265;\n"
    "float ggx(float n_h, float a)\n"
    "{\n"
    "    float d = n_h*n_h*(a*a - 1.0) + 1.0;\n"
    "    return a*a / (PI*d*d);\n"
    "}\n"
    "float smith(float n_l, float n_v, float a)\n" // G / (4 n_l n_v)
    "{\n"
    "    float v = n_l*sqrt(n_v*n_v*(1.0 - a*a) + a*a), l = n_v*sqrt(n_l*n_l*(1.0 - a*a) + a*a);\n"
    "    return 0.5 / max(v + l, 1e-6);\n"
    "}\n"
    "vec3 reflected(vec3 N, vec3 V, float n_v)\n"
    "{\n"
    "    float a = roughness*roughness + light_width;\n" // a wide light looks like a rougher surface
    "    vec3 sum = vec3(0.0);\n"
    "    for (int i = 0; i < 3; ++i)\n"
    "    {\n"
    "        vec3 H = normalize(V + to_light[i]);\n"
    "        float n_l = max(dot(N, to_light[i]), 0.0), F = sss_fresnel(clamp(dot(V, H), 0.0, 1.0), sss_eta);\n"
    "        sum += light_color[i] * visible[i] * n_l * F * ggx(dot(N, H), a) * smith(n_l, n_v, a);\n"
    "    }\n"
    // Even surroundings, a little brighter above, seen through the openness of the place.
    "    float up = 0.5 + 0.5*reflect(-V, N).y;\n"
    "    float F = mix(sss_fresnel(n_v, sss_eta), sss_fresnel(1.0, sss_eta), 0.5*roughness);\n"
    "    return sum + ambient/PI * (0.4 + 1.2*up*up) * visible.w * F;\n"
    "}\n"
    "void main()\n"
    "{\n"
    "    vec3 V = normalize(eye - at), N = normalize(gl_FrontFacing ? n : -n);\n"
    // Interpolated normals may face away at the outline; there the surface is seen at a grazing angle.
    "    float n_v = clamp(dot(N, V), 0.02, 1.0);\n"
    "    vec3 L = sss_exit_factor(n_v)/PI * max(B, 0.0);\n"
    "    if (roughness > 0.0)\n"
    "    {\n"
    "        L += reflected(N, V, n_v);\n"
    "    }\n"
    // A polished floor is never flat: its image fades within a third of the object's height.
    "    float image = floor_strength * exp(-5.0 * (at.y - floor_y) / height);\n"
    "    color = vec4(sss_tone_map(L), mix(1.0, image, mirrored));\n"
    "}\n";

static int build_programs(shade *s, char *error_text, size_t error_size)
{
    const char *const vertex[] = {object_vertex_shader};
    const char *const fragment[] = {sss_dipole_glsl(SSS_DIPOLE_GLSL_FRESNEL), sss_dipole_glsl(SSS_DIPOLE_GLSL_PROFILE),
                                    sss_dipole_glsl(SSS_DIPOLE_GLSL_TONE_MAPPING), object_fragment_shader};
    s->program = gl_context_program(s->context, gl_context_version_line(s->context), vertex, 1, fragment, 4, error_text,
                                    error_size);
    return s->program ? backdrop_create(s->context, &s->behind, error_text, error_size) : -1;
}

static void upload(const shade *s, GLuint attribute, GLint width, const float *values)
{
    s->gl->BindVertexArray(s->vertex_array);
    s->gl->BindBuffer(GL_ARRAY_BUFFER, s->buffers[attribute]);
    s->gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(s->vertex_count * (size_t)width * sizeof *values), values,
                      GL_STATIC_DRAW);
    s->gl->EnableVertexAttribArray(attribute);
    s->gl->VertexAttribPointer(attribute, width, GL_FLOAT, GL_FALSE, 0, NULL);
}

static void upload_model(shade *s, const model *m)
{
    s->gl->GenVertexArrays(1, &s->vertex_array);
    s->gl->GenBuffers(ATTRIBUTES + 1, s->buffers);
    double low[3], high[3];
    const double extent = model_bounds(m, low, high);
    s->floor_y = (float)low[1];
    s->height = (float)(high[1] > low[1] ? high[1] - low[1] : extent);
    s->vertex_count = m->vertex_count;
    s->index_count = (GLsizei)(3 * m->triangle_count);
    upload(s, 0, 3, m->positions);
    upload(s, 1, 3, m->normals);
    s->gl->BindBuffer(GL_ELEMENT_ARRAY_BUFFER, s->buffers[ATTRIBUTES]);
    s->gl->BufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(3 * m->triangle_count * sizeof *m->triangles),
                      m->triangles, GL_STATIC_DRAW);
}

static void take_lights(shade *s, const lights *l)
{
    for (size_t i = 0; i < LIT && i < l->count; ++i)
    {
        const double *const d = l->direction[i];
        const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        for (size_t k = 0; k < 3; ++k)
        {
            s->to_light[3 * i + k] = (float)(d[k] / length);
            s->light_color[3 * i + k] = (float)l->color[i][k];
        }
    }
    for (size_t k = 0; k < 3; ++k)
    {
        s->ambient[k] = (float)l->ambient[k];
    }
    // A mirror direction moves twice as fast as the normal: a light of angular radius t widens the lobe by t/2.
    s->light_width = (float)(0.5 * l->softness * PI / 180.0);
}

shade *shade_create(gl_context *context, const model *m, const lights *l, char *error_text, size_t error_size)
{
    shade *const s = calloc(1, sizeof *s);
    if (!s)
    {
        snprintf(error_text, error_size, "out of memory");
        return NULL;
    }
    s->context = context;
    s->gl = gl_context_functions(context);
    if (build_programs(s, error_text, error_size) != 0)
    {
        shade_free(s);
        return NULL;
    }
    upload_model(s, m);
    if (l)
    {
        take_lights(s, l);
    }
    if (s->gl->GetError() != GL_NO_ERROR)
    {
        snprintf(error_text, error_size, "OpenGL does not take the mesh: too large?");
        shade_free(s);
        return NULL;
    }
    return s;
}

void shade_free(shade *s)
{
    if (s)
    {
        s->gl->DeleteProgram(s->program);
        backdrop_free(&s->behind);
        s->gl->DeleteVertexArrays(1, &s->vertex_array);
        s->gl->DeleteBuffers(ATTRIBUTES + 1, s->buffers);
        free(s);
    }
}

static GLint uniform(const shade *s, const char *name)
{
    return s->gl->GetUniformLocation(s->program, name);
}

int shade_set_profile(shade *s, const sss_profile *profile, sss_dipole_exit exit_convention)
{
    sss_dipole_glsl_uniforms u;
    if (sss_dipole_get_glsl_uniforms(profile, exit_convention, &u) != SSS_OK)
    {
        return -1;
    }
    s->gl->UseProgram(s->program);
    s->gl->Uniform3fv(uniform(s, "sss_alpha_p"), 1, u.alpha_p);
    s->gl->Uniform3fv(uniform(s, "sss_sigma_tr"), 1, u.sigma_tr);
    s->gl->Uniform3fv(uniform(s, "sss_z_r"), 1, u.z_r);
    s->gl->Uniform3fv(uniform(s, "sss_z_v"), 1, u.z_v);
    s->gl->Uniform1f(uniform(s, "sss_eta"), u.eta);
    s->gl->Uniform1f(uniform(s, "sss_exit_scale"), u.exit_scale);
    return 0;
}

void shade_set_radiosity(shade *s, const float *radiosity, const float *seen)
{
    upload(s, 2, 3, radiosity);
    if (seen)
    {
        upload(s, 3, 4, seen);
    }
    else
    {
        const float all[4] = {1.0f, 1.0f, 1.0f, 1.0f};
        s->gl->VertexAttrib4fv(3, all);
    }
}

static void draw_triangles(const shade *s)
{
    s->gl->DrawElements(GL_TRIANGLES, s->index_count, GL_UNSIGNED_INT, NULL);
}

// The image in the floor is what an eye below the floor sees of the object. First only depth, so that what is
// blended afterwards is the nearest surface alone.
static void draw_mirrored(const shade *s, const float eye[3])
{
    const gl_functions *const gl = s->gl;
    gl->Uniform1f(uniform(s, "mirrored"), 1.0f);
    gl->Uniform3f(uniform(s, "eye"), eye[0], 2.0f * s->floor_y - eye[1], eye[2]);
    gl->FrontFace(GL_CW);
    gl->ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    draw_triangles(s);
    gl->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl->DepthFunc(GL_LEQUAL);
    gl->Enable(GL_BLEND);
    gl->BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    draw_triangles(s);
    gl->Disable(GL_BLEND);
    gl->DepthFunc(GL_LESS);
    gl->FrontFace(GL_CCW);
    gl->Clear(GL_DEPTH_BUFFER_BIT); // the object hides its image wherever they overlap
}

void shade_draw(const shade *s, const shade_view *view, int width, int height)
{
    const gl_functions *const gl = s->gl;
    float view_projection[16], eye[3];
    camera_matrix(&view->eye, (double)width / height, view_projection, eye);
    gl->Viewport(0, 0, width, height);
    gl->Clear(GL_DEPTH_BUFFER_BIT);
    backdrop_draw(&s->behind, view->background);
    gl->UseProgram(s->program);
    gl->UniformMatrix4fv(uniform(s, "view_projection"), 1, GL_FALSE, view_projection);
    gl->Uniform3fv(uniform(s, "to_light"), LIT, s->to_light);
    gl->Uniform3fv(uniform(s, "light_color"), LIT, s->light_color);
    gl->Uniform3fv(uniform(s, "ambient"), 1, s->ambient);
    gl->Uniform1f(uniform(s, "light_width"), s->light_width);
    gl->Uniform1f(uniform(s, "roughness"), (float)view->roughness);
    gl->Uniform1f(uniform(s, "sss_exposure"), (float)view->exposure);
    gl->Uniform1f(uniform(s, "floor_y"), s->floor_y);
    gl->Uniform1f(uniform(s, "height"), s->height);
    gl->Uniform1f(uniform(s, "floor_strength"), (float)view->floor);
    gl->BindVertexArray(s->vertex_array);
    if (view->floor > 0.0 && eye[1] > s->floor_y)
    {
        draw_mirrored(s, eye);
    }
    gl->Uniform1f(uniform(s, "mirrored"), 0.0f);
    gl->Uniform3fv(uniform(s, "eye"), 1, eye);
    draw_triangles(s);
}

typedef struct sight
{
    const shade *s;
    const shade_view *view;
} sight;

static void draw_sight(void *user, int width, int height)
{
    const sight *const it = user;
    shade_draw(it->s, it->view, width, height);
}

int shade_picture(const shade *s, const shade_view *view, int width, int height, int supersample, unsigned char *rgb,
                  char *error_text, size_t error_size)
{
    sight it = {s, view};
    const offscreen_size size = {width, height, supersample};
    return offscreen_draw(s->context, &size, draw_sight, &it, rgb, error_text, error_size);
}

static int ascending(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

double shade_exposure(const model *m, const camera *eye, const float *radiosity)
{
    static const double BRIGHT = 0.98; // this share of the vertices in view stays below the target,
    static const double TARGET = 0.75; // the radiance that tone mapping shows as a bright but coloured surface
    float view_projection[16], from[3];
    camera_matrix(eye, 1.0, view_projection, from);
    float *const brightest = malloc(m->vertex_count * sizeof *brightest);
    size_t count = 0;
    for (size_t i = 0; i < m->vertex_count && brightest; ++i)
    {
        const float *const p = m->positions + 3 * i, *const n = m->normals + 3 * i, *const B = radiosity + 3 * i;
        if (n[0] * (from[0] - p[0]) + n[1] * (from[1] - p[1]) + n[2] * (from[2] - p[2]) > 0.0f)
        {
            brightest[count++] = fmaxf(B[0], fmaxf(B[1], B[2]));
        }
    }
    double exposure = 1.0;
    if (count > 0)
    {
        qsort(brightest, count, sizeof *brightest, ascending);
        const double radiance = (double)brightest[(size_t)(BRIGHT * (double)(count - 1))] / PI;
        exposure = radiance > 0.0 && isfinite(TARGET / radiance) ? TARGET / radiance : 1.0;
    }
    free(brightest);
    return exposure;
}

shade_view shade_studio(const model *m, const float *radiosity, double aspect)
{
    shade_view view = {.eye = {.azimuth = 20.0, .elevation = 8.0, .zoom = 1.0}, .roughness = 0.35,
                       .background = {{0.09, 0.09, 0.095}, {0.16, 0.17, 0.19}}};
    camera_fit(&view.eye, m->positions, m->vertex_count, aspect);
    view.exposure = shade_exposure(m, &view.eye, radiosity);
    return view;
}
