// sss_dipole.h - v0.1.0 - the dipole model of subsurface scattering: from a mesh, a material and a light
// to the radiosity of a translucent object, with a known error.       Licence: MIT-0 or public domain.

#ifndef SSS_DIPOLE_H
#define SSS_DIPOLE_H

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
    const float *normals;       // [3 vertex_count], outward, any length > 0; NULL where a function allows it
    const uint32_t *triangles;  // [3 triangle_count], indices below vertex_count, counter-clockwise from outside
    size_t vertex_count;
    size_t triangle_count;
    double mm_per_unit;         // > 0; required, because a wrong scale is the commonest mistake in the field
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
// SSS_DIPOLE_IMPLEMENTATION  define in exactly one source file before including: the code
// SSS_DIPOLE_STATIC          makes every function static: a private copy in that source file
// SSS_DIPOLE_NO_SIMD         compiles no AVX2/AVX-512 path (the portable paths give the same within tolerance)

#if defined(SSS_DIPOLE_STATIC)
#if defined(__GNUC__)
#define SSS_DIPOLE_API static __attribute__((unused))
#else
#define SSS_DIPOLE_API static
#endif
#else
#define SSS_DIPOLE_API extern
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ================================================= API =================================================
// Unless said otherwise a function never allocates, keeps no pointer and may run concurrently; arrays are
// the caller's and must not overlap; RGB is interleaved and linear. Functions that return a number return
// NaN where their arguments are invalid.

// ---- 1. Materials ----

typedef struct sss_dipole_material
{
    double sigma_s[3]; // reduced scattering coefficient sigma_s', 1/mm, >= 0
    double sigma_a[3]; // absorption coefficient, 1/mm, >= 0
    double eta;        // index of refraction over that of the outside, in [0.1, 10]
} sss_dipole_material;

// The measured materials of Jensen et al. 2001, figure 5: how many, and their names ("Apple" ... "Wholemilk").
// NULL for an index out of range.
SSS_DIPOLE_API size_t sss_dipole_material_count(void);
SSS_DIPOLE_API const char *sss_dipole_material_name(size_t index);

// Looks a measured material up. Case, spaces, '-' and '_' in the name do not matter ("skim milk").
// SSS_ERROR_NOT_FOUND: no such name. SSS_ERROR_INVALID_ARGUMENT: null.
SSS_DIPOLE_API sss_result sss_dipole_material_by_name(const char *name, sss_dipole_material *out);

// From reduced scattering and absorption coefficients.
//   sigma_s, sigma_a  [3] sigma_s' and sigma_a, 1/mm, >= 0;   eta  in [0.1, 10]
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite or out of range.
SSS_DIPOLE_API sss_result sss_dipole_material_from_coefficients(const double sigma_s[3], const double sigma_a[3],
                                                                double eta, sss_dipole_material *out);

// From what an artist sees: inverts the closed-form total reflectance.
//   albedo          [3] diffuse albedo R = Rd_total, in [0, 1]; 1 means sigma_a = 0
//   mean_free_path  [3] 1/sigma_t', mm, > 0
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite or out of range.
SSS_DIPOLE_API sss_result sss_dipole_material_from_albedo(const double albedo[3], const double mean_free_path[3],
                                                          double eta, sss_dipole_material *out);

// From scattering with phase function, by similarity: sigma_s' = (1 - g) sigma_s.
//   sigma_s, sigma_a  [3] 1/mm, >= 0;   g  mean cosine, in (-1, 1)
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite or out of range.
SSS_DIPOLE_API sss_result sss_dipole_material_from_scattering(const double sigma_s[3], const double sigma_a[3],
                                                              double g, double eta, sss_dipole_material *out);

// The inverses of the two above. A channel with sigma_t' = 0 has albedo 0 and an infinite mean free path.
// SSS_ERROR_INVALID_ARGUMENT: null, an invalid material, or g outside (-1, 1).
SSS_DIPOLE_API sss_result sss_dipole_material_to_albedo(const sss_dipole_material *material, double albedo[3],
                                                        double mean_free_path[3]);
SSS_DIPOLE_API sss_result sss_dipole_material_to_scattering(const sss_dipole_material *material, double g,
                                                            double sigma_s[3], double sigma_a[3]);

// ---- 2. Fresnel ----

