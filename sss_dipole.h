// sss_dipole.h - v0.1.0 - the dipole model of subsurface scattering: from a mesh, a material and a light to the
// radiosity of a translucent object, with a known error.
//
// Implements H. W. Jensen, S. R. Marschner, M. Levoy, P. Hanrahan: A Practical Model for Subsurface Light
// Transport (SIGGRAPH 2001), as the six pipelines of this family use it; both geometries of the dipole.
// Licence: MIT-0 or public domain, at your choice; see the end. Needs libc and libm, nothing else.
//
// ============================================= QUICK START =============================================
//
//     #define SSS_DIPOLE_IMPLEMENTATION // in one source file of the program
//     #include "sss_dipole.h"
//     #include <math.h>
//     #include <stdio.h>
//
//     #define RINGS 32
//     #define STEPS 64
//     #define V ((RINGS + 1) * STEPS)
//     #define T (2 * RINGS * STEPS)
//     static float x[3 * V], E[3 * V], B[3 * V]; // positions = normals of a unit sphere, irradiance, radiosity
//     static uint32_t triangles[3 * T];
//     static sss_dipole_light light; // zero means the default, in every struct: a distant light
//     static sss_dipole_irradiance_options options;
//
//     int main(void)
//     {
//         sss_mesh mesh = {x, x, triangles, V, T, 5.0}; // 5 mm per unit: a bead 10 mm across
//         sss_dipole_material marble;
//         sss_profile profile;
//         for (int v = 0; v < V; v++)
//         {
//             double theta = 3.14159265 / RINGS * (v / STEPS), phi = 6.28318531 / STEPS * (v % STEPS);
//             x[3 * v + 0] = (float)(sin(theta) * cos(phi)), x[3 * v + 1] = (float)(sin(theta) * sin(phi));
//             x[3 * v + 2] = (float)cos(theta);
//         }
//         for (int t = 0; t < T; t++)
//         {
//             int a = t / 2, b = a % STEPS == STEPS - 1 ? a + 1 - STEPS : a + 1; // the quad's upper edge
//             triangles[3 * t + 0] = (uint32_t)(t % 2 ? a + STEPS : a);
//             triangles[3 * t + 1] = (uint32_t)(t % 2 ? b + STEPS : a + STEPS);
//             triangles[3 * t + 2] = (uint32_t)b;
//         }
//         light.direction[2] = light.color[0] = light.color[1] = light.color[2] = 1.0; // from above, white
//         sss_dipole_material_by_name("marble", &marble), options.eta = marble.eta;
//         sss_dipole_profile(&marble, SSS_DIPOLE_FRESNEL_EXACT, &profile);
//         sss_dipole_irradiance(&mesh, &light, 1, &options, E);
//         if (sss_dipole_shade(&mesh, &profile, E, NULL, NULL, B) != SSS_OK) return 1;
//         printf("lit pole %.4f, terminator %.4f, dark pole %.4f\n", B[0], B[3 * (V / 2)], B[3 * (V - 1)]);
//     }
//
// ================================================ THEORY ===============================================
//
// Light that enters a homogeneous, highly scattering medium at x_i diffuses and leaves elsewhere. For a plane the
// exitance at x_o is R_d(x_i, x_o) per unit of flux that entered, the field of two sources, one z_r below the
// surface and one z_v above it:
//
//     R_d(r) = alpha'/(4 pi) [ z_r (1 + sigma_tr d_r) exp(-sigma_tr d_r)/d_r^3
//                            + z_v (1 + sigma_tr d_v) exp(-sigma_tr d_v)/d_v^3 ],   d = sqrt(r^2 + z^2)
//     B(x_o) = int E(x_i) R_d(x_i, x_o) dA,   E = int L F_t (n.w) dw,   L_o = F_t(w_o)/pi B
//
// (Jensen et al. print eq. 4 with an extra z_v and sigma_t' in the second term; this is the form whose integral is
// their own total.) On a curved surface the formula has two readings that give different numbers; both are here:
// r = |x_i - x_o| (distance only), or the two sources placed at x_o along its normal (placed).
//
//     symbol     name in code        unit     meaning
//     sigma_s'   material.sigma_s    1/mm     reduced scattering coefficient
//     sigma_a    material.sigma_a    1/mm     absorption coefficient
//     eta        eta                 1        index of refraction, medium over outside
//     alpha'     profile.alpha_p     1        sigma_s'/sigma_t',  sigma_t' = sigma_s' + sigma_a
//     sigma_tr   profile.sigma_tr    1/mm     sqrt(3 sigma_a sigma_t')
//     z_r, z_v   profile.z_r, z_v    mm       1/sigma_t',  z_r (1 + 4A/3)
//     F_dr       profile.F_internal  1        A = (1 + F_dr)/(1 - F_dr)
//     E, B       irradiance,         W/mm^2   any consistent unit works: B is linear in E
//                radiosity
//
// What a scene needs: sss_dipole_needs compares spectra. Light under a shadow edge has power 1/k^2, scattering keeps
// T(k) of it (sss_dipole_spectrum), and what Lambert, a spacing or a radius lose is an integral over k. It then ranks
// the methods of all headers: error, times and bytes of each are (what it is proportional to) x scale x
// exp(slopes . features), fitted to the measured runs of the chart; the features are ln of vertices, of edge, of size
// and of thickness in paths of light.
//
// Assumed: a homogeneous medium, multiple scattering only, a smooth boundary, E constant or linear over a triangle.
//
// ================================================ LIMITS ===============================================
//
// The dipole is exact for no object: what follows is the error of the model, which no implementation removes
// (tests/test_dipole.c, model error; references: exact half-space solutions and Monte Carlo).
//   * Total reflectance: within 3 % for alpha' >= 0.9 at eta = 1.3, within 2 % for alpha' >= 0.98 at 1.5; at low
//     albedo it is far off (alpha' = 0.5: -24 %, +17 %, +60 % at eta = 1, 1.3, 1.5).
//   * Near the point of entry, r < 0.2 mean free paths, it has 6 % to 38 % of the true light; from 0.5 to 2 it is up
//     to 60 % too bright; beyond 10 it is within 5 % if alpha' >= 0.99. Errors cancel in totals.
//   * Slabs: light that leaves through the back is counted as if the medium went on (a slab 1 mean free path thick
//     reflects 40 % to 190 % too much). It ignores everything between two points: light crosses air gaps.
// Of the computation:
//   * Sources placed at a receiver may come to lie on another part of the surface, where the integral grows as
//     2 pi z/H with the source's height H over it, without a bound; there the relative error is 6e-8 z/H, from
//     positions in float. sss_bem.h has a guard against it; this gather has none.
//   * The ranking predicts. On the runs that it is fitted to no error up to 15 % is above its prediction (beyond, it is
//     only known to be large), on others one may be; times are those of the chart's machine. Scenes beyond the chart's
//     set advice.extrapolated.
// ---- BEGIN measured choices: tests/chart/choice/fit.sh --write makes these lines from summary.csv ----
//   * Of 240 choices on the chart (tests/chart/choice: summary.csv; every choice: choice.csv)
//     240 keep the tolerance, and 198 cost at most 1.5 times the cheapest that does. With their
//     case left out of the fit 217 and 193 do.
// ---- END measured choices ----
//   * advice.model_error is an estimate: within a factor of two of the exact one for slabs of 1 and 10 mean free paths
//     (tests/test_dipole.c), and 0.6 to 2.9 times the random walk's on the chart's cases, save under light from all
//     around, which makes up for what slabs lose: up to 7.2 times (tests/chart/choice).
//   * A mean free path below 1e-15 or above 1e15 of the diagonal is treated as that: a delta function, a constant.
// ---- BEGIN measured by make stability (tests/stability/README.md says what the errors are; in brackets: sweep) ----
//   * 10 % model error: distance, half space, eta 1: alpha' below 0.85; worst 36 % (half space n 1)
//   * 10 % model error: distance, half space, eta 1.3: alpha' below 0.76; worst 19 % (half space n 1.3)
//   * 10 % model error: distance, half space, eta 1.5: alpha' below 0.94; worst 66 % (half space n 1.5)
//   * 10 % model error: walk, phase function, sphere of 1 mean free path: g at any value from 0.5; worst 52 %
//     (similarity 1)
//   * 10 % model error: walk, phase function, sphere of 5 mean free paths: g no limit from 0.5 to 0.95; worst 3 %
//     (similarity 5)
//   * 10 % beside diffusion in a slab: lit face, alpha' 0.9: thickness no limit from 2 to 8 mean free paths; worst 5 %
//     (slab front 0.9)
//   * 10 % beside diffusion in a slab: lit face, alpha' 0.99: thickness below 4.9 mean free paths; worst 39 % (slab
//     front 0.99)
//   * 10 % beside diffusion in a slab: dark face, alpha' 0.9: thickness at any value to 8 mean free paths; worst 80 %
//     (slab back 0.9)
//   * 10 % beside diffusion in a slab: dark face, alpha' 0.99: thickness at any value to 8 mean free paths; worst 55 %
//     (slab back 0.99)
//   * 10 % model error: distance, sphere without absorption: radius below 14 mean free paths; worst 84 % (sphere)
//   * 10 % model error: placed, sphere without absorption: radius below 21 mean free paths; worst 1.4e+05 % (sphere)
//   * 10 % model error: distance, light across air: gap below 4.9 mean free paths; worst 100 % (fingers)
//   * 10 % model error: placed, light across air: gap at any value to 8 mean free paths; worst 6800 % (fingers)
//   * 10 % input error: distance, shadow edge on a coarse mesh: mean edge above 2 mean free paths; worst 90 % (coarse)
//   * 10 % input error: distance, displaced vertices: amplitude above 0.39 mean edges; worst 31 % (noise)
//   * 10 % input error: placed, displaced vertices: amplitude above 0.18 mean edges; worst 260 % (noise)
//   * 10 % input error: distance, triangles missing: share above 0.096; worst 52 % (holes)
//   * 10 % input error: distance, triangles turned over: share above 0.22; worst 96 % (windings)
//   * 10 % input error: distance, vertex normals turned over: share above 0.084; worst 96 % (normals)
//   * distance, slivers: aspect no limit from 1 to 1.0e+05; error at most 0.016 %, 0.088 times what is promised
//     (slivers)
//   * distance, grazing light: elevation no limit from 0.1 to 90 degrees; error at most 0.018 %, 0.14 times what is
//     promised (grazing)
//   * distance, sphere: radius no limit from 5e-06 to 5.0e+06 mean free paths; error at most 0.079 %, 0.36 times what
//     is promised (size)
//   * distance, vertices of a faceted sphere without visible scattering, against Lambert: up to 0.87 % (size)
//   * placed, vertices of a faceted sphere without visible scattering, against Lambert: up to 4.5 % (size)
//   * distance, steps of B as a light turns by half degrees no limit; worst +0 % (turning)
// ---- END measured by make stability ----
//

#ifndef SSS_DIPOLE_H
#define SSS_DIPOLE_H

#define SSS_DIPOLE_VERSION 100 // 10000 major + 100 minor + patch

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

// From what an artist sees: inverts the closed-form total reflectance, with exact Fresnel (a profile made with the
// polynomial has a total that differs by as much as the polynomial).
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

// The profile of a material. SSS_ERROR_INVALID_ARGUMENT: null, an invalid material or mode, or an eta at which the
// polynomial leaves [0, 1).
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
//   x_i, x_o  [3] mm;   n_o  [3] outward, any length > 0.   Infinite where x_i is a source.
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
    double direction[3];     // directional: towards the light; spot: the way its axis points; any length > 0
    double position[3];      // point, spot: in the mesh's units
    double color[3];         // directional: W/mm^2 on a plane facing it; point, spot: W/sr
    double cos_inner;        // spot: full intensity inside this cosine of the angle to the axis,
    double cos_outer;        //       none outside this one, smoothstep between; -1 <= outer <= inner <= 1
    double sh[9][3];         // environment: radiance, real orthonormal SH, order (0,0) (1,-1) (1,0) (1,1) (2,-2) ...
                             // without Condon-Shortley sign: Y_1 = .488603 (y, z, x)
    const float *visibility; // [elements], in [0,1], or NULL for 1 everywhere
    sss_dipole_light_kind kind; // 0: directional
} sss_dipole_light;

typedef struct sss_dipole_irradiance_options
{
    double eta;                   // of the medium; required, in [0.1, 10]
    sss_dipole_elements elements; // 0: vertices
    int no_fresnel;               // 0: E includes the entering transmittance F_t (the papers' E); 1: plain irradiance
    int accumulate;               // 0: irradiance is overwritten; 1: added to, for lights made of many samples
} sss_dipole_irradiance_options;

// E = sum over lights of visibility x int L F_t(eta, w_i) max(0, n.w_i) dw_i.     Mertens et al. 2003, eq. 5
// Environments use the lobe F_t(mu) mu up to band 2 (Ramamoorthi and Hanrahan 2001, with Fresnel), so that E
// may dip below zero where the nine coefficients do; it is then clamped to 0.
//   mesh        normals are required for vertices; triangles use their own plane; a zero normal, like a triangle
//               without area, faces no light
//   irradiance  [V or T][3], W/mm^2
// SSS_ERROR_INVALID_ARGUMENT, SSS_ERROR_EMPTY, SSS_ERROR_INDEX, SSS_ERROR_OVERFLOW. Colours up to 1e30. A point light
// on the surface gives 0 there, and none gives more than 1e30. light_count may be 0: irradiance is zero.
SSS_DIPOLE_API sss_result sss_dipole_irradiance(const sss_mesh *mesh, const sss_dipole_light *lights,
                                                size_t light_count, const sss_dipole_irradiance_options *options,
                                                float *irradiance);

// Vertex normals: the mean of the adjoining triangles' normals weighted by their angle at the vertex; (0,0,1)
// where there is none.   normals  [3 vertex_count], unit length; mesh->normals is not read
// SSS_ERROR_INVALID_ARGUMENT, _EMPTY, _INDEX, _OVERFLOW.
SSS_DIPOLE_API sss_result sss_dipole_vertex_normals(const sss_mesh *mesh, float *normals);

// ---- 5. Direct gather: B(x_o) = int E(x_i) R_d(x_i, x_o) dA over the mesh, every pair ----

typedef enum sss_dipole_geometry
{
    SSS_DIPOLE_DISTANCE = 0, // R_d depends on |x_o - x_i| only (Hao, Lensch, Chang)
    SSS_DIPOLE_PLACED        // sources placed at x_o along its normal (Mertens); B has no bound in folds and parts
                             // thinner than z_v: LIMITS
} sss_dipole_geometry;

// How R_d is evaluated. All agree with the scalar path within stats.path_tolerance.
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
    double tolerance;             // relative L2 error aimed at for receivers on the surface, in [1e-5, 0.5]; 0: 1e-3
    sss_dipole_geometry geometry; // 0: distance only
    sss_dipole_path path;         // 0: automatic; SSS_ERROR_INVALID_ARGUMENT if this processor lacks it
    int point_sampling;           // 1: one sample a triangle at its centroid, no integration (the plain baseline)
} sss_dipole_gather_options;

typedef struct sss_dipole_gather_stats
{
    double tolerance;             // as resolved
    sss_dipole_geometry geometry; // as resolved
    sss_dipole_path path;         // as resolved
    double path_tolerance;        // what this path adds to the relative L2 error of B against the scalar path
    double predicted_error;       // predicted relative L2 error of B against the converged integral
    double one_point_mm;          // mean distance beyond which a triangle counts as one point
    double mean_edge_mm;          // mean edge length of the mesh
    int point_sampling;           // as resolved
    size_t emitter_count;         // triangles or points with an area > 0
    size_t table_entries;         // per table; 0 on the scalar path
    size_t bytes;                 // allocated
    // What the mesh is like, and what that does to the result: LIMITS.
    double edge_paths;            // mean edge in mean free paths 1/sigma_t', of the channel where these are shortest:
                                  // above 1 the light is no longer linear between vertices
    double longest_edge_paths;    // the longest edge, the same way
    double border_mm;             // edges without a partner that runs the other way, at least: holes, triangles turned
                                  // over, T-junctions. 0: closed
    double normals_against;       // share of the area at whose corners given normals look away from their triangles
    int inside_out;               // 1: triangles enclose a negative volume: they look inwards
} sss_dipole_gather_stats;

typedef struct sss_dipole_gather sss_dipole_gather; // prepared emitters; opaque

typedef struct sss_dipole_receivers
{
    const float *positions; // [3 count], in the mesh's units
    const float *normals;   // [3 count], any length > 0; may be NULL for SSS_DIPOLE_DISTANCE
    size_t count;
} sss_dipole_receivers;

// Prepares a mesh as emitters, O(T); irradiance is zero until set. Near triangles are integrated adaptively at run
// time, so that the result converges for meshes coarser than a mean free path. There is nothing to save: preparing
// takes a fraction of the time of one gather.
//   options, hooks  may be NULL: defaults
//   out             freed with sss_dipole_gather_free; keeps no pointer to the mesh
// Allocates. SSS_ERROR_INVALID_ARGUMENT, _EMPTY, _INDEX, _OVERFLOW, _OUT_OF_MEMORY.
SSS_DIPOLE_API sss_result sss_dipole_gather_create(const sss_mesh *mesh, const sss_profile *profile,
                                                   const sss_dipole_gather_options *options, const sss_hooks *hooks,
                                                   sss_dipole_gather **out);

// A cloud of samples, each of which stands for a small patch of the surface.
typedef struct sss_dipole_points
{
    const float *positions; // [3 count], in units of mm_per_unit millimetres
    const float *areas;     // [count], mm^2, >= 0
    size_t count;
    double mm_per_unit;     // 1e-100 .. 1e100
} sss_dipole_points;

// The same for a cloud of samples, which are never subdivided: accuracy is up to their density.
// Allocates. SSS_ERROR_INVALID_ARGUMENT, _EMPTY, _OVERFLOW, _OUT_OF_MEMORY.
SSS_DIPOLE_API sss_result sss_dipole_gather_create_points(const sss_dipole_points *points, const sss_profile *profile,
                                                          const sss_dipole_gather_options *options,
                                                          const sss_hooks *hooks, sss_dipole_gather **out);

// Frees an object; NULL is allowed.
SSS_DIPOLE_API void sss_dipole_gather_free(sss_dipole_gather *gather);

// Sets the irradiance: a new light costs O(T). B is linear in E, exactly under scaling, within the predicted error
// under addition, because far triangles are sampled where their light is.
//   irradiance  [V][3] or [T][3], W/mm^2, finite; for points [count][3] with SSS_DIPOLE_VERTICES
// Not concurrent with other calls on the same object. SSS_ERROR_INVALID_ARGUMENT: the object is unchanged.
SSS_DIPOLE_API sss_result sss_dipole_gather_set_irradiance(sss_dipole_gather *gather, sss_dipole_elements elements,
                                                           const float *irradiance);

// Rows [begin, end) of the gather: a pure function, bit-identical however the rows are split; any threads, each of
// which needs 64 KB of stack.
//   receivers  anywhere;   radiosity  [receivers->count][3], W/mm^2, only rows begin..end-1 are written
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite, a missing or zero normal, begin > end, end > count.
SSS_DIPOLE_API sss_result sss_dipole_gather_rows(const sss_dipole_gather *gather,
                                                 const sss_dipole_receivers *receivers, size_t begin, size_t end,
                                                 float *radiosity);

// All rows, through hooks.parallel_for and hooks.progress. Allocates only if hooks.progress is given, because
// SSS_ERROR_CANCELLED, like any error, leaves radiosity untouched. Other errors as above, _OUT_OF_MEMORY.
SSS_DIPOLE_API sss_result sss_dipole_gather_run(const sss_dipole_gather *gather,
                                                const sss_dipole_receivers *receivers, float *radiosity);

// What was chosen, and what it costs. SSS_ERROR_INVALID_ARGUMENT: null.
SSS_DIPOLE_API sss_result sss_dipole_gather_get_stats(const sss_dipole_gather *gather, sss_dipole_gather_stats *out);

// One call from irradiance to radiosity, both at the vertices of a mesh. Normals are computed where missing or zero.
//   irradiance, radiosity  [V][3], W/mm^2;   options, hooks  may be NULL
// Allocates. All errors of the functions that it calls; radiosity is then untouched.
SSS_DIPOLE_API sss_result sss_dipole_shade(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                                           const sss_dipole_gather_options *options, const sss_hooks *hooks,
                                           float *radiosity);

// Without scattering across the surface: radiosity = Rd_total E, exactly.   irradiance, radiosity  [count][3], W/mm^2
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite or an invalid profile; SSS_ERROR_EMPTY; SSS_ERROR_OVERFLOW.
SSS_DIPOLE_API sss_result sss_dipole_lambert(const sss_profile *profile, const float *irradiance, size_t count,
                                             float *radiosity);

// ---- 6. What a scene needs ----

// What is done again from frame to frame: bits of sss_dipole_scene.changes.
enum
{
    SSS_DIPOLE_CHANGES_LIGHT = 1,
    SSS_DIPOLE_CHANGES_GEOMETRY = 2, // vertices move, triangles stay
    SSS_DIPOLE_CHANGES_MATERIAL = 4
};

// The light that the irradiance comes from.
typedef enum sss_dipole_lighting
{
    SSS_DIPOLE_LIGHTING_ANY = 0, // shadow edges may cross the surface
    SSS_DIPOLE_LIGHTING_DISTANT, // distant lights that cast no shadow
    SSS_DIPOLE_LIGHTING_EVEN     // from all around
} sss_dipole_lighting;

// Which readings of the dipole on curved surfaces will do.
typedef enum sss_dipole_geometries
{
    SSS_DIPOLE_EITHER_GEOMETRY = 0,
    SSS_DIPOLE_ONLY_DISTANCE,
    SSS_DIPOLE_ONLY_PLACED
} sss_dipole_geometries;

// Ways to radiosity, of all headers. Where two predictions are equal the earlier one is taken.
typedef enum sss_dipole_method
{
    SSS_DIPOLE_METHOD_LAMBERT = 0, // sss_dipole_lambert; no scattering, so of either geometry
    SSS_DIPOLE_METHOD_DIRECT,      // sss_dipole_gather_*, distance only
    SSS_DIPOLE_METHOD_POINTS,      // the same with point_sampling, from a copy of the mesh thinned to `density`
    SSS_DIPOLE_METHOD_PLACED,      // sss_dipole_gather_* with SSS_DIPOLE_PLACED
    SSS_DIPOLE_METHOD_BEM,         // sss_bem_shade, placed
    SSS_DIPOLE_METHOD_BEM_RENDER,  // sss_bem_update and sss_bem_render, placed
    SSS_DIPOLE_METHOD_HAO          // sss_hao_relight_*, distance only
} sss_dipole_method;

#define SSS_DIPOLE_METHOD_COUNT 7 // rises as headers join

typedef struct sss_dipole_scene
{
    double size_mm;      // largest extent of the object; required, > 0
    double thickness_mm; // smallest extent light could cross; 0: size_mm
    double area_mm2;     // surface area; 0: a sphere's of diameter size_mm
    double spacing_mm;   // mean edge length of the mesh; 0: unknown
    double pixel_mm;     // a pixel's width on the object; 0: unknown
    double tolerance;    // relative L2 error allowed, in (0, 1); 0: 1e-2
    // For the ranking.
    size_t vertex_count;              // 0: half the triangles
    size_t triangle_count;            // 0: from area_mm2 and spacing_mm, or else from the advised spacing
    double volume_mm3;                // of a closed mesh; 0: unknown, taken as a sphere's of this area
    unsigned changes;                 // bits SSS_DIPOLE_CHANGES_*; 0: a still picture
    sss_dipole_lighting lighting;     // 0: any
    sss_dipole_geometries geometries; // 0: either
    unsigned left_out;                // bits 1u << sss_dipole_method: methods not to be ranked; 0: none
    int threads;                      // that share the work; 0: 1
    double speed;                     // of one thread here over one of the chart's machine; 0: 1
    double frame_budget_ms;           // for what changes; a still picture has none; 0: none
    double precompute_budget_s;       // for what does not; 0: none
    double memory_budget;             // bytes held between frames; 0: none
    double lambert_error;             // relative L2 error of Lambert where it is known: sss_dipole_lambert_error;
                                      // 0: predicted
} sss_dipole_scene;

typedef enum sss_dipole_need
{
    SSS_DIPOLE_NEED_LAMBERT = 0, // scattering is not visible: sss_dipole_lambert is enough
    SSS_DIPOLE_NEED_LOCAL,       // a neighbourhood of radius_mm is enough
    SSS_DIPOLE_NEED_GLOBAL       // light crosses the object: every part matters
} sss_dipole_need;

// One method with the knob at which it is cheapest within the tolerance; if it has none, at its most accurate one.
typedef struct sss_dipole_choice
{
    sss_dipole_method method;
    double tolerance;       // options.tolerance to give it; 0: it has none, or its default
    double density;         // share of the mesh's triangles to gather from; 1: the mesh as it is
    size_t directions;      // hao: options.directions; 0: none
    int storage;            // hao: options.storage, a sss_hao_storage
    double predicted_error; // relative L2, against the converged integral of its own geometry
    double precompute_s;    // once
    double frame_ms;        // for every light
    double rebuild_ms;      // for every change of geometry or material, besides frame_ms
    double bytes;           // held between frames
    double cost_ms;         // what counts: a still picture precompute_s and frame_ms; else what changes does again
    int meets;              // 1: tolerance and budgets are met
} sss_dipole_choice;

typedef struct sss_dipole_advice
{
    sss_dipole_need need;    // the least that meets the tolerance
    double predicted_error;  // relative error of what that leaves out: lambert_error, the light beyond radius_mm, or 0
    double lambert_error;    // predicted relative L2 error of Lambert under one shadow edge across the object
    double crossing;         // share of the light that reaches farther than thickness_mm
    double radius_mm;        // radius that holds all but the tolerance; infinite where nothing less does
    double spacing_mm;       // sample spacing at which plain point sampling meets the tolerance
    double spacing_error;    // predicted relative L2 error of plain point sampling at the scene's spacing; 0: unknown
    double sample_count;     // triangles of that edge length on the area: area / (sqrt(3)/4 spacing^2)
    char reason[160];        // one line, English
    // Methods, the one to take first: those that meet tolerance and budgets by cost, then those that meet the budgets
    // by error, then the rest by cost.
    sss_dipole_choice ranking[SSS_DIPOLE_METHOD_COUNT];
    size_t ranking_count;     // at least 1, unless all are left out
    int extrapolated;         // 1: a size, mesh or material beyond the chart's; predictions are of its nearest
    double model_error;       // predicted relative error of the dipole model itself, which no method can make less: of
                              // total reflectance, slabs included, and of the profile; not in the ranking's errors
    char ranking_reason[240]; // one line, English: what ranking[0] is taken for
} sss_dipole_advice;

// Fills in what a mesh tells of a scene: size, area, spacing (mean length of all triangles' edges), counts, and the
// volume where the mesh is closed, or nearly (its area vectors cancel to 2 % of its area). The rest is 0.
// SSS_ERROR_INVALID_ARGUMENT, _EMPTY, _INDEX, _OVERFLOW.
SSS_DIPOLE_API sss_result sss_dipole_measure(const sss_mesh *mesh, sss_dipole_scene *out);

// Measures what sss_dipole_needs can only predict: the relative L2 error of Lambert for one irradiance, in the
// middle of some triangles, area-weighted, against the direct gather (distance only), to within 1e-3. Not at
// vertices, where a coarse mesh has corners that are the mesh's and not the object's.
//   irradiance  [V][3], W/mm^2;   count  triangles, spread over their order; 0: 100;   hooks  may be NULL
//   error       0 without light. It costs as much as `count` vertices of a direct gather
// Allocates. All errors of the gather; *error is then untouched.
SSS_DIPOLE_API sss_result sss_dipole_lambert_error(const sss_mesh *mesh, const sss_profile *profile,
                                                   const float *irradiance, size_t count, const sss_hooks *hooks,
                                                   double *error);

// Says whether scattering is visible at all, whether it is local, whether light crosses the object, and what
// radius and sampling are needed: the worst of the three channels decides. How these numbers are predicted is
// said at the implementation; tests/test_dipole.c compares them with measured errors.
//   Then it ranks the methods of all headers: error, times and bytes from curves that are fitted to the measured runs
// of tests/chart/chart.csv. No clock is read. tests/chart/choice holds the choice against every run of the chart.
// SSS_ERROR_INVALID_ARGUMENT: null, non-finite or out of range.
SSS_DIPOLE_API sss_result sss_dipole_needs(const sss_profile *profile, const sss_dipole_scene *scene,
                                           sss_dipole_advice *out);

// "lambert", "direct", "direct-points", "direct-placed", "bem", "bem-render", "hao", as in chart.csv; NULL for others.
SSS_DIPOLE_API const char *sss_dipole_method_name(sss_dipole_method method);

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

