#include "fit.h"

enum
{
    UNKNOWNS_MAX = VARIANTS_MAX + SSS_DIPOLE__FEATURES,
    EXPECTILE_ROUNDS = 13
};

// What a slope of 1 costs, in squared ln of one run; of a method, and of a knob. How many times an error above a knob's
// fit counts as much as one below. Chosen by what becomes of cases that are left out of the fit.
static const double RIDGE = 0.03, LEAN_RIDGE = 0.1, ABOVE = 3.0;
static const double ROUNDING = 1.01; // constants are printed with three digits: errors are rounded up

int ranked_method(const measured_run *run)
{
    for (int m = 0; m < SSS_DIPOLE_METHOD_COUNT; ++m)
    {
        if (strcmp(run->method, sss_dipole_method_name((sss_dipole_method)m)) == 0)
        {
            return m == SSS_DIPOLE_METHOD_DIRECT && run->density < 0.5 ? SSS_DIPOLE_METHOD_COUNT : m;
        }
    }
    return SSS_DIPOLE_METHOD_COUNT;
}

int is_variant(const measured_run *run, const sss_dipole__variant *v)
{
    return ranked_method(run) == (int)v->method && run->tolerance == v->tolerance && run->density == v->density &&
           run->directions == v->directions && run->storage == v->storage;
}

static size_t variant_of(const fitted *f, const measured_run *run)
{
    size_t i = 0;
    while (i < f->variant_count && !is_variant(run, &f->variants[i]))
    {
        ++i;
    }
    return i;
}

// In the order of methods, then of appearance.
static int find_variants(const measured *m, long without, fitted *f)
{
    for (int method = 0; method < SSS_DIPOLE_METHOD_COUNT; ++method)
    {
        for (size_t i = 0; i < m->run_count; ++i)
        {
            const measured_run *const run = &m->runs[i];
            if (ranked_method(run) != method || (long)run->which == without ||
                variant_of(f, run) < f->variant_count)
            {
                continue;
            }
            if (f->variant_count == VARIANTS_MAX)
            {
                fprintf(stderr, "more than %d variants\n", VARIANTS_MAX);
                return 1;
            }
            sss_dipole__variant *const v = &f->variants[f->variant_count++];
            memset(v, 0, sizeof *v);
            v->method = (sss_dipole_method)method;
            v->tolerance = run->tolerance;
            v->density = run->density;
            v->directions = run->directions;
            v->storage = run->storage;
        }
    }
    return f->variant_count == 0;
}

// ---- features ----

sss_dipole__curves fitted_curves(const fitted *f)
{
    const sss_dipole__curves curves = {f->variants, f->variant_count, f->slopes, f->ranges};
    return curves;
}

static void traits_of(const measured_case *c, const sss_dipole__curves *curves, sss_dipole__traits *t)
{
    sss_dipole_advice advice;
    double path, sigma;
    memset(&advice, 0, sizeof advice);
    memset(t, 0, sizeof *t);
    if (sss_dipole_needs(&c->profile, &c->scene, &advice) != SSS_OK)
    {
        fprintf(stderr, "%s: the scene is refused\n", c->name);
    }
    t->profile = &c->profile;
    t->curves = curves;
    t->lambert = advice.lambert_error;
    sss_dipole__mean_paths(&c->profile, &path, &sigma);
    sss_dipole__count_elements(&c->scene, &advice, t);
    sss_dipole__take_features(&c->scene, path, sigma, t);
}

double predicted_quantity(const measured_case *c, const sss_dipole__curves *curves, size_t variant, int quantity)
{
    sss_dipole__traits t;
    traits_of(c, curves, &t);
    return sss_dipole__curve(&curves->variants[variant], quantity, &t);
}

