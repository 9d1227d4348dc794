// Makes files of truth for the chart's cases, and holds the random walk against known layers.
//   build/tests/chart/truth CASE...|--all [--g G] [--photons N] [--noise X] [--steps N] [--seed N] [--patches N]
//                           [--threads N] [--folder DIR]
//       writes DIR/CASE.csv, with --g DIR/CASE-gG.csv; DIR is tests/chart/truth. Without --photons a short walk says
//       how many photons bring the noise down to X (0.015 of the L2 norm), at most N steps in all (4e8). A file that is
//       there and up to date stays.
//   build/tests/chart/truth --list [--folder DIR]
//       the cases, and which files are there; fails where one is missing or out of date
//   build/tests/chart/truth --table [--folder DIR]
//       what the files hold: a table in Markdown; "no mesh" for a case whose mesh is not there
//   build/tests/chart/truth --verify OUT.csv [--photons N] [--threads N]
//       every layer of tests/common/walk_bench.h, and the rings; prints how far off they are in standard errors
// CASE is a name as --list prints it, e.g. bunny-marble-50-front.

#define SSS_DIPOLE_IMPLEMENTATION
#include "../cases.h"

#include "../../../examples/common/threads.h"
#include "../../common/test.h"
#include "../../common/truth.h"
#include "../../common/walk_bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum
{
    PATH_SIZE = 512,
    PILOT_PHOTONS = 4096,
    PATCHES = 200
};

typedef struct settings
{
    truth_settings truth;
    double noise, steps;
    int threads, list, table, all;
    const char *folder, *verify;
} settings;

// ---- Lights: of the chart as the walk knows them ----

static void take_light(const sss_dipole_light *light, const float *mask, walk_light *out)
{
    const double Y_0 = 0.28209479177387814, Y_1 = 0.48860251190291992; // real spherical harmonics, bands 0 and 1
    const size_t order[3] = {3, 1, 2};                                 // x, y, z among light->sh
    memset(out, 0, sizeof *out);
    out->mask = mask;
    for (int k = 0; k < 3; ++k)
    {
        out->color[k] = light->color[k];
        out->direction[k] = light->direction[k];
    }
    if (light->kind == SSS_DIPOLE_LIGHT_ENVIRONMENT)
    {
        out->kind = WALK_DIFFUSE;
        for (int k = 0; k < 3; ++k)
        {
            out->color[k] = 3.14159265358979323846 * Y_0 * light->sh[0][k];
            out->direction[k] = Y_1 * light->sh[order[k]][0] / (Y_0 * light->sh[0][0]); // white: one gradient for all
        }
    }
}

// mask [V]: the lit side of the edge, which is where the case has irradiance at all.
static float *make_mask(const chart_case *c)
{
    float *const mask = (float *)malloc(c->view.vertex_count * sizeof *mask);
    for (size_t v = 0; v < c->view.vertex_count && mask != NULL; ++v)
        mask[v] = c->irradiance[3 * v] > 0.0f ? 1.0f : 0.0f;
    return mask;
}

// ---- A file ----

// How many photons: the noise falls with the root of their number. Two digits, so that the file's command is short.
static uint64_t enough_photons(const truth_case *c, const walk_light *lights, size_t light_count, const settings *s,
                               const sss_hooks *hooks)
{
    truth_settings pilot = s->truth;
    truth t;
    double noise = 0.0, norm = 0.0;
    pilot.photons = PILOT_PHOTONS;
    const double start = test_seconds();
    if (truth_make(c, lights, light_count, &pilot, hooks, &t) != 0)
        return 0;
    for (size_t i = 0; i < 3 * t.patch_count; ++i)
    {
        noise += t.area[i / 3] * t.B_error[i] * t.B_error[i];
        norm += t.area[i / 3] * t.B[i] * t.B[i];
    }
    const double wanted = PILOT_PHOTONS * noise / (fmax(norm - noise, 1e-3 * norm) * s->noise * s->noise);
    const double affordable = PILOT_PHOTONS * s->steps / ((double)t.scatterings + 1.0);
    const double photons = fmin(1e8, fmax(1e4, fmin(wanted, affordable)));
    const double digit = pow(10.0, floor(log10(photons)) - 1.0);
    printf("  pilot: noise %.3f, %.3g steps a photon, %.1f s\n", sqrt(noise / norm),
           (double)t.scatterings / (3.0 * PILOT_PHOTONS), test_seconds() - start);
    truth_free(&t);
    return (uint64_t)(digit * ceil(photons / digit));
}

