// sss_bem.h - v0.1.0 - hierarchical boundary elements for translucent, deforming objects: light, view, material and
// geometry may all change from frame to frame.
//
// Implements T. Mertens, J. Kautz, P. Bekaert, H.-P. Seidel, F. Van Reeth: Interactive Rendering of Translucent
// Deformable Objects (Eurographics Symposium on Rendering 2003).
// Licence: MIT-0 or public domain, at your choice; see the end. Needs libc and libm, nothing else.
//
#ifndef SSS_BEM_H
#define SSS_BEM_H

#define SSS_BEM_VERSION 100 // 10000 major + 100 minor + patch

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
// SSS_BEM_IMPLEMENTATION  define in exactly one source file before including: the code
// SSS_BEM_STATIC          makes every function static: a private copy in that source file
// SSS_BEM_NO_SIMD         compiles no AVX2/AVX-512 path (plain C gives the same within tolerance)

#if defined(SSS_BEM_STATIC)
#if defined(__GNUC__)
#define SSS_BEM_API static __attribute__((unused))
#else
#define SSS_BEM_API static
#endif
#else
#define SSS_BEM_API extern
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ================================================= API =================================================
// Unless said otherwise a function never allocates, keeps no pointer and may run concurrently; arrays are
// the caller's and must not overlap; RGB is interleaved and linear. Functions that return a number return
// NaN where their arguments are invalid.

// ---- 1. Form factor of one source over a planar polygon ----

// I = int over the polygon of z (1 + sigma s) exp(-sigma s)/s^3 dA, s the distance to the source.
//                                                                              Mertens et al. 2003, section 4, eq. 8
//   corners  [corner_count][3], corner_count >= 3, in one plane, in either order; any unit of length, the same for all
//   source   [3]
//   z        the weight, any sign; the source's height over the polygon where the receiver lies in its plane, but not
//            in general: over a polygon that comes closer than z the value grows as 2 pi z/H (sss_bem_options.guard)
//   sigma    >= 0, one over the unit of length
// Relative error 1e-12 at the tightest tolerance, 1e-9 in extreme cases (tests/test_bem.c). 0 for a polygon without
// area or z = 0; infinite where the source lies in the polygon; NaN for null, non-finite or out of range.
SSS_BEM_API double sss_bem_form_factor(const double *corners, size_t corner_count, const double source[3], double z,
                                       double sigma);

// The same to a relative tolerance in [0, 1]: edges are divided as far as it asks. 0: the tightest.
SSS_BEM_API double sss_bem_form_factor_within(const double *corners, size_t corner_count, const double source[3],
                                              double z, double sigma, double tolerance);

// The conditions of eq. 19, under which the paper cuts its Taylor series behind the constant term (eq. 17).
typedef struct sss_bem_taylor
{
    double length_ratio; // edge segments are halved until L/r_0 is below this; 0: 2/5
    double sigma_length; // and until sigma L is below this; 0: 2/5; infinite: ignored, as the paper suggests
    size_t samples;      // out: edge segments evaluated, figure 4
} sss_bem_taylor;

// The same by the paper's own series, to reproduce its figures 3 and 4: off by several per cent where the conditions
// only just hold; segments are halved 40 times at most. conditions may be NULL.
SSS_BEM_API double sss_bem_form_factor_taylor(const double *corners, size_t corner_count, const double source[3],
                                              double z, double sigma, sss_bem_taylor *conditions);

// The integral over a triangle with linear irradiance: out[k] = int lambda_k z (1 + sigma s) exp(-sigma s)/s^3 dA with
// lambda_k the barycentric coordinate of corner k, so that irradiance E_k at the corners gives sum_k E_k out[k]. The
// three sum to sss_bem_form_factor. The gradient costs nothing more: int (x - q) K dA = -sum_edges n int G dt.
//   corners  [3][3];   tolerance  as above
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite or out of range.
SSS_BEM_API sss_result sss_bem_form_factor_linear(const double *corners, const double source[3], double z,
                                                  double sigma, double tolerance, double out[3]);

// The float path, as it runs on near triangles, for one triangle: relative error 1e-4 where the source is not beyond
// 50/sigma, corner differences exact in float.     corners  [3][3]
SSS_BEM_API float sss_bem_form_factor_float(const float *corners, const float source[3], float z, float sigma);

// ---- 2. Object: hierarchy, material, light ----

// Where irradiance is given.
typedef enum sss_bem_elements
{
    SSS_BEM_VERTICES = 0, // at vertices, linear over each triangle
    SSS_BEM_TRIANGLES     // constant over each triangle, as in the paper
} sss_bem_elements;

// When a link between receivers and an emitting cluster is good enough.
typedef enum sss_bem_oracle
{
    SSS_BEM_ORACLE_CONTRIBUTION = 0, // bounds the error of the contribution, using the decay of R_d (the paper's future
                                     // work); vertices gather in groups
    SSS_BEM_ORACLE_SOLID_ANGLE       // section 5.2: epsilon_1 and epsilon_2; clusters gather at their midpoints, push
                                     // down, and vertices average; scalar code, slower, for comparison
} sss_bem_oracle;

