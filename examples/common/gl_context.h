// An OpenGL context, headless on OSMesa or in a GLFW window, with its functions loaded into one table.
#ifndef EXAMPLES_GL_CONTEXT_H
#define EXAMPLES_GL_CONTEXT_H

#include <stddef.h>

#include <GL/glcorearb.h>

#ifdef __cplusplus
extern "C" {
#endif

// The functions that examples and tests call: X(member, type suffix of PFNGL...PROC). Members are named without
// the gl prefix, so that they cannot clash with a libGL that is linked into the same program.
#define GL_CONTEXT_FUNCTIONS(X)                                                                                       \
    X(ActiveTexture, ACTIVETEXTURE)                                                                                   \
    X(AttachShader, ATTACHSHADER)                                                                                     \
    X(BindAttribLocation, BINDATTRIBLOCATION)                                                                         \
    X(BindBuffer, BINDBUFFER)                                                                                         \
    X(BindFragDataLocation, BINDFRAGDATALOCATION)                                                                     \
    X(BindFramebuffer, BINDFRAMEBUFFER)                                                                               \
    X(BindRenderbuffer, BINDRENDERBUFFER)                                                                             \
    X(BindTexture, BINDTEXTURE)                                                                                       \
    X(BindVertexArray, BINDVERTEXARRAY)                                                                               \
    X(BlendFunc, BLENDFUNC)                                                                                           \
    X(BlitFramebuffer, BLITFRAMEBUFFER)                                                                               \
    X(BufferData, BUFFERDATA)                                                                                         \
    X(BufferSubData, BUFFERSUBDATA)                                                                                   \
    X(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS)                                                                 \
    X(Clear, CLEAR)                                                                                                   \
    X(ClearColor, CLEARCOLOR)                                                                                         \
    X(ClearDepth, CLEARDEPTH)                                                                                         \
    X(ColorMask, COLORMASK)                                                                                           \
    X(CompileShader, COMPILESHADER)                                                                                   \
    X(CreateProgram, CREATEPROGRAM)                                                                                   \
    X(CreateShader, CREATESHADER)                                                                                     \
    X(CullFace, CULLFACE)                                                                                             \
    X(DeleteBuffers, DELETEBUFFERS)                                                                                   \
    X(DeleteFramebuffers, DELETEFRAMEBUFFERS)                                                                         \
    X(DeleteProgram, DELETEPROGRAM)                                                                                   \
    X(DeleteRenderbuffers, DELETERENDERBUFFERS)                                                                       \
    X(DeleteShader, DELETESHADER)                                                                                     \
    X(DeleteTextures, DELETETEXTURES)                                                                                 \
    X(DeleteVertexArrays, DELETEVERTEXARRAYS)                                                                         \
    X(DepthFunc, DEPTHFUNC)                                                                                           \
    X(DepthMask, DEPTHMASK)                                                                                           \
    X(Disable, DISABLE)                                                                                               \
    X(DrawArrays, DRAWARRAYS)                                                                                         \
    X(DrawBuffers, DRAWBUFFERS)                                                                                       \
    X(DrawElements, DRAWELEMENTS)                                                                                     \
    X(Enable, ENABLE)                                                                                                 \
    X(EnableVertexAttribArray, ENABLEVERTEXATTRIBARRAY)                                                               \
    X(Finish, FINISH)                                                                                                 \
    X(FramebufferRenderbuffer, FRAMEBUFFERRENDERBUFFER)                                                               \
    X(FramebufferTexture2D, FRAMEBUFFERTEXTURE2D)                                                                     \
    X(FrontFace, FRONTFACE)                                                                                           \
    X(GenBuffers, GENBUFFERS)                                                                                         \
    X(GenFramebuffers, GENFRAMEBUFFERS)                                                                               \
    X(GenRenderbuffers, GENRENDERBUFFERS)                                                                             \
    X(GenTextures, GENTEXTURES)                                                                                       \
    X(GenVertexArrays, GENVERTEXARRAYS)                                                                               \
    X(GenerateMipmap, GENERATEMIPMAP)                                                                                 \
    X(GetAttribLocation, GETATTRIBLOCATION)                                                                           \
    X(GetError, GETERROR)                                                                                             \
    X(GetIntegerv, GETINTEGERV)                                                                                       \
    X(GetProgramInfoLog, GETPROGRAMINFOLOG)                                                                           \
    X(GetProgramiv, GETPROGRAMIV)                                                                                     \
    X(GetShaderInfoLog, GETSHADERINFOLOG)                                                                             \
    X(GetShaderiv, GETSHADERIV)                                                                                       \
    X(GetString, GETSTRING)                                                                                           \
    X(GetTexImage, GETTEXIMAGE)                                                                                       \
    X(GetUniformLocation, GETUNIFORMLOCATION)                                                                         \
    X(LinkProgram, LINKPROGRAM)                                                                                       \
    X(PixelStorei, PIXELSTOREI)                                                                                       \
    X(ReadBuffer, READBUFFER)                                                                                         \
    X(ReadPixels, READPIXELS)                                                                                         \
    X(RenderbufferStorage, RENDERBUFFERSTORAGE)                                                                       \
    X(ShaderSource, SHADERSOURCE)                                                                                     \
    X(TexBuffer, TEXBUFFER)                                                                                           \
    X(TexImage2D, TEXIMAGE2D)                                                                                         \
    X(TexImage3D, TEXIMAGE3D)                                                                                         \
    X(TexParameteri, TEXPARAMETERI)                                                                                   \
    X(Uniform1f, UNIFORM1F)                                                                                           \
    X(Uniform1i, UNIFORM1I)                                                                                           \
    X(Uniform2f, UNIFORM2F)                                                                                           \
    X(Uniform3f, UNIFORM3F)                                                                                           \
    X(Uniform1fv, UNIFORM1FV)                                                                                         \
    X(Uniform3fv, UNIFORM3FV)                                                                                         \
    X(Uniform4fv, UNIFORM4FV)                                                                                         \
    X(Uniform4iv, UNIFORM4IV)                                                                                         \
    X(UniformMatrix4fv, UNIFORMMATRIX4FV)                                                                             \
    X(UseProgram, USEPROGRAM)                                                                                         \
    X(VertexAttrib4fv, VERTEXATTRIB4FV)                                                                               \
    X(VertexAttribPointer, VERTEXATTRIBPOINTER)                                                                       \
    X(Viewport, VIEWPORT)

#define GL_CONTEXT_MEMBER(member, type) PFNGL##type##PROC member;
typedef struct gl_functions
{
    GL_CONTEXT_FUNCTIONS(GL_CONTEXT_MEMBER)
} gl_functions;
#undef GL_CONTEXT_MEMBER

typedef struct gl_context gl_context;

// What the user did since the last frame; all zero in a headless context.
typedef struct gl_input
{
    double drag_x, drag_y; // pointer movement with a button held, in pixels
    double scroll;         // wheel steps, away from the user positive
    int width, height;     // of the framebuffer, pixels
    int close;             // the window should close (its button, or Escape)
    int key;               // the key pressed last, as its capital letter or sign in ASCII; 0: none
} gl_input;

// Both make the new context current, 4.5 core where there is one, else 3.3 core. They return NULL on failure and
// then say why in error_text [error_size].
gl_context *gl_context_create_headless(int width, int height, char *error_text, size_t error_size);
gl_context *gl_context_create_window(int width, int height, const char *title, char *error_text, size_t error_size);

// Frees the context; NULL is allowed.
void gl_context_free(gl_context *context);

// The functions of the context; valid until it is freed.
const gl_functions *gl_context_functions(const gl_context *context);

// "4.5 core, llvmpipe ...": version and renderer, for reports.
const char *gl_context_description(const gl_context *context);

// The version as 45 or 33, and as the first line of a shader.
int gl_context_version(const gl_context *context);
const char *gl_context_version_line(const gl_context *context);

// Shows the frame (windows only), takes events in, and says what the user did.
void gl_context_present(gl_context *context, gl_input *input);

// Reads RGB from the framebuffer that is bound for reading, top row first, 3 width height bytes.
// Returns 0, or -1 when OpenGL reports an error or memory is short.
int gl_context_read_rgb(const gl_context *context, int width, int height, unsigned char *rgb);

// Compiles and links a program from pieces of source [count]; 0 on failure, with the log in error_text.
// The version line comes first by itself ("#version 330 core", "#version 450 core", ...).
GLuint gl_context_program(const gl_context *context, const char *version_line, const char *const *vertex_pieces,
                          size_t vertex_count, const char *const *fragment_pieces, size_t fragment_count,
                          char *error_text, size_t error_size);

// A program from one source of each kind, at the context's version, and the vertex array that it draws from.
typedef struct gl_pass
{
    const gl_functions *gl;
    GLuint program, vertex_array;
} gl_pass;

// Returns 0, or -1 with the reason in error_text, *out then being empty.
int gl_pass_create(const gl_context *context, const char *vertex, const char *fragment, gl_pass *out, char *error_text,
                   size_t error_size);
void gl_pass_free(const gl_pass *pass);

#ifdef __cplusplus
}
#endif

#endif
