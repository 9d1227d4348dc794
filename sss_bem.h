// sss_bem.h - v0.1.0 - hierarchical boundary elements for translucent, deforming objects: light, view, material and
// geometry may all change from frame to frame.
//
// Implements T. Mertens, J. Kautz, P. Bekaert, H.-P. Seidel, F. Van Reeth: Interactive Rendering of Translucent
// Deformable Objects (Eurographics Symposium on Rendering 2003).
// Licence: MIT-0 or public domain, at your choice; see the end. Needs libc and libm, nothing else.
//
// ============================================= QUICK START =============================================
//
//     #define SSS_BEM_IMPLEMENTATION // in one source file of the program
//     #include "sss_bem.h"
//     #include <stdio.h>
//
//     static const float x[18] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1}; // an octahedron
//     static const uint32_t triangles[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
//
//     int main(void)
//     {
//         sss_mesh mesh = {x, NULL, triangles, 6, 8, 5.0}; // 5 mm per unit
//         sss_profile wax = {{0.95, 0.9, 0.8}, {0.1, 0.2, 0.4}, {1, 1, 1}, {4.5, 4.5, 4.5}, 1.3, 0.44, 0.06};
//         float E[18] = {0}, B[18];
//         sss_bem *bem;
//         E[12] = E[13] = E[14] = 1.0f; // light at the top
//         if (sss_bem_create(&mesh, &wax, NULL, NULL, &bem) != SSS_OK) return 1;
//         sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, E);
//         sss_bem_shade(bem, B);
//         printf("top %.4f, side %.4f, bottom %.4f\n", B[12], B[0], B[15]);
//         sss_bem_free(bem);
//         return 0;
//     }
//
// ================================================ THEORY ===============================================
//
// B(x_o) = int E(x) R_d dA with both sources of the dipole placed at x_o along its normal (table 1, inverse
// interpretation), R_d = alpha'/(4 pi) sum of z K over the two, K = (1 + sigma s) exp(-sigma s)/s^3, s from the source.
//
//   * Groups of 16 vertices walk the hierarchy together and share their links. A cluster far from all their sources
//     counts as moments: K and its gradient at the area's centroid, the curvature of K against the second moments of
//     the area, and the first moments of the light on it. A link is accepted where the remainder stays below the
//     tolerance (sss_bem__fits): it knows the decay of R_d, which a solid angle does not.
//   * Nearer triangles take 7 points (Radon), still nearer ones 16 (Dunavant), those beside a source the exact integral
//     of linear irradiance along their edges: with G(s) = exp(-sigma s)/s, int z K dA = z sum_edges int (C - G) dtheta,
//     eq. 10, for any constant C whose angles sum to zero.
//   * How single errors add up is measured at creation on 256 vertices and the acceptance eased or tightened to match,
//     for the tolerance is on the relative L2 error of B.
//   * Render mode keeps three numbers a link, receiver and channel: for the light's mean and its two gradients that
//     matter, along w to the cluster and along the receiver's normal (16 bits each at loose tolerances).
//
//     symbol     name in code        unit     meaning
//     sigma      profile.sigma_tr    1/mm     effective transport coefficient
//     z          profile.z_r, z_v    mm       depth and height of the sources
//     E, B       irradiance,         W/mm^2   any consistent unit works
//                radiosity
//
// ================================================ LIMITS ===============================================
//
// All measured by tests/stability (make stability: stability_bem.csv and .png).
//   * The dipole is a model of a flat, endless piece. Beside diffusion in a slab, all images summed, lit slabs of 2 / 8
//     mean free paths come out 1.05 / 1 times as bright on the lit face for alpha' = 0.9, 1.4 / 1.03 for 0.99; the dark
//     face at 0.94 / 0.15 and 1.1 / 0.3. A sphere without absorption in even light, B =
//     E, has 0.26 at a radius of half a mean free path, 0.72 at 3, 0.96 at 50.
//   * Light crosses air: of two fingers of radius 3, one of them lit, the dark one shows 27 % of the lit one's largest
//     B at a gap of 8 mean free paths, 57 % at 1, 89 % at 0.03.
//   * Placed sources that come near another part of the surface: sss_bem_options.guard. Unguarded, the bunny at 10 mm
//     shows up to 7,600 times its irradiance; guarded, never more than 0.87 of it, and no surface more than a plane
//     would by half. It changes nothing on planes and on bodies wider than z, more than 5 % at 22 to 34 % of the
//     bunny's vertices at 10 mm, 4 to 9 % at 50 mm, below 1 % at 200 mm: folds and thin parts, where the shade is a
//     guess.
//   * The tolerance is aimed at, for the relative L2 error of all vertices: the sweeps at 1 % stay below 0.9 %, but for
//     the fingers at gaps of 2 and 4 with 1.3 and 1.5 % (predicted as 1.4 and 2.1 %). Single vertices may be off by
//     several times as much: by up to 2 % of the largest B at the 200 vertices of the chart (rel_max), by 4 % at the
//     worst of the bunny's.
//   * Positions are floats over the diagonal: a mean free path below a millionth of it loses digits, and
//     stats.predicted_error grows as 1e-9 of the diagonal over the path. Rounding may leave B of dark vertices at -1e-6
//     of the largest.
// ---- BEGIN measured by make stability (tests/stability/README.md says what the errors are; in brackets: sweep) ----
//   * 10 % beside diffusion in a slab: lit face, alpha' 0.9: thickness no limit from 2 to 8 mean free paths; worst 5 %
//     (slab front 0.9)
//   * 10 % beside diffusion in a slab: lit face, alpha' 0.99: thickness below 4.9 mean free paths; worst 39 % (slab
//     front 0.99)
//   * 10 % beside diffusion in a slab: dark face, alpha' 0.9: thickness at any value to 8 mean free paths; worst 85 %
//     (slab back 0.9)
//   * 10 % beside diffusion in a slab: dark face, alpha' 0.99: thickness at any value to 8 mean free paths; worst 71 %
//     (slab back 0.99)
//   * 10 % model error: placed, sphere without absorption: radius below 21 mean free paths; worst 74 % (sphere)
//   * 10 % model error: placed, light across air: gap at any value to 8 mean free paths; worst 89 % (fingers)
//   * 10 % input error: placed, shadow edge on a coarse mesh: mean edge above 2 mean free paths; worst 89 % (coarse)
//   * 10 % input error: placed, displaced vertices: amplitude above 0.2 mean edges; worst 64 % (noise)
//   * 10 % input error: placed, triangles missing: share above 0.095; worst 52 % (holes)
//   * 10 % input error: placed, triangles turned over: share above 0.22; worst 83 % (windings)
//   * 10 % input error: placed, vertex normals turned over: share above 0.076; worst 83 % (normals)
//   * placed, slivers: aspect no limit from 1 to 1.0e+05; error at most 0.27 %, 0.27 times what is promised (slivers)
//   * placed, fan beside cells: length no limit from 0.05 to 500 mean free paths; error at most 0.46 %, 0.46 times
//     what is promised (fan)
//   * placed, grazing light: elevation no limit from 0.1 to 90 degrees; error at most 0.28 %, 0.28 times what is
//     promised (grazing)
//   * placed, sphere: radius no limit from 5e-06 to 5.0e+06 mean free paths; error at most 0.8 % (size)
//   * placed, vertices of a faceted sphere without visible scattering, against Lambert: up to 4.5 % (size)
//   * placed, steps of B as a light turns by half degrees no limit; worst +0.039 % (turning)
// ---- END measured by make stability ----
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

// The float path, for one triangle: the triangle is laid into its plane in double, exp and the sums are float, a few
// times as fast. Relative error 1e-4 where the source is not beyond 50/sigma, and up to 2e-3 on slivers of aspect 1e6
// with the source within their width.     corners  [3][3]
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
    double guard;          // R_d of a source is cut at the value it has guard*z away, in (0, 1]; 0: 1; negative: none.
                           // On a plane no point is nearer than z, nor on a convex body wider than z, so that nothing
                           // changes there. Where a placed source comes close to another part of the surface, its light
                           // there is spurious and grows as 2 pi z/H: a guard bounds it by 3 pi/guard
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
                              // and geometry, and never below the true one; before it was called, the tolerance. Grows
                              // where the mean free path is below a ten-millionth of the diagonal: LIMITS
    double path_tolerance;    // what this path adds to it against plain C
    sss_bem_oracle oracle;
    sss_bem_path path;
    size_t triangle_count, vertex_count;
    size_t cluster_count;     // nodes of the hierarchy, triangles included
    size_t depth;
    size_t row_count;         // groups of receivers that share their links
    size_t link_count;        // stored links between a row (solid angle: a cluster) and a cluster or triangle
    size_t near_count;        // stored form factors between a vertex and a triangle, for those too near for a link
    size_t pending_rows;      // rows whose links are older than geometry or material
    size_t bytes;             // allocated, links included
    size_t link_bytes;        // of these, links
    // What the mesh is like, and what that does to the result: LIMITS.
    double edge_paths;        // mean edge in mean free paths 1/sigma_t', of the channel where these are shortest: above
                              // 1 the light is no longer linear between vertices
    double longest_edge_paths; // the longest edge, the same way
    double border_mm;         // edges without a partner that runs the other way, at least: holes, triangles turned
                              // over, T-junctions. 0: closed
    double normals_against;   // share of the area at whose corners given normals look away from their triangles
    int inside_out;           // 1: triangles enclose a negative volume: they look inwards
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

// New geometry, the same triangles: refits the hierarchy, O(T), and marks what moved. The irradiance stays. When the
// extents or the area have changed by a quarter since it was last done, the acceptance of links is calibrated again,
// which costs about half a frame on the bunny, and every link is marked.
//   positions  [V][3] in the mesh's units;   normals  [V][3] or NULL, as at creation
// Not concurrent with other calls on the same object. SSS_ERROR_INVALID_ARGUMENT, _OUT_OF_MEMORY, _OVERFLOW: the object
// is unchanged.
SSS_BEM_API sss_result sss_bem_set_vertices(sss_bem *bem, const float *positions, const float *normals);

// A new material: calibrates again and marks every link. Errors and concurrency as above.
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

// Measures the error on `count` vertices (0: 4,096), in whole rows spread over the mesh and weighted by area, for the
// present light, against the same sums at a tenth of the tolerance and 1e-3 at most; stats.predicted_error then holds
// it with its margin. Costs 6 to 9 count/V of a frame. Contribution oracle only; errors as sss_bem_shade. error may be
// NULL.
SSS_BEM_API sss_result sss_bem_predict_error(sss_bem *bem, size_t count, double *error);

// ---- 4. Looking inside ----

// What was chosen, and what it costs; looks at the mesh as it is now, O(T). SSS_ERROR_INVALID_ARGUMENT: null.
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

static size_t sss_bem__at_most(size_t a, size_t most)
{
    return a < most ? a : most;
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

// ---- the polygon in its plane ----

static void sss_bem__plain_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

// A vector as the sum of two, the second of which holds what the first one's rounding lost.
typedef struct sss_bem__exact
{
    double high[3], low[3];
} sss_bem__exact;

static double sss_bem__sum_error(double a, double b, double sum) // Knuth
{
    const double b_part = sum - a;
    return (a - (sum - b_part)) + (b - b_part);
}

static void sss_bem__exact_difference(const double a[3], const double b[3], sss_bem__exact *out)
{
    int i;
    for (i = 0; i < 3; i++)
    {
        out->high[i] = a[i] - b[i];
        out->low[i] = sss_bem__sum_error(a[i], -b[i], out->high[i]);
    }
}

// Adds a x b to sum.
static void sss_bem__add_cross(const sss_bem__exact *a, const sss_bem__exact *b, sss_bem__exact *sum)
{
    int i;
    for (i = 0; i < 3; i++)
    {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double p = a->high[j] * b->high[k], q = a->high[k] * b->high[j], high = p - q;
        const double low = sss_bem__sum_error(p, -q, high)
                           + (sss_bem__product_error(a->high[j], b->high[k], p)
                              - sss_bem__product_error(a->high[k], b->high[j], q))
                           + (a->high[j] * b->low[k] + a->low[j] * b->high[k])
                           - (a->high[k] * b->low[j] + a->low[k] * b->high[j]);
        const double total = sum->high[i] + high;
        sum->low[i] += sss_bem__sum_error(sum->high[i], high, total) + low;
        sum->high[i] = total;
    }
}

// a . b with its own relative accuracy.
static double sss_bem__exact_dot(const sss_bem__exact *a, const sss_bem__exact *b)
{
    double sum = 0.0, rest = 0.0;
    int i;
    for (i = 0; i < 3; i++)
    {
        const double product = a->high[i] * b->high[i], total = sum + product;
        rest += sss_bem__sum_error(sum, product, total) + sss_bem__product_error(a->high[i], b->high[i], product)
                + a->high[i] * b->low[i] + a->low[i] * b->high[i];
        sum = total;
    }
    return sum + rest;
}

// The polygon's plane. Its first axis is the longest edge, so that the second coordinate of a point of a slim polygon,
// an area over the edge's length, has its own relative accuracy; a rounded axis would leave 1e-16 of the length.
typedef struct sss_bem__plane
{
    const double *corners;
    size_t count;
    size_t base;                 // the corner next to the source: offsets count from it
    sss_bem__exact normal, axis; // twice the area's vector (Newell); the longest edge
    double area2, length;        // their lengths
    int single;                  // a triangle for the float path: plain arithmetic is enough
} sss_bem__plane;

// 0 where the polygon has no area.
static int sss_bem__make_plane(const double *corners, size_t count, const double source[3], int single,
                               sss_bem__plane *out)
{
    sss_bem__exact a, b;
    double nearest = HUGE_VAL, longest = 0.0;
    size_t k, of = 0;
    memset(out, 0, sizeof *out);
    out->corners = corners;
    out->count = count;
    out->single = single;
    for (k = 0; k < count; k++)
    {
        double d[3], square;
        sss_bem__subtract(corners + 3 * k, source, d);
        square = sss_bem__dot(d, d);
        out->base = square < nearest ? k : out->base;
        nearest = sss_bem__min(nearest, square);
        sss_bem__subtract(corners + 3 * ((k + 1) % count), corners + 3 * k, d);
        of = sss_bem__dot(d, d) > longest ? k : of;
        longest = sss_bem__max(longest, sss_bem__dot(d, d));
    }
    sss_bem__exact_difference(corners + 3 * ((of + 1) % count), corners + 3 * of, &out->axis);
    out->length = sqrt(longest);
    for (k = 1; k + 1 < count; k++)
    {
        sss_bem__exact_difference(corners + 3 * k, corners, &a);
        sss_bem__exact_difference(corners + 3 * (k + 1), corners, &b);
        if (single)
        {
            sss_bem__plain_cross(a.high, b.high, out->normal.high);
        }
        else
        {
            sss_bem__add_cross(&a, &b, &out->normal);
        }
    }
    out->area2 = sss_bem__length(out->normal.high);
    return out->area2 > 0.0;
}

// The vector from one point to another, in the plane.
static void sss_bem__in_plane(const sss_bem__plane *plane, const double from[3], const double to[3], double out[2])
{
    sss_bem__exact d, area;
    if (plane->single)
    {
        double plain[3], cross[3];
        sss_bem__subtract(to, from, plain);
        sss_bem__plain_cross(plane->axis.high, plain, cross);
        out[0] = sss_bem__dot(plane->axis.high, plain) / plane->length;
        out[1] = sss_bem__dot(plane->normal.high, cross) / plane->area2 / plane->length;
        return;
    }
    memset(&area, 0, sizeof area);
    sss_bem__exact_difference(to, from, &d);
    sss_bem__add_cross(&plane->axis, &d, &area);
    out[0] = sss_bem__exact_dot(&plane->axis, &d) / plane->length;
    out[1] = sss_bem__exact_dot(&plane->normal, &area) / plane->area2 / plane->length;
}

// The same of a corner from the base.
static void sss_bem__offset(const sss_bem__plane *plane, size_t k, double out[2])
{
    sss_bem__in_plane(plane, plane->corners + 3 * plane->base, plane->corners + 3 * (k % plane->count), out);
}

// What is gathered along the edges of the polygon, or of a piece.
typedef struct sss_bem__outline
{
    double distance2, farthest2; // squares of the distances of the nearest point and the farthest corner from q
    double longest2;            // of the longest edge
    double center[2];           // sum of the corners' offsets
    int winding;                // about q
} sss_bem__outline;

// Square of the distance of q from the edge e between two points seen from q.
static double sss_bem__edge_distance2(const double a[2], const double e[2], double length2)
{
    double t = length2 > 0.0 ? -(a[0] * e[0] + a[1] * e[1]) / length2 : 0.0, x, y;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    x = a[0] + t * e[0];
    y = a[1] + t * e[1];
    return x * x + y * y;
}

static void sss_bem__start_outline(sss_bem__outline *o)
{
    memset(o, 0, sizeof *o);
    o->distance2 = HUGE_VAL;
}

// Adds the edge between two offsets.
static void sss_bem__add_outline(const double base[2], const double from[2], const double to[2], sss_bem__outline *o)
{
    const double a[2] = {base[0] + from[0], base[1] + from[1]}, b[2] = {base[0] + to[0], base[1] + to[1]};
    const double e[2] = {to[0] - from[0], to[1] - from[1]}, length2 = e[0] * e[0] + e[1] * e[1];
    if ((a[1] <= 0.0) != (b[1] <= 0.0)) // the edge crosses the axis: to the right of q?
    {
        const double side = sss_bem__difference_of_products(a[0], b[1], a[1], b[0]);
        o->winding += b[1] > 0.0 ? side > 0.0 : -(side < 0.0);
    }
    o->longest2 = sss_bem__max(o->longest2, length2);
    o->farthest2 = sss_bem__max(o->farthest2, a[0] * a[0] + a[1] * a[1]);
    o->distance2 = sss_bem__min(o->distance2, sss_bem__edge_distance2(a, e, length2));
    o->center[0] += from[0];
    o->center[1] += from[1];
}

static double sss_bem__nearest_of(const sss_bem__outline *o, double H)
{
    return o->winding != 0 ? H : sqrt(o->distance2 + H * H);
}

// A polygon in its own plane: the source projects to the origin q. Corners are kept as offsets from one of them,
// so that differences between points keep their digits however far the source is.
typedef struct sss_bem__flat
{
    double H;          // height of the source over the plane, >= 0
    double sigma;
    double base[2];    // the corner that offsets count from, seen from q
    double s_near;     // nearest distance of the source from the polygon
    int inside;        // q lies in the polygon
    int on_polygon;    // the source lies in the polygon: infinite
    int slim;          // much longer than it is wide
    // How G is referred to: for the polygon, or for the piece of a triangle that is next.
    double center[2];  // offset of the point of reference
    double s_c, C;     // its distance from the source, and G there
    int about_q;       // the point of reference is q
    // What the tolerance asks for.
    const double (*rule)[2];
    int rule_size;
    double reach;      // sigma (s - s_c) beyond which G is nothing beside C
    const double (*far_rule)[2];
    int far_size;
    double far_ratio;  // a piece is far if it is smaller than this times its distance
    double far_decay;  // and than this over sigma, or varies in distance by an eighth of that
    int single;        // strips are integrated in float
    double corner[3][2]; // offsets, of a triangle
    double gradient[3][2]; // of its barycentric coordinates
    const sss_bem__plane *plane;
    const double *source;
} sss_bem__flat;

// G(s) = exp(-sigma s)/s, the antiderivative of eq. 10: (1 + sigma s) exp(-sigma s)/s^3 rho drho = -dG.
static double sss_bem__G(double sigma, double s)
{
    return exp(-sigma * s) / s;
}

// ---- edges ----

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
    e->p = sss_bem__difference_of_products(a[0], y, a[1], x) / e->length;
    e->t_start = a[0] * e->direction[0] + a[1] * e->direction[1];
    return 1;
}

// Corner k's edge of the whole polygon, near whose line q lies: p from the corners themselves, because what rounding
// left of it may be no more than 1e-16 of the edge's length.
static void sss_bem__sharpen_side(const sss_bem__flat *f, size_t k, sss_bem__side *e)
{
    const double *from = f->plane->corners + 3 * k, *to = f->plane->corners + 3 * ((k + 1) % f->plane->count);
    sss_bem__exact start, edge, area;
    if (f->single || fabs(e->p) > 1e-3 * e->length)
    {
        return;
    }
    memset(&area, 0, sizeof area);
    sss_bem__exact_difference(from, f->source, &start);
    sss_bem__exact_difference(to, from, &edge);
    sss_bem__add_cross(&start, &edge, &area);
    e->p = sss_bem__exact_dot(&area, &f->plane->normal) / f->plane->area2 / e->length;
    e->t_start = sss_bem__exact_dot(&start, &edge) / e->length;
}