// How a diffuse Fresnel reflectance is computed.
typedef enum sss_dipole_fresnel_mode
{
    SSS_DIPOLE_FRESNEL_EXACT = 0, // closed form of the integral
    SSS_DIPOLE_FRESNEL_POLYNOMIAL // the papers' fit (0.07 % to 0.5 % off inside, up to 4 % outside; 0 at eta = 1)
} sss_dipole_fresnel_mode;

// How radiosity becomes outgoing radiance: L = factor/pi B.
typedef enum sss_dipole_exit
{
    SSS_DIPOLE_EXIT_PAPER = 0, // F_t(cos_o): the papers' convention, which takes the boundary's loss twice
    SSS_DIPOLE_EXIT_CONSERVING // F_t(cos_o) / (1 - F_external): integrates to exactly B
} sss_dipole_exit;

// Unpolarised reflectance of a smooth dielectric boundary: exact, and Schlick's approximation.
//   cos_i  cosine on the side the light comes from, in [0, 1]
//   eta    index on the far side over index on the near side, > 0; total internal reflection gives 1
SSS_DIPOLE_API double sss_dipole_fresnel(double cos_i, double eta);
SSS_DIPOLE_API double sss_dipole_fresnel_schlick(double cos_i, double eta);

// Diffuse reflectance 2 int_0^1 mu F(mu) dmu of the boundary of a medium of relative index eta, seen from
// inside (the papers' F_dr) and from outside. eta in [0.1, 10], medium over outside, in both.
SSS_DIPOLE_API double sss_dipole_fresnel_internal(double eta, sss_dipole_fresnel_mode mode);
SSS_DIPOLE_API double sss_dipole_fresnel_external(double eta, sss_dipole_fresnel_mode mode);

// The factor that turns B/pi into radiance leaving at cos_o in [0, 1] to the normal.
SSS_DIPOLE_API double sss_dipole_exit_factor(double cos_o, double eta, sss_dipole_exit exit_convention);

// ---- 3. Profile ----

// The profile of a material. SSS_ERROR_INVALID_ARGUMENT: null or an invalid material or mode.
SSS_DIPOLE_API sss_result sss_dipole_profile(const sss_dipole_material *material, sss_dipole_fresnel_mode mode,
                                             sss_profile *out);

// R_d(r), 1/mm^2, at distance r >= 0 mm, channel 0..2.                          Jensen et al. 2001, eq. 4
SSS_DIPOLE_API double sss_dipole_Rd(const sss_profile *profile, int channel, double r);

// R_d for arrays of distances.   r  [count] mm, >= 0;   out  [count][3] 1/mm^2
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite or negative; SSS_ERROR_EMPTY: count is 0; SSS_ERROR_OVERFLOW.
SSS_DIPOLE_API sss_result sss_dipole_Rd_array(const sss_profile *profile, const double *r, size_t count, double *out);
SSS_DIPOLE_API sss_result sss_dipole_Rd_array_float(const sss_profile *profile, const float *r, size_t count,
                                                    float *out);

// R_d with both sources placed at the receiver, along its normal: the real one at x_o - z_r n_o, the virtual
// one at x_o + z_v n_o.                      Mertens et al. 2003, table 1 in its inverse interpretation (4)
//   x_i, x_o  [3] mm;   n_o  [3] outward, any length > 0
SSS_DIPOLE_API double sss_dipole_Rd_placed(const sss_profile *profile, int channel, const double x_i[3],
                                           const double x_o[3], const double n_o[3]);

// Integrals over the plane, closed forms: all of it, the flux inside and beyond a radius (mm), and the second
// moment int r^2 R_d dA in mm^2 (infinite without absorption; over the total it is the mean square radius).
SSS_DIPOLE_API double sss_dipole_total(const sss_profile *profile, int channel);
SSS_DIPOLE_API double sss_dipole_flux_inside(const sss_profile *profile, int channel, double radius);
SSS_DIPOLE_API double sss_dipole_flux_beyond(const sss_profile *profile, int channel, double radius);
SSS_DIPOLE_API double sss_dipole_second_moment(const sss_profile *profile, int channel);

// The radius, mm, that holds `fraction` in [0, 1] of the total. Nothing is truncated: without absorption 99 %
// lie within 50 (z_r + z_v), hundreds of mean free paths, and a fraction of 1 gives infinity in any material.
SSS_DIPOLE_API double sss_dipole_radius(const sss_profile *profile, int channel, double fraction);

