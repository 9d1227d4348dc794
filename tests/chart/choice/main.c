// What sss_dipole_needs chooses, held against every run of the chart.
//   build/tests/chart/choice [CHART.csv] [TEST-NAME]   the bars; another chart than the header's has its own fit
//   build/tests/chart/choice fit CSV           prints the constants of sss_dipole.h (fit.sh writes them there)
//   build/tests/chart/choice scatter CSV       how far the curves are from the runs
//   build/tests/chart/choice list CSV          every choice, one a line: choice.csv
//   build/tests/chart/choice summary CSV       how many meet the bars: summary.csv
//   build/tests/chart/choice meshes FILE       writes what sss_dipole_measure says of the chart's meshes, of 1 mm
//
// The bars: for a still picture, for light that changes and for everything that changes, on every case and for
// tolerances of 10, 3, 1 and 0.3 %, the chosen run (the ranking's knobs are the chart's) has a measured error within
// the tolerance, and costs at most 1.5 times the cheapest of all runs that have; where Lambert has, no more than that.
// Since the curves are fitted to the same runs, the same is counted with each case left out of the fit.

#include "fit.h"

#include "../../common/test.h"
#include "../cases.h"

static const char *const CHART = "tests/chart/chart.csv", *const MESHES = "tests/chart/choice/meshes.csv";
static const double tolerances[] = {0.1, 0.03, 0.01, 0.003};
static const double DEARER = 1.5;       // than the cheapest, at most

static const struct
{
    const char *name;
    unsigned changes;
} scenarios[] = {{"still picture", 0u},
                 {"light changes", SSS_DIPOLE_CHANGES_LIGHT},
                 {"all changes", SSS_DIPOLE_CHANGES_LIGHT | SSS_DIPOLE_CHANGES_GEOMETRY | SSS_DIPOLE_CHANGES_MATERIAL}};

enum
{
    TOLERANCES = sizeof tolerances / sizeof tolerances[0],
    SCENARIOS = sizeof scenarios / sizeof scenarios[0]
};

// ---- one choice ----

static sss_dipole__curves header_curves(void)
{
    const sss_dipole__curves curves = {sss_dipole__variants,
                                       sizeof sss_dipole__variants / sizeof sss_dipole__variants[0],
                                       sss_dipole__slopes, sss_dipole__ranges};
    return curves;
}

typedef struct verdict
{
    const measured_run *chosen;   // NULL: not a run of the chart
    const measured_run *cheapest; // within the tolerance; NULL: there is none
    sss_dipole_choice choice;
    double cost, least, lambert_cost; // ms
    int within, cheap;  // meets the tolerance; costs at most 1.5 times the least
    int lambert;        // Lambert is within the tolerance
} verdict;

static double cost_of(const measured_run *run, unsigned changes)
{
    const unsigned again = SSS_DIPOLE_CHANGES_GEOMETRY | SSS_DIPOLE_CHANGES_MATERIAL;
    return run->frame_ms + (changes == 0u ? 1e3 * run->precompute_s : changes & again ? run->rebuild_ms : 0.0);
}

// What the chart has not run on a case cannot be chosen there: the light is not one that a method can express, or its
// integrals would take more memory than the chart allows itself.
static size_t variants_run(const measured *m, size_t which, const sss_dipole__curves *curves,
                           sss_dipole__variant out[VARIANTS_MAX])
{
    size_t count = 0;
    for (size_t v = 0; v < curves->variant_count; ++v)
    {
        int found = 0;
        for (size_t i = 0; i < m->run_count; ++i)
        {
            found |= m->runs[i].which == which && is_variant(&m->runs[i], &curves->variants[v]);
        }
        if (found)
        {
            out[count++] = curves->variants[v];
        }
    }
    return count;
}

