// The files of truth.h.

#include "truth.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum
{
    LINE_SIZE = 512,
    COLUMNS = 11 // patch, area, E, B, standard errors
};

// E of the case at hand against E of the file, relative L2 over patches: both come from the same formula, one in float.
static const double E_TOLERANCE = 1e-4;

const char *truth_status_string(truth_status status)
{
    switch (status)
    {
    case TRUTH_OK:        return "no error";
    case TRUTH_NONE:      return "there is no such file";
    case TRUTH_STALE:     return "made from something else: make it again";
    case TRUTH_BROKEN:    return "damaged, or no file of truth";
    case TRUTH_NO_MEMORY: return "out of memory";
    }
    return "unknown";
}

// ---- Hashes: FNV-1a ----

static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t size)
{
    const unsigned char *const b = (const unsigned char *)bytes;
    for (size_t i = 0; i < size; ++i)
        hash = (hash ^ b[i]) * 0x100000001B3u;
    return hash;
}

static uint64_t hash_number(uint64_t hash, double x)
{
    const double same = x == 0.0 ? 0.0 : x; // -0 is 0
    return hash_bytes(hash, &same, sizeof same);
}

uint64_t truth_hash(const truth_case *c, const truth_settings *s)
{
    const sss_mesh *const m = c->mesh;
    uint64_t hash = 0xCBF29CE484222325u;
    hash = hash_bytes(hash, m->positions, 3 * m->vertex_count * sizeof *m->positions);
    hash = hash_bytes(hash, m->normals, 3 * m->vertex_count * sizeof *m->normals);
    hash = hash_bytes(hash, m->triangles, 3 * m->triangle_count * sizeof *m->triangles);
    hash = hash_number(hash, m->mm_per_unit);
    for (int k = 0; k < 3; ++k)
    {
        hash = hash_number(hash, c->profile->alpha_p[k]);
        hash = hash_number(hash, c->profile->z_r[k]);
    }
    hash = hash_number(hash, c->profile->eta);
    for (const char *at = c->light_name; *at != '\0'; ++at)
        hash = hash_number(hash, (double)tolower((unsigned char)*at));
    hash = hash_number(hash, s->g);
    hash = hash_number(hash, (double)s->photons);
    hash = hash_number(hash, (double)s->seed);
    hash = hash_number(hash, (double)s->patches);
    hash = hash_number(hash, (double)s->scatterings_max);
    return hash_number(hash, (double)WALK_VERSION);
}

// ---- Memory ----

static int allocate(const truth_case *c, size_t patch_count, truth *t)
{
    t->patch_count = patch_count;
    t->patches = (uint32_t *)malloc(c->mesh->triangle_count * sizeof *t->patches + 1);
    t->area = (double *)calloc(patch_count + 1, sizeof *t->area);
    t->E = (double *)calloc(3 * patch_count + 1, sizeof *t->E);
    t->B = (double *)calloc(3 * patch_count + 1, sizeof *t->B);
    t->B_error = (double *)calloc(3 * patch_count + 1, sizeof *t->B_error);
    return t->patches == NULL || t->area == NULL || t->E == NULL || t->B == NULL || t->B_error == NULL;
}

void truth_free(truth *t)
{
    free(t->patches);
    free(t->area);
    free(t->E);
    free(t->B);
    free(t->B_error);
    memset(t, 0, sizeof *t);
}

// ---- Making ----

static double share(const double values[3], const double of[3])
{
    double worst = 0.0;
    for (int k = 0; k < 3; ++k)
        worst = of[k] > 0.0 ? fmax(worst, values[k] / of[k]) : worst;
    return worst;
}

static void take(const walk_result *r, truth *t)
{
    const size_t P = t->patch_count;
    double lost[3], cut[3];
    memcpy(t->area, r->area, P * sizeof *t->area);
    memcpy(t->E, r->E, 3 * P * sizeof *t->E);
    memcpy(t->B, r->B, 3 * P * sizeof *t->B);
    memcpy(t->B_error, r->B_error, 3 * P * sizeof *t->B_error);
    for (int k = 0; k < 3; ++k)
    {
        lost[k] = r->lost[k].value;
        cut[k] = r->cut[k].value;
        t->scatterings += r->scatterings[k];
    }
    t->lost = share(lost, r->entered);
    t->cut = share(cut, r->entered);
}

// Does the light that walks give the irradiance that the case has?
static int same_light(const truth_case *c, const truth *t)
{
    double *const means = (double *)malloc(3 * t->patch_count * sizeof *means + 1);
    double sum = 0.0, away = 0.0;
    if (means == NULL)
        return 0;
    walk_patch_means(c->mesh, t->patches, t->patch_count, c->irradiance, means, NULL);
    for (size_t i = 0; i < 3 * t->patch_count; ++i)
    {
        sum += t->area[i / 3] * means[i] * means[i];
        away += t->area[i / 3] * (means[i] - t->E[i]) * (means[i] - t->E[i]);
    }
    free(means);
    return away <= E_TOLERANCE * E_TOLERANCE * sum;
}