// The Hankel transform of R_d: how much of a sinusoidal irradiance of angular frequency k (1/mm, >= 0) along
// the surface survives scattering. (alpha'/2) sum_z exp(-z sqrt(sigma_tr^2 + k^2)); at k = 0 the total.
SSS_DIPOLE_API double sss_dipole_spectrum(const sss_profile *profile, int channel, double k);

// ---- 4. Irradiance ----

// Where irradiance is given.
typedef enum sss_dipole_elements
{
    SSS_DIPOLE_VERTICES = 0, // at vertices, linear over each triangle
    SSS_DIPOLE_TRIANGLES     // at centroids, constant over each triangle
} sss_dipole_elements;

typedef enum sss_dipole_light_kind
{
    SSS_DIPOLE_LIGHT_DIRECTIONAL = 0,
    SSS_DIPOLE_LIGHT_POINT,
    SSS_DIPOLE_LIGHT_SPOT,
    SSS_DIPOLE_LIGHT_ENVIRONMENT
} sss_dipole_light_kind;

typedef struct sss_dipole_light
{
    sss_dipole_light_kind kind;
    double direction[3];     // directional: towards the light; spot: the way its axis points; any length > 0
    double position[3];      // point, spot: in the mesh's units
    double color[3];         // directional: W/mm^2 on a plane facing it; point, spot: W/sr
    double cos_inner;        // spot: full intensity inside this cosine of the angle to the axis,
    double cos_outer;        //       none outside this one, smoothstep between; -1 <= outer <= inner <= 1
    double sh[9][3];         // environment: radiance, real orthonormal SH, order (0,0) (1,-1) (1,0) (1,1) (2,-2) ...
                             // without Condon-Shortley sign: Y_1 = .488603 (y, z, x)
    const float *visibility; // [elements], in [0,1], or NULL for 1 everywhere
} sss_dipole_light;

typedef struct sss_dipole_irradiance_options
{
    double eta;                   // of the medium; required, in [0.1, 10]
    sss_dipole_elements elements; // 0: vertices
    int no_fresnel;               // 0: E includes the entering transmittance F_t (the papers' E); 1: plain irradiance
} sss_dipole_irradiance_options;

// E = sum over lights of visibility x int L F_t(eta, w_i) max(0, n.w_i) dw_i.     Mertens et al. 2003, eq. 5
// Environments use the lobe F_t(mu) mu up to band 2 (Ramamoorthi and Hanrahan 2001, with Fresnel), so that E
// may dip below zero where the nine coefficients do; it is then clamped to 0.
//   mesh        normals are required for vertices; triangles use their own plane
//   irradiance  [V or T][3], W/mm^2
// SSS_ERROR_INVALID_ARGUMENT, SSS_ERROR_EMPTY, SSS_ERROR_INDEX, SSS_ERROR_OVERFLOW. A point light on the surface
// gives 0 there, not infinity. light_count may be 0: irradiance is zero.
SSS_DIPOLE_API sss_result sss_dipole_irradiance(const sss_mesh *mesh, const sss_dipole_light *lights,
                                                size_t light_count, const sss_dipole_irradiance_options *options,
                                                float *irradiance);

// Vertex normals: the mean of the adjoining triangles' normals weighted by their angle at the vertex; (0,0,1)
// where there is none.   normals  [3 vertex_count], unit length
SSS_DIPOLE_API sss_result sss_dipole_vertex_normals(const sss_mesh *mesh, float *normals);

// ---- 5. Direct gather: B(x_o) = int E(x_i) R_d(x_i, x_o) dA over the mesh, every pair ----

typedef enum sss_dipole_geometry
{
    SSS_DIPOLE_DISTANCE = 0, // R_d depends on |x_o - x_i| only (Hao, Lensch, Chang)
    SSS_DIPOLE_PLACED        // sources placed at x_o along its normal (Mertens)
} sss_dipole_geometry;

// How R_d is evaluated; each holds stats.path_tolerance to the scalar path.
typedef enum sss_dipole_path
{
    SSS_DIPOLE_PATH_AUTO = 0, // the fastest one that this processor has
    SSS_DIPOLE_PATH_SCALAR,   // the formula in double precision
    SSS_DIPOLE_PATH_TABLE,    // portable C, tabulated profile, float
    SSS_DIPOLE_PATH_AVX2,     // the same, 8 emitters at a time
    SSS_DIPOLE_PATH_AVX512    // the same, 16 emitters at a time
} sss_dipole_path;