static void find_ranges(const measured *m, long without, fitted *f)
{
    static const double all[4][2] = {{-1e9, 1e9}, {-1e9, 1e9}, {-1e9, 1e9}, {-1e9, 1e9}};
    const sss_dipole__curves open = {NULL, 0, NULL, all};
    for (int k = 0; k < 4; ++k)
    {
        f->ranges[k][0] = HUGE_VAL;
        f->ranges[k][1] = -HUGE_VAL;
    }
    for (size_t c = 0; c < m->case_count; ++c)
    {
        sss_dipole__traits t;
        traits_of(&m->cases[c], &open, &t);
        for (int k = 0; k < 4 && (long)c != without; ++k)
        {
            f->ranges[k][0] = fmin(f->ranges[k][0], t.feature[k]);
            f->ranges[k][1] = fmax(f->ranges[k][1], t.feature[k]);
        }
    }
}

// ---- least squares ----

typedef struct equations
{
    double a[UNKNOWNS_MAX][UNKNOWNS_MAX], b[UNKNOWNS_MAX];
    size_t n;
} equations;

// Gauss-Jordan elimination; the matrix is positive definite, since unused unknowns get a diagonal of their own.
static void solve(equations *s)
{
    for (size_t i = 0; i < s->n; ++i)
    {
        const double pivot = s->a[i][i];
        for (size_t k = 0; k < s->n; ++k)
        {
            const double factor = s->a[k][i] / pivot;
            for (size_t j = i; j < s->n && k != i; ++j)
            {
                s->a[k][j] -= factor * s->a[i][j];
            }
            s->b[k] -= k != i ? factor * s->b[i] : 0.0;
        }
    }
    for (size_t i = 0; i < s->n; ++i)
    {
        s->b[i] /= s->a[i][i];
    }
}

static double measured_quantity(const measured_run *run, int quantity)
{
    const double all[SSS_DIPOLE__QUANTITIES] = {run->rel_l2, run->precompute_s, run->frame_ms, run->rebuild_ms,
                                                run->bytes};
    return all[quantity];
}

// Only errors depend on the light.
static int feature_count(int quantity)
{
    return quantity == SSS_DIPOLE__ERROR ? SSS_DIPOLE__FEATURES : 6;
}

typedef struct observation
{
    size_t variant;
    const double *feature;
    double y, value; // ln(measured/law), measured
} observation;

static int observe(const fitted *f, const sss_dipole__traits *traits, const measured_run *run, int quantity,
                   observation *o)
{
    o->variant = variant_of(f, run);
    const double law = sss_dipole__law(&f->variants[o->variant], quantity, &traits[run->which]);
    const double value = measured_quantity(run, quantity);
    o->feature = traits[run->which].feature;
    o->y = law > 0.0 && value > 0.0 ? log(value / law) : 0.0;
    o->value = value;
    return law > 0.0 && value > 0.0;
}

// An error beyond FAR counts less, since nobody asks how far beyond.
static double weight_of(const observation *o, int quantity)
{
    return quantity == SSS_DIPOLE__ERROR && o->value > FAR ? pow(FAR / o->value, 2.0) : 1.0;
}

static void add(equations *s, size_t variant_count, int features, const observation *o, double weight)
{
    double x[UNKNOWNS_MAX] = {0.0};
    x[o->variant] = 1.0;
    memcpy(x + variant_count, o->feature, (size_t)features * sizeof *x);
    for (size_t i = 0; i < s->n; ++i)
    {
        for (size_t k = 0; k < s->n; ++k)
        {
            s->a[i][k] += weight * x[i] * x[k];
        }
        s->b[i] += weight * x[i] * o->y;
    }
}

// What the method's slopes leave of ln y.
static double left_over(const fitted *f, const observation *o, int method, int quantity)
{
    const sss_dipole__variant *const v = &f->variants[o->variant];
    double left = o->y - log(v->scale[quantity]);
    for (int k = 0; k < SSS_DIPOLE__FEATURES; ++k)
    {
        left -= (f->slopes[method][quantity][k] + (quantity == SSS_DIPOLE__ERROR ? v->lean[k] : 0.0)) * o->feature[k];
    }
    return left;
}

// The runs of a method, one after the other, from *i on; 0 at the end.
static int next(const measured *m, long without, const sss_dipole__traits *traits, int method, int quantity,
                const fitted *f, size_t *i, observation *o)
{
    for (; *i < m->run_count; ++*i)
    {
        const measured_run *const run = &m->runs[*i];
        if ((long)run->which != without && ranked_method(run) == method && observe(f, traits, run, quantity, o))
        {
            ++*i;
            return 1;
        }
    }
    return 0;
}

