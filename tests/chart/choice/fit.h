// Fits the curves of sss_dipole_needs to measured runs.
//
// A quantity y (error, times, bytes) of a method is law x scale x exp(slopes . features): the law is what it is
// proportional to by construction (sss_dipole__law), the scale belongs to the method's knob, the slopes to the method.
// ln(y/law) is fitted by least squares, with a ridge on the slopes that holds them to the law, i.e. at 0, where the
// runs do not say otherwise. The scale of an error is then raised until no run of that knob is above its prediction;
// beyond FAR an error is just large.

#ifndef SSS_TESTS_CHART_CHOICE_FIT_H
#define SSS_TESTS_CHART_CHOICE_FIT_H

// The private functions and types of the header are what is fitted: a copy of them for each source file.
#define SSS_DIPOLE_STATIC
#define SSS_DIPOLE_IMPLEMENTATION
#include "../../../sss_dipole.h"

#include "runs.h"

static const double FAR = 0.15; // half as much again as the loosest tolerance of the bars

enum
{
    VARIANTS_MAX = 48,
    CASES_ALL = -1
};

typedef struct fitted
{
    sss_dipole__variant variants[VARIANTS_MAX];
    size_t variant_count;
    double slopes[SSS_DIPOLE_METHOD_COUNT][SSS_DIPOLE__QUANTITIES][SSS_DIPOLE__FEATURES];
    double ranges[4][2];
    double scatter[SSS_DIPOLE_METHOD_COUNT][SSS_DIPOLE__QUANTITIES]; // root mean square of what is left of ln y
    double safety[VARIANTS_MAX];                                     // factor on an error's scale
} fitted;

// Of all cases but `without`. Returns 0, or 1 with a message.
int fit_curves(const measured *m, long without, fitted *out);

// What the header's functions take.
sss_dipole__curves fitted_curves(const fitted *f);

// A prediction for a case by itself.
double predicted_quantity(const measured_case *c, const sss_dipole__curves *curves, size_t variant, int quantity);

// The method of a run that may be ranked; SSS_DIPOLE_METHOD_COUNT for the others: the plain loop, the paper's oracle,
// and integration on thinned copies, which is never better than points on them.
int ranked_method(const measured_run *run);

// Whether a run is this variant's.
int is_variant(const measured_run *run, const sss_dipole__variant *v);

// The lines of the header, as they stand between its markers.
void print_curves(const fitted *f, const char *source);

#endif