typedef struct sss_dipole_gather_options
{
    sss_dipole_geometry geometry; // 0: distance only
    double tolerance;             // relative L2 error aimed at, in [1e-5, 0.5]; 0: 1e-3
    sss_dipole_path path;         // 0: automatic; SSS_ERROR_INVALID_ARGUMENT if this processor lacks it
    int point_sampling;           // 1: one sample a triangle at its centroid, no integration (the plain baseline)
} sss_dipole_gather_options;

typedef struct sss_dipole_gather_stats
{
    sss_dipole_geometry geometry; // as resolved
    sss_dipole_path path;         // as resolved
    double tolerance;             // as resolved
    double path_tolerance;        // largest relative error of R_d against the scalar path, bounded at creation
    double predicted_error;       // predicted relative L2 error of B against the converged integral
    double one_point_mm;          // mean distance beyond which a triangle counts as one point
    double mean_edge_mm;          // mean edge length of the mesh
    size_t emitter_count;         // triangles or points with an area > 0
    size_t table_entries;         // per table; 0 on the scalar path
    size_t bytes;                 // allocated
} sss_dipole_gather_stats;

typedef struct sss_dipole_gather sss_dipole_gather; // prepared emitters; opaque

typedef struct sss_dipole_receivers
{
    const float *positions; // [3 count], in the mesh's units
    const float *normals;   // [3 count], any length > 0; may be NULL for SSS_DIPOLE_DISTANCE
    size_t count;
} sss_dipole_receivers;

// Prepares a mesh as emitters, O(T log T); irradiance is zero until set. Near triangles are integrated
// adaptively at run time, so that the result converges for meshes coarser than a mean free path.
//   options, hooks  may be NULL: defaults
//   out             freed with sss_dipole_gather_free; keeps no pointer to the mesh
// Allocates. SSS_ERROR_INVALID_ARGUMENT, _EMPTY, _INDEX, _OVERFLOW, _OUT_OF_MEMORY.
SSS_DIPOLE_API sss_result sss_dipole_gather_create(const sss_mesh *mesh, const sss_profile *profile,
                                                   const sss_dipole_gather_options *options, const sss_hooks *hooks,
                                                   sss_dipole_gather **out);

// The same for a cloud of samples: every one stands for a small patch and is never subdivided.
//   positions  [3 count], in units of mm_per_unit;   areas  [count], mm^2, >= 0
typedef struct sss_dipole_points
{
    const float *positions;
    const float *areas;
    size_t count;
    double mm_per_unit;
} sss_dipole_points;

SSS_DIPOLE_API sss_result sss_dipole_gather_create_points(const sss_dipole_points *points, const sss_profile *profile,
                                                          const sss_dipole_gather_options *options,
                                                          const sss_hooks *hooks, sss_dipole_gather **out);

// Frees an object; NULL is allowed.
SSS_DIPOLE_API void sss_dipole_gather_free(sss_dipole_gather *gather);

// Sets the irradiance: a new light costs O(T).
//   irradiance  [V][3] or [T][3], W/mm^2, finite (SSS_DIPOLE_VERTICES: [count][3] for points)
// Not concurrent with other calls on the same object. SSS_ERROR_INVALID_ARGUMENT: the object is unchanged.
SSS_DIPOLE_API sss_result sss_dipole_gather_set_irradiance(sss_dipole_gather *gather, sss_dipole_elements elements,
                                                           const float *irradiance);

// Rows [begin, end) of the gather: a pure function, bit-identical however the rows are split; any threads.
//   receivers  anywhere;   radiosity  [receivers->count][3], W/mm^2, only rows begin..end-1 are written
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite, a missing or zero normal, begin > end, end > count.
SSS_DIPOLE_API sss_result sss_dipole_gather_rows(const sss_dipole_gather *gather,
                                                 const sss_dipole_receivers *receivers, size_t begin, size_t end,
                                                 float *radiosity);

// All rows, through hooks.parallel_for and hooks.progress. SSS_ERROR_CANCELLED leaves radiosity partly written.
SSS_DIPOLE_API sss_result sss_dipole_gather_run(const sss_dipole_gather *gather,
                                                const sss_dipole_receivers *receivers, float *radiosity);

// What was chosen, and what it costs.
SSS_DIPOLE_API sss_result sss_dipole_gather_get_stats(const sss_dipole_gather *gather, sss_dipole_gather_stats *out);

// One call from irradiance to radiosity, both at the vertices of a mesh. Normals are computed where missing.
//   irradiance, radiosity  [V][3], W/mm^2;   options, hooks  may be NULL
SSS_DIPOLE_API sss_result sss_dipole_shade(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                                           const sss_dipole_gather_options *options, const sss_hooks *hooks,
                                           float *radiosity);