// SSS_ERROR_INVALID_ARGUMENT: null, an invalid profile or convention.
SSS_DIPOLE_API sss_result sss_dipole_get_glsl_uniforms(const sss_profile *profile, sss_dipole_exit exit_convention,
                                                       sss_dipole_glsl_uniforms *out);

#ifdef __cplusplus
}
#endif

// ================================================ GLSL =================================================
// The shader pieces, as readable source. Each has its own include guard, so that a shader may hold a piece
// twice; none has a #version line.

#define SSS_DIPOLE__GLSL_FRESNEL                                                                                \
    "#ifndef SSS_DIPOLE_FRESNEL\n"                                                                              \
    "#define SSS_DIPOLE_FRESNEL\n"                                                                              \
    "#ifdef GL_ES\n"                                                                                            \
    "precision highp float;\n"                                                                                  \
    "#endif\n"                                                                                                  \
    "// Unpolarised reflectance of a smooth dielectric; eta = index beyond / index on this side.\n"             \
    "float sss_fresnel(float cos_i, float eta)\n"                                                               \
    "{\n"                                                                                                       \
    "    if (eta == 1.0) return 0.0;\n"                                                                         \
    "    float c = clamp(cos_i, 0.0, 1.0);\n"                                                                   \
    "    float g2 = (eta - 1.0) * (eta + 1.0) + c * c;\n"                                                       \
    "    if (g2 <= 0.0) return 1.0; // total internal reflection\n"                                             \
    "    float g = sqrt(g2);\n"                                                                                 \
    "    float r_s = (c - g) / (c + g);\n"                                                                      \
    "    float r_p = (eta * eta * c - g) / (eta * eta * c + g);\n"                                              \
    "    return 0.5 * (r_s * r_s + r_p * r_p);\n"                                                               \
    "}\n"                                                                                                       \
    "// Schlick's approximation; from the denser side it takes the cosine beyond the boundary.\n"               \
    "float sss_fresnel_schlick(float cos_i, float eta)\n"                                                       \
    "{\n"                                                                                                       \
    "    float c = clamp(cos_i, 0.0, 1.0);\n"                                                                   \
    "    if (eta < 1.0)\n"                                                                                      \
    "    {\n"                                                                                                   \
    "        float g2 = (eta - 1.0) * (eta + 1.0) + c * c;\n"                                                   \
    "        if (g2 <= 0.0) return 1.0;\n"                                                                      \
    "        c = sqrt(g2) / eta;\n"                                                                             \
    "    }\n"                                                                                                   \
    "    float F_0 = (eta - 1.0) * (eta - 1.0) / ((eta + 1.0) * (eta + 1.0));\n"                                \
    "    float m = 1.0 - c;\n"                                                                                  \
    "    return F_0 + (1.0 - F_0) * m * m * m * m * m;\n"                                                       \
    "}\n"                                                                                                       \
    "#endif\n"

#define SSS_DIPOLE__GLSL_PROFILE                                                                                \
    "#ifndef SSS_DIPOLE_PROFILE\n"                                                                              \
    "#define SSS_DIPOLE_PROFILE\n"                                                                              \
    "#ifdef GL_ES\n"                                                                                            \
    "precision highp float;\n"                                                                                  \
    "#endif\n"                                                                                                  \
    "uniform vec3 sss_alpha_p;     // reduced albedo\n"                                                         \
    "uniform vec3 sss_sigma_tr;    // 1/mm\n"                                                                   \
    "uniform vec3 sss_z_r;         // mm, depth of the real source\n"                                           \
    "uniform vec3 sss_z_v;         // mm, height of the virtual source\n"                                       \
    "uniform float sss_eta;        // medium over outside\n"                                                    \
    "uniform float sss_exit_scale; // 1, or 1/(1 - F_external)\n"                                               \
    "// One source at depth z and distance d: z (1 + sigma d) exp(-sigma d) / d^3.\n"                           \
    "vec3 sss_source(vec3 z, vec3 d)\n"                                                                         \
    "{\n"                                                                                                       \
    "    vec3 u = sss_sigma_tr * d;\n"                                                                          \
    "    return z / d * (1.0 + u) * exp(-u) / (d * d);\n"                                                       \
    "}\n"                                                                                                       \
    "// R_d(r), 1/mm^2; r in mm. A channel without scattering has R_d = 0.\n"                                   \
    "vec3 sss_Rd(float r)\n"                                                                                    \
    "{\n"                                                                                                       \
    "    vec3 z_r = max(sss_z_r, 1e-12), z_v = max(sss_z_v, 1e-12);\n"                                          \
    "    vec3 C = sss_source(z_r, sqrt(r * r + z_r * z_r)) + sss_source(z_v, sqrt(r * r + z_v * z_v));\n"       \
    "    return sss_alpha_p * 0.0795774715459477 * C; // 1/(4 pi)\n"                                            \
    "}\n"                                                                                                       \
    "// R_d with the sources placed at the receiver x_o along its unit normal n_o; mm.\n"                       \
    "vec3 sss_Rd_placed(vec3 x_i, vec3 x_o, vec3 n_o)\n"                                                        \
    "{\n"                                                                                                       \
    "    vec3 v = x_i - x_o;\n"                                                                                 \
    "    float p = dot(v, n_o);        // height of x_i over the tangent plane\n"                               \
    "    vec3 w = v - p * n_o;\n"                                                                               \
    "    float t2 = dot(w, w);         // squared distance along it\n"                                          \
    "    vec3 z_r = max(sss_z_r, 1e-12), z_v = max(sss_z_v, 1e-12);\n"                                          \
    "    vec3 d_r = sqrt(t2 + (p + z_r) * (p + z_r));\n"                                                        \
    "    vec3 d_v = sqrt(t2 + (p - z_v) * (p - z_v));\n"                                                        \
    "    return sss_alpha_p * 0.0795774715459477 * (sss_source(z_r, d_r) + sss_source(z_v, d_v));\n"            \
    "}\n"                                                                                                       \
    "// Outgoing radiance is sss_exit_factor(cos_o) / pi times the radiosity B.\n"                              \
    "float sss_exit_factor(float cos_o)\n"                                                                      \
    "{\n"                                                                                                       \
    "    return sss_exit_scale * (1.0 - sss_fresnel(cos_o, sss_eta));\n"                                        \
    "}\n"                                                                                                       \
    "#endif\n"

#define SSS_DIPOLE__GLSL_TONE_MAPPING                                                                           \
    "#ifndef SSS_DIPOLE_TONE_MAPPING\n"                                                                         \
    "#define SSS_DIPOLE_TONE_MAPPING\n"                                                                         \
    "#ifdef GL_ES\n"                                                                                            \
    "precision highp float;\n"                                                                                  \
    "#endif\n"                                                                                                  \
    "uniform float sss_exposure; // factor on radiance\n"                                                       \
    "// Filmic curve: Narkowicz 2015, a fit of the ACES reference rendering, then the sRGB transfer curve.\n"   \
    "vec3 sss_tone_map(vec3 radiance)\n"                                                                        \
    "{\n"                                                                                                       \
    "    vec3 x = max(radiance * sss_exposure, vec3(0.0));\n"                                                   \
    "    x = min(x, vec3(1e4)); // the curve is flat there; keeps x * x finite in half precision\n"             \
    "    vec3 y = clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);\n"                   \
    "    vec3 low = 12.92 * y;\n"                                                                               \
    "    vec3 high = 1.055 * pow(max(y, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055;\n"                               \
    "    return mix(high, low, vec3(lessThanEqual(y, vec3(0.0031308))));\n"                                     \
    "}\n"                                                                                                       \
    "#endif\n"

#endif // SSS_DIPOLE_H

// =========================================== IMPLEMENTATION ============================================
#ifdef SSS_DIPOLE_IMPLEMENTATION
#ifndef SSS_DIPOLE_IMPLEMENTED
#define SSS_DIPOLE_IMPLEMENTED

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SSS_DIPOLE__PI 3.14159265358979323846
#define SSS_DIPOLE__SQRT3 1.73205080756887729353

// ---- small maths and checks ----

// Looks at the bits, so that it holds under -ffast-math as well.
static int sss_dipole__finite(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (bits & 0x7ff0000000000000u) != 0x7ff0000000000000u;
}

static int sss_dipole__in_range(double x, double low, double high)
{
    return sss_dipole__finite(x) && x >= low && x <= high;
}

static float sss_dipole__float_of_bits(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint32_t sss_dipole__bits_of_float(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static int sss_dipole__all_finite(const float *x, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++)
    {
        if (!sss_dipole__finite((double)x[i]))
        {
            return 0;
        }
    }
    return 1;
}

static double sss_dipole__max(double a, double b)
{
    return a > b ? a : b;
}

static double sss_dipole__min(double a, double b)
{
    return a < b ? a : b;
}

static double sss_dipole__dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void sss_dipole__cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

// Scales to unit length, without overflow for any finite input; 0 for a zero vector.
static int sss_dipole__normalize(double v[3])
{
    const double largest = sss_dipole__max(fabs(v[0]), sss_dipole__max(fabs(v[1]), fabs(v[2])));
    double length;
    int i;
    if (!(largest > 0.0) || !sss_dipole__finite(v[0]) || !sss_dipole__finite(v[1]) || !sss_dipole__finite(v[2]))
    {
        return 0;
    }
    for (i = 0; i < 3; i++)
    {
        v[i] /= largest;
    }
    length = sqrt(sss_dipole__dot(v, v));
    for (i = 0; i < 3; i++)
    {
        v[i] /= length;
    }
    return 1;
}

// The root of a monotone function in [low, high], both > 0, by bisection of the logarithm, until the bracket is
// narrower than the relative precision.
static double sss_dipole__bisect(double (*f)(const void *context, double x), const void *context, double target,
                                 double low, double high, double precision)
{
    const int rising = f(context, high) > f(context, low);
    int i;
    for (i = 0; i < 100 && high > low * (1.0 + precision); i++)
    {
        const double middle = sqrt(low) * sqrt(high);
        if ((f(context, middle) < target) == rising)
        {
            low = middle;
        }
        else
        {
            high = middle;
        }
    }
    return sqrt(low) * sqrt(high);
}

// ---- 2. Fresnel (before the materials, which need it) ----

static int sss_dipole__valid_mode(sss_dipole_fresnel_mode mode)
{
    return mode == SSS_DIPOLE_FRESNEL_EXACT || mode == SSS_DIPOLE_FRESNEL_POLYNOMIAL;
}

static int sss_dipole__valid_exit(sss_dipole_exit convention)
{
    return convention == SSS_DIPOLE_EXIT_PAPER || convention == SSS_DIPOLE_EXIT_CONSERVING;
}

static int sss_dipole__valid_eta(double eta)
{
    return sss_dipole__in_range(eta, 0.1, 10.0);
}

SSS_DIPOLE_API double sss_dipole_fresnel(double cos_i, double eta)
{
    double g2, g, r_s, r_p;
    if (!sss_dipole__in_range(cos_i, 0.0, 1.0) || !(eta > 0.0) || !sss_dipole__finite(eta))
    {
        return NAN;
    }
    if (eta == 1.0)
    {
        return 0.0;
    }
    g2 = (eta - 1.0) * (eta + 1.0) + cos_i * cos_i; // (eta cos_t)^2
    if (g2 <= 0.0)
    {
        return 1.0; // total internal reflection
    }
    g = sqrt(g2);
    r_s = (cos_i - g) / (cos_i + g);
    r_p = (eta * eta * cos_i - g) / (eta * eta * cos_i + g);
    return 0.5 * (r_s * r_s + r_p * r_p);
}

SSS_DIPOLE_API double sss_dipole_fresnel_schlick(double cos_i, double eta)
{
    double c = cos_i, F_0, m;
    if (!sss_dipole__in_range(cos_i, 0.0, 1.0) || !(eta > 0.0) || !sss_dipole__finite(eta))
    {
        return NAN;
    }
    if (eta < 1.0) // from the denser side the cosine beyond the boundary decides
    {
        const double g2 = (eta - 1.0) * (eta + 1.0) + c * c;
        if (g2 <= 0.0)
        {
            return 1.0;
        }
        c = sqrt(g2) / eta;
    }
    F_0 = (eta - 1.0) * (eta - 1.0) / ((eta + 1.0) * (eta + 1.0));
    m = 1.0 - c;
    return F_0 + (1.0 - F_0) * m * m * m * m * m;
}

// The p-polarised half of the diffuse reflectance from the thinner side, near n = 1, where the closed form
// cancels. With mu = sqrt(n^2-1) sinh t and y = exp(-2t) the Fresnel integral over t becomes
//   F_p = (n^2-1)/4 int_w^1 ((k-y)/(1-ky))^2 (1-y^2)/y^2 dy,   w = (n-1)/(n+1),  k = (n^2-1)/(n^2+1),
// and expanding 1/(1-ky)^2 = sum (j+1) (ky)^j gives terms that are all positive.
static double sss_dipole__fresnel_p_series(double w)
{
    const double k = 2.0 * w / (1.0 + w * w);
    const double n2_1 = 4.0 * w / ((1.0 - w) * (1.0 - w)); // n^2 - 1
    const double polynomial[5] = {k * k, -2.0 * k, 1.0 - k * k, 2.0 * k, -1.0}; // (k-y)^2 (1-y^2)
    double sum = 0.0, k_j = 1.0;
    int j, m;
    for (j = 0; j < 40; j++) // k <= 0.3: 0.3^40 = 1e-21
    {
        double term = 0.0;
        for (m = 0; m < 5; m++)
        {
            const int e = j - 2 + m + 1; // int_w^1 y^(e-1) dy
            term += polynomial[m] * (e == 0 ? -log(w) : (1.0 - pow(w, (double)e)) / (double)e);
        }
        sum += (double)(j + 1) * k_j * term;
        k_j *= k;
    }
    return 0.25 * n2_1 * sum;
}

// Diffuse reflectance seen from the thinner side, as a function of w = (n-1)/(n+1), n > 1 the ratio of indices.
static double sss_dipole__fresnel_thin_side(double w)
{
    const double n = (1.0 + w) / (1.0 - w), n2 = n * n, n4 = n2 * n2;
    if (w <= 0.0)
    {
        return 0.0;
    }
    if (w < 0.15) // k < 0.3
    {
        const double F_s = w * (2.0 + w) / 3.0; // the s-polarised half, by the same substitution
        return 0.5 * (F_s + sss_dipole__fresnel_p_series(w));
    }
    return 0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0) * (n + 1.0)) // Duderstadt and Hamilton; verified
           + n2 * (n2 - 1.0) * (n2 - 1.0) / ((n2 + 1.0) * (n2 + 1.0) * (n2 + 1.0)) * log(w) // by quadrature
           - 2.0 * n * n2 * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
           + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0) * (n4 - 1.0)) * log(n);
}

// The same from the denser side: 1 - F_dense = (1 - F_thin)/n^2, without the cancellation at n = 1.
static double sss_dipole__fresnel_dense_side(double w)
{
    const double n = (1.0 + w) / (1.0 - w);
    return 4.0 * w / ((1.0 + w) * (1.0 + w)) + sss_dipole__fresnel_thin_side(w) / (n * n);
}

// The polynomials of Egan and Hilgeman as Jensen et al. 2001 print them; eta here is the ratio of the side
// that the light is on to the side beyond. At eta = 1, where they give 0.0016, the boundary is taken as absent.
static double sss_dipole__fresnel_polynomial(double eta)
{
    const double e = 1.0 / eta;
    if (eta == 1.0)
    {
        return 0.0;
    }
    return eta > 1.0 ? -1.440 * e * e + 0.710 * e + 0.668 + 0.0636 * eta
                     : -0.4399 + 0.7099 * e - 0.3319 * e * e + 0.0636 * e * e * e;
}

SSS_DIPOLE_API double sss_dipole_fresnel_internal(double eta, sss_dipole_fresnel_mode mode)
{
    const double w = fabs(eta - 1.0) / (eta + 1.0);
    if (!sss_dipole__valid_eta(eta) || !sss_dipole__valid_mode(mode))
    {
        return NAN;
    }
    if (mode == SSS_DIPOLE_FRESNEL_POLYNOMIAL)
    {
        return sss_dipole__fresnel_polynomial(eta);
    }
    return eta > 1.0 ? sss_dipole__fresnel_dense_side(w) : sss_dipole__fresnel_thin_side(w);
}

SSS_DIPOLE_API double sss_dipole_fresnel_external(double eta, sss_dipole_fresnel_mode mode)
{
    const double w = fabs(eta - 1.0) / (eta + 1.0);
    if (!sss_dipole__valid_eta(eta) || !sss_dipole__valid_mode(mode))
    {
        return NAN;
    }
    if (mode == SSS_DIPOLE_FRESNEL_POLYNOMIAL)
    {
        return sss_dipole__fresnel_polynomial(1.0 / eta);
    }
    return eta > 1.0 ? sss_dipole__fresnel_thin_side(w) : sss_dipole__fresnel_dense_side(w);
}

SSS_DIPOLE_API double sss_dipole_exit_factor(double cos_o, double eta, sss_dipole_exit exit_convention)
{
    const double F_t = 1.0 - sss_dipole_fresnel(cos_o, eta);
    if (!sss_dipole__valid_eta(eta) || !sss_dipole__valid_exit(exit_convention))
    {
        return NAN;
    }
    if (exit_convention != SSS_DIPOLE_EXIT_CONSERVING)
    {
        return F_t;
    }
    return F_t / (1.0 - sss_dipole_fresnel_external(eta, SSS_DIPOLE_FRESNEL_EXACT));
}

// ---- 1. Materials ----

typedef struct sss_dipole__measured
{
    const char *name;
    sss_dipole_material material;
} sss_dipole__measured;

// Jensen et al. 2001, figure 5, 1/mm: sigma_s' RGB, sigma_a RGB, eta. Checked against three renderers' tables;
// where copies in circulation differ, the value that gives the paper's own printed reflectance stands here:
// Chicken1 R .015 (not .0015), Chicken2 R .018 (not .0018), Apple G .0034 (not .0030), Marble B .0071 (not .071).
static const sss_dipole__measured sss_dipole__materials[] = {
    {"Apple", {{2.29, 2.39, 1.97}, {0.0030, 0.0034, 0.046}, 1.3}},
    {"Chicken1", {{0.15, 0.21, 0.38}, {0.015, 0.077, 0.19}, 1.3}},
    {"Chicken2", {{0.19, 0.25, 0.32}, {0.018, 0.088, 0.20}, 1.3}},
    {"Cream", {{7.38, 5.47, 3.15}, {0.0002, 0.0028, 0.0163}, 1.3}},
    {"Ketchup", {{0.18, 0.07, 0.03}, {0.061, 0.97, 1.45}, 1.3}},
    {"Marble", {{2.19, 2.62, 3.00}, {0.0021, 0.0041, 0.0071}, 1.5}},
    {"Potato", {{0.68, 0.70, 0.55}, {0.0024, 0.0090, 0.12}, 1.3}},
    {"Skimmilk", {{0.70, 1.22, 1.90}, {0.0014, 0.0025, 0.0142}, 1.3}},
    {"Skin1", {{0.74, 0.88, 1.01}, {0.032, 0.17, 0.48}, 1.3}},
    {"Skin2", {{1.09, 1.59, 1.79}, {0.013, 0.070, 0.145}, 1.3}},
    {"Spectralon", {{11.6, 20.4, 14.9}, {0.0, 0.0, 0.0}, 1.3}},
    {"Wholemilk", {{2.55, 3.21, 3.77}, {0.0011, 0.0024, 0.014}, 1.3}},
};

SSS_DIPOLE_API size_t sss_dipole_material_count(void)
{
    return sizeof sss_dipole__materials / sizeof sss_dipole__materials[0];
}

SSS_DIPOLE_API const char *sss_dipole_material_name(size_t index)
{
    return index < sss_dipole_material_count() ? sss_dipole__materials[index].name : NULL;
}

// The next significant letter of a name, in lower case; 0 at the end. Never touches the locale.
static int sss_dipole__letter(const char **p)
{
    while (**p == ' ' || **p == '-' || **p == '_')
    {
        (*p)++;
    }
    if (**p == '\0')
    {
        return 0;
    }
    return **p >= 'A' && **p <= 'Z' ? *(*p)++ - 'A' + 'a' : *(*p)++;
}

static int sss_dipole__same_name(const char *a, const char *b)
{
    for (;;)
    {
        const int x = sss_dipole__letter(&a), y = sss_dipole__letter(&b);
        if (x != y || x == 0)
        {
            return x == y;
        }
    }
}

SSS_DIPOLE_API sss_result sss_dipole_material_by_name(const char *name, sss_dipole_material *out)
{
    size_t i;
    if (name == NULL || out == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < sss_dipole_material_count(); i++)
    {
        if (sss_dipole__same_name(name, sss_dipole__materials[i].name))
        {
            *out = sss_dipole__materials[i].material;
            return SSS_OK;
        }
    }
    return SSS_ERROR_NOT_FOUND;
}

static int sss_dipole__valid_material(const sss_dipole_material *m)
{
    int i;
    for (i = 0; i < 3; i++)
    {
        if (!sss_dipole__in_range(m->sigma_s[i], 0.0, 1e150) || !sss_dipole__in_range(m->sigma_a[i], 0.0, 1e150))
        {
            return 0;
        }
    }
    return sss_dipole__valid_eta(m->eta);
}

static sss_result sss_dipole__give_material(const sss_dipole_material *m, sss_dipole_material *out)
{
    if (!sss_dipole__valid_material(m))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    *out = *m;
    return SSS_OK;
}

SSS_DIPOLE_API sss_result sss_dipole_material_from_coefficients(const double sigma_s[3], const double sigma_a[3],
                                                                double eta, sss_dipole_material *out)
{
    sss_dipole_material m;
    int i;
    if (sigma_s == NULL || sigma_a == NULL || out == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < 3; i++)
    {
        m.sigma_s[i] = sigma_s[i];
        m.sigma_a[i] = sigma_a[i];
    }
    m.eta = eta;
    return sss_dipole__give_material(&m, out);
}

// A = (1 + F_dr)/(1 - F_dr), and z_v = (1 + 4A/3) z_r.
static double sss_dipole__image_ratio(double F_internal)
{
    const double A = (1.0 + F_internal) / (1.0 - F_internal);
    return 1.0 + 4.0 / 3.0 * A;
}

// 1 - Rd_total as a function of u = sigma_tr z_r = sqrt(3 (1 - alpha')), with context = z_v/z_r: nothing
// cancels as u -> 0.
static double sss_dipole__loss_of_u(const void *context, double u)
{
    const double q = *(const double *)context;
    return -0.5 * (expm1(-u) + expm1(-q * u)) + u * u / 6.0 * (exp(-u) + exp(-q * u));
}

// Rd_total as a function of v = sqrt(3) - u: alpha' = v (2 sqrt(3) - v)/3 keeps its digits as alpha' -> 0.
static double sss_dipole__total_of_v(const void *context, double v)
{
    const double q = *(const double *)context, u = SSS_DIPOLE__SQRT3 - v;
    return v * (2.0 * SSS_DIPOLE__SQRT3 - v) / 6.0 * (exp(-u) + exp(-q * u));
}

// Inverts Rd_total(alpha'), which rises from 0 to 1, for alpha' and 1 - alpha'.
static void sss_dipole__invert_albedo(double albedo, double q, double *alpha_p, double *one_minus_alpha_p)
{
    const double u_split = 0.5 * SSS_DIPOLE__SQRT3;
    *alpha_p = albedo;                   // right at both ends
    *one_minus_alpha_p = 1.0 - albedo;
    if (albedo <= 0.0 || albedo >= 1.0)
    {
        return;
    }
    if (1.0 - albedo < sss_dipole__loss_of_u(&q, u_split))
    {
        const double u = sss_dipole__bisect(sss_dipole__loss_of_u, &q, 1.0 - albedo, 1e-300, u_split, 1e-16);
        *one_minus_alpha_p = u * u / 3.0;
        *alpha_p = 1.0 - *one_minus_alpha_p;
    }
    else
    {
        const double v = sss_dipole__bisect(sss_dipole__total_of_v, &q, albedo, 1e-307, u_split, 1e-16);
        *alpha_p = v * (2.0 * SSS_DIPOLE__SQRT3 - v) / 3.0;
        *one_minus_alpha_p = 1.0 - *alpha_p;
    }
}

SSS_DIPOLE_API sss_result sss_dipole_material_from_albedo(const double albedo[3], const double mean_free_path[3],
                                                          double eta, sss_dipole_material *out)
{
    sss_dipole_material m;
    double q;
    int i;
    if (albedo == NULL || mean_free_path == NULL || out == NULL || !sss_dipole__valid_eta(eta))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    q = sss_dipole__image_ratio(sss_dipole_fresnel_internal(eta, SSS_DIPOLE_FRESNEL_EXACT));
    for (i = 0; i < 3; i++)
    {
        double alpha_p, one_minus_alpha_p;
        if (!sss_dipole__in_range(albedo[i], 0.0, 1.0) || !sss_dipole__in_range(mean_free_path[i], 1e-150, 1e150))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
        sss_dipole__invert_albedo(albedo[i], q, &alpha_p, &one_minus_alpha_p);
        m.sigma_s[i] = alpha_p / mean_free_path[i];
        m.sigma_a[i] = one_minus_alpha_p / mean_free_path[i];
    }
    m.eta = eta;
    return sss_dipole__give_material(&m, out);
}

SSS_DIPOLE_API sss_result sss_dipole_material_from_scattering(const double sigma_s[3], const double sigma_a[3],
                                                              double g, double eta, sss_dipole_material *out)
{
    double reduced[3];
    int i;
    if (sigma_s == NULL || !(g > -1.0 && g < 1.0))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < 3; i++)
    {
        reduced[i] = (1.0 - g) * sigma_s[i];
    }
    return sss_dipole_material_from_coefficients(reduced, sigma_a, eta, out);
}

SSS_DIPOLE_API sss_result sss_dipole_material_to_albedo(const sss_dipole_material *material, double albedo[3],
                                                        double mean_free_path[3])
{
    sss_profile profile;
    int i;
    if (material == NULL || albedo == NULL || mean_free_path == NULL
        || sss_dipole_profile(material, SSS_DIPOLE_FRESNEL_EXACT, &profile) != SSS_OK)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < 3; i++)
    {
        albedo[i] = sss_dipole_total(&profile, i);
        mean_free_path[i] = profile.z_r[i] > 0.0 ? profile.z_r[i] : HUGE_VAL;
    }
    return SSS_OK;
}

SSS_DIPOLE_API sss_result sss_dipole_material_to_scattering(const sss_dipole_material *material, double g,
                                                            double sigma_s[3], double sigma_a[3])
{
    int i;
    if (material == NULL || sigma_s == NULL || sigma_a == NULL || !(g > -1.0 && g < 1.0)
        || !sss_dipole__valid_material(material))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < 3; i++)
    {
        sigma_s[i] = material->sigma_s[i] / (1.0 - g);
        sigma_a[i] = material->sigma_a[i];
    }
    return SSS_OK;
}

// ---- 3. Profile ----

SSS_DIPOLE_API sss_result sss_dipole_profile(const sss_dipole_material *material, sss_dipole_fresnel_mode mode,
                                             sss_profile *out)
{
    sss_profile p;
    double q;
    int i;
    if (material == NULL || out == NULL || !sss_dipole__valid_material(material) || !sss_dipole__valid_mode(mode))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    p.eta = material->eta;
    p.F_internal = sss_dipole_fresnel_internal(p.eta, mode);
    p.F_external = sss_dipole_fresnel_external(p.eta, mode);
    if (!(p.F_internal >= 0.0 && p.F_internal < 1.0) || !(p.F_external >= 0.0 && p.F_external < 1.0))
    {
        return SSS_ERROR_INVALID_ARGUMENT; // the polynomials leave [0, 1) for eta far from 1
    }
    q = sss_dipole__image_ratio(p.F_internal);
    for (i = 0; i < 3; i++)
    {
        const double sigma_s = material->sigma_s[i], sigma_a = material->sigma_a[i];
        const double sigma_t = sigma_s + sigma_a;               // sigma_t', 1/mm
        p.alpha_p[i] = sigma_t > 0.0 ? sigma_s / sigma_t : 0.0;
        p.sigma_tr[i] = sqrt(3.0 * sigma_a) * sqrt(sigma_t);    // 1/mm; two roots, so that nothing overflows
        p.z_r[i] = sigma_t > 0.0 ? 1.0 / sigma_t : 0.0;         // mm
        p.z_v[i] = q * p.z_r[i];                                // z_r + 4 A D, D = 1/(3 sigma_t')
        if (!sss_dipole__finite(p.z_v[i]))
        {
            return SSS_ERROR_INVALID_ARGUMENT; // sigma_t' so small that its inverse overflows
        }
    }
    *out = p;
    return SSS_OK;
}