// C - G at the point of an edge at t, without cancellation: from s^2 - s_c^2 and expm1.
static double sss_bem__C_minus_G(const sss_bem__flat *f, const sss_bem__side *e, double t)
{
    const double along = t - e->t_start, rho2 = e->p * e->p + t * t, s = sqrt(rho2 + f->H * f->H);
    const double d[2] = {e->start[0] + along * e->direction[0], e->start[1] + along * e->direction[1]};
    const double squares = f->about_q ? rho2
                                      : (d[0] - f->center[0]) * (2.0 * f->base[0] + d[0] + f->center[0])
                                            + (d[1] - f->center[1]) * (2.0 * f->base[1] + d[1] + f->center[1]);
    const double s_s_c = squares / (s + f->s_c); // s - s_c
    if (s_s_c >= 0.0)
    {
        return f->C * (s_s_c / s - f->s_c / s * expm1(-f->sigma * s_s_c));
    }
    return sss_bem__G(f->sigma, s) * (s_s_c / f->s_c + s / f->s_c * expm1(f->sigma * s_s_c));
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
            const double t = middle + sign * half * f->rule[i][0];
            const double term = half * f->rule[i][1] * sss_bem__C_minus_G(f, e, t);
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

// ---- the polygon as the source sees it ----

// Chooses the constant C. Inside, only C = G(H) is right, because the angles sum to 2 pi; outside, where they sum to
// 0, any C is, and the G of a point of the polygon keeps the terms as small as the result. Just outside, where
// G(H) is not much more than the G of the nearest point, C = G(H) does both.
static void sss_bem__choose_reference(sss_bem__flat *f, const sss_bem__outline *o, size_t count)
{
    const double d[2] = {o->center[0] / (double)count, o->center[1] / (double)count};
    const double x = f->base[0] + d[0], y = f->base[1] + d[1];
    f->about_q = o->winding != 0 || (o->distance2 < 0.25 * f->H * f->H && o->distance2 < o->longest2
                                     && f->sigma * (sss_bem__nearest_of(o, f->H) - f->H) < 1.0);
    f->center[0] = d[0];
    f->center[1] = d[1];
    f->s_c = f->about_q ? f->H : sqrt(x * x + y * y + f->H * f->H);
    f->C = f->s_c > 0.0 ? sss_bem__G(f->sigma, f->s_c) : 0.0;
}

// Longest edge over altitude, above which a triangle is slim: its long edges all but cancel, and it is halved.
#define SSS_BEM__SLIM 16.0
#define SSS_BEM__DEEPEST 160 // halvings of a slim triangle

// Rules and limits for a tolerance. Edges of what is not slim cancel to an eighth at worst. A Gauss rule of n nodes on
// a far strip leaves about (4/far_ratio)^(-2n) of it.
static void sss_bem__choose_rule(sss_bem__flat *f, double tolerance, double slimness)
{
    const double edges = tolerance / sss_bem__max(1.0, 0.5 * sss_bem__min(slimness, SSS_BEM__SLIM));
    f->rule = edges >= 1e-4 ? sss_bem__gauss4 : edges >= 1e-8 ? sss_bem__gauss8 : sss_bem__gauss16;
    f->rule_size = edges >= 1e-4 ? 2 : edges >= 1e-8 ? 4 : 8;
    f->reach = edges >= 1e-4 ? 18.0 : edges >= 1e-8 ? 28.0 : 45.0;
    f->far_rule = tolerance >= 1e-4 ? sss_bem__gauss4 : sss_bem__gauss8;
    f->far_size = tolerance >= 1e-4 ? 2 : 4;
    f->far_ratio = tolerance >= 1e-8 ? 0.8 : 0.5;
    f->far_decay = tolerance >= 1e-4 ? 1.5 : 2.0;
    if (f->single)
    {
        f->reach = 18.0;
        f->far_ratio = 0.5;
        f->far_decay = 1.0;
    }
}

// Whether a source in the plane lies on an edge, or at a corner.
static int sss_bem__on_border(const sss_bem__plane *plane, const double source[3])
{
    size_t k;
    for (k = 0; k < plane->count; k++)
    {
        sss_bem__exact edge, from, to, area;
        memset(&area, 0, sizeof area);
        sss_bem__exact_difference(plane->corners + 3 * k, source, &from);
        sss_bem__exact_difference(plane->corners + 3 * ((k + 1) % plane->count), source, &to);
        sss_bem__exact_difference(plane->corners + 3 * ((k + 1) % plane->count), plane->corners + 3 * k, &edge);
        sss_bem__add_cross(&from, &edge, &area);
        if (sss_bem__length(area.high) == 0.0 && sss_bem__exact_dot(&from, &to) <= 0.0)
        {
            return 1;
        }
    }
    return 0;
}

// Reads the polygon into its plane. 0 where it has no area.
static int sss_bem__flatten(const double *corners, size_t count, const double source[3], double sigma,
                            double tolerance, int single, sss_bem__plane *plane, sss_bem__flat *f)
{
    sss_bem__exact to_base;
    sss_bem__outline o;
    double from[2], to[2], perimeter = 0.0, slimness;
    size_t k;
    memset(f, 0, sizeof *f);
    if (!sss_bem__make_plane(corners, count, source, single, plane))
    {
        return 0;
    }
    f->plane = plane;
    f->source = source;
    f->sigma = sigma;
    f->single = single;
    sss_bem__exact_difference(corners + 3 * plane->base, source, &to_base);
    f->H = fabs(single ? sss_bem__dot(to_base.high, plane->normal.high)
                       : sss_bem__exact_dot(&to_base, &plane->normal)) / plane->area2;
    sss_bem__in_plane(plane, source, corners + 3 * plane->base, f->base);
    sss_bem__start_outline(&o);
    sss_bem__offset(plane, 0, from);
    for (k = 0; k < count; k++)
    {
        sss_bem__offset(plane, k + 1, to);
        sss_bem__add_outline(f->base, from, to, &o);
        perimeter += count > 3 ? hypot(to[0] - from[0], to[1] - from[1]) : 0.0;
        from[0] = f->corner[(k + 1) % 3][0] = to[0]; // kept of triangles
        from[1] = f->corner[(k + 1) % 3][1] = to[1];
    }
    f->inside = o.winding != 0;
    f->s_near = sss_bem__nearest_of(&o, f->H);
    f->on_polygon = f->H == 0.0 && (f->inside || sss_bem__on_border(plane, source));
    slimness = (count > 3 ? 0.25 * perimeter * perimeter : o.longest2) / plane->area2;
    f->slim = slimness > SSS_BEM__SLIM;
    sss_bem__choose_reference(f, &o, count);
    sss_bem__choose_rule(f, tolerance, slimness);
    return 1;
}

// ---- triangles by pieces ----
// A triangle that is far from the source for its size, or slim, is not integrated along its edges, whose sum cancels
// by (distance/size)^2 and by length/width, but over its area, where nothing cancels: a slim one is cut across until
// its pieces are far, or no longer slim. Those that stay near are integrated along the edges.

// A strip: the points (1 - b) bottom(a) + b top(a), with bottom and top linear in a and all cuts a = constant parallel,
// so that dA = ((1 - a) J[0] + a J[1]) da db. A triangle is one with a tip at a = 0.
typedef struct sss_bem__strip
{
    double x[2][2][2];      // offsets: [end][bottom, top]
    double weight[2][2][3]; // barycentric coordinates of the triangle
    double J[2];            // halved along with the strip, so that they keep their digits
    int whole;              // it is the polygon, its corners in their order
} sss_bem__strip;

// The integral over a triangle, and those with the barycentric coordinates as weights, over z.
typedef struct sss_bem__piece_sums
{
    double whole, part[3];
} sss_bem__piece_sums;

// By the Gauss rule in both directions.
static void sss_bem__far_strip(const sss_bem__flat *f, const sss_bem__strip *t, sss_bem__piece_sums *sums)
{
    const int n = 2 * f->far_size;
    int i, j, k;
    for (i = 0; i < n; i++)
    {
        const double *gauss_a = f->far_rule[i / 2];
        const double a = 0.5 + (i % 2 ? 0.5 : -0.5) * gauss_a[0];
        const double J = 0.25 * gauss_a[1] * ((1.0 - a) * t->J[0] + a * t->J[1]);
        for (j = 0; j < n; j++)
        {
            const double *gauss_b = f->far_rule[j / 2];
            const double b = 0.5 + (j % 2 ? 0.5 : -0.5) * gauss_b[0];
            const double at[4] = {(1.0 - a) * (1.0 - b), (1.0 - a) * b, a * (1.0 - b), a * b};
            const double x = f->base[0] + at[0] * t->x[0][0][0] + at[1] * t->x[0][1][0] + at[2] * t->x[1][0][0]
                             + at[3] * t->x[1][1][0];
            const double y = f->base[1] + at[0] * t->x[0][0][1] + at[1] * t->x[0][1][1] + at[2] * t->x[1][0][1]
                             + at[3] * t->x[1][1][1];
            const double s2 = x * x + y * y + f->H * f->H, s = sqrt(s2);
            const double term = J * gauss_b[1] * (1.0 + f->sigma * s) * exp(-f->sigma * s) / (s2 * s);
            sums->whole += term;
            for (k = 0; k < 3; k++)
            {
                sums->part[k] += term * (at[0] * t->weight[0][0][k] + at[1] * t->weight[0][1][k]
                                         + at[2] * t->weight[1][0][k] + at[3] * t->weight[1][1][k]);
            }
        }
    }
}

// The edges of a strip, one after the other: from corner k to the next. 0 where it has no length.
static int sss_bem__strip_side(const sss_bem__flat *f, const sss_bem__strip *t, int k, sss_bem__side *e)
{
    static const int corner[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}; // [end, top]
    const double *from = t->x[corner[k][0]][corner[k][1]], *to = t->x[corner[k + 1][0]][corner[k + 1][1]];
    return sss_bem__make_side(f, from, to, e);
}

// Along the edges. lambda_k = lambda_k(q) + grad lambda_k . (x - q), and int (x - q) K dA = -int grad G dA
// = -sum_edges n int G dt by Gauss's theorem, n outward; with C - G in the place of -G because the edges' normals sum
// to 0.
static void sss_bem__near_strip(sss_bem__flat *f, const sss_bem__outline *o, const sss_bem__strip *t,
                                sss_bem__piece_sums *sums)
{
    double theta = 0.0, moment[2] = {0.0, 0.0};
    sss_bem__side e;
    int k, i;
    sss_bem__choose_reference(f, o, 4);
    for (k = 0; k < 4; k++)
    {
        if (sss_bem__strip_side(f, t, k, &e))
        {
            sss_bem__edge_sum sum;
            if (t->whole && k < 3)
            {
                sss_bem__sharpen_side(f, (size_t)k, &e);
            }
            sum = sss_bem__side_integral(f, &e);
            theta += sum.theta;
            moment[0] += e.direction[1] * sum.line; // the outward normal is (direction y, -direction x)
            moment[1] -= e.direction[0] * sum.line;
        }
    }
    sums->whole += theta;
    for (k = 0; k < 3; k++)
    {
        double at_q = t->weight[1][0][k];
        for (i = 0; i < 2; i++)
        {
            at_q -= f->gradient[k][i] * (f->base[i] + t->x[1][0][i]);
        }
        sums->part[k] += at_q * theta + f->gradient[k][0] * moment[0] + f->gradient[k][1] * moment[1];
    }
}

// ---- strips in float: lengths in units of the source's distance from the whole, so that any unit will do ----

// By Gauss's rule of three nodes in both directions.
static void sss_bem__far_strip_float(const sss_bem__flat *f, const sss_bem__strip *t, sss_bem__piece_sums *sums)
{
    static const float rule[3][2] = {{0.11270167f, 0.27777778f}, {0.5f, 0.44444444f}, {0.88729833f, 0.27777778f}};
    const float sigma = (float)f->sigma, H2 = (float)(f->H * f->H);
    const float J[2] = {(float)t->J[0], (float)t->J[1]};
    float x[2][2][2], sum = 0.0f;
    int i, j, k;
    for (i = 0; i < 8; i++)
    {
        x[i / 4][i / 2 % 2][i % 2] = (float)(f->base[i % 2] + t->x[i / 4][i / 2 % 2][i % 2]);
    }
    for (i = 0; i < 3; i++)
    {
        const float a = rule[i][0], weight = rule[i][1] * ((1.0f - a) * J[0] + a * J[1]);
        for (j = 0; j < 3; j++)
        {
            const float b = rule[j][0];
            float s2 = H2, s;
            for (k = 0; k < 2; k++)
            {
                const float bottom = x[0][0][k] + a * (x[1][0][k] - x[0][0][k]);
                const float top = x[0][1][k] + a * (x[1][1][k] - x[0][1][k]);
                s2 += (bottom + b * (top - bottom)) * (bottom + b * (top - bottom));
            }
            s = sqrtf(s2);
            sum += weight * rule[j][1] * (1.0f + sigma * s) * expf(-sigma * (s - 1.0f)) / (s2 * s);
        }
    }
    sums->whole += (double)sum;
}

// Widest panel in w and in sigma s, for six Gauss nodes.
#define SSS_BEM__PANEL_WIDTH 2.0f
#define SSS_BEM__PANEL_DECAY 3.0f

// Gauss-Legendre nodes > 0 and weights of six.
static const float sss_bem__gauss6[3][2] = {{0.23861919f, 0.46791393f},
                                            {0.66120939f, 0.36076157f},
                                            {0.93246951f, 0.17132449f}};

// A source, as the edges of a piece see it.
typedef struct sss_bem__view_float
{
    float sigma, H;
    float s_c, C; // G is C at that distance
    int about_q;
} sss_bem__view_float;

// (C - G) s/rho^2 at a distance s. About q, where s^2 = rho^2 + H^2, it is C (1 + sigma H (1 - exp(-x))/x)/(s + H) with
// x = sigma (s - H): not even at the foot of q on an edge is there a difference to lose digits.
static float sss_bem__integrand_float(const sss_bem__view_float *v, float rho2, float s)
{
    if (v->about_q)
    {
        const float over = 1.0f / (s + v->H), x = v->sigma * rho2 * over;
        const float mean = x < 0.02f ? 1.0f - x * (0.5f - x * (1.0f / 6.0f)) : (1.0f - expf(-x)) / x;
        return v->C * over * (1.0f + v->sigma * v->H * mean);
    }
    return (v->C * s - expf(-v->sigma * (s - 1.0f))) / rho2;
}

// int (C - G) dtheta over t in [a, b], G over exp(-sigma). With t = S sinh w, S^2 = p^2 + H^2, s is S cosh w, dt is
// s dw: the integrand is smooth in w however close the source is to the edge, and a long edge is short in w.
static float sss_bem__panels_float(const sss_bem__view_float *v, float p, float S, float a, float b)
{
    const float s_a = sqrtf(S * S + a * a), s_b = sqrtf(S * S + b * b);
    const float low = a < 0.0f ? S / (s_a - a) : (s_a + a) / S; // exp(asinh(a/S)), without cancellation
    const float high = b < 0.0f ? S / (s_b - b) : (s_b + b) / S;
    const float s_low = a * b < 0.0f ? S : s_a < s_b ? s_a : s_b, s_high = s_a < s_b ? s_b : s_a;
    const float range = logf(high / low);
    // The nearest singularity is where s = 0, pi/2 away in w; not about q also where rho = 0, which may be nearer.
    const float t_least = a * b < 0.0f ? 0.0f : fabsf(a) < fabsf(b) ? a : b;
    const float ratio = v->about_q ? 1.0f : sqrtf(p * p + t_least * t_least) / S;
    const float by_width = range / (SSS_BEM__PANEL_WIDTH * (ratio < 1.0f ? ratio : 1.0f));
    const float by_decay = v->sigma * (s_high - s_low) / SSS_BEM__PANEL_DECAY;
    const int panels = 1 + (int)(by_width > by_decay ? by_width : by_decay);
    const float half = 0.5f * range / (float)panels, stride = expf(2.0f * half);
    float step[3], middle = low * expf(half), sum = 0.0f;
    int panel, i, sign;
    for (i = 0; i < 3; i++)
    {
        step[i] = expf(half * sss_bem__gauss6[i][0]);
    }
    for (panel = 0; panel < panels; panel++, middle *= stride)
    {
        for (i = 0; i < 3; i++)
        {
            for (sign = 0; sign < 2; sign++)
            {
                const float e = sign ? middle * step[i] : middle / step[i], over = 1.0f / e; // exp(w)
                const float s = 0.5f * S * (e + over), t = 0.5f * S * (e - over);
                sum += sss_bem__gauss6[i][1] * sss_bem__integrand_float(v, p * p + t * t, s);
            }
        }
    }
    return half * p * sum;
}

// int dtheta over t in [a, b].
static float sss_bem__angle(float p, float a, float b)
{
    return atan2f(p * (b - a), p * p + a * b);
}

// int (C - G) dtheta along an edge. What is so far away that G is nothing beside C is C dtheta.
static float sss_bem__edge_float(const sss_bem__view_float *v, const sss_bem__side *e)
{
    const float p = (float)e->p, a = (float)e->t_start, b = (float)(e->t_start + e->length);
    const float S = sqrtf(p * p + v->H * v->H), s_high = v->s_c + 18.0f / (v->sigma > 1e-9f ? v->sigma : 1e-9f);
    const float t_high = S < s_high ? sqrtf((s_high - S) * (s_high + S)) : 0.0f;
    const float low = a > -t_high ? a : -t_high, high = b < t_high ? b : t_high;
    float sum;
    if (!(fabsf(p) > 1e-12f))
    {
        return 0.0f; // the edge points at q
    }
    if (!(low < high))
    {
        return v->C * sss_bem__angle(p, a, b);
    }
    sum = sss_bem__panels_float(v, p, S, low, high);
    sum += a < low ? v->C * sss_bem__angle(p, a, low) : 0.0f;
    sum += high < b ? v->C * sss_bem__angle(p, high, b) : 0.0f;
    return sum;
}

// The same choice of C as in sss_bem__choose_reference, with G(H) taken as far as the digits last.
static void sss_bem__near_strip_float(sss_bem__flat *f, const sss_bem__outline *o, const sss_bem__strip *t,
                                      sss_bem__piece_sums *sums)
{
    const double s_near = sss_bem__nearest_of(o, f->H);
    sss_bem__view_float v;
    int k;
    v.sigma = (float)f->sigma;
    v.H = (float)f->H;
    v.about_q = s_near < 4.0 * f->H && f->sigma * (s_near - f->H) < 1.5;
    v.s_c = (float)(v.about_q ? f->H : s_near);
    v.C = expf(-v.sigma * (v.s_c - 1.0f)) / v.s_c;
    for (k = 0; k < 4; k++)
    {
        sss_bem__side e;
        if (sss_bem__strip_side(f, t, k, &e))
        {
            sums->whole += (double)sss_bem__edge_float(&v, &e);
        }
    }
}

// The half of a strip at one of its ends.
static void sss_bem__halve(const sss_bem__strip *t, int end, sss_bem__strip *out)
{
    int side, k;
    *out = *t;
    out->whole = 0;
    for (side = 0; side < 2; side++)
    {
        for (k = 0; k < 3; k++)
        {
            out->weight[1 - end][side][k] = 0.5 * (t->weight[0][side][k] + t->weight[1][side][k]);
        }
        for (k = 0; k < 2; k++)
        {
            out->x[1 - end][side][k] = 0.5 * (t->x[0][side][k] + t->x[1][side][k]);
        }
    }
    out->J[end] = 0.5 * t->J[end];
    out->J[1 - end] = 0.25 * (t->J[0] + t->J[1]);
}

static void sss_bem__add_strip(sss_bem__flat *f, const sss_bem__strip *t, int depth, sss_bem__piece_sums *sums)
{
    sss_bem__outline o;
    sss_bem__strip half;
    double s_near, longest, decay;
    sss_bem__start_outline(&o);
    sss_bem__add_outline(f->base, t->x[0][0], t->x[1][0], &o);
    sss_bem__add_outline(f->base, t->x[1][0], t->x[1][1], &o);
    sss_bem__add_outline(f->base, t->x[1][1], t->x[0][1], &o);
    sss_bem__add_outline(f->base, t->x[0][1], t->x[0][0], &o);
    s_near = sss_bem__nearest_of(&o, f->H);
    longest = sqrt(o.longest2);
    if (f->sigma * (s_near - f->s_near) > f->reach)
    {
        return; // nothing beside the rest of the triangle
    }
    // exp(-sigma s) is as tame as sigma s varies, but less so where that bends: under the source
    decay = f->sigma * sss_bem__min(longest, 8.0 * (sqrt(o.farthest2 + f->H * f->H) - s_near));
    if (longest <= f->far_ratio * s_near && decay <= f->far_decay)
    {
        (f->single ? sss_bem__far_strip_float : sss_bem__far_strip)(f, t, sums);
    }
    else if (o.longest2 <= SSS_BEM__SLIM * (t->J[0] + t->J[1]) || depth == SSS_BEM__DEEPEST)
    {
        (f->single ? sss_bem__near_strip_float : sss_bem__near_strip)(f, &o, t, sums);
    }
    else
    {
        sss_bem__halve(t, 0, &half);
        sss_bem__add_strip(f, &half, depth + 1, sums);
        sss_bem__halve(t, 1, &half);
        sss_bem__add_strip(f, &half, depth + 1, sums);
    }
}

// A strip from a tip to the edge between two other points, each with its barycentric coordinates.
static void sss_bem__add_wedge(sss_bem__flat *f, const double tip[2], const double bottom[2], const double top[2],
                               const double tip_weight[3], const double bottom_weight[3], const double top_weight[3],
                               double area2, int whole, sss_bem__piece_sums *sums)
{
    sss_bem__strip t;
    int side;
    for (side = 0; side < 2; side++)
    {
        memcpy(t.x[0][side], tip, sizeof t.x[0][side]);
        memcpy(t.x[1][side], side ? top : bottom, sizeof t.x[1][side]);
        memcpy(t.weight[0][side], tip_weight, sizeof t.weight[0][side]);
        memcpy(t.weight[1][side], side ? top_weight : bottom_weight, sizeof t.weight[1][side]);
    }
    t.J[0] = 0.0;
    t.J[1] = area2;
    t.whole = whole;
    sss_bem__add_strip(f, &t, 0, sums);
}

// A triangle of three corners' offsets: as one strip, or, if it is slim, as two from the ends of its longest edge to
// the altitude.
static void sss_bem__add_triangle(const sss_bem__flat *f, const double x[3][2], double area2,
                                  sss_bem__piece_sums *sums)
{
    static const double unit[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    sss_bem__flat work = *f; // its reference moves from strip to strip
    double length2[3], foot[2], share, split[3] = {0.0, 0.0, 0.0};
    int k, a, b, c;
    for (k = 0; k < 3; k++)
    {
        const double *from = x[k], *to = x[(k + 1) % 3], e[2] = {to[0] - from[0], to[1] - from[1]};
        length2[k] = e[0] * e[0] + e[1] * e[1];
        work.gradient[(k + 2) % 3][0] = -e[1] / area2; // of the opposite corner's coordinate
        work.gradient[(k + 2) % 3][1] = e[0] / area2;
    }
    a = length2[0] >= length2[1] && length2[0] >= length2[2] ? 0 : length2[1] >= length2[2] ? 1 : 2;
    b = (a + 1) % 3;
    c = (a + 2) % 3;
    if (length2[a] <= SSS_BEM__SLIM * area2)
    {
        sss_bem__add_wedge(&work, x[0], x[1], x[2], unit[0], unit[1], unit[2], area2, f->plane->count == 3, sums);
        return;
    }
    share = ((x[c][0] - x[a][0]) * (x[b][0] - x[a][0]) + (x[c][1] - x[a][1]) * (x[b][1] - x[a][1])) / length2[a];
    if (share * length2[a] < area2 || (1.0 - share) * length2[a] < area2) // no wide angle: one tip, one short edge
    {
        const int tip = share < 0.5 ? b : a;
        sss_bem__add_wedge(&work, x[tip], x[(tip + 1) % 3], x[(tip + 2) % 3], unit[tip], unit[(tip + 1) % 3],
                           unit[(tip + 2) % 3], area2, 0, sums);
        return;
    }
    split[a] = 1.0 - share;
    split[b] = share;
    foot[0] = x[a][0] + share * (x[b][0] - x[a][0]);
    foot[1] = x[a][1] + share * (x[b][1] - x[a][1]);
    sss_bem__add_wedge(&work, x[a], foot, x[c], unit[a], split, unit[c], share * area2, 0, sums);
    sss_bem__add_wedge(&work, x[b], x[c], foot, unit[b], unit[c], split, (1.0 - share) * area2, 0, sums);
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

// The edges of any polygon.
static double sss_bem__edges(const sss_bem__flat *f)
{
    double from[2], to[2], sum = 0.0;
    size_t k;
    sss_bem__offset(f->plane, 0, from);
    for (k = 0; k < f->plane->count; k++)
    {
        sss_bem__side e;
        sss_bem__offset(f->plane, k + 1, to);
        if (sss_bem__make_side(f, from, to, &e))
        {
            sss_bem__sharpen_side(f, k, &e);
            sum += e.p != 0.0 ? sss_bem__side_integral(f, &e).theta : 0.0;
        }
        from[0] = to[0];
        from[1] = to[1];
    }
    return sum;
}

// The triangles between the first corner of a polygon and each edge. 0 where one of them is turned over: the polygon is
// not convex.
static int sss_bem__add_fan(const sss_bem__flat *f, sss_bem__piece_sums *sums)
{
    double x[3][2];
    size_t k;
    sss_bem__offset(f->plane, 0, x[0]);
    sss_bem__offset(f->plane, 1, x[1]);
    for (k = 2; k < f->plane->count; k++)
    {
        double area2;
        sss_bem__offset(f->plane, k, x[2]);
        area2 = sss_bem__difference_of_products(x[1][0] - x[0][0], x[2][1] - x[0][1], x[1][1] - x[0][1],
                                                x[2][0] - x[0][0]);
        if (area2 < 0.0)
        {
            return 0;
        }
        if (area2 > 0.0)
        {
            sss_bem__add_triangle(f, (const double (*)[2])x, area2, sums);
        }
        x[1][0] = x[2][0];
        x[1][1] = x[2][1];
    }
    return 1;
}

// A triangle in units of the source's distance, so that floats do for any unit of length.
static void sss_bem__rescale(sss_bem__flat *f)
{
    const double scale = 1.0 / f->s_near;
    int i, k;
    for (i = 0; i < 2; i++)
    {
        f->base[i] *= scale;
        for (k = 0; k < 3; k++)
        {
            f->corner[k][i] *= scale;
        }
    }
    f->H *= scale;
    f->sigma *= f->s_near;
    f->s_near = 1.0;
}

SSS_BEM_API double sss_bem_form_factor_within(const double *corners, size_t corner_count, const double source[3],
                                              double z, double sigma, double tolerance)
{
    sss_bem__plane plane;
    sss_bem__flat f;
    sss_bem__piece_sums sums = {0.0, {0.0, 0.0, 0.0}};
    if (!sss_bem__valid_polygon(corners, corner_count, source, z, sigma) || !(tolerance >= 0.0 && tolerance <= 1.0))
    {
        return NAN;
    }
    if (z == 0.0 || !sss_bem__flatten(corners, corner_count, source, sigma, tolerance, 0, &plane, &f))
    {
        return 0.0;
    }
    if (f.on_polygon)
    {
        return sss_bem__infinite(z);
    }
    if (corner_count == 3)
    {
        sss_bem__add_triangle(&f, (const double (*)[2])f.corner, plane.area2, &sums);
        return z * sums.whole;
    }
    return z * (f.slim && sss_bem__add_fan(&f, &sums) ? sums.whole : sss_bem__edges(&f));
}

SSS_BEM_API double sss_bem_form_factor(const double *corners, size_t corner_count, const double source[3], double z,
                                       double sigma)
{
    return sss_bem_form_factor_within(corners, corner_count, source, z, sigma, 0.0);
}

SSS_BEM_API sss_result sss_bem_form_factor_linear(const double *corners, const double source[3], double z,
                                                  double sigma, double tolerance, double out[3])
{
    sss_bem__plane plane;
    sss_bem__flat f;
    sss_bem__piece_sums sums = {0.0, {0.0, 0.0, 0.0}};
    size_t k;
    if (out == NULL || !sss_bem__valid_polygon(corners, 3, source, z, sigma) || !(tolerance >= 0.0 && tolerance <= 1.0))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    out[0] = out[1] = out[2] = 0.0;
    if (z == 0.0 || !sss_bem__flatten(corners, 3, source, sigma, tolerance, 0, &plane, &f))
    {
        return SSS_OK;
    }
    if (f.on_polygon)
    {
        out[0] = out[1] = out[2] = sss_bem__infinite(z);
        return SSS_OK;
    }
    sss_bem__add_triangle(&f, (const double (*)[2])f.corner, plane.area2, &sums);
    for (k = 0; k < 3; k++)
    {
        out[k] = z * sums.part[k];
    }
    return SSS_OK;
}

SSS_BEM_API float sss_bem_form_factor_float(const float *corners, const float source[3], float z, float sigma)
{
    double exact[9], exact_source[3], s_near, area2;
    sss_bem__plane plane;
    sss_bem__flat f;
    sss_bem__piece_sums sums = {0.0, {0.0, 0.0, 0.0}};
    size_t k;
    if (corners == NULL || source == NULL || !sss_bem__all_finite(corners, 9) || !sss_bem__all_finite(source, 3)
        || !sss_bem__finite((double)z) || !sss_bem__finite((double)sigma) || sigma < 0.0f)
    {
        return (float)NAN;
    }
    for (k = 0; k < 9; k++)
    {
        exact[k] = (double)corners[k];
        exact_source[k % 3] = (double)source[k % 3];
    }
    if (z == 0.0f || !sss_bem__flatten(exact, 3, exact_source, (double)sigma, 1e-4, 1, &plane, &f))
    {
        return 0.0f;
    }
    if (f.on_polygon)
    {
        return (float)sss_bem__infinite((double)z);
    }
    s_near = f.s_near;
    area2 = plane.area2 / s_near / s_near;
    sss_bem__rescale(&f);
    sss_bem__add_triangle(&f, (const double (*)[2])f.corner, area2, &sums);
    return (float)((double)z / s_near * exp(-(double)sigma * s_near) * sums.whole);
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
    sss_bem__plane plane;
    sss_bem__flat f;
    double sum;
    size_t k;
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
    if (z == 0.0 || !sss_bem__flatten(corners, corner_count, source, sigma, 0.0, 0, &plane, &f))
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
        sss_bem__offset(&plane, k, from);
        sss_bem__offset(&plane, k + 1, to);
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

// ---- 2. What receivers get from clusters and triangles: the data ----

enum
{
    SSS_BEM__LANES = 16,   // receivers in a row: those share their links
    SSS_BEM__CLASSES = 256 // of sizes of clusters
};

// How light reaches receivers. Links are of a whole row: clusters by their moments, triangles that are nearer by points
// on them. Pairs are of one receiver and a triangle nearer still: by more points, or by the integrals over its edges.
enum
{
    SSS_BEM__FAR = 0,
    SSS_BEM__NEAR,
    SSS_BEM__CLOSE,
    SSS_BEM__EDGES,
    SSS_BEM__LONG_EDGES, // of a triangle much larger than its distance: more nodes
    SSS_BEM__KINDS,
    SSS_BEM__LINK_KINDS = SSS_BEM__CLOSE, // those below are links
    SSS_BEM__REACH_KINDS = SSS_BEM__EDGES // those below have a least distance
};

#define SSS_BEM__SLIVER 1e4f // longest edge over height, above which a triangle counts as a sliver
#define SSS_BEM__TINY 1e-18f // of the diagonal: a source on a triangle counts as that far from it

// A cluster. Lengths are fractions of the mesh's diagonal, from its center.
typedef struct sss_bem__node
{
    float center[3];   // centroid of the area
    float moment[6];   // second moments about it, per area: xx yy zz xy xz yz
    float radius;      // of a sphere about the center that holds it
    float area;
    uint32_t end;      // one past its subtree, which begins at its own index
    uint32_t triangle; // of a leaf, else UINT32_MAX
    uint32_t size;     // class, index into sss_bem.reach
    uint32_t stamp;    // when it last changed
} sss_bem__node;

// What a walk over the tree reads of it, two to a cache line.
typedef struct sss_bem__stop
{
    float center[3];
    float reach[2];    // how far from real and virtual sources it counts as its moments
    uint32_t end;
    uint16_t is_leaf;  // with an area
    uint16_t is_lit;
    float radius;
} sss_bem__stop;

// A cluster's light.
typedef struct sss_bem__light
{
    float v[12]; // [c]: int E dA, [3 + 3 c + i]: int E (x_i - center_i) dA
} sss_bem__light;

// Receivers in rows of lanes; unused lanes repeat the last receiver.
typedef struct sss_bem__lanes
{
    float x[3][SSS_BEM__LANES];
    float n[3][SSS_BEM__LANES];
} sss_bem__lanes;

// A Gauss rule on [-1, 1]: its nodes > 0, which stand for two each.
typedef struct sss_bem__rule
{
    int count;
    float node[8], weight[8];
} sss_bem__rule;

// The six sources: [0] real, [1] virtual.
typedef struct sss_bem__model
{
    float height[2][3];  // how deep below the receiver: z_r, -z_v
    float z[2][3];       // weight of eq. 8
    float guard2[2][3];  // (guard z)^2
    float least_guard[2], most_guard[2]; // guard z of the channels that scatter
    float guard_K[2][3]; // (1 + sigma s) exp(-sigma s)/s^3 there, 0 without a guard
    float guard_G[2][3]; // exp(-sigma s)/s there
    float height_range[2][2], over_height[2][2]; // of the channels that scatter: the heights' ends and their inverses
    float sigma[3];
    float scale[3];      // alpha'/(4 pi); 0 for a channel without scattering
    sss_bem__rule rule[2]; // of edges, of long edges
    int rough;             // the registers' own estimates of 1/sqrt and a short exp are good enough
    int half_k;            // k is kept in 16 bits
    size_t factor_words;
    float height2[2][3], square[2][3], weight[2][3], decay[3]; // 2 h, h^2, z scale, -sigma/ln 2: for the registers
} sss_bem__model;

// A link: which node, and a mask of the row's receivers that take it. A pair: which leaf, and which receiver.
typedef struct sss_bem__link
{
    uint32_t node;
    uint32_t who;
} sss_bem__link;

// A triangle's corners and unit normal.
typedef struct sss_bem__corners
{
    float x[3][3];
    float normal[3];
} sss_bem__corners;

// From where on a triangle no longer counts as its moments or as points. [kind]: of real and virtual sources.
typedef struct sss_bem__nearness
{
    float reach[SSS_BEM__REACH_KINDS][2]; // by distance
    float touch[2];                       // nearer than that, the guard may end on it
    float edge[SSS_BEM__REACH_KINDS][2];  // then: by the square of its plane's distance, over the source's height
} sss_bem__nearness;

// What a link or pair gives, for each channel and lane (of the row, or place in a block of pairs): k, a, b. A cluster
// gives k int E dA + (a w + b n) . int E (x - center) dA, with w from the receiver to the center and n the receiver's
// normal; a triangle with the irradiances E_0, E_1, E_2 at its corners gives k E_0 + a (E_1 - E_0) + b (E_2 - E_0).
// What render mode costs is reading these, so they are kept short: a and b, which only say how light varies, have 8
// bits of mantissa, and so has k at loose tolerances. Sums on the fly use the same rounded numbers.
//     words [0, 48): a in the upper half, b in the lower one, [channel][lane];   behind them k, in 32 bits or in 16
enum
{
    SSS_BEM__BATCH = 32, // links, or pairs, whose factors are computed at a time
    SSS_BEM__K_WORD = 3 * SSS_BEM__LANES,
    SSS_BEM__FACTOR_WORDS = 6 * SSS_BEM__LANES,      // at most
    SSS_BEM__HALF_FACTOR_WORDS = 9 * SSS_BEM__LANES / 2
};

// ---- the formulas, in plain C ----

static uint32_t sss_bem__bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static float sss_bem__from_bits(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static void sss_bem__put_factor(int half_k, uint32_t *factor, int c, int lane, const float kab[3])
{
    const size_t place = (size_t)(c * SSS_BEM__LANES + lane);
    const uint32_t a = sss_bem__bits(kab[1]) + 0x8000u, b = sss_bem__bits(kab[2]) + 0x8000u; // to the nearest
    const uint32_t k = sss_bem__bits(kab[0]);
    const uint16_t half = (uint16_t)((k + 0x8000u) >> 16);
    factor[place] = (a & 0xffff0000u) | b >> 16;
    if (half_k)
    {
        memcpy((unsigned char *)(factor + SSS_BEM__K_WORD) + place * sizeof half, &half, sizeof half);
    }
    else
    {
        factor[SSS_BEM__K_WORD + place] = k;
    }
}

static void sss_bem__put_factors(int half_k, uint32_t *factor, int lane, float (*kab)[3])
{
    int c;
    for (c = 0; c < 3; c++)
    {
        sss_bem__put_factor(half_k, factor, c, lane, kab[c]);
    }
}

static void sss_bem__get_factor(int half_k, const uint32_t *factor, int c, int lane, float kab[3])
{
    const size_t place = (size_t)(c * SSS_BEM__LANES + lane);
    uint16_t half;
    memcpy(&half, (const unsigned char *)(factor + SSS_BEM__K_WORD) + place * sizeof half, sizeof half);
    kab[0] = sss_bem__from_bits(half_k ? (uint32_t)half << 16 : factor[SSS_BEM__K_WORD + (half_k ? 0 : place)]);
    kab[1] = sss_bem__from_bits(factor[place] & 0xffff0000u);
    kab[2] = sss_bem__from_bits(factor[place] << 16);
}

// Gauss's rule with so many nodes on an edge: 4, 8 or 16.
static void sss_bem__set_rule(int nodes, sss_bem__rule *out)
{
    const double (*rule)[2] = nodes == 4 ? sss_bem__gauss4 : nodes == 8 ? sss_bem__gauss8 : sss_bem__gauss16;
    int i;
    memset(out, 0, sizeof *out);
    out->count = nodes / 2;
    for (i = 0; i < out->count; i++)
    {
        out->node[i] = (float)rule[i][0];
        out->weight[i] = (float)rule[i][1];
    }
}

// One source's share in the light of a cluster, by the moments about its centroid of area and light, to second order:
//     int E K(|x - d|) dA = k int E dA + (grad K) . int E (x - center) dA,   k = K + 1/2 C : grad grad K
//     K = (1 + u) exp(-u)/s^3,  grad K = -K_1 v,  grad grad K = -K_1 I + K_2 v v^T,  u = sigma s,  v = x - d = w + h n,
//     K_1 = (3 + 3u + u^2) exp(-u)/s^5,   K_2 = (15 + 15u + 6u^2 + u^3) exp(-u)/s^7
// v goes from the source to the centroid; what follows in v^T C v is C's form in w and n. Inside the guard K is
// constant.
static void sss_bem__cluster_source(const sss_bem__model *m, int kind, int c, const float squares[2],
                                    const float forms[4], float sums[3])
{
    const float h = m->height[kind][c];
    const float s2 = squares[0] + 2.0f * h * squares[1] + h * h;
    const float vCv = forms[0] + 2.0f * h * forms[1] + h * h * forms[2];
    const float limited = s2 > m->guard2[kind][c] ? s2 : m->guard2[kind][c];
    const float s = sqrtf(limited), u = m->sigma[c] * s, over = 1.0f / limited;
    const float a = m->z[kind][c] * m->scale[c] * expf(-u) * over / s;
    const float slope = s2 > m->guard2[kind][c] ? over * (3.0f + u * (3.0f + u)) : 0.0f;
    const float bend = s2 > m->guard2[kind][c] ? over * over * (15.0f + u * (15.0f + u * (6.0f + u))) : 0.0f;
    sums[0] += a * (1.0f + u + 0.5f * (bend * vCv - slope * forms[3]));
    sums[1] -= a * slope;
    sums[2] -= a * slope * h;
}

static float sss_bem__dotf(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// What sss_bem__cluster_source takes of a receiver and a cluster.
static void sss_bem__cluster_forms(const sss_bem__lanes *lanes, int lane, const sss_bem__node *node, float squares[2],
                                   float forms[4])
{
    const float *C = node->moment;
    float w[3], n[3], Cw[3], Cn[3];
    int i;
    for (i = 0; i < 3; i++)
    {
        w[i] = node->center[i] - lanes->x[i][lane];
        n[i] = lanes->n[i][lane];
    }
    for (i = 0; i < 3; i++) // rows of the symmetric matrix
    {
        static const int row[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
        Cw[i] = C[row[i][0]] * w[0] + C[row[i][1]] * w[1] + C[row[i][2]] * w[2];
        Cn[i] = C[row[i][0]] * n[0] + C[row[i][1]] * n[1] + C[row[i][2]] * n[2];
    }
    squares[0] = sss_bem__dotf(w, w);
    squares[1] = sss_bem__dotf(w, n);
    forms[0] = sss_bem__dotf(w, Cw);
    forms[1] = sss_bem__dotf(n, Cw);
    forms[2] = sss_bem__dotf(n, Cn);
    forms[3] = C[0] + C[1] + C[2];
}

static void sss_bem__cluster_factor(const sss_bem__model *m, const sss_bem__lanes *lanes, int lane,
                                    const sss_bem__node *node, float kab[3][3])
{
    float squares[2], forms[4];
    int c;
    sss_bem__cluster_forms(lanes, lane, node, squares, forms);
    for (c = 0; c < 3; c++)
    {
        kab[c][0] = kab[c][1] = kab[c][2] = 0.0f;
        sss_bem__cluster_source(m, 0, c, squares, forms, kab[c]);
        sss_bem__cluster_source(m, 1, c, squares, forms, kab[c]);
    }
}

// The dipole at a point, from a receiver whose squares are w.w and w.n.
static float sss_bem__point_factor(const sss_bem__model *m, int c, const float squares[2])
{
    float sum = 0.0f;
    int kind;
    for (kind = 0; kind < 2; kind++)
    {
        const float h = m->height[kind][c];
        const float s2 = squares[0] + 2.0f * h * squares[1] + h * h;
        const float limited = s2 > m->guard2[kind][c] ? s2 : m->guard2[kind][c];
        const float s = sqrtf(limited), u = m->sigma[c] * s;
        sum += m->z[kind][c] * m->scale[c] * (1.0f + u) * expf(-u) / (limited * s);
    }
    return sum;
}

// Rules on a triangle: barycentric coordinates and weights.
typedef struct sss_bem__points_rule
{
    int count;
    float point[16][4];
} sss_bem__points_rule;

static const sss_bem__points_rule sss_bem__near_rule = { // Radon, degree 5
    7,
    {{1.0f / 3.0f, 1.0f / 3.0f, 1.0f / 3.0f, 0.225f},
     {0.797426985f, 0.101286507f, 0.101286507f, 0.125939181f},
     {0.101286507f, 0.797426985f, 0.101286507f, 0.125939181f},
     {0.101286507f, 0.101286507f, 0.797426985f, 0.125939181f},
     {0.059715872f, 0.470142064f, 0.470142064f, 0.132394153f},
     {0.470142064f, 0.059715872f, 0.470142064f, 0.132394153f},
     {0.470142064f, 0.470142064f, 0.059715872f, 0.132394153f}}};

static const sss_bem__points_rule sss_bem__close_rule = { // Dunavant, degree 8
    16,
    {{1.0f / 3.0f, 1.0f / 3.0f, 1.0f / 3.0f, 0.144315608f},
     {0.081414823f, 0.459292588f, 0.459292588f, 0.095091634f},
     {0.459292588f, 0.081414823f, 0.459292588f, 0.095091634f},
     {0.459292588f, 0.459292588f, 0.081414823f, 0.095091634f},
     {0.658861384f, 0.170569308f, 0.170569308f, 0.103217371f},
     {0.170569308f, 0.658861384f, 0.170569308f, 0.103217371f},
     {0.170569308f, 0.170569308f, 0.658861384f, 0.103217371f},
     {0.898905543f, 0.050547228f, 0.050547228f, 0.032458498f},
     {0.050547228f, 0.898905543f, 0.050547228f, 0.032458498f},
     {0.050547228f, 0.050547228f, 0.898905543f, 0.032458498f},
     {0.008394777f, 0.263112830f, 0.728492393f, 0.027230314f},
     {0.008394777f, 0.728492393f, 0.263112830f, 0.027230314f},
     {0.263112830f, 0.008394777f, 0.728492393f, 0.027230314f},
     {0.263112830f, 0.728492393f, 0.008394777f, 0.027230314f},
     {0.728492393f, 0.008394777f, 0.263112830f, 0.027230314f},
     {0.728492393f, 0.263112830f, 0.008394777f, 0.027230314f}}};

// A triangle by points, from its corners as the receiver sees them: factors for the irradiance at the corners.
static void sss_bem__points_factor(const sss_bem__model *m, const sss_bem__points_rule *rule, const float w[3][3],
                                   const float n[3], float area, float kab[3][3])
{
    float x[3], squares[2], sums[3][3] = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
    int q, i, k, c;
    for (q = 0; q < rule->count; q++)
    {
        const float *at = rule->point[q];
        for (i = 0; i < 3; i++)
        {
            x[i] = at[0] * w[0][i] + at[1] * w[1][i] + at[2] * w[2][i];
        }
        squares[0] = sss_bem__dotf(x, x);
        squares[1] = sss_bem__dotf(x, n);
        for (c = 0; c < 3; c++)
        {
            const float K = at[3] * sss_bem__point_factor(m, c, squares);
            for (k = 0; k < 3; k++)
            {
                sums[k][c] += at[k] * K;
            }
        }
    }
    for (c = 0; c < 3; c++)
    {
        kab[c][0] = area * (sums[0][c] + sums[1][c] + sums[2][c]);
        kab[c][1] = area * sums[1][c];
        kab[c][2] = area * sums[2][c];
    }
}

// A triangle near a row.
static void sss_bem__near_factor(const sss_bem__model *m, const sss_bem__lanes *lanes, int lane,
                                 const sss_bem__corners *corners, float area, float kab[3][3])
{
    float w[3][3], n[3];
    int i, k;
    for (i = 0; i < 3; i++)
    {
        n[i] = lanes->n[i][lane];
        for (k = 0; k < 3; k++)
        {
            w[k][i] = corners->x[k][i] - lanes->x[i][lane];
        }
    }
    sss_bem__points_factor(m, &sss_bem__near_rule, (const float (*)[3])w, n, area, kab);
}

// A block of pairs, side by side: corners from the receiver, and the two normals.
typedef struct sss_bem__block
{
    float w[3][3][SSS_BEM__LANES];
    float n[3][SSS_BEM__LANES];
    float normal[3][SSS_BEM__LANES];
    float area[SSS_BEM__LANES];
} sss_bem__block;

// A triangle's edges as one receiver sees them; positions of the source along the receiver's normal are linear in its
// height h: distance from the plane H = H_0 + h H_n, and likewise p and t of each edge.
typedef struct sss_bem__view
{
    float H[2];         // [0] of the receiver, [1] per height
    float p[3][2];      // distance of the projection from the edge's line, positive inside
    float t[3][2];      // position of the edge's start, counted from the foot of the projection
    float length[3];
    float cosine[3];    // between the outward normals of edges k and k + 1
    float over_area;    // 1/(2 area)
    int sliver;         // lambda of a point far from it would lose all digits: irradiance counts as constant
} sss_bem__view;

static void sss_bem__view_triangle(const float w[3][3], const float n[3], const float normal[3], sss_bem__view *v)
{
    float outward[3][3], nearest2 = HUGE_VALF;
    int k, i;
    for (k = 0; k < 3; k++) // from the nearest corner, where the normal's rounding counts least
    {
        const float square = sss_bem__dotf(w[k], w[k]);
        v->H[0] = square < nearest2 ? sss_bem__dotf(w[k], normal) : v->H[0];
        nearest2 = square < nearest2 ? square : nearest2;
    }
    v->H[1] = sss_bem__dotf(n, normal);
    for (k = 0; k < 3; k++)
    {
        const float *from = w[k], *to = w[(k + 1) % 3];
        float along[3], length2;
        for (i = 0; i < 3; i++)
        {
            along[i] = to[i] - from[i];
        }
        length2 = sss_bem__dotf(along, along);
        v->length[k] = sqrtf(length2);
        for (i = 0; i < 3; i++)
        {
            along[i] = length2 > 0.0f ? along[i] / v->length[k] : 0.0f;
        }
        outward[k][0] = along[1] * normal[2] - along[2] * normal[1];
        outward[k][1] = along[2] * normal[0] - along[0] * normal[2];
        outward[k][2] = along[0] * normal[1] - along[1] * normal[0];
        v->p[k][0] = sss_bem__dotf(from, outward[k]);
        v->p[k][1] = sss_bem__dotf(n, outward[k]);
        v->t[k][0] = sss_bem__dotf(from, along);
        v->t[k][1] = sss_bem__dotf(n, along);
    }
    for (k = 0; k < 3; k++)
    {
        v->cosine[k] = sss_bem__dotf(outward[k], outward[(k + 1) % 3]);
    }
    // twice the area from an edge and the distance of the opposite corner
    v->over_area = v->length[0] * (v->p[0][0] - sss_bem__dotf(w[2], outward[0]));
    v->sliver = !(v->over_area * SSS_BEM__SLIVER > v->length[0] * v->length[0]
                  && v->over_area * SSS_BEM__SLIVER > v->length[1] * v->length[1]
                  && v->over_area * SSS_BEM__SLIVER > v->length[2] * v->length[2]);
    v->over_area = v->over_area > 0.0f ? 1.0f / v->over_area : 0.0f;
}

// exp(-sigma s)/s, continued inside the guard so that its derivative is -s K there as well.
static float sss_bem__guarded_G(const sss_bem__model *m, int kind, int c, float s)
{
    const float inside = m->guard2[kind][c] - s * s;
    return inside <= 0.0f ? expf(-m->sigma[c] * s) / s
                          : m->guard_G[kind][c] + 0.5f * m->guard_K[kind][c] * inside;
}

// int (C - G) dtheta and int (C - G) dt along an edge. With t = S sinh w, S^2 = p^2 + H^2, s is S cosh w, dt is s dw:
// the integrand is smooth in w however close the source is to the edge, and a long edge is short in w.
static void sss_bem__edge_integrals(const sss_bem__model *m, const sss_bem__rule *rule, int kind, int c, float p,
                                    float H, float t_1, float length, float C, float *theta, float *line)
{
    const float part = 1e-9f * length; // keeps t/S finite; far below what G can tell apart
    const float least = part > SSS_BEM__TINY ? part : SSS_BEM__TINY;
    const float square = p * p + H * H, S = square > least * least ? sqrtf(square) : least;
    const float a = t_1 / S, b = (t_1 + length) / S;
    const float root_a = sqrtf(1.0f + a * a), root_b = sqrtf(1.0f + b * b);
    const float low = a < 0.0f ? 1.0f / (root_a - a) : root_a + a; // exp(asinh a), without cancellation
    const float high = b < 0.0f ? 1.0f / (root_b - b) : root_b + b;
    const float half = 0.5f * logf(high / low), middle = sqrtf(low * high);
    float sum_theta = 0.0f, sum_line = 0.0f;
    int i, sign;
    for (i = 0; i < rule->count; i++)
    {
        const float step = expf(half * rule->node[i]);
        for (sign = 0; sign < 2; sign++)
        {
            const float e = sign ? middle * step : middle / step; // exp(w)
            const float s = 0.5f * S * (e + 1.0f / e), t = 0.5f * S * (e - 1.0f / e);
            const float term = rule->weight[i] * (C - sss_bem__guarded_G(m, kind, c, s)) * s;
            sum_theta += term / (p * p + t * t + least * least);
            sum_line += term;
        }
    }
    *theta = half * p * sum_theta;
    *line = half * sum_line;
}

// The nearest distance of the source to the triangle: its C makes every integrand bounded.
static float sss_bem__nearest(const sss_bem__view *v, const float p[3], const float t[3], float H)
{
    float nearest2 = HUGE_VALF;
    int k;
    if (p[0] >= 0.0f && p[1] >= 0.0f && p[2] >= 0.0f)
    {
        return fabsf(H);
    }
    for (k = 0; k < 3; k++)
    {
        const float end = t[k] + v->length[k];
        const float clamped = t[k] > 0.0f ? t[k] : end < 0.0f ? end : 0.0f;
        const float square = p[k] * p[k] + clamped * clamped;
        nearest2 = square < nearest2 ? square : nearest2;
    }
    return sqrtf(nearest2 + H * H);
}

// Factors for the irradiance at the three corners, of one source; compare sss_bem__linear_parts.
static void sss_bem__triangle_source(const sss_bem__model *m, const sss_bem__rule *rule, int kind, int c,
                                     const sss_bem__view *v, float out[3])
{
    const float h = m->height[kind][c], H = v->H[0] + h * v->H[1];
    float p[3], t[3], line[3], theta = 0.0f, nearest, C;
    int k;
    for (k = 0; k < 3; k++)
    {
        p[k] = v->p[k][0] + h * v->p[k][1];
        t[k] = v->t[k][0] + h * v->t[k][1];
    }
    nearest = sss_bem__nearest(v, p, t, H);
    C = sss_bem__guarded_G(m, kind, c, nearest > SSS_BEM__TINY ? nearest : SSS_BEM__TINY);
    for (k = 0; k < 3; k++)
    {
        float edge_theta;
        sss_bem__edge_integrals(m, rule, kind, c, p[k], H, t[k], v->length[k], C, &edge_theta, &line[k]);
        theta += edge_theta;
    }
    for (k = 0; k < 3; k++) // corner k, opposite edge k + 1
    {
        const int o = (k + 1) % 3, next = (k + 2) % 3;
        const float linear = v->over_area * v->length[o]
                             * (p[o] * theta - line[o] - v->cosine[o] * line[next] - v->cosine[k] * line[k]);
        out[k] = m->z[kind][c] * (v->sliver ? theta / 3.0f : linear);
    }
}

// One pair of a block.
static void sss_bem__pair_factor(const sss_bem__model *m, const sss_bem__block *b, int kind, int place,
                                 uint32_t *out)
{
    const sss_bem__rule *rule = &m->rule[kind == SSS_BEM__LONG_EDGES];
    sss_bem__view v;
    float w[3][3], n[3], normal[3], kab[3][3];
    int k, i, c;
    for (i = 0; i < 3; i++)
    {
        n[i] = b->n[i][place];
        normal[i] = b->normal[i][place];
        for (k = 0; k < 3; k++)
        {
            w[k][i] = b->w[k][i][place];
        }
    }
    if (kind == SSS_BEM__CLOSE)
    {
        sss_bem__points_factor(m, &sss_bem__close_rule, (const float (*)[3])w, n, b->area[place], kab);
        sss_bem__put_factors(m->half_k, out, place, kab);
        return;
    }
    sss_bem__view_triangle((const float (*)[3])w, n, normal, &v);
    for (c = 0; c < 3; c++)
    {
        float real[3], virtual_source[3];
        sss_bem__triangle_source(m, rule, 0, c, &v, real);
        sss_bem__triangle_source(m, rule, 1, c, &v, virtual_source);
        for (k = 0; k < 3; k++)
        {
            kab[c][k] = m->scale[c] * (real[k] + virtual_source[k]);
        }
        kab[c][0] += kab[c][1] + kab[c][2];
    }
    sss_bem__put_factors(m->half_k, out, place, kab);
}

// ---- the same formulas in wide registers ----
// The kernels are written once, in a macro, for two widths N of vectors V; a handful of operations differ. Arithmetic
// on vectors is the compilers' own. They hold 1e-5 against plain C, 2e-4 where model.rough (rsqrt and exp below).

#if !defined(SSS_BEM_NO_SIMD) && (defined(__GNUC__) || defined(__clang__)) && defined(__x86_64__)                      \
    && !(defined(__MINGW32__) && !defined(__clang__))
#define SSS_BEM__AVX2
#if defined(__OPTIMIZE__) || defined(__clang__) // without optimisation gcc 12 warns inside its own AVX-512 macros
#define SSS_BEM__AVX512
#endif
#endif

#if defined(SSS_BEM__AVX2)
#include <immintrin.h>

#define SSS_BEM__TARGET8 __attribute__((target("avx2,fma")))
#define SSS_BEM__TARGET16 __attribute__((target("avx512f,avx512dq,fma")))
#define SSS_BEM__INLINE static inline __attribute__((always_inline))

typedef __m256 sss_bem__v8;
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__set8(float x) { return _mm256_set1_ps(x); }
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__load8(const float *x) { return _mm256_loadu_ps(x); }
SSS_BEM__INLINE SSS_BEM__TARGET8 void sss_bem__store8(float *x, sss_bem__v8 a) { _mm256_storeu_ps(x, a); }
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__fma8(sss_bem__v8 a, sss_bem__v8 b, sss_bem__v8 c)
{
    return _mm256_fmadd_ps(a, b, c);
}
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__max8(sss_bem__v8 a, sss_bem__v8 b)
{
    return _mm256_max_ps(a, b);
}
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__min8(sss_bem__v8 a, sss_bem__v8 b)
{
    return _mm256_min_ps(a, b);
}
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__less8(sss_bem__v8 a, sss_bem__v8 b, sss_bem__v8 yes,
                                                            sss_bem__v8 no) // a < b ? yes : no
{
    return _mm256_blendv_ps(no, yes, _mm256_cmp_ps(a, b, _CMP_LT_OQ));
}
SSS_BEM__INLINE SSS_BEM__TARGET8 uint32_t sss_bem__less_bits8(sss_bem__v8 a, sss_bem__v8 b) // bit k: a[k] < b[k]
{
    return (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_LT_OQ));
}
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__rough_rsqrt8(sss_bem__v8 a) { return _mm256_rsqrt_ps(a); }
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__rough_over8(sss_bem__v8 a) { return _mm256_rcp_ps(a); }
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__round8(sss_bem__v8 a)
{
    return _mm256_round_ps(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
}
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__scale8(sss_bem__v8 a, sss_bem__v8 n) // a 2^n, n <= 127
{
    const __m256i power = _mm256_max_epi32(_mm256_cvtps_epi32(n), _mm256_set1_epi32(-127)); // 2^-127 becomes 0
    const __m256i bits = _mm256_slli_epi32(_mm256_add_epi32(power, _mm256_set1_epi32(127)), 23);
    return _mm256_mul_ps(a, _mm256_castsi256_ps(bits));
}
// Two floats rounded to 16 bits in one word, and back; and a row of rounded ones.
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__pack8(sss_bem__v8 a, sss_bem__v8 b)
{
    const __m256i half = _mm256_set1_epi32(0x8000);
    const __m256i x = _mm256_and_si256(_mm256_add_epi32(_mm256_castps_si256(a), half), _mm256_set1_epi32(-65536));
    const __m256i y = _mm256_srli_epi32(_mm256_add_epi32(_mm256_castps_si256(b), half), 16);
    return _mm256_castsi256_ps(_mm256_or_si256(x, y));
}
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__upper8(sss_bem__v8 a)
{
    return _mm256_castsi256_ps(_mm256_and_si256(_mm256_castps_si256(a), _mm256_set1_epi32(-65536)));
}
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__lower8(sss_bem__v8 a)
{
    return _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_castps_si256(a), 16));
}
SSS_BEM__INLINE SSS_BEM__TARGET8 void sss_bem__store_half8(void *at, sss_bem__v8 a)
{
    const __m256i x = _mm256_srli_epi32(_mm256_add_epi32(_mm256_castps_si256(a), _mm256_set1_epi32(0x8000)), 16);
    const __m256i y = _mm256_permute4x64_epi64(_mm256_packus_epi32(x, x), 0x08);
    _mm_storeu_si128((__m128i *)at, _mm256_castsi256_si128(y));
}
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__load_half8(const void *at)
{
    const __m256i x = _mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)at));
    return _mm256_castsi256_ps(_mm256_slli_epi32(x, 16));
}
// Splits a > 0 into 2^exponent and a mantissa in [1, 2).
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__exponent8(sss_bem__v8 a)
{
    const __m256i bits = _mm256_srli_epi32(_mm256_castps_si256(a), 23);
    return _mm256_cvtepi32_ps(_mm256_sub_epi32(bits, _mm256_set1_epi32(127)));
}
SSS_BEM__INLINE SSS_BEM__TARGET8 sss_bem__v8 sss_bem__mantissa8(sss_bem__v8 a)
{
    const __m256i bits = _mm256_and_si256(_mm256_castps_si256(a), _mm256_set1_epi32(0x007fffff));
    return _mm256_castsi256_ps(_mm256_or_si256(bits, _mm256_set1_epi32(0x3f800000)));
}
#endif

#if defined(SSS_BEM__AVX512)
typedef __m512 sss_bem__v16;
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__set16(float x) { return _mm512_set1_ps(x); }
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__load16(const float *x) { return _mm512_loadu_ps(x); }
SSS_BEM__INLINE SSS_BEM__TARGET16 void sss_bem__store16(float *x, sss_bem__v16 a) { _mm512_storeu_ps(x, a); }
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__fma16(sss_bem__v16 a, sss_bem__v16 b, sss_bem__v16 c)
{
    return _mm512_fmadd_ps(a, b, c);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__less16(sss_bem__v16 a, sss_bem__v16 b, sss_bem__v16 yes,
                                                               sss_bem__v16 no)
{
    return _mm512_mask_blend_ps(_mm512_cmp_ps_mask(a, b, _CMP_LT_OQ), no, yes);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 uint32_t sss_bem__less_bits16(sss_bem__v16 a, sss_bem__v16 b)
{
    return (uint32_t)_mm512_cmp_ps_mask(a, b, _CMP_LT_OQ);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__max16(sss_bem__v16 a, sss_bem__v16 b)
{
    return _mm512_maskz_max_ps((__mmask16)0xffff, a, b);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__min16(sss_bem__v16 a, sss_bem__v16 b)
{
    return _mm512_maskz_min_ps((__mmask16)0xffff, a, b);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__rough_rsqrt16(sss_bem__v16 a)
{
    return _mm512_maskz_rsqrt14_ps((__mmask16)0xffff, a);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__rough_over16(sss_bem__v16 a)
{
    return _mm512_maskz_rcp14_ps((__mmask16)0xffff, a);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__round16(sss_bem__v16 a)
{
    return _mm512_maskz_roundscale_ps((__mmask16)0xffff, a, 0);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__scale16(sss_bem__v16 a, sss_bem__v16 n)
{
    return _mm512_maskz_scalef_ps((__mmask16)0xffff, a, n);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 __m512i sss_bem__rounded16(sss_bem__v16 a) // its upper 16 bits
{
    return _mm512_maskz_add_epi32((__mmask16)0xffff, _mm512_castps_si512(a), _mm512_set1_epi32(0x8000));
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__upper16(sss_bem__v16 a)
{
    return _mm512_castsi512_ps(
        _mm512_maskz_and_epi32((__mmask16)0xffff, _mm512_castps_si512(a), _mm512_set1_epi32(-65536)));
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__lower16(sss_bem__v16 a)
{
    return _mm512_castsi512_ps(_mm512_maskz_slli_epi32((__mmask16)0xffff, _mm512_castps_si512(a), 16));
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__pack16(sss_bem__v16 a, sss_bem__v16 b)
{
    const __m512i x =
        _mm512_maskz_and_epi32((__mmask16)0xffff, sss_bem__rounded16(a), _mm512_set1_epi32(-65536));
    const __m512i y = _mm512_maskz_srli_epi32((__mmask16)0xffff, sss_bem__rounded16(b), 16);
    return _mm512_castsi512_ps(_mm512_maskz_or_epi32((__mmask16)0xffff, x, y));
}
SSS_BEM__INLINE SSS_BEM__TARGET16 void sss_bem__store_half16(void *at, sss_bem__v16 a)
{
    const __m512i x = _mm512_maskz_srli_epi32((__mmask16)0xffff, sss_bem__rounded16(a), 16);
    _mm256_storeu_si256((__m256i *)at, _mm512_maskz_cvtepi32_epi16((__mmask16)0xffff, x));
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__load_half16(const void *at)
{
    const __m512i x = _mm512_maskz_cvtepu16_epi32((__mmask16)0xffff, _mm256_loadu_si256((const __m256i *)at));
    return _mm512_castsi512_ps(_mm512_maskz_slli_epi32((__mmask16)0xffff, x, 16));
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__exponent16(sss_bem__v16 a)
{
    return _mm512_maskz_getexp_ps((__mmask16)0xffff, a);
}
SSS_BEM__INLINE SSS_BEM__TARGET16 sss_bem__v16 sss_bem__mantissa16(sss_bem__v16 a)
{
    return _mm512_maskz_getmant_ps((__mmask16)0xffff, a, _MM_MANT_NORM_1_2, _MM_MANT_SIGN_zero);
}
#endif

#if defined(SSS_BEM__AVX2)
// 1/a and 1/sqrt(a) by one Newton step; 2^x as 2^n 2^f with the Taylor series of 2^f, (ln 2/2)^7/7! = 1.2e-7;
// ln a by the series of atanh, (0.172)^8/9 = 8e-8.
#define SSS_BEM__DEFINE_FUNCTIONS(N)                                                                                   \
    SSS_BEM__INLINE SSS_BEM__TARGET##N sss_bem__v##N sss_bem__over##N(sss_bem__v##N a)                                 \
    {                                                                                                                  \
        const sss_bem__v##N y = sss_bem__rough_over##N(a);                                                             \
        return y * (sss_bem__set##N(2.0f) - a * y);                                                                    \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N sss_bem__v##N sss_bem__rsqrt##N(sss_bem__v##N a)                                \
    {                                                                                                                  \
        const sss_bem__v##N y = sss_bem__rough_rsqrt##N(a);                                                            \
        return y * sss_bem__fma##N(sss_bem__set##N(-0.5f) * a * y, y, sss_bem__set##N(1.5f));                          \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N sss_bem__v##N sss_bem__dot##N(const sss_bem__v##N *a, const sss_bem__v##N *b)   \
    {                                                                                                                  \
        return sss_bem__fma##N(a[0], b[0], sss_bem__fma##N(a[1], b[1], a[2] * b[2]));                                  \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N sss_bem__v##N sss_bem__exp2##N(sss_bem__v##N x)                                 \
    {                                                                                                                  \
        const sss_bem__v##N n = sss_bem__round##N(x), f = x - n;                                                       \
        sss_bem__v##N y = sss_bem__set##N(1.54035304e-4f);                                                             \
        y = sss_bem__fma##N(y, f, sss_bem__set##N(1.33335581e-3f));                                                    \
        y = sss_bem__fma##N(y, f, sss_bem__set##N(9.61812911e-3f));                                                    \
        y = sss_bem__fma##N(y, f, sss_bem__set##N(5.55041087e-2f));                                                    \
        y = sss_bem__fma##N(y, f, sss_bem__set##N(2.40226507e-1f));                                                    \
        y = sss_bem__fma##N(y, f, sss_bem__set##N(6.93147181e-1f));                                                    \
        return sss_bem__scale##N(sss_bem__fma##N(y, f, sss_bem__set##N(1.0f)), n);                                     \
    }                                                                                                                  \
    /* With `rough`, what the registers estimate: 6e-5 in 16 lanes; in 8 lanes 4e-4, which does take a Newton step. */ \
    SSS_BEM__INLINE SSS_BEM__TARGET##N sss_bem__v##N sss_bem__quick_rsqrt##N(sss_bem__v##N a, const int rough)         \
    {                                                                                                                  \
        return rough && N == 16 ? sss_bem__rough_rsqrt##N(a) : sss_bem__rsqrt##N(a);                                   \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N sss_bem__v##N sss_bem__quick_exp2##N(sss_bem__v##N x, const int rough)          \
    {                                                                                                                  \
        const sss_bem__v##N n = sss_bem__round##N(x), f = x - n;                                                       \
        sss_bem__v##N y = sss_bem__set##N(9.61812911e-3f); /* the rest: (ln 2/2)^5/5! = 4e-5 */                        \
        if (!rough)                                                                                                    \
        {                                                                                                              \
            return sss_bem__exp2##N(x);                                                                                \
        }                                                                                                              \
        y = sss_bem__fma##N(y, f, sss_bem__set##N(5.55041087e-2f));                                                    \
        y = sss_bem__fma##N(y, f, sss_bem__set##N(2.40226507e-1f));                                                    \
        y = sss_bem__fma##N(y, f, sss_bem__set##N(6.93147181e-1f));                                                    \
        return sss_bem__scale##N(sss_bem__fma##N(y, f, sss_bem__set##N(1.0f)), n);                                     \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N void sss_bem__put_factor##N(                                                    \
        const sss_bem__model *m, uint32_t *factor, int c, int lane, sss_bem__v##N k, sss_bem__v##N a,                  \
        sss_bem__v##N b)                                                                                               \
    {                                                                                                                  \
        uint32_t *ab = factor + c * SSS_BEM__LANES + lane;                                                             \
        unsigned char *at = (unsigned char *)(factor + SSS_BEM__K_WORD);                                               \
        sss_bem__store##N((float *)(void *)ab, sss_bem__pack##N(a, b));                                                \
        if (m->half_k)                                                                                                 \
        {                                                                                                              \
            sss_bem__store_half##N(at + 2 * (c * SSS_BEM__LANES + lane), k);                                           \
        }                                                                                                              \
        else                                                                                                           \
        {                                                                                                              \
            sss_bem__store##N((float *)(void *)(at + 4 * (c * SSS_BEM__LANES + lane)), k);                             \
        }                                                                                                              \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N void sss_bem__get_factor##N(const sss_bem__model *m, const uint32_t *factor,    \
                                                                   int c, int lane, sss_bem__v##N *kab)                \
    {                                                                                                                  \
        const unsigned char *at = (const unsigned char *)(factor + SSS_BEM__K_WORD);                                   \
        const uint32_t *words = factor + c * SSS_BEM__LANES + lane;                                                    \
        const sss_bem__v##N ab = sss_bem__load##N((const float *)(const void *)words);                                 \
        kab[0] = m->half_k ? sss_bem__load_half##N(at + 2 * (c * SSS_BEM__LANES + lane))                               \
                           : sss_bem__load##N((const float *)(const void *)(at + 4 * (c * SSS_BEM__LANES + lane)));    \
        kab[1] = sss_bem__upper##N(ab);                                                                                \
        kab[2] = sss_bem__lower##N(ab);                                                                                \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N sss_bem__v##N sss_bem__log##N(sss_bem__v##N a)                                  \
    {                                                                                                                  \
        const sss_bem__v##N one = sss_bem__set##N(1.0f), e = sss_bem__exponent##N(a), x = sss_bem__mantissa##N(a);     \
        const sss_bem__v##N root = sss_bem__set##N(1.41421356f); /* brings the mantissa into [sqrt(1/2), sqrt(2)] */   \
        const sss_bem__v##N m = sss_bem__less##N(root, x, sss_bem__set##N(0.5f) * x, x);                               \
        const sss_bem__v##N n = sss_bem__less##N(root, x, e + one, e);                                                 \
        const sss_bem__v##N y = (m - one) * sss_bem__over##N(m + one), y2 = y * y;                                     \
        sss_bem__v##N p = sss_bem__set##N(2.0f / 7.0f);                                                                \
        p = sss_bem__fma##N(p, y2, sss_bem__set##N(2.0f / 5.0f));                                                      \
        p = sss_bem__fma##N(p, y2, sss_bem__set##N(2.0f / 3.0f));                                                      \
        p = sss_bem__fma##N(p, y2, sss_bem__set##N(2.0f));                                                             \
        return sss_bem__fma##N(n, sss_bem__set##N(0.693147181f), p * y);                                               \
    }

// Links: N receivers of a row at a time; what sss_bem__cluster_factor says. The forms come halved.
#define SSS_BEM__DEFINE_LINKS(N)                                                                                       \
    SSS_BEM__INLINE SSS_BEM__TARGET##N void sss_bem__cluster_source##N(                                                \
        const sss_bem__model *m, int kind, int c, const sss_bem__v##N *squares, const sss_bem__v##N *forms,            \
        sss_bem__v##N *sums, const int rough)                                                                          \
    {                                                                                                                  \
        const sss_bem__v##N h2 = sss_bem__set##N(m->height2[kind][c]), hh = sss_bem__set##N(m->square[kind][c]);       \
        const sss_bem__v##N guard2 = sss_bem__set##N(m->guard2[kind][c]), sigma = sss_bem__set##N(m->sigma[c]);        \
        const sss_bem__v##N one = sss_bem__set##N(1.0f), three = sss_bem__set##N(3.0f);                                \
        const sss_bem__v##N fifteen = sss_bem__set##N(15.0f), zero = sss_bem__set##N(0.0f);                            \
        const sss_bem__v##N s2 = sss_bem__fma##N(h2, squares[1], squares[0] + hh);                                     \
        const sss_bem__v##N vCv = sss_bem__fma##N(h2, forms[1], sss_bem__fma##N(hh, forms[2], forms[0]));              \
        const sss_bem__v##N limited = sss_bem__max##N(s2, guard2), over_s = sss_bem__quick_rsqrt##N(limited, rough);   \
        const sss_bem__v##N s = limited * over_s, over = over_s * over_s, u = sigma * s;                               \
        const sss_bem__v##N decay = sss_bem__quick_exp2##N(sss_bem__set##N(m->decay[c]) * s, rough) * over_s;          \
        const sss_bem__v##N a = decay * (over * sss_bem__set##N(m->weight[kind][c]));                                  \
        const sss_bem__v##N outside = sss_bem__less##N(guard2, s2, over, zero);                                        \
        const sss_bem__v##N slope = outside * sss_bem__fma##N(u, u + three, three);                                    \
        const sss_bem__v##N k_2 =                                                                                      \
            sss_bem__fma##N(u, sss_bem__fma##N(u, u + sss_bem__set##N(6.0f), fifteen), fifteen);                       \
        const sss_bem__v##N bend = sss_bem__fma##N(outside * (over * vCv), k_2, one + u);                              \
        const sss_bem__v##N a_slope = a * slope;                                                                       \
        sums[0] = sss_bem__fma##N(a, bend - forms[3] * slope, sums[0]);                                                \
        sums[1] = sums[1] - a_slope;                                                                                   \
        sums[2] = sums[2] - a_slope * sss_bem__set##N(m->height[kind][c]);                                             \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N void sss_bem__any_far_factors##N(                                               \
        const sss_bem__model *m, const sss_bem__lanes *lanes, const sss_bem__node *nodes, const sss_bem__link *links,  \
        size_t count, uint32_t *out, const int rough)                                                                  \
    {                                                                                                                  \
        int lane, c;                                                                                                   \
        for (lane = 0; lane < SSS_BEM__LANES; lane += N)                                                               \
        {                                                                                                              \
            const sss_bem__v##N x = sss_bem__load##N(lanes->x[0] + lane), nx = sss_bem__load##N(lanes->n[0] + lane);   \
            const sss_bem__v##N y = sss_bem__load##N(lanes->x[1] + lane), ny = sss_bem__load##N(lanes->n[1] + lane);   \
            const sss_bem__v##N z = sss_bem__load##N(lanes->x[2] + lane), nz = sss_bem__load##N(lanes->n[2] + lane);   \
            const sss_bem__v##N half = sss_bem__set##N(0.5f), zero = sss_bem__set##N(0.0f);                            \
            size_t k;                                                                                                  \
            for (k = 0; k < count; k++)                                                                                \
            {                                                                                                          \
                const sss_bem__node *node = nodes + links[k].node;                                                     \
                const sss_bem__v##N xx = sss_bem__set##N(node->moment[0]), yy = sss_bem__set##N(node->moment[1]);      \
                const sss_bem__v##N zz = sss_bem__set##N(node->moment[2]), xy = sss_bem__set##N(node->moment[3]);      \
                const sss_bem__v##N xz = sss_bem__set##N(node->moment[4]), yz = sss_bem__set##N(node->moment[5]);      \
                const sss_bem__v##N wx = sss_bem__set##N(node->center[0]) - x;                                         \
                const sss_bem__v##N wy = sss_bem__set##N(node->center[1]) - y;                                         \
                const sss_bem__v##N wz = sss_bem__set##N(node->center[2]) - z;                                         \
                const sss_bem__v##N Cwx = sss_bem__fma##N(xx, wx, sss_bem__fma##N(xy, wy, xz * wz));                   \
                const sss_bem__v##N Cwy = sss_bem__fma##N(xy, wx, sss_bem__fma##N(yy, wy, yz * wz));                   \
                const sss_bem__v##N Cwz = sss_bem__fma##N(xz, wx, sss_bem__fma##N(yz, wy, zz * wz));                   \
                const sss_bem__v##N Cnx = sss_bem__fma##N(xx, nx, sss_bem__fma##N(xy, ny, xz * nz));                   \
                const sss_bem__v##N Cny = sss_bem__fma##N(xy, nx, sss_bem__fma##N(yy, ny, yz * nz));                   \
                const sss_bem__v##N Cnz = sss_bem__fma##N(xz, nx, sss_bem__fma##N(yz, ny, zz * nz));                   \
                sss_bem__v##N squares[2], forms[4];                                                                    \
                squares[0] = sss_bem__fma##N(wx, wx, sss_bem__fma##N(wy, wy, wz * wz));                                \
                squares[1] = sss_bem__fma##N(wx, nx, sss_bem__fma##N(wy, ny, wz * nz));                                \
                forms[0] = half * sss_bem__fma##N(wx, Cwx, sss_bem__fma##N(wy, Cwy, wz * Cwz));                        \
                forms[1] = half * sss_bem__fma##N(nx, Cwx, sss_bem__fma##N(ny, Cwy, nz * Cwz));                        \
                forms[2] = half * sss_bem__fma##N(nx, Cnx, sss_bem__fma##N(ny, Cny, nz * Cnz));                        \
                forms[3] = half * (xx + yy + zz);                                                                      \
                for (c = 0; c < 3; c++)                                                                                \
                {                                                                                                      \
                    sss_bem__v##N sums[3];                                                                             \
                    sums[0] = sums[1] = sums[2] = zero;                                                                \
                    sss_bem__cluster_source##N(m, 0, c, squares, forms, sums, rough);                                  \
                    sss_bem__cluster_source##N(m, 1, c, squares, forms, sums, rough);                                  \
                    sss_bem__put_factor##N(m, out + k * m->factor_words, c, lane, sums[0], sums[1], sums[2]);          \
                }                                                                                                      \
            }                                                                                                          \
        }                                                                                                              \
    }                                                                                                                  \
    SSS_BEM__TARGET##N static void sss_bem__far_factors##N(                                                            \
        const sss_bem__model *m, const sss_bem__lanes *lanes, const sss_bem__node *nodes, const sss_bem__link *links,  \
        size_t count, uint32_t *out)                                                                                   \
    {                                                                                                                  \
        if (m->rough)                                                                                                  \
        {                                                                                                              \
            sss_bem__any_far_factors##N(m, lanes, nodes, links, count, out, 1);                                        \
        }                                                                                                              \
        else                                                                                                           \
        {                                                                                                              \
            sss_bem__any_far_factors##N(m, lanes, nodes, links, count, out, 0);                                        \
        }                                                                                                              \
    }

// Triangles by points: sss_bem__points_factor.
#define SSS_BEM__DEFINE_POINTS(N)                                                                                      \
    SSS_BEM__INLINE SSS_BEM__TARGET##N void sss_bem__point_factors##N(                                                 \
        const sss_bem__model *m, const sss_bem__v##N *w, const sss_bem__v##N *n, sss_bem__v##N *K, const int rough)    \
    {                                                                                                                  \
        const sss_bem__v##N square = sss_bem__dot##N(w, w), along = sss_bem__dot##N(w, n);                             \
        int c, kind;                                                                                                   \
        for (c = 0; c < 3; c++)                                                                                        \
        {                                                                                                              \
            K[c] = sss_bem__set##N(0.0f);                                                                              \
            for (kind = 0; kind < 2; kind++)                                                                           \
            {                                                                                                          \
                const sss_bem__v##N h2 = sss_bem__set##N(m->height2[kind][c]);                                         \
                const sss_bem__v##N hh = sss_bem__set##N(m->square[kind][c]);                                          \
                const sss_bem__v##N s2 = sss_bem__fma##N(h2, along, square + hh);                                      \
                const sss_bem__v##N limited = sss_bem__max##N(s2, sss_bem__set##N(m->guard2[kind][c]));                \
                const sss_bem__v##N over_s = sss_bem__quick_rsqrt##N(limited, rough), s = limited * over_s;            \
                const sss_bem__v##N decay = sss_bem__quick_exp2##N(sss_bem__set##N(m->decay[c]) * s, rough);           \
                const sss_bem__v##N cube = over_s * over_s * (over_s * sss_bem__set##N(m->weight[kind][c]));           \
                K[c] = sss_bem__fma##N(decay * cube,                                                                   \
                                       sss_bem__fma##N(sss_bem__set##N(m->sigma[c]), s, sss_bem__set##N(1.0f)), K[c]); \
            }                                                                                                          \
        }                                                                                                              \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N void sss_bem__sum_points##N(                                                    \
        const sss_bem__model *m, const sss_bem__points_rule *rule, sss_bem__v##N (*w)[3], const sss_bem__v##N *n,      \
        sss_bem__v##N area, int first, uint32_t *out, const int rough)                                                 \
    {                                                                                                                  \
        sss_bem__v##N sums[3][3], x[3], K[3];                                                                          \
        int q, i, k, c;                                                                                                \
        for (k = 0; k < 3; k++)                                                                                        \
        {                                                                                                              \
            sums[k][0] = sums[k][1] = sums[k][2] = sss_bem__set##N(0.0f);                                              \
        }                                                                                                              \
        for (q = 0; q < rule->count; q++)                                                                              \
        {                                                                                                              \
            const float *at = rule->point[q];                                                                          \
            const sss_bem__v##N a = sss_bem__set##N(at[0]), b = sss_bem__set##N(at[1]), c_3 = sss_bem__set##N(at[2]);  \
            const sss_bem__v##N weight = sss_bem__set##N(at[3]);                                                       \
            for (i = 0; i < 3; i++)                                                                                    \
            {                                                                                                          \
                x[i] = sss_bem__fma##N(a, w[0][i], sss_bem__fma##N(b, w[1][i], c_3 * w[2][i]));                        \
            }                                                                                                          \
            sss_bem__point_factors##N(m, x, n, K, rough);                                                              \
            for (c = 0; c < 3; c++)                                                                                    \
            {                                                                                                          \
                const sss_bem__v##N weighted = weight * K[c];                                                          \
                sums[0][c] = sss_bem__fma##N(a, weighted, sums[0][c]);                                                 \
                sums[1][c] = sss_bem__fma##N(b, weighted, sums[1][c]);                                                 \
                sums[2][c] = sss_bem__fma##N(c_3, weighted, sums[2][c]);                                               \
            }                                                                                                          \
        }                                                                                                              \
        for (c = 0; c < 3; c++)                                                                                        \
        {                                                                                                              \
            sss_bem__put_factor##N(m, out, c, first, area * (sums[0][c] + sums[1][c] + sums[2][c]),                    \
                                   area * sums[1][c], area * sums[2][c]);                                              \
        }                                                                                                              \
    }                                                                                                                  \
    SSS_BEM__TARGET##N static void sss_bem__near_factors##N(                                                           \
        const sss_bem__model *m, const sss_bem__lanes *lanes, const sss_bem__corners *corners, float area,             \
        uint32_t *out)                                                                                                 \
    {                                                                                                                  \
        const sss_bem__points_rule *rule = &sss_bem__near_rule;                                                        \
        int first, i, k;                                                                                               \
        for (first = 0; first < SSS_BEM__LANES; first += N)                                                            \
        {                                                                                                              \
            sss_bem__v##N n[3], w[3][3];                                                                               \
            for (i = 0; i < 3; i++)                                                                                    \
            {                                                                                                          \
                n[i] = sss_bem__load##N(lanes->n[i] + first);                                                          \
                for (k = 0; k < 3; k++)                                                                                \
                {                                                                                                      \
                    w[k][i] = sss_bem__set##N(corners->x[k][i]) - sss_bem__load##N(lanes->x[i] + first);               \
                }                                                                                                      \
            }                                                                                                          \
            if (m->rough)                                                                                              \
            {                                                                                                          \
                sss_bem__sum_points##N(m, rule, w, n, sss_bem__set##N(area), first, out, 1);                           \
            }                                                                                                          \
            else                                                                                                       \
            {                                                                                                          \
                sss_bem__sum_points##N(m, rule, w, n, sss_bem__set##N(area), first, out, 0);                           \
            }                                                                                                          \
        }                                                                                                              \
    }                                                                                                                  \
    SSS_BEM__TARGET##N static void sss_bem__close_factors##N(const sss_bem__model *m, const sss_bem__block *b,         \
                                                             uint32_t *out)                                            \
    {                                                                                                                  \
        int first, i, k;                                                                                               \
        for (first = 0; first < SSS_BEM__LANES; first += N)                                                            \
        {                                                                                                              \
            sss_bem__v##N n[3], w[3][3];                                                                               \
            for (i = 0; i < 3; i++)                                                                                    \
            {                                                                                                          \
                n[i] = sss_bem__load##N(b->n[i] + first);                                                              \
                for (k = 0; k < 3; k++)                                                                                \
                {                                                                                                      \
                    w[k][i] = sss_bem__load##N(b->w[k][i] + first);                                                    \
                }                                                                                                      \
            }                                                                                                          \
            sss_bem__sum_points##N(m, &sss_bem__close_rule, w, n, sss_bem__load##N(b->area + first), first, out, 0);   \
        }                                                                                                              \
    }

// Pairs: N of a block at a time; what sss_bem__view_triangle, _nearest, _edge_integrals and _triangle_source say.
#define SSS_BEM__DEFINE_PAIRS(N)                                                                                       \
    typedef struct sss_bem__view##N                                                                                    \
    {                                                                                                                  \
        sss_bem__v##N H[2], p[3][2], t[3][2], length[3], cosine[3], over_area, sliver;                                 \
    } sss_bem__view##N;                                                                                                \
    SSS_BEM__INLINE SSS_BEM__TARGET##N void sss_bem__view_triangle##N(const sss_bem__block *b, int first,              \
                                                                      sss_bem__view##N *v)                             \
    {                                                                                                                  \
        const sss_bem__v##N zero = sss_bem__set##N(0.0f), one = sss_bem__set##N(1.0f);                                 \
        const sss_bem__v##N limit = sss_bem__set##N(SSS_BEM__SLIVER);                                           \
        sss_bem__v##N w[3][3], n[3], normal[3], outward[3][3], double_area, nearest2;                                  \
        int k, i;                                                                                                      \
        for (i = 0; i < 3; i++)                                                                                        \
        {                                                                                                              \
            n[i] = sss_bem__load##N(b->n[i] + first), normal[i] = sss_bem__load##N(b->normal[i] + first);              \
            for (k = 0; k < 3; k++)                                                                                    \
            {                                                                                                          \
                w[k][i] = sss_bem__load##N(b->w[k][i] + first);                                                        \
            }                                                                                                          \
        }                                                                                                              \
        nearest2 = sss_bem__dot##N(w[0], w[0]);                                                                        \
        v->H[0] = sss_bem__dot##N(w[0], normal), v->H[1] = sss_bem__dot##N(n, normal);                                 \
        for (k = 1; k < 3; k++) /* from the nearest corner, where the normal's rounding counts least */                \
        {                                                                                                              \
            const sss_bem__v##N other2 = sss_bem__dot##N(w[k], w[k]);                                                  \
            v->H[0] = sss_bem__less##N(other2, nearest2, sss_bem__dot##N(w[k], normal), v->H[0]);                      \
            nearest2 = sss_bem__min##N(nearest2, other2);                                                              \
        }                                                                                                              \
        for (k = 0; k < 3; k++)                                                                                        \
        {                                                                                                              \
            const sss_bem__v##N *from = w[k], *to = w[k == 2 ? 0 : k + 1];                                             \
            sss_bem__v##N along[3], square, over;                                                                      \
            for (i = 0; i < 3; i++)                                                                                    \
            {                                                                                                          \
                along[i] = to[i] - from[i];                                                                            \
            }                                                                                                          \
            square = sss_bem__dot##N(along, along);                                                                    \
            over = sss_bem__less##N(zero, square, sss_bem__rsqrt##N(square), zero);                                    \
            v->length[k] = square * over;                                                                              \
            for (i = 0; i < 3; i++)                                                                                    \
            {                                                                                                          \
                along[i] = along[i] * over;                                                                            \
            }                                                                                                          \
            outward[k][0] = along[1] * normal[2] - along[2] * normal[1];                                               \
            outward[k][1] = along[2] * normal[0] - along[0] * normal[2];                                               \
            outward[k][2] = along[0] * normal[1] - along[1] * normal[0];                                               \
            v->p[k][0] = sss_bem__dot##N(from, outward[k]), v->p[k][1] = sss_bem__dot##N(n, outward[k]);               \
            v->t[k][0] = sss_bem__dot##N(from, along), v->t[k][1] = sss_bem__dot##N(n, along);                         \
        }                                                                                                              \
        for (k = 0; k < 3; k++)                                                                                        \
        {                                                                                                              \
            v->cosine[k] = sss_bem__dot##N(outward[k], outward[k == 2 ? 0 : k + 1]);                                   \
        }                                                                                                              \
        double_area = v->length[0] * (v->p[0][0] - sss_bem__dot##N(w[2], outward[0]));                                 \
        v->sliver = zero;                                                                                              \
        for (k = 0; k < 3; k++)                                                                                        \
        {                                                                                                              \
            v->sliver = sss_bem__less##N(v->length[k] * v->length[k], double_area * limit, v->sliver, one);            \
        }                                                                                                              \
        v->over_area = sss_bem__less##N(zero, double_area, sss_bem__over##N(double_area), zero);                       \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N sss_bem__v##N sss_bem__guarded_G##N(const sss_bem__model *m, int kind, int c,   \
                                                                           sss_bem__v##N s)                            \
    {                                                                                                                  \
        const sss_bem__v##N guard2 = sss_bem__set##N(m->guard2[kind][c]), square = s * s;                              \
        const sss_bem__v##N outside = sss_bem__exp2##N(sss_bem__set##N(m->decay[c]) * s) * sss_bem__over##N(s);        \
        const sss_bem__v##N inside =                                                                                   \
            sss_bem__fma##N(sss_bem__set##N(0.5f * m->guard_K[kind][c]), guard2 - square,                              \
                            sss_bem__set##N(m->guard_G[kind][c]));                                                     \
        return sss_bem__less##N(square, guard2, inside, outside);                                                      \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N void sss_bem__edge_integrals##N(                                                \
        const sss_bem__model *m, const sss_bem__rule *rule, int kind, int c, sss_bem__v##N p, sss_bem__v##N H,         \
        sss_bem__v##N t_1, sss_bem__v##N length, sss_bem__v##N C, sss_bem__v##N *theta, sss_bem__v##N *line)           \
    {                                                                                                                  \
        const sss_bem__v##N zero = sss_bem__set##N(0.0f), one = sss_bem__set##N(1.0f);                                 \
        const sss_bem__v##N least = sss_bem__max##N(sss_bem__set##N(1e-9f) * length, sss_bem__set##N(1e-18f));         \
        const sss_bem__v##N least2 = least * least, p2 = p * p;                                                        \
        const sss_bem__v##N square = sss_bem__max##N(sss_bem__fma##N(H, H, p2), least2);                               \
        const sss_bem__v##N over_S = sss_bem__rsqrt##N(square), half_S = sss_bem__set##N(0.5f) * square * over_S;      \
        const sss_bem__v##N a = t_1 * over_S, b = (t_1 + length) * over_S;                                             \
        const sss_bem__v##N aa = sss_bem__fma##N(a, a, one), bb = sss_bem__fma##N(b, b, one);                          \
        const sss_bem__v##N sum_a = sss_bem__fma##N(aa, sss_bem__rsqrt##N(aa), sss_bem__max##N(a, zero - a));          \
        const sss_bem__v##N sum_b = sss_bem__fma##N(bb, sss_bem__rsqrt##N(bb), sss_bem__max##N(b, zero - b));          \
        const sss_bem__v##N low = sss_bem__less##N(a, zero, sss_bem__over##N(sum_a), sum_a);                           \
        const sss_bem__v##N high = sss_bem__less##N(b, zero, sss_bem__over##N(sum_b), sum_b);                          \
        const sss_bem__v##N half = sss_bem__set##N(0.5f) * sss_bem__log##N(high * sss_bem__over##N(low));              \
        const sss_bem__v##N product = low * high, over_middle = sss_bem__rsqrt##N(product);                            \
        const sss_bem__v##N middle = product * over_middle;                                                            \
        sss_bem__v##N sum_theta = zero, sum_line = zero;                                                               \
        int i, sign;                                                                                                   \
        for (i = 0; i < rule->count; i++)                                                                              \
        {                                                                                                              \
            const sss_bem__v##N node = sss_bem__set##N(1.44269504f * rule->node[i]);                                   \
            const sss_bem__v##N weight = sss_bem__set##N(rule->weight[i]);                                             \
            const sss_bem__v##N step = sss_bem__exp2##N(half * node), over_step = sss_bem__over##N(step);              \
            for (sign = 0; sign < 2; sign++)                                                                           \
            {                                                                                                          \
                const sss_bem__v##N e = middle * (sign ? step : over_step);                                            \
                const sss_bem__v##N over_e = over_middle * (sign ? over_step : step);                                  \
                const sss_bem__v##N s = half_S * (e + over_e), t = half_S * (e - over_e);                              \
                const sss_bem__v##N term = weight * (C - sss_bem__guarded_G##N(m, kind, c, s)) * s;                    \
                sum_theta = sss_bem__fma##N(term, sss_bem__over##N(sss_bem__fma##N(t, t, p2 + least2)), sum_theta);    \
                sum_line = sum_line + term;                                                                            \
            }                                                                                                          \
        }                                                                                                              \
        *theta = half * p * sum_theta;                                                                                 \
        *line = half * sum_line;                                                                                       \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N sss_bem__v##N sss_bem__nearest##N(                                              \
        const sss_bem__view##N *v, const sss_bem__v##N *p, const sss_bem__v##N *t, sss_bem__v##N H)                    \
    {                                                                                                                  \
        const sss_bem__v##N zero = sss_bem__set##N(0.0f), least = sss_bem__min##N(p[0], sss_bem__min##N(p[1], p[2]));  \
        sss_bem__v##N nearest2 = sss_bem__set##N(1e30f), square;                                                       \
        int k;                                                                                                         \
        for (k = 0; k < 3; k++)                                                                                        \
        {                                                                                                              \
            const sss_bem__v##N end = t[k] + v->length[k];                                                             \
            const sss_bem__v##N clamped = sss_bem__max##N(t[k], sss_bem__min##N(end, zero));                           \
            nearest2 = sss_bem__min##N(nearest2, sss_bem__fma##N(p[k], p[k], clamped * clamped));                      \
        }                                                                                                              \
        nearest2 = sss_bem__less##N(least, zero, nearest2, zero);                                                      \
        square = sss_bem__max##N(sss_bem__fma##N(H, H, nearest2), sss_bem__set##N(1e-36f));                            \
        return square * sss_bem__rsqrt##N(square);                                                                     \
    }                                                                                                                  \
    SSS_BEM__INLINE SSS_BEM__TARGET##N void sss_bem__triangle_source##N(                                               \
        const sss_bem__model *m, const sss_bem__rule *rule, int kind, int c, const sss_bem__view##N *v,                \
        sss_bem__v##N *out)                                                                                            \
    {                                                                                                                  \
        const sss_bem__v##N h = sss_bem__set##N(m->height[kind][c]), H = sss_bem__fma##N(h, v->H[1], v->H[0]);         \
        const sss_bem__v##N weight = sss_bem__set##N(m->z[kind][c] * m->scale[c]), zero = sss_bem__set##N(0.0f);       \
        sss_bem__v##N p[3], t[3], line[3], theta = zero, C;                                                            \
        int k;                                                                                                         \
        for (k = 0; k < 3; k++)                                                                                        \
        {                                                                                                              \
            p[k] = sss_bem__fma##N(h, v->p[k][1], v->p[k][0]);                                                         \
            t[k] = sss_bem__fma##N(h, v->t[k][1], v->t[k][0]);                                                         \
        }                                                                                                              \
        C = sss_bem__guarded_G##N(m, kind, c, sss_bem__nearest##N(v, p, t, H));                                        \
        for (k = 0; k < 3; k++)                                                                                        \
        {                                                                                                              \
            sss_bem__v##N edge_theta;                                                                                  \
            sss_bem__edge_integrals##N(m, rule, kind, c, p[k], H, t[k], v->length[k], C, &edge_theta, &line[k]);       \
            theta = theta + edge_theta;                                                                                \
        }                                                                                                              \
        for (k = 0; k < 3; k++)                                                                                        \
        {                                                                                                              \
            const int o = k == 2 ? 0 : k + 1, next = o == 2 ? 0 : o + 1;                                               \
            const sss_bem__v##N linear =                                                                               \
                v->over_area * v->length[o]                                                                            \
                * (p[o] * theta - line[o] - v->cosine[o] * line[next] - v->cosine[k] * line[k]);                       \
            const sss_bem__v##N flat = sss_bem__set##N(1.0f / 3.0f) * theta;                                           \
            out[k] = out[k] + weight * sss_bem__less##N(zero, v->sliver, flat, linear);                                \
        }                                                                                                              \
    }                                                                                                                  \
    SSS_BEM__TARGET##N static void sss_bem__edge_factors##N(const sss_bem__model *m, const sss_bem__rule *rule,        \
                                                            const sss_bem__block *b, uint32_t *out)                    \
    {                                                                                                                  \
        int first, c;                                                                                                  \
        for (first = 0; first < SSS_BEM__LANES; first += N)                                                            \
        {                                                                                                              \
            sss_bem__view##N v;                                                                                        \
            sss_bem__view_triangle##N(b, first, &v);                                                                   \
            for (c = 0; c < 3; c++)                                                                                    \
            {                                                                                                          \
                sss_bem__v##N sum[3];                                                                                  \
                sum[0] = sum[1] = sum[2] = sss_bem__set##N(0.0f);                                                      \
                sss_bem__triangle_source##N(m, rule, 0, c, &v, sum);                                                   \
                sss_bem__triangle_source##N(m, rule, 1, c, &v, sum);                                                   \
                sss_bem__put_factor##N(m, out, c, first, sum[0] + sum[1] + sum[2], sum[1], sum[2]);                    \
            }                                                                                                          \
        }                                                                                                              \
    }

// Receivers to which a triangle is near, and the sums of a row: sss_bem__near_lanes, sss_bem__add_far,
// sss_bem__add_near.
#define SSS_BEM__DEFINE_ROWS(N)                                                                                        \
    SSS_BEM__TARGET##N static void sss_bem__near_lanes##N(                                                             \
        const sss_bem__model *m, const sss_bem__lanes *lanes, const float *center, const float *normal,                \
        const sss_bem__nearness *near, uint32_t *bits)                                                                 \
    {                                                                                                                  \
        int first, kind, rule;                                                                                         \
        bits[0] = bits[1] = bits[2] = 0;                                                                               \
        for (first = 0; first < SSS_BEM__LANES; first += N)                                                            \
        {                                                                                                              \
            const sss_bem__v##N x = sss_bem__set##N(center[0]) - sss_bem__load##N(lanes->x[0] + first);                \
            const sss_bem__v##N y = sss_bem__set##N(center[1]) - sss_bem__load##N(lanes->x[1] + first);                \
            const sss_bem__v##N z = sss_bem__set##N(center[2]) - sss_bem__load##N(lanes->x[2] + first);                \
            const sss_bem__v##N nx = sss_bem__load##N(lanes->n[0] + first);                                            \
            const sss_bem__v##N ny = sss_bem__load##N(lanes->n[1] + first);                                            \
            const sss_bem__v##N nz = sss_bem__load##N(lanes->n[2] + first);                                            \
            const sss_bem__v##N r2 = sss_bem__fma##N(x, x, sss_bem__fma##N(y, y, z * z));                              \
            const sss_bem__v##N p = sss_bem__fma##N(x, nx, sss_bem__fma##N(y, ny, z * nz));                            \
            const sss_bem__v##N facing[3] = {sss_bem__set##N(normal[0]), sss_bem__set##N(normal[1]),                   \
                                             sss_bem__set##N(normal[2])};                                              \
            const sss_bem__v##N plane =                                                                                \
                sss_bem__fma##N(x, facing[0], sss_bem__fma##N(y, facing[1], z * facing[2]));                           \
            const sss_bem__v##N cosine =                                                                               \
                sss_bem__fma##N(nx, facing[0], sss_bem__fma##N(ny, facing[1], nz * facing[2]));                        \
            for (kind = 0; kind < 2; kind++)                                                                           \
            {                                                                                                          \
                const sss_bem__v##N low = sss_bem__set##N(m->height_range[kind][0]);                                   \
                const sss_bem__v##N high = sss_bem__set##N(m->height_range[kind][1]);                                  \
                const sss_bem__v##N h = sss_bem__min##N(high, sss_bem__max##N(low, sss_bem__set##N(0.0f) - p));        \
                const sss_bem__v##N s2 = sss_bem__fma##N(p + p + h, h, r2);                                            \
                const sss_bem__v##N u = sss_bem__fma##N(plane, sss_bem__set##N(m->over_height[kind][0]), cosine);      \
                const sss_bem__v##N v = sss_bem__fma##N(plane, sss_bem__set##N(m->over_height[kind][1]), cosine);      \
                const sss_bem__v##N height2 = sss_bem__min##N(u * v, sss_bem__min##N(u * u, v * v));                   \
                const uint32_t touched =                                                                               \
                    sss_bem__less_bits##N(s2, sss_bem__set##N(near->touch[kind] * near->touch[kind]));                 \
                for (rule = 0; rule < SSS_BEM__REACH_KINDS; rule++)                                                    \
                {                                                                                                      \
                    const sss_bem__v##N reach2 = sss_bem__set##N(near->reach[rule][kind] * near->reach[rule][kind]);   \
                    const sss_bem__v##N edge = sss_bem__set##N(near->edge[rule][kind]);                                \
                    const uint32_t crossed = touched & sss_bem__less_bits##N(height2, edge);                           \
                    bits[rule] |= (sss_bem__less_bits##N(s2, reach2) | crossed) << first;                              \
                }                                                                                                      \
            }                                                                                                          \
        }                                                                                                              \
    }                                                                                                                  \
    SSS_BEM__TARGET##N static void sss_bem__add_far##N(                                                                \
        const sss_bem__model *m, const sss_bem__lanes *lanes, const sss_bem__node *nodes,                              \
        const sss_bem__light *lights, const sss_bem__link *links, const uint32_t *factors, size_t count,               \
        float (*light)[SSS_BEM__LANES])                                                                                \
    {                                                                                                                  \
        int first, c;                                                                                                  \
        for (first = 0; first < SSS_BEM__LANES; first += N)                                                            \
        {                                                                                                              \
            const sss_bem__v##N x = sss_bem__load##N(lanes->x[0] + first), nx = sss_bem__load##N(lanes->n[0] + first); \
            const sss_bem__v##N y = sss_bem__load##N(lanes->x[1] + first), ny = sss_bem__load##N(lanes->n[1] + first); \
            const sss_bem__v##N z = sss_bem__load##N(lanes->x[2] + first), nz = sss_bem__load##N(lanes->n[2] + first); \
            sss_bem__v##N sum[3], kab[3];                                                                              \
            size_t k;                                                                                                  \
            for (c = 0; c < 3; c++)                                                                                    \
            {                                                                                                          \
                sum[c] = sss_bem__load##N(light[c] + first);                                                           \
            }                                                                                                          \
            for (k = 0; k < count; k++)                                                                                \
            {                                                                                                          \
                const sss_bem__node *node = nodes + links[k].node;                                                     \
                const float *from = lights[links[k].node].v;                                                           \
                const sss_bem__v##N wx = sss_bem__set##N(node->center[0]) - x;                                         \
                const sss_bem__v##N wy = sss_bem__set##N(node->center[1]) - y;                                         \
                const sss_bem__v##N wz = sss_bem__set##N(node->center[2]) - z;                                         \
                for (c = 0; c < 3; c++)                                                                                \
                {                                                                                                      \
                    const sss_bem__v##N mx = sss_bem__set##N(from[3 + 3 * c]);                                         \
                    const sss_bem__v##N my = sss_bem__set##N(from[4 + 3 * c]);                                         \
                    const sss_bem__v##N mz = sss_bem__set##N(from[5 + 3 * c]);                                         \
                    const sss_bem__v##N along = sss_bem__fma##N(wx, mx, sss_bem__fma##N(wy, my, wz * mz));             \
                    const sss_bem__v##N across = sss_bem__fma##N(nx, mx, sss_bem__fma##N(ny, my, nz * mz));            \
                    sss_bem__get_factor##N(m, factors + k * m->factor_words, c, first, kab);                           \
                    sum[c] = sss_bem__fma##N(sss_bem__set##N(from[c]), kab[0], sum[c]);                                \
                    sum[c] = sss_bem__fma##N(along, kab[1], sss_bem__fma##N(across, kab[2], sum[c]));                  \
                }                                                                                                      \
            }                                                                                                          \
            for (c = 0; c < 3; c++)                                                                                    \
            {                                                                                                          \
                sss_bem__store##N(light[c] + first, sum[c]);                                                           \
            }                                                                                                          \
        }                                                                                                              \
    }                                                                                                                  \
    SSS_BEM__TARGET##N static void sss_bem__add_near##N(const sss_bem__model *m, const float (*E)[3],                  \
                                                        const uint32_t *factor, float (*light)[SSS_BEM__LANES])        \
    {                                                                                                                  \
        int first, c;                                                                                                  \
        for (first = 0; first < SSS_BEM__LANES; first += N)                                                            \
        {                                                                                                              \
            for (c = 0; c < 3; c++)                                                                                    \
            {                                                                                                          \
                sss_bem__v##N sum = sss_bem__load##N(light[c] + first), kab[3];                                        \
                sss_bem__get_factor##N(m, factor, c, first, kab);                                                      \
                sum = sss_bem__fma##N(sss_bem__set##N(E[0][c]), kab[0], sum);                                          \
                sum = sss_bem__fma##N(sss_bem__set##N(E[1][c] - E[0][c]), kab[1], sum);                                \
                sum = sss_bem__fma##N(sss_bem__set##N(E[2][c] - E[0][c]), kab[2], sum);                                \
                sss_bem__store##N(light[c] + first, sum);                                                              \
            }                                                                                                          \
        }                                                                                                              \
    }

SSS_BEM__DEFINE_FUNCTIONS(8)
SSS_BEM__DEFINE_ROWS(8)
SSS_BEM__DEFINE_LINKS(8)
SSS_BEM__DEFINE_POINTS(8)
SSS_BEM__DEFINE_PAIRS(8)
#endif

#if defined(SSS_BEM__AVX512)
SSS_BEM__DEFINE_FUNCTIONS(16)
SSS_BEM__DEFINE_ROWS(16)
SSS_BEM__DEFINE_LINKS(16)
SSS_BEM__DEFINE_POINTS(16)
SSS_BEM__DEFINE_PAIRS(16)
#endif

// ---- 3. Object ----

// The tree as it is built: children of every cluster. Triangles come first, then clusters in the order of merging.
typedef struct sss_bem__merge
{
    double center[3];
    double second;     // int |x - center|^2 dA: the cost of a cluster is what merging adds to it
    double area;
    uint64_t code;     // Morton code, for triangles
    uint32_t index;    // among triangles and merged clusters
} sss_bem__merge;

// The spheres that hold a row's real and its virtual sources.
typedef struct sss_bem__spheres
{
    float center[2][3];
    float radius[2];
} sss_bem__spheres;

// Up to 16 vertices that share their links.
typedef struct sss_bem__row
{
    uint32_t count;
    uint32_t vertex[SSS_BEM__LANES];
    uint32_t stamp;       // when its links were last brought up to date; 0: never
    uint32_t moved;       // when one of its vertices last moved
    size_t counts[SSS_BEM__KINDS];
    size_t capacity;      // bytes behind data
    unsigned char *data;  // of each kind: factors, links or pairs; NULL: never linked
} sss_bem__row;

struct sss_bem
{
    sss_hooks hooks;
    sss_bem_options options;   // as resolved
    sss_profile profile;
    sss_bem__model model;
    double mm_per_unit;
    double center[3], scale;   // x' = (x - center) scale, in mesh units: the diagonal becomes 1
    float long_radius;         // triangles larger than this have long edges: several times the least height of a source
    double irradiance_scale;   // E is kept divided by it
    // How far from [real, virtual] sources a cluster counts as its moments (FAR), a triangle as points, by size.
    float reach[SSS_BEM__REACH_KINDS][2][SSS_BEM__CLASSES];
    float half_size[SSS_BEM__CLASSES];
    // How near a triangle may be crossed by the guard's end, where K has an edge, and how it must lie then:
    // sss_bem__nearness.
    float touch[2][SSS_BEM__CLASSES], edge[SSS_BEM__REACH_KINDS][2][SSS_BEM__CLASSES];
    size_t cursor;             // row at which the next update goes on
    size_t vertex_count, triangle_count, node_count, row_count, chunk_count, top_count, depth;
    uint32_t generation;
    int own_normals;           // normals were not given
    double predicted_error;    // negative: not known
    double point_ease;         // the same of triangles that count as points, over that of clusters
    double shape[4];           // for which that was found: sss_bem__measure_shape
    double ease;               // what a cluster may contribute to the error, over the tolerance: sss_bem__calibrate
    sss_bem__node *nodes;      // [node_count], depth first
    sss_bem__stop *stops;      // [node_count]
    uint32_t *stamps;          // [node_count]: when something in its subtree last changed
    sss_bem__light *lights;    // [node_count]
    float (*area_vector)[3];   // [node_count]
    float (*box)[6];           // [node_count]
    float (*position)[3];      // [V]
    float (*normal)[3];        // [V]
    uint32_t *triangle;        // [3 T]
    sss_bem__corners *corners; // [T]
    float (*corner_E)[3][3];   // [T]: corner, channel
    sss_bem__row *rows;        // [row_count]
    sss_bem__lanes *lanes;     // [row_count]
    sss_bem__spheres *spheres; // [row_count]
    uint32_t *chunks;          // [chunk_count]: roots of disjoint subtrees that are refitted in parallel
    uint32_t *top;             // [top_count]: the nodes above them
    uint32_t *row_of_vertex;   // [V]
    struct sss_bem__cluster_link *cluster_links; // of the solid angle oracle, part after part; or NULL
    size_t *part_first;        // [chunk_count + 2]: where the parts begin
    uint32_t linked;           // generation of cluster_links; 0: none
    size_t bytes;
};

static void *sss_bem__allocate(const sss_hooks *hooks, size_t count, size_t size)
{
    if (count == 0 || count > SIZE_MAX / size)
    {
        count = 1;
    }
    return hooks->allocate != NULL ? hooks->allocate(hooks->user, count * size) : malloc(count * size);
}

static void sss_bem__release(const sss_hooks *hooks, void *pointer)
{
    if (pointer == NULL)
    {
        return;
    }
    if (hooks->release != NULL)
    {
        hooks->release(hooks->user, pointer);
    }
    else
    {
        free(pointer);
    }
}

static void sss_bem__parallel(const sss_hooks *hooks, size_t count,
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

// ---- hierarchy: face clusters, 5.1.1 ----

static uint64_t sss_bem__spread(uint64_t x) // 21 bits, two zeros between any two
{
    x &= 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffffu;
    x = (x | x << 16) & 0x1f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}

static int sss_bem__compare_codes(const void *a, const void *b)
{
    const sss_bem__merge *x = (const sss_bem__merge *)a, *y = (const sss_bem__merge *)b;
    return x->code != y->code ? (x->code < y->code ? -1 : 1) : x->index < y->index ? -1 : x->index > y->index;
}

static void sss_bem__join(const sss_bem__merge *a, const sss_bem__merge *b, sss_bem__merge *out)
{
    const double area = a->area + b->area;
    const double share = area > 0.0 ? b->area / area : 0.5;
    double square = 0.0;
    int i;
    for (i = 0; i < 3; i++)
    {
        const double d = b->center[i] - a->center[i];
        out->center[i] = a->center[i] + share * d;
        square += d * d;
    }
    out->area = area;
    out->second = a->second + b->second + a->area * share * square;
    out->code = a->code;
}

// Compactness: the second moment of the merged cluster. Areas of 0 count a little, so that they go to a neighbour.
static double sss_bem__join_cost(const sss_bem__merge *a, const sss_bem__merge *b, double least_area)
{
    const double A = a->area + least_area, B = b->area + least_area;
    const double x = a->center[0] - b->center[0], y = a->center[1] - b->center[1], z = a->center[2] - b->center[2];
    return a->second + b->second + A * B / (A + B) * (x * x + y * y + z * z);
}

// Breaks ties between equal costs without a direction: along a regular strip half of the clusters still find partners.
static uint32_t sss_bem__tie(uint32_t a, uint32_t b)
{
    uint32_t x = (a < b ? a : b) * 0x9e3779b1u ^ (a < b ? b : a) * 0x85ebca77u;
    x ^= x >> 15;
    x *= 0x2c1b3c6du;
    return x ^ x >> 12;
}

enum
{
    SSS_BEM__WINDOW = 8 // neighbours on either side in Morton order among which a cluster looks for a partner
};

typedef struct sss_bem__search
{
    const sss_bem__merge *clusters;
    size_t count;
    double least_area;
    uint32_t *partner;
} sss_bem__search;

static void sss_bem__search_task(void *context, size_t begin, size_t end)
{
    const sss_bem__search *s = (const sss_bem__search *)context;
    size_t i, j;
    for (i = begin; i < end; i++)
    {
        const size_t first = i > SSS_BEM__WINDOW ? i - SSS_BEM__WINDOW : 0;
        const size_t last = i + SSS_BEM__WINDOW < s->count ? i + SSS_BEM__WINDOW : s->count - 1;
        double best = HUGE_VAL;
        uint32_t best_tie = 0;
        s->partner[i] = (uint32_t)(i > 0 ? i - 1 : i + 1);
        for (j = first; j <= last; j++)
        {
            const double cost = j == i ? HUGE_VAL
                                       : sss_bem__join_cost(&s->clusters[i < j ? i : j], &s->clusters[i < j ? j : i],
                                                            s->least_area);
            const uint32_t tie = sss_bem__tie((uint32_t)i, (uint32_t)j);
            if (j != i && (cost < best || (cost == best && tie < best_tie)))
            {
                best = cost;
                best_tie = tie;
                s->partner[i] = (uint32_t)j;
            }
        }
    }
}

// Merges every pair of clusters that prefer each other; where few do, every pair of neighbours. Returns the new count.
static size_t sss_bem__merge_round(sss_bem__merge *clusters, size_t count, const uint32_t *partner,
                                   uint32_t (*children)[2], size_t leaf_count, uint32_t *next)
{
    size_t i, kept = 0, mutual = 0;
    int forced;
    for (i = 0; i < count; i++)
    {
        mutual += partner[partner[i]] == i && i < partner[i];
    }
    forced = mutual * 32 < count;
    for (i = 0; i < count; i++)
    {
        const size_t j = forced ? (i ^ 1) : partner[i];
        const int joined = j < count && (forced || partner[j] == i);
        if (joined && i < j)
        {
            sss_bem__merge both;
            sss_bem__join(&clusters[i], &clusters[j], &both);
            children[*next - leaf_count][0] = clusters[i].index;
            children[*next - leaf_count][1] = clusters[j].index;
            both.index = (*next)++;
            clusters[kept++] = both; // kept <= i, and j is never read as the first of a pair
        }
        else if (!joined)
        {
            clusters[kept++] = clusters[i];
        }
    }
    return kept;
}

// The leaves of the merging: triangles, or the base triangles of a subdivision, each with the moments of its finest
// triangles.
static void sss_bem__collect_leaves(const sss_bem *b, size_t leaf_count, sss_bem__merge *leaves)
{
    const size_t each = b->triangle_count / leaf_count;
    size_t l, t;
    int k, i;
    for (l = 0; l < leaf_count; l++)
    {
        for (t = l * each; t < (l + 1) * each; t++)
        {
            double x[3][3], e[3], f[3], cross[3];
            sss_bem__merge one;
            one.second = 0.0;
            for (i = 0; i < 3; i++)
            {
                for (k = 0; k < 3; k++)
                {
                    x[k][i] = (double)b->position[b->triangle[3 * t + (size_t)k]][i];
                }
                e[i] = x[1][i] - x[0][i];
                f[i] = x[2][i] - x[0][i];
                one.center[i] = (x[0][i] + x[1][i] + x[2][i]) / 3.0;
                for (k = 0; k < 3; k++)
                {
                    one.second += (x[k][i] - one.center[i]) * (x[k][i] - one.center[i]) / 12.0;
                }
            }
            sss_bem__cross(e, f, cross);
            one.area = 0.5 * sss_bem__length(cross);
            one.second *= one.area;
            one.code = 0;
            if (t == l * each)
            {
                leaves[l] = one;
            }
            else
            {
                sss_bem__join(&leaves[l], &one, &leaves[l]);
            }
        }
        leaves[l].index = (uint32_t)l;
        for (i = 0; i < 3; i++) // positions lie in [-1/2, 1/2]
        {
            const double cell = (leaves[l].center[i] + 0.5) * 2097151.0;
            leaves[l].code |= sss_bem__spread((uint64_t)sss_bem__max(0.0, cell)) << i;
        }
    }
}

// Merges until one cluster is left. children [leaf_count - 1][2] of the merged clusters, which count from leaf_count.
static sss_result sss_bem__merge_leaves(sss_bem *b, size_t leaf_count, uint32_t (*children)[2])
{
    sss_bem__merge *clusters = (sss_bem__merge *)sss_bem__allocate(&b->hooks, leaf_count, sizeof *clusters);
    uint32_t *partner = (uint32_t *)sss_bem__allocate(&b->hooks, leaf_count, sizeof *partner);
    uint32_t next = (uint32_t)leaf_count;
    size_t count = leaf_count;
    if (clusters != NULL && partner != NULL)
    {
        sss_bem__search search;
        size_t l;
        sss_bem__collect_leaves(b, leaf_count, clusters);
        qsort(clusters, leaf_count, sizeof *clusters, sss_bem__compare_codes);
        search.least_area = 0.0;
        for (l = 0; l < leaf_count; l++)
        {
            search.least_area += 1e-6 * clusters[l].area / (double)leaf_count;
        }
        search.least_area = sss_bem__max(search.least_area, 1e-300);
        search.clusters = clusters;
        search.partner = partner;
        while (count > 1)
        {
            search.count = count;
            sss_bem__parallel(&b->hooks, count, sss_bem__search_task, &search);
            count = sss_bem__merge_round(clusters, count, partner, children, leaf_count, &next);
        }
    }
    count = clusters != NULL && partner != NULL;
    sss_bem__release(&b->hooks, partner);
    sss_bem__release(&b->hooks, clusters);
    return count ? SSS_OK : SSS_ERROR_OUT_OF_MEMORY;
}

// The subtree of a base triangle after `levels` 4-to-1 splits, from node `at` on. Returns the node behind it.
static uint32_t sss_bem__place_patch(sss_bem *b, size_t triangle, int levels, uint32_t at)
{
    const uint32_t self = at++;
    int k;
    b->nodes[self].triangle = levels == 0 ? (uint32_t)triangle : UINT32_MAX;
    for (k = 0; k < 4 && levels > 0; k++)
    {
        at = sss_bem__place_patch(b, 4 * triangle + (size_t)k, levels - 1, at);
    }
    b->nodes[self].end = at;
    return at;
}

// Lays the tree out depth first: parents were merged after their children, so that walking back meets them first.
static sss_result sss_bem__place_nodes(sss_bem *b, size_t leaf_count, int levels, const uint32_t (*children)[2])
{
    const size_t all = 2 * leaf_count - 1;
    size_t patch = 1, i;
    int l;
    uint32_t *size = (uint32_t *)sss_bem__allocate(&b->hooks, all, 3 * sizeof *size), *start, *depth;
    if (size == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    start = size + all;
    depth = start + all;
    for (l = 0; l < levels; l++)
    {
        patch = 4 * patch + 1;
    }
    for (i = 0; i < all; i++)
    {
        size[i] = i < leaf_count ? (uint32_t)patch
                                 : 1 + size[children[i - leaf_count][0]] + size[children[i - leaf_count][1]];
    }
    start[all - 1] = 0;
    depth[all - 1] = 1;
    b->depth = 1;
    for (i = all; i-- > 0;)
    {
        if (i < leaf_count)
        {
            sss_bem__place_patch(b, i, levels, start[i]);
            b->depth = b->depth > depth[i] + (size_t)levels ? b->depth : depth[i] + (size_t)levels;
            continue;
        }
        b->nodes[start[i]].end = start[i] + size[i];
        b->nodes[start[i]].triangle = UINT32_MAX;
        for (l = 0; l < 2; l++)
        {
            const uint32_t child = children[i - leaf_count][l];
            start[child] = start[i] + 1 + (l == 1 ? size[children[i - leaf_count][0]] : 0);
            depth[child] = depth[i] + 1;
        }
    }
    sss_bem__release(&b->hooks, size);
    return SSS_OK;
}

// Subtrees of at most so many nodes are refitted and pulled in parallel; the few nodes above them follow.
enum
{
    SSS_BEM__CHUNK = 2048
};

static sss_result sss_bem__cut_chunks(sss_bem *b)
{
    size_t pass, i;
    for (pass = 0; pass < 2; pass++)
    {
        b->chunk_count = b->top_count = 0;
        for (i = 0; i < b->node_count;)
        {
            const int chunk = b->nodes[i].end - i <= SSS_BEM__CHUNK;
            if (pass == 1)
            {
                *(chunk ? &b->chunks[b->chunk_count] : &b->top[b->top_count]) = (uint32_t)i;
            }
            *(chunk ? &b->chunk_count : &b->top_count) += 1;
            i = chunk ? b->nodes[i].end : i + 1;
        }
        if (pass == 0)
        {
            b->chunks = (uint32_t *)sss_bem__allocate(&b->hooks, b->chunk_count, sizeof *b->chunks);
            b->top = (uint32_t *)sss_bem__allocate(&b->hooks, b->top_count, sizeof *b->top);
            if (b->chunks == NULL || b->top == NULL)
            {
                return SSS_ERROR_OUT_OF_MEMORY;
            }
        }
    }
    return SSS_OK;
}

static sss_result sss_bem__build_tree(sss_bem *b)
{
    const size_t leaf_count = b->options.base_triangle_count ? b->options.base_triangle_count : b->triangle_count;
    uint32_t (*children)[2];
    sss_result result;
    size_t n;
    int levels = 0;
    for (n = leaf_count; n < b->triangle_count; n *= 4)
    {
        levels++;
    }
    children = (uint32_t (*)[2])sss_bem__allocate(&b->hooks, leaf_count, sizeof *children);
    result = children == NULL ? SSS_ERROR_OUT_OF_MEMORY : sss_bem__merge_leaves(b, leaf_count, children);
    if (result == SSS_OK)
    {
        result = sss_bem__place_nodes(b, leaf_count, levels, (const uint32_t (*)[2])children);
    }
    sss_bem__release(&b->hooks, children);
    return result == SSS_OK ? sss_bem__cut_chunks(b) : result;
}

// How many nodes that will be, 0 where the counts are no 4-to-1 subdivision.
static size_t sss_bem__count_nodes(size_t triangles, size_t base)
{
    size_t nodes, n;
    if (base == 0)
    {
        return 2 * triangles - 1;
    }
    nodes = base - 1;
    for (n = base; n <= triangles; n *= 4)
    {
        nodes += n;
        if (n == triangles)
        {
            return nodes;
        }
    }
    return 0;
}

// ---- keeping it valid: moments from the leaves up ----

// Size classes of clusters, four to a factor of 2 in the square of the size, up to 8 squared diagonals.
#define SSS_BEM__CLASS_BASE 264 // bits >> 21 of the smallest: 2^-61

static int sss_bem__size_class(float h2)
{
    uint32_t bits;
    int index;
    memcpy(&bits, &h2, sizeof bits);
    index = (int)(bits >> 21) - SSS_BEM__CLASS_BASE;
    return index < 0 ? 0 : index < SSS_BEM__CLASSES ? index : SSS_BEM__CLASSES - 1;
}

static double sss_bem__class_size(int index) // the largest in the class
{
    return sqrt(ldexp(1.0 + 0.25 * ((index + 1 + SSS_BEM__CLASS_BASE) % 4),
                      (index + 1 + SSS_BEM__CLASS_BASE) / 4 - 127));
}

static void sss_bem__refit_leaf(sss_bem *b, sss_bem__node *node, float area_vector[3], float box[6])
{
    sss_bem__corners *c = &b->corners[node->triangle];
    const uint32_t *corner = b->triangle + 3 * (size_t)node->triangle;
    double e[3], f[3], cross[3], d[3][3], length, radius2 = 0.0;
    int k, i;
    for (i = 0; i < 3; i++)
    {
        double center;
        for (k = 0; k < 3; k++)
        {
            c->x[k][i] = b->position[corner[k]][i];
        }
        e[i] = (double)c->x[1][i] - (double)c->x[0][i];
        f[i] = (double)c->x[2][i] - (double)c->x[0][i];
        center = (double)c->x[0][i] + (e[i] + f[i]) / 3.0;
        node->center[i] = (float)center;
        for (k = 0; k < 3; k++)
        {
            d[k][i] = (double)c->x[k][i] - center;
        }
        box[i] = (float)-HUGE_VAL;
        box[3 + i] = (float)-HUGE_VAL;
        for (k = 0; k < 3; k++) // the box as two maxima
        {
            box[i] = -c->x[k][i] > box[i] ? -c->x[k][i] : box[i];
            box[3 + i] = c->x[k][i] > box[3 + i] ? c->x[k][i] : box[3 + i];
        }
    }
    sss_bem__cross(e, f, cross);
    length = sss_bem__length(cross);
    node->area = (float)(0.5 * length);
    for (i = 0; i < 3; i++)
    {
        const int first = i < 2 ? 0 : 1, second = i == 0 ? 1 : 2; // xy xz yz
        c->normal[i] = length > 0.0 ? (float)(cross[i] / length) : 0.0f;
        area_vector[i] = (float)(0.5 * cross[i]);
        node->moment[i] = (float)((d[0][i] * d[0][i] + d[1][i] * d[1][i] + d[2][i] * d[2][i]) / 12.0);
        node->moment[3 + i] = (float)((d[0][first] * d[0][second] + d[1][first] * d[1][second]
                                       + d[2][first] * d[2][second]) / 12.0);
    }
    for (k = 0; k < 3; k++)
    {
        radius2 = sss_bem__max(radius2, sss_bem__dot(d[k], d[k]));
    }
    node->radius = (float)(sqrt(radius2) * (1.0 + 1e-6)); // rounding to float never shrinks it
}

// Moments of the union; its sphere holds the children's spheres, or the box where that is smaller.
static void sss_bem__refit_cluster(sss_bem *b, size_t index)
{
    sss_bem__node *node = &b->nodes[index];
    double area = 0.0, center[3] = {0.0, 0.0, 0.0}, moment[6] = {0.0}, weights = 0.0, sphere = 0.0, corner2 = 0.0;
    float *box = b->box[index], *area_vector = b->area_vector[index];
    size_t child;
    int i;
    for (i = 0; i < 3; i++)
    {
        area_vector[i] = 0.0f;
        box[i] = box[3 + i] = (float)-HUGE_VAL;
    }
    for (child = index + 1; child < node->end; child = b->nodes[child].end)
    {
        area += (double)b->nodes[child].area;
    }
    for (child = index + 1; child < node->end; child = b->nodes[child].end)
    {
        const double weight = area > 0.0 ? (double)b->nodes[child].area : 1.0; // without area: the mean
        weights += weight;
        for (i = 0; i < 3; i++)
        {
            center[i] += weight * (double)b->nodes[child].center[i];
            area_vector[i] += b->area_vector[child][i];
            box[i] = b->box[child][i] > box[i] ? b->box[child][i] : box[i];
            box[3 + i] = b->box[child][3 + i] > box[3 + i] ? b->box[child][3 + i] : box[3 + i];
        }
    }
    for (i = 0; i < 3; i++)
    {
        double far_side;
        node->center[i] = (float)(center[i] / weights);
        far_side = sss_bem__max((double)box[3 + i] - (double)node->center[i], (double)node->center[i] + (double)box[i]);
        corner2 += far_side * far_side;
    }
    for (child = index + 1; child < node->end; child = b->nodes[child].end)
    {
        static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
        const sss_bem__node *c = &b->nodes[child];
        const double share = (area > 0.0 ? (double)c->area : 1.0) / weights;
        double d[3];
        for (i = 0; i < 3; i++)
        {
            d[i] = (double)c->center[i] - (double)node->center[i];
        }
        for (i = 0; i < 6; i++)
        {
            moment[i] += share * ((double)c->moment[i] + d[row[i]] * d[column[i]]);
        }
        sphere = sss_bem__max(sphere, sss_bem__length(d) + (double)c->radius);
    }
    for (i = 0; i < 6; i++)
    {
        node->moment[i] = (float)moment[i];
    }
    node->area = (float)area;
    node->radius = (float)(sss_bem__min(sphere, sqrt(corner2)) * (1.0 + 1e-6));
}

// A'/A, 5.1.1: how much of its area a cluster shows along its mean normal.
static double sss_bem__planarity(const sss_bem *b, size_t index)
{
    const double vector[3] = {(double)b->area_vector[index][0], (double)b->area_vector[index][1],
                              (double)b->area_vector[index][2]};
    const double area = (double)b->nodes[index].area;
    return area > 0.0 ? sss_bem__min(1.0, sss_bem__length(vector) / area) : 0.0;
}

// How far a cluster has to be from sources: nothing where any distance will do, else at least outside of it.
static float sss_bem__node_reach(const sss_bem *b, const sss_bem__node *node, int rule, int kind)
{
    const float reach = b->reach[rule][kind][node->size];
    const float long_by = node->radius - b->half_size[node->size]; // needles stick out of the size of their class
    const float needed = long_by > 0.0f ? reach + long_by : reach;
    return reach > 0.0f ? (rule != SSS_BEM__CLOSE && needed < node->radius ? node->radius : needed) : 0.0f;
}

// What walks read of a node, but for its light.
static void sss_bem__set_stop(sss_bem *b, size_t index)
{
    const sss_bem__node *node = &b->nodes[index];
    sss_bem__stop *stop = &b->stops[index];
    memcpy(stop->center, node->center, sizeof stop->center);
    stop->reach[0] = sss_bem__node_reach(b, node, SSS_BEM__FAR, 0);
    stop->reach[1] = sss_bem__node_reach(b, node, SSS_BEM__FAR, 1);
    stop->end = node->end;
    stop->is_leaf = node->triangle != UINT32_MAX && node->area > 0.0f;
    stop->radius = node->radius;
}

static void sss_bem__set_stamp(sss_bem *b, size_t index)
{
    size_t child;
    b->stamps[index] = b->nodes[index].stamp;
    for (child = index + 1; child < b->nodes[index].end; child = b->nodes[child].end)
    {
        b->stamps[index] = b->stamps[child] > b->stamps[index] ? b->stamps[child] : b->stamps[index];
    }
}

static void sss_bem__refit_node(sss_bem *b, size_t index)
{
    sss_bem__node *node = &b->nodes[index], before = *node;
    int changed = 0;
    if (node->triangle != UINT32_MAX)
    {
        const sss_bem__corners corners = b->corners[node->triangle];
        sss_bem__refit_leaf(b, node, b->area_vector[index], b->box[index]);
        changed = memcmp(&corners, &b->corners[node->triangle], sizeof corners) != 0;
    }
    else
    {
        sss_bem__refit_cluster(b, index);
    }
    node->size = (uint32_t)sss_bem__size_class(12.0f * (node->moment[0] + node->moment[1] + node->moment[2]));
    if (changed || memcmp(&before, node, offsetof(sss_bem__node, end)) != 0)
    {
        node->stamp = b->generation;
    }
    sss_bem__set_stop(b, index);
    sss_bem__set_stamp(b, index);
}

static void sss_bem__set_stops(sss_bem *b)
{
    size_t i;
    for (i = 0; i < b->node_count; i++)
    {
        sss_bem__set_stop(b, i);
    }
}

// int E dA of a triangle and int E (x - center) dA from E at its corners: int lambda_k (x - center) dA is a twelfth of
// the area times the way to corner k.
static void sss_bem__pull_leaf(sss_bem *b, size_t index)
{
    const sss_bem__node *node = &b->nodes[index];
    const float (*E)[3] = (const float (*)[3])b->corner_E[node->triangle];
    const float (*x)[3] = (const float (*)[3])b->corners[node->triangle].x;
    const float third = node->area * (1.0f / 3.0f), twelfth = node->area * (1.0f / 12.0f);
    sss_bem__light sum;
    int c, i, is_lit = 0;
    for (c = 0; c < 3; c++)
    {
        const float E_0 = E[0][c], E_1 = E[1][c], E_2 = E[2][c];
        is_lit |= E_0 != 0.0f || E_1 != 0.0f || E_2 != 0.0f;
        sum.v[c] = third * (E_0 + E_1 + E_2);
        for (i = 0; i < 3; i++)
        {
            const float center = node->center[i];
            sum.v[3 + 3 * c + i] =
                twelfth * (E_0 * (x[0][i] - center) + E_1 * (x[1][i] - center) + E_2 * (x[2][i] - center));
        }
    }
    b->lights[index] = sum;
    b->stops[index].is_lit = (uint16_t)is_lit;
}

// The same of a cluster from its children: the moments move to its own center.
static void sss_bem__pull_node(sss_bem *b, size_t index)
{
    const sss_bem__node *node = &b->nodes[index];
    sss_bem__light sum;
    size_t child;
    int k, is_lit = 0;
    if (node->triangle != UINT32_MAX)
    {
        sss_bem__pull_leaf(b, index);
        return;
    }
    memset(&sum, 0, sizeof sum);
    for (child = index + 1; child < node->end; child = b->nodes[child].end)
    {
        const float *part = b->lights[child].v, *center = b->nodes[child].center;
        const float x = center[0] - node->center[0], y = center[1] - node->center[1], z = center[2] - node->center[2];
        is_lit |= b->stops[child].is_lit;
        for (k = 0; k < 12; k++)
        {
            sum.v[k] += part[k];
        }
        for (k = 0; k < 3; k++)
        {
            sum.v[3 + 3 * k] += part[k] * x;
            sum.v[4 + 3 * k] += part[k] * y;
            sum.v[5 + 3 * k] += part[k] * z;
        }
    }
    b->lights[index] = sum;
    b->stops[index].is_lit = (uint16_t)is_lit;
}

// Applies a function to every node, children before parents.
typedef struct sss_bem__upward
{
    sss_bem *bem;
    void (*visit)(sss_bem *b, size_t index);
} sss_bem__upward;

static void sss_bem__upward_task(void *context, size_t begin, size_t end)
{
    const sss_bem__upward *u = (const sss_bem__upward *)context;
    size_t k, i;
    for (k = begin; k < end; k++)
    {
        for (i = u->bem->nodes[u->bem->chunks[k]].end; i-- > u->bem->chunks[k];)
        {
            u->visit(u->bem, i);
        }
    }
}

static void sss_bem__go_up(sss_bem *b, void (*visit)(sss_bem *b, size_t index))
{
    sss_bem__upward u;
    size_t k;
    u.bem = b;
    u.visit = visit;
    sss_bem__parallel(&b->hooks, b->chunk_count, sss_bem__upward_task, &u);
    for (k = b->top_count; k-- > 0;)
    {
        visit(b, b->top[k]);
    }
}

// ---- material: the six sources, and how near a cluster of a size may come ----

// The mean free path is kept within these fractions of the diagonal: below, everything is a delta function, above,
// a constant, and floats would overflow.
#define SSS_BEM__LEAST_DEPTH 1e-9
#define SSS_BEM__MOST_DEPTH 1e6

#define SSS_BEM__LONG 2.5 // heights

static float sss_bem__least(float a, float b)
{
    return a < b ? a : b;
}

static void sss_bem__widen(float range[2], float x, int active)
{
    const int empty = range[0] == 0.0f && range[1] == 0.0f; // no source lies at the height 0
    range[0] = active && (empty || x < range[0]) ? x : range[0];
    range[1] = active && (empty || x > range[1]) ? x : range[1];
}

// Gauss nodes on an edge, in the variable w. On edges ten times as long as the source is far away, 4 leave about 1e-2
// of a pair, 8 1e-3, 16 1e-6: the integrand's nearest singularity is pi/2 away.
static void sss_bem__choose_rules(sss_bem *b)
{
    const double tolerance = b->options.tolerance;
    sss_bem__set_rule(tolerance >= 3e-3 ? 4 : tolerance >= 1e-3 ? 8 : 16, &b->model.rule[0]);
    sss_bem__set_rule(16, &b->model.rule[1]);
    b->model.rough = tolerance >= 1e-3;
    b->model.half_k = tolerance >= 5e-3;
    b->model.factor_words = b->model.half_k ? SSS_BEM__HALF_FACTOR_WORDS : SSS_BEM__FACTOR_WORDS;
}

static void sss_bem__set_model(sss_bem *b)
{
    float least = HUGE_VALF;
    const double unit = b->scale / b->mm_per_unit; // from mm to fractions of the diagonal
    int kind, c;
    for (kind = 0; kind < 2; kind++)
    {
        b->model.height_range[kind][0] = b->model.height_range[kind][1] = 0.0f;
        b->model.least_guard[kind] = HUGE_VALF;
        b->model.most_guard[kind] = 0.0f;
    }
    for (c = 0; c < 3; c++)
    {
        const int active = b->profile.alpha_p[c] > 0.0 && b->profile.z_r[c] > 0.0;
        const double depth = active ? b->profile.z_r[c] * unit : 1.0;
        const double fit = depth < SSS_BEM__LEAST_DEPTH  ? SSS_BEM__LEAST_DEPTH / depth
                           : depth > SSS_BEM__MOST_DEPTH ? SSS_BEM__MOST_DEPTH / depth
                                                         : 1.0;
        // R_d(r; z/k, k sigma) = k^2 R_d(k r; z, sigma): far beyond the diagonal only the factor is left
        const double faint = depth > SSS_BEM__MOST_DEPTH ? fit * fit : 1.0;
        const double sigma = active ? sss_bem__min(b->profile.sigma_tr[c] / unit / fit, 1e30) : 0.0;
        b->model.sigma[c] = (float)sigma;
        b->model.decay[c] = (float)(-sigma / 0.69314718055994531);
        b->model.scale[c] = active ? (float)(b->profile.alpha_p[c] * faint / (4.0 * SSS_BEM__PI)) : 0.0f;
        for (kind = 0; kind < 2; kind++)
        {
            const double z = active ? (kind ? b->profile.z_v[c] : b->profile.z_r[c]) * unit * fit : 1.0;
            const double guard = sss_bem__max(b->options.guard, 0.0) * z;
            b->model.z[kind][c] = (float)z;
            b->model.height[kind][c] = (float)(kind ? -z : z);
            b->model.height2[kind][c] = 2.0f * b->model.height[kind][c];
            b->model.square[kind][c] = b->model.z[kind][c] * b->model.z[kind][c];
            b->model.weight[kind][c] = b->model.z[kind][c] * b->model.scale[c];
            least = active && b->model.z[kind][c] < least ? b->model.z[kind][c] : least;
            sss_bem__widen(b->model.height_range[kind], b->model.height[kind][c], active);
            b->model.least_guard[kind] =
                active ? sss_bem__least(b->model.least_guard[kind], (float)guard) : b->model.least_guard[kind];
            b->model.most_guard[kind] = active && (float)guard > b->model.most_guard[kind]
                                            ? (float)guard : b->model.most_guard[kind];
            b->model.guard2[kind][c] = (float)(guard * guard);
            b->model.guard_G[kind][c] = guard > 0.0 ? (float)sss_bem__G(sigma, guard) : 0.0f;
            b->model.guard_K[kind][c] =
                guard > 0.0 ? (float)((1.0 + sigma * guard) * sss_bem__G(sigma, guard) / (guard * guard)) : 0.0f;
        }
    }
    for (kind = 0; kind < 2; kind++)
    {
        for (c = 0; c < 2; c++)
        {
            const float height = b->model.height_range[kind][c];
            b->model.over_height[kind][c] = height != 0.0f ? 1.0f / height : 0.0f;
        }
    }
    b->long_radius = (float)(SSS_BEM__LONG * (double)least);
}

// The remainder behind the moments of a cluster of size h at the distance s, over the whole light of the dipole:
//     SSS_BEM__REMAINDER q^3 (z/s) exp(-sigma s)/sum of exp(-sigma z),   q = h (1/s + sigma/3)
// The third derivatives of K act on what is uneven about a cluster, its shape and its light. (z/s) exp(-sigma s) is the
// light of a plane from beyond s. K has an edge at the guard, where one power of q is lost: SSS_BEM__EDGE. Far away,
// where so little light is left that any cluster would do, q is limited still: sss_bem__widest. Clusters beside a
// receiver are few and err alike; there the tolerance is never eased, or single receivers would be off by much more.
#define SSS_BEM__REMAINDER 0.015
#define SSS_BEM__EDGE 1.2
#define SSS_BEM__NEAR_RECEIVERS 2.0 // guards

static double sss_bem__widest(double tolerance)
{
    return sss_bem__min(4.0, 4.0 * cbrt(tolerance / 0.01));
}

static int sss_bem__fits(const sss_bem *b, int kind, double h, double s)
{
    const double eased = b->ease * b->options.tolerance, widest = sss_bem__widest(eased);
    int c;
    for (c = 0; c < 3; c++)
    {
        const double z = (double)b->model.z[kind][c], other = (double)b->model.z[1 - kind][c];
        const double sigma = (double)b->model.sigma[c], guard = sqrt((double)b->model.guard2[kind][c]);
        const double near_side = sss_bem__max(s - 0.5 * h, guard), far_side = sss_bem__max(s, guard);
        const double share = z / (1.0 + exp(-sigma * (other - z))); // of this source in the light of the dipole
        const double light = share * exp(-sigma * (far_side - z)) / far_side;
        const double most = near_side > 0.0 ? share * exp(-sigma * (near_side - z)) / near_side : HUGE_VAL;
        const double q = h * (1.0 / far_side + sigma / 3.0);
        const double order = s < guard + 0.25 * h ? sss_bem__max(q, SSS_BEM__EDGE) : q;
        const double tolerance =
            s < SSS_BEM__NEAR_RECEIVERS * guard ? sss_bem__min(eased, b->options.tolerance) : eased;
        if (b->model.scale[c] > 0.0f
            && (order * q * q * light * SSS_BEM__REMAINDER > tolerance || (q > widest && most > 0.1 * tolerance)))
        {
            return 0;
        }
    }
    return 1;
}

// The same of a triangle taken by points, with those around it, whose errors have the same sign on a regular mesh: the
// powers and factors are fits to plane meshes of right and equilateral triangles in all places under a source.
#define SSS_BEM__NEAR_REMAINDER 0.0004
#define SSS_BEM__CLOSE_REMAINDER 5e-7

static int sss_bem__points_fit(const sss_bem *b, int rule, int kind, double h, double s)
{
    int c;
    for (c = 0; c < 3; c++)
    {
        const double z = (double)b->model.z[kind][c], guard = sqrt((double)b->model.guard2[kind][c]);
        const double sigma = (double)b->model.sigma[c], far_side = sss_bem__max(s, guard);
        const double near_side = sss_bem__max(s - 0.6 * h, guard); // of the triangle
        const double light = z * exp(-sigma * sss_bem__max(near_side - z, 0.0)) / far_side;
        const double from = rule == SSS_BEM__NEAR ? far_side : near_side;
        const double q = from > 0.0 ? h * (1.0 / from + sigma / 3.0) : HUGE_VAL, q3 = q * q * q;
        const double error = rule == SSS_BEM__NEAR ? SSS_BEM__NEAR_REMAINDER * q3 * q3
                                                   : SSS_BEM__CLOSE_REMAINDER * q3 * q3;
        if (b->model.scale[c] > 0.0f && error * light > b->point_ease * b->ease * b->options.tolerance)
        {
            return 0;
        }
    }
    return 1;
}

// Where the guard ends on a triangle, points miss the edge that K has there, by
//     SSS_BEM__..._EDGE q^3 (1 - (H/guard)^2)
// of the source's light, H the distance of the source from the triangle's plane: nothing on the receiver's own plane,
// where H is the guard or more. Returns the least (H/z)^2 that fits, 0 if all do.
#define SSS_BEM__NEAR_EDGE 0.002
#define SSS_BEM__CLOSE_EDGE 0.0005

static double sss_bem__least_height2(const sss_bem *b, int rule, int kind, double h)
{
    const double guard = b->options.guard, factor = rule == SSS_BEM__NEAR ? SSS_BEM__NEAR_EDGE : SSS_BEM__CLOSE_EDGE;
    double least = 0.0;
    int c;
    for (c = 0; c < 3 && rule != SSS_BEM__FAR && guard > 0.0; c++)
    {
        const double q = h * (1.0 / (guard * (double)b->model.z[kind][c]) + (double)b->model.sigma[c] / 3.0);
        // of 1 - (H/guard)^2
        const double most = b->point_ease * b->ease * b->options.tolerance / (factor * q * q * q / guard);
        least = b->model.scale[c] > 0.0f ? sss_bem__max(least, (1.0 - most) * guard * guard) : least;
    }
    return least;
}

// The error falls with the distance and grows with the size, so that both only ever go up.
static void sss_bem__plan_reach(sss_bem *b)
{
    const double least = 1e-12, most = 16.0, step = pow(2.0, 1.0 / 16.0); // diagonals
    int rule, kind, index;
    for (rule = 0; rule < SSS_BEM__REACH_KINDS; rule++)
    {
        for (kind = 0; kind < 2; kind++)
        {
            double s = least;
            for (index = 0; index < SSS_BEM__CLASSES; index++)
            {
                const double h = sss_bem__class_size(index);
                while (s < most && !(rule == SSS_BEM__FAR ? sss_bem__fits(b, kind, h, s)
                                                          : sss_bem__points_fit(b, rule, kind, h, s)))
                {
                    s *= step;
                }
                b->reach[rule][kind][index] = s > least ? (float)s : 0.0f;
                b->edge[rule][kind][index] = (float)sss_bem__least_height2(b, rule, kind, h);
                b->touch[kind][index] = b->model.most_guard[kind] + (float)(0.6 * h);
                b->half_size[index] = (float)(0.5 * h);
            }
        }
    }
}

// ---- rows of receivers ----

// Sorting keys of a vertex: where it is, and where its virtual source points, so that a row's sources stay together.
static float sss_bem__key(const sss_bem *b, uint32_t v, int axis)
{
    return axis < 3 ? b->position[v][axis] : b->normal[v][axis - 3] * 0.5f * b->model.z[1][1];
}

static void sss_bem__select(const sss_bem *b, uint32_t *v, size_t count, size_t middle, int axis)
{
    size_t low = 0, high = count - 1;
    while (low < high) // Hoare's selection
    {
        const float pivot = sss_bem__key(b, v[low + (high - low) / 2], axis);
        size_t i = low, j = high;
        for (;;)
        {
            uint32_t swap;
            while (sss_bem__key(b, v[i], axis) < pivot)
            {
                i++;
            }
            while (sss_bem__key(b, v[j], axis) > pivot)
            {
                j--;
            }
            if (i >= j)
            {
                break;
            }
            swap = v[i];
            v[i++] = v[j];
            v[j--] = swap;
        }
        if (middle <= j)
        {
            high = j;
        }
        else
        {
            low = j + 1;
        }
    }
}

static int sss_bem__widest_axis(const sss_bem *b, const uint32_t *v, size_t count)
{
    float widest = -1.0f;
    int axis, best = 0;
    for (axis = 0; axis < 6; axis++)
    {
        float low = sss_bem__key(b, v[0], axis), high = low;
        size_t k;
        for (k = 1; k < count; k++)
        {
            const float key = sss_bem__key(b, v[k], axis);
            low = key < low ? key : low;
            high = key > high ? key : high;
        }
        if (high - low > widest)
        {
            widest = high - low;
            best = axis;
        }
    }
    return best;
}

// Halves the vertices into full rows, across the widest axis.
static void sss_bem__make_rows(sss_bem *b, uint32_t *v)
{
    size_t from[64], count[64], row = 0;
    int depth = 1;
    from[0] = 0;
    count[0] = b->vertex_count;
    while (depth > 0)
    {
        const size_t first = from[depth - 1], n = count[depth - 1];
        size_t k;
        if (n > SSS_BEM__LANES)
        {
            const size_t rows = (n + SSS_BEM__LANES - 1) / SSS_BEM__LANES, left = rows / 2 * SSS_BEM__LANES;
            sss_bem__select(b, v + first, n, left, sss_bem__widest_axis(b, v + first, n));
            from[depth] = first;
            count[depth] = left;
            from[depth - 1] = first + left;
            count[depth - 1] = n - left;
            depth++;
            continue;
        }
        memset(&b->rows[row], 0, sizeof b->rows[row]);
        b->rows[row].count = (uint32_t)n;
        for (k = 0; k < n; k++)
        {
            b->rows[row].vertex[k] = v[first + k];
            b->row_of_vertex[v[first + k]] = (uint32_t)row;
        }
        row++;
        depth--;
    }
}

static void sss_bem__fill_lanes(const sss_bem *b, size_t row)
{
    const sss_bem__row *r = &b->rows[row];
    int lane, i;
    for (lane = 0; lane < SSS_BEM__LANES; lane++)
    {
        const uint32_t v = r->vertex[(uint32_t)lane < r->count ? (uint32_t)lane : r->count - 1];
        for (i = 0; i < 3; i++)
        {
            b->lanes[row].x[i][lane] = b->position[v][i];
            b->lanes[row].n[i][lane] = b->normal[v][i];
        }
    }
}

static void sss_bem__bound_sources(const sss_bem *b, const sss_bem__lanes *lanes, sss_bem__spheres *out)
{
    int kind, lane, i;
    for (kind = 0; kind < 2; kind++)
    {
        const float *heights = b->model.height_range[kind];
        float low[3] = {0.0f, 0.0f, 0.0f}, high[3] = {0.0f, 0.0f, 0.0f}, radius2 = 0.0f;
        for (lane = 0; lane < 2 * SSS_BEM__LANES; lane++)
        {
            for (i = 0; i < 3; i++)
            {
                const float d = lanes->x[i][lane / 2] - heights[lane % 2] * lanes->n[i][lane / 2];
                low[i] = lane == 0 || d < low[i] ? d : low[i];
                high[i] = lane == 0 || d > high[i] ? d : high[i];
            }
        }
        for (i = 0; i < 3; i++)
        {
            out->center[kind][i] = 0.5f * (low[i] + high[i]);
        }
        for (lane = 0; lane < 2 * SSS_BEM__LANES; lane++)
        {
            float square = 0.0f;
            for (i = 0; i < 3; i++)
            {
                const float d = lanes->x[i][lane / 2] - heights[lane % 2] * lanes->n[i][lane / 2]
                                - out->center[kind][i];
                square += d * d;
            }
            radius2 = square > radius2 ? square : radius2;
        }
        out->radius[kind] = sqrtf(radius2);
    }
}

// ---- links of a row: the oracle, and near triangles ----

// Whether a cluster is far enough from all sources of a row, or so near that K is constant on it: within the guard.
static int sss_bem__row_accepts(const sss_bem__model *m, const sss_bem__spheres *s, const sss_bem__stop *stop)
{
    int kind;
    for (kind = 0; kind < 2; kind++)
    {
        const float x = stop->center[0] - s->center[kind][0], y = stop->center[1] - s->center[kind][1];
        const float z = stop->center[2] - s->center[kind][2];
        const float needed = stop->reach[kind] + s->radius[kind], d2 = x * x + y * y + z * z;
        const float inside = m->least_guard[kind] - s->radius[kind] - stop->radius;
        if (stop->reach[kind] > 0.0f && d2 < needed * needed && !(inside > 0.0f && d2 < inside * inside))
        {
            return 0;
        }
    }
    return 1;
}

// To which receivers of a row a triangle is too near for each rule: bits. s^2 = r^2 + 2 h p + h^2, h the nearest of the
// channels'; the least of their distances from the triangle's plane.
static void sss_bem__near_lanes(const sss_bem *b, const sss_bem__lanes *lanes, const sss_bem__node *node,
                                const sss_bem__nearness *near, uint32_t bits[SSS_BEM__REACH_KINDS])
{
    const float *center = node->center, *normal = b->corners[node->triangle].normal;
    int lane, kind, rule;
#if defined(SSS_BEM__AVX512)
    if (b->options.path == SSS_BEM_PATH_AVX512)
    {
        sss_bem__near_lanes16(&b->model, lanes, center, normal, near, bits);
        return;
    }
#endif
#if defined(SSS_BEM__AVX2)
    if (b->options.path == SSS_BEM_PATH_AVX2)
    {
        sss_bem__near_lanes8(&b->model, lanes, center, normal, near, bits);
        return;
    }
#endif
    memset(bits, 0, SSS_BEM__REACH_KINDS * sizeof *bits);
    for (lane = 0; lane < SSS_BEM__LANES; lane++)
    {
        const float n[3] = {lanes->n[0][lane], lanes->n[1][lane], lanes->n[2][lane]};
        const float w[3] = {center[0] - lanes->x[0][lane], center[1] - lanes->x[1][lane],
                            center[2] - lanes->x[2][lane]};
        const float p = sss_bem__dotf(w, n), r2 = sss_bem__dotf(w, w);
        const float plane = sss_bem__dotf(w, normal), cosine = sss_bem__dotf(n, normal);
        for (kind = 0; kind < 2; kind++)
        {
            const float *range = b->model.height_range[kind], *over = b->model.over_height[kind];
            const float h = -p < range[0] ? range[0] : -p > range[1] ? range[1] : -p;
            const float s2 = r2 + (2.0f * p + h) * h;
            const float u = plane * over[0] + cosine, v = plane * over[1] + cosine;
            const float height2 = sss_bem__least(u * v, sss_bem__least(u * u, v * v)); // u v < 0: one is in the plane
            const int touched = s2 < near->touch[kind] * near->touch[kind];
            for (rule = 0; rule < SSS_BEM__REACH_KINDS; rule++)
            {
                bits[rule] |= (uint32_t)(s2 < near->reach[rule][kind] * near->reach[rule][kind]
                                         || (touched && height2 < near->edge[rule][kind])) << lane;
            }
        }
    }
}

// A walk over the tree for one row, depth first, that stops where its buffers are full.
typedef struct sss_bem__walk
{
    const sss_bem *bem;
    const sss_bem__lanes *lanes;
    sss_bem__spheres spheres;
    uint32_t lane_mask;  // lanes in use
    int lit_only;        // clusters without light are left out
    uint32_t since;      // subtrees that did not change after that are kept; 0: none
    uint32_t next;       // node
    uint32_t kept;       // such a subtree, at which the walk stopped and which ends at next; UINT32_MAX: none
    uint32_t not_before; // subtrees that begin before this node are walked all the same
    size_t counts[SSS_BEM__KINDS];
    sss_bem__link links[SSS_BEM__KINDS][SSS_BEM__BATCH];
} sss_bem__walk;

static void sss_bem__empty_walk(sss_bem__walk *w)
{
    memset(w->counts, 0, sizeof w->counts);
}

static void sss_bem__start_walk(const sss_bem *b, const sss_bem__lanes *lanes, const sss_bem__spheres *spheres,
                                size_t lane_count, int lit_only, sss_bem__walk *w)
{
    w->bem = b;
    w->lanes = lanes;
    w->lane_mask = ((uint32_t)1 << lane_count) - 1;
    w->lit_only = lit_only;
    w->since = 0;
    w->next = 0;
    w->not_before = 0;
    sss_bem__empty_walk(w);
    w->spheres = *spheres;
}

static void sss_bem__emit(sss_bem__walk *w, int kind, uint32_t node, uint32_t who)
{
    sss_bem__link *link = &w->links[kind][w->counts[kind]++];
    link->node = node;
    link->who = who;
}

static void sss_bem__triangle_nearness(const sss_bem *b, const sss_bem__node *node, sss_bem__nearness *out)
{
    const float long_by = node->radius - b->half_size[node->size];
    int rule, kind;
    for (kind = 0; kind < 2; kind++)
    {
        const float touch = b->touch[kind][node->size];
        out->touch[kind] = touch > 0.0f && long_by > 0.0f ? touch + long_by : touch;
        for (rule = 0; rule < SSS_BEM__REACH_KINDS; rule++)
        {
            out->reach[rule][kind] = sss_bem__node_reach(b, node, rule, kind);
            out->edge[rule][kind] = b->edge[rule][kind][node->size];
        }
    }
}

// A triangle that some of the row's receivers cannot take by moments: by points, or else as pairs.
static void sss_bem__emit_near(sss_bem__walk *w, uint32_t index)
{
    const sss_bem *b = w->bem;
    const sss_bem__node *node = &b->nodes[index];
    const int edges = node->radius > b->long_radius ? SSS_BEM__LONG_EDGES : SSS_BEM__EDGES;
    sss_bem__nearness near;
    uint32_t near_lanes[SSS_BEM__REACH_KINDS], pairs, lane;
    sss_bem__triangle_nearness(b, node, &near);
    sss_bem__near_lanes(b, w->lanes, node, &near, near_lanes);
    if ((near_lanes[SSS_BEM__FAR] & w->lane_mask) == 0)
    {
        sss_bem__emit(w, SSS_BEM__FAR, index, 0xffff);
        return;
    }
    pairs = near_lanes[SSS_BEM__FAR] & near_lanes[SSS_BEM__NEAR] & w->lane_mask;
    if (pairs != w->lane_mask)
    {
        sss_bem__emit(w, SSS_BEM__NEAR, index, 0xffff & ~pairs);
    }
    for (lane = 0; pairs >> lane != 0; lane++)
    {
        if (pairs >> lane & 1u)
        {
            sss_bem__emit(w, near_lanes[SSS_BEM__CLOSE] >> lane & 1u ? edges : SSS_BEM__CLOSE, index, lane);
        }
    }
}

// Appends links and pairs until a buffer could overflow or a subtree is kept (returns 1), or the surface is covered
// (0).
static int sss_bem__walk_on(sss_bem__walk *w)
{
    const sss_bem__stop *stops = w->bem->stops;
    const size_t *n = w->counts;
    const uint32_t end = (uint32_t)w->bem->node_count;
    uint32_t i = w->next;
    w->kept = UINT32_MAX;
    while (i < end && n[SSS_BEM__FAR] < SSS_BEM__BATCH && n[SSS_BEM__NEAR] < SSS_BEM__BATCH
           && n[SSS_BEM__CLOSE] + SSS_BEM__LANES <= SSS_BEM__BATCH
           && n[SSS_BEM__EDGES] + SSS_BEM__LANES <= SSS_BEM__BATCH
           && n[SSS_BEM__LONG_EDGES] + SSS_BEM__LANES <= SSS_BEM__BATCH)
    {
        const sss_bem__stop *stop = &stops[i];
        if (w->since > 0 && i >= w->not_before && w->bem->stamps[i] <= w->since)
        {
            w->kept = i;
            w->next = stop->end;
            return 1;
        }
        if (w->lit_only && !stop->is_lit)
        {
            i = stop->end;
        }
        else if (sss_bem__row_accepts(&w->bem->model, &w->spheres, stop))
        {
            sss_bem__emit(w, SSS_BEM__FAR, i, 0xffff);
            i = stop->end;
        }
        else
        {
            if (stop->is_leaf)
            {
                sss_bem__emit_near(w, i);
            }
            i++;
        }
    }
    w->next = i;
    return i < end;
}

// ---- factors and sums ----

// Receivers that have pairs instead get nothing from the link.
static void sss_bem__mask_factors(const sss_bem__model *m, const sss_bem__link *links, size_t count, uint32_t *out)
{
    static const float nothing[3] = {0.0f, 0.0f, 0.0f};
    size_t k;
    int lane, c;
    for (k = 0; k < count; k++)
    {
        for (lane = 0; lane < SSS_BEM__LANES && links[k].who != 0xffff; lane++)
        {
            for (c = 0; c < 3 && !(links[k].who >> lane & 1u); c++)
            {
                sss_bem__put_factor(m->half_k, out + k * m->factor_words, c, lane, nothing);
            }
        }
    }
}

static void sss_bem__far_factors(const sss_bem *b, const sss_bem__lanes *lanes, const sss_bem__link *links,
                                 size_t count, uint32_t *out)
{
    size_t k;
    int lane;
#if defined(SSS_BEM__AVX512)
    if (b->options.path == SSS_BEM_PATH_AVX512)
    {
        sss_bem__far_factors16(&b->model, lanes, b->nodes, links, count, out);
        return;
    }
#endif
#if defined(SSS_BEM__AVX2)
    if (b->options.path == SSS_BEM_PATH_AVX2)
    {
        sss_bem__far_factors8(&b->model, lanes, b->nodes, links, count, out);
        return;
    }
#endif
    for (k = 0; k < count; k++)
    {
        for (lane = 0; lane < SSS_BEM__LANES; lane++)
        {
            float kab[3][3];
            sss_bem__cluster_factor(&b->model, lanes, lane, &b->nodes[links[k].node], kab);
            sss_bem__put_factors(b->model.half_k, out + k * b->model.factor_words, lane, kab);
        }
    }
}

static void sss_bem__near_factors(const sss_bem *b, const sss_bem__lanes *lanes, uint32_t index, uint32_t *out)
{
    const sss_bem__node *node = &b->nodes[index];
    const sss_bem__corners *corners = &b->corners[node->triangle];
    int lane;
#if defined(SSS_BEM__AVX512)
    if (b->options.path == SSS_BEM_PATH_AVX512)
    {
        sss_bem__near_factors16(&b->model, lanes, corners, node->area, out);
        return;
    }
#endif
#if defined(SSS_BEM__AVX2)
    if (b->options.path == SSS_BEM_PATH_AVX2)
    {
        sss_bem__near_factors8(&b->model, lanes, corners, node->area, out);
        return;
    }
#endif
    for (lane = 0; lane < SSS_BEM__LANES; lane++)
    {
        float kab[3][3];
        sss_bem__near_factor(&b->model, lanes, lane, corners, node->area, kab);
        sss_bem__put_factors(b->model.half_k, out, lane, kab);
    }
}

static void sss_bem__link_factors(const sss_bem *b, const sss_bem__lanes *lanes, int kind, const sss_bem__link *links,
                                  size_t count, uint32_t *out)
{
    size_t k;
    if (kind == SSS_BEM__FAR)
    {
        sss_bem__far_factors(b, lanes, links, count, out);
        return;
    }
    for (k = 0; k < count; k++)
    {
        sss_bem__near_factors(b, lanes, links[k].node, out + k * b->model.factor_words);
    }
    sss_bem__mask_factors(&b->model, links, count, out);
}

static void sss_bem__fill_block(const sss_bem *b, const sss_bem__lanes *lanes, const sss_bem__link *pairs,
                                size_t count, sss_bem__block *block)
{
    size_t place;
    int i, k;
    for (place = 0; place < SSS_BEM__LANES; place++)
    {
        const sss_bem__link *pair = &pairs[place < count ? place : count - 1];
        const sss_bem__node *node = &b->nodes[pair->node];
        const sss_bem__corners *corners = &b->corners[node->triangle];
        for (i = 0; i < 3; i++)
        {
            for (k = 0; k < 3; k++)
            {
                block->w[k][i][place] = corners->x[k][i] - lanes->x[i][pair->who];
            }
            block->n[i][place] = lanes->n[i][pair->who];
            block->normal[i][place] = corners->normal[i];
        }
        block->area[place] = node->area;
    }
}

// Factors of up to a block of pairs of one kind.
static void sss_bem__pair_factors(const sss_bem *b, const sss_bem__lanes *lanes, const sss_bem__link *pairs, int kind,
                                  size_t count, uint32_t *out)
{
    const sss_bem__model *m = &b->model;
    sss_bem__block block;
    int place;
    sss_bem__fill_block(b, lanes, pairs, count, &block);
#if defined(SSS_BEM__AVX512)
    if (b->options.path == SSS_BEM_PATH_AVX512)
    {
        kind == SSS_BEM__CLOSE ? sss_bem__close_factors16(m, &block, out)
                               : sss_bem__edge_factors16(m, &m->rule[kind == SSS_BEM__LONG_EDGES], &block, out);
        return;
    }
#endif
#if defined(SSS_BEM__AVX2)
    if (b->options.path == SSS_BEM_PATH_AVX2)
    {
        kind == SSS_BEM__CLOSE ? sss_bem__close_factors8(m, &block, out)
                               : sss_bem__edge_factors8(m, &m->rule[kind == SSS_BEM__LONG_EDGES], &block, out);
        return;
    }
#endif
    for (place = 0; place < (int)count; place++)
    {
        sss_bem__pair_factor(m, &block, kind, place, out);
    }
}

// What a row's receivers gather: the kinds of links and pairs apart, so that the order within each never changes.
typedef struct sss_bem__sums
{
    float light[SSS_BEM__KINDS][3][SSS_BEM__LANES];
} sss_bem__sums;

static void sss_bem__add_far(const sss_bem *b, const sss_bem__lanes *lanes, const sss_bem__link *links,
                             const uint32_t *factors, size_t count, float (*light)[SSS_BEM__LANES])
{
    size_t k;
    int c, i, lane;
#if defined(SSS_BEM__AVX512)
    if (b->options.path == SSS_BEM_PATH_AVX512)
    {
        sss_bem__add_far16(&b->model, lanes, b->nodes, b->lights, links, factors, count, light);
        return;
    }
#endif
#if defined(SSS_BEM__AVX2)
    if (b->options.path == SSS_BEM_PATH_AVX2)
    {
        sss_bem__add_far8(&b->model, lanes, b->nodes, b->lights, links, factors, count, light);
        return;
    }
#endif
    for (k = 0; k < count; k++)
    {
        const float *center = b->nodes[links[k].node].center;
        const sss_bem__light *from = &b->lights[links[k].node];
        for (c = 0; c < 3; c++)
        {
            for (lane = 0; lane < SSS_BEM__LANES; lane++)
            {
                float along = 0.0f, across = 0.0f, kab[3];
                sss_bem__get_factor(b->model.half_k, factors + k * b->model.factor_words, c, lane, kab);
                for (i = 0; i < 3; i++)
                {
                    along += (center[i] - lanes->x[i][lane]) * from->v[3 + 3 * c + i];
                    across += lanes->n[i][lane] * from->v[3 + 3 * c + i];
                }
                light[c][lane] += from->v[c] * kab[0] + along * kab[1] + across * kab[2];
            }
        }
    }
}

// A triangle's light for one lane.
static float sss_bem__triangle_light(const sss_bem *b, const float (*E)[3], const uint32_t *factor, int c, int lane)
{
    float kab[3];
    sss_bem__get_factor(b->model.half_k, factor, c, lane, kab);
    return E[0][c] * kab[0] + (E[1][c] - E[0][c]) * kab[1] + (E[2][c] - E[0][c]) * kab[2];
}

static void sss_bem__add_near(const sss_bem *b, uint32_t node, const uint32_t *factor, float (*light)[SSS_BEM__LANES])
{
    const float (*E)[3] = (const float (*)[3])b->corner_E[b->nodes[node].triangle];
    int c, lane;
#if defined(SSS_BEM__AVX512)
    if (b->options.path == SSS_BEM_PATH_AVX512)
    {
        sss_bem__add_near16(&b->model, E, factor, light);
        return;
    }
#endif
#if defined(SSS_BEM__AVX2)
    if (b->options.path == SSS_BEM_PATH_AVX2)
    {
        sss_bem__add_near8(&b->model, E, factor, light);
        return;
    }
#endif
    for (c = 0; c < 3; c++)
    {
        for (lane = 0; lane < SSS_BEM__LANES; lane++)
        {
            light[c][lane] += sss_bem__triangle_light(b, E, factor, c, lane);
        }
    }
}

static void sss_bem__add_links(const sss_bem *b, const sss_bem__lanes *lanes, int kind, const sss_bem__link *links,
                               const uint32_t *factors, size_t count, sss_bem__sums *sums)
{
    size_t k;
    if (kind == SSS_BEM__FAR)
    {
        sss_bem__add_far(b, lanes, links, factors, count, sums->light[kind]);
        return;
    }
    for (k = 0; k < count; k++)
    {
        sss_bem__add_near(b, links[k].node, factors + k * b->model.factor_words, sums->light[kind]);
    }
}

static void sss_bem__add_pairs(const sss_bem *b, const sss_bem__link *pairs, const uint32_t *factors,
                               size_t count, float (*light)[SSS_BEM__LANES])
{
    size_t k;
    int c;
    for (k = 0; k < count; k++)
    {
        const float (*E)[3] = (const float (*)[3])b->corner_E[b->nodes[pairs[k].node].triangle];
        for (c = 0; c < 3; c++)
        {
            light[c][pairs[k].who] += sss_bem__triangle_light(b, E, factors, c, (int)k);
        }
    }
}

static double sss_bem__total(const sss_bem__sums *sums, int c, int lane)
{
    double sum = 0.0;
    int kind;
    for (kind = 0; kind < SSS_BEM__KINDS; kind++)
    {
        sum += (double)sums->light[kind][c][lane];
    }
    return sum;
}

static void sss_bem__scale_sums(const sss_bem *b, const sss_bem__sums *sums, int lane, float out[3])
{
    int c;
    for (c = 0; c < 3; c++)
    {
        out[c] = (float)(sss_bem__total(sums, c, lane) * b->irradiance_scale);
    }
}

// ---- on the fly ----

// Gathers the complete blocks of pairs, at the end all; what is left moves to the front.
static void sss_bem__gather_pairs(const sss_bem *b, sss_bem__walk *w, int kind, int all, sss_bem__sums *sums)
{
    sss_bem__link *pairs = w->links[kind];
    size_t done = 0;
    while (done + SSS_BEM__LANES <= w->counts[kind] || (all && done < w->counts[kind]))
    {
        const size_t count = sss_bem__at_most(w->counts[kind] - done, SSS_BEM__LANES);
        uint32_t factors[SSS_BEM__FACTOR_WORDS];
        sss_bem__pair_factors(b, w->lanes, pairs + done, kind, count, factors);
        sss_bem__add_pairs(b, pairs + done, factors, count, sums->light[kind]);
        done += count;
    }
    w->counts[kind] -= done;
    memmove(pairs, pairs + done, w->counts[kind] * sizeof *pairs);
}

static void sss_bem__gather(const sss_bem *b, const sss_bem__lanes *lanes, const sss_bem__spheres *spheres,
                            size_t lane_count, sss_bem__sums *sums)
{
    sss_bem__walk walk;
    uint32_t factors[SSS_BEM__BATCH * SSS_BEM__FACTOR_WORDS];
    int more = 1, kind;
    memset(sums, 0, sizeof *sums);
    sss_bem__start_walk(b, lanes, spheres, lane_count, 1, &walk);
    while (more)
    {
        more = sss_bem__walk_on(&walk);
        for (kind = 0; kind < SSS_BEM__LINK_KINDS; kind++)
        {
            const size_t count = walk.counts[kind];
            sss_bem__link_factors(b, lanes, kind, walk.links[kind], count, factors);
            sss_bem__add_links(b, lanes, kind, walk.links[kind], factors, count, sums);
            walk.counts[kind] = 0;
        }
        for (kind = SSS_BEM__LINK_KINDS; kind < SSS_BEM__KINDS; kind++)
        {
            sss_bem__gather_pairs(b, &walk, kind, !more, sums);
        }
    }
}

static void sss_bem__gather_row(const sss_bem *b, size_t row, sss_bem__sums *sums)
{
    sss_bem__gather(b, &b->lanes[row], &b->spheres[row], b->rows[row].count, sums);
}

// ---- checks ----

static int sss_bem__valid_profile(const sss_profile *p)
{
    int c;
    for (c = 0; c < 3; c++)
    {
        const double most = 1e300;
        if (!sss_bem__in_range(p->alpha_p[c], 0.0, 1.0) || !sss_bem__in_range(p->sigma_tr[c], 0.0, most)
            || !sss_bem__in_range(p->z_r[c], 0.0, most) || !sss_bem__in_range(p->z_v[c], 0.0, most)
            || (p->alpha_p[c] > 0.0 && !(p->z_r[c] > 0.0 && p->z_v[c] > 0.0)))
        {
            return 0;
        }
    }
    return 1;
}

static int sss_bem__has_path(sss_bem_path path)
{
    switch (path)
    {
    case SSS_BEM_PATH_AUTO:
    case SSS_BEM_PATH_PORTABLE: return 1;
    case SSS_BEM_PATH_AVX2:
#if defined(SSS_BEM__AVX2)
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
        return 0;
#endif
    case SSS_BEM_PATH_AVX512:
#if defined(SSS_BEM__AVX512)
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")
               && __builtin_cpu_supports("fma");
#else
        return 0;
#endif
    }
    return 0;
}

// ---- what is told of a mesh ----

#define SSS_BEM__BORDER_BINS 512
#define SSS_BEM__BORDER_ROUNDING 1e-12 // of all edges' length: below this a bin's sum is rounding
#define SSS_BEM__VOLUME_ROUNDING 1e-6  // of areas times distances: corners are given as float, a sheet encloses nothing

typedef struct sss_bem__condition
{
    double bins[SSS_BEM__BORDER_BINS];
    double edge_sum, longest_edge, border; // lengths in the positions' unit
    double area, area_against, volume, volume_size; // twice the areas, six times the volumes
    double center[3];
} sss_bem__condition;

// An edge's ends in order, by their bits, so that it is the same edge from either side; -0 is 0. 1, -1; 0: no length.
static int sss_bem__edge_order(const float *p, const float *q, uint64_t *hash)
{
    uint32_t bits[6];
    int i, order = 0;
    memcpy(bits, p, 3 * sizeof *p);
    memcpy(bits + 3, q, 3 * sizeof *q);
    for (i = 0; i < 6; i++)
    {
        bits[i] = bits[i] == 0x80000000u ? 0u : bits[i];
    }
    for (i = 0; i < 3 && order == 0; i++)
    {
        order = bits[i] < bits[3 + i] ? 1 : bits[i] > bits[3 + i] ? -1 : 0;
    }
    *hash = 14695981039346656037u; // as FNV-1a, over words, with a shift that brings high bits down
    for (i = 0; i < 6; i++)
    {
        *hash = (*hash ^ bits[order < 0 ? (i + 3) % 6 : i]) * 1099511628211u;
        *hash ^= *hash >> 29;
    }
    return order;
}

static void sss_bem__inspect_triangle(const float *positions, const float *normals, const uint32_t *v,
                                      sss_bem__condition *c)
{
    double e[3][3], corner[3], cross[3], length;
    int i, k;
    for (k = 0; k < 3; k++)
    {
        const float *const p = positions + 3 * (size_t)v[k], *const q = positions + 3 * (size_t)v[(k + 1) % 3];
        uint64_t hash;
        const int order = sss_bem__edge_order(p, q, &hash);
        for (i = 0; i < 3; i++)
        {
            e[k][i] = (double)q[i] - (double)p[i];
        }
        length = sqrt(sss_bem__dot(e[k], e[k]));
        c->edge_sum += length;
        c->longest_edge = sss_bem__max(c->longest_edge, length);
        c->bins[hash % SSS_BEM__BORDER_BINS] += (double)order * length;
    }
    for (i = 0; i < 3; i++)
    {
        corner[i] = (double)positions[3 * (size_t)v[0] + (size_t)i] - c->center[i];
    }
    sss_bem__cross(e[0], e[1], cross);
    length = sqrt(sss_bem__dot(cross, cross));
    c->area += length;
    c->volume += sss_bem__dot(corner, cross);
    c->volume_size += sqrt(sss_bem__dot(corner, corner)) * length;
    for (k = 0; k < 3 && normals != NULL; k++)
    {
        const float *const n = normals + 3 * (size_t)v[k];
        const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
        c->area_against += sss_bem__dot(normal, cross) < 0.0 ? length / 3.0 : 0.0;
    }
}

// How edges pair up, without a table of edges: each counts with a sign by its direction, into the bin that its place
// decides. The two sides of an inner edge cancel; what is left in the bins is at most the length of the border, and
// nearly all of it where there are fewer border edges than bins.
//   positions  [][3];   normals  [][3] or NULL
static void sss_bem__inspect(const float *positions, const float *normals, const uint32_t *triangles, size_t count,
                             sss_bem__condition *c)
{
    size_t t, k;
    memset(c, 0, sizeof *c);
    for (t = 0; t < 3 * count; t++)
    {
        for (k = 0; k < 3; k++)
        {
            c->center[k] += (double)positions[3 * (size_t)triangles[t] + k] / (3.0 * (double)count);
        }
    }
    for (t = 0; t < count; t++)
    {
        sss_bem__inspect_triangle(positions, normals, triangles + 3 * t, c);
    }
    for (k = 0; k < SSS_BEM__BORDER_BINS; k++)
    {
        c->border += fabs(c->bins[k]) > SSS_BEM__BORDER_ROUNDING * c->edge_sum ? fabs(c->bins[k]) : 0.0;
    }
}

// Into the stats.   mm  a unit of the positions
static void sss_bem__tell_condition(const sss_bem__condition *c, size_t count, double mm, const sss_profile *profile,
                                    sss_bem_stats *stats)
{
    double path = 0.0; // the shortest mean free path of channels that scatter, mm
    int k;
    for (k = 0; k < 3; k++)
    {
        if (profile->alpha_p[k] > 0.0 && profile->z_r[k] > 0.0 && (path == 0.0 || profile->z_r[k] < path))
        {
            path = profile->z_r[k];
        }
    }
    stats->edge_paths = path > 0.0 ? c->edge_sum / (3.0 * (double)count) * mm / path : 0.0;
    stats->longest_edge_paths = path > 0.0 ? c->longest_edge * mm / path : 0.0;
    stats->border_mm = c->border * mm;
    stats->normals_against = c->area > 0.0 ? c->area_against / c->area : 0.0;
    stats->inside_out = c->volume < -SSS_BEM__VOLUME_ROUNDING * c->volume_size;
}

static sss_result sss_bem__check_mesh(const sss_mesh *mesh)
{
    size_t i;
    if (mesh == NULL || mesh->positions == NULL || mesh->triangles == NULL
        || !sss_bem__in_range(mesh->mm_per_unit, 1e-100, 1e100))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (mesh->vertex_count == 0 || mesh->triangle_count == 0)
    {
        return SSS_ERROR_EMPTY;
    }
    if (mesh->vertex_count > UINT32_MAX - 64 || mesh->triangle_count > UINT32_MAX / 3
        || mesh->triangle_count > SIZE_MAX / (4 * sizeof(sss_bem__node)))
    {
        return SSS_ERROR_OVERFLOW;
    }
    if (!sss_bem__all_finite(mesh->positions, 3 * mesh->vertex_count)
        || (mesh->normals != NULL && !sss_bem__all_finite(mesh->normals, 3 * mesh->vertex_count)))
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

// Options as given, with defaults filled in. 0 where one is out of range.
static int sss_bem__resolve(const sss_bem_options *given, size_t triangle_count, sss_bem_options *out)
{
    static const sss_bem_options none = {0.0, 0.0, 0.0, 0.0, 0.0, 0, SSS_BEM_ORACLE_CONTRIBUTION, SSS_BEM_PATH_AUTO, 0};
    *out = given != NULL ? *given : none;
    out->tolerance = out->tolerance == 0.0 ? 1e-2 : out->tolerance;
    out->guard = out->guard == 0.0 ? 1.0 : out->guard;
    out->planarity = out->planarity == 0.0 ? 0.7 : out->planarity;
    if (!sss_bem__in_range(out->tolerance, 1e-4, 0.5) || !sss_bem__finite(out->guard) || out->guard > 1.0
        || !sss_bem__in_range(out->planarity, 0.0, 1.0) || !sss_bem__in_range(out->epsilon_1, 0.0, 100.0)
        || !sss_bem__in_range(out->epsilon_2, 0.0, 100.0) || (int)out->oracle < 0
        || out->oracle > SSS_BEM_ORACLE_SOLID_ANGLE || !sss_bem__has_path(out->path)
        || sss_bem__count_nodes(triangle_count, out->base_triangle_count) == 0)
    {
        return 0;
    }
    out->epsilon_1 = out->epsilon_1 == 0.0 ? 5.0 * out->tolerance : out->epsilon_1;
    out->epsilon_2 = out->epsilon_2 == 0.0 ? 10.0 * out->tolerance : out->epsilon_2;
    if (out->path == SSS_BEM_PATH_AUTO)
    {
        out->path = sss_bem__has_path(SSS_BEM_PATH_AVX512) ? SSS_BEM_PATH_AVX512
                    : sss_bem__has_path(SSS_BEM_PATH_AVX2) ? SSS_BEM_PATH_AVX2
                                                           : SSS_BEM_PATH_PORTABLE;
    }
    return 1;
}

// ---- geometry ----

static void sss_bem__normalize(const double n[3], float out[3])
{
    const double most = sss_bem__max(fabs(n[0]), sss_bem__max(fabs(n[1]), fabs(n[2])));
    double v[3], length;
    int i;
    for (i = 0; i < 3; i++)
    {
        v[i] = most > 0.0 ? n[i] / most : i == 2 ? 1.0 : 0.0; // no direction: (0, 0, 1)
    }
    length = sss_bem__length(v);
    for (i = 0; i < 3; i++)
    {
        out[i] = (float)(v[i] / length);
    }
}

// Adds each triangle's normal, weighted by its angle, to its corners.   sums [V][3]
static void sss_bem__sum_normals(const sss_bem *b, double (*sums)[3])
{
    size_t t;
    int k, i;
    memset(sums, 0, b->vertex_count * sizeof *sums);
    for (t = 0; t < b->triangle_count; t++)
    {
        const uint32_t *v = b->triangle + 3 * t;
        for (k = 0; k < 3; k++)
        {
            const float *x = b->position[v[k]], *y = b->position[v[(k + 1) % 3]], *z = b->position[v[(k + 2) % 3]];
            double e[3], f[3], cross[3], length, angle;
            for (i = 0; i < 3; i++)
            {
                e[i] = (double)y[i] - (double)x[i];
                f[i] = (double)z[i] - (double)x[i];
            }
            sss_bem__cross(e, f, cross);
            length = sss_bem__length(cross);
            angle = atan2(length, sss_bem__dot(e, f));
            for (i = 0; i < 3 && length > 0.0; i++)
            {
                sums[v[k]][i] += angle * cross[i] / length;
            }
        }
    }
}

// Normals of unit length, given ones where there are any. sums is scratch.
static void sss_bem__set_normals(sss_bem *b, const float *normals, double (*sums)[3])
{
    size_t v;
    int summed = 0;
    for (v = 0; v < b->vertex_count; v++)
    {
        double n[3] = {0.0, 0.0, 0.0};
        if (normals != NULL)
        {
            n[0] = (double)normals[3 * v];
            n[1] = (double)normals[3 * v + 1];
            n[2] = (double)normals[3 * v + 2];
        }
        if (n[0] == 0.0 && n[1] == 0.0 && n[2] == 0.0)
        {
            if (!summed)
            {
                sss_bem__sum_normals(b, sums);
                summed = 1;
            }
            memcpy(n, sums[v], sizeof n);
        }
        sss_bem__normalize(n, b->normal[v]);
    }
}

static void sss_bem__set_positions(sss_bem *b, const float *positions)
{
    size_t v;
    int i;
    for (v = 0; v < b->vertex_count; v++)
    {
        for (i = 0; i < 3; i++)
        {
            b->position[v][i] = (float)(((double)positions[3 * v + (size_t)i] - b->center[i]) * b->scale);
        }
    }
}

// The box of the triangles: vertices outside of them must not cost the others their digits.
static void sss_bem__frame_mesh(sss_bem *b, const float *positions)
{
    double low[3], high[3], diagonal;
    size_t k;
    int i;
    for (i = 0; i < 3; i++)
    {
        low[i] = high[i] = (double)positions[3 * (size_t)b->triangle[0] + (size_t)i];
        for (k = 1; k < 3 * b->triangle_count; k++)
        {
            const double x = (double)positions[3 * (size_t)b->triangle[k] + (size_t)i];
            low[i] = sss_bem__min(low[i], x);
            high[i] = sss_bem__max(high[i], x);
        }
        b->center[i] = 0.5 * (low[i] + high[i]);
        high[i] -= low[i];
    }
    diagonal = sss_bem__length(high);
    b->scale = diagonal > 0.0 ? 1.0 / diagonal : 1.0;
}

// Brings everything that depends on positions and normals up to date, and stamps what changed.
static void sss_bem__lanes_task(void *context, size_t begin, size_t end)
{
    sss_bem *b = (sss_bem *)context;
    size_t row;
    for (row = begin; row < end; row++)
    {
        const sss_bem__lanes before = b->lanes[row];
        sss_bem__fill_lanes(b, row);
        sss_bem__bound_sources(b, &b->lanes[row], &b->spheres[row]);
        if (memcmp(&before, &b->lanes[row], sizeof before) != 0)
        {
            b->rows[row].moved = b->generation;
        }
    }
}

static void sss_bem__refit(sss_bem *b)
{
    sss_bem__parallel(&b->hooks, b->row_count, sss_bem__lanes_task, b);
    sss_bem__go_up(b, sss_bem__refit_node);
    sss_bem__go_up(b, sss_bem__pull_node);
}

// ---- trial rows: how large the error is ----

typedef struct sss_bem__trial
{
    const sss_bem *bem;        // gathers this time
    size_t count;              // rows
    float (*light[2])[3][SSS_BEM__LANES]; // [0] as it is, [1] strictly: [count]
    int strict;                // which of the two
    const float *area;         // [vertex_count] what vertices weigh; NULL: all the same
} sss_bem__trial;

static size_t sss_bem__trial_rows(const sss_bem *b, size_t vertices)
{
    return sss_bem__at_most((vertices + SSS_BEM__LANES - 1) / SSS_BEM__LANES, b->row_count);
}

// Shares everything but the distances at which clusters are accepted.   stops  [node_count]
static void sss_bem__make_strict(const sss_bem *b, double tolerance, sss_bem__stop *stops, sss_bem *strict)
{
    *strict = *b;
    strict->stops = stops;
    memcpy(stops, b->stops, b->node_count * sizeof *stops);
    strict->options.tolerance = tolerance;
    strict->point_ease = 0.1;
    strict->ease = sss_bem__min(b->ease, 1.0);
    sss_bem__choose_rules(strict);
    sss_bem__plan_reach(strict);
    sss_bem__set_stops(strict);
}

static size_t sss_bem__trial_row(const sss_bem__trial *t, size_t k)
{
    return k * (t->bem->row_count / t->count) + k * (t->bem->row_count % t->count) / t->count;
}

static void sss_bem__trial_task(void *context, size_t begin, size_t end)
{
    const sss_bem__trial *t = (const sss_bem__trial *)context;
    size_t k;
    for (k = begin; k < end; k++)
    {
        sss_bem__sums sums;
        int lane, c;
        sss_bem__gather_row(t->bem, sss_bem__trial_row(t, k), &sums);
        for (c = 0; c < 3; c++)
        {
            for (lane = 0; lane < SSS_BEM__LANES; lane++)
            {
                t->light[t->strict][k][c][lane] = (float)sss_bem__total(&sums, c, lane);
            }
        }
    }
}

static void sss_bem__gather_trial(sss_bem__trial *t, const sss_bem *b, int strict)
{
    t->bem = b;
    t->strict = strict;
    sss_bem__parallel(&b->hooks, t->count, sss_bem__trial_task, t);
}

// Relative L2 error over the rows.
static double sss_bem__trial_error(const sss_bem__trial *t)
{
    double squares[2] = {0.0, 0.0};
    size_t k;
    uint32_t lane;
    int c;
    for (k = 0; k < t->count; k++)
    {
        const sss_bem__row *r = &t->bem->rows[sss_bem__trial_row(t, k)];
        for (lane = 0; lane < r->count; lane++)
        {
            const double weight = t->area != NULL ? (double)t->area[r->vertex[lane]] : 1.0;
            for (c = 0; c < 3; c++)
            {
                const double a = (double)t->light[0][k][c][lane], b = (double)t->light[1][k][c][lane];
                squares[0] += weight * (a - b) * (a - b);
                squares[1] += weight * b * b;
            }
        }
    }
    return squares[1] > 0.0 ? sqrt(squares[0] / squares[1]) : 0.0;
}

static int sss_bem__allocate_trial(sss_bem__trial *t, const sss_bem *b, size_t vertices)
{
    t->count = sss_bem__trial_rows(b, vertices);
    t->area = NULL;
    t->light[0] = (float (*)[3][SSS_BEM__LANES])sss_bem__allocate(&b->hooks, 2 * t->count, sizeof *t->light[0]);
    t->light[1] = t->light[0] != NULL ? t->light[0] + t->count : NULL;
    return t->light[0] != NULL;
}

// How the errors of a row's clusters add up depends on the mesh and on how far light reaches in it: folds and thin
// parts, octaves of distance. So they are measured, on rows spread over the mesh, under a light of its own, and what a
// single cluster may contribute is eased or tightened until the sum comes to SSS_BEM__AIM of the tolerance. Errors jump
// where triangles begin to count as points: at most a factor of 2 at a step. Measured again for another material, and
// when the mesh has changed its shape; in between ease stays, so that links do.
#define SSS_BEM__AIM 0.55
#define SSS_BEM__LEAST_EASE 0.25
#define SSS_BEM__MOST_EASE 2.5
#define SSS_BEM__EASE_STEPS 16.0

enum
{
    SSS_BEM__CALIBRATION_VERTICES = 256,
    SSS_BEM__CALIBRATION_STEPS = 4
};

// Memory of a calibration; its own light stands in for the caller's.
typedef struct sss_bem__calibration
{
    sss_bem loose, strict;
    sss_bem__stop *stops[2];
    sss_bem__trial trial;
} sss_bem__calibration;

static void sss_bem__end_calibration(const sss_hooks *hooks, sss_bem__calibration *c)
{
    if (c != NULL)
    {
        sss_bem__release(hooks, c->trial.light[0]);
        sss_bem__release(hooks, c->stops[0]);
        sss_bem__release(hooks, c->stops[1]);
        sss_bem__release(hooks, c->loose.lights);
        sss_bem__release(hooks, c->loose.corner_E);
        sss_bem__release(hooks, c);
    }
}

static sss_bem__calibration *sss_bem__begin_calibration(const sss_bem *b)
{
    sss_bem__calibration *c = (sss_bem__calibration *)sss_bem__allocate(&b->hooks, 1, sizeof *c);
    if (c == NULL)
    {
        return NULL;
    }
    memset(c, 0, sizeof *c);
    c->stops[0] = (sss_bem__stop *)sss_bem__allocate(&b->hooks, b->node_count, sizeof *c->stops[0]);
    c->stops[1] = (sss_bem__stop *)sss_bem__allocate(&b->hooks, b->node_count, sizeof *c->stops[1]);
    c->loose.lights = (sss_bem__light *)sss_bem__allocate(&b->hooks, b->node_count, sizeof *c->loose.lights);
    c->loose.corner_E = (float (*)[3][3])sss_bem__allocate(&b->hooks, b->triangle_count, sizeof *c->loose.corner_E);
    if (!sss_bem__allocate_trial(&c->trial, b, SSS_BEM__CALIBRATION_VERTICES) || !c->stops[0] || !c->stops[1]
        || !c->loose.lights || !c->loose.corner_E)
    {
        sss_bem__end_calibration(&b->hooks, c);
        return NULL;
    }
    return c;
}

// Light along the axes, one for each channel, and a little from everywhere.
static void sss_bem__set_calibration_light(sss_bem *b)
{
    size_t t;
    int k, c;
    for (t = 0; t < b->triangle_count; t++)
    {
        for (k = 0; k < 3; k++)
        {
            const float *n = b->normal[b->triangle[3 * t + (size_t)k]];
            for (c = 0; c < 3; c++)
            {
                b->corner_E[t][k][c] = 0.05f + (n[c] > 0.0f ? n[c] : 0.0f);
            }
        }
    }
    sss_bem__go_up(b, sss_bem__pull_node);
}

static void sss_bem__calibrate(sss_bem *b, sss_bem__calibration *c)
{
    sss_bem__light *const lights = c->loose.lights;
    float (*const corner_E)[3][3] = c->loose.corner_E;
    const double aim = SSS_BEM__AIM * b->options.tolerance;
    double ease = 1.0, best = SSS_BEM__LEAST_EASE, error;
    int step;
    b->ease = 1.0;
    b->point_ease = 1.0;
    sss_bem__plan_reach(b);
    sss_bem__set_stops(b);
    if (b->options.oracle != SSS_BEM_ORACLE_CONTRIBUTION)
    {
        return;
    }
    c->loose = *b;
    c->loose.lights = lights;
    c->loose.corner_E = corner_E;
    c->loose.stops = c->stops[0];
    memcpy(c->stops[0], b->stops, b->node_count * sizeof *b->stops);
    sss_bem__set_calibration_light(&c->loose);
    sss_bem__make_strict(&c->loose, 0.1 * b->options.tolerance, c->stops[1], &c->strict);
    sss_bem__gather_trial(&c->trial, &c->strict, 1);
    for (step = 0; step < SSS_BEM__CALIBRATION_STEPS; step++)
    {
        sss_bem__gather_trial(&c->trial, &c->loose, 0);
        error = sss_bem__trial_error(&c->trial);
        best = error <= 1.1 * aim && ease > best ? ease : best;
        ease *= sss_bem__min(2.0, sss_bem__max(0.5, aim / error)); // without an error: 2
        ease = sss_bem__min(SSS_BEM__MOST_EASE, sss_bem__max(SSS_BEM__LEAST_EASE, ease));
        // The same on all paths, whose sums differ a little.
        ease = floor(ease * SSS_BEM__EASE_STEPS) / SSS_BEM__EASE_STEPS;
        c->loose.ease = ease;
        sss_bem__plan_reach(&c->loose);
        sss_bem__set_stops(&c->loose);
    }
    b->ease = best;
    sss_bem__plan_reach(b);
    sss_bem__set_stops(b);
}

// The extents of the box and the area, of triangles at the given positions, over the diagonal at creation. What was
// calibrated holds as long as they do.
static void sss_bem__measure_shape(const sss_bem *b, const float *positions, double shape[4])
{
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, area = 0.0;
    size_t t;
    int i, k;
    for (t = 0; t < b->triangle_count; t++)
    {
        double e[3], f[3], cross[3];
        const float *x[3];
        for (k = 0; k < 3; k++)
        {
            x[k] = positions + 3 * (size_t)b->triangle[3 * t + (size_t)k];
        }
        for (i = 0; i < 3; i++)
        {
            e[i] = ((double)x[1][i] - (double)x[0][i]) * b->scale;
            f[i] = ((double)x[2][i] - (double)x[0][i]) * b->scale;
            for (k = 0; k < 3; k++)
            {
                low[i] = sss_bem__min(low[i], (double)x[k][i]);
                high[i] = sss_bem__max(high[i], (double)x[k][i]);
            }
        }
        sss_bem__cross(e, f, cross);
        area += 0.5 * sss_bem__length(cross);
    }
    for (i = 0; i < 3; i++)
    {
        shape[i] = (high[i] - low[i]) * b->scale;
    }
    shape[3] = area;
}

#define SSS_BEM__SAME_SHAPE 1.25

static int sss_bem__same_shape(const double a[4], const double b[4])
{
    int i;
    for (i = 0; i < 4; i++)
    {
        const double least = 0.02; // of the diagonal: thinner is a sheet
        const double x = sss_bem__max(a[i], least), y = sss_bem__max(b[i], least);
        if (x > SSS_BEM__SAME_SHAPE * y || y > SSS_BEM__SAME_SHAPE * x)
        {
            return 0;
        }
    }
    return 1;
}

static void sss_bem__mark_all(sss_bem *b)
{
    size_t i;
    for (i = 0; i < b->node_count; i++)
    {
        b->nodes[i].stamp = b->stamps[i] = b->generation;
    }
}

// ---- creation ----

static void *sss_bem__own(sss_bem *b, size_t count, size_t size)
{
    b->bytes += count * size;
    return sss_bem__allocate(&b->hooks, count, size);
}

static sss_result sss_bem__allocate_all(sss_bem *b)
{
    const size_t V = b->vertex_count, T = b->triangle_count, N = b->node_count, R = b->row_count;
    b->nodes = (sss_bem__node *)sss_bem__own(b, N, sizeof *b->nodes);
    b->stops = (sss_bem__stop *)sss_bem__own(b, N, sizeof *b->stops);
    b->stamps = (uint32_t *)sss_bem__own(b, N, sizeof *b->stamps);
    b->lights = (sss_bem__light *)sss_bem__own(b, N, sizeof *b->lights);
    b->area_vector = (float (*)[3])sss_bem__own(b, N, sizeof *b->area_vector);
    b->box = (float (*)[6])sss_bem__own(b, N, sizeof *b->box);
    b->position = (float (*)[3])sss_bem__own(b, V, sizeof *b->position);
    b->normal = (float (*)[3])sss_bem__own(b, V, sizeof *b->normal);
    b->triangle = (uint32_t *)sss_bem__own(b, T, 3 * sizeof *b->triangle);
    b->corners = (sss_bem__corners *)sss_bem__own(b, T, sizeof *b->corners);
    b->corner_E = (float (*)[3][3])sss_bem__own(b, T, sizeof *b->corner_E);
    b->rows = (sss_bem__row *)sss_bem__own(b, R, sizeof *b->rows);
    if (b->rows != NULL)
    {
        memset(b->rows, 0, R * sizeof *b->rows); // freeing looks into it, whatever fails next
    }
    b->lanes = (sss_bem__lanes *)sss_bem__own(b, R, sizeof *b->lanes);
    b->spheres = (sss_bem__spheres *)sss_bem__own(b, R, sizeof *b->spheres);
    b->row_of_vertex = (uint32_t *)sss_bem__own(b, V, sizeof *b->row_of_vertex);
    if (!b->nodes || !b->stops || !b->stamps || !b->lights || !b->area_vector || !b->box || !b->position
        || !b->normal || !b->triangle || !b->corners || !b->corner_E || !b->rows || !b->lanes || !b->spheres
        || !b->row_of_vertex)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    memset(b->nodes, 0, N * sizeof *b->nodes);
    memset(b->stops, 0, N * sizeof *b->stops);
    memset(b->stamps, 0, N * sizeof *b->stamps);
    memset(b->lights, 0, N * sizeof *b->lights);
    memset(b->lanes, 0, R * sizeof *b->lanes);
    memset(b->corners, 0, T * sizeof *b->corners);
    memset(b->corner_E, 0, T * sizeof *b->corner_E);
    return SSS_OK;
}

static sss_result sss_bem__fill(sss_bem *b, const sss_mesh *mesh)
{
    double (*sums)[3] = (double (*)[3])sss_bem__allocate(&b->hooks, b->vertex_count, sizeof *sums);
    uint32_t *order = (uint32_t *)sss_bem__allocate(&b->hooks, b->vertex_count, sizeof *order);
    sss_result result = sums != NULL && order != NULL ? SSS_OK : SSS_ERROR_OUT_OF_MEMORY;
    size_t v;
    if (result == SSS_OK)
    {
        memcpy(b->triangle, mesh->triangles, 3 * b->triangle_count * sizeof *b->triangle);
        sss_bem__frame_mesh(b, mesh->positions);
        sss_bem__set_positions(b, mesh->positions);
        sss_bem__set_normals(b, mesh->normals, sums);
        sss_bem__choose_rules(b);
        sss_bem__set_model(b);
        sss_bem__plan_reach(b);
        for (v = 0; v < b->vertex_count; v++)
        {
            order[v] = (uint32_t)v;
        }
        sss_bem__make_rows(b, order);
        result = sss_bem__build_tree(b);
    }
    sss_bem__release(&b->hooks, order);
    sss_bem__release(&b->hooks, sums);
    if (result == SSS_OK)
    {
        sss_bem__calibration *calibration = sss_bem__begin_calibration(b);
        if (calibration == NULL)
        {
            return SSS_ERROR_OUT_OF_MEMORY;
        }
        sss_bem__refit(b);
        sss_bem__measure_shape(b, mesh->positions, b->shape);
        sss_bem__calibrate(b, calibration);
        sss_bem__end_calibration(&b->hooks, calibration);
    }
    return result;
}

SSS_BEM_API sss_result sss_bem_create(const sss_mesh *mesh, const sss_profile *profile, const sss_bem_options *options,
                                      const sss_hooks *hooks, sss_bem **out)
{
    sss_hooks h = {NULL, NULL, NULL, NULL, NULL};
    sss_bem_options resolved;
    sss_bem *b;
    sss_result result = sss_bem__check_mesh(mesh);
    if (result != SSS_OK)
    {
        return result;
    }
    if (hooks != NULL)
    {
        h = *hooks;
    }
    if (out == NULL || profile == NULL || !sss_bem__valid_profile(profile)
        || !sss_bem__resolve(options, mesh->triangle_count, &resolved) || (h.allocate != NULL && h.release == NULL))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    b = (sss_bem *)sss_bem__allocate(&h, 1, sizeof *b);
    if (b == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    memset(b, 0, sizeof *b);
    b->hooks = h;
    b->options = resolved;
    b->profile = *profile;
    b->mm_per_unit = mesh->mm_per_unit;
    b->irradiance_scale = 0.0;
    b->predicted_error = -1.0;
    b->ease = 1.0;
    b->generation = 1;
    b->bytes = sizeof *b;
    b->vertex_count = mesh->vertex_count;
    b->triangle_count = mesh->triangle_count;
    b->node_count = sss_bem__count_nodes(mesh->triangle_count, resolved.base_triangle_count);
    b->row_count = (mesh->vertex_count + SSS_BEM__LANES - 1) / SSS_BEM__LANES;
    result = sss_bem__allocate_all(b);
    result = result == SSS_OK ? sss_bem__fill(b, mesh) : result;
    if (result != SSS_OK)
    {
        sss_bem_free(b);
        return result;
    }
    *out = b;
    return SSS_OK;
}

SSS_BEM_API void sss_bem_unlink(sss_bem *bem)
{
    size_t row;
    if (bem == NULL)
    {
        return;
    }
    sss_bem__release(&bem->hooks, bem->part_first);
    sss_bem__release(&bem->hooks, bem->cluster_links);
    bem->part_first = NULL;
    bem->cluster_links = NULL;
    bem->linked = 0;
    for (row = 0; bem->rows != NULL && row < bem->row_count; row++)
    {
        sss_bem__release(&bem->hooks, bem->rows[row].data);
        bem->rows[row].data = NULL;
        bem->rows[row].capacity = 0;
        memset(bem->rows[row].counts, 0, sizeof bem->rows[row].counts);
        bem->rows[row].stamp = 0;
    }
}

SSS_BEM_API void sss_bem_free(sss_bem *bem)
{
    if (bem != NULL)
    {
        const sss_hooks hooks = bem->hooks;
        void *const parts[] = {bem->nodes,  bem->stops,    bem->lights,  bem->area_vector, bem->box,
                               bem->normal, bem->position, bem->corners, bem->corner_E,    bem->triangle,
                               bem->rows,   bem->lanes,    bem->spheres, bem->chunks,      bem->top,
                               bem->stamps, bem->row_of_vertex};
        size_t i;
        sss_bem_unlink(bem);
        for (i = 0; i < sizeof parts / sizeof parts[0]; i++)
        {
            sss_bem__release(&hooks, parts[i]);
        }
        sss_bem__release(&hooks, bem);
    }
}

// ---- light, geometry, material ----

SSS_BEM_API sss_result sss_bem_set_irradiance(sss_bem *bem, sss_bem_elements elements, const float *irradiance)
{
    size_t count, t, i;
    float largest = 0.0f, over;
    int k, c;
    if (bem == NULL || irradiance == NULL || (elements != SSS_BEM_VERTICES && elements != SSS_BEM_TRIANGLES))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    count = elements == SSS_BEM_VERTICES ? bem->vertex_count : bem->triangle_count;
    if (!sss_bem__all_finite(irradiance, 3 * count))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < 3 * count; i++)
    {
        largest = fabsf(irradiance[i]) > largest ? fabsf(irradiance[i]) : largest;
    }
    bem->irradiance_scale = (double)largest;
    over = largest > 0.0f ? 1.0f / largest : 0.0f;
    if (!sss_bem__finite((double)over)) // denormal light
    {
        over = 0.0f;
    }
    for (t = 0; t < bem->triangle_count; t++)
    {
        for (k = 0; k < 3; k++)
        {
            const size_t e = elements == SSS_BEM_VERTICES ? bem->triangle[3 * t + (size_t)k] : t;
            for (c = 0; c < 3; c++)
            {
                bem->corner_E[t][k][c] = irradiance[3 * e + (size_t)c] * over;
            }
        }
    }
    sss_bem__go_up(bem, sss_bem__pull_node);
    bem->predicted_error = -1.0;
    return SSS_OK;
}

SSS_BEM_API sss_result sss_bem_set_vertices(sss_bem *bem, const float *positions, const float *normals)
{
    sss_bem__calibration *calibration;
    double (*sums)[3], shape[4];
    int same_shape;
    if (bem == NULL || positions == NULL || !sss_bem__all_finite(positions, 3 * bem->vertex_count)
        || (normals != NULL && !sss_bem__all_finite(normals, 3 * bem->vertex_count)))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (bem->generation == UINT32_MAX)
    {
        return SSS_ERROR_OVERFLOW;
    }
    sums = (double (*)[3])sss_bem__allocate(&bem->hooks, bem->vertex_count, sizeof *sums);
    if (sums == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_bem__measure_shape(bem, positions, shape);
    same_shape = sss_bem__same_shape(shape, bem->shape);
    calibration = same_shape ? NULL : sss_bem__begin_calibration(bem);
    if (!same_shape && calibration == NULL)
    {
        sss_bem__release(&bem->hooks, sums);
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    bem->generation++;
    sss_bem__set_positions(bem, positions);
    sss_bem__set_normals(bem, normals, sums);
    sss_bem__release(&bem->hooks, sums);
    sss_bem__refit(bem);
    if (calibration != NULL)
    {
        memcpy(bem->shape, shape, sizeof shape);
        sss_bem__calibrate(bem, calibration);
        sss_bem__end_calibration(&bem->hooks, calibration);
        sss_bem__mark_all(bem);
    }
    bem->predicted_error = -1.0;
    return SSS_OK;
}

SSS_BEM_API sss_result sss_bem_set_profile(sss_bem *bem, const sss_profile *profile)
{
    sss_bem__calibration *calibration;
    size_t i;
    if (bem == NULL || profile == NULL || !sss_bem__valid_profile(profile))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (bem->generation == UINT32_MAX)
    {
        return SSS_ERROR_OVERFLOW;
    }
    calibration = sss_bem__begin_calibration(bem);
    if (calibration == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    bem->generation++;
    bem->profile = *profile;
    sss_bem__set_model(bem);
    sss_bem__mark_all(bem);
    for (i = 0; i < bem->row_count; i++)
    {
        sss_bem__bound_sources(bem, &bem->lanes[i], &bem->spheres[i]);
    }
    sss_bem__calibrate(bem, calibration);
    sss_bem__end_calibration(&bem->hooks, calibration);
    bem->predicted_error = -1.0;
    return SSS_OK;
}

// ---- running all rows ----

typedef struct sss_bem__job
{
    const sss_bem *bem;
    float *radiosity;
    size_t first;
    void (*row)(const sss_bem *b, size_t row, float *radiosity);
} sss_bem__job;

static void sss_bem__write_row(const sss_bem *b, size_t row, const sss_bem__sums *sums, float *radiosity)
{
    const sss_bem__row *r = &b->rows[row];
    uint32_t lane;
    for (lane = 0; lane < r->count; lane++)
    {
        sss_bem__scale_sums(b, sums, (int)lane, radiosity + 3 * (size_t)r->vertex[lane]);
    }
}

static void sss_bem__shade_row(const sss_bem *b, size_t row, float *radiosity)
{
    sss_bem__sums sums;
    sss_bem__gather_row(b, row, &sums);
    sss_bem__write_row(b, row, &sums, radiosity);
}

static void sss_bem__job_task(void *context, size_t begin, size_t end)
{
    const sss_bem__job *job = (const sss_bem__job *)context;
    size_t k;
    for (k = begin; k < end; k++)
    {
        job->row(job->bem, job->first + k, job->radiosity);
    }
}

// All rows. With hooks.progress in slabs, into a copy, so that a cancelled run leaves radiosity untouched.
static sss_result sss_bem__run_rows(const sss_bem *b, void (*row)(const sss_bem *b, size_t row, float *radiosity),
                                    float *radiosity)
{
    const size_t slab = b->hooks.progress != NULL ? b->row_count / 64 + 1 : b->row_count;
    sss_bem__job job;
    job.bem = b;
    job.row = row;
    job.radiosity = radiosity;
    if (b->hooks.progress != NULL)
    {
        job.radiosity = (float *)sss_bem__allocate(&b->hooks, b->vertex_count, 3 * sizeof(float));
        if (job.radiosity == NULL)
        {
            return SSS_ERROR_OUT_OF_MEMORY;
        }
    }
    for (job.first = 0; job.first < b->row_count; job.first += slab)
    {
        const size_t left = b->row_count - job.first;
        sss_bem__parallel(&b->hooks, left < slab ? left : slab, sss_bem__job_task, &job);
        if (b->hooks.progress != NULL
            && b->hooks.progress(b->hooks.user, (double)(left < slab ? b->row_count : job.first + slab)
                                                    / (double)b->row_count))
        {
            sss_bem__release(&b->hooks, job.radiosity);
            return SSS_ERROR_CANCELLED;
        }
    }
    if (job.radiosity != radiosity)
    {
        memcpy(radiosity, job.radiosity, 3 * b->vertex_count * sizeof *radiosity);
        sss_bem__release(&b->hooks, job.radiosity);
    }
    return SSS_OK;
}

// ---- the paper's own oracle: clusters gather, push, and vertices average, 3.2 and 5.2 ----
// Plain code, close to the paper, for comparison. A link joins a receiving cluster, which gathers at its midpoint, and
// an emitting one. Receivers are split into the chunks of the hierarchy and the nodes above them, each of which walks
// down from the link of the root with itself, so that the chunks are independent and their order does not matter.

// A stored link: factor times the mean irradiance of the emitter is what the receiver gathers.
typedef struct sss_bem__cluster_link
{
    uint32_t receiver, emitter;
    float factor[3];
} sss_bem__cluster_link;

typedef struct sss_bem__linking
{
    const sss_bem *bem;
    uint32_t low, high;             // receivers: a chunk's nodes, or those above all chunks where both are 0
    float (*gathered)[3];           // [node_count], or NULL
    sss_bem__cluster_link *links;   // or NULL
    size_t count;
    float small[3];                 // sizes over distance below which moments, 7 and 16 points do
    double single_area;             // what one sample stands for: pi times the square of the least mean free path
    sss_bem__lanes midpoint;        // of the receiver, in lane 0
    uint32_t midpoint_of;
} sss_bem__linking;

// Jensen and Buhler's measure of the solid angle under which faces appear.
static double sss_bem__solid_angle(const sss_bem__node *from, const sss_bem__node *of)
{
    double square = 0.0;
    int i;
    for (i = 0; i < 3; i++)
    {
        const double d = (double)of->center[i] - (double)from->center[i];
        square += d * d;
    }
    return square > 0.0 ? (double)of->area / square : HUGE_VAL;
}

// How much it varies over the receiver's children.
static double sss_bem__deviation(const sss_bem *b, uint32_t receiver, const sss_bem__node *emitter)
{
    double least = sss_bem__solid_angle(&b->nodes[receiver], emitter), most = least;
    uint32_t child;
    for (child = receiver + 1; child < b->nodes[receiver].end; child = b->nodes[child].end)
    {
        const double omega = sss_bem__solid_angle(&b->nodes[child], emitter);
        least = sss_bem__min(least, omega);
        most = sss_bem__max(most, omega);
    }
    return least < HUGE_VAL ? most - least : HUGE_VAL;
}

static void sss_bem__set_midpoint(sss_bem__linking *l, uint32_t receiver)
{
    double normal[3];
    float unit[3];
    int i;
    for (i = 0; i < 3; i++)
    {
        normal[i] = (double)l->bem->area_vector[receiver][i];
        l->midpoint.x[i][0] = l->bem->nodes[receiver].center[i];
    }
    sss_bem__normalize(normal, unit);
    for (i = 0; i < 3; i++)
    {
        l->midpoint.n[i][0] = unit[i];
    }
    l->midpoint_of = receiver;
}

// One sample at a point that stands for an area.
static void sss_bem__add_sample(const sss_bem__linking *l, const float point[3], float area, float factor[3])
{
    const sss_bem__model *m = &l->bem->model;
    float w[3], n[3], squares[2];
    int i, c;
    for (i = 0; i < 3; i++)
    {
        w[i] = point[i] - l->midpoint.x[i][0];
        n[i] = l->midpoint.n[i][0];
    }
    squares[0] = sss_bem__dotf(w, w);
    squares[1] = sss_bem__dotf(w, n);
    for (c = 0; c < 3; c++)
    {
        factor[c] += area * sss_bem__point_factor(m, c, squares);
    }
}

// Samples spread evenly over a triangle: the additive sequence of the plastic number, folded into it.
static void sss_bem__sample_triangle(const sss_bem__linking *l, const sss_bem__node *leaf, size_t count,
                                     float factor[3])
{
    const sss_bem__corners *corners = &l->bem->corners[leaf->triangle];
    size_t k;
    int i;
    for (k = 0; k < count; k++)
    {
        double u = 0.5 + 0.7548776662466927 * (double)k, v = 0.5 + 0.5698402909980532 * (double)k;
        float point[3];
        u -= floor(u);
        v -= floor(v);
        if (u + v > 1.0)
        {
            u = 1.0 - u;
            v = 1.0 - v;
        }
        for (i = 0; i < 3; i++)
        {
            point[i] = (float)((1.0 - u - v) * (double)corners->x[0][i] + u * (double)corners->x[1][i]
                               + v * (double)corners->x[2][i]);
        }
        sss_bem__add_sample(l, point, leaf->area / (float)count, factor);
    }
}

// Whether something of a size, its center as the receiver sees it, is smaller than a share of its distance from every
// source, and than four times that share of a mean free path.
static int sss_bem__is_small(const sss_bem__model *m, const float center[3], const float n[3], float size2, float share)
{
    const float squares[2] = {sss_bem__dotf(center, center), sss_bem__dotf(center, n)};
    int k, c;
    for (k = 0; k < 2; k++)
    {
        for (c = 0; c < 3; c++)
        {
            const float h = m->height[k][c], s2 = squares[0] + 2.0f * h * squares[1] + h * h;
            const float u2 = size2 * m->sigma[c] * m->sigma[c];
            if (m->scale[c] > 0.0f && (size2 > share * share * s2 || u2 > 16.0f * share * share))
            {
                return 0;
            }
        }
    }
    return 1;
}

static int sss_bem__is_small_triangle(const sss_bem__model *m, const float w[3][3], const float n[3], float share)
{
    float longest2 = 0.0f, center[3];
    int k, i;
    for (i = 0; i < 3; i++)
    {
        center[i] = (w[0][i] + w[1][i] + w[2][i]) * (1.0f / 3.0f);
    }
    for (k = 0; k < 3; k++)
    {
        const float *from = w[k], *to = w[(k + 1) % 3];
        const float e[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]}, length2 = sss_bem__dotf(e, e);
        longest2 = length2 > longest2 ? length2 : longest2;
    }
    return sss_bem__is_small(m, center, n, longest2, share);
}

// Moments leave an error of the fourth order in size over distance, 7 points of the sixth: they may be the larger, the
// coarser the links are. At 0.2, 0.6 and 1.2 the sum over all pairs is right to 1e-6.
static void sss_bem__choose_small(double epsilon_2, float small[3])
{
    small[0] = (float)sss_bem__max(0.2, sss_bem__min(0.5, 0.9 * sqrt(sqrt(epsilon_2))));
    small[1] = (float)sss_bem__max(0.6, sss_bem__min(1.0, 1.2 * pow(epsilon_2, 1.0 / 6.0)));
    small[2] = 2.0f * small[1];
}

// A triangle by points.
static void sss_bem__add_points(const sss_bem__model *m, const sss_bem__points_rule *rule, const float w[3][3],
                                const float n[3], float area, float factor[3])
{
    int q, i, c;
    for (q = 0; q < rule->count; q++)
    {
        const float *at = rule->point[q];
        float x[3], squares[2];
        for (i = 0; i < 3; i++)
        {
            x[i] = at[0] * w[0][i] + at[1] * w[1][i] + at[2] * w[2][i];
        }
        squares[0] = sss_bem__dotf(x, x);
        squares[1] = sss_bem__dotf(x, n);
        for (c = 0; c < 3; c++)
        {
            factor[c] += area * at[3] * sss_bem__point_factor(m, c, squares);
        }
    }
}

// The form factor of a triangle that is projected onto the plane of its cluster.
static void sss_bem__add_projected(const sss_bem__linking *l, const sss_bem__node *leaf, const float center[3],
                                   const float normal[3], float factor[3])
{
    const sss_bem__model *m = &l->bem->model;
    const sss_bem__corners *corners = &l->bem->corners[leaf->triangle];
    const float facing = sss_bem__dotf(corners->normal, normal) < 0.0f ? -1.0f : 1.0f;
    float w[3][3], n[3], up[3], parts[3];
    sss_bem__view view;
    int k, i, c, kind;
    for (k = 0; k < 3; k++)
    {
        float d[3];
        for (i = 0; i < 3; i++)
        {
            d[i] = corners->x[k][i] - center[i];
        }
        for (i = 0; i < 3; i++)
        {
            w[k][i] = corners->x[k][i] - sss_bem__dotf(d, normal) * normal[i] - l->midpoint.x[i][0];
        }
    }
    for (i = 0; i < 3; i++)
    {
        n[i] = l->midpoint.n[i][0];
        up[i] = facing * normal[i]; // a face that is turned over counts positive as well
    }
    if (sss_bem__is_small_triangle(m, (const float (*)[3])w, n, l->small[2]))
    {
        const int few = sss_bem__is_small_triangle(m, (const float (*)[3])w, n, l->small[1]);
        sss_bem__add_points(m, few ? &sss_bem__near_rule : &sss_bem__close_rule, (const float (*)[3])w, n,
                            leaf->area * fabsf(sss_bem__dotf(corners->normal, normal)), factor);
        return;
    }
    sss_bem__view_triangle((const float (*)[3])w, n, up, &view);
    for (c = 0; c < 3; c++)
    {
        for (kind = 0; kind < 2; kind++)
        {
            sss_bem__triangle_source(m, &m->rule[l->bem->options.epsilon_2 < 0.03], kind, c, &view, parts);
            factor[c] += m->scale[c] * (parts[0] + parts[1] + parts[2]);
        }
    }
}

// Whether a node's moments do.
static int sss_bem__moments_do(const sss_bem__linking *l, const sss_bem__node *node)
{
    float w[3][3], center[3], n[3];
    int k, i;
    for (i = 0; i < 3; i++)
    {
        n[i] = l->midpoint.n[i][0];
        center[i] = node->center[i] - l->midpoint.x[i][0];
    }
    if (node->triangle == UINT32_MAX)
    {
        return sss_bem__is_small(&l->bem->model, center, n, 4.0f * node->radius * node->radius, 0.8f);
    }
    for (i = 0; i < 3; i++)
    {
        for (k = 0; k < 3; k++)
        {
            w[k][i] = l->bem->corners[node->triangle].x[k][i] - l->midpoint.x[i][0];
        }
    }
    return sss_bem__is_small_triangle(&l->bem->model, (const float (*)[3])w, n, l->small[0]);
}

// F(A, x_o) of eq. 7 between the receiver's midpoint and a cluster: by the moments of its area where that is enough,
// else the form factors of its triangles in the cluster's plane, or as many samples as Jensen and Buhler take.
static void sss_bem__link_factor_of(sss_bem__linking *l, uint32_t emitter, int is_near, float factor[3])
{
    const sss_bem *b = l->bem;
    const sss_bem__node *e = &b->nodes[emitter];
    double mean[3];
    float normal[3];
    uint32_t i;
    int k;
    factor[0] = factor[1] = factor[2] = 0.0f;
    if (!is_near && b->options.point_sampling)
    {
        sss_bem__add_sample(l, e->center, e->area, factor);
        return;
    }
    if ((!is_near && e->triangle == UINT32_MAX) || (!b->options.point_sampling && sss_bem__moments_do(l, e)))
    {
        float squares[2], forms[4];
        sss_bem__cluster_forms(&l->midpoint, 0, e, squares, forms);
        for (k = 0; k < 3; k++)
        {
            float sums[3] = {0.0f, 0.0f, 0.0f};
            sss_bem__cluster_source(&b->model, 0, k, squares, forms, sums);
            sss_bem__cluster_source(&b->model, 1, k, squares, forms, sums);
            factor[k] = e->area * sums[0];
        }
        return;
    }
    for (k = 0; k < 3; k++)
    {
        mean[k] = (double)b->area_vector[emitter][k];
    }
    sss_bem__normalize(mean, normal);
    for (i = emitter; i < e->end; i++)
    {
        const sss_bem__node *leaf = &b->nodes[i];
        if (leaf->triangle == UINT32_MAX || !(leaf->area > 0.0f))
        {
            continue;
        }
        if (b->options.point_sampling)
        {
            const double samples = ceil((double)leaf->area / l->single_area);
            sss_bem__sample_triangle(l, leaf, (size_t)sss_bem__min(samples, 1e6), factor);
        }
        else
        {
            sss_bem__add_projected(l, leaf, e->center, normal, factor);
        }
    }
}

// Seen under less than this, a cluster is a point: h/s < 1/5, as eq. 19 asks of the edges.
#define SSS_BEM__POINT_SOLID_ANGLE 0.04

static void sss_bem__connect(sss_bem__linking *l, uint32_t receiver, uint32_t emitter, int is_near)
{
    const float *power = l->bem->lights[emitter].v;
    const float area = l->bem->nodes[emitter].area;
    float factor[3] = {0.0f, 0.0f, 0.0f};
    int c;
    if (l->gathered != NULL || l->links != NULL)
    {
        if (l->midpoint_of != receiver)
        {
            sss_bem__set_midpoint(l, receiver);
        }
        sss_bem__link_factor_of(l, emitter, is_near, factor);
    }
    for (c = 0; c < 3 && l->gathered != NULL; c++)
    {
        l->gathered[receiver][c] += area > 0.0f ? factor[c] * (power[c] / area) : 0.0f;
    }
    if (l->links != NULL)
    {
        l->links[l->count].receiver = receiver;
        l->links[l->count].emitter = emitter;
        memcpy(l->links[l->count].factor, factor, sizeof factor);
    }
    l->count++;
}

static int sss_bem__is_top(const sss_bem *b, uint32_t node)
{
    return b->nodes[node].end - node > SSS_BEM__CHUNK;
}

// Whether these receivers hold a node, or anything below it.
static int sss_bem__has_receiver(const sss_bem__linking *l, uint32_t node)
{
    return l->high > 0 ? node < l->high && l->bem->nodes[node].end > l->low : sss_bem__is_top(l->bem, node);
}

// Refines a candidate link where epsilon_1 asks for it at the receiver or epsilon_2 at the emitter, where both do at
// the larger one, and connects what is left.
static void sss_bem__refine(sss_bem__linking *l, uint32_t receiver, uint32_t emitter)
{
    const sss_bem *b = l->bem;
    const sss_bem__node *R = &b->nodes[receiver], *E = &b->nodes[emitter];
    const double omega = sss_bem__solid_angle(R, E);
    const int is_near = omega > SSS_BEM__POINT_SOLID_ANGLE && (double)E->area > l->single_area;
    const int open_E = E->end > emitter + 1
                       && (omega > b->options.epsilon_2
                           || (is_near && sss_bem__planarity(b, emitter) < b->options.planarity));
    const int open_R = R->end > receiver + 1 && sss_bem__deviation(b, receiver, E) > b->options.epsilon_1;
    uint32_t child;
    if (open_R && (!open_E || R->area > E->area))
    {
        for (child = receiver + 1; child < R->end; child = b->nodes[child].end)
        {
            if (sss_bem__has_receiver(l, child))
            {
                sss_bem__refine(l, child, emitter);
            }
        }
    }
    else if (open_E)
    {
        for (child = emitter + 1; child < E->end; child = b->nodes[child].end)
        {
            sss_bem__refine(l, receiver, child);
        }
    }
    else if (E->area > 0.0f && (l->high > 0 ? receiver >= l->low : 1)) // not an ancestor of the chunk
    {
        sss_bem__connect(l, receiver, emitter, is_near);
    }
}

// ---- all receivers ----

// The parts of the receivers: chunks, and last the nodes above them.
typedef struct sss_bem__sheets
{
    const sss_bem *bem;
    float (*gathered)[3];
    size_t *counts;                       // [parts], links; or NULL
    sss_bem__cluster_link *links;         // of all parts, or NULL
} sss_bem__sheets;

static size_t sss_bem__part_count(const sss_bem *b)
{
    return b->chunk_count + 1;
}

static void sss_bem__part_task(void *context, size_t begin, size_t end)
{
    const sss_bem__sheets *s = (const sss_bem__sheets *)context;
    size_t part;
    for (part = begin; part < end; part++)
    {
        sss_bem__linking l;
        double path = HUGE_VAL;
        int c;
        memset(&l, 0, sizeof l);
        for (c = 0; c < 3; c++)
        {
            path = s->bem->model.scale[c] > 0.0f ? sss_bem__min(path, (double)s->bem->model.z[0][c]) : path;
        }
        l.bem = s->bem;
        l.single_area = SSS_BEM__PI * path * path;
        sss_bem__choose_small(s->bem->options.epsilon_2, l.small);
        l.gathered = s->gathered;
        l.midpoint_of = UINT32_MAX;
        if (part < s->bem->chunk_count)
        {
            l.low = s->bem->chunks[part];
            l.high = s->bem->nodes[l.low].end;
        }
        if (s->links != NULL)
        {
            l.links = s->links + s->bem->part_first[part];
        }
        if (l.high > 0 || s->bem->top_count > 0)
        {
            sss_bem__refine(&l, 0, 0);
        }
        if (s->counts != NULL)
        {
            s->counts[part] = l.count;
        }
    }
}

// Pushes what clusters gathered down to the triangles and averages it at the vertices, by area.   sums [V][4]
static void sss_bem__push(const sss_bem *b, float (*gathered)[3], double (*sums)[4], float *radiosity)
{
    size_t i, child, v;
    int k, c;
    memset(sums, 0, b->vertex_count * sizeof *sums);
    for (i = 0; i < b->node_count; i++)
    {
        for (child = i + 1; child < b->nodes[i].end; child = b->nodes[child].end)
        {
            for (c = 0; c < 3; c++)
            {
                gathered[child][c] += gathered[i][c];
            }
        }
        for (k = 0; k < 3 && b->nodes[i].triangle != UINT32_MAX; k++)
        {
            double *sum = sums[b->triangle[3 * (size_t)b->nodes[i].triangle + (size_t)k]];
            for (c = 0; c < 3; c++)
            {
                sum[c] += (double)b->nodes[i].area * (double)gathered[i][c];
            }
            sum[3] += (double)b->nodes[i].area;
        }
    }
    for (v = 0; v < b->vertex_count; v++)
    {
        for (c = 0; c < 3; c++)
        {
            radiosity[3 * v + (size_t)c] =
                sums[v][3] > 0.0 ? (float)(sums[v][c] / sums[v][3] * b->irradiance_scale) : 0.0f;
        }
    }
}

// Gathers along stored links.
static void sss_bem__sweep_task(void *context, size_t begin, size_t end)
{
    const sss_bem__sheets *s = (const sss_bem__sheets *)context;
    size_t part, k;
    int c;
    for (part = begin; part < end; part++)
    {
        for (k = s->bem->part_first[part]; k < s->bem->part_first[part + 1]; k++)
        {
            const sss_bem__cluster_link *link = &s->bem->cluster_links[k];
            const float area = s->bem->nodes[link->emitter].area;
            for (c = 0; c < 3; c++)
            {
                s->gathered[link->receiver][c] +=
                    area > 0.0f ? link->factor[c] * (s->bem->lights[link->emitter].v[c] / area) : 0.0f;
            }
        }
    }
}

static sss_result sss_bem__shade_clusters(const sss_bem *b, int stored, float *radiosity)
{
    sss_bem__sheets sheets;
    double (*sums)[4] = (double (*)[4])sss_bem__allocate(&b->hooks, b->vertex_count, sizeof *sums);
    sss_result result = SSS_ERROR_OUT_OF_MEMORY;
    memset(&sheets, 0, sizeof sheets);
    sheets.bem = b;
    sheets.gathered = (float (*)[3])sss_bem__allocate(&b->hooks, b->node_count, sizeof *sheets.gathered);
    if (sums != NULL && sheets.gathered != NULL)
    {
        memset(sheets.gathered, 0, b->node_count * sizeof *sheets.gathered);
        sss_bem__parallel(&b->hooks, sss_bem__part_count(b),
                          stored && b->cluster_links != NULL ? sss_bem__sweep_task : sss_bem__part_task, &sheets);
        result = SSS_OK;
        if (b->hooks.progress != NULL && b->hooks.progress(b->hooks.user, 1.0))
        {
            result = SSS_ERROR_CANCELLED;
        }
        else
        {
            sss_bem__push(b, sheets.gathered, sums, radiosity);
        }
    }
    sss_bem__release(&b->hooks, sheets.gathered);
    sss_bem__release(&b->hooks, sums);
    return result;
}

// Links everything anew.
static sss_result sss_bem__link_clusters(sss_bem *b)
{
    const size_t parts = sss_bem__part_count(b);
    sss_bem__sheets sheets;
    sss_bem__cluster_link *links = NULL;
    size_t *first, part, total = 0;
    memset(&sheets, 0, sizeof sheets);
    sheets.bem = b;
    sheets.counts = (size_t *)sss_bem__allocate(&b->hooks, parts, sizeof *sheets.counts);
    first = (size_t *)sss_bem__allocate(&b->hooks, parts + 1, sizeof *first);
    if (sheets.counts != NULL && first != NULL)
    {
        sss_bem__parallel(&b->hooks, parts, sss_bem__part_task, &sheets);
        for (part = 0; part < parts; part++)
        {
            first[part] = total;
            total += sheets.counts[part];
        }
        first[parts] = total;
        links = (sss_bem__cluster_link *)sss_bem__allocate(&b->hooks, total, sizeof *links);
    }
    sss_bem__release(&b->hooks, sheets.counts);
    if (links == NULL)
    {
        sss_bem__release(&b->hooks, first);
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_bem_unlink(b);
    b->part_first = first;
    b->cluster_links = links;
    sheets.counts = NULL;
    sheets.links = links;
    sss_bem__parallel(&b->hooks, parts, sss_bem__part_task, &sheets);
    b->linked = b->generation;
    return SSS_OK;
}

SSS_BEM_API sss_result sss_bem_shade(const sss_bem *bem, float *radiosity)
{
    if (bem == NULL || radiosity == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    return bem->options.oracle == SSS_BEM_ORACLE_SOLID_ANGLE ? sss_bem__shade_clusters(bem, 0, radiosity)
                                                             : sss_bem__run_rows(bem, sss_bem__shade_row, radiosity);
}

SSS_BEM_API sss_result sss_bem_shade_rows(const sss_bem *bem, size_t begin, size_t end, float *radiosity)
{
    size_t row;
    if (bem == NULL || radiosity == NULL || begin > end || end > bem->row_count
        || bem->options.oracle != SSS_BEM_ORACLE_CONTRIBUTION)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (row = begin; row < end; row++)
    {
        sss_bem__shade_row(bem, row, radiosity);
    }
    return SSS_OK;
}

// ---- receivers anywhere ----

typedef struct sss_bem__points
{
    const sss_bem *bem;
    const float *positions, *normals;
    size_t count;
    float *radiosity;
} sss_bem__points;

static void sss_bem__points_task(void *context, size_t begin, size_t end)
{
    const sss_bem__points *p = (const sss_bem__points *)context;
    size_t group;
    int lane, i;
    for (group = begin; group < end; group++)
    {
        const size_t first = group * SSS_BEM__LANES, left = p->count - first;
        const size_t count = sss_bem__at_most(left, SSS_BEM__LANES);
        sss_bem__lanes lanes;
        sss_bem__spheres spheres;
        sss_bem__sums sums;
        for (lane = 0; lane < SSS_BEM__LANES; lane++)
        {
            const size_t k = first + ((size_t)lane < count ? (size_t)lane : count - 1);
            double n[3];
            float unit[3];
            for (i = 0; i < 3; i++)
            {
                n[i] = (double)p->normals[3 * k + (size_t)i];
                lanes.x[i][lane] =
                    (float)(((double)p->positions[3 * k + (size_t)i] - p->bem->center[i]) * p->bem->scale);
            }
            sss_bem__normalize(n, unit);
            for (i = 0; i < 3; i++)
            {
                lanes.n[i][lane] = unit[i];
            }
        }
        sss_bem__bound_sources(p->bem, &lanes, &spheres);
        sss_bem__gather(p->bem, &lanes, &spheres, count, &sums);
        for (lane = 0; (size_t)lane < count; lane++)
        {
            sss_bem__scale_sums(p->bem, &sums, lane, p->radiosity + 3 * (first + (size_t)lane));
        }
    }
}

SSS_BEM_API sss_result sss_bem_gather(const sss_bem *bem, const float *positions, const float *normals, size_t count,
                                      float *radiosity)
{
    sss_bem__points points;
    size_t k;
    if (bem == NULL || positions == NULL || normals == NULL || radiosity == NULL
        || count > SIZE_MAX / (3 * sizeof(float)) || bem->options.oracle != SSS_BEM_ORACLE_CONTRIBUTION
        || !sss_bem__all_finite(positions, 3 * count)
        || !sss_bem__all_finite(normals, 3 * count))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (k = 0; k < count; k++)
    {
        if (normals[3 * k] == 0.0f && normals[3 * k + 1] == 0.0f && normals[3 * k + 2] == 0.0f)
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
    }
    points.bem = bem;
    points.positions = positions;
    points.normals = normals;
    points.count = count;
    points.radiosity = radiosity;
    sss_bem__parallel(&bem->hooks, (count + SSS_BEM__LANES - 1) / SSS_BEM__LANES, sss_bem__points_task, &points);
    return SSS_OK;
}

// ---- stored links: render and incremental mode, 5.5 ----
// A row's data: of each kind the factors, one for a link and one for a block of pairs, and the links or pairs.

typedef struct sss_bem__stored
{
    uint32_t *factors[SSS_BEM__KINDS];
    sss_bem__link *links[SSS_BEM__KINDS];
} sss_bem__stored;

static size_t sss_bem__factor_count(int kind, size_t count)
{
    return kind < SSS_BEM__LINK_KINDS ? count : (count + SSS_BEM__LANES - 1) / SSS_BEM__LANES;
}

static size_t sss_bem__stored_bytes(const sss_bem *b, const size_t *counts)
{
    size_t bytes = 0;
    int kind;
    for (kind = 0; kind < SSS_BEM__KINDS; kind++)
    {
        bytes += sss_bem__factor_count(kind, counts[kind]) * b->model.factor_words * sizeof(uint32_t)
                 + counts[kind] * sizeof(sss_bem__link);
    }
    return bytes;
}

static sss_bem__stored sss_bem__open(const sss_bem *b, unsigned char *data, const size_t *counts)
{
    sss_bem__stored s;
    int kind;
    for (kind = 0; kind < SSS_BEM__KINDS; kind++)
    {
        s.factors[kind] = (uint32_t *)(void *)data;
        data += sss_bem__factor_count(kind, counts[kind]) * b->model.factor_words * sizeof *s.factors[kind];
        s.links[kind] = (sss_bem__link *)(void *)data;
        data += counts[kind] * sizeof *s.links[kind];
    }
    return s;
}

static void sss_bem__render_row(const sss_bem *b, size_t row, float *radiosity)
{
    const sss_bem__row *r = &b->rows[row];
    sss_bem__stored s;
    sss_bem__sums sums;
    size_t done;
    int kind;
    if (r->data == NULL)
    {
        sss_bem__shade_row(b, row, radiosity);
        return;
    }
    s = sss_bem__open(b, r->data, r->counts);
    memset(&sums, 0, sizeof sums);
    for (kind = 0; kind < SSS_BEM__LINK_KINDS; kind++)
    {
        sss_bem__add_links(b, &b->lanes[row], kind, s.links[kind], s.factors[kind],
                           r->counts[kind], &sums);
    }
    for (kind = SSS_BEM__LINK_KINDS; kind < SSS_BEM__KINDS; kind++)
    {
        for (done = 0; done < r->counts[kind]; done += SSS_BEM__LANES)
        {
            sss_bem__add_pairs(b, s.links[kind] + done,
                               s.factors[kind] + done / SSS_BEM__LANES * b->model.factor_words,
                               sss_bem__at_most(r->counts[kind] - done, SSS_BEM__LANES), sums.light[kind]);
        }
    }
    sss_bem__write_row(b, row, &sums, radiosity);
}

SSS_BEM_API sss_result sss_bem_render(const sss_bem *bem, float *radiosity)
{
    if (bem == NULL || radiosity == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    return bem->options.oracle == SSS_BEM_ORACLE_SOLID_ANGLE ? sss_bem__shade_clusters(bem, 1, radiosity)
                                                             : sss_bem__run_rows(bem, sss_bem__render_row, radiosity);
}

// A link or pair of a row to be, and where among the row's present ones its factor is; UINT32_MAX: to be computed.
typedef struct sss_bem__entry
{
    sss_bem__link link;
    uint32_t from;
} sss_bem__entry;

// The next links of a pending row, and what they cost.
typedef struct sss_bem__plan
{
    size_t row;
    size_t counts[SSS_BEM__KINDS];
    size_t work;              // factors to be computed
    sss_bem__entry *entries;  // the kinds one after the other, as far as there is room
    size_t room[SSS_BEM__KINDS], begin[SSS_BEM__KINDS], entry_count;
    int listed;               // there was room for all
    size_t cursor[SSS_BEM__KINDS]; // in the row's present lists, which ascend as the new ones do
    unsigned char *data;      // new, or NULL: in place
    int same;                 // the lists stay as they are
} sss_bem__plan;

static void sss_bem__append(sss_bem__plan *plan, int kind, sss_bem__link link, uint32_t from, size_t work)
{
    const size_t place = plan->counts[kind]++;
    plan->work += from == UINT32_MAX ? work : 0;
    if (place < plan->room[kind])
    {
        plan->entries[plan->begin[kind] + place].link = link;
        plan->entries[plan->begin[kind] + place].from = from;
    }
    plan->listed &= place < plan->room[kind];
}

// The present place of a link that the walk found, and whether its factor can be kept: neither its cluster nor its row
// changed since the row was brought up to date.
static void sss_bem__plan_link(const sss_bem *b, const sss_bem__stored *old, sss_bem__plan *plan, int kind,
                               sss_bem__link link)
{
    const sss_bem__row *r = &b->rows[plan->row];
    const sss_bem__link *links = r->data != NULL ? old->links[kind] : NULL;
    const size_t count = r->data != NULL ? r->counts[kind] : 0;
    const int is_pair = kind >= SSS_BEM__LINK_KINDS;
    size_t i = plan->cursor[kind];
    int matches;
    while (i < count && (links[i].node < link.node
                         || (is_pair && links[i].node == link.node && links[i].who < link.who)))
    {
        i++;
    }
    plan->cursor[kind] = i;
    matches = i < count && links[i].node == link.node && links[i].who == link.who;
    plan->same &= matches && i == plan->counts[kind];
    sss_bem__append(plan, kind, link,
                    matches && r->moved <= r->stamp && b->nodes[link.node].stamp <= r->stamp ? (uint32_t)i : UINT32_MAX,
                    is_pair ? 1 : r->count);
}

// What a row has of the nodes [begin, end), none of which changed, stays. 0: it has a link to a cluster above them.
static int sss_bem__plan_kept(const sss_bem *b, const sss_bem__stored *old, sss_bem__plan *plan, uint32_t begin,
                              uint32_t end)
{
    const sss_bem__row *r = &b->rows[plan->row];
    const sss_bem__link *far_links = old->links[SSS_BEM__FAR];
    size_t *cursor = &plan->cursor[SSS_BEM__FAR];
    int kind;
    while (*cursor < r->counts[SSS_BEM__FAR] && far_links[*cursor].node < begin)
    {
        ++*cursor;
    }
    if (*cursor > 0 && b->nodes[far_links[*cursor - 1].node].end > begin)
    {
        return 0;
    }
    for (kind = 0; kind < SSS_BEM__KINDS; kind++)
    {
        size_t i = plan->cursor[kind];
        while (i < r->counts[kind] && old->links[kind][i].node < begin)
        {
            i++;
        }
        for (; i < r->counts[kind] && old->links[kind][i].node < end; i++)
        {
            plan->same &= i == plan->counts[kind];
            sss_bem__append(plan, kind, old->links[kind][i], (uint32_t)i, 0);
        }
        plan->cursor[kind] = i;
    }
    return 1;
}

static void sss_bem__plan_row(const sss_bem *b, sss_bem__plan *plan)
{
    const sss_bem__row *r = &b->rows[plan->row];
    sss_bem__stored old;
    sss_bem__walk walk;
    size_t k;
    int more = 1, kind;
    plan->work = 0;
    plan->data = NULL;
    plan->same = r->data != NULL;
    plan->listed = 1;
    memset(plan->counts, 0, sizeof plan->counts);
    memset(plan->cursor, 0, sizeof plan->cursor);
    memset(&old, 0, sizeof old);
    sss_bem__start_walk(b, &b->lanes[plan->row], &b->spheres[plan->row], r->count, 0, &walk);
    if (r->data != NULL)
    {
        old = sss_bem__open(b, r->data, r->counts);
        walk.since = r->moved <= r->stamp ? r->stamp : 0;
    }
    while (more)
    {
        more = sss_bem__walk_on(&walk);
        for (kind = 0; kind < SSS_BEM__KINDS; kind++)
        {
            for (k = 0; k < walk.counts[kind]; k++)
            {
                sss_bem__plan_link(b, &old, plan, kind, walk.links[kind][k]);
            }
        }
        if (walk.kept != UINT32_MAX && !sss_bem__plan_kept(b, &old, plan, walk.kept, walk.next))
        {
            walk.not_before = walk.next;
            walk.next = walk.kept;
        }
        sss_bem__empty_walk(&walk);
    }
    plan->same &= memcmp(plan->counts, r->counts, sizeof plan->counts) == 0;
}

// Room for all entries of a plan, those that it could not hold included. 0: out of memory; the plan is then empty.
static int sss_bem__make_room(const sss_hooks *hooks, sss_bem__plan *plan)
{
    size_t count = 0;
    int kind;
    for (kind = 0; kind < SSS_BEM__KINDS; kind++)
    {
        plan->room[kind] = plan->counts[kind] + plan->counts[kind] / 4 + 64; // the next row needs about as much
        plan->begin[kind] = count;
        count += plan->room[kind];
    }
    if (count > plan->entry_count)
    {
        sss_bem__release(hooks, plan->entries);
        plan->entries = (sss_bem__entry *)sss_bem__allocate(hooks, count, sizeof *plan->entries);
        plan->entry_count = count;
    }
    if (plan->entries == NULL)
    {
        memset(plan->room, 0, sizeof plan->room);
        plan->entry_count = 0;
    }
    return plan->entries != NULL;
}

static void sss_bem__copy_place(const sss_bem__model *m, const uint32_t *from, size_t from_place, uint32_t *to,
                                size_t to_place)
{
    int c;
    for (c = 0; c < 3; c++)
    {
        float kab[3];
        sss_bem__get_factor(m->half_k, from, c, (int)from_place, kab);
        sss_bem__put_factor(m->half_k, to, c, (int)to_place, kab);
    }
}

// Computes the factors of the links or pairs `which` into their places.
static void sss_bem__fill_factors(const sss_bem *b, const sss_bem__lanes *lanes, int kind, sss_bem__stored *s,
                          const size_t *which, size_t count)
{
    sss_bem__link links[SSS_BEM__BATCH] = {{0, 0}};
    uint32_t factors[SSS_BEM__BATCH * SSS_BEM__FACTOR_WORDS];
    const size_t words = b->model.factor_words;
    size_t k;
    for (k = 0; k < count; k++)
    {
        links[k] = s->links[kind][which[k]];
    }
    if (kind < SSS_BEM__LINK_KINDS)
    {
        sss_bem__link_factors(b, lanes, kind, links, count, factors);
    }
    else
    {
        sss_bem__pair_factors(b, lanes, links, kind, count, factors);
    }
    for (k = 0; k < count; k++)
    {
        if (kind < SSS_BEM__LINK_KINDS)
        {
            memcpy(s->factors[kind] + which[k] * words, factors + k * words, words * sizeof *factors);
        }
        else
        {
            sss_bem__copy_place(&b->model, factors, k, s->factors[kind] + which[k] / SSS_BEM__LANES * words,
                                which[k] % SSS_BEM__LANES);
        }
    }
}

static void sss_bem__copy_factor(const sss_bem__model *m, int kind, const sss_bem__stored *from, size_t from_place,
                                 sss_bem__stored *to, size_t to_place)
{
    const size_t words = m->factor_words;
    if (kind < SSS_BEM__LINK_KINDS)
    {
        memcpy(to->factors[kind] + to_place * words, from->factors[kind] + from_place * words,
               words * sizeof *to->factors[kind]);
        return;
    }
    sss_bem__copy_place(m, from->factors[kind] + from_place / SSS_BEM__LANES * words, from_place % SSS_BEM__LANES,
                        to->factors[kind] + to_place / SSS_BEM__LANES * words, to_place % SSS_BEM__LANES);
}

// Brings a row up to date as planned: in place where its lists stay, else into its new data. Factors that cannot be
// kept wait until there are enough of them.
static void sss_bem__update_row(const sss_bem *b, const sss_bem__plan *plan)
{
    const sss_bem__row *r = &b->rows[plan->row];
    sss_bem__stored old, to = sss_bem__open(b, plan->same ? r->data : plan->data, plan->counts);
    size_t waiting[SSS_BEM__BATCH], wait, k;
    int kind;
    memset(&old, 0, sizeof old);
    if (r->data != NULL)
    {
        old = sss_bem__open(b, r->data, r->counts);
    }
    for (kind = 0; kind < SSS_BEM__KINDS; kind++)
    {
        const sss_bem__entry *entries = plan->entries + plan->begin[kind];
        const size_t most = kind < SSS_BEM__LINK_KINDS ? (size_t)SSS_BEM__BATCH : (size_t)SSS_BEM__LANES;
        wait = 0;
        for (k = 0; k < plan->counts[kind]; k++)
        {
            to.links[kind][k] = entries[k].link;
            if (entries[k].from == UINT32_MAX)
            {
                waiting[wait++] = k;
            }
            else if (!plan->same)
            {
                sss_bem__copy_factor(&b->model, kind, &old, entries[k].from, &to, k);
            }
            if (wait > 0 && (wait == most || k + 1 == plan->counts[kind]))
            {
                sss_bem__fill_factors(b, &b->lanes[plan->row], kind, &to, waiting, wait);
                wait = 0;
            }
        }
    }
}

// Rows are planned and updated so many at a time, so that a budget can end between.
enum
{
    SSS_BEM__ROWS_AT_ONCE = 128
};

typedef struct sss_bem__update
{
    sss_bem *bem;
    sss_bem__plan plans[SSS_BEM__ROWS_AT_ONCE];
    int again; // only those that had no room
} sss_bem__update;

static void sss_bem__plan_task(void *context, size_t begin, size_t end)
{
    sss_bem__update *u = (sss_bem__update *)context;
    size_t k;
    for (k = begin; k < end; k++)
    {
        if (!u->again || !u->plans[k].listed)
        {
            sss_bem__plan_row(u->bem, &u->plans[k]);
        }
    }
}

static void sss_bem__update_task(void *context, size_t begin, size_t end)
{
    sss_bem__update *u = (sss_bem__update *)context;
    size_t k;
    for (k = begin; k < end; k++)
    {
        sss_bem__update_row(u->bem, &u->plans[k]);
    }
}

// Plans so many rows, a second time where the first only showed how much room it takes. Returns for how many, from the
// first on, there was memory.
static size_t sss_bem__plan_rows(sss_bem__update *u, size_t count)
{
    size_t ready;
    u->again = 0;
    sss_bem__parallel(&u->bem->hooks, count, sss_bem__plan_task, u);
    for (ready = 0; ready < count; ready++)
    {
        if (!u->plans[ready].listed && !sss_bem__make_room(&u->bem->hooks, &u->plans[ready]))
        {
            break;
        }
    }
    u->again = 1;
    sss_bem__parallel(&u->bem->hooks, ready, sss_bem__plan_task, u);
    return ready;
}

// Memory for the planned rows whose lists change. Returns how many rows, from the first on, can go ahead.
static size_t sss_bem__allocate_rows(sss_bem__update *u, size_t count)
{
    size_t k;
    for (k = 0; k < count; k++)
    {
        sss_bem__plan *plan = &u->plans[k];
        if (!plan->same)
        {
            plan->data =
                (unsigned char *)sss_bem__allocate(&u->bem->hooks, sss_bem__stored_bytes(u->bem, plan->counts), 1);
            if (plan->data == NULL)
            {
                break;
            }
        }
    }
    return k;
}

static void sss_bem__finish_rows(sss_bem__update *u, size_t count)
{
    size_t k;
    for (k = 0; k < count; k++)
    {
        sss_bem__row *r = &u->bem->rows[u->plans[k].row];
        if (!u->plans[k].same)
        {
            sss_bem__release(&u->bem->hooks, r->data);
            r->data = u->plans[k].data;
            r->capacity = sss_bem__stored_bytes(u->bem, u->plans[k].counts);
            memcpy(r->counts, u->plans[k].counts, sizeof r->counts);
        }
        r->stamp = u->bem->generation;
    }
}

// Plans and updates pending rows of one kind, from the cursor on once around, until the budget is spent.
//   moved_only  those whose own vertices moved: they are the most wrong
static sss_result sss_bem__update_rows(sss_bem__update *u, int moved_only, size_t *budget)
{
    sss_bem *b = u->bem;
    size_t visited = 0;
    while (visited < b->row_count && *budget > 0)
    {
        size_t count = 0, planned, ready, affordable;
        for (; visited < b->row_count && count < SSS_BEM__ROWS_AT_ONCE; visited++)
        {
            const size_t row = (b->cursor + visited) % b->row_count;
            const sss_bem__row *r = &b->rows[row];
            if (r->stamp != b->generation && (!moved_only || r->moved > r->stamp))
            {
                u->plans[count++].row = row;
            }
        }
        planned = sss_bem__plan_rows(u, count);
        for (affordable = 0; affordable < planned && *budget > 0; affordable++)
        {
            const size_t work = u->plans[affordable].work + 1;
            *budget -= *budget < work ? *budget : work;
        }
        ready = sss_bem__allocate_rows(u, affordable);
        sss_bem__parallel(&b->hooks, ready, sss_bem__update_task, u);
        sss_bem__finish_rows(u, ready);
        if (ready < affordable || (planned < count && affordable == planned))
        {
            return SSS_ERROR_OUT_OF_MEMORY;
        }
        if (affordable < count)
        {
            b->cursor = u->plans[affordable].row; // the next call goes on here
        }
    }
    return SSS_OK;
}

static size_t sss_bem__pending(const sss_bem *b)
{
    size_t row, pending = 0;
    if (b->options.oracle == SSS_BEM_ORACLE_SOLID_ANGLE)
    {
        return b->linked == b->generation ? 0 : b->row_count;
    }
    for (row = 0; row < b->row_count; row++)
    {
        pending += b->rows[row].stamp != b->generation;
    }
    return pending;
}

SSS_BEM_API sss_result sss_bem_update(sss_bem *bem, size_t budget, size_t *pending)
{
    size_t left = budget == 0 ? SIZE_MAX : budget, k;
    sss_bem__update update;
    sss_result result;
    if (bem == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (bem->options.oracle == SSS_BEM_ORACLE_SOLID_ANGLE)
    {
        result = bem->linked == bem->generation ? SSS_OK : sss_bem__link_clusters(bem);
    }
    else
    {
        memset(&update, 0, sizeof update);
        update.bem = bem;
        result = sss_bem__update_rows(&update, 1, &left);
        result = result == SSS_OK ? sss_bem__update_rows(&update, 0, &left) : result;
        for (k = 0; k < SSS_BEM__ROWS_AT_ONCE; k++)
        {
            sss_bem__release(&bem->hooks, update.plans[k].entries);
        }
    }
    if (result == SSS_OK && pending != NULL)
    {
        *pending = sss_bem__pending(bem);
    }
    return result;
}

// ---- prediction of the error ----

// More than twice what was measured, because errors have long tails and a sample may miss the worst (on the chart's
// cases it showed 0.48 to 2.04 times the error of all vertices); and what floats and the strict run itself may add.
static double sss_bem__margin(double measured, double tolerance)
{
    return 2.25 * measured + 0.02 * tolerance;
}

// What is held against must be much nearer to the truth, also where errors lie far below a large tolerance.
#define SSS_BEM__STRICT 1e-3

enum
{
    SSS_BEM__PREDICTION_VERTICES = 4096 // a quarter of them showed a fifth of the error of all on a thin leaf
};

// The share of each vertex in the surface, a third of its triangles.   area [V]
static void sss_bem__vertex_areas(const sss_bem *b, float *area)
{
    size_t i;
    int k;
    memset(area, 0, b->vertex_count * sizeof *area);
    for (i = 0; i < b->node_count; i++)
    {
        const uint32_t t = b->nodes[i].triangle;
        for (k = 0; k < 3 && t != UINT32_MAX; k++)
        {
            area[b->triangle[3 * (size_t)t + (size_t)k]] += b->nodes[i].area / 3.0f;
        }
    }
}

SSS_BEM_API sss_result sss_bem_predict_error(sss_bem *bem, size_t count, double *error)
{
    sss_bem__trial trial;
    sss_bem *strict;
    sss_bem__stop *stops;
    float *area;
    int ready;
    if (bem == NULL || bem->options.oracle != SSS_BEM_ORACLE_CONTRIBUTION)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    strict = (sss_bem *)sss_bem__allocate(&bem->hooks, 1, sizeof *strict);
    stops = (sss_bem__stop *)sss_bem__allocate(&bem->hooks, bem->node_count, sizeof *stops);
    area = (float *)sss_bem__allocate(&bem->hooks, bem->vertex_count, sizeof *area);
    count = count == 0 ? (size_t)SSS_BEM__PREDICTION_VERTICES : count;
    ready = sss_bem__allocate_trial(&trial, bem, count) && strict != NULL && stops != NULL && area != NULL;
    if (ready)
    {
        sss_bem__vertex_areas(bem, area);
        trial.area = area;
        sss_bem__make_strict(bem, sss_bem__min(0.1 * bem->options.tolerance, SSS_BEM__STRICT), stops, strict);
        sss_bem__gather_trial(&trial, strict, 1);
        sss_bem__gather_trial(&trial, bem, 0);
        bem->predicted_error = sss_bem__margin(sss_bem__trial_error(&trial), bem->options.tolerance);
    }
    if (ready && error != NULL)
    {
        *error = bem->predicted_error;
    }
    sss_bem__release(&bem->hooks, area);
    sss_bem__release(&bem->hooks, stops);
    sss_bem__release(&bem->hooks, strict);
    sss_bem__release(&bem->hooks, trial.light[0]);
    return ready ? SSS_OK : SSS_ERROR_OUT_OF_MEMORY;
}

// ---- 4. Looking inside ----

// Positions are floats over the diagonal. Where a mean free path is not far above their steps, sources lie beside their
// places: measured by tests/stability, sweep size, as 5e-10 of the diagonal over the path and 0.24 at most; twice that.
#define SSS_BEM__SHORT_PATH 1e-9
#define SSS_BEM__SHORT_PATH_MOST 0.5

static double sss_bem__short_path_error(const sss_bem *bem)
{
    double worst = 0.0;
    int k;
    for (k = 0; k < 3; k++)
    {
        const double path = bem->profile.z_r[k] / bem->mm_per_unit * bem->scale; // over the diagonal
        if (bem->profile.alpha_p[k] > 0.0)
        {
            worst = sss_bem__max(worst, path > 0.0 ? SSS_BEM__SHORT_PATH / path : SSS_BEM__SHORT_PATH_MOST);
        }
    }
    return sss_bem__min(worst, SSS_BEM__SHORT_PATH_MOST);
}

SSS_BEM_API sss_result sss_bem_get_stats(const sss_bem *bem, sss_bem_stats *out)
{
    sss_bem__condition condition;
    size_t row;
    int kind;
    if (bem == NULL || out == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    memset(out, 0, sizeof *out);
    sss_bem__inspect(&bem->position[0][0], bem->own_normals ? NULL : &bem->normal[0][0], bem->triangle,
                     bem->triangle_count, &condition);
    sss_bem__tell_condition(&condition, bem->triangle_count, bem->mm_per_unit / bem->scale, &bem->profile, out);
    out->tolerance = bem->options.tolerance;
    out->guard = bem->options.guard;
    out->epsilon_1 = bem->options.epsilon_1;
    out->epsilon_2 = bem->options.epsilon_2;
    out->planarity = bem->options.planarity;
    out->predicted_error = bem->predicted_error >= 0.0 ? bem->predicted_error : bem->options.tolerance;
    out->predicted_error += sss_bem__short_path_error(bem);
    // An estimate of 1/s off by 2^-14 makes 3 times that of 1/s^3.
    out->path_tolerance = bem->options.path == SSS_BEM_PATH_PORTABLE ? 0.0 : bem->model.rough ? 2e-4 : 1e-5;
    out->oracle = bem->options.oracle;
    out->path = bem->options.path;
    out->triangle_count = bem->triangle_count;
    out->vertex_count = bem->vertex_count;
    out->cluster_count = bem->node_count;
    out->depth = bem->depth;
    out->row_count = bem->row_count;
    for (row = 0; row < bem->row_count; row++)
    {
        out->link_count += bem->rows[row].counts[SSS_BEM__FAR];
        out->near_count += bem->rows[row].counts[SSS_BEM__NEAR] * bem->rows[row].count;
        for (kind = SSS_BEM__LINK_KINDS; kind < SSS_BEM__KINDS; kind++)
        {
            out->near_count += bem->rows[row].counts[kind];
        }
        out->link_bytes += bem->rows[row].capacity;
    }
    if (bem->cluster_links != NULL)
    {
        out->link_count = bem->part_first[sss_bem__part_count(bem)];
        out->link_bytes = out->link_count * sizeof *bem->cluster_links;
    }
    out->pending_rows = sss_bem__pending(bem);
    out->bytes = bem->bytes + out->link_bytes;
    return SSS_OK;
}

SSS_BEM_API sss_result sss_bem_get_cluster(const sss_bem *bem, size_t index, sss_bem_cluster *out)
{
    const sss_bem__node *node;
    double vector[3], area;
    int i;
    if (bem == NULL || out == NULL || index >= bem->node_count)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    node = &bem->nodes[index];
    area = (double)node->area;
    out->planarity = sss_bem__planarity(bem, index);
    for (i = 0; i < 3; i++)
    {
        out->center[i] = (double)node->center[i] / bem->scale + bem->center[i];
        vector[i] = (double)bem->area_vector[index][i];
        out->irradiance[i] = area > 0.0 ? (double)bem->lights[index].v[i] / area * bem->irradiance_scale : 0.0;
    }
    for (i = 0; i < 3; i++)
    {
        const double length = sss_bem__length(vector);
        out->normal[i] = length > 0.0 ? vector[i] / length : 0.0;
    }
    out->radius = (double)node->radius / bem->scale;
    out->area = area / (bem->scale * bem->scale) * bem->mm_per_unit * bem->mm_per_unit;
    out->end = node->end;
    out->triangle = node->triangle == UINT32_MAX ? SIZE_MAX : node->triangle;
    return SSS_OK;
}

// One more cluster of a vertex's list.
static void sss_bem__list(size_t node, size_t *clusters, size_t capacity, size_t *count)
{
    if (clusters != NULL && *count < capacity)
    {
        clusters[*count] = node;
    }
    ++*count;
}

SSS_BEM_API sss_result sss_bem_get_links(const sss_bem *bem, size_t vertex, size_t *clusters, size_t capacity,
                                         size_t *count)
{
    sss_bem__walk walk;
    uint32_t row, lane = 0;
    size_t k;
    int more = 1, kind;
    if (bem == NULL || count == NULL || vertex >= bem->vertex_count
        || bem->options.oracle != SSS_BEM_ORACLE_CONTRIBUTION)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    row = bem->row_of_vertex[vertex];
    while (bem->rows[row].vertex[lane] != vertex)
    {
        lane++;
    }
    *count = 0;
    sss_bem__start_walk(bem, &bem->lanes[row], &bem->spheres[row], bem->rows[row].count, 0, &walk);
    while (more)
    {
        more = sss_bem__walk_on(&walk);
        for (kind = 0; kind < SSS_BEM__KINDS; kind++)
        {
            for (k = 0; k < walk.counts[kind]; k++)
            {
                const sss_bem__link *link = &walk.links[kind][k];
                if (kind < SSS_BEM__LINK_KINDS ? link->who >> lane & 1u : link->who == lane)
                {
                    sss_bem__list(link->node, clusters, capacity, count);
                }
            }
        }
        sss_bem__empty_walk(&walk);
    }
    return SSS_OK;
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
