#define _POSIX_C_SOURCE 200809L // dlfcn.h

#include "gl_context.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

// OSMesa is opened at run time and locally: linked beside libGL, each library would shadow the other's functions.
typedef struct osmesa_context *OSMesaContext;
typedef void (*osmesa_proc)(void);
typedef OSMesaContext (*osmesa_create_attribs)(const int *attributes, OSMesaContext share);
typedef GLboolean (*osmesa_make_current)(OSMesaContext context, void *buffer, GLenum type, GLsizei width,
                                         GLsizei height);
typedef void (*osmesa_destroy)(OSMesaContext context);
typedef osmesa_proc (*osmesa_get_proc)(const char *name);

// From GL/osmesa.h, which cannot be included beside GL/glcorearb.h because it brings in GL/gl.h.
enum
{
    OSMESA_FORMAT_ = 0x22,
    OSMESA_DEPTH_BITS_ = 0x30,
    OSMESA_PROFILE_ = 0x33,
    OSMESA_CORE_PROFILE_ = 0x34,
    OSMESA_MAJOR_ = 0x36,
    OSMESA_MINOR_ = 0x37
};

static const int versions[][2] = {{4, 5}, {3, 3}};
enum
{
    VERSION_COUNT = sizeof versions / sizeof versions[0]
};

typedef void (*any_function)(void);
typedef any_function (*load_function)(void *user, const char *name);

struct gl_context
{
    gl_functions gl;
    int version;
    char description[256];

    void *library; // OSMesa
    OSMesaContext headless;
    osmesa_make_current make_current;
    osmesa_destroy destroy;
    unsigned char *buffer;

    GLFWwindow *window;
    double pointer_x, pointer_y, scroll;
    int pointer_known, key;
};

static void say(char *error_text, size_t error_size, const char *what, const char *detail)
{
    if (error_text && error_size > 0)
    {
        snprintf(error_text, error_size, "%s%s%s", what, detail && *detail ? ": " : "", detail ? detail : "");
    }
}

// dlsym returns an object pointer; POSIX promises that its bits are those of the function pointer.
static any_function symbol(void *library, const char *name)
{
    void *const object = dlsym(library, name);
    any_function function = NULL;
    memcpy(&function, &object, sizeof function);
    return function;
}

