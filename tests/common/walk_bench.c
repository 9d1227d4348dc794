// The layers of walk_bench.h.

#include "walk_bench.h"

#include "meshes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// shared/TRUTH.md. The Lambertian columns of adding-doubling may be off by 1 to 4 in the last digit (its section 6).
const bench_layer bench_layers[] = {
    {"1.2 exact", 0.1, 0.0, 0.0, 1.0, 1.0, 0.0163903, -1.0, 5e-8},
    {"1.2 exact", 0.3, 0.0, 0.0, 1.0, 1.0, 0.0572144, -1.0, 5e-8},
    {"1.2 exact", 0.5, 0.0, 0.0, 1.0, 1.0, 0.1152259, -1.0, 5e-8},
    {"1.2 exact", 0.7, 0.0, 0.0, 1.0, 1.0, 0.2086800, -1.0, 5e-8},
    {"1.2 exact", 0.8, 0.0, 0.0, 1.0, 1.0, 0.2852545, -1.0, 5e-8},
    {"1.2 exact", 0.9, 0.0, 0.0, 1.0, 1.0, 0.4149475, -1.0, 5e-8},
    {"1.2 exact", 0.95, 0.0, 0.0, 1.0, 1.0, 0.5355410, -1.0, 5e-8},
    {"1.2 exact", 0.98, 0.0, 0.0, 1.0, 1.0, 0.6710837, -1.0, 5e-8},
    {"1.2 exact", 0.99, 0.0, 0.0, 1.0, 1.0, 0.7527207, -1.0, 5e-8},
    {"1.2 exact", 0.995, 0.0, 0.0, 1.0, 1.0, 0.8170469, -1.0, 5e-8},
    {"1.2 exact", 0.999, 0.0, 0.0, 1.0, 1.0, 0.9128453, -1.0, 5e-8},
    {"1.2 exact", 0.1, 0.0, 0.0, 1.3, 1.0, 0.0250967, -1.0, 5e-8},
    {"1.2 exact", 0.3, 0.0, 0.0, 1.3, 1.0, 0.0463759, -1.0, 5e-8},
    {"1.2 exact", 0.5, 0.0, 0.0, 1.3, 1.0, 0.0794187, -1.0, 5e-8},
    {"1.2 exact", 0.7, 0.0, 0.0, 1.3, 1.0, 0.1395726, -1.0, 5e-8},
    {"1.2 exact", 0.8, 0.0, 0.0, 1.3, 1.0, 0.1952526, -1.0, 5e-8},
    {"1.2 exact", 0.9, 0.0, 0.0, 1.3, 1.0, 0.3027961, -1.0, 5e-8},
    {"1.2 exact", 0.95, 0.0, 0.0, 1.3, 1.0, 0.4178905, -1.0, 5e-8},
    {"1.2 exact", 0.98, 0.0, 0.0, 1.3, 1.0, 0.5648346, -1.0, 5e-8},
    {"1.2 exact", 0.99, 0.0, 0.0, 1.3, 1.0, 0.6624069, -1.0, 5e-8},
    {"1.2 exact", 0.995, 0.0, 0.0, 1.3, 1.0, 0.7441258, -1.0, 5e-8},
    {"1.2 exact", 0.999, 0.0, 0.0, 1.3, 1.0, 0.8737676, -1.0, 5e-8},
    {"1.2 exact", 0.1, 0.0, 0.0, 1.5, 1.0, 0.0456092, -1.0, 5e-8},
    {"1.2 exact", 0.3, 0.0, 0.0, 1.5, 1.0, 0.0605501, -1.0, 5e-8},
    {"1.2 exact", 0.5, 0.0, 0.0, 1.5, 1.0, 0.0842459, -1.0, 5e-8},
    {"1.2 exact", 0.7, 0.0, 0.0, 1.5, 1.0, 0.1289052, -1.0, 5e-8},
    {"1.2 exact", 0.8, 0.0, 0.0, 1.5, 1.0, 0.1719786, -1.0, 5e-8},
    {"1.2 exact", 0.9, 0.0, 0.0, 1.5, 1.0, 0.2599186, -1.0, 5e-8},
    {"1.2 exact", 0.95, 0.0, 0.0, 1.5, 1.0, 0.3611178, -1.0, 5e-8},
    {"1.2 exact", 0.98, 0.0, 0.0, 1.5, 1.0, 0.5014730, -1.0, 5e-8},
    {"1.2 exact", 0.99, 0.0, 0.0, 1.5, 1.0, 0.6019808, -1.0, 5e-8},
    {"1.2 exact", 0.995, 0.0, 0.0, 1.5, 1.0, 0.6909160, -1.0, 5e-8},
    {"1.2 exact", 0.999, 0.0, 0.0, 1.5, 1.0, 0.8414585, -1.0, 5e-8},
    {"1.3 adding-doubling", 0.9, 2.0, 0.75, 1.0, 1.0, 0.09739, 0.66096, 5e-6},
    {"1.3 adding-doubling", 0.9, 2.0, 0.75, 1.0, 0.0, 0.19109, 0.50182, 2e-5},
    {"1.3 adding-doubling", 0.9, 0.0, 0.0, 1.5, 0.0, 0.30788, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.5, 0.0, 0.0, 1.0, 0.0, 0.14654, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.9, 0.0, 0.0, 1.0, 0.0, 0.47802, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.99, 0.0, 0.0, 1.0, 0.0, 0.79456, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.999, 0.0, 0.0, 1.0, 0.0, 0.92971, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.5, 0.0, 0.0, 1.3, 0.0, 0.12596, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.8, 0.0, 0.0, 1.3, 0.0, 0.24324, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.9, 0.0, 0.0, 1.3, 0.0, 0.34946, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.95, 0.0, 0.0, 1.3, 0.0, 0.46091, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.99, 0.0, 0.0, 1.3, 0.0, 0.69168, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.999, 0.0, 0.0, 1.3, 0.0, 0.88592, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.5, 0.0, 0.0, 1.5, 0.0, 0.13611, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.8, 0.0, 0.0, 1.5, 0.0, 0.22257, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.95, 0.0, 0.0, 1.5, 0.0, 0.40484, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.99, 0.0, 0.0, 1.5, 0.0, 0.63196, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.999, 0.0, 0.0, 1.5, 0.0, 0.85424, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.999, 0.0, 0.9, 1.0, 1.0, 0.74595, -1.0, 5e-6},
    {"1.3 adding-doubling", 0.999, 0.0, 0.9, 1.0, 0.0, 0.79543, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.999, 0.0, 0.8, 1.3, 1.0, 0.74418, -1.0, 5e-6},
    {"1.3 adding-doubling", 0.999, 0.0, 0.8, 1.3, 0.0, 0.76753, -1.0, 2e-5},
    {"1.3 adding-doubling", 0.9, 1.0, 0.0, 1.0, 1.0, 0.26741, 0.59163, 5e-6},
    {"1.3 adding-doubling", 0.9, 1.0, 0.0, 1.0, 0.0, 0.35271, 0.47475, 2e-5},
    {"1.3 adding-doubling", 0.99, 1.0, 0.0, 1.0, 1.0, 0.33292, 0.65098, 5e-6},
    {"1.3 adding-doubling", 0.99, 1.0, 0.0, 1.0, 0.0, 0.43596, 0.54435, 2e-5},
    {"1.3 adding-doubling", 1.0, 1.0, 0.0, 1.0, 1.0, 0.34133, 0.65867, 5e-6},
    {"1.3 adding-doubling", 1.0, 1.0, 0.0, 1.0, 0.0, 0.44659, 0.55341, 2e-5},
    {"1.3 adding-doubling", 1.0, 10.0, 0.0, 1.0, 1.0, 0.85300, 0.14700, 5e-6},
    {"1.3 adding-doubling", 1.0, 10.0, 0.0, 1.0, 0.0, 0.88325, 0.11675, 2e-5},
    {"1.3 adding-doubling", 0.99, 10.0, 0.0, 1.0, 1.0, 0.74093, 0.08476, 5e-6},
    {"1.3 adding-doubling", 0.99, 10.0, 0.0, 1.0, 0.0, 0.78532, 0.06643, 2e-5},
    {"1.3 adding-doubling", 1.0, 10.0, 0.0, 1.5, 1.0, 0.77570, 0.22430, 5e-6},
    {"1.3 adding-doubling", 1.0, 10.0, 0.0, 1.5, 0.0, 0.79444, 0.20556, 2e-5},
    {"1.3 adding-doubling", 0.9, 1.0, 0.0, 1.5, 1.0, 0.22199, 0.50595, 5e-6},
    {"1.3 adding-doubling", 0.9, 1.0, 0.0, 1.5, 0.0, 0.27972, 0.44120, 2e-5},
    {"1.4 slab", 0.99, 10.0, 0.0, 1.4, 1.0, 0.62188, 0.10260, 5e-6},
    {"1.1 van de Hulst", 0.99, 1.0, 0.0, 1.0, 0.5, 0.48652, 0.49163, 5e-6},
    {"1.1 van de Hulst", 0.99, 4.0, 0.5, 1.0, 0.5, 0.61996, 0.30605, 5e-6},
    {"1.1 van de Hulst", 0.9, 2.0, 0.75, 1.0, 1.0, 0.09739, 0.66096, 5e-6},
    {"1.1 adding-doubling", 0.9, 1.0, 0.8, 1.0, 1.0, 0.04242, 0.84561, 5e-6},
    {"1.1 adding-doubling", 0.9, 1.0, 0.8, 1.0, 0.0, 0.11660, 0.71057, 2e-5},
    {"1.1 adding-doubling", 0.9, 1.0, 0.8, 1.0, 0.7071067811865476, 0.08298, 0.75931, 5e-6},
};