static int sss_dipole__valid_profile(const sss_profile *p)
{
    int i;
    for (i = 0; i < 3; i++)
    {
        const int transparent = p->alpha_p[i] == 0.0;
        if (!sss_dipole__in_range(p->alpha_p[i], 0.0, 1.0) || !(p->sigma_tr[i] >= 0.0)
            || !(transparent ? p->z_r[i] >= 0.0 : p->z_r[i] > 0.0) || !(p->z_v[i] >= p->z_r[i])
            || !sss_dipole__finite(p->sigma_tr[i]) || !sss_dipole__finite(p->z_v[i]))
        {
            return 0;
        }
    }
    return sss_dipole__valid_eta(p->eta) && p->F_internal >= 0.0 && p->F_internal < 1.0 && p->F_external >= 0.0
           && p->F_external < 1.0;
}

// Whether a channel of a profile can be asked for numbers at all.
static int sss_dipole__valid_channel(const sss_profile *p, int channel)
{
    return p != NULL && channel >= 0 && channel < 3 && sss_dipole__valid_profile(p);
}

// One source of the dipole at weight z and distance d: z (1 + sigma d) exp(-sigma d) / d^3, ordered so that
// neither d^3 nor its inverse overflows.
static double sss_dipole__source(double sigma_tr, double z, double d)
{
    return z / d * ((sigma_tr + 1.0 / d) / d) * exp(-sigma_tr * d);
}

static double sss_dipole__Rd(const sss_profile *p, int i, double r)
{
    const double d_r = hypot(r, p->z_r[i]); // mm, to the real source
    const double d_v = hypot(r, p->z_v[i]); // mm, to the virtual source
    if (p->alpha_p[i] == 0.0)
    {
        return 0.0;
    }
    return p->alpha_p[i] / (4.0 * SSS_DIPOLE__PI)
           * (sss_dipole__source(p->sigma_tr[i], p->z_r[i], d_r) + sss_dipole__source(p->sigma_tr[i], p->z_v[i], d_v));
}

SSS_DIPOLE_API double sss_dipole_Rd(const sss_profile *profile, int channel, double r)
{
    if (!sss_dipole__valid_channel(profile, channel) || !(r >= 0.0) || !sss_dipole__finite(r))
    {
        return NAN;
    }
    return sss_dipole__Rd(profile, channel, r);
}

static sss_result sss_dipole__check_array(const sss_profile *profile, const void *in, size_t count, const void *out)
{
    if (profile == NULL || in == NULL || out == NULL || !sss_dipole__valid_profile(profile))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (count == 0)
    {
        return SSS_ERROR_EMPTY;
    }
    return count > SIZE_MAX / (3 * sizeof(double)) ? SSS_ERROR_OVERFLOW : SSS_OK;
}

SSS_DIPOLE_API sss_result sss_dipole_Rd_array(const sss_profile *profile, const double *r, size_t count, double *out)
{
    const sss_result result = sss_dipole__check_array(profile, r, count, out);
    size_t k;
    int i;
    for (k = 0; result == SSS_OK && k < count; k++)
    {
        if (!(r[k] >= 0.0) || !sss_dipole__finite(r[k]))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
    }
    for (k = 0; result == SSS_OK && k < count; k++)
    {
        for (i = 0; i < 3; i++)
        {
            out[3 * k + (size_t)i] = sss_dipole__Rd(profile, i, r[k]);
        }
    }
    return result;
}

SSS_DIPOLE_API sss_result sss_dipole_Rd_array_float(const sss_profile *profile, const float *r, size_t count,
                                                    float *out)
{
    const sss_result result = sss_dipole__check_array(profile, r, count, out);
    size_t k;
    int i;
    for (k = 0; result == SSS_OK && k < count; k++)
    {
        if (!(r[k] >= 0.0f) || !sss_dipole__finite((double)r[k]))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
    }
    for (k = 0; result == SSS_OK && k < count; k++)
    {
        for (i = 0; i < 3; i++)
        {
            out[3 * k + (size_t)i] = (float)sss_dipole__Rd(profile, i, (double)r[k]);
        }
    }
    return result;
}

SSS_DIPOLE_API double sss_dipole_Rd_placed(const sss_profile *profile, int channel, const double x_i[3],
                                           const double x_o[3], const double n_o[3])
{
    double n[3], to_real[3], to_virtual[3];
    int i;
    if (!sss_dipole__valid_channel(profile, channel) || x_i == NULL || x_o == NULL || n_o == NULL)
    {
        return NAN;
    }
    for (i = 0; i < 3; i++)
    {
        n[i] = n_o[i];
        if (!sss_dipole__finite(x_i[i]) || !sss_dipole__finite(x_o[i]))
        {
            return NAN;
        }
    }
    if (!sss_dipole__normalize(n))
    {
        return NAN;
    }
    for (i = 0; i < 3; i++)
    {
        to_real[i] = x_i[i] - (x_o[i] - profile->z_r[channel] * n[i]);
        to_virtual[i] = x_i[i] - (x_o[i] + profile->z_v[channel] * n[i]);
    }
    if (profile->alpha_p[channel] == 0.0)
    {
        return 0.0;
    }
    return profile->alpha_p[channel] / (4.0 * SSS_DIPOLE__PI)
           * (sss_dipole__source(profile->sigma_tr[channel], profile->z_r[channel],
                                 sqrt(sss_dipole__dot(to_real, to_real)))
              + sss_dipole__source(profile->sigma_tr[channel], profile->z_v[channel],
                                   sqrt(sss_dipole__dot(to_virtual, to_virtual))));
}

// The flux of one source through the plane beyond radius R, over 2 pi: (z/q) exp(-sigma q), q^2 = z^2 + R^2.
static double sss_dipole__beyond(double sigma_tr, double z, double R)
{
    const double q = hypot(z, R);
    return z / q * exp(-sigma_tr * q);
}

// The same inside R: exp(-sigma z) - (z/q) exp(-sigma q), both parts positive, so that a small R keeps its digits.
static double sss_dipole__inside(double sigma_tr, double z, double R)
{
    const double q = hypot(z, R);
    const double q_z = R / (q + z) * R; // q - z
    return exp(-sigma_tr * z) * (q_z / q - z / q * expm1(-sigma_tr * q_z));
}

static double sss_dipole__sum_sources(double (*f)(double, double, double), const sss_profile *p, int i, double x)
{
    return p->alpha_p[i] == 0.0
               ? 0.0
               : 0.5 * p->alpha_p[i] * (f(p->sigma_tr[i], p->z_r[i], x) + f(p->sigma_tr[i], p->z_v[i], x));
}

SSS_DIPOLE_API double sss_dipole_total(const sss_profile *profile, int channel)
{
    return sss_dipole_flux_beyond(profile, channel, 0.0);
}

SSS_DIPOLE_API double sss_dipole_flux_inside(const sss_profile *profile, int channel, double radius)
{
    if (!sss_dipole__valid_channel(profile, channel) || !(radius >= 0.0))
    {
        return NAN;
    }
    if (!sss_dipole__finite(radius))
    {
        return sss_dipole_total(profile, channel);
    }
    return sss_dipole__sum_sources(sss_dipole__inside, profile, channel, radius);
}

SSS_DIPOLE_API double sss_dipole_flux_beyond(const sss_profile *profile, int channel, double radius)
{
    if (!sss_dipole__valid_channel(profile, channel) || !(radius >= 0.0))
    {
        return NAN;
    }
    if (!sss_dipole__finite(radius))
    {
        return 0.0;
    }
    return sss_dipole__sum_sources(sss_dipole__beyond, profile, channel, radius);
}

SSS_DIPOLE_API double sss_dipole_second_moment(const sss_profile *profile, int channel)
{
    double s, z_r, z_v;
    if (!sss_dipole__valid_channel(profile, channel))
    {
        return NAN;
    }
    if (profile->alpha_p[channel] == 0.0)
    {
        return 0.0;
    }
    s = profile->sigma_tr[channel];
    z_r = profile->z_r[channel];
    z_v = profile->z_v[channel];
    return s > 0.0 ? profile->alpha_p[channel] / s * (z_r * exp(-s * z_r) + z_v * exp(-s * z_v)) : HUGE_VAL;
}

typedef struct sss_dipole__of_channel
{
    const sss_profile *profile;
    int channel;
} sss_dipole__of_channel;

static double sss_dipole__inside_of(const void *context, double radius)
{
    const sss_dipole__of_channel *c = (const sss_dipole__of_channel *)context;
    return sss_dipole__sum_sources(sss_dipole__inside, c->profile, c->channel, radius);
}

static double sss_dipole__beyond_of(const void *context, double radius)
{
    const sss_dipole__of_channel *c = (const sss_dipole__of_channel *)context;
    return sss_dipole__sum_sources(sss_dipole__beyond, c->profile, c->channel, radius);
}

SSS_DIPOLE_API double sss_dipole_radius(const sss_profile *profile, int channel, double fraction)
{
    sss_dipole__of_channel context;
    double total, low, high;
    if (!sss_dipole__valid_channel(profile, channel) || !sss_dipole__in_range(fraction, 0.0, 1.0))
    {
        return NAN;
    }
    total = sss_dipole_total(profile, channel);
    if (fraction == 0.0 || total == 0.0)
    {
        return 0.0;
    }
    if (fraction == 1.0)
    {
        return HUGE_VAL;
    }
    context.profile = profile;
    context.channel = channel;
    // The flux inside goes as R^2, so that `low` holds less than any double; without absorption the flux beyond goes
    // as 1/R, so that beyond `high` lies less than any 1 - fraction.
    low = sss_dipole__max(1e-160 * profile->z_r[channel], 1e-307);
    high = sss_dipole__min(1e20 * profile->z_v[channel], 1e300);
    return fraction < 0.5
               ? sss_dipole__bisect(sss_dipole__inside_of, &context, fraction * total, low, high, 1e-16)
               : sss_dipole__bisect(sss_dipole__beyond_of, &context, (1.0 - fraction) * total, low, high, 1e-16);
}

static double sss_dipole__spectrum_of(double sigma_tr, double z, double k)
{
    return exp(-z * hypot(sigma_tr, k));
}

SSS_DIPOLE_API double sss_dipole_spectrum(const sss_profile *profile, int channel, double k)
{
    if (!sss_dipole__valid_channel(profile, channel) || !(k >= 0.0))
    {
        return NAN;
    }
    return sss_dipole__sum_sources(sss_dipole__spectrum_of, profile, channel, k);
}

SSS_DIPOLE_API sss_result sss_dipole_lambert(const sss_profile *profile, const float *irradiance, size_t count,
                                             float *radiosity)
{
    const sss_result result = sss_dipole__check_array(profile, irradiance, count, radiosity);
    size_t k;
    int i;
    if (result != SSS_OK)
    {
        return result;
    }
    if (!sss_dipole__all_finite(irradiance, 3 * count))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < 3; i++)
    {
        const double total = sss_dipole_total(profile, i);
        for (k = 0; k < count; k++)
        {
            radiosity[3 * k + (size_t)i] = (float)(total * (double)irradiance[3 * k + (size_t)i]);
        }
    }
    return SSS_OK;
}

// ---- 4. Irradiance ----

static sss_result sss_dipole__check_mesh(const sss_mesh *mesh)
{
    size_t k;
    if (mesh == NULL || mesh->positions == NULL || mesh->triangles == NULL
        || !sss_dipole__in_range(mesh->mm_per_unit, 1e-100, 1e100)) // beyond, areas overflow
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (mesh->vertex_count == 0 || mesh->triangle_count == 0)
    {
        return SSS_ERROR_EMPTY;
    }
    // 512 bytes an element is more than any array made of it
    if (mesh->vertex_count > SIZE_MAX / 512 || mesh->triangle_count > SIZE_MAX / 512)
    {
        return SSS_ERROR_OVERFLOW;
    }
    if (!sss_dipole__all_finite(mesh->positions, 3 * mesh->vertex_count)
        || (mesh->normals != NULL && !sss_dipole__all_finite(mesh->normals, 3 * mesh->vertex_count)))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (k = 0; k < 3 * mesh->triangle_count; k++)
    {
        if (mesh->triangles[k] >= mesh->vertex_count)
        {
            return SSS_ERROR_INDEX;
        }
    }
    return SSS_OK;
}

// ---- what is told of a mesh ----

#define SSS_DIPOLE__BORDER_BINS 512
#define SSS_DIPOLE__BORDER_ROUNDING 1e-12 // of all edges' length: below this a bin's sum is rounding
#define SSS_DIPOLE__VOLUME_ROUNDING 1e-6  // of areas times distances: positions are float, a sheet encloses nothing

typedef struct sss_dipole__condition
{
    double bins[SSS_DIPOLE__BORDER_BINS];
    double edge_sum, longest_edge, border; // lengths in the positions' unit
    double area, area_against, volume, volume_size; // twice the areas, six times the volumes
    double center[3];
} sss_dipole__condition;

// An edge's ends in order, by their bits, so that it is the same edge from either side; -0 is 0. 1, -1; 0: no length.
static int sss_dipole__edge_order(const float *p, const float *q, uint64_t *hash)
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

static void sss_dipole__inspect_triangle(const float *positions, const float *normals, const uint32_t *v,
                                         sss_dipole__condition *c)
{
    double e[3][3], corner[3], cross[3], length;
    int i, k;
    for (k = 0; k < 3; k++)
    {
        const float *const p = positions + 3 * (size_t)v[k], *const q = positions + 3 * (size_t)v[(k + 1) % 3];
        uint64_t hash;
        const int order = sss_dipole__edge_order(p, q, &hash);
        for (i = 0; i < 3; i++)
        {
            e[k][i] = (double)q[i] - (double)p[i];
        }
        length = sqrt(sss_dipole__dot(e[k], e[k]));
        c->edge_sum += length;
        c->longest_edge = sss_dipole__max(c->longest_edge, length);
        c->bins[hash % SSS_DIPOLE__BORDER_BINS] += (double)order * length;
    }
    for (i = 0; i < 3; i++)
    {
        corner[i] = (double)positions[3 * (size_t)v[0] + (size_t)i] - c->center[i];
    }
    sss_dipole__cross(e[0], e[1], cross);
    length = sqrt(sss_dipole__dot(cross, cross));
    c->area += length;
    c->volume += sss_dipole__dot(corner, cross);
    c->volume_size += sqrt(sss_dipole__dot(corner, corner)) * length;
    for (k = 0; k < 3 && normals != NULL; k++)
    {
        const float *const n = normals + 3 * (size_t)v[k];
        const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
        c->area_against += sss_dipole__dot(normal, cross) < 0.0 ? length / 3.0 : 0.0;
    }
}

// How edges pair up, without a table of edges: each counts with a sign by its direction, into the bin that its place
// decides. The two sides of an inner edge cancel; what is left in the bins is at most the length of the border, and
// nearly all of it where there are fewer border edges than bins.
//   positions  [][3];   normals  [][3] or NULL
static void sss_dipole__inspect(const float *positions, const float *normals, const uint32_t *triangles, size_t count,
                                sss_dipole__condition *c)
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
        sss_dipole__inspect_triangle(positions, normals, triangles + 3 * t, c);
    }
    for (k = 0; k < SSS_DIPOLE__BORDER_BINS; k++)
    {
        c->border += fabs(c->bins[k]) > SSS_DIPOLE__BORDER_ROUNDING * c->edge_sum ? fabs(c->bins[k]) : 0.0;
    }
}

// Into the stats.   mm  a unit of the positions
static void sss_dipole__tell_condition(const sss_dipole__condition *c, size_t count, double mm,
                                       const sss_profile *profile, sss_dipole_gather_stats *stats)
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
    stats->inside_out = c->volume < -SSS_DIPOLE__VOLUME_ROUNDING * c->volume_size;
}

static void sss_dipole__corner(const sss_mesh *mesh, size_t triangle, int corner, double out[3])
{
    const float *p = mesh->positions + 3 * (size_t)mesh->triangles[3 * triangle + (size_t)corner];
    out[0] = (double)p[0];
    out[1] = (double)p[1];
    out[2] = (double)p[2];
}

static void sss_dipole__triangle(const sss_mesh *mesh, size_t triangle, double p[3][3])
{
    int k;
    for (k = 0; k < 3; k++)
    {
        sss_dipole__corner(mesh, triangle, k, p[k]);
    }
}