// Without scattering across the surface: radiosity = Rd_total E, exactly.   irradiance, radiosity  [count][3]
SSS_DIPOLE_API sss_result sss_dipole_lambert(const sss_profile *profile, const float *irradiance, size_t count,
                                             float *radiosity);

// ---- 6. What a scene needs ----

typedef struct sss_dipole_scene
{
    double size_mm;      // largest extent of the object; required, > 0
    double thickness_mm; // smallest extent light could cross; 0: size_mm
    double area_mm2;     // surface area; 0: that of a sphere of diameter size_mm
    double spacing_mm;   // mean edge length of the mesh; 0: unknown
    double pixel_mm;     // a pixel's width on the object; 0: unknown
    double tolerance;    // relative L2 error allowed, in (0, 1); 0: 1e-2
} sss_dipole_scene;

typedef enum sss_dipole_need
{
    SSS_DIPOLE_NEED_LAMBERT = 0, // scattering is not visible: sss_dipole_lambert is enough
    SSS_DIPOLE_NEED_LOCAL,       // a neighbourhood of radius_mm is enough
    SSS_DIPOLE_NEED_GLOBAL       // light crosses the object: every part matters
} sss_dipole_need;

typedef struct sss_dipole_advice
{
    sss_dipole_need need;    // the least that meets the tolerance
    double predicted_error;  // predicted relative L2 error of that least
    double lambert_error;    // predicted relative L2 error of Lambert under one shadow edge across the object
    double crossing;         // share of the light that reaches farther than thickness_mm
    double radius_mm;        // radius that holds all but the tolerance; infinite where nothing less does
    double spacing_mm;       // sample spacing at which plain point sampling meets the tolerance
    double sample_count;     // area / spacing^2; huge where a mean free path is tiny
    char reason[160];        // one line, English
} sss_dipole_advice;

// Says whether scattering is visible at all, whether it is local, whether light crosses the object, and what
// radius and sampling are needed: the worst of the three channels decides. How the numbers are predicted is
// said at the implementation; tests/test_dipole.c compares them with measured errors.
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite or out of range.
SSS_DIPOLE_API sss_result sss_dipole_needs(const sss_profile *profile, const sss_dipole_scene *scene,
                                           sss_dipole_advice *out);

// ---- 7. GLSL ----

// Pieces of GLSL source for glShaderSource: put the wanted ones between your #version line and your code, in
// this order. They compile as 330 core, 450 core and 300 es, and may be repeated.
typedef enum sss_dipole_glsl_piece
{
    SSS_DIPOLE_GLSL_FRESNEL = 0, // float sss_fresnel(float cos_i, float eta); sss_fresnel_schlick(...)
    SSS_DIPOLE_GLSL_PROFILE,     // uniforms of the profile; vec3 sss_Rd(float r); vec3 sss_Rd_placed(x_i, x_o, n_o);
                                 // float sss_exit_factor(float cos_o); needs FRESNEL
    SSS_DIPOLE_GLSL_TONE_MAPPING // vec3 sss_tone_map(vec3 radiance): exposure, filmic curve, sRGB
} sss_dipole_glsl_piece;

// NULL for an unknown piece; static storage; each under 4,095 characters.
SSS_DIPOLE_API const char *sss_dipole_glsl(sss_dipole_glsl_piece piece);

// Values for the uniforms of SSS_DIPOLE_GLSL_PROFILE: upload each member to the uniform "sss_" + its name,
// vec3 or float (glUniform3fv, glUniform1f).
typedef struct sss_dipole_glsl_uniforms
{
    float alpha_p[3];   // uniform vec3 sss_alpha_p
    float sigma_tr[3];  // uniform vec3 sss_sigma_tr, 1/mm
    float z_r[3];       // uniform vec3 sss_z_r, mm
    float z_v[3];       // uniform vec3 sss_z_v, mm
    float eta;          // uniform float sss_eta
    float exit_scale;   // uniform float sss_exit_scale: 1, or 1/(1 - F_external) when conserving
} sss_dipole_glsl_uniforms;

SSS_DIPOLE_API sss_result sss_dipole_get_glsl_uniforms(const sss_profile *profile, sss_dipole_exit exit_convention,
                                                       sss_dipole_glsl_uniforms *out);

#ifdef __cplusplus
}
#endif

#endif // SSS_DIPOLE_H
