// sss_atlas.h - v0.1.0 - texture atlases: charts, parameterisation, packing, and what surface lies under each texel
//
// What the texel-based pipelines of the family stand on:
//   H. P. A. Lensch, M. Goesele, P. Bekaert, J. Kautz, M. A. Magnor, J. Lang, H.-P. Seidel: Interactive Rendering of
//   Translucent Objects (Pacific Graphics 2002), section 5.1;
//   C.-W. Chang, W.-C. Lin, T.-C. Ho, T.-S. Huang, J.-H. Chuang: Real-Time Translucent Rendering Using GPU-based
//   Texture Space Importance Sampling (Eurographics 2008), sections 2.2, 3 and 5.1;
//   P.-P. Sloan, X. Liu, H.-Y. Shum, J. Snyder: Bi-Scale Radiance Transfer (SIGGRAPH 2003), section 4.3.
// Licence: MIT-0 or public domain, at your choice; see the end. Needs libc and libm, nothing else.
//
// ============================================= QUICK START =============================================
//
//     #define SSS_ATLAS_IMPLEMENTATION // in one source file of the program
//     #include "sss_atlas.h"
//     #include <stdio.h>
//     #include <string.h>
//
//     static const float x[18] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1}; // an octahedron
//     static const uint32_t triangles[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
//
//     int main(void)
//     {
//         sss_mesh mesh = {x, NULL, triangles, 6, 8, 5.0}; // 5 mm per unit
//         sss_atlas_options options;
//         sss_atlas *atlas;
//         sss_atlas_mesh split;
//         sss_atlas_texels texels;
//         memset(&options, 0, sizeof options); // defaults
//         options.size = 256;                  // texels on a side
//         if (sss_atlas_create(&mesh, &options, NULL, &atlas) != SSS_OK) return 1;
//         sss_atlas_get_mesh(atlas, &split);     // vertices split at seams, with texture coordinates
//         sss_atlas_get_texels(atlas, &texels);  // position, normal and area of the surface under each texel
//         printf("%u texture vertices, %u texels\n", (unsigned)split.vertex_count, (unsigned)texels.inner_count);
//         sss_atlas_free(atlas);
//         return 0;
//     }
//
// ================================================ THEORY ===============================================
//
//     symbol     name in code       unit       meaning
//     (u, v)     uv                 -          texture coordinates in [0, 1], v upwards as in OpenGL, texel (0, 0)
//                                              below at the left, texel centres at (i + 1/2)/size
//     S(u, v)    texels.area        mm^2       area of the surface that a texel shows (Lensch 5.2)
//     A_S/A_T    texels.area_ratio  mm^2       of the triangle under a texel: surface per texel (Chang eq. 6)
//     Gamma      stretch            -          singular values of the map from texture to surface, over the one that an
//                gamma                         even map would have (Sander et al. 2001)
//
// ================================================ LIMITS ===============================================
//
//   * Rough surfaces: charts follow the mean normal, so single triangles may lie beyond normal_deviation, on the bunny
//     6 % of the surface at 30 degrees. Charts that fold seen along their mean normal are laid flat with equal area, by
//     every method. Doubled and folded triangles make charts of their own: two thousand on the dragon of 47,794
//     triangles (dragon_res3), which fills 59 % of its texture.
//   * Convex polygons cost stretch: L2 1.2 on the bunny, with single triangles 27 times the mean.
//   * Slits: packing keeps charts apart, not a chart from itself. Where a chart meets itself across a slit narrower
//     than two texels, both sides share texels, and a bilinear fetch mixes them.
//   * Seams: a smooth function, sampled into the atlas and fetched bilinearly, is off at seams by about as much as
//     inside charts on smooth surfaces, by 2 to 5 times as much on the bunny, whose seams run along creases.
//   * Vertices that are duplicated at one place are two: the mesh ends there, and borders with it. Weld them first.

#ifndef SSS_ATLAS_H
#define SSS_ATLAS_H

#define SSS_ATLAS_VERSION 100 // 10000 major + 100 minor + patch

// ---- BEGIN sss common block: byte for byte the same in all sss_*.h; sss_dipole.h holds the master copy ----
#ifndef SSS_COMMON_VERSION
#define SSS_COMMON_VERSION 1

#include <stddef.h>
#include <stdint.h>

// What every function of the family returns. Outputs are untouched on any error.
typedef enum sss_result
{
    SSS_OK = 0,
    SSS_ERROR_INVALID_ARGUMENT, // a null pointer, a number that is not finite, or one outside its stated range
    SSS_ERROR_EMPTY,            // a count is zero
    SSS_ERROR_INDEX,            // a triangle names a vertex that does not exist
    SSS_ERROR_OVERFLOW,         // a size in bytes does not fit into size_t
    SSS_ERROR_OUT_OF_MEMORY,    // the allocator returned NULL
    SSS_ERROR_CANCELLED,        // hooks.progress asked to stop
    SSS_ERROR_NOT_FOUND,        // no entry of that name
    SSS_ERROR_BAD_DATA,         // saved data is truncated, misaligned or corrupt
    SSS_ERROR_BAD_VERSION,      // saved data has another format version or byte order
    SSS_ERROR_MISMATCH          // saved data was computed from another mesh or material
} sss_result;

// Services of the caller. All optional: a zeroed struct, or NULL in its place, means malloc and free, one
// thread, silence. The library copies the struct; `user` must outlive the objects made with it.
typedef struct sss_hooks
{
    void *user;                                         // handed back to every function below
    void *(*allocate)(void *user, size_t bytes);        // aligned as malloc's; NULL on failure
    void (*release)(void *user, void *pointer);         // required when allocate is given; never called with NULL
    // Calls task(context, begin, end) on ranges that cover [0, count) once each, in any order, on any threads,
    // and returns when all are done. Results never depend on how it splits.
    void (*parallel_for)(void *user, size_t count, void (*task)(void *context, size_t begin, size_t end),
                         void *context);
    int (*progress)(void *user, double fraction);       // fraction in [0,1], from the calling thread; nonzero cancels
} sss_hooks;

// A view of the caller's triangle mesh; never modified, never kept beyond what a function says.
typedef struct sss_mesh
{
    const float *positions;     // [3 vertex_count], in units of mm_per_unit millimetres
    const float *normals;       // [3 vertex_count], outward, any length; NULL where a function allows it
    const uint32_t *triangles;  // [3 triangle_count], indices below vertex_count, counter-clockwise from outside
    size_t vertex_count;
    size_t triangle_count;
    double mm_per_unit;         // 1e-100 .. 1e100; required: a wrong scale is the commonest mistake in the field
} sss_mesh;

// What a pipeline needs to know of a material, per RGB channel.        Jensen et al. 2001
// A channel without scattering has alpha_p = 0 and R_d = 0 everywhere; one that is also without absorption
// has z_r = z_v = 0.
typedef struct sss_profile
{
    double alpha_p[3];  // reduced albedo alpha' = sigma_s' / sigma_t', in [0,1]
    double sigma_tr[3]; // effective transport coefficient sqrt(3 sigma_a sigma_t'), 1/mm, >= 0
    double z_r[3];      // depth of the real source = mean free path 1/sigma_t', mm
    double z_v[3];      // height of the virtual source z_r (1 + 4A/3), mm
    double eta;         // index of refraction of the medium over that of the outside
    double F_internal;  // diffuse Fresnel reflectance F_dr of the boundary seen from inside, in [0,1)
    double F_external;  // the same seen from outside, in [0,1)
} sss_profile;

// A short English text for a result; never NULL, static storage.
static inline const char *sss_result_string(sss_result result)
{
    switch (result)
    {
    case SSS_OK:                     return "no error";
    case SSS_ERROR_INVALID_ARGUMENT: return "invalid argument: null, not finite or out of range";
    case SSS_ERROR_EMPTY:            return "a count is zero";
    case SSS_ERROR_INDEX:            return "a triangle index is out of range";
    case SSS_ERROR_OVERFLOW:         return "a size overflows";
    case SSS_ERROR_OUT_OF_MEMORY:    return "out of memory";
    case SSS_ERROR_CANCELLED:        return "cancelled";
    case SSS_ERROR_NOT_FOUND:        return "not found";
    case SSS_ERROR_BAD_DATA:         return "saved data is truncated or corrupt";
    case SSS_ERROR_BAD_VERSION:      return "saved data has another version or byte order";
    case SSS_ERROR_MISMATCH:         return "saved data belongs to another mesh or material";
    }
    return "unknown result";
}

#elif SSS_COMMON_VERSION != 1
#error "sss_*.h headers of different releases are mixed: take all of them from one release"
#endif
// ---- END sss common block ----

// ============================================ CONFIGURATION ============================================
// SSS_ATLAS_IMPLEMENTATION  define in exactly one source file before including: the code
// SSS_ATLAS_STATIC          makes every function static: a private copy in that source file

#if defined(SSS_ATLAS_STATIC)
#if defined(__GNUC__)
#define SSS_ATLAS_API static __attribute__((unused))
#else
#define SSS_ATLAS_API static
#endif
#else
#define SSS_ATLAS_API extern
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ================================================= API =================================================
// Unless said otherwise a function never allocates, keeps no pointer and may run concurrently; arrays are
// the caller's and must not overlap. Pointers handed out belong to the object and live as long as it does.

// ---- 1. Making an atlas ----

// How a chart is laid into the plane.
typedef enum sss_atlas_method
{
    SSS_ATLAS_ORTHOGRAPHIC = 0, // seen along the mean normal: no triangle is larger than on the surface (Lensch 5.1);
                                // charts that fold seen so are laid flat as the next one's start
    SSS_ATLAS_AREA,             // least stretch, which all but preserves areas, from a convex combination map
                                // (Yoshizawa, Belyaev, Seidel 2004; Chang 5.1)
    SSS_ATLAS_CONVEX            // a convex polygon with least stretch inside (Sander et al. 2001; Sloan 4.3)
} sss_atlas_method;

typedef struct sss_atlas_options
{
    double normal_deviation;   // of a triangle from the chart's mean normal, degrees, in (0, 85]; 0: 30 (orthographic),
                               // 50 (area, convex). Held by all but islands, and by charts too small to stand alone:
                               // these join a neighbour
    double compactness;        // how much round charts are preferred, in [0, 10]; 0: 1; negative: not at all
    double max_area;           // of a chart, mm^2; 0: no limit
    size_t max_charts;         // 0: no limit; charts are merged, beyond the deviation if they must be, until so many
                               // are left; connected parts that do not fit together are never merged
    size_t size;               // texels on a side, at most 16,384; 0: 1,024, or what texels_per_mm needs
    double texels_per_mm;      // 0: as many as fit into size; else size must be 0
    int border;                // texels around each chart that show the surface of its neighbours, at most 64; 0: 1;
                               // negative: none. A filter of 2 border + 1 texels on a side finds its true neighbours:
                               // 3 for the 7x7 kernels of Lensch
    int gutter;                // texels between charts, at most 128; 0: 2; at least 2 border are kept free
    int corners;               // of convex polygons, in [3, 64]; 0: 8; one more wherever a triangle would have all of
                               // its corners on one side, and so no area
    sss_atlas_method method;   // 0: orthographic
    int rotations;             // in which a chart is tried when packing, in [1, 64]; 0: 8
} sss_atlas_options;

typedef struct sss_atlas_stats
{
    double normal_deviation, compactness, max_area; // as resolved
    size_t max_charts, size;
    double texels_per_mm;      // one scale for all charts
    int border, gutter, corners, rotations;
    sss_atlas_method method;
    size_t triangle_count, vertex_count; // of the mesh
    size_t chart_count, split_count;     // split_count: charts that had to be divided to lie flat without overlap
    size_t atlas_vertex_count;           // after splitting at seams
    double seam_mm;            // length of all seams
    double utilisation;        // covered area of charts over that of the texture
    double stretch_l2, stretch_linf;     // Sander et al. 2001; 1 is an isometry
    double area_distortion[3]; // least, mean and largest texture area per surface area, over its mean for the mesh
    double area_share_within;  // share of the surface whose area distortion lies within a factor of 1.5
    double angle_distortion;   // mean of (larger + smaller singular value ratio)/2 over the surface; 1 is conformal
    size_t overlaps;           // pairs of triangles whose interiors meet, by exact test: 0
    size_t empty_texels;       // without surface
    size_t unseen_triangles;   // that hold no texel's centre
    double unseen_area;        // their share of the surface
    double texel_area_error;   // relative difference between the sum of all texels' areas and the mesh's
    size_t bytes;              // allocated
} sss_atlas_stats;

typedef struct sss_atlas sss_atlas; // opaque

// Cuts a mesh into charts, lays them flat and packs them. Any triangle soup: non-manifold edges and borders end a
// chart, triangles without area go with a neighbour. Bit-identical for any number of threads.
//   mesh            normals may be NULL: means of the triangles' normals weighted by angle
//   options, hooks  may be NULL: defaults
//   out             freed with sss_atlas_free; keeps no pointer to the mesh
// Allocates. SSS_ERROR_INVALID_ARGUMENT: also where the charts do not fit (more charts than texels); _EMPTY, _INDEX,
// _OVERFLOW, _OUT_OF_MEMORY, _CANCELLED.
SSS_ATLAS_API sss_result sss_atlas_create(const sss_mesh *mesh, const sss_atlas_options *options,
                                          const sss_hooks *hooks, sss_atlas **out);

// Frees an object; NULL is allowed.
SSS_ATLAS_API void sss_atlas_free(sss_atlas *atlas);

// What was chosen, and how good it is. SSS_ERROR_INVALID_ARGUMENT: null.
SSS_ATLAS_API sss_result sss_atlas_get_stats(const sss_atlas *atlas, sss_atlas_stats *out);

// ---- 2. The mesh with texture coordinates ----

// Vertices are split where charts meet: as many as needed, no more. Ready for glTF and vertex buffers.
typedef struct sss_atlas_mesh
{
    size_t vertex_count;       // A
    size_t triangle_count;     // T, in the mesh's order
    size_t chart_count;        // C
    const float *uv;           // [A][2], multiples of 2^-24: exact
    const uint32_t *vertex;    // [A] of the mesh
    const uint32_t *triangles; // [T][3], indices below A
    const uint32_t *chart;     // [T], below C
    const float *stretch;      // [T] L2 stretch of a triangle, 1 where it is laid out evenly; INFINITY without texture
                               // area
    const float *area_ratio;   // [T] A_S/A_T, mm^2 per texel; 0 without texture area
    const float *chart_normal; // [C][3] mean, unit length or 0
} sss_atlas_mesh;

// SSS_ERROR_INVALID_ARGUMENT: null.
SSS_ATLAS_API sss_result sss_atlas_get_mesh(const sss_atlas *atlas, sss_atlas_mesh *out);

// ---- 3. The surface under each texel ----

// One entry for each texel that shows surface, row by row; then one for each texel of a border, row by row.
typedef struct sss_atlas_texels
{
    size_t size;               // texels on a side
    size_t count, inner_count; // entries in all; those of charts, which come first; behind them borders
    const uint32_t *texel;     // [count] v size + u
    const uint32_t *triangle;  // [count] under the texel's centre, by the rules of rasterisation; where the centre lies
                               // outside of the chart, as in borders, the one that is reached from the nearest point of
                               // its boundary, straight on over the surface; where the surface ends, the last one
    const float *barycentric;  // [count][3] of that point
    const float *position;     // [count][3] in the mesh's units
    const float *normal;       // [count][3] interpolated, unit length or 0
    const float *area;         // [count] S(u, v) in mm^2, clipped exactly: they sum to the mesh's, as far as float
                               // reaches; 0 in borders
    const float *area_ratio;   // [count] A_S/A_T, mm^2 per texel: of the chart's own triangle with the centre or else
                               // the largest share of the texel; in borders of the one reached
    const uint32_t *entry;     // [size][size] of a texel; UINT32_MAX: none
    const uint32_t *vertex_entry; // [V] the entry nearest to a vertex, in a chart that has it; UINT32_MAX: unreferenced
    const uint32_t *entry_vertex; // [count] the vertex of the mesh that counts most in an entry
} sss_atlas_texels;

// The table is made with the atlas. SSS_ERROR_INVALID_ARGUMENT: null.
SSS_ATLAS_API sss_result sss_atlas_get_texels(const sss_atlas *atlas, sss_atlas_texels *out);

// Values of entries into an image; texels without an entry get the mean of their neighbours, `rings` texels far, and
// zero beyond, so that mipmaps and bilinear fetches stay clean.
//   values  [count][channels], finite;   image  [size][size][channels], v upwards;   channels  1 .. 16
//   rings   0 .. 1,024
// Allocates. SSS_ERROR_INVALID_ARGUMENT, _OUT_OF_MEMORY.
SSS_ATLAS_API sss_result sss_atlas_fill_image(const sss_atlas *atlas, const float *values, size_t channels,
                                              size_t rings, float *image);

// What a bilinear fetch finds at points of the surface: as a GPU does, clamped at the edge of the image.
//   triangle  [count];   barycentric  [count][3], finite, adding up to 1; beyond [0, 1] along the triangle's plane
//   image     [size][size][channels], v upwards; what is not finite is passed on;   channels  1 .. 16
//   out       [count][channels]; caller-owned; must not overlap the others
// Never allocates; reentrant. SSS_ERROR_INVALID_ARGUMENT: null (for count = 0, too), out of range, a barycentric that
// is not finite; _INDEX: a triangle >= T; out untouched then.
SSS_ATLAS_API sss_result sss_atlas_fetch(const sss_atlas *atlas, const float *image, size_t channels,
                                         const uint32_t *triangle, const float *barycentric, size_t count, float *out);

// ---- 4. Keeping it ----

// Writes all of it. write  gets bytes in order; nonzero stops with SSS_ERROR_CANCELLED.
typedef int (*sss_atlas_write)(void *user, const void *bytes, size_t count);
SSS_ATLAS_API sss_result sss_atlas_save(const sss_atlas *atlas, sss_atlas_write write, void *user);

// Reads it back for the same mesh, with the same normals or again without. Safe on any bytes.
//   read  fills count bytes; nonzero: there are no more
// Allocates. SSS_ERROR_BAD_DATA, _BAD_VERSION, _MISMATCH (another mesh), _INVALID_ARGUMENT, _OUT_OF_MEMORY.
typedef int (*sss_atlas_read)(void *user, void *bytes, size_t count);
SSS_ATLAS_API sss_result sss_atlas_load(const sss_mesh *mesh, sss_atlas_read read, void *user, const sss_hooks *hooks,
                                        sss_atlas **out);

// ---- 5. GLSL ----

typedef enum sss_atlas_glsl_piece
{
    SSS_ATLAS_GLSL_PLACE = 0, // vec4 sss_atlas_place(vec2 uv): clip coordinates that rasterise a mesh into its atlas
    SSS_ATLAS_GLSL_DILATE     // vec4 sss_atlas_dilate(sampler2D image, ivec2 texel): one ring of fill; alpha 0 is empty
} sss_atlas_glsl_piece;

// NULL for an unknown piece; static storage; under 4,095 characters.
SSS_ATLAS_API const char *sss_atlas_glsl(sss_atlas_glsl_piece piece);

#ifdef __cplusplus
}
#endif

// ================================================ GLSL =================================================
// The shader pieces, as readable source, each with its own include guard; they have no #version line.

#define SSS_ATLAS__GLSL_PLACE                                                                                   \
    "#ifndef SSS_ATLAS_PLACE\n"                                                                                 \
    "#define SSS_ATLAS_PLACE\n"                                                                                 \
    "#ifdef GL_ES\n"                                                                                            \
    "precision highp float;\n"                                                                                  \
    "#endif\n"                                                                                                  \
    "// gl_Position of a vertex with texture coordinates uv, for a viewport as large as the atlas: a fragment of\n" \
    "// the mesh lands on its texel. Culling, depth test and multisampling are to be off.\n"                    \
    "vec4 sss_atlas_place(vec2 uv)\n"                                                                           \
    "{\n"                                                                                                       \
    "    return vec4(2.0 * uv - 1.0, 0.0, 1.0);\n"                                                              \
    "}\n"                                                                                                       \
    "#endif\n"

#define SSS_ATLAS__GLSL_DILATE                                                                                  \
    "#ifndef SSS_ATLAS_DILATE\n"                                                                                \
    "#define SSS_ATLAS_DILATE\n"                                                                                \
    "#ifdef GL_ES\n"                                                                                            \
    "precision highp float;\n"                                                                                  \
    "precision highp sampler2D;\n"                                                                              \
    "#endif\n"                                                                                                  \
    "// A texel that shows nothing (alpha 0) gets the mean of those of its eight neighbours that show something,\n" \
    "// with alpha 1; others stay. Draw it once for each ring, from one image into another.\n"                  \
    "vec4 sss_atlas_dilate(sampler2D image, ivec2 texel)\n"                                                     \
    "{\n"                                                                                                       \
    "    ivec2 size = textureSize(image, 0);\n"                                                                 \
    "    vec4 center = texelFetch(image, texel, 0);\n"                                                          \
    "    vec3 sum = vec3(0.0);\n"                                                                               \
    "    float count = 0.0;\n"                                                                                  \
    "    if (center.a > 0.0)\n"                                                                                 \
    "    {\n"                                                                                                   \
    "        return center;\n"                                                                                  \
    "    }\n"                                                                                                   \
    "    for (int k = 0; k < 9; k++)\n"                                                                         \
    "    {\n"                                                                                                   \
    "        ivec2 at = texel + ivec2(k % 3 - 1, k / 3 - 1);\n"                                                 \
    "        if (all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, size)))\n"                             \
    "        {\n"                                                                                               \
    "            vec4 value = texelFetch(image, at, 0);\n"                                                      \
    "            sum += value.a > 0.0 ? value.rgb : vec3(0.0);\n"                                               \
    "            count += value.a > 0.0 ? 1.0 : 0.0;\n"                                                         \
    "        }\n"                                                                                               \
    "    }\n"                                                                                                   \
    "    return count > 0.0 ? vec4(sum / count, 1.0) : vec4(0.0);\n"                                            \
    "}\n"                                                                                                       \
    "#endif\n"

#endif // SSS_ATLAS_H

// ============================================ IMPLEMENTATION ============================================
// In the order of the pipeline:
//   memory, small maths         what everything uses
//   topology                    areas, normals, twins of edges
//   charts                      grown, merged, divided; their vertices and boundary loops
//   laying flat                 orthographic, least stretch, convex polygons; whether a chart overlaps itself
//   packing                     minimal boxes, bitmaps, one scale; exact coordinates and exact overlaps
//   texels                      areas by exact clipping, centres by rasterisation, borders by walking over the surface
//   quality                     stretch and the rest of the stats
//   the object                  creating, reading, saving, shaders

#ifdef SSS_ATLAS_IMPLEMENTATION
#ifndef SSS_ATLAS_IMPLEMENTED
#define SSS_ATLAS_IMPLEMENTED

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SSS_ATLAS__PI 3.14159265358979323846
#define SSS_ATLAS__NONE UINT32_MAX   // no triangle, no edge, no chart
#define SSS_ATLAS__UNITS 16777216    // texture coordinates are multiples of 2^-24, which float holds exactly

// ---- memory ----

// Blocks of one computation, freed together on any way out.
typedef struct sss_atlas__block
{
    struct sss_atlas__block *next, *previous;
    size_t bytes;
    size_t pad; // what follows is aligned as malloc's
} sss_atlas__block;

typedef struct sss_atlas__memory
{
    sss_hooks hooks;
    sss_atlas__block *first;
    size_t bytes;
    int failed; // something could not be allocated
} sss_atlas__memory;

// Zeroed; NULL, with m->failed set, where memory ends. From the calling thread only, never inside of tasks.
static void *sss_atlas__take(sss_atlas__memory *m, size_t count, size_t size)
{
    const size_t head = sizeof(sss_atlas__block);
    sss_atlas__block *block = NULL;
    size_t bytes;
    count = count > 0 ? count : 1;
    if (count <= (SIZE_MAX - head) / size)
    {
        bytes = head + count * size;
        block = (sss_atlas__block *)(m->hooks.allocate != NULL ? m->hooks.allocate(m->hooks.user, bytes)
                                                               : calloc(1, bytes)); // fresh pages are zero already
    }
    if (block == NULL)
    {
        m->failed = 1;
        return NULL;
    }
    if (m->hooks.allocate != NULL)
    {
        memset(block, 0, bytes);
    }
    block->bytes = bytes;
    block->previous = NULL;
    block->next = m->first;
    if (m->first != NULL)
    {
        m->first->previous = block;
    }
    m->first = block;
    m->bytes += bytes;
    return block + 1;
}

static void sss_atlas__drop(sss_atlas__memory *m, void *pointer)
{
    if (pointer != NULL)
    {
        sss_atlas__block *block = (sss_atlas__block *)pointer - 1;
        if (block->previous != NULL)
        {
            block->previous->next = block->next;
        }
        else
        {
            m->first = block->next;
        }
        if (block->next != NULL)
        {
            block->next->previous = block->previous;
        }
        m->bytes -= block->bytes;
        if (m->hooks.release != NULL)
        {
            m->hooks.release(m->hooks.user, block);
        }
        else if (m->hooks.allocate == NULL)
        {
            free(block);
        }
    }
}

static void sss_atlas__drop_all(sss_atlas__memory *m)
{
    while (m->first != NULL)
    {
        sss_atlas__drop(m, m->first + 1);
    }
}

static void sss_atlas__parallel(const sss_hooks *hooks, size_t count,
                                void (*task)(void *context, size_t begin, size_t end), void *context)
{
    if (hooks->parallel_for != NULL)
    {
        hooks->parallel_for(hooks->user, count, task, context);
    }
    else
    {
        task(context, 0, count);
    }
}

// ---- small maths ----

static double sss_atlas__min(double a, double b)
{
    return a < b ? a : b;
}

static double sss_atlas__max(double a, double b)
{
    return a > b ? a : b;
}

static double sss_atlas__dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void sss_atlas__cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double sss_atlas__length(const double a[3])
{
    return sqrt(sss_atlas__dot(a, a));
}

// Unit length; zero stays zero.
static void sss_atlas__normalize(double a[3])
{
    const double length = sss_atlas__length(a);
    int i;
    for (i = 0; i < 3 && length > 0.0; i++)
    {
        a[i] /= length;
    }
}

// Twice the signed area of a triangle.
static double sss_atlas__orient(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// The same of grid coordinates, exactly: 25 bits and a sign each, 53 bits in the end.
static int64_t sss_atlas__orient_grid(const int32_t a[2], const int32_t b[2], const int32_t c[2])
{
    return ((int64_t)b[0] - a[0]) * ((int64_t)c[1] - a[1]) - ((int64_t)b[1] - a[1]) * ((int64_t)c[0] - a[0]);
}

static int sss_atlas__finite(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (bits & 0x7ff0000000000000u) != 0x7ff0000000000000u;
}

// ---- what the stages hand on ----

// A chart as it is gathered: ranges of the build's arrays.
typedef struct sss_atlas__chart
{
    uint32_t first_triangle, triangle_count; // of chart_triangles
    uint32_t first_vertex, vertex_count;     // atlas vertices
    uint32_t first_loop, loop_count;         // of loops: boundaries; none: closed
    double normal[3];                        // mean by area, unit length or 0
    double area;                             // mm^2
    int is_disk;                             // one loop, Euler characteristic 1, every vertex simple
    int is_flat;                             // laid flat, without overlap
} sss_atlas__chart;

// An edge 3 t + k runs from corner k of triangle t to corner (k + 1) % 3. Corners are numbered alike.
typedef struct sss_atlas__build
{
    sss_atlas__memory memory;
    sss_atlas_options options;  // as resolved
    size_t vertex_count, triangle_count;
    const uint32_t *triangles;  // [T][3], the caller's
    double mm;                  // of one unit of length in this struct, in which the diagonal of the box is in [1, 2),
                                // so that nothing over- or underflows. Where it says mm, options too, it is meant
    double (*x)[3];             // [V] mm, from the center of the box of what triangles refer to
    // topology
    double (*normal)[3];        // [T] unit length; 0 without area
    double *area;               // [T] mm^2
    uint32_t *twin;             // [3 T] the edge on the other side; NONE on borders, where more than two triangles
                                // meet, where windings disagree
    // charts
    uint32_t *chart_of;         // [T]
    size_t chart_count, split_count;
    // as gathered: anew whenever charts change
    sss_atlas__chart *charts;   // [chart_count], room for T
    uint32_t *chart_triangles;  // [T] triangles, chart by chart, each in rising order
    size_t atlas_vertex_count;  // A, at most 3 T
    uint32_t *corner;           // [3 T] atlas vertex; those of a chart are consecutive
    uint32_t *vertex;           // [A] mesh vertex; room for 3 T
    size_t loop_count;
    uint32_t *loops;            // [loop_count + 1] begin of each in loop_edges; room for 3 T + 1
    uint32_t *loop_edges;       // boundary edges in order, with the chart on their left: the next one starts where one
                                // ends; room for 3 T
    // laid flat
    double (*uv)[2];            // [A] mm
    double (*corner_uv)[2];     // [3 T] the same by corner: survives gathering anew
    unsigned char *bad;         // [T] of charts that did not lie flat: triangles that fold, seen along the mean normal
    // packed
    double texels_per_mm;
    int32_t (*grid)[2];         // [A] texture coordinates times SSS_ATLAS__UNITS, in [0, UNITS]
} sss_atlas__build;

// The finished object.
struct sss_atlas
{
    sss_atlas__memory memory;  // of the arrays below
    sss_atlas_stats stats;
    uint64_t mesh_hash;        // of what it was made for
    // the mesh with texture coordinates
    float (*uv)[2];            // [A]
    uint32_t *vertex;          // [A]
    uint32_t *triangles;       // [3 T]
    uint32_t *chart;           // [T]
    float *stretch;            // [T]
    float *triangle_area_ratio; // [T]
    float (*chart_normal)[3];  // [C]
    // texels
    size_t texel_count, inner_count;
    uint32_t *texel;           // [count]
    uint32_t *texel_triangle;  // [count]
    float (*barycentric)[3];   // [count]
    float (*position)[3];      // [count]
    float (*normal)[3];        // [count]
    float *area;               // [count]
    float *area_ratio;         // [count]
    uint32_t *entry;           // [size * size]
    uint32_t *vertex_entry;    // [V]
    uint32_t *entry_vertex;    // [count]
};


// ---- topology ----

// Next and previous edge of the same triangle.
static uint32_t sss_atlas__next(uint32_t e)
{
    return e % 3 == 2 ? e - 2 : e + 1;
}

static uint32_t sss_atlas__previous(uint32_t e)
{
    return e % 3 == 0 ? e + 2 : e - 1;
}

// Whether a corner comes twice: such a triangle has no place in the topology, its neighbours meet across it.
static int sss_atlas__collapsed(const uint32_t t[3])
{
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

static void sss_atlas__measure_triangles(void *context, size_t begin, size_t end)
{
    sss_atlas__build *b = (sss_atlas__build *)context;
    size_t t;
    int i;
    for (t = begin; t < end; t++)
    {
        const double *p = b->x[b->triangles[3 * t]], *q = b->x[b->triangles[3 * t + 1]];
        const double *r = b->x[b->triangles[3 * t + 2]];
        double u[3], v[3];
        for (i = 0; i < 3; i++)
        {
            u[i] = q[i] - p[i];
            v[i] = r[i] - p[i];
        }
        sss_atlas__cross(u, v, b->normal[t]);
        b->area[t] = 0.5 * sss_atlas__length(b->normal[t]);
        sss_atlas__normalize(b->normal[t]);
    }
}

// One pass of a radix sort of edges: stable, by their larger or smaller end. first  [V + 1], zeroed here.
static void sss_atlas__sort_edges(const sss_atlas__build *b, int larger, const uint32_t *in, size_t count,
                                  uint32_t *first, uint32_t *out)
{
    size_t i;
    memset(first, 0, (b->vertex_count + 1) * sizeof *first);
    for (i = 0; i < count; i++)
    {
        const uint32_t p = b->triangles[in[i]], q = b->triangles[sss_atlas__next(in[i])];
        first[((p > q) == (larger != 0) ? p : q) + 1]++;
    }
    for (i = 0; i < b->vertex_count; i++)
    {
        first[i + 1] += first[i];
    }
    for (i = 0; i < count; i++)
    {
        const uint32_t p = b->triangles[in[i]], q = b->triangles[sss_atlas__next(in[i])];
        out[first[(p > q) == (larger != 0) ? p : q]++] = in[i];
    }
}

// Twins are two edges with the same ends, that run in opposite directions, and no third one: in O(T + V) for any
// valence. Sorted by both ends, all edges between two vertices lie side by side.
static void sss_atlas__find_twins(sss_atlas__build *b, uint32_t *first, uint32_t *edges, uint32_t *sorted)
{
    size_t count = 0, i, j, t;
    for (t = 0; t < b->triangle_count; t++)
    {
        for (i = 3 * t; i < 3 * t + 3; i++)
        {
            b->twin[i] = SSS_ATLAS__NONE;
            if (!sss_atlas__collapsed(b->triangles + 3 * t))
            {
                edges[count++] = (uint32_t)i;
            }
        }
    }
    sss_atlas__sort_edges(b, 1, edges, count, first, sorted);
    sss_atlas__sort_edges(b, 0, sorted, count, first, edges);
    for (i = 0; i < count; i = j)
    {
        const uint32_t p = b->triangles[edges[i]], q = b->triangles[sss_atlas__next(edges[i])];
        for (j = i + 1; j < count; j++)
        {
            const uint32_t r = b->triangles[edges[j]], s = b->triangles[sss_atlas__next(edges[j])];
            if (!((r == p && s == q) || (r == q && s == p)))
            {
                break;
            }
        }
        if (j - i == 2 && b->triangles[edges[i + 1]] == q)
        {
            b->twin[edges[i]] = edges[i + 1];
            b->twin[edges[i + 1]] = edges[i];
        }
    }
}

static sss_result sss_atlas__prepare(sss_atlas__build *b)
{
    const size_t T = b->triangle_count;
    sss_atlas__memory *m = &b->memory;
    uint32_t *first = (uint32_t *)sss_atlas__take(m, b->vertex_count + 1, sizeof *first);
    uint32_t *edges = (uint32_t *)sss_atlas__take(m, 3 * T, sizeof *edges);
    uint32_t *sorted = (uint32_t *)sss_atlas__take(m, 3 * T, sizeof *sorted);
    b->normal = (double (*)[3])sss_atlas__take(m, T, sizeof *b->normal);
    b->area = (double *)sss_atlas__take(m, T, sizeof *b->area);
    b->twin = (uint32_t *)sss_atlas__take(m, 3 * T, sizeof *b->twin);
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_atlas__parallel(&m->hooks, T, sss_atlas__measure_triangles, b);
    sss_atlas__find_twins(b, first, edges, sorted);
    sss_atlas__drop(m, first);
    sss_atlas__drop(m, edges);
    sss_atlas__drop(m, sorted);
    return SSS_OK;
}

// ---- charts ----
// Charts are connected over twins. Triangles' normals lie within a deviation of the chart's mean (Lensch 5.1), except
// for a few per cent of its area: without them every bump of a scanned surface would become a chart.
//   1. Small cells grow from seeds in flat places until they bend too far.
//   2. Neighbouring cells are merged, best first, while the union obeys the deviation.
//   3. Charts, the smallest first, are handed out to their neighbours, where these may take every triangle.
//   4. Charts with arms and bays are halved across; the pieces merge anew where that is round. In a
//      texture, arms and bays cost more than a few more charts do: 5 to 10 % of it.
//   5. What is smooth is put together once more, several charts at a time; specks are absorbed, outlines shortened.
// All growing anew from the charts' centers, as in Lloyd's method, was tried between 2 and 3: outlines are 1 % shorter,
// but there are a fifth more charts.

#define SSS_ATLAS__MARGIN 0.97         // of the deviation: means still move a little when outlines are shortened
#define SSS_ATLAS__ROUGH 0.25         // of the spread of the normals around, which lean away from their mean so far ...
#define SSS_ATLAS__ROUGH_ANGLE 1.0    // ... and by these degrees: smoothly curved surfaces are not rough
#define SSS_ATLAS__CELL 0.6           // deviation of cells, of the whole: small enough to be put together well
#define SSS_ATLAS__SETTLED 16         // triangles whose mean normal is the direction of a cell
#define SSS_ATLAS__SMOOTHING_ROUNDS 6 // of outlines: they end by themselves, mostly before
#define SSS_ATLAS__BEND 4.0           // how much slower charts grow where normals reach the deviation
#define SSS_ATLAS__OUTLINE 0.5        // what outlines count in merging, over the deviation
#define SSS_ATLAS__EXCESS_SHARE 0.08  // of a chart's rough area may exceed the deviation
#define SSS_ATLAS__EXCESS 1.5         // by this factor ...
#define SSS_ATLAS__OUTLIER_SHARE 0.005 // ... but for this share ...
#define SSS_ATLAS__GRAZING 80.0       // ... up to this angle in degrees: projection along the mean shows them still
#define SSS_ATLAS__HIDDEN 89.0        // degrees: beyond, projection along the mean shows nothing
#define SSS_ATLAS__SMALL 0.003        // a chart with no more of the surface is small: neighbours that take it over ...
#define SSS_ATLAS__SMALL_EXCESS_SHARE 0.15  // ... may exceed the deviation with this share
#define SSS_ATLAS__SMALL_OUTLIER_SHARE 0.04 // ... and its excess with this
#define SSS_ATLAS__GAIN 1.02          // a chart that has grown by this much is measured anew: half a degree
#define SSS_ATLAS__WORK 100           // at most so many times as many triangles as there are are measured
#define SSS_ATLAS__SPECK_TRIANGLES 8  // a chart of so few triangles ...
#define SSS_ATLAS__SPECK_SHARE 0.05   // ... with this share of a neighbour's area is absorbed by it
#define SSS_ATLAS__PAIR_SHARE 1e-4    // two lone triangles of so little of the surface may unfold as one chart
#define SSS_ATLAS__ROUNDEST 1.6       // outline^2 / (4 pi area) that charts may have, however compact: 1 is a disk, and
                                      // edges of triangles make outlines longer than they look
#define SSS_ATLAS__SPREAD 2.4         // what is added to that, over the compactness
#define SSS_ATLAS__CUT_FROM 0.75      // of this limit: what charts are halved from that are further from round
#define SSS_ATLAS__CUTTING_ROUNDS 4   // of halving: a sixteenth
#define SSS_ATLAS__LEAST_CUT 0.001    // halves are no smaller than this much of the surface
#define SSS_ATLAS__UNITED 8           // charts of a smooth surface that may become one together
#define SSS_ATLAS__NEARLY_SMOOTH 0.25 // is rough of them at most: at borders, means are askew
#define SSS_ATLAS__FEW_PAIRS 64       // charts with more neighbours are left out of that: it takes O(n) then
#define SSS_ATLAS__NORMALS_KEPT 4096  // normals of larger charts are put together where they are within 1/64

typedef struct sss_atlas__heap_entry
{
    double key;
    uint32_t item, tag; // ties go by item, then by tag
} sss_atlas__heap_entry;

typedef struct sss_atlas__heap
{
    sss_atlas__heap_entry *entries;
    size_t count, room;
} sss_atlas__heap;

// A chart that is growing.
typedef struct sss_atlas__region
{
    double sum[3];   // of normals times areas
    double axis[3];  // mean normal
    double area;
    double outline;  // length of its boundary
    double whole;    // area when it was measured last
    double rough;    // area of rough places
    double excess[2]; // area beyond the deviation, and beyond its excess
    double point[3]; // mean of centers, by area
    uint32_t seed, triangle_count;
    // of merging
    uint32_t parent;      // itself as long as it is a chart
    uint32_t first, last; // ranges of normals: those of the regions it was merged from
    uint32_t next_range, normals_begin, normals_end; // its own, before merging
    uint32_t side;        // first of the list of its pairs
    uint32_t degree;      // length of that list
    int whole_stays;      // of cutting: halves would be no better
} sss_atlas__region;

typedef struct sss_atlas__facing
{
    double normal[3], area;
} sss_atlas__facing;

// Two regions that share edges. Side 2 p of pair p is in the list of region[0], side 2 p + 1 in that of region[1].
typedef struct sss_atlas__pair
{
    uint32_t region[2]; // equal: gone
    uint32_t next[2];
    double length; // of what they share
} sss_atlas__pair;

// Which unions are allowed.
typedef struct sss_atlas__rule
{
    double near, far;   // cosines: of the deviation, of the one that a few per cent of the area may reach
    double last;        // and of the one that nothing may reach
    double share[2];    // of the area beyond the first and the second
    double scale;       // 1 - cosine of the deviation: what costs are measured by
    double roundest;    // what unions may have of outline^2 / (4 pi area)
    int specks;         // only specks, with any neighbour
    size_t least;       // number of charts to stop at
} sss_atlas__rule;

typedef struct sss_atlas__grower
{
    sss_atlas__build *b;
    double compactness;
    double near, far, last; // cosines of the deviation, of its excess, of what cannot be seen
    double scale;           // 1 minus the cosine of the deviation
    double share[2];        // of a chart's rough area may exceed the deviation, and its excess
    double area;            // of the surface
    size_t work;            // triangles measured
    double (*center)[3]; // [T]
    unsigned char *rough; // [T] the normal leans away from the mean of those around it
    uint32_t *order;     // [T] flat places first
    uint32_t *queue;     // [T] the next triangle of the same region
    sss_atlas__heap heap;
    sss_atlas__region *regions; // [T]
    size_t count;
    sss_atlas__facing *facings; // [3 T/2] normals, region by region; so many because they serve as scratch first
    sss_atlas__pair *pairs;     // [3 T/2]
    size_t pair_count;
    uint32_t *table; // of pairs, by both regions
    size_t table_size, table_used;
} sss_atlas__grower;

static int sss_atlas__before(const sss_atlas__heap_entry *a, const sss_atlas__heap_entry *b)
{
    if (a->key < b->key || a->key > b->key)
    {
        return a->key < b->key;
    }
    return a->item != b->item ? a->item < b->item : a->tag < b->tag;
}

// What finds no room is left out: callers make enough.
static void sss_atlas__push(sss_atlas__heap *h, double key, uint32_t item, uint32_t tag)
{
    sss_atlas__heap_entry entry;
    size_t i = h->count;
    entry.key = key;
    entry.item = item;
    entry.tag = tag;
    if (h->count == h->room)
    {
        return;
    }
    for (h->count++; i > 0 && sss_atlas__before(&entry, &h->entries[(i - 1) / 2]); i = (i - 1) / 2)
    {
        h->entries[i] = h->entries[(i - 1) / 2];
    }
    h->entries[i] = entry;
}

// The least; only where count > 0.
static sss_atlas__heap_entry sss_atlas__pop(sss_atlas__heap *h)
{
    const sss_atlas__heap_entry top = h->entries[0], last = h->entries[--h->count];
    size_t i = 0, child;
    for (; (child = 2 * i + 1) < h->count; i = child)
    {
        if (child + 1 < h->count && sss_atlas__before(&h->entries[child + 1], &h->entries[child]))
        {
            child++;
        }
        if (!sss_atlas__before(&h->entries[child], &last))
        {
            break;
        }
        h->entries[i] = h->entries[child];
    }
    h->entries[i] = last;
    return top;
}

static double sss_atlas__distance(const double a[3], const double b[3])
{
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sss_atlas__length(d);
}

static double sss_atlas__edge_length(const sss_atlas__build *b, uint32_t e)
{
    return sss_atlas__distance(b->x[b->triangles[e]], b->x[b->triangles[sss_atlas__next(e)]]);
}

static double sss_atlas__cosine(double degrees)
{
    return cos(degrees * SSS_ATLAS__PI / 180.0);
}

// Triangles by how flat their surroundings are: the length of the mean of normals around them, four triangles far.
// mean  [2][T][3] scratch; what is left in the first half are the smoothed normals.
static void sss_atlas__order_by_flatness(sss_atlas__grower *g, double (*mean)[3])
{
    enum {ROUNDS = 4, BUCKETS = 256};
    const sss_atlas__build *b = g->b;
    const size_t T = b->triangle_count;
    const double least = sss_atlas__cosine(SSS_ATLAS__ROUGH_ANGLE);
    size_t start[BUCKETS + 1], t;
    int round, i, k;
    for (t = 0; t < T; t++)
    {
        memcpy(mean[t], b->normal[t], sizeof mean[t]);
    }
    for (round = 0; round < ROUNDS; round++)
    {
        double (*from)[3] = mean + (round % 2 == 0 ? 0 : T), (*to)[3] = mean + (round % 2 == 0 ? T : 0);
        for (t = 0; t < T; t++)
        {
            double sum[3] = {from[t][0], from[t][1], from[t][2]}, n = 1.0;
            for (k = 0; k < 3; k++)
            {
                const uint32_t e = b->twin[3 * t + (size_t)k];
                for (i = 0; i < 3 && e != SSS_ATLAS__NONE; i++)
                {
                    sum[i] += from[e / 3][i];
                }
                n += e != SSS_ATLAS__NONE ? 1.0 : 0.0;
            }
            for (i = 0; i < 3; i++)
            {
                to[t][i] = sum[i] / n;
            }
        }
    }
    memset(start, 0, sizeof start);
    for (t = 0; t < T; t++)
    {
        start[(size_t)((BUCKETS - 1) * (1.0 - sss_atlas__min(1.0, sss_atlas__length(mean[t])))) + 1]++;
    }
    for (i = 0; i < BUCKETS; i++)
    {
        start[i + 1] += start[i];
    }
    for (t = 0; t < T; t++)
    {
        const double length = sss_atlas__length(mean[t]), bent = 1.0 - sss_atlas__min(1.0, length);
        const double c = length > 0.0 ? sss_atlas__dot(mean[t], b->normal[t]) / length : 0.0;
        g->order[start[(size_t)((BUCKETS - 1) * bent)]++] = (uint32_t)t;
        // the angle to the mean over the spread of normals around, whose square is 2 (1 - length)
        g->rough[t] = c < least && 1.0 - c * c > SSS_ATLAS__ROUGH * SSS_ATLAS__ROUGH * 2.0 * bent;
    }
}

// 0: a triangle obeys the deviation from a region's axis; 1, 2: it exceeds it; 3: it could not be seen.
static int sss_atlas__beyond(const sss_atlas__grower *g, const sss_atlas__region *r, uint32_t t)
{
    const double d = g->b->area[t] > 0.0 ? sss_atlas__dot(g->b->normal[t], r->axis) : 1.0;
    return d >= g->near ? 0 : d >= g->far ? 1 : d >= g->last ? 2 : 3;
}

// Adds a triangle to a region, or takes it away: sign -1. The axis stays.
static void sss_atlas__add_triangle(sss_atlas__grower *g, sss_atlas__region *r, uint32_t t, int sign)
{
    const sss_atlas__build *b = g->b;
    const double area = sign * b->area[t];
    const int beyond = sss_atlas__beyond(g, r, t);
    int i;
    for (i = 0; i < 3; i++)
    {
        r->sum[i] += area * b->normal[t][i];
        r->point[i] += area * g->center[t][i];
    }
    r->area += area;
    r->rough += g->rough[t] ? area : 0.0;
    r->excess[0] += beyond > 0 ? area : 0.0;
    r->excess[1] += beyond > 1 ? area : 0.0;
    r->triangle_count = sign > 0 ? r->triangle_count + 1 : r->triangle_count - 1;
}

static void sss_atlas__set_axis(sss_atlas__region *r)
{
    memcpy(r->axis, r->sum, sizeof r->axis);
    sss_atlas__normalize(r->axis);
}

// Whether a region may take one more triangle.
static int sss_atlas__may_take(const sss_atlas__grower *g, const sss_atlas__region *r, uint32_t t)
{
    const double area = g->b->area[t], limit = g->b->options.max_area;
    const int beyond = sss_atlas__beyond(g, r, t);
    return r->triangle_count == 0 ||
           ((limit <= 0.0 || r->area + area <= limit) &&
            (beyond == 0 || (beyond < 3 && r->excess[0] + area <= g->share[0] * r->rough &&
                             (beyond < 2 || r->excess[1] + area <= g->share[1] * r->rough))));
}

// Offers the neighbours of a triangle to its region.
static void sss_atlas__offer(sss_atlas__grower *g, uint32_t t, uint32_t region, double key)
{
    const sss_atlas__build *b = g->b;
    const sss_atlas__region *r = &g->regions[region];
    int k;
    for (k = 0; k < 3; k++)
    {
        const uint32_t e = b->twin[3 * t + (uint32_t)k], u = e / 3;
        if (e != SSS_ATLAS__NONE && b->chart_of[u] == SSS_ATLAS__NONE && sss_atlas__may_take(g, r, u))
        {
            const double bent = b->area[u] > 0.0 ? (1.0 - sss_atlas__dot(b->normal[u], r->axis)) / g->scale : 0.0;
            const double step = sss_atlas__distance(g->center[t], g->center[u]);
            sss_atlas__push(&g->heap, key + step * (g->compactness + SSS_ATLAS__BEND * sss_atlas__max(0.0, bent)), u,
                            region);
        }
    }
}

// Lets the regions in the heap grow until nothing is left that they may take: Dijkstra's algorithm from all seeds at
// once. A step costs its length, more where the triangle leans away from the region's axis.
//   settled  triangles from which on a region's axis stays
static void sss_atlas__grow(sss_atlas__grower *g, uint32_t settled)
{
    sss_atlas__build *b = g->b;
    while (g->heap.count > 0)
    {
        const sss_atlas__heap_entry entry = sss_atlas__pop(&g->heap);
        sss_atlas__region *r = &g->regions[entry.tag];
        if (b->chart_of[entry.item] != SSS_ATLAS__NONE || !sss_atlas__may_take(g, r, entry.item))
        {
            continue;
        }
        b->chart_of[entry.item] = entry.tag;
        sss_atlas__add_triangle(g, r, entry.item, 1);
        if (r->area > 0.0 && r->triangle_count <= settled)
        {
            sss_atlas__set_axis(r);
        }
        sss_atlas__offer(g, entry.item, entry.tag, entry.key);
    }
}

static void sss_atlas__start_region(sss_atlas__region *r, uint32_t seed)
{
    memset(r, 0, sizeof *r);
    r->seed = seed;
}

// Seeds for whatever has no chart, in flat places first; each grows at once, up to a deviation with a cosine.
static void sss_atlas__seed_rest(sss_atlas__grower *g, double cosine)
{
    const sss_atlas__build *b = g->b;
    const double near = g->near;
    size_t i;
    g->near = cosine;
    for (i = 0; i < b->triangle_count; i++)
    {
        const uint32_t t = g->order[i];
        if (b->chart_of[t] == SSS_ATLAS__NONE)
        {
            sss_atlas__region *r = &g->regions[g->count];
            sss_atlas__start_region(r, t);
            memcpy(r->axis, b->normal[t], sizeof r->axis);
            g->heap.count = 0;
            sss_atlas__push(&g->heap, 0.0, t, (uint32_t)g->count++);
            sss_atlas__grow(g, SSS_ATLAS__SETTLED);
        }
    }
    g->near = near;
}

// ---- merging of charts ----

static size_t sss_atlas__pair_slot(const sss_atlas__grower *g, uint32_t p, uint32_t q)
{
    const uint64_t low = p < q ? p : q, high = p < q ? q : p;
    const uint64_t h = (low * 0x9e3779b97f4a7c15u) ^ (high * 0xc2b2ae3d27d4eb4fu); // odd: any mixing will do
    return (size_t)((h ^ (h >> 29)) * 0x9e3779b97f4a7c15u >> 32) & (g->table_size - 1);
}

// The slot of a pair of regions, or the empty one where it belongs. Pairs whose regions have changed stay behind as
// garbage that matches nothing.
static size_t sss_atlas__find_pair(const sss_atlas__grower *g, uint32_t p, uint32_t q)
{
    size_t slot = sss_atlas__pair_slot(g, p, q);
    for (; g->table[slot] != SSS_ATLAS__NONE; slot = (slot + 1) & (g->table_size - 1))
    {
        const sss_atlas__pair *pair = &g->pairs[g->table[slot]];
        if ((pair->region[0] == p && pair->region[1] == q) || (pair->region[0] == q && pair->region[1] == p))
        {
            break;
        }
    }
    return slot;
}

static void sss_atlas__enter_pair(sss_atlas__grower *g, size_t slot, uint32_t pair)
{
    size_t i;
    g->table[slot] = pair;
    if (++g->table_used > g->table_size / 4 * 3) // garbage fills it: from the start; pairs need half of it at most
    {
        memset(g->table, 0xff, g->table_size * sizeof *g->table);
        g->table_used = 0;
        for (i = 0; i < g->pair_count; i++)
        {
            const sss_atlas__pair *p = &g->pairs[i];
            if (p->region[0] != p->region[1])
            {
                g->table[sss_atlas__find_pair(g, p->region[0], p->region[1])] = (uint32_t)i;
                g->table_used++;
            }
        }
    }
}

static void sss_atlas__list_side(sss_atlas__grower *g, uint32_t region, uint32_t side)
{
    g->pairs[side / 2].next[side % 2] = g->regions[region].side;
    g->regions[region].side = side;
    g->regions[region].degree++;
}

// Neighbours and outlines, from chart_of.
static void sss_atlas__find_pairs(sss_atlas__grower *g)
{
    const sss_atlas__build *b = g->b;
    size_t i;
    uint32_t e;
    g->pair_count = 0;
    g->table_used = 0;
    memset(g->table, 0xff, g->table_size * sizeof *g->table);
    for (i = 0; i < g->count; i++)
    {
        g->regions[i].side = SSS_ATLAS__NONE;
        g->regions[i].degree = 0;
        g->regions[i].outline = 0.0;
    }
    for (e = 0; e < 3 * b->triangle_count; e++)
    {
        const uint32_t f = b->twin[e], p = b->chart_of[e / 3], q = f != SSS_ATLAS__NONE ? b->chart_of[f / 3] : p;
        double length;
        size_t slot;
        if (f != SSS_ATLAS__NONE && p == q)
        {
            continue;
        }
        length = sss_atlas__edge_length(b, e);
        g->regions[p].outline += length;
        if (f == SSS_ATLAS__NONE || f < e)
        {
            continue;
        }
        slot = sss_atlas__find_pair(g, p, q);
        if (g->table[slot] == SSS_ATLAS__NONE)
        {
            const uint32_t n = (uint32_t)g->pair_count++;
            g->pairs[n].region[0] = p;
            g->pairs[n].region[1] = q;
            g->pairs[n].length = 0.0;
            sss_atlas__list_side(g, p, 2 * n);
            sss_atlas__list_side(g, q, 2 * n + 1);
            sss_atlas__enter_pair(g, slot, n);
        }
        g->pairs[g->table[sss_atlas__find_pair(g, p, q)]].length += length;
    }
}

// Normals of large charts: one for each cell of a grid of 1/64, about a degree. Returns how many are left.
static uint32_t sss_atlas__thin_normals(sss_atlas__facing *facings, uint32_t count, uint32_t *table, size_t size)
{
    uint32_t i, n = 0;
    int k;
    memset(table, 0xff, size * sizeof *table);
    for (i = 0; i < count; i++)
    {
        const sss_atlas__facing f = facings[i]; // sums of normals times areas, below n
        uint64_t h = 0;
        size_t slot;
        long cell[3], other[3];
        for (k = 0; k < 3; k++)
        {
            cell[k] = (long)floor(64.0 * f.normal[k]);
            h = (h + (uint64_t)(cell[k] + 128)) * 0x9e3779b97f4a7c15u;
        }
        for (slot = (size_t)(h >> 32) & (size - 1); table[slot] != SSS_ATLAS__NONE; slot = (slot + 1) & (size - 1))
        {
            for (k = 0; k < 3; k++)
            {
                other[k] = (long)floor(64.0 * facings[table[slot]].normal[k]);
            }
            if (other[0] == cell[0] && other[1] == cell[1] && other[2] == cell[2])
            {
                break;
            }
        }
        if (table[slot] == SSS_ATLAS__NONE)
        {
            table[slot] = n;
            facings[n++] = f; // the first normal of a cell stands for all
        }
        else
        {
            facings[table[slot]].area += f.area;
        }
    }
    return n;
}

// Normals of all regions, side by side.
static void sss_atlas__list_normals(sss_atlas__grower *g)
{
    const sss_atlas__build *b = g->b;
    uint32_t begin = 0;
    size_t i, t, size;
    for (i = 0; i < g->count; i++)
    {
        sss_atlas__region *r = &g->regions[i];
        r->normals_begin = r->normals_end = begin;
        begin += r->triangle_count;
        r->parent = r->first = r->last = (uint32_t)i;
        r->next_range = SSS_ATLAS__NONE;
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        if (b->area[t] > 0.0)
        {
            sss_atlas__facing *f = &g->facings[g->regions[b->chart_of[t]].normals_end++];
            memcpy(f->normal, b->normal[t], sizeof f->normal);
            f->area = b->area[t];
        }
    }
    for (i = 0; i < g->count; i++)
    {
        sss_atlas__region *r = &g->regions[i];
        const uint32_t count = r->normals_end - r->normals_begin;
        if (count > SSS_ATLAS__NORMALS_KEPT)
        {
            for (size = 2; size < 2 * (size_t)count; size *= 2)
            {
            }
            // the table of pairs is not in use yet, and holds twice as many as there are triangles
            r->normals_end = r->normals_begin +
                             sss_atlas__thin_normals(g->facings + r->normals_begin, count, g->table, size);
        }
    }
}

static uint32_t sss_atlas__root(sss_atlas__region *regions, uint32_t i)
{
    while (regions[i].parent != i)
    {
        regions[i].parent = regions[regions[i].parent].parent;
        i = regions[i].parent;
    }
    return i;
}

// Adds up the area of a region's normals beyond the rule's limits. Returns 0 where one is beyond the last.
static int sss_atlas__add_excess(const sss_atlas__grower *g, uint32_t region, const sss_atlas__rule *rule,
                                 const double axis[3], double rough, double excess[2])
{
    uint32_t range, i;
    for (range = g->regions[region].first; range != SSS_ATLAS__NONE; range = g->regions[range].next_range)
    {
        for (i = g->regions[range].normals_begin; i < g->regions[range].normals_end; i++)
        {
            const double d = sss_atlas__dot(g->facings[i].normal, axis);
            if (d < rule->near)
            {
                if (d < rule->last)
                {
                    return 0;
                }
                excess[0] += g->facings[i].area;
                excess[1] += d < rule->far ? g->facings[i].area : 0.0;
            }
        }
    }
    return excess[0] <= rule->share[0] * rough && excess[1] <= rule->share[1] * rough;
}

// Whether a region is so little beside its neighbour that it may go there whatever its normals. Noise that faces
// backwards makes islands.
//   any  whatever its normals: then islands may be larger, and two triangles folded onto each other are a chart
static int sss_atlas__is_speck(const sss_atlas__grower *g, const sss_atlas__region *small,
                               const sss_atlas__region *large, double shared, int any)
{
    const int few = small->triangle_count <= SSS_ATLAS__SPECK_TRIANGLES && small->rough >= 0.5 * small->area;
    if (any)
    {
        if (small->triangle_count == 1 && large->triangle_count == 1)
        {
            return small->area + large->area <= SSS_ATLAS__PAIR_SHARE * g->area && shared < 0.5 * small->outline;
        }
        if (shared > 0.999 * small->outline && small->area <= SSS_ATLAS__SPECK_SHARE * large->area) // an island
        {
            return 1;
        }
    }
    return few && small->area <= SSS_ATLAS__SPECK_SHARE * large->area;
}

// How far from a disk something is: 1, or more. Without area: 0, as it does not matter.
static double sss_atlas__unroundness(double outline, double area)
{
    return area > 0.0 ? outline * outline / (4.0 * SSS_ATLAS__PI * area) : 0.0;
}

// Whether a union has a good outline, or at least one no worse than its parts have.
static int sss_atlas__is_round(const sss_atlas__region *p, const sss_atlas__region *q, double shared, double limit)
{
    const double area = p->area + q->area, outline = sss_atlas__max(0.0, p->outline + q->outline - 2.0 * shared);
    const double mean = (p->outline * p->outline + q->outline * q->outline) / (4.0 * SSS_ATLAS__PI);
    return sss_atlas__unroundness(outline, area) * area <= sss_atlas__max(limit * area, mean);
}

static int sss_atlas__may_merge(const sss_atlas__grower *g, const sss_atlas__pair *pair, const sss_atlas__rule *rule)
{
    const sss_atlas__region *p = &g->regions[pair->region[0]], *q = &g->regions[pair->region[1]];
    const double area = p->area + q->area;
    double axis[3], excess[2] = {0.0, 0.0};
    int i;
    if (g->b->options.max_area > 0.0 && area > g->b->options.max_area)
    {
        return 0;
    }
    if (rule->specks &&
        !sss_atlas__is_speck(g, p->area < q->area ? p : q, p->area < q->area ? q : p, pair->length, rule->last < -1.0))
    {
        return 0;
    }
    if (rule->roundest > 0.0 && !sss_atlas__is_round(p, q, pair->length, rule->roundest))
    {
        return 0;
    }
    for (i = 0; i < 3; i++)
    {
        axis[i] = p->sum[i] + q->sum[i];
    }
    sss_atlas__normalize(axis);
    if (rule->specks) // what takes thousands of specks is not looked at for each
    {
        return sss_atlas__add_excess(g, pair->region[p->area < q->area ? 0 : 1], rule, axis, area, excess);
    }
    return sss_atlas__add_excess(g, pair->region[0], rule, axis, p->rough + q->rough, excess) &&
           sss_atlas__add_excess(g, pair->region[1], rule, axis, p->rough + q->rough, excess);
}

// How bad a union is: how much it bends, and how much outline it keeps.
static double sss_atlas__merging_cost(const sss_atlas__grower *g, const sss_atlas__pair *pair,
                                      const sss_atlas__rule *rule)
{
    const sss_atlas__region *p = &g->regions[pair->region[0]], *q = &g->regions[pair->region[1]];
    const double sum[3] = {p->sum[0] + q->sum[0], p->sum[1] + q->sum[1], p->sum[2] + q->sum[2]};
    const double area = p->area + q->area, least = sss_atlas__min(p->outline, q->outline);
    const double kept = least > 0.0 ? sss_atlas__max(0.0, 1.0 - pair->length / least) : 0.0;
    const double bent = area > 0.0 ? sss_atlas__max(0.0, 1.0 - sss_atlas__length(sum) / area) : 0.0;
    return rule->specks ? kept : bent / rule->scale + SSS_ATLAS__OUTLINE * g->compactness * kept;
}

// Region q becomes part of p; q has the shorter list of pairs, so that all moves together take O(n log n).
static void sss_atlas__join(sss_atlas__grower *g, uint32_t p, uint32_t q, double shared, const sss_atlas__rule *rule)
{
    sss_atlas__region *to = &g->regions[p], *from = &g->regions[q];
    uint32_t side = from->side;
    int i;
    for (i = 0; i < 3; i++)
    {
        to->sum[i] += from->sum[i];
        to->point[i] += from->point[i];
    }
    to->area += from->area;
    to->rough += from->rough;
    to->outline = sss_atlas__max(0.0, to->outline + from->outline - 2.0 * shared);
    to->triangle_count += from->triangle_count;
    g->regions[to->last].next_range = from->first;
    to->last = from->last;
    from->parent = p;
    while (side != SSS_ATLAS__NONE)
    {
        const uint32_t next = g->pairs[side / 2].next[side % 2];
        sss_atlas__pair *pair = &g->pairs[side / 2];
        const uint32_t other = pair->region[1 - side % 2];
        if (pair->region[0] != pair->region[1] && other == p)
        {
            pair->region[side % 2] = p;
        }
        else if (pair->region[0] != pair->region[1])
        {
            const size_t slot = sss_atlas__find_pair(g, p, other);
            uint32_t kept = g->table[slot];
            if (kept != SSS_ATLAS__NONE)
            {
                g->pairs[kept].length += pair->length;
                pair->region[side % 2] = other;
            }
            else
            {
                kept = side / 2;
                pair->region[side % 2] = p;
                sss_atlas__list_side(g, p, side);
                sss_atlas__enter_pair(g, slot, kept);
            }
            sss_atlas__push(&g->heap, sss_atlas__merging_cost(g, &g->pairs[kept], rule), kept, 0);
        }
        side = next;
    }
}

// Merges neighbours, the best first. Costs in the heap may be old: they are looked at again when their turn comes, and
// wait again only where they rose by more than a twentieth, so that no pair waits more than a few times.
static void sss_atlas__merge(sss_atlas__grower *g, const sss_atlas__rule *rule)
{
    size_t i, left = g->count;
    sss_atlas__list_normals(g);
    sss_atlas__find_pairs(g);
    g->heap.count = 0;
    for (i = 0; i < g->pair_count; i++)
    {
        sss_atlas__push(&g->heap, sss_atlas__merging_cost(g, &g->pairs[i], rule), (uint32_t)i, 0);
    }
    while (g->heap.count > 0 && left > rule->least)
    {
        const sss_atlas__heap_entry entry = sss_atlas__pop(&g->heap);
        const sss_atlas__pair *pair = &g->pairs[entry.item];
        const uint32_t p = pair->region[0], q = pair->region[1];
        double cost;
        if (p == q)
        {
            continue;
        }
        cost = sss_atlas__merging_cost(g, pair, rule);
        if (cost > 1.05 * entry.key + 1e-3)
        {
            sss_atlas__push(&g->heap, cost, entry.item, 0);
        }
        else if (sss_atlas__may_merge(g, pair, rule))
        {
            const int swap = g->regions[p].degree < g->regions[q].degree;
            sss_atlas__join(g, swap ? q : p, swap ? p : q, pair->length, rule);
            left--;
        }
    }
}

// Regions that were merged into others go; the rest are numbered anew by their first triangle.
static void sss_atlas__renumber(sss_atlas__grower *g, int merged)
{
    sss_atlas__build *b = g->b;
    size_t t, i, count = 0;
    for (i = 0; i < g->count; i++)
    {
        g->regions[i].seed = SSS_ATLAS__NONE; // its number, for now
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        const uint32_t r = merged ? sss_atlas__root(g->regions, b->chart_of[t]) : b->chart_of[t];
        if (g->regions[r].seed == SSS_ATLAS__NONE)
        {
            g->regions[r].seed = (uint32_t)count++;
        }
        b->chart_of[t] = g->regions[r].seed;
    }
    for (i = 0; i < count; i++)
    {
        sss_atlas__start_region(&g->regions[i], SSS_ATLAS__NONE);
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        sss_atlas__add_triangle(g, &g->regions[b->chart_of[t]], (uint32_t)t, 1);
    }
    for (i = 0; i < count; i++)
    {
        sss_atlas__set_axis(&g->regions[i]);
    }
    g->count = count;
}

static void sss_atlas__merge_and_number(sss_atlas__grower *g, const sss_atlas__rule *rule)
{
    sss_atlas__merge(g, rule);
    sss_atlas__renumber(g, 1);
}

// ---- uniting charts of smooth surfaces ----

// Some charts that may become one.
typedef struct sss_atlas__union
{
    uint32_t member[SSS_ATLAS__UNITED];
    size_t count;
    double sum[3], area, outline;
} sss_atlas__union;

static int sss_atlas__may_unite(const sss_atlas__region *r)
{
    return r->rough <= SSS_ATLAS__NEARLY_SMOOTH * r->area && r->degree <= SSS_ATLAS__FEW_PAIRS;
}

// Adds the neighbour with which a union bends least. Returns 0 where there is none.
static int sss_atlas__add_neighbour(sss_atlas__grower *g, sss_atlas__union *u, double roundest)
{
    double least = HUGE_VAL, outline = 0.0;
    uint32_t best = SSS_ATLAS__NONE, side;
    size_t i, j;
    for (i = 0; i < u->count; i++)
    {
        for (side = g->regions[u->member[i]].side; side != SSS_ATLAS__NONE; side = g->pairs[side / 2].next[side % 2])
        {
            const sss_atlas__pair *pair = &g->pairs[side / 2];
            const uint32_t other = pair->region[1 - side % 2];
            const sss_atlas__region *r = &g->regions[other];
            const double sum[3] = {u->sum[0] + r->sum[0], u->sum[1] + r->sum[1], u->sum[2] + r->sum[2]};
            const double area = u->area + r->area, bent = area > 0.0 ? 1.0 - sss_atlas__length(sum) / area : 0.0;
            double shared = 0.0;
            int inside = pair->region[0] == pair->region[1] || !sss_atlas__may_unite(r);
            for (j = 0; j < u->count && !inside && bent < least; j++)
            {
                const uint32_t known = g->table[sss_atlas__find_pair(g, u->member[j], other)];
                inside = u->member[j] == other;
                shared += known != SSS_ATLAS__NONE ? g->pairs[known].length : 0.0;
            }
            if (!inside && bent < least)
            {
                least = bent;
                best = other;
                outline = u->outline + r->outline - 2.0 * shared;
            }
        }
    }
    if (best == SSS_ATLAS__NONE || sss_atlas__unroundness(outline, u->area + g->regions[best].area) > roundest)
    {
        return 0;
    }
    u->member[u->count++] = best;
    u->area += g->regions[best].area;
    u->outline = outline;
    for (i = 0; i < 3; i++)
    {
        u->sum[i] += g->regions[best].sum[i];
    }
    return 1;
}

// Whether all normals of a union are within the deviation from its mean.
static int sss_atlas__obeys(const sss_atlas__grower *g, const sss_atlas__union *u, const sss_atlas__rule *rule)
{
    double axis[3], excess[2] = {0.0, 0.0};
    size_t i;
    int good = g->b->options.max_area <= 0.0 || u->area <= g->b->options.max_area;
    memcpy(axis, u->sum, sizeof axis);
    sss_atlas__normalize(axis);
    for (i = 0; i < u->count && good; i++)
    {
        good = sss_atlas__add_excess(g, u->member[i], rule, axis, 0.0, excess);
    }
    return good;
}

// Where two charts may not merge, three or more still may: the mean of two thirds of a cap lies beside its axis.
static void sss_atlas__unite(sss_atlas__grower *g, const sss_atlas__rule *rule)
{
    const double roundest = rule->roundest > 0.0 ? rule->roundest : HUGE_VAL;
    size_t i, j;
    sss_atlas__list_normals(g);
    sss_atlas__find_pairs(g);
    g->heap.count = 0;
    for (i = 0; i < g->count; i++)
    {
        sss_atlas__region *r = &g->regions[i];
        sss_atlas__union u;
        int united = 0;
        memset(&u, 0, sizeof u);
        u.member[u.count++] = (uint32_t)i;
        u.area = r->area;
        u.outline = r->outline;
        memcpy(u.sum, r->sum, sizeof u.sum);
        while (r->parent == i && sss_atlas__may_unite(r) && !united && u.count < SSS_ATLAS__UNITED &&
               1.0 - sss_atlas__length(u.sum) / sss_atlas__max(u.area, 1e-300) < rule->scale &&
               sss_atlas__add_neighbour(g, &u, roundest))
        {
            united = sss_atlas__obeys(g, &u, rule);
        }
        for (j = 1; united && j < u.count; j++)
        {
            const uint32_t p = u.member[0], q = u.member[j];
            const uint32_t known = g->table[sss_atlas__find_pair(g, p, q)];
            sss_atlas__join(g, p, q, known != SSS_ATLAS__NONE ? g->pairs[known].length : 0.0, rule);
            g->heap.count = 0;
        }
    }
    sss_atlas__renumber(g, 1);
}

// ---- dissolving of charts ----

// The axis of a region, and what exceeds it. Returns whether it obeys the deviation.
//   head, g->queue  the region's triangles, one after the other
static int sss_atlas__measure_region(sss_atlas__grower *g, uint32_t region, const uint32_t *head)
{
    sss_atlas__region *r = &g->regions[region];
    int most = 0;
    uint32_t t;
    sss_atlas__set_axis(r);
    r->excess[0] = r->excess[1] = 0.0;
    r->whole = r->area;
    for (t = head[region]; t != SSS_ATLAS__NONE; t = g->queue[t])
    {
        const int beyond = sss_atlas__beyond(g, r, t);
        r->excess[0] += beyond > 0 ? g->b->area[t] : 0.0;
        r->excess[1] += beyond > 1 ? g->b->area[t] : 0.0;
        most = beyond > most ? beyond : most;
    }
    g->work += r->triangle_count;
    return most < 3 && r->excess[0] <= g->share[0] * r->rough && r->excess[1] <= g->share[1] * r->rough;
}

// Measures all regions that the triangles have gone to, if they grew by much. Returns whether all obey the deviation.
static int sss_atlas__measure_takers(sss_atlas__grower *g, const uint32_t *triangles, size_t count,
                                     const uint32_t *head)
{
    size_t i;
    int good = 1;
    for (i = 0; i < count; i++)
    {
        const uint32_t region = g->b->chart_of[triangles[i]];
        const sss_atlas__region *r = &g->regions[region];
        if (r->area > SSS_ATLAS__GAIN * r->whole)
        {
            good = sss_atlas__measure_region(g, region, head) && good;
        }
    }
    return good;
}

// Takes triangles back that were handed out; in the reverse order, so that they are first in their lists.
static void sss_atlas__take_back(sss_atlas__grower *g, const uint32_t *triangles, size_t count, uint32_t *head,
                                 uint32_t chart)
{
    sss_atlas__build *b = g->b;
    size_t i;
    for (i = count; i-- > 0;)
    {
        const uint32_t t = triangles[i], region = b->chart_of[t];
        head[region] = g->queue[t];
        sss_atlas__add_triangle(g, &g->regions[region], t, -1);
    }
    for (i = 0; i < count; i++)
    {
        const uint32_t region = b->chart_of[triangles[i]];
        const sss_atlas__region *r = &g->regions[region];
        if (r->area < r->whole) // measured with what was taken back
        {
            sss_atlas__measure_region(g, region, head);
        }
    }
    for (i = count; i-- > 0;)
    {
        g->queue[triangles[i]] = head[chart];
        head[chart] = triangles[i];
        b->chart_of[triangles[i]] = chart;
    }
}

// Offers a chart's triangles to its neighbours. Returns whether they have taken them all.
static int sss_atlas__offer_chart(sss_atlas__grower *g, const uint32_t *triangles, size_t count)
{
    sss_atlas__build *b = g->b;
    size_t i;
    int k, all = 1;
    for (i = 0; i < count; i++)
    {
        b->chart_of[triangles[i]] = SSS_ATLAS__NONE;
    }
    g->heap.count = 0;
    for (i = 0; i < count; i++)
    {
        const uint32_t t = triangles[i];
        for (k = 0; k < 3; k++)
        {
            const uint32_t e = b->twin[3 * t + (uint32_t)k];
            const uint32_t region = e != SSS_ATLAS__NONE ? b->chart_of[e / 3] : SSS_ATLAS__NONE;
            if (region != SSS_ATLAS__NONE && sss_atlas__may_take(g, &g->regions[region], t))
            {
                sss_atlas__push(&g->heap, sss_atlas__distance(g->center[t], g->center[e / 3]), t, region);
            }
        }
    }
    sss_atlas__grow(g, 0);
    for (i = 0; i < count; i++)
    {
        all = all && b->chart_of[triangles[i]] != SSS_ATLAS__NONE;
    }
    return all;
}

// Hands a chart out to its neighbours, if they may take all of it.
static void sss_atlas__dissolve_chart(sss_atlas__grower *g, uint32_t chart, uint32_t *head)
{
    sss_atlas__build *b = g->b;
    uint32_t *triangles = g->order; // of use no more
    size_t count = 0, i;
    uint32_t t;
    for (t = head[chart]; t != SSS_ATLAS__NONE; t = g->queue[t])
    {
        triangles[count++] = t;
    }
    if (!sss_atlas__offer_chart(g, triangles, count))
    {
        for (i = 0; i < count; i++)
        {
            if (b->chart_of[triangles[i]] != SSS_ATLAS__NONE)
            {
                sss_atlas__add_triangle(g, &g->regions[b->chart_of[triangles[i]]], triangles[i], -1);
            }
            b->chart_of[triangles[i]] = chart;
        }
        return;
    }
    head[chart] = SSS_ATLAS__NONE;
    for (i = 0; i < count; i++)
    {
        g->queue[triangles[i]] = head[b->chart_of[triangles[i]]];
        head[b->chart_of[triangles[i]]] = triangles[i];
    }
    if (!sss_atlas__measure_takers(g, triangles, count, head))
    {
        sss_atlas__take_back(g, triangles, count, head, chart);
    }
}

// Charts, the smallest first, go to their neighbours piece by piece where these may take them.
static void sss_atlas__dissolve(sss_atlas__grower *g, double most)
{
    const sss_atlas__build *b = g->b;
    uint32_t *head = g->table; // which has room, and is not in use
    uint32_t *sorted = g->table + g->count;
    size_t i;
    uint32_t t;
    g->heap.count = 0;
    for (i = 0; i < g->count; i++)
    {
        sss_atlas__push(&g->heap, g->regions[i].area, (uint32_t)i, 0);
        head[i] = SSS_ATLAS__NONE;
    }
    for (i = 0; i < g->count; i++)
    {
        sorted[i] = sss_atlas__pop(&g->heap).item;
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        g->queue[t] = head[b->chart_of[t]];
        head[b->chart_of[t]] = t;
    }
    for (i = 0; i < g->count; i++)
    {
        sss_atlas__measure_region(g, (uint32_t)i, head);
    }
    g->work = 0;
    for (i = 0; i < g->count && g->work < SSS_ATLAS__WORK * b->triangle_count; i++)
    {
        if (g->regions[sorted[i]].area <= most)
        {
            sss_atlas__dissolve_chart(g, sorted[i], head);
        }
    }
}

// ---- outlines ----

// Triangles that hang on to their chart by one edge, or none, go over to the chart with which they share more, where
// the deviation allows. Such a move never takes a chart apart: a triangle between two others of its chart cannot
// leave, because no edge is longer than both others together. Every move shortens all outlines, so it ends.
static void sss_atlas__smooth(sss_atlas__grower *g)
{
    sss_atlas__build *b = g->b;
    const double rough = b->options.method == SSS_ATLAS_ORTHOGRAPHIC ? g->near : -2.0; // any: ears do not lie well
    int round, k, j, moved = 1;
    uint32_t t;
    for (round = 0; round < SSS_ATLAS__SMOOTHING_ROUNDS && moved; round++)
    {
        moved = 0;
        for (t = 0; t < b->triangle_count; t++)
        {
            const uint32_t own = b->chart_of[t];
            uint32_t side[3], best = own;
            double length[3], stay = 0.0, most = 0.0;
            int own_edges = 0;
            for (k = 0; k < 3; k++)
            {
                const uint32_t e = b->twin[3 * t + (uint32_t)k];
                side[k] = e != SSS_ATLAS__NONE ? b->chart_of[e / 3] : SSS_ATLAS__NONE;
                own_edges += side[k] == own;
            }
            if (own_edges != 1 || g->regions[own].triangle_count < 2)
            {
                continue;
            }
            for (k = 0; k < 3; k++)
            {
                length[k] = sss_atlas__edge_length(b, 3 * t + (uint32_t)k);
                stay += side[k] == own ? length[k] : 0.0;
            }
            for (k = 0; k < 3; k++)
            {
                double share = 0.0;
                for (j = 0; j < 3; j++)
                {
                    share += side[j] == side[k] ? length[j] : 0.0;
                }
                if (side[k] != own && side[k] != SSS_ATLAS__NONE && share > most)
                {
                    most = share;
                    best = side[k];
                }
            }
            if (most > stay * (1.0 + 1e-6) &&
                (b->area[t] <= 0.0 || sss_atlas__dot(b->normal[t], g->regions[best].axis) >=
                                          (g->rough[t] ? rough : g->near)) &&
                (b->options.max_area <= 0.0 || g->regions[best].area + b->area[t] <= b->options.max_area))
            {
                b->chart_of[t] = best;
                g->regions[best].area += b->area[t];
                g->regions[best].triangle_count++;
                g->regions[own].area -= b->area[t];
                g->regions[own].triangle_count--;
                moved = 1;
            }
        }
    }
}

// ---- charts of a mesh ----

// The chart of a collapsed triangle is one that has its edge, found among the triangles around the rarer of its ends;
// or its own. from  [V + 1] and around  [3 T]: triangles by vertex.
static void sss_atlas__place_collapsed(sss_atlas__build *b, const uint32_t *from, const uint32_t *around)
{
    enum {TRIED = 256}; // so that thousands of them between two vertices of huge valence take no time
    size_t t;
    for (t = 0; t < b->triangle_count; t++)
    {
        const uint32_t *c = b->triangles + 3 * t;
        const uint32_t p = c[0], q = c[1] != p ? c[1] : c[2];
        const uint32_t rare = from[p + 1] - from[p] <= from[q + 1] - from[q] ? p : q, other = rare == p ? q : p;
        uint32_t i;
        if (!sss_atlas__collapsed(c))
        {
            continue;
        }
        for (i = from[rare]; i < from[rare + 1] && i < from[rare] + TRIED; i++)
        {
            const uint32_t *d = b->triangles + 3 * (size_t)around[i];
            if (!sss_atlas__collapsed(d) && (d[0] == other || d[1] == other || d[2] == other))
            {
                b->chart_of[t] = b->chart_of[around[i]];
                break;
            }
        }
    }
}

static sss_result sss_atlas__attach_collapsed(sss_atlas__build *b)
{
    uint32_t *from, *around, i;
    size_t t, v;
    for (t = 0; t < b->triangle_count && !sss_atlas__collapsed(b->triangles + 3 * t); t++)
    {
    }
    if (t == b->triangle_count)
    {
        return SSS_OK;
    }
    from = (uint32_t *)sss_atlas__take(&b->memory, b->vertex_count + 2, sizeof *from);
    around = (uint32_t *)sss_atlas__take(&b->memory, 3 * b->triangle_count, sizeof *around);
    if (b->memory.failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < 3 * b->triangle_count; i++)
    {
        from[b->triangles[i] + 2]++;
    }
    for (v = 0; v < b->vertex_count; v++)
    {
        from[v + 2] += from[v + 1];
    }
    for (i = 0; i < 3 * b->triangle_count; i++)
    {
        around[from[b->triangles[i] + 1]++] = i / 3;
    }
    sss_atlas__place_collapsed(b, from, around);
    sss_atlas__drop(&b->memory, from);
    sss_atlas__drop(&b->memory, around);
    return SSS_OK;
}

static sss_result sss_atlas__take_grower(sss_atlas__grower *g, sss_atlas__build *b)
{
    const size_t T = b->triangle_count;
    sss_atlas__memory *m = &b->memory;
    size_t t;
    int i, k;
    memset(g, 0, sizeof *g);
    g->b = b;
    g->compactness = sss_atlas__max(b->options.compactness, 1e-3); // 0: distances only decide ties
    g->near = sss_atlas__cosine(SSS_ATLAS__MARGIN * b->options.normal_deviation);
    g->last = sss_atlas__min(sss_atlas__cosine(SSS_ATLAS__GRAZING), g->near);
    g->far = sss_atlas__max(sss_atlas__cosine(SSS_ATLAS__EXCESS * b->options.normal_deviation), g->last);
    g->scale = sss_atlas__max(1.0 - g->near, 1e-12);
    g->heap.room = 4 * T + 1;
    for (g->table_size = 4; g->table_size < 3 * T; g->table_size *= 2)
    {
    }
    g->center = (double (*)[3])sss_atlas__take(m, T, sizeof *g->center);
    g->queue = (uint32_t *)sss_atlas__take(m, T, sizeof *g->queue);
    g->rough = (unsigned char *)sss_atlas__take(m, T, sizeof *g->rough);
    g->order = (uint32_t *)sss_atlas__take(m, T, sizeof *g->order);
    g->heap.entries = (sss_atlas__heap_entry *)sss_atlas__take(m, g->heap.room, sizeof *g->heap.entries);
    g->regions = (sss_atlas__region *)sss_atlas__take(m, T, sizeof *g->regions);
    g->facings = (sss_atlas__facing *)sss_atlas__take(m, 3 * T / 2 + 1, sizeof *g->facings);
    g->pairs = (sss_atlas__pair *)sss_atlas__take(m, 3 * T / 2 + 1, sizeof *g->pairs);
    g->table = (uint32_t *)sss_atlas__take(m, g->table_size, sizeof *g->table);
    b->chart_of = (uint32_t *)sss_atlas__take(m, T, sizeof *b->chart_of);
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (t = 0; t < T; t++)
    {
        b->chart_of[t] = SSS_ATLAS__NONE;
        for (k = 0; k < 3; k++)
        {
            for (i = 0; i < 3; i++)
            {
                g->center[t][i] += b->x[b->triangles[3 * t + (size_t)k]][i] / 3.0;
            }
        }
    }
    return SSS_OK;
}

static void sss_atlas__drop_grower(sss_atlas__grower *g)
{
    sss_atlas__memory *m = &g->b->memory;
    sss_atlas__drop(m, g->center);
    sss_atlas__drop(m, g->queue);
    sss_atlas__drop(m, g->rough);
    sss_atlas__drop(m, g->order);
    sss_atlas__drop(m, g->heap.entries);
    sss_atlas__drop(m, g->regions);
    sss_atlas__drop(m, g->facings);
    sss_atlas__drop(m, g->pairs);
    sss_atlas__drop(m, g->table);
}

// ---- what charts consist of ----

// The edge on the other side, where it belongs to the same chart.
static uint32_t sss_atlas__twin_inside(const sss_atlas__build *b, uint32_t e)
{
    const uint32_t f = b->twin[e];
    return f != SSS_ATLAS__NONE && b->chart_of[f / 3] == b->chart_of[e / 3] ? f : SSS_ATLAS__NONE;
}

static sss_result sss_atlas__take_charts(sss_atlas__build *b)
{
    const size_t T = b->triangle_count;
    sss_atlas__memory *m = &b->memory;
    b->charts = (sss_atlas__chart *)sss_atlas__take(m, T, sizeof *b->charts);
    b->chart_triangles = (uint32_t *)sss_atlas__take(m, T, sizeof *b->chart_triangles);
    b->corner = (uint32_t *)sss_atlas__take(m, 3 * T, sizeof *b->corner);
    b->vertex = (uint32_t *)sss_atlas__take(m, 3 * T, sizeof *b->vertex);
    b->loops = (uint32_t *)sss_atlas__take(m, 3 * T + 1, sizeof *b->loops);
    b->loop_edges = (uint32_t *)sss_atlas__take(m, 3 * T, sizeof *b->loop_edges);
    b->uv = (double (*)[2])sss_atlas__take(m, 3 * T, sizeof *b->uv);
    b->corner_uv = (double (*)[2])sss_atlas__take(m, 3 * T, sizeof *b->corner_uv);
    return m->failed ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}

// A chart that lay flat still does if it has the triangles that it had.
static void sss_atlas__forget_changed(sss_atlas__build *b, uint32_t *count)
{
    uint32_t i;
    size_t t, c;
    memset(count, 0, b->triangle_count * sizeof *count);
    for (t = 0; t < b->triangle_count; t++)
    {
        count[b->chart_of[t]]++;
    }
    for (c = 0; c < b->chart_count; c++)
    {
        sss_atlas__chart *chart = &b->charts[c];
        int same = chart->triangle_count == count[c];
        for (i = 0; same && i < chart->triangle_count; i++)
        {
            same = b->chart_of[b->chart_triangles[chart->first_triangle + i]] == c;
        }
        chart->is_flat = same ? chart->is_flat : 0;
    }
}

// Triangles, normals and areas of charts.
static void sss_atlas__gather_triangles(sss_atlas__build *b)
{
    uint32_t first = 0;
    size_t t, c;
    int i;
    for (c = 0; c < b->chart_count; c++)
    {
        const int is_flat = b->charts[c].is_flat;
        memset(&b->charts[c], 0, sizeof b->charts[c]);
        b->charts[c].is_flat = is_flat;
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        sss_atlas__chart *chart = &b->charts[b->chart_of[t]];
        chart->triangle_count++;
        chart->area += b->area[t];
        for (i = 0; i < 3; i++)
        {
            chart->normal[i] += b->area[t] * b->normal[t][i];
        }
    }
    for (c = 0; c < b->chart_count; c++)
    {
        b->charts[c].first_triangle = first;
        first += b->charts[c].triangle_count;
        b->charts[c].triangle_count = 0;
        sss_atlas__normalize(b->charts[c].normal);
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        sss_atlas__chart *chart = &b->charts[b->chart_of[t]];
        b->chart_triangles[chart->first_triangle + chart->triangle_count++] = (uint32_t)t;
    }
}

// Gives a new atlas vertex to all corners of the fan around a corner.
static void sss_atlas__number_fan(sss_atlas__build *b, uint32_t corner, uint32_t number)
{
    uint32_t e = corner;
    while (e != SSS_ATLAS__NONE && b->corner[e] == SSS_ATLAS__NONE) // to the right: over the edges that leave
    {
        b->corner[e] = number;
        e = sss_atlas__twin_inside(b, e);
        e = e != SSS_ATLAS__NONE ? sss_atlas__next(e) : e;
    }
    e = sss_atlas__twin_inside(b, sss_atlas__previous(corner));
    while (e != SSS_ATLAS__NONE && b->corner[e] == SSS_ATLAS__NONE) // to the left: over those that arrive
    {
        b->corner[e] = number;
        e = sss_atlas__twin_inside(b, sss_atlas__previous(e));
    }
}

// Atlas vertices. Collapsed triangles of a chart use those of their edge there and add none. last  [V] scratch.
static void sss_atlas__gather_vertices(sss_atlas__build *b, uint32_t *last)
{
    size_t c, n = 0, e;
    uint32_t i;
    int pass, k;
    memset(b->corner, 0xff, 3 * b->triangle_count * sizeof *b->corner);
    for (c = 0; c < b->chart_count; c++)
    {
        sss_atlas__chart *chart = &b->charts[c];
        chart->first_vertex = (uint32_t)n;
        for (pass = 0; pass < 2; pass++)
        {
            for (i = 0; i < chart->triangle_count; i++)
            {
                const size_t t = b->chart_triangles[chart->first_triangle + i];
                const int joins = chart->triangle_count > 1 && sss_atlas__collapsed(b->triangles + 3 * t);
                for (k = 0; k < 3; k++)
                {
                    e = 3 * t + (size_t)k;
                    if (pass == 1 && joins)
                    {
                        const uint32_t v = b->triangles[e], a = last[v]; // of an earlier chart, if this one has none
                        const int has = a >= chart->first_vertex && a < n && b->vertex[a] == v;
                        b->corner[e] = has ? a : (uint32_t)n;
                        b->vertex[b->corner[e]] = v;
                        last[v] = b->corner[e];
                        n += !has;
                    }
                    if (pass == 0 && !joins && b->corner[e] == SSS_ATLAS__NONE)
                    {
                        b->vertex[n] = b->triangles[e];
                        last[b->triangles[e]] = (uint32_t)n;
                        sss_atlas__number_fan(b, (uint32_t)e, (uint32_t)n++);
                    }
                }
            }
        }
        chart->vertex_count = (uint32_t)n - chart->first_vertex;
    }
    b->atlas_vertex_count = n;
}

// Boundaries of charts, and whether these are disks: one boundary and Euler's characteristic V - E + F = 1.
static void sss_atlas__gather_loops(sss_atlas__build *b, unsigned char *seen)
{
    size_t c, n = 0, edges, faces;
    uint32_t i;
    int k;
    memset(seen, 0, 3 * b->triangle_count);
    b->loop_count = 0;
    for (c = 0; c < b->chart_count; c++)
    {
        sss_atlas__chart *chart = &b->charts[c];
        chart->first_loop = (uint32_t)b->loop_count;
        edges = faces = 0;
        for (i = 0; i < chart->triangle_count; i++)
        {
            const uint32_t t = b->chart_triangles[chart->first_triangle + i];
            if (chart->triangle_count > 1 && sss_atlas__collapsed(b->triangles + 3 * (size_t)t))
            {
                continue;
            }
            faces++;
            for (k = 0; k < 3; k++)
            {
                uint32_t e = 3 * t + (uint32_t)k, f = sss_atlas__twin_inside(b, e);
                edges += f == SSS_ATLAS__NONE || f > e;
                if (f != SSS_ATLAS__NONE || seen[e])
                {
                    continue;
                }
                b->loops[b->loop_count++] = (uint32_t)n;
                while (!seen[e]) // around each corner, to the next edge without a twin
                {
                    seen[e] = 1;
                    b->loop_edges[n++] = e;
                    e = sss_atlas__next(e);
                    while ((f = sss_atlas__twin_inside(b, e)) != SSS_ATLAS__NONE)
                    {
                        e = sss_atlas__next(f);
                    }
                }
            }
        }
        chart->loop_count = (uint32_t)b->loop_count - chart->first_loop;
        chart->is_disk = chart->loop_count == 1 && chart->vertex_count + faces == edges + 1;
    }
    b->loops[b->loop_count] = (uint32_t)n;
}

static sss_result sss_atlas__gather_charts(sss_atlas__build *b)
{
    const size_t most = b->vertex_count > b->triangle_count ? b->vertex_count : b->triangle_count;
    uint32_t *scratch = (uint32_t *)sss_atlas__take(&b->memory, most, sizeof *scratch);
    unsigned char *seen = (unsigned char *)sss_atlas__take(&b->memory, 3 * b->triangle_count, sizeof *seen);
    size_t e;
    if (b->charts == NULL)
    {
        sss_atlas__take_charts(b);
    }
    if (b->memory.failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_atlas__forget_changed(b, scratch);
    sss_atlas__gather_triangles(b);
    sss_atlas__gather_vertices(b, scratch);
    sss_atlas__gather_loops(b, seen);
    for (e = 0; e < 3 * b->triangle_count; e++)
    {
        memcpy(b->uv[b->corner[e]], b->corner_uv[e], sizeof b->uv[0]);
    }
    sss_atlas__drop(&b->memory, scratch);
    sss_atlas__drop(&b->memory, seen);
    return SSS_OK;
}

// ---- dividing a chart ----

// What a division needs, for the triangles of one chart, by their place in it.
typedef struct sss_atlas__division
{
    sss_atlas__build *b;
    const uint32_t *triangles; // [count] rising
    uint32_t count;
    const uint32_t *place;     // [T] in the list of its chart, or NULL
    uint32_t *part;            // [count]
    double *distance;          // [count]
    sss_atlas__heap heap;      // 4 count
} sss_atlas__division;

// The place of a triangle that belongs to the chart.
static uint32_t sss_atlas__rank(const sss_atlas__division *d, uint32_t triangle)
{
    uint32_t low = 0, high = d->count - 1;
    if (d->place != NULL)
    {
        return d->place[triangle];
    }
    while (low < high)
    {
        const uint32_t middle = low + (high - low) / 2;
        if (d->triangles[middle] < triangle)
        {
            low = middle + 1;
        }
        else
        {
            high = middle;
        }
    }
    return low;
}

static void sss_atlas__center(const sss_atlas__build *b, uint32_t t, double out[3])
{
    int i;
    for (i = 0; i < 3; i++)
    {
        out[i] = (b->x[b->triangles[3 * t]][i] + b->x[b->triangles[3 * t + 1]][i] +
                  b->x[b->triangles[3 * t + 2]][i]) / 3.0;
    }
}

static void sss_atlas__clear_parts(sss_atlas__division *d)
{
    uint32_t i;
    for (i = 0; i < d->count; i++)
    {
        d->part[i] = SSS_ATLAS__NONE;
    }
    d->heap.count = 0;
}

// Dijkstra's algorithm from what the heap holds: each triangle without a part gets that of the seed nearest to it.
// Returns the one that was reached last.
static uint32_t sss_atlas__spread(sss_atlas__division *d)
{
    const sss_atlas__build *b = d->b;
    uint32_t last = 0;
    int k;
    while (d->heap.count > 0)
    {
        const sss_atlas__heap_entry entry = sss_atlas__pop(&d->heap);
        const uint32_t t = d->triangles[entry.item];
        double from[3], to[3];
        if (d->part[entry.item] != SSS_ATLAS__NONE)
        {
            continue;
        }
        d->part[entry.item] = entry.tag;
        last = entry.item;
        sss_atlas__center(b, t, from);
        for (k = 0; k < 3; k++)
        {
            const uint32_t e = sss_atlas__twin_inside(b, 3 * t + (uint32_t)k);
            const uint32_t u = e != SSS_ATLAS__NONE ? sss_atlas__rank(d, e / 3) : 0;
            if (e != SSS_ATLAS__NONE && d->part[u] == SSS_ATLAS__NONE)
            {
                sss_atlas__center(b, e / 3, to);
                sss_atlas__push(&d->heap, entry.key + sss_atlas__distance(from, to), u, entry.tag);
            }
        }
    }
    return last;
}

// Parts of a chart that is not connected (any more), collapsed triangles aside. Returns their number.
static uint32_t sss_atlas__separate(sss_atlas__division *d)
{
    uint32_t i, parts = 0;
    sss_atlas__clear_parts(d);
    for (i = 0; i < d->count; i++)
    {
        if (d->part[i] == SSS_ATLAS__NONE && !sss_atlas__collapsed(d->b->triangles + 3 * (size_t)d->triangles[i]))
        {
            sss_atlas__push(&d->heap, 0.0, i, parts++);
            sss_atlas__spread(d);
        }
    }
    return parts;
}

// What is nearer to either of two triangles far apart. Returns the number of parts.
static uint32_t sss_atlas__halve(sss_atlas__division *d)
{
    uint32_t ends[3] = {0, 0, 0};
    int i;
    while (ends[0] + 1 < d->count && sss_atlas__collapsed(d->b->triangles + 3 * (size_t)d->triangles[ends[0]]))
    {
        ends[0]++;
    }
    for (i = 1; i < 3; i++)
    {
        sss_atlas__clear_parts(d);
        sss_atlas__push(&d->heap, 0.0, ends[i - 1], 0);
        ends[i] = sss_atlas__spread(d);
    }
    sss_atlas__clear_parts(d);
    sss_atlas__push(&d->heap, 0.0, ends[1], 0);
    if (ends[2] != ends[1])
    {
        sss_atlas__push(&d->heap, 0.0, ends[2], 1);
    }
    sss_atlas__spread(d);
    return ends[2] != ends[1] ? 2 : 1;
}

// The first of sorted entries that is not before another.
static size_t sss_atlas__lower_bound(const sss_atlas__heap_entry *sorted, size_t count,
                                     const sss_atlas__heap_entry *wanted)
{
    size_t low = 0, high = count;
    while (low < high)
    {
        const size_t middle = low + (high - low) / 2;
        if (sss_atlas__before(&sorted[middle], wanted))
        {
            low = middle + 1;
        }
        else
        {
            high = middle;
        }
    }
    return low;
}

// A collapsed triangle stays with a triangle that has its edge; without one it is a chart of its own.
static uint32_t sss_atlas__divide_collapsed(sss_atlas__division *d, uint32_t parts)
{
    const sss_atlas__build *b = d->b;
    sss_atlas__heap_entry *sorted = d->heap.entries; // rising, in the end of its room
    size_t n = 0, total, at;
    uint32_t i, k;
    for (i = 0; i < d->count && !sss_atlas__collapsed(b->triangles + 3 * (size_t)d->triangles[i]); i++)
    {
    }
    if (i == d->count)
    {
        return parts;
    }
    d->heap.count = 0;
    for (i = 0; i < d->count; i++)
    {
        const uint32_t *c = b->triangles + 3 * (size_t)d->triangles[i];
        for (k = 0; k < 3 && !sss_atlas__collapsed(c); k++)
        {
            const uint32_t p = c[k], q = c[(k + 1) % 3];
            sss_atlas__push(&d->heap, (double)(p < q ? p : q), p < q ? q : p, i);
        }
    }
    total = d->heap.count;
    while (d->heap.count > 0)
    {
        sorted[d->heap.room - total + n++] = sss_atlas__pop(&d->heap);
    }
    sorted += d->heap.room - total;
    for (i = 0; i < d->count; i++)
    {
        const uint32_t *c = b->triangles + 3 * (size_t)d->triangles[i];
        const uint32_t p = c[0], q = c[1] != p ? c[1] : c[2];
        sss_atlas__heap_entry wanted;
        if (!sss_atlas__collapsed(c))
        {
            continue;
        }
        wanted.key = (double)(p < q ? p : q);
        wanted.item = p < q ? q : p;
        wanted.tag = 0;
        at = sss_atlas__lower_bound(sorted, n, &wanted);
        if (at < n && sorted[at].item == wanted.item && !(sorted[at].key > wanted.key))
        {
            d->part[i] = d->part[sorted[at].tag];
        }
        else
        {
            d->part[i] = parts++;
        }
    }
    return parts;
}

// Into two connected parts of about the same extent: closed surfaces and tubes open that way. A chart that is not
// connected falls into its pieces.
static sss_result sss_atlas__split_chart(sss_atlas__build *b, uint32_t chart)
{
    const sss_atlas__chart *c = &b->charts[chart];
    sss_atlas__memory *m = &b->memory;
    sss_atlas__division d;
    uint32_t i, parts;
    if (c->triangle_count < 2)
    {
        return SSS_OK;
    }
    memset(&d, 0, sizeof d);
    d.b = b;
    d.count = c->triangle_count;
    d.triangles = b->chart_triangles + c->first_triangle;
    d.heap.room = 7 * (size_t)d.count; // 3 edges of each triangle, and as many sorted ones behind
    d.part = (uint32_t *)sss_atlas__take(m, d.count, sizeof *d.part);
    d.heap.entries = (sss_atlas__heap_entry *)sss_atlas__take(m, d.heap.room, sizeof *d.heap.entries);
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    parts = sss_atlas__separate(&d);
    parts = parts == 1 ? sss_atlas__halve(&d) : parts;
    parts = sss_atlas__divide_collapsed(&d, parts);
    for (i = 0; i < d.count; i++)
    {
        b->chart_of[d.triangles[i]] = d.part[i] == 0 ? chart : (uint32_t)b->chart_count + d.part[i] - 1;
    }
    b->chart_count += parts - 1;
    b->split_count++;
    b->charts[chart].is_flat = 0;
    sss_atlas__drop(m, d.part);
    sss_atlas__drop(m, d.heap.entries);
    return SSS_OK;
}

// ---- cutting of charts ----

// Lists the triangles of every chart, in rising order. begin  [charts + 1], list and place  [T]
static void sss_atlas__list_charts(const sss_atlas__grower *g, uint32_t *begin, uint32_t *list, uint32_t *place)
{
    const sss_atlas__build *b = g->b;
    size_t i, t;
    begin[0] = 0;
    for (i = 0; i < g->count; i++)
    {
        begin[i + 1] = begin[i] + g->regions[i].triangle_count;
        g->regions[i].seed = 0; // how many are listed
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        place[t] = g->regions[b->chart_of[t]].seed++;
        list[begin[b->chart_of[t]] + place[t]] = (uint32_t)t;
    }
}

// How much of a chart's halves is smooth and exceeds the deviation from their mean, over what did so before.
static double sss_atlas__new_excess(sss_atlas__grower *g, const sss_atlas__division *d, uint32_t chart)
{
    const sss_atlas__build *b = g->b;
    sss_atlas__region half[2];
    double excess = 0.0;
    uint32_t i;
    int k;
    sss_atlas__start_region(&half[0], SSS_ATLAS__NONE);
    sss_atlas__start_region(&half[1], SSS_ATLAS__NONE);
    for (i = 0; i < d->count; i++)
    {
        for (k = 0; k < 3; k++)
        {
            half[d->part[i]].sum[k] += b->area[d->triangles[i]] * b->normal[d->triangles[i]][k];
        }
    }
    sss_atlas__set_axis(&half[0]);
    sss_atlas__set_axis(&half[1]);
    for (i = 0; i < d->count; i++)
    {
        const uint32_t t = d->triangles[i];
        const int was = sss_atlas__beyond(g, &g->regions[chart], t) > 0;
        const int is = sss_atlas__beyond(g, &half[d->part[i]], t) > 0;
        excess += g->rough[t] ? 0.0 : (is - was) * b->area[t];
    }
    return excess;
}

// The second half becomes a chart of its own.
static void sss_atlas__part_from(sss_atlas__grower *g, const sss_atlas__division *d, uint32_t chart)
{
    const uint32_t other = (uint32_t)g->count++;
    uint32_t i;
    sss_atlas__start_region(&g->regions[chart], SSS_ATLAS__NONE);
    sss_atlas__start_region(&g->regions[other], SSS_ATLAS__NONE);
    for (i = 0; i < d->count; i++)
    {
        const uint32_t region = d->part[i] == 0 ? chart : other;
        g->b->chart_of[d->triangles[i]] = region;
        sss_atlas__add_triangle(g, &g->regions[region], d->triangles[i], 1);
    }
    sss_atlas__set_axis(&g->regions[chart]);
    sss_atlas__set_axis(&g->regions[other]);
}

// Halves a chart if both halves are worth it, and rounder. The second one gets a number.
static int sss_atlas__cut_chart(sss_atlas__grower *g, sss_atlas__division *d, uint32_t chart)
{
    sss_atlas__build *b = g->b;
    double area[2] = {0.0, 0.0}, outline[2] = {0.0, 0.0}, before = 0.0;
    uint32_t i;
    int k, good;
    if (sss_atlas__halve(d) != 2)
    {
        return 0;
    }
    for (i = 0; i < d->count; i++)
    {
        const uint32_t t = d->triangles[i], part = d->part[i];
        if (part > 1) // collapsed
        {
            d->part[i] = 0;
            continue;
        }
        area[part] += b->area[t];
        for (k = 0; k < 3; k++)
        {
            const uint32_t e = 3 * t + (uint32_t)k, f = sss_atlas__twin_inside(b, e);
            const double length = sss_atlas__edge_length(b, e);
            before += f == SSS_ATLAS__NONE ? length : 0.0;
            outline[part] += f == SSS_ATLAS__NONE || d->part[sss_atlas__rank(d, f / 3)] != part ? length : 0.0;
        }
    }
    good = sss_atlas__min(area[0], area[1]) >= SSS_ATLAS__LEAST_CUT * g->area &&
           outline[0] * outline[0] + outline[1] * outline[1] < before * before &&
           sss_atlas__new_excess(g, d, chart) <= SSS_ATLAS__SMALL_EXCESS_SHARE * g->regions[chart].rough;
    if (good)
    {
        sss_atlas__part_from(g, d, chart);
    }
    return good;
}

// Charts that are far from round are halved across, which cuts arms off.
static void sss_atlas__cut(sss_atlas__grower *g, double roundest)
{
    uint32_t *begin = g->table, *list; // of the table's 3 T
    sss_atlas__division d;
    int round, cuts = 1;
    memset(&d, 0, sizeof d);
    d.b = g->b;
    d.part = g->order;
    d.place = g->queue;
    d.heap = g->heap;
    for (round = 0; round < SSS_ATLAS__CUTTING_ROUNDS && cuts > 0; round++)
    {
        const size_t count = g->count;
        size_t c;
        sss_atlas__find_pairs(g); // outlines
        list = begin + count + 1;
        sss_atlas__list_charts(g, begin, list, g->queue);
        for (c = 0, cuts = 0; c < count; c++)
        {
            sss_atlas__region *r = &g->regions[c];
            if (!r->whole_stays && r->area > 2.0 * SSS_ATLAS__LEAST_CUT * g->area &&
                sss_atlas__unroundness(r->outline, r->area) > roundest)
            {
                d.triangles = list + begin[c];
                d.count = r->triangle_count;
                r->whole_stays = !sss_atlas__cut_chart(g, &d, (uint32_t)c);
                cuts += !r->whole_stays;
            }
        }
    }
    sss_atlas__renumber(g, 0);
}

// Specks go to a neighbour. Where charts are projected, one from which they are seen is better.
static void sss_atlas__absorb_specks(sss_atlas__grower *g, sss_atlas__rule *rule)
{
    rule->specks = 1;
    rule->near = rule->far = rule->last = g->last;
    if (g->b->options.method == SSS_ATLAS_ORTHOGRAPHIC)
    {
        sss_atlas__merge_and_number(g, rule);
    }
    rule->near = rule->far = rule->last = -2.0; // any
    sss_atlas__merge_and_number(g, rule);
}

// Steps 1 to 5 of above.
static void sss_atlas__make_charts(sss_atlas__grower *g)
{
    const double deviation = g->b->options.normal_deviation;
    sss_atlas__rule rule;
    size_t t;
    for (t = 0; t < g->b->triangle_count; t++)
    {
        g->area += g->b->area[t];
    }
    memset(&rule, 0, sizeof rule);
    rule.near = g->near;
    rule.far = g->far;
    rule.last = g->last;
    rule.share[0] = g->share[0] = SSS_ATLAS__EXCESS_SHARE;
    rule.share[1] = g->share[1] = SSS_ATLAS__OUTLIER_SHARE;
    rule.scale = g->scale;
    rule.roundest = g->b->options.compactness > 0.0
                        ? SSS_ATLAS__ROUNDEST + SSS_ATLAS__SPREAD / g->b->options.compactness : 0.0;
    sss_atlas__order_by_flatness(g, (double (*)[3])g->facings->normal);
    sss_atlas__seed_rest(g, sss_atlas__cosine(SSS_ATLAS__CELL * deviation));
    sss_atlas__renumber(g, 0);
    sss_atlas__merge_and_number(g, &rule);
    sss_atlas__dissolve(g, HUGE_VAL);
    sss_atlas__renumber(g, 0);
    g->share[0] = SSS_ATLAS__SMALL_EXCESS_SHARE;
    g->share[1] = SSS_ATLAS__SMALL_OUTLIER_SHARE;
    sss_atlas__dissolve(g, SSS_ATLAS__SMALL * g->area);
    sss_atlas__renumber(g, 0);
    if (rule.roundest > 0.0)
    {
        sss_atlas__cut(g, SSS_ATLAS__CUT_FROM * rule.roundest);
        rule.share[0] = SSS_ATLAS__SMALL_EXCESS_SHARE;
        rule.share[1] = SSS_ATLAS__SMALL_OUTLIER_SHARE;
        sss_atlas__merge_and_number(g, &rule);
    }
    rule.near = sss_atlas__cosine(g->b->options.normal_deviation);
    sss_atlas__unite(g, &rule);
    rule.roundest = 0.0;
    sss_atlas__absorb_specks(g, &rule);
    sss_atlas__smooth(g);
    sss_atlas__renumber(g, 0);
}

// Merges on, with deviations that grow step by step, until there are no more than max_charts. Orthographic charts
// must not fold over; the others need no common direction.
static void sss_atlas__limit_charts(sss_atlas__grower *g)
{
    const sss_atlas_options *o = &g->b->options;
    const double step = 5.0; // degrees
    const double last = o->method == SSS_ATLAS_ORTHOGRAPHIC ? SSS_ATLAS__GRAZING : 180.0;
    double angle = o->normal_deviation;
    sss_atlas__rule rule;
    memset(&rule, 0, sizeof rule);
    rule.scale = g->scale;
    rule.least = o->max_charts;
    rule.share[0] = rule.share[1] = SSS_ATLAS__SMALL_OUTLIER_SHARE; // those that charts have already
    rule.last = o->method == SSS_ATLAS_ORTHOGRAPHIC ? sss_atlas__cosine(SSS_ATLAS__HIDDEN) : -2.0;
    while (o->max_charts > 0 && g->count > o->max_charts && angle < last)
    {
        angle = sss_atlas__min(angle + step, last);
        rule.near = rule.far = angle < 180.0 ? sss_atlas__cosine(angle) : -2.0;
        sss_atlas__merge_and_number(g, &rule);
    }
}

static sss_result sss_atlas__grow_charts(sss_atlas__build *b)
{
    sss_atlas__grower g;
    sss_result result = sss_atlas__take_grower(&g, b);
    if (result != SSS_OK)
    {
        return result;
    }
    sss_atlas__make_charts(&g);
    sss_atlas__limit_charts(&g);
    result = sss_atlas__attach_collapsed(b);
    if (result != SSS_OK)
    {
        return result;
    }
    sss_atlas__renumber(&g, 0);
    b->chart_count = g.count;
    sss_atlas__drop_grower(&g);
    return SSS_OK;
}
// ---- laying flat ----
//
// A chart is laid out on its own, scaled to an area of 1 while it is worked on. Every method ends with the same proof
// that no two triangles overlap:
//
//   Let every triangle be positively oriented in the plane. The number of triangles over a point p that lies on no
//   edge is then the degree of the map there, which is the sum of the winding numbers of the boundary loops about p.
//   Loops that neither cross nor touch themselves or each other are simple: each has winding number +1 or -1 inside
//   and 0 outside. If exactly one of them runs counter-clockwise, the sum is at most 1, everywhere: no point is
//   covered twice. (Interior vertices that are wound around twice are excluded by the same count.) Conversely the
//   image of a connected chart without overlap has exactly one outer loop.
//
// So the test looks at signs of areas and at pairs of boundary edges only. Where edges merely touch, as the two sides
// of a slit do that is seen from above, all pairs of triangles that may meet are tested instead. Texture coordinates
// are rounded in the end: a vertex that is closer than that to an edge across from it, but does not coincide with one
// of its ends (a corner that the mesh has on another triangle's edge, a hole without area) is moved away before.

#define SSS_ATLAS__THIN 1e-9       // height over longest edge below which a triangle counts as without area: a needle
                                   // of 1e-9 still has 7 digits of area in double
#define SSS_ATLAS__FAT 1e-3        // the height over longest edge that such a triangle gets in energies and weights:
                                   // thin enough to take no room, fat enough for sums of squares
#define SSS_ATLAS__ROUNDING 3.6e-15 // 16 ulp: what an area may change, relative to extent times edge, when the chart is
                                   // turned: four coordinates are off by 1 ulp of the extent before and after
#define SSS_ATLAS__SIGN 4.5e-16    // Shewchuk 1997: beyond (3 + 16 u) u times the sum of both products, u = 2^-53, a
                                   // rounded orient has the true sign; with a third on top
#define SSS_ATLAS__CENTERINGS 64   // steps towards the centre of the normals' cap: within 1/8 of its radius
#define SSS_ATLAS__STEEPEST_TANGENT 1000.0 // tangent of half an angle in mean value weights: 179.9 degrees
#define SSS_ATLAS__SOLVE_TOLERANCE 1e-8 // root mean square residual over the chart's size; triangles are far larger
#define SSS_ATLAS__ROUNDS 8        // of Yoshizawa's iteration, which ends after three or four;
#define SSS_ATLAS__START_ROUNDS 2  // before a descent, which more of them do not help (measured)
#define SSS_ATLAS__DESCENTS 100    // steps of the descent at most; a chart seen from above needs about ten
#define SSS_ATLAS__SQUEEZED 10.0   // square of the stretch by which a triangle is opened on its own, twice: 1/3 as wide
#define SSS_ATLAS__STIFF 4.0       // triangles squeezed to 2/3: weights of the descent are made anew in each step
#define SSS_ATLAS__EVEN 1.002      // energy over its least value that is as good as an isometry: 3 % of edge length
#define SSS_ATLAS__ENOUGH 20       // steps, where the energy over its least value is
#define SSS_ATLAS__GOOD 1.02       // this: what is left are single triangles
#define SSS_ATLAS__SLOW 1e-3       // relative gain in stretch below which Yoshizawa's iteration ends
#define SSS_ATLAS__SLOW_DESCENT 0.02 // gain over what is left to gain below which a descent ends, the second time
#define SSS_ATLAS__SMOOTHINGS 24   // conjugate gradient steps for one direction of descent
#define SSS_ATLAS__HALVINGS 24     // of one step
#define SSS_ATLAS__MEETINGS 3      // boundary edges in the way of a step and of its halves, before they are held
#define SSS_ATLAS__WORST 8.0       // area distortion of a triangle beyond which a chart had better be divided,
#define SSS_ATLAS__OFF 1.5         // and one that at most a share of its surface should have:
#define SSS_ATLAS__SHARE_OFF 0.1   // where charts are good, a thousandth has;
#define SSS_ATLAS__MOST_ENERGY 2.0 // and symmetric Dirichlet energy over that of an isometry, good: 1.002
#define SSS_ATLAS__SMALL_SHARE 2e-4 // share of the surface below which a chart is not divided for its stretch: at most
                                   // 5,000 charts are, however long and narrow the surface is
#define SSS_ATLAS__MOST_STRETCH 2.5 // L2, of a convex chart that had not better be divided; round ones have 1.2 to 1.7
#define SSS_ATLAS__SWEEPS 4        // of Sander's relaxation
#define SSS_ATLAS__SECTIONS 10     // golden sections of one line search: within 1 % of the line
#define SSS_ATLAS__CELLS 8         // that boundary edges cross, each on average: at most 6 (see sss_atlas__enter_edge)
#define SSS_ATLAS__PATIENCE 256    // pairs of edges, or of triangles, tested for each before a chart is given up
#define SSS_ATLAS__GAP 2.0         // units of texture coordinates that boundary edges keep from each other: rounding
                                   // moves a point by at most 1/sqrt(2), and an edge too
#define SSS_ATLAS__LEAST_SHARE 0.2 // of the texture that charts take, to guess how large a unit will be
#define SSS_ATLAS__GAP_OF_EDGE 0.0625 // times the mean boundary edge: no gap is larger, however small the chart
#define SSS_ATLAS__PARTINGS 8      // rounds of moving apart what is closer
#define SSS_ATLAS__VECTORS 9       // of one value for each vertex and coordinate

typedef double (*sss_atlas__points)[2];

// One chart while it is laid out, in local numbers.
typedef struct sss_atlas__sheet
{
    const sss_atlas__build *b;
    const sss_atlas__chart *chart;
    uint32_t n, m, edges;      // vertices, triangles, boundary edges
    uint32_t loops;            // of boundary edges
    uint32_t met[2];           // boundary edges that met last
    uint32_t outer;            // boundary edges of the longest loop, which is the first
    int parting;               // boundary vertices that are too close to an edge are moved away from it
    int near;                  // one was
    double gap;                // that they have to keep; 0: none
    double scale;              // from mm to an area of 1
    double share_of_surface;   // of the whole mesh
    uint32_t *triangle;        // [m][3]
    double (*inverse)[3];      // [m] a, b, c: a triangle laid on its first edge has corners (0, 0), (l, 0), (x, y); the
                               // inverse of its edge matrix is ((a, b), (0, c)) = ((1/l, -x/(l y)), (0, 1/y))
    double *area;              // [m] l y/2, in all 1; 0: a corner is repeated, ignored
    unsigned char *thin;       // [m] without area on the surface
    unsigned char *bad;        // [m] turned over, or over another one, seen from above
    uint32_t *ring_begin;      // [n + 1]
    uint32_t *ring;            // [3 m] corners 3 k + j of the triangles around each vertex
    uint32_t *row;             // [n + 1]
    uint32_t *column;          // [3 m + 3 edges] neighbours, also across holes
    double *weight;            // [3 m + 3 edges] of the convex combination, or of the Laplacian
    double *share;             // [3 m + 3 edges] the same, each row in sum 1
    double *sigma;             // [n] stretch around a vertex; diagonal of the Laplacian
    unsigned char *fixed;      // [n] does not move; 2: a corner
    uint32_t *outline;         // [edges] vertex where a boundary edge starts, loop by loop
    uint32_t *outline_end;     // [edges] and ends
    uint32_t *apex;            // [edges] third corner of its triangle
    uint32_t *cell;            // [edges] first entry of a bucket, + 1
    uint32_t *entry;           // [CELLS edges][2] edge, next entry + 1
    uint32_t *order;           // [2 n + m] for sorting and marking
    sss_atlas__points p;       // [n] where the vertices are
    sss_atlas__points v[SSS_ATLAS__VECTORS]; // [n]
} sss_atlas__sheet;

// What all sheets take their ranges from.
typedef struct sss_atlas__flat
{
    sss_atlas__build *b;
    uint32_t *triangle, *ring_begin, *ring, *row, *column, *outline, *outline_end, *apex, *cell, *entry, *order;
    double (*inverse)[3];
    double *area, *weight, *share, *sigma;
    unsigned char *thin, *bad, *fixed;
    sss_atlas__points p, v[SSS_ATLAS__VECTORS];
    double surface; // of the whole mesh
} sss_atlas__flat;

// ---- the surface of a sheet ----

// A triangle laid on its first edge: l, x, y in mm. Returns twice its area.
static double sss_atlas__lay_triangle(const double x0[3], const double x1[3], const double x2[3], double out[3])
{
    double e[2][3], normal[3], twice;
    int i;
    for (i = 0; i < 3; i++)
    {
        e[0][i] = x1[i] - x0[i];
        e[1][i] = x2[i] - x0[i];
    }
    sss_atlas__cross(e[0], e[1], normal);
    twice = sss_atlas__length(normal);
    out[0] = sss_atlas__length(e[0]);
    out[1] = out[0] > 0.0 ? sss_atlas__dot(e[0], e[1]) / out[0] : 0.0;
    out[2] = out[0] > 0.0 ? twice / out[0] : sss_atlas__length(e[1]);
    return twice;
}

static double sss_atlas__longest_edge(const double shape[3])
{
    const double far = shape[1] - shape[0];
    const double square = sss_atlas__max(shape[1] * shape[1], far * far) + shape[2] * shape[2];
    return sss_atlas__max(shape[0], sqrt(square));
}

// Shapes of all triangles, those without area fattened, scaled to an area of 1 in all. 0: none has area.
static int sss_atlas__measure_sheet(sss_atlas__sheet *s)
{
    const sss_atlas__build *b = s->b;
    double sum = 0.0, least;
    uint32_t k;
    for (k = 0; k < s->m; k++)
    {
        const uint32_t *corner = b->triangles + 3 * (size_t)b->chart_triangles[s->chart->first_triangle + k];
        const double twice = sss_atlas__lay_triangle(b->x[corner[0]], b->x[corner[1]], b->x[corner[2]],
                                                     s->inverse[k]);
        const double longest = sss_atlas__longest_edge(s->inverse[k]);
        s->thin[k] = !(twice > SSS_ATLAS__THIN * longest * longest);
        s->area[k] = 0.5 * twice;
        sum += s->thin[k] ? 0.0 : s->area[k];
    }
    if (!(sum > 0.0))
    {
        return 0;
    }
    s->scale = 1.0 / sqrt(sum);
    least = SSS_ATLAS__FAT * sqrt(2.0 / s->m); // edge of a triangle that is but a point
    for (k = 0; k < s->m; k++)
    {
        const uint32_t *t = s->triangle + 3 * (size_t)k;
        double l = s->inverse[k][0] * s->scale, x = s->inverse[k][1] * s->scale, y = s->inverse[k][2] * s->scale;
        if (s->thin[k])
        {
            const double longest = sss_atlas__max(least, s->scale * sss_atlas__longest_edge(s->inverse[k]));
            l = sss_atlas__max(l, SSS_ATLAS__FAT * longest);
            y = sss_atlas__max(y, SSS_ATLAS__FAT * longest * longest / l);
        }
        s->area[k] = t[0] == t[1] || t[1] == t[2] || t[2] == t[0] ? 0.0 : 0.5 * l * y;
        s->inverse[k][0] = 1.0 / l;
        s->inverse[k][1] = -x / (l * y);
        s->inverse[k][2] = 1.0 / y;
    }
    return 1;
}

// Corners around each vertex.
static void sss_atlas__make_rings(sss_atlas__sheet *s)
{
    uint32_t i;
    for (i = 0; i <= s->n; i++)
    {
        s->ring_begin[i] = 0;
    }
    for (i = 0; i < 3 * s->m; i++)
    {
        s->ring_begin[s->triangle[i]]++;
    }
    for (i = 1; i <= s->n; i++)
    {
        s->ring_begin[i] += s->ring_begin[i - 1]; // the ends; they come down to the begins below
    }
    for (i = 3 * s->m; i-- > 0;)
    {
        s->ring[--s->ring_begin[s->triangle[i]]] = i;
    }
}

// Edge behind the loop that starts with one.
static uint32_t sss_atlas__end_of_loop(const sss_atlas__sheet *s, uint32_t first)
{
    uint32_t e = first + 1;
    while (e < s->edges && s->outline_end[e - 1] != s->outline[first])
    {
        e++;
    }
    return e;
}

// Adds a neighbour to the last row, if it is not there; order[] marks where each was seen last.
static void sss_atlas__add_column(sss_atlas__sheet *s, uint32_t i, uint32_t j, uint32_t *count)
{
    const uint32_t seen = s->order[j];
    if (j != i && !(seen > s->row[i] && seen <= *count && s->column[seen - 1] == j))
    {
        s->column[(*count)++] = j;
        s->order[j] = *count;
    }
}

// Rows of neighbours, each once. Holes are filled with fans of triangles about one of their vertices, which have edges
// but no shape: a convex combination then lays out a disk.
static void sss_atlas__make_rows(sss_atlas__sheet *s)
{
    uint32_t *place = s->order + s->n; // + 1 of a vertex in the outline; 0: inside, or on the outer loop
    uint32_t *begin = s->cell;         // of the loop of an edge
    uint32_t i, q, e, end, count = 0;
    memset(s->order, 0, 2 * s->n * sizeof *s->order);
    for (i = s->outer; i < s->edges; i = end)
    {
        end = sss_atlas__end_of_loop(s, i);
        for (e = i; e < end; e++)
        {
            place[s->outline[e]] = e + 1;
            begin[e] = i;
        }
    }
    for (i = 0; i < s->n; i++)
    {
        s->row[i] = count;
        for (q = s->ring_begin[i]; q < s->ring_begin[i + 1]; q++)
        {
            const uint32_t t = s->ring[q] / 3 * 3, j = s->ring[q] % 3;
            sss_atlas__add_column(s, i, s->triangle[t + (j + 1) % 3], &count);
            sss_atlas__add_column(s, i, s->triangle[t + (j + 2) % 3], &count);
        }
        if (place[i] > 0 && begin[place[i] - 1] < place[i] - 1)
        {
            sss_atlas__add_column(s, i, s->outline[begin[place[i] - 1]], &count);
        }
        for (e = place[i]; e > 0 && begin[e - 1] == place[i] - 1 && e < s->edges && begin[e] == place[i] - 1; e++)
        {
            sss_atlas__add_column(s, i, s->outline[e], &count); // of all others on the rim
        }
    }
    s->row[s->n] = count;
}

static uint32_t sss_atlas__find_column(const sss_atlas__sheet *s, uint32_t i, uint32_t j)
{
    uint32_t q = s->row[i];
    while (s->column[q] != j)
    {
        q++;
    }
    return q;
}

// Lengths of a triangle's edges, opposite of its corners, from the inverse of its edge matrix.
static void sss_atlas__edge_lengths(const double inverse[3], double out[3])
{
    const double l = 1.0 / inverse[0], y = 1.0 / inverse[2], x = -inverse[1] * l * y;
    out[0] = sqrt((x - l) * (x - l) + y * y);
    out[1] = sqrt(x * x + y * y);
    out[2] = l;
}

// Weights across holes: the mean of the others, at both ends.
static void sss_atlas__weigh_holes(sss_atlas__sheet *s)
{
    uint32_t first, end, e, q, side;
    for (first = s->outer; first < s->edges; first = end)
    {
        end = sss_atlas__end_of_loop(s, first);
        for (e = 2 * (first + 1); e < 2 * end; e++)
        {
            const uint32_t hub = s->outline[first], rim = s->outline[e / 2];
            const uint32_t from = e % 2 ? hub : rim, to = e % 2 ? rim : hub;
            double sum = 0.0;
            for (q = s->row[rim], side = 0; q < s->row[rim + 1]; q++)
            {
                sum += s->weight[q];
                side += s->weight[q] > 0.0;
            }
            q = hub != rim ? sss_atlas__find_column(s, from, to) : 0;
            if (hub != rim && !(s->weight[q] > 0.0))
            {
                s->weight[q] = sum > 0.0 ? sum / side : 1.0;
            }
        }
    }
}

// Floater 2003, "Mean value coordinates": w_ij = (tan(alpha/2) + tan(beta/2))/|x_j - x_i|, the angles at i on both
// sides of the edge. Half an angle between edges p and q: tan = (p q - p . q)/|p x q| = |p x q|/(p q + p . q).
static void sss_atlas__weigh_mean_values(sss_atlas__sheet *s)
{
    uint32_t k, q;
    int j;
    for (q = 0; q < s->row[s->n]; q++)
    {
        s->weight[q] = 0.0;
    }
    for (k = 0; k < s->m; k++)
    {
        const uint32_t *t = s->triangle + 3 * (size_t)k;
        double edge[3];
        sss_atlas__edge_lengths(s->inverse[k], edge);
        for (j = 0; j < 3 && s->area[k] > 0.0; j++)
        {
            const int a = (j + 1) % 3, c = (j + 2) % 3;
            const double sides = edge[a] * edge[c], cross = 2.0 * s->area[k];
            const double dot = 0.5 * (edge[a] * edge[a] + edge[c] * edge[c] - edge[j] * edge[j]);
            const double tangent = dot > 0.0 ? cross / (sides + dot)
                                             : sss_atlas__min((sides - dot) / cross, SSS_ATLAS__STEEPEST_TANGENT);
            s->weight[sss_atlas__find_column(s, t[j], t[a])] += tangent / edge[c];
            s->weight[sss_atlas__find_column(s, t[j], t[c])] += tangent / edge[a];
        }
    }
    sss_atlas__weigh_holes(s);
}

// ---- vectors ----

static double sss_atlas__sum_products(uint32_t n, const double (*a)[2], const double (*b)[2])
{
    double sum = 0.0;
    uint32_t i;
    for (i = 0; i < n; i++)
    {
        sum += a[i][0] * b[i][0] + a[i][1] * b[i][1];
    }
    return sum;
}

// out = a + f b
static void sss_atlas__add_scaled(uint32_t n, const double (*a)[2], double f, const double (*b)[2], double (*out)[2])
{
    uint32_t i;
    for (i = 0; i < n; i++)
    {
        out[i][0] = a[i][0] + f * b[i][0];
        out[i][1] = a[i][1] + f * b[i][1];
    }
}

static void sss_atlas__copy_points(uint32_t n, const double (*from)[2], double (*to)[2])
{
    memcpy(to, from, n * sizeof *to);
}

// ---- stretch ----

// The derivative of the map from a triangle's own plane to the texture, by columns, and its determinant.
static double sss_atlas__jacobian(const sss_atlas__sheet *s, const double (*p)[2], uint32_t k, double out[2][2])
{
    const uint32_t *t = s->triangle + 3 * (size_t)k;
    const double *o = p[t[0]], *inverse = s->inverse[k];
    const double e[2] = {p[t[1]][0] - o[0], p[t[1]][1] - o[1]}, f[2] = {p[t[2]][0] - o[0], p[t[2]][1] - o[1]};
    out[0][0] = e[0] * inverse[0];
    out[0][1] = e[1] * inverse[0];
    out[1][0] = e[0] * inverse[1] + f[0] * inverse[2];
    out[1][1] = e[1] * inverse[1] + f[1] * inverse[2];
    return (e[0] * f[1] - e[1] * f[0]) * inverse[0] * inverse[2];
}

static double sss_atlas__square(const double J[2][2])
{
    return J[0][0] * J[0][0] + J[0][1] * J[0][1] + J[1][0] * J[1][0] + J[1][1] * J[1][1];
}

// Square of the L2 stretch of a triangle, (Gamma^2 + gamma^2)/2 with the singular values of the inverse of J: its
// squared Frobenius norm is that of J over det(J)^2.
static double sss_atlas__stretch2(const sss_atlas__sheet *s, const double (*p)[2], uint32_t k)
{
    double J[2][2];
    const double det = sss_atlas__jacobian(s, p, k, J);
    return det > 0.0 ? 0.5 * sss_atlas__square((const double (*)[2])J) / (det * det) : HUGE_VAL;
}

// Square of the whole L2 stretch, of a sheet with surface 1 (Sander et al. 2001, section 3), and sigma of each vertex.
static double sss_atlas__total_stretch2(sss_atlas__sheet *s, const double (*p)[2], double *sigma)
{
    double sum = 0.0;
    uint32_t i, k, q;
    for (k = 0; k < s->m; k++)
    {
        sum += s->area[k] > 0.0 ? s->area[k] * sss_atlas__stretch2(s, p, k) : 0.0;
    }
    for (i = 0; i < s->n && sigma != NULL; i++)
    {
        double of_ring = 0.0, area = 0.0;
        for (q = s->ring_begin[i]; q < s->ring_begin[i + 1]; q++)
        {
            k = s->ring[q] / 3;
            of_ring += s->area[k] > 0.0 ? s->area[k] * sss_atlas__stretch2(s, p, k) : 0.0;
            area += s->area[k];
        }
        sigma[i] = area > 0.0 ? sqrt(of_ring / area) : 1.0;
    }
    return sum;
}

// The singular values Gamma >= gamma of the map from texture to surface (Sander et al. 2001, section 3). With
// A = <q1, q2, q3> the area in the texture and q the corners, its derivatives are
//     S_u = (q1 (v2 - v3) + q2 (v3 - v1) + q3 (v1 - v2))/(2 A),
//     S_v = (q1 (u3 - u2) + q2 (u1 - u3) + q3 (u2 - u1))/(2 A),
// and with a = S_u . S_u, b = S_u . S_v, c = S_v . S_v
//     Gamma, gamma = sqrt((a + c +- sqrt((a - c)^2 + 4 b^2))/2).
// gamma is taken as sqrt(a c - b^2)/Gamma, the ratio of areas over Gamma, which does not cancel.
// Without area in the texture: infinite.
static void sss_atlas__triangle_stretch(const double x[3][3], const double uv[3][2], double *larger, double *smaller)
{
    const double twice = sss_atlas__orient(uv[0], uv[1], uv[2]), area = fabs(twice);
    double S[2][3], e[2][3], normal[3], a, b, c, longest;
    int i;
    *larger = HUGE_VAL;
    *smaller = HUGE_VAL;
    for (i = 0; i < 3; i++)
    {
        e[0][i] = x[1][i] - x[0][i];
        e[1][i] = x[2][i] - x[0][i];
        // as above, with q1 taken off all three
        S[0][i] = (e[0][i] * (uv[2][1] - uv[0][1]) + e[1][i] * (uv[0][1] - uv[1][1])) / twice;
        S[1][i] = (e[0][i] * (uv[0][0] - uv[2][0]) + e[1][i] * (uv[1][0] - uv[0][0])) / twice;
    }
    if (!(area > 0.0))
    {
        return;
    }
    a = sss_atlas__dot(S[0], S[0]);
    b = sss_atlas__dot(S[0], S[1]);
    c = sss_atlas__dot(S[1], S[1]);
    longest = sqrt(0.5 * (a + c + sqrt((a - c) * (a - c) + 4.0 * b * b)));
    if (!sss_atlas__finite(longest))
    {
        return;
    }
    sss_atlas__cross(e[0], e[1], normal);
    *larger = longest;
    *smaller = longest > 0.0 ? sss_atlas__min(sss_atlas__length(normal) / area / longest, longest) : 0.0;
}

// ---- whether a sheet overlaps itself ----

// Largest coordinate.
static double sss_atlas__extent(const sss_atlas__sheet *s)
{
    double extent = 0.0;
    uint32_t i;
    for (i = 0; i < s->n; i++)
    {
        extent = sss_atlas__max(extent, sss_atlas__max(fabs(s->p[i][0]), fabs(s->p[i][1])));
    }
    return extent;
}

// All triangles positive, by more than turning the chart may change. Those without area on the surface must not be
// negative by more than that; if strict, they too must be positive.
static int sss_atlas__is_positive(const sss_atlas__sheet *s, int strict)
{
    const double rounding = SSS_ATLAS__ROUNDING * sss_atlas__extent(s);
    uint32_t k;
    for (k = 0; k < s->m; k++)
    {
        const uint32_t *t = s->triangle + 3 * (size_t)k;
        const double *o = s->p[t[0]], *p = s->p[t[1]], *q = s->p[t[2]];
        const double orient = sss_atlas__orient(o, p, q);
        const double margin = rounding
                              * (fabs(p[0] - o[0]) + fabs(p[1] - o[1]) + fabs(q[0] - o[0]) + fabs(q[1] - o[1]));
        if (s->area[k] > 0.0 && !(s->thin[k] ? (strict ? orient > 0.0 : orient >= -margin) : orient > margin))
        {
            return 0;
        }
    }
    return 1;
}

// Sign of twice the area, 0 where rounding hides it.
static int sss_atlas__side(const double a[2], const double b[2], const double c[2])
{
    const double left = (b[0] - a[0]) * (c[1] - a[1]), right = (b[1] - a[1]) * (c[0] - a[0]);
    const double bound = SSS_ATLAS__SIGN * (fabs(left) + fabs(right));
    return left - right > bound ? 1 : left - right < -bound ? -1 : 0;
}

// Whether a boundary vertex is so close to an edge, on its outer side, that rounding may take it across. One that lies
// exactly on an end of the edge, as along a slit, is rounded like it. Moves it away if that is wanted.
static int sss_atlas__is_near(sss_atlas__sheet *s, uint32_t v, uint32_t f)
{
    const double *a = s->p[s->outline[f]], *b = s->p[s->outline_end[f]], d[2] = {b[0] - a[0], b[1] - a[1]};
    const double length = sqrt(d[0] * d[0] + d[1] * d[1]);
    double *p = s->p[v], along, left, away[2], far;
    int i, on_end[2];
    for (i = 0; i < 2; i++)
    {
        const double *end = i ? b : a;
        on_end[i] = p[0] == end[0] && p[1] == end[1];
    }
    if (on_end[0] || on_end[1] || v == s->apex[f] || !(length > 0.0))
    {
        return 0;
    }
    along = ((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / length;
    left = ((p[1] - a[1]) * d[0] - (p[0] - a[0]) * d[1]) / length;
    if (left <= -s->gap || left >= 1e-3 * s->gap || along <= 0.0 || along >= length) // 1e-3: far more than rounding
    {
        return 0;
    }
    far = (2.0 * s->gap + left) / length;
    away[0] = d[1] * far;
    away[1] = -d[0] * far;
    for (i = 0; i < 2 && s->parting; i++)
    {
        p[i] += away[i];
    }
    return 1;
}

// 0: apart; 1: they touch, or may, or are near; 2: they cross.
static int sss_atlas__meet(sss_atlas__sheet *s, uint32_t e, uint32_t f)
{
    const uint32_t ia = s->outline[e], ib = s->outline_end[e], ic = s->outline[f], id = s->outline_end[f];
    const double *a = s->p[ia], *b = s->p[ib], *c = s->p[ic], *d = s->p[id];
    int i, abc, abd, cda, cdb, near;
    for (i = 0; i < 2; i++)
    {
        if (sss_atlas__max(a[i], b[i]) + s->gap < sss_atlas__min(c[i], d[i])
            || sss_atlas__max(c[i], d[i]) + s->gap < sss_atlas__min(a[i], b[i]))
        {
            return 0;
        }
    }
    near = s->gap > 0.0 && ((ia != ic && ia != id && sss_atlas__is_near(s, ia, f))
                            || (ib != ic && ib != id && sss_atlas__is_near(s, ib, f))
                            || (ic != ia && ic != ib && sss_atlas__is_near(s, ic, e))
                            || (id != ia && id != ib && sss_atlas__is_near(s, id, e)));
    s->near |= near;
    if (ib == ic || id == ia) // one after the other: they lie on each other, or share but the vertex
    {
        const double *o = ib == ic ? b : a, *p = ib == ic ? a : b, *q = ib == ic ? d : c;
        const double dot = (p[0] - o[0]) * (q[0] - o[0]) + (p[1] - o[1]) * (q[1] - o[1]);
        return near || (ia == id && ib == ic) || (sss_atlas__side(o, p, q) == 0 && dot >= 0.0);
    }
    abc = sss_atlas__side(a, b, c);
    abd = sss_atlas__side(a, b, d);
    cda = sss_atlas__side(c, d, a);
    cdb = sss_atlas__side(c, d, b);
    if (abc * abd > 0 || cda * cdb > 0)
    {
        return near;
    }
    return abc * abd < 0 && cda * cdb < 0 ? 2 : 1;
}

// An edge into one cell: first it meets all that are there. 0 once edges cross, or patience or room ends.
typedef struct sss_atlas__table
{
    sss_atlas__sheet *s;
    uint32_t entries;
    uint64_t tests;
    int touching;
} sss_atlas__table;

static int sss_atlas__enter_cell(sss_atlas__table *table, uint32_t e, int64_t column, int64_t row)
{
    sss_atlas__sheet *s = table->s;
    const uint64_t hash = ((uint64_t)column * 73856093u) ^ ((uint64_t)row * 19349663u); // Teschner et al. 2003
    uint32_t *first = &s->cell[(hash ^ (hash >> 17)) % s->edges], q;
    for (q = *first; q != 0; q = s->entry[2 * (q - 1) + 1])
    {
        const uint32_t f = s->entry[2 * (q - 1)];
        const int how = f == e ? 0 : sss_atlas__meet(s, e, f);
        table->touching |= how == 1;
        if (how > 0)
        {
            s->met[0] = e;
            s->met[1] = f;
        }
        if (how == 2 || ++table->tests > (uint64_t)SSS_ATLAS__PATIENCE * (s->edges + SSS_ATLAS__PATIENCE))
        {
            return 0;
        }
    }
    if (table->entries == SSS_ATLAS__CELLS * s->edges)
    {
        return 0;
    }
    s->entry[2 * table->entries] = e;
    s->entry[2 * table->entries + 1] = *first;
    *first = ++table->entries;
    return 1;
}

// All cells of an edge, row by row, with the gap and a millionth of a cell to spare, far more than rounding. An edge of
// extents dx, dy enters at most 2 + dy/c rows and dx/c + 2 rows cells; with the mean of dx + dy as cell size c that
// makes at most 6 cells on average, nearly always 3: 8 are kept.
static int sss_atlas__enter_edge(sss_atlas__table *table, uint32_t e, double cell)
{
    const double *a = table->s->p[table->s->outline[e]], *b = table->s->p[table->s->outline_end[e]];
    const double *low = a[1] <= b[1] ? a : b, *high = a[1] <= b[1] ? b : a;
    const double y0 = low[1] / cell, y1 = high[1] / cell, x0 = low[0] / cell, x1 = high[0] / cell;
    const double spare = 1e-6 + table->s->gap / cell;
    const double slope = y1 > y0 ? (x1 - x0) / (y1 - y0) : 0.0;
    const int64_t last = (int64_t)floor(y1 + spare);
    int64_t row, column;
    for (row = (int64_t)floor(y0 - spare); row <= last; row++)
    {
        const double from = sss_atlas__max(y0, (double)row - spare), to = sss_atlas__min(y1, (double)row + 1.0 + spare);
        double left = y1 > y0 ? x0 + (from - y0) * slope : x0, right = y1 > y0 ? x0 + (to - y0) * slope : x1;
        if (y1 - y0 < spare)
        {
            left = x0;
            right = x1;
        }
        for (column = (int64_t)floor(sss_atlas__min(left, right) - spare);
             column <= (int64_t)floor(sss_atlas__max(left, right) + spare); column++)
        {
            if (!sss_atlas__enter_cell(table, e, column, row))
            {
                return 0;
            }
        }
    }
    return 1;
}

// Boundary edges: 0 apart, 1 touching or near, 2 crossing.
static int sss_atlas__outline_meets(sss_atlas__sheet *s)
{
    sss_atlas__table table;
    double length = 0.0, extent = sss_atlas__extent(s);
    uint32_t e;
    memset(&table, 0, sizeof table);
    memset(s->met, 0, sizeof s->met);
    table.s = s;
    s->near = 0;
    for (e = 0; e < s->edges; e++)
    {
        const double *a = s->p[s->outline[e]], *b = s->p[s->outline_end[e]];
        length += fabs(b[0] - a[0]) + fabs(b[1] - a[1]);
        s->cell[e] = 0;
    }
    if (!sss_atlas__finite(length) || !(length > 0.0) || !(extent < 1e9 * (length / s->edges))) // 1e9: no rounded cells
    {
        return 2;
    }
    s->gap = sss_atlas__min(s->gap, SSS_ATLAS__GAP_OF_EDGE * length / s->edges);
    for (e = 0; e < s->edges; e++)
    {
        if (!sss_atlas__enter_edge(&table, e, length / s->edges))
        {
            return 2;
        }
    }
    return table.touching;
}

// Exactly one loop counter-clockwise? A slit seen from above has no area, but for rounding.
static int sss_atlas__has_one_outline(const sss_atlas__sheet *s)
{
    const double rounding = SSS_ATLAS__ROUNDING * sss_atlas__extent(s);
    uint32_t e = 0, positive = 0;
    while (e < s->edges)
    {
        const uint32_t first = e;
        const double *o = s->p[s->outline[first]];
        double twice = 0.0, length = 0.0;
        do
        {
            const double *a = s->p[s->outline[e]], *b = s->p[s->outline_end[e]];
            twice += sss_atlas__orient(o, a, b);
            length += fabs(b[0] - a[0]) + fabs(b[1] - a[1]);
            e++;
        } while (e < s->edges && s->outline_end[e - 1] != s->outline[first]);
        positive += twice > rounding * length;
    }
    return positive == 1;
}

// Interiors of two positive triangles are apart where an edge of one has the other on its right, or on it.
static int sss_atlas__are_apart(const sss_atlas__sheet *s, uint32_t k, uint32_t l)
{
    int turn, j;
    for (turn = 0; turn < 2; turn++)
    {
        const uint32_t *t = s->triangle + 3 * (size_t)(turn ? l : k), *o = s->triangle + 3 * (size_t)(turn ? k : l);
        for (j = 0; j < 3; j++)
        {
            const double *a = s->p[t[j]], *b = s->p[t[(j + 1) % 3]];
            if (sss_atlas__side(a, b, s->p[o[0]]) <= 0 && sss_atlas__side(a, b, s->p[o[1]]) <= 0
                && sss_atlas__side(a, b, s->p[o[2]]) <= 0)
            {
                return 1;
            }
        }
    }
    return 0;
}

static double sss_atlas__edge_of_box(const sss_atlas__sheet *s, uint32_t k, int axis, int upper)
{
    const uint32_t *t = s->triangle + 3 * (size_t)k;
    const double a = s->p[t[0]][axis], b = s->p[t[1]][axis], c = s->p[t[2]][axis];
    return upper ? sss_atlas__max(a, sss_atlas__max(b, c)) : sss_atlas__min(a, sss_atlas__min(b, c));
}

static int sss_atlas__box_before(const sss_atlas__sheet *s, uint32_t k, uint32_t l)
{
    const double a = sss_atlas__edge_of_box(s, k, 0, 0), b = sss_atlas__edge_of_box(s, l, 0, 0);
    return a < b || (a == b && k < l);
}

// order[] by left ends of the triangles' boxes: heap sort, in place.
static void sss_atlas__sort_boxes(sss_atlas__sheet *s)
{
    uint32_t *order = s->order, i, end;
    for (i = 0; i < s->m; i++)
    {
        order[i] = i;
    }
    for (i = s->m / 2, end = s->m; end > 1;)
    {
        uint32_t at, below, moved;
        if (i > 0)
        {
            i--;
        }
        else
        {
            end--;
            moved = order[0];
            order[0] = order[end];
            order[end] = moved;
        }
        for (at = i, moved = order[at]; (below = 2 * at + 1) < end; at = below)
        {
            below += below + 1 < end && sss_atlas__box_before(s, order[below], order[below + 1]);
            if (!sss_atlas__box_before(s, moved, order[below]))
            {
                break;
            }
            order[at] = order[below];
        }
        order[at] = moved;
    }
}

// All pairs of triangles whose boxes meet, by a sweep along x. Marks both of all that overlap, unless bad is NULL.
static int sss_atlas__triangles_meet(sss_atlas__sheet *s, unsigned char *bad)
{
    uint64_t tests = 0;
    uint32_t i, j;
    int meet = 0;
    sss_atlas__sort_boxes(s);
    for (i = 0; i < s->m; i++)
    {
        const uint32_t k = s->order[i];
        const double right = sss_atlas__edge_of_box(s, k, 0, 1);
        const double low = sss_atlas__edge_of_box(s, k, 1, 0), high = sss_atlas__edge_of_box(s, k, 1, 1);
        for (j = i + 1; j < s->m && sss_atlas__edge_of_box(s, s->order[j], 0, 0) < right; j++)
        {
            const uint32_t l = s->order[j];
            if (++tests > (uint64_t)SSS_ATLAS__PATIENCE * (s->m + SSS_ATLAS__PATIENCE))
            {
                return 1;
            }
            if (!s->thin[k] && !s->thin[l] && sss_atlas__edge_of_box(s, l, 1, 0) < high
                && sss_atlas__edge_of_box(s, l, 1, 1) > low && !sss_atlas__are_apart(s, k, l))
            {
                meet = 1;
                if (bad == NULL)
                {
                    return 1;
                }
                bad[k] = bad[l] = 1;
            }
        }
    }
    return meet;
}

// Without proof of the contrary it does.
static int sss_atlas__overlaps_itself(sss_atlas__sheet *s, int strict)
{
    int meets;
    if (s->edges == 0 || !sss_atlas__is_positive(s, strict))
    {
        return 1;
    }
    meets = sss_atlas__outline_meets(s);
    return meets == 2 || !sss_atlas__has_one_outline(s) || (meets == 1 && sss_atlas__triangles_meet(s, NULL));
}

// Moves boundary vertices out of the way of edges that rounding could take them across. 1: none is in the way now.
// Else nothing is moved.
static int sss_atlas__part(sss_atlas__sheet *s)
{
    sss_atlas__points from = s->v[8];
    int round;
    sss_atlas__copy_points(s->n, (const double (*)[2])s->p, from);
    for (round = 0; round < SSS_ATLAS__PARTINGS; round++)
    {
        s->parting = 0;
        sss_atlas__outline_meets(s);
        if (!s->near)
        {
            return 1;
        }
        s->parting = 1;
        sss_atlas__outline_meets(s);
    }
    s->parting = 0;
    sss_atlas__copy_points(s->n, (const double (*)[2])from, s->p);
    return 0;
}

// The test that ends every method: no overlap, and if possible none when texture coordinates are rounded.
static int sss_atlas__is_sound(sss_atlas__sheet *s)
{
    if (sss_atlas__part(s) && !sss_atlas__overlaps_itself(s, 0))
    {
        return 1;
    }
    sss_atlas__copy_points(s->n, (const double (*)[2])s->v[8], s->p);
    return !sss_atlas__overlaps_itself(s, 0);
}

// ---- seen from above ----

static void sss_atlas__project(sss_atlas__sheet *s, const double normal[3])
{
    const sss_atlas__build *b = s->b;
    const double *o = b->x[b->vertex[s->chart->first_vertex]];
    double axis[3] = {0.0, 0.0, 0.0}, u[3], v[3], d[3];
    int least = 0, i;
    uint32_t a;
    for (i = 1; i < 3; i++)
    {
        least = fabs(normal[i]) < fabs(normal[least]) ? i : least;
    }
    axis[least] = 1.0;
    sss_atlas__cross(axis, normal, u);
    sss_atlas__normalize(u);
    sss_atlas__cross(normal, u, v); // u x v is the normal
    for (a = 0; a < s->n; a++)
    {
        const double *x = b->x[b->vertex[s->chart->first_vertex + a]];
        for (i = 0; i < 3; i++)
        {
            d[i] = (x[i] - o[i]) * s->scale;
        }
        s->p[a][0] = sss_atlas__dot(d, u);
        s->p[a][1] = sss_atlas__dot(d, v);
    }
}

// The normal whose largest deviation is least: the centre of the smallest ball around all normals, approached as by
// Badoiu and Clarkson 2003: each step goes 1/(i + 1) of the way to the farthest.
static void sss_atlas__center_normal(const sss_atlas__sheet *s, double normal[3])
{
    const sss_atlas__build *b = s->b;
    uint32_t k;
    int step, i;
    for (step = 1; step <= SSS_ATLAS__CENTERINGS; step++)
    {
        const double *farthest = NULL;
        double least = HUGE_VAL;
        for (k = 0; k < s->m; k++)
        {
            const double *n = b->normal[b->chart_triangles[s->chart->first_triangle + k]];
            const double dot = sss_atlas__dot(n, normal) - 0.5 * sss_atlas__dot(n, n);
            if (!s->thin[k] && dot < least)
            {
                least = dot;
                farthest = n;
            }
        }
        for (i = 0; i < 3 && farthest != NULL; i++)
        {
            normal[i] += (farthest[i] - normal[i]) / (step + 1);
        }
    }
    sss_atlas__normalize(normal);
}

// Along the mean normal, or where that turns a triangle over, along the one in the middle of all. 1: none is.
static int sss_atlas__view(sss_atlas__sheet *s, int strict)
{
    double normal[3];
    memcpy(normal, s->chart->normal, sizeof normal);
    sss_atlas__project(s, normal);
    if (sss_atlas__is_positive(s, strict))
    {
        return 1;
    }
    sss_atlas__center_normal(s, normal);
    sss_atlas__project(s, normal);
    return sss_atlas__is_positive(s, strict);
}

// For whoever divides the chart: triangles that are turned over, seen along the mean normal, or lie over others.
static void sss_atlas__mark_bad(sss_atlas__sheet *s)
{
    unsigned char *bad = s->bad;
    uint32_t k;
    sss_atlas__project(s, s->chart->normal);
    memset(bad, 0, s->m);
    sss_atlas__triangles_meet(s, bad);
    for (k = 0; k < s->m; k++)
    {
        const uint32_t *t = s->triangle + 3 * (size_t)k;
        bad[k] |= !s->thin[k] && !(sss_atlas__orient(s->p[t[0]], s->p[t[1]], s->p[t[2]]) > 0.0);
        s->b->bad[s->b->chart_triangles[s->chart->first_triangle + k]] = bad[k];
    }
}

// ---- convex combinations ----

// out_i = y_i - sum of lambda_ij y_j inside, 0 on the boundary.
static void sss_atlas__apply_shares(const sss_atlas__sheet *s, const double (*y)[2], double (*out)[2])
{
    uint32_t i, q;
    for (i = 0; i < s->n; i++)
    {
        double u = 0.0, v = 0.0;
        if (!s->fixed[i])
        {
            u = y[i][0];
            v = y[i][1];
            for (q = s->row[i]; q < s->row[i + 1]; q++)
            {
                const double *of = y[s->column[q]];
                u -= s->share[q] * of[0];
                v -= s->share[q] * of[1];
            }
        }
        out[i][0] = u;
        out[i][1] = v;
    }
}

// Interior vertices as convex combinations of their neighbours (Floater 1997) for the boundary as it is: BiCGSTAB (van
// der Vorst 1992) on both coordinates at once, from where they are.
static void sss_atlas__solve_shares(sss_atlas__sheet *s)
{
    sss_atlas__points r = s->v[0], r0 = s->v[1], d = s->v[2], Ad = s->v[3], Ar = s->v[4];
    const uint32_t n = s->n;
    const double enough = SSS_ATLAS__SOLVE_TOLERANCE * SSS_ATLAS__SOLVE_TOLERANCE * n;
    const uint32_t limit = 64 + 8 * (uint32_t)sqrt((double)n);
    double rho, omega;
    uint32_t i, step;
    for (i = 0; i < n; i++)
    {
        double sum = 0.0;
        uint32_t q;
        for (q = s->row[i]; q < s->row[i + 1]; q++)
        {
            sum += s->weight[q];
        }
        for (q = s->row[i]; q < s->row[i + 1]; q++)
        {
            s->share[q] = s->weight[q] / sum;
        }
    }
    sss_atlas__apply_shares(s, (const double (*)[2])s->p, r);
    sss_atlas__add_scaled(n, (const double (*)[2])r, -2.0, (const double (*)[2])r, r);
    sss_atlas__copy_points(n, (const double (*)[2])r, r0);
    sss_atlas__copy_points(n, (const double (*)[2])r, d);
    rho = sss_atlas__sum_products(n, (const double (*)[2])r, (const double (*)[2])r);
    for (step = 0; step < limit && rho != 0.0; step++)
    {
        double alpha, next;
        sss_atlas__apply_shares(s, (const double (*)[2])d, Ad);
        alpha = rho / sss_atlas__sum_products(n, (const double (*)[2])Ad, (const double (*)[2])r0);
        if (!sss_atlas__finite(alpha))
        {
            return;
        }
        sss_atlas__add_scaled(n, (const double (*)[2])s->p, alpha, (const double (*)[2])d, s->p);
        sss_atlas__add_scaled(n, (const double (*)[2])r, -alpha, (const double (*)[2])Ad, r);
        sss_atlas__apply_shares(s, (const double (*)[2])r, Ar);
        omega = sss_atlas__sum_products(n, (const double (*)[2])Ar, (const double (*)[2])r)
                / sss_atlas__sum_products(n, (const double (*)[2])Ar, (const double (*)[2])Ar);
        if (!sss_atlas__finite(omega))
        {
            return;
        }
        sss_atlas__add_scaled(n, (const double (*)[2])s->p, omega, (const double (*)[2])r, s->p);
        sss_atlas__add_scaled(n, (const double (*)[2])r, -omega, (const double (*)[2])Ar, r);
        if (sss_atlas__sum_products(n, (const double (*)[2])r, (const double (*)[2])r) <= enough)
        {
            return;
        }
        next = sss_atlas__sum_products(n, (const double (*)[2])r, (const double (*)[2])r0);
        sss_atlas__add_scaled(n, (const double (*)[2])d, -omega, (const double (*)[2])Ad, d);
        sss_atlas__add_scaled(n, (const double (*)[2])r, next / rho * (alpha / omega), (const double (*)[2])d, d);
        rho = next;
    }
}

// Yoshizawa, Belyaev and Seidel 2004: the convex combination with weights w_ij/sigma_j, again and again while the
// total stretch falls: vertices move to where the surface is stretched. The best map is kept, the one at hand
// included if it is good. 1: there is one.
static int sss_atlas__even_out(sss_atlas__sheet *s, int rounds)
{
    double best = HUGE_VAL, last = HUGE_VAL;
    uint32_t q;
    int round;
    if (sss_atlas__is_positive(s, 1))
    {
        best = sss_atlas__total_stretch2(s, (const double (*)[2])s->p, NULL);
    }
    sss_atlas__copy_points(s->n, (const double (*)[2])s->p, s->v[5]);
    sss_atlas__weigh_mean_values(s);
    for (round = 0; round < rounds; round++)
    {
        double stretch;
        sss_atlas__solve_shares(s);
        stretch = sss_atlas__is_positive(s, 1) ? sss_atlas__total_stretch2(s, (const double (*)[2])s->p, s->sigma)
                                               : HUGE_VAL;
        if (stretch < best)
        {
            best = stretch;
            sss_atlas__copy_points(s->n, (const double (*)[2])s->p, s->v[5]);
        }
        if (!(stretch < (1.0 - SSS_ATLAS__SLOW) * last))
        {
            break;
        }
        last = stretch;
        for (q = 0; q < s->row[s->n]; q++)
        {
            s->weight[q] /= s->sigma[s->column[q]];
        }
    }
    sss_atlas__copy_points(s->n, (const double (*)[2])s->v[5], s->p);
    return best < HUGE_VAL;
}

// ---- boundaries of convex charts ----

// What does not move: the first so many boundary vertices.
static void sss_atlas__fix(sss_atlas__sheet *s, uint32_t count)
{
    uint32_t e;
    memset(s->fixed, 0, s->n);
    for (e = 0; e < count; e++)
    {
        s->fixed[s->outline[e]] = 1;
    }
}

static double sss_atlas__edge_mm(const sss_atlas__sheet *s, uint32_t e)
{
    const sss_atlas__build *b = s->b;
    const double *x = b->x[b->vertex[s->chart->first_vertex + s->outline[e]]];
    const double *y = b->x[b->vertex[s->chart->first_vertex + s->outline_end[e]]];
    const double d[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]};
    return sss_atlas__length(d) * s->scale;
}

// Boundary on a circle by chord length, interior in its centre. Edges without length get a thousandth of the mean.
static void sss_atlas__put_on_circle(sss_atlas__sheet *s)
{
    double length = 0.0, least, at = 0.0;
    uint32_t e;
    for (e = 0; e < s->outer; e++)
    {
        length += sss_atlas__edge_mm(s, e);
    }
    least = 1e-3 * length / s->outer;
    length += least * s->outer;
    memset(s->p, 0, s->n * sizeof *s->p);
    for (e = 0; e < s->outer; e++)
    {
        const double angle = 2.0 * SSS_ATLAS__PI * at / length;
        s->p[s->outline[e]][0] = cos(angle) / sqrt(SSS_ATLAS__PI); // area 1
        s->p[s->outline[e]][1] = sin(angle) / sqrt(SSS_ATLAS__PI);
        at += sss_atlas__edge_mm(s, e) + least;
    }
}

// A convex polygon inscribed in a circle; arrays borrowed from a sheet.
typedef struct sss_atlas__polygon
{
    uint32_t count;
    uint32_t *first; // [count + 1] boundary edge at whose start a corner is; the last: edges
    uint32_t *side;  // [edges] on which an edge's start is; a corner starts its side
    double *chord;   // [count] length of a side
    double *half;    // [count] half the angle under which it is seen from the centre
    double radius;
} sss_atlas__polygon;

// How much a boundary vertex is a corner: 1 - cos of the angle by which the boundary turns there; more for the tip of
// an ear, which has to be one.
static double sss_atlas__sharpness(const sss_atlas__sheet *s, uint32_t e)
{
    const sss_atlas__build *b = s->b;
    const uint32_t first = s->chart->first_vertex, v = s->outline[e], last = e > 0 ? e - 1 : s->outer - 1;
    const double *x = b->x[b->vertex[first + s->outline[last]]], *y = b->x[b->vertex[first + v]];
    const double *z = b->x[b->vertex[first + s->outline_end[e]]];
    double in[3], out[3];
    int i;
    for (i = 0; i < 3; i++)
    {
        in[i] = y[i] - x[i];
        out[i] = z[i] - y[i];
    }
    sss_atlas__normalize(in);
    sss_atlas__normalize(out);
    return (s->ring_begin[v + 1] - s->ring_begin[v] == 1 ? 4.0 : 1.0) - sss_atlas__dot(in, out);
}

// The outer loop shall start at its sharpest corner.
static void sss_atlas__turn_outline(sss_atlas__sheet *s)
{
    uint32_t *copy = s->order;
    double sharpest = -HUGE_VAL;
    uint32_t e, start = 0;
    for (e = 0; e < s->outer; e++)
    {
        const double sharpness = sss_atlas__sharpness(s, e);
        start = sharpness > sharpest ? e : start;
        sharpest = sss_atlas__max(sharpest, sharpness);
    }
    for (e = 0; e < s->outer; e++)
    {
        copy[e] = s->outline[(e + start) % s->outer];
    }
    for (e = 0; e < s->outer; e++)
    {
        s->outline[e] = copy[e];
        s->outline_end[e] = copy[e + 1 < s->outer ? e + 1 : 0];
    }
    for (e = 0; e < s->outer; e++)
    {
        copy[e] = s->apex[(e + start) % s->outer];
    }
    memcpy(s->apex, copy, s->outer * sizeof *copy);
}

// Marks corners that divide the boundary's length evenly (Sloan et al. 2003, section 4.3), but for a quarter of a side
// either way, where the sharpest vertex is taken; fewer where there are fewer vertices.
static void sss_atlas__mark_corners(sss_atlas__sheet *s, uint32_t corners, uint32_t *mark)
{
    double *at = s->v[2][0], length = 0.0; // [outer] along the boundary
    uint32_t e, i, last = 0;
    corners = corners < s->outer ? corners : s->outer;
    for (e = 0; e < s->outer; e++)
    {
        at[e] = length;
        mark[e] = e == 0;
        length += sss_atlas__edge_mm(s, e);
    }
    for (i = 1; i < corners; i++)
    {
        double best = -HUGE_VAL;
        uint32_t found = last + 1;
        for (e = last + 1; e <= s->outer - (corners - i); e++) // as many must be left as corners
        {
            const double off = fabs(at[e] * corners / length - i); // in sides
            const double value = off <= 0.25 ? sss_atlas__sharpness(s, e) : -off;
            found = value > best ? e : found;
            best = sss_atlas__max(best, value);
        }
        mark[found] = 1;
        last = found;
    }
}

// From marks to sides; the first place is marked.
static void sss_atlas__number_sides(const sss_atlas__sheet *s, sss_atlas__polygon *g)
{
    uint32_t e;
    g->count = 0;
    for (e = 0; e < s->outer; e++)
    {
        if (g->side[e] != 0)
        {
            g->first[g->count++] = e;
        }
        g->side[e] = g->count - 1;
    }
    g->first[g->count] = s->outer;
}

// The place in the middle between two boundary vertices of one side, by their places; NONE where they are on different
// sides, or next to each other.
static uint32_t sss_atlas__middle_of_side(const sss_atlas__polygon *g, uint32_t e, uint32_t f, uint32_t edges)
{
    const uint32_t low = e < f ? e : f, high = e < f ? f : e, last = g->count - 1;
    uint32_t from = low, to = high;
    if (low == 0 && g->side[high] == last && last > 0) // the last side ends where the first begins
    {
        from = high;
        to = edges;
    }
    else if (g->side[low] != g->side[high] && g->first[g->side[low] + 1] != high)
    {
        return SSS_ATLAS__NONE;
    }
    return to - from < 2 ? SSS_ATLAS__NONE : from + (to - from) / 2;
}

// Corners: even ones, and what else it takes that no triangle has all its corners on one side, for it would have no
// area: the tips of ears, triangles with two boundary edges, which a boundary along a fine mesh has many of; then the
// middle of what an inner edge between two vertices of a side cuts off.
static void sss_atlas__choose_corners(sss_atlas__sheet *s, sss_atlas__polygon *g)
{
    uint32_t *place = s->order + s->n + s->m, e; // of a boundary vertex in the outline
    g->first = s->order;
    g->side = s->cell;
    g->chord = s->v[0][0];
    g->half = s->v[1][0];
    sss_atlas__turn_outline(s);
    sss_atlas__mark_corners(s, (uint32_t)s->b->options.corners, g->side);
    for (e = 0; e < s->outer; e++)
    {
        const uint32_t v = s->outline[e];
        g->side[e] |= s->ring_begin[v + 1] - s->ring_begin[v] == 1;
        place[v] = e;
    }
    for (e = 0; e < s->outer; e++)
    {
        s->fixed[s->outline[e]] = g->side[e] != 0 ? 2 : 1; // 2: a corner
    }
    sss_atlas__number_sides(s, g);
    for (e = 0; e < 3 * s->m; e++)
    {
        const uint32_t from = s->triangle[e], to = s->triangle[e / 3 * 3 + (e + 1) % 3];
        if (from != to && s->fixed[from] && s->fixed[to] && s->outline_end[place[from]] != to)
        {
            const uint32_t at = sss_atlas__middle_of_side(g, place[from], place[to], s->outer);
            if (at != SSS_ATLAS__NONE)
            {
                s->fixed[s->outline[at]] = 2;
            }
        }
    }
    for (e = 0; e < s->outer; e++)
    {
        g->side[e] = s->fixed[s->outline[e]] > 1;
    }
    sss_atlas__number_sides(s, g);
}

// Half the angles of all sides, in sum: asin(L/(2 R)); of the longest, where the centre is beyond it, pi minus that.
static double sss_atlas__sum_angles(sss_atlas__polygon *g, uint32_t longest, int beyond)
{
    double sum = 0.0;
    uint32_t i;
    for (i = 0; i < g->count; i++)
    {
        g->half[i] = asin(sss_atlas__min(0.5 * g->chord[i] / g->radius, 1.0));
        g->half[i] = beyond && i == longest ? SSS_ATLAS__PI - g->half[i] : g->half[i];
        sum += g->half[i];
    }
    return sum;
}

// Chords proportional to path lengths, and the radius with which they close: half the angles sum to pi. With the centre
// inside the sum falls with R, with the centre beyond the longest side it is below pi until R is large enough:
// bisection.
static void sss_atlas__close_polygon(const sss_atlas__sheet *s, sss_atlas__polygon *g)
{
    double total = 0.0, low, high;
    uint32_t i, e, longest = 0;
    int step, beyond;
    for (i = 0; i < g->count; i++)
    {
        g->chord[i] = 0.0;
        for (e = g->first[i]; e < g->first[i + 1]; e++)
        {
            g->chord[i] += sss_atlas__edge_mm(s, e);
        }
        total += g->chord[i];
    }
    low = 1e-3 * total / g->count; // a side must have a length,
    for (i = 0; i < g->count; i++)
    {
        g->chord[i] = sss_atlas__max(g->chord[i], low);
        longest = g->chord[i] > g->chord[longest] ? i : longest;
    }
    for (i = 0, total = 0.0; i < g->count; i++)
    {
        total += i != longest ? g->chord[i] : 0.0;
    }
    g->chord[longest] = sss_atlas__min(g->chord[longest], 0.9 * total); // and the longest be shorter than the rest
    low = 0.5 * g->chord[longest];
    high = 16.0 * (total + low); // where chords are all but arcs
    g->radius = low;
    beyond = sss_atlas__sum_angles(g, longest, 0) < SSS_ATLAS__PI;
    for (step = 0; step < 64; step++) // to the last bit
    {
        g->radius = 0.5 * (low + high);
        if ((sss_atlas__sum_angles(g, longest, beyond) < SSS_ATLAS__PI) == beyond)
        {
            low = g->radius;
        }
        else
        {
            high = g->radius;
        }
    }
}

// Boundary vertices along the sides by arc length, interior in the centre.
static void sss_atlas__put_on_polygon(sss_atlas__sheet *s, const sss_atlas__polygon *g)
{
    double angle = 0.0;
    uint32_t i, e;
    int c;
    memset(s->p, 0, s->n * sizeof *s->p);
    for (i = 0; i < g->count; i++)
    {
        const double from[2] = {g->radius * cos(angle), g->radius * sin(angle)};
        const double to[2] = {g->radius * cos(angle + 2.0 * g->half[i]), g->radius * sin(angle + 2.0 * g->half[i])};
        double length = 0.0, at = 0.0, least;
        for (e = g->first[i]; e < g->first[i + 1]; e++)
        {
            length += sss_atlas__edge_mm(s, e);
        }
        least = sss_atlas__max(1e-3 * length, 1e-6 * g->radius) / (g->first[i + 1] - g->first[i]);
        length += least * (g->first[i + 1] - g->first[i]);
        for (e = g->first[i]; e < g->first[i + 1]; e++)
        {
            for (c = 0; c < 2; c++)
            {
                s->p[s->outline[e]][c] = from[c] + at / length * (to[c] - from[c]);
            }
            at += sss_atlas__edge_mm(s, e) + least;
        }
        angle += 2.0 * g->half[i];
    }
}

// ---- Sander's relaxation ----

// Stretch of the triangles around a vertex, times area; both_ways: their symmetric Dirichlet energy.
static double sss_atlas__ring_cost(const sss_atlas__sheet *s, uint32_t i, int both_ways)
{
    double sum = 0.0, J[2][2];
    uint32_t q;
    for (q = s->ring_begin[i]; q < s->ring_begin[i + 1]; q++)
    {
        const uint32_t k = s->ring[q] / 3;
        if (s->area[k] > 0.0)
        {
            const double det = sss_atlas__jacobian(s, (const double (*)[2])s->p, k, J);
            const double square = s->area[k] * sss_atlas__square((const double (*)[2])J);
            sum += det > 0.0 ? square * ((both_ways ? 1.0 : 0.0) + 1.0 / (det * det)) : HUGE_VAL;
        }
    }
    return sum;
}

// How far a vertex may go along a direction, both ways, until a triangle loses its area: orient is linear in its place.
static void sss_atlas__free_way(const sss_atlas__sheet *s, uint32_t i, const double d[2], double out[2])
{
    uint32_t q;
    out[0] = -1.0; // the chart's size is 1
    out[1] = 1.0;
    for (q = s->ring_begin[i]; q < s->ring_begin[i + 1]; q++)
    {
        const uint32_t k = s->ring[q] / 3, j = s->ring[q] % 3;
        const double *a = s->p[s->triangle[3 * k + (j + 1) % 3]], *b = s->p[s->triangle[3 * k + (j + 2) % 3]];
        const double orient = sss_atlas__orient(s->p[i], a, b);
        const double change = (b[0] - a[0]) * d[1] - (b[1] - a[1]) * d[0]; // of orient, for a step of d
        if (s->area[k] > 0.0 && change < 0.0)
        {
            out[1] = sss_atlas__min(out[1], -orient / change);
        }
        else if (s->area[k] > 0.0 && change > 0.0)
        {
            out[0] = sss_atlas__max(out[0], -orient / change);
        }
    }
}

// One vertex along one direction, to the least cost of its triangles: golden sections between 95 % of both ways.
static void sss_atlas__relax_vertex(sss_atlas__sheet *s, uint32_t i, const double d[2], int both_ways)
{
    const double golden = 0.61803398874989485, from[2] = {s->p[i][0], s->p[i][1]};
    const double before = sss_atlas__ring_cost(s, i, both_ways);
    double way[2], at[2], value[2];
    int section, side;
    sss_atlas__free_way(s, i, d, way);
    way[0] *= 0.95;
    way[1] *= 0.95;
    for (side = 0; side < 2; side++)
    {
        at[side] = side ? way[0] + golden * (way[1] - way[0]) : way[1] - golden * (way[1] - way[0]);
        s->p[i][0] = from[0] + at[side] * d[0];
        s->p[i][1] = from[1] + at[side] * d[1];
        value[side] = sss_atlas__ring_cost(s, i, both_ways);
    }
    for (section = 0; section < SSS_ATLAS__SECTIONS; section++)
    {
        side = value[1] < value[0]; // the better one stays, as the other's successor
        way[!side] = at[!side];
        at[!side] = at[side];
        value[!side] = value[side];
        at[side] = side ? way[0] + golden * (way[1] - way[0]) : way[1] - golden * (way[1] - way[0]);
        s->p[i][0] = from[0] + at[side] * d[0];
        s->p[i][1] = from[1] + at[side] * d[1];
        value[side] = sss_atlas__ring_cost(s, i, both_ways);
    }
    side = value[1] < value[0];
    s->p[i][0] = from[0] + at[side] * d[0];
    s->p[i][1] = from[1] + at[side] * d[1];
    if (!(sss_atlas__ring_cost(s, i, both_ways) < before))
    {
        s->p[i][0] = from[0];
        s->p[i][1] = from[1];
    }
}

// Sander et al. 2001, section 3: interior vertices, those with the largest stretch first, along directions drawn at
// random, here by the golden ratio from a vertex's number. Sorted by octaves of stretch: counting is enough.
static void sss_atlas__relax(sss_atlas__sheet *s)
{
    uint32_t begin[65], i;
    int sweep, octave;
    for (sweep = 0; sweep < SSS_ATLAS__SWEEPS; sweep++)
    {
        memset(begin, 0, sizeof begin);
        sss_atlas__total_stretch2(s, (const double (*)[2])s->p, s->sigma);
        for (i = 0; i < s->n; i++)
        {
            frexp(sss_atlas__finite(s->sigma[i]) ? s->sigma[i] * s->sigma[i] : 1e300, &octave);
            octave = octave > 31 ? 31 : octave < -32 ? -32 : octave;
            s->sigma[i] = 31 - octave; // largest first
            begin[1 + (int)s->sigma[i]]++;
        }
        for (octave = 0; octave < 64; octave++)
        {
            begin[octave + 1] += begin[octave];
        }
        for (i = 0; i < s->n; i++)
        {
            s->order[begin[(int)s->sigma[i]]++] = i;
        }
        for (i = 0; i < s->n; i++)
        {
            const uint32_t v = s->order[i];
            const double turn = 0.61803398874989485 * ((double)v + 0.5) + 0.25 * sweep; // next sweep: at right angles
            const double angle = 2.0 * SSS_ATLAS__PI * (turn - floor(turn)), d[2] = {cos(angle), sin(angle)};
            if (!s->fixed[v])
            {
                sss_atlas__relax_vertex(s, v, d, 0);
            }
        }
    }
}

// The vertices of squeezed triangles alone, by the same searches: a triangle seen from the side stops all others in a
// descent, though it is opened easily. Where the boundary would cross itself the boundary stays.
static void sss_atlas__loosen(sss_atlas__sheet *s)
{
    double J[2][2];
    uint32_t k;
    int with_boundary, sweep, j;
    sss_atlas__copy_points(s->n, (const double (*)[2])s->p, s->v[8]);
    for (with_boundary = 1; with_boundary >= 0; with_boundary--)
    {
        sss_atlas__fix(s, with_boundary ? 0 : s->edges);
        for (sweep = 0; sweep < SSS_ATLAS__SWEEPS; sweep++)
        {
            const double turn = 0.61803398874989485 * (sweep + 1), angle = 2.0 * SSS_ATLAS__PI * turn;
            const double d[2] = {cos(angle), sin(angle)}, across[2] = {-d[1], d[0]};
            for (k = 0; k < s->m; k++)
            {
                const double det = sss_atlas__jacobian(s, (const double (*)[2])s->p, k, J);
                const double square = sss_atlas__square((const double (*)[2])J);
                for (j = 0; j < 3 && s->area[k] > 0.0 && square > SSS_ATLAS__SQUEEZED * det * det; j++)
                {
                    const uint32_t v = s->triangle[3 * (size_t)k + (size_t)j];
                    if (!s->fixed[v])
                    {
                        sss_atlas__relax_vertex(s, v, d, 1);
                        sss_atlas__relax_vertex(s, v, across, 1);
                    }
                }
            }
        }
        if (sss_atlas__is_positive(s, 1) && sss_atlas__outline_meets(s) == 0 && sss_atlas__has_one_outline(s))
        {
            return;
        }
        sss_atlas__copy_points(s->n, (const double (*)[2])s->v[8], s->p);
    }
}

// ---- descent ----

// Symmetric Dirichlet energy (Smith and Schaefer 2015, "Bijective parameterization with free boundaries"): the stretch
// of the map and that of its inverse,
//     E = sum over triangles of A |J|^2 (1 + 1/det(J)^2) = sum of A (Gamma^2 + gamma^2 + Gamma^-2 + gamma^-2).
// 4 times the area for an isometry, infinite where a triangle has no area: an unbounded chart neither grows nor
// shrinks. Infinite unless all triangles are positive.
static double sss_atlas__energy(const sss_atlas__sheet *s, const double (*p)[2])
{
    double sum = 0.0, J[2][2];
    uint32_t k;
    for (k = 0; k < s->m; k++)
    {
        if (s->area[k] > 0.0)
        {
            const double det = sss_atlas__jacobian(s, p, k, J);
            if (!(det > 0.0))
            {
                return HUGE_VAL;
            }
            sum += s->area[k] * sss_atlas__square((const double (*)[2])J) * (1.0 + 1.0 / (det * det));
        }
    }
    return sss_atlas__finite(sum) ? sum : HUGE_VAL;
}

// dE/dJ = 2 A ((1 + 1/det^2) J - |J|^2/det^3 cof(J)), carried to the corners by the inverse edge matrix.
static void sss_atlas__gradient(const sss_atlas__sheet *s, const double (*p)[2], double (*out)[2])
{
    double J[2][2];
    uint32_t k;
    int c;
    memset(out, 0, s->n * sizeof *out);
    for (k = 0; k < s->m; k++)
    {
        const uint32_t *t = s->triangle + 3 * (size_t)k;
        const double *inverse = s->inverse[k];
        if (s->area[k] > 0.0)
        {
            const double det = sss_atlas__jacobian(s, p, k, J), square = sss_atlas__square((const double (*)[2])J);
            const double f = 2.0 * s->area[k] * (1.0 + 1.0 / (det * det));
            const double g = 2.0 * s->area[k] * square / (det * det * det);
            const double first[2] = {f * J[0][0] - g * J[1][1], f * J[0][1] + g * J[1][0]};
            const double second[2] = {f * J[1][0] + g * J[0][1], f * J[1][1] - g * J[0][0]};
            for (c = 0; c < 2; c++)
            {
                const double at1 = first[c] * inverse[0] + second[c] * inverse[1], at2 = second[c] * inverse[2];
                out[t[0]][c] -= at1 + at2;
                out[t[1]][c] += at1;
                out[t[2]][c] += at2;
            }
        }
    }
}

// A Laplacian that is like the energy's second derivative: cotangents as weights, kept between 1/20 and 20 so that all
// are positive, times the largest curvature of s^2 + s^-2 at the triangle's singular values, 2 + 6/s^4 at the smaller,
// over the 8 that it has for an isometry. So a triangle seen nearly from the side opens by a third in each step, while
// the others are moved as far as is good for them. Returns the largest of these factors.
static double sss_atlas__weigh_curvature(sss_atlas__sheet *s)
{
    double stiffest = 1.0, J[2][2], edge[3];
    uint32_t i, k, q;
    int j;
    for (q = 0; q < s->row[s->n]; q++)
    {
        s->weight[q] = 0.0;
    }
    for (k = 0; k < s->m; k++)
    {
        const uint32_t *t = s->triangle + 3 * (size_t)k;
        const double det = sss_atlas__jacobian(s, (const double (*)[2])s->p, k, J);
        const double square = sss_atlas__square((const double (*)[2])J), root = square * square - 4.0 * det * det;
        const double smaller2 = 2.0 * det * det / (square + sqrt(sss_atlas__max(root, 0.0)));
        const double stiff = 0.25 + 0.75 / (smaller2 * smaller2);
        stiffest = s->area[k] > 0.0 ? sss_atlas__max(stiffest, stiff) : stiffest;
        sss_atlas__edge_lengths(s->inverse[k], edge);
        for (j = 0; j < 3 && s->area[k] > 0.0; j++)
        {
            const int a = (j + 1) % 3, c = (j + 2) % 3;
            const double dot = 0.5 * (edge[a] * edge[a] + edge[c] * edge[c] - edge[j] * edge[j]);
            const double w = 0.5 * stiff * sss_atlas__min(sss_atlas__max(dot / (2.0 * s->area[k]), 0.05), 20.0);
            s->weight[sss_atlas__find_column(s, t[a], t[c])] += w;
            s->weight[sss_atlas__find_column(s, t[c], t[a])] += w;
        }
    }
    for (i = 0; i < s->n; i++)
    {
        s->sigma[i] = 0.0;
        for (q = s->row[i]; q < s->row[i + 1]; q++)
        {
            s->sigma[i] += s->weight[q];
        }
    }
    return stiffest;
}

static void sss_atlas__clear_fixed(const sss_atlas__sheet *s, double (*v)[2])
{
    uint32_t i;
    for (i = 0; i < s->n; i++)
    {
        if (s->fixed[i])
        {
            v[i][0] = v[i][1] = 0.0;
        }
    }
}

// out = L^-1 g roughly: conjugate gradients preconditioned by the diagonal. L knows no constant, nor has g one.
// What is fixed has d = 0, and so L d = 0 there.
static void sss_atlas__smooth_gradient(sss_atlas__sheet *s, const double (*g)[2], double (*out)[2])
{
    sss_atlas__points r = s->v[5], d = s->v[6], Ld = s->v[7];
    double rho = 0.0, first;
    uint32_t i, q;
    int step, c;
    memset(out, 0, s->n * sizeof *out);
    for (i = 0; i < s->n; i++)
    {
        for (c = 0; c < 2; c++)
        {
            r[i][c] = g[i][c];
            d[i][c] = r[i][c] / s->sigma[i];
            rho += r[i][c] * d[i][c];
        }
    }
    first = rho;
    for (step = 0; step < SSS_ATLAS__SMOOTHINGS && rho > 1e-4 * first; step++)
    {
        double next = 0.0, alpha, along = 0.0;
        for (i = 0; i < s->n; i++)
        {
            double u = s->sigma[i] * d[i][0], v = s->sigma[i] * d[i][1];
            for (q = s->row[i]; q < s->row[i + 1] && !s->fixed[i]; q++)
            {
                const double *of = d[s->column[q]];
                u -= s->weight[q] * of[0];
                v -= s->weight[q] * of[1];
            }
            Ld[i][0] = u;
            Ld[i][1] = v;
            along += u * d[i][0] + v * d[i][1];
        }
        alpha = rho / along;
        if (!(along > 0.0) || !sss_atlas__finite(alpha))
        {
            return;
        }
        for (i = 0; i < s->n; i++)
        {
            for (c = 0; c < 2; c++)
            {
                out[i][c] += alpha * d[i][c];
                r[i][c] -= alpha * Ld[i][c];
                next += r[i][c] * r[i][c] / s->sigma[i];
            }
        }
        for (i = 0; i < s->n; i++)
        {
            for (c = 0; c < 2; c++)
            {
                d[i][c] = r[i][c] / s->sigma[i] + next / rho * d[i][c];
            }
        }
        rho = next;
    }
}

// Boundary edges that run into each other are held from now on, with them the whole of a hole's rim: else they would
// stop all other vertices. A rim wound the wrong way round on the surface, about a fold that is no part of the chart,
// wants to turn over for ever.
static void sss_atlas__hold(sss_atlas__sheet *s)
{
    uint32_t first = s->outer, end, e;
    int side;
    for (side = 0; side < 2; side++)
    {
        s->fixed[s->outline[s->met[side]]] = 1;
        s->fixed[s->outline_end[s->met[side]]] = 1;
    }
    for (; first < s->edges; first = end)
    {
        end = sss_atlas__end_of_loop(s, first);
        for (e = first; e < end && ((s->met[0] >= first && s->met[0] < end) || (s->met[1] >= first && s->met[1] < end));
             e++)
        {
            s->fixed[s->outline[e]] = 1;
        }
    }
}

// Goes along a direction as far as pays, to where no triangle turns over and the boundary stays simple. Armijo's rule;
// steps by the parabola through what is known. Returns the energy there, or the old one where no step pays; *step: the
// last length of a step and the new one; *held: boundary edges were in the way, and are held.
static double sss_atlas__search_line(sss_atlas__sheet *s, const double (*d)[2], double energy, double slope,
                                     double *step, int *held)
{
    sss_atlas__points from = s->v[8];
    double t = *step;
    int halving, met = 0;
    *held = 0;
    sss_atlas__copy_points(s->n, (const double (*)[2])s->p, from);
    for (halving = 0; halving < SSS_ATLAS__HALVINGS; halving++)
    {
        double found, best;
        sss_atlas__add_scaled(s->n, (const double (*)[2])from, t, d, s->p);
        found = sss_atlas__energy(s, (const double (*)[2])s->p);
        best = -0.5 * slope * t * t / (found - energy - slope * t); // the parabola's lowest point; 0 for infinite found
        if (found < energy + 1e-4 * slope * t && sss_atlas__is_positive(s, 1))
        {
            if (sss_atlas__outline_meets(s) != 0)
            {
                if (++met == SSS_ATLAS__MEETINGS)
                {
                    break;
                }
                t *= 0.5;
                continue;
            }
            if (!sss_atlas__has_one_outline(s))
            {
                t *= 0.5;
                continue;
            }
            *step = best > 0.0 && best < 4.0 * t ? sss_atlas__max(best, 0.5 * t) : 2.0 * t;
            return found;
        }
        t = sss_atlas__finite(best) && best > 0.1 * t && best < 0.5 * t ? best : 0.5 * t;
    }
    sss_atlas__copy_points(s->n, (const double (*)[2])from, s->p);
    if (met > 0)
    {
        sss_atlas__hold(s);
        *held = 1;
    }
    return energy;
}

// Whether areas are kept well enough, and shapes at all.
static int sss_atlas__is_even(const sss_atlas__sheet *s)
{
    double worst = 1.0, beyond = 0.0, energy = 0.0, J[2][2];
    uint32_t k;
    for (k = 0; k < s->m; k++)
    {
        if (s->area[k] > 0.0 && !s->thin[k])
        {
            const double det = sss_atlas__jacobian(s, (const double (*)[2])s->p, k, J);
            const double off = sss_atlas__max(det, 1.0 / det);
            worst = sss_atlas__max(worst, off);
            beyond += off > SSS_ATLAS__OFF ? s->area[k] : 0.0;
            energy += s->area[k] * sss_atlas__square((const double (*)[2])J) * (1.0 + 1.0 / (det * det));
        }
    }
    return worst <= SSS_ATLAS__WORST && beyond <= SSS_ATLAS__SHARE_OFF && energy <= 4.0 * SSS_ATLAS__MOST_ENERGY;
}

// All vertices, those of the boundary too, down the energy, from a map without overlap to another one: conjugate
// gradients (Polak and Ribiere) with the Laplacian as preconditioner, for the energy's second derivative is about
// eight times that.
static void sss_atlas__descend(sss_atlas__sheet *s)
{
    sss_atlas__points g = s->v[0], last_g = s->v[1], z = s->v[2], d = s->v[3];
    double energy, step = 0.125, gz = 0.0, stiffest = HUGE_VAL;
    int round, slow = 0, held = 0;
    sss_atlas__loosen(s);
    sss_atlas__fix(s, 0);
    energy = sss_atlas__energy(s, (const double (*)[2])s->p);
    for (round = 0; round < SSS_ATLAS__DESCENTS && energy < HUGE_VAL
                    && (energy > 4.0 * SSS_ATLAS__EVEN || stiffest > SSS_ATLAS__STIFF)
                    && (round < SSS_ATLAS__ENOUGH || energy > 4.0 * SSS_ATLAS__GOOD || !sss_atlas__is_even(s));
         round++)
    {
        const int again = held || stiffest > SSS_ATLAS__STIFF; // another Laplacian: another start
        double next_gz, beta = 0.0, slope, next;
        stiffest = again ? sss_atlas__weigh_curvature(s) : stiffest;
        sss_atlas__gradient(s, (const double (*)[2])s->p, g);
        sss_atlas__clear_fixed(s, g);
        sss_atlas__smooth_gradient(s, (const double (*)[2])g, z);
        next_gz = sss_atlas__sum_products(s->n, (const double (*)[2])g, (const double (*)[2])z);
        if (round > 0 && !again)
        {
            beta = (next_gz - sss_atlas__sum_products(s->n, (const double (*)[2])last_g, (const double (*)[2])z)) / gz;
            beta = sss_atlas__finite(beta) ? sss_atlas__max(beta, 0.0) : 0.0;
        }
        sss_atlas__add_scaled(s->n, (const double (*)[2])z, -beta, (const double (*)[2])d, d); // -d
        sss_atlas__add_scaled(s->n, (const double (*)[2])d, -2.0, (const double (*)[2])d, d);
        slope = sss_atlas__sum_products(s->n, (const double (*)[2])g, (const double (*)[2])d);
        if (!(slope < 0.0))
        {
            sss_atlas__add_scaled(s->n, (const double (*)[2])z, -2.0, (const double (*)[2])z, d);
            slope = -next_gz;
        }
        next = sss_atlas__search_line(s, (const double (*)[2])d, energy, slope, &step, &held);
        if (held)
        {
            continue;
        }
        slow = next - 4.0 > (1.0 - SSS_ATLAS__SLOW_DESCENT) * (energy - 4.0) ? slow + 1 : 0;
        if (slow == 2 || !(next < energy))
        {
            return;
        }
        energy = next;
        gz = next_gz;
        sss_atlas__copy_points(s->n, (const double (*)[2])g, last_g);
    }
}

// ---- the three methods ----

static void sss_atlas__multiply(sss_atlas__sheet *s, double factor)
{
    uint32_t i;
    for (i = 0; i < s->n; i++)
    {
        s->p[i][0] *= factor;
        s->p[i][1] *= factor;
    }
}

// To an area of 1, as the surface has it.
static void sss_atlas__make_area_one(sss_atlas__sheet *s)
{
    double twice = 0.0;
    uint32_t k;
    for (k = 0; k < s->m; k++)
    {
        const uint32_t *t = s->triangle + 3 * (size_t)k;
        twice += sss_atlas__orient(s->p[t[0]], s->p[t[1]], s->p[t[2]]);
    }
    if (twice > 0.0)
    {
        sss_atlas__multiply(s, sqrt(2.0 / twice));
    }
}

// Convex charts that are not good had better be divided, unless their number is limited, or they hardly count.
static int sss_atlas__may_divide(const sss_atlas__sheet *s)
{
    return s->b->options.max_charts == 0 && s->share_of_surface > SSS_ATLAS__SMALL_SHARE;
}

// A disk with holes, or without: Euler's characteristic is 2 less the loops. (Two parts with a handle would pass; they
// cannot lie flat, which is tested.)
static int sss_atlas__is_planar(const sss_atlas__sheet *s)
{
    return s->edges > 0 && (3 * (uint64_t)s->m + s->edges) / 2 + 2 == (uint64_t)s->n + s->m + s->loops;
}

// A map without overlap in which every triangle has area. Seen from above where that is one: it is a convex combination
// too, that of its own mean value coordinates, and needs no more evening out than the descent does anyway (measured on
// the bunny: Yoshizawa's iteration before it doubles the time and leaves the L2 stretch at 1.0008 instead of 1.0009).
// Else the evened convex combination within the outline seen from above, holes and all; or with the outer loop
// on a circle and holes filled, where a convex combination always is without overlap (Tutte 1963, Floater 1997).
static int sss_atlas__start(sss_atlas__sheet *s)
{
    const int seen = sss_atlas__view(s, 1);
    const int parted = sss_atlas__part(s), positive = seen && sss_atlas__is_positive(s, 1);
    int simple;
    s->gap = parted ? s->gap : 0.0;
    simple = sss_atlas__outline_meets(s) == 0 && sss_atlas__has_one_outline(s);
    sss_atlas__fix(s, s->edges);
    if (simple && (positive || sss_atlas__even_out(s, SSS_ATLAS__START_ROUNDS)))
    {
        return 1;
    }
    if (!sss_atlas__is_planar(s))
    {
        return 0;
    }
    sss_atlas__fix(s, s->outer);
    sss_atlas__put_on_circle(s);
    return sss_atlas__even_out(s, SSS_ATLAS__START_ROUNDS) && !sss_atlas__overlaps_itself(s, 1);
}

static int sss_atlas__lay_area(sss_atlas__sheet *s)
{
    const double gap = s->gap;
    if (sss_atlas__start(s))
    {
        sss_atlas__make_area_one(s);
        s->gap = sss_atlas__part(s) ? s->gap : 0.0; // what is near from the start must not stop all others
        sss_atlas__descend(s);
        sss_atlas__make_area_one(s);
    }
    else
    {
        sss_atlas__view(s, 0); // as it is: triangles without area may be lines
        sss_atlas__make_area_one(s);
    }
    s->gap = gap;
    return (sss_atlas__is_even(s) || s->b->options.max_charts > 0) && sss_atlas__is_sound(s);
}

// Whether the outer loop turns right nowhere, but for rounding. It is simple, and so goes round once.
static int sss_atlas__is_convex(const sss_atlas__sheet *s)
{
    const double rounding = SSS_ATLAS__ROUNDING * sss_atlas__extent(s);
    uint32_t e;
    for (e = 0; e < s->outer; e++)
    {
        const double *a = s->p[s->outline[e]], *b = s->p[s->outline_end[e]];
        const double *c = s->p[s->outline_end[e + 1 < s->outer ? e + 1 : 0]];
        const double size = fabs(b[0] - a[0]) + fabs(b[1] - a[1]) + fabs(c[0] - a[0]) + fabs(c[1] - a[1]);
        if (sss_atlas__orient(a, b, c) < -rounding * size)
        {
            return 0;
        }
    }
    return 1;
}

static int sss_atlas__lay_convex(sss_atlas__sheet *s)
{
    sss_atlas__polygon polygon;
    double stretch;
    if (!sss_atlas__is_planar(s) || s->outer < 3)
    {
        return 0;
    }
    sss_atlas__fix(s, s->outer);
    sss_atlas__choose_corners(s, &polygon);
    sss_atlas__close_polygon(s, &polygon);
    sss_atlas__put_on_polygon(s, &polygon);
    sss_atlas__make_area_one(s);
    if (!sss_atlas__even_out(s, SSS_ATLAS__ROUNDS))
    {
        return 0;
    }
    sss_atlas__fix(s, s->edges); // rims of holes too: only triangles keep from overlap what is relaxed
    sss_atlas__relax(s);
    sss_atlas__make_area_one(s);
    stretch = sqrt(sss_atlas__total_stretch2(s, (const double (*)[2])s->p, NULL));
    return (stretch <= SSS_ATLAS__MOST_STRETCH || !sss_atlas__may_divide(s)) && sss_atlas__is_sound(s)
           && sss_atlas__is_convex(s);
}

// A chart without area: on a line, along the box's longest side.
static void sss_atlas__lay_line(sss_atlas__sheet *s)
{
    const sss_atlas__build *b = s->b;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    int i, axis = 0;
    uint32_t a;
    for (a = 0; a < s->n; a++)
    {
        const double *x = b->x[b->vertex[s->chart->first_vertex + a]];
        for (i = 0; i < 3; i++)
        {
            low[i] = sss_atlas__min(low[i], x[i]);
            high[i] = sss_atlas__max(high[i], x[i]);
        }
    }
    for (i = 1; i < 3; i++)
    {
        axis = high[i] - low[i] > high[axis] - low[axis] ? i : axis;
    }
    for (a = 0; a < s->n; a++)
    {
        s->p[a][0] = b->x[b->vertex[s->chart->first_vertex + a]][axis] - low[axis];
        s->p[a][1] = 0.0;
    }
}

// A single triangle has its true shape.
static void sss_atlas__lay_single(sss_atlas__sheet *s)
{
    const sss_atlas__build *b = s->b;
    const uint32_t *corner = b->triangles + 3 * (size_t)b->chart_triangles[s->chart->first_triangle];
    double shape[3];
    sss_atlas__lay_triangle(b->x[corner[0]], b->x[corner[1]], b->x[corner[2]], shape);
    s->p[s->triangle[0]][0] = s->p[s->triangle[0]][1] = s->p[s->triangle[1]][1] = 0.0;
    s->p[s->triangle[1]][0] = shape[0];
    s->p[s->triangle[2]][0] = shape[1];
    s->p[s->triangle[2]][1] = shape[2];
}

// ---- all charts ----

// The ranges of one chart, and its triangles and boundary in local numbers.
static void sss_atlas__open_sheet(const sss_atlas__flat *f, size_t c, sss_atlas__sheet *s)
{
    const sss_atlas__build *b = f->b;
    const sss_atlas__chart *chart = &b->charts[c];
    const size_t v = chart->first_vertex, t = chart->first_triangle, e = b->loops[chart->first_loop];
    const size_t corner = v + c; // of arrays that need one more than there are vertices
    uint32_t i;
    memset(s, 0, sizeof *s);
    s->b = b;
    s->chart = chart;
    s->n = chart->vertex_count;
    s->m = chart->triangle_count;
    s->edges = b->loops[chart->first_loop + chart->loop_count] - b->loops[chart->first_loop];
    s->scale = 1.0;
    s->gap = SSS_ATLAS__GAP / SSS_ATLAS__UNITS * sqrt(f->surface / SSS_ATLAS__LEAST_SHARE);
    s->share_of_surface = f->surface > 0.0 ? chart->area / f->surface : 0.0;
    s->triangle = f->triangle + 3 * t;
    s->inverse = f->inverse + t;
    s->area = f->area + t;
    s->thin = f->thin + t;
    s->bad = f->bad + t;
    s->fixed = f->fixed + v;
    s->outline = f->outline + e;
    s->outline_end = f->outline_end + e;
    s->apex = f->apex + e;
    s->cell = f->cell + e;
    s->entry = f->entry + 2 * SSS_ATLAS__CELLS * e;
    s->order = f->order + 2 * v + t;
    s->p = f->p + v;
    s->ring_begin = f->ring_begin + corner;
    s->row = f->row + corner;
    s->ring = f->ring + 3 * t;
    s->column = f->column + 3 * t + 3 * e;
    s->weight = f->weight + 3 * t + 3 * e;
    s->share = f->share + 3 * t + 3 * e;
    s->sigma = f->sigma + v;
    for (i = 0; i < SSS_ATLAS__VECTORS; i++)
    {
        s->v[i] = f->v[i] + v;
    }
}

static void sss_atlas__number_sheet(sss_atlas__sheet *s)
{
    const sss_atlas__build *b = s->b;
    const uint32_t first = s->chart->first_vertex, *loops = b->loops + s->chart->first_loop;
    double longest = -1.0;
    uint32_t i, e, outer = 0, count = 0;
    int turn;
    for (i = 0; i < 3 * s->m; i++)
    {
        s->triangle[i] = b->corner[3 * (size_t)b->chart_triangles[s->chart->first_triangle + i / 3] + i % 3] - first;
    }
    for (i = 0; i < s->chart->loop_count; i++)
    {
        double length = 0.0;
        for (e = loops[i]; e < loops[i + 1]; e++)
        {
            const uint32_t edge = b->loop_edges[e], next = edge / 3 * 3 + (edge + 1) % 3;
            const double *x = b->x[b->triangles[edge]], *y = b->x[b->triangles[next]];
            const double d[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]};
            length += sss_atlas__length(d);
        }
        outer = length > longest ? i : outer;
        longest = sss_atlas__max(longest, length);
    }
    // The outer loop, then the others, without those of two edges: both run between the same two vertices, so that they
    // are one edge in any map, as if it were inside.
    for (turn = 0; turn < 2; turn++)
    {
        for (i = 0; i < s->chart->loop_count; i++)
        {
            const int slit = i != outer && loops[i + 1] - loops[i] == 2;
            s->loops += !slit && (i == outer) == (turn == 0);
            for (e = loops[i]; e < loops[i + 1] && (i == outer) == (turn == 0) && !slit; e++)
            {
                const uint32_t edge = b->loop_edges[e];
                s->outline[count] = b->corner[edge] - first;
                s->apex[count] = b->corner[edge / 3 * 3 + (edge + 2) % 3] - first;
                s->outline_end[count++] = b->corner[edge / 3 * 3 + (edge + 1) % 3] - first;
            }
        }
        s->outer = turn == 0 ? count : s->outer;
    }
    s->edges = count;
}

static int sss_atlas__lay_sheet(sss_atlas__sheet *s)
{
    int flat;
    if (s->m == 1)
    {
        sss_atlas__lay_single(s);
        return 1;
    }
    if (!sss_atlas__measure_sheet(s))
    {
        sss_atlas__lay_line(s);
        return 1;
    }
    if (s->edges == 0)
    {
        return 0;
    }
    s->gap *= s->scale;
    flat = s->b->options.method == SSS_ATLAS_ORTHOGRAPHIC && sss_atlas__view(s, 0)
           && sss_atlas__is_sound(s);
    if (!flat) // also charts that fold, seen from above
    {
        sss_atlas__make_rings(s);
        sss_atlas__make_rows(s);
        flat = s->b->options.method == SSS_ATLAS_CONVEX ? sss_atlas__lay_convex(s) : sss_atlas__lay_area(s);
    }
    if (!flat)
    {
        sss_atlas__mark_bad(s);
    }
    sss_atlas__multiply(s, 1.0 / s->scale);
    return flat;
}

static void sss_atlas__lay_charts(void *context, size_t begin, size_t end)
{
    const sss_atlas__flat *f = (const sss_atlas__flat *)context;
    sss_atlas__build *b = f->b;
    sss_atlas__sheet s;
    size_t c;
    uint32_t i;
    for (c = begin; c < end; c++)
    {
        if (b->charts[c].is_flat || b->charts[c].triangle_count == 0)
        {
            continue;
        }
        sss_atlas__open_sheet(f, c, &s);
        sss_atlas__number_sheet(&s);
        b->charts[c].is_flat = sss_atlas__lay_sheet(&s);
        for (i = 0; i < s.m * 3 && b->charts[c].is_flat; i++)
        {
            const size_t corner = 3 * (size_t)b->chart_triangles[s.chart->first_triangle + i / 3] + i % 3;
            memcpy(b->corner_uv[corner], b->uv[b->corner[corner]], sizeof *b->corner_uv);
        }
    }
}

// What only the methods with convex combinations need.
static void sss_atlas__take_rows(sss_atlas__flat *f)
{
    sss_atlas__build *b = f->b;
    const size_t T = b->triangle_count, A = b->atlas_vertex_count, corners = A + b->chart_count;
    const size_t entries = 3 * (T + b->loops[b->loop_count]);
    sss_atlas__memory *m = &b->memory;
    int i;
    f->ring_begin = (uint32_t *)sss_atlas__take(m, corners, sizeof *f->ring_begin);
    f->row = (uint32_t *)sss_atlas__take(m, corners, sizeof *f->row);
    f->ring = (uint32_t *)sss_atlas__take(m, 3 * T, sizeof *f->ring);
    f->column = (uint32_t *)sss_atlas__take(m, entries, sizeof *f->column);
    f->weight = (double *)sss_atlas__take(m, entries, sizeof *f->weight);
    f->share = (double *)sss_atlas__take(m, entries, sizeof *f->share);
    f->sigma = (double *)sss_atlas__take(m, A, sizeof *f->sigma);
    for (i = 0; i < SSS_ATLAS__VECTORS; i++)
    {
        f->v[i] = (sss_atlas__points)sss_atlas__take(m, A, sizeof *f->v[i]);
    }
}

static void sss_atlas__drop_flat(sss_atlas__flat *f)
{
    sss_atlas__memory *m = &f->b->memory;
    int i;
    sss_atlas__drop(m, f->triangle);
    sss_atlas__drop(m, f->inverse);
    sss_atlas__drop(m, f->area);
    sss_atlas__drop(m, f->thin);
    sss_atlas__drop(m, f->bad);
    sss_atlas__drop(m, f->fixed);
    sss_atlas__drop(m, f->outline);
    sss_atlas__drop(m, f->outline_end);
    sss_atlas__drop(m, f->apex);
    sss_atlas__drop(m, f->cell);
    sss_atlas__drop(m, f->entry);
    sss_atlas__drop(m, f->order);
    sss_atlas__drop(m, f->ring_begin);
    sss_atlas__drop(m, f->row);
    sss_atlas__drop(m, f->ring);
    sss_atlas__drop(m, f->column);
    sss_atlas__drop(m, f->weight);
    sss_atlas__drop(m, f->share);
    sss_atlas__drop(m, f->sigma);
    for (i = 0; i < SSS_ATLAS__VECTORS; i++)
    {
        sss_atlas__drop(m, f->v[i]);
    }
}

// Lays out every chart that is not yet flat.
static sss_result sss_atlas__lay_flat(sss_atlas__build *b)
{
    const size_t T = b->triangle_count, A = b->atlas_vertex_count, E = b->loops[b->loop_count];
    sss_atlas__memory *m = &b->memory;
    sss_atlas__flat f;
    size_t c;
    memset(&f, 0, sizeof f);
    f.b = b;
    f.p = b->uv;
    for (c = 0; c < b->chart_count; c++)
    {
        f.surface += b->charts[c].area;
    }
    f.triangle = (uint32_t *)sss_atlas__take(m, 3 * T, sizeof *f.triangle);
    f.inverse = (double (*)[3])sss_atlas__take(m, T, sizeof *f.inverse);
    f.area = (double *)sss_atlas__take(m, T, sizeof *f.area);
    f.thin = (unsigned char *)sss_atlas__take(m, T, 1);
    f.bad = (unsigned char *)sss_atlas__take(m, T, 1);
    f.fixed = (unsigned char *)sss_atlas__take(m, A, 1);
    f.outline = (uint32_t *)sss_atlas__take(m, E, sizeof *f.outline);
    f.outline_end = (uint32_t *)sss_atlas__take(m, E, sizeof *f.outline_end);
    f.apex = (uint32_t *)sss_atlas__take(m, E, sizeof *f.apex);
    f.cell = (uint32_t *)sss_atlas__take(m, E, sizeof *f.cell);
    f.entry = (uint32_t *)sss_atlas__take(m, 2 * SSS_ATLAS__CELLS * E, sizeof *f.entry);
    f.order = (uint32_t *)sss_atlas__take(m, T + 2 * A, sizeof *f.order);
    sss_atlas__take_rows(&f);
    if (b->bad == NULL)
    {
        b->bad = (unsigned char *)sss_atlas__take(m, T, 1);
    }
    if (!m->failed)
    {
        sss_atlas__parallel(&m->hooks, b->chart_count, sss_atlas__lay_charts, &f);
    }
    sss_atlas__drop_flat(&f);
    return m->failed ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}
// ---- packing: minimal boxes ----

// Something to sort: by key, then by second, then by id.
typedef struct sss_atlas__item
{
    double key, second;
    uint32_t id;
} sss_atlas__item;

static int sss_atlas__item_before(const sss_atlas__item *a, const sss_atlas__item *b)
{
    if (a->key < b->key || a->key > b->key)
    {
        return a->key < b->key;
    }
    if (a->second < b->second || a->second > b->second)
    {
        return a->second < b->second;
    }
    return a->id < b->id;
}

// Merge sort, bottom up.   items  [count];   scratch  [count]
static void sss_atlas__sort_items(sss_atlas__item *items, size_t count, sss_atlas__item *scratch)
{
    size_t width, begin;
    for (width = 1; width < count; width *= 2)
    {
        for (begin = 0; begin < count; begin += 2 * width)
        {
            const size_t middle = begin + width < count ? begin + width : count;
            const size_t end = begin + 2 * width < count ? begin + 2 * width : count;
            size_t i = begin, j = middle, k;
            for (k = begin; k < end; k++)
            {
                const int left = j >= end || (i < middle && !sss_atlas__item_before(&items[j], &items[i]));
                scratch[k] = left ? items[i++] : items[j++];
            }
        }
        memcpy(items, scratch, count * sizeof *items);
    }
}

// Convex hull, counter-clockwise, without points on its edges (Andrew 1979).
//   items    [count] points as key and second; sorted on return;   scratch  [count];   hull  [2 count + 2]
static size_t sss_atlas__convex_hull(sss_atlas__item *items, size_t count, sss_atlas__item *scratch,
                                     double (*hull)[2])
{
    size_t n = 0, least = 1, step;
    sss_atlas__sort_items(items, count, scratch);
    for (step = 0; step < 2 * count; step++) // below from left to right, above back again
    {
        const sss_atlas__item *item = &items[step < count ? step : 2 * count - 1 - step];
        double p[2];
        p[0] = item->key;
        p[1] = item->second;
        if (step == count)
        {
            least = n;
        }
        while (n > least && sss_atlas__orient(hull[n - 2], hull[n - 1], p) <= 0.0)
        {
            n--;
        }
        if (n == 0 || p[0] < hull[n - 1][0] || p[0] > hull[n - 1][0] || p[1] < hull[n - 1][1] || p[1] > hull[n - 1][1])
        {
            hull[n][0] = p[0];
            hull[n][1] = p[1];
            n++;
        }
    }
    if (n > 1 && !(hull[0][0] < hull[n - 1][0]) && !(hull[0][0] > hull[n - 1][0]) && !(hull[0][1] < hull[n - 1][1]) &&
        !(hull[0][1] > hull[n - 1][1]))
    {
        n--; // the first point once more
    }
    return n;
}

// The farthest hull point along a direction, going on from where the last one was: it turns no more than once around.
static double sss_atlas__support(const double (*hull)[2], size_t n, const double direction[2], size_t *at)
{
    double best = hull[*at][0] * direction[0] + hull[*at][1] * direction[1];
    size_t i;
    for (i = 0; i < n; i++)
    {
        const size_t next = *at + 1 < n ? *at + 1 : 0;
        const double value = hull[next][0] * direction[0] + hull[next][1] * direction[1];
        if (value < best)
        {
            break;
        }
        best = value;
        *at = next;
    }
    return best;
}

// The box of least area around points: one of its sides lies on an edge of the hull (Freeman, Shapira 1975), so that
// rotating calipers find it (Toussaint 1983; Lensch 5.1).
//   items, scratch  [count];   hull  [2 count + 2]
//   axis  the unit direction of the longer side;   sides  longer, shorter
static void sss_atlas__minimal_box(const double (*points)[2], size_t count, sss_atlas__item *items,
                                   sss_atlas__item *scratch, double (*hull)[2], double axis[2], double sides[2])
{
    size_t at[3] = {0, 0, 0}, n, i;
    double least = -1.0;
    int k;
    for (i = 0; i < count; i++)
    {
        items[i].key = points[i][0];
        items[i].second = points[i][1];
        items[i].id = (uint32_t)i;
    }
    n = sss_atlas__convex_hull(items, count, scratch, hull);
    axis[0] = 1.0;
    axis[1] = sides[0] = sides[1] = 0.0;
    for (i = 0; i < n && n > 1; i++)
    {
        const double *a = hull[i], *b = hull[i + 1 < n ? i + 1 : 0];
        double d[3][2], reach[3], length, width, height;
        d[0][0] = b[0] - a[0];
        d[0][1] = b[1] - a[1];
        length = sqrt(d[0][0] * d[0][0] + d[0][1] * d[0][1]);
        if (!(length > 0.0))
        {
            continue;
        }
        d[0][0] /= length;
        d[0][1] /= length;
        d[1][0] = -d[0][1];
        d[1][1] = d[0][0];
        d[2][0] = -d[0][0];
        d[2][1] = -d[0][1];
        for (k = 0; k < 3; k++)
        {
            at[k] = k > 0 && least < 0.0 ? at[k - 1] : at[k];
            reach[k] = sss_atlas__support((const double (*)[2])hull, n, d[k], &at[k]);
        }
        width = reach[0] + reach[2];
        height = sss_atlas__max(reach[1] - (a[0] * d[1][0] + a[1] * d[1][1]), 0.0);
        if (least < 0.0 || width * height < least)
        {
            const int along = width >= height ? 0 : 1;
            least = width * height;
            axis[0] = d[along][0];
            axis[1] = d[along][1];
            sides[0] = along == 0 ? width : height;
            sides[1] = along == 0 ? height : width;
        }
    }
}

// ---- packing: masks ----

// Vertices may move this many grid units after they have been packed: rounding, and sss_atlas__repair.
#define SSS_ATLAS__SLACK 12

// Contact of a chart with what is around it is judged from so many cells, spread over a ring so wide.
#define SSS_ATLAS__SAMPLES 192
#define SSS_ATLAS__RING 8

#define SSS_ATLAS__ROOMY_RUNS 16  // of a mask are compared with the longest free run of a row first
#define SSS_ATLAS__SQUARES 4      // in a mask, the largest, are compared with what is free first
#define SSS_ATLAS__SQUARE_LEVELS 7 // up to 64 cells on a side
#define SSS_ATLAS__HIGH 32         // cells: for higher charts every other row is searched
#define SSS_ATLAS__SETTLES 8       // moves by a cell in the end
#define SSS_ATLAS__MANY 1500       // charts: quarter turns do for the others, and fewer samples
#define SSS_ATLAS__SEARCHES 8      // of these many, one in so many begins at the bottom
#define SSS_ATLAS__MASSES 20000    // charts: beyond, one rotation does
#define SSS_ATLAS__MOST_CELLS 4096 // on a side of the grid on which charts are placed

// Cells in a row: [x, end); 2^level is the largest power of two in it, see sss_atlas__occupancy.
typedef struct sss_atlas__span
{
    int32_t y, x, end, level;
} sss_atlas__span;

// A chart in one rotation: which cells it covers, whatever little of them.
typedef struct sss_atlas__mask
{
    int32_t size[2];               // cells
    uint32_t first, count;         // runs of covered cells: the longest, then well mixed, so that what is in the way
                                   // shows early
    uint32_t wide_first, wide_count; // runs of what is taken from others, row by row: gap cells more on all sides
    uint32_t first_sample, sample_count; // of the ring around
    sss_atlas__span squares[SSS_ATLAS__SQUARES]; // inside, of 2^level cells on a side
    uint32_t square_count;
    double origin[2];              // of the mask, cells from the chart's center
    double cells;                  // that are covered
} sss_atlas__mask;

typedef struct sss_atlas__placement
{
    int32_t x, y, turn;
} sss_atlas__placement;

// A chart's outline: edges on its boundary.
typedef struct sss_atlas__outline
{
    size_t first, count;           // edges
    double center[2], axis[2], sides[2];
    double area;                   // mm^2 in the plane
    int32_t turns;                 // rotations tried
} sss_atlas__outline;

// Which cells are taken: what charts cover and gap cells around, and what is outside of the texture's margin. Table j
// holds a bit for cell x where any of the cells x .. x + 2^j - 1 is taken, so that two reads decide for 64 places at a
// time whether a run fits.
typedef struct sss_atlas__occupancy
{
    int32_t size;                  // cells on a side, with the frame
    int32_t offset;                // of the texture's first cell
    int32_t levels;
    size_t words;                  // in a row, one more than needed
    uint64_t *bits;                // [levels][size][words]
    uint64_t *squares;             // [SQUARE_LEVELS][size][words] the same for squares of 2^j x 2^j cells
    int32_t *spacious;             // [size] the largest j with a free square in a row; -1: full
    int32_t *skyline;              // [words] the row above which a column of words is free, but for the frame
    int32_t *roomy;                // [size] the largest j with a free run of 2^j cells in a row; -1: full
} sss_atlas__occupancy;

typedef struct sss_atlas__packer
{
    sss_atlas__build *b;
    size_t count;                  // charts
    sss_atlas__outline *outlines;  // [count]
    double (*edges)[4];            // from, to: mm from the chart's center
    int32_t turns;                 // rotations tried
    double (*turn_axis)[2];        // [turns] cosine and sine against the minimal box
    int32_t step;                  // texels in a cell, on a side
    int32_t size, gap, margin;     // cells
    double scale;                  // cells per mm
    double slack;                  // cells
    sss_atlas__mask *masks;        // [count][turns]
    sss_atlas__span *runs;          // of all masks drawn
    size_t run_count, run_room, longest;
    int32_t *samples;              // of all masks, bits from the corner of the mask
    size_t sample_count, sample_room;
    double *needed;                // [count] least share of the texture of each chart
    double need[3];                // their sum: what stays, grows with the scale, grows with its square
    double missing;                // share of those that did not fit
    uint64_t seed;
    double placed;                 // share of the texture that was placed before the first chart that did not fit
    int32_t floor, lowest;         // the row where searches begin, the lowest where a mask fitted
    size_t searches;
    size_t most_samples;           // of a mask
    int32_t square_levels;
    double lean;                   // how much a chart's height counts beside its place
    int32_t window;                // rows above the lowest place that are searched for a better one
    uint64_t *canvas, *toggle;     // room to draw one mask
    size_t canvas_room;
    sss_atlas__occupancy occupancy;
    size_t occupancy_room, square_room, row_room;
    uint64_t *blocked;             // [3][words] scratch
    int32_t *tops;                 // [words] scratch: the skyline under a mask
    sss_atlas__item *items, *items_scratch;
    double most_work;
    double work;                   // words read and written: what the search may cost is counted, not timed
} sss_atlas__packer;

static int32_t sss_atlas__floor_log2(uint32_t x)
{
    int32_t n = 0;
    while (x > 1)
    {
        x >>= 1;
        n++;
    }
    return n;
}

// The lowest bit that is set; x is not 0.
static int sss_atlas__lowest_bit(uint64_t x)
{
    int n = 0, half;
    for (half = 32; half > 0; half /= 2)
    {
        if ((x & ((UINT64_C(1) << half) - 1)) == 0)
        {
            x >>= half;
            n += half;
        }
    }
    return n;
}

// Sets bits [begin, end) of a row.
static void sss_atlas__set_bits(uint64_t *row, size_t begin, size_t end)
{
    while (begin < end)
    {
        const size_t word = begin / 64, stop = (word + 1) * 64 < end ? (word + 1) * 64 : end;
        const uint64_t upper = stop % 64 != 0 ? (UINT64_C(1) << (stop % 64)) - 1 : ~UINT64_C(0);
        row[word] |= upper & (~UINT64_C(0) << (begin % 64));
        begin = stop;
    }
}

// One edge of an outline into the canvas: every cell that it comes near. What crosses the middle line of a row turns
// inside to outside there, from the next centre on.
static void sss_atlas__draw_edge(sss_atlas__packer *p, size_t words, const int32_t size[2], const double from[2],
                                 const double to[2])
{
    const double *a = from[1] <= to[1] ? from : to, *b = from[1] <= to[1] ? to : from;
    const double slope = b[1] > a[1] ? (b[0] - a[0]) / (b[1] - a[1]) : 0.0, slack = p->slack;
    const double low = sss_atlas__min(a[0], b[0]), high = sss_atlas__max(a[0], b[0]);
    int32_t row = (int32_t)(a[1] - slack), last = (int32_t)(b[1] + slack); // not negative: see the origin of masks
    last = last < size[1] ? last : size[1] - 1;
    for (; row <= last; row++)
    {
        double x0 = low, x1 = high, middle = row + 0.5;
        if (b[1] - a[1] > 1.0) // else the whole edge counts: it lies in two rows at most
        {
            const double at0 = a[0] + (sss_atlas__max(row - slack, a[1]) - a[1]) * slope;
            const double at1 = a[0] + (sss_atlas__min(row + 1 + slack, b[1]) - a[1]) * slope;
            x0 = sss_atlas__max(low, sss_atlas__min(at0, at1));
            x1 = sss_atlas__min(high, sss_atlas__max(at0, at1));
        }
        {
            const int32_t begin = (int32_t)(x0 - slack), end = (int32_t)(x1 + slack) + 1;
            sss_atlas__set_bits(p->canvas + (size_t)row * words, (size_t)begin,
                                (size_t)(end < size[0] ? end : size[0]));
        }
        if (a[1] <= middle && middle < b[1])
        {
            const double x = sss_atlas__max(low, sss_atlas__min(high, a[0] + (middle - a[1]) * slope));
            const int32_t cell = (int32_t)ceil(x - 0.5); // size[0] at most: outside is outside there too, and has room
            p->toggle[(size_t)row * words + (size_t)cell / 64] ^= UINT64_C(1) << (cell % 64);
        }
    }
}

// What lies inside: between the edges of each row.
static void sss_atlas__fill_canvas(sss_atlas__packer *p, size_t words, size_t rows)
{
    size_t row, word;
    for (row = 0; row < rows; row++)
    {
        uint64_t carry = 0;
        for (word = 0; word < words; word++)
        {
            uint64_t x = p->toggle[row * words + word];
            int shift;
            for (shift = 1; shift < 64; shift *= 2)
            {
                x ^= x << shift;
            }
            x ^= carry;
            carry = (x >> 63) != 0 ? ~UINT64_C(0) : 0;
            p->canvas[row * words + word] |= x;
        }
    }
}

// Each cell spreads to `gap` more on all sides; the canvas has 2 gap more columns and rows, its origin moves.
static void sss_atlas__widen_canvas(uint64_t *canvas, size_t words, size_t rows, int32_t gap)
{
    int32_t reach = 1, wanted = 2 * gap + 1;
    while (reach < wanted) // in doubling steps
    {
        const int32_t all = reach < wanted - reach ? reach : wanted - reach, by = all < 63 ? all : 63;
        size_t row, i;
        for (row = 0; row < rows; row++)
        {
            uint64_t *line = canvas + row * words;
            for (i = words; i-- > 0;)
            {
                line[i] |= (line[i] << by) | (i > 0 ? line[i - 1] >> (64 - by) : 0);
            }
        }
        for (row = rows; row-- > (size_t)by;)
        {
            for (i = 0; i < words; i++)
            {
                canvas[row * words + i] |= canvas[(row - (size_t)by) * words + i];
            }
        }
        reach += by;
    }
}

static int sss_atlas__add_run(sss_atlas__packer *p, size_t y, size_t begin, size_t end)
{
    sss_atlas__span *run;
    if (p->run_count == p->run_room)
    {
        const size_t room = p->run_room * 2 + 4096;
        sss_atlas__span *more = (sss_atlas__span *)sss_atlas__take(&p->b->memory, room, sizeof *more);
        if (more == NULL)
        {
            return 0;
        }
        if (p->run_count > 0)
        {
            memcpy(more, p->runs, p->run_count * sizeof *more);
        }
        sss_atlas__drop(&p->b->memory, p->runs);
        p->runs = more;
        p->run_room = room;
    }
    run = &p->runs[p->run_count++];
    run->y = (int32_t)y;
    run->x = (int32_t)begin;
    run->end = (int32_t)end;
    run->level = sss_atlas__floor_log2((uint32_t)(end - begin));
    p->longest = end - begin > p->longest ? end - begin : p->longest;
    return 1;
}

static double sss_atlas__count_cells(const uint64_t *canvas, size_t words)
{
    size_t i, sum = 0;
    for (i = 0; i < words; i++)
    {
        uint64_t x = canvas[i] - ((canvas[i] >> 1) & UINT64_C(0x5555555555555555)); // sums of 2, 4, 8 bits, then all
        x = (x & UINT64_C(0x3333333333333333)) + ((x >> 2) & UINT64_C(0x3333333333333333));
        x = (x + (x >> 4)) & UINT64_C(0x0f0f0f0f0f0f0f0f);
        sum += (size_t)((x * UINT64_C(0x0101010101010101)) >> 56);
    }
    return (double)sum;
}

// The canvas as runs, those with no more than `merge` cells in between as one; 0: no memory.
static int sss_atlas__canvas_to_runs(sss_atlas__packer *p, size_t words, size_t rows, size_t merge)
{
    size_t row, word;
    for (row = 0; row < rows; row++)
    {
        const uint64_t *line = p->canvas + row * words;
        size_t begin = 0, end = 0; // of the run that is not written yet
        int inside = 0;
        for (word = 0; word <= words; word++)
        {
            const uint64_t bits = word < words ? line[word] : 0;
            uint64_t change = bits ^ ((bits << 1) | (uint64_t)inside);
            for (; change != 0; change &= change - 1)
            {
                const size_t at = word * 64 + (size_t)sss_atlas__lowest_bit(change);
                if (inside)
                {
                    end = at;
                }
                else if (end == 0 || at - end > merge)
                {
                    if (end > 0 && !sss_atlas__add_run(p, row, begin, end))
                    {
                        return 0;
                    }
                    begin = at;
                }
                inside = !inside;
            }
        }
        if (end > 0 && !sss_atlas__add_run(p, row, begin, end))
        {
            return 0;
        }
    }
    return 1;
}

// The longest run first, then every 2^k-th, k falling: neighbours tell the same.
static int sss_atlas__mix_runs(sss_atlas__packer *p, size_t first, size_t count)
{
    size_t i, n = 0, stride = 1, longest = 0;
    sss_atlas__span swap;
    while (stride < count)
    {
        stride *= 2;
    }
    for (i = 0; i < count; i++) // room behind
    {
        if (!sss_atlas__add_run(p, 0, 0, 1))
        {
            return 0;
        }
    }
    for (; stride > 0; stride /= 2)
    {
        for (i = stride == 1 || count <= 1 ? 0 : stride - 1; i < count; i += stride)
        {
            if (p->runs[first + i].level >= 0)
            {
                p->runs[first + count + n++] = p->runs[first + i];
                p->runs[first + i].level = -1;
            }
        }
    }
    p->run_count -= count;
    memmove(p->runs + first, p->runs + first + count, count * sizeof *p->runs);
    for (i = 0; i < count; i++)
    {
        const sss_atlas__span *run = &p->runs[first + i], *best = &p->runs[first + longest];
        longest = run->end - run->x > best->end - best->x ? i : longest;
    }
    swap = p->runs[first];
    p->runs[first] = p->runs[first + longest];
    p->runs[first + longest] = swap;
    return 1;
}

// Room in the canvas, cleared.
static int sss_atlas__clear_canvas(sss_atlas__packer *p, size_t words)
{
    if (words > p->canvas_room)
    {
        sss_atlas__drop(&p->b->memory, p->canvas);
        sss_atlas__drop(&p->b->memory, p->toggle);
        p->canvas_room = words + words / 2;
        p->canvas = (uint64_t *)sss_atlas__take(&p->b->memory, p->canvas_room, sizeof(uint64_t));
        p->toggle = (uint64_t *)sss_atlas__take(&p->b->memory, p->canvas_room, sizeof(uint64_t));
        return p->canvas != NULL && p->toggle != NULL;
    }
    memset(p->canvas, 0, words * sizeof *p->canvas);
    memset(p->toggle, 0, words * sizeof *p->toggle);
    return 1;
}

// Room for the samples of one more mask.
static int sss_atlas__reserve_samples(sss_atlas__packer *p)
{
    if (p->sample_count + SSS_ATLAS__SAMPLES > p->sample_room)
    {
        const size_t room = p->sample_room * 2 + 64 * SSS_ATLAS__SAMPLES;
        int32_t *more = (int32_t *)sss_atlas__take(&p->b->memory, room, sizeof *more);
        if (more == NULL)
        {
            return 0;
        }
        if (p->sample_count > 0)
        {
            memcpy(more, p->samples, p->sample_count * sizeof *more);
        }
        sss_atlas__drop(&p->b->memory, p->samples);
        p->samples = more;
        p->sample_room = room;
    }
    return 1;
}

// Samples of the ring around the mask that lies in the canvas. 0: no memory.
static int sss_atlas__sample_ring(sss_atlas__packer *p, sss_atlas__mask *m, size_t words, size_t rows)
{
    const size_t all = rows + 2 * SSS_ATLAS__RING;
    size_t row, word, seen = 0, stride = 0;
    int pass;
    if (!sss_atlas__reserve_samples(p))
    {
        return 0;
    }
    memset(p->toggle, 0, words * all * sizeof *p->toggle);
    memcpy(p->toggle, p->canvas, words * rows * sizeof *p->toggle);
    sss_atlas__widen_canvas(p->toggle, words, all, SSS_ATLAS__RING);
    m->first_sample = (uint32_t)p->sample_count;
    for (pass = 0; pass < 2; pass++) // counts, then takes every so many
    {
        size_t next = stride / 2;
        for (row = 0, seen = 0; row < all; row++)
        {
            const int inside = row >= SSS_ATLAS__RING && row < rows + SSS_ATLAS__RING;
            const uint64_t *mask = p->canvas + (inside ? row - SSS_ATLAS__RING : 0) * words;
            for (word = 0; word < words; word++)
            {
                const uint64_t before = word > 0 ? mask[word - 1] >> (64 - SSS_ATLAS__RING) : 0;
                const uint64_t covered = inside ? (mask[word] << SSS_ATLAS__RING) | before : 0;
                uint64_t bits = p->toggle[row * words + word] & ~covered;
                for (; bits != 0; bits &= bits - 1, seen++)
                {
                    if (pass == 1 && seen == next)
                    {
                        const int32_t x = (int32_t)(word * 64) + sss_atlas__lowest_bit(bits) - SSS_ATLAS__RING;
                        const int32_t y = (int32_t)row - SSS_ATLAS__RING;
                        p->samples[p->sample_count++] = y * (int32_t)(p->occupancy.words * 64) + x;
                        next += stride;
                    }
                }
            }
        }
        stride = seen / p->most_samples + 1;
    }
    m->sample_count = (uint32_t)p->sample_count - m->first_sample;
    return 1;
}

// A chart's rotation in cells: cosine and sine, scaled.
static void sss_atlas__turn(const sss_atlas__packer *p, size_t chart, int32_t turn, double out[2])
{
    const double *axis = p->outlines[chart].axis, *t = p->turn_axis[turn];
    out[0] = p->scale * (axis[0] * t[0] + axis[1] * t[1]); // first against the box's own direction
    out[1] = p->scale * (axis[0] * t[1] - axis[1] * t[0]);
}

// The largest squares of 2^level cells in the mask that lies in the canvas: first, last, and in between.
static void sss_atlas__find_squares(sss_atlas__packer *p, sss_atlas__mask *m, size_t words, size_t rows)
{
    uint64_t *at = p->toggle;
    size_t row, word, seen = 0, count = 0, left = rows;
    int32_t level = 0;
    memcpy(at, p->canvas, words * rows * sizeof *at);
    for (; level + 1 < p->square_levels; level++) // corners of squares twice as large
    {
        const size_t by = (size_t)1 << level;
        uint64_t any = 0;
        for (row = 0; row + by < left; row++)
        {
            for (word = 0; word < words; word++)
            {
                const uint64_t *a = at + row * words + word, *b = a + by * words;
                const uint64_t next = word + 1 < words ? a[1] & b[1] : 0, both = a[0] & b[0];
                any |= both & ((both >> by) | (next << (64 - by)));
            }
        }
        if (any == 0)
        {
            break;
        }
        left -= by;
        for (row = 0; row < left; row++)
        {
            for (word = 0; word < words; word++)
            {
                uint64_t *a = at + row * words + word, *b = a + by * words;
                const uint64_t next = word + 1 < words ? a[1] & b[1] : 0, both = a[0] & b[0];
                a[0] = both & ((both >> by) | (next << (64 - by)));
            }
        }
    }
    for (count = 0, word = 0; word < words * left; word++)
    {
        count += at[word] != 0;
    }
    m->square_count = 0;
    for (row = 0; row < left; row++)
    {
        for (word = 0; word < words; word++)
        {
            const uint64_t bits = at[row * words + word];
            if (bits != 0)
            {
                const size_t turn = m->square_count; // words 0, 1/3, 2/3 and 1 of the way
                if (turn < SSS_ATLAS__SQUARES && seen >= turn * (count - 1) / (SSS_ATLAS__SQUARES - 1))
                {
                    sss_atlas__span *square = &m->squares[m->square_count++];
                    square->x = (int32_t)(word * 64) + sss_atlas__lowest_bit(bits);
                    square->y = (int32_t)row;
                    square->level = level;
                    square->end = square->x + ((int32_t)1 << level);
                }
                seen++;
            }
        }
    }
}

// Size and origin of a chart's mask. 0: larger than the texture.
static int sss_atlas__size_mask(const sss_atlas__packer *p, const sss_atlas__outline *o, const double r[2],
                                sss_atlas__mask *m)
{
    double low[2] = {0, 0}, high[2] = {0, 0};
    size_t e;
    int k;
    for (e = 0; e < o->count; e++) // outlines are closed: every point is the first of an edge
    {
        const double *q = p->edges[o->first + e];
        for (k = 0; k < 2; k++)
        {
            const double at = k == 0 ? r[0] * q[0] - r[1] * q[1] : r[1] * q[0] + r[0] * q[1];
            low[k] = e == 0 || at < low[k] ? at : low[k];
            high[k] = e == 0 || at > high[k] ? at : high[k];
        }
    }
    for (k = 0; k < 2; k++)
    {
        const double extent = high[k] - low[k] + 4.0 * p->slack;
        m->origin[k] = low[k] - 2.0 * p->slack; // whatever comes near the edge of a cell stays in it
        m->size[k] = extent < p->size ? (int32_t)extent + 1 : p->size + 1;
    }
    return m->size[0] <= p->size - 2 * p->margin && m->size[1] <= p->size - 2 * p->margin;
}

// Draws a chart's mask at the present scale. 0: no memory. A mask that is larger than the texture gets no runs.
static int sss_atlas__draw_mask(sss_atlas__packer *p, size_t chart, int32_t turn)
{
    const int32_t widest = p->gap > SSS_ATLAS__RING ? p->gap : SSS_ATLAS__RING;
    const sss_atlas__outline *o = &p->outlines[chart];
    sss_atlas__mask *m = &p->masks[chart * (size_t)p->turns + (size_t)turn];
    double r[2], ends[2][2];
    size_t e, words, rows;
    int i;
    sss_atlas__turn(p, chart, turn, r);
    m->count = m->wide_count = 0;
    if (!sss_atlas__size_mask(p, o, r, m))
    {
        return 1;
    }
    words = (size_t)(m->size[0] + 2 * widest) / 64 + 1;
    rows = (size_t)m->size[1];
    if (!sss_atlas__clear_canvas(p, words * (rows + 2 * (size_t)widest)))
    {
        return 0;
    }
    for (e = 0; e < o->count; e++)
    {
        const double *q = p->edges[o->first + e];
        for (i = 0; i < 2; i++)
        {
            ends[i][0] = r[0] * q[2 * i] - r[1] * q[2 * i + 1] - m->origin[0];
            ends[i][1] = r[1] * q[2 * i] + r[0] * q[2 * i + 1] - m->origin[1];
        }
        sss_atlas__draw_edge(p, words, m->size, ends[0], ends[1]);
    }
    sss_atlas__fill_canvas(p, words, rows);
    sss_atlas__find_squares(p, m, words, rows);
    m->first = (uint32_t)p->run_count;
    m->cells = sss_atlas__count_cells(p->canvas, words * rows);
    i = sss_atlas__canvas_to_runs(p, words, rows, 2 * (size_t)p->gap); // no other chart comes in between: they are one
    m->count = (uint32_t)p->run_count - m->first;
    i = i && sss_atlas__mix_runs(p, m->first, m->count) && sss_atlas__sample_ring(p, m, words, rows);
    sss_atlas__widen_canvas(p->canvas, words, rows + 2 * (size_t)p->gap, p->gap);
    m->wide_first = (uint32_t)p->run_count;
    i = i && sss_atlas__canvas_to_runs(p, words, rows + 2 * (size_t)p->gap, 0);
    m->wide_count = (uint32_t)p->run_count - m->wide_first;
    p->work += (double)(words * rows * 16 + o->count * 8);
    return i;
}

// ---- packing: where a mask fits ----

// The tables of a row, after its cells begin .. end - 1 have changed.
static void sss_atlas__update_row(sss_atlas__packer *p, int32_t y, int32_t begin, int32_t end)
{
    sss_atlas__occupancy *o = &p->occupancy;
    const size_t table = (size_t)o->size * o->words, last = (size_t)(end - 1) / 64;
    uint64_t *row = o->bits + (size_t)y * o->words;
    int32_t level;
    o->roomy[y] = -1;
    for (level = 0; level < o->levels; level++, row += table)
    {
        uint64_t full = ~UINT64_C(0);
        size_t i;
        if (level > 0)
        {
            const uint64_t *below = row - table;
            const int32_t by = (int32_t)1 << (level - 1), reach = begin - (by * 2 - 1);
            const size_t words = (size_t)by / 64, bits = (size_t)by % 64;
            i = reach > 0 ? (size_t)reach / 64 : 0;
            for (; i <= last && i + words + 1 < o->words; i++)
            {
                row[i] = below[i] | (below[i + words] >> bits) | ((below[i + words + 1] << 1) << (63 - bits));
            }
            for (; i <= last; i++) // beyond the end all is taken
            {
                const uint64_t low = i + words < o->words ? below[i + words] : ~UINT64_C(0);
                row[i] = below[i] | (low >> bits) | ((~UINT64_C(0) << 1) << (63 - bits));
            }
        }
        for (i = 0; i < o->words; i++)
        {
            full &= row[i];
        }
        o->roomy[y] = full != ~UINT64_C(0) ? level : o->roomy[y];
    }
    p->work += (double)(o->levels * 16) + (double)o->words * o->levels;
}

// The squares' tables, after cells of rows y0 .. y1 - 1 and columns x0 .. x1 - 1 have changed.
static void sss_atlas__update_squares(sss_atlas__packer *p, int32_t y0, int32_t y1, int32_t x0, int32_t x1)
{
    sss_atlas__occupancy *o = &p->occupancy;
    const size_t table = (size_t)o->size * o->words, last = (size_t)(x1 - 1) / 64;
    int32_t level, y;
    size_t i;
    memcpy(o->squares + (size_t)y0 * o->words, o->bits + (size_t)y0 * o->words,
           (size_t)(y1 - y0) * o->words * sizeof *o->bits);
    for (level = 0; level < p->square_levels; level++)
    {
        const int32_t by = level > 0 ? (int32_t)1 << (level - 1) : 0, reach = level > 0 ? 2 * by - 1 : 0;
        const size_t first = x0 > reach ? (size_t)(x0 - reach) / 64 : 0;
        for (y = y0 > reach ? y0 - reach : 0; y < y1; y++)
        {
            uint64_t *to = o->squares + (size_t)level * table + (size_t)y * o->words, full = ~UINT64_C(0);
            const uint64_t *a = to - table, *b = y + by < o->size ? a + (size_t)by * o->words : a;
            for (i = first; level > 0 && i <= last; i++)
            {
                const uint64_t next = i + 1 < o->words ? a[i + 1] | b[i + 1] : ~UINT64_C(0), both = a[i] | b[i];
                to[i] = both | (both >> by) | (next << (64 - by));
            }
            for (i = 0; i < o->words; i++)
            {
                full &= to[i];
            }
            if (full != ~UINT64_C(0))
            {
                o->spacious[y] = level;
            }
            else if (o->spacious[y] >= level)
            {
                o->spacious[y] = level - 1;
            }
        }
    }
    p->work += (y1 - y0 + 32.0) * (double)p->square_levels * (double)(last - (size_t)x0 / 64 + o->words / 4 + 1);
}

// Everything free again, with room for the masks that have been drawn; tables are stale. 0: no memory.
static int sss_atlas__clear_occupancy(sss_atlas__packer *p)
{
    sss_atlas__occupancy *o = &p->occupancy;
    int32_t frame;
    size_t room, y;
    frame = o->offset + p->margin;
    o->levels = sss_atlas__floor_log2((uint32_t)(p->longest > 0 ? p->longest : 1)) + 1;
    room = (size_t)o->levels * (size_t)o->size * o->words;
    if (room > p->occupancy_room || room / (size_t)o->levels > p->square_room)
    {
        sss_atlas__drop(&p->b->memory, o->bits);
        p->occupancy_room = room;
        o->bits = (uint64_t *)sss_atlas__take(&p->b->memory, room, sizeof *o->bits);
        sss_atlas__drop(&p->b->memory, o->squares);
        o->squares = (uint64_t *)sss_atlas__take(&p->b->memory, room / (size_t)o->levels * SSS_ATLAS__SQUARE_LEVELS,
                                                 sizeof *o->squares);
        p->square_room = room / (size_t)o->levels;
    }
    if ((size_t)o->size > p->row_room)
    {
        sss_atlas__drop(&p->b->memory, o->roomy);
        sss_atlas__drop(&p->b->memory, o->skyline);
        sss_atlas__drop(&p->b->memory, o->spacious);
        sss_atlas__drop(&p->b->memory, p->tops);
        sss_atlas__drop(&p->b->memory, p->blocked);
        p->row_room = (size_t)o->size;
        o->roomy = (int32_t *)sss_atlas__take(&p->b->memory, p->row_room, sizeof *o->roomy);
        o->spacious = (int32_t *)sss_atlas__take(&p->b->memory, p->row_room, sizeof *o->spacious);
        o->skyline = (int32_t *)sss_atlas__take(&p->b->memory, o->words, sizeof *o->skyline);
        p->tops = (int32_t *)sss_atlas__take(&p->b->memory, o->words, sizeof *p->tops);
        p->blocked = (uint64_t *)sss_atlas__take(&p->b->memory, 3 * (p->row_room / 64 + 2), sizeof *p->blocked);
    }
    if (p->b->memory.failed)
    {
        return 0;
    }
    memset(o->bits, 0, (size_t)o->size * o->words * sizeof *o->bits);
    memset(o->skyline, 0, o->words * sizeof *o->skyline);
    for (y = 0; y < (size_t)o->size; y++)
    {
        const int inside = (int32_t)y >= frame && (int32_t)y < o->size - frame;
        sss_atlas__set_bits(o->bits + y * o->words, 0, inside ? (size_t)frame : o->words * 64);
        sss_atlas__set_bits(o->bits + y * o->words, (size_t)(o->size - frame), o->words * 64);
    }
    return 1;
}

// The tables of all rows.
static void sss_atlas__update_all(sss_atlas__packer *p)
{
    int32_t y;
    for (y = 0; y < p->occupancy.size; y++)
    {
        sss_atlas__update_row(p, y, 0, (int32_t)(p->occupancy.words * 64));
    }
    sss_atlas__update_squares(p, 0, p->occupancy.size, 0, (int32_t)(p->occupancy.words * 64));
}

// Takes the cells of a mask at a place, and those around.   update  also the tables of its rows
static void sss_atlas__stamp(sss_atlas__packer *p, const sss_atlas__mask *m, int32_t x, int32_t y, int update)
{
    sss_atlas__occupancy *o = &p->occupancy;
    uint32_t i = 0;
    x += o->offset - p->gap;
    y += o->offset - p->gap;
    while (i < m->wide_count) // row by row
    {
        const int32_t row = p->runs[m->wide_first + i].y, begin = p->runs[m->wide_first + i].x;
        uint64_t *line = o->bits + (size_t)(y + row) * o->words;
        int32_t end = begin;
        size_t word;
        for (; i < m->wide_count && p->runs[m->wide_first + i].y == row; i++)
        {
            const sss_atlas__span *run = &p->runs[m->wide_first + i];
            end = run->end;
            sss_atlas__set_bits(line, (size_t)(x + run->x), (size_t)(x + end));
        }
        for (word = (size_t)(x + begin) / 64; word <= (size_t)(x + end - 1) / 64; word++)
        {
            o->skyline[word] = o->skyline[word] > y + row + 1 ? o->skyline[word] : y + row + 1;
        }
        if (update)
        {
            sss_atlas__update_row(p, y + row, x + begin, x + end);
        }
    }
    if (update)
    {
        sss_atlas__update_squares(p, y, y + m->size[1] + 2 * p->gap, x, x + m->size[0] + 2 * p->gap);
    }
}

// Blocks places where a run of a mask, or a square of it, meets what is taken: reads of one or two tables of 2^level
// cells decide for 64 places at a time.
//   a, b  where the reads begin;   open  words in which there are places still.   Returns how many are left
static size_t sss_atlas__block_places(const uint64_t *row, size_t a, size_t b, uint64_t *blocked, uint32_t *open,
                               size_t count)
{
    const uint64_t *left = row + a / 64, *right = row + b / 64;
    const size_t s = a % 64, t = b % 64;
    size_t i, still = 0;
    for (i = 0; i < count; i++)
    {
        const uint32_t word = open[i];
        uint64_t x = blocked[word] | (left[word] >> s) | ((left[word + 1] << 1) << (63 - s));
        if (a != b)
        {
            x |= (right[word] >> t) | ((right[word + 1] << 1) << (63 - t));
        }
        blocked[word] = x;
        open[still] = word;
        still += x != ~UINT64_C(0);
    }
    return still;
}

// Where between x0 and x1 a mask fits in row y: a bit for each place where it does not. 0: nowhere.
static int sss_atlas__find_in_row(sss_atlas__packer *p, const sss_atlas__mask *m, int32_t x0, int32_t x1, int32_t y,
                                  uint64_t *blocked)
{
    const sss_atlas__occupancy *o = &p->occupancy;
    const size_t words = (size_t)(x1 - x0) / 64 + 1, spare = (size_t)(x1 - x0 + 1) % 64, table = (size_t)o->size;
    const sss_atlas__span *run = p->runs + m->first, *end = run + m->count;
    uint32_t open[SSS_ATLAS__MOST_CELLS / 64 + 1];
    size_t i, count = 0, clear;
    for (i = 0; i < words; i++)
    {
        blocked[i] = 0;
        open[count] = (uint32_t)i;
        count += y + o->offset < p->tops[i];
    }
    clear = words - count;
    blocked[words - 1] = spare != 0 ? ~UINT64_C(0) << spare : 0;
    x0 += o->offset;
    y += o->offset;
    for (i = 0; i < m->square_count && count > 0; i++)
    {
        const sss_atlas__span *square = &m->squares[i];
        const size_t at = (size_t)(x0 + square->x);
        const uint64_t *row = o->squares + ((size_t)square->level * table + (size_t)(y + square->y)) * o->words;
        p->work += 0.5 * (double)count + 2.0;
        count = sss_atlas__block_places(row, at, at, blocked, open, count);
    }
    for (; run < end && count > 0; run++)
    {
        const uint64_t *row = o->bits + ((size_t)run->level * table + (size_t)(y + run->y)) * o->words;
        const size_t at = (size_t)(x0 + run->x), to = (size_t)(x0 + run->end - ((int32_t)1 << run->level));
        p->work += (double)count + 2.0;
        count = sss_atlas__block_places(row, at, to, blocked, open, count);
    }
    return count + clear > 0;
}

// Where the skyline is under a mask, whichever place of a word it takes.
static void sss_atlas__find_tops(sss_atlas__packer *p, const sss_atlas__mask *m, int32_t x0, size_t words)
{
    const sss_atlas__occupancy *o = &p->occupancy;
    size_t word, i;
    for (word = 0; word < words; word++)
    {
        const size_t first = (size_t)(x0 + o->offset) + word * 64, last = (first + 62 + (size_t)m->size[0]) / 64;
        p->tops[word] = 0;
        for (i = first / 64; i <= last && i < o->words; i++)
        {
            p->tops[word] = p->tops[word] > o->skyline[i] ? p->tops[word] : o->skyline[i];
        }
    }
}

// Whether rows from y on have free squares and runs as large as the mask's: else it fits nowhere there.
static int sss_atlas__is_roomy(const sss_atlas__packer *p, const sss_atlas__mask *m, int32_t y)
{
    const sss_atlas__occupancy *o = &p->occupancy;
    uint32_t i;
    y += o->offset;
    for (i = 0; i < m->square_count; i++)
    {
        if (o->spacious[y + m->squares[i].y] < m->squares[i].level)
        {
            return 0;
        }
    }
    for (i = 0; i < m->count && i < SSS_ATLAS__ROOMY_RUNS; i++)
    {
        const sss_atlas__span *run = &p->runs[m->first + i];
        if (o->roomy[y + run->y] < run->level)
        {
            return 0;
        }
    }
    return 1;
}

// How many of the samples around a mask are taken.
static uint32_t sss_atlas__contact(const sss_atlas__packer *p, const sss_atlas__mask *m, int32_t x, int32_t y)
{
    const sss_atlas__occupancy *o = &p->occupancy;
    const int32_t corner = (y + o->offset) * (int32_t)(o->words * 64) + x + o->offset;
    const int32_t *sample = p->samples + m->first_sample, *end = sample + m->sample_count;
    uint64_t sum = 0;
    for (; sample < end; sample++)
    {
        const uint32_t bit = (uint32_t)(corner + *sample);
        sum += (o->bits[bit / 64] >> (bit % 64)) & 1u;
    }
    return (uint32_t)sum;
}

// ---- packing: all charts ----

#define SSS_ATLAS__WINDOW 0.06 // of the texture; less for many charts, which are smaller

// Cells of `step` texels in a texture of `size` texels.
static void sss_atlas__set_grid(sss_atlas__packer *p, size_t size, int32_t step, double texels_per_mm)
{
    const sss_atlas_options *options = &p->b->options;
    const int32_t border = options->border > 0 ? options->border : 0;
    const int32_t gap = options->gutter > 2 * border ? options->gutter : 2 * border;
    const int32_t most = ((int32_t)size - 1) / 2, margin = border < most ? border : most; // a texel is left in any case
    p->step = step;
    p->size = (int32_t)size / step;
    p->gap = (gap + step - 1) / step;
    p->margin = (margin + step - 1) / step;
    p->scale = texels_per_mm / step;
    p->slack = (SSS_ATLAS__SLACK * (double)size / SSS_ATLAS__UNITS + 1e-9 * (double)size) / step;
    p->run_count = p->sample_count = p->longest = 0;
    p->occupancy.offset = p->gap + SSS_ATLAS__RING;
    p->occupancy.size = p->size + 2 * p->occupancy.offset;
    p->occupancy.words = (size_t)p->occupancy.size / 64 + 2;
    p->window = (int32_t)(SSS_ATLAS__WINDOW * p->size * sqrt(64.0 / (64.0 + (double)p->count)));
    p->window = p->window > 4 ? p->window : 4;
}

static sss_atlas__mask *sss_atlas__mask_of(sss_atlas__packer *p, size_t chart, int32_t turn)
{
    return &p->masks[chart * (size_t)p->turns + (size_t)turn];
}

// All masks. 0: no memory.
static int sss_atlas__draw_all(sss_atlas__packer *p)
{
    size_t chart;
    int32_t turn;
    for (chart = 0; chart < p->count; chart++)
    {
        for (turn = 0; turn < p->outlines[chart].turns; turn++)
        {
            if (!sss_atlas__draw_mask(p, chart, turn))
            {
                return 0;
            }
        }
    }
    return 1;
}

// A lower bound on the share of the texture that the charts take with their gaps: a connected mask that grows by gap
// cells to the right and upwards does so in every row, then in every column, and grown masks are still disjoint.
static double sss_atlas__needed_share(sss_atlas__packer *p)
{
    const double side = p->size - 2 * p->margin + p->gap, gap = p->gap;
    size_t chart;
    int k;
    memset(p->need, 0, sizeof p->need);
    for (chart = 0; chart < p->count; chart++)
    {
        const sss_atlas__mask *best = NULL;
        double least = 1e300;
        int32_t turn;
        for (turn = 0; turn < p->turns; turn++)
        {
            const sss_atlas__mask *m = sss_atlas__mask_of(p, chart, turn);
            const double cells = m->cells + gap * (m->size[0] + m->size[1] + gap);
            if (m->count > 0 && cells < least)
            {
                least = cells;
                best = m;
            }
        }
        if (best == NULL || side <= 0.0)
        {
            return 1e300; // too large in every rotation
        }
        p->needed[chart] = least / (side * side);
        p->need[2] += best->cells / (side * side); // grows with the scale's square
        p->need[1] += gap * (best->size[0] + best->size[1]) / (side * side);
        p->need[0] += gap * gap / (side * side);
    }
    for (k = 1; k < 3; k++)
    {
        p->need[k] = sss_atlas__max(p->need[k], 1e-30);
    }
    return p->need[0] + p->need[1] + p->need[2];
}

// By which factor to scale so that about a share is needed.
static double sss_atlas__factor_for(const sss_atlas__packer *p, double share)
{
    const double *n = p->need;
    const double root = n[1] * n[1] + 4.0 * n[2] * (share - n[0]);
    return root > 0.0 ? (sqrt(root) - n[1]) / (2.0 * n[2]) : 0.0;
}

// Tries the places of row y where a mask fits that touch something at the side and below or above: elsewhere moving on
// only brings more contact.   below, at, above  what find_in_row gave for the rows
static int sss_atlas__try_row(sss_atlas__packer *p, const sss_atlas__mask *m, size_t words, int32_t y,
                              const uint64_t *const rows[3], double *best, int32_t *best_x)
{
    const uint64_t *at = rows[1];
    const double pull = y + p->lean * m->size[1], per_sample = (double)p->size / (double)m->sample_count;
    size_t i;
    int found = 0;
    for (i = 0; i < words; i++)
    {
        const uint64_t left = (at[i] << 1) | (i > 0 ? at[i - 1] >> 63 : 1);
        const uint64_t right = (at[i] >> 1) | (i + 1 < words ? at[i + 1] << 63 : UINT64_C(1) << 63);
        uint64_t places = ~at[i] & (left | right) & (rows[0][i] | rows[2][i]);
        for (; places != 0; places &= places - 1)
        {
            const int32_t x = p->margin + (int32_t)(i * 64) + sss_atlas__lowest_bit(places);
            const double score = per_sample * sss_atlas__contact(p, m, x, y) - pull;
            p->work += 0.5 * m->sample_count;
            if (score > *best)
            {
                *best = score;
                *best_x = x;
                found = 1;
            }
        }
    }
    return found;
}

// The best place for a mask: most contact with what is there, of the places in the window above the lowest.
static int sss_atlas__place_mask(sss_atlas__packer *p, const sss_atlas__mask *m, double *best, int32_t out[2])
{
    const int32_t x0 = p->margin, x1 = p->size - p->margin - m->size[0], last = p->size - p->margin - m->size[1];
    const int32_t skip = m->size[1] > SSS_ATLAS__HIGH ? 2 : 1; // high charts settle later
    const size_t words = x1 >= x0 ? (size_t)(x1 - x0) / 64 + 1 : 0;
    uint64_t *rows[3];
    int32_t y, first = -1;
    int found = 0, k;
    if (m->count == 0 || words == 0 || last < p->margin)
    {
        return 0;
    }
    sss_atlas__find_tops(p, m, x0, words);
    for (k = 0; k < 3; k++)
    {
        rows[k] = p->blocked + (size_t)k * (p->row_room / 64 + 2);
        memset(rows[k], 0xff, words * sizeof *rows[k]);
    }
    for (y = p->floor; y <= last + skip && (first < 0 || y <= first + p->window + skip); y += first < 0 ? 1 : skip)
    {
        uint64_t *oldest = rows[0];
        const uint64_t *three[3];
        rows[0] = rows[1];
        rows[1] = rows[2];
        rows[2] = oldest;
        p->work += 1.0;
        if (y > last || !sss_atlas__is_roomy(p, m, y))
        {
            memset(oldest, 0xff, words * sizeof *oldest);
        }
        else if (sss_atlas__find_in_row(p, m, x0, x1, y, oldest) && first < 0)
        {
            first = y;
            p->lowest = y < p->lowest ? y : p->lowest;
        }
        three[0] = rows[0];
        three[1] = rows[1];
        three[2] = rows[2];
        if (first >= 0 && y > first && sss_atlas__try_row(p, m, words, y - skip, three, best, &out[0]))
        {
            out[1] = y - skip;
            found = 1;
        }
    }
    return found;
}

// Moves a mask to neighbouring places as long as contact grows.
static void sss_atlas__settle(sss_atlas__packer *p, const sss_atlas__mask *m, sss_atlas__placement *place)
{
    const double per_sample = (double)p->size / (double)m->sample_count;
    double best = per_sample * sss_atlas__contact(p, m, place->x, place->y) - place->y;
    int move, side, moved = 1;
    p->tops[0] = p->occupancy.size;
    for (move = 0; move < SSS_ATLAS__SETTLES && moved; move++)
    {
        moved = 0;
        for (side = 0; side < 4 && !moved; side++)
        {
            const int32_t x = place->x + (side == 1 ? -1 : side == 2), y = place->y + (side == 0 ? -1 : side == 3);
            if (x >= p->margin && y >= p->margin && x <= p->size - p->margin - m->size[0] &&
                y <= p->size - p->margin - m->size[1] && sss_atlas__find_in_row(p, m, x, x, y, p->blocked))
            {
                const double score = per_sample * sss_atlas__contact(p, m, x, y) - y;
                if (score > best)
                {
                    best = score;
                    place->x = x;
                    place->y = y;
                    moved = 1;
                }
            }
        }
    }
}

// Finds the best place for a chart in any rotation and takes it. turn is -1 where there is none. Of many charts only
// one in SEARCHES looks from the very bottom, and tells the following ones where to begin.
static int sss_atlas__place_chart(sss_atlas__packer *p, size_t chart, sss_atlas__placement *place)
{
    int bottom = p->count <= SSS_ATLAS__MANY || p->searches++ % SSS_ATLAS__SEARCHES == 0;
    double best = -1e300;
    int32_t turn, at[2];
    place->turn = -1;
    for (;;)
    {
        p->floor = bottom ? p->margin : p->floor;
        p->lowest = p->size;
        for (turn = 0; turn < p->turns; turn++)
        {
            if (sss_atlas__place_mask(p, sss_atlas__mask_of(p, chart, turn), &best, at))
            {
                place->x = at[0];
                place->y = at[1];
                place->turn = turn;
            }
        }
        if (place->turn >= 0 || bottom)
        {
            break;
        }
        bottom = 1;
    }
    if (bottom && place->turn >= 0)
    {
        p->floor = p->lowest;
    }
    if (place->turn >= 0)
    {
        sss_atlas__settle(p, sss_atlas__mask_of(p, chart, place->turn), place);
        sss_atlas__stamp(p, sss_atlas__mask_of(p, chart, place->turn), place->x, place->y, 1);
    }
    return place->turn >= 0;
}

// Places charts in order.   all  goes on after the first that does not fit
// p->placed is the share before it. 1: all are placed, 0: no, -1: no memory.
static int sss_atlas__pack_in_order(sss_atlas__packer *p, const uint32_t *order, int all, sss_atlas__placement *places)
{
    size_t i;
    int fits = 1;
    if (!sss_atlas__clear_occupancy(p))
    {
        return -1;
    }
    sss_atlas__update_all(p);
    p->placed = p->missing = 0.0;
    p->searches = 0;
    for (i = 0; i < p->count && (fits || all); i++)
    {
        fits = sss_atlas__place_chart(p, order[i], &places[order[i]]) && fits;
        p->placed += fits ? p->needed[order[i]] : 0.0;
        p->missing += places[order[i]].turn < 0 ? p->needed[order[i]] : 0.0;
    }
    return fits;
}

// Uniform in [0, 1): always the same sequence.
static double sss_atlas__random(sss_atlas__packer *p)
{
    p->seed = p->seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(p->seed >> 11) / 9007199254740992.0;
}

// Clears a part of the texture, and places what was there anew together with what is missing, the largest first more
// or less. Returns whether less is missing afterwards, or no more.   places  changed in any case
static int sss_atlas__shake(sss_atlas__packer *p, sss_atlas__placement *places)
{
    const double before = p->missing;
    double largest = 0.0, middle[2], reach;
    size_t i, n = 0;
    for (i = 0; i < p->count; i++)
    {
        if (places[i].turn < 0)
        {
            const sss_atlas__mask *m = sss_atlas__mask_of(p, i, 0);
            largest = sss_atlas__max(largest, m->size[0] > m->size[1] ? m->size[0] : m->size[1]);
        }
    }
    reach = largest * (0.3 + 0.5 * sss_atlas__random(p));
    middle[0] = p->size * sss_atlas__random(p);
    middle[1] = p->size * sss_atlas__random(p);
    sss_atlas__clear_occupancy(p); // there is room: it was cleared before
    for (i = 0; i < p->count; i++)
    {
        const sss_atlas__mask *m = sss_atlas__mask_of(p, i, places[i].turn < 0 ? 0 : places[i].turn);
        const int near = places[i].x < middle[0] + reach && places[i].x + m->size[0] > middle[0] - reach &&
                         places[i].y < middle[1] + reach && places[i].y + m->size[1] > middle[1] - reach;
        if (near || places[i].turn < 0)
        {
            p->items[n].key = -p->needed[i] * (0.5 + sss_atlas__random(p));
            p->items[n].second = 0.0;
            p->items[n++].id = (uint32_t)i;
        }
        else
        {
            sss_atlas__stamp(p, m, places[i].x, places[i].y, 0);
        }
    }
    sss_atlas__update_all(p);
    sss_atlas__sort_items(p->items, n, p->items_scratch);
    p->missing = 0.0;
    for (i = 0; i < n && p->missing <= before; i++)
    {
        const uint32_t chart = p->items[i].id;
        p->missing += sss_atlas__place_chart(p, chart, &places[chart]) ? 0.0 : p->needed[chart];
    }
    return p->missing <= before;
}

static int sss_atlas__is_boundary(const sss_atlas__build *b, size_t edge)
{
    const uint32_t twin = b->twin[edge], chart = b->chart_of[edge / 3];
    const size_t next = edge - edge % 3 + (edge + 1) % 3;
    if (twin == SSS_ATLAS__NONE || b->chart_of[twin / 3] != chart)
    {
        return 1;
    }
    return b->corner[edge] != b->corner[twin - twin % 3 + (twin + 1) % 3] || b->corner[next] != b->corner[twin];
}

// Edges, box and area of a chart; edges go behind those there are.
static void sss_atlas__outline_chart(sss_atlas__packer *p, size_t chart, size_t *edge_count, double (*points)[2],
                                     double (*hull)[2])
{
    const sss_atlas__build *b = p->b;
    const sss_atlas__chart *c = &b->charts[chart];
    sss_atlas__outline *o = &p->outlines[chart];
    double low[2] = {0, 0}, high[2] = {0, 0};
    size_t n = 0, i;
    int all, k;
    for (i = 0; i < c->vertex_count; i++)
    {
        for (k = 0; k < 2; k++)
        {
            const double at = b->uv[c->first_vertex + i][k];
            low[k] = i == 0 || at < low[k] ? at : low[k];
            high[k] = i == 0 || at > high[k] ? at : high[k];
        }
    }
    o->first = *edge_count;
    for (k = 0; k < 2; k++)
    {
        o->center[k] = 0.5 * low[k] + 0.5 * high[k];
    }
    for (all = 0; all < 2 && n == 0; all++) // a closed chart can only be flat when it has no inside: all of its edges
    {
        for (i = 0; i < 3 * (size_t)c->triangle_count; i++)
        {
            const size_t t = b->chart_triangles[c->first_triangle + i / 3], edge = 3 * t + i % 3;
            const double *from = b->uv[b->corner[edge]], *to = b->uv[b->corner[3 * t + (i + 1) % 3]];
            if (all || sss_atlas__is_boundary(b, edge))
            {
                double *q = p->edges[o->first + n];
                q[0] = points[2 * n][0] = from[0] - o->center[0];
                q[1] = points[2 * n][1] = from[1] - o->center[1];
                q[2] = points[2 * n + 1][0] = to[0] - o->center[0];
                q[3] = points[2 * n + 1][1] = to[1] - o->center[1];
                o->area += 0.5 * (q[0] * q[3] - q[1] * q[2]);
                n++;
            }
        }
    }
    o->count = n;
    *edge_count += n;
    sss_atlas__minimal_box((const double (*)[2])points, 2 * n, p->items, p->items_scratch, hull, o->axis, o->sides);
}

// Outlines of all charts and room for their masks.
static sss_result sss_atlas__begin_packing(sss_atlas__packer *p, sss_atlas__build *b)
{
    sss_atlas__memory *m = &b->memory;
    size_t chart, edges = 0, most = 0, sum = 0;
    double (*points)[2], (*hull)[2];
    int32_t i;
    memset(p, 0, sizeof *p);
    p->b = b;
    p->count = b->chart_count;
    p->turns = p->count <= SSS_ATLAS__MASSES ? b->options.rotations : 1;
    p->square_levels = p->count <= SSS_ATLAS__MANY ? SSS_ATLAS__SQUARE_LEVELS : 4;
    p->most_samples = p->count <= SSS_ATLAS__MANY ? SSS_ATLAS__SAMPLES : SSS_ATLAS__SAMPLES / 4;
    for (chart = 0; chart < p->count; chart++)
    {
        const size_t corners = 3 * (size_t)b->charts[chart].triangle_count;
        most = corners > most ? corners : most;
        sum += corners;
    }
    most = 2 * most > p->count ? 2 * most : p->count;
    p->outlines = (sss_atlas__outline *)sss_atlas__take(m, p->count, sizeof *p->outlines);
    p->edges = (double (*)[4])sss_atlas__take(m, sum, sizeof *p->edges);
    p->turn_axis = (double (*)[2])sss_atlas__take(m, (size_t)p->turns, sizeof *p->turn_axis);
    p->masks = (sss_atlas__mask *)sss_atlas__take(m, p->count * (size_t)p->turns, sizeof *p->masks);
    p->needed = (double *)sss_atlas__take(m, p->count, sizeof *p->needed);
    p->items = (sss_atlas__item *)sss_atlas__take(m, most, sizeof *p->items);
    p->items_scratch = (sss_atlas__item *)sss_atlas__take(m, most, sizeof *p->items_scratch);
    points = (double (*)[2])sss_atlas__take(m, most, sizeof *points);
    hull = (double (*)[2])sss_atlas__take(m, 2 * most + 2, sizeof *hull);
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < p->turns; i++) // quarter turns, then those from angles in between
    {
        const double groups = (p->turns + 3) / 4, angle = 0.5 * SSS_ATLAS__PI * (i % 4 + (i / 4) / groups);
        p->turn_axis[i][0] = i < 4 ? (i % 2 == 0 ? 1 - i : 0) : cos(angle);
        p->turn_axis[i][1] = i < 4 ? (i % 2 == 1 ? 2 - i : 0) : sin(angle);
    }
    for (chart = 0; chart < p->count; chart++)
    {
        sss_atlas__outline_chart(p, chart, &edges, points, hull);
    }
    sss_atlas__drop(m, points);
    sss_atlas__drop(m, hull);
    return SSS_OK;
}

// ---- packing: one scale for all ----

// Orders in which charts are placed: by area, by longer side, by box, by both sides; largest first.
static void sss_atlas__order_charts(sss_atlas__packer *p, int kind, uint32_t *order)
{
    size_t i;
    for (i = 0; i < p->count; i++)
    {
        const sss_atlas__outline *o = &p->outlines[i];
        const double sum = o->sides[0] + o->sides[1], box = o->sides[0] * o->sides[1];
        p->items[i].key = -(kind == 0 ? o->area : kind == 1 ? o->sides[0] : kind == 2 ? box : sum);
        p->items[i].second = -sum;
        p->items[i].id = (uint32_t)i;
    }
    sss_atlas__sort_items(p->items, p->count, p->items_scratch);
    for (i = 0; i < p->count; i++)
    {
        order[i] = p->items[i].id;
    }
}

static int sss_atlas__all_tiny(const sss_atlas__packer *p)
{
    size_t i;
    for (i = 0; i < p->count * (size_t)p->turns; i++)
    {
        if (p->masks[i].size[0] > 1 || p->masks[i].size[1] > 1)
        {
            return 0;
        }
    }
    return 1;
}

// Texels in a cell: charts are placed on a grid of about 1,024 cells on a side, finer where there are many, at least
// as many as their number needs, but no finer than texels.
static int32_t sss_atlas__choose_step(const sss_atlas__packer *p, size_t size)
{
    const size_t cells = p->count <= 1000 ? 1024 : p->count <= 30000 ? 2048 : SSS_ATLAS__MOST_CELLS;
    return (int32_t)((size + cells - 1) / cells);
}

// A scale at which the charts may well fit.
static double sss_atlas__guess_scale(const sss_atlas__packer *p, size_t size, double wanted)
{
    double area = 0.0, longest = 0.0, scale;
    size_t i;
    for (i = 0; i < p->count; i++)
    {
        area += p->outlines[i].area;
        longest = sss_atlas__max(longest, p->outlines[i].sides[0]);
    }
    scale = area > 0.0 ? sqrt(wanted * (double)size * (double)size / area) : 1e300;
    if (longest * scale > 1.4 * (double)size) // on a diagonal it may just fit
    {
        scale = 1.4 * (double)size / longest;
    }
    return scale < 1e290 ? scale : 1.0;
}

#define SSS_ATLAS__MOST_TEXELS 16384 // on a side
#define SSS_ATLAS__FULL 0.77         // needed share at which charts should fit easily
#define SSS_ATLAS__SCALE_TRIES 300   // each at least 1 % smaller, mostly much more: from any start to points
#define SSS_ATLAS__MORE_TRIES 30     // after the first success
#define SSS_ATLAS__FINEST 1.0015     // ratio of scales: no finer
#define SSS_ATLAS__SMALL_GROWTH 0.002
#define SSS_ATLAS__PACK_WORK 2e8     // words; about 0.7 s. The first success is waited for however long it takes
#define SSS_ATLAS__CELL_WORK 400.0  // words for each cell: small textures are not worth as much
#define SSS_ATLAS__SHAKES 25         // at one scale
#define SSS_ATLAS__LITTLE 0.02       // share of the texture that may be missing before it is worth shaking

typedef struct sss_atlas__search
{
    uint32_t *orders[4];       // [count] each
    sss_atlas__placement *places;  // [count] of the try under way
    sss_atlas__placement *trial;   // [count] scratch
    sss_atlas__placement *best;    // [count] of the last that succeeded
    int variant;               // the order tried first
} sss_atlas__search;

// Shakes a packing until nothing is missing. 1: it is so, 0: not before the work is done.
static int sss_atlas__shake_down(sss_atlas__packer *p, sss_atlas__search *s)
{
    double missing = p->missing;
    int turn;
    for (turn = 0; turn < SSS_ATLAS__SHAKES && missing > 0.0 && p->work < p->most_work; turn++)
    {
        memcpy(s->trial, s->places, p->count * sizeof *s->trial);
        p->missing = missing;
        if (sss_atlas__shake(p, s->trial))
        {
            sss_atlas__placement *swap = s->places;
            s->places = s->trial;
            s->trial = swap;
            missing = p->missing;
        }
    }
    p->missing = missing;
    return !(missing > 0.0);
}

// Whether the charts fit as masks and grid are, in the order whose turn it is, or when what little is missing has been
// shaken in. p->missing is then 0. 1: they do, 0: no, -1: no memory.
static int sss_atlas__try_grid(sss_atlas__packer *p, sss_atlas__search *s)
{
    int fits;
    p->lean = s->variant % 2 == 0 ? 0.5 : 0.0; // the more variants differ the better
    fits = sss_atlas__pack_in_order(p, s->orders[s->variant], 1, s->places);
    if (fits == 0 && p->missing < SSS_ATLAS__LITTLE && p->count <= SSS_ATLAS__MANY)
    {
        fits = sss_atlas__shake_down(p, s);
    }
    if (fits > 0)
    {
        sss_atlas__placement *swap = s->best;
        s->best = s->places;
        s->places = swap;
    }
    else
    {
        s->variant = (s->variant + 1) % 4;
    }
    return fits;
}

// A scale at which the masks need the share at which they should fit. 0: no memory.
static double sss_atlas__first_scale(sss_atlas__packer *p, size_t size, int32_t step)
{
    double scale = sss_atlas__guess_scale(p, size, 0.7);
    int i;
    for (i = 0; i < 20; i++)
    {
        double factor, share;
        sss_atlas__set_grid(p, size, step, scale);
        if (!sss_atlas__draw_all(p))
        {
            return 0.0;
        }
        share = sss_atlas__needed_share(p);
        factor = share > 1e200 ? 0.9 : sss_atlas__factor_for(p, SSS_ATLAS__FULL);
        if ((factor > 0.97 && factor < 1.03) || (i > 2 && factor > 1.0) || sss_atlas__all_tiny(p))
        {
            break;
        }
        scale *= sss_atlas__max(0.5, sss_atlas__min(factor, 1.5));
    }
    return scale;
}

// Whether no chart has any extent: they fit at any scale or at none.
static int sss_atlas__are_points(const sss_atlas__packer *p)
{
    size_t i;
    for (i = 0; i < p->count; i++)
    {
        if (p->outlines[i].sides[0] > 0.0)
        {
            return 0;
        }
    }
    return 1;
}

// The scale to try after one that fitted, or did not.
static void sss_atlas__next_scale(sss_atlas__packer *p, double share, int fits, double range[2], double *scale,
                                  double *growth)
{
    range[fits ? 0 : 1] = *scale;
    if (range[0] <= 0.0) // nothing has fitted yet: without what is missing it would
    {
        const double factor = share > 1.0 ? sss_atlas__factor_for(p, 0.95)
                                          : sss_atlas__factor_for(p, 0.985 * (share - p->missing));
        *scale *= sss_atlas__max(0.5, sss_atlas__min(share > 1e200 ? 0.9 : factor, 0.99));
        range[1] = 0.0;
        return;
    }
    if (range[1] > 0.0 && range[1] < SSS_ATLAS__FINEST * range[0]) // luck may differ: the other orders a little above
    {
        range[1] = 0.0;
        *growth = SSS_ATLAS__SMALL_GROWTH;
    }
    *scale = range[1] > 0.0 ? sqrt(range[0] * range[1]) : range[0] * (1.0 + *growth);
    *growth = range[1] > 0.0 ? *growth : sss_atlas__min(1.6 * *growth, 0.25);
}

// The largest scale at which charts fit. SSS_ERROR_INVALID_ARGUMENT: not even points.
static sss_result sss_atlas__search_scale(sss_atlas__packer *p, size_t size, sss_atlas__search *s, double *best_scale)
{
    const int points = sss_atlas__are_points(p);
    const int32_t step = sss_atlas__choose_step(p, size);
    double scale = 0.0, range[2] = {0.0, 0.0}, growth = 0.008;
    double room;
    int tries, fits, more = SSS_ATLAS__MORE_TRIES;
    sss_atlas__set_grid(p, size, step, 1.0);
    p->most_work = sss_atlas__min(SSS_ATLAS__PACK_WORK, SSS_ATLAS__CELL_WORK * p->size * p->size);
    room = (double)(p->size - 2 * p->margin + p->gap) / (1 + p->gap);
    if (p->size <= 2 * p->margin || room * room < (double)p->count)
    {
        return SSS_ERROR_INVALID_ARGUMENT; // a cell for each and its gap are more than there is
    }
    scale = sss_atlas__first_scale(p, size, step);
    for (tries = 0; tries < SSS_ATLAS__SCALE_TRIES && more > 0; tries++)
    {
        double share;
        sss_atlas__set_grid(p, size, step, scale);
        if (p->b->memory.failed || !sss_atlas__draw_all(p))
        {
            return SSS_ERROR_OUT_OF_MEMORY;
        }
        share = sss_atlas__needed_share(p);
        p->missing = 0.0;
        fits = share > 1.0 ? 0 : sss_atlas__try_grid(p, s);
        if (fits < 0)
        {
            return SSS_ERROR_OUT_OF_MEMORY;
        }
        if (fits == 0 && range[0] <= 0.0 && sss_atlas__all_tiny(p))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
        if (fits && points)
        {
            range[0] = scale;
            break;
        }
        sss_atlas__next_scale(p, share, fits, range, &scale, &growth);
        more = range[0] <= 0.0 ? more : p->work > p->most_work ? 0 : more - 1;
    }
    *best_scale = range[0];
    return range[0] > 0.0 ? SSS_OK : SSS_ERROR_INVALID_ARGUMENT;
}

// The smallest texture, a multiple of 4 texels, in which charts fit at the scale that is asked for.
static sss_result sss_atlas__search_size(sss_atlas__packer *p, double scale, sss_atlas__search *s, size_t *best_size)
{
    size_t size = 4, low = 0, high = 0; // low: too small; high: fits
    int fits;
    p->most_work = SSS_ATLAS__PACK_WORK;
    while (size < SSS_ATLAS__MOST_TEXELS && sss_atlas__guess_scale(p, size, 0.7) < scale)
    {
        size += 4;
    }
    while (low < SSS_ATLAS__MOST_TEXELS && (high == 0 || high - low > 4))
    {
        sss_atlas__set_grid(p, size, sss_atlas__choose_step(p, size), scale);
        if (!sss_atlas__draw_all(p))
        {
            return SSS_ERROR_OUT_OF_MEMORY;
        }
        fits = sss_atlas__needed_share(p) > 1.0 ? 0 : sss_atlas__try_grid(p, s);
        if (fits < 0)
        {
            return SSS_ERROR_OUT_OF_MEMORY;
        }
        low = fits ? low : size;
        high = fits ? size : high;
        if (high > 0 && p->work > p->most_work)
        {
            break;
        }
        if (high == 0)
        {
            size = (size + size / 32 + 7) / 4 * 4;
            size = size < SSS_ATLAS__MOST_TEXELS ? size : SSS_ATLAS__MOST_TEXELS;
        }
        else
        {
            const size_t middle = (low + high) / 8 * 4, near = (high - high / 32) / 4 * 4;
            size = low > 0 ? middle : near < high && near > 0 ? near : high - 4;
        }
    }
    *best_size = high;
    return high > 0 ? SSS_OK : SSS_ERROR_INVALID_ARGUMENT;
}

// Texture coordinates of all charts at their places.
static sss_result sss_atlas__write_grid(sss_atlas__packer *p, size_t size, const sss_atlas__placement *places)
{
    sss_atlas__build *b = p->b;
    size_t chart, i;
    int k;
    sss_atlas__drop(&b->memory, b->grid);
    b->grid = (int32_t (*)[2])sss_atlas__take(&b->memory, b->atlas_vertex_count, sizeof *b->grid);
    if (b->grid == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (chart = 0; chart < p->count; chart++)
    {
        const sss_atlas__chart *c = &b->charts[chart];
        const sss_atlas__outline *o = &p->outlines[chart];
        const sss_atlas__mask *m = sss_atlas__mask_of(p, chart, places[chart].turn);
        double r[2];
        sss_atlas__turn(p, chart, places[chart].turn, r);
        for (i = c->first_vertex; i < (size_t)c->first_vertex + c->vertex_count; i++)
        {
            const double u = b->uv[i][0] - o->center[0], v = b->uv[i][1] - o->center[1];
            const double at[2] = {r[0] * u - r[1] * v - m->origin[0] + places[chart].x,
                                  r[1] * u + r[0] * v - m->origin[1] + places[chart].y};
            for (k = 0; k < 2; k++)
            {
                const double units = floor(at[k] * p->step * (SSS_ATLAS__UNITS / (double)size) + 0.5);
                b->grid[i][k] = (int32_t)sss_atlas__max(0.0, sss_atlas__min(units, SSS_ATLAS__UNITS));
            }
        }
    }
    return SSS_OK;
}

static void sss_atlas__end_packing(sss_atlas__packer *p, sss_atlas__search *s)
{
    sss_atlas__memory *m = &p->b->memory;
    int i;
    for (i = 0; i < 4; i++)
    {
        sss_atlas__drop(m, s->orders[i]);
    }
    sss_atlas__drop(m, s->places);
    sss_atlas__drop(m, s->trial);
    sss_atlas__drop(m, s->best);
    sss_atlas__drop(m, p->outlines);
    sss_atlas__drop(m, p->edges);
    sss_atlas__drop(m, p->turn_axis);
    sss_atlas__drop(m, p->masks);
    sss_atlas__drop(m, p->runs);
    sss_atlas__drop(m, p->samples);
    sss_atlas__drop(m, p->canvas);
    sss_atlas__drop(m, p->toggle);
    sss_atlas__drop(m, p->occupancy.bits);
    sss_atlas__drop(m, p->occupancy.roomy);
    sss_atlas__drop(m, p->occupancy.squares);
    sss_atlas__drop(m, p->occupancy.spacious);
    sss_atlas__drop(m, p->occupancy.skyline);
    sss_atlas__drop(m, p->blocked);
    sss_atlas__drop(m, p->tops);
    sss_atlas__drop(m, p->needed);
    sss_atlas__drop(m, p->items);
    sss_atlas__drop(m, p->items_scratch);
}

// Places charts (in b->uv) in one square texture: sets texels_per_mm, grid and options.size.
// SSS_ERROR_INVALID_ARGUMENT: they do not fit.
static sss_result sss_atlas__pack(sss_atlas__build *b)
{
    sss_atlas__packer packer, *p = &packer;
    sss_atlas__search search;
    double scale = b->options.texels_per_mm;
    size_t size = b->options.size, i;
    int kind;
    sss_result result = sss_atlas__begin_packing(p, b);
    memset(&search, 0, sizeof search);
    search.places = (sss_atlas__placement *)sss_atlas__take(&b->memory, p->count, sizeof *search.places);
    search.trial = (sss_atlas__placement *)sss_atlas__take(&b->memory, p->count, sizeof *search.trial);
    search.best = (sss_atlas__placement *)sss_atlas__take(&b->memory, p->count, sizeof *search.best);
    for (kind = 0; kind < 4 && result == SSS_OK; kind++)
    {
        search.orders[kind] = (uint32_t *)sss_atlas__take(&b->memory, p->count, sizeof(uint32_t));
        if (search.orders[kind] != NULL)
        {
            sss_atlas__order_charts(p, kind, search.orders[kind]);
        }
    }
    for (i = 0; i < p->count && !b->memory.failed; i++) // the smaller ones of many: quarter turns
    {
        sss_atlas__outline *o = &p->outlines[search.orders[0][i]];
        o->turns = i < SSS_ATLAS__MANY || p->turns < 4 ? p->turns : 4;
    }
    result = result == SSS_OK && b->memory.failed ? SSS_ERROR_OUT_OF_MEMORY : result;
    if (result == SSS_OK)
    {
        result = scale > 0.0 ? sss_atlas__search_size(p, scale, &search, &size)
                             : sss_atlas__search_scale(p, size, &search, &scale);
    }
    if (result == SSS_OK)
    {
        sss_atlas__set_grid(p, size, sss_atlas__choose_step(p, size), scale);
        result = sss_atlas__draw_all(p) ? sss_atlas__write_grid(p, size, search.best) : SSS_ERROR_OUT_OF_MEMORY;
        b->texels_per_mm = scale;
        b->options.size = size;
    }
    sss_atlas__end_packing(p, &search);
    return result;
}

// ---- exact coordinates: triangles turned over ----

#define SSS_ATLAS__REPAIR_PASSES 6
#define SSS_ATLAS__REPAIR_REACH 4  // grid units a vertex moves at most in a pass
#define SSS_ATLAS__REPAIR_STAR 48  // vertices of more triangles stay: each has two others

// Twice the area of a triangle of the mesh in grid units.
static int64_t sss_atlas__grid_area(const sss_atlas__build *b, size_t t)
{
    return sss_atlas__orient_grid((const int32_t *)b->grid[b->corner[3 * t]],
                                  (const int32_t *)b->grid[b->corner[3 * t + 1]],
                                  (const int32_t *)b->grid[b->corner[3 * t + 2]]);
}

// Whether a triangle should be mended: 2 if it is turned over, 1 without area though it had some before rounding.
static int sss_atlas__is_turned(const sss_atlas__build *b, size_t t)
{
    const int64_t area = sss_atlas__grid_area(b, t);
    if (area != 0)
    {
        return area < 0 ? 2 : 0;
    }
    return b->area[t] > 0.0 && sss_atlas__orient(b->uv[b->corner[3 * t]], b->uv[b->corner[3 * t + 1]],
                                                 b->uv[b->corner[3 * t + 2]]) > 0.0;
}

// How bad the triangles around a vertex are: none of them counts less when it is turned than many without area.
static size_t sss_atlas__star_fault(const sss_atlas__build *b, const uint32_t *star, size_t count)
{
    size_t i, fault = 0;
    for (i = 0; i < count; i++)
    {
        const int turned = sss_atlas__is_turned(b, star[i]);
        fault += turned == 2 ? SSS_ATLAS__REPAIR_STAR + 1 : (size_t)turned;
    }
    return fault;
}

// Moves a vertex to the nearest grid point where the triangles around are better, none of them turned over anew.
//   home  where rounding put it: it stays within the slack that packing leaves
static int sss_atlas__move_vertex(sss_atlas__build *b, uint32_t vertex, const int32_t home[2], const uint32_t *star,
                                  size_t count)
{
    const int32_t was[2] = {b->grid[vertex][0], b->grid[vertex][1]};
    const int32_t most = SSS_ATLAS__SLACK - 4;
    const size_t before = sss_atlas__star_fault(b, star, count);
    int32_t reach, dx, dy;
    if (before == 0)
    {
        return 0;
    }
    for (reach = 1; reach <= SSS_ATLAS__REPAIR_REACH; reach++)
    {
        for (dy = -reach; dy <= reach; dy++)
        {
            for (dx = -reach; dx <= reach; dx += dy == -reach || dy == reach ? 1 : 2 * reach)
            {
                const int32_t x = was[0] + dx, y = was[1] + dy;
                if (x < 0 || y < 0 || x > SSS_ATLAS__UNITS || y > SSS_ATLAS__UNITS || x - home[0] > most ||
                    home[0] - x > most || y - home[1] > most || home[1] - y > most)
                {
                    continue;
                }
                b->grid[vertex][0] = x;
                b->grid[vertex][1] = y;
                if (sss_atlas__star_fault(b, star, count) < before)
                {
                    return 1;
                }
            }
        }
    }
    b->grid[vertex][0] = was[0];
    b->grid[vertex][1] = was[1];
    return 0;
}

// Triangles around each atlas vertex: those of v are around[first[v]] .. around[first[v + 1] - 1].
static void sss_atlas__gather_stars(const sss_atlas__build *b, uint32_t *first, uint32_t *around)
{
    size_t i;
    for (i = 0; i < 3 * b->triangle_count; i++)
    {
        first[b->corner[i] + 1]++;
    }
    for (i = 0; i < b->atlas_vertex_count; i++)
    {
        first[i + 1] += first[i];
    }
    for (i = 3 * b->triangle_count; i-- > 0;) // backwards: first ends up one further, at the end of the one before
    {
        around[--first[b->corner[i] + 1]] = (uint32_t)(i / 3);
    }
    for (i = 0; i < b->atlas_vertex_count; i++)
    {
        first[i] = first[i + 1];
    }
    first[b->atlas_vertex_count] = (uint32_t)(3 * b->triangle_count);
}

// Triangles that rounding turned over, or left without area, are mended by moving vertices a few grid units.
//   left  triangles that are still turned over
static sss_result sss_atlas__repair(sss_atlas__build *b, size_t *left)
{
    sss_atlas__memory *m = &b->memory;
    uint32_t *first, *around;
    int32_t (*home)[2];
    size_t t, bad = 0, moved = 1;
    int pass, k;
    *left = 0;
    for (t = 0; t < b->triangle_count; t++)
    {
        bad += sss_atlas__is_turned(b, t) != 0;
    }
    if (bad == 0)
    {
        return SSS_OK;
    }
    first = (uint32_t *)sss_atlas__take(m, b->atlas_vertex_count + 1, sizeof *first);
    around = (uint32_t *)sss_atlas__take(m, 3 * b->triangle_count, sizeof *around);
    home = (int32_t (*)[2])sss_atlas__take(m, b->atlas_vertex_count, sizeof *home);
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    memcpy(home, b->grid, b->atlas_vertex_count * sizeof *home);
    sss_atlas__gather_stars(b, first, around);
    for (pass = 0; pass < SSS_ATLAS__REPAIR_PASSES && moved > 0; pass++)
    {
        moved = 0;
        for (t = 0; t < b->triangle_count; t++)
        {
            for (k = 0; k < 3 && sss_atlas__is_turned(b, t) != 0; k++)
            {
                const uint32_t v = b->corner[3 * t + (size_t)k];
                const size_t count = first[v + 1] - first[v];
                if (count <= SSS_ATLAS__REPAIR_STAR)
                {
                    moved += (size_t)sss_atlas__move_vertex(b, v, home[v], around + first[v], count);
                }
            }
        }
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        *left += sss_atlas__grid_area(b, t) < 0;
    }
    sss_atlas__drop(m, home);
    sss_atlas__drop(m, around);
    sss_atlas__drop(m, first);
    return SSS_OK;
}

// ---- exact coordinates: overlaps ----

// Whether the interiors of two counter-clockwise triangles with area meet: two convex polygons are apart if and only
// if a line along an edge of one of them separates them (closed half-planes: they may touch).
static int sss_atlas__interiors_meet(const int32_t a[3][2], const int32_t b[3][2])
{
    int k;
    for (k = 0; k < 3; k++)
    {
        const int next = k < 2 ? k + 1 : 0;
        if ((sss_atlas__orient_grid(a[k], a[next], b[0]) <= 0 && sss_atlas__orient_grid(a[k], a[next], b[1]) <= 0 &&
             sss_atlas__orient_grid(a[k], a[next], b[2]) <= 0) ||
            (sss_atlas__orient_grid(b[k], b[next], a[0]) <= 0 && sss_atlas__orient_grid(b[k], b[next], a[1]) <= 0 &&
             sss_atlas__orient_grid(b[k], b[next], a[2]) <= 0))
        {
            return 0;
        }
    }
    return 1;
}

// Corners counter-clockwise; 0: no area, no interior.
static int sss_atlas__grid_corners(const sss_atlas__build *b, size_t t, int32_t out[3][2])
{
    const int64_t area = sss_atlas__grid_area(b, t);
    int k;
    for (k = 0; k < 3; k++)
    {
        const int from = area < 0 && k > 0 ? 3 - k : k;
        out[k][0] = b->grid[b->corner[3 * t + (size_t)from]][0];
        out[k][1] = b->grid[b->corner[3 * t + (size_t)from]][1];
    }
    return area != 0;
}

// A uniform grid of cells over the texture, each with the triangles that come near it.
typedef struct sss_atlas__cells
{
    int32_t side;      // cells
    double per_unit;   // cells per grid unit
    uint32_t *first;   // [side^2 + 1]
    uint32_t *entries; // triangles
} sss_atlas__cells;

static int32_t sss_atlas__cell_at(const sss_atlas__cells *cells, double x)
{
    const int32_t cell = (int32_t)floor(x * cells->per_unit);
    return cell < 0 ? 0 : cell < cells->side ? cell : cells->side - 1;
}

// Columns of a row of cells that a triangle comes near: a little more than it meets, never less.
static void sss_atlas__columns(const sss_atlas__cells *cells, const int32_t c[3][2], int32_t row, int32_t out[2])
{
    const double low = row / cells->per_unit - 1.0, high = (row + 1) / cells->per_unit + 1.0; // a unit of tolerance
    double from = 2.0 * SSS_ATLAS__UNITS, to = -1.0;
    int k, i;
    for (k = 0; k < 3; k++)
    {
        const int32_t *a = c[k], *b = c[k < 2 ? k + 1 : 0];
        const double slope = a[1] != b[1] ? ((double)b[0] - a[0]) / ((double)b[1] - a[1]) : 0.0;
        const double y[2] = {sss_atlas__max(low, sss_atlas__min(a[1], b[1])),
                             sss_atlas__min(high, sss_atlas__max(a[1], b[1]))};
        for (i = 0; i < 2 && y[0] <= y[1]; i++)
        {
            double x = a[0] + (y[i] - a[1]) * slope;
            if (a[1] == b[1])
            {
                x = i == 0 ? a[0] : b[0];
            }
            from = sss_atlas__min(from, x);
            to = sss_atlas__max(to, x);
        }
    }
    out[0] = sss_atlas__cell_at(cells, from - 1.0);
    out[1] = sss_atlas__cell_at(cells, to + 1.0);
}

static void sss_atlas__rows(const sss_atlas__cells *cells, const int32_t c[3][2], int32_t out[2])
{
    const int32_t low = c[0][1] < c[1][1] ? c[0][1] : c[1][1], high = c[0][1] > c[1][1] ? c[0][1] : c[1][1];
    out[0] = sss_atlas__cell_at(cells, (low < c[2][1] ? low : c[2][1]) - 1.0);
    out[1] = sss_atlas__cell_at(cells, (high > c[2][1] ? high : c[2][1]) + 1.0);
}

// Counts (entries NULL) or writes what lies in each cell. Returns the number of entries, or more than `most`.
static size_t sss_atlas__fill_cells(const sss_atlas__build *b, sss_atlas__cells *cells, size_t most)
{
    size_t t, sum = 0;
    for (t = 0; t < b->triangle_count && sum <= most; t++)
    {
        int32_t c[3][2], rows[2], columns[2], row, column;
        if (!sss_atlas__grid_corners(b, t, c))
        {
            continue;
        }
        sss_atlas__rows(cells, (const int32_t (*)[2])c, rows);
        for (row = rows[0]; row <= rows[1] && sum <= most; row++)
        {
            sss_atlas__columns(cells, (const int32_t (*)[2])c, row, columns);
            for (column = columns[0]; column <= columns[1]; column++)
            {
                uint32_t *at = &cells->first[(size_t)row * (size_t)cells->side + (size_t)column];
                if (cells->entries != NULL)
                {
                    cells->entries[--*at] = (uint32_t)t;
                }
                else
                {
                    ++*at;
                }
                sum++;
            }
        }
    }
    return sum;
}

// Pairs of triangles in one cell whose interiors meet, each in the first cell that both are in.
//   items  sorted by one end along a line;   work  tests done, none beyond `most`
static size_t sss_atlas__overlaps_in_cell(const sss_atlas__build *b, const sss_atlas__cells *cells, size_t cell,
                                          const sss_atlas__item *items, size_t count, double *work, double most)
{
    size_t i, j, sum = 0;
    for (i = 0; i < count; i++)
    {
        int32_t a[3][2], c[3][2];
        sss_atlas__grid_corners(b, items[i].id, a);
        for (j = i + 1; j < count && items[j].key < items[i].second && *work < most; j++)
        {
            *work += 1.0;
            sss_atlas__grid_corners(b, items[j].id, c);
            if (sss_atlas__interiors_meet((const int32_t (*)[2])a, (const int32_t (*)[2])c))
            {
                int32_t ra[2], rc[2], ca[2] = {1, 0}, cc[2] = {1, 0}, row;
                sss_atlas__rows(cells, (const int32_t (*)[2])a, ra);
                sss_atlas__rows(cells, (const int32_t (*)[2])c, rc);
                for (row = ra[0] > rc[0] ? ra[0] : rc[0]; row <= (int32_t)(cell / (size_t)cells->side); row++)
                {
                    sss_atlas__columns(cells, (const int32_t (*)[2])a, row, ca);
                    sss_atlas__columns(cells, (const int32_t (*)[2])c, row, cc);
                    if (ca[0] <= cc[1] && cc[0] <= ca[1])
                    {
                        break;
                    }
                }
                if (b->bad != NULL)
                {
                    b->bad[items[i].id] = b->bad[items[j].id] = 1; // whoever can may pull them apart
                }
                sum += (size_t)row * (size_t)cells->side + (size_t)(ca[0] > cc[0] ? ca[0] : cc[0]) == cell;
            }
        }
    }
    return sum;
}

#define SSS_ATLAS__FEW 16            // in a cell, whose order matters little
#define SSS_ATLAS__CELL_ENTRIES 8   // cells are enlarged until triangles lie in so many of them on average
#define SSS_ATLAS__OVERLAP_TESTS 500 // tests for each triangle on average: beyond it must be a heap of overlaps

// Makes the cells as fine as their number of entries allows. 0: no memory.
static int sss_atlas__make_cells(sss_atlas__build *b, sss_atlas__cells *cells, size_t *most_in_cell)
{
    const size_t room = SSS_ATLAS__CELL_ENTRIES * b->triangle_count + 64;
    size_t side = (size_t)sqrt((double)b->triangle_count) + 1, sum, i;
    side = side < 4096 ? side : 4096;
    cells->entries = NULL;
    cells->first = (uint32_t *)sss_atlas__take(&b->memory, side * side + 1, sizeof *cells->first);
    if (cells->first == NULL)
    {
        return 0;
    }
    for (;; side = side > 2 ? side / 2 : 1) // one cell: one entry for each triangle
    {
        cells->side = (int32_t)side;
        cells->per_unit = (double)side / SSS_ATLAS__UNITS;
        memset(cells->first, 0, (side * side + 1) * sizeof *cells->first);
        sum = sss_atlas__fill_cells(b, cells, room);
        if (sum <= room)
        {
            break;
        }
    }
    *most_in_cell = 0;
    for (i = 0; i < side * side; i++)
    {
        *most_in_cell = cells->first[i] > *most_in_cell ? cells->first[i] : *most_in_cell;
        cells->first[i] += i > 0 ? cells->first[i - 1] : 0;
    }
    cells->first[side * side] = (uint32_t)sum;
    cells->entries = (uint32_t *)sss_atlas__take(&b->memory, sum, sizeof *cells->entries);
    if (cells->entries == NULL)
    {
        return 0;
    }
    sss_atlas__fill_cells(b, cells, room);
    return 1;
}

// Triangles of a cell, sorted along whichever of eight directions they are the least long, so that needles side by side
// are not all compared with each other.
static void sss_atlas__sort_cell(const sss_atlas__build *b, const uint32_t *triangles, size_t count,
                                 sss_atlas__item *items, sss_atlas__item *scratch)
{
    static const double directions[8][2] = {{1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0},  {1.0, -1.0},
                                            {2.0, 1.0}, {1.0, 2.0}, {2.0, -1.0}, {1.0, -2.0}};
    const int tries = count > SSS_ATLAS__FEW ? 8 : 1;
    double least = 1e300;
    int pass, best = 0;
    size_t i;
    for (pass = 0; pass <= tries; pass++) // the best one once more
    {
        const double *d = directions[pass < tries ? pass : best];
        double sum = 0.0;
        if (pass == tries && best == tries - 1)
        {
            break; // is there already
        }
        for (i = 0; i < count; i++)
        {
            double at[3];
            int32_t c[3][2];
            int k;
            sss_atlas__grid_corners(b, triangles[i], c);
            for (k = 0; k < 3; k++)
            {
                at[k] = d[0] * c[k][0] + d[1] * c[k][1];
            }
            items[i].key = sss_atlas__min(at[0], sss_atlas__min(at[1], at[2])); // one end, the other
            items[i].second = sss_atlas__max(at[0], sss_atlas__max(at[1], at[2]));
            items[i].id = triangles[i];
            sum += items[i].second - items[i].key;
        }
        sum /= sqrt(d[0] * d[0] + d[1] * d[1]);
        if (pass < tries && sum < least)
        {
            least = sum;
            best = pass;
        }
    }
    sss_atlas__sort_items(items, count, scratch);
}

// Pairs of triangles whose interiors meet in the texture: exact, in integers. Work is O(T) for triangles of similar
// size and ends after OVERLAP_TESTS T tests for any: what was found until then counts, and one more, so that 0 means 0.
// Where memory ends, memory.failed is set and SIZE_MAX returned.
static size_t sss_atlas__count_overlaps(sss_atlas__build *b)
{
    sss_atlas__cells cells;
    sss_atlas__item *items = NULL, *scratch = NULL;
    size_t most_in_cell = 0, sum = 0, cell;
    double work = 0.0, most = (double)SSS_ATLAS__OVERLAP_TESTS * (double)b->triangle_count;
    int ok = sss_atlas__make_cells(b, &cells, &most_in_cell);
    if (ok)
    {
        items = (sss_atlas__item *)sss_atlas__take(&b->memory, most_in_cell, sizeof *items);
        scratch = (sss_atlas__item *)sss_atlas__take(&b->memory, most_in_cell, sizeof *scratch);
        ok = items != NULL && scratch != NULL;
    }
    for (cell = 0; ok && cell < (size_t)cells.side * (size_t)cells.side; cell++)
    {
        const size_t count = cells.first[cell + 1] - cells.first[cell];
        sss_atlas__sort_cell(b, cells.entries + cells.first[cell], count, items, scratch);
        sum += sss_atlas__overlaps_in_cell(b, &cells, cell, items, count, &work, most);
    }
    sss_atlas__drop(&b->memory, scratch);
    sss_atlas__drop(&b->memory, items);
    sss_atlas__drop(&b->memory, cells.entries);
    sss_atlas__drop(&b->memory, cells.first);
    return !ok ? SIZE_MAX : work >= most ? sum + 1 : sum;
}

// ---- texels: the surface under each ----
//
// Lensch 2002, 5.1 and 5.2. In units of 2^-24 of a texel everything that decides is an integer: corners are grid times
// size, lines between texels lie at multiples of SSS_ATLAS__UNITS. Rows go in bands; a band's triangles come in rising
// order whatever the split, so that sums do not depend on it.

#define SSS_ATLAS__BAND_ROWS 16      // rows that share a scratch: a few hundred KiB at 2048 texels on a side
#define SSS_ATLAS__BAND_SLOTS 16     // bands at work at a time
#define SSS_ATLAS__BIN_FACTOR 8      // more entries in bins than so many for each item make the bands higher
#define SSS_ATLAS__TOO_THIN 3.6e-12  // 2^-38: twice the area over the box's, below which rounding decides
#define SSS_ATLAS__NO_SHARE 3.6e-15  // 2^-48: share of a texel, per texel of length, that is nothing but rounding
#define SSS_ATLAS__HALF_ULP 5.96e-8  // 2^-24: a float's rounding
#define SSS_ATLAS__OWNED 2.0         // more than any share: the triangle holds the texel's centre
#define SSS_ATLAS__STEPS 64          // triangles that a walk may cross for each texel of its length
#define SSS_ATLAS__FAR 2             // rings of texels that are searched for the entry of a vertex

// What is known of a texel: no surface; the centre in a triangle; surface, but not under the centre; none, but a chart
// near.
#define SSS_ATLAS__MARK_NONE 0
#define SSS_ATLAS__MARK_CENTER 1
#define SSS_ATLAS__MARK_PART 2
#define SSS_ATLAS__MARK_BORDER 3

typedef struct sss_atlas__texel_job
{
    const sss_atlas__build *b;
    sss_atlas *a;
    const float *positions, *normals; // [V][3]
    size_t size;
    int border;
    double reach;              // texels from a boundary within which a texel's centre may look for it
    // bins: what lies in each band of rows
    size_t band_rows, band_count, first_band;
    size_t *bin_first;         // [band_count + 1]
    uint32_t *bin_items;       // triangles, or boundary edges
    // scratch of the bands at work, [SSS_ATLAS__BAND_SLOTS] each
    double *surface;           // [band_rows][size] mm^2, or squared distance from the boundary
    double *share;             // [band_rows][size] of the texel's triangle, or how straight an edge looks at the texel
    double *sums;              // [size + 2] of one row
    // of all texels, until the table is made; a->entry holds triangles for so long
    float *area;               // [size][size]
    unsigned char *mark;       // [size][size]
    unsigned char *near_row;   // [size][size] a chart is near in the same row
    unsigned char *near_any;   // [size][size] a chart is near
    uint32_t *edge;            // [size][size] nearest boundary edge
    size_t *inner_first;       // [size + 1]
    size_t *border_first;      // [size + 1]
} sss_atlas__texel_job;

// A triangle of the texture, counter-clockwise, and the texels that its box meets: [begin, end).
typedef struct sss_atlas__raster
{
    int64_t p[3][2];           // grid times size
    int64_t d[3][2];           // to the next one, on the grid
    int64_t twice;             // area on the grid, doubled, >= 0
    int order[3];              // the corner that each point is
    size_t begin[2], end[2];
} sss_atlas__raster;

static int64_t sss_atlas__floor_divide(int64_t a, int64_t b)
{
    const int64_t q = a / b;
    return a % b < 0 ? q - 1 : q; // b > 0
}

static double sss_atlas__covered_area(const sss_atlas__build *b, size_t triangle)
{
    const uint32_t *corner = b->corner + 3 * triangle;
    return 0.5 * fabs((double)sss_atlas__orient_grid(b->grid[corner[0]], b->grid[corner[1]], b->grid[corner[2]]));
}

// The texels that its box meets.
static void sss_atlas__box_raster(const sss_atlas__texel_job *table, sss_atlas__raster *out)
{
    int k, i;
    for (i = 0; i < 2; i++)
    {
        int64_t low = out->p[0][i], high = out->p[0][i];
        for (k = 1; k < 3; k++)
        {
            low = out->p[k][i] < low ? out->p[k][i] : low;
            high = out->p[k][i] > high ? out->p[k][i] : high;
        }
        if (out->twice == 0) // what it has goes to the texel of its centroid
        {
            low = high = (out->p[0][i] + out->p[1][i] + out->p[2][i]) / 3;
        }
        out->begin[i] = (size_t)(low / SSS_ATLAS__UNITS);
        out->begin[i] = out->begin[i] < table->size ? out->begin[i] : table->size - 1;
        out->end[i] = (size_t)((high + SSS_ATLAS__UNITS - 1) / SSS_ATLAS__UNITS);
        out->end[i] = out->end[i] > out->begin[i] ? out->end[i] : out->begin[i] + 1;
    }
}

static void sss_atlas__set_raster(const sss_atlas__texel_job *table, size_t triangle, sss_atlas__raster *out)
{
    const sss_atlas__build *b = table->b;
    const uint32_t *corner = b->corner + 3 * triangle;
    int k, i;
    out->twice = sss_atlas__orient_grid(b->grid[corner[0]], b->grid[corner[1]], b->grid[corner[2]]);
    for (k = 0; k < 3; k++)
    {
        out->order[k] = out->twice < 0 ? 2 - k : k;
        for (i = 0; i < 2; i++)
        {
            out->p[k][i] = (int64_t)b->grid[corner[out->order[k]]][i] * (int64_t)table->size;
        }
    }
    out->twice = out->twice < 0 ? -out->twice : out->twice;
    for (i = 0; i < 2; i++)
    {
        for (k = 0; k < 3; k++)
        {
            out->d[k][i] = (int64_t)b->grid[corner[out->order[(k + 1) % 3]]][i] - b->grid[corner[out->order[k]]][i];
        }
    }
    sss_atlas__box_raster(table, out);
}

// Twice the area, times size, of an edge of a placed triangle and the centre of a texel: below 2^62 in the square.
static int64_t sss_atlas__edge_function(const sss_atlas__raster *placed, int k, size_t u, size_t v)
{
    const int64_t x = (int64_t)u * SSS_ATLAS__UNITS + SSS_ATLAS__UNITS / 2 - placed->p[k][0];
    const int64_t y = (int64_t)v * SSS_ATLAS__UNITS + SSS_ATLAS__UNITS / 2 - placed->p[k][1];
    return placed->d[k][0] * y - placed->d[k][1] * x;
}

// Texels of a row whose centres a triangle holds: [begin, end). A centre on an edge belongs to the triangle on the
// right of it, on a level edge to the one above (the top-left rule with rows counted in the order of memory): as if
// centres were moved by (d, d^2) for a vanishing d.
static void sss_atlas__centers(const sss_atlas__raster *placed, size_t row, size_t *begin, size_t *end)
{
    int64_t first = 0, last = (int64_t)placed->end[0] - (int64_t)placed->begin[0] - 1;
    int k;
    for (k = 0; k < 3; k++)
    {
        const int64_t x = placed->d[k][0], y = placed->d[k][1];
        const int64_t least = y < 0 || (y == 0 && x > 0) ? 0 : 1; // inside at this value of the edge function and above
        const int64_t value = sss_atlas__edge_function(placed, k, placed->begin[0], row) - least;
        if (y == 0)
        {
            last = value < 0 ? -1 : last;
        }
        else
        {
            const int64_t n = sss_atlas__floor_divide(value, (y < 0 ? -y : y) * SSS_ATLAS__UNITS);
            first = y < 0 && -n > first ? -n : first;
            last = y > 0 && n < last ? n : last;
        }
    }
    *begin = placed->begin[0] + (size_t)first;
    *end = last < first ? *begin : placed->begin[0] + (size_t)last + 1;
}

// ---- shares of texels: trapezoids to the right of each edge, summed along a row as font rasterisers do ----

// Adds the part of an edge from p to q (texels from the box) within the row above y to sums, which are differences
// of shares from texel to texel; widens [touched[0], touched[1]].
static void sss_atlas__add_edge(const double p[2], const double q[2], double y, double *sums, size_t touched[2])
{
    const double *low = p[1] < q[1] ? p : q, *high = p[1] < q[1] ? q : p;
    const double y0 = sss_atlas__max(low[1], y), y1 = sss_atlas__min(high[1], y + 1.0);
    if (y0 < y1)
    {
        const double slope = (high[0] - low[0]) / (high[1] - low[1]);
        const double left = sss_atlas__min(p[0], q[0]), right = sss_atlas__max(p[0], q[0]);
        const double weight = p[1] < q[1] ? y0 - y1 : y1 - y0; // edges that go down have the triangle on their right
        double x0 = low[0] + (y0 - low[1]) * slope, x1 = high[0] - (high[1] - y1) * slope;
        double a, b;
        size_t c, last;
        x0 = sss_atlas__min(sss_atlas__max(x0, left), right);
        x1 = sss_atlas__min(sss_atlas__max(x1, left), right);
        a = sss_atlas__min(x0, x1);
        b = sss_atlas__max(x0, x1);
        c = (size_t)a;
        last = (size_t)b;
        touched[0] = c < touched[0] ? c : touched[0];
        touched[1] = last > touched[1] ? last : touched[1];
        if (c == last)
        {
            const double beyond = 0.5 * (a + b) - (double)c;
            sums[c] += weight * (1.0 - beyond);
            sums[c + 1] += weight * beyond;
            return;
        }
        for (; c <= last; c++)
        {
            const double from = sss_atlas__max(a, (double)c), to = sss_atlas__min(b, (double)c + 1.0);
            const double part = weight * ((to - from) / (b - a)), beyond = 0.5 * (from + to) - (double)c;
            sums[c] += part * (1.0 - beyond);
            sums[c + 1] += part * beyond;
        }
    }
}

// What one triangle leaves in one row: its surface, and itself where it has the centre or the largest share.
typedef struct sss_atlas__texel_row
{
    double *surface, *share, *sums;
    uint32_t *under;
} sss_atlas__texel_row;

static void sss_atlas__fill_centers(const sss_atlas__raster *placed, size_t row, uint32_t triangle,
                                    sss_atlas__texel_row *out)
{
    size_t begin, end, u;
    sss_atlas__centers(placed, row, &begin, &end);
    for (u = begin; u < end; u++)
    {
        if (out->share[u] < SSS_ATLAS__OWNED) // charts do not overlap; if they did: the lower index
        {
            out->share[u] = SSS_ATLAS__OWNED;
            out->under[u] = triangle;
        }
    }
}

static void sss_atlas__fill_shares(const sss_atlas__raster *placed, double (*p)[2], size_t row, uint32_t triangle,
                                   double ratio, sss_atlas__texel_row *out)
{
    const double width = (double)(placed->end[0] - placed->begin[0]);
    const double height = sss_atlas__min(1.0, fabs(p[0][1] - p[1][1]) + fabs(p[1][1] - p[2][1]));
    const double nothing = SSS_ATLAS__NO_SHARE * width * height;
    size_t touched[2] = {SIZE_MAX, 0}, c;
    double share = 0.0;
    int k;
    for (k = 0; k < 3; k++)
    {
        sss_atlas__add_edge(p[k], p[(k + 1) % 3], (double)(row - placed->begin[1]), out->sums, touched);
    }
    if (touched[0] == SIZE_MAX)
    {
        return;
    }
    for (c = touched[0]; c <= touched[1] + 1; c++)
    {
        const size_t u = placed->begin[0] + c;
        share += out->sums[c];
        out->sums[c] = 0.0;
        if (u < placed->end[0])
        {
            out->surface[u] += share * ratio; // also what rounding left, so that the sum holds
            if (share > out->share[u] && share > nothing)
            {
                out->share[u] = share;
                out->under[u] = triangle;
            }
        }
    }
}

// A triangle in the rows [begin, end), for whose first one out has been set up.
static void sss_atlas__fill_triangle(const sss_atlas__texel_job *table, uint32_t triangle, size_t begin, size_t end,
                                     const sss_atlas__texel_row *first)
{
    const double surface = table->b->area[triangle], unit = (double)SSS_ATLAS__UNITS;
    const double texel = (double)table->size / unit; // texels per unit of the grid
    sss_atlas__raster placed;
    double p[3][2], box[2], centroid[2], ratio = 0.0;
    size_t row, middle[2];
    int k, i, thin;
    sss_atlas__set_raster(table, triangle, &placed);
    for (i = 0; i < 2; i++)
    {
        for (k = 0; k < 3; k++)
        {
            p[k][i] = (double)(placed.p[k][i] - (int64_t)placed.begin[i] * SSS_ATLAS__UNITS) / unit;
        }
        box[i] = sss_atlas__max(sss_atlas__max(p[0][i], p[1][i]), p[2][i]) -
                 sss_atlas__min(sss_atlas__min(p[0][i], p[1][i]), p[2][i]);
        centroid[i] = (double)((placed.p[0][i] + placed.p[1][i] + placed.p[2][i]) / 3) / unit;
        middle[i] = (size_t)centroid[i] < table->size ? (size_t)centroid[i] : table->size - 1;
    }
    thin = (double)placed.twice * texel * texel <= SSS_ATLAS__TOO_THIN * box[0] * box[1] || placed.twice == 0;
    if (!thin)
    {
        ratio = surface / (0.5 * (double)placed.twice * texel * texel);
    }
    for (row = begin > placed.begin[1] ? begin : placed.begin[1]; row < end && row < placed.end[1]; row++)
    {
        const size_t offset = (row - begin) * table->size;
        sss_atlas__texel_row out;
        out.surface = first->surface + offset;
        out.share = first->share + offset;
        out.under = first->under + offset;
        out.sums = first->sums;
        if (placed.twice > 0)
        {
            sss_atlas__fill_centers(&placed, row, triangle, &out);
        }
        if (thin && row == middle[1] && surface > 0.0)
        {
            out.surface[middle[0]] += surface;
            out.under[middle[0]] = out.under[middle[0]] == SSS_ATLAS__NONE ? triangle : out.under[middle[0]];
        }
        if (!thin)
        {
            sss_atlas__fill_shares(&placed, p, row, triangle, ratio, &out);
        }
    }
}

// Sums of a row into floats. What rounding takes from a texel goes to a later one where it is less than that rounds
// anyway, so that the sum of all holds; so does what lies on texels without an entry: less than rounding shows.
static void sss_atlas__close_row(const sss_atlas__texel_job *table, size_t row, const sss_atlas__texel_row *in)
{
    double carry = 0.0;
    size_t u, count = 0;
    for (u = 0; u < table->size; u++)
    {
        const size_t texel = row * table->size + u;
        double sum = in->surface[u];
        if (in->under[u] == SSS_ATLAS__NONE || sum < 0.0)
        {
            carry += sum;
            sum = 0.0;
        }
        if (in->under[u] != SSS_ATLAS__NONE)
        {
            if (fabs(carry) <= SSS_ATLAS__HALF_ULP * sum)
            {
                sum += carry;
                carry = 0.0;
            }
            table->area[texel] = (float)sum;
            carry += sum - (double)table->area[texel];
            table->mark[texel] = in->share[u] < SSS_ATLAS__OWNED ? SSS_ATLAS__MARK_PART : SSS_ATLAS__MARK_CENTER;
            count++;
        }
    }
    table->inner_first[row + 1] = count;
}

static void sss_atlas__cover_task(void *context, size_t begin, size_t end)
{
    const sss_atlas__texel_job *table = (const sss_atlas__texel_job *)context;
    const size_t size = table->size;
    size_t slot, i, row;
    for (slot = begin; slot < end; slot++)
    {
        const size_t band = table->first_band + slot, first_row = band * table->band_rows;
        const size_t rows = size - first_row < table->band_rows ? size - first_row : table->band_rows;
        sss_atlas__texel_row first;
        first.surface = table->surface + slot * table->band_rows * size;
        first.share = table->share + slot * table->band_rows * size;
        first.sums = table->sums + slot * (size + 2);
        first.under = table->a->entry + first_row * size;
        memset(first.surface, 0, rows * size * sizeof *first.surface); // a double's zero is all zero bits
        memset(first.share, 0, rows * size * sizeof *first.share);
        memset(first.under, 0xff, rows * size * sizeof *first.under); // SSS_ATLAS__NONE
        for (i = table->bin_first[band]; i < table->bin_first[band + 1]; i++)
        {
            sss_atlas__fill_triangle(table, table->bin_items[i], first_row, first_row + rows, &first);
        }
        for (row = 0; row < rows; row++)
        {
            sss_atlas__close_row(table, first_row + row, &first);
            first.surface += size;
            first.share += size;
            first.under += size;
        }
    }
}

// ---- bins ----

// Rows [out[0], out[1]) that an item touches, none where there is nothing to do. Items: triangles, or corners, of
// which some begin boundary edges.
typedef void (*sss_atlas__rows_of)(const sss_atlas__texel_job *table, size_t item, uint32_t out[2]);

static void sss_atlas__triangle_rows(const sss_atlas__texel_job *table, size_t triangle, uint32_t out[2])
{
    const sss_atlas__build *b = table->b;
    int32_t low = b->grid[b->corner[3 * triangle]][1], high = low;
    int k;
    for (k = 1; k < 3; k++)
    {
        const int32_t y = b->grid[b->corner[3 * triangle + (size_t)k]][1];
        low = y < low ? y : low;
        high = y > high ? y : high;
    }
    out[0] = (uint32_t)((uint64_t)low * table->size / SSS_ATLAS__UNITS);
    out[0] = out[0] < table->size ? out[0] : (uint32_t)table->size - 1;
    out[1] = (uint32_t)(((uint64_t)high * table->size + SSS_ATLAS__UNITS - 1) / SSS_ATLAS__UNITS);
    out[1] = out[1] > out[0] ? out[1] : out[0] + 1;
}

static void sss_atlas__edge_rows(const sss_atlas__texel_job *table, size_t edge, uint32_t out[2])
{
    const sss_atlas__build *b = table->b;
    const double texel = (double)table->size / (double)SSS_ATLAS__UNITS;
    double y[2];
    out[0] = out[1] = 0;
    if (!sss_atlas__is_boundary(b, edge))
    {
        return;
    }
    y[0] = (double)b->grid[b->corner[edge]][1] * texel;
    y[1] = (double)b->grid[b->corner[edge / 3 * 3 + (edge + 1) % 3]][1] * texel;
    // centres lie half a texel above their row
    out[0] = (uint32_t)sss_atlas__max(0.0, floor(sss_atlas__min(y[0], y[1]) - table->reach - 0.5));
    out[1] = (uint32_t)sss_atlas__min((double)table->size, ceil(sss_atlas__max(y[0], y[1]) + table->reach + 0.5));
}

static void sss_atlas__fill_bins(sss_atlas__texel_job *table, size_t count, const uint32_t (*rows)[2])
{
    size_t i, band;
    // counted two places on, summed, filled one place on: then each bin begins where the last one ended
    for (i = 0; i < count; i++)
    {
        for (band = rows[i][0] / table->band_rows; band * table->band_rows < rows[i][1]; band++)
        {
            table->bin_first[band + 2]++;
        }
    }
    for (band = 0; band < table->band_count; band++)
    {
        table->bin_first[band + 2] += table->bin_first[band + 1];
    }
    for (i = 0; i < count; i++)
    {
        for (band = rows[i][0] / table->band_rows; band * table->band_rows < rows[i][1]; band++)
        {
            table->bin_items[table->bin_first[band + 1]++] = (uint32_t)i;
        }
    }
}

// Bands as high as keep the bins small, and their scratch.
static sss_result sss_atlas__make_bins(sss_atlas__texel_job *table, size_t count, sss_atlas__rows_of rows_of)
{
    sss_atlas__memory *memory = &table->a->memory;
    uint32_t (*rows)[2] = (uint32_t (*)[2])sss_atlas__take(memory, count, sizeof *rows);
    size_t i, total = 0, used = 0, slots;
    if (rows == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < count; i++)
    {
        rows_of(table, i, rows[i]);
        rows[i][1] = rows[i][1] > rows[i][0] ? rows[i][1] : 0; // none at all
        rows[i][0] = rows[i][1] > 0 ? rows[i][0] : 0;
        used += rows[i][1] > 0 ? 1 : 0;
    }
    for (table->band_rows = SSS_ATLAS__BAND_ROWS;; table->band_rows *= 2) // a band of all rows holds each item once
    {
        for (i = 0, total = 0; i < count; i++)
        {
            total += rows[i][1] > 0 ? (rows[i][1] - 1) / table->band_rows - rows[i][0] / table->band_rows + 1 : 0;
        }
        if (total / SSS_ATLAS__BIN_FACTOR <= used || table->band_rows >= table->size)
        {
            break;
        }
    }
    table->band_count = (table->size + table->band_rows - 1) / table->band_rows;
    slots = table->band_count < SSS_ATLAS__BAND_SLOTS ? table->band_count : SSS_ATLAS__BAND_SLOTS;
    table->bin_first = (size_t *)sss_atlas__take(memory, table->band_count + 2, sizeof *table->bin_first);
    table->bin_items = (uint32_t *)sss_atlas__take(memory, total, sizeof *table->bin_items);
    table->surface = (double *)sss_atlas__take(memory, slots * table->band_rows * table->size, sizeof(double));
    table->share = (double *)sss_atlas__take(memory, slots * table->band_rows * table->size, sizeof(double));
    table->sums = (double *)sss_atlas__take(memory, slots * (table->size + 2), sizeof *table->sums);
    if (memory->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_atlas__fill_bins(table, count, (const uint32_t (*)[2])rows);
    sss_atlas__drop(memory, rows);
    return SSS_OK;
}

static void sss_atlas__drop_bins(sss_atlas__texel_job *table)
{
    sss_atlas__memory *memory = &table->a->memory;
    sss_atlas__drop(memory, table->bin_first);
    sss_atlas__drop(memory, table->bin_items);
    sss_atlas__drop(memory, table->surface);
    sss_atlas__drop(memory, table->share);
    sss_atlas__drop(memory, table->sums);
}

static void sss_atlas__for_bands(sss_atlas__texel_job *table, void (*task)(void *context, size_t begin, size_t end))
{
    for (table->first_band = 0; table->first_band < table->band_count; table->first_band += SSS_ATLAS__BAND_SLOTS)
    {
        const size_t left = table->band_count - table->first_band;
        sss_atlas__parallel(&table->b->memory.hooks, left < SSS_ATLAS__BAND_SLOTS ? left : SSS_ATLAS__BAND_SLOTS, task,
                            table);
    }
}

// ---- borders: which texels, and from which edge ----

static int sss_atlas__is_inner(unsigned char mark)
{
    return mark == SSS_ATLAS__MARK_CENTER || mark == SSS_ATLAS__MARK_PART;
}

static void sss_atlas__or_bytes(unsigned char *out, const unsigned char *in, size_t count)
{
    size_t i = 0;
    for (; i + 8 <= count; i += 8)
    {
        uint64_t a, b;
        memcpy(&a, out + i, 8);
        memcpy(&b, in + i, 8);
        a |= b;
        memcpy(out + i, &a, 8);
    }
    for (; i < count; i++)
    {
        out[i] = (unsigned char)(out[i] | in[i]);
    }
}

// A chart within the border in the same row.
static void sss_atlas__near_in_row_task(void *context, size_t begin, size_t end)
{
    const sss_atlas__texel_job *table = (const sss_atlas__texel_job *)context;
    const size_t size = table->size, border = (size_t)table->border;
    size_t row, d;
    for (row = begin; row < end; row++)
    {
        const unsigned char *mark = table->mark + row * size;
        unsigned char *out = table->near_row + row * size;
        for (d = 0; d <= border && d < size; d++)
        {
            sss_atlas__or_bytes(out + d, mark, size - d);
            sss_atlas__or_bytes(out, mark + d, size - d);
        }
    }
}

// The same up and down: together within the border in the larger of both directions.
static void sss_atlas__near_task(void *context, size_t begin, size_t end)
{
    const sss_atlas__texel_job *table = (const sss_atlas__texel_job *)context;
    const size_t size = table->size, border = (size_t)table->border;
    size_t row, other, u;
    for (row = begin; row < end; row++)
    {
        unsigned char *mark = table->mark + row * size, *near_any = table->near_any + row * size;
        for (other = row < border ? 0 : row - border; other <= row + border && other < size; other++)
        {
            sss_atlas__or_bytes(near_any, table->near_row + other * size, size);
        }
        for (u = 0; u < size; u++)
        {
            if (near_any[u] != 0 && mark[u] == SSS_ATLAS__MARK_NONE)
            {
                mark[u] = SSS_ATLAS__MARK_BORDER;
            }
        }
    }
}

// Nearest point of a boundary edge, in texels.
typedef struct sss_atlas__nearest
{
    double along;              // 0 .. 1 from the edge's begin
    double offset[2];          // from there to the point
    double distance2;
    double outward;            // cosine between the offset and the edge's normal
} sss_atlas__nearest;

static void sss_atlas__look_at_edge(const sss_atlas__texel_job *table, uint32_t edge, const double point[2],
                                    sss_atlas__nearest *out)
{
    const sss_atlas__build *b = table->b;
    const double texel = (double)table->size / (double)SSS_ATLAS__UNITS;
    const uint32_t *corner = b->corner + edge / 3 * 3;
    const int32_t *from = b->grid[corner[edge % 3]], *to = b->grid[corner[(edge + 1) % 3]];
    const double p[2] = {(double)from[0] * texel, (double)from[1] * texel};
    const double q[2] = {(double)to[0] * texel, (double)to[1] * texel};
    const double d[2] = {q[0] - p[0], q[1] - p[1]};
    const double length2 = d[0] * d[0] + d[1] * d[1];
    const double side = sss_atlas__orient_grid(b->grid[corner[0]], b->grid[corner[1]], b->grid[corner[2]]) < 0 ? -1 : 1;
    double cosine;
    int i;
    out->along = length2 > 0.0 ? ((point[0] - p[0]) * d[0] + (point[1] - p[1]) * d[1]) / length2 : 0.0;
    out->along = sss_atlas__min(sss_atlas__max(out->along, 0.0), 1.0);
    for (i = 0; i < 2; i++)
    {
        // exactly the end where it is the end, so that both edges of a vertex find the same distance
        out->offset[i] = point[i] - (out->along < 1.0 ? p[i] + out->along * d[i] : q[i]);
    }
    out->distance2 = out->offset[0] * out->offset[0] + out->offset[1] * out->offset[1];
    cosine = side * (out->offset[0] * d[1] - out->offset[1] * d[0]);
    out->outward = cosine == 0.0 ? 0.0 : cosine / sqrt(length2 * out->distance2);
}

// Columns [out[0], out[1]) of a row whose centres may lie within reach of an edge.
static void sss_atlas__edge_columns(const sss_atlas__texel_job *table, uint32_t edge, size_t row, size_t out[2])
{
    const sss_atlas__build *b = table->b;
    const double texel = (double)table->size / (double)SSS_ATLAS__UNITS, reach = table->reach;
    const int32_t *from = b->grid[b->corner[edge]], *to = b->grid[b->corner[edge / 3 * 3 + (edge + 1) % 3]];
    const int32_t *low = from[1] < to[1] ? from : to, *high = from[1] < to[1] ? to : from;
    const double p[2] = {(double)low[0] * texel, (double)low[1] * texel};
    const double d[2] = {(double)(high[0] - low[0]) * texel, (double)(high[1] - low[1]) * texel};
    const double y = (double)row + 0.5 - p[1];
    // the part of the edge that is no farther up or down than the reach
    const double begin = d[1] > 0.0 ? sss_atlas__min(sss_atlas__max((y - reach) / d[1], 0.0), 1.0) : 0.0;
    const double end = d[1] > 0.0 ? sss_atlas__min(sss_atlas__max((y + reach) / d[1], 0.0), 1.0) : 1.0;
    const double x0 = p[0] + begin * d[0], x1 = p[0] + end * d[0];
    // columns hold their centres half a texel on; as far again for rounding
    out[0] = (size_t)sss_atlas__max(0.0, floor(sss_atlas__min(x0, x1) - reach - 1.0));
    out[1] = (size_t)sss_atlas__min((double)table->size, ceil(sss_atlas__max(x0, x1) + reach + 1.0));
}

static void sss_atlas__nearest_edge(const sss_atlas__texel_job *table, uint32_t edge, size_t begin, size_t end,
                                    double *distance2, double *outward)
{
    uint32_t rows[2];
    size_t row, u;
    sss_atlas__edge_rows(table, edge, rows);
    for (row = rows[0] > begin ? rows[0] : begin; row < rows[1] && row < end; row++)
    {
        size_t columns[2];
        sss_atlas__edge_columns(table, edge, row, columns);
        for (u = columns[0]; u < columns[1]; u++)
        {
            const size_t texel = row * table->size + u, i = texel - begin * table->size;
            const double point[2] = {(double)u + 0.5, (double)row + 0.5};
            sss_atlas__nearest nearest;
            if (table->mark[texel] < SSS_ATLAS__MARK_PART)
            {
                continue;
            }
            sss_atlas__look_at_edge(table, edge, point, &nearest);
            if (nearest.distance2 <= table->reach * table->reach && nearest.outward >= 0.0 &&
                (table->edge[texel] == SSS_ATLAS__NONE || nearest.distance2 < distance2[i] ||
                 (nearest.distance2 <= distance2[i] && nearest.outward > outward[i])))
            {
                distance2[i] = nearest.distance2;
                outward[i] = nearest.outward;
                table->edge[texel] = edge;
            }
        }
    }
}

static void sss_atlas__border_task(void *context, size_t begin, size_t end)
{
    const sss_atlas__texel_job *table = (const sss_atlas__texel_job *)context;
    const size_t size = table->size;
    size_t slot, i;
    for (slot = begin; slot < end; slot++)
    {
        const size_t band = table->first_band + slot, first_row = band * table->band_rows;
        const size_t rows = size - first_row < table->band_rows ? size - first_row : table->band_rows;
        double *distance2 = table->surface + slot * table->band_rows * size;
        double *outward = table->share + slot * table->band_rows * size;
        memset(table->edge + first_row * size, 0xff, rows * size * sizeof *table->edge); // SSS_ATLAS__NONE
        for (i = table->bin_first[band]; i < table->bin_first[band + 1]; i++)
        {
            sss_atlas__nearest_edge(table, table->bin_items[i], first_row, first_row + rows, distance2, outward);
        }
        for (i = first_row * size; i < (first_row + rows) * size; i++)
        {
            if (table->mark[i] == SSS_ATLAS__MARK_BORDER && table->edge[i] != SSS_ATLAS__NONE)
            {
                table->border_first[i / size + 1]++;
            }
        }
    }
}

// ---- borders: walking over the surface ----

// A point of the surface.
typedef struct sss_atlas__surface_point
{
    uint32_t triangle;
    double barycentric[3];
} sss_atlas__surface_point;

// On an edge, about to cross it.
typedef struct sss_atlas__walk
{
    uint32_t edge;
    double along;              // mm from the edge's begin
    double direction[2];       // along the edge and out of its triangle; its length is what is left of the way, mm
} sss_atlas__walk;

static void sss_atlas__stand_on_edge(uint32_t edge, double fraction, sss_atlas__surface_point *out)
{
    out->triangle = edge / 3;
    out->barycentric[edge % 3] = 1.0 - fraction;
    out->barycentric[(edge + 1) % 3] = fraction;
    out->barycentric[(edge + 2) % 3] = 0.0;
}

// From the nearest point of a boundary edge straight away from it: the map from texture to surface of the triangle
// inside goes on beyond the edge, as far as the triangle reaches as deep into its chart as a texel; one that is
// shallower says little of the scale at which texels look, and an even map takes its place. 0: no way out.
static int sss_atlas__begin_walk(const sss_atlas__texel_job *table, uint32_t edge, const double offset[2],
                                 double fraction, sss_atlas__walk *out)
{
    const sss_atlas__build *b = table->b;
    const double texel = (double)table->size / (double)SSS_ATLAS__UNITS;
    const uint32_t t = edge / 3, c[3] = {edge, 3 * t + (edge + 1) % 3, 3 * t + (edge + 2) % 3};
    double uv[2][2], x[2][3], way[3], area, weight[2], length, along, base, even[2], depth;
    int k, i;
    for (k = 0; k < 2; k++)
    {
        for (i = 0; i < 3; i++)
        {
            x[k][i] = b->x[b->triangles[c[k + 1]]][i] - b->x[b->triangles[c[0]]][i];
        }
        for (i = 0; i < 2; i++)
        {
            uv[k][i] = (double)(b->grid[b->corner[c[k + 1]]][i] - b->grid[b->corner[c[0]]][i]) * texel;
        }
    }
    area = uv[0][0] * uv[1][1] - uv[0][1] * uv[1][0];
    length = sss_atlas__length(x[0]);
    if (b->twin[edge] == SSS_ATLAS__NONE || !(length > 0.0) || (area >= 0.0 && area <= 0.0))
    {
        return 0;
    }
    weight[0] = (offset[0] * uv[1][1] - offset[1] * uv[1][0]) / area;
    weight[1] = (uv[0][0] * offset[1] - uv[0][1] * offset[0]) / area; // below zero: beyond the edge
    for (i = 0; i < 3; i++)
    {
        way[i] = weight[0] * x[0][i] + weight[1] * x[1][i];
    }
    along = sss_atlas__dot(way, x[0]) / length;
    out->edge = edge;
    out->along = fraction * length;
    base = sqrt(uv[0][0] * uv[0][0] + uv[0][1] * uv[0][1]);
    even[0] = (offset[0] * uv[0][0] + offset[1] * uv[0][1]) / base;
    even[1] = fabs(offset[0] * uv[0][1] - offset[1] * uv[0][0]) / base;
    depth = sss_atlas__min(fabs(area) / base, 1.0); // texels
    out->direction[0] = depth * along + (1.0 - depth) * even[0] / b->texels_per_mm;
    out->direction[1] = depth * sqrt(sss_atlas__max(0.0, sss_atlas__dot(way, way) - along * along)) +
                        (1.0 - depth) * even[1] / b->texels_per_mm;
    return sss_atlas__finite(out->direction[0]) && sss_atlas__finite(out->direction[1]);
}

// Crosses the edge into its neighbour, unfolded over it as over a hinge. 1: the way ends there, at *out; 0: the walk
// has come to another edge of the neighbour.
static int sss_atlas__cross_edge(const sss_atlas__build *b, sss_atlas__walk *walk, sss_atlas__surface_point *out)
{
    const uint32_t edge = b->twin[walk->edge], t = edge / 3;
    const uint32_t next = 3 * t + (edge + 1) % 3, last = 3 * t + (edge + 2) % 3;
    const double *p = b->x[b->triangles[edge]], *q = b->x[b->triangles[next]], *r = b->x[b->triangles[last]];
    const double base[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, side[3] = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
    const double length = sss_atlas__length(base), height = 2.0 * b->area[t] / length;
    const double apex = sss_atlas__dot(side, base) / length;
    const double start = length - walk->along; // in the neighbour the edge runs the other way
    const double d[2] = {-walk->direction[0], walk->direction[1]};
    const double beta = d[1] / height;         // barycentric coordinate of the apex, at the end of the way
    const double gamma = (start + d[0] - beta * apex) / length; // of the edge's end
    const int right = d[0] * height - (apex - start) * d[1] > 0.0; // the way passes the apex on its right
    const double from = right ? length : 0.0, ex = apex - from; // the other edge, from this one to the apex
    const double across = d[0] * height - d[1] * ex;
    double step, fraction, other, away;
    if (beta >= 0.0 && gamma >= 0.0 && beta + gamma <= 1.0)
    {
        out->triangle = t;
        out->barycentric[edge % 3] = 1.0 - beta - gamma;
        out->barycentric[next % 3] = gamma;
        out->barycentric[last % 3] = beta;
        return 1;
    }
    step = across > 0.0 || across < 0.0 ? (from - start) * height / across : 0.0;
    step = sss_atlas__min(sss_atlas__max(step, 0.0), 1.0); // NaN, of a triangle without height, is 0 too
    fraction = height > 0.0 ? step * d[1] / height : 0.0;
    fraction = sss_atlas__min(sss_atlas__max(fraction, 0.0), 1.0);
    other = sqrt(ex * ex + height * height);
    if (other > 0.0)
    {
        // along the edge from this one to the apex, and away from the triangle
        const double along = (d[0] * ex + d[1] * height) / other;
        away = right ? (d[0] * height - d[1] * ex) / other : (d[1] * ex - d[0] * height) / other;
        walk->direction[0] = (right ? along : -along) * (1.0 - step);
        walk->direction[1] = sss_atlas__max(away, 0.0) * (1.0 - step);
    }
    walk->edge = right ? next : last;
    walk->along = (right ? fraction : 1.0 - fraction) * other;
    return 0;
}

static void sss_atlas__go_walk(const sss_atlas__texel_job *table, sss_atlas__walk *walk, sss_atlas__surface_point *out)
{
    const sss_atlas__build *b = table->b;
    int steps = SSS_ATLAS__STEPS * (table->border + 1);
    for (;;)
    {
        const double length = sss_atlas__edge_length(b, walk->edge);
        if (b->twin[walk->edge] == SSS_ATLAS__NONE || !(length > 0.0) || steps-- <= 0)
        {
            const double fraction = length > 0.0 ? walk->along / length : 0.0;
            sss_atlas__stand_on_edge(walk->edge, sss_atlas__min(sss_atlas__max(fraction, 0.0), 1.0), out);
            return;
        }
        if (sss_atlas__cross_edge(b, walk, out))
        {
            return;
        }
    }
}

// ---- entries ----

// What is known of the triangle of the texel before, which mostly is that of the next one.
typedef struct sss_atlas__last_raster
{
    sss_atlas__raster placed;
    uint32_t triangle, corners_of;
    double scale;              // one over twice the area, in the unit of edge functions
    double position[3][3], normal[3][3]; // of its corners
} sss_atlas__last_raster;

// Barycentric coordinates of the point of a triangle nearest to a texel's centre.
static void sss_atlas__nearest_in_triangle(const sss_atlas__texel_job *table, uint32_t triangle, const double point[2],
                                           double barycentric[3])
{
    double best = HUGE_VAL;
    uint32_t k;
    for (k = 0; k < 3; k++)
    {
        sss_atlas__nearest nearest;
        sss_atlas__look_at_edge(table, 3 * triangle + k, point, &nearest);
        if (nearest.distance2 < best)
        {
            best = nearest.distance2;
            barycentric[k] = 1.0 - nearest.along;
            barycentric[(k + 1) % 3] = nearest.along;
            barycentric[(k + 2) % 3] = 0.0;
        }
    }
}

// The surface under a texel's centre. last: the triangle of the texel before, mostly the same one.
static void sss_atlas__find_surface(const sss_atlas__texel_job *table, size_t u, size_t v, sss_atlas__last_raster *last,
                                    sss_atlas__surface_point *out)
{
    const size_t texel = v * table->size + u;
    const double point[2] = {(double)u + 0.5, (double)v + 0.5};
    if (table->mark[texel] != SSS_ATLAS__MARK_BORDER)
    {
        out->triangle = table->a->entry[texel];
    }
    if (table->mark[texel] == SSS_ATLAS__MARK_CENTER)
    {
        int k;
        if (last->triangle != out->triangle)
        {
            last->triangle = out->triangle;
            sss_atlas__set_raster(table, out->triangle, &last->placed);
            last->scale = 1.0 / ((double)last->placed.twice * (double)table->size);
        }
        for (k = 0; k < 3; k++)
        {
            out->barycentric[last->placed.order[(k + 2) % 3]] =
                (double)sss_atlas__edge_function(&last->placed, k, u, v) * last->scale;
        }
        return;
    }
    if (table->edge != NULL && table->edge[texel] != SSS_ATLAS__NONE)
    {
        sss_atlas__nearest nearest;
        sss_atlas__walk walk;
        sss_atlas__look_at_edge(table, table->edge[texel], point, &nearest);
        if (sss_atlas__begin_walk(table, table->edge[texel], nearest.offset, nearest.along, &walk))
        {
            sss_atlas__go_walk(table, &walk, out);
            return;
        }
        if (table->mark[texel] == SSS_ATLAS__MARK_BORDER)
        {
            sss_atlas__stand_on_edge(table->edge[texel], nearest.along, out);
            return;
        }
    }
    sss_atlas__nearest_in_triangle(table, out->triangle, point, out->barycentric);
}

static void sss_atlas__load_corners(const sss_atlas__texel_job *table, uint32_t triangle, sss_atlas__last_raster *out)
{
    const uint32_t *corner = table->b->triangles + 3 * (size_t)triangle;
    int k, i;
    for (k = 0; k < 3; k++)
    {
        for (i = 0; i < 3; i++)
        {
            out->position[k][i] = (double)table->positions[3 * (size_t)corner[k] + (size_t)i];
            out->normal[k][i] = (double)table->normals[3 * (size_t)corner[k] + (size_t)i];
        }
    }
    out->corners_of = triangle;
}

static void sss_atlas__weighted(const double corners[3][3], const double weight[3], double out[3])
{
    out[0] = weight[0] * corners[0][0] + weight[1] * corners[1][0] + weight[2] * corners[2][0];
    out[1] = weight[0] * corners[0][1] + weight[1] * corners[1][1] + weight[2] * corners[2][1];
    out[2] = weight[0] * corners[0][2] + weight[1] * corners[1][2] + weight[2] * corners[2][2];
}

static void sss_atlas__write_entry(const sss_atlas__texel_job *table, size_t u, size_t v, size_t entry,
                                   sss_atlas__last_raster *last)
{
    sss_atlas *a = table->a;
    const size_t texel = v * table->size + u;
    const uint32_t own = table->mark[texel] != SSS_ATLAS__MARK_BORDER ? a->entry[texel] : SSS_ATLAS__NONE;
    sss_atlas__surface_point at;
    double position[3], normal[3], length;
    int k, most;
    sss_atlas__find_surface(table, u, v, last, &at);
    if (last->corners_of != at.triangle)
    {
        sss_atlas__load_corners(table, at.triangle, last);
    }
    sss_atlas__weighted((const double (*)[3])last->position, at.barycentric, position);
    sss_atlas__weighted((const double (*)[3])last->normal, at.barycentric, normal);
    length = sss_atlas__length(normal);
    length = length > 0.0 ? 1.0 / length : 0.0;
    for (k = 0; k < 3; k++)
    {
        a->barycentric[entry][k] = (float)at.barycentric[k];
        a->position[entry][k] = (float)position[k];
        a->normal[entry][k] = (float)(normal[k] * length);
    }
    most = at.barycentric[1] > at.barycentric[0] ? 1 : 0;
    most = at.barycentric[2] > at.barycentric[most] ? 2 : most;
    a->texel[entry] = (uint32_t)texel;
    a->texel_triangle[entry] = at.triangle;
    a->area[entry] = table->area[texel];
    a->area_ratio[entry] = a->triangle_area_ratio[own != SSS_ATLAS__NONE ? own : at.triangle];
    a->entry_vertex[entry] = table->b->triangles[3 * (size_t)at.triangle + (size_t)most];
    a->entry[texel] = (uint32_t)entry;
}

static void sss_atlas__entries_task(void *context, size_t begin, size_t end)
{
    const sss_atlas__texel_job *table = (const sss_atlas__texel_job *)context;
    const size_t size = table->size;
    sss_atlas__last_raster last;
    size_t row, u;
    last.triangle = last.corners_of = SSS_ATLAS__NONE;
    for (row = begin; row < end; row++)
    {
        const unsigned char *mark = table->mark + row * size;
        size_t inner = table->inner_first[row], border = table->a->inner_count + table->border_first[row];
        for (u = 0; u < size; u++)
        {
            if (sss_atlas__is_inner(mark[u]))
            {
                sss_atlas__write_entry(table, u, row, inner++, &last);
            }
            else if (mark[u] == SSS_ATLAS__MARK_BORDER && table->edge[row * size + u] != SSS_ATLAS__NONE)
            {
                sss_atlas__write_entry(table, u, row, border++, &last);
            }
        }
    }
}

static sss_result sss_atlas__take_entries(sss_atlas *a)
{
    const size_t count = a->texel_count;
    a->texel = (uint32_t *)sss_atlas__take(&a->memory, count, sizeof *a->texel);
    a->texel_triangle = (uint32_t *)sss_atlas__take(&a->memory, count, sizeof *a->texel_triangle);
    a->barycentric = (float (*)[3])sss_atlas__take(&a->memory, count, sizeof *a->barycentric);
    a->position = (float (*)[3])sss_atlas__take(&a->memory, count, sizeof *a->position);
    a->normal = (float (*)[3])sss_atlas__take(&a->memory, count, sizeof *a->normal);
    a->area = (float *)sss_atlas__take(&a->memory, count, sizeof *a->area);
    a->area_ratio = (float *)sss_atlas__take(&a->memory, count, sizeof *a->area_ratio);
    a->entry_vertex = (uint32_t *)sss_atlas__take(&a->memory, count, sizeof *a->entry_vertex);
    return a->memory.failed ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}

// ---- maps between texels and vertices ----

typedef struct sss_atlas__near_entry
{
    uint32_t entry;
    double distance2;          // texels
} sss_atlas__near_entry;

typedef struct sss_atlas__vertex_search
{
    const sss_atlas__texel_job *table;
    sss_atlas__near_entry *found; // [A]
} sss_atlas__vertex_search;

static void sss_atlas__nearest_entry_task(void *context, size_t begin, size_t end)
{
    const sss_atlas__vertex_search *search = (const sss_atlas__vertex_search *)context;
    const sss_atlas__texel_job *table = search->table;
    const int64_t size = (int64_t)table->size;
    size_t i;
    for (i = begin; i < end; i++)
    {
        const int64_t x = (int64_t)table->b->grid[i][0] * size, y = (int64_t)table->b->grid[i][1] * size;
        const int64_t u = x / SSS_ATLAS__UNITS, v = y / SSS_ATLAS__UNITS; // size itself at the far side
        sss_atlas__near_entry best;
        int64_t ring, iu, iv;
        best.entry = SSS_ATLAS__NONE;
        best.distance2 = HUGE_VAL;
        for (ring = 0; ring <= SSS_ATLAS__FAR && best.entry == SSS_ATLAS__NONE; ring++)
        {
            // only a ring of its own texel holds nothing nearer outside; one more decides
            const int64_t far = ring > 0 ? ring + 1 : 0;
            for (iv = v - far < 0 ? 0 : v - far; iv <= v + far && iv < size; iv++)
            {
                for (iu = u - far < 0 ? 0 : u - far; iu <= u + far && iu < size; iu++)
                {
                    const uint32_t entry = table->a->entry[(size_t)(iv * size + iu)];
                    const double dx = ((double)iu + 0.5) - (double)x / (double)SSS_ATLAS__UNITS;
                    const double dy = ((double)iv + 0.5) - (double)y / (double)SSS_ATLAS__UNITS;
                    if (entry < table->a->inner_count && dx * dx + dy * dy < best.distance2)
                    {
                        best.entry = entry;
                        best.distance2 = dx * dx + dy * dy;
                    }
                }
            }
        }
        search->found[i] = best;
    }
}

// Vertices all of whose triangles are too small to leave anything near them take the entry where one of those went.
static void sss_atlas__finish_vertices(const sss_atlas__texel_job *table)
{
    const sss_atlas__build *b = table->b;
    sss_atlas *a = table->a;
    size_t t, k;
    for (t = 0; t < b->triangle_count; t++)
    {
        for (k = 0; k < 3; k++)
        {
            uint32_t *entry = &a->vertex_entry[b->triangles[3 * t + k]];
            if (*entry == SSS_ATLAS__NONE && a->inner_count > 0)
            {
                sss_atlas__raster placed;
                uint32_t here;
                sss_atlas__set_raster(table, t, &placed);
                here = a->entry[placed.begin[1] * table->size + placed.begin[0]];
                *entry = here < a->inner_count ? here : 0;
            }
        }
    }
}

static sss_result sss_atlas__map_vertices(const sss_atlas__texel_job *table)
{
    const sss_atlas__build *b = table->b;
    sss_atlas *a = table->a;
    sss_atlas__vertex_search search;
    double *distance2 = (double *)sss_atlas__take(&a->memory, b->vertex_count, sizeof *distance2);
    size_t i;
    search.table = table;
    search.found = (sss_atlas__near_entry *)sss_atlas__take(&a->memory, b->atlas_vertex_count, sizeof *search.found);
    a->vertex_entry = (uint32_t *)sss_atlas__take(&a->memory, b->vertex_count, sizeof *a->vertex_entry);
    if (a->memory.failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_atlas__parallel(&b->memory.hooks, b->atlas_vertex_count, sss_atlas__nearest_entry_task, &search);
    for (i = 0; i < b->vertex_count; i++)
    {
        a->vertex_entry[i] = SSS_ATLAS__NONE;
        distance2[i] = HUGE_VAL;
    }
    for (i = 0; i < b->atlas_vertex_count; i++)
    {
        const uint32_t v = b->vertex[i];
        if (search.found[i].distance2 < distance2[v])
        {
            distance2[v] = search.found[i].distance2;
            a->vertex_entry[v] = search.found[i].entry;
        }
    }
    sss_atlas__finish_vertices(table);
    sss_atlas__drop(&a->memory, distance2);
    sss_atlas__drop(&a->memory, search.found);
    return SSS_OK;
}

// ---- the mesh with texture coordinates ----

// L2 stretch of a triangle, Sander et al. 2001, and the larger singular value; 0 without texture or surface.
static double sss_atlas__stretch_of(const sss_atlas__build *b, size_t triangle, double *larger, double *smaller)
{
    double x[3][3], uv[3][2];
    int k, i;
    *larger = *smaller = 0.0;
    if (!(b->area[triangle] > 0.0) || !(sss_atlas__covered_area(b, triangle) > 0.0))
    {
        return 0.0;
    }
    for (k = 0; k < 3; k++)
    {
        const size_t corner = 3 * triangle + (size_t)k;
        for (i = 0; i < 3; i++)
        {
            x[k][i] = b->x[b->triangles[corner]][i];
        }
        for (i = 0; i < 2; i++)
        {
            uv[k][i] = (double)b->grid[b->corner[corner]][i] / (double)SSS_ATLAS__UNITS;
        }
    }
    sss_atlas__triangle_stretch((const double (*)[3])x, (const double (*)[2])uv, larger, smaller);
    return sqrt(0.5 * (*larger * *larger + *smaller * *smaller));
}

// Sums over the mesh: surface, mm^2, and texture, of 1.
static void sss_atlas__areas(const sss_atlas__build *b, double *surface, double *texture)
{
    const double unit = 1.0 / ((double)SSS_ATLAS__UNITS * (double)SSS_ATLAS__UNITS);
    size_t t;
    *surface = *texture = 0.0;
    for (t = 0; t < b->triangle_count; t++)
    {
        *surface += b->area[t];
        *texture += sss_atlas__covered_area(b, t) * unit;
    }
}

static sss_result sss_atlas__make_mesh(const sss_atlas__build *b, sss_atlas *a)
{
    const double texels = (double)b->options.size * (double)b->options.size;
    const double unit = 1.0 / ((double)SSS_ATLAS__UNITS * (double)SSS_ATLAS__UNITS);
    double surface, texture, larger, smaller;
    size_t i, k;
    a->uv = (float (*)[2])sss_atlas__take(&a->memory, b->atlas_vertex_count, sizeof *a->uv);
    a->vertex = (uint32_t *)sss_atlas__take(&a->memory, b->atlas_vertex_count, sizeof *a->vertex);
    a->triangles = (uint32_t *)sss_atlas__take(&a->memory, 3 * b->triangle_count, sizeof *a->triangles);
    a->chart = (uint32_t *)sss_atlas__take(&a->memory, b->triangle_count, sizeof *a->chart);
    a->stretch = (float *)sss_atlas__take(&a->memory, b->triangle_count, sizeof *a->stretch);
    a->triangle_area_ratio = (float *)sss_atlas__take(&a->memory, b->triangle_count, sizeof *a->triangle_area_ratio);
    a->chart_normal = (float (*)[3])sss_atlas__take(&a->memory, b->chart_count, sizeof *a->chart_normal);
    if (a->memory.failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_atlas__areas(b, &surface, &texture);
    for (i = 0; i < b->atlas_vertex_count; i++)
    {
        a->vertex[i] = b->vertex[i];
        for (k = 0; k < 2; k++)
        {
            a->uv[i][k] = (float)b->grid[i][k] * (1.0f / (float)SSS_ATLAS__UNITS); // exact
        }
    }
    memcpy(a->triangles, b->corner, 3 * b->triangle_count * sizeof *a->triangles);
    memcpy(a->chart, b->chart_of, b->triangle_count * sizeof *a->chart);
    for (i = 0; i < b->triangle_count; i++)
    {
        const double area = sss_atlas__covered_area(b, i) * unit;
        const double stretch = sss_atlas__stretch_of(b, i, &larger, &smaller);
        a->stretch[i] = area > 0.0 ? (float)(stretch * sqrt(texture / sss_atlas__max(surface, 1e-300)))
                                   : (float)HUGE_VAL;
        a->triangle_area_ratio[i] = area > 0.0 ? (float)(b->area[i] / (area * texels)) : 0.0f;
    }
    for (i = 0; i < b->chart_count; i++)
    {
        for (k = 0; k < 3; k++)
        {
            a->chart_normal[i][k] = (float)b->charts[i].normal[k];
        }
    }
    return SSS_OK;
}

// Means of the triangles' normals weighted by the angle at the vertex.
static sss_result sss_atlas__make_normals(const sss_atlas__build *b, sss_atlas__memory *memory, float **out)
{
    double (*sum)[3] = (double (*)[3])sss_atlas__take(memory, b->vertex_count, sizeof *sum);
    size_t t, v;
    int k, i;
    *out = (float *)sss_atlas__take(memory, b->vertex_count, 3 * sizeof **out);
    if (memory->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        for (k = 0; k < 3; k++)
        {
            const uint32_t *corner = b->triangles + 3 * t;
            const double *p = b->x[corner[k]], *q = b->x[corner[(k + 1) % 3]], *r = b->x[corner[(k + 2) % 3]];
            const double to_q[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
            const double to_r[3] = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
            const double angle = atan2(2.0 * b->area[t], sss_atlas__dot(to_q, to_r));
            for (i = 0; i < 3; i++)
            {
                sum[corner[k]][i] += angle * b->normal[t][i];
            }
        }
    }
    for (v = 0; v < b->vertex_count; v++)
    {
        sss_atlas__normalize(sum[v]);
        for (i = 0; i < 3; i++)
        {
            (*out)[3 * v + (size_t)i] = (float)sum[v][i];
        }
    }
    sss_atlas__drop(memory, sum);
    return SSS_OK;
}

// ---- the table ----

static sss_result sss_atlas__find_borders(sss_atlas__texel_job *table)
{
    sss_atlas__memory *memory = &table->a->memory;
    const sss_hooks *hooks = &table->b->memory.hooks;
    const size_t size = table->size;
    sss_result result;
    table->edge = (uint32_t *)sss_atlas__take(memory, size * size, sizeof *table->edge);
    table->near_row = (unsigned char *)sss_atlas__take(memory, size * size, 1);
    table->near_any = (unsigned char *)sss_atlas__take(memory, size * size, 1);
    if (memory->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_atlas__parallel(hooks, size, sss_atlas__near_in_row_task, table);
    sss_atlas__parallel(hooks, size, sss_atlas__near_task, table);
    sss_atlas__drop(memory, table->near_row);
    sss_atlas__drop(memory, table->near_any);
    // a chart reaches to within border + 1/2 in both directions of the centres of its border
    table->reach = sqrt(2.0) * ((double)table->border + 0.5);
    result = sss_atlas__make_bins(table, 3 * table->b->triangle_count, sss_atlas__edge_rows);
    if (result == SSS_OK)
    {
        sss_atlas__for_bands(table, sss_atlas__border_task);
        sss_atlas__drop_bins(table);
    }
    return result;
}

static sss_result sss_atlas__find_texels(sss_atlas__texel_job *table)
{
    sss_atlas *a = table->a;
    const size_t size = table->size;
    sss_result result;
    size_t row;
    a->entry = (uint32_t *)sss_atlas__take(&a->memory, size * size, sizeof *a->entry);
    table->area = (float *)sss_atlas__take(&a->memory, size * size, sizeof *table->area);
    table->mark = (unsigned char *)sss_atlas__take(&a->memory, size * size, 1);
    table->inner_first = (size_t *)sss_atlas__take(&a->memory, size + 1, sizeof *table->inner_first);
    table->border_first = (size_t *)sss_atlas__take(&a->memory, size + 1, sizeof *table->border_first);
    if (a->memory.failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    result = sss_atlas__make_bins(table, table->b->triangle_count, sss_atlas__triangle_rows);
    if (result != SSS_OK)
    {
        return result;
    }
    sss_atlas__for_bands(table, sss_atlas__cover_task);
    sss_atlas__drop_bins(table);
    result = table->border > 0 ? sss_atlas__find_borders(table) : SSS_OK;
    for (row = 0; row < size; row++)
    {
        table->inner_first[row + 1] += table->inner_first[row];
        table->border_first[row + 1] += table->border_first[row];
    }
    a->inner_count = table->inner_first[size];
    a->texel_count = a->inner_count + table->border_first[size];
    return result;
}

// The mesh with texture coordinates and the table of texels. normals may be NULL.
static sss_result sss_atlas__make_texels(const sss_atlas__build *b, const float *positions, const float *normals,
                                         sss_atlas *a)
{
    sss_atlas__texel_job table;
    float *own = NULL;
    sss_result result = sss_atlas__make_mesh(b, a);
    memset(&table, 0, sizeof table);
    table.b = b;
    table.a = a;
    table.size = b->options.size;
    table.border = b->options.border;
    table.positions = positions;
    if (result == SSS_OK && normals == NULL)
    {
        result = sss_atlas__make_normals(b, &a->memory, &own);
    }
    table.normals = normals != NULL ? normals : own;
    result = result == SSS_OK ? sss_atlas__find_texels(&table) : result;
    result = result == SSS_OK ? sss_atlas__take_entries(a) : result;
    if (result != SSS_OK)
    {
        return result;
    }
    sss_atlas__parallel(&b->memory.hooks, table.size, sss_atlas__entries_task, &table);
    sss_atlas__drop(&a->memory, own);
    sss_atlas__drop(&a->memory, table.area);
    sss_atlas__drop(&a->memory, table.mark);
    sss_atlas__drop(&a->memory, table.edge);
    sss_atlas__drop(&a->memory, table.inner_first);
    sss_atlas__drop(&a->memory, table.border_first);
    return sss_atlas__map_vertices(&table);
}

// ---- quality ----

static int sss_atlas__holds_center(const sss_atlas__texel_job *table, size_t triangle)
{
    sss_atlas__raster placed;
    size_t row, begin = 0, end = 0;
    sss_atlas__set_raster(table, triangle, &placed);
    for (row = placed.begin[1]; row < placed.end[1] && placed.twice > 0 && begin == end; row++)
    {
        sss_atlas__centers(&placed, row, &begin, &end);
    }
    return begin < end;
}

static void sss_atlas__measure_distortion(const sss_atlas__build *b, double surface, double texture,
                                          sss_atlas_stats *out)
{
    const double unit = 1.0 / ((double)SSS_ATLAS__UNITS * (double)SSS_ATLAS__UNITS);
    double squares = 0.0, largest = 0.0, angles = 0.0, within = 0.0, mean = 0.0;
    size_t t;
    out->area_distortion[0] = HUGE_VAL;
    out->area_distortion[2] = 0.0;
    for (t = 0; t < b->triangle_count; t++)
    {
        if (b->area[t] > 0.0)
        {
            const double ratio = sss_atlas__covered_area(b, t) * unit / texture * (surface / b->area[t]);
            double larger, smaller;
            const double stretch = sss_atlas__stretch_of(b, t, &larger, &smaller);
            const int seen = larger > 0.0 && smaller > 0.0;
            squares += seen ? stretch * stretch * (b->area[t] / surface) : HUGE_VAL;
            largest = seen ? sss_atlas__max(largest, larger) : HUGE_VAL;
            angles += seen ? 0.5 * (larger / smaller + smaller / larger) * (b->area[t] / surface) : HUGE_VAL;
            mean += ratio * (b->area[t] / surface);
            out->area_distortion[0] = sss_atlas__min(out->area_distortion[0], ratio);
            out->area_distortion[2] = sss_atlas__max(out->area_distortion[2], ratio);
            within += ratio <= 1.5 && ratio * 1.5 >= 1.0 ? b->area[t] / surface : 0.0;
        }
    }
    out->area_distortion[1] = mean;
    out->area_share_within = within;
    out->angle_distortion = angles;
    out->stretch_l2 = sqrt(squares * (texture / surface)); // Sander et al. 2001, section 3: over the sum of areas
    out->stretch_linf = largest * sqrt(texture / surface);
}

static sss_result sss_atlas__measure(const sss_atlas__build *b, sss_atlas *a)
{
    sss_atlas__texel_job table;
    sss_atlas_stats *stats = &a->stats;
    double surface, texture, sum = 0.0, unseen = 0.0;
    size_t i;
    memset(&table, 0, sizeof table);
    table.b = b;
    table.a = a;
    table.size = b->options.size;
    sss_atlas__areas(b, &surface, &texture);
    stats->utilisation = texture;
    stats->seam_mm = 0.0;
    stats->unseen_triangles = 0;
    for (i = 0; i < 3 * b->triangle_count; i++)
    {
        if (b->twin[i] != SSS_ATLAS__NONE && i < b->twin[i] && sss_atlas__is_boundary(b, i))
        {
            stats->seam_mm += sss_atlas__edge_length(b, (uint32_t)i);
        }
    }
    for (i = 0; i < b->triangle_count; i++)
    {
        if (!sss_atlas__holds_center(&table, i))
        {
            stats->unseen_triangles++;
            unseen += b->area[i];
        }
    }
    for (i = 0; i < a->inner_count; i++)
    {
        sum += (double)a->area[i];
    }
    stats->empty_texels = table.size * table.size - a->inner_count;
    stats->unseen_area = surface > 0.0 ? unseen / surface : 0.0;
    stats->texel_area_error = surface > 0.0 ? fabs(sum - surface) / surface : 0.0;
    if (surface > 0.0 && texture > 0.0)
    {
        sss_atlas__measure_distortion(b, surface, texture, stats);
    }
    return SSS_OK;
}

// ============================================== THE OBJECT =============================================

// ---- checks and options ----

#define SSS_ATLAS__MAX_SIZE 16384      // texels on a side: what GPUs take at most
#define SSS_ATLAS__SPLIT_ROUNDS 64     // of dividing charts that do not lie flat; then they fall into triangles
#define SSS_ATLAS__REPAIR_ROUNDS 6     // of dividing charts that rounding to the grid spoils
#define SSS_ATLAS__REPAIR_SPLITS 2     // of these, rounds in which they are divided; then bad triangles are taken out
#define SSS_ATLAS__PULL_REACH 3         // grid units: with those of sss_atlas__repair still within the slack of packing
#define SSS_ATLAS__PULL_MOST 64         // marked triangles of a chart that are looked at
#define SSS_ATLAS__FLOAT_MAX 3.40282346638528859811704183484516925e+38

static int sss_atlas__in_range(double x, double low, double high)
{
    return sss_atlas__finite(x) && x >= low && x <= high;
}

static int sss_atlas__all_finite(const float *values, size_t count)
{
    uint32_t bits;
    size_t i;
    for (i = 0; i < count; i++)
    {
        memcpy(&bits, values + i, sizeof bits);
        if ((bits & 0x7f800000u) == 0x7f800000u)
        {
            return 0;
        }
    }
    return 1;
}

static sss_result sss_atlas__check_mesh(const sss_mesh *mesh)
{
    size_t i;
    if (mesh == NULL || mesh->positions == NULL || mesh->triangles == NULL
        || !sss_atlas__in_range(mesh->mm_per_unit, 1e-100, 1e100))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (mesh->vertex_count == 0 || mesh->triangle_count == 0)
    {
        return SSS_ERROR_EMPTY;
    }
    // Corners and edges are numbered in 32 bits, with one number left for "none".
    if (mesh->vertex_count > UINT32_MAX - 64 || mesh->triangle_count > (UINT32_MAX - 64) / 3
        || mesh->triangle_count > SIZE_MAX / (4 * sizeof(sss_atlas__chart)))
    {
        return SSS_ERROR_OVERFLOW;
    }
    if (!sss_atlas__all_finite(mesh->positions, 3 * mesh->vertex_count)
        || (mesh->normals != NULL && !sss_atlas__all_finite(mesh->normals, 3 * mesh->vertex_count)))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < 3 * mesh->triangle_count; i++)
    {
        if (mesh->triangles[i] >= mesh->vertex_count)
        {
            return SSS_ERROR_INDEX;
        }
    }
    return SSS_OK;
}

// Whether options, with defaults filled in, are in range.
static int sss_atlas__valid_options(const sss_atlas_options *o)
{
    return sss_atlas__in_range(o->normal_deviation, 0.0, 85.0) && o->normal_deviation > 0.0
           && sss_atlas__in_range(o->compactness, 0.0, 10.0) && sss_atlas__in_range(o->max_area, 0.0, 1e300)
           && sss_atlas__in_range(o->texels_per_mm, 0.0, 1e300) && o->size <= SSS_ATLAS__MAX_SIZE
           && (o->size == 0 || o->texels_per_mm == 0.0) && o->border >= 0 && o->border <= 64 && o->gutter >= 1
           && o->gutter <= 128 && o->corners >= 3 && o->corners <= 64 && o->rotations >= 1 && o->rotations <= 64;
}

// Options as given, with defaults filled in: 0 means none in compactness, border, max_area and max_charts from here on.
// 0 where one is out of range.
static int sss_atlas__resolve(const sss_atlas_options *given, sss_atlas_options *out)
{
    if (given != NULL)
    {
        *out = *given;
    }
    else
    {
        memset(out, 0, sizeof *out);
    }
    if ((int)out->method < 0 || out->method > SSS_ATLAS_CONVEX || !sss_atlas__finite(out->compactness))
    {
        return 0;
    }
    if (out->normal_deviation == 0.0)
    {
        out->normal_deviation = out->method == SSS_ATLAS_ORTHOGRAPHIC ? 30.0 : 50.0;
    }
    out->compactness = out->compactness == 0.0 ? 1.0 : sss_atlas__max(out->compactness, 0.0);
    out->border = out->border == 0 ? 1 : out->border < 0 ? 0 : out->border;
    out->gutter = out->gutter == 0 ? 2 : out->gutter;
    out->corners = out->corners == 0 ? 8 : out->corners;
    out->rotations = out->rotations == 0 ? 8 : out->rotations;
    if (!sss_atlas__valid_options(out))
    {
        return 0;
    }
    out->gutter = out->gutter < 2 * out->border ? 2 * out->border : out->gutter;
    out->size = out->size == 0 && out->texels_per_mm == 0.0 ? 1024 : out->size;
    return 1;
}

// ---- hashes ----

#define SSS_ATLAS__HASH_START 14695981039346656037u // FNV-1a (Fowler, Noll, Vo), by words instead of bytes
#define SSS_ATLAS__HASH_PRIME 1099511628211u

// FNV-1a of words; the upper half is folded in so that it reaches the lower one as well. Each step is a bijection of
// the hash: no change of a single word goes unnoticed.
static uint64_t sss_atlas__mix(uint64_t hash, uint32_t word)
{
    hash = (hash ^ word) * SSS_ATLAS__HASH_PRIME;
    return hash ^ hash >> 32;
}

static uint64_t sss_atlas__mix_u64(uint64_t hash, uint64_t value)
{
    return sss_atlas__mix(sss_atlas__mix(hash, (uint32_t)(value & UINT32_MAX)), (uint32_t)(value >> 32));
}

static uint64_t sss_atlas__mix_floats(uint64_t hash, const float *values, size_t count)
{
    uint32_t word;
    size_t i;
    for (i = 0; i < count; i++)
    {
        memcpy(&word, values + i, sizeof word);
        hash = sss_atlas__mix(hash, word);
    }
    return hash;
}

// Of all that an atlas follows from, but its options.
static uint64_t sss_atlas__hash_mesh(const sss_mesh *mesh)
{
    uint64_t hash = SSS_ATLAS__HASH_START, unit;
    size_t i;
    memcpy(&unit, &mesh->mm_per_unit, sizeof unit);
    hash = sss_atlas__mix_u64(hash, mesh->vertex_count);
    hash = sss_atlas__mix_u64(hash, mesh->triangle_count);
    hash = sss_atlas__mix_u64(hash, unit);
    hash = sss_atlas__mix_floats(hash, mesh->positions, 3 * mesh->vertex_count);
    for (i = 0; i < 3 * mesh->triangle_count; i++)
    {
        hash = sss_atlas__mix(hash, mesh->triangles[i]);
    }
    hash = sss_atlas__mix(hash, mesh->normals != NULL ? 1u : 0u);
    return mesh->normals != NULL ? sss_atlas__mix_floats(hash, mesh->normals, 3 * mesh->vertex_count) : hash;
}

// ---- creating ----

// Next fraction to hooks.progress.
static sss_result sss_atlas__report(const sss_atlas__build *b, double fraction)
{
    const sss_hooks *hooks = &b->memory.hooks;
    return hooks->progress != NULL && hooks->progress(hooks->user, fraction) != 0 ? SSS_ERROR_CANCELLED : SSS_OK;
}

// Moves the mesh to the center of its box and scales it by a power of two, which rounds nothing, to a diagonal in
// [1, 2): squares and fourth powers of lengths stay far from both ends of double, whatever the unit.
static sss_result sss_atlas__set_frame(sss_atlas__build *b, const sss_mesh *mesh)
{
    double low[3], high[3], size[3], scale;
    size_t i;
    int exponent = 1, k;
    b->x = (double (*)[3])sss_atlas__take(&b->memory, b->vertex_count, sizeof *b->x);
    if (b->x == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (k = 0; k < 3; k++)
    {
        low[k] = high[k] = (double)mesh->positions[3 * (size_t)mesh->triangles[0] + (size_t)k];
    }
    for (i = 0; i < 3 * b->triangle_count; i++)
    {
        for (k = 0; k < 3; k++)
        {
            const double p = (double)mesh->positions[3 * (size_t)mesh->triangles[i] + (size_t)k];
            low[k] = sss_atlas__min(low[k], p);
            high[k] = sss_atlas__max(high[k], p);
        }
    }
    for (k = 0; k < 3; k++)
    {
        size[k] = high[k] - low[k];
    }
    if (sss_atlas__length(size) > 0.0)
    {
        frexp(sss_atlas__length(size), &exponent);
    }
    scale = ldexp(1.0, 1 - exponent);
    b->mm = ldexp(mesh->mm_per_unit, exponent - 1);
    for (i = 0; i < 3 * b->vertex_count; i++)
    {
        b->x[i / 3][i % 3] = ((double)mesh->positions[i] - 0.5 * (low[i % 3] + high[i % 3])) * scale;
    }
    return SSS_OK;
}

// Options that have a unit, in that of the build. Not to 0, which would mean something else.
static void sss_atlas__scale_options(sss_atlas__build *b)
{
    sss_atlas_options *o = &b->options;
    if (o->max_area > 0.0)
    {
        o->max_area = sss_atlas__min(sss_atlas__max(o->max_area / b->mm / b->mm, 1e-300), 1e300);
    }
    if (o->texels_per_mm > 0.0)
    {
        o->texels_per_mm = sss_atlas__min(sss_atlas__max(o->texels_per_mm * b->mm, 1e-300), 1e300);
    }
}

// Each triangle of a chart becomes a chart of its own.
static void sss_atlas__shatter(sss_atlas__build *b, const sss_atlas__chart *chart)
{
    uint32_t i;
    for (i = 1; i < chart->triangle_count; i++)
    {
        b->chart_of[b->chart_triangles[chart->first_triangle + i]] = (uint32_t)b->chart_count++;
    }
    b->split_count++;
}

// Lays charts flat and divides those that fail, until none does: a chart only ever gets fewer triangles, and one
// triangle always lies flat.   done  the fraction last reported
static sss_result sss_atlas__lay_all_flat(sss_atlas__build *b, double *done)
{
    sss_result result = SSS_OK;
    size_t c, failed = 1, round;
    for (round = 0; failed > 0 && result == SSS_OK; round++)
    {
        size_t chart_count;
        result = sss_atlas__gather_charts(b);
        result = result == SSS_OK ? sss_atlas__lay_flat(b) : result;
        chart_count = b->chart_count;
        failed = 0;
        for (c = 0; c < chart_count && result == SSS_OK; c++)
        {
            if (b->charts[c].is_flat || b->charts[c].triangle_count < 2)
            {
                continue;
            }
            failed++;
            if (round < SSS_ATLAS__SPLIT_ROUNDS)
            {
                result = sss_atlas__split_chart(b, (uint32_t)c);
            }
            else
            {
                sss_atlas__shatter(b, &b->charts[c]);
            }
        }
        *done += 0.15 * (0.8 - *done);
        result = result == SSS_OK ? sss_atlas__report(b, *done) : result;
    }
    return result;
}

// Triangles that the grid spoils: those turned over are marked like those that overlap.   left  how many there are
static sss_result sss_atlas__find_spoiled(sss_atlas__build *b, size_t *left, size_t *overlaps)
{
    size_t t;
    memset(b->bad, 0, b->triangle_count);
    *left = *overlaps = sss_atlas__count_overlaps(b); // marks them
    for (t = 0; t < b->triangle_count; t++)
    {
        if (sss_atlas__grid_area(b, t) < 0)
        {
            b->bad[t] = 1;
            ++*left;
        }
    }
    return b->memory.failed ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}

// How bad the triangles around a vertex are: turned over, without area, or on a marked one of their chart.
static size_t sss_atlas__overlap_fault(const sss_atlas__build *b, const uint32_t *star, size_t count,
                                       const uint32_t *marked, size_t marked_count)
{
    size_t fault = sss_atlas__star_fault(b, star, count), i, j;
    for (i = 0; i < count; i++)
    {
        int32_t a[3][2], c[3][2];
        for (j = 0; j < marked_count && sss_atlas__grid_corners(b, star[i], a); j++)
        {
            fault += marked[j] != star[i] && sss_atlas__grid_corners(b, marked[j], c)
                     && sss_atlas__interiors_meet((const int32_t (*)[2])a, (const int32_t (*)[2])c);
        }
    }
    return fault;
}

// Moves a vertex to the nearest grid point where less is wrong around it.   home  where it was at first
static int sss_atlas__pull_vertex(sss_atlas__build *b, uint32_t vertex, const int32_t home[2], const uint32_t *star,
                                  size_t count, const uint32_t *marked, size_t marked_count)
{
    const int32_t was[2] = {b->grid[vertex][0], b->grid[vertex][1]};
    const size_t before = sss_atlas__overlap_fault(b, star, count, marked, marked_count);
    int32_t reach, dx, dy;
    for (reach = 1; reach <= SSS_ATLAS__PULL_REACH && before > 0; reach++)
    {
        for (dy = -reach; dy <= reach; dy++)
        {
            for (dx = -reach; dx <= reach; dx += dy == -reach || dy == reach ? 1 : 2 * reach)
            {
                const int32_t x = home[0] + dx, y = home[1] + dy;
                if (x < 0 || y < 0 || x > SSS_ATLAS__UNITS || y > SSS_ATLAS__UNITS)
                {
                    continue;
                }
                b->grid[vertex][0] = x;
                b->grid[vertex][1] = y;
                if (sss_atlas__overlap_fault(b, star, count, marked, marked_count) < before)
                {
                    return 1;
                }
            }
        }
    }
    b->grid[vertex][0] = was[0];
    b->grid[vertex][1] = was[1];
    return 0;
}

// Holes and slits may be laid out as thin as needles, and rounding may lay one side over the other without turning any
// triangle over: corners of marked triangles are moved by a few grid units where that parts them.
static sss_result sss_atlas__pull_apart(sss_atlas__build *b)
{
    sss_atlas__memory *m = &b->memory;
    uint32_t *first = (uint32_t *)sss_atlas__take(m, b->atlas_vertex_count + 1, sizeof *first);
    uint32_t *around = (uint32_t *)sss_atlas__take(m, 3 * b->triangle_count, sizeof *around);
    int32_t (*home)[2] = (int32_t (*)[2])sss_atlas__take(m, b->atlas_vertex_count, sizeof *home);
    size_t c, i;
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    memcpy(home, b->grid, b->atlas_vertex_count * sizeof *home);
    sss_atlas__gather_stars(b, first, around);
    for (c = 0; c < b->chart_count; c++)
    {
        const uint32_t *triangles = b->chart_triangles + b->charts[c].first_triangle;
        uint32_t marked[SSS_ATLAS__PULL_MOST];
        size_t count = 0, pass, moved = 1;
        for (i = 0; i < b->charts[c].triangle_count && count < SSS_ATLAS__PULL_MOST; i++)
        {
            marked[count] = triangles[i];
            count += b->bad[triangles[i]] != 0;
        }
        for (pass = 0; pass < SSS_ATLAS__REPAIR_PASSES && moved > 0; pass++)
        {
            for (moved = 0, i = 0; i < 3 * count; i++)
            {
                const uint32_t v = b->corner[3 * (size_t)marked[i / 3] + i % 3];
                const size_t star = first[v + 1] - first[v];
                moved += star <= SSS_ATLAS__REPAIR_STAR
                         && sss_atlas__pull_vertex(b, v, home[v], around + first[v], star, marked, count);
            }
        }
    }
    sss_atlas__drop(m, home);
    sss_atlas__drop(m, around);
    sss_atlas__drop(m, first);
    return SSS_OK;
}

// Divides charts that have marked triangles or, in later rounds, makes each of these a chart of its own.
//   changed  how many charts were
static sss_result sss_atlas__separate_spoiled(sss_atlas__build *b, size_t round, size_t *changed)
{
    const size_t chart_count = b->chart_count;
    sss_result result = SSS_OK;
    size_t c;
    *changed = 0;
    for (c = 0; c < chart_count && result == SSS_OK; c++)
    {
        const sss_atlas__chart *chart = &b->charts[c];
        uint32_t i, found = 0;
        for (i = 0; i < chart->triangle_count && chart->triangle_count > 1; i++)
        {
            const uint32_t t = b->chart_triangles[chart->first_triangle + i];
            if (b->bad[t])
            {
                found++;
                if (round >= SSS_ATLAS__REPAIR_SPLITS && found < chart->triangle_count) // one stays
                {
                    b->chart_of[t] = (uint32_t)b->chart_count++;
                }
            }
        }
        *changed += found > 0;
        if (found > 0 && round < SSS_ATLAS__REPAIR_SPLITS)
        {
            result = sss_atlas__split_chart(b, (uint32_t)c);
        }
        else if (found > 0)
        {
            b->split_count++;
        }
    }
    return result;
}

// Charts flat and packed, none spoiled by the rounding of texture coordinates.
static sss_result sss_atlas__lay_out(sss_atlas__build *b, double *done, size_t *overlaps)
{
    const size_t size = b->options.size;
    sss_result result = SSS_OK;
    size_t round, left = 1, changed = 1;
    for (round = 0; round < SSS_ATLAS__REPAIR_ROUNDS && left > 0 && changed > 0 && result == SSS_OK; round++)
    {
        result = sss_atlas__lay_all_flat(b, done);
        b->options.size = size; // packing puts its own into a 0
        result = result == SSS_OK ? sss_atlas__pack(b) : result;
        *done += 0.5 * (0.8 - *done);
        result = result == SSS_OK ? sss_atlas__report(b, *done) : result;
        result = result == SSS_OK ? sss_atlas__repair(b, &left) : result;
        result = result == SSS_OK ? sss_atlas__find_spoiled(b, &left, overlaps) : result;
        if (result == SSS_OK && *overlaps > 0)
        {
            result = sss_atlas__pull_apart(b);
            result = result == SSS_OK ? sss_atlas__find_spoiled(b, &left, overlaps) : result;
        }
        if (result == SSS_OK && left > 0 && round + 1 < SSS_ATLAS__REPAIR_ROUNDS)
        {
            result = sss_atlas__separate_spoiled(b, round, &changed);
        }
    }
    return result;
}

// From the unit of the build to mm^2. What float cannot hold becomes its largest number. What rounding takes is given
// to the next one where sums count.
static void sss_atlas__scale_floats(float *values, size_t count, double scale, int carries)
{
    double carry = 0.0;
    size_t i;
    for (i = 0; i < count; i++)
    {
        double exact = sss_atlas__min((double)values[i] * scale, SSS_ATLAS__FLOAT_MAX);
        if (fabs(carry) <= SSS_ATLAS__HALF_ULP * exact) // never more than rounding itself, however small the value
        {
            exact += carry;
            carry = 0.0;
        }
        values[i] = (float)sss_atlas__min(exact, SSS_ATLAS__FLOAT_MAX);
        carry = carries ? carry + exact - (double)values[i] : 0.0;
    }
}

// Results in mm, and what the stats say of the options.
static void sss_atlas__finish(const sss_atlas__build *b, const sss_atlas_options *options, sss_atlas *a)
{
    sss_atlas_stats *s = &a->stats;
    const double mm2 = b->mm * b->mm;
    double surface = 0.0, texels = 0.0;
    size_t i;
    sss_atlas__scale_floats(a->area, a->inner_count, mm2, 1);
    sss_atlas__scale_floats(a->area_ratio, a->texel_count, mm2, 0);
    sss_atlas__scale_floats(a->triangle_area_ratio, b->triangle_count, mm2, 0);
    for (i = 0; i < b->triangle_count; i++)
    {
        surface += b->area[i];
    }
    for (i = 0; i < a->inner_count; i++)
    {
        texels += (double)a->area[i];
    }
    s->texel_area_error = surface > 0.0 ? fabs(texels / mm2 / surface - 1.0) : 0.0; // as the caller will see them
    s->seam_mm *= b->mm;
    s->normal_deviation = options->normal_deviation;
    s->compactness = options->compactness;
    s->max_area = options->max_area;
    s->max_charts = options->max_charts;
    s->size = b->options.size;
    s->texels_per_mm = b->texels_per_mm / b->mm;
    s->border = options->border;
    s->gutter = options->gutter;
    s->corners = options->corners;
    s->rotations = options->rotations;
    s->method = options->method;
    s->triangle_count = b->triangle_count;
    s->vertex_count = b->vertex_count;
    s->chart_count = b->chart_count;
    s->split_count = b->split_count;
    s->atlas_vertex_count = b->atlas_vertex_count;
    s->bytes = a->memory.bytes;
}

static sss_result sss_atlas__run(sss_atlas__build *b, const sss_mesh *mesh, sss_atlas *a)
{
    const sss_atlas_options options = b->options; // in mm
    double done = 0.2;
    size_t overlaps = 0;
    sss_result result = sss_atlas__report(b, 0.0);
    result = result == SSS_OK ? sss_atlas__set_frame(b, mesh) : result;
    if (result == SSS_OK)
    {
        sss_atlas__scale_options(b);
        result = sss_atlas__prepare(b);
    }
    result = result == SSS_OK ? sss_atlas__report(b, 0.05) : result;
    result = result == SSS_OK ? sss_atlas__grow_charts(b) : result;
    result = result == SSS_OK ? sss_atlas__report(b, done) : result;
    result = result == SSS_OK ? sss_atlas__lay_out(b, &done, &overlaps) : result;
    result = result == SSS_OK ? sss_atlas__report(b, 0.8) : result;
    if (result == SSS_OK)
    {
        a->stats.size = b->options.size;
        result = sss_atlas__make_texels(b, mesh->positions, mesh->normals, a);
    }
    result = result == SSS_OK ? sss_atlas__report(b, 0.9) : result;
    result = result == SSS_OK ? sss_atlas__measure(b, a) : result;
    if (result == SSS_OK)
    {
        a->stats.overlaps = overlaps;
        sss_atlas__finish(b, &options, a);
        result = sss_atlas__report(b, 1.0);
    }
    return result;
}

// The object lies in its own memory. NULL where there is none.
static sss_atlas *sss_atlas__new(const sss_hooks *hooks)
{
    sss_atlas__memory memory;
    sss_atlas *a;
    memset(&memory, 0, sizeof memory);
    if (hooks != NULL)
    {
        memory.hooks = *hooks;
    }
    a = (sss_atlas *)sss_atlas__take(&memory, 1, sizeof *a);
    if (a != NULL)
    {
        a->memory = memory;
    }
    return a;
}

SSS_ATLAS_API void sss_atlas_free(sss_atlas *atlas)
{
    if (atlas != NULL)
    {
        sss_atlas__memory memory = atlas->memory; // freed with the rest
        sss_atlas__drop_all(&memory);
    }
}

static int sss_atlas__valid_hooks(const sss_hooks *hooks)
{
    return hooks == NULL || hooks->allocate == NULL || hooks->release != NULL;
}

SSS_ATLAS_API sss_result sss_atlas_create(const sss_mesh *mesh, const sss_atlas_options *options,
                                          const sss_hooks *hooks, sss_atlas **out)
{
    sss_atlas__build build;
    sss_atlas *a;
    sss_result result = sss_atlas__check_mesh(mesh);
    if (result != SSS_OK)
    {
        return result;
    }
    memset(&build, 0, sizeof build);
    if (out == NULL || !sss_atlas__valid_hooks(hooks) || !sss_atlas__resolve(options, &build.options))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    a = sss_atlas__new(hooks);
    if (a == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    build.memory.hooks = a->memory.hooks;
    build.vertex_count = mesh->vertex_count;
    build.triangle_count = mesh->triangle_count;
    build.triangles = mesh->triangles;
    result = sss_atlas__run(&build, mesh, a);
    sss_atlas__drop_all(&build.memory);
    if (result != SSS_OK)
    {
        sss_atlas_free(a);
        return result;
    }
    a->mesh_hash = sss_atlas__hash_mesh(mesh);
    *out = a;
    return SSS_OK;
}

// ---- reading ----

SSS_ATLAS_API sss_result sss_atlas_get_stats(const sss_atlas *atlas, sss_atlas_stats *out)
{
    if (atlas == NULL || out == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    *out = atlas->stats;
    return SSS_OK;
}

SSS_ATLAS_API sss_result sss_atlas_get_mesh(const sss_atlas *atlas, sss_atlas_mesh *out)
{
    if (atlas == NULL || out == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    out->vertex_count = atlas->stats.atlas_vertex_count;
    out->triangle_count = atlas->stats.triangle_count;
    out->chart_count = atlas->stats.chart_count;
    out->uv = atlas->uv[0];
    out->vertex = atlas->vertex;
    out->triangles = atlas->triangles;
    out->chart = atlas->chart;
    out->stretch = atlas->stretch;
    out->area_ratio = atlas->triangle_area_ratio;
    out->chart_normal = atlas->chart_normal[0];
    return SSS_OK;
}

SSS_ATLAS_API sss_result sss_atlas_get_texels(const sss_atlas *atlas, sss_atlas_texels *out)
{
    if (atlas == NULL || out == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    out->size = atlas->stats.size;
    out->count = atlas->texel_count;
    out->inner_count = atlas->inner_count;
    out->texel = atlas->texel;
    out->triangle = atlas->texel_triangle;
    out->barycentric = atlas->barycentric[0];
    out->position = atlas->position[0];
    out->normal = atlas->normal[0];
    out->area = atlas->area;
    out->area_ratio = atlas->area_ratio;
    out->entry = atlas->entry;
    out->vertex_entry = atlas->vertex_entry;
    out->entry_vertex = atlas->entry_vertex;
    return SSS_OK;
}

// ---- images ----

// Texels on their way from empty to filled.
enum
{
    SSS_ATLAS__EMPTY = 0,
    SSS_ATLAS__QUEUED,
    SSS_ATLAS__FILLED
};

typedef struct sss_atlas__fill
{
    float *image;          // [size][size][channels]
    size_t size, channels;
    unsigned char *state;  // [size][size]
    uint32_t *queue;       // [size][size] empty texels in the order in which they are filled
    size_t queued;
} sss_atlas__fill;

// The box of a texel and its neighbours, inside of the image: [low, high) along u and v.
static void sss_atlas__neighbours(size_t texel, size_t size, size_t low[2], size_t high[2])
{
    const size_t at[2] = {texel % size, texel / size};
    int i;
    for (i = 0; i < 2; i++)
    {
        low[i] = at[i] > 0 ? at[i] - 1 : 0;
        high[i] = at[i] + 2 < size ? at[i] + 2 : size;
    }
}

static void sss_atlas__queue_neighbours(sss_atlas__fill *f, size_t texel)
{
    size_t low[2], high[2], u, v;
    sss_atlas__neighbours(texel, f->size, low, high);
    for (v = low[1]; v < high[1]; v++)
    {
        for (u = low[0]; u < high[0]; u++)
        {
            if (f->state[v * f->size + u] == SSS_ATLAS__EMPTY)
            {
                f->state[v * f->size + u] = SSS_ATLAS__QUEUED;
                f->queue[f->queued++] = (uint32_t)(v * f->size + u);
            }
        }
    }
}

static void sss_atlas__fill_texel(const sss_atlas__fill *f, size_t texel)
{
    size_t low[2], high[2], u, v, c;
    sss_atlas__neighbours(texel, f->size, low, high);
    for (c = 0; c < f->channels; c++)
    {
        double sum = 0.0, count = 0.0;
        for (v = low[1]; v < high[1]; v++)
        {
            for (u = low[0]; u < high[0]; u++)
            {
                const size_t i = v * f->size + u;
                if (f->state[i] == SSS_ATLAS__FILLED)
                {
                    sum += (double)f->image[i * f->channels + c];
                    count += 1.0;
                }
            }
        }
        f->image[texel * f->channels + c] = (float)(sum / count); // one at least: it was queued by it
    }
}

SSS_ATLAS_API sss_result sss_atlas_fill_image(const sss_atlas *atlas, const float *values, size_t channels,
                                              size_t rings, float *image)
{
    sss_atlas__memory memory;
    sss_atlas__fill f;
    size_t i, ring, begin = 0, end;
    if (atlas == NULL || values == NULL || image == NULL || channels < 1 || channels > 16 || rings > 1024
        || !sss_atlas__all_finite(values, channels * atlas->texel_count))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    memset(&memory, 0, sizeof memory);
    memory.hooks = atlas->memory.hooks;
    f.image = image;
    f.size = atlas->stats.size;
    f.channels = channels;
    f.queued = 0;
    f.state = (unsigned char *)sss_atlas__take(&memory, f.size * f.size, 1);
    f.queue = (uint32_t *)sss_atlas__take(&memory, f.size * f.size, sizeof *f.queue);
    if (f.state == NULL || f.queue == NULL)
    {
        sss_atlas__drop_all(&memory);
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    memset(image, 0, f.size * f.size * channels * sizeof *image);
    for (i = 0; i < atlas->texel_count; i++)
    {
        memcpy(image + atlas->texel[i] * channels, values + i * channels, channels * sizeof *image);
        f.state[atlas->texel[i]] = SSS_ATLAS__FILLED;
    }
    for (i = 0; i < atlas->texel_count && rings > 0; i++)
    {
        sss_atlas__queue_neighbours(&f, atlas->texel[i]);
    }
    for (ring = 0; ring < rings && begin < f.queued; ring++)
    {
        end = f.queued; // a ring sees only what lies within it
        for (i = begin; i < end; i++)
        {
            sss_atlas__fill_texel(&f, f.queue[i]);
        }
        for (i = begin; i < end; i++)
        {
            f.state[f.queue[i]] = SSS_ATLAS__FILLED;
        }
        for (i = begin; i < end; i++)
        {
            sss_atlas__queue_neighbours(&f, f.queue[i]);
        }
        begin = end;
    }
    sss_atlas__drop_all(&memory);
    return SSS_OK;
}

// Texels on both sides of a texture coordinate, clamped at the edge, and the weight of the second one.
static double sss_atlas__bracket(double coordinate, size_t size, size_t texels[2])
{
    const double last = (double)(size - 1);
    const double x = sss_atlas__min(sss_atlas__max(coordinate * (double)size - 0.5, 0.0), last);
    texels[0] = (size_t)x;
    texels[1] = texels[0] + 1 < size ? texels[0] + 1 : texels[0];
    return x - (double)texels[0];
}

static void sss_atlas__fetch_point(const sss_atlas *a, const float *image, size_t channels, size_t triangle,
                                   const float barycentric[3], float *out)
{
    size_t texels[2][2], c; // along u and v
    double weight[2];
    int i, k;
    for (i = 0; i < 2; i++)
    {
        double coordinate = 0.0;
        for (k = 0; k < 3; k++)
        {
            coordinate += (double)barycentric[k] * (double)a->uv[a->triangles[3 * triangle + (size_t)k]][i];
        }
        weight[i] = sss_atlas__bracket(coordinate, a->stats.size, texels[i]);
    }
    for (c = 0; c < channels; c++)
    {
        double rows[2];
        for (i = 0; i < 2; i++)
        {
            const float *row = image + texels[1][i] * a->stats.size * channels + c;
            rows[i] = (1.0 - weight[0]) * (double)row[texels[0][0] * channels]
                      + weight[0] * (double)row[texels[0][1] * channels];
        }
        out[c] = (float)((1.0 - weight[1]) * rows[0] + weight[1] * rows[1]);
    }
}

SSS_ATLAS_API sss_result sss_atlas_fetch(const sss_atlas *atlas, const float *image, size_t channels,
                                         const uint32_t *triangle, const float *barycentric, size_t count, float *out)
{
    size_t i;
    if (atlas == NULL || image == NULL || triangle == NULL || barycentric == NULL || out == NULL || channels < 1
        || channels > 16 || count > SIZE_MAX / (16 * sizeof(float)) || !sss_atlas__all_finite(barycentric, 3 * count))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < count; i++)
    {
        if (triangle[i] >= atlas->stats.triangle_count)
        {
            return SSS_ERROR_INDEX;
        }
    }
    for (i = 0; i < count; i++)
    {
        sss_atlas__fetch_point(atlas, image, channels, triangle[i], barycentric + 3 * i, out + i * channels);
    }
    return SSS_OK;
}

// ---- keeping ----
// The format: words of 32 bits, little-endian, whatever the machine; numbers of 64 bits as two words, the lower one
// first. A header with its own check, the arrays in the order of struct sss_atlas, a check of everything.

#define SSS_ATLAS__MAGIC_LOW 0x41535353u  // "SSSA"
#define SSS_ATLAS__MAGIC_HIGH 0x53414c54u // "TLAS"
#define SSS_ATLAS__FORMAT 1u
#define SSS_ATLAS__ENDIAN 0x01020304u
#define SSS_ATLAS__STREAM_WORDS 4096      // handed to the callbacks at a time, at most
#define SSS_ATLAS__LOAD_WORDS 262144      // first allocated for an array that is read: it grows only with what comes

// Saving and loading go through the same functions, so that they cannot disagree.
typedef struct sss_atlas__stream
{
    sss_atlas_write write; // NULL: loading
    sss_atlas_read read;
    void *user;
    uint64_t check;        // of all words so far
    sss_result result;     // of what was done so far: from the first error on nothing is done
    size_t pending;        // words to be written
    unsigned char bytes[4 * SSS_ATLAS__STREAM_WORDS];
} sss_atlas__stream;

static void sss_atlas__fail(sss_atlas__stream *s, sss_result result)
{
    s->result = s->result == SSS_OK ? result : s->result;
}

static void sss_atlas__flush(sss_atlas__stream *s)
{
    if (s->write != NULL && s->pending > 0 && s->result == SSS_OK
        && s->write(s->user, s->bytes, 4 * s->pending) != 0)
    {
        s->result = SSS_ERROR_CANCELLED;
    }
    s->pending = 0;
}

// Writes words, or reads them.   words  [count] of 32 bits, any type
static void sss_atlas__move_words(sss_atlas__stream *s, void *words, size_t count)
{
    unsigned char *place = (unsigned char *)words;
    size_t i;
    while (count > 0 && s->result == SSS_OK)
    {
        const size_t room = SSS_ATLAS__STREAM_WORDS - (s->write != NULL ? s->pending : 0);
        const size_t n = count < room ? count : room;
        unsigned char *bytes = s->bytes + (s->write != NULL ? 4 * s->pending : 0);
        if (s->write == NULL && s->read(s->user, bytes, 4 * n) != 0)
        {
            s->result = SSS_ERROR_BAD_DATA;
            return;
        }
        for (i = 0; i < n; i++, bytes += 4, place += 4)
        {
            uint32_t word;
            if (s->write != NULL)
            {
                memcpy(&word, place, sizeof word);
                bytes[0] = (unsigned char)(word & 255u);
                bytes[1] = (unsigned char)(word >> 8 & 255u);
                bytes[2] = (unsigned char)(word >> 16 & 255u);
                bytes[3] = (unsigned char)(word >> 24);
            }
            else
            {
                word = (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16
                       | (uint32_t)bytes[3] << 24;
                memcpy(place, &word, sizeof word);
            }
            s->check = sss_atlas__mix(s->check, word);
        }
        s->pending += n;
        if (s->pending == SSS_ATLAS__STREAM_WORDS || s->write == NULL)
        {
            sss_atlas__flush(s);
        }
        count -= n;
    }
}

static void sss_atlas__move_u64(sss_atlas__stream *s, uint64_t *value)
{
    uint32_t words[2];
    words[0] = (uint32_t)(*value & UINT32_MAX);
    words[1] = (uint32_t)(*value >> 32);
    sss_atlas__move_words(s, words, 2);
    *value = (uint64_t)words[0] | (uint64_t)words[1] << 32;
}

static void sss_atlas__move_size(sss_atlas__stream *s, size_t *value)
{
    uint64_t wide = *value;
    sss_atlas__move_u64(s, &wide);
    if (wide > SIZE_MAX)
    {
        sss_atlas__fail(s, SSS_ERROR_BAD_DATA);
        return;
    }
    *value = (size_t)wide;
}

static void sss_atlas__move_int(sss_atlas__stream *s, int *value)
{
    uint32_t word = (uint32_t)*value;
    sss_atlas__move_words(s, &word, 1);
    if (word > 65535) // none is as large
    {
        sss_atlas__fail(s, SSS_ERROR_BAD_DATA);
        return;
    }
    *value = (int)word;
}

static void sss_atlas__move_double(sss_atlas__stream *s, double *value)
{
    uint64_t bits;
    memcpy(&bits, value, sizeof bits);
    sss_atlas__move_u64(s, &bits);
    if ((bits & 0x7fffffffffffffffu) > 0x7ff0000000000000u) // not a number; stretch may be infinite
    {
        sss_atlas__fail(s, SSS_ERROR_BAD_DATA);
        return;
    }
    memcpy(value, &bits, sizeof bits);
}

// A word that has to be there.
static void sss_atlas__move_constant(sss_atlas__stream *s, uint32_t constant, sss_result otherwise)
{
    uint32_t word = constant;
    sss_atlas__move_words(s, &word, 1);
    if (word != constant)
    {
        sss_atlas__fail(s, otherwise);
    }
}

// The check of all that came before.
static void sss_atlas__move_check(sss_atlas__stream *s)
{
    const uint64_t check = s->check;
    uint64_t found = check;
    sss_atlas__move_u64(s, &found);
    if (found != check)
    {
        sss_atlas__fail(s, SSS_ERROR_BAD_DATA);
    }
}

static void sss_atlas__move_stats(sss_atlas__stream *s, sss_atlas_stats *stats)
{
    double *const doubles[] = {&stats->normal_deviation, &stats->compactness, &stats->max_area, &stats->texels_per_mm,
                               &stats->seam_mm, &stats->utilisation, &stats->stretch_l2, &stats->stretch_linf,
                               &stats->area_distortion[0], &stats->area_distortion[1], &stats->area_distortion[2],
                               &stats->area_share_within, &stats->angle_distortion, &stats->unseen_area,
                               &stats->texel_area_error};
    size_t *const sizes[] = {&stats->max_charts, &stats->size, &stats->triangle_count, &stats->vertex_count,
                             &stats->chart_count, &stats->split_count, &stats->atlas_vertex_count, &stats->overlaps,
                             &stats->empty_texels, &stats->unseen_triangles};
    int *const ints[] = {&stats->border, &stats->gutter, &stats->corners, &stats->rotations};
    int method = (int)stats->method;
    size_t i;
    for (i = 0; i < sizeof doubles / sizeof doubles[0]; i++)
    {
        sss_atlas__move_double(s, doubles[i]);
    }
    for (i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
    {
        sss_atlas__move_size(s, sizes[i]);
    }
    for (i = 0; i < sizeof ints / sizeof ints[0]; i++)
    {
        sss_atlas__move_int(s, ints[i]);
    }
    sss_atlas__move_int(s, &method);
    if (method > (int)SSS_ATLAS_CONVEX)
    {
        sss_atlas__fail(s, SSS_ERROR_BAD_DATA);
        return;
    }
    stats->method = (sss_atlas_method)method;
}

static void sss_atlas__move_header(sss_atlas__stream *s, sss_atlas *a)
{
    sss_atlas__move_constant(s, SSS_ATLAS__MAGIC_LOW, SSS_ERROR_BAD_DATA);
    sss_atlas__move_constant(s, SSS_ATLAS__MAGIC_HIGH, SSS_ERROR_BAD_DATA);
    sss_atlas__move_constant(s, SSS_ATLAS__FORMAT, SSS_ERROR_BAD_VERSION);
    sss_atlas__move_constant(s, SSS_ATLAS__ENDIAN, SSS_ERROR_BAD_VERSION);
    sss_atlas__move_u64(s, &a->mesh_hash);
    sss_atlas__move_stats(s, &a->stats);
    sss_atlas__move_size(s, &a->texel_count);
    sss_atlas__move_size(s, &a->inner_count);
    sss_atlas__move_check(s);
}

// What an array may hold.
typedef enum sss_atlas__content
{
    SSS_ATLAS__FINITE = 0,
    SSS_ATLAS__FINITE_OR_INFINITY,
    SSS_ATLAS__INDEX, // below a bound
    SSS_ATLAS__INDEX_OR_NONE
} sss_atlas__content;

static int sss_atlas__valid_word(uint32_t word, sss_atlas__content content, size_t bound)
{
    switch (content)
    {
    case SSS_ATLAS__FINITE:             return (word & 0x7f800000u) != 0x7f800000u;
    case SSS_ATLAS__FINITE_OR_INFINITY: return (word & 0x7f800000u) != 0x7f800000u || word == 0x7f800000u;
    case SSS_ATLAS__INDEX:              return word < bound;
    case SSS_ATLAS__INDEX_OR_NONE:      return word < bound || word == SSS_ATLAS__NONE;
    }
    return 0;
}

// An array of `count` words, which are checked as they are read; the array returned is the object's. Memory grows with
// what has been read: a count that lies costs nothing.
static void *sss_atlas__move_array(sss_atlas__stream *s, sss_atlas *a, void *array, size_t count,
                                   sss_atlas__content content, size_t bound)
{
    unsigned char *words = (unsigned char *)array;
    size_t done = 0, room = 0, i;
    if (s->write != NULL)
    {
        sss_atlas__move_words(s, array, count);
        return array;
    }
    do
    {
        void *more;
        room = room == 0 ? SSS_ATLAS__LOAD_WORDS : 2 * room;
        room = room < count ? room : count;
        more = s->result == SSS_OK ? sss_atlas__take(&a->memory, room, 4) : NULL;
        if (more == NULL)
        {
            sss_atlas__fail(s, SSS_ERROR_OUT_OF_MEMORY);
            return NULL;
        }
        if (words != NULL)
        {
            memcpy(more, words, 4 * done);
            sss_atlas__drop(&a->memory, words);
        }
        words = (unsigned char *)more;
        sss_atlas__move_words(s, words + 4 * done, room - done);
        for (i = done; i < room && s->result == SSS_OK; i++)
        {
            uint32_t word;
            memcpy(&word, words + 4 * i, sizeof word);
            if (!sss_atlas__valid_word(word, content, bound))
            {
                sss_atlas__fail(s, SSS_ERROR_BAD_DATA);
            }
        }
        done = room;
    } while (done < count && s->result == SSS_OK);
    return words;
}

static void sss_atlas__move_arrays(sss_atlas__stream *s, sss_atlas *a)
{
    const size_t V = a->stats.vertex_count, T = a->stats.triangle_count, A = a->stats.atlas_vertex_count;
    const size_t C = a->stats.chart_count, texels = a->stats.size * a->stats.size, n = a->texel_count;
    const sss_atlas__content finite = SSS_ATLAS__FINITE, any = SSS_ATLAS__FINITE_OR_INFINITY;
    const sss_atlas__content index = SSS_ATLAS__INDEX, none = SSS_ATLAS__INDEX_OR_NONE;
    a->uv = (float (*)[2])sss_atlas__move_array(s, a, a->uv, 2 * A, finite, 0);
    a->vertex = (uint32_t *)sss_atlas__move_array(s, a, a->vertex, A, index, V);
    a->triangles = (uint32_t *)sss_atlas__move_array(s, a, a->triangles, 3 * T, index, A);
    a->chart = (uint32_t *)sss_atlas__move_array(s, a, a->chart, T, index, C);
    a->stretch = (float *)sss_atlas__move_array(s, a, a->stretch, T, any, 0);
    a->triangle_area_ratio = (float *)sss_atlas__move_array(s, a, a->triangle_area_ratio, T, finite, 0);
    a->chart_normal = (float (*)[3])sss_atlas__move_array(s, a, a->chart_normal, 3 * C, finite, 0);
    a->texel = (uint32_t *)sss_atlas__move_array(s, a, a->texel, n, index, texels);
    a->texel_triangle = (uint32_t *)sss_atlas__move_array(s, a, a->texel_triangle, n, index, T);
    a->barycentric = (float (*)[3])sss_atlas__move_array(s, a, a->barycentric, 3 * n, finite, 0);
    a->position = (float (*)[3])sss_atlas__move_array(s, a, a->position, 3 * n, finite, 0);
    a->normal = (float (*)[3])sss_atlas__move_array(s, a, a->normal, 3 * n, finite, 0);
    a->area = (float *)sss_atlas__move_array(s, a, a->area, n, finite, 0);
    a->area_ratio = (float *)sss_atlas__move_array(s, a, a->area_ratio, n, finite, 0);
    a->entry = (uint32_t *)sss_atlas__move_array(s, a, a->entry, texels, none, n);
    a->vertex_entry = (uint32_t *)sss_atlas__move_array(s, a, a->vertex_entry, V, none, n);
    a->entry_vertex = (uint32_t *)sss_atlas__move_array(s, a, a->entry_vertex, n, index, V);
    sss_atlas__move_check(s);
    sss_atlas__flush(s);
}

static void sss_atlas__open(sss_atlas__stream *s, sss_atlas_write write, sss_atlas_read read, void *user)
{
    s->write = write;
    s->read = read;
    s->user = user;
    s->check = SSS_ATLAS__HASH_START;
    s->result = SSS_OK;
    s->pending = 0;
}

SSS_ATLAS_API sss_result sss_atlas_save(const sss_atlas *atlas, sss_atlas_write write, void *user)
{
    sss_atlas__stream stream;
    sss_atlas copy; // its arrays are the same and are only read
    if (atlas == NULL || write == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    copy = *atlas;
    sss_atlas__open(&stream, write, NULL, user);
    sss_atlas__move_header(&stream, &copy);
    sss_atlas__move_arrays(&stream, &copy);
    return stream.result;
}

// Counts that fit together and to the mesh.
static int sss_atlas__valid_counts(const sss_atlas *a, const sss_mesh *mesh)
{
    const sss_atlas_stats *s = &a->stats;
    return s->triangle_count == mesh->triangle_count && s->vertex_count == mesh->vertex_count && s->chart_count > 0
           && s->chart_count <= s->triangle_count && s->atlas_vertex_count > 0
           && s->atlas_vertex_count <= 3 * s->triangle_count && s->size > 0 && s->size <= SSS_ATLAS__MAX_SIZE
           && a->texel_count <= s->size * s->size && a->inner_count <= a->texel_count;
}

// Entries and texels point at each other, and corners at the mesh's vertices.
static int sss_atlas__is_consistent(const sss_atlas *a, const sss_mesh *mesh)
{
    const size_t texels = a->stats.size * a->stats.size;
    size_t i, found = 0;
    for (i = 0; i < texels; i++)
    {
        found += a->entry[i] != SSS_ATLAS__NONE ? 1 : 0;
    }
    if (found != a->texel_count)
    {
        return 0;
    }
    for (i = 0; i < a->texel_count; i++)
    {
        if (a->entry[a->texel[i]] != i)
        {
            return 0;
        }
    }
    for (i = 0; i < 3 * mesh->triangle_count; i++)
    {
        if (a->vertex[a->triangles[i]] != mesh->triangles[i])
        {
            return 0;
        }
    }
    return 1;
}

SSS_ATLAS_API sss_result sss_atlas_load(const sss_mesh *mesh, sss_atlas_read read, void *user, const sss_hooks *hooks,
                                        sss_atlas **out)
{
    sss_atlas__stream stream;
    sss_atlas *a;
    sss_result result = sss_atlas__check_mesh(mesh);
    if (result != SSS_OK)
    {
        return result;
    }
    if (read == NULL || out == NULL || !sss_atlas__valid_hooks(hooks))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    a = sss_atlas__new(hooks);
    if (a == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_atlas__open(&stream, NULL, read, user);
    sss_atlas__move_header(&stream, a);
    if (stream.result == SSS_OK && a->mesh_hash != sss_atlas__hash_mesh(mesh))
    {
        sss_atlas__fail(&stream, SSS_ERROR_MISMATCH);
    }
    if (stream.result == SSS_OK && !sss_atlas__valid_counts(a, mesh))
    {
        sss_atlas__fail(&stream, SSS_ERROR_BAD_DATA);
    }
    if (stream.result == SSS_OK)
    {
        sss_atlas__move_arrays(&stream, a);
    }
    if (stream.result == SSS_OK && !sss_atlas__is_consistent(a, mesh))
    {
        sss_atlas__fail(&stream, SSS_ERROR_BAD_DATA);
    }
    if (stream.result != SSS_OK)
    {
        sss_atlas_free(a);
        return stream.result;
    }
    a->stats.bytes = a->memory.bytes;
    *out = a;
    return SSS_OK;
}

// ---- GLSL ----

SSS_ATLAS_API const char *sss_atlas_glsl(sss_atlas_glsl_piece piece)
{
    static const char place[] = SSS_ATLAS__GLSL_PLACE;
    static const char dilate[] = SSS_ATLAS__GLSL_DILATE;
    switch (piece)
    {
    case SSS_ATLAS_GLSL_PLACE:  return place;
    case SSS_ATLAS_GLSL_DILATE: return dilate;
    }
    return NULL;
}

#endif // SSS_ATLAS_IMPLEMENTED
#endif // SSS_ATLAS_IMPLEMENTATION

// CHANGE LOG
//   0.1.0  first version
//
// LICENCE: choose one.
//
// A. MIT No Attribution (MIT-0)
// Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
// documentation files (the "Software"), to deal in the Software without restriction, including without limitation
// the rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and
// to permit persons to whom the Software is furnished to do so.
// THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO
// THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
// AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF
// CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS
// IN THE SOFTWARE.
//
// B. Public domain (www.unlicense.org)
// This is free and unencumbered software released into the public domain. Anyone is free to copy, modify, publish,
// use, compile, sell, or distribute this software, either in source code form or as a compiled binary, for any
// purpose, commercial or non-commercial, and by any means. In jurisdictions that recognize copyright laws, the
// authors dedicate any and all copyright interest in the software to the public domain, for the benefit of the
// public at large and to the detriment of their heirs and successors. THE SOFTWARE IS PROVIDED "AS IS", WITHOUT
// WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS
// FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS BE LIABLE FOR ANY CLAIM, DAMAGES OR
// OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH
// THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