// What a knob's own scale and lean add, for one observation.
static double leaning(const double solution[1 + SSS_DIPOLE__FEATURES], const observation *o)
{
    double sum = solution[0];
    for (int k = 0; k < SSS_DIPOLE__FEATURES; ++k)
    {
        sum += solution[1 + k] * o->feature[k];
    }
    return sum;
}

// How a knob's errors lean away from those of its method: a fit to what is left of them. Since the run that lies
// farthest above the fit raises the predictions of all (measure_scatter), those above count more: expectiles (Newey and
// Powell 1987), by weighted least squares, again and again.
static void fit_lean(const measured *m, long without, const sss_dipole__traits *traits, int method, size_t variant,
                     fitted *f)
{
    static equations s;
    double solution[1 + SSS_DIPOLE__FEATURES] = {HUGE_VAL}; // nothing lies above
    observation o;
    for (int round = 0; round < EXPECTILE_ROUNDS; ++round)
    {
        memset(&s, 0, sizeof s);
        s.n = 1 + SSS_DIPOLE__FEATURES;
        for (size_t k = 0; k < s.n; ++k)
        {
            s.a[k][k] = k == 0 ? 1e-12 : LEAN_RIDGE;
        }
        for (size_t i = 0; next(m, without, traits, method, SSS_DIPOLE__ERROR, f, &i, &o);)
        {
            if (o.variant == variant)
            {
                const double weight = weight_of(&o, SSS_DIPOLE__ERROR);
                o.y = left_over(f, &o, method, SSS_DIPOLE__ERROR);
                o.variant = 0;
                add(&s, 1, SSS_DIPOLE__FEATURES, &o, o.y > leaning(solution, &o) ? ABOVE * weight : weight);
            }
        }
        solve(&s);
        memcpy(solution, s.b, sizeof solution);
    }
    f->variants[variant].scale[SSS_DIPOLE__ERROR] *= exp(solution[0]);
    memcpy(f->variants[variant].lean, solution + 1, sizeof f->variants[variant].lean);
}

// The scatter that is left, and what raises errors over all of it.
static void measure_scatter(const measured *m, long without, const sss_dipole__traits *traits, int method,
                            int quantity, fitted *f)
{
    double worst[VARIANTS_MAX] = {0.0}, sum = 0.0, count = 0.0;
    observation o;
    for (size_t i = 0; next(m, without, traits, method, quantity, f, &i, &o);)
    {
        const double left = left_over(f, &o, method, quantity);
        worst[o.variant] = fmax(worst[o.variant], left + log(fmin(1.0, FAR / o.value)));
        sum += left * left;
        count += 1.0;
    }
    f->scatter[method][quantity] = count > 0.0 ? sqrt(sum / count) : 0.0;
    for (size_t v = 0; v < f->variant_count && quantity == SSS_DIPOLE__ERROR; ++v)
    {
        if ((int)f->variants[v].method == method)
        {
            f->safety[v] = ROUNDING * exp(worst[v]);
            f->variants[v].scale[quantity] *= f->safety[v];
        }
    }
}

// One quantity of one method.
static void fit_quantity(const measured *m, long without, const sss_dipole__traits *traits, int method, int quantity,
                         fitted *f)
{
    static equations s;
    const int features = feature_count(quantity);
    observation o;
    memset(&s, 0, sizeof s);
    s.n = f->variant_count + (size_t)features;
    for (size_t i = 0; i < s.n; ++i)
    {
        s.a[i][i] = i < f->variant_count ? 1e-12 : RIDGE;
    }
    for (size_t i = 0; next(m, without, traits, method, quantity, f, &i, &o);)
    {
        add(&s, f->variant_count, features, &o, weight_of(&o, quantity));
    }
    solve(&s);
    memcpy(f->slopes[method][quantity], s.b + f->variant_count, (size_t)features * sizeof(double));
    for (size_t i = 0; next(m, without, traits, method, quantity, f, &i, &o);)
    {
        f->variants[o.variant].scale[quantity] = exp(s.b[o.variant]);
    }
    for (size_t v = 0; v < f->variant_count && quantity == SSS_DIPOLE__ERROR; ++v)
    {
        if ((int)f->variants[v].method == method)
        {
            fit_lean(m, without, traits, method, v, f);
        }
    }
    measure_scatter(m, without, traits, method, quantity, f);
}