// Twice the area vector of a triangle.
static void sss_dipole__area_vector(const double a[3], const double b[3], const double c[3], double out[3])
{
    const double ab[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double ac[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    sss_dipole__cross(ab, ac, out);
}

SSS_DIPOLE_API sss_result sss_dipole_vertex_normals(const sss_mesh *mesh, float *normals)
{
    sss_mesh bare; // without normals: mesh->normals may be the very array that is to be filled
    sss_result result = SSS_ERROR_INVALID_ARGUMENT;
    size_t t, v;
    int i, k;
    if (mesh != NULL)
    {
        bare = *mesh;
        bare.normals = NULL;
        result = sss_dipole__check_mesh(&bare);
    }
    if (result != SSS_OK || normals == NULL)
    {
        return result != SSS_OK ? result : SSS_ERROR_INVALID_ARGUMENT;
    }
    memset(normals, 0, 3 * mesh->vertex_count * sizeof *normals);
    for (t = 0; t < mesh->triangle_count; t++)
    {
        double p[3][3], n[3];
        sss_dipole__triangle(mesh, t, p);
        sss_dipole__area_vector(p[0], p[1], p[2], n);
        if (!sss_dipole__normalize(n))
        {
            continue;
        }
        for (k = 0; k < 3; k++)
        {
            const double *a = p[k], *b = p[(k + 1) % 3], *c = p[(k + 2) % 3];
            const double ab[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
            const double ac[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
            double cross[3], angle;
            sss_dipole__cross(ab, ac, cross);
            angle = atan2(sqrt(sss_dipole__dot(cross, cross)), sss_dipole__dot(ab, ac));
            for (i = 0; i < 3; i++)
            {
                normals[3 * (size_t)mesh->triangles[3 * t + (size_t)k] + (size_t)i] += (float)(angle * n[i]);
            }
        }
    }
    for (v = 0; v < mesh->vertex_count; v++)
    {
        double n[3] = {(double)normals[3 * v], (double)normals[3 * v + 1], (double)normals[3 * v + 2]};
        if (!sss_dipole__normalize(n))
        {
            n[0] = n[1] = 0.0;
            n[2] = 1.0;
        }
        for (i = 0; i < 3; i++)
        {
            normals[3 * v + (size_t)i] = (float)n[i];
        }
    }
    return SSS_OK;
}

static int sss_dipole__valid_light(const sss_dipole_light *light, size_t element_count)
{
    const double cone[2] = {light->cos_outer, light->cos_inner};
    const int aimed = light->kind == SSS_DIPOLE_LIGHT_DIRECTIONAL || light->kind == SSS_DIPOLE_LIGHT_SPOT;
    const int placed = light->kind == SSS_DIPOLE_LIGHT_POINT || light->kind == SSS_DIPOLE_LIGHT_SPOT;
    double direction[3];
    size_t k;
    int i, j;
    for (i = 0; i < 3; i++)
    {
        direction[i] = light->direction[i];
        if (light->kind == SSS_DIPOLE_LIGHT_ENVIRONMENT)
        {
            for (j = 0; j < 9; j++)
            {
                if (!sss_dipole__finite(light->sh[j][i]))
                {
                    return 0;
                }
            }
        }
        else if (!sss_dipole__in_range(light->color[i], 0.0, 1e30))
        {
            return 0;
        }
        if (placed && !sss_dipole__in_range(fabs(light->position[i]), 0.0, 1e100))
        {
            return 0;
        }
    }
    if ((int)light->kind < SSS_DIPOLE_LIGHT_DIRECTIONAL || light->kind > SSS_DIPOLE_LIGHT_ENVIRONMENT
        || (aimed && !sss_dipole__normalize(direction)))
    {
        return 0;
    }
    if (light->kind == SSS_DIPOLE_LIGHT_SPOT && !(-1.0 <= cone[0] && cone[0] <= cone[1] && cone[1] <= 1.0))
    {
        return 0;
    }
    for (k = 0; light->visibility != NULL && k < element_count; k++)
    {
        if (!sss_dipole__in_range((double)light->visibility[k], 0.0, 1.0))
        {
            return 0;
        }
    }
    return 1;
}

// The lobes 2 pi int_0^1 P_l(mu) F_t(mu) mu dmu, l = 0, 1, 2, that turn radiance coefficients into irradiance:
// pi, 2 pi/3, pi/4 without Fresnel (Ramamoorthi and Hanrahan 2001). The rule is tanh-sinh, because F_t has a
// root at grazing incidence or at the critical angle.
static void sss_dipole__cosine_lobes(double eta, int no_fresnel, double lobes[3])
{
    const double low = !no_fresnel && eta < 1.0 ? sqrt((1.0 - eta) * (1.0 + eta)) : 0.0; // critical angle
    const double step = 0.0625;
    int i;
    lobes[0] = lobes[1] = lobes[2] = 0.0;
    for (i = -56; i <= 56; i++) // +-3.5: the weights have fallen to 1e-22
    {
        const double t = step * (double)i, s = 0.5 * SSS_DIPOLE__PI * sinh(t);
        const double mu = low + (1.0 - low) * 0.5 * (1.0 + tanh(s));
        const double weight = step * 0.25 * SSS_DIPOLE__PI * cosh(t) / (cosh(s) * cosh(s)) * (1.0 - low);
        const double F_t = no_fresnel ? 1.0 : 1.0 - sss_dipole_fresnel(mu > 1.0 ? 1.0 : mu, eta);
        const double f = 2.0 * SSS_DIPOLE__PI * weight * F_t * mu;
        lobes[0] += f;
        lobes[1] += f * mu;
        lobes[2] += f * 0.5 * (3.0 * mu * mu - 1.0);
    }
}

// Real orthonormal spherical harmonics up to band 2, without Condon-Shortley sign.
static void sss_dipole__sh(const double n[3], double Y[9])
{
    const double x = n[0], y = n[1], z = n[2];
    const double c1 = 0.48860251190291992, c2 = 1.0925484305920792, c3 = 0.31539156525252005; // sqrt(3/4pi),
    Y[0] = 0.28209479177387814;                                                                // sqrt(15/4pi),
    Y[1] = c1 * y;                                                                             // sqrt(5/16pi)
    Y[2] = c1 * z;
    Y[3] = c1 * x;
    Y[4] = c2 * x * y;
    Y[5] = c2 * y * z;
    Y[6] = c3 * (3.0 * z * z - 1.0);
    Y[7] = c2 * x * z;
    Y[8] = 0.5 * c2 * (x * x - y * y);
}

// The irradiance per unit colour of a directional, point or spot light at x (mesh units) with unit normal n:
// geometry, falloff in mm and the entering Fresnel transmittance.
static double sss_dipole__light_factor(const sss_dipole_light *light, const sss_dipole_irradiance_options *options,
                                       double mm_per_unit, const double x[3], const double n[3])
{
    double w[3], falloff = 1.0, cosine;
    int i;
    for (i = 0; i < 3; i++)
    {
        w[i] = light->kind == SSS_DIPOLE_LIGHT_DIRECTIONAL ? light->direction[i]
                                                           : (light->position[i] - x[i]) * mm_per_unit;
    }
    if (light->kind != SSS_DIPOLE_LIGHT_DIRECTIONAL)
    {
        falloff = 1.0 / sss_dipole__dot(w, w); // 1/mm^2
        if (!sss_dipole__finite(falloff))
        {
            return 0.0; // on the surface itself
        }
    }
    if (!sss_dipole__normalize(w))
    {
        return 0.0;
    }
    if (light->kind == SSS_DIPOLE_LIGHT_SPOT)
    {
        double axis[3] = {light->direction[0], light->direction[1], light->direction[2]}, t;
        sss_dipole__normalize(axis);
        t = -sss_dipole__dot(axis, w);
        t = light->cos_inner > light->cos_outer ? (t - light->cos_outer) / (light->cos_inner - light->cos_outer)
                                                : (t >= light->cos_inner ? 1.0 : 0.0);
        t = sss_dipole__min(1.0, sss_dipole__max(0.0, t));
        falloff *= t * t * (3.0 - 2.0 * t);
    }
    cosine = sss_dipole__min(1.0, sss_dipole__dot(n, w));
    if (cosine <= 0.0)
    {
        return 0.0;
    }
    return falloff * cosine * (options->no_fresnel ? 1.0 : 1.0 - sss_dipole_fresnel(cosine, options->eta));
}

// The irradiance E of all lights at one element: position x, unit normal n, the environment's lobes by band.
static void sss_dipole__light_element(const sss_dipole_light *lights, size_t light_count,
                                      const sss_dipole_irradiance_options *options, double mm_per_unit,
                                      const double x[3], const double n[3], const double lobes[3], size_t element,
                                      double E[3])
{
    static const int band[9] = {0, 1, 1, 1, 2, 2, 2, 2, 2};
    size_t l;
    int i, j;
    E[0] = E[1] = E[2] = 0.0;
    for (l = 0; l < light_count; l++)
    {
        const double visibility = lights[l].visibility != NULL ? (double)lights[l].visibility[element] : 1.0;
        if (lights[l].kind == SSS_DIPOLE_LIGHT_ENVIRONMENT)
        {
            double Y[9];
            sss_dipole__sh(n, Y);
            for (i = 0; i < 3; i++)
            {
                double sum = 0.0;
                for (j = 0; j < 9; j++)
                {
                    sum += lobes[band[j]] * lights[l].sh[j][i] * Y[j];
                }
                E[i] += visibility * sss_dipole__max(0.0, sum);
            }
        }
        else
        {
            const double factor = sss_dipole__light_factor(&lights[l], options, mm_per_unit, x, n);
            for (i = 0; i < 3; i++)
            {
                E[i] += visibility * factor * lights[l].color[i];
            }
        }
    }
}

SSS_DIPOLE_API sss_result sss_dipole_irradiance(const sss_mesh *mesh, const sss_dipole_light *lights,
                                                size_t light_count, const sss_dipole_irradiance_options *options,
                                                float *irradiance)
{
    const sss_result result = sss_dipole__check_mesh(mesh);
    size_t element_count, k;
    double lobes[3];
    int i;
    if (result != SSS_OK)
    {
        return result;
    }
    if (options == NULL || irradiance == NULL || (lights == NULL && light_count > 0)
        || !sss_dipole__valid_eta(options->eta)
        || (options->elements != SSS_DIPOLE_VERTICES && options->elements != SSS_DIPOLE_TRIANGLES)
        || (options->elements == SSS_DIPOLE_VERTICES && mesh->normals == NULL))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    element_count = options->elements == SSS_DIPOLE_VERTICES ? mesh->vertex_count : mesh->triangle_count;
    for (k = 0; k < light_count; k++)
    {
        if (!sss_dipole__valid_light(&lights[k], element_count))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
    }
    sss_dipole__cosine_lobes(options->eta, options->no_fresnel, lobes);
    for (k = 0; k < element_count; k++)
    {
        double x[3], n[3], E[3];
        if (options->elements == SSS_DIPOLE_VERTICES)
        {
            for (i = 0; i < 3; i++)
            {
                x[i] = (double)mesh->positions[3 * k + (size_t)i];
                n[i] = (double)mesh->normals[3 * k + (size_t)i];
            }
        }
        else
        {
            double p[3][3];
            sss_dipole__triangle(mesh, k, p);
            sss_dipole__area_vector(p[0], p[1], p[2], n);
            for (i = 0; i < 3; i++)
            {
                x[i] = (p[0][i] + p[1][i] + p[2][i]) / 3.0;
            }
        }
        E[0] = E[1] = E[2] = 0.0;
        if (sss_dipole__normalize(n)) // a degenerate triangle or a zero normal faces no light
        {
            sss_dipole__light_element(lights, light_count, options, mesh->mm_per_unit, x, n, lobes, k, E);
        }
        for (i = 0; i < 3; i++)
        {
            const double before = options->accumulate ? (double)irradiance[3 * k + (size_t)i] : 0.0;
            irradiance[3 * k + (size_t)i] = (float)sss_dipole__min(1e30, before + E[i]);
        }
    }
    return SSS_OK;
}

// ---- 5. Direct gather ----
//
// Lengths are divided by the emitters' bounding diagonal and irradiance by its largest value, so that float
// holds at any scale. Triangles are sorted along a Morton curve into blocks of 16 (one wide register) and
// groups of 64 blocks. For each receiver and block the distance decides between
//   one point a triangle, at the centroid of the light on it        (far),
//   three points, the rule of degree 2                              (middle),
//   recursive bisection down to pieces that seven points integrate, degree 5        (near),
// with the distances at which each is good enough computed from the profile and the tolerance.

#define SSS_DIPOLE__BLOCK 16u     // triangles
#define SSS_DIPOLE__GROUP 64u     // blocks
#define SSS_DIPOLE__TILE 16u      // receivers that share a pass over the emitters
#define SSS_DIPOLE__BUFFER 512u   // near points collected before they are evaluated
#define SSS_DIPOLE__SIZES 256     // triangle sizes for which distances are tabulated, 4 an octave, up to 4
#define SSS_DIPOLE__BUDGET 1.5    // times the tolerance: what the error bounds of far and of near triangles may reach
#define SSS_DIPOLE__LEFT 0.25     // the part of those bounds that is predicted: the rest cancels between triangles,
                                  // on every mesh measured so far (tests/test_dipole.c: the_tolerance_is_kept)
#define SSS_DIPOLE__REACH 3.0     // receivers farther from the centre (in diagonals) take the scalar path
#define SSS_DIPOLE__CLOSE 0.125   // sources closer to an emitter than this part of their z take the scalar path

// The profile in units of the emitters' diagonal, and its tables.
typedef struct sss_dipole__model
{
    sss_dipole_geometry geometry;
    double a[3];             // alpha'/(4 pi); 0 for a channel without scattering
    double sigma[3];         // sigma_tr
    double z[2][3];          // z_r, z_v
    double z_min, z_max;     // over the channels that scatter
    float c;                 // tables are indexed by x = r^2 + c (distance) or x = s^2 (placed)
    float x_low;             // smallest x tabulated
    uint32_t bin_bits;       // 2^bin_bits bins an octave: so many leading bits of the mantissa are the index
    uint32_t base;           // index of x_low
    size_t size;             // intervals in a table; 0 on the scalar path
    double gain[3];          // table values are R_d / gain
    const float *table[6];   // distance: R_d per channel; placed: real source per channel, virtual per channel
} sss_dipole__model;

typedef struct sss_dipole__block
{
    float center[3], radius; // bounding sphere of the triangles
    float edge;              // longest edge of a triangle
    float far_distance;      // beyond this, one point a triangle
    float middle_distance;   // beyond this, three points
    int lit, partly_dark;    // any irradiance in it; of a group: a block of it has none
} sss_dipole__block;

// Sample points: x, y, z and weights E A for r, g, b, each in its own array.
typedef struct sss_dipole__samples
{
    float *p[6];
} sss_dipole__samples;

typedef struct sss_dipole__near
{
    double far_distance[SSS_DIPOLE__SIZES], middle_distance[SSS_DIPOLE__SIZES];
    double piece_distance[SSS_DIPOLE__SIZES];
    double one_ratio, three_ratio, seven_ratio; // distance over edge that each rule needs before an intruding source
} sss_dipole__near;

// Adds the samples [begin, end), a multiple of 16, to sum: position and normal of the receiver in `receiver`.
typedef void (*sss_dipole__kernel)(const sss_dipole__model *model, const sss_dipole__samples *samples, size_t begin,
                                   size_t end, const double receiver[6], double sum[3]);

struct sss_dipole_gather
{
    sss_hooks hooks;
    sss_dipole_gather_stats stats;
    double center[3];            // mesh units
    double unit_per_diagonal;    // mesh units in one diagonal
    sss_dipole__model model;
    sss_dipole__kernel kernel;
    sss_dipole__near near_table;
    size_t vertex_count, triangle_count; // of the mesh; triangle_count = 0 for points
    size_t block_count, group_count;
    double irradiance_scale;     // W/mm^2: the largest irradiance
    double area_scale;           // square diagonals: the largest area
    sss_dipole__block *blocks;   // [block_count]
    sss_dipole__block *groups;   // [group_count]
    sss_dipole__samples one;     // [16 block_count] each
    sss_dipole__samples three;   // [48 block_count] each
    float *corners;              // [16 block_count][3][3], mesh units: the receiver must cancel exactly
    float *corner_E;             // [16 block_count][3][3], of irradiance_scale
    float *area;                 // [16 block_count], of area_scale; 0 in the padding
    uint32_t *vertex;            // [16 block_count][3]
    uint32_t *element;           // [16 block_count] triangle or point
    float *tables;
};

// ---- 5.1 Kernels: the sum over samples. The scalar one reads like the paper; the others agree with it. ----

static void sss_dipole__kernel_scalar(const sss_dipole__model *m, const sss_dipole__samples *samples, size_t begin,
                                      size_t end, const double receiver[6], double sum[3])
{
    const float *const *p = (const float *const *)samples->p;
    size_t k;
    int i;
    for (k = begin; k < end; k++)
    {
        const double v[3] = {(double)p[0][k] - receiver[0], (double)p[1][k] - receiver[1],
                             (double)p[2][k] - receiver[2]};
        const double r2 = sss_dipole__dot(v, v);
        const double height = m->geometry == SSS_DIPOLE_PLACED ? sss_dipole__dot(v, receiver + 3) : 0.0;
        const double t2 = sss_dipole__max(0.0, r2 - height * height); // the height is 0 for distance only
        for (i = 0; i < 3; i++)
        {
            const double h_r = height + m->z[0][i], h_v = height - m->z[1][i];
            const double d_r = sqrt(t2 + h_r * h_r), d_v = sqrt(t2 + h_v * h_v);
            const double E_A = (double)p[3 + i][k];
            if (m->a[i] > 0.0 && E_A != 0.0)
            {
                sum[i] += E_A * m->a[i]
                          * (m->z[0][i] * (m->sigma[i] * d_r + 1.0) / (d_r * d_r * d_r) * exp(-m->sigma[i] * d_r)
                             + m->z[1][i] * (m->sigma[i] * d_v + 1.0) / (d_v * d_v * d_v) * exp(-m->sigma[i] * d_v));
            }
        }
    }
}

// Linear interpolation in a table whose bins split each octave of x evenly: exponent and leading mantissa bits
// are the index, the remaining bits the fraction.
static float sss_dipole__lookup(const sss_dipole__model *m, const float *table, float x)
{
    const uint32_t bits = sss_dipole__bits_of_float(x > m->x_low ? x : m->x_low);
    const float fraction = sss_dipole__float_of_bits(((bits << m->bin_bits) & 0x7fffffu) | 0x3f800000u) - 1.0f;
    const float *entry = table + ((bits >> (23u - m->bin_bits)) - m->base);
    return entry[0] + fraction * (entry[1] - entry[0]);
}

static void sss_dipole__kernel_table(const sss_dipole__model *m, const sss_dipole__samples *samples, size_t begin,
                                     size_t end, const double receiver[6], double sum[3])
{
    const float *const *p = (const float *const *)samples->p;
    const float x = (float)receiver[0], y = (float)receiver[1], z = (float)receiver[2];
    const float nx = (float)receiver[3], ny = (float)receiver[4], nz = (float)receiver[5];
    float part[3] = {0.0f, 0.0f, 0.0f};
    size_t k;
    int i;
    for (k = begin; k < end; k++)
    {
        const float dx = p[0][k] - x, dy = p[1][k] - y, dz = p[2][k] - z;
        const float r2 = dx * dx + dy * dy + dz * dz;
        if (m->geometry == SSS_DIPOLE_DISTANCE)
        {
            for (i = 0; i < 3; i++)
            {
                part[i] += p[3 + i][k] * sss_dipole__lookup(m, m->table[i], r2 + m->c);
            }
        }
        else
        {
            const float height = dx * nx + dy * ny + dz * nz;
            const float rest = r2 - height * height, t2 = rest > 0.0f ? rest : 0.0f;
            for (i = 0; i < 3; i++)
            {
                const float h_r = height + (float)m->z[0][i], h_v = height - (float)m->z[1][i];
                part[i] += p[3 + i][k] * (sss_dipole__lookup(m, m->table[i], t2 + h_r * h_r)
                                          + sss_dipole__lookup(m, m->table[3 + i], t2 + h_v * h_v));
            }
        }
    }
    for (i = 0; i < 3; i++)
    {
        sum[i] += (double)part[i] * m->gain[i];
    }
}

// The gcc of mingw does not align the stack for wide registers (its bug 54412).
#if !defined(SSS_DIPOLE_NO_SIMD) && defined(__GNUC__) && (defined(__x86_64__) || defined(__i386__)) \
    && !(defined(__MINGW32__) && !defined(__clang__))
#define SSS_DIPOLE__X86

#include <immintrin.h>

#define SSS_DIPOLE__AVX2 __attribute__((target("avx2,fma")))
#define SSS_DIPOLE__AVX512 __attribute__((target("avx512f,avx512dq,avx512vl,avx512bw")))

// Where in the tables a register of x lies; shared by the channels.
typedef struct sss_dipole__place8
{
    __m256i index;
    __m256 fraction;
} sss_dipole__place8;

SSS_DIPOLE__AVX2 static inline sss_dipole__place8 sss_dipole__place_avx2(const sss_dipole__model *m, __m256 x)
{
    sss_dipole__place8 place;
    const __m256i bits = _mm256_castps_si256(_mm256_max_ps(x, _mm256_set1_ps(m->x_low)));
    const __m128i left = _mm_cvtsi32_si128((int)m->bin_bits), right = _mm_cvtsi32_si128(23 - (int)m->bin_bits);
    const __m256i mantissa = _mm256_and_si256(_mm256_sll_epi32(bits, left), _mm256_set1_epi32(0x7fffff));
    place.index = _mm256_sub_epi32(_mm256_srl_epi32(bits, right), _mm256_set1_epi32((int)m->base));
    place.fraction = _mm256_sub_ps(_mm256_castsi256_ps(_mm256_or_si256(mantissa, _mm256_set1_epi32(0x3f800000))),
                                   _mm256_set1_ps(1.0f));
    return place;
}

SSS_DIPOLE__AVX2 static inline __m256 sss_dipole__lookup_avx2(const float *table, sss_dipole__place8 place)
{
    const __m256 low = _mm256_i32gather_ps(table, place.index, 4);
    const __m256 high = _mm256_i32gather_ps(table + 1, place.index, 4);
    return _mm256_fmadd_ps(place.fraction, _mm256_sub_ps(high, low), low);
}

// Both sources of channel i, placed: `height` over the receiver's tangent plane, t2 = squared distance along it.
SSS_DIPOLE__AVX2 static inline __m256 sss_dipole__placed_avx2(const sss_dipole__model *m, int i, __m256 height,
                                                              __m256 t2)
{
    const __m256 h_r = _mm256_add_ps(height, _mm256_set1_ps((float)m->z[0][i]));
    const __m256 h_v = _mm256_sub_ps(height, _mm256_set1_ps((float)m->z[1][i]));
    return _mm256_add_ps(
        sss_dipole__lookup_avx2(m->table[i], sss_dipole__place_avx2(m, _mm256_fmadd_ps(h_r, h_r, t2))),
        sss_dipole__lookup_avx2(m->table[3 + i], sss_dipole__place_avx2(m, _mm256_fmadd_ps(h_v, h_v, t2))));
}

SSS_DIPOLE__AVX2 static inline double sss_dipole__sum_avx2(__m256 v)
{
    const __m128 four = _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
    const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return (double)_mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps(two, two, 1)));
}

SSS_DIPOLE__AVX2 static void sss_dipole__kernel_avx2(const sss_dipole__model *m, const sss_dipole__samples *samples,
                                                     size_t begin, size_t end, const double receiver[6],
                                                     double sum[3])
{
    float *const *p = samples->p;
    const __m256 x = _mm256_set1_ps((float)receiver[0]), y = _mm256_set1_ps((float)receiver[1]);
    const __m256 z = _mm256_set1_ps((float)receiver[2]), c = _mm256_set1_ps(m->c);
    const __m256 nx = _mm256_set1_ps((float)receiver[3]), ny = _mm256_set1_ps((float)receiver[4]);
    const __m256 nz = _mm256_set1_ps((float)receiver[5]);
    __m256 red = _mm256_setzero_ps(), green = red, blue = red; // written out: registers, not an array in memory
    size_t k;
    for (k = begin; k < end; k += 8)
    {
        const __m256 dx = _mm256_sub_ps(_mm256_loadu_ps(p[0] + k), x);
        const __m256 dy = _mm256_sub_ps(_mm256_loadu_ps(p[1] + k), y);
        const __m256 dz = _mm256_sub_ps(_mm256_loadu_ps(p[2] + k), z);
        const __m256 r2 = _mm256_fmadd_ps(dx, dx, _mm256_fmadd_ps(dy, dy, _mm256_mul_ps(dz, dz)));
        __m256 R_d[3];
        if (m->geometry == SSS_DIPOLE_DISTANCE)
        {
            const sss_dipole__place8 place = sss_dipole__place_avx2(m, _mm256_add_ps(r2, c));
            R_d[0] = sss_dipole__lookup_avx2(m->table[0], place);
            R_d[1] = sss_dipole__lookup_avx2(m->table[1], place);
            R_d[2] = sss_dipole__lookup_avx2(m->table[2], place);
        }
        else
        {
            const __m256 height = _mm256_fmadd_ps(dx, nx, _mm256_fmadd_ps(dy, ny, _mm256_mul_ps(dz, nz)));
            const __m256 t2 = _mm256_max_ps(_mm256_fnmadd_ps(height, height, r2), _mm256_setzero_ps());
            R_d[0] = sss_dipole__placed_avx2(m, 0, height, t2);
            R_d[1] = sss_dipole__placed_avx2(m, 1, height, t2);
            R_d[2] = sss_dipole__placed_avx2(m, 2, height, t2);
        }
        red = _mm256_fmadd_ps(_mm256_loadu_ps(p[3] + k), R_d[0], red);
        green = _mm256_fmadd_ps(_mm256_loadu_ps(p[4] + k), R_d[1], green);
        blue = _mm256_fmadd_ps(_mm256_loadu_ps(p[5] + k), R_d[2], blue);
    }
    sum[0] += sss_dipole__sum_avx2(red) * m->gain[0];
    sum[1] += sss_dipole__sum_avx2(green) * m->gain[1];
    sum[2] += sss_dipole__sum_avx2(blue) * m->gain[2];
}

// gcc's gathers are macros without optimisation, and warn of themselves: such builds do without this path.
#if defined(__OPTIMIZE__) || defined(__clang__)
#define SSS_DIPOLE__X86_512

typedef struct sss_dipole__place16
{
    __m256i index[2];
    __m512 fraction;
} sss_dipole__place16;

#define SSS_DIPOLE__ALL16 ((__mmask16)0xffff) // masked forms: gcc 12 warns of its own unmasked ones
#define SSS_DIPOLE__ALL8 ((__mmask8)0xff)

SSS_DIPOLE__AVX512 static inline sss_dipole__place16 sss_dipole__place_avx512(const sss_dipole__model *m, __m512 x)
{
    sss_dipole__place16 place;
    const __m512i bits = _mm512_castps_si512(
        _mm512_maskz_max_ps(SSS_DIPOLE__ALL16, x, _mm512_set1_ps(m->x_low)));
    const __m128i left = _mm_cvtsi32_si128((int)m->bin_bits), right = _mm_cvtsi32_si128(23 - (int)m->bin_bits);
    const __m512i mantissa = _mm512_and_si512(_mm512_maskz_sll_epi32(SSS_DIPOLE__ALL16, bits, left),
                                              _mm512_set1_epi32(0x7fffff));
    const __m512i index = _mm512_sub_epi32(_mm512_maskz_srl_epi32(SSS_DIPOLE__ALL16, bits, right),
                                           _mm512_set1_epi32((int)m->base));
    place.index[0] = _mm512_maskz_extracti64x4_epi64(SSS_DIPOLE__ALL8, index, 0);
    place.index[1] = _mm512_maskz_extracti64x4_epi64(SSS_DIPOLE__ALL8, index, 1);
    place.fraction = _mm512_sub_ps(_mm512_castsi512_ps(_mm512_or_si512(mantissa, _mm512_set1_epi32(0x3f800000))),
                                   _mm512_set1_ps(1.0f));
    return place;
}

// Both ends of a bin come in one 64-bit element: half as many loads as two gathers of floats.
SSS_DIPOLE__AVX512 static inline __m512 sss_dipole__lookup_avx512(const float *table, sss_dipole__place16 place)
{
    const __m512i even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    const __m512i odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
    const __m512d none = _mm512_setzero_pd();
    const void *entries = table;
    const __m512 a = _mm512_castpd_ps(_mm512_mask_i32gather_pd(none, SSS_DIPOLE__ALL8, place.index[0], entries, 4));
    const __m512 b = _mm512_castpd_ps(_mm512_mask_i32gather_pd(none, SSS_DIPOLE__ALL8, place.index[1], entries, 4));
    const __m512 low = _mm512_permutex2var_ps(a, even, b), high = _mm512_permutex2var_ps(a, odd, b);
    return _mm512_fmadd_ps(place.fraction, _mm512_sub_ps(high, low), low);
}

// Both sources of channel i, as sss_dipole__placed_avx2.
SSS_DIPOLE__AVX512 static inline __m512 sss_dipole__placed_avx512(const sss_dipole__model *m, int i, __m512 height,
                                                                  __m512 t2)
{
    const __m512 h_r = _mm512_add_ps(height, _mm512_set1_ps((float)m->z[0][i]));
    const __m512 h_v = _mm512_sub_ps(height, _mm512_set1_ps((float)m->z[1][i]));
    return _mm512_add_ps(
        sss_dipole__lookup_avx512(m->table[i], sss_dipole__place_avx512(m, _mm512_fmadd_ps(h_r, h_r, t2))),
        sss_dipole__lookup_avx512(m->table[3 + i], sss_dipole__place_avx512(m, _mm512_fmadd_ps(h_v, h_v, t2))));
}

SSS_DIPOLE__AVX512 static inline double sss_dipole__sum_avx512(__m512 v)
{
    const __m256 eight = _mm256_add_ps(_mm512_maskz_extractf32x8_ps(SSS_DIPOLE__ALL8, v, 0),
                                       _mm512_maskz_extractf32x8_ps(SSS_DIPOLE__ALL8, v, 1));
    const __m128 four = _mm_add_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return (double)_mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps(two, two, 1)));
}

SSS_DIPOLE__AVX512 static void sss_dipole__kernel_avx512(const sss_dipole__model *m,
                                                         const sss_dipole__samples *samples, size_t begin, size_t end,
                                                         const double receiver[6], double sum[3])
{
    float *const *p = samples->p;
    const __m512 x = _mm512_set1_ps((float)receiver[0]), y = _mm512_set1_ps((float)receiver[1]);
    const __m512 z = _mm512_set1_ps((float)receiver[2]), c = _mm512_set1_ps(m->c);
    const __m512 nx = _mm512_set1_ps((float)receiver[3]), ny = _mm512_set1_ps((float)receiver[4]);
    const __m512 nz = _mm512_set1_ps((float)receiver[5]);
    __m512 red = _mm512_setzero_ps(), green = red, blue = red; // written out: registers, not an array in memory
    size_t k;
    for (k = begin; k < end; k += 16)
    {
        const __m512 dx = _mm512_sub_ps(_mm512_loadu_ps(p[0] + k), x);
        const __m512 dy = _mm512_sub_ps(_mm512_loadu_ps(p[1] + k), y);
        const __m512 dz = _mm512_sub_ps(_mm512_loadu_ps(p[2] + k), z);
        const __m512 r2 = _mm512_fmadd_ps(dx, dx, _mm512_fmadd_ps(dy, dy, _mm512_mul_ps(dz, dz)));
        __m512 R_d[3];
        if (m->geometry == SSS_DIPOLE_DISTANCE)
        {
            const sss_dipole__place16 place = sss_dipole__place_avx512(m, _mm512_add_ps(r2, c));
            R_d[0] = sss_dipole__lookup_avx512(m->table[0], place);
            R_d[1] = sss_dipole__lookup_avx512(m->table[1], place);
            R_d[2] = sss_dipole__lookup_avx512(m->table[2], place);
        }
        else
        {
            const __m512 height = _mm512_fmadd_ps(dx, nx, _mm512_fmadd_ps(dy, ny, _mm512_mul_ps(dz, nz)));
            const __m512 t2 = _mm512_maskz_max_ps(SSS_DIPOLE__ALL16, _mm512_fnmadd_ps(height, height, r2),
                                                  _mm512_setzero_ps());
            R_d[0] = sss_dipole__placed_avx512(m, 0, height, t2);
            R_d[1] = sss_dipole__placed_avx512(m, 1, height, t2);
            R_d[2] = sss_dipole__placed_avx512(m, 2, height, t2);
        }
        red = _mm512_fmadd_ps(_mm512_loadu_ps(p[3] + k), R_d[0], red);
        green = _mm512_fmadd_ps(_mm512_loadu_ps(p[4] + k), R_d[1], green);
        blue = _mm512_fmadd_ps(_mm512_loadu_ps(p[5] + k), R_d[2], blue);
    }
    sum[0] += sss_dipole__sum_avx512(red) * m->gain[0];
    sum[1] += sss_dipole__sum_avx512(green) * m->gain[1];
    sum[2] += sss_dipole__sum_avx512(blue) * m->gain[2];
}
#endif // SSS_DIPOLE__X86_512
#endif // SSS_DIPOLE__X86

// The kernel of a path, or NULL where the processor lacks it.
static sss_dipole__kernel sss_dipole__find_kernel(sss_dipole_path path)
{
    switch (path)
    {
    case SSS_DIPOLE_PATH_SCALAR: return sss_dipole__kernel_scalar;
    case SSS_DIPOLE_PATH_TABLE:  return sss_dipole__kernel_table;
#ifdef SSS_DIPOLE__X86
    case SSS_DIPOLE_PATH_AVX2:
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? sss_dipole__kernel_avx2 : NULL;
#endif
#ifdef SSS_DIPOLE__X86_512
    case SSS_DIPOLE_PATH_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")
                       && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw")
                   ? sss_dipole__kernel_avx512
                   : NULL;
#endif
    default: break; // automatic, or not compiled in
    }
    return NULL;
}

static sss_dipole_path sss_dipole__fastest_path(void)
{
    if (sss_dipole__find_kernel(SSS_DIPOLE_PATH_AVX512) != NULL)
    {
        return SSS_DIPOLE_PATH_AVX512;
    }
    return sss_dipole__find_kernel(SSS_DIPOLE_PATH_AVX2) != NULL ? SSS_DIPOLE_PATH_AVX2 : SSS_DIPOLE_PATH_TABLE;
}

// ---- 5.2 Model: the profile in diagonals, its tables, and what distances need which rule ----

// Fills in the profile for lengths in diagonals. A mean free path below 1e-15 of the diagonal is raised to it,
// sigma_tr z and the total kept: R_d then still is a delta function to any tolerance, and float can hold it. One
// above 1e15 is lowered to that, R_d(0) kept: R_d then still is constant over the object. Samples that are never
// integrated (`samples`) keep R_d(0) in both cases, for a receiver at one of them.
static void sss_dipole__make_model(const sss_profile *profile, sss_dipole_geometry geometry, double diagonal_mm,
                                   int samples, sss_dipole__model *m)
{
    int i;
    memset(m, 0, sizeof *m);
    m->geometry = geometry;
    m->z_min = HUGE_VAL;
    for (i = 0; i < 3; i++)
    {
        const double z_r = profile->z_r[i] / diagonal_mm;
        const double z_used = sss_dipole__min(1e15, sss_dipole__max(1e-15, z_r));
        m->a[i] = profile->alpha_p[i] / (4.0 * SSS_DIPOLE__PI);
        m->gain[i] = 1.0;
        if (m->a[i] > 0.0)
        {
            m->a[i] *= samples || z_r > z_used ? z_used / z_r * (z_used / z_r) : 1.0;
            m->z[0][i] = z_used;
            m->z[1][i] = z_used * (profile->z_v[i] / profile->z_r[i]);
            m->sigma[i] = profile->sigma_tr[i] * profile->z_r[i] / z_used;
            m->z_min = sss_dipole__min(m->z_min, m->z[0][i]);
            m->z_max = sss_dipole__max(m->z_max, m->z[1][i]);
        }
    }
    if (m->z_max == 0.0)
    {
        m->z_min = m->z_max = 1.0; // nothing scatters
    }
    for (i = 0; i < 3; i++)
    {
        if (m->a[i] == 0.0)
        {
            m->z[0][i] = m->z[1][i] = m->z_min; // any that the tables hold: its weight is 0
        }
    }
}

// The smallest s^2 at which table k is looked up: nearer samples take the scalar path.
static double sss_dipole__closest2(const sss_dipole__model *m, int k)
{
    const double s = m->geometry == SSS_DIPOLE_PLACED ? SSS_DIPOLE__CLOSE * m->z[k / 3][k % 3] : m->z_min;
    return s * s;
}

// The tabulated function k at x: R_d at r^2 = x - c, or one source at s^2 = x; per gain.
static double sss_dipole__tabulated(const sss_dipole__model *m, int k, double x)
{
    const int i = k % 3;
    double value = 0.0;
    int source;
    for (source = 0; source < 2; source++)
    {
        const double z = m->z[source][i], flat = 0.5 * sss_dipole__closest2(m, 3 * source + i);
        const double d = m->geometry == SSS_DIPOLE_DISTANCE
                             ? sqrt(x + (z - m->z_min) * (z + m->z_min)) // also where a bin begins below r = 0
                             : sqrt(sss_dipole__max(x, flat)); // not looked up there: keeps the range small
        if (m->geometry == SSS_DIPOLE_DISTANCE || source == k / 3)
        {
            value += sss_dipole__source(m->sigma[i], z, d);
        }
    }
    return m->a[i] * value / m->gain[i];
}

static double sss_dipole__x_at(const sss_dipole__model *m, size_t entry)
{
    return (double)sss_dipole__float_of_bits((m->base + (uint32_t)entry) << (23u - m->bin_bits));
}

// Range and size of the tables; returns the number of tables. 64 bins an octave interpolate to 6e-5, and every
// doubling to a quarter of that.
static int sss_dipole__plan_tables(sss_dipole__model *m, double tolerance)
{
    float high;
    const int placed = m->geometry == SSS_DIPOLE_PLACED;
    const double reach = SSS_DIPOLE__REACH + 1.0 + (placed ? m->z_max : 0.0);
    const double nearest = placed ? SSS_DIPOLE__CLOSE * m->z_min : m->z_min;
    m->bin_bits = tolerance >= 2e-4 ? 6 : tolerance >= 5e-5 ? 7 : 8;
    m->x_low = (float)(nearest * nearest);
    m->c = placed ? 0.0f : (float)(m->z_min * m->z_min);
    m->base = sss_dipole__bits_of_float(m->x_low) >> (23u - m->bin_bits);
    high = (float)(reach * reach + nearest * nearest);
    m->size = (sss_dipole__bits_of_float(high) >> (23u - m->bin_bits)) - m->base + 2;
    return placed ? 6 : 3;
}

// Fills table k [size + 1] and returns its error: the largest relative error of the interpolant, weighed by the share
// of the light that travels as far. Linear interpolation of a convex function lies above it: nodes are lowered by half
// the error at midpoints. What has fallen below 1e-25 of the largest value is 0, so that no product is subnormal.
static double sss_dipole__fill_table(const sss_dipole__model *m, int k, float *table)
{
    const double first = sss_dipole__closest2(m, k);
    double worst = 0.0, before = 0.0, value = sss_dipole__tabulated(m, k, sss_dipole__x_at(m, 0));
    size_t j;
    for (j = 0; j <= m->size; j++)
    {
        const double x = sss_dipole__x_at(m, j), x_next = sss_dipole__x_at(m, j + 1);
        const double next = sss_dipole__tabulated(m, k, x_next);
        const double middle = sss_dipole__tabulated(m, k, 0.5 * (x + x_next));
        const double excess = 0.5 * (value + next) - middle;
        const double node = value - 0.25 * (before + excess);
        const double share = sqrt(first / x) * exp(-m->sigma[k % 3] * (sqrt(x) - sqrt(first))); // z/d exp(-sigma (d-z))
        if (x_next > first && middle > 0.0)
        {
            worst = sss_dipole__max(worst, 0.5 * fabs(excess) / middle * sss_dipole__min(1.0, share));
        }
        table[j] = node > 1e-25 ? (float)node : 0.0f;
        before = excess;
        value = next;
    }
    return worst;
}

// Builds all tables and returns the largest error, float rounding included.
static double sss_dipole__fill_tables(sss_dipole__model *m, int count, float *storage)
{
    double error = 0.0;
    int i, k;
    for (i = 0; i < 3; i++)
    {
        const double x = sss_dipole__x_at(m, 0);
        double largest = sss_dipole__tabulated(m, i, x);
        if (m->geometry == SSS_DIPOLE_PLACED)
        {
            largest = sss_dipole__max(largest, sss_dipole__tabulated(m, 3 + i, x));
        }
        m->gain[i] = largest > 0.0 ? largest : 1.0;
    }
    for (k = 0; k < count; k++)
    {
        float *table = storage + (size_t)k * (m->size + 1);
        m->table[k] = table;
        error = sss_dipole__max(error, sss_dipole__fill_table(m, k, table));
    }
    return error + 6e-6; // float: positions, additions in a lane
}