// Which instructions do the work. All agree within stats.path_tolerance.
typedef enum sss_bem_path
{
    SSS_BEM_PATH_AUTO = 0, // the fastest one that this processor has
    SSS_BEM_PATH_PORTABLE, // plain C
    SSS_BEM_PATH_AVX2,     // 8 receivers at a time
    SSS_BEM_PATH_AVX512    // 16 receivers at a time
} sss_bem_path;

typedef struct sss_bem_options
{
    double tolerance;      // relative L2 error of B aimed at, in [1e-4, 0.5]; 0: 1e-2; everything else follows from it
    double guard;          // R_d of a source is cut at the value it has guard*z away; <= 1; 0: 0.25; negative: none.
                           // On a plane no point is nearer than z, so that nothing changes. Where a placed source comes
                           // close to another part of the surface, its light there is spurious and grows as 2 pi z/H:
                           // the guard bounds it by 3 pi/guard
    double epsilon_1;      // solid angle oracle: spread over a receiver's children, sr; 0: from tolerance
    double epsilon_2;      // solid angle oracle: of an emitter, sr; 0: from tolerance
    double planarity;      // solid angle oracle: clusters of A'/A below are opened, in [0, 1]; 0: 0.7
    size_t base_triangle_count; // 0: face clusters over all triangles. Otherwise the mesh is base_triangle_count *
                           // 4^k triangles by 4-to-1 subdivision: the children of triangle i are 4i .. 4i+3 one level
                           // finer, and face clusters lie only over the base
    sss_bem_oracle oracle; // 0: contribution
    sss_bem_path path;     // 0: automatic; SSS_ERROR_INVALID_ARGUMENT if this processor lacks it
    int point_sampling;    // solid angle oracle: 1: point samples instead of form factors (table 5)
} sss_bem_options;

typedef struct sss_bem_stats
{
    double tolerance, guard, epsilon_1, epsilon_2, planarity; // as resolved
    double predicted_error;   // relative L2 error of B: as measured by sss_bem_predict_error for this light, material
                              // and geometry, and never below the true one; before it was called, the tolerance
    double path_tolerance;    // what this path adds to it against plain C
    sss_bem_oracle oracle;
    sss_bem_path path;
    size_t triangle_count, vertex_count;
    size_t cluster_count;     // nodes of the hierarchy, triangles included
    size_t depth;
    size_t row_count;         // groups of receivers that share their links
    size_t link_count;        // stored links between a row (solid angle: a cluster) and a cluster
    size_t near_count;        // stored form factors between a vertex and a triangle
    size_t pending_rows;      // rows whose links are older than geometry or material
    size_t bytes;             // allocated, links included
    size_t link_bytes;        // of these, links
} sss_bem_stats;

typedef struct sss_bem sss_bem; // opaque

// Builds the hierarchy over any triangle soup, O(T log T): open, non-manifold, with degenerate triangles and
// unreferenced vertices. Irradiance is zero until set. Keeps no pointer to the mesh.
//   mesh            normals may be NULL: means of the triangles' normals weighted by angle, again after every move
//   options, hooks  may be NULL: defaults
//   out             freed with sss_bem_free
// Allocates. SSS_ERROR_INVALID_ARGUMENT, _EMPTY, _INDEX, _OVERFLOW, _OUT_OF_MEMORY.
SSS_BEM_API sss_result sss_bem_create(const sss_mesh *mesh, const sss_profile *profile, const sss_bem_options *options,
                                      const sss_hooks *hooks, sss_bem **out);

// Frees an object; NULL is allowed.
SSS_BEM_API void sss_bem_free(sss_bem *bem);

// A new light: pulls irradiance up the hierarchy, O(T).
//   irradiance  [V][3] or [T][3], W/mm^2, finite
// Not concurrent with other calls on the same object. SSS_ERROR_INVALID_ARGUMENT: the object is unchanged.
SSS_BEM_API sss_result sss_bem_set_irradiance(sss_bem *bem, sss_bem_elements elements, const float *irradiance);

// New geometry, the same triangles: refits the hierarchy, O(T), and marks what moved. The irradiance stays.
//   positions  [V][3] in the mesh's units;   normals  [V][3] or NULL, as at creation
// Not concurrent with other calls on the same object. SSS_ERROR_INVALID_ARGUMENT: the object is unchanged.
SSS_BEM_API sss_result sss_bem_set_vertices(sss_bem *bem, const float *positions, const float *normals);

// A new material: every link is marked. Errors and concurrency as above.
SSS_BEM_API sss_result sss_bem_set_profile(sss_bem *bem, const sss_profile *profile);

// ---- 3. Radiosity in three modes (section 5.5); all three give the same to rounding ----

// On the fly: everything from scratch, nothing stored.   radiosity  [V][3], W/mm^2
// Through hooks.parallel_for and hooks.progress; bit-identical for any number of threads. SSS_ERROR_INVALID_ARGUMENT,
// _OUT_OF_MEMORY, _CANCELLED.
SSS_BEM_API sss_result sss_bem_shade(const sss_bem *bem, float *radiosity);