// What sss_dipole_needs ranks first, of the variants that there are. curves: NULL for the header's own.
static int choose(const measured *m, size_t which, double tolerance, unsigned changes,
                  const sss_dipole__curves *curves, sss_dipole_choice *out)
{
    static sss_dipole__variant there[VARIANTS_MAX];
    sss_dipole__curves of_case = curves ? *curves : header_curves();
    sss_dipole_scene scene = m->cases[which].scene;
    sss_dipole_advice advice;
    memset(&advice, 0, sizeof advice);
    scene.tolerance = tolerance;
    scene.changes = changes;
    if (sss_dipole_needs(&m->cases[which].profile, &scene, &advice) != SSS_OK)
    {
        return 1;
    }
    of_case.variant_count = variants_run(m, which, &of_case, there);
    of_case.variants = there;
    advice.ranking_count = 0;
    sss_dipole__rank(&m->cases[which].profile, &scene, &of_case, &advice);
    *out = advice.ranking[0];
    return advice.ranking_count == 0;
}

static void judge(const measured *m, size_t which, double tolerance, unsigned changes,
                  const sss_dipole__curves *curves, verdict *v)
{
    memset(v, 0, sizeof *v);
    v->least = HUGE_VAL;
    if (choose(m, which, tolerance, changes, curves, &v->choice) != 0)
    {
        return;
    }
    const sss_dipole__variant variant = {v->choice.method, v->choice.tolerance, v->choice.density,
                                         (int)v->choice.directions, v->choice.storage, {0.0}, {0.0}};
    for (size_t i = 0; i < m->run_count; ++i)
    {
        const measured_run *const run = &m->runs[i];
        const double cost = cost_of(run, changes);
        if (run->which != which)
        {
            continue;
        }
        if (is_variant(run, &variant))
        {
            v->chosen = run;
            v->cost = cost;
        }
        if (run->rel_l2 <= tolerance && cost < v->least)
        {
            v->cheapest = run;
            v->least = cost;
        }
        if (strcmp(run->method, "lambert") == 0 && run->rel_l2 <= tolerance)
        {
            v->lambert = 1;
            v->lambert_cost = cost;
        }
    }
    v->within = v->chosen && v->chosen->rel_l2 <= tolerance;
    v->cheap = v->chosen && v->cost <= DEARER * v->least;
}

static void print_run(const char *method, double tolerance, double density, int directions, int storage)
{
    printf("%s(%g;%g;%d;%d)", method, tolerance, density, directions, storage);
}

// What was chosen, with tolerance, density, directions and storage; what is cheapest; and what they cost.
static void print_verdict(const char *head, const measured_case *c, double tolerance, const char *scenario,
                          const verdict *v)
{
    const measured_run *const best = v->cheapest;
    printf("%s%s,%g,%s,", head, c->name, tolerance, scenario);
    print_run(sss_dipole_method_name(v->choice.method), v->choice.tolerance, v->choice.density,
              (int)v->choice.directions, v->choice.storage);
    printf(",%.3g,%.3g,%.4g,%.4g,", v->chosen ? v->chosen->rel_l2 : NAN, v->choice.predicted_error, v->cost,
           v->choice.cost_ms);
    if (best)
    {
        print_run(best->method, best->tolerance, best->density, best->directions, best->storage);
        printf(",%.3g,%.4g,%.3g,%d", best->rel_l2, v->least, v->cost / v->least, v->within && v->cheap);
    }
    else
    {
        printf(",,,,");
    }
    printf("\n");
}

// ---- counting ----

typedef struct counts
{
    size_t asked, within, cheap, both; // of those where some run is within the tolerance
    size_t lambert, lambert_kept;      // of those where Lambert is
    double dearest;                    // times the least, among those within the tolerance
} counts;

static void tally(const verdict *v, counts *n)
{
    if (!v->cheapest)
    {
        return;
    }
    ++n->asked;
    n->within += (size_t)v->within;
    n->cheap += (size_t)v->cheap;
    n->both += (size_t)(v->within && v->cheap);
    n->lambert += (size_t)v->lambert;
    n->lambert_kept += (size_t)(v->lambert && v->within && v->cost <= v->lambert_cost);
    n->dearest = v->within ? fmax(n->dearest, v->cost / v->least) : n->dearest;
}