// The relative error of B if every triangle of edge h beyond distance r is one point. The rule's error at one
// triangle is (h^2/48) laplace R_d A, h^2/24 being the variance of an equilateral triangle along an axis; over
// the plane beyond r that integrates, by Gauss's theorem, to (h^2/48) 2 pi r |R_d'(r)|.
static double sss_dipole__one_point_error(const sss_dipole__model *m, double h, double r)
{
    double worst = 0.0;
    int i, source;
    for (i = 0; i < 3; i++)
    {
        double slope = 0.0, total = 0.0;
        for (source = 0; m->a[i] > 0.0 && source < 2; source++)
        {
            const double z = m->z[source][i], d = sqrt(r * r + z * z), u = m->sigma[i] * d;
            slope += z / d * (r / d) * (3.0 + 3.0 * u + u * u) / (d * d) * exp(-u) / d; // -R_d'/a
            total += 2.0 * SSS_DIPOLE__PI * exp(-m->sigma[i] * z);
        }
        if (total > 0.0)
        {
            worst = sss_dipole__max(worst, h * h / 48.0 * 2.0 * SSS_DIPOLE__PI * r * slope / total);
        }
    }
    return worst;
}

// The same for three points at distance s from a source: the leading term is the mismatch of fourth moments,
// 6.5e-5 h^4 times the double Laplacian of R_d, 225 z/s^7 for a bare source; with absorption 1/s becomes
// 1/s + sigma/3. Integrated beyond s it is 2.9e-3 (h (1/s + sigma/3))^4 times the share z/s exp(-sigma (s-z)).
static double sss_dipole__three_point_error(const sss_dipole__model *m, double h, double s)
{
    double worst = 0.0;
    int i;
    for (i = 0; i < 3; i++)
    {
        const double z = m->z[0][i], q = h * (1.0 / s + m->sigma[i] / 3.0);
        if (m->a[i] > 0.0)
        {
            const double share = s > z ? z / s * exp(-m->sigma[i] * (s - z)) : 1.0;
            worst = sss_dipole__max(worst, 2.9e-3 * q * q * q * q * share);
        }
    }
    return worst;
}

// The same for seven points: 8.4e-5 (h (1/s + sigma/3))^5 is a fit, within a factor of 2, to the rule's mean relative
// error before a bare source 1/s^3 at distance s, for h/s from 0.3 to 1.8; at most three times that anywhere. Beyond
// 1.8 the nearest point of the triangle is closer than its own size, and no polynomial rule holds.
static double sss_dipole__seven_point_error(const sss_dipole__model *m, double h, double s)
{
    double worst = 0.0;
    int i;
    for (i = 0; i < 3; i++)
    {
        const double z = m->z[0][i], q = h * (1.0 / s + m->sigma[i] / 3.0);
        if (m->a[i] > 0.0)
        {
            const double share = s > z ? z / s * exp(-m->sigma[i] * (s - z)) : 1.0;
            worst = sss_dipole__max(worst, h < 1.8 * s ? 8.4e-5 * q * q * q * q * q * share : HUGE_VAL);
        }
    }
    return worst;
}

// The size class of an edge length: 4 an octave, the last one at 4 diagonals, rounded up.
static int sss_dipole__size_class(double h)
{
    int exponent, index;
    double mantissa;
    if (!(h > 0.0))
    {
        return 0;
    }
    mantissa = frexp(h, &exponent); // [0.5, 1)
    index = SSS_DIPOLE__SIZES - 1 + 4 * (exponent - 2)
            - (mantissa <= 0.59460355750136051 ? 3 : mantissa <= 0.70710678118654752 ? 2
               : mantissa <= 0.84089641525371454 ? 1 : 0); // 2^(-3/4), 2^(-1/2), 2^(-1/4)
    return index < 0 ? 0 : index >= SSS_DIPOLE__SIZES ? SSS_DIPOLE__SIZES - 1 : index;
}

// The smallest distance, on a grid of eight an octave, beyond which error(m, h, distance) stays within the bound.
static double sss_dipole__far_enough(const sss_dipole__model *m, double h, double bound,
                                     double (*error)(const sss_dipole__model *, double, double))
{
    const double step = 1.0905077326652577; // 2^(1/8)
    double r = 4.0 + m->z_max;
    while (r > 0.01 * m->z_min && error(m, h, r) <= bound)
    {
        r /= step;
    }
    return r > 0.01 * m->z_min ? r * step : 0.0;
}

// For each size class the distance from the receiver beyond which one point a triangle is enough, and the distances
// from a source beyond which three and seven are.
static void sss_dipole__plan_distances(const sss_dipole__model *m, double tolerance, sss_dipole__near *near_table)
{
    int k;
    // An intruding source makes the spot before it the brightest part of the integral, so that the relative errors of
    // the rules there count in full. Measured before a bare source, for h/s from 0.3 to 1.8, the largest are below
    // 0.4 (h/s)^2, 1.1e-2 (h/s)^2.5 and 4e-4 (h/s)^5; each may be half the tolerance.
    near_table->one_ratio = sqrt(0.8 / tolerance);
    near_table->three_ratio = pow(2.2e-2 / tolerance, 0.4);
    near_table->seven_ratio = sss_dipole__max(1.0 / 1.8, pow(8e-4 / tolerance, 0.2));
    for (k = 0; k < SSS_DIPOLE__SIZES; k++)
    {
        const double h = pow(2.0, 2.0 - (double)(SSS_DIPOLE__SIZES - 1 - k) / 4.0);
        near_table->far_distance[k] = sss_dipole__far_enough(m, h, SSS_DIPOLE__BUDGET * tolerance,
                                                             sss_dipole__one_point_error);
        near_table->middle_distance[k] = sss_dipole__far_enough(m, h, SSS_DIPOLE__BUDGET * tolerance,
                                                                sss_dipole__three_point_error);
        near_table->piece_distance[k] = sss_dipole__far_enough(m, h, 0.5 * SSS_DIPOLE__BUDGET * tolerance,
                                                               sss_dipole__seven_point_error);
    }
}

// ---- Predicting errors from the spectrum ----
//
// In the plane scattering is a convolution, and its spectrum T(k) = spectrum(k)/total has a closed form. A
// shadow edge across an object of size D has all frequencies, |E(k)|^2 = 1/k^2, over a lit length D/2, so that by
// Parseval a method that multiplies the spectrum by M(k) has the relative L2 error
//   sqrt(2/D 1/pi int_0^inf (T - M)^2 / k^2 dk).
// What the eye gets is that after averaging over a pixel, and a mesh cannot hold an edge sharper than its own.

static double sss_dipole__sinc2(double x)
{
    if (x < 1e-3)
    {
        return 1.0 - x * x / 3.0;
    }
    return x > 3.0 ? 0.5 / (x * x) : sin(x) / x * (sin(x) / x); // its mean where it oscillates
}

// 1 - T(k), without cancellation as k -> 0.
static double sss_dipole__one_minus_T(double sigma, double z_r, double z_v, double k)
{
    const double extra = k * (k / (hypot(sigma, k) + sigma)); // sqrt(sigma^2 + k^2) - sigma
    const double w_r = exp(-sigma * z_r), w_v = exp(-sigma * z_v), sum = w_r + w_v;
    if (!(sum > 0.0))
    {
        return -expm1(-z_r * extra); // the real source dominates
    }
    return -(w_r * expm1(-z_r * extra) + w_v * expm1(-z_v * extra)) / sum;
}

typedef struct sss_dipole__edge
{
    double sigma, z_r, z_v;
    double smooth, pixel; // mm: width of the irradiance's ramp, width of a pixel
    double spacing;       // mm: of linear interpolation of B
} sss_dipole__edge;

// int over ln k by the trapezoidal rule, 8 points an octave, over all k that matter to a profile of scale z.
static double sss_dipole__integrate_edge(const sss_dipole__edge *e, double (*f)(const sss_dipole__edge *, double))
{
    const double step = 0.69314718055994531 / 8.0;
    double sum = 0.0;
    int i;
    for (i = -320; i <= 240; i++) // k from 2^-40/z to 2^30/z
    {
        const double k = exp(step * (double)i) / e->z_r;
        sum += step * k * f(e, k);
    }
    return sum / SSS_DIPOLE__PI;
}

// Lambert has M = 1.
static double sss_dipole__lambert_integrand(const sss_dipole__edge *e, double k)
{
    const double d = sss_dipole__one_minus_T(e->sigma, e->z_r, e->z_v, k);
    return sss_dipole__sinc2(0.5 * k * e->smooth) * sss_dipole__sinc2(0.5 * k * e->pixel) * (d / k) * (d / k);
}

// Linear interpolation of B over a spacing h loses h^4/120 |B''|^2, and never more than all of it.
static double sss_dipole__interpolation_integrand(const sss_dipole__edge *e, double k)
{
    const double T = 1.0 - sss_dipole__one_minus_T(e->sigma, e->z_r, e->z_v, k);
    const double kh = k * e->spacing, lost = kh < 1e3 ? sss_dipole__min(1.0, kh * kh * kh * kh / 120.0) : 1.0;
    return T / k * (T / k) * lost;
}

// One point for a triangle of edge h over which irradiance varies misses (h^2/24) grad E . grad R_d A. Beyond distance
// r that is at most h^2/24 |grad E|/E int |R_d'| dA, with E taken to change by itself over a sixth of the diagonal.
// Without absorption a source has int_r |R_d'| 2 pi r dr = r z/d^3 + z/(d (d + r)); with it the integrand falls by
// (1 + u + u^2/3) exp(-u), u = sigma d, whose value at r bounds it. The total is exp(-sigma z) a source.
#define SSS_DIPOLE__VARIATION 6.0
static double sss_dipole__variation_error(double sigma, const double z[2], double h, double diagonal, double r)
{
    double slope = 0.0, total = 0.0;
    int k;
    for (k = 0; k < 2; k++)
    {
        const double d = hypot(r, z[k]), u = sigma * d;
        slope += (r / d * (z[k] / d) / d + z[k] / d / (d + r)) * (1.0 + u + u * u / 3.0) * exp(-u);
        total += exp(-sigma * z[k]);
    }
    return h * h / 24.0 * SSS_DIPOLE__VARIATION / diagonal * slope / total;
}

// One sample a triangle, no integration: the relative error of B at spacing h on an object of a given diagonal.
//   A regular lattice aliases at its reciprocal vectors, |k| = 4 pi/(sqrt(3) h), six of them, each by half for a
// receiver at a vertex: 3 T(k).
//   Irregular triangles add (h^2/48) laplace R_d A each, which cancels but for the scatter of h^2, taken as half of
// it: 1/2 h^2/48 sqrt(A) |laplace R_d|_2, with |.|_2^2 = 1/(2 pi) int k^5 T^2 dk.
//   Irradiance that varies over a triangle adds sss_dipole__variation_error.
#define SSS_DIPOLE__SCATTER 0.5
static double sss_dipole__sampling_error_of(double sigma, double z_r, double z_v, double h, double diagonal)
{
    const double z[2] = {z_r, z_v};
    const double k_lattice = 4.0 * SSS_DIPOLE__PI / (SSS_DIPOLE__SQRT3 * h);
    const double T_lattice = 1.0 - sss_dipole__one_minus_T(sigma, z_r, z_v, k_lattice);
    const double step = 0.69314718055994531 / 8.0;
    double sum = 0.0;
    int i;
    for (i = -160; i <= 80; i++)
    {
        const double kz = exp(step * (double)i), T = 1.0 - sss_dipole__one_minus_T(sigma, z_r, z_v, kz / z_r);
        sum += step * kz * kz * kz * kz * kz * kz * T * T; // (k z_r)^6 dk/k
    }
    return 3.0 * T_lattice + sss_dipole__variation_error(sigma, z, h, diagonal, 0.0)
           + SSS_DIPOLE__SCATTER * h * h / 48.0 * sqrt(0.25 * SSS_DIPOLE__SQRT3) * h
                 * sqrt(sum / (2.0 * SSS_DIPOLE__PI)) / (z_r * z_r * z_r);
}

static double sss_dipole__sampling_error(const sss_dipole__model *m, double h, double diagonal)
{
    double worst = 0.0;
    int i;
    for (i = 0; i < 3; i++)
    {
        if (m->a[i] > 0.0)
        {
            worst = sss_dipole__max(
                worst, sss_dipole__sampling_error_of(m->sigma[i], m->z[0][i], m->z[1][i], h, diagonal));
        }
    }
    return worst;
}

// ---- 5.3 Preparing the emitters ----

static void *sss_dipole__allocate(const sss_hooks *hooks, size_t bytes)
{
    return hooks->allocate != NULL ? hooks->allocate(hooks->user, bytes) : malloc(bytes);
}

static void sss_dipole__release(const sss_hooks *hooks, void *pointer)
{
    if (pointer == NULL)
    {
        return;
    }
    if (hooks->allocate != NULL)
    {
        hooks->release(hooks->user, pointer);
    }
    else
    {
        free(pointer);
    }
}

// What is being prepared: a mesh or points, behind one interface.
typedef struct sss_dipole__emitters
{
    const sss_mesh *mesh;            // or NULL
    const sss_dipole_points *points; // or NULL
    size_t count;                    // triangles or points
    double mm_per_unit;
} sss_dipole__emitters;

static void sss_dipole__emitter_centroid(const sss_dipole__emitters *e, size_t k, double out[3])
{
    int i;
    if (e->mesh != NULL)
    {
        double p[3][3];
        sss_dipole__triangle(e->mesh, k, p);
        for (i = 0; i < 3; i++)
        {
            out[i] = (p[0][i] + p[1][i] + p[2][i]) / 3.0;
        }
    }
    else
    {
        for (i = 0; i < 3; i++)
        {
            out[i] = (double)e->points->positions[3 * k + (size_t)i];
        }
    }
}

// Area in square mesh units.
static double sss_dipole__emitter_area(const sss_dipole__emitters *e, size_t k)
{
    double p[3][3], n[3];
    if (e->mesh == NULL)
    {
        return (double)e->points->areas[k] / e->mm_per_unit / e->mm_per_unit;
    }
    sss_dipole__triangle(e->mesh, k, p);
    sss_dipole__area_vector(p[0], p[1], p[2], n);
    return 0.5 * sqrt(sss_dipole__dot(n, n));
}

// Centre and diagonal of the bounding box of all emitters that have an area, mesh units; the diagonal is never 0.
static void sss_dipole__bounds(const sss_dipole__emitters *e, double center[3], double *diagonal)
{
    const int corners = e->mesh != NULL ? 3 : 1;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, d[3];
    size_t k;
    int i, j;
    for (k = 0; k < e->count; k++)
    {
        const int counted = sss_dipole__emitter_area(e, k) > 0.0 ? corners : 0;
        for (j = 0; j < counted; j++)
        {
            double p[3];
            if (e->mesh != NULL)
            {
                sss_dipole__corner(e->mesh, k, j, p);
            }
            else
            {
                sss_dipole__emitter_centroid(e, k, p);
            }
            for (i = 0; i < 3; i++)
            {
                low[i] = sss_dipole__min(low[i], p[i]);
                high[i] = sss_dipole__max(high[i], p[i]);
            }
        }
    }
    for (i = 0; i < 3; i++)
    {
        center[i] = low[i] <= high[i] ? 0.5 * (low[i] + high[i]) : 0.0;
        d[i] = low[i] <= high[i] ? high[i] - low[i] : 0.0;
    }
    *diagonal = sqrt(sss_dipole__dot(d, d));
    if (*diagonal == 0.0)
    {
        *diagonal = 1.0;
    }
}

static uint32_t sss_dipole__spread_bits(uint32_t x) // 10 bits to every third
{
    x = (x | (x << 16)) & 0x030000ffu;
    x = (x | (x << 8)) & 0x0300f00fu;
    x = (x | (x << 4)) & 0x030c30c3u;
    return (x | (x << 2)) & 0x09249249u;
}

typedef struct sss_dipole__key
{
    uint32_t code;    // Morton code
    uint32_t element; // triangle or point
} sss_dipole__key;

// Keys of all emitters with an area, sorted by Morton code with a stable radix sort; both arrays [count].
// Returns how many.
static size_t sss_dipole__sort_emitters(const sss_dipole__emitters *e, const double center[3], double diagonal,
                                        sss_dipole__key *keys, sss_dipole__key *scratch)
{
    size_t count = 0, k;
    int pass, i;
    for (k = 0; k < e->count; k++)
    {
        double c[3];
        uint32_t code = 0;
        if (!(sss_dipole__emitter_area(e, k) > 0.0))
        {
            continue;
        }
        sss_dipole__emitter_centroid(e, k, c);
        for (i = 0; i < 3; i++)
        {
            const double part = sss_dipole__max(0.0, (c[i] - center[i]) / diagonal + 0.5);
            const double cell = 1023.0 * sss_dipole__min(1.0, part);
            code |= sss_dipole__spread_bits((uint32_t)cell) << i;
        }
        keys[count].code = code;
        keys[count].element = (uint32_t)k;
        count++;
    }
    for (pass = 0; pass < 4; pass++)
    {
        const int shift = 8 * pass;
        sss_dipole__key *swap = keys;
        size_t first[257] = {0};
        for (k = 0; k < count; k++)
        {
            first[((keys[k].code >> shift) & 255u) + 1]++;
        }
        for (i = 0; i < 256; i++)
        {
            first[i + 1] += first[i];
        }
        for (k = 0; k < count; k++)
        {
            scratch[first[(keys[k].code >> shift) & 255u]++] = keys[k];
        }
        keys = scratch;
        scratch = swap;
    }
    return count; // after an even number of passes the keys are back in their own array
}

// Carves [count] elements of `size` bytes out of an arena; with base = NULL it only measures.
static void *sss_dipole__carve(char *base, size_t *offset, size_t count, size_t size)
{
    const size_t at = (*offset + 63u) & ~(size_t)63u;
    *offset = at + count * size;
    return base != NULL ? base + at : NULL;
}

// Lays the object's arrays out; returns the bytes needed.
static size_t sss_dipole__lay_out(sss_dipole_gather *g, char *base, size_t table_floats)
{
    const size_t n = SSS_DIPOLE__BLOCK * g->block_count;
    const size_t near_n = g->triangle_count > 0 && !g->stats.point_sampling ? n : 0;
    size_t offset = 0;
    int i;
    g->blocks = (sss_dipole__block *)sss_dipole__carve(base, &offset, g->block_count, sizeof *g->blocks);
    g->groups = (sss_dipole__block *)sss_dipole__carve(base, &offset, g->group_count, sizeof *g->groups);
    for (i = 0; i < 6; i++)
    {
        g->one.p[i] = (float *)sss_dipole__carve(base, &offset, n, sizeof(float));
        g->three.p[i] = (float *)sss_dipole__carve(base, &offset, 3 * near_n, sizeof(float));
    }
    g->corners = (float *)sss_dipole__carve(base, &offset, 9 * near_n, sizeof(float));
    g->corner_E = (float *)sss_dipole__carve(base, &offset, 9 * near_n, sizeof(float));
    g->area = (float *)sss_dipole__carve(base, &offset, n, sizeof(float));
    g->vertex = (uint32_t *)sss_dipole__carve(base, &offset, g->triangle_count > 0 ? 3 * n : 0, sizeof(uint32_t));
    g->element = (uint32_t *)sss_dipole__carve(base, &offset, n, sizeof(uint32_t));
    g->tables = (float *)sss_dipole__carve(base, &offset, table_floats, sizeof(float));
    return offset + 64;
}

// Positions of one emitter in slot `slot`; the padding after the last one repeats it with area 0.
static void sss_dipole__place_emitter(sss_dipole_gather *g, const sss_dipole__emitters *e, size_t slot,
                                      uint32_t element, int padding)
{
    const double scale = 1.0 / g->unit_per_diagonal;
    const double area = sss_dipole__emitter_area(e, element) / g->unit_per_diagonal / g->unit_per_diagonal;
    double c[3], p[3][3];
    int i, k;
    sss_dipole__emitter_centroid(e, element, c);
    g->element[slot] = element;
    g->area[slot] = padding ? 0.0f : (float)(area / g->area_scale);
    for (i = 0; i < 3; i++)
    {
        g->one.p[i][slot] = (float)((c[i] - g->center[i]) * scale);
    }
    for (k = 0; e->mesh != NULL && k < 3; k++)
    {
        sss_dipole__corner(e->mesh, element, k, p[k]);
        g->vertex[3 * slot + (size_t)k] = e->mesh->triangles[3 * (size_t)element + (size_t)k];
    }
    if (e->mesh == NULL || g->stats.point_sampling)
    {
        return;
    }
    for (k = 0; k < 3; k++)
    {
        for (i = 0; i < 3; i++)
        {
            const double sample = (p[0][i] + p[1][i] + p[2][i] + 3.0 * p[k][i]) / 6.0; // (2/3, 1/6, 1/6)
            g->three.p[i][3 * slot + (size_t)k] = (float)((sample - g->center[i]) * scale);
            g->corners[9 * slot + 3 * (size_t)k + (size_t)i] = (float)p[k][i];
        }
    }
}

static double sss_dipole__distance2(const double a[3], const double b[3])
{
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sss_dipole__dot(d, d);
}

static double sss_dipole__distance(const double a[3], const double b[3])
{
    return sqrt(sss_dipole__distance2(a, b));
}

// Grows the bounding sphere of `block` to hold a ball.
static void sss_dipole__include(sss_dipole__block *block, const double point[3], double radius)
{
    const double center[3] = {(double)block->center[0], (double)block->center[1], (double)block->center[2]};
    const double reach = (sss_dipole__distance(center, point) + radius) * (1.0 + 1e-6); // outward rounding
    block->radius = (float)sss_dipole__max((double)block->radius, reach);
}

// Makes `block` as demanding as a part of it with longest edge `edge`.
static void sss_dipole__demand(sss_dipole__block *block, double edge, double far_distance, double middle_distance)
{
    block->edge = (float)sss_dipole__max((double)block->edge, edge);
    block->far_distance = (float)sss_dipole__max((double)block->far_distance, far_distance);
    block->middle_distance = (float)sss_dipole__max((double)block->middle_distance, middle_distance);
}

// Centre of the bounding box of the samples `one` [begin, end).
static void sss_dipole__center_block(const sss_dipole_gather *g, size_t begin, size_t end, sss_dipole__block *block)
{
    size_t k;
    int i;
    memset(block, 0, sizeof *block);
    for (i = 0; i < 3; i++)
    {
        float low = g->one.p[i][begin], high = low;
        for (k = begin; k < end; k++)
        {
            low = g->one.p[i][k] < low ? g->one.p[i][k] : low;
            high = g->one.p[i][k] > high ? g->one.p[i][k] : high;
        }
        block->center[i] = 0.5f * (low + high);
    }
}

static double sss_dipole__longest_edge(double p[3][3])
{
    return sss_dipole__max(sss_dipole__distance(p[0], p[1]),
                           sss_dipole__max(sss_dipole__distance(p[1], p[2]), sss_dipole__distance(p[2], p[0])));
}

static void sss_dipole__bound_block(sss_dipole_gather *g, size_t b)
{
    sss_dipole__block *block = &g->blocks[b];
    const size_t begin = SSS_DIPOLE__BLOCK * b, end = begin + SSS_DIPOLE__BLOCK;
    size_t slot;
    int i, k;
    sss_dipole__center_block(g, begin, end, block);
    for (slot = begin; slot < end; slot++)
    {
        double p[3][3], edge;
        int size_class;
        if (g->triangle_count == 0 || g->stats.point_sampling)
        {
            const double x[3] = {(double)g->one.p[0][slot], (double)g->one.p[1][slot], (double)g->one.p[2][slot]};
            sss_dipole__include(block, x, 0.0);
            continue;
        }
        for (k = 0; k < 3; k++)
        {
            for (i = 0; i < 3; i++)
            {
                p[k][i] = ((double)g->corners[9 * slot + 3 * (size_t)k + (size_t)i] - g->center[i])
                          / g->unit_per_diagonal;
            }
        }
        edge = sss_dipole__longest_edge(p);
        size_class = sss_dipole__size_class(edge);
        sss_dipole__demand(block, edge, g->near_table.far_distance[size_class],
                           g->near_table.middle_distance[size_class]);
        for (k = 0; k < 3; k++)
        {
            sss_dipole__include(block, p[k], 0.0);
        }
    }
}

static void sss_dipole__bound_group(sss_dipole_gather *g, size_t group)
{
    const size_t begin = SSS_DIPOLE__GROUP * group;
    const size_t end = begin + SSS_DIPOLE__GROUP < g->block_count ? begin + SSS_DIPOLE__GROUP : g->block_count;
    size_t b;
    sss_dipole__center_block(g, SSS_DIPOLE__BLOCK * begin, SSS_DIPOLE__BLOCK * end, &g->groups[group]);
    for (b = begin; b < end; b++)
    {
        const sss_dipole__block *block = &g->blocks[b];
        const double c[3] = {(double)block->center[0], (double)block->center[1], (double)block->center[2]};
        sss_dipole__include(&g->groups[group], c, (double)block->radius);
        sss_dipole__demand(&g->groups[group], (double)block->edge, (double)block->far_distance,
                           (double)block->middle_distance);
    }
}

// Error predicted for B: what one-point and three-point triangles were allowed, and the tables. Where every
// triangle is one sample, see sss_dipole__sampling_error.
static void sss_dipole__predict(sss_dipole_gather *g, const sss_dipole__emitters *e)
{
    double area = 0.0, edge = 0.0, far_distance = 0.0, far_error = 0.0, variation = 0.0;
    size_t slot;
    int i;
    for (slot = 0; slot < SSS_DIPOLE__BLOCK * g->block_count; slot++)
    {
        const double a = (double)g->area[slot];
        const double h = sqrt(a * g->area_scale * 4.0 / SSS_DIPOLE__SQRT3); // as if equilateral
        const double r = (double)g->blocks[slot / SSS_DIPOLE__BLOCK].far_distance;
        area += a;
        edge += a * h;
        far_distance += a * r;
        far_error += a * sss_dipole__one_point_error(&g->model, h, r);
    }
    area = area > 0.0 ? area : 1.0;
    far_distance /= area;
    edge /= area;
    for (i = 0; i < 3; i++)
    {
        if (g->model.a[i] > 0.0)
        {
            const double z[2] = {g->model.z[0][i], g->model.z[1][i]};
            variation = sss_dipole__max(
                variation, sss_dipole__variation_error(g->model.sigma[i], z, edge, 1.0, far_distance));
        }
    }
    g->stats.mean_edge_mm = edge * g->unit_per_diagonal * e->mm_per_unit;
    g->stats.one_point_mm = far_distance * g->unit_per_diagonal * e->mm_per_unit;
    g->stats.predicted_error = g->stats.path_tolerance;
    if (g->stats.emitter_count == 0)
    {
        g->stats.predicted_error = 0.0; // B = 0
    }
    else if (e->mesh == NULL || g->stats.point_sampling)
    {
        edge = sss_dipole__max(edge, 1e-30);
        g->stats.predicted_error += sss_dipole__sampling_error(&g->model, edge, 1.0);
    }
    else
    {
        g->stats.predicted_error += SSS_DIPOLE__LEFT * (far_error / area + SSS_DIPOLE__BUDGET * g->stats.tolerance)
                                    + variation;
    }
}

static void sss_dipole__fill_gather(sss_dipole_gather *g, const sss_dipole__emitters *e, const sss_dipole__key *keys,
                                    int table_count)
{
    const size_t slots = SSS_DIPOLE__BLOCK * g->block_count;
    size_t k;
    g->area_scale = 0.0;
    for (k = 0; k < g->stats.emitter_count; k++)
    {
        const double area = sss_dipole__emitter_area(e, keys[k].element);
        g->area_scale = sss_dipole__max(g->area_scale, area / g->unit_per_diagonal / g->unit_per_diagonal);
    }
    for (k = 0; k < slots; k++)
    {
        const int padding = k >= g->stats.emitter_count;
        sss_dipole__place_emitter(g, e, k, keys[padding ? g->stats.emitter_count - 1 : k].element, padding);
    }
    for (k = 0; k < g->block_count; k++)
    {
        sss_dipole__bound_block(g, k);
    }
    for (k = 0; k < g->group_count; k++)
    {
        sss_dipole__bound_group(g, k);
    }
    for (k = 0; k < 3; k++)
    {
        memset(g->one.p[3 + k], 0, slots * sizeof(float));
        if (g->triangle_count > 0 && !g->stats.point_sampling)
        {
            memset(g->three.p[3 + k], 0, 3 * slots * sizeof(float));
        }
    }
    if (g->triangle_count > 0 && !g->stats.point_sampling)
    {
        memset(g->corner_E, 0, 9 * slots * sizeof(float));
    }
    if (table_count > 0)
    {
        g->stats.path_tolerance = sss_dipole__fill_tables(&g->model, table_count, g->tables);
    }
    sss_dipole__predict(g, e);
}