// Rows [begin, end) of it, for callers that split the work themselves: writes the vertices of these rows only. Pure;
// any threads. Contribution oracle only. SSS_ERROR_INVALID_ARGUMENT: also begin > end, end > stats.row_count.
SSS_BEM_API sss_result sss_bem_shade_rows(const sss_bem *bem, size_t begin, size_t end, float *radiosity);

// At any points, with their normals: positions, normals, radiosity [count][3]. Contribution oracle only. As above.
SSS_BEM_API sss_result sss_bem_gather(const sss_bem *bem, const float *positions, const float *normals, size_t count,
                                      float *radiosity);

// Incremental: brings stored links up to date with geometry and material. Links of unchanged clusters are kept, others
// are computed again, promoted or demoted, in at most about `budget` form factors (0: no limit); what remains is done
// by the next calls. With no budget on a new object it builds all links.
//   pending  out, rows left; may be NULL
// Allocates. Not concurrent with other calls on the same object. The solid angle oracle relinks everything at once.
// SSS_ERROR_OUT_OF_MEMORY: links done so far are kept.
SSS_BEM_API sss_result sss_bem_update(sss_bem *bem, size_t budget, size_t *pending);

// Render: one sweep over the stored links; a new light costs this and sss_bem_set_irradiance. Pending rows use their
// old links, rows that were never linked are gathered on the fly. Errors as sss_bem_shade.
SSS_BEM_API sss_result sss_bem_render(const sss_bem *bem, float *radiosity);

// Frees the stored links.
SSS_BEM_API void sss_bem_unlink(sss_bem *bem);

// Measures the error on `count` vertices (0: 256), spread over the mesh, against the same sums at a tenth of the
// tolerance, for the present light; stats.predicted_error then holds it with its margin. Costs about 5 count/V of a
// frame. Contribution oracle only; errors as sss_bem_shade. error may be NULL.
SSS_BEM_API sss_result sss_bem_predict_error(sss_bem *bem, size_t count, double *error);

// ---- 4. Looking inside ----

// What was chosen, and what it costs. SSS_ERROR_INVALID_ARGUMENT: null.
SSS_BEM_API sss_result sss_bem_get_stats(const sss_bem *bem, sss_bem_stats *out);

// A node of the hierarchy. Nodes lie in depth-first order: the subtree of node i is i .. end-1, its first child i+1,
// the next one where the first one's subtree ends; a leaf has end = i + 1.
typedef struct sss_bem_cluster
{
    double center[3];  // centroid of the area, in the mesh's units
    double normal[3];  // mean, weighted by area; unit length or 0
    double radius;     // of a sphere about the center that holds it, in the mesh's units
    double area;       // mm^2
    double planarity;  // A'/A, projected over total area, 5.1.1: 1 for a flat cluster
    double irradiance[3]; // mean, pulled up
    size_t end;
    size_t triangle;   // of a leaf; SIZE_MAX otherwise
} sss_bem_cluster;

// SSS_ERROR_INVALID_ARGUMENT: null or index >= stats.cluster_count.
SSS_BEM_API sss_result sss_bem_get_cluster(const sss_bem *bem, size_t index, sss_bem_cluster *out);

// The clusters from which a vertex gathers (figure 6.9), together the whole surface.
//   clusters  [capacity] or NULL;   count  out: how many there are
// SSS_ERROR_INVALID_ARGUMENT: null or vertex >= V. Contribution oracle only.
SSS_BEM_API sss_result sss_bem_get_links(const sss_bem *bem, size_t vertex, size_t *clusters, size_t capacity,
                                         size_t *count);

// ---- 5. GLSL ----

// Pieces of GLSL source: shading of vertex radiosity, with the exit Fresnel factor and a reflected environment
// (section 5.4). Goes after SSS_DIPOLE_GLSL_FRESNEL and SSS_DIPOLE_GLSL_PROFILE of sss_dipole.h.
typedef enum sss_bem_glsl_piece
{
    SSS_BEM_GLSL_SHADE = 0 // vec3 sss_bem_radiance(vec3 radiosity, vec3 n, vec3 w_o, vec3 reflected):
                           // exit_factor/pi B + F_r reflected;  vec3 sss_bem_environment(vec3 n, vec3 w_o): what is
                           // mirrored, from uniform samplerCube sss_environment
} sss_bem_glsl_piece;

// NULL for an unknown piece; static storage; under 4,095 characters.
SSS_BEM_API const char *sss_bem_glsl(sss_bem_glsl_piece piece);

#ifdef __cplusplus
}
#endif

// ================================================ GLSL =================================================
// The shader piece, as readable source, with its own include guard; it has no #version line.