typedef enum listing
{
    NOTHING,
    MISSES,
    EVERYTHING
} listing;

// f: curves, `stride` further for each case; NULL for the header's own. Prints what it is told to.
static void count_scenario(const measured *m, size_t scenario, const fitted *f, size_t stride, listing list, counts *n)
{
    memset(n, 0, sizeof *n);
    for (size_t c = 0; c < m->case_count; ++c)
    {
        for (size_t t = 0; t < TOLERANCES; ++t)
        {
            verdict v;
            sss_dipole__curves curves;
            if (f)
            {
                curves = fitted_curves(&f[c * stride]);
            }
            judge(m, c, tolerances[t], scenarios[scenario].changes, f ? &curves : NULL, &v);
            tally(&v, n);
            if (list == EVERYTHING || (list == MISSES && v.cheapest && (!v.within || !v.cheap)))
            {
                print_verdict(list == EVERYTHING ? "" : "    ", &m->cases[c], tolerances[t], scenarios[scenario].name,
                              &v);
            }
        }
    }
}

// ---- the tests ----

static measured chart;
static const fitted *other_chart; // curves fitted to it, where it is not the one of the header; else NULL

static int read_chart(const char *path, measured *m)
{
    static measured_mesh meshes[MESHES_MAX];
    return measured_read(path, meshes, meshes_read(MESHES, meshes), m);
}

// Returns 0; CHART_LEFT_OUT where it is not there; 1 on failure.
static int measure_mesh(const char *name, measured_mesh *out)
{
    mesh_data mesh;
    sss_dipole_scene scene;
    const int result = chart_mesh(name, 1.0, &mesh);
    memset(out, 0, sizeof *out);
    memset(&scene, 0, sizeof scene);
    if (result != 0)
    {
        return result;
    }
    const sss_mesh view = mesh_view(&mesh, 1.0 / mesh_extent(&mesh));
    const int failed = sss_dipole_measure(&view, &scene) != SSS_OK;
    mesh_free(&mesh);
    snprintf(out->name, sizeof out->name, "%s", name);
    out->area_mm2 = scene.area_mm2;
    out->volume_mm3 = scene.volume_mm3;
    out->spacing_mm = scene.spacing_mm;
    return failed;
}

static void the_meshes_are_the_charts(void)
{   // Oracle: the meshes themselves, those that are here; and every case's mesh has its line.
    measured_mesh known[MESHES_MAX];
    const size_t count = meshes_read(MESHES, known);
    size_t found = 0;
    for (size_t i = 0; i < count; ++i)
    {
        measured_mesh mesh;
        test_about("%s", known[i].name);
        const int result = measure_mesh(known[i].name, &mesh);
        CHECK(result == 0 || result == CHART_LEFT_OUT);
        if (result == 0)
        {
            CHECK_REL(known[i].area_mm2, mesh.area_mm2, 1e-5);
            CHECK_REL(known[i].volume_mm3, mesh.volume_mm3, 1e-5);
            CHECK_REL(known[i].spacing_mm, mesh.spacing_mm, 1e-5);
        }
    }
    for (size_t c = 0; c < chart.case_count; ++c)
        for (size_t i = 0; i < count; ++i)
            found += strcmp(known[i].name, chart.cases[c].mesh) == 0;
    test_about("cases");
    CHECK_EQUAL(found, chart.case_count);
}