static sss_result sss_dipole__resolve_options(const sss_profile *profile, const sss_dipole_gather_options *options,
                                              const sss_hooks *hooks, sss_dipole_gather *g)
{
    memset(g, 0, sizeof *g);
    if (profile == NULL || !sss_dipole__valid_profile(profile))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (hooks != NULL)
    {
        if ((hooks->allocate == NULL) != (hooks->release == NULL))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
        g->hooks = *hooks;
    }
    g->stats.tolerance = 1e-3;
    g->stats.path = sss_dipole__fastest_path();
    if (options != NULL)
    {
        if ((options->geometry != SSS_DIPOLE_DISTANCE && options->geometry != SSS_DIPOLE_PLACED)
            || (options->tolerance != 0.0 && !sss_dipole__in_range(options->tolerance, 1e-5, 0.5))
            || (int)options->path < SSS_DIPOLE_PATH_AUTO || options->path > SSS_DIPOLE_PATH_AVX512)
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
        g->stats.geometry = options->geometry;
        g->stats.tolerance = options->tolerance > 0.0 ? options->tolerance : g->stats.tolerance;
        g->stats.path = options->path != SSS_DIPOLE_PATH_AUTO ? options->path : g->stats.path;
        g->stats.point_sampling = options->point_sampling != 0;
    }
    g->kernel = sss_dipole__find_kernel(g->stats.path);
    return g->kernel != NULL ? SSS_OK : SSS_ERROR_INVALID_ARGUMENT;
}