#define SSS_BEM__GLSL_SHADE                                                                                     \
    "#ifndef SSS_BEM_SHADE\n"                                                                                   \
    "#define SSS_BEM_SHADE\n"                                                                                   \
    "#ifdef GL_ES\n"                                                                                            \
    "precision highp float;\n"                                                                                  \
    "precision highp samplerCube;\n"                                                                            \
    "#endif\n"                                                                                                  \
    "uniform samplerCube sss_environment; // radiance\n"                                                        \
    "// Light that a smooth boundary mirrors towards w_o; n and w_o of unit length, w_o away from the surface.\n" \
    "vec3 sss_bem_environment(vec3 n, vec3 w_o)\n"                                                              \
    "{\n"                                                                                                       \
    "    return texture(sss_environment, reflect(-w_o, n)).rgb;\n"                                              \
    "}\n"                                                                                                       \
    "// Outgoing radiance: eq. 3, and the Fresnel reflection of what arrives from the mirrored direction.\n"    \
    "vec3 sss_bem_radiance(vec3 radiosity, vec3 n, vec3 w_o, vec3 reflected)\n"                                 \
    "{\n"                                                                                                       \
    "    float cos_o = dot(n, w_o);\n"                                                                          \
    "    float r = cos_o > 0.0 ? sss_fresnel(cos_o, sss_eta) : 1.0;\n"                                          \
    "    return sss_exit_factor(cos_o) * 0.318309886183791 * radiosity + r * reflected; // 1/pi\n"              \
    "}\n"                                                                                                       \
    "#endif\n"

#endif // SSS_BEM_H

// =========================================== IMPLEMENTATION ============================================
#ifdef SSS_BEM_IMPLEMENTATION
#ifndef SSS_BEM_IMPLEMENTED
#define SSS_BEM_IMPLEMENTED

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SSS_BEM__PI 3.14159265358979323846

// ---- small maths and checks ----

// Looks at the bits, so that it holds under -ffast-math as well.
static int sss_bem__finite(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (bits & 0x7ff0000000000000u) != 0x7ff0000000000000u;
}

static int sss_bem__in_range(double x, double low, double high)
{
    return sss_bem__finite(x) && x >= low && x <= high;
}

static int sss_bem__all_finite(const float *x, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++)
    {
        if (!sss_bem__finite((double)x[i]))
        {
            return 0;
        }
    }
    return 1;
}

static double sss_bem__min(double a, double b)
{
    return a < b ? a : b;
}

static double sss_bem__max(double a, double b)
{
    return a > b ? a : b;
}

static double sss_bem__dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void sss_bem__subtract(const double a[3], const double b[3], double out[3])
{
    out[0] = a[0] - b[0];
    out[1] = a[1] - b[1];
    out[2] = a[2] - b[2];
}

// a b - c d with one rounding's error (Kahan), the products split by Dekker: no fused multiply-add is assumed.
static double sss_bem__product_error(double a, double b, double product)
{
    const double splitter = 134217729.0; // 2^27 + 1
    const double a_big = splitter * a, b_big = splitter * b;
    const double a_high = a_big - (a_big - a), b_high = b_big - (b_big - b);
    const double a_low = a - a_high, b_low = b - b_high;
    return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
}

static double sss_bem__difference_of_products(double a, double b, double c, double d)
{
    const double ab = a * b, cd = c * d;
    return (ab - cd) + (sss_bem__product_error(a, b, ab) - sss_bem__product_error(c, d, cd));
}

static void sss_bem__cross(const double a[3], const double b[3], double out[3])
{
    out[0] = sss_bem__difference_of_products(a[1], b[2], a[2], b[1]);
    out[1] = sss_bem__difference_of_products(a[2], b[0], a[0], b[2]);
    out[2] = sss_bem__difference_of_products(a[0], b[1], a[1], b[0]);
}

static double sss_bem__length(const double v[3])
{
    return sqrt(sss_bem__dot(v, v));
}

// ---- 1. Form factor ----

// Gauss-Legendre rules on [-1, 1] (Abramowitz and Stegun 1964, table 25.4): nodes > 0 and their weights.
static const double sss_bem__gauss4[2][2] = {{0.339981043584856264, 0.652145154862546143},
                                             {0.861136311594052575, 0.347854845137453857}};
static const double sss_bem__gauss8[4][2] = {{0.183434642495649804, 0.362683783378361983},
                                             {0.525532409916328985, 0.313706645877887287},
                                             {0.796666477413626739, 0.222381034453374471},
                                             {0.960289856497536231, 0.101228536290376259}};
static const double sss_bem__gauss16[8][2] = {{0.095012509837637440, 0.189450610455068496},
                                              {0.281603550779258913, 0.182603415044923589},
                                              {0.458016777657227386, 0.169156519395002538},
                                              {0.617876244402643748, 0.149595988816576732},
                                              {0.755404408355003033, 0.124628971255533872},
                                              {0.865631202387831743, 0.095158511682492785},
                                              {0.944575023073232576, 0.062253523938647893},
                                              {0.989400934991649932, 0.027152459411754095}};