int truth_make(const truth_case *c, const walk_light *lights, size_t light_count, const truth_settings *settings,
               const sss_hooks *hooks, truth *out)
{
    uint32_t *const patches = (uint32_t *)malloc(c->mesh->triangle_count * sizeof *patches + 1);
    const size_t P = patches != NULL ? walk_patches(c->mesh, settings->patches, patches) : 0;
    walk_scene *const scene = walk_scene_create(c->mesh);
    walk_medium medium;
    walk_options options;
    walk_result result;
    memset(out, 0, sizeof *out);
    memset(&options, 0, sizeof options);
    memset(&result, 0, sizeof result);
    walk_medium_of(c->profile, settings->g, &medium);
    options.photons = settings->photons;
    options.seed = settings->seed;
    options.scatterings_max = settings->scatterings_max;
    options.hooks = hooks;
    options.patches = patches;
    options.patch_count = P;
    int failed = P == 0 || scene == NULL || allocate(c, P, out) != 0 ||
                 walk_run(scene, &medium, lights, light_count, &options, &result) != 0;
    if (!failed)
    {
        out->settings = *settings;
        memcpy(out->patches, patches, c->mesh->triangle_count * sizeof *patches);
        take(&result, out);
        failed = !same_light(c, out);
    }
    if (failed)
        truth_free(out);
    walk_result_free(&result);
    walk_scene_free(scene);
    free(patches);
    return failed;
}

// ---- Files ----

int truth_write(const char *path, const truth_case *c, const char *command, const truth *t)
{
    FILE *const file = fopen(path, "w");
    uint64_t body = 0xCBF29CE484222325u;
    if (file == NULL)
        return 1;
    fprintf(file, "# %s\n# made from %016llx: mesh %s, %g mm per unit; light %s\n", command,
            (unsigned long long)truth_hash(c, &t->settings), c->mesh_name, c->mesh->mm_per_unit, c->light_name);
    fprintf(file, "# g=%.17g photons=%llu seed=%llu patches=%zu scatterings_max=%llu lost=%.3g cut=%.3g\n",
            t->settings.g, (unsigned long long)t->settings.photons, (unsigned long long)t->settings.seed,
            t->settings.patches, (unsigned long long)t->settings.scatterings_max, t->lost, t->cut);
    fprintf(file, "patch,area_mm2,E_r,E_g,E_b,B_r,B_g,B_b,error_r,error_g,error_b\n");
    for (size_t p = 0; p < t->patch_count; ++p)
    {
        const double *const E = t->E + 3 * p, *const B = t->B + 3 * p, *const s = t->B_error + 3 * p;
        char line[LINE_SIZE];
        const int length =
            snprintf(line, sizeof line, "%zu,%.7g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.3g,%.3g,%.3g\n", p, t->area[p], E[0],
                     E[1], E[2], B[0], B[1], B[2], s[0], s[1], s[2]);
        body = hash_bytes(body, line, (size_t)length);
        fputs(line, file);
    }
    fprintf(file, "# end %016llx\n", (unsigned long long)body);
    return fclose(file) != 0;
}

// The head; 0 where it is one.
static int read_head(FILE *file, truth *t, unsigned long long *hash)
{
    char line[LINE_SIZE];
    unsigned long long photons, seed, most;
    if (fgets(line, sizeof line, file) == NULL || line[0] != '#')
        return 1;
    if (fgets(line, sizeof line, file) == NULL || sscanf(line, "# made from %llx:", hash) != 1)
        return 1;
    if (fgets(line, sizeof line, file) == NULL ||
        sscanf(line, "# g=%lg photons=%llu seed=%llu patches=%zu scatterings_max=%llu lost=%lg cut=%lg",
               &t->settings.g, &photons, &seed, &t->settings.patches, &most, &t->lost, &t->cut) != 7)
        return 1;
    t->settings.photons = photons;
    t->settings.seed = seed;
    t->settings.scatterings_max = most;
    return fgets(line, sizeof line, file) == NULL || strncmp(line, "patch,", 6) != 0;
}

static int read_patch(const char *line, size_t patch, truth *t)
{
    double *const E = t->E + 3 * patch, *const B = t->B + 3 * patch, *const s = t->B_error + 3 * patch;
    size_t number;
    if (sscanf(line, "%zu,%lg,%lg,%lg,%lg,%lg,%lg,%lg,%lg,%lg,%lg", &number, &t->area[patch], &E[0], &E[1], &E[2],
               &B[0], &B[1], &B[2], &s[0], &s[1], &s[2]) != COLUMNS ||
        number != patch)
        return 1;
    double sum = t->area[patch];
    for (int k = 0; k < 3; ++k)
        sum += E[k] + B[k] + s[k];
    return !isfinite(sum);
}