// Builds the object; `draft` holds the resolved options.
static sss_result sss_dipole__build(const sss_dipole__emitters *e, const sss_profile *profile,
                                    sss_dipole_gather *draft, sss_dipole_gather **out)
{
    sss_dipole__key *keys = NULL;
    sss_dipole_gather *g;
    size_t header, bytes, table_floats = 0;
    int table_count = 0;
    if (e->count > 0xffffffffu || e->count > SIZE_MAX / 512)
    {
        return SSS_ERROR_OVERFLOW;
    }
    sss_dipole__bounds(e, draft->center, &draft->unit_per_diagonal);
    sss_dipole__make_model(profile, draft->stats.geometry, draft->unit_per_diagonal * e->mm_per_unit,
                           e->mesh == NULL || draft->stats.point_sampling, &draft->model);
    sss_dipole__plan_distances(&draft->model, draft->stats.tolerance, &draft->near_table);
    if (draft->stats.path != SSS_DIPOLE_PATH_SCALAR)
    {
        table_count = sss_dipole__plan_tables(&draft->model, draft->stats.tolerance);
        table_floats = (size_t)table_count * (draft->model.size + 1);
        draft->stats.table_entries = draft->model.size + 1;
    }
    keys = (sss_dipole__key *)sss_dipole__allocate(&draft->hooks, 2 * e->count * sizeof *keys);
    if (keys == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    draft->stats.emitter_count = sss_dipole__sort_emitters(e, draft->center, draft->unit_per_diagonal, keys,
                                                           keys + e->count);
    draft->block_count = (draft->stats.emitter_count + SSS_DIPOLE__BLOCK - 1) / SSS_DIPOLE__BLOCK;
    draft->group_count = (draft->block_count + SSS_DIPOLE__GROUP - 1) / SSS_DIPOLE__GROUP;
    draft->vertex_count = e->mesh != NULL ? e->mesh->vertex_count : e->points->count;
    draft->triangle_count = e->mesh != NULL ? e->mesh->triangle_count : 0;
    header = (sizeof *draft + 63u) & ~(size_t)63u;
    bytes = header + sss_dipole__lay_out(draft, NULL, table_floats);
    g = (sss_dipole_gather *)sss_dipole__allocate(&draft->hooks, bytes);
    if (g == NULL)
    {
        sss_dipole__release(&draft->hooks, keys);
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    *g = *draft;
    g->stats.bytes = bytes;
    sss_dipole__lay_out(g, (char *)g + header, table_floats);
    sss_dipole__fill_gather(g, e, keys, table_count);
    sss_dipole__release(&g->hooks, keys);
    *out = g;
    return SSS_OK;
}

SSS_DIPOLE_API sss_result sss_dipole_gather_create(const sss_mesh *mesh, const sss_profile *profile,
                                                   const sss_dipole_gather_options *options, const sss_hooks *hooks,
                                                   sss_dipole_gather **out)
{
    sss_dipole_gather draft;
    sss_dipole__emitters e = {NULL, NULL, 0, 0.0};
    sss_dipole__condition condition;
    sss_result result = sss_dipole__check_mesh(mesh);
    if (result == SSS_OK)
    {
        result = out != NULL ? sss_dipole__resolve_options(profile, options, hooks, &draft)
                             : SSS_ERROR_INVALID_ARGUMENT;
    }
    if (result != SSS_OK)
    {
        return result;
    }
    e.mesh = mesh;
    e.count = mesh->triangle_count;
    e.mm_per_unit = mesh->mm_per_unit;
    sss_dipole__inspect(mesh->positions, mesh->normals, mesh->triangles, mesh->triangle_count, &condition);
    sss_dipole__tell_condition(&condition, mesh->triangle_count, mesh->mm_per_unit, profile, &draft.stats);
    return sss_dipole__build(&e, profile, &draft, out);
}

SSS_DIPOLE_API sss_result sss_dipole_gather_create_points(const sss_dipole_points *points, const sss_profile *profile,
                                                          const sss_dipole_gather_options *options,
                                                          const sss_hooks *hooks, sss_dipole_gather **out)
{
    sss_dipole_gather draft;
    sss_dipole__emitters e = {NULL, NULL, 0, 0.0};
    sss_result result;
    size_t k;
    if (points == NULL || out == NULL || points->positions == NULL || points->areas == NULL
        || !sss_dipole__in_range(points->mm_per_unit, 1e-100, 1e100))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (points->count == 0)
    {
        return SSS_ERROR_EMPTY;
    }
    if (points->count > SIZE_MAX / 512)
    {
        return SSS_ERROR_OVERFLOW;
    }
    if (!sss_dipole__all_finite(points->positions, 3 * points->count))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (k = 0; k < points->count; k++)
    {
        if (!(points->areas[k] >= 0.0f) || !sss_dipole__finite((double)points->areas[k]))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
    }
    result = sss_dipole__resolve_options(profile, options, hooks, &draft);
    if (result != SSS_OK)
    {
        return result;
    }
    e.points = points;
    e.count = points->count;
    e.mm_per_unit = points->mm_per_unit;
    return sss_dipole__build(&e, profile, &draft, out);
}

SSS_DIPOLE_API void sss_dipole_gather_free(sss_dipole_gather *gather)
{
    if (gather != NULL)
    {
        const sss_hooks hooks = gather->hooks;
        sss_dipole__release(&hooks, gather);
    }
}

SSS_DIPOLE_API sss_result sss_dipole_gather_get_stats(const sss_dipole_gather *gather, sss_dipole_gather_stats *out)
{
    if (gather == NULL || out == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    *out = gather->stats;
    return SSS_OK;
}

// Moves the one point of a triangle to the centroid of the light on it, so that irradiance which varies over the
// triangle costs no first-order error: int E x / int E = sum_k x_k (S + E_k)/(4 S), S = sum_k E_k, E linear. One
// point serves three channels, so E is their sum here, without sign.
static void sss_dipole__center_light(sss_dipole_gather *g, const double E[3], size_t slot)
{
    const double S = E[0] + E[1] + E[2];
    int i, k;
    for (i = 0; i < 3; i++)
    {
        double x = 0.0;
        for (k = 0; k < 3; k++)
        {
            const double weight = S > 0.0 ? (S + E[k]) / (4.0 * S) : 1.0 / 3.0;
            x += weight * ((double)g->corners[9 * slot + 3 * (size_t)k + (size_t)i] - g->center[i]);
        }
        g->one.p[i][slot] = (float)(x / g->unit_per_diagonal);
    }
}

// The weights of one emitter's samples: E A, E taken where the sample lies. Returns whether any light falls on it.
static int sss_dipole__weigh_emitter(sss_dipole_gather *g, sss_dipole_elements elements, const float *irradiance,
                                     size_t slot)
{
    const double A = (double)g->area[slot];
    const int near_samples = g->triangle_count > 0 && !g->stats.point_sampling;
    double light[3] = {0.0, 0.0, 0.0};
    int lit = 0, i;
    size_t k;
    for (i = 0; i < 3; i++)
    {
        double E[3], mean;
        for (k = 0; k < 3; k++)
        {
            const size_t at = elements == SSS_DIPOLE_VERTICES && g->triangle_count > 0
                                  ? (size_t)g->vertex[3 * slot + k] : (size_t)g->element[slot];
            E[k] = (double)irradiance[3 * at + (size_t)i] / g->irradiance_scale;
            light[k] += fabs(E[k]);
            lit |= E[k] != 0.0;
        }
        mean = (E[0] + E[1] + E[2]) / 3.0;
        g->one.p[3 + i][slot] = (float)(mean * A);
        for (k = 0; near_samples && k < 3; k++)
        {
            g->three.p[3 + i][3 * slot + k] = (float)((mean + E[k]) / 6.0 * A); // (3 mean + 3 E_k)/6 of A/3
            g->corner_E[9 * slot + 3 * k + (size_t)i] = (float)E[k];
        }
    }
    if (near_samples)
    {
        sss_dipole__center_light(g, light, slot);
    }
    return lit;
}

static void sss_dipole__weigh_block(sss_dipole_gather *g, sss_dipole_elements elements, const float *irradiance,
                                    size_t b)
{
    sss_dipole__block *group = &g->groups[b / SSS_DIPOLE__GROUP];
    size_t slot;
    g->blocks[b].lit = 0;
    for (slot = SSS_DIPOLE__BLOCK * b; slot < SSS_DIPOLE__BLOCK * (b + 1); slot++)
    {
        g->blocks[b].lit |= sss_dipole__weigh_emitter(g, elements, irradiance, slot);
    }
    group->lit |= g->blocks[b].lit;
    group->partly_dark |= !g->blocks[b].lit;
}

SSS_DIPOLE_API sss_result sss_dipole_gather_set_irradiance(sss_dipole_gather *gather, sss_dipole_elements elements,
                                                           const float *irradiance)
{
    size_t count, k;
    float largest = 0.0f;
    if (gather == NULL || irradiance == NULL
        || !(elements == SSS_DIPOLE_VERTICES || (elements == SSS_DIPOLE_TRIANGLES && gather->triangle_count > 0)))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    count = elements == SSS_DIPOLE_TRIANGLES ? gather->triangle_count : gather->vertex_count;
    for (k = 0; k < 3 * count; k++)
    {
        const float size = irradiance[k] < 0.0f ? -irradiance[k] : irradiance[k];
        if (!sss_dipole__finite((double)irradiance[k]))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
        largest = size > largest ? size : largest;
    }
    gather->irradiance_scale = largest > 0.0f ? (double)largest : 1.0;
    for (k = 0; k < gather->group_count; k++)
    {
        gather->groups[k].lit = gather->groups[k].partly_dark = 0;
    }
    for (k = 0; k < gather->block_count; k++)
    {
        sss_dipole__weigh_block(gather, elements, irradiance, k);
    }
    return SSS_OK;
}

// ---- 5.4 Gathering ----

// Near samples waiting to be evaluated.
typedef struct sss_dipole__buffer
{
    size_t count;
    float value[6][SSS_DIPOLE__BUFFER];
    sss_dipole__samples samples; // points into value
} sss_dipole__buffer;

// One receiver at work: where it is, its sources, and near samples waiting to be evaluated. Near samples are
// relative to the receiver, so that they keep their digits however close they are.
typedef struct sss_dipole__worker
{
    const sss_dipole_gather *g;
    sss_dipole__kernel kernel;
    double position[3];       // of the receiver, mesh units
    double receiver[6];       // position from the centre, in diagonals, and normal
    double origin[6];         // the receiver seen from itself: 0, and its normal
    sss_dipole__buffer *buffer; // shared by the receivers of a tile, empty between two of them
    double sum[3];
} sss_dipole__worker;

static void sss_dipole__flush(sss_dipole__worker *w)
{
    sss_dipole__buffer *b = w->buffer;
    size_t end = b->count;
    int i;
    if (end == 0)
    {
        return;
    }
    for (; end % SSS_DIPOLE__BLOCK != 0; end++) // fill the last register with samples of weight 0
    {
        for (i = 0; i < 6; i++)
        {
            b->value[i][end] = i < 3 ? b->value[i][end - 1] : 0.0f;
        }
    }
    w->kernel(&w->g->model, &b->samples, 0, end, w->origin, w->sum);
    b->count = 0;
}

// What a ball around a point, relative to the receiver, is to the placed sources. Lower bounds of distances.
typedef struct sss_dipole__sight
{
    double nearest;   // to any source
    double intruding; // to a source that lies nearer to the ball than to its own surface; infinite if there is none
    int close;        // so close to a source that only the scalar path holds there
} sss_dipole__sight;

// The sources lie on the normal. Over a flat surface one is sqrt(r^2 + z^2) away from a point at distance r; where
// the surface bends towards it, it intrudes, and the integral has a peak of 2 pi z/H there.
static void sss_dipole__look(const sss_dipole__worker *w, const double point[3], double radius,
                             sss_dipole__sight *sight)
{
    const sss_dipole__model *m = &w->g->model;
    const double height = sss_dipole__dot(point, w->receiver + 3), r2 = sss_dipole__dot(point, point);
    const double t2 = sss_dipole__max(0.0, r2 - height * height);
    double nearest2 = HUGE_VAL, intruding2 = HUGE_VAL;
    int k;
    sight->close = 0;
    for (k = 0; k < 6; k++)
    {
        const double z = m->z[k / 3][k % 3], at = k < 3 ? -z : z, reach = SSS_DIPOLE__CLOSE * z + radius;
        const double s2 = t2 + (height - at) * (height - at), own = z + radius;
        if (m->a[k % 3] > 0.0)
        {
            nearest2 = sss_dipole__min(nearest2, s2);
            sight->close |= s2 < reach * reach;
            if (s2 < 0.5 * (r2 + z * z) && s2 < own * own)
            {
                intruding2 = sss_dipole__min(intruding2, s2);
            }
        }
    }
    sight->nearest = sss_dipole__max(0.0, sqrt(nearest2) - radius);
    sight->intruding = sss_dipole__max(0.0, sqrt(intruding2) - radius);
}

// The same for a flat piece of radius `radius` in the plane through c with unit normal `plane`: a source's height over
// the plane counts in full, only its distance along the plane may shrink by the radius.
static void sss_dipole__look_at_piece(const sss_dipole__worker *w, const double c[3], double radius,
                                      const double plane[3], sss_dipole__sight *sight)
{
    const sss_dipole__model *m = &w->g->model;
    const double *n = w->receiver + 3;
    double nearest2 = HUGE_VAL;
    int k;
    sss_dipole__look(w, c, radius, sight);
    for (k = 0; k < 6; k++)
    {
        const double at = k < 3 ? -m->z[0][k] : m->z[1][k - 3];
        const double d[3] = {c[0] - at * n[0], c[1] - at * n[1], c[2] - at * n[2]};
        const double height = sss_dipole__dot(d, plane), d2 = sss_dipole__dot(d, d);
        const double t = sqrt(sss_dipole__max(0.0, d2 - height * height)) - radius;
        if (m->a[k % 3] > 0.0)
        {
            nearest2 = sss_dipole__min(nearest2, height * height + (t > 0.0 ? t * t : 0.0));
        }
    }
    sight->nearest = sss_dipole__max(sight->nearest, sqrt(nearest2));
    sight->intruding = sss_dipole__max(sight->intruding, sqrt(nearest2));
}

// A rule on a triangle: its samples as barycentric coordinate of the corner that a sample belongs to (the k-th one to
// corner k modulo 3), of the other two, and weight.
typedef struct sss_dipole__samples_of_piece
{
    int count;
    double sample[7][3];
} sss_dipole__samples_of_piece;

static const sss_dipole__samples_of_piece sss_dipole__three_points = { // degree 2
    3,
    {{2.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0}, {2.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0}, {2.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0}},
};

// Radon's, degree 5: (9 +- 2 sqrt(15))/21, (6 -+ sqrt(15))/21, (155 -+ sqrt(15))/1200, and the centroid.
#define SSS_DIPOLE__RADON_A {0.79742698535308732, 0.10128650732345634, 0.12593918054482715}
#define SSS_DIPOLE__RADON_B {0.059715871789769820, 0.47014206410511509, 0.13239415278850618}
static const sss_dipole__samples_of_piece sss_dipole__seven_points = {
    7,
    {SSS_DIPOLE__RADON_A, SSS_DIPOLE__RADON_A, SSS_DIPOLE__RADON_A, SSS_DIPOLE__RADON_B, SSS_DIPOLE__RADON_B,
     SSS_DIPOLE__RADON_B, {1.0 / 3.0, 1.0 / 3.0, 0.225}},
};

// Adds the samples of a piece, weights E A, to the buffer; or to the sum at once where only the scalar path holds.
static void sss_dipole__push_piece(sss_dipole__worker *w, const sss_dipole__samples_of_piece *rule, double p[3][3],
                                   double E[3][3], double A, int close)
{
    sss_dipole__buffer *b = w->buffer;
    size_t slot;
    int i, k;
    if (b->count + 7 > SSS_DIPOLE__BUFFER)
    {
        sss_dipole__flush(w);
    }
    slot = b->count;
    for (i = 0; i < 3; i++)
    {
        const double sum = p[0][i] + p[1][i] + p[2][i], sum_E = E[0][i] + E[1][i] + E[2][i];
        for (k = 0; k < rule->count; k++) // own a + others b = b sum + (a - b) own
        {
            const double others = rule->sample[k][1], more = rule->sample[k][0] - others;
            b->value[i][slot + (size_t)k] = (float)(others * sum + more * p[k % 3][i]);
            b->value[3 + i][slot + (size_t)k] = (float)((others * sum_E + more * E[k % 3][i])
                                                        * (rule->sample[k][2] * A));
        }
    }
    if (close)
    {
        sss_dipole__kernel_scalar(&w->g->model, &b->samples, slot, slot + (size_t)rule->count, w->origin, w->sum);
        return;
    }
    b->count += (size_t)rule->count;
}

// The rule that integrates a piece of longest edge h well enough for its distance from the sources, or NULL.
static const sss_dipole__samples_of_piece *sss_dipole__rule_of_piece(const sss_dipole__worker *w, double p[3][3],
                                                                     double h, const double plane[3], int *close)
{
    const sss_dipole__model *m = &w->g->model;
    const sss_dipole__near *n = &w->g->near_table;
    const int size_class = sss_dipole__size_class(h);
    const double c[3] = {(p[0][0] + p[1][0] + p[2][0]) / 3.0, (p[0][1] + p[1][1] + p[2][1]) / 3.0,
                         (p[0][2] + p[1][2] + p[2][2]) / 3.0};
    const double radius = sqrt(sss_dipole__max(sss_dipole__distance2(c, p[0]),
                                               sss_dipole__max(sss_dipole__distance2(c, p[1]),
                                                               sss_dipole__distance2(c, p[2]))));
    sss_dipole__sight sight = {0.0, HUGE_VAL, 0};
    if (m->geometry == SSS_DIPOLE_DISTANCE)
    {
        const double r = sss_dipole__max(0.0, sqrt(sss_dipole__dot(c, c)) - radius);
        sight.nearest = sqrt(r * r + m->z_min * m->z_min);
    }
    else
    {
        sss_dipole__look_at_piece(w, c, radius, plane, &sight);
    }
    *close = sight.close;
    if (sight.nearest > n->middle_distance[size_class] && sight.intruding > n->three_ratio * h)
    {
        return &sss_dipole__three_points;
    }
    // A source on the surface itself (height 0) has an infinite integral: 1e-6 of z is where pieces end.
    return (sight.nearest > n->piece_distance[size_class] && sight.intruding > n->seven_ratio * h)
                   || h < 1e-6 * m->z_min
               ? &sss_dipole__seven_points : NULL;
}

// Integrates a near triangle with linear irradiance: corners relative to the receiver, E at them, area A, unit normal
// `plane` (placed sources only). Pieces are halved across their longest edge, which makes slivers compact.
static void sss_dipole__integrate(sss_dipole__worker *w, double p[3][3], double E[3][3], double A,
                                  const double plane[3])
{
    const double edges[3] = {sss_dipole__distance2(p[0], p[1]), sss_dipole__distance2(p[1], p[2]),
                             sss_dipole__distance2(p[2], p[0])}; // squared
    const int longest = edges[0] >= edges[1] ? (edges[0] >= edges[2] ? 0 : 2) : (edges[1] >= edges[2] ? 1 : 2);
    const int ends[2] = {longest, (longest + 1) % 3};
    const sss_dipole__samples_of_piece *rule;
    int close, i, half;
    rule = sss_dipole__rule_of_piece(w, p, sqrt(edges[longest]), plane, &close);
    if (rule != NULL)
    {
        sss_dipole__push_piece(w, rule, p, E, A, close);
        return;
    }
    for (half = 0; half < 2; half++) // one end of the longest edge moves to its middle
    {
        double q[3][3], q_E[3][3];
        memcpy(q, p, sizeof q);
        memcpy(q_E, E, sizeof q_E);
        for (i = 0; i < 3; i++)
        {
            q[ends[half]][i] = 0.5 * (p[ends[0]][i] + p[ends[1]][i]);
            q_E[ends[half]][i] = 0.5 * (E[ends[0]][i] + E[ends[1]][i]);
        }
        sss_dipole__integrate(w, q, q_E, 0.5 * A, plane);
    }
}

static void sss_dipole__near_block(sss_dipole__worker *w, size_t block)
{
    const sss_dipole_gather *g = w->g;
    size_t slot;
    int i, k;
    for (slot = SSS_DIPOLE__BLOCK * block; slot < SSS_DIPOLE__BLOCK * (block + 1); slot++)
    {
        double p[3][3], E[3][3], plane[3] = {0.0, 0.0, 0.0};
        if (g->area[slot] == 0.0f)
        {
            continue;
        }
        for (k = 0; k < 3; k++)
        {
            for (i = 0; i < 3; i++)
            {
                p[k][i] = ((double)g->corners[9 * slot + 3 * (size_t)k + (size_t)i] - w->position[i])
                          / g->unit_per_diagonal;
                E[k][i] = (double)g->corner_E[9 * slot + 3 * (size_t)k + (size_t)i];
            }
        }
        if (g->model.geometry == SSS_DIPOLE_PLACED)
        {
            sss_dipole__area_vector(p[0], p[1], p[2], plane);
            sss_dipole__normalize(plane);
        }
        sss_dipole__integrate(w, p, E, (double)g->area[slot], plane);
    }
    sss_dipole__flush(w);
}

typedef enum sss_dipole__rule
{
    SSS_DIPOLE__NONE,
    SSS_DIPOLE__ONE_POINT,
    SSS_DIPOLE__THREE_POINTS,
    SSS_DIPOLE__SUBDIVIDE
} sss_dipole__rule;

// Which rule integrates all triangles of a block (or of a group) well enough for this receiver.
static sss_dipole__rule sss_dipole__choose_rule(const sss_dipole__worker *w, const sss_dipole__block *block)
{
    const sss_dipole__model *m = &w->g->model;
    const sss_dipole__near *n = &w->g->near_table;
    const double center[3] = {(double)block->center[0], (double)block->center[1], (double)block->center[2]};
    const double far_distance = (double)block->far_distance, middle_distance = (double)block->middle_distance;
    const double edge = (double)block->edge;
    const double r = sss_dipole__distance(center, w->receiver) - (double)block->radius;
    sss_dipole__sight sight;
    double relative[3];
    int i;
    if (m->geometry == SSS_DIPOLE_DISTANCE)
    {
        const double s = sss_dipole__max(0.0, r);
        if (r >= far_distance)
        {
            return SSS_DIPOLE__ONE_POINT;
        }
        return sqrt(s * s + m->z_min * m->z_min) > middle_distance ? SSS_DIPOLE__THREE_POINTS : SSS_DIPOLE__SUBDIVIDE;
    }
    if (r >= far_distance + 2.0 * m->z_max)
    {
        return SSS_DIPOLE__ONE_POINT; // every source is farther than far_distance and its own z
    }
    for (i = 0; i < 3; i++)
    {
        relative[i] = center[i] - w->receiver[i];
    }
    sss_dipole__look(w, relative, (double)block->radius, &sight);
    if (sight.close || sight.nearest <= middle_distance || sight.intruding <= n->three_ratio * edge)
    {
        return SSS_DIPOLE__SUBDIVIDE;
    }
    return r >= far_distance && sight.intruding > n->one_ratio * edge ? SSS_DIPOLE__ONE_POINT
                                                                      : SSS_DIPOLE__THREE_POINTS;
}

// Whether a placed source comes so close to a block (or a group) that only the scalar path holds.
static int sss_dipole__comes_close(const sss_dipole__worker *w, const sss_dipole__block *block)
{
    const double relative[3] = {(double)block->center[0] - w->receiver[0], (double)block->center[1] - w->receiver[1],
                                (double)block->center[2] - w->receiver[2]};
    sss_dipole__sight sight;
    if (w->g->model.geometry == SSS_DIPOLE_DISTANCE)
    {
        return 0;
    }
    sss_dipole__look(w, relative, (double)block->radius, &sight);
    return sight.close;
}

// The blocks [begin, end) of a group whose samples are never subdivided.
static void sss_dipole__sum_samples(sss_dipole__worker *w, const sss_dipole__block *group, size_t begin, size_t end)
{
    const sss_dipole_gather *g = w->g;
    const int group_close = sss_dipole__comes_close(w, group);
    size_t b;
    for (b = begin; (group_close || group->partly_dark) && b < end; b++)
    {
        const int close = group_close && g->blocks[b].lit && sss_dipole__comes_close(w, &g->blocks[b]);
        if (close || !g->blocks[b].lit)
        {
            w->kernel(&g->model, &g->one, SSS_DIPOLE__BLOCK * begin, SSS_DIPOLE__BLOCK * b, w->receiver, w->sum);
            begin = b + 1;
        }
        if (close)
        {
            sss_dipole__kernel_scalar(&g->model, &g->one, SSS_DIPOLE__BLOCK * b, SSS_DIPOLE__BLOCK * (b + 1),
                                      w->receiver, w->sum);
        }
    }
    w->kernel(&g->model, &g->one, SSS_DIPOLE__BLOCK * begin, SSS_DIPOLE__BLOCK * end, w->receiver, w->sum);
}

// A block that is not far.
static void sss_dipole__gather_block(sss_dipole__worker *w, size_t b, sss_dipole__rule rule)
{
    const size_t first = 3 * SSS_DIPOLE__BLOCK * b;
    if (rule == SSS_DIPOLE__THREE_POINTS)
    {
        w->kernel(&w->g->model, &w->g->three, first, first + 3 * SSS_DIPOLE__BLOCK, w->receiver, w->sum);
    }
    else
    {
        sss_dipole__near_block(w, b);
    }
}

// One group of blocks for one receiver. Runs of far blocks go to the kernel whole; dark blocks are passed over.
static void sss_dipole__gather_group(sss_dipole__worker *w, size_t group)
{
    const sss_dipole_gather *g = w->g;
    const sss_dipole__block *whole = &g->groups[group];
    const size_t begin = SSS_DIPOLE__GROUP * group;
    const size_t end = begin + SSS_DIPOLE__GROUP < g->block_count ? begin + SSS_DIPOLE__GROUP : g->block_count;
    size_t b, first = begin;
    int far_away;
    if (!whole->lit)
    {
        return;
    }
    if (g->triangle_count == 0 || g->stats.point_sampling)
    {
        sss_dipole__sum_samples(w, whole, begin, end);
        return;
    }
    far_away = sss_dipole__choose_rule(w, whole) == SSS_DIPOLE__ONE_POINT;
    if (far_away && !whole->partly_dark)
    {
        w->kernel(&g->model, &g->one, SSS_DIPOLE__BLOCK * begin, SSS_DIPOLE__BLOCK * end, w->receiver, w->sum);
        return;
    }
    for (b = begin; b < end; b++)
    {
        const sss_dipole__rule rule = !g->blocks[b].lit ? SSS_DIPOLE__NONE
                                      : far_away ? SSS_DIPOLE__ONE_POINT
                                                 : sss_dipole__choose_rule(w, &g->blocks[b]);
        if (rule != SSS_DIPOLE__ONE_POINT)
        {
            w->kernel(&g->model, &g->one, SSS_DIPOLE__BLOCK * first, SSS_DIPOLE__BLOCK * b, w->receiver, w->sum);
            first = b + 1;
        }
        if (rule == SSS_DIPOLE__THREE_POINTS || rule == SSS_DIPOLE__SUBDIVIDE)
        {
            sss_dipole__gather_block(w, b, rule);
        }
    }
    w->kernel(&g->model, &g->one, SSS_DIPOLE__BLOCK * first, SSS_DIPOLE__BLOCK * end, w->receiver, w->sum);
}

static void sss_dipole__start_worker(const sss_dipole_gather *g, const sss_dipole_receivers *receivers, size_t row,
                                     sss_dipole__buffer *buffer, sss_dipole__worker *w)
{
    double n[3] = {0.0, 0.0, 0.0}, from_center = 0.0;
    int i;
    w->g = g;
    w->buffer = buffer;
    w->sum[0] = w->sum[1] = w->sum[2] = 0.0;
    if (g->model.geometry == SSS_DIPOLE_PLACED)
    {
        for (i = 0; i < 3; i++)
        {
            n[i] = (double)receivers->normals[3 * row + (size_t)i];
        }
        sss_dipole__normalize(n);
    }
    for (i = 0; i < 3; i++)
    {
        w->position[i] = (double)receivers->positions[3 * row + (size_t)i];
        w->receiver[i] = (w->position[i] - g->center[i]) / g->unit_per_diagonal;
        w->receiver[3 + i] = w->origin[3 + i] = n[i];
        w->origin[i] = 0.0;
        from_center += w->receiver[i] * w->receiver[i];
    }
    w->kernel = from_center <= SSS_DIPOLE__REACH * SSS_DIPOLE__REACH ? g->kernel : sss_dipole__kernel_scalar;
}

static void sss_dipole__gather_tile(const sss_dipole_gather *g, const sss_dipole_receivers *receivers, size_t begin,
                                    size_t end, float *radiosity)
{
    sss_dipole__worker worker[SSS_DIPOLE__TILE];
    sss_dipole__buffer buffer;
    const size_t count = end - begin;
    size_t group, k;
    int i;
    buffer.count = 0;
    for (i = 0; i < 6; i++)
    {
        buffer.samples.p[i] = buffer.value[i];
    }
    for (k = 0; k < count; k++)
    {
        sss_dipole__start_worker(g, receivers, begin + k, &buffer, &worker[k]);
    }
    for (group = 0; group < g->group_count; group++)
    {
        for (k = 0; k < count; k++)
        {
            sss_dipole__gather_group(&worker[k], group);
        }
    }
    for (k = 0; k < count; k++)
    {
        for (i = 0; i < 3; i++)
        {
            radiosity[3 * (begin + k) + (size_t)i] = (float)(worker[k].sum[i] * g->area_scale * g->irradiance_scale);
        }
    }
}

static sss_result sss_dipole__check_receivers(const sss_dipole_gather *g, const sss_dipole_receivers *receivers,
                                              size_t begin, size_t end, const float *radiosity)
{
    size_t k;
    if (g == NULL || receivers == NULL || receivers->positions == NULL || radiosity == NULL || begin > end
        || end > receivers->count || (g->model.geometry == SSS_DIPOLE_PLACED && receivers->normals == NULL))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    if (receivers->count == 0)
    {
        return SSS_ERROR_EMPTY;
    }
    if (receivers->count > SIZE_MAX / (3 * sizeof(float)))
    {
        return SSS_ERROR_OVERFLOW;
    }
    if (!sss_dipole__all_finite(receivers->positions + 3 * begin, 3 * (end - begin)))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (k = begin; g->model.geometry == SSS_DIPOLE_PLACED && k < end; k++)
    {
        const float *n = receivers->normals + 3 * k;
        if (!sss_dipole__all_finite(n, 3) || (n[0] == 0.0f && n[1] == 0.0f && n[2] == 0.0f))
        {
            return SSS_ERROR_INVALID_ARGUMENT;
        }
    }
    return SSS_OK;
}

static void sss_dipole__gather_rows(const sss_dipole_gather *g, const sss_dipole_receivers *receivers, size_t begin,
                                    size_t end, float *radiosity)
{
    while (begin < end)
    {
        const size_t next = end - begin > SSS_DIPOLE__TILE ? begin + SSS_DIPOLE__TILE : end;
        sss_dipole__gather_tile(g, receivers, begin, next, radiosity);
        begin = next;
    }
}

SSS_DIPOLE_API sss_result sss_dipole_gather_rows(const sss_dipole_gather *gather,
                                                 const sss_dipole_receivers *receivers, size_t begin, size_t end,
                                                 float *radiosity)
{
    const sss_result result = sss_dipole__check_receivers(gather, receivers, begin, end, radiosity);
    if (result == SSS_OK)
    {
        sss_dipole__gather_rows(gather, receivers, begin, end, radiosity);
    }
    return result;
}

typedef struct sss_dipole__job
{
    const sss_dipole_gather *gather;
    const sss_dipole_receivers *receivers;
    size_t first;
    float *radiosity;
} sss_dipole__job;

static void sss_dipole__task(void *context, size_t begin, size_t end)
{
    const sss_dipole__job *job = (const sss_dipole__job *)context;
    sss_dipole__gather_rows(job->gather, job->receivers, job->first + begin, job->first + end, job->radiosity);
}

// All rows at once, or in about a hundred steps between which progress is told and may cancel.
static sss_result sss_dipole__run_steps(const sss_dipole_gather *gather, const sss_dipole_receivers *receivers,
                                        float *radiosity)
{
    const sss_hooks *hooks = &gather->hooks;
    const size_t count = receivers->count;
    const size_t step = hooks->progress == NULL ? count : count / 100 > 256 ? count / 100 : 256;
    sss_dipole__job job;
    job.gather = gather;
    job.receivers = receivers;
    job.radiosity = radiosity;
    for (job.first = 0; job.first < count; job.first += step)
    {
        const size_t rows = count - job.first < step ? count - job.first : step;
        if (hooks->progress != NULL && hooks->progress(hooks->user, (double)job.first / (double)count) != 0)
        {
            return SSS_ERROR_CANCELLED;
        }
        if (hooks->parallel_for != NULL)
        {
            hooks->parallel_for(hooks->user, rows, sss_dipole__task, &job);
        }
        else
        {
            sss_dipole__task(&job, 0, rows);
        }
    }
    return hooks->progress != NULL && hooks->progress(hooks->user, 1.0) != 0 ? SSS_ERROR_CANCELLED : SSS_OK;
}

SSS_DIPOLE_API sss_result sss_dipole_gather_run(const sss_dipole_gather *gather,
                                                const sss_dipole_receivers *receivers, float *radiosity)
{
    const size_t count = receivers != NULL ? receivers->count : 0;
    sss_result result = sss_dipole__check_receivers(gather, receivers, 0, count, radiosity);
    float *draft;
    if (result != SSS_OK || gather->hooks.progress == NULL)
    {
        return result != SSS_OK ? result : sss_dipole__run_steps(gather, receivers, radiosity);
    }
    draft = (float *)sss_dipole__allocate(&gather->hooks, 3 * count * sizeof *draft);
    if (draft == NULL)
    {
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    result = sss_dipole__run_steps(gather, receivers, draft);
    if (result == SSS_OK)
    {
        memcpy(radiosity, draft, 3 * count * sizeof *draft);
    }
    sss_dipole__release(&gather->hooks, draft);
    return result;
}

// The mesh's normals where it has them and computed ones where they are missing or zero.
static sss_result sss_dipole__complete_normals(const sss_mesh *mesh, float *normals)
{
    const sss_result result = sss_dipole_vertex_normals(mesh, normals);
    size_t v;
    for (v = 0; result == SSS_OK && mesh->normals != NULL && v < mesh->vertex_count; v++)
    {
        const float *n = mesh->normals + 3 * v;
        if (n[0] != 0.0f || n[1] != 0.0f || n[2] != 0.0f)
        {
            memcpy(normals + 3 * v, n, 3 * sizeof *n);
        }
    }
    return result;
}

SSS_DIPOLE_API sss_result sss_dipole_shade(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                                           const sss_dipole_gather_options *options, const sss_hooks *hooks,
                                           float *radiosity)
{
    sss_dipole_receivers receivers;
    sss_dipole_gather *gather = NULL;
    float *normals = NULL;
    sss_result result;
    if (irradiance == NULL || radiosity == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    result = sss_dipole_gather_create(mesh, profile, options, hooks, &gather);
    if (result != SSS_OK)
    {
        return result;
    }
    if (gather->model.geometry == SSS_DIPOLE_PLACED)
    {
        normals = (float *)sss_dipole__allocate(&gather->hooks, 3 * mesh->vertex_count * sizeof *normals);
        result = normals != NULL ? sss_dipole__complete_normals(mesh, normals) : SSS_ERROR_OUT_OF_MEMORY;
    }
    receivers.positions = mesh->positions;
    receivers.normals = normals;
    receivers.count = mesh->vertex_count;
    if (result == SSS_OK)
    {
        result = sss_dipole_gather_set_irradiance(gather, SSS_DIPOLE_VERTICES, irradiance);
    }
    if (result == SSS_OK)
    {
        result = sss_dipole_gather_run(gather, &receivers, radiosity);
    }
    sss_dipole__release(&gather->hooks, normals);
    sss_dipole_gather_free(gather);
    return result;
}

// ---- 6. What a scene needs ----

// One channel of a scene: the errors of the candidates.
typedef struct sss_dipole__candidate
{
    sss_dipole__edge edge;
    double size;
} sss_dipole__candidate;

static double sss_dipole__edge_error(double integral, double size)
{
    return sss_dipole__min(1.0, sqrt(2.0 * integral / size));
}

// The spectrum relates the error to Lambert's B, which may hold more than the true one: |B| >= |B_L| - |B - B_L|.
static double sss_dipole__lambert_error(const sss_dipole__candidate *c)
{
    const double e = sss_dipole__edge_error(sss_dipole__integrate_edge(&c->edge, sss_dipole__lambert_integrand),
                                            c->size);
    return e < 0.5 ? e / (1.0 - e) : 1.0;
}

static double sss_dipole__interpolation_error(const sss_dipole__candidate *c, double spacing)
{
    sss_dipole__edge edge = c->edge;
    edge.spacing = spacing;
    return sss_dipole__edge_error(sss_dipole__integrate_edge(&edge, sss_dipole__interpolation_integrand), c->size);
}

// The larger of the two errors that a sample spacing causes; rises with the spacing.
static double sss_dipole__spacing_error(const void *context, double spacing)
{
    const sss_dipole__candidate *c = (const sss_dipole__candidate *)context;
    const double diagonal = SSS_DIPOLE__SQRT3 * c->size; // at most
    return sss_dipole__max(sss_dipole__interpolation_error(c, spacing),
                           sss_dipole__sampling_error_of(c->edge.sigma, c->edge.z_r, c->edge.z_v, spacing, diagonal));
}

static int sss_dipole__valid_scene(const sss_dipole_scene *s)
{
    const double lengths[5] = {s->size_mm, s->thickness_mm, s->area_mm2, s->spacing_mm, s->pixel_mm};
    int i;
    const double limits[5] = {s->volume_mm3, s->speed, s->frame_budget_ms, s->precompute_budget_s, s->memory_budget};
    const double errors[2] = {s->tolerance, s->lambert_error};
    for (i = 0; i < 5; i++)
    {
        if (!sss_dipole__in_range(lengths[i], 0.0, 1e100) || !sss_dipole__in_range(limits[i], 0.0, 1e300))
        {
            return 0;
        }
    }
    for (i = 0; i < 2; i++)
    {
        if (!sss_dipole__finite(errors[i]) || errors[i] < 0.0)
        {
            return 0;
        }
    }
    return s->size_mm > 0.0 && s->tolerance < 1.0 && s->threads >= 0 && s->changes <= 7u
           && s->lighting >= SSS_DIPOLE_LIGHTING_ANY && s->lighting <= SSS_DIPOLE_LIGHTING_EVEN
           && s->geometries >= SSS_DIPOLE_EITHER_GEOMETRY && s->geometries <= SSS_DIPOLE_ONLY_PLACED;
}

static void sss_dipole__advise_channel(const sss_profile *p, int i, const sss_dipole_scene *s, double tolerance,
                                       sss_dipole_advice *a)
{
    const double total = sss_dipole_total(p, i);
    sss_dipole__candidate c;
    double spacing;
    if (!(total > 0.0))
    {
        return;
    }
    c.size = s->size_mm;
    c.edge.sigma = p->sigma_tr[i];
    c.edge.z_r = p->z_r[i];
    c.edge.z_v = p->z_v[i];
    c.edge.smooth = s->spacing_mm;
    c.edge.pixel = s->pixel_mm;
    c.edge.spacing = s->spacing_mm;
    spacing = sss_dipole__bisect(sss_dipole__spacing_error, &c, tolerance, 1e-6 * p->z_r[i], 1e6 * p->z_r[i], 1e-4);
    a->lambert_error = sss_dipole__max(a->lambert_error, sss_dipole__lambert_error(&c));
    a->crossing = sss_dipole__max(a->crossing, sss_dipole_flux_beyond(p, i, s->thickness_mm) / total);
    a->radius_mm = sss_dipole__max(a->radius_mm, sss_dipole_radius(p, i, 1.0 - tolerance));
    a->spacing_mm = sss_dipole__min(a->spacing_mm, spacing);
    if (s->spacing_mm > 0.0)
    {
        a->spacing_error = sss_dipole__max(a->spacing_error, sss_dipole__spacing_error(&c, s->spacing_mm));
    }
}

// What part of the flux a radius leaves out, in the worst channel.
static double sss_dipole__left_out(const sss_profile *p, double radius)
{
    double worst = 0.0;
    int i;
    for (i = 0; i < 3; i++)
    {
        const double total = sss_dipole_total(p, i);
        if (total > 0.0)
        {
            worst = sss_dipole__max(worst, sss_dipole_flux_beyond(p, i, radius) / total);
        }
    }
    return worst;
}

static void sss_dipole__decide(const sss_profile *p, const sss_dipole_scene *s, double tolerance, sss_dipole_advice *a)
{
    if (a->lambert_error <= tolerance)
    {
        a->need = SSS_DIPOLE_NEED_LAMBERT;
        a->predicted_error = a->lambert_error;
        snprintf(a->reason, sizeof a->reason,
                 "scattering is invisible: Lambert with the total reflectance is off by %.3g (relative L2, a shadow "
                 "edge across the object)", a->lambert_error);
    }
    else if (a->crossing <= tolerance)
    {
        a->need = SSS_DIPOLE_NEED_LOCAL;
        a->predicted_error = sss_dipole__left_out(p, a->radius_mm);
        snprintf(a->reason, sizeof a->reason,
                 "scattering is local: %.3g of the light crosses %.3g mm, and a radius of %.3g mm holds the rest",
                 a->crossing, s->thickness_mm, a->radius_mm);
    }
    else
    {
        a->need = SSS_DIPOLE_NEED_GLOBAL;
        a->predicted_error = 0.0; // nothing is left out
        snprintf(a->reason, sizeof a->reason, "light crosses the object: %.3g of it reaches farther than %.3g mm",
                 a->crossing, s->thickness_mm);
    }
}

// Where the area vectors of all triangles come to more than this share of the area, the mesh is open. Below, holes of
// that area make the volume wrong by about as large a share of it.
#define SSS_DIPOLE__OPEN 0.02

// ---- the error of the model ----

// Relative error of the dipole's total reflectance on a half space, normal incidence, against the exact solution
// (Chandrasekhar's H function with Fresnel feedback, isotropic scattering; 7 digits), and none at alpha' = 1.
#define SSS_DIPOLE__ALBEDOS 12
static const double sss_dipole__albedos[SSS_DIPOLE__ALBEDOS] = {0.1,  0.3,  0.5,  0.7,   0.8,   0.9,
                                                               0.95, 0.98, 0.99, 0.995, 0.999, 1.0};
static const double sss_dipole__etas[3] = {1.0, 1.3, 1.5};
static const double sss_dipole__albedo_errors[3][SSS_DIPOLE__ALBEDOS] = {
    {-0.3442, -0.2953, -0.2380, -0.1672, -0.1236, -0.0708, -0.0386, -0.0162, -0.0080, -0.0037, -0.0004, 0.0},
    {0.1797, 0.1867, 0.1737, 0.1276, 0.0861, 0.0291, -0.0028, -0.0174, -0.0182, -0.0158, -0.0087, 0.0},
    {0.6550, 0.6459, 0.5963, 0.4734, 0.3636, 0.1992, 0.0891, 0.0172, -0.0036, -0.0105, -0.0092, 0.0}};

// Linear in sqrt(1 - alpha'), in which totals are smooth at 1 (sigma_tr z_r = sqrt(3 (1 - alpha'))), and in eta.
static double sss_dipole__albedo_error(double alpha_p, double eta)
{
    const int e = eta > sss_dipole__etas[1];
    const double low = sss_dipole__etas[e], high = sss_dipole__etas[e + 1];
    const double t = sss_dipole__min(1.0, sss_dipole__max(0.0, (eta - low) / (high - low)));
    const double u = sqrt(1.0 - sss_dipole__max(alpha_p, sss_dipole__albedos[0]));
    double u_i, u_j, s;
    int i = 0;
    while (i < SSS_DIPOLE__ALBEDOS - 2 && alpha_p > sss_dipole__albedos[i + 1])
    {
        i++;
    }
    u_i = sqrt(1.0 - sss_dipole__albedos[i]);
    u_j = sqrt(1.0 - sss_dipole__albedos[i + 1]);
    s = (u_i - u) / (u_i - u_j);
    return (1.0 - t) * ((1.0 - s) * sss_dipole__albedo_errors[e][i] + s * sss_dipole__albedo_errors[e][i + 1])
           + t * ((1.0 - s) * sss_dipole__albedo_errors[e + 1][i] + s * sss_dipole__albedo_errors[e + 1][i + 1]);
}

// The reflectance of a slab of thickness d over that of the half space, by all images of the dipole: with z_b =
// (z_v - z_r)/2, sinh(s (d + z_b - z_r))/sinh(s (d + 2 z_b)) exp(s (z_r + z_b)). A slab so thin that the real source
// lies beyond its other side's image is outside diffusion: the floor stands for "far off".
#define SSS_DIPOLE__THINNEST 0.1
static double sss_dipole__slab_ratio(double sigma, double z_r, double z_v, double d)
{
    const double z_b = 0.5 * (z_v - z_r), a = d + z_b - z_r, b = d + 2.0 * z_b;
    const double ratio = sigma * b > 1e-12 ? expm1(-2.0 * sigma * a) / expm1(-2.0 * sigma * b) : a / b;
    return sss_dipole__max(SSS_DIPOLE__THINNEST, ratio);
}

// Of both, as a root mean square over the channels, each with its radiosity's weight. thickness: as given, or the mean
// one of a closed mesh, 2 volume/area, or else the size. Besides, the profile is off where light changes along the
// surface: by a share of what scattering does there at all, which is Lambert's error. The share is what the chart's
// random walk says of thick objects (model_l2 of tests/chart/chart.csv, bunny in marble and skim milk: 0.6 to 0.8).
#define SSS_DIPOLE__PROFILE_SHARE 0.7
static double sss_dipole__model_error(const sss_profile *p, const sss_dipole_scene *s, double lambert_error)
{
    const double mean = s->volume_mm3 > 0.0 && s->area_mm2 > 0.0 ? 2.0 * s->volume_mm3 / s->area_mm2 : s->size_mm;
    const double thickness = s->thickness_mm > 0.0 ? s->thickness_mm : mean;
    double sum = 0.0, weight = 0.0;
    int i;
    for (i = 0; i < 3; i++)
    {
        const double R = sss_dipole_total(p, i);
        if (R > 0.0)
        {
            const double slab = sss_dipole__slab_ratio(p->sigma_tr[i], p->z_r[i], p->z_v[i], thickness);
            const double error = (1.0 + sss_dipole__albedo_error(p->alpha_p[i], p->eta)) / slab - 1.0;
            sum += R * R * error * error;
            weight += R * R;
        }
    }
    return weight > 0.0 ? hypot(sqrt(sum / weight), SSS_DIPOLE__PROFILE_SHARE * lambert_error) : 0.0;
}

// ---- the ranking ----

// What a curve predicts. Each is a law times the variant's scale times exp(slopes . features).
enum
{
    SSS_DIPOLE__ERROR = 0,
    SSS_DIPOLE__PRECOMPUTE, // s
    SSS_DIPOLE__FRAME,      // ms
    SSS_DIPOLE__REBUILD,    // ms
    SSS_DIPOLE__BYTES,
    SSS_DIPOLE__QUANTITIES,
    SSS_DIPOLE__FEATURES = 8
};

// A method with its knob, as the chart has run it. How errors depend on the features differs from knob to knob.
typedef struct sss_dipole__variant
{
    sss_dipole_method method;
    double tolerance, density;
    int directions, storage;
    double scale[SSS_DIPOLE__QUANTITIES];
    double lean[SSS_DIPOLE__FEATURES]; // added to the slopes of the error
} sss_dipole__variant;

// ---- BEGIN measured curves: tests/chart/choice/fit.sh --write makes these lines from tests/chart/chart.csv ----
// 600 runs on 20 cases
// Method, tolerance, density, directions, storage, then the scales of error, s, ms, ms and bytes;
// below how its error leans.
static const sss_dipole__variant sss_dipole__variants[] = {
    {SSS_DIPOLE_METHOD_LAMBERT, 0, 1, 0, 0, {2.02e+01, 0.00e+00, 1.07e-04, 0.00e+00, 0.00e+00},
     {0.097, 0.065, -0.018, -0.087, 0.346, -0.126, -0.007, -0.049}},
    {SSS_DIPOLE_METHOD_DIRECT, 0.0001, 1, 0, 0, {4.42e-01, 1.60e-06, 9.86e-06, 1.57e-03, 1.92e+02},
     {-0.119, -0.440, -0.040, 0.219, 0.870, -0.053, 0.073, -0.036}},
    {SSS_DIPOLE_METHOD_DIRECT, 0.001, 1, 0, 0, {2.26e+00, 1.47e-06, 7.56e-06, 1.60e-03, 1.92e+02},
     {0.338, 0.149, -0.124, -0.147, -0.141, 0.075, -0.206, -0.187}},
    {SSS_DIPOLE_METHOD_DIRECT, 0.01, 1, 0, 0, {6.75e-01, 1.51e-06, 6.05e-06, 1.49e-03, 1.92e+02},
     {-0.243, 0.207, 0.122, -0.027, -0.748, -0.212, 0.161, 0.182}},
    {SSS_DIPOLE_METHOD_POINTS, 0.001, 1, 0, 0, {2.89e+00, 1.06e-06, 1.71e-06, 1.49e-03, 6.02e+01},
     {-0.178, 0.137, 0.525, 0.293, 1.361, -1.361, 0.276, 1.044}},
    {SSS_DIPOLE_METHOD_POINTS, 0.001, 0.25, 0, 0, {1.12e+01, 3.12e-06, 1.87e-06, 5.94e-04, 6.27e+01},
     {-0.517, -0.448, -0.029, 0.024, -0.856, -0.897, 0.182, 0.193}},
    {SSS_DIPOLE_METHOD_POINTS, 0.001, 0.0625, 0, 0, {4.89e+00, 1.48e-06, 1.94e-06, 3.45e-04, 6.96e+01},
     {0.538, -0.198, 0.059, -0.392, 0.067, -0.262, -0.491, 0.096}},
    {SSS_DIPOLE_METHOD_POINTS, 0.001, 0.015625, 0, 0, {4.19e+00, 1.75e-06, 1.97e-06, 2.86e-04, 9.81e+01},
     {0.849, 0.273, -0.154, -0.328, 0.796, 1.158, -0.203, -0.913}},
    {SSS_DIPOLE_METHOD_PLACED, 0.001, 1, 0, 0, {2.66e+00, 2.13e-06, 3.21e-05, 3.15e-03, 1.92e+02},
     {-0.007, -0.326, 0.192, 0.163, 0.382, -0.962, 0.012, 0.221}},
    {SSS_DIPOLE_METHOD_PLACED, 0.01, 1, 0, 0, {2.89e+00, 2.22e-06, 2.73e-05, 3.24e-03, 1.92e+02},
     {0.150, 0.227, 0.043, -0.189, 1.151, -0.618, 0.324, 0.077}},
    {SSS_DIPOLE_METHOD_BEM, 0.001, 1, 0, 0, {4.76e+00, 1.03e-05, 2.46e-02, 8.01e-04, 9.25e+02},
     {-0.006, 0.010, -0.073, -0.019, 0.392, -0.190, 0.081, -0.068}},
    {SSS_DIPOLE_METHOD_BEM, 0.003, 1, 0, 0, {4.49e+00, 8.73e-06, 1.55e-02, 7.81e-04, 9.25e+02},
     {-0.097, 0.038, 0.106, -0.003, 0.129, -0.028, -0.102, 0.045}},
    {SSS_DIPOLE_METHOD_BEM, 0.01, 1, 0, 0, {2.62e+00, 7.40e-06, 9.03e-03, 7.91e-04, 9.25e+02},
     {0.169, -0.216, 0.051, 0.122, -0.672, 0.496, -0.492, -0.200}},
    {SSS_DIPOLE_METHOD_BEM, 0.03, 1, 0, 0, {1.86e+00, 7.00e-06, 5.82e-03, 8.41e-04, 9.25e+02},
     {0.125, -0.411, -0.001, 0.267, -1.728, 0.958, -0.295, -0.390}},
    {SSS_DIPOLE_METHOD_BEM, 0.1, 1, 0, 0, {1.64e+01, 6.95e-06, 4.01e-03, 8.36e-04, 9.25e+02},
     {0.002, 0.458, -0.249, -0.270, 0.795, -0.276, 0.246, -0.469}},
    {SSS_DIPOLE_METHOD_BEM_RENDER, 0.001, 1, 0, 0, {4.76e+00, 1.17e-04, 7.78e-03, 9.81e-02, 4.43e+04},
     {-0.006, 0.010, -0.073, -0.019, 0.392, -0.190, 0.081, -0.068}},
    {SSS_DIPOLE_METHOD_BEM_RENDER, 0.003, 1, 0, 0, {4.49e+00, 5.57e-05, 5.06e-03, 5.75e-02, 2.78e+04},
     {-0.097, 0.038, 0.106, -0.003, 0.129, -0.028, -0.102, 0.045}},
    {SSS_DIPOLE_METHOD_BEM_RENDER, 0.01, 1, 0, 0, {2.62e+00, 3.60e-05, 2.90e-03, 3.20e-02, 1.34e+04},
     {0.169, -0.216, 0.051, 0.122, -0.672, 0.496, -0.492, -0.200}},
    {SSS_DIPOLE_METHOD_BEM_RENDER, 0.03, 1, 0, 0, {1.86e+00, 2.70e-05, 2.09e-03, 1.98e-02, 9.32e+03},
     {0.125, -0.411, -0.001, 0.267, -1.728, 0.958, -0.295, -0.390}},
    {SSS_DIPOLE_METHOD_BEM_RENDER, 0.1, 1, 0, 0, {1.64e+01, 2.19e-05, 1.65e-03, 1.38e-02, 6.96e+03},
     {0.002, 0.458, -0.249, -0.270, 0.795, -0.276, 0.246, -0.469}},
    {SSS_DIPOLE_METHOD_HAO, 0.005, 1, 1026, 0, {1.14e-03, 7.67e-04, 1.47e-05, 7.67e-01, 2.13e+02},
     {0.485, -0.261, 0.111, 0.219, -0.686, 0.653, -0.196, 0.196}},
    {SSS_DIPOLE_METHOD_HAO, 0.005, 1, 1026, 2, {1.77e-03, 7.73e-04, 1.61e-04, 7.73e-01, 3.37e+03},
     {0.387, -0.161, -0.035, 0.028, -0.343, 0.309, -0.367, 0.367}},
    {SSS_DIPOLE_METHOD_HAO, 0.005, 1, 1026, 3, {1.33e-03, 5.18e-04, 1.87e-04, 5.18e-01, 1.35e+04},
     {0.632, -0.191, -0.074, 0.060, -0.338, 0.514, -0.465, 0.465}},
    {SSS_DIPOLE_METHOD_HAO, 0.005, 1, 402, 0, {1.53e-02, 3.69e-04, 1.25e-05, 3.69e-01, 1.06e+02},
     {-0.043, 0.193, 0.025, -0.132, 0.211, -0.228, 0.173, -0.173}},
    {SSS_DIPOLE_METHOD_HAO, 0.005, 1, 402, 2, {1.92e-02, 3.48e-04, 1.21e-04, 3.48e-01, 1.33e+03},
     {-0.153, 0.230, -0.013, -0.208, 0.398, -0.403, 0.082, -0.082}},
    {SSS_DIPOLE_METHOD_HAO, 0.005, 1, 402, 3, {1.90e-02, 2.49e-04, 1.28e-04, 2.49e-01, 5.30e+03},
     {-0.153, 0.227, -0.023, -0.198, 0.358, -0.391, 0.105, -0.105}},
    {SSS_DIPOLE_METHOD_HAO, 0.005, 1, 198, 0, {3.39e-02, 2.47e-04, 1.01e-05, 2.47e-01, 7.16e+01},
     {-0.245, 0.223, -0.012, -0.173, 0.039, -0.359, 0.300, -0.300}},
    {SSS_DIPOLE_METHOD_HAO, 0.005, 1, 198, 2, {3.66e-02, 2.26e-04, 5.90e-05, 2.26e-01, 6.53e+02},
     {-0.267, 0.239, -0.021, -0.204, 0.124, -0.439, 0.265, -0.265}},
    {SSS_DIPOLE_METHOD_HAO, 0.005, 1, 198, 3, {3.59e-02, 1.72e-04, 9.04e-05, 1.72e-01, 2.61e+03},
     {-0.280, 0.232, -0.027, -0.194, 0.094, -0.422, 0.285, -0.285}},
};
static const double sss_dipole__slopes[SSS_DIPOLE_METHOD_COUNT][SSS_DIPOLE__QUANTITIES][SSS_DIPOLE__FEATURES] = {
    // lambert
    {{0.658, 0.926, 0.076, -0.858, 1.308, 0.147, -0.228, -0.926},
     {0.000, 0.000, 0.000, 0.000, 0.000, 0.000, 0.000, 0.000},
     {0.059, 0.015, -0.084, -0.008, -0.086, 0.013, 0.000, 0.000},
     {0.000, 0.000, 0.000, 0.000, 0.000, 0.000, 0.000, 0.000},
     {0.000, 0.000, 0.000, 0.000, 0.000, 0.000, 0.000, 0.000}},
    // direct
    {{-0.147, 0.388, -0.026, -0.199, -0.954, -0.051, 0.089, 0.135},
     {0.006, 0.131, -0.025, -0.137, 0.401, -0.380, 0.000, 0.000},
     {0.147, 0.373, -0.107, -0.354, -1.152, 1.064, 0.000, 0.000},
     {-0.016, 0.144, -0.015, -0.183, 0.286, -0.277, 0.000, 0.000},
     {-0.002, 0.001, 0.000, -0.001, 0.002, -0.002, 0.000, 0.000}},
    // direct-points
    {{1.742, 0.377, -1.056, -0.551, -0.970, 1.917, -0.800, -2.110},
     {-0.187, 0.070, 0.017, -0.071, 0.491, -0.336, 0.000, 0.000},
     {0.329, 0.152, -0.036, -0.196, -0.267, 0.295, 0.000, 0.000},
     {-0.300, 0.177, 0.026, -0.171, 0.201, -0.115, 0.000, 0.000},
     {-0.094, 0.062, 0.004, -0.045, 0.131, -0.089, 0.000, 0.000}},
    // direct-placed
    {{-0.383, 1.024, -0.165, 0.061, 4.352, -2.846, -0.543, -0.313},
     {0.071, 0.293, -0.095, -0.197, 0.416, -0.078, 0.000, 0.000},
     {-0.050, 0.493, -0.160, -0.476, -0.268, 0.687, 0.000, 0.000},
     {0.013, 0.392, -0.086, -0.255, 0.987, -0.549, 0.000, 0.000},
     {-0.003, 0.001, 0.000, -0.001, 0.000, 0.000, 0.000, 0.000}},
    // bem
    {{0.521, 0.411, -0.397, -0.154, -3.027, 0.985, -0.319, -0.880},
     {0.164, 0.179, 0.071, -0.266, -0.136, 0.449, 0.000, 0.000},
     {0.340, 0.470, 0.055, -0.496, -2.863, 2.904, 0.000, 0.000},
     {0.238, 0.089, 0.041, -0.109, -0.014, 0.348, 0.000, 0.000},
     {0.026, -0.004, 0.004, -0.002, -0.017, 0.032, 0.000, 0.000}},
    // bem-render
    {{0.521, 0.411, -0.397, -0.154, -3.027, 0.985, -0.319, -0.880},
     {0.194, 0.441, 0.105, -0.526, -0.508, 0.685, 0.000, 0.000},
     {0.244, 0.319, 0.084, -0.416, -0.403, 0.198, 0.000, 0.000},
     {0.139, 0.559, 0.148, -0.577, -0.794, 0.749, 0.000, 0.000},
     {-0.002, 0.226, 0.103, -0.287, -0.439, -0.015, 0.000, 0.000}},
    // hao
    {{0.093, 0.203, -0.136, 0.067, -0.159, 0.146, 1.269, -1.269},
     {0.053, 0.278, 0.006, -0.315, 0.581, -0.309, 0.000, 0.000},
     {0.314, -0.220, -0.421, 0.224, -4.842, 4.140, 0.000, 0.000},
     {0.053, 0.278, 0.006, -0.315, 0.581, -0.309, 0.000, 0.000},
     {-0.067, 0.010, -0.002, -0.008, 0.024, -0.017, 0.000, 0.000}},
};
static const double sss_dipole__ranges[4][2] = {{0.211, 2.305}, {-5.776, 1.510}, {0.000, 3.617}, {-1.967, 3.837}};
// ---- END measured curves ----

// All of it.
typedef struct sss_dipole__curves
{
    const sss_dipole__variant *variants;
    size_t variant_count;
    const double (*slopes)[SSS_DIPOLE__QUANTITIES][SSS_DIPOLE__FEATURES]; // [SSS_DIPOLE_METHOD_COUNT]
    const double (*ranges)[2];                                            // [4] of the first features, in the chart
} sss_dipole__curves;

// A tenth beyond the chart's border, in its logarithm, is still within.
#define SSS_DIPOLE__BORDER 0.1

// What the curves go by.
typedef struct sss_dipole__traits
{
    const sss_profile *profile;
    const sss_dipole__curves *curves;
    double V, T;     // vertices, triangles
    double h, size;  // mean edge, largest extent, mm
    double lambert;  // predicted error of Lambert
    double feature[SSS_DIPOLE__FEATURES];
} sss_dipole__traits;

// Means over the channels weighted by their total reflectance: of ln(z_r + z_v), how far light goes sideways, and of
// sigma_tr.
static void sss_dipole__mean_paths(const sss_profile *p, double *path, double *sigma)
{
    double sum = 0.0, weight = 0.0;
    int i;
    *sigma = 0.0;
    for (i = 0; i < 3; i++)
    {
        const double R = sss_dipole_total(p, i);
        if (R > 0.0)
        {
            sum += R * log(p->z_r[i] + p->z_v[i]);
            *sigma += R * p->sigma_tr[i];
            weight += R;
        }
    }
    *path = weight > 0.0 ? exp(sum / weight) : 0.0;
    *sigma = weight > 0.0 ? *sigma / weight : 0.0;
}

// Equilateral triangles of edge h cover sqrt(3)/4 h^2 each.
static void sss_dipole__count_elements(const sss_dipole_scene *s, const sss_dipole_advice *a, sss_dipole__traits *t)
{
    const double unit = 0.25 * SSS_DIPOLE__SQRT3;
    const double spacing = s->spacing_mm > 0.0 ? s->spacing_mm
                                               : sss_dipole__min(s->size_mm, a->spacing_mm); // no mesh yet: a fine one
    t->T = s->triangle_count > 0 ? (double)s->triangle_count
                                 : sss_dipole__max(4.0, s->area_mm2 / (unit * spacing * spacing));
    t->V = s->vertex_count > 0 ? (double)s->vertex_count : 0.5 * t->T;
    t->h = s->spacing_mm > 0.0 ? s->spacing_mm : sqrt(s->area_mm2 / (unit * t->T));
    t->size = s->size_mm;
}

// The features, ln of: V over ten thousand, edge over path, 1 + size sigma_tr, mean chord 4 volume/area over path; how
// far the second and the fourth are from the middle of what the chart has, squared, 1 at its border; then two that are
// 1 under distant light and under even light. Beyond what the chart has they stay at its border.
static int sss_dipole__take_features(const sss_dipole_scene *s, double path, double sigma, sss_dipole__traits *t)
{
    const double ball = s->area_mm2 * sqrt(s->area_mm2) / (6.0 * sqrt(SSS_DIPOLE__PI));
    const double chord = 4.0 * (s->volume_mm3 > 0.0 ? s->volume_mm3 : ball) / s->area_mm2;
    int i, beyond = 0;
    t->feature[0] = log(t->V / 1e4);
    t->feature[1] = log(t->h / path);
    t->feature[2] = log(1.0 + s->size_mm * sigma);
    t->feature[3] = log(chord / path);
    t->feature[6] = s->lighting == SSS_DIPOLE_LIGHTING_DISTANT ? 1.0 : 0.0;
    t->feature[7] = s->lighting == SSS_DIPOLE_LIGHTING_EVEN ? 1.0 : 0.0;
    for (i = 0; i < 4; i++)
    {
        const double x = t->feature[i], *range = t->curves->ranges[i];
        t->feature[i] = sss_dipole__min(range[1], sss_dipole__max(range[0], x));
        beyond |= x < range[0] - SSS_DIPOLE__BORDER || x > range[1] + SSS_DIPOLE__BORDER;
    }
    for (i = 0; i < 2; i++)
    {
        const double *range = t->curves->ranges[2 * i + 1], half = 0.5 * (range[1] - range[0]);
        const double u = half > 0.0 ? (t->feature[2 * i + 1] - range[0]) / half - 1.0 : 0.0;
        t->feature[4 + i] = u * u;
    }
    return beyond;
}

// Point samples at the spacing of a thinned copy; the worst channel.
static double sss_dipole__points_error(const sss_dipole__traits *t, double density)
{
    const double spacing = t->h / sqrt(density);
    const sss_profile *p = t->profile;
    double worst = 0.0;
    int i;
    for (i = 0; i < 3; i++)
    {
        if (sss_dipole_total(p, i) > 0.0)
        {
            worst = sss_dipole__max(worst, sss_dipole__sampling_error_of(p->sigma_tr[i], p->z_r[i], p->z_v[i], spacing,
                                                                         SSS_DIPOLE__SQRT3 * t->size));
        }
    }
    return worst;
}

// What a quantity is proportional to, to first order: the features say how far it is not.
static double sss_dipole__law(const sss_dipole__variant *v, int quantity, const sss_dipole__traits *t)
{
    const int gathers = v->method == SSS_DIPOLE_METHOD_DIRECT || v->method == SSS_DIPOLE_METHOD_POINTS
                        || v->method == SSS_DIPOLE_METHOD_PLACED;
    switch (quantity)
    {
    case SSS_DIPOLE__ERROR:
        return v->method == SSS_DIPOLE_METHOD_LAMBERT  ? t->lambert
               : v->method == SSS_DIPOLE_METHOD_POINTS ? sss_dipole__points_error(t, v->density)
               : v->method == SSS_DIPOLE_METHOD_HAO    ? 1.0
                                                       : v->tolerance;
    case SSS_DIPOLE__FRAME:
        return gathers ? t->V * t->T * v->density : t->V; // every pair; a bounded number of clusters or lights each
    case SSS_DIPOLE__PRECOMPUTE:
    case SSS_DIPOLE__REBUILD:
        return v->method == SSS_DIPOLE_METHOD_LAMBERT ? 0.0 : gathers ? t->T : t->V;
    case SSS_DIPOLE__BYTES:
        return v->method == SSS_DIPOLE_METHOD_LAMBERT ? 0.0 : gathers ? t->T * v->density : t->V;
    default: return 0.0;
    }
}

static double sss_dipole__curve(const sss_dipole__variant *v, int quantity, const sss_dipole__traits *t)
{
    const double *slopes = t->curves->slopes[v->method][quantity];
    double exponent = 0.0;
    int i;
    for (i = 0; i < SSS_DIPOLE__FEATURES; i++)
    {
        exponent += (slopes[i] + (quantity == SSS_DIPOLE__ERROR ? v->lean[i] : 0.0)) * t->feature[i];
    }
    return sss_dipole__law(v, quantity, t) * v->scale[quantity] * exp(exponent);
}

// The chart's integrals are without shadows. With them the error of hao's interpolation between lights is up to 2.7
// times as large (tests/chart/hao/bars.csv: 198 directions, bunny of 20, 50, 100 mm: 2.0, 2.4, 2.6). Lambert's error
// under a shadow edge is at least the one derived for it above.
#define SSS_DIPOLE__SHADOWED 2.7
static double sss_dipole__choice_error(const sss_dipole__variant *v, const sss_dipole_scene *s,
                                       const sss_dipole__traits *t)
{
    const double error = sss_dipole__curve(v, SSS_DIPOLE__ERROR, t);
    if (v->method == SSS_DIPOLE_METHOD_LAMBERT)
    {
        return s->lambert_error > 0.0 ? s->lambert_error
               : s->lighting == SSS_DIPOLE_LIGHTING_ANY ? sss_dipole__max(error, t->lambert) : error;
    }
    return v->method == SSS_DIPOLE_METHOD_HAO && s->lighting == SSS_DIPOLE_LIGHTING_ANY ? SSS_DIPOLE__SHADOWED * error
                                                                                       : error;
}

static void sss_dipole__predict_choice(const sss_dipole__variant *v, const sss_dipole_scene *s,
                                       const sss_dipole__traits *t, sss_dipole_choice *c)
{
    const double pace = (s->threads > 0 ? (double)s->threads : 1.0) * (s->speed > 0.0 ? s->speed : 1.0);
    const unsigned again = SSS_DIPOLE_CHANGES_GEOMETRY | SSS_DIPOLE_CHANGES_MATERIAL;
    memset(c, 0, sizeof *c);
    c->method = v->method;
    c->tolerance = v->tolerance;
    c->density = v->density;
    c->directions = (size_t)v->directions;
    c->storage = v->storage;
    c->predicted_error = sss_dipole__choice_error(v, s, t);
    c->precompute_s = sss_dipole__curve(v, SSS_DIPOLE__PRECOMPUTE, t) / pace;
    c->frame_ms = sss_dipole__curve(v, SSS_DIPOLE__FRAME, t) / pace;
    c->rebuild_ms = sss_dipole__curve(v, SSS_DIPOLE__REBUILD, t) / pace;
    c->bytes = sss_dipole__curve(v, SSS_DIPOLE__BYTES, t);
    c->cost_ms = c->frame_ms + (s->changes == 0u ? 1e3 * c->precompute_s : s->changes & again ? c->rebuild_ms : 0.0);
}

// 0: meets tolerance and budgets, 1: budgets only, 2: over a budget.
static int sss_dipole__standing(const sss_dipole_choice *c, const sss_dipole_scene *s)
{
    const int over = (s->frame_budget_ms > 0.0 && s->changes != 0u && c->cost_ms > s->frame_budget_ms)
                     || (s->precompute_budget_s > 0.0 && c->precompute_s > s->precompute_budget_s)
                     || (s->memory_budget > 0.0 && c->bytes > s->memory_budget);
    return over ? 2 : c->predicted_error > s->tolerance;
}

static int sss_dipole__is_better(const sss_dipole_choice *a, const sss_dipole_choice *b, const sss_dipole_scene *s)
{
    const int of_a = sss_dipole__standing(a, s), of_b = sss_dipole__standing(b, s);
    if (of_a != of_b)
    {
        return of_a < of_b;
    }
    return of_a == 1 ? a->predicted_error < b->predicted_error : a->cost_ms < b->cost_ms;
}

static int sss_dipole__may_rank(sss_dipole_method method, const sss_dipole_scene *s)
{
    const int placed = method == SSS_DIPOLE_METHOD_PLACED || method == SSS_DIPOLE_METHOD_BEM
                       || method == SSS_DIPOLE_METHOD_BEM_RENDER;
    return !(s->left_out >> (unsigned)method & 1u)
           && (method == SSS_DIPOLE_METHOD_LAMBERT || s->geometries == SSS_DIPOLE_EITHER_GEOMETRY
               || placed == (s->geometries == SSS_DIPOLE_ONLY_PLACED));
}

// One entry for each method, kept in order.
static void sss_dipole__enter(const sss_dipole_choice *c, const sss_dipole_scene *s, sss_dipole_advice *a)
{
    size_t i = 0;
    while (i < a->ranking_count && a->ranking[i].method != c->method)
    {
        i++;
    }
    if (i < a->ranking_count && !sss_dipole__is_better(c, &a->ranking[i], s))
    {
        return;
    }
    a->ranking_count += i == a->ranking_count;
    for (; i > 0 && sss_dipole__is_better(c, &a->ranking[i - 1], s); i--)
    {
        a->ranking[i] = a->ranking[i - 1];
    }
    a->ranking[i] = *c;
}

static void sss_dipole__explain(const sss_dipole_scene *s, sss_dipole_advice *a)
{
    const sss_dipole_choice *first = &a->ranking[0];
    const char *what = s->changes == 0u ? "for a still picture" : "a frame";
    char rest[96] = "; no other method is ranked";
    if (a->ranking_count == 0)
    {
        snprintf(a->ranking_reason, sizeof a->ranking_reason, "every method is left out");
        return;
    }
    if (a->ranking_count > 1)
    {
        snprintf(rest, sizeof rest, "; next %s: %.2g, %.3g ms", sss_dipole_method_name(a->ranking[1].method),
                 a->ranking[1].predicted_error, a->ranking[1].cost_ms);
    }
    snprintf(a->ranking_reason, sizeof a->ranking_reason, "%s %s: error %.2g (allowed %.2g), %.3g ms %s%s",
             sss_dipole_method_name(first->method),
             first->meets ? "is the cheapest that meets the tolerance"
             : sss_dipole__standing(first, s) == 1 ? "misses the tolerance, nothing within the budgets comes closer"
                                                   : "is the cheapest, over a budget like all others",
             first->predicted_error, s->tolerance, first->cost_ms, what, rest);
}

// s has no zeros left that stand for defaults, save those of the ranking.
static void sss_dipole__rank(const sss_profile *p, const sss_dipole_scene *s, const sss_dipole__curves *curves,
                             sss_dipole_advice *a)
{
    sss_dipole__traits t;
    double path, sigma;
    size_t i;
    memset(&t, 0, sizeof t);
    t.profile = p;
    t.curves = curves;
    t.lambert = a->lambert_error;
    sss_dipole__mean_paths(p, &path, &sigma);
    sss_dipole__count_elements(s, a, &t);
    if (path > 0.0) // or else nothing scatters: every law holds as it is, and Lambert is exact
    {
        a->extrapolated = sss_dipole__take_features(s, path, sigma, &t);
    }
    for (i = 0; i < curves->variant_count; i++)
    {
        sss_dipole_choice c;
        if (sss_dipole__may_rank(curves->variants[i].method, s))
        {
            sss_dipole__predict_choice(&curves->variants[i], s, &t, &c);
            c.meets = sss_dipole__standing(&c, s) == 0;
            sss_dipole__enter(&c, s, a);
        }
    }
    sss_dipole__explain(s, a);
}

SSS_DIPOLE_API const char *sss_dipole_method_name(sss_dipole_method method)
{
    switch (method)
    {
    case SSS_DIPOLE_METHOD_LAMBERT:    return "lambert";
    case SSS_DIPOLE_METHOD_DIRECT:     return "direct";
    case SSS_DIPOLE_METHOD_POINTS:     return "direct-points";
    case SSS_DIPOLE_METHOD_PLACED:     return "direct-placed";
    case SSS_DIPOLE_METHOD_BEM:        return "bem";
    case SSS_DIPOLE_METHOD_BEM_RENDER: return "bem-render";
    case SSS_DIPOLE_METHOD_HAO:        return "hao";
    }
    return NULL;
}

// The sum over the channels of what Lambert is off, and of what it is off from, at some vertices.
static void sss_dipole__compare(const float *B, const float *lambert, const double *weights, size_t count,
                                double *error)
{
    double off = 0.0, all = 0.0;
    size_t i;
    for (i = 0; i < 3 * count; i++)
    {
        const double d = (double)lambert[i] - (double)B[i];
        off += weights[i / 3] * d * d;
        all += weights[i / 3] * (double)B[i] * (double)B[i];
    }
    *error = all > 0.0 ? sqrt(off / all) : 0.0;
}

// Every step-th triangle: its middle, the mean of its corners' irradiance, its area; mesh units.
static void sss_dipole__middles(const sss_mesh *mesh, const float *irradiance, size_t step, size_t count, float *x,
                                float *E, double *areas)
{
    size_t i;
    int c, k;
    for (i = 0; i < count; i++)
    {
        const uint32_t *v = mesh->triangles + 3 * i * step;
        double p[3][3], n[3];
        sss_dipole__triangle(mesh, i * step, p);
        sss_dipole__area_vector(p[0], p[1], p[2], n);
        areas[i] = 0.5 * sqrt(sss_dipole__dot(n, n));
        for (c = 0; c < 3; c++)
        {
            double light = 0.0;
            for (k = 0; k < 3; k++)
            {
                light += (double)irradiance[3 * (size_t)v[k] + (size_t)c];
            }
            x[3 * i + (size_t)c] = (float)((p[0][c] + p[1][c] + p[2][c]) / 3.0);
            E[3 * i + (size_t)c] = (float)(light / 3.0);
        }
    }
}

SSS_DIPOLE_API sss_result sss_dipole_lambert_error(const sss_mesh *mesh, const sss_profile *profile,
                                                   const float *irradiance, size_t count, const sss_hooks *hooks,
                                                   double *error)
{
    sss_dipole_gather_options options;
    sss_dipole_receivers receivers;
    sss_dipole_gather *gather = NULL;
    double *weights;
    float *x, *E, *B;
    size_t step;
    sss_result result;
    if (irradiance == NULL || error == NULL)
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    memset(&options, 0, sizeof options);
    options.tolerance = 1e-3;
    result = sss_dipole_gather_create(mesh, profile, &options, hooks, &gather);
    if (result != SSS_OK)
    {
        return result;
    }
    count = count > 0 ? count : 100;
    count = count < mesh->triangle_count ? count : mesh->triangle_count;
    step = mesh->triangle_count / count;
    weights = (double *)sss_dipole__allocate(&gather->hooks, count * (sizeof *weights + 9 * sizeof *x));
    if (weights == NULL)
    {
        sss_dipole_gather_free(gather);
        return SSS_ERROR_OUT_OF_MEMORY;
    }
    x = (float *)(weights + count);
    E = x + 3 * count;
    B = E + 3 * count;
    memset(&receivers, 0, sizeof receivers);
    receivers.positions = x;
    receivers.count = count;
    result = sss_dipole_gather_set_irradiance(gather, SSS_DIPOLE_VERTICES, irradiance);
    if (result == SSS_OK) // or else irradiance is not finite
    {
        sss_dipole__middles(mesh, irradiance, step, count, x, E, weights);
        result = sss_dipole_gather_run(gather, &receivers, B);
    }
    result = result == SSS_OK ? sss_dipole_lambert(profile, E, count, E) : result;
    if (result == SSS_OK)
    {
        sss_dipole__compare(B, E, weights, count, error);
    }
    sss_dipole__release(&gather->hooks, weights);
    sss_dipole_gather_free(gather);
    return result;
}

SSS_DIPOLE_API sss_result sss_dipole_measure(const sss_mesh *mesh, sss_dipole_scene *out)
{
    const sss_result result = sss_dipole__check_mesh(mesh);
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    double area = 0.0, edges = 0.0, size = 0.0, volume = 0.0, open[3] = {0.0, 0.0, 0.0}, first[3];
    size_t t;
    int i, k;
    if (result != SSS_OK || out == NULL)
    {
        return result != SSS_OK ? result : SSS_ERROR_INVALID_ARGUMENT;
    }
    sss_dipole__corner(mesh, 0, 0, first);
    for (t = 0; t < mesh->triangle_count; t++)
    {
        double p[3][3], n[3];
        for (k = 0; k < 3; k++)
        {
            sss_dipole__corner(mesh, t, k, p[k]);
            for (i = 0; i < 3; i++)
            {
                low[i] = sss_dipole__min(low[i], p[k][i]);
                high[i] = sss_dipole__max(high[i], p[k][i]);
            }
        }
        sss_dipole__area_vector(p[0], p[1], p[2], n);
        area += 0.5 * sqrt(sss_dipole__dot(n, n));
        for (k = 0; k < 3; k++)
        {
            open[k] += 0.5 * n[k];
            volume += (p[0][k] - first[k]) * n[k] / 6.0; // divergence theorem
            edges += sss_dipole__distance(p[k], p[(k + 1) % 3]);
        }
    }
    for (i = 0; i < 3; i++)
    {
        size = sss_dipole__max(size, high[i] - low[i]);
    }
    memset(out, 0, sizeof *out);
    out->vertex_count = mesh->vertex_count;
    out->triangle_count = mesh->triangle_count;
    if (sqrt(sss_dipole__dot(open, open)) <= SSS_DIPOLE__OPEN * area)
    {
        for (i = 0; i < 3; i++) // seen from the middle, where a small hole matters least
        {
            volume -= (0.5 * (low[i] + high[i]) - first[i]) * open[i] / 3.0;
        }
        out->volume_mm3 = fabs(volume) * mesh->mm_per_unit * mesh->mm_per_unit * mesh->mm_per_unit;
    }
    out->size_mm = size * mesh->mm_per_unit;
    out->area_mm2 = area * mesh->mm_per_unit * mesh->mm_per_unit;
    out->spacing_mm = edges / (3.0 * (double)mesh->triangle_count) * mesh->mm_per_unit;
    return SSS_OK;
}

SSS_DIPOLE_API sss_result sss_dipole_needs(const sss_profile *profile, const sss_dipole_scene *scene,
                                           sss_dipole_advice *out)
{
    const sss_dipole__curves measured = {sss_dipole__variants,
                                         sizeof sss_dipole__variants / sizeof sss_dipole__variants[0],
                                         sss_dipole__slopes, sss_dipole__ranges};
    sss_dipole_scene s;
    sss_dipole_advice a;
    double tolerance;
    int i;
    if (profile == NULL || scene == NULL || out == NULL || !sss_dipole__valid_profile(profile)
        || !sss_dipole__valid_scene(scene))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    s = *scene;
    tolerance = s.tolerance > 0.0 ? s.tolerance : 1e-2;
    s.thickness_mm = s.thickness_mm > 0.0 ? s.thickness_mm : s.size_mm;
    s.area_mm2 = s.area_mm2 > 0.0 ? s.area_mm2 : SSS_DIPOLE__PI * s.size_mm * s.size_mm;
    memset(&a, 0, sizeof a);
    a.spacing_mm = HUGE_VAL;
    for (i = 0; i < 3; i++)
    {
        sss_dipole__advise_channel(profile, i, &s, tolerance, &a);
    }
    a.sample_count = s.area_mm2 / (0.25 * SSS_DIPOLE__SQRT3 * a.spacing_mm * a.spacing_mm);
    sss_dipole__decide(profile, &s, tolerance, &a);
    a.model_error = sss_dipole__model_error(profile, scene, a.lambert_error);
    s.tolerance = tolerance;
    sss_dipole__rank(profile, &s, &measured, &a);
    *out = a;
    return SSS_OK;
}

// ---- 7. GLSL ----

SSS_DIPOLE_API const char *sss_dipole_glsl(sss_dipole_glsl_piece piece)
{
    switch (piece)
    {
    case SSS_DIPOLE_GLSL_FRESNEL:      return SSS_DIPOLE__GLSL_FRESNEL;
    case SSS_DIPOLE_GLSL_PROFILE:      return SSS_DIPOLE__GLSL_PROFILE;
    case SSS_DIPOLE_GLSL_TONE_MAPPING: return SSS_DIPOLE__GLSL_TONE_MAPPING;
    }
    return NULL;
}

SSS_DIPOLE_API sss_result sss_dipole_get_glsl_uniforms(const sss_profile *profile, sss_dipole_exit exit_convention,
                                                       sss_dipole_glsl_uniforms *out)
{
    sss_dipole_glsl_uniforms u;
    int i;
    if (profile == NULL || out == NULL || !sss_dipole__valid_profile(profile)
        || !sss_dipole__valid_exit(exit_convention))
    {
        return SSS_ERROR_INVALID_ARGUMENT;
    }
    for (i = 0; i < 3; i++)
    {
        u.alpha_p[i] = (float)profile->alpha_p[i];
        u.sigma_tr[i] = (float)profile->sigma_tr[i];
        u.z_r[i] = (float)profile->z_r[i];
        u.z_v[i] = (float)profile->z_v[i];
    }
    u.eta = (float)profile->eta;
    u.exit_scale = 1.0f;
    if (exit_convention == SSS_DIPOLE_EXIT_CONSERVING) // exact, whatever the profile was made with
    {
        u.exit_scale = (float)(1.0 / (1.0 - sss_dipole_fresnel_external(profile->eta, SSS_DIPOLE_FRESNEL_EXACT)));
    }
    *out = u;
    return SSS_OK;
}

#endif // SSS_DIPOLE_IMPLEMENTED
#endif // SSS_DIPOLE_IMPLEMENTATION


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