// A polygon in its own plane: the source projects to the origin q. Corners are kept as offsets from one of them,
// so that differences between points keep their digits however far the source is.
typedef struct sss_bem__flat
{
    double H;          // height of the source over the plane, >= 0
    double sigma;
    double base[2];    // the corner that offsets count from, seen from q
    double center[2];  // offset of the point of reference
    double rho_c;      // its distance from q, 0 when it is q
    double s_c, C;     // its distance from the source, and G there
    int about_q;       // the point of reference is q
    int inside;        // q lies in the polygon
    int on_polygon;    // the source lies in the polygon: infinite
    const double (*rule)[2];
    int rule_size;
    double reach;      // sigma (s - s_c) beyond which G is nothing beside C
} sss_bem__flat;

// G(s) = exp(-sigma s)/s, the antiderivative of eq. 10: (1 + sigma s) exp(-sigma s)/s^3 rho drho = -dG.
static double sss_bem__G(double sigma, double s)
{
    return exp(-sigma * s) / s;
}

// C - G at the point with offset d, without cancellation: from s^2 - s_c^2 and expm1.
static double sss_bem__C_minus_G(const sss_bem__flat *f, const double d[2])
{
    const double x = f->base[0] + d[0], y = f->base[1] + d[1];
    const double s = sqrt(x * x + y * y + f->H * f->H);
    const double squares = f->about_q ? x * x + y * y
                                      : (d[0] - f->center[0]) * (x + f->base[0] + f->center[0])
                                            + (d[1] - f->center[1]) * (y + f->base[1] + f->center[1]);
    const double s_s_c = squares / (s + f->s_c); // s - s_c
    if (s_s_c >= 0.0)
    {
        return f->C * (s_s_c / s - f->s_c / s * expm1(-f->sigma * s_s_c));
    }
    return sss_bem__G(f->sigma, s) * (s_s_c / f->s_c + s / f->s_c * expm1(f->sigma * s_s_c));
}

// An edge: offset of its start, unit direction, distance p of its line from q (positive with q on the left), and
// t, the distance along it from the foot d'' of q, at its start.
typedef struct sss_bem__side
{
    double start[2], direction[2];
    double p, t_start, length;
} sss_bem__side;

static int sss_bem__make_side(const sss_bem__flat *f, const double from[2], const double to[2], sss_bem__side *e)
{
    const double x = to[0] - from[0], y = to[1] - from[1];
    const double a[2] = {f->base[0] + from[0], f->base[1] + from[1]};
    e->length = sqrt(x * x + y * y);
    if (!(e->length > 0.0))
    {
        return 0;
    }
    e->start[0] = from[0];
    e->start[1] = from[1];
    e->direction[0] = x / e->length;
    e->direction[1] = y / e->length;
    e->p = sss_bem__difference_of_products(a[0], e->direction[1], a[1], e->direction[0]);
    e->t_start = a[0] * e->direction[0] + a[1] * e->direction[1];
    return 1;
}

// What an edge contributes: int (C - G) dtheta and int (C - G) dt, the latter for the first moment.
typedef struct sss_bem__edge_sum
{
    double theta, line;
} sss_bem__edge_sum;

// Both over t in [low, high] by one Gauss rule; dtheta = p dt/(p^2 + t^2), eq. 11.
static void sss_bem__panel(const sss_bem__flat *f, const sss_bem__side *e, double low, double high,
                           sss_bem__edge_sum *sum)
{
    const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
    int i, sign;
    for (i = 0; i < f->rule_size; i++)
    {
        for (sign = -1; sign <= 1; sign += 2)
        {
            const double t = middle + sign * half * f->rule[i][0], along = t - e->t_start;
            const double d[2] = {e->start[0] + along * e->direction[0], e->start[1] + along * e->direction[1]};
            const double term = half * f->rule[i][1] * sss_bem__C_minus_G(f, d);
            sum->theta += e->p == 0.0 ? 0.0 : term * (e->p / (e->p * e->p + t * t));
            sum->line += term;
        }
    }
}

// From the point of the edge at t = from outwards to t = to (both on one side of the foot).
// Panels are as wide as the nearest singularity is far, so that a rule of n nodes gains a fixed number of digits
// on each: about q the integrand is singular where s = 0, elsewhere also where rho = 0.
static void sss_bem__half_side(const sss_bem__flat *f, const sss_bem__side *e, double from, double to,
                               sss_bem__edge_sum *sum)
{
    const double outward = to > from ? 1.0 : -1.0;
    const double near2 = e->p * e->p + (f->about_q ? f->H * f->H : 0.0);
    double t = from;
    while ((to - t) * outward > 0.0)
    {
        const double s = sqrt(t * t + e->p * e->p + f->H * f->H);
        double width = sqrt(t * t + near2), next;
        if (f->sigma * (s - f->s_c) > f->reach) // the rest is C dtheta, C dt
        {
            sum->theta += e->p == 0.0 ? 0.0 : f->C * atan2(e->p * (to - t), e->p * e->p + t * to);
            sum->line += f->C * (to - t);
            return;
        }
        width = f->sigma * width > 3.0 ? 3.0 / f->sigma : width; // exp(-3) over a panel
        next = t + outward * width;
        next = (to - next) * outward > 0.0 && next != t ? next : to;
        sss_bem__panel(f, e, t, next, sum);
        t = next;
    }
}