static truth_status read_patches(FILE *file, truth *t)
{
    uint64_t body = 0xCBF29CE484222325u;
    unsigned long long want;
    char line[LINE_SIZE];
    for (size_t p = 0; p < t->patch_count; ++p)
    {
        if (fgets(line, sizeof line, file) == NULL || read_patch(line, p, t) != 0)
            return TRUTH_BROKEN;
        body = hash_bytes(body, line, strlen(line));
    }
    if (fgets(line, sizeof line, file) == NULL || sscanf(line, "# end %llx", &want) != 1 || want != body)
        return TRUTH_BROKEN;
    return TRUTH_OK;
}

static truth_status read_all(FILE *file, const truth_case *c, truth *t)
{
    unsigned long long hash;
    if (read_head(file, t, &hash) != 0)
        return TRUTH_BROKEN;
    if (hash != truth_hash(c, &t->settings))
        return TRUTH_STALE;
    uint32_t *const patches = (uint32_t *)malloc(c->mesh->triangle_count * sizeof *patches + 1);
    const size_t P = patches != NULL ? walk_patches(c->mesh, t->settings.patches, patches) : 0;
    if (P == 0 || allocate(c, P, t) != 0)
    {
        free(patches);
        return TRUTH_NO_MEMORY;
    }
    memcpy(t->patches, patches, c->mesh->triangle_count * sizeof *patches);
    free(patches);
    const truth_status status = read_patches(file, t);
    if (status == TRUTH_OK && !same_light(c, t))
        return TRUTH_STALE;
    return status;
}

truth_status truth_read(const char *path, const truth_case *c, truth *out)
{
    FILE *const file = fopen(path, "r");
    memset(out, 0, sizeof *out);
    if (file == NULL)
        return TRUTH_NONE;
    const truth_status status = read_all(file, c, out);
    fclose(file);
    if (status != TRUTH_OK)
        truth_free(out);
    return status;
}

// ---- The model's error ----

// What one channel adds up to: squares of the difference, of the truth and of its noise, and the variance of the first.
typedef struct sums
{
    double away, truth, noise, spread, flux, want;
} sums;

static void add(sums *s, double area, double B, double want, double error)
{
    const double d = B - want, e2 = error * error;
    s->away += area * (d * d - e2);
    s->truth += area * (want * want - e2);
    s->noise += area * e2;
    // (d + e)^2 - e^2 has the variance 4 d^2 e^2 + 2 e^4; d^2 is known only as (d^2 - e^2).
    s->spread += area * area * (4.0 * fmax(0.0, d * d - e2) * e2 + 2.0 * e2 * e2);
    s->flux += area * B;
    s->want += area * want;
}

static double relative(const sums *s)
{
    return s->truth > 0.0 ? sqrt(fmax(0.0, s->away) / s->truth) : HUGE_VAL;
}

void truth_model_error(const truth *t, const truth_case *c, const float *B, truth_error *out)
{
    double *const means = (double *)malloc(3 * t->patch_count * sizeof *means + 1);
    sums all, of[3];
    memset(out, 0, sizeof *out);
    memset(&all, 0, sizeof all);
    memset(of, 0, sizeof of);
    if (means == NULL)
    {
        out->rel_l2 = HUGE_VAL;
        return;
    }
    walk_patch_means(c->mesh, t->patches, t->patch_count, B, means, NULL);
    for (size_t i = 0; i < 3 * t->patch_count; ++i)
    {
        add(&all, t->area[i / 3], means[i], t->B[i], t->B_error[i]);
        add(&of[i % 3], t->area[i / 3], means[i], t->B[i], t->B_error[i]);
    }
    free(means);
    out->rel_l2 = relative(&all);
    out->noise = all.truth > 0.0 ? sqrt(all.noise / all.truth) : HUGE_VAL;
    // d(sqrt(x)) = dx/(2 sqrt(x)); where x is within its own spread of 0, the root of that.
    const double root = sqrt(all.spread);
    out->rel_l2_error = all.truth > 0.0 ? root / (2.0 * sqrt(fmax(all.away, root) * all.truth) + 1e-300) : HUGE_VAL;
    for (int k = 0; k < 3; ++k)
    {
        out->rel_l2_rgb[k] = of[k].truth > 0.0 ? relative(&of[k]) : 0.0;
        out->mean_ratio[k] = of[k].want > 0.0 ? of[k].flux / of[k].want : 0.0;
    }
}

int truth_difference(const truth *t, const truth *of, double *rel_l2, double *noise)
{
    sums s;
    memset(&s, 0, sizeof s);
    if (t->patch_count != of->patch_count)
        return 1;
    for (size_t i = 0; i < 3 * of->patch_count; ++i)
    {
        const double other = t->B_error[i] * t->B_error[i];
        add(&s, of->area[i / 3], t->B[i], of->B[i], of->B_error[i]);
        s.away -= of->area[i / 3] * other;
        s.noise += of->area[i / 3] * other;
    }
    *rel_l2 = relative(&s);
    *noise = s.truth > 0.0 ? sqrt(s.noise / s.truth) : HUGE_VAL;
    return 0;
}