int fit_curves(const measured *m, long without, fitted *out)
{
    memset(out, 0, sizeof *out);
    sss_dipole__traits *const traits = (sss_dipole__traits *)calloc(m->case_count, sizeof *traits);
    if (!traits || find_variants(m, without, out) != 0)
    {
        free(traits);
        return 1;
    }
    find_ranges(m, without, out);
    const sss_dipole__curves curves = fitted_curves(out);
    for (size_t c = 0; c < m->case_count; ++c)
    {
        traits_of(&m->cases[c], &curves, &traits[c]);
    }
    for (int method = 0; method < SSS_DIPOLE_METHOD_COUNT; ++method)
    {
        for (int quantity = 0; quantity < SSS_DIPOLE__QUANTITIES; ++quantity)
        {
            fit_quantity(m, without, traits, method, quantity, out);
        }
    }
    free(traits);
    return 0;
}

// ---- the header's lines ----

static const char *const identifiers[SSS_DIPOLE_METHOD_COUNT] = {"LAMBERT", "DIRECT",     "POINTS", "PLACED",
                                                                 "BEM",     "BEM_RENDER", "HAO"};

// To three decimals, without a sign on zero.
static double rounded(double x)
{
    return round(1e3 * x) / 1e3 + 0.0;
}

static void print_row(const double row[SSS_DIPOLE__FEATURES])
{
    for (int k = 0; k < SSS_DIPOLE__FEATURES; ++k)
    {
        printf("%s%.3f", k == 0 ? "{" : ", ", rounded(row[k]));
    }
    printf("}");
}

static void print_variants(const fitted *f)
{
    printf("// Method, tolerance, density, directions, storage, then the scales of error, s, ms, ms and bytes;\n"
           "// below how its error leans.\n"
           "static const sss_dipole__variant sss_dipole__variants[] = {\n");
    for (size_t i = 0; i < f->variant_count; ++i)
    {
        const sss_dipole__variant *const v = &f->variants[i];
        printf("    {SSS_DIPOLE_METHOD_%s, %g, %.6g, %d, %d, {%.2e, %.2e, %.2e, %.2e, %.2e},\n     ",
               identifiers[v->method], v->tolerance, v->density, v->directions, v->storage, v->scale[0], v->scale[1],
               v->scale[2], v->scale[3], v->scale[4]);
        print_row(v->lean);
        printf("},\n");
    }
    printf("};\n");
}

static void print_slopes(const fitted *f)
{
    printf("static const double sss_dipole__slopes[SSS_DIPOLE_METHOD_COUNT][SSS_DIPOLE__QUANTITIES]"
           "[SSS_DIPOLE__FEATURES] = {\n");
    for (int m = 0; m < SSS_DIPOLE_METHOD_COUNT; ++m)
    {
        printf("    // %s\n", sss_dipole_method_name((sss_dipole_method)m));
        for (int q = 0; q < SSS_DIPOLE__QUANTITIES; ++q)
        {
            printf("    %s", q == 0 ? "{" : " ");
            print_row(f->slopes[m][q]);
            printf("%s,\n", q == SSS_DIPOLE__QUANTITIES - 1 ? "}" : "");
        }
    }
    printf("};\n");
}

void print_curves(const fitted *f, const char *source)
{
    printf("// %s\n", source);
    print_variants(f);
    print_slopes(f);
    printf("static const double sss_dipole__ranges[4][2] = {{%.3f, %.3f}, {%.3f, %.3f}, {%.3f, %.3f}, {%.3f, %.3f}};\n",
           f->ranges[0][0], f->ranges[0][1], f->ranges[1][0], f->ranges[1][1], f->ranges[2][0], f->ranges[2][1],
           f->ranges[3][0], f->ranges[3][1]);
}