static sss_bem__edge_sum sss_bem__side_integral(const sss_bem__flat *f, const sss_bem__side *e)
{
    const double t_end = e->t_start + e->length;
    sss_bem__edge_sum sum = {0.0, 0.0};
    if (t_end > 0.0)
    {
        sss_bem__half_side(f, e, e->t_start > 0.0 ? e->t_start : 0.0, t_end, &sum);
    }
    if (e->t_start < 0.0)
    {
        sss_bem__edge_sum back = {0.0, 0.0};
        sss_bem__half_side(f, e, t_end < 0.0 ? t_end : 0.0, e->t_start, &back);
        sum.theta -= back.theta;
        sum.line -= back.line;
    }
    return sum;
}

// ---- the polygon in its plane ----

// Unit normal by Newell's sum over the corners, relative to the first one; 0 where the polygon has no area.
static int sss_bem__normal(const double *corners, size_t count, double normal[3])
{
    double length;
    size_t k;
    int i;
    normal[0] = normal[1] = normal[2] = 0.0;
    for (k = 1; k + 1 < count; k++)
    {
        double a[3], b[3], cross[3];
        sss_bem__subtract(corners + 3 * k, corners, a);
        sss_bem__subtract(corners + 3 * (k + 1), corners, b);
        sss_bem__cross(a, b, cross);
        for (i = 0; i < 3; i++)
        {
            normal[i] += cross[i];
        }
    }
    length = sss_bem__length(normal);
    for (i = 0; i < 3 && length > 0.0; i++)
    {
        normal[i] /= length;
    }
    return length > 0.0;
}

// Two unit vectors that span the plane, right-handed with the normal.
static void sss_bem__frame(const double n[3], double u[3], double v[3])
{
    const int smallest = fabs(n[0]) <= fabs(n[1]) ? (fabs(n[0]) <= fabs(n[2]) ? 0 : 2)
                                                  : (fabs(n[1]) <= fabs(n[2]) ? 1 : 2);
    double length;
    int i;
    for (i = 0; i < 3; i++)
    {
        u[i] = (i == smallest ? 1.0 : 0.0) - n[smallest] * n[i];
    }
    length = sss_bem__length(u);
    for (i = 0; i < 3; i++)
    {
        u[i] /= length;
    }
    v[0] = n[1] * u[2] - n[2] * u[1];
    v[1] = n[2] * u[0] - n[0] * u[2];
    v[2] = n[0] * u[1] - n[1] * u[0];
}

// A corner's offset from the base corner, in the plane.
static void sss_bem__offset(const double *corners, size_t count, size_t k, size_t base, const double u[3],
                            const double v[3], double out[2])
{
    double d[3];
    sss_bem__subtract(corners + 3 * (k % count), corners + 3 * base, d);
    out[0] = sss_bem__dot(d, u);
    out[1] = sss_bem__dot(d, v);
}

// Distance of q from the edge between two offsets.
static double sss_bem__edge_distance(const sss_bem__flat *f, const double from[2], const double to[2])
{
    const double a[2] = {f->base[0] + from[0], f->base[1] + from[1]};
    const double e[2] = {to[0] - from[0], to[1] - from[1]};
    const double square = e[0] * e[0] + e[1] * e[1];
    double t = square > 0.0 ? -(a[0] * e[0] + a[1] * e[1]) / square : 0.0, x, y;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    x = a[0] + t * e[0];
    y = a[1] + t * e[1];
    return sqrt(x * x + y * y);
}

// Chooses the constant C. Inside, only C = G(H) is right, because the angles sum to 2 pi; outside, where they sum to
// 0, any C is, and the G of a point of the polygon keeps the terms as small as the result. Just outside, where
// G(H) is not much more than the G of the nearest point, C = G(H) does both.
static void sss_bem__choose_reference(sss_bem__flat *f, int inside, double distance, double extent,
                                      const double center[2])
{
    const double x = f->base[0] + center[0], y = f->base[1] + center[1];
    const double s_near = sqrt(distance * distance + f->H * f->H);
    f->about_q = inside || (distance < 0.5 * f->H && distance < extent && f->sigma * (s_near - f->H) < 1.0);
    f->center[0] = center[0];
    f->center[1] = center[1];
    f->inside = inside;
    f->on_polygon = f->H == 0.0 && (inside || distance == 0.0);
    f->s_c = f->about_q ? f->H : sqrt(x * x + y * y + f->H * f->H);
    f->C = f->s_c > 0.0 ? sss_bem__G(f->sigma, f->s_c) : 0.0;
}

static void sss_bem__choose_rule(sss_bem__flat *f, double tolerance)
{
    f->rule = tolerance >= 1e-4 ? sss_bem__gauss4 : tolerance >= 1e-8 ? sss_bem__gauss8 : sss_bem__gauss16;
    f->rule_size = tolerance >= 1e-4 ? 2 : tolerance >= 1e-8 ? 4 : 8;
    f->reach = tolerance >= 1e-4 ? 12.0 : tolerance >= 1e-8 ? 22.0 : 45.0;
}