static void the_header_has_the_fitted_constants(void)
{   // Oracle: the fit itself, of the chart that is committed; three digits of it, which fit.sh --write puts there.
    static fitted f;
    if (other_chart)
        SKIP("another chart");
    if (!CHECK_EQUAL(fit_curves(&chart, CASES_ALL, &f), 0))
        return;
    const size_t variants = sizeof sss_dipole__variants / sizeof sss_dipole__variants[0];
    double scales = 0.0, slopes = 0.0, ranges = 0.0;
    size_t alike = 0;
    CHECK_EQUAL(variants, f.variant_count);
    for (size_t i = 0; i < f.variant_count && i < variants; ++i)
    {
        const sss_dipole__variant *const v = &f.variants[i], *const h = &sss_dipole__variants[i];
        alike += v->method == h->method && v->tolerance == h->tolerance && v->directions == h->directions &&
                 v->storage == h->storage && fabs(v->density - h->density) < 1e-5;
        for (int q = 0; q < SSS_DIPOLE__QUANTITIES; ++q)
            scales = fmax(scales, v->scale[q] > 0.0 ? fabs(h->scale[q] / v->scale[q] - 1.0) : h->scale[q]);
        for (int k = 0; k < SSS_DIPOLE__FEATURES; ++k)
            slopes = fmax(slopes, fabs(h->lean[k] - v->lean[k]));
    }
    for (int m = 0; m < SSS_DIPOLE_METHOD_COUNT; ++m)
        for (int q = 0; q < SSS_DIPOLE__QUANTITIES; ++q)
            for (int k = 0; k < SSS_DIPOLE__FEATURES; ++k)
                slopes = fmax(slopes, fabs(sss_dipole__slopes[m][q][k] - f.slopes[m][q][k]));
    for (int k = 0; k < 4; ++k)
        for (int end = 0; end < 2; ++end)
            ranges = fmax(ranges, fabs(sss_dipole__ranges[k][end] - f.ranges[k][end]));
    CHECK_EQUAL(alike, variants);
    CHECK_BELOW(scales, 0.006);
    CHECK_BELOW(slopes, 6e-4);
    CHECK_BELOW(ranges, 6e-4);
}

static void no_error_is_above_its_prediction(void)
{   // Oracle: every run of the chart that can be ranked.
    const sss_dipole__curves curves = other_chart ? fitted_curves(other_chart) : header_curves();
    double worst = 0.0, sum = 0.0;
    size_t n = 0;
    for (size_t i = 0; i < chart.run_count; ++i)
    {
        const measured_run *const run = &chart.runs[i];
        for (size_t k = 0; k < curves.variant_count; ++k)
            if (is_variant(run, &curves.variants[k]))
            {
                const double predicted = predicted_quantity(&chart.cases[run->which], &curves, k, SSS_DIPOLE__ERROR);
                worst = fmax(worst, fmin(run->rel_l2, FAR) / predicted);
                sum += log(predicted / run->rel_l2);
                ++n;
            }
    }
    test_note("%zu runs, predicted over measured: %.2f in the geometric mean, %.3f at least", n, exp(sum / (double)n),
              1.0 / worst);
    CHECK(n > 50);
    CHECK_BELOW(worst, 1.0);
}

static void the_models_error_is_told_apart(void)
{   // Oracle: the random walk, where the chart has it: least over the methods of each case. The interval is what LIMITS
    // says.
    double most = 0.0, least = HUGE_VAL;
    size_t n = 0;
    for (size_t c = 0; c < chart.case_count; ++c)
    {
        sss_dipole_advice a;
        const measured_case *const k = &chart.cases[c];
        if (!(k->model_l2 > 0.0) || sss_dipole_needs(&k->profile, &k->scene, &a) != SSS_OK)
            continue;
        test_note("%s: predicted %.3g, measured %.3g", k->name, a.model_error, k->model_l2);
        most = fmax(most, a.model_error / k->model_l2);
        least = fmin(least, a.model_error / k->model_l2);
        ++n;
    }
    if (n == 0)
        SKIP("the chart has no model errors");
    test_note("predicted over measured: %.2g to %.2g on %zu cases", least, most, n);
    CHECK_BETWEEN(least, 0.5, 8.0);
    CHECK_BETWEEN(most, 0.5, 8.0);
    CHECK_BAR_BELOW(most, 4.0, 8.0, "model error predicted over measured");
}