const size_t bench_layer_count = sizeof bench_layers / sizeof *bench_layers;

const double bench_ring_edges[BENCH_RINGS + 1] = {0.0, 0.1, 0.2, 0.5, 1.0,  1.5,  2.0,     3.0,
                                                  4.0, 5.0, 7.0, 10.0, 15.0, 19.9, HUGE_VAL};

// shared/TRUTH.md, 1.5: MCML's totals are up to 0.3 % low; case H has two batches, 0.5 % are to be taken.
const bench_profile bench_profiles[] = {
    {"A", 0.9, 0.0, 1.0,
     {0.039088, 0.032739, 0.075326, 0.083490, 0.054857, 0.037217, 0.044592, 0.022378,
      0.011645, 0.009279, 0.003124, 0.000567, 0.000029, 0.000002},
     {0.000101, 0.000147, 0.000166, 0.000207, 0.000107, 0.000113, 0.000069, 0.000082,
      0.000056, 0.000041, 0.000019, 0.000004, 0.000001, 0.000000}, 0.003},
    {"B", 0.99, 0.0, 1.0,
     {0.044117, 0.037989, 0.093447, 0.116083, 0.086132, 0.066418, 0.094667, 0.061952,
      0.041623, 0.049619, 0.033634, 0.018915, 0.005248, 0.002617},
     {0.000128, 0.000140, 0.000146, 0.000331, 0.000230, 0.000169, 0.000191, 0.000224,
      0.000127, 0.000199, 0.000113, 0.000112, 0.000032, 0.000011}, 0.003},
    {"D", 0.99, 0.0, 1.3,
     {0.030589, 0.024727, 0.058399, 0.076748, 0.064283, 0.055101, 0.088527, 0.065032,
      0.047832, 0.061034, 0.045075, 0.026932, 0.007837, 0.003871},
     {0.000156, 0.000088, 0.000085, 0.000298, 0.000297, 0.000155, 0.000263, 0.000160,
      0.000132, 0.000220, 0.000092, 0.000094, 0.000060, 0.000024}, 0.003},
    {"E", 0.999, 0.0, 1.3,
     {0.030931, 0.025222, 0.060473, 0.080664, 0.069573, 0.061791, 0.101951, 0.079681,
      0.061678, 0.087382, 0.076875, 0.063283, 0.029646, 0.042025},
     {0.000104, 0.000147, 0.000131, 0.000190, 0.000251, 0.000182, 0.000214, 0.000130,
      0.000221, 0.000157, 0.000172, 0.000193, 0.000069, 0.000121}, 0.003},
    {"G", 0.99843756, 0.0, 1.5,
     {0.024963, 0.019288, 0.046091, 0.063356, 0.057022, 0.052446, 0.090779, 0.073961,
      0.059647, 0.087460, 0.080976, 0.069175, 0.032059, 0.041139},
     {0.000118, 0.000069, 0.000148, 0.000258, 0.000104, 0.000165, 0.000266, 0.000146,
      0.000126, 0.000180, 0.000230, 0.000119, 0.000074, 0.000159}, 0.003},
    {"H", 0.99899091826437947, 0.9, 1.4,
     {0.009733, 0.009904, 0.033474, 0.063803, 0.064677, 0.058818, 0.096862, 0.071966,
      0.052310, 0.066506, 0.049256, 0.029264, 0.008410, 0.004249},
     {0.000232, 0.000001, 0.000293, 0.000003, 0.000333, 0.000120, 0.000614, 0.000081,
      0.000289, 0.000364, 0.000085, 0.000083, 0.000016, 0.000095}, 0.005},
};