// Reads the polygon into its plane. 0 where it has no area.
static int sss_bem__flatten(const double *corners, size_t count, const double source[3], double sigma,
                            double tolerance, sss_bem__flat *f, double u[3], double v[3], size_t *base)
{
    double normal[3], d[3], nearest = HUGE_VAL;
    double center[2] = {0.0, 0.0}, angle = 0.0, distance = HUGE_VAL, extent = 0.0;
    size_t k;
    if (!sss_bem__normal(corners, count, normal))
    {
        return 0;
    }
    sss_bem__frame(normal, u, v);
    for (k = 0; k < count; k++)
    {
        sss_bem__subtract(corners + 3 * k, source, d);
        if (sss_bem__dot(d, d) < nearest)
        {
            nearest = sss_bem__dot(d, d);
            *base = k;
        }
    }
    sss_bem__subtract(corners + 3 * *base, source, d);
    f->sigma = sigma;
    f->H = fabs(sss_bem__dot(d, normal));
    f->base[0] = sss_bem__dot(d, u);
    f->base[1] = sss_bem__dot(d, v);
    for (k = 0; k < count; k++)
    {
        double from[2], to[2], a[2], b[2];
        sss_bem__offset(corners, count, k, *base, u, v, from);
        sss_bem__offset(corners, count, k + 1, *base, u, v, to);
        a[0] = f->base[0] + from[0];
        a[1] = f->base[1] + from[1];
        b[0] = f->base[0] + to[0];
        b[1] = f->base[1] + to[1];
        angle += atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
        distance = sss_bem__min(distance, sss_bem__edge_distance(f, from, to));
        extent = sss_bem__max(extent, sqrt(from[0] * from[0] + from[1] * from[1]));
        center[0] += from[0] / (double)count;
        center[1] += from[1] / (double)count;
    }
    sss_bem__choose_reference(f, fabs(angle) > SSS_BEM__PI, distance, extent, center);
    sss_bem__choose_rule(f, tolerance);
    return 1;
}

static int sss_bem__valid_polygon(const double *corners, size_t count, const double source[3], double z, double sigma)
{
    size_t k;
    if (corners == NULL || source == NULL || count < 3 || count > SIZE_MAX / (3 * sizeof(double))
        || !sss_bem__finite(z) || !sss_bem__finite(sigma) || sigma < 0.0 || !sss_bem__finite(source[0])
        || !sss_bem__finite(source[1]) || !sss_bem__finite(source[2]))
    {
        return 0;
    }
    for (k = 0; k < 3 * count; k++)
    {
        if (!sss_bem__finite(corners[k]))
        {
            return 0;
        }
    }
    return 1;
}

static double sss_bem__infinite(double z)
{
    return z > 0.0 ? HUGE_VAL : -HUGE_VAL; // 2 pi z/H
}

SSS_BEM_API double sss_bem_form_factor_within(const double *corners, size_t corner_count, const double source[3],
                                              double z, double sigma, double tolerance)
{
    sss_bem__flat f;
    double u[3], v[3], sum = 0.0;
    size_t base = 0, k;
    if (!sss_bem__valid_polygon(corners, corner_count, source, z, sigma) || !(tolerance >= 0.0 && tolerance <= 1.0))
    {
        return NAN;
    }
    if (z == 0.0 || !sss_bem__flatten(corners, corner_count, source, sigma, tolerance, &f, u, v, &base))
    {
        return 0.0;
    }
    if (f.on_polygon)
    {
        return sss_bem__infinite(z);
    }
    for (k = 0; k < corner_count; k++)
    {
        sss_bem__side e;
        double from[2], to[2];
        sss_bem__offset(corners, corner_count, k, base, u, v, from);
        sss_bem__offset(corners, corner_count, k + 1, base, u, v, to);
        sum += sss_bem__make_side(&f, from, to, &e) && e.p != 0.0 ? sss_bem__side_integral(&f, &e).theta : 0.0;
    }
    return z * sum;
}

SSS_BEM_API double sss_bem_form_factor(const double *corners, size_t corner_count, const double source[3], double z,
                                       double sigma)
{
    return sss_bem_form_factor_within(corners, corner_count, source, z, sigma, 0.0);
}

// ---- linear irradiance ----

// lambda_k = lambda_k(q) + grad lambda_k . (x - q), and int (x - q) K dA = -int grad G dA = -sum_edges n int G dt by
// Gauss's theorem, n outward; with C - G in the place of -G because the edges' normals sum to 0.
static void sss_bem__linear_parts(const sss_bem__flat *f, const double corner[3][2], double z, double out[3])
{
    double theta = 0.0, moment[2] = {0.0, 0.0}, double_area;
    sss_bem__side e[3];
    int k;
    for (k = 0; k < 3; k++)
    {
        if (sss_bem__make_side(f, corner[k], corner[(k + 1) % 3], &e[k]))
        {
            const sss_bem__edge_sum sum = sss_bem__side_integral(f, &e[k]);
            theta += sum.theta;
            moment[0] += e[k].direction[1] * sum.line; // the outward normal is (direction y, -direction x)
            moment[1] -= e[k].direction[0] * sum.line;
        }
    }
    double_area = sss_bem__difference_of_products(corner[1][0] - corner[0][0], corner[2][1] - corner[0][1],
                                                  corner[1][1] - corner[0][1], corner[2][0] - corner[0][0]);
    for (k = 0; k < 3; k++)
    {
        const sss_bem__side *opposite = &e[(k + 1) % 3];
        const double scale = opposite->length / double_area;
        const double inward = -opposite->direction[1] * moment[0] + opposite->direction[0] * moment[1];
        out[k] = z * scale * (opposite->p * theta + inward);
    }
}