static void file_name(const settings *s, const char *name, char path[PATH_SIZE])
{
    char suffix[32] = "";
    if (s->truth.g != 0.0)
        snprintf(suffix, sizeof suffix, "-g%g", s->truth.g);
    snprintf(path, PATH_SIZE, "%s/%s%s.csv", s->folder, name, suffix);
}

static int make_file(const chart_case *chart, const truth_case *c, const settings *s, const sss_hooks *hooks,
                     const walk_light *lights)
{
    char path[PATH_SIZE], command[PATH_SIZE];
    settings own = *s;
    truth t;
    truth_error e;
    file_name(s, chart->name, path);
    if (truth_read(path, c, &t) == TRUTH_OK)
    {
        printf("%s: up to date\n", path);
        truth_free(&t);
        return 0;
    }
    printf("%s\n", path);
    fflush(stdout);
    if (own.truth.photons == 0)
        own.truth.photons = enough_photons(c, lights, chart->light_count, s, hooks);
    const double start = test_seconds();
    if (own.truth.photons == 0 || truth_make(c, lights, chart->light_count, &own.truth, hooks, &t) != 0)
    {
        fprintf(stderr, "%s: failed\n", path);
        return 1;
    }
    snprintf(command, sizeof command, "build/tests/chart/truth %s --g %g --photons %llu --seed %llu --patches %zu",
             chart->name, own.truth.g, (unsigned long long)own.truth.photons, (unsigned long long)own.truth.seed,
             own.truth.patches);
    truth_model_error(&t, c, c->irradiance, &e); // B = E: only for the noise
    printf("  %llu photons, %zu patches, noise %.4f, lost %.1e, cut %.1e, left/entered %.4f %.4f %.4f, %.2e steps, "
           "%.0f s\n",
           (unsigned long long)own.truth.photons, t.patch_count, e.noise, t.lost, t.cut, 1.0 / e.mean_ratio[0],
           1.0 / e.mean_ratio[1], 1.0 / e.mean_ratio[2], (double)t.scatterings, test_seconds() - start);
    const int failed = truth_write(path, c, command, &t);
    truth_free(&t);
    return failed;
}

// A file for a case of the chart, or nothing where its mesh is not there.
static int make_case(const chart_entry *entry, const settings *s, const sss_hooks *hooks)
{
    chart_case chart;
    const int made = chart_case_create(entry, 1.0, &chart);
    if (made != 0)
    {
        fprintf(stderr, "%s: %s\n", entry->mesh, made == CHART_LEFT_OUT ? "not there" : "failed");
        return made != CHART_LEFT_OUT;
    }
    const truth_case c = {chart.mesh_name, &chart.view, &chart.profile, chart.irradiance, chart.light_name};
    float *const mask = chart.edge ? make_mask(&chart) : NULL;
    walk_light *const lights = (walk_light *)malloc(chart.light_count * sizeof *lights + 1);
    int failed = lights == NULL || (chart.edge && mask == NULL);
    if (!failed)
    {
        for (size_t l = 0; l < chart.light_count; ++l)
            take_light(&chart.lights[l], mask, &lights[l]);
        failed = make_file(&chart, &c, s, hooks, lights);
    }
    free(mask);
    free(lights);
    chart_case_free(&chart);
    return failed;
}

// The file of a case, with the settings' g.
static truth_status read_file(const chart_case *chart, const settings *s, truth *t)
{
    const truth_case c = {chart->mesh_name, &chart->view, &chart->profile, chart->irradiance, chart->light_name};
    char path[PATH_SIZE];
    file_name(s, chart->name, path);
    return truth_read(path, &c, t);
}

// A line of a table in Markdown; where there is a file with g = 0.8 too, how far it is from the isotropic one.
static void table_line(const char *name, const truth *t, const truth *with_g)
{
    double entered[3] = {0.0, 0.0, 0.0}, left[3] = {0.0, 0.0, 0.0}, noise = 0.0, norm = 0.0, away, both;
    for (size_t i = 0; i < 3 * t->patch_count; ++i)
    {
        const double area = t->area[i / 3];
        entered[i % 3] += area * t->E[i];
        left[i % 3] += area * t->B[i];
        noise += area * t->B_error[i] * t->B_error[i];
        norm += area * t->B[i] * t->B[i];
    }
    printf("| %s | %.3f | %.3f | %.3f | %llu | %.4f | %.0e | ", name, left[0] / entered[0], left[1] / entered[1],
           left[2] / entered[2], (unsigned long long)t->settings.photons, sqrt(noise / (norm - noise)), t->lost);
    if (with_g->B != NULL && truth_difference(with_g, t, &away, &both) == 0)
        printf("%.3f (noise %.3f) |\n", away, both);
    else
        printf("|\n");
}