static int load_functions(gl_context *context, load_function load, void *user, char *error_text, size_t error_size)
{
#define GL_CONTEXT_LOAD(member, type)                                                                                 \
    context->gl.member = (PFNGL##type##PROC)load(user, "gl" #member);                                                 \
    if (!context->gl.member)                                                                                          \
    {                                                                                                                 \
        say(error_text, error_size, "OpenGL lacks a function", "gl" #member);                                         \
        return -1;                                                                                                    \
    }
    GL_CONTEXT_FUNCTIONS(GL_CONTEXT_LOAD)
#undef GL_CONTEXT_LOAD
    GLint major = 0, minor = 0;
    context->gl.GetIntegerv(GL_MAJOR_VERSION, &major);
    context->gl.GetIntegerv(GL_MINOR_VERSION, &minor);
    context->version = 10 * major + minor;
    const GLubyte *const renderer = context->gl.GetString(GL_RENDERER);
    snprintf(context->description, sizeof context->description, "%d.%d core, %s", major, minor,
             renderer ? (const char *)renderer : "unknown renderer");
    return 0;
}

// ---- headless ----

static any_function load_osmesa(void *user, const char *name)
{
    return (any_function)(*(osmesa_get_proc *)user)(name);
}

static int open_osmesa(gl_context *context, int width, int height, char *error_text, size_t error_size)
{
    static const char *const names[] = {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"};
    for (size_t i = 0; i < sizeof names / sizeof names[0] && !context->library; ++i)
    {
        context->library = dlopen(names[i], RTLD_NOW | RTLD_LOCAL);
    }
    if (!context->library)
    {
        say(error_text, error_size, "cannot open libOSMesa.so (Debian package libosmesa6)", dlerror());
        return -1;
    }
    const osmesa_create_attribs create =
        (osmesa_create_attribs)symbol(context->library, "OSMesaCreateContextAttribs");
    context->make_current = (osmesa_make_current)symbol(context->library, "OSMesaMakeCurrent");
    osmesa_get_proc get_proc = (osmesa_get_proc)symbol(context->library, "OSMesaGetProcAddress");
    context->destroy = (osmesa_destroy)symbol(context->library, "OSMesaDestroyContext");
    if (!create || !context->make_current || !get_proc || !context->destroy)
    {
        say(error_text, error_size, "libOSMesa.so is too old: it has no OSMesaCreateContextAttribs", NULL);
        return -1;
    }
    for (size_t i = 0; i < VERSION_COUNT && !context->headless; ++i)
    {
        const int attributes[] = {OSMESA_FORMAT_, GL_RGBA, OSMESA_DEPTH_BITS_, 24, OSMESA_PROFILE_,
                                  OSMESA_CORE_PROFILE_, OSMESA_MAJOR_, versions[i][0], OSMESA_MINOR_,
                                  versions[i][1], 0};
        context->headless = create(attributes, NULL);
    }
    context->buffer = calloc((size_t)width * (size_t)height, 4);
    if (!context->headless || !context->buffer ||
        !context->make_current(context->headless, context->buffer, GL_UNSIGNED_BYTE, width, height))
    {
        say(error_text, error_size, "OSMesa gives no OpenGL 3.3 core context", NULL);
        return -1;
    }
    return load_functions(context, load_osmesa, &get_proc, error_text, error_size);
}

gl_context *gl_context_create_headless(int width, int height, char *error_text, size_t error_size)
{
    if (width < 1 || height < 1 || width > 16384 || height > 16384)
    {
        say(error_text, error_size, "the picture's size must lie between 1 and 16384 pixels", NULL);
        return NULL;
    }
    gl_context *const context = calloc(1, sizeof *context);
    if (!context)
    {
        say(error_text, error_size, "out of memory", NULL);
        return NULL;
    }
    if (open_osmesa(context, width, height, error_text, error_size) != 0)
    {
        gl_context_free(context);
        return NULL;
    }
    context->gl.Viewport(0, 0, width, height);
    return context;
}

// ---- window ----

static any_function load_glfw(void *user, const char *name)
{
    (void)user;
    return (any_function)glfwGetProcAddress(name);
}

static void on_scroll(GLFWwindow *window, double x, double y)
{
    (void)x;
    gl_context *const context = glfwGetWindowUserPointer(window);
    context->scroll += y;
}

// GLFW's numbers of the printable keys are those of ASCII.
static void on_key(GLFWwindow *window, int key, int scancode, int action, int modifiers)
{
    (void)scancode;
    (void)modifiers;
    gl_context *const context = glfwGetWindowUserPointer(window);
    if (action == GLFW_PRESS && key >= GLFW_KEY_SPACE && key <= GLFW_KEY_GRAVE_ACCENT)
    {
        context->key = key;
    }
}

static const char *glfw_reason(void)
{
    const char *reason = NULL;
    glfwGetError(&reason);
    return reason;
}

static int open_window(gl_context *context, int width, int height, const char *title, char *error_text,
                       size_t error_size)
{
    for (size_t i = 0; i < VERSION_COUNT && !context->window; ++i)
    {
        glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, versions[i][0]);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, versions[i][1]);
        glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
        glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE); // macOS insists
        glfwWindowHint(GLFW_SAMPLES, 4);
        context->window = glfwCreateWindow(width, height, title, NULL, NULL);
    }
    if (!context->window)
    {
        say(error_text, error_size, "cannot open a window with OpenGL 3.3 core", glfw_reason());
        return -1;
    }
    glfwSetWindowUserPointer(context->window, context);
    glfwSetScrollCallback(context->window, on_scroll);
    glfwSetKeyCallback(context->window, on_key);
    glfwSetInputMode(context->window, GLFW_STICKY_KEYS, GLFW_TRUE); // a short press between two slow frames counts
    glfwMakeContextCurrent(context->window);
    glfwSwapInterval(1);
    return load_functions(context, load_glfw, NULL, error_text, error_size);
}

gl_context *gl_context_create_window(int width, int height, const char *title, char *error_text, size_t error_size)
{
    if (!glfwInit())
    {
        say(error_text, error_size, "no display for a window (run with --headless)", glfw_reason());
        return NULL;
    }
    gl_context *const context = calloc(1, sizeof *context);
    if (!context || open_window(context, width, height, title, error_text, error_size) != 0)
    {
        if (!context)
        {
            say(error_text, error_size, "out of memory", NULL);
        }
        gl_context_free(context);
        glfwTerminate();
        return NULL;
    }
    return context;
}