SSS_BEM_API sss_result sss_bem_form_factor_linear(const double *corners, const double source[3], double z,
                                                  double sigma, double tolerance, double out[3])
{
    sss_bem__flat f;
    double u[3], v[3], corner[3][2];
    size_t base = 0, k;
    if (out == NULL || !sss_bem__valid_polygon(corners, 3, source, z, sigma) || !(tolerance >= 0.0 && tolerance <= 1.0))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    out[0] = out[1] = out[2] = 0.0;
    if (z == 0.0 || !sss_bem__flatten(corners, 3, source, sigma, tolerance, &f, u, v, &base))
    {
        return SSS_OK;
    }
    if (f.on_polygon)
    {
        out[0] = out[1] = out[2] = sss_bem__infinite(z);
        return SSS_OK;
    }
    for (k = 0; k < 3; k++)
    {
        sss_bem__offset(corners, 3, k, base, u, v, corner[k]);
    }
    sss_bem__linear_parts(&f, (const double (*)[2])corner, z, out);
    return SSS_OK;
}

// ---- the paper's series ----

// I_2 of a segment by its constant term, eq. 17, or of its halves where eq. 19 does not hold.
static double sss_bem__taylor_segment(const sss_bem__flat *f, double R, double t_1, double t_2, int depth,
                                      sss_bem_taylor *conditions)
{
    const double t_0 = 0.5 * (t_1 + t_2), L = t_2 - t_1;
    const double r_0 = sqrt(R * R + t_0 * t_0), s_0 = sqrt(r_0 * r_0 + f->H * f->H);
    if (depth > 0 && (L >= conditions->length_ratio * r_0 || f->sigma * L >= conditions->sigma_length))
    {
        return sss_bem__taylor_segment(f, R, t_1, t_0, depth - 1, conditions) +
               sss_bem__taylor_segment(f, R, t_0, t_2, depth - 1, conditions);
    }
    conditions->samples++;
    return R * exp(-f->sigma * s_0) / (r_0 * r_0 * s_0) * L;
}

SSS_BEM_API double sss_bem_form_factor_taylor(const double *corners, size_t corner_count, const double source[3],
                                              double z, double sigma, sss_bem_taylor *conditions)
{
    sss_bem_taylor c = {0.0, 0.0, 0};
    sss_bem__flat f;
    double u[3], v[3], sum;
    size_t base = 0, k;
    if (conditions != NULL)
    {
        c = *conditions;
    }
    c.length_ratio = c.length_ratio == 0.0 ? 2.0 / 5.0 : c.length_ratio;
    c.sigma_length = c.sigma_length == 0.0 ? 2.0 / 5.0 : c.sigma_length;
    c.samples = 0;
    if (!sss_bem__valid_polygon(corners, corner_count, source, z, sigma) || !(c.length_ratio > 0.0) ||
        !(c.sigma_length > 0.0))
    {
        return NAN;
    }
    if (z == 0.0 || !sss_bem__flatten(corners, corner_count, source, sigma, 0.0, &f, u, v, &base))
    {
        return 0.0;
    }
    if (f.on_polygon)
    {
        return sss_bem__infinite(z);
    }
    sum = f.inside ? 2.0 * SSS_BEM__PI * sss_bem__G(sigma, f.H) : 0.0; // I_1
    for (k = 0; k < corner_count; k++)
    {
        sss_bem__side e;
        double from[2], to[2];
        sss_bem__offset(corners, corner_count, k, base, u, v, from);
        sss_bem__offset(corners, corner_count, k + 1, base, u, v, to);
        if (sss_bem__make_side(&f, from, to, &e) && e.p != 0.0) // R = |p|; its sign is that of eq. 18
        {
            sum -= sss_bem__taylor_segment(&f, e.p, e.t_start, e.t_start + e.length, 40, &c);
        }
    }
    if (conditions != NULL)
    {
        conditions->samples = c.samples;
    }
    return z * sum;
}

// ---- 5. GLSL ----

SSS_BEM_API const char *sss_bem_glsl(sss_bem_glsl_piece piece)
{
    static const char shade[] = SSS_BEM__GLSL_SHADE;
    return piece == SSS_BEM_GLSL_SHADE ? shade : NULL;
}

#endif // SSS_BEM_IMPLEMENTED
#endif // SSS_BEM_IMPLEMENTATION

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