// 1 where a file is not up to date.
static int show_case(const chart_entry *entry, const settings *s)
{
    char name[CHART_NAME_SIZE];
    settings anisotropic = *s;
    chart_case chart;
    truth t, with_g;
    chart_entry_name(entry, name);
    const int made = chart_case_create(entry, 1.0, &chart);
    if (made != 0)
    {
        printf(s->list ? "%-40s no mesh\n" : "| %s | no mesh |\n", name);
        return made != CHART_LEFT_OUT;
    }
    const truth_status status = read_file(&chart, s, &t);
    anisotropic.truth.g = 0.8;
    const truth_status with_status = read_file(&chart, &anisotropic, &with_g);
    if (s->list)
        printf("%-40s %s%s%s\n", name, truth_status_string(status), with_status == TRUTH_NONE ? "" : "; g = 0.8: ",
               with_status == TRUTH_NONE ? "" : truth_status_string(with_status));
    else if (status == TRUTH_OK)
        table_line(name, &t, &with_g);
    if (s->table && (status != TRUTH_OK || (with_status != TRUTH_OK && with_status != TRUTH_NONE)))
        fprintf(stderr, "%s: %s; g = 0.8: %s\n", name, truth_status_string(status), truth_status_string(with_status));
    truth_free(&t);
    truth_free(&with_g);
    chart_case_free(&chart);
    return status != TRUTH_OK || (with_status != TRUTH_OK && with_status != TRUTH_NONE);
}

// ---- Verification ----

static double score(walk_total got, double want)
{
    return got.error > 0.0 ? (got.value - want) / got.error : 0.0;
}

// Each row has its own random numbers, so that rows are independent.
static int verify_layers(FILE *file, const settings *s, uint64_t photons, const sss_hooks *hooks)
{
    double squares = 0.0, sum = 0.0;
    int within = 0, count = 0;
    for (size_t i = 0; i < bench_layer_count; ++i)
    {
        const bench_layer *const l = &bench_layers[i];
        bench_result r;
        if (bench_run(l, photons, s->truth.seed + i, hooks, &r) != 0)
            return 1;
        for (int side = 0; side < (l->T >= 0.0 ? 2 : 1); ++side)
        {
            const walk_total got = side ? r.T : r.R;
            const double want = side ? l->T : l->R, away = fabs(got.value - want) - l->digits;
            squares += score(got, want) * score(got, want);
            sum += score(got, want);
            within += away <= 2.0 * got.error + 1e-3 * want;
            ++count;
            fprintf(file, "%s,%.8g,%g,%g,%g,%.8g,%c,%g,%.7f,%.7f,%+.2f,%.2e\n", l->source, l->albedo, l->depth, l->g,
                    l->eta, l->cosine, "RT"[side], want, got.value, got.error, score(got, want),
                    got.value / want - 1.0);
        }
        fflush(file);
    }
    printf("layers: %d of %d within two standard errors + 0.1 %%; z: mean %+.3f, root mean square %.3f\n", within,
           count, sum / count, sqrt(squares / count));
    return 0;
}

static int verify_rings(FILE *file, const settings *s, uint64_t photons, const sss_hooks *hooks)
{
    int within = 0, count = 0;
    for (size_t i = 0; i < bench_profile_count; ++i)
    {
        const bench_profile *const p = &bench_profiles[i];
        walk_total rings[BENCH_RINGS];
        if (bench_run_profile(p, photons, s->truth.seed + i, hooks, rings) != 0)
            return 1;
        for (size_t k = 0; k < BENCH_RINGS; ++k)
        {
            const double error = hypot(rings[k].error, p->error[k]);
            const double away = fabs(rings[k].value - p->flux[k]) - 5e-7; // six digits are given
            within += away <= 2.0 * error + p->allowance * p->flux[k];
            ++count;
            fprintf(file, "1.5 MCML case %s,%.8g,0,%g,%g,1,%g-%g,%g,%.7f,%.7f,%+.2f,%.2e\n", p->name, p->albedo, p->g,
                    p->eta, bench_ring_edges[k], bench_ring_edges[k + 1], p->flux[k], rings[k].value, rings[k].error,
                    (rings[k].value - p->flux[k]) / error, rings[k].value / p->flux[k] - 1.0);
        }
        fflush(file);
    }
    printf("rings: %d of %d within two standard errors (ours and MCML's) + what MCML is low by (0.3 %%, case H "
           "0.5 %%)\n",
           within, count);
    return 0;
}