static void take_input(gl_context *context, gl_input *input)
{
    double x, y;
    glfwGetCursorPos(context->window, &x, &y);
    const int held = glfwGetMouseButton(context->window, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS ||
                     glfwGetMouseButton(context->window, GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS;
    if (held && context->pointer_known)
    {
        input->drag_x = x - context->pointer_x;
        input->drag_y = y - context->pointer_y;
    }
    context->pointer_x = x;
    context->pointer_y = y;
    context->pointer_known = 1;
    input->scroll = context->scroll;
    context->scroll = 0.0;
    input->key = context->key;
    context->key = 0;
    glfwGetFramebufferSize(context->window, &input->width, &input->height);
    input->close = glfwWindowShouldClose(context->window) ||
                   glfwGetKey(context->window, GLFW_KEY_ESCAPE) == GLFW_PRESS;
}

void gl_context_present(gl_context *context, gl_input *input)
{
    memset(input, 0, sizeof *input);
    if (context->window)
    {
        glfwSwapBuffers(context->window);
        glfwPollEvents();
        take_input(context, input);
    }
}

// ---- both ----

void gl_context_free(gl_context *context)
{
    if (!context)
    {
        return;
    }
    if (context->window)
    {
        glfwDestroyWindow(context->window);
        glfwTerminate();
    }
    if (context->headless)
    {
        context->make_current(NULL, NULL, GL_UNSIGNED_BYTE, 0, 0);
        context->destroy(context->headless);
    }
    // The library stays open: Mesa's own threads and exit handlers may still need its code.
    free(context->buffer);
    free(context);
}

const gl_functions *gl_context_functions(const gl_context *context)
{
    return &context->gl;
}

const char *gl_context_description(const gl_context *context)
{
    return context->description;
}

int gl_context_version(const gl_context *context)
{
    return context->version;
}

const char *gl_context_version_line(const gl_context *context)
{
    return context->version >= 45 ? "#version 450 core" : "#version 330 core";
}

int gl_context_read_rgb(const gl_context *context, int width, int height, unsigned char *rgb)
{
    const size_t row = 3 * (size_t)width;
    unsigned char *const swap = malloc(row);
    if (!swap)
    {
        return -1;
    }
    context->gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    context->gl.ReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, rgb);
    for (size_t top = 0, bottom = (size_t)height - 1; top < bottom; ++top, --bottom)
    {
        memcpy(swap, rgb + top * row, row);
        memcpy(rgb + top * row, rgb + bottom * row, row);
        memcpy(rgb + bottom * row, swap, row);
    }
    free(swap);
    return context->gl.GetError() == GL_NO_ERROR ? 0 : -1;
}

static GLuint compile(const gl_functions *gl, GLenum stage, const char *version_line, const char *const *pieces,
                      size_t count, char *error_text, size_t error_size)
{
    const char **const sources = malloc((count + 2) * sizeof *sources);
    if (!sources)
    {
        say(error_text, error_size, "out of memory", NULL);
        return 0;
    }
    sources[0] = version_line;
    sources[1] = "\n";
    for (size_t i = 0; i < count; ++i)
    {
        sources[i + 2] = pieces[i];
    }
    const GLuint shader = gl->CreateShader(stage);
    gl->ShaderSource(shader, (GLsizei)(count + 2), sources, NULL);
    free(sources);
    gl->CompileShader(shader);
    GLint compiled = 0;
    gl->GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (!compiled)
    {
        char log[2048] = "";
        gl->GetShaderInfoLog(shader, (GLsizei)sizeof log, NULL, log);
        say(error_text, error_size, stage == GL_VERTEX_SHADER ? "vertex shader" : "fragment shader", log);
        gl->DeleteShader(shader);
        return 0;
    }
    return shader;
}

GLuint gl_context_program(const gl_context *context, const char *version_line, const char *const *vertex_pieces,
                          size_t vertex_count, const char *const *fragment_pieces, size_t fragment_count,
                          char *error_text, size_t error_size)
{
    const gl_functions *const gl = &context->gl;
    const GLuint vertex = compile(gl, GL_VERTEX_SHADER, version_line, vertex_pieces, vertex_count, error_text,
                                  error_size);
    const GLuint fragment = vertex ? compile(gl, GL_FRAGMENT_SHADER, version_line, fragment_pieces, fragment_count,
                                             error_text, error_size) : 0;
    GLuint program = 0;
    if (fragment)
    {
        GLint linked = 0;
        program = gl->CreateProgram();
        gl->AttachShader(program, vertex);
        gl->AttachShader(program, fragment);
        gl->LinkProgram(program);
        gl->GetProgramiv(program, GL_LINK_STATUS, &linked);
        if (!linked)
        {
            char log[2048] = "";
            gl->GetProgramInfoLog(program, (GLsizei)sizeof log, NULL, log);
            say(error_text, error_size, "linking shaders", log);
            gl->DeleteProgram(program);
            program = 0;
        }
    }
    gl->DeleteShader(vertex);
    gl->DeleteShader(fragment);
    return program;
}

int gl_pass_create(const gl_context *context, const char *vertex, const char *fragment, gl_pass *out, char *error_text,
                   size_t error_size)
{
    memset(out, 0, sizeof *out);
    out->program = gl_context_program(context, gl_context_version_line(context), &vertex, 1, &fragment, 1, error_text,
                                      error_size);
    if (!out->program)
    {
        return -1;
    }
    out->gl = gl_context_functions(context);
    out->gl->GenVertexArrays(1, &out->vertex_array);
    return 0;
}

void gl_pass_free(const gl_pass *pass)
{
    if (pass->gl)
    {
        pass->gl->DeleteProgram(pass->program);
        pass->gl->DeleteVertexArrays(1, &pass->vertex_array);
    }
}