static void check_bars(const fitted *f, size_t stride, const double regression[SCENARIOS][3])
{
    for (size_t s = 0; s < SCENARIOS; ++s)
    {
        counts n;
        count_scenario(&chart, s, f, stride, MISSES, &n);
        const double asked = (double)n.asked;
        test_about("%s", scenarios[s].name);
        test_note("%zu choices: %zu within the tolerance, %zu at most %.1f times as dear as the cheapest, %zu both, "
                  "dearest %.2f; Lambert is enough in %zu, no more spent in %zu", n.asked, n.within, n.cheap, DEARER,
                  n.both, n.dearest, n.lambert, n.lambert_kept);
        CHECK(n.asked > chart.case_count);
        CHECK_BAR_ABOVE((double)n.within / asked, 1.0, regression[s][0], "share of choices within the tolerance");
        CHECK_BAR_ABOVE((double)n.cheap / asked, 1.0, regression[s][1],
                        "share of choices at most 1.5 times as dear as the cheapest that is within");
        if (n.lambert > 0)
            CHECK_BAR_ABOVE((double)n.lambert_kept / (double)n.lambert, 1.0, regression[s][2],
                            "share that costs no more than Lambert where that is enough");
    }
}

static void the_choice_meets_its_bars(void)
{   // Oracle: every run of the chart.
    static const double regression[SCENARIOS][3] = {{0.97, 0.82, 0.3}, {0.97, 0.78, 0.3}, {0.97, 0.72, 0.3}};
    check_bars(other_chart, 0, regression);
}

static void on_cases_that_the_fit_has_not_seen(void)
{   // Oracle: as above; each case is chosen for by curves that are fitted to the others.
    static const double regression[SCENARIOS][3] = {{0.82, 0.82, 0.2}, {0.87, 0.77, 0.2}, {0.82, 0.68, 0.2}};
    fitted *const f = (fitted *)calloc(chart.case_count, sizeof *f);
    int failed = f == NULL;
    for (size_t c = 0; c < chart.case_count && !failed; ++c)
        failed = fit_curves(&chart, (long)c, &f[c]);
    if (CHECK(!failed))
        check_bars(f, 1, regression);
    free(f);
}

// ---- commands ----

static int run_meshes(const char *path)
{
    FILE *const file = fopen(path, "w");
    int failed = !file || fprintf(file, "mesh,area_mm2,volume_mm3,spacing_mm\n") < 0;
    for (size_t i = 0; i < chart_entry_count() && !failed; ++i)
    {
        const char *const name = chart_entry_at(i)->mesh;
        measured_mesh mesh;
        size_t k = 0;
        while (strcmp(chart_entry_at(k)->mesh, name) != 0)
        {
            ++k;
        }
        failed = k == i && measure_mesh(name, &mesh) != 0; // k < i: it is there already
        if (k == i && !failed)
        {
            fprintf(file, "%s,%.6g,%.6g,%.6g\n", name, mesh.area_mm2, mesh.volume_mm3, mesh.spacing_mm);
        }
    }
    failed = !file || fclose(file) != 0 || failed;
    return failed;
}

static int run_fit(const char *path)
{
    static fitted f;
    measured m;
    char source[256];
    int failed = read_chart(path, &m) != 0 || fit_curves(&m, CASES_ALL, &f) != 0;
    if (!failed)
    {
        snprintf(source, sizeof source, "%zu runs on %zu cases", m.run_count, m.case_count);
        print_curves(&f, source);
    }
    measured_free(&m);
    return failed;
}

