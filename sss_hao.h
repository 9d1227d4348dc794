// sss_hao.h - v0.1.0 - real-time translucent meshes from precomputed integrals
//
// Implements X. Hao, A. Varshney: Real-Time Rendering of Translucent Meshes (ACM Transactions on Graphics 23(2), 2004).
// Licence: MIT-0 or public domain, at your choice; see the end. Needs libc and libm, nothing else.
//
// ============================================= QUICK START =============================================
//
//     #define SSS_HAO_IMPLEMENTATION // in one source file of the program
//     #include "sss_hao.h"
//     #include <stdio.h>
//     #include <string.h>
//
//     static const float x[18] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1}; // an octahedron
//     static const uint32_t triangles[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
//
//     int main(void)
//     {
//         sss_mesh mesh = {x, NULL, triangles, 6, 8, 5.0}; // 5 mm per unit
//         sss_profile marble = {{.9990, .9984, .9976}, {.11752, .17969, .25322}, {.45620, .38099, .33256},
//                               {2.0352, 1.6997, 1.4836}, 1.5, .59642, .09179};
//         sss_hao_light light;
//         sss_hao *hao;
//         float radiosity[18];
//         int i;
//         if (sss_hao_create(&mesh, &marble, NULL, NULL, &hao) != SSS_OK) return 1; // once per mesh and material
//         memset(&light, 0, sizeof light);
//         light.color[0] = light.color[1] = light.color[2] = 1.0; // W/mm^2
//         light.direction[2] = 1.0;                               // towards the light
//         if (sss_hao_relight(hao, &light, 1, radiosity) != SSS_OK) return 1; // each frame
//         for (i = 0; i < 6; i++) printf("%g %g %g\n", radiosity[3*i], radiosity[3*i + 1], radiosity[3*i + 2]);
//         sss_hao_free(hao);
//         return 0;
//     }
//
// ================================================ THEORY ===============================================
//
//   S_d(x_i, w_i; x_o, w_o) = 1/pi F_t(eta, w_i) R_d(|x_i - x_o|) F_t(eta, w_o)                     (section 2.2)
//   q(x_o, w_i)   = sum over x_i in N(x_o) of F_t(eta, w_i) 1/pi R_d L_i (n_i . w_i) mu_i dA(x_i)     (section 3.1)
//   L_o(x_o, w_o) = q(x_o, w_i) F_t(eta, w_o)
//
// For a light of one unit, B(x_o, w_j) = pi q(x_o, w_j) is computed once for some 200 directions w_j of light, and
// interpolated afterwards: nothing but one pass over the vertices is left to be done for a new light, whatever the mean
// free path. Mesh and material are rigid. As neighbours radiate much alike, few vertices, the reference points, keep
// their integrals in full, a byte each; the others keep by how much they differ from the mean of the three reference
// points around them, as nine coefficients of a byte (section 4.2).
//
//     symbol        name in code          unit       meaning
//     N             vertex_count (V)      -          vertices
//     w_j           set.direction         -          quantised directions towards the light
//     q_j           rows, q               W/mm^2     here B = pi q for 1 W/mm^2 on a plane facing the light
//     Q_j           SSS_HAO_VECTORS       W/mm^2     the same with n_i in place of (n_i . w_i)
//     mu_i          E                     -          1 where x_i faces the light and no triangle is between
//     F_t mu        sss_hao__entering     -          Fresnel transmittance, unpolarised, times the cosine
//     R_d(r)        sss_hao__R_d          1/mm^2     dipole profile, r = |x_i - x_o|: distance only
//     RANGE         range                 mm         radius of the neighbourhood N(x_o)
//     dA            area                  mm^2       a third of the vertex's triangles
//     n             order                 -          bands of the harmonics, n^2 coefficients
//     q_l^m         harmonic, residual    -          coefficients
//     w_1, w_2      weight                -          barycentric weights of reference points
//     dq_j          residual              -          q_j - sum w_k q_kj
//
// Deviations, each with its reason:
//   * The pseudo-code leaves out x_i = x_o, and takes vertices as samples. That loses the light that leaves where it
//     entered: most of it where edges are longer than a mean free path. Here triangles are integrated, with irradiance
//     linear over them (SSS_HAO_TRIANGLES); the paper's two sums are there to compare (SSS_HAO_OTHER_VERTICES).
//   * Shadows come from a depth map whose samples are the vertices themselves (Johnson et al. 2005, Aila and Laine
//     2004): it has no resolution, and needs no bias.
//   * Directions are the corners of an octahedron's faces divided evenly, so that weights are continuous as the light
//     moves, over poles and edges too. Of the four nearest, the corners of a cell, three carry weight by default: the
//     triangle around the light has a quarter less error without shadows than both ways linearly, and the same with
//     (SSS_HAO_FOUR_NEAREST). The paper does not say which set it took.
//   * Coefficients are fitted by weighted least squares, whose limit for many directions is the paper's projection, and
//     to what the decoded reference points leave over, so that a byte's rounding there is made up for.
//   * Vertices hang on the triangle of reference points, of those around, that leaves least to the harmonics, with
//     weights fitted to that end, which the paper proposes as future work: a fifth to a third less error for the same
//     bytes. SSS_HAO_BARYCENTRIC is the paper's.
//   * q carries no 1/pi: radiosity is what all headers of the family give.
//   * The paper counts no indices of reference triangles: they are two bytes a vertex, counted here.
//
// ================================================ LIMITS ===============================================
//
//   * Hard shadows move from direction to direction, by 14 degrees in a set of 198, and what is interpolated between is
//     several shadows for one. With the default options B is off by 2.8, 4.5 and 6.0 % (relative L2; bunny in marble of
//     20, 50 and 100 mm; horse 2.6, 4.1, 5.5 %), without shadows by 1.4, 1.9 and 2.3 %, with shadows and 1,026
//     directions by 1.3, 2.5 and 3.5 %, most of which is storage then. stats.interpolation_error is measured where it
//     is worst, midway between directions, for the object at hand (tests/chart/hao: bars.csv, figure 5).
//   * Reference points keep what varies less from one to the next than over the sphere of directions. Sharp shadows, or
//     features smaller than their spacing, exceed nine coefficients: 1.2 to 4 % of B with the default number, half with
//     twice to three times as many (figure 9). stats.storage_error is that of all vertices and directions.
//   * Harmonics alone ring at shadows: at order 7 B is off by 4 % to 6.5 % (bunny, horse of 50 mm); it is never
//     negative.
//   * Distance alone decides (R_d of |x_i - x_o|): light crosses thin gaps and concave corners as if they were filled.
//     sss_bem.h has sources placed along the normal.
//   * Irradiance is linear between vertices: shadow edges are as sharp as the mesh is fine.
//   * A mesh of more parts than reference points keeps one for each part, and the largest part no more.
//   * Point lights at several distances share one table of 256 levels, where the nearest distance, brightest on the
//     near side, takes most of them: 1.5 % of B between distances 120 and 16 mm (tests/test_hao.c).
//   * options.range below the size of the triangles nearby reaches as far as these do.
//   * Slivers a ten-thousandth as wide as long, in a medium whose mean free path lies between, cost 10 ms a vertex.
//   * stats.predicted_error is a mean over lights, not a bound: single lights exceed it, most of all where they graze.
// ---- BEGIN measured by make stability (tests/stability/README.md says what the errors are; in brackets: sweep) ----
//   * 10 % beside diffusion in a slab: lit face, alpha' 0.9: thickness no limit from 2 to 8 mean free paths; worst 5 %
//     (slab front 0.9)
//   * 10 % beside diffusion in a slab: lit face, alpha' 0.99: thickness below 4.9 mean free paths; worst 39 % (slab
//     front 0.99)
//   * 10 % beside diffusion in a slab: dark face, alpha' 0.9: thickness at any value to 8 mean free paths; worst 80 %
//     (slab back 0.9)
//   * 10 % beside diffusion in a slab: dark face, alpha' 0.99: thickness at any value to 8 mean free paths; worst 55 %
//     (slab back 0.99)
//   * 10 % model error: references, sphere without absorption: radius below 14 mean free paths; worst 84 % (sphere)
//   * 10 % model error: references, light across air: gap below 4.9 mean free paths; worst 100 % (fingers)
//   * 10 % input error: references, shadow edge on a coarse mesh: mean edge above 2 mean free paths; worst 90 %
//     (coarse)
//   * 10 % input error: references, displaced vertices: amplitude above 0.39 mean edges; worst 31 % (noise)
//   * 10 % input error: references, triangles missing: share above 0.096; worst 52 % (holes)
//   * 10 % input error: references, triangles turned over: share above 0.22; worst 96 % (windings)
//   * 10 % input error: references, vertex normals turned over: share above 0.084; worst 96 % (normals)
//   * references, slivers: aspect no limit from 1 to 1.0e+05; error at most 0.97 %, 0.33 times what is promised
//     (slivers)
//   * references, grazing light: elevation below 39 degrees; error at most 4.1 %, 2.4 times what is promised (grazing)
//   * harmonics, grazing light: elevation below 13 degrees; error at most 4.9 %, 2.8 times what is promised (grazing)
//   * references, sphere: radius above 16 mean free paths; error at most 3.2 %, 1.1 times what is promised (size)
//   * references, balls beside a plate, references 3 mm apart: radius below 1.8 mm; error at most 1.9 % (small parts)
//   * references, vertices pushed in and out: amplitude above 0.3 of the radius; error at most 14 % (rough surfaces)
//   * references, vertices of a faceted sphere without visible scattering, against Lambert: up to 0.88 % (size)
//   * references, steps of B as a light turns by half degrees no limit; worst +9.1 % (turning)
// ---- END measured by make stability ----

#ifndef SSS_HAO_H
#define SSS_HAO_H

#define SSS_HAO_VERSION 100 // 10000 major + 100 minor + patch

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
// SSS_HAO_IMPLEMENTATION  define in exactly one source file before including: the code
// SSS_HAO_STATIC          makes every function static: a private copy in that source file
// SSS_HAO_NO_SIMD         compiles no AVX2/AVX-512 path (the portable paths give the same within tolerance)

#if defined(SSS_HAO_STATIC)
#if defined(__GNUC__)
#define SSS_HAO_API static __attribute__((unused))
#else
#define SSS_HAO_API static
#endif
#else
#define SSS_HAO_API extern
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ================================================= API =================================================
// Unless said otherwise a function never allocates, keeps no pointer and may run concurrently; arrays are
// the caller's and must not overlap; RGB is interleaved and linear.

// ---- 1. Precomputation ----

// How the integrals are kept.
typedef enum sss_hao_storage
{
    SSS_HAO_REFERENCES = 0, // reference points in full, the rest of the vertices as their difference in SH (4.2)
    SSS_HAO_HARMONICS,      // spherical harmonics alone, 16 bits a coefficient (4.1)
    SSS_HAO_TABLE,          // a byte for each direction into a Lloyd-Max table (4)
    SSS_HAO_FLOAT,          // scalars q, a float for each direction (3.1)
    SSS_HAO_VECTORS         // vectors Q, three floats for each direction (3.1): far slower, and no better than scalars
} sss_hao_storage;

// What is summed for one q.
typedef enum sss_hao_quadrature
{
    SSS_HAO_TRIANGLES = 0,  // irradiance linear over triangles, which are integrated adaptively where they are near
    SSS_HAO_VERTICES,       // one sample a vertex, of a third of its triangles' area; its own area as a disk around it
    SSS_HAO_OTHER_VERTICES  // the same without its own area: the paper's pseudo-code
} sss_hao_quadrature;

typedef enum sss_hao_sums
{
    SSS_HAO_HIERARCHY = 0, // far parts of the mesh as clusters
    SSS_HAO_ALL_PAIRS      // every pair, O(V^2), as blocked products
} sss_hao_sums;

// How a light is shared among those of the set. Both are continuous as it moves, and exact at lights of the set.
typedef enum sss_hao_interpolation
{
    SSS_HAO_THREE_NEAREST = 0, // linear over the triangle of directions around it: a quarter less error where there are
                               // no shadows, else the same
    SSS_HAO_FOUR_NEAREST       // the paper's: linear both ways over the lattice's cell around it; in one's own set
                               // as with three
} sss_hao_interpolation;

// How vertices hang on reference points (4.2).
typedef enum sss_hao_weights
{
    SSS_HAO_FITTED = 0,    // weights in the triangle of references that leave the harmonics the least to do
    SSS_HAO_BARYCENTRIC    // the paper's: of the projection on the triangle
} sss_hao_weights;

// The share of a light that vertices see, where the caller knows better than the mesh alone tells.
//   light    [3] towards the light, unit length (distance = INFINITY), or its position in the mesh's units
//   distance mm from the mesh's center, INFINITY: directional
//   visible  [V] to be filled, in [0, 1]
// Called from the thread that creates, once for each light of the set, then for 16 directions between them (for
// stats.interpolation_error). Nonzero cancels.
typedef int (*sss_hao_visibility)(void *user, const double light[3], double distance, float *visible);

typedef struct sss_hao_options
{
    double tolerance;            // relative L2 error of the sums, in [1e-5, 0.1]; 0: 5e-3
    double range;                // mm, beyond which surface is left out (the paper's RANGE); 0: follows from tolerance;
                                 // INFINITY: nothing is. Infinite by itself where a channel has sigma_tr = 0
    size_t directions;           // of light, 0: 198. The lattice has k k + 2 of them with an even k: the nearest of 6,
                                 // 18, 38, 66, 102, 146, 198, 258, 326, 402 ... 4,098 is taken
    const float *direction_set;  // [directions][3] a set of one's own, at least 4 and not all in one plane through the
                                 // origin, any length > 0; NULL: the lattice
    sss_hao_interpolation interpolation; // 0: three nearest
    const double *distances;     // [distance_count] of point lights from the mesh's center, mm, falling, all beyond the
                                 // mesh's bounding sphere (3.3); NULL: directional lights only
    size_t distance_count;       // at most 64
    size_t channels;             // 3: RGB, 1: one channel of the profile; 0: 3
    size_t channel;              // which one, where there is one
    sss_hao_storage storage;     // 0: reference points
    sss_hao_quadrature quadrature; // 0: triangles
    sss_hao_sums sums;           // 0: hierarchy
    sss_hao_weights weights;     // 0: fitted
    size_t reference_count;      // 0: 1.22 V^0.683 (850 on the horse, 8,700 on the dragon), at least 850, at most V
    size_t order;                // n of the harmonics, n^2 coefficients, in [1, 8]; 0: 3 with reference points, 7 alone
    int no_shadows;              // 1: every vertex sees every light that it faces
    sss_hao_visibility visibility; // instead of the header's own shadows; NULL: these
    void *visibility_user;
} sss_hao_options;

typedef struct sss_hao_stats
{
    double tolerance, range;       // as resolved
    size_t directions, distance_count, channels, channel, reference_count, order; // as resolved; 0 where not used
    sss_hao_storage storage;
    sss_hao_quadrature quadrature;
    sss_hao_sums sums;
    sss_hao_interpolation interpolation;
    sss_hao_weights weights;
    size_t vertex_count, triangle_count;
    int inside_out;                // 1: triangles enclose a negative volume: they look inwards, and nearly all is dark
    size_t reference_triangle_count;
    size_t lighting_count;         // entries of a lighting: three floats each
    double center[3];              // of the mesh's box, mesh units: what distances are measured from
    double bounding_radius;        // of the mesh around it, mm
    double truncated_energy;       // share of B beyond range under even light: mean of sampled vertices, worst channel
    double truncated_worst;        // the largest of them
    double sum_error;              // relative L2 of the sums, measured at sampled vertices against converged ones, for
                                   // lights of the set
    double interpolation_error;    // relative L2 of interpolating between directions of the set, measured at sampled
                                   // vertices, for lights midway
    double storage_error;          // relative L2 of what is stored against the sums, of all vertices and lights of the
                                   // set
    double predicted_error;        // of B for one directional light: root of the sum of their squares
    double snr_db;                 // of the 8-bit table, 10 log10(sum q^2/sum error^2); 0: none
    double mean_interactions;      // clusters and triangles summed for one vertex
    size_t bytes_vertices;         // held for all vertices: weights, residuals, indices of reference triangles; or the
                                   // integrals
    size_t bytes_references;       // held for reference points and their triangles
    size_t bytes_tables;           // tables, scales, the directions
    size_t bytes;                  // held in all, also what relighting needs
    size_t peak_bytes;             // taken while precomputing
    double bytes_per_vertex;       // (vertices + references + tables)/V: what saving writes, but for a short header
    // What the mesh is like, and what that does to the result: LIMITS.
    double edge_paths;             // mean edge in mean free paths 1/sigma_t', of the channel where these are shortest:
                                   // above 1 the light is no longer linear between vertices
    double longest_edge_paths;     // the longest edge, the same way
    double border_mm;              // edges without a partner that runs the other way, at least: holes, triangles turned
                                   // over, T-junctions. 0: closed
    double normals_against;        // share of the area at whose corners given normals look away from their triangles
} sss_hao_stats;

typedef struct sss_hao sss_hao; // opaque

// Precomputes q(x_o, w_j) of every vertex for every light of the set, and keeps it as options.storage says.
//   mesh            normals may be NULL: means of the triangles' normals weighted by angle. Vertices without a triangle
//                   get no light
//   options, hooks  may be NULL: defaults
//   out             freed with sss_hao_free; keeps no pointer to mesh, profile or options
// Bit-identical for any number of threads. Allocates. SSS_ERROR_INVALID_ARGUMENT, _EMPTY, _INDEX, _OVERFLOW,
// _OUT_OF_MEMORY, _CANCELLED.
SSS_HAO_API sss_result sss_hao_create(const sss_mesh *mesh, const sss_profile *profile,
                                      const sss_hao_options *options, const sss_hooks *hooks, sss_hao **out);

// The same integrals kept in another way, without computing them again.
//   from     made with SSS_HAO_FLOAT, of the same mesh
//   options  storage, reference_count and order are read; the rest is from's
// Allocates. SSS_ERROR_INVALID_ARGUMENT: also where `from` has another storage, or options ask for vectors; _MISMATCH:
// another mesh; _OUT_OF_MEMORY, _CANCELLED.
SSS_HAO_API sss_result sss_hao_compress(const sss_hao *from, const sss_mesh *mesh, const sss_hao_options *options,
                                        const sss_hooks *hooks, sss_hao **out);

// Frees an object; NULL is allowed.
SSS_HAO_API void sss_hao_free(sss_hao *hao);

// What was chosen, and what it costs. SSS_ERROR_INVALID_ARGUMENT: null.
SSS_HAO_API sss_result sss_hao_get_stats(const sss_hao *hao, sss_hao_stats *out);

// The set of lights.
//   directions    [directions][3] unit length;   solid_angles  [directions] of the share of the sphere that each stands
//                 for, sr: they sum to 4 pi. Either may be NULL
// SSS_ERROR_INVALID_ARGUMENT: null object.
SSS_HAO_API sss_result sss_hao_get_directions(const sss_hao *hao, float *directions, float *solid_angles);

// The reference points and how vertices hang on them (4.2), for pictures and tests.
//   references  [reference_count] vertices;   corners  [reference_triangle_count][3] indices of references
//   triangle    [V] of a vertex;   weights  [V][3] barycentric, sum 1, in [0, 1]. Any may be NULL
// SSS_ERROR_INVALID_ARGUMENT: null object, or another storage.
SSS_HAO_API sss_result sss_hao_get_references(const sss_hao *hao, uint32_t *references, uint32_t *corners,
                                              uint32_t *triangle, float *weights);

// ---- 2. Lights ----

typedef enum sss_hao_light_kind
{
    SSS_HAO_LIGHT_DIRECTIONAL = 0,
    SSS_HAO_LIGHT_POINT
} sss_hao_light_kind;

typedef struct sss_hao_light
{
    double color[3];     // directional: W/mm^2 on a plane facing it; point: W/sr; >= 0, at most 1e30
    double direction[3]; // directional: towards the light, any length > 0
    double position[3];  // point: in the mesh's units; needs an object with distances
    sss_hao_light_kind kind; // 0: directional
} sss_hao_light;

// A lighting is how much of each light of the set there is, and its harmonics where these are stored:
// [stats.lighting_count][3] floats, for one object, or others with the same directions, distances, storage and order.
// Any number of lights amounts to one; zeroed it is darkness, and lightings may be added and scaled. Relighting costs
// the same for all.

// Adds lights. The texels of an environment map are directional lights, of their radiance times their solid angle.
// A direction is shared among the three or four nearest of the set (3.2), a point light among these at the two nearest
// distances, linear in 1/distance (3.3).
//   lights  [count];   lighting  [lighting_count][3], added to
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite, negative; a point light nearer than the nearest distance, or without
// distances. Nothing is added then.
SSS_HAO_API sss_result sss_hao_add_lights(const sss_hao *hao, const sss_hao_light *lights, size_t count,
                                          float *lighting);

// Adds a surrounding: radiance in real orthonormal SH, order (0,0) (1,-1) (1,0) (1,1) (2,-2) ..., without the sign of
// Condon and Shortley, Y_1 = .488603 (y, z, x). Where the nine coefficients are negative they count so.
//   sh  [9][3] W/mm^2/sr
// SSS_ERROR_INVALID_ARGUMENT.
SSS_HAO_API sss_result sss_hao_add_environment(const sss_hao *hao, const double sh[9][3], float *lighting);

// ---- 3. Relighting: B at every vertex, O(V) ----

// All of it: for examples, and where one light after the other is enough.
//   lights     [count];   radiosity  [V][channels], W/mm^2, >= 0. Outgoing radiance is F_t(w_o)/pi B
// Runs through hooks.parallel_for. Not concurrent with other calls on the same object. Errors as sss_hao_add_lights.
SSS_HAO_API sss_result sss_hao_relight(sss_hao *hao, const sss_hao_light *lights, size_t count, float *radiosity);

// The same for a lighting, as of an environment.   lighting  [lighting_count][3], finite
// SSS_ERROR_INVALID_ARGUMENT.
SSS_HAO_API sss_result sss_hao_relight_lighting(sss_hao *hao, const float *lighting, float *radiosity);

// The same in its two steps, which may run concurrently. First what reference points radiate: O(references).
//   lighting    [lighting_count][3], finite
//   references  [reference_count][4] filled: RGB and 0; as a texture for the GPU, too. NULL for other storages
// SSS_ERROR_INVALID_ARGUMENT.
SSS_HAO_API sss_result sss_hao_relight_references(const sss_hao *hao, const float *lighting, float *references);

// Then rows [begin, end) in one pass over what is stored: a pure function, bit-identical however the rows are split.
// Vectors Q interpolate by quaternions (3.2), for which a lighting says too little: they take it as scalars do, the dot
// product with each w_j first; sss_hao_relight takes one directional light after the other.
//   radiosity  [V][channels]: only rows begin .. end - 1 are written
// SSS_ERROR_INVALID_ARGUMENT.
SSS_HAO_API sss_result sss_hao_relight_rows(const sss_hao *hao, const float *lighting, const float *references,
                                            size_t begin, size_t end, float *radiosity);

// ---- 4. Keeping it ----

// Names what an object is made from, as a key for a cache: mesh, profile and options (visibility: only that there is
// one). SSS_ERROR_INVALID_ARGUMENT, _EMPTY, _INDEX, _OVERFLOW.
SSS_HAO_API sss_result sss_hao_hash(const sss_mesh *mesh, const sss_profile *profile, const sss_hao_options *options,
                                    uint64_t *out);

// Writes all of it. write  gets bytes in order; nonzero stops with SSS_ERROR_CANCELLED.
typedef int (*sss_hao_write)(void *user, const void *bytes, size_t count);
SSS_HAO_API sss_result sss_hao_save(const sss_hao *hao, sss_hao_write write, void *user);

// Reads it back for the same mesh, profile and options. Safe on any bytes.
//   hash  of sss_hao_hash
//   read  fills count bytes; nonzero: there are no more
// Allocates. SSS_ERROR_BAD_DATA, _BAD_VERSION, _MISMATCH (made from something else), _INVALID_ARGUMENT, _OUT_OF_MEMORY.
typedef int (*sss_hao_read)(void *user, void *bytes, size_t count);
SSS_HAO_API sss_result sss_hao_load(uint64_t hash, sss_hao_read read, void *user, const sss_hooks *hooks,
                                    sss_hao **out);

// ---- 5. GPU ----

// What a vertex shader needs of an object with reference points, as 32-bit words for a texture of format R32UI,
// SSS_HAO_TEXTURE_WIDTH texels wide; how they are laid out stands beside the GLSL.
//   words  [height][SSS_HAO_TEXTURE_WIDTH]; NULL: only height is returned
// SSS_ERROR_INVALID_ARGUMENT: null, another storage, or an object with distances; _OVERFLOW: more than 2^31 words.
#define SSS_HAO_TEXTURE_WIDTH 2048
SSS_HAO_API sss_result sss_hao_get_texture(const sss_hao *hao, uint32_t *words, size_t *height);

// The uniforms that go with it.
typedef struct sss_hao_uniforms
{
    int layout[4];           // sss_hao_layout
    float harmonics[64][4];  // sss_hao_harmonics: of a lighting, times the residuals' scales; the first `order` squared
    float bias[4];           // sss_hao_bias
} sss_hao_uniforms;

// lighting  [lighting_count][3]. SSS_ERROR_INVALID_ARGUMENT: null, another storage, or an object with distances.
SSS_HAO_API sss_result sss_hao_get_uniforms(const sss_hao *hao, const float *lighting, sss_hao_uniforms *out);

typedef enum sss_hao_glsl_piece
{
    SSS_HAO_GLSL_RADIOSITY = 0 // vec3 sss_hao_radiosity(int vertex): for gl_VertexID
} sss_hao_glsl_piece;

// NULL for an unknown piece; static storage; under 4,095 characters.
SSS_HAO_API const char *sss_hao_glsl(sss_hao_glsl_piece piece);

#ifdef __cplusplus
}
#endif

// ================================================ GLSL =================================================
// The shader piece, as readable source, with its own include guard; it has no #version line.
//
//   sss_hao_texture     words of sss_hao_get_texture: GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nearest, no mipmaps
//   sss_hao_references  [reference_count] texels of sss_hao_relight_references in rows of SSS_HAO_TEXTURE_WIDTH, the
//                       last one filled up: GL_RGBA32F, nearest, no mipmaps; anew for each lighting
//   the others          sss_hao_get_uniforms; anew for each lighting
//
// Words, word i at texel (i % SSS_HAO_TEXTURE_WIDTH, i / SSS_HAO_TEXTURE_WIDTH):
//   a record for each vertex, sss_hao_layout.x words:
//       0      barycentric weights of its first two reference points, 65,535 is 1: the first in the lower 16 bits;
//              more than 1 together: it gets no light
//       1      its reference triangle
//       2 ...  residuals: byte k = term * channels + channel is bits 8 (k % 4) ... of word 2 + k / 4
//   from word sss_hao_layout.y on three for each reference triangle: its reference points
// sss_hao_layout.z channels, 1 or 3; .w terms.

#define SSS_HAO__GLSL_RADIOSITY                                                                                 \
    "#ifndef SSS_HAO_RADIOSITY\n"                                                                               \
    "#define SSS_HAO_RADIOSITY\n"                                                                               \
    "#ifdef GL_ES\n"                                                                                            \
    "precision highp float;\n"                                                                                  \
    "precision highp int;\n"                                                                                    \
    "#endif\n"                                                                                                  \
    "uniform highp usampler2D sss_hao_texture;\n"                                                               \
    "uniform highp sampler2D sss_hao_references;\n"                                                             \
    "uniform ivec4 sss_hao_layout;       // words a vertex, first word of triangles, channels, terms\n"         \
    "uniform vec4 sss_hao_harmonics[64]; // of the light, times the residuals' scales\n"                        \
    "uniform vec4 sss_hao_bias;          // what residuals of code 0 give\n"                                    \
    "uint sss_hao_word(int i)\n"                                                                                \
    "{\n"                                                                                                       \
    "    return texelFetch(sss_hao_texture, ivec2(i % 2048, i / 2048), 0).r;\n"                                 \
    "}\n"                                                                                                       \
    "vec3 sss_hao_reference(int corner)\n"                                                                      \
    "{\n"                                                                                                       \
    "    int i = int(sss_hao_word(corner));\n"                                                                  \
    "    return texelFetch(sss_hao_references, ivec2(i % 2048, i / 2048), 0).rgb;\n"                            \
    "}\n"                                                                                                       \
    "// B of a vertex: the mean of its reference points, and by how much it differs (section 4.2).\n"           \
    "vec3 sss_hao_radiosity(int vertex)\n"                                                                      \
    "{\n"                                                                                                       \
    "    int first = vertex * sss_hao_layout.x;\n"                                                              \
    "    int corner = sss_hao_layout.y + 3 * int(sss_hao_word(first + 1));\n"                                   \
    "    uint pair = sss_hao_word(first);\n"                                                                    \
    "    float w_1 = float(pair & 65535u) / 65535.0;\n"                                                         \
    "    float w_2 = float(pair >> 16) / 65535.0;\n"                                                            \
    "    if ((pair & 65535u) + (pair >> 16) > 65535u)\n"                                                        \
    "    {\n"                                                                                                   \
    "        return vec3(0.0); // the mark of a vertex without light\n"                                         \
    "    }\n"                                                                                                   \
    "    vec3 b = w_1 * sss_hao_reference(corner) + w_2 * sss_hao_reference(corner + 1)\n"                      \
    "             + max(1.0 - w_1 - w_2, 0.0) * sss_hao_reference(corner + 2);\n"                               \
    "    vec3 dq = sss_hao_bias.rgb;\n"                                                                         \
    "    uint bytes = 0u;\n"                                                                                    \
    "    int k = 0;\n"                                                                                          \
    "    for (int term = 0; term < sss_hao_layout.w; term++)\n"                                                 \
    "    {\n"                                                                                                   \
    "        vec3 code = vec3(0.0);\n"                                                                          \
    "        for (int channel = 0; channel < sss_hao_layout.z; channel++)\n"                                    \
    "        {\n"                                                                                               \
    "            bytes = k % 4 == 0 ? sss_hao_word(first + 2 + k / 4) : bytes >> 8;\n"                          \
    "            code[channel] = float(bytes & 255u);\n"                                                        \
    "            k++;\n"                                                                                        \
    "        }\n"                                                                                               \
    "        dq += sss_hao_harmonics[term].rgb * code;\n"                                                       \
    "    }\n"                                                                                                   \
    "    b += dq;\n"                                                                                            \
    "    return max(sss_hao_layout.z == 1 ? b.rrr : b, vec3(0.0)); // light is never negative\n"                \
    "}\n"                                                                                                       \
    "#endif\n"

#endif // SSS_HAO_H

// ============================================ IMPLEMENTATION ============================================
// In the order of the pipeline:
//   memory, small maths         what everything uses
//   lights                      the set of directions and the interpolation in it; irradiance and shadows
//   sums                        clusters, near triangles, one row of kernels times all lights
//   reference points            simplification that remembers where every vertex went
//   storage                     harmonics, Lloyd-Max tables, residuals; relighting from them
//   the object                  creating, lights, saving, shaders

#ifdef SSS_HAO_IMPLEMENTATION
#ifndef SSS_HAO_IMPLEMENTED
#define SSS_HAO_IMPLEMENTED

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SSS_HAO__PI 3.14159265358979323846
#define SSS_HAO__NONE UINT32_MAX
#define SSS_HAO__PROBES 16   // lights midway between those of the set, for measuring the interpolation
#define SSS_HAO__SAMPLES 64  // vertices at which sums and interpolation are measured
#define SSS_HAO__LANES 16    // columns are padded to a multiple, blocks of vertices have as many
#define SSS_HAO__GROUP 32    // receivers that are summed at once

// ---- instruction sets ----

#if !defined(SSS_HAO_NO_SIMD) && defined(__GNUC__) && defined(__x86_64__)                                              \
    && !(defined(__MINGW32__) && !defined(__clang__))
#include <immintrin.h>
#define SSS_HAO__AVX2
#define SSS_HAO__TARGET8 __attribute__((target("avx2,fma")))
#if defined(__OPTIMIZE__) || defined(__clang__) // without optimisation gcc 12 warns inside its own AVX-512 macros
#define SSS_HAO__AVX512
#define SSS_HAO__TARGET16 __attribute__((target("avx512f,avx512dq,fma")))
#endif
#endif

// Lanes of the widest path that the machine has; 1: plain C.
static int sss_hao__lanes_here(void)
{
#if defined(SSS_HAO__AVX512)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("fma"))
    {
        return 16;
    }
#endif
#if defined(SSS_HAO__AVX2)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    {
        return 8;
    }
#endif
    return 1;
}

// ---- memory ----
// Blocks of one computation, freed together on any way out.
typedef struct sss_hao__block
{
    struct sss_hao__block *next, *previous;
    size_t bytes;
    size_t pad; // what follows is aligned as malloc's
} sss_hao__block;

typedef struct sss_hao__memory
{
    sss_hooks hooks;
    sss_hao__block *first;
    size_t bytes, peak;
    int failed; // something could not be allocated
} sss_hao__memory;

// Zeroed; NULL, with m->failed set, where memory ends. From the calling thread only, never inside of tasks.
static void *sss_hao__take(sss_hao__memory *m, size_t count, size_t size)
{
    const size_t head = sizeof(sss_hao__block);
    sss_hao__block *block = NULL;
    size_t bytes;
    count = count > 0 ? count : 1;
    if (count <= (SIZE_MAX - head) / size)
    {
        bytes = head + count * size;
        block = (sss_hao__block *)(m->hooks.allocate != NULL ? m->hooks.allocate(m->hooks.user, bytes)
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
    m->peak = m->bytes > m->peak ? m->bytes : m->peak;
    return block + 1;
}

static void sss_hao__drop(sss_hao__memory *m, void *pointer)
{
    if (pointer != NULL)
    {
        sss_hao__block *block = (sss_hao__block *)pointer - 1;
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

static void sss_hao__drop_all(sss_hao__memory *m)
{
    while (m->first != NULL)
    {
        sss_hao__drop(m, m->first + 1);
    }
}

static void sss_hao__parallel(const sss_hooks *hooks, size_t count,
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

static double sss_hao__min(double a, double b)
{
    return a < b ? a : b;
}

static double sss_hao__max(double a, double b)
{
    return a > b ? a : b;
}

static double sss_hao__dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void sss_hao__cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double sss_hao__length(const double a[3])
{
    return sqrt(sss_hao__dot(a, a));
}

// Unit length; zero stays zero.
static void sss_hao__normalize(double a[3])
{
    const double length = sss_hao__length(a);
    int i;
    for (i = 0; i < 3 && length > 0.0; i++)
    {
        a[i] /= length;
    }
}

static int sss_hao__finite(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (bits & 0x7ff0000000000000u) != 0x7ff0000000000000u;
}

// ---- what the stages hand on ----

// The set of light directions, and what interpolating in it needs. Kept in the object.
typedef struct sss_hao__set
{
    size_t count;            // D
    size_t cells;            // k of the lattice, even; 0: a set of the caller's
    int four;                // SSS_HAO_FOUR_NEAREST
    double (*direction)[3];  // [D] unit length
    double *solid_angle;     // [D] integral of each one's interpolation weight, sr; they sum to 4 pi
} sss_hao__set;

// Lengths in a build are in units in which the diagonal of the mesh's box is in [1, 2), so that nothing over- or
// underflows. R_d dA has no unit, so that B is the same in any.
typedef struct sss_hao__build
{
    sss_hao__memory memory;    // of everything below
    sss_hao_options options;   // as resolved: no zero that means something else; range in mm
    sss_hao_stats stats;       // each stage fills in what it measures
    size_t vertex_count, triangle_count;
    const uint32_t *triangles; // [T][3], the caller's
    double mm;                 // of one unit of length in this struct
    double unit;               // mesh units of one unit of length in this struct
    double center[3];          // of the box, mesh units
    sss_profile profile;       // in units of this struct; the channels in use stand first
    size_t channels;           // 1 or 3
    double range;              // in units of this struct; INFINITY: none
    double (*x)[3];            // [V] from the center
    float (*normal)[3];        // [V] unit length; 0 where there is none
    double *area;              // [V] a third of the triangles'; 0: no triangle, or none with an area
    double *triangle_area;     // [T]
    // lights
    sss_hao__set set;
    double (*probe)[3];        // [SSS_HAO__PROBES] directions midway
    size_t shells;             // M: 1 + distance_count; shell 0 is directional
    double *inverse_distance;  // [M] 1/distance, in units of this struct; 0 first, rising
    size_t lights;             // S = M D: light s = m D + j
    size_t parts;              // 1; with SSS_HAO_VECTORS 3: n times E, x, y, z
    size_t columns;            // C: parts S, then PROBES (directional, scalar), then zeros up to a multiple of LANES.
                               // Column p S + s is part p of light s
    float *E;                  // [V][C] entering irradiance F_t (n.w) of lights of one unit: directional 1 W/mm^2 on a
                               // plane facing them; point lights as much at the center
    struct sss_hao__sums *sums; // prepared by part 3
} sss_hao__build;

// How vertices hang on reference points. Kept in the object in smaller types.
typedef struct sss_hao__references
{
    size_t count, triangle_count;
    uint32_t *vertex;          // [count] of the mesh
    uint32_t (*corner)[3];     // [triangle_count] references; corners may coincide
    uint32_t *triangle;        // [V]
    float (*weight)[3];        // [V] barycentric, in [0, 1], sum 1. A reference hangs on itself: weight 1 at its corner
} sss_hao__references;

// The finished object. Arrays of storages other than its own are NULL.
struct sss_hao
{
    sss_hao__memory memory;   // of the arrays below
    sss_hao_stats stats;      // bytes_* are counted from here
    uint64_t hash;            // of sss_hao_hash
    uint64_t mesh_hash;       // of the mesh alone
    double mm;                // of a mesh unit
    sss_hao__set set;
    size_t channels, shells, lights, terms; // terms: n^2
    double *inverse_distance; // [M] 1/mm
    // FLOAT, VECTORS
    float *q;                 // [V][channels][parts][S]
    // TABLE: of all vertices; REFERENCES: of reference points
    float *table;             // [channels][256]
    unsigned char *code;      // [V or R][channels][S]
    // HARMONICS
    int16_t *harmonic;        // [V][channels][M][terms]
    // REFERENCES
    unsigned char *residual;  // [ceil(V/LANES)][channels][M][terms][LANES]: vertices in blocks, a vector load each
    uint16_t (*weight)[2];    // [V] barycentric, 65,535 is 1; the third is what is left
    uint16_t *corner16;       // [RT][3], or
    uint32_t *corner32;       // where there are more than 65,536 references
    uint16_t *triangle16;     // [V], or
    uint32_t *triangle32;     // where there are more than 65,536 reference triangles
    uint32_t *reference;      // [R] vertices
    // HARMONICS, REFERENCES: a coefficient is offset + scale times its code
    float *scale, *offset;    // [channels][M][terms]
    // scratch of sss_hao_relight
    float *lighting;          // [lighting_count][3]
    float *references;        // [R][4]
};

// ---- lights: the set of directions ----
// The lattice is a geodesic sphere over the octahedron: each octant is cut into m^2 triangles, m = k/2, with 4 m^2 + 2
// = k k + 2 corners in all (a square of k x k cells folded over it, each cut in two). A direction is shared among the
// corners of its triangle, or linearly both ways among the four of its cell, which has a third more error on clamped
// cosines: the corners of the Delaunay triangle are what minimises the sum of weight times squared distance among all
// weights >= 0 that place their mean in the direction, and a fourth corner can only be farther.
#define SSS_HAO__MAX_CELLS 64          // k of the largest lattice: 4,098 directions
#define SSS_HAO__ANGLE_STEPS 16        // a side of a lattice triangle is cut so often to integrate its weights
#define SSS_HAO__LEAST_VOLUME 1e-6     // a set flatter than this lies in a plane: a few roundings of single precision
#define SSS_HAO__WOLFE_ROUNDS 256      // of the search for a nearest point; a handful is what it takes
#define SSS_HAO__LIFT 1e-7             // a direction of one's own is longer than 1 by this at most: no four in a plane
#define SSS_HAO__GOLDEN_ANGLE 2.39996322972865332 // pi (3 - sqrt 5): spreads points evenly on the sphere

static size_t sss_hao__lattice_cells(size_t directions)
{
    size_t k = 2;
    if (directions < 4 || directions > SSS_HAO__MAX_CELLS * SSS_HAO__MAX_CELLS + 2)
    {
        return 0;
    }
    while (k < SSS_HAO__MAX_CELLS && 2 * directions > k * k + (k + 2) * (k + 2) + 4) // beyond the middle of the two
    {
        k += 2;
    }
    return k;
}

// Index of the lattice's direction at barycentric (i, j, m - i - j)/m of the octant that the signs of w choose. Rings
// run from the pole +z to -z; the r-th from its pole has 4 r directions, from +x by +y on.
static uint32_t sss_hao__lattice_index(size_t m, size_t i, size_t j, const double w[3])
{
    const size_t r = i + j, count = 4 * m * m + 2;
    size_t turn; // in the ring
    if (r == 0)
    {
        return (uint32_t)(w[2] < 0.0 ? count - 1 : 0);
    }
    if (w[0] < 0.0)
    {
        turn = w[1] < 0.0 ? 2 * r + j : r + i;
    }
    else
    {
        turn = w[1] < 0.0 ? 3 * r + i : j;
    }
    turn = turn == 4 * r ? 0 : turn;
    return (uint32_t)(w[2] < 0.0 ? count - 1 - 2 * r * (r + 1) + turn : 1 + 2 * r * (r - 1) + turn);
}

// The direction there, in the octant of all signs positive. Sines space the directions evenly along the octant's sides
// and nearly so within, which beats the projection from the flat octahedron and the equal-area map (Clarberg 2008).
static void sss_hao__octant(size_t m, size_t i, size_t j, double out[3])
{
    const double step = 0.5 * SSS_HAO__PI / (double)m;
    out[0] = i == 0 ? 0.0 : sin(step * (double)i);
    out[1] = j == 0 ? 0.0 : sin(step * (double)j);
    out[2] = i + j == m ? 0.0 : sin(step * (double)(m - i - j));
    sss_hao__normalize(out);
}

static double sss_hao__determinant(const double a[3], const double b[3], const double c[3])
{
    double n[3];
    sss_hao__cross(b, c, n);
    return sss_hao__dot(a, n);
}

// The signs of octant 0 to 7.
static void sss_hao__octant_signs(int octant, double out[3])
{
    int k;
    for (k = 0; k < 3; k++)
    {
        out[k] = (octant >> k & 1) != 0 ? -1.0 : 1.0;
    }
}

// Corner c of a triangle of the octant; base is the lattice point below it, up: corners base + e_c, else base + (1, 1,
// 1) - e_c. Only i and j are told: k = m - i - j.
static void sss_hao__lattice_corner(const size_t base[3], int up, int c, size_t *i, size_t *j)
{
    *i = base[0] + (size_t)((c == 0) == (up != 0));
    *j = base[1] + (size_t)((c == 1) == (up != 0));
}

// Adds the integrals of the three weights over one triangle, by symmetry in all octants. Weights are barycentric in the
// flat triangle, P = sum beta_i p_i, seen from the origin under d omega = |p_0 . p_1 x p_2| / |P|^3 d beta.
static void sss_hao__add_angles(size_t m, const size_t base[3], int up, double *solid_angle)
{
    const int steps = SSS_HAO__ANGLE_STEPS;
    double p[3][3], integral[3] = {0.0, 0.0, 0.0}, signs[3], volume;
    size_t i[3], j[3];
    int c, k, s, t, half;
    for (c = 0; c < 3; c++)
    {
        sss_hao__lattice_corner(base, up, c, &i[c], &j[c]);
        sss_hao__octant(m, i[c], j[c], p[c]);
    }
    volume = fabs(sss_hao__determinant(p[0], p[1], p[2])) / (steps * steps);
    for (s = 0; s < steps; s++)
    {
        for (t = 0; t < 2 * (steps - s) - 1; t++) // by turns the two kinds of small triangles: their centroids
        {
            double beta[3], P[3], length;
            half = t % 2;
            beta[0] = (s + (1 + half) / 3.0) / steps;
            beta[1] = (t / 2 + (1 + half) / 3.0) / steps;
            beta[2] = 1.0 - beta[0] - beta[1];
            for (k = 0; k < 3; k++)
            {
                P[k] = beta[0] * p[0][k] + beta[1] * p[1][k] + beta[2] * p[2][k];
            }
            length = sss_hao__length(P);
            for (c = 0; c < 3; c++)
            {
                integral[c] += 0.5 * beta[c] * volume / (length * length * length);
            }
        }
    }
    for (k = 0; k < 8; k++)
    {
        sss_hao__octant_signs(k, signs);
        for (c = 0; c < 3; c++)
        {
            solid_angle[sss_hao__lattice_index(m, i[c], j[c], signs)] += integral[c];
        }
    }
}

static void sss_hao__fill_lattice(sss_hao__set *set)
{
    const size_t m = set->cells / 2;
    size_t i, j, base[3];
    int octant, k;
    for (i = 0; i <= m; i++)
    {
        for (j = 0; j <= m - i; j++)
        {
            double p[3], signs[3];
            sss_hao__octant(m, i, j, p);
            for (octant = 0; octant < 8; octant++)
            {
                sss_hao__octant_signs(octant, signs);
                for (k = 0; k < 3; k++)
                {
                    set->direction[sss_hao__lattice_index(m, i, j, signs)][k] = p[k] > 0.0 ? signs[k] * p[k] : 0.0;
                }
            }
        }
    }
    for (i = 0; i < m; i++)
    {
        for (j = 0; j < m - i; j++)
        {
            base[0] = i;
            base[1] = j;
            base[2] = m - 1 - i - j;
            sss_hao__add_angles(m, base, 1, set->solid_angle);
            if (base[2] > 0)
            {
                base[2]--;
                sss_hao__add_angles(m, base, 0, set->solid_angle);
            }
        }
    }
}

// The triangle of the lattice that holds w: that of the inverse map, nearly exact, or from there across the side that w
// lies beyond, until there is none.   index  of its corners;   lambda  >= 0, its barycentric coordinates times a factor
static void sss_hao__find_triangle(const sss_hao__set *set, const double w[3], size_t base[3], int *is_up,
                                   uint32_t index[3], double lambda[3])
{
    const size_t m = set->cells / 2;
    const double a[3] = {fabs(w[0]), fabs(w[1]), fabs(w[2])};
    double angle[3], sum, p[3][3], place[2];
    size_t i, j, step;
    int c, k, least, up;
    memset(lambda, 0, 3 * sizeof *lambda);
    for (c = 0; c < 3; c++)
    {
        angle[c] = asin(sss_hao__min(a[c], 1.0));
    }
    sum = angle[0] + angle[1] + angle[2]; // >= pi/2 at unit length
    place[0] = (double)m * angle[0] / sum;
    place[1] = (double)m * angle[1] / sum;
    base[0] = (size_t)sss_hao__min(place[0], (double)(m - 1));
    base[1] = (size_t)sss_hao__min(place[1], (double)(m - 1 - base[0]));
    base[2] = m - 1 - base[0] - base[1];
    up = place[0] - (double)base[0] + place[1] - (double)base[1] <= 1.0 || base[2] == 0;
    base[2] -= (size_t)(up == 0);
    for (step = 0; step < 4 * m; step++) // a triangle is crossed once at most
    {
        for (c = 0; c < 3; c++)
        {
            sss_hao__lattice_corner(base, up, c, &i, &j);
            index[c] = sss_hao__lattice_index(m, i, j, w);
            for (k = 0; k < 3; k++)
            {
                p[c][k] = fabs(set->direction[index[c]][k]);
            }
        }
        lambda[0] = sss_hao__determinant(a, p[1], p[2]);
        lambda[1] = sss_hao__determinant(a, p[2], p[0]);
        lambda[2] = sss_hao__determinant(a, p[0], p[1]);
        least = lambda[1] < lambda[0] ? 1 : 0;
        least = lambda[2] < lambda[least] ? 2 : least;
        if (lambda[least] >= 0.0 || (up && base[least] == 0)) // the octant's sides: of rounding
        {
            break;
        }
        base[least] = up ? base[least] - 1 : base[least] + 1;
        up = !up;
    }
    for (c = 0; c < 3; c++)
    {
        lambda[c] = sss_hao__max(lambda[c], 0.0);
    }
    *is_up = up;
}

#define SSS_HAO__LEAST_CORNER 0.5 // of a cell, over its largest: triangles of two sides each

// The cell of a triangle: with the one across its side towards the equator, or over it. Corners in the order in which
// (0, 0), (1, 0), (0, 1) and (1, 1) are those of a square. Returns 0 where an angle is all but straight, as beside the
// ends of the axes x and y: no square maps onto such a cell evenly.
static int sss_hao__find_cell(const sss_hao__set *set, const double w[3], const size_t base[3], int up,
                               uint32_t index[4])
{
    const size_t m = set->cells / 2;
    const double across[3] = {w[0], w[1], w[2] < 0.0 ? 1.0 : -1.0}; // in the other hemisphere
    const int over = up && base[2] == 0;
    double least = 1.0, most = 0.0;
    int c;
    index[0] = sss_hao__lattice_index(m, base[0], base[1], w);
    index[1] = sss_hao__lattice_index(m, base[0] + 1, base[1], w);
    index[2] = sss_hao__lattice_index(m, base[0], base[1] + 1, w);
    index[3] = over ? sss_hao__lattice_index(m, base[0], base[1], across)
                    : sss_hao__lattice_index(m, base[0] + 1, base[1] + 1, w);
    for (c = 0; c < 4; c++) // corners c ^ 1 and c ^ 2 are its neighbours
    {
        const double area = fabs(sss_hao__determinant(set->direction[index[c]], set->direction[index[c ^ 1]],
                                                      set->direction[index[c ^ 2]]));
        least = sss_hao__min(least, area);
        most = sss_hao__max(most, area);
    }
    return least > SSS_HAO__LEAST_CORNER * most;
}

#define SSS_HAO__NEWTON_STEPS 16 // quadratic convergence from the middle of a cell: five or six are enough

// Weights linear both ways over a cell: (s, t) in the square whose bilinear point lies in the direction w, by Newton's
// method on its two coordinates across w.
static void sss_hao__interpolate_cell(const sss_hao__set *set, const double w[3], const uint32_t index[4],
                                      double weight[4])
{
    double e[2][3], p[4][2], s = 0.5, t = 0.5;
    int c, k, step;
    for (k = 0; k < 3; k++)
    {
        e[0][k] = set->direction[index[3]][k] - set->direction[index[0]][k];
    }
    sss_hao__cross(w, e[0], e[1]);
    sss_hao__cross(e[1], w, e[0]);
    sss_hao__normalize(e[0]);
    sss_hao__normalize(e[1]);
    for (c = 0; c < 4; c++)
    {
        p[c][0] = sss_hao__dot(e[0], set->direction[index[c]]);
        p[c][1] = sss_hao__dot(e[1], set->direction[index[c]]);
    }
    for (step = 0; step < SSS_HAO__NEWTON_STEPS; step++)
    {
        double f[2], by_s[2], by_t[2], determinant;
        for (k = 0; k < 2; k++)
        {
            by_s[k] = (1.0 - t) * (p[1][k] - p[0][k]) + t * (p[3][k] - p[2][k]);
            by_t[k] = (1.0 - s) * (p[2][k] - p[0][k]) + s * (p[3][k] - p[1][k]);
            f[k] = (1.0 - t) * ((1.0 - s) * p[0][k] + s * p[1][k]) + t * ((1.0 - s) * p[2][k] + s * p[3][k]);
        }
        determinant = by_s[0] * by_t[1] - by_s[1] * by_t[0]; // > 0 or < 0 all over a convex cell
        s = sss_hao__min(sss_hao__max(s - (f[0] * by_t[1] - f[1] * by_t[0]) / determinant, 0.0), 1.0);
        t = sss_hao__min(sss_hao__max(t - (f[1] * by_s[0] - f[0] * by_s[1]) / determinant, 0.0), 1.0);
    }
    weight[0] = (1.0 - s) * (1.0 - t);
    weight[1] = s * (1.0 - t);
    weight[2] = (1.0 - s) * t;
    weight[3] = s * t;
}

static void sss_hao__interpolate_lattice(const sss_hao__set *set, const double w[3], uint32_t index[4],
                                         double weight[4])
{
    size_t base[3];
    uint32_t cell[4];
    double sum;
    int c, up = 0;
    sss_hao__find_triangle(set, w, base, &up, index, weight);
    if (set->four && sss_hao__find_cell(set, w, base, up, cell))
    {
        memcpy(index, cell, sizeof cell);
        sss_hao__interpolate_cell(set, w, index, weight);
        return;
    }
    sum = weight[0] + weight[1] + weight[2];
    for (c = 0; c < 3; c++)
    {
        weight[c] /= sum;
    }
    index[3] = index[0];
    weight[3] = 0.0;
}

// ---- lights: a set of one's own ----
// Weights are those of the point of the set's convex hull that is nearest to w (Wolfe 1976): the corners of a triangle
// of the Delaunay triangulation, continuous in w, >= 0, a direction alone at itself, and defined for any set, where it
// covers the sphere only in part, too. Lengths differ by next to nothing, so that every face of the hull is a triangle,
// and the same one for all w, where directions lie on a circle.

// Direction j's point, from the one that is sought: w, a little outside of the hull.
static void sss_hao__hull_point(const sss_hao__set *set, size_t j, const double w[3], double out[3])
{
    const uint32_t seed = (uint32_t)j * 0x9e3779b9u + 0x7f4a7c15u; // a hash: no pattern that a set may have, too
    const uint32_t mixed = (seed ^ seed >> 15) * 0x85ebca6bu, hash = (mixed ^ mixed >> 13) * 0xc2b2ae35u;
    const double length = 1.0 + SSS_HAO__LIFT * ((hash >> 8) / 16777216.0);
    int k;
    for (k = 0; k < 3; k++)
    {
        out[k] = length * set->direction[j][k] - (1.0 + 10.0 * SSS_HAO__LIFT) * w[k];
    }
}

// Some of the set's points, affinely independent, with the weights of the point nearest to the origin.
typedef struct sss_hao__corral
{
    int count;
    uint32_t index[4];
    double q[4][3], weight[4];
} sss_hao__corral;

// Weights of the point nearest to the origin of the plane (line, point) through the corral. 0: not independent.
static int sss_hao__nearest_of_plane(const sss_hao__corral *r, double weight[4])
{
    const int n = r->count - 1;
    double d[3][3], G[3][4];
    int i, j, k;
    for (i = 0; i < n; i++)
    {
        for (k = 0; k < 3; k++)
        {
            d[i][k] = r->q[i + 1][k] - r->q[0][k];
        }
    }
    for (i = 0; i < n; i++)
    {
        for (j = 0; j < n; j++)
        {
            G[i][j] = sss_hao__dot(d[i], d[j]);
        }
        G[i][n] = -sss_hao__dot(d[i], r->q[0]);
    }
    for (i = 0; i < n; i++) // positive definite: no pivoting
    {
        if (!(G[i][i] > 1e-14 * sss_hao__dot(d[i], d[i])))
        {
            return 0;
        }
        for (j = 0; j < n; j++)
        {
            const double factor = G[j][i] / G[i][i];
            for (k = i; k <= n && j != i; k++)
            {
                G[j][k] -= factor * G[i][k];
            }
        }
    }
    weight[0] = 1.0;
    for (i = 0; i < n; i++)
    {
        weight[i + 1] = G[i][n] / G[i][i];
        weight[0] -= weight[i + 1];
    }
    return 1;
}

static void sss_hao__leave_corral(sss_hao__corral *r, int i)
{
    r->count--;
    r->index[i] = r->index[r->count];
    r->weight[i] = r->weight[r->count];
    memcpy(r->q[i], r->q[r->count], sizeof r->q[i]);
}

// Wolfe's minor cycles: to the nearest point of the corral's plane, dropping what gets a weight below zero.
static void sss_hao__settle_corral(sss_hao__corral *r)
{
    int i, round;
    for (round = 0; round < 4; round++) // each drops one, of four at most
    {
        double weight[4], share = 1.0;
        int first = -1;
        if (!sss_hao__nearest_of_plane(r, weight))
        {
            sss_hao__leave_corral(r, r->count - 1); // the newest, which has weight 0 still
            return;
        }
        for (i = 0; i < r->count; i++)
        {
            if (weight[i] <= 0.0 && r->weight[i] / (r->weight[i] - weight[i]) < share)
            {
                share = r->weight[i] / (r->weight[i] - weight[i]);
                first = i;
            }
        }
        for (i = 0; i < r->count; i++)
        {
            r->weight[i] += share * (weight[i] - r->weight[i]);
        }
        if (first < 0)
        {
            return;
        }
        sss_hao__leave_corral(r, first);
    }
}

static void sss_hao__sort_corral(const sss_hao__corral *r, uint32_t index[4], double weight[4])
{
    double sum = 0.0;
    int i, j;
    for (i = 0; i < r->count; i++)
    {
        for (j = i; j > 0 && index[j - 1] > r->index[i]; j--)
        {
            index[j] = index[j - 1];
            weight[j] = weight[j - 1];
        }
        index[j] = r->index[i];
        weight[j] = sss_hao__max(r->weight[i], 0.0);
        sum += weight[j];
    }
    for (i = 0; i < 4; i++)
    {
        index[i] = i < r->count ? index[i] : index[0];
        weight[i] = i < r->count ? weight[i] / sum : 0.0;
    }
}

// The point farthest against v, if v . q is below `least` there; else D.
static size_t sss_hao__support(const sss_hao__set *set, const double w[3], const double v[3], double least)
{
    const double origin = (1.0 + 10.0 * SSS_HAO__LIFT) * sss_hao__dot(v, w), room = 2.0 * SSS_HAO__LIFT;
    size_t j, best = set->count;
    for (j = 0; j < set->count; j++)
    {
        const double along = sss_hao__dot(v, set->direction[j]);
        if (along - origin - room * fabs(along) < least) // whatever its length
        {
            double q[3];
            sss_hao__hull_point(set, j, w, q);
            if (sss_hao__dot(v, q) < least)
            {
                least = sss_hao__dot(v, q);
                best = j;
            }
        }
    }
    return best;
}

static void sss_hao__interpolate_hull(const sss_hao__set *set, const double w[3], uint32_t index[4], double weight[4])
{
    sss_hao__corral r;
    double v[3], last = INFINITY, norm;
    size_t j, best = 0;
    int i, k, round;
    for (j = 1; j < set->count; j++)
    {
        best = sss_hao__dot(set->direction[j], w) > sss_hao__dot(set->direction[best], w) ? j : best;
    }
    r.count = 0;
    for (round = 0; round < SSS_HAO__WOLFE_ROUNDS; round++)
    {
        r.index[r.count] = (uint32_t)best;
        r.weight[r.count] = r.count == 0 ? 1.0 : 0.0;
        sss_hao__hull_point(set, best, w, r.q[r.count]);
        r.count++;
        sss_hao__settle_corral(&r);
        for (k = 0; k < 3; k++)
        {
            v[k] = 0.0;
            for (i = 0; i < r.count; i++)
            {
                v[k] += r.weight[i] * r.q[i][k];
            }
        }
        norm = sss_hao__dot(v, v);
        if (!(norm < last) || r.count == 4) // nothing gained: rounding
        {
            break;
        }
        last = norm;
        best = sss_hao__support(set, w, v, norm - 1e-16 * sqrt(norm)); // less what rounding makes of v . q
        if (best == set->count)
        {
            break;
        }
    }
    sss_hao__sort_corral(&r, index, weight);
}

static void sss_hao__interpolate(const sss_hao__set *set, const double w[3], uint32_t index[4], double weight[4])
{
    if (set->cells > 0)
    {
        sss_hao__interpolate_lattice(set, w, index, weight);
    }
    else
    {
        sss_hao__interpolate_hull(set, w, index, weight);
    }
}

// Point i of n spread evenly on the sphere.
static void sss_hao__spread(size_t i, size_t n, double out[3])
{
    const double z = 1.0 - (2.0 * (double)i + 1.0) / (double)n, r = sqrt(sss_hao__max(1.0 - z * z, 0.0));
    const double phi = SSS_HAO__GOLDEN_ANGLE * (double)i;
    out[0] = r * cos(phi);
    out[1] = r * sin(phi);
    out[2] = z;
}

// Solid angles of a set of one's own: its weights summed over points of equal area (Hammersley's: no spiral and no
// lattice, which sets are), 64 to a direction where they are not too many.
static void sss_hao__sum_angles(sss_hao__set *set)
{
    const size_t wanted = 64 * set->count, samples = wanted < 8192 ? 8192 : wanted > 32768 ? 32768 : wanted;
    size_t i, bits;
    for (i = 0; i < samples; i++)
    {
        const double z = 1.0 - (2.0 * (double)i + 1.0) / (double)samples, r = sqrt(1.0 - z * z);
        double w[3], weight[4], turn = 0.0, digit = 0.5;
        uint32_t index[4];
        int k;
        for (bits = i; bits > 0; bits /= 2) // the binary digits of i in reverse, behind the point
        {
            turn += bits % 2 != 0 ? digit : 0.0;
            digit *= 0.5;
        }
        w[0] = r * cos(2.0 * SSS_HAO__PI * turn);
        w[1] = r * sin(2.0 * SSS_HAO__PI * turn);
        w[2] = z;
        sss_hao__interpolate(set, w, index, weight);
        for (k = 0; k < 4; k++)
        {
            set->solid_angle[index[k]] += weight[k];
        }
    }
}

// Whether directions span space: one, the one farthest from its line, and one off the plane of both.
static int sss_hao__spans_space(const sss_hao__set *set)
{
    double normal[3] = {0.0, 0.0, 0.0}, n[3], most = 0.0;
    size_t j;
    for (j = 1; j < set->count; j++)
    {
        sss_hao__cross(set->direction[0], set->direction[j], n);
        if (sss_hao__dot(n, n) > sss_hao__dot(normal, normal))
        {
            memcpy(normal, n, sizeof normal);
        }
    }
    sss_hao__normalize(normal);
    for (j = 0; j < set->count; j++)
    {
        most = sss_hao__max(most, fabs(sss_hao__dot(normal, set->direction[j])));
    }
    return most > SSS_HAO__LEAST_VOLUME;
}

static sss_result sss_hao__make_set(sss_hao__memory *m, const sss_hao_options *options, sss_hao__set *set)
{
    const float *const given = options->direction_set;
    double sum = 0.0;
    size_t i, k;
    set->cells = given == NULL ? sss_hao__lattice_cells(options->directions) : 0;
    set->count = given == NULL ? set->cells * set->cells + 2 : options->directions;
    set->four = given == NULL && options->interpolation == SSS_HAO_FOUR_NEAREST;
    if ((given == NULL && set->cells == 0) || set->count < 4 || set->count > UINT32_MAX)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    set->direction = (double (*)[3])sss_hao__take(m, set->count, sizeof *set->direction);
    set->solid_angle = (double *)sss_hao__take(m, set->count, sizeof *set->solid_angle);
    if (set->direction == NULL || set->solid_angle == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < set->count && given != NULL; i++)
    {
        for (k = 0; k < 3; k++)
        {
            set->direction[i][k] = (double)given[3 * i + k];
        }
        sss_hao__normalize(set->direction[i]);
        if (!(sss_hao__length(set->direction[i]) > 0.5 && sss_hao__length(set->direction[i]) < 2.0)) // zero, not finite
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
    }
    if (given != NULL && !sss_hao__spans_space(set))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (given == NULL)
    {
        sss_hao__fill_lattice(set);
    }
    if (given != NULL || set->four)
    {
        memset(set->solid_angle, 0, set->count * sizeof *set->solid_angle);
        sss_hao__sum_angles(set);
    }
    for (i = 0; i < set->count; i++)
    {
        sum += set->solid_angle[i];
    }
    for (i = 0; i < set->count; i++)
    {
        set->solid_angle[i] *= 4.0 * SSS_HAO__PI / sum;
    }
    return SSS_OK;
}

// ---- lights: quaternion interpolation ----
// Turns unit vector a by t of the way to unit vector b about a x b: the quaternion power of Pletinckx 1989, which for
// vectors is (sin((1 - t) theta) a + sin(t theta) b)/sin(theta). Opposite vectors have no such axis: one at right
// angles to a is taken, the same for all t, so that the way is continuous still.
static void sss_hao__turn(const double a[3], const double b[3], double t, double out[3])
{
    double axis[3], side[3], sine, theta;
    int k, smallest;
    sss_hao__cross(a, b, axis);
    sine = sss_hao__length(axis);
    theta = atan2(sine, sss_hao__dot(a, b));
    if (sine < 1e-12) // the axis is rounding: the same direction, or the opposite
    {
        smallest = fabs(a[1]) < fabs(a[0]) ? 1 : 0;
        smallest = fabs(a[2]) < fabs(a[smallest]) ? 2 : smallest;
        for (k = 0; k < 3; k++)
        {
            side[k] = k == smallest ? 1.0 : 0.0;
        }
        sss_hao__cross(a, side, axis);
    }
    sss_hao__normalize(axis);
    sss_hao__cross(axis, a, side); // a, side: the plane of the turn
    for (k = 0; k < 3; k++)
    {
        out[k] = cos(t * theta) * a[k] + sin(t * theta) * side[k];
    }
}

// Directions by successive turns in the order of the corners (in a triangle it is always the same, and along its sides
// only two have weight: continuous), lengths linearly. A zero vector has no direction: it counts for the length only.
static void sss_hao__interpolate_vectors(const sss_hao__set *set, const double w[3], const uint32_t index[4],
                                         const double weight[4], const float Q[4][3], double out[3])
{
    double direction[3] = {0.0, 0.0, 0.0}, next[3], length = 0.0, sum = 0.0;
    int i, k;
    (void)set;
    (void)w;
    (void)index;
    for (i = 0; i < 4; i++)
    {
        const double q[3] = {(double)Q[i][0], (double)Q[i][1], (double)Q[i][2]};
        const double size = sss_hao__length(q);
        if (weight[i] > 0.0 && size > 0.0)
        {
            memcpy(next, q, sizeof next);
            sss_hao__normalize(next);
            length += weight[i] * size;
            sum += weight[i];
            if (sum > weight[i])
            {
                double turned[3];
                sss_hao__turn(direction, next, weight[i] / sum, turned);
                memcpy(direction, turned, sizeof direction);
            }
            else
            {
                memcpy(direction, next, sizeof direction);
            }
        }
    }
    for (k = 0; k < 3; k++)
    {
        out[k] = length * direction[k];
    }
}

// ---- lights: shadows ----
#if defined(__SSE2__) && !defined(SSS_HAO_NO_SIMD)
#include <emmintrin.h>
#define SSS_HAO__SSE2
#endif

// A depth map whose samples are the vertices themselves (irregular z-buffer: Johnson et al. 2005; Aila and Laine 2004):
// seen from the light, vertices that face it are sorted into the cells of a grid, and every triangle is drawn over the
// cells and compared with what lies in them: no resolution, and no bias but for rounding. No vertex is in the shadow of
// a triangle that it, or a vertex at the same place, is a corner of.
#define SSS_HAO__BLOCK 16              // lights of which irradiance is written at once: a line of memory to a vertex
#define SSS_HAO__ROUND 16              // blocks at once in parallel, at most
#define SSS_HAO__TILE_U 4              // tiles are 16 cells wide and 4 tall: square
#define SSS_HAO__TILE_V 2
#define SSS_HAO__VISITS 16             // of samples and cells, on the mean, after which it pays to take samples out
#define SSS_HAO__SORT_BITS 6           // of each coordinate, for the order of places
#define SSS_HAO__MAX_SIDE 32639.0      // cells of the grid along a side: two such numbers of 16 bits are a finite float
#define SSS_HAO__TALLNESS 4.0          // of a cell, across its width: triangles touch fewer rows
#define SSS_HAO__SMALL 32              // cells along a row of a triangle's box up to which all of the box is drawn
// Projected coordinates are rounded to single precision, by 2^-24 of at most 1 each; eight times that, for the sum of
// corners' and sample's. Surfaces this near are in contact.
#define SSS_HAO__CONTACT 4.8e-7

// Vertices of one place are one.
typedef struct sss_hao__casters
{
    size_t count, triangle_count;
    uint32_t *of_vertex;       // [V] place
    uint32_t *vertex;          // [count] the first one there
    double (*x)[3];            // [count] its position
    uint32_t (*triangle)[3];   // [triangle_count] places; none that has one twice
} sss_hao__casters;

// A place as the light sees it: u, v across, z towards the light, and its cell.
typedef struct sss_hao__seen
{
    float u, v, z;
    uint16_t cell[2];
} sss_hao__seen;

typedef struct sss_hao__sample
{
    float u, v, z;             // z = INFINITY: in shadow, below no other triangle
    uint32_t place;
} sss_hao__sample;

// What one light at a time needs.
typedef struct sss_hao__depth_map
{
    sss_hao__seen *seen;       // [places]
    sss_hao__sample *sample;   // [places] by cell
    uint32_t *offset;          // [places + 2] of the cell's first sample
    float *deepest;            // [tiles] the least z of the samples in a tile of cells
    uint16_t *visible;         // [places] a bit for each light of the block
    size_t side[2], tiles;     // cells; tiles in a row
    float low[2], scale[2];
    size_t samples, visited;   // visited: by triangles, since the last time that samples were taken out
} sss_hao__depth_map;

typedef struct sss_hao__source
{
    double w[3];               // towards the light, from the center
    double distance;           // from the center; 0: directional
    size_t column;             // of the first part
    int scalar;                // one part only
} sss_hao__source;

// Light l: those of the set, then the probes.
static void sss_hao__get_source(const sss_hao__build *b, size_t l, sss_hao__source *out)
{
    const size_t shell = l < b->lights ? l / b->set.count : 0;
    memcpy(out->w, l < b->lights ? b->set.direction[l % b->set.count] : b->probe[l - b->lights], sizeof out->w);
    out->distance = shell > 0 ? 1.0 / b->inverse_distance[shell] : 0.0;
    out->column = l < b->lights ? l : b->lights * b->parts + (l - b->lights);
    out->scalar = l >= b->lights || b->parts == 1;
}

static uint64_t sss_hao__hash_place(const double x[3])
{
    uint64_t bits[3], hash = 0;
    int k;
    memcpy(bits, x, sizeof bits);
    for (k = 0; k < 3; k++)
    {
        hash = (hash ^ bits[k] ^ bits[k] >> 29) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
    }
    return hash;
}

static int sss_hao__same_place(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

// Bits of a place's cell in a grid around the mesh, interleaved: neighbours in order are near in space.
static uint32_t sss_hao__place_code(const double x[3])
{
    uint32_t code = 0;
    int bit, k;
    for (k = 0; k < 3; k++)
    {
        const double cells = (double)(1 << SSS_HAO__SORT_BITS);
        const uint32_t cell = (uint32_t)sss_hao__min(sss_hao__max(0.5 * (x[k] + 1.0) * cells, 0.0), cells - 1.0);
        for (bit = 0; bit < SSS_HAO__SORT_BITS; bit++)
        {
            code |= (cell >> bit & 1u) << (3 * bit + k);
        }
    }
    return code;
}

// Triangles of places in order of their first corner, but those that have one twice. end  [count + 1] zeros
static void sss_hao__sort_triangles(const sss_hao__build *b, sss_hao__casters *c, uint32_t *end)
{
    size_t i, t, k;
    for (t = 0; t < b->triangle_count; t++)
    {
        end[c->of_vertex[b->triangles[3 * t]] + 1]++;
    }
    for (i = 0; i < c->count; i++)
    {
        end[i + 1] += end[i];
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        uint32_t *const corner = c->triangle[end[c->of_vertex[b->triangles[3 * t]]]++];
        for (k = 0; k < 3; k++)
        {
            corner[k] = c->of_vertex[b->triangles[3 * t + k]];
        }
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        const uint32_t *const corner = c->triangle[t];
        if (corner[0] != corner[1] && corner[1] != corner[2] && corner[2] != corner[0])
        {
            memmove(c->triangle[c->triangle_count++], corner, 3 * sizeof *corner);
        }
    }
}

// Puts places in order of their cells and triangles in order of their first corner, so that what is drawn one after the
// other is near each other in memory, too: a third of the time on a large mesh.
static sss_result sss_hao__sort_places(sss_hao__build *b, sss_hao__casters *c)
{
    const size_t codes = (size_t)1 << (3 * SSS_HAO__SORT_BITS);
    const size_t ends = codes > c->count ? codes : c->count;
    uint32_t *const end = (uint32_t *)sss_hao__take(&b->memory, ends + 1, sizeof *end);
    uint32_t *const vertex = (uint32_t *)sss_hao__take(&b->memory, c->count, sizeof *vertex);
    uint32_t *const place = (uint32_t *)sss_hao__take(&b->memory, c->count, sizeof *place);
    size_t i;
    if (b->memory.failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < c->count; i++)
    {
        end[sss_hao__place_code(b->x[c->vertex[i]]) + 1]++;
    }
    for (i = 0; i < codes; i++)
    {
        end[i + 1] += end[i];
    }
    for (i = 0; i < c->count; i++)
    {
        place[i] = end[sss_hao__place_code(b->x[c->vertex[i]])]++;
        vertex[place[i]] = c->vertex[i];
    }
    for (i = 0; i < c->count; i++)
    {
        c->vertex[i] = vertex[i];
        memcpy(c->x[i], b->x[vertex[i]], sizeof c->x[i]);
    }
    for (i = 0; i < b->vertex_count; i++)
    {
        c->of_vertex[i] = place[c->of_vertex[i]];
    }
    memset(end, 0, (ends + 1) * sizeof *end);
    sss_hao__sort_triangles(b, c, end);
    sss_hao__drop(&b->memory, end);
    sss_hao__drop(&b->memory, vertex);
    sss_hao__drop(&b->memory, place);
    return SSS_OK;
}

static sss_result sss_hao__weld(sss_hao__build *b, sss_hao__casters *c)
{
    uint32_t *table;
    size_t size = 4, v;
    while (size < 2 * b->vertex_count)
    {
        size *= 2;
    }
    c->of_vertex = (uint32_t *)sss_hao__take(&b->memory, b->vertex_count, sizeof *c->of_vertex);
    c->vertex = (uint32_t *)sss_hao__take(&b->memory, b->vertex_count, sizeof *c->vertex);
    c->x = (double (*)[3])sss_hao__take(&b->memory, b->vertex_count, sizeof *c->x);
    c->triangle = (uint32_t (*)[3])sss_hao__take(&b->memory, b->triangle_count, sizeof *c->triangle);
    table = (uint32_t *)sss_hao__take(&b->memory, size, sizeof *table); // place + 1
    if (b->memory.failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (v = 0; v < b->vertex_count; v++)
    {
        const double x[3] = {b->x[v][0] + 0.0, b->x[v][1] + 0.0, b->x[v][2] + 0.0}; // no -0
        size_t slot = (size_t)sss_hao__hash_place(x) & (size - 1);
        while (table[slot] > 0 && !sss_hao__same_place(b->x[c->vertex[table[slot] - 1]], x))
        {
            slot = (slot + 1) & (size - 1); // half of the slots are empty
        }
        if (table[slot] == 0)
        {
            c->vertex[c->count++] = (uint32_t)v;
            table[slot] = (uint32_t)c->count;
        }
        c->of_vertex[v] = table[slot] - 1;
    }
    sss_hao__drop(&b->memory, table);
    return sss_hao__sort_places(b, c);
}

// Two directions across w, which is a unit vector.
static void sss_hao__across(const double w[3], double u[3], double v[3])
{
    int k, smallest = fabs(w[1]) < fabs(w[0]) ? 1 : 0;
    smallest = fabs(w[2]) < fabs(w[smallest]) ? 2 : smallest;
    for (k = 0; k < 3; k++)
    {
        v[k] = k == smallest ? 1.0 : 0.0;
    }
    sss_hao__cross(w, v, u);
    sss_hao__normalize(u);
    sss_hao__cross(w, u, v);
}

// All places in the light's frame. A point light at d w sees x as x d/(d - x.w): planes stay planes, what is before the
// other stays so, and as d grows it turns into the parallel projection.
static void sss_hao__see(const sss_hao__casters *c, const sss_hao__source *light, sss_hao__depth_map *map)
{
    const double most = 1e-9; // of d - x.w in d: lights are beyond the bounding sphere
    float high[2] = {-INFINITY, -INFINITY};
    double across[2][3], cells, wide, extent[2];
    size_t i;
    int k;
    sss_hao__across(light->w, across[0], across[1]);
    map->low[0] = map->low[1] = INFINITY;
    for (i = 0; i < c->count; i++)
    {
        const double *const x = c->x[i];
        const double z = sss_hao__dot(x, light->w), d = light->distance;
        const double f = d > 0.0 ? 1.0 / sss_hao__max(1.0 - z / d, most) : 1.0;
        const float u = (float)(f * sss_hao__dot(x, across[0])), v = (float)(f * sss_hao__dot(x, across[1]));
        map->seen[i].u = u;
        map->seen[i].v = v;
        map->seen[i].z = (float)(f * z);
        map->low[0] = u < map->low[0] ? u : map->low[0];
        map->low[1] = v < map->low[1] ? v : map->low[1];
        high[0] = u > high[0] ? u : high[0];
        high[1] = v > high[1] ? v : high[1];
    }
    cells = (double)c->count; // two for each vertex that faces the light
    for (k = 0; k < 2; k++)
    {
        extent[k] = sss_hao__max((double)high[k] - (double)map->low[k], 1e-30);
    }
    wide = sqrt(cells * SSS_HAO__TALLNESS * sss_hao__min(extent[0] / extent[1], cells));
    map->side[0] = (size_t)sss_hao__min(ceil(wide), sss_hao__min(cells, SSS_HAO__MAX_SIDE));
    map->side[1] = (size_t)sss_hao__max(sss_hao__min(floor(cells / (double)map->side[0]), SSS_HAO__MAX_SIDE), 1.0);
    for (k = 0; k < 2; k++)
    {
        map->scale[k] = (float)sss_hao__min((double)map->side[k] / extent[k], 1e30);
    }
}

// Cell of a coordinate; does not fall where the coordinate rises, whatever the rounding.
static uint16_t sss_hao__cell(const sss_hao__depth_map *map, int axis, float x)
{
    const float place = (x - map->low[axis]) * map->scale[axis];
    const float last = (float)(map->side[axis] - 1);
    return (uint16_t)(place < last ? place : last);
}

static float *sss_hao__tile(const sss_hao__depth_map *map, size_t u, size_t v)
{
    return &map->deepest[(v >> SSS_HAO__TILE_V) * map->tiles + (u >> SSS_HAO__TILE_U)];
}

// Sorts the places that face the light into the cells, by counting.
static void sss_hao__bin(const sss_hao__build *b, const sss_hao__casters *c, const sss_hao__source *light,
                         sss_hao__depth_map *map, uint16_t bit)
{
    const double *const w = light->w;
    const size_t cells = map->side[0] * map->side[1];
    uint32_t sum = 0;
    size_t i, v;
    for (i = 0; i < c->count; i++)
    {
        map->seen[i].cell[0] = sss_hao__cell(map, 0, map->seen[i].u);
        map->seen[i].cell[1] = sss_hao__cell(map, 1, map->seen[i].v);
    }
    memset(map->offset, 0, (cells + 2) * sizeof *map->offset);
    map->tiles = (map->side[0] >> SSS_HAO__TILE_U) + 1;
    for (i = 0; i < map->tiles * ((map->side[1] >> SSS_HAO__TILE_V) + 1); i++)
    {
        map->deepest[i] = INFINITY;
    }
    for (v = 0; v < b->vertex_count; v++)
    {
        const float *const n = b->normal[v];
        const double *const x = b->x[v];
        const double d = light->distance; // 0: the light itself is the direction
        const double mu = d > 0.0 ? (double)n[0] * (d * w[0] - x[0]) + (double)n[1] * (d * w[1] - x[1])
                                        + (double)n[2] * (d * w[2] - x[2])
                                  : (double)n[0] * w[0] + (double)n[1] * w[1] + (double)n[2] * w[2];
        const uint32_t place = c->of_vertex[v];
        if (mu > 0.0 && b->area[v] > 0.0 && (map->visible[place] & bit) == 0)
        {
            const sss_hao__seen *const s = &map->seen[place];
            map->visible[place] = (uint16_t)(map->visible[place] | bit); // until a triangle is found above it
            map->offset[s->cell[1] * map->side[0] + s->cell[0] + 2]++;
        }
    }
    for (i = 2; i < cells + 2; i++)
    {
        sum += map->offset[i];
        map->offset[i] = sum;
    }
    for (i = 0; i < c->count; i++)
    {
        if ((map->visible[i] & bit) != 0)
        {
            const sss_hao__seen *const s = &map->seen[i];
            float *const deepest = sss_hao__tile(map, s->cell[0], s->cell[1]);
            sss_hao__sample *const to = &map->sample[map->offset[s->cell[1] * map->side[0] + s->cell[0] + 1]++];
            to->u = s->u;
            to->v = s->v;
            to->z = s->z;
            to->place = (uint32_t)i;
            *deepest = s->z < *deepest ? s->z : *deepest;
        }
    }
    for (i = 0; i < 4; i++)
    {
        map->sample[sum + i].z = INFINITY;
    }
    map->samples = sum;
    map->visited = 0;
}

// A triangle ready for comparison: its sides (inside: all three >= -slack) and its plane.
typedef struct sss_hao__cover
{
    double corner[3][3], side[3][2], slack[3], slope[2], margin, low, high;
    int ready, empty;
} sss_hao__cover;

static void sss_hao__make_cover(const sss_hao__seen *const p[3], sss_hao__cover *out)
{
    double area, scale, contact;
    int k;
    out->ready = 1;
    out->low = INFINITY;
    out->high = -INFINITY;
    for (k = 0; k < 3; k++)
    {
        out->corner[k][0] = (double)p[k]->u;
        out->corner[k][1] = (double)p[k]->v;
        out->corner[k][2] = (double)p[k]->z;
        out->low = sss_hao__min(out->low, out->corner[k][2]);
        out->high = sss_hao__max(out->high, out->corner[k][2]);
    }
    for (k = 0; k < 3; k++)
    {
        out->side[k][0] = out->corner[(k + 1) % 3][0] - out->corner[k][0];
        out->side[k][1] = out->corner[(k + 1) % 3][1] - out->corner[k][1];
    }
    area = out->side[0][0] * out->side[1][1] - out->side[0][1] * out->side[1][0];
    out->empty = area == 0.0; // seen edge-on
    scale = out->empty ? 0.0 : 1.0 / area;
    // dz/du and dz/dv of the plane through the corners
    out->slope[0] = scale * ((out->corner[1][2] - out->corner[0][2]) * out->side[1][1]
                             - (out->corner[2][2] - out->corner[1][2]) * out->side[0][1]);
    out->slope[1] = scale * ((out->corner[2][2] - out->corner[1][2]) * out->side[0][0]
                             - (out->corner[1][2] - out->corner[0][2]) * out->side[1][0]);
    // Coordinates are up to 1, but for a point light very near the mesh
    contact = SSS_HAO__CONTACT * sss_hao__max(1.0, sss_hao__max(fabs(out->low), fabs(out->high)));
    out->margin = contact * (1.0 + fabs(out->slope[0]) + fabs(out->slope[1]));
    for (k = 0; k < 3; k++)
    {
        const double sign = area < 0.0 ? -1.0 : 1.0;
        out->slack[k] = contact * (fabs(out->side[k][0]) + fabs(out->side[k][1]));
        out->side[k][0] *= sign;
        out->side[k][1] *= sign;
    }
    out->low -= contact;
}

// Whether the triangle lies between sample and light, both out of contact.
static int sss_hao__covers(const sss_hao__cover *t, const sss_hao__sample *s)
{
    const double du = (double)s->u - t->corner[0][0], dv = (double)s->v - t->corner[0][1];
    const double z = t->corner[0][2] + t->slope[0] * du + t->slope[1] * dv;
    int k;
    for (k = 0; k < 3; k++)
    {
        const double x = (double)s->u - t->corner[k][0], y = (double)s->v - t->corner[k][1];
        if (t->side[k][0] * y - t->side[k][1] * x < -t->slack[k])
        {
            return 0;
        }
    }
    // Below all of it, or below its plane as far as rounding lets tell
    return (double)s->z < t->low || (double)s->z + t->margin < sss_hao__min(z, t->high);
}

// A triangle's box, and the cells that it lies in.
typedef struct sss_hao__box
{
    float low[4], high[4]; // u, v, z
    size_t first[2], last[2];
} sss_hao__box;

static float sss_hao__least(float a, float b)
{
    return a < b ? a : b;
}

// Without branches: these would be wrong half of the time.
#ifdef SSS_HAO__SSE2
static void sss_hao__make_box(const sss_hao__seen *const p[3], sss_hao__box *out)
{
    const __m128 a = _mm_loadu_ps(&p[0]->u), b = _mm_loadu_ps(&p[1]->u), c = _mm_loadu_ps(&p[2]->u);
    const __m128i i = _mm_castps_si128(a), j = _mm_castps_si128(b), k = _mm_castps_si128(c);
    const __m128i first = _mm_min_epi16(_mm_min_epi16(i, j), k), last = _mm_max_epi16(_mm_max_epi16(i, j), k);
    _mm_storeu_ps(out->low, _mm_min_ps(_mm_min_ps(a, b), c)); // the cells as a number: not used, but finite
    _mm_storeu_ps(out->high, _mm_max_ps(_mm_max_ps(a, b), c));
    out->first[0] = (size_t)_mm_extract_epi16(first, 6);
    out->first[1] = (size_t)_mm_extract_epi16(first, 7);
    out->last[0] = (size_t)_mm_extract_epi16(last, 6);
    out->last[1] = (size_t)_mm_extract_epi16(last, 7);
}
#else
static void sss_hao__make_box(const sss_hao__seen *const p[3], sss_hao__box *out)
{
    int i, k;
    for (k = 0; k < 3; k++)
    {
        const float a = k == 0 ? p[0]->u : k == 1 ? p[0]->v : p[0]->z;
        out->low[k] = out->high[k] = a;
    }
    for (i = 1; i < 3; i++)
    {
        const float x[3] = {p[i]->u, p[i]->v, p[i]->z};
        for (k = 0; k < 3; k++)
        {
            out->low[k] = x[k] < out->low[k] ? x[k] : out->low[k];
            out->high[k] = x[k] > out->high[k] ? x[k] : out->high[k];
        }
    }
    for (k = 0; k < 2; k++)
    {
        const size_t a = p[0]->cell[k], b = p[1]->cell[k], c = p[2]->cell[k];
        const size_t low = a < b ? a : b, high = a > b ? a : b;
        out->first[k] = low < c ? low : c;
        out->last[k] = high > c ? high : c;
    }
}
#endif

// Which of four samples lie in a triangle's box, below its top, and are none of its corners: a bit each. Four at once
// and without branches, because there are some ten for each triangle and nearly none stays.
#ifdef SSS_HAO__SSE2
static int sss_hao__candidates(const sss_hao__sample *s, const sss_hao__box *box, const uint32_t corner[3])
{
    __m128 u = _mm_loadu_ps(&s[0].u), v = _mm_loadu_ps(&s[1].u), z = _mm_loadu_ps(&s[2].u);
    __m128 place = _mm_loadu_ps(&s[3].u), inside;
    __m128i id, own;
    _MM_TRANSPOSE4_PS(u, v, z, place);
    inside = _mm_and_ps(_mm_cmpge_ps(u, _mm_set1_ps(box->low[0])), _mm_cmple_ps(u, _mm_set1_ps(box->high[0])));
    inside = _mm_and_ps(inside, _mm_cmpge_ps(v, _mm_set1_ps(box->low[1])));
    inside = _mm_and_ps(inside, _mm_cmple_ps(v, _mm_set1_ps(box->high[1])));
    inside = _mm_and_ps(inside, _mm_cmplt_ps(z, _mm_set1_ps(box->high[2])));
    id = _mm_castps_si128(place);
    own = _mm_or_si128(_mm_cmpeq_epi32(id, _mm_set1_epi32((int)corner[0])),
                       _mm_cmpeq_epi32(id, _mm_set1_epi32((int)corner[1])));
    own = _mm_or_si128(own, _mm_cmpeq_epi32(id, _mm_set1_epi32((int)corner[2])));
    return _mm_movemask_ps(_mm_andnot_ps(_mm_castsi128_ps(own), inside));
}
#else
static int sss_hao__candidates(const sss_hao__sample *s, const sss_hao__box *box, const uint32_t corner[3])
{
    int i, bits = 0;
    for (i = 0; i < 4; i++)
    {
        bits |= ((s[i].u >= box->low[0]) & (s[i].u <= box->high[0]) & (s[i].v >= box->low[1])
                 & (s[i].v <= box->high[1]) & (s[i].z < box->high[2]) & (s[i].place != corner[0])
                 & (s[i].place != corner[1]) & (s[i].place != corner[2])) << i;
    }
    return bits;
}
#endif

// Draws a triangle over samples [begin, end), and up to three more: there is room behind the last.
static void sss_hao__draw_row(const sss_hao__seen *const p[3], const sss_hao__box *box, const uint32_t corner[3],
                              sss_hao__cover *cover, sss_hao__sample *begin, const sss_hao__sample *end)
{
    sss_hao__sample *s;
    for (s = begin; s < end; s += 4)
    {
        int i, bits = sss_hao__candidates(s, box, corner);
        for (i = 0; bits != 0; i++, bits >>= 1)
        {
            if ((bits & 1) != 0)
            {
                if (!cover->ready)
                {
                    sss_hao__make_cover(p, cover);
                }
                if (!cover->empty && sss_hao__covers(cover, &s[i]))
                {
                    s[i].z = INFINITY;
                }
            }
        }
    }
}

// Cells of a row that a triangle touches: between the least and the greatest u of its part in the row's strip of v.
static void sss_hao__row_span(const sss_hao__depth_map *map, const sss_hao__seen *const p[3], size_t row,
                              size_t span[2])
{
    const double height = 1.0 / (double)map->scale[1], room = 1e-3 * height; // for rounding
    const double bottom = (double)map->low[1] + height * (double)row - room;
    const double top = row + 1 < map->side[1] ? bottom + height + 2.0 * room : INFINITY;
    double low = INFINITY, high = -INFINITY, place[2];
    int k, e;
    for (k = 0; k < 3; k++)
    {
        const double a[2] = {(double)p[k]->u, (double)p[k]->v};
        const double c[2] = {(double)p[(k + 1) % 3]->u, (double)p[(k + 1) % 3]->v};
        if (a[1] >= bottom && a[1] <= top)
        {
            low = sss_hao__min(low, a[0]);
            high = sss_hao__max(high, a[0]);
        }
        for (e = 0; e < 2; e++)
        {
            const double at = e == 0 ? bottom : top;
            if ((a[1] < at) != (c[1] < at))
            {
                const double u = a[0] + (c[0] - a[0]) * ((at - a[1]) / (c[1] - a[1]));
                low = sss_hao__min(low, u);
                high = sss_hao__max(high, u);
            }
        }
    }
    place[0] = floor((low - (double)map->low[0]) * (double)map->scale[0] - 1e-3);
    place[1] = floor((high - (double)map->low[0]) * (double)map->scale[0] + 1e-3);
    for (e = 0; e < 2; e++)
    {
        const double inside = sss_hao__min(sss_hao__max(place[e], (double)span[0]), (double)span[1]);
        place[e] = inside;
    }
    span[0] = low <= high ? (size_t)place[0] : 1;
    span[1] = low <= high ? (size_t)place[1] : 0;
}

// Whether a box lies below all samples around: most of the side that is turned away, which then costs next to nothing.
static int sss_hao__beneath_all(const sss_hao__depth_map *map, const sss_hao__box *box)
{
    const size_t *const a = box->first, *const b = box->last;
    float low, high;
    if ((b[0] >> SSS_HAO__TILE_U) - (a[0] >> SSS_HAO__TILE_U) > 1
        || (b[1] >> SSS_HAO__TILE_V) - (a[1] >> SSS_HAO__TILE_V) > 1)
    {
        return 0; // not only its corners' tiles
    }
    low = sss_hao__least(*sss_hao__tile(map, a[0], a[1]), *sss_hao__tile(map, b[0], a[1]));
    high = sss_hao__least(*sss_hao__tile(map, a[0], b[1]), *sss_hao__tile(map, b[0], b[1]));
    return box->high[2] <= sss_hao__least(low, high);
}

static void sss_hao__draw(sss_hao__depth_map *map, const uint32_t corner[3])
{
    const sss_hao__seen *const p[3] = {&map->seen[corner[0]], &map->seen[corner[1]], &map->seen[corner[2]]};
    sss_hao__cover cover;
    sss_hao__box box;
    size_t row;
    sss_hao__make_box(p, &box);
    if (sss_hao__beneath_all(map, &box))
    {
        return;
    }
    memset(&cover, 0, sizeof cover); // not ready
    for (row = box.first[1]; row <= box.last[1]; row++)
    {
        const uint32_t *const offset = map->offset + row * map->side[0];
        size_t span[2] = {box.first[0], box.last[0]};
        if (box.last[0] - box.first[0] > SSS_HAO__SMALL && box.last[1] > box.first[1])
        {
            sss_hao__row_span(map, p, row, span);
        }
        if (span[0] <= span[1])
        {
            map->visited += offset[span[1] + 1] - offset[span[0]] + 1;
            sss_hao__draw_row(p, &box, corner, &cover, map->sample + offset[span[0]],
                              map->sample + offset[span[1] + 1]);
        }
    }
}

// Takes the samples out that are in shadow, and the light's bit from their places.
static void sss_hao__drop_shadowed(sss_hao__depth_map *map, uint16_t bit)
{
    uint32_t i, begin = 0, kept = 0;
    size_t u, v;
    for (u = 0; u < map->tiles * ((map->side[1] >> SSS_HAO__TILE_V) + 1); u++)
    {
        map->deepest[u] = INFINITY;
    }
    for (v = 0; v < map->side[1]; v++)
    {
        for (u = 0; u < map->side[0]; u++)
        {
            uint32_t *const end = &map->offset[v * map->side[0] + u + 1];
            float *const deepest = sss_hao__tile(map, u, v);
            for (i = begin; i < *end; i++)
            {
                const sss_hao__sample s = map->sample[i];
                uint16_t *const visible = &map->visible[s.place];
                *visible = (uint16_t)(s.z == INFINITY ? *visible & ~bit : *visible);
                *deepest = s.z < *deepest ? s.z : *deepest;
                map->sample[kept] = s;
                kept += (uint32_t)(s.z != INFINITY);
            }
            begin = *end;
            *end = kept;
        }
    }
    for (i = kept; i < kept + 4 && i < map->samples + 4; i++)
    {
        map->sample[i].z = INFINITY;
    }
    map->samples = kept;
    map->visited = 0;
}

// Sets the light's bit of the places that see it. Where triangles cover each other many times over, samples in shadow
// are taken out on the way.
static void sss_hao__cast_shadows(const sss_hao__build *b, const sss_hao__casters *c, const sss_hao__source *light,
                                  sss_hao__depth_map *map, uint16_t bit)
{
    size_t i;
    sss_hao__see(c, light, map);
    sss_hao__bin(b, c, light, map, bit);
    for (i = 0; i < c->triangle_count; i++)
    {
        sss_hao__draw(map, c->triangle[i]);
        if (map->visited > SSS_HAO__VISITS * (map->samples + map->side[0] * map->side[1]))
        {
            sss_hao__drop_shadowed(map, bit);
        }
    }
    sss_hao__drop_shadowed(map, bit);
}

// ---- lights: irradiance ----
// F_t(mu) mu of unpolarised light that enters; 1 - r^2 without cancellation. 0 where it is totally reflected (eta < 1).
static double sss_hao__entering(double eta, double mu)
{
    const double g2 = (eta - 1.0) * (eta + 1.0) + mu * mu; // (eta cos_t)^2
    double g, s, p;
    if (!(g2 > 0.0) || !(mu > 0.0))
    {
        return 0.0;
    }
    g = sqrt(g2);
    s = 1.0 / (mu + g);
    p = eta / (eta * eta * mu + g);
    return 2.0 * mu * mu * g * (s * s + p * p); // mu/2 (4 mu g/(mu + g)^2 + 4 eta^2 mu g/(eta^2 mu + g)^2)
}

// Of lights [first, first + count) of one block.
typedef struct sss_hao__light_block
{
    sss_hao__build *b;
    const sss_hao__casters *casters; // with visible
    const uint16_t *visible;         // [places] bits, or NULL
    const float *share;              // [BLOCK][V] what the caller says, or NULL
    size_t first, count;
    sss_hao__source source[SSS_HAO__BLOCK];
} sss_hao__light_block;

static void sss_hao__start_block(sss_hao__build *b, size_t block, sss_hao__light_block *out)
{
    const size_t all = b->lights + SSS_HAO__PROBES;
    size_t i;
    out->b = b;
    out->casters = NULL;
    out->visible = NULL;
    out->share = NULL;
    out->first = block * SSS_HAO__BLOCK;
    out->count = all - out->first < SSS_HAO__BLOCK ? all - out->first : SSS_HAO__BLOCK;
    for (i = 0; i < out->count; i++)
    {
        sss_hao__get_source(b, out->first + i, &out->source[i]);
    }
}

// E at one vertex from one light, and the vector whose product with w is E: F_t n for directional lights (3.1). What
// reaches the vertex from a point light has a direction w_v of its own; Q is multiplied by w all the same, so that the
// difference of cosines is added along w: F_t (n + (n.w_v - n.w) w).
static void sss_hao__irradiate(const sss_hao__build *b, const sss_hao__source *light, size_t v, float share, float *E)
{
    const double n[3] = {(double)b->normal[v][0], (double)b->normal[v][1], (double)b->normal[v][2]};
    const double center_mu = sss_hao__dot(n, light->w);
    double mu = center_mu, falloff = 1.0, value;
    size_t k;
    if (light->distance > 0.0)
    {
        double to[3];
        for (k = 0; k < 3; k++)
        {
            to[k] = light->w[k] - b->x[v][k] / light->distance; // in units of the distance
        }
        falloff = 1.0 / sss_hao__dot(to, to);
        sss_hao__normalize(to);
        mu = sss_hao__dot(n, to);
    }
    mu = sss_hao__min(mu, 1.0);
    if (mu > 0.0)
    {
        value = (double)share * falloff * sss_hao__entering(b->profile.eta, mu);
        E[light->column] = (float)value;
        for (k = 0; k < 3 && !light->scalar; k++)
        {
            E[light->column + k * b->lights] = (float)(value / mu * (n[k] + (mu - center_mu) * light->w[k]));
        }
    }
}

// Rows [begin, end) of the block's columns; E is zero before.
static void sss_hao__fill_rows(void *context, size_t begin, size_t end)
{
    const sss_hao__light_block *const block = (const sss_hao__light_block *)context;
    const sss_hao__build *const b = block->b;
    size_t v, i;
    for (v = begin; v < end; v++)
    {
        const unsigned bits = block->visible != NULL ? block->visible[block->casters->of_vertex[v]] : 0xffffu;
        for (i = 0; i < block->count && b->area[v] > 0.0 && bits != 0; i++)
        {
            const float share = block->share != NULL ? block->share[i * b->vertex_count + v] : 1.0f;
            if ((bits >> i & 1u) != 0 && share > 0.0f)
            {
                sss_hao__irradiate(b, &block->source[i], v, share < 1.0f ? share : 1.0f, b->E + v * b->columns);
            }
        }
    }
}

// A round of blocks that cast their own shadows, each with a depth map of its own.
typedef struct sss_hao__shadow_round
{
    sss_hao__build *b;
    const sss_hao__casters *casters;
    sss_hao__depth_map *map;
    size_t first; // block
} sss_hao__shadow_round;

static void sss_hao__shadow_task(void *context, size_t begin, size_t end)
{
    const sss_hao__shadow_round *const round = (const sss_hao__shadow_round *)context;
    size_t i, k;
    for (i = begin; i < end; i++)
    {
        sss_hao__light_block block;
        sss_hao__start_block(round->b, round->first + i, &block);
        memset(round->map[i].visible, 0, round->casters->count * sizeof *round->map[i].visible);
        for (k = 0; k < block.count; k++)
        {
            sss_hao__cast_shadows(round->b, round->casters, &block.source[k], &round->map[i], (uint16_t)(1u << k));
        }
        block.casters = round->casters;
        block.visible = round->map[i].visible;
        sss_hao__fill_rows(&block, 0, round->b->vertex_count);
    }
}

#define SSS_HAO__LIGHTS_PROGRESS 0.2 // of all of the computation

static int sss_hao__lights_cancelled(const sss_hao__build *b, size_t done, size_t blocks)
{
    const sss_hooks *const hooks = &b->memory.hooks;
    return hooks->progress != NULL
           && hooks->progress(hooks->user, SSS_HAO__LIGHTS_PROGRESS * (double)done / (double)blocks) != 0;
}

static sss_result sss_hao__own_shadows(sss_hao__build *b, size_t blocks)
{
    sss_hao__casters casters = {0, 0, NULL, NULL, NULL, NULL};
    sss_hao__depth_map map[SSS_HAO__ROUND];
    sss_hao__shadow_round round;
    sss_result result = sss_hao__weld(b, &casters);
    size_t bytes, maps, i;
    if (result != SSS_OK)
    {
        return result;
    }
    // As many depth maps as take no more than half of what E does
    bytes = casters.count * (sizeof(sss_hao__seen) + sizeof(sss_hao__sample) + sizeof(uint32_t) + sizeof(uint16_t));
    maps = b->vertex_count * b->columns * sizeof *b->E / 2 / bytes;
    maps = maps < 1 ? 1 : maps > SSS_HAO__ROUND ? SSS_HAO__ROUND : maps;
    maps = maps > blocks ? blocks : maps;
    for (i = 0; i < maps; i++)
    {
        map[i].seen = (sss_hao__seen *)sss_hao__take(&b->memory, casters.count, sizeof *map[i].seen);
        map[i].sample = (sss_hao__sample *)sss_hao__take(&b->memory, casters.count + 4, sizeof *map[i].sample);
        map[i].offset = (uint32_t *)sss_hao__take(&b->memory, casters.count + 4, sizeof *map[i].offset);
        map[i].deepest = (float *)sss_hao__take(&b->memory, casters.count + 4, sizeof *map[i].deepest);
        map[i].visible = (uint16_t *)sss_hao__take(&b->memory, casters.count, sizeof *map[i].visible);
    }
    if (b->memory.failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    round.b = b;
    round.casters = &casters;
    round.map = map;
    for (round.first = 0; round.first < blocks && result == SSS_OK; round.first += maps)
    {
        const size_t left = blocks - round.first;
        sss_hao__parallel(&b->memory.hooks, left < maps ? left : maps, sss_hao__shadow_task, &round);
        result = sss_hao__lights_cancelled(b, left < maps ? blocks : round.first + maps, blocks) ? SSS_ERROR_CANCELLED
                                                                                                  : SSS_OK;
    }
    for (i = 0; i < maps; i++)
    {
        sss_hao__drop(&b->memory, map[i].seen);
        sss_hao__drop(&b->memory, map[i].sample);
        sss_hao__drop(&b->memory, map[i].offset);
        sss_hao__drop(&b->memory, map[i].deepest);
        sss_hao__drop(&b->memory, map[i].visible);
    }
    sss_hao__drop(&b->memory, casters.of_vertex);
    sss_hao__drop(&b->memory, casters.vertex);
    sss_hao__drop(&b->memory, casters.x);
    sss_hao__drop(&b->memory, casters.triangle);
    return result;
}

// Asks the caller what vertices see of each light of a block; nonzero: cancelled.
static int sss_hao__ask_visibility(const sss_hao__light_block *block, float *share)
{
    const sss_hao__build *const b = block->b;
    size_t i, k;
    int cancelled = 0;
    for (i = 0; i < block->count && !cancelled; i++)
    {
        const sss_hao__source *const s = &block->source[i];
        double light[3];
        for (k = 0; k < 3; k++)
        {
            light[k] = s->distance > 0.0 ? b->center[k] + b->unit * s->distance * s->w[k] : s->w[k];
        }
        cancelled = b->options.visibility(b->options.visibility_user, light,
                                          s->distance > 0.0 ? b->mm * s->distance : INFINITY,
                                          share + i * b->vertex_count) != 0;
    }
    return cancelled;
}

// Without shadows, or with those that the caller tells.
static sss_result sss_hao__given_shadows(sss_hao__build *b, size_t blocks)
{
    const int ask = b->options.visibility != NULL && !b->options.no_shadows;
    float *share = NULL;
    sss_result result = SSS_OK;
    size_t i;
    if (ask)
    {
        share = (float *)sss_hao__take(&b->memory, b->vertex_count, SSS_HAO__BLOCK * sizeof *share);
        result = share == NULL ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
    }
    for (i = 0; i < blocks && result == SSS_OK; i++)
    {
        sss_hao__light_block block;
        sss_hao__start_block(b, i, &block);
        block.share = share;
        if (ask && sss_hao__ask_visibility(&block, share))
        {
            result = SSS_ERROR_CANCELLED;
        }
        else
        {
            sss_hao__parallel(&b->memory.hooks, b->vertex_count, sss_hao__fill_rows, &block);
            result = sss_hao__lights_cancelled(b, i + 1, blocks) ? SSS_ERROR_CANCELLED : SSS_OK;
        }
    }
    sss_hao__drop(&b->memory, share);
    return result;
}

// Directions as far as can be from those of the set: the middles of the triangles that hold evenly spread ones.
static void sss_hao__place_probes(sss_hao__build *b)
{
    size_t i;
    int j, k;
    for (i = 0; i < SSS_HAO__PROBES; i++)
    {
        double w[3], weight[4], middle[3] = {0.0, 0.0, 0.0};
        uint32_t index[4];
        sss_hao__spread(i, SSS_HAO__PROBES, w);
        sss_hao__interpolate(&b->set, w, index, weight);
        for (j = 0; j < 4; j++)
        {
            for (k = 0; k < 3 && weight[j] > 0.0; k++)
            {
                middle[k] += b->set.direction[index[j]][k];
            }
        }
        sss_hao__normalize(middle);
        memcpy(b->probe[i], sss_hao__length(middle) > 0.5 ? middle : w, sizeof middle);
    }
}

static sss_result sss_hao__make_lights(sss_hao__build *b)
{
    const sss_hao_options *const o = &b->options;
    size_t i, blocks;
    b->shells = 1 + (o->distances != NULL ? o->distance_count : 0);
    b->lights = b->shells * b->set.count;
    b->parts = o->storage == SSS_HAO_VECTORS ? 3 : 1;
    b->columns = (b->parts * b->lights + SSS_HAO__PROBES + SSS_HAO__LANES - 1) / SSS_HAO__LANES * SSS_HAO__LANES;
    b->inverse_distance = (double *)sss_hao__take(&b->memory, b->shells, sizeof *b->inverse_distance);
    b->probe = (double (*)[3])sss_hao__take(&b->memory, SSS_HAO__PROBES, sizeof *b->probe);
    b->E = (float *)sss_hao__take(&b->memory, b->vertex_count, b->columns * sizeof *b->E);
    if (b->memory.failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (i = 1; i < b->shells; i++)
    {
        b->inverse_distance[i] = b->mm / o->distances[i - 1];
    }
    sss_hao__place_probes(b);
    blocks = (b->lights + SSS_HAO__PROBES + SSS_HAO__BLOCK - 1) / SSS_HAO__BLOCK;
    return o->no_shadows || o->visibility != NULL ? sss_hao__given_shadows(b, blocks)
                                                  : sss_hao__own_shadows(b, blocks);
}

// ================================================= SUMS =================================================
// B(x_o) = int E(x_i) R_d(|x_o - x_i|) dA for all lights at once (Hao and Varshney 3.1, the sum of their pseudo-code).
// The kernel does not know the light, so that a row of kernels times a matrix of irradiances serves all of them: up to
// SSS_HAO__GROUP receivers near each other share one list of sources, whose kernels W [receivers, channels][sources]
// are multiplied with their irradiances [sources][columns] in registers.
//   far     a cluster of triangles stands for them: the integral of its irradiance at the centroid of its area. The
//           mean of the kernel over it is taken to the second order, from its covariance; the irradiance varying
//           within it is an error of the first order, which decides how large a cluster may be
//   near    triangles, E linear between their corners: quadrature of degree 2 or 4, halved across the longest edge
//           until small beside d = sqrt(r^2 + z_r^2), the distance to the real source
//   here    a triangle with a corner at x_o: in polar coordinates, the radius in closed form
// How large "small" is follows from measuring at sampled vertices.
// Beyond the range a cluster is left out where all of it is beyond for all of a group; one that is cut, or a quadrature
// point near the range, fades out over its own radius: a range shorter than the triangles' radius is kept only so far.

#define SSS_HAO__LEAF 16       // triangles in a leaf at most
#define SSS_HAO__PANEL 512     // sources whose kernels are kept before they are multiplied
#define SSS_HAO__CHUNK 128     // of them multiplied at a time: what of their rows is in use stays in the first cache
#define SSS_HAO__POINTS 512    // quadrature points that are evaluated at a time
#define SSS_HAO__DEPTH 64      // of the tree: halving 2^32 items ends before
#define SSS_HAO__SHARED 6      // halvings that are done for a group together; where more are needed, for each receiver
#define SSS_HAO__ALONE 4       // receivers that are dealt with one by one at least, where others are far enough
#define SSS_HAO__CHEAP 2       // halvings that cost less than one receiver by itself
#define SSS_HAO__HALVINGS 72   // at the end a triangle is 2^-36 of its size, and x_o sees it under an angle only
#define SSS_HAO__SLOPES 768    // 16 to an octave of r^2, from 2^-40 to 2^8
#define SSS_HAO__SLOPE_FIRST 1392u // the upper bits of the float 2^-40
#define SSS_HAO__STEPS 1024    // of the tables of J
#define SSS_HAO__TRIALS 16     // groups of vertices at which the rule is measured,
#define SSS_HAO__TRIAL_EVERY 16 // one of so many where there are few: measuring costs no more than about all the sums
#define SSS_HAO__FAINT 1e-30   // a channel of which no more than this can come out is dark: floats end there
#define SSS_HAO__NEAREST 1e-24f // of d^2, in units of the mesh's diagonal, so that 1/d^3 is a float

// A triangle, or a vertex with its area, in the order of the tree.
typedef struct sss_hao__item
{
    double center[3];
    double area;
    float radius;          // to its farthest corner
    uint32_t corner[3];    // a vertex: the first alone
} sss_hao__item;

// A cluster. Children: the next in order, and `right`.
typedef struct sss_hao__cluster
{
    double center[3];      // of its area
    double area;
    float radius;          // of a sphere around all of it
    float covariance[6];   // of its area: xx, yy, zz, 2xy, 2xz, 2yz
    float trace;           // of the covariance: the mean square distance from the center
    uint32_t first, count; // items
    uint32_t right;        // 0: a leaf
} sss_hao__cluster;

// One dipole source of one channel: R_d = sum of coefficient (1 + sigma d) e^(-sigma d)/d^3, d^2 = r^2 + z^2.
typedef struct sss_hao__pole
{
    double z, sigma, coefficient; // alpha' z/(4 pi)
    float z2, sigmaf, coefficientf;
    double step;                  // between entries of
    double surface;               // e^(-sigma z)/z
    double (*J)[2];               // [STEPS + 1] int_0^u exp(-sigma z cosh t) dt, and what it rises by in a step
} sss_hao__pole;

// What is near enough. Chosen by measuring.
typedef struct sss_hao__rule
{
    const float *open;   // [clusters] distance from the group within which a cluster is opened
    double degree1;      // radius over d up to which corners alone do for a triangle,
    double degree2;      // its center, too,
    double degree4;      // six points
    double negligible1;  // share of the total reflectance that moving a triangle's light by its radius may change
    double negligible;   // for the same: corners alone do, or its center, too, however near it is
    double range;
} sss_hao__rule;

typedef struct sss_hao__sums
{
    sss_hao__pole source[3][2];
    double total[3];             // reflectance of each channel
    double most[3];              // of B under even light of one: that, or what a small mesh can have at all
    int dark[3];                 // no light at all comes out
    double z_least;              // smallest depth in use
    double slope[SSS_HAO__SLOPES]; // bound of |dR_d/dr|/most of any channel, at r and beyond
    int lanes;                   // 16: AVX-512, 8: AVX2, 1: plain C
    int vertices;                // items are vertices
    int own;                     // a vertex's own area counts as a disk around it
    size_t item_count, cluster_count;
    sss_hao__item *item;
    sss_hao__cluster *cluster;
    float *moment;               // [clusters][C] integral of E dA
    float *open[2];              // [clusters] of the rule in use, of the one it is measured against
    sss_hao__rule rule;
    uint32_t *order;             // [V]
} sss_hao__sums;

// ---- kernels ----

static double sss_hao__pole_value(const sss_hao__pole *s, double r2)
{
    const double d = sqrt(r2 + s->z * s->z);
    const double x = s->sigma * d;
    return x < 700.0 && d > 0.0 ? s->coefficient / d / d / d * (1.0 + x) * exp(-x) : 0.0;
}

// R_d of one channel.
static double sss_hao__R_d(const sss_hao__sums *a, size_t channel, double r2)
{
    return sss_hao__pole_value(&a->source[channel][0], r2) + sss_hao__pole_value(&a->source[channel][1], r2);
}

// int_0^L R_d r dr of one source, its coefficient aside: the closed form of the disk.
static double sss_hao__disk(const sss_hao__pole *s, double L)
{
    const double q = sqrt(s->z * s->z + L * L);
    return s->surface - exp(-s->sigma * q) / q;
}

// Share of the reflectance that comes from beyond a radius in a plane.
static double sss_hao__tail(const sss_hao__sums *a, size_t channel, double radius)
{
    double sum = 0.0;
    int j;
    for (j = 0; j < 2; j++)
    {
        const sss_hao__pole *s = &a->source[channel][j];
        const double q = sqrt(s->z * s->z + radius * radius);
        sum += 2.0 * SSS_HAO__PI * s->coefficient * exp(-s->sigma * q) / q;
    }
    return sum / a->total[channel];
}

// J(u) = int_0^u exp(-sigma z cosh t) dt, tabulated from 0 to where nothing is added any more, or r is beyond the mesh.
static sss_result sss_hao__tabulate(sss_hao__memory *m, sss_hao__pole *s)
{
    static const double node[3] = {-0.7745966692414834, 0.0, 0.7745966692414834}; // Gauss and Legendre
    static const double weight[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
    const double depth = s->sigma * s->z;
    const double most = depth > 0.0 ? 1.0 + 50.0 / depth : INFINITY; // of cosh u: e^-50 is nothing
    const double far = 4.0 / s->z;                                   // of sinh u: meshes are less than 4 wide
    const double end = far < most ? asinh(far) : acosh(most);
    int i, k;
    s->J = (double (*)[2])sss_hao__take(m, SSS_HAO__STEPS + 1, sizeof *s->J);
    if (s->J == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    s->step = end / SSS_HAO__STEPS;
    for (i = 0; i <= SSS_HAO__STEPS; i++)
    {
        double sum = 0.0;
        s->J[i][1] = s->step * exp(-depth * cosh(s->step * i));
        if (i == SSS_HAO__STEPS)
        {
            break;
        }
        for (k = 0; k < 3; k++)
        {
            sum += weight[k] * exp(-depth * cosh(s->step * (i + 0.5 + 0.5 * node[k])));
        }
        s->J[i + 1][0] = s->J[i][0] + sum * s->step;
    }
    return SSS_OK;
}

// J at L = z sinh u, by cubics with the exact slopes.
static double sss_hao__J(const sss_hao__pole *s, double L)
{
    const double at = asinh(L / s->z) / s->step;
    const double *a, *b;
    double f;
    if (!(at < SSS_HAO__STEPS))
    {
        return s->J[SSS_HAO__STEPS][0];
    }
    a = s->J[(size_t)at];
    b = a + 2;
    f = at - floor(at);
    return a[0] + (b[0] - a[0]) * f * f * (3.0 - 2.0 * f) + f * (1.0 - f) * (a[1] * (1.0 - f) - b[1] * f);
}

// |dR_d/dr| = coefficient r (3 + 3x + x^2) e^-x/d^5 <= coefficient (3 + 3x + x^2) e^-x/d^4, which falls with r.
static double sss_hao__slope_bound(const sss_hao__sums *a, size_t channels, double r)
{
    double most = 0.0;
    size_t c;
    int j;
    for (c = 0; c < channels; c++)
    {
        double sum = 0.0;
        for (j = 0; j < 2 && !a->dark[c]; j++)
        {
            const sss_hao__pole *s = &a->source[c][j];
            const double d = sqrt(r * r + s->z * s->z);
            const double x = s->sigma * d;
            sum += x < 700.0 ? s->coefficient / d / d / d / d * (3.0 + 3.0 * x + x * x) * exp(-x) : 0.0;
        }
        most = sum > 0.0 ? sss_hao__max(most, sum / a->most[c]) : most;
    }
    return most;
}

// From the table: at the lower end of the entry that holds r, so that it is a bound.
static double sss_hao__slope(const sss_hao__sums *a, double r2)
{
    const float value = (float)r2;
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits = bits >> 19; // sign 0, exponent, four bits of the mantissa
    if (bits < SSS_HAO__SLOPE_FIRST)
    {
        return a->slope[0];
    }
    bits -= SSS_HAO__SLOPE_FIRST;
    return a->slope[bits < SSS_HAO__SLOPES ? bits : SSS_HAO__SLOPES - 1];
}

static double sss_hao__slope_start(size_t entry) // smallest r of an entry; the first holds all that is less
{
    const uint32_t bits = ((uint32_t)entry + SSS_HAO__SLOPE_FIRST) << 19;
    float r2;
    memcpy(&r2, &bits, sizeof r2);
    return entry == 0 ? 0.0 : sqrt((double)r2);
}

// Smallest r from which the bound is at most `most`; INFINITY if it never is.
static double sss_hao__slope_inverse(const sss_hao__sums *a, double most)
{
    size_t low = 0, high = SSS_HAO__SLOPES; // the answer is an entry's start
    while (low < high)
    {
        const size_t middle = (low + high) / 2;
        if (a->slope[middle] <= most)
        {
            high = middle;
        }
        else
        {
            low = middle + 1;
        }
    }
    return low < SSS_HAO__SLOPES ? sss_hao__slope_start(low) : INFINITY;
}

static sss_result sss_hao__make_kernels(sss_hao__build *b, sss_hao__sums *a)
{
    double area = 0.0;
    size_t c, i;
    int j;
    for (i = 0; i < b->vertex_count; i++)
    {
        area += b->area[i];
    }
    a->z_least = INFINITY;
    for (c = 0; c < b->channels; c++)
    {
        double peak = 0.0;
        a->dark[c] = !(b->profile.alpha_p[c] > 0.0 && b->profile.z_r[c] > 0.0 && b->profile.z_v[c] > 0.0);
        for (j = 0; j < 2 && !a->dark[c]; j++)
        {
            sss_hao__pole *s = &a->source[c][j];
            s->z = j == 0 ? b->profile.z_r[c] : b->profile.z_v[c];
            s->sigma = b->profile.sigma_tr[c];
            s->coefficient = b->profile.alpha_p[c] * s->z / (4.0 * SSS_HAO__PI);
            s->z2 = (float)sss_hao__min(s->z * s->z, 1e36); // beyond, nothing can come out that is a float
            s->sigmaf = (float)sss_hao__min(s->sigma, 1e18);
            s->coefficientf = (float)sss_hao__min(s->coefficient, 1e18);
            s->surface = exp(-s->sigma * s->z) / s->z;
            a->total[c] += 2.0 * SSS_HAO__PI * s->coefficient * s->surface;
            peak += s->coefficient / s->z / s->z * (1.0 + s->sigma * s->z) * s->surface; // R_d(0)
            a->z_least = sss_hao__min(a->z_least, s->z);
        }
        a->most[c] = sss_hao__min(a->total[c], area * peak);
        a->dark[c] |= !(a->most[c] > SSS_HAO__FAINT);
        for (j = 0; j < 2; j++)
        {
            if (a->dark[c])
            {
                memset(&a->source[c][j], 0, sizeof a->source[c][j]);
                a->source[c][j].z2 = 1.0f;
            }
            else if (sss_hao__tabulate(&b->memory, &a->source[c][j]) != SSS_OK)
            {
                return SSS_ERROR_OUT_OF_MEMORY;
            }
        }
    }
    for (i = 0; i < SSS_HAO__SLOPES; i++)
    {
        a->slope[i] = sss_hao__slope_bound(a, b->channels, sss_hao__slope_start(i));
    }
    return SSS_OK;
}

// The radius beyond which the tail of the worst channel is a tenth of the tolerance.
static double sss_hao__range_for(const sss_hao__sums *a, size_t channels, double tolerance)
{
    double range = 0.0;
    size_t c;
    for (c = 0; c < channels; c++)
    {
        double low = 0.0, high = 1e300;
        int i;
        if (a->dark[c])
        {
            continue;
        }
        if (!(a->source[c][0].sigma > 0.0))
        {
            return INFINITY;
        }
        for (i = 0; i < 2000 && high > low * (1.0 + 1e-9); i++) // halves the exponent first, then the number
        {
            const double apart = low > 0.0 ? sqrt(low) * sqrt(high) : high * 1e-3;
            const double middle = high > 4.0 * low ? apart : 0.5 * (low + high);
            if (middle < 1e-300)
            {
                break;
            }
            if (sss_hao__tail(a, c, middle) > 0.1 * tolerance)
            {
                low = middle;
            }
            else
            {
                high = middle;
            }
        }
        range = sss_hao__max(range, high);
    }
    return range > 0.0 ? range : INFINITY; // all channels are dark
}

// ---- clusters ----

static int sss_hao__before(const double (*x)[3], uint32_t i, uint32_t j, int axis)
{
    const double a = x[i][axis], b = x[j][axis];
    return a < b || (a == b && i < j);
}

// Reorders list so that the `place` smallest along an axis come first (Hoare 1961). Expected O(n); the three medians
// keep sorted input from being worst, and each step leaves at least one entry out.
static void sss_hao__select(const double (*x)[3], uint32_t *list, size_t count, size_t place, int axis)
{
    size_t low = 0, high = count;
    while (high - low > 1)
    {
        const uint32_t p = list[low], q = list[low + (high - low) / 2], r = list[high - 1];
        const int pq = sss_hao__before(x, p, q, axis), qr = sss_hao__before(x, q, r, axis);
        const int pr = sss_hao__before(x, p, r, axis);
        const uint32_t pivot = pq == qr ? q : (pq == pr ? r : p);
        size_t i = low, j = high - 1;
        for (;;)
        {
            uint32_t swap;
            while (sss_hao__before(x, list[i], pivot, axis))
            {
                i++;
            }
            while (sss_hao__before(x, pivot, list[j], axis))
            {
                j--;
            }
            if (i >= j)
            {
                break;
            }
            swap = list[i];
            list[i] = list[j];
            list[j] = swap;
            i++;
            j--;
        }
        // the pivot is unique: list[low .. j] come before or are it, list[j + 1 .. high) after or are it
        if (place <= j)
        {
            high = j + 1 < high ? j + 1 : high - 1;
        }
        else
        {
            low = j + 1;
        }
    }
}

typedef struct sss_hao__span
{
    uint32_t first, count, parent;
} sss_hao__span;

static int sss_hao__longest_axis(const double (*x)[3], const uint32_t *list, size_t count)
{
    double low[3], high[3];
    size_t i;
    int k, axis = 0;
    for (k = 0; k < 3; k++)
    {
        low[k] = high[k] = x[list[0]][k];
    }
    for (i = 1; i < count; i++)
    {
        for (k = 0; k < 3; k++)
        {
            low[k] = sss_hao__min(low[k], x[list[i]][k]);
            high[k] = sss_hao__max(high[k], x[list[i]][k]);
        }
    }
    for (k = 1; k < 3; k++)
    {
        axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
    }
    return axis;
}

// Halves a list along the longest axis of its box until parts have at most `most`; parts are filled where `whole`.
// cluster: NULL, or what is found, each before its children. Returns how many.
static size_t sss_hao__halve(const double (*x)[3], uint32_t *list, size_t count, size_t most, int whole,
                             sss_hao__cluster *cluster)
{
    sss_hao__span stack[SSS_HAO__DEPTH];
    size_t depth = 0, found = 0;
    if (count == 0)
    {
        return 0;
    }
    stack[depth].first = 0;
    stack[depth].count = (uint32_t)count;
    stack[depth++].parent = SSS_HAO__NONE;
    while (depth > 0)
    {
        const sss_hao__span s = stack[--depth];
        size_t half = s.count / 2;
        if (cluster != NULL)
        {
            cluster[found].first = s.first;
            cluster[found].count = s.count;
            if (s.parent != SSS_HAO__NONE)
            {
                cluster[s.parent].right = (uint32_t)found;
            }
        }
        found++;
        if (s.count <= most)
        {
            continue;
        }
        half = whole ? (half + most - 1) / most * most : half;
        sss_hao__select(x, list + s.first, s.count, half, sss_hao__longest_axis(x, list + s.first, s.count));
        stack[depth].first = s.first + (uint32_t)half; // the right one is met after all of the left
        stack[depth].count = s.count - (uint32_t)half;
        stack[depth++].parent = (uint32_t)(found - 1);
        stack[depth].first = s.first;
        stack[depth].count = (uint32_t)half;
        stack[depth++].parent = SSS_HAO__NONE;
    }
    return found;
}

static void sss_hao__set_item(const sss_hao__build *b, const sss_hao__sums *a, uint32_t index, sss_hao__item *item)
{
    double most = 0.0;
    int i, k;
    if (a->vertices)
    {
        memcpy(item->center, b->x[index], sizeof item->center);
        item->area = b->area[index];
        item->corner[0] = item->corner[1] = item->corner[2] = index;
        return;
    }
    for (i = 0; i < 3; i++)
    {
        item->corner[i] = b->triangles[3 * (size_t)index + (size_t)i];
        for (k = 0; k < 3; k++)
        {
            item->center[k] += b->x[item->corner[i]][k] / 3.0;
        }
    }
    for (i = 0; i < 3; i++)
    {
        double e[3];
        for (k = 0; k < 3; k++)
        {
            e[k] = b->x[item->corner[i]][k] - item->center[k];
        }
        most = sss_hao__max(most, sss_hao__dot(e, e));
    }
    item->area = b->triangle_area[index];
    item->radius = (float)(sqrt(most) * 1.000001);
}

static void sss_hao__add_covariance(double covariance[6], double weight, const double e[3])
{
    covariance[0] += weight * e[0] * e[0];
    covariance[1] += weight * e[1] * e[1];
    covariance[2] += weight * e[2] * e[2];
    covariance[3] += weight * 2.0 * e[0] * e[1];
    covariance[4] += weight * 2.0 * e[0] * e[2];
    covariance[5] += weight * 2.0 * e[1] * e[2];
}

// Centroid, sphere and covariance of a cluster's items. A triangle's covariance about its own center is the sum of
// that of its corners over 12.
static void sss_hao__measure_cluster(const sss_hao__build *b, const sss_hao__sums *a, sss_hao__cluster *t)
{
    double covariance[6] = {0, 0, 0, 0, 0, 0};
    double e[3];
    size_t i;
    int j, k;
    double radius = 0.0;
    for (i = t->first; i < (size_t)t->first + t->count; i++)
    {
        t->area += a->item[i].area;
    }
    for (i = t->first; i < (size_t)t->first + t->count; i++)
    {
        for (k = 0; k < 3; k++)
        {
            t->center[k] += a->item[i].area / t->area * a->item[i].center[k];
        }
    }
    for (i = t->first; i < (size_t)t->first + t->count; i++)
    {
        const sss_hao__item *item = &a->item[i];
        for (k = 0; k < 3; k++)
        {
            e[k] = item->center[k] - t->center[k];
        }
        radius = sss_hao__max(radius, sss_hao__length(e) + (double)item->radius);
        sss_hao__add_covariance(covariance, item->area / t->area, e);
        for (j = 0; j < 3 && !a->vertices; j++)
        {
            for (k = 0; k < 3; k++)
            {
                e[k] = b->x[item->corner[j]][k] - item->center[k];
            }
            sss_hao__add_covariance(covariance, item->area / t->area / 12.0, e);
        }
    }
    t->radius = (float)(radius * 1.000001);
    t->trace = (float)(covariance[0] + covariance[1] + covariance[2]);
    for (k = 0; k < 6; k++)
    {
        t->covariance[k] = (float)covariance[k];
    }
}

static void sss_hao__measure_task(void *context, size_t begin, size_t end)
{
    sss_hao__build *b = (sss_hao__build *)context;
    sss_hao__sums *a = b->sums;
    size_t n, i, j, k;
    for (n = begin; n < end; n++)
    {
        sss_hao__cluster *t = &a->cluster[n];
        sss_hao__measure_cluster(b, a, t);
        for (i = t->first; t->right == 0 && i < (size_t)t->first + t->count; i++) // a leaf's moments
        {
            const size_t corners = a->vertices ? 1 : 3;
            const float weight = (float)(a->item[i].area / (double)corners);
            for (j = 0; j < corners; j++)
            {
                const float *row = b->E + a->item[i].corner[j] * b->columns;
                float *out = a->moment + n * b->columns;
                for (k = 0; k < b->columns; k++)
                {
                    out[k] += weight * row[k];
                }
            }
        }
    }
}

static sss_result sss_hao__make_items(sss_hao__build *b, sss_hao__sums *a, uint32_t **list, double (**center)[3])
{
    const size_t count = a->vertices ? b->vertex_count : b->triangle_count;
    size_t i, n = 0;
    *list = (uint32_t *)sss_hao__take(&b->memory, count, sizeof **list);
    *center = (double (*)[3])sss_hao__take(&b->memory, count, sizeof **center);
    if (*list == NULL || *center == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < count; i++)
    {
        if ((a->vertices ? b->area[i] : b->triangle_area[i]) > 0.0)
        {
            sss_hao__item item;
            memset(&item, 0, sizeof item);
            sss_hao__set_item(b, a, (uint32_t)i, &item);
            memcpy((*center)[i], item.center, sizeof item.center);
            (*list)[n++] = (uint32_t)i;
        }
    }
    a->item_count = n;
    a->item = (sss_hao__item *)sss_hao__take(&b->memory, n, sizeof *a->item);
    return a->item == NULL ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}

static sss_result sss_hao__make_clusters(sss_hao__build *b, sss_hao__sums *a)
{
    uint32_t *list;
    double (*center)[3];
    size_t i, k, most;
    const sss_result result = sss_hao__make_items(b, a, &list, &center);
    if (result != SSS_OK)
    {
        return result;
    }
    most = 4 * (a->item_count / SSS_HAO__LEAF) + 4; // leaves are at least half full
    a->cluster = (sss_hao__cluster *)sss_hao__take(&b->memory, most, sizeof *a->cluster);
    if (a->cluster == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    a->cluster_count = sss_hao__halve((const double (*)[3])center, list, a->item_count, SSS_HAO__LEAF, 0, a->cluster);
    for (i = 0; i < a->item_count; i++)
    {
        sss_hao__set_item(b, a, list[i], &a->item[i]);
    }
    sss_hao__drop(&b->memory, center);
    sss_hao__drop(&b->memory, list);
    a->moment = (float *)sss_hao__take(&b->memory, a->cluster_count * b->columns + 1, sizeof *a->moment);
    a->open[0] = (float *)sss_hao__take(&b->memory, a->cluster_count, sizeof *a->open[0]);
    a->open[1] = (float *)sss_hao__take(&b->memory, a->cluster_count, sizeof *a->open[1]);
    if (a->moment == NULL || a->open[0] == NULL || a->open[1] == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_hao__parallel(&b->memory.hooks, a->cluster_count, sss_hao__measure_task, b);
    for (i = a->cluster_count; i-- > 0;) // children have higher numbers than their parents
    {
        if (a->cluster[i].right != 0)
        {
            const float *left = a->moment + (i + 1) * b->columns;
            const float *right = a->moment + a->cluster[i].right * b->columns;
            float *out = a->moment + i * b->columns;
            for (k = 0; k < b->columns; k++)
            {
                out[k] = left[k] + right[k];
            }
        }
    }
    return SSS_OK;
}

// All vertices in parts of GROUP that are near each other.
static sss_result sss_hao__make_order(sss_hao__build *b, sss_hao__sums *a)
{
    size_t i;
    a->order = (uint32_t *)sss_hao__take(&b->memory, b->vertex_count, sizeof *a->order);
    if (a->order == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < b->vertex_count; i++)
    {
        a->order[i] = (uint32_t)i;
    }
    sss_hao__halve((const double (*)[3])b->x, a->order, b->vertex_count, SSS_HAO__GROUP, 1, NULL);
    return SSS_OK;
}

// How near clusters are opened. What varies within one moves its light by about its root mean square radius, which
// changes area |dR_d/dr| radius; that may be `most` of the total reflectance.
static void sss_hao__set_open(const sss_hao__sums *a, double most, float *open)
{
    size_t i;
    for (i = 0; i < a->cluster_count; i++)
    {
        const sss_hao__cluster *t = &a->cluster[i];
        const double moved = t->area * sqrt((double)t->trace);
        const double r = moved > 0.0 ? sss_hao__slope_inverse(a, most / moved) : 0.0;
        open[i] = (float)(r + (double)t->radius);
    }
}

// ---- near triangles ----

// One receiver beside one triangle: what its integral takes of E at each corner.
typedef struct sss_hao__near
{
    const sss_hao__sums *a;
    const sss_hao__rule *rule;
    size_t channels;
    double corner[3][3];    // from x_o
    double area;
    double weight[3][3];    // [corner][channel]
} sss_hao__near;

// A triangle with corner i at x_o. In polar coordinates, L the distance to the side across in direction theta and t
// the place on that side, the hat functions are 1 - r/L, (1 - t) r/L and t r/L; over r
//   int R_d r dr     = coefficient [e^(-sigma z)/z - e^(-sigma q)/q],  q^2 = L^2 + z^2
//   int R_d r^2 dr   = coefficient [J(L) - L e^(-sigma q)/q],          J(L) = int_0^L e^(-sigma d)/d dr
// What is left, over theta, is smooth: Gauss and Legendre, both sides of the foot of the perpendicular.
static void sss_hao__polar_ray(sss_hao__near *n, int i, double L, double t, double angle)
{
    const double end = sss_hao__min(L, n->rule->range);
    size_t c;
    int j;
    for (c = 0; c < n->channels; c++)
    {
        double all = 0.0, outer = 0.0;
        for (j = 0; j < 2 && !n->a->dark[c]; j++)
        {
            const sss_hao__pole *s = &n->a->source[c][j];
            const double q = sqrt(end * end + s->z * s->z);
            const double rim = exp(-s->sigma * q) / q;
            const double moment = sss_hao__J(s, end) - end * rim;
            all += s->coefficient * (s->surface - rim);
            outer += s->coefficient * sss_hao__max(moment, 0.0) / L;
        }
        n->weight[i][c] += angle * (all - outer);
        n->weight[(i + 1) % 3][c] += angle * (1.0 - t) * outer;
        n->weight[(i + 2) % 3][c] += angle * t * outer;
    }
}

static void sss_hao__polar(sss_hao__near *n, int i)
{
    static const double node[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    static const double weight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    const double *p = n->corner[(i + 1) % 3], *q = n->corner[(i + 2) % 3];
    double side[3], normal[3];
    double length, at, height, from, to, middle;
    int k, m;
    for (k = 0; k < 3; k++)
    {
        side[k] = q[k] - p[k];
    }
    length = sss_hao__length(side);
    sss_hao__normalize(side);
    at = -sss_hao__dot(p, side); // of the foot of the perpendicular on the side, from p
    sss_hao__cross(p, q, normal);
    height = sss_hao__length(normal) / length;
    if (!(height > 0.0) || !(length > 0.0))
    {
        return; // no area
    }
    from = atan2(-at, height);
    to = atan2(length - at, height);
    middle = from < 0.0 && to > 0.0 ? 0.0 : 0.5 * (from + to);
    for (m = 0; m < 2; m++)
    {
        const double half = 0.5 * (m == 0 ? middle - from : to - middle);
        const double mean = 0.5 * (m == 0 ? from + middle : middle + to);
        for (k = 0; k < 8; k++)
        {
            const double theta = mean + (k < 4 ? -half : half) * node[k % 4];
            const double t = (at + height * tan(theta)) / length;
            sss_hao__polar_ray(n, i, height / cos(theta), sss_hao__min(sss_hao__max(t, 0.0), 1.0),
                               half * weight[k % 4]);
        }
    }
}

// Part of a triangle: its corners in barycentric coordinates of the whole.
typedef struct sss_hao__piece
{
    double bary[3][3];
    double share; // of the whole's area
    int halvings;
} sss_hao__piece;

static void sss_hao__piece_corner(const double corner[3][3], const double bary[3], double out[3])
{
    int k;
    for (k = 0; k < 3; k++)
    {
        out[k] = bary[0] * corner[0][k] + bary[1] * corner[1][k] + bary[2] * corner[2][k];
    }
}

// The two halves across the longest edge.
static void sss_hao__cut(const sss_hao__piece *piece, const double x[3][3], sss_hao__piece out[2])
{
    double longest = -1.0;
    int i, k, edge = 0;
    for (i = 0; i < 3; i++)
    {
        double e[3];
        for (k = 0; k < 3; k++)
        {
            e[k] = x[(i + 1) % 3][k] - x[i][k];
        }
        if (sss_hao__dot(e, e) > longest)
        {
            longest = sss_hao__dot(e, e);
            edge = i;
        }
    }
    out[0] = *piece;
    out[0].share *= 0.5;
    out[0].halvings++;
    out[1] = out[0];
    for (k = 0; k < 3; k++)
    {
        const double middle = 0.5 * (piece->bary[edge][k] + piece->bary[(edge + 1) % 3][k]);
        out[0].bary[(edge + 1) % 3][k] = middle;
        out[1].bary[edge][k] = middle;
    }
}

// Center, radius, and the least distance from the origin that the sphere around it allows.
static double sss_hao__piece_sphere(const double x[3][3], double center[3], double *radius)
{
    double most = 0.0;
    int i, k;
    for (k = 0; k < 3; k++)
    {
        center[k] = (x[0][k] + x[1][k] + x[2][k]) / 3.0;
    }
    for (i = 0; i < 3; i++)
    {
        double e[3];
        for (k = 0; k < 3; k++)
        {
            e[k] = x[i][k] - center[k];
        }
        most = sss_hao__max(most, sss_hao__dot(e, e));
    }
    *radius = sqrt(most);
    return sss_hao__max(sss_hao__length(center) - *radius, 0.0);
}

// Whether the radius is small beside d, or the error small beside everything.
static int sss_hao__small(const sss_hao__sums *a, double degree, double negligible, double radius, double area,
                          double distance)
{
    const double d2 = distance * distance + a->z_least * a->z_least;
    return radius * radius <= degree * degree * d2
           || area * radius * sss_hao__slope(a, distance * distance) <= negligible;
}

// The six points of degree 4 of Strang and Fix.
static void sss_hao__six(int k, double bary[3], double *weight)
{
    const double b = k < 3 ? 0.445948490915965 : 0.091576213509771;
    bary[0] = bary[1] = bary[2] = b;
    bary[k % 3] = 1.0 - 2.0 * b;
    *weight = k < 3 ? 0.223381589678011 : 0.109951743655322;
}

static void sss_hao__add_piece(sss_hao__near *n, const sss_hao__piece *piece)
{
    int i, k;
    size_t c;
    for (k = 0; k < 6; k++)
    {
        double local[3], bary[3] = {0.0, 0.0, 0.0}, x[3], weight, r2;
        sss_hao__six(k, local, &weight);
        for (i = 0; i < 3; i++)
        {
            bary[0] += local[i] * piece->bary[i][0];
            bary[1] += local[i] * piece->bary[i][1];
            bary[2] += local[i] * piece->bary[i][2];
        }
        sss_hao__piece_corner((const double (*)[3])n->corner, bary, x);
        r2 = sss_hao__dot(x, x);
        if (r2 > n->rule->range * n->rule->range)
        {
            continue;
        }
        for (c = 0; c < n->channels; c++)
        {
            const double R = weight * piece->share * n->area * sss_hao__R_d(n->a, c, r2);
            for (i = 0; i < 3; i++)
            {
                n->weight[i][c] += bary[i] * R;
            }
        }
    }
}

// x_o is in the plane of a piece or 2^-36 of the triangle away, and z_r is not longer: the piece gets the share of
// the reflectance within its radius that belongs to its angle around x_o.
static void sss_hao__add_angle(sss_hao__near *n, const sss_hao__piece *piece, const double x[3][3], double radius)
{
    double normal[3], u[3], v[3], angle = 0.0;
    int i, k;
    size_t c;
    for (k = 0; k < 3; k++)
    {
        u[k] = x[1][k] - x[0][k];
        v[k] = x[2][k] - x[0][k];
    }
    sss_hao__cross(u, v, normal);
    sss_hao__normalize(normal);
    for (i = 0; i < 3; i++)
    {
        double side[3];
        sss_hao__cross(x[i], x[(i + 1) % 3], side);
        angle += atan2(sss_hao__dot(side, normal), sss_hao__dot(x[i], x[(i + 1) % 3]));
    }
    angle = fabs(angle);
    for (c = 0; c < n->channels; c++)
    {
        const double within = n->a->dark[c] ? 0.0 : n->a->total[c] * (1.0 - sss_hao__tail(n->a, c, radius));
        const double share = angle / (2.0 * SSS_HAO__PI) * within;
        for (i = 0; i < 3; i++)
        {
            n->weight[i][c] += (piece->bary[0][i] + piece->bary[1][i] + piece->bary[2][i]) / 3.0 * share;
        }
    }
}

static void sss_hao__whole_piece(sss_hao__piece *piece)
{
    memset(piece, 0, sizeof *piece);
    piece->bary[0][0] = piece->bary[1][1] = piece->bary[2][2] = 1.0;
    piece->share = 1.0;
}

static void sss_hao__add_near(sss_hao__near *n)
{
    sss_hao__piece stack[SSS_HAO__HALVINGS + 2];
    size_t depth = 0;
    int i;
    memset(n->weight, 0, sizeof n->weight);
    sss_hao__whole_piece(&stack[depth++]);
    while (depth > 0)
    {
        const sss_hao__piece piece = stack[--depth];
        double x[3][3], center[3], radius, distance;
        for (i = 0; i < 3; i++)
        {
            sss_hao__piece_corner((const double (*)[3])n->corner, piece.bary[i], x[i]);
        }
        distance = sss_hao__piece_sphere((const double (*)[3])x, center, &radius);
        if (distance > n->rule->range)
        {
            continue;
        }
        if (sss_hao__small(n->a, n->rule->degree4, n->rule->negligible, radius, piece.share * n->area, distance))
        {
            sss_hao__add_piece(n, &piece);
            continue;
        }
        for (i = 0; i < 3 && piece.halvings == 0; i++)
        {
            if (!(sss_hao__dot(n->corner[i], n->corner[i]) > 0.0))
            {
                sss_hao__polar(n, i);
                return;
            }
        }
        if (piece.halvings >= SSS_HAO__HALVINGS)
        {
            sss_hao__add_angle(n, &piece, (const double (*)[3])x, radius);
            continue;
        }
        sss_hao__cut(&piece, (const double (*)[3])x, &stack[depth]);
        depth += 2;
    }
}

// ---- a group of receivers ----

// A quadrature point: its kernel times weight[k] is added to column[k], for receivers whose bit in lanes is set.
typedef struct sss_hao__point
{
    float x[3];           // from the group's center
    float fade;           // radius over which it fades at the range; 0: it is not there
    float weight[3];
    uint32_t lanes;
    uint32_t column[3];   // the others have no weight where the second is NONE
} sss_hao__point;

typedef struct sss_hao__lump // a cluster as a point
{
    float x[3];
    float fade;
    float covariance[6];
    float trace;
    uint32_t column;
} sss_hao__lump;

typedef struct sss_hao__work
{
    float kernel[6 * SSS_HAO__PANEL * SSS_HAO__LANES]; // [channel][half of the group][column][LANES], first: aligned
    float x[3][SSS_HAO__GROUP];                        // receivers, from the center
    sss_hao__point point[SSS_HAO__POINTS];
    sss_hao__lump lump[SSS_HAO__PANEL];
    const float *row[SSS_HAO__PANEL];                  // of a column: irradiances, or integrals of them
    double even[SSS_HAO__PANEL];                       // the same under even light
    float corner[SSS_HAO__PANEL];                      // weight of the kernel at the vertex itself
    uint32_t vertex[SSS_HAO__PANEL];                   // of a column; NONE: a cluster
    uint32_t slot[2 * SSS_HAO__PANEL];                 // hash table of vertices: 1 + column
    float *out[6][SSS_HAO__LANES];                     // [channel, half][lane] rows to add to
    const sss_hao__build *b;
    const sss_hao__rule *rule;
    const uint32_t *receiver;
    double receiver_x[SSS_HAO__GROUP][3];
    double center[3], radius;
    float range;
    size_t count, halves;
    size_t columns, points, lumps;
    double *even_out;                                  // [GROUP][3]: sums under even light instead; NULL: out
    double interactions;                               // clusters, triangles or vertices met
    float *packed;                                     // [CHUNK][C]
    float *nowhere;                                    // [C] takes what empty lanes would get
} sss_hao__work;

#define SSS_HAO__ALIGNMENT 64
#define SSS_HAO__ALL_LANES 0xffffffffu // GROUP bits

// The kernels in plain C.
static float sss_hao__fade(float range, float fade, double r2)
{
    const float share = fade > 0.0f ? (range - (float)sqrt(r2)) / (2.0f * fade) + 0.5f : 1.0f;
    return share < 0.0f ? 0.0f : (share > 1.0f ? 1.0f : share);
}

static void sss_hao__points_1(sss_hao__work *w, const sss_hao__point *points, size_t count)
{
    const sss_hao__sums *a = w->b->sums;
    size_t i, c, lane;
    int k;
    for (i = 0; i < count; i++)
    {
        const sss_hao__point *p = &points[i];
        const int ways = p->column[1] == SSS_HAO__NONE ? 1 : 3;
        for (lane = 0; lane < w->halves * SSS_HAO__LANES; lane++)
        {
            const double x = (double)(p->x[0] - w->x[0][lane]), y = (double)(p->x[1] - w->x[1][lane]);
            const double z = (double)(p->x[2] - w->x[2][lane]);
            const double r2 = x * x + y * y + z * z;
            const float fade = sss_hao__fade(w->range, p->fade, r2);
            for (c = 0; c < w->b->channels; c++)
            {
                const float here = (p->lanes >> lane & 1u) != 0 ? fade : 0.0f;
                const float R = here > 0.0f ? here * (float)sss_hao__R_d(a, c, r2 + (double)SSS_HAO__NEAREST) : 0.0f;
                float *out = w->kernel + (2 * c + lane / SSS_HAO__LANES) * SSS_HAO__PANEL * SSS_HAO__LANES;
                for (k = 0; k < ways; k++)
                {
                    out[p->column[k] * SSS_HAO__LANES + lane % SSS_HAO__LANES] += p->weight[k] * R;
                }
            }
        }
    }
}

// Mean of R_d over a cluster to the second order. With u = r^2, over its area u has the mean u(center) + trace and
// the variance 4 v, v = x^T covariance x, and d^2 R_d/du^2 = coefficient (15 + 15s + 6s^2 + s^3) e^-s/(4 d^7).
static void sss_hao__lumps_1(sss_hao__work *w)
{
    const sss_hao__sums *a = w->b->sums;
    size_t i, c, lane;
    int j;
    for (i = 0; i < w->lumps; i++)
    {
        const sss_hao__lump *p = &w->lump[i];
        const float *m = p->covariance;
        for (lane = 0; lane < w->halves * SSS_HAO__LANES; lane++)
        {
            const float x = p->x[0] - w->x[0][lane], y = p->x[1] - w->x[1][lane], z = p->x[2] - w->x[2][lane];
            const float r2 = x * x + y * y + z * z;
            const float v = m[0] * x * x + m[1] * y * y + m[2] * z * z + m[3] * x * y + m[4] * x * z + m[5] * y * z;
            const float fade = sss_hao__fade(w->range, p->fade, (double)r2);
            for (c = 0; c < w->b->channels; c++)
            {
                double R = 0.0;
                for (j = 0; j < 2; j++)
                {
                    const sss_hao__pole *s = &a->source[c][j];
                    const double d2 = (double)r2 + (double)p->trace + (double)s->z2;
                    const double sd = sss_hao__min((double)s->sigmaf * sqrt(d2), 100.0);
                    const double bent = 0.5 * (15.0 + sd * (15.0 + sd * (6.0 + sd))) * (double)v / d2 / d2;
                    R += (double)s->coefficientf / d2 / sqrt(d2) * (1.0 + sd + bent) * exp(-sd);
                }
                w->kernel[((2 * c + lane / SSS_HAO__LANES) * SSS_HAO__PANEL + p->column) * SSS_HAO__LANES
                          + lane % SSS_HAO__LANES] = fade * (float)R;
            }
        }
    }
}

// Adds kernels [count][LANES], from lane `lane` on, times rows [count][width] to rows of the result.
static void sss_hao__tile_1(size_t count, const float *kernel, const float *packed, size_t width, float *const *out,
                            size_t column)
{
    size_t k, i, j;
    for (i = 0; i < 4; i++)
    {
        float *row = out[i] + column;
        for (k = 0; k < count; k++)
        {
            const float weight = kernel[k * SSS_HAO__LANES + i];
            const float *from = packed + k * width;
            for (j = 0; j < width; j++)
            {
                row[j] += weight * from[j];
            }
        }
    }
}

// ---- the same in wide registers ----
// Written once, in macros, for two widths N of vectors; a handful of operations differ. They hold 1e-5 against plain C.

#if defined(SSS_HAO__AVX2)
#define SSS_HAO__SUMS_INLINE static inline __attribute__((always_inline))

typedef __m256 sss_hao__s8;
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 __m256 sss_hao__s8_set(float x) { return _mm256_set1_ps(x); }
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 __m256 sss_hao__s8_load(const float *x) { return _mm256_loadu_ps(x); }
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 void sss_hao__s8_store(float *x, __m256 a) { _mm256_storeu_ps(x, a); }
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 __m256 sss_hao__s8_fma(__m256 a, __m256 b, __m256 c)
{
    return _mm256_fmadd_ps(a, b, c);
}
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 __m256 sss_hao__s8_min(__m256 a, __m256 b) { return _mm256_min_ps(a, b); }
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 __m256 sss_hao__s8_max(__m256 a, __m256 b) { return _mm256_max_ps(a, b); }
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 __m256 sss_hao__s8_rsqrt(__m256 a) { return _mm256_rsqrt_ps(a); }
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 __m256 sss_hao__s8_pick(uint32_t bits, __m256 a) // 0 where a bit is
{
    const __m256i bit = _mm256_set_epi32(128, 64, 32, 16, 8, 4, 2, 1);
    const __m256i mine = _mm256_and_si256(_mm256_set1_epi32((int)(bits & 255u)), bit);
    return _mm256_and_ps(a, _mm256_castsi256_ps(_mm256_cmpeq_epi32(mine, bit)));
}
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 __m256 sss_hao__s8_round(__m256 a)
{
    return _mm256_round_ps(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
}
// 2^(n - 27), 0 below 2^-126: numbers whose products are no longer normal would be slow, and nobody sees them.
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 __m256 sss_hao__s8_power(__m256 n)
{
    const __m256i bits = _mm256_add_epi32(_mm256_cvtps_epi32(n), _mm256_set1_epi32(100));
    return _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_max_epi32(bits, _mm256_setzero_si256()), 23));
}

#if defined(SSS_HAO__AVX512)
typedef __m512 sss_hao__s16;
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 __m512 sss_hao__s16_set(float x) { return _mm512_set1_ps(x); }
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 __m512 sss_hao__s16_load(const float *x) { return _mm512_loadu_ps(x); }
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 void sss_hao__s16_store(float *x, __m512 a) { _mm512_storeu_ps(x, a); }
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 __m512 sss_hao__s16_fma(__m512 a, __m512 b, __m512 c)
{
    return _mm512_fmadd_ps(a, b, c);
}
// With masks of ones: gcc 12 warns of uninitialised values inside its own macros without.
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 __m512 sss_hao__s16_min(__m512 a, __m512 b)
{
    return _mm512_maskz_min_ps((__mmask16)0xffff, a, b);
}
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 __m512 sss_hao__s16_max(__m512 a, __m512 b)
{
    return _mm512_maskz_max_ps((__mmask16)0xffff, a, b);
}
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 __m512 sss_hao__s16_rsqrt(__m512 a)
{
    return _mm512_maskz_rsqrt14_ps((__mmask16)0xffff, a);
}
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 __m512 sss_hao__s16_pick(uint32_t bits, __m512 a)
{
    return _mm512_maskz_mov_ps((__mmask16)(bits & 0xffffu), a);
}
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 __m512 sss_hao__s16_round(__m512 a)
{
    return _mm512_maskz_roundscale_ps((__mmask16)0xffff, a, 0); // to the nearest integer
}
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 __m512 sss_hao__s16_power(__m512 n)
{
    const __mmask16 all = (__mmask16)0xffff;
    const __m512i bits = _mm512_add_epi32(_mm512_maskz_cvtps_epi32(all, n), _mm512_set1_epi32(100));
    const __m512i positive = _mm512_maskz_max_epi32(all, bits, _mm512_setzero_si512());
    return _mm512_castsi512_ps(_mm512_maskz_slli_epi32(all, positive, 23));
}
#endif

#define SSS_HAO__POWER_BIAS 134217728.0f // 2^27, what _power leaves out

#define SSS_HAO__SUM_KERNELS(N)                                                                                        \
    SSS_HAO__SUMS_INLINE SSS_HAO__TARGET##N sss_hao__s##N sss_hao__s##N##_over_root(sss_hao__s##N a)                   \
    {                                                                                                                  \
        const sss_hao__s##N y = sss_hao__s##N##_rsqrt(a); /* one step of Newton's */                                   \
        return y * (sss_hao__s##N##_set(1.5f) - sss_hao__s##N##_set(0.5f) * a * y * y);                                \
    }                                                                                                                  \
    /* e^-x 2^-27 for x in [0, 100]; 2^f on [-1/2, 1/2] as in Moshier's Cephes */                                      \
    SSS_HAO__SUMS_INLINE SSS_HAO__TARGET##N sss_hao__s##N sss_hao__s##N##_fall(sss_hao__s##N x)                        \
    {                                                                                                                  \
        const sss_hao__s##N y = x * sss_hao__s##N##_set(-1.44269504f);                                                 \
        const sss_hao__s##N n = sss_hao__s##N##_round(y);                                                              \
        const sss_hao__s##N f = y - n;                                                                                 \
        sss_hao__s##N p = sss_hao__s##N##_set(1.535336188319500e-4f);                                                  \
        p = sss_hao__s##N##_fma(p, f, sss_hao__s##N##_set(1.339887440266574e-3f));                                     \
        p = sss_hao__s##N##_fma(p, f, sss_hao__s##N##_set(9.618437357674640e-3f));                                     \
        p = sss_hao__s##N##_fma(p, f, sss_hao__s##N##_set(5.550332471162809e-2f));                                     \
        p = sss_hao__s##N##_fma(p, f, sss_hao__s##N##_set(2.402264791363012e-1f));                                     \
        p = sss_hao__s##N##_fma(p, f, sss_hao__s##N##_set(6.931472028550421e-1f));                                     \
        p = sss_hao__s##N##_fma(p, f, sss_hao__s##N##_set(1.0f));                                                      \
        return p * sss_hao__s##N##_power(n);                                                                           \
    }                                                                                                                  \
    SSS_HAO__SUMS_INLINE SSS_HAO__TARGET##N sss_hao__s##N sss_hao__s##N##_fade(float range, float fade,                \
                                                                                    sss_hao__s##N r2)                  \
    {                                                                                                                  \
        const sss_hao__s##N safe = sss_hao__s##N##_max(r2, sss_hao__s##N##_set(SSS_HAO__NEAREST));                     \
        const sss_hao__s##N r = safe * sss_hao__s##N##_over_root(safe);                                                \
        const sss_hao__s##N share = sss_hao__s##N##_fma(sss_hao__s##N##_set(range) - r,                                \
                                                        sss_hao__s##N##_set(0.5f / fade), sss_hao__s##N##_set(0.5f));  \
        return sss_hao__s##N##_min(sss_hao__s##N##_max(share, sss_hao__s##N##_set(0.0f)), sss_hao__s##N##_set(1.0f));  \
    }                                                                                                                  \
    /* One source; bend is 0 for a point, x^T covariance x of a cluster */                                             \
    SSS_HAO__SUMS_INLINE SSS_HAO__TARGET##N sss_hao__s##N sss_hao__s##N##_R_d(                                         \
        const sss_hao__pole *s, sss_hao__s##N r2, sss_hao__s##N bend, int lump)                                      \
    {                                                                                                                  \
        const sss_hao__s##N d2 = r2 + sss_hao__s##N##_set(s->z2);                                                      \
        const sss_hao__s##N over = sss_hao__s##N##_over_root(d2);                                                      \
        const sss_hao__s##N over2 = over * over;                                                                       \
        const sss_hao__s##N x = sss_hao__s##N##_min(sss_hao__s##N##_set(s->sigmaf) * d2 * over,                        \
                                                    sss_hao__s##N##_set(100.0f));                                      \
        const sss_hao__s##N scale = sss_hao__s##N##_set(s->coefficientf * SSS_HAO__POWER_BIAS) * over                  \
                                    * sss_hao__s##N##_fall(x) * over2;                                                 \
        sss_hao__s##N sum = sss_hao__s##N##_set(1.0f) + x;                                                             \
        if (lump)                                                                                                      \
        {                                                                                                              \
            sss_hao__s##N p = sss_hao__s##N##_fma(sss_hao__s##N##_set(0.5f), x, sss_hao__s##N##_set(3.0f));            \
            p = sss_hao__s##N##_fma(p, x, sss_hao__s##N##_set(7.5f));                                                  \
            p = sss_hao__s##N##_fma(p, x, sss_hao__s##N##_set(7.5f));                                                  \
            sum = sss_hao__s##N##_fma(p, bend * over2 * over2, sum);                                                   \
        }                                                                                                              \
        return scale * sum;                                                                                            \
    }                                                                                                                  \
    static SSS_HAO__TARGET##N void sss_hao__points_##N(sss_hao__work *w, const sss_hao__point *points,                 \
                                                            size_t count)                                              \
    {                                                                                                                  \
        const size_t channels = w->b->channels;                                                                        \
        size_t i, c, lane;                                                                                             \
        for (i = 0; i < count; i++)                                                                                    \
        {                                                                                                              \
            const sss_hao__point *p = &points[i];                                                                      \
            for (lane = 0; lane < w->halves * SSS_HAO__LANES; lane += N)                                               \
            {                                                                                                          \
                const sss_hao__s##N x = sss_hao__s##N##_set(p->x[0]) - sss_hao__s##N##_load(w->x[0] + lane);           \
                const sss_hao__s##N y = sss_hao__s##N##_set(p->x[1]) - sss_hao__s##N##_load(w->x[1] + lane);           \
                const sss_hao__s##N z = sss_hao__s##N##_set(p->x[2]) - sss_hao__s##N##_load(w->x[2] + lane);           \
                const sss_hao__s##N r2 = x * x + y * y + z * z + sss_hao__s##N##_set(SSS_HAO__NEAREST);                \
                for (c = 0; c < channels; c++)                                                                         \
                {                                                                                                      \
                    const sss_hao__pole *s = w->b->sums->source[c];                                                  \
                    float *out = w->kernel + (2 * c + lane / SSS_HAO__LANES) * SSS_HAO__PANEL * SSS_HAO__LANES         \
                                 + lane % SSS_HAO__LANES;                                                              \
                    float *at = out + p->column[0] * SSS_HAO__LANES;                                                   \
                    sss_hao__s##N R = sss_hao__s##N##_R_d(s, r2, r2, 0) + sss_hao__s##N##_R_d(s + 1, r2, r2, 0);       \
                    if (p->fade > 0.0f)                                                                                \
                    {                                                                                                  \
                        R = R * sss_hao__s##N##_fade(w->range, p->fade, r2);                                           \
                    }                                                                                                  \
                    if (p->lanes != SSS_HAO__ALL_LANES)                                                                \
                    {                                                                                                  \
                        R = sss_hao__s##N##_pick(p->lanes >> lane, R);                                                 \
                    }                                                                                                  \
                    sss_hao__s##N##_store(at, sss_hao__s##N##_fma(R, sss_hao__s##N##_set(p->weight[0]),                \
                                                                  sss_hao__s##N##_load(at)));                          \
                    if (p->column[1] == SSS_HAO__NONE)                                                                 \
                    {                                                                                                  \
                        continue;                                                                                      \
                    }                                                                                                  \
                    at = out + p->column[1] * SSS_HAO__LANES;                                                          \
                    sss_hao__s##N##_store(at, sss_hao__s##N##_fma(R, sss_hao__s##N##_set(p->weight[1]),                \
                                                                  sss_hao__s##N##_load(at)));                          \
                    at = out + p->column[2] * SSS_HAO__LANES;                                                          \
                    sss_hao__s##N##_store(at, sss_hao__s##N##_fma(R, sss_hao__s##N##_set(p->weight[2]),                \
                                                                  sss_hao__s##N##_load(at)));                          \
                }                                                                                                      \
            }                                                                                                          \
        }                                                                                                              \
    }                                                                                                                  \
    static SSS_HAO__TARGET##N void sss_hao__lumps_##N(sss_hao__work *w)                                                \
    {                                                                                                                  \
        size_t i, c, lane;                                                                                             \
        for (i = 0; i < w->lumps; i++)                                                                                 \
        {                                                                                                              \
            const sss_hao__lump *p = &w->lump[i];                                                                      \
            const float *m = p->covariance;                                                                            \
            for (lane = 0; lane < w->halves * SSS_HAO__LANES; lane += N)                                               \
            {                                                                                                          \
                const sss_hao__s##N x = sss_hao__s##N##_set(p->x[0]) - sss_hao__s##N##_load(w->x[0] + lane);           \
                const sss_hao__s##N y = sss_hao__s##N##_set(p->x[1]) - sss_hao__s##N##_load(w->x[1] + lane);           \
                const sss_hao__s##N z = sss_hao__s##N##_set(p->x[2]) - sss_hao__s##N##_load(w->x[2] + lane);           \
                const sss_hao__s##N r2 = x * x + y * y + z * z + sss_hao__s##N##_set(SSS_HAO__NEAREST);                \
                const sss_hao__s##N mean = r2 + sss_hao__s##N##_set(p->trace);                                         \
                const sss_hao__s##N bend = (sss_hao__s##N##_set(m[0]) * x + sss_hao__s##N##_set(m[3]) * y) * x         \
                                           + (sss_hao__s##N##_set(m[1]) * y + sss_hao__s##N##_set(m[5]) * z) * y       \
                                           + (sss_hao__s##N##_set(m[2]) * z + sss_hao__s##N##_set(m[4]) * x) * z;      \
                for (c = 0; c < w->b->channels; c++)                                                                   \
                {                                                                                                      \
                    const sss_hao__pole *s = w->b->sums->source[c];                                                  \
                    sss_hao__s##N R = sss_hao__s##N##_R_d(s, mean, bend, 1)                                            \
                                      + sss_hao__s##N##_R_d(s + 1, mean, bend, 1);                                     \
                    if (p->fade > 0.0f)                                                                                \
                    {                                                                                                  \
                        R = R * sss_hao__s##N##_fade(w->range, p->fade, r2);                                           \
                    }                                                                                                  \
                    sss_hao__s##N##_store(w->kernel                                                                    \
                                              + ((2 * c + lane / SSS_HAO__LANES) * SSS_HAO__PANEL + p->column)         \
                                                    * SSS_HAO__LANES                                                   \
                                              + lane % SSS_HAO__LANES,                                                 \
                                          R);                                                                          \
                }                                                                                                      \
            }                                                                                                          \
        }                                                                                                              \
    }

// A row of a tile: one kernel value times up to three vectors.
#define SSS_HAO__TILE_ROW(N, i)                                                                                        \
    {                                                                                                                  \
        const sss_hao__s##N weight = sss_hao__s##N##_set(kernel[i]);                                                   \
        a##i##0 = sss_hao__s##N##_fma(weight, m0, a##i##0);                                                            \
        a##i##1 = vectors > 1 ? sss_hao__s##N##_fma(weight, m1, a##i##1) : a##i##1;                                    \
        a##i##2 = vectors > 2 ? sss_hao__s##N##_fma(weight, m2, a##i##2) : a##i##2;                                    \
    }
#define SSS_HAO__TILE_LOAD(N, i)                                                                                       \
    sss_hao__s##N a##i##0 = sss_hao__s##N##_load(out[i] + column);                                                     \
    sss_hao__s##N a##i##1 = vectors > 1 ? sss_hao__s##N##_load(out[i] + column + N) : a##i##0;                         \
    sss_hao__s##N a##i##2 = vectors > 2 ? sss_hao__s##N##_load(out[i] + column + 2 * N) : a##i##0;
#define SSS_HAO__TILE_STORE(N, i)                                                                                      \
    {                                                                                                                  \
        sss_hao__s##N##_store(out[i] + column, a##i##0);                                                               \
        if (vectors > 1)                                                                                               \
        {                                                                                                              \
            sss_hao__s##N##_store(out[i] + column + N, a##i##1);                                                       \
        }                                                                                                              \
        if (vectors > 2)                                                                                               \
        {                                                                                                              \
            sss_hao__s##N##_store(out[i] + column + 2 * N, a##i##2);                                                   \
        }                                                                                                              \
    }
#define SSS_HAO__TILE_BODY(N, ROWS)                                                                                    \
    {                                                                                                                  \
        size_t k;                                                                                                      \
        ROWS(N, SSS_HAO__TILE_LOAD)                                                                                    \
        for (k = 0; k < count; k++, kernel += SSS_HAO__LANES, packed += width)                                         \
        {                                                                                                              \
            const sss_hao__s##N m0 = sss_hao__s##N##_load(packed);                                                     \
            const sss_hao__s##N m1 = vectors > 1 ? sss_hao__s##N##_load(packed + N) : m0;                              \
            const sss_hao__s##N m2 = vectors > 2 ? sss_hao__s##N##_load(packed + 2 * N) : m0;                          \
            ROWS(N, SSS_HAO__TILE_ROW)                                                                                 \
        }                                                                                                              \
        ROWS(N, SSS_HAO__TILE_STORE)                                                                                   \
    }
#define SSS_HAO__ROWS4(N, DO) DO(N, 0) DO(N, 1) DO(N, 2) DO(N, 3)
#define SSS_HAO__ROWS8(N, DO) SSS_HAO__ROWS4(N, DO) DO(N, 4) DO(N, 5) DO(N, 6) DO(N, 7)

SSS_HAO__SUM_KERNELS(8)

// Four rows of up to 24 columns: 12 sums and what they are made of fit into 16 registers.
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET8 void sss_hao__tile4x8(size_t count, const float *kernel, const float *packed,
                                                                 size_t width, float *const *out, size_t column,
                                                                 int vectors)
SSS_HAO__TILE_BODY(8, SSS_HAO__ROWS4)

static SSS_HAO__TARGET8 void sss_hao__tile_8(size_t count, const float *kernel, const float *packed, size_t width,
                                                  float *const *out, size_t column)
{
    if (width == 48)
    {
        sss_hao__tile4x8(count, kernel, packed, width, out, column, 3);
        sss_hao__tile4x8(count, kernel, packed + 24, width, out, column + 24, 3);
        return;
    }
    sss_hao__tile4x8(count, kernel, packed, width, out, column, 2);
    if (width == 32)
    {
        sss_hao__tile4x8(count, kernel, packed + 16, width, out, column + 16, 2);
    }
}

#if defined(SSS_HAO__AVX512)
SSS_HAO__SUM_KERNELS(16)

// Eight rows of up to 48 columns: 24 sums in 32 registers.
SSS_HAO__SUMS_INLINE SSS_HAO__TARGET16 void sss_hao__tile8x16(size_t count, const float *kernel,
                                                                   const float *packed, size_t width,
                                                                   float *const *out, size_t column, int vectors)
SSS_HAO__TILE_BODY(16, SSS_HAO__ROWS8)

static SSS_HAO__TARGET16 void sss_hao__tile_16(size_t count, const float *kernel, const float *packed,
                                                    size_t width, float *const *out, size_t column)
{
    if (width == 48)
    {
        sss_hao__tile8x16(count, kernel, packed, width, out, column, 3);
    }
    else if (width == 32)
    {
        sss_hao__tile8x16(count, kernel, packed, width, out, column, 2);
    }
    else
    {
        sss_hao__tile8x16(count, kernel, packed, width, out, column, 1);
    }
}
#endif
#endif

static void sss_hao__points(sss_hao__work *w, const sss_hao__point *points, size_t count)
{
#if defined(SSS_HAO__AVX512)
    if (w->b->sums->lanes == 16)
    {
        sss_hao__points_16(w, points, count);
        return;
    }
#endif
#if defined(SSS_HAO__AVX2)
    if (w->b->sums->lanes == 8)
    {
        sss_hao__points_8(w, points, count);
        return;
    }
#endif
    sss_hao__points_1(w, points, count);
}

static void sss_hao__lumps(sss_hao__work *w)
{
#if defined(SSS_HAO__AVX512)
    if (w->b->sums->lanes == 16)
    {
        sss_hao__lumps_16(w);
        return;
    }
#endif
#if defined(SSS_HAO__AVX2)
    if (w->b->sums->lanes == 8)
    {
        sss_hao__lumps_8(w);
        return;
    }
#endif
    sss_hao__lumps_1(w);
}

// Returns how many rows a tile has.
static size_t sss_hao__multiply_tile(const sss_hao__work *w, size_t count, const float *kernel, const float *packed,
                            size_t width, float *const *out, size_t column)
{
#if defined(SSS_HAO__AVX512)
    if (w->b->sums->lanes == 16)
    {
        sss_hao__tile_16(count, kernel, packed, width, out, column);
        return 8;
    }
#endif
#if defined(SSS_HAO__AVX2)
    if (w->b->sums->lanes == 8)
    {
        sss_hao__tile_8(count, kernel, packed, width, out, column);
        return 4;
    }
#endif
    (void)w;
    sss_hao__tile_1(count, kernel, packed, width, out, column);
    return 4;
}

// ---- the product ----

#define SSS_HAO__BAND 48 // columns of a tile at most

static void sss_hao__multiply_chunk(sss_hao__work *w, size_t first, size_t count)
{
    const size_t C = w->b->columns;
    size_t column, width, block, lane, k;
    for (column = 0; column < C; column += width)
    {
        float *packed = w->packed;
        width = C - column < SSS_HAO__BAND ? C - column : SSS_HAO__BAND;
        for (k = 0; k < count; k++)
        {
            memcpy(packed + k * width, w->row[first + k] + column, width * sizeof *packed);
        }
        for (block = 0; block < 2 * w->b->channels; block++)
        {
            const float *kernel = w->kernel + (block * SSS_HAO__PANEL + first) * SSS_HAO__LANES;
            const size_t start = block % 2 * SSS_HAO__LANES;
            const size_t end = w->count > start ? w->count - start : 0;
            for (lane = 0; lane < SSS_HAO__LANES && lane < end;)
            {
                lane += sss_hao__multiply_tile(w, count, kernel + lane, packed, width, w->out[block] + lane, column);
            }
        }
    }
}

static void sss_hao__multiply_even(sss_hao__work *w)
{
    size_t c, lane, k;
    for (c = 0; c < w->b->channels; c++)
    {
        for (lane = 0; lane < w->count; lane++)
        {
            const float *kernel = w->kernel + (2 * c + lane / SSS_HAO__LANES) * SSS_HAO__PANEL * SSS_HAO__LANES
                                  + lane % SSS_HAO__LANES;
            for (k = 0; k < w->columns; k++)
            {
                w->even_out[3 * lane + c] += (double)kernel[k * SSS_HAO__LANES] * w->even[k];
            }
        }
    }
}

static void sss_hao__run_points(sss_hao__work *w)
{
    sss_hao__points(w, w->point, w->points);
    w->points = 0;
}

// A vertex' own area: in closed form, or nothing.
static void sss_hao__set_own(sss_hao__work *w, size_t column)
{
    const sss_hao__sums *a = w->b->sums;
    const uint32_t vertex = w->vertex[column];
    size_t lane, c;
    int j;
    for (lane = 0; lane < w->count; lane++)
    {
        for (c = 0; w->receiver[lane] == vertex && c < w->b->channels; c++)
        {
            const double radius = sss_hao__min(sqrt(w->b->area[vertex] / SSS_HAO__PI), w->rule->range);
            double own = 0.0;
            for (j = 0; j < 2 && a->own && !a->dark[c]; j++)
            {
                own += 2.0 * SSS_HAO__PI * a->source[c][j].coefficient * sss_hao__disk(&a->source[c][j], radius);
            }
            w->kernel[((2 * c + lane / SSS_HAO__LANES) * SSS_HAO__PANEL + column) * SSS_HAO__LANES
                      + lane % SSS_HAO__LANES] = (float)own;
        }
    }
}

static void sss_hao__place(const sss_hao__work *w, const double x[3], double radius, float *out, float *fade)
{
    double e[3], distance;
    int k;
    for (k = 0; k < 3; k++)
    {
        e[k] = x[k] - w->center[k];
        out[k] = (float)e[k];
    }
    distance = sss_hao__length(e) + w->radius + radius;
    *fade = distance > w->rule->range ? (float)sss_hao__max(radius, 1e-6 * w->rule->range) : 0.0f;
}

// Finishes the kernels of all columns, multiplies them with their rows, and starts anew.
static void sss_hao__flush(sss_hao__work *w)
{
    const sss_hao__sums *a = w->b->sums;
    size_t i;
    sss_hao__run_points(w);
    sss_hao__lumps(w);
    for (i = 0; i < w->columns; i++)
    {
        if (w->vertex[i] != SSS_HAO__NONE && w->corner[i] > 0.0f)
        {
            sss_hao__point *p = &w->point[w->points++];
            const double area = w->b->area[w->vertex[i]];
            sss_hao__place(w, w->b->x[w->vertex[i]], a->vertices ? 0.0 : sqrt(area), p->x, &p->fade);
            p->weight[0] = w->corner[i];
            p->lanes = SSS_HAO__ALL_LANES;
            p->column[0] = (uint32_t)i;
            p->column[1] = SSS_HAO__NONE;
        }
        if (w->points == SSS_HAO__POINTS)
        {
            sss_hao__run_points(w);
        }
    }
    sss_hao__run_points(w);
    for (i = 0; i < w->columns && a->vertices; i++)
    {
        if (w->vertex[i] != SSS_HAO__NONE)
        {
            sss_hao__set_own(w, i);
        }
    }
    if (w->even_out != NULL)
    {
        sss_hao__multiply_even(w);
    }
    for (i = 0; i < w->columns && w->even_out == NULL; i += SSS_HAO__CHUNK)
    {
        sss_hao__multiply_chunk(w, i, w->columns - i < SSS_HAO__CHUNK ? w->columns - i : SSS_HAO__CHUNK);
    }
    w->columns = w->lumps = 0;
    memset(w->slot, 0, sizeof w->slot);
}

// The column of a vertex; there are free ones.
static uint32_t sss_hao__column(sss_hao__work *w, uint32_t vertex)
{
    uint32_t slot = vertex * 2654435761u >> 22; // Knuth's multiplicative hash; 1,024 slots for 512 columns
    size_t block;
    while (w->slot[slot] != 0)
    {
        if (w->vertex[w->slot[slot] - 1] == vertex)
        {
            return w->slot[slot] - 1;
        }
        slot = (slot + 1) % (2 * SSS_HAO__PANEL);
    }
    w->slot[slot] = (uint32_t)++w->columns;
    slot = (uint32_t)(w->columns - 1);
    w->vertex[slot] = vertex;
    w->corner[slot] = 0.0f;
    w->even[slot] = 1.0;
    w->row[slot] = w->b->E + vertex * w->b->columns;
    for (block = 0; block < 2 * w->b->channels; block++)
    {
        memset(w->kernel + (block * SSS_HAO__PANEL + slot) * SSS_HAO__LANES, 0, SSS_HAO__LANES * sizeof(float));
    }
    return slot;
}

static void sss_hao__add_cluster(sss_hao__work *w, size_t index)
{
    const sss_hao__cluster *t = &w->b->sums->cluster[index];
    sss_hao__lump *p;
    if (w->columns == SSS_HAO__PANEL)
    {
        sss_hao__flush(w);
    }
    p = &w->lump[w->lumps++];
    sss_hao__place(w, t->center, (double)t->radius, p->x, &p->fade);
    memcpy(p->covariance, t->covariance, sizeof p->covariance);
    p->trace = t->trace;
    p->column = (uint32_t)w->columns;
    w->vertex[w->columns] = SSS_HAO__NONE;
    w->even[w->columns] = t->area;
    w->row[w->columns++] = w->b->sums->moment + index * w->b->columns;
    w->interactions += 1.0;
}

static void sss_hao__add_point(sss_hao__work *w, const uint32_t column[3], const double weight[3], const double x[3],
                               double radius, uint32_t lanes)
{
    sss_hao__point *p;
    int k;
    if (w->points == SSS_HAO__POINTS)
    {
        sss_hao__run_points(w);
    }
    p = &w->point[w->points++];
    sss_hao__place(w, x, radius, p->x, &p->fade);
    p->lanes = lanes;
    for (k = 0; k < 3; k++)
    {
        p->weight[k] = (float)weight[k];
        p->column[k] = column[k];
    }
}

// A triangle that is small beside d: exact for R_d quadratic, E constant, and R_d linear, E linear (center 3/4, corners
// 1/12 each); corners alone where it is smaller still.
static void sss_hao__add_small(sss_hao__work *w, const sss_hao__item *item, const uint32_t column[3], int corners_alone)
{
    const float weight = (float)(item->area / (corners_alone ? 3.0 : 12.0));
    int k;
    for (k = 0; k < 3; k++)
    {
        w->corner[column[k]] += weight;
    }
    if (!corners_alone)
    {
        const double share[3] = {item->area / 4.0, item->area / 4.0, item->area / 4.0};
        sss_hao__add_point(w, column, share, item->center, (double)item->radius, SSS_HAO__ALL_LANES);
    }
}

static void sss_hao__add_six(sss_hao__work *w, const sss_hao__item *item, const uint32_t column[3],
                             const sss_hao__piece *piece, double radius, uint32_t lanes)
{
    int i, j, k;
    for (k = 0; k < 6; k++)
    {
        double local[3], bary[3] = {0.0, 0.0, 0.0}, x[3] = {0.0, 0.0, 0.0}, weight;
        sss_hao__six(k, local, &weight);
        weight *= item->area * piece->share;
        for (i = 0; i < 3; i++)
        {
            bary[0] += local[i] * piece->bary[i][0];
            bary[1] += local[i] * piece->bary[i][1];
            bary[2] += local[i] * piece->bary[i][2];
        }
        for (i = 0; i < 3; i++)
        {
            for (j = 0; j < 3; j++)
            {
                x[j] += bary[i] * w->b->x[item->corner[i]][j];
            }
        }
        for (i = 0; i < 3; i++)
        {
            bary[i] *= weight;
        }
        sss_hao__add_point(w, column, bary, x, radius, lanes);
    }
}

// Receivers for which a triangle is small as it is.
static uint32_t sss_hao__far_lanes(const sss_hao__work *w, const sss_hao__item *item)
{
    uint32_t far = 0;
    size_t lane;
    int k;
    for (lane = 0; lane < SSS_HAO__GROUP; lane++)
    {
        double e[3], distance;
        for (k = 0; k < 3; k++)
        {
            e[k] = item->center[k] - w->receiver_x[lane][k];
        }
        distance = sss_hao__max(sss_hao__length(e) - (double)item->radius, 0.0);
        if (lane >= w->count
            || sss_hao__small(w->b->sums, w->rule->degree4, w->rule->negligible, (double)item->radius, item->area,
                              distance))
        {
            far |= 1u << lane;
        }
    }
    return far;
}

// Each receiver by itself.
static void sss_hao__add_alone(sss_hao__work *w, const sss_hao__item *item, const uint32_t column[3], uint32_t lanes)
{
    sss_hao__near n;
    size_t lane, c;
    int i, k;
    n.a = w->b->sums;
    n.rule = w->rule;
    n.channels = w->b->channels;
    n.area = item->area;
    for (lane = 0; lane < w->count; lane++)
    {
        if ((lanes >> lane & 1u) == 0)
        {
            continue;
        }
        for (i = 0; i < 3; i++)
        {
            for (k = 0; k < 3; k++)
            {
                n.corner[i][k] = w->b->x[item->corner[i]][k] - w->receiver_x[lane][k];
            }
        }
        sss_hao__add_near(&n);
        for (i = 0; i < 3; i++)
        {
            for (c = 0; c < n.channels; c++)
            {
                w->kernel[((2 * c + lane / SSS_HAO__LANES) * SSS_HAO__PANEL + column[i]) * SSS_HAO__LANES
                          + lane % SSS_HAO__LANES] += (float)n.weight[i][c];
            }
        }
    }
}

// Halved until small for the whole group.
static void sss_hao__add_shared(sss_hao__work *w, const sss_hao__item *item, const uint32_t column[3])
{
    const sss_hao__rule *rule = w->rule;
    sss_hao__piece stack[SSS_HAO__SHARED + 2];
    double corner[3][3];
    size_t depth = 0;
    int i, k;
    for (i = 0; i < 3; i++)
    {
        for (k = 0; k < 3; k++)
        {
            corner[i][k] = w->b->x[item->corner[i]][k] - w->center[k];
        }
    }
    sss_hao__whole_piece(&stack[depth++]);
    while (depth > 0)
    {
        const sss_hao__piece piece = stack[--depth];
        double x[3][3], center[3], radius, distance;
        for (i = 0; i < 3; i++)
        {
            sss_hao__piece_corner((const double (*)[3])corner, piece.bary[i], x[i]);
        }
        distance = sss_hao__max(sss_hao__piece_sphere((const double (*)[3])x, center, &radius) - w->radius, 0.0);
        if (piece.halvings >= SSS_HAO__SHARED
            || sss_hao__small(w->b->sums, rule->degree4, rule->negligible, radius, piece.share * item->area, distance))
        {
            sss_hao__add_six(w, item, column, &piece, radius, SSS_HAO__ALL_LANES);
            continue;
        }
        sss_hao__cut(&piece, (const double (*)[3])x, &stack[depth]);
        depth += 2;
    }
}

// Whether so many halvings make a triangle small wherever receivers are.
static int sss_hao__small_after(const sss_hao__work *w, const sss_hao__item *item, int halvings)
{
    const double radius = (double)item->radius / (double)(1 << halvings / 2);
    const double area = item->area / (double)(1 << halvings);
    return sss_hao__small(w->b->sums, w->rule->degree4, w->rule->negligible, radius, area, 0.0);
}

// A triangle that is not small for all of the group: as one for those that are far from it, in pieces for the others.
static void sss_hao__add_large(sss_hao__work *w, const sss_hao__item *item, const uint32_t column[3])
{
    const uint32_t far = sss_hao__far_lanes(w, item);
    uint32_t rest;
    int near = 0;
    for (rest = ~far; rest != 0; rest &= rest - 1)
    {
        near++;
    }
    if (near > 0 && sss_hao__small_after(w, item, near > SSS_HAO__ALONE ? SSS_HAO__SHARED : SSS_HAO__CHEAP))
    {
        sss_hao__add_shared(w, item, column);
        return;
    }
    if (far != 0)
    {
        sss_hao__piece whole;
        sss_hao__whole_piece(&whole);
        sss_hao__add_six(w, item, column, &whole, (double)item->radius, far);
    }
    sss_hao__add_alone(w, item, column, ~far);
}

// A triangle near the group.
static void sss_hao__add_triangle(sss_hao__work *w, const sss_hao__item *item)
{
    const sss_hao__sums *a = w->b->sums;
    const sss_hao__rule *rule = w->rule;
    double e[3], distance;
    uint32_t column[3];
    int i, k;
    for (k = 0; k < 3; k++)
    {
        e[k] = item->center[k] - w->center[k];
    }
    distance = sss_hao__max(sss_hao__length(e) - w->radius - (double)item->radius, 0.0);
    if (distance > rule->range)
    {
        return;
    }
    if (w->columns + 3 > SSS_HAO__PANEL)
    {
        sss_hao__flush(w);
    }
    for (i = 0; i < 3; i++)
    {
        column[i] = sss_hao__column(w, item->corner[i]);
    }
    w->interactions += 1.0;
    if (sss_hao__small(a, rule->degree2, rule->negligible, (double)item->radius, item->area, distance))
    {
        sss_hao__add_small(w, item, column,
                           sss_hao__small(a, rule->degree1, rule->negligible1, (double)item->radius, item->area,
                                          distance));
        return;
    }
    sss_hao__add_large(w, item, column);
}

static void sss_hao__add_vertex(sss_hao__work *w, const sss_hao__item *item)
{
    if (w->columns == SSS_HAO__PANEL)
    {
        sss_hao__flush(w);
    }
    w->corner[sss_hao__column(w, item->corner[0])] += (float)item->area;
    w->interactions += 1.0;
}

static void sss_hao__traverse(sss_hao__work *w)
{
    const sss_hao__sums *a = w->b->sums;
    uint32_t stack[SSS_HAO__DEPTH];
    size_t depth = 0, i;
    int k;
    if (a->cluster_count > 0)
    {
        stack[depth++] = 0;
    }
    while (depth > 0)
    {
        const uint32_t index = stack[--depth];
        const sss_hao__cluster *t = &a->cluster[index];
        double e[3], distance;
        for (k = 0; k < 3; k++)
        {
            e[k] = t->center[k] - w->center[k];
        }
        distance = sss_hao__length(e) - w->radius;
        if (distance - (double)t->radius > w->rule->range)
        {
            continue;
        }
        if (distance > (double)w->rule->open[index])
        {
            sss_hao__add_cluster(w, index);
            continue;
        }
        if (t->right != 0)
        {
            stack[depth++] = t->right;
            stack[depth++] = index + 1;
            continue;
        }
        for (i = t->first; i < (size_t)t->first + t->count; i++)
        {
            if (a->vertices)
            {
                sss_hao__add_vertex(w, &a->item[i]);
            }
            else
            {
                sss_hao__add_triangle(w, &a->item[i]);
            }
        }
    }
    sss_hao__flush(w);
}

static size_t sss_hao__workspace_bytes(const sss_hao__build *b)
{
    return sizeof(sss_hao__work) + 4 * SSS_HAO__ALIGNMENT
           + (SSS_HAO__CHUNK * SSS_HAO__BAND + b->columns) * sizeof(float);
}

static uintptr_t sss_hao__align(uintptr_t address)
{
    return (address + SSS_HAO__ALIGNMENT - 1) / SSS_HAO__ALIGNMENT * SSS_HAO__ALIGNMENT;
}

// Where receivers are, and where their sums go. Returns 0 where none has an area.
static int sss_hao__begin_group(sss_hao__work *w, float *out)
{
    const sss_hao__build *b = w->b;
    size_t lane, first = w->count, c, used = 0;
    double radius = 0.0;
    int k;
    memset(w->center, 0, sizeof w->center);
    for (lane = 0; lane < w->count; lane++)
    {
        first = b->area[w->receiver[lane]] > 0.0 && first == w->count ? lane : first;
    }
    if (first == w->count)
    {
        return 0;
    }
    for (lane = 0; lane < SSS_HAO__GROUP; lane++) // empty lanes repeat the first one
    {
        const int empty = lane >= w->count || !(b->area[w->receiver[lane]] > 0.0);
        memcpy(w->receiver_x[lane], b->x[w->receiver[empty ? first : lane]], sizeof w->receiver_x[lane]);
        for (k = 0; k < 3 && !empty; k++)
        {
            w->center[k] += w->receiver_x[lane][k];
        }
        used += empty ? 0 : 1;
        for (c = 0; c < b->channels && out != NULL; c++)
        {
            w->out[2 * c + lane / SSS_HAO__LANES][lane % SSS_HAO__LANES] =
                empty ? w->nowhere : out + (lane * b->channels + c) * b->columns;
        }
    }
    for (k = 0; k < 3; k++)
    {
        w->center[k] /= (double)used;
    }
    for (lane = 0; lane < SSS_HAO__GROUP; lane++)
    {
        double e[3];
        for (k = 0; k < 3; k++)
        {
            e[k] = w->receiver_x[lane][k] - w->center[k];
            w->x[k][lane] = (float)e[k];
        }
        radius = sss_hao__max(radius, sss_hao__length(e));
    }
    w->radius = radius * 1.000001;
    return 1;
}

// out or even is NULL. Returns the number of clusters and triangles or vertices.
static double sss_hao__sum_by(const sss_hao__build *b, const sss_hao__rule *rule, const uint32_t *vertices,
                              size_t count, void *workspace, float *out, double *even)
{
    sss_hao__work *w = (sss_hao__work *)sss_hao__align((uintptr_t)workspace);
    memset(w->x, 0, sizeof(sss_hao__work) - offsetof(sss_hao__work, x));
    w->b = b;
    w->rule = rule;
    w->receiver = vertices;
    w->count = count;
    w->halves = count > SSS_HAO__LANES ? 2 : 1;
    w->range = (float)sss_hao__min(rule->range, 1e18);
    w->even_out = even;
    w->packed = (float *)sss_hao__align((uintptr_t)(w + 1));
    w->nowhere = w->packed + SSS_HAO__CHUNK * SSS_HAO__BAND;
    if (out != NULL)
    {
        memset(out, 0, count * b->channels * b->columns * sizeof *out);
        memset(w->nowhere, 0, b->columns * sizeof *out);
    }
    if (sss_hao__begin_group(w, out))
    {
        sss_hao__traverse(w);
    }
    return w->interactions;
}

static void sss_hao__sum_group(const sss_hao__build *b, const uint32_t *vertices, size_t count, void *workspace,
                               float *out)
{
    sss_hao__sum_by(b, &b->sums->rule, vertices, count, workspace, out, NULL);
}

static const uint32_t *sss_hao__sum_order(const sss_hao__build *b)
{
    return b->sums->order;
}

// ---- how small is small ----
// In groups of vertices spread over the mesh the sums are compared with sums by a much stricter rule. Of a fixed
// sequence the loosest rule is taken whose error is at most half the tolerance.

#define SSS_HAO__STEPS_OF_RULE 10   // of the sequence, for triangles and for clusters
#define SSS_HAO__TRIANGLE_STEP 0.7  // from each to the next, of a triangle's radius over d,
#define SSS_HAO__CLUSTER_STEP 0.5   // of what moving the light within a cluster may change
#define SSS_HAO__CLUSTER_SHARE 4.0  // of the tolerance, that one cluster may change in the loosest rule
#define SSS_HAO__TRIANGLE_SHARE 0.1 // the same for a triangle of which corners alone are taken
#define SSS_HAO__TRIANGLE_PART 0.25 // of the tolerance for triangles; errors of the two are independent
#define SSS_HAO__BOTH_PART 0.5      // of the tolerance: what is left is for what the trials do not see
#define SSS_HAO__RENEWED 4          // tries until a stricter rule is computed to compare with,
#define SSS_HAO__TRIANGLE_STRICT 4  // which is so many steps beyond the first of them
#define SSS_HAO__CLUSTER_STRICT 8

typedef struct sss_hao__trials
{
    sss_hao__build *b;
    sss_hao__rule rule, strict;
    size_t count;               // groups
    size_t size[SSS_HAO__TRIALS];
    const uint32_t *vertex[SSS_HAO__TRIALS];
    char *workspace;            // [count]
    float *sum[2];              // [count][GROUP][channels][C] tried, strict
    int kind;                   // which of them is computed; 2: under even light
    double even[SSS_HAO__TRIALS][SSS_HAO__GROUP * 3];
    double interactions[SSS_HAO__TRIALS];
} sss_hao__trials;

// Corners alone and the rule of degree 2 err by the second order where E varies, that of degree 4 by a higher one.
static void sss_hao__set_triangles(sss_hao__rule *rule, double tolerance, int step)
{
    const double scale = pow(SSS_HAO__TRIANGLE_STEP, step);
    rule->degree1 = 0.2 * scale;
    rule->degree2 = 0.8 * sqrt(scale);
    rule->degree4 = 1.4 * sqrt(scale);
    rule->negligible1 = SSS_HAO__TRIANGLE_SHARE * tolerance * scale * scale;
    rule->negligible = tolerance * scale * scale;
}

static void sss_hao__set_clusters(const sss_hao__build *b, sss_hao__rule *rule, int step, float *open)
{
    const double share = SSS_HAO__CLUSTER_SHARE * b->options.tolerance * pow(SSS_HAO__CLUSTER_STEP, step);
    size_t i;
    rule->open = open;
    sss_hao__set_open(b->sums, share, open);
    for (i = 0; i < b->sums->cluster_count && b->options.sums == SSS_HAO_ALL_PAIRS; i++)
    {
        open[i] = INFINITY;
    }
}

static void sss_hao__sum_trial_task(void *context, size_t begin, size_t end)
{
    sss_hao__trials *t = (sss_hao__trials *)context;
    const size_t bytes = sss_hao__workspace_bytes(t->b), row = t->b->channels * t->b->columns;
    const sss_hao__rule *rule = t->kind == 0 ? &t->rule : &t->strict;
    size_t i;
    for (i = begin; i < end; i++)
    {
        float *out = t->kind < 2 ? t->sum[t->kind] + i * SSS_HAO__GROUP * row : NULL;
        memset(t->even[i], 0, sizeof t->even[i]);
        t->interactions[i] = sss_hao__sum_by(t->b, rule, t->vertex[i], t->size[i], t->workspace + i * bytes, out,
                                             t->kind < 2 ? NULL : t->even[i]);
    }
}

static void sss_hao__run_trials(sss_hao__trials *t, int kind)
{
    t->kind = kind;
    sss_hao__parallel(&t->b->memory.hooks, t->count, sss_hao__sum_trial_task, t);
}

// Relative L2 of what was tried against what is strict, of the worst channel.
static double sss_hao__trial_error(const sss_hao__trials *t)
{
    const size_t C = t->b->columns;
    double worst = 0.0;
    size_t c, i, j, k;
    for (c = 0; c < t->b->channels; c++)
    {
        double error = 0.0, sum = 0.0;
        for (i = 0; i < t->count; i++)
        {
            for (j = 0; j < t->size[i]; j++)
            {
                const size_t row = ((i * SSS_HAO__GROUP + j) * t->b->channels + c) * C;
                for (k = 0; k < C; k++)
                {
                    const double e = (double)t->sum[0][row + k] - (double)t->sum[1][row + k];
                    error += e * e;
                    sum += (double)t->sum[1][row + k] * (double)t->sum[1][row + k];
                }
            }
        }
        worst = sum > 0.0 ? sss_hao__max(worst, sqrt(error / sum)) : worst;
    }
    return worst;
}

static sss_result sss_hao__begin_trials(sss_hao__build *b, sss_hao__trials *t)
{
    const size_t groups = (b->vertex_count + SSS_HAO__GROUP - 1) / SSS_HAO__GROUP;
    size_t i;
    t->b = b;
    t->count = (groups + SSS_HAO__TRIAL_EVERY - 1) / SSS_HAO__TRIAL_EVERY;
    t->count = t->count < SSS_HAO__TRIALS ? t->count : SSS_HAO__TRIALS;
    for (i = 0; i < t->count; i++)
    {
        const size_t first = (2 * i + 1) * groups / (2 * t->count) * SSS_HAO__GROUP;
        const size_t left = b->vertex_count - first;
        t->size[i] = left < SSS_HAO__GROUP ? left : SSS_HAO__GROUP;
        t->vertex[i] = b->sums->order + first;
    }
    t->workspace = (char *)sss_hao__take(&b->memory, t->count, sss_hao__workspace_bytes(b));
    for (i = 0; i < 2; i++)
    {
        t->sum[i] = (float *)sss_hao__take(&b->memory, t->count * SSS_HAO__GROUP * b->channels * b->columns,
                                           sizeof(float));
    }
    return t->workspace == NULL || t->sum[0] == NULL || t->sum[1] == NULL ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}

// How finely triangles are cut, beside the same clusters.
static void sss_hao__choose_triangles(sss_hao__trials *t)
{
    const double tolerance = t->b->options.tolerance;
    int i;
    sss_hao__set_clusters(t->b, &t->rule, 2, t->b->sums->open[0]);
    t->strict.open = t->rule.open;
    for (i = 0; i < SSS_HAO__STEPS_OF_RULE; i++)
    {
        if (i % SSS_HAO__RENEWED == 0)
        {
            sss_hao__set_triangles(&t->strict, tolerance, i + SSS_HAO__TRIANGLE_STRICT);
            sss_hao__run_trials(t, 1);
        }
        sss_hao__set_triangles(&t->rule, tolerance, i);
        sss_hao__run_trials(t, 0);
        if (t->b->sums->vertices || sss_hao__trial_error(t) <= SSS_HAO__TRIANGLE_PART * tolerance)
        {
            break;
        }
    }
}

// How large clusters are; the error is then that of both.
static void sss_hao__choose_clusters(sss_hao__trials *t)
{
    sss_hao__build *b = t->b;
    size_t n;
    int i;
    for (i = 0; i < SSS_HAO__STEPS_OF_RULE; i++)
    {
        if (i % SSS_HAO__RENEWED == 0)
        {
            sss_hao__set_clusters(b, &t->strict, i + SSS_HAO__CLUSTER_STRICT, b->sums->open[1]);
            sss_hao__run_trials(t, 1);
        }
        sss_hao__set_clusters(b, &t->rule, i, b->sums->open[0]);
        sss_hao__run_trials(t, 0);
        b->stats.sum_error = sss_hao__trial_error(t);
        if (b->stats.sum_error <= SSS_HAO__BOTH_PART * b->options.tolerance || b->options.sums == SSS_HAO_ALL_PAIRS)
        {
            break;
        }
    }
    for (n = 0; n < t->count; n++)
    {
        b->stats.mean_interactions += t->interactions[n] / (double)t->count;
    }
}

// Share of int R_d dA that lies beyond the range.
static void sss_hao__measure_range(sss_hao__trials *t)
{
    sss_hao__build *b = t->b;
    double cut[SSS_HAO__TRIALS][SSS_HAO__GROUP * 3];
    double sum[3] = {0.0, 0.0, 0.0};
    size_t i, j, c, n = 0;
    sss_hao__run_trials(t, 2);
    memcpy(cut, t->even, sizeof cut);
    t->strict.range = INFINITY;
    sss_hao__run_trials(t, 2);
    for (i = 0; i < t->count; i++)
    {
        for (j = 0; j < t->size[i]; j++)
        {
            if (b->area[t->vertex[i][j]] > 0.0)
            {
                n++;
                for (c = 0; c < b->channels; c++)
                {
                    const double whole = t->even[i][3 * j + c];
                    const double left = whole > 0.0 ? sss_hao__max(1.0 - cut[i][3 * j + c] / whole, 0.0) : 0.0;
                    sum[c] += left;
                    b->stats.truncated_worst = sss_hao__max(b->stats.truncated_worst, left);
                }
            }
        }
    }
    for (c = 0; c < b->channels && n > 0; c++)
    {
        b->stats.truncated_energy = sss_hao__max(b->stats.truncated_energy, sum[c] / (double)n);
    }
}

// Beyond the distance of any two points (the box has a diagonal below 2) a range changes nothing.
#define SSS_HAO__EVERYWHERE 2.0

static sss_result sss_hao__prepare_sums(sss_hao__build *b)
{
    sss_hao__sums *a = (sss_hao__sums *)sss_hao__take(&b->memory, 1, sizeof *a);
    sss_hao__trials *t = (sss_hao__trials *)sss_hao__take(&b->memory, 1, sizeof *t);
    sss_result result;
    if (a == NULL || t == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    b->sums = a;
    a->lanes = sss_hao__lanes_here();
    a->vertices = b->options.quadrature != SSS_HAO_TRIANGLES;
    a->own = b->options.quadrature == SSS_HAO_VERTICES;
    result = sss_hao__make_kernels(b, a);
    result = result == SSS_OK ? sss_hao__make_order(b, a) : result;
    result = result == SSS_OK ? sss_hao__make_clusters(b, a) : result;
    result = result == SSS_OK ? sss_hao__begin_trials(b, t) : result;
    if (result != SSS_OK)
    {
        return result;
    }
    b->range = b->options.range > 0.0 ? b->options.range / b->mm
                                      : sss_hao__range_for(a, b->channels, b->options.tolerance);
    b->stats.range = b->range * b->mm;
    t->rule.range = t->strict.range = b->range < SSS_HAO__EVERYWHERE ? b->range : INFINITY;
    sss_hao__choose_triangles(t);
    sss_hao__choose_clusters(t);
    a->rule = t->rule;
    if (a->rule.range < SSS_HAO__EVERYWHERE)
    {
        sss_hao__measure_range(t);
    }
    sss_hao__drop(&b->memory, a->open[1]);
    sss_hao__drop(&b->memory, t->sum[0]);
    sss_hao__drop(&b->memory, t->sum[1]);
    sss_hao__drop(&b->memory, t->workspace);
    sss_hao__drop(&b->memory, t);
    return SSS_OK;
}

// ---- reference points (4.2) ----
// A subset of the vertices, chosen by half-edge collapses u -> v in the order of their quadric error (Garland and
// Heckbert 1997), least first. What is interpolated between references depends on where a point is and which way the
// surface looks there, also where it is flat. So the quadric of a point has three parts: planes, as there; with
// SSS_HAO__SPREAD the point itself, by which references spread evenly; with SSS_HAO__BEND its normal, by which they are
// denser where the surface bends (attributes as in Garland and Heckbert 1998). The error of the horse's B in marble, of
// all that harmonics of order 3 do not take, with 884 references: planes alone .0065 at 20 mm and .0302 at 100 mm; with
// SPREAD .0055 and .0308; with both .0058 and .0275. The bunny's with 1,607: .0069 and .0297, .0060 and .0293, .0056
// and .0244.
//
// Vertices that went hang on triangles of what is left (as in Lee et al. 1998): they are handed on with every collapse,
// among the triangles around v only, so that none gets to another part of the surface that happens to be near.
//
// Vertices at one position are one point here, so that a seam is no border. They have the same integrals.

#define SSS_HAO__SPREAD 0.03       // weight of squared distances along the surface; across it it is 1
#define SSS_HAO__BEND 0.5          // weight of squared differences of normals, in mean areas of references
#define SSS_HAO__CREASE 1.0        // weight of planes that hold borders and creases
#define SSS_HAO__CREASE_COSINE 0.5 // triangles that meet at more than 60 degrees make a crease
#define SSS_HAO__FLIP_COSINE 0.2   // collapses that turn a triangle by more than 78 degrees wait
#define SSS_HAO__AWAY_COSINE (-.5) // so do those that give a triangle a corner that looks away from it by 120 degrees
#define SSS_HAO__VALENCE 64        // triangles at a point; collapses that make more wait, so that each has bounded work
#define SSS_HAO__SMALL_COMPONENT 8 // points: it may lose its topology, being smaller than the spacing
#define SSS_HAO__FACETS 128        // triangles tried for a vertex that is handed on
#define SSS_HAO__SETTLE_STEPS 8    // steps to a better neighbouring triangle in the end
#define SSS_HAO__PASSES 64         // over what the last stage leaves: more are needed only where points of more than
                                   // SSS_HAO__VALENCE triangles are each other's neighbours

// What collapses must keep, in stages: each is over when nothing is left to collapse.
#define SSS_HAO__KEEP_TOPOLOGY 0   // no triangle turns, nothing is pinched
#define SSS_HAO__KEEP_NORMALS 1    // no triangle turns
#define SSS_HAO__KEEP_VALENCE 2    // work is bounded
#define SSS_HAO__KEEP_NOTHING 3    // components end as one point
#define SSS_HAO__STAGES 4

typedef struct sss_hao__simplifier
{
    size_t points, triangles;
    size_t live, target;       // points: still there, wanted
    int stage;
    uint32_t *vertex;          // [points] of the mesh: that of the largest area among those at the position
    double (*x)[3];            // [points] the diagonal of their box is 1
    float (*normal)[3];        // [points] unit length: of the mesh as it was
    double (*quadric)[14];     // [points] x A x + 2 b x + c: A (00, 01, 02, 11, 12, 22), b, c; then sums of
                               // area times normal, and of area
    double bend;               // weight of the normals' part, in areas
    uint32_t (*corner)[3];     // [triangles] points; SSS_HAO__NONE first: the triangle is gone
    uint32_t *first, *next;    // [points], [3 triangles]: lists of the corners 3 t + k at a point
    uint32_t *valence;         // [points] how many are there, without those gone; 0: the point went
    unsigned char *border;     // [points] at an edge without two triangles
    uint32_t *component;       // [points] its first point
    uint32_t *members;         // [points] there: how many live
    uint32_t *mark, *tally;    // [points] scratch of a walk around a point, valid where mark is the current stamp
    uint32_t stamp;
    double *key;               // [points] least cost of a collapse, and
    uint32_t *aim;             // [points] into what; SSS_HAO__NONE: cheaper ones were not allowed, or there is none
    uint32_t *heap, *place;    // [points] heap of points; where each is in it, or SSS_HAO__NONE
    size_t heap_count;
    uint32_t *parent;          // [points] what a point went into; itself while it is there
    uint32_t *triangle;        // [points] that a point hangs on; it may be gone in the end
    uint32_t *first_hanging, *next_hanging; // [triangles], [points]: who hangs on it
    uint32_t *star;            // [triangles] scratch: triangles around a point
    double (*weight)[3];       // [points] in the end
} sss_hao__simplifier;

static uint64_t sss_hao__scramble(uint64_t a, uint64_t b, uint64_t c)
{
    uint64_t h = a * 0x9e3779b97f4a7c15u + b; // odd constants of Steele, Lea and Flood 2014 (SplitMix)
    h = (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9u + c;
    h = (h ^ (h >> 32)) * 0x94d049bb133111ebu;
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
    return h ^ (h >> 31);
}

static size_t sss_hao__table_size(size_t count)
{
    size_t size = 16;
    while (size < 2 * count)
    {
        size *= 2;
    }
    return size;
}

// ---- points and triangles ----

// The float's bits, with one zero only.
static uint32_t sss_hao__position_bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits == 0x80000000u ? 0u : bits;
}

static int sss_hao__same_position(const float *a, const float *b)
{
    return !(a[0] < b[0] || a[0] > b[0] || a[1] < b[1] || a[1] > b[1] || a[2] < b[2] || a[2] > b[2]);
}

// Areas of vertices, in mesh units: they decide who gets light. Products of floats neither over- nor underflow here.
static void sss_hao__add_areas(const sss_mesh *mesh, double *area)
{
    size_t t;
    int i, k;
    for (t = 0; t < mesh->triangle_count; t++)
    {
        const uint32_t *v = mesh->triangles + 3 * t;
        double e[2][3], n[3];
        for (k = 0; k < 2; k++)
        {
            for (i = 0; i < 3; i++)
            {
                e[k][i] = (double)mesh->positions[3 * (size_t)v[k + 1] + (size_t)i] -
                          (double)mesh->positions[3 * (size_t)v[0] + (size_t)i];
            }
        }
        sss_hao__cross(e[0], e[1], n);
        for (k = 0; k < 3; k++)
        {
            area[v[k]] += sss_hao__length(n) / 6.0;
        }
    }
}

// point[V]: its point, SSS_HAO__NONE for vertices without area. Fills s->vertex and s->points.
static sss_result sss_hao__weld_points(sss_hao__memory *m, const sss_mesh *mesh, sss_hao__simplifier *s,
                                       uint32_t *point)
{
    const size_t V = mesh->vertex_count, size = sss_hao__table_size(V);
    uint32_t *table = (uint32_t *)sss_hao__take(m, size, sizeof *table);
    double *area = (double *)sss_hao__take(m, V, sizeof *area);
    size_t v, at;
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_hao__add_areas(mesh, area);
    memset(table, 255, size * sizeof *table);
    for (v = 0; v < V; v++)
    {
        const float *x = mesh->positions + 3 * v;
        point[v] = SSS_HAO__NONE;
        if (!(area[v] > 0.0))
        {
            continue;
        }
        at = (size_t)sss_hao__scramble(sss_hao__position_bits(x[0]), sss_hao__position_bits(x[1]),
                                       sss_hao__position_bits(x[2])) & (size - 1);
        while (table[at] != SSS_HAO__NONE &&
               !sss_hao__same_position(mesh->positions + 3 * (size_t)s->vertex[table[at]], x))
        {
            at = (at + 1) & (size - 1); // at most half of the table is taken
        }
        if (table[at] == SSS_HAO__NONE)
        {
            table[at] = (uint32_t)s->points;
            s->vertex[s->points++] = (uint32_t)v;
        }
        point[v] = table[at];
        if (area[v] > area[s->vertex[table[at]]])
        {
            s->vertex[table[at]] = (uint32_t)v;
        }
    }
    sss_hao__drop(m, table);
    sss_hao__drop(m, area);
    return SSS_OK;
}

// Into the unit box: nothing over- or underflows there.
static void sss_hao__place_points(const sss_mesh *mesh, sss_hao__simplifier *s)
{
    double low[3] = {0.0, 0.0, 0.0}, high[3] = {0.0, 0.0, 0.0}, diagonal;
    size_t p;
    int i;
    for (p = 0; p < s->points; p++)
    {
        for (i = 0; i < 3; i++)
        {
            const double x = (double)mesh->positions[3 * (size_t)s->vertex[p] + (size_t)i];
            s->x[p][i] = x;
            low[i] = p == 0 ? x : sss_hao__min(low[i], x);
            high[i] = p == 0 ? x : sss_hao__max(high[i], x);
        }
    }
    for (i = 0; i < 3; i++)
    {
        high[i] -= low[i];
        low[i] += 0.5 * high[i];
    }
    diagonal = sss_hao__length(high); // floats squared: far from the ends of double
    for (p = 0; p < s->points; p++)
    {
        for (i = 0; i < 3; i++)
        {
            s->x[p][i] = diagonal > 0.0 ? (s->x[p][i] - low[i]) / diagonal : 0.0;
        }
    }
}

static void sss_hao__sort_3(uint32_t a[3])
{
    int i;
    for (i = 0; i < 3; i++)
    {
        const int j = i == 1 ? 1 : 0;
        if (a[j] > a[j + 1])
        {
            const uint32_t swap = a[j];
            a[j] = a[j + 1];
            a[j + 1] = swap;
        }
    }
}

// Triangles between points, each set of three corners once.
static sss_result sss_hao__copy_triangles(sss_hao__memory *m, const sss_mesh *mesh, const uint32_t *point,
                                          sss_hao__simplifier *s)
{
    const size_t size = sss_hao__table_size(mesh->triangle_count);
    uint32_t *table = (uint32_t *)sss_hao__take(m, size, sizeof *table);
    size_t t, at;
    if (table == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    memset(table, 255, size * sizeof *table);
    for (t = 0; t < mesh->triangle_count; t++)
    {
        const uint32_t *v = mesh->triangles + 3 * t;
        const uint32_t c[3] = {point[v[0]], point[v[1]], point[v[2]]};
        uint32_t sorted[3] = {c[0], c[1], c[2]}, other[3];
        if (c[0] == SSS_HAO__NONE || c[1] == SSS_HAO__NONE || c[2] == SSS_HAO__NONE || c[0] == c[1] ||
            c[1] == c[2] || c[2] == c[0])
        {
            continue;
        }
        sss_hao__sort_3(sorted);
        at = (size_t)sss_hao__scramble(sorted[0], sorted[1], sorted[2]) & (size - 1);
        while (table[at] != SSS_HAO__NONE)
        {
            memcpy(other, s->corner[table[at]], sizeof other);
            sss_hao__sort_3(other);
            if (memcmp(other, sorted, sizeof other) == 0)
            {
                break;
            }
            at = (at + 1) & (size - 1);
        }
        if (table[at] == SSS_HAO__NONE)
        {
            table[at] = (uint32_t)s->triangles;
            memcpy(s->corner[s->triangles++], c, sizeof c);
        }
    }
    sss_hao__drop(m, table);
    return SSS_OK;
}

static void sss_hao__link(sss_hao__simplifier *s, uint32_t p, uint32_t corner)
{
    s->next[corner] = s->first[p];
    s->first[p] = corner;
    s->valence[p]++;
}

static uint32_t sss_hao__root(uint32_t *parent, uint32_t p)
{
    while (parent[p] != p)
    {
        parent[p] = parent[parent[p]]; // path halving (Tarjan and van Leeuwen 1984)
        p = parent[p];
    }
    return p;
}

static void sss_hao__connect(sss_hao__simplifier *s)
{
    uint32_t t, p;
    int k;
    memset(s->first, 255, s->points * sizeof *s->first);
    for (p = 0; p < s->points; p++)
    {
        s->parent[p] = p;
        s->component[p] = p;
    }
    for (t = (uint32_t)s->triangles; t-- > 0;) // backwards, so that lists go forwards
    {
        for (k = 0; k < 3; k++)
        {
            uint32_t a = sss_hao__root(s->component, s->corner[t][0]);
            const uint32_t b = sss_hao__root(s->component, s->corner[t][k]);
            const uint32_t low = a < b ? a : b;
            a = a < b ? b : a;
            s->component[a] = low;
            sss_hao__link(s, s->corner[t][k], 3 * t + (uint32_t)k);
        }
    }
    for (p = 0; p < s->points; p++)
    {
        s->component[p] = sss_hao__root(s->component, p);
        s->members[s->component[p]]++;
    }
}

// First corner of a list, from the link on, that is not gone; the list forgets those on the way.
static uint32_t sss_hao__living(sss_hao__simplifier *s, uint32_t *link)
{
    while (*link != SSS_HAO__NONE && s->corner[*link / 3][0] == SSS_HAO__NONE)
    {
        *link = s->next[*link];
    }
    return *link;
}

static void sss_hao__new_stamp(sss_hao__simplifier *s)
{
    if (s->stamp >= UINT32_MAX - 2)
    {
        memset(s->mark, 0, s->points * sizeof *s->mark);
        s->stamp = 0;
    }
    s->stamp += 2; // a walk may use the one before as well
}

// ---- quadrics ----

static void sss_hao__triangle_normal(const sss_hao__simplifier *s, const uint32_t c[3], double n[3])
{
    double e[2][3];
    int i;
    for (i = 0; i < 3; i++)
    {
        e[0][i] = s->x[c[1]][i] - s->x[c[0]][i];
        e[1][i] = s->x[c[2]][i] - s->x[c[0]][i];
    }
    sss_hao__cross(e[0], e[1], n);
}

// weight times the squared distance from the plane through x with unit normal n.
static void sss_hao__add_plane_quadric(double q[10], const double x[3], const double n[3], double weight)
{
    const double d = -sss_hao__dot(n, x);
    int i, j, k = 0;
    for (i = 0; i < 3; i++)
    {
        for (j = i; j < 3; j++)
        {
            q[k++] += weight * n[i] * n[j];
        }
        q[6 + i] += weight * n[i] * d;
    }
    q[9] += weight * d * d;
}

// weight times the squared distance from x.
static void sss_hao__add_point_quadric(double q[10], const double x[3], double weight)
{
    int i;
    q[0] += weight;
    q[3] += weight;
    q[5] += weight;
    for (i = 0; i < 3; i++)
    {
        q[6 + i] -= weight * x[i];
    }
    q[9] += weight * sss_hao__dot(x, x);
}

static double sss_hao__quadric_at(const double q[10], const double x[3])
{
    return x[0] * (q[0] * x[0] + 2.0 * (q[1] * x[1] + q[2] * x[2] + q[6])) +
           x[1] * (q[3] * x[1] + 2.0 * (q[4] * x[2] + q[7])) + x[2] * (q[5] * x[2] + 2.0 * q[8]) + q[9];
}

// Triangles at the edge a b, up to three; their corners are counted at a, which should have the shorter list.
static int sss_hao__edge_triangles(sss_hao__simplifier *s, uint32_t a, uint32_t b, uint32_t found[3])
{
    int count = 0;
    uint32_t c;
    for (c = s->first[a]; c != SSS_HAO__NONE && count < 3; c = s->next[c])
    {
        const uint32_t *v = s->corner[c / 3];
        if (v[0] == b || v[1] == b || v[2] == b)
        {
            found[count++] = c / 3;
        }
    }
    return count;
}

// Borders and creases: planes through the edge, perpendicular to the triangle (Garland and Heckbert 1997, section 6).
static void sss_hao__add_crease(sss_hao__simplifier *s, uint32_t t, int k, const double normal[3])
{
    const uint32_t a = s->corner[t][k], b = s->corner[t][(k + 1) % 3];
    uint32_t found[3];
    double edge[3], other[3], across[3], length2;
    const int shorter = s->valence[a] <= s->valence[b];
    const int count = sss_hao__edge_triangles(s, shorter ? a : b, shorter ? b : a, found);
    int i;
    if (count == 2)
    {
        sss_hao__triangle_normal(s, s->corner[found[0] == t ? found[1] : found[0]], other);
        sss_hao__normalize(other);
        if (sss_hao__dot(normal, other) > SSS_HAO__CREASE_COSINE)
        {
            return;
        }
    }
    else
    {
        s->border[a] = 1;
        s->border[b] = 1;
    }
    for (i = 0; i < 3; i++)
    {
        edge[i] = s->x[b][i] - s->x[a][i];
    }
    length2 = sss_hao__dot(edge, edge);
    sss_hao__cross(edge, normal, across);
    sss_hao__normalize(across);
    sss_hao__add_plane_quadric(s->quadric[a], s->x[a], across, SSS_HAO__CREASE * length2);
    sss_hao__add_plane_quadric(s->quadric[b], s->x[a], across, SSS_HAO__CREASE * length2);
}

static void sss_hao__make_quadrics(sss_hao__simplifier *s)
{
    double n[3], area, total = 0.0;
    uint32_t t, p;
    int i, k;
    for (t = 0; t < s->triangles; t++)
    {
        const uint32_t *c = s->corner[t];
        sss_hao__triangle_normal(s, c, n);
        area = 0.5 * sss_hao__length(n);
        total += area;
        sss_hao__normalize(n);
        for (k = 0; k < 3; k++)
        {
            double *q = s->quadric[c[k]];
            sss_hao__add_plane_quadric(q, s->x[c[0]], n, area / 3.0);
            sss_hao__add_point_quadric(q, s->x[c[k]], SSS_HAO__SPREAD * area / 3.0);
            sss_hao__add_crease(s, t, k, n);
            for (i = 0; i < 3; i++)
            {
                q[10 + i] += area / 3.0 * n[i];
            }
            q[13] += area / 3.0;
        }
    }
    s->bend = SSS_HAO__BEND * total / sss_hao__max((double)s->target, 1.0);
    for (p = 0; p < s->points; p++)
    {
        double *q = s->quadric[p];
        sss_hao__normalize(q + 10);
        for (i = 0; i < 3; i++)
        {
            s->normal[p][i] = (float)q[10 + i];
            q[10 + i] *= q[13];
        }
    }
}

// ---- the heap of collapses ----

static int sss_hao__sooner(const sss_hao__simplifier *s, uint32_t a, uint32_t b)
{
    return s->key[a] < s->key[b] || (!(s->key[b] < s->key[a]) && a < b);
}

static void sss_hao__sift(sss_hao__simplifier *s, size_t at)
{
    const uint32_t p = s->heap[at];
    while (at > 0 && sss_hao__sooner(s, p, s->heap[(at - 1) / 2]))
    {
        s->heap[at] = s->heap[(at - 1) / 2];
        s->place[s->heap[at]] = (uint32_t)at;
        at = (at - 1) / 2;
    }
    for (;;)
    {
        size_t child = 2 * at + 1;
        if (child + 1 < s->heap_count && sss_hao__sooner(s, s->heap[child + 1], s->heap[child]))
        {
            child++;
        }
        if (child >= s->heap_count || !sss_hao__sooner(s, s->heap[child], p))
        {
            break;
        }
        s->heap[at] = s->heap[child];
        s->place[s->heap[at]] = (uint32_t)at;
        at = child;
    }
    s->heap[at] = p;
    s->place[p] = (uint32_t)at;
}

// Infinite: takes the point out.
static void sss_hao__set_key(sss_hao__simplifier *s, uint32_t p, double key)
{
    size_t at = s->place[p];
    s->key[p] = key;
    if (sss_hao__finite(key))
    {
        if (at == SSS_HAO__NONE)
        {
            at = s->heap_count++;
            s->heap[at] = p;
        }
        sss_hao__sift(s, at);
    }
    else if (at != SSS_HAO__NONE)
    {
        s->place[p] = SSS_HAO__NONE;
        s->heap_count--;
        if (at < s->heap_count)
        {
            s->heap[at] = s->heap[s->heap_count];
            sss_hao__sift(s, at);
        }
    }
}

// ---- which collapses are allowed ----

static int sss_hao__has_corner(const uint32_t c[3], uint32_t p)
{
    return c[0] == p || c[1] == p || c[2] == p;
}

// Whether a triangle of u would turn too far, or lose its area, or get v for a corner where the surface looks the other
// way: it would be on the other side of a thin part.
static int sss_hao__turns(sss_hao__simplifier *s, uint32_t u, uint32_t v)
{
    uint32_t c;
    for (c = sss_hao__living(s, &s->first[u]); c != SSS_HAO__NONE; c = sss_hao__living(s, &s->next[c]))
    {
        const uint32_t *old = s->corner[c / 3];
        uint32_t moved[3] = {old[0], old[1], old[2]};
        const float *n = s->normal[v];
        double before[3], after[3], size, along;
        if (sss_hao__has_corner(old, v))
        {
            continue;
        }
        moved[c % 3] = v;
        sss_hao__triangle_normal(s, old, before);
        sss_hao__triangle_normal(s, moved, after);
        size = sss_hao__length(before) * sss_hao__length(after);
        if (sss_hao__length(before) > 0.0 && !(sss_hao__dot(before, after) > SSS_HAO__FLIP_COSINE * size))
        {
            return 1;
        }
        along = after[0] * (double)n[0] + after[1] * (double)n[1] + after[2] * (double)n[2];
        if (along < SSS_HAO__AWAY_COSINE * sss_hao__length(after))
        {
            return 1;
        }
    }
    return 0;
}

// Whether v has a triangle with corners a and b.
static int sss_hao__has_triangle(sss_hao__simplifier *s, uint32_t v, uint32_t a, uint32_t b)
{
    uint32_t c;
    for (c = sss_hao__living(s, &s->first[v]); c != SSS_HAO__NONE; c = sss_hao__living(s, &s->next[c]))
    {
        if (sss_hao__has_corner(s->corner[c / 3], a) && sss_hao__has_corner(s->corner[c / 3], b))
        {
            return 1;
        }
    }
    return 0;
}

// The link condition (Dey et al. 1999): u and v have no common neighbours but the third corners of the triangles at the
// edge u v; no triangle would come twice; no point would lose its last triangle; two borders do not meet inside.
static int sss_hao__pinches(sss_hao__simplifier *s, uint32_t u, uint32_t v)
{
    uint32_t c, shared = 0, third = 0, common = 0;
    int k;
    sss_hao__new_stamp(s);
    for (c = sss_hao__living(s, &s->first[u]); c != SSS_HAO__NONE; c = sss_hao__living(s, &s->next[c]))
    {
        const uint32_t *w = s->corner[c / 3];
        const int at_edge = sss_hao__has_corner(w, v);
        shared += (uint32_t)at_edge;
        for (k = 0; k < 3; k++)
        {
            if (w[k] == u || w[k] == v)
            {
                continue;
            }
            if (at_edge && s->valence[w[k]] < 2)
            {
                return 1;
            }
            if (s->mark[w[k]] != s->stamp)
            {
                s->mark[w[k]] = s->stamp;
                s->tally[w[k]] = 0;
            }
            third += (uint32_t)(at_edge && s->tally[w[k]] == 0);
            s->tally[w[k]] |= (uint32_t)at_edge;
        }
    }
    if (s->valence[u] + s->valence[v] <= 2 * shared || (s->border[u] && s->border[v] && shared == 2))
    {
        return 1;
    }
    for (c = sss_hao__living(s, &s->first[v]); c != SSS_HAO__NONE; c = sss_hao__living(s, &s->next[c]))
    {
        for (k = 0; k < 3; k++)
        {
            const uint32_t w = s->corner[c / 3][k];
            if (w != u && w != v && s->mark[w] == s->stamp)
            {
                s->mark[w] = s->stamp - 1;
                common++;
            }
        }
    }
    if (common != third)
    {
        return 1;
    }
    for (c = sss_hao__living(s, &s->first[u]); c != SSS_HAO__NONE; c = sss_hao__living(s, &s->next[c]))
    {
        const uint32_t a = s->corner[c / 3][(c + 1) % 3], b = s->corner[c / 3][(c + 2) % 3];
        if (a != v && b != v && s->mark[a] == s->stamp - 1 && s->mark[b] == s->stamp - 1 &&
            sss_hao__has_triangle(s, v, a, b))
        {
            return 1;
        }
    }
    return 0;
}

static int sss_hao__allowed(sss_hao__simplifier *s, uint32_t u, uint32_t v)
{
    const int small = s->members[s->component[u]] <= SSS_HAO__SMALL_COMPONENT;
    const int bounded = s->valence[u] + s->valence[v] <= SSS_HAO__VALENCE;
    if (s->stage == SSS_HAO__KEEP_NOTHING)
    {
        // the smaller goes into the larger, so that a corner changes hands log T times only
        return bounded || s->valence[u] < s->valence[v] || (s->valence[u] == s->valence[v] && u < v);
    }
    return bounded && (small || s->stage > SSS_HAO__KEEP_NORMALS || !sss_hao__turns(s, u, v)) &&
           (small || s->stage > SSS_HAO__KEEP_TOPOLOGY || !sss_hao__pinches(s, u, v));
}

static double sss_hao__cost(const sss_hao__simplifier *s, uint32_t u, uint32_t v)
{
    const double *q = s->quadric[u];
    const float *n = s->normal[v];
    // sum of area |n_i - n|^2 over what went into u; its normals and n have unit length
    const double turn = 2.0 * (q[13] - q[10] * (double)n[0] - q[11] * (double)n[1] - q[12] * (double)n[2]);
    return sss_hao__max(sss_hao__quadric_at(q, s->x[v]), 0.0) + s->bend * sss_hao__max(turn, 0.0); // below by rounding
}

// Least cost of a collapse of u into a neighbour, INFINITY without one; checked: an allowed one only.
static double sss_hao__best(sss_hao__simplifier *s, uint32_t u, int checked, uint32_t *into)
{
    const int others = s->border[u] || s->stage > SSS_HAO__KEEP_TOPOLOGY ? 3 : 2; // inside, each neighbour is the next
    double best = HUGE_VAL;                                                      // corner of one triangle
    uint32_t c, walked = 0;
    int k;
    *into = SSS_HAO__NONE;
    if (s->valence[u] > SSS_HAO__VALENCE && s->stage != SSS_HAO__KEEP_NOTHING)
    {
        return best;
    }
    for (c = sss_hao__living(s, &s->first[u]); c != SSS_HAO__NONE && walked < SSS_HAO__VALENCE;
         c = sss_hao__living(s, &s->next[c]), walked++)
    {
        for (k = 1; k < others; k++)
        {
            const uint32_t v = s->corner[c / 3][(c + (uint32_t)k) % 3];
            double cost;
            if (v == u || v == *into)
            {
                continue;
            }
            cost = sss_hao__cost(s, u, v);
            if ((cost < best || (!(best < cost) && v < *into)) && (!checked || sss_hao__allowed(s, u, v)))
            {
                best = cost;
                *into = v;
            }
        }
    }
    return best;
}

static void sss_hao__renew_key(sss_hao__simplifier *s, uint32_t p)
{
    sss_hao__set_key(s, p, sss_hao__best(s, p, 0, &s->aim[p]));
}

// ---- where vertices hang ----

// A triangle, prepared for finding nearest points in it.
typedef struct sss_hao__facet
{
    double a[3], ab[3], ac[3], normal[3];
    double bb, bc, cc; // products of ab and ac
    int flat;          // has no area to speak of
    uint32_t triangle;
} sss_hao__facet;

static void sss_hao__make_facet(const sss_hao__simplifier *s, uint32_t t, sss_hao__facet *f)
{
    const double thin = 1e-12; // ratio of areas, to that of a square, squared: below it rounding decides what is inside
    const uint32_t *c = s->corner[t];
    int i;
    for (i = 0; i < 3; i++)
    {
        f->a[i] = s->x[c[0]][i];
        f->ab[i] = s->x[c[1]][i] - f->a[i];
        f->ac[i] = s->x[c[2]][i] - f->a[i];
    }
    f->bb = sss_hao__dot(f->ab, f->ab);
    f->bc = sss_hao__dot(f->ab, f->ac);
    f->cc = sss_hao__dot(f->ac, f->ac);
    sss_hao__cross(f->ab, f->ac, f->normal);
    f->flat = !(sss_hao__dot(f->normal, f->normal) > thin * (f->bb + f->cc) * (f->bb + f->cc));
    f->triangle = t;
}

// Squared distance of p from a + y ab + z ac.
static double sss_hao__distance2(const sss_hao__facet *f, const double ap[3], double y, double z)
{
    double d[3];
    int i;
    for (i = 0; i < 3; i++)
    {
        d[i] = ap[i] - y * f->ab[i] - z * f->ac[i];
    }
    return sss_hao__dot(d, d);
}

static double sss_hao__clamp_ratio(double a, double b)
{
    return a <= 0.0 || b <= 0.0 ? 0.0 : (a >= b ? 1.0 : a / b);
}

// Nearest point a + y ab + z ac of the triangle's three edges, for when it is none inside.
static double sss_hao__nearest_on_edges(const sss_hao__facet *f, const double ap[3], double *y, double *z)
{
    const double b = sss_hao__dot(f->ab, ap), c = sss_hao__dot(f->ac, ap);
    const double on_ab = sss_hao__clamp_ratio(b, f->bb), on_ac = sss_hao__clamp_ratio(c, f->cc);
    const double on_bc = sss_hao__clamp_ratio(c - b + f->bb - f->bc, f->bb - 2.0 * f->bc + f->cc);
    const double at[3][2] = {{on_ab, 0.0}, {0.0, on_ac}, {1.0 - on_bc, on_bc}};
    double best = HUGE_VAL;
    int i;
    *y = 0.0;
    *z = 0.0;
    for (i = 0; i < 3; i++)
    {
        const double d2 = sss_hao__distance2(f, ap, at[i][0], at[i][1]);
        if (d2 < best)
        {
            best = d2;
            *y = at[i][0];
            *z = at[i][1];
        }
    }
    return best;
}

// Squared distance of p from the nearest point of the triangle, and that point's barycentric coordinates at b and c.
static double sss_hao__nearest_in(const sss_hao__facet *f, const double p[3], double *y, double *z)
{
    double ap[3], b, c, y_area, z_area, area;
    int i;
    for (i = 0; i < 3; i++)
    {
        ap[i] = p[i] - f->a[i];
    }
    b = sss_hao__dot(f->ab, ap);
    c = sss_hao__dot(f->ac, ap);
    y_area = f->cc * b - f->bc * c; // Cramer's rule for the projection on the plane
    z_area = f->bb * c - f->bc * b;
    area = f->bb * f->cc - f->bc * f->bc;
    if (f->flat || y_area < 0.0 || z_area < 0.0 || y_area + z_area > area)
    {
        return sss_hao__nearest_on_edges(f, ap, y, z);
    }
    *y = y_area / area;
    *z = z_area / area;
    return sss_hao__distance2(f, ap, *y, *z);
}

// Where a point may hang, best so far.
typedef struct sss_hao__spot
{
    uint32_t triangle;
    int agrees; // the triangle looks the same way as the surface at the point
    double distance2, y, z;
} sss_hao__spot;

// Takes the facet where it is better: agreement first, so that nothing hangs on the other side of a thin part.
static void sss_hao__try_facet(const sss_hao__simplifier *s, uint32_t p, const sss_hao__facet *f, sss_hao__spot *spot)
{
    const float *n = s->normal[p];
    const int agrees = (double)n[0] * f->normal[0] + (double)n[1] * f->normal[1] + (double)n[2] * f->normal[2] > 0.0;
    double d2, y, z;
    if (agrees < spot->agrees)
    {
        return;
    }
    d2 = sss_hao__nearest_in(f, s->x[p], &y, &z);
    if (spot->triangle == SSS_HAO__NONE || agrees > spot->agrees || d2 < spot->distance2)
    {
        spot->triangle = f->triangle;
        spot->agrees = agrees;
        spot->distance2 = d2;
        spot->y = y;
        spot->z = z;
    }
}

static void sss_hao__hang(sss_hao__simplifier *s, uint32_t p, uint32_t t)
{
    s->triangle[p] = t;
    s->next_hanging[p] = s->first_hanging[t];
    s->first_hanging[t] = p;
}

// Hands on a list of points to the triangles around v. In the last stage nobody is handed on, for ever longer lists
// could go round and round: parents tell in the end.
static void sss_hao__hand_on(sss_hao__simplifier *s, uint32_t list, uint32_t v)
{
    sss_hao__facet facet[SSS_HAO__FACETS];
    uint32_t c, next, count = 0, i;
    if (s->stage == SSS_HAO__KEEP_NOTHING)
    {
        s->triangle[list] = SSS_HAO__NONE;
        return;
    }
    for (c = sss_hao__living(s, &s->first[v]); c != SSS_HAO__NONE && count < SSS_HAO__FACETS;
         c = sss_hao__living(s, &s->next[c]))
    {
        sss_hao__make_facet(s, c / 3, &facet[count++]);
    }
    for (; list != SSS_HAO__NONE; list = next)
    {
        sss_hao__spot spot = {SSS_HAO__NONE, 0, 0.0, 0.0, 0.0};
        next = s->next_hanging[list];
        for (i = 0; i < count; i++)
        {
            sss_hao__try_facet(s, list, &facet[i], &spot);
        }
        sss_hao__hang(s, list, spot.triangle);
    }
}

// ---- a collapse ----

static void sss_hao__remove_triangle(sss_hao__simplifier *s, uint32_t t)
{
    int k;
    for (k = 0; k < 3; k++)
    {
        s->valence[s->corner[t][k]]--;
    }
    s->corner[t][0] = SSS_HAO__NONE;
}

// Whether each of its corners has another triangle.
static int sss_hao__dispensable(const sss_hao__simplifier *s, uint32_t t)
{
    const uint32_t *c = s->corner[t];
    int j, k;
    for (k = 0; k < 3; k++)
    {
        uint32_t here = 0;
        for (j = 0; j < 3; j++)
        {
            here += (uint32_t)(c[j] == c[k]);
        }
        if (s->valence[c[k]] <= here)
        {
            return 0;
        }
    }
    return 1;
}

// Whether v has another triangle of the same corners in the same order.
static int sss_hao__is_copy(sss_hao__simplifier *s, uint32_t t, uint32_t v)
{
    uint32_t c, d = 0, walked = 0;
    while (s->corner[t][d] != v)
    {
        d++;
    }
    for (c = sss_hao__living(s, &s->first[v]); c != SSS_HAO__NONE && walked < SSS_HAO__VALENCE;
         c = sss_hao__living(s, &s->next[c]), walked++)
    {
        const uint32_t *w = s->corner[c / 3];
        if (c / 3 != t && w[(c + 1) % 3] == s->corner[t][(d + 1) % 3] && w[(c + 2) % 3] == s->corner[t][(d + 2) % 3])
        {
            return 1;
        }
    }
    return 0;
}

// Moves u's corners to v. Triangles that lose their area go, but for the last one of a point, which stays as a segment
// or a point: everything live has a triangle.
static void sss_hao__move_triangles(sss_hao__simplifier *s, uint32_t u, uint32_t v, size_t count)
{
    const int free_topology =
        s->stage > SSS_HAO__KEEP_TOPOLOGY || s->members[s->component[u]] <= SSS_HAO__SMALL_COMPONENT;
    size_t i;
    int k, pass;
    for (pass = 0; pass < 2; pass++) // first those that stay
    {
        for (i = 0; i < count; i++)
        {
            const uint32_t t = s->star[i];
            uint32_t *c = s->corner[t];
            if (c[0] == SSS_HAO__NONE || !sss_hao__has_corner(c, u))
            {
                continue;
            }
            if (pass == 0 && (sss_hao__has_corner(c, v) || c[0] == c[1] || c[1] == c[2] || c[2] == c[0]))
            {
                continue;
            }
            for (k = 0; k < 3; k++)
            {
                if (c[k] == u)
                {
                    c[k] = v;
                    sss_hao__link(s, v, 3 * t + (uint32_t)k);
                }
            }
            if (pass == 0 && free_topology && sss_hao__is_copy(s, t, v))
            {
                sss_hao__remove_triangle(s, t);
            }
        }
    }
    for (i = 0; i < count; i++)
    {
        const uint32_t *c = s->corner[s->star[i]];
        if (c[0] != SSS_HAO__NONE && (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) &&
            sss_hao__dispensable(s, s->star[i]))
        {
            sss_hao__remove_triangle(s, s->star[i]);
        }
    }
}

// New keys for v and its neighbours after u -> v; where there are too many, for v alone: the others' are checked when
// they come up.
static void sss_hao__renew_keys(sss_hao__simplifier *s, uint32_t u, uint32_t v)
{
    uint32_t c;
    int k;
    sss_hao__renew_key(s, v);
    if (s->valence[v] > SSS_HAO__VALENCE)
    {
        return;
    }
    sss_hao__new_stamp(s);
    s->mark[v] = s->stamp;
    for (c = sss_hao__living(s, &s->first[v]); c != SSS_HAO__NONE; c = sss_hao__living(s, &s->next[c]))
    {
        for (k = 0; k < 3; k++)
        {
            const uint32_t w = s->corner[c / 3][k];
            double cost;
            if (s->mark[w] == s->stamp)
            {
                continue;
            }
            s->mark[w] = s->stamp;
            if (s->aim[w] == SSS_HAO__NONE || s->aim[w] == u || s->valence[w] > SSS_HAO__VALENCE)
            {
                sss_hao__renew_key(s, w);
                continue;
            }
            cost = sss_hao__cost(s, w, v); // of its neighbours only v may be new
            if (cost < s->key[w])
            {
                s->aim[w] = v;
                sss_hao__set_key(s, w, cost);
            }
        }
    }
}

static void sss_hao__collapse(sss_hao__simplifier *s, uint32_t u, uint32_t v)
{
    uint32_t c, t, p, list = SSS_HAO__NONE; // of points that lose their triangle
    size_t count = 0;
    int k;
    for (c = sss_hao__living(s, &s->first[u]); c != SSS_HAO__NONE; c = sss_hao__living(s, &s->next[c]))
    {
        t = c / 3;
        while (s->first_hanging[t] != SSS_HAO__NONE && s->stage != SSS_HAO__KEEP_NOTHING)
        {
            p = s->first_hanging[t];
            s->first_hanging[t] = s->next_hanging[p];
            s->next_hanging[p] = list;
            list = p;
        }
        if ((c % 3 < 1 || s->corner[t][0] != u) && (c % 3 < 2 || s->corner[t][1] != u)) // one with u twice comes twice
        {
            s->star[count++] = t;
        }
    }
    s->next_hanging[u] = list;
    sss_hao__move_triangles(s, u, v, count);
    for (k = 0; k < 14; k++)
    {
        s->quadric[v][k] += s->quadric[u][k];
    }
    s->border[v] |= s->border[u];
    s->valence[u] = 0;
    s->first[u] = SSS_HAO__NONE;
    s->parent[u] = v;
    s->members[s->component[u]]--;
    s->live--;
    sss_hao__hand_on(s, u, v);
    sss_hao__renew_keys(s, u, v);
}

// One stage: until enough went or nothing is left that may. A point that comes up and may not go at its key gets the
// cost at which it may, or leaves the heap until something changes around it: each change is paid by a collapse.
static void sss_hao__run_stage(sss_hao__simplifier *s, int stage)
{
    uint32_t p;
    s->stage = stage;
    s->heap_count = 0;
    memset(s->place, 255, s->points * sizeof *s->place);
    for (p = 0; p < s->points; p++)
    {
        if (s->valence[p] > 0)
        {
            sss_hao__renew_key(s, p);
        }
    }
    while (s->live > s->target && s->heap_count > 0)
    {
        uint32_t into;
        double cost;
        p = s->heap[0];
        cost = sss_hao__best(s, p, 1, &into);
        if (cost <= s->key[p] && into != SSS_HAO__NONE)
        {
            sss_hao__set_key(s, p, HUGE_VAL);
            sss_hao__collapse(s, p, into);
        }
        else
        {
            s->aim[p] = SSS_HAO__NONE;
            sss_hao__set_key(s, p, cost);
        }
    }
}

static void sss_hao__simplify(sss_hao__simplifier *s)
{
    int stage, pass;
    for (stage = 0; stage < SSS_HAO__STAGES && s->live > s->target; stage++)
    {
        size_t before = s->live + 1;
        for (pass = 0; pass < (stage == SSS_HAO__KEEP_NOTHING ? SSS_HAO__PASSES : 1) && s->live < before; pass++)
        {
            before = s->live;
            sss_hao__run_stage(s, stage);
        }
    }
}

// ---- the result ----

// Tries the triangles around v, or the first of them.
static void sss_hao__try_star(sss_hao__simplifier *s, uint32_t p, uint32_t v, sss_hao__spot *spot)
{
    sss_hao__facet facet;
    uint32_t c, tried = 0;
    for (c = sss_hao__living(s, &s->first[v]); c != SSS_HAO__NONE && tried < SSS_HAO__VALENCE;
         c = sss_hao__living(s, &s->next[c]), tried++)
    {
        sss_hao__make_facet(s, c / 3, &facet);
        sss_hao__try_facet(s, p, &facet, spot);
    }
}

// From its triangle on over neighbouring ones, as long as they are better.
static void sss_hao__settle(sss_hao__simplifier *s, uint32_t p)
{
    sss_hao__spot spot = {SSS_HAO__NONE, 0, 0.0, 0.0, 0.0};
    sss_hao__facet facet;
    uint32_t t = s->triangle[p];
    int step, k;
    if (t == SSS_HAO__NONE || s->corner[t][0] == SSS_HAO__NONE)
    {
        sss_hao__try_star(s, p, sss_hao__root(s->parent, p), &spot);
    }
    else
    {
        sss_hao__make_facet(s, t, &facet);
        sss_hao__try_facet(s, p, &facet, &spot);
    }
    t = SSS_HAO__NONE;
    for (step = 0; step < SSS_HAO__SETTLE_STEPS && spot.triangle != t; step++)
    {
        t = spot.triangle;
        for (k = 0; k < 3; k++)
        {
            sss_hao__try_star(s, p, s->corner[t][k], &spot);
        }
    }
    s->triangle[p] = spot.triangle;
    s->weight[p][1] = spot.y;
    s->weight[p][2] = spot.z;
    s->weight[p][0] = sss_hao__max(0.0, 1.0 - spot.y - spot.z);
}

// A reference hangs on itself, in a triangle that looks its way where there is one.
static void sss_hao__settle_reference(sss_hao__simplifier *s, uint32_t p)
{
    sss_hao__spot spot = {SSS_HAO__NONE, 0, 0.0, 0.0, 0.0};
    int k = 0;
    sss_hao__try_star(s, p, p, &spot);
    s->triangle[p] = spot.triangle;
    while (s->corner[spot.triangle][k] != p)
    {
        k++;
    }
    s->weight[p][k] = 1.0;
}

static void sss_hao__settle_all(sss_hao__simplifier *s)
{
    uint32_t p;
    for (p = 0; p < s->points; p++)
    {
        if (s->valence[p] > 0)
        {
            sss_hao__settle_reference(s, p);
        }
        else
        {
            sss_hao__settle(s, p);
        }
    }
}

// Numbers a triangle and, where they have none yet, its references.
static uint32_t sss_hao__write_triangle(const sss_hao__simplifier *s, const uint32_t corner[3],
                                        uint32_t *reference_number, sss_hao__references *out)
{
    int k;
    for (k = 0; k < 3; k++)
    {
        if (reference_number[corner[k]] == SSS_HAO__NONE)
        {
            reference_number[corner[k]] = (uint32_t)out->count;
            out->vertex[out->count++] = s->vertex[corner[k]];
        }
        out->corner[out->triangle_count][k] = reference_number[corner[k]];
    }
    return (uint32_t)out->triangle_count++;
}

// The same for the first of the vertices without light, on which all of them hang.
static uint32_t sss_hao__write_dark(uint32_t vertex, sss_hao__references *out)
{
    int k;
    for (k = 0; k < 3; k++)
    {
        out->corner[out->triangle_count][k] = (uint32_t)out->count;
    }
    out->vertex[out->count++] = vertex;
    return (uint32_t)out->triangle_count++;
}

// In the order in which vertices come to triangles and these to references, so that neighbours are near in memory.
static void sss_hao__write_vertices(const sss_hao__simplifier *s, const uint32_t *point, size_t vertex_count,
                                    uint32_t *triangle_number, uint32_t *reference_number, sss_hao__references *out)
{
    uint32_t dark = SSS_HAO__NONE;
    size_t v;
    int k;
    memset(triangle_number, 255, s->triangles * sizeof *triangle_number);
    memset(reference_number, 255, s->points * sizeof *reference_number);
    for (v = 0; v < vertex_count; v++)
    {
        const uint32_t p = point[v];
        if (p == SSS_HAO__NONE)
        {
            dark = dark == SSS_HAO__NONE ? sss_hao__write_dark((uint32_t)v, out) : dark;
            out->triangle[v] = dark;
            out->weight[v][0] = 1.0f;
            continue;
        }
        if (triangle_number[s->triangle[p]] == SSS_HAO__NONE)
        {
            triangle_number[s->triangle[p]] =
                sss_hao__write_triangle(s, s->corner[s->triangle[p]], reference_number, out);
        }
        out->triangle[v] = triangle_number[s->triangle[p]];
        for (k = 0; k < 3; k++)
        {
            out->weight[v][k] = (float)s->weight[p][k];
        }
    }
}

static sss_result sss_hao__write_references(sss_hao__memory *m, const sss_hao__simplifier *s, const uint32_t *point,
                                            size_t vertex_count, sss_hao__references *out)
{
    uint32_t *triangle_number = (uint32_t *)sss_hao__take(m, s->triangles, sizeof *triangle_number);
    uint32_t *reference_number = (uint32_t *)sss_hao__take(m, s->points, sizeof *reference_number);
    size_t t, triangles = 1;
    for (t = 0; t < s->triangles; t++)
    {
        triangles += s->corner[t][0] != SSS_HAO__NONE;
    }
    out->vertex = (uint32_t *)sss_hao__take(m, s->live + 1, sizeof *out->vertex);
    out->corner = (uint32_t (*)[3])sss_hao__take(m, triangles, sizeof *out->corner);
    out->triangle = (uint32_t *)sss_hao__take(m, vertex_count, sizeof *out->triangle);
    out->weight = (float (*)[3])sss_hao__take(m, vertex_count, sizeof *out->weight);
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_hao__write_vertices(s, point, vertex_count, triangle_number, reference_number, out);
    sss_hao__drop(m, triangle_number);
    sss_hao__drop(m, reference_number);
    return SSS_OK;
}

static sss_result sss_hao__take_simplifier(sss_hao__memory *m, sss_hao__simplifier *s)
{
    const size_t P = s->points, T = s->triangles;
    s->x = (double (*)[3])sss_hao__take(m, P, sizeof *s->x);
    s->normal = (float (*)[3])sss_hao__take(m, P, sizeof *s->normal);
    s->quadric = (double (*)[14])sss_hao__take(m, P, sizeof *s->quadric);
    s->first = (uint32_t *)sss_hao__take(m, P, sizeof *s->first);
    s->next = (uint32_t *)sss_hao__take(m, 3 * T, sizeof *s->next);
    s->valence = (uint32_t *)sss_hao__take(m, P, sizeof *s->valence);
    s->border = (unsigned char *)sss_hao__take(m, P, sizeof *s->border);
    s->component = (uint32_t *)sss_hao__take(m, P, sizeof *s->component);
    s->members = (uint32_t *)sss_hao__take(m, P, sizeof *s->members);
    s->mark = (uint32_t *)sss_hao__take(m, P, sizeof *s->mark);
    s->tally = (uint32_t *)sss_hao__take(m, P, sizeof *s->tally);
    s->key = (double *)sss_hao__take(m, P, sizeof *s->key);
    s->aim = (uint32_t *)sss_hao__take(m, P, sizeof *s->aim);
    s->heap = (uint32_t *)sss_hao__take(m, P, sizeof *s->heap);
    s->place = (uint32_t *)sss_hao__take(m, P, sizeof *s->place);
    s->parent = (uint32_t *)sss_hao__take(m, P, sizeof *s->parent);
    s->triangle = (uint32_t *)sss_hao__take(m, P, sizeof *s->triangle);
    s->first_hanging = (uint32_t *)sss_hao__take(m, T, sizeof *s->first_hanging);
    s->next_hanging = (uint32_t *)sss_hao__take(m, P, sizeof *s->next_hanging);
    s->star = (uint32_t *)sss_hao__take(m, T, sizeof *s->star);
    s->weight = (double (*)[3])sss_hao__take(m, P, sizeof *s->weight);
    return m->failed ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}

static void sss_hao__drop_simplifier(sss_hao__memory *m, const sss_hao__simplifier *s)
{
    void *const block[23] = {s->vertex, s->x, s->normal, s->quadric, s->corner, s->first, s->next, s->valence,
                             s->border, s->component, s->members, s->mark, s->tally, s->key, s->aim, s->heap,
                             s->place, s->parent, s->triangle, s->first_hanging, s->next_hanging, s->star, s->weight};
    int i;
    for (i = 0; i < 23; i++)
    {
        sss_hao__drop(m, block[i]);
    }
}

// Chooses `count` vertices as reference points, or as many as there are positions, or as few as there are components;
// one of them stands for all vertices without area, which get no light. On an error memory is left to the caller's
// sss_hao__drop_all.
static sss_result sss_hao__choose_references(sss_hao__memory *m, const sss_mesh *mesh, size_t count,
                                             sss_hao__references *out)
{
    uint32_t *point;
    sss_hao__simplifier s;
    sss_result result;
    size_t v, dark = 0;
    memset(&s, 0, sizeof s);
    memset(out, 0, sizeof *out);
    if (mesh->vertex_count >= SSS_HAO__NONE || mesh->triangle_count >= SSS_HAO__NONE / 3)
    {
        return SSS_ERROR_OVERFLOW; // corners are numbered in 32 bits
    }
    point = (uint32_t *)sss_hao__take(m, mesh->vertex_count, sizeof *point);
    s.vertex = (uint32_t *)sss_hao__take(m, mesh->vertex_count, sizeof *s.vertex);
    s.corner = (uint32_t (*)[3])sss_hao__take(m, mesh->triangle_count, sizeof *s.corner);
    result = m->failed ? SSS_ERROR_OUT_OF_MEMORY : sss_hao__weld_points(m, mesh, &s, point);
    result = result != SSS_OK ? result : sss_hao__copy_triangles(m, mesh, point, &s);
    result = result != SSS_OK ? result : sss_hao__take_simplifier(m, &s);
    if (result != SSS_OK)
    {
        return result;
    }
    for (v = 0; v < mesh->vertex_count && dark == 0; v++)
    {
        dark = point[v] == SSS_HAO__NONE;
    }
    s.live = s.points;
    s.target = count > dark ? count - dark : 0;
    memset(s.first_hanging, 255, s.triangles * sizeof *s.first_hanging);
    sss_hao__place_points(mesh, &s);
    sss_hao__connect(&s);
    sss_hao__make_quadrics(&s);
    sss_hao__simplify(&s);
    sss_hao__settle_all(&s);
    result = sss_hao__write_references(m, &s, point, mesh->vertex_count, out);
    sss_hao__drop_simplifier(m, &s);
    sss_hao__drop(m, point);
    return result;
}
// ---- storage: what is kept of the integrals ----
// Rows of integrals come in groups and are asked for once. What is left of them until all are known:
//   FLOAT, VECTORS  nothing but the object's own array
//   TABLE           16 bits an integral, linear up to the row's maximum: 50 dB finer than the table that follows
//   HARMONICS       the coefficients as floats
//   REFERENCES      the coefficients as floats, and the rows of the reference points, twice where weights are fitted

#define SSS_HAO__SLOTS 64      // items of a parallel round, each with buffers of its own and a workspace of rows()
#define SSS_HAO__SLICES 16     // of the histograms, each with bins of its own
#define SSS_HAO__MOST_ORDER 8  // of the harmonics
#define SSS_HAO__MOST_TERMS 64 // its square
#define SSS_HAO__LEVELS 256    // of a byte
#define SSS_HAO__FAN 24        // triangles around a reference point that are tried: nearly always all of them
#define SSS_HAO__PRODUCTS 32   // reference points around a triangle whose products are kept: as many

// Integrals of count <= SSS_HAO__GROUP vertices: out [count][channels][parts S]. Called inside of tasks: never
// allocates; no two calls with one slot < SSS_HAO__SLOTS at a time.
typedef void (*sss_hao__rows)(void *user, size_t slot, const uint32_t *vertices, size_t count, float *out);

// What does not fit becomes more than can be allocated.
static size_t sss_hao__times(size_t a, size_t b)
{
    return b != 0 && a > SIZE_MAX / b ? SIZE_MAX : a * b;
}

static size_t sss_hao__blocks(size_t count)
{
    return count / SSS_HAO__LANES + (count % SSS_HAO__LANES != 0);
}

static size_t sss_hao__smaller(size_t a, size_t b)
{
    return a < b ? a : b;
}

// ---- spherical harmonics (4.1) ----

// y_l^m at w of unit length, l < order, into y[l^2 + l + m]. K_l^m P_l^m(cos theta)/sin^m theta is a polynomial in z,
// and sin^m theta times cos and sin of m phi are the real and imaginary part of (x + iy)^m: poles are like any point.
static void sss_hao__harmonics(size_t order, const double w[3], double *y)
{
    double real = 1.0, imaginary = 0.0, diagonal = 0.5 / sqrt(SSS_HAO__PI); // K_m^m P_m^m/sin^m theta
    size_t l, m;
    for (m = 0; m < order; m++)
    {
        const double root = m > 0 ? sqrt(2.0) : 1.0, mm = (double)(m * m), next = real * w[0] - imaginary * w[1];
        double before = 0.0, p = diagonal;
        for (l = m; l < order; l++)
        {
            // from degree l and the one before to the next; at l = m there is none before
            const double l2 = (double)(l * l), next2 = (double)((l + 1) * (l + 1));
            const double back = l > m ? sqrt((l2 - mm) / (4.0 * l2 - 1.0)) * before : 0.0;
            y[l * l + l + m] = root * p * real;
            y[l * l + l - m] = root * p * (m > 0 ? imaginary : real);
            before = p;
            p = sqrt((4.0 * next2 - 1.0) / (next2 - mm)) * (w[2] * p - back);
        }
        imaginary = real * w[1] + imaginary * w[0];
        real = next;
        diagonal *= sqrt((2.0 * (double)m + 3.0) / (2.0 * (double)m + 2.0));
    }
}

// Harmonics through the values at the set's directions, by least squares weighted with their solid angles. For a fine
// set this is the projection of the paper: the normal matrix tends to one.
typedef struct sss_hao__fit
{
    size_t directions, terms, padded; // padded: terms up to a multiple of LANES
    float *project;                   // [D][padded] coefficients = sum over directions of value times this
    float *evaluate;                  // [terms][D] y_t(w_j)
    double *gram;                     // [terms][terms] sum over directions of y_s y_t
} sss_hao__fit;

// Cholesky in place: the lower triangle. 0 where the directions do not determine the harmonics.
static int sss_hao__factorize(double *matrix, size_t n)
{
    const double singular = 1e-9; // pivots below are rounding: squares of 3e-5, times what doubles hold
    size_t i, j, k;
    for (j = 0; j < n; j++)
    {
        const double diagonal = matrix[j * n + j];
        for (i = j; i < n; i++)
        {
            double sum = matrix[i * n + j];
            for (k = 0; k < j; k++)
            {
                sum -= matrix[i * n + k] * matrix[j * n + k];
            }
            if (i == j && !(sum > singular * diagonal))
            {
                return 0;
            }
            matrix[i * n + j] = i == j ? sqrt(sum) : sum / matrix[j * n + j];
        }
    }
    return 1;
}

static void sss_hao__substitute(const double *lower, size_t n, double *x)
{
    size_t i, k;
    for (i = 0; i < n; i++)
    {
        for (k = 0; k < i; k++)
        {
            x[i] -= lower[i * n + k] * x[k];
        }
        x[i] /= lower[i * n + i];
    }
    for (i = n; i-- > 0;)
    {
        for (k = i + 1; k < n; k++)
        {
            x[i] -= lower[k * n + i] * x[k];
        }
        x[i] /= lower[i * n + i];
    }
}

static void sss_hao__fill_fit(const sss_hao__set *set, size_t order, sss_hao__fit *fit, double *normal)
{
    double y[SSS_HAO__MOST_TERMS];
    size_t j, s, t;
    for (j = 0; j < fit->directions; j++)
    {
        sss_hao__harmonics(order, set->direction[j], y);
        for (s = 0; s < fit->terms; s++)
        {
            fit->evaluate[s * fit->directions + j] = (float)y[s];
            for (t = 0; t < fit->terms; t++)
            {
                fit->gram[s * fit->terms + t] += y[s] * y[t];
                normal[s * fit->terms + t] += set->solid_angle[j] * y[s] * y[t];
            }
        }
    }
}

static sss_result sss_hao__make_fit(sss_hao__memory *m, const sss_hao__set *set, size_t terms, sss_hao__fit *fit)
{
    const size_t order = (size_t)(sqrt((double)terms) + 0.5);
    double y[SSS_HAO__MOST_TERMS], *normal;
    size_t j, t;
    if (terms == 0 || order > SSS_HAO__MOST_ORDER || set->count < terms)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    fit->directions = set->count;
    fit->terms = terms;
    fit->padded = sss_hao__blocks(terms) * SSS_HAO__LANES;
    fit->project = (float *)sss_hao__take(m, sss_hao__times(set->count, fit->padded), sizeof(float));
    fit->evaluate = (float *)sss_hao__take(m, sss_hao__times(set->count, terms), sizeof(float));
    fit->gram = (double *)sss_hao__take(m, terms * terms, sizeof(double));
    normal = (double *)sss_hao__take(m, terms * terms, sizeof(double));
    if (fit->project == NULL || fit->evaluate == NULL || fit->gram == NULL || normal == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_hao__fill_fit(set, order, fit, normal);
    if (!sss_hao__factorize(normal, terms))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (j = 0; j < set->count; j++)
    {
        sss_hao__harmonics(order, set->direction[j], y);
        sss_hao__substitute(normal, terms, y);
        for (t = 0; t < terms; t++)
        {
            fit->project[j * fit->padded + t] = (float)(set->solid_angle[j] * y[t]);
        }
    }
    sss_hao__drop(m, normal);
    return SSS_OK;
}

static void sss_hao__drop_fit(sss_hao__memory *m, sss_hao__fit *fit)
{
    sss_hao__drop(m, fit->project);
    sss_hao__drop(m, fit->evaluate);
    sss_hao__drop(m, fit->gram);
}

// values [D], coefficients [padded]
static void sss_hao__project(const sss_hao__fit *fit, const float *values, float *coefficients)
{
    size_t from, j, k;
    for (from = 0; from < fit->padded; from += SSS_HAO__LANES)
    {
        float sums[SSS_HAO__LANES] = {0.0f};
        for (j = 0; j < fit->directions; j++)
        {
            const float *row = fit->project + j * fit->padded + from;
            const float value = values[j];
            for (k = 0; k < SSS_HAO__LANES; k++)
            {
                sums[k] += value * row[k];
            }
        }
        memcpy(coefficients + from, sums, sizeof sums);
    }
}

// Adds to values [D] what the coefficients say of them.
static void sss_hao__evaluate(const sss_hao__fit *fit, const float *coefficients, float *values)
{
    size_t from, t, k;
    for (from = 0; from + SSS_HAO__LANES <= fit->directions; from += SSS_HAO__LANES)
    {
        float sums[SSS_HAO__LANES] = {0.0f};
        for (t = 0; t < fit->terms; t++)
        {
            const float *row = fit->evaluate + t * fit->directions + from;
            for (k = 0; k < SSS_HAO__LANES; k++)
            {
                sums[k] += coefficients[t] * row[k];
            }
        }
        for (k = 0; k < SSS_HAO__LANES; k++)
        {
            values[from + k] += sums[k];
        }
    }
    for (; from < fit->directions; from++)
    {
        for (t = 0; t < fit->terms; t++)
        {
            values[from] += coefficients[t] * fit->evaluate[t * fit->directions + from];
        }
    }
}

// ---- Lloyd-Max tables (4; Gersho and Gray 1992, section 6) ----
// Values are counted in bins of a float's upper bits: SSS_HAO__BINS of them below the maximum, over sixteen octaves,
// each 1/4,096 of its values wide or less. Counts and sums of the lower bits are integers, so that nothing depends on
// the order of adding. What is smaller than the bins counts as zero, which is a level of its own: darkness stays dark.

#define SSS_HAO__BINS 65536
#define SSS_HAO__BIN_BITS 11      // lower bits of a float: 23 - 12
#define SSS_HAO__LLOYD_STEPS 4000 // far more than it takes; a bound

typedef struct sss_hao__tally
{
    uint64_t count, lower; // lower: the sum of the lower bits
} sss_hao__tally;

static uint32_t sss_hao__bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

// Bins [SSS_HAO__BINS] of the positive ones among values; the last one holds the largest of all.
static void sss_hao__count(const float *values, size_t count, float largest, sss_hao__tally *bins)
{
    const uint32_t last = sss_hao__bits(largest) >> SSS_HAO__BIN_BITS;
    size_t i;
    for (i = 0; i < count; i++)
    {
        if (values[i] > 0.0f)
        {
            const uint32_t bits = sss_hao__bits(values[i]), below = last - (bits >> SSS_HAO__BIN_BITS);
            if (below < SSS_HAO__BINS)
            {
                bins[SSS_HAO__BINS - 1 - below].count++;
                bins[SSS_HAO__BINS - 1 - below].lower += bits & ((1u << SSS_HAO__BIN_BITS) - 1u);
            }
        }
    }
}

// Bins that are not empty, rising, as sums before each: of counts, values and their cube-root density.
typedef struct sss_hao__cumulated
{
    double value, count, sum, density;
} sss_hao__cumulated;

// Returns their number; lumps [SSS_HAO__BINS + 1] end with the totals.
static size_t sss_hao__sum_bins(const sss_hao__tally *bins, float largest, sss_hao__cumulated *lumps)
{
    const uint32_t last = sss_hao__bits(largest) >> SSS_HAO__BIN_BITS;
    sss_hao__cumulated before = {0.0, 0.0, 0.0, 0.0};
    size_t count = 0, i;
    for (i = 0; i < SSS_HAO__BINS; i++)
    {
        if (bins[i].count > 0)
        {
            const uint32_t bits = (last - (uint32_t)(SSS_HAO__BINS - 1 - i)) << SSS_HAO__BIN_BITS;
            const uint32_t top = bits + (1u << SSS_HAO__BIN_BITS) - 1u;
            const double n = (double)bins[i].count, mean = (double)bins[i].lower / n;
            float low, high;
            double width;
            memcpy(&low, &bits, sizeof low);
            memcpy(&high, &top, sizeof high);
            width = (double)high - (double)low;
            before.value = (double)low + width * mean / (double)((1u << SSS_HAO__BIN_BITS) - 1u);
            lumps[count++] = before;
            before.count += n;
            before.sum += n * before.value;
            before.density += cbrt(n / width) * width; // of the levels that fit best (Gersho and Gray, eq. 6.3.11)
        }
    }
    lumps[count] = before;
    return count;
}

// The first of the lumps that is not below a value.
static size_t sss_hao__first_above(const sss_hao__cumulated *lumps, size_t count, double value)
{
    size_t low = 0, high = count;
    while (low < high)
    {
        const size_t middle = low + (high - low) / 2;
        if (lumps[middle].value < value)
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

// Levels [256], the first zero, from lumps; edge k is the first sample of cell k.
static void sss_hao__lloyd(const sss_hao__cumulated *lumps, size_t count, double *level)
{
    size_t edge[SSS_HAO__LEVELS + 1], k, i = 0, changed = 1, step;
    level[0] = 0.0;
    edge[0] = 0;
    edge[SSS_HAO__LEVELS] = count;
    for (k = 1; k < SSS_HAO__LEVELS; k++)
    {
        // equal shares of the density; half a one for zero
        const double share = lumps[count].density * ((double)k - 0.5) / ((double)SSS_HAO__LEVELS - 0.5);
        while (i + (SSS_HAO__LEVELS - k) < count && lumps[i].density < share)
        {
            i++;
        }
        edge[k] = i;
        level[k] = lumps[i].value;
        i++;
    }
    for (step = 0; step < SSS_HAO__LLOYD_STEPS && changed > 0; step++)
    {
        changed = 0;
        for (k = 1; k < SSS_HAO__LEVELS; k++) // a level is the mean of its cell; a cell that is empty keeps its own
        {
            const double n = lumps[edge[k + 1]].count - lumps[edge[k]].count;
            level[k] = n > 0.0 ? (lumps[edge[k + 1]].sum - lumps[edge[k]].sum) / n : level[k];
        }
        for (k = 1; k < SSS_HAO__LEVELS; k++) // and a cell ends halfway to the next level
        {
            size_t first = sss_hao__first_above(lumps, count, 0.5 * (level[k - 1] + level[k]));
            first = first > edge[k - 1] ? first : edge[k - 1];
            changed += first != edge[k];
            edge[k] = first;
        }
    }
}

static void sss_hao__make_table(const sss_hao__tally *bins, float largest, sss_hao__cumulated *lumps, float *table)
{
    double level[SSS_HAO__LEVELS];
    const size_t count = sss_hao__sum_bins(bins, largest, lumps);
    size_t k;
    if (count < SSS_HAO__LEVELS) // each has a level
    {
        for (k = 0; k < SSS_HAO__LEVELS; k++)
        {
            table[k] = k == 0 || count == 0 ? 0.0f : (float)lumps[sss_hao__smaller(k, count) - 1].value;
        }
        return;
    }
    sss_hao__lloyd(lumps, count, level);
    for (k = 0; k < SSS_HAO__LEVELS; k++)
    {
        table[k] = k > 0 && (float)level[k] < table[k - 1] ? table[k - 1] : (float)level[k]; // sums round
    }
}

// halfway [256]: between a level and the next; the last is never reached.
static void sss_hao__find_halfway(const float *table, float *halfway)
{
    size_t k;
    for (k = 0; k + 1 < SSS_HAO__LEVELS; k++)
    {
        halfway[k] = (float)(0.5 * ((double)table[k] + (double)table[k + 1]));
    }
    halfway[SSS_HAO__LEVELS - 1] = INFINITY;
}

static unsigned char sss_hao__encode(const float *halfway, float x)
{
    size_t code = 0, half;
    for (half = SSS_HAO__LEVELS / 2; half > 0; half /= 2)
    {
        code += x > halfway[code + half - 1] ? half : 0;
    }
    return (unsigned char)code;
}

// ---- the range of a byte ----
// Uniform steps over [low, high] leave an error of step^2/12 in what is inside, and what is outside is moved to the
// ends. The best range by that is searched among the edges of a histogram, whose bins become finer until the range has
// many of them: a single value far away costs the others nothing.

#define SSS_HAO__EDGES 129
#define SSS_HAO__ZOOMS 32 // each at least halves the range

typedef struct sss_hao__moments
{
    double weight, sum, square; // of values in units of the histogram, from its beginning
} sss_hao__moments;

// Mean square distance of values with these moments from one point.
static double sss_hao__distance_square(const sss_hao__moments *m, double point)
{
    return m->square - 2.0 * point * m->sum + point * point * m->weight;
}

// Of what is below each edge. values  as sss_hao__storing.coefficient, of one entry: lane k of block b at b stride + k
static void sss_hao__count_range(const float *values, size_t stride, const double *area, size_t count, double low,
                                 double high, sss_hao__moments *below)
{
    size_t v, i;
    memset(below, 0, (SSS_HAO__EDGES + 1) * sizeof *below);
    for (v = 0; v < count; v++)
    {
        const double x = (double)values[v / SSS_HAO__LANES * stride + v % SSS_HAO__LANES];
        const double u = (x - low) / (high - low) * (SSS_HAO__EDGES - 1);
        sss_hao__moments *at = &below[u >= 0.0 ? (size_t)sss_hao__min(u, SSS_HAO__EDGES - 1) + 1 : 0];
        at->weight += area[v];
        at->sum += area[v] * u;
        at->square += area[v] * u * u;
    }
    for (i = 1; i <= SSS_HAO__EDGES; i++)
    {
        below[i].weight += below[i - 1].weight;
        below[i].sum += below[i - 1].sum;
        below[i].square += below[i - 1].square;
    }
}

// The best pair of edges.
static void sss_hao__search_range(const sss_hao__moments *below, size_t best[2])
{
    const sss_hao__moments *all = &below[SSS_HAO__EDGES];
    double least = INFINITY;
    size_t i, j;
    for (i = 0; i + 1 < SSS_HAO__EDGES; i++)
    {
        const double under = sss_hao__distance_square(&below[i], (double)i);
        for (j = i + 1; j < SSS_HAO__EDGES; j++)
        {
            const double step = (double)(j - i) / (SSS_HAO__LEVELS - 1);
            const sss_hao__moments above = {all->weight - below[j].weight, all->sum - below[j].sum,
                                            all->square - below[j].square};
            const double error = under + sss_hao__distance_square(&above, (double)j)
                                 + (below[j].weight - below[i].weight) * step * step / 12.0;
            if (error < least)
            {
                least = error;
                best[0] = i;
                best[1] = j;
            }
        }
    }
}

static void sss_hao__choose_range(const float *values, size_t stride, const double *area, size_t count, double range[2])
{
    sss_hao__moments below[SSS_HAO__EDGES + 1];
    size_t v, zoom, best[2] = {0, SSS_HAO__EDGES - 1};
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (v = 0; v < count; v++)
    {
        const double x = (double)values[v / SSS_HAO__LANES * stride + v % SSS_HAO__LANES];
        range[0] = area[v] > 0.0 ? sss_hao__min(range[0], x) : range[0];
        range[1] = area[v] > 0.0 ? sss_hao__max(range[1], x) : range[1];
    }
    for (zoom = 0; zoom < SSS_HAO__ZOOMS && range[0] < range[1]; zoom++)
    {
        const double low = range[0], bin = (range[1] - range[0]) / (SSS_HAO__EDGES - 1);
        int fine;
        sss_hao__count_range(values, stride, area, count, range[0], range[1], below);
        sss_hao__search_range(below, best);
        fine = best[1] - best[0] >= SSS_HAO__EDGES / 4;
        range[0] = low + bin * ((double)best[0] - (fine || best[0] == 0 ? 0.0 : 1.0)); // room for the next search
        range[1] = low + bin * ((double)best[1] + (fine || best[1] + 1 == SSS_HAO__EDGES ? 0.0 : 1.0));
        if (fine)
        {
            return;
        }
    }
    if (!(range[0] < range[1])) // all alike, or none
    {
        range[0] = range[1] = range[0] < INFINITY ? range[0] : 0.0;
    }
}

// ---- from rows to storage ----

// Sums over vertices, channels and lights of what is kept: of value^2 and error^2.
typedef struct sss_hao__power
{
    double signal, error;             // weighted with area, as radiosity is decoded
    double table_signal, table_error; // of an 8-bit table alone, every value alike
} sss_hao__power;

typedef struct sss_hao__storing
{
    sss_hao *a;
    const sss_hooks *hooks;
    const double *area;               // [V]
    const sss_hao__references *r;
    sss_hao__rows rows;
    void *user;
    size_t width;                     // of a vertex's rows: channels parts S
    size_t entries;                   // coefficients of a vertex: channels M terms
    sss_hao__fit fit;
    uint32_t *list;                   // [V] vertices in the order in which they are asked for: references first
    size_t reference_count;           // of the list
    size_t list_count;                // the others after them. Vertices without area are in neither
    uint32_t *place;                  // [V] its index among reference points, or SSS_HAO__NONE
    float *buffer;                    // [SLOTS][GROUP][width] rows
    float *work;                      // [SLOTS][2][S]
    float *known;                     // [R][width] rows of reference points, later as decoded
    float *sharp;                     // [R][width] of them without most of what harmonics can say
    float *sharpened;                 // [SLOTS][width] the same of a vertex
    double (*span)[6];                // [RT] products of the corners of reference triangles
    size_t *fan_begin;                // [R + 1] in `fan`: the triangles around each reference
    uint32_t *fan;                    // [3 RT]
    float *halfway;                   // [channels][256] of the table
    uint16_t *linear;                 // [V][width] of TABLE
    float *largest;                   // [V][channels]
    float *coefficient;               // [blocks of V][entries][LANES]
    sss_hao__power *power;            // [items] to be added in order
    // the round that runs
    void (*group)(struct sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count,
                  sss_hao__power *power);
    const uint32_t *vertices;
    size_t count, first, per_slot;    // vertices; the round's first group; groups that a slot takes one after the other
} sss_hao__storing;

static void sss_hao__groups_task(void *context, size_t begin, size_t end)
{
    sss_hao__storing *s = (sss_hao__storing *)context;
    const size_t groups = s->count / SSS_HAO__GROUP + (s->count % SSS_HAO__GROUP != 0);
    size_t slot, k;
    for (slot = begin; slot < end; slot++)
    {
        for (k = 0; k < s->per_slot; k++)
        {
            const size_t group = s->first + slot * s->per_slot + k, from = group * SSS_HAO__GROUP;
            if (group < groups)
            {
                s->group(s, slot, s->vertices + from, sss_hao__smaller(s->count - from, SSS_HAO__GROUP),
                         &s->power[group]);
            }
        }
    }
}

static void sss_hao__add_power(const sss_hao__power *items, size_t count, sss_hao__power *sum)
{
    size_t i;
    for (i = 0; i < count; i++)
    {
        sum->signal += items[i].signal;
        sum->error += items[i].error;
        sum->table_signal += items[i].table_signal;
        sum->table_error += items[i].table_error;
    }
}

static int sss_hao__cancelled(const sss_hooks *hooks, double fraction)
{
    return hooks->progress != NULL && hooks->progress(hooks->user, fraction) != 0;
}

// A function for all groups of vertices, in rounds of SLOTS items. Adds what they say of power.
static sss_result sss_hao__run(sss_hao__storing *s, const uint32_t *vertices, size_t count,
                               void (*group)(sss_hao__storing *, size_t, const uint32_t *, size_t, sss_hao__power *),
                               const double fraction[2], sss_hao__power *sum)
{
    const size_t groups = count / SSS_HAO__GROUP + (count % SSS_HAO__GROUP != 0);
    const size_t rounds = 100; // at least, where there are as many: a hundred reports of progress, quick to cancel
    s->per_slot = groups / (rounds * SSS_HAO__SLOTS) + 1;
    s->vertices = vertices;
    s->count = count;
    s->group = group;
    s->power = (sss_hao__power *)sss_hao__take(&s->a->memory, groups, sizeof *s->power);
    if (s->power == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (s->first = 0; s->first < groups; s->first += s->per_slot * SSS_HAO__SLOTS)
    {
        const double done = (double)s->first / (double)groups;
        if (sss_hao__cancelled(s->hooks, fraction[0] + (fraction[1] - fraction[0]) * done))
        {
            return SSS_ERROR_CANCELLED;
        }
        sss_hao__parallel(s->hooks, SSS_HAO__SLOTS, sss_hao__groups_task, s);
    }
    sss_hao__add_power(s->power, groups, sum);
    sss_hao__drop(&s->a->memory, s->power);
    s->power = NULL;
    return SSS_OK;
}

static float *sss_hao__ask(sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count)
{
    float *rows = s->buffer + slot * SSS_HAO__GROUP * s->width;
    s->rows(s->user, slot, vertices, count, rows);
    return rows;
}

// ---- FLOAT, VECTORS ----

static void sss_hao__keep_floats(sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count,
                                 sss_hao__power *power)
{
    const float *rows = sss_hao__ask(s, slot, vertices, count);
    size_t i;
    (void)power;
    for (i = 0; i < count; i++)
    {
        memcpy(s->a->q + vertices[i] * s->width, rows + i * s->width, s->width * sizeof(float));
    }
}

static sss_result sss_hao__store_floats(sss_hao__storing *s, sss_hao__power *sum)
{
    const double fraction[2] = {0.0, 1.0};
    s->a->q = (float *)sss_hao__take(&s->a->memory, sss_hao__times(s->a->stats.vertex_count, s->width), sizeof(float));
    return s->a->q == NULL ? SSS_ERROR_OUT_OF_MEMORY
                           : sss_hao__run(s, s->list, s->list_count, sss_hao__keep_floats, fraction, sum);
}

// ---- tables: of all vertices, and of reference points ----

static void sss_hao__keep_linear(sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count,
                                 sss_hao__power *power)
{
    const float *rows = sss_hao__ask(s, slot, vertices, count);
    const size_t S = s->a->lights;
    size_t i, c, k;
    (void)power;
    for (i = 0; i < count; i++)
    {
        for (c = 0; c < s->a->channels; c++)
        {
            const float *row = rows + i * s->width + c * S;
            uint16_t *linear = s->linear + vertices[i] * s->width + c * S;
            float largest = 0.0f;
            for (k = 0; k < S; k++)
            {
                largest = row[k] > largest ? row[k] : largest;
            }
            for (k = 0; k < S; k++)
            {
                const double share = row[k] > 0.0f ? (double)row[k] / (double)largest : 0.0;
                linear[k] = (uint16_t)(65535.0 * share + 0.5);
            }
            s->largest[vertices[i] * s->a->channels + c] = largest;
        }
    }
}

static void sss_hao__keep_known(sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count,
                                sss_hao__power *power)
{
    const float *rows = sss_hao__ask(s, slot, vertices, count);
    size_t i;
    (void)power;
    for (i = 0; i < count; i++)
    {
        memcpy(s->known + s->place[vertices[i]] * s->width, rows + i * s->width, s->width * sizeof(float));
    }
}

// The row of an item that a table is made for, a vertex or a reference point.   work [S]
static const float *sss_hao__table_row(const sss_hao__storing *s, size_t item, size_t c, float *work)
{
    const size_t S = s->a->lights;
    size_t k;
    if (s->known != NULL)
    {
        return s->known + item * s->width + c * S;
    }
    for (k = 0; k < S; k++)
    {
        const uint16_t *linear = s->linear + item * s->width + c * S;
        work[k] = s->largest[item * s->a->channels + c] * ((float)linear[k] * (1.0f / 65535.0f));
    }
    return work;
}

typedef struct sss_hao__histogram
{
    const sss_hao__storing *s;
    size_t items, channel;
    float largest;      // of all
    float *slice;       // [SLICES] largest of each
    sss_hao__tally *bins; // [SLICES][BINS]
} sss_hao__histogram;

static void sss_hao__largest_task(void *context, size_t begin, size_t end)
{
    sss_hao__histogram *h = (sss_hao__histogram *)context;
    size_t slice, i, k;
    for (slice = begin; slice < end; slice++)
    {
        float *work = h->s->work + slice * 2 * h->s->a->lights;
        for (i = slice; i < h->items; i += SSS_HAO__SLICES)
        {
            const float *row = sss_hao__table_row(h->s, i, h->channel, work);
            for (k = 0; k < h->s->a->lights; k++)
            {
                h->slice[slice] = row[k] > h->slice[slice] ? row[k] : h->slice[slice];
            }
        }
    }
}

static void sss_hao__histogram_task(void *context, size_t begin, size_t end)
{
    sss_hao__histogram *h = (sss_hao__histogram *)context;
    size_t slice, i;
    for (slice = begin; slice < end; slice++)
    {
        float *work = h->s->work + slice * 2 * h->s->a->lights;
        for (i = slice; i < h->items; i += SSS_HAO__SLICES)
        {
            sss_hao__count(sss_hao__table_row(h->s, i, h->channel, work), h->s->a->lights, h->largest,
                           h->bins + slice * SSS_HAO__BINS);
        }
    }
}

static void sss_hao__fill_histogram(sss_hao__histogram *h)
{
    size_t slice, i;
    memset(h->slice, 0, SSS_HAO__SLICES * sizeof *h->slice);
    memset(h->bins, 0, (size_t)SSS_HAO__SLICES * SSS_HAO__BINS * sizeof *h->bins);
    sss_hao__parallel(h->s->hooks, SSS_HAO__SLICES, sss_hao__largest_task, h);
    h->largest = 0.0f;
    for (slice = 0; slice < SSS_HAO__SLICES; slice++)
    {
        h->largest = h->slice[slice] > h->largest ? h->slice[slice] : h->largest;
    }
    sss_hao__parallel(h->s->hooks, SSS_HAO__SLICES, sss_hao__histogram_task, h);
    for (slice = 1; slice < SSS_HAO__SLICES; slice++)
    {
        for (i = 0; i < SSS_HAO__BINS; i++)
        {
            h->bins[i].count += h->bins[slice * SSS_HAO__BINS + i].count;
            h->bins[i].lower += h->bins[slice * SSS_HAO__BINS + i].lower;
        }
    }
}

// Tables of all channels for items that are known: a->table and s->halfway.
static sss_result sss_hao__make_tables(sss_hao__storing *s, size_t items)
{
    sss_hao__memory *m = &s->a->memory;
    sss_hao__histogram h;
    sss_hao__cumulated *lumps;
    memset(&h, 0, sizeof h);
    h.s = s;
    h.items = items;
    h.slice = (float *)sss_hao__take(m, SSS_HAO__SLICES, sizeof *h.slice);
    h.bins = (sss_hao__tally *)sss_hao__take(m, (size_t)SSS_HAO__SLICES * SSS_HAO__BINS, sizeof *h.bins);
    lumps = (sss_hao__cumulated *)sss_hao__take(m, SSS_HAO__BINS + 1, sizeof *lumps);
    s->halfway = (float *)sss_hao__take(m, s->a->channels * SSS_HAO__LEVELS, sizeof(float));
    s->a->table = (float *)sss_hao__take(m, s->a->channels * SSS_HAO__LEVELS, sizeof(float));
    s->a->code = (unsigned char *)sss_hao__take(m, sss_hao__times(items, s->width), 1);
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (h.channel = 0; h.channel < s->a->channels; h.channel++)
    {
        float *table = s->a->table + h.channel * SSS_HAO__LEVELS;
        sss_hao__fill_histogram(&h);
        sss_hao__make_table(h.bins, h.largest, lumps, table);
        sss_hao__find_halfway(table, s->halfway + h.channel * SSS_HAO__LEVELS);
    }
    sss_hao__drop(m, h.slice);
    sss_hao__drop(m, h.bins);
    sss_hao__drop(m, lumps);
    return SSS_OK;
}

// Codes of one item's row, and the row that they decode to.   decoded [S]
static void sss_hao__encode_row(sss_hao__storing *s, size_t item, size_t c, const float *row, float *decoded,
                                sss_hao__power *power)
{
    const size_t S = s->a->lights;
    const float *table = s->a->table + c * SSS_HAO__LEVELS, *halfway = s->halfway + c * SSS_HAO__LEVELS;
    unsigned char *codes = s->a->code + item * s->width + c * S;
    size_t k;
    for (k = 0; k < S; k++)
    {
        const double value = (double)row[k];
        codes[k] = sss_hao__encode(halfway, row[k]);
        decoded[k] = table[codes[k]];
        power->table_signal += value * value;
        power->table_error += ((double)decoded[k] - value) * ((double)decoded[k] - value);
    }
}

static void sss_hao__encode_group(sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count,
                                  sss_hao__power *power)
{
    float *work = s->work + slot * 2 * s->a->lights;
    size_t i, c;
    for (i = 0; i < count; i++)
    {
        sss_hao__power own = {0.0, 0.0, 0.0, 0.0};
        for (c = 0; c < s->a->channels; c++)
        {
            const float *row = sss_hao__table_row(s, vertices[i], c, work);
            sss_hao__encode_row(s, vertices[i], c, row, work + s->a->lights, &own);
        }
        own.signal = s->area[vertices[i]] * own.table_signal;
        own.error = s->area[vertices[i]] * own.table_error;
        sss_hao__add_power(&own, 1, power);
    }
}

static sss_result sss_hao__store_table(sss_hao__storing *s, sss_hao__power *sum)
{
    const double rows[2] = {0.0, 0.95}, codes[2] = {0.95, 1.0}; // about the shares of time with many vertices
    const size_t V = s->a->stats.vertex_count;
    sss_hao__memory *m = &s->a->memory;
    sss_result result;
    s->linear = (uint16_t *)sss_hao__take(m, sss_hao__times(V, s->width), sizeof *s->linear);
    s->largest = (float *)sss_hao__take(m, sss_hao__times(V, s->a->channels), sizeof *s->largest);
    if (m->failed)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    result = sss_hao__run(s, s->list, s->list_count, sss_hao__keep_linear, rows, sum);
    if (result == SSS_OK)
    {
        result = sss_hao__make_tables(s, V);
    }
    if (result == SSS_OK)
    {
        result = sss_hao__run(s, s->list, s->list_count, sss_hao__encode_group, codes, sum);
    }
    return result;
}

// ---- harmonics: of rows, and of what reference points leave over ----

static float *sss_hao__coefficients_of(const sss_hao__storing *s, size_t vertex)
{
    return s->coefficient + vertex / SSS_HAO__LANES * s->entries * SSS_HAO__LANES + vertex % SSS_HAO__LANES;
}

// Harmonics of what `predicted` [S] leaves over of one channel's row; they are added to it.   rest [S] is scratch
static void sss_hao__fit_row(sss_hao__storing *s, size_t vertex, size_t c, const float *row, float *predicted,
                             float *rest, sss_hao__power *power)
{
    const size_t D = s->fit.directions, S = s->a->lights, terms = s->fit.terms;
    float *to = sss_hao__coefficients_of(s, vertex) + c * s->a->shells * terms * SSS_HAO__LANES;
    float coefficients[SSS_HAO__MOST_TERMS];
    double signal = 0.0, error = 0.0;
    size_t shell, t, k;
    for (k = 0; k < S; k++)
    {
        rest[k] = row[k] - predicted[k];
    }
    for (shell = 0; shell < s->a->shells; shell++)
    {
        sss_hao__project(&s->fit, rest + shell * D, coefficients);
        sss_hao__evaluate(&s->fit, coefficients, predicted + shell * D);
        for (t = 0; t < terms; t++)
        {
            to[(shell * terms + t) * SSS_HAO__LANES] = coefficients[t];
        }
    }
    for (k = 0; k < S; k++)
    {
        const double value = (double)row[k], wrong = sss_hao__max((double)predicted[k], 0.0) - value;
        signal += value * value;
        error += wrong * wrong;
    }
    power->signal += s->area[vertex] * signal;
    power->error += s->area[vertex] * error;
}

static void sss_hao__fit_group(sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count,
                               sss_hao__power *power)
{
    const float *rows = sss_hao__ask(s, slot, vertices, count);
    const size_t S = s->a->lights;
    float *work = s->work + slot * 2 * S;
    size_t i, c;
    for (i = 0; i < count; i++)
    {
        for (c = 0; c < s->a->channels; c++)
        {
            memset(work, 0, S * sizeof *work);
            sss_hao__fit_row(s, vertices[i], c, rows + i * s->width + c * S, work, work + S, power);
        }
    }
}

// Reference points: their codes, and harmonics of the codes' error. `known` becomes what the codes decode to.
static void sss_hao__fit_references(sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count,
                                    sss_hao__power *power)
{
    const size_t S = s->a->lights;
    float *work = s->work + slot * 2 * S;
    size_t i, c;
    for (i = 0; i < count; i++)
    {
        const size_t place = s->place[vertices[i]];
        for (c = 0; c < s->a->channels; c++)
        {
            float *row = s->known + place * s->width + c * S;
            const unsigned char *codes = s->a->code + place * s->width + c * S;
            size_t k;
            sss_hao__encode_row(s, place, c, row, work, power);
            sss_hao__fit_row(s, vertices[i], c, row, work, work + S, power);
            for (k = 0; k < S; k++)
            {
                row[k] = s->a->table[c * SSS_HAO__LEVELS + codes[k]];
            }
        }
    }
}

// Weights as 16 bits, of which the two sum to no more than 65,535 where there is light.
static void sss_hao__code_weights(const float weight[3], uint16_t out[2])
{
    uint32_t code[2], k;
    for (k = 0; k < 2; k++)
    {
        const double w = weight[k] > 0.0f ? sss_hao__min((double)weight[k], 1.0) : 0.0;
        code[k] = (uint32_t)(65535.0 * w + 0.5);
    }
    out[0] = (uint16_t)code[0];
    out[1] = (uint16_t)(code[1] > 65535u - code[0] ? 65535u - code[0] : code[1]);
}

static void sss_hao__set_triangle(sss_hao *a, size_t vertex, size_t triangle)
{
    if (a->triangle16 != NULL)
    {
        a->triangle16[vertex] = (uint16_t)triangle;
    }
    else
    {
        a->triangle32[vertex] = (uint32_t)triangle;
    }
}

static int sss_hao__dark(const uint16_t weight[2])
{
    return (uint32_t)weight[0] + weight[1] > 65535u;
}

// The corners of a vertex's reference triangle, and its weights; all zero where it gets no light.
static void sss_hao__corners_of(const sss_hao *a, size_t vertex, size_t corner[3], float weight[3])
{
    const uint16_t *w = a->weight[vertex];
    const size_t triangle = a->triangle16 != NULL ? a->triangle16[vertex] : a->triangle32[vertex];
    size_t k;
    for (k = 0; k < 3; k++)
    {
        corner[k] = a->corner16 != NULL ? a->corner16[3 * triangle + k] : a->corner32[3 * triangle + k];
        weight[k] = k < 2 && !sss_hao__dark(w) ? (float)w[k] * (1.0f / 65535.0f) : 0.0f;
    }
    weight[2] = sss_hao__dark(w) ? 0.0f : 1.0f - weight[0] - weight[1];
}

// Takes from a row [S] most of what harmonics can say of it.
static void sss_hao__sharpen(const sss_hao__storing *s, float *row)
{
    // what is left of it keeps residuals small, for bytes: with 256 steps over some six deviations a byte rounds away
    // 5e-5 of a residual's square; a hundred times that weighs it as much as
    const float left = 0.07f;
    float coefficients[SSS_HAO__MOST_TERMS];
    size_t shell, t;
    for (shell = 0; shell < s->a->shells; shell++)
    {
        sss_hao__project(&s->fit, row + shell * s->fit.directions, coefficients);
        for (t = 0; t < s->fit.terms; t++)
        {
            coefficients[t] *= left - 1.0f;
        }
        sss_hao__evaluate(&s->fit, coefficients, row + shell * s->fit.directions);
    }
}

static double sss_hao__product(const float *x, const float *y, size_t count)
{
    double sums[4] = {0.0, 0.0, 0.0, 0.0}; // one would wait for itself
    size_t k;
    for (k = 0; k + 4 <= count; k += 4)
    {
        sums[0] += (double)x[k] * (double)y[k];
        sums[1] += (double)x[k + 1] * (double)y[k + 1];
        sums[2] += (double)x[k + 2] * (double)y[k + 2];
        sums[3] += (double)x[k + 3] * (double)y[k + 3];
    }
    for (; k < count; k++)
    {
        sums[0] += (double)x[k] * (double)y[k];
    }
    return (sums[0] + sums[2]) + (sums[1] + sums[3]);
}

static void sss_hao__sharpen_task(void *context, size_t begin, size_t end)
{
    const sss_hao__storing *s = (const sss_hao__storing *)context;
    const size_t S = s->a->lights;
    size_t i;
    for (i = begin; i < end; i++) // rows of one channel
    {
        memcpy(s->sharp + i * S, s->known + i * S, S * sizeof(float));
        sss_hao__sharpen(s, s->sharp + i * S);
    }
}

// Products of d_1 = q_1 - q_3, d_2 = q_2 - q_3 and q_3: d1d1, d1d2, d2d2, d1q3, d2q3, q3q3.
static void sss_hao__span_task(void *context, size_t begin, size_t end)
{
    const sss_hao__storing *s = (const sss_hao__storing *)context;
    size_t triangle, k;
    for (triangle = begin; triangle < end; triangle++)
    {
        const uint32_t *corner = s->r->corner[triangle];
        const float *q1 = s->sharp + corner[0] * s->width, *q2 = s->sharp + corner[1] * s->width;
        const float *q3 = s->sharp + corner[2] * s->width;
        double *p = s->span[triangle];
        for (k = 0; k < s->width; k++)
        {
            const double d3 = (double)q3[k], d1 = (double)q1[k] - d3, d2 = (double)q2[k] - d3;
            p[0] += d1 * d1;
            p[1] += d1 * d2;
            p[2] += d2 * d2;
            p[3] += d1 * d3;
            p[4] += d2 * d3;
            p[5] += d3 * d3;
        }
    }
}

// Reference triangles around each reference point.
static void sss_hao__find_fans(sss_hao__storing *s)
{
    const size_t R = s->r->count, RT = s->r->triangle_count;
    size_t i, k;
    for (i = 0; i < RT; i++)
    {
        for (k = 0; k < 3; k++)
        {
            s->fan_begin[s->r->corner[i][k]]++; // ends at first
        }
    }
    for (i = 1; i < R; i++)
    {
        s->fan_begin[i] += s->fan_begin[i - 1];
    }
    for (i = RT; i-- > 0;) // from behind: ends become beginnings, and triangles rise
    {
        for (k = 0; k < 3; k++)
        {
            s->fan[--s->fan_begin[s->r->corner[i][k]]] = (uint32_t)i;
        }
    }
    s->fan_begin[R] = 3 * RT;
}

// |e - w_1 d_1 - w_2 d_2|^2 less |e|^2, from products of these three: d1d1, d1d2, d2d2, d1e, d2e.
static double sss_hao__misfit(const double p[5], double w1, double w2)
{
    return w1 * w1 * p[0] + 2.0 * w1 * w2 * p[1] + w2 * w2 * p[2] - 2.0 * (w1 * p[3] + w2 * p[4]);
}

static double sss_hao__ratio(double above, double below)
{
    return below > 0.0 ? sss_hao__min(sss_hao__max(above / below, 0.0), 1.0) : 0.0;
}

// The weights that fit best among those >= 0 whose sum is 1, starting from given ones: inside, or along an edge.
static void sss_hao__fit_weights(const double p[5], float weight[3])
{
    const double determinant = p[0] * p[2] - p[1] * p[1], singular = 1e-6; // of squares of floats
    const double across = sss_hao__ratio(p[2] - p[1] + p[3] - p[4], p[0] - 2.0 * p[1] + p[2]);
    double candidate[4][2] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
    double least = sss_hao__misfit(p, (double)weight[0], (double)weight[1]);
    size_t k;
    candidate[0][0] = sss_hao__ratio(p[3], p[0]);
    candidate[1][1] = sss_hao__ratio(p[4], p[2]);
    candidate[2][0] = across;
    candidate[2][1] = 1.0 - across;
    if (determinant > singular * p[0] * p[2])
    {
        candidate[3][0] = (p[3] * p[2] - p[4] * p[1]) / determinant;
        candidate[3][1] = (p[4] * p[0] - p[3] * p[1]) / determinant;
    }
    for (k = 0; k < 4; k++)
    {
        const double w1 = candidate[k][0], w2 = candidate[k][1], misfit = sss_hao__misfit(p, w1, w2);
        if (w1 >= 0.0 && w2 >= 0.0 && w1 + w2 <= 1.0 && misfit < least)
        {
            least = misfit;
            weight[0] = (float)w1;
            weight[1] = (float)w2;
            weight[2] = (float)(1.0 - w1 - w2);
        }
    }
}

// A triangle for a vertex, and how well it fits.
typedef struct sss_hao__hanging
{
    size_t triangle;
    float weight[3];
    double misfit;
} sss_hao__hanging;

// Products of a vertex's sharpened row with those of reference points, kept as they come.
typedef struct sss_hao__products
{
    const float *row; // [width]
    size_t count;
    uint32_t reference[SSS_HAO__PRODUCTS];
    double product[SSS_HAO__PRODUCTS];
} sss_hao__products;

static double sss_hao__product_with(const sss_hao__storing *s, sss_hao__products *products, uint32_t reference)
{
    double product;
    size_t k;
    for (k = 0; k < products->count; k++)
    {
        if (products->reference[k] == reference)
        {
            return products->product[k];
        }
    }
    product = sss_hao__product(products->row, s->sharp + reference * s->width, s->width);
    if (products->count < SSS_HAO__PRODUCTS)
    {
        products->reference[products->count] = reference;
        products->product[products->count++] = product;
    }
    return product;
}

// hanging  its triangle is given, and weights to begin with
static void sss_hao__try_triangle(const sss_hao__storing *s, sss_hao__products *products, sss_hao__hanging *hanging)
{
    const uint32_t *corner = s->r->corner[hanging->triangle];
    const double *span = s->span[hanging->triangle];
    const double b1 = sss_hao__product_with(s, products, corner[0]), b2 = sss_hao__product_with(s, products, corner[1]);
    const double b3 = sss_hao__product_with(s, products, corner[2]);
    const double p[5] = {span[0], span[1], span[2], b1 - b3 - span[3], b2 - b3 - span[4]};
    sss_hao__fit_weights(p, hanging->weight);
    hanging->misfit = span[5] - 2.0 * b3 + sss_hao__misfit(p, (double)hanging->weight[0], (double)hanging->weight[1]);
}

// Harmonics make up for what is smooth in a difference; weights have to make up for the rest. Barycentric ones know of
// places only. Which ones fit best is the question that the paper leaves open (section 6): here those of least squares,
// in the vertex's own triangle or one that touches it.
static void sss_hao__improve_weights(sss_hao__storing *s, size_t vertex, const float *rows, float *work)
{
    const size_t own = s->r->triangle[vertex], S = s->a->lights;
    sss_hao__products products;
    sss_hao__hanging best;
    size_t c, i, k;
    if (own >= s->r->triangle_count)
    {
        return;
    }
    for (c = 0; c < s->a->channels; c++)
    {
        memcpy(work + c * S, rows + c * S, S * sizeof *work);
        sss_hao__sharpen(s, work + c * S);
    }
    products.row = work;
    products.count = 0;
    best.triangle = own;
    memcpy(best.weight, s->r->weight[vertex], sizeof best.weight);
    sss_hao__try_triangle(s, &products, &best);
    for (k = 0; k < 3; k++)
    {
        const uint32_t *corner = s->r->corner[own], center = corner[k];
        const size_t from = s->fan_begin[center], most = from + SSS_HAO__FAN;
        for (i = from; i < s->fan_begin[center + 1] && i < most; i++)
        {
            sss_hao__hanging other = {0, {0.0f, 0.0f, 1.0f}, 0.0};
            const uint32_t *around = s->r->corner[s->fan[i]];
            other.triangle = s->fan[i];
            if ((k > 0 && sss_hao__has_corner(around, corner[0])) || (k > 1 && sss_hao__has_corner(around, corner[1])))
            {
                continue; // it has been tried
            }
            sss_hao__try_triangle(s, &products, &other);
            best = other.misfit < best.misfit ? other : best;
        }
    }
    sss_hao__set_triangle(s->a, vertex, best.triangle);
    sss_hao__code_weights(best.weight, s->a->weight[vertex]);
}

// The others: dq_j = q_j - sum over k of w_k q_kj (4.2), from weights and q_kj as they will be decoded.
static void sss_hao__fit_others(sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count,
                                sss_hao__power *power)
{
    const float *rows = sss_hao__ask(s, slot, vertices, count);
    const size_t S = s->a->lights;
    float *work = s->work + slot * 2 * S, weight[3];
    size_t corner[3], i, c, k;
    for (i = 0; i < count; i++)
    {
        if (s->a->stats.weights == SSS_HAO_FITTED)
        {
            sss_hao__improve_weights(s, vertices[i], rows + i * s->width, s->sharpened + slot * s->width);
        }
        sss_hao__corners_of(s->a, vertices[i], corner, weight);
        for (c = 0; c < s->a->channels; c++)
        {
            const float *q1 = s->known + corner[0] * s->width + c * S, *q2 = s->known + corner[1] * s->width + c * S;
            const float *q3 = s->known + corner[2] * s->width + c * S;
            for (k = 0; k < S; k++)
            {
                work[k] = weight[0] * q1[k] + weight[1] * q2[k] + weight[2] * q3[k];
            }
            sss_hao__fit_row(s, vertices[i], c, rows + i * s->width + c * S, work, work + S, power);
        }
    }
}

// ---- coefficients as codes ----

// Harmonics alone: 16 bits around zero, so that darkness is zero exactly.
static void sss_hao__scale_harmonic(const sss_hao__storing *s, size_t entry)
{
    const size_t V = s->a->stats.vertex_count, stride = s->entries * SSS_HAO__LANES;
    const float *values = s->coefficient + entry * SSS_HAO__LANES;
    float largest = 0.0f;
    size_t v;
    for (v = 0; v < V; v++)
    {
        const float size = fabsf(values[v / SSS_HAO__LANES * stride + v % SSS_HAO__LANES]);
        largest = size > largest ? size : largest;
    }
    s->a->offset[entry] = 0.0f;
    s->a->scale[entry] = largest / 32767.0f;
}

static void sss_hao__scale_task(void *context, size_t begin, size_t end)
{
    const sss_hao__storing *s = (const sss_hao__storing *)context;
    size_t entry;
    for (entry = begin; entry < end; entry++)
    {
        double range[2];
        if (s->a->harmonic != NULL)
        {
            sss_hao__scale_harmonic(s, entry);
            continue;
        }
        sss_hao__choose_range(s->coefficient + entry * SSS_HAO__LANES, s->entries * SSS_HAO__LANES, s->area,
                              s->a->stats.vertex_count, range);
        s->a->offset[entry] = (float)range[0];
        s->a->scale[entry] = (float)((range[1] - range[0]) / (SSS_HAO__LEVELS - 1));
    }
}

// The nearest code in [low, high], and in *x the error that it leaves.
static double sss_hao__code_of(double offset, double scale, double low, double high, double *x)
{
    const double code = scale > 0.0 ? sss_hao__min(sss_hao__max(floor((*x - offset) / scale + 0.5), low), high) : 0.0;
    *x -= offset + scale * code;
    return code;
}

// Square of harmonics with coefficients d, summed over the set's directions.
static double sss_hao__gram_norm(const sss_hao__fit *fit, const double *d)
{
    double sum = 0.0;
    size_t i, k;
    for (i = 0; i < fit->terms; i++)
    {
        double row = 0.0;
        for (k = 0; k < fit->terms; k++)
        {
            row += fit->gram[i * fit->terms + k] * d[k];
        }
        sum += row * d[i];
    }
    return sum;
}

// One vertex's codes. The error of rounding is independent of what the harmonics leave over: it adds to it.
static void sss_hao__code_vertex(sss_hao__storing *s, size_t v, sss_hao__power *power)
{
    const float *values = sss_hao__coefficients_of(s, v);
    const size_t block = v / SSS_HAO__LANES, lane = v % SSS_HAO__LANES;
    double d[SSS_HAO__MOST_TERMS];
    size_t from, t;
    for (from = 0; from < s->entries; from += s->fit.terms)
    {
        for (t = 0; t < s->fit.terms; t++)
        {
            const size_t entry = from + t;
            const double offset = (double)s->a->offset[entry], scale = (double)s->a->scale[entry];
            d[t] = (double)values[entry * SSS_HAO__LANES];
            if (s->a->harmonic != NULL)
            {
                const double code = sss_hao__code_of(offset, scale, -32767.0, 32767.0, &d[t]);
                s->a->harmonic[v * s->entries + entry] = (int16_t)code;
            }
            else
            {
                const double code = sss_hao__code_of(offset, scale, 0.0, SSS_HAO__LEVELS - 1, &d[t]);
                s->a->residual[(block * s->entries + entry) * SSS_HAO__LANES + lane] = (unsigned char)code;
            }
        }
        power->error += s->area[v] * (s->area[v] > 0.0 ? sss_hao__gram_norm(&s->fit, d) : 0.0);
    }
}

static void sss_hao__code_group(sss_hao__storing *s, size_t slot, const uint32_t *vertices, size_t count,
                                sss_hao__power *power)
{
    size_t i;
    (void)slot;
    for (i = 0; i < count; i++)
    {
        sss_hao__code_vertex(s, vertices[i], power);
    }
}

static sss_result sss_hao__take_coefficients(sss_hao__storing *s)
{
    sss_hao *a = s->a;
    const size_t blocks = sss_hao__blocks(a->stats.vertex_count), padded = sss_hao__times(s->entries, SSS_HAO__LANES);
    const sss_result result = sss_hao__make_fit(&a->memory, &a->set, a->terms, &s->fit);
    if (result != SSS_OK)
    {
        return result;
    }
    s->coefficient = (float *)sss_hao__take(&a->memory, sss_hao__times(blocks, padded), sizeof(float));
    a->scale = (float *)sss_hao__take(&a->memory, s->entries, sizeof(float));
    a->offset = (float *)sss_hao__take(&a->memory, s->entries, sizeof(float));
    if (a->stats.storage == SSS_HAO_HARMONICS)
    {
        a->harmonic = (int16_t *)sss_hao__take(&a->memory, sss_hao__times(a->stats.vertex_count, s->entries),
                                               sizeof *a->harmonic);
    }
    else
    {
        a->residual = (unsigned char *)sss_hao__take(&a->memory, sss_hao__times(blocks, padded), 1);
    }
    return a->memory.failed ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}

static sss_result sss_hao__code_coefficients(sss_hao__storing *s, sss_hao__power *sum)
{
    const double fraction[2] = {0.98, 1.0}; // about the share of time with many vertices
    sss_hao__parallel(s->hooks, s->entries, sss_hao__scale_task, s);
    return sss_hao__run(s, s->list, s->reference_count + s->list_count, sss_hao__code_group, fraction, sum);
}

static sss_result sss_hao__store_harmonics(sss_hao__storing *s, sss_hao__power *sum)
{
    const double fraction[2] = {0.0, 0.98};
    sss_result result = sss_hao__take_coefficients(s);
    if (result == SSS_OK)
    {
        result = sss_hao__run(s, s->list, s->list_count, sss_hao__fit_group, fraction, sum);
    }
    return result == SSS_OK ? sss_hao__code_coefficients(s, sum) : result;
}

// ---- reference points ----

static sss_result sss_hao__take_references(sss_hao__storing *s)
{
    const size_t V = s->a->stats.vertex_count, R = s->r->count, RT = s->r->triangle_count, small = 65536;
    sss_hao *a = s->a;
    a->weight = (uint16_t (*)[2])sss_hao__take(&a->memory, V, sizeof *a->weight);
    a->reference = (uint32_t *)sss_hao__take(&a->memory, R, sizeof *a->reference);
    if (R <= small)
    {
        a->corner16 = (uint16_t *)sss_hao__take(&a->memory, sss_hao__times(RT, 3), sizeof *a->corner16);
    }
    else
    {
        a->corner32 = (uint32_t *)sss_hao__take(&a->memory, sss_hao__times(RT, 3), sizeof *a->corner32);
    }
    if (RT <= small)
    {
        a->triangle16 = (uint16_t *)sss_hao__take(&a->memory, V, sizeof *a->triangle16);
    }
    else
    {
        a->triangle32 = (uint32_t *)sss_hao__take(&a->memory, V, sizeof *a->triangle32);
    }
    s->known = (float *)sss_hao__take(&a->memory, sss_hao__times(R, s->width), sizeof(float));
    s->place = (uint32_t *)sss_hao__take(&a->memory, V, sizeof *s->place);
    if (a->stats.weights == SSS_HAO_FITTED)
    {
        s->sharp = (float *)sss_hao__take(&a->memory, sss_hao__times(R, s->width), sizeof(float));
        s->sharpened = (float *)sss_hao__take(&a->memory, sss_hao__times(SSS_HAO__SLOTS, s->width), sizeof(float));
        s->span = (double (*)[6])sss_hao__take(&a->memory, RT, sizeof *s->span);
        s->fan_begin = (size_t *)sss_hao__take(&a->memory, R + 1, sizeof *s->fan_begin);
        s->fan = (uint32_t *)sss_hao__take(&a->memory, sss_hao__times(RT, 3), sizeof *s->fan);
    }
    return a->memory.failed ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}

static void sss_hao__copy_references(sss_hao__storing *s)
{
    const sss_hao__references *r = s->r;
    const size_t V = s->a->stats.vertex_count;
    sss_hao *a = s->a;
    size_t i, k;
    memset(s->place, 0xff, V * sizeof *s->place);
    for (i = 0; i < r->count; i++)
    {
        a->reference[i] = r->vertex[i];
        s->place[r->vertex[i]] = (uint32_t)i;
    }
    for (i = 0; i < r->triangle_count; i++)
    {
        for (k = 0; k < 3; k++)
        {
            if (a->corner16 != NULL)
            {
                a->corner16[3 * i + k] = (uint16_t)r->corner[i][k];
            }
            else
            {
                a->corner32[3 * i + k] = r->corner[i][k];
            }
        }
    }
    for (i = 0; i < V; i++)
    {
        const int hangs = s->area[i] > 0.0 && r->triangle[i] < r->triangle_count;
        sss_hao__set_triangle(a, i, hangs ? r->triangle[i] : 0);
        memset(a->weight[i], 0xff, sizeof a->weight[i]); // dark
        if (hangs)
        {
            sss_hao__code_weights(r->weight[i], a->weight[i]);
        }
    }
}

// Vertices in the order given, reference points first, those without light nowhere.
static void sss_hao__make_list(sss_hao__storing *s, const uint32_t *order)
{
    const size_t V = s->a->stats.vertex_count;
    size_t i;
    int references;
    for (references = s->place != NULL ? 1 : 0; references >= 0; references--)
    {
        for (i = 0; i < V; i++)
        {
            const uint32_t v = order != NULL ? order[i] : (uint32_t)i;
            const int is = s->place != NULL && s->place[v] != SSS_HAO__NONE;
            if (is == references && s->area[v] > 0.0)
            {
                s->list[s->reference_count + s->list_count] = v;
                s->reference_count += is ? 1 : 0;
                s->list_count += is ? 0 : 1;
            }
        }
    }
}

static sss_result sss_hao__store_references(sss_hao__storing *s, sss_hao__power *sum)
{
    const double share = 0.98 * (double)s->reference_count / ((double)s->reference_count + (double)s->list_count + 1.0);
    const double first[2] = {0.0, share}, then[2] = {share, share}, others[2] = {share, 0.98};
    sss_result result = sss_hao__take_coefficients(s);
    if (result == SSS_OK)
    {
        result = sss_hao__run(s, s->list, s->reference_count, sss_hao__keep_known, first, sum);
    }
    if (result == SSS_OK)
    {
        result = sss_hao__make_tables(s, s->r->count);
    }
    if (result == SSS_OK)
    {
        result = sss_hao__run(s, s->list, s->reference_count, sss_hao__fit_references, then, sum);
    }
    if (result == SSS_OK && s->sharp != NULL)
    {
        sss_hao__parallel(s->hooks, s->r->count * s->a->channels, sss_hao__sharpen_task, s);
        sss_hao__parallel(s->hooks, s->r->triangle_count, sss_hao__span_task, s);
        sss_hao__find_fans(s);
    }
    if (result == SSS_OK)
    {
        result = sss_hao__run(s, s->list + s->reference_count, s->list_count, sss_hao__fit_others, others, sum);
    }
    return result == SSS_OK ? sss_hao__code_coefficients(s, sum) : result;
}

// ---- all of them ----

static size_t sss_hao__lighting_count(const sss_hao *a)
{
    const size_t harmonics = a->shells * a->terms;
    return a->stats.storage == SSS_HAO_REFERENCES  ? a->lights + harmonics
           : a->stats.storage == SSS_HAO_HARMONICS ? harmonics
                                                   : a->lights;
}

// What saving writes, but for a short header; what can be computed again from its count, the lattice, is not written.
static void sss_hao__count_bytes(sss_hao *a)
{
    const size_t V = a->stats.vertex_count, R = a->stats.reference_count, RT = a->stats.reference_triangle_count;
    const size_t entries = a->channels * a->shells * a->terms, width = a->channels * a->lights;
    const size_t tables = a->channels * SSS_HAO__LEVELS * sizeof(float), small = 65536;
    size_t vertices = 0, references = 0, rest = a->shells * sizeof(double);
    rest += a->set.cells == 0 ? a->set.count * 4 * sizeof(double) : 0;
    switch (a->stats.storage)
    {
    case SSS_HAO_FLOAT: vertices = V * width * sizeof(float); break;
    case SSS_HAO_VECTORS: vertices = V * width * 3 * sizeof(float); break;
    case SSS_HAO_TABLE:
        vertices = V * width;
        rest += tables;
        break;
    case SSS_HAO_HARMONICS:
        vertices = V * entries * sizeof(int16_t);
        rest += entries * 2 * sizeof(float);
        break;
    case SSS_HAO_REFERENCES:
        vertices = V * ((RT <= small ? 2 : 4) + 2 * sizeof(uint16_t)) + sss_hao__blocks(V) * entries * SSS_HAO__LANES;
        references = R * (width + sizeof(uint32_t)) + RT * 3 * (size_t)(R <= small ? 2 : 4);
        rest += tables + entries * 2 * sizeof(float);
        break;
    }
    a->stats.bytes_vertices = vertices;
    a->stats.bytes_references = references;
    a->stats.bytes_tables = rest;
    a->stats.bytes_per_vertex = ((double)vertices + (double)references + (double)rest) / (double)V;
}

static void sss_hao__report(sss_hao *a, const sss_hao__references *r, const sss_hao__power *sum)
{
    sss_hao_stats *stats = &a->stats;
    stats->lighting_count = sss_hao__lighting_count(a);
    stats->reference_count = r != NULL ? r->count : 0;
    stats->reference_triangle_count = r != NULL ? r->triangle_count : 0;
    stats->storage_error = sum->signal > 0.0 ? sqrt(sss_hao__max(sum->error, 0.0) / sum->signal) : 0.0;
    stats->snr_db = sum->table_error > 0.0 ? 10.0 * log10(sum->table_signal / sum->table_error) : 0.0;
    sss_hao__count_bytes(a);
}

static sss_result sss_hao__take_buffers(sss_hao__storing *s)
{
    sss_hao__memory *m = &s->a->memory;
    s->list = (uint32_t *)sss_hao__take(m, s->a->stats.vertex_count, sizeof *s->list);
    s->buffer = (float *)sss_hao__take(m, sss_hao__times(SSS_HAO__SLOTS * SSS_HAO__GROUP, s->width), sizeof(float));
    s->work = (float *)sss_hao__take(m, sss_hao__times(SSS_HAO__SLOTS * 2, s->a->lights), sizeof(float));
    return m->failed ? SSS_ERROR_OUT_OF_MEMORY : SSS_OK;
}

static void sss_hao__drop_storing(sss_hao__storing *s)
{
    sss_hao__memory *m = &s->a->memory;
    sss_hao__drop(m, s->list);
    sss_hao__drop(m, s->place);
    sss_hao__drop(m, s->buffer);
    sss_hao__drop(m, s->work);
    sss_hao__drop(m, s->known);
    sss_hao__drop(m, s->sharp);
    sss_hao__drop(m, s->sharpened);
    sss_hao__drop(m, s->span);
    sss_hao__drop(m, s->fan_begin);
    sss_hao__drop(m, s->fan);
    sss_hao__drop(m, s->halfway);
    sss_hao__drop(m, s->linear);
    sss_hao__drop(m, s->largest);
    sss_hao__drop(m, s->coefficient);
    sss_hao__drop_fit(m, &s->fit);
}

// Buffers, reference points as the object keeps them, and the list of vertices.
static sss_result sss_hao__begin_storing(sss_hao__storing *s, const uint32_t *order)
{
    sss_result result = sss_hao__take_buffers(s);
    if (result == SSS_OK && s->r != NULL)
    {
        result = sss_hao__take_references(s);
    }
    if (result != SSS_OK)
    {
        return result;
    }
    if (s->r != NULL)
    {
        sss_hao__copy_references(s);
    }
    sss_hao__make_list(s, order);
    return SSS_OK;
}

// Fills the arrays of a's storage from rows. On errors the owner drops all of a->memory.
static sss_result sss_hao__store(sss_hao *a, const sss_hooks *hooks, const double *vertex_area,
                                 const sss_hao__references *r, const uint32_t *order, sss_hao__rows rows, void *user)
{
    const size_t parts = a->stats.storage == SSS_HAO_VECTORS ? 3 : 1;
    sss_hao__power sum = {0.0, 0.0, 0.0, 0.0};
    sss_hao__storing s;
    sss_result result;
    memset(&s, 0, sizeof s);
    s.a = a;
    s.hooks = hooks;
    s.area = vertex_area;
    s.r = a->stats.storage == SSS_HAO_REFERENCES ? r : NULL;
    s.rows = rows;
    s.user = user;
    s.width = a->channels * parts * a->lights;
    s.entries = a->channels * a->shells * a->terms;
    if (a->stats.storage == SSS_HAO_REFERENCES && (r == NULL || r->count == 0 || r->triangle_count == 0))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    result = sss_hao__begin_storing(&s, order);
    if (result != SSS_OK)
    {
        return result;
    }
    switch (a->stats.storage)
    {
    case SSS_HAO_FLOAT:
    case SSS_HAO_VECTORS: result = sss_hao__store_floats(&s, &sum); break;
    case SSS_HAO_TABLE: result = sss_hao__store_table(&s, &sum); break;
    case SSS_HAO_HARMONICS: result = sss_hao__store_harmonics(&s, &sum); break;
    case SSS_HAO_REFERENCES: result = sss_hao__store_references(&s, &sum); break;
    }
    if (result == SSS_OK)
    {
        sss_hao__report(a, s.r, &sum);
        sss_hao__drop_storing(&s);
    }
    return result;
}

// ---- relighting ----
// A lighting is mostly zeros. What is not is collected once, in batches that fit on the stack, and then all rows run
// through each batch: sums grow in the same order however rows are split.

#define SSS_HAO__BATCH 256

typedef struct sss_hao__batch
{
    size_t count, next;                     // next: entry of the lighting at which the next batch begins
    int run;                                // indices rise by one
    uint32_t index[SSS_HAO__BATCH];
    float weight[3][SSS_HAO__BATCH];        // of each channel in use
    float base[3];                          // constant of each channel: sum of lighting times offset
} sss_hao__batch;

// Which of a lighting's colours counts.
static size_t sss_hao__color_of(const sss_hao *a, size_t channel)
{
    return a->channels == 1 ? a->stats.channel : channel;
}

// Entries [first, last) of a lighting that are not zero, or all after the first of them.   index counts from `first`
static void sss_hao__collect(const sss_hao *a, const float *lighting, size_t from, size_t last, size_t first, int all,
                             sss_hao__batch *batch)
{
    size_t i, c;
    batch->count = 0;
    batch->base[0] = batch->base[1] = batch->base[2] = 0.0f;
    for (i = from; i < last && batch->count < SSS_HAO__BATCH; i++)
    {
        const float *color = lighting + 3 * i;
        if ((all && batch->count > 0) || color[0] != 0.0f || color[1] != 0.0f || color[2] != 0.0f)
        {
            batch->index[batch->count] = (uint32_t)(i - first);
            for (c = 0; c < a->channels; c++)
            {
                batch->weight[c][batch->count] = color[sss_hao__color_of(a, c)];
            }
            batch->count++;
        }
    }
    batch->next = i;
    batch->run = batch->count > 0 && batch->index[batch->count - 1] - batch->index[0] + 1 == batch->count;
}

// Coefficients of harmonics are offset + scale times code: folds both into a batch of them.
static void sss_hao__fold(const sss_hao *a, sss_hao__batch *batch)
{
    const size_t entries = a->shells * a->terms;
    size_t c, k;
    for (c = 0; c < a->channels; c++)
    {
        double base = 0.0;
        for (k = 0; k < batch->count; k++)
        {
            const size_t entry = c * entries + batch->index[k];
            base += (double)batch->weight[c][k] * (double)a->offset[entry];
            batch->weight[c][k] *= a->scale[entry];
        }
        batch->base[c] = (float)base;
    }
}

// For shaders: of shell 0, harmonics [terms] in place of codes' weights, bias what is left.
static void sss_hao__fold_harmonics(const sss_hao *a, const float *lighting, float (*harmonics)[4], float bias[4])
{
    const size_t first = a->stats.storage == SSS_HAO_REFERENCES ? a->lights : 0, entries = a->shells * a->terms;
    size_t c, t;
    for (c = 0; c < 4; c++)
    {
        double sum = 0.0;
        for (t = 0; t < a->terms; t++)
        {
            const size_t channel = a->channels == 1 ? 0 : c % 3;
            const float light = c < 3 ? lighting[3 * (first + t) + sss_hao__color_of(a, channel)] : 0.0f;
            harmonics[t][c] = light * a->scale[channel * entries + t];
            sum += (double)light * (double)a->offset[channel * entries + t];
        }
        bias[c] = (float)sum;
    }
}

static float sss_hao__sum_lanes(const float *sums)
{
    float half[8], quarter[4];
    size_t k;
    for (k = 0; k < 8; k++)
    {
        half[k] = sums[k] + sums[k + 8];
    }
    for (k = 0; k < 4; k++)
    {
        quarter[k] = half[k] + half[k + 4];
    }
    return (quarter[0] + quarter[2]) + (quarter[1] + quarter[3]);
}

// Sum over a batch of weights times table entries. Four sums: one would wait for itself.
static float sss_hao__look_up(const sss_hao__batch *batch, size_t c, const float *table, const unsigned char *codes)
{
    const float *weight = batch->weight[c];
    const uint32_t *index = batch->index;
    float sums[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    size_t k;
    for (k = 0; k + 4 <= batch->count; k += 4)
    {
        sums[0] += weight[k] * table[codes[index[k]]];
        sums[1] += weight[k + 1] * table[codes[index[k + 1]]];
        sums[2] += weight[k + 2] * table[codes[index[k + 2]]];
        sums[3] += weight[k + 3] * table[codes[index[k + 3]]];
    }
    for (; k < batch->count; k++)
    {
        sums[0] += weight[k] * table[codes[index[k]]];
    }
    return (sums[0] + sums[2]) + (sums[1] + sums[3]);
}

static float sss_hao__dot_floats(const sss_hao__batch *batch, size_t c, const float *q)
{
    const float *weight = batch->weight[c];
    float sums[SSS_HAO__LANES] = {0.0f}, rest = 0.0f;
    size_t k = 0, i;
    if (batch->run)
    {
        const float *from = q + batch->index[0];
        for (; k + SSS_HAO__LANES <= batch->count; k += SSS_HAO__LANES)
        {
            for (i = 0; i < SSS_HAO__LANES; i++)
            {
                sums[i] += weight[k + i] * from[k + i];
            }
        }
        rest = sss_hao__sum_lanes(sums);
    }
    for (; k < batch->count; k++)
    {
        rest += weight[k] * q[batch->index[k]];
    }
    return rest;
}

// B of the reference points, [R][4].
static void sss_hao__relight_references(const sss_hao *a, const float *lighting, float *references)
{
    const size_t R = a->stats.reference_count;
    sss_hao__batch batch;
    size_t i, c, from = 0;
    memset(references, 0, R * 4 * sizeof *references);
    do
    {
        sss_hao__collect(a, lighting, from, a->lights, 0, 0, &batch);
        for (i = 0; i < R; i++)
        {
            for (c = 0; c < a->channels; c++)
            {
                const unsigned char *codes = a->code + (i * a->channels + c) * a->lights;
                references[4 * i + c] += sss_hao__look_up(&batch, c, a->table + c * SSS_HAO__LEVELS, codes);
            }
        }
        from = batch.next;
    } while (from < a->lights);
    for (i = 0; i < R && a->channels == 1; i++)
    {
        references[4 * i + 1] = references[4 * i + 2] = references[4 * i];
    }
}

// One value of the storages that keep a number for each light.
static float sss_hao__relight_value(const sss_hao *a, const sss_hao__batch *batch, size_t vertex, size_t c)
{
    const size_t row = (vertex * a->channels + c) * a->lights;
    double sum = 0.0;
    size_t k, i;
    if (a->stats.storage == SSS_HAO_TABLE)
    {
        return sss_hao__look_up(batch, c, a->table + c * SSS_HAO__LEVELS, a->code + row);
    }
    if (a->stats.storage == SSS_HAO_FLOAT)
    {
        return sss_hao__dot_floats(batch, c, a->q + row);
    }
    for (k = 0; k < batch->count; k++) // Q_j . w_j
    {
        const double *w = a->set.direction[batch->index[k] % a->set.count];
        double q = 0.0;
        for (i = 0; i < 3; i++)
        {
            q += w[i] * (double)a->q[3 * row + i * a->lights + batch->index[k]];
        }
        sum += (double)batch->weight[c][k] * q;
    }
    return (float)sum;
}

static void sss_hao__clamp(float *values, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++)
    {
        values[i] = values[i] > 0.0f ? values[i] : 0.0f;
    }
}

static void sss_hao__relight_lights(const sss_hao *a, const float *lighting, size_t begin, size_t end, float *radiosity)
{
    sss_hao__batch batch;
    size_t v, c, from = 0;
    memset(radiosity + begin * a->channels, 0, (end - begin) * a->channels * sizeof *radiosity);
    do
    {
        sss_hao__collect(a, lighting, from, a->lights, 0, 0, &batch);
        for (v = begin; v < end && batch.count > 0; v++)
        {
            for (c = 0; c < a->channels; c++)
            {
                radiosity[v * a->channels + c] += sss_hao__relight_value(a, &batch, v, c);
            }
        }
        from = batch.next;
    } while (from < a->lights);
    sss_hao__clamp(radiosity + begin * a->channels, (end - begin) * a->channels);
}

// ---- the same for streams of harmonics, in wide registers ----
// Paths agree within 1e-6 of full scale: they differ in the order of sums and in how often they round.

// Sum over a run of 16-bit codes times weights.
static float sss_hao__dot_shorts1(const int16_t *codes, const float *weight, size_t count)
{
    float sums[SSS_HAO__LANES] = {0.0f}, rest;
    size_t k, i;
    for (k = 0; k + SSS_HAO__LANES <= count; k += SSS_HAO__LANES)
    {
        for (i = 0; i < SSS_HAO__LANES; i++)
        {
            sums[i] += weight[k + i] * (float)codes[k + i];
        }
    }
    rest = sss_hao__sum_lanes(sums);
    for (; k < count; k++)
    {
        rest += weight[k] * (float)codes[k];
    }
    return rest;
}

#if defined(SSS_HAO__AVX2)
SSS_HAO__TARGET8 static float sss_hao__dot_shorts8(const int16_t *codes, const float *weight, size_t count)
{
    __m256 sums[2] = {_mm256_setzero_ps(), _mm256_setzero_ps()};
    float lanes[8], rest;
    size_t k;
    for (k = 0; k + 8 <= count; k += 8)
    {
        const __m256i wide = _mm256_cvtepi16_epi32(_mm_loadu_si128((const __m128i *)(const void *)(codes + k)));
        sums[k / 8 % 2] = _mm256_fmadd_ps(_mm256_cvtepi32_ps(wide), _mm256_loadu_ps(weight + k), sums[k / 8 % 2]);
    }
    _mm256_storeu_ps(lanes, _mm256_add_ps(sums[0], sums[1]));
    rest = ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
    for (; k < count; k++)
    {
        rest += weight[k] * (float)codes[k];
    }
    return rest;
}
#endif

static void sss_hao__relight_harmonics(const sss_hao *a, int lanes, const float *lighting, size_t begin, size_t end,
                                       float *radiosity)
{
    const size_t entries = a->shells * a->terms;
    sss_hao__batch batch;
    size_t i, from = 0;
    memset(radiosity + begin * a->channels, 0, (end - begin) * a->channels * sizeof *radiosity);
    (void)lanes;
    do
    {
        sss_hao__collect(a, lighting, from, entries, 0, 1, &batch);
        sss_hao__fold(a, &batch);
        for (i = begin * a->channels; i < end * a->channels && batch.count > 0; i++)
        {
            const int16_t *codes = a->harmonic + i * entries + batch.index[0];
            const size_t c = i % a->channels;
            float sum = batch.base[c];
#if defined(SSS_HAO__AVX2)
            sum += lanes > 1 ? sss_hao__dot_shorts8(codes, batch.weight[c], batch.count)
                             : sss_hao__dot_shorts1(codes, batch.weight[c], batch.count);
#else
            sum += sss_hao__dot_shorts1(codes, batch.weight[c], batch.count);
#endif
            radiosity[i] += sum;
        }
        from = batch.next;
    } while (from < entries);
    sss_hao__clamp(radiosity + begin * a->channels, (end - begin) * a->channels);
}

// ---- reference points and residuals: blocks of sixteen vertices ----

// What the kernels read of a block, and where they write it.
typedef struct sss_hao__lit_block
{
    const sss_hao__batch *batch;
    const float (*references)[4];       // [R]; of a later batch one that is dark
    size_t channels, stride;            // stride: bytes of a channel's residuals
    float floor;                        // below which values are raised to it: 0, or -INFINITY where more is added yet
    const unsigned char *residual;      // [channels][M][terms][LANES] of the block
    const uint16_t (*weight)[2];        // [LANES]
    uint32_t corner[SSS_HAO__LANES][3]; // references
    float sums[3][SSS_HAO__LANES];      // of base and residuals
    float *out;                         // [LANES][channels], and room for a float more
} sss_hao__lit_block;

static void sss_hao__residuals1(sss_hao__lit_block *s)
{
    size_t c, k, i;
    for (c = 0; c < s->channels; c++)
    {
        const unsigned char *from = s->residual + c * s->stride;
        float sums[SSS_HAO__LANES];
        for (i = 0; i < SSS_HAO__LANES; i++)
        {
            sums[i] = s->batch->base[c];
        }
        for (k = 0; k < s->batch->count; k++)
        {
            const unsigned char *codes = from + (size_t)s->batch->index[k] * SSS_HAO__LANES;
            const float weight = s->batch->weight[c][k];
            for (i = 0; i < SSS_HAO__LANES; i++)
            {
                sums[i] += weight * (float)codes[i];
            }
        }
        memcpy(s->sums[c], sums, sizeof sums);
    }
}

// B = w_1 B_1 + w_2 B_2 + w_3 B_3 + residual: the equation of 4.2 turned around.
static void sss_hao__mix1(sss_hao__lit_block *s)
{
    size_t i, c;
    for (i = 0; i < SSS_HAO__LANES; i++)
    {
        const float *q1 = s->references[s->corner[i][0]], *q2 = s->references[s->corner[i][1]];
        const float *q3 = s->references[s->corner[i][2]];
        const int dark = sss_hao__dark(s->weight[i]);
        const float w1 = (float)s->weight[i][0] * (1.0f / 65535.0f), w2 = (float)s->weight[i][1] * (1.0f / 65535.0f);
        const float w3 = 1.0f - w1 - w2;
        for (c = 0; c < s->channels; c++)
        {
            const float sum = dark ? 0.0f : s->sums[c][i] + (w1 * q1[c] + w2 * q2[c] + w3 * q3[c]);
            s->out[i * s->channels + c] = sum > s->floor ? sum : s->floor;
        }
    }
}

#if defined(SSS_HAO__AVX2)
SSS_HAO__TARGET8 static void sss_hao__residuals8(sss_hao__lit_block *s)
{
    size_t c, k;
    for (c = 0; c < s->channels; c++)
    {
        const unsigned char *from = s->residual + c * s->stride;
        __m256 low = _mm256_set1_ps(s->batch->base[c]), high = low;
        for (k = 0; k < s->batch->count; k++)
        {
            const unsigned char *at = from + (size_t)s->batch->index[k] * SSS_HAO__LANES;
            const __m128i first = _mm_loadl_epi64((const __m128i *)(const void *)at);
            const __m128i second = _mm_loadl_epi64((const __m128i *)(const void *)(at + 8));
            const __m256 weight = _mm256_set1_ps(s->batch->weight[c][k]);
            low = _mm256_fmadd_ps(_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(first)), weight, low);
            high = _mm256_fmadd_ps(_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(second)), weight, high);
        }
        _mm256_storeu_ps(s->sums[c], low);
        _mm256_storeu_ps(s->sums[c] + 8, high);
    }
}

// Weights of eight vertices; where they are dark they, and the sums, become zero.
SSS_HAO__TARGET8 static inline void sss_hao__weights8(sss_hao__lit_block *s, size_t from, float (*w)[SSS_HAO__LANES])
{
    const __m256i both = _mm256_loadu_si256((const __m256i *)(const void *)(s->weight + from));
    const __m256i first = _mm256_and_si256(both, _mm256_set1_epi32(65535)), second = _mm256_srli_epi32(both, 16);
    const __m256i sum = _mm256_add_epi32(first, second);
    const __m256 dark = _mm256_castsi256_ps(_mm256_cmpgt_epi32(sum, _mm256_set1_epi32(65535)));
    const __m256 unit = _mm256_andnot_ps(dark, _mm256_set1_ps(1.0f / 65535.0f));
    const __m256 w1 = _mm256_mul_ps(_mm256_cvtepi32_ps(first), unit);
    const __m256 w2 = _mm256_mul_ps(_mm256_cvtepi32_ps(second), unit);
    const __m256 one = _mm256_andnot_ps(dark, _mm256_set1_ps(1.0f));
    size_t c;
    _mm256_storeu_ps(w[0] + from, w1);
    _mm256_storeu_ps(w[1] + from, w2);
    _mm256_storeu_ps(w[2] + from, _mm256_sub_ps(_mm256_sub_ps(one, w1), w2));
    for (c = 0; c < s->channels; c++)
    {
        _mm256_storeu_ps(s->sums[c] + from, _mm256_andnot_ps(dark, _mm256_loadu_ps(s->sums[c] + from)));
    }
}

// One vertex: sum is its residual, RGB and 0.
SSS_HAO__TARGET8 static inline __m128 sss_hao__mix_vertex(const sss_hao__lit_block *s, float (*w)[SSS_HAO__LANES],
                                                          size_t i, __m128 sum)
{
    const float (*references)[4] = s->references;
    const uint32_t *corner = s->corner[i];
    sum = _mm_fmadd_ps(_mm_set1_ps(w[0][i]), _mm_loadu_ps(references[corner[0]]), sum);
    sum = _mm_fmadd_ps(_mm_set1_ps(w[1][i]), _mm_loadu_ps(references[corner[1]]), sum);
    sum = _mm_fmadd_ps(_mm_set1_ps(w[2][i]), _mm_loadu_ps(references[corner[2]]), sum);
    return _mm_max_ps(sum, _mm_set1_ps(s->floor));
}

SSS_HAO__TARGET8 static void sss_hao__mix8(sss_hao__lit_block *s)
{
    const __m128 zero = _mm_setzero_ps();
    float w[3][SSS_HAO__LANES];
    size_t i;
    sss_hao__weights8(s, 0, w);
    sss_hao__weights8(s, 8, w);
    for (i = 0; i < SSS_HAO__LANES && s->channels == 1; i++)
    {
        s->out[i] = _mm_cvtss_f32(sss_hao__mix_vertex(s, w, i, _mm_set_ss(s->sums[0][i])));
    }
    for (i = 0; i < SSS_HAO__LANES && s->channels == 3; i += 4) // four vertices: from three rows to RGB0 each
    {
        const __m128 r = _mm_loadu_ps(s->sums[0] + i), g = _mm_loadu_ps(s->sums[1] + i);
        const __m128 b = _mm_loadu_ps(s->sums[2] + i);
        const __m128 rg01 = _mm_unpacklo_ps(r, g), rg23 = _mm_unpackhi_ps(r, g);
        const __m128 b01 = _mm_unpacklo_ps(b, zero), b23 = _mm_unpackhi_ps(b, zero);
        const __m128 first = sss_hao__mix_vertex(s, w, i, _mm_movelh_ps(rg01, b01));
        const __m128 second = sss_hao__mix_vertex(s, w, i + 1, _mm_movehl_ps(b01, rg01));
        const __m128 third = sss_hao__mix_vertex(s, w, i + 2, _mm_movelh_ps(rg23, b23));
        const __m128 fourth = sss_hao__mix_vertex(s, w, i + 3, _mm_movehl_ps(b23, rg23));
        _mm_storeu_ps(s->out + 3 * i, first); // each but the last is overwritten where it is 0
        _mm_storeu_ps(s->out + 3 * i + 3, second);
        _mm_storeu_ps(s->out + 3 * i + 6, third);
        _mm_storeu_ps(s->out + 3 * i + 9, fourth);
    }
}
#endif

#if defined(SSS_HAO__AVX512)
// Sixteen codes times a weight. Masked forms: gcc 12 warns of the registers that the others leave undefined.
SSS_HAO__TARGET16 static inline __m512 sss_hao__add_codes16(const unsigned char *at, float weight, __m512 sum)
{
    const __mmask16 all = 0xffff;
    const __m512i codes = _mm512_maskz_cvtepu8_epi32(all, _mm_loadu_si128((const __m128i *)(const void *)at));
    return _mm512_fmadd_ps(_mm512_maskz_cvtepi32_ps(all, codes), _mm512_set1_ps(weight), sum);
}

SSS_HAO__TARGET16 static void sss_hao__residuals16(sss_hao__lit_block *s)
{
    const sss_hao__batch *batch = s->batch;
    __m512 r = _mm512_set1_ps(batch->base[0]), g = _mm512_set1_ps(batch->base[1]), b = _mm512_set1_ps(batch->base[2]);
    size_t k;
    for (k = 0; k < batch->count && s->channels == 1; k++)
    {
        r = sss_hao__add_codes16(s->residual + (size_t)batch->index[k] * SSS_HAO__LANES, batch->weight[0][k], r);
    }
    for (k = 0; k < batch->count && s->channels == 3; k++)
    {
        const unsigned char *at = s->residual + (size_t)batch->index[k] * SSS_HAO__LANES;
        r = sss_hao__add_codes16(at, batch->weight[0][k], r);
        g = sss_hao__add_codes16(at + s->stride, batch->weight[1][k], g);
        b = sss_hao__add_codes16(at + 2 * s->stride, batch->weight[2][k], b);
    }
    _mm512_storeu_ps(s->sums[0], r);
    _mm512_storeu_ps(s->sums[1], g);
    _mm512_storeu_ps(s->sums[2], b);
}
#endif

static void sss_hao__find_corners(const sss_hao *a, size_t vertex, size_t count, uint32_t (*corner)[3])
{
    const uint16_t *triangle16 = a->triangle16, *corner16 = a->corner16;
    size_t i, k;
    for (i = 0; i < count && triangle16 != NULL && corner16 != NULL; i++)
    {
        const uint16_t *from = corner16 + 3 * (size_t)triangle16[vertex + i];
        corner[i][0] = from[0];
        corner[i][1] = from[1];
        corner[i][2] = from[2];
    }
    for (; i < count; i++)
    {
        const size_t triangle = triangle16 != NULL ? triangle16[vertex + i] : a->triangle32[vertex + i];
        for (k = 0; k < 3; k++)
        {
            corner[i][k] = corner16 != NULL ? corner16[3 * triangle + k] : a->corner32[3 * triangle + k];
        }
    }
}

// Sums of a block's residuals, then the reference points.
static void sss_hao__relight_block(int lanes, sss_hao__lit_block *s)
{
#if defined(SSS_HAO__AVX512)
    if (lanes == 16)
    {
        sss_hao__residuals16(s);
        sss_hao__mix8(s);
        return;
    }
#endif
#if defined(SSS_HAO__AVX2)
    if (lanes == 8)
    {
        sss_hao__residuals8(s);
        sss_hao__mix8(s);
        return;
    }
#endif
    (void)lanes;
    sss_hao__residuals1(s);
    sss_hao__mix1(s);
}

// One batch for rows [begin, end): the first writes, those after it add.
static void sss_hao__relight_blocks(const sss_hao *a, int lanes, sss_hao__lit_block *s, int first, size_t begin,
                                    size_t end, float *radiosity)
{
    float out[3 * SSS_HAO__LANES + 1];
    uint16_t weight[SSS_HAO__LANES][2] = {{0, 0}};
    size_t v = begin, i;
    while (v < end)
    {
        const size_t lane = v % SSS_HAO__LANES, from = v - lane;
        const size_t vertices = sss_hao__smaller(a->stats.vertex_count - from, SSS_HAO__LANES);
        const size_t count = sss_hao__smaller(end - v, SSS_HAO__LANES - lane);
        const int inside = first && lane == 0 && end - v > SSS_HAO__LANES; // the float beyond is written again
        float *to = radiosity + v * s->channels;
        s->out = inside ? to : out;
        s->residual = a->residual + from * (s->stride / SSS_HAO__LANES) * s->channels;
        s->weight = (const uint16_t (*)[2])(a->weight + from);
        if (vertices < SSS_HAO__LANES)
        {
            memcpy(weight, a->weight + from, vertices * sizeof *weight);
            s->weight = (const uint16_t (*)[2])weight;
        }
        if (first)
        {
            sss_hao__find_corners(a, from, vertices, s->corner);
        }
        sss_hao__relight_block(lanes, s);
        for (i = 0; i < count * s->channels && !inside; i++)
        {
            to[i] = first ? out[lane * s->channels + i] : to[i] + out[lane * s->channels + i];
        }
        v += count;
    }
}

static void sss_hao__relight_residuals(const sss_hao *a, int lanes, const float *lighting, const float *references,
                                       size_t begin, size_t end, float *radiosity)
{
    const size_t last = a->lights + a->shells * a->terms;
    const float dark[1][4] = {{0.0f, 0.0f, 0.0f, 0.0f}};
    sss_hao__batch batch;
    sss_hao__lit_block s;
    size_t from = a->lights;
    memset(&s, 0, sizeof s);
    s.batch = &batch;
    s.references = (const float (*)[4])references;
    s.channels = a->channels;
    s.stride = a->shells * a->terms * SSS_HAO__LANES;
    do
    {
        const int first = from == a->lights;
        sss_hao__collect(a, lighting, from, last, a->lights, 0, &batch);
        sss_hao__fold(a, &batch);
        if (!first) // nothing but harmonics
        {
            s.references = dark;
            memset(s.corner, 0, sizeof s.corner);
        }
        s.floor = first && batch.next >= last ? 0.0f : -INFINITY;
        sss_hao__relight_blocks(a, lanes, &s, first, begin, end, radiosity);
        from = batch.next;
    } while (from < last);
    if (s.floor < 0.0f)
    {
        sss_hao__clamp(radiosity + begin * a->channels, (end - begin) * a->channels);
    }
}

static void sss_hao__relight_lanes(const sss_hao *a, int lanes, const float *lighting, const float *references,
                                   size_t begin, size_t end, float *radiosity)
{
    if (a->stats.storage == SSS_HAO_REFERENCES)
    {
        sss_hao__relight_residuals(a, lanes, lighting, references, begin, end, radiosity);
    }
    else if (a->stats.storage == SSS_HAO_HARMONICS)
    {
        sss_hao__relight_harmonics(a, lanes, lighting, begin, end, radiosity);
    }
    else
    {
        sss_hao__relight_lights(a, lighting, begin, end, radiosity);
    }
}

static void sss_hao__relight_rows(const sss_hao *a, const float *lighting, const float *references, size_t begin,
                                  size_t end, float *radiosity)
{
    sss_hao__relight_lanes(a, sss_hao__lanes_here(), lighting, references, begin, end, radiosity);
}

// ============================================== THE OBJECT =============================================

// ---- checks and options ----

#define SSS_HAO__MAX_SET 65536     // directions in a set of the caller's
#define SSS_HAO__MAX_DISTANCES 64
#define SSS_HAO__MOST_COLOR 1e30   // of lights: sums of many still fit into float
#define SSS_HAO__EXTREME 1e100     // lengths of a profile in units of the build: their cubes still fit into double

static int sss_hao__in_range(double x, double low, double high)
{
    return sss_hao__finite(x) && x >= low && x <= high;
}

static int sss_hao__all_finite(const float *values, size_t count)
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

static int sss_hao__valid_hooks(const sss_hooks *hooks)
{
    return hooks == NULL || hooks->allocate == NULL || hooks->release != NULL;
}

static sss_result sss_hao__check_mesh(const sss_mesh *mesh)
{
    size_t i;
    if (mesh == NULL || mesh->positions == NULL || mesh->triangles == NULL
        || !sss_hao__in_range(mesh->mm_per_unit, 1e-100, 1e100))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (mesh->vertex_count == 0 || mesh->triangle_count == 0)
    {
        return SSS_ERROR_EMPTY;
    }
    // Vertices and corners are numbered in 32 bits, with one number left for "none".
    if (mesh->vertex_count > UINT32_MAX - 64 || mesh->triangle_count > (UINT32_MAX - 64) / 3
        || mesh->vertex_count > SIZE_MAX / (64 * sizeof(double))
        || mesh->triangle_count > SIZE_MAX / (64 * sizeof(double)))
    {
        return SSS_ERROR_OVERFLOW;
    }
    if (!sss_hao__all_finite(mesh->positions, 3 * mesh->vertex_count)
        || (mesh->normals != NULL && !sss_hao__all_finite(mesh->normals, 3 * mesh->vertex_count)))
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

static int sss_hao__valid_profile(const sss_profile *p)
{
    const double most = 1e300;
    int c;
    if (p == NULL || !sss_hao__in_range(p->eta, 0.1, 10.0) || !sss_hao__in_range(p->F_internal, 0.0, 1.0)
        || !sss_hao__in_range(p->F_external, 0.0, 1.0) || p->F_internal == 1.0 || p->F_external == 1.0)
    {
        return 0;
    }
    for (c = 0; c < 3; c++)
    {
        if (!sss_hao__in_range(p->alpha_p[c], 0.0, 1.0) || !sss_hao__in_range(p->sigma_tr[c], 0.0, most)
            || !sss_hao__in_range(p->z_r[c], 0.0, most) || !sss_hao__in_range(p->z_v[c], 0.0, most)
            || (p->alpha_p[c] > 0.0 && !(p->z_r[c] > 0.0 && p->z_v[c] > 0.0)))
        {
            return 0;
        }
    }
    return 1;
}

static int sss_hao__valid_directions(const sss_hao_options *o)
{
    if (o->direction_set == NULL)
    {
        return sss_hao__lattice_cells(o->directions) > 0;
    }
    return o->directions >= 4 && o->directions <= SSS_HAO__MAX_SET
           && sss_hao__all_finite(o->direction_set, 3 * o->directions);
}

// Falling from one to the next.
static int sss_hao__valid_distances(const sss_hao_options *o)
{
    size_t i;
    if (o->distance_count > SSS_HAO__MAX_DISTANCES || (o->distance_count > 0 && o->distances == NULL))
    {
        return 0;
    }
    for (i = 0; i < o->distance_count; i++)
    {
        if (!sss_hao__in_range(o->distances[i], 1e-300, 1e300) || (i > 0 && o->distances[i] >= o->distances[i - 1]))
        {
            return 0;
        }
    }
    return 1;
}

static int sss_hao__has_harmonics(sss_hao_storage storage)
{
    return storage == SSS_HAO_REFERENCES || storage == SSS_HAO_HARMONICS;
}

// How integrals are kept: defaults filled in, 0 where a storage has no use for it. 0 where one is out of range.
//   directions  as resolved: no more coefficients than these can be found
static int sss_hao__resolve_storage(const sss_hao_options *given, size_t vertex_count, size_t directions,
                                    sss_hao_options *out)
{
    if ((int)given->storage < 0 || given->storage > SSS_HAO_VECTORS || given->order > 8 || (int)given->weights < 0
        || given->weights > SSS_HAO_BARYCENTRIC)
    {
        return 0;
    }
    out->storage = given->storage;
    out->weights = given->storage == SSS_HAO_REFERENCES ? given->weights : SSS_HAO_FITTED;
    out->order = 0;
    out->reference_count = 0;
    if (sss_hao__has_harmonics(given->storage))
    {
        const size_t most = (size_t)sqrt((double)directions), usual = given->storage == SSS_HAO_REFERENCES ? 3 : 7;
        out->order = given->order > 0 ? given->order : usual < most ? usual : most;
        if (out->order > most)
        {
            return 0;
        }
    }
    if (given->storage == SSS_HAO_REFERENCES)
    {
        // Fitted to table I, 1,034 reference points on 14,521 vertices and 10,285 on 437,645, less what indices take.
        // Smaller meshes have features as large and little to save.
        const double wanted = floor(1.22 * pow((double)vertex_count, 0.683) + 0.5), least = 850.0;
        const size_t count = given->reference_count > 0 ? given->reference_count : (size_t)sss_hao__max(wanted, least);
        out->reference_count = count < vertex_count ? count : vertex_count;
    }
    return 1;
}

// Options as given, with defaults filled in; range = 0 is left: it follows from the material. 0 where one is out of
// range.
static int sss_hao__resolve(const sss_hao_options *given, size_t vertex_count, sss_hao_options *out)
{
    sss_hao_options none;
    size_t cells;
    memset(&none, 0, sizeof none);
    given = given != NULL ? given : &none;
    *out = *given;
    out->tolerance = given->tolerance == 0.0 ? 5e-3 : given->tolerance;
    out->directions = given->directions == 0 ? 198 : given->directions;
    out->channels = given->channels == 0 ? 3 : given->channels;
    out->channel = out->channels == 1 ? given->channel : 0;
    out->no_shadows = given->no_shadows != 0;
    if (!sss_hao__in_range(out->tolerance, 1e-5, 0.1) || !(given->range >= 0.0)
        || !sss_hao__valid_directions(out) || !sss_hao__valid_distances(out)
        || (out->channels != 1 && out->channels != 3) || out->channel > 2 || (int)out->interpolation < 0
        || out->interpolation > SSS_HAO_FOUR_NEAREST || (int)out->quadrature < 0
        || out->quadrature > SSS_HAO_OTHER_VERTICES || (int)out->sums < 0 || out->sums > SSS_HAO_ALL_PAIRS)
    {
        return 0;
    }
    cells = out->direction_set == NULL ? sss_hao__lattice_cells(out->directions) : 0;
    out->directions = cells > 0 ? cells * cells + 2 : out->directions;
    return sss_hao__resolve_storage(given, vertex_count, out->directions, out);
}

// Whether the largest arrays can be counted in size_t.
static int sss_hao__countable(double vertices, double channels, double parts, double lights)
{
    const double columns = parts * lights + SSS_HAO__PROBES + SSS_HAO__LANES; // padded
    return (vertices + SSS_HAO__LANES) * channels * columns * sizeof(double) < (double)(SIZE_MAX / 2);
}

static sss_result sss_hao__check(const sss_mesh *mesh, const sss_profile *profile, const sss_hao_options *given,
                                 sss_hao_options *out)
{
    const sss_result result = sss_hao__check_mesh(mesh);
    if (result != SSS_OK)
    {
        return result;
    }
    if (!sss_hao__valid_profile(profile) || !sss_hao__resolve(given, mesh->vertex_count, out))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    return sss_hao__countable((double)mesh->vertex_count, (double)out->channels,
                              out->storage == SSS_HAO_VECTORS ? 3.0 : 1.0,
                              (double)out->directions * (double)(1 + out->distance_count))
               ? SSS_OK
               : SSS_ERROR_OVERFLOW;
}

// ---- hashes ----

#define SSS_HAO__HASH_START 14695981039346656037u // FNV-1a (Fowler, Noll, Vo), by words instead of bytes
#define SSS_HAO__HASH_PRIME 1099511628211u

// FNV-1a of words; the upper half is folded in so that it reaches the lower one as well. Each step is a bijection of
// the hash: no change of a single word goes unnoticed.
static uint64_t sss_hao__mix(uint64_t hash, uint32_t word)
{
    hash = (hash ^ word) * SSS_HAO__HASH_PRIME;
    return hash ^ hash >> 32;
}

static uint64_t sss_hao__mix_u64(uint64_t hash, uint64_t value)
{
    return sss_hao__mix(sss_hao__mix(hash, (uint32_t)(value & UINT32_MAX)), (uint32_t)(value >> 32));
}

static uint64_t sss_hao__mix_doubles(uint64_t hash, const double *values, size_t count)
{
    uint64_t bits;
    size_t i;
    for (i = 0; i < count; i++)
    {
        memcpy(&bits, values + i, sizeof bits);
        hash = sss_hao__mix_u64(hash, bits);
    }
    return hash;
}

static uint64_t sss_hao__mix_floats(uint64_t hash, const float *values, size_t count)
{
    uint32_t word;
    size_t i;
    for (i = 0; i < count; i++)
    {
        memcpy(&word, values + i, sizeof word);
        hash = sss_hao__mix(hash, word);
    }
    return hash;
}

static uint64_t sss_hao__hash_mesh(const sss_mesh *mesh)
{
    uint64_t hash = SSS_HAO__HASH_START;
    size_t i;
    hash = sss_hao__mix_u64(hash, mesh->vertex_count);
    hash = sss_hao__mix_u64(hash, mesh->triangle_count);
    hash = sss_hao__mix_doubles(hash, &mesh->mm_per_unit, 1);
    hash = sss_hao__mix_floats(hash, mesh->positions, 3 * mesh->vertex_count);
    for (i = 0; i < 3 * mesh->triangle_count; i++)
    {
        hash = sss_hao__mix(hash, mesh->triangles[i]);
    }
    hash = sss_hao__mix(hash, mesh->normals != NULL ? 1u : 0u);
    return mesh->normals != NULL ? sss_hao__mix_floats(hash, mesh->normals, 3 * mesh->vertex_count) : hash;
}

// Of how integrals are kept. It goes into an object's hash by exclusive or, so that sss_hao_compress, which knows
// neither the material nor the lights' options any more, can take one out and put another in.
static uint64_t sss_hao__hash_storage(const sss_hao_options *o)
{
    uint64_t hash = sss_hao__mix(SSS_HAO__HASH_START, (uint32_t)o->storage);
    hash = sss_hao__mix(hash, (uint32_t)o->weights);
    hash = sss_hao__mix_u64(hash, o->reference_count);
    return sss_hao__mix_u64(hash, o->order);
}

// Of a mesh's hash, a profile and options as resolved.
static uint64_t sss_hao__hash_all(uint64_t mesh_hash, const sss_profile *p, const sss_hao_options *o)
{
    uint64_t hash = mesh_hash;
    hash = sss_hao__mix_doubles(hash, p->alpha_p, 3);
    hash = sss_hao__mix_doubles(hash, p->sigma_tr, 3);
    hash = sss_hao__mix_doubles(hash, p->z_r, 3);
    hash = sss_hao__mix_doubles(hash, p->z_v, 3);
    hash = sss_hao__mix_doubles(hash, &p->eta, 1);
    hash = sss_hao__mix_doubles(hash, &p->F_internal, 1);
    hash = sss_hao__mix_doubles(hash, &p->F_external, 1);
    hash = sss_hao__mix_doubles(hash, &o->tolerance, 1);
    hash = sss_hao__mix_doubles(hash, &o->range, 1);
    hash = sss_hao__mix_u64(hash, o->directions);
    hash = sss_hao__mix(hash, o->direction_set != NULL ? 1u : 0u);
    hash = o->direction_set != NULL ? sss_hao__mix_floats(hash, o->direction_set, 3 * o->directions) : hash;
    hash = sss_hao__mix_u64(hash, o->distance_count);
    hash = sss_hao__mix_doubles(hash, o->distances, o->distance_count);
    hash = sss_hao__mix_u64(hash, o->channels);
    hash = sss_hao__mix_u64(hash, o->channel);
    hash = sss_hao__mix(hash, (uint32_t)o->interpolation);
    hash = sss_hao__mix(hash, (uint32_t)o->quadrature);
    hash = sss_hao__mix(hash, (uint32_t)o->sums);
    hash = sss_hao__mix(hash, o->no_shadows ? 1u : 0u);
    hash = sss_hao__mix(hash, o->visibility != NULL ? 1u : 0u);
    return hash ^ sss_hao__hash_storage(o);
}

SSS_HAO_API sss_result sss_hao_hash(const sss_mesh *mesh, const sss_profile *profile, const sss_hao_options *options,
                                    uint64_t *out)
{
    sss_hao_options resolved;
    const sss_result result = sss_hao__check(mesh, profile, options, &resolved);
    if (result != SSS_OK || out == NULL)
    {
        return result != SSS_OK ? result : SSS_ERROR_INVALID_ARGUMENT;
    }
    *out = sss_hao__hash_all(sss_hao__hash_mesh(mesh), profile, &resolved);
    return SSS_OK;
}

// ---- what is told of a mesh ----

#define SSS_HAO__BORDER_BINS 512
#define SSS_HAO__BORDER_ROUNDING 1e-12 // of all edges' length: below this a bin's sum is rounding
#define SSS_HAO__VOLUME_ROUNDING 1e-6  // of areas times distances: corners are given as float, a sheet encloses nothing

typedef struct sss_hao__condition
{
    double bins[SSS_HAO__BORDER_BINS];
    double edge_sum, longest_edge, border; // lengths in the positions' unit
    double area, area_against, volume, volume_size; // twice the areas, six times the volumes
    double center[3];
} sss_hao__condition;

// An edge's ends in order, by their bits, so that it is the same edge from either side; -0 is 0. 1, -1; 0: no length.
static int sss_hao__edge_order(const float *p, const float *q, uint64_t *hash)
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

static void sss_hao__inspect_triangle(const float *positions, const float *normals, const uint32_t *v,
                                      sss_hao__condition *c)
{
    double e[3][3], corner[3], cross[3], length;
    int i, k;
    for (k = 0; k < 3; k++)
    {
        const float *const p = positions + 3 * (size_t)v[k], *const q = positions + 3 * (size_t)v[(k + 1) % 3];
        uint64_t hash;
        const int order = sss_hao__edge_order(p, q, &hash);
        for (i = 0; i < 3; i++)
        {
            e[k][i] = (double)q[i] - (double)p[i];
        }
        length = sqrt(sss_hao__dot(e[k], e[k]));
        c->edge_sum += length;
        c->longest_edge = sss_hao__max(c->longest_edge, length);
        c->bins[hash % SSS_HAO__BORDER_BINS] += (double)order * length;
    }
    for (i = 0; i < 3; i++)
    {
        corner[i] = (double)positions[3 * (size_t)v[0] + (size_t)i] - c->center[i];
    }
    sss_hao__cross(e[0], e[1], cross);
    length = sqrt(sss_hao__dot(cross, cross));
    c->area += length;
    c->volume += sss_hao__dot(corner, cross);
    c->volume_size += sqrt(sss_hao__dot(corner, corner)) * length;
    for (k = 0; k < 3 && normals != NULL; k++)
    {
        const float *const n = normals + 3 * (size_t)v[k];
        const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
        c->area_against += sss_hao__dot(normal, cross) < 0.0 ? length / 3.0 : 0.0;
    }
}

// How edges pair up, without a table of edges: each counts with a sign by its direction, into the bin that its place
// decides. The two sides of an inner edge cancel; what is left in the bins is at most the length of the border, and
// nearly all of it where there are fewer border edges than bins.
//   positions  [][3];   normals  [][3] or NULL
static void sss_hao__inspect(const float *positions, const float *normals, const uint32_t *triangles, size_t count,
                             sss_hao__condition *c)
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
        sss_hao__inspect_triangle(positions, normals, triangles + 3 * t, c);
    }
    for (k = 0; k < SSS_HAO__BORDER_BINS; k++)
    {
        c->border += fabs(c->bins[k]) > SSS_HAO__BORDER_ROUNDING * c->edge_sum ? fabs(c->bins[k]) : 0.0;
    }
}

// Into the stats.   mm  a unit of the positions
static void sss_hao__tell_condition(const sss_hao__condition *c, size_t count, double mm, const sss_profile *profile,
                                    sss_hao_stats *stats)
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
    stats->inside_out = c->volume < -SSS_HAO__VOLUME_ROUNDING * c->volume_size;
}

// ---- the mesh ----

// Moves the mesh to the center of its box and scales it by a power of two, which rounds nothing, to a diagonal in
// [1, 2): powers of lengths stay far from both ends of double, whatever the unit. The box is that of the triangles:
// vertices outside of them must not cost the others their digits.
static sss_result sss_hao__set_frame(sss_hao__build *b, const sss_mesh *mesh)
{
    double low[3], high[3], size[3], scale, radius = 0.0;
    size_t i;
    int exponent = 1, k;
    b->x = (double (*)[3])sss_hao__take(&b->memory, b->vertex_count, sizeof *b->x);
    if (b->x == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (k = 0; k < 3; k++)
    {
        low[k] = high[k] = (double)mesh->positions[3 * (size_t)mesh->triangles[0] + (size_t)k];
        for (i = 0; i < 3 * b->triangle_count; i++)
        {
            const double p = (double)mesh->positions[3 * (size_t)mesh->triangles[i] + (size_t)k];
            low[k] = sss_hao__min(low[k], p);
            high[k] = sss_hao__max(high[k], p);
        }
        b->center[k] = 0.5 * (low[k] + high[k]);
        size[k] = high[k] - low[k];
    }
    if (sss_hao__length(size) > 0.0)
    {
        frexp(sss_hao__length(size), &exponent);
    }
    scale = ldexp(1.0, 1 - exponent);
    b->unit = ldexp(1.0, exponent - 1);
    b->mm = b->unit * mesh->mm_per_unit;
    for (i = 0; i < 3 * b->vertex_count; i++)
    {
        b->x[i / 3][i % 3] = ((double)mesh->positions[i] - b->center[i % 3]) * scale;
    }
    for (i = 0; i < 3 * b->triangle_count; i++)
    {
        radius = sss_hao__max(radius, sss_hao__length(b->x[mesh->triangles[i]]));
    }
    memcpy(b->stats.center, b->center, sizeof b->center);
    b->stats.bounding_radius = radius * b->mm;
    return SSS_OK;
}

// A third of each triangle's area to its corners; the paper's dA (section 3.1).
static sss_result sss_hao__set_areas(sss_hao__build *b)
{
    size_t t;
    int k;
    b->area = (double *)sss_hao__take(&b->memory, b->vertex_count, sizeof *b->area);
    b->triangle_area = (double *)sss_hao__take(&b->memory, b->triangle_count, sizeof *b->triangle_area);
    if (b->area == NULL || b->triangle_area == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (t = 0; t < b->triangle_count; t++)
    {
        const uint32_t *v = b->triangles + 3 * t;
        double e[3], f[3], cross[3];
        for (k = 0; k < 3; k++)
        {
            e[k] = b->x[v[1]][k] - b->x[v[0]][k];
            f[k] = b->x[v[2]][k] - b->x[v[0]][k];
        }
        sss_hao__cross(e, f, cross);
        b->triangle_area[t] = 0.5 * sss_hao__length(cross);
        for (k = 0; k < 3; k++)
        {
            b->area[v[k]] += b->triangle_area[t] / 3.0;
        }
    }
    return SSS_OK;
}

// Adds each triangle's normal, weighted by its angle, to its corners.   sums [V][3], zero
static void sss_hao__sum_normals(const sss_hao__build *b, double (*sums)[3])
{
    size_t t;
    int k, i;
    for (t = 0; t < b->triangle_count; t++)
    {
        const uint32_t *v = b->triangles + 3 * t;
        for (k = 0; k < 3; k++)
        {
            const double *x = b->x[v[k]], *y = b->x[v[(k + 1) % 3]], *z = b->x[v[(k + 2) % 3]];
            double e[3], f[3], cross[3], length, angle;
            for (i = 0; i < 3; i++)
            {
                e[i] = y[i] - x[i];
                f[i] = z[i] - x[i];
            }
            sss_hao__normalize(e);
            sss_hao__normalize(f);
            sss_hao__cross(e, f, cross);
            length = sss_hao__length(cross);
            angle = atan2(length, sss_hao__dot(e, f));
            for (i = 0; i < 3 && length > 0.0; i++)
            {
                sums[v[k]][i] += angle * cross[i] / length;
            }
        }
    }
}

// Unit length, whatever the length is; 0 stays 0.   Returns the length; it may overflow
static double sss_hao__normalize_any(const double v[3], double out[3])
{
    const double most = sss_hao__max(fabs(v[0]), sss_hao__max(fabs(v[1]), fabs(v[2])));
    double length;
    int i;
    for (i = 0; i < 3; i++)
    {
        out[i] = most > 0.0 ? v[i] / most : 0.0;
    }
    length = sss_hao__length(out);
    sss_hao__normalize(out);
    return most * length;
}

// Given ones, and means of the triangles' where none is given, or a zero.
static sss_result sss_hao__set_normals(sss_hao__build *b, const float *normals)
{
    double (*sums)[3] = (double (*)[3])sss_hao__take(&b->memory, b->vertex_count, sizeof *sums);
    size_t v;
    int i;
    b->normal = (float (*)[3])sss_hao__take(&b->memory, b->vertex_count, sizeof *b->normal);
    if (sums == NULL || b->normal == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_hao__sum_normals(b, sums);
    for (v = 0; v < b->vertex_count; v++)
    {
        double n[3];
        for (i = 0; i < 3; i++)
        {
            n[i] = normals != NULL ? (double)normals[3 * v + (size_t)i] : 0.0;
        }
        if (n[0] == 0.0 && n[1] == 0.0 && n[2] == 0.0)
        {
            memcpy(n, sums[v], sizeof n);
        }
        sss_hao__normalize_any(n, n);
        for (i = 0; i < 3; i++)
        {
            b->normal[v][i] = (float)n[i];
        }
    }
    sss_hao__drop(&b->memory, sums);
    return SSS_OK;
}

// A length in units of the build. 0 stays: it means none.
static double sss_hao__scaled(double length, double mm)
{
    return length > 0.0 ? sss_hao__min(sss_hao__max(length / mm, 1.0 / SSS_HAO__EXTREME), SSS_HAO__EXTREME) : 0.0;
}

// The channels in use first, in units of the build; others like the first.
static void sss_hao__set_profile(sss_hao__build *b, const sss_profile *p)
{
    size_t c;
    b->profile = *p;
    b->channels = b->options.channels;
    for (c = 0; c < 3; c++)
    {
        const size_t from = b->channels == 1 ? b->options.channel : c;
        b->profile.alpha_p[c] = p->alpha_p[from];
        b->profile.sigma_tr[c] = sss_hao__min(p->sigma_tr[from] * b->mm, SSS_HAO__EXTREME);
        b->profile.z_r[c] = sss_hao__scaled(p->z_r[from], b->mm);
        b->profile.z_v[c] = sss_hao__scaled(p->z_v[from], b->mm);
    }
}

// ---- creating ----

#define SSS_HAO__CACHE_LINE 64 // of workspaces: a cache line

// Next fraction to hooks.progress.
static sss_result sss_hao__tell(const sss_hooks *hooks, double fraction)
{
    return hooks->progress != NULL && hooks->progress(hooks->user, fraction) != 0 ? SSS_ERROR_CANCELLED : SSS_OK;
}

// Hooks for one stage, which counts its progress from 0 to 1.
typedef struct sss_hao__stage
{
    const sss_hooks *hooks;
    double from, to;
} sss_hao__stage;

static int sss_hao__stage_progress(void *user, double fraction)
{
    const sss_hao__stage *stage = (const sss_hao__stage *)user;
    return stage->hooks->progress(stage->hooks->user, stage->from + (stage->to - stage->from) * fraction);
}

static void sss_hao__stage_parallel(void *user, size_t count, void (*task)(void *context, size_t begin, size_t end),
                                   void *context)
{
    const sss_hao__stage *stage = (const sss_hao__stage *)user;
    stage->hooks->parallel_for(stage->hooks->user, count, task, context);
}

static sss_hooks sss_hao__stage_hooks(sss_hao__stage *stage)
{
    sss_hooks hooks;
    memset(&hooks, 0, sizeof hooks);
    hooks.user = stage;
    hooks.parallel_for = stage->hooks->parallel_for != NULL ? sss_hao__stage_parallel : NULL;
    hooks.progress = stage->hooks->progress != NULL ? sss_hao__stage_progress : NULL;
    return hooks;
}

// The object lies in its own memory. NULL where there is none.
static sss_hao *sss_hao__new(const sss_hooks *hooks)
{
    sss_hao__memory memory;
    sss_hao *a;
    memset(&memory, 0, sizeof memory);
    if (hooks != NULL)
    {
        memory.hooks = *hooks;
    }
    a = (sss_hao *)sss_hao__take(&memory, 1, sizeof *a);
    if (a != NULL)
    {
        a->memory = memory;
    }
    return a;
}

SSS_HAO_API void sss_hao_free(sss_hao *hao)
{
    if (hao != NULL)
    {
        sss_hao__memory memory = hao->memory; // freed with the rest
        sss_hao__drop_all(&memory);
    }
}

// Where rows of integrals come from while they are computed: for each slot a workspace and a group's columns.
typedef struct sss_hao__row_source
{
    const sss_hao__build *b;
    unsigned char *memory;
    size_t slot_bytes, workspace_bytes;
} sss_hao__row_source;

static size_t sss_hao__aligned(size_t bytes)
{
    return (bytes + SSS_HAO__CACHE_LINE - 1) / SSS_HAO__CACHE_LINE * SSS_HAO__CACHE_LINE;
}

// A slot's columns [SSS_HAO__GROUP][channels][C].
static float *sss_hao__slot_columns(const sss_hao__row_source *source, size_t slot)
{
    return (float *)(void *)(source->memory + slot * source->slot_bytes + source->workspace_bytes);
}

static sss_result sss_hao__open_row_source(sss_hao__row_source *source, sss_hao__build *b)
{
    unsigned char *memory;
    source->b = b;
    source->workspace_bytes = sss_hao__aligned(sss_hao__workspace_bytes(b));
    source->slot_bytes = source->workspace_bytes
                         + sss_hao__aligned(SSS_HAO__GROUP * b->channels * b->columns * sizeof(float));
    memory = (unsigned char *)sss_hao__take(&b->memory, SSS_HAO__SLOTS + 1, source->slot_bytes);
    if (memory == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    // The slot too many leaves room to begin at a cache line.
    source->memory = memory + (SSS_HAO__CACHE_LINE - (uintptr_t)memory % SSS_HAO__CACHE_LINE) % SSS_HAO__CACHE_LINE;
    return SSS_OK;
}

// Integrals of vertices, for sss_hao__store: those of the lights, without the probes.
static void sss_hao__compute_rows(void *user, size_t slot, const uint32_t *vertices, size_t count, float *out)
{
    const sss_hao__row_source *source = (const sss_hao__row_source *)user;
    const size_t columns = source->b->columns, lights = source->b->parts * source->b->lights;
    float *all = sss_hao__slot_columns(source, slot);
    size_t row;
    sss_hao__sum_group(source->b, vertices, count, source->memory + slot * source->slot_bytes, all);
    for (row = 0; row < count * source->b->channels; row++)
    {
        memcpy(out + row * lights, all + row * columns, lights * sizeof *out);
    }
}

// ---- the error of interpolating between directions ----

// Sampled vertices, a slot for each item; samples go to items in turn.
typedef struct sss_hao__probing
{
    const sss_hao__row_source *source;
    uint32_t vertex[SSS_HAO__SAMPLES];
    size_t count;
    double (*error)[2]; // [SSS_HAO__SAMPLES] of a vertex: sums of squares of differences, and of what is right
} sss_hao__probing;

// What interpolation gives for the light of a probe, as relighting does it.   row [C] of one channel
static double sss_hao__interpolate_row(const sss_hao__build *b, const float *row, const double w[3])
{
    uint32_t index[4];
    double weight[4], sum = 0.0;
    int i, k;
    sss_hao__interpolate(&b->set, w, index, weight);
    if (b->parts == 3)
    {
        float Q[4][3];
        double vector[3];
        for (i = 0; i < 4; i++)
        {
            for (k = 0; k < 3; k++)
            {
                Q[i][k] = row[(size_t)k * b->lights + index[i]];
            }
        }
        sss_hao__interpolate_vectors(&b->set, w, index, weight, (const float (*)[3])Q, vector);
        return sss_hao__max(sss_hao__dot(vector, w), 0.0);
    }
    for (i = 0; i < 4; i++)
    {
        sum += weight[i] * (double)row[index[i]];
    }
    return sum;
}

static void sss_hao__probe_task(void *context, size_t begin, size_t end)
{
    sss_hao__probing *probing = (sss_hao__probing *)context;
    const sss_hao__build *b = probing->source->b;
    size_t item, i, c, p;
    for (item = begin; item < end; item++)
    {
        float *rows = sss_hao__slot_columns(probing->source, item);
        void *workspace = probing->source->memory + item * probing->source->slot_bytes;
        for (i = item; i < probing->count; i += SSS_HAO__SLOTS)
        {
            sss_hao__sum_group(b, probing->vertex + i, 1, workspace, rows);
            for (c = 0; c < b->channels; c++)
            {
                const float *row = rows + c * b->columns;
                for (p = 0; p < SSS_HAO__PROBES; p++)
                {
                    const double want = (double)row[b->parts * b->lights + p];
                    const double error = sss_hao__interpolate_row(b, row, b->probe[p]) - want;
                    probing->error[i][0] += error * error;
                    probing->error[i][1] += want * want;
                }
            }
        }
    }
}

// Vertices with an area, evenly along an order in which neighbours are near each other.
static void sss_hao__choose_samples(const sss_hao__build *b, sss_hao__probing *probing)
{
    const uint32_t *order = sss_hao__sum_order(b);
    size_t i, with = 0, seen = 0;
    for (i = 0; i < b->vertex_count; i++)
    {
        with += b->area[i] > 0.0 ? 1 : 0;
    }
    probing->count = 0;
    for (i = 0; i < b->vertex_count && probing->count < SSS_HAO__SAMPLES; i++)
    {
        if (b->area[order[i]] > 0.0)
        {
            const double next = ((double)probing->count + 0.5) * (double)with / SSS_HAO__SAMPLES;
            if (with <= SSS_HAO__SAMPLES || (double)seen >= floor(next))
            {
                probing->vertex[probing->count++] = order[i];
            }
            seen++;
        }
    }
}

// Figure 5's error: of interpolation alone, here as relative L2 norm of B by area.
static sss_result sss_hao__measure_interpolation(sss_hao__build *b, const sss_hao__row_source *source)
{
    sss_hao__probing probing;
    double error = 0.0, sum = 0.0;
    size_t i;
    probing.source = source;
    probing.error = (double (*)[2])sss_hao__take(&b->memory, SSS_HAO__SAMPLES, sizeof *probing.error);
    if (probing.error == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_hao__choose_samples(b, &probing);
    sss_hao__parallel(&b->memory.hooks, SSS_HAO__SLOTS, sss_hao__probe_task, &probing);
    for (i = 0; i < probing.count; i++)
    {
        error += b->area[probing.vertex[i]] * probing.error[i][0];
        sum += b->area[probing.vertex[i]] * probing.error[i][1];
    }
    b->stats.interpolation_error = sum > 0.0 ? sqrt(error / sum) : 0.0;
    sss_hao__drop(&b->memory, probing.error);
    return SSS_OK;
}

// ---- from the build to the object ----

// What stats say from the beginning.
static void sss_hao__begin_stats(sss_hao__build *b)
{
    const sss_hao_options *o = &b->options;
    sss_hao_stats *s = &b->stats;
    s->tolerance = o->tolerance;
    s->directions = o->directions;
    s->distance_count = o->distance_count;
    s->channels = o->channels;
    s->channel = o->channel;
    s->interpolation = o->interpolation;
    s->storage = o->storage;
    s->weights = o->weights;
    s->quadrature = o->quadrature;
    s->sums = o->sums;
    s->vertex_count = b->vertex_count;
    s->triangle_count = b->triangle_count;
}

// Dimensions that follow from the stats.
static void sss_hao__set_dimensions(sss_hao *a)
{
    const sss_hao_stats *s = &a->stats;
    a->channels = s->channels;
    a->shells = 1 + s->distance_count;
    a->lights = a->shells * s->directions;
    a->terms = sss_hao__has_harmonics(s->storage) ? s->order * s->order : 0;
    a->stats.lighting_count = sss_hao__lighting_count(a);
}

static sss_result sss_hao__copy_set(sss_hao *a, const sss_hao__set *set)
{
    a->set = *set;
    a->set.direction = (double (*)[3])sss_hao__take(&a->memory, set->count, sizeof *set->direction);
    a->set.solid_angle = (double *)sss_hao__take(&a->memory, set->count, sizeof *set->solid_angle);
    if (a->set.direction == NULL || a->set.solid_angle == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    memcpy(a->set.direction, set->direction, set->count * sizeof *set->direction);
    memcpy(a->set.solid_angle, set->solid_angle, set->count * sizeof *set->solid_angle);
    return SSS_OK;
}

// What sss_hao_relight writes into.
static sss_result sss_hao__take_scratch(sss_hao *a)
{
    a->lighting = (float *)sss_hao__take(&a->memory, a->stats.lighting_count, 3 * sizeof(float));
    if (a->stats.storage == SSS_HAO_REFERENCES)
    {
        a->references = (float *)sss_hao__take(&a->memory, a->stats.reference_count, 4 * sizeof(float));
    }
    return a->lighting == NULL || (a->stats.storage == SSS_HAO_REFERENCES && a->references == NULL)
               ? SSS_ERROR_OUT_OF_MEMORY
               : SSS_OK;
}

static void sss_hao__finish_stats(sss_hao *a)
{
    sss_hao_stats *s = &a->stats;
    s->predicted_error = sqrt(s->sum_error * s->sum_error + s->interpolation_error * s->interpolation_error
                              + s->storage_error * s->storage_error);
    s->bytes = a->memory.bytes;
}

// The order in which rows are computed: groups of neighbours among reference points, then among the others, which is
// how sss_hao__store asks for them: those that follow each other in the order of all vertices lie too far apart to be
// summed at once. Vertices without light last.   order  [V]
static sss_result sss_hao__order_rows(sss_hao__build *b, const sss_hao__references *r, uint32_t **order)
{
    unsigned char *kind = (unsigned char *)sss_hao__take(&b->memory, b->vertex_count, 1);
    size_t i, first, count = 0;
    int k;
    *order = (uint32_t *)sss_hao__take(&b->memory, b->vertex_count, sizeof **order);
    if (kind == NULL || *order == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (i = 0; i < r->count; i++)
    {
        kind[r->vertex[i]] = 1;
    }
    for (i = 0; i < b->vertex_count; i++)
    {
        kind[i] = (unsigned char)(!(b->area[i] > 0.0) ? 2 : kind[i] == 1 ? 0 : 1);
    }
    for (k = 0; k < 3; k++)
    {
        first = count;
        for (i = 0; i < b->vertex_count; i++)
        {
            if (kind[i] == k)
            {
                (*order)[count++] = (uint32_t)i;
            }
        }
        sss_hao__halve((const double (*)[3])b->x, *order + first, count - first, SSS_HAO__GROUP, 1, NULL);
    }
    sss_hao__drop(&b->memory, kind);
    return SSS_OK;
}

// From integrals to the finished arrays.   fractions of progress: from .. 1
static sss_result sss_hao__keep(sss_hao *a, sss_hao__build *b, const sss_mesh *mesh, sss_hao__rows rows,
                                void *rows_user, double from)
{
    sss_hao__references references;
    uint32_t *order = NULL;
    sss_hao__stage stage;
    sss_hooks hooks;
    const size_t before = b->memory.peak + a->memory.bytes;
    sss_result result = SSS_OK;
    memset(&references, 0, sizeof references);
    b->memory.peak = b->memory.bytes;
    if (a->stats.storage == SSS_HAO_REFERENCES)
    {
        result = sss_hao__choose_references(&b->memory, mesh, b->options.reference_count, &references);
        a->stats.reference_count = references.count;
        a->stats.reference_triangle_count = references.triangle_count;
        result = result == SSS_OK ? sss_hao__tell(&b->memory.hooks, from + 0.02) : result;
    }
    result = result == SSS_OK ? sss_hao__order_rows(b, &references, &order) : result;
    stage.hooks = &b->memory.hooks;
    stage.from = from + 0.02;
    stage.to = 0.99;
    hooks = sss_hao__stage_hooks(&stage);
    result = result == SSS_OK ? sss_hao__store(a, &hooks, b->area, references.count > 0 ? &references : NULL, order,
                                               rows, rows_user)
                              : result;
    result = result == SSS_OK ? sss_hao__take_scratch(a) : result;
    if (result == SSS_OK)
    {
        const size_t after = b->memory.peak + a->memory.peak;
        a->stats.peak_bytes = after > before ? after : before;
        sss_hao__finish_stats(a);
        result = sss_hao__tell(&b->memory.hooks, 1.0);
    }
    return result;
}

// An order at which the set of directions determines the coefficients; one that was asked for stays.
static sss_result sss_hao__settle_order(sss_hao__memory *m, const sss_hao__set *set, int asked, size_t *order)
{
    sss_hao__fit fit;
    sss_result result = SSS_OK;
    do
    {
        *order -= result == SSS_OK ? 0 : 1;
        memset(&fit, 0, sizeof fit);
        result = sss_hao__make_fit(m, set, *order * *order, &fit);
        sss_hao__drop_fit(m, &fit);
    } while (result == SSS_ERROR_INVALID_ARGUMENT && !asked && *order > 1);
    return result;
}

// The mesh in the build, and the lights' distances against it; the set of lights.
static sss_result sss_hao__prepare(sss_hao__build *b, const sss_mesh *mesh, const sss_profile *profile, int asked)
{
    const sss_hao_options *o = &b->options;
    sss_hao__condition condition;
    sss_result result = sss_hao__set_frame(b, mesh);
    result = result == SSS_OK ? sss_hao__set_areas(b) : result;
    result = result == SSS_OK ? sss_hao__set_normals(b, mesh->normals) : result;
    if (result == SSS_OK && o->distance_count > 0
        && !(o->distances[o->distance_count - 1] > b->stats.bounding_radius))
    {
        result = SSS_ERROR_INVALID_ARGUMENT; // section 3.3: between light and mesh there must be nothing
    }
    sss_hao__set_profile(b, profile);
    sss_hao__inspect(mesh->positions, mesh->normals, mesh->triangles, mesh->triangle_count, &condition);
    sss_hao__tell_condition(&condition, mesh->triangle_count, mesh->mm_per_unit, profile, &b->stats);
    result = result == SSS_OK ? sss_hao__make_set(&b->memory, o, &b->set) : result;
    if (result == SSS_OK && b->options.order > 0)
    {
        result = sss_hao__settle_order(&b->memory, &b->set, asked, &b->options.order);
    }
    b->stats.order = b->options.order;
    return result;
}

// What the object takes over from the build before integrals are stored.
static sss_result sss_hao__take_over(sss_hao *a, const sss_hao__build *b, double mm_per_unit)
{
    size_t m;
    a->stats = b->stats;
    a->mm = mm_per_unit;
    sss_hao__set_dimensions(a);
    a->inverse_distance = (double *)sss_hao__take(&a->memory, a->shells, sizeof *a->inverse_distance);
    if (a->inverse_distance == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    for (m = 1; m < a->shells; m++)
    {
        a->inverse_distance[m] = 1.0 / b->options.distances[m - 1];
    }
    return sss_hao__copy_set(a, &b->set);
}

//   asked  the order is the caller's, not a default
static sss_result sss_hao__compute(sss_hao__build *b, const sss_mesh *mesh, const sss_profile *profile, int asked,
                                   sss_hao *a)
{
    const sss_hooks *hooks = &b->memory.hooks;
    sss_hao__row_source source;
    sss_result result = sss_hao__tell(hooks, 0.0);
    result = result == SSS_OK ? sss_hao__prepare(b, mesh, profile, asked) : result;
    result = result == SSS_OK ? sss_hao__make_lights(b) : result;
    result = result == SSS_OK ? sss_hao__tell(hooks, 0.21) : result;
    result = result == SSS_OK ? sss_hao__prepare_sums(b) : result;
    result = result == SSS_OK ? sss_hao__tell(hooks, 0.25) : result;
    result = result == SSS_OK ? sss_hao__open_row_source(&source, b) : result;
    result = result == SSS_OK ? sss_hao__measure_interpolation(b, &source) : result;
    result = result == SSS_OK ? sss_hao__tell(hooks, 0.27) : result;
    if (result == SSS_OK)
    {
        b->stats.range = b->range * b->mm;
        result = sss_hao__take_over(a, b, mesh->mm_per_unit);
    }
    return result == SSS_OK ? sss_hao__keep(a, b, mesh, sss_hao__compute_rows, &source, 0.27) : result;
}

SSS_HAO_API sss_result sss_hao_create(const sss_mesh *mesh, const sss_profile *profile,
                                      const sss_hao_options *options, const sss_hooks *hooks, sss_hao **out)
{
    sss_hao__build build;
    sss_hao *a;
    sss_result result;
    memset(&build, 0, sizeof build);
    result = sss_hao__check(mesh, profile, options, &build.options);
    if (result != SSS_OK)
    {
        return result;
    }
    if (out == NULL || !sss_hao__valid_hooks(hooks))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    a = sss_hao__new(hooks);
    if (a == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    a->mesh_hash = sss_hao__hash_mesh(mesh);
    a->hash = sss_hao__hash_all(a->mesh_hash, profile, &build.options);
    build.memory.hooks = a->memory.hooks;
    build.vertex_count = mesh->vertex_count;
    build.triangle_count = mesh->triangle_count;
    build.triangles = mesh->triangles;
    sss_hao__begin_stats(&build);
    result = sss_hao__compute(&build, mesh, profile, options != NULL && options->order > 0, a);
    sss_hao__drop_all(&build.memory);
    if (result != SSS_OK)
    {
        sss_hao_free(a);
        return result;
    }
    *out = a;
    return SSS_OK;
}

// ---- keeping integrals in another way ----

static void sss_hao__copy_rows(void *user, size_t slot, const uint32_t *vertices, size_t count, float *out)
{
    const sss_hao *from = (const sss_hao *)user;
    const size_t row = from->channels * from->lights;
    size_t i;
    (void)slot;
    for (i = 0; i < count; i++)
    {
        memcpy(out + i * row, from->q + (size_t)vertices[i] * row, row * sizeof *out);
    }
}

// Everything but the arrays of the storage.
static sss_result sss_hao__copy_object(sss_hao *a, const sss_hao *from, const sss_hao_options *o)
{
    sss_hao_stats *s = &a->stats;
    sss_hao_options floats; // how from keeps them
    memset(&floats, 0, sizeof floats);
    floats.storage = SSS_HAO_FLOAT;
    *s = from->stats;
    s->storage = o->storage;
    s->weights = o->weights;
    s->order = o->order;
    s->reference_count = 0;
    s->storage_error = 0.0;
    s->snr_db = 0.0;
    a->mesh_hash = from->mesh_hash;
    a->hash = from->hash ^ sss_hao__hash_storage(&floats) ^ sss_hao__hash_storage(o);
    a->mm = from->mm;
    sss_hao__set_dimensions(a);
    a->inverse_distance = (double *)sss_hao__take(&a->memory, a->shells, sizeof *a->inverse_distance);
    if (a->inverse_distance == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    memcpy(a->inverse_distance, from->inverse_distance, a->shells * sizeof *a->inverse_distance);
    return sss_hao__copy_set(a, &from->set);
}

static sss_result sss_hao__rerun(sss_hao__build *b, const sss_mesh *mesh, const sss_hao *from, int asked, sss_hao *a)
{
    sss_hao source = *from; // tasks take no pointer to const
    sss_result result = sss_hao__tell(&b->memory.hooks, 0.0);
    result = result == SSS_OK ? sss_hao__set_frame(b, mesh) : result;
    result = result == SSS_OK ? sss_hao__set_areas(b) : result;
    result = result == SSS_OK ? sss_hao__copy_object(a, from, &b->options) : result;
    if (result == SSS_OK && b->options.order > 0)
    {
        result = sss_hao__settle_order(&b->memory, &from->set, asked, &a->stats.order);
        sss_hao__set_dimensions(a);
    }
    return result == SSS_OK ? sss_hao__keep(a, b, mesh, sss_hao__copy_rows, &source, 0.01) : result;
}

SSS_HAO_API sss_result sss_hao_compress(const sss_hao *from, const sss_mesh *mesh, const sss_hao_options *options,
                                        const sss_hooks *hooks, sss_hao **out)
{
    sss_hao__build build;
    sss_hao_options none;
    sss_hao *a;
    sss_result result;
    memset(&none, 0, sizeof none);
    memset(&build, 0, sizeof build);
    options = options != NULL ? options : &none;
    if (from == NULL || out == NULL || !sss_hao__valid_hooks(hooks) || from->stats.storage != SSS_HAO_FLOAT
        || options->storage == SSS_HAO_VECTORS
        || !sss_hao__resolve_storage(options, from->stats.vertex_count, from->stats.directions, &build.options))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    result = sss_hao__check_mesh(mesh);
    if (result != SSS_OK || sss_hao__hash_mesh(mesh) != from->mesh_hash)
    {
        return result != SSS_OK ? result : SSS_ERROR_MISMATCH;
    }
    a = sss_hao__new(hooks);
    if (a == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    build.memory.hooks = a->memory.hooks;
    build.vertex_count = mesh->vertex_count;
    build.triangle_count = mesh->triangle_count;
    build.triangles = mesh->triangles;
    build.channels = from->channels;
    build.parts = 1;
    build.shells = from->shells;
    build.lights = from->lights;
    result = sss_hao__rerun(&build, mesh, from, options->order > 0, a);
    sss_hao__drop_all(&build.memory);
    if (result != SSS_OK)
    {
        sss_hao_free(a);
        return result;
    }
    *out = a;
    return SSS_OK;
}

// ---- reading ----

SSS_HAO_API sss_result sss_hao_get_stats(const sss_hao *hao, sss_hao_stats *out)
{
    if (hao == NULL || out == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    *out = hao->stats;
    return SSS_OK;
}

SSS_HAO_API sss_result sss_hao_get_directions(const sss_hao *hao, float *directions, float *solid_angles)
{
    size_t j;
    int k;
    if (hao == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (j = 0; j < hao->set.count; j++)
    {
        for (k = 0; k < 3 && directions != NULL; k++)
        {
            directions[3 * j + (size_t)k] = (float)hao->set.direction[j][k];
        }
        if (solid_angles != NULL)
        {
            solid_angles[j] = (float)hao->set.solid_angle[j];
        }
    }
    return SSS_OK;
}

// Corner k of all reference triangles' corners.
static uint32_t sss_hao__corner(const sss_hao *a, size_t k)
{
    return a->corner16 != NULL ? a->corner16[k] : a->corner32[k];
}

static uint32_t sss_hao__triangle_of(const sss_hao *a, size_t vertex)
{
    return a->triangle16 != NULL ? a->triangle16[vertex] : a->triangle32[vertex];
}

SSS_HAO_API sss_result sss_hao_get_references(const sss_hao *hao, uint32_t *references, uint32_t *corners,
                                              uint32_t *triangle, float *weights)
{
    size_t i;
    if (hao == NULL || hao->stats.storage != SSS_HAO_REFERENCES)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (references != NULL)
    {
        memcpy(references, hao->reference, hao->stats.reference_count * sizeof *references);
    }
    for (i = 0; i < 3 * hao->stats.reference_triangle_count && corners != NULL; i++)
    {
        corners[i] = sss_hao__corner(hao, i);
    }
    for (i = 0; i < hao->stats.vertex_count; i++)
    {
        const int dark = sss_hao__dark(hao->weight[i]);
        const uint32_t w_1 = dark ? 0 : hao->weight[i][0], w_2 = dark ? 0 : hao->weight[i][1];
        if (triangle != NULL)
        {
            triangle[i] = sss_hao__triangle_of(hao, i);
        }
        if (weights != NULL)
        {
            weights[3 * i] = (float)w_1 / 65535.0f;
            weights[3 * i + 1] = (float)w_2 / 65535.0f;
            weights[3 * i + 2] = (float)(65535u - w_1 - w_2) / 65535.0f;
        }
    }
    return SSS_OK;
}

// ---- lights ----

#define SSS_HAO__SLACK 1e-9 // relative: a light put exactly at the nearest distance must not fail by rounding

// A light as relighting sees it.
typedef struct sss_hao__lamp
{
    double w[3];     // unit length, from the mesh's center towards it
    double color[3]; // W/mm^2 at the center on a plane facing it
    size_t shell[2]; // distances around it, 0: infinity
    double share[2]; // of each, sum 1
} sss_hao__lamp;

// The distances that a point light is between, linear in 1/distance (section 3.3).   0 where it is too near
static int sss_hao__find_shells(const sss_hao *a, double distance, sss_hao__lamp *lamp)
{
    const double *u = a->inverse_distance;
    const size_t last = a->shells - 1;
    const double at = sss_hao__min(1.0 / distance, u[last]);
    size_t m = 0;
    if (last == 0 || !(1.0 / distance <= u[last] * (1.0 + SSS_HAO__SLACK)))
    {
        return 0;
    }
    while (m + 2 < a->shells && at > u[m + 1])
    {
        m++;
    }
    lamp->shell[0] = m;
    lamp->shell[1] = m + 1;
    lamp->share[1] = sss_hao__min((at - u[m]) / (u[m + 1] - u[m]), 1.0);
    lamp->share[0] = 1.0 - lamp->share[1];
    return 1;
}

// 0 where the light is not valid.
static int sss_hao__aim(const sss_hao *a, const sss_hao_light *light, sss_hao__lamp *lamp)
{
    const int point = light->kind == SSS_HAO_LIGHT_POINT;
    double v[3], distance;
    int k;
    if (!point && light->kind != SSS_HAO_LIGHT_DIRECTIONAL)
    {
        return 0;
    }
    for (k = 0; k < 3; k++)
    {
        v[k] = point ? light->position[k] - a->stats.center[k] : light->direction[k];
        if (!sss_hao__finite(v[k]) || !sss_hao__in_range(light->color[k], 0.0, SSS_HAO__MOST_COLOR))
        {
            return 0;
        }
        lamp->color[k] = light->color[k];
    }
    distance = sss_hao__normalize_any(v, lamp->w) * a->mm;
    lamp->shell[0] = lamp->shell[1] = 0;
    lamp->share[0] = 1.0;
    lamp->share[1] = 0.0;
    if (!point)
    {
        return v[0] != 0.0 || v[1] != 0.0 || v[2] != 0.0;
    }
    if (!(distance > 0.0) || !sss_hao__find_shells(a, distance, lamp))
    {
        return 0;
    }
    for (k = 0; k < 3; k++)
    {
        lamp->color[k] = lamp->color[k] / distance / distance; // W/sr over mm^2
        if (lamp->color[k] > SSS_HAO__MOST_COLOR)
        {
            return 0;
        }
    }
    return 1;
}

// The first entry of a lighting that belongs to harmonics.
static size_t sss_hao__first_harmonic(const sss_hao *a)
{
    return a->stats.storage == SSS_HAO_HARMONICS ? 0 : a->lights;
}

// Shared among the four nearest directions; in harmonics the exact one.
static void sss_hao__add_lamp(const sss_hao *a, const sss_hao__lamp *lamp, float *lighting)
{
    uint32_t index[4] = {0, 0, 0, 0};
    double weight[4] = {0.0, 0.0, 0.0, 0.0}, y[64];
    size_t k;
    int shell, i, c;
    if (a->stats.storage != SSS_HAO_HARMONICS)
    {
        sss_hao__interpolate(&a->set, lamp->w, index, weight);
    }
    if (a->terms > 0)
    {
        sss_hao__harmonics(a->stats.order, lamp->w, y);
    }
    for (shell = 0; shell < 2; shell++)
    {
        const size_t m = lamp->shell[shell];
        float *lights = lighting + 3 * m * a->set.count;
        float *harmonics = lighting + 3 * (sss_hao__first_harmonic(a) + m * a->terms);
        for (c = 0; c < 3 && lamp->share[shell] > 0.0; c++)
        {
            const double color = lamp->share[shell] * lamp->color[c];
            for (i = 0; i < 4 && a->stats.storage != SSS_HAO_HARMONICS; i++)
            {
                lights[3 * (size_t)index[i] + (size_t)c] += (float)(color * weight[i]);
            }
            for (k = 0; k < a->terms; k++)
            {
                harmonics[3 * k + (size_t)c] += (float)(color * y[k]);
            }
        }
    }
}

SSS_HAO_API sss_result sss_hao_add_lights(const sss_hao *hao, const sss_hao_light *lights, size_t count,
                                          float *lighting)
{
    sss_hao__lamp lamp;
    size_t i;
    if (hao == NULL || lighting == NULL || (lights == NULL && count > 0))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < count; i++)
    {
        if (!sss_hao__aim(hao, &lights[i], &lamp))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
    }
    for (i = 0; i < count; i++)
    {
        sss_hao__aim(hao, &lights[i], &lamp);
        sss_hao__add_lamp(hao, &lamp, lighting);
    }
    return SSS_OK;
}

// Integrals over all directions of radiance times q. For lights of the set a sum by their solid angles. Harmonics are
// orthonormal: what is stored in them meets the surrounding coefficient by coefficient, exactly, and bands that the
// surrounding does not have, the third and higher, meet nothing.
SSS_HAO_API sss_result sss_hao_add_environment(const sss_hao *hao, const double sh[9][3], float *lighting)
{
    float *harmonics;
    double y[9];
    size_t j, k;
    int c;
    if (hao == NULL || sh == NULL || lighting == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (k = 0; k < 27; k++)
    {
        if (!sss_hao__in_range(sh[k / 3][k % 3], -SSS_HAO__MOST_COLOR, SSS_HAO__MOST_COLOR))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
    }
    for (j = 0; j < hao->set.count && hao->stats.storage != SSS_HAO_HARMONICS; j++)
    {
        sss_hao__harmonics(3, hao->set.direction[j], y);
        for (c = 0; c < 3; c++)
        {
            double radiance = 0.0;
            for (k = 0; k < 9; k++)
            {
                radiance += sh[k][c] * y[k];
            }
            lighting[3 * j + (size_t)c] += (float)(radiance * hao->set.solid_angle[j]);
        }
    }
    harmonics = lighting + 3 * sss_hao__first_harmonic(hao);
    for (k = 0; k < 27 && k < 3 * hao->terms; k++)
    {
        harmonics[k] += (float)sh[k / 3][k % 3];
    }
    return SSS_OK;
}

// ---- relighting ----

// One relighting on its way.
typedef struct sss_hao__relighting
{
    const sss_hao *a;
    const float *lighting, *references;
    const sss_hao__lamp *lamp; // of vectors: the light that is added
    uint32_t index[4];
    double weight[4];
    float *radiosity;
} sss_hao__relighting;

static void sss_hao__rows_task(void *context, size_t begin, size_t end)
{
    const sss_hao__relighting *r = (const sss_hao__relighting *)context;
    sss_hao__relight_rows(r->a, r->lighting, r->references, begin, end, r->radiosity);
}

// Adds one light: vectors Q interpolated by quaternions, then the dot product with the light's true direction (3.2).
static void sss_hao__vectors_task(void *context, size_t begin, size_t end)
{
    const sss_hao__relighting *r = (const sss_hao__relighting *)context;
    const sss_hao *a = r->a;
    const sss_hao__lamp *lamp = r->lamp;
    size_t row;
    int shell, i, k;
    for (row = begin * a->channels; row < end * a->channels; row++)
    {
        const size_t color = a->channels == 1 ? a->stats.channel : row % a->channels;
        const float *q = a->q + row * 3 * a->lights;
        double sum = 0.0;
        for (shell = 0; shell < 2; shell++)
        {
            const size_t first = lamp->shell[shell] * a->set.count;
            float Q[4][3];
            double vector[3];
            for (i = 0; i < 12; i++)
            {
                Q[i / 3][i % 3] = q[(size_t)(i % 3) * a->lights + first + r->index[i / 3]];
            }
            sss_hao__interpolate_vectors(&a->set, lamp->w, r->index, r->weight, (const float (*)[3])Q, vector);
            sum += lamp->share[shell] * sss_hao__max(sss_hao__dot(vector, lamp->w), 0.0);
        }
        k = sum > 0.0; // a light that does not reach adds nothing, not a rounding
        r->radiosity[row] += k ? (float)(sum * lamp->color[color]) : 0.0f;
    }
}

static void sss_hao__relight_vectors(const sss_hao *a, const sss_hao_light *lights, size_t count, float *radiosity)
{
    sss_hao__relighting r;
    sss_hao__lamp lamp;
    size_t i;
    memset(&r, 0, sizeof r);
    memset(radiosity, 0, a->stats.vertex_count * a->channels * sizeof *radiosity);
    r.a = a;
    r.lamp = &lamp;
    r.radiosity = radiosity;
    for (i = 0; i < count; i++)
    {
        sss_hao__aim(a, &lights[i], &lamp);
        sss_hao__interpolate(&a->set, lamp.w, r.index, r.weight);
        sss_hao__parallel(&a->memory.hooks, a->stats.vertex_count, sss_hao__vectors_task, &r);
    }
}

static void sss_hao__relight_own(sss_hao *hao, const float *lighting, float *radiosity)
{
    sss_hao__relighting r;
    if (hao->stats.storage == SSS_HAO_REFERENCES)
    {
        sss_hao__relight_references(hao, lighting, hao->references);
    }
    memset(&r, 0, sizeof r);
    r.a = hao;
    r.lighting = lighting;
    r.references = hao->references;
    r.radiosity = radiosity;
    sss_hao__parallel(&hao->memory.hooks, hao->stats.vertex_count, sss_hao__rows_task, &r);
}

SSS_HAO_API sss_result sss_hao_relight(sss_hao *hao, const sss_hao_light *lights, size_t count, float *radiosity)
{
    sss_result result;
    if (hao == NULL || radiosity == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    memset(hao->lighting, 0, 3 * hao->stats.lighting_count * sizeof *hao->lighting);
    result = sss_hao_add_lights(hao, lights, count, hao->lighting);
    if (result != SSS_OK)
    {
        return result;
    }
    if (hao->stats.storage == SSS_HAO_VECTORS)
    {
        sss_hao__relight_vectors(hao, lights, count, radiosity);
        return SSS_OK;
    }
    return sss_hao_relight_lighting(hao, hao->lighting, radiosity);
}

SSS_HAO_API sss_result sss_hao_relight_lighting(sss_hao *hao, const float *lighting, float *radiosity)
{
    if (hao == NULL || lighting == NULL || radiosity == NULL
        || !sss_hao__all_finite(lighting, 3 * hao->stats.lighting_count)) // also where float cannot hold so many lights
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    sss_hao__relight_own(hao, lighting, radiosity);
    return SSS_OK;
}

SSS_HAO_API sss_result sss_hao_relight_references(const sss_hao *hao, const float *lighting, float *references)
{
    if (hao == NULL || lighting == NULL || (references == NULL && hao->stats.storage == SSS_HAO_REFERENCES)
        || !sss_hao__all_finite(lighting, 3 * hao->stats.lighting_count))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (hao->stats.storage == SSS_HAO_REFERENCES)
    {
        sss_hao__relight_references(hao, lighting, references);
    }
    return SSS_OK;
}

SSS_HAO_API sss_result sss_hao_relight_rows(const sss_hao *hao, const float *lighting, const float *references,
                                            size_t begin, size_t end, float *radiosity)
{
    if (hao == NULL || lighting == NULL || radiosity == NULL || begin > end || end > hao->stats.vertex_count
        || (references == NULL && hao->stats.storage == SSS_HAO_REFERENCES)
        || !sss_hao__all_finite(lighting, 3 * hao->stats.lighting_count))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    sss_hao__relight_rows(hao, lighting, references, begin, end, radiosity);
    return SSS_OK;
}

// ---- keeping ----
// The format: little-endian, whatever the machine; an array's numbers are as wide as in memory, and zeros fill its last
// word. A header with its own check, the arrays in the order of struct sss_hao, a check of everything. The lattice is
// made again from its size, a set of the caller's is written down.

#define SSS_HAO__MAGIC_LOW 0x48535353u  // "SSSH"
#define SSS_HAO__MAGIC_HIGH 0x20204f41u // "AO  "
#define SSS_HAO__FORMAT 2u
#define SSS_HAO__ENDIAN 0x01020304u
#define SSS_HAO__STREAM_BYTES 16384     // handed to the callbacks at a time, at most
#define SSS_HAO__LOAD_BYTES 1048576     // first allocated for an array that is read: it grows only with what comes

// Saving and loading go through the same functions, so that they cannot disagree.
typedef struct sss_hao__stream
{
    sss_hao_write write; // NULL: loading
    sss_hao_read read;
    void *user;
    uint64_t check;      // of all words so far
    sss_result result;   // of what was done so far: from the first error on nothing is done
    unsigned char bytes[SSS_HAO__STREAM_BYTES];
} sss_hao__stream;

static void sss_hao__fail(sss_hao__stream *s, sss_result result)
{
    s->result = s->result == SSS_OK ? result : s->result;
}

// A number of `size` bytes (1, 2, 4, 8) in the machine's order.
static uint64_t sss_hao__get_number(const unsigned char *place, size_t size)
{
    uint16_t two;
    uint32_t four;
    uint64_t eight;
    switch (size)
    {
    case 1: return *place;
    case 2: memcpy(&two, place, 2); return two;
    case 4: memcpy(&four, place, 4); return four;
    default: memcpy(&eight, place, 8); return eight;
    }
}

static void sss_hao__put_number(uint64_t number, unsigned char *place, size_t size)
{
    const uint16_t two = (uint16_t)(number & UINT16_MAX);
    const uint32_t four = (uint32_t)(number & UINT32_MAX);
    switch (size)
    {
    case 1: *place = (unsigned char)(number & 255u); break;
    case 2: memcpy(place, &two, 2); break;
    case 4: memcpy(place, &four, 4); break;
    default: memcpy(place, &number, 8); break;
    }
}

// Numbers into bytes, lower ones first, or back.
static void sss_hao__to_bytes(const unsigned char *numbers, size_t count, size_t size, unsigned char *bytes)
{
    size_t i, k;
    for (i = 0; i < count; i++)
    {
        const uint64_t number = sss_hao__get_number(numbers + i * size, size);
        for (k = 0; k < size; k++)
        {
            bytes[i * size + k] = (unsigned char)(number >> 8 * k & 255u);
        }
    }
}

static void sss_hao__from_bytes(const unsigned char *bytes, size_t count, size_t size, unsigned char *numbers)
{
    size_t i, k;
    for (i = 0; i < count; i++)
    {
        uint64_t number = 0;
        for (k = 0; k < size; k++)
        {
            number |= (uint64_t)bytes[i * size + k] << 8 * k;
        }
        sss_hao__put_number(number, numbers + i * size, size);
    }
}

static void sss_hao__mix_bytes(sss_hao__stream *s, size_t count)
{
    size_t i;
    for (i = 0; i < count; i += 4)
    {
        const unsigned char *b = s->bytes + i;
        s->check = sss_hao__mix(s->check, (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16
                                              | (uint32_t)b[3] << 24);
    }
}

// Writes numbers, or reads them.   numbers  [count] of `size` bytes each, any type
static void sss_hao__move(sss_hao__stream *s, void *numbers, size_t count, size_t size)
{
    unsigned char *place = (unsigned char *)numbers;
    while (count > 0 && s->result == SSS_OK)
    {
        const size_t room = SSS_HAO__STREAM_BYTES / size;
        const size_t n = count < room ? count : room, used = n * size, filled = (used + 3) / 4 * 4;
        size_t i;
        if (s->write != NULL)
        {
            memset(s->bytes + used, 0, filled - used);
            sss_hao__to_bytes(place, n, size, s->bytes);
        }
        if (s->write != NULL ? s->write(s->user, s->bytes, filled) != 0 : s->read(s->user, s->bytes, filled) != 0)
        {
            s->result = s->write != NULL ? SSS_ERROR_CANCELLED : SSS_ERROR_BAD_DATA;
            return;
        }
        sss_hao__mix_bytes(s, filled);
        if (s->write == NULL)
        {
            sss_hao__from_bytes(s->bytes, n, size, place);
        }
        for (i = used; i < filled; i++)
        {
            if (s->bytes[i] != 0)
            {
                sss_hao__fail(s, SSS_ERROR_BAD_DATA);
            }
        }
        place += used;
        count -= n;
    }
}

static void sss_hao__move_size(sss_hao__stream *s, size_t *value)
{
    uint64_t wide = *value;
    sss_hao__move(s, &wide, 1, 8);
    if (wide > SIZE_MAX)
    {
        sss_hao__fail(s, SSS_ERROR_BAD_DATA);
        return;
    }
    *value = (size_t)wide;
}

// Finite or infinite: ranges may be, and signals without noise.
static void sss_hao__move_double(sss_hao__stream *s, double *value)
{
    double read = *value;
    sss_hao__move(s, &read, 1, 8);
    if (!sss_hao__finite(read) && read != HUGE_VAL && read != -HUGE_VAL)
    {
        sss_hao__fail(s, SSS_ERROR_BAD_DATA);
        return;
    }
    *value = read;
}

// One of an enumeration's values, 0 .. most.
static int sss_hao__move_choice(sss_hao__stream *s, int value, int most)
{
    uint32_t word = (uint32_t)value;
    sss_hao__move(s, &word, 1, 4);
    if (word > (uint32_t)most)
    {
        sss_hao__fail(s, SSS_ERROR_BAD_DATA);
        return 0;
    }
    return (int)word;
}

// A word that has to be there.
static void sss_hao__move_constant(sss_hao__stream *s, uint32_t constant, sss_result otherwise)
{
    uint32_t word = constant;
    sss_hao__move(s, &word, 1, 4);
    if (word != constant)
    {
        sss_hao__fail(s, otherwise);
    }
}

// The check of all that came before.
static void sss_hao__move_check(sss_hao__stream *s)
{
    const uint64_t check = s->check;
    uint64_t found = check;
    sss_hao__move(s, &found, 1, 8);
    if (found != check)
    {
        sss_hao__fail(s, SSS_ERROR_BAD_DATA);
    }
}

// All but those that follow from the rest.
static void sss_hao__move_stats(sss_hao__stream *s, sss_hao_stats *stats)
{
    double *const doubles[] = {&stats->tolerance, &stats->range, &stats->center[0], &stats->center[1],
                               &stats->center[2], &stats->bounding_radius, &stats->truncated_energy,
                               &stats->truncated_worst, &stats->sum_error, &stats->interpolation_error,
                               &stats->storage_error, &stats->predicted_error, &stats->snr_db,
                               &stats->mean_interactions, &stats->edge_paths, &stats->longest_edge_paths,
                               &stats->border_mm, &stats->normals_against};
    size_t *const sizes[] = {&stats->directions, &stats->distance_count, &stats->channels, &stats->channel,
                             &stats->reference_count, &stats->order, &stats->vertex_count, &stats->triangle_count,
                             &stats->reference_triangle_count, &stats->peak_bytes};
    size_t i;
    for (i = 0; i < sizeof doubles / sizeof doubles[0]; i++)
    {
        sss_hao__move_double(s, doubles[i]);
    }
    for (i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
    {
        sss_hao__move_size(s, sizes[i]);
    }
    stats->inside_out = sss_hao__move_choice(s, stats->inside_out, 1);
    stats->storage = (sss_hao_storage)sss_hao__move_choice(s, (int)stats->storage, (int)SSS_HAO_VECTORS);
    stats->interpolation = (sss_hao_interpolation)sss_hao__move_choice(s, (int)stats->interpolation,
                                                                       (int)SSS_HAO_FOUR_NEAREST);
    stats->weights = (sss_hao_weights)sss_hao__move_choice(s, (int)stats->weights, (int)SSS_HAO_BARYCENTRIC);
    stats->quadrature = (sss_hao_quadrature)sss_hao__move_choice(s, (int)stats->quadrature,
                                                                 (int)SSS_HAO_OTHER_VERTICES);
    stats->sums = (sss_hao_sums)sss_hao__move_choice(s, (int)stats->sums, (int)SSS_HAO_ALL_PAIRS);
}

static void sss_hao__move_header(sss_hao__stream *s, sss_hao *a)
{
    sss_hao__move_constant(s, SSS_HAO__MAGIC_LOW, SSS_ERROR_BAD_DATA);
    sss_hao__move_constant(s, SSS_HAO__MAGIC_HIGH, SSS_ERROR_BAD_DATA);
    sss_hao__move_constant(s, SSS_HAO__FORMAT, SSS_ERROR_BAD_VERSION);
    sss_hao__move_constant(s, SSS_HAO__ENDIAN, SSS_ERROR_BAD_VERSION);
    sss_hao__move(s, &a->hash, 1, 8);
    sss_hao__move(s, &a->mesh_hash, 1, 8);
    sss_hao__move_stats(s, &a->stats);
    sss_hao__move_double(s, &a->mm);
    sss_hao__move_size(s, &a->set.cells);
    sss_hao__move_check(s);
}

// The bits of 1e20f. Floats of a file are transport from light to radiosity, of order 1, and scales and offsets of its
// codes: what is larger is forged, and 2^16 times it, summed over the terms, is infinite as soon as a light is bright.
#define SSS_HAO__MOST_BITS 0x60ad78ecu

// What an array may hold.
typedef enum sss_hao__content
{
    SSS_HAO__ANY = 0,
    SSS_HAO__FINITE, // a float within SSS_HAO__MOST_BITS or a double
    SSS_HAO__INDEX   // below a bound
} sss_hao__content;

typedef struct sss_hao__array
{
    size_t count, size; // of its numbers
    sss_hao__content content;
    size_t bound;
} sss_hao__array;

static int sss_hao__valid_number(const unsigned char *place, const sss_hao__array *array)
{
    const uint64_t number = sss_hao__get_number(place, array->size);
    switch (array->content)
    {
    case SSS_HAO__ANY:    return 1;
    case SSS_HAO__FINITE:
        return array->size == 4 ? (number & 0x7fffffffu) <= SSS_HAO__MOST_BITS // bits rise with the float
                                : (number & 0x7ff0000000000000u) != 0x7ff0000000000000u;
    case SSS_HAO__INDEX:  return number < array->bound;
    }
    return 0;
}

static void sss_hao__check_numbers(sss_hao__stream *s, const unsigned char *numbers, size_t begin, size_t end,
                                   const sss_hao__array *array)
{
    size_t i;
    for (i = begin; i < end && array->content != SSS_HAO__ANY && s->result == SSS_OK; i++)
    {
        if (!sss_hao__valid_number(numbers + i * array->size, array))
        {
            sss_hao__fail(s, SSS_ERROR_BAD_DATA);
        }
    }
}

// Numbers are checked as they are read; the array returned is the object's. Memory grows with what has been read: a
// count that lies costs nothing.
static void *sss_hao__move_numbers(sss_hao__stream *s, sss_hao *a, void *given, const sss_hao__array *array)
{
    unsigned char *numbers = (unsigned char *)given;
    size_t done = 0, room = 0;
    if (s->write != NULL)
    {
        sss_hao__move(s, given, array->count, array->size);
        return given;
    }
    do
    {
        void *more;
        room = room == 0 ? SSS_HAO__LOAD_BYTES / array->size : 2 * room;
        room = room < array->count ? room : array->count;
        more = s->result == SSS_OK ? sss_hao__take(&a->memory, room, array->size) : NULL;
        if (more == NULL)
        {
            sss_hao__fail(s, SSS_ERROR_OUT_OF_MEMORY);
            return NULL;
        }
        if (numbers != NULL)
        {
            memcpy(more, numbers, done * array->size);
            sss_hao__drop(&a->memory, numbers);
        }
        numbers = (unsigned char *)more;
        sss_hao__move(s, numbers + done * array->size, room - done, array->size);
        sss_hao__check_numbers(s, numbers, done, room, array);
        done = room;
    } while (done < array->count && s->result == SSS_OK);
    return numbers;
}

static void *sss_hao__move_any(sss_hao__stream *s, sss_hao *a, void *given, size_t count, size_t size)
{
    sss_hao__array array;
    array.count = count;
    array.size = size;
    array.content = SSS_HAO__ANY;
    array.bound = 0;
    return sss_hao__move_numbers(s, a, given, &array);
}

static float *sss_hao__move_floats(sss_hao__stream *s, sss_hao *a, float *given, size_t count)
{
    sss_hao__array array;
    array.count = count;
    array.size = sizeof(float);
    array.content = SSS_HAO__FINITE;
    array.bound = 0;
    return (float *)sss_hao__move_numbers(s, a, given, &array);
}

static double *sss_hao__move_doubles(sss_hao__stream *s, sss_hao *a, double *given, size_t count)
{
    sss_hao__array array;
    array.count = count;
    array.size = sizeof(double);
    array.content = SSS_HAO__FINITE;
    array.bound = 0;
    return (double *)sss_hao__move_numbers(s, a, given, &array);
}

// Indices below a bound: in 16 bits where all fit into them, else in 32.
static void sss_hao__move_indices(sss_hao__stream *s, sss_hao *a, uint16_t **narrow, uint32_t **wide, size_t count,
                                  size_t bound)
{
    sss_hao__array array;
    array.count = count;
    array.size = narrow != NULL && bound <= 65536 ? 2 : 4;
    array.content = SSS_HAO__INDEX;
    array.bound = bound;
    if (array.size == 2)
    {
        *narrow = (uint16_t *)sss_hao__move_numbers(s, a, *narrow, &array);
    }
    else
    {
        *wide = (uint32_t *)sss_hao__move_numbers(s, a, *wide, &array);
    }
}

static void sss_hao__move_set(sss_hao__stream *s, sss_hao *a)
{
    a->set.count = a->stats.directions;
    a->set.four = a->stats.interpolation == SSS_HAO_FOUR_NEAREST;
    if (a->set.cells == 0)
    {
        a->set.direction = (double (*)[3])(void *)sss_hao__move_doubles(s, a, (double *)(void *)a->set.direction,
                                                                        3 * a->set.count);
        a->set.solid_angle = sss_hao__move_doubles(s, a, a->set.solid_angle, a->set.count);
    }
    else if (s->write == NULL && s->result == SSS_OK)
    {
        sss_hao_options options;
        memset(&options, 0, sizeof options);
        options.directions = a->set.count;
        options.interpolation = a->stats.interpolation;
        sss_hao__fail(s, sss_hao__make_set(&a->memory, &options, &a->set));
    }
    a->inverse_distance = sss_hao__move_doubles(s, a, a->inverse_distance, a->shells);
}

static void sss_hao__move_arrays(sss_hao__stream *s, sss_hao *a)
{
    const size_t V = a->stats.vertex_count, R = a->stats.reference_count, RT = a->stats.reference_triangle_count;
    const size_t S = a->lights, terms = a->shells * a->terms, blocks = (V + SSS_HAO__LANES - 1) / SSS_HAO__LANES;
    const sss_hao_storage storage = a->stats.storage;
    const int references = storage == SSS_HAO_REFERENCES, table = storage == SSS_HAO_TABLE || references;
    sss_hao__move_set(s, a);
    if (storage == SSS_HAO_FLOAT || storage == SSS_HAO_VECTORS)
    {
        const size_t parts = storage == SSS_HAO_VECTORS ? 3 : 1;
        a->q = sss_hao__move_floats(s, a, a->q, V * a->channels * parts * S);
    }
    if (table)
    {
        a->table = sss_hao__move_floats(s, a, a->table, a->channels * 256);
        a->code = (unsigned char *)sss_hao__move_any(s, a, a->code, (references ? R : V) * a->channels * S, 1);
    }
    if (storage == SSS_HAO_HARMONICS)
    {
        a->harmonic = (int16_t *)sss_hao__move_any(s, a, a->harmonic, V * a->channels * terms, 2);
    }
    if (references)
    {
        a->residual = (unsigned char *)sss_hao__move_any(s, a, a->residual,
                                                         blocks * a->channels * terms * SSS_HAO__LANES, 1);
        a->weight = (uint16_t (*)[2])sss_hao__move_any(s, a, a->weight, 2 * V, 2);
        sss_hao__move_indices(s, a, &a->corner16, &a->corner32, 3 * RT, R);
        sss_hao__move_indices(s, a, &a->triangle16, &a->triangle32, V, RT);
        sss_hao__move_indices(s, a, NULL, &a->reference, R, V);
    }
    if (a->terms > 0)
    {
        a->scale = sss_hao__move_floats(s, a, a->scale, a->channels * terms);
        a->offset = sss_hao__move_floats(s, a, a->offset, a->channels * terms);
    }
    sss_hao__move_check(s);
}

static void sss_hao__open(sss_hao__stream *s, sss_hao_write write, sss_hao_read read, void *user)
{
    s->write = write;
    s->read = read;
    s->user = user;
    s->check = SSS_HAO__HASH_START;
    s->result = SSS_OK;
}

SSS_HAO_API sss_result sss_hao_save(const sss_hao *hao, sss_hao_write write, void *user)
{
    sss_hao__stream stream;
    sss_hao copy; // its arrays are the same and are only read
    if (hao == NULL || write == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    copy = *hao;
    sss_hao__open(&stream, write, NULL, user);
    sss_hao__move_header(&stream, &copy);
    sss_hao__move_arrays(&stream, &copy);
    return stream.result;
}

// Counts that fit together.
static int sss_hao__valid_counts(const sss_hao *a)
{
    const sss_hao_stats *s = &a->stats;
    const int references = s->storage == SSS_HAO_REFERENCES;
    if (s->vertex_count == 0 || s->vertex_count > UINT32_MAX - 64 || s->triangle_count == 0
        || (s->channels != 1 && s->channels != 3) || s->channel > (s->channels == 1 ? 2u : 0u)
        || s->distance_count > SSS_HAO__MAX_DISTANCES || s->order > 8
        || (s->order > 0) != sss_hao__has_harmonics(s->storage) || s->order * s->order > s->directions)
    {
        return 0;
    }
    if (a->set.cells > 0 ? sss_hao__lattice_cells(s->directions) != a->set.cells
                               || s->directions != a->set.cells * a->set.cells + 2
                         : s->directions < 4 || s->directions > SSS_HAO__MAX_SET)
    {
        return 0;
    }
    if (references ? s->reference_count == 0 || s->reference_count > s->vertex_count
                         || s->reference_triangle_count == 0
                         || s->reference_triangle_count > (UINT32_MAX - 64) / 3
                   : s->reference_count != 0 || s->reference_triangle_count != 0)
    {
        return 0;
    }
    return sss_hao__in_range(a->mm, 1e-100, 1e100) && sss_hao__finite(s->center[0]) && sss_hao__finite(s->center[1])
           && sss_hao__finite(s->center[2])
           && s->reference_triangle_count <= SIZE_MAX / (4 * sizeof(double))
           && sss_hao__countable((double)s->vertex_count, (double)s->channels,
                                 s->storage == SSS_HAO_VECTORS ? 3.0 : 1.0,
                                 (double)s->directions * (double)(1 + s->distance_count));
}

// Directions of unit length and distances in order, as the interpolation takes for granted.
static int sss_hao__is_consistent(const sss_hao *a)
{
    size_t i;
    for (i = 0; i < a->set.count; i++)
    {
        if (fabs(sss_hao__length(a->set.direction[i]) - 1.0) > SSS_HAO__SLACK || !(a->set.solid_angle[i] >= 0.0)
            || a->set.solid_angle[i] > 4.0 * SSS_HAO__PI)
        {
            return 0;
        }
    }
    for (i = 1; i < a->shells; i++)
    {
        if (!(a->inverse_distance[i] > a->inverse_distance[i - 1]))
        {
            return 0;
        }
    }
    return a->inverse_distance[0] == 0.0;
}

static void sss_hao__load_object(sss_hao__stream *s, uint64_t hash, sss_hao *a)
{
    sss_hao__move_header(s, a);
    if (s->result == SSS_OK && a->hash != hash)
    {
        sss_hao__fail(s, SSS_ERROR_MISMATCH);
    }
    if (s->result == SSS_OK && !sss_hao__valid_counts(a))
    {
        sss_hao__fail(s, SSS_ERROR_BAD_DATA);
    }
    if (s->result == SSS_OK)
    {
        sss_hao__set_dimensions(a);
        sss_hao__move_arrays(s, a);
    }
    if (s->result == SSS_OK && !sss_hao__is_consistent(a))
    {
        sss_hao__fail(s, SSS_ERROR_BAD_DATA);
    }
    if (s->result == SSS_OK)
    {
        sss_hao__count_bytes(a);
        sss_hao__fail(s, sss_hao__take_scratch(a));
        a->stats.bytes = a->memory.bytes;
    }
}

SSS_HAO_API sss_result sss_hao_load(uint64_t hash, sss_hao_read read, void *user, const sss_hooks *hooks,
                                    sss_hao **out)
{
    sss_hao__stream stream;
    sss_hao *a;
    if (read == NULL || out == NULL || !sss_hao__valid_hooks(hooks))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    a = sss_hao__new(hooks);
    if (a == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    sss_hao__open(&stream, NULL, read, user);
    sss_hao__load_object(&stream, hash, a);
    if (stream.result != SSS_OK)
    {
        sss_hao_free(a);
        return stream.result;
    }
    *out = a;
    return SSS_OK;
}

// ---- GPU ----

#define SSS_HAO__RECORD_HEAD 2 // words of a vertex before its residuals: weights, reference triangle

static int sss_hao__fits_gpu(const sss_hao *a)
{
    return a != NULL && a->stats.storage == SSS_HAO_REFERENCES && a->shells == 1;
}

// Words of one vertex.
static size_t sss_hao__record_words(const sss_hao *a)
{
    return SSS_HAO__RECORD_HEAD + (a->terms * a->channels + 3) / 4;
}

static void sss_hao__fill_record(const sss_hao *a, size_t vertex, uint32_t *words)
{
    const size_t block = vertex / SSS_HAO__LANES, lane = vertex % SSS_HAO__LANES;
    size_t term, c;
    words[0] = (uint32_t)a->weight[vertex][0] | (uint32_t)a->weight[vertex][1] << 16;
    words[1] = sss_hao__triangle_of(a, vertex);
    for (term = 0; term < a->terms; term++)
    {
        for (c = 0; c < a->channels; c++)
        {
            const size_t k = term * a->channels + c;
            const size_t from = ((block * a->channels + c) * a->terms + term) * SSS_HAO__LANES + lane;
            words[SSS_HAO__RECORD_HEAD + k / 4] |= (uint32_t)a->residual[from] << 8 * (k % 4);
        }
    }
}

SSS_HAO_API sss_result sss_hao_get_texture(const sss_hao *hao, uint32_t *words, size_t *height)
{
    size_t record, count, rows, i;
    double total;
    if (!sss_hao__fits_gpu(hao) || height == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    record = sss_hao__record_words(hao);
    total = (double)hao->stats.vertex_count * (double)record + 3.0 * (double)hao->stats.reference_triangle_count;
    if (total > (double)INT32_MAX || total > (double)(SIZE_MAX / 8))
    {
        return SSS_ERROR_OVERFLOW; // words are numbered by int in the shader
    }
    count = hao->stats.vertex_count * record + 3 * hao->stats.reference_triangle_count;
    rows = (count + SSS_HAO_TEXTURE_WIDTH - 1) / SSS_HAO_TEXTURE_WIDTH;
    *height = rows;
    if (words == NULL)
    {
        return SSS_OK;
    }
    memset(words, 0, rows * SSS_HAO_TEXTURE_WIDTH * sizeof *words);
    for (i = 0; i < hao->stats.vertex_count; i++)
    {
        sss_hao__fill_record(hao, i, words + i * record);
    }
    for (i = 0; i < 3 * hao->stats.reference_triangle_count; i++)
    {
        words[hao->stats.vertex_count * record + i] = sss_hao__corner(hao, i);
    }
    return SSS_OK;
}

SSS_HAO_API sss_result sss_hao_get_uniforms(const sss_hao *hao, const float *lighting, sss_hao_uniforms *out)
{
    if (!sss_hao__fits_gpu(hao) || out == NULL || lighting == NULL
        || !sss_hao__all_finite(lighting, 3 * hao->stats.lighting_count))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    memset(out, 0, sizeof *out);
    out->layout[0] = (int)sss_hao__record_words(hao);
    out->layout[1] = (int)(hao->stats.vertex_count * sss_hao__record_words(hao));
    out->layout[2] = (int)hao->channels;
    out->layout[3] = (int)hao->terms;
    sss_hao__fold_harmonics(hao, lighting, out->harmonics, out->bias);
    return SSS_OK;
}

SSS_HAO_API const char *sss_hao_glsl(sss_hao_glsl_piece piece)
{
    static const char radiosity[] = SSS_HAO__GLSL_RADIOSITY;
    return piece == SSS_HAO_GLSL_RADIOSITY ? radiosity : NULL;
}

#endif // SSS_HAO_IMPLEMENTED
#endif // SSS_HAO_IMPLEMENTATION

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