static int verify(const settings *s, const sss_hooks *hooks)
{
    const uint64_t photons = s->truth.photons > 0 ? s->truth.photons : 1000000;
    FILE *const file = fopen(s->verify, "w");
    if (file == NULL)
    {
        perror(s->verify);
        return 1;
    }
    fprintf(file, "# build/tests/chart/truth --verify %s --photons %llu\n", s->verify, (unsigned long long)photons);
    fprintf(file, "source,albedo,depth,g,n,cosine,quantity,known,walk,standard_error,z,relative\n");
    const int failed = verify_layers(file, s, photons, hooks) != 0 || verify_rings(file, s, photons, hooks) != 0;
    return fclose(file) != 0 || failed;
}

// ---- The command ----

static int usage(const char *program)
{
    fprintf(stderr,
            "usage: %s CASE...|--all|--list|--table|--verify OUT.csv [--g G] [--photons N] [--noise X] [--steps N]\n"
            "       [--seed N] [--patches N] [--threads N] [--folder DIR]\n",
            program);
    return 2;
}

// An option with its value; 0 where it is one.
static int read_option(const char *name, const char *value, settings *s)
{
    char *end;
    const double number = strtod(value, &end);
    const int good = end != value && *end == '\0' && isfinite(number);
    if (strcmp(name, "--folder") == 0) s->folder = value;
    else if (strcmp(name, "--verify") == 0) s->verify = value;
    else if (!good) return 1;
    else if (strcmp(name, "--g") == 0) s->truth.g = number;
    else if (strcmp(name, "--photons") == 0) s->truth.photons = (uint64_t)number;
    else if (strcmp(name, "--noise") == 0) s->noise = number;
    else if (strcmp(name, "--steps") == 0) s->steps = number;
    else if (strcmp(name, "--seed") == 0) s->truth.seed = (uint64_t)number;
    else if (strcmp(name, "--patches") == 0) s->truth.patches = (size_t)number;
    else if (strcmp(name, "--threads") == 0) s->threads = (int)number;
    else return 1;
    return 0;
}

// Names of cases stay in argv; returns how many, or -1.
static int read_arguments(int argc, char **argv, settings *s)
{
    int names = 0;
    for (int i = 1; i < argc; ++i)
    {
        if (strncmp(argv[i], "--", 2) != 0) argv[1 + names++] = argv[i];
        else if (strcmp(argv[i], "--all") == 0) s->all = 1;
        else if (strcmp(argv[i], "--list") == 0) s->list = 1;
        else if (strcmp(argv[i], "--table") == 0) s->table = 1;
        else if (i + 1 >= argc || read_option(argv[i], argv[i + 1], s) != 0) return -1;
        else ++i;
    }
    const int good = fabs(s->truth.g) < 1.0 && s->noise > 0.0 && s->steps > 0.0 && s->truth.patches > 0 &&
                     s->threads > 0 && (names > 0 || s->all || s->list || s->table || s->verify != NULL);
    return good ? names : -1;
}

int main(int argc, char **argv)
{
    settings s;
    sss_hooks hooks;
    int failed = 0;
    memset(&s, 0, sizeof s);
    memset(&hooks, 0, sizeof hooks);
    s.truth.seed = 1;
    s.truth.patches = PATCHES;
    s.noise = 0.015;
    s.steps = 4e8;
    s.threads = threads_available();
    s.folder = "tests/chart/truth";
    const int names = read_arguments(argc, argv, &s);
    if (names < 0)
        return usage(argv[0]);
    hooks.user = &s.threads;
    hooks.parallel_for = threads_hook;
    if (s.verify != NULL)
        return verify(&s, &hooks);
    if (s.table)
        printf("| case | left/entered, red | green | blue | photons a channel | noise | lost | g = 0.8 against 0 |\n"
               "|---|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < chart_entry_count() && (s.all || s.list || s.table); ++i)
        failed |= s.all ? make_case(chart_entry_at(i), &s, &hooks) : show_case(chart_entry_at(i), &s);
    for (int i = 1; i <= names && !s.all && !s.list && !s.table; ++i)
    {
        const chart_entry *const entry = chart_entry_by_name(argv[i]);
        if (entry == NULL)
        {
            fprintf(stderr, "%s: no such case (--list)\n", argv[i]);
            failed = 1;
            continue;
        }
        failed |= make_case(entry, &s, &hooks);
    }
    return failed;
}