const size_t bench_profile_count = sizeof bench_profiles / sizeof *bench_profiles;

enum
{
    TOP,
    BOTTOM,
    SIDES,
    FACES
};

// [-half, half]^2 x [-depth, 0]; patches: top, bottom, sides.
static int make_box(double half, double depth, mesh_data *mesh, uint32_t patches[12])
{
    static const uint32_t triangles[36] = {4, 5, 6, 4, 6, 7, 0, 2, 1, 0, 3, 2, 0, 1, 5, 0, 5, 4,
                                           1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
    float positions[24];
    for (size_t v = 0; v < 8; ++v)
    {
        positions[3 * v + 0] = (float)(v % 4 == 1 || v % 4 == 2 ? half : -half);
        positions[3 * v + 1] = (float)(v % 4 >= 2 ? half : -half);
        positions[3 * v + 2] = (float)(v >= 4 ? 0.0 : -depth);
    }
    for (uint32_t t = 0; t < 12; ++t)
        patches[t] = t < 2 ? TOP : t < 4 ? BOTTOM : SIDES;
    return mesh_make(positions, 8, triangles, 12, mesh);
}

// Far enough that what would get there has fallen by e^-16: diffusion's range in a half space, a few depths in a slab.
static double half_width(double albedo, double g, double sigma_t, double depth)
{
    const double range = 1.0 / (sigma_t * sqrt(3.0 * (1.0 - albedo) * (1.0 - albedo * g)));
    return depth > 0.0 ? 15.0 * (depth + 4.0 / (sigma_t * (1.0 - g))) : 25.0 * range + 30.0 / (sigma_t * (1.0 - g));
}

static int run_box(double half, double depth, const walk_medium *medium, const walk_light *light, walk_options *o,
                   walk_result *out)
{
    mesh_data mesh;
    uint32_t patches[12];
    int failed = make_box(half, depth, &mesh, patches);
    if (!failed)
    {
        const sss_mesh view = mesh_view(&mesh, 1.0);
        walk_scene *const scene = walk_scene_create(&view);
        o->patches = patches;
        o->patch_count = FACES;
        failed = scene == NULL || walk_run(scene, medium, light, 1, o, out) != 0;
        walk_scene_free(scene);
        mesh_free(&mesh);
    }
    return failed;
}

int bench_run(const bench_layer *layer, uint64_t photons, uint64_t seed, const sss_hooks *hooks, bench_result *out)
{
    const double half = half_width(layer->albedo, layer->g, 1.0, layer->depth);
    walk_medium medium;
    walk_light light;
    walk_options options;
    memset(&medium, 0, sizeof medium);
    memset(&light, 0, sizeof light);
    memset(&options, 0, sizeof options);
    medium.sigma_s[0] = layer->albedo;
    medium.sigma_a[0] = 1.0 - layer->albedo;
    medium.g = layer->g;
    medium.eta = layer->eta;
    light.kind = WALK_BEAM;
    light.color[0] = 1.0;
    light.direction[0] = layer->cosine > 0.0 ? sqrt(1.0 - layer->cosine * layer->cosine) : 0.0;
    light.direction[2] = layer->cosine;
    options.photons = photons;
    options.seed = seed;
    options.hooks = hooks;
    options.channel_count = 1;
    if (run_box(half, layer->depth > 0.0 ? layer->depth : half, &medium, &light, &options, &out->walk) != 0)
        return 1;
    const walk_result *const w = &out->walk;
    out->R.value = w->specular[0] + w->B[3 * TOP] * w->area[TOP];
    out->R.error = w->B_error[3 * TOP] * w->area[TOP];
    out->T.value = w->B[3 * BOTTOM] * w->area[BOTTOM];
    out->T.error = w->B_error[3 * BOTTOM] * w->area[BOTTOM];
    out->sides = w->B[3 * SIDES] * w->area[SIDES];
    walk_result kept = out->walk;
    kept.area = kept.E = kept.B = kept.B_error = NULL;
    walk_result_free(&out->walk);
    out->walk = kept;
    return 0;
}

// ---- Rings ----

enum
{
    RING_BATCHES = 32
};

typedef struct rings
{
    double flux[RING_BATCHES][BENCH_RINGS];
    double x, y; // mm, of the beam
} rings;

static void count_ring(void *context, size_t batch, int channel, const double position[3], size_t triangle,
                       double weight)
{
    rings *const r = (rings *)context;
    const double distance = hypot(position[0] - r->x, position[1] - r->y);
    size_t ring = 0;
    (void)channel;
    while (distance >= bench_ring_edges[ring + 1])
        ++ring;
    if (triangle < 2) // the top
        r->flux[batch][ring] += weight;
}

int bench_run_profile(const bench_profile *profile, uint64_t photons, uint64_t seed, const sss_hooks *hooks,
                      walk_total out[BENCH_RINGS])
{
    const double sigma_t = 1.0 / (1.0 - profile->albedo * profile->g);
    const double half = half_width(profile->albedo, profile->g, sigma_t, 0.0);
    walk_medium medium;
    walk_light light;
    walk_options options;
    walk_result result;
    rings *const r = (rings *)calloc(1, sizeof *r);
    memset(&medium, 0, sizeof medium);
    memset(&light, 0, sizeof light);
    memset(&options, 0, sizeof options);
    medium.sigma_s[0] = profile->albedo * sigma_t;
    medium.sigma_a[0] = (1.0 - profile->albedo) * sigma_t;
    medium.g = profile->g;
    medium.eta = profile->eta;
    light.kind = WALK_BEAM;
    light.color[0] = 1.0;
    light.direction[2] = 1.0;
    options.photons = photons;
    options.batches = RING_BATCHES;
    options.seed = seed;
    options.hooks = hooks;
    options.channel_count = 1;
    options.exit = count_ring;
    options.exit_context = r;
    if (r == NULL)
        return 1;
    r->x = (float)half / 3.0; // the centroid of the first triangle of the box
    r->y = -(float)half / 3.0;
    const int failed = run_box(half, half, &medium, &light, &options, &result);
    for (size_t i = 0; i < BENCH_RINGS && !failed; ++i)
    {
        double squares = 0.0;
        out[i].value = 0.0;
        for (size_t b = 0; b < RING_BATCHES; ++b)
            out[i].value += r->flux[b][i] / result.entered[0];
        for (size_t b = 0; b < RING_BATCHES; ++b)
            squares += pow(r->flux[b][i] / result.entered[0] - out[i].value / RING_BATCHES, 2.0);
        out[i].error = sqrt(squares * RING_BATCHES / (RING_BATCHES - 1.0));
    }
    if (!failed)
        walk_result_free(&result);
    free(r);
    return failed;
}