static int run_scatter(const char *path)
{
    static fitted f;
    measured m;
    const int failed = read_chart(path, &m) != 0 || fit_curves(&m, CASES_ALL, &f) != 0;
    printf("Root mean square of ln(measured/fitted): error, precompute, frame, rebuild, bytes\n");
    for (int k = 0; k < SSS_DIPOLE_METHOD_COUNT && !failed; ++k)
    {
        printf("%-14s", sss_dipole_method_name((sss_dipole_method)k));
        for (int q = 0; q < SSS_DIPOLE__QUANTITIES; ++q)
        {
            printf(" %6.3f", f.scatter[k][q]);
        }
        printf("\n");
    }
    printf("Safety factors of errors\n");
    for (size_t i = 0; i < f.variant_count && !failed; ++i)
    {
        const sss_dipole__variant *const v = &f.variants[i];
        printf("%-14s tolerance %g density %g directions %d storage %d: %.2f\n", sss_dipole_method_name(v->method),
               v->tolerance, v->density, v->directions, v->storage, f.safety[i]);
    }
    measured_free(&m);
    return failed;
}

// Both counts, as they stand in summary.csv.
static int run_summary(const char *path)
{
    measured m;
    if (read_chart(path, &m) != 0)
    {
        return 1;
    }
    fitted *const f = (fitted *)calloc(m.case_count, sizeof *f);
    int failed = f == NULL;
    for (size_t c = 0; c < m.case_count && !failed; ++c)
    {
        failed = fit_curves(&m, (long)c, &f[c]);
    }
    printf("scenario,fitted_to,choices,within_tolerance,within_1.5_of_cheapest,both,dearest,lambert_enough,"
           "no_more_than_lambert\n");
    for (size_t k = 0; k < 2 * SCENARIOS && !failed; ++k)
    {
        counts n;
        count_scenario(&m, k / 2, k % 2 ? f : NULL, 1, NOTHING, &n);
        printf("%s,%s,%zu,%zu,%zu,%zu,%.3g,%zu,%zu\n", scenarios[k / 2].name, k % 2 ? "the other cases" : "all cases",
               n.asked, n.within, n.cheap, n.both, n.dearest, n.lambert, n.lambert_kept);
    }
    free(f);
    measured_free(&m);
    return failed;
}

static int run_list(const char *path)
{
    measured m;
    printf("case,tolerance,scenario,chosen,rel_l2,predicted_error,cost_ms,predicted_ms,cheapest,cheapest_rel_l2,"
           "cheapest_ms,times,bars\n");
    if (read_chart(path, &m) != 0)
    {
        return 1;
    }
    for (size_t s = 0; s < SCENARIOS; ++s)
    {
        counts n;
        count_scenario(&m, s, NULL, 0, EVERYTHING, &n);
    }
    measured_free(&m);
    return 0;
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {TEST(the_meshes_are_the_charts), TEST(the_header_has_the_fitted_constants),
                                      TEST(no_error_is_above_its_prediction),
                                      TEST(the_models_error_is_told_apart), TEST(the_choice_meets_its_bars),
                                      TEST(on_cases_that_the_fit_has_not_seen)};
    const struct
    {
        const char *name;
        int (*run)(const char *path);
    } commands[] = {{"fit", run_fit}, {"scatter", run_scatter}, {"list", run_list}, {"summary", run_summary},
                    {"meshes", run_meshes}};
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; ++i)
    {
        if (argc == 3 && strcmp(argv[1], commands[i].name) == 0)
        {
            return commands[i].run(argv[2]);
        }
    }
    const char *const path = argc > 1 && strstr(argv[1], ".csv") ? argv[1] : CHART;
    if (read_chart(path, &chart) != 0)
    {
        return 1;
    }
    if (path != CHART)
    {
        static fitted f;
        if (fit_curves(&chart, CASES_ALL, &f) != 0)
        {
            return 1;
        }
        other_chart = &f;
        --argc;
        ++argv;
    }
    const int status = test_main(argc, argv, "choice", tests, sizeof tests / sizeof *tests);
    measured_free(&chart);
    return status;
}
